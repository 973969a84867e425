//! Cases of kind `rigid`: bodies, joints, springs.

use super::case::{BodyCase, CompositionCase, Deviation, Runs, Tolerance};
use super::legendre::{self, Reference};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use vi_constraints::node::Node;
use vi_constraints::{Constraints, InitialValues, Integrator, Options, SchemeKind};
use vi_core::{DiscreteLagrangian, MechanicalSystem, Quadrature, SeparableSystem, State};
use vi_emscheme::{EmForm, EmSystem};
use vi_multibody::joint::{FrameId, Joint, Side, complete_axis};
use vi_multibody::mechanism::{Attachment, BodySpec, Description, Mechanism};
use vi_multibody::pair::PairKind;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use vi_multibody::spring::{Spring, SpringLaw};
use vi_rigid::directors;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigidCase {
    name: String,
    #[serde(rename = "kind")]
    _kind: String,
    #[serde(rename = "description")]
    _description: String,
    #[serde(rename = "units")]
    _units: String,
    gravity: [f64; 3],
    bodies: Vec<BodyCase>,
    joints: Vec<JointCase>,
    #[serde(default)]
    springs: Vec<SpringCase>,
    #[serde(default, rename = "cut_joints")]
    _cut_joints: Vec<usize>,
    scheme: String,
    quadrature: Option<String>,
    composition: Option<CompositionCase>,
    h: f64,
    steps: u64,
    output_steps: Vec<u64>,
    dof: usize,
    constraints: usize,
    redundant_constraints: usize,
    tolerance: Tolerance,
    #[serde(rename = "continuous_tolerance")]
    _continuous_tolerance: Option<f64>,
    #[serde(default, rename = "continuous")]
    _continuous: Vec<serde_json::Value>,
    #[serde(rename = "statistics")]
    _statistics: Option<serde_json::Value>,
    outputs: Vec<Output>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointCase {
    #[serde(rename = "type")]
    kind: String,
    parent: i64,
    child: i64,
    anchor_parent: [f64; 3],
    anchor_child: [f64; 3],
    axis: Option<[f64; 3]>,
    #[serde(rename = "name")]
    _name: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpringCase {
    body_a: i64,
    body_b: i64,
    point_a: [f64; 3],
    point_b: [f64; 3],
    k: f64,
    l0: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Output {
    step: u64,
    #[serde(rename = "t")]
    _t: f64,
    q: Vec<f64>,
    p: Option<Vec<f64>>,
    p_projected: Option<Vec<f64>>,
    constraint_force: Option<Vec<f64>>,
    constraint_force_mid: Option<Vec<f64>>,
    #[serde(rename = "E_d")]
    e_d: Option<f64>,
    #[serde(rename = "H_d")]
    h_d: Option<f64>,
    #[serde(rename = "H_dQ")]
    h_dq: Option<f64>,
    #[serde(rename = "H")]
    h: Option<f64>,
    linear_momentum: [f64; 3],
    angular_momentum: [f64; 3],
}

fn frame(index: i64) -> FrameId {
    usize::try_from(index).map_or(FrameId::Ground, FrameId::Frame)
}

fn pair_kind(name: &str) -> Result<PairKind, String> {
    match name {
        "S" => Ok(PairKind::Spherical),
        "R" => Ok(PairKind::Revolute),
        "C" => Ok(PairKind::Cylindrical),
        "P" => Ok(PairKind::Prismatic),
        "E" => Ok(PairKind::Planar),
        "fixed" => Ok(PairKind::Fixed),
        _ => Err(format!("unknown joint type `{name}`")),
    }
}

/// The mechanism of bodies and joints.
pub fn mechanism(
    gravity: [f64; 3],
    bodies: &[BodyCase],
    joints: &[JointCase],
) -> Result<Mechanism, String> {
    let bodies: Vec<BodySpec> = bodies.iter().map(BodyCase::spec).collect::<Result<_, _>>()?;
    let coordinates = |id: FrameId| match id {
        FrameId::Ground => vi_multibody::joint::GROUND,
        FrameId::Frame(k) => {
            let mut q = [0.0; 12];
            directors::set_frame(&mut q, &bodies[k].center, &bodies[k].triad);
            q
        }
    };
    let joint = |(k, joint): (usize, &JointCase)| -> Result<Joint, String> {
        let (parent, child) = (frame(joint.parent), frame(joint.child));
        let kind = pair_kind(&joint.kind)?;
        // child-fixed vectors follow from the initial configuration
        let axes_parent = match joint.axis {
            Some(axis) => complete_axis(&Vector3::from(axis).normalize()),
            None if kind.has_axis() => return Err(format!("joint {k} lacks its axis")),
            None => Matrix3::identity(),
        };
        let world = directors::triad(&coordinates(parent)) * axes_parent;
        let axes_child = directors::triad(&coordinates(child)).transpose() * world;
        Ok(Joint {
            name: format!("joint {k}"),
            kind,
            parent: Side { frame: parent, anchor: joint.anchor_parent.into(), axes: axes_parent },
            child: Side { frame: child, anchor: joint.anchor_child.into(), axes: axes_child },
        })
    };
    let joints = joints.iter().enumerate().map(joint).collect::<Result<_, _>>()?;
    Ok(Mechanism::new(Description {
        dimension: 3,
        gravity: gravity.into(),
        bodies,
        joints,
        ..Description::default()
    }))
}

/// The springs of a case.
pub fn springs(springs: &[SpringCase], mechanism: &Mechanism) -> Vec<Spring> {
    let attach = |body: i64| match frame(body) {
        FrameId::Ground => Attachment::Ground,
        FrameId::Frame(k) => Attachment::Body(k),
    };
    let end = |body, point: [f64; 3]| mechanism.point_of(attach(body), &Vector3::from(point));
    let spring = |spring: &SpringCase| {
        let between = end(spring.body_b, spring.point_b).minus(&end(spring.body_a, spring.point_a));
        let (stiffness, natural_length) = (spring.k, spring.l0);
        Spring { between, stiffness, natural_length, law: SpringLaw::Linear }
    };
    springs.iter().map(spring).collect()
}

impl RigidCase {
    pub fn mechanism(&self) -> Result<Mechanism, String> {
        mechanism(self.gravity, &self.bodies, &self.joints)
    }

    fn system(&self, mechanism: &Mechanism) -> Result<SeparableSystem, String> {
        let quadrature = match self.quadrature.as_deref() {
            None | Some("midpoint") => Quadrature::Midpoint,
            Some("trapezoidal") => Quadrature::Trapezoidal,
            Some(other) => return Err(format!("unknown quadrature `{other}`")),
        };
        let system = mechanism.system(quadrature);
        Ok(self.springs(mechanism).into_iter().fold(system, SeparableSystem::potential))
    }

    fn springs(&self, mechanism: &Mechanism) -> Vec<Spring> {
        springs(&self.springs, mechanism)
    }

    pub fn run(&self) -> Result<Runs, String> {
        match self.scheme.as_str() {
            "variational" => {
                let mut runs = Runs::new();
                for kind in SchemeKind::ALL {
                    runs.push((kind.name(), self.variational(kind, Solver::Auto)?));
                }
                if !self.mechanism()?.has_loops() {
                    for (name, solver) in
                        [("nodal, dense", Solver::Dense), ("nodal, sparse", Solver::Sparse)]
                    {
                        runs.push((name, self.variational(SchemeKind::Nodal, solver)?));
                    }
                }
                Ok(runs)
            }
            "em" if self.composition.is_some() || self.quadrature.is_some() => {
                Err(format!("energy–momentum case with composition or quadrature in {}", self.name))
            }
            "em" => super::em::forms(&self.mechanism()?)
                .iter()
                .map(|form| Ok((form.name(), self.energy_momentum(*form)?)))
                .collect(),
            other => Err(format!("unknown scheme `{other}` in {}", self.name)),
        }
    }

    pub fn legendre(&self) -> Option<Result<Deviation, String>> {
        if self.composition.is_some() || self.scheme != "variational" {
            return None;
        }
        let nodes = self.outputs.first_chunk::<3>().filter(|n| n[2].step == 2)?;
        let mut references = Vec::new();
        for node in nodes {
            references.push(Reference {
                q: &node.q,
                p: node.p.as_ref()?,
                force: node.constraint_force.as_ref()?,
                lambda: None,
                e_d: node.e_d?,
                h_d: node.h_d?,
                h_dq: node.h_dq?,
            });
        }
        let references = references.try_into().ok()?;
        Some(self.mechanism().and_then(|mechanism| {
            let system = self.system(&mechanism)?;
            legendre::deviation(&system, &mechanism, self.h, &references, &self.tolerance)
        }))
    }

    fn energy_momentum(&self, form: EmForm) -> Result<Deviation, String> {
        let mechanism = self.mechanism()?;
        let system = EmSystem::of_mechanism(&mechanism);
        let system = self.springs(&mechanism).into_iter().fold(system, EmSystem::spring);
        let momentum_of = mechanism.clone();
        let mut deviation = Deviation::default();
        let steps = (self.steps, &self.output_steps[..]);
        super::em::drive((system, mechanism), (form, self.h), steps, |step, state, node| {
            let output = self.outputs.iter().find(|o| o.step == step);
            let output = output.ok_or_else(|| format!("no output at step {step}"))?;
            self.compare_em(output, &momentum_of, (state, node), &mut deviation)
        })?;
        Ok(deviation)
    }

    fn compare_em(
        &self,
        output: &Output,
        mechanism: &Mechanism,
        (state, node): (&State, &Node),
        deviation: &mut Deviation,
    ) -> Result<(), String> {
        let tolerance = &self.tolerance;
        let missing = |what: &str| format!("output {} lacks {what}", output.step);
        deviation.q(&state.q, &output.q, tolerance);
        deviation.p(&node.p, output.p.as_ref().ok_or_else(|| missing("p"))?, tolerance);
        let force = output.constraint_force_mid.as_ref();
        let force = force.ok_or_else(|| missing("constraint_force_mid"))?;
        deviation.force(&node.constraint_force_mid, force, tolerance);
        deviation.energy(
            node.discrete_energy.total(),
            output.h.ok_or_else(|| missing("H"))?,
            tolerance,
        );
        let momentum = mechanism.momentum(&state.q, &node.p);
        deviation.momentum(&momentum.linear, &output.linear_momentum, tolerance);
        deviation.momentum(&momentum.angular, &output.angular_momentum, tolerance);
        let energies = [output.e_d, output.h_d, output.h_dq];
        let vectors = [&output.p_projected, &output.constraint_force];
        if energies.iter().any(Option::is_some) || vectors.iter().any(|v| v.is_some()) {
            return Err("variational outputs in an energy–momentum case".into());
        }
        Ok(())
    }

    pub fn integrator(
        &self,
        kind: SchemeKind,
        solver: Solver,
    ) -> Result<MechanismIntegrator, String> {
        let mechanism = self.mechanism()?;
        let system = self.system(&mechanism)?;
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let options = Options::new(kind, self.h);
        let run = integrator(mechanism, system, options, solver, InitialValues::new(0.0, &q, &v));
        let composed = |run: MechanismIntegrator| match &self.composition {
            Some(composition) => run.with_coefficients(composition.gammas.clone()),
            None => Ok(run),
        };
        run.and_then(composed).map_err(|e| e.to_string())
    }

    fn variational(&self, kind: SchemeKind, solver: Solver) -> Result<Deviation, String> {
        let mut run = self.integrator(kind, solver)?;
        let (m, rank) = (run.constraints().len(), run.rows().len());
        let found = (run.system().dim() - rank, m, m - rank);
        let expected = (self.dof, self.constraints, self.redundant_constraints);
        if found != expected {
            return Err(format!(
                "(dof, constraints, redundant) = {found:?}, expected {expected:?}"
            ));
        }
        let mechanism = self.mechanism()?;
        let mut deviation = Deviation::default();
        drive(&mut run, self.steps, &self.output_steps, |step, state, node| {
            let output = self
                .outputs
                .iter()
                .find(|o| o.step == step)
                .ok_or_else(|| format!("no output at step {step}"))?;
            self.compare(output, &mechanism, (state, node), &mut deviation)
        })?;
        Ok(deviation)
    }

    fn compare(
        &self,
        output: &Output,
        mechanism: &Mechanism,
        (state, node): (&State, &Node),
        deviation: &mut Deviation,
    ) -> Result<(), String> {
        let tolerance = &self.tolerance;
        let missing = |what: &str| format!("output {} lacks {what}", output.step);
        deviation.q(&state.q, &output.q, tolerance);
        let composed = self.composition.is_some();
        let p = if composed {
            let p = output.p_projected.as_ref().ok_or_else(|| missing("p_projected"))?;
            deviation.p(&node.p_projected, p, tolerance);
            &node.p_projected
        } else {
            deviation.p(&node.p, output.p.as_ref().ok_or_else(|| missing("p"))?, tolerance);
            let force = output.constraint_force.as_ref();
            let force = force.ok_or_else(|| missing("constraint_force"))?;
            deviation.force(&node.constraint_force, force, tolerance);
            let e_d = output.e_d.ok_or_else(|| missing("E_d"))?;
            deviation.energy(node.discrete_energy.total(), e_d, tolerance);
            if let (Some(found), Some(h_d)) = (node.hamiltonian, output.h_d) {
                deviation.energy(found.total(), h_d, tolerance);
            } else if node.hamiltonian.is_some() != output.h_d.is_some() {
                return Err("H_d with p_n exists on one side only".into());
            }
            &node.p
        };
        let projected = output.h_dq.ok_or_else(|| missing("H_dQ"))?;
        deviation.energy(node.hamiltonian_projected.total(), projected, tolerance);
        let momentum = mechanism.momentum(&state.q, p);
        deviation.momentum(&momentum.linear, &output.linear_momentum, tolerance);
        deviation.momentum(&momentum.angular, &output.angular_momentum, tolerance);
        if output.h.is_some() || output.constraint_force_mid.is_some() {
            return Err("energy–momentum outputs in a variational case".into());
        }
        Ok(())
    }
}

/// Steps to the end and hands over the listed nodes.
pub fn drive<S: DiscreteLagrangian + 'static, C: Constraints + 'static>(
    run: &mut Integrator<S, C>,
    steps: u64,
    output_steps: &[u64],
    mut compare: impl FnMut(u64, &State, &Node) -> Result<(), String>,
) -> Result<(), String> {
    for n in 0..steps {
        run.step().map_err(|e| format!("step {n}: {e}"))?;
        if output_steps.contains(&n) {
            let node = run.node_before().map_err(|e| format!("node {n}: {e}"))?.clone();
            compare(n, run.before(), &node)?;
        }
    }
    if output_steps.contains(&steps) {
        let node = run.observe().map_err(|e| format!("node {steps}: {e}"))?.clone();
        compare(steps, run.state(), &node)?;
    }
    if let Some(n) = output_steps.iter().find(|n| **n > steps) {
        return Err(format!("output step {n} is beyond the last step {steps}"));
    }
    Ok(())
}
