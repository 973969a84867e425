//! How the bounds of the tension that follow it change: derivatives of a step by its internal
//! variables, and of these.
//!
//! ```text
//! z = (N̂, σ_n, σ_{n−1})          N̂' = 1.25 least of (σ, σ_n, σ_{n−1}) where that exceeds N̂, else N̂
//! ∂D_1(U_d − K_d)/∂N̂ = ℓ Σ_i (T_N̂ Δε)_i ∇ε_i(x_n),      σ = (C ε̄)_3
//! ∂(A v)/∂N̂ = h² ℓ Σ_i (T_N̂ ε̇)_i ∇ε_i                    A: the added mass, ε̇ = ∇ε·v
//! ```
//! Which of them it is, and whether it exceeds `N̂`, is held. At a start without tension `N̂` has a
//! kink; it is held as well.
#![allow(non_snake_case)] // C

use crate::averaged::{
    AveragedStrains, MARGIN, OF_BOUND, mean_and_change, raised_by, tension_mass,
};
use crate::element::Element;
use crate::strain::Strain;
use nalgebra::Matrix6;
use vi_core::Configuration;
use vi_core::interval::{Interval, Slot};
use vi_core::num_dual::Dual64;
use vi_core::potential::DiscretePotential;
use vi_core::sparse::Entries;

/// Part of the stiffness up to which a start has no tension.
const NO_TENSION: f64 = 1e-12;

/// What a bound follows.
pub(crate) struct FollowedBound {
    /// The first of its variables among those of the potential.
    pub(crate) variable: usize,
    /// Which of `σ, σ_n, σ_{n−1}` raises it.
    pub(crate) raised_by: Option<usize>,
}

/// Adds the change of the variables of an element at the start, from its tension and how that
/// changes.
pub(crate) fn begin_change(
    variable: usize,
    C: &Matrix6<f64>,
    tension: f64,
    rate: f64,
    out: &mut [f64],
) {
    if tension > NO_TENSION * C[(2, 2)] {
        out[variable] += MARGIN * rate;
    }
    out[variable + 1..variable + OF_BOUND].iter_mut().for_each(|own| *own += rate);
}

impl AveragedStrains {
    /// What the bound of an element follows in a step; `None` where it is constant.
    pub(crate) fn followed(&self, s: &Interval, index: usize) -> Option<FollowedBound> {
        let variable = self.variable(index)?;
        let element = &self.elements.list()[index];
        let own = self.own(&s.internal).get(variable..variable + OF_BOUND)?;
        let (mean, _) = mean_and_change(element.strains_of(s, index));
        let tension = self.elements.stiffness(element).row(2).tr_dot(&mean);
        let raised_by = raised_by(element, own[0], [tension, own[1], own[2]]);
        Some(FollowedBound { variable, raised_by })
    }

    /// Emits `scale ∂(D_of (U_d − K_d))/∂z`.
    pub(crate) fn emit_bound_slopes(
        &self,
        s: &Interval,
        of: Slot,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let own = self.own(&s.internal);
        for (variable, index, element, _) in self.following() {
            let Some(bound) = own.get(variable) else { return };
            let (_, change) = mean_and_change(element.strains_of(s, index));
            let n = self.by_bound(element, *bound, s.h).component_mul(&change);
            let force =
                element.within(s.node(of)).force(&(-of.sign() * scale * element.length * n));
            for (row, f) in force.iter().enumerate() {
                out.add(element.place(row), variable, *f);
            }
        }
    }

    /// `T_N̂`.
    fn by_bound(&self, element: &Element, bound: f64, h: f64) -> Strain {
        let line = Dual64::from_re(self.elements.section(element).inertia()[0]);
        let lengths = [element.length, self.reach].map(Dual64::from_re);
        tension_mass(Dual64::new(bound, 1.0), lengths, h, line).map(|own| own.eps)
    }

    /// Emits `h² ℓ Σ_i (T_N̂ ε̇)_i ∇ε_i`, the derivative of the momentum of the added mass.
    pub(crate) fn emit_mass_by_bounds(
        &self,
        at: Configuration<'_>,
        h: f64,
        v: &[f64],
        out: &mut dyn Entries,
    ) {
        let own = self.own(at.internal);
        for (variable, _, element, _) in self.following() {
            let Some(bound) = own.get(variable) else { return };
            let within = element.within(at.q);
            let rate = within.rate(&element.coordinates(v));
            let n = self.by_bound(element, *bound, h).component_mul(&rate);
            let momentum = within.force(&(h * h * element.length * n));
            for (row, p) in momentum.iter().enumerate() {
                out.add(element.place(row), variable, *p);
            }
        }
    }

    /// Emits `∂z_{n+1}/∂q` of one end.
    pub(crate) fn emit_advance(&self, s: &Interval, by: Slot, out: &mut dyn Entries) {
        for (_, index, element, C) in self.following() {
            let Some(FollowedBound { variable, raised_by }) = self.followed(s, index) else {
                return;
            };
            let half: Strain = 0.5 * C.row(2).transpose();
            let slopes = element.within(s.node(by)).force(&half);
            let bound = if raised_by == Some(0) { MARGIN } else { 0.0 };
            for (row, slope) in slopes.iter().enumerate() {
                out.add(variable, element.place(row), bound * slope);
                out.add(variable + 1, element.place(row), *slope);
            }
        }
    }

    /// Emits `∂z_{n+1}/∂z_n`.
    pub(crate) fn emit_advance_of_bounds(&self, s: &Interval, out: &mut dyn Entries) {
        for (_, index, ..) in self.following() {
            let Some(FollowedBound { variable, raised_by }) = self.followed(s, index) else {
                return;
            };
            match raised_by {
                None => out.add(variable, variable, 1.0),
                Some(0) => {}
                Some(before) => out.add(variable, variable + before, MARGIN),
            }
            out.add(variable + 2, variable + 1, 1.0);
        }
    }

    /// How many internal variables there are.
    pub(crate) fn variable_count(&self) -> usize {
        self.internal_variables()
    }

    /// Adds a change of `σ` of an element to its variables at the end of the step, from the first
    /// of them and what raises its bound.
    pub(crate) fn add_tension(
        &self,
        variable: usize,
        raised_by: Option<usize>,
        tension: f64,
        out: &mut [f64],
    ) {
        if raised_by == Some(0) {
            out[variable] += MARGIN * tension;
        }
        out[variable + 1] += tension;
    }

    /// Adds how the bounds at the start change with the configuration.
    pub(crate) fn add_start_change(&self, q: &[f64], dq: &[f64], out: &mut [f64]) {
        for (variable, _, element, C) in self.following() {
            let at = element.within(q);
            let rate = C.row(2).tr_dot(&at.rate(&element.coordinates(dq)));
            begin_change(variable, C, (C * at.strain())[2], rate, out);
        }
    }
}
