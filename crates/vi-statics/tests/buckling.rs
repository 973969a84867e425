//! Critical loads by the stiffness of a static state, against closed forms.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{center_of, dead, load, straight, vector};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};
use vi_beam::element::ElementKind;
use vi_beam::{Beam, BeamMesh, BeamModel, FrameRule, Section};
use vi_multibody::pair::PairKind;
use vi_rigid::load::{Load, LoadKind};
use vi_statics::{BucklingError, StaticProblem};

/// Slender: `EI_1 = EI`, `EI_2 = ratio EI`, `GJ`.
fn section(ei: f64, ratio: f64, gj: f64) -> Section {
    let (ea, rho) = (1e8 * ei, [1.0, 1e-6, 1e-6, 0.0]);
    Section::new([ea, ea, ea, ei, ratio * ei, gj], rho).unwrap()
}

fn with_beam(mesh: &BeamMesh, section: Section) -> (BeamModel, Beam) {
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("beam", mesh, section).unwrap();
    let q = model.configuration();
    model.elements.set_strains(beam.elements.clone(), ElementKind::Helicoidal, &q).unwrap();
    (model, beam)
}

fn problem(model: &BeamModel, loads: Vec<Load>) -> StaticProblem {
    let mut problem = common::problem(model, &model.mechanism(), loads);
    problem.equilibrate().unwrap();
    problem
}

fn relative(found: f64, exact: f64) -> f64 {
    (found / exact - 1.0).abs()
}

/// The column along x under the force 1 towards its clamp: critical load parameters are forces.
fn column(hold: impl Fn(&mut BeamModel, &Beam), elements: usize) -> StaticProblem {
    let (mut model, beam) = with_beam(&straight(1.0, elements), section(1.0, 1.0, 1.0));
    hold(&mut model, &beam);
    problem(&model, vec![dead(beam.nodes.end - 1, -Vector3::x())])
}

fn cantilever(model: &mut BeamModel, beam: &Beam) {
    model.clamp(beam.nodes.start);
}

#[test]
fn euler_columns_buckle_at_their_loads() {
    let mut clamped_free = column(cantilever, 8);
    let found = clamped_free.buckling(6).unwrap();
    for (k, critical) in found.critical.iter().enumerate() {
        let exact = ((2 * (k / 2) + 1) as f64 * PI / 2.0).powi(2); // in two planes
        println!("clamped, free: {k}: {critical:.8}, error {:.1e}", relative(*critical, exact));
        assert!(relative(*critical, exact) < [4e-6, 2e-4, 3e-3][k / 2]);
    }
    assert!(found.residual < 1e-8 && found.reversed.is_none(), "{:?}", found.critical);
    // the shape is that of a quarter of a cosine
    let tip =
        |k: usize| Vector3::new(0.0, found.shapes[(12 * k + 1, 0)], found.shapes[(12 * k + 2, 0)]);
    let ratio = tip(4).norm() / tip(8).norm();
    assert!((ratio - (1.0 - (PI / 4.0).cos())).abs() < 1e-5, "{ratio}");
    let mut pinned = column(
        |model, beam| {
            let [first, last] = [beam.nodes.start, beam.nodes.end - 1];
            model.join(PairKind::Spherical, None, first, &Vector3::zeros(), &Vector3::x());
            model.join(PairKind::Prismatic, None, last, &Vector3::x(), &Vector3::x());
        },
        8,
    );
    let found = pinned.buckling(1).unwrap().critical[0];
    println!("pinned, clamped where it slides: {found}");
    assert!(relative(found, 20.190_728_56) < 2e-4, "{found}"); // tan x = x
}

#[test]
fn constant_loads_are_kept() {
    // half of the critical load as a weight that does not grow: the other half is left
    let (mut model, beam) = with_beam(&straight(1.0, 8), section(1.0, 1.0, 1.0));
    cantilever(&mut model, &beam);
    let tip = beam.nodes.end - 1;
    let kept = Load::new(
        12 * tip,
        LoadKind::Dead,
        -PI * PI / 8.0 * Vector3::x(),
        Vector3::zeros(),
        Default::default(),
    );
    let mechanism = model.mechanism();
    let system = model.static_system(&mechanism, vec![dead(tip, -Vector3::x())]);
    let system = system.force(Box::new(kept.unwrap()));
    let mut problem = StaticProblem::new(system, mechanism).with_elements(model.neighbours());
    problem.equilibrate().unwrap();
    let found = problem.buckling(2).unwrap();
    println!("beside a constant load: {:?}", found.critical);
    assert!(relative(found.critical[0], PI * PI / 8.0) < 1e-5, "{:?}", found.critical);
}

