//! Laws along a coordinate or a distance by one expression.

use super::law_fault::{LastFault, LawFault};
use holonom_model::ALONG;
use holonom_model::expression::{ExpressionProgram, UndefinedPart};
use vi_multibody::joint_force::{EffortBends, EffortSlopes, JointLaw};

/// An expression of time, coordinate and rate, N or N·m.
#[derive(Debug)]
pub(crate) struct ExpressionLaw {
    owner: String,
    program: ExpressionProgram,
    dissipative: bool,
    affine: bool,
    constant: Option<EffortSlopes>, // of an affine expression without the time
    fault: LastFault,
}

impl ExpressionLaw {
    /// Of [`ALONG`], of `owner`, in words.
    pub(super) fn new(owner: String, program: ExpressionProgram, is_conservative: bool) -> Self {
        let dissipative = program.reads(2) && !is_conservative;
        let affine = program.is_affine(|input| input > 0);
        let mut slopes = [0.0; 3];
        let constant = (affine && !program.reads(0))
            .then(|| program.gradient(&[0.0; 3], &mut slopes).ok())
            .flatten()
            .map(|_| EffortSlopes { by_coordinate: slopes[1], by_rate: slopes[2] });
        Self { owner, program, dissipative, affine, constant, fault: LastFault::default() }
    }

    /// The last fault.
    pub(super) fn fault(&self) -> Option<LawFault> {
        self.fault.get()
    }

    /// What jumps in it.
    pub(super) fn jumps(&self) -> (String, Vec<&'static str>) {
        (self.owner.clone(), self.program.jumps())
    }

    #[cold]
    fn note(&self, at: [f64; 3], undefined: &UndefinedPart) -> f64 {
        self.fault.note(&self.owner, &self.program, undefined, &ALONG, &at, at[0])
    }
}

/// Not a number where the expression has no value: the step is then refused.
impl JointLaw for ExpressionLaw {
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        let at = [t, coordinate, rate];
        self.program.value(&at).unwrap_or_else(|undefined| self.note(at, &undefined))
    }

    fn slopes(&self, t: f64, coordinate: f64, rate: f64) -> EffortSlopes {
        if let Some(constant) = self.constant {
            return constant;
        }
        self.effort_and_slopes(t, coordinate, rate).1
    }

    fn effort_and_slopes(&self, t: f64, coordinate: f64, rate: f64) -> (f64, EffortSlopes) {
        let (at, mut slopes) = ([t, coordinate, rate], [0.0; 3]);
        let effort = self.program.gradient(&at, &mut slopes).unwrap_or_else(|undefined| {
            slopes = [f64::NAN; 3];
            self.note(at, &undefined)
        });
        let [_, by_coordinate, by_rate] = slopes;
        (effort, EffortSlopes { by_coordinate, by_rate })
    }

    fn bends(&self, t: f64, coordinate: f64, rate: f64) -> EffortBends {
        let (at, mut by) = ([t, coordinate, rate], [[0.0; 3]; 2]);
        if !self.affine {
            self.program.bend(&at, &[0.0, 1.0, 0.0], &mut by[0]);
            self.program.bend(&at, &[0.0, 0.0, 1.0], &mut by[1]);
        }
        EffortBends { by_coordinate: by[0][1], mixed: by[0][2], by_rate: by[1][2] }
    }

    fn is_dissipative(&self) -> bool {
        self.dissipative
    }

    fn is_affine(&self) -> bool {
        self.affine
    }

    fn is_potential(&self) -> bool {
        self.program.reads(1) && !self.program.reads(0) && !self.program.reads(2)
    }
}
