//! Forces by laws of anything that moves: coordinates of other joints, other members, signals.
//!
//! ```text
//! f_d^∓ = (h/2) Σ_k τ_k e_k(q_n | q_{n+1}),     τ = τ(y, z̄),   y of [`Input`], e_k of [`Target`]
//! D f_d^∓ = (h/2) Σ_k [ e_k (dτ_k/dy ∂y/∂q)ᵀ + τ_k ∂e_k/∂q ],     q = q_n or q_{n+1}
//! ```
//! States of signals follow the implicit midpoint rule within the step and are eliminated there:
//! ```text
//! z̄ = z_n + (h/2) φ(y, z̄),   z_{n+1} = 2 z̄ − z_n
//! (I − (h/2) φ_z) δz̄ = (h/2) φ_y δy,   dτ/dy = τ_y + τ_z δz̄/δy
//! ```
//!
//! Source: Marsden & West 2001, part 3; Hairer, Lubich & Wanner 2006, II.1, for the midpoint rule.

mod along;
mod collocation;
pub(super) mod evaluation;
pub mod input;
mod place;
mod relative;
pub mod sampling;
pub mod signals;
mod target;
mod turning;
pub mod velocity;

pub use evaluation::{Law, ReadingLaw};
pub use input::{Input, Past};
pub use relative::RelativeWrench;
pub use sampling::{ByParameters, Change, SampledChange, Seed};
pub use signals::{Sampler, SignalStates};
pub use target::Target;
pub use velocity::LawOfRates;

use evaluation::EvaluationScratch;
use place::EffortAxes;
use vi_core::Motion;
use vi_core::force::{DiscreteForce, Force, LengthBends, NoTimeSlope, seen_velocity};
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::quantity_effort::QuantityEffort;
use vi_core::sparse::Entries;

/// A law with what it reads and what it acts on.
#[derive(Clone, Debug)]
pub struct LawForce {
    /// What it acts on.
    pub target: Target,
    /// What it reads, and how its efforts follow.
    pub reading: ReadingLaw,
}

impl LawForce {
    /// The efforts at a node as the law states them, N and N·m, and their number.
    #[must_use]
    pub fn efforts(&self, at: Motion<'_>) -> ([f64; 6], usize) {
        let mut efforts = [0.0; 6];
        self.reading.with_values_at_node(at, |work| {
            efforts.iter_mut().zip(work.efforts()).for_each(|(own, effort)| *own = *effort);
        });
        (efforts, self.target.count())
    }

    /// `q ← q + scale ∂τ_k/∂q`, `of_v ← of_v + scale ∂τ_k/∂v`, both of shape `n`, and
    /// `of_z ← of_z + scale ∂τ_k/∂z` at a node.
    pub fn add_effort_slopes(
        &self,
        at: Motion<'_>,
        k: usize,
        scale: f64,
        [q, of_v, of_z]: [&mut [f64]; 3],
    ) {
        self.reading.with_slopes_at_node(at, |work| {
            self.reading.add_slopes(at.q, at.v, |j| scale * work.slope(k, j), [q, of_v]);
        });
        self.reading.for_each_internal_at_node(at, &mut |variable, slopes| {
            of_z[variable] += scale * slopes[k];
        });
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
            let (place, inputs) = ([at.q, at.v], &self.reading.inputs[..]);
            self.reading
                .with_bends(work, |law| law.add(inputs, place, effort, scale, changes, out));
        });
    }

    /// Emits `scale Σ_k e_k (dτ_k/dy ∂y)ᵀ`, where `each` visits `∂y` of an input.
    fn emit_slopes(
        &self,
        at: EffortAxes<'_>,
        scale: f64,
        work: &EvaluationScratch,
        each: impl Fn(&Input, &mut dyn FnMut(usize, f64)),
        out: &mut dyn Entries,
    ) {
        for k in 0..self.target.count() {
            for (j, input) in self.reading.inputs.iter().enumerate() {
                let slope = scale * work.slope(k, j);
                self.target.for_each_direction(at, k, &mut |row, left| {
                    each(input, &mut |column, right| out.add(row, column, slope * left * right));
                });
            }
        }
    }

    /// Emits `scale ∂f/∂q` at a node.
    fn emit_position_slopes(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.reading.with_slopes_at_node(at, |work| {
            let place = EffortAxes::node(at.q);
            let each = |input: &Input, visit: &mut dyn FnMut(usize, f64)| {
                input.for_each_slope_by_position(at.q, at.v, visit);
            };
            self.emit_slopes(place, scale, work, each, out);
            self.target.emit_turning(place, (1.0, true), scale, work.efforts(), out);
        });
    }

    fn is_seen_from_ground(&self) -> bool {
        let inputs = &self.reading.inputs;
        self.target.is_seen_from_ground() || inputs.iter().any(Input::is_seen_from_ground)
    }
}

impl LengthBends for LawForce {
    fn add_slope_by_length(&self, s: &Interval, y: [&[f64]; 2], by: Slot, out: &mut [f64]) {
        self.reading.with_slopes_in_step(s, |work| {
            let own = (&self.reading.inputs[..], &self.target as _);
            self.reading.with_bends(work, |law| law.add_slope_by_length(own, (s, y), by, out));
        });
    }

