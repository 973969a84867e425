//! `[[law]]` of a model as forces of the mechanism.

use super::drive::coordinate;
use super::names::Names;
use holonom_model::expression::{Program, Undefined};
use holonom_model::{ALONG, Curves, Formula, Frame, Law, MOTION, Model, ModelError, Problem};
use std::sync::{Arc, Mutex, PoisonError};
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::joint_force::{EffortSlopes, JointLaw};
use vi_multibody::wrench_law::{INPUTS, WrenchLaw, WrenchSlopes};

/// An expression of time, coordinate and rate, N or N·m.
#[derive(Debug)]
pub(crate) struct ExpressionLaw {
    name: String,
    program: Program,
    dissipative: bool,
    affine: bool,
    fault: Mutex<Option<LawFault>>, // the last one; no part of the state
}

/// An expression without a value: the name of the law, why, and where.
#[derive(Clone, Debug)]
pub(crate) struct LawFault {
    pub(crate) t: f64,
    pub(crate) message: String,
}

impl ExpressionLaw {
    fn new(law: &Law, formula: &Formula, curves: &Curves<'_>) -> Result<Self, ModelError> {
        let program = compiled(law, formula, &ALONG, curves)?;
        let (name, fault) = (law.name.clone(), Mutex::default());
        let dissipative = program.reads(2) && !law.conservative;
        let affine = program.is_affine(|input| input > 0);
        Ok(Self { name, program, dissipative, affine, fault })
    }

    #[cold]
    fn note(&self, at: [f64; 3], undefined: &Undefined) {
        note(&self.fault, &self.name, (&self.program, undefined), &ALONG, &at);
    }
}

/// Not a number where the expression has no value: the step is then refused.
impl JointLaw for ExpressionLaw {
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        let at = [t, coordinate, rate];
        self.program.value(&at).unwrap_or_else(|undefined| {
            self.note(at, &undefined);
            f64::NAN
        })
    }

    fn slopes(&self, t: f64, coordinate: f64, rate: f64) -> EffortSlopes {
        let (at, mut slopes) = ([t, coordinate, rate], [0.0; 3]);
        if let Err(undefined) = self.program.gradient(&at, &mut slopes) {
            self.note(at, &undefined);
            slopes = [f64::NAN; 3];
        }
        let [_, by_coordinate, by_rate] = slopes;
        EffortSlopes { by_coordinate, by_rate }
    }

    fn is_dissipative(&self) -> bool {
        self.dissipative
    }

    fn is_affine(&self) -> bool {
        self.affine
    }
}

/// Force and torque of time and motion, six expressions.
#[derive(Debug)]
pub(crate) struct MotionLaw {
    name: String,
    programs: [Option<Program>; 6],
    dissipative: bool,
    fault: Mutex<Option<LawFault>>, // the last one; no part of the state
}

impl MotionLaw {
    fn new(law: &Law, curves: &Curves<'_>) -> Result<Self, ModelError> {
        let mut programs = [const { None }; 6];
        for (first, vector) in [(0, &law.force), (3, &law.torque)] {
            for (k, formula) in vector.iter().flatten().enumerate() {
                let program = compiled(law, formula, &MOTION, curves)?;
                programs[first + k] = Some(program).filter(|own| own.constant() != Some(0.0));
            }
        }
        let reads = |own: &Program| (4..MOTION.len()).any(|input| own.reads(input));
        let reads_rates = programs.iter().flatten().any(reads);
        let (name, fault) = (law.name.clone(), Mutex::default());
        Ok(Self { name, programs, dissipative: reads_rates && !law.conservative, fault })
    }

    #[cold]
    fn note(&self, y: &[f64], program: &Program, undefined: &Undefined) {
        note(&self.fault, &self.name, (program, undefined), &MOTION, y);
    }
}

/// Not a number where an expression has no value: the step is then refused.
impl WrenchLaw for MotionLaw {
    fn evaluate(&self, y: &[f64; INPUTS]) -> [f64; 6] {
        self.programs.each_ref().map(|program| {
            let Some(program) = program else { return 0.0 };
            program.value(y).unwrap_or_else(|undefined| {
                self.note(y, program, &undefined);
                f64::NAN
            })
        })
    }

