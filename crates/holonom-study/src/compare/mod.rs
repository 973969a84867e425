//! Variational and energy–momentum schemes side by side: same model, same initial values, same
//! steps.
//!
//! ```text
//! distance        max_n |q_n − q^ref_n|_∞
//! energy          max_n |H_n − H_0|; bounded (without secular drift) or conserved
//! momentum maps   max_n |J_n − J_0| of those that the system conserves    both once all loads have ended
//! constraints     |g(q_n)|, |Ḡ Δq/h|, |G(q_n) M⁻¹ p_n|            position, velocity, momentum level
//! cost            Newton iterations; time per step
//! κ               of the Newton matrix, as written and as factorized, at several h
//! work–precision  error at the end against the time of the run, over several h and orders
//! ```
//! Nothing is judged but the energy. What a scheme cannot do is said, and the others go on.
//!
//! | file | concept |
//! |---|---|
//! | [`record`] | the findings as data |
//! | `reference` | the trajectory that others are held against |
//! | `measure` | one scheme: a run, its cost, its matrices |
//! | [`equal_error`] | both families at the same error |
//! | [`linearization`] | the two Newton matrices of `em-nodal` |
//! | [`table`] | the findings on a terminal |
//! | [`page`] | the findings as one page |

mod charts;
pub mod equal_error;
pub mod linearization;
mod measure;
pub mod page;
pub mod record;
mod reference;
pub mod table;

pub use crate::clock::Clock;
pub use record::{Comparison, EnergyBehaviour, Measured, Record, SchemeOutcome};

use holonom_model::{Family, Model, ModelError, Scheme};
use holonom_report::scene::{INSTANTS, NUMBERS};
use holonom_sim::output::{Frames, larger};
use holonom_sim::simulation::Simulation;

/// Steps of the table unless an end is given.
const STEPS: u64 = 2000;
/// No budget makes the table shorter than that.
const LEAST_STEPS: u64 = 100;
/// Time of a recorded step over that of a step, about.
const RECORDED: f64 = 1.5;

/// What to compare; what is left open is chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Schemes; all when empty.
    pub schemes: Vec<Scheme>,
    /// Steps, s: the first is that of the table, all are those of condition numbers and
    /// work–precision. Empty: that of the model and three halvings.
    pub steps: Vec<f64>,
    /// End of all runs, s; otherwise that of the model, but at most 2000 steps.
    pub end: Option<f64>,
    /// Orders in work–precision.
    pub orders: Vec<u32>,
    /// Seconds that a single measurement may take; longer ones are left out.
    pub effort: f64,
    /// Seconds that everything may take, about: the end (where none is given) and the measurements
    /// are chosen for it, and `effort` does not count.
    pub budget: Option<f64>,
}

impl Default for Request {
    fn default() -> Self {
        let (schemes, steps) = (Vec::new(), Vec::new());
        Self { schemes, steps, end: None, orders: vec![2, 4, 6], effort: 10.0, budget: None }
    }
}

