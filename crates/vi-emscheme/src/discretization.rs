//! What an integrator asks of an energy–momentum system beside its forces: the state at the start,
//! sub-steps, nodes.

use crate::constraint::DiscreteConstraints;
use crate::em_system::EmSystem;
use crate::node::EmObserver;
use crate::scheme::sub_steps;
use vi_constraints::discretization::Discretization;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::{Composition, MechanicalSystem, State};

impl<C: DiscreteConstraints> Discretization<C> for EmSystem {
    type Observer = EmObserver;

    fn observer(&self, m: usize, rows: &IndependentRows) -> EmObserver {
        EmObserver::new(self.dim(), m, rows)
    }

    fn begin(&self, state: &mut State, v: &[f64]) {
        state.v = v.to_vec();
        state.compensation.v = vec![0.0; v.len()];
    }

    fn sub_steps(&self, composition: Composition) -> Vec<f64> {
        sub_steps(composition)
    }
}
