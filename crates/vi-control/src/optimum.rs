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
    Iterate, MethodStart, Multipliers, NlpSolver, Outcome, Program, SharedProgram, SolverError,
};
use crate::replay::Replay;
use crate::transcription::problem::{MAX_INCREMENT, ProblemError};
use crate::transcription::{
    Guess, HeldPoint, Met, PriceOfRest, PriceSize, Resting, SolvedMotion, Transcription, TurnPrice,
};
use std::borrow::Cow;
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
    fn replay(&self, motion: &SolvedMotion) -> Result<Replay, String>;
}

/// What a point is.
#[derive(Clone, Debug, PartialEq)]
pub enum OptimumVerdict {
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

/// A solve on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelFound {
    /// Its number of steps.
    pub steps: usize,
    /// `f` where it ended.
    pub cost: f64,
    /// Whether that is an optimum in which no turn is bounded.
    pub is_optimal: bool,
}

/// A point with what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimum {
    /// What it is.
    pub verdict: OptimumVerdict,
    /// The motion.
    pub motion: SolvedMotion,
    /// The conditions of an optimum.
    pub kkt: Kkt,
    /// Its run; `None` where there is none.
    pub replay: Option<Replay>,
    /// Multipliers.
    pub multipliers: Multipliers,
    /// Where the last solve ended, to go on from.
    pub held: HeldPoint,
    /// Its conditions.
    pub met: Vec<Met>,
    /// The momenta that are to be zero at the end.
    pub resting: Vec<Resting>,
    /// What rest at the end costs.
    pub rest: PriceOfRest,
    /// What the bounds of turns from node to node cost.
    pub turns: Vec<TurnPrice>,
    /// Steps in which a joint turns by as much as the program lets it: the motion is an optimum
    /// among those that turn no more, not one of the problem. More steps.
    pub bounded_turns: Vec<usize>,
    /// Multipliers of the balances, shape `N × d`.
    pub costates: Vec<Vec<f64>>,
    /// What the bounds of controls cost, shape `N × k`; NaN where no value begins.
    pub bounds: Vec<Vec<f64>>,
    /// The size of the program.
    pub size: PriceSize,
    /// Iterations of the last solve.
    pub iterates: Vec<Iterate>,
    /// Iterations of all solves.
    pub iterations: usize,
    /// The solves of each number of steps, the last one included.
    pub levels: Vec<LevelFound>,
    /// Where there is an optimum of fewer steps than asked for, and none of these: how many were
    /// asked for. The motion is that optimum, the verdict of the last solve.
    pub wanted: Option<usize>,
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
        self.verdict == OptimumVerdict::Optimal
            && self.iterates.last().is_some_and(|i| i.shift == 0.0)
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
    /// The point to go on from is of another problem.
    #[error("the point to go on from is of another problem")]
    Another,
}

/// Sees the number of steps and each iteration; breaks to stop.
pub type Progress = Rc<RefCell<dyn FnMut(usize, &Iterate) -> ControlFlow<()>>>;

