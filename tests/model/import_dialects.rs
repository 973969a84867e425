//! What descriptions of robots hold beside the specifications: dialects, repairs, and remarks on
//! what plays no part.

use std::fmt::Write;
use std::path::Path;

use holonom::import::{Close, ImportError, ImportOptions, Imported, LoopJointKind, import_text};
use holonom::model::{Constraint, JointKind, Problem};
use holonom::{Model, Simulation};

const INERTIAL: &str = r#"<inertial><origin xyz="0.1 0 0" rpy="0.1 0.2 0.3"/><mass value="1.0"/><inertia ixx="0.01" iyy="0.02" izz="0.025" ixy="0.001" ixz="-0.002" iyz="0.0005"/></inertial>"#;

/// A robot with links `a` and `b` on a base by hinges `ja` and `jb`; `of_b` stands in `jb`,
/// `beside` in `<robot>`.
pub(super) fn two_links(type_of_a: &str, of_b: &str, beside: &str) -> String {
    format!(
        r#"<robot name="r"><link name="base"/><link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link>
<joint name="ja" type="{type_of_a}"><parent link="base"/><child link="a"/><origin xyz="0.2 0 0.1"/><axis xyz="0 1 0"/></joint>
<joint name="jb" type="revolute"><parent link="base"/><child link="b"/><origin xyz="0.2 0 0.1"/><axis xyz="0 1 0"/>{of_b}</joint>
{beside}</robot>"#
    )
}

pub(super) fn imported(text: &str, options: &ImportOptions) -> Imported {
    import_text(text, Path::new("nowhere/robot.xml"), options)
        .unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub(super) fn plain(text: &str) -> Imported {
    imported(text, &ImportOptions::default())
}

pub(super) fn refused(text: &str, options: &ImportOptions) -> Problem {
    match import_text(text, Path::new("nowhere/robot.xml"), options) {
        Err(ImportError::Invalid { problems, .. }) => problems[0].clone(),
        other => panic!("{other:?}"),
    }
}

/// All remarks, one a line.
pub(super) fn remarks(imported: &Imported) -> String {
    imported.remarks.iter().fold(String::new(), |mut all, remark| {
        let _ = writeln!(all, "{remark}");
        all
    })
}

pub(super) fn dof(model: &Model) -> usize {
    Simulation::new(model).unwrap().assembly().counts.dof
}

/// Largest component of a difference.
pub(super) fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).fold(0.0, |most, i| most.max((a[i] - b[i]).abs()))
}

