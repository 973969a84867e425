//! The list of defects: `xtask/mutants.toml`.

use holonom_reliability::text_file;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A defect of the sources.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mutant {
    /// What is wrong.
    pub name: String,
    /// Where the theory says how it should be.
    pub source: String,
    /// What is changed.
    pub edits: Vec<Edit>,
    /// The test that names the defect.
    pub test: Test,
}

/// A change of a source.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edit {
    /// The file, from the root of the repository.
    pub file: String,
    /// What stands there, once.
    pub from: String,
    /// What is put in its place.
    pub to: String,
}

/// A test of the workspace.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Test {
    /// Its package.
    pub package: String,
    /// `lib`, or the name of a test binary.
    pub binary: String,
    /// Its path in the binary.
    pub name: String,
    /// Of the package, where it needs some.
    #[serde(default)]
    pub features: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    mutant: Vec<Mutant>,
}

/// All defects.
///
/// # Errors
/// Where the list cannot be read.
pub fn all(root: &Path) -> Result<Vec<Mutant>, String> {
    let path = root.join("xtask/mutants.toml");
    let list: List = toml::from_str(&text_file::read(&path)?)
        .map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(list.mutant)
}

impl Edit {
    /// The text of the file with the defect.
    ///
    /// # Errors
    /// Where the file does not hold the text exactly once.
    pub fn planted(&self, text: &str) -> Result<String, String> {
        let Self { file, from, to } = self;
        match text.matches(from.as_str()).count() {
            1 => Ok(text.replacen(from.as_str(), to, 1)),
            count => Err(format!("{file} holds {count} times, not once: {from}")),
        }
    }
}

impl Test {
    /// The folder of its sources, from the root.
    fn folder(&self) -> PathBuf {
        let own = match self.package.as_str() {
            "xtask" => PathBuf::from("xtask"),
            package => Path::new("crates").join(package),
        };
        match (self.package.as_str(), self.binary.as_str()) {
            (_, "lib") => own.join("src"),
            ("holonom" | "holonom-cli" | "xtask", _) => "tests".into(),
            _ => own.join("tests"),
        }
    }

    /// Whether a source of the binary has a function of its name.
    ///
    /// # Errors
    /// Where the folder cannot be read.
    pub fn exists(&self, root: &Path) -> Result<bool, String> {
        let name = self.name.rsplit("::").next().unwrap_or_default();
        let wanted = [format!("fn {name}()"), format!("{name} {{")];
        holds(&root.join(self.folder()), &wanted)
    }

    /// The choice of its binary among those of the workspace.
    #[must_use]
    pub fn choice(&self) -> Vec<String> {
        let mut choice = vec!["-p".to_owned(), self.package.clone()];
        match self.binary.as_str() {
            "lib" => choice.push("--lib".into()),
            binary => choice.extend(["--test".to_owned(), binary.to_owned()]),
        }
        self.features.iter().for_each(|own| choice.extend(["--features".to_owned(), own.clone()]));
        choice
    }
}

/// Whether a source below a folder has one of these texts.
fn holds(folder: &Path, wanted: &[String]) -> Result<bool, String> {
    let failed = |error| format!("{}: {error}", folder.display());
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let found = match path.is_dir() {
            true => holds(&path, wanted)?,
            false if path.extension().is_some_and(|e| e == "rs") => {
                let text = text_file::read(&path)?;
                wanted.iter().any(|wanted| text.contains(wanted))
            }
            false => false,
        };
        if found {
            return Ok(true);
        }
    }
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::Edit;

    #[test]
    fn a_text_that_stands_twice_is_refused() {
        let edit = |from: &str| {
            let [file, to] = ["a.rs", "c"].map(str::to_owned);
            Edit { file, from: from.to_owned(), to }.planted("a b b")
        };
        assert_eq!(edit("a").as_deref(), Ok("c b b"));
        assert_eq!(edit("b").unwrap_err(), "a.rs holds 2 times, not once: b");
        assert!(edit("d").is_err());
    }
}
