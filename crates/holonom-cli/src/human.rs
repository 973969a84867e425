//! Reports for people.

use std::fmt::Write;

use holonom::AssemblyReport;
use holonom::model::{HighOrder, Model, Scheme, Settings};
use holonom::output::{OutputSize, Summary};
use holonom::report::{counted, counts, facts, rounded, time};
use holonom::run::Finished;

/// Characters of a line of a paragraph.
const WIDTH: usize = 100;

/// Words in lines of at most 100 characters, all but the first indented by two blanks more than
/// `indent`.
pub(crate) fn paragraph(words: &str, indent: &str) -> String {
    let (mut text, mut line) = (String::new(), indent.to_owned());
    let mut is_empty = true;
    for word in words.split_whitespace() {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            text += &format!("{line}\n");
            line = format!("{indent}  ");
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line += word;
        is_empty = false;
    }
    text + &line + "\n"
}

/// The summary of a run, and the width of its subjects.
pub(crate) fn run(summary: &Summary) -> (String, usize) {
    let mut text = format!("{}: {}\n", summary.model, counts(summary));
    let facts = facts(summary);
    let width = facts.iter().map(|f| f.subject.chars().count()).max().unwrap_or(0);
    for fact in &facts {
        let _ = writeln!(text, "  {:width$}  {}", fact.subject, fact.finding);
    }
    (text, width)
}

/// The same with the files that were written.
pub(crate) fn summary(finished: &Finished) -> String {
    let (mut text, width) = run(&finished.summary);
    let folder = finished.files.first().and_then(|f| f.parent());
    let names = finished.files.iter().map(|f| match folder.and_then(|d| f.strip_prefix(d).ok()) {
        Some(relative) => relative.display().to_string(),
        None => f.display().to_string(),
    });
    let names: Vec<String> = names.collect();
    let place = folder.map_or_else(String::new, |d| d.display().to_string());
    let (plots, others): (Vec<_>, Vec<_>) = names.iter().partition(|n| n.ends_with(".svg"));
    let others = others.iter().map(|n| n.as_str()).collect::<Vec<_>>().join(", ");
    let plots = if plots.is_empty() { String::new() } else { format!(", {} plots", plots.len()) };
    let _ = writeln!(text, "  {:width$}  {place}: {others}{plots}", "written");
    text
}

