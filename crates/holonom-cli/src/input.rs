//! Reading a model that the command line names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use holonom::experiment::Experiment;
use holonom::model::ModelText;
use holonom::run::prepare;
use holonom::{Model, ModelError, Override};

use crate::arguments::ModelArguments;
use crate::diagnostic::InvalidModel;
use crate::failure::Failure;
use crate::{memory, stdout};

/// The text of a model file. A stream, as standard input, can be read once: later calls return what
/// was read of it.
pub(crate) fn text_of(path: &Path) -> ModelText {
    static STREAMS: Mutex<BTreeMap<PathBuf, ModelText>> = Mutex::new(BTreeMap::new());
    if path.is_file() {
        return ModelText::read(path);
    }
    let mut streams = STREAMS.lock().unwrap_or_else(PoisonError::into_inner);
    streams.entry(path.to_owned()).or_insert_with(|| ModelText::read(path)).clone()
}

/// A model file, as far as it could be read.
pub(crate) struct Input<'a> {
    arguments: &'a ModelArguments,
    overrides: Vec<Override>,
    json: bool,
    text: Option<ModelText>,
}

impl<'a> Input<'a> {
    pub(crate) fn new(arguments: &'a ModelArguments, overrides: Vec<Override>, json: bool) -> Self {
        Self { arguments, overrides, json, text: None }
    }

    /// With a text that is at hand.
    pub(crate) fn of(self, text: ModelText) -> Self {
        Self { text: Some(text), ..self }
    }

    fn text(&mut self) -> ModelText {
        self.text.take().unwrap_or_else(|| text_of(&self.arguments.model))
    }

    /// Reads and checks the model. With `json`, problems go to standard output too.
    pub(crate) fn read(self) -> Result<Model, Failure> {
        self.assemble_as(|_| Ok(())).map(|(model, ())| model)
    }

    /// The same, and assembles it.
    pub(crate) fn assemble(self) -> Result<(Model, Box<dyn Experiment>), Failure> {
        self.assemble_as(prepare)
    }

    /// The same, assembled by `make`.
    pub(crate) fn assemble_as<T>(
        self,
        make: impl FnOnce(&Model) -> Result<T, ModelError>,
    ) -> Result<(Model, T), Failure> {
        self.with_text(make).map(|(_, model, made)| (model, made))
    }

    /// The same with the text of the model.
    pub(crate) fn with_text<T>(
        mut self,
        make: impl FnOnce(&Model) -> Result<T, ModelError>,
    ) -> Result<(ModelText, Model, T), Failure> {
        let text = self.text();
        let model = text.model(&self.overrides);
        if let Ok(model) = &model {
            memory::check(model)?;
        }
        let assembled = model.and_then(|model| {
            let made = make(&model)?;
            Ok((model, made))
        });
        match assembled {
            Ok((model, made)) => Ok((text, model, made)),
            Err(error) => Err(self.invalid(text, error)?),
        }
    }

    /// A model that could be read and cannot be assembled.
    pub(crate) fn refused(mut self, error: ModelError) -> Result<Failure, Failure> {
        let text = self.text();
        self.invalid(text, error)
    }

    fn invalid(self, text: ModelText, error: ModelError) -> Result<Failure, Failure> {
        let (path, overrides) = (self.arguments.model.clone(), self.overrides);
        let invalid = InvalidModel { path, text, overrides, error };
        if self.json {
            // The exit code must say that the model is invalid, whoever reads.
            match stdout::json(&invalid.to_json()) {
                Ok(()) | Err(Failure::Closed) => {}
                Err(other) => return Err(other),
            }
        }
        Ok(Failure::Model(Box::new(invalid)))
    }
}
