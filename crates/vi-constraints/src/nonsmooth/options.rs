//! How steps with contacts are taken.

use serde::{Deserialize, Serialize};

use super::impact_law::ImpactLaw;

/// Where nodes are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// At multiples of the step and at first touches.
    #[default]
    Events,
    /// At multiples of the step; at first touches where impulses would gain energy else.
    Stepping,
}

/// How steps with contacts are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NonsmoothOptions {
    /// Where nodes are.
    pub method: Method,
    /// Most nodes between the ends of a step.
    pub max_events: u32,
    /// Whether slip that other forces turn back takes the mean direction over the time of a node,
    /// for up to twice as many solutions of such a node. Order 2 is not reached by it
    /// (docs/theory.md, 2.20).
    pub turning_slip: bool,
    /// What an impact is.
    pub impact_law: ImpactLaw,
    /// Whether it is found which impulses are unique, for a dense elimination of each island at the
    /// first node of a step.
    pub uniqueness: bool,
}

impl Default for NonsmoothOptions {
    fn default() -> Self {
        let (method, impact_law) = (Method::Events, ImpactLaw::Newton);
        Self { method, max_events: 12, turning_slip: false, impact_law, uniqueness: false }
    }
}
