//! Nodes of beams touch as spheres, and joints of beams have stops and dry friction: closed forms,
//! energy, momentum, rest, what is refused.
#![allow(clippy::unwrap_used)] // a test

use super::contact_motion::ContactMotion;
use crate::benchmark::model;
use crate::harness::case::distance;
use crate::harness::models::shipped;
use holonom::{Model, ModelError, Sample, Simulation};
use vi_testkit::model::{beam, changed, head, heavy, part, sensor};

const DOWN: [f64; 3] = [0.0, 0.0, -9.81];
const METHODS: [&str; 2] = ["events", "stepping"];

/// A round section of a plastic, with a radius, m.
fn round(radius: f64, keys: &str) -> String {
    format!(
        "section = {{ shape = {{ type = \"circle\", dimensions = [{radius:?}] }}, \
         material = {{ E = 1e9, nu = 0.3, density = 1200.0 }}{keys} }}\n"
    )
}

/// A rope that is heavy and hardly bends, with a bound of its tension.
const ROPE: &str = "element = \"rope\"\ntension = 20.0\nradius = 0.01\n\
    section = { EA = 1e4, EI1 = 1e-3, EI2 = 1e-3, GJ = 1e-3, rhoA = 0.1, rhoI1 = 1e-6, rhoI2 = 1e-6 }\n";

/// A contact of the ground with a beam, or with nodes.
fn floor(of: &str, keys: &str) -> String {
    part("contact", "floor") + &format!("a = {{ plane = {{}} }}\nb = {of:?}\n{keys}\n")
}

/// The tip of a cantilever rests on a plane: the reaction of a propped beam of Timoshenko,
/// `R = q L (L²/8EI + 1/2kGA)/(L²/3EI + 1/kGA)`, nearly `3/8 q L`.
#[test]
fn a_propped_cantilever_presses_with_the_force_of_its_closed_form() {
    let (radius, nu, young) = (0.01_f64, 0.3_f64, 1e9_f64);
    let area = std::f64::consts::PI * radius * radius;
    let (weight, bending) = (1200.0 * area * 9.81, 0.25 * young * area * radius * radius);
    let factor = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu);
    let shear = factor * area * young / (2.0 * (1.0 + nu));
    let expected = weight * (0.125 / bending + 0.5 / shear) / (1.0 / (3.0 * bending) + 1.0 / shear);
    for method in METHODS {
        for tip in ["beam.end", "beam.4"] {
            let settings = format!("step = 2e-3, end = 4.0, contact = \"{method}\"");
            let text = heavy("prop", DOWN, &settings)
                + &beam("beam", &[[0.0, 0.0, radius], [1.0, 0.0, radius]], 4)
                + "start = \"clamped\"\n"
                + &round(radius, ", damping = 0.02")
                + &floor(tip, "")
                + &sensor("force", "contact_force", "beam.end");
            let motion = ContactMotion::of(&text);
            let force = &motion.last().sensors;
            println!("{method}: {force:?} N of {expected} N, gap {:e} m", motion.smallest_gap);
            assert!((force[2] / expected - 1.0).abs() < 2e-5, "{force:?} {expected}");
            assert!(force[0].abs().max(force[1].abs()) < 1e-12, "{force:?}");
            assert!(motion.smallest_gap > -1e-12, "{:e}", motion.smallest_gap);
        }
    }
}

/// A round rod that slides across its axis is turned by friction until it rolls, with two thirds of
/// its velocity at `v_0/(3 μ g)`: spheres of nodes reach as far as the section, and friction turns
/// their nodes.
#[test]
fn a_rod_that_slides_rolls_with_two_thirds_of_its_velocity() {
    let (radius, friction, v, end) = (0.02, 0.2, 1.0, 0.5);
    let start = v / (3.0 * friction * 9.81);
    let way = v * start - 0.5 * friction * 9.81 * start * start + 2.0 / 3.0 * v * (end - start);
    for method in METHODS {
        let settings = format!("step = 2e-3, end = {end}, contact = \"{method}\"");
        let text = heavy("rod", DOWN, &settings)
            + &beam("rod", &[[0.0, -0.5, radius], [0.0, 0.5, radius]], 2)
            + &format!("velocity = [{v:?}, 0.0, 0.0]\n")
            + &round(radius, "")
            + &floor("rod", &format!("friction = {friction}"))
            + &sensor("at", "position", "rod.1")
            + &sensor("rate", "angular_velocity", "rod.1");
        let motion = ContactMotion::of(&text);
        let found = &motion.last().sensors;
        let (rate, expected) = (found[4], 2.0 / 3.0 * v / radius);
        println!("{method}: {found:?}, {way} m and {expected} rad/s are expected");
        assert!((found[0] / way - 1.0).abs() < 1e-4, "{found:?} {way}");
        assert!((rate / expected - 1.0).abs() < 5e-3, "{rate} {expected}");
        assert!(motion.smallest_gap > -1e-12, "{:e}", motion.smallest_gap);
    }
}