/// Solves a problem of `steps` steps, from a quarter and a half of them where `refine` is 2; or
/// goes on from a point that an earlier search has ended at.
///
/// # Errors
/// [`OptimizeError`]; how a solve ends is a [`OptimumVerdict`].
pub fn optimize(
    method: &mut dyn NlpSolver,
    setting: &dyn Setting,
    (steps, refine): (usize, u32),
    from: Option<&HeldPoint>,
    progress: &Progress,
) -> Result<Optimum, OptimizeError> {
    let halvings = (0..=refine).rev().find(|k| is_divisible(steps, *k)).unwrap_or(0);
    let mut search = StepSearch { method, setting, progress, iterations: 0, levels: Vec::new() };
    let mut coarse: Option<Solve> = None; // the last optimum
    let is_earlier = |k: &u32| from.is_some_and(|from| steps >> k != from.steps);
    for k in (0..=halvings).rev().skip_while(is_earlier) {
        let solved = match search.solve(steps >> k, coarse.as_ref(), from) {
            Err(OptimizeError::Undefined) if k > 0 || coarse.is_some() => None,
            solved => Some(solved?),
        };
        // what fails with few steps may do with all of them
        let stopped = |own: &Solve| own.outcome == Outcome::Stopped;
        match solved {
            Some(solved) if k == 0 || stopped(&solved) => {
                return search.ended(steps, solved, coarse);
            }
            Some(solved) if solved.is_optimum() => coarse = Some(solved),
            _ => {}
        }
    }
    match coarse {
        Some(coarse) => {
            let StepSearch { iterations, levels, .. } = search;
            let (verdict, wanted) = (OptimumVerdict::Unfinished(NOWHERE), Some(steps));
            Ok(Optimum { verdict, wanted, iterations, levels, ..judged(setting, coarse) })
        }
        None if from.is_some() => Err(OptimizeError::Another),
        None => Err(OptimizeError::Undefined),
    }
}

/// The method ended where there is no motion.
const NOWHERE: Outcome =
    Outcome::Failed(Cow::Borrowed("that it ended where the motion does not exist"));

/// A search through numbers of steps.
struct StepSearch<'a> {
    method: &'a mut dyn NlpSolver,
    setting: &'a dyn Setting,
    progress: &'a Progress,
    iterations: usize,
    levels: Vec<LevelFound>,
}

impl StepSearch<'_> {
    /// Solves the problem of so many steps, from an optimum of fewer, or from a point of these.
    fn solve(
        &mut self,
        steps: usize,
        coarse: Option<&Solve>,
        from: Option<&HeldPoint>,
    ) -> Result<Solve, OptimizeError> {
        let guess = coarse.map(|own| own.program.borrow().refined(&own.motion, steps));
        let mut program = self.setting.program(steps, guess.as_ref())?;
        let from = from.filter(|from| from.steps == steps);
        if from.is_some_and(|from| !program.goes_on(from)) {
            return Err(OptimizeError::Another);
        }
        let multipliers = from.map(|from| from.multipliers.clone());
        let start = MethodStart { multipliers, ..program.start() };
        let solved = solve(self.method, program, start, self.progress)?;
        self.iterations += solved.iterations;
        let cost = solved.motion.costs.iter().sum();
        let is_optimal = solved.is_optimum()
            && solved.kkt.is_met(&Tolerances::default())
            && solved.bounded_turns.is_empty();
        self.levels.push(LevelFound { steps, cost, is_optimal });
        Ok(solved)
    }

    /// The last solve with its verdict; where it is no optimum, one of fewer steps is kept.
    fn ended(
        self,
        steps: usize,
        solved: Solve,
        coarse: Option<Solve>,
    ) -> Result<Optimum, OptimizeError> {
        let mut found = judged(self.setting, solved);
        if !matches!(found.verdict, OptimumVerdict::Optimal | OptimumVerdict::Stopped) {
            let first = self.setting.program(steps, None)?;
            let unreached = first.unreached(&first.start().x).unwrap_or_default();
            let kept = coarse.map(|own| judged(self.setting, own));
            if let Some(kept) = kept.filter(|own| own.verdict == OptimumVerdict::Optimal) {
                let Optimum { verdict, held, .. } = found;
                found = Optimum { verdict, held, wanted: Some(steps), ..kept };
            }
            found.unreached = unreached;
        }
        Ok(Optimum { iterations: self.iterations, levels: self.levels, ..found })
    }
}

/// Whether steps can be halved so often, down to eight.
fn is_divisible(steps: usize, halvings: u32) -> bool {
    halvings == 0 || steps.is_multiple_of(1 << halvings) && steps >> halvings >= 8
}

