//! Derivatives by masses, summed over a run for all parameters at once.
//!
//! ```text
//! dJ/dθ = Σ_ab (M_θ)_ab W_ab         over the vectors a, b of bodies and point masses       [2.40]
//! W_ab  = Σ_n (b' + μ)_a·(Δq/h)_b + (h/2)(b' − μ)_a·γ_b           γ_b: gravity, of centres
//! ```
//! What a step costs does not depend on the number of parameters.
#![allow(non_snake_case)] // W

use super::explicit::{Masses, is_point};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use vi_constraints::design::Costates;
use vi_core::Interval;

/// The sums `W_ab` that parameters need.
pub(super) struct MassSums {
    members: Vec<CoordinatePairs>,
    gravity: Vector3<f64>,
    count: usize,
}

/// Vectors of coordinates, and the pairs of them that count.
struct CoordinatePairs {
    offset: usize,
    dimension: usize,
    pairs: Vec<(usize, usize)>,
    first: usize, // of the sums
}

/// A parameter as a linear function of sums: which, and its factor.
pub(super) type SumFactors = Vec<(usize, f64)>;

impl MassSums {
    /// Of parameters that change these masses, with their factors; sums are numbered from `first`.
    pub(super) fn of<'a>(
        masses: impl Iterator<Item = Option<&'a Masses>> + Clone,
        gravity: Vector3<f64>,
        first: usize,
    ) -> (Self, Vec<SumFactors>) {
        let mut pairs: BTreeMap<(usize, usize), Vec<(usize, usize)>> = BTreeMap::new();
        for own in masses.clone().flatten() {
            own.for_each_mass(|offset, dimension, pair, _| {
                let known = pairs.entry((offset, dimension)).or_default();
                if !known.contains(&pair) {
                    known.push(pair);
                }
            });
        }
        let (mut members, mut count) = (Vec::new(), 0);
        for ((offset, dimension), pairs) in pairs {
            let own = pairs.len();
            members.push(CoordinatePairs { offset, dimension, pairs, first: first + count });
            count += own;
        }
        let sums = Self { members, gravity, count };
        let factors = masses.map(|own| {
            let mut factors = SumFactors::new();
            if let Some(own) = own {
                own.for_each_mass(|offset, _, pair, mass| {
                    factors.push((sums.place(offset, pair), mass));
                });
            }
            factors
        });
        let factors = factors.collect();
        (sums, factors)
    }

    fn place(&self, offset: usize, pair: (usize, usize)) -> usize {
        let known = self.members.binary_search_by_key(&offset, |member| member.offset);
        let member = &self.members[known.expect("listed with the others")];
        let own = member.pairs.iter().position(|own| *own == pair);
        member.first + own.expect("listed with the others")
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Adds those of a step.
    pub(super) fn add(&self, s: &Interval, costates: Costates<'_>, sums: &mut [f64]) {
        let Costates { step: mu, momentum, .. } = costates;
        let half = 0.5 * s.h;
        for CoordinatePairs { offset, dimension, pairs, first } in &self.members {
            for (k, (a, b)) in pairs.iter().enumerate() {
                let [a_first, b_first] = [a, b].map(|vector| offset + dimension * vector);
                let mut W = 0.0;
                for i in 0..*dimension {
                    let (mu, momentum) = (mu[a_first + i], momentum[a_first + i]);
                    W += (momentum + mu) * s.v_mid[b_first + i];
                    if is_point(*b) {
                        W += half * (momentum - mu) * self.gravity[i];
                    }
                }
                sums[first + k] += W;
            }
        }
    }
}
