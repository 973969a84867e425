//! What a certificate was made of, and by what.

use hmac_sha256::Hash;
use holonom_model::Override;
use serde::{Deserialize, Serialize};

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
    pub fn new(command: String, date: String, text: &str, overrides: &[Override]) -> Self {
        Self {
            command,
            date,
            model_sha256: sha256(text.as_bytes()),
            overrides: overrides.iter().map(Override::to_string).collect(),
            commit: COMMIT.filter(|commit| !commit.is_empty()).map(str::to_owned),
        }
    }
}

/// The hash of a message, FIPS 180-4, in hexadecimal digits.
fn sha256(message: &[u8]) -> String {
    Hash::hash(message).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::sha256;

    /// Messages of the standard, and one million letters.
    #[test]
    fn messages_of_the_standard_have_their_hashes() {
        let two_blocks = b"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq";
        for (message, hash) in [
            (&b""[..], "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"),
            (b"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"),
            (two_blocks, "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"),
            (
                &[b'a'; 1_000_000],
                "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0",
            ),
        ] {
            assert_eq!(sha256(message), hash, "{} bytes", message.len());
        }
    }
}
