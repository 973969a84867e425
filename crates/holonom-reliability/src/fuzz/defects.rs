//! Defects made on purpose around a target: the harness must find each.

use super::targets::{Answer, Worker};

/// One thing made wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FuzzDefect {
    /// A zero byte panics.
    Panic,
    /// The text `nan` takes a minute.
    Hang,
    /// The text `1e308` takes half a gigabyte.
    Memory,
    /// Errors have no words.
    Words,
    /// A wrong answer is not noticed: damaged files are accepted, texts give other models.
    Accept,
}

impl FuzzDefect {
    /// All.
    pub const ALL: [Self; 5] = [Self::Panic, Self::Hang, Self::Memory, Self::Words, Self::Accept];

    /// What is wrong, in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Panic => "a panic where the input has a zero byte",
            Self::Hang => "a minute of work where the input has the text `nan`",
            Self::Memory => "half a gigabyte where the input has the text `1e308`",
            Self::Words => "errors without words",
            Self::Accept => "a check is left out: what it refuses is accepted",
        }
    }

    /// What the fault says.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Panic => "on purpose",
            Self::Hang => "too long",
            Self::Memory => "too much memory",
            Self::Words => "without words",
            Self::Accept => "accepted",
        }
    }

    /// Executes an input, with the defect.
    pub(super) fn execute(defect: Option<Self>, worker: &mut dyn Worker, input: &[u8]) -> Answer {
        let has = |text: &[u8]| input.windows(text.len()).any(|part| part == text);
        match defect {
            Some(Self::Panic) => assert!(!input.contains(&0), "on purpose"),
            Some(Self::Memory) if has(b"1e308") => {
                let block: Vec<u8> = Vec::with_capacity(512 << 20);
                assert!(std::hint::black_box(&block).is_empty());
            }
            Some(Self::Words) => {
                return match worker.execute(input) {
                    Answer::Refused(_) => Answer::Refused(String::new()),
                    answer => answer,
                };
            }
            Some(Self::Accept) => return worker.execute_unchecked(input),
            Some(Self::Hang) if has(b"nan") => HANGS.set(true),
            _ => {}
        }
        worker.execute(input)
    }

    /// The time that an execution took, s; with the defect a minute more.
    pub(super) fn time(defect: Option<Self>, seconds: f64) -> f64 {
        let hangs = defect == Some(Self::Hang) && HANGS.replace(false);
        if hangs { seconds + 60.0 } else { seconds }
    }
}

thread_local! {
    static HANGS: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}
