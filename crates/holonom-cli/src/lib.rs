//! The program `holonom`: simulate constrained mechanical systems from a model file.
//!
//! Standard output carries data and `--json` only; people read standard error.
//! Exit codes: 0 done, 1 the run failed, 2 usage, 3 the model is invalid, 130 and 143 interrupted
//! by a signal.
//!
//! The program is [`main`]. [`Call`] is the same within another process: what it would print is
//! returned.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod arguments;
mod bench;
mod call;
mod captured;
mod check;
mod compare;
mod diagnostic;
mod dispatch;
mod examples;
mod export;
mod failure;
mod folder;
mod gradient;
mod human;
mod identify;
mod import;
mod input;
mod memory;
mod modes;
mod optimize;
mod picture;
mod plot;
mod progress;
mod reproduce;
mod response;
mod resume;
mod run;
mod schema;
mod signals;
mod stderr;
mod stdout;
mod sweep;
pub mod text;
pub mod unit;
mod unit_library;
mod verify;
mod view;

pub use call::Call;
pub use captured::Called;
pub use memory::shortage;

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use arguments::{Cli, Verb};

/// Does what the command line of this process asks for.
#[must_use]
pub fn main() -> ExitCode {
    ExitCode::from(main_with(std::env::args_os(), None))
}

/// The same with a command line, the name of the program first; the exit code. `package`: the
/// folder of the library of units, where the program is no file of its own.
#[must_use]
pub fn main_with(words: impl IntoIterator<Item = OsString>, package: Option<&Path>) -> u8 {
    let mut cli = match Cli::read(words) {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print(); // a closed terminal is no reason to fail differently
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    if let Verb::ExportFmu(arguments) = &mut cli.verb {
        arguments.package = package.map(Path::to_owned);
    }
    dispatch::code(cli.verb)
}
