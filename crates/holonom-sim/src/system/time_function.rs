//! Histories of loads and motors, paths of motions and springs of joints, by expressions or tables
//! or otherwise.

use super::expression_law::ExpressionLaw;
use super::law_fault::{LastFault, LawFault};
use holonom_model::expression::{ExpressionProgram, UndefinedPart};
use holonom_model::{ALONG, Curves, Formula, History, JointSpring, Model, MotionPath, TIME};
use std::sync::Arc;
use vi_rigid::time_history::{TimeFunction, TimeHistory};

/// Value, rate and acceleration by the time, s.
pub(crate) type TimePath = Box<dyn Fn(f64) -> [f64; 3] + Send + Sync>;

/// An expression of the time, which knows why it has no value.
#[derive(Debug)]
pub(crate) struct OfTime {
    owner: String,
    program: ExpressionProgram,
    fault: LastFault,
}

impl OfTime {
    #[cold]
    fn note(&self, t: f64, undefined: &UndefinedPart) -> f64 {
        self.fault.note(&self.owner, &self.program, undefined, &TIME, &[t], t)
    }

    fn value(&self, t: f64) -> f64 {
        self.program.value(&[t]).unwrap_or_else(|undefined| self.note(t, &undefined))
    }

    fn with_rates(&self, t: f64) -> [f64; 3] {
        self.program.taylor(t).unwrap_or_else(|undefined| [self.note(t, &undefined); 3])
    }

    pub(super) fn fault(&self) -> Option<LawFault> {
        self.fault.get()
    }

    /// What jumps in it.
    pub(super) fn jumps(&self) -> (String, Vec<&'static str>) {
        (self.owner.clone(), self.program.jumps())
    }
}

/// The functions of time of a model, as they are made.
pub(crate) struct TimeFunctions<'a> {
    curves: Curves<'a>,
    /// Those that are expressions.
    pub(super) expressions: Vec<Arc<OfTime>>,
    /// Springs of joints by tables.
    pub(super) springs: Vec<Arc<ExpressionLaw>>,
}

impl<'a> TimeFunctions<'a> {
    pub(crate) fn new(model: &'a Model) -> Self {
        Self { curves: Curves::new(model), expressions: Vec::new(), springs: Vec::new() }
    }

    fn keep(&mut self, owner: &str, program: ExpressionProgram) -> Arc<OfTime> {
        let (owner, fault) = (owner.to_owned(), LastFault::default());
        let own = Arc::new(OfTime { owner, program, fault });
        self.expressions.push(own.clone());
        own
    }

    /// The factor of `owner`, in words.
    pub(crate) fn history(&mut self, owner: &str, history: &History) -> TimeHistory {
        match history.program(&self.curves) {
            Some(program) => {
                let own = self.keep(owner, program);
                TimeHistory::Function(TimeFunction::new(move |t| own.value(t)))
            }
            None => history.time_history(&self.curves),
        }
    }

    /// `−k (x − rest) − f(x − rest)` of a spring of a joint that has a table.
    pub(crate) fn spring(
        &mut self,
        owner: &str,
        JointSpring { stiffness, rest, table, .. }: &JointSpring,
    ) -> Option<Arc<ExpressionLaw>> {
        let name = table.as_ref()?;
        let text = format!("({:?})*(x - ({rest:?})) - {name}(x - ({rest:?}))", -stiffness);
        let program = self.curves.compile(&Formula(text), &ALONG).ok()?; // its table is checked
        let own = Arc::new(ExpressionLaw::new(owner.to_owned(), program, true));
        self.springs.push(own.clone());
        Some(own)
    }

    /// The path of `owner`, in words.
    pub(crate) fn path(&mut self, owner: &str, path: &MotionPath) -> TimePath {
        match path.program(&self.curves) {
            Some(program) => {
                let own = self.keep(owner, program);
                Box::new(move |t| own.with_rates(t))
            }
            None => Box::new(path.function()),
        }
    }
}
