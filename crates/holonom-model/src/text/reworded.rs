//! Messages of serde in the words of model files, with the nearest of the expected keys.

use super::problem::nearest;
use super::strict::{TABLE, wrong_length};
use super::syntax::number_help;
use super::wishes;
use crate::reference::ReferenceSection;

/// The quoted words of a message of serde.
pub(crate) fn quoted(message: &str) -> impl Iterator<Item = &str> {
    message.split('`').skip(1).step_by(2)
}

/// Words that others use for ours; the first of ours that is possible at the place is meant.
const SYNONYMS: [(&str, &str); 81] = [
    ("hinge", "revolute"),
    ("pin", "revolute"),
    ("pivot", "revolute"),
    ("continuous", "revolute"),
    ("ball", "spherical"),
    ("slider", "prismatic"),
    ("slide", "prismatic"),
    ("weld", "fixed"),
    ("rigid", "fixed"),
    ("hooke", "universal"),
    ("cardan", "universal"),
    ("helical", "screw"),
    ("cuboid", "box"),
    ("cube", "box"),
    ("capsule", "rod"),
    ("dt", "step"),
    ("rho", "density"),
    ("pos", "position"),
    ("quat", "quaternion"),
    ("rpy", "euler"),
    ("size", "dimensions"),
    ("extents", "dimensions"),
    ("radius", "dimensions"),
    ("length", "dimensions"),
    ("height", "dimensions"),
    ("torque", "effort"),
    ("kp", "proportional"),
    ("kd", "derivative"),
    ("timestep", "step"),
    ("duration", "end"),
    ("body1", "parent"),
    ("body2", "child"),
    ("body1", "from"),
    ("body2", "to"),
    ("body_a", "from"),
    ("body_b", "to"),
    ("body", "of"),
    ("joint", "of"),
    ("constraint", "of"),
    ("spring", "of"),
    ("bar", "of"),
    ("beam", "of"),
    ("load", "of"),
    ("particle", "of"),
    ("motor", "of"),
    ("point1", "point_from"),
    ("point2", "point_to"),
    ("anchor1", "anchor_parent"),
    ("anchor2", "anchor_child"),
    ("anchor", "position"),
    ("location", "position"),
    ("origin", "position"),
    ("force", "effort"),
    ("tension", "effort"),
    ("coordinate", "joint_coordinate"),
    ("angle", "joint_coordinate"),
    ("displacement", "joint_coordinate"),
    ("rate", "joint_rate"),
    ("speed", "velocity"),
    ("speed", "rate"),
    ("velocity", "rate"),
    ("orientation", "euler"),
    ("rotation", "euler"),
    ("omega", "angular_velocity"),
    ("follower", "frame"),
    ("direction", "axis"),
    ("diameter", "dimensions"),
    ("lengths", "dimensions"),
    ("k", "stiffness"),
    ("c", "damping"),
    ("damper", "damping"),
    ("l0", "natural_length"),
    ("rest_length", "natural_length"),
    ("free_length", "natural_length"),
    ("length", "natural_length"),
    ("colour", "color"),
    ("young", "E"),
    ("youngs_modulus", "E"),
    ("poisson", "nu"),
    ("segments", "elements"),
    ("nodes", "points"),
];

pub(crate) fn suggestion(word: &str, known: &[&str]) -> Option<String> {
    let is_meant =
        |(other, ours): &&(&str, &str)| other.eq_ignore_ascii_case(word) && known.contains(ours);
    let meant = SYNONYMS.iter().find(is_meant).map(|(_, ours)| *ours);
    if let Some(answer) = wishes::answer(word).filter(|_| meant.is_none()) {
        let known = if known.is_empty() {
            String::new()
        } else {
            format!(" (known: {})", known.join(", "))
        };
        return Some(format!("{answer}{known}"));
    }
    match meant.or_else(|| nearest(word, known.iter().copied())) {
        Some(best) => Some(format!("did you mean `{best}`? (known: {})", known.join(", "))),
        None if known.is_empty() => None,
        None => Some(format!("known: {}", known.join(", "))),
    }
}

/// Where a key stands that is none of those known at its place.
pub(crate) fn suggestion_of_key(word: &str, known: &[&str]) -> Option<String> {
    let here = suggestion(word, known)?;
    match ReferenceSection::with_key(word).filter(|_| here.starts_with("known: ")) {
        Some(section) => Some(format!("`{word}` is a key of {} ({here})", section.heading())),
        None => Some(here),
    }
}

/// The lengths in serde's "invalid length 4, expected …3…".
pub(crate) fn buffered_length(message: &str) -> Option<(usize, usize)> {
    let (found, expected) = message.strip_prefix("invalid length ")?.split_once(", expected ")?;
    let digits = expected.split(|c: char| !c.is_ascii_digit()).find(|word| !word.is_empty())?;
    Some((found.parse().ok()?, digits.parse().ok()?))
}

/// The text that stands where serde expects a number or a list, and what it expects.
pub(crate) fn text_instead(message: &str) -> Option<(&str, &str)> {
    message.strip_prefix("invalid type: string \"")?.rsplit_once("\", expected ")
}

