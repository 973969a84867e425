//! The step against rotations and the fastest motion.

use super::Simulation;
use crate::assembly::AssemblyReport;
use crate::resolution::rotation::RotationWatch;
use crate::resolution::{RESOLVED, Resolution, probe, stiff_laws};
use crate::stepper::{AnyStepper, NodeOf};
use holonom_model::Model;
use vi_constraints::{Constraints, InitialValues};

/// Times at which it is asked what prescribed motions turn.
const TIMES: u32 = 8;
/// A rotation along a run is worth a word beside that of the start if it is so much faster.
const FASTER: f64 = 1.1;

/// Of the start, with the warnings.
pub(super) fn judge(
    model: &Model,
    stepper: &mut AnyStepper,
    at: InitialValues<'_>,
    watch: &mut RotationWatch,
    assembly: &mut AssemblyReport,
) {
    let settings = &model.settings;
    let driven = stepper.mechanism().is_rheonomic();
    let mut free = stepper.node().node.v.clone();
    let mut own;
    let run = match stepper.as_variational() {
        Some(run) => Some(run),
        None => {
            own = probe(model, at);
            own.as_mut()
        }
    };
    if let Some(run) = run {
        for k in (0..=TIMES).filter(|_| driven) {
            let t = settings.end * f64::from(k) / f64::from(TIMES);
            let Ok(v) = run.prescribed_velocity(t) else { continue };
            watch.drive(&v);
            if k == 0 {
                free.iter_mut().zip(&v).for_each(|(free, v)| *free -= v);
            }
        }
        if assembly.counts.dof > 0 {
            match Resolution::at(run, model.bodies.len(), settings) {
                Ok(found) => assembly.fastest_motion = Some(found),
                Err(why) => assembly.fastest_motion_unknown = Some(why),
            }
            if !model.laws.is_empty() {
                assembly.warnings.extend(stiff_laws::warnings(run, model));
            }
        }
    }
    let rotation = watch.of(0.0, &free, true, settings);
    let impulses = model.is_nonsmooth();
    let vibration = assembly.fastest_motion.as_ref();
    let vibration =
        vibration.and_then(|found| found.warning(settings, rotation.as_ref(), impulses));
    let turning = rotation.as_ref().and_then(|rotation| rotation.warning(settings, impulses));
    assembly.warnings.extend(turning.into_iter().chain(vibration));
    assembly.fastest_rotation = rotation;
}

impl Simulation {
    /// The warning of the fastest rotation along the run, where that of the start is not about it.
    pub(super) fn rotation_warning(&self) -> Option<String> {
        let fastest = self.rotation.so_far(&self.settings).filter(|_| !self.rotation.failed)?;
        let start = self.assembly.fastest_rotation.as_ref().filter(|own| own.is_notable());
        let known = start.is_some_and(|start| fastest.rate < FASTER * start.rate);
        if known { None } else { fastest.warning(&self.settings, self.contacts.has_impulses()) }
    }

    /// What to do where a step is not found, if that is because of a rotation or a vibration that
    /// it does not resolve, and the step (s) that does.
    pub(super) fn remedy_of_step(&mut self) -> Option<(String, f64)> {
        let impulses = self.contacts.has_impulses();
        let Self { stepper, rotation, settings, assembly, bodies, .. } = self;
        stepper.observe(NodeOf::State).ok()?;
        let here = stepper.node();
        let fastest = rotation.of(here.state.t, &here.node.v, false, settings);
        fastest.and_then(|fastest| fastest.remedy(settings)).or_else(|| {
            // where the start is too coarse, the node is not that of the motion
            let start = assembly.fastest_motion.as_ref();
            match start.filter(|start| start.is_beyond(RESOLVED, settings)) {
                Some(start) => start.remedy(settings, impulses),
                None => {
                    let here = Resolution::at(stepper.as_variational()?, *bodies, settings).ok()?;
                    here.remedy(settings, impulses)
                }
            }
        })
    }
}
