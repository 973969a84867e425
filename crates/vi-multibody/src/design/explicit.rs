//! What elements add to the derivative of the equations of a step by a parameter.

use super::{EffortChange, EffortTangent, ForceChange, MechanismTangent, StepTangent};
use crate::constraint::joint_coordinate::{CoordinateChange, JointCoordinate, Value};
use crate::force::spring::{Damper, Spring};
use crate::geometry::form::Form;
use crate::mechanism::Mechanism;
use nalgebra::{SMatrix, Vector3};
use std::sync::Arc;
use vi_constraints::design::Place;
use vi_core::coordinate_force::CoordinateForce;
use vi_core::interval::Slot;
use vi_core::num_dual::Dual64;
use vi_core::potential::DiscretePotential;
use vi_core::{Configuration, Interval, Quadrature};
use vi_rigid::directors::FRAME;
use vi_rigid::load::{Load, LoadChange};

/// Takes derivatives, entry by entry.
pub(super) trait Sink {
    /// Of `D_1 L_d + f_d^- − Gᵀ h λ`.
    fn minus(&mut self, i: usize, value: f64);
    /// Of `D_2 L_d + f_d^+`.
    fn plus(&mut self, i: usize, value: f64);
    /// Of `g`.
    fn row(&mut self, i: usize, value: f64);
    /// Whether the change of the gradient of an effort along an unknown counts, at `q_n` and at
    /// `q_{n+1}`.
    fn keeps_gradients(&self) -> [bool; 2] {
        [true; 2]
    }
}

/// The derivative of what an element adds to the equations of a step.
pub(super) trait Explicit: Send + Sync {
    /// Emits it, at a place where forces count.
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink);
}

/// Coordinates, angles and internal variables at a Gauss node.
pub(super) fn node(s: &Interval) -> Configuration<'_> {
    Configuration { t: s.t_mid(), ..s.start() }
}

/// `M_θ` of bodies and point masses:
/// `D_1 L_d = −M Δq/h + (h/2) M γ`, `D_2 L_d = M Δq/h + (h/2) M γ`.
pub(super) struct Masses {
    blocks: Vec<MassBlock>,
    gravity: Vector3<f64>,
}

/// Whether a vector of a member is a point: the first one of a frame, and of a point mass.
pub(super) fn is_point(vector: usize) -> bool {
    vector.is_multiple_of(4)
}

/// Vectors of coordinates with the masses that couple them.
struct MassBlock {
    offset: usize,
    dimension: usize,
    masses: Vec<(usize, usize, f64)>, // vector, vector, mass
}

impl MassBlock {
    /// `M_θ v`, entry by entry.
    fn for_each_momentum(&self, v: impl Fn(usize) -> f64, mut visit: impl FnMut(usize, f64)) {
        for &(a, b, mass) in &self.masses {
            for i in 0..self.dimension {
                let of = |vector: usize| self.offset + self.dimension * vector + i;
                visit(of(a), mass * v(of(b)));
            }
        }
    }
}

impl Masses {
    /// Those that change; `None` where none does.
    pub(super) fn of(
        mechanism: &Mechanism,
        tangent: &MechanismTangent,
        gravity: Vector3<f64>,
    ) -> Option<Self> {
        let body = |(k, own): (&usize, &super::BodyTangent)| {
            let mut masses = vec![(0, 0, own.mass)];
            for i in 0..3 {
                masses.extend([(0, 1 + i, own.moment[i]), (1 + i, 0, own.moment[i])]);
                masses.extend((0..3).map(|j| (1 + i, 1 + j, own.euler[(i, j)])));
            }
            masses.retain(|(_, _, mass)| *mass != 0.0);
            MassBlock { offset: FRAME * k, dimension: 3, masses }
        };
        let dimension = mechanism.description().dimension;
        let particle = |(k, mass): (&usize, &f64)| MassBlock {
            offset: mechanism.particle_offset(*k),
            dimension,
            masses: vec![(0, 0, *mass)],
        };
        let element = |(first, own): (&usize, &SMatrix<f64, 8, 8>)| {
            let pairs = (0..8).flat_map(|a| (0..8).map(move |b| (a, b, own[(a, b)])));
            let masses = pairs.filter(|(_, _, mass)| *mass != 0.0).collect();
            MassBlock { offset: FRAME * first, dimension: 3, masses }
        };
        let bodies = tangent.bodies.iter().map(body);
        let blocks = bodies.chain(tangent.particles.iter().map(particle));
        let blocks: Vec<_> = blocks.chain(tangent.masses.iter().map(element)).collect();
        (!blocks.is_empty()).then_some(Self { blocks, gravity })
    }

    /// Entries of `M_θ` between vectors of coordinates: first coordinate of a member, dimension of
    /// its vectors, which two of them, mass.
    pub(super) fn for_each_mass(&self, mut visit: impl FnMut(usize, usize, (usize, usize), f64)) {
        for block in &self.blocks {
            for &(a, b, mass) in &block.masses {
                visit(block.offset, block.dimension, (a, b), mass);
            }
        }
    }

