//! Numbers as the model file has them.

use nalgebra::{UnitQuaternion, Vector3};

/// Components of unit vectors below it are rounding errors.
pub(crate) const NOISE: f64 = 4e-16;

/// `[w, x, y, z]` with w >= 0.
pub(crate) fn quaternion(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    let q = rotation.quaternion();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|c| if c.abs() <= NOISE { 0.0 } else { plain(sign * c) })
}

/// A vector without components at round-off of the largest one.
pub(crate) fn vector(v: &Vector3<f64>) -> [f64; 3] {
    let size = v.amax();
    [v.x, v.y, v.z].map(|c| if c.abs() <= NOISE * size { 0.0 } else { plain(c) })
}

/// Without the sign of zero.
pub(crate) fn plain(value: f64) -> f64 {
    value + 0.0
}
