//! The sections of the model file for people: keys, types, defaults, words, one example. All of it
//! is taken from the JSON schema, so from the types themselves; `holonom schema joint` prints it,
//! the reference of the guide is written from it.
//!
//! ```text
//! schema ── Section { tables of rows } ──┬── text      the terminal
//!                                        └── markdown  the guide
//! ```

mod markdown;
mod text;

use serde_json::{Map, Value};
use std::sync::LazyLock;

use super::Model;
use crate::text::sections::{LISTS, PARAMETERS, TABLES};

/// One section of the model file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReferenceSection {
    /// Its name: `joint`.
    pub name: &'static str,
    /// Its keys first, then the tables and words that they refer to.
    pub tables: Vec<ReferenceTable>,
    /// A part of one valid model, that of all examples together.
    pub example: &'static str,
}

/// The keys of a table, or the words of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReferenceTable {
    /// The keys it belongs to, `motor.history`; none for the section itself.
    pub of: Vec<String>,
    /// What it describes.
    pub about: String,
    /// Keys, words or forms of a value.
    pub rows: Vec<KeyRow>,
}

/// A key with its type and default, or a word with its meaning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyRow {
    /// The key, the word, or the form of a value.
    pub name: String,
    /// The type of a key; `None` for words and forms.
    pub kind: Option<String>,
    /// Whether a value has to be stated, or what stands for it.
    pub presence: Presence,
    /// Its meaning, with the unit.
    pub about: String,
}

/// Whether a key has to be stated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Presence {
    /// It has to be.
    Required,
    /// It need not be; the meaning says what holds without it.
    Optional,
    /// This value holds without it, as TOML.
    Default(String),
}

macro_rules! examples {
    ($($name:literal),*) => { [$(($name, include_str!(concat!("examples/", $name, ".toml")))),*] };
}

const EXAMPLES: [(&str, &str); 25] = examples![
    "model",
    "simulation",
    "parameters",
    "frame",
    "body",
    "beam",
    "particle",
    "bar",
    "joint",
    "constraint",
    "contact",
    "spring",
    "bushing",
    "load",
    "law",
    "table",
    "signal",
    "sensor",
    "event",
    "control",
    "objective",
    "condition",
    "optimize",
    "measurement",
    "identify"
];

impl ReferenceTable {
    /// `{ stiffness = …, rest = … }`: a type, the keys that are required, or else the first one.
    fn form(&self) -> String {
        if let Some(tagged) = self.rows.iter().find(|row| row.name.starts_with("type = ")) {
            return format!("{{ {}, … }}", tagged.name);
        }
        let keys = || self.rows.iter().filter(|row| row.kind.is_some());
        let required = keys().filter(|row| row.presence == Presence::Required);
        let mut parts: Vec<String> = required.map(|row| format!("{} = …", row.name)).collect();
        if parts.is_empty() {
            parts.extend(keys().next().map(|row| format!("{} = …", row.name)));
        }
        format!("{{ {} }}", parts.join(", "))
    }
}

/// All of them, read once.
static SECTIONS: LazyLock<Vec<ReferenceSection>> = LazyLock::new(|| {
    let schema = Model::schema();
    EXAMPLES.map(|own| ReferenceSection::read(&schema, own)).into()
});

