//! Impulses that hold rows: along those that are free to be held no velocity is left.
//!
//! ```text
//! U + W Λ' = 0   of rows that are held,   Λ' as given of all others
//! ```
//! Conjugate gradients begin at what is given: at the part of the impulses that belongs to the step
//! before, which is the solution under uniform loads. Rows that `W` does not tell apart have one
//! solution of many.

use super::delassus::Delassus;
use vi_core::linear::{dot, norm_inf};

/// A residual of velocities in parts of the largest one.
const SETTLED: f64 = 1e-13;
/// What impulses that balance one another change, in parts of what each one does alone.
const SINGULAR: f64 = 1e-12;
/// Most iterations.
const ITERATIONS: usize = 200;

/// Scratch.
#[derive(Debug, Default)]
pub(super) struct Holding {
    pub(super) part: Vec<f64>, // k  Λ'
    free: Vec<bool>,           // k  whether a row is held
    diagonal: Vec<f64>,        // k  W_ii
    residual: Vec<f64>,        // k  −U of rows that are held
    direction: Vec<f64>,       // k
    image: Vec<f64>,           // k  W times it
    conditioned: Vec<f64>,     // k
}

impl Holding {
    /// Rows follow.
    pub(super) fn begin(&mut self) {
        self.free.clear();
        self.diagonal.clear();
        self.part.clear();
    }

    /// The next row: whether it is held, and what is given of its impulse.
    pub(super) fn add(&mut self, is_held: bool, given: f64, W: &Delassus) {
        let own = W.at(self.part.len(), self.part.len());
        self.free.push(is_held && own > 0.0);
        self.diagonal.push(own);
        self.part.push(given);
    }

    /// `part`: the impulses that hold rows with the velocities `minus`.
    pub(super) fn hold(&mut self, W: &Delassus, minus: &[f64]) {
        let k = minus.len();
        let Self { free, diagonal, part, residual, direction, image, conditioned } = self;
        let speeds = norm_inf(minus);
        let velocity = |i: usize, part: &[f64]| minus[i] + W.product(i, |j| part[j]);
        residual.clear();
        residual.extend((0..k).map(|i| if free[i] { -velocity(i, part) } else { 0.0 }));
        let condition = |residual: &[f64], out: &mut Vec<f64>| {
            out.clear();
            let rows = residual.iter().enumerate();
            out.extend(rows.map(|(i, r)| if free[i] { r / diagonal[i] } else { 0.0 }));
        };
        condition(residual, conditioned);
        direction.clone_from(conditioned);
        let mut size = dot(residual, conditioned);
        for _ in 0..ITERATIONS {
            if norm_inf(residual) <= SETTLED * speeds {
                break;
            }
            image.clear();
            let rows = 0..k;
            image.extend(rows.map(|i| if free[i] { W.product(i, |j| direction[j]) } else { 0.0 }));
            let curvature = dot(direction, image);
            let alone = direction.iter().zip(&*diagonal).map(|(d, w)| d * d * w).sum::<f64>();
            if curvature.is_nan() || curvature <= SINGULAR * alone {
                break; // nothing but what balances itself is left
            }
            let length = size / curvature;
            for i in 0..k {
                part[i] += length * direction[i];
                residual[i] -= length * image[i];
            }
            condition(residual, conditioned);
            let next = dot(residual, conditioned);
            let turn = next / size;
            size = next;
            for (direction, conditioned) in direction.iter_mut().zip(&*conditioned) {
                *direction = conditioned + turn * *direction;
            }
        }
    }
}
