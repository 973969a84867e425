//! A law evaluated in a step and at a node, its states eliminated.

use super::input::Input;
use crate::force::bends::LawEvaluation;
use crate::geometry::six_coordinates::{SixChange, SixCoordinates};
use nalgebra::{DMatrix, DMatrixView};
use std::sync::{Arc, Mutex, PoisonError};
use vi_core::Motion;
use vi_core::force::NoTimeSlope;
use vi_core::interval::{Interval, StepChange};
use vi_core::linear::DenseLu;

/// Newton iterations for the states of a step at most; more mean that kinks alternate.
pub(super) const ITERATIONS: usize = 40;
/// A correction below this part of a state is round-off.
pub(super) const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

/// How the states of a step follow from its start and its inputs.
pub(super) struct StateSlopes {
    /// `∂z̄/∂z_n`.
    pub(super) by_start: DMatrix<f64>,
    /// `∂z̄/∂y`.
    pub(super) by_input: DMatrix<f64>,
    /// `dτ/dz_n`.
    efforts: DMatrix<f64>,
}

/// Efforts and rates of states by inputs and states.
pub trait Law: Send + Sync {
    /// How many efforts.
    fn efforts(&self) -> usize;
    /// `values ← (τ, φ)` at `(y, z)`; not a number where it has no value.
    fn evaluate(&self, y: &[f64], z: &[f64], values: &mut [f64]);
    /// The same with `slopes ← ∂(τ, φ)/∂(y, z)`: rows of efforts, then of states; columns of
    /// inputs, then of states.
    fn gradient(&self, y: &[f64], z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>);
    /// `slopes ← Σ_k w_k` times how `∂τ_k/∂y` changes where `y` changes by `along`, of a law
    /// without states; zero, unless said otherwise: second derivatives of laws steer a search for
    /// an optimum and move none.
    fn bend(&self, _y: &[f64], _along: &[f64], _w: &[f64], slopes: &mut [f64]) {
        slopes.fill(0.0);
    }
    /// Whether it dissipates energy.
    fn is_dissipative(&self) -> bool;
    /// Whether efforts and rates are affine functions of states and of all inputs but time.
    fn is_affine(&self) -> bool {
        false
    }
}

/// A law with what it reads.
pub struct ReadingLaw {
    /// The law.
    pub law: Arc<dyn Law>,
    /// `y`.
    pub inputs: Vec<Input>,
    /// Where `z` stands among the internal variables of signals.
    pub states: Vec<usize>,
    /// Where these start among all of a system.
    pub first: usize,
    /// What they are at the start, and where they are not listed.
    pub start: Arc<[f64]>,
    six: Option<SixCoordinates>, // of which inputs are parts
    work: Mutex<EvaluationScratch>,
}

impl Clone for ReadingLaw {
    fn clone(&self) -> Self {
        let (law, inputs) = (self.law.clone(), self.inputs.clone());
        let (first, start, six) = (self.first, self.start.clone(), self.six.clone());
        Self { first, start, six, ..Self::new(law, inputs, self.states.clone()) }
    }
}

impl std::fmt::Debug for ReadingLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { inputs, states, .. } = self;
        let mut shown = f.debug_struct("Reading");
        shown.field("inputs", inputs).field("states", states).finish_non_exhaustive()
    }
}

/// Numbers of an evaluation.
#[derive(Debug)]
pub(in crate::force) struct EvaluationScratch {
    efforts: usize,
    y: Vec<f64>,
    start: Vec<f64>, // z_n
    z: Vec<f64>,     // z̄, or z at a node
    values: Vec<f64>,
    slopes: DMatrix<f64>,
    last: DMatrix<f64>,   // φ_z of the iteration before
    matrix: DMatrix<f64>, // I − (h/2) φ_z
    lu: DenseLu,
    change: Vec<f64>,
}

impl EvaluationScratch {
    /// `τ`.
    pub(in crate::force) fn efforts(&self) -> &[f64] {
        &self.values[..self.efforts]
    }

    /// `z̄`.
    pub(super) fn middle(&self) -> &[f64] {
        &self.z
    }

    /// `dτ_k/dy_j`.
    pub(in crate::force) fn slope(&self, k: usize, j: usize) -> f64 {
        self.slopes[(k, j)]
    }

