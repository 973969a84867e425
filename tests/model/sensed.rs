//! Laws and signals that read sensors: the numbers of configuration and velocity at once, all
//! others as they were at the node before.

#![allow(clippy::unwrap_used)] // a test

use super::laws::{apart, links, run};
use super::signals::restarts;
use crate::harness::case::distance;
use crate::harness::models::orders;
use holonom::{Model, Simulation};
use vi_testkit::model::{body, changed, heavy, part, particle, sensor};

/// Sensors of all kinds that are read at once.
fn sensors() -> String {
    let point = "point = [0.2, 0.1, -0.3]\n";
    let seen = "seen_from = \"upper\"\n";
    [
        particle("ball", 0.4, [0.3, 1.0, 0.2]),
        part("spring", "cord") + "from = \"ground\"\nto = \"ball\"\npoint_from = [0.0, 0.2, 1.0]\nstiffness = 9.0\n",
        part("law", "rope") + "from = \"lower\"\nto = \"ball\"\npoint_from = [0.1, 0.0, 0.2]\ntension = \"x - 0.5\"\n",
        sensor("place", "position", "lower") + point,
        sensor("rate", "velocity", "lower") + point,
        sensor("spin", "angular_velocity", "lower"),
        sensor("from_upper", "position", "lower") + point + seen,
        sensor("rate_from_upper", "velocity", "lower") + point + seen,
        sensor("spin_from_upper", "angular_velocity", "lower") + seen,
        sensor("ball_from_upper", "position", "ball") + seen,
        sensor("flight", "velocity", "ball"),
        sensor("gap", "distance", "lower") + point + "to = \"ground\"\npoint_to = [0.3, 0.4, 0.5]\n",
        sensor("gap_rate", "distance_rate", "lower") + point + "to = \"ball\"\n",
        sensor("cord_length", "length", "cord"),
        sensor("rope_rate", "length_rate", "rope"),
        sensor("angle", "joint_coordinate", "elbow"),
        sensor("angle_rate", "joint_rate", "elbow"),
    ]
    .concat()
}

#[test]
fn a_signal_of_a_sensor_is_its_column() {
    let text = links("scheme = \"nodal\"", &sensors());
    let model = Model::from_toml(&text).unwrap();
    let simulation = Simulation::new(&model).unwrap();
    let names: Vec<String> =
        simulation.sensors().columns().iter().map(|column| column.name()).collect();
    let signals: Vec<String> = names
        .iter()
        .map(|name| {
            format!("[[signal]]\nname = \"of_{}\"\nvalue = \"{name}\"\n", name.replace('.', "_"))
        })
        .collect();
    let nodes = run(&(text + &signals.concat())).unwrap();
    let count = names.len();
    assert_eq!(count, 30);
    let mut moving = 0;
    for (k, name) in names.iter().enumerate() {
        let off = nodes.iter().map(|node| (node.sensors[k] - node.sensors[count + k]).abs());
        let off = off.fold(0.0, f64::max);
        let size = nodes.iter().map(|node| node.sensors[k].abs()).fold(0.0, f64::max);
        println!("{name}: off by {off:.1e} of {size:.1e}");
        assert!(off <= 1e-13 * (1.0 + size), "{name}: {off:e} of {size:e}");
        moving += usize::from(size > 1e-3);
    }
    assert!(moving >= 20, "{moving} of {count} are not zero");
}

