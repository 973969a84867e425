//! A run before its first step: what its assembly found, part by part.
//!
//! | part | from |
//! |---|---|
//! | size, redundant constraints, closure | the mechanism and its independent constraints |
//! | stiffest element | the beams against the step |
//! | measures, what looks like a slip | the model and its masses |
//! | relaxed or projected configuration and velocities | the stated initial values and those found |
//! | locked and nearly redundant loops | the configuration found |
//! | bent elements | the beams in that configuration |
//!
//! Warnings are given in this order; those of rotations and vibrations follow
//! ([`super::resolved`]).

use crate::assembly::loops;
use crate::assembly::{self, AssemblyReport};
use crate::resolution::limits::{LimitWatch, Stiffness};
use crate::resolution::rotation_stability::unstable_steps;
use crate::start::{self, How, StartValues};
use crate::stepper::AnyStepper;
use crate::system::beams::Beams;
use holonom_model::Model;
use vi_core::SparseMatrix;
use vi_multibody::mechanism::Mechanism;

/// Initial values as a model states them.
pub(super) struct StatedStart {
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    closure: assembly::Closure,
}

impl StatedStart {
    pub(super) fn of(mechanism: &Mechanism) -> Self {
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let closure = assembly::closure(mechanism, &q, &v);
        Self { q, v, closure }
    }

    /// Those that are given from outside count as stated.
    pub(super) fn given(mechanism: &Mechanism, start: &StartValues) -> Self {
        let (q, v) = (start.q.clone(), start.v.clone());
        let closure = assembly::closure(mechanism, &q, &v);
        Self { q, v, closure }
    }
}

/// A run at its start, whose node has been read.
pub(super) struct Begun<'a> {
    pub(super) model: &'a Model,
    pub(super) stated: &'a StatedStart,
    pub(super) start: &'a StartValues,
    pub(super) stepper: &'a AnyStepper,
    pub(super) beams: &'a Beams,
    pub(super) mass: &'a SparseMatrix,
}

impl Begun<'_> {
    /// What was found; `limits`: of the beams at the start.
    pub(super) fn report(&self, limits: &LimitWatch) -> AssemblyReport {
        let Self { model, stated, stepper, beams, mass, .. } = *self;
        let (mechanism, settings) = (stepper.mechanism(), &model.settings);
        let mut report = assembly::counts(model, mechanism, stepper.rows(), beams, stated.closure);
        let dof = report.counts.dof;
        report.step_judged(self.stiffness(dof), settings);
        report.measure(model, mechanism, mass);
        self.add_changes(&mut report);
        report.warnings.extend(loops::remarks(model, mechanism, stepper.place().2, dof));
        report.warnings.extend(limits.warnings());
        report
    }

    /// The stiffest element, with the steps that rotations make unstable.
    fn stiffness(&self, dof: usize) -> Option<Stiffness> {
        let mut stiffness = Stiffness::new(self.beams, &self.stated.q, &self.model.settings)?;
        stiffness.unstable = unstable_steps(self.model, &stiffness, dof);
        Some(stiffness)
    }

    /// How the initial values differ from the stated ones.
    fn add_changes(&self, report: &mut AssemblyReport) {
        let Self { stated: StatedStart { q, v, .. }, start, stepper, .. } = self;
        let (mechanism, projected) = (stepper.mechanism(), stepper.start_report());
        let (found, velocity) = (stepper.place().2, &stepper.node().node.v[..]);
        if let How::Relaxed { speed, unstable, .. } = start.how {
            let moved = q.iter().zip(&start.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            return report.configuration_relaxed(moved, speed, unstable);
        }
        let keeps_rates = start.how == How::WithRates;
        if start.separated {
            let (moved, changed) = start::change_of_configuration(mechanism, q, found);
            report.shapes_separated(moved, &changed);
        } else if keeps_rates || projected.position_moved > 0.0 {
            let (moved, changed) = start::change_of_configuration(mechanism, q, found);
            report.configuration_projected(moved, &changed);
        }
        if keeps_rates || projected.velocity_moved > 0.0 {
            let changed = start::change_of_velocities(mechanism, q, v, found, velocity);
            report.velocity_projected(&changed, keeps_rates);
        }
    }
}
