//! Controls: a motion and its efforts as a nonlinear program.
//!
//! The program, its refinement and the verdict are those of [`vi_control::optimum`]; here stand the
//! beginnings of a search and its runs.

use super::found::{
    FoundOptimum, OptimizeFailure, Refinement, SEED, SearchProgress, SearchStep, SearchWatch,
    StartFound,
};
use super::node::{begins, take_times};
use super::reader::{ProblemReader, supported};
use super::searched::Searched;
use super::verdict::{names_of_unknowns, report, starts_outside, status};
use crate::design::refused;
use crate::gradient::prepared::{Begin, Prepared};
use crate::output::RunFolder;
use crate::random::Random;
use crate::simulation::Simulation;
use crate::system::input::Input;
use crate::system::outside::ExternalActions;
use crate::system::{self, System};
use holonom_model::{ConditionKind, Model, ModelError, Optimize};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::Path as File;
use std::rc::Rc;
use std::sync::Arc;
use vi_constraints::integrator::SetupError;
use vi_control::optimum::{self, LevelFound, OptimizeError, Optimum, OptimumVerdict, Setting};
use vi_control::program::{Iterate, NlpSolver, SolverError};
use vi_control::replay::Replay;
use vi_control::transcription::problem::{
    ControlProblem, FinalTime, MAX_INCREMENT, NodeNumber, ProblemError, RestAtEnd, Uncovered, When,
};
use vi_control::transcription::{Guess, GuessPath, HeldPoint, SolvedMotion, Transcription};
use vi_multibody::held_effort::HeldEffort;

/// Size of disturbances of a beginning, m or rad.
const DISTURBED: f64 = 0.5;

/// The beginning of a search.
enum Beginning {
    /// From start to end in equal parts, and what it is disturbed by.
    Line(Vec<f64>),
    /// A motion with its controls.
    Run(Vec<Vec<f64>>, Vec<Vec<f64>>),
    /// What joint coordinates change by in each step, with the controls.
    Steps(Vec<Vec<f64>>, Vec<Vec<f64>>),
}

/// A model as a problem for any number of steps.
struct ModelSetting<'a> {
    model: &'a Model,
    system: System,
    begin: Begin,
    /// For all steps of the simulation.
    problem: ControlProblem,
    /// What joint coordinates change by from start to end.
    change: Vec<f64>,
    beginning: Beginning,
}

impl<'a> ModelSetting<'a> {
    fn new(model: &'a Model, settings: &Optimize) -> Result<Self, ModelError> {
        supported(model)?;
        let mut prepared = Prepared::new(model, &[], &[], &ExternalActions::default())?;
        let begin = Begin::new(&mut prepared)?;
        let mut system = system::build(model)?;
        let d = system.mechanism.tree().dof();
        let mut reader = ProblemReader {
            model,
            system: &mut system,
            acting: &prepared.system,
            rows: begin.rows(),
            mass: &begin.mass,
            q: &begin.q,
            t: begin.t,
            is_free: settings.time.is_some(),
        };
        let controls = model.controls.iter().map(|own| reader.control(own));
        let controls = controls.collect::<Result<Vec<_>, _>>()?;
        let costs = reader.costs()?;
        let (mut conditions, mut rest, mut change) = (Vec::new(), RestAtEnd::Free, vec![0.0; d]);
        for own in &model.conditions {
            if own.kind == ConditionKind::Rest {
                rest = reader.rest(own)?;
                continue;
            }
            let condition = reader.condition(own)?;
            if let (NodeNumber::Joint { unknown, start }, When::End) =
                (&condition.quantity, condition.when)
            {
                let [min, max] = condition.bounds;
                change[unknown.index] = unknown.sign * (start.max(min).min(max) - start);
            }
            conditions.push(condition);
        }
        let time = match settings.time {
            None => FinalTime::Fixed(model.settings.end),
            Some(own) => FinalTime::Free { min: own.min, max: own.max, guess: begins(model, own)? },
        };
        let steps = usize::try_from(model.settings.steps()).unwrap_or(usize::MAX);
        let (method, max_increment) = (model.settings.method(), MAX_INCREMENT);
        let problem = ControlProblem {
            steps,
            time,
            method,
            controls,
            costs,
            conditions,
            rest,
            max_increment,
        };
        let beginning = Beginning::Line(vec![0.0; d]);
        let mut setting = Self { model, system, begin, problem, change, beginning };
        setting.beginning = match settings.guess.as_str() {
            "line" => Beginning::Line(vec![0.0; d]),
            "run" => setting.own_run()?,
            folder => setting.earlier(folder)?,
        };
        Ok(setting)
    }

