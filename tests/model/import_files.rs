//! `holonom import`: the files it writes, what it says, what it refuses.

use std::fs;
use std::path::PathBuf;

use crate::program::command::{code, folder, holonom, words};

/// A robot in a few lines: a base, an arm with a damper, a finger that follows it, a camera without
/// mass.
const ARM: &str = r#"<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="arm">
    <inertial>
      <origin xyz="0 0 0.25" rpy="0 0 0"/>
      <mass value="1.5"/>
      <inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.002"/>
    </inertial>
    <visual>
      <origin xyz="0 0 0.25"/>
      <geometry><cylinder radius="0.04" length="0.5"/></geometry>
    </visual>
    <collision>
      <geometry><cylinder radius="0.05" length="0.5"/></geometry>
    </collision>
  </link>
  <link name="finger">
    <inertial>
      <mass value="0.2"/>
      <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/>
    </inertial>
    <visual><geometry><mesh filename="finger.stl"/></geometry></visual>
  </link>
  <link name="cross"/>
  <link name="tip">
    <inertial>
      <origin xyz="0.1 0 0"/>
      <mass value="0.1"/>
      <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/>
    </inertial>
  </link>
  <link name="camera"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/> <child link="arm"/>
    <origin xyz="0 0 0.1" rpy="0 0 0"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="10" velocity="1"/>
    <dynamics damping="0.3" friction="0.1"/>
  </joint>
  <joint name="grip" type="prismatic">
    <parent link="arm"/> <child link="finger"/>
    <origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/>
    <axis xyz="1 0 0"/>
    <mimic joint="shoulder" multiplier="0.1" offset="0.02"/>
  </joint>
  <joint name="pitch" type="continuous">
    <parent link="arm"/> <child link="cross"/>
    <origin xyz="0 0 0.6"/>
    <axis xyz="0 1 0"/>
  </joint>
  <joint name="yaw" type="continuous">
    <parent link="cross"/> <child link="tip"/>
    <axis xyz="0 0 1"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="tip"/><child link="camera"/></joint>
  <transmission name="drive"/>
</robot>
"#;

/// A door with a spring, a handle of two hinges, and a loop.
const DOOR: &str = r#"<mujoco model="door">
  <compiler angle="degree"/>
  <option timestep="0.004" gravity="0 0 -9.8"/>
  <default>
    <joint damping="0.1"/>
    <default class="stiff"><joint stiffness="5" springref="20"/></default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="door" pos="0 0 1" childclass="stiff">
      <joint name="hinge" pos="-0.4 0 0" axis="0 0 1" range="-10 90" armature="0.01"/>
      <geom type="box" size="0.4 0.02 1" density="500"/>
      <body name="handle" pos="0.3 0.05 0">
        <joint name="lift" axis="1 0 0" class="main"/>
        <joint name="turn" axis="0 1 0" class="main"/>
        <geom type="capsule" fromto="0 0 0 0 0.1 0" size="0.01"/>
      </body>
    </body>
    <body name="link" pos="-0.4 0.5 1">
      <joint name="pivot" axis="0 0 1"/>
      <geom type="capsule" fromto="0 0 0 0.4 -0.48 0" size="0.02"/>
    </body>
  </worldbody>
  <equality><connect body1="door" body2="link" anchor="0 0.02 0"/></equality>
  <actuator><motor joint="hinge"/></actuator>
</mujoco>
"#;

/// A folder with a file of this text.
fn file(case: &str, name: &str, text: &str) -> PathBuf {
    let folder = folder("import", case);
    fs::write(folder.join(name), text).unwrap();
    folder
}

#[test]
fn a_urdf_becomes_a_commented_model_that_runs() {
    let folder = file("urdf", "arm.urdf", ARM);
    assert_eq!(code(&folder, &["import", "arm.urdf"]), 0);
    insta::assert_snapshot!("arm", fs::read_to_string(folder.join("arm.toml")).unwrap());
    assert_eq!(code(&folder, &["run", "arm.toml", "--quiet", "--end", "0.1"]), 0);
    assert_eq!(code(&folder, &["import", "arm.urdf"]), 2, "nothing is overwritten");
    let again = ["import", "arm.urdf", "--force", "--free-base", "--joint", "shoulder=0.4"];
    assert_eq!(code(&folder, &again), 0);
    assert_eq!(code(&folder, &["check", "arm.toml"]), 0);
}

