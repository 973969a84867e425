//! Contact against closed forms: a block that rocks, a disk that spins as it rolls, and what long
//! rest and long bouncing leave.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, samples};
use holonom::experiment::RunnableModel;
use holonom::nalgebra::{Rotation3, Vector3};
use holonom::{Sample, Simulation};
use vi_testkit::model::{heavy, part};

const G: f64 = 9.81;

fn run(settings: &str, parts: &str) -> (Vec<Sample>, Simulation) {
    let text = heavy("benchmark", [0.0, 0.0, -G], settings) + parts;
    let mut simulation = Simulation::new(&model(&text, &[])).unwrap();
    let all = samples(&mut simulation);
    (all, simulation)
}

fn floor(of: &str, normal: [f64; 3], keys: &str) -> String {
    part("contact", "floor")
        + &format!("a = {{ plane = {{ normal = {normal:?} }} }}\nb = \"{of}\"\n{keys}\n")
}

/// A block that turns about one of its edges onto the other keeps `1 − 3/2 sin² α` of its rate,
/// with the angle α of its diagonal (Housner 1963). Of a node that is put at the first touch this
/// is the ratio but for the gravity of the half steps beside it.
#[test]
fn a_rocking_block_keeps_its_part_of_the_rate() {
    let (half_width, half_height, tilt): (f64, f64, f64) = (0.1, 0.4, 0.1);
    let (sin, cos) = tilt.sin_cos();
    let center = [half_height * sin - half_width * cos, half_width * sin + half_height * cos];
    let parts = part("body", "block")
        + "mass = 2.0\nshape = { type = \"box\", dimensions = [0.2, 0.3, 0.8] }\n"
        + &format!("position = [{:?}, 0.0, {:?}]\n", center[0], center[1])
        + &format!("rotation_vector = [0.0, {tilt:?}, 0.0]\n")
        + &floor("block", [0.0, 0.0, 1.0], "friction = 0.9");
    let kept = |h: f64, method: &str| {
        let settings = format!("step = {h:?}, end = 0.4, contact = \"{method}\"");
        let all = run(&settings, &parts).0;
        let flat = all[0].energy - 2.0 * G * (center[1] - half_height);
        ((all.last().unwrap().energy - flat) / (all[0].energy - flat)).sqrt()
    };
    let exact = 1.0 - 1.5 * (half_width / half_height).atan().sin().powi(2);
    for method in ["stepping", "events"] {
        let steps = [4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4];
        let found = steps.map(|h| kept(h, method));
        println!("{method}: {found:.5?}, exact {exact:.5}");
        for (h, found) in steps.iter().zip(found) {
            let most = 15.0 * h;
            assert!((found - exact).abs() < most, "{method}, h = {h}: {found} for {exact}");
        }
    }
}

/// A disk that rolls on its rim about its centre, which rests: with the tilt α of a disk of the
/// radius R and the half thickness l the contact goes round with
/// `Ω² sin α (I_t cos α − I_a sin α l/R) = mg (R cos α − l sin α)`, for thin disks
/// `Ω² = 4g/(R sin α)`. Nothing slides, so friction takes nothing away.
#[test]
fn a_disk_rolls_about_its_centre() {
    let (m, r, l) = (0.4, 0.04, 0.003);
    let (along, across) = (0.5 * m * r * r, m * (r * r / 4.0 + l * l / 3.0));
    for tilt in [0.6_f64, 0.3, 0.15] {
        let (sin, cos) = tilt.sin_cos();
        let rate = m * G * (r * cos - l * sin) / (sin * (across * cos - along * sin * l / r));
        let rate = rate.sqrt();
        let down = Vector3::new(cos, 0.0, -sin); // of the disk
        let axis = Vector3::new(sin, 0.0, cos);
        let spin: [f64; 3] = (-(down * r - axis * l) * (rate * sin / r)).into();
        let parts = part("body", "disk")
            + &format!("mass = {m:?}\nposition = [0.0, 0.0, {:?}]\n", r * sin + l * cos)
            + &format!("shape = {{ type = \"cylinder\", dimensions = [{r:?}, {:?}] }}\n", 2.0 * l)
            + &format!("rotation_vector = [0.0, {tilt:?}, 0.0]\nangular_velocity = {spin:?}\n")
            + &floor("disk", [0.0, 0.0, 1.0], "friction = 0.8");
        let off = |h: f64| {
            let (all, run) = run(&format!("step = {h:?}, end = 0.5"), &parts);
            let place = |own: &Sample| Vector3::from_column_slice(&own.q[..3]);
            let moved = all.iter().map(|own| (place(own) - place(&all[0])).norm());
            let energy = all.iter().map(|own| (own.energy / all[0].energy - 1.0).abs());
            let gap = run.contact_counts().unwrap().smallest_gap.unwrap();
            assert!(gap > -1e-14, "gap {gap:e}");
            let last = all.last().unwrap();
            let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), rate * 0.5) * axis;
            let axis = Vector3::from_column_slice(&last.q[9..12]);
            [moved.fold(0.0, f64::max) / r, energy.fold(0.0, f64::max), (axis - turned).norm()]
        };
        let (coarse, fine) = (off(1e-4), off(5e-5));
        println!("tilt {tilt}: {rate:.3} rad/s, off by {coarse:?}, then {fine:?}");
        for (coarse, fine) in coarse.iter().zip(fine) {
            assert!(fine < 0.3 * coarse || fine < 1e-10, "second order: {coarse:e}, {fine:e}");
        }
        assert!(fine[2] < 2e-3, "{fine:?}");
    }
}

