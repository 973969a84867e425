//! Geometry for contact of robot descriptions: what stands on the ground, what touches what.
#![allow(clippy::float_cmp)] // exact numbers of a description

use super::import_dialects::imported;
use holonom::Sample;
use holonom::import::{Base, ImportOptions};
use holonom::model::{Model, ShapeKind};
use vi_testkit::model::changed;

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
    let [floor, feet] = &found.model.contacts[..] else { panic!("two contacts") };
    assert!(feet.plane().is_none(), "with one another");
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
        let mut own = found.model.contacts.iter().filter(|own| {
            let at = own.plane().map(|plane| plane.position[2]);
            own.friction == friction && at == Some(height)
        });
        let found = own.next().unwrap_or_else(|| panic!("{friction} at {height}"));
        assert!(own.next().is_none());
        found
    };
    let planes = found.model.contacts.iter().filter(|own| own.plane().is_some());
    assert_eq!((planes.count(), found.model.contacts.len()), (3, 4));
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
    assert!(has("contact between shapes for which there is none, left out: "), "{said:#?}");
}

/// Bodies touch one another by their groups, but not a body and the one it hangs on; pairs and
/// exclusions are named.
#[test]
fn bodies_of_a_robot_touch_one_another() {
    let text = r#"<mujoco model="pairs"><worldbody>
      <body name="a"><freejoint/><geom type="sphere" size="0.1"/>
        <body name="b" pos="0.3 0 0"><joint axis="0 1 0"/><geom type="sphere" size="0.1" friction="0.4"/>
          <body name="c" pos="0.3 0 0"><joint axis="0 1 0"/><geom type="capsule" size="0.1 0.2" friction="1.2"/></body></body></body>
      <body name="d" pos="2 0 0"><freejoint/><geom name="d" type="sphere" size="0.1" contype="2" conaffinity="2"/></body>
      <body name="e" pos="4 0 0"><freejoint/><geom name="e" type="sphere" size="0.1" contype="0" conaffinity="0"/></body>
      <body name="f" pos="6 0 0"><freejoint/><geom type="sphere" size="0.1"/></body>
      <body name="g" pos="6 0 0.15"><freejoint/><geom type="sphere" size="0.1" contype="4" conaffinity="5"/></body>
      <body name="h" pos="8 0 0"><freejoint/><geom type="ellipsoid" size="0.1 0.1 0.2" contype="4" conaffinity="1"/></body>
    </worldbody><contact><pair geom1="e" geom2="d" friction="0.35"/><pair geom1="e" geom2="none"/>
      <exclude body1="f" body2="b"/></contact></mujoco>"#;
    let found = imported(text, &with_contacts(Base::Fixed));
    println!("{}", found.text);
    let mut pairs: Vec<(String, f64)> = Vec::new();
    for pair in found.model.contact_pairs() {
        let mut names = [pair.a.name(), &pair.b.name];
        names.sort_unstable();
        pairs.push((names.concat(), pair.contact.friction));
    }
    pairs.sort_by(|a, b| a.0.cmp(&b.0));
    let pairs: Vec<(&str, f64)> = pairs.iter().map(|(own, f)| (own.as_str(), *f)).collect();
    let expected = [
        ("ac", 1.2),
        ("af", 1.0),
        ("ag", 1.0),
        ("bg", 1.0),
        ("cf", 1.2),
        ("cg", 1.2),
        ("de", 0.35),
    ];
    assert_eq!(pairs, expected);
    let said: Vec<String> = found.remarks.iter().map(ToString::to_string).collect();
    let has = |words: &str| said.iter().any(|own| own.contains(words));
    assert!(has("that overlap as drawn, left out: f and g"), "{said:#?}");
    assert!(has("for which there is none, left out: a and h"), "{said:#?}");
    assert!(has("that are not of two bodies: not translated: e and none"), "{said:#?}");
    let run = holonom::Simulation::new(&Model::from_toml(&found.text).unwrap());
    assert!(run.is_ok(), "{:?}", run.err());
}

/// A claw of two fingers closes on a ball of its own: its springs press, the ball stays.
#[test]
fn a_claw_holds_a_ball() {
    let finger = |name: &str, side: f64| {
        format!(
            r#"<body name="{name}" pos="0 {} 0"><joint type="slide" axis="0 {} 0" stiffness="100" springref="0.1" damping="2"/>
               <geom type="capsule" size="0.02 0.1" pos="0.05 0 -0.1" friction="0.8" mass="0.2"/></body>"#,
            0.07 * side,
            -side
        )
    };
    let text = format!(
        r#"<mujoco model="claw"><worldbody><body name="palm"><geom type="sphere" size="0.02" mass="1"/>{}{}</body>
           <body name="ball" pos="0.05 0 -0.1"><freejoint/><geom type="sphere" size="0.05" mass="0.3" friction="0.8"/></body>
           </worldbody></mujoco>"#,
        finger("left", 1.0),
        finger("right", -1.0)
    );
    let found = imported(&text, &with_contacts(Base::Fixed));
    println!("{}", found.text);
    let model = Model::from_toml(&found.text).unwrap();
    let end = last(&model, 0.5);
    let k = model.bodies.iter().position(|own| own.name == "ball").unwrap();
    let at = &end.q[12 * k..12 * k + 3];
    println!("{at:?}");
    assert!((at[2] + 0.1).abs() < 1e-9 && (at[0] - 0.05).abs() < 1e-9, "{at:?}");
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

/// The shipped quadruped falls on its toes; then nothing moves, and the ground carries its weight,
/// with all usual steps: dampers of its joints answer an impulse by far less than its mass does.
#[test]
fn the_shipped_quadruped_stands() {
    let shipped = include_str!("../../examples/models/quadruped_stands.toml");
    for step in ["0.001", "0.002", "0.005", "0.01"] {
        let text = changed(shipped, "step = 0.001\n", &format!("step = {step}\n"));
        let text = changed(&text, "every = 5\n", "every = 1\n");
        let model = Model::from_toml(&text).unwrap();
        let mut simulation = holonom::Simulation::new(&model).unwrap();
        let all = simulation.samples().map(|own| own.unwrap_or_else(|e| panic!("{}", e.message)));
        let all: Vec<Sample> = all.collect();
        let (still, last) = (&all[all.len() / 2], all.last().unwrap());
        assert!(all[0].q[2] - last.q[2] > 0.05, "its legs give way");
        let moved = still.q.iter().zip(&last.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("step {step} s: moved by {moved:.1e} m in half a second");
        assert!(moved < 1e-12, "step {step} s: {moved:e}");
        assert!((last.q[2] - 0.4896).abs() < 1e-3, "step {step} s: at a height of {} m", last.q[2]);
        let toes = last.contacts.iter().filter(|own| own.axes[0] != [0.0; 3]);
        assert_eq!((toes.count(), last.contacts.len()), (4, 20), "toes, and joints with friction");
        let weight = 9.81 * model.bodies.iter().map(holonom::model::Body::mass).sum::<f64>();
        let carried: f64 = last.contacts.iter().map(|own| own.in_space()[2]).sum();
        assert!((carried - weight).abs() < 1e-6 * weight, "{carried} N of {weight} N");
        assert!(last.energies[0].abs() < 1e-14, "kinetic energy {:e}", last.energies[0]);
    }
}
