//! Bushings and bearings: efforts by laws of the six coordinates between two frames.
//!
//! ```text
//! f_d^∓ = (h/2) Σ_i τ_i(t_{n+1/2}, ξ̄, Δξ/h) ∇ξ_i(q_n | q_{n+1}),     τ = preload − K ξ̄ − C Δξ/h   for constant coefficients
//! U_d   = ½ ξ̄ᵀ K ξ̄ − preload·ξ̄                                        for symmetric K: the same forces
//! ```
//! `ξ` ([`SixCoordinates`]) is invariant under rigid motions, so momentum maps are exact for any
//! `τ`, of a symmetric `K` or not. Each end carries the gradients of its own node: the work of a
//! step is `τ·Δξ` to second order.
//!
//! Source: Marsden & West 2001, part 3, for the discrete forces.

use crate::force::law::Input;
use crate::geometry::six_coordinates::{Matrix6, SixChange, SixCoordinates, SixGradients, Vector6};
use std::sync::{Arc, Mutex, PoisonError};
use vi_core::Configuration;
use vi_core::force::{DiscreteForce, Force, seen_velocity};
use vi_core::interval::Interval;
use vi_core::potential::{DiscretePotential, Potential};
use vi_core::sparse::Entries;

/// Efforts along six coordinates and how they change with these and with their rates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SixSlopes {
    /// `τ`, N and N·m.
    pub efforts: Vector6,
    /// `∂τ/∂ξ`.
    pub by_coordinates: Matrix6,
    /// `∂τ/∂ξ̇`.
    pub by_rates: Matrix6,
}

/// What a law of six coordinates reads.
#[derive(Clone, Copy, Debug)]
pub struct SixInputs<'a> {
    /// `t`, s.
    pub t: f64,
    /// `ξ`.
    pub x: Vector6,
    /// `ξ̇`.
    pub v: Vector6,
    /// `y`: what it reads of other members.
    pub far: &'a [f64],
}

/// Efforts along six coordinates, N and N·m, conjugate to displacements and to the rotation vector:
/// positive ones act on the second frame along them.
pub trait SixLaw: Send + Sync {
    /// `τ(t, ξ, ξ̇, y)`.
    fn efforts(&self, at: &SixInputs<'_>) -> Vector6;
    /// `τ` with its slopes; `by_far[k] ← ∂τ/∂y_k`.
    fn slopes(&self, at: &SixInputs<'_>, by_far: &mut [Vector6]) -> SixSlopes;
    /// Whether it dissipates energy.
    fn is_dissipative(&self) -> bool;
}

impl<L: SixLaw + ?Sized> SixLaw for Arc<L> {
    fn efforts(&self, at: &SixInputs<'_>) -> Vector6 {
        (**self).efforts(at)
    }
    fn slopes(&self, at: &SixInputs<'_>, by_far: &mut [Vector6]) -> SixSlopes {
        (**self).slopes(at, by_far)
    }
    fn is_dissipative(&self) -> bool {
        (**self).is_dissipative()
    }
}

/// `τ = preload − K ξ − C ξ̇` with any constant matrices.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearSix {
    /// Efforts where both frames coincide, N and N·m.
    pub preload: Vector6,
    /// `K`, N/m, N/rad, N, N·m/rad.
    pub stiffness: Matrix6,
    /// `C`, N·s/m, N·s/rad, N·s, N·m·s/rad.
    pub damping: Matrix6,
}

impl SixLaw for LinearSix {
    fn efforts(&self, at: &SixInputs<'_>) -> Vector6 {
        self.preload - self.stiffness * at.x - self.damping * at.v
    }
    fn slopes(&self, at: &SixInputs<'_>, _by_far: &mut [Vector6]) -> SixSlopes {
        let efforts = self.efforts(at);
        SixSlopes { efforts, by_coordinates: -self.stiffness, by_rates: -self.damping }
    }
    fn is_dissipative(&self) -> bool {
        self.damping != -self.damping.transpose() // else gyroscopic
    }
}

/// A [`SixLaw`] between two frames, as a discrete force pair.
pub struct SixForce {
    /// The coordinates.
    pub coordinates: SixCoordinates,
    /// The law.
    pub law: Arc<dyn SixLaw>,
    inputs: Vec<Input>,
    first: usize, // of the internal variables of signals
    work: Mutex<Work>,
}

/// Numbers of an evaluation: what is read of other members.
#[derive(Default)]
struct Work {
    far: Vec<f64>,
    by_far: Vec<Vector6>,
}

impl std::fmt::Debug for SixForce {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SixForce").field("coordinates", &self.coordinates).finish_non_exhaustive()
    }
}

