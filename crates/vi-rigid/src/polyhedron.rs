//! Mass properties of a homogeneous solid that is bounded by triangles.
//!
//! ```text
//! V   = Σ det(a, b, c)/6
//! V x = Σ det(a, b, c) (a + b + c)/24
//! E   = Σ det(a, b, c) (a aᵀ + b bᵀ + c cᵀ + s sᵀ)/120,   s = a + b + c
//! ```
//! Sums over tetrahedra of the triangles and a common tip, which is the mean of the corners: far
//! from the origin no digits are lost. Letters: `a, b, c` corners of a triangle from the tip,
//! counterclockwise as seen from outside; `x` the centre of volume; `E = ∫ x xᵀ dV` the Euler
//! tensor at density 1. The integrals of a polyhedron are exact up to round-off.
#![allow(non_snake_case)] // E: the letter above

use nalgebra::{Matrix3, Vector3};

/// A volume below this part of the 3/2th power of the area of the surface is that of a flat body.
const FLAT: f64 = 1e-12;

/// Integrals over a polyhedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polyhedron {
    /// Volume, m³.
    pub volume: f64,
    /// Centre of volume, m.
    pub center: Vector3<f64>,
    /// Euler tensor about the centre of volume at density 1, m⁵.
    pub euler: Matrix3<f64>,
}

/// Why a surface bounds no solid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// A triangle names a corner that does not exist.
    #[error("triangle {triangle} names a corner that does not exist")]
    NoCorner {
        /// Its index, from 0.
        triangle: usize,
    },
    /// Edges are not passed once in each direction.
    #[error("it is not closed: {edges} edges have no partner")]
    Open {
        /// How many.
        edges: usize,
    },
    /// The triangles are clockwise as seen from outside.
    #[error("it is inside out: its volume is {volume:.3e} m³")]
    InsideOut {
        /// Volume, m³.
        volume: f64,
    },
    /// The surface encloses no volume.
    #[error("it is flat: its volume is {volume:.3e} m³")]
    Flat {
        /// Volume, m³.
        volume: f64,
    },
}

impl Polyhedron {
    /// From the corners of a surface, m, and its triangles.
    ///
    /// # Errors
    /// [`SurfaceError`] for a surface that is not closed, inside out or flat.
    pub fn new(corners: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Result<Self, SurfaceError> {
        let missing = |t: &[u32; 3]| t.iter().any(|k| *k as usize >= corners.len());
        if let Some(triangle) = triangles.iter().position(missing) {
            return Err(SurfaceError::NoCorner { triangle });
        }
        let edges = open_edges(triangles);
        if edges > 0 {
            return Err(SurfaceError::Open { edges });
        }
        let tip = corners.iter().sum::<Vector3<f64>>() / corners.len().max(1) as f64;
        let (mut volume, mut area) = (0.0, 0.0);
        let (mut first, mut E) = (Vector3::zeros(), Matrix3::zeros());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|k| corners[k as usize] - tip);
            let det = a.cross(&b).dot(&c);
            let s = a + b + c;
            area += 0.5 * (b - a).cross(&(c - a)).norm();
            volume += det / 6.0;
            first += s * (det / 24.0);
            E += (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose())
                * (det / 120.0);
        }
        if volume.abs() <= FLAT * area * area.sqrt() || !volume.is_finite() {
            return Err(SurfaceError::Flat { volume });
        }
        if volume < 0.0 {
            return Err(SurfaceError::InsideOut { volume });
        }
        let center = first / volume;
        let euler = E - center * center.transpose() * volume;
        Ok(Self { volume, center: tip + center, euler })
    }

    /// Inertia tensor about the centre of mass for a density (kg/m³), kg·m².
    #[must_use]
    pub fn inertia(&self, density: f64) -> Matrix3<f64> {
        (Matrix3::identity() * self.euler.trace() - self.euler) * density
    }
}

