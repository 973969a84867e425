//! The blocks `A_α = P_in(q_n)ᵀ K_αα P_in(q_{n+1})` of a matrix `K` over the coordinates of frames.
//!
//! Masses are multiples of `I_3` between the vectors of a frame, `φ, d_1, d_2, d_3`; stiffnesses
//! come entry by entry.
#![allow(non_snake_case)] // A, P, K

use crate::geometry::spatial::SpatialMatrix;
use crate::pair::Twist;
use crate::tree::Tree;
use nalgebra::{Matrix3, Vector3};
use vi_constraints::reparametrization::Emission;
use vi_core::sparse::Entries;
use vi_rigid::directors;

/// Receives the entries of `K` and adds what they are of `A_α`.
pub(super) struct BodyBlocks<'a> {
    /// `A`, one for each link.
    pub A: &'a mut [SpatialMatrix],
    /// The link of each frame.
    pub link_of: &'a [usize],
    /// What acts along each unknown; empty where that is known otherwise.
    pub along: &'a mut [f64],
    /// `q_n`.
    pub q0: &'a [f64],
    /// `q_{n+1}`.
    pub q1: &'a [f64],
    /// Where the blocks between a link and its parent go; `None`: there is no place for them.
    pub near: Option<NearBlocks<'a>>,
    /// Whether an entry couples two frames for which there is no block.
    pub coupled: bool,
}

/// `P_in(q_n)ᵀ K_αβ P_in(q_{n+1})` between links and their parents.
pub(super) struct NearBlocks<'a> {
    /// The tree.
    pub tree: &'a Tree,
    /// Rows of each link, columns of its parent.
    pub of_link: &'a mut [SpatialMatrix],
    /// Rows of its parent, columns of each link.
    pub of_parent: &'a mut [SpatialMatrix],
}

/// Whether a matrix over the coordinates of frames couples two of them.
pub(super) fn couples_bodies(matrix: &Emission<'_>) -> bool {
    couples_beyond(matrix, |_, _| false)
}

/// Whether it couples two of them that are not a link and its parent.
pub(super) fn couples_beyond_parents(tree: &Tree, matrix: &Emission<'_>) -> bool {
    let parent = |frame: usize| {
        let link = tree.links()[tree.link_of()[frame]].parent;
        link.map(|parent| tree.links()[parent].frame)
    };
    couples_beyond(matrix, |a, b| parent(a) == Some(b) || parent(b) == Some(a))
}

/// Whether it couples two of them that are not `close`.
fn couples_beyond(matrix: &Emission<'_>, close: impl Fn(usize, usize) -> bool) -> bool {
    struct Crossing<F> {
        close: F,
        met: bool,
    }
    impl<F: Fn(usize, usize) -> bool> Entries for Crossing<F> {
        fn add(&mut self, row: usize, column: usize, _value: f64) {
            let (row, column) = (row / 12, column / 12);
            self.met |= row != column && !(self.close)(row, column);
        }
        fn add_along(&mut self, _j: usize, _value: f64) -> bool {
            true
        }
    }
    let mut found = Crossing { close, met: false };
    matrix(&mut found);
    found.met
}

/// Row `i` of `P_in`: the coordinate `i` of a frame moves by `row · t`.
fn row_of_null_space(q: &[f64], i: usize) -> Twist {
    let unit = Vector3::ith(i % 3, 1.0);
    if i < 3 {
        return Twist::new(unit, Vector3::zeros());
    }
    // (ω × d)·e = ω·(d × e)
    Twist::new(Vector3::zeros(), directors::director(q, i / 3 - 1).cross(&unit))
}

/// The director that starts at coordinate `i` of a frame; `None` for the centre.
fn arm(q: &[f64], i: usize) -> Option<Vector3<f64>> {
    (i > 0).then(|| directors::director(q, i / 3 - 1))
}

/// The coordinates of a frame.
fn of_frame(q: &[f64], frame: usize) -> &[f64] {
    &q[12 * frame..12 * frame + 12]
}

impl BodyBlocks<'_> {
    /// The block between two frames.
    fn block(&mut self, row: usize, column: usize) -> Option<&mut SpatialMatrix> {
        let (row, column) = (self.link_of[row], self.link_of[column]);
        if row == column {
            return Some(&mut self.A[row]);
        }
        if let Some(NearBlocks { tree, of_link, of_parent }) = &mut self.near {
            let parent = |link: usize| tree.links()[link].parent;
            if parent(row) == Some(column) {
                return Some(&mut of_link[row]);
            }
            if parent(column) == Some(row) {
                return Some(&mut of_parent[column]);
            }
        }
        self.coupled = true;
        None
    }
}

