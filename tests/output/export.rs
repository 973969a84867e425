//! Results for other programs, read back by those programs.
#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{folder, holonom, words};
use std::path::Path;
use std::process::Command;

/// A Python that has a module: `HOLONOM_PYTHON`, or the one of the machine; without it the test
/// prints that and passes.
pub(crate) fn python(module: &str) -> Option<String> {
    let own = std::env::var("HOLONOM_PYTHON").ok();
    let found = own.into_iter().chain(["python3".to_owned()]).find(|python| {
        let asked = Command::new(python).arg("-c").arg(format!("import {module}")).output();
        asked.is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        println!("NOT TESTED: no Python with {module} on this machine");
    }
    found
}

/// A shipped model, run for some steps into `run`.
pub(crate) fn run(folder: &Path, model: &str, steps: u32) {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models");
    let text = std::fs::read_to_string(models.join(model)).unwrap();
    let step = text.lines().find_map(|line| line.trim().strip_prefix("step = ")).unwrap();
    let step: f64 = step.split([' ', '#']).next().unwrap().parse().unwrap();
    let end = format!("simulation.end={:?}", step * f64::from(steps));
    let model = models.join(model).display().to_string();
    let all = ["run", &model, "-o", "run", "--set", &end, "--set", "simulation.momenta=true"];
    let output = holonom(folder, &all);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
}

/// A rod on a hinge, a bushing, a spring and a cord, all let go at 0.205 s; recorded at 51 nodes,
/// 21 of them before.
pub(crate) fn run_let_go(folder: &Path) {
    let text = include_str!("../models/let_go.toml");
    std::fs::write(folder.join("model.toml"), text).unwrap();
    let output = holonom(folder, &["run", "model.toml", "-o", "run"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
}

const COMPARE: &str = r#"
import csv, math, numpy
data = numpy.load("run.npz")
def table(name):
    rows = list(csv.reader(open("run/" + name)))
    return rows[0], rows[1:]
same = lambda a, text: math.isnan(a) if text == "" else a == float(text)
head, rows = table("trajectory.csv")
n = len(head) - 10
assert data["step"].dtype == numpy.int64 and data["q"].shape == (len(rows), n)
compared = 0
for k, row in enumerate(rows):
    assert data["step"][k] == int(row[0]) and data["t"][k] == float(row[1])
    values = list(data["q"][k]) + [data["E"][k], data["H"][k]] + list(data["L"][k]) + list(data["P"][k])
    assert all(a == float(b) for a, b in zip(values, row[2:])), k
    compared += len(row)
for k, column in enumerate(head):
    if column.endswith(".d2z"):
        name = column[:-4]
        assert all(data["directors/" + name][i, 2, 1] == float(r[k]) for i, r in enumerate(rows))
    if column.endswith(".y"):
        assert all(data["position/" + column[:-2]][i, 1] == float(r[k]) for i, r in enumerate(rows))
for group in ["residuals", "momenta", "sensors", "energy"]:
    if any(key.startswith(group + "/") for key in data):
        head, rows = table(group + ".csv")
        for k, column in enumerate(head[2:], 2):
            array = data[group + "/" + column]
            assert len(array) == len(rows) and all(same(a, r[k]) for a, r in zip(array, rows)), column
            compared += len(rows)
if any(key.startswith("beams/") for key in data):
    head, rows = table("beams.csv")
    name = rows[0][2]
    s, strain, force = (data["beams/%s/%s" % (name, what)] for what in ("s", "strain", "force"))
    own = [r for r in rows if r[2] == name]
    for i, r in enumerate(own):
        k, e = divmod(i, len(s))
        numbers = [float(x) for x in r[4:]]
        assert s[e] == numbers[0] and list(strain[k, e]) == numbers[1:7] and list(force[k, e]) == numbers[7:]
        compared += len(numbers)
print(compared)
"#;

/// What a script prints that compares a result with the files of the run; it must succeed.
pub(crate) fn compared(python: &str, script: &str, folder: &Path) -> String {
    let output = Command::new(python).arg("-c").arg(script).current_dir(folder).output().unwrap();
    let wrong = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {wrong}", folder.display());
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

#[test]
fn numpy_reads_the_numbers_of_the_files_bit_for_bit() {
    let Some(python) = python("numpy") else { return };
    for model in ["slider_crank.toml", "flying_beam.toml", "four_particles.toml", "pendulum.toml"] {
        let folder = folder("export", model);
        run(&folder, model, 20);
        let output = holonom(&folder, &["export", "run"]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let said = compared(&python, COMPARE, &folder);
        println!("{model}: {said} numbers are equal");
        assert!(said.parse::<u32>().unwrap() > 100);
    }
}

#[test]
fn what_cannot_be_exported_is_said_and_nothing_is_written() {
    let folder = folder("export", "refused");
    let holonom = |arguments: &[&str]| {
        let output = holonom(&folder, arguments);
        (output.status.code(), words(&output))
    };
    run(&folder, "pendulum.toml", 5);
    for format in [&["--format", "hdf5"][..], &["--format"]] {
        let (code, words) = holonom(&[&["export", "run"], format].concat());
        assert!(code == Some(2) && words.contains("npz (arrays for NumPy"), "{words}");
    }
    assert_eq!(holonom(&["export", "run"]).0, Some(0));
    let (code, words) = holonom(&["export", "run"]);
    assert!(code == Some(2) && words.contains("already exists"), "{words}");
    let before = std::fs::read(folder.join("run.npz")).unwrap();
    let trajectory = std::fs::read_to_string(folder.join("run/trajectory.csv")).unwrap();
    let wrong = trajectory.replacen("\n1,", "\none,", 1);
    std::fs::write(folder.join("run/trajectory.csv"), wrong).unwrap();
    let (code, words) = holonom(&["export", "run", "--force"]);
    assert!(code == Some(1) && words.contains("`one` is no number"), "{words}");
    assert_eq!(std::fs::read(folder.join("run.npz")).unwrap(), before, "the old file stays");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2, "nothing half-written");
}
