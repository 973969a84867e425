//! `RELIABILITY.md` from the stored numbers.

use crate::fuzz::limits;
use crate::fuzz::tally::FuzzTally;
use crate::fuzz::targets::{self, Answer};
use crate::interrupt::TrialKind;
use crate::interrupt::tally::{InterruptTallies, InterruptTally};
use crate::mutants;
use crate::soak::bounds;
use crate::soak::tally::{Reason, SoakTally, WorstMechanism};
use crate::stored::Stored;
use std::collections::BTreeMap;
use std::fmt::Write;

const HEAD: &str = include_str!("head.md");
const FINDINGS: &str = include_str!("findings.md");

const MECHANISMS: &str = "Mechanisms";
const TOUCHING: &str = "Bodies that touch";
const INPUTS: &str = "Inputs";
const RUNS: &str = "Runs that are disturbed";

/// Numbers of all targets.
pub type FuzzTallies = BTreeMap<String, FuzzTally>;

/// The stored numbers of a page, as far as there are any.
#[derive(Debug, Default)]
pub(crate) struct PageNumbers {
    pub soak: Option<Stored<SoakTally>>,
    pub touching: Option<Stored<SoakTally>>,
    pub fuzz: Option<Stored<FuzzTallies>>,
    pub interrupt: Option<Stored<InterruptTallies>>,
}

/// The page with these numbers: a section without any is that of the page `before`.
pub(crate) fn page(before: &str, numbers: &PageNumbers) -> String {
    let mut out = page_of(before, numbers);
    defects(&mut out);
    let _ = write!(out, "\n## Findings\n\n{FINDINGS}");
    out
}

/// Its sections with numbers.
fn page_of(before: &str, numbers: &PageNumbers) -> String {
    let PageNumbers { soak, touching, fuzz, interrupt } = numbers;
    let mut out = format!("# Reliability\n\n{HEAD}");
    match soak {
        Some(soak) => mechanisms(&mut out, soak),
        None => out += section(before, MECHANISMS),
    }
    match touching {
        Some(touching) => bodies_that_touch(&mut out, touching),
        None => out += section(before, TOUCHING),
    }
    match fuzz {
        Some(fuzz) => inputs(&mut out, fuzz),
        None => out += section(before, INPUTS),
    }
    match interrupt {
        Some(interrupt) => runs(&mut out, interrupt),
        None => out += section(before, RUNS),
    }
    out
}

/// The section of a page with this title, from the empty line before it; empty without one.
fn section<'a>(page: &'a str, title: &str) -> &'a str {
    let heading = format!("\n## {title}\n");
    let Some(start) = page.find(&heading) else { return "" };
    let length = page[start + 1..].find("\n## ").map_or(page.len() - start, |end| end + 1);
    &page[start..start + length]
}

/// A number with its thousands apart.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

fn percent(part: u64, of: u64) -> String {
    format!("{:.2} %", 100.0 * part as f64 / of.max(1) as f64)
}

fn mechanisms(out: &mut String, Stored { seed, found }: &Stored<SoakTally>) {
    let _ = write!(
        out,
        "\n## {MECHANISMS}\n\n{} random mechanisms, seed {seed}, 20 steps each: trees and closed loops of all kinematic pairs,\n\
         redundant joints, point masses on bars, beams; springs, dampers, motors, loads, gear constraints, prescribed motions;\n\
         all schemes, orders 2 to 8, steps from 1e-5 s to 0.04 s.\n\n",
        grouped(found.mechanisms),
    );
    endings(out, found);
    let rows = [
        ("constraint residual", found.residual, bounds::RESIDUAL),
        ("change of a momentum map of a free system", found.momentum, bounds::MOMENTUM),
        ("energy balance of an energy–momentum scheme", found.energy, bounds::ENERGY),
        ("distance of two equivalent schemes", found.agreement, bounds::AGREEMENT),
        (
            "difference of a mechanism turned, moved, reordered, in other units",
            found.restated,
            bounds::RESTATED,
        ),
    ];
    largest(out, &rows);
    reasons(out, "Refused models", &found.refused);
    reasons(out, "Refused steps", &found.failed);
}