    /// `M_θ v`, entry by entry.
    pub(super) fn for_each_momentum(&self, v: &[f64], mut visit: impl FnMut(usize, f64)) {
        self.blocks.iter().for_each(|block| block.for_each_momentum(|i| v[i], &mut visit));
    }
}

impl Explicit for Masses {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        self.for_each_momentum(&s.v_mid, |i, p| {
            out.minus(i, -p);
            out.plus(i, p);
        });
        let half = 0.5 * s.h;
        for block in &self.blocks {
            let acceleration = |i: usize| {
                let (vector, i) = ((i - block.offset) / block.dimension, i - block.offset);
                if is_point(vector) { self.gravity[i % block.dimension] } else { 0.0 }
            };
            block.for_each_momentum(acceleration, |i, weight| {
                out.minus(i, half * weight);
                out.plus(i, half * weight);
            });
        }
    }
}

/// `M γ_θ`.
pub(super) struct Weight {
    pub(super) force: Vec<f64>,
}

impl Explicit for Weight {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        for (i, weight) in self.force.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            out.minus(i, 0.5 * s.h * weight);
            out.plus(i, 0.5 * s.h * weight);
        }
    }
}

/// The tangents of `scale fᵀ ∂form/∂q`.
fn each_tangent(form: &Form<Dual64>, f: &Vector3<Dual64>, mut visit: impl FnMut(usize, f64)) {
    form.for_each_slope(f, |i, slope| visit(i, slope.eps));
}

/// A spring between two points: `−h D_1 U_d`, `−h D_2 U_d`.
pub(super) struct PointSpring {
    pub(super) spring: Spring<Dual64>,
    pub(super) quadrature: Quadrature,
}

impl Explicit for PointSpring {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        let [start, end] = match self.quadrature {
            Quadrature::Midpoint => [&s.q_mid; 2],
            Quadrature::Trapezoidal => [&s.q0, &s.q1],
        };
        let (spring, half) = (&self.spring, 0.5 * s.h);
        each_tangent(&spring.between, &spring.pull(start, -half), |i, f| out.minus(i, f));
        each_tangent(&spring.between, &spring.pull(end, -half), |i, f| out.plus(i, f));
    }
}

/// A damper between two points, at the midpoint.
pub(super) struct PointDamper {
    pub(super) damper: Damper<Dual64>,
}

impl Explicit for PointDamper {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        let force = self.damper.force(&s.q_mid, &s.v_mid) * Dual64::from_re(0.5 * s.h);
        each_tangent(&self.damper.between, &force, |i, f| {
            out.minus(i, f);
            out.plus(i, f);
        });
    }
}

/// A force of its own, `f_d^-`, `f_d^+`.
pub(super) struct OwnForcePair {
    pub(super) force: Arc<dyn ForceChange>,
}

impl Explicit for OwnForcePair {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        let mut force = vec![0.0; s.q0.len()];
        if let Place::Gauss(..) = at {
            self.force.add_at_node(node(s).moving(&s.v_mid), &mut force);
            return halves(s, &force, out);
        }
        self.force.add(s, Slot::First, &mut force);
        each(&force, |i, f| out.minus(i, f));
        force.fill(0.0);
        self.force.add(s, Slot::Second, &mut force);
        each(&force, |i, f| out.plus(i, f));
    }
}

/// An energy of its own, `−h D_1 U_d`, `−h D_2 U_d`.
pub(super) struct OwnEnergy {
    pub(super) potential: Arc<dyn DiscretePotential>,
}

impl Explicit for OwnEnergy {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        let mut force = vec![0.0; s.q0.len()];
        if let Place::Gauss(..) = at {
            self.potential.add_gradient(node(s), -1.0, &mut force);
            return halves(s, &force, out);
        }
        self.potential.add_d1(s, -s.h, &mut force);
        each(&force, |i, f| out.minus(i, f));
        force.fill(0.0);
        self.potential.add_d2(s, -s.h, &mut force);
        each(&force, |i, f| out.plus(i, f));
    }
}

/// Elements of another crate.
pub(super) struct OfElements {
    pub(super) own: Arc<dyn StepTangent>,
}

impl Explicit for OfElements {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        let mut force = vec![0.0; s.q0.len()];
        if let Place::Gauss(..) = at {
            self.own.add_at_gauss(&s.q0, &s.v_mid, &mut force);
            return halves(s, &force, out);
        }
        self.own.add(s, Slot::First, &mut force);
        each(&force, |i, f| out.minus(i, f));
        force.fill(0.0);
        self.own.add(s, Slot::Second, &mut force);
        each(&force, |i, f| out.plus(i, f));
    }
}

