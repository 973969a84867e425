//! Events and contacts at one node: a lock while a contact is closed is a plastic impact, whose
//! velocities the contact then answers as an impact of its own.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::models::orders;
use holonom::{EventRecord, Model, Sample, Simulation};
use vi_testkit::model::{body, heavy, part, sensor};

const MASSES: [f64; 2] = [2.0, 1.0]; // slider, arm
const RESTITUTION: f64 = 0.5;
const AT: f64 = 1.5033; // between two nodes

fn run(text: &str) -> Vec<Sample> {
    let model = Model::from_toml(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut simulation = Simulation::new(&model).unwrap_or_else(|error| panic!("{error}"));
    simulation.samples().map(|sample| sample.unwrap_or_else(|f| panic!("{}", f.message))).collect()
}

/// A slider on a vertical rail, that has bounced and rests on the ground with an arm that swings.
fn slider(rate: f64, contact: &str, action: &str) -> String {
    let settings = format!("step = 0.005, end = 1.6, contact = \"{contact}\"");
    heavy("latch", [0.0, 0.0, -9.81], &settings)
        + &body("slider", MASSES[0], [0.02; 3])
        + "position = [0.0, 0.0, 0.6]\n"
        + "collision = [{ type = \"sphere\", dimensions = [0.1] }]\n"
        + &body("arm", MASSES[1], [0.001, 0.03, 0.03])
        + "position = [0.3, 0.0, 0.6]\n"
        + &part("joint", "rail")
        + "type = \"prismatic\"\nparent = \"ground\"\nchild = \"slider\"\n\
           position = [0.0, 0.0, 0.6]\naxis = [0.0, 0.0, 1.0]\n"
        + &part("joint", "elbow")
        + "type = \"revolute\"\nparent = \"slider\"\nchild = \"arm\"\n\
           position = [0.0, 0.0, 0.6]\naxis = [0.0, 1.0, 0.0]\n"
        + &format!("rate = {rate:?}\n")
        + &part("contact", "floor")
        + &format!("a = {{ plane = {{}} }}\nb = \"slider\"\nrestitution = {RESTITUTION:?}\n")
        + &sensor("slide", "velocity", "slider")
        + &sensor("swing", "velocity", "arm")
        + &part("event", "latch")
        + &format!("at = {AT:?}\n{action}")
}

fn records(nodes: &[Sample]) -> Vec<EventRecord> {
    nodes.iter().flat_map(|node| node.events.iter().cloned()).collect()
}

/// The arm swings upwards: the slider is lifted. It swings downwards: the slider is pressed on the
/// ground, and bounces. Either way the lock is the plastic impact of both along the rail, from the
/// velocity that the contact holds at zero, and the contact answers what then approaches.
#[test]
fn a_lock_while_a_contact_is_closed_is_answered_by_the_contact() {
    let mut lifted = [0; 2];
    let cases = [("events", -2.0), ("events", 1.0), ("events", -4.0), ("stepping", 1.0)];
    for (contact, rate) in cases {
        let before = run(&slider(rate, contact, "end = true\n"));
        let nodes = run(&slider(rate, contact, "lock = [\"elbow\"]\n"));
        let last = before.last().unwrap();
        let [slide, swing] = [last.sensors[2], last.sensors[5]];
        assert!(last.t == AT && slide.abs() < 1e-13, "at {} with {slide:e} m/s", last.t);
        let common = MASSES[1] * swing / (MASSES[0] + MASSES[1]);
        let expected = if common > 0.0 { common } else { -RESTITUTION * common };
        let acted: Vec<EventRecord> = records(&nodes).into_iter().filter(|e| e.t == AT).collect();
        let words: Vec<&str> = acted.iter().map(|event| event.action.as_str()).collect();
        let hit = acted.iter().find(|event| event.action == "impact slider");
        let after = nodes.iter().find(|node| node.t > AT).unwrap();
        let s = after.t - AT;
        let fall = (after.q[2] - 0.1 - expected * s + 0.5 * 9.81 * s * s).abs();
        let balance = nodes.last().unwrap().energies.last().unwrap();
        let steady = before.last().unwrap().energies.last().unwrap();
        println!("{contact}: {common:.4} m/s, {words:?}, apart {fall:.1e} m, {balance:.1e} J");
        lifted[usize::from(common > 0.0)] += 1;
        assert_eq!(hit.is_some(), common < 0.0, "{words:?}");
        if let Some(hit) = hit {
            assert!((hit.before.unwrap() - common).abs() < 1e-12, "{hit:?}, {common}");
        }
        assert!(fall < 1e-12, "{fall:e}");
        // what is lost is told to the last digit: the balance goes on as it was
        assert!((balance - steady).abs() < 1e-12, "{balance:e}, {steady:e}");
    }
    assert!(lifted.iter().all(|count| *count > 0), "{lifted:?}");
}

/// A ball, a box that slides and a stop that is pressed: at every node the velocity is that of the
/// motion, not that of a momentum that has fallen for half a step, and kinetic energy, momenta,
/// conditions and sampled signals are those of this velocity.
#[test]
fn what_rests_has_no_velocity() {
    let settings = "step = 0.01, end = 0.3, contact = \"events\"";
    let text = heavy("rest", [0.0, 0.0, -9.81], settings)
        + &body("ball", 2.0, [0.02; 3])
        + "position = [0.0, 0.0, 0.1]\n"
        + "collision = [{ type = \"sphere\", dimensions = [0.1] }]\n"
        + &body("box", 3.0, [0.02; 3])
        + "position = [1.0, 0.0, 0.1]\nvelocity = [4.0, 0.0, 0.0]\n"
        + "collision = [{ type = \"box\", dimensions = [0.4, 0.4, 0.2] }]\n"
        + &body("arm", 1.0, [0.001, 0.03, 0.03])
        + "position = [0.3, 3.0, 1.0]\n"
        + &part("joint", "pin")
        + "type = \"revolute\"\nparent = \"ground\"\nchild = \"arm\"\n\
           position = [0.0, 3.0, 1.0]\naxis = [0.0, 1.0, 0.0]\nlimits = [-1.0, 0.0]\n"
        + &part("contact", "floor")
        + "a = { plane = {} }\nb = [\"ball\", \"box\"]\nfriction = 0.3\n"
        + &sensor("ball_speed", "velocity", "ball")
        + &sensor("box_speed", "velocity", "box")
        + &sensor("pin_rate", "joint_rate", "pin")
        + &part("signal", "held")
        + "every = 0.01\nvalue = \"ball.vz\"\n"
        + &part("sensor", "kept")
        + "type = \"expression\"\nvalue = \"held\"\n"
        + &part("event", "never")
        + "when = \"ball.vz < -1e-9 or pin.rate > 1e-9\"\nend = true\n";
    let nodes = run(&text);
    assert_eq!(nodes.len(), 31, "a condition on the velocity of what rests ended the run");
    let [mut rest, mut slide, mut momentum, mut kinetic] = [0.0_f64; 4];
    for node in &nodes {
        let s = &node.sensors;
        // the signal, the ball, the box, the joint, the signal again
        let still = s.iter().enumerate().filter(|(k, _)| *k != 4);
        rest = still.fold(rest, |worst, (_, v)| worst.max(v.abs()));
        let v = 4.0 - 0.3 * 9.81 * node.t;
        kinetic = kinetic.max((node.energies[0] - 1.5 * v * v).abs());
        slide = slide.max((s[4] - v).abs());
        momentum = momentum.max((node.momentum.linear[0] - 3.0 * v).abs());
        momentum = momentum.max(node.momentum.linear[2].abs());
    }
    println!(
        "at rest {rest:.1e} m/s, sliding apart {slide:.1e} m/s, momentum {momentum:.1e} N s, {kinetic:.1e} J"
    );
    assert!(rest < 1e-12 && slide < 1e-11 && momentum < 1e-11 && kinetic < 1e-10);
}

/// A box slides with friction while its arm swings; the arm is locked. Friction up to the lock
/// belongs to the velocity that the lock stops, friction from there to the next step: order 2.
#[test]
fn the_order_holds_through_a_lock_while_a_contact_slides() {
    let place = |h: f64, end: &str| {
        let settings = format!("step = {h:?}, end = 0.4, contact = \"events\"");
        let text = heavy("slide", [0.0, 0.0, -9.81], &settings)
            + &body("box", 6.0, [0.5; 3])
            + "position = [0.0, 0.0, 0.1]\nvelocity = [4.0, 0.0, 0.0]\n"
            + "collision = [{ type = \"box\", dimensions = [1.2, 0.4, 0.2] }]\n"
            + &body("arm", 0.5, [0.0001, 0.003, 0.003])
            + "position = [0.15, 0.0, 0.3]\nvelocity = [4.0, 0.0, -0.45]\n\
               angular_velocity = [0.0, 3.0, 0.0]\n"
            + &part("joint", "elbow")
            + "type = \"revolute\"\nparent = \"box\"\nchild = \"arm\"\n\
               position = [0.0, 0.0, 0.3]\naxis = [0.0, 1.0, 0.0]\n"
            + &part("contact", "floor")
            + "a = { plane = {} }\nb = \"box\"\nfriction = 0.3\n"
            + &sensor("speed", "velocity", "box")
            + &part("event", "latch")
            + &format!("at = {:?}\n", 22.0 / 3.0 * 0.02)
            + end;
        let last = run(&text).last().unwrap().clone();
        [last.q[0], last.sensors[0]]
    };
    for action in ["lock = [\"elbow\"]\n", "release = [\"elbow\"]\n"] {
        let exact = place(0.02 / 64.0, action);
        // the event divides steps of all these lengths alike
        let errors = [0.02, 0.005, 0.00125].map(|h| {
            let found = place(h, action);
            [0, 1].map(|k| (found[k] - exact[k]).abs())
        });
        let orders = [0, 1].map(|k| orders(&errors.map(|error| error[k].sqrt())));
        println!("{action}  {exact:?}: errors {errors:?}, orders {orders:?}");
        // errors of the longest steps may have a zero
        assert!(orders.iter().all(|order| order[1] > 1.8), "{orders:?}");
    }
}
