//! `VERIFICATION.md`.

use super::Certified;
use holonom::evidence::certificate::Verdict;
use holonom::evidence::judge::{EXPONENT_TOLERANCE, FORM_TOLERANCE, ORDER_TOLERANCE};
use holonom::evidence::table::{Cell, Table, remarks, tables};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// The page of all certificates; `quick`: of a short run.
pub(super) fn page(certified: &[Certified], quick: bool, seconds: f64, root: &Path) -> String {
    let command = match quick {
        true => "cargo xtask verify --quick` (fewer steps and orders)",
        false => "cargo xtask verify`",
    };
    let mut text = format!(
        "# Verification\n\n\
         Written by `{command} on {} at commit {} in {:.0} min. Never edited by hand.\n\n\
         Every promise is measured on every system by every scheme and order that applies. Orders are \
         fitted over at least four halvings of the step above the round-off plateau, with the next term of \
         the expansion `C h^p (1 + c h²)` where it counts, and must be within {ORDER_TOLERANCE} of the \
         nominal one. Four halvings of order 8 are a fall by `4·10⁹`, for which double precision leaves no \
         room between the first asymptotic error and round-off: there the longest straight stretch of four, \
         three or two halvings is taken. Errors are relative to the quantity, at four nodes of the run. Energy must stay in a band without a \
         trend, which is read from the shadow energy `(p H_d + E_d)/(p + 1)`; momentum maps must drift no faster than \
         `N^0.6` and stay within four random walks of their own steps; `Ω` is the symplectic form on a \
         canonical basis, carried by the exact tangent of the steps, and may change by \
         {FORM_TOLERANCE:.0e} of its terms; exponents of condition numbers must be within \
         {EXPONENT_TOLERANCE}. Numbers in parentheses are equations of Leyendecker, Marsden & Ortiz, \
         ZAMM 88 (2008) 677–708.\n\n\
         In the tables a plain entry holds; **FAIL** does not; *(known)* does not and it is known why; \
         – could not be told or is not promised. The reasons stand below each system.\n\n",
        today(),
        commit(root),
        (seconds / 60.0).ceil()
    );
    let _ = writeln!(
        text,
        "| system | | pass | known | open | fail | time |\n|---|---|---|---|---|---|---|"
    );
    for c in certified {
        let count = |verdict| c.certificate.count(verdict);
        let _ = writeln!(
            text,
            "| [{0}](#{0}) | {1} | {2} | {3} | {4} | {5} | {6:.0} s |",
            c.case.name,
            c.case.about,
            count(Verdict::Pass),
            count(Verdict::Known),
            count(Verdict::Open),
            count(Verdict::Fail),
            c.seconds
        );
    }
    for c in certified {
        system(&mut text, c);
    }
    text
}

fn system(text: &mut String, c: &Certified) {
    let plan = &c.case.plan;
    let reference = c.certificate.studies.first().map_or("none", |s| s.reference.as_str());
    let _ = write!(
        text,
        "\n## {}\n\n{}. Errors against: {reference}. Convergence over {} s and its doublings; everything \
         else at h = {} s, the first run over {} steps, the others over {} steps or sub-steps, reversals \
         and comparisons over {}.\n",
        c.case.name, c.case.about, plan.horizon.end, plan.step, plan.long, plan.short, plan.few
    );
    for of in tables(&c.certificate) {
        table(text, &of);
    }
    let remarks = remarks(&c.certificate);
    if !remarks.is_empty() {
        text.push('\n');
        remarks.iter().for_each(|remark| {
            let _ = writeln!(text, "- {remark}");
        });
    }
}

fn table(text: &mut String, table: &Table) {
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
        Some(Verdict::Known) => format!("{} *(known)*", cell.text),
        _ => cell.text.clone(),
    }
}

fn commit(root: &Path) -> String {
    let git = Command::new("git").current_dir(root).args(["rev-parse", "--short", "HEAD"]).output();
    match git {
        Ok(output) if output.status.success() => {
            String::from_utf8_lossy(&output.stdout).trim().to_owned()
        }
        _ => "unknown".into(),
    }
}

/// The day in UTC, as `2000-01-31` (days to civil date, after H. Hinnant).
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let days = seconds / 86_400 + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    format!("{:04}-{month:02}-{day:02}", era * 400 + year + u64::from(month <= 2))
}