#[test]
fn a_tie_buckles_only_under_the_reversed_load() {
    let (mut model, beam) = with_beam(&straight(1.0, 8), section(1.0, 1.0, 1.0));
    cantilever(&mut model, &beam);
    let mut tie = problem(&model, vec![dead(beam.nodes.end - 1, Vector3::x())]);
    let found = tie.buckling(3).unwrap();
    println!("a tie: {:?}, reversed {:?}", found.critical, found.reversed);
    assert!(found.critical.is_empty(), "{:?}", found.critical);
    assert!(relative(found.reversed.unwrap(), -PI * PI / 4.0) < 1e-5);
}

#[test]
fn a_strip_tips_sideways() {
    // a cantilever of a thin strip under a force at the centre of its end: 4.013 √(EI GJ)/L²
    for elements in [8, 16, 32] {
        let (mut model, beam) = with_beam(&straight(1.0, elements), section(1000.0, 1e-3, 1.0));
        cantilever(&mut model, &beam);
        // EI_1 resists the force along y, EI_2 = GJ = 1 the motion along z
        let mut strip = problem(&model, vec![dead(beam.nodes.end - 1, Vector3::y())]);
        let found = strip.buckling(1).unwrap();
        println!("strip: {:?}, reversed {:?}", found.critical, found.reversed);
        let allowed = 0.6 / (elements * elements) as f64;
        assert!(relative(found.critical[0], 4.012_599_3) < allowed, "{:?}", found.critical);
        assert!(relative(-found.reversed.unwrap(), 4.012_599_3) < allowed, "{:?}", found.reversed);
    }
}

#[test]
fn a_portal_frame_sways() {
    // feet pinned in the plane, beam as stiff as the columns: kL tan kL = 6 with P on each column
    let s = section(1.0, 1.0, 1.0);
    let mut model = BeamModel::new(Vector3::zeros());
    let corners = [
        vector(0.0, 0.0, 0.0),
        vector(0.0, 0.0, 1.0),
        vector(1.0, 0.0, 1.0),
        vector(1.0, 0.0, 0.0),
    ];
    let mut beams = Vec::new();
    for (k, ends) in corners.windows(2).enumerate() {
        let rule = FrameRule::Normal(Vector3::y());
        let mesh = BeamMesh::straight(ends[0], ends[1], 8, rule).unwrap();
        beams.push(model.add_beam(&format!("beam{k}"), &mesh, s).unwrap());
    }
    let q = model.configuration();
    let all = 0..model.elements.list().len();
    model.elements.set_strains(all, ElementKind::Helicoidal, &q).unwrap();
    let ends: Vec<[usize; 2]> =
        beams.iter().map(|beam| [beam.nodes.start, beam.nodes.end - 1]).collect();
    for k in 0..2 {
        let corner = &corners[k + 1];
        model.join(PairKind::Fixed, Some(ends[k][1]), ends[k + 1][0], corner, &Vector3::x());
    }
    for (node, at) in [(ends[0][0], corners[0]), (ends[2][1], corners[3])] {
        model.join(PairKind::Revolute, None, node, &at, &Vector3::y());
    }
    let loads = [ends[0][1], ends[1][1]].map(|node| dead(node, -Vector3::z()));
    let mut frame = problem(&model, loads.to_vec());
    let found = frame.buckling(4).unwrap();
    // x tan x = 6
    let mut x = 1.35_f64;
    for _ in 0..50 {
        x -= (x * x.tan() - 6.0) / (x.tan() + x / x.cos().powi(2));
    }
    println!("portal: {:?}, in the plane {}", found.critical, x * x);
    assert!(found.critical.iter().any(|p| relative(*p, x * x) < 1e-4), "{:?}", found.critical);
}

/// Pressure on the nodes of an arc of radius 1 that follows their sections, per length 1.
fn pressure(beam: &Beam, angle: f64, nodes: usize) -> Vec<Load> {
    let share = angle / nodes as f64;
    let all = beam.nodes.clone().take(nodes);
    let own = |node| load(node, LoadKind::Follower, -share * Vector3::y(), Vector3::zeros());
    all.map(own).collect()
}

/// An arc of radius 1 about z that stiffness keeps in its plane.
fn arc(angle: f64, elements: usize) -> (BeamModel, Beam) {
    let rule = FrameRule::Normal(Vector3::z());
    let mesh = BeamMesh::arc(Vector3::zeros(), Vector3::x(), Vector3::z(), angle, elements, rule);
    with_beam(&mesh.unwrap(), section(1.0, 1e3, 1e3))
}