/// Half the impulse of a force at a Gauss node to either end.
pub(super) fn halves(s: &Interval, force: &[f64], out: &mut dyn Sink) {
    each(force, |i, f| {
        out.minus(i, 0.5 * s.h * f);
        out.plus(i, 0.5 * s.h * f);
    });
}

/// The entries that are not zero.
pub(super) fn each(force: &[f64], mut visit: impl FnMut(usize, f64)) {
    force.iter().enumerate().filter(|(_, f)| **f != 0.0).for_each(|(i, f)| visit(i, *f));
}

/// A load on a body.
pub(super) struct ForceOfLoad {
    pub(super) load: Load,
    pub(super) change: LoadChange,
}

impl Explicit for ForceOfLoad {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        let first = self.load.offset();
        let [start, end] = [&s.q0, &s.q1].map(|q| self.load.half_impulse_by(&self.change, s, q));
        (0..FRAME).for_each(|i| out.minus(first + i, start[i]));
        (0..FRAME).for_each(|i| out.plus(first + i, end[i]));
    }
}

/// The coordinate of a joint, and its rate, that a law sees.
fn seen(coordinate: &JointCoordinate, at: Place<'_>) -> [f64; 2] {
    let s = at.interval();
    if let Place::Gauss(..) = at {
        return [coordinate.at(node(s)), coordinate.rate(&s.q0, &s.v_mid)];
    }
    let CoordinateChange { mean, difference } = coordinate.change(s);
    [mean, difference / s.h]
}

/// An effort along a joint coordinate, `(h/2) τ ∇θ` at either end, by its own numbers.
pub(super) struct EffortOn {
    coordinate: JointCoordinate,
    by: EffortTangent,
}

impl EffortOn {
    /// `None` where the joint has no such coordinate.
    pub(super) fn new(mechanism: &Mechanism, change: &EffortChange) -> Option<Self> {
        let coordinate = mechanism.known_coordinate(change.joint, change.freedom)?;
        Some(Self { coordinate, by: change.by.clone() })
    }
}

impl Explicit for EffortOn {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        let [mean, rate] = seen(&self.coordinate, at);
        let change = 0.5 * s.h * (self.by)(s.t_mid(), mean, rate);
        self.coordinate.for_each_slope(&s.q0, |i, slope| out.minus(i, change * slope));
        self.coordinate.for_each_slope(&s.q1, |i, slope| out.plus(i, change * slope));
    }
}

/// The same by the geometry of its joint.
pub(super) struct MovedEffort {
    coordinate: JointCoordinate,
    value: Value<Dual64>,
    law: Box<dyn CoordinateForce + Send + Sync>,
}

impl MovedEffort {
    /// `None` where the joint does not change.
    pub(super) fn of(
        mechanism: &Mechanism,
        tangent: &MechanismTangent,
        coordinate: &JointCoordinate,
        law: impl CoordinateForce + Send + Sync + 'static,
    ) -> Option<Box<dyn Explicit>> {
        let value = moved_value(mechanism, tangent, coordinate)?;
        Some(Box::new(Self { coordinate: coordinate.clone(), value, law: Box::new(law) }))
    }
}

/// The coordinate of a joint that changes, with its derivative.
pub(super) fn moved_value(
    mechanism: &Mechanism,
    tangent: &MechanismTangent,
    coordinate: &JointCoordinate,
) -> Option<Value<Dual64>> {
    let (joint, freedom) = coordinate.place()?;
    let change = tangent.joints.get(&joint)?;
    let joint = &mechanism.description().joints[joint];
    Value::of(&change.dual(joint), joint.kind.degree_of_freedom(freedom)?)
}

impl Explicit for MovedEffort {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let s = at.interval();
        let [mean, rate] = seen(&self.coordinate, at);
        let (t, half) = (s.t_mid(), 0.5 * s.h);
        let [start, end] = [&s.q0, &s.q1].map(|q| self.value.principal(q).eps);
        let by_rate = match at {
            Place::Gauss(..) => {
                let mut sum = 0.0; // (∇θ)_θ·V
                self.value.for_each_slope(&s.q0, |i, slope| sum += slope.eps * s.v_mid[i]);
                sum
            }
            _ => (end - start) / s.h,
        };
        let slopes = self.law.slopes(t, mean, rate);
        let change = half * (slopes.by_coordinate * 0.5 * (start + end) + slopes.by_rate * by_rate);
        let effort = half * self.law.effort(t, mean, rate);
        let [start, end] = match self.coordinate.unknown() {
            Some(_) => out.keeps_gradients().map(|keeps| if keeps { effort } else { 0.0 }),
            None => [effort; 2],
        };
        let both = |slope: Dual64, effort: f64| change * slope.re + effort * slope.eps;
        self.value.for_each_slope(&s.q0, |i, slope| out.minus(i, both(slope, start)));
        self.value.for_each_slope(&s.q1, |i, slope| out.plus(i, both(slope, end)));
    }
}
