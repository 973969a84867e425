//! Which call is allowed in which phase; bad arguments; wrong units.

use crate::unit::{ERROR, Instance, OK, Unit, shipped};
use holonom::model::ModelText;
use holonom_fmi::{fmi2, fmi3};
use holonom_fmu::Version;
use std::path::Path;
use std::ptr::{null, null_mut};

pub(crate) const ARM: &str = r#"
model = { name = "arm", gravity = [0.0, 0.0, -9.81] }
parameters = { mass = 2.0, length = 1.0, half = "= length/2" }
simulation = { step = 1e-3, end = 1.0 }

[[body]]
name = "arm"
mass = "= mass"
inertia = [0.01, 0.2, 0.2]
position = ["= half", 0.0, 0.0]

[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "arm"
position = [0.0, 0.0, 0.0]
axis = [0.0, -1.0, 0.0]
motor = { effort = 1.0 }

[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "shoulder"

[[sensor]]
name = "bearing"
type = "reaction"
of = "shoulder"
"#;

#[test]
fn each_call_is_allowed_in_its_phases() {
    let unit = Unit::new(ARM, &[], &[], &[]);
    let [effort, mass, angle] =
        ["shoulder.effort", "parameters.mass", "angle"].map(|name| unit.reference(name));
    // set parameter, set input, get parameter, get output, enter, exit, step, terminate
    let table = [
        ("instantiated", [true, true, true, false, true, false, false, false]),
        ("initialization", [true, true, true, true, false, true, false, false]),
        ("steps", [false, true, true, true, false, false, true, true]),
        ("terminated", [false, false, true, true, false, false, false, false]),
    ];
    for version in [Version::Fmi2, Version::Fmi3] {
        for (phase, allowed) in table {
            for (k, is_allowed) in allowed.into_iter().enumerate() {
                let own = unit.instance(version);
                if phase != "instantiated" {
                    assert_eq!(own.enter(0.0), OK);
                }
                if !["instantiated", "initialization"].contains(&phase) {
                    assert_eq!(own.exit(), OK);
                }
                if phase == "terminated" {
                    assert_eq!(own.terminate(), OK);
                }
                own.said();
                let status = match k {
                    0 => own.set(mass, 3.0),
                    1 => own.set(effort, 3.0),
                    2 => own.try_get(&[mass]).map_or_else(|status| status, |_| OK),
                    3 => own.try_get(&[angle]).map_or_else(|status| status, |_| OK),
                    4 => own.enter(0.0),
                    5 => own.exit(),
                    6 => own.step(0.0, 1e-3).0,
                    _ => own.terminate(),
                };
                let (expected, said) = (if is_allowed { OK } else { ERROR }, own.said());
                assert_eq!(status, expected, "{version:?} {phase}, call {k}: {said}");
                if version == Version::Fmi3 && !is_allowed {
                    assert!(said.contains("the instance is "), "{phase}, call {k}: {said}");
                }
                assert_eq!(own.reset(), OK);
                assert_eq!(own.initialize(0.0), OK, "after a reset");
            }
        }
    }
}

#[test]
fn values_that_cannot_be_set_are_refused_by_name() {
    let unit = Unit::new(ARM, &[], &[], &[]);
    let own = unit.begun(Version::Fmi3);
    let effort = unit.reference("shoulder.effort");
    assert_eq!(own.set(effort, f64::NAN), ERROR);
    assert!(own.said().contains("`shoulder.effort`: NaN is not finite"));
    assert_eq!(own.get(&[effort]), [0.0]);
    assert_eq!(own.set(unit.reference("angle"), 1.0), ERROR);
    assert!(own.said().contains("`angle`: it is computed"));
    assert_eq!(own.set(99, 1.0), ERROR);
    assert!(own.said().contains("no variable with the reference 99"));
    assert_eq!(own.try_get(&[99]), Err(ERROR));
    // lists of two lengths; nothing of the list is set where one value is refused
    let (references, values) = ([effort, 99], [2.0, 1.0]);
    let set = |n: usize, m: usize| unsafe {
        fmi3::fmi3SetFloat64(own.id, references.as_ptr(), n, values.as_ptr(), m)
    };
    assert_eq!(set(2, 1), ERROR);
    assert!(own.said().contains("2 value references and 1 values"));
    assert_eq!(set(2, 2), ERROR);
    assert_eq!(own.get(&[effort]), [0.0]);
    // null
    assert_eq!(unsafe { fmi3::fmi3SetFloat64(own.id, null(), 1, values.as_ptr(), 1) }, ERROR);
    assert_eq!(unsafe { fmi3::fmi3GetFloat64(own.id, null(), 0, null_mut(), 0) }, OK);
    assert_eq!(fmi3::fmi3Terminate(null_mut()), ERROR);
    assert_eq!(fmi2::fmi2Terminate(null_mut()), ERROR);
    assert_eq!(unsafe { fmi3::fmi3SetFMUState(own.id, null_mut()) }, ERROR);
    // other types, and functions of what a unit does not have
    assert_eq!(fmi3::fmi3GetInt32(own.id, references.as_ptr(), 1, null_mut(), 1), ERROR);
    assert_eq!(fmi3::fmi3GetInt32(own.id, null(), 0, null_mut(), 0), OK);
    assert_eq!(fmi2::fmi2SetBoolean(own.id, references.as_ptr(), 1, null()), ERROR);
    assert_eq!(fmi3::fmi3EnterEventMode(own.id), ERROR);
    assert!(own.said().contains("fmi3EnterEventMode: the unit has nothing of the kind"));
}

#[test]
fn parameters_are_checked_by_the_words_of_the_model() {
    let unit = Unit::new(ARM, &[], &[], &["body.arm.inertia.0"]);
    let [mass, step] = ["parameters.mass", "simulation.step"].map(|name| unit.reference(name));
    assert!(unit.interface.variables.iter().all(|own| own.name != "parameters.half"));
    let own = unit.instance(Version::Fmi3);
    let inertia = unit.reference("body.arm.inertia.'0'");
    assert_eq!(own.get(&[mass, step, inertia]), [2.0, 1e-3, 0.01]);
    let set = Unit::new(ARM, &[("parameters.mass", "3.5")], &[], &[]);
    assert_eq!(set.instance(Version::Fmi3).get(&[mass]), [3.5]);
    assert_eq!(own.set(mass, -1.0), OK);
    assert_eq!(own.enter(0.0), ERROR);
    let said = own.said();
    assert!(said.contains("body.arm.mass"), "{said}");
    assert_eq!(own.set(mass, 1.0), OK);
    assert_eq!(own.initialize(0.0), OK, "{}", own.said());
    // a heavier arm in the initialization: the reaction follows
    assert_eq!(own.reset(), OK);
    let force = ["bearing.fx", "bearing.fy", "bearing.fz"].map(|name| unit.reference(name));
    let norm = || own.get(&force).iter().map(|f| f * f).sum::<f64>().sqrt();
    assert_eq!(own.enter(0.0), OK);
    let light = norm();
    assert_eq!(own.set(mass, 4.0), OK);
    let heavy = norm();
    // R = m g − m α/2 with α = (m g/2 − 1)/(I + m/4): the motor of the file lifts by 1 N·m
    let expected = |m: f64| m * 9.81 - 0.5 * m * (0.5 * m * 9.81 - 1.0) / (0.2 + 0.25 * m);
    for (found, mass) in [(light, 2.0), (heavy, 4.0)] {
        assert!((found - expected(mass)).abs() < 1e-10, "{found} N of {mass} kg");
    }
}

#[test]
fn units_that_are_not_those_of_the_library_make_no_instance() {
    let unit = Unit::new(ARM, &[], &[], &[]);
    let refused = |folder: &std::path::Path, token: &str| {
        Instance::try_new(folder, token, Version::Fmi2).err().unwrap();
        Instance::try_new(folder, token, Version::Fmi3).err().unwrap()
    };
    assert!(refused(&unit.folder, "{0}").contains("export it anew"));
    let nowhere = unit.folder.join("nowhere");
    assert!(refused(&nowhere, &unit.token).contains("cannot be read"));
    let changed = std::fs::read_to_string(unit.folder.join("model.toml")).unwrap();
    let path = unit.folder.join("model.toml");
    std::fs::write(&path, changed.replace("9.81", "9.82")).unwrap();
    assert!(refused(&unit.folder, &unit.token).contains("export it anew"));
    std::fs::write(&path, changed.replace("revolute", "revolving")).unwrap();
    assert!(refused(&unit.folder, &unit.token).contains("revolving"));
    let words = c"no".as_ptr();
    let none =
        fmi3::fmi3InstantiateModelExchange(words, words, words, false, false, null_mut(), None);
    assert!(none.is_null());
}

#[test]
fn names_and_units_of_all_shipped_models_can_be_written() {
    for (name, text) in shipped() {
        if holonom::Model::from_toml(&text).unwrap().settings.scheme
            == holonom::model::Scheme::Static
        {
            continue;
        }
        let unit = Unit::new(&text, &[], &[], &[]);
        for own in &unit.interface.variables {
            let known = own.unit.is_empty() || holonom_fmu::unit::BaseUnit::of(own.unit).is_some();
            assert!(known, "{name}: the unit {} of {}", own.unit, own.name);
        }
    }
}

/// Included files and meshes: a unit needs no file but its own.
#[test]
fn a_unit_holds_included_files_and_meshes() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("with files");
    let _ = std::fs::remove_dir_all(&folder);
    let (source, target) = (folder.join("source"), folder.join("unit"));
    std::fs::create_dir_all(source.join("parts")).unwrap();
    let model = include_str!("../../../../tests/models/mesh_on_hinge.toml");
    let (header, rest) = model.split_at(model.find("[[body]]").unwrap());
    std::fs::write(source.join("rest.toml"), rest).unwrap();
    let tetrahedron = "v 0 0 0\nv 3 0 0\nv 0 1 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(source.join("parts/bar.obj"), tetrahedron).unwrap();
    let main = source.join("main.toml");
    std::fs::write(&main, format!("include = [\"rest.toml\"]\n{header}")).unwrap();
    let text = ModelText::read(&main);
    let unit = Unit::in_folder(target, &text, &[], &[], &[]);
    let mut run = holonom::Simulation::new(&unit.model).unwrap();
    let energies: Vec<f64> = run.samples().take(20).map(|own| own.unwrap().hamiltonian).collect();
    std::fs::remove_dir_all(&source).unwrap();
    let (own, h) = (unit.begun(Version::Fmi3), unit.model.settings.step);
    for (n, energy) in energies.iter().enumerate() {
        let found = own.get(&[unit.reference("energy.H")])[0];
        assert_eq!(found.to_bits(), energy.to_bits(), "node {n}");
        assert_eq!(own.step(n as f64 * h, h).0, OK, "{}", own.said());
    }
}
