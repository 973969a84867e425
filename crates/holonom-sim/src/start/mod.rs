//! Where a run begins: `simulation.start`, `simulation.project_start`.
//!
//! `start = "relaxed"`: the equilibrium under the loads at `t = 0`, or of the steady rotation that
//! the initial velocities are ([`vi_statics::rotation`]), `v_0 = W (q_0 − q_o)`.
//!
//! `project_start = true`: initial values that satisfy the constraints. Shapes that overlap are
//! moved apart where their contact says so ([`separation`]).
//!
//! ```text
//! v_0 = argmin (v − v*)ᵀ M (v − v*)     G v + ∂g/∂t = 0,   θ̇_r = stated rate of each joint r that states one
//! ```
//! Stated rates are kept: each is a prescribed motion `θ_r = θ_r(0) + θ̇_r t` of a mechanism that
//! is otherwise the same, and its consistent initial values are taken. Rates that contradict each
//! other or the constraints are refused with their names.

pub(crate) mod independent;
mod joints;
mod others;
mod rolling;
mod rough_start;
pub(crate) mod separation;

use crate::assembly;
use crate::digits::rounded;
use crate::run::outcome::RunFailure;
use crate::statics::{InOwnRotation, Statics};
use crate::system::outside::{ExternalActions, JointStart};
use crate::system::{self, System};
use holonom_model::{Constraint, Inconsistency, Model, ModelError, MotionPath, Problem};
use independent::TreeCoordinate;
use vi_constraints::initialization::start;
use vi_constraints::integrator::SetupError;
use vi_constraints::{Constraints, InitialValues};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::IndependentLoops;
use vi_rigid::directors;
use vi_statics::{RotationError, SteadyMotion, SteadyRotation};

/// The initial values of a run.
pub(crate) struct StartValues {
    pub(crate) q: Vec<f64>,
    pub(crate) v: Vec<f64>,
    pub(crate) how: How,
    /// Whether shapes that overlapped were moved apart.
    pub(crate) separated: bool,
    /// Angles with the revolutions that are given; principal values where this is empty.
    pub(crate) angles: Vec<f64>,
    /// The independent coordinates of a closed mechanism that were given or kept.
    pub(crate) kept: Vec<TreeCoordinate>,
}

/// How initial values come about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum How {
    /// As stated.
    Stated,
    /// Projected with the stated rates of joints.
    WithRates,
    /// Relaxed to an equilibrium.
    Relaxed {
        /// Of its rotation, rad/s.
        speed: f64,
        /// Directions in which it is unstable.
        unstable: usize,
        /// Whether some direction has no stiffness.
        neutral: bool,
        /// As a whole, where it does.
        rotation: Option<SteadyRotation>,
    },
    /// An equilibrium that was found before.
    Standing {
        /// Whether some direction has no stiffness.
        neutral: bool,
    },
}

impl StartValues {
    fn new((q, v): (Vec<f64>, Vec<f64>), how: How) -> Self {
        Self { q, v, how, separated: false, angles: Vec::new(), kept: Vec::new() }
    }

    /// The initial values of a model, with what is given for its joints from outside.
    ///
    /// # Errors
    /// [`ModelError`]: they violate the constraints, there is no equilibrium, or joints cannot be
    /// brought to what is given.
    pub(crate) fn of(
        model: &Model,
        mechanism: &Mechanism,
        outside: &ExternalActions,
    ) -> Result<Self, ModelError> {
        if let Some(still) = &outside.still {
            let (q, how) = (still.q.clone(), How::Standing { neutral: still.neutral });
            let v = vec![0.0; q.len()];
            return Ok(Self { angles: still.angles.clone(), ..Self::new((q, v), how) });
        }
        if outside.start == JointStart::default() {
            return Self::of_model(model, mechanism);
        }
        joints::begun(model, mechanism, outside, Self::consistent(model, mechanism)?)
    }

