//! Laws that the step does not resolve.
//!
//! ```text
//! h² k/m,  h c/m > 10        k = −xᵀ (∂f/∂q) x,  c = −xᵀ (∂f/∂v) x,  xᵀMx = m = 1, of the motion x that has the most
//! ```
//! A step stays stable there, and its error changes its sign from step to step.

use crate::digits::rounded;
use holonom_model::{Model, Settings};
use vi_core::force::Source;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{Configuration, SeparableSystem};
use vi_multibody::run::MechanismIntegrator;

/// `h² k/m` and `h c/m` above which a law is named.
const STIFF: f64 = 10.0;

/// What of a force is looked at.
#[derive(Clone, Copy)]
enum ForceSlope {
    ByCoordinate,
    ByRate,
}

impl ForceSlope {
    fn emit(
        self,
        system: &SeparableSystem,
        force: usize,
        at: Configuration<'_>,
        out: &mut dyn Entries,
    ) {
        let rest = vec![0.0; at.q.len()];
        match self {
            Self::ByCoordinate => system.stiffness_of(force, at.moving(&rest), out),
            Self::ByRate => system.damping_of(force, at.moving(&rest), out),
        }
    }

    /// `h²` or `h`.
    fn scale(self, h: f64) -> f64 {
        match self {
            Self::ByCoordinate => h * h,
            Self::ByRate => h,
        }
    }
}

/// The laws of a model that are stiff at the start, in words; nothing where that is not known.
pub(crate) fn warnings(run: &mut MechanismIntegrator, model: &Model) -> Vec<String> {
    let is_law = |source: &Source| match source {
        Source::Element(name) => model.laws.iter().any(|law| law.name == *name),
        Source::System(_) => false,
    };
    let laws: Vec<usize> =
        (0..run.system().sources().len()).filter(|k| is_law(&run.system().sources()[*k])).collect();
    let slopes = [ForceSlope::ByCoordinate, ForceSlope::ByRate];
    slopes.iter().filter_map(|slope| stiffest(run, *slope, &laws, &model.settings)).collect()
}

fn stiffest(
    run: &mut MechanismIntegrator,
    slope: ForceSlope,
    laws: &[usize],
    settings: &Settings,
) -> Option<String> {
    let emit = |system: &SeparableSystem, at: Configuration<'_>, out: &mut dyn Entries| {
        laws.iter().for_each(|force| slope.emit(system, *force, at, out));
    };
    let x = run.fastest_motions(&emit, &|_| false).ok()?.all.velocity;
    let (system, state) = (run.system(), run.state());
    let n = x.len();
    let share = |force: &usize| {
        let matrix = SparseMatrix::assemble(n, n, |out| {
            slope.emit(system, *force, state.configuration(), out);
        });
        (matrix.bilinear(&x, &x), *force)
    };
    let (most, force) = laws.iter().map(share).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let found = slope.scale(settings.step) * most;
    let Source::Element(name) = &system.sources()[force] else { return None };
    (found > STIFF).then(|| {
        let (what, step) = match slope {
            ForceSlope::ByCoordinate => ("h² k/m", settings.step * (STIFF / found).sqrt()),
            ForceSlope::ByRate => ("h c/m", settings.step * STIFF / found),
        };
        format!(
            "law `{name}` is stiff: {what} = {} at the start; its error changes its sign from step to step, and step = {} \
             would resolve it",
            rounded(found, 3),
            rounded(step, 2)
        )
    })
}
