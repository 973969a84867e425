//! The three equivalent forms of the energy–momentum scheme behind one interface.
//!
//! All of them advance the same state `(q_n, v_n) → (q_{n+1}, v_{n+1})` with
//! `v_{n+1} = (2/h) Δq − v_n`, and differ only in how `q_{n+1}` is found. Their trajectories agree to
//! solver tolerance.

use crate::em_system::EmSystem;
use serde::{Deserialize, Serialize};
use vi_constraints::scheme::{Condition, StepError, SubStep};
use vi_core::interval::Interval;
use vi_core::newton::NewtonReport;

/// Which form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum EmForm {
    /// Unknowns `(Δq, λ) ∈ R^{n+m}`.
    #[default]
    #[serde(rename = "em-constrained")]
    Constrained,
    /// Unknown `Δq ∈ R^n`, discrete null space.
    #[serde(rename = "em-dalembert")]
    Dalembert,
    /// Unknown `u ∈ R^d`, discrete null space and nodal reparametrization.
    #[serde(rename = "em-nodal")]
    Nodal,
}

impl EmForm {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Constrained, Self::Dalembert, Self::Nodal];

    /// The name in model files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Constrained => "em-constrained",
            Self::Dalembert => "em-dalembert",
            Self::Nodal => "em-nodal",
        }
    }
}

/// Parts of `ε` that Newton's method may leave of `Δq` where `EmState::advance` is told what rounding
/// has taken off: a remainder of `ε/64` on the same side in each step still showed after 5·10⁴ steps.
pub(crate) const BEYOND_ROUNDING: f64 = 1.0 / 65536.0;

/// Time, configuration and velocity at a node.
///
/// `v_0 = v(0)`; later `v_n` is not in `null G(q_n)`, but `O(h²)` off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EmState {
    /// Number of steps taken.
    pub step: u64,
    /// `t_n`, s.
    pub t: f64,
    /// `q_n`, shape `n`.
    pub q: Vec<f64>,
    /// `v_n`, shape `n`.
    pub v: Vec<f64>,
    /// What rounding has taken off `v_n`, shape `n`.
    pub(crate) carry: Vec<f64>,
}

impl EmState {
    /// The start of a motion at time `t`.
    #[must_use]
    pub fn new(t: f64, q: Vec<f64>, v: Vec<f64>) -> Self {
        let carry = vec![0.0; v.len()];
        Self { step: 0, t, q, v, carry }
    }

    /// Becomes a copy of another node of the same shape; allocates nothing.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        (self.step, self.t) = (other.step, other.t);
        self.q.copy_from_slice(&other.q);
        self.v.copy_from_slice(&other.v);
        self.carry.copy_from_slice(&other.carry);
    }

    /// Replaces the node by the end of a step: `v_{n+1} = (2/h) Δq − v_n = v_n + 2 (Δq − h v_n)/h`, where
    /// rounding has taken `lost` off `Δq` where that is the unknown.
    ///
    /// No `Δq` in its format balances the momentum exactly. In a steady rotation what is left over leans
    /// one way at some steps `h`, by up to 0.05 `ε` a step: `lost` takes that out of the velocity.
    pub(crate) fn advance(&mut self, s: &Interval, lost: Option<&[f64]>) {
        self.q.copy_from_slice(&s.q1);
        for i in 0..self.v.len() {
            let (v, carry) = (self.v[i], self.carry[i]);
            let change = 2.0 * (lag(s.dq[i], s.h, (v, carry)) + lost.map_or(0.0, |lost| lost[i]))
                / s.h
                + carry;
            self.v[i] = v + change;
            self.carry[i] = (v - self.v[i]) + change;
        }
        self.t = s.t_end();
        self.step += 1;
    }
}

/// `Δq − h v_n` with what rounding has taken off `v_n`.
pub(crate) fn lag(dq: f64, h: f64, (v, carry): (f64, f64)) -> f64 {
    (-h).mul_add(v, dq) - h * carry
}

/// One of the forms, with its workspace.
pub trait EmScheme<C> {
    /// Which one.
    fn form(&self) -> EmForm;
    /// Takes a step.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was.
    fn advance(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        step: SubStep,
        state: &mut EmState,
    ) -> Result<NewtonReport, StepError>;
    /// The interval of the last step.
    fn interval(&self) -> &Interval;
    /// `μ = h²λ` of the last step over all constraints, zero where redundant; shape `m`.
    fn scaled_multiplier(&self) -> &[f64];
    /// Condition numbers of the Newton matrix of the last step (dense: for studies, not for runs).
    fn condition(&self) -> Option<Condition>;
    /// Forgets start values (after the state was changed from outside).
    fn reset(&mut self);
}
