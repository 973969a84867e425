//! Cases of kind `beam`: elements, bodies, joints, clamps, loads; static and dynamic.

use super::case::{BodyCase, Deviation, Runs, Tolerance};
use super::rigid::drive;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use vi_beam::elements::Elements;
use vi_beam::model::{BeamModel, StrainRule};
use vi_beam::section::Section;
use vi_constraints::node::Node;
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::potential::Potential;
use vi_core::{Configuration, MechanicalSystem, Quadrature, SeparableSystem, State};
use vi_emscheme::beam::BeamGradient;
use vi_emscheme::{EmForm, EmOptions, EmSystem};
use vi_multibody::joint::{FrameId, GROUND, Joint, Side, complete_axis};
use vi_multibody::mechanism::{BodySpec, Mechanism};
use vi_multibody::pair::PairKind;
use vi_multibody::run::{Solver, integrator};
use vi_rigid::directors;
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;
use vi_statics::{StaticProblem, StaticSettings};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamCase {
    name: String,
    #[serde(rename = "kind")]
    _kind: String,
    #[serde(rename = "description")]
    _description: String,
    #[serde(rename = "units")]
    _units: String,
    bodies: Vec<BodyCase>,
    nodes: Vec<NodeCase>,
    sections: Vec<SectionCase>,
    elements: Vec<ElementCase>,
    joints: Vec<JointCase>,
    fixed: Vec<usize>,
    gravity: [f64; 3],
    loads: Vec<LoadCase>,
    scheme: String,
    h: Option<f64>,
    steps: Option<u64>,
    output_steps: Option<Vec<u64>>,
    outputs: Vec<Output>,
    tolerance: BeamTolerance,
    #[serde(rename = "load_steps_used")]
    _load_steps_used: Option<u64>,
    #[serde(rename = "cross_check")]
    _cross_check: Option<serde_json::Value>,
    #[serde(rename = "closed_form")]
    _closed_form: Option<serde_json::Value>,
    #[serde(rename = "continuum")]
    _continuum: Option<serde_json::Value>,
    #[serde(rename = "frequency")]
    _frequency: Option<serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NodeCase {
    position: [f64; 3],
    directors: [[f64; 3]; 3],
    velocity: [f64; 3],
    omega: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SectionCase {
    #[serde(rename = "GA")]
    ga: [f64; 2],
    #[serde(rename = "EA")]
    ea: f64,
    #[serde(rename = "EI")]
    ei: [f64; 2],
    #[serde(rename = "GJ")]
    gj: f64,
    #[serde(rename = "rhoA")]
    rho_a: f64,
    #[serde(rename = "rhoI")]
    rho_i: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ElementCase {
    nodes: [usize; 2],
    length: f64,
    section: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointCase {
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
struct LoadCase {
    frame: usize,
    #[serde(rename = "type")]
    kind: String,
    vector: [f64; 3],
    history: Option<HistoryCase>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HistoryCase {
    t: Vec<f64>,
    f: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BeamTolerance {
    q: f64,
    #[serde(rename = "q_vouched")]
    _q_vouched: f64,
    energy_rel: f64,
    #[serde(default)]
    momentum_rel: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Output {
    step: u64,
    #[serde(rename = "t")]
    _t: f64,
    q: Vec<f64>,
    linear_momentum: Option<[f64; 3]>,
    angular_momentum: Option<[f64; 3]>,
    #[serde(rename = "H_d")]
    h_d: Option<f64>,
    #[serde(rename = "E_d")]
    e_d: Option<f64>,
    strain_energy: f64,
    strain: Option<Vec<[f64; 6]>>,
}

fn triad(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

fn frame(index: i64) -> FrameId {
    usize::try_from(index).map_or(FrameId::Ground, FrameId::Frame)
}

impl BeamCase {
    pub fn model(&self) -> Result<BeamModel, String> {
        let mut model = BeamModel::new(self.gravity.into());
        for body in &self.bodies {
            model.add_frame(body.spec()?);
        }
        for (k, node) in self.nodes.iter().enumerate() {
            model.add_frame(BodySpec {
                name: format!("node {k}"),
                body: None,
                center: node.position.into(),
                triad: triad(&node.directors),
                velocity: node.velocity.into(),
                omega: node.omega.into(),
            });
        }
        model.elements = self.elements(&model.configuration())?;
        for &node in &self.fixed {
            model.clamp(node);
        }
        for joint in &self.joints {
            let joint = self.joint(joint, &model)?;
            model.description.joints.push(joint);
        }
        Ok(model)
    }

    fn elements(&self, q: &[f64]) -> Result<Elements, String> {
        let mut elements = Elements::new();
        for s in &self.sections {
            let stiffness = [s.ga[0], s.ga[1], s.ea, s.ei[0], s.ei[1], s.gj];
            let inertia = [s.rho_a, s.rho_i[0], s.rho_i[1], s.rho_i[2]];
            elements.add_section(Section::new(stiffness, inertia).map_err(|e| e.to_string())?);
        }
        let first = self.bodies.len();
        for e in &self.elements {
            let nodes = e.nodes.map(|node| first + node);
            let added = elements.add_stress_free(nodes, e.length, e.section, q);
            added.map_err(|e| e.to_string())?;
        }
        Ok(elements)
    }

    fn joint(&self, joint: &JointCase, model: &BeamModel) -> Result<Joint, String> {
        let count = model.description.joints.len();
        let kind = match joint.kind.as_str() {
            "S" => PairKind::Spherical,
            "R" => PairKind::Revolute,
            "F" => PairKind::Fixed,
            other => return Err(format!("unknown joint type `{other}`")),
        };
        let axes_parent = match joint.axis {
            Some(axis) => complete_axis(&Vector3::from(axis).normalize()),
            None if kind.has_axis() => return Err(format!("joint {count} lacks its axis")),
            None => Matrix3::identity(),
        };
        let q = model.configuration();
        let at = |id: FrameId| match id {
            FrameId::Ground => directors::triad(&GROUND),
            FrameId::Frame(k) => directors::triad(&q[12 * k..12 * k + 12]),
        };
        let (parent, child) = (frame(joint.parent), frame(joint.child));
        let axes_child = at(child).transpose() * at(parent) * axes_parent;
        let side = |frame, anchor: [f64; 3], axes| Side { frame, anchor: anchor.into(), axes };
        Ok(Joint {
            name: format!("joint {count}"),
            kind,
            parent: side(parent, joint.anchor_parent, axes_parent),
            child: side(child, joint.anchor_child, axes_child),
        })
    }

    fn loads(&self) -> Result<Vec<Load>, String> {
        let load = |load: &LoadCase| {
            let vector = Vector3::from(load.vector);
            let zero = Vector3::zeros();
            let (kind, force, torque) = match load.kind.as_str() {
                "force" => (LoadKind::Dead, vector, zero),
                "moment" => (LoadKind::Dead, zero, vector),
                "follower_force" => (LoadKind::Follower, vector, zero),
                "follower_moment" => (LoadKind::Follower, zero, vector),
                other => return Err(format!("unknown load `{other}`")),
            };
            let history = load.history.as_ref().map_or(TimeHistory::default(), |history| {
                let points = history.t.iter().zip(&history.f).map(|(t, f)| [*t, *f]).collect();
                TimeHistory::Table { points }
            });
            Load::new(12 * load.frame, kind, force, torque, history).map_err(|e| e.to_string())
        };
        self.loads.iter().map(load).collect()
    }

    pub fn run(&self) -> Result<Runs, String> {
        let rule = match self.scheme.as_str() {
            "static" => return Ok(vec![("static", self.statics()?)]),
            "variational" => StrainRule::Midpoint,
            "variational_avg" => StrainRule::Averaged,
            "em" => {
                let forms = EmForm::ALL.into_iter();
                return forms.map(|form| Ok((form.name(), self.energy_momentum(form)?))).collect();
            }
            other => return Err(format!("unknown scheme `{other}` in {}", self.name)),
        };
        let schemes = SchemeKind::ALL.into_iter();
        schemes.map(|kind| Ok((kind.name(), self.dynamic(kind, rule)?))).collect()
    }

    /// The largest `|H_d|` and the tolerances that follow from it.
    fn tolerance(&self) -> Tolerance {
        let energy = |output: &Output| output.h_d.unwrap_or(output.strain_energy).abs();
        let largest = self.outputs.iter().map(energy).fold(0.0, f64::max);
        let components = |output: &Output| {
            let momenta = [output.linear_momentum, output.angular_momentum];
            momenta.into_iter().flatten().flatten().fold(0.0, |a: f64, b| a.max(b.abs()))
        };
        let momentum = self.outputs.iter().map(components).fold(1.0, f64::max);
        Tolerance {
            q: self.tolerance.q,
            p: f64::NAN,
            constraint_force: f64::NAN,
            energy: self.tolerance.energy_rel * largest,
            momentum: self.tolerance.momentum_rel * momentum,
        }
    }

    fn statics(&self) -> Result<Deviation, String> {
        let model = self.model()?;
        let mechanism = model.mechanism();
        let system = model.static_system(&mechanism, self.loads()?);
        let mut problem = StaticProblem::new(system, mechanism).with_elements(model.neighbours());
        let path = problem.solve(&[1.0], &StaticSettings::default()).map_err(|e| e.to_string())?;
        let [output] = &self.outputs[..] else { return Err("one output expected".into()) };
        let found = path.points.last().ok_or("an empty path")?;
        let (tolerance, mut deviation) = (self.tolerance(), Deviation::default());
        deviation.q(&found.q, &output.q, &tolerance);
        deviation.energy(found.potential_energy, output.strain_energy, &tolerance);
        let strains = output.strain.as_ref().ok_or("the output lacks its strains")?;
        for (element, reference) in model.elements.list().iter().zip(strains) {
            let strain = element.strain(&element.coordinates(&found.q));
            deviation.q(strain.as_slice(), reference, &tolerance);
        }
        Ok(deviation)
    }

    fn dynamic(&self, kind: SchemeKind, rule: StrainRule) -> Result<Deviation, String> {
        let (h, steps) = (self.h.ok_or("no h")?, self.steps.ok_or("no steps")?);
        let output_steps = self.output_steps.as_ref().ok_or("no output_steps")?;
        let model = self.model()?;
        let mechanism = model.mechanism();
        let mut system: SeparableSystem = model.system(&mechanism, rule);
        for load in self.loads()? {
            system = system.force(Box::new(load));
        }
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let options = Options::new(kind, h);
        let mut run =
            integrator(mechanism, system, options, Solver::Auto, InitialValues::new(0.0, &q, &v))
                .map_err(|e| format!("{}: {e}", kind.name()))?;
        let mechanism = model.mechanism();
        let mut deviation = Deviation::default();
        drive(&mut run, steps, output_steps, |step, state, node| {
            let output = self
                .outputs
                .iter()
                .find(|o| o.step == step)
                .ok_or_else(|| format!("no output at step {step}"))?;
            self.compare(output, (&model, &mechanism), (state, node), &mut deviation)
        })
        .map_err(|e| format!("{}: {e}", kind.name()))?;
        Ok(deviation)
    }

    /// Energy–momentum: `v_n` in the place of `v̂`, `E_d` of the step that starts at the node.
    fn energy_momentum(&self, form: EmForm) -> Result<Deviation, String> {
        let (h, steps) = (self.h.ok_or("no h")?, self.steps.ok_or("no steps")?);
        let output_steps = self.output_steps.as_ref().ok_or("no output_steps")?;
        let model = self.model()?;
        let mechanism = model.mechanism();
        let mass = model.mass_matrix(&mechanism);
        let weight = mechanism.system_with_mass(mass.clone(), Quadrature::Midpoint);
        let mut system =
            EmSystem::of_linear(&weight).gradient(BeamGradient(model.elements.clone()));
        for load in self.loads()? {
            system = system.load(load);
        }
        let (tolerance, mut deviation) = (self.tolerance(), Deviation::default());
        let mut run =
            vi_emscheme::run::integrator(system, model.mechanism(), EmOptions::new(form, h))
                .map_err(|e| format!("{}: {e}", form.name()))?;
        for n in 0..=steps {
            let (state, mut e_d) = (run.state().clone(), None);
            if n < steps {
                run.step().map_err(|e| format!("{}: step {n}: {e}", form.name()))?;
                let next = &run.state().q;
                let dq: Vec<f64> = next.iter().zip(&state.q).map(|(a, b)| a - b).collect();
                let mid: Vec<f64> = next.iter().zip(&state.q).map(|(a, b)| 0.5 * (a + b)).collect();
                let potential = model.elements.value(&mid)
                    + weight.potential_energy(Configuration::new(state.t, &mid));
                e_d = Some(0.5 * mass.bilinear(&dq, &dq) / (h * h) + potential);
            }
            if !output_steps.contains(&n) {
                continue;
            }
            let output = self.outputs.iter().find(|o| o.step == n);
            let output = output.ok_or_else(|| format!("no output at step {n}"))?;
            let missing = |what: &str| format!("output {n} lacks {what}");
            let mut p = vec![0.0; state.q.len()];
            mass.mul_add(1.0, &state.v, &mut p);
            let strain_energy = model.elements.value(&state.q);
            let kinetic = 0.5 * mass.bilinear(&state.v, &state.v);
            let energy = kinetic + strain_energy + weight.potential_energy(state.configuration());
            deviation.q(&state.q, &output.q, &tolerance);
            deviation.energy(energy, output.h_d.ok_or_else(|| missing("H_d"))?, &tolerance);
            deviation.energy(strain_energy, output.strain_energy, &tolerance);
            if let (Some(found), Some(reference)) = (e_d, output.e_d) {
                deviation.energy(found, reference, &tolerance);
            }
            let momentum = mechanism.momentum(&state.q, &p);
            let linear = output.linear_momentum.ok_or_else(|| missing("linear_momentum"))?;
            let angular = output.angular_momentum.ok_or_else(|| missing("angular_momentum"))?;
            deviation.momentum(&momentum.linear, &linear, &tolerance);
            deviation.momentum(&momentum.angular, &angular, &tolerance);
        }
        Ok(deviation)
    }

    fn compare(
        &self,
        output: &Output,
        (model, mechanism): (&BeamModel, &Mechanism),
        (state, node): (&State, &Node),
        deviation: &mut Deviation,
    ) -> Result<(), String> {
        let tolerance = &self.tolerance();
        let missing = |what: &str| format!("output {} lacks {what}", output.step);
        deviation.q(&state.q, &output.q, tolerance);
        let h_d = output.h_d.ok_or_else(|| missing("H_d"))?;
        deviation.energy(node.hamiltonian_projected.total(), h_d, tolerance);
        deviation.energy(model.elements.value(&state.q), output.strain_energy, tolerance);
        match output.e_d {
            Some(e_d) => deviation.energy(node.discrete_energy.total(), e_d, tolerance),
            None if Some(output.step) == self.steps => {}
            None => return Err(missing("E_d")),
        }
        let momentum = mechanism.momentum(&state.q, &node.p_projected);
        let linear = output.linear_momentum.ok_or_else(|| missing("linear_momentum"))?;
        let angular = output.angular_momentum.ok_or_else(|| missing("angular_momentum"))?;
        deviation.momentum(&momentum.linear, &linear, tolerance);
        deviation.momentum(&momentum.angular, &angular, tolerance);
        Ok(())
    }
}
