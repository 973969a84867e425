//! `summary.json`: a run in numbers, accumulated node by node.

use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;

use crate::assembly::loops::LoopResiduals;
use crate::assembly::{AssemblyReport, Counts, StrainVariant};
use crate::resolution::rotation::FastestRotation;
use crate::run::divided_steps::DividedSteps;
use crate::run::outcome::StaticFacts;
use crate::run::outcome::{RunFailure, RunOutcome};
use crate::sample::Sample;
use holonom_model::{Family, HighOrder, Model};
use vi_beam::ElementKind;
use vi_core::contact_state::ContactCounts;
use vi_core::momentum_map::Momentum;

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// At its end time.
    Done,
    /// Before; `failure` says why.
    Failed,
    /// By a signal; `interruption` says where.
    Interrupted,
    /// Not yet, or killed: the numbers are those of the last checkpoint.
    Running,
}

/// Where a run was interrupted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunInterruption {
    /// Steps taken.
    pub step: u64,
    /// The time that was reached, s.
    pub t: f64,
    /// The command that continues it; `None` where it has to be run again.
    pub resume: Option<String>,
}

/// Newton iterations per step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NewtonSummary {
    /// Mean over the recorded steps.
    #[serde(deserialize_with = "number")]
    pub mean: f64,
    /// Largest of the recorded steps.
    #[serde(deserialize_with = "number")]
    pub max: f64,
}

/// The energy `H_d(q_n, ᵠp_n)` along the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergySummary {
    /// Initial `H_d`, before an impact at the first node, J.
    #[serde(deserialize_with = "number")]
    pub initial: f64,
    /// Largest deviation from it, J.
    #[serde(deserialize_with = "number")]
    pub max_abs_error: f64,
    /// `H_d` at the last recorded node, J.
    #[serde(rename = "final", default, deserialize_with = "number")]
    pub last: f64,
    /// Least-squares slope per step, J, of the shadow energy `(p H_d + E_d)/(p + 1)` of a scheme of
    /// order `p`, which a conservative system conserves up to `O(h^{p+2})` where `h ω_max ≲ 1`; of
    /// the energy itself for energy–momentum schemes. `null` where loads, motors, dampers or
    /// prescribed motions do work, and in statics.
    pub drift_per_step: Option<f64>,
    /// Work of loads, motors, dampers and prescribed motions over all steps, J.
    #[serde(default, deserialize_with = "number")]
    pub work: f64,
    /// `final − initial − work`, J; of second order in the time step at order 2 (with prescribed
    /// motions at higher orders its order has not been established).
    #[serde(default, deserialize_with = "number")]
    pub balance_error: f64,
}

/// Largest deviation of the components of a momentum map from their initial values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MomentumSummary {
    /// Linear momentum, kg·m/s.
    pub linear: Drift,
    /// Angular momentum, kg·m²/s.
    pub angular: Drift,
}

/// Drift of one momentum map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// Largest over components and nodes.
    #[serde(deserialize_with = "number")]
    pub max_abs_drift: f64,
    /// Largest over nodes, per component.
    #[serde(deserialize_with = "numbers")]
    pub components: [f64; 3],
}

/// The largest value of a quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Maximum {
    /// Over all recorded nodes.
    #[serde(deserialize_with = "number")]
    pub max: f64,
}

/// Constraint residuals at three levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ConstraintSummary {
    /// `|g(q_n)|_∞`.
    pub position: Maximum,
    /// LMO08 (45).
    pub velocity: Maximum,
    /// LMO08 (46).
    pub momentum: Maximum,
}

/// JSON has no word for what is not a number: `null` stands for it.
fn number<'de, D: Deserializer<'de>>(json: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(json)?.unwrap_or(f64::NAN))
}

fn numbers<'de, D: Deserializer<'de>>(json: D) -> Result<[f64; 3], D::Error> {
    Ok(<[Option<f64>; 3]>::deserialize(json)?.map(|x| x.unwrap_or(f64::NAN)))
}

