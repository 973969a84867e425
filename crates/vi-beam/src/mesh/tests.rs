//! Meshes along curves.

use super::*;
use vi_rigid::rotation::orthonormality_defect;

fn z() -> Vector3<f64> {
    Vector3::z()
}

#[test]
fn arcs_have_their_length_and_tangents() {
    let rule = FrameRule::Normal(z());
    let mesh = BeamMesh::arc(Vector3::zeros(), 2.0 * Vector3::x(), z(), 1.5, 6, rule).unwrap();
    let total: f64 = mesh.lengths.iter().sum();
    assert!((total - 3.0).abs() < 1e-14, "{total}");
    for (triad, center) in mesh.triads.iter().zip(&mesh.centers) {
        assert!(orthonormality_defect(triad) < 1e-15);
        let d3: Vector3<f64> = triad.column(2).into();
        assert!((d3 - z().cross(center) / 2.0).norm() < 1e-15);
        assert!((triad.column(0) - z()).norm() < 1e-15);
    }
    let back = BeamMesh::arc(Vector3::zeros(), 2.0 * Vector3::x(), z(), -1.5, 6, rule).unwrap();
    assert!((back.triads[0].column(2) + Vector3::y()).norm() < 1e-15, "it runs backwards");
    let curve = |t: f64| Vector3::new(2.0 * t.cos(), 2.0 * t.sin(), 0.0);
    let same = BeamMesh::parametric(&curve, 0.0, 1.5, 6, rule).unwrap();
    for k in 0..7 {
        let error = (same.triads[k] - mesh.triads[k]).amax();
        assert!(error < 1e-11, "tangent by differences off by {error:e}");
    }
    assert!((same.lengths[3] - 0.5).abs() < 1e-11);
}

#[test]
fn rotation_minimizing_frames_do_not_twist() {
    let rule = FrameRule::RotationMinimizing(Vector3::x());
    let twist = |elements: usize| {
        let radius = Vector3::x();
        let mesh =
            BeamMesh::helix(Vector3::zeros(), radius, z(), 6.0, 4.0, elements, rule).unwrap();
        let one = |k: usize| {
            let [a, b] = [mesh.triads[k], mesh.triads[k + 1]];
            0.5 * (a.column(1).dot(&b.column(0)) - a.column(0).dot(&b.column(1)))
        };
        (0..elements).map(one).sum::<f64>().abs()
    };
    let (coarse, fine) = (twist(20), twist(40));
    println!("twist of the frames: {coarse:.1e} with 20, {fine:.1e} with 40 elements");
    assert!(fine < 1e-2 && coarse / fine > 3.5, "order 2: {coarse:e}, {fine:e}");
}

#[test]
fn polylines_and_points() {
    let rule = FrameRule::Normal(z());
    let corners = [Vector3::zeros(), Vector3::x(), Vector3::new(1.0, 2.0, 0.0)];
    let legs = BeamMesh::polyline(&corners, &[2, 4], rule).unwrap();
    assert_eq!((legs[0].elements(), legs[1].elements()), (2, 4));
    assert_eq!(legs[0].centers[2], legs[1].centers[0]);
    let points: Vec<_> = (0..4).map(|k| f64::from(k * k) * Vector3::x()).collect();
    let mesh = BeamMesh::through(&points, rule).unwrap();
    assert!(mesh.lengths == [1.0, 3.0, 5.0] && mesh.triads[3].column(2)[0] == 1.0);
    for parts in [20, 40] {
        let scale = 1.5 / f64::from(parts);
        let at =
            |k: i32| Vector3::new((f64::from(k) * scale).cos(), (f64::from(k) * scale).sin(), 0.0);
        let points: Vec<_> = (0..=parts).map(at).collect();
        let mesh = BeamMesh::spline(&points, 7, rule).unwrap();
        let length: f64 = mesh.lengths.iter().sum();
        let off = mesh.centers.iter().map(|x| (x.norm() - 1.0).abs()).fold(0.0, f64::max);
        println!("spline through {parts} points of an arc: {off:.1e}, {:.1e}", length - 1.5);
        let cubic = f64::from(parts).powi(-3);
        assert!(off < 0.5 * cubic && (length - 1.5).abs() < 2.0 * cubic);
    }
    let along = BeamMesh::straight(Vector3::zeros(), z(), 2, rule).unwrap_err();
    assert_eq!(along, CurveError::NormalAlongTangent { node: 0 });
    let none = BeamMesh::straight(Vector3::zeros(), Vector3::x(), 0, rule).unwrap_err();
    assert_eq!(none, CurveError::NoElements);
    let point = BeamMesh::straight(z(), z(), 3, rule).unwrap_err();
    assert_eq!(point, CurveError::Degenerate { element: 0 });
}
