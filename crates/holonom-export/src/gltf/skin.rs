//! Beams as one surface each that its nodes deform.
//!
//! ```text
//! x(t) = (1 − w) T_a(t) T_a(0)⁻¹ x(0) + w T_b(t) T_b(0)⁻¹ x(0),    w = 3 s² − 2 s³
//! ```
//! `T`: position and directors of a node; `s`: the place between two nodes. Since `w′ = 0` at the
//! nodes the centre line has the tangents of the directors there: it is smooth.

use nalgebra::{Rotation3, Vector3};
use std::ops::Range;

use crate::look::NamedBeam;
use crate::tube::{MemberPose, Tube, TubeSection};

/// Nodes of one skin at most: their indices are bytes.
const NODES: usize = 200;

/// A part of a beam with its surface at the first frame.
#[derive(Debug)]
pub(super) struct Skin {
    /// The nodes among all members.
    pub(super) nodes: Range<usize>,
    pub(super) tube: Tube,
}

/// The parts of a beam.
pub(super) fn skins(beam: &NamedBeam, poses: &[MemberPose]) -> Vec<Skin> {
    let part =
        |nodes: Range<usize>| Skin { tube: Tube::new(&beam.beam, &poses[nodes.clone()]), nodes };
    beam.legs().into_iter().flat_map(parts).map(part).collect()
}

/// The nodes of a leg in parts; the last node of one is the first of the next.
fn parts(leg: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let Range { start, end } = leg;
    let firsts = (start..end.saturating_sub(1)).step_by(NODES - 1);
    firsts.map(move |first| first..(first + NODES).min(end))
}

/// The joints of a corner and their weights.
pub(super) fn influence(section: &TubeSection) -> ([u8; 4], [f32; 4]) {
    let s = section.place;
    let w = (s * s * (3.0 - 2.0 * s)) as f32;
    let node = section.node as u8;
    // a joint without weight must be the first
    match w {
        0.0 => ([node, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
        1.0 => ([node + 1, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
        _ => ([node, node + 1, 0, 0], [1.0 - w, w, 0.0, 0.0]),
    }
}

/// The inverse of the place of a node in the world at the first frame, column after column;
/// `world`: from the axes of the run to those of the file.
pub(super) fn inverse_bind(pose: &MemberPose, world: &Rotation3<f64>) -> [f32; 16] {
    let turn = pose.directors.transpose() * world.matrix().transpose();
    let shift: Vector3<f64> = -(pose.directors.transpose() * pose.center);
    let mut all = [0.0; 16];
    for column in 0..3 {
        for row in 0..3 {
            all[4 * column + row] = turn[(row, column)] as f32;
        }
        all[12 + column] = shift[column] as f32;
    }
    all[15] = 1.0;
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_every_interval_once() {
        for nodes in [2, 3, NODES - 1, NODES, NODES + 1, 2 * NODES - 1, 2 * NODES, 1001] {
            let all: Vec<Range<usize>> = parts(7..7 + nodes).collect();
            let intervals: Vec<usize> =
                all.iter().flat_map(|part| part.start..part.end - 1).collect();
            assert_eq!(intervals, (7..7 + nodes - 1).collect::<Vec<_>>(), "{nodes} nodes");
            assert!(all.iter().all(|part| (2..=NODES).contains(&part.len())), "{all:?}");
        }
    }

    #[test]
    fn weights_add_up_and_a_joint_without_weight_is_the_first() {
        for section in crate::tube::sections(5) {
            let (joints, weights) = influence(&section);
            let sum: f32 = weights.iter().sum();
            assert!((sum - 1.0).abs() < 1e-7, "{weights:?}");
            let idle = joints.iter().zip(&weights).filter(|(_, weight)| **weight == 0.0);
            assert!(idle.map(|(joint, _)| *joint).all(|joint| joint == 0), "{joints:?}");
        }
    }
}
