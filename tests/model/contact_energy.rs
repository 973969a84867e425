//! Contact creates no energy: what rests stays at rest while others are hit, what it rests on is
//! left from rest, and impacts beside it meet it at rest.
#![allow(clippy::unwrap_used)] // a test

use super::contact_motion::ContactMotion;
use crate::benchmark::model;
use holonom::{Sample, Simulation};
use vi_testkit::model::{AXES, along, body_at, heavy, hinge, part};

/// Gravity, m/s².
const DOWN: [f64; 3] = [0.0, 0.0, -9.81];

/// A ball of 1 kg with a radius of 0.1 m.
fn ball(name: &str, x: f64, z: f64) -> String {
    part("body", name)
        + &format!("mass = 1.0\nposition = [{x:?}, 0.0, {z:?}]\n")
        + "shape = { type = \"sphere\", dimensions = [0.1] }\n"
}

/// A contact of the ground with a body.
fn floor(of: &str, keys: &str) -> String {
    part("contact", &format!("floor {of}"))
        + &format!("a = {{ plane = {{}} }}\nb = \"{of}\"\n{keys}\n")
}

/// A ball that bounces for ever, far from everything else: it divides steps.
fn bouncing() -> String {
    ball("bouncing", 5.0, 0.8) + &floor("bouncing", "restitution = 1.0")
}

/// A motion of these parts.
fn moving(settings: &str, parts: &str) -> ContactMotion {
    ContactMotion::of(&(heavy("contact", DOWN, settings) + parts))
}

impl ContactMotion {
    /// The largest rise of the energy in parts of the first one.
    fn relative_rise(&self) -> f64 {
        self.rise() / self.energies[0]
    }

    /// The largest loss likewise.
    fn loss(&self) -> f64 {
        let losses = self.energies.iter().map(|own| self.energies[0] - own);
        losses.fold(0.0, f64::max) / self.energies[0]
    }

    /// By how much coordinates move at most, m.
    fn moves(&self, coordinates: &[usize]) -> f64 {
        let first = &self.samples[0].q;
        let of = |own: &Sample| {
            coordinates.iter().map(|i| (own.q[*i] - first[*i]).abs()).fold(0.0, f64::max)
        };
        self.samples.iter().map(of).fold(0.0, f64::max)
    }
}

/// A ball that lies on the ground beside one that bounces: whatever its law, it lies.
#[test]
fn a_ball_at_rest_is_not_hit_where_another_one_divides_its_step() {
    for method in ["events", "stepping"] {
        for restitution in ["1.0", "0.5", "0.0"] {
            for friction in ["0.0", "0.3"] {
                let keys = format!("restitution = {restitution}\nfriction = {friction}");
                let parts = ball("resting", 0.0, 0.1) + &floor("resting", &keys) + &bouncing();
                let settings = format!("step = 0.005, end = 20.0, contact = \"{method}\"");
                let motion = moving(&settings, &parts);
                let (rise, moves) = (motion.relative_rise(), motion.moves(&[2]));
                println!(
                    "{method}, e = {restitution}, μ = {friction}: rises by {rise:.1e}, moves by \
                     {moves:.1e} m, {} impacts",
                    motion.impacts
                );
                assert!(rise < 1e-13 && motion.loss() < 1e-13, "{rise:e} {:e}", motion.loss());
                assert!(moves < 1e-15 && motion.impacts < 40, "{moves:e} {}", motion.impacts);
            }
        }
    }
}

/// A box that friction holds on a slope, a stack, and a stop that is pressed stay where they are.
#[test]
fn what_is_held_stays_beside_a_ball_that_bounces() {
    let slope = 0.3_f64.atan();
    let normal = [slope.sin(), 0.0, slope.cos()];
    let block = part("body", "box")
        + "mass = 2.0\nshape = { type = \"box\", dimensions = [0.4, 0.3, 0.2] }\n"
        + &format!("position = {:?}\n", normal.map(|x| 0.1 * x))
        + &format!("rotation_vector = [0.0, {slope:?}, 0.0]\n")
        + &part("contact", "slope")
        + &format!("a = {{ plane = {{ normal = {normal:?} }} }}\nb = \"box\"\n")
        + "friction = 0.6\nrestitution = 0.7\n";
    let stack = ball("low", 0.0, 0.1)
        + &ball("high", 0.0, 0.3)
        + &floor("low", "restitution = 1.0")
        + &part("contact", "pair")
        + "a = \"low\"\nb = \"high\"\nrestitution = 1.0\n";
    let stop = body_at([0.5, 0.0, 0.0], "rod", 1.0, [0.001, 0.08, 0.08])
        + &hinge("pin", ["ground", "rod"], [0.0; 3], AXES[1])
        + "limits = { upper = 0.0, restitution = 1.0 }\n";
    for (name, parts, coordinates) in
        [("box", block, &[0, 1, 2][..]), ("stack", stack, &[2, 14]), ("stop", stop, &[0, 2])]
    {
        let motion = moving("step = 0.005, end = 10.0", &(parts + &bouncing()));
        let (rise, moves) = (motion.relative_rise(), motion.moves(coordinates));
        println!("{name}: rises by {rise:.1e}, moves by {moves:.1e} m, {} impacts", motion.impacts);
        assert!(rise < 1e-13 && motion.loss() < 1e-13, "{name}: {rise:e} {:e}", motion.loss());
        assert!(moves < 1e-14 && motion.impacts < 40, "{name}: {moves:e} {}", motion.impacts);
    }
}

