//! A run whose energy leaves its band.
//!
//! ```text
//! D_n = H(n) − H(0) − Σ work,  or with the shadow energy Ĥ(n) in the place of H(n): that which is closer to zero
//! E_n = max T + max V − min V + Σ_s (max W_s − min W_s)     what has been exchanged: W_s the work of a load, a motor,
//!                                                            a damper, of all prescribed motions
//! leaves:   |D_n| > ½ E_n      beyond rounding: 1e-12 max(T, |V|), [`EnergyTerms::rounding`]
//! returns:  |D_n| < E_n/20
//! ```
//! All extremes are those of the recorded nodes so far. `H` of a variational scheme has errors of
//! the vibrations that the step resolves badly, which `Ĥ` has not; `Ĥ` belongs to the step and is
//! ahead of the work of its node by a part of that of the step. A motion that begins at rest has
//! errors of the size of what was exchanged for a few steps, then ever smaller ones: it returns. A
//! run that gains energy without bound does not. The warning is therefore given at the second node
//! beyond the band without a return between, or at the end.

use super::energies::{EnergyTerms, ROUNDING};
use super::outcome::twelve_digits;
use crate::stepper::NodeView;
use serde::{Deserialize, Serialize};

/// Part of the energy that is exchanged, beyond which the energy has left its band.
const PART: f64 = 0.5;
/// Part below which it has returned.
const RETURNED: f64 = 0.05;

/// What was seen of the energy.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct EnergyWatch {
    kinetic: f64,                // J  largest
    potential: Option<[f64; 2]>, // J  least and largest
    elastic: f64,                // J  largest
    works: Vec<[f64; 2]>,        // J  least and largest, of each source
    left: Option<LeftBand>,      // where it left and did not return
}

/// Where the energy left its band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct LeftBand {
    step: u64,
    t: f64,         // s
    change: f64,    // J  D_n
    exchanged: f64, // J
    certain: bool,
}

impl EnergyWatch {
    /// Takes up a recorded node with its `columns` of energies; the warning, once it is certain
    /// that the energy has left its band.
    pub(crate) fn follow(
        &mut self,
        at: &NodeView<'_>,
        energies: &EnergyTerms,
        columns: &[f64],
    ) -> Option<String> {
        let exchanged = self.exchange(at, energies.elastic(columns));
        let [least, largest] = self.potential?;
        let size = self.kinetic.max(least.abs()).max(largest.abs());
        let rounding = (ROUNDING * size).max(energies.rounding(self.elastic));
        let own = energies.balance(at.hamiltonian(), at.work);
        let shadow = energies.balance(at.shadow?, at.work);
        let change = if own.abs() < shadow.abs() { own } else { shadow };
        if self.left.is_some_and(|left| left.certain) {
            return None;
        }
        let beyond = change.abs() > (PART * exchanged).max(rounding);
        let returned = change.abs() < (RETURNED * exchanged).max(rounding);
        match &mut self.left {
            Some(_) if returned => self.left = None,
            Some(left) => left.certain = beyond,
            None if beyond => {
                let (step, t) = (at.state.step, at.state.t);
                self.left = Some(LeftBand { step, t, change, exchanged, certain: false });
            }
            None => {}
        }
        self.left.filter(|left| left.certain)?;
        self.warning()
    }

    /// What has been exchanged up to a node, J.
    fn exchange(&mut self, at: &NodeView<'_>, elastic: f64) -> f64 {
        let potential = at.hamiltonian() - at.kinetic();
        self.kinetic = self.kinetic.max(at.kinetic());
        self.elastic = self.elastic.max(elastic);
        let [least, largest] = self.potential.unwrap_or([potential; 2]);
        let [least, largest] = [least.min(potential), largest.max(potential)];
        self.potential = Some([least, largest]);
        self.works.resize(at.work.len(), [0.0; 2]);
        for ([least, largest], work) in self.works.iter_mut().zip(at.work) {
            (*least, *largest) = (least.min(*work), largest.max(*work));
        }
        let works: f64 = self.works.iter().map(|[least, largest]| largest - least).sum();
        self.kinetic + largest - least + works
    }

    /// The warning, once the energy has left its band and was not seen to return.
    pub(crate) fn warning(&self) -> Option<String> {
        let LeftBand { step, t, change, exchanged, .. } = self.left?;
        let t = twelve_digits(t);
        Some(format!(
            "the energy left its band at step {step}, t = {t} s: it has changed by {change:.2e} J that no load, motor or \
             damper accounts for, while {exchanged:.2e} J were exchanged between kinetic and potential energy and with \
             loads, motors and dampers; the motion from there on is not that of the model: reduce the time step, or write \
             scheme = \"em-nodal\""
        ))
    }
}
