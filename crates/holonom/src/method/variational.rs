//! The variational schemes as a [`Method`].

use super::work::Work;
use super::{Method, Reading};
use crate::evidence::shadow::shadow_energy;
use crate::model::Settings;
use crate::sample::{Momenta, Residuals};
use vi_constraints::discretization::Step;
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::StepReport;
use vi_constraints::node::Node;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_constraints::{Constraints, Reparametrization};
use vi_core::linear::Singular;
use vi_core::{DiscreteLagrangian, State};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::tree_map::TreeMap;

/// One of the four schemes at some order.
pub(crate) struct Variational {
    run: MechanismIntegrator,
    order: u32,
    ended: Option<f64>, // J  E_d of the composed step that ended at the present node
    momenta: Option<TreeMap>, // where they are asked for
    work: Work,
}

impl Variational {
    pub(crate) fn new(run: MechanismIntegrator, settings: &Settings) -> Self {
        let momenta = settings.momenta.then(|| TreeMap::new(run.constraints()));
        let driven = run.constraints().is_rheonomic();
        let work = Work::new(&run.state().p, run.initial_velocity(), driven);
        Self { run, order: settings.order, ended: None, momenta, work }
    }

    fn is_composed(&self) -> bool {
        self.order > 2
    }

    /// Momenta of a node; without a `step` from there only those of its state.
    fn momenta(&self, at: &State, node: &Node, step: bool) -> Option<Box<Momenta>> {
        let map = self.momenta.as_ref()?;
        let mut found = Momenta {
            p_projected: node.p_projected.clone(),
            p_reduced: vec![0.0; map.dof()],
            hamiltonian_projected: Some(node.hamiltonian_projected),
            ..Momenta::default()
        };
        map.pull_back(&at.q, &node.p_projected, &mut found.p_reduced);
        if step {
            found.lambda.clone_from(&node.lambda);
            found.p.clone_from(&node.p);
            (found.discrete_energy, found.hamiltonian) =
                (Some(node.discrete_energy), node.hamiltonian);
        }
        Some(Box::new(found))
    }

    fn reading_here(&self, node: &Node) -> Reading {
        let at = self.run.state();
        let work = self.work.at(false, &at.p, (&node.p_projected, &node.v));
        let found = reading(self.run.constraints(), at, node, work);
        let step = if self.is_composed() { self.ended } else { Some(found.energy) };
        Reading {
            shadow: step.map(|step| shadow_energy(self.order, found.hamiltonian, step)),
            ..found
        }
    }
}

fn reading(mechanism: &Mechanism, at: &State, node: &Node, work: f64) -> Reading {
    Reading {
        step: at.step,
        t: at.t,
        q: at.q.clone(),
        v: node.v.clone(),
        lambda: node.lambda.clone(),
        energy: node.discrete_energy.total(),
        hamiltonian: node.hamiltonian_projected.total(),
        shadow: None,
        work,
        momentum: mechanism.momentum(&at.q, &node.p_projected),
        residuals: Residuals {
            position: node.position_residual,
            velocity: node.velocity_residual,
            momentum: node.momentum_residual,
        },
        momenta: None,
    }
}

impl Method for Variational {
    fn step(&mut self) -> Result<StepReport, StepError> {
        let composed = self.is_composed();
        let Self { run, work, ended, .. } = self;
        work.begin();
        let (mut action_rate, mut length) = (0.0, 0.0); // E_d = −∂/∂h of the action
        let taken = run.step_with(&mut |system, _, Step { s, .. }| {
            work.add(system, s);
            if composed {
                action_rate += s.h * system.discrete_energy(s);
                length += s.h;
            }
        });
        match taken {
            Ok(_) if composed => *ended = Some(action_rate / length),
            Ok(_) => {}
            Err(_) => work.take_back(),
        }
        taken
    }

    fn place(&self) -> (u64, f64, &[f64]) {
        let state = self.run.state();
        (state.step, state.t, &state.q)
    }

    fn reads_first(&self) -> bool {
        self.is_composed()
    }

    fn here(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        let node = self.run.observe_state()?.clone();
        let mut found = self.reading_here(&node);
        found.lambda.clear();
        found.momenta = self.momenta(self.run.state(), &node, false);
        if multipliers || found.momenta.is_some() {
            found.lambda = self.run.acceleration_multiplier()?;
        }
        if let Some(momenta) = &mut found.momenta {
            momenta.lambda.clone_from(&found.lambda);
        }
        Ok(found)
    }

    fn left(&mut self) -> Result<Reading, Singular> {
        let node = self.run.node_before()?.clone();
        let at = self.run.before();
        let work = self.work.at(true, &at.p, (&node.p_projected, &node.v));
        let found = reading(self.run.constraints(), at, &node, work);
        let shadow = Some(shadow_energy(self.order, found.hamiltonian, found.energy));
        Ok(Reading { momenta: self.momenta(at, &node, true), shadow, ..found })
    }

    fn last(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        if self.is_composed() {
            return self.here(multipliers);
        }
        match self.run.observe().cloned() {
            Ok(node) => {
                let momenta = self.momenta(self.run.state(), &node, true);
                Ok(Reading { momenta, ..self.reading_here(&node) })
            }
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
