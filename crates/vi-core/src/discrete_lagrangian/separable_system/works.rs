//! Works of forces as internal variables, so that they have derivatives as a motion has.
//!
//! ```text
//! W_0 = V(q_0),   W_{n+1} = W_n + Σ (f_d^- + f_d^+)·Δq/h                  of the forces of a source
//! ∂W_{n+1}/∂q_n, ∂q_{n+1} = ∓ Σ (f_d^- + f_d^+)/h + Σ (D_{1,2}(f_d^- + f_d^+))ᵀ Δq/h
//! Ẇ = Σ f(t, Q, V)·V                                                      at Gauss nodes [2.36]
//! ```
//! `W − V(q)`: what the forces of a source and its energy `V` have done since the start. They exert
//! nothing. They follow the internal variables of signals.

use super::SeparableSystem;
use crate::configuration::{Configuration, Motion};
use crate::discrete_lagrangian::slot_derivatives::DiscreteLagrangian;
use crate::force::{DiscreteForce, Source};
use crate::galerkin::{GaussLobatto, GaussPoint};
use crate::interval::{Interval, Slot};
use crate::linear::dot;
use crate::potential::DiscretePotential;
use crate::signals::StateRates;
use crate::sparse::{Block, Entries, Product};
use nalgebra::DMatrix;
use std::ops::Range;
use std::sync::Arc;

/// What works.
#[derive(Clone)]
pub struct Working {
    /// Of the forces.
    pub source: Source,
    /// `V`, where something is stored.
    pub stored: Option<Arc<dyn DiscretePotential>>,
}

impl std::fmt::Debug for Working {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Working").field(&self.source).finish()
    }
}

impl SeparableSystem {
    /// With the work of a source as one more internal variable.
    #[must_use]
    pub fn working(mut self, own: Working) -> Self {
        self.works.push(own);
        self
    }

    /// Where the works stand among all internal variables, in the order in which they were added.
    #[must_use]
    pub fn places_of_works(&self) -> Range<usize> {
        let first = self.places_of_signals().end;
        first..first + self.works.len()
    }

    fn forces_of<'a>(&'a self, own: &'a Working) -> impl Iterator<Item = &'a dyn DiscreteForce> {
        let all = self.forces.iter().zip(&self.sources);
        all.filter(|(_, source)| **source == own.source).map(|(force, _)| &**force)
    }

    /// `out ← W_0`.
    pub(super) fn begin_works(&self, at: Configuration<'_>, out: &mut [f64]) {
        for (out, own) in out.iter_mut().zip(&self.works) {
            *out = own.stored.as_ref().map_or(0.0, |own| own.potential(at));
        }
    }

    /// `out ←` its change where `q` changes by `dq`.
    pub(super) fn begin_works_change(&self, at: Configuration<'_>, dq: &[f64], out: &mut [f64]) {
        for (out, own) in out.iter_mut().zip(&self.works) {
            let mut slope = vec![0.0; dq.len()];
            own.stored.iter().for_each(|own| own.add_gradient(at, 1.0, &mut slope));
            *out = dot(&slope, dq);
        }
    }

    /// `out ← W_{n+1}` of `W_n`.
    pub(super) fn advance_works(&self, s: &Interval, out: &mut [f64]) {
        if self.works.is_empty() {
            return;
        }
        let mut scratch = vec![0.0; s.q0.len()];
        for (out, own) in out.iter_mut().zip(&self.works) {
            *out += self.forces_of(own).map(|force| force.work(s, &mut scratch)).sum::<f64>();
        }
    }

