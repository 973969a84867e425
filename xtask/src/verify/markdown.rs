//! `VERIFICATION.md`, and what it is made of: a page for each system and one for all quantities,
//! below `docs/verification`.

use super::mutants::table::table as table_of_mutants;
use super::summary::{details, summary};
use super::{Around, Certified, criteria, without_mutant};
use holonom::certificate::now;
use holonom::verification::certificate::{Finding, Verdict, counts};
use holonom::verification::table::{Cell, CertificateTable, remarks, tables};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// Where the pages of the systems stand, from the root.
pub(super) const FOLDER: &str = "docs/verification";
/// The page of all quantities, in that folder.
pub(super) const QUANTITIES: &str = "quantities.md";

/// The page over all systems; `quick`: of a short run.
pub(super) fn page(
    certified: &[Certified],
    around: Option<&Around>,
    (quick, seconds): (bool, f64),
    commit: &str,
) -> String {
    let command = match quick {
        true => "cargo xtask verify --quick` (fewer steps and orders)",
        false => "cargo xtask verify`",
    };
    let findings: Vec<&Finding> =
        certified.iter().flat_map(|c| &c.reading.certificate.findings).collect();
    let mut text = format!(
        "# Verification\n\n\
         Written by `{command} on {} at commit {commit} in {:.0} min. Never edited by hand.\n\n\
         ## Summary\n\n\
         {} systems; findings: {}. One line for each property and family of schemes, over all systems. Numbers in parentheses \
         are equations of Leyendecker, Marsden & Ortiz, ZAMM 88 (2008) 677–708. Measured: smallest … largest judged number \
         (number of findings); the criteria below define it. Verdicts: numbers of findings that pass, are known deviations, are \
         inconclusive, are not applicable, fail.\n\n{}",
        &now()[..10],
        (seconds / 60.0).ceil(),
        certified.len(),
        counts(&findings),
        summary(certified)
    );
    text += "\n## Criteria\n\n\
             Every property is measured on every system by every scheme and order that applies. `N` counts steps, in compositions \
             sub-steps; `ε` is 2.2e-16. The last column counts the mutants (integrators with one planted defect) that the criterion \
             has to find.\n\n";
    text += &criteria::table();
    let _ = writeln!(
        text,
        "\nEvery quantity, family of schemes and order has a line in [{QUANTITIES}]({FOLDER}/{QUANTITIES})."
    );
    if let Some(around) = around {
        push_around(&mut text, around, without_mutant(certified).len());
        text += &crate::roundoff::section().unwrap_or_else(|lacks| format!("\n{lacks}\n"));
    }
    text += "\n## Systems\n\n\
             Each has a page with all numbers and the reason of everything that does not pass.\n\n";
    let _ = writeln!(
        text,
        "| system | | pass | known deviation | inconclusive | not applicable | fail | time |\n|---|---|---|---|---|---|---|---|"
    );
    for c in certified {
        let count = |verdict| c.reading.certificate.count(verdict).to_string();
        let _ = writeln!(
            text,
            "| [{0}]({FOLDER}/{0}.md) | {1} | {2} | {3} |",
            c.case.name,
            c.case.about,
            Verdict::ALL.map(count).join(" | "),
            c.reading.seconds.map_or_else(|| "–".to_owned(), |seconds| format!("{seconds:.0} s"))
        );
    }
    text
}

/// The page of all quantities.
pub(super) fn quantities(certified: &[Certified]) -> String {
    format!(
        "# Quantities and orders\n\n\
         Written by `cargo xtask verify`, never edited by hand: the summary of [VERIFICATION.md](../../VERIFICATION.md) in detail, one \
         line for each quantity, family of schemes and order. The measured number is for orders the \
         observed order; for outputs the order of the difference from the equations of motion; for the energy the variation of the \
         block medians over the width of the band, or the relative change of the energy where that is round-off; for momentum maps \
         the exponent of the growth; for condition numbers the exponent of `h`; else the quantity itself.\n\n{}",
        details(certified)
    )
}

/// Mutants and long tests.
fn push_around(text: &mut String, around: &Around, without: usize) {
    let found = around.mutants.iter().filter(|one| one.named).count();
    let _ = write!(
        text,
        "\n## Mutants\n\n\
         Of {} integrators with one planted defect each, {found} fail on the criterion and the quantity that name the defect. \
         Criteria and quantities that pass on some system and that no mutant breaks: {without}. An entry counts the systems on \
         which the criterion fails; in bold the criterion that names the defect.\n\n{}",
        around.mutants.len(),
        table_of_mutants(&around.mutants)
    );
    let _ = write!(text, "\n## Long tests\n\n{}", around.long_tests.list());
}

/// The page of a system.
pub(super) fn system(c: &Certified) -> String {
    let plan = &c.case.plan;
    let reference = c.reading.certificate.studies.first().map_or("none", |s| s.reference.as_str());
    let mut text = format!(
        "# {}\n\n{}. Written by `cargo xtask verify`, never edited by hand; the criteria stand in \
         [VERIFICATION.md](../../VERIFICATION.md). Errors against: {reference}. Convergence over {} s and its doublings; everything \
         else at h = {} s, the first run over {} steps, the others over {} steps or sub-steps, reversals \
         and comparisons over {}.\n\n\
         A plain entry passes; **FAIL** does not; *(known deviation)* does not, and the cause is known; – is inconclusive or not applicable, \
         for the reasons below. Orders are fitted above the round-off plateau, with the next term of the \
         expansion `C h^p (1 + c h²)` where it counts. Four halvings of order 8 are a fall by `4·10⁹`, for which double \
         precision leaves no range between the first asymptotic error and round-off: there the longest straight stretch of four, \
         three or two halvings is taken. Errors are relative to the quantity, at four nodes of the run.\n",
        c.case.name, c.case.about, plan.horizon.end, plan.step, plan.long, plan.short, plan.few
    );
    for of in tables(&c.reading.certificate) {
        table(&mut text, &of);
    }
    let remarks = remarks(&c.reading.certificate);
    if !remarks.is_empty() {
        text.push('\n');
        remarks.iter().for_each(|remark| {
            let _ = writeln!(text, "- {remark}");
        });
    }
    text
}

fn table(text: &mut String, table: &CertificateTable) {
    let _ = write!(text, "\n{}\n\n| {} |\n", table.title, table.header.join(" | "));
    let _ = writeln!(text, "|{}", "---|".repeat(table.header.len()));
    for (name, cells) in &table.rows {
        let cells: Vec<String> = cells.iter().map(cell).collect();
        let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
    }
}

fn cell(cell: &Cell) -> String {
    match cell.verdict {
        Some(Verdict::Fail) => format!("**{} FAIL**", cell.text),
        Some(Verdict::KnownDeviation) => format!("{} *(known deviation)*", cell.text),
        _ => cell.text.clone(),
    }
}

/// The short name of the present commit.
pub(super) fn commit(root: &Path) -> String {
    let git = Command::new("git").current_dir(root).args(["rev-parse", "--short", "HEAD"]).output();
    match git {
        Ok(output) if output.status.success() => {
            String::from_utf8_lossy(&output.stdout).trim().to_owned()
        }
        _ => "unknown".into(),
    }
}
