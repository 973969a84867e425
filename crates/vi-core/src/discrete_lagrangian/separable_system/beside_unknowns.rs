//! What acts beside inertia, constant forces and efforts along unknowns, at both ends of a step;
//! the second derivatives of all that acts.

use super::SeparableSystem;
use crate::configuration::{Configuration, Motion};
use crate::force::{DiscreteForce, NoTimeSlope, Source};
use crate::interval::{Interval, Slot, StepChange};
use crate::sparse::{Block, Entries, Product};

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
    pub fn gauss_bend(&self, at: Motion<'_>, z: &[f64], by: [f64; 4], out: &mut dyn Entries) {
        if by[0] != 0.0 {
            self.gauss_potentials()
                .for_each(|potential| potential.add_third(at.configuration(), z, -by[0], out));
        }
        self.gauss_forces().for_each(|force| force.add_gauss_bend(at, z, by, out));
    }

    /// `out ← ∂/∂h` of [`SeparableSystem::beside_unknowns`] at fixed nodes and a fixed time of the
    /// middle.
    ///
    /// # Errors
    /// [`NoTimeSlope`].
    pub fn beside_unknowns_by_length(
        &self,
        s: &Interval,
        of: Slot,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        out.fill(0.0);
        let (potentials, mut forces) = self.other(&[]);
        match of {
            Slot::First => potentials.for_each(|potential| potential.add_d1(s, -1.0, out)),
            Slot::Second => potentials.for_each(|potential| potential.add_d2(s, -1.0, out)),
        }
        let change = StepChange { length: 1.0, middle: 0.0 };
        forces.try_for_each(|force| force.add_step_slope(s, of, change, out))
    }

    /// `out ← out + ∂²/∂h∂q_by` of the sum of `y_0·` and `y_1·`
    /// [`SeparableSystem::beside_unknowns`] at both ends, as far as it is known.
    pub fn add_beside_unknowns_slope_by_length(
        &self,
        s: &Interval,
        y: [&[f64]; 2],
        by: Slot,
        out: &mut [f64],
    ) {
        let (potentials, forces) = self.other(&[]);
        for potential in potentials {
            for (of, y) in Slot::BOTH.into_iter().zip(y) {
                let into = &mut Product { v: y, out: &mut *out };
                let transposed = of == by || of == Slot::First;
                let out = &mut Block { into, row: 0, column: 0, scale: 1.0, transposed };
                match (of, by) {
                    (Slot::First, Slot::First) => potential.add_d1_d1(s, -1.0, out),
                    (Slot::Second, Slot::Second) => potential.add_d2_d2(s, -1.0, out),
                    _ => potential.add_d2_d1(s, -1.0, out),
                }
            }
        }
        let known = forces.filter_map(|force| force.length_bends());
        known.for_each(|own| own.add_slope_by_length(s, y, by, out));
    }

    /// `∂²/∂h²` of the same sum.
    #[must_use]
    pub fn beside_unknowns_second_by_length(&self, s: &Interval, y: [&[f64]; 2]) -> f64 {
        let known = self.other(&[]).1.filter_map(|force| force.length_bends());
        known.map(|own| own.second_by_length(s, y)).sum()
    }

    /// What exerts the first of the forces among these that changes with the time itself from one
    /// of these times to another, at one of these places `(q, v)`, or whose derivatives by the time
    /// are not known, or second ones by the length of a step; of the latter nothing where steps are
    /// not `divided` but Galerkin's.
    #[must_use]
    pub fn first_of_time(
        &self,
        places: &[[Vec<f64>; 2]],
        times: &[f64],
        divided: bool,
    ) -> Option<&Source> {
        let value = |force: &dyn DiscreteForce, [q, v]: &[Vec<f64>; 2], t: f64| {
            let (at, zero) = (Configuration::new(t, q), || vec![0.0; q.len()]);
            let (mut value, mut slope) = (zero(), zero());
            force.add_continuous(at.moving(v), &mut value);
            let known = force.add_time_slope(at.moving(v), 1.0, &mut slope).ok();
            known.map(|()| value.into_iter().map(f64::to_bits).collect::<Vec<_>>())
        };
        let stands = |force: &dyn DiscreteForce| {
            places.iter().all(|place| {
                let mut all = times.iter().map(|t| value(force, place, *t));
                let first = all.next().flatten();
                first.is_some() && all.all(|own| own == first)
            })
        };
        let all = self.forces.iter().zip(&self.sources);
        let mut beside = all.filter(|(force, _)| force.along_unknown().is_none());
        let found = beside.find(|(force, _)| {
            !(stands(&***force) && (force.length_bends().is_some() || !divided))
        });
        found.map(|(_, source)| source)
    }
}