#[test]
fn a_ring_under_radial_loads_buckles() {
    // q = 4 EI/R³ of loads that keep their direction, 3 of a fluid's pressure (towards the centre:
    // 4.5)
    let elements = 32;
    let (mut model, beam) = arc(TAU, elements);
    let (first, last) = (beam.nodes.start, beam.nodes.end - 1);
    let q = model.configuration();
    model.join(PairKind::Fixed, Some(first), last, &Vector3::x(), &Vector3::z());
    // slides on both axes, along which an oval moves: the ring neither turns nor moves as a whole
    let slides = [(0, Vector3::x()), (elements / 4, Vector3::y()), (elements / 2, Vector3::x())];
    for (k, axis) in slides {
        let at = center_of(&q, first + k);
        model.join(PairKind::Prismatic, None, first + k, &at, &axis);
    }
    let share = TAU / elements as f64;
    let mut loads = Vec::new();
    for k in 0..elements {
        let node = beam.nodes.start + k;
        loads.push(dead(node, -share * center_of(&q, node)));
    }
    for (loads, exact) in [(loads, 4.0), (pressure(&beam, TAU, elements), 3.0)] {
        let found = problem(&model, loads).buckling(1).unwrap();
        println!("ring: {:?}, {exact}, {:.1e}", found.critical, found.asymmetry);
        assert!(relative(found.critical[0], exact) < 5e-3, "{:?}", found.critical);
    }
}

/// A fluid's pressure turns with the arch: its stiffness is symmetric but for the elements. Hinged:
/// `q = (π²/α² − 1) EI/R³` of the opening `2α`; clamped: `k² − 1`, `k tan α cot kα = 1`
/// (Timoshenko & Gere 1961, section 7.6).
#[test]
fn arches_under_pressure_that_follows_buckle_at_their_loads() {
    for (opening, hinged, exact) in [(PI, true, 3.0), (PI, false, 8.0), (0.5 * PI, true, 15.0)] {
        let elements = 16;
        let (mut model, beam) = arc(opening, elements);
        let q = model.configuration();
        for node in [beam.nodes.start, beam.nodes.end - 1] {
            if hinged {
                let at = center_of(&q, node);
                model.join(PairKind::Revolute, None, node, &at, &Vector3::z());
            } else {
                model.clamp(node);
            }
        }
        let loads = pressure(&beam, opening, elements).split_off(1);
        let found = problem(&model, loads).buckling(1).unwrap();
        let (critical, off) = (found.critical[0], relative(found.critical[0], exact));
        println!(
            "arch of {opening}, hinged {hinged}: {critical}, off by {off:.1e}, {:.1e}",
            found.asymmetry
        );
        assert!(off < 5e-3 && found.residual < 1e-6, "{critical} and {exact}, {}", found.residual);
    }
}

/// A tip load of which the part `η` follows: `cos kL = η/(η − 1)`, `P = k² EI`; from one half on
/// it diverges nowhere (Bolotin 1963, section 2).
#[test]
fn a_column_under_a_load_that_follows_in_part_diverges_at_its_load() {
    for part in [0.1_f64, 0.3, 0.45, 0.6] {
        let (mut model, beam) = with_beam(&straight(1.0, 16), section(1.0, 1e3, 1e3));
        cantilever(&mut model, &beam);
        let tip = beam.nodes.end - 1;
        let own = load(tip, LoadKind::Follower, -part * Vector3::z(), Vector3::zeros());
        let mut column = problem(&model, vec![own, dead(tip, -(1.0 - part) * Vector3::x())]);
        let found = column.buckling(1);
        if part > 0.5 {
            let refused = found.unwrap_err();
            assert!(matches!(refused, BucklingError::NoPotential(_)), "{refused:?}");
            continue;
        }
        let (found, exact) = (found.unwrap(), (part / (part - 1.0)).acos().powi(2));
        let (critical, off) = (found.critical[0], relative(found.critical[0], exact));
        println!("part {part}: {critical}, off by {off:.1e}, {:.1e}", found.asymmetry);
        assert!(off < 1e-3 && found.asymmetry > 1e-3, "{critical} and {exact}");
    }
}

#[test]
fn states_without_critical_loads_are_refused() {
    let mut follower = {
        let (mut model, beam) = with_beam(&straight(1.0, 8), section(1.0, 1.0, 1.0));
        cantilever(&mut model, &beam);
        let tip = beam.nodes.end - 1;
        problem(&model, vec![load(tip, LoadKind::Follower, -Vector3::z(), Vector3::zeros())])
    };
    let refused = follower.buckling(1).unwrap_err();
    println!("{refused}");
    assert!(matches!(refused, BucklingError::NoPotential(_)), "{refused:?}");
    let mut loaded = column(cantilever, 8);
    loaded.solve(&[3.0], &Default::default()).unwrap();
    let refused = loaded.buckling(1).unwrap_err();
    assert_eq!(refused, BucklingError::Unstable(2));
    let (mut model, beam) = with_beam(&straight(1.0, 4), section(1.0, 1.0, 1.0));
    cantilever(&mut model, &beam);
    let refused = problem(&model, vec![]).buckling(1).unwrap_err();
    assert_eq!(refused, BucklingError::NoLoad);
}
