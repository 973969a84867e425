//! The text of a model: sections, spans of every value, overrides by key path.
//!
//! Key paths name components: `body.top.mass`, `model.gravity`, `particle.bob.position.0`.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::include::{self, ModelText};
use super::key_path::below;
use super::overrides::{Override, set};
use super::parameters;
use super::problem::{MAX_PROBLEMS, ModelError, Problem, nearest};
use super::reworded::{
    buffered_length, quoted, reworded, section_at, suggestion_of_key, text_instead,
};
use super::sections::{LISTS, PARAMETERS, TABLES};
use super::strict::{Strict, list_of, no_table};
use super::syntax;
use super::tangents::{ParameterTangent, tangents};
use super::wishes;
use crate::reference::ReferenceSection;

/// Numbers beyond this are refused.
pub(crate) const HUGE: f64 = 1e100;

/// The places of a key and of its value.
#[derive(Clone)]
struct KeyPlace {
    key: Range<usize>,
    value: Range<usize>,
}

/// A parsed model text.
pub(crate) struct Document<'i> {
    table: DeTable<'i>,
    places: OnceCell<BTreeMap<String, KeyPlace>>, // found when a problem asks for one
    labels: BTreeMap<&'static str, Vec<String>>,
    length: usize,
}

impl<'i> Document<'i> {
    /// Parses the text, sets the overrides and puts `values` in the place of the expressions.
    pub(crate) fn parse(
        text: &'i str,
        overrides: &'i [Override],
        values: &'i [String],
    ) -> Result<Self, Vec<Problem>> {
        let mut table = plain(text)?;
        replace(&mut table, text.len(), overrides)?;
        parameters::substitute(&mut table, values);
        let labels: BTreeMap<_, _> = LISTS.iter().map(|&s| (s, labels(&table, s))).collect();
        Ok(Self { table, places: OnceCell::new(), labels, length: text.len() })
    }

    /// The place of every key path.
    fn places(&self) -> &BTreeMap<String, KeyPlace> {
        self.places.get_or_init(|| places(&self.table, &self.labels))
    }

    /// The place of a value: of the key itself, or of the nearest key above that exists.
    pub(crate) fn span(&self, path: &str) -> Option<Range<usize>> {
        let mut path = path;
        loop {
            if let Some(place) = self.places().get(path) {
                return self.inside(place.value.clone());
            }
            path = &path[..path.rfind(['.', '['])?];
        }
    }

    /// The path of a component: by name, or by number when its name is missing or not its own.
    pub(crate) fn label(&self, section: &str, index: usize) -> &str {
        self.labels.get(section).and_then(|l| l.get(index)).map_or("", String::as_str)
    }

    /// Numbers that no model may contain: not finite, or huge.
    pub(crate) fn bad_numbers(&self) -> Vec<Problem> {
        let mut problems = Vec::new();
        let fault =
            |value: &Spanned<DeValue<'_>>| fault_of_number(value.get_ref()).map(|_| value.span());
        if self.table.values().all(|value| first_place(value, &fault).is_none()) {
            return problems; // no path is written for nothing
        }
        walk(&self.table, &self.labels, &mut |path, _, value| {
            let fault = fault_of_number(value.get_ref());
            let Some(fault) = fault.filter(|_| problems.len() < MAX_PROBLEMS) else { return };
            let help = format!("write a finite number of magnitude at most {HUGE:e}");
            problems.push(Problem::new(path, fault).help(help).at(self.inside(value.span())));
        });
        problems
    }