fn bodies_that_touch(out: &mut String, Stored { seed, found }: &Stored<SoakTally>) {
    let _ = write!(
        out,
        "\n## {TOUCHING}\n\n{} random mechanisms, seed {seed}, 40 steps each (`cargo xtask soak --touching`): spheres, capsules, cylinders, boxes and meshes,\n\
         one or two on a body, free or on joints with stops and dry friction, on a plane, on a body that is fixed, on planes of bodies that move, or in free flight;\n\
         next to each other in any attitude or flush; all laws of impact, `events` and `stepping`, steps from 1e-5 s to 5e-3 s. Gaps and stops are passed by less\n\
         than {:.0e} m or rad.\n\n",
        grouped(found.mechanisms),
        bounds::GAP,
    );
    endings(out, found);
    let rows = [
        ("constraint residual", found.residual, bounds::RESIDUAL),
        ("change of a momentum map of a free system", found.momentum, bounds::MOMENTUM),
        ("energy gained where nothing drives", found.gain, bounds::GAIN),
    ];
    largest(out, &rows);
    reasons(out, "Refused models", &found.refused);
    reasons(out, "Refused steps", &found.failed);
}

/// How mechanisms ended.
fn endings(out: &mut String, found: &SoakTally) {
    let (refused, failed) = (SoakTally::count(&found.refused), SoakTally::count(&found.failed));
    let of = found.mechanisms;
    let _ = write!(
        out,
        "| | mechanisms | |\n|---|---|---|\n\
         | reached the last step | {} | {} |\n| refused as a model | {} | {} |\n| a step refused | {} | {} |\n\
         | with a fault | {} | |\n| continued from a stored state, bit for bit | {} | |\n",
        grouped(found.done),
        percent(found.done, of),
        grouped(refused),
        percent(refused, of),
        grouped(failed),
        percent(failed, of),
        grouped(found.faults.len() as u64),
        grouped(found.restarted),
    );
}

/// The largest numbers with their bounds.
fn largest(out: &mut String, rows: &[(&str, WorstMechanism, f64)]) {
    out.push_str("\n| largest, relative to the terms that cancel | measured on | found | bound | mechanism |\n");
    out.push_str("|---|---|---|---|---|\n");
    for (what, WorstMechanism { count, value, index }, bound) in rows {
        let _ =
            writeln!(out, "| {what} | {} | {value:.1e} | {bound:.0e} | {index} |", grouped(*count));
    }
}

fn reasons(out: &mut String, title: &str, reasons: &BTreeMap<String, Reason>) {
    if reasons.is_empty() {
        return;
    }
    let _ = write!(out, "\n| {title}, by reason | number | first |\n|---|---|---|\n");
    let mut sorted: Vec<_> = reasons.iter().collect();
    sorted.sort_by_key(|(words, reason)| (std::cmp::Reverse(reason.count), (*words).clone()));
    for (words, Reason { count, first }) in sorted {
        let _ = writeln!(out, "| {} | {} | {first} |", words.replace('|', "/"), grouped(*count));
    }
}

fn inputs(out: &mut String, Stored { seed, found }: &Stored<FuzzTallies>) {
    let _ = write!(
        out,
        "\n## {INPUTS}\n\nMutated inputs, seed {seed}. An answer is right if the input is accepted, or refused in words, in bounded time and \
         memory; what an accepted input must fulfil stands in `crates/holonom-reliability/src/fuzz/targets/mod.rs`.\n\n\
         | target | executions | accepted | kinds of refusals | largest memory | faults |\n|---|---|---|---|---|---|\n"
    );
    let order: Vec<&str> = targets::all().iter().map(|target| target.name()).collect();
    for name in order {
        let Some(tally) = found.get(name) else {
            let _ = writeln!(out, "| {name} | 0 | | | | |");
            continue;
        };
        let _ = writeln!(
            out,
            "| {name} | {} | {} | {} | {:.0} MiB | {} |",
            grouped(tally.executions),
            grouped(tally.accepted),
            tally.shapes.len(),
            tally.memory as f64 / f64::from(1 << 20),
            tally.faults.len()
        );
    }
    large_inputs(out);
}

