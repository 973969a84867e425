//! `holonom modes`: natural frequencies and mode shapes about the initial configuration, an
//! equilibrium or a steady rotation; over the speed the Campbell diagram.

use std::fmt::Write;

use holonom::modes::{
    About, BucklingFacts, Campbell, ModalAnalysis, Mode, ModeKind, ModesError, Report,
};
use holonom::output::OutputError;
use holonom::report::{campbell_diagram, campbell_page, mode_page, mode_picture, rounded};
use holonom::vi_statics::BucklingError;
use holonom::{Model, RunFolder};

use crate::arguments::{ModesArguments, Speeds};
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::reproduce::command;
use crate::{stderr, stdout};

/// Files of an analysis, beside its pictures.
const FILES: [&str; 3] = ["modes.json", "modes.csv", "modes.html"];
/// Those of critical loads.
const BUCKLING_FILES: [&str; 3] = ["buckling.json", "buckling.csv", "buckling.html"];
/// Modes that have a picture.
const PICTURES: usize = 20;

pub(crate) fn modes(arguments: &ModesArguments) -> Result<(), Failure> {
    let input = ModelInput::new(&arguments.model, arguments.model.set.clone(), arguments.json);
    if let Some(Speeds(speeds)) = &arguments.speeds {
        let analyse = |model: &Model| Campbell::new(model, speeds, arguments.number);
        let (model, diagram) = analysed(&input, analyse)?;
        return campbell(arguments, &model, &diagram);
    }
    let about = arguments.at.into();
    let (model, (analysis, report)) = analysed(&input, |model| {
        if arguments.buckling {
            let mut analysis = ModalAnalysis::of_loads(model, about)?;
            let report = analysis.buckling(arguments.number)?;
            return Ok((analysis, report));
        }
        let mut analysis = ModalAnalysis::new(model, about)?;
        let report = analysis.modes(arguments.number)?;
        Ok((analysis, report))
    })?;
    let files = if arguments.buckling { BUCKLING_FILES } else { FILES };
    report.warnings.iter().for_each(|warning| stderr::line(&format!("warning: {warning}")));
    if let Some(folder) = &arguments.output {
        RunFolder::vacant(folder, &files, arguments.force)?;
        let page = match mode_page(&model, &report, &command()) {
            Ok(page) => page,
            Err(error) => return Err(input.refused(error)?),
        };
        write(&RunFolder::open(folder), files, &analysis, &report, &page)?;
    }
    if arguments.json {
        return stdout::json(&serde_json::to_value(&report).unwrap_or_default());
    }
    stdout::bytes(stderr::visible(&table(&report, arguments.number)).as_bytes())
}

/// What an analysis of the model finds; errors of the model with their lines.
fn analysed<T>(
    input: &ModelInput,
    analyse: impl Fn(&Model) -> Result<T, ModesError>,
) -> Result<(Model, T), Failure> {
    let mut failed = None;
    let make = |model: &Model| match analyse(model) {
        Ok(found) => Ok(Some(found)),
        Err(ModesError::Model(error)) => Err(error),
        Err(error) => {
            failed = Some(error);
            Ok(None)
        }
    };
    let (model, found) = input.assemble_as(make)?;
    match (found, failed) {
        (Some(found), _) => Ok((model, found)),
        (None, error) => Err(failure(error)),
    }
}

/// What there is instead of modes.
pub(crate) fn failure(error: Option<ModesError>) -> Failure {
    let message = error.as_ref().map_or_else(|| "no modes were found".into(), ToString::to_string);
    match error {
        Some(ModesError::Statics(failure)) => Failure::Run { failure, files: Vec::new() },
        Some(ModesError::Buckling(error)) => {
            let remedy = match error {
                BucklingError::Unstable(_) => "begin at a smaller load: --at start, or a smaller `simulation.end`",
                BucklingError::Unjudged => "use --at start or --at static without a rotation",
                BucklingError::Neutral => {
                    "constrain what moves freely by a joint or a spring"
                }
                BucklingError::NoPotential(_) => {
                    "judge equilibria along the path by `holonom modes --at static`, which finds growth and flutter"
                }
                BucklingError::NoLoad => {
                    "state a [[load]] or motor without a constant history; what acts from the beginning is not scaled"
                }
                _ => "state stiffnesses of more alike sizes, or use more elements",
            };
            Failure::before_a_step(message, remedy)
        }
        Some(ModesError::Uncertain(_) | ModesError::Nothing(_)) => {
            let remedy = "ask for more modes (-n), state stiffnesses and masses of more alike sizes, or use more elements";
            Failure::before_a_step(message, remedy)
        }
        _ => Failure::Usage {
            message,
            help: "a steady rotation needs joints, supports and forces that are the same from all directions \
                   about its axis; state it by the initial velocities or the `rate` of a joint; with gravity across \
                   the axis, and with unequal bearings, take the modes in space, --at motion, where the rotor itself \
                   is alike in all directions about its axis; where neither is, the equations are periodic and need \
                   Floquet's theory, which is not there: run the motion in time"
                .into(),
        },
    }
}

