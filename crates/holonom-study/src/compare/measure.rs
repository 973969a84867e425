//! One scheme: a run, its cost, its matrices, its error against time.

use super::record::{
    ConditionAt, DrawnNode, EnergyBehaviour, Measured, Record, RecordedMotion, SchemeOutcome,
    WorkPoint,
};
use super::{ComparisonPlan, distance, larger};
use crate::clock::timed;
use holonom_model::{Family, Model, Scheme};
use holonom_sim::output::{ConstraintSummary, Frames, Maximum};
use holonom_sim::sample::{Member, Sample};
use holonom_sim::simulation::{RunOutcome, Simulation};
use std::convert::Infallible;
use vi_core::shadow_energy;
use vi_verify::fit::median;
use vi_verify::judge::LEAST_TREND_STEPS;
use vi_verify::trend::trend;

/// Repeated measurements of a time.
const REPEATS: usize = 5;
/// Seconds that one of them takes at least, where the run is long enough.
const LEAST: f64 = 0.02;
/// Points of a series.
const POINTS: usize = 400;
/// Relative deviation below which a quantity counts as conserved.
const ROUND_OFF: f64 = 1e-10;

/// The run of a scheme.
pub(super) struct SchemeRun {
    scheme: Scheme,
    outcome: SchemeOutcome,
    samples: Vec<Sample>,
    first_free: usize, // sample from which no load acts
    distance: Option<f64>,
}

/// Runs a scheme at order 2 with the step of the table.
pub(super) fn run(
    model: &Model,
    plan: &ComparisonPlan,
    scheme: Scheme,
    reference: Option<&[Vec<f64>]>,
) -> SchemeRun {
    let model = plan.with(model, scheme, 2, 1);
    let mut simulation = match Simulation::new(&model) {
        Ok(simulation) => simulation,
        Err(error) => {
            let problem = error.problems("").into_iter().next();
            let reason = problem.map_or_else(|| error.to_string(), |p| p.message);
            let outcome = SchemeOutcome::Refused { reason };
            return SchemeRun {
                scheme,
                outcome,
                samples: Vec::new(),
                first_free: 0,
                distance: None,
            };
        }
    };
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| -> Result<(), Infallible> {
        samples.push(sample.clone());
        Ok(())
    };
    let Ok(ended) = simulation.run(&mut observe, &mut |_, _| {});
    let outcome = match ended {
        RunOutcome::Done => SchemeOutcome::Done,
        RunOutcome::Failed(f) => SchemeOutcome::Failed { step: f.step, t: f.t, message: f.message },
    };
    let off = |nodes: &[Vec<f64>]| {
        samples.iter().zip(nodes).map(|(s, q)| distance(&s.q, q)).fold(0.0, larger)
    };
    let distance = reference.map(off);
    let free_from = plan.free_from - 1e-9 * model.settings.step;
    let first_free = samples.partition_point(|sample| sample.t < free_from);
    SchemeRun { scheme, outcome, samples, first_free, distance }
}

/// `Px Py Pz Lx Ly Lz`.
fn maps(sample: &Sample) -> [f64; 6] {
    let ([a, b, c], [d, e, f]) = (sample.momentum.linear, sample.momentum.angular);
    [a, b, c, d, e, f]
}

/// The momentum maps that some scheme conserves to round-off.
pub(super) fn conserved(runs: &[SchemeRun]) -> [bool; 6] {
    let mut conserved = [false; 6];
    for run in runs.iter().filter(|run| run.samples.len() > 1) {
        let size = run.free().iter().flat_map(maps).fold(1.0, larger);
        for (conserved, drift) in conserved.iter_mut().zip(run.drift()) {
            *conserved |= drift <= ROUND_OFF * size;
        }
    }
    conserved
}

impl SchemeRun {
    /// The configurations at all nodes.
    pub(super) fn nodes(&self) -> Vec<Vec<f64>> {
        self.samples.iter().map(|sample| sample.q.clone()).collect()
    }

    /// Its scheme, and up to `most` of its nodes, evenly spread from the first to the last; `None`
    /// without a step.
    pub(super) fn motion(&self, members: &[Member], most: usize) -> Option<RecordedMotion> {
        let (all, count) = (self.samples.len(), self.samples.len().min(most.max(2)));
        if all < 2 {
            return None;
        }
        let chosen = (0..count).map(|k| &self.samples[k * (all - 1) / (count - 1)]);
        let mut frames = Frames { members: members.to_vec(), ..Frames::default() };
        for sample in chosen {
            frames.steps.push(sample.step);
            frames.times.push(sample.t);
            frames.q.push(sample.q.clone());
        }
        Some(RecordedMotion { scheme: self.scheme.name().to_owned(), frames })
    }

