//! What several verbs share: a model with values of it to replace, its scheme, a number of steps.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PathBufValueParser, PossibleValuesParser, TypedValueParser};
use holonom::Override;
use holonom::model::Scheme;

/// What `run` and `check` share: a model, and values of it to replace.
#[derive(Args)]
pub(crate) struct ModelArguments {
    /// The model file (TOML); - is standard input
    #[arg(value_parser = model_file())]
    pub(crate) model: PathBuf,
    /// Replace a value of the model, such as body.top.mass=2.5; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub(crate) set: Vec<Override>,
}

/// A file; `-` is standard input.
fn model_file() -> impl TypedValueParser<Value = PathBuf> {
    let stdin = |path: &Path| path.as_os_str() == "-";
    PathBufValueParser::new().map(move |path| if stdin(&path) { "/dev/stdin".into() } else { path })
}

fn key_value(text: &str) -> Result<Override, String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
            Ok(Override::new(key.trim(), value.trim()))
        }
        _ => Err("write KEY=VALUE, such as body.top.mass=2.5".to_owned()),
    }
}

/// A scheme by its name in model files.
pub(super) fn scheme() -> impl TypedValueParser<Value = Scheme> {
    let all = Scheme::ALL.into_iter().chain([Scheme::Static]);
    PossibleValuesParser::new(all.clone().map(Scheme::name)).map(move |name| {
        all.clone().find(|scheme| scheme.name() == name).expect("it is one of the possible values")
    })
}

pub(super) fn steps(text: &str) -> Result<u64, String> {
    let number: Option<u64> = text.parse().ok();
    number.filter(|k| *k > 0).ok_or_else(|| "write a number of steps, at least 1".to_owned())
}