/// The end of a solve.
struct Solve {
    outcome: Outcome,
    program: Rc<RefCell<Transcription>>,
    motion: SolvedMotion,
    kkt: Kkt,
    multipliers: Multipliers,
    held: HeldPoint,
    met: Vec<Met>,
    resting: Vec<Resting>,
    rest: PriceOfRest,
    turns: Vec<TurnPrice>,
    bounded_turns: Vec<usize>,
    costates: Vec<Vec<f64>>,
    bounds: Vec<Vec<f64>>,
    size: PriceSize,
    iterates: Vec<Iterate>,
    iterations: usize,
}

impl Solve {
    /// Whether the method takes it for an optimum.
    fn is_optimum(&self) -> bool {
        matches!(self.outcome, Outcome::Optimal | Outcome::Acceptable)
    }
}

fn solve(
    method: &mut dyn NlpSolver,
    program: Transcription,
    mut start: MethodStart,
    progress: &Progress,
) -> Result<Solve, OptimizeError> {
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
            start = MethodStart { multipliers, near: known, ..program.borrow().start() };
            continue;
        }
        let motion = program.borrow().motion(&solved.x).map_err(undefined)?;
        let kkt = Kkt::judge(&mut *program.borrow_mut(), &solved.x, &solved.multipliers);
        let met = program.borrow().met(&solved.x, &solved.multipliers).map_err(undefined)?;
        let resting = program.borrow().resting(&solved.x, &solved.multipliers);
        let rest = program.borrow().price_of_rest(&solved.x, &solved.multipliers);
        let turns = program.borrow().prices_of_turns(&solved.multipliers);
        let costates = program.borrow().costates(&solved.multipliers);
        let bounds = program.borrow().prices_of_controls(&solved.multipliers);
        let size = program.borrow().size();
        let bounded_turns = program.borrow().bounded_turns(&solved.x);
        let held = program.borrow().held(&solved.x, &solved.multipliers);
        return Ok(Solve {
            bounded_turns,
            held: held.map_err(undefined)?,
            met,
            resting: resting.map_err(undefined)?,
            rest: rest.map_err(undefined)?,
            turns,
            costates,
            bounds,
            size,
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

fn judged(setting: &dyn Setting, solved: Solve) -> Optimum {
    let replay = setting.replay(&solved.motion).ok();
    let named = || {
        let program = solved.program.borrow();
        let worst = solved.kkt.violated.iter().take(5);
        worst.map(|(row, by)| format!("{}: {by:.1e}", program.row_name(*row))).collect()
    };
    let turn = largest_turn(&solved.motion);
    let verdict = match solved.outcome {
        Outcome::Infeasible => OptimumVerdict::Infeasible(named()),
        Outcome::Stopped => OptimumVerdict::Stopped,
        Outcome::Exhausted | Outcome::Failed(_) => {
            OptimumVerdict::Unfinished(solved.outcome.clone())
        }
        Outcome::Optimal | Outcome::Acceptable => {
            if !solved.kkt.is_met(&Tolerances::default()) {
                OptimumVerdict::NotOptimal
            } else if let Some((step, turn)) = turn.filter(|(_, turn)| *turn > MAX_INCREMENT) {
                OptimumVerdict::TurnsTooFar { step, turn }
            } else if !replay.as_ref().is_some_and(Replay::is_same) {
                OptimumVerdict::OtherMotion
            } else {
                OptimumVerdict::Optimal
            }
        }
    };
    Optimum {
        verdict,
        motion: solved.motion,
        kkt: solved.kkt,
        replay,
        multipliers: solved.multipliers,
        held: solved.held,
        met: solved.met,
        resting: solved.resting,
        rest: solved.rest,
        turns: solved.turns,
        bounded_turns: solved.bounded_turns,
        costates: solved.costates,
        bounds: solved.bounds,
        size: solved.size,
        iterates: solved.iterates,
        iterations: solved.iterations,
        levels: Vec::new(),
        wanted: None,
        unreached: Vec::new(),
    }
}

/// The largest turn of a body from a node to the next, rad, and the step.
fn largest_turn(motion: &SolvedMotion) -> Option<(usize, f64)> {
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
