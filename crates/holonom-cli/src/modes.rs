//! `holonom modes`: natural frequencies and mode shapes about the initial configuration or an equilibrium.

use std::fmt::Write;

use holonom::RunFolder;
use holonom::modes::{About, Kind, ModalAnalysis, ModesError, Report};
use holonom::output::OutputError;
use holonom::report::mode_picture;

use crate::arguments::{At, Modes};
use crate::failure::Failure;
use crate::input::Input;
use crate::{stderr, stdout};

/// Modes that have a picture.
const PICTURES: usize = 20;

pub(crate) fn modes(arguments: &Modes) -> Result<(), Failure> {
    let overrides = arguments.model.set.clone();
    let about = match arguments.at {
        At::Start => About::Start,
        At::Static => About::Static,
    };
    let mut failed = None;
    let make = |model: &holonom::Model| {
        let found = ModalAnalysis::new(model, about).and_then(|mut analysis| {
            let report = analysis.modes(arguments.number)?;
            Ok((analysis, report))
        });
        match found {
            Ok(found) => Ok(Some(found)),
            Err(ModesError::Model(error)) => Err(error),
            Err(error) => {
                failed = Some(error);
                Ok(None)
            }
        }
    };
    let (_, found) = Input::new(&arguments.model, overrides, arguments.json).assemble_as(make)?;
    let Some((analysis, report)) = found else {
        return Err(match failed {
            Some(ModesError::Statics(failure)) => Failure::Run { failure, files: Vec::new() },
            _ => Failure::Usage { message: "no modes were found".into(), help: String::new() },
        });
    };
    for warning in &report.warnings {
        stderr::line(&format!("warning: {warning}"));
    }
    if let Some(folder) = &arguments.output {
        write(&RunFolder::open(folder), &analysis, &report, arguments.force)?;
    }
    if arguments.json {
        return stdout::json(&serde_json::to_value(&report).unwrap_or_default());
    }
    stdout::bytes(stderr::visible(&table(&report)).as_bytes())
}

/// Writes `modes.json`, `modes.csv` and the pictures of the first modes.
fn write(
    folder: &RunFolder,
    analysis: &ModalAnalysis,
    report: &Report,
    force: bool,
) -> Result<(), Failure> {
    RunFolder::vacant(folder.path(), &["modes.json", "modes.csv"], force)?;
    let json = format!("{:#}\n", serde_json::to_value(report).unwrap_or_default());
    let mut files = vec![folder.write("modes.json", &json)?];
    files.push(folder.write("modes.csv", &report.csv())?);
    for k in 0..report.modes.len().min(PICTURES) {
        let name = format!("modes/mode_{:02}.svg", k + 1);
        let picture = mode_picture(report, k, analysis.members(), analysis.beams());
        let svg =
            picture.svg().map_err(|reason| OutputError::Plot { name: name.clone(), reason })?;
        files.push(folder.write_picture(&name, &svg)?);
    }
    let place = folder.path().display();
    stderr::line(&format!(
        "written to {place}: modes.json, modes.csv, {} pictures",
        files.len() - 2
    ));
    Ok(())
}

fn table(report: &Report) -> String {
    let dof = match report.dof {
        1 => "1 degree of freedom".to_owned(),
        number => format!("{number} degrees of freedom"),
    };
    let about = match report.about {
        About::Start => "the initial configuration".to_owned(),
        About::Static => format!("the equilibrium at t = {}", report.t),
    };
    let mut text = format!("{}: {dof}; modes about {about}\n", report.model);
    if report.unstable > 0 {
        let (count, s) = (report.unstable, if report.unstable == 1 { "" } else { "s" });
        let _ = writeln!(text, "  {count} unstable mode{s}");
    }
    if report.zero > 0 {
        let (count, s) = (report.zero, if report.zero == 1 { "" } else { "s" });
        let _ = writeln!(text, "  {count} mode{s} without stiffness: 0 Hz");
    }
    let (residual, orthogonality) = (report.residual, report.orthogonality);
    let _ = writeln!(text, "  residual {residual:.1e}, orthogonality {orthogonality:.1e}");
    if report.modes.is_empty() {
        return text;
    }
    let _ = writeln!(text, "  mode         f [Hz]  omega [rad/s]  moves most");
    for (k, mode) in report.modes.iter().enumerate() {
        let (number, most) = (k + 1, mode.moves_most());
        let _ = match mode.kind {
            Kind::Unstable => {
                writeln!(text, "  {number:4}       unstable  {:>8.4} 1/s   {most}", mode.growth)
            }
            Kind::Zero => writeln!(text, "  {number:4}  {:>13}  {:>13}  {most}", 0, 0),
            Kind::Vibration => writeln!(
                text,
                "  {number:4}  {:>13}  {:>13}  {most}",
                seven(mode.frequency),
                seven(mode.omega)
            ),
        };
    }
    text
}

/// Seven significant digits.
fn seven(value: f64) -> String {
    if !(1e-4..1e9).contains(&value) {
        return format!("{value:.6e}");
    }
    let digits = 6 - value.log10().floor().clamp(-4.0, 6.0) as i32;
    format!("{value:.*}", digits.max(0) as usize)
}
