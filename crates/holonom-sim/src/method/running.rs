//! An integrator of either family in motion, as a [`Method`].
//!
//! The multiplier of a node is that of (36), of energy–momentum schemes the mean of the steps beside it; where a
//! node has no such step (at the end, where a step fails, and with a composition) it is taken from the acceleration
//! level.

use super::family::Family;
use super::work::Work;
use super::{Method, Reading};
use crate::run_state::MotionState;
use crate::sample::{Momenta, Residuals};
use holonom_model::Settings;
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::{ResumeError, StepReport};
use vi_constraints::node::Node;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_constraints::{Integrator, Reparametrization};
use vi_core::linear::Singular;
use vi_core::{State, shadow_energy};
use vi_emscheme::EmIntegrator;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::tree_map::TreeMap;

/// One of the schemes at some order.
pub(crate) struct Running<S: Family> {
    run: Integrator<S, Mechanism>,
    order: u32,
    ended: Option<f64>, // J  E_d of the composed step that ended at the present node
    momenta: bool,      // whether they are asked for
    map: Option<TreeMap>, // for the reduced ones
    work: Work,
}

impl<S: Family> Running<S> {
    /// `multipliers`: whether sensors ask for them.
    pub(crate) fn new(
        mut run: Integrator<S, Mechanism>,
        settings: &Settings,
        multipliers: bool,
    ) -> Self {
        run.record_multipliers(multipliers || settings.momenta);
        let map = (settings.momenta && S::VARIATIONAL).then(|| TreeMap::new(run.constraints()));
        let work = S::work(&run);
        let Settings { order, momenta, .. } = *settings;
        Self { run, order, ended: None, momenta, map, work }
    }

    /// Momenta of a node; without a `step` from there only those of its state.
    fn momenta(&self, at: &State, node: &Node, step: bool) -> Option<Box<Momenta>> {
        if !self.momenta {
            return None;
        }
        let mut found = Momenta::default();
        if let Some(map) = &self.map {
            found.p_projected.clone_from(&node.p_projected);
            found.p_reduced = vec![0.0; map.dof()];
            map.pull_back(&at.q, &node.p_projected, &mut found.p_reduced);
            found.hamiltonian_projected = Some(node.hamiltonian_projected);
            found.discrete_energy = step.then_some(node.discrete_energy);
        }
        if step {
            found.lambda.clone_from(&node.lambda);
        }
        if step || !S::VARIATIONAL {
            found.p.clone_from(&node.p);
            found.hamiltonian = node.hamiltonian;
        }
        Some(Box::new(found))
    }

    /// A node; `before`: that which the last step started from; `step`: with what belongs to the step from it.
    fn reading(&self, before: bool, node: &Node, step: bool) -> Reading {
        let at = if before { self.run.before() } else { self.run.state() };
        let mechanism = self.run.constraints();
        let (energy, hamiltonian) =
            (node.discrete_energy.total(), node.hamiltonian_projected.total());
        let of_step =
            if S::VARIATIONAL && self.run.reads_states() { self.ended } else { Some(energy) };
        Reading {
            step: at.step,
            t: at.t,
            q: at.q.clone(),
            angles: at.angles.clone(),
            v: node.v.clone(),
            lambda: node.lambda.clone(),
            energy,
            hamiltonian,
            kinetic: node.hamiltonian_projected.kinetic,
            shadow: of_step.map(|step| shadow_energy(self.order, hamiltonian, step)),
            work: self.work.at(before, &at.p, (&node.p_projected, &node.v)),
            momentum: mechanism.momentum(&at.q, &node.p_projected),
            residuals: Residuals {
                position: node.position_residual,
                velocity: node.velocity_residual,
                momentum: node.momentum_residual,
            },
            momenta: self.momenta(at, node, step),
        }
    }
}

impl<S: Family + 'static> Method for Running<S> {
    fn step(&mut self, parts: u32) -> Result<StepReport, StepError> {
        let Self { run, work, ended, .. } = self;
        let composed = run.reads_states();
        work.begin();
        let (mut action_rate, mut length) = (0.0, 0.0); // E_d = −∂/∂h of the action
        let taken = run.step_in_parts(parts, &mut |system, mechanism, step| {
            system.add_work(mechanism, step, work);
            if composed {
                action_rate += system.action_rate(step);
                length += step.s.h;
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
        self.run.reads_states()
    }

    fn here(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        let node = self.run.observe_state()?.clone();
        let mut found = self.reading(false, &node, false);
        found.lambda.clear();
        if multipliers || self.momenta {
            found.lambda = self.run.acceleration_multiplier()?;
        }
        if let Some(momenta) = &mut found.momenta {
            momenta.lambda.clone_from(&found.lambda);
        }
        Ok(found)
    }

    fn left(&mut self) -> Result<Reading, Singular> {
        let node = self.run.node_before()?.clone();
        Ok(self.reading(true, &node, true))
    }

    fn last(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        if self.run.reads_states() {
            return self.here(multipliers);
        }
        match self.run.observe().cloned() {
            Ok(node) => Ok(self.reading(false, &node, true)),
            Err(_) => self.here(multipliers),
        }
    }

    fn state(&self) -> MotionState {
        MotionState {
            state: self.run.state().clone(),
            ended: self.ended,
            work: self.work.parts.clone(),
            impulse: self.work.impulse().cloned(),
        }
    }

    fn resume(&mut self, from: MotionState) -> Result<(), ResumeError> {
        let mut work = self.work.clone();
        work.resume(from.work, from.impulse)?;
        self.run.resume(from.state)?;
        (self.work, self.ended) = (work, from.ended);
        Ok(())
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
        S::variational(&mut self.run)
    }

    fn energy_momentum(&mut self) -> Option<&mut EmIntegrator<Mechanism>> {
        S::energy_momentum(&mut self.run)
    }
}
