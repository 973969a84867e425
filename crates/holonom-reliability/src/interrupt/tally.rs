//! Many experiments in numbers.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An experiment with a fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Case {
    /// The experiment.
    pub index: u64,
    /// What is wrong.
    pub words: String,
}

/// Experiments of one kind.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    /// How many.
    pub experiments: u64,
    /// Disturbances: signals, full disks, damaged files.
    pub disturbances: u64,
    /// Runs that could not be continued, said so and were begun anew.
    pub anew: u64,
    /// Those with a fault.
    pub faults: Vec<Case>,
}

/// Experiments by kind.
pub type Tally = BTreeMap<String, Row>;

/// Adds a part.
pub fn add(all: &mut Tally, part: Tally) {
    for (kind, row) in part {
        let own = all.entry(kind).or_default();
        own.experiments += row.experiments;
        own.disturbances += row.disturbances;
        own.anew += row.anew;
        own.faults.extend(row.faults);
        own.faults.sort_by_key(|case| case.index);
    }
}
