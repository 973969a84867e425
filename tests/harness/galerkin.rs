//! Cases of the Galerkin schemes of order `2s`: any kind with the field `stages`, and the table of
//! their constants.

use super::case::{BodyCase, Deviation, Runs, Tolerance, distance};
use super::rigid::{self, JointCase, SpringCase};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashMap;
use std::sync::Arc;
use vi_beam::{BeamModel, MassKind, Section, StrainRule};
use vi_constraints::discretization::Step;
use vi_constraints::{Constraints, InitialValues, Options, SchemeKind};
use vi_core::force::{Force, MidpointForce};
use vi_core::galerkin::{GaussLobatto, Stages};
use vi_core::sparse::Entries;
use vi_core::{Motion, Quadrature, SeparableSystem, SparseMatrix};
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::mechanism::{BodySpec, Mechanism};
use vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use vi_multibody::scalar_constraint::ScalarConstraint;

/// Fields of a case: those that are read, those that say where it comes from.
const KEYS: [&str; 31] = [
    "agreement_with_null_space_form",
    "bodies",
    "constraint_residual",
    "cut_joints",
    "description",
    "drive",
    "elements",
    "force_form",
    "forces",
    "gravity",
    "h",
    "joints",
    "kind",
    "length",
    "mass",
    "method",
    "name",
    "order",
    "output_steps",
    "outputs",
    "q0",
    "quadrature",
    "rhoA",
    "rhoI",
    "springs",
    "stages",
    "steps",
    "stiffness",
    "tolerance",
    "units",
    "v0",
];
/// Fields of an output.
const OUTPUT_KEYS: [&str; 17] = [
    "E_d",
    "H_dQ",
    "angular_momentum",
    "constraint_force",
    "constraint_force_acceleration",
    "constraint_force_minus",
    "constraint_force_plus",
    "interior",
    "lambda",
    "lambda_acceleration",
    "lambda_plus",
    "linear_momentum",
    "p",
    "p_projected",
    "q",
    "step",
    "t",
];

/// That an object has no field but these.
fn refuse_unknown(value: &Value, known: &[&str]) -> Result<(), String> {
    let keys = value.as_object().into_iter().flat_map(|object| object.keys());
    match keys.map(String::as_str).find(|key| !known.contains(key)) {
        Some(key) => Err(format!("unknown field `{key}`")),
        None => Ok(()),
    }
}

/// A case, with what of the library has no Galerkin form in the place of its system.
pub struct GalerkinCase {
    settings: Settings,
    system: Result<Subject, &'static str>,
}

#[derive(Deserialize)]
struct Settings {
    name: String,
    stages: usize,
    h: f64,
    steps: u64,
    output_steps: Vec<u64>,
    tolerance: Tolerance,
    outputs: Vec<Output>,
}

enum Subject {
    Pendulum(Pendulum),
    Bodies(Bodies),
    Beam(Beam),
}

#[derive(Deserialize)]
struct Pendulum {
    length: f64,
    mass: f64,
    gravity: [f64; 2],
    q0: [f64; 2],
    v0: [f64; 2],
}

#[derive(Deserialize)]
struct Bodies {
    gravity: [f64; 3],
    bodies: Vec<BodyCase>,
    joints: Vec<JointCase>,
    springs: Vec<SpringCase>,
    forces: Option<Forces>,
    drive: Option<Drive>,
}

/// A prescribed angle `0.3 + 0.4 sin 2t` about the axis of a joint.
#[derive(Deserialize)]
struct Drive {
    joint: usize,
    theta: String,
}

/// A free beam with lumped masses, free of strain initially.
#[derive(Deserialize)]
struct Beam {
    elements: Vec<[usize; 2]>,
    length: f64,
    stiffness: HashMap<String, f64>,
    #[serde(rename = "rhoA")]
    rho_a: f64,
    #[serde(rename = "rhoI")]
    rho_i: [f64; 3],
    gravity: [f64; 3],
    q0: Vec<f64>,
    v0: Vec<f64>,
    quadrature: String,
}

/// A follower wrench on body 1, damping of body 0, in director form at the Gauss nodes.
#[derive(Clone, Deserialize)]
struct Forces {
    force_body: [f64; 3],
    torque_body: [f64; 3],
}

#[derive(Deserialize)]
struct Output {
    step: u64,
    q: Vec<f64>,
    p_projected: Vec<f64>,
    constraint_force_acceleration: Vec<f64>,
    #[serde(rename = "E_d")]
    e_d: Option<f64>,
    #[serde(rename = "H_dQ")]
    h_dq: f64,
    linear_momentum: Option<[f64; 3]>,
    angular_momentum: Option<[f64; 3]>,
}

