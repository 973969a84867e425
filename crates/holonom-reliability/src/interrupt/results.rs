//! What a run leaves: files that must be those of a run that nothing disturbed.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Tables, plots, the model and the summary without what the clock says, by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Results(BTreeMap<String, Vec<u8>>);

impl Results {
    /// Of the folder of a run.
    pub(super) fn read(folder: &Path) -> Result<Self, String> {
        let said = |error: std::io::Error| format!("{}: {error}", folder.display());
        let mut files = BTreeMap::new();
        for within in ["", "plots"] {
            for entry in fs::read_dir(folder.join(within)).map_err(said)?.flatten() {
                let name = entry.file_name().to_string_lossy().into_owned();
                if is_table(&name) || name.ends_with(".svg") || name == "model.toml" {
                    let bytes = fs::read(entry.path()).map_err(said)?;
                    files.insert(format!("{within}/{name}"), bytes);
                }
            }
        }
        let summary = fs::read_to_string(folder.join("summary.json")).map_err(said)?;
        let mut summary: Value = serde_json::from_str(&summary).map_err(|e| e.to_string())?;
        for other in ["wall_seconds", "seconds_per_step", "step_seconds", "command"] {
            summary[other] = Value::Null;
        }
        files.insert("/summary.json".into(), summary.to_string().into_bytes());
        Ok(Self(files))
    }

    /// Where they first differ, in words.
    pub(super) fn difference(&self, expected: &Self) -> Option<String> {
        let names = |of: &Self| of.0.keys().cloned().collect::<Vec<_>>();
        if names(self) != names(expected) {
            return Some(format!("other files: {:?}, not {:?}", names(self), names(expected)));
        }
        let mut pairs = self.0.iter().zip(&expected.0);
        pairs.find(|((_, found), (_, expected))| found != expected).map(
            |((name, found), (_, other))| {
                let at = found.iter().zip(other).position(|(a, b)| a != b);
                let (length, whole) = (found.len(), other.len());
                format!("{name} differs at byte {at:?}; it has {length} bytes, not {whole}")
            },
        )
    }

    /// The files of tables with their contents.
    pub(super) fn tables(&self) -> impl Iterator<Item = (&str, &[u8])> {
        let named = self.0.iter().map(|(name, bytes)| (name.trim_start_matches('/'), &bytes[..]));
        named.filter(|(name, _)| is_table(name))
    }
}

fn is_table(name: &str) -> bool {
    name.ends_with(".csv")
}

/// A table with a row that is not whole, in words.
pub(super) fn torn(folder: &Path) -> Option<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| is_table(name)).find_map(|name| {
        let text = fs::read_to_string(folder.join(&name)).ok()?;
        let fields = |row: &str| row.split(',').count();
        let columns = text.lines().next().map(fields);
        let whole = text.is_empty() || text.ends_with('\n');
        let equal = text.lines().all(|row| Some(fields(row)) == columns);
        (!whole || !equal).then(|| format!("{name} has a torn row"))
    })
}
