//! `[[law]]` of a model as forces of the mechanism.

use super::bushing::Range;
use super::coordinate::coordinate;
use super::expression_law::ExpressionLaw;
use super::law_fault::{LastFault, LawFault};
use super::names::Names;
use super::rates::RatesLaw;
use super::signal::network::{Network, NumberSource};
use super::signal::{Needed, Terms, refusal};
use super::time_function::OfTime;
use holonom_model::expression::{ExpressionProgram, UndefinedPart};
use holonom_model::{ALONG, Formula, Frame, Law, MOTION, Model, ModelError, Quantities, Quantity};
use std::sync::Arc;
use vi_multibody::builder::{ActOn, MechanismBuilder, Read};
use vi_multibody::joint_force::JointLaw;
use vi_multibody::wrench_law::{INPUTS, WrenchLaw, WrenchSlopes};

/// Force and torque of time and motion, six expressions.
#[derive(Debug)]
pub(crate) struct MotionLaw {
    name: String,
    programs: [Option<ExpressionProgram>; 6],
    dissipative: bool,
    fault: LastFault,
}

impl MotionLaw {
    fn new(law: &Law, programs: [Option<ExpressionProgram>; 6]) -> Self {
        let programs = programs.map(|program| program.filter(|own| own.constant() != Some(0.0)));
        let reads = |own: &ExpressionProgram| (4..MOTION.len()).any(|input| own.reads(input));
        let reads_rates = programs.iter().flatten().any(reads);
        let (name, fault) = (law.name.clone(), LastFault::default());
        Self { name, programs, dissipative: reads_rates && !law.conservative, fault }
    }

    #[cold]
    fn note(&self, y: &[f64], program: &ExpressionProgram, undefined: &UndefinedPart) -> f64 {
        let owner = label(&self.name);
        self.fault.note(&owner, program, undefined, &MOTION, y, y[0])
    }
}

/// Not a number where an expression has no value: the step is then refused.
impl WrenchLaw for MotionLaw {
    fn evaluate(&self, y: &[f64; INPUTS]) -> [f64; 6] {
        self.programs.each_ref().map(|program| {
            let Some(program) = program else { return 0.0 };
            program.value(y).unwrap_or_else(|undefined| self.note(y, program, &undefined))
        })
    }

    fn gradient(&self, y: &[f64; INPUTS], slopes: &mut WrenchSlopes) -> [f64; 6] {
        slopes.fill(0.0);
        std::array::from_fn(|k| {
            let Some(program) = &self.programs[k] else { return 0.0 };
            let mut row = [0.0; INPUTS];
            let value = program.gradient(y, &mut row).unwrap_or_else(|undefined| {
                row = [f64::NAN; INPUTS];
                self.note(y, program, &undefined)
            });
            (0..INPUTS).for_each(|i| slopes[(k, i)] = row[i]);
            value
        })
    }

    fn bend(&self, y: &[f64; INPUTS], along: &[f64], w: &[f64], slopes: &mut [f64]) {
        slopes.fill(0.0);
        let mut row = [0.0; INPUTS];
        for (program, w) in self.programs.iter().zip(w).filter(|(_, w)| **w != 0.0) {
            let Some(program) = program else { continue };
            program.bend(y, along, &mut row);
            slopes.iter_mut().zip(&row).for_each(|(slope, own)| *slope += w * own);
        }
    }

    fn is_dissipative(&self) -> bool {
        self.dissipative
    }
}

/// A law of a model.
#[derive(Clone, Debug)]
pub(crate) enum OwnLaw {
    /// Of a coordinate or a distance.
    Along(Arc<ExpressionLaw>),
    /// Of the motion of a body or a point mass.
    Motion(Arc<MotionLaw>),
    /// Of anything that moves, of signals, of the coordinates of a bushing.
    Network(Arc<Network>),
    /// Factors and value of a sum of rates.
    Rates(Arc<RatesLaw>),
    /// The angle that a bushing allows.
    Range(Arc<Range>),
    /// A function of time.
    Time(Arc<OfTime>),
}