    /// Emits `∂W_{n+1}/∂q_n` or `∂W_{n+1}/∂q_{n+1}`.
    pub(super) fn emit_work_slopes(&self, s: &Interval, by: Slot, out: &mut dyn Entries) {
        for (row, own) in self.places_of_works().zip(&self.works) {
            let [mut sum, mut slope] = [(); 2].map(|()| vec![0.0; s.q0.len()]);
            for force in self.forces_of(own) {
                force.add_minus(s, &mut sum);
                force.add_plus(s, &mut sum);
                for of in Slot::BOTH {
                    along(&s.v_mid, &mut slope, |out| force.add_slope(s, of, by, out));
                }
            }
            for (column, (f, slope)) in sum.into_iter().zip(slope).enumerate() {
                out.add(row, column, by.sign() * f / s.h + slope);
            }
        }
    }

    /// Emits `∂W_{n+1}/∂z_n`.
    pub(super) fn emit_work_slopes_by_state(&self, s: &Interval, out: &mut dyn Entries) {
        for (row, own) in self.places_of_works().zip(&self.works) {
            let mut slope = vec![0.0; self.internal_variables()];
            slope[row] = 1.0;
            for force in self.forces_of(own) {
                for of in Slot::BOTH {
                    along(&s.v_mid, &mut slope, |out| force.add_internal_slope(s, of, out));
                }
            }
            slope.into_iter().enumerate().for_each(|(column, slope)| out.add(row, column, slope));
        }
    }

    /// `f·v` of a source; `force`: shape `n`.
    fn power_of(&self, own: &Working, at: Motion<'_>, f: &mut [f64]) -> f64 {
        f.fill(0.0);
        self.forces_of(own).for_each(|force| force.add_continuous(at, f));
        dot(f, at.v)
    }

    /// Takes the works to the end of a Galerkin step whose Gauss nodes are known.
    pub(super) fn collocate_works(
        &self,
        s: &Interval,
        constants: &GaussLobatto,
        gauss: &[GaussPoint],
        end: &mut [f64],
    ) {
        if self.works.is_empty() {
            return;
        }
        let mut force = vec![0.0; s.q0.len()];
        for (node, weight) in gauss.iter().zip(constants.gauss_weights.iter()) {
            for (end, own) in end.iter_mut().zip(&self.works) {
                *end +=
                    s.h * weight * self.power_of(own, node.place(s).moving(&node.v), &mut force);
            }
        }
    }

    /// Adds the works to the rates of the continuous states of signals, with their slopes.
    pub(super) fn with_works(&self, of_signals: StateRates, at: Motion<'_>) -> StateRates {
        let (n, first) = (at.v.len(), of_signals.places.len());
        let m = first + self.works.len();
        let widened = |own: DMatrix<f64>, columns: usize| own.resize(m, columns, 0.0);
        let mut all = StateRates {
            by_position: widened(of_signals.by_position, n),
            by_velocity: widened(of_signals.by_velocity, n),
            by_state: widened(of_signals.by_state, m),
            ..of_signals
        };
        all.places.extend(self.places_of_works());
        let mut f = vec![0.0; n];
        for (row, own) in (first..).zip(&self.works) {
            all.rates.push(self.power_of(own, at, &mut f));
            let [mut by_q, mut by_v] = [vec![0.0; n], f.clone()];
            let mut by_z = vec![0.0; self.internal_variables()];
            for force in self.forces_of(own) {
                along(at.v, &mut by_q, |out| force.add_position_slope(at, 1.0, out));
                along(at.v, &mut by_v, |out| force.add_damping(at, 1.0, out));
                along(at.v, &mut by_z, |out| force.add_state_slopes(at, 1.0, out));
            }
            for i in 0..n {
                (all.by_position[(row, i)], all.by_velocity[(row, i)]) = (by_q[i], by_v[i]);
            }
            for (column, place) in all.places.iter().enumerate() {
                all.by_state[(row, column)] = by_z[*place];
            }
        }
        all
    }
}

/// `out ← out + Kᵀ v` of what is emitted.
fn along(v: &[f64], out: &mut [f64], emit: impl FnOnce(&mut dyn Entries)) {
    let into = &mut Product { v, out };
    emit(&mut Block { into, row: 0, column: 0, scale: 1.0, transposed: true });
}
