//! Measures everything that a plan asks for, and judges it.

use super::certificate::{Certificate, Criterion, Finding, History, Verdict};
use super::convergence::{Horizon, Quantity};
use super::fit::power_law;
use super::horizons::{Horizons, clearest};
use super::judge::{
    EXPONENT_TOLERANCE, FORM_TOLERANCE, ORDER_TOLERANCE, finding, judge_energy, judge_momentum,
    judge_order, judge_residuals, not_quadratic, round_off, sub_steps,
};
use super::measure::{
    self, Conditioning, LongRun, conditioning, distance, long_run, reversal, symplectic_defect,
};
use super::subject::{Method, Setting, Subject};
use vi_constraints::SchemeKind;

/// Steps of any long run.
const LEAST_STEPS: u64 = 2048;

/// What to measure on a subject.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The methods with their orders.
    pub methods: Vec<(Method, Vec<u32>)>,
    /// Of the convergence studies, at first.
    pub horizon: Horizon,
    /// Step of everything else, s.
    pub step: f64,
    /// Steps of the long runs by the first method; composed steps count by their sub-steps.
    pub long: u64,
    /// The same of all others.
    pub short: u64,
    /// Steps of reversals and comparisons.
    pub few: u64,
}

/// Measures and judges; `progress` is told what comes next and what fails.
pub fn certify(
    subject: &dyn Subject,
    system: &str,
    plan: &Plan,
    progress: &mut dyn FnMut(&str),
) -> Certificate {
    let certificate = Certificate { system: system.to_owned(), ..Certificate::default() };
    let (horizons, resolved_from) = (Horizons::new(subject, plan.horizon), None);
    let mut certifier = Certifier { subject, plan, certificate, horizons, resolved_from, progress };
    for (place, (method, orders)) in plan.methods.iter().enumerate() {
        let steps = if place == 0 { plan.long } else { plan.short };
        for &order in orders {
            (certifier.progress)(&format!("{}, order {order}: convergence", method.name()));
            certifier.orders(*method, order);
            (certifier.progress)(&format!("{}, order {order}: long run", method.name()));
            certifier.kept(*method, order, steps);
            certifier.reversed(*method, order);
            certifier.symplectic(*method, order);
        }
        (certifier.progress)(&format!("{}: condition numbers", method.name()));
        certifier.conditioned(*method);
    }
    (certifier.progress)("agreement of the schemes");
    certifier.agreement();
    certifier.certificate
}

struct Certifier<'a> {
    subject: &'a dyn Subject,
    plan: &'a Plan,
    certificate: Certificate,
    horizons: Horizons<'a>,
    resolved_from: Option<Option<f64>>, // found when first asked for
    progress: &'a mut dyn FnMut(&str),
}

