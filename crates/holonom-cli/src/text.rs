//! What the verbs say, for a caller that shows it itself.

use holonom::certificate::ModelCertificate;
use holonom::modes::Report;
use holonom::output::{OutputSize, Summary};
use holonom::{AssemblyReport, Model};

use crate::{human, modes, verify};

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

/// The unstable modes and `count` others, as `holonom modes` says it.
#[must_use]
pub fn modes(report: &Report, count: usize) -> String {
    modes::table(report, count)
}

/// The verdict with recommended steps, as `holonom verify` says it; with `tables` all of them.
#[must_use]
pub fn certificate(certificate: &ModelCertificate, tables: bool) -> String {
    verify::words(certificate, tables)
}