    /// `φ`, and `∂φ/∂(y, z)`: rows of states, columns of inputs, then of states.
    pub(super) fn rates(&self) -> (&[f64], DMatrixView<'_, f64>) {
        let first = self.efforts;
        (&self.values[first..], self.slopes.rows(first, self.z.len()))
    }

    /// `z̄` of a step `h`, with the slopes there; not a number where none is found.
    fn find_states(&mut self, law: &dyn Law, h: f64) {
        self.z.copy_from_slice(&self.start);
        self.find(law, Some(h));
    }

    /// `z` where it rests, `φ(y, z) = 0`, with the slopes there; not a number where there is no
    /// such place, as of an integral.
    fn find_rest(&mut self, law: &dyn Law) {
        self.find(law, None);
    }

    /// Newton's method for `z − z_n − (h/2) φ(y, z) = 0` of a step `h`, or for `φ(y, z) = 0`.
    fn find(&mut self, law: &dyn Law, h: Option<f64>) {
        let (first, inputs) = (self.efforts, self.y.len());
        self.last.fill(f64::NAN);
        for iteration in 0..ITERATIONS {
            law.gradient(&self.y, &self.z, &mut self.values, &mut self.slopes);
            let mut same = true;
            for i in 0..self.z.len() {
                let rate = self.values[first + i];
                self.change[i] = h.map_or(rate, |h| self.z[i] - self.start[i] - 0.5 * h * rate);
                for j in 0..self.z.len() {
                    let slope = self.slopes[(first + i, inputs + j)];
                    same &= self.last[(i, j)].to_bits() == slope.to_bits();
                    self.last[(i, j)] = slope;
                    let own = f64::from(u8::from(i == j));
                    self.matrix[(i, j)] = h.map_or(slope, |h| own - 0.5 * h * slope);
                }
            }
            self.lu.factorize(&self.matrix);
            if self.lu.solve_factorized(&mut self.change).is_err() {
                break;
            }
            let small = |h: f64, i: usize| {
                let size = self.start[i].abs()
                    + self.z[i].abs()
                    + (0.5 * h * self.values[first + i]).abs();
                self.change[i].abs() <= ROUND_OFF * size
            };
            let settled = same || h.is_some_and(|h| (0..self.z.len()).all(|i| small(h, i)));
            if iteration > 0 && settled {
                return;
            }
            self.z.iter_mut().zip(&self.change).for_each(|(z, change)| *z -= change);
        }
        self.z.fill(f64::NAN);
        self.values.fill(f64::NAN);
        self.slopes.fill(f64::NAN);
    }

    /// Of a step `h`, found before; `self.lu` has `I − (h/2) φ_z`. Allocates.
    fn state_slopes(&mut self, h: f64) -> StateSlopes {
        let (first, inputs, n) = (self.efforts, self.y.len(), self.z.len());
        let mut by_start = DMatrix::identity(n, n);
        let mut by_input = 0.5 * h * self.slopes.view((first, 0), (n, inputs));
        for mut column in by_start.column_iter_mut().chain(by_input.column_iter_mut()) {
            if self.lu.solve_factorized(column.as_mut_slice()).is_err() {
                column.fill(f64::NAN);
            }
        }
        let efforts = self.slopes.view((0, inputs), (first, n)) * &by_start;
        StateSlopes { by_start, by_input, efforts }
    }

    /// Takes `δz/δy = −φ_z⁻¹ φ_y` into the slopes of the efforts; `self.lu` has `φ_z`.
    fn eliminate_rest(&mut self) {
        self.eliminate_states(-2.0);
    }

    /// Takes `δz̄/δy` into the slopes of the efforts; `self.lu` has `I − (h/2) φ_z`.
    fn eliminate_states(&mut self, h: f64) {
        let (first, inputs) = (self.efforts, self.y.len());
        for j in 0..inputs {
            for i in 0..self.z.len() {
                self.change[i] = 0.5 * h * self.slopes[(first + i, j)];
            }
            if self.lu.solve_factorized(&mut self.change).is_err() {
                self.change.fill(f64::NAN);
            }
            for k in 0..first {
                for i in 0..self.z.len() {
                    let by_state = self.slopes[(k, inputs + i)];
                    self.slopes[(k, j)] += by_state * self.change[i];
                }
            }
        }
    }
}

