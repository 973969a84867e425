//! What an integration is set up with, and why it may be refused.

use crate::agreement::Contradiction;
use crate::initialization::StartError;
use crate::saddle_point::RankNearby;
use crate::scheme::SchemeKind;
use vi_core::composition::Composition;
use vi_core::newton::NewtonSettings;

/// What to integrate with.
///
/// ```
/// use vi_constraints::{Options, SchemeKind};
/// use vi_core::Composition;
/// let options = Options::new(SchemeKind::Nodal, 0.01).composition(Composition::KahanLi9);
/// assert_eq!(options.composition.order(), 6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<K = SchemeKind> {
    /// One of the schemes of a family.
    pub scheme: K,
    /// Macro time step `h`, s; negative to run backwards in time.
    pub step: f64,
    /// The symmetric composition of steps.
    pub composition: Composition,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl<K> Options<K> {
    /// Order 2 with step `h` (s) and Newton's method to the round-off floor.
    #[must_use]
    pub fn new(scheme: K, step: f64) -> Self {
        let (composition, newton) = (Composition::Identity, NewtonSettings::default());
        Self { scheme, step, composition, newton }
    }

    /// With a symmetric composition of order 4, 6 or 8.
    #[must_use]
    pub fn composition(mut self, composition: Composition) -> Self {
        self.composition = composition;
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
    /// The start is a configuration in which the constraints of a loop lose rank.
    #[error("the start is a singular configuration (the loop closed by `{joint}`) {reason}")]
    SingularStart {
        /// The joint at which the loop is cut.
        joint: String,
        /// Why that is in the way.
        reason: SingularStart,
    },
    /// The start is a configuration in which fewer constraints are independent than next to it: some would
    /// not be enforced.
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
    /// Constraints of a loop depend on others at the start, and no closed configuration was found next to it in
    /// which it could be seen whether they do so everywhere.
    #[error(
        "the constraints{} depend on one another at the start, and no closed configuration was found next to it \
         in which they do: whether the mechanism can move is unknown",
        loop_of(joint.as_deref())
    )]
    RankUnknown {
        /// A joint with a constraint that depends on others, where its name is known.
        joint: Option<String>,
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

fn loop_of(joint: Option<&str>) -> String {
    joint.map_or_else(String::new, |joint| format!(" of the loop closed by `{joint}`"))
}

impl From<RankNearby> for SetupError {
    fn from(RankNearby { at_start, nearby }: RankNearby) -> Self {
        nearby.map_or(Self::RankUnknown { joint: None }, |nearby| Self::RankAtStart {
            at_start,
            nearby,
        })
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
