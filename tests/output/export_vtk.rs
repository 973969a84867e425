//! Results for ParaView, read back by VTK.
#![allow(clippy::unwrap_used)] // a test

use crate::output::export::{compared, python, run, run_let_go};
use crate::program::command::{folder, holonom, words};
use std::fs;
use std::path::Path;

const SENSORS: &str = include_str!("../models/two_bodies.toml");

/// Reads every file of `run-vtk` and compares all numbers that stand in the files of the run.
const COMPARE: &str = r#"
import csv, os, xml.etree.ElementTree as xml
import numpy, vtk
from vtk.util.numpy_support import vtk_to_numpy
def table(name):
    if not os.path.exists("run/" + name): return [], []
    rows = list(csv.reader(open("run/" + name)))
    return rows[0], rows[1:]
head, rows = table("trajectory.csv")
by_step = {int(row[0]): row for row in rows}
beam_head, beam_rows = table("beams.csv")
sensor_head, sensor_rows = table("sensors.csv")
sensors = {int(row[0]): row for row in sensor_rows}
momenta_head, momenta_rows = table("momenta.csv")
momenta = {int(row[0]): row for row in momenta_rows}
sections = {}
for row in beam_rows: sections.setdefault(int(row[0]), []).append([float(x) for x in row[5:]])
def vector(head, row, first): # of a member: three columns, two in the plane
    k = head.index(first + "x")
    return [float(row[k]), float(row[k + 1]), float(row[k + 2]) if head[k + 2] == first + "z" else 0.0]
compared, worst = 0, 0.0
def same(array, expected):
    global compared
    expected = numpy.array(expected)
    assert array.dtype == numpy.float64 and array.shape == expected.shape, (array, expected)
    assert array.tobytes() == expected.tobytes(), (array, expected)
    compared += array.size
names = [c[:-2] for c in head if c.endswith(".x")]
frames = xml.parse("run-vtk/run.pvd").getroot().find("Collection").findall("DataSet")
assert len(frames) == len(rows) and [float(f.get("timestep")) for f in frames] == [float(r[1]) for r in rows]
for frame in frames:
    reader = vtk.vtkXMLMultiBlockDataReader()
    reader.SetFileName("run-vtk/" + frame.get("file"))
    reader.Update()
    data = reader.GetOutput()
    blocks = {data.GetMetaData(k).Get(vtk.vtkCompositeDataSet.NAME()): data.GetBlock(k) for k in range(data.GetNumberOfBlocks())}
    step = int(next(iter(blocks.values())).GetFieldData().GetArray("step").GetValue(0))
    row = by_step[step]
    for block in blocks.values():
        assert block.GetFieldData().GetArray("TimeValue").GetValue(0) == float(row[1])
    numbers = lambda block, name: vtk_to_numpy(blocks[block].GetPointData().GetArray(name))
    own = []
    if "centers" in blocks:
        centers = blocks["centers"]
        text = centers.GetPointData().GetAbstractArray("name")
        own = [text.GetValue(k) for k in range(centers.GetNumberOfPoints())]
        same(vtk_to_numpy(centers.GetPoints().GetData()), [vector(head, row, n + ".") for n in own])
        for d in ["d1", "d2", "d3"]:
            for k, n in enumerate(own):
                if n + ".d1x" in head: same(numbers("centers", d)[k], vector(head, row, n + "." + d))
        if centers.GetPointData().HasArray("momentum"):
            group = "p_projected." if momenta[step][momenta_head.index("p_projected." + own[0] + ".x")] else "p."
            same(numbers("centers", "momentum"), [vector(momenta_head, momenta[step], group + n + ".") for n in own])
        if "v.x" in sensor_head:
            same(numbers("centers", "velocity")[own.index("free")], vector(sensor_head, sensors[step], "v."))
            same(numbers("centers", "angular_velocity")[own.index("free")], vector(sensor_head, sensors[step], "w."))
    if "beams" in blocks:
        nodes = [n for n in names if n not in own]
        same(vtk_to_numpy(blocks["beams"].GetPoints().GetData()), [vector(head, row, n + ".") for n in nodes])
        for d in ["d1", "d2", "d3"]:
            same(numbers("beams", d), [vector(head, row, n + "." + d) for n in nodes])
        cells = blocks["beams"].GetCellData()
        for k, name in enumerate(["Gamma", "K", "N", "M"]):
            same(vtk_to_numpy(cells.GetArray(name)), [s[3 * k:3 * k + 3] for s in sections[step]])
    if "reactions" in blocks and blocks["reactions"].GetNumberOfPoints():
        same(numbers("reactions", "force")[0], [float(sensors[step][sensor_head.index("pin.f" + a)]) for a in "xyz"])
        same(numbers("reactions", "moment")[0], [float(sensors[step][sensor_head.index("pin.m" + a)]) for a in "xyz"])
    for name in ["bodies", "beam_surfaces"]: # closed, and facing outwards
        if name in blocks and blocks[name].GetNumberOfPoints():
            mass = vtk.vtkMassProperties()
            triangles = vtk.vtkTriangleFilter()
            triangles.SetInputData(blocks[name])
            mass.SetInputConnection(triangles.GetOutputPort())
            assert mass.GetVolume() > 0
