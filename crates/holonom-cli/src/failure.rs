//! How a verb fails: messages and exit codes.

use std::path::PathBuf;
use std::process::ExitCode;

use holonom::RunFailure;
use holonom::output::OutputError;
use holonom::report::time;

use crate::diagnostic::InvalidModel;
use crate::stderr;

/// Why the program ends with a code other than 0.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// Code 1: the run did not reach its end; what was written stays. `files`: those not named yet.
    #[error("the run failed")]
    Run { failure: RunFailure, files: Vec<PathBuf> },
    /// Code 1: a property was measured and does not hold.
    #[error("{0}")]
    Property(String),
    /// Code 1: a file cannot be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Code 1: results cannot be exported.
    #[error("{0}")]
    Export(String),
    /// Code 2: the command asks for something that cannot be done.
    #[error("{message}")]
    Usage { message: String, help: String },
    /// Code 3: the model is invalid.
    #[error("the model is invalid")]
    Model(Box<InvalidModel>),
    /// Standard output was closed by its reader.
    #[error("standard output is closed")]
    Closed,
}

impl Failure {
    /// Tells the user, and gives the exit code.
    pub(crate) fn report(&self) -> ExitCode {
        let code = match self {
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
            Self::Property(message) => {
                say(message, "see the remarks above and in the certificate");
                1
            }
            Self::Output(error @ OutputError::Occupied { .. }) => {
                let help = "add --force to replace it, or choose another folder with -o DIR";
                say(&error.to_string(), help);
                2
            }
            Self::Output(error @ OutputError::Foreign { .. }) => {
                say(&error.to_string(), "move it away, or choose another folder with -o DIR");
                2
            }
            Self::Output(error) => {
                say(&error.to_string(), "");
                1
            }
            Self::Export(message) => {
                say(message, "");
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
        };
        ExitCode::from(code)
    }
}

fn say(message: &str, help: &str) {
    stderr::line(&format!("error: {message}"));
    if !help.is_empty() {
        stderr::line(&format!("  help: {help}"));
    }
}