impl ReferenceSection {
    /// The names of all sections, in the order of the guide.
    pub fn names() -> impl Iterator<Item = &'static str> {
        EXAMPLES.into_iter().map(|(name, _)| name)
    }

    /// The section of this name.
    #[must_use]
    pub fn of(name: &str) -> Option<&'static Self> {
        SECTIONS.iter().find(|section| section.name == name)
    }

    fn read(schema: &Value, (name, example): (&'static str, &'static str)) -> Self {
        let property = &schema["properties"][name];
        let root = if LISTS.contains(&name) { &property["items"] } else { property };
        let mut reader = Reader { schema, waiting: Vec::new() };
        let mut tables = vec![reader.table(Vec::new(), reader.resolve(root))];
        let mut read = 0;
        while let Some((definition, keys)) = reader.waiting.get(read).cloned() {
            tables.push(reader.table(keys, &schema["$defs"][definition]));
            read += 1;
        }
        tables[0].about = without_heading(&tables[0].about);
        // a definition may be named by further keys after it was read
        for (table, (_, keys)) in tables.iter_mut().skip(1).zip(reader.waiting) {
            table.of = keys;
        }
        Self { name, tables, example }
    }

    /// The type in words of a key of this name, where all of the section's keys of this name have
    /// it.
    pub(crate) fn kind_of(&self, key: &str) -> Option<&str> {
        let rows = || self.tables.iter().flat_map(|table| &table.rows);
        let mut kinds = rows().filter(|row| row.name == key).filter_map(|row| row.kind.as_deref());
        let first = kinds.next()?;
        kinds.all(|kind| kind == first).then_some(first)
    }

    /// Whether a key of the section itself has a table, whatever the type.
    pub(crate) fn has_table(&self, key: &str) -> bool {
        let mut rows = self.tables[0].rows.iter().filter(|row| row.name == key).peekable();
        rows.peek().is_some() && rows.all(|row| row.kind.as_deref() == Some("table"))
    }

    /// How the table of a key is written: `{ stiffness = … }`.
    pub(crate) fn table_form(&self, key: &str) -> Option<String> {
        let is_own = |path: &String| path.rsplit('.').next() == Some(key);
        let is_named = |path: &String| path.strip_suffix(".NAME").is_some_and(|own| own == key);
        let of = |is: &dyn Fn(&String) -> bool| {
            self.tables.iter().find(|table| table.of.iter().any(is)).map(ReferenceTable::form)
        };
        of(&is_own).or_else(|| Some(format!("{{ NAME = {} }}", of(&is_named)?)))
    }

    /// The only section with a key of this name.
    pub(crate) fn with_key(key: &str) -> Option<&'static Self> {
        let has = |section: &&Self| section.tables[0].rows.iter().any(|row| row.name == key);
        let mut having = SECTIONS.iter().filter(has);
        having.next().filter(|_| having.next().is_none())
    }

    /// Its heading in a model file: `[model]`, `[[joint]]`.
    #[must_use]
    pub fn heading(&self) -> String {
        let single = TABLES.contains(&self.name) || self.name == PARAMETERS;
        if single { format!("[{}]", self.name) } else { format!("[[{}]]", self.name) }
    }
}

/// Reads tables, and collects the definitions that their keys refer to.
struct Reader<'s> {
    schema: &'s Value,
    waiting: Vec<(String, Vec<String>)>,
}

