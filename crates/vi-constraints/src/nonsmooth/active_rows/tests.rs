//! What a compliance lets a contact pass is told.

use super::*;

/// A contact of a unit mass slides with a compliance about impulses that hold it more: along the
/// normal nothing is given way to, along the tangent `δ`. Coulomb's law of `y + δ` leaves
/// `y_N = −μ|δ_T|`, more than `δ` itself for `μ > 1`; that is the deviation.
#[test]
fn a_compliance_along_the_tangents_passes_a_gap_and_is_told() {
    let (mu, rho, delta, slip) = (1.9, 10.0, 0.1, 0.3);
    let L = SparseRows { ends: &[1, 2, 3], places: &[0, 1, 2], values: &[1.0; 3] };
    let cones = [Cone::Friction { coefficient: mu }];
    let (impulse, given) = ([1.0, -mu, 0.0], [1.0, -mu + rho * delta, 0.0]);
    let y = [-mu * delta, slip + delta, 0.0];
    let w: Vec<f64> = y.iter().zip(impulse).map(|(y, own)| y - own).collect();
    let (mut solver, mut found) = (ConvexSolver::default(), given);
    let report = solver.step(&cones, L, &w, rho, &given, &mut found).unwrap();
    let passed = -(w[0] + found[0]);
    println!("passes by {passed}, steps leave {}, {found:?}", report.left);
    assert!((passed - mu * delta).abs() < 1e-12 && report.left < 0.6 * passed, "{passed}");

    // beside it an impulse that is known, and the dry friction of a joint that slides faster
    let zero = |xi| Drive::Zero { xi, compliance: 0.0 };
    let mut rows = ActiveRows {
        active: vec![KNOWN, 0, 1, 2, 3],
        drives: vec![Drive::Known(1.0), zero(-5.0), zero(w[0] + found[0]), zero(-7.0), zero(0.0)],
        cones: vec![Cone::Bounded { bound: 1.0 }, cones[0]],
        ..ActiveRows::default()
    };
    rows.proximal.left = report.left;
    assert_eq!(rows.deviation(0.0), None); // without a compliance
    rows.proximal.is_compliant = true;
    assert_eq!(rows.deviation(0.0), Some(passed));
    assert_eq!(rows.deviation(0.5), Some(0.5));
}
