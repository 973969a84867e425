//! The parts of the equations of a Galerkin step, and their costates.
//!
//! What acts at a Gauss node is what a step whose ends have come together has, with the costates
//! `momentum, −step = b_k Σ_i (E_ki ± ½ D_ki) x_i` ([`Place::Gauss`]); constraints are those of the
//! intervals between neighbouring control points ([`Place::Points`]). Interpolated strains act on
//! the control points, with `x_i` ([`Place::Strains`]).
#![allow(non_snake_case)] // D, E

use super::control_points::ControlPoints;
use crate::design::{Costates, Place};
use vi_core::galerkin::{GaussLobatto, Stages};
use vi_core::interval::Interval;

/// The Gauss nodes of a step, then the intervals between its control points.
#[derive(Debug)]
pub struct Parts {
    gauss: Vec<Interval>,         // s
    between: Vec<Interval>,       // s
    costates: Vec<[Vec<f64>; 2]>, // s × 2 × n  of the Gauss nodes: step, momentum
    step_costates: Vec<Vec<f64>>, // s × n  m_i
    none: [Vec<f64>; 2],          // n, m  zero
    weights: Vec<f64>,            // s  b_k
}

impl Parts {
    /// Of a step of `n` coordinates and `m` constraints.
    #[must_use]
    pub fn new(n: usize, m: usize, stages: Stages) -> Self {
        let s = stages.count();
        let intervals = || vec![Interval::new(n); s];
        Self {
            gauss: intervals(),
            between: intervals(),
            costates: vec![[vec![0.0; n], vec![0.0; n]]; s],
            step_costates: vec![vec![0.0; n]; s],
            none: [vec![0.0; n], vec![0.0; m]],
            weights: vec![0.0; s],
        }
    }

    /// `s`.
    #[must_use]
    pub fn stages(&self) -> usize {
        self.gauss.len()
    }

    /// Moves the Gauss nodes to where the control points were evaluated.
    pub fn stand(&mut self, points: &ControlPoints) {
        let s = points.step();
        self.weights.copy_from_slice(&points.constants().gauss_weights);
        for (own, node) in self.gauss.iter_mut().zip(points.gauss()) {
            own.gather_at(node.place(s), &node.v, s.h);
        }
    }

    /// Moves the intervals between the control points.
    pub fn stand_between(&mut self, points: &ControlPoints) {
        let s = points.step();
        for (i, own) in self.between.iter_mut().enumerate() {
            let [t, t_end] = [i, i + 1].map(|i| points.time(i));
            own.open_start(t, t_end - t, points.q(i), &self.none[0]);
            own.end_at(t_end);
            own.q1.copy_from_slice(points.q(i + 1));
            own.close_from_end();
            own.angles.extend_from_slice(&s.angles);
        }
    }

    /// The interval from control point `i` to the next one.
    #[must_use]
    pub fn between(&self, i: usize) -> &Interval {
        &self.between[i]
    }

    /// Takes the costates `x_0 … x_s` of the equations.
    pub fn spread(&mut self, constants: &GaussLobatto, x: &[Vec<f64>]) {
        for (k, [step, momentum]) in self.costates.iter_mut().enumerate() {
            let weight = constants.gauss_weights[k];
            step.fill(0.0);
            momentum.fill(0.0);
            for (i, x) in x.iter().enumerate() {
                let (E, half) = (constants.E[(k, i)], 0.5 * constants.D[(k, i)]);
                let [minus, plus] = [weight * (half - E), weight * (half + E)];
                step.iter_mut().zip(x).for_each(|(own, x)| *own += minus * x);
                momentum.iter_mut().zip(x).for_each(|(own, x)| *own += plus * x);
            }
        }
        for (own, x) in self.step_costates.iter_mut().zip(x) {
            own.iter_mut().zip(x).for_each(|(own, x)| *own = -x);
        }
    }

    /// Part `k` with the impulses `Λ_0 … Λ_{s−1}` of its constraints.
    #[must_use]
    pub fn part<'a>(&'a self, k: usize, impulses: &'a [Vec<f64>]) -> (Place<'a>, &'a [f64]) {
        match k.checked_sub(self.stages()) {
            None => (Place::Gauss(&self.gauss[k], self.weights[k]), &self.none[1]),
            Some(i) => (Place::Points(&self.between[i]), &impulses[i]),
        }
    }

    /// No impulses of constraints, shape `m`.
    #[must_use]
    pub fn no_rows(&self) -> &[f64] {
        &self.none[1]
    }

    /// The costates of interpolated strains on a control point, of whose equation they are `x`.
    #[must_use]
    pub fn costates_of_point<'a>(&'a self, x: &'a [f64]) -> Costates<'a> {
        Costates::of_rows(&self.none[0], x, &self.none[1])
    }

    /// The costates of part `k`, with `σ_1 … σ_s`.
    #[must_use]
    pub fn costates<'a>(&'a self, k: usize, sigma: &'a [Vec<f64>]) -> Costates<'a> {
        match k.checked_sub(self.stages()) {
            None => {
                let [step, momentum] = &self.costates[k];
                Costates::of_rows(step, momentum, &self.none[1])
            }
            Some(i) => {
                let (step, rows) = (&self.step_costates[i], &sigma[i]);
                Costates::of_rows(step, &self.none[0], rows)
            }
        }
    }
}
