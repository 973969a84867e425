//! Compensated stepping: what rounding takes off a step is given to the next one.
//!
//! No increment in its format satisfies a step equation exactly, and in a steady rotation the
//! remainders have the same sign at some step sizes. Handed to the next step they do not add up
//! (compensated summation, Kahan, Comm. ACM 8 (1965) 40). What each of the three gains is measured
//! in `docs/decisions.md`.

use serde::{Deserialize, Serialize};

/// Rounding errors of a step (compensated stepping).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Compensation {
    /// Of `q_n`, shape `n`.
    pub q: Vec<f64>,
    /// Of `v_n`, where that is a variable; else empty.
    pub v: Vec<f64>,
    /// Residual of the last momentum balance, shape `d`; empty where it is not carried.
    pub balance: Vec<f64>,
}

impl Compensation {
    /// Copies the residual of the last momentum balance, zero at the start; `out`: shape `d`.
    pub fn open_balance(&mut self, out: &mut [f64]) {
        self.balance.resize(out.len(), 0.0);
        out.copy_from_slice(&self.balance);
    }

    /// Becomes a copy; allocates only when that is larger.
    pub fn copy_from(&mut self, other: &Self) {
        self.q.clone_from(&other.q);
        self.v.clone_from(&other.v);
        self.balance.clone_from(&other.balance);
    }
}