impl Clone for SixForce {
    fn clone(&self) -> Self {
        let (coordinates, law) = (self.coordinates.clone(), self.law.clone());
        Self { first: self.first, ..Self::new(coordinates, law, self.inputs.clone()) }
    }
}

impl SixForce {
    /// A law of the coordinates, their rates and further inputs.
    #[must_use]
    pub fn new(coordinates: SixCoordinates, law: Arc<dyn SixLaw>, inputs: Vec<Input>) -> Self {
        let (far, by_far) = (vec![0.0; inputs.len()], vec![Vector6::zeros(); inputs.len()]);
        Self { coordinates, law, inputs, first: 0, work: Mutex::new(Work { far, by_far }) }
    }

    /// The same where internal variables of signals start at `first` among all of a system.
    #[must_use]
    pub fn with_signals_from(self, first: usize) -> Self {
        Self { first, ..self }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Work> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// `τ` of a step and the rates that it acts over.
    fn in_step(&self, s: &Interval) -> (Vector6, Vector6) {
        let SixChange { mean: x, rate: v } = self.coordinates.change(s);
        let work = &mut *self.lock();
        self.read_step(s, work);
        (self.law.efforts(&SixInputs { t: s.t_mid(), x, v, far: &work.far }), v)
    }

    fn read_step(&self, s: &Interval, work: &mut Work) {
        let held = s.internal.get(self.first..).unwrap_or_default();
        for (value, input) in work.far.iter_mut().zip(&self.inputs) {
            *value = input.in_step(s, held);
        }
    }

    fn read_node(&self, at: Configuration<'_>, v: &[f64], work: &mut Work) {
        let held = at.internal.get(self.first..).unwrap_or_default();
        for (value, input) in work.far.iter_mut().zip(&self.inputs) {
            *value = input.at_node(at, v, held);
        }
    }

    /// `τ` at a node.
    #[must_use]
    pub fn efforts(&self, at: Configuration<'_>, v: &[f64]) -> Vector6 {
        let (x, rate) = (self.coordinates.at(at.t, at.q), self.coordinates.rate(at.q, v));
        let work = &mut *self.lock();
        self.read_node(at, v, work);
        self.law.efforts(&SixInputs { t: at.t, x, v: rate, far: &work.far })
    }

    /// `τ` at a node with its slopes.
    fn slopes_at(&self, at: Configuration<'_>, v: &[f64], work: &mut Work) -> SixSlopes {
        let (x, rate) = (self.coordinates.at(at.t, at.q), self.coordinates.rate(at.q, v));
        self.read_node(at, v, work);
        let Work { far, by_far } = work;
        self.law.slopes(&SixInputs { t: at.t, x, v: rate, far }, by_far)
    }

    /// Emits `scale Σ_k (∂τ/∂y_k·∇ξ) (∂y_k)ᵀ`, where `each` visits `∂y` of an input.
    fn emit_far(
        &self,
        gradients: &SixGradients,
        scale: f64,
        by_far: &[Vector6],
        each: impl Fn(&Input, &mut dyn FnMut(usize, f64)),
        out: &mut dyn Entries,
    ) {
        for (input, slope) in self.inputs.iter().zip(by_far) {
            let rows = self.coordinates.along(gradients, &(scale * slope));
            each(input, &mut |column, right| {
                for (offset, row) in &rows {
                    let Some(offset) = offset else { continue };
                    (0..row.len()).for_each(|i| out.add(offset + i, column, row[i] * right));
                }
            });
        }
    }

    fn is_seen_from_ground(&self) -> bool {
        self.coordinates.is_on_ground() || self.inputs.iter().any(Input::is_seen_from_ground)
    }

    fn emit_position_slopes(
        &self,
        at: Configuration<'_>,
        v: &[f64],
        scale: f64,
        (rates, far): (bool, &[f64]),
        out: &mut dyn Entries,
    ) {
        let work = &mut *self.lock();
        let slopes = self.slopes_at(at, v, work);
        let gradients = self.coordinates.gradients(at.q);
        let stiffness = scale * slopes.by_coordinates;
        self.coordinates.emit_product(&gradients, &stiffness, &gradients, out);
        self.coordinates.emit_second(at.q, &(scale * slopes.efforts), out);
        if rates {
            let turning = self.coordinates.rate_slopes(at.q, v);
            self.coordinates.emit_product(&gradients, &(scale * slopes.by_rates), &turning, out);
        }
        let each = |input: &Input, visit: &mut dyn FnMut(usize, f64)| {
            input.for_each_slope_by_position(at.q, far, visit);
        };
        self.emit_far(&gradients, scale, &work.by_far, each, out);
    }
}

impl DiscreteForce for SixForce {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        let (efforts, _) = self.in_step(s);
        self.coordinates.add_gradient(&s.q0, &(0.5 * s.h * efforts), out);
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        let (efforts, _) = self.in_step(s);
        self.coordinates.add_gradient(&s.q1, &(0.5 * s.h * efforts), out);
    }