#[test]
fn an_mjcf_becomes_a_commented_model_that_runs() {
    let folder = file("mjcf", "door.xml", DOOR);
    assert_eq!(code(&folder, &["import", "door.xml", "-o", "model.toml"]), 0);
    insta::assert_snapshot!("door", fs::read_to_string(folder.join("model.toml")).unwrap());
    assert_eq!(code(&folder, &["run", "model.toml", "--quiet", "--end", "0.1"]), 0);
}

#[test]
fn what_is_not_translated_is_data_too() {
    let folder = file("json", "door.xml", DOOR);
    let output = holonom(&folder, &["import", "door.xml", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    insta::assert_json_snapshot!("report", report);
}

/// What is wrong with a text, as it is shown.
fn refused(case: &str, text: &str) -> String {
    let folder = file(case, "robot.xml", text);
    let output = holonom(&folder, &["import", "robot.xml"]);
    assert_eq!(output.status.code(), Some(3), "{case}: {}", words(&output));
    let left = fs::read_dir(&folder).unwrap().count();
    assert_eq!(left, 1, "{case}: nothing is written");
    format!("### {case}\n{}", words(&output))
}

#[test]
fn errors_name_the_place_and_the_remedy() {
    let urdf = |inside: &str| format!("<robot name=\"r\">\n{inside}\n</robot>\n");
    let mjcf = |inside: &str| format!("<mujoco>\n<worldbody>\n{inside}\n</worldbody>\n</mujoco>\n");
    let links = |joints: &str| urdf(&format!("<link name=\"a\"/><link name=\"b\"/>\n{joints}"));
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint>\n"
        )
    };
    let inertia =
        "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"3\"/></inertial>";
    let heavy = urdf(&format!(
        "<link name=\"a\"/>\n<link name=\"b\">{inertia}</link>\n{}",
        joint("j", "a", "b")
    ));
    let deep = format!("{}{}", "<body>".repeat(300), "</body>".repeat(300));
    let cases = [
        ("malformed", "<robot><link></robot>".to_owned()),
        ("neither", "<sdf version=\"1.6\"/>".to_owned()),
        ("empty", String::new()),
        ("xacro", urdf("<link name=\"${prefix}base\"/>")),
        ("no link", urdf("")),
        ("no name", urdf("<link/>")),
        ("two of a name", urdf("<link name=\"a\"/><link name=\"a\"/>")),
        ("two roots", links("")),
        ("two parents", links(&(joint("j", "a", "b") + &joint("k", "a", "b")))),
        ("circle", links(&(joint("j", "a", "b") + &joint("k", "b", "a")))),
        ("unknown link", links(&joint("j", "a", "c"))),
        (
            "unknown type",
            links(
                "<joint name=\"j\" type=\"revolut\"><parent link=\"a\"/><child link=\"b\"/></joint>",
            ),
        ),
        (
            "not a number",
            links(
                "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"0 nan 0\"/></joint>",
            ),
        ),
        (
            "two numbers",
            links(
                "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"0 0\"/></joint>",
            ),
        ),
        (
            "nothing moves",
            links(
                "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>",
            ),
        ),
        ("impossible inertia", heavy),
        ("no body", mjcf("")),
        ("deep", mjcf(&deep)),
        ("unknown class", mjcf("<body><joint class=\"x\"/></body>")),
        ("a size of zero", mjcf("<body><joint/><geom size=\"0\"/></body>")),
        ("zero axis", mjcf("<body><joint axis=\"0 0 0\"/><geom size=\"1\"/></body>")),
        ("two orientations", mjcf("<body quat=\"1 0 0 0\" euler=\"0 0 0\"/>")),
        ("a missing file", "<mujoco><include file=\"none.xml\"/></mujoco>".to_owned()),
        ("itself", "<mujoco><include file=\"robot.xml\"/></mujoco>".to_owned()),
    ];
    let shown: Vec<String> = cases.iter().map(|(case, text)| refused(case, text)).collect();
    insta::assert_snapshot!("errors", shown.join("\n"));
}

