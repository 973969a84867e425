//! The certificate of a user's model: the same properties, and a recommended step for a given
//! accuracy.

mod across;
mod contacts;
mod date;
mod halved;
mod moving;
pub mod page;
mod provenance;
pub mod subject;
mod works;

pub use self::date::now;
use self::moving::{FirstMotion, beginning};
pub use self::provenance::Provenance;
use self::subject::ModelSubject;
use holonom_model::{Family, Model};
use holonom_report::scene::NUMBERS;
use holonom_report::time;
use holonom_sim::output::Frames;
use holonom_sim::sample::Sample;
use holonom_sim::simulation::Simulation;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use vi_constraints::{OrderMethod as Order, SchemeKind};
use vi_core::Composition;
use vi_verify::certificate::{Certificate, Criterion};
use vi_verify::certify::{MeasurementPlan, certify};
use vi_verify::convergence::{Horizon, nodes, relative_difference};
use vi_verify::measure::applicable;
use vi_verify::subject::{GalerkinForm, SteppingMethod, Subject};

/// Coordinates up to which the dense schemes are measured too.
const DENSE_UP_TO: usize = 200;
/// Coordinates times sub-steps that a recommendation may cost.
const BUDGET: u64 = 20_000_000;
/// Relative differences of runs below this are round-off.
const ROUND_OFF: f64 = 1e-11;
/// Steps of the motion that the page shows, at most.
const SHOWN: usize = 1000;
/// How far the quotient of two errors may be from its nominal value, in binary digits.
const QUOTIENT: f64 = 0.5;

/// The refusal of a mechanism without a degree of freedom.
const NOTHING_CAN_MOVE: &str = "nothing can move: the model has 0 degrees of freedom, and no motion is prescribed; no order, no conservation \
                                and no step apply to it; `holonom check` says what locks it";
/// Why a model at rest has no certificate.
const NOTHING_MOVES: &str = "nothing moves: no order, no conservation and no step can be concluded from a system at rest; give it a velocity, a load, or \
     another initial configuration";

/// The certificate of a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelCertificate {
    /// The name of the model.
    pub model: String,
    /// Whether nothing failed.
    pub holds: bool,
    /// The accuracy that steps are recommended for: largest error of a coordinate, relative to the
    /// largest coordinate.
    pub accuracy: f64,
    /// The time of the node that measurements start from, s: 0, or where the model rests at first
    /// the time at which it begins to move.
    #[serde(default)]
    pub from: f64,
    /// Recommended steps.
    pub steps: Vec<Recommendation>,
    /// The findings.
    pub certificate: Certificate,
    /// Version of this library.
    pub version: String,
    /// What it was made of; `None` where it was not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
    /// The first steps of the motion, for the page alone; `None` where no step can be taken.
    #[serde(skip)]
    pub motion: Option<Frames>,
}

/// A step for an accuracy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recommendation {
    /// The order of the method.
    pub order: u32,
    /// Over what time, s, from where measurements start.
    pub end: f64,
    /// Estimated error at the step of the model; `None` where it cannot be estimated.
    pub error: Option<f64>,
    /// The step, s; `None` where none can be recommended.
    pub step: Option<f64>,
    /// Why not, or why not to the end.
    pub reason: String,
}

