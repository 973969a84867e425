//! A modulus and a damping of a cantilever from the motion of its tip, which it left an
//! equilibrium for, or began as drawn.

use super::tests::{exact, found, read, true_values};
use super::{IdentifiedModel, PreparedFit};
use nalgebra::{DMatrix, DVector};
use vi_control::least_squares::Residuals;

const ROD: &str = r#"
model = { name = "rod", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.004, end = 0.4, start = "relaxed" }
measurement = [{ sensor = "tip.z", sigma = 1e-4 }, { sensor = "middle.z", sigma = 1e-4 }]
[parameters]
modulus = 3.0
relaxation = 2.5
[[beam]]
name = "rod"
points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
elements = 4
start = "clamped"
[beam.section]
shape = { type = "circle", dimensions = [0.012] }
material = { E = "= 1e9*modulus", nu = 0.3, density = 1400.0 }
damping = "= 1e-3*relaxation"
[[load]]
name = "pull"
body = "rod.end"
force = [0.0, 0.0, 3.0]
history = { type = "harmonic", frequency = 2.0, phase = 0.4 }
[[sensor]]
name = "tip"
type = "position"
of = "rod.end"
[[sensor]]
name = "middle"
type = "position"
of = "rod.2"
[identify]
parameters = { modulus = { start = 2.4, min = 0.1 }, relaxation = { start = 4.0, min = 0.0 } }
"#;

#[test]
fn modulus_and_damping_follow_from_the_motion_of_a_tip() {
    for text in [ROD.to_owned(), ROD.replace(", start = \"relaxed\"", "")] {
        let (source, model) = read(&text);
        let IdentifiedModel { estimate, .. } = found(&text, &exact(&model)).unwrap();
        assert_eq!(estimate.outcome, "converged", "{estimate:?}");
        for (own, wanted) in estimate.parameters.iter().zip(true_values(&model, &source)) {
            let off = (own.value / wanted - 1.0).abs();
            println!("{}: {} for {wanted}, {off:.1e}", own.name, own.value);
            assert!(off < 1e-7 && (own.start / wanted - 1.0).abs() > 0.1, "{}: {off:e}", own.name);
        }
        assert!(estimate.is_sound());
    }
}

/// Of positions; of a section force within an element and of a velocity, which inertia and the mass
/// that steps add enter.
#[test]
fn residuals_of_a_beam_have_their_derivatives() {
    let inner = ROD
        .replace("sensor = \"middle.z\", sigma = 1e-4", "sensor = \"inner.M2\", sigma = 1e-3")
        + "[[sensor]]\nname = \"inner\"\ntype = \"section_force\"\nof = \"rod\"\nat = 0.35\n";
    let rate =
        ROD.replace("type = \"position\"\nof = \"rod.2\"", "type = \"velocity\"\nof = \"rod.2\"");
    let drawn = ROD.replace(", start = \"relaxed\"", "");
    // the last node has the accelerations of its state, which the stiffness of the rod rounds
    for (text, allowed) in [(ROD.to_owned(), 1e-7), (drawn, 1e-7), (inner, 3e-6), (rate, 1e-7)] {
        let (source, model) = read(&text);
        let data = exact(&model);
        let mut prepared = PreparedFit::new(&source, &[], &model, &data).unwrap();
        let theta: Vec<f64> = prepared.parameters.iter().map(|own| own.start).collect();
        let count = prepared.residuals.len();
        let (mut out, mut jacobian) = (vec![0.0; count], DMatrix::zeros(count, theta.len()));
        prepared.residuals.evaluate(&theta, &mut out, Some(&mut jacobian)).unwrap();
        for k in 0..theta.len() {
            let mut at = |e: f64| {
                let (mut theta, mut out) = (theta.clone(), vec![0.0; count]);
                theta[k] += e;
                prepared.residuals.evaluate(&theta, &mut out, None).unwrap();
                DVector::from_vec(out)
            };
            let mut central = |e: f64| (at(e) - at(-e)) / (2.0 * e);
            let wanted = (central(1e-3) * 4.0 - central(2e-3)) / 3.0;
            let off = (jacobian.column(k) - &wanted).amax() / wanted.amax();
            println!("{}: {off:.1e} of {:.1e}", prepared.parameters[k].name, wanted.amax());
            assert!(off < allowed, "{off:e}");
        }
    }
}
