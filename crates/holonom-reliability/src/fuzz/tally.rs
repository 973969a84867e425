//! What many executions gave. All but the times depends on seed and number alone.

use crate::soak::tally::Reason;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// An input with a fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultyInput {
    /// The lane and the execution in it.
    pub lane: u64,
    /// The execution.
    pub execution: u64,
    /// What is wrong.
    pub words: String,
    /// The input.
    pub input: Vec<u8>,
}

/// The result of a number of executions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FuzzTally {
    /// Executions.
    pub executions: u64,
    /// Inputs that were accepted.
    pub accepted: u64,
    /// Kinds of refusals.
    pub shapes: BTreeSet<String>,
    /// Largest memory in use, bytes.
    pub memory: u64,
    /// Longest time, s.
    #[serde(skip)]
    pub slowest: f64,
    /// The input that took it.
    #[serde(skip)]
    pub slowest_input: Vec<u8>,
    /// What is wrong, one of each kind.
    pub faults: BTreeMap<String, (Reason, FaultyInput)>,
}

impl FuzzTally {
    /// Adds another part.
    pub fn add(&mut self, other: Self) {
        self.executions += other.executions;
        self.accepted += other.accepted;
        self.shapes.extend(other.shapes);
        self.memory = self.memory.max(other.memory);
        if other.slowest > self.slowest {
            (self.slowest, self.slowest_input) = (other.slowest, other.slowest_input);
        }
        for (kind, (reason, case)) in other.faults {
            let own = self.faults.entry(kind).or_insert_with(|| (Reason::default(), case.clone()));
            own.0.count += reason.count;
            if (case.lane, case.execution) < (own.1.lane, own.1.execution) {
                own.1 = case;
            }
        }
    }

    /// On a terminal.
    #[must_use]
    pub fn words(&self) -> String {
        let (mega, milli) = (self.memory as f64 / 1048576.0, 1e3 * self.slowest);
        let mut out = format!(
            "{} executions, {} accepted, {} kinds of refusals, slowest {milli:.1} ms, largest memory {mega:.1} MiB, \
             {} kinds of faults",
            self.executions,
            self.accepted,
            self.shapes.len(),
            self.faults.len()
        );
        for (kind, (reason, case)) in &self.faults {
            out += &format!("\n  {} times, lane {}: {kind}", reason.count, case.lane);
        }
        out
    }

    /// Writes the inputs with faults and the slowest one.
    ///
    /// # Errors
    /// What cannot be written, in words.
    pub fn write(&self, target: &str, folder: &Path) -> Result<(), String> {
        let write = || -> std::io::Result<()> {
            std::fs::create_dir_all(folder)?;
            std::fs::write(folder.join(format!("{target}-slowest")), &self.slowest_input)?;
            for (k, (_, case)) in self.faults.values().enumerate() {
                std::fs::write(folder.join(format!("{target}-fault-{k}")), &case.input)?;
            }
            Ok(())
        };
        write().map_err(|error| format!("{}: {error}", folder.display()))
    }
}