/// Steps of a block that rests on a slope, and of a ball that bounces without loss: what is left of
/// them after many, the place of the one and the energy of the other.
#[test]
fn long_rest_and_long_bouncing_leave_rounding() {
    let (sin, cos) = 0.4_f64.sin_cos();
    let block = part("body", "block")
        + "mass = 1.0\nshape = { type = \"box\", dimensions = [0.4, 0.3, 0.2] }\n"
        + &format!(
            "position = [{:?}, 0.0, {:?}]\nrotation_vector = [0.0, 0.4, 0.0]\n",
            0.1 * sin,
            0.1 * cos
        )
        + &floor("block", [sin, 0.0, cos], "friction = 0.5");
    let (all, _) = run("step = 0.001, end = 20.0, every = 1000", &block);
    let moved = all.iter().flat_map(|own| own.q.iter().zip(&all[0].q)).map(|(a, b)| (a - b).abs());
    let moved = moved.fold(0.0, f64::max);
    let ball = part("body", "ball")
        + "mass = 1.0\nposition = [0.0, 0.0, 1.1]\nshape = { type = \"sphere\", dimensions = [0.1] }\n"
        + &floor("ball", [0.0, 0.0, 1.0], "restitution = 1.0");
    let (all, run) = run("step = 0.01, end = 200.0, every = 1000", &ball);
    let energy = all.iter().map(|own| (own.energy / all[0].energy - 1.0).abs());
    let energy = energy.fold(0.0, f64::max);
    let impacts = run.contact_counts().unwrap().impacts;
    println!("20,000 steps: block moved {moved:.1e}; ball off by {energy:.1e}, {impacts} impacts");
    assert!(moved < 1e-14, "{moved:e}");
    assert!(impacts > 200 && energy < 1e-13, "{energy:e}, {impacts}");
}

/// A box on four corners, a sphere, a table with three legs, two boxes side by side: which forces
/// follow from the motion.
#[test]
fn forces_that_are_one_choice_of_many_are_named() {
    let leg = |x: f64, y: f64| {
        format!("{{ type = \"sphere\", dimensions = [0.05], position = [{x:?}, {y:?}, 0.0] }}")
    };
    let table = |legs: &[[f64; 2]]| {
        let legs = legs.iter().map(|[x, y]| leg(*x, *y)).collect::<Vec<_>>().join(", ");
        "mass = 2.0\ninertia = [0.1, 0.2, 0.3]\nposition = [0.0, 0.0, 0.05]\n".to_owned()
            + &format!("collision = [{legs}]\n")
    };
    let cube = "mass = 1.0\nposition = [0.0, 0.0, 0.1]\nshape = { type = \"box\", dimensions = [0.2, 0.3, 0.2] }\n";
    let ball = "mass = 1.0\nposition = [0.0, 0.0, 0.1]\nshape = { type = \"sphere\", dimensions = [0.1] }\n";
    let three = table(&[[0.3, 0.0], [-0.2, 0.25], [-0.2, -0.3]]);
    let four = table(&[[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]]);
    let in_line = table(&[[0.3, -0.1], [0.0, -0.1], [-0.3, -0.1], [0.0, 0.3]]);
    let slides = "velocity = [1.0, 0.0, 0.0]\n";
    for (name, body, friction, expected) in [
        ("a sphere", ball.to_owned(), 0.5, vec!["all"]),
        ("a box", cube.to_owned(), 0.5, vec!["no"; 4]),
        ("a box without friction", cube.to_owned(), 0.0, vec!["no"; 4]),
        ("a box that slides", cube.to_owned() + slides, 0.2, vec!["no"; 4]),
        ("three legs", three.clone(), 0.5, vec!["normal"; 3]),
        ("three legs without friction", three.clone(), 0.0, vec!["all"; 3]),
        ("three legs that slide", three + slides, 0.2, vec!["all"; 3]),
        ("four legs", four, 0.5, vec!["no"; 4]),
        ("three of four in a line", in_line, 0.0, vec!["no", "no", "no", "all"]),
    ] {
        let parts = part("body", "body")
            + &body
            + &floor("body", [0.0, 0.0, 1.0], &format!("friction = {friction:?}"));
        let (all, _) = run("step = 0.001, end = 0.01, contacts = true", &parts);
        for own in &all[1..9] {
            let found: Vec<&str> =
                own.contacts.iter().map(|own| own.unique.map_or("", |own| own.name())).collect();
            assert_eq!(found, expected, "{name}, step {}", own.step);
        }
    }
    // not asked for, not looked for
    let parts = part("body", "body") + ball + &floor("body", [0.0, 0.0, 1.0], "");
    let (all, _) = run("step = 0.001, end = 0.01", &parts);
    assert!(all.iter().flat_map(|own| &own.contacts).all(|own| own.unique.is_none()));
}