/// Edges that are not passed as often in the one direction as in the other.
fn open_edges(triangles: &[[u32; 3]]) -> usize {
    let of = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    let mut edges: Vec<([u32; 2], i64)> = triangles
        .iter()
        .flat_map(of)
        .map(|(from, to)| if from < to { ([from, to], 1) } else { ([to, from], -1) })
        .collect();
    edges.sort_unstable();
    let same = edges.chunk_by(|a, b| a.0 == b.0);
    same.filter(|edge| edge.iter().map(|passed| passed.1).sum::<i64>() != 0).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation;
    use crate::shape::Shape;

    /// A box about the origin with edges 2, 4, 6.
    fn block() -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
        let side = |k: u32, bit: u32, half: f64| if k & bit == 0 { -half } else { half };
        let corner = |k: u32| Vector3::new(side(k, 1, 1.0), side(k, 2, 2.0), side(k, 4, 3.0));
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
        ((0..8).map(corner).collect(), triangles.collect())
    }

    #[test]
    fn a_box_of_triangles_has_the_inertia_of_a_box_wherever_it_stands() {
        let (corners, triangles) = block();
        let exact = Shape::Box { lengths: [2.0, 4.0, 6.0] }.mass_properties(3.0).unwrap();
        let J = Matrix3::from_diagonal(&Vector3::from(exact.inertia.moments()));
        let R = rotation::exp(&Vector3::new(0.3, -1.1, 0.7));
        for offset in [Vector3::zeros(), Vector3::new(10.0, -20.0, 30.0)] {
            let moved: Vec<_> = corners.iter().map(|x| R * x + offset).collect();
            let found = Polyhedron::new(&moved, &triangles).unwrap();
            let size = 1.0 + offset.amax();
            let mass = (3.0 * found.volume - exact.mass).abs() / exact.mass;
            let inertia = (found.inertia(3.0) - R * J * R.transpose()).amax() / J.amax();
            let center = (found.center - offset).amax();
            assert!(mass < 1e-15 * size, "mass: {mass:e}");
            assert!(inertia < 1e-15 * size, "inertia: {inertia:e}");
            assert!(center < 1e-15 * size, "centre: {center:e}");
        }
    }

    /// `V = 1/6`, `x = (1, 1, 1)/4`, `∫ x² dV = 1/60`, `∫ x y dV = 1/120`.
    #[test]
    fn the_tetrahedron_in_the_corner_of_the_axes_has_its_closed_form() {
        let corners = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
        let found = Polyhedron::new(&corners, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
        let found = found.unwrap();
        let center = Vector3::repeat(0.25);
        let about_origin = Matrix3::from_element(1.0 / 120.0) + Matrix3::identity() / 120.0;
        let euler = about_origin - center * center.transpose() / 6.0;
        let errors = [
            (found.volume - 1.0 / 6.0).abs(),
            (found.center - center).amax(),
            (found.euler - euler).amax(),
        ];
        assert!(errors.iter().all(|e| *e < 1e-16), "{errors:?}");
    }

    #[test]
    fn surfaces_that_bound_no_solid_are_refused() {
        let (corners, mut triangles) = block();
        let flipped: Vec<_> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let inside_out = Polyhedron::new(&corners, &flipped);
        assert_eq!(inside_out, Err(SurfaceError::InsideOut { volume: -48.0 }));
        let flat: Vec<_> = corners.iter().map(|x| Vector3::new(x.x, x.y, 0.1 * x.x)).collect();
        let flat = Polyhedron::new(&flat, &triangles);
        assert!(matches!(flat, Err(SurfaceError::Flat { .. })), "{flat:?}");
        triangles.pop();
        assert_eq!(Polyhedron::new(&corners, &triangles), Err(SurfaceError::Open { edges: 3 }));
        let nothing = Polyhedron::new(&[], &[]);
        assert!(matches!(nothing, Err(SurfaceError::Flat { .. })), "{nothing:?}");
        let missing = Polyhedron::new(&corners, &[[0, 1, 8]]);
        assert_eq!(missing, Err(SurfaceError::NoCorner { triangle: 0 }));
    }
}
