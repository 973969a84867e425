//! Controls: a motion and its efforts as a nonlinear program.
//!
//! The program, its refinement and the verdict are those of [`vi_control::optimum`]; here stand the
//! sections of a model as a [`Problem`], the beginnings, and the run of what was found.

use super::found::{
    ConditionMet, ControlFound, Found, Judged, OptimizeFailure, OptimumReport, Progress,
    Refinement, Replayed, SEED, StartFound, Status, Step, Watch, plain,
};
use super::node::{begins, node};
use crate::design::refused;
use crate::gradient::TermValue;
use crate::gradient::prepared::{Begin, Prepared, unit_load};
use crate::gradient::quantity::Measured;
use crate::output::RunFolder;
use crate::random::Random;
use crate::simulation::Simulation;
use crate::system::input::Input;
use crate::system::outside::Outside;
use crate::system::{self, System};
use holonom_model::{
    Condition as Stated, ConditionKind, ConditionTime, ControlShape, CountedAt, History, Joint,
    JointMotor, Load, Model, ModelError, MotionPath, ObjectiveKind, Optimize,
};
use nalgebra::Vector3;
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::Path as File;
use std::rc::Rc;
use std::sync::Arc;
use vi_control::objective::Quantity as _;
use vi_control::optimum::{self, OptimizeError, Optimum, Setting, Verdict};
use vi_control::program::{Iterate, NlpSolver, Outcome};
use vi_control::replay::Replay;
use vi_control::transcription::problem::{
    Acts, Condition, Control, Cost, CostKind, FinalTime, MAX_INCREMENT, Problem, ProblemError,
    Quantity, Rest, When,
};
use vi_control::transcription::{Guess, Motion, Path, Transcription};
use vi_core::Configuration;
use vi_core::coordinate_force::SignedUnknown;
use vi_multibody::form::{Form, Row};
use vi_multibody::held_effort::HeldEffort;

/// Size of disturbances of a beginning, m or rad.
const DISTURBED: f64 = 0.5;

/// The beginning of a search.
enum Beginning {
    /// From start to end in equal parts, and what it is disturbed by.
    Line(Vec<f64>),
    /// A motion with its controls.
    Run(Vec<Vec<f64>>, Vec<Vec<f64>>),
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
        supported(model, settings)?;
        let mut prepared = Prepared::new(model, &[], (&[], &Outside::default()))?;
        let begin = Begin::new(model, &mut prepared)?;
        let mut system = system::build(model)?;
        let d = system.mechanism.tree().dof();
        let acting = &prepared.system;
        let mut reader = Reader { model, system: &mut system, acting, q: &begin.q, t: begin.t };
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
        let max_increment = MAX_INCREMENT;
        let problem = Problem { steps, time, controls, costs, conditions, rest, max_increment };
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
        model.settings.step = motion.step;
        model.settings.end = motion.step * motion.controls.len() as f64;
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

/// Refuses what the program does not have, by its key.
fn supported(model: &Model, settings: &Optimize) -> Result<(), ModelError> {
    let refuse = |key: &str, what: &str, help: &str| Err(refused(key, what, help));
    if !settings.parameters.is_empty() {
        let help = "remove `parameters`, or the [[control]]";
        return refuse("optimize.parameters", "parameters beside controls", help);
    }
    if model.settings.order != 2 {
        return refuse(
            "simulation.order",
            "controls of a scheme of higher order",
            "write order = 2",
        );
    }
    if model.is_nonsmooth() {
        let help = "remove contacts, stops and dry friction: their impulses have no derivative";
        return refuse("contact", "controls beside impulses", help);
    }
    if model.has_velocity_constraints() {
        let help = "remove rolling, blades and sums of rates";
        return refuse("constraint", "controls beside constraints of velocities", help);
    }
    if model.objectives.is_empty() {
        let help = "add an [[objective]]: effort, work, time, rate or sensor";
        return refuse("objective", "an optimum of nothing", help);
    }
    for (k, own) in model.controls.iter().enumerate() {
        let key = format!("control.{}", own.name);
        if own.shape == ControlShape::Linear {
            let help = "write shape = \"constant\"";
            return refuse(&format!("{key}.shape"), "an optimum of efforts linear in time", help);
        }
        let Some(joint) = &own.joint else { continue };
        let mut others = model.controls.iter().take(k);
        let others = others.any(|other| other.joint.as_ref() == Some(joint));
        let motor = model.joint(joint).is_some_and(|joint| joint.motor.is_some());
        if others || motor {
            let what = "an optimum of a control beside another effort of its joint";
            let help = "the optimum is written as a motor, and a joint has one: keep one of them";
            return refuse(&format!("{key}.joint"), what, help);
        }
    }
    Ok(())
}

/// Reads sections as parts of a problem.
struct Reader<'a> {
    model: &'a Model,
    system: &'a mut System,
    /// The same with the controls.
    acting: &'a System,
    q: &'a [f64],
    t: f64,
}

