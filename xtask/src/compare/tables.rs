//! The tables over all models, with sentences that are made from their numbers.

use super::Compared;
use super::values::{number, record};
use holonom::compare::equal_error::{EqualError, TimeRatio, equal_error};
use holonom::compare::{Measured, Record};
use std::fmt::Write;

/// A ratio of times with the range that the spread of both allows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ratio {
    pub(super) value: f64,
    pub(super) range: [f64; 2],
}

impl Ratio {
    /// Of the time per step of `b` over that of `a`.
    pub(super) fn of(a: &Measured, b: &Measured) -> Option<Self> {
        let (x, y) = (a.seconds_per_step?, b.seconds_per_step?);
        let (p, q) = (a.seconds_range?, b.seconds_range?);
        Some(Self { value: y / x, range: [q[0] / p[1], q[1] / p[0]] })
    }

    /// The number where it is known to a quarter, else the range alone.
    pub(super) fn text(&self) -> String {
        let [low, high] = self.range;
        if high > 1.5 * low {
            return format!("{low:.1} … {high:.1}");
        }
        format!("{:.1} ({low:.1} … {high:.1})", self.value)
    }

    /// Whether the second is slower (1), faster (−1), or neither beyond the spread (0).
    pub(super) fn sign(&self) -> i32 {
        i32::from(self.range[0] > 1.0) - i32::from(self.range[1] < 1.0)
    }
}

/// Pairs of a variational and an energy–momentum form, by name.
pub(super) fn pairs(one: &Compared) -> Vec<(&'static str, Measured, Measured)> {
    let dense = |name: &str| one.dense.iter().find(|r| r.scheme == name);
    let all = [
        ("constrained", record(one, "constrained"), record(one, "em-constrained")),
        ("d'Alembert", record(one, "dalembert"), record(one, "em-dalembert")),
        ("nodal, both dense", dense("nodal"), dense("em-nodal")),
        ("nodal, as they run", record(one, "nodal"), record(one, "em-nodal")),
    ];
    let measured = |r: Option<&Record>| r?.measured.clone();
    let both = |(form, vi, em)| Some((form, measured(vi)?, measured(em)?));
    all.into_iter().filter_map(both).collect()
}

/// A form in both families at the same error of order 2.
pub(super) struct InForm {
    pub(super) form: &'static str,
    /// Whether both have the same initial guesses, the same criterion to stop and the same algebra.
    pub(super) is_equal: bool,
    /// Error of EM over that of VI, at the same step.
    pub(super) errors: f64,
    /// Time of EM over that of VI, at the same error.
    pub(super) time: Ratio,
}

/// The forms at the same error of order 2: errors fall with `h²`, so time for an error is that of a
/// step times the root of the error at the same step.
pub(super) fn in_form(one: &Compared) -> Vec<InForm> {
    let error = |name: &str| record(one, name)?.measured.as_ref()?.distance;
    let names = |form: &str| match form {
        "constrained" => ("constrained", "em-constrained"),
        "d'Alembert" => ("dalembert", "em-dalembert"),
        _ => ("nodal", "em-nodal"),
    };
    let found = |(form, vi, em): (&'static str, Measured, Measured)| {
        let (of_vi, of_em) = names(form);
        let errors = error(of_em)? / error(of_vi)?;
        let Ratio { value, range } = Ratio::of(&vi, &em)?;
        let less = errors.sqrt();
        let time = Ratio { value: less * value, range: range.map(|ratio| less * ratio) };
        Some(InForm { form, is_equal: !form.starts_with("nodal"), errors, time })
    };
    pairs(one).into_iter().filter_map(found).collect()
}

/// How many of the pairs in equal form are cheaper with VI, with EM, with neither beyond the
/// spread.
pub(super) fn in_equal_form(all: &[Compared]) -> [usize; 3] {
    let pairs: Vec<InForm> = all.iter().flat_map(in_form).filter(|pair| pair.is_equal).collect();
    [1, -1, 0].map(|sign| pairs.iter().filter(|pair| pair.time.sign() == sign).count())
}

