//! Whether the step of a rotating model with beams is linearly unstable, and which steps are.
//!
//! The step is linearized about the steady rotation of the initial velocities ([`vi_statics::step_stability`]). Where a
//! vibration grows, and not because the rotation itself is unstable, the band of unstable steps around it is found.

use crate::limits::Stiffness;
use crate::statics::Statics;
use crate::system;
use holonom_model::{Family, Model, Strain};
use serde::{Deserialize, Serialize};
use vi_statics::{Motion, StaticProblem, SteadyRotation, SteadyStep, vibrations};

/// Degrees of freedom beyond which a dense linearization is not asked for.
const LARGE: usize = 150;
/// Growth of a step that round-off does not explain.
const GROWS: f64 = 1e-6;
/// Ratio of two steps of the search.
const RATIO: f64 = std::f64::consts::SQRT_2;
/// The search ends at a step this much longer, and this much shorter.
const SPAN: (f64, f64) = (4.0, 256.0);

/// A band of steps of which the linearization about the steady rotation is unstable; the step of the model is in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnstableSteps {
    /// Angular velocity of the steady rotation, rad/s.
    pub speed: f64,
    /// By how much a vibration grows in a step of the model, `max |z| − 1`.
    pub growth: f64,
    /// The shortest unstable step that was found, s; all between are unstable.
    pub shortest: f64,
    /// The longest, s.
    pub longest: f64,
}

impl UnstableSteps {
    /// Of a model whose discrete potential lets unresolved vibrations grow, with `dof` degrees of freedom; `None` where the
    /// step is stable or the system does not rotate steadily.
    pub(crate) fn find(model: &Model, stiffness: &Stiffness, dof: usize) -> Option<Self> {
        let settings = &model.settings;
        let concerned = matches!(settings.strain, Strain::Averaged | Strain::Midpoint)
            && matches!(settings.scheme.family(), Family::Variational(_))
            && settings.order == 2
            && !stiffness.is_resolved()
            && dof <= LARGE;
        if !concerned {
            return None;
        }
        let (mut statics, rotation) = Statics::at_start(model).ok()?.in_own_rotation().ok()?;
        let rotation = rotation?;
        statics.relax().ok()?;
        Self::about(model, &rotation, statics.problem())
    }

    fn about(
        model: &Model,
        rotation: &SteadyRotation,
        problem: &mut StaticProblem,
    ) -> Option<Self> {
        let h = model.settings.step;
        let built = system::build(model).ok()?;
        let system = built.dynamics.variational(&built.mechanism);
        let q = problem.configuration().to_vec();
        let growth = |h: f64| {
            let step = SteadyStep::find(&system, &built.mechanism, rotation, (h, &q));
            step.map_or(f64::NAN, |step| step.growth)
        };
        let own = growth(h);
        if own.is_nan() || own <= GROWS {
            return None;
        }
        let found = vibrations(problem).ok()?;
        let physical = found.get(Motion::Growth, 0).map_or(0.0, |mode| mode.value.re);
        let numerical = |growth: f64, h: f64| growth > GROWS + 2.0 * (h * physical).exp_m1();
        let end = |ratio: f64, limit: f64| {
            let next = |last: &f64| Some(last * ratio).filter(|h| numerical(growth(*h), *h));
            let within = |step: &f64| (step / h).max(h / step) <= limit;
            std::iter::successors(Some(h), next).take_while(within).last().unwrap_or(h)
        };
        numerical(own, h).then(|| Self {
            speed: rotation.velocity.norm(),
            growth: own,
            shortest: end(1.0 / RATIO, SPAN.1),
            longest: end(RATIO, SPAN.0),
        })
    }

    /// What a warning says of it, with the remedy.
    pub(crate) fn warning(&self) -> String {
        let Self { speed, growth, shortest, longest } = self;
        format!(
            "the step is unstable: about the steady rotation of {} rad/s a vibration grows by the factor {:.4} in each step; so \
             it does in steps from {:.3e} s to {:.3e} s; write strain = \"mass_scaled\" or scheme = \"em-nodal\"",
            (1e6 * speed).round() / 1e6,
            1.0 + growth,
            shortest,
            longest
        )
    }
}