/// A law by sensors moves as by the names of what they measure.
#[test]
fn a_law_by_sensors_moves_as_by_names() {
    let measured = [
        sensor("angle", "joint_coordinate", "elbow"),
        sensor("turning", "joint_rate", "elbow"),
        sensor("center", "position", "lower"),
        sensor("fall", "velocity", "lower"),
        sensor("spin", "angular_velocity", "lower"),
    ]
    .concat();
    let law = |effort: &str| {
        format!("[[law]]\nname = \"motor\"\njoint = \"shoulder\"\neffort = \"{effort}\"\n")
    };
    let names = law("-8*sin(elbow) - 1.5*elbow.rate + 3*lower.x*lower.wy - 0.7*lower.vz + 0.2*x");
    let sensed = law("-8*sin(angle) - 1.5*turning + 3*center.x*spin.y - 0.7*fall.z + 0.2*x");
    let event = "[[event]]\nname = \"off\"\nat = 0.1\nset = { gain = 0.5 }\n\
                 [[signal]]\nname = \"gain\"\nstart = 1.0\n";
    for scheme in [
        "scheme = \"nodal\"",
        "scheme = \"constrained\"",
        "method = \"galerkin\", order = 4",
        "scheme = \"em-nodal\"",
    ] {
        for more in ["", event] {
            if scheme.contains("em-") && !more.is_empty() {
                continue;
            }
            let [a, b] = [&names, &sensed]
                .map(|law| run(&links(scheme, &(measured.clone() + law + more))).unwrap());
            let distance = apart(&a, &b);
            println!("{scheme}: {distance:.1e}");
            assert!(distance < 1e-12, "{scheme}: {distance:e}");
        }
    }
}

/// A block slides down a slope of 0.5 rad, with friction in proportion to the reaction of its
/// guide, which is known from the first step on.
#[test]
fn friction_by_a_reaction_that_is_sampled() {
    let text = heavy("slope", [0.0, 0.0, -9.81], "step = 0.01, end = 0.5")
        + &body("block", 2.0, [0.1, 0.1, 0.1])
        + &part("joint", "guide")
        + &format!(
            "type = \"prismatic\"\nparent = \"ground\"\nchild = \"block\"\nposition = [0.0, 0.0, 0.0]\naxis = [{:?}, 0.0, {:?}]\n",
            f64::cos(0.5),
            -f64::sin(0.5)
        )
        + &sensor("rail", "reaction", "guide")
        + "frame = \"space\"\n"
        + &sensor("speed", "joint_rate", "guide")
        + &part("law", "friction")
        + "joint = \"guide\"\neffort = \"-0.2*grip\"\n"
        + &part("signal", "late")
        + "delay = { of = \"hypot(rail.fx, rail.fz)\", time = 0.02 }\n"
        + &part("signal", "grip")
        + "every = 0.01\nvalue = \"hypot(rail.fx, rail.fz)\"\n";
    let nodes = run(&text).unwrap();
    let weight = 9.81 * 2.0 * f64::cos(0.5);
    let (late, grip, speed) = (0, 1, 8 + 1);
    for node in &nodes {
        let held = if node.step == 0 { 0.0 } else { weight };
        assert!((node.sensors[grip] - held).abs() < 1e-10, "{}: {}", node.step, node.sensors[grip]);
        let held = if node.step <= 2 { 0.0 } else { weight };
        assert!((node.sensors[late] - held).abs() < 1e-10, "{}: {}", node.step, node.sensors[late]);
        let expected =
            9.81 * (f64::sin(0.5) * node.t - 0.2 * f64::cos(0.5) * (node.t - 0.01).max(0.0));
        let found = node.sensors[speed];
        assert!((found - expected).abs() < 1e-10, "{}: {found} {expected}", node.step);
    }
}