/// The rotation that takes x to y, y to z and z to x, in all places that have an `<origin>`.
/// A joint may be fixed to the ground without a link `world`: the ground is that of a description
/// that has one, for a robot, one that moves behind the joint, and another name than `world` is
/// refused as before.
#[test]
fn the_world_of_urdf_needs_no_link() {
    let at = r#"<joint name="weld" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 0.4" rpy="0.3 0 0"/></joint>"#;
    let slides = at.replace("fixed", "prismatic");
    for joint in [at, &slides] {
        let without = plain(&two_links("revolute", "", joint)).model;
        let stated = format!(r#"<link name="world"/>{joint}"#);
        let with = plain(&two_links("revolute", "", &stated)).model;
        assert_eq!(without, with);
        let still = plain(&two_links("revolute", "", "")).model;
        let moved = without.bodies[0].position[2] - still.bodies[0].position[2];
        println!("moved by the joint to the world: {moved} m");
        assert!((moved - 0.4).abs() < 0.2);
    }
    let typo = at.replace("world", "wrold");
    let problem = refused(&two_links("revolute", "", &typo), &ImportOptions::default());
    assert!(problem.message.contains("no link named `wrold`"), "{problem:?}");
}

#[test]
fn quaternions_of_origins_are_orientations() {
    let robot = |joint: &str, inertial: &str| {
        format!(
            r#"<robot name="r" version="1.2"><link name="base"/><link name="a"><inertial><origin {inertial}/><mass value="1"/><inertia ixx="0.01" iyy="0.02" izz="0.025"/></inertial>
<visual><origin {inertial}/><geometry><box size="0.1 0.2 0.3"/></geometry></visual></link>
<joint name="j" type="revolute"><parent link="base"/><child link="a"/><origin {joint}/><axis xyz="0 1 0"/></joint></robot>"#
        )
    };
    let quaternion = r#"quat_xyzw="0.5 0.5 0.5 0.5""#;
    let model = plain(&robot(quaternion, "")).model;
    let axis = model.joints[0].axis.unwrap();
    println!("axis {axis:?}");
    assert!(apart(axis, [0.0, 0.0, 1.0]) < 1e-15, "y is taken to z: {axis:?}");
    // the same rotation as angles: a quarter turn about x, then one about z
    let angles = r#"rpy="1.5707963267948966 0 1.5707963267948966""#;
    let [one, other] = [quaternion, angles].map(|turn| plain(&robot("", turn)).model);
    let difference = (one.bodies[0].inertia_tensor() - other.bodies[0].inertia_tensor()).amax();
    println!("inertia by quaternion and by angles: {difference:.1e}");
    assert!(difference < 1e-16);
    let unscaled = plain(&robot(r#"quat_xyzw="3 3 3 3""#, "")).model.joints[0].axis.unwrap();
    assert!(apart(unscaled, axis) < 1e-15, "{unscaled:?}");
    let twice = refused(&robot(&format!("{quaternion} {angles}"), ""), &ImportOptions::default());
    assert!(twice.message.contains("stated twice"), "{}", twice.message);
    let zero = refused(&robot(r#"quat_xyzw="0 0 0 0""#, ""), &ImportOptions::default());
    assert!(zero.message.contains("no direction"), "{}", zero.message);
}

#[test]
fn a_joint_that_has_nothing_to_follow_moves_by_itself_and_this_is_said() {
    let mimic = |of: &str| format!(r#"<mimic joint="{of}" multiplier="0.5" offset="0.4"/>"#);
    let follows = plain(&two_links("revolute", &mimic("ja"), ""));
    assert_eq!(dof(&follows.model), 1, "{}", remarks(&follows));
    let cases = [
        ("revolute", "typo", "there is no joint `typo`", 2),
        ("revolute", "jx", "did you mean `ja`?", 2),
        ("revolute", "jb", "it cannot follow itself", 2),
        ("fixed", "ja", "the fixed joint `ja` has no single coordinate", 1),
        ("planar", "ja", "the planar joint `ja` has no single coordinate", 4),
        ("floating", "ja", "the floating joint `ja` has no single coordinate", 7),
        ("spherical", "ja", "the spherical joint `ja` has no single coordinate", 4),
    ];
    for (kind, of, words, freedoms) in cases {
        let found = plain(&two_links(kind, &mimic(of), ""));
        let said = remarks(&found);
        assert!(said.contains(words) && said.contains("joint \"jb\" (line 3)"), "{kind}: {said}");
        assert_eq!(dof(&found.model), freedoms, "{kind} {of}");
        assert!(found.model.constraints.is_empty(), "{kind} {of}");
    }
    let fixed = two_links("fixed", "", "").replace(
        r#"<axis xyz="0 1 0"/></joint>"#,
        r#"<axis xyz="0 1 0"/><mimic joint="jb"/></joint>"#,
    );
    let said = remarks(&plain(&fixed));
    assert!(said.contains("<mimic> of a joint without a coordinate"), "{said}");
}

#[test]
fn nothing_unknown_is_dropped_silently() {
    let cases = [
        ("<mimic joint=\"ja\" ratio=\"2\"/>", "the attribute `ratio` of <mimic>"),
        ("<dynamics spring_stiffness=\"3\"/>", "the attribute `spring_stiffness` of <dynamics>"),
        ("<spring k=\"3\"/>", "<spring> in <joint>"),
        ("<origin xyz=\"0 0 1\"/>", "a second <origin> in <joint>"),
    ];
    for (inside, words) in cases {
        let text = two_links("revolute", inside, "").replacen("<origin xyz=\"0.2 0 0.1\"/>", "", 1);
        let said = remarks(&plain(&text));
        assert!(said.contains(words), "{inside}: {said}");
    }
    let twice = two_links("revolute", "", "").replacen(INERTIAL, &INERTIAL.repeat(2), 1);
    assert!(remarks(&plain(&twice)).contains("a second <inertial> in <link>"));
}

#[test]
fn text_that_other_programs_read_is_read_with_a_remark() {
    let robot = two_links("revolute", "", "");
    let mass = |text: &str| {
        let found = plain(text);
        (found.model.bodies.iter().map(|b| b.mass()).sum::<f64>(), remarks(&found))
    };
    let (sum, said) = mass(&robot);
    assert!((sum - 2.0).abs() < 1e-15 && !said.contains("prefix"), "{said}");
    let inside = |element: &str| robot.replace("</robot>", &format!("{element}</robot>"));
    let cases = [
        (inside(r#"<gazebo><sensor:camera name="c"/></gazebo>"#), "the prefix `sensor`"),
        (inside(r#"<gazebo><a drake:b="1"/></gazebo>"#), "the prefix `drake`"),
        (robot.replace("<link name=\"a\">", "<link name=\"a\" ros:x=\"1\">"), "the prefix `ros`"),
        (format!("\n\n<?xml version=\"1.0\"?>{robot}"), "blanks before the XML declaration"),
        (
            format!("\u{feff} \t<?xml version=\"1.0\"?>\n{robot}"),
            "blanks before the XML declaration",
        ),
        (
            format!("\u{feff}\u{feff}<?xml version=\"1.0\"?>\n{robot}"),
            "blanks before the XML declaration",
        ),
        (
            format!("\n\u{feff}<?xml version=\"1.0\"?>\n{robot}"),
            "blanks before the XML declaration",
        ),
    ];
    for (text, words) in &cases {
        let (sum, said) = mass(text);
        assert!((sum - 2.0).abs() < 1e-15 && said.contains(words), "{words}: {said}");
    }
    let quiet = [
        format!("\n{robot}\n"),
        format!(" \u{feff}\u{feff}{robot}"),
        format!("<?xml version=\"1.0\"?><!-- a -- b -->{robot}"),
        inside(r#"<x xmlns:s="u"><s:a/></x>"#),
        inside("<gazebo><p v=\"${not} used\"/></gazebo>"),
        robot.replace("0.2 0 0.1", "0.2, 0, 0.1"),
        robot.replace("r\"", "r &amp; s\""),
    ];
    for text in &quiet {
        let (sum, said) = mass(text);
        let strange = ["prefix", "blanks"].iter().any(|word| said.contains(word));
        assert!((sum - 2.0).abs() < 1e-15 && !strange, "{text}: {said}");
    }
    let undeclared = inside(r#"<x xmlns:s="u"/><s:a/>"#);
    assert!(mass(&undeclared).1.contains("the prefix `s`"), "a scope ends with its element");
}

#[test]
fn text_that_is_no_xml_is_refused_where_it_is_wrong() {
    let cases = [
        ("<robot/><robot/>", "a second root", "1:9"),
        ("words <robot/>", "text before", "1:1"),
        ("<robot a=\"1\" a=\"2\"/>", "a second attribute `a`", "1:14"),
        ("<robot>\n<link></robot>", "", "2:7"),
        ("<robot>\n <link>", "`<link>` is not closed", "2:2"),
        ("<robot a=1/>", "", "1:1"),
        ("<robot name=\"&typo;\"/>", "typo", "1:8"),
        ("<1/>", "`1` is no name", "1:1"),
        ("<!-- <robot/>", "comment", "1:1"),
    ];
    for (text, words, place) in cases {
        let message = refused(text, &ImportOptions::default()).message;
        println!("{message}");
        assert!(message.starts_with("this is not well-formed XML: "), "{message}");
        assert!(message.contains(words) && message.ends_with(&format!(" at {place}")), "{message}");
    }
    let many: String = (0..1001).fold(String::new(), |all, k| all + &format!(" a{k}=\"\""));
    let message = refused(&format!("<robot{many}/>"), &ImportOptions::default()).message;
    assert!(message.contains("more than 1000 attributes"), "{message}");
}

#[test]
fn a_picture_that_cannot_be_read_does_not_refuse_the_robot() {
    let shapes = [
        "<mesh filename=\"a.stl\" scale=\"0.001\"/>",
        "<mesh filename=\"a.stl\" scale=\"1 2\"/>",
        "<mesh/>",
        "<box/>",
        "<box size=\"1 2\"/>",
        "<cylinder radius=\"x\" length=\"1\"/>",
    ];
    for shape in shapes {
        let visual = format!("<visual><geometry>{shape}</geometry></visual></link>");
        let text = two_links("revolute", "", "").replacen("</link>", &visual, 1);
        let found = plain(&text);
        assert_eq!(found.model.bodies.len(), 2, "{shape}");
        assert!(remarks(&found).contains("no picture"), "{shape}: {}", remarks(&found));
    }
}

#[test]
fn a_spherical_joint_of_a_urdf_is_a_spherical_pair() {
    let model = plain(&two_links("spherical", "", "")).model;
    assert_eq!(model.joints[0].kind, JointKind::Spherical);
    assert_eq!(dof(&model), 4);
}

/// Two links on one hinge, held together at a distance by a loop of each dialect: one freedom in
/// the place of two.
#[test]
fn loops_of_dialects_are_closed() {
    let dialects = [
        r#"<loop_joint name="l" type="continuous"><link1 link="a" xyz="1 0 0"/><link2 link="b" xyz="1 0 0"/><axis xyz="0 1 0"/></loop_joint>"#,
        r#"<loop_joint name="l" type="spherical"><link1 link="a" rpy="0 0 0" xyz="1 0 0"/><link1 link="b" rpy="0 0 0" xyz="1 0 0"/></loop_joint>"#,
        r#"<loop name="l" type="revolute"><predecessor link="a"/><successor link="b"/><predecessor_origin xyz="1 0 0"/><successor_origin xyz="1 0 0"/><axis xyz="0 1 0"/></loop>"#,
        r#"<loop name="l"><predecessor link="a"><origin xyz="1 0 0"/></predecessor><successor link="b"><origin xyz="1 0 0"/></successor></loop>"#,
        r#"<constraint name="l" type="fixed"><parent link="a"/><child link="b"/></constraint>"#,
        r#"<constraint name="l" type="fixed" link1="a" link2="b"/>"#,
        r#"<drake:loop_joint name="l" type="revolute"><link1 link="a" xyz="1 0 0" rpy="0 0 1.5707963267948966"/><link2 link="b" xyz="1 0 0"/><axis xyz="1 0 0"/></drake:loop_joint>"#,
    ];
    for dialect in dialects {
        let found = plain(&two_links("revolute", "", dialect));
        assert!(remarks(&found).contains("loops are closed"), "{dialect}: {}", remarks(&found));
        let model = &found.model;
        assert_eq!((model.joints.len(), dof(model)), (3, 1), "{dialect}");
        if let Some(axis) = model.joints[2].axis {
            assert!(apart(axis, [0.0, 1.0, 0.0]) < 1e-15, "{dialect}: {axis:?}");
        }
    }
    let unclear = [
        r#"<loop name="l" type="gear"><link1 link="a"/><link2 link="b"/></loop>"#,
        r#"<loop name="l"><link1 link="a"/><link2 link="typo"/></loop>"#,
        r#"<loop name="l"><link1 link="a"/></loop>"#,
        r#"<constraint name="l"/>"#,
    ];
    for dialect in unclear {
        let found = plain(&two_links("revolute", "", dialect));
        assert!(remarks(&found).contains("`--close A=B`"), "{dialect}: {}", remarks(&found));
        assert_eq!(dof(&found.model), 2);
    }
}

/// Frames are links without mass.
#[test]
fn an_option_closes_a_loop_between_two_frames() {
    let frames = |x: &str| {
        format!(
            r#"<link name="end_a"/><link name="end_b"/><link name="post"/>
<joint name="fp" type="fixed"><parent link="base"/><child link="post"/><origin xyz="1.2 0 0.1"/></joint>
<joint name="fa" type="fixed"><parent link="a"/><child link="end_a"/><origin xyz="1 0 0" rpy="-1.5707963267948966 0 0"/></joint>
<joint name="fb" type="fixed"><parent link="b"/><child link="end_b"/><origin xyz="{x} 0 0"/></joint>"#
        )
    };
    let close = |a: &str, b: &str, kind| ImportOptions {
        close: vec![Close { ends: [a.into(), b.into()], kind }],
        ..ImportOptions::default()
    };
    let text = two_links("revolute", "", &frames("1"));
    for kind in [LoopJointKind::Spherical, LoopJointKind::Revolute, LoopJointKind::Fixed] {
        let model = imported(&text, &close("end_a", "end_b", kind)).model;
        assert_eq!(dof(&model), 1, "{kind:?}");
    }
    let hinge = imported(&text, &close("end_a", "end_b", LoopJointKind::Revolute)).model;
    let axis = hinge.joints[2].axis.unwrap();
    assert!(apart(axis, [0.0, 1.0, 0.0]) < 1e-15, "the third axis of the first frame: {axis:?}");
    let to_ground = imported(&text, &close("post", "end_b", LoopJointKind::Spherical)).model;
    assert_eq!(dof(&to_ground), 1);
    let typo = refused(&text, &close("end_a", "end_c", LoopJointKind::Spherical));
    assert_eq!(typo.help.as_deref(), Some("did you mean `end_a`?"), "{typo:?}");
    // ends that are apart are brought together by the start of a run
    let plane = two_links("planar", "", &frames("1.1"));
    let found = imported(&plane, &close("end_a", "end_b", LoopJointKind::Spherical));
    assert!(remarks(&found).contains("open by 1.000e-1 m"), "{}", remarks(&found));
    assert!(found.model.settings.project_start);
    assert_eq!(dof(&found.model), 2, "it is closed, and a triangle is left");
    let body = r#"<body name="NAME" pos="P 0 0"><joint axis="0 1 0"/><geom size=".1" pos=".5 0 0"/><site name="at_NAME" pos="1 0 0"/></body>"#;
    let bodies: String =
        ["a", "b"].iter().map(|n| body.replace("NAME", n).replace('P', "0")).collect();
    let robot = format!("<mujoco><worldbody>{bodies}</worldbody></mujoco>");
    let sites = imported(&robot, &close("at_a", "at_b", LoopJointKind::Spherical)).model;
    assert_eq!(dof(&sites), 1, "sites of MJCF");
}

/// `P_k = (T R)ᵏ`: four legs about the base, each with two toes; a joint equality in each leg.
#[test]
fn replicas_stand_where_mujoco_has_them() {
    let robot = r#"<mujoco><worldbody><body name="base"><freejoint/><geom type="box" size=".1 .1 .1"/>
<replicate count="4" euler="0 0 90"><body name="leg" pos=".2 0 0"><joint name="hip" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/>
<replicate count="2" offset="0 .1 0" sep="-"><body name="toe" pos=".2 0 0"><joint name="t"/><geom size=".01"/></body></replicate>
</body></replicate></body></worldbody>
<equality><joint name="e" joint1="hip" polycoef="0 0 0 0 0"/></equality></mujoco>"#;
    let found = plain(robot);
    let model = &found.model;
    // 8 kg, 4 capsules of 0.2848377 kg, 8 toes of 4.18879e-3 kg
    let mass: f64 = model.bodies.iter().map(|b| b.mass()).sum();
    let exact = 8.0
        + 1000.0
            * std::f64::consts::PI
            * (4.0 * (0.0004 * 0.2 + 4.0 / 3.0 * 8e-6) + 8.0 * 4.0 / 3.0 * 1e-6);
    println!("mass {mass} kg, exactly {exact} kg");
    assert!((mass - exact).abs() < 1e-13 * exact, "{mass} {exact}");
    assert_eq!((model.bodies.len(), dof(model)), (13, 6 + 4 + 8 - 4), "{}", remarks(&found));
    let body = |name: &str| model.bodies.iter().find(|b| b.name == name).unwrap();
    assert!(apart(body("toe-02").position, [-0.4, 0.0, 0.0]) < 1e-15, "third leg: half a turn");
    assert!(
        apart(body("toe-11").position, [-0.1, 0.4, 0.0]) < 1e-15,
        "{:?}",
        body("toe-11").position
    );
    let held = model.constraints.iter().filter(|c| matches!(c, Constraint::Motion { .. })).count();
    assert_eq!(held, 4, "an equality in each copy");
    let row = r#"<mujoco><worldbody><replicate count="12" offset="1 0 0" euler="0 0 30"><body name="leg" pos=".2 0 0"><joint name="j" axis="0 1 0"/><geom size=".02"/></body></replicate></worldbody></mujoco>"#;
    let model = plain(row).model;
    let last = &model.bodies[11];
    assert_eq!(last.name, "leg11");
    let found = last.position;
    println!("leg11 at {found:?}");
    assert!(apart(found, [-0.69282032, 0.4, 0.0]) < 1e-8, "MuJoCo 4.0.0: {found:?}");
    for count in ["0", "1.5", "-3", "1e9"] {
        let message = refused(&row.replace("12", count), &ImportOptions::default()).message;
        assert!(message.contains("count") || message.contains("negative"), "{message}");
    }
}

/// Limits count from the initial configuration, in the units of a model file.
#[test]
fn limits_and_friction_are_those_of_the_joint() {
    let of_b = "<limit lower=\"-1\" upper=\"0.5\" effort=\"1\" velocity=\"1\"/><dynamics friction=\"0.1\"/>";
    let urdf = plain(&two_links("revolute", of_b, ""));
    let mjcf = |joint: &str| {
        plain(&format!(
            "<mujoco><worldbody><body><joint name=\"jb\" {joint}/><geom size=\"1\"/></body></worldbody></mujoco>"
        ))
    };
    let joint = |of: &Imported| {
        let model = Model::from_toml(&of.text).unwrap_or_else(|e| panic!("{e}\n{}", of.text));
        let found = model.joints.iter().find(|own| own.name == "jb").unwrap();
        let limits = found.limits.map(|own| own.table());
        let bounds = limits.map_or([f64::NAN; 2], |own| {
            [own.lower.unwrap_or(f64::NAN), own.upper.unwrap_or(f64::NAN)]
        });
        let friction = found.friction.map(|own| [own.torque, own.force]);
        (bounds, friction)
    };
    let near =
        |found: [f64; 2], wanted: [f64; 2]| (0..2).all(|k| (found[k] - wanted[k]).abs() < 1e-12);
    let (bounds, friction) = joint(&urdf);
    assert!(near(bounds, [-1.0, 0.5]), "{bounds:?}");
    assert_eq!(friction, Some([Some(0.1), None]));
    let said = remarks(&urdf);
    assert!(said.contains("limits of effort and velocity: not translated"), "{said}");
    // in degrees, with the coordinate 30° in the drawn configuration
    let hinge = mjcf("range=\"-60 90\" ref=\"30\" frictionloss=\"0.2\" solreflimit=\"0.1 1\"");
    let (bounds, friction) = joint(&hinge);
    assert!(near(bounds, [-90_f64.to_radians(), 60_f64.to_radians()]), "{bounds:?}");
    assert_eq!(friction, Some([Some(0.2), None]));
    assert!(remarks(&hinge).contains("`solreflimit`"), "{}", remarks(&hinge));
    let slide = mjcf("type=\"slide\" range=\"-0.2 0.3\" frictionloss=\"4\"");
    let (bounds, friction) = joint(&slide);
    assert!(near(bounds, [-0.2, 0.3]), "{bounds:?}");
    assert_eq!(friction, Some([None, Some(4.0)]));
    for (text, words) in [
        ("range=\"10 60\"", "the initial configuration is outside of them"),
        ("range=\"10 10\"", "the lower one is not below the upper one"),
        ("type=\"ball\" range=\"0 60\"", "limits of joints with several coordinates"),
        ("type=\"ball\" frictionloss=\"1\"", "dry friction of joints with several coordinates"),
    ] {
        let found = mjcf(text);
        let (bounds, friction) = joint(&found);
        assert!(bounds[0].is_nan() && friction.is_none(), "{text}: {bounds:?} {friction:?}");
        assert!(remarks(&found).contains(words), "{text}: {}", remarks(&found));
    }
    let far = plain(&two_links("revolute", "<limit lower=\"-1e+16\" upper=\"2\"/>", ""));
    let (bounds, _) = joint(&far);
    assert!(bounds[0].is_nan() && (bounds[1] - 2.0).abs() < 1e-12, "{bounds:?}");
    let free = mjcf("range=\"-60 60\" limited=\"false\"");
    assert!(joint(&free).0[0].is_nan() && !remarks(&free).contains("limits"), "{}", free.text);
}
