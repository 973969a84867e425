//! What acts beside inertia, constant forces and efforts along unknowns, at both ends of a step;
//! the second derivatives of all that acts.

use super::SeparableSystem;
use crate::configuration::Configuration;
#[cfg(doc)]
use crate::force::DiscreteForce;
use crate::interval::{Interval, Slot};
use crate::sparse::{Block, Entries};

impl SeparableSystem {
    /// `out ←` what `D_1 L_d + f_d^-`, or `D_2 L_d + f_d^+`, has beside inertia, constant forces
    /// and [`SeparableSystem::along_unknowns`], shape `n`.
    pub fn beside_unknowns(&self, s: &Interval, of: Slot, out: &mut [f64]) {
        out.fill(0.0);
        let (potentials, forces) = self.other(&[]);
        match of {
            Slot::First => {
                potentials.for_each(|potential| potential.add_d1(s, -s.h, out));
                forces.for_each(|force| force.add_minus(s, out));
            }
            Slot::Second => {
                potentials.for_each(|potential| potential.add_d2(s, -s.h, out));
                forces.for_each(|force| force.add_plus(s, out));
            }
        }
    }

    /// Emits `D_by` of [`SeparableSystem::beside_unknowns`], shape `n × n`; for each always the
    /// same places in the same order.
    pub fn beside_unknowns_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        let (potentials, forces) = self.other(&[]);
        potentials.for_each(|potential| match (of, by) {
            (Slot::First, Slot::First) => potential.add_d1_d1(s, -s.h, out),
            (Slot::First, Slot::Second) => potential.add_d2_d1(s, -s.h, out),
            (Slot::Second, Slot::First) => {
                let (row, column, scale) = (0, 0, 1.0);
                let mut transposed =
                    Block { into: &mut *out, row, column, scale, transposed: true };
                potential.add_d2_d1(s, -s.h, &mut transposed);
            }
            (Slot::Second, Slot::Second) => potential.add_d2_d2(s, -s.h, out),
        });
        forces.for_each(|force| force.add_slope(s, of, by, out));
    }

    /// Emits `∂²/∂q_i∂q_j` of `y_0·`, `y_1·` [`SeparableSystem::beside_unknowns`] at both ends, as
    /// far as it is known.
    pub fn beside_unknowns_bend(
        &self,
        s: &Interval,
        y: [&[f64]; 2],
        slots: [Slot; 2],
        out: &mut dyn Entries,
    ) {
        let (potentials, forces) = self.other(&[]);
        potentials.for_each(|potential| potential.add_bend(s, y, slots, -s.h, out));
        forces.for_each(|force| force.add_bend(s, y, slots, out));
    }

    /// The same of `D_1 L_d + f_d^-` and `D_2 L_d + f_d^+` of all that acts.
    pub fn forced_bend(
        &self,
        s: &Interval,
        y: [&[f64]; 2],
        slots: [Slot; 2],
        out: &mut dyn Entries,
    ) {
        self.potentials().for_each(|potential| potential.add_bend(s, y, slots, -s.h, out));
        self.forces.iter().for_each(|force| force.add_bend(s, y, slots, out));
    }

    /// The same of `z·(f − ∇V)` of all that acts, at a Gauss node, as
    /// [`DiscreteForce::add_gauss_bend`].
    pub fn gauss_bend(
        &self,
        at: Configuration<'_>,
        v: &[f64],
        z: &[f64],
        by: [f64; 4],
        out: &mut dyn Entries,
    ) {
        if by[0] != 0.0 {
            self.gauss_potentials().for_each(|potential| potential.add_third(at, z, -by[0], out));
        }
        self.gauss_forces().for_each(|force| force.add_gauss_bend(at, v, z, by, out));
    }

    /// Whether there are forces among these, which need not go with `h`.
    #[must_use]
    pub fn has_forces_beside_unknowns(&self) -> bool {
        self.other(&[]).1.next().is_some()
    }
}