/// A ball that bounces on one at rest meets it at rest: no energy is gained or lost by the half of
/// a step that the weight of the lower one has acted.
#[test]
fn what_rests_is_hit_at_rest() {
    for impact in ["newton", "moreau", "sequential"] {
        for beside in [String::new(), bouncing()] {
            let parts = ball("low", 0.0, 0.1)
                + &ball("high", 0.0, 0.6)
                + &floor("low", "restitution = 1.0")
                + &part("contact", "pair")
                + "a = \"low\"\nb = \"high\"\nrestitution = 1.0\n"
                + &beside;
            let settings = format!("step = 0.005, end = 10.0, impact = \"{impact}\"");
            let motion = moving(&settings, &parts);
            let (rise, loss) = (motion.relative_rise(), motion.loss());
            println!(
                "{impact}: rises by {rise:.1e}, falls by {loss:.1e}, {} impacts",
                motion.impacts
            );
            assert!(rise < 1e-13 && loss < 1e-13, "{impact}: {rise:e}, {loss:e}");
        }
    }
}

/// Two balls with a spring between them fall on the ground: whatever the spring, where the lower
/// one is lifted it leaves from rest.
#[test]
fn what_a_spring_lifts_leaves_from_rest() {
    for stiffness in ["1e3", "1e4", "1e5", "1e6", "1e8", "1e10"] {
        for (restitution, method) in [
            ("1.0", "events"),
            ("0.5", "events"),
            ("0.0", "events"),
            ("0.5", "stepping"),
            ("0.0", "stepping"),
        ] {
            let parts = ball("high", 0.0, 1.0)
                + &ball("low", 0.0, 0.7)
                + &along(AXES[2], "prismatic", "guide", ["ground", "high"], [0.0, 0.0, 1.0])
                + &along(AXES[2], "prismatic", "spring", ["high", "low"], [0.0, 0.0, 0.7])
                + &format!("spring = {{ stiffness = {stiffness} }}\n")
                + &floor("low", &format!("restitution = {restitution}"));
            let settings = format!("step = 0.002, end = 2.0, contact = \"{method}\"");
            let motion = moving(&settings, &parts);
            let (rise, loss) = (motion.relative_rise(), motion.loss());
            println!(
                "k = {stiffness}, e = {restitution}, {method}: rises by {rise:.1e}, falls by {loss:.1e}"
            );
            // positions of 1 m are rounded to 1e-16: so is the energy of a spring
            let stiffness: f64 = stiffness.parse().unwrap();
            let rounding = 1e-12 + 1e-20 * stiffness;
            assert!(rise < rounding, "{stiffness:e} {restitution} {method}: {rise:e}");
            // what a spring presses on the ground in a step does not bounce: it is pressed
            let conserves = restitution == "1.0" && stiffness < 1e9;
            assert!(!conserves || loss < rounding, "{stiffness:e}: {loss:e}");
        }
    }
}

/// A ball on a mass that a spring holds, and two rods with a stiff hinge between them on a stop:
/// what they touch is pressed and left, and never gives more than it took.
#[test]
fn what_a_stiff_spring_carries_gains_nothing_from_touches() {
    for stiffness in ["1e3", "1e5", "1e8"] {
        for restitution in ["1.0", "0.5", "0.0"] {
            for method in ["events", "stepping"] {
                let carried = ball("low", 0.0, 1.0)
                    + &ball("high", 0.0, 1.6)
                    + &along(AXES[2], "prismatic", "spring", ["ground", "low"], [0.0, 0.0, 1.0])
                    + &format!("spring = {{ stiffness = {stiffness} }}\n")
                    + &part("contact", "pair")
                    + &format!("a = \"low\"\nb = \"high\"\nrestitution = {restitution}\n");
                let rods = body_at([0.5, 0.0, 1.0], "upper", 1.0, [0.001, 0.08, 0.08])
                    + &body_at([1.5, 0.0, 1.0], "lower", 1.0, [0.001, 0.08, 0.08])
                    + &hinge("pin", ["ground", "upper"], [0.0, 0.0, 1.0], AXES[1])
                    + &format!("limits = {{ upper = 0.3, restitution = {restitution} }}\n")
                    + &hinge("spring", ["upper", "lower"], [1.0, 0.0, 1.0], AXES[1])
                    + &format!("spring = {{ stiffness = {stiffness} }}\n");
                let settings = format!("step = 0.002, end = 4.0, contact = \"{method}\"");
                // rods that turn have energies to the second order of the step
                for (name, parts, most) in [("carried", carried, 1e-11), ("rods", rods, 5e-4)] {
                    let rise = moving(&settings, &parts).relative_rise();
                    println!("{name}, k = {stiffness}, e = {restitution}, {method}: {rise:.1e}");
                    assert!(rise < most, "{name} {stiffness} {restitution} {method}: {rise:e}");
                }
            }
        }
    }
}

