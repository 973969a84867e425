//! The complement of a few loops on a few links, by dense matrices: what [`super::complement`] does
//! for many.
//!
//! ```text
//! C_ik = v̂_i·û_k,   C μ = (p'_i, g_i − v̂_i·x)       right-hand sides: the unit twists of the apex, then the closure
//! ```
#![allow(non_snake_case)] // C

use super::echelon::Entry;
use super::path::Paths;
use super::relief::{Relief, SIDES, first_side};
use super::square_system::SquareSystem;
use crate::pair::Twist;
use crate::solver::articulated::Articulated;
use vi_core::newton::Fault;

/// Columns up to which a cluster is solved by dense matrices.
const COLUMNS: usize = 16;

/// `C` with what it is made of.
pub(crate) struct DenseComplement {
    width: usize,         // columns of the cluster
    left: Vec<f64>,       // rank × width  û_k
    right: Vec<f64>,      // width  v̂_i of the row at hand
    matrix: SquareSystem, // C
    relief: Relief,
    carried: Vec<Twist>, // scratch, of each link
}

impl DenseComplement {
    /// For the links of a cluster and the rank of its loops; `None` where they are many, or none.
    pub(crate) fn new(paths: &Paths, rank: usize) -> Option<Self> {
        let (width, links) = (paths.columns.len(), paths.links.len());
        (1..=COLUMNS).contains(&width).then(|| Self {
            width,
            left: vec![0.0; rank * width],
            right: vec![0.0; width],
            matrix: SquareSystem::new(rank, SIDES),
            relief: Relief::new(rank),
            carried: vec![Twist::zero(); links],
        })
    }

    /// `û_k`, `p_k` from `U_k`.
    pub(crate) fn add_column(
        &mut self,
        k: usize,
        basis: impl Iterator<Item = Entry>,
        paths: &Paths,
        tree: &Articulated,
    ) {
        let values = &mut self.left[k * self.width..(k + 1) * self.width];
        values.fill(0.0);
        basis.for_each(|(column, value)| values[column] = value);
        let transmit = |link: usize, p: &Twist, own: &mut [f64]| tree.transmit(link, p, own);
        self.relief.wrenches[k] = sweep(paths, &mut self.carried, values, transmit);
    }

    /// Row `i` of `C` with the right-hand sides, from the row of `J'` last written.
    pub(crate) fn add_row(
        &mut self,
        (i, g): (usize, f64),
        paths: &Paths,
        tree: &Articulated,
        x: &[f64],
    ) {
        let Self { width, left, right, matrix, carried, .. } = self;
        right.fill(0.0);
        paths.last_row().iter().for_each(|&(column, value)| right[column] = value);
        let transmit =
            |link: usize, p: &Twist, own: &mut [f64]| tree.transmit_transposed(link, p, own);
        let twist = sweep(paths, carried, right, transmit);
        let (row, sides) = matrix.row_mut(i);
        for (entry, u) in row.iter_mut().zip(left.chunks_exact(*width)) {
            *entry = right.iter().zip(u).map(|(v, u)| v * u).sum();
        }
        let felt = if paths.apex.is_some() { 1.0 } else { 0.0 };
        let along = twist.linear.iter().chain(twist.angular.iter());
        sides.iter_mut().zip(along).for_each(|(side, v)| *side = felt * v);
        let moved: f64 = right.iter().zip(&paths.columns).map(|(v, &column)| v * x[column]).sum();
        sides[SIDES - 1] = g - moved;
    }

    /// Solves for the multipliers, and relieves the apex of the cluster.
    pub(crate) fn solve(
        &mut self,
        apex: Option<usize>,
        tree: &mut Articulated,
    ) -> Result<(), Fault> {
        let Self { matrix, relief, .. } = self;
        matrix.solve(first_side(apex))?;
        relief.take(|k, side| matrix.solution(k, side), first_side(apex));
        relief.relieve(apex, tree);
        Ok(())
    }

    /// Adds what the multipliers do to `x`, now that the motion of the apex is known.
    pub(crate) fn release(&mut self, paths: &Paths, tree: &mut Articulated, x: &mut [f64]) {
        let apex = paths.apex.map(|apex| *tree.wrench(apex));
        let multipliers = self.relief.multipliers(apex.as_ref());
        for (multiplier, u) in multipliers.iter().zip(self.left.chunks_exact(self.width)) {
            for (&column, u) in paths.columns.iter().zip(u) {
                x[column] += u * multiplier;
            }
        }
    }
}

/// Sweeps to the apex; `transmit` turns the values of a link, and its wrench into that of its
/// parent.
fn sweep(
    paths: &Paths,
    carried: &mut [Twist],
    values: &mut [f64],
    transmit: impl Fn(usize, &Twist, &mut [f64]) -> Twist,
) -> Twist {
    let mut out = Twist::zero();
    carried.fill(Twist::zero());
    for (k, link) in paths.links.iter().enumerate() {
        let own = &mut values[link.first..link.first + link.dof];
        let transmitted = transmit(link.link, &carried[k], own);
        match link.parent {
            Some(parent) => carried[parent].add_scaled(1.0, &transmitted),
            None => out.add_scaled(1.0, &transmitted),
        }
    }
    out
}
