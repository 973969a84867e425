//! What a step of a model costs, and its parts.
//!
//! ```text
//! step        seconds of N steps / N, without reading nodes
//! residual    one evaluation of the equations at the solution of the last step
//! matrix      the entries of D_2(D_1 L_d + f_d^-) there, emitted once
//! solve       one correction of Newton's method less the matrix: reduction, factorization, substitution
//! recording   reading a node and writing its rows: (seconds of N steps with every node recorded − step) / N
//! ```
//! The parts are called one by one, repeated until a clock resolves them; there is no timer in a
//! step. Every number is the least of some rounds over the same motion. What else a step does
//! (initial guess, momenta, opening and closing) is its time less
//! `iterations (residual + matrix + solve)`. The matrix is not separated, it counts among the
//! solution, in the energy–momentum and Galerkin schemes, and where a correction takes less time
//! than these entries, which it then does not need.

use crate::clock::{Clock, timed};
use holonom_model::{Columns, Family, Model, ModelError, Problem, Scheme};
use holonom_report::{counted, time};
use holonom_sim::output::TrajectoryWriter;
use holonom_sim::sample::Sample;
use holonom_sim::simulation::Simulation;
use serde::Serialize;
use std::hint::black_box;
use std::io;
use vi_constraints::Constraints;
use vi_constraints::discretization::Discretization;
use vi_constraints::integrator::kernels::Kernels;
use vi_core::newton::Fault;

/// Steps before anything is measured: patterns, symbolic factorizations, initial guesses.
const WARM_UP: u64 = 5;
/// Rounds of which the least counts.
const ROUNDS: usize = 5;
/// Time from which on a clock resolves a part, s.
const RESOLVED: f64 = 2e-3;

/// What is measured.
#[derive(Clone, Debug)]
pub struct BenchRequest {
    /// Schemes; none: that of the model.
    pub schemes: Vec<Scheme>,
    /// Steps in each round.
    pub steps: u64,
}

/// The cost of the steps of one model.
#[derive(Clone, Debug, Serialize)]
pub struct Bench {
    /// Name of the model.
    pub model: String,
    /// Redundant coordinates `n`.
    pub coordinates: usize,
    /// Degrees of freedom.
    pub dof: usize,
    /// Time step, s.
    pub step: f64,
    /// Order of accuracy.
    pub order: u32,
    /// Steps in each round.
    pub steps: u64,
    /// What the clock counts.
    pub clock: Clock,
    /// One for each scheme.
    pub schemes: Vec<SchemeCost>,
}

/// The cost of a step of a scheme.
#[derive(Clone, Debug, Serialize)]
pub struct SchemeCost {
    /// The scheme.
    pub scheme: Scheme,
    /// What it costs; `None` where it does not run.
    pub cost: Option<StepCost>,
    /// Why it does not run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<String>,
}

/// Times of a step and its parts, s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepCost {
    /// Of a step.
    pub step: f64,
    /// Of a step, for each Newton iteration in it.
    pub iteration: f64,
    /// Newton iterations in a step, of all sub-steps.
    pub iterations: f64,
    /// Of one residual.
    pub residual: f64,
    /// Of the entries of one matrix; `None` where they are not separated from the solution.
    pub matrix: Option<f64>,
    /// Of one solution.
    pub solve: f64,
    /// Of a node that is read and written.
    pub recording: f64,
}

/// Measures the steps of a model.
///
/// # Errors
/// [`ModelError`] where no scheme runs.
pub fn bench(model: &Model, request: &BenchRequest) -> Result<Bench, ModelError> {
    let own = [model.settings.scheme];
    let schemes = if request.schemes.is_empty() { &own[..] } else { &request.schemes };
    let assembled = Simulation::new(&prepared(model, schemes[0], request.steps))?;
    let counts = assembled.assembly().counts;
    let cost = |&scheme: &Scheme| {
        let model = prepared(model, scheme, request.steps);
        let (cost, missing) = match of_scheme(&model, request.steps) {
            Ok(cost) => (Some(cost), None),
            Err(reason) => (None, Some(reason)),
        };
        SchemeCost { scheme, cost, missing }
    };
    Ok(Bench {
        model: model.header.name.clone(),
        coordinates: counts.coordinates,
        dof: counts.dof,
        step: model.settings.step,
        order: model.settings.order,
        steps: request.steps,
        clock: Clock::available(),
        schemes: schemes.iter().map(cost).collect(),
    })
}

/// The model with a scheme, long enough, and with every node recorded.
fn prepared(model: &Model, scheme: Scheme, steps: u64) -> Model {
    let mut model = model.clone();
    let settings = &mut model.settings;
    settings.scheme = scheme;
    settings.every = 1;
    settings.end = settings.step * (WARM_UP + steps + 2) as f64;
    model
}

