//! The defects made on purpose, of all harnesses, and how soon each is found.

use crate::fuzz::defects::FuzzDefect;
use crate::fuzz::lane::{Lane, LaneWatch};
use crate::fuzz::targets;
use crate::interrupt::{self, defects::InterruptDefect};
use crate::soak::defects::SoakDefect;
use crate::soak::found_after;

/// Which harness, and what is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PlantedDefect {
    Soak(SoakDefect),
    Fuzz(FuzzDefect, &'static str),
    Interrupt(InterruptDefect),
}

/// A defect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mutant {
    /// The harness, with the target.
    pub harness: &'static str,
    /// What is wrong.
    pub name: &'static str,
    kind: PlantedDefect,
}

/// Mechanisms or executions in which a defect must be found.
const MOST: u64 = 3000;
/// Runs in which one must be found.
const RUNS: u64 = 50;

/// All of them.
#[must_use]
pub fn all() -> Vec<Mutant> {
    let soak = SoakDefect::ALL.map(|defect| Mutant {
        harness: "soak",
        name: defect.name(),
        kind: PlantedDefect::Soak(defect),
    });
    let checked = ["model", "expression", "assembly", "checkpoint", "state", "sweep"];
    let skipped = checked.map(|target| (FuzzDefect::Accept, target));
    let others = FuzzDefect::ALL.into_iter().filter(|defect| *defect != FuzzDefect::Accept);
    let fuzz = others.map(|defect| (defect, "model")).chain(skipped);
    let fuzz = fuzz.map(|(defect, target)| Mutant {
        harness: target,
        name: defect.name(),
        kind: PlantedDefect::Fuzz(defect, target),
    });
    let interrupt = InterruptDefect::ALL.map(|defect| Mutant {
        harness: "interrupt",
        name: defect.name(),
        kind: PlantedDefect::Interrupt(defect),
    });
    soak.into_iter().chain(fuzz).chain(interrupt).collect()
}

impl Mutant {
    /// Mechanisms, executions or runs after which it is found.
    #[must_use]
    pub fn found_after(&self) -> Option<u64> {
        match self.kind {
            PlantedDefect::Soak(defect) => found_after(defect, 1, MOST),
            PlantedDefect::Interrupt(defect) => interrupt::found_after(defect, 1, RUNS),
            PlantedDefect::Fuzz(defect, name) => {
                let all = targets::all();
                let target = all.iter().find(|target| target.name() == name)?;
                let lane = Lane { seed: 1, number: 0, length: MOST };
                let watch = LaneWatch::new(name, &std::env::temp_dir());
                let tally = lane.run(&**target, &watch, Some(defect));
                let own =
                    tally.faults.values().filter(|(_, case)| case.words.contains(defect.words()));
                own.map(|(_, case)| case.execution).min()
            }
        }
    }
}
