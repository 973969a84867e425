//! Commands of the program as a shell reads them.

/// The program with its arguments.
#[must_use]
pub fn command_line(arguments: impl IntoIterator<Item = String>) -> String {
    let arguments = arguments.into_iter().map(|argument| quoted(&argument));
    std::iter::once("holonom".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

/// In quotes where a shell would read it otherwise.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/-._:=,+%@".contains(c);
    match !argument.is_empty() && argument.chars().all(plain) {
        true => argument.to_owned(),
        false => format!("'{}'", argument.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn arguments_are_read_by_a_shell_as_they_were_given() {
        let given = ["a b", "load.pull.force=[0, 1]", "it's", "", "top.toml", "~"];
        let found = super::command_line(given.map(str::to_owned));
        assert_eq!(found, r"holonom 'a b' 'load.pull.force=[0, 1]' 'it'\''s' '' top.toml '~'");
    }
}