    fn add_minus_d2(&self, s: &Interval, out: &mut dyn Entries) {
        let SixChange { mean: x, rate: v } = self.coordinates.change(s);
        let work = &mut *self.lock();
        self.read_step(s, work);
        let Work { far, by_far } = work;
        let slopes = self.law.slopes(&SixInputs { t: s.t_mid(), x, v, far }, by_far);
        // (h/2) (½ τ_ξ + τ_ξ̇/h)
        let by_end = 0.25 * s.h * slopes.by_coordinates + 0.5 * slopes.by_rates;
        let [start, end] = [&s.q0, &s.q1].map(|q| self.coordinates.gradients(q));
        self.coordinates.emit_product(&start, &by_end, &end, out);
        let each =
            |input: &Input, visit: &mut dyn FnMut(usize, f64)| input.for_each_slope(s, visit);
        self.emit_far(&start, 0.5 * s.h, by_far, each, out);
    }

    fn add_continuous(&self, at: Configuration<'_>, v: &[f64], out: &mut [f64]) {
        self.coordinates.add_gradient(at.q, &self.efforts(at, v), out);
    }

    fn work(&self, s: &Interval, _scratch: &mut [f64]) -> f64 {
        let (efforts, rate) = self.in_step(s);
        s.h * efforts.dot(&rate)
    }

    fn add_stiffness(&self, at: Configuration<'_>, v: &[f64], scale: f64, out: &mut dyn Entries) {
        let far = seen_velocity(self.is_seen_from_ground(), v);
        self.emit_position_slopes(at, v, scale, (self.coordinates.is_on_ground(), &far), out);
    }

    fn acts_from_ground(&self) -> bool {
        self.is_seen_from_ground()
    }

    fn add_damping(&self, at: Configuration<'_>, v: &[f64], scale: f64, out: &mut dyn Entries) {
        let work = &mut *self.lock();
        let by_rates = scale * self.slopes_at(at, v, work).by_rates;
        let gradients = self.coordinates.gradients(at.q);
        self.coordinates.emit_product(&gradients, &by_rates, &gradients, out);
        let each = |input: &Input, visit: &mut dyn FnMut(usize, f64)| {
            input.for_each_slope_by_velocity(at.q, v, visit);
        };
        self.emit_far(&gradients, scale, &work.by_far, each, out);
    }

    fn is_dissipative(&self) -> bool {
        self.law.is_dissipative()
    }
}

