//! How much a change of the start grows, and what each term costs beside the run of a gradient.

use super::objective::Costs;
use super::prepared::{Begin, PathCost, Prepared};
use super::{TermValue, Wanted};
use crate::simulation::variational;
use crate::system;
use crate::system::outside::ExternalActions;
use holonom_model::{Family, Model, ModelError};
use vi_control::controls::Controls;
use vi_control::gradient::Passing;
use vi_control::growth::Neighbour;
use vi_control::sensitivities::DerivativeGrowth;
use vi_core::State;

/// How much a change of the start grows in a run of a model of so many steps; up to
/// [`MEANINGLESS`], for the price of two runs.
///
/// # Errors
/// [`ModelError`] of a model that does not run; a step that fails ends the run.
///
/// [`MEANINGLESS`]: vi_control::sensitivities::MEANINGLESS
pub(crate) fn growth(
    model: &Model,
    (outside, values): (&ExternalActions, &[Vec<f64>]),
    steps: usize,
) -> Result<DerivativeGrowth, ModelError> {
    let mut model = model.clone();
    model.settings.newton_tolerance = 0.0; // what is left of a step would count as a difference
    let mut prepared = Prepared::new(&model, &[], values, outside)?;
    let Family::Variational(kind) = model.settings.scheme.family() else {
        return Ok(DerivativeGrowth::NONE); // equilibria
    };
    let begin = Begin::new(&mut prepared)?;
    let Prepared { model, simulation, outside, controls, .. } = &mut prepared;
    let settings = &model.settings;
    let system = system::build_with(model, outside)?;
    let how = (kind, begin.at(), settings.solver.into());
    let other = variational((system.mechanism, &system.dynamics), model, how)?;
    let run = simulation.integrator();
    let mut beside = Neighbour::new(other, run.state(), settings.step);
    for step in 0..steps {
        controls.set(step);
        if beside.is_over() || run.step().is_err() {
            break;
        }
        beside.follow(run.state(), controls, step);
    }
    Ok(beside.growth())
}

/// The names of the terms that are wanted.
pub(super) fn terms_of<'a>(model: &'a Model, wanted: &Wanted) -> Vec<&'a String> {
    let chosen = |name: &&String| wanted.of.is_empty() || wanted.of.contains(name);
    model.objectives.iter().map(|own| &own.name).filter(chosen).collect()
}

/// What each term costs, beside the run of a gradient: of several, where no steps count.
#[derive(Default)]
pub(super) struct TermCosts {
    all: Vec<(String, PathCost<Costs>)>,
    h: f64,
}

impl TermCosts {
    pub(super) fn new(prepared: &mut Prepared, wanted: &Wanted) -> Result<Self, ModelError> {
        let model = prepared.model.clone();
        let (names, mut all) = (terms_of(&model, wanted), Vec::new());
        let Prepared { system, simulation, controls, costs, .. } = prepared;
        let run = simulation.integrator();
        controls.set(0);
        for name in names.iter().filter(|_| names.len() > 1 && !costs.sum.counts_steps()) {
            let own = Costs::new(&model, (&mut *system, &*run), std::slice::from_ref(*name), &[])?;
            all.push(((*name).clone(), PathCost::begin(own, run.state())));
        }
        Ok(Self { all, h: model.settings.step })
    }

    /// Sees the run.
    pub(super) fn see(&mut self, passing: Passing<'_>, controls: &Controls) {
        for (_, own) in &mut self.all {
            match passing {
                Passing::Step(s, step) => own.add_step(s, controls.at(step)),
                Passing::Node(node, _) => own.reach(node),
            }
        }
    }

    /// Their values at the end of the run; none where one run does not show them.
    pub(super) fn values(self, end: &State, controls: &Controls) -> Vec<TermValue> {
        let value = |(name, mut own): (String, PathCost<Costs>)| {
            let value = own.end(end, controls, self.h);
            TermValue { name, value }
        };
        self.all.into_iter().map(value).collect()
    }
}
