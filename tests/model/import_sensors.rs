//! Sensors and servos of MJCF: what they measure and do in the model, and what has no counterpart.

#![allow(clippy::unwrap_used)] // a test

use holonom::import::{ImportOptions, JointValue, import_text};
use holonom::{Sample, Simulation};
use std::path::Path;

const ARM: &str = r#"<mujoco model="arm">
  <worldbody>
    <site name="home" pos="0 0 1"/>
    <body name="arm" pos="0 0 2">
      <joint name="pin" type="hinge" axis="0 1 0"/>
      <geom type="box" size="0.5 0.02 0.02" pos="0.5 0 0" mass="2"/>
      <site name="tip" pos="1 0 0" euler="0 0 90"/>
      <body name="ball" pos="1 0 0">
        <joint name="wrist" type="ball"/>
        <geom type="sphere" size="0.05" pos="0 0 -0.2" mass="0.1"/>
      </body>
    </body>
  </worldbody>
  <sensor>
    <jointpos name="angle" joint="pin"/>
    <jointvel joint="pin"/>
    <framepos name="tip_place" objtype="site" objname="tip"/>
    <framelinvel name="centre_speed" objtype="body" objname="arm"/>
    <framepos name="hinge_place" objtype="xbody" objname="arm"/>
    <frameangvel name="spin" objtype="xbody" objname="arm"/>
    <framequat name="attitude" objtype="xbody" objname="ball"/>
    <accelerometer name="felt" site="tip"/>
    <gyro name="turned" site="tip"/>
    <framepos name="fixed" objtype="site" objname="home"/>
    <framepos name="relative" objtype="site" objname="tip" reftype="site" refname="home"/>
    <force name="pull" site="tip"/>
  </sensor>
</mujoco>"#;

fn import(text: &str) -> Result<holonom::import::Imported, String> {
    let options = ImportOptions { end: 0.2, ..ImportOptions::default() };
    import_text(text, Path::new("arm.xml"), &options).map_err(|error| error.to_string())
}

/// Each number, by its column, along a run.
fn column<'a>(run: &'a [(Vec<String>, Sample)], name: &'a str) -> impl Iterator<Item = f64> + 'a {
    run.iter().map(move |(columns, sample)| {
        let place = columns.iter().position(|own| own == name);
        sample.sensors[place.unwrap_or_else(|| panic!("no `{name}` among {columns:?}"))]
    })
}

#[test]
fn sensors_of_mjcf_measure_what_they_measure_there() {
    let imported = import(ARM).unwrap();
    let mut simulation = Simulation::new(&imported.model).unwrap();
    let columns: Vec<String> =
        simulation.sensors().columns().iter().map(|column| column.name()).collect();
    let run: Vec<(Vec<String>, Sample)> =
        simulation.samples().map(|sample| (columns.clone(), sample.unwrap())).collect();
    let apart = |name: &str, of: &dyn Fn(f64, f64) -> f64| {
        let states = column(&run, "angle").zip(column(&run, "jointvel_pin"));
        let pairs = column(&run, name).zip(states);
        let apart = pairs
            .fold(0.0_f64, |worst, (own, (angle, rate))| worst.max((own - of(angle, rate)).abs()));
        println!("{name}: apart {apart:.1e}");
        apart
    };
    let last = column(&run, "angle").last().unwrap();
    assert!(last > 0.1, "it falls: {last}");
    // an axis along y turns the arm downwards
    assert!(apart("tip_place.x", &|angle, _| angle.cos()) < 1e-12);
    assert!(apart("tip_place.z", &|angle, _| 2.0 - angle.sin()) < 1e-12);
    assert!(apart("hinge_place.z", &|_, _| 2.0) < 1e-12);
    assert!(apart("centre_speed.x", &|angle, rate| -0.5 * rate * angle.sin()) < 1e-12);
    assert!(apart("spin.y", &|_, rate| rate) < 1e-12);
    // the first axis of the site is the second one of the arm
    assert!(apart("felt.gx", &|_, rate| rate) < 1e-12);
    // at the start the tip falls faster than free, with the ball below it
    let weight = column(&run, "felt.az").next().unwrap();
    let moment = 2.0 * 9.81 * 0.5 + 0.1 * 9.81;
    let inertia = 2.0 / 12.0 * (1.0 + 0.04 * 0.04) + 2.0 * 0.25 + 0.1;
    println!("felt at the start {weight}, {}", 9.81 - moment / inertia);
    assert!((weight - 9.81 + moment / inertia).abs() < 1e-9, "{weight}");
    assert_eq!(columns.iter().filter(|own| own.ends_with(".gx")).count(), 1, "one imu of a site");
    assert!(columns.iter().any(|own| own.starts_with("attitude.")), "{columns:?}");
    let said: Vec<String> = imported.remarks.iter().map(ToString::to_string).collect();
    let has = |words: &str, name: &str| {
        said.iter().any(|remark| remark.contains(words) && remark.contains(name))
    };
    assert!(has("of the ground", "fixed"), "{said:#?}");
    assert!(has("without a counterpart", "relative") && has("without a counterpart", "pull"));
}

/// What sensors name has to exist.
#[test]
fn sensors_of_nothing_are_refused() {
    for (from, to, words) in [
        ("joint=\"pin\"", "joint=\"pim\"", "no joint named `pim`"),
        ("site=\"tip\"", "site=\"top\"", "no site named `top`"),
        ("objname=\"ball\"", "objname=\"bell\"", "no body named `bell`"),
        ("objtype=\"body\"", "objtype=\"corpse\"", "`objtype` is `corpse`"),
        ("<jointvel joint=\"pin\"/>", "<jointvel/>", "joint"),
    ] {
        let text = ARM.replace(from, to);
        assert_ne!(text, ARM);
        let refused = import(&text).unwrap_err();
        println!("{refused}");
        assert!(refused.contains(words), "{refused}");
    }
}

/// Servos act as in MuJoCo without controls: towards 0 of the description, with the square of the
/// gear, from wherever the run begins.
#[test]
fn servos_hold_their_joints_at_zero() {
    let servos = "<actuator><position joint=\"pin\" kp=\"30\" kv=\"2\" gear=\"2\"/>\
                  <velocity joint=\"pin\" kv=\"3\" ctrlrange=\"-1 1\"/>\
                  <motor name=\"m\" joint=\"pin\"/></actuator></mujoco>";
    let text = ARM.replace("</mujoco>", servos);
    let value = JointValue { joint: "pin".to_owned(), value: 0.4 };
    let options =
        ImportOptions { actuators: true, values: vec![value], ..ImportOptions::default() };
    let imported = import_text(&text, Path::new("arm.xml"), &options).unwrap();
    let motor = imported.model.joint("pin").unwrap().motor.clone().unwrap();
    println!("{motor:?}");
    assert_eq!((motor.proportional, motor.derivative, motor.path.offset), (120.0, 11.0, -0.4));
    let said: Vec<String> = imported.remarks.iter().map(ToString::to_string).collect();
    let has = |words: &str| said.iter().any(|remark| remark.contains(words));
    assert!(has("set point 0") && has("limits of actuators") && has("no servo"), "{said:#?}");
    // without the option as before
    let imported = import(&text).unwrap();
    assert!(imported.model.joint("pin").unwrap().motor.is_none());
    assert!(imported.remarks.iter().any(|own| own.message.contains("`--actuators`")));
    let refused = import_text(
        &text.replace("kp=\"30\"", "kp=\"30\" joint=\"pim\"").replacen("joint=\"pin\" kp", "kp", 1),
        Path::new("arm.xml"),
        &options,
    );
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("no joint named `pim`"), "{refused}");
}
