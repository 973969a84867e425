//! The stretch of the arc of a rope.
#![allow(non_snake_case)] // G, K, C, S, R

use super::helix::split;
use crate::small::{re, times};
use crate::strain::Strain;
use nalgebra::{Matrix3, Vector3, Vector6};
use vi_core::Number;

/// `c`, how much tension ties the triads of a rope to its arc.
const TIE: f64 = 2.0;

/// The stretch of a rope.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc<T: Number = f64> {
    length: T,                    // |G|
    direction: Vector3<T>,        // G/|G|
    pub(super) slope: Vector3<T>, // ∂η_3/∂G
}

impl<T: Number> Arc<T> {
    pub(super) fn of(xi: &Strain<T>) -> Self {
        let (G, _) = split(xi);
        let length = G.norm();
        let direction = if re(length) > 0.0 { G / length } else { Vector3::z() };
        let slope = times(1.0 + TIE, &direction) - times(TIE, &Vector3::z());
        Self { length, direction, slope }
    }

    /// `η_3 − z_3 = (1 + c)(|G| − G_3)` without its cancellation.
    pub(super) fn excess(&self, xi: &Strain<T>) -> T {
        let excess = match re(xi[2]) > 0.0 {
            true => (xi[0] * xi[0] + xi[1] * xi[1]) / (self.length + xi[2]),
            false => self.length - xi[2],
        };
        T::of(1.0 + TIE) * excess
    }

    /// What `n` is on the strains of the helix: `n_3` acts along `∂η_3/∂G`.
    pub(super) fn on_helix(&self, n: &Vector6<T>) -> Vector6<T> {
        let [a, b, c] = [0, 1, 2].map(|i| n[2] * self.slope[i]);
        Vector6::new(n[0] + a, n[1] + b, c, n[3], n[4], n[5])
    }
}

impl Arc {
    /// `∂²η_3/∂G∂G`; nothing where the nodes meet.
    pub(super) fn bend(&self) -> Matrix3<f64> {
        if self.length == 0.0 {
            return Matrix3::zeros();
        }
        let e = &self.direction;
        (Matrix3::identity() - e * e.transpose()) * ((1.0 + TIE) / self.length)
    }
}
