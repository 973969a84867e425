//! The three forms of the energy–momentum scheme.

use serde::{Deserialize, Serialize};

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
