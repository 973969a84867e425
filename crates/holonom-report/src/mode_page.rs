//! `modes.html`: the modes of a model, moving, with their frequencies; of several speeds their
//! Campbell diagram.

use std::fmt::Write;

use holonom_model::{Model, ModelError};
use holonom_sim::modes::{About, BucklingFacts, Campbell, Mode, ModeKind, Report};

use super::facts::{counted, rounded};
use super::mode_shapes::campbell_diagram;
use super::page::{escape, foot, head, heading, inline, push_list, push_model, push_warnings};
use super::scene::Scene;

/// The page of a report of modes; `command` makes it again.
///
/// # Errors
/// [`ModelError`] when the model cannot be assembled.
pub fn mode_page(model: &Model, report: &Report, command: &str) -> Result<String, ModelError> {
    let what = if report.buckling.is_some() { "critical loads" } else { "modes" };
    let title = format!("{}: {what}", report.model);
    let mut html = head(&title);
    let about = format!(
        "{}; about {}",
        counted(report.dof as u64, "degree of freedom", "degrees of freedom"),
        about(report)
    );
    html += &heading(&title, &[about], command);
    push_warnings(&mut html, &report.warnings);
    html += &Scene::of_modes(model, report)?.map_or_else(String::new, |scene| scene.html());
    push_list(&mut html, facts(report));
    if report.buckling.is_some() {
        html += "<h2>Critical loads</h2>\n";
        push_loads(&mut html, report);
    } else {
        html += "<h2>Modes</h2>\n";
        push_table(&mut html, report);
    }
    push_model(&mut html, &model.to_toml());
    foot(&mut html, env!("CARGO_PKG_VERSION"));
    Ok(html)
}

/// The page of a Campbell diagram; `command` makes it again.
#[must_use]
pub fn campbell_page(model: &Model, campbell: &Campbell, command: &str) -> String {
    let title = format!("{}: modes over the speed", campbell.model);
    let mut html = head(&title);
    let number = campbell.speeds.len() as u64;
    let about =
        format!("{}, frequencies in the rotating frame", counted(number, "speed", "speeds"));
    html += &heading(&title, &[about], command);
    push_warnings(&mut html, &campbell.warnings);
    let svg = campbell_diagram(campbell).svg();
    let _ = writeln!(html, "<figure>\n{}</figure>", inline(&svg, "Campbell diagram"));
    let note = "A line `k × speed` meets a mode where a force that is fixed in space excites it k times a revolution.";
    let _ = writeln!(html, "<p class=\"note\">{}</p>\n<h2>Frequencies</h2>", escape(note));
    let count = campbell.speeds.first().map_or(0, |at| at.vibrations.len());
    let modes: String = (1..=count).map(|k| format!("<th>mode {k} (Hz)</th>")).collect();
    let _ = writeln!(
        html,
        "<div class=\"scroll\"><table class=\"grid modes\">\n<tr><th>speed (rad/s)</th>{modes}<th>unstable modes</th></tr>"
    );
    for at in &campbell.speeds {
        let cell = |mode: &Option<Mode>| {
            let frequency = mode.as_ref().map(|mode| rounded(mode.frequency, 7));
            format!("<td>{}</td>", frequency.unwrap_or_default())
        };
        let cells: String = at.vibrations.iter().map(cell).collect();
        let speed = rounded(at.speed, 7);
        let _ = writeln!(html, "<tr><td>{speed}</td>{cells}<td>{}</td></tr>", at.unstable);
    }
    html += "</table></div>\n";
    push_model(&mut html, &model.to_toml());
    foot(&mut html, env!("CARGO_PKG_VERSION"));
    html
}

/// About which configuration.
fn about(report: &Report) -> String {
    match (report.about, &report.rotation) {
        (About::Static, _) => format!("the equilibrium at t = {}", report.t),
        (About::Rotation, Some(rotation)) => {
            let [x, y, z] = rotation.axis.map(|x| rounded(x, 6));
            let speed = rounded(rotation.speed, 7);
            format!("the steady rotation of {speed} rad/s about [{x}, {y}, {z}], in its frame")
        }
        (About::Motion, _) => report.steady_motion(),
        _ => "the initial configuration".to_owned(),
    }
}

