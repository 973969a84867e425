//! The two-point argument `(q_n, q_{n+1})` of every discrete function.
//!
//! A discrete Lagrangian, force or potential is a function of two neighbouring configurations. It
//! receives them as one [`Interval`], which also carries the increment `Δq` and the midpoint:
//! whoever moves the end of the interval knows `Δq` to its own relative precision (a rotation
//! increment, a Newton unknown), while the difference of two stored coordinates is only good to
//! `ε|q|`, which divided by `h` would spoil the momenta.
//!
//! The rounding error of `q_{n+1} = q_n + Δq` is added to the next increment (compensated
//! summation, Kahan, Comm. ACM 8 (1965) 40); between two steps it is part of the [`crate::State`].
//! Where `Δq` is found from `g(q_{n+1}) = 0`, these errors point along the normals more often one
//! way than the other, and without their sum the angular momentum drifts by a few hundredths of `ε`
//! per step. Between bodies that only springs connect, each error is a change of their distance
//! without a change of momentum: the energy of a system far from the origin then grows as a random
//! walk of `ε|q| |∇V|` per step.
//!
//! A joint angle is a function of `q` up to whole revolutions. The interval carries the unwrapped
//! angles at `q_n`; of all values of an angle the one next to these is meant, which is unique while
//! a step turns a joint by less than `π`.

use crate::configuration::{Configuration, Motion};
use crate::lanes::Lanes;
use serde::{Deserialize, Serialize};

/// One time step `t_n → t_n + h` with its two end configurations.
///
/// ```
/// use vi_core::Interval;
/// let s = Interval::between(0.0, 0.5, &[1.0], &[2.0]);
/// assert_eq!((s.dq[0], s.q_mid[0], s.v_mid[0], s.t_end()), (1.0, 1.5, 2.0, 0.5));
/// ```
///
/// Invariant of [`Interval::close`] and [`Interval::close_from_end`]:
/// `q1 = q0 + dq` to round-off of `q`, `q_mid = q0 + dq/2`, `v_mid = dq/h`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Time at the start of the step, s.
    pub t: f64,
    /// Time step, s; negative when stepping backwards in time.
    pub h: f64,
    /// `q_n`, shape `n`.
    pub q0: Vec<f64>,
    /// `q_{n+1}`, shape `n`.
    pub q1: Vec<f64>,
    /// `Δq = q_{n+1} − q_n`, shape `n`, accurate relative to itself.
    pub dq: Vec<f64>,
    /// `q_{n+1/2} = q_n + Δq/2`, shape `n`; leaves the constraint manifold by intent.
    pub q_mid: Vec<f64>,
    /// `Δq/h`, shape `n`: the velocity of the midpoint rule.
    pub v_mid: Vec<f64>,
    /// Unwrapped joint angles at `q_n`, rad; see [`Configuration::angles`].
    pub angles: Vec<f64>,
    /// Internal variables at `q_n` ([`crate::State::internal`]); those that are not listed are
    /// zero.
    pub internal: Vec<f64>,
    #[serde(skip)]
    derived: Derived, // from q_n
    #[serde(skip)]
    derived_end: Derived, // from q_{n+1}
    pub(crate) compensation: Vec<f64>, // n  rounding error of q0
    t_rounding: f64,                   // s  rounding error of t + h
}

/// An argument of a function `f(q_n, q_{n+1})`; of discrete forces also which of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// `q_n`, and `f_d^-`.
    First,
    /// `q_{n+1}`, and `f_d^+`.
    Second,
}

impl Slot {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::First, Self::Second];

    /// `∂Δq/∂q` of the slot: −1 or 1.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::First => -1.0,
            Self::Second => 1.0,
        }
    }
}

/// How a step changes in length and time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepChange {
    /// `δh`.
    pub length: f64,
    /// `δt_{n+1/2}`.
    pub middle: f64,
}

/// What a potential has derived from one end of the step alone. It follows from the other data:
/// copies are without it, and it makes no difference between intervals.
#[derive(Debug, Default)]
struct Derived {
    values: Vec<f64>,
    is_current: bool, // of this configuration
}

