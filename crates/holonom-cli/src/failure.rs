//! How a verb fails: messages and exit codes.

use std::path::{Path, PathBuf};

use holonom::RunFailure;
use holonom::identification::DataError;
use holonom::import::ImportError;
use holonom::output::{OutputError, RunInterruption};
use holonom::report::time;
use holonom::run::{ContinueError, resume_command};

use crate::diagnostic::{self, InvalidModel};
use crate::stderr;
use crate::unit_library::help_on_libraries;

/// Why the program ends with a code other than 0.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// Code 1: the run did not reach its end; what was written stays. `files`: those not named yet.
    #[error("the run failed")]
    Run { failure: RunFailure, files: Vec<PathBuf> },
    /// Code 128 and the number of the signal: the run can be continued.
    #[error("the run was interrupted")]
    Interrupted { at: RunInterruption, signal: u8 },
    /// Code 128 and the number of the signal: the same command continues the sweep.
    #[error("the sweep was interrupted")]
    SweepInterrupted { signal: u8 },
    /// Code 128 and the number of the signal: the search ended before an optimum.
    #[error("the search was interrupted")]
    SearchInterrupted { signal: u8, folder: PathBuf },
    /// Code 1: a search found no optimum; the folder of one that may go on.
    #[error("{message}")]
    NoOptimum { message: String, unfinished: Option<PathBuf> },
    /// Code 1: some points of a sweep failed.
    #[error("{failed} of {of} points failed")]
    Points { failed: usize, of: usize, table: PathBuf },
    /// Code 1: a file cannot be written, and there is a checkpoint.
    #[error("{error}")]
    Stopped { error: OutputError, folder: PathBuf },
    /// Code 1: a property was measured and does not hold.
    #[error("{0}")]
    Property(String),
    /// Code 1: unknown numbers were not found.
    #[error("{message}")]
    Estimate { message: String, warned: bool },
    /// Code 128 and the number of the signal: the last iterate is kept, if there is one.
    #[error("the method was interrupted")]
    FitInterrupted { signal: u8, file: PathBuf },
    /// Code 3: measured values are none of the model.
    #[error(transparent)]
    Data(#[from] DataError),
    /// Code 1: a file cannot be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Code 1: the model does not fit into memory.
    #[error("{message}")]
    Memory { message: String },
    /// Code 1: results cannot be exported.
    #[error("{0}")]
    Export(String),
    /// Code 1: a unit cannot be written without the library.
    #[error("{0}")]
    Library(String),
    /// Code 2: the command asks for something that cannot be done.
    #[error("{message}")]
    Usage { message: String, help: String },
    /// Code 3: the model is invalid.
    #[error("the model is invalid")]
    Model(Box<InvalidModel>),
    /// Code 3: a description cannot be read or translated.
    #[error("{0}")]
    Import(Box<ImportError>),
    /// Standard output was closed by its reader.
    #[error("standard output is closed")]
    Closed,
}

impl Failure {
    /// That a file may be written: only `--force` replaces one.
    pub(crate) fn unless_vacant(file: &Path, force: bool) -> Result<(), Self> {
        if force || file.symlink_metadata().is_err() {
            return Ok(());
        }
        Err(Self::Usage {
            message: format!("{} already exists", file.display()),
            help: "add --force to replace it, or choose another file".into(),
        })
    }

    /// Of a run before its first step.
    pub(crate) fn before_a_step(message: String, remedy: &str) -> Self {
        let failure = RunFailure { step: 0, t: 0.0, message, remedy: remedy.to_owned() };
        Self::Run { failure, files: Vec::new() }
    }

