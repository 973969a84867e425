//! Measures everything that a plan asks for, and judges it.

use super::certificate::{Certificate, Criterion, Finding, History, Study, Verdict};
use super::convergence::{Convergence, Horizon, Quantity, Reference, study};
use super::fit::power_law;
use super::growth::{Growth, NoGrowth, growth};
use super::measure::{
    self, LongRun, conditioning, distance, long_run, reversal, symplectic_defect,
};
use super::order::{HALVINGS, NoOrder, ObservedOrder, Scale, observed_order_over};
use super::subject::{Method, Setting, Subject};
use super::trend::trend;
use vi_constraints::SchemeKind;
use vi_core::Composition;

/// Observed orders may miss their nominal value by this.
pub const ORDER_TOLERANCE: f64 = 0.2;
/// The same at order 8, of which double precision shows three or four halvings, the first of them not
/// quite asymptotic.
pub const ORDER_8_TOLERANCE: f64 = 0.3;
/// The symplectic form may change by this, relative to its terms.
pub const FORM_TOLERANCE: f64 = 1e-10;
/// Exponents of condition numbers may be off by this.
pub const EXPONENT_TOLERANCE: f64 = 0.2;
/// Steps of any long run.
const LEAST_STEPS: u64 = 2048;
/// Steps below which a trend of the energy or the exponent of a drift cannot be told from the wandering
/// of the motion.
const TELLING_STEPS: u64 = 8000;
/// Steps from which on a trend is one.
const LONG_STEPS: u64 = 100_000;
/// Horizons are doubled this often where errors reach round-off too early.
const EXTENSIONS: usize = 3;

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

/// Measures and judges; `progress` is told what comes next.
pub fn certify(
    subject: &dyn Subject,
    system: &str,
    plan: &Plan,
    progress: &mut dyn FnMut(&str),
) -> Certificate {
    let certificate = Certificate { system: system.to_owned(), ..Certificate::default() };
    let mut certifier = Certifier { subject, plan, certificate, references: Vec::new() };
    for (place, (method, orders)) in plan.methods.iter().enumerate() {
        let steps = if place == 0 { plan.long } else { plan.short };
        for &order in orders {
            progress(&format!("{}, order {order}: convergence", method.name()));
            certifier.orders(*method, order);
            progress(&format!("{}, order {order}: long run", method.name()));
            certifier.kept(*method, order, steps);
            certifier.reversed(*method, order);
            certifier.symplectic(*method, order);
        }
        progress(&format!("{}: condition numbers", method.name()));
        certifier.conditioned(*method);
    }
    progress("agreement of the schemes");
    certifier.agreement();
    certifier.certificate
}

struct Certifier<'a> {
    subject: &'a dyn Subject,
    plan: &'a Plan,
    certificate: Certificate,
    references: Vec<Result<Reference, String>>, // for the horizon and its doublings
}

fn finding(criterion: Criterion, method: Method, order: u32, quantity: &str) -> Finding {
    Finding {
        criterion,
        method: Some(method),
        order,
        quantity: quantity.to_owned(),
        expected: String::new(),
        measured: String::new(),
        value: None,
        verdict: Verdict::Open,
        reason: String::new(),
    }
}