    /// Those of the model itself, projected where it says so.
    ///
    /// # Errors
    /// As of [`StartValues::of`].
    pub(crate) fn consistent(model: &Model, mechanism: &Mechanism) -> Result<Self, ModelError> {
        joints::projected(model, Self::of_model(model, mechanism)?)
    }

    fn of_model(model: &Model, mechanism: &Mechanism) -> Result<Self, ModelError> {
        if model.settings.start == holonom_model::Start::Relaxed {
            return relaxed(model);
        }
        let (q, v) = (drawn(model, mechanism), mechanism.initial_velocity());
        let tolerance = model.settings.start_tolerance;
        let mut missed = assembly::velocity_inconsistencies(mechanism, &q, &v, tolerance);
        if missed.is_empty() || nearly_consistent(mechanism, &q, &v, tolerance) {
            return Ok(Self::new((q, v), How::Stated));
        }
        if !model.settings.project_start {
            offer_rates(model, mechanism, &mut missed);
            rolling::offer_rolling(model, mechanism, &q, &v, &mut missed);
            return Err(ModelError::InconsistentStart(missed));
        }
        if model.joints.iter().any(|joint| joint.rate.is_some()) {
            return Ok(Self::new(with_stated_rates(model)?, How::WithRates));
        }
        Ok(Self::new((q, v), How::Stated))
    }
}

/// The configuration that the model states, brought together where it is drawn roughly and may be
/// projected.
fn drawn(model: &Model, mechanism: &Mechanism) -> Vec<f64> {
    let q = mechanism.initial_configuration();
    let together = || rough_start::placed(mechanism, model.bodies.len(), &q);
    model.settings.project_start.then(together).flatten().unwrap_or(q)
}

/// Offers the rate of the joint of each prescribed motion that the initial velocities miss, where
/// it decides on them: where no loop or gear passes it on.
fn offer_rates(model: &Model, mechanism: &Mechanism, missed: &mut [Inconsistency]) {
    let alone = |constraint: &Constraint| matches!(constraint, Constraint::Motion { .. });
    if !mechanism.cut_joints().is_empty() || !model.constraints.iter().all(alone) {
        return;
    }
    let first = mechanism.len() - mechanism.rows().len();
    for missed in missed {
        let named = |own: &&Constraint| missed.key == format!("constraint.{}", own.name());
        let Some(Constraint::Motion { name, joint, freedom, .. }) =
            model.constraints.iter().find(named)
        else {
            continue;
        };
        let scalars = &mechanism.description().scalars;
        let scalar = scalars.iter().position(|scalar| scalar.name == *name);
        let own = model.joint(joint);
        let (Some(scalar), Some(own)) = (scalar, own) else { continue };
        let row = &mechanism.rows()[mechanism.scalar_rows(scalar).start - first];
        let rate = -row.time_derivatives(0.0)[0];
        let given = own.rate.as_ref().map_or(&[][..], |rate| rate.values());
        let count = own.pair().dof();
        let value = |k: usize| match k == *freedom {
            true => rate,
            false => given.get(k).copied().unwrap_or(0.0),
        };
        let values: Vec<String> = (0..count).map(|k| format!("{:?}", value(k))).collect();
        let value = if count == 1 { values.concat() } else { format!("[{}]", values.join(", ")) };
        missed.instead = Some(format!("write `rate = {value}` in the [[joint]] `{joint}`"));
    }
}

/// Whether only constraints that nearly follow from the others are violated by initial velocities,
/// and no more than they are by the motion.
fn nearly_consistent(mechanism: &Mechanism, q: &[f64], v: &[f64], tolerance: f64) -> bool {
    let loops = IndependentLoops::find(mechanism, 0.0, q).ok();
    let Some(nearly) = loops.and_then(|loops| loops.nearly_redundant()) else { return false };
    let mechanism = mechanism.clone().accepting(Some(nearly));
    assembly::velocity_inconsistencies(&mechanism, q, v, tolerance).is_empty()
}