    /// The nodes on which no load acts; all of them where the run ends before that.
    fn free(&self) -> &[Sample] {
        let free = self.samples.get(self.first_free..).filter(|free| free.len() > 1);
        free.unwrap_or(&self.samples)
    }

    fn drift(&self) -> [f64; 6] {
        let free = self.free();
        let start = free.first().map(maps).unwrap_or_default();
        let mut drift = [0.0; 6];
        for sample in free {
            for ((drift, now), start) in drift.iter_mut().zip(maps(sample)).zip(start) {
                *drift = larger(*drift, now - start);
            }
        }
        drift
    }

    /// The run as a record; `first`: the nodes of the first scheme of its family.
    pub(super) fn record(&self, conserved: [bool; 6], first: Option<&Vec<Vec<f64>>>) -> Record {
        Record {
            scheme: self.scheme.name().to_owned(),
            energy_momentum: self.scheme.is_energy_momentum(),
            outcome: self.outcome.clone(),
            measured: (self.samples.len() > 1).then(|| self.measured(conserved, first)),
            conditions: Vec::new(),
            work: Vec::new(),
        }
    }

    fn measured(&self, conserved: [bool; 6], first: Option<&Vec<Vec<f64>>>) -> Measured {
        let free = self.free();
        let worst = |of: fn(&Sample) -> f64| self.samples.iter().map(of).fold(0.0, larger);
        let maximum = |of| Maximum { max: worst(of) };
        let taken = &self.samples[1..];
        let iterations = taken.iter().map(|s| s.newton_iterations);
        let energies: Vec<f64> = free.iter().map(|s| s.hamiltonian).collect();
        let shadow = |s: &Sample| shadow_energy(2, s.hamiltonian, s.energy);
        let shadows: Vec<f64> = free.iter().map(shadow).collect();
        let energy_error = energies.iter().map(|e| e - energies[0]).fold(0.0, larger);
        let apart = first.map(|nodes| {
            self.samples.iter().zip(nodes).map(|(s, q)| distance(&s.q, q)).fold(0.0, larger)
        });
        Measured {
            steps: taken.len() as u64,
            distance: self.distance,
            apart,
            energy: energies[0],
            energy_error,
            energy_verdict: verdict(&energies, &shadows, energy_error),
            momentum_drift: self.drift(),
            constraint_residual: ConstraintSummary {
                position: maximum(|s| s.residuals.position),
                velocity: maximum(|s| s.residuals.velocity),
                momentum: maximum(|s| s.residuals.momentum),
            },
            mean_iterations: iterations.clone().sum::<f64>() / taken.len() as f64,
            max_iterations: iterations.fold(0.0, larger),
            seconds_per_step: None,
            seconds_range: None,
            series: self.series(conserved),
        }
    }

    fn series(&self, conserved: [bool; 6]) -> Vec<DrawnNode> {
        let (start, energy) = (maps(&self.free()[0]), self.free()[0].hamiltonian);
        let point = |s: &Sample| {
            let changes = maps(s).into_iter().zip(start).zip(conserved).filter(|c| c.1);
            let r = &s.residuals;
            DrawnNode {
                t: s.t,
                energy: s.hamiltonian - energy,
                momentum: changes.map(|((now, start), _)| now - start).fold(0.0, larger),
                residuals: [r.position, r.velocity, r.momentum],
            }
        };
        let stride = self.samples.len().div_ceil(POINTS).max(1);
        self.samples.iter().step_by(stride).map(point).collect()
    }
}

fn verdict(energies: &[f64], shadows: &[f64], error: f64) -> EnergyBehaviour {
    let size = energies.iter().copied().fold(1.0, larger);
    if error <= ROUND_OFF * size {
        return EnergyBehaviour::Conserved;
    }
    if (energies.len() as u64) < LEAST_TREND_STEPS {
        return EnergyBehaviour::Unknown;
    }
    match trend(energies, shadows) {
        Ok(trend) if trend.is_bounded() => EnergyBehaviour::Bounded,
        Ok(_) => EnergyBehaviour::Changes,
        Err(_) => EnergyBehaviour::Unknown,
    }
}

