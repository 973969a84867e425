//! `report.html`: one file, nothing loaded from elsewhere, light or dark as the reader has it.

use std::fmt::Write;

use super::chart::LineChart;
use super::facts::{counted, counts, facts, iterations, rounded, time};
use super::style::Style;
use holonom_sim::is_note;
use holonom_sim::output::{Status, Summary, Trajectory};

const STYLE: &str = include_str!("page.css");

/// A drawing on the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Figure {
    /// File name without extension.
    pub name: String,
    /// The drawing with its caption, as a part of the page.
    pub html: String,
}

/// A part of the page of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PageSection {
    Sensors,
    Motion,
    Energy,
    Method,
}

impl PageSection {
    const ALL: [(Self, &str, &str); 4] = [
        (Self::Sensors, "sensors", "Sensors"),
        (Self::Motion, "motion", "Motion"),
        (Self::Energy, "energy", "Energy"),
        (Self::Method, "method", "Method"),
    ];

    /// Where a drawing stands; `parts`: whether the parts of the energy are drawn.
    fn of(name: &str, parts: bool) -> Self {
        match name {
            "beams" | "load_path" => Self::Motion,
            "energies" | "work" | "balance" => Self::Energy,
            "energy" | "energy_error" if !parts => Self::Energy,
            _ if name.starts_with("sensor_") => Self::Sensors,
            _ if name.starts_with("position") => Self::Motion,
            _ => Self::Method,
        }
    }
}

/// The page of a run, from its summary, its figures, the text of its model and its scene.
#[must_use]
pub fn page(
    summary: &Summary,
    trajectory: &Trajectory,
    figures: &[Figure],
    model: &str,
    scene: &str,
) -> String {
    let mut html = head(&summary.model);
    html += &heading(&summary.model, &[counts(summary)], summary.command.as_deref().unwrap_or(""));
    if summary.command.is_none() {
        html += "<p class=\"command\"><code>holonom run model.toml</code>, of the file beside this page</p>\n";
    }
    push_failure(&mut html, summary);
    let parts = figures.iter().any(|figure| figure.name == "energies");
    let of = |section: PageSection| -> Vec<&Figure> {
        figures.iter().filter(|figure| PageSection::of(&figure.name, parts) == section).collect()
    };
    let sections: Vec<_> =
        PageSection::ALL.into_iter().filter(|(section, ..)| !of(*section).is_empty()).collect();
    let links = sections.iter().map(|(_, id, name)| (*id, *name));
    push_contents(&mut html, links.chain([("numbers", "Numbers"), ("model", "Model")]));
    html += scene;
    push_list(&mut html, facts(summary).into_iter().map(|fact| (fact.subject, fact.finding)));
    for (section, id, name) in sections {
        let own = of(section);
        if section == PageSection::Method {
            let _ = writeln!(
                html,
                "<details id=\"{id}\">\n<summary><h2>{name}</h2>: {}</summary>",
                counted(own.len() as u64, "chart of the scheme", "charts of the scheme")
            );
        } else {
            let _ = writeln!(html, "<h2 id=\"{id}\">{name}</h2>");
        }
        push_figures(&mut html, own);
        if section == PageSection::Motion {
            push_left_out(&mut html, trajectory, figures);
        }
        if section == PageSection::Method {
            html += "</details>\n";
        }
    }
    html += "<h2 id=\"numbers\">Numbers</h2>\n";
    push_table(&mut html, summary);
    push_model(&mut html, model);
    foot(&mut html, &summary.version);
    html
}

/// Everything before the first heading of a page.
pub fn head(title: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title} – holonom</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n"
    )
}

/// Title, what was computed, and the command that computes it again, where it is known.
#[must_use]
pub fn heading(title: &str, about: &[String], command: &str) -> String {
    let about: Vec<String> = about.iter().map(|line| escape(line)).collect();
    let command = match command {
        "" => String::new(),
        known => format!("<p class=\"command\"><code>{}</code></p>\n", escape(known)),
    };
    format!(
        "<h1>{}</h1>\n<p class=\"counts\">{}</p>\n{command}",
        escape(title),
        about.join("<br>\n")
    )
}

