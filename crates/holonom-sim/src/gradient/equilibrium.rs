//! The end of a path of equilibria as a run without steps that begins there at rest.
//!
//! ```text
//! θ ── path of equilibria ── q(θ), μ(θ) at t = end ── J(q, μ, θ)
//! dJ/dθ = ∇J·δq + J_θ        δq: [`crate::design`], of the equilibrium; μ: of the acceleration level, a = 0
//! ```
//! Prescribed motions stand still where they are at the end.

use crate::design::refused;
use crate::shown::{all_read, named};
use crate::statics::{Statics, growing};
use crate::system::outside::{ExternalActions, OutsideMotion, Still};
use crate::system::time_function::TimeFunctions;
use holonom_model::{Constraint, CountedAt, Model, ModelError, Problem, Scheme, SensorKind, Start};
use std::sync::Arc;

/// A path of equilibria with its end.
pub(crate) struct AtEnd {
    /// The model with its loads as they grow, as one of a motion.
    pub(crate) model: Model,
    /// What holds it at the end.
    pub(crate) outside: ExternalActions,
    /// Time of the loads there, s.
    pub(crate) t: f64,
}

impl AtEnd {
    /// Of a model of statics, with what acts from outside.
    ///
    /// # Errors
    /// [`ModelError`] where the path does not reach its end.
    pub(crate) fn of(model: &Model, outside: &ExternalActions) -> Result<Self, ModelError> {
        let mut statics = Statics::with_outside(model, outside)?;
        statics.reach_end().map_err(|failure| {
            let message = format!(
                "the equilibrium at the end of the loads was not found: {}",
                failure.message
            );
            let problem = Problem::new("simulation.end", message);
            let help = "`holonom run` shows how far the path goes; choose an earlier end";
            ModelError::Assembly(vec![problem.help(help)])
        })?;
        let t = statics.end();
        let problem = statics.problem();
        let unstable = problem.unstable_directions().unwrap_or(0);
        let neutral = problem.is_neutral_here();
        let (q, angles) = (problem.configuration().to_vec(), problem.angles().to_vec());
        let mut run = growing(model);
        run.settings.scheme = Scheme::Nodal;
        run.settings.start = Start::Stated;
        run.settings.project_start = false;
        let held = model.constraints.iter().filter_map(|own| match own {
            Constraint::Motion { name, path, .. } => {
                let [value, ..] = TimeFunctions::new(model).path(name, path)(t);
                let path = Arc::new(move |_: f64| [value, 0.0, 0.0]);
                Some(OutsideMotion { constraint: name.clone(), path })
            }
            _ => None,
        });
        let motions = held.collect();
        let still = Some(Still { q, angles, unstable, neutral });
        Ok(Self { model: run, outside: ExternalActions { motions, still, ..outside.clone() }, t })
    }
}

/// Refuses objectives of these names, all where there are none, that are none of an equilibrium.
pub(crate) fn supported(model: &Model, of: &[String]) -> Result<(), ModelError> {
    let chosen = model.objectives.iter().filter(|own| of.is_empty() || of.contains(&own.name));
    for own in chosen {
        let key = format!("objective.{}", own.name);
        if !own.kind.reads_sensor() {
            let help = "take a sensor: it is read at the last equilibrium";
            return Err(refused(&format!("{key}.type"), "efforts and times in statics", help));
        }
        if own.at == CountedAt::Path {
            let what = "an integral along a path of equilibria";
            let help = "remove `at`: an objective of statics is that of the last equilibrium";
            return Err(refused(&format!("{key}.at"), what, help));
        }
        let sensor = own.sensor.as_deref().unwrap_or_default();
        resting(model, &format!("{key}.sensor"), sensor)?;
    }
    Ok(())
}

/// Refuses a sensor, named at a key, of what an equilibrium does not have.
pub(crate) fn resting(model: &Model, key: &str, sensor: &str) -> Result<(), ModelError> {
    named(model, key, sensor)?;
    let read = all_read(model, [sensor].into_iter());
    if let Some(own) = read.iter().find(|own| own.kind == SensorKind::Work) {
        let what = format!("the work `{}`, which equilibria do not have", own.name);
        return Err(refused(key, what, "take a position, an effort or a reaction"));
    }
    Ok(())
}
