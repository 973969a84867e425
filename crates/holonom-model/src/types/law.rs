//! `[[law]]`: forces and torques by expressions of time and state.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize};

use super::frame::Frame;
use crate::expression::renamed;

/// An expression that is evaluated along the run: a text without `=`, or a number.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Formula(pub String);

impl<'de> Deserialize<'de> for Formula {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "a law is a text, such as \"-200*x\", or a number")]
        enum StatedLaw {
            Number(f64),
            Text(String),
        }
        Ok(Self(match StatedLaw::deserialize(deserializer)? {
            StatedLaw::Number(number) => return Ok(Self::of_number(number)),
            StatedLaw::Text(text) => text,
        }))
    }
}

impl Formula {
    /// A number.
    pub(crate) fn of_number(number: f64) -> Self {
        Self(format!("{number:?}"))
    }

    /// With other words for what it names.
    #[must_use]
    pub fn renamed(&self, name: &mut dyn FnMut(&str) -> String) -> Self {
        Self(renamed(&self.0, name))
    }

    /// The same function of the time where a second is `unit` of another and one is `size`.
    #[must_use]
    pub fn with_time(&self, unit: f64, size: f64) -> Self {
        let text = renamed(&self.0, &mut |name| match name {
            "t" => format!("(t/{unit:?})"),
            other => other.to_owned(),
        });
        Self(format!("{size:?}*({text})"))
    }
}

impl JsonSchema for Formula {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Formula".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["string", "number"] })
    }
}

/// `[[law]]`: a force or torque by an expression of time and state, along a joint coordinate
/// (`joint`, `effort`), between two points (`from`, `to`, `tension`), or on a body or a particle
/// (`on`, `force`, `torque`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// Its name, unique in the model; its work is listed under it.
    pub name: String,
    /// The joint along whose coordinate it acts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Which degree of freedom of the joint, counted from 0: displacements first, then angles.
    #[serde(default)]
    pub freedom: usize,
    /// Force, N, or torque, N·m, on the child of the joint, equal and opposite on its parent: of
    /// `t`, the coordinate `x` and its rate `v`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effort: Option<Formula>,
    /// A body, a particle, or `ground`: the first of two points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// A body, a particle, or `ground`: the second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// Where it is held at `from`, m: body components from the centre of mass, or a point of the
    /// ground; the centre or the origin by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_from: Option<Vec<f64>>,
    /// Where it is held at `to`, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_to: Option<Vec<f64>>,
    /// Between points: the frame of points of the ground, a body, a node of a beam, a joint or a
    /// `[[frame]]`; the inertial frame by default. On a body or a particle (`on`): a body or a node
    /// of a beam, along whose axes, from whose centre and in relation to whose rotation the law
    /// reads and acts; it takes the opposite force, and the couple of both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Force with which the points pull each other, N: of `t`, the distance `x` and its rate `v`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tension: Option<Formula>,
    /// A body or a particle: force and torque act on it alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<String>,
    /// Where the force acts on a body: components along its axes from its centre of mass, m; the
    /// centre by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// Force, N, three expressions: of `t`, the place `x`, `y`, `z` of the point (m) and its
    /// velocity `vx`, `vy`, `vz` (m/s), the angular velocity `wx`, `wy`, `wz` of the body (rad/s),
    /// in space or in the frame of `relative_to`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<[Formula; 3]>,
    /// Torque, N·m, on a body, three expressions of the same names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<[Formula; 3]>,
    /// The axes along which force and torque have these components: fixed in space, or in the body
    /// of `relative_to` where there is one; or those of the body on which they act.
    #[serde(default)]
    pub axes: Frame,
    /// A law that reads a rate is taken for one that dissipates, whichever way time runs, and
    /// refused by composition methods; this one does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub conservative: bool,
}

impl Law {
    /// The key of its expression and the expression.
    #[must_use]
    pub fn formula(&self) -> Option<(&'static str, &Formula)> {
        let effort = self.effort.as_ref().map(|formula| ("effort", formula));
        effort.or(self.tension.as_ref().map(|formula| ("tension", formula)))
    }

    /// All its expressions.
    pub fn formulas(&self) -> impl Iterator<Item = &Formula> {
        let vectors = self.force.iter().chain(&self.torque).flatten();
        self.effort.iter().chain(&self.tension).chain(vectors)
    }
}