#[test]
fn problems_are_data_too() {
    let folder = file(
        "json_error",
        "robot.xml",
        "<mujoco><worldbody><body pos=\"x\"/></worldbody></mujoco>",
    );
    let output = holonom(&folder, &["import", "robot.xml", "--json"]);
    assert_eq!(output.status.code(), Some(3), "{}", words(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    insta::assert_json_snapshot!("problem", report);
}

/// A tetrahedron with corners at the origin and at 1 m on each axis, without its last `missing`
/// faces.
fn tetrahedron(missing: usize) -> String {
    let corners = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let face = |face: &[usize; 3]| {
        let vertices: String = face.iter().map(|k| format!("vertex {}\n", corners[*k])).collect();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let facets: String = faces[..4 - missing].iter().map(face).collect();
    format!("solid t\n{facets}endsolid t\n")
}

#[test]
fn a_mesh_gives_the_picture_and_the_mass_by_its_density() {
    let robot = r#"<robot name="r">
<link name="base"/>
<link name="stone"><visual><geometry><mesh filename="package://stones/t.stl"/></geometry></visual></link>
<joint name="j" type="revolute"><parent link="base"/><child link="stone"/></joint>
</robot>
"#;
    let folder = file("mesh", "robot.urdf", robot);
    fs::write(folder.join("t.stl"), tetrahedron(0)).unwrap();
    assert_eq!(code(&folder, &["import", "robot.urdf", "--density", "600"]), 0);
    let text = fs::read_to_string(folder.join("robot.toml")).unwrap();
    let meshes = holonom::model::Meshes::in_folder(&folder);
    let model = holonom::Model::from_toml_in(&text, &[], meshes).unwrap();
    let body = &model.bodies[0];
    let (mass, inertia) = (body.mass(), body.inertia_tensor());
    assert!((mass - 100.0).abs() < 1e-13, "{mass}"); // V = 1/6
    // 3/40 m for the tetrahedron at a corner of a cube
    assert!((inertia[(0, 0)] - 7.5).abs() < 1e-13, "{inertia}");
    assert!((inertia[(0, 1)] - 1.25).abs() < 1e-13, "{inertia}"); // 1/80 m
    assert_eq!(body.mesh_files().collect::<Vec<_>>(), ["t.stl"]);
    let [low, high] = model.surface(body).unwrap().ends();
    let placed = (low.add_scalar(0.25)).amax().max(high.add_scalar(-0.75).amax());
    assert!(placed < 1e-15, "the centre of mass is in the origin of the body: {placed:e}");

    fs::write(folder.join("t.stl"), tetrahedron(1)).unwrap();
    let output = holonom(&folder, &["import", "robot.urdf", "--density", "600", "--force"]);
    assert_eq!(output.status.code(), Some(0));
    let words = words(&output);
    assert!(words.contains("it is not closed: 3 edges have no partner"), "{words}");
    let text = fs::read_to_string(folder.join("robot.toml")).unwrap();
    let mass = holonom::Model::from_toml_in(&text, &[], holonom::model::Meshes::in_folder(&folder));
    let mass = mass.unwrap().bodies[0].mass();
    assert!(mass > 0.0 && mass < 100.0, "a part of the tetrahedron: {mass} kg");
}

/// The options that a refusal names, and those for loops and armatures.
#[test]
fn options_repair_close_and_leave_out() {
    let impossible =
        ARM.replace("iyy=\"0.03\" iyz=\"0\" izz=\"0.002\"", "iyy=\"0.03\" izz=\"0.2\"");
    let folder = file("options", "arm.urdf", &impossible);
    let output = holonom(&folder, &["import", "arm.urdf"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(words(&output).contains("--repair-inertia"), "{}", words(&output));
    let output = holonom(&folder, &["import", "arm.urdf", "--repair-inertia"]);
    assert_eq!(output.status.code(), Some(0));
    let said = words(&output);
    assert!(said.contains("\"arm\" (0.0300, 0.0300, 0.200 -> 0.0867, 0.0867, 0.0867)"), "{said}");

    fs::write(folder.join("door.xml"), DOOR).unwrap();
    assert_eq!(
        code(&folder, &["import", "door.xml", "--no-armature", "--close", "handle=link"]),
        0
    );
    let text = fs::read_to_string(folder.join("door.toml")).unwrap();
    assert!(!text.contains("rotor\""), "{text}");
    assert!(text.contains("name = \"handle_link\"\ntype = \"spherical\""), "{text}");
    assert!(text.contains("project_start = true"), "the two are apart: {text}");
    let hinge = ["import", "door.xml", "--force", "--close", "door=link:revolute"];
    assert_eq!(code(&folder, &hinge), 0);
    let text = fs::read_to_string(folder.join("door.toml")).unwrap();
    assert!(text.contains("name = \"door_link\"\ntype = \"revolute\""), "{text}");
    assert!(text.contains("[[body]]\nname = \"hinge_rotor\""), "{text}");
    for wrong in ["door", "door=", "=link"] {
        assert_eq!(
            code(&folder, &["import", "door.xml", "--force", "--close", wrong]),
            2,
            "{wrong}"
        );
    }
    assert_eq!(code(&folder, &["import", "door.xml", "--force", "--close", "door=lnk"]), 3);
}

/// The frame of the link stays that of the body: the mesh is where the description has it, and its
/// file is named from the folder of the model file.
#[test]
fn a_mesh_stays_where_the_description_has_it() {
    let robot = r#"<robot name="r">
<link name="base"/>
<link name="link">
  <inertial><origin xyz="0.1 0.2 0"/><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"/></inertial>
  <visual>
    <origin xyz="0 0 0.3" rpy="0 0 1.5707963267948966"/>
    <geometry><mesh filename="../parts/bar.obj" scale="0.1 0.1 0.1"/></geometry>
  </visual>
</link>
<joint name="j" type="continuous"><parent link="base"/><child link="link"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint>
</robot>
"#;
    let folder = file("placed_mesh", "robot.urdf", robot);
    for name in ["robots", "models", "parts"] {
        fs::create_dir_all(folder.join(name)).unwrap();
    }
    fs::rename(folder.join("robot.urdf"), folder.join("robots/robot.urdf")).unwrap();
    fs::write(folder.join("parts/bar.obj"), crate::output::meshes::angle_bar()).unwrap();
    assert_eq!(code(&folder, &["import", "robots/robot.urdf", "-o", "models/robot.toml"]), 0);
    let text = fs::read_to_string(folder.join("models/robot.toml")).unwrap();
    insta::assert_snapshot!("placed_mesh", text);
    assert_eq!(code(&folder, &["run", "models/robot.toml", "-q", "--end", "0.1", "-o", "out"]), 0);
    let meshes = holonom::model::Meshes::in_folder(folder.join("models"));
    let model = holonom::Model::from_toml_in(&text, &[], meshes).unwrap();
    let [low, high] = model.surface(&model.bodies[0]).unwrap().ends();
    // a quarter turn takes x to y and y to −x: x from −0.05 to 0, y from 0 to 0.3, z from 0.3 to
    // 0.6 in the frame of the link
    let expected = ([-0.05, 0.0, 0.3], [0.0, 0.3, 0.6]);
    let center = [0.1, 0.2, 0.0];
    for i in 0..3 {
        let missed = (low[i] + center[i] - expected.0[i]).abs();
        let missed = missed.max((high[i] + center[i] - expected.1[i]).abs());
        assert!(missed < 1e-15, "axis {i}: {missed:e} m");
    }
}

/// Several visuals of a link: all of them are seen, each where the description has it.
#[test]
fn all_geometries_of_a_link_are_in_the_picture() {
    let robot = r#"<robot name="r">
<link name="base"/>
<link name="link">
  <inertial><origin xyz="0 0 0.5"/><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"/></inertial>
  <visual><origin xyz="0 0 0.3" rpy="0 0 1.5707963267948966"/><geometry><mesh filename="bar.obj" scale="0.1 0.1 0.1"/></geometry></visual>
  <visual><origin xyz="0 1 0.5" rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.1" length="0.6"/></geometry></visual>
  <visual><origin xyz="-2 0 0.5"/><geometry><sphere radius="0.25"/></geometry></visual>
</link>
<joint name="j" type="continuous"><parent link="base"/><child link="link"/><axis xyz="0 1 0"/></joint>
</robot>
"#;
    let folder = file("geometries", "robot.urdf", robot);
    fs::write(folder.join("bar.obj"), crate::output::meshes::angle_bar()).unwrap();
    assert_eq!(code(&folder, &["import", "robot.urdf"]), 0);
    let text = fs::read_to_string(folder.join("robot.toml")).unwrap();
    insta::assert_snapshot!("geometries", text);
    let meshes = holonom::model::Meshes::in_folder(&folder);
    let model = holonom::Model::from_toml_in(&text, &[], meshes).unwrap();
    let surface = model.surface(&model.bodies[0]).unwrap();
    let [low, high] = surface.ends();
    println!("{} triangles from {low:?} to {high:?}", surface.triangles.len());
    // the sphere ends the picture along -x and -y, the cylinder along y, the mesh along z
    let expected = ([-2.25, -0.25, -0.25], [0.1, 1.3, 0.25]);
    for i in 0..3 {
        let missed = (low[i] - expected.0[i]).abs().max((high[i] - expected.1[i]).abs());
        assert!(missed < 1e-14, "axis {i}: {missed:e} m");
    }
}
