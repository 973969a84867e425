//! The mass of an element: one 8×8 matrix `⊗ I_3` between `φ, d_1, d_2, d_3` of both nodes.
#![allow(non_snake_case)] // M

use nalgebra::{Matrix4, SMatrix};
use vi_core::Number;

/// How the mass of an element is distributed to its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MassKind {
    /// `[1/3 1/6; 1/6 1/3]`: of the linear interpolation.
    #[default]
    Consistent,
    /// `½, ½` on the diagonal.
    Lumped,
    /// `φ` quadratic with `d_3`, directors lumped: of order 4.
    Quadratic,
}

impl MassKind {
    /// The mass between `φ, d_1, d_2, d_3` of both nodes, kg, kg·m, kg·m²: multiples of `I_3`; from
    /// the length `ℓ` and the mass per length between these four.
    #[must_use]
    pub fn matrix<T: Number>(self, length: T, m: &Matrix4<T>) -> SMatrix<T, 8, 8> {
        const LINEAR: [f64; 2] = [1.0 / 3.0, 1.0 / 6.0];
        const LUMPED: [f64; 2] = [0.5, 0.0];
        let weights = |of_center: bool| match self {
            Self::Consistent => LINEAR,
            Self::Quadratic if of_center => LINEAR,
            Self::Lumped | Self::Quadratic => LUMPED,
        };
        let mut M = SMatrix::<T, 8, 8>::zeros();
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            let (weights, mass) = (weights(i == 0 || j == 0), length * m[(i, j)]);
            let [own, coupling] = weights.map(T::of);
            (M[(i, j)], M[(4 + i, 4 + j)]) = (own * mass, own * mass);
            (M[(i, 4 + j)], M[(4 + i, j)]) = (coupling * mass, coupling * mass);
        }
        if self == Self::Quadratic {
            let first = length * length / T::of(24.0);
            let second = length * length * length / T::of(120.0);
            for (d_3, sign) in [(3, 1.0), (7, -1.0)] {
                for (slot, node) in (0..3).flat_map(|slot| [(slot, slot), (slot, 4 + slot)]) {
                    M[(d_3, node)] += T::of(sign) * first * m[(0, slot)];
                    M[(node, d_3)] += T::of(sign) * first * m[(0, slot)];
                }
                M[(d_3, d_3)] += second * m[(0, 0)];
                M[(d_3, 10 - d_3)] -= second * m[(0, 0)];
            }
        }
        M
    }
}
