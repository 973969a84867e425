//! Springs, dampers, friction and motors that act on a joint coordinate.
//!
//! With `θ̄ = ½(θ(q_n) + θ(q_{n+1}))` and `Δθ = θ(q_{n+1}) − θ(q_n)`:
//! ```text
//! spring       U_d = ½ k (θ̄ − θ_0)²         D_1 U_d = ½ k (θ̄ − θ_0) ∇θ(q_n)
//! other laws   f_d^- = (h/2) τ ∇θ(q_n),  f_d^+ = (h/2) τ ∇θ(q_{n+1}),  τ = τ(t_{n+1/2}, θ̄, Δθ/h)
//!   damper, viscous friction   τ = −c θ̇
//!   motor                      τ = T(t)
//!   PD control                 τ = k_p (θ_ref(t) − θ) + k_d (θ̇_ref(t) − θ̇)
//! ```
//! Each end carries the gradient of its own node: the work done is `τ Δθ` to second order, and the
//! reaction on the parent is equal and opposite, so momentum maps stay exact.

use super::bends::LawEvaluation;
use super::law::Input;
use crate::constraint::joint_coordinate::{CoordinateChange, JointCoordinate};
use nalgebra::DMatrix;
use std::sync::Arc;
use vi_core::coordinate_force::{AlongUnknown, CoordinateForce, StepEffort};
pub use vi_core::coordinate_force::{EffortBends, EffortSlopes};
use vi_core::force::{DiscreteForce, LengthBends, NoTimeSlope};
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::potential::DiscretePotential;
use vi_core::sparse::Entries;
use vi_core::{Configuration, Motion};

/// `½ k (θ − θ_0)²` on a joint coordinate.
///
/// ```
/// use vi_core::{Configuration, MechanicalSystem, Quadrature};
/// use vi_multibody::builder::{Inertia, MechanismBuilder};
/// use vi_multibody::joint_force::JointSpring;
/// use vi_multibody::{FrameId::Ground, PairKind};
///
/// let mut builder = MechanismBuilder::new();
/// let arm = builder.body("arm", Inertia::principal(1.0, [0.1; 3])).at([0.5, 0.0, 0.0]).id();
/// let hinge = builder.joint("hinge", PairKind::Revolute, Ground, arm);
/// let angle = hinge.at([0.0; 3]).axis([0.0, 1.0, 0.0]).id().coordinate(0);
/// let mut built = builder.build()?;
/// let coordinate = built.coordinate(angle).expect("a hinge has one coordinate");
/// let spring = JointSpring { coordinate, stiffness: 2.0, rest: 0.1 };
/// let system = built.system(Quadrature::Midpoint).discrete_potential(Box::new(spring));
/// let q = built.mechanism.initial_configuration();
/// let energy = system.potential_energy(Configuration::new(0.0, &q));
/// assert!((energy - 0.01).abs() < 1e-15); // ½ k θ_0²
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct JointSpring {
    /// The coordinate.
    pub coordinate: JointCoordinate,
    /// `k`, N/m or N·m/rad.
    pub stiffness: f64,
    /// `θ_0`, m or rad.
    pub rest: f64,
}

impl JointSpring {
    /// Emits `scale D_1 D_1 U_d` or `scale D_2 D_2 U_d`, `q` the end concerned.
    fn emit_second(&self, s: &Interval, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let stretch = self.coordinate.change(s).mean - self.rest;
        self.coordinate.emit_product(q, q, 0.25 * scale * self.stiffness, out);
        self.coordinate.emit_second(q, 0.5 * scale * self.stiffness * stretch, out);
    }
}