impl Reader<'_> {
    fn unknown(&self, joint: usize, freedom: usize) -> Option<SignedUnknown> {
        let mechanism = &self.system.mechanism;
        mechanism.tree().unknown_of(mechanism.description().joints.get(joint)?, freedom)
    }

    fn control(&self, own: &holonom_model::Control) -> Result<Control, ModelError> {
        let refuse = |part: &str, what: String, help: &str| {
            Err(refused(&format!("control.{}.{part}", own.name), what, help))
        };
        let acts = match &own.joint {
            Some(name) => {
                let joint = self.model.joints.iter().position(|joint| joint.name == *name);
                let Some(along) = joint.and_then(|joint| self.unknown(joint, own.freedom)) else {
                    let what =
                        format!("an optimum of an effort along `{name}`, which closes a loop");
                    let help = "write `cut = true` at another joint of the loop";
                    return refuse("joint", what, help);
                };
                Acts::Along(along)
            }
            None => match unit_load(self.acting, &Input::of(own)) {
                Some(load) => Acts::Wrench(load),
                None => {
                    let what = "an optimum of a force on a point mass".to_owned();
                    return refuse("body", what, "let it act on a body");
                }
            },
        };
        let bounds = [own.min.unwrap_or(f64::NEG_INFINITY), own.max.unwrap_or(f64::INFINITY)];
        Ok(Control { name: own.name.clone(), acts, bounds, hold: own.hold })
    }

    /// A sensor as a quantity, and whether it is half the square of what it shows.
    fn quantity(&mut self, key: &str, sensor: &str) -> Result<(Quantity, bool), ModelError> {
        let own = Measured::of(self.model, &mut self.system.mechanism, key, sensor)?;
        Ok(match &own {
            Measured::Point(own) => {
                let along = Form::constant(Vector3::ith(own.axis, 1.0));
                (Quantity::Product(Row::product(own.point.clone(), along, 0.0)), false)
            }
            Measured::Distance(between) => (Quantity::Product(Row::distance(between, 0.0)), true),
            Measured::Joint { joint, freedom, .. } => {
                let start = own.value(Configuration::new(self.t, self.q));
                let Some(unknown) = self.unknown(*joint, *freedom) else {
                    let what = format!("`{sensor}`, a coordinate of a joint that closes a loop");
                    return Err(refused(key, what, "measure another joint, or a position"));
                };
                (Quantity::Joint { unknown, start }, false)
            }
        })
    }

    fn costs(&mut self) -> Result<Vec<Cost>, ModelError> {
        let (model, mut costs) = (self.model, Vec::new());
        for own in &model.objectives {
            let is_of = |name: &String| own.controls.is_empty() || own.controls.contains(name);
            let all = 0..model.controls.len();
            let places = all.filter(|&k| is_of(&model.controls[k].name)).collect();
            let kind = match own.kind {
                ObjectiveKind::Effort => CostKind::Effort(places),
                ObjectiveKind::Work => CostKind::Work(places),
                ObjectiveKind::Rate => CostKind::Rate(places),
                ObjectiveKind::Time => CostKind::Time,
                ObjectiveKind::Sensor => {
                    let key = format!("objective.{}.sensor", own.name);
                    let sensor = own.sensor.as_deref().unwrap_or_default();
                    let (quantity, squared) = self.quantity(&key, sensor)?;
                    if squared {
                        let help = "take positions or joint coordinates, or a [[condition]]";
                        return Err(refused(&key, "the cost of a distance", help));
                    }
                    let when = match own.at {
                        CountedAt::End => When::End,
                        CountedAt::Path => When::Path,
                    };
                    CostKind::Deviation { quantity, target: own.target, when }
                }
            };
            costs.push(Cost { weight: own.weight, kind });
        }
        Ok(costs)
    }

    fn condition(&mut self, own: &Stated) -> Result<Condition, ModelError> {
        let key = format!("condition.{}", own.name);
        let sensor = own.sensor.as_deref().unwrap_or_default();
        let (quantity, squared) = self.quantity(&format!("{key}.sensor"), sensor)?;
        let mut bounds = own.bounds();
        if squared {
            if bounds[1] < 0.0 {
                return Err(refused(&key, "a negative distance", "write positive bounds"));
            }
            bounds = bounds.map(|x| 0.5 * x * x.abs()); // of half a square
        }
        let when = match own.at {
            ConditionTime::Word(CountedAt::End) => When::End,
            ConditionTime::Word(CountedAt::Path) => When::Path,
            ConditionTime::Time(t) => When::Node(node(self.model, &own.name, t)?),
        };
        if let (When::Path, Quantity::Joint { start, .. }) = (when, &quantity)
            && !(bounds[0]..=bounds[1]).contains(start)
        {
            let what = format!("a start outside of the bounds: `{sensor}` begins with {start}");
            return Err(refused(&key, what, "widen the bounds, or begin within them"));
        }
        Ok(Condition { name: own.name.clone(), quantity, when, bounds })
    }

    fn rest(&self, own: &Stated) -> Result<Rest, ModelError> {
        if own.of.is_empty() {
            return Ok(Rest::All);
        }
        let mut unknowns = Vec::new();
        for name in &own.of {
            let joint = self.model.joints.iter().position(|joint| joint.name == *name);
            let count = joint.map_or(0, |k| self.model.joints[k].pair().dof());
            for freedom in 0..count {
                let found = joint.and_then(|joint| self.unknown(joint, freedom));
                let Some(unknown) = found else {
                    let key = format!("condition.{}.of", own.name);
                    let what = format!("rest of `{name}`, which closes a loop");
                    return Err(refused(&key, what, "leave `of` out: all comes to rest"));
                };
                unknowns.push(unknown.index);
            }
        }
        Ok(Rest::Unknowns(unknowns))
    }
}

