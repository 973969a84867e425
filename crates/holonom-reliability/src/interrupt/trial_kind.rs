//! What is done to a run.

/// What is done to a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrialKind {
    /// The process is killed.
    Kill,
    /// The process gets SIGTERM or SIGINT.
    Signal,
    /// The disk is full.
    FullDisk,
    /// The process is killed, and a checkpoint is damaged.
    DamagedCheckpoint,
    /// The process is killed, and a table is cut.
    CutTable,
    /// Another run begins in the same folder.
    TwoRuns,
    /// Nobody reads what the program prints.
    NoReader,
}

impl TrialKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Kill,
        Self::Signal,
        Self::FullDisk,
        Self::DamagedCheckpoint,
        Self::CutTable,
        Self::TwoRuns,
        Self::NoReader,
    ];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Kill => "killed (SIGKILL)",
            Self::Signal => "interrupted (SIGTERM, SIGINT)",
            Self::FullDisk => "files cannot grow, as on a full disk",
            Self::DamagedCheckpoint => "killed, and a checkpoint damaged",
            Self::CutTable => "killed, and a table cut",
            Self::TwoRuns => "two runs at once in one folder",
            Self::NoReader => "standard output closed",
        }
    }
}
