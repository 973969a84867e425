//! Small motions of first order: about steady motions of what rolls, slides on a blade or spins,
//! and with continuous states of signals; against closed forms and published numbers.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, samples};
use crate::harness::models::shipped;
use crate::harness::motions::of_map;
use holonom::modes::{About, ModalAnalysis, Mode, ModeKind, Report};
use holonom::{Model, Simulation};
use nalgebra::Complex;
use vi_testkit::model::{body, hinge, joint};

fn report(model: &Model, about: About) -> Report {
    ModalAnalysis::new(model, about).unwrap().modes(50).unwrap()
}

fn value(mode: &Mode) -> Complex<f64> {
    Complex::new(mode.growth - mode.decay, mode.omega)
}

/// All `λ` with `Im λ ≥ 0` that are not zero.
fn values(report: &Report) -> Vec<Complex<f64>> {
    report.modes.iter().filter(|mode| mode.kind != ModeKind::Zero).map(value).collect()
}

fn refusal(model: &Model, about: About) -> String {
    ModalAnalysis::new(model, about).unwrap_err().to_string()
}

fn assert_near(found: Complex<f64>, expected: Complex<f64>, tolerance: f64) {
    println!("{found} expected {expected}, apart {:.1e}", (found - expected).norm());
    assert!((found - expected).norm() < tolerance, "{found} {expected}");
}

/// The weave and the capsize of the benchmark bicycle change their stability at the published
/// speeds.
#[test]
fn a_bicycle_is_stable_between_the_published_speeds() {
    // J. P. Meijaard et al., Proc. R. Soc. A 463 (2007) 1955, §6: 4.29238253634111,
    // 6.02426201538837
    let speeds = [(4.292, 1), (4.2925, 0), (6.024, 0), (6.0245, 1)];
    for (speed, unstable) in speeds {
        let set = [("parameters.v", &*format!("{speed}")), ("parameters.kick", "0.0")];
        let report = report(&shipped_with("bicycle", &set), About::Motion);
        println!("{speed} m/s: {:?}", values(&report));
        assert_eq!(report.unstable, unstable, "{speed} m/s");
        assert_eq!((report.dof, report.zero), (3, 4)); // lean, steer, speed; x, y, both wheels
        assert!(report.warnings.is_empty() && report.residual < 1e-12, "{:?}", report.warnings);
        let motion = report.motion.unwrap();
        assert!((motion.velocity[0] - speed).abs() < 1e-12 && motion.spins.len() == 2);
    }
    let weave = |speed: &str| {
        let set = [("parameters.v", speed), ("parameters.kick", "0.0")];
        values(&report(&shipped_with("bicycle", &set), About::Motion))
    };
    let at_five = weave("5.0");
    assert_near(at_five[0], Complex::new(-0.775_341_882_195_8, 4.464_867_713_788_2), 1e-8);
    assert_near(at_five[1], Complex::new(-0.322_866_429_004_1, 0.0), 1e-8);
    assert_near(at_five[2], Complex::new(-14.078_389_692_798_2, 0.0), 1e-8);
}

fn shipped_with(name: &str, set: &[(&str, &str)]) -> Model {
    model(&shipped(name), set)
}

/// A disc that rolls upright: `J_t λ² … = 0` in lean and yaw.
#[test]
fn an_upright_disc_is_stable_beyond_its_critical_spin() {
    let (m, r, g): (f64, f64, f64) = (1.5, 0.25, 9.81);
    let (axial, across) = (0.5 * m * r * r, 0.25 * m * r * r);
    for spin in [2.0, 3.5, 3.7, 9.0] {
        let spun = format!("{spin:?}");
        let set =
            [("parameters.lean", "0.0"), ("parameters.yaw", "0.0"), ("parameters.fall", "0.0")];
        let set = [&set[..], &[("parameters.spin", &spun)]].concat();
        let report = report(&shipped_with("rolling_disc", &set), About::Motion);
        let square =
            (m * g * r - (axial + m * r * r) * axial * spin * spin / across) / (across + m * r * r);
        let expected = match square > 0.0 {
            true => Complex::new(square.sqrt(), 0.0), // beyond √(g/3R) = 3.617 rad/s it vibrates
            false => Complex::new(0.0, (-square).sqrt()),
        };
        let found = values(&report);
        assert_near(found[0], expected, 1e-9);
        assert_eq!(found.len(), if square > 0.0 { 2 } else { 1 }, "{found:?}");
        assert_eq!(report.unstable, usize::from(square > 0.0));
    }
}