pub(super) fn equal_forms(out: &mut String, all: &[Compared]) {
    *out += "\n## The same error in the same form\n\nOrder 2. Errors fall with h², so the time for an error is that of a step times the \
             root of the error at the same step. In the constrained and the d'Alembert form both families have the same initial guesses, \
             criterion to stop and algebra: their ratios compare the schemes. The nodal forms do not (see the method): their ratios \
             compare programs, also where both use dense matrices.\n\n\
             | model | form | error at the same step, EM : VI | time at the same error, EM : VI |\n|---|---|---|---|\n";
    for one in all {
        for InForm { form, errors, time, .. } in in_form(one) {
            let _ = writeln!(out, "| {} | {form} | {errors:.2} | {} |", one.name, time.text());
        }
    }
    let [vi, em, neither] = in_equal_form(all);
    let _ = writeln!(
        out,
        "\nOf the {} pairs in the constrained and d'Alembert forms the energy–momentum scheme is cheaper in {em}, the variational \
         one in {vi}; in {neither} the difference is within the spread of the times.",
        vi + em + neither
    );
}

pub(super) fn same_step(out: &mut String, all: &[Compared]) {
    *out += "\n## Cost of a step, EM : VI\n\nIterations: means. Step: time of the EM form over that of the variational one, \
             with its range.\n\n\
             | model | form | iterations | step |\n|---|---|---|---|\n";
    for one in all {
        for (form, vi, em) in pairs(one) {
            let Some(ratio) = Ratio::of(&vi, &em) else { continue };
            let _ = writeln!(
                out,
                "| {} | {form} | {:.2} : {:.2} | {} |",
                one.name,
                em.mean_iterations,
                vi.mean_iterations,
                ratio.text()
            );
        }
    }
}