/// What the assembly of a model found: subjects and findings.
pub(crate) fn findings(model: &Model, report: &AssemblyReport) -> Vec<(&'static str, String)> {
    let (settings, measures) = (&model.settings, &report.measures);
    let redundant = match report.redundant.as_slice() {
        [] => "none".to_owned(),
        names => format!("{} in {}", report.counts.redundant_constraints, names.join(", ")),
    };
    let mut rows = vec![
        ("degrees of freedom", report.counts.dof.to_string()),
        ("bodies, joints", format!("{}, {}", report.counts.bodies, report.counts.joints)),
        (
            "coordinates, constraints",
            format!("{}, {}", report.counts.coordinates, report.counts.constraints),
        ),
        ("redundant constraints", redundant),
        (
            "mass, extent",
            format!("{} kg, {} m", rounded(measures.mass, 4), rounded(measures.extent, 4)),
        ),
    ];
    let ranges =
        [("masses", measures.masses, "kg"), ("moments of inertia", measures.inertias, "kg·m²")];
    let stiffnesses = [
        ("stiffness of springs", measures.stiffnesses, "N/m"),
        ("stiffness about joints", measures.angular_stiffnesses, "N·m/rad"),
        ("bending stiffness", measures.bending_stiffnesses, "N·m²"),
        ("extensional stiffness", measures.extensional_stiffnesses, "N"),
    ];
    let ranges = ranges.into_iter().filter(|(_, range, _)| range.is_some_and(|[a, b]| a < b));
    rows.extend(ranges.chain(stiffnesses).filter_map(|(subject, range, unit)| {
        let [least, most] = range?.map(|x| rounded(x, 4));
        let numbers = if least == most { least } else { format!("{least} to {most}") };
        Some((subject, format!("{numbers} {unit}")))
    }));
    rows.extend([
        ("initial position error", rounded(report.closure.position, 2)),
        ("initial velocity error", rounded(report.closure.velocity, 2)),
        ("simulation", plan(settings)),
    ]);
    if let Some(rotation) = report.fastest_rotation.as_ref().filter(|own| own.angle > 1e-3) {
        let error = rotation.phase_error.map_or_else(String::new, |error| {
            format!(", phase error {} %", rounded(100.0 * error.abs(), 2))
        });
        let angle = rounded(rotation.angle, 3);
        rows.push((
            "fastest rotation",
            format!("{angle} rad in a step ({}){error}", rotation.member),
        ));
    }
    // below that a motion without stiffness is found, by rounding
    let resolved = report.fastest_motion.as_ref().filter(|own| own.all.h_omega_max > 1e-6);
    if let Some(fastest) = resolved {
        let [all, own] = [&fastest.all, &fastest.by_constraint_forces];
        let mut found = format!(
            "{} (ω_max = {} rad/s, {})",
            rounded(all.h_omega_max, 3),
            rounded(all.omega_max, 3),
            all.member
        );
        if !fastest.held && own.omega_max > 0.0 && own != all {
            let _ = write!(
                found,
                ", {} by forces of joints ({})",
                rounded(own.h_omega_max, 3),
                own.member
            );
        }
        rows.push(("h ω_max", found));
    } else if let Some(why) = &report.fastest_motion_unknown {
        rows.push(("h ω_max", format!("not known: {why}")));
    }
    if let Some(stiffness) = &report.stiffness {
        let found = format!(
            "{} (element {} of {})",
            rounded(stiffness.h_omega_max, 3),
            stiffness.element,
            stiffness.beam
        );
        rows.insert(2, ("beams, elements", elements(report)));
        rows.push(("h ω_max of beams", found));
    }
    for own in &report.sections {
        let place = |[x, y]: [f64; 2]| format!("({}, {})", rounded(x, 4), rounded(y, 4));
        let [tension, shear, mass] = [own.tension, own.shear, own.mass].map(place);
        let (beam, at) = (&own.beam, rounded(own.at, 4));
        let found = format!("{beam} at {at} m: tension {tension}, shear {shear}, mass {mass} m");
        rows.push(("centres of the section", found));
    }
    rows.extend(report.strains.map(|variant| ("strains of beams", variant.name().to_owned())));
    rows
}

/// Numbers of beams and elements, and what these measure.
fn elements(report: &AssemblyReport) -> String {
    let kinds: Vec<&str> = report.element_kinds.iter().map(|kind| kind.name()).collect();
    format!("{}, {} ({})", report.counts.beams, report.counts.elements, kinds.join(", "))
}

/// The same as lines for a terminal.
pub(crate) fn assembly(model: &Model, report: &AssemblyReport, size: OutputSize) -> String {
    let mut text = format!("{}: valid\n", model.header.name);
    let recorded = [("recorded", size.words())];
    for (subject, finding) in findings(model, report).into_iter().chain(recorded) {
        let _ = writeln!(text, "  {subject:26}  {finding}");
    }
    for warning in report.warnings.iter().chain(&size.warning()) {
        let _ = writeln!(text, "  warning: {warning}");
    }
    text
}

fn plan(settings: &Settings) -> String {
    let (steps, scheme) = (settings.steps(), settings.scheme.name());
    let [step, end] = [settings.step, settings.end].map(time);
    match settings.scheme {
        Scheme::Static if settings.arc_length => {
            format!("scheme {scheme}, by arc length to t = {end}")
        }
        Scheme::Static => {
            format!(
                "scheme {scheme}, {} of the loads' time to t = {end}",
                counted(steps, "step", "steps")
            )
        }
        _ => {
            let method = match settings.method {
                HighOrder::Galerkin => " (Galerkin)",
                HighOrder::Composition => "",
            };
            format!(
                "{} of {step} s, scheme {scheme}, order {}{method}",
                counted(steps, "step", "steps"),
                settings.order
            )
        }
    }
}
