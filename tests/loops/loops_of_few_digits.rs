//! Loops that move but for the digits of a file: they move as the exact ones, to the order of what
//! is wrong, by every scheme, in any size and attitude, with their residual reported. What is
//! locked by its shape, or built wrongly, stays locked and is named; what is near a singular
//! configuration stays what it is.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::models::{overrides, shipped};
use holonom::modes::{About, ModalAnalysis};
use holonom::nalgebra::{Rotation3, Vector3};
use holonom::simulation::RunOutcome;
use holonom::{Model, ModelError, RunFolder, Simulation};
use vi_testkit::model::{AXES, body, body_at, changed, head, heavy, hinge, motion};

/// A four-bar linkage in a plane that contains the direction of gravity.
#[derive(Clone, Copy)]
struct FourBar {
    /// Angle by which the axis of `C` is off, rad.
    off: f64,
    /// Its length, m.
    size: f64,
    /// Rotation of the whole.
    turned: [f64; 3],
    /// How far the anchor of `C` is out of the plane, in parts of the size.
    out: f64,
    /// How far it is off within the plane.
    open: f64,
    /// The rate of a drive of `A`, rad/s.
    drive: Option<f64>,
}

const EXACT: FourBar =
    FourBar { off: 0.0, size: 1.0, turned: [0.0; 3], out: 0.0, open: 0.0, drive: None };

const SCHEMES: [&str; 7] =
    ["nodal", "reduced", "constrained", "dalembert", "em-nodal", "em-constrained", "em-dalembert"];

fn list(x: Vector3<f64>) -> String {
    format!("[{:?}, {:?}, {:?}]", x.x, x.y, x.z)
}

impl FourBar {
    /// The model; one second of the linkage of 1 m.
    fn text(&self, scheme: &str) -> String {
        let whole = Rotation3::new(Vector3::from(self.turned));
        let (size, time) = (self.size, self.size.sqrt());
        let point = |x: f64, z: f64| list(size * (whole * Vector3::new(x, 0.0, z)));
        let mut text = format!(
            "[model]\nname = \"four_bar\"\ngravity = {}\n[simulation]\nstep = {:?}\nend = {:?}\nscheme = \"{scheme}\"\n",
            list(whole * Vector3::new(0.0, 0.0, -9.81)),
            0.002 * time,
            time
        );
        let angles =
            [0.0, (0.64_f64 / 0.28).atan(), std::f64::consts::PI - (0.36_f64 / 0.48).atan()];
        let bodies = [
            ("crank", 0.6, [0.0, 0.1], [0.002015, 3e-5]),
            ("coupler", 2.1, [0.32, 0.34], [0.0853, 1e-4]),
            ("rocker", 1.8, [0.82, 0.24], [0.054045, 9e-5]),
        ];
        for ((name, mass, [x, z], [across, along]), angle) in bodies.into_iter().zip(angles) {
            let rotation = whole * Rotation3::new(Vector3::new(0.0, angle, 0.0));
            let [across, along] = [across, along].map(|i| i * size.powi(5));
            text += &format!(
                "[[body]]\nname = \"{name}\"\nmass = {:?}\ninertia = [{across:?}, {across:?}, {along:?}]\nposition = {}\nrotation_vector = {}\n",
                mass * size.powi(3),
                point(x, z),
                list(rotation.scaled_axis())
            );
        }
        let joints = [
            ("A", "ground", "crank", [0.0, 0.0]),
            ("B", "crank", "coupler", [0.0, 0.2]),
            ("D", "ground", "rocker", [1.0, 0.0]),
            ("C", "coupler", "rocker", [0.64, 0.48]),
        ];
        for (name, parent, child, [x, z]) in joints {
            let off = if name == "C" { self.off } else { 0.0 };
            let axis = list(whole * Vector3::new(off.sin(), off.cos(), 0.0));
            let place = match name == "C" && (self.out != 0.0 || self.open != 0.0) {
                true => {
                    let half = 0.5 * (0.64_f64.powi(2) + 0.28_f64.powi(2)).sqrt();
                    let parent = size * Vector3::new(0.0, self.out, half + self.open);
                    let child = size * Vector3::new(0.0, 0.0, -0.3);
                    format!("anchor_parent = {}\nanchor_child = {}", list(parent), list(child))
                }
                false => format!("position = {}", point(x, z)),
            };
            text += &format!(
                "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"{child}\"\naxis = {axis}\n{place}\n"
            );
        }
        if let Some(rate) = self.drive {
            text += &motion("drive", "A", &format!("{{ rate = {rate:?} }}"));
        }
        text
    }
}

