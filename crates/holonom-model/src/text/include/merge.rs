//! One text of the files of a model.

use std::collections::BTreeMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::KEY;
use super::scope::{FRAME, Scope, meant, scopes};
use super::tree::{IncludeTree, POSE, parse};
use super::writer::{Writer, key_as_toml, quoted};
use crate::expression::{renamed, renamed_parts};
use crate::formula::own_names;
use crate::frames::start::is_ground;
use crate::text::parameters;
use crate::text::problem::{MAX_PROBLEMS, Problem, nearest};
use crate::text::sections::{
    LISTS, MOTOR, OF_MOTORS, OF_SIGNALS, PARAMETERS, TABLES, has_formulas,
};
use crate::text::wishes;

/// Keys of a part that name other parts.
const REFERENCES: [&str; 18] = [
    "from",
    "to",
    "parent",
    "child",
    "joint",
    "joints",
    "body",
    "beam",
    "of",
    "relative_to",
    "seen_from",
    "on",
    "release",
    "lock",
    "enable",
    "disable",
    "sensor",
    "controls",
];

type TomlValue<'i> = Spanned<DeValue<'i>>;

/// The merged text; `None` where the files do not fit each other.
pub(super) fn merge(tree: &IncludeTree, problems: &mut Vec<(usize, Problem)>) -> Option<Writer> {
    let tables: Vec<DeTable<'_>> =
        tree.files.iter().map(|file| parse(&file.text).unwrap_or_default()).collect();
    let framed: Vec<bool> =
        (0..tree.branches.len()).map(|k| entry(tree, &tables, k).is_some_and(is_placed)).collect();
    let scopes = scopes(tree, &tables, &framed);
    let mut merge = Merge {
        tree,
        tables: &tables,
        framed,
        scopes,
        stated: BTreeMap::new(),
        replaced: Vec::new(),
        head: Writer::default(),
        parameters: Writer::default(),
        parts: Writer::default(),
        problems: Vec::new(),
    };
    merge.root_sections();
    merge.branch(0);
    problems.append(&mut merge.problems);
    let mut out = merge.head;
    if !merge.parameters.text.is_empty() {
        out.text += "\n[parameters]\n";
        out.append(merge.parameters);
    }
    out.append(merge.parts);
    if problems.is_empty() && !merge.replaced.is_empty() {
        let used = parameters::used_in(&out.text);
        for (name, file, place) in merge.replaced.into_iter().filter(|one| !used.contains(&one.0)) {
            let message =
                format!("no expression uses the parameter `{name}`: its value changes nothing");
            let problem = Problem::new(KEY, message).help("remove it, or let an expression use it");
            problems.push((file, problem.at(Some(place))));
        }
    }
    problems.is_empty().then_some(out)
}

/// The entry of `include` that a branch comes from, if it is a table.
fn entry<'a, 'i>(
    tree: &IncludeTree,
    tables: &'a [DeTable<'i>],
    branch: usize,
) -> Option<&'a DeTable<'i>> {
    let branch = &tree.branches[branch];
    let including = &tables[tree.branches[branch.parent?].file];
    let entries = including.get(KEY)?.get_ref().as_array()?;
    entries.get(branch.entry)?.get_ref().as_table()
}

/// Whether the directions of a wrench turn with its body.
fn turns_with_body(table: &DeTable<'_>) -> bool {
    table.get("frame").is_some_and(|frame| frame.get_ref().as_str() == Some("body"))
}

/// Whether a contact is with a plane of the ground.
fn is_in_ground(contact: &DeTable<'_>) -> bool {
    let plane = contact.get("a").and_then(|a| a.get_ref().get("plane"));
    plane.is_some_and(|plane| {
        plane.get_ref().get("on").is_none_or(|on| on.get_ref().as_str().is_some_and(is_ground))
    })
}

/// Whether an entry says where its file is placed.
fn is_placed(entry: &DeTable<'_>) -> bool {
    POSE.iter().any(|key| entry.contains_key(*key))
}

struct Merge<'a, 'i> {
    tree: &'a IncludeTree,
    tables: &'a [DeTable<'i>],
    framed: Vec<bool>,
    scopes: Vec<Scope>,
    /// The branch that states each parameter.
    stated: BTreeMap<String, usize>,
    /// Parameters whose values an including file replaces: the name, that file, the place.
    replaced: Vec<(String, usize, Range<usize>)>,
    head: Writer,
    parameters: Writer,
    parts: Writer,
    problems: Vec<(usize, Problem)>,
}

impl<'a, 'i> Merge<'a, 'i> {
    fn report(&mut self, branch: usize, problem: Problem) {
        let file = self.tree.branches[branch].file;
        if self.problems.len() < MAX_PROBLEMS {
            self.problems.push((file, problem));
        }
    }