/// How a relaxed system moves.
enum InSpace {
    Rotates(SteadyRotation),
    Moves(SteadyMotion),
}

/// The equilibrium under the loads at `t = 0`, at rest, in the steady rotation of the initial
/// velocities or, where what is fixed in space lets the system not rotate as a whole, in their
/// steady motion: a round shaft spins in space.
fn relaxed(model: &Model) -> Result<StartValues, ModelError> {
    let refused = |message: String, help: &str| {
        let problem = Problem::new("simulation.start".to_owned(), message);
        ModelError::Assembly(vec![problem.help(help)])
    };
    let none = |error: RotationError| {
        let help =
            "write start = \"stated\", or initial velocities of one rotation of the whole system";
        refused(format!("there is no relaxed start: {error}"), help)
    };
    let (mut statics, motion) = match Statics::at_start(model)?.in_own_rotation() {
        Ok(InOwnRotation { statics, rotation }) => (statics, rotation.map(InSpace::Rotates)),
        Err(error) => match Statics::at_start(model)?.in_own_motion() {
            Ok((statics, motion)) => (statics, Some(InSpace::Moves(motion))),
            Err(_) => return Err(none(error)),
        },
    };
    let missing = |failure: RunFailure| {
        let message = format!("the equilibrium to start from was not found: {}", failure.message);
        refused(message, "write start = \"stated\"")
    };
    statics.relax().map_err(missing)?;
    let q = statics.problem().configuration().to_vec();
    let mut v = vec![0.0; q.len()];
    let speed = match &motion {
        None => 0.0,
        Some(InSpace::Rotates(rotation)) => {
            rotation.velocities(statics.mechanism(), &q, &mut v);
            rotation.velocity.norm()
        }
        Some(InSpace::Moves(motion)) => {
            motion.velocities(statics.mechanism(), &q, &mut v);
            motion.velocity.norm()
        }
    };
    let unstable = statics.problem().unstable_directions().unwrap_or(0);
    let neutral = statics.problem().is_neutral();
    let rotation = match motion {
        Some(InSpace::Rotates(rotation)) => Some(rotation),
        _ => None,
    };
    Ok(StartValues::new((q, v), How::Relaxed { speed, unstable, neutral, rotation }))
}

/// `(q_0, v_0)` that keep the rates which the joints of the model state.
///
/// # Errors
/// [`ModelError`] where no initial velocities have these rates.
fn with_stated_rates(model: &Model) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
    let mut driven = model.clone();
    for joint in &model.joints {
        let rates = joint.rate.as_ref().map_or(&[][..], |rate| rate.values());
        for (freedom, rate) in rates.iter().enumerate() {
            let path = MotionPath { rate: *rate, ..MotionPath::default() };
            let (name, joint) = (joint.name.clone(), joint.name.clone());
            driven.constraints.push(Constraint::Motion { name, joint, freedom, path });
        }
    }
    let System { mechanism, dynamics, .. } = system::build(&driven)?;
    let system = dynamics.variational(&mechanism);
    let (q, v) = (drawn(model, &mechanism), mechanism.initial_velocity());
    let refused = |error: &SetupError| assembly::refusal(error, model);
    let loops = IndependentLoops::find(&mechanism, 0.0, &q).map_err(|error| refused(&error))?;
    let mechanism = mechanism.accepting(loops.nearly_redundant());
    let rows = loops.rows_at_start.unwrap_or(loops.rows);
    let found = start(&system, &mechanism, &rows, InitialValues::new(0.0, &q, &v))
        .map_err(|error| refused(&error.into()))?;
    let (q, v) = (found.state.q, found.v);
    let tolerance = model.settings.start_tolerance;
    let missed = assembly::velocity_inconsistencies(&mechanism, &q, &v, tolerance);
    if missed.is_empty() {
        return Ok((q, v));
    }
    let keys: Vec<String> =
        missed.iter().map(|m| m.key.replacen("constraint.", "joint.", 1)).collect();
    let message = format!(
        "the rates that the joints state cannot all be kept: no initial velocities satisfy {} with the others",
        keys.join(", ")
    );
    let problem = Problem::new(keys[0].clone(), message);
    let help = "state fewer rates: the others follow from the constraints";
    Err(ModelError::Assembly(vec![problem.help(help)]))
}

