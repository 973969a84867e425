//! Actuators and tendons of MJCF: what they become in the model. Their forces are compared with
//! those of MuJoCo in `imports.rs`, by the accelerations of `forces.xml`.

#![allow(clippy::unwrap_used)] // a test

use std::path::Path;

use holonom::Simulation;
use holonom::import::{ImportOptions, Imported, JointValue, import_text};
use holonom::model::JointKind;

fn import(text: &str, options: &ImportOptions) -> Result<Imported, String> {
    import_text(text, Path::new("arm.xml"), options).map_err(|error| error.to_string())
}

fn with_actuators() -> ImportOptions {
    ImportOptions { actuators: true, end: 0.1, ..ImportOptions::default() }
}

fn said(imported: &Imported, words: &str, line: &str) -> bool {
    imported.remarks.iter().map(ToString::to_string).any(|r| r.contains(words) && r.contains(line))
}

/// A pendulum with what stands in `default`, `tendon` and `actuator`.
fn pendulum(defaults: &str, tendon: &str, actuator: &str) -> String {
    format!(
        "<mujoco><default>{defaults}</default><worldbody><body name='rod'>\
         <joint name='pin' axis='0 1 0'/>\
         <geom size='0.1' pos='0 0 -1'/><site name='tip' pos='0 0 -1'/></body>\
         <site name='hook' pos='1 0 0'/></worldbody>\
         <tendon>{tendon}</tendon><actuator>{actuator}</actuator></mujoco>"
    )
}

/// How the elements of a class and an actuator combine: numbers of MuJoCo 4.0.0, `gain[0]` and
/// `−bias[1]`, `−bias[2]`, at the control 0.
#[test]
fn defaults_of_actuators_combine_as_in_mujoco() {
    let position = "<position kp='30' kv='2'/>";
    let affine = "<general biastype='affine' biasprm='7 -4 -1' gainprm='4'/>";
    for (class, actuator, [effort, proportional, derivative]) in [
        (position, "<general joint='pin'/>", [0.0, 30.0, 2.0]),
        (position, "<position joint='pin' kv='5'/>", [0.0, 30.0, 5.0]),
        (position, "<velocity joint='pin'/>", [0.0, 0.0, 1.0]),
        (position, "<intvelocity joint='pin'/>", [0.0, 1.0, 0.0]),
        (affine, "<general joint='pin'/>", [7.0, 4.0, 1.0]),
        (affine, "<general joint='pin' biasprm='0 -9'/>", [0.0, 9.0, 1.0]),
        (affine, "<position joint='pin'/>", [0.0, 4.0, 1.0]),
        (affine, "<position joint='pin' kp='3'/>", [0.0, 3.0, 1.0]),
        (affine, "<velocity joint='pin'/>", [0.0, 0.0, 4.0]),
        (
            "<position kp='3' gear='5'/><general gear='2'/>",
            "<velocity joint='pin'/>",
            [0., 0., 12.],
        ),
        (
            "<general gear='2'/><position kp='3' gear='5'/>",
            "<velocity joint='pin'/>",
            [0., 0., 25.],
        ),
        ("<motor gear='5'/>", "<position joint='pin' kp='2'/>", [0.0, 50.0, 0.0]),
        ("", "<general joint='pin' gainprm='2' ctrlrange='0.5 1'/>", [1.0, 0.0, 0.0]),
        ("", "<position joint='pin' kp='2' ctrlrange='0.5 1' ctrllimited='false'/>", [0., 2., 0.]),
        ("", "<position joint='pin' kp='2' ctrlrange='-2 -1'/>", [-2.0, 2.0, 0.0]),
    ] {
        let imported = import(&pendulum(class, "", actuator), &with_actuators()).unwrap();
        let motor = imported.model.joint("pin").unwrap().motor.clone().unwrap();
        let total = motor.effort + motor.proportional * motor.path.offset;
        let found = (total, motor.proportional, motor.derivative);
        println!("{class} {actuator}: {found:?}");
        assert_eq!(found, (effort, proportional, derivative), "{class} {actuator}");
    }
}

