//! Many experiments in numbers.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An experiment with a fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultyExperiment {
    /// The experiment.
    pub index: u64,
    /// What is wrong.
    pub words: String,
}

/// Experiments of one kind.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InterruptTally {
    /// How many.
    pub experiments: u64,
    /// Disturbances: signals, full disks, damaged files.
    pub disturbances: u64,
    /// Runs that could not be continued, said so and were begun anew.
    pub anew: u64,
    /// Those with a fault.
    pub faults: Vec<FaultyExperiment>,
}

/// Experiments by kind.
pub type InterruptTallies = BTreeMap<String, InterruptTally>;

/// Adds a part.
pub fn add(all: &mut InterruptTallies, part: InterruptTallies) {
    for (kind, row) in part {
        let own = all.entry(kind).or_default();
        own.experiments += row.experiments;
        own.disturbances += row.disturbances;
        own.anew += row.anew;
        own.faults.extend(row.faults);
        own.faults.sort_by_key(|case| case.index);
    }
}
