//! Non-conservative forces by the discrete Lagrange–d'Alembert principle.
//!
//! ```text
//! f_d^-(q_n, q_{n+1}) stands beside D_1 L_d(q_n, q_{n+1}),
//! f_d^+(q_n, q_{n+1}) stands beside D_2 L_d(q_n, q_{n+1}),
//! midpoint choice: f_d^± = (h/2) f(t_{n+1/2}, q_{n+1/2}, Δq/h)
//! ```
//! A force may depend on the strains of earlier steps through internal variables `z_n`. They are
//! part of the [`crate::State`]: a step reads `z_n` from its [`Interval`], and `z_{n+1}` is a
//! function of the step.
//!
//! Source: Marsden & West 2001, part 3. The midpoint choice keeps order 2 in q, p and λ.

use crate::configuration::Motion;
use crate::coordinate_force::AlongUnknown;
use crate::interpolation::StrainInterpolation;
use crate::interval::{Interval, Slot, StepChange};
use crate::linear::dot;
use crate::quantity_effort::QuantityEffort;
use crate::sparse::{Block, Entries, Product};
use std::borrow::Cow;
use std::sync::Arc;

/// What exerts a force: its work is listed under this name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// A force element, by its name; empty where it was given none.
    Element(String),
    /// A property of the whole system, in words, for example `material damping`.
    System(&'static str),
}

/// A force element without a name.
impl Default for Source {
    fn default() -> Self {
        Self::Element(String::new())
    }
}

