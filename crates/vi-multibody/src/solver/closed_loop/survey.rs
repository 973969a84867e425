//! Loops as they are found at a configuration: their size, what they leave free, the smallest
//! singular value of their constraints, in the measure of the search for those that nearly are
//! redundant (`nearly.rs`).
#![allow(non_snake_case)] // J

use super::loops::Loops;
use super::nearly::Walk;
use super::path::{Maps, RowPlace};
use crate::mechanism::{Mechanism, NearlyRedundant};
use nalgebra::DMatrix;
use vi_constraints::null_space::RANK_TOLERANCE;

/// Loops that share links, as they are found.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopSurvey {
    /// Their joints, as numbered in the description: those of the spanning tree, then those that
    /// are cut.
    pub joints: Vec<usize>,
    /// A joint or constraint that closes them, by its name.
    pub closed_by: String,
    /// Largest distance between their joints, m.
    pub size: f64,
    /// Degrees of freedom that they leave to their links, prescribed motions left out.
    pub freedom: usize,
    /// The smallest singular value of their constraints that is not rounding, rad or parts of their
    /// size; `None` where the matrix is large.
    pub smallest: Option<f64>,
    /// Whether constraints that nearly follow from the others are taken as redundant.
    pub nearly: bool,
}

/// Looks at the loops of a mechanism without point masses at `(t, q)`; `nearly`: what is taken as
/// redundant.
#[must_use]
pub fn survey(
    mechanism: &Mechanism,
    t: f64,
    q: &[f64],
    nearly: Option<&NearlyRedundant>,
) -> Vec<LoopSurvey> {
    let mut walk = Walk::new(mechanism, t, q, RANK_TOLERANCE);
    walk.loops.tree.begin(q, None);
    let moving = std::mem::take(&mut walk.moving);
    let ranks = walk.eliminate(q, &moving, &[]);
    let numbers = mechanism.loop_rows();
    let mut found = Vec::new();
    for (k, rank) in ranks.into_iter().enumerate() {
        let smallest = walk.smallest(k, &moving[k], q);
        let cluster = &walk.loops.clusters[k];
        let taken = nearly.and_then(|nearly| *nearly.ranks.get(k)?);
        let row = moving[k].first().map_or(0, |&i| numbers[cluster.paths.rows[i].number]);
        found.push(LoopSurvey {
            joints: walk.places.joints(cluster),
            closed_by: mechanism.constraint_name(row).to_owned(),
            size: walk.sizes[k],
            freedom: cluster.paths.columns.len() - taken.unwrap_or(rank).min(rank),
            smallest,
            nearly: taken.is_some(),
        });
    }
    found
}

impl Walk<'_> {
    /// The smallest singular value of some rows of a cluster at `q`, at which the tree stands; what
    /// is rounding is left out.
    fn smallest(&mut self, k: usize, rows: &[usize], q: &[f64]) -> Option<f64> {
        const LARGEST: usize = 60;
        let Loops { tree, clusters, home, column_of, .. } = &mut self.loops;
        let cluster = &mut clusters[k];
        let (m, n) = (rows.len(), cluster.paths.columns.len());
        if m.max(n) > LARGEST || m.min(n) == 0 {
            return None;
        }
        let at = RowPlace { tree, maps: Maps::Pairs, home, column_of, q, next: false, step: None };
        let mut J = DMatrix::zeros(m, n);
        for (place, &i) in rows.iter().enumerate() {
            let scale = cluster.paths.rows[i].scale;
            for &(column, value) in cluster.plain_row(i, at) {
                J[(place, column)] = scale * value;
            }
        }
        for (column, &unknown) in cluster.paths.columns.iter().enumerate() {
            J.column_mut(column).scale_mut(self.weights[unknown]);
        }
        let values = J.singular_values();
        let clear = values.iter().copied().filter(|value| *value > RANK_TOLERANCE * values.max());
        clear.min_by(f64::total_cmp)
    }
}
