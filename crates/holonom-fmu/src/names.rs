//! Names of variables by the convention `structured` of the standard.
//!
//! ```text
//! name = part {"." part}     part = letter {letter | digit | "_"}  or  "'" any of ASCII "'"
//! ```

/// A part of a name: as it is, or in quotes.
#[must_use]
pub fn part(name: &str) -> String {
    let plain =
        |(k, c): (usize, char)| c == '_' || c.is_ascii_alphabetic() || k > 0 && c.is_ascii_digit();
    if !name.is_empty() && name.chars().enumerate().all(plain) {
        return name.to_owned();
    }
    let mut quoted = String::from("'");
    for c in name.chars() {
        if matches!(c, '\'' | '"' | '\\' | '?') {
            quoted.push('\\');
        }
        quoted.push(c);
    }
    quoted.push('\'');
    quoted
}

/// A name of parts; empty ones are left out.
#[must_use]
pub fn structured(parts: &[&str]) -> String {
    let parts = parts.iter().filter(|own| !own.is_empty());
    parts.map(|own| part(own)).collect::<Vec<_>>().join(".")
}

/// A key path as a name, part by part.
#[must_use]
pub fn of_key(key: &str) -> String {
    structured(&key.split('.').collect::<Vec<_>>())
}

/// Whether a name can be written by the convention: it knows no letters beyond ASCII.
#[must_use]
pub fn is_structured(name: &str) -> bool {
    name.chars().all(|c| c == ' ' || c.is_ascii_graphic())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_quoted_where_they_must_be() {
        assert_eq!(structured(&["arm", "x"]), "arm.x");
        assert_eq!(structured(&["hook load", "x"]), "'hook load'.x");
        assert_eq!(structured(&["a'b", ""]), r"'a\'b'");
        assert_eq!(of_key("body.arm.inertia.0"), "body.arm.inertia.'0'");
        assert!(is_structured("'hook load'.x") && !is_structured("Lenkergröße"));
    }
}