impl DiscretePotential for JointSpring {
    fn value(&self, s: &Interval) -> f64 {
        let stretch = self.coordinate.change(s).mean - self.rest;
        0.5 * self.stiffness * stretch * stretch
    }
    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        let stretch = self.coordinate.change(s).mean - self.rest;
        self.coordinate.add_gradient(&s.q0, 0.5 * scale * self.stiffness * stretch, out);
    }
    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        let stretch = self.coordinate.change(s).mean - self.rest;
        self.coordinate.add_gradient(&s.q1, 0.5 * scale * self.stiffness * stretch, out);
    }
    fn add_d2_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.coordinate.emit_slope(s, 0.25 * scale * self.stiffness, out);
    }
    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.emit_second(s, &s.q0, scale, out);
    }
    fn add_d2_d2(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.emit_second(s, &s.q1, scale, out);
    }
    fn potential(&self, at: Configuration<'_>) -> f64 {
        let stretch = self.coordinate.at(at) - self.rest;
        0.5 * self.stiffness * stretch * stretch
    }
    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        let stretch = self.coordinate.at(at) - self.rest;
        self.coordinate.add_gradient(at.q, scale * self.stiffness * stretch, out);
    }
    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        let (slope, stretch) = (scale * self.stiffness, self.coordinate.at(at) - self.rest);
        let slopes = EffortSlopes { by_coordinate: slope, by_rate: 0.0 };
        self.coordinate.emit_effort_slopes(at.q, &[], slope * stretch, slopes, out);
    }
    fn add_bend(
        &self,
        s: &Interval,
        y: [&[f64]; 2],
        slots: [Slot; 2],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let stretch = self.coordinate.change(s).mean - self.rest;
        let [half, slope] = [0.5, 0.25].map(|part| part * scale * self.stiffness);
        self.coordinate.emit_pair_bends(s, y, slots, (half * stretch, [slope; 2], 0.0), out);
    }
    fn add_third(&self, at: Configuration<'_>, z: &[f64], scale: f64, out: &mut dyn Entries) {
        let (slope, stretch) = (scale * self.stiffness, self.coordinate.at(at) - self.rest);
        let slopes = EffortSlopes { by_coordinate: slope, by_rate: 0.0 };
        let effort = (slope * stretch, slopes, EffortBends::default());
        self.coordinate.emit_effort_bends([at.q, &[], z], effort, [1.0, 0.0, 0.0, 0.0], out);
    }
    fn along_unknown(&self) -> Option<AlongUnknown<'_>> {
        self.coordinate.unknown().map(|unknown| AlongUnknown { unknown, force: self })
    }
}

impl CoordinateForce for JointSpring {
    fn coordinate(&self, at: Configuration<'_>) -> f64 {
        self.coordinate.at_node(at)
    }
    fn effort(&self, _t: f64, coordinate: f64, _rate: f64) -> f64 {
        -self.stiffness * (coordinate - self.rest)
    }
    fn slopes(&self, _t: f64, _coordinate: f64, _rate: f64) -> EffortSlopes {
        EffortSlopes { by_coordinate: -self.stiffness, by_rate: 0.0 }
    }
    fn bends(&self, _t: f64, _coordinate: f64, _rate: f64) -> EffortBends {
        EffortBends::default()
    }
    fn is_affine(&self) -> bool {
        true
    }
    fn change(&self, s: &Interval) -> [f64; 2] {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        [mean, difference]
    }
    fn rate(&self, q: &[f64], v: &[f64]) -> f64 {
        self.coordinate.rate(q, v)
    }
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        self.coordinate.add_gradient(q, scale, out);
    }
    fn add_bend(&self, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]) {
        self.coordinate.add_bend(q, v, scale, out);
    }
}

/// A force or torque along a joint coordinate, N or N·m.
pub trait JointLaw: Send + Sync {
    /// `τ(t, θ, θ̇)`.
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64;
    /// `(∂τ/∂θ, ∂τ/∂θ̇)`.
    fn slopes(&self, t: f64, coordinate: f64, rate: f64) -> EffortSlopes;
    /// `τ` and its derivatives.
    fn effort_and_slopes(&self, t: f64, coordinate: f64, rate: f64) -> (f64, EffortSlopes) {
        (self.effort(t, coordinate, rate), self.slopes(t, coordinate, rate))
    }
    /// The second derivatives of `τ` by `θ` and `θ̇`; zero, unless said otherwise: they steer a
    /// search for an optimum and move none.
    fn bends(&self, _t: f64, _coordinate: f64, _rate: f64) -> EffortBends {
        EffortBends::default()
    }
    /// `∂τ/∂t`; `None`, unless said otherwise, where it is not known.
    fn by_time(&self, _t: f64, _coordinate: f64, _rate: f64) -> Option<f64> {
        None
    }
    /// Whether it dissipates energy.
    fn is_dissipative(&self) -> bool;
    /// Whether `τ` is an affine function of `θ` and `θ̇`.
    fn is_affine(&self) -> bool {
        false
    }
    /// Whether `τ` is a function of `θ` alone: it has a potential.
    fn is_potential(&self) -> bool {
        false
    }
    /// Whether `τ` depends on time alone, or on what is set from outside: it has no slopes.
    fn is_given(&self) -> bool {
        false
    }
}

impl std::fmt::Debug for dyn JointLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = if self.is_dissipative() { "dissipative joint law" } else { "joint law" };
        f.write_str(name)
    }
}

