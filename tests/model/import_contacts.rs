//! Geometry for contact of robot descriptions: what stands on the ground, what touches what.
#![allow(clippy::float_cmp)] // exact numbers of a description

use super::import_dialects::imported;
use holonom::Sample;
use holonom::import::{Base, ImportOptions};
use holonom::model::{Model, ShapeKind};

fn with_contacts(base: Base) -> ImportOptions {
    ImportOptions { contacts: true, base, ..ImportOptions::default() }
}

/// A torso on four legs of two links; hips and knees have dry friction, feet are balls.
fn walker() -> String {
    let mut text = String::from("<robot name=\"walker\">");
    let link = |name: &str, mass: f64, i: f64, z: f64, rest: &str| {
        let inertia = format!("<inertia ixx=\"{i}\" iyy=\"{i}\" izz=\"{i}\"/>");
        let inertial = format!(
            "<inertial><origin xyz=\"0 0 {z}\"/><mass value=\"{mass}\"/>{inertia}</inertial>"
        );
        format!("<link name=\"{name}\">{inertial}{rest}</link>")
    };
    text += &link(
        "torso",
        6.0,
        0.1,
        0.0,
        "<visual><geometry><box size=\"0.5 0.3 0.1\"/></geometry></visual>",
    );
    let joint = |name: &str, parent: &str, child: &str, at: [f64; 3]| {
        let [x, y, z] = at;
        let ends = format!("<parent link=\"{parent}\"/><child link=\"{child}\"/>");
        format!(
            "<joint name=\"{name}\" type=\"continuous\"><origin xyz=\"{x} {y} {z}\"/><axis xyz=\"0 1 0\"/>{ends}<dynamics friction=\"8.0\"/></joint>"
        )
    };
    for (name, x, y) in
        [("fl", 0.2, 0.15), ("fr", 0.2, -0.15), ("bl", -0.2, 0.15), ("br", -0.2, -0.15)]
    {
        let [thigh, shank] = [format!("thigh_{name}"), format!("shank_{name}")];
        text += &link(&thigh, 0.5, 0.003, -0.1, "");
        let foot = "<collision><origin xyz=\"0.03 0 -0.2\"/><geometry><sphere radius=\"0.02\"/></geometry></collision>";
        text += &link(&shank, 0.3, 0.002, -0.1, foot);
        text += &joint(&format!("hip_{name}"), "torso", &thigh, [x, y, 0.0]);
        text += &joint(&format!("knee_{name}"), &thigh, &shank, [-0.05, 0.0, -0.2]);
    }
    text + "</robot>"
}

fn last(model: &Model, end: f64) -> Sample {
    let mut model = model.clone();
    model.settings.end = end;
    let mut simulation = holonom::Simulation::new(&model).unwrap();
    simulation.samples().map(|own| own.unwrap_or_else(|e| panic!("{}", e.message))).last().unwrap()
}

/// A quadruped stands on its feet: dry friction holds its joints, the ground its feet.
#[test]
fn a_quadruped_stands_on_its_feet() {
    let found = imported(&walker(), &with_contacts(Base::Free));
    println!("{}", found.text);
    let [floor] = &found.model.contacts[..] else { panic!("one contact") };
    assert_eq!((floor.name.as_str(), floor.friction), ("floor", 1.0));
    let names = ["shank_fl", "shank_fr", "shank_bl", "shank_br"];
    assert_eq!(floor.b.list(), names);
    assert!((floor.plane().unwrap().position[2] + 0.42).abs() < 1e-15, "under the feet");
    let start = Model::from_toml(&found.text).unwrap();
    let place = |model: &Model| model.bodies.iter().map(|own| own.position).collect::<Vec<_>>();
    let end = last(&start, 0.5);
    for (k, at) in place(&start).iter().enumerate() {
        let moved = (0..3).map(|i| (end.q[12 * k + i] - at[i]).abs()).fold(0.0, f64::max);
        assert!(moved < 1e-9, "body {k}: {moved:e}");
    }
}

/// `contype` and `conaffinity` tell which geoms touch; the larger coefficient of friction counts;
/// what is fixed to the ground but for planes does not touch.
#[test]
fn groups_and_friction_of_mjcf() {
    let text = r#"<mujoco model="groups"><worldbody>
      <geom name="floor" type="plane" size="1 1 1" pos="0 0 -0.5" friction="0.6 0.1 0.1"/>
      <geom name="ramp" type="plane" size="1 1 1" pos="0 0 -9" euler="30 0 0" contype="4" conaffinity="4"/>
      <geom name="post" type="box" size="1 1 1" pos="9 9 9"/>
      <body name="a"><freejoint/>
        <geom type="box" size="0.1 0.2 0.3"/>
        <geom type="sphere" size="0.4" contype="0" conaffinity="0"/>
        <geom type="capsule" size="0.1 0.2" contype="2" conaffinity="2"/></body>
      <body name="b" pos="2 0 0"><freejoint/><geom type="sphere" size="0.4" friction="0.9" contype="4"/></body>
      <body name="c" pos="4 0 0"><freejoint/><geom type="ellipsoid" size="0.1 0.2 0.3" conaffinity="0"/></body>
    </worldbody></mujoco>"#;
    let found = imported(text, &with_contacts(Base::Fixed));
    println!("{}", found.text);
    let of = |friction: f64, height: f64| {
        let mut own =
            found.model.contacts.iter().filter(|own| {
                own.friction == friction && own.plane().unwrap().position[2] == height
            });
        let found = own.next().unwrap_or_else(|| panic!("{friction} at {height}"));
        assert!(own.next().is_none());
        found
    };
    assert_eq!(found.model.contacts.len(), 3);
    // a geom of contype 1 touches a plane of conaffinity 1, whatever its own conaffinity is
    assert_eq!(of(1.0, -0.5).b.list(), ["a", "c"]);
    assert_eq!(of(0.9, -0.5).b.list(), ["b"]);
    assert_eq!(of(1.0, -0.5).plane().unwrap().normal, [0.0, 0.0, 1.0]);
    let ramp = of(1.0, -9.0);
    assert_eq!((ramp.name.as_str(), ramp.b.list()), ("ramp", &["b".to_owned()][..]));
    let normal = ramp.plane().unwrap().normal;
    assert!((normal[1] + 0.5).abs() < 1e-15 && (normal[2] - 0.75_f64.sqrt()).abs() < 1e-15);
    let kinds =
        |k: usize| found.model.bodies[k].collision.iter().map(|own| own.kind).collect::<Vec<_>>();
    assert_eq!(kinds(0), [ShapeKind::Box]);
    assert_eq!(kinds(1), [ShapeKind::Sphere]);
    assert_eq!(kinds(2), [ShapeKind::Ellipsoid]);
    let said: Vec<String> = found.remarks.iter().map(ToString::to_string).collect();
    let has = |words: &str| said.iter().any(|own| own.contains(words));
    assert!(has("fixed to the ground: only planes: geom \"post\""), "{said:#?}");
    assert!(has("with one another: not translated"), "{said:#?}");
}

/// Without the option nothing touches, and that is listed.
#[test]
fn contact_is_asked_for() {
    let found =
        imported(&walker(), &ImportOptions { base: Base::Free, ..ImportOptions::default() });
    assert!(found.model.contacts.is_empty());
    assert!(found.model.bodies.iter().all(|own| own.collision.is_empty()));
    let said = found.remarks.iter().map(ToString::to_string).collect::<String>();
    assert!(said.contains("contact: not translated"), "{said}");
}
