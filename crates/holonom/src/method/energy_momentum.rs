//! The energy–momentum schemes as a [`Method`].
//!
//! The multiplier of a node is the mean of the steps beside it; where there is only one of them (at the
//! start, and where a step fails), and with a composition, it is taken from the acceleration level, with the forces of the
//! variational description: in the limit of short steps both descriptions are the same system.

use super::{Method, Reading};
use crate::sample::Residuals;
use vi_constraints::Constraints;
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::StepReport;
use vi_constraints::node::NodeObserver;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_core::linear::Singular;
use vi_core::{MechanicalSystem, SeparableSystem};
use vi_emscheme::{EmIntegrator, EmNode, EmState};
use vi_multibody::mechanism::Mechanism;

/// One of the three forms.
pub(crate) struct EnergyMomentum {
    run: EmIntegrator<Mechanism>,
    forces: SeparableSystem,
    observer: Option<NodeObserver>, // made when first asked for
}

impl EnergyMomentum {
    pub(crate) fn new(run: EmIntegrator<Mechanism>, forces: SeparableSystem) -> Self {
        forces.accept(&run.state().q);
        Self { run, forces, observer: None }
    }

    fn acceleration_multiplier(&mut self) -> Result<Vec<f64>, Singular> {
        let (mechanism, rows, forces) = (self.run.constraints(), self.run.rows(), &self.forces);
        let mut lambda = vec![0.0; mechanism.len()];
        let observer =
            self.observer.get_or_insert_with(|| NodeObserver::new(forces, mechanism.len(), rows));
        let EmState { t, q, v, .. } = self.run.state();
        observer.acceleration_multiplier(forces, mechanism, (*t, q, v), &mut lambda)?;
        Ok(lambda)
    }
}

fn reading(mechanism: &Mechanism, at: &EmState, node: &EmNode) -> Reading {
    Reading {
        step: at.step,
        t: at.t,
        q: at.q.clone(),
        v: at.v.clone(),
        lambda: node.lambda.clone(),
        energy: node.energy,
        hamiltonian: node.energy,
        momentum: mechanism.momentum(&at.q, &node.p),
        residuals: Residuals {
            position: node.position_residual,
            velocity: node.velocity_residual,
            momentum: node.momentum_residual,
        },
    }
}

impl Method for EnergyMomentum {
    fn step(&mut self) -> Result<StepReport, StepError> {
        let report = self.run.step()?;
        self.forces.accept(&self.run.state().q);
        Ok(report)
    }

    fn place(&self) -> (u64, f64, &[f64]) {
        let state = self.run.state();
        (state.step, state.t, &state.q)
    }

    fn reads_first(&self) -> bool {
        self.run.is_composed()
    }

    fn here(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        let node = self.run.observe_state().clone();
        let mut found = reading(self.run.constraints(), self.run.state(), &node);
        found.lambda.clear();
        if multipliers {
            found.lambda = self.acceleration_multiplier()?;
        }
        Ok(found)
    }

    fn left(&mut self) -> Result<Reading, Singular> {
        let node = self.run.node_before().clone();
        Ok(reading(self.run.constraints(), self.run.before(), &node))
    }

    fn last(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        if self.run.is_composed() {
            return self.here(multipliers);
        }
        match self.run.observe().cloned() {
            Ok(node) => Ok(reading(self.run.constraints(), self.run.state(), &node)),
            Err(_) => self.here(multipliers),
        }
    }

    fn mechanism(&self) -> &Mechanism {
        self.run.constraints()
    }

    fn rows(&self) -> &IndependentRows {
        self.run.rows()
    }

    fn start_report(&self) -> &StartReport {
        self.run.start_report()
    }

    fn condition(&mut self) -> Option<Condition> {
        self.run.condition()
    }

    fn energy_momentum(&mut self) -> Option<&mut EmIntegrator<Mechanism>> {
        Some(&mut self.run)
    }
}
