//! `cargo xtask stability`: which steps of a rotating blade are stable, by discrete potential; into
//! docs/stability.md.
//!
//! Two measurements of each row. *Linear*: the eigenvalues of the exact tangent of a step about the
//! steady rotation, in the rotating frame. *Run*: steps from the unstretched blade, whose vibration
//! is finite.

mod blade;

use blade::{Blade, Rope, Rule};
use holonom::vi_beam::{ElementKind, StrainRule};
use holonom_reliability::text_file;
use std::path::Path;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/stability.md");
/// Time steps, s.
const STEPS: [f64; 8] = [0.01, 0.006, 0.003, 0.0015, 0.001, 0.0008, 0.0004, 0.0001];
/// Steps of a run.
const LENGTH: usize = 4000;

/// A table of the page: its mark, and what measures it.
type Table = (&'static str, fn() -> String);
const TABLES: [Table; 5] = [
    ("linear", linear),
    ("ropes", ropes),
    ("runs", runs),
    ("scaling", scaling),
    ("dissipative", dissipative),
];

/// Measures, and replaces the tables between the marks of docs/stability.md; `only`: one of them.
///
/// # Errors
/// A message when the page has no marks or cannot be written, or there is no such table.
pub fn run(only: Option<&str>) -> Result<(), String> {
    let wanted = |(name, _): &&Table| only.is_none_or(|only| only == *name);
    if !TABLES.iter().any(|table| wanted(&table)) {
        return Err("the tables are linear, ropes, runs, scaling, dissipative".to_owned());
    }
    let mut page = text_file::read(Path::new(PAGE))?;
    for (name, measure) in TABLES.iter().filter(wanted) {
        page = replace(&page, name, &measure())?;
    }
    text_file::write(Path::new(PAGE), &page)
}

/// `page` with what stands between `<!-- NAME -->` and `<!-- end of NAME -->` replaced.
fn replace(page: &str, name: &str, table: &str) -> Result<String, String> {
    let (start, end) = (format!("<!-- {name} -->\n"), format!("<!-- end of {name} -->"));
    let missing = || format!("{PAGE} lacks the marks of the table `{name}`");
    let (head, rest) = page.split_once(&start).ok_or_else(missing)?;
    let (_, tail) = rest.split_once(&end).ok_or_else(missing)?;
    Ok(format!("{head}{start}\n{table}\n{end}{tail}"))
}

/// Blades of the study: material, elements, rad/s.
fn blades() -> Vec<Blade> {
    let mut blades: Vec<Blade> = [6, 12, 24].map(|n| Blade::aluminium(n, 20.0)).into();
    blades.extend([Blade::steel(12, 20.0), Blade::aluminium(12, 5.0), Blade::aluminium(12, 40.0)]);
    blades
}

fn head() -> String {
    let steps: Vec<String> = STEPS.iter().map(|h| format!("{} ms", 1e3 * h)).collect();
    let line = "---|".repeat(STEPS.len() + 2);
    format!("| blade | potential | {} |\n|{line}\n", steps.join(" | "))
}

/// The largest `|z| − 1` of the eigenvalues of a step.
fn linear() -> String {
    let mut table = head();
    for blade in blades() {
        for rule in Rule::VARIATIONAL {
            let cell = |h: &f64| match blade.growth(rule, *h) {
                Some(growth) if growth < 1e-6 => "< 1e-6".to_owned(),
                Some(growth) => format!("**{growth:.0e}**"),
                None => "no steady rotation".to_owned(),
            };
            let cells: Vec<String> = STEPS.iter().map(cell).collect();
            let line = format!("| {} | {} | {} |\n", blade.name, rule.name(), cells.join(" | "));
            eprint!("{line}");
            table += &line;
        }
    }
    table
}

/// Ropes in tension: the largest `|z| − 1` of a step, and the change of energy of a run.
fn ropes() -> String {
    let mut table = head().replace("| blade ", "| rope ");
    let kinds = [ElementKind::Helicoidal, ElementKind::SecondOrder, ElementKind::Rope];
    let cords = kinds.map(|kind| Rope::cord(20, kind));
    for rope in [20, 60].map(Rope::steel).into_iter().chain(cords) {
        let rules = [
            (StrainRule::Averaged, "averaged"),
            (StrainRule::MassScaled, "mass_scaled"),
            (StrainRule::Dissipative, "dissipative"),
        ];
        for (rule, name) in rules {
            let cell = |h: &f64| {
                let conservative = rule != StrainRule::Dissipative;
                let growth = match conservative.then(|| rope.growth(rule, *h)) {
                    None => String::new(),
                    Some(Some(growth)) if growth < 1e-6 => "< 1e-6; ".to_owned(),
                    Some(Some(growth)) => format!("**{growth:.0e}**; "),
                    Some(None) => "–; ".to_owned(),
                };
                match rope.run(rule, *h, LENGTH) {
                    Ok(change) if change < 0.1 || rule == StrainRule::Dissipative => {
                        format!("{growth}{change:.0e}")
                    }
                    Ok(change) => format!("{growth}**{change:.0e}**"),
                    Err(step) => format!("{growth}**fails at {step}**"),
                }
            };
            let cells: Vec<String> = STEPS.iter().map(cell).collect();
            let line = format!("| {} | {name} | {} |\n", rope.name, cells.join(" | "));
            eprint!("{line}");
            table += &line;
        }
    }
    table
}

/// The largest change of energy in a run, relative to the initial energy.
fn runs() -> String {
    let mut table = head();
    for blade in blades() {
        for rule in Rule::ALL {
            let cell = |h: &f64| match blade.run(rule, *h, LENGTH) {
                Ok(change) if change < 0.1 => format!("{change:.0e}"),
                Ok(change) => format!("**{change:.0e}**"),
                Err(step) => format!("**fails at {step}**"),
            };
            let cells: Vec<String> = STEPS.iter().map(cell).collect();
            let line = format!("| {} | {} | {} |\n", blade.name, rule.name(), cells.join(" | "));
            eprint!("{line}");
            table += &line;
        }
    }
    table
}

/// Runs with other `μ`: failures, changes above 1e-4, the largest change.
fn scaling() -> String {
    let mut table =
        "| μ | ϑ for hω → ∞ | runs that fail | change > 1e-4 | largest |\n|---|---|---|---|---|\n"
            .to_owned();
    let blades = [6, 12, 24].map(|n| Blade::aluminium(n, 20.0));
    for (name, mu) in
        [("0", 0.0), ("1/12", 1.0 / 12.0), ("1/8", 0.125), ("1/6", 1.0 / 6.0), ("1/4", 0.25)]
    {
        let results: Vec<Result<f64, usize>> = blades
            .iter()
            .flat_map(|blade| STEPS.map(|h| blade.run_scaled(mu, h, LENGTH)))
            .collect();
        let changes = || results.iter().flatten().copied();
        let (failed, above) =
            (results.len() - changes().count(), changes().filter(|c| *c > 1e-4).count());
        let angle = 2.0 * (0.5 / f64::sqrt(mu)).atan().to_degrees();
        let largest = changes().fold(0.0, f64::max);
        let line = format!("| {name} | {angle:.1}° | {failed} | {above} | {largest:.0e} |\n");
        eprint!("{line}");
        table += &line;
    }
    table
}

/// Runs with dissipative strains at 20 rad/s: energy lost, and change of the energy over the last
/// quarter.
fn dissipative() -> String {
    let mut table = head().replace("| potential ", "");
    table = table.replacen("---|", "", 1);
    for blade in blades().into_iter().take(4) {
        let cell = |h: &f64| match blade.run_dissipative(*h, LENGTH) {
            Ok([lost, change]) => format!("{lost:.0e}, {change:.0e}"),
            Err(step) => format!("**fails at {step}**"),
        };
        let cells: Vec<String> = STEPS.iter().map(cell).collect();
        let line = format!("| {} | {} |\n", blade.name, cells.join(" | "));
        eprint!("{line}");
        table += &line;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_stand_between_their_marks() {
        let page = "a\n<!-- runs -->\nold\n<!-- end of runs -->\nb";
        let new = replace(page, "runs", "new").unwrap();
        assert_eq!(new, "a\n<!-- runs -->\n\nnew\n<!-- end of runs -->\nb");
        assert!(replace(page, "linear", "new").unwrap_err().contains("`linear`"));
    }

    /// Averaged strains fail where the linear step grows, and hold where it does not; with
    /// selective mass scaling both hold at every step.
    #[test]
    fn runs_of_a_blade_hold_where_the_linear_step_does() {
        let blade = Blade::aluminium(6, 20.0);
        let cases = [
            (Rule::Averaged, 0.003, false),
            (Rule::Averaged, 0.001, true),
            (Rule::MassScaled, 0.003, true),
        ];
        for (rule, h, holds) in cases {
            let growth = blade.growth(rule, h).unwrap();
            let run = blade.run(rule, h, 500);
            println!("{} at {h} s: |z| − 1 at most {growth:.1e}, run {run:?}", rule.name());
            assert_eq!(growth < 1e-6, holds, "{growth:e}");
            assert!(holds || growth > 1e-2, "{growth:e}");
            assert_eq!(run.is_ok_and(|change| change < 0.01), holds);
        }
        let [lost, change] = blade.run_dissipative(0.003, 500).unwrap();
        println!("dissipative strains: loses {lost:.1e}, changes by {change:.1e} at the end");
        assert!(lost > 0.0 && lost < 0.01 && change < 1e-6, "{lost:e}, {change:e}");
    }
}
