//! What can be wrong with a described mechanism.

use crate::mechanism::initial_rates::RateError;
use vi_rigid::inertia::InertiaError;
use vi_rigid::load::LoadError;

/// Why there is no mechanism; `element` is the part concerned, such as ``joint `hinge` ``.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A number is NaN or infinite.
    #[error("{element}: a number of the {what} is {value}; it must be finite")]
    NotFinite {
        /// The part.
        element: String,
        /// Which of its quantities.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A mass is zero or negative.
    #[error("{element}: the {what} is {value}; it must be positive")]
    NotPositive {
        /// The part.
        element: String,
        /// Which of its quantities.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A number is negative.
    #[error("{element}: the {what} is {value}; it must not be negative")]
    Negative {
        /// The part.
        element: String,
        /// Which of its quantities.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A coefficient of restitution that is none.
    #[error("{element}: the restitution is {value}; it is between 0 and 1")]
    Restitution {
        /// The part.
        element: String,
        /// The number.
        value: f64,
    },
    /// Static friction below that of sliding.
    #[error("{element}: static friction is {ratio} of that of sliding; it is 1 or more")]
    StaticFriction {
        /// The part.
        element: String,
        /// The number.
        ratio: f64,
    },
    /// Limits of a joint that exclude each other.
    #[error("joint `{joint}`: its lower limit {lower} is not below its upper limit {upper}")]
    Limits {
        /// Its name.
        joint: String,
        /// The lower limit.
        lower: f64,
        /// The upper limit.
        upper: f64,
    },
    /// No body has this mass and this inertia.
    #[error("body `{body}`: {source}")]
    Inertia {
        /// Its name.
        body: String,
        /// What is wrong with it.
        source: InertiaError,
    },
    /// The attitude of a body is no rotation.
    #[error(
        "body `{body}`: the matrix of its attitude misses a rotation by {defect:.1e}; its columns \
         must be orthonormal and right-handed"
    )]
    NotARotation {
        /// Its name.
        body: String,
        /// `max |RᵀR − I|`, or 2 for a reflection.
        defect: f64,
    },
    /// A part refers to a member that does not exist.
    #[error(
        "{element} refers to {kind} {index}, but there are {count}; use the id that this builder \
         returned"
    )]
    UnknownId {
        /// The part.
        element: String,
        /// `body`, `particle` or `joint`.
        kind: &'static str,
        /// The number referred to.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A joint or a guide connects a component with itself.
    #[error("{element} connects a component with itself; give it two different components")]
    SameMember {
        /// The part.
        element: String,
    },
    /// A joint without a position.
    #[error("joint `{joint}`: its position is missing; add `.at([x, y, z])`")]
    MissingAnchor {
        /// Its name.
        joint: String,
    },
    /// A joint without the axis that its pair needs.
    #[error("joint `{joint}`: a {pair} joint needs an axis; add `.axis([x, y, z])`")]
    MissingAxis {
        /// Its name.
        joint: String,
        /// The kinematic pair.
        pair: &'static str,
    },
    /// An axis of length zero.
    #[error("{element}: the {what} has length zero; give a direction, such as [0, 0, 1]")]
    ZeroAxis {
        /// The part.
        element: String,
        /// Which axis.
        what: &'static str,
    },
    /// A second axis along the first.
    #[error("joint `{joint}`: its second axis is parallel to the first; give one across it")]
    ParallelAxes {
        /// Its name.
        joint: String,
    },
    /// A bar or a distance between coincident points.
    #[error("{element}: its ends coincide; move one, or use a spherical joint")]
    ZeroLength {
        /// The part.
        element: String,
    },
    /// A spring of a natural length, or a damper, between coincident points.
    #[error("{element}: its ends coincide, its force has no direction; move one")]
    NoDirection {
        /// The part.
        element: String,
    },
    /// A distance constraint at a point mass.
    #[error("{element}: a distance to a point mass is a bar; use `bar`")]
    DistanceOfParticle {
        /// The part.
        element: String,
    },
    /// A joint coordinate that does not exist.
    #[error("{element}: a {pair} joint has no coordinate {freedom}; {}", coordinates(*count))]
    NoCoordinate {
        /// The part.
        element: String,
        /// The kinematic pair.
        pair: &'static str,
        /// The freedom asked for.
        freedom: usize,
        /// Number of coordinates that the pair has.
        count: usize,
    },
    /// An initial rate that cannot be used.
    #[error("joint `{joint}`: {source}")]
    Rate {
        /// Its name.
        joint: String,
        /// Why not.
        source: RateError,
    },
    /// A load that cannot be applied.
    #[error("load on body `{body}`: {source}")]
    Load {
        /// The name of the body.
        body: String,
        /// What is wrong with it.
        source: LoadError,
    },
}

/// Which coordinates there are instead.
fn coordinates(count: usize) -> String {
    match count {
        0 => "it has none: use springs between points, or loads".to_owned(),
        1 => "its only coordinate is 0".to_owned(),
        _ => format!("its coordinates are 0 to {}", count - 1),
    }
}

/// Refuses numbers that are NaN or infinite.
pub(super) fn finite(
    element: impl Fn() -> String,
    what: &'static str,
    numbers: &[f64],
) -> Result<(), BuildError> {
    match numbers.iter().find(|number| !number.is_finite()) {
        Some(&value) => Err(BuildError::NotFinite { element: element(), what, value }),
        None => Ok(()),
    }
}

/// Refuses numbers that are not positive, and those that are not finite.
pub(super) fn positive(
    element: impl Fn() -> String,
    what: &'static str,
    value: f64,
) -> Result<(), BuildError> {
    finite(&element, what, &[value])?;
    if value > 0.0 {
        return Ok(());
    }
    Err(BuildError::NotPositive { element: element(), what, value })
}