impl Derived {
    fn take(&mut self, q: &[f64], count: usize, derive: impl FnOnce(&[f64], &mut [f64])) {
        self.values.resize(count, 0.0);
        derive(q, &mut self.values);
        self.is_current = true;
    }

    fn current(&self) -> &[f64] {
        if self.is_current { &self.values } else { &[] }
    }
}

impl Clone for Derived {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Derived {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// What a step reads and writes of an interval, each of shape `n`.
#[derive(Debug)]
pub struct IntervalParts<'a> {
    /// `q_n`.
    pub q0: &'a [f64],
    /// Rounding error of `q_n`.
    pub compensation: &'a [f64],
    /// `q_{n+1}`.
    pub q1: &'a mut [f64],
    /// `Δq`.
    pub dq: &'a mut [f64],
    /// `q_{n+1/2}`.
    pub q_mid: &'a mut [f64],
    /// `Δq/h`.
    pub v_mid: &'a mut [f64],
}

impl Interval {
    /// An interval of `n` coordinates, all zero.
    #[must_use]
    pub fn new(n: usize) -> Self {
        let zero = || vec![0.0; n];
        Self {
            t: 0.0,
            h: 0.0,
            q0: zero(),
            q1: zero(),
            dq: zero(),
            q_mid: zero(),
            v_mid: zero(),
            angles: Vec::new(),
            internal: Vec::new(),
            derived: Derived::default(),
            derived_end: Derived::default(),
            compensation: zero(),
            t_rounding: 0.0,
        }
    }

    /// The interval between two given configurations, `Δq` by subtraction; `t`, `h` in s.
    ///
    /// # Panics
    /// When `q0` and `q1` have different lengths.
    #[must_use]
    pub fn between(t: f64, h: f64, q0: &[f64], q1: &[f64]) -> Self {
        let mut s = Self::new(q0.len());
        s.open(t, h, q0);
        s.q1.copy_from_slice(q1);
        s.close_from_end();
        s
    }

    /// Opens a step of length `h` (s) at `(t, q_n)` without compensation, with principal angles and
    /// internal variables of zero; the end is first put on the start.
    pub fn open(&mut self, t: f64, h: f64, q_n: &[f64]) {
        (self.t, self.h, self.t_rounding) = (t, h, 0.0);
        self.q0.copy_from_slice(q_n);
        self.q1.copy_from_slice(q_n);
        self.q_mid.copy_from_slice(q_n);
        self.dq.fill(0.0);
        self.v_mid.fill(0.0);
        self.angles.clear();
        self.internal.clear();
        self.forget_derived();
        self.compensation.fill(0.0);
    }

    /// As [`Interval::open`], for who writes the end, the increment and the midpoint before they
    /// are read, with the rounding error of `q_n`.
    pub fn open_start(&mut self, t: f64, h: f64, q_n: &[f64], rounding: &[f64]) {
        (self.t, self.h, self.t_rounding) = (t, h, 0.0);
        self.q0.copy_from_slice(q_n);
        self.compensation.copy_from_slice(rounding);
        self.angles.clear();
        self.internal.clear();
        self.forget_derived();
    }

    /// Opens the interval of length `h` that starts where another one does.
    pub fn open_within(&mut self, step: &Self, h: f64) {
        self.open_start(step.t, h, &step.q0, &step.compensation);
        self.angles.extend_from_slice(&step.angles);
        self.internal.extend_from_slice(&step.internal);
    }

    /// Derives so many values from `q_n` alone, which last until the interval is opened again.
    pub fn derive(&mut self, count: usize, derive: impl FnOnce(&[f64], &mut [f64])) {
        self.derived.take(&self.q0, count, derive);
    }

    /// Derives so many values from `q_{n+1}` alone, which last until the end is written again.
    pub fn derive_end(&mut self, count: usize, derive: impl FnOnce(&[f64], &mut [f64])) {
        self.derived_end.take(&self.q1, count, derive);
    }

    /// What a potential has derived from `q_n` alone
    /// ([`crate::potential::DiscretePotential::derive`]); empty where nothing was.
    #[must_use]
    pub fn derived(&self) -> &[f64] {
        self.derived.current()
    }

