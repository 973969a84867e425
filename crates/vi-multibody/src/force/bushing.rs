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

use crate::force::bends::{Between, LawEvaluation, Pushes, Reads};
use crate::force::law::evaluation::EvaluationScratch;
use crate::force::law::{Input, Law, ReadingLaw};
use crate::geometry::six_coordinates::{Matrix6, SixCoordinates, SixGradients, Vector6};
use nalgebra::DMatrix;
use vi_core::force::{DiscreteForce, Force, LengthBends, NoTimeSlope, seen_velocity};
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::potential::{DiscretePotential, Potential};
use vi_core::sparse::{Entries, Product};
use vi_core::{Configuration, Motion};

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

impl LinearSix {
    /// What it reads.
    pub(crate) fn inputs() -> Vec<Input> {
        (0..12).map(Input::Six).collect()
    }

    fn efforts_at(&self, y: &[f64]) -> Vector6 {
        let (x, v) = (Vector6::from_column_slice(&y[..6]), Vector6::from_column_slice(&y[6..]));
        self.preload - self.stiffness * x - self.damping * v
    }
}

/// Of the six coordinates and their rates.
impl Law for LinearSix {
    fn efforts(&self) -> usize {
        6
    }
    fn evaluate(&self, y: &[f64], _z: &[f64], values: &mut [f64]) {
        values.copy_from_slice(self.efforts_at(y).as_slice());
    }
    fn gradient(&self, y: &[f64], z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>) {
        self.evaluate(y, z, values);
        slopes.columns_mut(0, 6).copy_from(&-self.stiffness);
        slopes.columns_mut(6, 6).copy_from(&-self.damping);
    }
    fn is_dissipative(&self) -> bool {
        self.damping != -self.damping.transpose() // else gyroscopic
    }
}

/// A law along six coordinates between two frames, N and N·m, conjugate to displacements and to the
/// rotation vector, as a discrete force pair: positive efforts act on the second frame along them.
#[derive(Clone, Debug)]
pub struct SixForce {
    /// The coordinates.
    pub coordinates: SixCoordinates,
    /// What the six efforts follow from.
    pub reading: ReadingLaw,
}

impl SixForce {
    /// A law with six efforts; of the coordinates and their rates it reads [`Input::Six`].
    #[must_use]
    pub fn new(coordinates: SixCoordinates, reading: ReadingLaw) -> Self {
        let reading = reading.of_bushing(coordinates.clone());
        Self { coordinates, reading }
    }

    /// `τ` of a step.
    fn in_step(&self, s: &Interval) -> Vector6 {
        self.reading.with_values_in_step(s, |work| Vector6::from_column_slice(work.efforts()))
    }

    /// `τ` at a node.
    #[must_use]
    pub fn efforts(&self, at: Motion<'_>) -> Vector6 {
        self.reading.with_values_at_node(at, |work| Vector6::from_column_slice(work.efforts()))
    }

    /// `q ← q + Σ w_i ∂τ_i/∂q`, `of_v ← of_v + Σ w_i ∂τ_i/∂v`, both of shape `n`, and
    /// `of_z ← of_z + Σ w_i ∂τ_i/∂z` at a node.
    pub fn add_slopes(&self, at: Motion<'_>, w: &Vector6, [q, of_v, of_z]: [&mut [f64]; 3]) {
        self.reading.for_each_internal_at_node(at, &mut |variable, slopes| {
            of_z[variable] += w.iter().zip(slopes).map(|(w, slope)| w * slope).sum::<f64>();
        });
        self.reading.with_slopes_at_node(at, |work| {
            let [by_coordinates, by_rates] = self.own_slopes(work).map(|own| own.tr_mul(w));
            self.coordinates.add_gradient(at.q, &by_coordinates, q);
            self.coordinates.add_gradient(at.q, &by_rates, of_v);
            let turning = self.coordinates.rate_slopes(at.q, at.v);
            for (offset, row) in self.coordinates.along(&turning, &by_rates) {
                let Some(offset) = offset else { continue };
                (0..row.len()).for_each(|i| q[offset + i] += row[i]);
            }
            self.reading.add_slopes(
                at.q,
                at.v,
                |j| (0..6).map(|i| w[i] * work.slope(i, j)).sum(),
                [q, of_v],
            );
        });
    }