/// What has no counterpart is listed by its line, and moves nothing.
#[test]
fn what_is_no_servo_is_listed() {
    let others = [
        "<motor joint='pin'/>",
        "<position joint='pin' dampratio='1'/>",
        "<muscle joint='pin'/>",
        "<general joint='pin' biastype='affine' biasprm='0 4'/>",
        "<general joint='pin' biastype='muscle' biasprm='0 -4'/>",
        "<general joint='pin' dyntype='muscle' biastype='affine' biasprm='0 -4'/>",
        "<pid joint='pin' kp='3' ki='1'/>",
        "<position site='tip' kp='3'/>",
        "<position tendon='around' kp='3'/>",
        "<general joint='pin' biasprm='0 -4'/>",
    ];
    let around = "<spatial name='around' stiffness='1'><site site='tip'/><geom geom='g'/>\
                  <site site='hook'/></spatial>";
    for actuator in others {
        let imported = import(&pendulum("", around, actuator), &with_actuators()).unwrap();
        println!("{actuator}");
        assert!(said(&imported, "no servo", "line 1"), "{actuator}: {:#?}", imported.remarks);
        assert!(said(&imported, "around geometry", "around"));
        assert!(imported.model.joint("pin").unwrap().motor.is_none(), "{actuator}");
        assert!(imported.model.laws.is_empty() && imported.model.signals.is_empty());
    }
}

#[test]
fn faults_of_tendons_and_actuators_are_refused() {
    let tip = "<site site='tip'/><site site='hook'/>";
    let spatial = |attributes: &str, inside: &str| {
        format!("<spatial name='cord' stiffness='3' {attributes}>{inside}</spatial>")
    };
    for (tendon, actuator, words) in [
        ("<fixed><joint joint='pim' coef='1'/></fixed>".to_owned(), "", "no joint named `pim`"),
        ("<fixed><joint joint='pin'/></fixed>".to_owned(), "", "no attribute `coef`"),
        (spatial("", "<site site='top'/>"), "", "no site named `top`"),
        (spatial("", &format!("<pulley divisor='0'/>{tip}")), "", "`divisor` is 0"),
        (spatial("springlength='2 1'", tip), "", "`springlength` has no order"),
        (spatial("stiffness='-3'", "").replacen("stiffness='3'", "", 1), "", "feed energy in"),
        (String::new(), "<position tendon='cord'/>", "no tendon named `cord`"),
        (String::new(), "<position joint='pim'/>", "no joint named `pim`"),
        (String::new(), "<position joint='pin' ctrlrange='2 1'/>", "nothing lies between"),
        (String::new(), "<position joint='pin' class='c'/>", "no default class `c`"),
    ] {
        let refused = import(&pendulum("", &tendon, actuator), &with_actuators()).unwrap_err();
        println!("{refused}");
        assert!(refused.contains(words), "{refused}");
    }
}

/// Joints that a servo or a tendon acts on stay joints of their own.
#[test]
fn joints_with_servos_are_not_joined_into_a_planar_pair() {
    let text = "<mujoco><worldbody><body name='cart'><joint name='across' type='slide' axis='1 0 0'/>\
                <joint name='up' type='slide' axis='0 0 1'/><joint name='turn' axis='0 1 0'/>\
                <geom type='box' size='0.3 0.1 0.1'/></body></worldbody>\
                <actuator>SERVO</actuator></mujoco>";
    for (joint, kind) in [
        ("across", JointKind::Prismatic),
        ("up", JointKind::Prismatic),
        ("turn", JointKind::Revolute),
    ] {
        let text = text.replace("SERVO", &format!("<position joint='{joint}' kp='40' kv='3'/>"));
        let value = JointValue { joint: joint.to_owned(), value: 0.2 };
        let options = ImportOptions { values: vec![value], ..with_actuators() };
        let imported = import(&text, &options).unwrap();
        let own = imported.model.joint(joint).unwrap();
        assert_eq!((own.kind, own.motor.as_ref().unwrap().path.offset), (kind, -0.2));
        let plain = import(&text, &ImportOptions::default()).unwrap();
        assert_eq!(plain.model.joints.len(), 1, "without servos one planar pair");
        assert_eq!(imported.model.joints.len(), 3);
    }
}

/// The same of a tendon: it needs the coordinate of its joint.
#[test]
fn joints_of_tendons_are_not_joined_into_a_planar_pair() {
    let text = "<mujoco><worldbody><body name='cart'><joint name='across' type='slide' axis='1 0 0'/>\
                <joint name='up' type='slide' axis='0 0 1'/><joint name='turn' axis='0 1 0'/>\
                <geom type='box' size='0.3 0.1 0.1'/></body></worldbody>\
                <tendon><fixed name='t' stiffness='7'><joint joint='across' coef='2'/></fixed></tendon>\
                </mujoco>";
    let imported = import(text, &ImportOptions::default()).unwrap();
    let laws: Vec<_> = imported.model.laws.iter().filter_map(|own| own.joint.as_deref()).collect();
    println!("{laws:?}, {} joints", imported.model.joints.len());
    assert_eq!((laws, imported.model.joints.len()), (vec!["across"], 3));
}