/// The text that stands where serde expects a number.
pub(crate) fn text_for_number(message: &str) -> Option<&str> {
    let (text, expected) = text_instead(message)?;
    ["f64", "u64", "u32", "usize", "a number"].contains(&expected).then_some(text)
}

/// The section of a path, whose part may have no name: `body[0].mass`.
pub(crate) fn section_at(path: &str) -> Option<&'static ReferenceSection> {
    path.split(['.', '[']).next().and_then(ReferenceSection::of)
}

/// The type of the key at a path, in words.
fn kind_at(path: &str) -> Option<String> {
    let section = section_at(path)?;
    section.kind_of(path.rsplit('.').next()?).map(str::to_owned)
}

/// What serde says of a value that is no list, where one of this kind belongs.
fn list_expected(message: &str, kind: Option<&str>) -> (String, Option<String>) {
    let kind = kind.filter(|kind| kind.starts_with("list of ")).unwrap_or("list of numbers");
    let example = match kind.rsplit(' ').next() {
        Some("tables") => "[{ … }, { … }]",
        Some("names") => "[\"first\", \"second\"]",
        _ => "[0.0, 0.0, -9.81]",
    };
    let message = message.replace("expected a sequence", &format!("expected a {kind}"));
    (message, Some(format!("write a list such as {example}")))
}

/// What serde expects where a table belongs; that with a `type` is read through a buffer.
const TABLE_EXPECTED: [&str; 5] =
    [TABLE, "struct ", "a map", "internally tagged enum ", "variant identifier"];

/// What was found where a table belongs.
fn found_for_table(message: &str) -> Option<&str> {
    let (found, expected) = message.split_once(", expected ")?;
    TABLE_EXPECTED.iter().any(|own| expected.starts_with(own)).then_some(found)
}

/// What serde says of a value that is no table, where one belongs.
fn table_expected(found: &str, path: &str) -> (String, Option<String>) {
    let entry = path.rsplit('.').next().unwrap_or(path);
    let (key, is_listed) = match entry.split_once('[') {
        Some((key, _)) => (key, true),
        None => (entry, false),
    };
    let section = section_at(path);
    let form =
        section.and_then(|own| own.table_form(key)).unwrap_or_else(|| "{ NAME = … }".to_owned());
    let form = if is_listed { format!("[{form}]") } else { form };
    let found = found.replace("floating point", "number").replace("integer", "number");
    (format!("{found}, expected {TABLE}"), Some(format!("write `{key} = {form}`")))
}

/// serde's words about the value at a path in ours, with the nearest of the expected ones.
pub(crate) fn reworded(message: &str, path: &str) -> (String, Option<String>) {
    let words: Vec<&str> = quoted(message).collect();
    match (words.first(), message) {
        (Some(word), m) if m.starts_with("unknown field") => {
            (format!("unknown key `{word}`"), suggestion_of_key(word, &words[1..]))
        }
        (Some(word), m) if m.starts_with("unknown variant") => {
            (format!("unknown value `{word}`"), suggestion(word, &words[1..]))
        }
        (Some(word), m) if m.starts_with("missing field") => {
            (format!("the key `{word}` is missing"), Some(format!("add `{word} = …`")))
        }
        (_, m) if buffered_length(m).is_some() || m.ends_with("are needed") => {
            let message = buffered_length(m).map(|(found, expected)| wrong_length(found, expected));
            let message = message.unwrap_or_else(|| m.to_owned());
            let help = match message.split(' ').next().and_then(|count| count.parse::<usize>().ok())
            {
                Some(4..=6) => {
                    "write exactly as many entries as are needed; a decimal comma makes two of one: write 9.81, not 9,81"
                }
                _ => "write exactly as many entries as are needed",
            };
            let help = help.to_owned();
            (message, Some(help))
        }
        _ => {
            let message = &message.replace("invalid type: map", "invalid type: table");
            let message = &message.replace("invalid type: sequence", "invalid type: list");
            if let Some(found) = found_for_table(message) {
                return table_expected(found, path);
            }
            if message.ends_with("expected a sequence") {
                return list_expected(message, kind_at(path).as_deref());
            }
            if let Some((found, length)) = message.split_once(", expected an array of length ") {
                let help = "write a list in brackets, its entries separated by commas".to_owned();
                return (format!("{found}, expected a list of {length}"), Some(help));
            }
            if let Some(found) = message.strip_suffix(", expected a string") {
                let help = "write a name in quotes; what belongs to it, such as a point, has a key of its own".to_owned();
                return (format!("{found}, expected a name or another text"), Some(help));
            }
            let help = text_for_number(message).map(number_help);
            let message = message.replace("expected f64", "expected a number");
            let whole = "expected a whole number, 0 or more";
            let whole = |m: String, kind: &str| m.replace(&format!("expected {kind}"), whole);
            (["u64", "u32", "usize"].into_iter().fold(message, whole), help)
        }
    }
}
