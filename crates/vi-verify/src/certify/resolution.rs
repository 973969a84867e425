//! Whether the step of a plan resolves the fastest motion: what holds for small steps only is not
//! applicable otherwise.

use super::{Certifier, conditioned_as_expected};
use crate::certificate::{Finding, Verdict};
use crate::frequency::RESOLVED;
use crate::judge::scientific;
use crate::measure::conditioning;
use crate::subject::SchemeSetting;
use vi_core::Composition;

impl Certifier<'_> {
    /// `h ω_max` at the beginning with the longest sub-step of a composition, where it does not
    /// resolve the fastest motion; `None` of order 2, which need not do that.
    pub(super) fn unresolved(&self, setting: SchemeSetting) -> Option<f64> {
        let longest = Composition::of_order(setting.order).filter(|_| setting.order > 2)?.longest();
        let resolution = self.frequency(setting)? * setting.step.abs() * longest;
        (resolution > RESOLVED).then_some(resolution)
    }

    /// A finding for small steps: it is not applicable where the step of the plan does not resolve
    /// the motion.
    pub(super) fn push_of_small_steps(&mut self, mut finding: Finding) {
        if finding.verdict == Verdict::Fail
            && let Some(why) = self.not_resolved()
        {
            finding.verdict = Verdict::NotApplicable;
            finding.reason =
                format!("the fastest motion is not resolved at h = {} s: {why}", self.plan.step);
        }
        self.push(finding);
    }

    /// Why the step of the plan does not resolve the fastest motion: a stiff beam by `h ω_max`, a
    /// stiff spring or damper by condition numbers that no longer change from a smaller step on.
    pub(super) fn not_resolved(&mut self) -> Option<String> {
        if let Some(known) = &self.not_resolved {
            return known.clone();
        }
        let (h, method) = (self.plan.step, self.plan.methods[0].0);
        let holds = |step: f64| {
            let setting = SchemeSetting { step, ..self.setting(method, 2) };
            let numbers = conditioning(self.subject, setting);
            numbers.map(|numbers| conditioned_as_expected(method, &numbers))
        };
        let by_frequency = || {
            let frequency = self.frequency(self.setting(method, 2))?;
            let below = RESOLVED / frequency;
            (below < h.abs()).then(|| {
                format!(
                    "h ω_max = {}, steps below {below:.0e} s resolve it",
                    scientific(h.abs() / below, 1)
                )
            })
        };
        let by_condition = || {
            let finer = (1..=4).map(|k| h / 8_f64.powi(k));
            let settled = match holds(h) {
                Ok(false) => finer.into_iter().find(|step| holds(*step).is_ok_and(|holds| holds)),
                _ => None,
            };
            settled.map(|step| format!("condition numbers settle from h = {step:.0e} s on"))
        };
        let found = by_frequency().or_else(by_condition);
        self.not_resolved = Some(found.clone());
        found
    }

    /// `ω_max` at the beginning, rad/s.
    pub(super) fn frequency(&self, setting: SchemeSetting) -> Option<f64> {
        self.subject.start(setting).and_then(|mut motion| motion.frequency()).ok()?
    }
}
