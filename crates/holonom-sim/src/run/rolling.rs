//! What is followed of constraints on velocities: the slip of each step, wheels that would lift
//! off.

use serde::{Deserialize, Serialize};
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::ReactionObserver;
use vi_multibody::rolling::{FLATTEST, LARGEST_TURN, Rolling};
use vi_multibody::scalar_constraint::ScalarRow;
use vi_rigid::directors;

use crate::digits::rounded;

/// Slip beyond rounding, relative to the largest rate of a coordinate.
const SLIPS: f64 = 1e-9;
/// Pull of the ground beyond rounding, relative to the largest constraint force.
const PULLS: f64 = 1e-6;

/// What was followed, as data.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RollingState {
    /// `A_d` of the step that ended, of each row, m/s.
    pub(crate) slips: Vec<f64>,
    /// The largest that is no rounding, of each row, m/s.
    worst: Vec<f64>,
    /// When each wheel would have left its plane, s.
    lifted: Vec<Option<f64>>,
}

/// Follows the constraints on velocities of a run.
#[derive(Debug)]
pub(crate) struct RollingWatch {
    state: RollingState,
    wheels: Vec<usize>, // rows of the heights, among all constraints
    observer: Option<ReactionObserver>,
}

impl RollingWatch {
    /// For a mechanism; follows nothing where velocities are not constrained.
    pub(crate) fn new(mechanism: &Mechanism) -> Self {
        let rows = mechanism.velocity_rows().count();
        let first = mechanism.len_internal();
        let all = mechanism.rows().iter().enumerate();
        let wheels: Vec<usize> = all
            .filter(|(_, row)| matches!(row, ScalarRow::Height(_)))
            .map(|(k, _)| first + k)
            .collect();
        let observer = (!wheels.is_empty()).then(|| ReactionObserver::new(mechanism));
        let state = RollingState {
            slips: vec![0.0; rows],
            worst: vec![0.0; rows],
            lifted: vec![None; wheels.len()],
        };
        Self { state, wheels, observer }
    }

    /// For another mechanism, with what was followed where its rows are those of this one.
    pub(crate) fn continued(&self, mechanism: &Mechanism) -> Self {
        let mut next = Self::new(mechanism);
        next.resume(self.state.clone());
        next
    }

    /// Whether constraint forces are needed.
    pub(crate) fn needs_forces(&self) -> bool {
        self.observer.is_some()
    }

    /// The state.
    pub(crate) fn state(&self) -> &RollingState {
        &self.state
    }

    /// Continues from a state of the same model.
    pub(crate) fn resume(&mut self, state: RollingState) {
        let fits = state.slips.len() == self.state.slips.len()
            && state.worst.len() == self.state.worst.len()
            && state.lifted.len() == self.state.lifted.len();
        if fits {
            self.state = state;
        }
    }

    /// Takes up a step that was taken.
    pub(crate) fn follow_step(&mut self, mechanism: &Mechanism, s: &Interval) {
        if self.state.slips.is_empty() {
            return;
        }
        let bound = SLIPS * norm_inf(&s.v_mid);
        let RollingState { slips, worst, .. } = &mut self.state;
        for (((_, row), slip), worst) in mechanism.velocity_rows().zip(slips).zip(worst) {
            *slip = row.gap(s) / s.h;
            if slip.abs() > bound {
                *worst = worst.max(slip.abs());
            }
        }
    }

    /// The wheel whose axis has more than a part `flattest` along the normal of its plane, and what
    /// to do.
    pub(crate) fn flat(
        &self,
        mechanism: &Mechanism,
        q: &[f64],
        flattest: f64,
    ) -> Option<(String, String)> {
        let mut all = self.rolling(mechanism).map(|(name, own)| (name, own.flatness(q)));
        let (name, flatness) = all.find(|(_, flatness)| *flatness > flattest)?;
        let part = rounded(flatness, 4);
        let message = format!(
            "the wheel of `{name}` lies flat on its plane: {part} of its axis is along the normal, \
             rolling is taken to {FLATTEST}"
        );
        Some((message, "end the run before it falls over, by an event with `end = true`".into()))
    }