/// Friction of a bearing in proportion to what it carries, sampled at each step, is of order 1.
#[test]
fn a_law_of_a_reaction_has_order_one() {
    let end = |parts: u32| {
        let step = 0.01 / f64::from(parts);
        let text = heavy("bearing", [0.0, 0.0, -9.81], &format!("step = {step:?}, end = 0.5"))
            + &vi_testkit::model::body_at([0.6, 0.0, 0.0], "rod", 2.0, [0.1, 0.1, 0.1])
            + &vi_testkit::model::hinge("pin", ["ground", "rod"], [0.0; 3], [0.0, 1.0, 0.0])
            + "rate = 4.0\n"
            + &sensor("carried", "reaction", "pin")
            + "frame = \"space\"\n"
            + &part("signal", "load")
            + &format!("every = {step:?}\nvalue = \"hypot(carried.fx, carried.fz)\"\n")
            + &part("law", "friction")
            + "joint = \"pin\"\neffort = \"-0.05*load*tanh(v)\"\n";
        run(&text).unwrap().last().unwrap().q.clone()
    };
    let reference = end(64);
    let errors: Vec<f64> = [1, 2, 4].map(|parts| distance(&end(parts), &reference)).to_vec();
    let orders = orders(&errors);
    println!("{errors:?}: orders {orders:?}");
    assert!(errors[0] > 1e-4 && orders.iter().all(|own| (0.85..1.25).contains(own)), "{orders:?}");
}

/// What is read as it was at the node before is that, and a part of the state of the run.
#[test]
fn what_is_measured_is_of_the_node_before_and_restarts_to_the_bit() {
    let more = [
        sensor("pin", "reaction", "shoulder"),
        sensor("jolt", "acceleration", "lower"),
        sensor("unit", "imu", "upper"),
        sensor("done", "work", "motor"),
        part("signal", "force")
            + "every = 0.01\nvalue = \"0.5*last + pin.fx + jolt.z + unit.gy\"\n",
        part("signal", "last_work") + "every = 0.005\nvalue = \"done\"\n",
        part("signal", "last_spin") + "every = 0.005\nvalue = \"unit.gy\"\n",
        part("signal", "late") + "delay = { of = \"pin.fz\", time = 0.0125 }\n",
        part("law", "motor")
            + "joint = \"elbow\"\neffort = \"0.01*force - 0.001*late - 0.3*v + last_work\"\n",
    ]
    .concat();
    for scheme in
        ["scheme = \"nodal\"", "scheme = \"constrained\"", "method = \"galerkin\", order = 4"]
    {
        let text = links(scheme, &more);
        let text = match scheme.contains("galerkin") {
            true => text.replace(
                "delay = { of = \"pin.fz\", time = 0.0125 }",
                "every = 0.01\nvalue = \"pin.fz\"",
            ),
            false => text,
        };
        restarts(&text);
        let nodes = run(&text).unwrap();
        let model = Model::from_toml(&text).unwrap();
        let simulation = Simulation::new(&model).unwrap();
        let column = |name: &str| {
            simulation.sensors().columns().iter().position(|own| own.name() == name).unwrap()
        };
        for (held, of) in [("last_work", "done"), ("last_spin", "unit.gy")] {
            let (held, of) = (column(held), column(of));
            for pair in nodes.windows(2) {
                let off = (pair[1].sensors[held] - pair[0].sensors[of]).abs();
                assert!(off < 1e-12, "{scheme}: {off:e} at {}", pair[1].step);
            }
        }
    }
}

#[test]
fn what_sensors_do_not_tell_is_refused_at_its_place() {
    let measured = sensor("pin", "reaction", "shoulder") + &sensor("tip", "position", "lower");
    let law = |effort: &str| {
        format!("[[law]]\nname = \"motor\"\njoint = \"elbow\"\neffort = \"{effort}\"\n")
    };
    for (acting, key, why) in [
        (law("-0.1*pin.fx"), "law.motor.effort", "`pin.fx` is known with the step that follows"),
        (law("-0.1*pin.fx"), "law.motor.effort", "every = 0.005 and value = \\\"pin.fx\\\""),
        (
            law("u") + "[[signal]]\nname = \"u\"\nvalue = \"pin.fz\"\n",
            "signal.u.value",
            "known with the step",
        ),
        (law("tip.q"), "law.motor.effort", "it has tip.x, tip.y, tip.z"),
        (
            law("u") + "[[signal]]\nname = \"u\"\nevery = 0.01\nvalue = \"pin.q\"\n",
            "signal.u.value",
            "it has pin.fx",
        ),
    ] {
        let text = links("scheme = \"nodal\"", &(measured.clone() + &acting));
        let error = match Model::from_toml(&text) {
            Err(error) => format!("{error:?}"),
            Ok(model) => format!("{:?}", Simulation::new(&model).map(|_| ()).unwrap_err()),
        };
        println!("{error}");
        assert!(error.contains(key) && error.contains(why), "{key}, {why}: {error}");
    }
}