impl<'s> Reader<'s> {
    fn resolve(&self, schema: &'s Value) -> &'s Value {
        match definition(schema) {
            Some(name) => &self.schema["$defs"][name],
            None => match list(schema, "anyOf") {
                [only] => self.resolve(only),
                _ => schema,
            },
        }
    }

    fn table(&mut self, of: Vec<String>, schema: &'s Value) -> ReferenceTable {
        let path = of.first().cloned().unwrap_or_default();
        let mut rows = Vec::new();
        for member in list(schema, "oneOf").iter().chain(list(schema, "anyOf")) {
            rows.extend(self.alternative(&path, member));
        }
        if rows.is_empty() {
            rows = self.keys(&path, schema);
        }
        ReferenceTable { of, about: about(schema), rows }
    }

    /// A word; a table of a certain `type` with its keys; or a form of a value.
    fn alternative(&mut self, path: &str, member: &'s Value) -> Vec<KeyRow> {
        let row = |name: String| KeyRow {
            name,
            kind: None,
            presence: Presence::Optional,
            about: about(member),
        };
        if let Some(word) = member["const"].as_str() {
            return vec![row(format!("{word:?}"))];
        }
        if let Some(tag) = member["properties"]["type"]["const"].as_str() {
            let mut rows = vec![row(format!("type = {tag:?}"))];
            rows.extend(self.keys(path, member));
            return rows;
        }
        self.refer(path, member);
        let mut rows = vec![row(self.kind(member))];
        rows.extend(self.keys(path, member));
        rows
    }

    /// The keys of an object: those that are required in their order, then the others by name.
    fn keys(&mut self, path: &str, schema: &'s Value) -> Vec<KeyRow> {
        let none = Map::new();
        let properties = schema["properties"].as_object().unwrap_or(&none);
        let required: Vec<&str> =
            list(schema, "required").iter().filter_map(Value::as_str).collect();
        let others = properties.keys().map(String::as_str).filter(|key| !required.contains(key));
        let ordered: Vec<&str> = required.iter().copied().chain(others).collect();
        let mut rows = Vec::new();
        for key in ordered {
            let property = &properties[key];
            if property["const"].is_null() {
                let below = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
                self.refer(&below, property);
                self.refer(&format!("{below}.NAME"), &property["additionalProperties"]);
                rows.push(self.key(key, property, required.contains(&key)));
            }
        }
        if schema["additionalProperties"].is_object() {
            let values = &schema["additionalProperties"];
            rows.push(KeyRow { about: about(values), ..self.key("NAME", values, false) });
        }
        rows
    }

    fn key(&self, key: &str, property: &Value, required: bool) -> KeyRow {
        let presence = match property.get("default") {
            _ if required => Presence::Required,
            Some(value) if value.as_array().is_none_or(|values| !values.is_empty()) => {
                Presence::Default(toml(value))
            }
            _ => Presence::Optional,
        };
        KeyRow {
            name: key.to_owned(),
            kind: Some(self.kind(property)),
            presence,
            about: about(property),
        }
    }

    /// Notes the definitions that a value may have.
    fn refer(&mut self, path: &str, property: &Value) {
        let members = list(property, "anyOf").iter().chain([property, &property["items"]]);
        for name in members.filter_map(definition) {
            match self.waiting.iter_mut().find(|(known, _)| known == name) {
                Some((_, keys)) if keys.iter().any(|key| key == path) => {}
                Some((_, keys)) => keys.push(path.to_owned()),
                None => self.waiting.push((name.to_owned(), vec![path.to_owned()])),
            }
        }
    }

    /// The type of a value in words.
    fn kind(&self, schema: &Value) -> String {
        if let Some(name) = definition(schema) {
            return self.kind(&self.schema["$defs"][name]);
        }
        if let [only] = list(schema, "anyOf") {
            return self.kind(only);
        }
        let members = list(schema, "anyOf").iter().chain(list(schema, "oneOf"));
        let mut kinds: Vec<String> = members.map(|member| self.kind(member)).collect();
        kinds.dedup();
        if !kinds.is_empty() {
            return kinds.join(" or ");
        }
        if schema["const"].is_string() {
            return "word".to_owned();
        }
        let names = match &schema["type"] {
            Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
            single => vec![single.as_str().unwrap_or_default()],
        };
        let kinds: Vec<String> = names.into_iter().map(|name| self.simple(name, schema)).collect();
        kinds.join(" or ")
    }

    fn simple(&self, name: &str, schema: &Value) -> String {
        match name {
            "integer" => "whole number".to_owned(),
            "string" => "text".to_owned(),
            "boolean" => "true or false".to_owned(),
            "object" => "table".to_owned(),
            "array" => {
                let of = plural(&self.kind(&schema["items"]));
                match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                    (Some(least), Some(most)) if least == most => format!("{least} {of}"),
                    _ => format!("list of {of}"),
                }
            }
            other => other.to_owned(),
        }
    }
}

/// Several of a kind; lists of texts are lists of names.
fn plural(kind: &str) -> String {
    match kind {
        "number" | "whole number" | "table" | "word" => format!("{kind}s"),
        "text" => "names".to_owned(),
        several => format!("lists of {several}"),
    }
}

fn list<'s>(schema: &'s Value, key: &str) -> &'s [Value] {
    schema[key].as_array().map_or(&[], Vec::as_slice)
}

fn definition(schema: &Value) -> Option<&str> {
    schema["$ref"].as_str()?.strip_prefix("#/$defs/")
}

/// The description in one line.
fn about(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().replace('\n', " ")
}

/// `` `[[joint]]`: a kinematic pair `` without the heading, which stands above it.
fn without_heading(about: &str) -> String {
    let rest = match about.split_once("`: ") {
        Some((heading, rest)) if heading.starts_with("`[") => rest,
        _ => about,
    };
    let mut letters = rest.chars();
    let first = letters.next().map(char::to_uppercase);
    first.into_iter().flatten().chain(letters).collect()
}

/// A default as a model file writes it.
fn toml(value: &Value) -> String {
    match value {
        Value::Array(items) => {
            format!("[{}]", items.iter().map(toml).collect::<Vec<_>>().join(", "))
        }
        Value::Object(map) if map.is_empty() => "{}".to_owned(),
        Value::Object(map) => {
            let pairs: Vec<String> =
                map.iter().map(|(k, v)| format!("{k} = {}", toml(v))).collect();
            format!("{{ {} }}", pairs.join(", "))
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests;