impl ReadingLaw {
    /// A law of these inputs and states, all of them among the internal variables of signals.
    #[must_use]
    pub fn new(law: Arc<dyn Law>, inputs: Vec<Input>, states: Vec<usize>) -> Self {
        let (efforts, n, m) = (law.efforts(), states.len(), inputs.len());
        let work = EvaluationScratch {
            efforts,
            y: vec![0.0; m],
            start: vec![0.0; n],
            z: vec![0.0; n],
            values: vec![0.0; efforts + n],
            slopes: DMatrix::zeros(efforts + n, m + n),
            last: DMatrix::from_element(n, n, f64::NAN),
            matrix: DMatrix::zeros(n, n),
            lu: DenseLu::new(n),
            change: vec![0.0; n],
        };
        let work = Mutex::new(work);
        Self { law, inputs, states, first: 0, start: Arc::default(), six: None, work }
    }

    /// The same for a law of a bushing of these coordinates: [`Input::Six`].
    #[must_use]
    pub fn of_bushing(self, coordinates: SixCoordinates) -> Self {
        Self { six: Some(coordinates), ..self }
    }

    pub(super) fn own<'a>(&'a self, internal: &'a [f64]) -> &'a [f64] {
        let listed = internal.get(self.first..self.first + self.start.len());
        listed.unwrap_or(&self.start)
    }

