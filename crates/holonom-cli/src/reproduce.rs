//! The command of a call, as a shell reads it, for the pages that it writes.

use std::env::args_os;

/// What has no influence on results.
const LEFT_OUT: [&str; 4] = ["--force", "--json", "--quiet", "-q"];

/// The arguments of this call.
pub(crate) fn command() -> String {
    let arguments = args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned());
    let shown = arguments.filter(|argument| !LEFT_OUT.contains(&argument.as_str()));
    std::iter::once("holonom".to_owned())
        .chain(shown.map(|argument| quoted(&argument)))
        .collect::<Vec<_>>()
        .join(" ")
}

/// In quotes where a shell would read it otherwise.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/-._~:=,+%@".contains(c);
    match !argument.is_empty() && argument.chars().all(plain) {
        true => argument.to_owned(),
        false => format!("'{}'", argument.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn arguments_are_read_by_a_shell_as_they_were_given() {
        let quoted = ["a b", "load.pull.force=[0, 1]", "it's", "", "top.toml"].map(super::quoted);
        assert_eq!(quoted, ["'a b'", "'load.pull.force=[0, 1]'", r"'it'\''s'", "''", "top.toml"]);
    }
}
