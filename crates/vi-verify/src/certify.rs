//! Measures everything that a plan asks for, and judges it.

mod resolution;

use super::certificate::{Certificate, Criterion, Finding, TimeCurve, Verdict};
use super::convergence::{Horizon, StudiedQuantity};
use super::fit::power_law;
use super::horizons::{Horizons, clearest, saturated};
use super::judge::{
    EXPONENT_TOLERANCE, FORM_TOLERANCE, LEAST_TREND_STEPS, ORDER_TOLERANCE, judge_energy,
    judge_momentum, judge_order, judge_output, judge_residual, scientific, sub_steps,
};
use super::measure::{
    self, Conditioning, ConstraintResiduals, LongRun, conditioning, distance, long_run, reversal,
};
use super::output::outputs;
use super::round_off::round_off;
use super::subject::{Nature, SchemeSetting, SteppingMethod, Subject};
use super::symplectic::symplectic_defect;
use vi_constraints::SchemeKind;
use vi_core::linear::norm_inf;

/// Steps of any long run.
const LEAST_STEPS: u64 = 2048;

/// Why the symplectic form and the Newton matrix are not looked at.
const NOTHING_FREE: &str = "no degree of freedom is left: the constraints determine the motion";

/// What to measure on a subject.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasurementPlan {
    /// The methods with their orders.
    pub methods: Vec<(SteppingMethod, Vec<u32>)>,
    /// Of the convergence studies, at first.
    pub horizon: Horizon,
    /// Step of everything else, s.
    pub step: f64,
    /// Steps of the long runs by the first method; composed steps count by their sub-steps.
    pub long: u64,
    /// The same of all others.
    pub short: u64,
    /// Steps that the subject is meant for. Where work is done and a run fails beyond, it is
    /// measured up to there: the motion has become too fast for the step.
    pub meant: u64,
    /// The method and order that the subject is meant for: they have to run at its step, resolved
    /// or not.
    pub own: Option<(SteppingMethod, u32)>,
    /// Steps of reversals and comparisons.
    pub few: u64,
    /// What is measured; [`Criterion::ALL`] as a rule.
    pub criteria: Vec<Criterion>,
}

impl MeasurementPlan {
    fn asks(&self, criterion: Criterion) -> bool {
        self.criteria.contains(&criterion)
    }
}

/// Measures and judges; `progress` receives what is measured next and what fails.
pub fn certify(
    subject: &dyn Subject,
    system: &str,
    plan: &MeasurementPlan,
    progress: &mut dyn FnMut(&str),
) -> Certificate {
    let certificate = Certificate { system: system.to_owned(), ..Certificate::default() };
    let horizons = Horizons::new(subject, plan.horizon);
    let (not_resolved, nature) = (None, None);
    let mut certifier =
        Certifier { subject, plan, certificate, horizons, not_resolved, nature, progress };
    for (place, (method, orders)) in plan.methods.iter().enumerate() {
        let steps = if place == 0 { plan.long } else { plan.short };
        for &order in orders {
            certifier.of_order(*method, order, steps);
        }
        if plan.asks(Criterion::Conditioning) {
            (certifier.progress)(&format!("{}: condition numbers", method.name()));
            certifier.conditioned(*method);
        }
    }
    if plan.asks(Criterion::Agreement) {
        (certifier.progress)("agreement of the schemes");
        certifier.agreement();
    }
    certifier.certificate
}

struct Certifier<'a> {
    subject: &'a dyn Subject,
    plan: &'a MeasurementPlan,
    certificate: Certificate,
    horizons: Horizons<'a>,
    not_resolved: Option<Option<String>>, // found when first asked for
    nature: Option<Nature>,               // of the last long run
    progress: &'a mut dyn FnMut(&str),
}

