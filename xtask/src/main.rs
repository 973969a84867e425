//! Chores of the repository, one subcommand each: `cargo xtask TASK`.

use std::process::ExitCode;
use vi_testkit::CountingAllocator;
use xtask::{compare, figures, fuzz, notation, reliability, soak, stability, verify};

/// Measures the memory that an input of `fuzz` takes.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const USAGE: &str = "\
cargo xtask verify [--quick] [--only NAME] [--json FILE] [--from FILE] [--age]
                       measures every property on every system; a full run writes VERIFICATION.md;
                       --json: stores the readings, --from: writes the page from stored readings;
                       --age: of which commit that page is
cargo xtask compare [--quick [--only MODEL]]
                       variational and energy–momentum schemes on five models, into COMPARISON.md;
                       quick: a tenth of the steps, printed only
cargo xtask notation [--check]
                       renews the files and lines of all symbols and equations in NOTATION.md; check: fails
                       where they are out of date
cargo xtask stability [TABLE]
                       which steps of a rotating blade are stable, into docs/stability.md; TABLE: linear, runs
                       or scaling alone
cargo xtask soak [--count N] [--seed S] [--shard i/n] [--jobs J] [--quick] [-o DIR] [--json FILE] | --model FILE
                       random valid mechanisms, assembled, stepped and judged; those with a fault are reduced and
                       written into DIR (target/soak); --model: judges one model file
cargo xtask fuzz [TARGET…] [--executions N] [--seed S] [--jobs J] [-o DIR] [--json FILE]
                       mutated model files, checkpoints, tables, command lines; inputs with a fault into DIR
                       (target/fuzz)
cargo xtask reliability --soak FILE… --fuzz FILE…
                       writes RELIABILITY.md from what soak and fuzz stored by --json
cargo xtask figures    the figures of the article, into examples/leyendecker_2008";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        ["verify", options @ ..] => match verify::run(options) {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => ExitCode::FAILURE,
            Err(message) => {
                eprintln!("verify: {message}");
                ExitCode::from(2)
            }
        },
        ["compare", options @ ..] => match compare::run(options) {
            Ok(()) => ExitCode::SUCCESS,
            Err(message) => {
                eprintln!("compare: {message}");
                ExitCode::FAILURE
            }
        },
        ["notation", options @ ..] if options.iter().all(|o| *o == "--check") => {
            match notation::run(!options.is_empty()) {
                Ok(()) => ExitCode::SUCCESS,
                Err(message) => {
                    eprintln!("notation: {message}");
                    ExitCode::FAILURE
                }
            }
        }
        ["stability", only @ ..] if only.len() < 2 => match stability::run(only.first().copied()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(message) => {
                eprintln!("stability: {message}");
                ExitCode::FAILURE
            }
        },
        ["fuzz", options @ ..] => match fuzz::run(options) {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => ExitCode::FAILURE,
            Err(message) => {
                eprintln!("fuzz: {message}");
                ExitCode::from(2)
            }
        },
        ["soak", options @ ..] => match soak::run(options) {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => ExitCode::FAILURE,
            Err(message) => {
                eprintln!("soak: {message}");
                ExitCode::from(2)
            }
        },
        ["reliability", options @ ..] => match reliability::run(options) {
            Ok(()) => ExitCode::SUCCESS,
            Err(message) => {
                eprintln!("reliability: {message}");
                ExitCode::FAILURE
            }
        },
        ["figures"] => match figures::run() {
            Ok(()) => ExitCode::SUCCESS,
            Err(message) => {
                eprintln!("figures: {message}");
                ExitCode::FAILURE
            }
        },
        _ => {
            eprintln!("{USAGE}");
            ExitCode::from(2)
        }
    }
}
