//! Which rows of `g` are enforced: an independent set of those of joints, bars and scalar
//! constraints.
#![allow(non_snake_case)] // J

use super::EquilibriumEquations;
use nalgebra::DMatrix;
use vi_constraints::Constraints;
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::saddle_point::IndependentRows;
use vi_multibody::loop_rank::LoopRank;

impl EquilibriumEquations {
    /// Independent rows of joints, bars and scalar constraints.
    pub(super) fn independent_rows(&mut self) -> IndependentRows {
        let (mechanism, m) = (&self.mechanism, self.mechanism.len());
        let internal = 6 * mechanism.description().bodies.len();
        let outer: Vec<usize> = (internal..m).collect();
        if !mechanism.has_loops() {
            return IndependentRows::choose(m, &outer);
        }
        if mechanism.description().particles.is_empty() {
            let rank = LoopRank::find(mechanism, self.t, &self.s.q0);
            if rank.is_singular() {
                let rows = rank.rows(mechanism); // those of configurations nearby
                let outer = rows.rows().iter().copied().filter(|&row| row >= internal);
                return IndependentRows::choose(m, &outer.collect::<Vec<_>>());
            }
        }
        self.ranked_rows()
    }

    /// An independent set of the rows of joints, bars and scalar constraints at the last
    /// equilibrium, by pivoted QR; forgets the matrices of the old set.
    fn ranked_rows(&mut self) -> IndependentRows {
        let m = self.mechanism.len();
        let outer: Vec<usize> = (6 * self.mechanism.description().bodies.len()..m).collect();
        self.rows = IndependentRows::choose(m, &outer);
        (self.upper, self.lower, self.factors) = Default::default();
        let q = self.s.q0.clone();
        self.layout.null_space(&q, &mut self.left);
        self.fill_rows();
        let d = self.unknowns();
        let mut J = DMatrix::zeros(outer.len(), d);
        self.upper.emit(&mut J);
        (self.upper, self.lower) = Default::default();
        let mut qr = NullSpaceQr::new(d, outer.len());
        let rank = match self.mechanism.nearly_redundant() {
            Some(nearly) if self.mechanism.cut_bars().is_empty() => {
                let own: Vec<f64> = outer.iter().map(|&row| nearly.allowances[row]).collect();
                qr.factorize_preferring(&J, &own);
                outer.len() + nearly.loop_rank - self.mechanism.loop_rows().len()
            }
            _ => qr.factorize(&J),
        };
        let chosen: Vec<usize> = qr.pivots()[..rank].iter().map(|&k| outer[k]).collect();
        IndependentRows::choose(m, &chosen)
    }

    /// Chooses the independent rows anew where some follow from others: which ones is a matter of
    /// the configuration. Returns whether the choice has changed; a lower rank in passing changes
    /// nothing.
    pub(crate) fn renew_rows(&mut self) -> bool {
        let outer = self.mechanism.len() - 6 * self.mechanism.description().bodies.len();
        if self.rows.len() == outer {
            return false;
        }
        let old = self.rows.clone();
        let new = self.ranked_rows();
        let changed = new.len() == old.len() && new != old;
        self.rows = if changed { new } else { old };
        changed
    }
}
