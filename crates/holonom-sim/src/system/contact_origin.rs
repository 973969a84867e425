//! What the elements with impulses of a mechanism are in the model.

use holonom_model::GROUND;
use std::sync::Arc;
use vi_constraints::nonsmooth::Unilateral;
use vi_core::Configuration;
use vi_multibody::contact::compliant_contact::CompliantContact;
use vi_multibody::contact::joint_stop::LOWER;
use vi_multibody::contact::shape_contact::ShapeContact;

/// What an element with impulses is in the model.
#[derive(Clone, Debug)]
pub enum ContactOrigin {
    /// A pair of shapes of a `[[contact]]`.
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

/// A pair of shapes of a `[[contact]]`.
#[derive(Clone, Debug)]
pub struct TouchingShapes {
    /// The section.
    pub contact: String,
    /// The body of the one side, or what carries the plane.
    pub a: String,
    /// The body of the other side.
    pub b: String,
    /// The number of its first feature among those of the two bodies.
    pub first: u32,
    /// How many features the two bodies have.
    pub features: u32,
    /// Their gaps.
    pub element: ShapeElement,
}

/// The element of a pair of shapes.
#[derive(Clone, Debug)]
pub enum ShapeElement {
    /// By impulses.
    Rigid(Arc<ShapeContact>),
    /// By a force.
    Compliant(Arc<CompliantContact>),
}

impl ShapeElement {
    /// How many features it has.
    #[must_use]
    pub fn features(&self) -> u32 {
        match self {
            Self::Rigid(own) => own.pair.features(),
            Self::Compliant(own) => own.pair().features(),
        }
    }

    /// The smallest gap of its features, m.
    #[must_use]
    pub fn gap(&self, at: Configuration<'_>) -> Option<f64> {
        let (pair, gap): (_, Box<dyn Fn(u32) -> f64>) = match self {
            Self::Rigid(own) => (&own.pair, Box::new(|feature| own.gap(feature, at))),
            Self::Compliant(own) => (own.pair(), Box::new(|feature| own.gap(feature, at.q))),
        };
        (0..pair.features()).map(gap).min_by(f64::total_cmp)
    }
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
                let TouchingShapes { a, b, first, features, .. } = shapes;
                let bodies = if a == GROUND { b.clone() } else { format!("{a} and {b}") };
                match *features > 1 {
                    true => format!("{bodies} (point {})", first + feature),
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
                let key = |of: &TouchingShapes| (of.contact.clone(), of.a.clone(), of.b.clone());
                own.first == other.first && key(own) == key(other)
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
            ShapeElement::Rigid(_) => None,
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