/// A disc that rolls around a circle: the eigenvalue is that of the motion in time, to the order
/// of its steps.
#[test]
fn a_disc_in_a_circle_nutates_as_it_does_in_time() {
    let text = include_str!("../reference/laws/p17_steady_disc.toml");
    let report = report(&model(text, &[]), About::Motion);
    println!("{}; {:?}", report.steady_motion(), values(&report));
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    let rotation = report.rotation.unwrap();
    assert!((rotation.speed - 2.0).abs() < 1e-9 && rotation.axis[2] > 0.999_999);
    // shifts of the whole turn with −Ω in the frame that moves: the other one
    let found = values(&report);
    assert!(found.len() == 2 && (found[0].im - 2.0).abs() < 1e-12, "{found:?}");
    let expected = found[1];
    // disturbed by a hundred thousandth; differences of heights have no mean
    let kicked = text.replace("angular_velocity = [0.0,", "angular_velocity = [1e-5,").replace(
        "velocity = [\"= r*w\", 0.0, 0.0]",
        "velocity = [\"= r*w\", \"= -1e-5*r*cos(lean)\", \"= -1e-5*r*sin(lean)\"]",
    );
    let in_time = |step: f64| {
        let set = [("simulation.step", &*format!("{step:?}")), ("simulation.end", "1.0")];
        let mut run = Simulation::new(&model(&kicked, &set)).unwrap();
        let heights: Vec<f64> = samples(&mut run).iter().map(|sample| sample.q[2]).collect();
        let changes: Vec<_> = heights.windows(2).map(|own| vec![own[1] - own[0]]).collect();
        let stride = (0.05 / step).round() as usize;
        of_map(&changes, stride, stride as f64 * step)[0]
    };
    let errors = [0.01, 0.005].map(|step| (in_time(step) - expected).norm() / expected.norm());
    println!("{expected}: relative errors in time {errors:?}");
    assert!(errors[1] < 2e-3 && errors[0] / errors[1] > 3.5, "{errors:?}");
}

/// Chaplygin's sleigh straight ahead: `λ = −m a u/(J + m a²)`, unstable backwards.
#[test]
fn a_sleigh_is_stable_with_its_blade_behind() {
    let text = include_str!("../reference/laws/p12_sleigh.toml");
    for u in [0.6, -0.6] {
        let set = [("parameters.u", &*format!("{u:?}")), ("parameters.w", "0.0")];
        let report = report(&model(text, &set), About::Motion);
        let found = values(&report);
        assert_eq!(found.len(), 1, "{found:?}");
        let (m, a, j) = (2.0, 0.3, 0.2);
        assert_near(found[0], Complex::new(-m * a * u / (j + m * a * a), 0.0), 1e-10);
        assert_eq!((report.unstable, report.dof), (usize::from(u < 0.0), 2));
    }
}

/// A rotor that spins in elastic bearings nutates and precesses: `J_t λ² ∓ i J_a w λ + k = 0`.
#[test]
fn a_rotor_that_spins_whirls_forwards_and_backwards() {
    let (k, spin) = (900.0, 100.0);
    let text = format!(
        "model = {{ name = \"rotor\" }}\nsimulation = {{ step = 0.001, end = 0.1 }}\n{}\
         angular_velocity = [0.0, 0.0, {spin:?}]\n\
         [[bushing]]\nname = \"bearing\"\nfrom = \"ground\"\nto = \"rotor\"\n\
         position = [0.0, 0.0, 0.0]\nrotation = \"tilt\"\n\
         stiffness = [1e5, 1e5, 1e5, {k:?}, {k:?}, 0.0]\n",
        body("rotor", 2.0, [0.5, 0.5, 0.2])
    );
    let report = report(&model(&text, &[]), About::Motion);
    assert_eq!(report.motion.as_ref().unwrap().spins, [("rotor".to_owned(), spin)]);
    let (axial, across) = (0.2_f64 * spin, 0.5);
    let root = (axial * axial + 4.0 * across * k).sqrt();
    let mut expected =
        [(root - axial) / 1.0, (root + axial) / 1.0, (1e5_f64 / 2.0).sqrt()].to_vec();
    expected.extend([expected[2]; 2]);
    expected.sort_by(f64::total_cmp);
    let found = values(&report);
    println!("{found:?} {expected:?}");
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        // three equal ones part by the root of round-off
        assert!((found.im - expected).abs() < 1e-6 && found.re.abs() < 1e-6, "{found} {expected}");
    }
}