impl Certifier<'_> {
    fn push(&mut self, finding: Finding) {
        self.certificate.findings.push(finding);
    }

    fn setting(&self, method: Method, order: u32) -> Setting {
        Setting::new(method, order, self.plan.step)
    }

    /// The horizon doubled `extension` times, with its reference.
    fn reference(&mut self, extension: usize) -> (Horizon, &Result<Reference, String>) {
        let Horizon { end, coarsest, finest } = self.plan.horizon;
        let horizon = |k: usize| Horizon { end: end * (1_u32 << k) as f64, coarsest, finest };
        while self.references.len() <= extension {
            let next = Reference::find(self.subject, horizon(self.references.len()));
            self.references.push(next);
        }
        (horizon(extension), &self.references[extension])
    }

    /// Convergence; the horizon grows where round-off comes too early to read an order.
    fn orders(&mut self, method: Method, order: u32) {
        let mut found: Vec<Study> = Vec::new();
        for extension in 0..=EXTENSIONS {
            let subject = self.subject;
            let (horizon, reference) = self.reference(extension);
            let studied = match reference {
                Ok(reference) => study(subject, (method, order), horizon, reference)
                    .map(|curves| (curves, reference.origin.clone())),
                Err(error) => Err(error.clone()),
            };
            match studied {
                Err(error) if extension == 0 => {
                    let mut refused = finding(Criterion::Order, method, order, "q, p, λ");
                    refused.expected = order.to_string();
                    refused.measured = "not measured".into();
                    refused.reason = error;
                    return self.push(refused);
                }
                Err(_) => break,
                Ok((curves, reference)) => {
                    let end = horizon.end;
                    found.push(Study { method, order, end, reference, curves });
                }
            }
            let hopeless = |refused: &NoOrder| {
                matches!(
                    refused,
                    NoOrder::Saturated { .. }
                        | NoOrder::NoConvergence { .. }
                        | NoOrder::NotNumbers
                        | NoOrder::Uncertain { .. }
                )
            };
            let short = |c: &Convergence| c.observed.as_ref().is_err_and(|e| !hopeless(e));
            let last = found.last().expect("just pushed");
            if !last.curves.iter().any(|c| short(c) && !read(&found, c.quantity)) {
                break;
            }
        }
        if order == 8 {
            found.iter_mut().flat_map(|study| &mut study.curves).for_each(fewer_halvings);
        }
        for quantity in Quantity::ALL {
            // over four halvings where that is possible, and the straightest; else the first horizon
            let of = |s: &Study| s.curves.iter().position(|c| c.quantity == quantity);
            let rank = |s: &&Study| {
                let curve = &s.curves[of(s)?];
                let ObservedOrder { spread, points, .. } = curve.observed.as_ref().ok()?;
                let (coarse, fine) = (curve.errors[points.start], curve.errors[points.end - 1]);
                let short = (coarse.step / fine.step).log2() < f64::from(HALVINGS) - 0.1;
                Some((short, *spread))
            };
            let readable = found.iter().filter_map(|s| Some((rank(&s)?, s)));
            let best = readable.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            let Some(study) = best.map(|(_, study)| study).or(found.first()) else { continue };
            if let Some(k) = of(study) {
                let finding = judge_order(method, order, &study.curves[k], study);
                self.push(finding);
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
        self.push(found);
    }

    fn reversed(&mut self, method: Method, order: u32) {
        let mut found = finding(Criterion::Reversal, method, order, "q after N steps and back");
        match reversal(self.subject, self.setting(method, order), self.plan.few) {
            Err(error) => found.reason = error, // told by the long run
            Ok(result) => {
                let growth = result.amplification.unwrap_or(10.0).max(10.0);
                let limit = round_off(self.plan.few, growth * growth);
                found.expected = format!("≤ {limit:.0e}");
                found.measured = format!("{:.1e} (N = {})", result.error, result.steps);
                found.value = Some(result.error);
                found.verdict = if result.error <= limit { Verdict::Pass } else { Verdict::Fail };
                let dissipative = self.dissipative();
                if dissipative {
                    found.verdict = Verdict::Open;
                    found.reason = "dampers forget: not promised".into();
                }
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
        let written = match method {
            Method::Variational(SchemeKind::Constrained) => -3.0,
            Method::Variational(SchemeKind::Dalembert) => -1.0,
            Method::Variational(_) => 0.0,
            Method::EnergyMomentum(_) => return, // no promise
        };
        found.expected = format!("a = {written}; 0");
        match conditioning(self.subject, self.setting(method, 2)) {
            Err(error) => found.reason = error,
            Ok(numbers) => {
                found.measured = format!("{:.2}; {:.2}", numbers.as_written, numbers.scaled);
                found.value = Some(numbers.as_written);
                let off = [numbers.as_written - written, numbers.scaled].map(f64::abs);
                let holds = off.iter().all(|off| *off <= EXPONENT_TOLERANCE);
                found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
                self.certificate.conditioning.push((method, numbers));
            }
        }
        self.push(found);
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

/// Sub-steps of a step.
fn sub_steps(order: u32) -> u64 {
    Composition::of_order(order).map_or(1, |c| c.gammas().len() as u64)
}

/// Round-off of `steps` steps that the motion enlarges: `10 ε √N` times the growth.
fn round_off(steps: u64, growth: f64) -> f64 {
    10.0 * f64::EPSILON * (steps as f64).sqrt() * growth
}

fn read(studies: &[Study], quantity: Quantity) -> bool {
    let mut curves = studies.iter().flat_map(|s| &s.curves);
    curves.any(|c| c.quantity == quantity && c.observed.is_ok())
}

/// Order 8 leaves little between the coarse end and round-off: it is read over three halvings where
/// there are no four.
fn fewer_halvings(curve: &mut Convergence) {
    if curve.observed.is_err() {
        let scale = Scale { size: 1.0, floor: curve.floor };
        if let Ok(observed) = observed_order_over(&curve.errors, scale, 3) {
            curve.observed = Ok(observed);
        }
    }
}

/// The order of a quantity: nominal, except for multipliers that are known to be of first order.
fn judge_order(method: Method, order: u32, curve: &Convergence, study: &Study) -> Finding {
    let mut found = finding(Criterion::Order, method, order, curve.quantity.name(method));
    let variational = matches!(method, Method::Variational(_));
    let first_order = match curve.quantity {
        Quantity::StartMultiplier if variational => "a start is one-sided: (47) is of first order",
        Quantity::StartMultiplier => "there is no step before the start to take the mean with",
        Quantity::OtherMultiplier if !variational => {
            "the normal part of v_n alternates from step to step; the mean of two steps is of order 2"
        }
        _ => "",
    };
    let known = !first_order.is_empty();
    let nominal = if known { 1.0 } else { f64::from(order) };
    found.expected = if known { "1, not 2".into() } else { order.to_string() };
    match &curve.observed {
        Ok(ObservedOrder { order: p, points, .. }) => {
            let range = &curve.errors[points.clone()];
            let (coarse, fine) = (range[0].error, range[range.len() - 1].error);
            found.measured = format!("{p:.2} ({coarse:.0e} … {fine:.0e})");
            found.value = Some(*p);
            // first-order terms may vanish by symmetry of the start
            let holds = if known {
                *p >= 1.0 - 2.0 * ORDER_TOLERANCE
            } else {
                let tolerance = if order == 8 { ORDER_8_TOLERANCE } else { ORDER_TOLERANCE };
                (p - nominal).abs() <= tolerance
            };
            found.verdict = match (holds, known) {
                (true, false) => Verdict::Pass,
                (true, true) if *p < 2.0 - ORDER_TOLERANCE => Verdict::Known,
                (true, true) => Verdict::Pass,
                (false, _) => Verdict::Fail,
            };
            let halvings = (range[0].step / range[range.len() - 1].step).log2();
            found.reason = if known {
                first_order.into()
            } else {
                format!(
                    "over {halvings:.1} halvings against {}, to t = {} s",
                    study.reference, study.end
                )
            };
        }
        Err(NoOrder::Exact { largest }) => {
            found.measured = format!("exact ({largest:.0e})");
            found.verdict = Verdict::Pass;
        }
        Err(refused @ NoOrder::NoConvergence { .. }) => {
            found.measured = "does not converge".into();
            found.reason = refused.to_string();
            found.verdict = Verdict::Fail;
        }
        Err(refused) => {
            found.measured = "no order can be read".into();
            found.reason = refused.to_string();
        }
    }
    found
}

/// A residual at velocities that is no round-off is of second order where a constraint is not quadratic.
fn not_quadratic(found: &mut Finding, short: &[(f64, [f64; 3])]) {
    let law = power_law(short.iter().map(|(h, r)| (*h, r[1])));
    if let Some(law) = law.filter(|law| law.exponent >= 2.0 - 2.0 * ORDER_TOLERANCE) {
        found.verdict = Verdict::Known;
        found.measured = format!("{}, order {:.2}", found.measured, law.exponent);
        found.reason =
            "a constraint that is not quadratic in q (a thread, a coupling) meets (45) to \
                        second order"
                .into();
    }
}

fn judge_energy(method: Method, order: u32, run: &LongRun) -> Finding {
    let mut found = finding(Criterion::Energy, method, order, "H_d");
    let size = run.energy_size();
    if !run.nature.conservative {
        found.reason = "forces or prescribed motion do work: no promise".into();
        return found;
    }
    match trend(&run.energies()) {
        Err(refused) => found.reason = refused.to_string(),
        Ok(trend) => {
            let relative = if size > 0.0 { trend.width() / size } else { 0.0 };
            let kept = relative <= round_off(run.steps, 10.0);
            let variational = matches!(method, Method::Variational(_));
            found.expected = match variational {
                true => "bounded, no trend".into(),
                false => "kept to solver tolerance".into(),
            };
            found.measured = if kept {
                format!("kept to {relative:.0e}")
            } else {
                format!("± {:.0e}, trend {:.1} %", 0.5 * relative, 100.0 * trend.relative())
            };
            found.value = Some(trend.relative());
            let holds = kept || (variational && trend.is_bounded());
            found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
            if !kept && run.steps < TELLING_STEPS {
                found.verdict = Verdict::Open;
                found.reason = format!("fewer than {TELLING_STEPS} steps do not tell a trend");
            } else if !holds && variational && run.steps < LONG_STEPS {
                found.verdict = Verdict::Open;
                found.reason = format!(
                    "a trend of {:.0} % of the band over {} steps may be a slow motion",
                    100.0 * trend.relative(),
                    run.steps
                );
            } else if !holds {
                found.reason = format!(
                    "scatter of the trend {:.1e} J, band widens by {:.2}",
                    trend.scatter, trend.widening
                );
            }
        }
    }
    found
}

fn judge_momentum(
    (method, order): (Method, u32),
    name: &str,
    run: &LongRun,
    samples: &[f64],
) -> Finding {
    let mut found = finding(Criterion::Momentum, method, order, name);
    found.expected = "≤ N^0.6, at round-off".into();
    match growth(samples) {
        Err(NoGrowth::Exact) => {
            found.measured = NoGrowth::Exact.to_string();
            found.verdict = Verdict::Pass;
        }
        Err(refused) => found.reason = refused.to_string(),
        Ok(growth) => {
            let Growth { exponent, drift, .. } = growth;
            found.measured = format!("N^{exponent:.2}, {drift:.0e}");
            found.value = Some(exponent);
            let root = f64::EPSILON * ((run.steps * sub_steps(order)) as f64).sqrt();
            // below ε√N the exponent is that of single last bits, in few steps it scatters
            let walks = growth.is_unbiased() || run.steps < TELLING_STEPS;
            let holds = drift <= root || (walks && drift <= 1e3 * root);
            found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
            if !holds && drift <= 100.0 * root && solves_for_coordinates(method) {
                found.verdict = Verdict::Known;
                found.reason =
                    "the scheme resolves Δq to round-off of q, not of itself: a small bias \
                                stays"
                        .into();
            }
        }
    }
    found
}

/// Schemes whose unknowns are coordinates, not increments of a map.
fn solves_for_coordinates(method: Method) -> bool {
    matches!(
        method,
        Method::Variational(SchemeKind::Constrained | SchemeKind::Dalembert)
            | Method::EnergyMomentum(_)
    )
}

fn judge_residuals((method, order): (Method, u32), h: f64, run: &LongRun) -> [Finding; 2] {
    let [position, velocity, _] = run.residuals();
    let scale = 1.0 + run.size().powi(2);
    let limits = [1e-13 * scale, 2e-13 * scale / h.min(1.0)];
    let names = ["constraints g", "hidden constraint at velocities (45)"];
    let judge = |k: usize, value: f64| {
        let mut found = finding(Criterion::Residual, method, order, names[k]);
        found.expected = format!("≤ {:.0e}", limits[k]);
        found.measured = format!("{value:.0e}");
        found.value = Some(value);
        found.verdict = if value <= limits[k] { Verdict::Pass } else { Verdict::Fail };
        found
    };
    [judge(0, position), judge(1, velocity)]
}

/// Energy error and momentum drifts over time, thinned out.
fn histories(run: &LongRun) -> Vec<History> {
    let thin = (run.samples.len() / 1024).max(1);
    let history = |name: &str, values: Vec<f64>| {
        let start = values.first().copied().unwrap_or(0.0);
        let points = run.times.iter().zip(values).step_by(thin);
        History { name: name.into(), points: points.map(|(t, v)| (*t, v - start)).collect() }
    };
    let mut histories = vec![history("energy", run.energies())];
    let names = ["Px", "Py", "Pz", "Lx", "Ly", "Lz"];
    for (k, name) in names.into_iter().enumerate().filter(|(k, _)| run.nature.symmetries[*k]) {
        histories.push(history(name, run.momentum(k)));
    }
    histories
}
