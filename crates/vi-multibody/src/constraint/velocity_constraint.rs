//! Constraints on velocities, `A(q) v = b(t, q)`, and their discrete form over a step.
//!
//! ```text
//! variations        A(q_n) δq = 0                                          rows of `U`
//! step              h A_d(q_n, q_{n+1}) = 0                                in the place of as many balances
//! node              A(q_n) v = b(t_n, q_n)
//! ```
//! `A_d` agrees with `A Δq/h − b` at the midpoint up to `O(h²)` and is symmetric,
//! `A_d(q, q'; h) = A_d(q', q; −h)`: the step is then of order 2 and reversible. A row of `A` is
//! given by wrenches on the frames; in coordinates it is `(f, ½ τ×d_1, ½ τ×d_2, ½ τ×d_3)`.
//!
//! ```text
//! pace     h A_d = Δx,     A = ∇x
//!          Δx: change of a joint coordinate, or ½ (n_n + n_{n+1})·(X_{n+1} − X_n)
//! ```
//! A blade is one pace: `n` and `X` are fixed in the body. Weighed by factors that depend on the
//! configuration: [`crate::law::velocity`].
//!
//! Source: J. Cortés, S. Martínez, Nonlinearity 14 (2001) 1365 (discrete Lagrange–d'Alembert
//! principle).

use crate::constraint::joint_coordinate::JointCoordinate;
use crate::geometry::form::Form;
use crate::pair::Twist;
use vi_core::interval::{Interval, StepChange};
use vi_core::sparse::{Entries, Product};
use vi_core::{Configuration, Motion, Number};
use vi_rigid::directors::{self, FRAME};

/// Visits wrenches on frames: number of the frame, force and torque about its centre.
pub type WrenchVisitor<'a> = dyn FnMut(usize, Twist) + 'a;