    /// The motion of the model without controls.
    fn own_run(&self) -> Result<Beginning, ModelError> {
        let nodes = nodes_of(self.model)?;
        Ok(Beginning::Run(nodes, Vec::new()))
    }

    /// The motion and the controls of an earlier optimum, and its time where that is free.
    fn earlier(&mut self, folder: &str) -> Result<Beginning, ModelError> {
        let key = "optimize.guess";
        let help = "name the folder of an earlier optimum, or write \"line\" or \"run\"";
        let refuse = |what: String| refused(key, what, help);
        let name = format!("`{folder}`, which is no folder of an optimum");
        let earlier = RunFolder::open(folder).model().map_err(|_| refuse(name.clone()))?;
        let text = std::fs::read_to_string(File::new(folder).join("controls.csv"));
        let text = text.map_err(|_| refuse(name))?;
        let mut lines = text.lines();
        let names = lines.next().into_iter().flat_map(|head| head.split(',').skip(1));
        let own = self.model.controls.iter().map(|own| own.name.as_str());
        if !names.eq(own) {
            return Err(refuse(format!("`{folder}`, whose controls are others")));
        }
        let row = |line: &str| line.split(',').skip(1).map(|x| x.parse().ok()).collect();
        let rows: Option<Vec<Vec<f64>>> = lines.map(row).collect();
        let rows = rows.ok_or_else(|| refuse(format!("`{folder}`, whose controls.csv is torn")))?;
        let nodes = nodes_of(&earlier)?;
        if nodes.first().map(Vec::len) != Some(self.begin.q.len()) || nodes.len() != rows.len() + 1
        {
            return Err(refuse(format!("`{folder}`, which is of another mechanism")));
        }
        if let FinalTime::Free { min, max, guess } = &mut self.problem.time {
            *guess = earlier.settings.end.clamp(*min, *max);
        }
        Ok(Beginning::Run(nodes, rows))
    }

    /// Begins with the motion of the same mechanism with other numbers: with the same changes of
    /// joint coordinates, where these add up.
    fn begin_beside(&mut self, motion: &SolvedMotion) {
        let links = self.system.mechanism.tree().links();
        if links.iter().all(|link| link.joint.kind.rotation_vector().is_none()) {
            let step = |pair: &[Vec<f64>]| {
                pair[1].iter().zip(&pair[0]).map(|(to, from)| to - from).collect()
            };
            let steps = motion.travel.windows(2).map(step).collect();
            self.beginning = Beginning::Steps(steps, motion.controls.clone());
        }
        if let FinalTime::Free { guess, .. } = &mut self.problem.time {
            *guess = motion.step * motion.controls.len() as f64;
        }
    }

    /// The problem of fewer steps.
    fn of_steps(&self, steps: usize) -> ControlProblem {
        let mut problem = self.problem.clone();
        let all = std::mem::replace(&mut problem.steps, steps);
        for control in &mut problem.controls {
            control.hold = (control.hold * steps / all).max(1);
        }
        for condition in &mut problem.conditions {
            if let When::Node(node) = &mut condition.when {
                *node = ((2 * *node * steps + all) / (2 * all)).clamp(1, steps);
            }
        }
        problem
    }

    /// Whether the problem of fewer steps is that of all: conditions at the same times, and values
    /// of controls that last as long, or each a step.
    fn is_of_all(&self, steps: usize) -> bool {
        let all = self.problem.steps;
        let alike = |count: usize| (count * steps).is_multiple_of(all);
        let holds = self.problem.controls.iter().map(|own| own.hold);
        let nodes = self.problem.conditions.iter().filter_map(|own| match own.when {
            When::Node(node) => Some(node),
            When::End | When::Path => None,
        });
        holds.filter(|hold| *hold > 1).chain(nodes).all(alike)
    }

