//! How much a change of a motion grows, by a neighbouring run.
//!
//! ```text
//! p̄_0' = p̄_0 + ε M u,  one step:  δ = q_1' − q_1                    a change that constraints allow
//! q_1' = q_1 + r δ,  p̄_1' = p̄_1,  |r δ| = 1e-10 |q_1|;    growth = max_n |q_n' − q_n|/|q_1' − q_1|
//! ```
//! `u` has a part along every coordinate, so that no symmetry hides what grows. A difference beyond
//! 1e-6 of the coordinates is made small again, as constraints bend, and so is what is left of its
//! curvature. Rounding is 1e-6 of the difference, no matter beside the threshold [`MEANINGLESS`].
//! It ends where the threshold is passed. The price is that of a run, and nothing but steps is
//! asked of a system: no derivatives.
//!
//! Source: G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9–20, for
//! differences that are made small again.

use crate::controls::Controls;
use crate::sensitivities::{DerivativeGrowth, MEANINGLESS};
use vi_constraints::discretization::Discretization;
use vi_constraints::{Constraints, Integrator};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::linear::dot;
use vi_core::state::State;

/// The kick, in parts of the coordinates that it moves by in a step.
const KICK: f64 = 1e-6;
/// The difference, in parts of the coordinates.
const NEAR: f64 = 1e-10;
/// Within which it stays, in parts of that.
const WITHIN: [f64; 2] = [1e-3, 1e4];

/// A run beside another one, whose difference is measured.
pub struct Neighbour<S: Discretization<C>, C> {
    run: Integrator<S, C>,
    own: State,        // where it is placed
    size: Option<f64>, // |q_n' − q_n| that stands for the change of the start, m; none before
    scale: f64,        // of the coordinates, m
    growth: DerivativeGrowth,
    stopped: bool, // nothing moves freely, the neighbour has no such step, or all is known
}

impl<S: Discretization<C>, C> std::fmt::Debug for Neighbour<S, C> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { size, growth, .. } = self;
        f.debug_struct("Neighbour").field("size", size).field("growth", growth).finish()
    }
}

impl<S, C> Neighbour<S, C>
where
    S: DiscreteLagrangian + 'static,
    C: Constraints + 'static,
{
    /// Beside a run that begins at `start` with steps of the length `h`, s; `run`: another
    /// integrator of the same system with the same settings.
    #[must_use]
    pub fn new(mut run: Integrator<S, C>, start: &State, h: f64) -> Self {
        let mut own = start.clone();
        let scale = match norm(&start.q) {
            0.0 => 1.0,
            scale => scale,
        };
        // no two parts alike
        let part = |i: usize| 2.0 * (0.1 + 0.618_033_988_749_895 * i as f64).fract() - 1.0;
        let u: Vec<f64> = (0..start.q.len()).map(part).collect();
        run.system().mass().mul_add(KICK * scale / (h.abs() * norm(&u)), &u, &mut own.p);
        run.place_at(&own);
        let growth = DerivativeGrowth::NONE;
        Self { run, own, size: None, scale, growth, stopped: false }
    }

    /// Takes the step `step`, from 0, that has brought the run to `node`, and compares.
    pub fn follow(&mut self, node: &State, controls: &Controls, step: usize) {
        if self.stopped {
            return;
        }
        controls.set(step);
        self.stopped = self.run.step().is_err();
        let apart = distance(&self.run.state().q, &node.q);
        self.scale = self.scale.max(norm(&node.q));
        let near = NEAR * self.scale;
        match self.size {
            _ if self.stopped => (),
            None => {
                self.stopped = apart <= near;
                self.come_near(node, near / apart);
                self.own.p.copy_from_slice(&node.p);
                self.run.place_at(&self.own);
                self.size = Some(distance(&self.own.q, &node.q));
            }
            Some(size) => {
                let grown = apart / size;
                self.growth.largest = self.growth.largest.max(grown);
                if grown > MEANINGLESS {
                    self.growth.meaningless_from = Some(node.t);
                    self.stopped = true;
                }
                let [least, most] = WITHIN.map(|part| part * near);
                if apart > 0.0 && !(least..=most).contains(&apart) {
                    self.come_near(node, near / apart);
                    self.size = Some(size * distance(&self.own.q, &node.q) / apart);
                }
            }
        }
    }

    /// Makes the difference to a node `part` times as large.
    fn come_near(&mut self, node: &State, part: f64) {
        let (own, at) = (&mut self.own, self.run.state());
        own.copy_from(node);
        let near = |own: &mut [f64], at: &[f64]| {
            own.iter_mut().zip(at).for_each(|(own, at)| *own += part * (at - *own));
        };
        near(&mut own.q, &at.q);
        near(&mut own.p, &at.p);
        near(&mut own.angles, &at.angles);
        near(&mut own.internal, &at.internal);
        self.run.place_at(&self.own);
    }

    /// Whether no more is found.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.stopped
    }

    /// Where the neighbour is.
    #[must_use]
    pub fn state(&self) -> &State {
        self.run.state()
    }

    /// How much the difference has grown, up to the threshold; 1 where nothing moves freely.
    #[must_use]
    pub fn growth(&self) -> DerivativeGrowth {
        self.growth
    }
}

fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