    /// `∂τ/∂ξ` and `∂τ/∂ξ̇`.
    fn own_slopes(&self, work: &EvaluationScratch) -> [Matrix6; 2] {
        let mut slopes = [Matrix6::zeros(); 2];
        for (j, input) in self.reading.inputs.iter().enumerate() {
            if let Input::Six(part) = input {
                let own = &mut slopes[part / 6];
                (0..6).for_each(|i| own[(i, part % 6)] += work.slope(i, j));
            }
        }
        slopes
    }

    /// Emits `scale Σ_k (∂τ/∂y_k·∇ξ) (∂y_k)ᵀ` of what is read of other members, where `each` visits
    /// `∂y` of an input.
    fn emit_far(
        &self,
        gradients: &SixGradients,
        scale: f64,
        work: &EvaluationScratch,
        each: impl Fn(&Input, &mut dyn FnMut(usize, f64)),
        out: &mut dyn Entries,
    ) {
        for (j, input) in self.reading.inputs.iter().enumerate() {
            if matches!(input, Input::Six(_) | Input::Time | Input::Held(_) | Input::Past(_)) {
                continue;
            }
            let slope = Vector6::from_fn(|i, _| scale * work.slope(i, j));
            let rows = self.coordinates.along(gradients, &slope);
            each(input, &mut |column, right| {
                for (offset, row) in &rows {
                    let Some(offset) = offset else { continue };
                    (0..row.len()).for_each(|i| out.add(offset + i, column, row[i] * right));
                }
            });
        }
    }

    /// Emits `scale Σ_i slope_i ∇ξ_i` as a column.
    fn emit_along(
        &self,
        gradients: &SixGradients,
        scale: f64,
        slopes: &[f64],
        column: usize,
        out: &mut dyn Entries,
    ) {
        let slope = scale * Vector6::from_column_slice(slopes);
        for (offset, row) in self.coordinates.along(gradients, &slope) {
            let Some(offset) = offset else { continue };
            (0..row.len()).for_each(|k| out.add(offset + k, column, row[k]));
        }
    }

    fn is_seen_from_ground(&self) -> bool {
        let inputs = &self.reading.inputs;
        self.coordinates.is_on_ground() || inputs.iter().any(Input::is_seen_from_ground)
    }

    fn emit_position_slopes(
        &self,
        at: Motion<'_>,
        scale: f64,
        rates: bool,
        far: &[f64],
        out: &mut dyn Entries,
    ) {
        self.reading.with_slopes_at_node(at, |work| {
            let [by_coordinates, by_rates] = self.own_slopes(work);
            let efforts = Vector6::from_column_slice(work.efforts());
            let gradients = self.coordinates.gradients(at.q);
            let stiffness = scale * by_coordinates;
            self.coordinates.emit_product(&gradients, &stiffness, &gradients, out);
            self.coordinates.emit_second(at.q, &(scale * efforts), out);
            if rates {
                let turning = self.coordinates.rate_slopes(at.q, at.v);
                self.coordinates.emit_product(&gradients, &(scale * by_rates), &turning, out);
            }
            let each = |input: &Input, visit: &mut dyn FnMut(usize, f64)| {
                input.for_each_slope_by_position(at.q, far, visit);
            };
            self.emit_far(&gradients, scale, work, each, out);
        });
    }
}

/// What a law of six coordinates reads: these at once, and others.
struct SixReads<'a> {
    coordinates: &'a SixCoordinates,
    inputs: &'a [Input],
}

