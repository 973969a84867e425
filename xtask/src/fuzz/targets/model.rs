//! Model files with overrides: parsing, checks, the text of the result.
//!
//! Lines `#--set KEY=VALUE` of an input are overrides.

use super::{Answer, Target, Worker, files};
use crate::fuzz::{mutate, structure};
use crate::soak::draw::Draw;
use holonom::Model;
use holonom::model::ModelError;

/// Model files.
#[derive(Clone, Copy, Debug)]
pub struct ModelFile;

impl Target for ModelFile {
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
        Box::new(Reader)
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
    let set = |line: &str| {
        let (key, value) = line.strip_prefix("#--set ")?.split_once('=')?;
        Some((key.trim().to_owned(), value.trim().to_owned()))
    };
    let overrides: Vec<(String, String)> = text.lines().filter_map(set).collect();
    Model::from_toml_with(text, &overrides)
}

struct Reader;

impl Worker for Reader {
    fn execute(&mut self, input: &[u8]) -> Answer {
        judged(input, &|model| model.to_toml())
    }

    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        judged(input, &|model| {
            let mut model = model.clone();
            model.settings.every += 1; // another model is written
            model.to_toml()
        })
    }
}

fn judged(input: &[u8], written: &dyn Fn(&Model) -> String) -> Answer {
    let Ok(text) = std::str::from_utf8(input) else { return Answer::Refused("no text".into()) };
    let model = match read(text) {
        Ok(model) => model,
        Err(error) => return refused(&error, text),
    };
    match Model::from_toml(&written(&model)) {
        Ok(again) if again == model => Answer::Accepted,
        Ok(_) => Answer::Wrong("accepted, and its text gives another model".into()),
        Err(error) => Answer::Wrong(format!("accepted, and its text is refused: {error}")),
    }
}

/// A refusal: every problem has words and a place that can be shown.
pub(super) fn refused(error: &ModelError, text: &str) -> Answer {
    let problems = error.problems(text);
    for problem in &problems {
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
    let kinds: Vec<&str> = problems.iter().map(|problem| problem.message.as_str()).collect();
    match kinds.first() {
        Some(first) => Answer::Refused((*first).to_owned()),
        None => Answer::Wrong(format!("a refusal without problems: {error:?}")),
    }
}