    /// What a potential has derived from `q_{n+1}` alone
    /// ([`crate::potential::DiscretePotential::derive_end`]); empty where nothing was.
    #[must_use]
    pub fn derived_end(&self) -> &[f64] {
        self.derived_end.current()
    }

    /// Both ends are others.
    fn forget_derived(&mut self) {
        (self.derived.is_current, self.derived_end.is_current) = (false, false);
    }

    /// `q_n` and its compensation, to be read; `q_{n+1}`, `Δq`, `q_{n+1/2}` and `Δq/h`, to be
    /// written.
    pub fn parts_mut(&mut self) -> IntervalParts<'_> {
        self.derived_end.is_current = false;
        let Self { q0, compensation, q1, dq, q_mid, v_mid, .. } = self;
        IntervalParts { q0, compensation, q1, dq, q_mid, v_mid }
    }

    /// `out ←` the rounding error of `q_{n+1}`, shape `n`: less than a last bit; zero for
    /// coordinates that are not at `q_next` as the step computed it.
    pub fn rounding_error(&self, q_next: &[f64], out: &mut [f64]) {
        let n = out.len();
        let (q_next, from, to) = (&q_next[..n], &self.q0[..n], &self.q1[..n]);
        let (dq, compensation) = (&self.dq[..n], &self.compensation[..n]);
        for i in 0..n {
            out[i] = rounding_error([from[i], to[i]], dq[i] + compensation[i], q_next[i]);
        }
    }

    /// Becomes a copy of another interval of the same shape; allocates nothing.
    pub fn copy_from(&mut self, other: &Self) {
        (self.t, self.h, self.t_rounding) = (other.t, other.h, other.t_rounding);
        self.q0.copy_from_slice(&other.q0);
        self.q1.copy_from_slice(&other.q1);
        self.dq.copy_from_slice(&other.dq);
        self.q_mid.copy_from_slice(&other.q_mid);
        self.v_mid.copy_from_slice(&other.v_mid);
        self.angles.clone_from(&other.angles);
        self.internal.clone_from(&other.internal);
        self.forget_derived();
        self.compensation.copy_from_slice(&other.compensation);
    }

    /// Becomes a step of length `h` whose ends have come together, as at a Gauss node: both ends
    /// and the middle are the configuration `at`, the velocity is `v`.
    pub fn gather_at(&mut self, at: Configuration<'_>, v: &[f64], h: f64) {
        let Configuration { t, q: place, angles, internal } = at;
        (self.t, self.h, self.t_rounding) = (t - 0.5 * h, h, 0.0);
        for q in [&mut self.q0, &mut self.q1, &mut self.q_mid] {
            q.copy_from_slice(place);
        }
        self.v_mid.copy_from_slice(v);
        self.dq.iter_mut().zip(v).for_each(|(dq, v)| *dq = h * v);
        self.angles.clear();
        self.angles.extend_from_slice(angles);
        self.internal.clear();
        self.internal.extend_from_slice(internal);
        self.forget_derived();
        self.compensation.fill(0.0);
    }

    /// Becomes what a step of more coordinates is for those from `first` on; allocates nothing but
    /// once.
    pub fn take_part(&mut self, whole: &Self, first: usize) {
        (self.t, self.h, self.t_rounding) = (whole.t, whole.h, whole.t_rounding);
        let own = first..first + self.q0.len();
        self.q0.copy_from_slice(&whole.q0[own.clone()]);
        self.q1.copy_from_slice(&whole.q1[own.clone()]);
        self.dq.copy_from_slice(&whole.dq[own.clone()]);
        self.q_mid.copy_from_slice(&whole.q_mid[own.clone()]);
        self.v_mid.copy_from_slice(&whole.v_mid[own.clone()]);
        self.compensation.copy_from_slice(&whole.compensation[own]);
        self.angles.clone_from(&whole.angles);
        self.internal.clone_from(&whole.internal);
        self.forget_derived();
    }

    /// Writes its end into a step of more coordinates, from `first` on.
    pub fn write_part(&self, first: usize, whole: &mut Self) {
        let own = first..first + self.q0.len();
        whole.q1[own.clone()].copy_from_slice(&self.q1);
        whole.dq[own.clone()].copy_from_slice(&self.dq);
        whole.q_mid[own.clone()].copy_from_slice(&self.q_mid);
        whole.v_mid[own].copy_from_slice(&self.v_mid);
        whole.derived_end.is_current = false;
    }