/// A discrete force pair `(f_d^-, f_d^+)`, N·s.
pub trait DiscreteForce: Send + Sync {
    /// `out ← out + f_d^-(q_n, q_{n+1})`.
    fn add_minus(&self, s: &Interval, out: &mut [f64]);
    /// `out ← out + f_d^+(q_n, q_{n+1})`.
    fn add_plus(&self, s: &Interval, out: &mut [f64]);
    /// Emits `D_by f_d^of`: `D_1 f_d^-`, `D_2 f_d^-`, `D_1 f_d^+` or `D_2 f_d^+`; for each always
    /// the same places in the same order.
    fn add_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries);
    /// Emits `D_2 f_d^-`, which every step needs: as [`DiscreteForce::add_slope`], or as an entry
    /// along an unknown ([`Entries::add_along`]).
    fn add_minus_d2(&self, s: &Interval, out: &mut dyn Entries) {
        self.add_slope(s, Slot::First, Slot::Second, out);
    }
    /// Emits `∂f_d^of/∂z`, columns of all internal variables of the system.
    fn add_internal_slope(&self, _s: &Interval, _of: Slot, _out: &mut dyn Entries) {}
    /// `out ← out + ∂f_d^of/∂h δh + ∂f_d^of/∂t δt_{n+1/2}` at fixed configurations.
    ///
    /// # Errors
    /// [`NoTimeSlope`].
    fn add_step_slope(
        &self,
        s: &Interval,
        of: Slot,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope>;
    /// `out ← out + scale ∂f/∂t (t, q, v)` of the continuous force.
    ///
    /// # Errors
    /// [`NoTimeSlope`], also where the force is not known by its continuous form.
    fn add_time_slope(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope>;
    /// `out ← out + f(t, q, v)`, N: the continuous force that the pair approximates.
    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]);
    /// `(f_d^- + f_d^+)·Δq/h`, J: the work in a step; `scratch`: shape `n`.
    fn work(&self, s: &Interval, scratch: &mut [f64]) -> f64 {
        scratch.fill(0.0);
        self.add_minus(s, scratch);
        self.add_plus(s, scratch);
        scratch.iter().zip(&s.v_mid).map(|(f, v)| f * v).sum()
    }
    /// Emits `scale ∂f/∂q`, the stiffness of the force in a steady motion with the velocity `v`: at
    /// rest, or in a rotation of all that the force joins, which changes no length and no rate.
    /// Always the same places in the same order.
    fn add_stiffness(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries);
    /// Emits `scale ∂f/∂q (t, q, v)`, whatever the motion; always the same places in the same
    /// order.
    fn add_position_slope(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries);
    /// Emits `scale ∂f/∂v (t, q, v)`; always the same places in the same order.
    fn add_damping(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries);
    /// Emits `by_q ∂f/∂q + by_v ∂f/∂v`, what has no factor left out: always the same places in the
    /// same order where the same factors are zero. What vanishes for all configurations may be left
    /// out as well.
    fn add_gauss_slopes(&self, at: Motion<'_>, [by_q, by_v]: [f64; 2], out: &mut dyn Entries) {
        if by_q != 0.0 {
            self.add_position_slope(at, by_q, out);
        }
        if by_v != 0.0 {
            self.add_damping(at, by_v, out);
        }
    }
    /// Emits `∂²(y_0·f_d^- + y_1·f_d^+)/∂q_i∂q_j`, rows of the first of both slots, where second
    /// derivatives are known: nothing else.
    fn add_bend(&self, _s: &Interval, _y: [&[f64]; 2], _: [Slot; 2], _out: &mut dyn Entries) {}
    /// Its second derivatives by the length of the step, where they are known.
    fn length_bends(&self) -> Option<&dyn LengthBends> {
        None
    }
    /// Emits `a ∂²/∂q∂q + b ∂²/∂q∂v + c ∂²/∂v∂q + d ∂²/∂v∂v` of `z·f(t, q, v)`, rows of the first,
    /// where second derivatives are known: nothing else.
    fn add_gauss_bend(&self, _at: Motion<'_>, _z: &[f64], _by: [f64; 4], _out: &mut dyn Entries) {}
    /// Emits `scale ∂f/∂z`, rows of coordinates, columns of all internal variables of the system:
    /// states of signals that the force reads.
    fn add_state_slopes(&self, _at: Motion<'_>, _: f64, _: &mut dyn Entries) {}
    /// Whether it acts from the ground on what rotates, as a damper whose other end stands still:
    /// the rate that it sees in a steady rotation changes with the configuration, by `W δq`.
    /// [`DiscreteForce::add_stiffness`] is then `∂f/∂q` at `v`, and `∂f/∂v W` comes to it.
    fn acts_from_ground(&self) -> bool {
        false
    }
    /// Whether the force takes energy out whichever way time runs (dampers, friction).
    fn is_dissipative(&self) -> bool;
    /// Number of internal variables; zero for most forces.
    fn internal_variables(&self) -> usize {
        0
    }
    /// `out ← z_{n+1}`, the internal variables at the end of a step that started with
    /// [`Interval::internal`].
    fn advance(&self, _s: &Interval, _out: &mut [f64]) {}
    /// Emits `∂z_{n+1}/∂q_n` or `∂z_{n+1}/∂q_{n+1}`, rows of its own internal variables.
    fn add_advance_slope(&self, _s: &Interval, _by: Slot, _out: &mut dyn Entries) {}
    /// Emits `∂z_{n+1}/∂z_n` of its own internal variables.
    fn add_advance_internal_slope(&self, _s: &Interval, _out: &mut dyn Entries) {}
    /// Its effort where it acts along an unknown of a step.
    fn along_unknown(&self) -> Option<AlongUnknown<'_>> {
        None
    }
    /// Its effort where it acts along an unknown of a step by quantities of the whole system.
    fn of_quantities(&self) -> Option<&dyn QuantityEffort> {
        None
    }
    /// The form in Galerkin steps of a force of strain rates; `None` where `f` is evaluated at
    /// Gauss nodes.
    fn interpolation(&self) -> Option<&dyn StrainInterpolation> {
        None
    }
}

/// Second derivatives of `φ = y_0·f_d^- + y_1·f_d^+` by the length `h` of a step, at fixed nodes
/// and a fixed time of the middle.
pub trait LengthBends {
    /// `out ← out + ∂²φ/∂h∂q_by`.
    fn add_slope_by_length(&self, s: &Interval, y: [&[f64]; 2], by: Slot, out: &mut [f64]);
    /// `∂²φ/∂h²`.
    fn second_by_length(&self, s: &Interval, y: [&[f64]; 2]) -> f64;
}

