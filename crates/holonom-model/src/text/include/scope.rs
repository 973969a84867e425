//! What the names and the parameters of an included file mean in the merged model.

use std::collections::BTreeSet;

use toml::de::{DeTable, DeValue};

use super::tree::{IncludeTree, Inclusion};
use crate::text::sections::{LISTS, PARAMETERS};

/// The name of the frame of an included file, after its prefix.
pub(super) const FRAME: &str = "frame";

/// Names and parameters that a file defines, with those of the files that it includes.
#[derive(Default)]
pub(super) struct Scope {
    pub(super) names: BTreeSet<String>,
    pub(super) parameters: BTreeSet<String>,
}

/// The scopes of all branches; `framed` says which of them are placed.
pub(super) fn scopes(tree: &IncludeTree, tables: &[DeTable<'_>], framed: &[bool]) -> Vec<Scope> {
    let mut scopes: Vec<Scope> =
        tree.branches.iter().map(|branch| own(&tables[branch.file])).collect();
    for index in (1..tree.branches.len()).rev() {
        let Inclusion { parent, prefix, .. } = &tree.branches[index];
        let Some(parent) = *parent else { continue };
        let prefix = &prefix[tree.branches[parent].prefix.len()..];
        let mut scope = std::mem::take(&mut scopes[index]);
        if framed[index] {
            scope.names.insert(FRAME.to_owned());
        }
        let outer = &mut scopes[parent];
        outer.names.extend(scope.names.iter().map(|name| format!("{prefix}{name}")));
        outer.parameters.extend(scope.parameters.iter().map(|name| format!("{prefix}{name}")));
        scopes[index] = scope;
    }
    scopes
}

fn own(table: &DeTable<'_>) -> Scope {
    let mut scope = Scope::default();
    for section in LISTS {
        let entries = table.get(section).and_then(|value| value.get_ref().as_array());
        for entry in entries.into_iter().flat_map(|entries| entries.iter()) {
            let name = entry.get_ref().get("name").and_then(|name| name.get_ref().as_str());
            scope.names.extend(name.map(str::to_owned));
        }
    }
    if let Some(DeValue::Table(parameters)) = table.get(PARAMETERS).map(|value| value.get_ref()) {
        scope.parameters.extend(parameters.keys().map(|key| key.get_ref().to_string()));
    }
    scope
}

/// The name in the merged model of one that stands in the file of a branch: that of the nearest
/// file which defines it.
pub(super) fn meant(
    tree: &IncludeTree,
    branch: usize,
    name: &str,
    defines: impl Fn(usize, &str) -> bool,
) -> String {
    let mut at = Some(branch);
    while let Some(index) = at {
        if defines(index, name) {
            return format!("{}{name}", tree.branches[index].prefix);
        }
        at = tree.branches[index].parent;
    }
    name.to_owned()
}
