//! What an integration is set up with, and why it may be refused.

use crate::agreement::Contradiction;
use crate::connected::DENSE_COORDINATES;
use crate::initialization::StartError;
use crate::nearby::RankNearby;
use crate::scheme::SchemeKind;
use vi_core::composition::Composition;
use vi_core::galerkin::Stages;
use vi_core::newton::NewtonSettings;

/// How the order is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrderMethod {
    /// By a symmetric composition of steps of order 2, or by one of them.
    Composition(Composition),
    /// By polynomials of degree `s` on each step, order `2s` ([`crate::galerkin`]).
    Galerkin(Stages),
}

impl Default for OrderMethod {
    fn default() -> Self {
        Self::Composition(Composition::Identity)
    }
}

impl OrderMethod {
    /// The order in `q_n` and `ᵠp_n`.
    #[must_use]
    pub fn order(self) -> u32 {
        match self {
            Self::Composition(composition) => composition.order(),
            Self::Galerkin(stages) => stages.order(),
        }
    }

    /// The sub-steps of a macro step.
    #[must_use]
    pub fn composition(self) -> Composition {
        match self {
            Self::Composition(composition) => composition,
            Self::Galerkin(_) => Composition::Identity,
        }
    }

    /// The degree of the polynomial of a step, of a Galerkin scheme.
    #[must_use]
    pub fn stages(self) -> Option<Stages> {
        match self {
            Self::Composition(_) => None,
            Self::Galerkin(stages) => Some(stages),
        }
    }
}

/// What to integrate with.
///
/// ```
/// use vi_constraints::{Options, SchemeKind};
/// use vi_core::Composition;
/// use vi_core::galerkin::Stages;
/// let options = Options::new(SchemeKind::Nodal, 0.01).composition(Composition::KahanLi9);
/// assert_eq!(options.method.order(), 6);
/// let options = Options::new(SchemeKind::Nodal, 0.05).galerkin(Stages::of_order(8).unwrap());
/// assert_eq!(options.method.order(), 8);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<K = SchemeKind> {
    /// One of the schemes of a family.
    pub scheme: K,
    /// Macro time step `h`, s; negative to run backwards in time.
    pub step: f64,
    /// How the order is reached.
    pub method: OrderMethod,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl<K> Options<K> {
    /// Order 2 with step `h` (s) and Newton's method to the round-off floor.
    #[must_use]
    pub fn new(scheme: K, step: f64) -> Self {
        let (method, newton) = (OrderMethod::default(), NewtonSettings::default());
        Self { scheme, step, method, newton }
    }

    /// With a symmetric composition of order 4, 6 or 8.
    #[must_use]
    pub fn composition(mut self, composition: Composition) -> Self {
        self.method = OrderMethod::Composition(composition);
        self
    }

    /// With a Galerkin scheme of order `2s`.
    #[must_use]
    pub fn galerkin(mut self, stages: Stages) -> Self {
        self.method = OrderMethod::Galerkin(stages);
        self
    }
}