/// A run in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the model.
    pub model: String,
    /// The command that was given, where the program ran it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// How the run ended.
    pub status: Status,
    /// Why it ended before its time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<RunFailure>,
    /// Where it was interrupted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interruption: Option<RunInterruption>,
    /// Time-stepping scheme.
    pub scheme: String,
    /// Order of accuracy.
    pub order: u32,
    /// How it is reached, where that is not by composition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<HighOrder>,
    /// Time step, s.
    pub step: f64,
    /// Time of the last node, s.
    #[serde(deserialize_with = "number")]
    pub end_time: f64,
    /// Steps taken.
    pub steps: u64,
    /// Nodes recorded.
    pub recorded: u64,
    /// The size of the model.
    #[serde(flatten)]
    pub counts: Counts,
    /// Whether the strains of beams dissipate; absent without beams and in statics.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strains: Option<StrainVariant>,
    /// What the elements of beams measure, each kind once; absent without beams.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub element_kinds: Vec<ElementKind>,
    /// Newton iterations.
    pub newton_iterations: NewtonSummary,
    /// Time the run took, s, writing included.
    #[serde(deserialize_with = "number")]
    pub wall_seconds: f64,
    /// The same per step, s.
    #[serde(deserialize_with = "number")]
    pub seconds_per_step: f64,
    /// Time of a step without reading and writing nodes, s, in the last part of a continued run;
    /// absent in statics and where no step was taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_seconds: Option<f64>,
    /// Energy.
    pub energy: EnergySummary,
    /// Momentum maps.
    pub momentum: MomentumSummary,
    /// Constraint residuals.
    pub constraint_residual: ConstraintSummary,
    /// Facts of a continuation of equilibria; absent for motions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub statics: Option<StaticFacts>,
    /// Steps that were refused as a whole and taken in smaller parts; absent where there were none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub divided_steps: Option<DividedSteps>,
    /// Largest residuals of constraints of loops that nearly follow from others; absent where there
    /// are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loop_residual: Option<LoopResiduals>,
    /// In how many steps a bound of the tension of beams was raised; absent where none can be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tension_raised: Option<u64>,
    /// How often each event has acted; absent without events.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub events: BTreeMap<String, u64>,
    /// How contacts, stops and dry friction have acted; absent where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contacts: Option<ContactCounts>,
    /// The fastest rotation of what no prescribed motion turns, against the step; absent where
    /// nothing turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fastest_rotation: Option<FastestRotation>,
    /// What is worth knowing about the assembly and the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Version of the program.
    pub version: String,
}

/// Accumulates a [`Summary`].
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SummaryBuilder {
    first: Option<First>,
    last_step: u64,
    last_time: f64,
    recorded: u64,
    newton_sum: f64,
    newton_max: f64,
    energy_error: f64,
    shadow: Slope,
    last: [f64; 2], // H_d and work
    linear: [f64; 3],
    angular: [f64; 3],
    residuals: [f64; 3],
    command: Option<String>,
}

/// What later nodes are compared with.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct First {
    step: u64,
    hamiltonian: f64,
    momentum: Momentum,
}

/// How far a run came.
#[derive(Clone, Debug, PartialEq)]
pub enum Ended<'a> {
    /// It ended by itself.
    By(&'a RunOutcome),
    /// It was interrupted.
    Interrupted(RunInterruption),
    /// It goes on: steps taken, and the time that was reached, s.
    Not((u64, f64)),
}

impl SummaryBuilder {
    /// Of a run that begins with a command.
    #[must_use]
    pub fn of(command: Option<String>) -> Self {
        Self { command, ..Self::default() }
    }

    /// Takes one node.
    pub fn record(&mut self, sample: &Sample) {
        let Sample { step, momentum, .. } = *sample;
        // before what contacts do at the first node
        let hamiltonian = sample.hamiltonian - sample.work;
        let first = self.first.get_or_insert(First { step, hamiltonian, momentum });
        let error = sample.hamiltonian - first.hamiltonian;
        self.energy_error = larger(self.energy_error, error);
        let step = (sample.step - first.step) as f64;
        if let Some(shadow) = sample.shadow {
            self.shadow.add(step, shadow - first.hamiltonian);
        }
        self.last = [sample.hamiltonian, sample.work];
        for i in 0..3 {
            let (now, start) = (&sample.momentum, &first.momentum);
            self.linear[i] = larger(self.linear[i], now.linear[i] - start.linear[i]);
            self.angular[i] = larger(self.angular[i], now.angular[i] - start.angular[i]);
        }
        let residuals = &sample.residuals;
        let levels = [residuals.position, residuals.velocity, residuals.momentum];
        self.residuals = std::array::from_fn(|i| larger(self.residuals[i], levels[i]));
        if self.recorded > 0 {
            self.newton_sum += sample.newton_iterations;
            self.newton_max = larger(self.newton_max, sample.newton_iterations);
        }
        self.recorded += 1;
        (self.last_step, self.last_time) = (sample.step, sample.t);
    }

    /// The summary of what was recorded.
    #[must_use]
    pub fn finish(
        self,
        model: &Model,
        assembly: &AssemblyReport,
        outcome: &RunOutcome,
        wall_seconds: f64,
    ) -> Summary {
        self.so_far(model, assembly, Ended::By(outcome), wall_seconds)
    }

