//! `[[law]]` of a model as forces of the mechanism.

use super::drive::coordinate;
use super::names::Names;
use holonom_model::expression::{Program, Undefined};
use holonom_model::{ALONG, Curves, Formula, Law, Model, ModelError, Problem};
use std::sync::{Arc, Mutex, PoisonError};
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::joint_force::{EffortSlopes, JointLaw};

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
        let program = curves.compile(formula, &ALONG).map_err(|error| {
            let problem = Problem::new(format!("law.{}", law.name), error.message);
            ModelError::Assembly(vec![problem.help(error.help)])
        })?;
        let (name, fault) = (law.name.clone(), Mutex::default());
        let dissipative = program.reads(2) && !law.conservative;
        let affine = program.is_affine(|input| input > 0);
        Ok(Self { name, program, dissipative, affine, fault })
    }

    /// The last fault.
    pub(crate) fn fault(&self) -> Option<LawFault> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    #[cold]
    fn note(&self, at: [f64; 3], undefined: &Undefined) {
        let (mut message, [t, x, v]) = (format!("law `{}`: {undefined}", self.name), at);
        for (k, (name, value)) in [("x", x), ("v", v)].into_iter().enumerate() {
            if self.program.reads(1 + k) {
                message += &format!(", {name} = {value:.6}");
            }
        }
        if t.is_finite() && x.is_finite() && v.is_finite() {
            let fault = Some(LawFault { t, message });
            *self.fault.lock().unwrap_or_else(PoisonError::into_inner) = fault;
        }
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

/// The laws of a model, in its order.
pub(crate) type Laws = Vec<Arc<ExpressionLaw>>;

/// Adds the laws of a model.
pub(super) fn add_laws(
    builder: &mut MechanismBuilder,
    model: &Model,
    names: &Names<'_>,
) -> Result<Laws, ModelError> {
    let curves = Curves::new(model);
    let mut laws = Vec::new();
    for law in &model.laws {
        let Some((_, formula)) = law.formula() else { continue }; // refused by the checks
        let own = Arc::new(ExpressionLaw::new(law, formula, &curves)?);
        laws.push(own.clone());
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
        let jumps = law.program.jumps();
        let (name, list) = (&law.name, jumps.join(" and "));
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
    laws.iter().filter_map(|law| law.fault()).find(within)
}
