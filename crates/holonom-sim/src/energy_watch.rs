//! A run whose energy leaves its band.
//!
//! ```text
//! D_n = Ĥ_n − H(0) − Σ work          Ĥ: shadow energy; of energy–momentum schemes the energy
//! left:  |D_n| > ½ (max T + max V − min V)        over the recorded nodes so far
//!        |D_n| > 1e-12 max(T, |V|)               beyond rounding: a system at rest exchanges none,
//!        |D_n| > ½ δᵀM δ / h²                    and of its positions rounding leaves δ = 1e-12 of their sizes
//! ```
//! `Ĥ` of a variational scheme is conserved to high order, and `D_n` is small beside the energy that is exchanged, as
//! long as the vibrations are resolved or do not grow. A run that gains energy without bound passes half of that energy
//! long before Newton's method fails.

use crate::energies::{Energies, ROUNDING};
use crate::method::reading::Reading;
use crate::outcome::twelve_digits;
use serde::{Deserialize, Serialize};

/// Nodes before which nothing is concluded.
const FIRST: u32 = 2;
/// Part of the energy that is exchanged.
const PART: f64 = 0.5;

/// What was seen of the energy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct EnergyWatch {
    nodes: u32,
    kinetic: f64,                // J  largest
    potential: Option<[f64; 2]>, // J  least and largest
    left: Option<LeftBand>,      // the first time
}

/// Where the energy left its band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct LeftBand {
    step: u64,
    t: f64,         // s
    change: f64,    // J  D_n
    exchanged: f64, // J
}

impl EnergyWatch {
    /// Takes up a recorded node; the warning, if the energy leaves its band there.
    pub(crate) fn follow(&mut self, at: &Reading, energies: &Energies) -> Option<String> {
        let potential = at.hamiltonian - at.kinetic;
        self.kinetic = self.kinetic.max(at.kinetic);
        let [least, largest] = self.potential.unwrap_or([potential; 2]);
        let [least, largest] = [least.min(potential), largest.max(potential)];
        self.potential = Some([least, largest]);
        self.nodes = self.nodes.saturating_add(1);
        let change = energies.balance(at.shadow?, &at.work);
        let exchanged = self.kinetic + largest - least;
        let size = self.kinetic.max(least.abs()).max(largest.abs());
        let band = (PART * exchanged).max(ROUNDING * size).max(energies.rounding());
        let leaves = self.nodes > FIRST && change.abs() > band;
        if self.left.is_some() || !leaves {
            return None;
        }
        self.left = Some(LeftBand { step: at.step, t: at.t, change, exchanged });
        self.warning()
    }

    /// The warning, once the energy has left its band.
    pub(crate) fn warning(&self) -> Option<String> {
        let LeftBand { step, t, change, exchanged } = self.left?;
        let t = twelve_digits(t);
        Some(format!(
            "the energy left its band at step {step}, t = {t} s: it has changed by {change:.2e} J that no load, motor or \
             damper accounts for, and kinetic and potential energy exchange no more than {exchanged:.2e} J; the motion from \
             there on is not that of the model: reduce the time step, or write scheme = \"em-nodal\""
        ))
    }
}