/// Where a run ended, how it did, and its simulation.
fn end_of(text: &str, replaced: &[(&str, &str)]) -> (Vec<f64>, RunOutcome, Simulation) {
    let model = Model::from_toml_with(text, &overrides(replaced)).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = Simulation::new(&model).unwrap_or_else(|e| panic!("{e}"));
    let mut last = Vec::new();
    let outcome = simulation
        .run::<()>(
            &mut |sample| {
                last.clone_from(&sample.q);
                Ok(())
            },
            &mut |_, _| {},
        )
        .unwrap();
    (last, outcome, simulation)
}

fn refused(text: &str, replaced: &[(&str, &str)]) -> String {
    let model = match Model::from_toml_with(text, &overrides(replaced)) {
        Ok(model) => model,
        Err(error) => return error.to_string(),
    };
    match Simulation::new(&model) {
        Ok(_) => panic!("taken"),
        Err(ModelError::Assembly(problems)) => {
            problems.iter().map(|p| format!("{p}; help: {:?}", p.help)).collect()
        }
        Err(error) => error.to_string(),
    }
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn they_move_as_the_exact_ones_by_every_scheme() {
    for scheme in SCHEMES {
        for turned in [[0.0; 3], [0.3, -0.7, 0.4]] {
            let exact = FourBar { turned, ..EXACT };
            let (there, outcome, simulation) = end_of(&exact.text(scheme), &[]);
            assert_eq!(outcome, RunOutcome::Done, "{scheme}");
            assert_eq!(simulation.assembly().counts.dof, 1);
            assert!(
                simulation.warnings().iter().all(|w| !w.contains("loop")),
                "no word of what is exact"
            );
            for off in [1e-10, 1e-6, 1e-4] {
                let (near, outcome, simulation) =
                    end_of(&FourBar { off, ..exact }.text(scheme), &[]);
                let (apart, warnings) = (apart(&near, &there), simulation.warnings());
                println!("{scheme}, off by {off:e}: {apart:.1e} from the exact one; {warnings:?}");
                assert_eq!(outcome, RunOutcome::Done, "{scheme}, {off:e}");
                assert_eq!(simulation.assembly().counts.dof, 1);
                assert!(apart <= 5.0 * off + 1e-9, "{scheme}, {off:e}: {apart:e}");
                // below the start tolerance not a word, above it one
                let of_loops: Vec<_> = warnings.iter().filter(|w| w.contains("loop")).collect();
                assert_eq!(of_loops.len(), usize::from(off > 1e-8), "{off:e}: {warnings:?}");
                let named = |w: &&String| w.contains("the axis of `C` is parallel to the others");
                assert!(of_loops.iter().all(named), "{warnings:?}");
            }
        }
    }
}

/// Energy of the variational scheme without trend, of the energy–momentum scheme exact: what is
/// solved is a mechanism.
#[test]
fn their_energy_is_that_of_a_mechanism() {
    for (scheme, bound) in [("nodal", 6e-3), ("dalembert", 6e-3), ("em-nodal", 1e-12)] {
        let text = FourBar { off: 1e-4, ..EXACT }.text(scheme);
        let model = Model::from_toml(&text).unwrap();
        let mut simulation = Simulation::new(&model).unwrap();
        let energies: Vec<f64> = simulation.samples().map(|s| s.unwrap().hamiltonian).collect();
        let error = energies.iter().map(|e| (e - energies[0]).abs()).fold(0.0, f64::max);
        println!("{scheme}: error of the energy {error:.1e} J");
        assert!(error < bound, "{scheme}: {error:e} J");
    }
}

#[test]
fn their_size_and_attitude_do_not_matter() {
    let turned = [0.3, -0.7, 0.4];
    let (there, _, _) = end_of(&FourBar { turned, ..EXACT }.text("nodal"), &[]);
    for size in [1e-6, 1e5] {
        let (near, outcome, simulation) =
            end_of(&FourBar { off: 1e-6, size, turned, ..EXACT }.text("nodal"), &[]);
        assert_eq!(outcome, RunOutcome::Done, "{size:e}");
        assert_eq!(simulation.assembly().counts.dof, 1);
        let lengths = |k: usize| if k % 12 < 3 { size } else { 1.0 };
        let off = |(k, (a, b)): (usize, (&f64, &f64))| (a / lengths(k) - b).abs();
        let off = near.iter().zip(&there).enumerate().map(off).fold(0.0, f64::max);
        println!("size {size:e} m: {off:.1e}");
        assert!(off < 1e-5, "{size:e}: {off:e}");
    }
}

/// Galerkin steps, statics and vibrations know the same degree of freedom.
#[test]
fn high_orders_statics_and_modes_know_them_too() {
    let near = FourBar { off: 1e-6, ..EXACT }.text("nodal");
    let high = [("simulation.method", "galerkin"), ("simulation.order", "6")];
    let (exact, _, _) = end_of(&EXACT.text("nodal"), &high);
    for scheme in ["nodal", "constrained"] {
        let replaced = [high[0], high[1], ("simulation.scheme", scheme)];
        let (there, outcome, _) = end_of(&near, &replaced);
        println!("order 6, {scheme}: {:.1e}", apart(&there, &exact));
        assert_eq!(outcome, RunOutcome::Done);
        assert!(apart(&there, &exact) < 1e-5);
    }
    let model = Model::from_toml(&near).unwrap();
    let modes = ModalAnalysis::new(&model, About::Start).unwrap().modes(3).unwrap();
    assert_eq!(modes.dof, 1);
}

/// 5 N·m on 1.2 + 20·0.4² = 4.4 kg·m² for a second.
#[test]
fn a_door_opens_on_hinges_that_are_a_nanometre_out_of_line() {
    let door = |offset: f64| {
        [
            heavy("door", [0.0, 0.0, -9.81], "step = 0.002, end = 1.0"),
            body_at([0.4, 0.0, 1.0], "door", 20.0, [1.0, 2.0, 1.2]),
            hinge("lower", ["ground", "door"], [0.0, 0.0, 0.2], AXES[2]),
            "motor = { effort = 5.0 }\n".into(),
            hinge("upper", ["ground", "door"], [offset, 0.0, 1.8], AXES[2]),
        ]
        .concat()
    };
    for offset in [1e-12, 1e-9, 1e-6] {
        let (q, outcome, simulation) = end_of(&door(offset), &[]);
        let angle = q[4].atan2(q[3]);
        println!("{offset:e} m: {angle} rad");
        assert_eq!(outcome, RunOutcome::Done);
        assert!((angle - 5.0 / 8.8).abs() < 1e-5, "{offset:e}: {angle}");
        let apart = |w: &String| w.contains("the axes of `lower` and `upper` are");
        assert_eq!(simulation.warnings().iter().any(apart), offset > 1e-8);
    }
    let (q, _, simulation) = end_of(&door(0.05), &[]);
    assert_eq!((simulation.assembly().counts.dof, q[4].abs() < 1e-12), (0, true));
    let warnings = simulation.warnings();
    assert!(
        warnings.iter().any(|w| w.contains("`lower` and `upper` are 0.05 m apart")),
        "{warnings:?}"
    );
}

#[test]
fn what_is_built_wrongly_stays_locked_and_is_named() {
    let warned = |text: &str, replaced: &[(&str, &str)]| {
        let model = Model::from_toml_with(text, &overrides(replaced)).unwrap();
        let simulation = Simulation::new(&model).unwrap();
        assert_eq!(simulation.assembly().counts.dof, 0);
        let warnings = simulation.warnings();
        println!("{warnings:?}");
        warnings.into_iter().find(|w| w.starts_with("nothing can move")).expect("a warning")
    };
    let degree = FourBar { off: 1_f64.to_radians(), ..EXACT };
    let warning = warned(&degree.text("nodal"), &[]);
    assert!(
        warning.contains("its axes are not parallel, that of `C` is off by 0.0175 rad (1°)"),
        "{warning}"
    );
    // every digit at its word
    let near = FourBar { off: 1e-6, ..EXACT }.text("nodal");
    let warning = warned(&near, &[("simulation.loop_tolerance", "0.0")]);
    assert!(
        warning.contains("that of `C` is off by 0.000001 rad") || warning.contains("1e-6 rad"),
        "{warning}"
    );
    // a brace from the ground to the rocker makes a truss of it
    let brace = body_at([0.4, 0.0, 0.2], "brace", 1.0, [0.1; 3])
        + &hinge("E", ["ground", "brace"], [0.0; 3], AXES[1])
        + &hinge("F", ["brace", "rocker"], [0.82, 0.0, 0.24], AXES[1]);
    warned(&(EXACT.text("nodal") + &brace), &[]);
    // a drive of a loop that is locked, and of one that moves within the tolerance
    let project = ("simulation.project_start", "true");
    let driven = FourBar { drive: Some(6.0), ..degree }.text("nodal");
    let refusal = refused(&driven, &[project]);
    println!("{refusal}");
    assert!(refusal.contains("is locked: its axes are not parallel, that of `C`"), "{refusal}");
    let driven = FourBar { off: 1e-6, drive: Some(6.0), ..EXACT }.text("nodal");
    let (_, outcome, simulation) = end_of(&driven, &[project]);
    assert_eq!((outcome, simulation.assembly().counts.dof), (RunOutcome::Done, 0));
    assert!(simulation.warnings().iter().all(|w| !w.contains("nothing can move")));
}

/// A parallelogram near its flat position has one degree of freedom, and a small singular value
/// that is no digit.
#[test]
fn nearly_singular_configurations_stay_what_they_are() {
    let flat = |angle: f64, off: f64| {
        let (c, s) = (angle.cos(), angle.sin());
        let mut text = head("flat", "step = 0.002, end = 2.0, project_start = true");
        let bodies = [
            ("crank", [c / 2.0, s / 2.0], angle),
            ("coupler", [c + 1.0, s], 0.0),
            ("rocker", [2.0 + c / 2.0, s / 2.0], angle),
        ];
        for (name, [x, y], angle) in bodies {
            text += &(body_at([x, y, 0.0], name, 1.0, [0.01, 0.1, 0.1])
                + &format!("rotation_vector = [0.0, 0.0, {angle:?}]\n"));
        }
        let joints = [
            ("A", "ground", "crank", [0.0, 0.0]),
            ("B", "crank", "coupler", [c, s]),
            ("D", "ground", "rocker", [2.0, 0.0]),
            ("C", "coupler", "rocker", [2.0 + c, s]),
        ];
        for (name, parent, child, [x, y]) in joints {
            let (off, rate) = if name == "C" {
                (off, "")
            } else {
                (0.0, if name == "A" { "rate = 1.0\n" } else { "" })
            };
            text +=
                &(hinge(name, [parent, child], [x, y, 0.0], [off.sin(), 0.0, off.cos()]) + rate);
        }
        text
    };
    for angle in [1e-3, 1e-5, 1e-7] {
        let (q, outcome, simulation) = end_of(&flat(angle, 0.0), &[]);
        let coupler = q[13] - (2.0 + angle).sin(); // the crank has turned by 2 rad
        println!("{angle:e} from the flat position: the coupler is off by {coupler:.1e} m");
        assert_eq!((outcome, simulation.assembly().counts.dof), (RunOutcome::Done, 1));
        assert!(coupler.abs() < 1e-5);
        assert!(
            simulation.warnings().iter().all(|w| !w.contains("loop")),
            "{:?}",
            simulation.warnings()
        );
    }
    let (q, outcome, _) = end_of(&flat(0.3, 1e-6), &[]);
    assert_eq!(outcome, RunOutcome::Done);
    assert!((q[13] - 2.3_f64.sin()).abs() < 1e-5, "{}", q[13]);
}

/// Out of the plane nothing corrects an anchor: below the tolerances it is taken, beyond them it is
/// named.
#[test]
fn an_anchor_out_of_the_plane_is_taken_or_named() {
    let (exact, _, _) = end_of(&EXACT.text("nodal"), &[]);
    let project = ("simulation.project_start", "true");
    for (out, replaced) in [
        (1e-14, &[][..]),
        (1e-13, &[]),
        (1e-12, &[]),
        (1e-9, &[]),
        (1e-12, &[project]),
        (1e-5, &[project]),
    ] {
        let (q, outcome, simulation) = end_of(&FourBar { out, ..EXACT }.text("nodal"), replaced);
        let warnings = simulation.warnings();
        println!("{out:e} m out of the plane: {:.1e}; {warnings:?}", apart(&q, &exact));
        let of_loops = warnings.iter().filter(|w| w.contains("loop")).count();
        assert_eq!(of_loops, usize::from(out > 1e-8), "{out:e}: {warnings:?}");
        assert_eq!(outcome, RunOutcome::Done, "{out:e}");
        assert!(apart(&q, &exact) <= 5.0 * out + 1e-9, "{out:e}");
    }
    let far = FourBar { out: 0.02, ..EXACT }.text("nodal");
    let refusal = refused(&far, &[]);
    assert!(refusal.contains("joint.C.anchor_child"), "{refusal}");
    let refusal = refused(&far, &[project]);
    println!("{refusal}");
    assert!(refusal.contains("miss each other by 0.02 m along (0, 1, 0)"), "{refusal}");
}

/// What is open is closed or refused in parts of its size.
#[test]
fn tolerances_of_the_start_are_parts_of_the_size() {
    let project = ("simulation.project_start", "true");
    for size in [1e-6, 1.0, 1e5, 1e7] {
        let open = |open: f64| FourBar { open, size, ..EXACT }.text("nodal");
        let refusal = refused(&open(9e-3), &[]);
        assert!(refusal.contains("violates this constraint by"), "{size:e}: {refusal}");
        let model = Model::from_toml_with(&open(1e-6), &overrides(&[project])).unwrap();
        let simulation = Simulation::new(&model).unwrap();
        let (mut g, q) = (vec![0.0; 38], simulation.configuration());
        let at = holonom::vi_core::Configuration::new(0.0, q);
        holonom::vi_constraints::Constraints::value(simulation.mechanism(), at, &mut g);
        let left = g.iter().map(|g| g.abs()).fold(0.0, f64::max) / size.max(1.0);
        let warnings = simulation.warnings();
        println!("size {size:e} m: residual {left:.1e}; {warnings:?}");
        assert!(left < 1e-14, "{size:e}: {left:e}");
        assert!(warnings.iter().any(|w| w.contains(" m, `") && w.contains(" rad")), "{warnings:?}");
    }
}

/// Bricard's mechanism with coordinates of five digits.
#[test]
fn a_spatial_loop_of_few_digits_moves() {
    let exact = shipped("bricard");
    let turned = exact.replace("axis = [0.0, 1.0, 0.0]", "axis = [0.00001, 1.0, -0.00001]");
    let replaced = [("simulation.end", "2.0"), ("simulation.step", "0.005")];
    let (there, _, _) = end_of(&exact, &replaced);
    let (near, outcome, simulation) = end_of(&turned, &replaced);
    println!("{:.1e} from the exact one; {:?}", apart(&near, &there), simulation.warnings());
    assert_eq!((outcome, simulation.assembly().counts.dof), (RunOutcome::Done, 1));
    assert!(apart(&near, &there) < 1e-2);
}

/// The line that states the initial rate of a drive.
#[test]
fn a_drive_comes_with_the_line_that_states_its_rate() {
    let text = head("motor", "step = 0.01, end = 0.1")
        + &body("shaft", 1.0, [1.0; 3])
        + &hinge("motor_shaft", ["ground", "shaft"], [0.0; 3], AXES[2])
        + &motion("drive", "motor_shaft", "{ rate = 6.283185 }");
    let model = Model::from_toml(&text).unwrap();
    let Err(ModelError::InconsistentStart(missed)) = Simulation::new(&model) else { panic!() };
    let problem = missed[0].problem();
    println!("{problem}; {:?}", problem.help);
    assert!(problem.to_string().contains("6.283185 rad/s"));
    let help = problem.help.unwrap();
    assert!(help.contains("write `rate = 6.283185` in the [[joint]] `motor_shaft`"), "{help}");
    let stated =
        changed(&text, "axis = [0.0, 0.0, 1.0]\n", "axis = [0.0, 0.0, 1.0]\nrate = 6.283185\n");
    Simulation::new(&Model::from_toml(&stated).unwrap()).unwrap();
}

/// The residuals stand in the summary of a run.
#[test]
fn the_summary_has_their_residuals() {
    let folder = std::env::temp_dir().join(format!("loops_{}", std::process::id()));
    let model = Model::from_toml(&FourBar { off: 1e-5, ..EXACT }.text("nodal")).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let runs = RunFolder::create(&folder, true).unwrap();
    let finished = holonom::run::run(&model, &mut simulation, &runs, &mut |_, _| {}).unwrap();
    drop(runs);
    std::fs::remove_dir_all(&folder).unwrap();
    let left = finished.summary.loop_residual.unwrap();
    println!("{left:?}");
    assert!(left.angle > 1e-6 && left.angle < 1e-5 && left.length < 1e-5);
}
