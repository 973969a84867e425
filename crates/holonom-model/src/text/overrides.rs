//! Overrides: `--set body.top.mass=2.5`.

use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::problem::{Problem, nearest, some};
use super::sections::{LISTS, PARAMETERS, TABLES};

const HELP: &str =
    "keys are like simulation.step, model.gravity, body.NAME.mass, particle.NAME.position.0";
/// Parts of a key at most; no value of a model stands as deep.
const DEEPEST: usize = 64;

/// A key of a model and the value to set it to: `body.top.mass` and `2.5`. Serialized as a pair.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "[String; 2]", into = "[String; 2]")]
pub struct Override {
    /// The key, by the name of its component: `body.top.mass`, `simulation.step`.
    pub key: String,
    /// The value: TOML, or a bare word.
    pub value: String,
}

impl Override {
    /// Sets `key` to `value`.
    #[must_use]
    pub fn new(key: impl Into<String>, value: impl Into<String>) -> Self {
        Self { key: key.into(), value: value.into() }
    }
}

/// As `--set` takes it: `KEY=VALUE`.
impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.key, self.value)
    }
}

impl From<[String; 2]> for Override {
    fn from([key, value]: [String; 2]) -> Self {
        Self { key, value }
    }
}

impl From<Override> for [String; 2] {
    fn from(Override { key, value }: Override) -> Self {
        [key, value]
    }
}

/// Sets one key path to a value given as text: TOML, or a bare word.
pub(crate) fn set<'i>(
    table: &mut DeTable<'i>,
    key: &'i str,
    value: &'i str,
    base: usize,
) -> Result<(), Problem> {
    let parts = key.split('.').count();
    if parts > DEEPEST {
        let begin: String = key.chars().take(DEEPEST).collect();
        let message =
            format!("a key of {parts} parts: no value of a model stands deeper than {DEEPEST}");
        return Err(Problem::new(format!("{begin}…"), message).help(HELP));
    }
    let mut parsed = DeValue::parse(value)
        .unwrap_or_else(|_| Spanned::new(0..value.len(), DeValue::String(value.into())));
    shift(&mut parsed, base);
    let wrong = |message: String| Problem::new(key, message).help(HELP);
    let no_key = || {
        let problem = wrong(format!("`{key}` is no key of a value"));
        let parameters = table.get(PARAMETERS).and_then(|section| section.get_ref().as_table());
        match parameters.is_some_and(|parameters| parameters.contains_key(key)) {
            true => problem.help(format!("did you mean `{PARAMETERS}.{key}`?")),
            false => problem,
        }
    };
    let (section, rest) = key.split_once('.').ok_or_else(no_key)?;
    if TABLES.contains(&section) || section == PARAMETERS {
        let entry = table.entry(Spanned::new(base..base, DeString::from(section)));
        let entry =
            entry.or_insert_with(|| Spanned::new(base..base, DeValue::Table(DeTable::new())));
        return insert(entry, rest, parsed, base).map_err(wrong);
    }
    let Some(entries) = table.get_mut(section).filter(|v| v.get_ref().is_array()) else {
        let problem = wrong(format!("the model has no section `{section}`"));
        let known = TABLES.iter().chain(&LISTS).copied().chain([PARAMETERS]);
        return Err(match nearest(section, known) {
            Some(best) if best != section => problem.help(format!("did you mean `{best}`?")),
            _ => problem,
        });
    };
    let DeValue::Array(entries) = entries.get_mut() else { return Ok(()) };
    // A name may contain dots only if the file says so: take the longest that fits.
    let fits = |e: &Spanned<DeValue<'_>>| {
        let name = e.get_ref().get("name")?.get_ref().as_str()?;
        rest.strip_prefix(name)?.strip_prefix('.').map(|field| (name.len(), field))
    };
    let best =
        (0..entries.len()).filter_map(|i| Some((i, fits(&entries[i])?))).max_by_key(|b| b.1.0);
    if let Some((i, (_, field))) = best
        && let Some(entry) = entries.get_mut(i)
    {
        return insert(entry, field, parsed, base).map_err(wrong);
    }
    let word = rest.split('.').next().unwrap_or(rest);
    let names: Vec<&str> =
        entries.iter().filter_map(|e| e.get_ref().get("name")?.get_ref().as_str()).collect();
    let problem = wrong(format!("there is no {section} named `{word}`"));
    let counted = word.parse::<usize>().ok().and_then(|index| names.get(index).copied());
    Err(match counted.or_else(|| nearest(word, names.iter().copied())) {
        Some(best) => problem.help(format!("did you mean `{section}.{best}`?")),
        None if names.is_empty() => problem,
        None => problem.help(format!("there are: {}", some(&names))),
    })
}

/// Sets `path` (keys and array indices with dots between) below `value`.
fn insert<'i>(
    value: &mut Spanned<DeValue<'i>>,
    path: &'i str,
    new: Spanned<DeValue<'i>>,
    base: usize,
) -> Result<(), String> {
    let (head, rest) = path.split_once('.').map_or((path, None), |(h, r)| (h, Some(r)));
    let at = Spanned::new(base..base, DeString::from(head));
    let slot = match value.get_mut() {
        DeValue::Table(table) => table
            .entry(at)
            .or_insert_with(|| Spanned::new(base..base, DeValue::Table(DeTable::new()))),
        DeValue::Array(array) => {
            let count = array.len();
            let index = head.parse::<usize>().ok();
            index.and_then(|i| array.get_mut(i)).ok_or_else(|| {
                format!("`{head}` is no index into {count} values (they count from 0)")
            })?
        }
        _ => return Err(format!("`{head}` stands below a plain value")),
    };
    match rest {
        Some(rest) => insert(slot, rest, new, base),
        None => {
            *slot = new;
            Ok(())
        }
    }
}

/// Moves the spans of an override's value beyond the text, where they point at nothing.
fn shift(value: &mut Spanned<DeValue<'_>>, base: usize) {
    match value.get_mut() {
        DeValue::Array(array) => array.iter_mut().for_each(|v| shift(v, base)),
        DeValue::Table(table) => table.iter_mut().for_each(|(_, v)| shift(v, base)),
        _ => {}
    }
    let Range { start, end } = value.span();
    *value = Spanned::new(start + base..end + base, value.get_ref().clone());
}

#[cfg(test)]
mod tests {
    use super::Override;

    #[test]
    fn an_override_is_serialized_as_a_pair() {
        let heavier = Override::new("body.top.mass", "2.5");
        assert_eq!(heavier.to_string(), "body.top.mass=2.5");
        let written = serde_json::to_string(&heavier).unwrap();
        assert_eq!(written, r#"["body.top.mass","2.5"]"#);
        assert_eq!(serde_json::from_str::<Override>(&written).unwrap(), heavier);
    }
}
