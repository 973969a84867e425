//! The program `holonom`, see the library of this package.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    holonom_cli::main()
}