    /// Whether states are not listed: they are then where they rest, as in an equilibrium.
    fn rests(&self, internal: &[f64]) -> bool {
        !self.states.is_empty() && internal.len() < self.first + self.start.len()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, EvaluationScratch> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take_states(&self, held: &[f64], to: &mut [f64]) {
        for (to, place) in to.iter_mut().zip(&self.states) {
            *to = held.get(*place).copied().unwrap_or(0.0);
        }
    }

    fn read_step(&self, s: &Interval, work: &mut EvaluationScratch) {
        let held = self.own(&s.internal);
        let six = self.six.as_ref().map(|six| six.change(s));
        for (y, input) in work.y.iter_mut().zip(&self.inputs) {
            *y = match (input, &six) {
                (Input::Six(part), Some(own)) => own.part(*part),
                _ => input.in_step(s, held),
            };
        }
        self.take_states(held, &mut work.start);
    }

    pub(super) fn read_inputs_at(&self, at: Motion<'_>, held: &[f64], y: &mut [f64]) {
        let six = self
            .six
            .as_ref()
            .map(|six| SixChange { mean: six.at(at.t, at.q), rate: six.rate(at.q, at.v) });
        for (y, input) in y.iter_mut().zip(&self.inputs) {
            *y = match (input, &six) {
                (Input::Six(part), Some(own)) => own.part(*part),
                _ => input.at_node(at, held),
            };
        }
    }

    fn read_node(&self, at: Motion<'_>, work: &mut EvaluationScratch) {
        let held = self.own(at.internal);
        self.read_inputs_at(at, held, &mut work.y);
        self.take_states(held, &mut work.z);
    }

    /// With the inputs at a node where `held` are the internal variables of signals.
    pub fn read_inputs(&self, at: Motion<'_>, held: &[f64], then: impl FnOnce(&[f64])) {
        let work = &mut *self.lock();
        self.read_inputs_at(at, held, &mut work.y);
        then(&work.y);
    }

    /// With the inputs at a node, from which internal variables of signals follow.
    pub(super) fn with_inputs(
        &self,
        at: Motion<'_>,
        held: &mut [f64],
        then: impl FnOnce(&[f64], &mut [f64]),
    ) {
        let work = &mut *self.lock();
        self.read_inputs_at(at, held, &mut work.y);
        then(&work.y, held);
    }

    /// `q ← q + Σ w_j ∂y_j/∂q`, `of_v ← of_v + Σ w_j ∂y_j/∂v` at a node, both of shape `n`; those
    /// of [`Input::Six`] are left out.
    pub(in crate::force) fn add_slopes(
        &self,
        at: &[f64],
        v: &[f64],
        w: impl Fn(usize) -> f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        for (j, input) in self.inputs.iter().enumerate() {
            let w = w(j);
            input.for_each_slope_by_position(at, v, &mut |i, slope| q[i] += w * slope);
            input.for_each_slope_by_velocity(at, v, &mut |i, slope| of_v[i] += w * slope);
        }
    }

    /// With the law and its second derivatives where `work` has its slopes; not where it has
    /// states.
    pub(in crate::force) fn with_bends(
        &self,
        work: &EvaluationScratch,
        then: impl FnOnce(&LawEvaluation<'_>),
    ) {
        if !self.states.is_empty() {
            return;
        }
        let bend = |along: &[f64], w: &[f64], out: &mut [f64]| {
            self.law.bend(&work.y, along, w, out);
        };
        let (values, efforts) = (&work.y[..], work.efforts());
        then(&LawEvaluation { values, efforts, slopes: &work.slopes, bend: &bend });
    }

    /// Whether something of it is no function of a node: states of signals, what is held or past.
    #[must_use]
    pub fn remembers(&self) -> bool {
        let held = |own: &Input| matches!(own, Input::Held(_) | Input::Past(_));
        !self.states.is_empty() || self.inputs.iter().any(held)
    }

    /// With the efforts of a step, and `z̄`.
    pub(in crate::force) fn with_values_in_step<T>(
        &self,
        s: &Interval,
        then: impl FnOnce(&EvaluationScratch) -> T,
    ) -> T {
        let work = &mut *self.lock();
        self.read_step(s, work);
        self.evaluate(s.h, work);
        then(work)
    }

    /// The same at the inputs `y`.
    pub(super) fn with_values_of<T>(
        &self,
        y: &[f64],
        s: &Interval,
        then: impl FnOnce(&EvaluationScratch) -> T,
    ) -> T {
        let work = &mut *self.lock();
        self.take(y, s, work);
        self.evaluate(s.h, work);
        then(work)
    }

    /// With the efforts of a step and their slopes by the inputs.
    pub(in crate::force) fn with_slopes_in_step<T>(
        &self,
        s: &Interval,
        then: impl FnOnce(&EvaluationScratch) -> T,
    ) -> T {
        let work = &mut *self.lock();
        self.read_step(s, work);
        self.differentiate(s.h, work);
        then(work)
    }

    /// With the slopes of the states of a step; allocates.
    pub(super) fn with_state_slopes<T>(
        &self,
        s: &Interval,
        then: impl FnOnce(&StateSlopes) -> T,
    ) -> T {
        let work = &mut *self.lock();
        self.read_step(s, work);
        work.find_states(&*self.law, s.h);
        then(&work.state_slopes(s.h))
    }

    /// Visits what efforts of a step depend on among all internal variables, held values and then
    /// states: the variable and `dτ/dz`. Allocates where there are states.
    pub(in crate::force) fn for_each_internal(
        &self,
        s: &Interval,
        visit: &mut dyn FnMut(usize, &[f64]),
    ) {
        if self.inputs.iter().any(|input| matches!(input, Input::Held(_) | Input::Past(_))) {
            self.with_slopes_in_step(s, |work| {
                let held = self.own(&s.internal);
                for (j, input) in self.inputs.iter().enumerate() {
                    let column = work.slopes.column(j);
                    let column = &column.as_slice()[..work.efforts];
                    input.for_each_held(s.t_mid(), held, &mut |place, slope| {
                        let column: Vec<f64> = column.iter().map(|own| slope * own).collect();
                        visit(self.first + place, &column);
                    });
                }
            });
        }
        if !self.states.is_empty() {
            self.with_state_slopes(s, |slopes| {
                for (i, state) in self.states.iter().enumerate() {
                    visit(self.first + state, slopes.efforts.column(i).as_slice());
                }
            });
        }
    }

    /// Visits what efforts depend on at a node among all internal variables, held values and then
    /// states: the variable and `∂τ/∂z`.
    pub(in crate::force) fn for_each_internal_at_node(
        &self,
        at: Motion<'_>,
        visit: &mut dyn FnMut(usize, &[f64]),
    ) {
        if !self.remembers() {
            return;
        }
        self.with_slopes_at_node(at, |work| {
            let (held, efforts) = (self.own(at.internal), work.efforts);
            let column = |k: usize| work.slopes.column(k).as_slice()[..efforts].to_vec();
            for (j, input) in self.inputs.iter().enumerate() {
                input.for_each_held(at.t, held, &mut |place, slope| {
                    let column: Vec<f64> = column(j).iter().map(|own| slope * own).collect();
                    visit(self.first + place, &column);
                });
            }
            for (i, state) in self.states.iter().enumerate() {
                visit(self.first + state, &column(work.y.len() + i));
            }
        });
    }

    /// Whether what it reads changes with the time in no other way than by the time itself.
    fn knows_time(&self) -> Result<(), NoTimeSlope> {
        let past = self.inputs.iter().any(|input| matches!(input, Input::Past(_)));
        if past || !self.states.is_empty() { Err(NoTimeSlope) } else { Ok(()) }
    }

    /// With `scale ∂τ/∂t` at a node.
    pub(in crate::force) fn with_time_slopes<T>(
        &self,
        at: Motion<'_>,
        scale: f64,
        then: impl FnOnce(&[f64]) -> T,
    ) -> Result<T, NoTimeSlope> {
        self.knows_time()?;
        let time = self.inputs.iter().position(|input| matches!(input, Input::Time));
        Ok(self.with_slopes_at_node(at, |work| {
            let slope = |k: usize| time.map_or(0.0, |j| scale * work.slope(k, j));
            let slopes: Vec<f64> = (0..work.efforts().len()).map(slope).collect();
            then(&slopes)
        }))
    }

    /// With the change of `(h/2) τ` where the step changes; its states would change, too.
    pub(in crate::force) fn with_step_slopes<T>(
        &self,
        s: &Interval,
        change: StepChange,
        then: impl FnOnce(&[f64]) -> T,
    ) -> Result<T, NoTimeSlope> {
        self.knows_time()?;
        let (h, dh) = (s.h, change.length);
        Ok(self.with_slopes_in_step(s, |work| {
            let mut slopes: Vec<f64> =
                work.efforts().iter().map(|effort| 0.5 * dh * effort).collect();
            for (j, input) in self.inputs.iter().enumerate() {
                let by = match input {
                    Input::Time => change.middle,
                    _ if input.is_rate() => -work.y[j] * dh / h,
                    _ => continue,
                };
                let all = slopes.iter_mut().enumerate();
                all.for_each(|(k, slope)| *slope += 0.5 * h * work.slope(k, j) * by);
            }
            then(&slopes)
        }))
    }

    /// The same at the inputs `y`.
    pub(super) fn with_slopes_of<T>(
        &self,
        y: &[f64],
        s: &Interval,
        then: impl FnOnce(&EvaluationScratch) -> T,
    ) -> T {
        let work = &mut *self.lock();
        self.take(y, s, work);
        self.differentiate(s.h, work);
        then(work)
    }

    /// Inputs that are known, and `z_n`.
    fn take(&self, y: &[f64], s: &Interval, work: &mut EvaluationScratch) {
        work.y.copy_from_slice(y);
        self.take_states(self.own(&s.internal), &mut work.start);
    }

    fn evaluate(&self, h: f64, work: &mut EvaluationScratch) {
        if self.states.is_empty() {
            self.law.evaluate(&work.y, &[], &mut work.values);
        } else {
            work.find_states(&*self.law, h);
        }
    }

    fn differentiate(&self, h: f64, work: &mut EvaluationScratch) {
        if self.states.is_empty() {
            self.law.gradient(&work.y, &[], &mut work.values, &mut work.slopes);
        } else {
            work.find_states(&*self.law, h);
            work.eliminate_states(h);
        }
    }

    /// With the efforts at a node; states that are not listed are where they rest.
    pub(in crate::force) fn with_values_at_node<T>(
        &self,
        at: Motion<'_>,
        then: impl FnOnce(&EvaluationScratch) -> T,
    ) -> T {
        let work = &mut *self.lock();
        self.read_node(at, work);
        if self.rests(at.internal) {
            work.find_rest(&*self.law);
        } else {
            self.law.evaluate(&work.y, &work.z, &mut work.values);
        }
        then(work)
    }

    /// With the efforts at a node and their slopes by the inputs, states as listed, or resting.
    pub(in crate::force) fn with_slopes_at_node<T>(
        &self,
        at: Motion<'_>,
        then: impl FnOnce(&EvaluationScratch) -> T,
    ) -> T {
        let work = &mut *self.lock();
        self.read_node(at, work);
        if self.rests(at.internal) {
            work.find_rest(&*self.law);
            work.eliminate_rest();
        } else {
            self.law.gradient(&work.y, &work.z, &mut work.values, &mut work.slopes);
        }
        then(work)
    }
}
