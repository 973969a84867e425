//! Chores of the repository, one subcommand each: `cargo xtask TASK`.

use holonom_reliability::{self as reliability, fuzz, interrupt, soak};
use std::process::ExitCode;
use vi_testkit::CountingAllocator;
use xtask::program::cargo;
use xtask::{compare, figures, mutants, notation, roundoff, stability, verify};

/// Measures the memory that an input of `fuzz` takes.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const USAGE: &str = "\
cargo xtask verify [--quick] [--only NAME] [--criterion NAME] [--json FILE] [--from FILE] [--age]
                       measures every property on every system; a full run writes VERIFICATION.md
                       and docs/verification;
                       --json: stores the readings, --from: writes the page from stored readings;
                       --age: of which commit that page is
cargo xtask mutants [--only NAME]
                       plants defects in a copy of the sources, one at a time, and runs the test that names each,
                       into docs/verification/mutants.md; NAME: those whose names hold it
cargo xtask compare [--quick [--only MODEL]]
                       variational and energy–momentum schemes on five models, into COMPARISON.md;
                       quick: a tenth of the steps, printed only
cargo xtask notation [--check]
                       renews the files and lines of all symbols and equations in NOTATION.md; check: fails
                       where they are out of date
cargo xtask stability [TABLE]
                       which steps of a rotating blade are stable, into docs/stability.md; TABLE: linear, runs
                       or scaling alone
cargo xtask roundoff [--of MODEL] [--parts N]
                       how rounding errors add up over up to 100 million steps, into docs/round-off.md; MODEL: its
                       rows alone, N: an N-th of the steps, printed only
cargo xtask soak [--count N] [--seed S] [--shard i/n] [--jobs J] [--quick] [--restated] [--touching] [--failures] [-o DIR] [--json FILE] | --model FILE | --growth
                       random valid mechanisms, assembled, stepped and judged; those with a fault are reduced and
                       written into DIR (target/soak); --restated: all are also turned, moved, reordered and
                       stated in other units, not one of 32; --touching: bodies of all shapes that touch; --failures:
                       the first mechanism of each reason for refused steps is reduced, too; --model: judges one model
                       file; --growth: the times of steps of large mechanisms with one member more
cargo xtask fuzz [TARGET…] [--executions N] [--seed S] [--shard i/n] [--jobs J] [-o DIR] [--json FILE]
                       mutated model files, checkpoints, tables, command lines; inputs with a fault into DIR
                       (target/fuzz)
cargo xtask interrupt [--count N] [--seed S] [--shard i/n] [--jobs J] [--json FILE]
                       runs that are killed, interrupted, without space, damaged, two at once, and continued to the end
cargo xtask reliability [--soak FILE…] [--touching FILE…] [--fuzz FILE…] [--interrupt FILE…]
                       writes RELIABILITY.md from what these stored by --json; the section of one without a file
                       stays as it is
cargo xtask figures    the figures of the article, into examples/leyendecker_2008";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let [task, options @ ..] = arguments.as_slice() else { return usage() };
    if cfg!(panic = "abort") && ["soak", "fuzz"].contains(task) {
        return unwinding(&arguments);
    }
    let done = match (*task, options) {
        ("verify", _) => verify::run(options),
        ("fuzz", _) => fuzz::run(options),
        ("soak", _) => soak::run(options),
        ("interrupt", _) => interrupt::run(options),
        ("reliability", _) => reliability::run(options).map(|()| true),
        ("mutants", _) => mutants::run(options),
        ("compare", _) => compare::run(options).map(|()| true),
        ("roundoff", _) => roundoff::run(options).map(|()| true),
        ("notation", [] | ["--check"]) => notation::run(!options.is_empty()).map(|()| true),
        ("stability", [] | [_]) => stability::run(options.first().copied()).map(|()| true),
        ("figures", []) => figures::run().map(|()| true),
        _ => return usage(),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("{task}: {message}");
            ExitCode::from(2)
        }
    }
}

/// The same task in a build that unwinds, the program beside it: it goes on after a panic, which it
/// counts.
fn unwinding(arguments: &[&str]) -> ExitCode {
    let cargo = |verb: &str, rest: &[&str]| {
        let build = [verb, "--quiet", "--profile", "unwinding", "--package", "xtask"];
        cargo().args(build).args(rest).status()
    };
    let built = cargo("build", &["--package", "holonom-cli"]);
    let done = built.and_then(|built| match built.success() {
        true => cargo("run", &[&["--"], arguments].concat()),
        false => Ok(built),
    });
    match done {
        Ok(status) => status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1).into(),
        Err(error) => {
            eprintln!("cargo build --profile unwinding: {error}");
            ExitCode::from(2)
        }
    }
}

fn usage() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}
