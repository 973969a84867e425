//! The two-point argument `(q_n, q_{n+1})` of every discrete function.
//!
//! A discrete Lagrangian, force or potential is a function of two neighbouring configurations. It
//! receives them as one [`Interval`], which also carries the increment `Δq` and the midpoint:
//! whoever moves the end of the interval knows `Δq` to its own relative precision (a rotation
//! increment, a Newton unknown), while the difference of two stored coordinates is only good to
//! `ε|q|`, which divided by `h` would spoil the momenta.
//!
//! What rounding takes off `q_{n+1} = q_n + Δq` is kept for the next step (compensated summation, Kahan,
//! Comm. ACM 8 (1965) 40). Where `Δq` is found from `g(q_{n+1}) = 0`, these losses point along the
//! normals more often one way than the other, and without their sum the angular momentum drifts by a
//! few hundredths of `ε` a step. Where parts that are only held by springs move on their own, every loss is
//! a jump of their distance that no momentum answers: the energy of a system that flies away walks by
//! `ε|q| |∇V|` a step.

/// One time step `t_n → t_n + h` with its two end configurations.
///
/// Invariant, kept by [`Interval::close`] and [`Interval::close_from_end`]:
/// `q1 = q0 + dq` to round-off of `q`, `q_mid = q0 + dq/2`, `v_mid = dq/h`.
#[derive(Clone, Debug, PartialEq)]
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
    carry: Vec<f64>, // n  what rounding has taken off q0
    t_carry: f64,    // s  what rounding has taken off t + h
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
            carry: zero(),
            t_carry: 0.0,
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

    /// Opens a step of length `h` at `(t, q_n)`; the end is first put on the start.
    pub fn open(&mut self, t: f64, h: f64, q_n: &[f64]) {
        if self.q1 == q_n || self.q0 != q_n {
            q_n.iter().enumerate().for_each(|(i, q)| self.carry[i] = self.lost(i, *q));
        } // else the same step once more
        (self.t, self.h, self.t_carry) = (t, h, 0.0);
        self.q0.copy_from_slice(q_n);
        self.q1.copy_from_slice(q_n);
        self.q_mid.copy_from_slice(q_n);
        self.dq.fill(0.0);
        self.v_mid.fill(0.0);
    }

    /// What rounding has taken off a coordinate that is at `q` now, if the last step ended there: less than
    /// a last bit. What is more was no rounding.
    fn lost(&self, i: usize, q: f64) -> f64 {
        let (from, to) = (self.q0[i], self.q1[i]);
        let lost = (from - to) + (self.dq[i] + self.carry[i]);
        let last_bits = 2.0 * f64::EPSILON * from.abs().max(to.abs());
        if to.to_bits() == q.to_bits() && lost.abs() <= last_bits { lost } else { 0.0 }
    }

    /// Becomes a copy of another interval of the same shape; allocates nothing.
    pub fn copy_from(&mut self, other: &Self) {
        (self.t, self.h, self.t_carry) = (other.t, other.h, other.t_carry);
        self.q0.copy_from_slice(&other.q0);
        self.q1.copy_from_slice(&other.q1);
        self.dq.copy_from_slice(&other.dq);
        self.q_mid.copy_from_slice(&other.q_mid);
        self.v_mid.copy_from_slice(&other.v_mid);
        self.carry.copy_from_slice(&other.carry);
    }

    /// The step ends at `t_end` (s), which is `t + h` up to rounding: over many steps `t_0 + n h`, not
    /// the sum of rounded steps. [`Interval::open`] sets `t + h`.
    pub fn end_at(&mut self, t_end: f64) {
        self.t_carry = t_end - (self.t + self.h);
    }

    /// Completes the interval after `q1` and `dq` have been written.
    pub fn close(&mut self) {
        for (i, dq) in self.dq.iter().enumerate() {
            self.q_mid[i] = self.q0[i] + 0.5 * dq;
            self.v_mid[i] = dq / self.h;
        }
    }

    /// Completes the interval after only `q1` has been written (`Δq` by subtraction).
    pub fn close_from_end(&mut self) {
        for ((dq, q0), q1) in self.dq.iter_mut().zip(&self.q0).zip(&self.q1) {
            *dq = q1 - q0;
        }
        self.close();
    }

    /// Writes one increment and its end, `q1 = q0 + Δq` and what rounding took off the last one.
    pub fn increment(&mut self, i: usize, dq: f64) {
        self.dq[i] = dq;
        self.q1[i] = self.q0[i] + (dq + self.carry[i]);
    }

    /// Completes the interval after only `dq` has been written (`q1 = q0 + Δq`, and what rounding took
    /// off the last one).
    pub fn close_from_increment(&mut self) {
        (0..self.dq.len()).for_each(|i| self.increment(i, self.dq[i]));
        self.close();
    }

    /// The interval with its ends exchanged, `(q_{n+1}, q_n)`, at the same time and step.
    #[must_use]
    pub fn exchanged(&self) -> Self {
        let mut other = self.clone();
        std::mem::swap(&mut other.q0, &mut other.q1);
        other.dq.iter_mut().chain(&mut other.v_mid).for_each(|x| *x = -*x);
        other
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
        (self.t + self.h) + self.t_carry
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increments_add_up_to_the_last_digit() {
        let (mut s, mut q) = (Interval::new(1), 0.7);
        for _ in 0..100_000 {
            s.open(0.0, 0.1, &[q]);
            s.dq[0] = 1e-7 / 3.0;
            s.close_from_increment();
            q = s.q1[0];
        }
        let off = (q - (0.7 + 1e-2 / 3.0)).abs();
        println!("after 100000 increments off by {off:.1e}");
        assert!(off <= f64::EPSILON, "{off:e}");
        s.open(0.0, 0.1, &[5.0]);
        s.close_from_increment();
        assert_eq!(s.q1, [5.0], "another motion starts without a carry");
    }

    #[test]
    fn what_is_more_than_rounding_is_not_carried() {
        let mut s = Interval::new(2);
        s.open(0.0, 0.1, &[1.0, 1.0]);
        s.increment(0, 1e-20);
        s.increment(1, 1e-20);
        s.q1[1] += 1e-9; // moved from outside
        let q = s.q1.clone();
        s.open(0.0, 0.1, &q);
        assert_eq!(s.carry, [1e-20, 0.0]);
        s.q0[0] = 7.0; // no interval any more
        s.open(0.0, 0.1, &q);
        assert_eq!(s.carry, [0.0, 0.0]);
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