/// Measures a model; `progress` receives what is measured next and what fails.
///
/// # Errors
/// Why nothing can be measured, in words.
pub fn certify_model(
    model: &Model,
    accuracy: f64,
    progress: &mut dyn FnMut(&str),
) -> Result<ModelCertificate, String> {
    let own = match model.settings.scheme.family() {
        Family::Variational(kind) => match model.settings.method() {
            Order::Galerkin(_) => {
                GalerkinForm::of(kind).map_or(SteppingMethod::NODAL, SteppingMethod::Galerkin)
            }
            Order::Composition(_) => SteppingMethod::Variational(kind),
        },
        Family::EnergyMomentum(form) => SteppingMethod::EnergyMomentum(form),
        Family::Static => return Err("the model asks for statics, and nothing moves".into()),
    };
    let mut subject = ModelSubject::new(model.clone());
    let (mut rest, mut from) = (model.clone(), 0.0); // rest: of the run, from there on
    match beginning(&subject, model, own)? {
        FirstMotion::Rest => {
            let locked = Simulation::new(model).is_ok_and(|run| run.assembly().counts.dof == 0);
            return Err(if locked { NOTHING_CAN_MOVE } else { NOTHING_MOVES }.into());
        }
        FirstMotion::Motion => {}
        FirstMotion::Later(start) => {
            progress(&format!("from t = {} s on: the model rests before", time(start.t)));
            (rest.settings.end, from) = (model.settings.end - start.t, start.t);
            subject.start_at(start);
        }
    }
    let mut plan = plan(&subject, &rest, own)?;
    let name = &model.header.name;
    if model.is_nonsmooth() {
        plan.criteria.clear();
    }
    let mut certificate = certify(&subject, name, &plan, progress);
    if model.is_nonsmooth() {
        progress("stops and friction");
        certificate.findings.extend(contacts::findings(model, own));
    }
    if !model.laws.is_empty() || !model.bushings.is_empty() {
        progress("works of laws");
        certificate.findings.extend(works::findings(model, own));
    }
    if !model.events.is_empty() {
        progress("across events");
        certificate.findings.extend(across::findings(model, own));
    }
    let mut steps = Vec::new();
    let best = plan.methods.first().map_or(own, |(method, _)| *method);
    for order in [2, 4] {
        progress(&format!("a step for an accuracy of {accuracy:e}, order {order}"));
        steps.push(recommend(&subject, best, order, &rest, accuracy));
    }
    Ok(ModelCertificate {
        model: name.clone(),
        holds: certificate.holds(),
        accuracy,
        from,
        steps,
        certificate,
        version: env!("CARGO_PKG_VERSION").into(),
        provenance: None,
        motion: motion(model),
    })
}

/// The first steps of a model, as many as a page of usual size holds.
fn motion(model: &Model) -> Option<Frames> {
    let mut model = model.clone();
    model.settings.every = 1;
    let mut run = Simulation::new(&model).ok()?;
    let mut frames = Frames { members: run.members().to_vec(), ..Frames::default() };
    let width: usize = frames.members.iter().map(|member| member.kind.columns().len()).sum();
    let most = (NUMBERS / width.max(1)).min(SHOWN) as u64;
    let mut observe = |sample: &Sample| -> Result<(), Infallible> {
        frames.steps.push(sample.step);
        frames.times.push(sample.t);
        frames.q.push(sample.q.clone());
        Ok(())
    };
    // a run that fails shows what there is
    let Ok(_) = run.run_while(&mut observe, &mut |step, _| step < most);
    (frames.q.len() > 1).then_some(frames)
}

/// What is measured on a model: everything where it is small, the production scheme where it is
/// not.
fn plan(
    subject: &ModelSubject,
    model: &Model,
    own: SteppingMethod,
) -> Result<MeasurementPlan, String> {
    let (h, steps) = (model.settings.step, model.settings.steps());
    let n = subject.start(vi_verify::subject::SchemeSetting::new(own, 2, h))?.q().len();
    let candidates = match n <= DENSE_UP_TO {
        true => vec![
            SteppingMethod::NODAL,
            SteppingMethod::Variational(SchemeKind::Constrained),
            SteppingMethod::Variational(SchemeKind::Dalembert),
            SteppingMethod::Variational(SchemeKind::Reduced),
        ],
        false => vec![SteppingMethod::NODAL],
    };
    let mut methods = applicable(subject, &candidates, h);
    if !methods.contains(&own) {
        methods.push(own);
    }
    let own_order = model.settings.order;
    let with_own = |mut orders: Vec<u32>| {
        orders.push(own_order);
        orders.sort_unstable();
        orders.dedup();
        orders
    };
    let orders = |k: usize, method: SteppingMethod| match (k, method) {
        (_, SteppingMethod::Galerkin(_)) => with_own(vec![4, 6, 8]),
        (0, SteppingMethod::Variational(_)) if Composition::of_order(own_order).is_some() => {
            with_own(vec![2, 4])
        }
        (0, SteppingMethod::Variational(_)) => vec![2, 4],
        _ => vec![2],
    };
    let methods = methods.into_iter().enumerate().map(|(k, m)| (m, orders(k, m))).collect();
    let coarse = 8.0 * h; // of the coarsest run; 64 h in all
    let finest = if n <= DENSE_UP_TO { 1024 } else { 256 };
    let long = (2_000_000 / n.max(1) as u64).clamp(2048, 20_000);
    Ok(MeasurementPlan {
        methods,
        horizon: Horizon { end: 8.0 * coarse, coarsest: 8, finest },
        step: h,
        long: long.max(steps.min(20_000)),
        short: 2048,
        meant: steps,
        own: Some((own, own_order)),
        few: steps.clamp(1, 64),
        criteria: Criterion::ALL.to_vec(),
    })
}