impl Certifier<'_> {
    fn push(&mut self, finding: Finding) {
        if finding.verdict == Verdict::Fail {
            (self.progress)(&finding.to_string());
        }
        self.certificate.findings.push(finding);
    }

    fn setting(&self, method: SteppingMethod, order: u32) -> SchemeSetting {
        SchemeSetting::new(method, order, self.plan.step)
    }

    /// Whether a run by the method can be started.
    fn applies(&self, method: SteppingMethod, order: u32) -> bool {
        self.subject.start(self.setting(method, order)).is_ok()
    }

    /// The verdict of what could not be measured.
    fn unmeasured(&self, method: SteppingMethod, order: u32) -> Verdict {
        match self.applies(method, order) {
            true => Verdict::Inconclusive,
            false => Verdict::NotApplicable,
        }
    }

    /// Everything about a method at an order.
    fn of_order(&mut self, method: SteppingMethod, order: u32, steps: u64) {
        let plan = self.plan;
        if plan.asks(Criterion::Order) {
            (self.progress)(&format!("{}, order {order}: convergence", method.name()));
            self.orders(method, order);
        }
        let along = [Criterion::Energy, Criterion::Momentum, Criterion::Residual];
        if along.into_iter().any(|criterion| plan.asks(criterion)) {
            (self.progress)(&format!("{}, order {order}: long run", method.name()));
            self.conserved(method, order, steps);
        }
        if plan.asks(Criterion::Output) {
            self.reported(method, order);
        }
        if plan.asks(Criterion::Reversal) {
            self.reversed(method, order);
        }
        if plan.asks(Criterion::Symplecticity) {
            self.symplectic(method, order);
        }
    }

    /// The orders of all quantities.
    fn orders(&mut self, method: SteppingMethod, order: u32) {
        let mut found = match self.horizons.studies(method, order) {
            Ok(found) => found,
            Err(error) => {
                let mut refused = Finding::new(Criterion::Order, method, order, "q, p, λ");
                refused.expected = order.to_string();
                refused.measured = "not measured".into();
                refused.verdict = self.unmeasured(method, order);
                refused.reason = error;
                return self.push(refused);
            }
        };
        for quantity in StudiedQuantity::ALL {
            let Some((study, curve)) = clearest(&found, quantity) else { continue };
            let mut finding = judge_order(method, order, curve, study);
            if let Some(error) = saturated(&found, quantity).filter(|_| finding.value.is_none()) {
                finding.measured = format!("does not converge (error {error:.0e})");
                finding.reason =
                    "the error is as large as the quantity at a step at which the motion has its order"
                        .into();
                finding.verdict = Verdict::Fail;
                self.push(finding);
            } else {
                self.push_of_small_steps(finding);
            }
        }
        // one study for the plots: the one in which q could be read
        let q = found.iter().position(|s| s.curves[0].observed.is_ok()).unwrap_or(0);
        self.certificate.studies.push(found.swap_remove(q));
    }

    /// Energy, momentum maps and residuals along a run.
    fn conserved(&mut self, method: SteppingMethod, order: u32, steps: u64) {
        let most = steps;
        let steps = (most / sub_steps(method, order)).max(LEAST_STEPS.min(most));
        let setting = self.setting(method, order);
        let applies = self.applies(method, order);
        let plan = self.plan;
        let long_enough = |run: LongRun| -> Result<LongRun, String> {
            let short = run.steps < LEAST_TREND_STEPS && most >= LEAST_TREND_STEPS;
            let energy = short && self.plan.asks(Criterion::Energy);
            match energy && judge_energy(method, order, &run).verdict == Verdict::Inconclusive {
                true => long_run(self.subject, setting, LEAST_TREND_STEPS),
                false => Ok(run),
            }
        };
        let within = |error| {
            let meant = long_run(self.subject, setting, plan.meant.min(steps));
            meant.ok().filter(|run| !run.nature.conservative).ok_or(error)
        };
        let run = match long_run(self.subject, setting, steps).and_then(long_enough).or_else(within)
        {
            Ok(run) => run,
            Err(error) => {
                let mut failed = Finding::new(Criterion::Energy, method, order, "run");
                failed.verdict = if applies { Verdict::Fail } else { Verdict::NotApplicable };
                failed.expected = format!("{} steps of {} s", steps.min(plan.meant), setting.step);
                failed.measured = "the run failed".into();
                failed.reason = error;
                if plan.own != Some((method, order))
                    && let Some(resolution) = self.unresolved(setting)
                {
                    failed.verdict = Verdict::NotApplicable;
                    failed.reason +=
                        &format!(", and h ω_max = {resolution:.1} with the longest sub-step");
                }
                return self.push(failed);
            }
        };
        if self.certificate.histories.is_empty() {
            self.certificate.histories = histories(&run);
        }
        self.nature = Some(run.nature);
        if self.plan.asks(Criterion::Energy) {
            let energy = judge_energy(method, order, &run);
            let energy = match energy.verdict {
                Verdict::Fail => self.at_half_the_step(energy, (method, order), run.steps),
                _ => energy,
            };
            self.push(energy);
        }
        if self.plan.asks(Criterion::Momentum) {
            let names = ["Px", "Py", "Pz", "Lx", "Ly", "Lz"];
            let is_conserved = |k: &usize| run.nature.symmetries[*k];
            for k in (0..names.len()).filter(is_conserved) {
                let drift = judge_momentum(method, order, names[k], &run, &run.momentum(k));
                self.push(drift);
            }
        }
        if self.plan.asks(Criterion::Residual) {
            self.residuals(method, order, &run);
        }
    }

    /// An energy that fails, measured again over the same time at half the step. A drift stays the
    /// same part of the band; what a short fast motion makes of the shadow energy of a variational
    /// scheme is exponentially small in the step, and vanishes.
    fn at_half_the_step(&self, failed: Finding, of: (SteppingMethod, u32), steps: u64) -> Finding {
        let (method, order) = of;
        let step = self.plan.step / 2.0;
        let setting = SchemeSetting { step, ..self.setting(method, order) };
        let Ok(run) = long_run(self.subject, setting, 2 * steps) else { return failed };
        let mut found = judge_energy(method, order, &run);
        if found.verdict != Verdict::Pass {
            return failed;
        }
        found.measured += &format!(" at h = {step}");
        found.reason = format!("at h = {} {}: {}", self.plan.step, failed.measured, failed.reason);
        found
    }

    /// Constraints at positions and momenta. Those at velocities (45) follow from
    /// `g(q_n) = g(q_{n+1}) = 0`.
    fn residuals(&mut self, method: SteppingMethod, order: u32, run: &LongRun) {
        self.push(judge_residual(method, order, run));
        if run.residuals().momentum.is_some() {
            let short = self.short_runs(method, order);
            self.hidden(method, order, &short, run.size());
        }
    }

    /// Largest residuals of short runs at `h`, `h/2`, … `h/16`; empty where one failed.
    fn short_runs(&self, method: SteppingMethod, order: u32) -> Vec<(f64, ConstraintResiduals)> {
        let residuals = |k: u32| -> Result<_, String> {
            let step = self.plan.step / f64::from(1 << k);
            let setting = SchemeSetting { step, ..self.setting(method, order) };
            Ok((step, long_run(self.subject, setting, 32 << k)?.residuals()))
        };
        (0..5).map(residuals).collect::<Result<_, String>>().unwrap_or_default()
    }

    /// The order of the hidden constraint at momenta, where `p_n` is defined.
    fn hidden(
        &mut self,
        method: SteppingMethod,
        order: u32,
        short: &[(f64, ConstraintResiduals)],
        size: f64,
    ) {
        let errors: Option<Vec<[f64; 2]>> =
            short.iter().map(|(h, r)| Some([*h, r.momentum?])).collect();
        let Some(errors) = errors.filter(|errors| !errors.is_empty()) else { return };
        let mut found =
            Finding::new(Criterion::Residual, method, order, "hidden constraint at momenta (46)");
        // momenta of configurations have the rounding of these over the step
        let rounding = |h: f64| 64.0 * f64::EPSILON * size / h;
        let largest = norm_inf(&errors.iter().map(|e| e[1]).collect::<Vec<f64>>());
        if errors.iter().all(|[h, error]| *error < rounding(*h).max(1e-11)) {
            found.expected = "order 2 in h, or round-off".into();
            found.measured = scientific(largest, 1);
            found.value = Some(largest);
            found.verdict = Verdict::Pass;
            return self.push(found);
        }
        found.expected = "order 2 in h".into();
        let order_of = |errors: &[[f64; 2]]| {
            power_law(errors.iter().copied()).map_or(f64::NAN, |law| law.exponent)
        };
        let slope = order_of(&errors);
        found.measured = format!("order {slope:.2}, {:.1e} at h = {}", errors[0][1], errors[0][0]);
        found.value = Some(slope);
        let holds = |slope: f64| slope >= 2.0 - 2.0 * ORDER_TOLERANCE;
        let most: Option<Vec<[f64; 2]>> =
            short.iter().map(|(h, r)| Some([*h, r.momentum_of_most?])).collect();
        let of_most = most.map_or(f64::NAN, |errors| order_of(&errors));
        found.verdict = if holds(slope) { Verdict::Pass } else { Verdict::Fail };
        if !holds(slope) && holds(of_most) && self.not_resolved().is_none() {
            found.verdict = Verdict::Inconclusive;
            found.reason = format!(
                "at nine of ten nodes order {of_most:.2}; the largest stand at single nodes: does a force jump there?"
            );
        }
        self.push_of_small_steps(found);
    }

    /// What is reported at the nodes, at steps that resolve the fastest motion.
    fn reported(&mut self, method: SteppingMethod, order: u32) {
        let mut setting = self.setting(method, order);
        if let Some(frequency) = self.frequency(setting) {
            setting.step = setting.step.min(0.25 / frequency.max(f64::MIN_POSITIVE));
        }
        match outputs(self.subject, setting) {
            Ok(compared) => compared.iter().for_each(|c| self.push(judge_output(method, order, c))),
            Err(error) => {
                let mut refused = Finding::new(Criterion::Output, method, order, "all");
                refused.verdict = self.unmeasured(method, order);
                refused.reason = error;
                self.push(refused);
            }
        }
    }

    fn reversed(&mut self, method: SteppingMethod, order: u32) {
        let mut found =
            Finding::new(Criterion::Reversal, method, order, "q after N steps and back");
        if self.nature().is_some_and(|nature| nature.dissipative) {
            found.verdict = Verdict::NotApplicable;
            found.reason = "not reversible: a force dissipates, or signals are sampled".into();
            self.push(found);
            return;
        }
        match reversal(self.subject, self.setting(method, order), self.plan.few) {
            Err(error) => {
                found.verdict = self.unmeasured(method, order);
                found.reason = error; // the long run fails, too
            }
            Ok(result) => {
                let growth = result.amplification.unwrap_or(10.0).max(10.0);
                let limit = round_off(self.plan.few, growth * growth);
                found.expected = format!("≤ {limit:.0e}");
                found.measured = format!("{:.1e} (N = {})", result.error, result.steps);
                found.value = Some(result.error);
                found.verdict = if result.error <= limit { Verdict::Pass } else { Verdict::Fail };
            }
        }
        self.push(found);
    }

    /// What holds of the system: along the last long run, or initially.
    fn nature(&self) -> Option<Nature> {
        self.nature.or_else(|| {
            let setting = self.setting(self.plan.methods[0].0, 2);
            self.subject.start(setting).and_then(|mut motion| motion.nature()).ok()
        })
    }

    fn symplectic(&mut self, method: SteppingMethod, order: u32) {
        let mut found = Finding::new(Criterion::Symplecticity, method, order, "change of Ω");
        if self.nature().is_some_and(|nature| nature.nonholonomic) {
            found.verdict = Verdict::NotApplicable;
            found.reason = "constraints on velocities: no symplectic form is conserved".into();
            return self.push(found);
        }
        if self.nature().is_some_and(|nature| nature.forced || nature.dissipative) {
            found.verdict = Verdict::NotApplicable;
            found.reason =
                "a force without a potential acts: no symplectic form is conserved".into();
            return self.push(found);
        }
        if !method.is_variational() {
            found.verdict = Verdict::NotApplicable;
            found.reason = "energy–momentum schemes do not conserve it".into();
            return self.push(found);
        }
        found.expected = format!("≤ {FORM_TOLERANCE:.0e}");
        match symplectic_defect(self.subject, self.setting(method, order), 4) {
            Err(error) => {
                found.verdict = self.unmeasured(method, order);
                found.reason = error;
            }
            Ok(None) => {
                found.verdict = Verdict::NotApplicable;
                found.reason = NOTHING_FREE.into();
            }
            Ok(Some(defect)) => {
                found.measured = scientific(defect, 1);
                found.value = Some(defect);
                found.verdict =
                    if defect <= FORM_TOLERANCE { Verdict::Pass } else { Verdict::Fail };
            }
        }
        self.push(found);
    }

    fn conditioned(&mut self, method: SteppingMethod) {
        let mut found =
            Finding::new(Criterion::Conditioning, method, 2, "κ ~ h^a, as written; as factorized");
        let Some(written) = exponent_as_written(method) else { return };
        let start = self.subject.start(self.setting(method, 2));
        if start.is_ok_and(|mut motion| motion.tangents().dq.ncols() == 0) {
            found.verdict = Verdict::NotApplicable;
            found.reason = NOTHING_FREE.into();
            return self.push(found);
        }
        found.expected = format!("a = {written}; 0");
        match conditioning(self.subject, self.setting(method, 2)) {
            Err(error) => found.reason = error,
            Ok(numbers) => {
                found.measured = format!("{:.2}; {:.2}", numbers.as_written, numbers.scaled);
                found.value = Some(numbers.as_written);
                let holds = conditioned_as_expected(method, &numbers);
                found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
                self.certificate.conditioning.push((method, numbers));
            }
        }
        self.push_of_small_steps(found);
    }

    /// Every variational scheme against the first.
    fn agreement(&mut self) {
        let variational: Vec<SteppingMethod> = self
            .plan
            .methods
            .iter()
            .map(|(method, _)| *method)
            .filter(|m| matches!(m, SteppingMethod::Variational(_)))
            .collect();
        let Some((first, others)) = variational.split_first() else { return };
        let growth = measure::amplification(self.subject, self.setting(*first, 2), self.plan.few);
        let growth = growth.unwrap_or(10.0).max(10.0);
        for other in others {
            let mut found = Finding::new(Criterion::Agreement, *other, 2, "distance in q");
            found.reason = format!("against {}", first.name());
            let settings = [*first, *other].map(|method| self.setting(method, 2));
            // schemes that solve for Δq resolve it to ε|q|, momenta to ε|q|/h
            let limit = 10.0 * round_off(self.plan.few, growth);
            found.expected = format!("≤ {limit:.0e}");
            match distance(self.subject, settings, self.plan.few) {
                Err(error) => found.reason = error,
                Ok(off) => {
                    found.measured = scientific(off, 1);
                    found.value = Some(off);
                    found.verdict = if off <= limit { Verdict::Pass } else { Verdict::Fail };
                }
            }
            self.push(found);
        }
    }
}