impl OwnLaw {
    fn fault(&self) -> Option<LawFault> {
        match self {
            Self::Along(law) => law.fault(),
            Self::Motion(law) => law.fault.get(),
            Self::Network(network) => network.fault(),
            Self::Rates(law) => law.fault(),
            Self::Range(range) => range.fault(),
            Self::Time(own) => own.fault(),
        }
    }

    /// What jumps in it, and in what it reads: of which law or signal.
    fn jumps(&self) -> Vec<(String, Vec<&'static str>)> {
        match self {
            Self::Along(law) => vec![law.jumps()],
            Self::Motion(law) => {
                let all = law.programs.iter().flatten().flat_map(ExpressionProgram::jumps);
                vec![(label(&law.name), all.collect())]
            }
            Self::Rates(law) => vec![law.jumps()],
            Self::Range(_) => Vec::new(),
            Self::Time(own) => vec![own.jumps()],
            Self::Network(network) => {
                let stated = network.terms.iter().filter(|term| !term.is_own);
                stated.map(|term| (term.owner.clone(), term.program.jumps())).collect()
            }
        }
    }
}

/// The laws of a model, in its order.
pub(crate) type Laws = Vec<OwnLaw>;

/// Adds the laws of a model.
pub(super) fn add_laws<'a>(
    builder: &mut MechanismBuilder,
    model: &'a Model,
    names: &'a Names<'a>,
    quantities: &Quantities<'_>,
    terms: &mut Terms<'a>,
) -> Result<Laws, ModelError> {
    let mut laws = Vec::new();
    for law in &model.laws {
        match &law.on {
            Some(on) => laws.push(law_on(builder, law, on, names, quantities, terms)?),
            None => laws.extend(law_along(builder, law, names, quantities, terms)?),
        }
    }
    Ok(laws)
}

/// On a body or a point mass.
fn law_on<'a>(
    builder: &mut MechanismBuilder,
    law: &'a Law,
    on: &str,
    names: &Names<'_>,
    quantities: &Quantities<'_>,
    terms: &mut Terms<'a>,
) -> Result<OwnLaw, ModelError> {
    let (mut reads, mut programs) = (Vec::new(), [const { None }; 6]);
    let list = [("force", 0, &law.force), ("torque", 3, &law.torque)];
    let stated = list.into_iter().flat_map(|(key, first, vector)| {
        let each = vector.iter().flatten().enumerate();
        each.map(move |(k, formula)| (format!("law.{}.{key}[{k}]", law.name), first + k, formula))
    });
    let stated: Vec<(String, usize, &Formula)> = stated.collect();
    for (key, place, formula) in &stated {
        let program = quantities.compile(formula, &MOTION, &mut reads);
        programs[*place] = Some(program.map_err(|error| refusal(key, error))?);
    }
    let at = names.point(on, law.point.unwrap_or_default());
    let follows = law.axes == Frame::Body;
    let base = law.relative_to.as_deref().and_then(|base| names.index(base));
    if reads.is_empty() && base.is_none() {
        let own = Arc::new(MotionLaw::new(law, programs));
        builder.wrench(at, follows, own.clone()).named(&law.name);
        return Ok(OwnLaw::Motion(own));
    }
    let own = terms.of_point(at, names.index(on), base);
    let mut efforts = [None; 6];
    for (key, place, formula) in stated {
        efforts[place] = Some(terms.formula(&label(&law.name), &key, formula, &own)?);
    }
    let on = match base.map(|base| names.frames[base]) {
        Some(base) => ActOn::Relative { at, base, follows },
        None => ActOn::Member { at, follows },
    };
    Ok(add(builder, law, on, terms, &efforts))
}

