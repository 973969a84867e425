//! Members that have failed.

use crate::solver::run::MechanismIntegrator;
use std::fmt;
use vi_constraints::scheme::StepError;
use vi_constraints::{Constraints, SchemeKind};

/// A member that has failed: it stands at the node before the step that was refused.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberFailure<'a> {
    /// Its number in the ensemble.
    pub member: usize,
    /// The node where it stands.
    pub step: u64,
    /// Time of that node, s.
    pub t: f64,
    /// Why the step was refused.
    pub error: &'a StepError,
    /// What it is about, if that is known: a body, with the joint that carries it where the scheme
    /// moves along that, or a constraint.
    pub place: Option<String>,
}

impl<'a> MemberFailure<'a> {
    /// `scheme`: of the step.
    pub(super) fn new(
        member: usize,
        run: &MechanismIntegrator,
        scheme: SchemeKind,
        error: &'a StepError,
    ) -> Self {
        let (state, mechanism) = (run.state(), run.constraints());
        let along = matches!(scheme, SchemeKind::Nodal | SchemeKind::Reduced);
        let coordinate = error.unknown().filter(|unknown| !along && *unknown < mechanism.dim());
        let place = if let Some(unknown) = error.unknown().filter(|_| along) {
            mechanism.increment_name(unknown)
        } else if let Some(row) = error.constraint() {
            Some(format!("constraint of `{}`", mechanism.constraint_name(row)))
        } else {
            let coordinate = error.coordinate().or(coordinate);
            coordinate.map(|k| format!("`{}`", mechanism.coordinate_name(k)))
        };
        Self { member, step: state.step, t: state.t, error, place }
    }
}

impl fmt::Display for MemberFailure<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { member, step, t, error, place } = self;
        write!(f, "member {member}, step {step}, t = {t} s: {error}")?;
        place.as_ref().map_or(Ok(()), |place| write!(f, " ({place})"))
    }
}
