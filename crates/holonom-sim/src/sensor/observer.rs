//! What an observer on a body sees.
//!
//! ```text
//! position          R_Bᵀ (x − x_B)                    R_B = (d_1 d_2 d_3)_B A_Bᵀ: the body's own axes in space
//! velocity          R_Bᵀ (ẋ − ẋ_B − ω_B × (x − x_B))  its rate
//! orientation       R_Bᵀ R
//! angular velocity  R_Bᵀ (ω − ω_B)
//! ```

use nalgebra::{Matrix3, Vector3};
use vi_core::Number;
use vi_rigid::directors;

/// A body in whose frame something is given.
#[derive(Clone, Debug)]
pub(super) struct Observer {
    pub(super) first: usize, // first coordinate of its frame
    to_own: Matrix3<f64>,    // Aᵀ
}

impl Observer {
    /// The frame of a body with its first coordinate; `principal`: from its own components to those
    /// along its directors.
    pub(super) fn new(first: usize, principal: &Matrix3<f64>) -> Self {
        Self { first, to_own: principal.transpose() }
    }

    /// `R_B`.
    pub(super) fn axes(&self, q: &[f64]) -> Matrix3<f64> {
        self.axes_at(&|i| q[i])
    }

    /// The same at coordinates of any numbers.
    pub(super) fn axes_at<T: Number>(&self, q: &impl Fn(usize) -> T) -> Matrix3<T> {
        let directors = Matrix3::from_fn(|i, j| q(self.first + 3 + 3 * j + i));
        directors * self.to_own.map(T::of)
    }

    pub(super) fn position(&self, q: &[f64], x: Vector3<f64>) -> Vector3<f64> {
        self.axes(q).tr_mul(&(x - directors::center(&q[self.first..])))
    }

    pub(super) fn velocity(
        &self,
        q: &[f64],
        v: &[f64],
        x: Vector3<f64>,
        rate: Vector3<f64>,
    ) -> Vector3<f64> {
        let [q_own, v_own] = [q, v].map(|all| &all[self.first..self.first + 12]);
        let arm = x - directors::center(q_own);
        let omega = directors::angular_velocity(q_own, v_own);
        self.axes(q).tr_mul(&(rate - directors::center(v_own) - omega.cross(&arm)))
    }

    pub(super) fn angular_velocity(
        &self,
        q: &[f64],
        v: &[f64],
        omega: Vector3<f64>,
    ) -> Vector3<f64> {
        let [q_own, v_own] = [q, v].map(|all| &all[self.first..self.first + 12]);
        self.axes(q).tr_mul(&(omega - directors::angular_velocity(q_own, v_own)))
    }
}
