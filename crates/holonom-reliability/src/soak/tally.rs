//! What many mechanisms gave: counts, reasons, the largest numbers. Sums do not depend on the order
//! of the parts.

use super::fault::Violation;
use super::judge::{Ending, JudgedMechanism};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The largest number found, and in which mechanism.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorstMechanism {
    /// How many were measured.
    pub count: u64,
    /// The number.
    pub value: f64,
    /// The mechanism; the first of several.
    pub index: u64,
}

impl WorstMechanism {
    fn add(&mut self, other: Self) {
        let order = other.value.total_cmp(&self.value).then(self.index.cmp(&other.index));
        if other.count > 0 && (self.count == 0 || order.is_gt()) {
            (self.value, self.index) = (other.value, other.index);
        }
        self.count += other.count;
    }

    fn one(value: Option<f64>, index: u64) -> Self {
        value.map_or_else(Self::default, |value| Self { count: 1, value, index })
    }
}

/// A reason for which mechanisms ended early.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reason {
    /// How many mechanisms.
    pub count: u64,
    /// The first of them.
    pub first: u64,
}

/// A mechanism with a fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultyMechanism {
    /// The mechanism.
    pub index: u64,
    /// What is wrong.
    pub fault: Violation,
}

/// The result of a part of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SoakTally {
    /// Mechanisms tried.
    pub mechanisms: u64,
    /// Those that reached their last step.
    pub done: u64,
    /// Those that were refused, by reason.
    pub refused: BTreeMap<String, Reason>,
    /// Those of which a step was refused, by reason.
    pub failed: BTreeMap<String, Reason>,
    /// Runs that were continued from a stored state.
    pub restarted: u64,
    /// Certificates of mechanisms without a degree of freedom.
    #[serde(default)]
    pub certified: u64,
    /// Constraint residuals.
    pub residual: WorstMechanism,
    /// Momentum maps.
    pub momentum: WorstMechanism,
    /// Energy balances.
    pub energy: WorstMechanism,
    /// Differences of schemes.
    pub agreement: WorstMechanism,
    /// Differences of mechanisms stated otherwise.
    #[serde(default)]
    pub restated: WorstMechanism,
    /// Energy gained by contact.
    #[serde(default)]
    pub gain: WorstMechanism,
    /// What is wrong.
    pub faults: Vec<FaultyMechanism>,
}

impl SoakTally {
    /// Adds a mechanism.
    pub fn take(&mut self, index: u64, judged: JudgedMechanism) {
        let JudgedMechanism { ending, measured, fault } = judged;
        self.mechanisms += 1;
        let one = |reason: String| BTreeMap::from([(reason, Reason { count: 1, first: index })]);
        match ending {
            Ending::Done => self.done += 1,
            Ending::Refused(reason) => join(&mut self.refused, one(reason)),
            Ending::Failed(reason) => join(&mut self.failed, one(reason)),
        }
        self.restarted += u64::from(measured.restarted);
        self.certified += u64::from(measured.certified);
        self.residual.add(WorstMechanism::one(measured.residual, index));
        self.momentum.add(WorstMechanism::one(measured.momentum, index));
        self.energy.add(WorstMechanism::one(measured.energy, index));
        self.agreement.add(WorstMechanism::one(measured.agreement, index));
        self.restated.add(WorstMechanism::one(measured.restated, index));
        self.gain.add(WorstMechanism::one(measured.gain, index));
        self.faults.extend(fault.map(|fault| FaultyMechanism { index, fault }));
    }

    /// Adds another part.
    pub fn add(&mut self, other: Self) {
        self.mechanisms += other.mechanisms;
        self.done += other.done;
        join(&mut self.refused, other.refused);
        join(&mut self.failed, other.failed);
        self.restarted += other.restarted;
        self.certified += other.certified;
        self.residual.add(other.residual);
        self.momentum.add(other.momentum);
        self.energy.add(other.energy);
        self.agreement.add(other.agreement);
        self.restated.add(other.restated);
        self.gain.add(other.gain);
        self.faults.extend(other.faults);
        self.faults.sort_by_key(|case| case.index);
    }

    /// How many mechanisms have one of these reasons.
    #[must_use]
    pub fn count(reasons: &BTreeMap<String, Reason>) -> u64 {
        reasons.values().map(|reason| reason.count).sum()
    }
}

fn join(all: &mut BTreeMap<String, Reason>, more: BTreeMap<String, Reason>) {
    for (words, reason) in more {
        let own = all.entry(words).or_insert(Reason { count: 0, first: reason.first });
        own.count += reason.count;
        own.first = own.first.min(reason.first);
    }
}