    /// Orientations by angles of more than a turn: remarks on them.
    pub(crate) fn turns(&self) -> Vec<String> {
        let mut found = Vec::new();
        walk(&self.table, &self.labels, &mut |path, _, value| {
            let vector = path.ends_with(".rotation_vector");
            if !vector && !path.ends_with(".euler.angles") {
                return;
            }
            let number = |value: &Spanned<DeValue<'_>>| match value.get_ref() {
                DeValue::Float(float) => float.as_str().parse().ok(),
                DeValue::Integer(integer) => integer.as_str().parse().ok(),
                _ => None,
            };
            let angles: Vec<f64> =
                value.get_ref().as_array().into_iter().flatten().filter_map(number).collect();
            let angle = match vector {
                true => angles.iter().map(|x| x * x).sum::<f64>().sqrt(),
                false => angles.iter().fold(0.0, |most: f64, x| most.max(x.abs())),
            };
            if angle > std::f64::consts::TAU && found.len() < MAX_PROBLEMS {
                let instead = match vector {
                    true => "\"= 90*deg\"",
                    false => "`degrees` instead of `angles`",
                };
                found.push(format!(
                    "`{path}` is {angle:.1} rad: more than a turn; for degrees write {instead}"
                ));
            }
        });
        found
    }

    /// Sections that do not exist.
    pub(crate) fn unknown_sections(&self) -> Vec<Problem> {
        let known = || TABLES.iter().chain(&LISTS).copied().chain([PARAMETERS]);
        let unknown = self.table.keys().filter(|key| known().all(|k| k != key.get_ref().as_ref()));
        let problem = |key: &Spanned<std::borrow::Cow<'_, str>>| {
            let name = key.get_ref();
            if name.as_ref() == include::KEY {
                let message =
                    "a text alone includes no files: they are relative to that of the model";
                let problem = Problem::new(name.as_ref(), message).at(self.inside(key.span()));
                return problem.help("read the model from its file");
            }
            let help = match (wishes::answer_to_section(name), nearest(name, known())) {
                (Some(answer), _) => answer.to_owned(),
                (None, Some(best)) => format!("did you mean `{best}`?"),
                (None, None) => {
                    let sections =
                        format!("sections are {}", known().collect::<Vec<_>>().join(", "));
                    match ReferenceSection::with_key(name) {
                        Some(section) => {
                            format!("`{name}` is a key of {} ({sections})", section.heading())
                        }
                        None => sections,
                    }
                }
            };
            Problem::new(name.as_ref(), format!("unknown section `{name}`"))
                .help(help)
                .at(self.inside(key.span()))
        };
        unknown.take(MAX_PROBLEMS).map(problem).collect()
    }

    /// Reads a section that is one table.
    pub(crate) fn table<T: DeserializeOwned>(
        &self,
        section: &str,
        problems: &mut Vec<Problem>,
    ) -> Option<T> {
        let Some(value) = self.table.get(section) else {
            let problem = Problem::new(section, format!("the section [{section}] is missing"));
            let example = match section {
                "model" => "[model]\nname = \"my model\"",
                _ => "[simulation]\nstep = 0.01\nend = 10.0",
            };
            problems.push(problem.help(format!("add\n{example}")));
            return None;
        };
        self.read(section, value, problems)
    }

    /// Reads a section that is one table, where there is one.
    pub(crate) fn optional_table<T: DeserializeOwned>(
        &self,
        section: &str,
        problems: &mut Vec<Problem>,
    ) -> Option<T> {
        self.read(section, self.table.get(section)?, problems)
    }

    /// Reads a section that is a list; entries that cannot be read are left out.
    pub(crate) fn list<T: DeserializeOwned>(
        &self,
        section: &str,
        problems: &mut Vec<Problem>,
    ) -> Vec<T> {
        let Some(value) = self.table.get(section) else { return Vec::new() };
        let Some(entries) = value.get_ref().as_array() else {
            problems.push(
                Problem::new(section, format!("`{section}` must be a list of tables"))
                    .help(format!("write [[{section}]] with two brackets"))
                    .at(self.inside(value.span())),
            );
            return Vec::new();
        };
        let mut list = Vec::new();
        for (i, entry) in entries.iter().enumerate() {
            if problems.len() < MAX_PROBLEMS {
                list.extend(self.read(self.label(section, i), entry, problems));
            }
        }
        list
    }

    fn read<T: DeserializeOwned>(
        &self,
        path: &str,
        value: &Spanned<DeValue<'i>>,
        problems: &mut Vec<Problem>,
    ) -> Option<T> {
        let misplaced = self.no_tables(path, value);
        if !misplaced.is_empty() {
            problems.extend(misplaced);
            return None;
        }
        match T::deserialize(Strict(value)) {
            Ok(entry) => Some(entry),
            Err(error) => {
                let mut span = error.span.unwrap_or_else(|| value.span());
                if span == value.span() {
                    span = meant(value, &error.message).unwrap_or(span);
                }
                if let Some(table) = table_with_key(value, &span) {
                    problems.extend(self.unknown_keys(path, table, &error.message));
                    return None;
                }
                if let Some((found, _)) = buffered_length(&error.message) {
                    span = list_of(value, found).unwrap_or(span);
                }
                problems.push(self.problem_at(path, &error.message, span));
                None
            }
        }
    }

    /// A message of serde about what stands at a place of a part, in our words.
    fn problem_at(&self, path: &str, message: &str, span: Range<usize>) -> Problem {
        let key = self.path_at(path, &span);
        let (message, help) = reworded(message, &key);
        Problem { help, ..Problem::new(key, message).at(self.inside(span)) }
    }

    /// What is no table, where the keys of a section have one: tables with a `type` are read
    /// through a buffer, which takes entries of a list for keys in their order.
    fn no_tables(&self, path: &str, value: &Spanned<DeValue<'i>>) -> Vec<Problem> {
        let (Some(section), DeValue::Table(table)) = (section_at(path), value.get_ref()) else {
            return Vec::new();
        };
        let problem = |(key, value): (&Spanned<DeString<'_>>, &Spanned<DeValue<'_>>)| {
            let value = Some(value).filter(|_| section.has_table(key.get_ref()))?;
            Some(self.problem_at(path, &no_table(value.get_ref())?, value.span()))
        };
        table.iter().filter_map(problem).collect()
    }

    /// All keys of a table that serde's message does not list.
    fn unknown_keys(&self, path: &str, table: &DeTable<'_>, message: &str) -> Vec<Problem> {
        let mut words = quoted(message);
        let tag = words.next().filter(|word| *word != TAG).and(Some(TAG));
        let known: Vec<&str> = words.collect();
        let is_known = |key: &str| known.contains(&key) || tag == Some(key);
        let unknown = table.keys().filter(|key| !is_known(key.get_ref().as_ref()));
        let problem = |key: &Spanned<DeString<'_>>| {
            let name = key.get_ref();
            let place = self.path_at(path, &key.span());
            let mut problem = Problem::new(place, format!("unknown key `{name}`"));
            problem.help = suggestion_of_key(name, &known);
            problem.at(self.inside(key.span()))
        };
        unknown.take(MAX_PROBLEMS).map(problem).collect()
    }

    /// The path below `path` whose key or value is at `span`, or the smallest around it.
    fn path_at(&self, path: &str, span: &Range<usize>) -> String {
        let around = self.places().range(path.to_owned()..).take_while(|p| p.0.starts_with(path));
        around
            .filter(|(_, p)| {
                p.key == *span || p.value.start <= span.start && span.end <= p.value.end
            })
            .min_by_key(|(_, p)| if p.key == *span { 0 } else { p.value.len() })
            .map_or_else(|| path.to_owned(), |p| p.0.clone())
    }

    /// A span of the file; `None` when it belongs to an override.
    fn inside(&self, span: Range<usize>) -> Option<Range<usize>> {
        (span.end <= self.length).then_some(span)
    }
}