impl Entries for BodyBlocks<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let (q0, q1) = (of_frame(self.q0, row / 12), of_frame(self.q1, column / 12));
        let Some(block) = self.block(row / 12, column / 12) else { return };
        let (left, right) = (row_of_null_space(q0, row % 12), row_of_null_space(q1, column % 12));
        let scaled = Twist::new(-value * left.linear, -value * left.angular);
        block.sub_outer(&scaled, &right);
    }

    fn add_block(&mut self, row: usize, column: usize, block: &Matrix3<f64>) {
        let (i, j) = (row % 12, column % 12);
        if i % 3 != 0 || j % 3 != 0 {
            for k in 0..9 {
                self.add(row + k / 3, column + k % 3, block[(k / 3, k % 3)]);
            }
            return;
        }
        let (a, b) = (arm(of_frame(self.q0, row / 12), i), arm(of_frame(self.q1, column / 12), j));
        let Some(own) = self.block(row / 12, column / 12) else { return };
        own.add_block(block, a.as_ref(), b.as_ref());
    }

    fn add_multiple(&mut self, row: usize, column: usize, value: f64) {
        let (frame, i, j) = (row / 12, row % 12, column % 12);
        if frame != column / 12 || i % 3 != 0 || j % 3 != 0 {
            (0..3).for_each(|k| self.add(row + k, column + k, value));
            return;
        }
        let own = 12 * frame..12 * frame + 12;
        let (a, b) = (arm(&self.q0[own.clone()], i), arm(&self.q1[own], j));
        self.A[self.link_of[frame]].add_multiple(value, a.as_ref(), b.as_ref());
    }

    fn add_along(&mut self, j: usize, value: f64) -> bool {
        let own = self.along.get_mut(j);
        own.map(|own| *own += value).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, SMatrix};
    use vi_rigid::null_space;
    use vi_testkit::Sample;

    /// `P_in(q_n)ᵀ K P_in(q_{n+1})` of the second of two frames against dense matrices, for every
    /// multiple.
    #[test]
    fn blocks_are_those_of_the_null_space_matrix() {
        let mut sample = Sample::new(91);
        let frames = |sample: &mut Sample| [sample.frame(), sample.frame()].concat();
        let (q0, q1) = (frames(&mut sample), frames(&mut sample));
        let [left, right] = [&q0, &q1].map(|q| null_space::matrix(&q[12..]));
        for i in 0..10 {
            for j in 0..10 {
                let mut A = [SpatialMatrix::zero(); 2];
                let link_of = [1, 0];
                let (q0, q1) = (&q0[..], &q1[..]);
                let mut blocks = BodyBlocks {
                    A: &mut A,
                    link_of: &link_of,
                    along: &mut [],
                    q0,
                    q1,
                    near: None,
                    coupled: false,
                };
                blocks.add_multiple(12 + i, 12 + j, 0.7);
                assert!(!blocks.coupled && A[1] == SpatialMatrix::zero());
                let mut K = SMatrix::<f64, 12, 12>::zeros();
                (0..3).for_each(|k| K[(i + k, j + k)] = 0.7);
                let expected: Matrix6<f64> = left.transpose() * K * right;
                let unit = |k: usize| {
                    let at = |first: usize| Vector3::from_fn(|i, _| f64::from(first + i == k));
                    Twist::new(at(0), at(3))
                };
                for column in 0..6 {
                    let image = A[0].mul(&unit(column));
                    for row in 0..6 {
                        let error = (unit(row).dot(&image) - expected[(row, column)]).abs();
                        assert!(error <= 4.0 * f64::EPSILON, "block ({i}, {j}): {error:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn entries_between_frames_are_noticed() {
        let q = [0.0; 24];
        let mut A = [SpatialMatrix::zero(); 2];
        let (A, link_of, along, q) = (&mut A[..], &[0, 1], &mut [0.0; 2], &q[..]);
        let mut blocks = BodyBlocks { A, link_of, along, q0: q, q1: q, near: None, coupled: false };
        assert!(blocks.add_along(1, 2.0) && !blocks.add_along(2, 2.0) && blocks.along[1] == 2.0);
        assert!(!blocks.coupled);
        blocks.add_multiple(0, 12, 1.0);
        assert!(blocks.coupled);
    }
}