/// Why nothing was compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// A step or an end that makes no sense.
    #[error("{what} is {value}: it must be a positive number of seconds")]
    Time {
        /// Which one.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The end comes before the first step is over.
    #[error("the end, {end} s, comes before the end of the first step of {step} s")]
    TooShort {
        /// The end.
        end: f64,
        /// The step.
        step: f64,
    },
    /// There is no such order.
    #[error("there is no scheme of order {0}: take 2, 4, 6 or 8")]
    Order(u32),
    /// No scheme runs on the model.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// The request with everything chosen.
pub(crate) struct ComparisonPlan {
    schemes: Vec<Scheme>,
    step: f64,
    steps: u64,
    /// Steps that the run is made in, one for each step size.
    counts: Vec<u64>,
    orders: Vec<u32>,
    effort: f64,
    /// Seconds of repeated runs after which no more are made.
    enough: f64,
    /// Energy and momentum maps are looked at from here on, s.
    free_from: f64,
}

impl ComparisonPlan {
    fn new(model: &Model, request: &Request) -> Result<Self, CompareError> {
        let positive = |what, value: f64| match value > 0.0 && value.is_finite() {
            true => Ok(value),
            false => Err(CompareError::Time { what, value }),
        };
        let own = model.settings.step;
        let sizes = match request.steps.as_slice() {
            [] => (0..4).map(|k| own / f64::from(1 << k)).collect(),
            given => given.to_vec(),
        };
        sizes.iter().try_for_each(|h| positive("a step", *h).map(|_| ()))?;
        let step = sizes[0];
        let end = match request.end {
            Some(end) => positive("the end", end)?,
            None => model.settings.end.min(STEPS as f64 * step),
        };
        if end < 0.5 * step {
            return Err(CompareError::TooShort { end, step });
        }
        let count = |h: &f64| (end / h).round().max(1.0) as u64;
        let known = |order: &u32| vi_core::Composition::of_order(*order).is_some();
        if let Some(order) = request.orders.iter().find(|order| !known(order)) {
            return Err(CompareError::Order(*order));
        }
        let schemes = match request.schemes.as_slice() {
            [] => Scheme::ALL.to_vec(),
            given => given.to_vec(),
        };
        let (orders, effort) = (request.orders.clone(), request.effort);
        let counts = sizes.iter().map(count).collect();
        let free_from = model.loads_end().filter(|t| *t < end).unwrap_or(0.0);
        let (steps, enough) = (count(&step), 1.0);
        Ok(Self { schemes, step, steps, counts, orders, effort, enough, free_from })
    }

    /// Chooses what a budget allows, and gives the seconds that it takes, about. A fifth is for the
    /// runs of the table, three tenths for the reference, four for errors against time, one for
    /// repetitions of these.
    fn fit(&mut self, model: &Model, shorten: bool, budget: f64) -> f64 {
        let rate = |scheme: &Scheme| measure::rate(&self.with(model, *scheme, 2, 1), self.steps);
        let rates: Vec<f64> = self.schemes.iter().map(|s| rate(s).unwrap_or(0.0)).collect();
        let all: f64 = rates.iter().sum::<f64>() * RECORDED;
        if shorten && all * self.steps as f64 > 0.2 * budget {
            let steps =
                ((0.2 * budget / all) as u64).clamp(LEAST_STEPS.min(self.steps), self.steps);
            let shorter = |count: &u64| (count * steps).div_ceil(self.steps);
            (self.counts, self.steps) = (self.counts.iter().map(shorter).collect(), steps);
        }
        let table = all * self.steps as f64;
        let mut expected = Vec::new();
        for (scheme, rate) in self.schemes.iter().zip(&rates) {
            for order in &self.orders {
                let parts = rate * measure::sub_steps(*scheme, *order) as f64;
                expected.extend(self.counts.iter().map(|count| parts * *count as f64));
            }
        }
        expected.sort_by(f64::total_cmp);
        let (mut work, most) = (0.0, budget / 30.0); // the reference takes nine times that at most
        self.effort = most;
        for one in &expected {
            if work + one > 0.4 * budget {
                self.effort = most.min(*one * (1.0 - 1e-9));
                break;
            }
            if *one <= most {
                work += one;
            }
        }
        self.enough = 0.1 * budget / expected.len().max(1) as f64;
        table + reference::seconds(model, self) + work + 0.1 * budget
    }

    /// End of all runs, s.
    fn end(&self) -> f64 {
        self.steps as f64 * self.step
    }

    /// How many pieces the smallest step makes of that of the table, at least.
    fn finest(&self) -> u64 {
        let most = self.counts.iter().copied().max().unwrap_or(1);
        most.div_ceil(self.steps)
    }

    /// The model by a scheme and order, each step of the table in `parts` pieces.
    fn with(&self, model: &Model, scheme: Scheme, order: u32, parts: u64) -> Model {
        self.by_count(model, scheme, order, self.steps * parts)
    }

    /// The model by a scheme and order in `count` steps.
    fn by_count(&self, model: &Model, scheme: Scheme, order: u32, count: u64) -> Model {
        let mut model = model.clone();
        let settings = &mut model.settings;
        (settings.scheme, settings.order, settings.every) = (scheme, order, 1);
        (settings.step, settings.end) = (self.end() / count as f64, self.end());
        model
    }
}

/// Compares schemes on a valid model; `progress` receives what is done next.
///
/// # Errors
/// [`CompareError`]; what fails for one scheme is part of its record instead.
pub fn compare(
    model: &Model,
    request: &Request,
    progress: &mut dyn FnMut(&str),
) -> Result<Comparison, CompareError> {
    let mut plan = ComparisonPlan::new(model, request)?;
    if let Some(budget) = request.budget {
        let seconds = plan.fit(model, request.end.is_none(), budget);
        progress(&format!("about {:.0} s", seconds.ceil()));
    }
    let any = plan.schemes.iter().map(|s| Simulation::new(&plan.with(model, *s, 2, 1)));
    let assembly = any.fold(None, |found, next| match (found, next) {
        (Some(Ok(found)), _) => Some(Ok(found)),
        (_, Ok(run)) => Some(Ok(run.assembly().clone())),
        (None, Err(error)) => Some(Err(error)),
        (found, Err(_)) => found,
    });
    let assembly = match assembly {
        Some(Ok(assembly)) => assembly,
        Some(Err(error)) => return Err(error.into()),
        None => Simulation::new(model)?.assembly().clone(),
    };
    progress("reference");
    let (reference, nodes) = reference::reference(model, &plan);
    let mut runs = Vec::new();
    for &scheme in &plan.schemes {
        progress(scheme.name());
        runs.push(measure::run(model, &plan, scheme, nodes.as_deref()));
    }
    let conserved = measure::conserved(&runs);
    let members = Frames::initial(model)?.members;
    let width: usize = members.iter().map(|member| member.kind.columns().len()).sum();
    let most = (NUMBERS / (width * runs.len()).max(1)).min(INSTANTS);
    let motions = runs.iter().filter_map(|run| run.motion(&members, most)).collect();
    let mut firsts: [Option<Vec<Vec<f64>>>; 2] = [None, None];
    let mut records = Vec::new();
    for (run, &scheme) in runs.into_iter().zip(&plan.schemes) {
        let family = usize::from(matches!(scheme.family(), Family::EnergyMomentum(_)));
        let first = &mut firsts[family];
        let mut record = run.record(conserved, first.as_ref());
        if first.is_none() && record.measured.is_some() {
            *first = Some(run.nodes());
        }
        if record.measured.is_some() {
            progress(&format!("{}: cost", scheme.name()));
            measure::cost(model, &plan, scheme, nodes.as_ref().and_then(|n| n.last()), &mut record);
        }
        records.push(record);
    }
    let names = record::MOMENTUM_MAPS;
    Ok(Comparison {
        model: model.header.name.clone(),
        dof: assembly.counts.dof,
        coordinates: assembly.counts.coordinates,
        constraints: assembly.counts.constraints,
        step: plan.step,
        steps: plan.steps,
        end: plan.end(),
        shortened_from: (request.end.is_none()
            && plan.end() < model.settings.end - 0.5 * plan.step)
            .then_some(model.settings.end),
        free_from: plan.free_from,
        reference,
        conserved: names.iter().zip(conserved).filter(|k| k.1).map(|k| (*k.0).to_owned()).collect(),
        clock: Clock::available(),
        records,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        motions,
    })
}

/// `|a − b|_∞`.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a - b).fold(0.0, larger)
}
