//! Numbers of orientations, with their derivatives.
//!
//! ```text
//! y = ±(w, x, y, z)_k of R(q)        ∇y, D²y, D³y: with dual numbers as directors
//! ```
//! The sign is continued along the motion: nodes are taken note of, one after the other.

use crate::sensor::{Attitude, sign};
use nalgebra::Quaternion;
use std::sync::{Arc, Mutex, PoisonError};
use vi_control::objective::{NotedNode, Quantity};
use vi_core::num_dual::{Dual64, HyperDual64, HyperHyperDual64};
use vi_core::{Configuration, Motion, Number};
use vi_rigid::directors::FRAME;

/// A number of a quaternion that is continued along a motion.
#[derive(Clone, Debug)]
pub(crate) struct Turned {
    attitude: Attitude,
    part: usize, // of w, x, y, z
    followed: Arc<Mutex<FollowedSigns>>,
}

/// The signs that a quaternion has along a motion.
#[derive(Debug, Default)]
struct FollowedSigns {
    last: Quaternion<f64>,
    changes: Vec<(f64, f64)>, // from which time on, s, and which sign
}

impl FollowedSigns {
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

    /// Visits the coordinates that it depends on, each with what tells it from others, by 1.
    fn for_each(&self, mut visit: impl FnMut(usize, &dyn Fn(usize) -> f64)) {
        for k in self.attitude.frames().flat_map(|first| first + 3..first + FRAME) {
            visit(k, &|i| f64::from(u8::from(i == k)));
        }
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
        self.for_each(|k, is_own| {
            out[k] += scale * self.number(at, &|i| Dual64::new(at.q[i], is_own(i))).eps;
        });
    }
    fn add_bend(&self, at: Motion<'_>, scale: f64, out: &mut [f64]) {
        self.for_each(|k, is_own| {
            let along = |i: usize| HyperDual64::new(at.q[i], at.v[i], is_own(i), 0.0);
            out[k] += scale * self.number(at.configuration(), &along).eps1eps2;
        });
    }
    fn add_third(&self, at: Configuration<'_>, [v, w]: [&[f64]; 2], scale: f64, out: &mut [f64]) {
        self.for_each(|k, is_own| {
            let along = |i: usize| {
                HyperHyperDual64::new(at.q[i], v[i], w[i], is_own(i), 0.0, 0.0, 0.0, 0.0)
            };
            out[k] += scale * self.number(at, &along).eps1eps2eps3;
        });
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        let own = self.attitude.quaternion(&|i| node.q[i]);
        let FollowedSigns { last, changes } =
            &mut *self.followed.lock().unwrap_or_else(PoisonError::into_inner);
        if seen == NotedNode::First {
            (*last, *changes) = (Quaternion::identity(), Vec::new());
        }
        let sign = sign(&own, last);
        *last = own * sign;
        if changes.last().is_none_or(|(_, before)| before * sign < 0.0) {
            changes.push((node.t, sign));
        }
    }
}
