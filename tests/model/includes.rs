//! A model in several files is the model that one file would be; what is wrong with an included
//! file is named with that file, line and column.

use crate::program::command::{self, holonom, words};
use holonom::model::ModelText;
use holonom::{Model, Override};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

const LEG: &str = include_str!("../models/leg.toml");

const WALKER: &str = include_str!("../models/walker.toml");

fn folder(case: &str) -> PathBuf {
    let folder = command::folder("includes", case);
    fs::create_dir_all(folder.join("parts")).unwrap();
    fs::write(folder.join("parts/leg.toml"), LEG).unwrap();
    fs::write(folder.join("model.toml"), WALKER).unwrap();
    folder
}

/// The parts of a leg as they would be written by hand, prefix and frame stated with each.
fn leg(prefix: &str, frame: &str, length: &str) -> String {
    let mut text =
        format!("[[frame]]\nname = \"{prefix}frame\"\nrelative_to = \"trunk\"\n{frame}\n");
    for part in LEG.split("\n[[").skip(1) {
        let mut part = format!("\n[[{part}\n");
        for name in ["thigh", "shank", "knee", "hip", "bend"] {
            part = part.replace(&format!("\"{name}\""), &format!("\"{prefix}{name}\""));
        }
        let part = part.replace("-knee", "-length/2").replace("length/2", &format!("({length})/2"));
        let part = part.replace("\"= length\"", &format!("\"= {length}\""));
        let free = !part.contains("relative_to") && !part.contains("[[sensor]]");
        text += &part;
        text += &if free { format!("relative_to = \"{prefix}frame\"\n") } else { String::new() };
    }
    text
}

#[test]
fn a_file_placed_four_times_is_the_model_written_by_hand() {
    let folder = folder("four_legs");
    let set = [Override::new("parameters.half", "0.3")];
    let included = ModelText::read(&folder.join("model.toml"));
    let mut by_hand =
        WALKER.split_once("]\n\n[model]").map(|(_, rest)| format!("[model]{rest}")).unwrap();
    by_hand += &leg("fl_", "position = [0.5, \"= half\", 0.0]", "0.3");
    by_hand += &leg("fr_", "position = [0.5, \"= -half\", 0.0]", "0.3");
    let turned = "euler = { sequence = \"zxz\", degrees = [180.0, 0.0, 0.0] }";
    by_hand += &leg("bl_", &format!("position = [-0.5, \"= half\", 0.0]\n{turned}"), "0.3");
    by_hand += &leg("br_", "position = [-0.5, \"= -half\", 0.0]", "0.25 + half/2");
    for set in [&[][..], &set] {
        let found = included.model(set).unwrap();
        let expected = Model::from_toml_with(&by_hand, set).unwrap();
        assert_eq!(found.bodies.len(), 9);
        assert_eq!(found.to_toml(), expected.to_toml(), "to the last bit");
        // the merged text is a model file itself
        assert_eq!(Model::from_toml_with(included.text().unwrap(), set).unwrap(), found);
    }
}

/// Directions of a wrench that are fixed in space turn with the frame of the file; those of the
/// body do not.
#[test]
fn controls_of_an_included_file_have_its_frame() {
    let folder = folder("controls");
    let controls = "\n[[control]]\nname = \"jet\"\nbody = \"shank\"\nforce = [1.0, 2.0, 3.0]\n\
                    torque = [0.5, 0.0, 0.1]\n\
                    \n[[control]]\nname = \"thrust\"\nbody = \"shank\"\nforce = [1.0, 2.0, 3.0]\nframe = \"body\"\n\
                    \n[[control]]\nname = \"servo\"\njoint = \"knee\"\n";
    fs::write(folder.join("parts/leg.toml"), format!("{LEG}{controls}")).unwrap();
    let level = WALKER.replace("[0.0, 10.0, 90.0]", "[0.0, 0.0, 0.0]");
    fs::write(folder.join("model.toml"), level).unwrap();
    let found = ModelText::read(&folder.join("model.toml")).model(&[]).unwrap();
    let own = |name: &str| found.controls.iter().find(|own| own.name == name).unwrap();
    let off = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
    let (still, turned) = (own("fl_jet"), own("bl_jet")); // the second by half a turn about z
    assert!(off(still.force, [1.0, 2.0, 3.0]) < 1e-15, "{still:?}");
    assert!(off(turned.force, [-1.0, -2.0, 3.0]) < 1e-15, "{turned:?}");
    assert!(off(turned.torque, [-0.5, 0.0, 0.1]) < 1e-15, "{turned:?}");
    assert_eq!((turned.body.as_deref(), &turned.relative_to), (Some("bl_shank"), &None));
    assert!(off(own("bl_thrust").force, [1.0, 2.0, 3.0]) == 0.0);
    assert_eq!(own("bl_servo").joint.as_deref(), Some("bl_knee"));
}