/// Values of the expressions of a text with overrides, for [`Document::parse`].
pub(crate) fn values_of_expressions(
    text: &str,
    overrides: &[Override],
) -> Result<Vec<String>, Vec<Problem>> {
    if !parameters::concern(text, overrides) {
        return Ok(Vec::new());
    }
    let mut table = plain(text)?;
    let own = parameters::stated(&table);
    replace(&mut table, text.len(), overrides)?;
    let set = overrides.iter().filter_map(|one| one.key.strip_prefix(PARAMETERS));
    let set: Vec<&str> = set.filter_map(|key| key.strip_prefix('.')).collect();
    parameters::values(table, &own, &set).map_err(|problems| inside(text, problems))
}

impl ModelText {
    /// How the numbers of the model change with its parameters, values replaced as for
    /// [`Self::model`].
    ///
    /// # Errors
    /// [`ModelError`]: an expression has no derivative there.
    pub fn parameter_tangents(
        &self,
        overrides: &[Override],
    ) -> Result<Vec<ParameterTangent>, ModelError> {
        self.tangents_of(overrides, &[])
    }

    /// The same, and after the parameters the numbers of the file among `names`, by their keys:
    /// `body.arm.mass`. A name without a point is a parameter.
    ///
    /// # Errors
    /// [`ModelError`]: an expression has no derivative there, or no number stands at a key.
    pub fn tangents_of(
        &self,
        overrides: &[Override],
        names: &[String],
    ) -> Result<Vec<ParameterTangent>, ModelError> {
        let keys: Vec<&str> =
            names.iter().map(String::as_str).filter(|name| name.contains('.')).collect();
        tangents_of_parameters(self.text()?, overrides, &keys).map_err(ModelError::invalid)
    }
}

