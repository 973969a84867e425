//! Controls: efforts and wrenches that are chosen for each step and held over it.
//!
//! ```text
//! f_w^∓ = (h/2) ∇θ(q_n | q_{n+1})          of an effort along a joint coordinate: its own node
//! f_w^∓ = (h/2) (f, ϱ_I f + ½ τ×d_I)       of a wrench: the load of the value 1 [4.6]
//! dJ/dw_n = ∂ℓ/∂w_n + (f_w^+)ᵀ b' − (f_w^-)ᵀ μ                                          [2.39]
//! ```
//! A value acts over `hold` macro steps; in compositions over all their sub-steps.

use crate::sampling::Sampling;
use vi_core::Configuration;
use vi_core::force::Force as _;
use vi_core::interval::{Interval, Slot};
use vi_core::linear::dot;
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::particle_load::ParticleLoad;
use vi_rigid::load::Load;

/// A force in which a number enters linearly that is chosen for each step.
pub trait ControlForce: Send + Sync {
    /// From now on this value acts.
    fn set(&self, value: f64);
    /// `f_wᵀ x` of an end of a step: its discrete force of the value 1, along `x`, shape `n`.
    fn along(&self, s: &Interval, of: Slot, x: &[f64]) -> f64;
    /// `out ← out + scale f_w` of an end.
    fn add(&self, s: &Interval, of: Slot, scale: f64, out: &mut [f64]);
}

/// An effort along a joint coordinate, N or N·m.
#[derive(Clone, Debug)]
pub struct JointControl {
    /// What acts in the system.
    pub effort: HeldEffort,
    /// The coordinate.
    pub coordinate: JointCoordinate,
}

impl ControlForce for JointControl {
    fn set(&self, value: f64) {
        self.effort.set(value);
    }
    fn along(&self, s: &Interval, of: Slot, x: &[f64]) -> f64 {
        0.5 * s.h * self.coordinate.rate(s.node(of), x)
    }
    fn add(&self, s: &Interval, of: Slot, scale: f64, out: &mut [f64]) {
        self.coordinate.add_gradient(s.node(of), 0.5 * s.h * scale, out);
    }
}

/// A wrench on a body, times a number.
#[derive(Clone, Debug)]
pub struct WrenchControl {
    /// The number.
    pub value: HeldEffort,
    /// The load of the number 1.
    pub load: Load,
}

impl ControlForce for WrenchControl {
    fn set(&self, value: f64) {
        self.value.set(value);
    }
    fn along(&self, s: &Interval, of: Slot, x: &[f64]) -> f64 {
        dot(&self.load.half_impulse(s, s.node(of)), self.load.of_frame(x))
    }
    fn add(&self, s: &Interval, of: Slot, scale: f64, out: &mut [f64]) {
        let own = self.load.half_impulse(s, s.node(of));
        out[self.load.offset()..].iter_mut().zip(own).for_each(|(o, f)| *o += scale * f);
    }
}

/// A force on a point mass, times a number.
#[derive(Clone, Debug)]
pub struct ParticleControl {
    /// The number.
    pub value: HeldEffort,
    /// The force of the number 1.
    pub force: ParticleLoad,
}

impl ControlForce for ParticleControl {
    fn set(&self, value: f64) {
        self.value.set(value);
    }
    fn along(&self, s: &Interval, _of: Slot, x: &[f64]) -> f64 {
        let ParticleLoad { offset, dimension, force, history } = &self.force;
        let own = &x[*offset..][..*dimension];
        let scale = 0.5 * s.h * history.value(s.t_mid());
        scale * own.iter().zip(force).map(|(x, f)| x * f).sum::<f64>()
    }
    fn add(&self, s: &Interval, _of: Slot, scale: f64, out: &mut [f64]) {
        self.force.add(s.mid_motion(), 0.5 * s.h * scale, out);
    }
}

/// Controls with their values over a run, and what is sampled in it.
#[derive(Default)]
pub struct Controls {
    forces: Vec<Box<dyn ControlForce>>,
    values: Vec<Vec<f64>>,
    hold: usize,
    sampling: Option<Sampling>,
}

impl std::fmt::Debug for Controls {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { forces, values, hold, .. } = self;
        f.debug_struct("Controls")
            .field("count", &forces.len())
            .field("values", &values.len())
            .field("hold", hold)
            .finish()
    }
}

impl Controls {
    /// Values of all controls, each for `hold` macro steps; the last ones act on.
    ///
    /// # Panics
    /// When a row has another length than there are forces, or `hold` is zero.
    #[must_use]
    pub fn new(forces: Vec<Box<dyn ControlForce>>, values: Vec<Vec<f64>>, hold: usize) -> Self {
        assert!(hold > 0, "a value acts for one step at least");
        assert!(values.iter().all(|row| row.len() == forces.len()), "one value for each control");
        Self { forces, values, hold, sampling: None }
    }

    /// Lets the run be one whose signals are sampled at nodes.
    pub fn sample(&mut self, sampling: Option<Sampling>) {
        self.sampling = sampling;
    }

    /// What is sampled.
    pub(crate) fn sampling(&self) -> Option<&Sampling> {
        self.sampling.as_ref()
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.forces.len()
    }

    /// The values, in the order of time.
    #[must_use]
    pub fn values(&self) -> &[Vec<f64>] {
        &self.values
    }

    /// What they act by.
    #[must_use]
    pub fn forces(&self) -> &[Box<dyn ControlForce>] {
        &self.forces
    }

    /// Which values act in a macro step; `None` where there are none.
    #[must_use]
    pub fn place(&self, step: usize) -> Option<usize> {
        let last = self.values.len().checked_sub(1)?;
        Some((step / self.hold.max(1)).min(last))
    }

    /// The values in a macro step.
    #[must_use]
    pub fn at(&self, step: usize) -> &[f64] {
        self.place(step).map_or(&[], |place| &self.values[place])
    }

    /// The derivatives by all values of a number that changes by `by_force` with forces on the
    /// coordinates at a node, shape `n`.
    pub(crate) fn of_force(&self, node: Configuration<'_>, by_force: &[f64]) -> Vec<f64> {
        let mut standing = Interval::new(node.q.len());
        standing.gather_at(node, &vec![0.0; node.q.len()], 1.0);
        let along = |own: &dyn ControlForce| {
            Slot::BOTH.iter().map(|slot| own.along(&standing, *slot, by_force)).sum()
        };
        self.forces.iter().map(|own| along(&**own)).collect()
    }

    /// Lets the values of a macro step act.
    pub fn set(&self, step: usize) {
        self.forces.iter().zip(self.at(step)).for_each(|(force, value)| force.set(*value));
    }
}
