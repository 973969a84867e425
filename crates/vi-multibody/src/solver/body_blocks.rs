//! The blocks `A_α = P_in(q_n)ᵀ K_αα P_in(q_{n+1})` of a matrix `K` over the coordinates of frames.
//!
//! Masses are multiples of `I_3` between the vectors of a frame, `φ, d_1, d_2, d_3`; stiffnesses come entry by entry.
#![allow(non_snake_case)] // A, P, K

use crate::geometry::spatial::SpatialMatrix;
use crate::pair::Twist;
use nalgebra::Vector3;
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
    /// Whether an entry couples two frames: there is no block for it.
    pub coupled: bool,
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

impl Entries for BodyBlocks<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let frame = row / 12;
        if frame != column / 12 {
            self.coupled = true;
            return;
        }
        let own = 12 * frame..12 * frame + 12;
        let left = row_of_null_space(&self.q0[own.clone()], row % 12);
        let right = row_of_null_space(&self.q1[own], column % 12);
        let scaled = Twist::new(-value * left.linear, -value * left.angular);
        self.A[self.link_of[frame]].sub_outer(&scaled, &right);
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

    /// `P_in(q_n)ᵀ K P_in(q_{n+1})` of the second of two frames against dense matrices, for every multiple.
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
        let mut blocks = BodyBlocks { A, link_of, along, q0: q, q1: q, coupled: false };
        assert!(blocks.add_along(1, 2.0) && !blocks.add_along(2, 2.0) && blocks.along[1] == 2.0);
        assert!(!blocks.coupled);
        blocks.add_multiple(0, 12, 1.0);
        assert!(blocks.coupled);
    }
}
