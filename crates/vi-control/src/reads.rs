//! What numbers read of a node.

/// What a number reads of a node beside configuration and velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeReads {
    /// `λ`.
    pub forces: bool,
    /// `a`.
    pub accelerations: bool,
    /// Internal variables.
    pub internal: bool,
}

impl NodeReads {
    /// What either reads.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            forces: self.forces || other.forces,
            accelerations: self.accelerations || other.accelerations,
            internal: self.internal || other.internal,
        }
    }

    /// Whether multipliers or accelerations are.
    #[must_use]
    pub fn any(self) -> bool {
        self.forces || self.accelerations
    }
}