/// The model of a motion with its controls as motors and loads, for an ordinary run.
fn moved(model: &Model, motion: &Motion) -> Model {
    let mut own = model.clone();
    own.settings.step = motion.step;
    own.settings.end = motion.step * motion.controls.len() as f64;
    for (k, control) in model.controls.iter().enumerate() {
        let values = motion.controls.iter().map(|row| row[k]).collect();
        let history = History::Steps { values, step: Some(motion.step) };
        if let Some(load) = control.load() {
            own.loads.push(Load { history, ..load });
            continue;
        }
        let motor = JointMotor {
            freedom: control.freedom,
            effort: 1.0,
            history,
            proportional: 0.0,
            derivative: 0.0,
            path: MotionPath::default(),
        };
        let is_own = |joint: &&mut Joint| Some(&joint.name) == control.joint.as_ref();
        let joint = own.joints.iter_mut().find(is_own);
        joint.into_iter().for_each(|joint| joint.motor = Some(motor.clone()));
    }
    plain(&mut own);
    own
}

/// Finds the controls of a model.
pub(super) fn control(
    model: &Model,
    settings: &Optimize,
    method: &mut dyn NlpSolver,
    progress: &Watch,
) -> Result<Found, OptimizeFailure> {
    let mut setting = ModelSetting::new(model, settings)?;
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
                let help = "change what cannot be optimised, or what is asked for";
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
    Ok(report(model, found, (rows, starts)))
}

fn status(verdict: &Verdict) -> Status {
    match verdict {
        Verdict::Optimal => Status::Optimal,
        Verdict::Infeasible(_) => Status::Infeasible,
        Verdict::Stopped => Status::Stopped,
        Verdict::Unfinished(_) => Status::Unfinished,
        Verdict::NotOptimal => Status::NotOptimal,
        Verdict::OtherMotion => Status::OtherMotion,
        Verdict::TurnsTooFar { .. } => Status::TurnsTooFar,
    }
}