#[test]
fn prefixes_add_up_and_values_of_the_including_file_count() {
    let folder = folder("nested");
    let pair = "include = [{ file = \"leg.toml\", prefix = \"l_\", relative_to = \"trunk\", parameters = { length = \"= size\" } }]\n\
                [parameters]\nsize = 0.1\n[[body]]\nname = \"trunk\"\nmass = 1.0\ninertia = [1, 1, 1]\nposition = [1, 0, 0]\n";
    fs::write(folder.join("parts/pair.toml"), pair).unwrap();
    let head = "model = { name = \"m\" }\nsimulation = { step = 0.1, end = 1.0 }\n";
    let text = format!(
        "include = [{{ file = \"parts/pair.toml\", prefix = \"a_\" }}, \"parts/pair.toml\"]\n{head}[parameters]\nsize = 0.7\n"
    );
    fs::write(folder.join("model.toml"), text).unwrap();
    let read = ModelText::read(&folder.join("model.toml"));
    let model = read.model(&[]).unwrap();
    let names: Vec<&str> = model.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["a_trunk", "a_l_thigh", "a_l_shank", "trunk", "l_thigh", "l_shank"]);
    let lengths = ["a_l_thigh", "l_thigh"]
        .map(|name| model.body(name).unwrap().shape.clone().unwrap().dimensions[0]);
    assert_eq!(lengths.map(f64::to_bits), [0.1_f64, 0.7].map(f64::to_bits), "{lengths:?}");
    assert_eq!(model.joints[1].parent, "a_trunk", "the nearest file that defines a name is meant");
    let set =
        [Override::new("parameters.a_size", "0.2"), Override::new("body.a_l_thigh.mass", "5")];
    let changed = read.model(&set).unwrap();
    assert_eq!(changed.body("a_l_thigh").unwrap().position[2].to_bits(), (-0.1_f64).to_bits());
    assert_eq!(changed.body("a_l_thigh").unwrap().mass.map(f64::to_bits), Some(5.0_f64.to_bits()));
    let text = format!(
        "include = [{{ file = \"parts/pair.toml\", prefix = \"a_\", parameters = {{ l_length = 0.9 }} }}]\n{head}"
    );
    fs::write(folder.join("model.toml"), text).unwrap();
    let model = ModelText::read(&folder.join("model.toml")).model(&[]).unwrap();
    let outermost = model.body("a_l_thigh").unwrap().shape.clone().unwrap().dimensions[0];
    assert_eq!(outermost.to_bits(), 0.9_f64.to_bits(), "the outermost file counts");
}

/// Runs and sweeps need the included files only when they begin.
#[test]
fn runs_and_sweeps_keep_the_merged_model() {
    let folder = folder("contained");
    let run = holonom(&folder, &["run", "model.toml", "--checkpoint-every", "4"]);
    assert_eq!(run.status.code(), Some(0), "{}", words(&run));
    let sweep = [
        "sweep",
        "model.toml",
        "--vary",
        "parameters.half=0.1:0.3:3",
        "--set",
        "parameters.fl_length=0.5",
    ];
    assert_eq!(command::code(&folder, &sweep), 0);
    let kept = fs::read_to_string(folder.join("model-out/model.toml")).unwrap();
    assert!(!kept.contains("include") && kept.contains("br_shank"));
    let swept = fs::read_to_string(folder.join("model-sweep/00002/model.toml")).unwrap();
    let swept = Model::from_toml(&swept).unwrap();
    let length = |name: &str| swept.body(name).unwrap().shape.clone().unwrap().dimensions[0];
    assert_eq!(
        (length("fl_thigh").to_bits(), length("br_thigh").to_bits()),
        (0.5_f64.to_bits(), 0.4_f64.to_bits())
    );
    fs::remove_dir_all(folder.join("parts")).unwrap();
    fs::remove_dir_all(folder.join("model-out/plots")).unwrap();
    assert_eq!(command::code(&folder, &["plot", "model-out"]), 0);
    assert_eq!(command::code(&folder, &["collect", "model-sweep"]), 0);
    assert_eq!(
        command::code(&folder, &["check", "model.toml"]),
        3,
        "the file itself is incomplete now"
    );
}