/// What an event takes away is read by nothing that stays, where its value is part of the step; by
/// name or by a sensor. What is sampled of it goes on: a reaction is zero.
#[test]
fn what_an_event_takes_away_is_not_read_within_a_step() {
    let text = |sensor_kind: &str, of: &str, drive: &str, act: &str| {
        changed(&links("project_start = true", ""), "rate = 0.3\n", "")
            + &part("constraint", "rod")
            + "type = \"distance\"\nfrom = \"ground\"\nto = \"lower\"\npoint_from = [2.0, 0.0, 0.5]\n"
            + &part("spring", "cord")
            + "from = \"ground\"\nto = \"lower\"\npoint_from = [0.0, 0.0, 1.0]\nstiffness = 10.0\n"
            + &part("law", "band")
            + "from = \"ground\"\nto = \"lower\"\ntension = \"x + 0.1*v\"\n"
            + &part("bushing", "pad")
            + "from = \"ground\"\nto = \"lower\"\nposition = [0.9, 0.0, 0.0]\ndamping = [1, 1, 1, 1, 1, 1]\n"
            + &sensor("s", sensor_kind, of)
            + drive
            + &part("event", "cut")
            + &format!("at = 0.1\n{act} = [\"{of}\"]\n")
    };
    let at_once = |quantity: &str| {
        part("law", "drive") + &format!("joint = \"shoulder\"\neffort = \"0.01*{quantity}\"\n")
    };
    let lagged = |quantity: &str| {
        part("signal", "lag")
            + &format!("filter = {{ of = \"{quantity}\", time_constant = 0.1 }}\n")
            + &at_once("lag")
    };
    for (kind, of, act) in [
        ("joint_coordinate", "elbow", "release"),
        ("joint_rate", "elbow", "release"),
        ("length", "rod", "release"),
        ("length", "cord", "release"),
        ("length_rate", "cord", "release"),
        ("length", "band", "release"),
        ("length_rate", "band", "disable"),
    ] {
        for (reader, drive) in [("drive", at_once("s")), ("lag", lagged("s"))] {
            let refused = Model::from_toml(&text(kind, of, &drive, act)).unwrap_err().to_string();
            let expected = format!("event.cut.{act}: `{reader}` reads the sensor `s` of `{of}`");
            println!("{refused}");
            assert!(refused.contains(&expected), "{refused}");
        }
    }
    for (kind, column, of, act) in [
        ("reaction", "s.fx", "elbow", "release"),
        ("joint_acceleration", "s", "elbow", "release"),
        ("effort", "s", "cord", "release"),
        ("effort", "s", "band", "disable"),
        ("effort", "s.fx", "pad", "release"),
        ("power", "s", "pad", "release"),
    ] {
        let held = part("signal", "held") + &format!("every = 0.01\nvalue = \"{column}\"\n");
        let text = text(kind, of, &(held + &at_once("held")), act);
        let nodes = run(&text).unwrap_or_else(|message| panic!("{message}"));
        // a signal is the first column
        let held = nodes.iter().map(|node| node.sensors[0]);
        let (before, after): (Vec<f64>, Vec<f64>) =
            (held.clone().take(20).collect(), held.skip(23).collect());
        println!("{kind} of {of}: before {:?}, after {:?}", before.last(), after.last());
        assert!(
            before.iter().any(|held| *held != 0.0) && after.iter().all(|held| held.is_finite())
        );
        if kind != "joint_acceleration" {
            assert!(after.iter().all(|held| *held == 0.0), "{kind}: {after:?}");
        }
    }
}