    /// The sections of the model file itself that are no lists: `[model]`, `[simulation]`, and what
    /// does not exist.
    fn root_sections(&mut self) {
        let own = |key: &str| key != KEY && key != PARAMETERS && !LISTS.contains(&key);
        let mut sections = Writer::default();
        for (key, value) in self.tables[0].iter().filter(|(key, _)| own(key.get_ref())) {
            match value.get_ref() {
                DeValue::Table(table) => {
                    let start = sections.text.len();
                    sections.text += &format!("\n[{}]\n", key_as_toml(key.get_ref()));
                    self.lines(&mut sections, 0, key.get_ref(), table);
                    sections.piece(start, 0, value.span());
                }
                _ => {
                    let mut line = Writer::default();
                    line.key(key.get_ref(), 0, key.span());
                    self.value(&mut line, 0, value, Role::Plain);
                    line.text += "\n";
                    self.head.append(line);
                }
            }
        }
        self.head.append(sections);
    }

    /// Adds the parameters and the parts of a branch, and those of the files that it includes.
    fn branch(&mut self, index: usize) {
        let (tree, table) = (self.tree, &self.tables[self.tree.branches[index].file]);
        if index > 0 {
            self.overridden(index);
            self.frame(index);
            self.unknown_sections(index, table);
        }
        self.own_parameters(index, table);
        for section in LISTS {
            let Some(value) = table.get(section) else { continue };
            match value.get_ref().as_array() {
                Some(parts) => parts.iter().for_each(|part| self.part(index, section, part)),
                None => {
                    let message = format!("`{section}` must be a list of tables");
                    let help = format!("write [[{section}]] with two brackets");
                    let problem = Problem::new(section, message).help(help);
                    self.report(index, problem.at(Some(value.span())));
                }
            }
        }
        for &child in &tree.branches[index].children {
            self.branch(child);
        }
    }

    fn unknown_sections(&mut self, index: usize, table: &'a DeTable<'i>) {
        let known = || TABLES.iter().chain(&LISTS).copied().chain([PARAMETERS, KEY]);
        for key in table.keys().filter(|key| known().all(|k| k != key.get_ref().as_ref())) {
            let name = key.get_ref();
            let problem = Problem::new(name.as_ref(), format!("unknown section `{name}`"));
            let problem =
                problem.help(match (wishes::answer_to_section(name), nearest(name, known())) {
                    (Some(answer), _) => answer.to_owned(),
                    (None, Some(best)) => format!("did you mean `{best}`?"),
                    (None, None) => {
                        format!("sections are {}", known().collect::<Vec<_>>().join(", "))
                    }
                });
            self.report(index, problem.at(Some(key.span())));
        }
    }

    /// Adds the parameters that the including file states for a branch.
    fn overridden(&mut self, index: usize) {
        let Some(parent) = self.tree.branches[index].parent else { return };
        let value = entry(self.tree, self.tables, index).and_then(|entry| entry.get(PARAMETERS));
        let Some(value) = value else { return };
        let DeValue::Table(table) = value.get_ref() else {
            let problem = Problem::new(KEY, "`parameters` must be a table").at(Some(value.span()));
            let help = "write parameters = { length = 0.4 }";
            return self.report(parent, problem.help(help));
        };
        for (key, value) in table {
            let own = &self.scopes[index].parameters;
            if !own.contains(key.get_ref().as_ref()) {
                let file = self.tree.files[self.tree.branches[index].file].path.display();
                let name = key.get_ref();
                let problem = Problem::new(KEY, format!("`{file}` has no parameter `{name}`"));
                let problem = match nearest(name, own.iter().map(String::as_str)) {
                    Some(best) => problem.help(format!("did you mean `{best}`?")),
                    None => problem,
                };
                self.report(parent, problem.at(Some(key.span())));
                continue;
            }
            let name = format!("{}{}", self.tree.branches[index].prefix, key.get_ref());
            if !self.is_stated_above(parent, &name) {
                let place = (self.tree.branches[parent].file, key.span());
                self.replaced.push((name.clone(), place.0, place.1));
                self.parameter(parent, &name, key, value);
            }
        }
    }

    /// Adds the parameters that a file states, as far as no file above it does.
    fn own_parameters(&mut self, index: usize, table: &'a DeTable<'i>) {
        let Some(value) = table.get(PARAMETERS) else { return };
        let DeValue::Table(own) = value.get_ref() else {
            let problem = Problem::new(PARAMETERS, "`parameters` must be a table");
            let problem = problem.help("write [parameters] with one pair of brackets");
            return self.report(index, problem.at(Some(value.span())));
        };
        for (key, value) in own {
            let name = format!("{}{}", self.tree.branches[index].prefix, key.get_ref());
            if !self.is_stated_above(index, &name) {
                self.parameter(index, &name, key, value);
            }
        }
    }

