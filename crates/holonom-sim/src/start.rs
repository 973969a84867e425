//! Initial values that satisfy the constraints: `simulation.project_start`.
//!
//! ```text
//! v_0 = argmin (v − v*)ᵀ M (v − v*)     G v + ∂g/∂t = 0,   θ̇_r = stated rate of each joint r that states one
//! ```
//! Stated rates are kept: each is a prescribed motion `θ_r = θ_r(0) + θ̇_r t` of a mechanism that is otherwise the
//! same, and its consistent initial values are taken. Rates that contradict each other or the constraints are
//! refused with their names.

use crate::assembly;
use crate::system::{self, System};
use holonom_model::{Constraint, Model, ModelError, MotionPath, Problem};
use vi_constraints::InitialValues;
use vi_constraints::initialization::start;
use vi_constraints::integrator::SetupError;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::Loops;
use vi_rigid::directors;

/// `(q_0, v_0)` that keep the rates which the joints of the model state.
///
/// # Errors
/// [`ModelError`] where no initial velocities have these rates.
pub(crate) fn with_stated_rates(model: &Model) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
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
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let refused = |error: &SetupError| assembly::refusal(error, model);
    let loops = Loops::find(&mechanism, 0.0, &q).map_err(|error| refused(&error))?;
    let rows = loops.rows_at_start.unwrap_or(loops.rows);
    let found = start(&system, &mechanism, &rows, InitialValues::new(0.0, &q, &v))
        .map_err(|error| refused(&error.into()))?;
    let (q, v) = (found.state.q, found.v);
    let tolerance = model.settings.start_tolerance;
    let missed = assembly::velocity_inconsistencies(&mechanism, (&q, &v), tolerance);
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

/// The largest changes of the initial velocities, `NAME by … m/s, NAME by … rad/s`.
pub(crate) fn change_of_velocities(
    mechanism: &Mechanism,
    (q, v): (&[f64], &[f64]),
    (q_start, v_start): (&[f64], &[f64]),
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
    let parts = parts.map(|((name, change), unit)| format!("`{name}` by {change:.3e} {unit}"));
    parts.collect::<Vec<_>>().join(", ")
}