    fn second_by_length(&self, s: &Interval, y: [&[f64]; 2]) -> f64 {
        let mut second = 0.0;
        self.reading.with_slopes_in_step(s, |work| {
            let own = (&self.reading.inputs[..], &self.target as _);
            self.reading.with_bends(work, |law| second = law.second_by_length(own, (s, y)));
        });
        second
    }
}

impl DiscreteForce for LawForce {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        self.reading.with_values_in_step(s, |work| {
            self.target.add(EffortAxes::end_of(s, Slot::First), 0.5 * s.h, work.efforts(), out);
        });
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        self.reading.with_values_in_step(s, |work| {
            self.target.add(EffortAxes::end_of(s, Slot::Second), 0.5 * s.h, work.efforts(), out);
        });
    }

    fn add_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        self.reading.with_slopes_in_step(s, |work| {
            let (at, scale) = (EffortAxes::end_of(s, of), 0.5 * s.h);
            let each = |input: &Input, visit: &mut dyn FnMut(usize, f64)| {
                input.for_each_slope(s, by, visit);
            };
            self.emit_slopes(at, scale, work, each, out);
            self.target.emit_turning(at, (0.5, of == by), scale, work.efforts(), out);
        });
    }

    fn add_bend(&self, s: &Interval, y: [&[f64]; 2], slots: [Slot; 2], out: &mut dyn Entries) {
        self.reading.with_slopes_in_step(s, |work| {
            let own = (&self.reading.inputs[..], &self.target as _);
            self.reading.with_bends(work, |law| law.emit_in_step(own, s, y, slots, out));
        });
    }

    fn length_bends(&self) -> Option<&dyn LengthBends> {
        (!self.reading.remembers()).then_some(self as _)
    }

    fn add_gauss_bend(&self, at: Motion<'_>, z: &[f64], by: [f64; 4], out: &mut dyn Entries) {
        self.reading.with_slopes_at_node(at, |work| {
            let own = (&self.reading.inputs[..], &self.target as _);
            self.reading.with_bends(work, |law| law.emit_at_node(own, [at.q, at.v, z], by, out));
        });
    }

    fn add_internal_slope(&self, s: &Interval, of: Slot, out: &mut dyn Entries) {
        let at = EffortAxes::end_of(s, of);
        self.reading.for_each_internal(s, &mut |variable, slopes| {
            for (k, slope) in slopes.iter().enumerate() {
                self.target.for_each_direction(at, k, &mut |row, along| {
                    out.add(row, variable, 0.5 * s.h * along * slope);
                });
            }
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
            self.target.add(EffortAxes::end_of(s, of), 1.0, efforts, out);
        })
    }

    fn add_time_slope(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        self.reading.with_time_slopes(at, scale, |efforts| {
            self.target.add(EffortAxes::node(at.q), 1.0, efforts, out);
        })
    }

    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        self.reading.with_values_at_node(at, |work| {
            self.target.add(EffortAxes::node(at.q), 1.0, work.efforts(), out);
        });
    }

    fn work(&self, s: &Interval, scratch: &mut [f64]) -> f64 {
        scratch.fill(0.0);
        self.reading.with_values_in_step(s, |work| {
            for end in Slot::BOTH {
                self.target.add(EffortAxes::end_of(s, end), 0.5 * s.h, work.efforts(), scratch);
            }
        });
        scratch.iter().zip(&s.v_mid).map(|(f, v)| f * v).sum()
    }

    fn add_stiffness(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        let v = seen_velocity(self.is_seen_from_ground(), at.v);
        self.emit_position_slopes(Motion { v: &v, ..at }, scale, out);
    }

    fn acts_from_ground(&self) -> bool {
        self.is_seen_from_ground()
    }

    fn add_position_slope(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.emit_position_slopes(at, scale, out);
    }

    fn add_damping(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.reading.with_slopes_at_node(at, |work| {
            let each = |input: &Input, visit: &mut dyn FnMut(usize, f64)| {
                input.for_each_slope_by_velocity(at.q, at.v, visit);
            };
            self.emit_slopes(EffortAxes::node(at.q), scale, work, each, out);
        });
    }

    fn add_state_slopes(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.reading.for_each_internal_at_node(at, &mut |variable, slopes| {
            for (k, slope) in slopes.iter().enumerate() {
                self.target.for_each_direction(EffortAxes::node(at.q), k, &mut |row, along| {
                    out.add(row, variable, scale * along * slope);
                });
            }
        });
    }

    fn is_dissipative(&self) -> bool {
        self.reading.law.is_dissipative()
    }

    fn of_quantities(&self) -> Option<&dyn QuantityEffort> {
        self.along().is_some().then_some(self as _)
    }
}

/// At averaged directors, as energy–momentum schemes take it, of order 2.
impl Force for LawForce {
    fn add(&self, Motion { t, q, v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        self.reading.with_values_at_node(Motion::new(t, q, v), |work| {
            self.target.add(EffortAxes::node(q), scale, work.efforts(), out);
        });
    }

    fn add_position_derivative(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.emit_position_slopes(Motion::new(t, q, v), scale, out);
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

#[cfg(test)]
mod tests;
