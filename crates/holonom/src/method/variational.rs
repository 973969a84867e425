//! The variational schemes as a [`Method`].

use super::work::Work;
use super::{Method, Reading};
use crate::sample::Residuals;
use vi_constraints::Constraints;
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::StepReport;
use vi_constraints::node::Node;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_core::State;
use vi_core::linear::Singular;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;

/// One of the four schemes at some order.
pub(crate) struct Variational {
    run: MechanismIntegrator,
    composed: bool, // order above 2
    work: Work,
}

impl Variational {
    pub(crate) fn new(run: MechanismIntegrator, order: u32) -> Self {
        let driven = run.constraints().is_rheonomic();
        let work = Work::new(&run.state().p, run.initial_velocity(), driven);
        Self { run, composed: order > 2, work }
    }
}

impl Variational {
    fn reading_here(&self, node: &Node) -> Reading {
        let at = self.run.state();
        let work = self.work.at(false, &at.p, (&node.p_projected, &node.v));
        reading(self.run.constraints(), at, node, work)
    }
}

fn reading(mechanism: &Mechanism, at: &State, node: &Node, work: f64) -> Reading {
    Reading {
        step: at.step,
        t: at.t,
        q: at.q.clone(),
        v: node.v.clone(),
        lambda: node.lambda.clone(),
        energy: node.discrete_energy,
        hamiltonian: node.hamiltonian_projected,
        work,
        momentum: mechanism.momentum(&at.q, &node.p_projected),
        residuals: Residuals {
            position: node.position_residual,
            velocity: node.velocity_residual,
            momentum: node.momentum_residual,
        },
    }
}

impl Method for Variational {
    fn step(&mut self) -> Result<StepReport, StepError> {
        let Self { run, work, .. } = self;
        work.begin();
        let taken = run.step_with(&mut |system, _, s| work.add(system, s));
        if taken.is_err() {
            work.take_back();
        }
        taken
    }

    fn place(&self) -> (u64, f64, &[f64]) {
        let state = self.run.state();
        (state.step, state.t, &state.q)
    }

    fn reads_first(&self) -> bool {
        self.composed
    }

    fn here(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        let node = self.run.observe_state()?.clone();
        let mut found = self.reading_here(&node);
        found.lambda.clear();
        if multipliers {
            found.lambda = self.run.acceleration_multiplier()?;
        }
        Ok(found)
    }

    fn left(&mut self) -> Result<Reading, Singular> {
        let node = self.run.node_before()?.clone();
        let at = self.run.before();
        let work = self.work.at(true, &at.p, (&node.p_projected, &node.v));
        Ok(reading(self.run.constraints(), at, &node, work))
    }

    fn last(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        if self.composed {
            return self.here(multipliers);
        }
        match self.run.observe().cloned() {
            Ok(node) => Ok(self.reading_here(&node)),
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

    fn variational(&mut self) -> Option<&mut MechanismIntegrator> {
        Some(&mut self.run)
    }
}