impl GalerkinCase {
    pub fn read(value: &Value) -> Result<Self, String> {
        let unreadable = |e: serde_json::Error| format!("is no Galerkin case: {e}");
        refuse_unknown(value, &KEYS)?;
        let outputs = value.get("outputs").and_then(Value::as_array);
        outputs.into_iter().flatten().try_for_each(|o| refuse_unknown(o, &OUTPUT_KEYS))?;
        let settings = Settings::deserialize(value).map_err(unreadable)?;
        let word = |key: &str| value.get(key).and_then(Value::as_str);
        let system = match (word("kind"), word("quadrature")) {
            _ if word("force_form") == Some("control_points") => Err("forces in node form"),
            (_, Some("lobatto")) => Err("Lobatto quadrature"),
            (Some("beam"), Some("gauss" | "interpolated_strains")) => {
                Ok(Subject::Beam(Beam::deserialize(value).map_err(unreadable)?))
            }
            (Some("pendulum2d"), Some("gauss")) => {
                Ok(Subject::Pendulum(Pendulum::deserialize(value).map_err(unreadable)?))
            }
            (Some("rigid"), Some("gauss")) => {
                Ok(Subject::Bodies(Bodies::deserialize(value).map_err(unreadable)?))
            }
            (kind, quadrature) => {
                return Err(format!("unknown kind or quadrature: {kind:?}, {quadrature:?}"));
            }
        };
        Ok(Self { settings, system })
    }

    /// By every form that applies; none where the library has no Galerkin form.
    pub fn run(&self) -> Result<Runs, String> {
        let subject = match &self.system {
            Ok(subject) => subject,
            Err(what) => {
                println!("{}: no Galerkin form of {what}", self.settings.name);
                return Ok(Runs::new());
            }
        };
        let (mechanism, _) = subject.build()?;
        let mut forms = vec![("constrained", SchemeKind::Constrained, Solver::Auto)];
        forms.push(("nodal", SchemeKind::Nodal, Solver::Auto));
        if !mechanism.has_loops() && !matches!(subject, Subject::Beam(_)) {
            forms.push(("nodal, dense", SchemeKind::Nodal, Solver::Dense));
        }
        forms
            .into_iter()
            .map(|(name, kind, solver)| Ok((name, self.deviation(subject, kind, solver)?)))
            .collect()
    }

    fn deviation(
        &self,
        subject: &Subject,
        kind: SchemeKind,
        solver: Solver,
    ) -> Result<Deviation, String> {
        let Settings { h, steps, output_steps, stages, tolerance, .. } = &self.settings;
        let (mechanism, system) = subject.build()?;
        let momentum_of = mechanism.clone();
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let stages = Stages::new(*stages).ok_or("no such number of stages")?;
        let options = Options::new(kind, *h).galerkin(stages);
        let at = InitialValues::new(0.0, &q, &v);
        let mut run =
            integrator(mechanism, system, options, solver, at).map_err(|e| e.to_string())?;
        let mut deviation = Deviation::default();
        for n in 0..=*steps {
            let output = self.settings.outputs.iter().find(|o| o.step == n);
            let listed = output_steps.contains(&n);
            if let (Some(output), true) = (output, listed) {
                compare(output, &mut run, &momentum_of, (tolerance, &mut deviation))?;
            } else if listed {
                return Err(format!("no output at step {n}"));
            }
            let mut energy = 0.0;
            let mut read = |system: &SeparableSystem, step: Step<'_>| {
                energy = step.discrete_energy(system);
            };
            let taken = run.step_with(&mut |system, _, step| read(system, step));
            taken.map_err(|e| format!("step {n}: {e}"))?;
            if let Some(e_d) = output.filter(|_| listed).and_then(|output| output.e_d) {
                deviation.energy(energy, e_d, tolerance);
            }
        }
        Ok(deviation)
    }
}

