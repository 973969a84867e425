//! Start velocities stated as joint rates.

#![allow(clippy::unwrap_used)] // a test

use holonom::{Model, Override, Simulation};
use nalgebra::Vector3;
use vi_testkit::model::{AXES, along, body_at, heavy, hinge, joint, sensor};

const ARM: &str = include_str!("../models/rated_arm.toml");

#[test]
fn velocities_follow_from_rates() {
    let mut simulation = Simulation::new(&Model::from_toml(ARM).unwrap()).unwrap();
    let report = simulation.assembly();
    assert!(report.closure.velocity < 1e-14, "{:?}", report.closure);
    let v = simulation.integrator().initial_velocity().to_vec();
    let spin = Vector3::new(-1.5, 0.0, 2.0); // of slide and hand
    let slide = Vector3::new(0.3, 2.0, 0.0); // 2 rad/s about z at (1, 0), and along the guide
    let hand = slide + spin.cross(&Vector3::new(1.0, 0.3, 0.0));
    for (body, expected) in [(0, Vector3::zeros()), (1, slide), (2, hand)] {
        let found = Vector3::from_column_slice(&v[12 * body..12 * body + 3]);
        println!("body {body}: {found:?}");
        assert!((found - expected).amax() < 1e-14, "body {body}: {found} {expected}");
    }
}

#[test]
fn rates_where_they_cannot_be_used_are_refused() {
    for (change, to, needle) in [
        ("rate = 2.0", "rate = [2.0, 1.0]", "2 rate(s) for 1 degree(s) of freedom"),
        ("name = \"wrist\"", "name = \"wrist\"\nrate = 1.0", "fixed joint has no rates"),
        (
            "parent = \"base\"\nchild = \"slide\"",
            "parent = \"slide\"\nchild = \"base\"",
            "outboard",
        ),
        ("position = [1, 0, 1]", "position = [1, 0, 1]\nvelocity = [0.3, 2, 0]", "stated twice"),
    ] {
        let text = ARM.replacen(change, to, 1);
        let error = Simulation::new(&Model::from_toml(&text).unwrap()).map(|_| ()).unwrap_err();
        println!("{error}");
        assert!(error.to_string().contains(needle), "{error}");
    }
}

