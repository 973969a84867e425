//! Loads and dampers, sampled at the midpoint.
//!
//! ```text
//! impulse of a step   h f̄,     f̄ = f(t_{n+1/2}, q_{n+1/2}, Δq/h)
//! wrench on a frame   P_in(q_{n+1/2})ᵀ f̄ = (f, τ),    f̄ = (f, w×d̄_1, w×d̄_2, w×d̄_3)
//! force at ϱ_I d_I    f̄ gains (0, ϱ_1 f, ϱ_2 f, ϱ_3 f)
//!                     A w = τ,    A = tr(D̄) I − D̄,    D̄ = Σ_I d̄_I d̄_Iᵀ
//! derivative          δw = A⁻¹ (δτ − δA w),
//!                     δA w = Σ_J [2 w d̄_Jᵀ − (d̄_J·w) I − d̄_J wᵀ] δd̄_J,    δd̄_J = ½ δd_J
//! ```
//! `d̄_I` averaged directors, shorter than one: the director form that is exact at the ends of a
//! step (`½ τ×d_I`) would lose a part of the torque there. Momentum changes by exactly `h (f, τ)`.
//!
//! Source: Betsch & Leyendecker 2006.
#![allow(non_snake_case)] // A, D: the matrices above

use nalgebra::{Matrix3, Vector3};
use vi_core::Motion;
use vi_core::force::{DiscreteForce, Force};
use vi_core::interval::Interval;
use vi_core::sparse::{Block, Entries};
use vi_rigid::directors::{FRAME, director};
use vi_rigid::load::{Load, LoadKind, Wrench};
use vi_rigid::rotation::skew;

/// A generalized force that acts for the whole step.
pub trait MidpointLoad: Send + Sync {
    /// `out ← out + scale f̄(q_n, q_{n+1})`, shape `n`, N.
    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]);
    /// Emits `scale ∂f̄/∂q_{n+1}`; always the same places in the same order.
    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries);
    /// `out ← out + f(t, q, v)`: the force that it approximates, shape `n`, N.
    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]);
    /// `f̄·Δq`, J: the work in a step; `scratch`: shape `n`.
    fn work(&self, s: &Interval, scratch: &mut [f64]) -> f64 {
        scratch.fill(0.0);
        self.add(s, 1.0, scratch);
        scratch.iter().zip(&s.dq).map(|(f, dq)| f * dq).sum()
    }
    /// Whether it depends on velocities in a way that dissipates energy: it must not be run
    /// backwards.
    fn is_dissipative(&self) -> bool {
        false
    }
}

/// `f(t_{n+1/2}, q_{n+1/2}, Δq/h)`: dampers and other continuous forces.
#[derive(Clone, Debug, PartialEq)]
pub struct AtMidpoint<F>(pub F);

impl<F: Force> MidpointLoad for AtMidpoint<F> {
    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.0.add(s.mid_motion(), scale, out);
    }

    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.0.add_position_derivative(s.mid_motion(), 0.5 * scale, out);
        self.0.add_velocity_derivative(s.mid_motion(), scale / s.h, out);
    }

    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        self.0.add(at, 1.0, out);
    }

    fn work(&self, s: &Interval, scratch: &mut [f64]) -> f64 {
        s.h * self.0.power(s.mid_motion(), scratch)
    }

    fn is_dissipative(&self) -> bool {
        self.0.is_dissipative()
    }
}

/// `A = tr(D̄) I − D̄` of a frame's directors.
fn spread(frame: &[f64]) -> Matrix3<f64> {
    let D: Matrix3<f64> = (0..3).map(|i| director(frame, i) * director(frame, i).transpose()).sum();
    Matrix3::identity() * D.trace() - D
}

/// `A⁻¹`; `A` is singular only when the averaged directors are parallel or vanish (half a turn).
fn inverse(A: &Matrix3<f64>) -> Matrix3<f64> {
    A.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN))
}

/// `∂(f, τ)/∂d_J = (a_J, b_J) I`: nothing for dead loads, the components of a follower.
fn follower_components(load: &Load, t: f64) -> [(f64, f64); 3] {
    if load.kind() == LoadKind::Dead {
        return [(0.0, 0.0); 3];
    }
    std::array::from_fn(|j| {
        let mut frame = [0.0; FRAME];
        frame[3 + 3 * j] = 1.0; // d_J = e_1, the others 0: the wrench is linear in the directors
        let Wrench { force, torque } = load.wrench(t, &frame);
        (force.x, torque.x)
    })
}

/// `out ← out + scale f̄` at the coordinates of the frame of the load.
fn add_to_frame(load: &Load, s: &Interval, scale: f64, out: &mut [f64]) {
    let frame = &s.q_mid[load.offset()..load.offset() + FRAME];
    let Wrench { force, torque } = load.wrench(s.t_mid(), frame);
    let w = inverse(&spread(frame)) * torque;
    for k in 0..3 {
        out[k] += scale * force[k];
    }
    for i in 0..3 {
        let f = scale * (w.cross(&director(frame, i)) + load.point()[i] * force);
        (0..3).for_each(|k| out[3 + 3 * i + k] += f[k]);
    }
}

impl MidpointLoad for Load {
    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        DiscreteForce::add_continuous(self, at, out);
    }

    fn work(&self, s: &Interval, _scratch: &mut [f64]) -> f64 {
        let own = self.offset()..self.offset() + FRAME;
        let mut force = [0.0; FRAME];
        add_to_frame(self, s, 1.0, &mut force);
        force.iter().zip(&s.dq[own]).map(|(f, dq)| f * dq).sum()
    }

    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        add_to_frame(self, s, scale, &mut out[self.offset()..]);
    }

    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        let at = self.offset();
        let frame = &s.q_mid[at..at + FRAME];
        let torque = self.wrench(s.t_mid(), frame).torque;
        let A_inverse = inverse(&spread(frame));
        let w: Vector3<f64> = A_inverse * torque;
        let components = follower_components(self, s.t_mid());
        let (row, column, transposed) = (at, at, false);
        let mut block = Block { into: out, row, column, scale: 0.5 * scale, transposed };
        for (j, (force, torque)) in components.into_iter().enumerate() {
            let d = director(frame, j);
            let dA = 2.0 * w * d.transpose() - d.dot(&w) * Matrix3::identity() - d * w.transpose();
            let dw = A_inverse * (torque * Matrix3::identity() - dA); // ∂w/∂d̄_J
            emit(&(force * Matrix3::identity()), 0, 3 + 3 * j, &mut block);
            for i in 0..3 {
                let own = if i == j { skew(&w) } else { Matrix3::zeros() };
                let lever = self.point()[i] * force * Matrix3::identity();
                let of_director = own - skew(&director(frame, i)) * dw + lever;
                emit(&of_director, 3 + 3 * i, 3 + 3 * j, &mut block);
            }
        }
    }
}

fn emit(matrix: &Matrix3<f64>, row: usize, column: usize, out: &mut dyn Entries) {
    for i in 0..3 {
        for j in 0..3 {
            out.add(row + i, column + j, matrix[(i, j)]);
        }
    }
}
