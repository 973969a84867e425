//! What is wrong with the text of a model as TOML, and with words in the place of numbers: in which
//! way it can be put right.

use super::problem::Problem;
use super::sections::{LISTS, TABLES};
use crate::expression::evaluate;

/// What a line of a model file is.
const LINE: &str = "a line is `key = value`: texts in quotes, numbers with a decimal point and without units, lists in brackets";

/// An error of the TOML parser as a problem with a remedy.
pub(crate) fn problem(text: &str, error: &toml::de::Error) -> Problem {
    let message = error.message().lines().collect::<Vec<_>>().join("; ");
    let at = error.span().map_or(0, |span| span.start.min(text.len()));
    let line = line_at(text, at);
    let section = line.trim().strip_prefix('[').filter(|rest| !rest.starts_with('['));
    let section = section.and_then(|rest| rest.split(']').next()).map(str::trim);
    let (message, help) = match section {
        Some(name) if LISTS.contains(&name) && is_twice(&message) => (
            format!("[{name}] stands beside [[{name}]], or twice"),
            format!("write [[{name}]] with two brackets for each {name}"),
        ),
        Some(name) if TABLES.contains(&name) && is_twice(&message) => (
            format!("the section [{name}] stands twice"),
            format!("write all keys of [{name}] in one section"),
        ),
        _ if is_twice(&message) => (message, "write each key once in a section".to_owned()),
        _ => match (decimal_comma(line), unit_after_number(line)) {
            (Some(number), _) => (message, format!("numbers have a decimal point: write {number}")),
            (None, Some(number)) => (message, number_help(number)),
            (None, None) => (message, LINE.to_owned()),
        },
    };
    Problem::new("", message).help(help).at(error.span())
}

fn is_twice(message: &str) -> bool {
    message.contains("duplicate key")
}

/// The line of a byte.
fn line_at(text: &str, at: usize) -> &str {
    let bytes = text.as_bytes();
    let start = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
    let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(text.len(), |k| at + k);
    text.get(start..end).unwrap_or_default()
}

/// The value of a line without its comment.
fn value_of(line: &str) -> Option<&str> {
    let (_, value) = line.split_once('=')?;
    Some(value.split('#').next().unwrap_or(value).trim())
}

/// The number with a point that a line states with a comma: `step = 0,01`.
fn decimal_comma(line: &str) -> Option<String> {
    let (whole, fraction) = value_of(line)?.split_once(',')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let fraction = fraction.trim();
    (digits(whole.trim_start_matches(['-', '+'])) && digits(fraction))
        .then(|| format!("{whole}.{fraction}"))
}

/// The value of a line that is a number with a unit: `step = 10 ms`.
fn unit_after_number(line: &str) -> Option<&str> {
    let value = value_of(line)?;
    let (number, unit) = split(value);
    (number.parse::<f64>().is_ok() && is_word(unit)).then_some(value)
}

fn is_word(unit: &str) -> bool {
    !unit.is_empty() && unit.chars().all(|c| c.is_alphabetic() || "°%/²³^·*µ23-".contains(c))
}

/// A number and what follows it.
fn split(text: &str) -> (&str, &str) {
    let text = text.trim();
    let number = |(k, c): (usize, char)| {
        let exponent = matches!(c, 'e' | 'E')
            && text[k + 1..].starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c));
        let sign = matches!(c, '+' | '-') && (k == 0 || text[..k].ends_with(['e', 'E']));
        !(c.is_ascii_digit() || c == '.' || c == '_' || exponent || sign)
    };
    let end = text.char_indices().find(|place| number(*place)).map_or(text.len(), |(k, _)| k);
    (&text[..end], text[end..].trim())
}

/// Units that people write, and the factor and the divisor to those of SI.
const UNITS: [(&str, f64, f64); 38] = [
    ("s", 1.0, 1.0),
    ("sec", 1.0, 1.0),
    ("ms", 1.0, 1e3),
    ("us", 1.0, 1e6),
    ("µs", 1.0, 1e6),
    ("min", 60.0, 1.0),
    ("h", 3600.0, 1.0),
    ("m", 1.0, 1.0),
    ("cm", 1.0, 1e2),
    ("mm", 1.0, 1e3),
    ("um", 1.0, 1e6),
    ("µm", 1.0, 1e6),
    ("km", 1e3, 1.0),
    ("in", 0.0254, 1.0),
    ("inch", 0.0254, 1.0),
    ("ft", 0.3048, 1.0),
    ("kg", 1.0, 1.0),
    ("g", 1.0, 1e3),
    ("mg", 1.0, 1e6),
    ("t", 1e3, 1.0),
    ("lb", 0.453_592_37, 1.0),
    ("N", 1.0, 1.0),
    ("kN", 1e3, 1.0),
    ("MN", 1e6, 1.0),
    ("Nm", 1.0, 1.0),
    ("N/m", 1.0, 1.0),
    ("N/mm", 1e3, 1.0),
    ("Pa", 1.0, 1.0),
    ("kPa", 1e3, 1.0),
    ("MPa", 1e6, 1.0),
    ("GPa", 1e9, 1.0),
    ("Hz", 1.0, 1.0),
    ("rad", 1.0, 1.0),
    ("rad/s", 1.0, 1.0),
    ("m/s", 1.0, 1.0),
    ("m/s²", 1.0, 1.0),
    ("kg/m³", 1.0, 1.0),
    ("g/cm³", 1e3, 1.0),
];