impl JointLaw for Arc<dyn JointLaw> {
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        (**self).effort(t, coordinate, rate)
    }
    fn slopes(&self, t: f64, coordinate: f64, rate: f64) -> EffortSlopes {
        (**self).slopes(t, coordinate, rate)
    }
    fn effort_and_slopes(&self, t: f64, coordinate: f64, rate: f64) -> (f64, EffortSlopes) {
        (**self).effort_and_slopes(t, coordinate, rate)
    }
    fn bends(&self, t: f64, coordinate: f64, rate: f64) -> EffortBends {
        (**self).bends(t, coordinate, rate)
    }
    fn by_time(&self, t: f64, coordinate: f64, rate: f64) -> Option<f64> {
        (**self).by_time(t, coordinate, rate)
    }
    fn is_dissipative(&self) -> bool {
        (**self).is_dissipative()
    }
    fn is_affine(&self) -> bool {
        (**self).is_affine()
    }
    fn is_potential(&self) -> bool {
        (**self).is_potential()
    }
    fn is_given(&self) -> bool {
        (**self).is_given()
    }
}

/// `τ = −c θ̇`: damper or viscous friction, `c` in N·s/m or N·m·s/rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viscous(
    /// `c`.
    pub f64,
);

impl JointLaw for Viscous {
    fn effort(&self, _t: f64, _coordinate: f64, rate: f64) -> f64 {
        -self.0 * rate
    }
    fn slopes(&self, _t: f64, _coordinate: f64, _rate: f64) -> EffortSlopes {
        EffortSlopes { by_coordinate: 0.0, by_rate: -self.0 }
    }
    fn by_time(&self, _t: f64, _coordinate: f64, _rate: f64) -> Option<f64> {
        Some(0.0)
    }
    fn is_dissipative(&self) -> bool {
        self.0 != 0.0
    }
    fn is_affine(&self) -> bool {
        true
    }
}

/// `τ = T(t)`: a motor with a prescribed effort.
#[derive(Clone)]
pub struct Motor(
    /// `T(t)`.
    pub Arc<dyn Fn(f64) -> f64 + Send + Sync>,
);

impl std::fmt::Debug for Motor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Motor").finish_non_exhaustive()
    }
}

impl JointLaw for Motor {
    fn effort(&self, t: f64, _coordinate: f64, _rate: f64) -> f64 {
        (self.0)(t)
    }
    fn slopes(&self, _t: f64, _coordinate: f64, _rate: f64) -> EffortSlopes {
        EffortSlopes::default()
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

/// The reference of a controller at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setpoint {
    /// `θ_ref`, m or rad.
    pub value: f64,
    /// `θ̇_ref`, m/s or rad/s.
    pub rate: f64,
}

/// `τ = k_p (θ_ref(t) − θ) + k_d (θ̇_ref(t) − θ̇)`.
#[derive(Clone)]
pub struct PdControl {
    /// `k_p`, N/m or N·m/rad.
    pub proportional: f64,
    /// `k_d`, N·s/m or N·m·s/rad.
    pub derivative: f64,
    /// `θ_ref(t)` and `θ̇_ref(t)`.
    pub reference: Arc<dyn Fn(f64) -> Setpoint + Send + Sync>,
}

impl std::fmt::Debug for PdControl {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { proportional, derivative, .. } = self;
        let mut law = f.debug_struct("PdControl");
        law.field("proportional", proportional)
            .field("derivative", derivative)
            .finish_non_exhaustive()
    }
}

impl JointLaw for PdControl {
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        let setpoint = (self.reference)(t);
        self.proportional * (setpoint.value - coordinate) + self.derivative * (setpoint.rate - rate)
    }
    fn slopes(&self, _t: f64, _coordinate: f64, _rate: f64) -> EffortSlopes {
        EffortSlopes { by_coordinate: -self.proportional, by_rate: -self.derivative }
    }
    fn is_dissipative(&self) -> bool {
        self.derivative != 0.0
    }
    fn is_affine(&self) -> bool {
        true
    }
}

/// A [`JointLaw`] on a coordinate, as a discrete force pair.
#[derive(Clone, Debug)]
pub struct JointForce<L> {
    /// The coordinate.
    pub coordinate: JointCoordinate,
    /// The law.
    pub law: L,
}

impl<L: JointLaw> JointForce<L> {
    fn effort(&self, s: &Interval) -> f64 {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        self.law.effort(s.t_mid(), mean, difference / s.h)
    }

