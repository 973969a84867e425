//! Efforts from outside: what a controller or a policy decides between two steps.
//!
//! ```text
//! τ(t) = τ_n,   t_n < t ≤ t_{n+1}
//! ```

use super::joint_force::{EffortSlopes, JointLaw};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A force or torque on a joint coordinate that is set from outside and held until it is set anew,
/// N or N·m; zero at first. Clones are handles of one effort.
///
/// It is no part of the state: who resumes a stored state sets it again.
///
/// ```
/// use vi_multibody::builder::{Inertia, MechanismBuilder};
/// use vi_multibody::ensemble::Ensemble;
/// use vi_multibody::held_effort::HeldEffort;
/// use vi_multibody::vi_constraints::{Options, SchemeKind};
/// use vi_multibody::{FrameId, PairKind};
///
/// let motors: Vec<HeldEffort> = (0..8).map(|_| HeldEffort::default()).collect();
/// let wheel = |motor: &HeldEffort| {
///     let mut builder = MechanismBuilder::new();
///     let wheel = builder.body("wheel", Inertia::principal(1.0, [0.1, 0.1, 0.2])).id();
///     let axle = builder.joint("axle", PairKind::Revolute, FrameId::Ground, wheel);
///     let angle = axle.at([0.0; 3]).axis([0.0, 0.0, 1.0]).id().coordinate(0);
///     builder.joint_force(angle, motor.clone());
///     builder.build()
/// };
/// let members: Result<Vec<_>, _> = motors.iter().map(wheel).collect();
/// let mut ensemble = Ensemble::new(members?, Options::new(SchemeKind::Nodal, 0.01))?;
/// for step in 0..100 {
///     for (k, motor) in motors.iter().enumerate() {
///         motor.set(0.02 * k as f64 * if step < 50 { 1.0 } else { -1.0 });
///     }
///     ensemble.advance(1);
/// }
/// assert_eq!(ensemble.member(7).state().step, 100);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct HeldEffort(Arc<AtomicU64>); // the bits: zero is zero

impl HeldEffort {
    /// From now on `effort`, N or N·m.
    pub fn set(&self, effort: f64) {
        self.0.store(effort.to_bits(), Ordering::Relaxed);
    }

    /// The effort, N or N·m.
    #[must_use]
    pub fn get(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }
}

impl JointLaw for HeldEffort {
    fn effort(&self, _t: f64, _coordinate: f64, _rate: f64) -> f64 {
        self.get()
    }
    fn slopes(&self, _t: f64, _coordinate: f64, _rate: f64) -> EffortSlopes {
        EffortSlopes { by_coordinate: 0.0, by_rate: 0.0 }
    }
    fn by_time(&self, _t: f64, _coordinate: f64, _rate: f64) -> Option<f64> {
        Some(0.0)
    }
    fn is_dissipative(&self) -> bool {
        false
    }
    fn is_given(&self) -> bool {
        true
    }
    fn is_affine(&self) -> bool {
        true
    }
}
