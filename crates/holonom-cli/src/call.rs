//! A call of the program within another process: what it would print is collected, and a run that
//! lasts is interrupted.

use std::ffi::OsString;

use crate::arguments::{Cli, Verb};
use crate::captured::{Called, capture};
use crate::dispatch;

/// A command line that is understood.
pub struct Call(Verb);

impl std::fmt::Debug for Call {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Call").finish_non_exhaustive()
    }
}

impl Call {
    /// Reads a command line, the name of the program first.
    ///
    /// # Errors
    /// The answer to one that is not understood, or that asks for help.
    pub fn new(words: impl IntoIterator<Item = OsString>) -> Result<Self, Called> {
        Cli::read(words).map(|cli| Self(cli.verb)).map_err(|error| {
            let code = u8::try_from(error.exit_code()).unwrap_or(2);
            let said = error.render().to_string().into_bytes();
            match error.use_stderr() {
                true => Called { code, error: said, ..Called::default() },
                false => Called { code, output: said, ..Called::default() },
            }
        })
    }

    /// Whether its work has a bound, or can be interrupted: measurements of many runs can not.
    #[must_use]
    pub fn is_interruptible(&self) -> bool {
        !matches!(self.0, Verb::Compare(_) | Verb::Bench(_) | Verb::Verify(_))
    }

    /// Does what is asked for, with the files of the current folder of this process. A run that
    /// takes more than `patience` steps is interrupted as by SIGTERM, a sweep after as many points
    /// and steps.
    #[must_use]
    pub fn answer(self, patience: u64) -> Called {
        capture(patience, || dispatch::code(self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::captured::is_captured;

    fn called(words: &[&str]) -> Called {
        let words = std::iter::once("holonom").chain(words.iter().copied()).map(OsString::from);
        Call::new(words).map_or_else(|called| called, |call| call.answer(100))
    }

    #[test]
    fn a_call_prints_into_its_answer() {
        let listed = called(&["examples", "pendulum"]);
        let text = String::from_utf8_lossy(&listed.output).into_owned();
        assert!(listed.code == 0 && text.contains("[simulation]"), "{listed:?}");
        let unknown = called(&["examples", "pendulun"]);
        let text = String::from_utf8_lossy(&unknown.error).into_owned();
        assert!(unknown.code == 2 && text.contains("`pendulum`"), "{text}");
        for (word, meant) in [("rn", "'run'"), ("chek", "'check'"), ("sim", "Usage")] {
            let text = String::from_utf8_lossy(&called(&[word]).error).into_owned();
            assert!(text.contains(meant), "{word}: {text}");
        }
        let refused = called(&["runn"]);
        assert!(refused.code == 2 && !refused.error.is_empty() && refused.output.is_empty());
        let help = called(&["--help"]);
        assert!(help.code == 0 && help.error.is_empty() && !help.output.is_empty());
        assert!(!is_captured(), "the next one prints");
    }

    #[test]
    fn a_run_that_lasts_is_interrupted() {
        let folder = std::env::temp_dir().join(format!("holonom-lasting-{}", std::process::id()));
        let path = folder.join("pendulum.toml").display().to_string();
        let out = folder.join("out").display().to_string();
        assert_eq!(called(&["examples", "pendulum", "-o", &path]).code, 1, "there is no folder");
        std::fs::create_dir_all(&folder).expect("a temporary folder");
        assert_eq!(called(&["examples", "pendulum", "-o", &path]).code, 0);
        let run = called(&["run", &path, "-o", &out, "--step", "1e-6", "-q"]);
        let said = String::from_utf8_lossy(&run.error).into_owned();
        println!("{}: {said}", run.code);
        assert!(run.code == 143 && said.contains("holonom resume"), "{said}");
        std::fs::remove_dir_all(&folder).expect("it was written");
    }
}