/// Order 2 against order 2, and the best against the best.
pub(super) fn equal(one: &Compared) -> [(&'static str, Option<EqualError>); 2] {
    let c = &one.found;
    [("2 : 2", equal_error(c, &[2], false)), ("best : best", equal_error(c, &[2, 4, 6, 8], true))]
}

pub(super) fn ratio_of(e: &EqualError) -> Ratio {
    let TimeRatio { median, range } = e.ratio();
    Ratio { value: median, range }
}

pub(super) fn equal_errors(out: &mut String, all: &[Compared]) {
    *out += "\n## The same error, as implemented\n\nTime of the fastest EM scheme over that of the fastest variational one, at the \
             same error at the end (m; directors 1); times are interpolated between steps. Order 2 against order 2 \
             in the middle of the errors that both reach, the best orders at the smallest error that both reach; a \
             scheme whose largest step is more accurate already counts with the time of that step. The nodal scheme of VI has a recursion, initial \
             guesses and a criterion to stop that `em-nodal` has not: this table compares what the program offers.\n\n\
             | model | orders | error | variational | energy–momentum | EM : VI |\n|---|---|---|---|---|---|\n";
    for one in all {
        for (orders, found) in equal(one) {
            let Some(e) = found else {
                let _ = writeln!(out, "| {} | {orders} | no error that both reach ||||", one.name);
                continue;
            };
            let (vi, em) = (&e.variational, &e.energy_momentum);
            let _ = writeln!(
                out,
                "| {} | {orders} | {} | {} {}, {} s | {} {}, {} s | {} |",
                one.name,
                number(e.error),
                vi.scheme,
                vi.order,
                number(vi.time.median),
                em.scheme,
                em.order,
                number(em.time.median),
                ratio_of(&e).text()
            );
        }
    }
    let mut counts = [0; 3];
    for one in all {
        for e in equal(one).into_iter().filter_map(|(_, e)| e) {
            counts[usize::try_from(1 + ratio_of(&e).sign()).unwrap_or(1)] += 1;
        }
    }
    let [em, neither, vi] = counts;
    let _ = writeln!(
        out,
        "\nOf {} comparisons as implemented the variational schemes are faster in {vi}, the energy–momentum \
         schemes in {em}; in {neither} the difference is within the spread of the times.",
        em + neither + vi
    );
}

/// Exponent `p` of `κ ~ h^p` between the largest and the smallest step: as written, as factorized.
pub(super) fn exponents(r: &Record) -> Option<[f64; 2]> {
    let known = || r.conditions.iter().filter_map(|at| Some((at.step, at.condition?)));
    let ((h0, k0), (h1, k1)) = (known().next()?, known().next_back()?);
    let exponent = |a: f64, b: f64| (b / a).ln() / (h1 / h0).ln();
    (h1 < h0).then(|| [exponent(k0.as_written, k1.as_written), exponent(k0.scaled, k1.scaled)])
}

pub(super) fn conditions(out: &mut String, all: &[Compared]) {
    *out += "\n## Condition numbers\n\n`κ` of the Newton matrix as the equations are written | as factorized, at the \
             third step; `p`: `κ ~ h^p`, as written.\n";
    for one in all {
        let Some(first) = one.found.records.iter().find(|r| !r.conditions.is_empty()) else {
            continue;
        };
        let steps: String =
            first.conditions.iter().map(|at| format!(" h = {} |", at.step)).collect();
        let lines = "---|".repeat(first.conditions.len());
        let _ = write!(out, "\n| {} |{steps} p |\n|---|{lines}---|\n", one.name);
        for r in one.found.records.iter().filter(|r| !r.conditions.is_empty()) {
            let cells: String = r
                .conditions
                .iter()
                .map(|at| match at.condition {
                    Some(k) if k.as_written.to_bits() == k.scaled.to_bits() => {
                        format!(" {} |", number(k.scaled))
                    }
                    Some(k) => format!(" {} \\| {} |", number(k.as_written), number(k.scaled)),
                    None => " |".to_owned(),
                })
                .collect();
            let p = exponents(r).map_or_else(String::new, |p| format!("{:.1}", p[0]));
            let _ = writeln!(out, "| {} |{cells} {p} |", r.scheme);
        }
    }
}

pub(super) fn linearizations(out: &mut String, all: &[Compared]) {
    *out += "\n## The two linearizations of `em-nodal`\n\nThe Newton matrix needs the derivative of `P̄`. *Derivative*: \
             `∂(P̄ᵀ h B)/∂u` itself, as published (Betsch & Leyendecker 2006). *Multipliers*: `P̄ᵀ Σ μ_i ∂Ḡ_iᵀ/∂q_{n+1}`, \
             which is the same at the root and exists for every system. Both by dense matrices; times per step in \
             µs with their range.\n\n| model | multipliers: iterations, time | derivative: iterations, time | \
             derivative : multipliers | apart |\n|---|---|---|---|---|\n";
    for one in all {
        let cost = |c: &holonom::compare::linearization::LinearizationCost| {
            let [median, low, high] =
                [c.time.median, c.time.range[0], c.time.range[1]].map(|s| 1e6 * s);
            format!("{:.2}, {median:.1} ({low:.1} … {high:.1})", c.iterations)
        };
        let _ = match &one.linearizations {
            Err(reason) => writeln!(out, "| {} | {reason} ||||", one.name),
            Ok(found) => match &found.derivative {
                Err(reason) => {
                    writeln!(out, "| {} | {} | {reason} |||", one.name, cost(&found.multipliers))
                }
                Ok(derivative) => {
                    let (a, b) = (&found.multipliers.time, &derivative.time);
                    let range = [b.range[0] / a.range[1], b.range[1] / a.range[0]];
                    let ratio = Ratio { value: b.median / a.median, range };
                    writeln!(
                        out,
                        "| {} | {} | {} | {} | {} |",
                        one.name,
                        cost(&found.multipliers),
                        cost(derivative),
                        ratio.text(),
                        found.apart.map_or_else(String::new, number)
                    )
                }
            },
        };
    }
}