/// A rope falls on the ground and lies there: its energy never rises by more than the second order
/// of the step, no gap is passed, and nothing creeps but for its vibrations.
#[test]
fn a_rope_that_falls_lies_still() {
    for (method, most) in [("events", 1e-4), ("stepping", 1e-5)] {
        let settings = format!("step = 4e-3, end = 3.0, contact = \"{method}\"");
        let text = heavy("rope", DOWN, &settings)
            + &beam("rope", &[[0.0, 0.0, 0.3], [1.0, 0.0, 0.6]], 20)
            + "normal = [0.0, 1.0, 0.0]\n"
            + ROPE
            + &floor("rope.*", "friction = 0.3");
        let motion = ContactMotion::of(&text);
        let (first, rise) = (motion.energies[0], motion.rise());
        let late = &motion.samples[motion.samples.len() - 100];
        let places = |of: &Sample| -> Vec<f64> {
            of.q.chunks_exact(12).flat_map(|own| own[..3].to_vec()).collect()
        };
        let moved = distance(&places(late), &places(motion.last()));
        let gap = motion.smallest_gap;
        println!("{method}: {first} J, rises by {rise:e} J, moved {moved:e} m, gap {gap:e} m");
        assert!(rise < most * first, "{method}: {rise:e} of {first}");
        assert!(gap > -1e-12 && moved < 1e-4, "{gap:e} {moved:e}");
        let rest = motion.last().energies.iter().copied().fold(0.0, f64::max);
        assert!(rest < 0.011 * 1.02, "it lies: {rest} J"); // m g r and a little of its wrinkles
        let heights = motion.last().q.chunks_exact(12).map(|own| own[2]);
        assert!(heights.fold(0.0, f64::max) < 0.03, "all of it lies");
    }
}

/// With material damping the energy of a rope on the ground never rises, and it comes to rest.
#[test]
fn a_damped_rope_comes_to_rest() {
    let damped = changed(ROPE, "rhoI2 = 1e-6", "rhoI2 = 1e-6, damping = 0.02");
    for method in METHODS {
        let settings = format!("step = 4e-3, end = 2.0, contact = \"{method}\"");
        let text = heavy("rope", DOWN, &settings)
            + &beam("rope", &[[0.0, 0.0, 0.05], [0.3, 0.0, 0.15]], 6)
            + "normal = [0.0, 1.0, 0.0]\n"
            + &damped
            + &floor("rope", "friction = 0.3");
        let motion = ContactMotion::of(&text);
        let late = &motion.samples[motion.samples.len() - 50];
        let moved = distance(&late.q, &motion.last().q);
        println!("{method}: rises by {:e} J, moves {moved:e} in 0.2 s", motion.rise());
        assert!(motion.rise() < 1e-14, "{:e}", motion.rise());
        assert!(moved < 1e-4, "{moved:e}");
    }
}

/// A beam without weight hits a free box: both momenta are exact.
#[test]
fn momentum_passes_from_a_beam_to_a_body() {
    for method in METHODS {
        let settings = format!("step = 2e-3, end = 0.5, contact = \"{method}\"");
        let text = heavy("hit", [0.0; 3], &settings)
            + &beam("beam", &[[-0.3, 0.05, 0.3], [0.5, 0.0, 0.35]], 4)
            + "velocity = [0.3, 0.0, -2.0]\nangular_velocity = [0.0, 0.5, 0.0]\n"
            + &round(0.02, "")
            + &part("body", "box")
            + "mass = 0.8\nshape = { type = \"box\", dimensions = [0.4, 0.4, 0.2] }\n"
            + &part("contact", "hit")
            + "a = \"box\"\nb = \"beam\"\nfriction = 0.4\nrestitution = 0.3\n"
            + &sensor("force", "contact_force", "box")
            + &sensor("box", "velocity", "box");
        let text = changed(&text, "\"box\"\ntype = \"velocity\"", "\"speed\"\ntype = \"velocity\"");
        let motion = ContactMotion::of(&text);
        let [first, last] = [&motion.samples[0], motion.last()].map(|own| own.momentum);
        let linear = distance(&first.linear, &last.linear);
        let angular = distance(&first.angular, &last.angular);
        let speed = motion.last().sensors[3..].iter().map(|x| x.abs()).fold(0.0, f64::max);
        println!("{method}: box {speed} m/s, momenta change by {linear:e}, {angular:e}");
        assert!(speed > 0.1, "it is hit: {speed}");
        assert!(linear < 1e-14 && angular < 1e-14, "{linear:e} {angular:e}");
        assert!(motion.rise() < 1e-3 * motion.energies[0], "{:e}", motion.rise());
    }
}