/// How the numbers of a text with overrides change with its parameters, and with numbers at `keys`.
fn tangents_of_parameters(
    text: &str,
    overrides: &[Override],
    keys: &[&str],
) -> Result<Vec<ParameterTangent>, Vec<Problem>> {
    let mut table = plain(text)?;
    replace(&mut table, text.len(), overrides)?;
    tangents(table, keys).map_err(|problems| inside(text, problems))
}

/// Without the places of overrides, which are not in the file.
fn inside(text: &str, mut problems: Vec<Problem>) -> Vec<Problem> {
    let inside = |span: &Range<usize>| span.end <= text.len();
    problems.iter_mut().for_each(|problem| problem.span = problem.span.take().filter(inside));
    problems
}

/// The text as a table.
fn plain(text: &str) -> Result<DeTable<'_>, Vec<Problem>> {
    Ok(DeTable::parse(text).map_err(|error| vec![syntax::problem(text, &error)])?.into_inner())
}

/// Puts the values of overrides into the table of a text of `length` bytes.
fn replace<'i>(
    table: &mut DeTable<'i>,
    length: usize,
    overrides: &'i [Override],
) -> Result<(), Vec<Problem>> {
    let mut problems = Vec::new();
    let mut base = length + 1;
    for Override { key, value } in overrides {
        problems.extend(set(table, key, value, base).err());
        base += value.len() + 1;
    }
    if problems.is_empty() { Ok(()) } else { Err(problems) }
}

/// Why no model may contain this number.
fn fault_of_number(value: &DeValue<'_>) -> Option<String> {
    let number = match value {
        DeValue::Float(float) => float.as_str().parse().unwrap_or(f64::NAN),
        DeValue::Integer(integer) => integer.as_str().parse().unwrap_or(0.0),
        _ => return None,
    };
    if number.is_nan() {
        return Some("this is not a number: nan".to_owned());
    }
    (number.abs() > HUGE).then(|| format!("the number is too large: {}", written(value)))
}

fn written(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Float(float) => float.as_str().to_owned(),
        DeValue::Integer(integer) => {
            let digits = integer.as_str();
            if digits.len() <= 24 { digits.to_owned() } else { format!("{}…", &digits[..24]) }
        }
        _ => String::new(),
    }
}

/// Paths of the components of a list, by name where the name is the component's own.
fn labels(table: &DeTable<'_>, section: &str) -> Vec<String> {
    let entries = table.get(section).and_then(|v| v.get_ref().as_array());
    let mut seen = BTreeSet::new();
    let label = |(i, entry): (usize, &Spanned<DeValue<'_>>)| {
        let name = entry.get_ref().get("name").and_then(|n| n.get_ref().as_str());
        match name {
            Some(name) if !name.is_empty() && seen.insert(name.to_owned()) => {
                format!("{section}.{name}")
            }
            _ => format!("{section}[{i}]"),
        }
    };
    entries.map(|e| e.iter().enumerate().map(label).collect()).unwrap_or_default()
}

type Labels = BTreeMap<&'static str, Vec<String>>;