    fn guess(&self, steps: usize) -> Guess {
        match &self.beginning {
            Beginning::Run(nodes, controls) => {
                Guess::of_run(&self.system.mechanism, nodes, controls, steps)
            }
            Beginning::Steps(changes, controls) => {
                Guess { path: GuessPath::Increments(changes.clone()), controls: controls.clone() }
            }
            Beginning::Line(disturbed) => {
                let at = |n: usize| {
                    let part = n as f64 / steps as f64;
                    let bump = libm::sin(std::f64::consts::PI * part);
                    let own = self.change.iter().zip(disturbed);
                    own.map(|(change, by)| change * part + by * bump).collect::<Vec<f64>>()
                };
                let step = |n: usize| {
                    let (from, to) = (at(n), at(n + 1));
                    to.iter().zip(&from).map(|(a, b)| a - b).collect()
                };
                let path = GuessPath::Increments((0..steps).map(step).collect());
                Guess { path, controls: Vec::new() }
            }
        }
    }

    fn run(&self, motion: &SolvedMotion) -> Result<(Simulation, Vec<HeldEffort>), ModelError> {
        let mut model = self.model.clone();
        take_times(&mut model, motion);
        let inputs: Vec<Input> = model.controls.iter().map(Input::of).collect();
        let efforts = inputs.iter().map(Input::effort).collect();
        let outside = ExternalActions::of_inputs(&inputs);
        Ok((Simulation::with_outside(&model, &outside)?, efforts))
    }
}

impl Setting for ModelSetting<'_> {
    fn program(&self, steps: usize, guess: Option<&Guess>) -> Result<Transcription, ProblemError> {
        let System { mechanism, dynamics, .. } = &self.system;
        let system = Arc::new(dynamics.variational(mechanism));
        let own = if guess.is_none() { Some(self.guess(steps)) } else { None };
        let guess = guess.or(own.as_ref()).expect("one of both");
        Transcription::new(mechanism, system, self.begin.at(), self.of_steps(steps), guess)
    }

    fn replay(&self, motion: &SolvedMotion) -> Result<Replay, String> {
        let (simulation, efforts) = self.run(motion).map_err(|error| error.to_string())?;
        Ok(Replay::of(&mut simulation.into_integrator(), &efforts, motion))
    }
}

/// The nodes of the run of a model.
fn nodes_of(model: &Model) -> Result<Vec<Vec<f64>>, ModelError> {
    let mut simulation = Simulation::new(model)?;
    let run = simulation.integrator();
    let mut nodes = vec![run.state().q.clone()];
    for _ in 0..model.settings.steps() {
        run.step().map_err(|error| {
            let help = "write guess = \"line\"";
            refused("optimize.guess", format!("a run that fails: {error}"), help)
        })?;
        nodes.push(run.state().q.clone());
    }
    Ok(nodes)
}

/// Finds the controls of a model.
pub(super) fn control(
    model: &Model,
    settings: &Optimize,
    (method, progress): (&mut dyn NlpSolver, &SearchWatch),
    from: Option<&HeldPoint>,
) -> Result<FoundOptimum, OptimizeFailure> {
    let from = from.map_or(From::Guess, From::Point);
    Ok(report(model, search(model, settings, method, progress, from)?))
}

