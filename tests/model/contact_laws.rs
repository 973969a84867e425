//! Laws of contacts beside the usual ones: static friction, Moreau's impacts, impacts one after the
//! other.

use holonom::experiment::RunnableModel;
use holonom::{Model, Sample, Simulation};
use vi_testkit::Sample as Random;
use vi_testkit::model::{changed, heavy, part};

const DOWN: [f64; 3] = [0.0, 0.0, -9.81];

fn samples(text: &str) -> (Vec<Sample>, holonom::Simulation) {
    let model = Model::from_toml(text).unwrap_or_else(|error| panic!("{text}\n{error}"));
    let mut simulation = Simulation::new(&model).unwrap();
    let all = simulation.samples().map(|own| own.unwrap()).collect();
    (all, simulation)
}

fn last(text: &str) -> Sample {
    samples(text).0.pop().unwrap()
}

/// A block of four corners on a slope; `velocity` along it, uphill.
fn block(angle: f64, velocity: f64, friction: &str) -> String {
    let (s, c) = angle.sin_cos();
    heavy("block", DOWN, "step = 0.005, end = 1.0")
        + &part("body", "block")
        + "mass = 2.0\nshape = { type = \"box\", dimensions = [0.4, 0.3, 0.2] }\n"
        + &format!("position = [{:?}, 0.0, {:?}]\n", -0.1 * s, 0.1 * c)
        + &format!("rotation_vector = [0.0, {:?}, 0.0]\n", -angle)
        + &format!("velocity = [{:?}, 0.0, {:?}]\n", velocity * c, velocity * s)
        + &part("contact", "slope")
        + &format!("a = {{ plane = {{ normal = [{:?}, 0.0, {c:?}] }} }}\nb = \"block\"\n", -s)
        + friction
        + "\n"
}

fn along(sample: &Sample, first: &Sample, angle: f64) -> f64 {
    let (s, c) = angle.sin_cos();
    (sample.q[0] - first.q[0]) * c + (sample.q[2] - first.q[2]) * s
}

/// Held by static friction, loose above it, and then slowed by the other one alone.
#[test]
fn static_friction_holds_what_sticks() {
    let both = "friction = 0.3\nstatic_friction = 0.45";
    for (slope, friction, holds) in [
        (0.4_f64, both, true),
        (0.4, "friction = 0.3", false),
        (0.5, both, false),
        (0.5, "friction = 0.3\nstatic_friction = 0.55", true),
    ] {
        let angle = slope.atan();
        let (all, _) = samples(&block(angle, 0.0, friction));
        let way = along(all.last().unwrap(), &all[0], angle);
        let slides = -0.5 * 9.81 * (angle.sin() - 0.3 * angle.cos());
        let expected = if holds { 0.0 } else { slides };
        println!("slope {slope}, {friction:?}: {way} against {expected}");
        assert!((way - expected).abs() < 1e-11, "{way} against {expected}");
    }
    // up the slope it slides by the coefficient of sliding, stops, and is held by the other one
    let angle = 0.4_f64.atan();
    let (all, _) = samples(&block(angle, 1.5, both));
    let deceleration = 9.81 * (angle.sin() + 0.3 * angle.cos());
    let way = along(all.last().unwrap(), &all[0], angle);
    assert!((way - 1.5 * 1.5 / (2.0 * deceleration)).abs() < 1e-4, "{way}");
    let (before, after) = (&all[120], all.last().unwrap());
    assert!(along(after, before, angle).abs() < 1e-13, "it creeps");
    let back = along(&last(&block(angle, 1.5, "friction = 0.3")), &all[0], angle);
    assert!(back < way - 0.05, "without static friction it slides back: {back}");
}

