//! What a certificate was made of, and by what.

use serde::{Deserialize, Serialize};

use super::sha256::sha256;

/// The commit of the sources, where a build states it in `HOLONOM_COMMIT`.
const COMMIT: Option<&str> = option_env!("HOLONOM_COMMIT");

/// Model and program of a certificate.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// The command, as a shell reads it.
    pub command: String,
    /// When, in universal time: `2008-09-30T12:34:56Z`.
    pub date: String,
    /// SHA-256 of the text of the model file.
    pub model_sha256: String,
    /// Replaced values of the model, `KEY=VALUE`.
    pub overrides: Vec<String>,
    /// Commit of the program, where its build states it.
    pub commit: Option<String>,
}

impl Provenance {
    /// Of the text of a model file and the values that are replaced in it.
    #[must_use]
    pub fn new(
        (command, date): (String, String),
        text: &str,
        overrides: &[(String, String)],
    ) -> Self {
        Self {
            command,
            date,
            model_sha256: sha256(text.as_bytes()),
            overrides: overrides.iter().map(|(key, value)| format!("{key}={value}")).collect(),
            commit: COMMIT.filter(|commit| !commit.is_empty()).map(str::to_owned),
        }
    }
}
