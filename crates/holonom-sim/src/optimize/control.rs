//! Controls: a motion and its efforts as a nonlinear program.
//!
//! The program, its refinement and the verdict are those of [`vi_control::optimum`]; here stand the
//! beginnings of a search and its runs.

use super::found::{Found, OptimizeFailure, Progress, SEED, StartFound, Step, Watch};
use super::node::{begins, take_times};
use super::reader::{Reader, supported};
use super::verdict::{report, status};
use crate::design::refused;
use crate::gradient::prepared::{Begin, Prepared};
use crate::output::RunFolder;
use crate::random::Random;
use crate::simulation::Simulation;
use crate::system::input::Input;
use crate::system::outside::Outside;
use crate::system::{self, System};
use holonom_model::{ConditionKind, Model, ModelError, Optimize};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::Path as File;
use std::rc::Rc;
use std::sync::Arc;
use vi_constraints::integrator::SetupError;
use vi_control::optimum::{self, OptimizeError, Optimum, Setting, Verdict};
use vi_control::program::{Iterate, NlpSolver};
use vi_control::replay::Replay;
use vi_control::transcription::problem::{
    FinalTime, MAX_INCREMENT, Problem, ProblemError, Quantity, Rest, Uncovered, When,
};
use vi_control::transcription::{Guess, Motion, Path, Transcription};
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
    problem: Problem,
    /// What joint coordinates change by from start to end.
    change: Vec<f64>,
    beginning: Beginning,
}

impl<'a> ModelSetting<'a> {
    fn new(model: &'a Model, settings: &Optimize) -> Result<Self, ModelError> {
        supported(model)?;
        let mut prepared = Prepared::new(model, &[], (&[], &Outside::default()))?;
        let begin = Begin::new(&mut prepared)?;
        let mut system = system::build(model)?;
        let d = system.mechanism.tree().dof();
        let mut reader = Reader {
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
        let (mut conditions, mut rest, mut change) = (Vec::new(), Rest::Free, vec![0.0; d]);
        for own in &model.conditions {
            if own.kind == ConditionKind::Rest {
                rest = reader.rest(own)?;
                continue;
            }
            let condition = reader.condition(own)?;
            if let (Quantity::Joint { unknown, start }, When::End) =
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
        let problem =
            Problem { steps, time, method, controls, costs, conditions, rest, max_increment };
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

    /// The motion and the controls of an earlier optimum.
    fn earlier(&self, folder: &str) -> Result<Beginning, ModelError> {
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
        Ok(Beginning::Run(nodes, rows))
    }

    /// Begins with the motion of the same mechanism with other numbers: with the same changes of
    /// joint coordinates, where these add up.
    fn begin_beside(&mut self, motion: &Motion) {
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
    fn of_steps(&self, steps: usize) -> Problem {
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

    fn guess(&self, steps: usize) -> Guess {
        match &self.beginning {
            Beginning::Run(nodes, controls) => {
                Guess::of_run(&self.system.mechanism, nodes, controls, steps)
            }
            Beginning::Steps(changes, controls) => {
                Guess { path: Path::Increments(changes.clone()), controls: controls.clone() }
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
                let path = Path::Increments((0..steps).map(step).collect());
                Guess { path, controls: Vec::new() }
            }
        }
    }

    fn run(&self, motion: &Motion) -> Result<(Simulation, Vec<HeldEffort>), ModelError> {
        let mut model = self.model.clone();
        take_times(&mut model, motion);
        let inputs: Vec<Input> = model.controls.iter().map(Input::of).collect();
        let efforts = inputs.iter().map(Input::effort).collect();
        let outside = Outside::of_inputs(&inputs);
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

    fn replay(&self, motion: &Motion) -> Result<Replay, String> {
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
    method: &mut dyn NlpSolver,
    progress: &Watch,
) -> Result<Found, OptimizeFailure> {
    let Searched { found, rows, starts } = search(model, settings, (method, progress), None)?;
    Ok(report(model, found, (rows, starts)))
}

/// What a search has found, with its iterations and what its beginnings came to.
pub(super) struct Searched {
    pub(super) found: Optimum,
    pub(super) rows: Vec<Step>,
    pub(super) starts: Vec<StartFound>,
}

/// Looks for the controls of a model, from the motion of another one where it is given.
pub(super) fn search(
    model: &Model,
    settings: &Optimize,
    (method, progress): (&mut dyn NlpSolver, &Watch),
    from: Option<&Motion>,
) -> Result<Searched, OptimizeFailure> {
    let mut setting = ModelSetting::new(model, settings)?;
    if let Some(motion) = from {
        setting.begin_beside(motion);
    }
    let (steps, d) = (setting.problem.steps, setting.change.len());
    let mut random = Random(SEED);
    let (mut best, mut starts): (Option<(Optimum, Vec<Step>)>, _) = (None, Vec::new());
    for start in 1..=settings.starts {
        if start > 1 {
            let by = (0..d).map(|_| DISTURBED * random.number()).collect();
            setting.beginning = Beginning::Line(by);
        }
        let rows: Rc<RefCell<Vec<Step>>> = Rc::default();
        let (seen, told) = (rows.clone(), progress.clone());
        let watch = move |steps: usize, at: &Iterate| {
            let iterate = *at;
            seen.borrow_mut().push(Step { start, steps, iterate, parameters: Vec::new() });
            let iteration = seen.borrow().len();
            let Iterate { cost, infeasibility, .. } = iterate;
            let goes_on = (told.borrow_mut())(&Progress { start, iteration, cost, infeasibility });
            if goes_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let watch: optimum::Progress = Rc::new(RefCell::new(watch));
        let found = optimum::optimize(method, &setting, steps, settings.refine, &watch);
        let found = found.map_err(|error| match error {
            OptimizeError::Problem(error) => {
                let help = remedy(&error);
                OptimizeFailure::Model(refused("optimize", error.to_string(), help))
            }
            error => OptimizeFailure::Run(error.to_string()),
        })?;
        let (status, cost) = (status(&found.verdict), found.cost());
        starts.push(StartFound { start, status, cost, message: String::new() });
        let stopped = found.verdict == Verdict::Stopped;
        let rank = |own: &Optimum| (own.verdict != Verdict::Optimal, own.cost());
        if best.as_ref().is_none_or(|(other, _)| rank(&found) < rank(other)) {
            best = Some((found, best.take().map_or_else(Vec::new, |own| own.1)));
        }
        if let Some((_, all)) = &mut best {
            all.append(&mut rows.borrow_mut());
        }
        if stopped {
            break;
        }
    }
    let Some((found, rows)) = best else {
        return Err(OptimizeFailure::Run("there is no search".to_owned()));
    };
    Ok(Searched { found, rows, starts })
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
