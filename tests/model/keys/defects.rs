//! Defects planted in a document.

use super::schema::Keys;
use toml::{Table, Value};

/// A defect of one key.
pub(crate) struct Defect {
    /// The key.
    pub(crate) path: String,
    /// What is done to it.
    pub(crate) what: String,
    /// Documents with the defect; the first that is read counts.
    pub(crate) documents: Vec<Table>,
}

/// A place in a document.
#[derive(Clone)]
enum Step {
    Key(String),
    Index(usize),
}

/// All defects of a document.
pub(crate) fn of(document: &Table, keys: &Keys, files: &[&str]) -> Vec<Defect> {
    let files = files.iter().map(|file| (*file).to_owned()).collect();
    let names = [names(document), files];
    let mut planter = Planter { document, keys, names, defects: Vec::new() };
    for (section, value) in document {
        planter.plant(section, &mut vec![Step::Key(section.clone())], value, true);
    }
    planter.exchange_names();
    planter.move_keys();
    planter.defects
}

/// Names of all parts.
fn names(document: &Table) -> Vec<String> {
    let lists = document.values().filter_map(Value::as_array).flatten();
    let own = lists.filter_map(|entry| entry.get("name")?.as_str());
    own.map(str::to_owned).chain(["ground".to_owned()]).collect()
}

struct Planter<'a> {
    document: &'a Table,
    keys: &'a Keys,
    /// Of parts, of files beside the model.
    names: [Vec<String>; 2],
    defects: Vec<Defect>,
}