/// A force depends on time in a way whose derivative is not known: a kink, a jump, a function of
/// the user's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its derivative by the time is not known")]
pub struct NoTimeSlope;

/// The velocity at which [`DiscreteForce::add_stiffness`] takes slopes: that of a steady rotation
/// for what acts from the ground, rest for what turns with it.
#[must_use]
pub fn seen_velocity(acts_from_ground: bool, v: &[f64]) -> Cow<'_, [f64]> {
    if acts_from_ground { Cow::Borrowed(v) } else { Cow::Owned(vec![0.0; v.len()]) }
}

/// A continuous generalized force `f(t, q, v)`, N.
pub trait Force: Send + Sync {
    /// `out ← out + scale f(t, q, v)`.
    fn add(&self, at: Motion<'_>, scale: f64, out: &mut [f64]);
    /// `f(t, q, v)·v`, W; `scratch`: shape `n`.
    fn power(&self, at: Motion<'_>, scratch: &mut [f64]) -> f64 {
        scratch.fill(0.0);
        self.add(at, 1.0, scratch);
        scratch.iter().zip(at.v).map(|(f, v)| f * v).sum()
    }
    /// Emits `scale ∂f/∂q`; always the same places in the same order.
    fn add_position_derivative(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries);
    /// Emits `scale ∂f/∂v`; always the same places in the same order.
    fn add_velocity_derivative(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries);
    /// See [`DiscreteForce::add_gauss_bend`].
    fn add_bend(&self, _at: Motion<'_>, _z: &[f64], _by: [f64; 4], _out: &mut dyn Entries) {}
    /// `out ← out + scale ∂f/∂t`.
    ///
    /// # Errors
    /// [`NoTimeSlope`], unless said otherwise.
    fn add_time_derivative(
        &self,
        _at: Motion<'_>,
        _scale: f64,
        _out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        Err(NoTimeSlope)
    }
    /// See [`DiscreteForce::acts_from_ground`].
    fn acts_from_ground(&self) -> bool {
        false
    }
    /// Whether the force takes energy out whichever way time runs.
    fn is_dissipative(&self) -> bool;
}

impl<F: Force + ?Sized> Force for Arc<F> {
    fn add(&self, at: Motion<'_>, scale: f64, out: &mut [f64]) {
        (**self).add(at, scale, out);
    }
    fn power(&self, at: Motion<'_>, scratch: &mut [f64]) -> f64 {
        (**self).power(at, scratch)
    }
    fn add_position_derivative(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        (**self).add_position_derivative(at, scale, out);
    }
    fn add_velocity_derivative(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        (**self).add_velocity_derivative(at, scale, out);
    }
    fn add_time_derivative(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        (**self).add_time_derivative(at, scale, out)
    }
    fn add_bend(&self, at: Motion<'_>, z: &[f64], by: [f64; 4], out: &mut dyn Entries) {
        (**self).add_bend(at, z, by, out);
    }
    fn acts_from_ground(&self) -> bool {
        (**self).acts_from_ground()
    }
    fn is_dissipative(&self) -> bool {
        (**self).is_dissipative()
    }
}

/// `f_d^± = (h/2) f(t_{n+1/2}, q_{n+1/2}, Δq/h)`.
#[derive(Clone, Debug)]
pub struct MidpointForce<F>(pub F);

impl<F: Force> DiscreteForce for MidpointForce<F> {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        self.0.add(s.mid_motion(), 0.5 * s.h, out);
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        self.add_minus(s, out);
    }

    fn add_slope(&self, s: &Interval, _of: Slot, by: Slot, out: &mut dyn Entries) {
        // of (h/2) f(q_{n+1/2}, Δq/h): (h/4) f_q ± ½ f_v
        self.0.add_position_derivative(s.mid_motion(), 0.25 * s.h, out);
        self.0.add_velocity_derivative(s.mid_motion(), 0.5 * by.sign(), out);
    }

    fn add_bend(&self, s: &Interval, y: [&[f64]; 2], [i, j]: [Slot; 2], out: &mut dyn Entries) {
        let [a, b] = [i, j].map(|slot| slot.sign() / s.h);
        let by = [0.25, 0.5 * b, 0.5 * a, a * b].map(|by| 0.5 * s.h * by);
        self.0.add_bend(s.mid_motion(), &sum(y), by, out);
    }

    fn add_gauss_bend(&self, at: Motion<'_>, z: &[f64], by: [f64; 4], out: &mut dyn Entries) {
        self.0.add_bend(at, z, by, out);
    }

    fn length_bends(&self) -> Option<&dyn LengthBends> {
        Some(self)
    }

    fn add_step_slope(
        &self,
        s: &Interval,
        _of: Slot,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        // of (h/2) f(t_{n+1/2}, q_{n+1/2}, Δq/h): ½ (f − f_v Δq/h) and (h/2) f_t
        let (at, dh) = (s.mid_motion(), change.length);
        self.0.add(at, 0.5 * dh, out);
        self.0.add_velocity_derivative(at, -0.5 * dh, &mut Product { v: at.v, out });
        self.0.add_time_derivative(at, 0.5 * s.h * change.middle, out)
    }

    fn add_time_slope(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        self.0.add_time_derivative(at, scale, out)
    }

    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        self.0.add(at, 1.0, out);
    }