const MASS: &str = r#"
model = { name = "controlled" }
simulation = { step = 0.01, end = 1.0 }
[[body]]
name = "load"
mass = 2.0
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "x"
type = "prismatic"
parent = "ground"
child = "load"
position = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
"#;

/// Every eigenvalue is a root of the characteristic polynomial.
#[test]
fn states_of_signals_join_the_motion() {
    let (m, k, c, tau) = (2.0, 50.0, 3.0, 0.2);
    let law =
        |effort: &str| format!("[[law]]\nname = \"f\"\njoint = \"x\"\neffort = \"{effort}\"\n");
    let signal = |keys: &str| format!("[[signal]]\nname = \"u\"\n{keys}\n");
    // coefficients of λ⁰, λ¹, …
    let cases: [(String, Vec<f64>); 4] = [
        // m λ² (τλ + 1) + k = 0: a spring behind a filter is unstable
        (
            law("-50*u") + &signal("filter = { of = \"x\", time_constant = 0.2 }"),
            vec![k, 0.0, m, tau * m],
        ),
        // m λ² + c λ + k + 20/λ = 0
        (law("-3*v - 50*x - 20*u") + &signal("rate = \"x\""), vec![20.0, k, c, m]),
        // (m λ² + k)(τλ + 1) + c λ = 0: a damper behind a filter of the rate
        (
            law("-50*x - 3*u") + &signal("filter = { of = \"x.rate\", time_constant = 0.2 }"),
            vec![k, tau * k + c, m, tau * m],
        ),
        // (m λ² + k)(λ² + 2λ + 5) + 4 (λ + 3) = 0
        (
            law("-50*x - u")
                + &signal(
                    "transfer = { of = \"4*x\", numerator = [1.0, 3.0], denominator = [1.0, 2.0, 5.0] }",
                ),
            vec![5.0 * k + 12.0, 2.0 * k + 4.0, 5.0 * m + k, 2.0 * m, m],
        ),
    ];
    for (text, polynomial) in cases {
        for about in [About::Start, About::Motion] {
            let report = report(&model(&(MASS.to_owned() + &text), &[]), about);
            assert!(report.warnings.is_empty(), "{:?}", report.warnings);
            let found = values(&report);
            let count: usize = found.iter().map(|value| if value.im > 0.0 { 2 } else { 1 }).sum();
            println!("{found:?}");
            assert_eq!(count, polynomial.len() - 1, "{found:?}");
            for value in found {
                let at = |f: &dyn Fn(f64) -> f64, x: Complex<f64>| {
                    let terms = polynomial.iter().enumerate();
                    terms.map(|(i, a)| x.powu(i as u32) * f(*a)).sum::<Complex<f64>>()
                };
                let size = at(&f64::abs, Complex::new(value.norm(), 0.0)).norm();
                let left = at(&|a| a, value).norm() / size;
                assert!(left < 1e-13, "{value}: {left:e}");
            }
        }
    }
}

/// A controller with an integral that has something to integrate does not rest, and it is said.
#[test]
fn states_that_do_not_rest_are_named() {
    let text = MASS.to_owned()
        + "[[law]]\nname = \"f\"\njoint = \"x\"\neffort = \"-3*v - 50*x - 20*u\"\n\
           [[signal]]\nname = \"u\"\nrate = \"x + 0.1\"\n";
    let report = report(&model(&text, &[]), About::Start);
    println!("{:?}", report.warnings);
    assert!(report.warnings.iter().any(|w| w.contains("do not rest")), "{:?}", report.warnings);
}

