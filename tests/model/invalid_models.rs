//! What the program says about models that are wrong: where, what, and what to write instead.
//!
//! Every case ends with code 3, prints nothing on standard output and writes no file.
#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{self, PENDULUM, holonom};
use std::fs;
use std::path::{Path, PathBuf};

const TOP: &str = include_str!("../../examples/models/heavy_top_fast.toml");
const BEAM: &str = include_str!("../../examples/models/flying_beam.toml");

fn folder(case: &str) -> PathBuf {
    command::folder("invalid", case)
}

#[test]
fn line_ends_and_marks_of_other_systems_are_fine() {
    let folder = folder("windows");
    let text = format!("\u{feff}{}", PENDULUM.replace('\n', "\r\n"));
    fs::write(folder.join("model.txt"), text).unwrap();
    let output = holonom(&folder, &["check", "model.txt"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Runs the file `model.toml` of a folder, which must be refused; the words of the program.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = holonom(folder, &[&["run", "model.toml"], arguments].concat());
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(output.stdout.is_empty(), "{text}");
    assert!(!folder.join("model-out").exists(), "something was written");
    text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// The model `base` with some of its text replaced.
fn broken(case: &str, base: &str, changes: &[(&str, &str)]) -> String {
    let mut text = base.to_owned();
    for (old, new) in changes {
        assert!(text.contains(old), "{case}: `{old}` is not in the model");
        text = text.replacen(old, new, 1);
    }
    let folder = folder(case);
    fs::write(folder.join("model.toml"), text).unwrap();
    refused(&folder, &[])
}

/// A refused model: its name, the model that it is made from, what is replaced there.
type Case = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

/// The names of what is refused, each with what the program says.
fn table(rows: impl IntoIterator<Item = (impl std::fmt::Display, String)>) -> String {
    let rows = rows.into_iter().map(|(name, words)| format!("== {name}\n{words}"));
    rows.collect::<Vec<_>>().join("\n\n")
}

/// A test and a snapshot for each subject.
macro_rules! tables {
    ($($subject:ident { $($name:ident: $base:ident, $($old:literal => $new:literal),+;)+ })+) => {
        $(#[test]
        fn $subject() {
            let cases: &[Case] = &[$((stringify!($name), $base, &[$(($old, $new)),+])),+];
            let rows = cases.iter().map(|(name, base, changes)| (name, broken(name, base, changes)));
            insta::assert_snapshot!(stringify!($subject), table(rows), "the refusals of one subject");
        })+
    };
}

tables! {
    texts {
        syntax: PENDULUM, "mass = 1.0" => "mass = = 1.0";
        unclosed_string: PENDULUM, "name = \"bob\"" => "name = \"bob";
        unknown_key: PENDULUM, "mass = 1.0" => "mas = 1.0";
        unknown_section: PENDULUM, "[[bar]]" => "[[baar]]";
        unknown_value: TOP, "\"spherical\"" => "\"sperical\"";
        missing_key: PENDULUM, "end = 10.0" => "";
        missing_section: PENDULUM, "[simulation]" => "", "step = 0.01" => "", "end = 10.0" => "";
        single_bracket: PENDULUM, "[[bar]]" => "[bar]";
        wrong_type: PENDULUM, "mass = 1.0" => "mass = \"heavy\"";
        empty: PENDULUM, "[[particle]]\nname = \"bob\"\nmass = 1.0\nposition = [1.0, 0.0]\n" => "",
            "[[bar]]\nname = \"rod\"\nfrom = \"ground\"\nto = \"bob\"\npoint = [0.0, 0.0]\nlength = 1.0\n" => "";
        several: TOP, "mass = 15.0" => "mass = -15.0", "\"top\"\nposition" => "\"tip\"\nposition",
            "step = 0.0002" => "step = -0.0002", "end = 1.0" => "end = 0";
        two_unknown_keys: PENDULUM, "mass = 1.0" => "mas = 1.0\nvelocty = [0, 1]";
        unknown_key_of_a_history: TOP,
            "[simulation]" => "[[load]]\nname = \"l\"\nbody = \"top\"\nhistory = { type = \"ramp\", start = 0, stop = 1 }\n[simulation]";
        key_of_a_path_beside_it: TOP, "[[joint]]" =>
            "[[constraint]]\nname = \"speed\"\ntype = \"motion\"\njoint = \"tip\"\nrate = 1.0\n[[joint]]";
        parameter_without_its_sign: TOP, "[[joint]]" =>
            "[[constraint]]\nname = \"speed\"\ntype = \"motion\"\njoint = \"tip\"\npath = { rate = \"omega\" }\n[[joint]]";
        gravity_as_a_number: TOP, "gravity = [0.0, 0.0, -9.81]" => "gravity = 9.81";
        shapes_as_a_word: TOP, "mass = 15.0" => "mass = 15.0\ncollision = \"shape\"";
        joints_as_a_word: TOP, "[simulation]" =>
            "[[constraint]]\nname = \"g\"\ntype = \"gear\"\njoints = \"tip\"\nratio = 2.0\n[simulation]";
        gravity_of_the_simulation: TOP, "every = 5" => "gravity = [0.0, 0.0, -9.81]";
        step_of_the_model: TOP, "[model]" => "[model]\nstep = 0.001";
        gravity_as_a_section: TOP, "[simulation]" => "[gravity]\nacceleration = 9.81\n[simulation]";
        joint_by_another_name: TOP, "\"spherical\"" => "\"hinge\"";
        key_of_a_picture: TOP, "mass = 15.0" => "mass = 15.0\nmesh = \"top.stl\"";
        files_of_a_text: TOP, "[model]" => "include = [\"leg.toml\", { file = \"leg.toml\", prefx = \"a_\" }]\n[model]";
        key_of_another_program: TOP, "every = 5" => "timestep = 5";
        several_keys: TOP, "mass = 15.0" => "mas = 15.0", "every = 5" => "evry = 5";
    }
    settings {
        zero_step: PENDULUM, "step = 0.01" => "step = 0";
        negative_step: PENDULUM, "step = 0.01" => "step = -0.01";
        nan_step: PENDULUM, "step = 0.01" => "step = nan";
        too_many_steps: PENDULUM, "step = 0.01" => "step = 1e-12";
        unknown_order: PENDULUM, "end = 10.0" => "end = 10.0\norder = 3";
        negative_every: TOP, "every = 5" => "every = -5";
        arc_length_of_a_motion: TOP, "every = 5" => "arc_length = true";
        order_of_statics: TOP, "every = 5" => "scheme = \"static\"\norder = 4";
    }
    bodies {
        negative_mass: PENDULUM, "mass = 1.0" => "mass = -1.0";
        unphysical_inertia: TOP, "0.46875, 0.234375]" => "0.46875, 0.9]";
        negative_inertia: TOP, "[0.234375," => "[-0.234375,";
        malformed_inertia: TOP, "[0.234375, 0.46875, 0.234375]" => "[1.0, 2.0]";
        infinite_position: PENDULUM, "position = [1.0, 0.0]" => "position = [1.0, -inf]";
        huge_number: PENDULUM, "mass = 1.0" => "mass = 1e101";
        overflowing_number: PENDULUM, "mass = 1.0" => "mass = 1e999";
        unknown_body: TOP, "child = \"top\"" => "child = \"topp\"";
        body_of_the_wrong_kind: PENDULUM, "to = \"bob\"" => "to = \"rod\"";
        duplicate_name: PENDULUM, "name = \"rod\"" => "name = \"bob\"";
        reserved_name: TOP, "name = \"top\"" => "name = \"ground\"";
        odd_name: PENDULUM, "name = \"bob\"" => "name = \"a,b\"";
        wrong_dimension: PENDULUM, "position = [1.0, 0.0]" => "position = [1.0, 0.0, 0.0]";
        nothing_moves: TOP, "velocity = [4.61538, 0.0, 0.0]\nangular_velocity = [0.0, 150.0, -4.61538]" => "fixed = true";
    }
    joints_and_bars {
        zero_axis: TOP, "\"spherical\"" => "\"revolute\"\naxis = [0, 0, 0]";
        missing_axis: TOP, "\"spherical\"" => "\"revolute\"";
        missing_second_axis: TOP, "\"spherical\"" => "\"universal\"\naxis = [0, 1, 0]";
        oblique_axes: TOP, "\"spherical\"" => "\"universal\"\naxis = [0, 1, 0]\naxis2 = [1, 1, 0]";
        second_axis_of_a_hinge: TOP,
            "\"spherical\"" => "\"revolute\"\naxis = [0, 1, 0]\naxis2 = [1, 0, 0]";
        bar_too_short_to_compute_with: PENDULUM, "length = 1.0" => "length = 1e-100";
        inconsistent_bar: PENDULUM, "length = 1.0" => "length = 1.25";
        inconsistent_joint: TOP,
            "position = [0.0, 0.0, 0.0]" => "anchor_parent = [0, 0, 0]\nanchor_child = [0, -1.5, 0]";
        joint_of_a_node_with_itself: BEAM, "[[load]]" =>
            "[[joint]]\nname = \"j\"\ntype = \"fixed\"\nparent = \"beam.end\"\nchild = \"beam.20\"\nposition = [0, 8, 0]\n[[load]]";
    }
    orientations_and_frames {
        not_a_unit_quaternion: TOP, "mass = 15.0" => "mass = 15.0\nquaternion = [1, 0, 0, 0.1]";
        two_orientations: TOP,
            "mass = 15.0" => "mass = 15.0\nquaternion = [1, 0, 0, 0]\nrotation_vector = [0, 0, 1]";
        euler_without_angles: TOP, "mass = 15.0" => "mass = 15.0\neuler = { sequence = \"zxz\" }";
        euler_with_an_angle_too_many: TOP,
            "mass = 15.0" => "mass = 15.0\neuler = { sequence = \"y\", degrees = [0, 90] }";
        euler_with_angles_twice: TOP,
            "mass = 15.0" => "mass = 15.0\neuler = { sequence = \"zxz\", angles = [0, 0, 1], degrees = [0, 0, 90] }";
        relative_to_itself: TOP, "mass = 15.0" => "mass = 15.0\nrelative_to = \"top\"";
        relative_in_a_circle: TOP, "mass = 15.0" => "mass = 15.0\nrelative_to = \"tip\"",
            "[[joint]]" => "[[frame]]\nname = \"f\"\nrelative_to = \"top\"\n[[joint]]", "\"spherical\"" => "\"spherical\"\nrelative_to = \"f\"";
        relative_to_nothing: TOP, "mass = 15.0" => "mass = 15.0\nrelative_to = \"tipp\"";
        relative_to_a_whole_beam: BEAM, "[[load]]" =>
            "[[frame]]\nname = \"f\"\nrelative_to = \"beam\"\n[[frame]]\nname = \"g\"\nrelative_to = \"beam.99\"\n[[load]]";
        relative_to_a_point_mass: PENDULUM, "dimension = 2" => "dimension = 3", "gravity = [0.0, -9.81]" => "",
            "position = [1.0, 0.0]" => "position = [1.0, 0.0, 0.0]\n[[particle]]\nname = \"b\"\nmass = 1.0\nposition = [0, 0, 0]\nrelative_to = \"bob\"",
            "point = [0.0, 0.0]" => "";
        relative_in_the_plane: PENDULUM, "mass = 1.0" => "mass = 1.0\nrelative_to = \"ground\"";
        frame_with_an_euler_angle_too_few: TOP,
            "[[body]]" => "[[frame]]\nname = \"f\"\neuler = { sequence = \"zxz\", degrees = [90, 0] }\n[[body]]";
        frame_that_is_no_rotation: TOP, "[[body]]" => "[[frame]]\nname = \"f\"\nquaternion = [1, 1, 0, 0]\n[[body]]";
        fixed_in_a_frame_that_moves: TOP, "[[joint]]" => "[[body]]\nname = \"b\"\nfixed = true\nrelative_to = \"top\"\n[[joint]]";
        follower_with_the_axes_of_a_frame: BEAM, "[[load]]" => "[[load]]\nrelative_to = \"ground\"\nframe = \"body\"";
    }
    beams {
        beam_without_a_line: BEAM, "points = [[6.0, 0.0, 0.0], [0.0, 8.0, 0.0]]" => "";
        beam_of_one_point: BEAM, "[6.0, 0.0, 0.0], [0.0, 8.0, 0.0]" => "[6.0, 0.0, 0.0]";
        beam_without_length: BEAM, "[0.0, 8.0, 0.0]" => "[6.0, 0.0, 0.0]";
        beam_with_two_lines: BEAM, "elements = 20" => "elements = 20\ncurve = { type = \"spline\", points = [[0, 0, 0], [1, 0, 0]] }";
        beam_without_elements: BEAM, "elements = 20" => "elements = 0";
        beam_with_too_many_elements: BEAM, "elements = 20" => "elements = 1000000";
        beam_with_odd_elements: BEAM, "elements = 20" => "elements = [20, 10]";
        beam_with_half_an_element: BEAM, "elements = 20" => "elements = 2.5";
        beam_of_unknown_order: BEAM, "elements = 20" => "elements = 20\norder = 4";
        beam_with_a_normal_along_it: BEAM, "elements = 20" => "elements = 20\nnormal = [-6, 8, 0]";
        beam_that_needs_a_normal: BEAM, "EI2 = 100.0" => "EI2 = 50.0";
        beam_with_an_unknown_end: BEAM, "elements = 20" => "elements = 20\nstart = \"clampt\"";
        arc_without_radius: BEAM, "points = [[6.0, 0.0, 0.0], [0.0, 8.0, 0.0]]" =>
            "curve = { type = \"arc\", from = [1, 0, 3], center = [1, 0, 0], axis = [0, 0, 1], angle = 1 }";
        arc_without_angle: BEAM, "points = [[6.0, 0.0, 0.0], [0.0, 8.0, 0.0]]" =>
            "curve = { type = \"arc\", from = [1, 0, 0], center = [0, 0, 0], axis = [0, 0, 1], angle = 0 }";
        section_that_lacks_numbers: BEAM, "EA = 1e4, GA1 = 1e4," => "";
        section_with_a_negative_number: BEAM, "EA = 1e4" => "EA = -1e4";
        section_of_no_mass: BEAM, "rhoI2 = 10.0" => "rhoI2 = 10.0, rhoJ = 25.0";
        section_with_half_a_shape: BEAM, "EA = 1e4, GA1 = 1e4," => "shape = { type = \"circle\", dimensions = [0.1, 0.2] },";
        section_with_two_shear_moduli: BEAM, "EA = 1e4," =>
            "shape = { type = \"circle\", dimensions = [0.1] }, material = { E = 1, G = 1, nu = 0.3, density = 1 },";
        section_with_an_unknown_key: BEAM, "EA = 1e4" => "Ea = 1e4";
        node_that_does_not_exist: BEAM, "body = \"beam.start\"" => "body = \"beam.21\"";
        node_of_no_beam: BEAM, "body = \"beam.start\"" => "body = \"baem.start\"";
        beam_in_the_place_of_a_node: BEAM, "body = \"beam.start\"" => "body = \"beam\"";
        clamp_that_moves: BEAM, "elements = 20" => "elements = 20\nstart = \"clamped\"\nangular_velocity = [0, 0, 1]";
        elements_bent_too_far: BEAM, "points = [[6.0, 0.0, 0.0], [0.0, 8.0, 0.0]]" =>
            "curve = { type = \"arc\", from = [1, 0, 0], center = [0, 0, 0], axis = [0, 0, 1], angle = 6.28 }",
            "elements = 20" => "elements = 3";
    }
    loads_and_sensors {
        load_on_nothing: BEAM, "body = \"beam.start\"" => "";
        load_on_two_things: BEAM, "body = \"beam.start\"" => "body = \"beam.start\"\nbeam = \"beam\"";
        section_force_without_an_element: BEAM, "[[load]]" =>
            "[[sensor]]\nname = \"s\"\ntype = \"section_force\"\nof = \"beam\"\n[[sensor]]\nname = \"t\"\ntype = \"strain\"\nof = \"beam\"\nelement = 20\n[[load]]";
        section_force_beyond_the_beam: BEAM, "[[load]]" =>
            "[[sensor]]\nname = \"s\"\ntype = \"section_force\"\nof = \"beam\"\nat = 10.5\n[[sensor]]\nname = \"t\"\ntype = \"strain\"\nof = \"beam\"\nelement = 1\nat = 2\n[[sensor]]\nname = \"u\"\ntype = \"position\"\nof = \"beam.1\"\nat = 2\n[[load]]";
        sensor_of_nothing: TOP,
            "[simulation]" => "[[sensor]]\nname = \"s\"\ntype = \"position\"\nof = \"topp\"\n[simulation]";
        sensors_of_the_wrong_kind: TOP,
            "[simulation]" => "[[sensor]]\nname = \"a\"\ntype = \"joint_rate\"\nof = \"top\"\n[[sensor]]\nname = \"b\"\ntype = \"orientation\"\nof = \"tip\"\n[[sensor]]\nname = \"top\"\ntype = \"reaction\"\nof = \"top\"\npoint = [0, 0, 1]\n[simulation]";
        unknown_type_of_sensor: TOP,
            "[simulation]" => "[[sensor]]\nname = \"s\"\ntype = \"force\"\nof = \"tip\"\n[simulation]";
        sensor_of_a_fixed_joint: TOP, "\"spherical\"" => "\"fixed\"",
            "[simulation]" => "[[sensor]]\nname = \"s\"\ntype = \"joint_coordinate\"\nof = \"tip\"\n[simulation]";
        linear_history_backwards: TOP,
            "[simulation]" => "[[load]]\nname = \"l\"\nbody = \"top\"\nforce = [1, 0, 0]\nhistory = { type = \"linear\", end = 0.0 }\n[simulation]";
    }
    controls {
        control_of_nothing: TOP, "[simulation]" => "[[control]]\nname = \"c\"\nhold = 2\n[simulation]";
        control_of_two_things: TOP, "[simulation]" => "[[control]]\nname = \"c\"\njoint = \"tip\"\nbody = \"top\"\nforce = [1, 0, 0]\n[simulation]";
        control_of_an_unknown_body: TOP, "[simulation]" => "[[control]]\nname = \"c\"\nbody = \"topp\"\nforce = [1, 0, 0]\n[simulation]";
        control_without_a_direction: TOP, "[simulation]" => "[[control]]\nname = \"c\"\nbody = \"top\"\n[simulation]";
        control_of_a_body_by_freedom: TOP, "[simulation]" => "[[control]]\nname = \"c\"\nbody = \"top\"\nfreedom = 1\nforce = [1, 0, 0]\n[simulation]";
        torque_at_a_point: TOP, "[simulation]" => "[[control]]\nname = \"c\"\nbody = \"top\"\ntorque = [1, 0, 0]\npoint = [0, 0, 1]\n[simulation]";
        effort_with_keys_of_a_wrench: TOP, "[simulation]" => "[[control]]\nname = \"c\"\njoint = \"tip\"\ntorque = [1, 0, 0]\nframe = \"body\"\n[simulation]";
        wrench_with_the_axes_of_a_frame: TOP, "[simulation]" => "[[control]]\nname = \"c\"\nbody = \"top\"\nforce = [1, 0, 0]\nframe = \"body\"\nrelative_to = \"ground\"\n[simulation]";
        wrench_bounds_in_the_wrong_order: TOP, "[simulation]" => "[[control]]\nname = \"c\"\nbody = \"top\"\nforce = [1, 0, 0]\nmin = 2.0\nmax = 1.0\n[simulation]";
    }
}
#[test]
fn files_and_options() {
    let with = |case: &str, bytes: &[u8]| {
        let folder = folder(case);
        fs::write(folder.join("model.toml"), bytes).unwrap();
        refused(&folder, &[])
    };
    let directory = folder("directory");
    fs::create_dir(directory.join("model.toml")).unwrap();
    let huge = folder("huge");
    let file = fs::File::create(huge.join("model.toml")).unwrap();
    file.set_len(100 * 1024 * 1024).unwrap(); // sparse
    let of_huge = refused(&huge, &[]);
    let files = [
        ("a_missing_file", refused(&folder("missing"), &[])),
        ("a_directory", refused(&directory, &[])),
        ("bytes_that_are_no_text", with("bytes", b"[model]\nname = \"\xff\"")),
        ("an_empty_file", with("nothing", b"")),
        ("a_huge_file", of_huge),
    ];
    let folder = folder("overrides");
    fs::write(folder.join("model.toml"), PENDULUM).unwrap();
    let options = [
        "--set particle.bob.mass=-2",
        "--set particle.bobb.mass=2",
        "--set particle.bob.mas=2",
        "--set particle.bob.position.7=2",
        "--set particle.bob.mass=heavy",
        "--set bar.rod.length=1.25",
        "--set simulation.step=nan",
        "--set nonsense=1",
        "--step -0.1",
    ];
    let words = |option: &str| refused(&folder, &option.split(' ').collect::<Vec<_>>());
    let rows = files.into_iter().chain(options.map(|option| (option, words(option))));
    insta::assert_snapshot!("files_and_options", table(rows), "the refusals of one subject");
}

#[test]
fn problems_for_machines() {
    let folder = folder("machines");
    fs::write(folder.join("model.toml"), PENDULUM.replace("mass = 1.0", "mass = -1.0")).unwrap();
    let output = holonom(&folder, &["check", "model.toml", "--json"]);
    assert_eq!(output.status.code(), Some(3));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    insta::assert_json_snapshot!(json);
}

#[test]
fn hostile_texts_end_with_code_3_and_few_words() {
    let many = (0..60_000).map(|_| "[[particle]]\nname = \"p\"\nmass = -1\nposition = []\n");
    let cases = [
        ("[".repeat(1_000_000), "deep arrays"),
        (format!("{PENDULUM}x = {}", "[".repeat(100_000)), "deep arrays below a key"),
        (format!("{PENDULUM}\n[a{}]\n", ".a".repeat(100_000)), "deep tables"),
        (many.collect::<String>() + PENDULUM, "many members of one name"),
        ("\u{feff}\0\0".to_owned(), "control characters"),
        (format!("{PENDULUM}x = {}", "9".repeat(1_000_000)), "a long number"),
    ];
    let folder = folder("hostile");
    for (text, what) in cases {
        fs::write(folder.join("model.toml"), text).unwrap();
        let output = holonom(&folder, &["check", "model.toml"]);
        assert_eq!(output.status.code(), Some(3), "{what}");
        assert!(output.stderr.len() < 1_000_000, "{what}: {} bytes", output.stderr.len());
    }
}

/// A wish, numbers that a section lacks, a part that a joint cannot hold: what to write stands in
/// the help to its last word.
#[test]
fn the_help_says_all_of_what_to_write() {
    let rope = |own: &str, section: &str, rest: &str| {
        format!(
            "[model]\nname = \"rope\"\n[simulation]\nstep = 0.01\nend = 0.1\n[[beam]]\nname = \"rope\"\n\
             points = [[0, 0, 0], [0, 0, -2]]\nelements = 10\n{own}\nstart = \"pinned\"\n\
             section = {{ EA = 2e6, GA1 = 1e5, GA2 = 1e5, {section}rhoA = 0.1, rhoI1 = 1e-6, rhoI2 = 1e-6 }}\n{rest}"
        )
    };
    let bends = "EI1 = 1.0, EI2 = 1.0, GJ = 1.0, ";
    let weight = "[[particle]]\nname = \"m\"\nmass = 5.0\nposition = [0, 0, -2]\n[[joint]]\nname = \"at\"\n\
                  type = \"spherical\"\nparent = \"rope.end\"\nchild = \"m\"\nposition = [0, 0, -2]\n";
    let cases = [
        ("wish", rope("rope = true", bends, ""), "Ropes with mass over pulleys are not modelled"),
        (
            "bends",
            rope("", "", ""),
            "write 1e-6 EA ℓ² = 2e0 ℓ² N m² for each, ℓ the length of an element, m",
        ),
        (
            "twist",
            rope("element = \"rope\"", "EI1 = 1.0, EI2 = 1.0, ", ""),
            "never 0: write 1e-6 EA ℓ²",
        ),
        (
            "held",
            rope("", bends, weight),
            "`m` as a [[body]] with its `mass` and `inertia = [J, J, J]`",
        ),
    ];
    for (name, text, words) in cases {
        let folder = folder(name);
        fs::write(folder.join("model.toml"), text).unwrap();
        let said = refused(&folder, &[]);
        let line = said.split_whitespace().collect::<Vec<_>>().join(" ");
        println!("{said}");
        assert!(line.contains(words), "{said}");
        assert!(!line.contains('…'), "{said}");
    }
}