/// One row `A(q) v = b(t, q)`.
pub trait VelocityConstraint: Send + Sync {
    /// The row of `A(q)`, as wrenches.
    fn for_each_wrench(&self, q: &[f64], visit: &mut WrenchVisitor<'_>);
    /// Emits `scale` times the row of `A(q)`, always the same places in the same order.
    fn emit(&self, q: &[f64], row: usize, scale: f64, out: &mut dyn Entries);
    /// `DA(q)[v] w`.
    fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64;
    /// Emits `scale ∂A_i/∂q_j` at row `i` and column `j`, always the same places in the same order.
    fn emit_second(&self, q: &[f64], scale: f64, out: &mut dyn Entries);
    /// `b(t, q)`.
    fn rate(&self, at: Configuration<'_>) -> f64;
    /// `ḃ` along the velocity `v`.
    fn rate_change(&self, at: Motion<'_>) -> f64;
    /// Emits `scale ∂b/∂q` as row `row`.
    fn emit_rate_slope(&self, at: Configuration<'_>, row: usize, scale: f64, out: &mut dyn Entries);
    /// Whether `b` may be other than zero.
    fn is_driven(&self) -> bool;
    /// `h A_d`, in the unit of the row times s.
    fn residual(&self, s: &Interval) -> f64;
    /// The derivative of `h A_d` by the end of the step, as wrenches.
    fn for_each_wrench_of_step(&self, s: &Interval, visit: &mut WrenchVisitor<'_>);
    /// `out ← out + scale ∂/∂q` of `DA(q)[v] v − ḃ`, at fixed `v`, shape `n`; `false` where it is
    /// not known.
    fn add_acceleration_slope(&self, _at: Motion<'_>, _scale: f64, _out: &mut [f64]) -> bool {
        false
    }
    /// Whether it reads one of the joint coordinates that are meant.
    fn reads(&self, _meant: &dyn Fn(&JointCoordinate) -> bool) -> bool {
        false
    }
    /// How `h A_d` changes with the length and the time of a step between the same ends; `None`
    /// where the time enters. The default is that of constraints that are not driven.
    fn step_change(&self, _s: &Interval, _change: StepChange) -> Option<f64> {
        Some(0.0)
    }
}

/// The coordinates of a frame.
#[inline]
pub(super) fn frame_of(q: &[f64], frame: usize) -> &[f64] {
    &q[FRAME * frame..FRAME * (frame + 1)]
}

/// Emits `scale (f, ½ τ×d_1, ½ τ×d_2, ½ τ×d_3)` of a wrench on a frame.
pub(crate) fn emit_wrench(
    q: &[f64],
    frame: usize,
    row: usize,
    scale: f64,
    wrench: &Twist,
    out: &mut dyn Entries,
) {
    let (own, first) = (frame_of(q, frame), FRAME * frame);
    (0..3).for_each(|k| out.add(row, first + k, scale * wrench.linear[k]));
    for i in 0..3 {
        let part = 0.5 * wrench.angular.cross(&directors::director(own, i));
        (0..3).for_each(|k| out.add(row, first + 3 + 3 * i + k, scale * part[k]));
    }
}

/// `½ (n_n + n_{n+1})·(X_{n+1} − X_n)` of `n` and `X`.
pub(crate) fn along_change<T: Number>([direction, point]: [&Form<T>; 2], s: &Interval) -> T {
    let mean = (direction.at(&s.q0) + direction.at(&s.q1)) * T::of(0.5);
    mean.dot(&point.rate(&s.dq))
}

/// A quantity whose change over a step is constrained.
#[derive(Clone, Debug)]
pub enum Pace {
    /// A joint coordinate.
    Joint(Box<JointCoordinate>),
    /// The part of the motion of a point `X` along a vector `n`.
    Along {
        /// `n`.
        direction: Form,
        /// `X`.
        point: Form,
    },
}

impl Pace {
    /// `Δx` over a step.
    pub(crate) fn change(&self, s: &Interval) -> f64 {
        match self {
            Self::Joint(coordinate) => coordinate.change(s).difference,
            Self::Along { direction, point } => along_change([direction, point], s),
        }
    }

    /// `∇x` at `q`, as wrenches.
    pub(crate) fn for_each_wrench(&self, q: &[f64], visit: &mut WrenchVisitor<'_>) {
        match self {
            Self::Joint(coordinate) => coordinate.for_each_wrench(q, visit),
            Self::Along { direction, point } => point.for_each_wrench(q, &direction.at(q), visit),
        }
    }

    /// The derivative of `Δx` by the end of the step, as wrenches.
    pub(crate) fn for_each_wrench_of_step(&self, s: &Interval, visit: &mut WrenchVisitor<'_>) {
        match self {
            Self::Joint(coordinate) => coordinate.for_each_wrench(&s.q1, visit),
            Self::Along { direction, point } => {
                let mean = 0.5 * (direction.at(&s.q0) + direction.at(&s.q1));
                point.for_each_wrench(&s.q1, &mean, &mut *visit);
                direction.for_each_wrench(&s.q1, &(0.5 * point.rate(&s.dq)), visit);
            }
        }
    }

    /// The entries of `∇x(q)`.
    pub(crate) fn for_each_slope(&self, q: &[f64], visit: impl FnMut(usize, f64)) {
        match self {
            Self::Joint(coordinate) => coordinate.for_each_slope(q, visit),
            Self::Along { direction, point } => point.for_each_slope(&direction.at(q), visit),
        }
    }

    /// `∇x·v`.
    #[must_use]
    pub fn rate(&self, q: &[f64], v: &[f64]) -> f64 {
        match self {
            Self::Joint(coordinate) => coordinate.rate(q, v),
            Self::Along { direction, point } => direction.at(q).dot(&point.rate(v)),
        }
    }

    /// `D(∇x)[v] w`.
    pub(crate) fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        match self {
            Self::Joint(coordinate) => coordinate.second(q, v, w),
            Self::Along { direction, point } => direction.rate(v).dot(&point.rate(w)),
        }
    }

    pub(crate) fn emit_second(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        match self {
            Self::Joint(coordinate) => coordinate.emit_second(q, scale, out),
            Self::Along { direction, point } => {
                for a in point.terms() {
                    for b in direction.terms() {
                        let value = scale * a.coefficient * b.coefficient;
                        let dimension = a.dimension.min(b.dimension);
                        (0..dimension).for_each(|k| out.add(a.offset + k, b.offset + k, value));
                    }
                }
            }
        }
    }
}

/// A single quantity that does not change.
impl VelocityConstraint for Pace {
    fn for_each_wrench(&self, q: &[f64], visit: &mut WrenchVisitor<'_>) {
        Self::for_each_wrench(self, q, visit);
    }

    fn emit(&self, q: &[f64], row: usize, scale: f64, out: &mut dyn Entries) {
        self.for_each_slope(q, |i, slope| out.add(row, i, scale * slope));
    }

    fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        Self::second(self, q, v, w)
    }

    fn emit_second(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        Self::emit_second(self, q, scale, out);
    }

    fn rate(&self, _: Configuration<'_>) -> f64 {
        0.0
    }

    fn rate_change(&self, _: Motion<'_>) -> f64 {
        0.0
    }

    fn emit_rate_slope(&self, _: Configuration<'_>, _: usize, _: f64, _: &mut dyn Entries) {}

    fn is_driven(&self) -> bool {
        false
    }

    /// Of points along directions it is constant.
    fn add_acceleration_slope(&self, at: Motion<'_>, scale: f64, out: &mut [f64]) -> bool {
        if let Self::Joint(coordinate) = self {
            coordinate.emit_third(at.q, at.v, scale, &mut Product { v: at.v, out });
        }
        true
    }

    fn residual(&self, s: &Interval) -> f64 {
        self.change(s)
    }

    fn for_each_wrench_of_step(&self, s: &Interval, visit: &mut WrenchVisitor<'_>) {
        Self::for_each_wrench_of_step(self, s, visit);
    }
}