    /// The step ends at `t_end` (s), which is `t + h` up to rounding: over many steps `t_0 + n h`,
    /// not the sum of rounded steps. [`Interval::open`] sets `t + h`.
    pub fn end_at(&mut self, t_end: f64) {
        self.t_rounding = t_end - (self.t + self.h);
    }

    /// Completes the interval after `q1` and `dq` have been written.
    pub fn close(&mut self) {
        self.derived_end.is_current = false;
        let h = self.h;
        for ((mid, q0), dq) in self.q_mid.iter_mut().zip(&self.q0).zip(&self.dq) {
            *mid = q0 + 0.5 * dq;
        }
        for (v, dq) in self.v_mid.iter_mut().zip(&self.dq) {
            *v = dq / h;
        }
    }

    /// Completes the interval after only `q1` has been written (`Δq` by subtraction).
    pub fn close_from_end(&mut self) {
        for ((dq, q0), q1) in self.dq.iter_mut().zip(&self.q0).zip(&self.q1) {
            *dq = q1 - q0;
        }
        self.close();
    }

    /// Writes one increment and its end, `q1 = q0 + Δq` with the compensation.
    pub fn increment(&mut self, i: usize, dq: f64) {
        self.dq[i] = dq;
        self.q1[i] = self.q0[i] + (dq + self.compensation[i]);
    }

    /// Completes the interval after only `dq` has been written (`q1 = q0 + Δq` with the
    /// compensation).
    pub fn close_from_increment(&mut self) {
        (0..self.dq.len()).for_each(|i| self.increment(i, self.dq[i]));
        self.close();
    }

    /// Becomes a step backwards in time, from the end of another one of the same shape to its
    /// start; allocates nothing.
    pub fn reverse(&mut self, other: &Self) {
        (self.t, self.h, self.t_rounding) = (other.t_end(), -other.h, 0.0);
        self.q0.copy_from_slice(&other.q1);
        self.q1.copy_from_slice(&other.q0);
        self.dq.iter_mut().zip(&other.dq).for_each(|(own, dq)| *own = -dq);
        self.q_mid.copy_from_slice(&other.q_mid);
        self.v_mid.copy_from_slice(&other.v_mid);
        self.angles.clone_from(&other.angles);
        self.internal.clone_from(&other.internal);
        self.forget_derived();
        self.compensation.fill(0.0);
    }

    /// The interval with its ends exchanged, `(q_{n+1}, q_n)`, at the same time and step.
    #[must_use]
    pub fn exchanged(&self) -> Self {
        let mut other = self.clone();
        std::mem::swap(&mut other.q0, &mut other.q1);
        other.dq.iter_mut().chain(&mut other.v_mid).for_each(|x| *x = -*x);
        other
    }

    /// `(t_n, q_n)`.
    #[must_use]
    pub fn start(&self) -> Configuration<'_> {
        Configuration { t: self.t, q: &self.q0, angles: &self.angles, internal: &self.internal }
    }

    /// `(t_{n+1/2}, q_{n+1/2})`.
    #[must_use]
    pub fn mid(&self) -> Configuration<'_> {
        Configuration {
            t: self.t_mid(),
            q: &self.q_mid,
            angles: &self.angles,
            internal: &self.internal,
        }
    }

    /// `(t_{n+1/2}, q_{n+1/2}, Δq/h)`.
    #[must_use]
    pub fn mid_motion(&self) -> Motion<'_> {
        self.mid().moving(&self.v_mid)
    }

    /// `(t_{n+1}, q_{n+1})`.
    #[must_use]
    pub fn end(&self) -> Configuration<'_> {
        Configuration {
            t: self.t_end(),
            q: &self.q1,
            angles: &self.angles,
            internal: &self.internal,
        }
    }

    /// `q_n` or `q_{n+1}`.
    #[must_use]
    pub fn node(&self, slot: Slot) -> &[f64] {
        match slot {
            Slot::First => &self.q0,
            Slot::Second => &self.q1,
        }
    }

    /// Number of coordinates.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.q0.len()
    }

    /// `t_{n+1/2}`, s.
    #[must_use]
    pub fn t_mid(&self) -> f64 {
        self.t + 0.5 * self.h
    }

    /// `t_{n+1}`, s.
    #[must_use]
    pub fn t_end(&self) -> f64 {
        (self.t + self.h) + self.t_rounding
    }
}

