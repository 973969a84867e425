//! `[[contact]]`: bodies and nodes of beams that touch a plane, or bodies.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::GROUND;
use super::friction::{FrictionCourse, one};

/// `[[contact]]`: bodies that cannot pass through a plane, or through one another; rigid, with dry
/// friction after Coulomb and impacts after Newton. Bodies that share a joint are no pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Its name, unique in the model.
    pub name: String,
    /// What the bodies of `b` touch: a plane, or bodies.
    pub a: ContactSide,
    /// The bodies that touch it: a name or a list of names, in which `*` stands for any characters.
    /// They touch with their `collision` shapes, without these with their `shape`. A name of a beam
    /// stands for its nodes, `rope.3`, `rope.end` and `rope.*` for those of them; each touches as a
    /// sphere with the `radius` of the beam.
    pub b: BodyNames,
    /// The frame of a plane that is fixed in the ground: a body, a node of a beam, a joint or a
    /// `[[frame]]`, as it is initially; the inertial frame by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Coefficient of friction: sliding, the force across the normal is this part of the normal
    /// force, against the slip; up to that it holds.
    #[serde(default)]
    pub friction: f64,
    /// Coefficient of friction of what sticks, above `friction`: up to that it holds, and then
    /// slides with the other one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub static_friction: Option<f64>,
    /// Normal velocity after an impact over that before, between 0 and 1.
    #[serde(default)]
    pub restitution: f64,
    /// The same of the velocity across the normal, as far as friction can reverse it; 1 of a
    /// superball.
    #[serde(default)]
    pub tangential_restitution: f64,
    /// What happens where shapes overlap at the start.
    #[serde(default, skip_serializing_if = "is_refused")]
    #[schemars(extend("default" = "refuse"))]
    pub overlap: Overlap,
    /// In the place of a rigid contact: a force that grows with the overlap.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<ContactModel>,
}

impl Contact {
    /// A rigid contact without friction and restitution.
    #[must_use]
    pub fn new(name: String, a: ContactSide, b: BodyNames) -> Self {
        Self {
            name,
            a,
            b,
            relative_to: None,
            friction: 0.0,
            static_friction: None,
            restitution: 0.0,
            tangential_restitution: 0.0,
            overlap: Overlap::Refuse,
            model: None,
        }
    }
}

/// `overlap` of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Overlap {
    /// The model is refused.
    #[default]
    Refuse,
    /// Bodies are moved apart, by the least way in the norm of their masses: joints and loops stay
    /// closed, stops and other contacts are not passed, joints keep their rates. The run says by
    /// how much.
    Separate,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // as serde calls it
fn is_refused(own: &Overlap) -> bool {
    *own == Overlap::Refuse
}

/// `model` of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum ContactModel {
    /// `k δ^p max(0, 1 + c δ̇)` of the overlap `δ`, after Hunt and Crossley, for every variational
    /// scheme and order: where the compliance is known. With `friction` also the normal force times
    /// `friction · [1 + (r − 1) exp(−(v/v_s)²)] tanh(v/v_t)` against the slip `v`; nothing sticks.
    HuntCrossley {
        /// `k`, N/m^p.
        stiffness: f64,
        /// `p`, 1 or more; 1.5 of two spheres after Hertz.
        #[serde(default = "hertz")]
        exponent: f64,
        /// `c`, s/m: an impact with the small velocity `v` has the restitution `1 − (2/3) c v`.
        #[serde(default)]
        dissipation: f64,
        /// `v_t`, at which friction has three quarters of its size, m/s; with `friction`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        transition_velocity: Option<f64>,
        /// `r`: static over sliding friction, 1 or more.
        #[serde(default = "one")]
        static_ratio: f64,
        /// `v_s`: over which friction falls from static to sliding, m/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stribeck_velocity: Option<f64>,
    },
}

fn hertz() -> f64 {
    1.5
}

impl ContactModel {
    /// The course of its friction, where one is stated.
    #[must_use]
    pub fn course(&self) -> Option<FrictionCourse> {
        let Self::HuntCrossley { transition_velocity, static_ratio, stribeck_velocity, .. } = *self;
        let transition_velocity = transition_velocity?;
        Some(FrictionCourse { transition_velocity, static_ratio, stribeck_velocity })
    }
}

/// `a` of a contact: a plane, or bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "`a` is `{ plane = { position = [x, y, z], normal = [x, y, z] } }`, the name of a body, or a list of names"
)]
pub enum ContactSide {
    /// A plane.
    Plane(PlaneSide),
    /// Bodies.
    Bodies(BodyNames),
}

/// A plane as a side of a contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneSide {
    /// The plane.
    pub plane: ContactPlane,
}

/// `plane` of a contact: what lies behind it is solid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactPlane {
    /// A point of it, m; in space, on a body by components along its axes from its centre of mass.
    #[serde(default)]
    pub position: [f64; 3],
    /// Its normal, out of what is solid, by the same components.
    #[serde(default = "upwards")]
    pub normal: [f64; 3],
    /// What carries it: `ground`, or a body.
    #[serde(default = "ground")]
    pub on: String,
}

fn upwards() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn ground() -> String {
    GROUND.to_owned()
}

/// Names of bodies, in which `*` stands for any characters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "names of bodies are a text or a list of texts, such as \"ball*\"")]
pub enum BodyNames {
    /// One name.
    One(String),
    /// Several names.
    Several(Vec<String>),
}

impl BodyNames {
    /// All names as they are stated.
    #[must_use]
    pub fn list(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Several(names) => names,
        }
    }

    /// Whether one of them is that of a body.
    #[must_use]
    pub fn contain(&self, body: &str) -> bool {
        self.list().iter().any(|pattern| matches(pattern, body))
    }
}

impl Contact {
    /// Whether it acts by impulses.
    #[must_use]
    pub fn is_rigid(&self) -> bool {
        self.model.is_none()
    }

    /// The plane that it is with.
    #[must_use]
    pub fn plane(&self) -> Option<&ContactPlane> {
        match &self.a {
            ContactSide::Plane(side) => Some(&side.plane),
            ContactSide::Bodies(_) => None,
        }
    }
}

/// Whether a name is that of a pattern, in which `*` stands for any characters.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let Some((first, rest)) = pattern.split_once('*') else { return pattern == name };
    let Some(name) = name.strip_prefix(first) else { return false };
    let ends = name.char_indices().map(|(at, _)| at).chain([name.len()]);
    ends.into_iter().any(|at| matches(rest, &name[at..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_characters() {
        for (pattern, names) in [
            ("*", "ball"),
            ("ball*", "ball ball1 ball_b"),
            ("*_foot", "left_foot _foot"),
            ("a*b*c", "abc axxbyyc ab_bc"),
            ("bäll*", "bäll7"),
        ] {
            assert!(names.split(' ').all(|name| matches(pattern, name)), "{pattern}");
        }
        for (pattern, names) in [("ball", "ball1 bal"), ("*_foot", "foot left_feet"), ("a*b", "ba")]
        {
            assert!(!names.split(' ').any(|name| matches(pattern, name)), "{pattern}");
        }
    }
}