    /// Whether a file that includes the one of a branch states a parameter.
    fn is_stated_above(&self, index: usize, name: &str) -> bool {
        let Some(&by) = self.stated.get(name) else { return false };
        let mut above = self.tree.branches[index].parent;
        while above.is_some_and(|branch| branch != by) {
            above = above.and_then(|branch| self.tree.branches[branch].parent);
        }
        above.is_some()
    }

    /// Adds a parameter under its merged name.
    fn parameter(
        &mut self,
        index: usize,
        name: &str,
        key: &'a Spanned<std::borrow::Cow<'i, str>>,
        value: &'a TomlValue<'i>,
    ) {
        if self.stated.insert(name.to_owned(), index).is_some() {
            let path = format!("{PARAMETERS}.{name}");
            let problem = Problem::new(path, format!("the parameter `{name}` is stated twice"));
            let help =
                "give the files different prefixes, or state the value in the including file";
            return self.report(index, problem.help(help).at(Some(key.span())));
        }
        let mut line = Writer::default();
        line.key(name, self.tree.branches[index].file, key.span());
        self.value(&mut line, index, value, Role::Plain);
        line.text += "\n";
        self.parameters.append(line);
    }

    /// Adds the frame of a placed file.
    fn frame(&mut self, index: usize) {
        let (Some(parent), true) = (self.tree.branches[index].parent, self.framed[index]) else {
            return;
        };
        let Some(entry) = entry(self.tree, self.tables, index) else { return };
        let mut out = Writer::default();
        out.text += &format!("\n[[frame]]\nname = {}\n", quoted(&self.frame_name(index)));
        for key in POSE {
            let Some((stated, value)) = entry.get_key_value(key) else { continue };
            out.key(key, self.tree.branches[parent].file, stated.span());
            let role = if key == "relative_to" { Role::Reference } else { Role::Plain };
            self.value(&mut out, parent, value, role);
            out.text += "\n";
        }
        if let Some(base) = self.base(parent).filter(|_| !entry.contains_key("relative_to")) {
            out.text += &format!("relative_to = {}\n", quoted(&base));
        }
        let including = &self.tables[self.tree.branches[parent].file];
        let place = including.get(KEY).and_then(|entries| {
            Some(entries.get_ref().as_array()?.get(self.tree.branches[index].entry)?.span())
        });
        out.piece(0, self.tree.branches[parent].file, place.unwrap_or_default());
        self.parts.append(out);
    }

    fn frame_name(&self, index: usize) -> String {
        format!("{}{FRAME}", self.tree.branches[index].prefix)
    }

    /// The frame in which the parts of a branch are stated.
    fn base(&self, index: usize) -> Option<String> {
        let mut at = Some(index);
        while let Some(branch) = at {
            if self.framed[branch] {
                return Some(self.frame_name(branch));
            }
            at = self.tree.branches[branch].parent;
        }
        None
    }

    /// Adds an entry of a list of parts.
    fn part(&mut self, index: usize, section: &str, part: &'a TomlValue<'i>) {
        let file = self.tree.branches[index].file;
        let DeValue::Table(table) = part.get_ref() else {
            let problem = Problem::new(section, format!("an entry of `{section}` is a table"));
            let help = format!("write [[{section}]] with its keys below");
            return self.report(index, problem.help(help).at(Some(part.span())));
        };
        let mut out = Writer::default();
        out.text += &format!("\n[[{section}]]\n");
        self.lines(&mut out, index, section, table);
        let kind = table.get("type").and_then(|kind| kind.get_ref().as_str());
        let posed = match section {
            "sensor" | "table" | "signal" | "event" | "objective" | "condition" | "measurement" => {
                false
            }
            "law" => table.contains_key("from"),
            "load" => !turns_with_body(table),
            "control" => table.contains_key("body") && !turns_with_body(table),
            "constraint" => kind.is_some_and(|kind| {
                ["distance", "point_on_line", "point_on_plane", "rolling", "blade"].contains(&kind)
            }),
            "contact" => is_in_ground(table),
            _ => true,
        };
        if posed
            && !table.contains_key("relative_to")
            && let Some(base) = self.base(index)
        {
            out.text += &format!("relative_to = {}\n", quoted(&base));
        }
        out.piece(0, file, part.span());
        self.parts.append(out);
    }

    /// Adds the keys of a section or part, one on each line.
    fn lines(&self, out: &mut Writer, index: usize, section: &str, table: &'a DeTable<'i>) {
        for (key, value) in table {
            out.key(key.get_ref(), self.tree.branches[index].file, key.span());
            let role = match key.get_ref().as_ref() {
                "name" => Role::Name,
                "description" => Role::Text,
                "shape" | "picture" | "collision" => Role::Shape,
                "a" | "b" if section == "contact" => Role::Side,
                "plane" => Role::Side,
                "file" if section == "table" => Role::File,
                key if has_formulas(section, key) => Role::Formula(own_names(section)),
                _ if section == "signal" => Role::Signal,
                MOTOR | "spring" if section == "joint" => Role::Drive,
                "terms" => Role::Terms,
                "set" if section == "event" => Role::Settings,
                key if REFERENCES.contains(&key) => Role::Reference,
                _ => Role::Plain,
            };
            self.value(out, index, value, role);
            out.text += "\n";
        }
    }