/// Lengths, and the elongations at which tendons pull, along a run.
#[test]
fn tendons_have_the_lengths_that_sensors_show() {
    let text = "<mujoco><option gravity='0 0 0'/><worldbody><body name='a'><joint name='a-x' type='slide' axis='1 0 0'/>\
                <geom size='0.1' mass='2'/><site name='of_a'/></body><body name='b' pos='0 0 3'>\
                <joint name='sin' type='slide' axis='1 0 0' ref='0.5'/><geom size='0.1' mass='1'/>\
                <site name='of_b'/></body><site name='wall' pos='4 0 0'/></worldbody>\
                <tendon><fixed name='t' stiffness='8' springlength='0'><joint joint='a-x' coef='2'/>\
                <joint joint='sin' coef='-1'/></fixed><spatial name='s'><site site='wall'/>\
                <site site='of_a'/><pulley divisor='2'/><site site='of_a'/><site site='of_b'/></spatial>\
                </tendon><sensor><tendonpos name='l' tendon='t'/><tendonvel name='v' tendon='t'/>\
                <tendonpos name='path' tendon='s'/><jointpos name='q' joint='a-x'/>\
                <jointpos name='p' joint='sin'/></sensor></mujoco>";
    let value = JointValue { joint: "a-x".to_owned(), value: 0.3 };
    let options = ImportOptions { values: vec![value], end: 0.5, ..ImportOptions::default() };
    let imported = import(text, &options).unwrap();
    let mut simulation = Simulation::new(&imported.model).unwrap();
    let columns: Vec<String> = simulation.sensors().columns().iter().map(|c| c.name()).collect();
    let at = |name: &str| columns.iter().position(|own| own == name).unwrap();
    let [l, v, path, q, p] = ["l", "v", "path", "q", "p"].map(at);
    let (mut worst, mut last) = (0.0_f64, None::<(f64, f64)>);
    for sample in simulation.samples() {
        let sample = sample.unwrap();
        let [l, v, path, q, p] = [l, v, path, q, p].map(|k| sample.sensors[k]);
        // the coordinate of the model is 0 where the description draws it, at 0.3 and 0.5
        let (x, y) = (0.3 + q, 0.5 + p);
        let between = (9.0 + (x - p).powi(2)).sqrt();
        worst = worst.max((l - (2.0 * x - y)).abs());
        worst = worst.max((path - ((4.0 - x) + between / 2.0)).abs());
        if let Some((before, t)) = last {
            assert!((v - (l - before) / (sample.t - t)).abs() < 0.1, "{v}");
        }
        last = Some((l, sample.t));
    }
    // ω² = k (c_a²/m_a + c_b²/m_b) = 8 (4/2 + 1)
    let exact = 0.1 * (24.0_f64.sqrt() * 0.5).cos();
    println!("lengths off by {worst:.1e}; {} after 0.5 s, {exact} exactly", last.unwrap().0);
    assert!(worst < 1e-14);
    assert!((last.unwrap().0 - exact).abs() < 1e-5);
}

/// A sphere on a ball joint at its centre swings about a fixed axis as `θ'' = −k/I θ`, to 2 rad;
/// with a damper its angular velocity decays as `exp(−c t/I)`. `I = 0.4 m r² = 1 kg·m²`.
#[test]
fn springs_and_dampers_of_ball_joints_act_at_large_angles() {
    let spin = [2.0, 4.0, 4.0];
    for (attributes, exact, listed) in [
        ("stiffness='9'", 1.5_f64.cos(), false),
        ("damping='3'", (-1.5_f64).exp(), false),
        ("stiffness='0 3' damping='3 1'", (-1.5_f64).exp(), true),
    ] {
        let text = format!(
            "<mujoco><option gravity='0 0 0'/><worldbody><body name='b'>\
             <joint name='ball' type='ball' {attributes}/>\
             <geom type='sphere' size='0.5' mass='10'/></body></worldbody>\
             <sensor><frameangvel name='spin' objtype='xbody' objname='b'/></sensor></mujoco>"
        );
        let options = ImportOptions { end: 0.5, step: Some(1e-3), ..ImportOptions::default() };
        let mut imported = import(&text, &options).unwrap();
        assert_eq!(said(&imported, "linear parts", "ball"), listed);
        imported.model.bodies[0].angular_velocity = Some(spin);
        let mut simulation = Simulation::new(&imported.model).unwrap();
        let last = simulation.samples().last().unwrap().unwrap();
        println!("{attributes}: {:?}, {exact} of {spin:?}", last.sensors);
        for (found, initial) in last.sensors.iter().zip(spin) {
            assert!((found - exact * initial).abs() < 1e-4, "{found}, {}", exact * initial);
        }
    }
}
