//! From a problem to an optimum that is judged: refinement, charts that follow, the verdict.
//!
//! ```text
//! N/4, N/2, N steps, each from the last          refine: the number of halvings, as far as N can be halved
//! solve; where a rotation nears the end of its chart: references onto the motion, solve from there
//! verdict: conditions of an optimum by our own derivatives, the replay, the largest turn of a body
//! ```
//! The answer is an optimum near the guess, not the best of all.

use crate::kkt::{Kkt, Tolerances};
use crate::program::{
    Iterate, Multipliers, NlpSolver, Outcome, Program, SharedProgram, SolverError, Start,
};
use crate::replay::Replay;
use crate::transcription::problem::{MAX_INCREMENT, ProblemError};
use crate::transcription::{Guess, Met, Motion, PriceOfRest, Transcription, TurnPrice};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::rc::Rc;
use vi_rigid::{directors, rotation};

/// Charts are moved so often at most.
const MOVES: usize = 8;

/// A problem for any number of steps, and its mechanism as an ordinary run.
pub trait Setting {
    /// The program of so many steps from a guess, or from the first one.
    ///
    /// # Errors
    /// [`ProblemError`].
    fn program(&self, steps: usize, guess: Option<&Guess>) -> Result<Transcription, ProblemError>;
    /// The run of the controls of a motion.
    ///
    /// # Errors
    /// In words, where there is no run.
    fn replay(&self, motion: &Motion) -> Result<Replay, String>;
}

/// What a point is.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// An optimum: the conditions are met, and a run repeats it.
    Optimal,
    /// The method found no motion that meets all conditions; the rows that miss most, in words.
    Infeasible(Vec<String>),
    /// It was told to stop.
    Stopped,
    /// It made as many iterations as it may, or found no further step.
    Unfinished(Outcome),
    /// The method takes it for an optimum, and its derivatives do not.
    NotOptimal,
    /// A run of its controls is another motion.
    OtherMotion,
    /// A body turns by more than 1 rad from a node to the next: two turns have one momentum. More
    /// steps.
    TurnsTooFar {
        /// The step that it is of.
        step: usize,
        /// By how much, rad.
        turn: f64,
    },
}

/// A point with what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimum {
    /// What it is.
    pub verdict: Verdict,
    /// The motion.
    pub motion: Motion,
    /// The conditions of an optimum.
    pub kkt: Kkt,
    /// Its run; `None` where there is none.
    pub replay: Option<Replay>,
    /// Multipliers.
    pub multipliers: Multipliers,
    /// Its conditions.
    pub met: Vec<Met>,
    /// What rest at the end costs.
    pub rest: PriceOfRest,
    /// What the bounds of turns from node to node cost.
    pub turns: Vec<TurnPrice>,
    /// Multipliers of the balances, shape `N × d`.
    pub costates: Vec<Vec<f64>>,
    /// Iterations of the last solve.
    pub iterates: Vec<Iterate>,
    /// Iterations of all solves.
    pub iterations: usize,
    /// Number of steps and cost of each refinement, the last one included.
    pub refinements: Vec<(usize, f64)>,
    /// Where it is no optimum: conditions that controls could not meet at the guess, to first
    /// order: one alone that nothing changes, or several that change together.
    pub unreached: Vec<Vec<String>>,
}

impl Optimum {
    /// `f`.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.motion.costs.iter().sum()
    }

    /// Whether the Hessian was positive definite on the rows in the last iteration: no motion
    /// nearby is as good.
    #[must_use]
    pub fn is_sufficient(&self) -> bool {
        self.verdict == Verdict::Optimal && self.iterates.last().is_some_and(|i| i.shift == 0.0)
    }
}

/// Why there is no point at all.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptimizeError {
    /// There is no program.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The method refuses it.
    #[error(transparent)]
    Method(#[from] SolverError),
    /// It ended where the motion does not exist.
    #[error("the method ended where the motion does not exist")]
    Undefined,
}

/// Sees the number of steps and each iteration; breaks to stop.
pub type Progress = Rc<RefCell<dyn FnMut(usize, &Iterate) -> ControlFlow<()>>>;

/// Solves a problem of `steps` steps, from a quarter and a half of them where `refine` is 2.
///
/// # Errors
/// [`OptimizeError`]; how a solve ends is a [`Verdict`].
pub fn optimize(
    method: &mut dyn NlpSolver,
    setting: &dyn Setting,
    steps: usize,
    refine: u32,
    progress: &Progress,
) -> Result<Optimum, OptimizeError> {
    let halvings = (0..=refine).rev().find(|k| is_divisible(steps, *k)).unwrap_or(0);
    let (mut guess, mut iterations, mut refinements) = (None, 0, Vec::new());
    for k in (0..=halvings).rev() {
        let own = steps >> k;
        let program = setting.program(own, guess.as_ref())?;
        let solved = solve(method, program, progress)?;
        iterations += solved.iterations;
        refinements.push((own, solved.motion.costs.iter().sum()));
        if k > 0 && matches!(solved.outcome, Outcome::Optimal | Outcome::Acceptable) {
            guess = Some(solved.program.borrow().refined(&solved.motion));
            continue;
        }
        // what fails with few steps may do with all of them
        if k > 0 && solved.outcome != Outcome::Stopped {
            continue;
        }
        let mut found = judged(setting, solved, iterations, refinements);
        if !matches!(found.verdict, Verdict::Optimal | Verdict::Stopped) {
            let first = setting.program(steps, None)?;
            found.unreached = first.unreached(&first.start().x).unwrap_or_default();
        }
        return Ok(found);
    }
    unreachable!("the last refinement returns")
}

