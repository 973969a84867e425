//! The exact tangent of Galerkin steps without forces: [`super::linearization`] for tangent vectors
//! `δq` with `G(q_n) δq = 0`. The symplectic form is that of [`crate::tangent_map`].

use super::linearization::GalerkinLinearization;
use crate::constraints::Constraints;
use crate::discretization::Step;
use crate::linearization::{LinearizationError, Tangent};
use crate::saddle_point::IndependentRows;
use crate::tangent_map::{TangentError, Tangents};
use vi_core::Motion;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::galerkin::Stages;
use vi_core::linear::Singular;
use vi_core::state::State;

/// Carries tangent vectors along the steps of a Galerkin scheme.
#[derive(Debug)]
pub struct GalerkinTangent {
    step: GalerkinLinearization,
    column: Tangent,
    p: Vec<f64>, // n  p̄
}

impl GalerkinTangent {
    /// For a motion from `state`, with an independent set of `m` constraints.
    #[must_use]
    pub fn new(m: usize, rows: &IndependentRows, stages: Stages, state: &State) -> Self {
        let (n, p) = (state.q.len(), state.p.clone());
        let step = GalerkinLinearization::new(n, m, rows, stages);
        Self { step, column: Tangent::zero(n, state.internal.len()), p }
    }

    /// Replaces vectors at `q_n` by their images at `q_{n+1}`; called for one step after the other.
    ///
    /// # Errors
    /// [`TangentError`].
    pub fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        taken: Step<'_>,
        tangents: &mut Tangents,
    ) -> Result<(), TangentError> {
        let mut force = vec![0.0; system.dim()];
        for node in taken.gauss {
            system.add_force(Motion::new(node.t, &node.q, &node.v), &mut force);
        }
        if force.iter().any(|f| *f != 0.0) {
            return Err(TangentError::Forced);
        }
        let Self { step, column, p } = self;
        let points = taken.polynomial.ok_or(Singular)?.points;
        step.linearize(system, constraints, points, p)?;
        for k in 0..tangents.dq.ncols() {
            column.q.copy_from_slice(tangents.dq.column(k).as_slice());
            column.p.copy_from_slice(tangents.dp.column(k).as_slice());
            step.push(system, constraints, column).map_err(|error| match error {
                LinearizationError::Singular(singular) => singular,
                _ => Singular, // nothing has sources
            })?;
            tangents.dq.column_mut(k).copy_from_slice(&column.q);
            tangents.dp.column_mut(k).copy_from_slice(&column.p);
        }
        step.momentum(system, p);
        Ok(())
    }
}