/// The initial velocities of a model, one vector for each frame: translation, then rotation by its
/// directors.
fn initial_velocities(text: &str) -> Vec<f64> {
    let mut simulation = Simulation::new(&Model::from_toml(text).unwrap()).unwrap();
    let closure = simulation.assembly().closure;
    assert!(closure.velocity < 1e-12, "{closure:?}");
    simulation.integrator().initial_velocity().to_vec()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

const ROTOR: &str = include_str!("../hostile/rotor_blade.toml");

#[test]
fn a_beam_moves_with_what_it_is_fixed_to() {
    let stated = initial_velocities(ROTOR);
    let own = "angular_velocity = [0.0, 0.0, 20.0]\nvelocity = [-0.0, 6.0, 0.0]\n";
    let silent = ROTOR.replacen(own, "", 1);
    assert_ne!(silent, ROTOR);
    let off = apart(&stated, &initial_velocities(&silent));
    println!("a blade on a hub of 20 rad/s: velocities off by {off:.1e}");
    assert!(off < 1e-12, "{off:e}");
    // a mass at its tip moves along
    let tip = [
        silent.as_str(),
        "\n",
        &body_at([5.0, 0.0, 0.0], "mass", 1.0, [0.1; 3]),
        &joint("fixed", "weld", ["blade1.end", "mass"], [5.0, 0.0, 0.0]),
    ]
    .concat();
    let v = initial_velocities(&tip);
    assert!((v[13] - 100.0).abs() < 1e-10, "{}", v[13]); // 5 m at 20 rad/s along y
    // a hub that flies freely and states its own velocities, no rates
    let free =
        silent.replacen("name = \"hub\"", "name = \"hub\"\nangular_velocity = [0, 0, 20]", 1);
    let mast = free.find("[[joint]]").unwrap();
    let blade = free.find("[[beam]]").unwrap();
    let free = format!("{}{}", &free[..mast], &free[blade..]);
    let off = apart(&stated, &initial_velocities(&free));
    println!("a blade on a free hub: velocities off by {off:.1e}");
    assert!(off < 1e-12, "{off:e}");
}

#[test]
fn a_joint_rate_moves_a_beam() {
    let text = include_str!("../models/rated_beam.toml");
    let v = initial_velocities(text);
    for (k, node) in v.chunks_exact(12).enumerate() {
        let expected = 3.0 * 0.5 * k as f64;
        assert!((node[1] - expected).abs() < 1e-14, "node {k}: {} {expected}", node[1]);
    }
}

/// A slider-crank in the plane x–z: crank 0.3 m, rod 0.5 m, slider along x; only the crank states
/// its rate.
fn slider_crank(rod_rate: &str, more: &str) -> String {
    [
        heavy("slider crank", [0.0, 0.0, -9.81], "step = 1e-3, end = 0.2"),
        body_at([0.0, 0.0, 0.15], "crank", 1.0, [1e-3, 1e-2, 1e-2]),
        "rotation_vector = [0, -1.5707963267948966, 0]\n".into(),
        body_at([0.2, 0.0, 0.15], "rod", 2.0, [1e-3, 4e-2, 4e-2]),
        "rotation_vector = [0, 0.6435011087932844, 0]\n".into(),
        body_at([0.4, 0.0, 0.0], "slider", 1.5, [1e-3; 3]),
        hinge("shaft", ["ground", "crank"], [0.0; 3], AXES[1]) + "rate = 6.25\n",
        hinge("pin", ["crank", "rod"], [0.0, 0.0, 0.3], AXES[1]) + rod_rate + "\n",
        joint("spherical", "wrist", ["rod", "slider"], [0.4, 0.0, 0.0]),
        along(AXES[0], "prismatic", "guide", ["ground", "slider"], [0.4, 0.0, 0.0]),
        sensor("speed", "joint_rate", "shaft"),
        sensor("slip", "joint_rate", "guide") + more + "\n",
    ]
    .concat()
}

#[test]
fn stated_rates_are_kept_where_initial_values_are_projected() {
    for scheme in ["nodal", "dalembert", "em-nodal"] {
        let overrides = [
            Override::new("simulation.project_start", "true"),
            Override::new("simulation.scheme", format!("\"{scheme}\"")),
        ];
        let text = slider_crank("", "");
        let mut model = Model::from_toml_with(&text, &overrides).unwrap();
        model.settings.end = 0.01;
        let mut simulation = Simulation::new(&model).unwrap();
        let warnings = simulation.warnings().join("\n");
        let first = simulation.samples().next().unwrap().unwrap();
        let [speed, slip] = first.sensors[..] else { panic!() };
        // x = √(l² − r² cos²θ) + r sin θ at θ = 0: ẋ = r θ̇
        println!("{scheme}: crank {speed} rad/s, slider {slip} m/s\n{warnings}");
        assert!((speed - 6.25).abs() < 1e-12 && (slip - 0.3 * 6.25).abs() < 1e-12);
        assert!(warnings.contains("`slider` by 1.875 m/s"));
        assert!(warnings.contains("stated rates of joints are kept"));
    }
}

#[test]
fn rates_that_the_constraints_forbid_are_refused_by_name() {
    let overrides = [Override::new("simulation.project_start", "true")];
    let model = Model::from_toml_with(&slider_crank("rate = 3.0", ""), &overrides).unwrap();
    let error = Simulation::new(&model).expect_err("two rates of one degree of freedom");
    println!("{error:?}");
    let text = format!("{error:?}");
    assert!(text.contains("the rates that the joints state cannot all be kept"), "{text}");
    assert!((text.contains("shaft") || text.contains("pin")) && text.contains("state fewer rates"));
    // the rate that the constraints give is accepted
    let fits = slider_crank("rate = -6.25", "");
    assert!(Simulation::new(&Model::from_toml_with(&fits, &overrides).unwrap()).is_ok());
}