impl Reads for SixReads<'_> {
    fn count(&self) -> usize {
        self.inputs.len()
    }
    fn slope(&self, at: Between<'_>, l: usize, group: usize) -> Vec<(usize, f64)> {
        let mut slope = Vec::new();
        let Input::Six(part) = self.inputs[l] else {
            self.inputs[l].for_each_slope_between(at, group, &mut |i, own| slope.push((i, own)));
            return slope;
        };
        let (is_rate, unit) = (part >= 6, Vector6::ith(part % 6, 1.0));
        let [mid, rates] = at.middle();
        let (gradients, factor) = match at {
            Between::Ends(s) => {
                let node = s.node(Slot::BOTH[group]);
                (self.coordinates.gradients(node), at.parts(group)[usize::from(is_rate)])
            }
            Between::Node { .. } if is_rate && group == 0 => {
                (self.coordinates.rate_slopes(mid, rates), 1.0)
            }
            Between::Node { .. } => {
                let moves = usize::from(is_rate) == group;
                (self.coordinates.gradients(mid), f64::from(u8::from(moves)))
            }
        };
        for (offset, row) in self.coordinates.along(&gradients, &(factor * unit)) {
            let Some(offset) = offset else { continue };
            slope.extend(row.iter().enumerate().map(|(i, own)| (offset + i, *own)));
        }
        slope
    }
    fn is_rate(&self, l: usize) -> bool {
        self.inputs[l].is_rate()
    }
    fn emit_second(&self, at: Between<'_>, w: &[f64], groups: [usize; 2], out: &mut dyn Entries) {
        self.inputs.emit_second(at, w, groups, out);
        let mut own = [Vector6::zeros(); 2]; // of coordinates, of rates
        for (input, w) in self.inputs.iter().zip(w) {
            if let Input::Six(part) = input {
                own[part / 6][part % 6] += w;
            }
        }
        let ([q, v], [qq, qv, vq, _]) = (at.middle(), at.factors(groups));
        match at {
            Between::Ends(s) if groups[0] == groups[1] => {
                let [mean, rate] = at.parts(groups[0]);
                let node = s.node(Slot::BOTH[groups[0]]);
                self.coordinates.emit_second(node, &(mean * own[0] + rate * own[1]), out);
            }
            Between::Ends(_) => {}
            Between::Node { .. } => {
                self.coordinates.emit_second(q, &(qq * own[0] + (qv + vq) * own[1]), out);
                if qq != 0.0 && own[1] != Vector6::zeros() {
                    self.coordinates.emit_third(q, v, &(qq * own[1]), out);
                }
            }
        }
    }
}

/// Efforts along six coordinates.
impl Pushes for SixCoordinates {
    fn along(&self, at: Between<'_>, y: [&[f64]; 2], k: usize) -> f64 {
        match at {
            Between::Ends(s) => self.rate(&s.q0, y[0])[k] + self.rate(&s.q1, y[1])[k],
            Between::Node { q, .. } => self.rate(q, y[0])[k],
        }
    }
    fn slope(&self, at: Between<'_>, y: [&[f64]; 2], k: usize, group: usize) -> Vec<f64> {
        let mut slope = vec![0.0; y[0].len()];
        let Some(node) = at.positions([group; 2]) else { return slope };
        let turning = self.rate_slopes(node, y[group]);
        for (offset, row) in self.along(&turning, &Vector6::ith(k, 1.0)) {
            let Some(offset) = offset else { continue };
            row.iter().enumerate().for_each(|(i, own)| slope[offset + i] += own);
        }
        slope
    }
    fn emit_second(
        &self,
        at: Between<'_>,
        y: [&[f64]; 2],
        (efforts, scale): (&[f64], f64),
        groups: [usize; 2],
        out: &mut dyn Entries,
    ) {
        if let Some(q) = at.positions(groups) {
            let w = scale * Vector6::from_column_slice(efforts);
            self.emit_third(q, y[groups[0]], &w, out);
        }
    }
}

impl SixForce {
    fn reads(&self) -> SixReads<'_> {
        SixReads { coordinates: &self.coordinates, inputs: &self.reading.inputs }
    }

    /// `q ← q + scale ∂²τ_k/∂q∂(q, v)` times `changes` of both, `of_v` likewise, at a node; without
    /// states.
    pub fn add_effort_bends(
        &self,
        at: Motion<'_>,
        effort: usize,
        scale: f64,
        changes: [&[f64]; 2],
        out: [&mut [f64]; 2],
    ) {
        self.reading.with_slopes_at_node(at, |work| {
            let (place, reads) = ([at.q, at.v], self.reads());
            self.reading
                .with_bends(work, |law| law.add(&reads, place, effort, scale, changes, out));
        });
    }
}

impl LengthBends for SixForce {
    fn add_slope_by_length(&self, s: &Interval, y: [&[f64]; 2], by: Slot, out: &mut [f64]) {
        self.reading.with_slopes_in_step(s, |work| {
            let own = (&self.reads(), &self.coordinates as _);
            self.reading.with_bends(work, |law| law.add_slope_by_length(own, (s, y), by, out));
        });
    }

