//! Communication steps: times, lengths, refused steps, inputs, events.

use crate::phases::ARM;
use crate::unit::{DISCARD, ERROR, OK, Unit, WARNING};
use holonom::Simulation;
use holonom_fmu::Version;

#[test]
fn times_and_lengths_of_communication_steps_are_checked() {
    let unit = Unit::new(ARM, &[], &[], &[]);
    let own = unit.begun(Version::Fmi3);
    assert_eq!(own.step(0.5, 1e-3).0, ERROR);
    assert!(own.said().contains("the communication point is 0.5 s, the instance is at 0 s"));
    for length in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
        assert_eq!(own.step(0.0, length).0, ERROR, "{length}");
        assert!(own.said().contains("it has to be positive"));
    }
    // the first one decides the step: the longest one of which it is a multiple
    let (status, reached) = own.step(0.0, 2.5e-3);
    assert_eq!(status, WARNING);
    assert!(own.said().contains("is no multiple of the step of 0.001 s: the step is 0.00083"));
    assert!((reached - 2.5e-3).abs() < 1e-15, "{reached}");
    assert_eq!(own.step(2.5e-3, 1e-3).0, ERROR);
    assert!(own.said().contains("let later ones be multiples of it"));
    assert_eq!(own.step(2.5e-3, 5e-3).0, OK, "{}", own.said());
    // sums of a tool drift by round-off
    let own = unit.begun(Version::Fmi3);
    let mut t = 0.0;
    for _ in 0..1000 {
        assert_eq!(own.step(t, 1e-3).0, OK, "{}", own.said());
        t += 1e-3;
    }
    assert_ne!(t.to_bits(), 1.0_f64.to_bits());
    assert_eq!(own.get(&[0]), [1.0]);
}

#[test]
fn a_held_input_is_the_motor_of_the_file_bit_for_bit() {
    let unit = Unit::new(ARM, &[("joint.shoulder.motor.effort", "0.0")], &[], &[]);
    let angle = unit.reference("angle");
    let own = unit.begun(Version::Fmi2);
    assert_eq!(own.set(unit.reference("shoulder.effort"), 7.0), OK);
    let of_file = Unit::new(ARM, &[("joint.shoulder.motor.effort", "7.0")], &[], &[]);
    let mut run = Simulation::new(&of_file.model).unwrap();
    for (n, sample) in run.samples().take(200).enumerate() {
        let expected = sample.unwrap().sensors[0];
        assert_eq!(own.get(&[angle])[0].to_bits(), expected.to_bits(), "node {n}");
        assert_eq!(own.step(n as f64 * 1e-3, 1e-3).0, OK);
    }
}

#[test]
fn forces_on_bodies_and_signals_act() {
    let text = format!(
        "{ARM}\n[[signal]]\nname = \"wanted\"\nstart = 0.2\n\n[[signal]]\nname = \"follow\"\n\
         pid = {{ of = \"wanted - shoulder\", proportional = 200.0, derivative = 20.0, filter = 0.01 }}\n\n\
         [[law]]\nname = \"drive\"\njoint = \"shoulder\"\neffort = \"follow + 9.81*cos(shoulder)\"\n"
    );
    let unit = Unit::new(&text, &[("joint.shoulder.motor.effort", "0.0")], &["arm"], &[]);
    let reference = |name: &str| unit.reference(name);
    let (wanted, angle) = (reference("wanted"), reference("angle"));
    assert!(unit.interface.variables.iter().filter(|own| own.name == "wanted").count() == 1);
    let reach = |set: f64, push: f64| {
        let own = unit.begun(Version::Fmi3);
        assert_eq!(own.set(reference("arm.force.z"), push), OK, "{}", own.said());
        for n in 0..3000_u32 {
            if n == 1500 {
                assert_eq!(own.set(wanted, set), OK, "{}", own.said());
                assert_eq!(own.get(&[wanted]), [set]);
            }
            assert_eq!(own.step(f64::from(n) * 1e-3, 1e-3).0, OK, "{}", own.said());
        }
        own.get(&[angle])[0]
    };
    // the controller follows the set point; 10 N at the middle of the arm lift it by
    // 5 cos(θ) N·m over 200 N·m/rad
    let (still, moved, pushed) = (reach(0.2, 0.0), reach(0.7, 0.0), reach(0.7, 10.0));
    println!("{still:.4} rad, {moved:.4} rad, pushed {pushed:.4} rad");
    assert!((still - 0.2).abs() < 2e-3 && (moved - 0.7).abs() < 2e-2);
    let expected = 5.0 * pushed.cos() / 200.0;
    assert!(((pushed - moved) - expected).abs() < 0.1 * expected, "{}", pushed - moved);
    // a start value of the initialization is that of the file
    let own = unit.instance(Version::Fmi3);
    assert_eq!(own.set(wanted, 0.5), OK);
    assert_eq!(own.initialize(0.0), OK);
    let follow = own.get(&[reference("follow")])[0];
    assert!((follow - 100.0).abs() < 1e-9, "{follow}"); // d starts at e: no derivative part
}

