//! Numbers of sensors that signals read as they were at the node before: reactions, accelerations,
//! forces of contacts, works.
//!
//! ```text
//! m_n     the number at the node n, with what is held there; m_0 before the first step
//! sampled at the node n + 1, kept for a delay there:   value(y_{n+1}, m_n)
//! ```
//! They stand among the internal variables of signals, so that a run goes on from them.

use super::{RunFailure, Simulation};
use vi_constraints::integrator::NodeInStep;
use vi_core::state::State;

/// What is measured for signals.
#[derive(Debug, Default)]
pub(super) struct MeasuredSignals {
    places: Vec<(usize, usize)>, // columns of sensors, and internal variables
    node: State,                 // scratch
    sensors: Vec<f64>,           // scratch
}

impl MeasuredSignals {
    pub(super) fn new(places: Vec<(usize, usize)>) -> Self {
        Self { places, ..Self::default() }
    }
}

impl Simulation {
    /// Holds what is measured at the present node.
    pub(super) fn measure(&mut self) -> Result<(), RunFailure> {
        if self.measured.places.is_empty() {
            return Ok(());
        }
        std::mem::swap(&mut self.sample.sensors, &mut self.measured.sensors);
        let found = self.sense().map(|_| ());
        std::mem::swap(&mut self.sample.sensors, &mut self.measured.sensors);
        found?;
        let first = self.stepper.places_of_signals().start;
        let Self { stepper, measured, .. } = self;
        let MeasuredSignals { places, node, sensors } = measured;
        node.copy_from(stepper.at(NodeInStep::After));
        for (column, held) in &*places {
            node.internal[first + held] = sensors[*column];
        }
        if let Some(run) = stepper.as_variational() {
            run.place_at(node);
        }
        Ok(())
    }

    /// The same before the first step.
    pub(super) fn measure_at_start(&mut self) -> Result<(), RunFailure> {
        match self.stepper.place().0 {
            0 => self.measure(),
            _ => Ok(()),
        }
    }
}
