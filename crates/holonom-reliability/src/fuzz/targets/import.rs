//! Robots in URDF and MJCF.

use super::{Answer, FuzzTarget, Worker, repository};
use holonom::Model;
use holonom::import::{ImportError, ImportOptions, Imported, import_text};
use std::path::{Path, PathBuf};

/// Descriptions of robots; files that they name are not there.
#[derive(Clone, Copy, Debug)]
pub struct RobotDescriptions;

/// The descriptions of the tests, the smaller ones: an input is mutated in a few places only.
const LARGEST: usize = 8000;

impl FuzzTarget for RobotDescriptions {
    fn name(&self) -> &'static str {
        "import"
    }

    fn executions(&self) -> u64 {
        300_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let folders = ["gymnasium", "example-robot-data", "dm_control"];
        let mut files: Vec<PathBuf> = folders
            .iter()
            .flat_map(|folder| std::fs::read_dir(repository("tests/imported").join(folder)))
            .flatten()
            .filter_map(|entry| Some(entry.ok()?.path()))
            .collect();
        files.sort();
        let texts = files.iter().filter_map(|path| std::fs::read(path).ok());
        texts.filter(|text| text.len() <= LARGEST).collect()
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(Translator)
    }
}

struct Translator;

impl Worker for Translator {
    fn execute(&mut self, input: &[u8]) -> Answer {
        translated(input, "")
    }

    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        translated(input, "[model]\n")
    }
}

/// `surplus`: text before that of the model.
fn translated(input: &[u8], surplus: &str) -> Answer {
    let text = String::from_utf8_lossy(input);
    match import_text(&text, Path::new("robot.xml"), &ImportOptions::default()) {
        Ok(Imported { text, model, .. }) => match Model::from_toml(&format!("{surplus}{text}")) {
            Ok(again) if again == model => Answer::Accepted,
            _ => Answer::Wrong("accepted: the text gives another model".into()),
        },
        Err(ImportError::Invalid { problems, .. }) => match problems.first() {
            Some(problem) if !problem.message.is_empty() => {
                Answer::Refused(problem.message.clone())
            }
            _ => Answer::Wrong("a refusal without words".into()),
        },
        Err(error) => Answer::Refused(error.to_string()),
    }
}