/// A beam on a hinge falls against its stop: the energy never exceeds that of the start, whatever
/// the restitution. With steps that are divided at first touches and parts that have less mass, it
/// rose by 0.18 J.
#[test]
fn a_beam_on_a_hinge_gains_nothing_from_its_stop() {
    for method in METHODS {
        for restitution in [0.0, 0.5, 1.0] {
            for step in [1e-2, 2.5e-3] {
                let settings = format!("step = {step:?}, end = 2.0, contact = \"{method}\"");
                let text = heavy("rod", DOWN, &settings)
                    + &beam("rod", &[[0.0; 3], [1.0, 0.0, 0.0]], 8)
                    + &round(0.003, "")
                    + &vi_testkit::model::hinge(
                        "hinge",
                        ["ground", "rod.start"],
                        [0.0; 3],
                        [0.0, 1.0, 0.0],
                    )
                    + &format!("limits = {{ upper = 0.7, restitution = {restitution:?} }}\n");
                let motion = ContactMotion::of(&text);
                let most = motion.energies.iter().copied().fold(0.0, f64::max);
                let (rise, gap) = (motion.rise(), motion.smallest_gap);
                println!("{method} {restitution} {step}: {most:e} J, rises {rise:e} J, {gap:e}");
                assert!(most < 1e-4 && rise < 4e-3, "{most:e} {rise:e}");
                assert!(gap > -1e-12, "{gap:e}");
                let joints = motion.samples.iter().map(|own| own.residuals.position);
                assert!(joints.fold(0.0, f64::max) < 1e-14);
            }
        }
    }
}

/// A beam whose hinge has dry friction stops, and stays where it is, bit for bit.
#[test]
fn dry_friction_holds_a_beam_on_its_hinge() {
    for method in METHODS {
        let settings = format!("step = 5e-3, end = 6.0, contact = \"{method}\"");
        let text = heavy("rod", DOWN, &settings)
            + &beam("rod", &[[0.0; 3], [0.3, 0.0, 0.0]], 3)
            + &round(0.01, ", damping = 0.02")
            + &vi_testkit::model::hinge(
                "hinge",
                ["ground", "rod.start"],
                [0.0; 3],
                [0.0, 1.0, 0.0],
            )
            + "friction = { torque = 0.06 }\n"
            + &sensor("angle", "joint_coordinate", "hinge");
        let motion = ContactMotion::of(&text);
        let angle = |k: usize| motion.samples[k].sensors[0];
        let count = motion.samples.len();
        let (last, before) = (angle(count - 1), angle(count - 200));
        println!("{method}: rests at {last} rad, {:e}, rises {:e} J", last - before, motion.rise());
        assert!((last - before).abs() < 1e-13 && last > 0.3, "{last} {before}");
        assert!(motion.rise() < 1e-3, "{:e}", motion.rise());
    }
}

/// A slider-crank with a rod of steel strip, whose slider hits a stop: the loop stays closed, the
/// stop is not passed, and it takes out no less than nothing.
#[test]
fn a_flexible_slider_crank_hits_its_stop() {
    let shipped = shipped("flexible_slider_crank");
    let mechanism = shipped.split("[[constraint]]").next().unwrap();
    let mechanism = changed(mechanism, "name = \"shaft\"\n", "name = \"shaft\"\nrate = 10.0\n");
    for method in METHODS {
        for restitution in [0.0, 0.6, 1.0] {
            let limits = format!("limits = {{ lower = -0.05, restitution = {restitution:?} }}");
            let guide = format!("name = \"guide\"\n{limits}\n");
            let text = changed(&mechanism, "name = \"guide\"\n", &guide)
                + &format!(
                    "[simulation]\nstep = 2e-3\nend = 0.5\ncontact = \"{method}\"\n\
                     project_start = true\n"
                );
            let motion = ContactMotion::of(&text);
            let (first, last) = (motion.energies[0], *motion.energies.last().unwrap());
            let most = motion.energies.iter().copied().fold(0.0, f64::max);
            let gap = motion.smallest_gap;
            println!("{method} {restitution}: {first} J to {last} J, at most {most} J, {gap:e} m");
            assert!(most < 1.03 * first && gap > -1e-14, "{most} {gap:e}");
            assert!(last < if restitution < 1.0 { 0.6 } else { 1.02 } * first, "{last}");
            let joints = motion.samples.iter().map(|own| own.residuals.position);
            assert!(joints.fold(0.0, f64::max) < 1e-14);
        }
    }
}

