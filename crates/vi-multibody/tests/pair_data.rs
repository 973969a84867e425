//! A pair is data: what defines it is known to [`vi_multibody::pair`] alone.
//!
//! Two pairs without a variant of `PairKind` show it. One has the data of the cylindrical pair and
//! moves with its bits. The other is in no table, a translation in a plane: its columns (nodal
//! schemes, sweeps) and its rows (constrained schemes) are two statements of one motion.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use vi_constraints::{Options, SchemeKind};
use vi_core::Configuration;
use vi_core::galerkin::Stages;
use vi_core::linear::norm_inf;
use vi_multibody::builder::{BodyId, Inertia, MechanismBuilder};
use vi_multibody::ensemble::Ensemble;
use vi_multibody::joint_force::Viscous;
use vi_multibody::pair::Properties;
use vi_multibody::pair::columns::{Column, MotionSubspace};
use vi_multibody::pair::constraints::PairConstraint;
use vi_multibody::reaction::Reactions;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::{BuiltMechanism, FrameId, JointMotion, PairKind};

static SLEEVE: Properties = Properties {
    name: "sleeve",
    motion: MotionSubspace::Several(&[Column::ALONG_N, Column::ABOUT_N]),
    constraints: &[PairConstraint::GapAlongAxis, PairConstraint::ParallelAxes],
};

/// Translation along `m_1` and `m_2`.
static TABLE: Properties = Properties {
    name: "table",
    motion: MotionSubspace::Several(&[Column::ALONG_M1, Column::ALONG_M2]),
    constraints: &[PairConstraint::GapAcrossAxis, PairConstraint::EqualAttitude],
};

fn body(builder: &mut MechanismBuilder, at: [f64; 3]) -> BodyId {
    builder.body("body", Inertia::principal(2.0, [0.3, 0.4, 0.5])).at(at).id()
}

/// Bodies on a hinge by the pair, from its parent and from its child; `loaded` by springs and
/// dampers on its coordinates; `other` changes the start.
fn tree(kind: PairKind, loaded: bool, other: f64) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.3, -1.0, -9.0]);
    let at = [[0.5, 0.0, 0.1], [1.4, 0.3, 0.0], [1.2, -0.6, 0.2], [2.1, 0.4, -0.3]];
    let [a, b, c, d] = at.map(|at| body(&mut builder, at));
    let hinge = builder.joint("hinge", PairKind::Revolute, FrameId::Ground, a).at([0.0; 3]);
    hinge.axis([0.1, 1.0, 0.2]).rate(0.7 + other);
    let ends: [[FrameId; 2]; 3] =
        [[a.into(), b.into()], [c.into(), a.into()], [b.into(), d.into()]];
    for (k, [parent, child]) in ends.into_iter().enumerate() {
        let joint = builder.joint("pair", kind, parent, child).at([1.0, 0.1 * k as f64, 0.0]);
        let joint = joint.axis([1.0, 0.4, -0.3 * k as f64]);
        let joint = if k == 1 { joint } else { joint.rates(&[0.2, -0.4 - other]) };
        let joint = joint.id();
        for freedom in (0..kind.coordinate_count()).filter(|_| loaded) {
            builder.joint_spring(joint.coordinate(freedom), 30.0, 0.1);
            builder.joint_force(joint.coordinate(freedom), Viscous(0.3));
        }
    }
    builder.build().unwrap()
}

/// A loop of the pair and of hinges, with the pair in the tree and as what closes it.
fn ring(kind: PairKind) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.3, -9.81]);
    let y = [0.0, 1.0, 0.0];
    let [a, b, c] =
        [[0.2, 0.0, 0.4], [1.2, 0.0, 0.9], [2.2, 0.0, 0.5]].map(|at| body(&mut builder, at));
    builder.joint("first", kind, FrameId::Ground, a).at([0.0; 3]).axis(y);
    builder.joint("second", PairKind::Revolute, a, b).at([0.4, 0.0, 0.8]).axis(y);
    builder.joint("third", PairKind::Revolute, b, c).at([2.0, 0.0, 1.0]).axis(y);
    let last = builder.joint("last", kind, c, FrameId::Ground).at([2.4, 0.0, 0.0]).axis(y).id();
    builder.joint_spring(last.coordinate(0), 40.0, 0.2);
    builder.build().unwrap()
}