/// The rounding error of a coordinate after a step `from → to` by `change`, the increment with the
/// compensation; zero where it is more than the last bits, or the coordinate is not at `to` any
/// more.
#[must_use]
#[inline(always)]
pub fn rounding_error<L: Lanes>([from, to]: [L; 2], change: L, next: L) -> L {
    let zero = from.like(0.0);
    let error = (from - to) + change;
    let last_bits = from.abs().larger(to.abs()) * (2.0 * f64::EPSILON);
    let error = error.abs().if_at_most(last_bits, error, zero);
    (to - next).abs().if_at_most(zero, error, zero) // unchanged or not
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_rounding_is_compensated() {
        let (mut s, mut error) = (Interval::new(3), [f64::NAN; 3]);
        s.open(0.0, 0.1, &[1.0; 3]);
        (0..3).for_each(|i| s.increment(i, 1e-20));
        s.q1[1] += 1e-9; // more than rounding
        let next = [s.q1[0], s.q1[1], s.q1[2] + 1e-15]; // changed after the step
        s.rounding_error(&next, &mut error);
        assert_eq!(error, [1e-20, 0.0, 0.0]);
    }

    #[test]
    fn what_was_derived_from_a_start_ends_with_it() {
        let mut s = Interval::new(1);
        let mut other = Interval::new(1);
        let derive = |s: &mut Interval| {
            s.derive(2, |q, out| out.fill(q[0] + 1.0));
            assert_eq!(s.derived(), [s.q0[0] + 1.0; 2]);
        };
        derive(&mut s);
        assert!(s.exchanged().derived().is_empty() && s.clone() == s);
        derive(&mut other);
        other.copy_from(&s);
        assert!(other.derived().is_empty());
        s.open(0.0, 0.1, &[1.0]);
        assert!(s.derived().is_empty());
        derive(&mut s);
        s.open_start(0.0, 0.1, &[1.0], &[0.0]);
        assert!(s.derived().is_empty());
        derive(&mut s);
        s.take_part(&Interval::new(2), 1);
        assert!(s.derived().is_empty());
    }

    #[test]
    fn what_was_derived_from_an_end_lasts_until_it_is_written_again() {
        let mut s = Interval::new(1);
        let derive = |s: &mut Interval| {
            s.derive_end(2, |q, out| out.fill(q[0] + 1.0));
            assert_eq!(s.derived_end(), [s.q1[0] + 1.0; 2]);
        };
        let writes: [fn(&mut Interval); 6] = [
            |s| s.open(0.0, 0.1, &[1.0]),
            |s| {
                s.q1[0] = 2.0;
                s.close_from_end();
            },
            |s| {
                s.dq[0] = 3.0;
                s.close_from_increment();
            },
            |s| s.parts_mut().q1[0] = 4.0,
            |s| Interval::between(0.0, 0.1, &[1.0], &[5.0]).write_part(0, s),
            |s| s.copy_from(&Interval::between(0.0, 0.1, &[1.0], &[6.0])),
        ];
        for write in writes {
            derive(&mut s);
            assert!(s.exchanged().derived_end().is_empty() && s.clone() == s);
            write(&mut s);
            assert!(s.derived_end().is_empty());
        }
    }

    #[test]
    fn the_increment_keeps_its_own_precision() {
        let mut s = Interval::new(1);
        s.open(0.0, 0.1, &[1e6]);
        s.dq[0] = 1.2345678901234567e-9;
        s.close_from_increment();
        assert_eq!(s.dq[0].to_bits(), 1.2345678901234567e-9_f64.to_bits());
        s.close_from_end();
        let lost = (s.dq[0] - 1.2345678901234567e-9).abs();
        assert!(lost > 1e-12, "subtraction of stored coordinates must lose digits here: {lost:e}");
    }
}
