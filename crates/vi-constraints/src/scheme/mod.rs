//! The four equivalent schemes behind one interface.
//!
//! All of them advance the same state: `(q_n, p̄_n) → (q_{n+1}, p̄_{n+1})` with
//! `p̄_{n+1} = D_2 L_d(q_n, q_{n+1}) + f_d^+`, and differ only in how `q_{n+1}` is found. Their
//! trajectories agree to solver tolerance (LMO08 Cor. 3.5).

mod basis;
mod condition;
pub mod constrained;
pub mod costate_sweep;
pub mod dalembert;
mod equations;
mod error;
pub mod galerkin;
pub mod linearization;
pub mod nodal;
pub mod nodal_operators;
pub mod reduced;
mod solver;
mod sub_step;
pub mod tangent_map;
pub mod unknowns;

pub use basis::{AtNode, Basis};
pub use condition::ConditionNumbers;
pub use equations::{Guess, Scheme};
pub use error::StepError;
pub use solver::StepSolver;
pub use sub_step::SubStep;

use serde::{Deserialize, Serialize};

/// Which scheme.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SchemeKind {
    /// Constrained: unknowns `(q_{n+1}, λ_n) ∈ R^{n+m}`, LMO08 (22).
    Constrained,
    /// d'Alembert: unknown `q_{n+1} ∈ R^n`, LMO08 (25).
    Dalembert,
    /// d'Alembert with nodal reparametrization: unknown `u ∈ R^d`, LMO08 (28). The production
    /// scheme.
    #[default]
    Nodal,
    /// Reduced variational: as nodal, with `P = ∂F_d/∂u` of the last step, LMO08 (30).
    Reduced,
}

impl SchemeKind {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Constrained, Self::Dalembert, Self::Nodal, Self::Reduced];

    /// The name in model files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Constrained => "constrained",
            Self::Dalembert => "dalembert",
            Self::Nodal => "nodal",
            Self::Reduced => "reduced",
        }
    }
}
