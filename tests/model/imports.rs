//! Imported robots against MuJoCo: the mass matrix in joint coordinates, and the joint
//! accelerations at given joint positions and velocities, under gravity, with springs and dampers,
//! without contact, friction, limits and actuators; with armatures where the numbers have them.
//!
//! ```text
//! M_joint = Vᵀ M V,   V = P T⁻¹        P: any null space of G;  T: joint rates of its columns
//! [M Gᵀ; G 0] [a; λ] = [f − ∇V; −D²g[v, v]],   v = V q̇       and q̈ from (v, a)
//! ```
//! Numbers of MuJoCo stand in `tests/imported/*.json` (made by `reference.py` there), or in the
//! folder `HOLONOM_IMPORTED`.
#![allow(non_snake_case)] // P, V, T, M, G: the matrices above

use std::path::{Path, PathBuf};

use holonom::import::{Base, ImportError, ImportOptions, JointValue, import, import_text};
use holonom::model::{Body, Constraint, Joint, JointKind};
use holonom::nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use holonom::vi_constraints::Constraints;
use holonom::vi_constraints::null_space::null_space_at;
use holonom::vi_core::{Configuration, MechanicalSystem};
use holonom::{Model, system};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use serde::Deserialize;

/// Numbers of MuJoCo for one robot.
#[derive(Deserialize)]
struct Reference {
    file: PathBuf,
    free_base: bool,
    /// Whether armatures are in the numbers.
    #[serde(default)]
    armature: bool,
    /// Whether actuators and tendons are in the numbers.
    #[serde(default)]
    forces: bool,
    joints: Vec<Coordinate>,
    velocity: Vec<f64>,
    mass: Vec<Vec<f64>>,
    acceleration: Vec<f64>,
}

/// A joint of MuJoCo with its axis, its point and the frame of its body in space.
#[derive(Deserialize)]
struct Coordinate {
    joint: Option<String>,
    body: Option<String>,
    kind: String,
    axis: [f64; 3],
    anchor: [f64; 3],
    frame: [[f64; 3]; 3],
    value: f64,
    /// Its value is that of another joint.
    follows: bool,
}

/// Rates, or accelerations, of a body: those of its centre of mass, and angular ones.
#[derive(Clone, Copy, Default)]
struct Motion {
    x: Vector3<f64>,
    v: Vector3<f64>,
    omega: Vector3<f64>,
}

/// The bodies of a model at a configuration; those of velocities and accelerations likewise.
struct Bodies<'a> {
    model: &'a Model,
    q: &'a [f64],
}

impl Bodies<'_> {
    /// The motion of a body for `rates`, coordinates of the same shape as `q`; the ground is at
    /// rest.
    fn motion(&self, name: &str, rates: &[f64]) -> Motion {
        let Some(k) = self.model.bodies.iter().position(|b| b.name == name) else {
            return Motion::default();
        };
        let triple = |a: &[f64], i: usize| Vector3::from_column_slice(&a[12 * k + 3 * i..][..3]);
        let omega = |i: usize| triple(self.q, i).cross(&triple(rates, i)) * 0.5;
        let omega = omega(1) + omega(2) + omega(3);
        Motion { x: triple(self.q, 0), v: triple(rates, 0), omega }
    }

    /// The generalized velocities of MuJoCo; with `acceleration` the accelerations instead.
    fn rates(&self, joints: &[Coordinate], v: &[f64], acceleration: Option<&[f64]>) -> Vec<f64> {
        joints.iter().flat_map(|joint| self.rate(joint, v, acceleration)).collect()
    }

    fn rate(&self, at: &Coordinate, v: &[f64], acceleration: Option<&[f64]>) -> Vec<f64> {
        let joint = at.joint.as_deref().unwrap_or_default();
        let R = Matrix3::from_fn(|i, j| at.frame[i][j]);
        let anchor = Vector3::from(at.anchor);
        if at.kind == "free" {
            let named = |b: &&Body| Some(&b.name) == at.body.as_ref();
            let found = self.model.bodies.iter().find(named);
            let body = found.unwrap_or(&self.model.bodies[0]).name.clone();
            let [velocity, rates] = [v, acceleration.unwrap_or(v)].map(|r| self.motion(&body, r));
            let r = anchor - velocity.x;
            let turning = velocity.omega.cross(&velocity.omega.cross(&r));
            let turning = if acceleration.is_some() { turning } else { Vector3::zeros() };
            let linear = rates.v + rates.omega.cross(&r) + turning;
            let angular = R.tr_mul(&rates.omega);
            return linear.iter().chain(angular.iter()).copied().collect();
        }
        let found = self.of(joint);
        let [p, c] = [&found.parent, &found.child].map(|name| self.motion(name, v));
        let [dp, dc] =
            [&found.parent, &found.child].map(|name| self.motion(name, acceleration.unwrap_or(v)));
        let second =
            |term: Vector3<f64>| if acceleration.is_some() { term } else { Vector3::zeros() };
        let n = Vector3::from(at.axis);
        match at.kind.as_str() {
            "hinge" => vec![n.dot(&(dc.omega - dp.omega))],
            "ball" => {
                let relative = dc.omega - dp.omega + second(c.omega.cross(&p.omega));
                R.tr_mul(&relative).iter().copied().collect()
            }
            _ => {
                // the point of the child on the axis of a planar pair, or any of a slide
                let rho =
                    if found.kind == JointKind::Planar { self.hinge_of(found, c.x) } else { c.x };
                let (r, s) = (rho - p.x, rho - c.x);
                let of_child =
                    dc.v + dc.omega.cross(&s) + second(c.omega.cross(&c.omega.cross(&s)));
                let of_parent =
                    dp.v + dp.omega.cross(&r) + second(p.omega.cross(&p.omega.cross(&r)));
                vec![n.dot(&(of_child - of_parent))]
            }
        }
    }

    /// The point of a joint in space.
    fn hinge_of(&self, joint: &Joint, or: Vector3<f64>) -> Vector3<f64> {
        joint.position.map_or(or, Vector3::from)
    }

    /// The joint of this name, or the planar pair that it became a part of.
    fn of(&self, name: &str) -> &Joint {
        let clean = name.replace(['.', ','], "_");
        let renamed = format!("{clean}_joint");
        let joints = &self.model.joints;
        let of_name = |wanted: &str| joints.iter().find(|j| j.name == wanted);
        let planar =
            || joints.iter().find(|j| j.kind == JointKind::Planar && j.name.contains(&clean));
        of_name(&clean)
            .filter(|_| of_name(&renamed).is_none())
            .or_else(|| of_name(&renamed))
            .or_else(planar)
            .unwrap_or_else(|| panic!("{name}"))
    }
}