/// Along a joint coordinate or between two points.
fn law_along<'a>(
    builder: &mut MechanismBuilder,
    law: &'a Law,
    names: &Names<'_>,
    quantities: &Quantities<'_>,
    terms: &mut Terms<'a>,
) -> Result<Option<OwnLaw>, ModelError> {
    let Some((name, formula)) = law.formula() else { return Ok(None) }; // refused by the checks
    let key = format!("law.{}.{name}", law.name);
    let mut reads = Vec::new();
    let program = quantities.compile(formula, &ALONG, &mut reads);
    let mut program = program.map_err(|error| refusal(&key, error))?;
    // what it reads of its own joint by name is its `x` and `v`
    if let Some(own) = reads.iter().map(|read| own_variable(law, read)).collect::<Option<Vec<_>>>()
    {
        program = program.with_inputs(|input| match input.checked_sub(ALONG.len()) {
            Some(named) => own[named],
            None => input,
        });
        reads.clear();
    }
    let on = if let Some((joint, id)) = law.joint.as_deref().and_then(|joint| names.joint(joint)) {
        let key = format!("law.{}.freedom", law.name);
        ActOn::Coordinate(coordinate(joint, id, law.freedom, key)?)
    } else if let (Some(from), Some(to)) = (&law.from, &law.to) {
        let end = |name: &str, point: &Option<Vec<f64>>| {
            names.point(name, holonom_model::spatial(point.as_deref().unwrap_or_default()))
        };
        ActOn::Points([end(from, &law.point_from), end(to, &law.point_to)])
    } else {
        return Ok(None);
    };
    if reads.is_empty() {
        let own = Arc::new(ExpressionLaw::new(label(&law.name), program, law.conservative));
        let force: Arc<dyn JointLaw> = own.clone();
        match on {
            ActOn::Coordinate(at) => builder.joint_force(at, force).named(&law.name),
            ActOn::Points([from, to]) => builder.tension(from, to, force).named(&law.name),
            ActOn::Member { .. } | ActOn::Relative { .. } => {}
        }
        return Ok(Some(OwnLaw::Along(own)));
    }
    let (x, v) = match on {
        ActOn::Points(ends) => (Read::Distance(ends), Read::DistanceRate(ends)),
        ActOn::Coordinate(at) => (Read::Coordinate(at), Read::Rate(at)),
        ActOn::Member { .. } | ActOn::Relative { .. } => return Ok(None),
    };
    let own = [
        ("t", NumberSource::Input(0)),
        ("x", terms.input(x, "x".to_owned())),
        ("v", terms.input(v, "v".to_owned())),
    ];
    let effort = terms.formula(&label(&law.name), &key, formula, &own)?;
    Ok(Some(add(builder, law, on, terms, &[Some(effort)])))
}

/// Which of [`ALONG`] a quantity is of a law on a joint.
fn own_variable(law: &Law, read: &Quantity) -> Option<usize> {
    let is_own =
        |joint: &str, freedom| law.joint.as_deref() == Some(joint) && freedom == law.freedom;
    match read {
        Quantity::Coordinate { joint, freedom } if is_own(joint, *freedom) => Some(1),
        Quantity::Rate { joint, freedom } if is_own(joint, *freedom) => Some(2),
        _ => None,
    }
}

fn add(
    builder: &mut MechanismBuilder,
    law: &Law,
    on: ActOn,
    terms: &Terms<'_>,
    efforts: &[Option<NumberSource>],
) -> OwnLaw {
    let Needed { network, reads, states } = terms.needed(efforts, law.conservative);
    builder.law(on, reads, states, network.clone()).named(&law.name);
    OwnLaw::Network(network)
}

fn label(name: &str) -> String {
    format!("law `{name}`")
}

/// What jumps: of which law or signal, and the functions in it that do.
pub(crate) fn jumping(laws: &Laws) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    for (owner, mut jumps) in laws.iter().flat_map(OwnLaw::jumps) {
        jumps.dedup();
        let own = (owner, jumps.join(" and "));
        if !jumps.is_empty() && !found.contains(&own) {
            found.push(own);
        }
    }
    found
}

/// What is worth knowing of them.
pub(crate) fn warnings(laws: &Laws) -> Vec<String> {
    let warning = |(owner, jumps): (String, String)| {
        format!(
            "{owner} jumps ({jumps}): the method has order 1 across a jump; smooth(x, a, b) changes from 0 to 1 without one"
        )
    };
    jumping(laws).into_iter().map(warning).collect()
}

/// The fault of a law within a step from `t` to `t + h`, the last of the first that has one.
pub(crate) fn fault_within(laws: &Laws, t: f64, h: f64) -> Option<LawFault> {
    let (first, last) = (t.min(t + h), t.max(t + h));
    let within = |fault: &LawFault| (first..=last).contains(&fault.t);
    laws.iter().filter_map(OwnLaw::fault).find(within)
}
