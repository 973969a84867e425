//! `limits`, `bumper` and `friction` of a `[[joint]]`: stops and dry friction of a joint
//! coordinate.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::friction::FrictionModel;

/// `limits` of a joint: `[lower, upper]`, or a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "limits are two numbers, or a table with `lower` or `upper`")]
pub enum Limits {
    /// Lower and upper limit of coordinate 0.
    Both([f64; 2]),
    /// Limits of a coordinate, on one side or both, with restitution.
    Table(JointLimits),
}

/// `limits` of a joint as a table: rigid stops of a joint coordinate, which is 0 in the initial
/// configuration; angles count revolutions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointLimits {
    /// Which degree of freedom of the joint, counted from 0.
    #[serde(default)]
    pub freedom: usize,
    /// Lower limit, m or rad; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// Upper limit, m or rad; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<f64>,
    /// Rate after an impact over that before, between 0 and 1.
    #[serde(default)]
    pub restitution: f64,
}

impl Limits {
    /// As a table.
    #[must_use]
    pub fn table(&self) -> JointLimits {
        match *self {
            Self::Both([lower, upper]) => {
                JointLimits { lower: Some(lower), upper: Some(upper), ..JointLimits::default() }
            }
            Self::Table(limits) => limits,
        }
    }
}

/// `bumper` of a joint: its limits are elastic, `k δ + c δ̇` of the depth `δ` beyond a limit, and
/// never pull.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointBumper {
    /// Stiffness `k`, N/m or N·m/rad.
    pub stiffness: f64,
    /// Damping `c`, N·s/m or N·m·s/rad.
    #[serde(default)]
    pub damping: f64,
}

/// `friction` of a joint: dry friction of a joint coordinate. Up to the stated effort it holds the
/// joint at rest; sliding, it acts against the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointFriction {
    /// Which degree of freedom of the joint, counted from 0.
    #[serde(default)]
    pub freedom: usize,
    /// Of an angle: the torque, N·m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<f64>,
    /// Of a displacement: the force, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<f64>,
    /// In the place of an effort: the coefficient of friction by which the force that the joint
    /// transmits across its axis holds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coefficient: Option<f64>,
    /// Of an angle, with `coefficient`: the radius of the pin, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Static over sliding friction, 1 or more: at rest it holds up to that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub static_ratio: Option<f64>,
    /// In the place of dry friction: a smooth function of the rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<FrictionModel>,
}

impl JointFriction {
    /// What it is while the joint slides, N or N·m.
    #[must_use]
    pub fn effort(&self) -> f64 {
        self.torque.or(self.force).unwrap_or(0.0)
    }
}

/// `impact` of `[simulation]`: what happens where several bodies, or points of a body, are hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Impact {
    /// The normal velocity after over that before is the restitution, of all points at once.
    #[default]
    Newton,
    /// All points at once take the impulses of an impact without restitution, times one more than
    /// the restitution, the smallest of what is hit: what grips is thrown back across the normal.
    Moreau,
    /// One point after the other, that of the fastest approach first, each after Newton.
    Sequential,
}

/// `contact` of `[simulation]`: how impacts at joint stops are placed in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ContactMethod {
    /// A node is put at every first touch: order 2 through impacts that follow one another.
    #[default]
    Events,
    /// Impacts take place at the nodes of the steps: order 1 at impacts, any number of them.
    Stepping,
}