/// A table with its head; cells are words.
pub fn push_grid<R: AsRef<[String]>>(
    html: &mut String,
    names: &[&str],
    rows: impl IntoIterator<Item = R>,
) {
    html.push_str("<div class=\"scroll\"><table class=\"grid\">\n<tr>");
    names.iter().for_each(|name| *html += &format!("<th>{}</th>", escape(name)));
    html.push_str("</tr>\n");
    for row in rows {
        let cells = row.as_ref().iter().map(|cell| format!("<td>{}</td>", escape(cell)));
        let _ = writeln!(html, "<tr>{}</tr>", cells.collect::<String>());
    }
    html.push_str("</table></div>\n");
}

/// Links to the sections of a page.
pub fn push_contents<'a>(html: &mut String, links: impl Iterator<Item = (&'a str, &'a str)>) {
    html.push_str("<nav class=\"contents\" aria-label=\"contents\">");
    for (id, name) in links {
        let _ = write!(html, "<a href=\"#{id}\">{name}</a>");
    }
    html.push_str("</nav>\n");
}

/// A chart as a part of a page, for wide and for narrow windows, with what to look for.
#[must_use]
pub fn figure(chart: &LineChart, caption: &str) -> String {
    let drawn = |style: &Style, class: &str| {
        let svg = inline(&chart.drawing(style).svg(), &chart.title);
        svg.replacen("<svg ", &format!("<svg class=\"{class}\" "), 1)
    };
    let both = drawn(&Style::page(), "wide") + &drawn(&Style::phone(), "narrow");
    framed(&both, caption)
}

/// A drawing as a part of a page.
#[must_use]
pub fn framed(drawing: &str, caption: &str) -> String {
    let caption = match caption.trim() {
        "" => String::new(),
        words => format!("<figcaption>{}</figcaption>\n", escape(words)),
    };
    format!("<figure>\n{drawing}{caption}</figure>\n")
}

/// A list of facts: subject and finding.
pub fn push_list<'a>(html: &mut String, facts: impl IntoIterator<Item = (&'a str, String)>) {
    html.push_str("<dl class=\"facts\">\n");
    for (subject, finding) in facts {
        let (subject, finding) = (escape(subject), unbroken(&escape(&finding)));
        let _ = writeln!(html, "<div><dt>{subject}</dt><dd>{finding}</dd></div>");
    }
    html.push_str("</dl>\n");
}

/// The text of a model.
pub fn push_model(html: &mut String, text: &str) {
    if !text.is_empty() {
        let text = escape(text);
        let _ = write!(html, "<h2 id=\"model\">Model</h2>\n<pre><code>{text}</code></pre>\n");
    }
}

/// Everything after the last section of a page.
pub fn foot(html: &mut String, version: &str) {
    let _ = write!(
        html,
        "<footer>holonom {}: variational integrators for constrained mechanical systems, after \
         Leyendecker, Marsden &amp; Ortiz, ZAMM 88 (2008) 677–708</footer>\n\
         </main>\n</body>\n</html>\n",
        escape(version)
    );
}

fn push_failure(html: &mut String, summary: &Summary) {
    if summary.status == Status::Failed {
        let words = match &summary.failure {
            Some(f) => format!(
                "The run failed in step {}, at t = {} s: {}. Remedy: {}.",
                f.step,
                time(f.t),
                f.message,
                f.remedy
            ),
            None => "The run failed.".to_owned(),
        };
        let _ = writeln!(html, "<p class=\"failed\">{}</p>", escape(&words));
    }
    let note = match (&summary.interruption, &summary.status) {
        (Some(at), _) => {
            let t = time(at.t);
            Some(format!("The run was interrupted after {} steps, at t = {t} s.", at.step))
        }
        (None, Status::Running) => Some(format!(
            "The run has not finished. The numbers below are those of its last checkpoint, after {} steps; the \
             plots show all rows that were written.",
            summary.steps
        )),
        _ => None,
    };
    if let Some(note) = note {
        let _ = writeln!(html, "<p class=\"warning\">{}</p>", escape(&note));
    }
    push_warnings(html, &summary.warnings);
}

/// Warnings; what says only that a wish of the model was granted is a remark.
pub fn push_warnings(html: &mut String, warnings: &[String]) {
    for words in warnings {
        let class = if is_note(words) { "remark" } else { "warning" };
        let _ = writeln!(html, "<p class=\"{class}\">{}</p>", unbroken(&escape(words)));
    }
}

