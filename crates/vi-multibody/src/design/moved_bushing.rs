//! Bushings whose frames move with a parameter.
//!
//! ```text
//! F(q) = F_0 + Q X                point and axes: linear in Q = (φ, d_1, d_2, d_3) of a body
//! F_θ(q) = F(δq)                  δQ = Q X_θ X⁻¹ in a body
//!                                 δQ = −[ω]× Q − (t, 0) of the other body, where the ground's frame moves by ω and t
//! V_θ = ∇V·δq                     (∇V)_θ = δᵀ ∇V + ∇²V δq
//! f_θ = δᵀ f + (∂f/∂q) δq + (∂f/∂v) δv
//! ```
//! A frame that moves in its body is one of a body that is displaced instead, by `δq = D q + d`, so
//! that slopes by positions are all that is needed. The coordinates of a bushing do not change
//! where both frames move as one: what moves the ground's frame moves the other one back.
#![allow(non_snake_case)] // Q, D

use super::tangent::ForceChange;
use crate::force::bushing::{SixForce, SixSpring};
use crate::force::law::Input;
use crate::geometry::six_coordinates::{AttachedFrame, SixCoordinates};
use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3};
use vi_core::force::DiscreteForce;
use vi_core::interval::{Interval, Slot};
use vi_core::linear::dot;
use vi_core::potential::DiscretePotential;
use vi_core::sparse::Product;
use vi_core::{Configuration, Motion};
use vi_rigid::directors::FRAME;

/// How a frame changes: in a body along its directors, on the ground in space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameChange {
    /// Of its point, m.
    pub point: Vector3<f64>,
    /// Of its axes, columns.
    pub axes: Matrix3<f64>,
}

/// A body that is displaced.
#[derive(Clone, Debug)]
struct Displaced {
    offset: usize,
    own: Matrix4<f64>,  // D  from the right
    spin: Vector3<f64>, // ω, rad
    by: Vector3<f64>,   // t, m
}

/// `δq` of a bushing whose frames move.
#[derive(Clone, Debug)]
pub struct MovedFrames(Vec<Displaced>);

impl MovedFrames {
    /// Of coordinates between two frames that change so; `None` where nothing moves.
    #[must_use]
    pub fn of(coordinates: &SixCoordinates, changes: [FrameChange; 2]) -> Option<Self> {
        let [from, to] = coordinates.frames();
        let own = [(from, to, changes[0]), (to, from, changes[1])];
        let all: Vec<Displaced> = own.into_iter().filter_map(displaced).collect();
        (!all.is_empty()).then_some(Self(all))
    }

    /// `δq` at a configuration, shape `n`.
    fn of_positions(&self, q: &[f64]) -> Vec<f64> {
        let mut out = self.of_velocities(q);
        for body in &self.0 {
            (0..3).for_each(|k| out[body.offset + k] += body.by[k]);
        }
        out
    }

    /// `δv` with a velocity, shape `n`.
    fn of_velocities(&self, v: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; v.len()];
        for body in &self.0 {
            let own = body.offset..body.offset + FRAME;
            let Q = Matrix3x4::from_column_slice(&v[own.clone()]);
            let moved = Q * body.own + body.spin.cross_matrix() * Q;
            out[own].iter_mut().zip(moved.as_slice()).for_each(|(out, x)| *out += x);
        }
        out
    }

    /// `out ← out + scale δᵀ f`.
    fn add_transposed(&self, f: &[f64], scale: f64, out: &mut [f64]) {
        for body in &self.0 {
            let own = body.offset..body.offset + FRAME;
            let Q = Matrix3x4::from_column_slice(&f[own.clone()]);
            let moved = Q * body.own.transpose() - body.spin.cross_matrix() * Q;
            out[own].iter_mut().zip(moved.as_slice()).for_each(|(out, x)| *out += scale * x);
        }
    }

    /// `y_θ = ∂y/∂q δq + ∂y/∂v δv` of a number of the coordinates and their rates with these
    /// slopes, both of shape `n`.
    #[must_use]
    pub fn change(&self, [q, v]: [&[f64]; 2], [by_q, by_v]: [&[f64]; 2]) -> f64 {
        dot(by_q, &self.of_positions(q)) + dot(by_v, &self.of_velocities(v))
    }
}

