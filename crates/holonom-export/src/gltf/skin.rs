//! Beams as one surface each that its nodes deform.
//!
//! ```text
//! x(t) = (1 − w) T_a(t) T_a(0)⁻¹ x(0) + w T_b(t) T_b(0)⁻¹ x(0),    w = 3 s² − 2 s³
//! ```
//! `T`: position and directors of a node; `s`: the place between two nodes. Since `w′ = 0` at the nodes the centre line has
//! the tangents of the directors there: it is smooth.

use nalgebra::{Rotation3, Vector3};

use crate::look::NamedBeam;
use crate::tube::{Pose, Section, Tube};

/// Nodes of one skin at most: their indices are bytes.
const NODES: usize = 200;

/// A part of a beam with its surface at the first frame.
#[derive(Debug)]
pub(super) struct Skin {
    /// The nodes among all members.
    pub(super) nodes: std::ops::Range<usize>,
    pub(super) tube: Tube,
}

/// The parts of a beam.
pub(super) fn skins(beam: &NamedBeam, poses: &[Pose]) -> Vec<Skin> {
    let part = |nodes: std::ops::Range<usize>| Skin {
        tube: Tube::new(&beam.beam, &poses[nodes.clone()]),
        nodes,
    };
    let parts = |leg: std::ops::Range<usize>| {
        let last = leg.end - 1;
        leg.step_by(NODES - 1)
            .filter(move |first| *first < last)
            .map(move |first| first..(first + NODES).min(last + 1))
    };
    beam.legs().into_iter().flat_map(parts).map(part).collect()
}

/// The joints of a corner and their weights.
pub(super) fn influence(section: &Section) -> ([u8; 4], [f32; 4]) {
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

/// The inverse of the place of a node in the world at the first frame, column after column; `world`: from the axes of the
/// run to those of the file.
pub(super) fn inverse_bind(pose: &Pose, world: &Rotation3<f64>) -> [f32; 16] {
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
