//! A law along an unknown of a step that reads other quantities, during a step.
//!
//! ```text
//! (h/2) τ(y),   y_j = x(q_n) + σ u_k/2, σ u_k/h, or a function of the step
//! ∂/∂u_k [(h/2) τ] = (h/4) σ_k dτ/dy_j,  ½ σ_k dτ/dy_j
//! ```
//! One that is affine in what it reads is evaluated once in a step, with its slopes.

use vi_core::SeparableSystem;
use vi_core::configuration::Configuration;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::interval::Interval;
use vi_core::quantity_effort::{QuantityEffort, StepQuantity};

/// A law during a step.
pub(super) struct LawInStep {
    pub(super) force: usize, // index in the system
    pub(super) unknown: SignedUnknown,
    pub(super) link: usize,
    pub(super) quantities: Vec<StepQuantity>,
    start: Vec<f64>,             // of those that are coordinates, at q_n
    y: Vec<f64>,                 // in the step
    pub(super) slopes: Vec<f64>, // dτ/dy
    pub(super) impulse: f64,     // (h/2) τ
    is_affine: bool,
    first: FirstEvaluation,
}

/// Where an affine law was evaluated in a step: once.
#[derive(Default)]
struct FirstEvaluation {
    is_known: bool,
    y: Vec<f64>,
    effort: f64,
}

impl LawInStep {
    /// Whether a quantity is the coordinate along which the law acts, or its rate.
    pub(super) fn is_own(&self, quantity: StepQuantity) -> bool {
        matches!(quantity, StepQuantity::Coordinate(k) | StepQuantity::Rate(k) if k == self.unknown)
    }

    /// The derivative of `(h/2) τ` by an unknown, by way of one quantity.
    pub(super) fn by_unknown(&self, j: usize, h: f64) -> f64 {
        match self.quantities[j] {
            StepQuantity::Coordinate(k) => 0.25 * h * k.sign * self.slopes[j],
            StepQuantity::Rate(k) => 0.5 * k.sign * self.slopes[j],
            StepQuantity::Fixed | StepQuantity::Configuration => 0.0,
        }
    }

    /// `τ` at the quantities at hand.
    fn find_effort(&mut self, effort: &dyn QuantityEffort, s: &Interval) -> f64 {
        let Self { y, slopes, is_affine, first, .. } = self;
        if !*is_affine {
            return effort.effort(s, y);
        }
        if !first.is_known {
            first.effort = effort.effort_and_slopes(s, y, slopes);
            first.y.copy_from_slice(y);
            first.is_known = true;
        }
        let changes = y.iter().zip(&first.y).zip(slopes);
        first.effort + changes.map(|((y, first), slope)| *slope * (y - first)).sum::<f64>()
    }

    pub(super) fn effort<'a>(&self, system: &'a SeparableSystem) -> Option<&'a dyn QuantityEffort> {
        system.quantity_effort(self.force)
    }

    /// Of a force of the system along an unknown of this link.
    pub(super) fn new(force: usize, link: usize, effort: &dyn QuantityEffort) -> Self {
        let n = effort.count();
        let quantities: Vec<StepQuantity> = (0..n).map(|j| effort.quantity(j)).collect();
        let is_affine = effort.is_affine() && !quantities.contains(&StepQuantity::Configuration);
        let [start, y, slopes, first] = [0, 1, 2, 3].map(|_| vec![0.0; n]);
        let first = FirstEvaluation { y: first, ..FirstEvaluation::default() };
        let unknown = effort.unknown();
        Self { force, unknown, link, quantities, start, y, slopes, impulse: 0.0, is_affine, first }
    }

    /// Whether it reads anything but time, what is held and its own coordinate.
    pub(super) fn is_foreign(&self) -> bool {
        let mut read = self.quantities.iter();
        read.any(|quantity| *quantity != StepQuantity::Fixed && !self.is_own(*quantity))
    }

    /// What is fixed over a step, and the coordinates at its start.
    pub(super) fn begin(&mut self, system: &SeparableSystem, at: Configuration<'_>, s: &Interval) {
        let Some(effort) = self.effort(system) else { return };
        self.first.is_known = false;
        for (j, quantity) in self.quantities.iter().enumerate() {
            match quantity {
                StepQuantity::Fixed => self.y[j] = effort.in_step(j, s),
                StepQuantity::Coordinate(_) => self.start[j] = effort.at_start(j, at),
                StepQuantity::Rate(_) | StepQuantity::Configuration => {}
            }
        }
    }

    /// `(h/2) τ` at the increments `u`.
    pub(super) fn evaluate(&mut self, system: &SeparableSystem, s: &Interval, u: &[f64]) {
        let Some(effort) = self.effort(system) else { return };
        for (j, quantity) in self.quantities.iter().enumerate() {
            match quantity {
                StepQuantity::Fixed => {}
                StepQuantity::Coordinate(k) => {
                    self.y[j] = self.start[j] + 0.5 * k.sign * u[k.index];
                }
                StepQuantity::Rate(k) => self.y[j] = k.sign * u[k.index] / s.h,
                StepQuantity::Configuration => self.y[j] = effort.in_step(j, s),
            }
        }
        self.impulse = 0.5 * s.h * self.find_effort(effort, s);
    }

    /// The slopes there; returns `∂/∂u_j` of `σ (h/2) τ` by way of its own coordinate.
    pub(super) fn own_slope(&mut self, system: &SeparableSystem, s: &Interval) -> f64 {
        let Some(effort) = self.effort(system) else { return 0.0 };
        if !self.is_affine {
            effort.effort_and_slopes(s, &self.y, &mut self.slopes);
        }
        let own = (0..self.y.len()).filter(|j| self.is_own(self.quantities[*j]));
        own.map(|j| self.unknown.sign * self.by_unknown(j, s.h)).sum()
    }
}