/// Whether steps can be halved so often, down to eight.
fn is_divisible(steps: usize, halvings: u32) -> bool {
    halvings == 0 || steps.is_multiple_of(1 << halvings) && steps >> halvings >= 8
}

/// The end of a solve.
struct Solve {
    outcome: Outcome,
    program: Rc<RefCell<Transcription>>,
    motion: Motion,
    kkt: Kkt,
    multipliers: Multipliers,
    met: Vec<Met>,
    rest: PriceOfRest,
    turns: Vec<TurnPrice>,
    costates: Vec<Vec<f64>>,
    iterates: Vec<Iterate>,
    iterations: usize,
}

fn solve(
    method: &mut dyn NlpSolver,
    program: Transcription,
    progress: &Progress,
) -> Result<Solve, OptimizeError> {
    let mut start = program.start();
    let steps = program.problem().steps;
    let program = Rc::new(RefCell::new(program));
    let shared: SharedProgram = program.clone();
    let mut iterations = 0;
    for moves in 0.. {
        let progress = progress.clone();
        let watch = move |iterate: &Iterate| (progress.borrow_mut())(steps, iterate).is_continue();
        let solved = method.solve(&shared, &start, Box::new(watch))?;
        iterations += solved.iterates.len().saturating_sub(1);
        let undefined = |_| OptimizeError::Undefined;
        let ended = !matches!(solved.outcome, Outcome::Stopped) && moves < MOVES;
        if ended && program.borrow().leaves_chart(&solved.x) {
            program.borrow_mut().move_references(&solved.x).map_err(undefined)?;
            let known = solved.outcome == Outcome::Optimal;
            let multipliers = known.then_some(solved.multipliers);
            start = Start { multipliers, ..program.borrow().start() };
            continue;
        }
        let motion = program.borrow().motion(&solved.x).map_err(undefined)?;
        let kkt = Kkt::judge(&mut *program.borrow_mut(), &solved.x, &solved.multipliers);
        let met = program.borrow().met(&solved.x, &solved.multipliers).map_err(undefined)?;
        let rest = program.borrow().price_of_rest(&solved.x, &solved.multipliers);
        let turns = program.borrow().prices_of_turns(&solved.multipliers);
        let costates = program.borrow().costates(&solved.multipliers);
        return Ok(Solve {
            met,
            rest: rest.map_err(undefined)?,
            turns,
            costates,
            outcome: solved.outcome,
            motion,
            kkt: kkt.map_err(undefined)?,
            multipliers: solved.multipliers,
            iterates: solved.iterates,
            iterations,
            program,
        });
    }
    unreachable!("moves are bounded")
}

fn judged(
    setting: &dyn Setting,
    solved: Solve,
    iterations: usize,
    refinements: Vec<(usize, f64)>,
) -> Optimum {
    let replay = setting.replay(&solved.motion).ok();
    let named = || {
        let program = solved.program.borrow();
        let worst = solved.kkt.violated.iter().take(5);
        worst.map(|(row, by)| format!("{}: {by:.1e}", program.row_name(*row))).collect()
    };
    let turn = largest_turn(&solved.motion);
    let verdict = match solved.outcome {
        Outcome::Infeasible => Verdict::Infeasible(named()),
        Outcome::Stopped => Verdict::Stopped,
        Outcome::Exhausted | Outcome::Failed(_) => Verdict::Unfinished(solved.outcome.clone()),
        Outcome::Optimal | Outcome::Acceptable => {
            if !solved.kkt.is_met(&Tolerances::default()) {
                Verdict::NotOptimal
            } else if let Some((step, turn)) = turn.filter(|(_, turn)| *turn > MAX_INCREMENT) {
                Verdict::TurnsTooFar { step, turn }
            } else if !replay.as_ref().is_some_and(Replay::is_same) {
                Verdict::OtherMotion
            } else {
                Verdict::Optimal
            }
        }
    };
    Optimum {
        verdict,
        motion: solved.motion,
        kkt: solved.kkt,
        replay,
        multipliers: solved.multipliers,
        met: solved.met,
        rest: solved.rest,
        turns: solved.turns,
        costates: solved.costates,
        iterates: solved.iterates,
        iterations,
        refinements,
        unreached: Vec::new(),
    }
}

/// The largest turn of a body from a node to the next, rad, and the step.
fn largest_turn(motion: &Motion) -> Option<(usize, f64)> {
    let nodes: Vec<&[f64]> = motion.all_nodes().collect();
    let each = motion.within.first().map_or(1, |own| own.len() + 1);
    let of_pair = |(k, pair): (usize, &[&[f64]])| {
        let triads = |q: &[f64]| -> Vec<_> { q.chunks_exact(12).map(directors::triad).collect() };
        let turns = triads(pair[0]).into_iter().zip(triads(pair[1]));
        let turn = |(from, to): (nalgebra::Matrix3<f64>, nalgebra::Matrix3<f64>)| {
            rotation::vector(&(to * from.transpose())).norm()
        };
        (k / each, turns.map(turn).fold(0.0, f64::max))
    };
    nodes.windows(2).enumerate().map(of_pair).max_by(|a, b| a.1.total_cmp(&b.1))
}