fn options(scheme: SchemeKind, stages: Option<usize>) -> Options {
    let options = Options::new(scheme, 0.01);
    stages.map_or(options, |stages| options.galerkin(Stages::new(stages).unwrap()))
}

/// Steps, then states, nodes, reactions, joint coordinates in words: floats of other bits are other
/// words.
fn story(built: &BuiltMechanism, options: Options) -> String {
    let mut run = built.clone().integrator(options).unwrap();
    let joints = built.mechanism.description().joints.clone();
    let mut angles: Vec<JointMotion> =
        joints.iter().map(|joint| JointMotion::new(joint.clone(), &run.state().q)).collect();
    let mut told = String::new();
    for _ in 0..15 {
        run.step().unwrap();
        let (t, q) = (run.state().t, run.state().q.clone());
        angles.iter_mut().for_each(|angle| angle.follow(&q));
        let values: Vec<&[f64]> = angles.iter().map(JointMotion::values).collect();
        let _ = writeln!(told, "{:?} {values:?}", run.state());
        let node = run.observe().unwrap().clone();
        let _ = writeln!(told, "{node:?}");
        if node.lambda.len() == run.constraints().rows().len() {
            let at = Configuration::new(t, &q);
            let found = Reactions::at(run.constraints(), at, &node.lambda, run.rows());
            let _ = writeln!(told, "{found:?}");
        }
    }
    told
}

#[test]
fn a_pair_without_a_variant_moves_with_the_bits_of_its_data() {
    let (sleeve, model) = (PairKind::Unlisted(&SLEEVE), PairKind::Cylindrical);
    let mut compared = 0;
    let runs = SchemeKind::ALL.map(|scheme| (scheme, None)).into_iter();
    let galerkin = [SchemeKind::Nodal, SchemeKind::Constrained].map(|scheme| (scheme, Some(2)));
    for (scheme, stages) in runs.chain(galerkin) {
        for (of, name) in [(tree(sleeve, true, 0.0), "tree"), (ring(sleeve), "loop")] {
            let same = if name == "tree" { tree(model, true, 0.0) } else { ring(model) };
            let (found, expected) =
                (story(&of, options(scheme, stages)), story(&same, options(scheme, stages)));
            assert!(found == expected, "{} {stages:?}, {name}", scheme.name());
            compared += found.len();
        }
    }
    println!("{compared} bytes of numbers are equal");
}

#[test]
fn members_of_an_ensemble_too() {
    let model = |kind, k: i32| tree(kind, false, 0.05 * f64::from(k));
    let members = |kind| {
        let models: Vec<_> = (0..6).map(|k| model(kind, k)).collect();
        let mut ensemble = Ensemble::new(models, options(SchemeKind::Nodal, None)).unwrap();
        assert_eq!(ensemble.in_lanes(), 6);
        ensemble.advance(40);
        ensemble
    };
    let states = |kind| {
        let ensemble = members(kind);
        (0..6).map(|k| format!("{:?}", ensemble.member(k).state())).collect::<Vec<_>>()
    };
    assert_eq!(states(PairKind::Unlisted(&SLEEVE)), states(PairKind::Cylindrical));
    let (kind, mut worst) = (PairKind::Unlisted(&TABLE), 0.0_f64);
    let ensemble = members(kind);
    for k in 0..6 {
        let mut own = model(kind, k).integrator(options(SchemeKind::Nodal, None)).unwrap();
        (0..40).for_each(|_| _ = own.step().unwrap());
        worst = worst.max(apart(ensemble.member(k as usize), &own));
    }
    println!("members and their own integrators are {worst:.1e} apart");
    assert!(worst < 1e-10, "{worst:e}");
}

/// The largest difference of two motions, relative to their size.
fn apart(a: &MechanismIntegrator, b: &MechanismIntegrator) -> f64 {
    let (a, b) = (&a.state().q, &b.state().q);
    let off: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    norm_inf(&off) / norm_inf(b)
}

