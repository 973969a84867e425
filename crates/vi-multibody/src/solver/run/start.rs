//! Independent constraints of closed loops, and starts in singular configurations.

use crate::mechanism::{Mechanism, NearlyRedundant};
use crate::solver::closed_loop::loop_rank::LoopRank;
use vi_constraints::agreement::contradiction;
use vi_constraints::discretization::Discretization;
use vi_constraints::initialization::{StartReport, start};
use vi_constraints::integrator::{SetupError, SingularStart};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::{Constraints, InitialValues, Integrator};
use vi_core::{Configuration, MechanicalSystem};

/// The independent constraints of the motion, and of its initial configuration where fewer are
/// independent there.
#[derive(Clone, Debug)]
pub struct IndependentLoops {
    /// Of the motion.
    pub rows: IndependentRows,
    /// Of the initial configuration, where it is singular.
    pub rows_at_start: Option<IndependentRows>,
    /// What is known of the loops; `None` without loops of bodies.
    pub rank: Option<LoopRank>,
}

impl IndependentLoops {
    /// Looks initially `(t, q)` of a mechanism.
    ///
    /// # Errors
    /// [`SetupError::RankAtStart`] where bars, or loops beside point masses, lose rank.
    pub fn find(mechanism: &Mechanism, t: f64, q: &[f64]) -> Result<Self, SetupError> {
        if !mechanism.has_loops() {
            let rows = IndependentRows::all(mechanism.len());
            return Ok(Self { rows, rows_at_start: None, rank: None });
        }
        if !mechanism.has_loops_of_bodies() || !mechanism.separates_points() {
            let rows = IndependentRows::find_generic(mechanism, t, q)?;
            return Ok(Self { rows, rows_at_start: None, rank: None });
        }
        let rank = LoopRank::find(mechanism, t, q);
        let mut rows = rank.rows(mechanism);
        let mut at_start = rank.is_singular().then(|| rank.rows_at_start(mechanism));
        if let Some(dependent) = dependent_bars(mechanism, t, q)? {
            [Some(&mut rows), at_start.as_mut()].into_iter().flatten().for_each(|rows| {
                let independent = rows.rows().iter().filter(|row| !dependent.contains(row));
                rows.replace(&independent.copied().collect::<Vec<_>>());
            });
        }
        Ok(Self { rows, rows_at_start: at_start, rank: Some(rank) })
    }

    /// Constraints of the loops that are taken as redundant because they nearly are.
    #[must_use]
    pub fn nearly_redundant(&self) -> Option<NearlyRedundant> {
        self.rank.as_ref().and_then(|rank| rank.nearly_redundant().cloned())
    }

    /// Consistent initial values at a singular configuration `at`; `leaves`: whether the scheme can
    /// leave a singular configuration.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn singular_start(
        &self,
        system: &impl MechanicalSystem,
        mechanism: &Mechanism,
        at: InitialValues<'_>,
        leaves: bool,
    ) -> Result<Option<LoopStart>, SetupError> {
        let Some(rows) = &self.rows_at_start else { return Ok(None) };
        if !leaves {
            return Err(self.refusal(SingularStart::Scheme));
        }
        let found = start(system, mechanism, rows, at)?;
        if let Some(error) =
            contradiction(mechanism, rows, found.state.configuration().moving(&found.v))
        {
            return Err(error.into());
        }
        let (q, v, report) = (found.state.q, found.v, found.report);
        Ok(Some(LoopStart { q, v, rows: rows.clone(), report }))
    }

    /// That the rank of the loops is known, see [`LoopRank::known`].
    ///
    /// # Errors
    /// [`SetupError::RankUnknown`].
    pub fn known(&self, mechanism: &Mechanism, at: Configuration<'_>) -> Result<(), SetupError> {
        self.rank.as_ref().map_or(Ok(()), |rank| rank.known(mechanism, at))
    }

    /// The refusal of a singular initial configuration.
    #[must_use]
    pub fn refusal(&self, reason: SingularStart) -> SetupError {
        self.rank.as_ref().map_or_else(
            || SetupError::SingularStart { joint: String::new(), reason },
            |rank| rank.refusal(reason),
        )
    }
}

/// The constraints of bars that depend on others; `None` where bars close no loop.
fn dependent_bars(
    mechanism: &Mechanism,
    t: f64,
    q: &[f64],
) -> Result<Option<Vec<usize>>, SetupError> {
    if mechanism.cut_bars().is_empty() {
        return Ok(None);
    }
    let Some([bodies, points]) = mechanism.bodies_and_points() else { return Ok(None) };
    let rows = IndependentRows::find_generic(&points, t, &q[bodies.dim()..])?;
    Ok(Some(rows.redundant().map(|bar| mechanism.bar_rows(bar).start).collect()))
}

/// Initial values in a singular configuration, consistent with the constraints that are independent
/// there.
#[derive(Clone, Debug)]
pub struct LoopStart {
    /// `q(0)`, shape `n`.
    pub q: Vec<f64>,
    /// `v(0)`, shape `n`.
    pub v: Vec<f64>,
    /// The constraints that are independent there.
    pub rows: IndependentRows,
    /// How consistent it was as given.
    pub report: StartReport,
}

/// A run with consistent initial values, those of a singular initial configuration if there is one.
///
/// # Errors
/// [`SetupError::Contradiction`].
pub fn begun<S: Discretization<Mechanism>>(
    run: Integrator<S, Mechanism>,
    start: Option<LoopStart>,
) -> Result<Integrator<S, Mechanism>, SetupError> {
    match start {
        Some(start) => Ok(run.starting_singular(&start.rows, start.report)),
        None => run.consistent(),
    }
}