/// What a search begins with.
#[derive(Clone, Copy)]
pub(super) enum From<'a> {
    /// The guess of the model.
    Guess,
    /// The motion of the same mechanism with other numbers.
    Motion(&'a SolvedMotion),
    /// Where an earlier search of the same problem ended.
    Point(&'a HeldPoint),
}

/// Looks for the controls of a model.
pub(super) fn search(
    model: &Model,
    settings: &Optimize,
    method: &mut dyn NlpSolver,
    progress: &SearchWatch,
    from: From<'_>,
) -> Result<Searched, OptimizeFailure> {
    let alone = Optimize { guess: "line".to_owned(), starts: 1, ..settings.clone() };
    let (settings, held) = match from {
        From::Point(held) => (&alone, Some(held)),
        From::Guess | From::Motion(_) => (settings, None),
    };
    let mut setting = ModelSetting::new(model, settings)?;
    if let From::Motion(motion) = from {
        setting.begin_beside(motion);
    }
    let (steps, d) = (setting.problem.steps, setting.change.len());
    let mut random = Random(SEED);
    let (mut best, mut starts): (Option<Optimum>, _) = (None, Vec::new());
    let rows: Rc<RefCell<Vec<SearchStep>>> = Rc::default();
    for start in 1..=settings.starts {
        if start > 1 {
            let by = (0..d).map(|_| DISTURBED * random.number()).collect();
            setting.beginning = Beginning::Line(by);
        }
        let (seen, before) = (rows.clone(), rows.borrow().len());
        let told = progress.clone();
        let watch = move |steps: usize, at: &Iterate| {
            let iterate = *at;
            seen.borrow_mut().push(SearchStep { start, steps, iterate, parameters: Vec::new() });
            let iteration = seen.borrow().len() - before;
            let Iterate { cost, infeasibility, .. } = iterate;
            let goes_on =
                (told.borrow_mut())(&SearchProgress { start, iteration, cost, infeasibility });
            if goes_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let watch: optimum::Progress = Rc::new(RefCell::new(watch));
        let counts = (steps, settings.refine);
        let found = optimum::optimize(method, &setting, counts, held, &watch);
        let found = found.map_err(|error| match error {
            OptimizeError::Problem(ProblemError::Start { condition, value, .. }) => {
                OptimizeFailure::Model(starts_outside(model, condition, value))
            }
            OptimizeError::Problem(error) => {
                let help = remedy(&error);
                OptimizeFailure::Model(refused("optimize", error.to_string(), help))
            }
            OptimizeError::Another => OptimizeFailure::Another,
            OptimizeError::Method(SolverError::Environment(name)) => {
                let what = format!("a search beside the environment variable `{name}`, which would change the method");
                OptimizeFailure::Model(refused("optimize", what, "unset it"))
            }
            error => OptimizeFailure::Run(error.to_string()),
        })?;
        let (status, cost) = (status(&found), found.cost());
        StartFound::add(&mut starts, status, cost, String::new());
        let stopped = found.verdict == OptimumVerdict::Stopped;
        let rank = |own: &Optimum| {
            (own.verdict != OptimumVerdict::Optimal, !own.bounded_turns.is_empty(), own.cost())
        };
        if best.as_ref().is_none_or(|other| rank(&found) < rank(other)) {
            best = Some(found);
        }
        if stopped {
            break;
        }
    }
    let Some(found) = best else {
        return Err(OptimizeFailure::Run("there is no search".to_owned()));
    };
    let rows = rows.take();
    let unknowns = names_of_unknowns(&setting.system.mechanism);
    let refinements = found.levels.iter().map(|&LevelFound { steps, cost, is_optimal }| {
        Refinement { steps, cost, comparable: is_optimal && setting.is_of_all(steps) }
    });
    let refinements = refinements.collect();
    Ok(Searched { found, rows, starts, refinements, unknowns })
}

/// What helps where there is no program.
fn remedy(error: &ProblemError) -> &'static str {
    match error {
        ProblemError::Method(SetupError::DissipativeComposition) => {
            "write order = 2, or method = \"galerkin\", under [simulation]"
        }
        ProblemError::NotCovered(what) => remedy_of(what),
        _ => "change what cannot be optimised, or what is asked for",
    }
}

fn remedy_of(what: &Uncovered) -> &'static str {
    match what {
        Uncovered::Particles => "let bodies take their place",
        Uncovered::Beams => {
            "remove the [[control]]: designs and fits take beams, controls take bodies on springs"
        }
        Uncovered::Memory => "take functions of the motion alone: no states, delays or samples",
        Uncovered::ForceInTime(_) | Uncovered::EffortInTime | Uncovered::MotionInTime => {
            "remove `time` of [optimize]: the motion lasts until `end`"
        }
        Uncovered::SingularStart => "begin where all joints can move, or ask for coordinates",
        Uncovered::RestInLoop => "leave `of` out: all comes to rest",
        Uncovered::NoCoordinate => "let a torque act on the body: `body` in the place of `joint`",
        Uncovered::Constraints => "remove them, or write `cut = true` at another joint of the loop",
    }
}
