//! The program `holonom`: simulate constrained mechanical systems from a model file.
//!
//! Standard output carries data and `--json` only; people read standard error.
//! Exit codes: 0 done, 1 the run failed, 2 usage, 3 the model is invalid, 130 and 143 interrupted by a signal.
//!
//! The program is [`main`]. [`Call`] is the same within another process: what it would print is returned.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod arguments;
mod bench;
mod captured;
mod check;
mod compare;
mod diagnostic;
mod examples;
mod export;
mod failure;
mod human;
mod import;
mod input;
mod modes;
mod picture;
mod plot;
mod progress;
mod reproduce;
mod resume;
mod run;
mod schema;
mod signals;
mod stderr;
mod stdout;
mod sweep;
mod verify;
mod view;

pub use captured::{Call, Called};

use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use arguments::{Cli, Verb};
use failure::Failure;

/// Does what the command line of this process asks for.
#[must_use]
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print(); // a closed terminal is no reason to fail differently
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    ExitCode::from(code(cli.verb))
}

/// Does what a verb asks for; the exit code.
fn code(verb: Verb) -> u8 {
    dispatch(verb).map_or_else(|failure| failure.report(), |()| 0)
}

fn dispatch(verb: Verb) -> Result<(), Failure> {
    match verb {
        Verb::Run(arguments) => run::run(&arguments),
        Verb::Resume(arguments) => resume::resume(&arguments),
        Verb::Sweep(arguments) => sweep::sweep(&arguments),
        Verb::Collect(arguments) => sweep::collect(&arguments),
        Verb::Check(arguments) => check::check(&arguments),
        Verb::Compare(arguments) => compare::compare(&arguments),
        Verb::Bench(arguments) => bench::bench(&arguments),
        Verb::Modes(arguments) => modes::modes(&arguments),
        Verb::Verify(arguments) => verify::verify(&arguments),
        Verb::View(arguments) => view::view(&arguments),
        Verb::Export(arguments) => export::export(&arguments),
        Verb::Plot(arguments) => plot::plot(&arguments),
        Verb::Import(arguments) => import::import(&arguments),
        Verb::Schema(arguments) => schema::schema(&arguments),
        Verb::Examples(arguments) => examples::examples(&arguments),
        Verb::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "holonom", &mut script);
            stdout::bytes(&script)
        }
    }
}