fn report(model: &Model, found: Optimum, (rows, starts): (Vec<Step>, Vec<StartFound>)) -> Found {
    let motion = &found.motion;
    let steps = motion.controls.len();
    let term = |(own, value): (&holonom_model::Objective, &f64)| TermValue {
        name: own.name.clone(),
        value: *value,
    };
    let used = |(k, own): (usize, &holonom_model::Control)| {
        let values = motion.controls.iter().map(|row| row[k]);
        let size = values.clone().fold(0.0_f64, |most, value| most.max(value.abs()));
        let near = |value: f64, bound: f64| (value - bound).abs() <= 1e-6 * size.max(1e-300);
        let bounds = [own.min, own.max];
        let at_bound = |value: &f64| bounds.iter().flatten().any(|bound| near(*value, *bound));
        ControlFound {
            name: own.name.clone(),
            min: own.min,
            max: own.max,
            largest: size,
            at_bounds: values.filter(at_bound).count(),
        }
    };
    let with_sensor = || model.conditions.iter().filter(|own| own.kind == ConditionKind::Sensor);
    let met = |(k, own): (usize, &Stated)| {
        let is_distance = own.sensor.as_deref().is_some_and(|name| {
            model.sensors.iter().any(|sensor| {
                sensor.name == name && sensor.kind == holonom_model::SensorKind::Distance
            })
        });
        let at = found.met.iter().filter(|met| met.condition == k);
        ConditionMet::of(
            own,
            at.map(|met| match is_distance {
                true => {
                    let length = (2.0 * met.value).max(0.0).sqrt(); // of half a square
                    (length, met.multiplier * length)
                }
                false => (met.value, met.multiplier),
            }),
        )
    };
    let conditions: Vec<ConditionMet> = with_sensor().enumerate().map(met).collect();
    let missed = match &found.verdict {
        Verdict::Infeasible(rows) => rows.clone(),
        Verdict::Unfinished(outcome) => {
            std::iter::once(unfinished(outcome)).chain(steep(&conditions, found.cost())).collect()
        }
        Verdict::NotOptimal => steep(&conditions, found.cost()).into_iter().collect(),
        Verdict::TurnsTooFar { step, turn } => {
            vec![format!("{turn:.2} rad in step {step}: take more steps")]
        }
        _ => Vec::new(),
    };
    let (of, time) = (found.refinements.iter(), motion.step * steps as f64);
    let report = OptimumReport {
        model: model.header.name.clone(),
        status: status(&found.verdict),
        missed,
        steps,
        step: motion.step,
        time,
        cost: found.cost(),
        terms: model.objectives.iter().zip(&motion.costs).map(term).collect(),
        controls: model.controls.iter().enumerate().map(used).collect(),
        conditions,
        iterations: found.iterations,
        sufficient: Some(found.is_sufficient()),
        refinements: of.map(|&(steps, cost)| Refinement { steps, cost }).collect(),
        judged: Some(Judged {
            stationarity: found.kkt.stationarity,
            violation: found.kkt.violation,
            complementarity: found.kkt.complementarity,
        }),
        replay: found.replay.as_ref().map(|own| Replayed {
            deviation: own.deviation,
            node: own.node,
            by_steps: own.by_steps,
        }),
        starts: if starts.len() > 1 { starts } else { Vec::new() },
        ..OptimumReport::default()
    };
    let (model, controls) = (moved(model, motion), motion.controls.clone());
    Found { report, steps: rows, model, costates: found.costates, controls }
}

/// Why a method has not finished, in words.
fn unfinished(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Exhausted => "`max_iterations` of [optimize] were made".to_owned(),
        Outcome::Failed("Not_Enough_Degrees_Of_Freedom") => {
            "conditions ask for more than the controls have values: take more steps, or ask for less"
                .to_owned()
        }
        Outcome::Failed(words) => format!("the method says {words}"),
        other => format!("the method says {other:?}"),
    }
}

/// What is said where a method has not converged and prices have grown without bound: multipliers
/// `y` with `∇f + Jᵀy = 0` of that size state that rows of `J` depend on one another, to `1/|y|`.
fn steep(conditions: &[ConditionMet], cost: f64) -> Option<String> {
    const STEEP: f64 = 1e5; // times the cost for one unit
    let dearest = conditions.iter().max_by(|a, b| a.price.abs().total_cmp(&b.price.abs()))?;
    (dearest.price.abs() > STEEP * cost.abs()).then(|| {
        format!(
            "the price of `{}` grows without bound, {:.0e}: nothing changes it there, as a component at its largest value, \
             or it depends on other conditions; state other components",
            dearest.name, dearest.price
        )
    })
}