/// Adds time per step, condition numbers and error against time to the record of a scheme that
/// runs.
pub(super) fn cost(
    model: &Model,
    plan: &ComparisonPlan,
    scheme: Scheme,
    end: Option<&Vec<f64>>,
    record: &mut Record,
) {
    let at_table = plan.with(model, scheme, 2, 1);
    let Some(measured) = &mut record.measured else { return };
    let steps = measured.steps.saturating_sub(1).max(1);
    if let Some(once) = seconds(&at_table, steps.min(4)) {
        let count = ((LEAST / once.max(1e-9)) as u64).clamp(4.min(steps), steps);
        let repeats = ((plan.effort / (once * count as f64)) as usize).clamp(1, REPEATS);
        let times: Vec<f64> = (0..repeats).filter_map(|_| seconds(&at_table, count)).collect();
        measured.seconds_range = range(&times);
        measured.seconds_per_step = median(times);
    }
    for &count in &plan.counts {
        let model = plan.by_count(model, scheme, 2, count);
        let step = model.settings.step;
        record.conditions.push(ConditionAt { step, condition: condition(&model) });
    }
    let per_step = measured.seconds_per_step;
    for &order in &plan.orders {
        let parts = sub_steps(scheme, order);
        for &count in &plan.counts {
            let model = plan.by_count(model, scheme, order, count);
            let expected = per_step.map(|s| s * (parts as u64 * count) as f64);
            record.work.push(work_point(&model, count, expected, plan, end));
        }
    }
}

/// Steps of the scheme in a macro step of an order.
pub(super) fn sub_steps(scheme: Scheme, order: u32) -> usize {
    let composition = vi_core::Composition::of_order(order).unwrap_or_default();
    match scheme.family() {
        Family::EnergyMomentum(_) => vi_emscheme::scheme::sub_steps(composition).len(),
        _ => composition.gammas().len(),
    }
}

/// The smallest and the largest of some times.
pub(super) fn range(times: &[f64]) -> Option<[f64; 2]> {
    let least = times.iter().copied().reduce(f64::min)?;
    Some([least, times.iter().copied().reduce(f64::max)?])
}

fn advance(run: &mut Simulation, count: u64) -> bool {
    (0..count).all(|_| run.step().is_ok())
}

/// Seconds of a step of a model, where it can be taken; over a few of its `steps`.
pub(super) fn rate(model: &Model, steps: u64) -> Option<f64> {
    seconds(model, steps.saturating_sub(1).clamp(1, 4))
}

/// Seconds of a step, over `count` steps after one that warms up.
fn seconds(model: &Model, count: u64) -> Option<f64> {
    let mut run = Simulation::new(model).ok()?;
    run.step().ok()?;
    let (seconds, taken) = timed(|| advance(&mut run, count));
    taken.then_some(seconds / count as f64)
}

/// `κ` of the third step, or of the last before it that goes well.
fn condition(model: &Model) -> Option<vi_constraints::scheme::ConditionNumbers> {
    let mut run = Simulation::new(model).ok()?;
    let steps = model.settings.steps().min(3);
    advance(&mut run, steps).then(|| run.condition()).flatten()
}

fn work_point(
    model: &Model,
    count: u64,
    expected: Option<f64>,
    plan: &ComparisonPlan,
    end: Option<&Vec<f64>>,
) -> WorkPoint {
    let (order, step) = (model.settings.order, model.settings.step);
    let without = |reason: String| WorkPoint {
        order,
        step,
        seconds: None,
        seconds_range: None,
        error: None,
        missing: Some(reason),
    };
    let Some(end) = end else { return without("there is no reference".into()) };
    if let Some(expected) = expected.filter(|e| *e > plan.effort) {
        return without(format!("would take {expected:.1} s"));
    }
    let mut times = Vec::new();
    let mut error = f64::NAN;
    while times.len() < REPEATS && times.iter().sum::<f64>() < plan.enough {
        let mut run = match Simulation::new(model) {
            Ok(run) => run,
            Err(error) => {
                let problem = error.problems("").into_iter().next();
                return without(problem.map_or_else(|| error.to_string(), |p| p.message));
            }
        };
        let (seconds, taken) = timed(|| (0..count).try_for_each(|_| run.step().map(|_| ())));
        if let Err(failure) = taken {
            return without(failure.to_string());
        }
        times.push(seconds);
        error = distance(run.configuration(), end);
    }
    let seconds_range = range(&times);
    WorkPoint {
        order,
        step,
        seconds: median(times),
        seconds_range,
        error: Some(error),
        missing: None,
    }
}
