//! Messages without what is particular: numbers and quoted names.

/// The text with every number as `#` and every quotation as `…`: messages of one kind have one
/// shape.
///
/// At most 160 characters.
#[must_use]
pub fn shape(message: &str) -> String {
    let mut out = String::new();
    let mut rest = message.chars().peekable();
    while let Some(c) = rest.next() {
        if out.len() > 160 {
            break;
        }
        if c == '`' || c == '"' {
            rest.by_ref().find(|other| *other == c);
            out.push('…');
        } else if c.is_ascii_digit() {
            while rest.next_if(|c| c.is_ascii_alphanumeric() || ".+-".contains(*c)).is_some() {}
            out.push('#');
        } else {
            out.push(if c.is_control() { ' ' } else { c });
        }
    }
    out.replace("-#", "#")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_one_kind_have_one_shape() {
        let a = shape("bar.rod: the length -1.5e-7 m of `rod` is not positive");
        assert_eq!(a, shape("bar.rod: the length 2 m of `other` is not positive"));
        assert_eq!(a, "bar.rod: the length # m of … is not positive");
        assert_ne!(a, shape("bar.rod: the mass 2 kg is not positive"));
        assert_eq!(shape("open `quotation"), "open …");
    }
}
