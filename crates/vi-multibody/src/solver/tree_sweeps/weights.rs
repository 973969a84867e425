//! Constants of the scheme, by places of the control points.
#![allow(non_snake_case)] // K

use crate::geometry::control_points::Points;
use crate::geometry::members::LanesVector;
use crate::sweep::link::Link;
use vi_core::galerkin::GaussLobatto;
use vi_core::lanes::{Lanes, Register};

/// Constants of the scheme by places.
#[derive(Debug)]
pub(super) struct SchemeWeights<L> {
    pub K: Vec<L>,                  // row i at place i, by places of the increments
    pub inverse: Vec<L>,            // h K̂⁻¹: control points by places, for each row
    pub force: Vec<L>,              // h b_k E_ki, row i at place i, for each Gauss node
    pub total: L,                   // h b̃_i, row i at place i
    pub last: Vec<f64>,             // K_sj by places
    pub of_last: Vec<f64>,          // h b_k E_ks
    pub masses: Vec<[[f64; 4]; 4]>, // M/h of each link
    pub h: f64,
}

/// The control point at a place.
pub(super) fn control_point(place: usize, s: usize) -> usize {
    if place == 0 { s } else { place }
}

impl<L: Lanes> SchemeWeights<L> {
    pub(super) fn new(
        lanes: impl Register<Lanes = L>,
        constants: &GaussLobatto,
        links: &[Link<Points<L>>],
        h: f64,
    ) -> Self {
        let s = constants.stages();
        let place = |row: &dyn Fn(usize) -> f64| {
            lanes.gather(|place| if place < s { row(place) } else { 0.0 })
        };
        let impulse = |k: usize, i: usize| h * constants.gauss_weights[k] * constants.E[(k, i)];
        let point = |l: usize| control_point(l, s);
        let mut K: Vec<L> = (0..s).map(|l| place(&|i| constants.K[(i, point(l))])).collect();
        let solve = |i: usize| place(&|l| h * constants.K_hat_inverse[(point(l) - 1, i)]);
        let mut inverse: Vec<L> = (0..s).map(solve).collect();
        K.resize(L::COUNT, lanes.splat(0.0));
        inverse.resize(L::COUNT, lanes.splat(0.0));
        Self {
            K,
            inverse,
            force: (0..s).map(|k| place(&|i| impulse(k, i))).collect(),
            total: place(&|i| (0..s).map(|k| impulse(k, i)).sum()),
            last: (0..s).map(|l| constants.K[(s, point(l))]).collect(),
            of_last: (0..s).map(|k| impulse(k, s)).collect(),
            masses: links.iter().map(|link| link.mass.map(|row| row.map(|m| m / h))).collect(),
            h,
        }
    }

    /// `Σ_j K_ij Δ_j`.
    #[inline(always)]
    pub(super) fn mix(&self, delta: &LanesVector<L>) -> LanesVector<L> {
        let [x, y, z] = delta.0;
        let K = &self.K[..L::COUNT];
        let mut sum = LanesVector([K[0] * x.at(0), K[0] * y.at(0), K[0] * z.at(0)]);
        for l in 1..L::COUNT {
            sum = sum + LanesVector([K[l] * x.at(l), K[l] * y.at(l), K[l] * z.at(l)]);
        }
        sum
    }

    /// `h Σ_i (K̂⁻¹)_ji r_i`.
    #[inline(always)]
    pub(super) fn solve(&self, r: L) -> L {
        let inverse = &self.inverse[..L::COUNT];
        let mut sum = inverse[0] * r.at(0);
        for i in 1..L::COUNT {
            sum = sum + inverse[i] * r.at(i);
        }
        sum
    }
}