/// Held, loose, sliding, held again: a block that a spring pulls jerks along.
fn jerks(ratio: f64) -> String {
    heavy("jerks", DOWN, "step = 0.002, end = 4.0")
        + &part("body", "block")
        + "mass = 2.0\nshape = { type = \"box\", dimensions = [0.4, 0.3, 0.2] }\nposition = [0.0, 0.0, 0.1]\n"
        + &part("body", "hand")
        + "mass = 1.0\ninertia = [1.0, 1.0, 1.0]\nposition = [1.0, 0.0, 0.1]\nvelocity = [0.1, 0.0, 0.0]\n"
        + &part("joint", "guide")
        + "type = \"prismatic\"\nparent = \"ground\"\nchild = \"hand\"\nposition = [0.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\n"
        + &part("constraint", "pull")
        + "type = \"motion\"\njoint = \"guide\"\npath = { rate = 0.1 }\n"
        + &part("spring", "spring")
        + "from = \"block\"\nto = \"hand\"\nstiffness = 100.0\nnatural_length = 1.0\n"
        + &part("contact", "floor")
        + &format!(
            "a = {{ plane = {{}} }}\nb = \"block\"\nfriction = 0.3\nstatic_friction = {:?}\n",
            0.3 * ratio
        )
}

/// It breaks loose where the spring pulls by the static friction, and slides by half a period of
/// the spring.
#[test]
fn a_block_on_a_spring_jerks() {
    let (all, _) = samples(&jerks(1.5));
    let weight = 2.0 * 9.81;
    let (hold, slide) = (0.45 * weight, 0.3 * weight);
    let loose = all.iter().find(|own| own.q[0].abs() > 1e-6).unwrap().t;
    let expected = hold / (100.0 * 0.1);
    println!("loose at {loose} s, {expected} s");
    assert!((loose - expected).abs() < 0.01, "{loose} against {expected}");
    // with the hand that moves on: x = A (1 − cos ωt) + …, to the stop where ẋ = 0
    let (omega, v) = ((100.0_f64 / 2.0).sqrt(), 0.1);
    let excess = (hold - slide) / 100.0;
    let mut t = 0.0; // ẋ = excess ω sin ωt + v (1 − cos ωt) = 0
    let rate = |t: f64| excess * omega * (omega * t).sin() + v * (1.0 - (omega * t).cos());
    while rate(t + 1e-5) > 0.0 || t < 1e-3 {
        t += 1e-5;
    }
    let way = v * t - excess * (omega * t).cos() + excess - v / omega * (omega * t).sin();
    let stays = all.iter().find(|own| own.t > loose + t + 0.05).unwrap().q[0];
    println!("slides by {stays} m, {way} m in {t} s");
    assert!((stays - way).abs() < 2e-3 * way, "{stays} against {way}");
    let again = all.iter().find(|own| (own.t - loose - t - 0.2).abs() < 1e-3).unwrap();
    assert!((again.q[0] - stays).abs() < 1e-12, "held again");
}

/// A state that is read back continues bit for bit, also while static friction holds.
#[test]
fn what_sticks_is_of_the_state() {
    let text = changed(&jerks(1.5), "end = 4.0", "end = 1.2");
    let model = Model::from_toml(&text).unwrap();
    for stop in [100, 300, 450, 480] {
        let mut whole = Simulation::new(&model).unwrap();
        let mut first = Simulation::new(&model).unwrap();
        for _ in 0..stop {
            whole.step().unwrap();
            first.step().unwrap();
        }
        let text = serde_json::to_string(&first.state()).unwrap();
        let mut second = Simulation::new(&model).unwrap();
        second.resume(serde_json::from_str(&text).unwrap()).unwrap();
        for _ in stop..600 {
            whole.step().unwrap();
            second.step().unwrap();
        }
        let bits = |of: &Simulation| -> Vec<u64> {
            of.configuration().iter().map(|x| x.to_bits()).collect()
        };
        assert_eq!(bits(&whole), bits(&second), "from step {stop}");
    }
}