    fn second_by_length(&self, s: &Interval, y: [&[f64]; 2]) -> f64 {
        let mut second = 0.0;
        self.reading.with_slopes_in_step(s, |work| {
            let own = (&self.reads(), &self.coordinates as _);
            self.reading.with_bends(work, |law| second = law.second_by_length(own, (s, y)));
        });
        second
    }
}

impl DiscreteForce for SixForce {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        let efforts = self.in_step(s);
        self.coordinates.add_gradient(&s.q0, &(0.5 * s.h * efforts), out);
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        let efforts = self.in_step(s);
        self.coordinates.add_gradient(&s.q1, &(0.5 * s.h * efforts), out);
    }

    fn add_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        self.reading.with_slopes_in_step(s, |work| {
            let [by_coordinates, by_rates] = self.own_slopes(work);
            // (h/2) (½ τ_ξ ± τ_ξ̇/h)
            let slope = 0.25 * s.h * by_coordinates + 0.5 * by.sign() * by_rates;
            let [own, moved] = [of, by].map(|slot| self.coordinates.gradients(s.node(slot)));
            self.coordinates.emit_product(&own, &slope, &moved, out);
            let each = |input: &Input, visit: &mut dyn FnMut(usize, f64)| {
                input.for_each_slope(s, by, visit);
            };
            self.emit_far(&own, 0.5 * s.h, work, each, out);
            if of == by {
                let efforts = Vector6::from_column_slice(work.efforts());
                self.coordinates.emit_second(s.node(of), &(0.5 * s.h * efforts), out);
            }
        });
    }

    fn add_bend(&self, s: &Interval, y: [&[f64]; 2], slots: [Slot; 2], out: &mut dyn Entries) {
        self.reading.with_slopes_in_step(s, |work| {
            let own = (&self.reads(), &self.coordinates as _);
            self.reading.with_bends(work, |law| law.emit_in_step(own, s, y, slots, out));
        });
    }

    fn length_bends(&self) -> Option<&dyn LengthBends> {
        (!self.reading.remembers()).then_some(self as _)
    }

    fn add_gauss_bend(&self, at: Motion<'_>, z: &[f64], by: [f64; 4], out: &mut dyn Entries) {
        self.reading.with_slopes_at_node(at, |work| {
            let own = (&self.reads(), &self.coordinates as _);
            self.reading.with_bends(work, |law| law.emit_at_node(own, [at.q, at.v, z], by, out));
        });
    }

    fn add_internal_slope(&self, s: &Interval, of: Slot, out: &mut dyn Entries) {
        let gradients = self.coordinates.gradients(s.node(of));
        self.reading.for_each_internal(s, &mut |variable, slopes| {
            self.emit_along(&gradients, 0.5 * s.h, slopes, variable, out);
        });
    }

    fn add_step_slope(
        &self,
        s: &Interval,
        of: Slot,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        self.reading.with_step_slopes(s, change, |efforts| {
            let efforts = Vector6::from_column_slice(efforts);
            self.coordinates.add_gradient(s.node(of), &efforts, out);
        })
    }

    fn add_time_slope(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        self.reading.with_time_slopes(at, scale, |efforts| {
            let efforts = Vector6::from_column_slice(efforts);
            self.coordinates.add_gradient(at.q, &efforts, out);
        })
    }

    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        self.coordinates.add_gradient(at.q, &self.efforts(at), out);
    }

    fn add_stiffness(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        let far = seen_velocity(self.is_seen_from_ground(), at.v);
        self.emit_position_slopes(at, scale, self.coordinates.is_on_ground(), &far, out);
    }

    fn acts_from_ground(&self) -> bool {
        self.is_seen_from_ground()
    }

    fn add_position_slope(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.emit_position_slopes(at, scale, true, at.v, out);
    }

    fn add_damping(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.reading.with_slopes_at_node(at, |work| {
            let [_, by_rates] = self.own_slopes(work);
            let gradients = self.coordinates.gradients(at.q);
            self.coordinates.emit_product(&gradients, &(scale * by_rates), &gradients, out);
            let each = |input: &Input, visit: &mut dyn FnMut(usize, f64)| {
                input.for_each_slope_by_velocity(at.q, at.v, visit);
            };
            self.emit_far(&gradients, scale, work, each, out);
        });
    }

    fn add_state_slopes(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        let gradients = self.coordinates.gradients(at.q);
        self.reading.for_each_internal_at_node(at, &mut |variable, slopes| {
            self.emit_along(&gradients, scale, slopes, variable, out);
        });
    }

    fn is_dissipative(&self) -> bool {
        self.reading.law.is_dissipative()
    }
}