    fn gradient(&self, y: &[f64; INPUTS], slopes: &mut WrenchSlopes) -> [f64; 6] {
        slopes.fill(0.0);
        std::array::from_fn(|k| {
            let Some(program) = &self.programs[k] else { return 0.0 };
            let mut row = [0.0; INPUTS];
            let value = program.gradient(y, &mut row).unwrap_or_else(|undefined| {
                self.note(y, program, &undefined);
                row = [f64::NAN; INPUTS];
                f64::NAN
            });
            (0..INPUTS).for_each(|i| slopes[(k, i)] = row[i]);
            value
        })
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
}

impl OwnLaw {
    fn fault(&self) -> Option<LawFault> {
        let fault = match self {
            Self::Along(law) => &law.fault,
            Self::Motion(law) => &law.fault,
        };
        fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Its name, and what jumps in it.
    fn jumps(&self) -> (&str, Vec<&'static str>) {
        match self {
            Self::Along(law) => (&law.name, law.program.jumps()),
            Self::Motion(law) => {
                (&law.name, law.programs.iter().flatten().flat_map(Program::jumps).collect())
            }
        }
    }
}

/// The laws of a model, in its order.
pub(crate) type Laws = Vec<OwnLaw>;

fn compiled(
    law: &Law,
    formula: &Formula,
    own: &[&str],
    curves: &Curves<'_>,
) -> Result<Program, ModelError> {
    curves.compile(formula, own).map_err(|error| {
        let problem = Problem::new(format!("law.{}", law.name), error.message);
        ModelError::Assembly(vec![problem.help(error.help)])
    })
}

/// Keeps why an expression has no value where its inputs have one.
fn note(
    fault: &Mutex<Option<LawFault>>,
    name: &str,
    (program, undefined): (&Program, &Undefined),
    names: &[&str],
    at: &[f64],
) {
    let mut message = format!("law `{name}`: {undefined}");
    for (k, (name, value)) in names.iter().zip(at).enumerate().skip(1) {
        if program.reads(k) {
            message += &format!(", {name} = {value:.6}");
        }
    }
    if at.iter().all(|input| input.is_finite()) {
        let found = Some(LawFault { t: at[0], message });
        *fault.lock().unwrap_or_else(PoisonError::into_inner) = found;
    }
}

/// Adds the laws of a model.
pub(super) fn add_laws(
    builder: &mut MechanismBuilder,
    model: &Model,
    names: &Names<'_>,
) -> Result<Laws, ModelError> {
    let curves = Curves::new(model);
    let mut laws = Vec::new();
    for law in &model.laws {
        if let Some(on) = &law.on {
            let own = Arc::new(MotionLaw::new(law, &curves)?);
            laws.push(OwnLaw::Motion(own.clone()));
            let at = names.point(on, law.point.unwrap_or_default());
            builder.wrench(at, law.axes == Frame::Body, own).named(&law.name);
            continue;
        }
        let Some((_, formula)) = law.formula() else { continue }; // refused by the checks
        let own = Arc::new(ExpressionLaw::new(law, formula, &curves)?);
        laws.push(OwnLaw::Along(own.clone()));
        let own: Arc<dyn JointLaw> = own;
        if let Some((joint, id)) = law.joint.as_deref().and_then(|joint| names.joint(joint)) {
            let key = format!("law.{}.freedom", law.name);
            builder.joint_force(coordinate(joint, id, law.freedom, key)?, own).named(&law.name);
        } else if let (Some(from), Some(to)) = (&law.from, &law.to) {
            let end = |name: &str, point: &Option<Vec<f64>>| {
                names.point(name, holonom_model::spatial(point.as_deref().unwrap_or_default()))
            };
            let (from, to) = (end(from, &law.point_from), end(to, &law.point_to));
            builder.tension(from, to, own).named(&law.name);
        }
    }
    Ok(laws)
}

/// What is worth knowing of them.
pub(crate) fn warnings(laws: &Laws) -> impl Iterator<Item = String> {
    laws.iter().filter_map(|law| {
        let (name, mut jumps) = law.jumps();
        jumps.dedup();
        let list = jumps.join(" and ");
        (!jumps.is_empty()).then(|| {
            format!(
                "law `{name}` jumps ({list}): the method has order 1 across a jump; smooth(x, a, b) changes from 0 to 1 without one"
            )
        })
    })
}

/// The fault of a law within a step from `t` to `t + h`, the last of the first that has one.
pub(crate) fn fault_within(laws: &Laws, t: f64, h: f64) -> Option<LawFault> {
    let (first, last) = (t.min(t + h), t.max(t + h));
    let within = |fault: &LawFault| (first..=last).contains(&fault.t);
    laws.iter().filter_map(OwnLaw::fault).find(within)
}
