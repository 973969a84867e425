//! Reading a model that the command line names.

use std::path::Path;

use holonom::experiment::RunnableModel;
use holonom::model::ModelText;
use holonom::run::prepare;
use holonom::{Model, ModelError, Override};

use crate::arguments::ModelArguments;
use crate::diagnostic::InvalidModel;
use crate::failure::Failure;
use crate::{memory, stdout};

/// A model file, as far as it could be read, once: standard input cannot be read again.
pub(crate) struct ModelInput<'a> {
    arguments: &'a ModelArguments,
    overrides: Vec<Override>,
    json: bool,
    text: ModelText,
}

impl<'a> ModelInput<'a> {
    pub(crate) fn new(arguments: &'a ModelArguments, overrides: Vec<Override>, json: bool) -> Self {
        let text = ModelText::read(&arguments.model);
        Self { arguments, overrides, json, text }
    }

    /// With a text that is at hand.
    pub(crate) fn of(
        arguments: &'a ModelArguments,
        overrides: Vec<Override>,
        json: bool,
        text: ModelText,
    ) -> Self {
        Self { arguments, overrides, json, text }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.arguments.model
    }

    pub(crate) fn text(&self) -> &ModelText {
        &self.text
    }

    pub(crate) fn overrides(&self) -> &[Override] {
        &self.overrides
    }

    /// Reads and checks the model. With `json`, problems go to standard output too.
    pub(crate) fn read(&self) -> Result<Model, Failure> {
        self.assemble_as(|_| Ok(())).map(|(model, ())| model)
    }

    /// The same, and assembles it.
    pub(crate) fn assemble(&self) -> Result<(Model, Box<dyn RunnableModel>), Failure> {
        self.assemble_as(prepare)
    }

    /// The same, assembled by `make`.
    pub(crate) fn assemble_as<T>(
        &self,
        make: impl FnOnce(&Model) -> Result<T, ModelError>,
    ) -> Result<(Model, T), Failure> {
        let model = self.text.model(&self.overrides);
        if let Ok(model) = &model {
            memory::check(model)?;
        }
        let assembled = model.and_then(|model| {
            let made = make(&model)?;
            Ok((model, made))
        });
        match assembled {
            Ok(both) => Ok(both),
            Err(error) => Err(self.refused(error)?),
        }
    }

    /// A model that could be read and cannot be assembled.
    pub(crate) fn refused(&self, error: ModelError) -> Result<Failure, Failure> {
        let (path, overrides) = (self.arguments.model.clone(), self.overrides.clone());
        let invalid = InvalidModel { path, text: self.text.clone(), overrides, error };
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
