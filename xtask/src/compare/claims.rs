//! What Leyendecker, Marsden & Ortiz 2008 (LMO08) claim of both families, judged from the numbers.

use super::tables::{Ratio, equal, exponents, in_equal_form, in_form, pairs, ratio_of};
use super::values::{drift, number};
use super::{Compared, ENERGY_STEPS};
use holonom::compare::{EnergyBehaviour, Measured, Record};
use std::fmt::Write;

/// Deviations that count as round-off: of conserved quantities, of constraints, of `Ḡ Δq/h`.
const ROUND_OFF: f64 = 1e-9;

struct Claim {
    topic: &'static str,
    claimed: &'static str,
    measured: String,
    /// What the summary says in the place of `measured`, where that is long.
    short: String,
    verdict: String,
}

/// Confirmed where no exception is known; with a condition where there are some, but not
/// everywhere.
fn verdict(exceptions: &[String], of: usize, condition: &str) -> String {
    match exceptions.len() {
        0 => "confirmed".into(),
        k if k < of => {
            format!("confirmed with a condition: {condition} (not: {})", exceptions.join(", "))
        }
        _ => "not confirmed".into(),
    }
}

/// All schemes of a family that were measured, with their models.
fn family(all: &[Compared], em: bool) -> Vec<(&Compared, &Record, &Measured)> {
    let mut found = Vec::new();
    for one in all {
        let records = one.found.records.iter().filter(|r| r.energy_momentum == em);
        found.extend(records.filter_map(|r| Some((one, r, r.measured.as_ref()?))));
    }
    found
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

fn name(one: &Compared, r: &Record) -> String {
    format!("{} on {}", r.scheme, one.name)
}

/// The conclusions in short, a line for each claim.
pub(super) fn summary(out: &mut String, all: &[Compared]) {
    let claims = claims(all);
    let result = |claim: &Claim| claim.verdict.split(':').next().unwrap_or_default().to_owned();
    let count = |wanted: &str| claims.iter().filter(|claim| result(claim) == wanted).count();
    let models: Vec<&str> = all.iter().map(|one| one.name).collect();
    let _ = write!(
        out,
        "\n## Summary\n\n\
         Variational (VI) and energy–momentum (EM) schemes on the models {}. Of {} claims of Leyendecker, Marsden & Ortiz, ZAMM 88 \
         (2008) 677–708 (LMO08) on both families {} are confirmed, {} are confirmed with a condition, {} are not confirmed.\n\n\
         | property | claim of LMO08 | measured |\n|---|---|---|\n",
        models.join(", "),
        claims.len(),
        count("confirmed"),
        count("confirmed with a condition"),
        count("not confirmed")
    );
    for claim in &claims {
        let measured = if claim.short.is_empty() { &claim.measured } else { &claim.short };
        let _ = writeln!(out, "| {} | {} | {measured} |", claim.topic, result(claim));
    }
}

fn claims(all: &[Compared]) -> [Claim; 8] {
    [
        momenta(all),
        energy(all),
        constraints(all),
        cost(all),
        condition(all),
        dimension(all),
        accuracy(all),
        same_error(all),
    ]
}

pub(super) fn table(out: &mut String, all: &[Compared]) {
    *out += "\n## What was claimed, and what is measured\n\n\
             Claims in our words; sections of LMO08 (six-body linkage: 5.5, flexible multibody system: 6.2). Round-off: \
             below 1e-9. The verdicts are chosen by the numbers of this page.\n\n\
             | claimed | measured here | verdict |\n|---|---|---|\n";
    for Claim { claimed, measured, verdict, .. } in claims(all) {
        let _ = writeln!(out, "| {claimed} | {measured} | {verdict} |");
    }
}

fn momenta(all: &[Compared]) -> Claim {
    let of = |em| family(all, em).into_iter().map(|(one, r, m)| (name(one, r), drift(one, m)));
    let [vi, em] = [false, true].map(|em| largest(of(em).map(|d| d.1)));
    let off: Vec<String> =
        of(false).chain(of(true)).filter(|d| d.1 > ROUND_OFF).map(|d| d.0).collect();
    let count = of(false).chain(of(true)).count();
    Claim {
        topic: "momentum maps",
        claimed: "Both methods conserve the momentum maps of the system to round-off (5.5, 6.2).",
        measured: format!("largest change {} (VI), {} (EM)", number(vi), number(em)),
        short: String::new(),
        verdict: verdict(&off, count, "to 1e-9"),
    }
}

fn energy(all: &[Compared]) -> Claim {
    let em = family(all, true);
    let changes = em.iter().filter(|(_, _, m)| m.energy_verdict != EnergyBehaviour::Conserved);
    let mut off: Vec<String> = changes.map(|(one, r, _)| name(one, r)).collect();
    let mut widest: f64 = 0.0;
    for one in all {
        match &one.energy {
            // the means of a band of the size of round-off are round-off
            Ok(trend) if trend.width() <= ROUND_OFF * trend.band.1.abs() => {}
            Ok(trend) => {
                widest = largest([widest, trend.variation / trend.width()].into_iter());
                if !trend.is_bounded() {
                    off.push(format!("nodal on {}", one.name));
                }
            }
            Err(reason) => off.push(format!("nodal on {}: {reason}", one.name)),
        }
    }
    let error = largest(em.iter().map(|(_, _, m)| m.energy_error));
    Claim {
        topic: "energy",
        claimed: "EM conserves the energy; the energy error of VI is bounded, without drift (5.5, 6.2).",
        measured: format!(
            "largest energy error of EM {} J; block means of the energy of nodal over {ENERGY_STEPS} steps (of the model, \
             resolved, after the loads) within {:.1} % of its band",
            number(error),
            100.0 * widest
        ),
        short: String::new(),
        verdict: verdict(&off, em.len() + all.len(), "in the other runs, over these times"),
    }
}

fn constraints(all: &[Compared]) -> Claim {
    let vi = family(all, false);
    let both = || vi.iter().copied().chain(family(all, true));
    let position = largest(both().map(|(_, _, m)| m.constraint_residual.position.max));
    let velocity = largest(vi.iter().map(|(_, _, m)| m.constraint_residual.velocity.max));
    let mut off: Vec<String> = Vec::new();
    if position > ROUND_OFF || velocity > ROUND_OFF {
        off.push("positions or velocities".into());
    }
    let (mut orders, mut projected) = (Vec::new(), Vec::new());
    for one in all {
        match one.momentum_level {
            Some([coarse, _]) if coarse <= ROUND_OFF => projected.push(one.name),
            Some([coarse, fine]) => {
                let order = (coarse / fine).log2();
                orders.push(format!("{order:.1} on {}", one.name));
                if (order - 2.0).abs() > 0.5 {
                    off.push(format!("order {order:.1} on {}", one.name));
                }
            }
            None => off.push(format!("no run of {}", one.name)),
        }
    }
    let mut measured = format!(
        "positions {}, velocities of VI {}; momenta: orders {}",
        number(position),
        number(velocity),
        orders.join(", ")
    );
    let mut verdict = verdict(&off, all.len() + 1, "in the other cases");
    if !projected.is_empty() {
        let names = projected.join(", ");
        measured += &format!("; round-off on {names}");
        if off.is_empty() {
            verdict = format!(
                "confirmed with a condition: on {names} the mass matrix is singular, and the projected \
                 momentum is shown, which fulfils them to round-off"
            );
        }
    }
    Claim {
        topic: "constraints",
        claimed: "Constraints hold at positions and, for VI, at velocities to round-off; at momenta to second \
                  order only (3.3, 5.5).",
        measured,
        short: String::new(),
        verdict,
    }
}

fn cost(all: &[Compared]) -> Claim {
    let (mut measured, mut off, mut count) = (Vec::new(), Vec::new(), 0);
    for form in ["constrained", "d'Alembert", "nodal, as they run"] {
        let mut ratios: Vec<(&str, Ratio)> = Vec::new();
        for one in all {
            let found = pairs(one).into_iter().find(|pair| pair.0 == form);
            let ratio = found.and_then(|(_, vi, em)| Ratio::of(&vi, &em));
            ratios.extend(ratio.map(|ratio| (one.name, ratio)));
        }
        let Some(low) = ratios.iter().map(|r| r.1.range[0]).reduce(f64::min) else { continue };
        let high = largest(ratios.iter().map(|r| r.1.range[1]));
        measured.push(format!("{form} {low:.1} … {high:.1}"));
        count += ratios.len();
        let slower = ratios.iter().filter(|r| r.1.sign() <= 0);
        off.extend(slower.map(|(name, _)| format!("{form} on {name}")));
    }
    Claim {
        topic: "cost of a step",
        claimed: "The Newton matrix of VI needs no derivative of the null space matrix: a step costs less than \
                  with EM (5.5).",
        measured: format!("time of a step EM : VI over the models: {}", measured.join("; ")),
        short: String::new(),
        verdict: verdict(&off, count, "beyond the spread of the times for the other forms"),
    }
}

fn condition(all: &[Compared]) -> Claim {
    let (mut measured, mut off, mut count) = (Vec::new(), Vec::new(), 0);
    for (form, expected) in [("nodal", 0.0), ("constrained", -3.0), ("dalembert", -1.0)] {
        let of = |one: &Compared| {
            let found = one.found.records.iter().filter(|r| r.scheme.ends_with(form));
            found.filter_map(|r| Some((name(one, r), exponents(r)?[0]))).collect::<Vec<_>>()
        };
        let found: Vec<(String, f64)> = all.iter().flat_map(of).collect();
        let Some(low) = found.iter().map(|f| f.1).reduce(f64::min) else { continue };
        let high = found.iter().map(|f| f.1).fold(low, f64::max);
        measured.push(format!("{form} {low:.1} … {high:.1}"));
        count += found.len();
        off.extend(found.into_iter().filter(|f| (f.1 - expected).abs() > 0.3).map(|f| f.0));
    }
    Claim {
        topic: "condition number",
        claimed: "The condition number of the nodal scheme does not depend on h; that of the constrained scheme \
                  grows like h⁻³, of d'Alembert like h⁻¹ (3.2, 5.5).",
        measured: format!("exponents of h as written: {}", measured.join("; ")),
        short: String::new(),
        verdict: verdict(
            &off,
            count,
            "to 0.3 in the exponent, where the steps resolve the vibrations; scaled by powers of h no form depends on it",
        ),
    }
}

fn dimension(all: &[Compared]) -> Claim {
    let (mut off, mut count, mut sizes) = (Vec::new(), 0, Vec::new());
    for one in all {
        let c = &one.found;
        sizes.push(format!("{} : {} : {}", c.dof, c.coordinates, c.coordinates + c.constraints));
        for em in [false, true] {
            let runs: Vec<(&Record, &Measured)> =
                family(std::slice::from_ref(one), em).into_iter().map(|(_, r, m)| (r, m)).collect();
            let is_nodal = |r: &Record| r.scheme.ends_with("nodal") || r.scheme == "reduced";
            let time = |nodal: bool| {
                let of = runs.iter().filter(|(r, _)| is_nodal(r) == nodal);
                of.filter_map(|(r, m)| Some((m.seconds_per_step?, r, m)))
                    .min_by(|a, b| a.0.total_cmp(&b.0))
            };
            let (Some(nodal), Some(other)) = (time(true), time(false)) else { continue };
            count += 1;
            if Ratio::of(nodal.2, other.2).is_some_and(|ratio| ratio.sign() <= 0) {
                let family = if em { "EM" } else { "VI" };
                off.push(format!("{family} on {}: {}", one.name, other.1.scheme));
            }
        }
    }
    Claim {
        topic: "number of unknowns",
        claimed: "The nodal and reduced forms have the smallest systems and the lowest cost (3.2, 5.5, 6.2).",
        measured: format!(
            "unknowns nodal : d'Alembert : constrained {}; fastest at order 2 in {} of {count} families",
            sizes.join(", "),
            count - off.len()
        ),
        short: format!(
            "nodal or reduced fastest at order 2 in {} of {count} families",
            count - off.len()
        ),
        verdict: verdict(&off, count, "in the other families; elsewhere another form is as fast"),
    }
}

fn accuracy(all: &[Compared]) -> Claim {
    let mut ratios = Vec::new();
    for one in all {
        let distance = |em| {
            let found = family(std::slice::from_ref(one), em);
            found.into_iter().filter_map(|(_, _, m)| m.distance).reduce(f64::min)
        };
        if let (Some(vi), Some(em)) = (distance(false), distance(true)) {
            ratios.push((one.name, vi / em));
        }
    }
    let far = |r: &&(&str, f64)| r.1 > 10.0 || r.1 < 0.1;
    let off: Vec<String> = ratios.iter().filter(far).map(|r| r.0.to_owned()).collect();
    let list: Vec<String> = ratios.iter().map(|r| format!("{:.1} on {}", r.1, r.0)).collect();
    Claim {
        topic: "accuracy at the same step",
        claimed: "The trajectories of both methods are of comparable accuracy (5.5, 6.2).",
        measured: format!("error VI : EM at the same step: {}", list.join(", ")),
        short: String::new(),
        verdict: verdict(&off, ratios.len(), "within a factor of 10"),
    }
}

fn same_error(all: &[Compared]) -> Claim {
    let (mut texts, mut off, mut count) = (Vec::new(), Vec::new(), 0);
    for one in all {
        for pair in in_form(one).into_iter().filter(|pair| pair.is_equal) {
            count += 1;
            texts.push(format!("{} on {} {}", pair.form, one.name, pair.time.text()));
            if pair.time.sign() <= 0 {
                off.push(format!("{} on {}", pair.form, one.name));
            }
        }
    }
    let found = all.iter().flat_map(equal).filter_map(|(_, found)| found);
    let signs: Vec<i32> = found.map(|e| ratio_of(&e).sign()).collect();
    let faster = signs.iter().filter(|sign| **sign == 1).count();
    let [vi, em, _] = in_equal_form(all);
    let as_implemented =
        format!("as implemented, best against best, VI in {faster} of {}", signs.len());
    Claim {
        topic: "cost at the same error",
        claimed: "VI is the cheaper method for the same accuracy (follows from the two claims on cost and \
                  accuracy).",
        measured: format!(
            "time EM : VI at the same error in the same form: {}; {as_implemented}",
            texts.join("; ")
        ),
        short: format!(
            "in the same form VI is cheaper in {vi} of {count}, EM in {em}; {as_implemented}"
        ),
        verdict: verdict(&off, count, "in the other pairs of the same form"),
    }
}