/// Tells and writes the Campbell diagram.
fn campbell(arguments: &ModesArguments, model: &Model, diagram: &Campbell) -> Result<(), Failure> {
    diagram.warnings.iter().for_each(|warning| stderr::line(&format!("warning: {warning}")));
    if let Some(folder) = &arguments.output {
        let folder = RunFolder::open(folder);
        let names = ["campbell.json", "campbell.csv", "modes.html"];
        RunFolder::vacant(folder.path(), &names, arguments.force)?;
        let json = format!("{:#}\n", serde_json::to_value(diagram).unwrap_or_default());
        folder.write(names[0], &json)?;
        folder.write(names[1], &diagram.csv())?;
        folder.write(names[2], &campbell_page(model, diagram, &command()))?;
        let name = "campbell.svg".to_owned();
        folder.write_picture(&name, &campbell_diagram(diagram).svg())?;
        let place = folder.path().display();
        stderr::line(&format!("written to {place}: {}, {name}", names.join(", ")));
    }
    if arguments.json {
        return stdout::json(&serde_json::to_value(diagram).unwrap_or_default());
    }
    stdout::bytes(stderr::visible(&speeds(diagram)).as_bytes())
}

/// The frequencies of the modes over the speed.
pub(crate) fn speeds(diagram: &Campbell) -> String {
    let mut text = format!("{}: frequencies in the rotating frame, Hz\n", diagram.model);
    let count = diagram.speeds.first().map_or(0, |at| at.vibrations.len());
    let head: String = (1..=count).map(|k| format!("{:>13}", format!("mode {k}"))).collect();
    let _ = writeln!(text, "  speed [rad/s]{head}");
    for at in &diagram.speeds {
        let frequency = |mode: &Option<Mode>| match mode {
            Some(mode) => format!("{:>13}", seven(mode.frequency)),
            None => format!("{:>13}", "-"),
        };
        let row: String = at.vibrations.iter().map(frequency).collect();
        let unstable = if at.unstable > 0 { "  unstable" } else { "" };
        let _ = writeln!(text, "  {:>13}{row}{unstable}", seven(at.speed));
    }
    text
}

/// Writes `modes.json`, `modes.csv`, the page and the pictures of the first modes.
fn write(
    folder: &RunFolder,
    files: [&str; 3],
    analysis: &ModalAnalysis,
    report: &Report,
    page: &str,
) -> Result<(), Failure> {
    let json = format!("{:#}\n", serde_json::to_value(report).unwrap_or_default());
    for (name, text) in files.into_iter().zip([&json, &report.csv(), page]) {
        folder.write(name, text)?;
    }
    let pictures = report.modes.len().min(PICTURES);
    for k in 0..pictures {
        let stem = if report.buckling.is_some() { "buckling/shape" } else { "modes/mode" };
        let name = format!("{stem}_{:02}.svg", k + 1);
        let picture = mode_picture(report, k, analysis.members(), analysis.beams());
        let svg =
            picture.svg().map_err(|reason| OutputError::Plot { name: name.clone(), reason })?;
        folder.write_picture(&name, &svg)?;
    }
    let place = folder.path().display();
    stderr::line(&format!("written to {place}: {}, {pictures} pictures", files.join(", ")));
    Ok(())
}

