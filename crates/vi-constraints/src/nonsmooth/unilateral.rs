//! What the law of a node asks of a unilateral constraint or of dry friction.

use std::sync::Arc;
use vi_core::Configuration;
use vi_core::interval::Interval;

/// The elements of a mechanism.
pub(super) type Elements = [Arc<dyn Unilateral>];

/// The law of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactLaw {
    /// A unilateral constraint without friction: one row `∇g`.
    Frictionless {
        /// Coefficient of restitution `e`.
        restitution: f64,
    },
    /// A unilateral constraint with Coulomb friction: the rows of the normal and of two tangents.
    Coulomb {
        /// Coefficient of friction `μ`.
        friction: f64,
        /// Coefficient of friction of what sticks, `μ` or more.
        static_friction: f64,
        /// Coefficient of restitution `e`.
        restitution: f64,
        /// Coefficient of tangential restitution `e_T`.
        tangential_restitution: f64,
    },
    /// Dry friction of a coordinate `θ`: one row `∇θ`, closed at all times.
    Dry {
        /// Effort `τ_c` while it slides, N or N·m.
        effort: f64,
        /// `μr` of the force across the coordinate, m, or `μ`.
        lever: f64,
        /// Friction of what sticks over that of what slides, 1 or more.
        static_ratio: f64,
    },
}

impl ContactLaw {
    /// With Coulomb friction `μ`, restitution `e` and `e_T = 0`.
    #[must_use]
    pub fn coulomb(friction: f64, restitution: f64) -> Self {
        let static_friction = friction;
        Self::Coulomb { friction, static_friction, restitution, tangential_restitution: 0.0 }
    }

    /// How many rows it has.
    #[must_use]
    pub fn rows(&self) -> usize {
        if matches!(self, Self::Coulomb { .. }) { 3 } else { 1 }
    }

    /// Whether it holds with more friction than it slides with.
    #[must_use]
    pub fn has_static_friction(&self) -> bool {
        match *self {
            Self::Frictionless { .. } => false,
            Self::Coulomb { friction, static_friction, .. } => static_friction > friction,
            Self::Dry { static_ratio, .. } => static_ratio > 1.0,
        }
    }

    /// `e`, where it has a gap.
    #[must_use]
    pub fn restitution(&self) -> Option<f64> {
        match *self {
            Self::Frictionless { restitution } | Self::Coulomb { restitution, .. } => {
                Some(restitution)
            }
            Self::Dry { .. } => None,
        }
    }
}

/// Rows `B` of contacts at a node, sparse.
#[derive(Clone, Debug, Default)]
pub struct ContactRows {
    ends: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl ContactRows {
    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.ends.clear();
        self.entries.clear();
    }

    /// Adds an entry to the row that is being written; a coordinate may come several times.
    pub fn add(&mut self, coordinate: usize, value: f64) {
        self.entries.push((coordinate, value));
    }

    /// The row is complete.
    pub fn end_row(&mut self) {
        self.ends.push(self.entries.len());
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    pub(crate) fn row(&self, i: usize) -> &[(usize, f64)] {
        let start = i.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.entries[start..self.ends[i]]
    }

    /// `B_i v`.
    #[must_use]
    pub fn dot(&self, i: usize, v: &[f64]) -> f64 {
        self.row(i).iter().map(|&(j, value)| value * v[j]).sum()
    }

    /// `out ← out + scale B_iᵀ`.
    pub fn add_to(&self, i: usize, scale: f64, out: &mut [f64]) {
        self.row(i).iter().for_each(|&(j, value)| out[j] += scale * value);
    }
}

/// A contact in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPlace {
    /// The point in which both bodies feel the impulse, m.
    pub point: [f64; 3],
    /// The normal, from A to B, and both tangents, each in space.
    pub axes: [[f64; 3]; 3],
}

/// One element: a joint stop, the dry friction of a joint coordinate, a pair of shapes. It has one
/// contact for each of its features that are near.
///
/// A gap is a smooth function of the configuration as long as its feature is named. Angles of a
/// configuration are those at its `q`.
pub trait Unilateral: Send + Sync + std::fmt::Debug {
    /// Its name, for messages.
    fn name(&self) -> &str;
    /// What its work is listed under.
    fn source(&self) -> String {
        self.name().to_owned()
    }
    /// Its law.
    fn law(&self) -> ContactLaw;
    /// The size of a gap, m or rad: rounding changes it by `ε` of that.
    fn size(&self) -> f64;
    /// Appends, in ascending order, its features that may touch in this step, each with its gap at
    /// a configuration next to an end of it; of dry friction 0.
    fn near(&self, s: &Interval, at: Configuration<'_>, out: &mut Vec<(u32, f64)>);
    /// `g`, m or rad, positive when open; of dry friction 0.
    fn gap(&self, feature: u32, at: Configuration<'_>) -> f64;
    /// Writes its rows: `∇g`, then those of the tangents; `∇θ` of dry friction.
    fn rows(&self, feature: u32, at: Configuration<'_>, out: &mut ContactRows);
    /// Where it is in space; `None` of a joint coordinate.
    fn place(&self, _feature: u32, _at: Configuration<'_>) -> Option<ContactPlace> {
        None
    }
    /// `hσ` along both tangents (m), `Δθ` of dry friction; 0 without friction.
    fn slip(&self, feature: u32, s: &Interval) -> [f64; 2];
}

/// What joints transmit across their coordinates: for dry friction with a lever.
pub trait TransverseImpulses: Send + std::fmt::Debug {
    /// Looks at a node with the constraint impulse `h Gᵀλ_n`, shape `n`.
    fn find(&mut self, at: Configuration<'_>, impulse: &[f64]);
    /// The impulse across the coordinate of an element, N·s.
    fn across(&self, element: u32) -> f64;
}
