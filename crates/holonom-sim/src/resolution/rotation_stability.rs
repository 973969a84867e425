//! Whether the step of a rotating model with beams is linearly unstable, and which steps are.
//!
//! The step is linearized about the steady rotation of the initial velocities
//! ([`vi_statics::step_stability`]). Where a vibration grows, and not because the rotation itself
//! is unstable, the band of unstable steps around it is found.

use super::limits::Stiffness;
use super::unstable_steps::UnstableSteps;
use crate::statics::{InOwnRotation, Statics};
use crate::system;
use holonom_model::{Family, Model, Strain};
use vi_statics::{MotionKind, StaticProblem, SteadyRotation, SteadyStep, vibrations};

/// Degrees of freedom beyond which a dense linearization is not asked for.
const LARGE: usize = 150;
/// Growth of a step that round-off does not explain.
const GROWS: f64 = 1e-6;
/// Ratio of two steps of the search.
const RATIO: f64 = std::f64::consts::SQRT_2;
/// The search ends at a step this much longer, and this much shorter.
const SPAN: (f64, f64) = (4.0, 256.0);

/// Of a model whose discrete potential lets unresolved vibrations grow, with `dof` degrees of
/// freedom; `None` where the step is stable or the system does not rotate steadily.
pub(crate) fn unstable_steps(
    model: &Model,
    stiffness: &Stiffness,
    dof: usize,
) -> Option<UnstableSteps> {
    let settings = &model.settings;
    let concerned = matches!(settings.strain, Strain::Averaged | Strain::Midpoint)
        && matches!(settings.scheme.family(), Family::Variational(_))
        && settings.order == 2
        && !stiffness.is_resolved(settings)
        && dof <= LARGE;
    if !concerned {
        return None;
    }
    let found = Statics::at_start(model).ok()?.in_own_rotation().ok()?;
    let InOwnRotation { mut statics, rotation } = found;
    let rotation = rotation?;
    statics.relax().ok()?;
    about(model, &rotation, statics.problem())
}

fn about(
    model: &Model,
    rotation: &SteadyRotation,
    problem: &mut StaticProblem,
) -> Option<UnstableSteps> {
    let h = model.settings.step;
    let built = system::build(model).ok()?;
    let system = built.dynamics.variational(&built.mechanism);
    let q = problem.configuration().to_vec();
    let growth = |h: f64| {
        let step = SteadyStep::find(&system, &built.mechanism, rotation, h, &q);
        step.map_or(f64::NAN, |step| step.growth)
    };
    let own = growth(h);
    if own.is_nan() || own <= GROWS {
        return None;
    }
    let found = vibrations(problem).ok()?;
    let physical = found.get(MotionKind::Growth, 0).map_or(0.0, |mode| mode.value.re);
    let numerical = |growth: f64, h: f64| growth > GROWS + 2.0 * (h * physical).exp_m1();
    let end = |ratio: f64, limit: f64| {
        let next = |last: &f64| Some(last * ratio).filter(|h| numerical(growth(*h), *h));
        let within = |step: &f64| (step / h).max(h / step) <= limit;
        std::iter::successors(Some(h), next).take_while(within).last().unwrap_or(h)
    };
    numerical(own, h).then(|| UnstableSteps {
        speed: rotation.velocity.norm(),
        growth: own,
        shortest: end(1.0 / RATIO, SPAN.1),
        longest: end(RATIO, SPAN.0),
    })
}