/// The largest changes of the initial configuration, `by … m (NAME), … rad (NAME)`, and the length
/// alone, m.
pub(crate) fn change_of_configuration(
    mechanism: &Mechanism,
    given: &[f64],
    found: &[f64],
) -> (f64, String) {
    let description = mechanism.description();
    let (mut length, mut turn) = (("", 0.0_f64), ("", 0.0_f64));
    for (k, body) in description.bodies.iter().enumerate() {
        let own = 12 * k..12 * k + 12;
        let (a, b) = (&given[own.clone()], &found[own]);
        let moved = (directors::center(b) - directors::center(a)).norm();
        if moved > length.1 {
            length = (&body.name, moved);
        }
        // |R_b − R_a| = 2 √2 sin(φ/2)
        let apart = (directors::triad(b) - directors::triad(a)).norm();
        let angle = 2.0 * (apart / 8.0_f64.sqrt()).min(1.0).asin();
        if angle > turn.1 {
            turn = (&body.name, angle);
        }
    }
    for (k, particle) in description.particles.iter().enumerate() {
        let at = mechanism.particle_offset(k);
        let own = at..at + description.dimension;
        let moved: f64 =
            given[own.clone()].iter().zip(&found[own]).map(|(a, b)| (a - b).powi(2)).sum();
        if moved.sqrt() > length.1 {
            length = (&particle.name, moved.sqrt());
        }
    }
    let parts = [(length, "m"), (turn, "rad")].into_iter().filter(|((_, by), _)| *by > 0.0);
    let parts = parts.map(|((name, by), unit)| format!("`{name}` by {} {unit}", rounded(by, 4)));
    (length.1, parts.collect::<Vec<_>>().join(", "))
}

/// The largest changes of the initial velocities, `NAME by … m/s, NAME by … rad/s`.
pub(crate) fn change_of_velocities(
    mechanism: &Mechanism,
    q: &[f64],
    v: &[f64],
    q_start: &[f64],
    v_start: &[f64],
) -> String {
    let description = mechanism.description();
    let mut linear = ("", 0.0_f64);
    let mut angular = ("", 0.0_f64);
    for (k, body) in description.bodies.iter().enumerate() {
        let own = 12 * k..12 * k + 12;
        let twist = |q: &[f64], v: &[f64]| {
            (
                directors::center(&v[own.clone()]),
                directors::angular_velocity(&q[own.clone()], &v[own.clone()]),
            )
        };
        let ((a, turning), (b, turned)) = (twist(q, v), twist(q_start, v_start));
        if (b - a).norm() > linear.1 {
            linear = (&body.name, (b - a).norm());
        }
        if (turned - turning).norm() > angular.1 {
            angular = (&body.name, (turned - turning).norm());
        }
    }
    for (k, particle) in description.particles.iter().enumerate() {
        let at = mechanism.particle_offset(k);
        let own = at..at + description.dimension;
        let change: f64 =
            v[own.clone()].iter().zip(&v_start[own]).map(|(a, b)| (a - b).powi(2)).sum();
        if change.sqrt() > linear.1 {
            linear = (&particle.name, change.sqrt());
        }
    }
    let parts = [(linear, "m/s"), (angular, "rad/s")];
    let parts = parts.iter().filter(|((_, change), _)| *change > 0.0);
    let parts =
        parts.map(|((name, change), unit)| format!("`{name}` by {} {unit}", rounded(*change, 4)));
    parts.collect::<Vec<_>>().join(", ")
}