/// What a frame that changes displaces: its body, or that of the other one.
fn displaced(
    (frame, other, change): (&AttachedFrame, &AttachedFrame, FrameChange),
) -> Option<Displaced> {
    if change == FrameChange::default() {
        return None;
    }
    let FrameChange { point, axes } = change;
    let (spin, by) = (Vector3::zeros(), Vector3::zeros());
    let Some((offset, placed)) = frame.in_its_body() else {
        let (offset, _) = other.in_its_body()?;
        let (at, own) = frame.on_the_ground();
        let turned = axes * own.transpose(); // [ω]×
        let spin = Vector3::new(turned[(2, 1)], turned[(0, 2)], turned[(1, 0)]);
        let by = point - spin.cross(&at);
        return Some(Displaced { offset, own: Matrix4::zeros(), spin: -spin, by: -by });
    };
    let mut moved = Matrix4::zeros();
    moved.fixed_view_mut::<3, 1>(1, 0).copy_from(&point);
    moved.fixed_view_mut::<3, 3>(1, 1).copy_from(&axes);
    let own = moved * placed.try_inverse()?;
    Some(Displaced { offset, own, spin, by })
}

/// A law of six coordinates whose frames move.
#[derive(Debug)]
pub struct MovedSixForce {
    force: SixForce,
    frames: MovedFrames,
}

impl MovedSixForce {
    /// `None` where the law reads others than its coordinates and the time: they do not move with
    /// its frames.
    #[must_use]
    pub fn new(force: SixForce, frames: MovedFrames) -> Option<Self> {
        let own = |input: &Input| matches!(input, Input::Six(_) | Input::Time);
        let reads = !force.reading.remembers() && force.reading.inputs.iter().all(own);
        reads.then_some(Self { force, frames })
    }
}

impl ForceChange for MovedSixForce {
    fn add(&self, s: &Interval, of: Slot, out: &mut [f64]) {
        let mut f = vec![0.0; out.len()];
        match of {
            Slot::First => self.force.add_minus(s, &mut f),
            Slot::Second => self.force.add_plus(s, &mut f),
        }
        self.frames.add_transposed(&f, 1.0, out);
        for by in Slot::BOTH {
            let v = &self.frames.of_positions(s.node(by));
            self.force.add_slope(s, of, by, &mut Product { v, out });
        }
    }
    fn add_at_node(&self, at: Motion<'_>, out: &mut [f64]) {
        let mut f = vec![0.0; out.len()];
        self.force.add_continuous(at, &mut f);
        self.frames.add_transposed(&f, 1.0, out);
        let (dq, dv) = (self.frames.of_positions(at.q), self.frames.of_velocities(at.v));
        self.force.add_position_slope(at, 1.0, &mut Product { v: &dq, out });
        self.force.add_damping(at, 1.0, &mut Product { v: &dv, out });
    }
}

/// A potential of six coordinates whose frames move.
#[derive(Clone, Debug)]
pub struct MovedSixSpring {
    spring: SixSpring,
    frames: MovedFrames,
}

impl MovedSixSpring {
    /// Of a spring.
    #[must_use]
    pub fn new(spring: SixSpring, frames: MovedFrames) -> Self {
        Self { spring, frames }
    }

    /// `V_θ`, J.
    #[must_use]
    pub fn energy(&self, at: Configuration<'_>) -> f64 {
        let mut slope = vec![0.0; at.q.len()];
        self.spring.add_gradient(at, 1.0, &mut slope);
        dot(&slope, &self.frames.of_positions(at.q))
    }
}

/// `−h (D U_d)_θ`, and `−(∇V)_θ` at a node.
impl ForceChange for MovedSixSpring {
    fn add(&self, s: &Interval, of: Slot, out: &mut [f64]) {
        let mut slope = vec![0.0; out.len()];
        match of {
            Slot::First => self.spring.add_d1(s, -s.h, &mut slope),
            Slot::Second => self.spring.add_d2(s, -s.h, &mut slope),
        }
        self.frames.add_transposed(&slope, 1.0, out);
        let [start, end] = [&s.q0, &s.q1].map(|q| self.frames.of_positions(q));
        match of {
            Slot::First => {
                self.spring.add_d1_d1(s, -s.h, &mut Product { v: &start, out });
                self.spring.add_d2_d1(s, -s.h, &mut Product { v: &end, out });
            }
            Slot::Second => {
                self.spring.add_d2_d2(s, -s.h, &mut Product { v: &end, out });
                // D_1 D_2 U_d is D_2 D_1 U_d of the step the other way round
                self.spring.add_d2_d1(&s.exchanged(), -s.h, &mut Product { v: &start, out });
            }
        }
    }
    fn add_at_node(&self, at: Motion<'_>, out: &mut [f64]) {
        let mut slope = vec![0.0; out.len()];
        self.spring.add_gradient(at.configuration(), -1.0, &mut slope);
        self.frames.add_transposed(&slope, 1.0, out);
        let dq = self.frames.of_positions(at.q);
        self.spring.add_hessian(at.configuration(), -1.0, &mut Product { v: &dq, out });
    }
}