/// A load lifts a ball from the ground: it moves from rest as if it had not lain there.
#[test]
fn what_a_load_lifts_leaves_from_rest() {
    let parts = ball("ball", 0.0, 0.1)
        + &floor("ball", "restitution = 0.5\nfriction = 0.3")
        + &part("load", "rope")
        + "body = \"ball\"\nforce = [0.0, 0.0, 30.0]\nhistory = \"select(t - 0.1, 1, 0)\"\n";
    let motion = moving("step = 0.01, end = 0.5", &parts);
    let off = motion.samples.iter().map(|own| {
        let t = (own.t - 0.1).max(0.0);
        (own.q[2] - 0.1 - 0.5 * (30.0 - 9.81) * t * t).abs()
    });
    let off = off.fold(0.0, f64::max);
    println!("off by {off:.1e} m");
    assert!(off < 1e-13, "{off:e}");
}

/// A box that slides and is hit from above slides on: the friction of half a step before an impact
/// belongs to it, and no energy comes from there.
#[test]
fn what_slides_is_hit_as_it_slides() {
    let drop = |x: f64| ball("ball", x, 0.6) + "velocity = [1.0, 0.0, 0.0]\n";
    let block = part("body", "box")
        + "mass = 4.0\nshape = { type = \"box\", dimensions = [2.0, 0.4, 0.2] }\n"
        + "position = [0.0, 0.0, 0.1]\nvelocity = [1.0, 0.0, 0.0]\n"
        + &floor("box", "friction = 0.2\nrestitution = 0.9");
    let pair = part("contact", "pair") + "a = \"box\"\nb = \"ball\"\nrestitution = 0.8\n";
    for method in ["events", "stepping"] {
        let settings = format!("step = 0.002, end = 2.0, contact = \"{method}\"");
        let motion = moving(&settings, &(block.clone() + &drop(-0.2) + &pair));
        let last = motion.samples.last().unwrap();
        println!("{method}: rises by {:.1e}, {} impacts", motion.relative_rise(), motion.impacts);
        assert!(
            motion.relative_rise() < 1e-13 && motion.impacts > 3,
            "{:e}",
            motion.relative_rise()
        );
        assert!((last.q[2] - 0.1).abs() < 1e-12, "{}", last.q[2]);
    }
}

/// A plank on two feet is hit beside them: the far foot is lifted from rest.
#[test]
fn what_an_impact_lifts_leaves_from_rest() {
    for restitution in ["1.0", "0.6", "0.0"] {
        let foot = |x: f64| {
            format!("{{ type = \"sphere\", dimensions = [0.05], position = [{x:?}, 0.0, -0.05] }}")
        };
        let parts = part("body", "plank")
            + "mass = 3.0\ninertia = [0.1, 0.4, 0.4]\nposition = [0.0, 0.0, 0.1]\n"
            + &format!("collision = [{}, {}, ", foot(-0.2), foot(0.2))
            + "{ type = \"box\", dimensions = [1.2, 0.3, 0.04] }]\n"
            + &floor("plank", &format!("restitution = {restitution}"))
            + &ball("ball", 0.5, 0.6)
            + &part("contact", "pair")
            + &format!("a = \"plank\"\nb = \"ball\"\nrestitution = {restitution}\n");
        let motion = moving("step = 0.001, end = 1.0", &parts);
        let lifted = motion.samples.iter().map(|own| own.q[2]).fold(0.0, f64::max) - 0.1;
        println!(
            "e = {restitution}: rises by {:.1e}, lifted by {lifted:.3} m",
            motion.relative_rise()
        );
        assert!(
            motion.relative_rise() < 1e-5 && lifted > 1e-2,
            "{restitution}: {:e}",
            motion.relative_rise()
        );
    }
}

/// A state that is read back continues bit for bit: what is kept closed is part of it.
#[test]
fn what_is_kept_is_of_the_state() {
    let parts = ball("resting", 0.0, 0.1) + &floor("resting", "restitution = 1.0") + &bouncing();
    let model = model(&(heavy("state", DOWN, "step = 0.005, end = 2.0") + &parts), &[]);
    let bits =
        |of: &Simulation| -> Vec<u64> { of.configuration().iter().map(|x| x.to_bits()).collect() };
    let mut whole = Simulation::new(&model).unwrap();
    for step in 0..200 {
        let text = serde_json::to_string(&whole.state()).unwrap();
        let mut second = Simulation::new(&model).unwrap();
        second.resume(serde_json::from_str(&text).unwrap()).unwrap();
        whole.step().unwrap();
        second.step().unwrap();
        assert_eq!(bits(&whole), bits(&second), "from step {step}");
    }
}