/// What to write instead of a text where a number is needed.
pub(crate) fn number_help(text: &str) -> String {
    const NUMBER: &str = "write a number without quotes";
    let text = text.trim();
    let pointed = text.replacen(',', ".", 1);
    let (number, unit) = split(&pointed);
    let value = number.replace('_', "").parse::<f64>().ok().filter(|value| value.is_finite());
    let Some(value) = value else {
        let known = evaluate(text, &mut |name| Some(name.len() as f64)); // any values
        return match known {
            Ok(_) => format!("{NUMBER}, or an expression that begins with `=`: \"= {text}\""),
            Err(_) => {
                format!("{NUMBER}, or an expression that begins with `=`, such as \"= 2*length\"")
            }
        };
    };
    let decimal = if text.contains(',') { " and with a decimal point" } else { "" };
    let angle = ["deg", "°", "degree", "degrees"].contains(&unit);
    if unit.is_empty() {
        return format!("{NUMBER}{decimal}: {number}");
    }
    if evaluate(text, &mut |name| Some(name.len() as f64)).is_ok() {
        return format!("{NUMBER}, or an expression that begins with `=`: \"= {text}\"");
    }
    if angle || unit.starts_with("deg/") || unit.starts_with("°/") {
        return format!("angles are in rad: write \"= {number}*deg\"");
    }
    if ["rpm", "1/min", "U/min"].contains(&unit) {
        return format!("rates are in rad/s: write \"= {number}*2*pi/60\"");
    }
    if let Some((_, factor, divisor)) = UNITS.iter().find(|(name, ..)| *name == unit) {
        return format!("{NUMBER}, in SI units: {}", value * factor / divisor);
    }
    let reason = if is_word(unit) { ", in SI units, without the name of a unit" } else { "" };
    format!("{NUMBER}{reason}, or an expression that begins with `=`, such as \"= 2*length\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_written_as_texts() {
        for (text, help) in [
            ("10 ms", "write a number without quotes, in SI units: 0.01"),
            ("10ms", "in SI units: 0.01"),
            ("7 mm", "in SI units: 0.007"),
            ("2,5 kg", "in SI units: 2.5"),
            ("210 GPa", "in SI units: 210000000000"),
            ("90 deg", "\"= 90*deg\""),
            ("-45°", "\"= -45*deg\""),
            ("30 deg/s", "\"= 30*deg\""),
            ("600 rpm", "\"= 600*2*pi/60\""),
            ("0,01", "with a decimal point: 0.01"),
            ("1e-3", "without quotes: 1e-3"),
            ("3 furlongs", "without the name of a unit"),
            ("2*length", "\"= 2*length\""),
            ("2 length", "without the name of a unit"),
            ("heavy", "\"= heavy\""),
            ("heavy metal", "such as \"= 2*length\""),
            ("", "such as \"= 2*length\""),
        ] {
            let found = number_help(text);
            assert!(found.contains(help), "{text}: {found}");
            assert!(!found.contains("\"= 10 ms"), "{text}: {found}");
        }
    }

    fn of(text: &str) -> Problem {
        problem(text, &toml::de::DeTable::parse(text).expect_err("it is no TOML"))
    }

    #[test]
    fn slips_of_toml_are_answered() {
        for (text, message, help) in [
            (
                "[[body]]\nname = \"a\"\n[body]\nname = \"b\"\n",
                "[body] stands",
                "write [[body]] with two",
            ),
            ("[model]\nname = \"a\"\n[model]\ndimension = 3\n", "stands twice", "in one section"),
            ("[model]\nname = \"a\"\nname = \"b\"\n", "duplicate key", "each key once"),
            ("[simulation]\nstep = 0,01\nend = 1.0\n", "", "write 0.01"),
            ("[simulation]\nend = -12,5 # s\n", "", "write -12.5"),
            ("[simulation]\nstep = 10 ms\n", "", "in SI units: 0.01"),
            ("[simulation]\nstep 0.01\n", "", "`key = value`"),
            ("[simulation\nstep = 0.01\n", "", "`key = value`"),
            ("[model]\nname = bob\n", "", "texts in quotes"),
            ("[model]\nname = \"é", "", "texts in quotes"),
        ] {
            let found = of(text);
            println!("{}: {:?}", found.message, found.help);
            assert!(found.message.contains(message), "{text}: {}", found.message);
            assert!(
                found.help.as_deref().is_some_and(|found| found.contains(help)),
                "{text}: {:?}",
                found.help
            );
        }
    }
}
