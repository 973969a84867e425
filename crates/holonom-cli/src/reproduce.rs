//! The command of a call, as a shell reads it, for the pages that it writes.

use std::env::args_os;

use holonom::report::command_line;

/// What has no influence on results.
const LEFT_OUT: [&str; 5] = ["--force", "--json", "--quiet", "-q", "--no-progress"];

/// The arguments of this call.
pub(crate) fn command() -> String {
    let arguments = args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned());
    let shown = arguments.filter(|argument| !LEFT_OUT.contains(&argument.as_str()));
    command_line(shown)
}