    fn in_step(&self, s: &Interval) -> StepEffort {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        let (t, rate) = (s.t_mid(), difference / s.h);
        let (effort, slopes) = self.law.effort_and_slopes(t, mean, rate);
        StepEffort { effort, slopes, bends: self.law.bends(t, mean, rate), rate }
    }

    /// `q ← q + scale ∂²τ/∂q∂(q, v)` times `changes` of both, `of_v` likewise, at a node.
    pub fn add_effort_bends(
        &self,
        at: Motion<'_>,
        scale: f64,
        changes: [&[f64]; 2],
        out: [&mut [f64]; 2],
    ) {
        let (coordinate, rate) =
            (self.coordinate.at(at.configuration()), self.coordinate.rate(at.q, at.v));
        let (effort, slopes) = self.law.effort_and_slopes(at.t, coordinate, rate);
        let EffortSlopes { by_coordinate, by_rate } = slopes;
        let slopes = DMatrix::from_row_slice(1, 2, &[by_coordinate, by_rate]);
        let bends = self.law.bends(at.t, coordinate, rate);
        let bend = |along: &[f64], w: &[f64], out: &mut [f64]| bends.along(along, w[0], out);
        let reads =
            [Input::Coordinate(self.coordinate.clone()), Input::Rate(self.coordinate.clone())];
        let (values, efforts) = (&[coordinate, rate], &[effort]);
        let law = LawEvaluation { values, efforts, slopes: &slopes, bend: &bend };
        law.add(&reads[..], [at.q, at.v], 0, scale, changes, out);
    }

    /// Emits `scale ∂f/∂q`, with that of the rate or without.
    fn emit_position_slopes(
        &self,
        at: Motion<'_>,
        scale: f64,
        with_rate: bool,
        out: &mut dyn Entries,
    ) {
        let (coordinate, rate) =
            (self.coordinate.at(at.configuration()), self.coordinate.rate(at.q, at.v));
        let (effort, slopes) = self.law.effort_and_slopes(at.t, coordinate, rate);
        let by_rate = if with_rate { scale * slopes.by_rate } else { 0.0 };
        let slopes = EffortSlopes { by_coordinate: scale * slopes.by_coordinate, by_rate };
        self.coordinate.emit_effort_slopes(at.q, at.v, scale * effort, slopes, out);
    }
}

