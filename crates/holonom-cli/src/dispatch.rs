//! Which function carries out a verb.

use clap::CommandFactory;

use crate::arguments::{Cli, Verb};
use crate::failure::Failure;
use crate::{
    bench, check, compare, examples, export, gradient, identify, import, modes, optimize, plot,
    response, resume, run, schema, stdout, sweep, unit, verify, view,
};

/// Does what a verb asks for; the exit code.
pub(crate) fn code(verb: Verb) -> u8 {
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
        Verb::Response(arguments) => response::response(&arguments),
        Verb::Gradient(arguments) => gradient::gradient(&arguments),
        Verb::Optimize(arguments) => optimize::optimize(&arguments),
        Verb::Identify(arguments) => identify::identify(&arguments),
        Verb::Verify(arguments) => verify::verify(&arguments),
        Verb::View(arguments) => view::view(&arguments),
        Verb::Export(arguments) => export::export(&arguments),
        Verb::ExportFmu(arguments) => unit::export(&arguments),
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
