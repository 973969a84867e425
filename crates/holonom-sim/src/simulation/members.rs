//! Simulations of one topology, stepped side by side.
//!
//! Trees of rigid bodies move in lanes, [`vi_multibody::ensemble`]: a member has the bits of its
//! own simulation. Where more is followed along a run than unwrapped angles, or something is
//! decided between two steps, simulations go on by themselves.

use super::{Simulation, options};
use crate::sensor::{Sensors, View};
use crate::stepper::AnyStepper;
use holonom_model::{Family, LinearSolver};
use vi_constraints::Options;
use vi_core::linear::Singular;
use vi_multibody::ensemble::{Ensemble, Recorded};

/// Members that are stepped together.
#[derive(Debug)]
pub struct Members {
    ensemble: Ensemble,
    sensors: Vec<Option<Sensors>>, // of each member; none where there are no sensors
    velocity: Vec<f64>,            // n  of the member that was sensed last
}

impl Simulation {
    /// How it moves in lanes; `None` where it cannot.
    #[must_use]
    pub fn lanes(&self) -> Option<Options> {
        let AnyStepper::Variational(own) = &self.stepper else { return None };
        let (run, settings) = (own.integrator(), &self.settings);
        let Family::Variational(kind) = settings.scheme.family() else { return None };
        let plain = settings.solver == LinearSolver::default()
            && self.events.is_none()
            && self.controller.is_none()
            && self.beams.list.is_empty()
            && self.laws.is_empty()
            && run.state().internal.is_empty()
            && self.sensors.wanted().is_motion_alone();
        let options = options(kind, settings);
        (plain && Ensemble::has_lanes_for(run, &options)).then_some(options)
    }
}

impl Members {
    /// Of simulations between two steps, all with the options that lanes have for the first one
    /// ([`Simulation::lanes`]); they are given back where these differ.
    ///
    /// # Errors
    /// The simulations.
    pub fn new(simulations: Vec<Simulation>) -> Result<Self, Vec<Simulation>> {
        let Some(options) = simulations.first().and_then(Simulation::lanes) else {
            return Err(simulations);
        };
        if simulations.iter().any(|own| own.lanes() != Some(options)) {
            return Err(simulations);
        }
        let (mut runs, mut sensors) = (Vec::new(), Vec::new());
        for Simulation { stepper, sensors: own, .. } in simulations {
            runs.extend(stepper.into_variational());
            sensors.push((!own.columns().is_empty()).then_some(own));
        }
        let ensemble = Ensemble::of_integrators(runs, &options);
        Ok(Self { ensemble, sensors, velocity: Vec::new() })
    }

    /// Takes `steps` steps with every member that has not failed.
    pub fn step(&mut self, steps: u64) {
        let follow = |sensors: &mut Sensors, member: Recorded<'_>| {
            sensors.follow(&member.state().q);
        };
        self.ensemble.record(steps, &mut self.sensors, follow);
    }

    /// Time and configuration of a member.
    ///
    /// # Panics
    /// When there is no such member.
    #[must_use]
    pub fn place(&self, member: usize) -> (f64, &[f64]) {
        let state = self.ensemble.member(member).state();
        (state.t, &state.q)
    }

    /// The members whose step was refused; they stay where it began.
    pub fn failed(&self) -> impl Iterator<Item = usize> {
        self.ensemble.failures().enumerate().filter_map(|(k, failure)| failure.map(|_| k))
    }

    /// `out ←` what the sensors of a member measure at its present node.
    ///
    /// # Errors
    /// [`Singular`] when its constraints have lost rank.
    ///
    /// # Panics
    /// When there is no such member.
    pub fn sense(&mut self, member: usize, out: &mut Vec<f64>) -> Result<(), Singular> {
        out.clear();
        let Self { ensemble, sensors, velocity } = self;
        let Some(sensors) = &mut sensors[member] else { return Ok(()) };
        velocity.resize(ensemble.member(member).state().q.len(), 0.0);
        ensemble.velocity(member, velocity)?;
        let run = ensemble.member(member);
        let view = View::of_motion(run.state(), velocity);
        sensors.read(run.constraints(), run.rows(), view, out);
        Ok(())
    }
}
