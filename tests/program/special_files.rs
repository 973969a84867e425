//! Pipes, sockets, devices, folders and links that lead nowhere, in the place of every file that a
//! verb reads: answered at once, with a remedy.

use std::fs;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::command::{command, folder, pendulum_folder};

/// Nobody waits longer.
const PATIENCE: Duration = Duration::from_secs(60);

/// Exit code and words; a program that goes on is ended, and fails the test.
fn answered(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let mut child = command(folder, arguments);
    child
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(fs::File::create(folder.join("said")).unwrap());
    let mut child = child.spawn().unwrap();
    let begin = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if begin.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{arguments:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let said = fs::read_to_string(folder.join("said")).unwrap();
    println!("{arguments:?}: {status}\n{said}");
    (status.code().unwrap(), said)
}

/// What may stand where a file is expected.
const KINDS: [&str; 5] = ["pipe", "socket", "zero", "folder", "dangling"];

/// Puts something of a kind in the place of a file.
fn put(kind: &str, path: &Path) {
    let _ = fs::remove_file(path);
    let _ = fs::remove_dir(path);
    match kind {
        "pipe" => assert!(Command::new("mkfifo").arg(path).status().unwrap().success()),
        "socket" => {
            // the path of a socket is short: it is made in the folder for temporary files
            let short = std::env::temp_dir().join(format!("holonom-{}", std::process::id()));
            let _ = fs::remove_file(&short);
            drop(UnixListener::bind(&short).unwrap());
            fs::rename(&short, path).or_else(|_| symlink(&short, path)).unwrap();
        }
        "zero" => symlink("/dev/zero", path).unwrap(),
        "folder" => fs::create_dir(path).unwrap(),
        _ => symlink("nowhere", path).unwrap(),
    }
}

#[test]
fn models_and_robots_are_regular_files() {
    let folder = pendulum_folder("special_files", "models");
    for kind in KINDS {
        put(kind, &folder.join("odd.toml"));
        put(kind, &folder.join("odd.urdf"));
        for arguments in [
            &["check", "odd.toml"][..],
            &["run", "odd.toml"],
            &["import", "odd.urdf", "-o", "robot.toml"],
        ] {
            let (code, said) = answered(&folder, arguments);
            assert!(
                code == 3 && said.contains("cannot be read") && said.contains("help:"),
                "{kind}: {said}"
            );
            assert!(!said.contains("is not a valid model"), "{said}");
        }
        let text = format!("include = [\"odd.toml\"]\n{}", crate::program::command::PENDULUM);
        fs::write(folder.join("with.toml"), text).unwrap();
        let (code, said) = answered(&folder, &["check", "with.toml"]);
        assert!(code == 3 && said.contains("odd.toml"), "{kind}: {said}");
    }
    let shared = Path::new("/dev/shm").join(format!("holonom-pipe-{}", std::process::id()));
    if Path::new("/dev/shm").is_dir() {
        put("pipe", &shared);
        let (code, said) = answered(&folder, &["check", shared.to_str().unwrap()]);
        fs::remove_file(&shared).unwrap();
        assert!(code == 3 && said.contains("not a regular file"), "{said}");
    }
    for device in ["/dev/zero", "/dev/random", "/dev/null"] {
        let (code, said) = answered(&folder, &["check", device]);
        assert!(code == 3 && said.contains("cannot be read"), "{said}");
    }
    let (code, said) = answered(&folder, &["run", "nothere.toml"]);
    assert!(code == 3 && said.contains("nothere.toml cannot be read"), "{said}");
}

#[test]
fn the_files_of_a_run_are_regular_files() {
    let folder = pendulum_folder("special_files", "runs");
    let run = |out: &str| {
        let arguments = ["run", "pendulum.toml", "--end", "0.2", "-q", "--force", "-o", out];
        assert_eq!(answered(&folder, &arguments).0, 0);
    };
    run("out");
    for file in ["summary.json", "trajectory.csv", "residuals.csv", "energy.csv", "model.toml"] {
        let path = folder.join("out").join(file);
        let good = fs::read(&path).unwrap();
        for kind in KINDS {
            put(kind, &path);
            for arguments in [
                &["plot", "out"][..],
                &["plot", "out", "--list"],
                &["export", "out", "-o", "out.npz", "--force"],
                &["resume", "out"],
                &["view", "out", "--print"],
            ] {
                let (code, said) = answered(&folder, arguments);
                assert!(code < 4, "{kind} {file}: {said}");
                if code != 0 {
                    assert!(said.contains("help:"), "{kind} {file}: {said}");
                }
            }
            let _ = fs::remove_file(&path);
            let _ = fs::remove_dir(&path);
            fs::write(&path, &good).unwrap();
        }
    }
    let (code, _) = answered(&folder, &["plot", "out"]);
    assert_eq!(code, 0, "the folder is whole again");
}

#[test]
fn checkpoints_and_what_they_continue_are_regular_files() {
    let folder = folder("special_files", "checkpoints");
    let out = folder.join("out");
    let fill = || {
        let (path, _) = crate::program::interrupted::interrupted_chain("special");
        let _ = fs::remove_dir_all(&out);
        fs::rename(&path, &out).unwrap();
    };
    for file in ["checkpoint", "trajectory.csv", "sensors.csv", "checkpoint.tmp"] {
        for kind in KINDS {
            fill();
            let _ = fs::remove_file(out.join("checkpoint.previous"));
            put(kind, &out.join(file));
            let (code, said) = answered(&folder, &["resume", "out", "--no-progress"]);
            // a link that leads nowhere is no checkpoint; a temporary file is needed only where one
            // is written
            assert!(code == 1 && said.contains("help:"), "{kind} {file}: {code} {said}");
        }
    }
}

#[test]
fn sweeps_are_read_from_regular_files() {
    let folder = pendulum_folder("special_files", "sweeps");
    let sweep = [
        "sweep",
        "pendulum.toml",
        "--vary",
        "particle.bob.mass=1:2:2",
        "--set",
        "simulation.end=0.1",
        "-q",
        "-o",
        "s",
    ];
    assert_eq!(answered(&folder, &sweep).0, 0);
    for file in ["sweep.json", "manifest.jsonl"] {
        let path = folder.join("s").join(file);
        let good = fs::read(&path).unwrap();
        for kind in KINDS {
            put(kind, &path);
            for arguments in [&["collect", "s"][..], &sweep] {
                let (code, said) = answered(&folder, arguments);
                assert!(code == 0 || said.contains("help:"), "{kind} {file}: {said}");
            }
            let _ = fs::remove_file(&path);
            let _ = fs::remove_dir(&path);
            fs::write(&path, &good).unwrap();
        }
    }
}

#[test]
fn a_line_is_standard_input() {
    let folder = pendulum_folder("special_files", "stdin");
    let mut child = command(&folder, &["check", "-"]);
    let output =
        child.stdin(fs::File::open(folder.join("pendulum.toml")).unwrap()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(0) && said.contains("valid"), "{said}");
}

/// Exit code and words of a program that reads a text from a pipe.
fn piped(folder: &Path, arguments: &[&str], text: &str) -> (Option<i32>, String) {
    let mut command = command(folder, arguments);
    let child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut child = child.unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// A pipe can be read once, and a verb may need its model more than once.
#[test]
fn every_verb_takes_its_model_from_a_pipe() {
    let folder = pendulum_folder("special_files", "pipe");
    let plain = fs::read_to_string(folder.join("pendulum.toml")).unwrap();
    let arm = r#"
model = { name = "arm", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.02, end = 0.4 }
parameters = { mass = 1.2, damping = 0.3 }
[[body]]
name = "rod"
mass = "= mass"
inertia = [0.01, 0.1, 0.1]
position = [0.5, 0.0, 0.0]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "rod"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
damper = { damping = "= damping" }
[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "hinge"
"#;
    let design = format!(
        "{arm}[[objective]]\nname = \"met\"\ntype = \"sensor\"\nsensor = \"angle\"\ntarget = 0.7\n\
         [optimize]\nparameters = {{ damping = {{ min = 0.0, max = 2.0 }} }}\n"
    );
    let fit = format!(
        "{arm}[[measurement]]\nsensor = \"angle\"\nsigma = 0.01\n\
         [identify]\nparameters = {{ damping = {{ start = 0.1 }} }}\n"
    );
    let data = "t,angle\n0.1,0.07\n0.2,0.28\n0.3,0.59\n0.4,0.95\n";
    fs::write(folder.join("data.csv"), data).unwrap();
    let all: [(&[&str], &str); 10] = [
        (&["run", "-", "-q", "-o", "r"], &plain),
        (&["check", "-"], &plain),
        (&["gradient", "-", "--of", "angle"], arm),
        (&["gradient", "-", "--of", "angle", "--check"], arm),
        (&["optimize", "-", "-q", "-o", "o"], &design),
        (&["identify", "-", "data.csv", "-q", "-o", "i"], &fit),
        (&["modes", "-"], arm),
        (&["compare", "-", "-q", "-o", "c", "--end", "0.1"], &plain),
        (&["verify", "-"], &plain),
        (&["bench", "-"], &plain),
    ];
    for (arguments, text) in all {
        let (code, said) = piped(&folder, arguments, text);
        assert_eq!(code, Some(0), "{arguments:?}: {said}");
    }
    // also where the model is refused after it was read
    for arguments in [&["modes", "-", "-o", "m"][..], &["gradient", "-", "--of", "nothing"]] {
        let (_, said) = piped(&folder, arguments, &arm.replace("mass = \"= mass\"", "mass = -1.0"));
        assert!(said.contains("mass") && !said.contains("[model] is missing"), "{said}");
    }
}