/// A walker whose leg or own text has some of its text replaced.
fn refused(case: &str, (in_model, model): (&str, &str), (in_leg, leg): (&str, &str)) -> String {
    let folder = folder(case);
    assert!(WALKER.contains(in_model) && LEG.contains(in_leg), "{case}");
    fs::write(folder.join("model.toml"), WALKER.replacen(in_model, model, 1)).unwrap();
    fs::write(folder.join("parts/leg.toml"), LEG.replacen(in_leg, leg, 1)).unwrap();
    said(&folder)
}

/// What the program says about `model.toml` of a folder, which must be refused.
fn said(folder: &Path) -> String {
    let output = holonom(folder, &["check", "model.toml"]);
    let text = words(&output);
    assert_eq!(output.status.code(), Some(3), "{text}");
    text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

const SAME: (&str, &str) = ("", "");

#[test]
fn problems_of_included_files_have_their_place() {
    let cases = [
        ("unknown_key", SAME, ("axis = [0.0, 1.0, 0.0]", "axes = [0.0, 1.0, 0.0]")),
        ("wrong_value", SAME, ("density = 1000.0", "density = -1.0")),
        ("syntax", SAME, ("[[sensor]]", "[[sensor]")),
        ("unknown_reference", SAME, ("child = \"thigh\"", "child = \"tigh\"")),
        ("wrong_expression", SAME, ("\"= -knee\"", "\"= -lenght\"")),
        ("unknown_section", SAME, ("[[sensor]]", "[[senser]]")),
        ("no_list", SAME, ("[[sensor]]", "[sensor]")),
        ("unknown_parameter", ("{ length =", "{ lenght ="), SAME),
        ("no_frame", ("relative_to = \"trunk\"", "relative_to = \"half\""), SAME),
        ("wrong_orientation", ("degrees = [180.0", "degree = [180.0"), SAME),
        ("unknown_key_of_entry", ("prefix = \"fl_\"", "prefiks = \"fl_\""), SAME),
        ("pose_without_prefix", ("prefix = \"fl_\", ", ""), SAME),
        ("same_prefix", ("prefix = \"fr_\"", "prefix = \"fl_\""), SAME),
        ("no_file", ("file = \"parts/leg.toml\"", "file = \"parts/log.toml\""), SAME),
        ("a_folder", ("file = \"parts/leg.toml\"", "file = \"parts\""), SAME),
        ("a_device", ("file = \"parts/leg.toml\"", "file = \"/dev/zero\""), SAME),
        ("no_text", ("file = \"parts/leg.toml\"", "file = 3"), SAME),
        ("itself", ("parts/leg.toml", "./parts/../model.toml"), SAME),
        ("a_circle", SAME, (LEG.lines().next().unwrap(), "include = [\"../model.toml\"]")),
    ];
    let mut all = String::new();
    for (case, model, leg) in cases {
        let _ = writeln!(all, "## {case}\n{}\n", refused(case, model, leg));
    }
    insta::assert_snapshot!(all);
}

#[test]
fn problems_for_machines_name_the_file() {
    let folder = folder("json");
    fs::write(folder.join("parts/leg.toml"), LEG.replace("density = 1000.0", "density = 0.0"))
        .unwrap();
    let output = holonom(&folder, &["check", "model.toml", "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let problem = &found["problems"][0];
    assert_eq!(problem["file"], "parts/leg.toml");
    let line = LEG.lines().position(|line| line.contains("density")).unwrap() + 1;
    assert_eq!(problem["line"], line, "{found}");
    assert_eq!(found["file"], "model.toml");
}

/// Hostile files are refused soon and in little memory.
#[test]
fn hostile_files_are_refused() {
    let folder = folder("hostile");
    let head = "model = { name = \"m\" }\nsimulation = { step = 0.1, end = 1.0 }\n";
    let model =
        |include: &str| fs::write(folder.join("model.toml"), format!("{include}\n{head}")).unwrap();
    for k in 0..40 {
        let next = format!("include = [\"deep{}.toml\"]", k + 1);
        fs::write(folder.join(format!("deep{k}.toml")), next).unwrap();
        let twice = format!("include = [{0}, {0}]", format_args!("\"wide{}.toml\"", k + 1));
        fs::write(folder.join(format!("wide{k}.toml")), twice).unwrap();
    }
    let huge = fs::File::create(folder.join("huge.toml")).unwrap();
    huge.set_len(70 << 20).unwrap();
    fs::write(folder.join("bytes.toml"), [0xff, 0xfe]).unwrap();
    fs::write(folder.join("comment.toml"), "#".repeat(1 << 20)).unwrap();
    let many = |count: usize, file: &str| {
        format!("include = [{}]", vec![format!("\"{file}\""); count].join(", "))
    };
    let cases = [
        ("include = [\"deep0.toml\"]".to_owned(), "more than 16 files include one another"),
        ("include = [\"wide0.toml\"]".to_owned(), "more than"),
        ("include = [\"huge.toml\"]".to_owned(), "larger than 64 MB"),
        ("include = [\"bytes.toml\"]".to_owned(), "not UTF-8"),
        ("include = [\"\"]".to_owned(), "cannot read the included file"),
        ("include = [\"a\\u0000b\"]".to_owned(), "cannot read the included file"),
        ("include = \"deep0.toml\"".to_owned(), "`include` must be a list"),
        (many(100_000, "deep40.toml"), "cannot read the included file"),
        (many(100_000, "parts/leg.toml"), "more than 1000 files are included"),
        (many(100, "comment.toml"), "all files together are larger than 64 MB"),
    ];
    for (include, expected) in cases {
        model(&include);
        let text = said(&folder);
        assert!(text.contains(expected), "{}: {text}", &include[..include.len().min(60)]);
        assert!(text.len() < 100_000, "{} bytes are said", text.len());
    }
}

/// A pipe that nobody writes to is refused, not waited for.
#[cfg(unix)]
#[test]
fn a_pipe_is_not_waited_for() {
    let folder = folder("pipe");
    let made = std::process::Command::new("mkfifo").arg(folder.join("parts/pipe.toml")).status();
    assert!(made.unwrap().success());
    fs::write(folder.join("model.toml"), WALKER.replace("parts/leg.toml", "parts/pipe.toml"))
        .unwrap();
    assert!(said(&folder).contains("this is not a regular file"));
}

/// From standard input, files are relative to the current directory.
#[cfg(target_os = "linux")]
#[test]
fn a_model_from_standard_input_includes_files_of_the_current_directory() {
    let folder = folder("stdin");
    let mut program = command::command(&folder, &["check", "/dev/stdin"]);
    let input = fs::File::open(folder.join("model.toml")).unwrap();
    let output = program.stdin(input).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
}

/// The including file states a value that would change nothing.
#[test]
fn a_parameter_of_an_included_file_that_nothing_uses_is_not_replaced() {
    let folder = command::folder("includes", "idle_parameter");
    let leg = "parameters = { length = 0.4, idle = 1.0 }\n[[body]]\nname = \"leg\"\nmass = 1.0\ninertia = [1, 1, 1]\nposition = [\"= length\", 0, 0]\n";
    fs::write(folder.join("leg.toml"), leg).unwrap();
    for (parameters, message) in [
        ("length = 0.5", None),
        ("idle = 2.0", Some("no expression uses the parameter `l_idle`")),
        ("lenght = 2.0", Some("has no parameter `lenght`")),
    ] {
        let text = format!(
            "include = [{{ file = \"leg.toml\", prefix = \"l_\", parameters = {{ {parameters} }} }}]\nmodel = {{ name = \"m\" }}\nsimulation = {{ step = 0.01, end = 0.1 }}\n"
        );
        fs::write(folder.join("m.toml"), text).unwrap();
        let output = command::holonom(&folder, &["check", "m.toml"]);
        let said = command::words(&output);
        let expected = if message.is_some() { 3 } else { 0 };
        assert_eq!(output.status.code(), Some(expected), "{said}");
        assert!(message.is_none_or(|message| said.contains(message)), "{said}");
    }
    let output = command::holonom(&folder, &["check", "m.toml", "--set", "parameters.l_idle=2"]);
    assert_eq!(output.status.code(), Some(3), "{}", command::words(&output));
}
