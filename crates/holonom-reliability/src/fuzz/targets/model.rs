//! Model files with overrides: parsing, checks, the text of the result.
//!
//! Lines `#--set KEY=VALUE` of an input are overrides. Lines `#--file` divide it into the model and
//! files that it may include: `1.toml`, `2.toml`.

use super::{Answer, FuzzTarget, Worker, files};
use crate::fuzz::{mutate, structure};
use crate::scratch::ScratchFolder;
use crate::soak::draw::Draw;
use holonom::Model;
use holonom::model::{ModelError, ModelText, Override, Problem};
use std::fs;

/// Model files.
#[derive(Clone, Copy, Debug)]
pub struct ModelFile;

impl FuzzTarget for ModelFile {
    fn name(&self) -> &'static str {
        "model"
    }

    fn executions(&self) -> u64 {
        3_000_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        seeds()
    }

    fn mutate(&self, input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
        mixed(input, other, draw)
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(ModelReader { scratch: None })
    }
}

/// Small models of the repository.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let folders =
        [("examples/models", 3000), ("tests/hostile", 1500), ("tests/corpus/model", 8000)];
    folders.iter().flat_map(|(folder, most)| files(folder, *most)).collect()
}

/// Half of the mutations are of the structure, if there is one.
pub(super) fn mixed(input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
    let structured = draw.chance(0.5).then(|| structure::toml(input, other, draw)).flatten();
    structured.unwrap_or_else(|| mutate::bytes(input, other, draw))
}

/// The model of an input.
pub(super) fn read(text: &str) -> Result<Model, ModelError> {
    Model::from_toml_with(text, &overrides(text))
}

fn overrides(text: &str) -> Vec<Override> {
    let set = |line: &str| {
        let (key, value) = line.strip_prefix("#--set ")?.split_once('=')?;
        Some(Override::new(key.trim(), value.trim()))
    };
    text.lines().filter_map(set).collect()
}

struct ModelReader {
    /// Where inputs of several files are written; made when the first of them comes.
    scratch: Option<ScratchFolder>,
}

impl ModelReader {
    /// Reads an input of one text or of several files; the problems of a refusal have their texts.
    fn read(&mut self, text: &str) -> Result<Model, Vec<(Problem, String)>> {
        let with = |text: String| move |problem: Problem| (problem, text.clone());
        let Some((first, others)) = text.split_once("\n#--file\n") else {
            let refused = |error: &ModelError| error.problems(text);
            let located = |problems: Vec<Problem>| problems.into_iter().map(with(text.to_owned()));
            return read(text).map_err(|error| located(refused(&error)).collect());
        };
        let failed = |words: String| vec![(Problem::new("", words), String::new())];
        let folder = self.scratch.get_or_insert_with(|| ScratchFolder::new("includes")).path();
        let write = |name: &str, text: &str| {
            fs::write(folder.join(name), text).map_err(|error| failed(error.to_string()))
        };
        write("0.toml", first)?;
        for (k, other) in others.split("\n#--file\n").take(4).enumerate() {
            write(&format!("{}.toml", k + 1), other)?;
        }
        let read = ModelText::read(&folder.join("0.toml"));
        read.model(&overrides(text)).map_err(|error| {
            let located = read.problems(&error).into_iter();
            located.map(|found| (found.problem, found.file.text.clone())).collect()
        })
    }
}

impl Worker for ModelReader {
    fn execute(&mut self, input: &[u8]) -> Answer {
        self.judged(input, &|model| model.to_toml())
    }

    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        self.judged(input, &|model| {
            let mut model = model.clone();
            model.settings.every += 1; // another model is written
            model.to_toml()
        })
    }
}

impl ModelReader {
    fn judged(&mut self, input: &[u8], written: &dyn Fn(&Model) -> String) -> Answer {
        let Ok(text) = std::str::from_utf8(input) else { return Answer::Refused("no text".into()) };
        let model = match self.read(text) {
            Ok(model) => model,
            Err(problems) => return in_words(&problems),
        };
        match Model::from_toml(&written(&model)) {
            Ok(again) if again == model => Answer::Accepted,
            Ok(_) => Answer::Wrong("accepted, and its text gives another model".into()),
            Err(error) => Answer::Wrong(format!("accepted, and its text is refused: {error}")),
        }
    }
}

/// The refusal of a text.
pub(super) fn refused(error: &ModelError, text: &str) -> Answer {
    let problems = error.problems(text).into_iter();
    in_words(&problems.map(|problem| (problem, text.to_owned())).collect::<Vec<_>>())
}

/// A refusal: every problem has words and a place that can be shown.
fn in_words(problems: &[(Problem, String)]) -> Answer {
    for (problem, text) in problems {
        if problem.message.is_empty() {
            return Answer::Wrong(format!("a problem without words: {problem:?}"));
        }
        if let Some(span) = &problem.span {
            if text.get(span.clone()).is_none() {
                return Answer::Wrong(format!("a place outside of the text: {span:?}"));
            }
            let _ = holonom::model::line_column(text, span.start);
        }
    }
    match problems.first() {
        Some((first, _)) => Answer::Refused(first.message.clone()),
        None => Answer::Wrong("a refusal without problems".to_owned()),
    }
}