impl Certifier<'_> {
    fn push(&mut self, finding: Finding) {
        if finding.verdict == Verdict::Fail {
            (self.progress)(&finding.to_string());
        }
        self.certificate.findings.push(finding);
    }

    fn setting(&self, method: Method, order: u32) -> Setting {
        Setting::new(method, order, self.plan.step)
    }

    /// The orders of all quantities.
    fn orders(&mut self, method: Method, order: u32) {
        let mut found = match self.horizons.studies(method, order) {
            Ok(found) => found,
            Err(error) => {
                let mut refused = finding(Criterion::Order, method, order, "q, p, λ");
                refused.expected = order.to_string();
                refused.measured = "not measured".into();
                refused.reason = error;
                return self.push(refused);
            }
        };
        for quantity in Quantity::ALL {
            if let Some((study, curve)) = clearest(&found, quantity) {
                let finding = judge_order(method, order, curve, study);
                self.push_of_small_steps(finding);
            }
        }
        // one study for the plots: the one in which q could be read
        let q = found.iter().position(|s| s.curves[0].observed.is_ok()).unwrap_or(0);
        self.certificate.studies.push(found.swap_remove(q));
    }

    /// Energy, momentum maps and residuals along a run.
    fn kept(&mut self, method: Method, order: u32, steps: u64) {
        let steps = (steps / sub_steps(order)).max(LEAST_STEPS.min(steps));
        let setting = self.setting(method, order);
        let applies = self.subject.start(setting).is_ok();
        let run = match long_run(self.subject, setting, steps) {
            Ok(run) => run,
            Err(error) => {
                let mut failed = finding(Criterion::Energy, method, order, "run");
                failed.verdict = if applies { Verdict::Fail } else { Verdict::Open };
                failed.expected = format!("{steps} steps of {} s", setting.step);
                failed.measured = "the run failed".into();
                failed.reason = error;
                return self.push(failed);
            }
        };
        if self.certificate.histories.is_empty() {
            self.certificate.histories = histories(&run);
        }
        let energy = judge_energy(method, order, &run);
        self.push(energy);
        let names = ["Px", "Py", "Pz", "Lx", "Ly", "Lz"];
        for (k, name) in names.into_iter().enumerate().filter(|(k, _)| run.nature.symmetries[*k]) {
            let drift = judge_momentum((method, order), name, &run, &run.momentum(k));
            self.push(drift);
        }
        let [position, mut velocity] = judge_residuals((method, order), setting.step, &run);
        self.push(position);
        let short = self.short_runs(method, order);
        if velocity.verdict == Verdict::Fail {
            not_quadratic(&mut velocity, &short);
        }
        self.push(velocity);
        self.hidden(method, order, &short);
    }

    /// Largest residuals of short runs at `h`, `h/2`, … `h/16`; empty where one failed.
    fn short_runs(&self, method: Method, order: u32) -> Vec<(f64, [f64; 3])> {
        let residuals = |k: u32| -> Result<_, String> {
            let step = self.plan.step / f64::from(1 << k);
            let setting = Setting { step, ..self.setting(method, order) };
            Ok((step, long_run(self.subject, setting, 32 << k)?.residuals()))
        };
        (0..5).map(residuals).collect::<Result<_, String>>().unwrap_or_default()
    }

    /// The order of the hidden constraint at momenta.
    fn hidden(&mut self, method: Method, order: u32, short: &[(f64, [f64; 3])]) {
        let errors: Vec<(f64, f64)> = short.iter().map(|(h, r)| (*h, r[2])).collect();
        if errors.is_empty() {
            return;
        }
        let mut found =
            finding(Criterion::Residual, method, order, "hidden constraint at momenta (46)");
        let largest = errors.iter().map(|e| e.1).fold(0.0, f64::max);
        if order > 2 || largest < 1e-11 {
            found.expected = "round-off".into();
            found.measured = format!("{largest:.1e}");
            found.value = Some(largest);
            found.verdict = if largest < 1e-9 { Verdict::Pass } else { Verdict::Fail };
            if order > 2 {
                found.reason = "of the projected momentum".into();
            }
        } else {
            found.expected = "order 2 in h".into();
            let law = power_law(errors.iter().copied());
            let slope = law.map_or(f64::NAN, |law| law.exponent);
            found.measured =
                format!("order {slope:.2}, {:.1e} at h = {}", errors[0].1, errors[0].0);
            found.value = Some(slope);
            found.verdict =
                if slope >= 2.0 - 2.0 * ORDER_TOLERANCE { Verdict::Pass } else { Verdict::Fail };
        }
        self.push_of_small_steps(found);
    }

    fn reversed(&mut self, method: Method, order: u32) {
        let mut found = finding(Criterion::Reversal, method, order, "q after N steps and back");
        if self.dissipative() {
            found.reason = "dampers forget: not promised".into(); // back in time they feed energy in
            self.push(found);
            return;
        }
        match reversal(self.subject, self.setting(method, order), self.plan.few) {
            Err(error) => found.reason = error, // told by the long run
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

    fn dissipative(&self) -> bool {
        let setting = self.setting(self.plan.methods[0].0, 2);
        let nature = self.subject.start(setting).and_then(|mut motion| motion.nature());
        nature.is_ok_and(|nature| nature.dissipative)
    }

    fn symplectic(&mut self, method: Method, order: u32) {
        let mut found = finding(Criterion::Symplecticity, method, order, "change of Ω");
        let variational = matches!(method, Method::Variational(_));
        found.expected =
            if variational { format!("≤ {FORM_TOLERANCE:.0e}") } else { "not kept".into() };
        match symplectic_defect(self.subject, self.setting(method, order), 4) {
            Err(error) => found.reason = error,
            Ok(defect) => {
                found.measured = format!("{defect:.1e}");
                found.value = Some(defect);
                found.verdict = match (variational, defect <= FORM_TOLERANCE) {
                    (true, true) | (false, false) => Verdict::Pass,
                    (true, false) => Verdict::Fail,
                    (false, true) => {
                        found.reason = "no promise, but so it is on this motion".into();
                        Verdict::Open
                    }
                };
            }
        }
        self.push(found);
    }

    fn conditioned(&mut self, method: Method) {
        let mut found =
            finding(Criterion::Conditioning, method, 2, "κ ~ h^a, as written; as factorized");
        let Some(written) = exponent_as_written(method) else { return };
        found.expected = format!("a = {written}; 0");
        match conditioning(self.subject, self.setting(method, 2)) {
            Err(error) => found.reason = error,
            Ok(numbers) => {
                found.measured = format!("{:.2}; {:.2}", numbers.as_written, numbers.scaled);
                found.value = Some(numbers.as_written);
                let holds = conditioned_as_promised(method, &numbers);
                found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
                self.certificate.conditioning.push((method, numbers));
            }
        }
        self.push_of_small_steps(found);
    }

    /// A finding that speaks of small steps: it is left open where the step of the plan is none.
    fn push_of_small_steps(&mut self, mut finding: Finding) {
        if finding.verdict == Verdict::Fail
            && let Some(step) = self.resolved_from()
        {
            finding.verdict = Verdict::Open;
            finding.reason = format!(
                "the fastest motion is not resolved at h = {} s: condition numbers settle from \
                 h = {step:.0e} s on",
                self.plan.step
            );
        }
        self.push(finding);
    }

    /// The step from which on the condition numbers of the first method no longer change, where the step
    /// of the plan is too large for that: a stiff spring or damper is not resolved.
    fn resolved_from(&mut self) -> Option<f64> {
        if let Some(known) = self.resolved_from {
            return known;
        }
        let method = self.plan.methods[0].0;
        let holds = |step: f64| {
            let setting = Setting { step, ..self.setting(method, 2) };
            let numbers = conditioning(self.subject, setting);
            numbers.map(|numbers| conditioned_as_promised(method, &numbers))
        };
        let finer = (1..=4).map(|k| self.plan.step / 8_f64.powi(k));
        let found = match holds(self.plan.step) {
            Ok(false) => finer.into_iter().find(|step| holds(*step).is_ok_and(|holds| holds)),
            _ => None,
        };
        self.resolved_from = Some(found);
        found
    }

    /// Every variational scheme against the first.
    fn agreement(&mut self) {
        let variational: Vec<Method> = self
            .plan
            .methods
            .iter()
            .map(|(method, _)| *method)
            .filter(|m| matches!(m, Method::Variational(_)))
            .collect();
        let Some((first, others)) = variational.split_first() else { return };
        let growth = measure::amplification(self.subject, self.setting(*first, 2), self.plan.few);
        let growth = growth.unwrap_or(10.0).max(10.0);
        for other in others {
            let mut found = finding(Criterion::Agreement, *other, 2, "distance in q");
            found.reason = format!("against {}", first.name());
            let settings = [*first, *other].map(|method| self.setting(method, 2));
            // schemes that solve for Δq resolve it to ε|q|, momenta to ε|q|/h
            let limit = 10.0 * round_off(self.plan.few, growth);
            found.expected = format!("≤ {limit:.0e}");
            match distance(self.subject, settings, self.plan.few) {
                Err(error) => found.reason = error,
                Ok(off) => {
                    found.measured = format!("{off:.1e}");
                    found.value = Some(off);
                    found.verdict = if off <= limit { Verdict::Pass } else { Verdict::Fail };
                }
            }
            self.push(found);
        }
    }
}

/// `a` of `κ ~ h^a` of the Newton matrix as it is written; `None` without a promise.
fn exponent_as_written(method: Method) -> Option<f64> {
    match method {
        Method::Variational(SchemeKind::Constrained) => Some(-3.0),
        Method::Variational(SchemeKind::Dalembert) => Some(-1.0),
        Method::Variational(_) => Some(0.0),
        Method::EnergyMomentum(_) => None,
    }
}

fn conditioned_as_promised(method: Method, numbers: &Conditioning) -> bool {
    let off = [numbers.as_written - exponent_as_written(method).unwrap_or(0.0), numbers.scaled];
    off.iter().all(|off| off.abs() <= EXPONENT_TOLERANCE)
}

/// Errors of the energy and of its shadow, and momentum drifts over time, thinned out.
fn histories(run: &LongRun) -> Vec<History> {
    let thin = (run.samples.len() / 1024).max(1);
    let history = |name: &str, values: Vec<f64>| {
        let start = values.first().copied().unwrap_or(0.0);
        let points = run.times.iter().zip(values).step_by(thin);
        History { name: name.into(), points: points.map(|(t, v)| (*t, v - start)).collect() }
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