/// Of a key path: the path, the place of the key, the value.
type Visit<'a, 'i> = &'a mut dyn FnMut(&str, &Range<usize>, &Spanned<DeValue<'i>>);

/// Visits every key path of a text.
fn walk<'i>(table: &DeTable<'i>, labels: &Labels, visit: Visit<'_, 'i>) {
    for (key, value) in table {
        walk_value(&mut key.get_ref().to_string(), key.span(), value, labels, visit);
    }
}

/// Visits every key path at and below `value`.
fn walk_value<'i>(
    path: &mut String,
    key: Range<usize>,
    value: &Spanned<DeValue<'i>>,
    labels: &Labels,
    visit: Visit<'_, 'i>,
) {
    visit(path, &key, value);
    match value.get_ref() {
        DeValue::Table(table) => {
            for (k, v) in table {
                let end = format_args!(".{}", k.get_ref());
                below(path, end, |path| walk_value(path, k.span(), v, labels, visit));
            }
        }
        DeValue::Array(array) => {
            let (section, labels_of_parts) = (path.len(), labels.get(path.as_str()));
            for (i, v) in array.iter().enumerate() {
                let walk = |path: &mut String| walk_value(path, v.span(), v, labels, visit);
                match labels_of_parts.and_then(|labels| labels.get(i)) {
                    Some(label) => below(path, &label[section..], walk),
                    None => below(path, format_args!("[{i}]"), walk),
                }
            }
        }
        _ => {}
    }
}

fn places(table: &DeTable<'_>, labels: &Labels) -> BTreeMap<String, KeyPlace> {
    let mut places = BTreeMap::new();
    walk(table, labels, &mut |path, key, value| {
        places.insert(path.to_owned(), KeyPlace { key: key.clone(), value: value.span() });
    });
    places
}

/// The table at or below `value` that has a key at exactly this place.
/// The key of the kind of a part, which serde does not list among those of the kind.
const TAG: &str = "type";

/// How often a text stands as a value.
fn occurrences(value: &Spanned<DeValue<'_>>, text: &str) -> usize {
    match value.get_ref() {
        DeValue::Table(table) => table.values().map(|v| occurrences(v, text)).sum(),
        DeValue::Array(array) => array.iter().map(|v| occurrences(v, text)).sum(),
        DeValue::String(found) => usize::from(found == text),
        _ => 0,
    }
}

/// The place of what a message without a place is about: tables with a `type` are read from a
/// buffer.
fn meant(value: &Spanned<DeValue<'_>>, message: &str) -> Option<Range<usize>> {
    let unknown = message.starts_with("unknown field").then(|| quoted(message).next()).flatten();
    let text = text_instead(message).map(|(text, _)| text);
    let text = text.filter(|text| occurrences(value, text) == 1);
    let place = |value: &Spanned<DeValue<'_>>| match value.get_ref() {
        DeValue::Table(table) => {
            table.keys().find(|key| unknown == Some(key.get_ref())).map(Spanned::span)
        }
        DeValue::String(found) => (text == Some(found)).then(|| value.span()),
        _ => None,
    };
    first_place(value, &place)
}

/// The first place that a search finds in a value, or else in what it holds.
fn first_place<'a, 'i>(
    value: &'a Spanned<DeValue<'i>>,
    place: &dyn Fn(&'a Spanned<DeValue<'i>>) -> Option<Range<usize>>,
) -> Option<Range<usize>> {
    place(value).or_else(|| match value.get_ref() {
        DeValue::Table(table) => table.values().find_map(|v| first_place(v, place)),
        DeValue::Array(array) => array.iter().find_map(|v| first_place(v, place)),
        _ => None,
    })
}

fn table_with_key<'a, 'i>(
    value: &'a Spanned<DeValue<'i>>,
    span: &Range<usize>,
) -> Option<&'a DeTable<'i>> {
    match value.get_ref() {
        DeValue::Table(table) if table.keys().any(|key| key.span() == *span) => Some(table),
        DeValue::Table(table) => table.values().find_map(|v| table_with_key(v, span)),
        DeValue::Array(array) => array.iter().find_map(|v| table_with_key(v, span)),
        _ => None,
    }
}
