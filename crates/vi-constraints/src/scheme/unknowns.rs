//! Kinds and scales of unknowns: coordinates and multipliers, or increments of a reparametrization.

use crate::constraints::Constraints;
use vi_core::linear::norm_inf;
use vi_core::newton::{BlockKind, UnknownBlock};
use vi_core::sparse::SparseMatrix;

/// Unknowns of the constrained schemes: `n` coordinates and `m` multipliers, not scaled yet.
#[must_use]
pub fn coordinates_and_multipliers(n: usize, m: usize) -> [UnknownBlock; 2] {
    let block = |kind, range| UnknownBlock { kind, range, floor: 1.0 };
    [block(BlockKind::Position, 0..n), block(BlockKind::Multiplier, n..n + m)]
}

/// The size below which increments of coordinates count as small, beside the configuration `q`.
#[must_use]
pub fn position_floor(q: &[f64]) -> f64 {
    1e-5 * norm_inf(q).max(1e-6)
}

/// The largest of increments of coordinates of which one is `units`
/// ([`Constraints::coordinate_units`]): a rotation, where lengths count in lever arms.
#[must_use]
pub fn rotation(units: &[f64], dq: &[f64]) -> f64 {
    dq.iter().zip(units).map(|(dq, unit)| (dq / unit).abs()).fold(0.0, f64::max)
}

/// Scales increments of coordinates with the configuration, and multipliers `h² λ` with the mass
/// matrix too.
pub fn scale(blocks: &mut [UnknownBlock], q: &[f64], mass: &SparseMatrix) {
    for block in blocks {
        block.floor = match block.kind {
            BlockKind::Multiplier => position_floor(q) * norm_inf(mass.as_sprs().data()),
            _ => position_floor(q),
        };
    }
}

/// Blocks of increments, with the floors of a configuration.
#[derive(Clone, Debug)]
pub struct Increments {
    blocks: Vec<UnknownBlock>,
    least: Vec<f64>, // floor of each block in any configuration
}

impl Increments {
    /// With floors that hold in any configuration.
    #[must_use]
    pub fn new(blocks: Vec<UnknownBlock>) -> Self {
        let least = blocks.iter().map(|block| block.floor).collect();
        Self { blocks, least }
    }

    /// Sets the floors for a step from `q`, by [`Constraints::raise_floors`].
    pub fn open(&mut self, constraints: &impl Constraints, q: &[f64]) {
        self.reset();
        self.reach(constraints, q);
    }

    /// Sets the floors that hold in any configuration.
    pub fn reset(&mut self) {
        self.blocks.iter_mut().zip(&self.least).for_each(|(block, least)| block.floor = *least);
    }

    /// Raises the floors for a step to `q`.
    pub fn reach(&mut self, constraints: &impl Constraints, q: &[f64]) {
        constraints.raise_floors(q, &mut self.blocks);
    }

    /// The blocks, to raise their floors.
    pub fn blocks_mut(&mut self) -> &mut [UnknownBlock] {
        &mut self.blocks
    }

    /// The blocks.
    #[must_use]
    pub fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }
}
