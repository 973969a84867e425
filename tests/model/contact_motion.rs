//! A motion with contacts, its energies, and what its contacts were.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, samples};
use holonom::experiment::RunnableModel;
use holonom::{Sample, Simulation};

/// A motion with its energies.
pub(super) struct ContactMotion {
    pub(super) samples: Vec<Sample>,
    pub(super) energies: Vec<f64>,
    pub(super) impacts: u64,
    pub(super) smallest_gap: f64,
}

impl ContactMotion {
    /// Of a model file.
    pub(super) fn of(text: &str) -> Self {
        let mut simulation = Simulation::new(&model(text, &[])).unwrap();
        let total = simulation.energy_columns().iter().position(|own| own == "total").unwrap();
        let samples = samples(&mut simulation);
        let energies = samples.iter().map(|own| own.energies[total]).collect();
        let counts = simulation.contact_counts().unwrap();
        let smallest_gap = counts.smallest_gap.unwrap_or(0.0);
        Self { samples, energies, impacts: counts.impacts, smallest_gap }
    }

    pub(super) fn last(&self) -> &Sample {
        self.samples.last().unwrap()
    }

    /// The largest rise of the energy above a value that it had before, J.
    pub(super) fn rise(&self) -> f64 {
        let mut least = f64::INFINITY;
        let rises = self.energies.iter().map(|own| {
            least = least.min(*own);
            own - least
        });
        rises.fold(0.0, f64::max)
    }
}