/// A control on a body is an input, one along a joint an effort of it.
#[test]
fn controls_act_as_loads_and_efforts() {
    let controls = "\n[[control]]\nname = \"jet\"\nbody = \"arm\"\nforce = [0.0, 0.0, 2.0]\n\n\
                    [[control]]\nname = \"servo\"\njoint = \"shoulder\"\n";
    let unit = Unit::new(&format!("{ARM}{controls}"), &[], &["jet", "servo", "arm.force"], &[]);
    let reach = |set: &[(&str, f64)]| {
        let own = unit.begun(Version::Fmi3);
        for (name, value) in set {
            assert_eq!(own.set(unit.reference(name), *value), OK, "{}", own.said());
        }
        (0..500).for_each(|n| assert_eq!(own.step(f64::from(n) * 1e-3, 1e-3).0, OK));
        own.get(&[unit.reference("angle")])[0]
    };
    let [still, jet, force] = [&[][..], &[("jet.value", 1.5)], &[("arm.force.z", 3.0)]].map(reach);
    println!("{still} rad, {jet} rad by the control, {force} rad by the force");
    assert!((jet - still).abs() > 1e-3 && (jet - force).abs() < 1e-13);
    assert!((reach(&[("shoulder.effort", 1.5)]) - still).abs() > 1e-3);
}

#[test]
fn what_feeds_nothing_through_does_not_depend_on_inputs() {
    let unit = Unit::new(ARM, &[], &["arm.force"], &[]);
    let own = unit.begun(Version::Fmi3);
    assert_eq!(own.step(0.0, 1e-2).0, OK);
    let outputs: Vec<(usize, bool)> = unit
        .interface
        .of_causality(holonom_fmu::Causality::Output)
        .map(|(k, own)| (k, own.feeds_through))
        .collect();
    let all: Vec<u32> = outputs.iter().map(|own| own.0 as u32).collect();
    let before = own.get(&all);
    assert_eq!(own.set(unit.reference("arm.force.x"), 100.0), OK);
    let after = own.get(&all);
    let mut through = 0;
    for (k, (_, feeds_through)) in outputs.iter().enumerate() {
        let changed = before[k].to_bits() != after[k].to_bits();
        assert!(*feeds_through || !changed, "{}", unit.interface.variables[outputs[k].0].name);
        through += usize::from(changed);
    }
    assert!(through >= 1, "the bearing takes up the force at once");
}

#[test]
fn a_refused_step_leaves_the_state_and_says_why() {
    // beyond the reach of Newton's method: a torque that turns the arm by many revolutions a step
    let unit = Unit::new(ARM, &[], &[], &[]);
    let own = unit.begun(Version::Fmi3);
    let (effort, angle) = (unit.reference("shoulder.effort"), unit.reference("angle"));
    assert_eq!(own.step(0.0, 1e-3).0, OK);
    let before = own.get(&[0, angle]);
    assert_eq!(own.set(effort, 1e9), OK);
    let (status, reached) = own.step(1e-3, 2e-3);
    let said = own.said();
    println!("{said}");
    assert_eq!(status, DISCARD, "{said}");
    assert_eq!(reached.to_bits(), 1e-3_f64.to_bits());
    assert!(said.contains("step 1, t = 0.001 s: "), "{said}");
    assert_eq!(own.set(effort, 0.0), OK);
    assert_eq!(own.get(&[0, angle]), before);
    assert_eq!(own.step(1e-3, 1e-3).0, OK, "{}", own.said());
}

#[test]
fn an_event_that_ends_the_motion_ends_the_simulation() {
    let text =
        format!("{ARM}\n[[event]]\nname = \"down\"\nwhen = \"shoulder < -0.5\"\nend = true\n");
    let unit = Unit::new(&text, &[("joint.shoulder.motor.effort", "0.0")], &[], &[]);
    let own = unit.begun(Version::Fmi2);
    let angle = unit.reference("angle");
    let (mut t, mut last) = (0.0, OK);
    for _ in 0..2000 {
        (last, t) = own.step(t, 1e-3);
        if last != OK {
            break;
        }
    }
    let mut ended = 0;
    unsafe { holonom_fmi::fmi2::fmi2GetBooleanStatus(own.id, 3, &mut ended) };
    let reached = own.get(&[angle])[0];
    assert_eq!((last, ended), (DISCARD, 1), "{t} s");
    assert!((reached + 0.5).abs() < 1e-6, "{reached} rad at {t} s");
}

