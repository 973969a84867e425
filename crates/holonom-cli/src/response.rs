//! `holonom response`: amplitude and phase of the sensors over a band of frequencies.

use std::fmt::Write;

use holonom::modes::ModesError;
use holonom::report::{response_charts, response_page, rounded};
use holonom::response::{AddedDamping, Response, ResponseError};
use holonom::{Model, RunFolder};

use crate::arguments::ResponseArguments;
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::reproduce::command;
use crate::{stderr, stdout};

/// Files of a response, beside its charts.
const FILES: [&str; 3] = ["response.json", "response.csv", "response.html"];

pub(crate) fn response(arguments: &ResponseArguments) -> Result<(), Failure> {
    let about = arguments.at.into();
    let damping = AddedDamping {
        rayleigh: arguments.rayleigh.unwrap_or_default(),
        ratios: arguments.damping_ratio.clone(),
    };
    let mut failed = None;
    let make = |model: &Model| match Response::new(
        model,
        about,
        &arguments.input,
        &arguments.band,
        &damping,
    ) {
        Ok(found) => Ok(Some(found)),
        Err(ResponseError::Modes(ModesError::Model(error))) => Err(error),
        Err(error) => {
            failed = Some(error);
            Ok(None)
        }
    };
    let overrides = arguments.model.set.clone();
    let (model, found) =
        ModelInput::new(&arguments.model, overrides, arguments.json).assemble_as(make)?;
    let response = match (found, failed) {
        (Some(found), _) => found,
        (None, error) => return Err(failure(error)),
    };
    response.warnings.iter().for_each(|warning| stderr::line(&format!("warning: {warning}")));
    if let Some(folder) = &arguments.output {
        RunFolder::vacant(folder, &FILES, arguments.force)?;
        write(&RunFolder::open(folder), &model, &response)?;
    }
    if arguments.json {
        return stdout::json(&serde_json::to_value(&response).unwrap_or_default());
    }
    stdout::bytes(stderr::visible(&table(&response)).as_bytes())
}

/// What there is instead of a response.
pub(crate) fn failure(error: Option<ResponseError>) -> Failure {
    let message =
        error.as_ref().map_or_else(|| "no response was found".into(), ToString::to_string);
    let remedy = match &error {
        Some(ResponseError::Modes(ModesError::Statics(failure))) => {
            return Failure::Run { failure: failure.clone(), files: Vec::new() };
        }
        Some(ResponseError::Unbounded(_)) => {
            "state damping: --damping-ratio, --rayleigh, dampers or `damping` of sections; begin a band above 0 Hz where \
             something moves freely"
        }
        Some(ResponseError::Unstable(_)) => {
            "take a stable state: --at static, or smaller loads; `holonom modes` shows what grows"
        }
        Some(ResponseError::Modes(ModesError::Uncertain(_) | ModesError::Nothing(_))) => {
            "state stiffnesses and masses of more alike sizes, or use more elements"
        }
        _ => {
            let help = match &error {
                Some(ResponseError::NoSensor) => {
                    "add a [[sensor]] of a position, a rate, a section force or the like"
                }
                Some(ResponseError::NoForce) => {
                    "give the load a force or torque, the motion of the ground or the unbalance another size than 0"
                }
                Some(ResponseError::InRotation(_)) => {
                    "excite by a load; what is fixed in space, as gravity across the axis or a base motion, makes the equations in \
                     the rotating frame periodic (Floquet), and unequal bearings too: run the motion in time, or take the \
                     modes in space of a rotor that is alike in all directions, holonom modes --at motion"
                }
                _ => {
                    "inputs are load.NAME, base.x=AMPLITUDE and unbalance.BODY.z=U, with names of the model"
                }
            };
            return Failure::Usage { message, help: help.into() };
        }
    };
    Failure::before_a_step(message, remedy)
}

/// Writes the files, the page and the charts.
fn write(folder: &RunFolder, model: &Model, response: &Response) -> Result<(), Failure> {
    let json = format!("{:#}\n", serde_json::to_value(response).unwrap_or_default());
    let page = response_page(model, response, &command());
    for (name, text) in FILES.into_iter().zip([&json, &response.csv(), &page]) {
        folder.write(name, text)?;
    }
    let charts = response_charts(response);
    for (name, chart) in &charts {
        folder.write_picture(&format!("response/{name}.svg"), &chart.svg())?;
    }
    let (place, count) = (folder.path().display(), charts.len());
    stderr::line(&format!("written to {place}: {}, {count} charts", FILES.join(", ")));
    Ok(())
}

/// The peaks of all sensors, and the resonances in the band.
pub(crate) fn table(response: &Response) -> String {
    let inputs: Vec<String> = response.inputs.iter().map(ToString::to_string).collect();
    let (count, dof) = (response.frequencies.len(), response.dof);
    let mut text = format!(
        "{}: {dof} degrees of freedom; response to {} at {count} frequencies\n",
        response.model,
        inputs.join(", ")
    );
    let widest = response.columns.iter().map(|column| column.name.len()).max().unwrap_or(0).max(6);
    let _ = writeln!(
        text,
        "  {:widest$}  {:>13}  {:>12}  {:>9}",
        "sensor", "peak", "at f [Hz]", "phase [°]"
    );
    for column in &response.columns {
        let k = column.peak();
        if column.amplitude[k] == 0.0 {
            let _ = writeln!(text, "  {:widest$}  {:>13}", column.name, 0);
            continue;
        }
        let peak = format!("{} {}", rounded(column.amplitude[k], 6), column.unit);
        let [frequency, phase] = [rounded(response.frequencies[k], 7), rounded(column.phase[k], 4)];
        let name = &column.name;
        let _ = writeln!(text, "  {name:widest$}  {peak:>13}  {frequency:>12}  {phase:>9}");
    }
    for own in &response.resonances {
        let [f, ratio] = [own.frequency, own.damping_ratio].map(|x| rounded(x, 7));
        let _ = writeln!(text, "  resonance at {f} Hz, damping ratio {ratio}");
    }
    text
}
