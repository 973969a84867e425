//! The summary of all certificates: a line for each property and family of schemes, and the same by
//! quantity and order.

use super::Certified;
use holonom::verification::certificate::{Criterion, Finding, Verdict};
use holonom::verification::subject::SteppingMethod;
use std::collections::BTreeMap;

/// What a line is about: criterion, quantity, family, order.
type Key = (Criterion, String, &'static str, u32);

/// A line of the summary.
struct Line<'a> {
    findings: Vec<(&'a str, &'a Finding)>, // with their systems
}

/// A line for each property and family of schemes.
pub(super) fn summary(certified: &[Certified]) -> String {
    table(certified, property)
}

/// A line for each quantity, family of schemes and order.
pub(super) fn details(certified: &[Certified]) -> String {
    table(certified, key)
}

/// The table, with the system of the worst case of each line.
fn table(certified: &[Certified], key: fn(&Finding) -> Key) -> String {
    let mut lines: BTreeMap<Key, Line> = BTreeMap::new();
    for c in certified {
        for finding in c.reading.certificate.findings.iter().filter(|f| !f.measured.is_empty()) {
            let line = lines.entry(key(finding)).or_insert_with(|| Line { findings: Vec::new() });
            line.findings.push((c.case.name, finding));
        }
    }
    let mut text = String::from(
        "| property | schemes | expected | measured | worst case | system | verdicts |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for ((criterion, quantity, family, order), line) in &lines {
        let order = if *order == 0 { String::new() } else { format!(", order {order}") };
        let count = |verdict| line.findings.iter().filter(|f| f.1.verdict == verdict).count();
        let verdicts = Verdict::ALL.map(|verdict| count(verdict).to_string()).join(", ");
        let Some((system, worst)) = line.worst() else { continue };
        let mut measured = worst.measured.clone();
        if worst.quantity != *quantity {
            measured = format!("{}: {measured}", worst.quantity);
        }
        // not the end of a cell
        let [quantity, measured] = [quantity, &measured].map(|text| text.replace('|', "\\|"));
        text += &format!(
            "| {}: {quantity} | {family}{order} | {} | {} | {measured} | {system} | {verdicts} |\n",
            criterion.name(),
            expected(*criterion, worst),
            line.range()
        );
    }
    text
}

/// Quantities of one property in one line; orders of convergence by nominal order.
fn property(finding: &Finding) -> Key {
    let (criterion, quantity, scheme, order) = key(finding);
    let by_order = criterion == Criterion::Order;
    let quantity = match criterion {
        Criterion::Order if finding.expected.starts_with("1,") => "λ of first order".to_owned(),
        Criterion::Order => "q, p, λ".to_owned(),
        Criterion::Output => "residual of the equations of motion".to_owned(),
        Criterion::Energy => "H_d".to_owned(),
        Criterion::ClosedForm => "statics of beams".to_owned(),
        _ => quantity,
    };
    (criterion, quantity, scheme, if by_order { order } else { 0 })
}

fn key(finding: &Finding) -> Key {
    let family = match finding.method {
        Some(SteppingMethod::Variational(_)) => "variational",
        Some(SteppingMethod::Galerkin(_)) => "Galerkin",
        Some(SteppingMethod::EnergyMomentum(_)) => "energy–momentum",
        None => "statics",
    };
    // the Newton matrix has an exponent of its own in each scheme
    let scheme = match finding.criterion {
        Criterion::Conditioning => finding.method.map_or(family, SteppingMethod::name),
        _ => family,
    };
    let quantity = match finding.criterion {
        Criterion::Momentum => "linear and angular momentum".to_owned(),
        _ => finding.quantity.clone(),
    };
    let by_order = matches!(finding.criterion, Criterion::Order | Criterion::Energy);
    (finding.criterion, quantity, scheme, if by_order { finding.order } else { 0 })
}

/// Limits that depend on the run are given as such.
fn expected(criterion: Criterion, of: &Finding) -> String {
    match criterion {
        Criterion::Residual if of.expected.starts_with('≤') => "round-off".into(),
        Criterion::Reversal | Criterion::Agreement => "round-off".into(),
        Criterion::Energy if of.expected.is_empty() => "not applicable".into(),
        Criterion::ClosedForm => "the closed form".into(),
        _ => of.expected.clone(),
    }
}

impl Line<'_> {
    /// How far a finding is from what is expected; failures first, what was not judged last.
    fn worst(&self) -> Option<(&str, &Finding)> {
        let rank = |f: &Finding| match f.verdict {
            Verdict::Fail => 3,
            Verdict::KnownDeviation => 2,
            Verdict::Pass => 1,
            Verdict::Inconclusive | Verdict::NotApplicable => 0,
        };
        let off = |f: &Finding| {
            let value = f.value.unwrap_or(0.0);
            match f.criterion {
                Criterion::Order => {
                    (value - f64::from(f.order)).abs() * f64::from(f.value.is_some())
                }
                Criterion::Output => -f.value.unwrap_or(f64::INFINITY),
                _ => value.abs(),
            }
        };
        let judged = self.findings.iter();
        let worst =
            judged.max_by(|a, b| rank(a.1).cmp(&rank(b.1)).then(off(a.1).total_cmp(&off(b.1))));
        worst.map(|(system, finding)| (*system, *finding))
    }

    /// Smallest and largest number that was judged.
    fn range(&self) -> String {
        let judged = self.findings.iter().filter(|f| f.1.verdict.is_judged());
        let mut values: Vec<f64> = judged.filter_map(|f| f.1.value).collect();
        values.sort_by(f64::total_cmp);
        let [Some(low), Some(high)] = [values.first(), values.last()] else { return "–".into() };
        let number = |x: f64| match x.abs() {
            0.0 => "0".to_owned(),
            0.01..100.0 => format!("{x:.2}"),
            _ => format!("{x:.0e}"),
        };
        format!("{} … {} ({})", number(*low), number(*high), values.len())
    }
}