    /// Tells the user, and gives the exit code.
    pub(crate) fn report(&self) -> u8 {
        match self {
            Self::Closed => 0,
            Self::Run { failure, files } => {
                let RunFailure { step, t, message, remedy } = failure;
                let t = time(*t);
                say(&format!("the run failed in step {step}, at t = {t} s: {message}"), remedy);
                if !files.is_empty() {
                    stderr::line("  written so far, all valid:");
                }
                files.iter().for_each(|file| stderr::line(&format!("    {}", file.display())));
                1
            }
            Self::Interrupted { at: RunInterruption { step, t, resume }, signal } => {
                let t = time(*t);
                say(
                    &format!(
                        "interrupted after step {step}, at t = {t} s; all rows so far are written"
                    ),
                    &match resume {
                        Some(command) => format!("continue with `{command}`"),
                        None => "equilibria have no checkpoints: run it again with --force".into(),
                    },
                );
                128 + signal
            }
            Self::SweepInterrupted { signal } => {
                say("the sweep was interrupted", "the same command continues it");
                128 + signal
            }
            Self::SearchInterrupted { signal, folder } => {
                let help = format!(
                    "where it was is written, which is no optimum; `{}` goes on from there",
                    resume_command(folder)
                );
                say("the search was interrupted", &help);
                128 + signal
            }
            Self::NoOptimum { message, unfinished } => {
                let help = "where the search ended is written; begin elsewhere, or ask for less";
                let more = unfinished.as_ref().map(|folder| resume_command(folder));
                let more =
                    more.map_or_else(String::new, |more| format!(", or go on with `{more}`"));
                say(message, &format!("{help}{more}"));
                1
            }
            Self::Points { table, .. } => {
                let help = format!("the column `status` of {} names them", table.display());
                say(&self.to_string(), &help);
                1
            }
            Self::Stopped { error, folder } => {
                let command = resume_command(folder);
                say(
                    &error.to_string(),
                    &format!("remove the cause, then continue with `{command}`"),
                );
                1
            }
            Self::Property(message) => {
                say(message, "see the remarks above and in the certificate");
                1
            }
            Self::Estimate { message, warned } => {
                let help = match warned {
                    true => "see the warnings above; all files are written",
                    false => "without -q warnings say what is wrong; all files are written",
                };
                say(message, help);
                1
            }
            Self::FitInterrupted { signal, file } => {
                let help = match file.as_os_str().is_empty() {
                    true => "no run was complete".to_owned(),
                    false => format!("{} has the last iterate", file.display()),
                };
                say(&self.to_string(), &help);
                128 + signal
            }
            Self::Data(error) => {
                say(&error.message, &error.help);
                3
            }
            Self::Output(error) => {
                say(&error.to_string(), error.remedy());
                match error {
                    OutputError::Occupied { .. } | OutputError::Foreign { .. } => 2,
                    _ => 1,
                }
            }
            Self::Memory { message } => {
                say(message, "write fewer bodies or elements, or take a machine with more memory");
                1
            }
            Self::Export(message) => {
                say(
                    message,
                    "run the model again with what is missing, or choose another --format",
                );
                1
            }
            Self::Library(message) => {
                say(message, &help_on_libraries());
                1
            }
            Self::Usage { message, help } => {
                say(message, help);
                2
            }
            Self::Model(invalid) => {
                invalid.print();
                3
            }
            Self::Import(error) => {
                print_import(error);
                3
            }
        }
    }
}

impl From<ContinueError> for Failure {
    fn from(error: ContinueError) -> Self {
        match error {
            ContinueError::Output(error) => Self::Output(error),
            other => Self::Usage {
                message: other.to_string(),
                help: "run the model again: `holonom run MODEL -o DIR --force`".into(),
            },
        }
    }
}

fn say(message: &str, help: &str) {
    stderr::line(&format!("error: {message}"));
    if !help.is_empty() {
        stderr::line(&format!("  help: {help}"));
    }
}

/// Prints why a description is not translated.
fn print_import(error: &ImportError) {
    match error {
        ImportError::Invalid { path, text, problems } => {
            diagnostic::print(path, text, problems, "cannot be imported");
        }
        ImportError::Refused { text, source } => {
            let path = Path::new("the translation");
            diagnostic::print(path, text, &source.problems(text), "is not a valid model");
        }
        ImportError::Read { path, source } => {
            diagnostic::print(path, "", &source.problems(""), "cannot be read");
        }
        other => stderr::line(&format!("error: {other}")),
    }
}