impl Planter<'_> {
    /// The document with the value at a place replaced, or the key removed.
    fn with(&self, place: &[Step], value: Option<Value>) -> Table {
        let mut document = Value::Table(self.document.clone());
        let (last, way) = place.split_last().unwrap();
        let mut at = &mut document;
        for step in way {
            at = match step {
                Step::Key(key) => at.get_mut(key).unwrap(),
                Step::Index(index) => at.get_mut(*index).unwrap(),
            };
        }
        match (last, value) {
            (Step::Key(key), Some(value)) => *at.get_mut(key).unwrap() = value,
            (Step::Key(key), None) => drop(at.as_table_mut().unwrap().remove(key)),
            (Step::Index(index), Some(value)) => *at.get_mut(*index).unwrap() = value,
            (Step::Index(index), None) => drop(at.as_array_mut().unwrap().remove(*index)),
        }
        let Value::Table(document) = document else { unreachable!() };
        document
    }

    fn add(&mut self, path: &str, what: String, documents: Vec<Table>) {
        if !documents.is_empty() {
            self.defects.push(Defect { path: path.to_owned(), what, documents });
        }
    }

    /// Defects of a value and of all below it.
    fn plant(&mut self, path: &str, place: &mut Vec<Step>, value: &Value, section: bool) {
        match value {
            Value::Table(table) => {
                let own = self.keys.table(path, table);
                for (key, value) in table {
                    let tag = key == "type" && own != path;
                    let below = if tag { format!("{path}.type") } else { format!("{own}.{key}") };
                    place.push(Step::Key(key.clone()));
                    if !self.keys.is_required(&below) && !tag {
                        let dropped = self.with(place, None);
                        self.add(&below, "dropped".into(), vec![dropped]);
                    }
                    self.plant(&below, place, value, false);
                    place.pop();
                }
            }
            Value::Array(items) => {
                if !section && items.iter().all(|item| !item.is_table()) {
                    self.exchange_entries(path, place, items);
                }
                for (k, item) in items.iter().enumerate() {
                    place.push(Step::Index(k));
                    self.plant(path, place, item, false);
                    place.pop();
                }
            }
            _ => self.change(path, place, value),
        }
    }

    /// Neighbours exchanged, and all of them with the other sign.
    fn exchange_entries(&mut self, path: &str, place: &[Step], items: &[Value]) {
        let reversed: Option<Vec<Value>> =
            items.iter().map(|item| Some(Value::from(-item.as_float()?))).collect();
        // −q is the rotation of q
        if let Some(reversed) =
            reversed.filter(|_| items.len() > 1 && !path.ends_with("quaternion"))
        {
            let document = self.with(place, Some(Value::Array(reversed)));
            self.add(path, "reversed".into(), vec![document]);
        }
        for k in 1..items.len() {
            if items[k] != items[k - 1] {
                let mut exchanged = items.to_vec();
                exchanged.swap(k - 1, k);
                let document = self.with(place, Some(Value::Array(exchanged)));
                self.add(path, format!("entries {} and {k} exchanged", k - 1), vec![document]);
            }
        }
    }

    /// Another value.
    fn change(&mut self, path: &str, place: &[Step], value: &Value) {
        let set = |value: Value| self.with(place, Some(value));
        match value {
            Value::Float(x) if *x == 0.0 => {
                let documents = [0.25, 0.01].map(|x| set(x.into())).into();
                self.add(path, format!("{x} changed"), documents);
            }
            Value::Float(x) => {
                let documents = [2.0, 1.25, 0.8, 1.02].map(|f| set((f * x).into())).into();
                self.add(path, format!("{x} changed"), documents);
            }
            Value::Integer(x) => {
                let near = [2 * x, x + 1, x - 1].map(|y| set(y.into()));
                let documents: Vec<Table> =
                    near.into_iter().filter(|d| d != self.document).collect();
                self.add(path, format!("{x} changed"), documents);
            }
            Value::Boolean(x) => {
                let document = set((!x).into());
                self.add(path, format!("{x} changed"), vec![document]);
            }
            Value::String(word) => self.other_words(path, place, word),
            _ => {}
        }
    }

    fn other_words(&mut self, path: &str, place: &[Step], word: &str) {
        let words = self.keys.words(path);
        let group = self.names.iter().find(|names| names.iter().any(|name| name == word));
        let others: Vec<String> = match group {
            _ if !words.is_empty() => words.into_iter().filter(|other| other != word).collect(),
            _ if path.ends_with(".name") && path != "model.name" => return,
            Some(names) => names.iter().filter(|other| *other != word).cloned().collect(),
            None => vec![word.chars().rev().collect()],
        };
        for other in others {
            let document = self.with(place, Some(other.clone().into()));
            self.add(path, format!("`{word}` → `{other}`"), vec![document]);
        }
    }

    /// The names of two parts of a section exchanged: what names one acts on the other.
    fn exchange_names(&mut self) {
        for (section, value) in self.document {
            let Some(entries) = value.as_array() else { continue };
            for k in 1..entries.len() {
                let name = |k: usize| entries[k].get("name").cloned();
                let (Some(a), Some(b)) = (name(k - 1), name(k)) else { continue };
                let mut exchanged = entries.clone();
                exchanged[k - 1].as_table_mut().unwrap().insert("name".into(), b.clone());
                exchanged[k].as_table_mut().unwrap().insert("name".into(), a.clone());
                let mut document = self.document.clone();
                document.insert(section.clone(), Value::Array(exchanged));
                for k in [k - 1, k] {
                    let own = self.keys.table(section, entries[k].as_table().unwrap());
                    let what = format!("of {a} and {b} exchanged");
                    self.add(&format!("{own}.name"), what, vec![document.clone()]);
                }
            }
        }
    }

    /// A key of one part at another one that lacks it.
    fn move_keys(&mut self) {
        for (section, value) in self.document {
            let Some(entries) = value.as_array() else { continue };
            for (k, entry) in entries.iter().enumerate() {
                let Some(table) = entry.as_table() else { continue };
                for (key, value) in table {
                    let path = format!("{}.{key}", self.keys.table(section, table));
                    let to = (0..entries.len()).filter(|to| {
                        *to != k && entries[*to].as_table().is_some_and(|t| !t.contains_key(key))
                    });
                    if self.keys.is_required(&path) {
                        continue;
                    }
                    let documents = to.map(|to| {
                        let mut moved = entries.clone();
                        moved[k].as_table_mut().unwrap().remove(key);
                        moved[to].as_table_mut().unwrap().insert(key.clone(), value.clone());
                        let mut document = self.document.clone();
                        document.insert(section.clone(), Value::Array(moved));
                        document
                    });
                    let documents = documents.collect();
                    self.add(&path, format!("of entry {k} moved"), documents);
                }
            }
        }
    }
}
