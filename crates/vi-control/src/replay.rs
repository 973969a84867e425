//! An optimum as an ordinary run: the motion that the integrator makes of its controls.
//!
//! A program that was solved says what the motion should be; the integrator says what it is. Where
//! neighbouring motions part fast, as at an unstable equilibrium, rounding alone drives both apart:
//! then each step is taken from the node of the optimum.

use crate::transcription::SolvedMotion;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::{Constraints, Integrator};
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_core::{DiscreteLagrangian, State};
use vi_multibody::held_effort::HeldEffort;

/// Largest deviation of a replay, m or 1, below which it counts as the same motion.
pub const SAME_MOTION: f64 = 1e-8;

/// Largest deviation of single steps, from nodes of the optimum.
pub const SAME_STEP: f64 = 1e-10;

/// How well a run follows an optimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Largest `|q_n − q_n^{optimum}|_∞` of the run.
    pub deviation: f64,
    /// The node of it.
    pub node: usize,
    /// Largest deviation of single steps from the nodes of the optimum, where the run deviates.
    pub by_steps: Option<f64>,
    /// `q_N` of the run.
    pub end: Vec<f64>,
    /// A step that was refused, in words.
    pub refused: Option<String>,
}

impl Replay {
    /// Whether the run is the motion of the optimum.
    #[must_use]
    pub fn is_same(&self) -> bool {
        self.refused.is_none()
            && (self.deviation <= SAME_MOTION || self.by_steps.is_some_and(|d| d <= SAME_STEP))
    }

    /// Runs from the start with the controls of an optimum, `efforts` in their order; `run` is at
    /// the start, with the step of the motion. The efforts are zero then.
    pub fn of<S, C>(
        run: &mut Integrator<S, C>,
        efforts: &[HeldEffort],
        motion: &SolvedMotion,
    ) -> Self
    where
        S: DiscreteLagrangian + 'static,
        C: Constraints + 'static,
    {
        let start = run.state().clone();
        let mut replay =
            Self { deviation: 0.0, node: 0, by_steps: None, end: Vec::new(), refused: None };
        for (n, values) in motion.controls.iter().enumerate() {
            set(efforts, values);
            if let Err(error) = run.step() {
                replay.refused = Some(error.to_string());
                replay.node = n;
                break;
            }
            let deviation = distance(&run.state().q, &motion.nodes[n + 1]);
            if deviation > replay.deviation || deviation.is_nan() {
                (replay.deviation, replay.node) = (deviation, n + 1);
            }
        }
        replay.end = run.state().q.clone();
        if replay.refused.is_none() && replay.deviation > SAME_MOTION {
            replay.by_steps = Some(by_steps(run, &start, efforts, motion));
        }
        efforts.iter().for_each(|effort| effort.set(0.0)); // none acts beside later controls
        replay
    }
}

fn set(efforts: &[HeldEffort], values: &[f64]) {
    efforts.iter().zip(values).for_each(|(effort, value)| effort.set(*value));
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    norm_inf(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
}

/// `p̄` at the end of a step of a motion, which starts at a state.
fn end_momentum(
    system: &impl DiscreteLagrangian,
    start: &State,
    motion: &SolvedMotion,
    n: usize,
) -> Vec<f64> {
    let (t, h, mut p) = (start.t, motion.step, vec![0.0; start.p.len()]);
    let [from, to] = [n, n + 1].map(|n| &motion.nodes[n]);
    let within = &motion.within[n];
    let interval = |t: f64, h: f64, from: &[f64], to: &[f64]| {
        let mut s = Interval::between(t, h, from, to);
        s.angles.clone_from(&start.angles);
        s
    };
    if let Some(stages) = motion.method.stages() {
        let nodes = within.iter().chain([to]);
        let intervals: Vec<Interval> = nodes.map(|q| interval(t, h, from, q)).collect();
        let mut points = ControlPoints::new(p.len(), stages);
        points.take(&intervals, &start.p);
        points.evaluate(system);
        points.balance(system, stages.count(), &mut p); // [2.29]
    } else {
        let gammas = motion.method.composition().gammas();
        let last = h * gammas[gammas.len() - 1];
        let s = interval(t + h - last, last, within.last().unwrap_or(from), to);
        system.forced_d2(&s, &mut p);
    }
    p
}

/// Largest deviation of steps from the nodes of the optimum, each with its momentum.
fn by_steps<S, C>(
    run: &mut Integrator<S, C>,
    start: &State,
    efforts: &[HeldEffort],
    motion: &SolvedMotion,
) -> f64
where
    S: DiscreteLagrangian + 'static,
    C: Constraints + 'static,
{
    let (mut at, mut worst) = (start.clone(), 0.0);
    for (n, values) in motion.controls.iter().enumerate() {
        set(efforts, values);
        run.place_at(&at);
        let deviation = match run.step() {
            Ok(_) => distance(&run.state().q, &motion.nodes[n + 1]),
            Err(_) => f64::INFINITY,
        };
        if deviation > worst || deviation.is_nan() {
            worst = deviation;
        }
        let p = end_momentum(run.system(), &at, motion, n);
        at = run.state().clone();
        at.q.copy_from_slice(&motion.nodes[n + 1]);
        at.p.copy_from_slice(&p); // p̄ of the optimum
    }
    worst
}