/// The step for an accuracy, from the errors at the step of the model and half of it.
fn recommend(
    subject: &ModelSubject,
    method: SteppingMethod,
    order: u32,
    model: &Model,
    accuracy: f64,
) -> Recommendation {
    let h = model.settings.step;
    let sub_steps = Composition::of_order(order).map_or(1, |c| c.gammas().len() as u64);
    let size = subject
        .start(vi_verify::subject::SchemeSetting::new(method, 2, h))
        .map_or(1, |m| m.q().len());
    let affordable = BUDGET / (7 * sub_steps * size.max(1) as u64);
    let wanted = model.settings.steps().max(4);
    let mut steps = wanted.min(affordable.max(64)) / 4 * 4;
    let mut reason = match steps < wanted / 4 * 4 {
        true => "longer runs were not made".to_owned(),
        false => String::new(),
    };
    loop {
        let end = steps as f64 * h;
        let mut found =
            Recommendation { order, end, error: None, step: None, reason: reason.clone() };
        match error_at(subject, method, order, end, steps) {
            Err(refused) => {
                found.reason = refused;
                return found;
            }
            Ok(Some(error)) if error < ROUND_OFF => {
                (found.error, found.step) = (Some(error), Some(h));
                found.reason = "the error is round-off: larger steps were not measured".into();
                return found;
            }
            Ok(Some(error)) => {
                let step = h * (accuracy / error).powf(1.0 / f64::from(order));
                let longest = end / 8.0;
                found.error = Some(error);
                found.step = Some(step.min(longest));
                if step > longest {
                    found.reason = "not above an eighth of that time".into();
                }
                return found;
            }
            Ok(None) if steps >= 64 => {
                reason =
                    "beyond that time the error is not proportional to a power of the step: the motion is chaotic or \
                     not resolved by these steps"
                        .into();
                steps = steps / 16 * 4;
            }
            Ok(None) => {
                found.reason =
                    "the error is not proportional to a power of the step: the motion is chaotic or not resolved by \
                     these steps"
                        .into();
                return found;
            }
        }
    }
}

/// Estimated relative error of `steps` steps; `None` where three runs do not show the order.
fn error_at(
    subject: &ModelSubject,
    method: SteppingMethod,
    order: u32,
    end: f64,
    steps: u64,
) -> Result<Option<f64>, String> {
    let steps = u32::try_from(steps).map_err(|_| "too many steps".to_owned())?;
    let run = |factor: u32| nodes(subject, method, order, end, factor * steps);
    let runs = [run(1)?, run(2)?, run(4)?];
    let [coarse, fine] = [0, 1].map(|k| relative_difference(&runs[k], &runs[k + 1]));
    let nominal = f64::from(order);
    let (quotient, gain) = ((coarse / fine).log2(), 2_f64.powf(nominal));
    if coarse < ROUND_OFF {
        return Ok(Some(coarse.max(f64::EPSILON)));
    }
    let follows = (quotient - nominal).abs() <= QUOTIENT || fine < ROUND_OFF;
    Ok(follows.then_some(coarse * gain / (gain - 1.0)))
}