    fn work(&self, s: &Interval, scratch: &mut [f64]) -> f64 {
        s.h * self.0.power(s.mid_motion(), scratch)
    }

    fn add_stiffness(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        let v = seen_velocity(self.0.acts_from_ground(), at.v);
        self.0.add_position_derivative(Motion { v: &v, ..at }, scale, out);
    }

    fn acts_from_ground(&self) -> bool {
        self.0.acts_from_ground()
    }

    fn add_position_slope(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.0.add_position_derivative(at, scale, out);
    }

    fn add_damping(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.0.add_velocity_derivative(at, scale, out);
    }

    fn is_dissipative(&self) -> bool {
        self.0.is_dissipative()
    }
}

/// Of `(h/2) z·f(q_{n+1/2}, Δq/h)`, `z = y_0 + y_1`.
impl<F: Force> LengthBends for MidpointForce<F> {
    fn add_slope_by_length(&self, s: &Interval, y: [&[f64]; 2], by: Slot, out: &mut [f64]) {
        let (at, z) = (s.mid_motion(), sum(y));
        {
            let into = &mut Product { v: &z, out: &mut *out };
            let out = &mut Block { into, row: 0, column: 0, scale: 1.0, transposed: true };
            self.0.add_position_derivative(at, 0.25, out);
        }
        let by = [0.0, -0.25, 0.0, -0.5 * by.sign() / s.h];
        self.0.add_bend(at, &z, by, &mut Product { v: at.v, out });
    }

    fn second_by_length(&self, s: &Interval, y: [&[f64]; 2]) -> f64 {
        let (at, mut turned) = (s.mid_motion(), vec![0.0; s.dim()]);
        let by = [0.0, 0.0, 0.0, 0.5 / s.h];
        let out = &mut Product { v: at.v, out: &mut turned };
        self.0.add_bend(at, &sum(y), by, out);
        dot(&turned, at.v)
    }
}

fn sum([a, b]: [&[f64]; 2]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// Linear damping `f = −C v` with a constant matrix given by its entries `(row, column, value)`.
#[derive(Clone, Debug)]
pub struct LinearDamping {
    /// Entries of `C`, N·s/m.
    pub entries: Vec<(usize, usize, f64)>,
}

impl Force for LinearDamping {
    fn add(&self, Motion { v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        for &(i, j, c) in &self.entries {
            out[i] -= scale * c * v[j];
        }
    }
    fn add_position_derivative(&self, _at: Motion<'_>, _scale: f64, _out: &mut dyn Entries) {}
    fn add_velocity_derivative(&self, _at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        let mut block = Block { into: out, row: 0, column: 0, scale: -scale, transposed: false };
        for &(i, j, c) in &self.entries {
            block.add(i, j, c);
        }
    }
    fn add_time_derivative(
        &self,
        _at: Motion<'_>,
        _scale: f64,
        _out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        Ok(())
    }
    fn acts_from_ground(&self) -> bool {
        true
    }
    fn is_dissipative(&self) -> bool {
        true
    }
}
