//! The closest points of a feature, its rows, and its slip.

use crate::directors::{FRAME, center, director};
use nalgebra::Vector3;
use vi_core::{Embed, Number};

/// The frame of the ground.
pub const GROUND: [f64; FRAME] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// The closest points of two shapes, in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint<T = f64> {
    /// `g`, m; negative where the shapes overlap.
    pub gap: T,
    /// Unit normal, from A to B.
    pub normal: Vector3<T>,
    /// The middle of the closest points, m.
    pub point: Vector3<T>,
}

impl<T: Number> ContactPoint<T> {
    /// The same with A and B exchanged.
    #[must_use]
    pub fn exchanged(self) -> Self {
        Self { normal: -self.normal, ..self }
    }
}

/// A point in the components of its frame, moved to space.
pub(super) fn in_space<S: Embed<T>, T: Number>(frame: &[T], point: &Vector3<S>) -> Vector3<T> {
    center(frame) + turned(frame, point)
}

/// A direction in the components of its frame, turned to space.
pub(super) fn turned<S: Embed<T>, T: Number>(frame: &[T], direction: &Vector3<S>) -> Vector3<T> {
    director(frame, 0) * direction.x.embed()
        + director(frame, 1) * direction.y.embed()
        + director(frame, 2) * direction.z.embed()
}

/// The components `ϱ_I = (x − φ)·d_I` of a point in space.
fn components(frame: &[f64], point: &Vector3<f64>) -> Vector3<f64> {
    let arm = point - center(frame);
    Vector3::from_fn(|i, _| arm.dot(&director(frame, i)))
}

/// Unit vectors `t_1`, `t_2` with `t_1 × t_2 = n`: `t_1` along the axis of space that is farthest
/// from the normal, the first of several that are but for rounding: impulses along the tangents of
/// a node begin those of the next one.
#[must_use]
pub fn tangents(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    const TIE: f64 = 1e-6;
    let least = normal.amin() + TIE;
    let axis = (0..2).find(|i| normal[*i].abs() <= least).unwrap_or(2);
    let along = Vector3::from_fn(|i, _| f64::from(u8::from(i == axis)));
    let first = (along - normal * normal[axis]).normalize();
    [first, normal.cross(&first)]
}

/// The row of a body in a contact at `point` along `d`, for B; shape 12. Of A it is the opposite.
///
/// ```text
/// B_d = (d, ϱ_1 d, ϱ_2 d, ϱ_3 d)        [N1]
/// ```
#[must_use]
pub fn row(frame: &[f64], point: &Vector3<f64>, direction: &Vector3<f64>) -> [f64; FRAME] {
    let arm = components(frame, point);
    let mut out = [0.0; FRAME];
    out[..3].copy_from_slice(direction.as_slice());
    for i in 0..3 {
        let part = direction * arm[i];
        out[3 + 3 * i..6 + 3 * i].copy_from_slice(part.as_slice());
    }
    out
}

/// The mean displacement of the material points of a body that are in contact at the start and at
/// the end of a step, m.
///
/// ```text
/// Δx = Δφ + ½ (ϱ_I(q_n) + ϱ_I(q_{n+1})) Δd_I        [N3]
/// ```
/// `ends`: the frame and the point of contact at the start and at the end; `change`: `Δq`, shape
/// 12.
#[must_use]
pub fn displacement(ends: [(&[f64], &Vector3<f64>); 2], change: &[f64]) -> Vector3<f64> {
    let [first, last] = ends.map(|(frame, point)| components(frame, point));
    center(change) + turned(change, &(0.5 * (first + last)))
}