/// The continuous force; at averaged directors, as energy–momentum schemes take it, of order 2.
impl Force for SixForce {
    fn add(&self, Motion { t, q, v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        let efforts = self.efforts(Motion::new(t, q, v));
        self.coordinates.add_gradient(q, &(scale * efforts), out);
    }

    fn add_position_derivative(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.emit_position_slopes(Motion::new(t, q, v), scale, true, v, out);
    }

    fn add_velocity_derivative(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.add_damping(Motion::new(t, q, v), scale, out);
    }

    fn acts_from_ground(&self) -> bool {
        self.is_seen_from_ground()
    }

    fn is_dissipative(&self) -> bool {
        self.reading.law.is_dissipative()
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
    /// How its efforts follow from the coordinates, as a law of these.
    fn with_bends(&self, slope: &Vector6, then: impl FnOnce(&SixReads<'_>, &LawEvaluation<'_>)) {
        let inputs: Vec<Input> = (0..6).map(Input::Six).collect();
        let reads = SixReads { coordinates: &self.coordinates, inputs: &inputs };
        let slopes = DMatrix::from_column_slice(6, 6, self.stiffness.as_slice());
        let bend = |_: &[f64], _: &[f64], out: &mut [f64]| out.fill(0.0);
        let (values, efforts) = (&[], slope.as_slice()); // there is no rate
        then(&reads, &LawEvaluation { values, efforts, slopes: &slopes, bend: &bend });
    }

    /// `q ← q + scale ∂²τ_k/∂q²` times a change of `q`, at a node.
    pub fn add_effort_bends(&self, q: &[f64], k: usize, scale: f64, dq: &[f64], out: &mut [f64]) {
        let w = -scale * self.stiffness.row(k).transpose();
        self.coordinates.emit_second(q, &w, &mut Product { v: dq, out });
    }

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

    /// `out ← out + Σ w_i ∂τ_i/∂q` at a node, shape `n`.
    pub fn add_slopes(&self, q: &[f64], w: &Vector6, out: &mut [f64]) {
        self.coordinates.add_gradient(q, &-self.stiffness.tr_mul(w), out);
    }

    /// Emits `scale D_1 D_1 U_d` or `scale D_2 D_2 U_d`, `q` the end concerned.
    fn emit_second(&self, s: &Interval, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let gradients = self.coordinates.gradients(q);
        let stiffness = 0.25 * scale * self.stiffness;
        self.coordinates.emit_product(&gradients, &stiffness, &gradients, out);
        let slope = self.slope(&self.coordinates.change(s).mean);
        self.coordinates.emit_second(q, &(0.5 * scale * slope), out);
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
        self.emit_second(s, &s.q0, scale, out);
    }
    fn add_d2_d2(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.emit_second(s, &s.q1, scale, out);
    }
    fn add_bend(
        &self,
        s: &Interval,
        y: [&[f64]; 2],
        slots: [Slot; 2],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let slope = self.slope(&self.coordinates.change(s).mean);
        self.with_bends(&slope, |reads, law| {
            let groups = slots.map(|slot| usize::from(slot == Slot::Second));
            let at = (Between::Ends(s), y);
            law.emit((reads, &self.coordinates), at, (groups, 0.5 * scale), out); // ½ U_ξ ∇ξ
        });
    }
    fn add_third(&self, at: Configuration<'_>, z: &[f64], scale: f64, out: &mut dyn Entries) {
        let slope = self.slope(&self.coordinates.at(at.t, at.q));
        self.with_bends(&slope, |reads, law| {
            let by = [scale, 0.0, 0.0, 0.0];
            law.emit_at_node((reads, &self.coordinates), [at.q, &[], z], by, out);
        });
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