/// HTML whose numbers with a power of ten stay on one line.
fn unbroken(html: &str) -> String {
    let word = |word: &str| {
        let exponent = word.split_once("e-").or_else(|| word.split_once("e+"));
        let number = exponent.is_some_and(|(mantissa, power)| {
            mantissa.ends_with(|c: char| c.is_ascii_digit())
                && power.starts_with(|c: char| c.is_ascii_digit())
        });
        if number { format!("<span class=\"number\">{word}</span>") } else { word.to_owned() }
    };
    html.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Drawings, side by side where there is room.
fn push_figures(html: &mut String, figures: Vec<&Figure>) {
    html.push_str("<div class=\"charts\">\n");
    figures.into_iter().for_each(|figure| html.push_str(&figure.html));
    html.push_str("</div>\n");
}

/// What is said of components that are not drawn.
fn push_left_out(html: &mut String, trajectory: &Trajectory, figures: &[Figure]) {
    let positions = figures.iter().filter(|figure| figure.name.starts_with("position_")).count();
    let members = trajectory.members().len();
    if members > positions {
        let _ = writeln!(
            html,
            "<p class=\"note\">Positions of {positions} of {members} components; all are in \
             trajectory.csv.</p>"
        );
    }
}

/// A stand-alone SVG as a part of the page: it takes its colours, and tells its title to readers
/// who do not see it.
pub fn inline(svg: &str, title: &str) -> String {
    let svg =
        svg.replacen("fill=\"#FFFFFF\"", "fill=\"none\"", 1).replace("#1F2937", "currentColor");
    let label = format!("<svg role=\"img\" aria-label=\"{}\" ", escape(title));
    let svg = svg.replacen("<svg ", &label, 1);
    svg.find("<svg").map_or(svg.clone(), |start| svg[start..].to_owned())
}

fn push_table(html: &mut String, summary: &Summary) {
    let Summary { momentum, constraint_residual: residual, energy, newton_iterations, .. } =
        summary;
    let by = if summary.method.is_some() { " (Galerkin)" } else { "" };
    let rows = [
        ("scheme, order", format!("{}, {}{by}", summary.scheme, summary.order)),
        ("time step", format!("{} s", time(summary.step))),
        ("end time", format!("{} s", time(summary.end_time))),
        ("steps taken, nodes recorded", format!("{}, {}", summary.steps, summary.recorded)),
        (
            "bodies and particles, joints and bars",
            format!("{}, {}", summary.counts.bodies, summary.counts.joints),
        ),
        ("coordinates", summary.counts.coordinates.to_string()),
        (
            "constraints, redundant among them",
            format!("{}, {}", summary.counts.constraints, summary.counts.redundant_constraints),
        ),
        ("degrees of freedom", summary.counts.dof.to_string()),
        ("initial energy", format!("{} J", rounded(energy.initial, 12))),
        ("largest energy error", format!("{:.3e} J", energy.max_abs_error)),
        match energy.drift_per_step {
            Some(drift) => ("energy drift per step", format!("{drift:.3e} J")),
            None => ("energy less work done", format!("{:.3e} J", energy.balance_error)),
        },
        (
            "largest change of linear momentum",
            format!("{:.3e} kg·m/s", momentum.linear.max_abs_drift),
        ),
        (
            "largest change of angular momentum",
            format!("{:.3e} kg·m²/s", momentum.angular.max_abs_drift),
        ),
        ("largest residual at positions", format!("{:.3e}", residual.position.max)),
        ("largest residual at velocities", format!("{:.3e}", residual.velocity.max)),
        ("largest residual at momenta", format!("{:.3e}", residual.momentum.max)),
        (
            "Newton iterations, mean and largest",
            format!("{:.3}, {}", newton_iterations.mean, iterations(newton_iterations.max)),
        ),
        ("time of the run", format!("{:.3e} s", summary.wall_seconds)),
        ("time per step, recording included", format!("{:.3e} s", summary.seconds_per_step)),
    ];
    let alone = summary.step_seconds.map(|step| ("time per step", format!("{step:.3e} s")));
    let rows = rows.into_iter().chain(alone);
    let kinds: Vec<&str> = summary.element_kinds.iter().map(|kind| kind.name()).collect();
    let (beams, elements) = (summary.counts.beams, summary.counts.elements);
    let beams = ("beams, elements", format!("{beams}, {elements} ({})", kinds.join(", ")));
    let rows = rows.chain((summary.counts.beams > 0).then_some(beams));
    html.push_str("<table>\n");
    for (name, value) in rows {
        let _ = writeln!(html, "<tr><th>{}</th><td>{}</td></tr>", escape(name), escape(&value));
    }
    html.push_str("</table>\n");
}

/// Text as HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}