/// A stored state of a rope that hits the ground continues bit for bit.
#[test]
fn a_rope_on_the_ground_continues_bit_for_bit() {
    for method in METHODS {
        let settings = format!("step = 4e-3, end = 1.0, contact = \"{method}\"");
        let text = heavy("rope", DOWN, &settings)
            + &beam("rope", &[[0.0, 0.0, 0.02], [0.5, 0.0, 0.2]], 8)
            + "normal = [0.0, 1.0, 0.0]\n"
            + ROPE
            + &floor("rope", "friction = 0.3\nrestitution = 0.2");
        let model = model(&text, &[]);
        let bits = |of: &Simulation| -> Vec<u64> {
            of.configuration().iter().map(|x| x.to_bits()).collect()
        };
        let mut whole = Simulation::new(&model).unwrap();
        for step in 0..60 {
            let text = serde_json::to_string(&whole.state()).unwrap();
            let mut second = Simulation::new(&model).unwrap();
            second.resume(serde_json::from_str(&text).unwrap()).unwrap();
            whole.step().unwrap();
            second.step().unwrap();
            assert_eq!(bits(&whole), bits(&second), "{method}, from step {step}");
        }
    }
}

/// The first problem of a model, with its remedy.
fn said(text: &str) -> String {
    let problems = match Model::from_toml(text) {
        Err(ModelError::Invalid(problems)) => problems,
        other => panic!("{text} is refused: {other:?}"),
    };
    let first = &problems[0];
    let said = format!("{} | {}", first.message, first.help.clone().unwrap_or_default());
    println!("{said}");
    said
}

#[test]
fn what_cannot_touch_is_refused_with_what_to_write() {
    let two = beam("beam", &[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]], 2);
    let text = head("beams", "step = 0.01, end = 0.1")
        + &two
        + "normal = [0.0, 1.0, 0.0]\n"
        + &vi_testkit::model::soft_section();
    let floor = |of: &str| floor(of, "");
    for (parts, says) in [
        (floor("beam"), "the beam `beam` has no radius | add `radius`, m, to the beam"),
        (floor("beam.7"), "`beam` has no node `7`"),
        (floor("bean.*"), "no body has a name like `bean.*`"),
        (
            part("contact", "own") + "a = \"beam\"\nb = \"beam\"\n",
            "`beam` is a beam: its nodes touch as `b`",
        ),
        (
            part("contact", "own") + "a = \"beam.end\"\nb = \"beam\"\n",
            "`beam.end` is a node of a beam: nodes touch as `b`",
        ),
    ] {
        let said = said(&(text.clone() + &parts));
        assert!(said.contains(says), "{said}");
    }
    let bad = changed(&text, "elements = 2\n", "elements = 2\nradius = -0.1\n");
    assert!(said(&bad).contains("the radius -0.1 m is not positive"));
    for settings in ["scheme = \"em-nodal\"", "order = 4", "start = \"relaxed\""] {
        let text = changed(&text, "elements = 2\n", "elements = 2\nradius = 0.1\n");
        let text = changed(&text, "end = 0.1", &format!("end = 0.1, {settings}"));
        assert!(said(&(text + &floor("beam"))).contains("contacts"), "{settings}");
    }
}

/// Which nodes touch: of a corner one, none that the ground holds, none next to a joint of the two.
#[test]
fn nodes_are_named_once_and_not_beside_their_joints() {
    let of = |b: &str, a: &str| {
        let text = head("beams", "step = 0.01, end = 0.1")
            + &beam("beam", &[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]], 2)
            + "start = \"pinned\"\nradius = 0.05\n"
            + &round(0.02, "")
            + &part("body", "box")
            + "mass = 1.0\nposition = [1.0, 1.4, 1.0]\nshape = { type = \"box\", dimensions = [0.1, 0.1, 0.1] }\n"
            + &vi_testkit::model::joint("fixed", "weld", ["beam.end", "box"], [1.0, 1.0, 1.0])
            + &part("contact", "touch")
            + &format!("a = {a}\nb = {b:?}\n");
        let model = model(&text, &[]);
        let pairs = model.contact_pairs();
        let names: Vec<String> = pairs.iter().map(|own| own.b.name.clone()).collect();
        names.join(" ")
    };
    let plane = "{ plane = {} }";
    assert_eq!(of("beam", plane), "beam.1 beam.2 beam.4 beam.5");
    assert_eq!(of("beam.*", plane), "beam.1 beam.2 beam.4 beam.5");
    assert_eq!(of("beam.3", plane), "beam.2");
    assert_eq!(of("beam.end", plane), "beam.5");
    assert_eq!(of("*", plane), "box");
    assert_eq!(of("beam", "\"box\""), "beam.0 beam.1 beam.2");
}
