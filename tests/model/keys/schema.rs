//! The keys of the model file, their defaults and words, from its JSON schema.

use holonom::Model;
use serde_json::Value as Json;
use std::collections::{BTreeMap, BTreeSet};
use toml::Value;

/// Keys by their paths: `joint.motor.history[ramp].start`, with the `type` of tables that have
/// different keys for each.
pub(crate) struct Keys {
    /// Paths with defaults.
    keys: BTreeMap<String, Option<Value>>,
    words: BTreeMap<String, BTreeSet<String>>,
    /// Paths of tables that have different keys for each `type`.
    tagged: BTreeSet<String>,
    required: BTreeSet<String>,
}

impl Keys {
    pub(crate) fn read() -> Self {
        let schema = Model::schema();
        let mut keys = Self {
            keys: BTreeMap::new(),
            words: BTreeMap::new(),
            tagged: BTreeSet::new(),
            required: BTreeSet::new(),
        };
        for (section, property) in schema["properties"].as_object().unwrap() {
            keys.walk(&schema, section, property);
        }
        keys
    }

    fn walk(&mut self, schema: &Json, path: &str, node: &Json) {
        let mut node = node;
        while let Some(name) = node["$ref"].as_str() {
            node = &schema["$defs"][name.rsplit('/').next().unwrap()];
        }
        for alternatives in ["oneOf", "anyOf"] {
            for member in node[alternatives].as_array().into_iter().flatten() {
                if let Some(word) = member["const"].as_str() {
                    self.words.entry(path.to_owned()).or_default().insert(word.to_owned());
                    continue;
                }
                match member["properties"]["type"]["const"].as_str() {
                    Some(tag) => {
                        self.tagged.insert(path.to_owned());
                        let words = self.words.entry(format!("{path}.type")).or_default();
                        words.insert(tag.to_owned());
                        self.walk(schema, &format!("{path}[{tag}]"), member);
                    }
                    None => self.walk(schema, path, member),
                }
            }
        }
        if node["items"].is_object() {
            self.walk(schema, path, &node["items"]);
        }
        let required = node["required"].as_array();
        let required: BTreeSet<&str> =
            required.into_iter().flatten().filter_map(Json::as_str).collect();
        for (key, property) in node["properties"].as_object().into_iter().flatten() {
            if property["const"].is_null() {
                let below = format!("{path}.{key}");
                let default = property.get("default").and_then(|d| Value::try_from(d).ok());
                self.keys.insert(below.clone(), default);
                if required.contains(key.as_str()) {
                    self.required.insert(below.clone());
                }
                // what a station states of a section are the keys of `section`
                if below != "beam.stations.section" {
                    self.walk(schema, &below, property);
                }
            }
        }
    }

    /// Paths of all keys.
    pub(crate) fn all(&self) -> impl Iterator<Item = &String> {
        self.keys.keys()
    }

    pub(crate) fn default(&self, path: &str) -> Option<&Value> {
        self.keys.get(path)?.as_ref()
    }

    /// The words that a key may have; none where it is no word.
    pub(crate) fn words(&self, path: &str) -> BTreeSet<String> {
        self.words.get(path).cloned().unwrap_or_default()
    }

    /// All words, `load.frame = body`, but for those that are defaults.
    pub(crate) fn all_words(&self) -> impl Iterator<Item = String> {
        self.words.iter().flat_map(|(path, words)| {
            let default = match self.default(path) {
                Some(Value::Array(words)) => words.iter().filter_map(Value::as_str).collect(),
                other => other.and_then(Value::as_str).into_iter().collect::<Vec<_>>(),
            };
            let stated = words.iter().filter(move |word| !default.contains(&word.as_str()));
            stated.map(move |word| format!("{path} = {word}"))
        })
    }

    /// The path of the keys of a table: with its type, where keys depend on that.
    pub(crate) fn table(&self, path: &str, table: &toml::Table) -> String {
        match table.get("type").and_then(Value::as_str) {
            Some(tag) if self.tagged.contains(path) => format!("{path}[{tag}]"),
            _ => path.to_owned(),
        }
    }

    /// Whether a table has to have the key.
    pub(crate) fn is_required(&self, path: &str) -> bool {
        self.required.contains(path)
    }

    /// All keys of a document with their values.
    pub(crate) fn stated(&self, document: &toml::Table) -> Vec<(String, Value)> {
        let mut found = Vec::new();
        for (section, value) in document {
            self.collect(section, value, &mut found);
        }
        found
    }

    fn collect(&self, path: &str, value: &Value, found: &mut Vec<(String, Value)>) {
        match value {
            Value::Table(table) => {
                let own = self.table(path, table);
                for (key, value) in table {
                    let tag = key == "type" && own != path;
                    let below = if tag { format!("{path}.type") } else { format!("{own}.{key}") };
                    found.push((below.clone(), value.clone()));
                    self.collect(&below, value, found);
                }
            }
            Value::Array(items) => {
                for item in items {
                    if item.is_str() {
                        found.push((path.to_owned(), item.clone())); // one of several words
                    }
                    self.collect(path, item, found);
                }
            }
            _ => {}
        }
    }
}