#[test]
fn a_pair_of_no_table_moves_as_its_rows_say() {
    let kind = PairKind::Unlisted(&TABLE);
    for (name, built) in [("tree", tree(kind, true, 0.0)), ("loop", ring(kind))] {
        for stages in [None, Some(2)] {
            let [mut nodal, mut constrained] = [SchemeKind::Nodal, SchemeKind::Constrained]
                .map(|scheme| built.clone().integrator(options(scheme, stages)).unwrap());
            let start = nodal.state().q.clone();
            for _ in 0..30 {
                nodal.step().unwrap();
                constrained.step().unwrap();
            }
            let moved: Vec<f64> =
                nodal.state().q.iter().zip(&start).map(|(now, then)| now - then).collect();
            let (off, residual) =
                (apart(&nodal, &constrained), nodal.observe().unwrap().position_residual);
            println!("{name} {stages:?}: off {off:.1e}, g {residual:.1e}, {:.2}", norm_inf(&moved));
            assert!(norm_inf(&moved) > 0.1 && residual < 1e-13 && off < 1e-9, "{name}: {off:e}");
        }
    }
}

/// Files that name pairs in order to build joints, beside the folder of the pairs.
const BUILDERS: [&str; 8] = [
    "holonom-model/src/types/connection.rs",
    "holonom-sim/src/design/geometry.rs",
    "holonom-sim/src/system/beams.rs",
    "holonom-sim/src/resolution/rotor.rs",
    "holonom-sim/src/system/mod.rs",
    "vi-beam/src/model.rs",
    "vi-multibody/src/builder/assembly.rs",
    "vi-multibody/src/mechanism/spanning.rs",
];

fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, into);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            into.push(path);
        }
    }
}

/// What a line does with variants of `PairKind`: names one, and decides by it.
fn names_variant(line: &str) -> [bool; 2] {
    let code = line.split("//").next().unwrap_or_default();
    let mut found = [false; 2];
    for (at, _) in code.match_indices("PairKind::") {
        let rest = &code[at + "PairKind::".len()..];
        let length = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (name, after) = rest.split_at(length);
        let is_constant = name.chars().all(|c| c.is_ascii_uppercase());
        let is_variant = name.is_empty() || name.starts_with(char::is_uppercase) && !is_constant;
        let after = after.trim_start().trim_start_matches("(_)").trim_start_matches("{ .. }");
        let after = after.trim_start();
        let before = code[..at].trim_end();
        let compared = before.ends_with("==") || before.ends_with("!=") || before.ends_with('|');
        let matched = ["=>", "|", "if ", "==", "!="].iter().any(|sign| after.starts_with(sign));
        let decides = compared || matched || code.contains("matches!");
        found = [found[0] | is_variant, found[1] | (is_variant && decides)];
    }
    found
}

#[test]
fn no_code_outside_the_folder_of_the_pairs_decides_by_a_variant() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if !crates.join("holonom-sim/src").is_dir() {
        return; // packed alone
    }
    let mut files = Vec::new();
    for package in std::fs::read_dir(&crates).unwrap().flatten() {
        sources(&package.path().join("src"), &mut files);
    }
    let (mut found, mut builders) = (String::new(), Vec::new());
    for file in &files {
        let name = file.strip_prefix(&crates).unwrap().to_string_lossy().replace('\\', "/");
        if name.starts_with("vi-multibody/src/pair/") || name.ends_with("tests.rs") {
            continue;
        }
        let text = std::fs::read_to_string(file).unwrap();
        let own = text.split("#[cfg(test)]").next().unwrap_or_default();
        for (k, line) in own.lines().enumerate() {
            let [names, decides] = names_variant(line);
            let is_builder = BUILDERS.contains(&name.as_str());
            if decides || names && !is_builder {
                let _ = writeln!(found, "{name}:{}: {}", k + 1, line.trim());
            }
            if names && is_builder {
                builders.push(name.clone());
            }
        }
    }
    builders.dedup();
    println!("{} files; {builders:?} build joints", files.len());
    assert!(found.is_empty(), "ask the data of the pair instead:\n{found}");
    assert_eq!(builders.len(), BUILDERS.len(), "files that build no joint any more");
}

#[test]
fn what_decides_by_a_variant_is_seen() {
    for line in [
        "PairKind::Spherical | PairKind::Free => rigid,",
        "if link.joint.kind == PairKind::Free {",
        "PairKind::Screw(_) => false,",
        "PairKind::Planar if freedom < 2 => return None,",
        "matches!(kind, PairKind::Revolute)",
        "| PairKind::Fixed",
    ] {
        assert_eq!(names_variant(line), [true, true], "{line}");
    }
    assert_eq!(names_variant("use PairKind::{Fixed, Free};"), [true, false]);
    assert_eq!(names_variant("Self::Fixed => PairKind::Fixed,"), [true, false]);
    assert_eq!(names_variant("for kind in PairKind::ALL { // PairKind::Free"), [false, false]);
}