/// What has no modes of the kind asked for says so by name.
#[test]
fn motions_that_are_not_steady_are_refused() {
    let upright =
        [("parameters.lean", "0.0"), ("parameters.yaw", "0.0"), ("parameters.fall", "0.0")];
    let disc = shipped_with("rolling_disc", &upright);
    let found = refusal(&disc, About::Rotation);
    assert!(found.contains("depend on the motion"), "{found}");
    let found = refusal(&disc, About::Static);
    assert!(found.contains("depend on the motion"), "{found}");
    let falling = shipped_with("rolling_disc", &[]);
    let found = refusal(&falling, About::Motion);
    assert!(found.contains("`floor` does not let the whole system move steadily"), "{found}");
    // leaning without falling: steady in its velocities, not in its forces
    let leaning = shipped_with("rolling_disc", &[("parameters.fall", "0.0")]);
    let warnings = report(&leaning, About::Motion).warnings;
    assert!(warnings.iter().any(|w| w.contains("the motion is not steady")), "{warnings:?}");
    // a wheel with unequal moments across its axis
    let bicycle = shipped("bicycle").replace("[0.0603, 0.12, 0.0603]", "[0.0603, 0.12, 0.07]");
    let found = refusal(&model(&bicycle, &[("parameters.kick", "0.0")]), About::Motion);
    assert!(found.contains("alike about an axis"), "{found}");
    // a spring to the ground does not move along
    let tied = shipped("rolling_disc")
        + "[[spring]]\nname = \"tie\"\nfrom = \"ground\"\nto = \"disc\"\npoint_from = [1.0, 0.0, 0.25]\n\
           stiffness = 10.0\n";
    let found = refusal(&model(&tied, &upright), About::Motion);
    assert!(found.contains("do not move with the system"), "{found}");
    // a hinge of the ground does not let a body move along
    let hinged = "model = { name = \"arm\" }\nsimulation = { step = 0.01, end = 1.0 }\n".to_owned()
        + &body("arm", 1.0, [0.1, 0.2, 0.3])
        + "velocity = [0.0, 1.0, 0.0]\nangular_velocity = [0.0, 0.0, 1.0]\n"
        + &hinge("pin", ["ground", "arm"], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        + &body("hand", 1.0, [0.1, 0.2, 0.3])
        + "position = [5.0, 0.0, 0.0]\n"
        + &joint("fixed", "held", ["ground", "hand"], [5.0, 0.0, 0.0]);
    let found = refusal(&model(&hinged, &[]), About::Motion);
    assert!(found.contains("not those of a steady motion"), "{found}");
}

/// What rests and may roll has modes at its start.
#[test]
fn a_wheel_on_springs_rolls_to_and_fro() {
    let (m, r, axial, k) = (3.0, 0.25, 0.04, 120.0);
    let text = format!(
        "model = {{ name = \"roller\", gravity = [0.0, 0.0, -9.81] }}\n\
         simulation = {{ step = 0.01, end = 1.0 }}\n{}position = [0.0, 0.0, {r:?}]\n\
         [[constraint]]\nname = \"floor\"\ntype = \"rolling\"\nbody = \"wheel\"\n\
         axis = [0.0, 1.0, 0.0]\nradius = {r:?}\n\
         [[spring]]\nname = \"tie\"\nfrom = \"ground\"\nto = \"wheel\"\n\
         point_from = [-1.0, 0.0, {r:?}]\nstiffness = {k:?}\n",
        body("wheel", m, [0.02, axial, 0.02])
    );
    let report = report(&model(&text, &[]), About::Start);
    let found = values(&report);
    println!("{found:?} {:?}", report.warnings);
    let omega = (k / (m + axial / (r * r))).sqrt();
    let expected = Complex::new(0.0, omega);
    let nearest = found.iter().map(|value| (value - expected).norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-10, "{nearest:e}");
    assert_eq!(report.unstable, 1); // it falls over
}