/// Largest differences from MuJoCo, relative to the largest number.
struct Difference {
    mass: f64,
    acceleration: f64,
}

fn compare(reference: &Reference, folder: &Path) -> Difference {
    let values = reference
        .joints
        .iter()
        .filter(|j| ["hinge", "slide"].contains(&j.kind.as_str()) && !j.follows);
    let value = |j: &Coordinate| JointValue { joint: j.joint.clone().unwrap(), value: j.value };
    let options = ImportOptions {
        base: if reference.free_base { Base::Free } else { Base::Fixed },
        values: values.map(value).collect(),
        actuators: reference.forces,
        ..ImportOptions::default()
    };
    let imported = import(&folder.join(&reference.file), &options).unwrap();
    let mut model = imported.model;
    let rotors = model.constraints.iter().filter(|c| c.name().contains("_armature"));
    let bearings: Vec<String> = rotors
        .filter_map(|c| match c {
            Constraint::Gear { joints, .. } => Some(joints[0].clone()),
            _ => None,
        })
        .collect();
    let is_bearing = |name: &String| bearings.contains(name);
    if reference.armature {
        assert!(!bearings.is_empty(), "there is an armature");
        model.constraints.retain(|c| c.name().contains("_armature"));
    } else {
        model.constraints.clear();
        let bearing =
            |child: &str| model.joints.iter().any(|j| j.child == child && is_bearing(&j.name));
        model.bodies.retain(|body| !bearing(&body.name));
        model.joints.retain(|joint| !is_bearing(&joint.name));
    }
    model.joints.retain(|joint| !joint.cut); // MuJoCo's equalities are off
    if !reference.forces {
        model.laws.clear();
        model.springs.clear();
    }
    let parts = system::build(&model).unwrap();
    let (mechanism, n) = (&parts.mechanism, parts.mechanism.dim());
    let system = parts.dynamics.variational(mechanism);
    let q = mechanism.initial_configuration();
    let bodies = Bodies { model: &model, q: &q };

    let nv = reference.velocity.len();
    let P = null_space_at(mechanism, Configuration::new(0.0, &q), n - nv);
    let column = |k: usize| bodies.rates(&reference.joints, P.column(k).as_slice(), None);
    let T =
        DMatrix::from_columns(&(0..nv).map(|k| DVector::from_vec(column(k))).collect::<Vec<_>>());
    let V = &P * T.try_inverse().unwrap();
    let mut M = DMatrix::zeros(n, n);
    system.mass().emit(&mut M);
    let mass = V.tr_mul(&(&M * &V));
    let exact = DMatrix::from_fn(nv, nv, |i, j| reference.mass[i][j]);

    let v = &V * DVector::from_column_slice(&reference.velocity);
    let a = acceleration(mechanism, &system, &M, (&q, v.as_slice()));
    let found = bodies.rates(&reference.joints, v.as_slice(), Some(a.as_slice()));
    let found = DVector::from_vec(found);
    let expected = DVector::from_column_slice(&reference.acceleration);
    Difference {
        mass: (mass - &exact).amax() / exact.amax(),
        acceleration: (found - &expected).amax() / expected.amax().max(1.0),
    }
}