/// Of the present program.
fn large_inputs(out: &mut String) {
    out.push_str("\n| input | answer |\n|---|---|\n");
    for (name, answer) in limits::all() {
        let words = match answer {
            Answer::Accepted => "accepted".to_owned(),
            Answer::Refused(words) => short(&words),
            Answer::Wrong(words) => format!("**wrong**: {}", short(&words)),
        };
        let _ = writeln!(out, "| {name} | {words} |");
    }
}

/// The first words of a message, on one line.
fn short(words: &str) -> String {
    let line = words.replace(['\n', '|'], " ");
    let first: String = line.chars().take(120).collect();
    if first.len() < line.len() { first + " …" } else { first }
}

fn runs(out: &mut String, Stored { seed, found }: &Stored<InterruptTallies>) {
    let count: u64 = found.values().map(|row| row.experiments).sum();
    let _ = write!(
        out,
        "\n## {RUNS}\n\n{} runs of the program as a process, seed {seed}: bodies and beams, loops, point masses, variational and\n\
         energy–momentum schemes, sensors. A run is disturbed up to four times, at moments that the clock decides, continued after each time\n\
         and at last to its end; one with a damaged file may say that it cannot be continued, and is begun anew. Then tables, plots, model and\n\
         summary must be those of an undisturbed run, byte for byte (but for the time that it took). In between a disturbed run must leave whole rows, say why it\n\
         ended, and let itself be drawn. Of two runs in one folder one must succeed, with nothing of the other.\n\n\
         | runs that are | number | disturbances | begun anew | faults |\n|---|---|---|---|---|\n",
        grouped(count)
    );
    for kind in TrialKind::ALL {
        let row = found.get(kind.name()).cloned().unwrap_or_default();
        let InterruptTally { experiments, disturbances, anew, faults } = row;
        let numbers = [experiments, disturbances, anew, faults.len() as u64].map(grouped);
        let _ = writeln!(out, "| {} | {} |", kind.name(), numbers.join(" | "));
    }
}

fn defects(out: &mut String) {
    out.push_str(
        "\n## Defects made on purpose\n\nEach is made between the program and the judge, and must be found.\n\n\
         | harness | defect | found after |\n|---|---|---|\n",
    );
    for mutant in mutants::all() {
        let found = mutant.found_after();
        let found =
            found.map_or_else(|| "**not found**".to_owned(), |count| (count + 1).to_string());
        let _ = writeln!(out, "| {} | {} | {found} |", mutant.harness, mutant.name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_without_numbers_stays() {
        let found = SoakTally { mechanisms: 7, ..SoakTally::default() };
        let numbers = |seed| PageNumbers {
            touching: Some(Stored { seed, found: found.clone() }),
            ..PageNumbers::default()
        };
        let before = "# A\n\n## Mechanisms\n\na\n\n## Inputs\n\nb\n\n| c |\n\n## Findings\n\nd\n";
        assert_eq!(section(before, INPUTS), "\n## Inputs\n\nb\n\n| c |\n");
        assert_eq!(section(before, "Findings"), "\n## Findings\n\nd\n");
        assert_eq!(section(before, TOUCHING), "");
        let first = page_of(before, &numbers(1));
        let again = page_of(&first, &numbers(2));
        assert!(first.contains("\n## Mechanisms\n\na\n\n## Bodies that touch\n\n7 random"));
        assert_eq!(again, first.replace("seed 1", "seed 2"));
        assert_eq!(first, page_of(&first, &PageNumbers::default()));
    }

    #[test]
    fn thousands_are_apart() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_234_567), "1,234,567");
        assert_eq!(grouped(100_000), "100,000");
    }
}
