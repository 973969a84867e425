//! An integrator of either family in motion, as a [`Method`].
//!
//! The multiplier of a node is that of (36), of energy–momentum schemes the mean of the steps
//! beside it; where a node has no such step (at the end, where a step fails, and with a
//! composition) it is taken from the acceleration level. So are accelerations,
//! [`super::increments`].

use super::family::Family;
use super::increments::Increments;
use super::work::Work;
use super::{Method, Reading, Wanted};
use crate::run_state::{MotionState, same_length};
use crate::sample::{Momenta, Residuals};
use holonom_model::Settings;
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::{ResumeError, StepReport};
use vi_constraints::node::Node;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_constraints::{Integrator, Reparametrization};
use vi_core::force::Source;
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
    wanted: Wanted,     // what sensors ask for
    map: Option<TreeMap>, // for the reduced ones
    work: Work,
    increments: Option<Increments>, // at order 2, where accelerations are asked for
}

impl<S: Family> Running<S> {
    /// `wanted`: what sensors ask for.
    pub(crate) fn new(
        mut run: Integrator<S, Mechanism>,
        settings: &Settings,
        wanted: Wanted,
    ) -> Self {
        // the force of a variational scheme is that of its step equation, without multipliers
        run.record_multipliers(settings.momenta || wanted.forces && !S::VARIATIONAL);
        let map = (settings.momenta && S::VARIATIONAL).then(|| TreeMap::new(run.constraints()));
        let work = S::work(&run);
        let Settings { order, momenta, .. } = *settings;
        let differences = wanted.accelerations && !run.reads_states();
        let increments = differences.then(|| Increments::new(run.state().q.len()));
        Self { run, order, ended: None, momenta, wanted, map, work, increments }
    }

    /// Momenta of a node; without a `step` from there only those of its state.
    fn read_momenta(&self, at: &State, node: &Node, step: bool, found: &mut Momenta) {
        if let Some(map) = &self.map {
            found.p_projected.clone_from(&node.p_projected);
            found.p_reduced.resize(map.dof(), 0.0);
            map.pull_back(&at.q, &node.p_projected, &mut found.p_reduced);
            found.hamiltonian_projected = Some(node.hamiltonian_projected);
            found.discrete_energy = step.then_some(node.discrete_energy);
        }
        found.lambda.clear();
        if step {
            found.lambda.clone_from(&node.lambda);
        }
        found.p.clear();
        found.hamiltonian = None;
        if step || !S::VARIATIONAL {
            found.p.clone_from(&node.p);
            found.hamiltonian = node.hamiltonian;
        }
    }

    /// The node that was observed; `before`: that which the last step started from; `step`: with
    /// what belongs to the step from it.
    fn read(&self, before: bool, step: bool, found: &mut Reading) {
        let at = if before { self.run.before() } else { self.run.state() };
        let (mechanism, node) = (self.run.constraints(), self.run.observed(at));
        let (energy, hamiltonian) =
            (node.discrete_energy.total(), node.hamiltonian_projected.total());
        let of_step =
            if S::VARIATIONAL && self.run.reads_states() { self.ended } else { Some(energy) };
        (found.step, found.t) = (at.step, at.t);
        found.q.clone_from(&at.q);
        found.angles.clone_from(&at.angles);
        found.v.clone_from(&node.v);
        found.force.clear();
        if self.wanted.forces {
            found.force.extend_from_slice(&node.constraint_force);
        }
        (found.energy, found.hamiltonian) = (energy, hamiltonian);
        found.kinetic = node.hamiltonian_projected.kinetic;
        found.shadow = of_step.map(|step| shadow_energy(self.order, hamiltonian, step));
        self.work.at(before, &at.p, (&node.p_projected, &node.v), &mut found.work);
        found.momentum = mechanism.momentum(&at.q, &node.p_projected);
        found.residuals = Residuals {
            position: node.position_residual,
            velocity: node.velocity_residual,
            momentum: node.momentum_residual,
        };
        if self.momenta {
            self.read_momenta(at, node, step, found.momenta.get_or_insert_default());
        }
    }
}

impl<S: Family> Running<S> {
    /// `Gᵀλ` of the acceleration level at the present node, and its acceleration where that is
    /// asked for.
    fn find_acceleration(&mut self, found: &mut Reading) -> Result<(), Singular> {
        let lambda = found.momenta.as_mut().map(|momenta| &mut momenta.lambda);
        self.run.find_acceleration_force(&mut found.force, lambda)?;
        if self.wanted.accelerations {
            found.acceleration.clone_from(&self.run.observed(self.run.state()).acceleration);
        }
        Ok(())
    }
}

impl<S: Family + 'static> Method for Running<S> {
    fn step(&mut self, parts: u32) -> Result<StepReport, StepError> {
        let Self { run, work, ended, increments, .. } = self;
        let composed = run.reads_states();
        work.begin();
        increments.iter_mut().for_each(Increments::begin);
        let (mut action_rate, mut length) = (0.0, 0.0); // E_d = −∂/∂h of the action
        let taken = run.step_in_parts(parts, &mut |system, mechanism, step| {
            system.add_work(mechanism, step, work);
            increments.iter_mut().for_each(|increments| increments.add(step.s));
            if composed {
                action_rate += system.action_rate(step);
                length += step.s.h;
            }
        });
        match taken {
            Ok(_) if composed => *ended = Some(action_rate / length),
            Ok(_) => {}
            Err(_) => {
                work.take_back();
                increments.iter_mut().for_each(Increments::take_back);
            }
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

    fn here(&mut self, wanted: Wanted, found: &mut Reading) -> Result<(), Singular> {
        self.run.observe_state()?;
        self.read(false, false, found);
        if wanted.any() || self.momenta {
            self.find_acceleration(found)?;
        }
        Ok(())
    }

    fn left(&mut self, found: &mut Reading) -> Result<(), Singular> {
        self.run.node_before()?;
        self.read(true, true, found);
        if let Some(increments) = &self.increments {
            increments.acceleration(&mut found.acceleration); // at the start none: see `here`
        }
        Ok(())
    }

    fn last(&mut self, wanted: Wanted, found: &mut Reading) -> Result<(), Singular> {
        if wanted.accelerations && !self.run.reads_states() {
            self.find_acceleration(found)?; // first: one node is observed at a time
        }
        let alone = self.run.reads_states() || self.run.observe().is_err();
        if alone {
            return self.here(wanted, found);
        }
        self.read(false, true, found);
        Ok(())
    }

    fn state(&self) -> MotionState {
        MotionState {
            state: self.run.state().clone(),
            ended: self.ended,
            work: self.work.parts.clone(),
            impulse: self.work.impulse().cloned(),
            increment: self.increments.as_ref().map(Increments::state),
        }
    }

    fn resume(&mut self, from: MotionState) -> Result<(), ResumeError> {
        let mut work = self.work.clone();
        work.resume(from.work, from.impulse)?;
        let given = usize::from(from.increment.is_some());
        same_length("the list of increments", given, usize::from(self.increments.is_some()))?;
        if let (Some(own), Some(last)) = (&mut self.increments, from.increment) {
            own.resume(last)?;
        }
        self.run.resume(from.state)?;
        (self.work, self.ended) = (work, from.ended);
        Ok(())
    }

    fn sources(&self) -> &[Source] {
        self.run.system().sources()
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