fn compare(
    output: &Output,
    run: &mut MechanismIntegrator,
    mechanism: &Mechanism,
    (tolerance, deviation): (&Tolerance, &mut Deviation),
) -> Result<(), String> {
    let node = run.observe_state().map_err(|e| e.to_string())?.clone();
    let lambda = run.acceleration_multiplier().map_err(|e| e.to_string())?;
    let (t, q) = (run.state().t, run.state().q.clone());
    let jacobian = SparseMatrix::assemble(mechanism.len(), mechanism.dim(), |out| {
        mechanism.jacobian(t, &q, out);
    });
    let mut force = vec![0.0; mechanism.dim()];
    jacobian.tr_mul_add(1.0, &lambda, &mut force);
    deviation.q(&q, &output.q, tolerance);
    deviation.p(&node.p_projected, &output.p_projected, tolerance);
    deviation.force(&force, &output.constraint_force_acceleration, tolerance);
    deviation.energy(node.hamiltonian_projected.total(), output.h_dq, tolerance);
    let momentum = mechanism.momentum(&q, &node.p_projected);
    if let (Some(linear), Some(angular)) = (&output.linear_momentum, &output.angular_momentum) {
        deviation.momentum(&momentum.linear, linear, tolerance);
        deviation.momentum(&momentum.angular, angular, tolerance);
    }
    Ok(())
}

impl Subject {
    fn build(&self) -> Result<(Mechanism, SeparableSystem), String> {
        match self {
            Self::Pendulum(Pendulum { length, mass, gravity, q0, v0 }) => {
                let plane = |x: &[f64; 2]| [x[0], x[1], 0.0];
                let mut builder = MechanismBuilder::planar().gravity(plane(gravity));
                let bob = builder.particle("bob", *mass, plane(q0), plane(v0));
                builder.bar_of_length("rod", [0.0; 3], bob, *length);
                let mechanism = builder.build().map_err(|e| e.to_string())?.mechanism;
                let system = mechanism.system(Quadrature::Midpoint);
                Ok((mechanism, system))
            }
            Self::Bodies(Bodies { gravity, bodies, joints, springs, forces, drive }) => {
                let mut mechanism = rigid::mechanism(*gravity, bodies, joints)?;
                if let Some(Drive { joint, theta }) = drive {
                    assert_eq!(theta, "0.3 + 0.4 sin 2t");
                    // joint angles of the harness are zero initially
                    let reference = |t: f64| {
                        let (sin, cos) = (2.0 * t).sin_cos();
                        [0.4 * sin, 0.8 * cos, -1.6 * sin]
                    };
                    let mut description = mechanism.description().clone();
                    let driven = &description.joints[*joint];
                    let angle = JointCoordinate::principal(driven, 0).ok_or("no angle")?;
                    let motion = ScalarConstraint::motion("drive", angle, Arc::new(reference));
                    description.scalars.push(motion);
                    mechanism = Mechanism::new(description);
                }
                let system = mechanism.system(Quadrature::Midpoint);
                let springs = rigid::springs(springs, &mechanism);
                let system = springs.into_iter().fold(system, SeparableSystem::potential);
                let forced = |system: SeparableSystem, forces: &Forces| {
                    system.force(Box::new(MidpointForce(forces.clone())))
                };
                let system = forces.iter().fold(system, forced);
                Ok((mechanism, system))
            }
            Self::Beam(beam) => beam.build(),
        }
    }
}

impl Beam {
    fn build(&self) -> Result<(Mechanism, SeparableSystem), String> {
        let mut model = BeamModel::new(self.gravity.into());
        for k in 0..self.q0.len() / 12 {
            let triad = |x: &[f64]| Matrix3::from_columns(&[1, 2, 3].map(|i| column(x, k, i)));
            let (d, rates) = (triad(&self.q0), triad(&self.v0));
            let omega = (0..3).map(|i| d.column(i).cross(&rates.column(i))).sum::<Vector3<f64>>();
            model.add_frame(BodySpec {
                name: format!("node {k}"),
                body: None,
                center: column(&self.q0, k, 0),
                triad: d,
                velocity: column(&self.v0, k, 0),
                omega: 0.5 * omega,
            });
        }
        let stiffness = ["GA1", "GA2", "EA", "EI1", "EI2", "GJ"].map(|key| self.stiffness[key]);
        let inertia = [self.rho_a, self.rho_i[0], self.rho_i[1], self.rho_i[2]];
        let section = Section::new(stiffness, inertia).map_err(|e| e.to_string())?;
        let section = model.elements.add_section(section);
        let q = model.configuration();
        for nodes in &self.elements {
            let added = model.elements.add_stress_free(*nodes, self.length, section, &q);
            added.map_err(|e| e.to_string())?;
        }
        model.elements.set_mass(0..self.elements.len(), MassKind::Lumped);
        let mechanism = model.mechanism();
        let rule =
            if self.quadrature == "gauss" { StrainRule::Midpoint } else { StrainRule::Averaged };
        let system = model.system(&mechanism, rule);
        Ok((mechanism, system))
    }
}

fn column(x: &[f64], body: usize, i: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&x[12 * body + 3 * i..12 * body + 3 * i + 3])
}

