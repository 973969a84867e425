//! The axes along which forces and torques have their components.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The frame of a load's components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Frame {
    /// Fixed in space: a dead load.
    #[default]
    Space,
    /// Fixed in the body or node: a follower.
    Body,
}
