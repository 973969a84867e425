//! An ellipsoid on a plane.
//!
//! ```text
//! x = c − D A² n_b/√(n_bᵀ A² n_b),   n_b = Dᵀ n,   g = n·(x − o)
//! ```
//! Letters: `D` the axes in space, `A` the half axes.

use super::contact_point::{ContactPoint, in_space, turned};
use super::points_plane::Plane;
use nalgebra::{Matrix3, Vector3};
use vi_core::{Embed, Number};

/// The contact of the lowest point; `shape`: centre, axes, half axes.
#[must_use]
pub fn contact<S: Embed<T>, T: Number>(
    plane: &Plane<T>,
    shape: (&Vector3<S>, &Matrix3<S>, &Vector3<S>),
    frame: &[T],
) -> ContactPoint<T> {
    let (center, axes, half_axes) = shape;
    let columns = [0, 1, 2].map(|i| turned(frame, &axes.column(i).into_owned()));
    let normal = Vector3::from_fn(|i, _| plane.normal.dot(&columns[i]) * half_axes[i].embed());
    let length = normal.norm();
    let mut lowest = in_space(frame, center);
    for i in 0..3 {
        lowest -= columns[i] * (half_axes[i].embed() * normal[i] / length);
    }
    plane.contact_with(&lowest)
}