fn of_scheme(model: &Model, steps: u64) -> Result<StepCost, String> {
    let mut run = Simulation::new(model).map_err(|error| first_line(&error))?;
    (0..WARM_UP).try_for_each(|_| run.step().map(|_| ())).map_err(|error| error.to_string())?;
    let start = run.state();
    let (mut step, mut recorded, mut iterations) = (f64::INFINITY, f64::INFINITY, 0);
    for _ in 0..ROUNDS {
        run.resume(start.clone()).map_err(|error| error.to_string())?;
        let (seconds, count) = timed(|| iterations_of(&mut run, steps));
        (step, iterations) = (step.min(seconds), count?);
        run.resume(start.clone()).map_err(|error| error.to_string())?;
        let (seconds, done) = timed(|| record(&mut run, steps));
        done.map_err(|error| error.to_string())?;
        recorded = recorded.min(seconds);
    }
    let separate = model.settings.method().stages().is_none();
    let parts = match model.settings.scheme.family() {
        Family::Variational(_) => {
            let mut kernels = run.integrator().kernels();
            let entries = || {
                black_box(kernels.entries());
                Ok(())
            };
            let matrix = separate.then(|| least(entries));
            parts(&mut kernels, matrix.transpose())
        }
        _ => match run.energy_momentum() {
            Some(integrator) => parts(&mut integrator.kernels(), Ok(None)),
            None => return Err("this scheme takes no steps".into()),
        },
    };
    let (residual, matrix, solve) = parts.map_err(|fault| fault.to_string())?;
    let count = steps as f64;
    let per_step = iterations as f64 / count;
    Ok(StepCost {
        step: step / count,
        iteration: step / (iterations as f64).max(1.0),
        iterations: per_step,
        residual,
        matrix,
        solve,
        recording: ((recorded - step) / count).max(f64::MIN_POSITIVE),
    })
}

/// Newton iterations of `count` steps.
fn iterations_of(run: &mut Simulation, count: u64) -> Result<usize, String> {
    let mut iterations = 0;
    for _ in 0..count {
        iterations += run.step().map_err(|error| error.to_string())?.iterations;
    }
    Ok(iterations)
}

/// Takes `count` steps, and writes every node to where nothing is stored.
fn record(run: &mut Simulation, count: u64) -> io::Result<()> {
    let mut writer =
        TrajectoryWriter::new([io::sink(), io::sink()], run.members(), &Columns::usual(), false)?;
    let last = WARM_UP + count;
    let mut observe = |sample: &Sample| writer.record(black_box(sample));
    run.run_while(&mut observe, &mut |step, _| step < last).map(|_| ())
}

/// Residual, matrix and solution, s.
fn parts<S: Discretization<C>, C: Constraints>(
    kernels: &mut Kernels<'_, S, C>,
    matrix: Result<Option<f64>, Fault>,
) -> Result<(f64, Option<f64>, f64), Fault> {
    let residual = least(|| kernels.residual())?;
    let correction = least(|| kernels.correction())?;
    let matrix = matrix?.filter(|matrix| *matrix < correction);
    Ok((residual, matrix, (correction - matrix.unwrap_or(0.0)).max(f64::MIN_POSITIVE)))
}

/// Seconds of a call: the least mean of some rounds.
fn least(mut call: impl FnMut() -> Result<(), Fault>) -> Result<f64, Fault> {
    let mut count = 1_u32;
    loop {
        let (seconds, done) = timed(|| (0..count).try_for_each(|_| call()));
        done?;
        if seconds >= RESOLVED || count >= 1 << 20 {
            break;
        }
        count *= 2;
    }
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let (seconds, done) = timed(|| (0..count).try_for_each(|_| call()));
        done?;
        least = least.min(seconds);
    }
    Ok(least / f64::from(count))
}

fn first_line(error: &ModelError) -> String {
    let problem: Option<Problem> = error.problems("").into_iter().next();
    problem.map_or_else(|| error.to_string(), |problem| problem.message)
}

impl Bench {
    /// As a table for people, times in µs.
    #[must_use]
    pub fn table(&self) -> String {
        let Self { model, coordinates, dof, step, order, steps, clock, .. } = self;
        let clock = match clock {
            Clock::Cpu => "CPU time",
            Clock::Wall => "time",
        };
        let free = counted(*dof as u64, "degree of freedom", "degrees of freedom");
        let step = time(*step);
        let mut out = format!(
            "{model}: {coordinates} coordinates, {free}, h = {step} s, order {order}; \
             {clock} in µs, least of {ROUNDS} rounds of {steps} steps\n\n\
             {:<16}{:>10}{:>12}{:>12}{:>10}{:>10}{:>10}{:>11}\n",
            "scheme", "step", "iterations", "iteration", "residual", "matrix", "solve", "recording"
        );
        for SchemeCost { scheme, cost, missing } in &self.schemes {
            let name = scheme.name();
            let line = match cost {
                None => format!("{name:<16}  {}", missing.as_deref().unwrap_or_default()),
                Some(c) => {
                    let matrix = c.matrix.map_or("in solve".to_owned(), micro);
                    format!(
                        "{name:<16}{:>10}{:>12.2}{:>12}{:>10}{matrix:>10}{:>10}{:>11}",
                        micro(c.step),
                        c.iterations,
                        micro(c.iteration),
                        micro(c.residual),
                        micro(c.solve),
                        micro(c.recording)
                    )
                }
            };
            out.push_str(&line);
            out.push('\n');
        }
        out
    }
}

fn micro(seconds: f64) -> String {
    format!("{:.2}", 1e6 * seconds)
}
