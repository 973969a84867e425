//! The surface of a helical spring.

use nalgebra::Vector3;

use crate::mesh::SurfaceMesh;

/// Revolutions of the helix.
const TURNS: usize = 10;
/// Sections of the wire in a revolution, and corners of a section.
const SECTIONS: usize = 12;
const CORNERS: usize = 6;
/// Part of the length at each end where the wire is straight.
const STRAIGHT: f64 = 0.1;

/// A spring along the third axis about the origin; `radius` of the helix, `length` and radius of
/// the `wire`, m.
pub(crate) fn coil(radius: f64, length: f64, wire: f64) -> SurfaceMesh {
    let last = (TURNS + 2) * SECTIONS;
    let angle = |k: usize| {
        let wound = (k as f64 / last as f64 - STRAIGHT) / (1.0 - 2.0 * STRAIGHT);
        wound.clamp(0.0, 1.0) * std::f64::consts::TAU * TURNS as f64
    };
    let outwards = |k: usize| Vector3::new(angle(k).cos(), angle(k).sin(), 0.0);
    let line = |k: usize| {
        let turn = angle(k) / std::f64::consts::TAU;
        let widening = turn.min(TURNS as f64 - turn).clamp(0.0, 1.0);
        outwards(k) * (radius * widening) + Vector3::z() * ((k as f64 / last as f64 - 0.5) * length)
    };
    let mut mesh = SurfaceMesh::default();
    for k in 0..=last {
        let tangent = line((k + 1).min(last)) - line(k.saturating_sub(1));
        let tangent = tangent.try_normalize(0.0).unwrap_or_else(Vector3::z);
        let across = outwards(k) - tangent * tangent.dot(&outwards(k));
        let across = across.try_normalize(0.0).unwrap_or_else(Vector3::x);
        let third = tangent.cross(&across);
        for corner in 0..CORNERS {
            let (sin, cos) = (std::f64::consts::TAU * corner as f64 / CORNERS as f64).sin_cos();
            let normal = across * cos + third * sin;
            mesh.points.push((line(k) + normal * wire).into());
            mesh.normals.push(normal.into());
        }
    }
    let corners = CORNERS as u32;
    for k in 0..last as u32 {
        let (low, high) = (k * corners, (k + 1) * corners);
        for (a, b) in (0..corners).map(|a| (a, (a + 1) % corners)) {
            mesh.triangles.push([low + a, low + b, high + a]);
            mesh.triangles.push([high + a, low + b, high + b]);
        }
    }
    let end = last as u32 * corners;
    for k in 1..corners - 1 {
        mesh.triangles.push([0, k + 1, k]);
        mesh.triangles.push([end, end + k, end + k + 1]);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::volume;

    #[test]
    fn the_wire_is_closed_and_ends_on_the_axis() {
        let (radius, length, wire) = (0.1, 2.0, 0.01);
        let mesh = coil(radius, length, wire);
        let area =
            0.5 * CORNERS as f64 * (std::f64::consts::TAU / CORNERS as f64).sin() * wire * wire;
        // the radius grows over the first revolution and shrinks over the last one: nine of ten
        let wound = 9.0 * std::f64::consts::TAU * radius;
        let straight = 2.0 * STRAIGHT * length;
        let expected = area * (straight + wound.hypot(length - straight));
        let found = volume(&mesh);
        assert!((found / expected - 1.0).abs() < 0.02, "volume {found}, expected {expected}");
        for end in [&mesh.points[..CORNERS], &mesh.points[mesh.points.len() - CORNERS..]] {
            let sum: Vector3<f64> = end.iter().map(|x| Vector3::from(*x)).sum();
            let middle = sum / CORNERS as f64;
            assert!(middle.xy().norm() < 1e-15 && (middle.z.abs() - 0.5 * length).abs() < 1e-15);
        }
    }
}