/// `a` of `κ ~ h^a` of the Newton matrix as it is written; `None` where none is known.
fn exponent_as_written(method: SteppingMethod) -> Option<f64> {
    match method {
        SteppingMethod::Variational(SchemeKind::Constrained) => Some(-3.0),
        SteppingMethod::Variational(SchemeKind::Dalembert) => Some(-1.0),
        SteppingMethod::Variational(_) => Some(0.0),
        SteppingMethod::Galerkin(_) | SteppingMethod::EnergyMomentum(_) => None,
    }
}

fn conditioned_as_expected(method: SteppingMethod, numbers: &Conditioning) -> bool {
    let off = [numbers.as_written - exponent_as_written(method).unwrap_or(0.0), numbers.scaled];
    off.iter().all(|off| off.abs() <= EXPONENT_TOLERANCE)
}

/// Errors of the energy and of its shadow, and momentum drifts over time, thinned out.
fn histories(run: &LongRun) -> Vec<TimeCurve> {
    let thin = (run.samples.len() / 1024).max(1);
    let history = |name: &str, values: Vec<f64>| {
        let start = values.first().copied().unwrap_or(0.0);
        let points = run.times.iter().zip(values).step_by(thin);
        TimeCurve { name: name.into(), points: points.map(|(t, v)| (*t, v - start)).collect() }
    };
    let mut histories = vec![history("energy", run.energies())];
    if run.nature.conservative {
        histories.push(history("shadow energy", run.shadow_energies()));
    }
    let names = ["Px", "Py", "Pz", "Lx", "Ly", "Lz"];
    for (k, name) in names.into_iter().enumerate().filter(|(k, _)| run.nature.symmetries[*k]) {
        histories.push(history(name, run.momentum(k)));
    }
    histories
}
