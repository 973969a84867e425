//! What the verbs say, for a caller that shows it itself.

use holonom::certificate::ModelCertificate;
use holonom::gradient::ModelGradient;
use holonom::identification::Identified;
use holonom::modes::{Campbell, ModesError, Report};
use holonom::optimize::OptimumReport;
use holonom::output::{OutputSize, Summary};
use holonom::response::{Response, ResponseError};
use holonom::{AssemblyReport, Model};

use crate::failure::Failure;
use crate::{gradient, human, identify, modes, optimize, response, verify};

/// A run in numbers, as `holonom run` says it, without the files.
#[must_use]
pub fn run(summary: &Summary) -> String {
    human::run(summary).0
}

/// What the assembly found, as `holonom check` says it.
#[must_use]
pub fn assembly(model: &Model, report: &AssemblyReport, size: OutputSize) -> String {
    human::assembly(model, report, size)
}

/// The unstable modes and `count` others, or critical loads, as `holonom modes` says it.
#[must_use]
pub fn modes(report: &Report, count: usize) -> String {
    modes::table(report, count)
}

/// The modes over the speed, as `holonom modes --speeds` says it.
#[must_use]
pub fn campbell(diagram: &Campbell) -> String {
    modes::speeds(diagram)
}

/// Why there are no modes, and what to do instead.
#[must_use]
pub fn no_modes(error: ModesError) -> (String, String) {
    words(modes::failure(Some(error)))
}

/// The peaks of all sensors, as `holonom response` says it.
#[must_use]
pub fn response(found: &Response) -> String {
    response::table(found)
}

/// Why there is no response, and what to do instead.
#[must_use]
pub fn no_response(error: ResponseError) -> (String, String) {
    words(response::failure(Some(error)))
}

/// An optimum, as `holonom optimize` says it.
#[must_use]
pub fn optimum(found: &OptimumReport) -> String {
    optimize::table(found)
}

/// The derivatives, as `holonom gradient` says them.
#[must_use]
pub fn gradient(found: &ModelGradient) -> String {
    gradient::table(found)
}

/// The estimates, as `holonom identify` says them.
#[must_use]
pub fn identified(found: &Identified) -> String {
    identify::table(found)
}

fn words(failure: Failure) -> (String, String) {
    match failure {
        Failure::Run { failure, .. } => (failure.message, failure.remedy),
        Failure::Usage { message, help } => (message, help),
        other => (other.to_string(), String::new()),
    }
}

/// The verdict with recommended steps, as `holonom verify` says it; with `tables` all of them.
#[must_use]
pub fn certificate(certificate: &ModelCertificate, tables: bool) -> String {
    verify::words(certificate, tables)
}
