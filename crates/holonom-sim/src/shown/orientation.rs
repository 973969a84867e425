//! Numbers of orientations, with their derivatives.
//!
//! ```text
//! y = ±(w, x, y, z)_k of R(q)        ∇y, D²y: with dual numbers as directors
//! ```
//! The sign is continued along the motion: nodes are taken note of, one after the other.

use crate::sensor::{Attitude, sign};
use nalgebra::Quaternion;
use std::sync::{Arc, Mutex, PoisonError};
use vi_control::objective::{Quantity, Seen};
use vi_core::num_dual::{Dual64, HyperDual64};
use vi_core::{Configuration, Number};
use vi_rigid::directors::FRAME;

/// A number of a quaternion that is continued along a motion.
#[derive(Clone, Debug)]
pub(crate) struct Turned {
    attitude: Attitude,
    part: usize, // of w, x, y, z
    followed: Arc<Mutex<Followed>>,
}

/// The signs that a quaternion has along a motion.
#[derive(Debug, Default)]
struct Followed {
    last: Quaternion<f64>,
    changes: Vec<(f64, f64)>, // from which time on, s, and which sign
}

impl Followed {
    /// That at a node, of the time `t`; where none was followed, of `w ≥ 0`.
    fn at(&self, t: f64, own: &Quaternion<f64>) -> f64 {
        let known = self.changes.iter().rev().find(|(from, _)| *from <= t);
        known.map_or_else(|| sign(own, &Quaternion::identity()), |(_, sign)| *sign)
    }
}

impl Turned {
    /// Number `part` of `w, x, y, z`.
    pub(crate) fn new(attitude: Attitude, part: usize) -> Self {
        Self { attitude, part, followed: Arc::default() }
    }

    /// The number at coordinates that have tangents.
    fn number<T: Number>(&self, at: Configuration<'_>, q: &impl Fn(usize) -> T) -> T {
        let of_reals = self.attitude.quaternion(&|i| at.q[i]);
        let followed = self.followed.lock().unwrap_or_else(PoisonError::into_inner);
        let own = self.attitude.quaternion(q);
        let part = [own.w, own.i, own.j, own.k][self.part];
        part * T::of(followed.at(at.t, &of_reals))
    }
}

impl Quantity for Turned {
    fn value(&self, at: Configuration<'_>) -> f64 {
        self.number(at, &|i| at.q[i])
    }
    fn add_slope(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        for first in self.attitude.frames() {
            for k in first + 3..first + FRAME {
                let along = |i: usize| Dual64::new(at.q[i], f64::from(u8::from(i == k)));
                out[k] += scale * self.number(at, &along).eps;
            }
        }
    }
    fn second(&self, at: Configuration<'_>, v: &[f64], w: &[f64]) -> f64 {
        self.number(at, &|i| HyperDual64::new(at.q[i], v[i], w[i], 0.0)).eps1eps2
    }
    fn follow(&self, node: Configuration<'_>, seen: Seen) {
        let own = self.attitude.quaternion(&|i| node.q[i]);
        let Followed { last, changes } =
            &mut *self.followed.lock().unwrap_or_else(PoisonError::into_inner);
        if seen == Seen::First {
            (*last, *changes) = (Quaternion::identity(), Vec::new());
        }
        let sign = sign(&own, last);
        *last = own * sign;
        if changes.last().is_none_or(|(_, before)| before * sign < 0.0) {
            changes.push((node.t, sign));
        }
    }
}
