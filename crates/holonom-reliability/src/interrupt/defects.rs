//! Defects between the program and the judge, which must be found.

use super::trial_kind::TrialKind;
use std::fs;
use std::path::Path;

/// What is wrong on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InterruptDefect {
    /// The last row of a table is missing.
    LostRow,
    /// A digit of a table is another one.
    OtherDigit,
    /// The summary counts other steps.
    OtherSummary,
    /// A plot shows the part after the last checkpoint only.
    OtherPlot,
    /// A row is not whole after the disk was full.
    TornRow,
    /// The program ends without words.
    NoWords,
    /// The program panics.
    Panic,
    /// The summary of an interrupted run says that it goes on.
    Unnoticed,
    /// A table of another run.
    Mixed,
}

impl InterruptDefect {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::LostRow,
        Self::OtherDigit,
        Self::OtherSummary,
        Self::OtherPlot,
        Self::TornRow,
        Self::NoWords,
        Self::Panic,
        Self::Unnoticed,
        Self::Mixed,
    ];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LostRow => "a continued run lacks its last row",
            Self::OtherDigit => "a digit of a continued run is another one",
            Self::OtherSummary => "the summary of a continued run counts another step",
            Self::OtherPlot => "a plot of a continued run ends early",
            Self::TornRow => "half a row after a full disk",
            Self::NoWords => "no words after a full disk",
            Self::Panic => "a panic at a signal",
            Self::Unnoticed => "a summary that does not know of the signal",
            Self::Mixed => "a table of the other of two runs",
        }
    }

    /// The experiments that it is made in.
    #[must_use]
    pub fn kind(self) -> TrialKind {
        match self {
            Self::TornRow | Self::NoWords => TrialKind::FullDisk,
            Self::Panic | Self::Unnoticed => TrialKind::Signal,
            Self::Mixed => TrialKind::TwoRuns,
            _ => TrialKind::Kill,
        }
    }

    /// What the judge says of it.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::LostRow | Self::Mixed => "trajectory.csv differs",
            Self::OtherDigit => "energy.csv differs",
            Self::OtherSummary => "summary.json differs",
            Self::OtherPlot => "energy.svg differs",
            Self::TornRow => "torn row",
            Self::NoWords => "without words",
            Self::Panic => "panic",
            Self::Unnoticed => "the summary says",
        }
    }

    /// Makes it in a folder, where it belongs there.
    pub(super) fn spoil(self, folder: &Path) {
        let edit = |name: &str, change: &dyn Fn(String) -> String| {
            let path = folder.join(name);
            if let Ok(text) = fs::read_to_string(&path) {
                let _ = fs::write(&path, change(text)); // a defect that is not made is not found
            }
        };
        match self {
            Self::LostRow => edit("trajectory.csv", &|text| {
                let rows = text.trim_end().rsplit_once('\n').map(|(rows, _)| format!("{rows}\n"));
                rows.unwrap_or(text)
            }),
            Self::OtherDigit => edit("energy.csv", &|mut text| {
                let last = text.rfind(|c: char| c.is_ascii_digit()).unwrap_or(0);
                let other = if text[last..].starts_with('7') { "8" } else { "7" };
                text.replace_range(last..=last, other);
                text
            }),
            Self::OtherSummary => {
                edit("summary.json", &|text| text.replacen("\"steps\": ", "\"steps\": 1", 1));
            }
            Self::OtherPlot => {
                edit("plots/energy.svg", &|text| text.replacen("</svg>", "<g/></svg>", 1))
            }
            Self::TornRow => edit("trajectory.csv", &|text| text + "1.5,2"),
            Self::Unnoticed => {
                edit("summary.json", &|text| text.replacen("\"interrupted\"", "\"running\"", 1));
            }
            Self::NoWords | Self::Panic | Self::Mixed => {} // in the experiment
        }
    }
}