#[test]
fn histories_are_read_at_the_time_of_the_tool() {
    let moved = "effort = 10.0, history = { type = \"pulse\", start = 3.05, end = 9.0 }";
    let text = ARM.replace("effort = 1.0", moved);
    let unit = Unit::new(&text, &[], &[], &[]);
    let own = unit.instance(Version::Fmi3);
    assert_eq!(own.initialize(3.0), OK, "{}", own.said());
    let still = Unit::new(ARM, &[("joint.shoulder.motor.effort", "0.0")], &[], &[]);
    let free = still.begun(Version::Fmi3);
    let (angle, other) = (unit.reference("angle"), still.reference("angle"));
    for n in 0..100_u32 {
        let t = 3.0 + f64::from(n) * 1e-3;
        let apart = (own.get(&[angle])[0] - free.get(&[other])[0]).abs();
        assert!(if n <= 50 { apart < 1e-9 } else { n < 60 || apart > 1e-5 }, "{t} s: {apart}");
        assert_eq!(own.step(t, 1e-3).0, OK, "{}", own.said());
        assert_eq!(free.step(f64::from(n) * 1e-3, 1e-3).0, OK);
    }
}

#[test]
fn a_controller_outside_is_of_first_order_in_the_communication_step() {
    let rate = "[[sensor]]\nname = \"rate\"\ntype = \"joint_rate\"\nof = \"shoulder\"\n";
    let law = "[[law]]\nname = \"drive\"\njoint = \"shoulder\"\neffort = \"9.81 + 20*(0.3 - shoulder) - 4*shoulder.rate\"\n";
    let still = [("joint.shoulder.motor.effort", "0.0"), ("simulation.step", "1e-4")];
    let inside = Unit::new(&format!("{ARM}\n{law}"), &still, &[], &[]).begun(Version::Fmi3);
    assert_eq!(inside.step(0.0, 0.5).0, OK);
    let outside = Unit::new(&format!("{ARM}\n{rate}"), &still, &[], &[]);
    let reference = |name: &str| outside.reference(name);
    let [angle, rate, effort] = ["angle", "rate", "shoulder.effort"].map(reference);
    let errors = [5e-3, 1e-2, 2e-2].map(|h: f64| {
        let own = outside.begun(Version::Fmi3);
        for n in 0..(0.5 / h).round() as u32 {
            let at = own.get(&[angle, rate]);
            assert_eq!(own.set(effort, 9.81 + 20.0 * (0.3 - at[0]) - 4.0 * at[1]), OK);
            assert_eq!(own.step(f64::from(n) * h, h).0, OK, "{}", own.said());
        }
        (own.get(&[angle])[0] - inside.get(&[angle])[0]).abs()
    });
    println!("errors at H = 5, 10, 20 ms: {errors:?} rad");
    let orders = [errors[1] / errors[0], errors[2] / errors[1]].map(f64::log2);
    assert!(orders.iter().all(|order| (order - 1.0).abs() < 0.15), "{orders:?}");
}

#[test]
fn a_set_point_is_followed_by_the_motor_of_the_file_at_any_communication_step() {
    let motor = |path: &str| {
        let text = format!("motor = {{ proportional = 200.0, derivative = 20.0{path} }}");
        ARM.replace("motor = { effort = 1.0 }", &text)
    };
    let still = Unit::new(&motor(", path = { offset = 0.1 }"), &[], &[], &[]);
    let (setpoint, angle) = (still.reference("shoulder.setpoint"), still.reference("angle"));
    // until it is set it is the path of the file, bit for bit; 50 ms are far from stable outside
    let own = still.begun(Version::Fmi3);
    assert_eq!(own.get(&[setpoint]), [0.1]);
    let mut run = Simulation::new(&still.model).unwrap();
    for (n, sample) in run.samples().step_by(50).take(10).enumerate() {
        assert_eq!(own.get(&[angle])[0].to_bits(), sample.unwrap().sensors[0].to_bits());
        assert_eq!(own.step(n as f64 * 0.05, 0.05).0, OK);
    }
    // then it is what is set: k (s − θ) = m g cos(θ)/2
    assert_eq!(own.set(setpoint, 0.6), OK);
    for n in 10..60_u32 {
        assert_eq!(own.step(f64::from(n) * 0.05, 0.05).0, OK, "{}", own.said());
    }
    let reached = own.get(&[angle])[0];
    println!("{reached:.6} rad");
    assert!((200.0 * (0.6 - reached) - 9.81 * reached.cos()).abs() < 1e-4, "{reached} rad");
    // a path that moves stays that of the file where nothing else is asked for
    let moving = motor(", path = { rate = 0.5 }");
    let names = |inputs: &[&str]| {
        let unit = Unit::new(&moving, &[], inputs, &[]);
        unit.interface.variables.iter().any(|own| own.name == "shoulder.setpoint")
    };
    assert!(!names(&[]) && names(&["shoulder.setpoint"]));
}