    /// What turns too far in a step that could not be taken, and what to do: by the step before
    /// it, or by the velocity `v` at its start.
    pub(crate) fn turning(
        &self,
        mechanism: &Mechanism,
        before: Option<&Interval>,
        q: &[f64],
        v: &[f64],
        h: f64,
    ) -> Option<(String, String)> {
        const NEAR: f64 = 0.8; // of the largest turn
        let turn = |own: &Rolling| {
            let frame = 12 * own.frame..12 * own.frame + 12;
            let rate = directors::angular_velocity(&q[frame.clone()], &v[frame]).norm();
            before.map_or(rate * h.abs(), |s| own.turn(s))
        };
        let mut all = self.rolling(mechanism).map(|(name, own)| (name, turn(own)));
        let (name, turn) = all.find(|(_, turn)| *turn > NEAR * LARGEST_TURN)?;
        let step = rounded(h.abs() * 0.3 / turn, 2);
        let message = format!(
            "what rolls by `{name}` turns by {} rad in a step, at most {LARGEST_TURN} are taken",
            rounded(turn, 3)
        );
        Some((message, format!("write a smaller step: {step} s turns it by 0.3 rad")))
    }

    /// What rolls, with the names of its constraints.
    fn rolling<'a>(
        &'a self,
        mechanism: &'a Mechanism,
    ) -> impl Iterator<Item = (&'a str, &'a Rolling)> {
        self.wheels.iter().filter_map(|row| {
            match &mechanism.rows()[row - mechanism.len_internal()] {
                ScalarRow::Height(own) => Some((mechanism.constraint_name(*row), &**own)),
                _ => None,
            }
        })
    }

    /// Takes up a recorded node with its constraint force, N, and its kinetic energy, J.
    pub(crate) fn follow_node(
        &mut self,
        mechanism: &Mechanism,
        at: Configuration<'_>,
        force: &[f64],
        kinetic: f64,
        rows: &IndependentRows,
    ) {
        let Self { state, wheels, observer: Some(observer) } = self else { return };
        if force.is_empty() || state.lifted.iter().all(Option::is_some) {
            return;
        }
        let largest = PULLS * norm_inf(force);
        let reactions = observer.observe(mechanism, at, force, rows);
        for (row, lifted) in wheels.iter().zip(&mut state.lifted).filter(|(_, l)| l.is_none()) {
            let ScalarRow::Height(rolling) = &mechanism.rows()[row - mechanism.len_internal()]
            else {
                continue;
            };
            let normal = reactions.scalar_row(*row);
            let rounding = 1e-9 * kinetic / (rolling.circle + rolling.section);
            if normal.unique && normal.force < -(largest + rounding) {
                *lifted = Some(at.t);
            }
        }
    }

    /// What is worth knowing.
    pub(crate) fn warnings(&self, mechanism: &Mechanism) -> Vec<String> {
        let name = |row: usize| mechanism.constraint_name(row).to_owned();
        let lifted = self.wheels.iter().zip(&self.state.lifted);
        let lifted = lifted.filter_map(|(row, t)| {
            Some(format!(
                "`{}` would have left its plane at t = {} s: a rolling constraint holds it down, \
                 too",
                name(*row),
                rounded((*t)?, 6)
            ))
        });
        let slipping = mechanism.velocity_rows().zip(&self.state.worst);
        let slipping = slipping.filter(|(_, worst)| **worst > 0.0).map(|((row, _), worst)| {
            format!(
                "`{}` slips by up to {} m/s within a step: one of its conditions follows from the \
                 others at the nodes and is not enforced; a smaller step slips less",
                name(row),
                rounded(*worst, 2)
            )
        });
        lifted.chain(slipping).collect()
    }
}