impl Force for Forces {
    fn add(&self, Motion { t, q, v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        let grown = 1.0 + 0.5 * (3.0 * t).sin();
        let in_space = |components: &[f64; 3]| {
            (0..3).map(|i| column(q, 1, i + 1) * (grown * components[i])).sum::<Vector3<f64>>()
        };
        let spin: Vector3<f64> =
            (1..4).map(|i| column(q, 0, i).cross(&column(v, 0, i))).sum::<Vector3<f64>>() * 0.5;
        let wrenches = [
            (-0.6 * column(v, 0, 0), -0.15 * spin),
            (in_space(&self.force_body), in_space(&self.torque_body)),
        ];
        for (body, (force, torque)) in wrenches.iter().enumerate() {
            for i in 0..4 {
                let part = if i == 0 { *force } else { 0.5 * torque.cross(&column(q, body, i)) };
                (0..3).for_each(|k| out[12 * body + 3 * i + k] += scale * part[k]);
            }
        }
    }

    fn add_position_derivative(&self, _: Motion<'_>, _: f64, _: &mut dyn Entries) {
        unreachable!("the Galerkin schemes take no derivatives of forces")
    }

    fn add_velocity_derivative(&self, _: Motion<'_>, _: f64, _: &mut dyn Entries) {
        unreachable!("the Galerkin schemes take no derivatives of forces")
    }

    fn is_dissipative(&self) -> bool {
        true
    }
}

/// The table of constants.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct Coefficients {
    #[serde(rename = "note")]
    _note: String,
    coefficients: Vec<Row>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
struct Row {
    stages: usize,
    lobatto_nodes: Vec<String>,
    lobatto_weights: Vec<String>,
    gauss_nodes: Vec<String>,
    gauss_weights: Vec<String>,
    #[serde(rename = "K")]
    _exact: Vec<Vec<String>>,
    K_grid: Vec<Vec<f64>>,
    E: Vec<Vec<String>>,
    D: Vec<Vec<String>>,
    #[serde(rename = "S")]
    _strains: Vec<Vec<String>>,
    K_hat_inverse: Vec<Vec<String>>,
    extrapolation: Vec<Vec<String>>,
}

fn numbers(row: &[String]) -> Vec<f64> {
    row.iter().map(|text| text.parse().unwrap_or(f64::NAN)).collect()
}

impl Coefficients {
    /// Deviations over their tolerances: of a few `ε` of the largest entry, of `K` by one unit of
    /// its grid.
    pub fn run(&self) -> Result<Runs, String> {
        let mut deviation = Deviation::default();
        let mut tolerance =
            Tolerance { q: 0.0, p: 0.0, constraint_force: 0.0, energy: 0.0, momentum: 0.0 };
        for row in &self.coefficients {
            let stages = Stages::new(row.stages).ok_or("no such number of stages")?;
            let found = GaussLobatto::new(stages);
            tolerance.q = 4.0 * f64::EPSILON;
            deviation.q(&found.nodes, &numbers(&row.lobatto_nodes), &tolerance);
            deviation.q(&found.weights, &numbers(&row.lobatto_weights), &tolerance);
            deviation.q(&found.gauss_nodes, &numbers(&row.gauss_nodes), &tolerance);
            deviation.q(&found.gauss_weights, &numbers(&row.gauss_weights), &tolerance);
            let matrices = [
                (&found.E, &row.E),
                (&found.D, &row.D),
                (&found.K_hat_inverse, &row.K_hat_inverse),
                (&found.extrapolation, &row.extrapolation),
            ];
            for (found, exact) in matrices {
                for (i, exact) in exact.iter().enumerate() {
                    let found: Vec<f64> = found.row(i).iter().copied().collect();
                    // the inverse is that of K on its grid, of spacing 6e-14
                    tolerance.p = 2e-13 * vi_core::linear::norm_inf(&numbers(exact)).max(1.0);
                    deviation.p(&found, &numbers(exact), &tolerance);
                }
            }
            for (i, exact) in row.K_grid.iter().enumerate() {
                for (j, exact) in exact.iter().enumerate() {
                    let unit = (2.0_f64).powi(-44) * if i == j { row.stages as f64 } else { 1.0 };
                    tolerance.momentum = unit;
                    deviation.momentum(&[found.K[(i, j)]], &[*exact], &tolerance);
                }
            }
            if distance(&[found.stages() as f64], &[row.stages as f64]) > 0.0 {
                return Err("another number of stages".into());
            }
        }
        Ok(vec![("constants", deviation)])
    }
}