/// The continuous force; at averaged directors, as energy–momentum schemes take it, of order 2.
impl Force for SixForce {
    fn add(&self, t: f64, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]) {
        let efforts = self.efforts(Configuration::new(t, q), v);
        self.coordinates.add_gradient(q, &(scale * efforts), out);
    }

    fn add_position_derivative(
        &self,
        t: f64,
        q: &[f64],
        v: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.emit_position_slopes(Configuration::new(t, q), v, scale, (true, v), out);
    }

    fn add_velocity_derivative(
        &self,
        t: f64,
        q: &[f64],
        v: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.add_damping(Configuration::new(t, q), v, scale, out);
    }

    fn acts_from_ground(&self) -> bool {
        self.is_seen_from_ground()
    }

    fn is_dissipative(&self) -> bool {
        self.law.is_dissipative()
    }
}

/// `V = ½ ξᵀ K ξ − preload·ξ` between two frames, `K` symmetric.
#[derive(Clone, Debug)]
pub struct SixSpring {
    /// The coordinates.
    pub coordinates: SixCoordinates,
    /// `K`.
    pub stiffness: Matrix6,
    /// Efforts where both frames coincide, N and N·m.
    pub preload: Vector6,
}

impl SixSpring {
    fn energy(&self, x: &Vector6) -> f64 {
        0.5 * x.dot(&(self.stiffness * x)) - self.preload.dot(x)
    }

    /// `∂V/∂ξ`, the efforts but for their sign.
    fn slope(&self, x: &Vector6) -> Vector6 {
        self.stiffness * x - self.preload
    }

    /// `τ = preload − K ξ` at a node.
    #[must_use]
    pub fn efforts(&self, t: f64, q: &[f64]) -> Vector6 {
        -self.slope(&self.coordinates.at(t, q))
    }

    fn emit_hessian(&self, t: f64, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let gradients = self.coordinates.gradients(q);
        self.coordinates.emit_product(&gradients, &(scale * self.stiffness), &gradients, out);
        let slope = self.slope(&self.coordinates.at(t, q));
        self.coordinates.emit_second(q, &(scale * slope), out);
    }
}

impl DiscretePotential for SixSpring {
    fn value(&self, s: &Interval) -> f64 {
        self.energy(&self.coordinates.change(s).mean)
    }
    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        let slope = self.slope(&self.coordinates.change(s).mean);
        self.coordinates.add_gradient(&s.q0, &(0.5 * scale * slope), out);
    }
    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        let slope = self.slope(&self.coordinates.change(s).mean);
        self.coordinates.add_gradient(&s.q1, &(0.5 * scale * slope), out);
    }
    fn add_d2_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        let [start, end] = [&s.q0, &s.q1].map(|q| self.coordinates.gradients(q));
        self.coordinates.emit_product(&start, &(0.25 * scale * self.stiffness), &end, out);
    }
    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        let gradients = self.coordinates.gradients(&s.q0);
        let stiffness = 0.25 * scale * self.stiffness;
        self.coordinates.emit_product(&gradients, &stiffness, &gradients, out);
        let slope = self.slope(&self.coordinates.change(s).mean);
        self.coordinates.emit_second(&s.q0, &(0.5 * scale * slope), out);
    }
    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.energy(&self.coordinates.at(at.t, at.q))
    }
    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        let slope = self.slope(&self.coordinates.at(at.t, at.q));
        self.coordinates.add_gradient(at.q, &(scale * slope), out);
    }
    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.emit_hessian(at.t, at.q, scale, out);
    }
}

/// The continuous potential, for discrete derivatives of any function.
impl Potential for SixSpring {
    fn value(&self, q: &[f64]) -> f64 {
        self.energy(&self.coordinates.at(0.0, q))
    }
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        let slope = self.slope(&self.coordinates.at(0.0, q));
        self.coordinates.add_gradient(q, &(scale * slope), out);
    }
    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        self.emit_hessian(0.0, q, scale, out);
    }
}
