//! How a run ended.

use serde::{Deserialize, Serialize};

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum RunOutcome {
    /// At its end time.
    Done,
    /// Before.
    Failed(RunFailure),
}

/// Why a run ended before its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFailure {
    /// The step that could not be taken.
    pub step: u64,
    /// The time where it began, s.
    pub t: f64,
    /// What happened.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

/// What the continuation along the loads was like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StaticFacts {
    /// Equilibria found, the first one included.
    pub equilibria: u64,
    /// Steps that were halved.
    pub halvings: u64,
    /// Largest force or moment left over in an equilibrium, N or N·m.
    pub max_residual: f64,
    /// Largest time of the loads that was reached, s.
    pub largest_time: f64,
    /// Whether some direction has no stiffness.
    pub neutral: bool,
    /// Whether the path was followed by its arc length.
    pub arc_length: bool,
    /// Equilibria that are unstable.
    #[serde(default)]
    pub unstable: u64,
    /// Equilibria of which it is not known whether they are stable.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub unjudged: u64,
    /// Where the path first turned unstable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost_stability: Option<LostStability>,
    /// Time of the loads where the path was left for a branch that bifurcates, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub switched: Option<f64>,
    /// Time of the last equilibrium, s.
    #[serde(skip)]
    pub last_time: Option<f64>,
}

/// The first unstable equilibrium of a path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LostStability {
    /// Time of the loads at the stable equilibrium before, s; `None` where the first equilibrium is
    /// unstable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<f64>,
    /// Time of the loads there, s.
    pub at: f64,
    /// How many directions are unstable.
    pub directions: usize,
    /// What the path has passed: not the place where it begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<CriticalPoint>,
}

/// A point of a path where its stiffness vanishes in a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CriticalPoint {
    /// The load turns back.
    Limit,
    /// Another branch leaves the path, and the load goes on.
    Bifurcation,
    /// Two vibrations come to one frequency, and one of them grows: no equilibrium is beside the
    /// path.
    Flutter,
}

impl StaticFacts {
    /// Whether the path has turned unstable.
    pub(crate) fn is_lost(&self) -> bool {
        self.lost_stability.is_some()
    }

    /// Takes up the next equilibrium of the path.
    pub(crate) fn follow_stability(&mut self, t: f64, unstable: Option<usize>, flutters: bool) {
        let directions = unstable.unwrap_or(0);
        self.unstable += u64::from(directions > 0);
        self.unjudged += u64::from(unstable.is_none());
        if directions > 0 && self.lost_stability.is_none() {
            let passed = match flutters {
                true => CriticalPoint::Flutter,
                false => CriticalPoint::Bifurcation,
            };
            let point = self.last_time.map(|_| passed);
            let after = self.last_time;
            self.lost_stability = Some(LostStability { after, at: t, directions, point });
        }
        // the load turns back at the first unstable equilibrium, or right after it
        if let Some(lost) = &mut self.lost_stability {
            let here = self.last_time.is_some_and(|last| t < last)
                && (Some(lost.at) == Some(t) || self.last_time == Some(lost.at));
            if here && lost.point == Some(CriticalPoint::Bifurcation) {
                lost.point = Some(CriticalPoint::Limit);
            }
        }
        self.last_time = Some(t);
    }

    /// That the stability of equilibria is not known, in words.
    pub(crate) fn unjudged_warning(&self) -> Option<String> {
        let Self { unjudged, equilibria, .. } = *self;
        (unjudged > 0).then(|| {
            format!(
                "whether {unjudged} of {equilibria} equilibria are stable is not known (`unstable` in residuals.csv is empty \
                 there): their stiffness is not symmetric, as by followers and by moments with fixed directions, and that \
                 is judged up to 150 degrees of freedom alone; `holonom modes --at static` says it of the last one"
            )
        })
    }

    /// That the path was left for a branch, in words.
    pub(crate) fn branch_note(&self) -> Option<String> {
        let at = twelve_digits(self.switched?);
        Some(format!(
            "the path meets a bifurcation point and goes on along the branch that leaves it, from t = {at} on"
        ))
    }

    /// That the path turns unstable, in words.
    pub(crate) fn stability_warning(&self) -> Option<String> {
        let LostStability { after, at, directions, point } = self.lost_stability?;
        let ways =
            if directions == 1 { "one direction" } else { &format!("{directions} directions") };
        let at = twelve_digits(at);
        if let (Some(CriticalPoint::Flutter), Some(after)) = (point, after) {
            let after = twelve_digits(after);
            return Some(format!(
                "between t = {after} and t = {at} the equilibrium turns unstable by flutter: two vibrations come to one \
                 frequency and grow by forces without a potential, while no stiffness vanishes and no other branch is near; \
                 beyond it the real system oscillates about this path, which a run in time shows"
            ));
        }
        Some(match after {
            Some(after) => format!(
                "between t = {} and t = {at} the equilibrium turns unstable, in {ways}: {}",
                twelve_digits(after),
                match point {
                    Some(CriticalPoint::Limit) => {
                        "a limit point is there, where the load turns back; under a load that goes on the real system jumps"
                    }
                    _ => {
                        "a bifurcation point is there, and beyond it the real system leaves this path; \
                         bifurcation = \"switch\" in [simulation] follows the branch, or a small load across shows it"
                    }
                }
            ),
            None => format!(
                "the first equilibrium, at t = {at}, is unstable, in {ways}: the least disturbance leads away from it"
            ),
        })
    }
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// A time for a message, s: without the round-off of a sum of steps.
pub(crate) fn twelve_digits(t: f64) -> f64 {
    format!("{t:.11e}").parse().unwrap_or(t)
}
