//! What the elements with impulses of a mechanism are in the model.

use holonom_model::GROUND;
use std::sync::Arc;
use vi_core::Configuration;
use vi_multibody::contact::compliant_contact::CompliantContact;
use vi_multibody::contact::joint_stop::LOWER;
use vi_multibody::contact::shape_contact::ShapeContact;
use vi_multibody::contact::shape_group::ShapeGroup;

/// What an element with impulses is in the model.
#[derive(Clone, Debug)]
pub enum ContactOrigin {
    /// Shapes of a `[[contact]]`.
    Shapes(TouchingShapes),
    /// The stops of a joint.
    Stop {
        /// Its name.
        joint: String,
    },
    /// The dry friction of a joint.
    Friction {
        /// Its name.
        joint: String,
    },
}

/// Shapes of a `[[contact]]`.
#[derive(Clone, Debug)]
pub struct TouchingShapes {
    /// The section.
    pub contact: String,
    /// Which bodies these are.
    pub bodies: TouchingBodies,
    /// Their gaps.
    pub element: ShapeElement,
}

/// The bodies of shapes that touch.
#[derive(Clone, Debug)]
pub enum TouchingBodies {
    /// A shape of one with a shape of another.
    Pair {
        /// The body of the one side, or what carries the plane.
        a: String,
        /// The body of the other side.
        b: String,
        /// The number of its first feature among those of the two bodies.
        first: u32,
        /// How many features the two bodies have.
        features: u32,
        /// Which of the shapes of both they are.
        shapes: [usize; 2],
    },
    /// Of each shape of a group its body; shapes of one body stand side by side.
    Group(Vec<String>),
}

/// The bodies of a feature, and its number among those of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeatureSides<'a> {
    /// The body of the one side, or what carries the plane.
    pub a: &'a str,
    /// The body of the other side.
    pub b: &'a str,
    /// The number of the feature.
    pub number: u32,
    /// How many features the two bodies have.
    pub of: u32,
}

/// The element of shapes that touch.
#[derive(Clone, Debug)]
pub enum ShapeElement {
    /// Two of them, by impulses.
    Rigid(Arc<ShapeContact>),
    /// Two of them, by a force.
    Compliant(Arc<CompliantContact>),
    /// Many, each with each, by impulses.
    Group(Arc<ShapeGroup>),
}

impl ShapeElement {
    /// The smallest gap, m.
    #[must_use]
    pub fn gap(&self, at: Configuration<'_>) -> Option<f64> {
        match self {
            Self::Rigid(own) => own.smallest_gap(at),
            Self::Compliant(own) => own.smallest_gap(at.q),
            Self::Group(own) => own.smallest_gap(at),
        }
    }
}

impl TouchingBodies {
    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Pair { a, b, first, .. }, Self::Pair { a: c, b: d, first: other, .. }) => {
                (a, b, first) == (c, d, other)
            }
            (Self::Group(own), Self::Group(other)) => own == other,
            _ => false,
        }
    }
}

impl TouchingShapes {
    /// The bodies of a feature.
    #[must_use]
    pub fn sides(&self, feature: u32) -> FeatureSides<'_> {
        match (&self.bodies, &self.element) {
            (TouchingBodies::Pair { a, b, first, features, .. }, _) => {
                FeatureSides { a, b, number: first + feature, of: *features }
            }
            (TouchingBodies::Group(bodies), ShapeElement::Group(group)) => {
                let (i, j) = group.pair(feature);
                let [a, b] = [i, j].map(|k| &bodies[k]);
                let (mut number, mut count) = (group.feature_of_pair(feature), 0);
                for k in own_shapes(bodies, i) {
                    for l in own_shapes(bodies, j) {
                        if (k, l) < (i, j) {
                            number += group.features_of(k, l);
                        }
                        count += group.features_of(k, l);
                    }
                }
                FeatureSides { a, b, number, of: count }
            }
            _ => FeatureSides { a: "", b: "", number: feature, of: 1 }, // a group is of a group
        }
    }

    /// Whether a body is one of them.
    #[must_use]
    pub fn has(&self, body: &str) -> bool {
        match &self.bodies {
            TouchingBodies::Pair { a, b, .. } => a == body || b == body,
            TouchingBodies::Group(bodies) => bodies.iter().any(|own| own == body),
        }
    }
}

/// The shapes of the body of shape `k`, which stand side by side.
fn own_shapes(bodies: &[String], k: usize) -> std::ops::Range<usize> {
    let same = |own: &&String| **own == bodies[k];
    let before = bodies[..k].iter().rev().take_while(same).count();
    k - before..k + bodies[k..].iter().take_while(same).count()
}

impl ContactOrigin {
    /// The section that states it, or the joint.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Shapes(shapes) => &shapes.contact,
            Self::Stop { joint } | Self::Friction { joint } => joint,
        }
    }

    /// Which contact a feature is, in words: the bodies and the point, the limit of a joint.
    #[must_use]
    pub fn place(&self, feature: u32) -> String {
        match self {
            Self::Shapes(shapes) => {
                let FeatureSides { a, b, number, of } = shapes.sides(feature);
                let bodies = if a == GROUND { b.to_owned() } else { format!("{a} and {b}") };
                match of > 1 {
                    true => format!("{bodies} (point {number})"),
                    false => bodies,
                }
            }
            Self::Stop { .. } => if feature == LOWER { "lower" } else { "upper" }.to_owned(),
            Self::Friction { .. } => String::new(),
        }
    }

    /// Whether it is the same part of the model.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Shapes(own), Self::Shapes(other)) => {
                own.contact == other.contact && own.bodies.is_same(&other.bodies)
            }
            (Self::Stop { joint: own }, Self::Stop { joint })
            | (Self::Friction { joint: own }, Self::Friction { joint }) => own == joint,
            _ => false,
        }
    }

    /// The compliant contact that it is.
    #[must_use]
    pub fn compliant(&self) -> Option<&Arc<CompliantContact>> {
        match &self.shapes()?.element {
            ShapeElement::Rigid(_) | ShapeElement::Group(_) => None,
            ShapeElement::Compliant(own) => Some(own),
        }
    }

    /// The pair of shapes that it is.
    #[must_use]
    pub fn shapes(&self) -> Option<&TouchingShapes> {
        match self {
            Self::Shapes(shapes) => Some(shapes),
            Self::Stop { .. } | Self::Friction { .. } => None,
        }
    }
}