/// A slider with a constant force: held up to the ratio, then as with the plain friction.
#[test]
fn static_friction_of_joints() {
    let cart = |friction: &str, rate: f64| {
        heavy("cart", [3.0 / 2.0, 0.0, 0.0], "step = 0.01, end = 1.0")
            + &part("body", "cart")
            + "mass = 2.0\ninertia = [1.0, 1.0, 1.0]\n"
            + &part("joint", "slide")
            + "type = \"prismatic\"\nparent = \"ground\"\nchild = \"cart\"\nposition = [0.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\n"
            + &format!("rate = {rate:?}\nfriction = {{ force = 2.5{friction} }}\n")
    };
    for (friction, rate, expected) in [
        (", static_ratio = 1.3", 0.0, 0.0),
        (", static_ratio = 1.1", 0.0, 0.125),
        ("", 0.0, 0.125),
        (", static_ratio = 1.3", 0.2, 0.325),
        (", static_ratio = 1.3", -1.1, -1.1 * 1.1 / (2.0 * 2.75)),
    ] {
        let found = last(&cart(friction, rate)).q[0];
        println!("{friction:?}, rate {rate}: {found} against {expected}");
        let tolerance = if rate < 0.0 { 1e-4 } else { 1e-12 };
        assert!((found - expected).abs() < tolerance, "{found} against {expected}");
    }
    for (friction, words) in [
        (", static_ratio = 0.9", "static friction is 0.9 of that of sliding"),
        (
            ", static_ratio = 1.2, model = { type = \"stribeck\", transition_velocity = 0.01 }",
            "smooth friction has a ratio of its own",
        ),
    ] {
        let error = Model::from_toml(&cart(friction, 0.0)).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn what_static_friction_may_not_be_is_said() {
    for (friction, words) in [
        ("friction = 0.3\nstatic_friction = 0.2", "below that of sliding"),
        ("friction = 0.3\nstatic_friction = nan", "not a number"),
        ("static_friction = 0.2", "without friction nothing sticks"),
        (
            "friction = 0.3\nstatic_friction = 0.4\nmodel = { type = \"hunt_crossley\", stiffness = 1e4, transition_velocity = 0.01 }",
            "a contact with a `model` never sticks",
        ),
    ] {
        let error = Model::from_toml(&block(0.1, 0.0, friction)).unwrap_err().to_string();
        assert!(error.contains(words), "{friction}: {error}");
    }
}

/// Three balls that touch; the first one comes in with 2 m/s.
fn cradle(impact: &str, restitution: f64) -> [f64; 3] {
    let ball = |name: &str, x: f64, v: f64| {
        part("body", name)
            + &format!("mass = 1.0\nposition = [{x:?}, 0.0, 0.0]\nvelocity = [{v:?}, 0.0, 0.0]\n")
            + "shape = { type = \"sphere\", dimensions = [0.1] }\n"
    };
    let text = heavy("cradle", [0.0; 3], &format!("step = 0.01, end = 0.2, impact = \"{impact}\""))
        + &ball("a", -0.4, 2.0)
        + &ball("b", 0.0, 0.0)
        + &ball("c", 0.2, 0.0)
        + &part("contact", "balls")
        + &format!("a = \"*\"\nb = \"*\"\nrestitution = {restitution:?}\n");
    let (all, _) = samples(&text);
    let [one, two] = [all.len() - 2, all.len() - 1].map(|k| &all[k]);
    [0, 12, 24].map(|i| (two.q[i] - one.q[i]) / 0.01)
}

#[test]
fn impacts_one_after_the_other_are_those_of_the_toy() {
    for (impact, restitution, expected) in [
        ("newton", 1.0, [-2.0 / 3.0, 4.0 / 3.0, 4.0 / 3.0]),
        ("moreau", 1.0, [-2.0 / 3.0, 4.0 / 3.0, 4.0 / 3.0]),
        ("sequential", 1.0, [0.0, 0.0, 2.0]),
        ("newton", 0.0, [2.0 / 3.0; 3]),
        // 2 → (0.5, 1.5, 0) → (0.5, 0.375, 1.125) → …
        ("sequential", 0.5, [0.40625, 0.46875, 1.125]),
    ] {
        let found = cradle(impact, restitution);
        println!("{impact}, e = {restitution}: {found:?}");
        let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-10, "{impact}: {found:?} against {expected:?}");
    }
}

/// A spinning ball that grips: after Moreau its slip is thrown back by `e`, too.
#[test]
fn after_moreau_what_grips_is_thrown_back() {
    let text = heavy("ball", [0.0; 3], "step = 0.01, end = 0.4, impact = \"moreau\"")
        + &part("body", "ball")
        + "mass = 2.0\ninertia = [0.04, 0.04, 0.04]\nposition = [0.0, 0.0, 0.6]\nvelocity = [1.0, 0.0, -2.0]\n"
        + "angular_velocity = [0.0, -4.0, 1.0]\nshape = { type = \"sphere\", dimensions = [0.2] }\n"
        + &part("contact", "floor")
        + "a = { plane = {} }\nb = \"ball\"\nfriction = 1.5\nrestitution = 0.6\n";
    let end = last(&text);
    let slip = 1.0 - 0.2 * -4.0;
    let impulse = -1.6 * slip / (0.5 + 0.2 * 0.2 / 0.04);
    let (hit, t) = (0.2, 0.4);
    let x = t + impulse / 2.0 * (t - hit);
    println!("{} against {x}", end.q[0]);
    assert!((end.q[0] - x).abs() < 1e-11, "{} against {x}", end.q[0]);
    assert!((end.q[2] - (0.2 + 1.2 * (t - hit))).abs() < 1e-11);
    let stated =
        changed(&text, "restitution = 0.6", "restitution = 0.6\ntangential_restitution = 0.2");
    let error = Model::from_toml(&stated).unwrap_err().to_string();
    assert!(error.contains("after Moreau the tangential restitution is that of the normal"));
}

/// Boxes and rods that tumble onto a floor with friction and much restitution: no impact gains
/// energy, nothing is passed, and what bounces comes to rest.
#[test]
fn no_law_of_impacts_gains_energy() {
    for impact in ["moreau", "sequential"] {
        let (mut impacts, mut rest) = (0, 0);
        for seed in 0..10 {
            let mut sample = Random::new(seed);
            let mut number = || sample.number();
            let size = [0; 3].map(|_| 0.2 * 10.0_f64.powf(0.5 * number()));
            let turned = [0; 3].map(|_| 3.0 * number());
            let spin = [0; 3].map(|_| 5.0 * number());
            let (friction, restitution) = (0.6 + 0.5 * number(), 0.5 + 0.45 * number());
            let method = ["events", "stepping"][seed as usize % 2];
            let settings = format!(
                "step = 0.002, end = 1.5, contact = \"{method}\", contacts = true, impact = \"{impact}\""
            );
            let text = heavy("brick", DOWN, &settings)
                + &part("body", "brick")
                + &format!(
                    "shape = {{ type = \"box\", dimensions = {size:?}, density = 800.0 }}\n"
                )
                + &format!("position = [0.0, 0.0, {:?}]\n", 0.05 + 0.5 * size.iter().sum::<f64>())
                + &format!("rotation_vector = {turned:?}\nangular_velocity = {spin:?}\n")
                + &part("contact", "floor")
                + "a = { plane = {} }\nb = \"brick\"\n"
                + &format!("friction = {friction:?}\nrestitution = {restitution:?}\n");
            let (all, simulation) = samples(&text);
            let counts = simulation.contact_counts().unwrap();
            // that of the weight in half a step, where a body comes to rest
            let half_step = 0.5 * 800.0 * size.iter().product::<f64>() * (0.002_f64 * 9.81).powi(2);
            assert!(counts.largest_work <= half_step, "{impact} {seed}: {counts:?}");
            assert!(counts.smallest_gap.unwrap() >= -1e-12, "{impact} {seed}: {counts:?}");
            impacts += counts.impacts;
            rest += usize::from(all.last().unwrap().contacts.len() == 4);
        }
        println!("{impact}: {impacts} impacts, {rest} of 10 stand on four corners");
        assert!(impacts > 50 && rest > 0);
    }
}

/// What rests has no kinetic energy, what slides that of its velocity: also at the first node, and
/// where steps are divided by touches of others.
#[test]
fn energies_of_nodes_are_those_of_their_velocities() {
    let slope = 0.4_f64.atan();
    let rest = block(slope, 0.0, "friction = 0.5");
    let slides = block(slope, 0.0, "friction = 0.3");
    let bouncing = part("body", "ball")
        + "mass = 1.0\nshape = { type = \"sphere\", dimensions = [0.1] }\nposition = [5.0, 0.0, 0.6]\n"
        + &part("contact", "tray")
        + "a = { plane = {} }\nb = \"ball\"\nrestitution = 1.0\n";
    let rate = 9.81 * (slope.sin() - 0.3 * slope.cos());
    for (text, of) in [
        (rest.clone() + &bouncing, 0.0),
        (slides.clone() + &bouncing, rate),
        (rest, 0.0),
        (slides, rate),
    ] {
        let text = changed(&text, "step = 0.005, end = 1.0", "step = 0.005, end = 0.6");
        let model = Model::from_toml(&text).unwrap();
        let mut simulation = Simulation::new(&model).unwrap();
        let columns = simulation.energy_columns().to_vec();
        let at = |name: &str| columns.iter().position(|own| own == name).unwrap();
        let (kinetic, work, balance) = (at("kinetic"), at("work.slope"), at("balance"));
        let all: Vec<Sample> = simulation.samples().map(|own| own.unwrap()).collect();
        for own in &all {
            let (v, t) = (of * own.t, own.t);
            let ball = own.q.get(14).map_or(0.0, |z| 9.81 * (0.6 - z));
            let expected = 0.5 * 2.0 * v * v + ball;
            let found = own.energies[kinetic];
            assert!((found - expected).abs() < 1e-10, "t = {t}: {found} against {expected}");
            let way = 0.5 * of * t * t;
            let taken = -0.3 * 2.0 * 9.81 * slope.cos() * way * if of > 0.0 { 1.0 } else { 0.0 };
            let found = own.energies[work];
            assert!((found - taken).abs() < 1e-10, "t = {t}: {found} against {taken}");
            assert!(own.energies[balance].abs() < 1e-9);
        }
    }
    let cart = heavy("cart", [0.0; 3], "step = 0.01, end = 0.5")
        + &part("body", "cart")
        + "mass = 2.0\ninertia = [1.0, 1.0, 1.0]\n"
        + &part("joint", "slide")
        + "type = \"prismatic\"\nparent = \"ground\"\nchild = \"cart\"\nposition = [0.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\n"
        + "rate = 3.0\nfriction = { force = 4.0 }\n";
    for own in samples(&cart).0 {
        let v = 3.0 - 2.0 * own.t;
        assert!((own.energies[0] - v * v).abs() < 1e-12, "t = {}: {}", own.t, own.energies[0]);
    }
}

/// The sling of links lifts the ball from its trough, and throws it much as the sling without mass:
/// at 0.760 s with 39.7 m/s in both directions.
#[test]
fn a_sling_of_links_throws_as_one_without_mass() {
    let model =
        Model::from_toml(include_str!("../../examples/models/trebuchet_sling.toml")).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let all: Vec<Sample> = simulation.samples().map(|own| own.unwrap()).collect();
    let told: Vec<(f64, String)> =
        (all.iter().flat_map(|own| &own.events)).map(|own| (own.t, own.action.clone())).collect();
    println!("{told:?}");
    assert_eq!(told[0].1, "separate ball", "the sling lifts it");
    assert!(told[0].0 > 0.1 && told[0].0 < 0.4);
    assert_eq!(told[1].1, "release pouch");
    assert!((told[1].0 - 0.76046).abs() < 0.01, "{}", told[1].0);
    let ball = 12 * model.bodies.iter().position(|own| own.name == "ball").unwrap();
    let [a, b] = [all.len() - 2, all.len() - 1].map(|k| &all[k]);
    let v = [0, 2].map(|i| (b.q[ball + i] - a.q[ball + i]) / (b.t - a.t));
    let fall = 9.81 * (b.t - told[1].0);
    println!("{v:?}");
    assert!((v[0] - 39.735).abs() < 0.04 * 39.735, "{v:?}");
    assert!((v[1] + fall - v[0]).abs() < 0.1, "thrown at 45 degrees: {v:?}");
}
