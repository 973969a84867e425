//! Cases of the kinds `gradient` and `gradient_growth`: derivatives of a cost along a run.

use super::case::{CompositionCase, Deviation, Runs, raise};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use std::sync::Arc;
use vi_constraints::design::{Costates, Design, Place};
use vi_constraints::linearization::{Costate, Tangent};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_control::momentum::TerminalMomentum;
use vi_control::objective::{
    CostTerm, Effort, Last, NumberCost, Objective, PointComponent, Running, Terminal, Time,
};
use vi_control::sensitivities::Beside;
use vi_control::{
    Checkpoints, ControlForce, Controls, Direction, Gradient, JointControl, Sensitivities, Task,
};
use vi_core::linear::dot;
use vi_core::{MechanicalSystem, Quadrature};
use vi_multibody::builder::{BuiltMechanism, Inertia, JointId, MechanismBuilder, PointOn};
use vi_multibody::design::start::{StartCoordinate, StartDerivatives, StartTangent, derivatives};
use vi_multibody::design::{
    BodyTangent, EffortChange, MechanismDesign, MechanismTangent, SpringTangent,
};
use vi_multibody::form::Form;
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint::{FrameId, GROUND, Joint, Side, complete_axis};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_force::Viscous;
use vi_multibody::pair::PairKind;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use vi_rigid::{directors, rotation};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GradientCase {
    name: String,
    kind: String,
    #[serde(rename = "description")]
    _description: Option<String>,
    #[serde(rename = "units")]
    _units: String,
    #[serde(rename = "checked_by")]
    _checked_by: serde_json::Value,
    gravity: [f64; 3],
    bodies: Vec<Body>,
    joints: Vec<JointOf>,
    #[serde(default)]
    cut_joints: Vec<usize>,
    #[serde(default)]
    springs: Vec<PointSpring>,
    #[serde(default)]
    joint_springs: Vec<JointSpring>,
    #[serde(default)]
    joint_dampers: Vec<JointDamper>,
    #[serde(default)]
    efforts: Vec<Along>,
    h: f64,
    steps: usize,
    initial: Initial,
    #[serde(default)]
    parameters: Vec<Parameter>,
    objective: Vec<TermCase>,
    #[serde(default)]
    controls: Vec<Vec<f64>>,
    composition: Option<CompositionCase>,
    results: Results,
    tolerance: serde_json::Map<String, serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Body {
    name: String,
    mass: f64,
    principal_inertia: [f64; 3],
    position: [f64; 3],
    directors: [[f64; 3]; 3], // rows; the columns are the directors
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointOf {
    name: String,
    #[serde(rename = "type")]
    kind: String,
    parent: i64,
    child: i64,
    anchor_parent: [f64; 3],
    anchor_child: [f64; 3],
    axis: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PointSpring {
    body_a: i64,
    body_b: i64,
    point_a: [f64; 3],
    point_b: [f64; 3],
    stiffness: f64,
    rest_length: f64,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Along {
    joint: usize,
    #[serde(default)]
    freedom: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointSpring {
    joint: usize,
    #[serde(default)]
    freedom: usize,
    stiffness: f64,
    rest: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointDamper {
    joint: usize,
    #[serde(default)]
    freedom: usize,
    damping: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Initial {
    independent: Option<Vec<usize>>,
    coordinates: Vec<f64>,
    rates: Vec<f64>,
    consistent_coordinates: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Parameter {
    #[serde(rename = "name")]
    _name: String,
    #[serde(rename = "value")]
    _value: f64,
    sets: Vec<Set>,
}

fn one() -> f64 {
    1.0
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Set {
    path: String,
    #[serde(default = "one")]
    factor: f64,
}

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
enum TermCase {
    Effort {
        #[serde(default = "one")]
        weight: f64,
    },
    Time {
        #[serde(default = "one")]
        weight: f64,
    },
    TerminalPoint {
        body: usize,
        point: [f64; 3],
        target: [f64; 3],
        #[serde(default = "one")]
        weight: f64,
    },
    RunningPoint {
        body: usize,
        point: [f64; 3],
        target: [f64; 3],
        #[serde(default = "one")]
        weight: f64,
    },
    TerminalCoordinate {
        joint: usize,
        #[serde(default)]
        freedom: usize,
        target: f64,
        #[serde(default = "one")]
        weight: f64,
    },
    RunningCoordinate {
        joint: usize,
        #[serde(default)]
        freedom: usize,
        target: f64,
        #[serde(default = "one")]
        weight: f64,
    },
    TerminalMomentum {
        #[serde(default = "one")]
        weight: f64,
    },
    TerminalHeight {
        body: usize,
        point: [f64; 3],
    },
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Results {
    value: f64,
    initial_coordinates: Vec<f64>,
    initial_rates: Vec<f64>,
    parameters: Vec<f64>,
    controls: Vec<Vec<f64>>,
    step_lengths_sum: f64,
    states: Vec<StateOf>,
    growth: Vec<GrowthOf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StateOf {
    step: usize,
    coordinates: Vec<f64>,
    q: Vec<f64>,
    #[serde(default, rename = "momenta")]
    _momenta: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GrowthOf {
    #[serde(rename = "time")]
    _time: f64,
    steps: usize,
    height: f64,
    gradient: f64,
    double_height_error: f64,
    #[serde(rename = "double_gradient_relative_error")]
    _double_gradient_relative_error: f64,
}

/// A run with what is differentiated.
struct Posed {
    run: MechanismIntegrator,
    objective: Objective,
    controls: Controls,
    design: MechanismDesign,
    start: StartDerivatives,
}

fn frame(index: i64) -> FrameId {
    usize::try_from(index).map_or(FrameId::Ground, FrameId::Frame)
}

fn pair_kind(name: &str) -> Result<PairKind, String> {
    match name {
        "R" => Ok(PairKind::Revolute),
        "P" => Ok(PairKind::Prismatic),
        "C" => Ok(PairKind::Cylindrical),
        "F" => Ok(PairKind::Free),
        _ => Err(format!("unknown joint type `{name}`")),
    }
}

fn place(index: &str, below: usize) -> Result<usize, String> {
    let place = index.parse().map_err(|_| format!("`{index}` is no number of a path"))?;
    if place < below { Ok(place) } else { Err(format!("`{index}` is beyond {below} entries")) }
}

fn coordinate(
    built: &mut BuiltMechanism,
    joints: &[JointId],
    Along { joint, freedom }: Along,
) -> Result<JointCoordinate, String> {
    let id = joints.get(joint).ok_or("an unknown joint")?;
    let own = built.coordinate(id.coordinate(freedom));
    own.ok_or_else(|| format!("joint {joint} has no coordinate {freedom}"))
}

impl GradientCase {
    /// Adds what a parameter changes of a number.
    fn change(
        &self,
        built: &BuiltMechanism,
        Set { path, factor }: &Set,
        to: &mut MechanismTangent,
    ) -> Result<(), String> {
        let rate = *factor;
        let parts: Vec<&str> = path.split('.').collect();
        match parts[..] {
            ["gravity", k] => to.gravity[place(k, 3)?] += rate,
            ["bodies", body, "mass"] => {
                to.bodies.entry(place(body, self.bodies.len())?).or_default().mass += rate;
            }
            ["bodies", body, "principal_inertia", k] => {
                let mut tensor = Matrix3::zeros();
                let k = place(k, 3)?;
                tensor[(k, k)] = rate;
                let euler = BodyTangent::of_inertia(0.0, &tensor).euler;
                to.bodies.entry(place(body, self.bodies.len())?).or_default().euler += euler;
            }
            ["joints", joint, side, k] => {
                let own = to.joints.entry(place(joint, self.joints.len())?).or_default();
                match side {
                    "anchor_parent" => own.parent.anchor[place(k, 3)?] += rate,
                    "anchor_child" => own.child.anchor[place(k, 3)?] += rate,
                    _ => return Err(format!("unknown path `{path}`")),
                }
            }
            ["joint_springs", spring, key] => {
                let own = &self.joint_springs[place(spring, self.joint_springs.len())?];
                let by = match key {
                    "stiffness" => [rate, 0.0],
                    "rest" => [0.0, rate],
                    _ => return Err(format!("unknown path `{path}`")),
                };
                let along = (own.joint, own.freedom);
                to.efforts.push(EffortChange::of_spring("", along, [own.stiffness, own.rest], by));
            }
            ["joint_dampers", damper, "damping"] => {
                let own = &self.joint_dampers[place(damper, self.joint_dampers.len())?];
                let by = Arc::new(move |_: f64, _: f64, v: f64| -rate * v);
                to.efforts.push(EffortChange {
                    force: String::new(),
                    joint: own.joint,
                    freedom: own.freedom,
                    by,
                });
            }
            ["springs", spring, ref keys @ ..] => {
                let spring = place(spring, self.springs.len())?;
                let zero = |form: &Form| form.minus(form);
                let none = SpringTangent {
                    between: zero(&built.forces.springs[spring].between),
                    stiffness: 0.0,
                    natural_length: 0.0,
                    damping: 0.0,
                };
                let own = to.springs.entry(spring).or_insert(none);
                let case = &self.springs[spring];
                match keys[..] {
                    ["stiffness"] => own.stiffness += rate,
                    ["rest_length"] => own.natural_length += rate,
                    [end, k] => {
                        let (body, sign) = match end {
                            "point_a" => (case.body_a, -rate),
                            "point_b" => (case.body_b, rate),
                            _ => return Err(format!("unknown path `{path}`")),
                        };
                        let along = Vector3::ith(place(k, 3)?, sign);
                        let moved = match frame(body) {
                            FrameId::Ground => Form::constant(along),
                            FrameId::Frame(k) => Form::vector(12 * k, &along),
                        };
                        own.between = own.between.plus(&moved);
                    }
                    _ => return Err(format!("unknown path `{path}`")),
                }
            }
            _ => return Err(format!("unknown path `{path}`")),
        }
        Ok(())
    }
}

impl Body {
    /// In the reference placement.
    fn coordinates(&self) -> [f64; 12] {
        let mut q = [0.0; 12];
        let triad = Matrix3::from_fn(|i, j| self.directors[i][j]);
        directors::set_frame(&mut q, &self.position.into(), &triad);
        q
    }
}

impl GradientCase {
    fn joint(&self, k: usize) -> Result<Joint, String> {
        let joint = &self.joints[k];
        let (parent, child) = (frame(joint.parent), frame(joint.child));
        let triad = |id: FrameId| match id {
            FrameId::Ground => Matrix3::identity(),
            FrameId::Frame(k) => directors::triad(&self.bodies[k].coordinates()),
        };
        let axes = match joint.axis {
            Some(axis) => complete_axis(&Vector3::from(axis).normalize()),
            None => Matrix3::identity(),
        };
        let axes_child = triad(child).transpose() * (triad(parent) * axes);
        Ok(Joint {
            name: joint.name.clone(),
            kind: pair_kind(&joint.kind)?,
            parent: Side { frame: parent, anchor: joint.anchor_parent.into(), axes },
            child: Side { frame: child, anchor: joint.anchor_child.into(), axes: axes_child },
        })
    }

    /// The freedoms of the tree joints in their order.
    fn freedoms(&self) -> Result<Vec<Along>, String> {
        let mut all = Vec::new();
        for k in (0..self.joints.len()).filter(|k| !self.cut_joints.contains(k)) {
            let dof = pair_kind(&self.joints[k].kind)?.dof();
            all.extend((0..dof).map(|freedom| Along { joint: k, freedom }));
        }
        Ok(all)
    }

    /// `q_0` by the coordinates of the tree joints.
    fn configuration(&self) -> Result<Vec<f64>, String> {
        let first = self.results.states.iter().find(|state| state.step == 0);
        let x = match (&self.initial.independent, &self.initial.consistent_coordinates) {
            (None, _) => &self.initial.coordinates,
            (_, Some(all)) => all,
            _ => &first.ok_or("a closed loop without a state at step 0")?.coordinates,
        };
        let mut q: Vec<f64> = self.bodies.iter().flat_map(Body::coordinates).collect();
        let mut x = x.iter();
        let mut next = || x.next().copied().ok_or("too few initial coordinates");
        for k in (0..self.joints.len()).filter(|k| !self.cut_joints.contains(k)) {
            let Joint { kind, parent, child, .. } = self.joint(k)?;
            let carrier: [f64; 12] = match parent.frame {
                FrameId::Ground => GROUND,
                FrameId::Frame(_) => parent.coordinates(&q).try_into().map_err(|_| "a frame")?,
            };
            let (base, own) = (directors::triad(&carrier), parent.axes);
            let n: Vector3<f64> = (base * own).column(2).into();
            let (mut shift, mut turn) = (Vector3::zeros(), Matrix3::identity());
            match kind {
                PairKind::Revolute => turn = rotation::exp(&(next()? * n)),
                PairKind::Prismatic => shift = next()? * n,
                PairKind::Cylindrical => {
                    shift = next()? * n;
                    turn = rotation::exp(&(next()? * n));
                }
                _ => return Err(format!("no placement of a joint `{}`", self.joints[k].kind)),
            }
            let triad = turn * base * own * child.axes.transpose();
            let anchor = directors::center(&carrier) + base * parent.anchor + shift;
            let FrameId::Frame(body) = child.frame else { return Err("a joint to no body".into()) };
            let place = &mut q[12 * body..12 * body + 12];
            directors::set_frame(place, &(anchor - triad * child.anchor), &triad);
        }
        Ok(q)
    }

    /// The mechanism at `q`, its joints, and what controls it.
    fn built(&self, q: &[f64]) -> Result<(BuiltMechanism, Vec<JointId>, Vec<HeldEffort>), String> {
        let mut builder = MechanismBuilder::new().gravity(self.gravity);
        let mut ids = Vec::new();
        for (body, own) in self.bodies.iter().zip(q.chunks_exact(12)) {
            let inertia = Inertia::principal(body.mass, body.principal_inertia);
            let entry = builder.body(&body.name, inertia).at(directors::center(own));
            ids.push(entry.attitude(directors::triad(own)).id());
        }
        let point = |body: i64, point: [f64; 3]| -> PointOn {
            usize::try_from(body).map_or(point.into(), |k| ids[k].point(point))
        };
        let mut joints = Vec::new();
        for k in 0..self.joints.len() {
            let entry = builder.joint_of_sides(self.joint(k)?);
            let entry = if self.cut_joints.contains(&k) { entry.cut() } else { entry };
            joints.push(entry.id());
        }
        for s in &self.springs {
            let ends = [point(s.body_a, s.point_a), point(s.body_b, s.point_b)];
            builder.spring(ends[0], ends[1], s.stiffness).natural_length(s.rest_length);
        }
        let along = |joint: usize, freedom| joints[joint].coordinate(freedom);
        for s in &self.joint_springs {
            builder.joint_spring(along(s.joint, s.freedom), s.stiffness, s.rest);
        }
        for d in &self.joint_dampers {
            builder.joint_force(along(d.joint, d.freedom), Viscous(d.damping));
        }
        let efforts = self.efforts.iter().map(|own| {
            let effort = HeldEffort::default();
            builder.joint_force(along(own.joint, own.freedom), effort.clone());
            effort
        });
        let efforts = efforts.collect();
        Ok((builder.build().map_err(|e| e.to_string())?, joints, efforts))
    }

    fn objective(
        &self,
        built: &mut BuiltMechanism,
        joints: &[JointId],
        tangents: &[MechanismTangent],
    ) -> Result<Objective, String> {
        let mut objective = Objective::new();
        let momentum = TerminalMomentum::of(&built.mechanism);
        let momentum = momentum.and_then(|own| own.by_parameters(tangents));
        let mut coordinate = |joint, freedom| coordinate(built, joints, Along { joint, freedom });
        let component = |body: usize, point: [f64; 3], axis: usize| PointComponent {
            point: Form::point(12 * body, &Vector3::from(point)),
            axis,
        };
        for term in &self.objective {
            let mut add = |weight: f64, term: Box<dyn CostTerm>| objective.add(weight, term);
            match *term {
                TermCase::Effort { weight } => add(weight, Box::new(Effort { of: Vec::new() })),
                TermCase::Time { weight } => add(weight, Box::new(Time)),
                TermCase::TerminalPoint { body, point, target, weight } => {
                    for axis in 0..3 {
                        let (quantity, target) = (component(body, point, axis), target[axis]);
                        add(
                            weight,
                            Box::new(Terminal { quantity, judged: NumberCost::Deviation(target) }),
                        );
                    }
                }
                TermCase::RunningPoint { body, point, target, weight } => {
                    for axis in 0..3 {
                        let (quantity, target) = (component(body, point, axis), target[axis]);
                        add(
                            weight,
                            Box::new(Running { quantity, judged: NumberCost::Deviation(target) }),
                        );
                    }
                }
                TermCase::TerminalCoordinate { joint, freedom, target, weight } => {
                    let quantity = coordinate(joint, freedom)?;
                    add(
                        weight,
                        Box::new(Terminal { quantity, judged: NumberCost::Deviation(target) }),
                    );
                }
                TermCase::RunningCoordinate { joint, freedom, target, weight } => {
                    let quantity = coordinate(joint, freedom)?;
                    add(
                        weight,
                        Box::new(Running { quantity, judged: NumberCost::Deviation(target) }),
                    );
                }
                TermCase::TerminalMomentum { weight } => {
                    let term = momentum.clone().ok_or("no momentum along such joints")?;
                    add(weight, Box::new(term));
                }
                TermCase::TerminalHeight { body, point } => {
                    add(1.0, Box::new(Last(component(body, point, 2))));
                }
            }
        }
        Ok(objective)
    }

    fn posed(&self, scheme: SchemeKind) -> Result<Posed, String> {
        let words = |e: &dyn std::fmt::Display| e.to_string();
        let q = self.configuration()?;
        let (mut built, joints, efforts) = self.built(&q)?;
        let mut forces: Vec<Box<dyn ControlForce>> = Vec::new();
        for (own, effort) in self.efforts.iter().zip(efforts) {
            let coordinate = coordinate(&mut built, &joints, *own)?;
            forces.push(Box::new(JointControl { effort, coordinate }));
        }
        let controls = Controls::new(forces, self.controls.clone(), 1);
        let freedoms = self.freedoms()?;
        let of_tree = StartCoordinate::of_tree(&built.mechanism);
        let all = freedoms.iter().map(|own| {
            let found = of_tree
                .iter()
                .find(|(k, freedom, _)| *k == Some(own.joint) && *freedom == own.freedom);
            found.map(|(_, _, own)| own.clone()).ok_or("a joint that is not of the tree")
        });
        let all: Vec<StartCoordinate> = all.collect::<Result<_, _>>()?;
        let chosen = match &self.initial.independent {
            Some(independent) => independent.iter().map(|k| all[*k].clone()).collect(),
            None => all,
        };
        let tangents = self.parameters.iter().map(|parameter| {
            let mut tangent = MechanismTangent::default();
            parameter.sets.iter().try_for_each(|set| self.change(&built, set, &mut tangent))?;
            Ok(tangent)
        });
        let tangents: Vec<MechanismTangent> = tangents.collect::<Result<_, String>>()?;
        let objective = self.objective(&mut built, &joints, &tangents)?;
        let system = built.system(Quadrature::Midpoint);
        let mass = system.mass().clone();
        let design = MechanismDesign::new(
            &built.mechanism,
            &built.forces,
            &mass,
            Quadrature::Midpoint,
            &tangents,
        );
        let design = design.map_err(|e| words(&e))?;
        // v is linear in the rates of the independent coordinates
        let rest = vec![0.0; q.len()];
        let rows = vi_multibody::run::IndependentLoops::find(&built.mechanism, 0.0, &q);
        let rows = rows.map_err(|e| words(&e))?.rows;
        let by = |v: &[f64], tangents: &[MechanismTangent]| {
            let at = InitialValues::new(0.0, &q, v);
            let start = derivatives(&built.mechanism, &mass, &rows, at, &chosen, tangents);
            start.map_err(|e| words(&e))
        };
        let mut v = rest.clone();
        for (rate, own) in self.initial.rates.iter().zip(&by(&rest, &[])?.rates) {
            v.iter_mut().zip(&own.v).for_each(|(v, dv)| *v += rate * dv);
        }
        let start = by(&v, &tangents)?;
        let at = InitialValues::new(0.0, &q, &v);
        let options = Options::new(scheme, self.h);
        let run = integrator(built.mechanism.clone(), system, options, Solver::Auto, at);
        let run = run.and_then(|run| match &self.composition {
            Some(composition) => run.with_coefficients(composition.gammas.clone()),
            None => Ok(run),
        });
        Ok(Posed { run: run.map_err(|e| words(&e))?, objective, controls, design, start })
    }

    pub fn run(&self) -> Result<Runs, String> {
        match self.kind.as_str() {
            "gradient" => {
                let mut runs = Runs::new();
                for scheme in SchemeKind::ALL {
                    runs.push((scheme.name(), self.backward(scheme, Planted::Nothing)?));
                }
                let forward = [
                    "constrained, forward",
                    "dalembert, forward",
                    "nodal, forward",
                    "reduced, forward",
                ];
                for (scheme, name) in SchemeKind::ALL.into_iter().zip(forward) {
                    assert!(name.starts_with(scheme.name()), "{name}");
                    runs.push((name, self.forward(scheme)?));
                }
                Ok(runs)
            }
            _ => Ok(vec![("nodal", self.growth()?)]),
        }
    }

    fn tolerance(&self, key: &str) -> Result<f64, String> {
        let found = self.tolerance.get(key).and_then(serde_json::Value::as_f64);
        found.ok_or_else(|| format!("no tolerance `{key}` in {}", self.name))
    }

    /// Deviations of derivatives, relative to the largest entry of their group, parameters entry by
    /// entry. They are listed as value and states (q), initial values (p), parameters (force),
    /// controls (energy), step lengths (moment).
    fn compare(&self, found: &Found) -> Result<Deviation, String> {
        let (value, gradient) = (self.tolerance("value")?, self.tolerance("gradient")?);
        let results = &self.results;
        let group = |found: &[f64], reference: &[f64]| {
            if found.len() != reference.len() {
                return f64::NAN;
            }
            let size = reference.iter().fold(1e-300, |size: f64, x| size.max(x.abs()));
            let pairs = found.iter().zip(reference);
            let mut worst = 0.0;
            pairs.for_each(|(a, b)| raise(&mut worst, (a - b).abs() / size));
            worst / gradient
        };
        let mut deviation = Deviation::default();
        raise(&mut deviation.q, (found.value - results.value).abs() / value);
        raise(&mut deviation.p, group(&found.coordinates, &results.initial_coordinates));
        raise(&mut deviation.p, group(&found.rates, &results.initial_rates));
        let largest = results.parameters.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        if found.parameters.len() != results.parameters.len() {
            deviation.force = f64::NAN;
        }
        for (a, b) in found.parameters.iter().zip(&results.parameters) {
            raise(&mut deviation.force, (a - b).abs() / b.abs().max(1e-3 * largest) / gradient);
        }
        let flat = |rows: &[Vec<f64>]| rows.concat();
        raise(&mut deviation.energy, group(&flat(&found.controls), &flat(&results.controls)));
        raise(&mut deviation.momentum, group(&[found.step], &[results.step_lengths_sum]));
        Ok(deviation)
    }

    /// Whether the case sees a defect of parameters.
    pub fn finds(&self, planted: Planted) -> Result<bool, String> {
        Ok(self.backward(SchemeKind::Nodal, planted)?.force > 1.0)
    }

    fn backward(&self, scheme: SchemeKind, planted: Planted) -> Result<Deviation, String> {
        let Posed { mut run, objective, controls, design, start } = self.posed(scheme)?;
        let mass = run.system().mass().clone();
        let design = WithoutRows { inner: &design, wanted: planted == Planted::NoRows };
        let task = Task {
            steps: self.steps,
            objective: &objective,
            controls: &controls,
            design: Some(&design),
            by_step: true,
            checkpoints: Checkpoints::Every(7),
        };
        let found = Gradient::of(&mut run, &task).map_err(|e| e.to_string())?;
        let through = |own: &StartTangent| along(&found.initial, own);
        let of_parameter = |own: &StartTangent| {
            let mut own = own.clone();
            if planted == Planted::MassAtMomentum {
                own.p.fill(0.0);
                mass.mul_add(1.0, &own.v, &mut own.p); // M δv without M_θ v
            }
            through(&own)
        };
        let parameters = start.parameters.iter().zip(&found.parameters);
        let mut deviation = self.compare(&Found {
            value: found.value,
            coordinates: start.coordinates.iter().map(through).collect(),
            rates: start.rates.iter().map(through).collect(),
            parameters: parameters.map(|(start, own)| of_parameter(start) + own).collect(),
            controls: found.controls.clone(),
            step: found.step.unwrap_or(f64::NAN),
        })?;
        let states = self.tolerance("states")?;
        for state in self.results.states.iter().filter(|state| state.step == self.steps) {
            let distance = super::case::distance(&run.state().q, &state.q);
            raise(&mut deviation.q, distance / states);
        }
        Ok(deviation)
    }

    fn forward(&self, scheme: SchemeKind) -> Result<Deviation, String> {
        let Posed { mut run, objective, controls, design, start } = self.posed(scheme)?;
        let words = |e: vi_control::GradientError| e.to_string();
        let tangent =
            |own: &StartTangent| Tangent { q: own.q.clone(), p: own.p.clone(), z: vec![] };
        let none = Tangent::zero(run.state().q.len(), 0);
        let mut directions = Vec::new();
        for own in start.coordinates.iter().chain(&start.rates) {
            directions.push(Direction::from(tangent(own)));
        }
        for (k, own) in start.parameters.iter().enumerate() {
            let parameter = Some(k);
            directions.push(Direction { start: tangent(own), parameter, ..Direction::default() });
        }
        directions.push(Direction { start: none.clone(), step: true, ..Direction::default() });
        for (n, row) in self.controls.iter().enumerate() {
            for k in 0..row.len() {
                let mut rates: Vec<Vec<f64>> =
                    self.controls.iter().map(|row| vec![0.0; row.len()]).collect();
                rates[n][k] = 1.0;
                let start = none.clone();
                directions.push(Direction { start, controls: rates, ..Direction::default() });
            }
        }
        let mut all = Sensitivities::new(&run, self.h, directions).map_err(words)?;
        let design: Option<&dyn Design> = Some(&design);
        let beside = Beside { controls: &controls, design, objective: &objective };
        let mut value = 0.0;
        for step in 0..self.steps {
            all.advance(&mut run, beside).map_err(words)?;
            if self.composition.is_none() {
                value += objective.of_step(run.interval(), controls.at(step));
            }
        }
        value += objective.of_end(run.state());
        let rates = all.rates(beside, run.state());
        let mut rates = rates.into_iter();
        let mut next = |count: usize| -> Vec<f64> { rates.by_ref().take(count).collect() };
        let coordinates = next(start.coordinates.len());
        let by_rates = next(start.rates.len());
        let parameters = next(start.parameters.len());
        let step = next(1)[0];
        let controls = self.controls.iter().map(|row| next(row.len())).collect();
        self.compare(&Found { value, coordinates, rates: by_rates, parameters, controls, step })
    }

    /// `d(height)/d(first coordinate)` along a chaotic motion, and the warning beyond sense.
    fn growth(&self) -> Result<Deviation, String> {
        let mut deviation = Deviation::default();
        let words = |e: vi_control::GradientError| e.to_string();
        for growth in &self.results.growth {
            let Posed { mut run, objective, controls, design, start } =
                self.posed(SchemeKind::Nodal)?;
            let first = run.state().clone();
            let task = Task {
                steps: growth.steps,
                objective: &objective,
                controls: &controls,
                design: Some(&design),
                by_step: false,
                checkpoints: Checkpoints::default(),
            };
            let found = Gradient::of(&mut run, &task).map_err(words)?;
            let own = along(&found.initial, &start.coordinates[0]);
            let size = growth.gradient.abs();
            let error = (own - growth.gradient).abs() / size;
            run.place_at(&first);
            let StartTangent { q, p, .. } = start.coordinates[0].clone();
            let direction = Direction::from(Tangent { q, p, z: vec![] });
            let mut beside_run =
                Sensitivities::new(&run, self.h, vec![direction]).map_err(words)?;
            let beside = Beside { controls: &controls, design: None, objective: &objective };
            for _ in 0..growth.steps {
                beside_run.advance(&mut run, beside).map_err(words)?;
            }
            let forward = beside_run.rates(beside, run.state())[0];
            let grown = beside_run.growth()[0];
            println!(
                "{} steps: {own:.6e}, off by {error:.1e}, forward by {:.1e}, {grown:?}",
                growth.steps,
                (forward - growth.gradient).abs() / size
            );
            if size > 1e7 {
                // no digits are owed, a warning is
                let warned = grown.meaningless_from.is_some();
                raise(&mut deviation.p, if warned { 0.0 } else { f64::NAN });
                continue;
            }
            raise(&mut deviation.p, error / (1e-12 + 1e-13 * size));
            let height = (found.value - growth.height).abs();
            raise(&mut deviation.q, height / (10.0 * growth.double_height_error + 1e-13));
            if size < 1e3 && grown.meaningless_from.is_some() {
                raise(&mut deviation.p, f64::NAN); // a false alarm
            }
        }
        Ok(deviation)
    }
}

/// What is left out of the derivatives by parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planted {
    Nothing,
    /// `g_θ`.
    NoRows,
    /// `M_θ` in `p̄_0`.
    MassAtMomentum,
}

/// A design whose `g_θ` is not counted where that is wanted.
struct WithoutRows<'a> {
    inner: &'a MechanismDesign,
    wanted: bool,
}

impl Design for WithoutRows<'_> {
    fn len(&self) -> usize {
        self.inner.len()
    }
    fn add_tangent(
        &self,
        k: usize,
        at: Place<'_>,
        impulse: &[f64],
        minus: &mut [f64],
        plus: &mut [f64],
        rows: &mut [f64],
    ) {
        self.inner.add_tangent(k, at, impulse, minus, plus, rows);
    }
    fn add_adjoint(&self, at: Place<'_>, impulse: &[f64], costates: Costates<'_>, out: &mut [f64]) {
        let none = vec![0.0; costates.rows.len()];
        let rows = if self.wanted { &none } else { costates.rows };
        self.inner.add_adjoint(at, impulse, Costates { rows, ..costates }, out);
    }
    fn sums(&self) -> usize {
        self.inner.sums()
    }
    fn add_gradient(&self, sums: &[f64], out: &mut [f64]) {
        self.inner.add_gradient(sums, out);
    }
    fn moves_constraints(&self) -> bool {
        self.inner.moves_constraints()
    }
}

/// What is compared.
struct Found {
    value: f64,
    coordinates: Vec<f64>,
    rates: Vec<f64>,
    parameters: Vec<f64>,
    controls: Vec<Vec<f64>>,
    step: f64,
}

/// `a_0·δq_0 + b_0·δp̄_0`.
fn along(costate: &Costate, tangent: &StartTangent) -> f64 {
    dot(&costate.q, &tangent.q) + dot(&costate.p, &tangent.p)
}
