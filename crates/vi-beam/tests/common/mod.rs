//! Shared by the tests of this folder; each uses a part of it.
#![allow(dead_code, unreachable_pub)] // every test file compiles its own copy

use nalgebra::Vector3;
use vi_beam::{BeamMesh, FrameRule, Section};
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;

pub fn vector(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

/// Straight along x with `d_1 = z`.
pub fn straight(length: f64, elements: usize) -> BeamMesh {
    let rule = FrameRule::Normal(Vector3::z());
    BeamMesh::straight(Vector3::zeros(), length * Vector3::x(), elements, rule).unwrap()
}

pub fn load(frame: usize, kind: LoadKind, force: Vector3<f64>, torque: Vector3<f64>) -> Load {
    Load::new(12 * frame, kind, force, torque, TimeHistory::default()).unwrap()
}

pub fn dead(frame: usize, force: Vector3<f64>) -> Load {
    load(frame, LoadKind::Dead, force, Vector3::zeros())
}

/// `GA = EA = 1e4`, `EI = GJ = 500`, `ρA = 1`, `ρI = (10, 10, 0)`.
pub fn flying_section() -> Section {
    Section::new([1e4, 1e4, 1e4, 500.0, 500.0, 500.0], [1.0, 10.0, 10.0, 0.0]).unwrap()
}

pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |a: f64, b| if b <= a { a } else { b.abs().max(a) })
}

pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    largest(a.iter().zip(b).map(|(a, b)| (a - b).abs()))
}

/// The centre of a frame in a configuration.
pub fn center_of(q: &[f64], frame: usize) -> Vector3<f64> {
    vi_rigid::directors::center(&q[12 * frame..12 * frame + 12])
}