/// The accelerations of all coordinates by the saddle-point system.
fn acceleration(
    mechanism: &impl Constraints,
    system: &impl MechanicalSystem,
    M: &DMatrix<f64>,
    (q, v): (&[f64], &[f64]),
) -> DVector<f64> {
    let (n, m) = (mechanism.dim(), mechanism.len());
    let angles = mechanism.principal_angles(q);
    let at = Configuration { t: 0.0, q, angles: &angles, internal: &[] };
    let mut G = DMatrix::zeros(m, n);
    mechanism.jacobian(0.0, q, &mut G);
    let mut right = DVector::zeros(n + m);
    system.add_potential_gradient(at, -1.0, &mut right.as_mut_slice()[..n]);
    system.add_force(at.moving(v), &mut right.as_mut_slice()[..n]);
    let mut terms = vec![0.0; m];
    mechanism.acceleration_terms(0.0, q, v, &mut terms);
    (0..m).for_each(|i| right[n + i] = -terms[i]);
    let size = M.amax(); // rows of one size
    let mut saddle = DMatrix::zeros(n + m, n + m);
    saddle.view_mut((0, 0), (n, n)).copy_from(&(M / size));
    saddle.view_mut((0, n), (n, m)).copy_from(&G.transpose());
    saddle.view_mut((n, 0), (m, n)).copy_from(&G);
    right.rows_mut(0, n).unscale_mut(size);
    saddle.full_piv_lu().solve(&right).unwrap().rows(0, n).into()
}

#[test]
fn imported_robots_have_the_mass_matrix_and_the_accelerations_of_mujoco() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/imported");
    let folder = std::env::var_os("HOLONOM_IMPORTED").map_or_else(|| folder.into(), PathBuf::from);
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|e| e == "json")).collect();
    files.sort();
    let (mut worst, mut largest) = (Vec::new(), [0.0_f64; 2]);
    for path in &files {
        let reference: Reference =
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let Ok(difference) = std::panic::catch_unwind(|| compare(&reference, &folder)) else {
            worst.push(name);
            continue;
        };
        println!("{name}: M {:.1e}, q̈ {:.1e}", difference.mass, difference.acceleration);
        largest = [largest[0].max(difference.mass), largest[1].max(difference.acceleration)];
        if !(difference.mass < 1e-13 && difference.acceleration < 1e-12) {
            worst.push(name);
        }
    }
    println!(
        "{} robots, largest differences: M {:.1e}, q̈ {:.1e}",
        files.len(),
        largest[0],
        largest[1]
    );
    assert!(files.len() >= 8, "{} robots", files.len());
    assert!(worst.is_empty(), "{worst:?}");
}

/// Descriptions that are mutated.
const TEXTS: [&str; 7] = [
    include_str!("../imported/forces.xml"),
    include_str!("../imported/example-robot-data/panda.urdf"),
    include_str!("../imported/example-robot-data/TwoDofs.urdf"),
    include_str!("../imported/example-robot-data/iris.urdf"),
    include_str!("../imported/gymnasium/half_cheetah.xml"),
    include_str!("../imported/dm_control/fish.xml"),
    include_str!("../imported/gymnasium/humanoid.xml"),
];

/// What takes the place of a part of a text.
const ODD: [&str; 20] = [
    "",
    " ",
    "0",
    "-1",
    "nan",
    "inf",
    "1e99",
    "1e-300",
    "1e400",
    "\"",
    "<",
    ">",
    "/>",
    "</body>",
    "<body>",
    "world",
    "ground",
    "name",
    "\u{0}",
    "ö\u{202e}[a.b]\\",
];

/// An import ends with a model or with an error that says something, and never with a model file
/// that is refused.
fn harmless(text: &str) -> Result<(), TestCaseError> {
    let values = vec![JointValue { joint: "joint1".into(), value: 1e3 }];
    for options in [
        ImportOptions::default(),
        ImportOptions { base: Base::Free, values, actuators: true, ..ImportOptions::default() },
    ] {
        match import_text(text, Path::new("nowhere/robot.xml"), &options) {
            Ok(imported) => prop_assert!(!imported.model.bodies.is_empty()),
            Err(ImportError::Refused { source, .. }) => prop_assert!(false, "{source:?}\n{text}"),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_change_of_a_description_makes_the_import_panic(
        which in 0..TEXTS.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0..4_usize, 0..ODD.len()), 1..6),
    ) {
        let mut words: Vec<String> = TEXTS[which]
            .split_inclusive(|c: char| " \"<>=/".contains(c))
            .map(str::to_owned)
            .collect();
        for (at, how, odd) in changes {
            let at = at.index(words.len());
            match how {
                0 => words[at] = format!("{}{}", ODD[odd], words[at].chars().last().unwrap_or(' ')),
                1 => words[at] = ODD[odd].to_owned(),
                2 => {
                    let other = (at + odd) % words.len();
                    words.swap(at, other);
                },
                _ => {
                    let copy = words[at..(at + 8 * odd).min(words.len())].to_vec();
                    words.splice(at..at, copy);
                }
            }
        }
        harmless(&words.concat())?;
    }

    #[test]
    fn no_text_makes_the_import_panic(text in "(<(robot|mujoco|link|joint|body|geom|a)( name=\"[a-z]?\"| pos=\"[0-9 .e-]{0,6}\")?/?>|</[a-z]{1,6}>|.){0,20}") {
        harmless(&text)?;
    }
}
