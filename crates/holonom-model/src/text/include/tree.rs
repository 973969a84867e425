//! The files of a model: which includes which, read once each.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{KEY, SourceFile};
use crate::MAX_BYTES;
use crate::read_text;
use crate::text::problem::{MAX_PROBLEMS, Problem, nearest};
use crate::text::read::folder_of;
use crate::text::syntax;

/// Files that may include one another in a row.
const DEEPEST: usize = 16;
/// Entries of `include` in all.
const MOST: usize = 1000;
/// The keys of an entry that place the file.
pub(super) const POSE: [&str; 6] =
    ["relative_to", "position", "quaternion", "rotation_vector", "matrix", "euler"];

/// A file at one place in the model; the same file may be at several.
pub(super) struct Inclusion {
    pub(super) file: usize,
    pub(super) parent: Option<usize>,
    pub(super) children: Vec<usize>,
    /// Which entry of the including file it is.
    pub(super) entry: usize,
    /// What stands before its names: the prefixes of all entries above.
    pub(super) prefix: String,
    depth: usize,
}

/// All files, and where they are included; the first branch is the file itself.
pub(super) struct IncludeTree {
    pub(super) files: Vec<SourceFile>,
    pub(super) branches: Vec<Inclusion>,
}

/// An entry of `include`, as far as it is needed to find the file.
struct IncludeEntry {
    file: String,
    prefix: String,
    place: Range<usize>,
}

impl IncludeTree {
    /// Reads the files that a file includes; `None` when it includes none, or cannot be parsed.
    pub(super) fn read(file: &SourceFile, problems: &mut Vec<(usize, Problem)>) -> Option<Self> {
        if !file.text.contains(KEY) || !parse(&file.text).ok()?.contains_key(KEY) {
            return None;
        }
        let root = Inclusion {
            file: 0,
            parent: None,
            children: Vec::new(),
            entry: 0,
            prefix: String::new(),
            depth: 0,
        };
        let mut tree = Self { files: vec![file.clone()], branches: vec![root] };
        let mut known = BTreeMap::from([(identity(&file.path), 0)]);
        let (mut next, mut bytes) = (0, file.text.len());
        while next < tree.branches.len() && problems.len() < MAX_PROBLEMS {
            let including = tree.branches[next].file;
            let entries = entries(&tree.files[including].text, &mut |problem| {
                problems.push((including, problem));
            });
            for (number, entry) in entries.into_iter().enumerate() {
                if let Err(problem) = tree.include(next, number, &entry, &mut known, &mut bytes) {
                    problems.push((including, problem.at(Some(entry.place))));
                    if problems.len() >= MAX_PROBLEMS || tree.branches.len() > MOST {
                        return Some(tree);
                    }
                }
            }
            next += 1;
        }
        Some(tree)
    }

    /// Adds a branch for an entry of the file of another branch.
    fn include(
        &mut self,
        parent: usize,
        number: usize,
        entry: &IncludeEntry,
        known: &mut BTreeMap<PathBuf, usize>,
        bytes: &mut usize,
    ) -> Result<(), Problem> {
        let wrong = |message: String, help: &str| Problem::new(KEY, message).help(help);
        let branch = &self.branches[parent];
        let (depth, including) = (branch.depth + 1, &self.files[branch.file]);
        if depth > DEEPEST {
            let message = format!("more than {DEEPEST} files include one another in a row");
            return Err(wrong(message, "include fewer files in a row"));
        }
        if self.branches.len() > MOST {
            return Err(wrong(
                format!("more than {MOST} files are included"),
                "include fewer files",
            ));
        }
        let path = folder_of(&including.path).join(&entry.file);
        let identity = identity(&path);
        let file = match known.get(&identity) {
            Some(&file) => file,
            None => {
                let text = included_text(&path).map_err(|reason| {
                    let message =
                        format!("cannot read the included file `{}`: {reason}", path.display());
                    wrong(message, "name a model file, relative to the directory of this one")
                })?;
                known.insert(identity, self.files.len());
                self.files.push(SourceFile { path, text });
                self.files.len() - 1
            }
        };
        let mut above = Some(parent);
        while let Some(k) = above {
            if self.branches[k].file == file {
                let name = self.files[file].path.display();
                let message = format!("`{name}` includes itself, directly or through other files");
                return Err(wrong(message, "remove one of the entries"));
            }
            above = self.branches[k].parent;
        }
        *bytes = bytes.saturating_add(self.files[file].text.len());
        if *bytes > MAX_BYTES {
            let message = format!("all files together are larger than {} MB", MAX_BYTES >> 20);
            return Err(wrong(message, "include fewer or smaller files"));
        }
        let prefix = self.branches[parent].prefix.clone() + &entry.prefix;
        let (parent, children) = (Some(parent), Vec::new());
        let new = Inclusion { file, parent, children, entry: number, prefix, depth };
        let index = self.branches.len();
        self.branches[parent.unwrap_or(0)].children.push(index);
        self.branches.push(new);
        Ok(())
    }
}