/// The unstable modes and `count` others: vibrations, or all of these and decays; of critical loads
/// all.
pub(crate) fn table(report: &Report, count: usize) -> String {
    if let Some(path) = &report.buckling {
        return loads(report, path);
    }
    let dof = match report.dof {
        1 => "1 degree of freedom".to_owned(),
        number => format!("{number} degrees of freedom"),
    };
    let about = match (report.about, &report.rotation) {
        (About::Static, _) => format!("the equilibrium at t = {}", report.t),
        (About::Rotation, Some(rotation)) => {
            let (speed, [x, y, z]) = (seven(rotation.speed), rotation.axis.map(|x| rounded(x, 6)));
            format!("the steady rotation of {speed} rad/s about [{x}, {y}, {z}], in its frame")
        }
        (About::Motion, _) => report.steady_motion(),
        _ => "the initial configuration".to_owned(),
    };
    let mut text = format!("{}: {dof}; modes about {about}\n", report.model);
    if report.unstable > 0 {
        let (count, s) = (report.unstable, if report.unstable == 1 { "" } else { "s" });
        let _ = writeln!(text, "  {count} unstable mode{s}");
    }
    if report.zero > 0 {
        let (count, s) = (report.zero, if report.zero == 1 { "" } else { "s" });
        let _ = match report.round_off {
            0.0 => writeln!(text, "  {count} mode{s} without stiffness: 0 Hz"),
            below => {
                writeln!(text, "  {count} mode{s} below round-off: less than {} Hz", seven(below))
            }
        };
    }
    if report.dof == 0 {
        return text;
    }
    let size = |x: f64| if x == 0.0 { "0".to_owned() } else { format!("{x:.1e}") };
    let (residual, orthogonality) = (size(report.residual), size(report.orthogonality));
    let inertia = report.unstable_by_inertia.map_or_else(String::new, |count| {
        format!(", {count} unstable by the inertia of the stiffness")
    });
    let _ = writeln!(text, "  residual {residual}, orthogonality {orthogonality}{inertia}");
    if report.modes.is_empty() {
        return text;
    }
    let first = report.modes.iter().filter(|mode| mode.kind == ModeKind::Unstable).count();
    let moving = report.modes.iter().enumerate().filter(|(_, mode)| mode.kind != ModeKind::Zero);
    let shown = || moving.clone().take(first + count);
    if shown().next().is_none() {
        return text;
    }
    let damped = report.modes.iter().any(|mode| mode.decay != 0.0);
    let ratio = if damped { "  damping ratio" } else { "" };
    let _ = writeln!(text, "  mode         f [Hz]  omega [rad/s]{ratio}  moves most");
    for (k, mode) in shown() {
        let (number, most) = (k + 1, mode.moves_most());
        let ratio = match mode.kind {
            _ if !damped => String::new(),
            ModeKind::Vibration => format!("  {:>13}", seven(mode.damping_ratio)),
            _ => format!("  {:>13}", ""),
        };
        let _ = match mode.kind {
            ModeKind::Unstable => writeln!(
                text,
                "  {number:4}       unstable  {:>8.4} 1/s {ratio}  {most}",
                mode.growth
            ),
            ModeKind::Zero | ModeKind::Buckling => Ok(()), // counted above, and of loads()
            ModeKind::Vibration => writeln!(
                text,
                "  {number:4}  {:>13}  {:>13}{ratio}  {most}",
                seven(mode.frequency),
                seven(mode.omega)
            ),
            ModeKind::Decay => writeln!(
                text,
                "  {number:4}      dies out  {:>9} 1/s{ratio}  {most}",
                seven(mode.decay)
            ),
        };
    }
    text
}

/// The critical loads.
fn loads(report: &Report, path: &BucklingFacts) -> String {
    let about = match report.about {
        About::Static => format!("the equilibrium at t = {}", report.t),
        _ => "the equilibrium at t = 0".to_owned(),
    };
    let (model, dof, end) = (&report.model, report.dof, path.end);
    let mut text = format!(
        "{model}: {dof} degrees of freedom; critical loads about {about}\n  load factor 1: the loads at t = {end}; residual \
         {:.1e}\n",
        report.residual
    );
    if let Some(factor) = path.reversed {
        let _ = writeln!(text, "  reversed loads: {}", seven(factor));
    }
    if !report.modes.is_empty() {
        text += "  shape    load factor  moves most\n";
    }
    for (k, mode) in report.modes.iter().enumerate() {
        let factor = seven(mode.load_factor.unwrap_or_default());
        let _ = writeln!(text, "  {:5}  {factor:>13}  {}", k + 1, mode.moves_most());
    }
    text
}

/// Seven significant digits.
fn seven(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e9).contains(&value) {
        return format!("{value:.6e}");
    }
    let digits = 6 - value.log10().floor().clamp(-4.0, 6.0) as i32;
    format!("{value:.*}", digits.max(0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use holonom::vi_statics::modes::ModeError;

    /// An empty list and a count that is not confirmed are failures with a remedy, code 1.
    #[test]
    fn modes_that_are_not_certain_are_no_answer() {
        let uncertain = [
            (
                ModeError::Unconfirmed { found: 2, expected: 3 },
                "2 were found, the signs of the stiffness say 3",
            ),
            (ModeError::Uncounted, "rounding hides the signs of the stiffness"),
            (ModeError::NotSettled { found: 4, wanted: 9 }, "4 of 9 modes were found"),
        ];
        let uncertain = uncertain.map(|(error, words)| (ModesError::Uncertain(error), words));
        let nothing = (ModesError::Nothing(12), "no mode was found of 12 degrees of freedom");
        for (error, words) in uncertain.into_iter().chain([nothing]) {
            let Failure::Run { failure, files } = failure(Some(error)) else { panic!("{words}") };
            println!("{}; {}", failure.message, failure.remedy);
            assert!(failure.message.contains(words), "{}", failure.message);
            assert!(failure.remedy.contains("ask for more modes (-n)") && files.is_empty());
        }
        let Failure::Usage { .. } = failure(Some(ModesError::NoRotation)) else { panic!() };
    }
}
