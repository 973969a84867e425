//! Chores of the repository, one subcommand each: `cargo xtask TASK`.
//!
//! The convergence studies (`verify`) and the figures (`figures`) will live here. There is no task
//! yet, and asking for one is an error.

fn main() -> std::process::ExitCode {
    eprintln!("there is no such task; the order and invariant studies run under `cargo test`");
    std::process::ExitCode::from(2)
}