/// Why an integrator could not be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SetupError {
    /// The step is zero or not finite.
    #[error("the time step is {0}: it must be a finite number other than zero")]
    Step(f64),
    /// No consistent start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// Dependent constraints contradict each other at the start.
    #[error(transparent)]
    Contradiction(#[from] Contradiction),
    /// A composition steps backwards, which a dissipative force must not.
    #[error(
        "a composition has backward sub-steps, in which dampers would feed energy in: use order 2 \
         with dissipative forces"
    )]
    DissipativeComposition,
    /// What the Galerkin schemes cannot integrate.
    #[error("the Galerkin schemes do not integrate {what}")]
    NoGalerkin {
        /// What of the system, or which scheme.
        what: &'static str,
        /// What to write instead.
        instead: &'static str,
    },
    /// What contacts, joint stops and dry friction are not integrated by.
    #[error(
        "contacts, joint stops and dry friction are not integrated by {what}: use the scheme \
         `nodal`, order 2"
    )]
    Contacts {
        /// What.
        what: &'static str,
    },
    /// Dry friction by a force that the joint does not determine.
    #[error(
        "the force of joint `{joint}` is not unique (a redundant loop): its dry friction needs a \
         force or a torque in the place of a coefficient"
    )]
    ReactionNotUnique {
        /// The joint.
        joint: String,
    },
    /// A gap is negative at the start.
    #[error("`{element}` is passed by {depth:.3e} (m or rad) at the start")]
    Overlap {
        /// The contact or the joint stop.
        element: String,
        /// By how much.
        depth: f64,
    },
    /// Constraints on velocities by another scheme than the nodal one.
    #[error(
        "constraints on velocities (rolling, blades) are integrated by the scheme `nodal` alone"
    )]
    VelocityConstraints,
    /// The start is a configuration in which the constraints of a loop lose rank.
    #[error("the start is a singular configuration (the loop closed by `{joint}`) {reason}")]
    SingularStart {
        /// The joint at which the loop is cut.
        joint: String,
        /// Why that is in the way.
        reason: SingularStart,
    },
    /// The start is a configuration in which fewer constraints are independent than next to it:
    /// some would not be enforced.
    #[error(
        "the start is a singular configuration: the constraints have rank {at_start} there and rank \
         {nearby} next to it"
    )]
    RankAtStart {
        /// Rank at the start.
        at_start: usize,
        /// Rank in configurations nearby.
        nearby: usize,
    },
    /// Constraints of a loop depend on others at the start, and no closed configuration was found
    /// next to it in which it could be seen whether they do so everywhere.
    #[error(
        "the constraints{} depend on one another at the start, and no closed configuration was found next to it \
         in which they do: whether the mechanism can move is unknown",
        loop_of(joint.as_deref())
    )]
    RankUnknown {
        /// A joint with a constraint that depends on others, where its name is known.
        joint: Option<String>,
    },
    /// Dense matrices would be too large.
    #[error(
        "{what} would need dense matrices over {coordinates} coordinates; the limit is {limit}"
    )]
    TooLarge {
        /// What needs them.
        what: &'static str,
        /// Over how many coordinates.
        coordinates: usize,
        /// The largest number.
        limit: usize,
        /// What to do.
        instead: &'static str,
    },
    /// Shapes do not match.
    #[error("{what} has {found} entries where {expected} are needed")]
    Shape {
        /// Which input.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The right length.
        expected: usize,
    },
}

impl SetupError {
    /// The refusal of what no Galerkin scheme integrates.
    #[must_use]
    pub fn no_galerkin(what: &'static str) -> Self {
        Self::NoGalerkin { what, instead: "write method = \"composition\"" }
    }
}

fn loop_of(joint: Option<&str>) -> String {
    joint.map_or_else(String::new, |joint| format!(" of the loop closed by `{joint}`"))
}

impl From<RankNearby> for SetupError {
    fn from(found: RankNearby) -> Self {
        match found {
            RankNearby::Larger { at_start, nearby } => Self::RankAtStart { at_start, nearby },
            RankNearby::Unknown => Self::RankUnknown { joint: None },
            RankNearby::TooLarge { coordinates } => Self::TooLarge {
                what: "the rank of constraints that may depend on one another",
                coordinates,
                limit: DENSE_COORDINATES,
                instead: "remove the redundant bars, or replace some of them by springs",
            },
        }
    }
}

/// Refuses dense matrices over more coordinates than [`DENSE_COORDINATES`].
///
/// # Errors
/// [`SetupError::TooLarge`], of `what`, with what to do `instead`.
pub fn check_dense(
    coordinates: usize,
    what: &'static str,
    instead: &'static str,
) -> Result<(), SetupError> {
    match coordinates > DENSE_COORDINATES {
        true => Err(SetupError::TooLarge { what, coordinates, limit: DENSE_COORDINATES, instead }),
        false => Ok(()),
    }
}

/// What keeps a motion from leaving a singular configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SingularStart {
    /// Nothing says which branch it takes.
    #[error("and at rest: give it a velocity or move it off by a little")]
    AtRest,
    /// The velocity mixes branches.
    #[error(
        "with a velocity that no branch of the motion has: correct it or move it off by a little"
    )]
    OffBranch,
    /// The scheme needs constraints of full rank at the start.
    #[error("which the scheme cannot leave: use the scheme `nodal` or `reduced`")]
    Scheme,
}