    /// Adds a value, with the names in it as they are in the merged model.
    fn value(&self, out: &mut Writer, index: usize, value: &'a TomlValue<'i>, role: Role) {
        let (start, file) = (out.text.len(), self.tree.branches[index].file);
        match value.get_ref() {
            DeValue::String(text) => out.text += &quoted(&self.word(index, text, role)),
            DeValue::Array(entries) => {
                out.text.push('[');
                for (k, entry) in entries.iter().enumerate() {
                    out.text += if k > 0 { ", " } else { "" };
                    self.value(out, index, entry, role);
                }
                out.text.push(']');
            }
            DeValue::Table(table) => {
                out.text.push('{');
                for (k, (key, entry)) in table.iter().enumerate() {
                    out.text += if k > 0 { ", " } else { " " };
                    match role {
                        Role::Settings => {
                            let name = self.word(index, key.get_ref(), Role::Reference);
                            out.key(&name, file, key.span());
                        }
                        _ => out.key(key.get_ref(), file, key.span()),
                    }
                    let role = match (role, key.get_ref().as_ref()) {
                        (Role::Shape, "file") => Role::File,
                        (Role::Signal, key) if OF_SIGNALS.contains(&key) => {
                            Role::Formula(own_names("signal"))
                        }
                        (Role::Drive, "table") => Role::Reference,
                        (Role::Drive, key) if OF_MOTORS.contains(&key) => {
                            Role::Formula(own_names("joint"))
                        }
                        (Role::Terms, "factor") => Role::Formula(own_names("constraint")),
                        (Role::Terms, "joint" | "of") => Role::Reference,
                        (Role::Side, "plane") => Role::Side,
                        (Role::Side, "on") => Role::Reference,
                        _ => Role::Plain,
                    };
                    self.value(out, index, entry, role);
                }
                out.text += " }";
            }
            _ => out.text += self.tree.files[file].text.get(value.span()).unwrap_or("0"),
        }
        out.piece(start, file, value.span());
    }

    /// A text as it is in the merged model.
    fn word(&self, index: usize, text: &str, role: Role) -> String {
        match role {
            Role::Name if index > 0 => format!("{}{text}", self.tree.branches[index].prefix),
            Role::Reference if !is_ground(text) => {
                let (name, node) = text.split_once('.').map_or((text, None), |(n, k)| (n, Some(k)));
                let defines = |k: usize, name: &str| self.scopes[k].names.contains(name);
                let name = meant(self.tree, index, name, defines);
                node.map_or(name.clone(), |node| format!("{name}.{node}"))
            }
            Role::Side if text.contains('*') => {
                format!("{}{text}", self.tree.branches[index].prefix)
            }
            Role::Side => self.word(index, text, Role::Reference),
            Role::File if index > 0 => self.tree.as_seen_from_root(index, text),
            Role::Formula(known) if !text.starts_with('=') => renamed_parts(text, &mut |name| {
                let Scope { names, parameters } = &self.scopes[index];
                let own =
                    known.contains(&name) && !names.contains(name) && !parameters.contains(name);
                let defines = |k: usize, name: &str| {
                    self.scopes[k].names.contains(name) || self.scopes[k].parameters.contains(name)
                };
                if own { name.to_owned() } else { meant(self.tree, index, name, defines) }
            }),
            Role::Plain | Role::Formula(_) | Role::Signal if text.starts_with('=') => {
                let defines = |k: usize, name: &str| self.scopes[k].parameters.contains(name);
                renamed(text, &mut |name| meant(self.tree, index, name, defines))
            }
            _ => text.to_owned(),
        }
    }
}

/// What the texts of a value are.
#[derive(Clone, Copy)]
enum Role {
    /// The name of a part.
    Name,
    /// The name of another part.
    Reference,
    /// Words, or expressions.
    Plain,
    /// An expression that is evaluated along the run.
    Formula(&'static [&'static str]),
    /// A part of a signal, with such expressions in it.
    Signal,
    /// The terms of a sum of rates.
    Terms,
    /// A motor, with such expressions in it, or a spring of a joint.
    Drive,
    /// Values under the names of other parts.
    Settings,
    /// A side of a contact: names of bodies, or a plane on one.
    Side,
    /// A description.
    Text,
    /// A shape.
    Shape,
    /// A file, relative to the one that names it.
    File,
}