impl IncludeTree {
    /// A file that the file of a branch names, as the first file would name it.
    pub(super) fn as_seen_from_root(&self, branch: usize, file: &str) -> String {
        let folder = |k: usize| folder_of(&self.files[k].path);
        let path = folder(self.branches[branch].file).join(file);
        let relative = path.strip_prefix(folder(0)).unwrap_or(&path);
        relative.to_string_lossy().into_owned()
    }
}

/// The text as a table.
pub(super) fn parse(text: &str) -> Result<DeTable<'_>, Problem> {
    match DeTable::parse(text) {
        Ok(table) => Ok(table.into_inner()),
        Err(error) => Err(syntax::problem(text, &error)),
    }
}

/// An included file is a regular file: one from which a shell or a program writes is not read.
fn included_text(path: &Path) -> Result<String, String> {
    if path.exists() && !path.is_file() && !path.is_dir() {
        return Err("this is not a regular file".to_owned());
    }
    let reason = |error: crate::ModelError| match error {
        crate::ModelError::Unreadable { reason } => reason,
        other => other.to_string(),
    };
    read_text(path).map_err(reason)
}

/// The file itself, however it is named.
fn identity(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// The entries of `include` of a text.
fn entries(text: &str, report: &mut dyn FnMut(Problem)) -> Vec<IncludeEntry> {
    let table = match parse(text) {
        Ok(table) => table,
        Err(problem) => {
            report(problem);
            return Vec::new();
        }
    };
    let Some(value) = table.get(KEY) else { return Vec::new() };
    let Some(list) = value.get_ref().as_array() else {
        let problem = Problem::new(KEY, "`include` must be a list").at(Some(value.span()));
        report(problem.help("write include = [\"leg.toml\"] above the first section"));
        return Vec::new();
    };
    let mut entries = Vec::new();
    for value in list.iter() {
        match entry(value) {
            Ok(entry) => entries.push(entry),
            Err(problem) => {
                report(problem);
                break;
            }
        }
    }
    entries
}

fn entry(value: &Spanned<DeValue<'_>>) -> Result<IncludeEntry, Problem> {
    let place = value.span();
    let wrong = |key: &str, message: String, at: Range<usize>| {
        let help = "write a file name, or { file = \"leg.toml\", prefix = \"left_\" }";
        Problem::new(format!("{KEY}{key}"), message).help(help).at(Some(at))
    };
    let plain = |file: &str| IncludeEntry {
        file: file.to_owned(),
        prefix: String::new(),
        place: place.clone(),
    };
    let table = match value.get_ref() {
        DeValue::String(file) => return Ok(plain(file)),
        DeValue::Table(table) => table,
        _ => return Err(wrong("", "an entry is a file name or a table".into(), place)),
    };
    let known = || ["file", "prefix", "parameters"].into_iter().chain(POSE);
    if let Some(key) = table.keys().find(|key| known().all(|k| k != key.get_ref().as_ref())) {
        let problem = wrong("", format!("unknown key `{}`", key.get_ref()), key.span());
        let all = known().collect::<Vec<_>>().join(", ");
        return Err(match nearest(key.get_ref(), known()) {
            Some(best) => problem.help(format!("did you mean `{best}`? (known: {all})")),
            None => problem.help(format!("known: {all}")),
        });
    }
    let text = |key: &str| match table
        .get(key)
        .map(|value| (value.get_ref().as_str(), value.span()))
    {
        Some((Some(text), _)) => Ok(Some(text.to_owned())),
        Some((None, at)) => Err(wrong(&format!(".{key}"), format!("`{key}` must be a text"), at)),
        None => Ok(None),
    };
    let file = text("file")?
        .ok_or_else(|| wrong("", "the key `file` is missing".into(), place.clone()))?;
    let prefix = text("prefix")?.unwrap_or_default();
    if let Some(pose) = POSE.into_iter().find(|key| prefix.is_empty() && table.contains_key(*key)) {
        let message = format!("`{pose}` needs a `prefix`: the frame of the file is named after it");
        return Err(wrong("", message, place));
    }
    Ok(IncludeEntry { file, prefix, place })
}