print(compared)
"#;

/// Exports, reads back, and counts the numbers that are equal.
fn equal(python: &str, folder: &Path) -> u32 {
    let output =
        holonom(folder, &["export", "run", "--format", "vtk", "--frames", "1000", "--force"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let count = compared(python, COMPARE, folder).parse().unwrap();
    println!("{}: {count} numbers are equal", folder.display());
    count
}

#[test]
fn vtk_reads_the_numbers_of_the_files_bit_for_bit() {
    let Some(python) = python("vtk") else { return };
    for model in ["slider_crank.toml", "flying_beam.toml", "four_particles.toml", "rotor.toml"] {
        let folder = folder("export_vtk", model);
        run(&folder, model, 20);
        assert!(equal(&python, &folder) > 100);
    }
}

/// The velocities of the first body and their largest difference from those of a second folder.
const VELOCITIES: &str = r#"
import numpy, vtk
from vtk.util.numpy_support import vtk_to_numpy
def read(folder, frame, name):
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName("%s/frames/%06d/centers.vtp" % (folder, frame))
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetArray(name))
worst = 0.0
for frame in range(31):
    for name in ["velocity", "angular_velocity"]:
        a, b = read("run-vtk", frame, name), read("other", frame, name)
        assert abs(a).max() > 0.1
        worst = max(worst, abs(a - b).max())
print(worst)
"#;

#[test]
fn velocities_are_those_of_sensors_or_of_momenta() {
    let Some(python) = python("vtk") else { return };
    let folder = folder("export_vtk", "sensors");
    fs::write(folder.join("two.toml"), SENSORS).unwrap();
    let output = holonom(&folder, &["run", "two.toml", "-o", "run"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(equal(&python, &folder) > 1000);
    fs::remove_file(folder.join("run/sensors.csv")).unwrap();
    let output = holonom(&folder, &["export", "run", "--format", "vtk", "-o", "other"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let worst: f64 = compared(&python, VELOCITIES, &folder).parse().unwrap();
    println!("velocities of sensors and of momenta differ by {worst:e}");
    assert!(worst < 1e-13, "{worst:e}");
}

#[test]
fn a_folder_is_written_whole_and_replaces_only_its_own_kind() {
    let folder = folder("export_vtk", "folder");
    let export = |more: &[&str]| {
        let output = holonom(&folder, &[&["export", "run", "--format", "vtk"], more].concat());
        (output.status.code(), words(&output))
    };
    run(&folder, "pendulum.toml", 30);
    let (code, words) = export(&["--frames", "4"]);
    assert_eq!(code, Some(0), "{words}");
    assert!(words.contains("note: 4 of 31 recorded nodes"), "{words}");
    let collection = fs::read_to_string(folder.join("run-vtk/run.pvd")).unwrap();
    let files: Vec<&str> = collection
        .lines()
        .filter_map(|line| line.split("file=\"").nth(1)?.split('"').next())
        .collect();
    assert_eq!(files.len(), 4);
    for file in files {
        let text = fs::read_to_string(folder.join("run-vtk").join(file)).unwrap();
        for block in ["bodies", "centers", "lines"] {
            assert!(text.contains(&format!("name=\"{block}\"")), "{text}");
        }
        let blocks = folder.join("run-vtk").join(file).with_extension("");
        assert_eq!(fs::read_dir(blocks).unwrap().count(), 3, "one file for each block");
    }
    // the first and the last recorded node are there
    assert!(collection.contains("timestep=\"0.0\"") && collection.contains("timestep=\"0.3"));
    let (code, words) = export(&[]);
    assert!(code == Some(2) && words.contains("already exists"), "{words}");
    let (code, words) = export(&["--force"]);
    assert_eq!(code, Some(0), "{words}");
    let frames = fs::read_dir(folder.join("run-vtk/frames")).unwrap().count();
    assert_eq!(frames, 62, "a file and a folder for each of 31 frames");
    // nothing of the old folder changes when the run cannot be read
    let trajectory = fs::read_to_string(folder.join("run/trajectory.csv")).unwrap();
    let last = trajectory.trim_end().rfind('\n').unwrap();
    let wrong =
        format!("{}{}", &trajectory[..last], trajectory[last..].replacen("\n30,", "\n30,x", 1));
    fs::write(folder.join("run/trajectory.csv"), wrong).unwrap();
    let (code, words) = export(&["--force"]);
    assert!(code == Some(1) && words.contains("no number in column 2"), "{words}");
    assert_eq!(fs::read_dir(folder.join("run-vtk/frames")).unwrap().count(), 62);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2, "nothing half-written");
    // a folder of somebody else stays
    fs::write(folder.join("run/trajectory.csv"), trajectory).unwrap();
    fs::write(folder.join("run-vtk/notes.txt"), "mine").unwrap();
    let (code, words) = export(&["--force"]);
    assert!(code == Some(2) && words.contains("notes.txt is in it"), "{words}");
    assert!(folder.join("run-vtk/notes.txt").is_file());
}

#[test]
fn equilibria_are_numbered() {
    let folder = folder("export_vtk", "statics");
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models/roll_up.toml");
    let output = holonom(&folder, &["run", &model.display().to_string(), "-o", "run"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    for format in ["vtk", "gltf"] {
        let output = holonom(&folder, &["export", "run", "--format", format]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    }
    let collection = fs::read_to_string(folder.join("run-vtk/run.pvd")).unwrap();
    let times = collection.lines().filter_map(|line| line.split("timestep=\"").nth(1));
    let times: Vec<&str> = times.filter_map(|rest| rest.split('"').next()).collect();
    let expected: Vec<String> = (0..times.len()).map(|k| format!("{k}.0")).collect();
    assert!(times.len() > 2 && times == expected, "{times:?}");
}

#[test]
fn a_run_that_cannot_be_shown_is_refused_with_the_reason() {
    let folder = folder("export_vtk", "refused");
    run(&folder, "pendulum.toml", 5);
    let refused = |format: &str| {
        let output = holonom(&folder, &["export", "run", "--format", format]);
        assert_eq!(output.status.code(), Some(1));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing half-written");
        words(&output)
    };
    let model = fs::read_to_string(folder.join("run/model.toml")).unwrap();
    for format in ["vtk", "gltf"] {
        fs::write(folder.join("run/model.toml"), "[model]").unwrap();
        assert!(refused(format).contains("no valid model"));
        fs::write(folder.join("run/model.toml"), model.replace("\"bob\"", "\"ball\"")).unwrap();
        let words = refused(format);
        assert!(words.contains("its columns are not those of model.toml"), "{words}");
    }
    fs::write(folder.join("run/model.toml"), &model).unwrap();
    fs::remove_file(folder.join("run/trajectory.csv")).unwrap();
    for format in ["vtk", "gltf"] {
        assert!(refused(format).contains("trajectory.csv"));
    }
}

/// Joints, bushings and lines that an event released are in no block after that.
#[test]
fn what_is_released_is_in_no_block() {
    let folder = folder("export_vtk", "let_go");
    run_let_go(&folder);
    let output = holonom(&folder, &["export", "run", "--format", "vtk"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    for frame in 0..51 {
        let count = |block: &str, of: &str| -> usize {
            let path = folder.join(format!("run-vtk/frames/{frame:06}/{block}.vtp"));
            let text = fs::read_to_string(path).unwrap();
            let number = text.split(&format!("{of}=\"")).nth(1).unwrap().split('"').next();
            number.unwrap().parse().unwrap()
        };
        let there = if frame < 21 { 2 } else { 0 };
        assert_eq!(count("joints", "NumberOfPoints"), there, "frame {frame}");
        assert_eq!(count("lines", "NumberOfLines"), there, "frame {frame}");
        assert_eq!(count("centers", "NumberOfPoints"), 3, "frame {frame}");
    }
}