    /// The same of a run that may not have ended by itself.
    #[must_use]
    pub fn so_far(
        &self,
        model: &Model,
        assembly: &AssemblyReport,
        ended: Ended<'_>,
        wall_seconds: f64,
    ) -> Summary {
        let [position, velocity, momentum] = self.residuals.map(|max| Maximum { max });
        let drift = |components: [f64; 3]| Drift {
            max_abs_drift: components.into_iter().fold(0.0, larger),
            components,
        };
        let steps_recorded = self.recorded.saturating_sub(1).max(1) as f64;
        // a run that ends early may have taken steps since its last recorded node
        let recorded = (self.last_step, self.last_time);
        let (status, reached) = match &ended {
            Ended::By(RunOutcome::Done) => (Status::Done, recorded),
            Ended::By(RunOutcome::Failed(failure)) => (Status::Failed, (failure.step, failure.t)),
            Ended::Interrupted(at) => (Status::Interrupted, (at.step, at.t)),
            Ended::Not(reached) => (Status::Running, *reached),
        };
        let moves = model.settings.scheme.family() != Family::Static;
        let (steps, end_time) = if moves { reached } else { recorded };
        let (failure, interruption) = match ended {
            Ended::By(RunOutcome::Failed(failure)) => (Some(failure.clone()), None),
            Ended::Interrupted(at) => (None, Some(at)),
            _ => (None, None),
        };
        Summary {
            model: model.header.name.clone(),
            command: self.command.clone(),
            status,
            failure,
            interruption,
            scheme: model.settings.scheme.name().to_owned(),
            order: model.settings.order,
            method: Some(model.settings.method).filter(|m| *m != HighOrder::Composition),
            step: model.settings.step,
            end_time,
            steps,
            recorded: self.recorded,
            counts: assembly.counts,
            strains: assembly.strains,
            element_kinds: assembly.element_kinds.clone(),
            newton_iterations: NewtonSummary {
                mean: self.newton_sum / steps_recorded,
                max: self.newton_max,
            },
            wall_seconds,
            seconds_per_step: wall_seconds / steps.max(1) as f64,
            step_seconds: None,
            energy: self.energy(model),
            momentum: MomentumSummary { linear: drift(self.linear), angular: drift(self.angular) },
            constraint_residual: ConstraintSummary { position, velocity, momentum },
            statics: None,
            divided_steps: None,
            loop_residual: None,
            tension_raised: None,
            events: BTreeMap::new(),
            contacts: None,
            fastest_rotation: None,
            warnings: assembly.warnings.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }
}

impl SummaryBuilder {
    fn energy(&self, model: &Model) -> EnergySummary {
        let moves = !matches!(model.settings.scheme.family(), Family::Static);
        let initial = self.first.as_ref().map_or(0.0, |s| s.hamiltonian);
        let [last, work] = self.last;
        EnergySummary {
            initial,
            max_abs_error: self.energy_error,
            last,
            drift_per_step: (moves && model.is_conservative()).then(|| self.shadow.value()),
            work,
            balance_error: last - initial - work,
        }
    }
}

/// The larger magnitude; unlike `f64::max` it keeps what is not a number.
#[must_use]
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.abs() <= a { a } else { b.abs() }
}

/// Least-squares slope of points that come one by one (Welford's updates).
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Slope {
    count: f64,
    mean_x: f64,
    mean_y: f64,
    xx: f64,
    xy: f64,
}

impl Slope {
    fn add(&mut self, x: f64, y: f64) {
        self.count += 1.0;
        let dx = x - self.mean_x;
        self.mean_x += dx / self.count;
        self.mean_y += (y - self.mean_y) / self.count;
        self.xx += dx * (x - self.mean_x);
        self.xy += dx * (y - self.mean_y);
    }

    fn value(self) -> f64 {
        if self.xx > 0.0 { self.xy / self.xx } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_that_of_a_line_and_of_the_least_squares() {
        let mut slope = Slope::default();
        for k in 0..1000 {
            let x = f64::from(k);
            slope.add(x, 3.0 + 2e-5 * x);
        }
        assert!((slope.value() - 2e-5).abs() < 1e-15, "{:e}", slope.value() - 2e-5);
        let mut slope = Slope::default();
        for (x, y) in [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (3.0, 1.0)] {
            slope.add(x, y);
        }
        assert!((slope.value() - 0.2).abs() < 1e-15);
        assert!(Slope::default().value() == 0.0);
    }

    #[test]
    fn what_is_not_a_number_survives_json() {
        let energy = EnergySummary { initial: f64::NAN, ..EnergySummary::default() };
        let json = serde_json::to_string(&energy).unwrap();
        assert!(serde_json::from_str::<EnergySummary>(&json).unwrap().initial.is_nan());
    }

    #[test]
    fn what_is_not_a_number_is_not_lost() {
        assert!([1.0, f64::NAN, 2.0].into_iter().fold(0.0, larger).is_nan());
        assert!((larger(1.0, -2.0) - 2.0).abs() < 1e-15);
    }
}