fn facts(report: &Report) -> Vec<(&'static str, String)> {
    if let Some(BucklingFacts { end, reversed }) = report.buckling {
        let beyond = reversed.map_or_else(|| "none".to_owned(), |factor| rounded(factor, 7));
        return vec![
            ("load factor 1", format!("the loads at t = {end}")),
            ("reversed loads", format!("first critical load factor: {beyond}")),
            ("residual", format!("{:.1e}, relative to the shape", report.residual)),
        ];
    }
    let of = |kind: ModeKind| report.modes.iter().filter(|mode| mode.kind == kind).count();
    vec![
        ("unstable", counted(report.unstable as u64, "mode", "modes")),
        ("without stiffness", counted(report.zero as u64, "mode", "modes")),
        (
            "listed",
            format!(
                "{} vibrations, {} decays without a vibration",
                of(ModeKind::Vibration),
                of(ModeKind::Decay)
            ),
        ),
        (
            "residual",
            format!("{:.1e}, relative to the terms of the eigenvalue problem", report.residual),
        ),
        (
            "orthogonality",
            format!("{:.1e}, of all undamped modes with respect to the mass", report.orthogonality),
        ),
    ]
}

fn push_table(html: &mut String, report: &Report) {
    *html += "<div class=\"scroll\"><table class=\"grid modes\">\n<tr><th>mode</th><th>f (Hz)</th><th>ω (rad/s)</th>\
              <th>damping ratio</th><th>δ (1/s)</th><th>kind</th><th>moves most</th></tr>\n";
    for (k, mode) in report.modes.iter().enumerate() {
        let cells: String =
            cells(mode).iter().map(|cell| format!("<td>{}</td>", escape(cell))).collect();
        let number = k + 1;
        let _ = writeln!(
            html,
            "<tr data-mode=\"{number}\"><td><button>{number}</button></td>{cells}</tr>"
        );
    }
    *html +=
        "</table></div>\n<p class=\"note\">δ: rate of e^(−δt), of unstable modes of e^(δt).</p>\n";
}

fn push_loads(html: &mut String, report: &Report) {
    *html += "<div class=\"scroll\"><table class=\"grid modes\">\n<tr><th>shape</th><th>load factor</th><th>moves most</th></tr>\n";
    for (k, mode) in report.modes.iter().enumerate() {
        let (number, most) = (k + 1, escape(&mode.moves_most()));
        let factor = rounded(mode.load_factor.unwrap_or_default(), 7);
        let _ = writeln!(
            html,
            "<tr data-mode=\"{number}\"><td><button>{number}</button></td><td>{factor}</td><td>{most}</td></tr>"
        );
    }
    *html += "</table></div>\n<p class=\"note\">The critical loads are the load factor times the loads at the end of the path, beside what is constant.</p>\n";
}

fn cells(mode: &Mode) -> [String; 6] {
    let number = |value: f64, known: bool| if known { rounded(value, 7) } else { String::new() };
    let vibrates = mode.omega > 0.0;
    let kind = match mode.kind {
        ModeKind::Unstable => "unstable",
        ModeKind::Zero => "without stiffness",
        ModeKind::Vibration => "vibration",
        ModeKind::Decay => "dies out",
        ModeKind::Buckling => "buckles",
    };
    [
        number(mode.frequency, vibrates || mode.kind == ModeKind::Zero),
        number(mode.omega, vibrates || mode.kind == ModeKind::Zero),
        number(mode.damping_ratio, mode.kind == ModeKind::Vibration),
        number(mode.growth.max(mode.decay), mode.kind != ModeKind::Zero),
        kind.to_owned(),
        mode.moves_most(),
    ]
}
