//! What of the structure of a mechanism decides how it is solved.

use crate::mechanism::Mechanism;
use serde::{Deserialize, Serialize};
use vi_constraints::scheme::Scheme;
use vi_core::interval::Interval;
use vi_core::{MechanicalSystem, SeparableSystem};

/// How the nodal and reduced schemes solve their linear systems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// The fastest that applies.
    #[default]
    Auto,
    /// Dense matrices, for comparison.
    Dense,
    /// The sweeps over the links of a tree; where they do not apply, as `Auto`.
    Articulated,
    /// Sparse factorizations; closed loops of bodies without couplings use the sweeps.
    Sparse,
}

/// Degrees of freedom up to which a coupled tree with point masses is solved densely.
const DENSE_UP_TO: usize = 12;

impl Solver {
    /// Whether a tree that the sweeps do not solve gets sparse matrices: when asked for; but
    /// for few point masses when nothing is asked for.
    #[must_use]
    pub fn is_sparse(self, mechanism: &Mechanism) -> bool {
        let with_points = mechanism.particle_tree().dof() > 0;
        self.is_sparse_above(if with_points { DENSE_UP_TO } else { 0 }, mechanism)
    }

    /// The same, but for few degrees of freedom when nothing is asked for.
    #[must_use]
    pub fn is_sparse_above(self, most: usize, mechanism: &Mechanism) -> bool {
        let d = mechanism.tree().dof() + mechanism.particle_tree().dof();
        match self {
            Self::Dense => false,
            Self::Sparse => true,
            Self::Auto | Self::Articulated => mechanism.has_nodes() || d > most,
        }
    }
}

/// Whether a sparse tree is solved in descriptor form: with point masses, and with so many
/// ancestors that it is faster there (a chain of 70 links with springs across).
pub(super) fn takes_descriptor(mechanism: &Mechanism) -> bool {
    mechanism.particle_tree().dof() > 0 || has_ancestors(mechanism, 40)
}

/// Whether members have so many ancestors that the matrix over the unknowns is dense.
#[must_use]
pub fn has_many_ancestors(mechanism: &Mechanism) -> bool {
    has_ancestors(mechanism, 64)
}

/// Whether a member is moved by more than so many unknowns, in the root of the mean square.
fn has_ancestors(mechanism: &Mechanism, most: usize) -> bool {
    let mut unknowns: Vec<usize> = Vec::new();
    for link in mechanism.tree().links() {
        unknowns.push(link.parent.map_or(0, |p| unknowns[p]) + link.dof());
    }
    let squares: usize = unknowns.iter().map(|count| count * count).sum();
    squares > most * most * unknowns.len()
}

/// An interval initially, to look at the pattern of the Newton matrix.
pub(super) fn probe(mechanism: &Mechanism, system: &SeparableSystem) -> Interval {
    let mut s = Interval::new(system.dim());
    s.open(0.0, 1.0, &mechanism.initial_configuration());
    s
}

/// Any scheme on a mechanism.
pub(super) type BoxedScheme = Box<dyn Scheme<SeparableSystem, Mechanism>>;