impl<L: JointLaw> DiscreteForce for JointForce<L> {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        self.coordinate.add_gradient(&s.q0, 0.5 * s.h * self.effort(s), out);
    }
    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        self.coordinate.add_gradient(&s.q1, 0.5 * s.h * self.effort(s), out);
    }
    fn add_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        let (effort, slopes) = self.law.effort_and_slopes(s.t_mid(), mean, difference / s.h);
        if !self.law.is_given() {
            self.coordinate.emit_product(s.node(of), s.node(by), slopes.by_node(s.h, by), out);
        }
        if of == by {
            self.coordinate.emit_second(s.node(of), 0.5 * s.h * effort, out);
        }
    }
    fn add_minus_d2(&self, s: &Interval, out: &mut dyn Entries) {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        let slopes = self.law.slopes(s.t_mid(), mean, difference / s.h);
        let slope = slopes.by_unknown(s.h);
        self.coordinate.emit_slope(s, slope, out);
    }
    fn add_bend(&self, s: &Interval, y: [&[f64]; 2], slots: [Slot; 2], out: &mut dyn Entries) {
        let StepEffort { effort, slopes, bends, .. } = self.in_step(s);
        let second = bends.by_nodes(s.h, slots);
        let slopes = slots.map(|node| slopes.by_node(s.h, node));
        self.coordinate.emit_pair_bends(s, y, slots, (0.5 * s.h * effort, slopes, second), out);
    }
    fn length_bends(&self) -> Option<&dyn LengthBends> {
        Some(self)
    }
    fn add_gauss_bend(&self, at: Motion<'_>, z: &[f64], by: [f64; 4], out: &mut dyn Entries) {
        let (coordinate, rate) =
            (self.coordinate.at(at.configuration()), self.coordinate.rate(at.q, at.v));
        let (effort, slopes) = self.law.effort_and_slopes(at.t, coordinate, rate);
        let bends = self.law.bends(at.t, coordinate, rate);
        self.coordinate.emit_effort_bends([at.q, at.v, z], (effort, slopes, bends), by, out);
    }
    fn add_step_slope(
        &self,
        s: &Interval,
        of: Slot,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        let (t, rate) = (s.t_mid(), difference / s.h);
        let (effort, slopes) = self.law.effort_and_slopes(t, mean, rate);
        let by_time = self.law.by_time(t, mean, rate).ok_or(NoTimeSlope)?;
        // of (h/2) τ(t, θ̄, Δθ/h)
        let scale = 0.5 * change.length * (effort - slopes.by_rate * rate)
            + 0.5 * s.h * change.middle * by_time;
        self.coordinate.add_gradient(s.node(of), scale, out);
        Ok(())
    }
    fn add_time_slope(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        let (coordinate, rate) =
            (self.coordinate.at(at.configuration()), self.coordinate.rate(at.q, at.v));
        let slope = self.law.by_time(at.t, coordinate, rate).ok_or(NoTimeSlope)?;
        self.coordinate.add_gradient(at.q, scale * slope, out);
        Ok(())
    }
    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        let rate = self.coordinate.rate(at.q, at.v);
        let effort = self.law.effort(at.t, self.coordinate.at(at.configuration()), rate);
        self.coordinate.add_gradient(at.q, effort, out);
    }
    fn work(&self, s: &Interval, _scratch: &mut [f64]) -> f64 {
        let (CoordinateChange { mean, difference }, [start, end]) =
            self.coordinate.change_and_rates(s, &s.v_mid);
        0.5 * s.h * self.law.effort(s.t_mid(), mean, difference / s.h) * (start + end)
    }
    fn add_stiffness(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.emit_position_slopes(at, scale, self.acts_from_ground(), out);
    }
    fn add_position_slope(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.emit_position_slopes(at, scale, true, out);
    }
    fn add_gauss_slopes(&self, at: Motion<'_>, [by_q, by_v]: [f64; 2], out: &mut dyn Entries) {
        if self.law.is_given() {
            if by_q != 0.0 {
                let (effort, none) = (self.law.effort(at.t, 0.0, 0.0), EffortSlopes::default());
                self.coordinate.emit_effort_slopes(at.q, &[], by_q * effort, none, out);
            }
            return;
        }
        if by_q != 0.0 {
            self.emit_position_slopes(at, by_q, true, out);
        }
        if by_v != 0.0 {
            self.add_damping(at, by_v, out);
        }
    }
    fn acts_from_ground(&self) -> bool {
        self.coordinate.is_length_from_ground()
    }
    fn add_damping(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        let (coordinate, rate) =
            (self.coordinate.at(at.configuration()), self.coordinate.rate(at.q, at.v));
        let by_coordinate = scale * self.law.slopes(at.t, coordinate, rate).by_rate;
        let slopes = EffortSlopes { by_coordinate, by_rate: 0.0 };
        self.coordinate.emit_effort_slopes(at.q, at.v, 0.0, slopes, out);
    }
    fn is_dissipative(&self) -> bool {
        self.law.is_dissipative()
    }
    fn along_unknown(&self) -> Option<AlongUnknown<'_>> {
        self.coordinate.unknown().map(|unknown| AlongUnknown { unknown, force: self })
    }
}

impl<L: JointLaw> LengthBends for JointForce<L> {
    fn add_slope_by_length(&self, s: &Interval, y: [&[f64]; 2], by: Slot, out: &mut [f64]) {
        self.in_step(s).add_slope_by_length(self, s, y, by, out);
    }
    fn second_by_length(&self, s: &Interval, y: [&[f64]; 2]) -> f64 {
        let rates = Slot::BOTH.iter().zip(y).map(|(end, y)| self.coordinate.rate(s.node(*end), y));
        rates.sum::<f64>() * self.in_step(s).second_by_length(s.h)
    }
}

impl<L: JointLaw> CoordinateForce for JointForce<L> {
    fn coordinate(&self, at: Configuration<'_>) -> f64 {
        self.coordinate.at_node(at)
    }
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        self.law.effort(t, coordinate, rate)
    }
    fn slopes(&self, t: f64, coordinate: f64, rate: f64) -> EffortSlopes {
        self.law.slopes(t, coordinate, rate)
    }
    fn bends(&self, t: f64, coordinate: f64, rate: f64) -> EffortBends {
        self.law.bends(t, coordinate, rate)
    }
    fn is_affine(&self) -> bool {
        self.law.is_affine()
    }
    fn is_given(&self) -> bool {
        self.law.is_given()
    }
    fn change(&self, s: &Interval) -> [f64; 2] {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        [mean, difference]
    }
    fn rate(&self, q: &[f64], v: &[f64]) -> f64 {
        self.coordinate.rate(q, v)
    }
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        self.coordinate.add_gradient(q, scale, out);
    }
    fn add_bend(&self, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]) {
        self.coordinate.add_bend(q, v, scale, out);
    }
}
