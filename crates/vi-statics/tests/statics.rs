//! Static equilibria against closed forms and independent solutions: `benchmarks.md` §10–§12.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{center_of, dead, distance, flying_section, load, straight, vector};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_4, PI, TAU};
use vi_beam::model::BeamModel;
use vi_beam::{BeamMesh, ElementKind, FrameRule, Material, Profile, Section, Stated};
use vi_multibody::pair::PairKind;
use vi_rigid::load::{Load, LoadKind};
use vi_statics::ArcLengthSettings;
use vi_statics::{StaticError, StaticProblem, StaticSettings};

/// A cantilever: clamped at its first node, loaded at its last.
fn cantilever(mesh: &BeamMesh, section: Section, at: impl Fn(usize) -> Load) -> StaticProblem {
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("beam", mesh, section).unwrap();
    model.clamp(beam.nodes.start);
    common::problem(&model, &model.mechanism(), vec![at(beam.nodes.end - 1)])
}

fn tip(problem: &StaticProblem) -> Vector3<f64> {
    let q = problem.configuration();
    center_of(q, q.len() / 12 - 1)
}

#[test]
fn roll_up_is_the_closed_form_of_the_element() {
    let mut worst = 0.0_f64;
    for (elements, revolutions) in [(16, 0.5), (16, 1.0), (32, 2.0)] {
        let (length, bending) = (10.0, 500.0);
        let moment = revolutions * TAU * bending / length;
        let at = |tip| load(tip, LoadKind::Dead, Vector3::zeros(), moment * Vector3::z());
        let mut problem = cantilever(&straight(length, elements), flying_section(), at);
        problem.solve(&[1.0], &StaticSettings::default()).unwrap();
        let l = length / elements as f64;
        let theta = 0.5 * (2.0 * moment * l / bending).asin();
        let mut point = Vector3::zeros();
        for k in 0..=elements {
            worst = worst.max((center_of(problem.configuration(), k) - point).norm());
            let mean = (k as f64 + 0.5) * theta;
            point += l / (0.5 * theta).cos() * vector(mean.cos(), mean.sin(), 0.0);
        }
    }
    println!("roll-up: nodes off the closed form by {worst:.1e}");
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn too_large_a_moment_is_refused_with_the_last_equilibrium() {
    let moment = 2.0 * TAU * 50.0; // two turns on 16 elements: beyond EI/(2ℓ)
    let at = |tip| load(tip, LoadKind::Dead, Vector3::zeros(), moment * Vector3::z());
    let mut problem = cantilever(&straight(10.0, 16), flying_section(), at);
    let error = problem.solve(&[1.0], &StaticSettings::default()).unwrap_err();
    println!("{error}");
    let (StaticError::NotConverged { factor, path, .. }
    | StaticError::ElementLimit { factor, path, .. }
    | StaticError::Jump { factor, path, .. }) = error
    else {
        panic!("another error")
    };
    // EI sin θ cos θ/ℓ is largest at 45°: λ = EI/(2ℓM)
    let limit = 500.0 / (2.0 * 0.625 * moment);
    assert!(factor < limit && factor > 0.95 * limit, "{factor} against {limit}");
    assert_eq!(path.points.last().unwrap().q, problem.configuration());
    let angle = path.points.last().unwrap().limit.largest_angle;
    assert!((angle - FRAC_PI_4).abs() < 0.05, "{angle}");
}

fn bend(elements: usize, force: f64) -> StaticProblem {
    let (e, area) = (1e7, 1.0);
    let section = Section::new(
        [0.5 * e, 0.5 * e, e * area, e / 12.0, e / 12.0, e / 12.0],
        [1.0, 1.0, 1.0, 0.0],
    );
    let rule = FrameRule::Normal(Vector3::z());
    let (center, radius) = (100.0 * Vector3::x(), -100.0 * Vector3::x());
    let mesh = BeamMesh::arc(center, radius, -Vector3::z(), FRAC_PI_4, elements, rule).unwrap();
    cantilever(&mesh, section.unwrap(), |tip| dead(tip, force * Vector3::z()))
}

#[test]
fn the_45_degree_bend_converges_with_order_two() {
    let exact = [
        (300.0, vector(22.24478095, 58.77912249, 40.19189167)),
        (600.0, vector(15.68480053, 47.15043857, 53.47485879)),
    ];
    for (force, exact) in exact {
        let error = |elements| {
            let mut problem = bend(elements, force);
            problem.solve(&[1.0], &StaticSettings::default()).unwrap();
            (tip(&problem) - exact).norm()
        };
        let errors: Vec<f64> = [8, 16, 32, 64, 128].into_iter().map(error).collect();
        let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
        println!("bend, {force}: errors {errors:?}, orders {orders:.3?}");
        assert!(orders[1..].iter().all(|order| (order - 2.0).abs() < 0.05), "{orders:?}");
        assert!(errors[4] < 6e-3, "{errors:?}");
    }
}

/// Tip displacement on three meshes, the last two extrapolated with order 2.
fn extrapolated(displacement: impl Fn(usize) -> Vector3<f64>, elements: usize) -> Vector3<f64> {
    let (coarse, fine) = (displacement(elements), displacement(2 * elements));
    fine + (fine - coarse) / 3.0
}

#[test]
fn nachbagauer_cantilever() {
    let material = Material::from_poisson(2.07e11, 0.3, 7850.0).unwrap();
    let profile = Profile::Rectangle { width: 0.1, height: 0.5 };
    let section = profile.section(&material, &Stated::default()).unwrap();
    let displacement = |force: f64| {
        move |elements: usize| {
            let at = |tip| dead(tip, force * Vector3::y());
            let mut problem = cantilever(&straight(2.0, elements), section, at);
            problem.solve(&[1.0], &StaticSettings::default()).unwrap();
            tip(&problem) - 2.0 * Vector3::x()
        }
    };
    let large = extrapolated(displacement(6.25e7), 64);
    let error = (large - vector(-0.15097114423929, 0.71056859785352, 0.0)).norm();
    println!("Nachbagauer: tip off by {error:.1e}");
    assert!(error < 1e-7, "{large:?}");
    let small = extrapolated(displacement(6.25e4), 64);
    let error = (small - vector(-1.88849163e-7, 8.09903254e-4, 0.0)).norm();
    println!("Nachbagauer, small load: tip off by {error:.1e}");
    assert!(error < 1e-11, "{small:?}");
}

#[test]
fn princeton_beam() {
    let (height, width) = (12.3777e-3, 3.2024e-3);
    let material = Material::from_poisson(71.7e9, 0.31, 2700.0).unwrap();
    let profile = Profile::Rectangle { width, height };
    let torsion = 0.198 * profile.second_moments().iter().sum::<f64>();
    let stated = Stated { shear_factors: Some([1.0; 2]), torsion_constant: Some(torsion) };
    let section = profile.section(&material, &stated).unwrap();
    let exact = [
        (8.896, 0.0, vector(-1.35517e-4, -0.01071276, 0.0)),
        (8.896, 45.0, vector(-0.01441182, -0.00897920, 0.10911312)),
        (8.896, 90.0, vector(-0.02602148, 0.0, 0.14625236)),
        (13.345, 0.0, vector(-3.04668e-4, -0.01606118, 0.0)),
        (13.345, 90.0, vector(-0.05040102, 0.0, 0.20068396)),
        (4.448, 45.0, vector(-0.00374821, -0.00397643, 0.05606350)),
    ];
    for (force, beta, exact) in exact {
        let beta = f64::to_radians(beta);
        let displacement = |elements| {
            let at = |tip| dead(tip, force * vector(0.0, -beta.cos(), beta.sin()));
            let mut problem = cantilever(&straight(0.508, elements), section, at);
            problem.solve(&[1.0], &StaticSettings::default()).unwrap();
            tip(&problem) - 0.508 * Vector3::x()
        };
        let found = extrapolated(displacement, 64);
        let error = (found - exact).norm();
        println!("Princeton, {force} N at {:.0}°: off by {error:.1e} m", beta.to_degrees());
        assert!(error < 3e-8, "{found:?} against {exact:?}");
    }
}

#[test]
fn a_closed_load_cycle_returns() {
    let rule = FrameRule::RotationMinimizing(Vector3::x());
    let radius = 2.0 * Vector3::x();
    let mesh = BeamMesh::helix(Vector3::zeros(), radius, Vector3::z(), 4.0, 1.5, 24, rule).unwrap();
    for kind in [LoadKind::Dead, LoadKind::Follower] {
        let at = |tip| load(tip, kind, vector(8.0, -5.0, 12.0), vector(20.0, 15.0, -10.0));
        let mut problem = cantilever(&mesh, flying_section(), at);
        let start = problem.configuration().to_vec();
        let cycle = [0.5, 1.0, -0.7, 0.3, 0.0];
        let path = problem.solve(&cycle, &StaticSettings::default()).unwrap();
        let away = path.points.iter().map(|p| distance(&p.q, &start)).fold(0.0, f64::max);
        let back = distance(problem.configuration(), &start);
        println!("{kind:?} cycle: {away:.2} away, {back:.1e} off on return");
        assert!(away > 0.5 && back < 1e-12, "{away}, {back:e}");
    }
}

#[test]
fn newton_converges_quadratically_with_followers_joints_and_springs() {
    // ground – R – body-less node chain – S – beam: every term of the tangent is needed
    let mut model = BeamModel::new(vector(0.0, 0.0, -9.81));
    let arm = model.add_beam("arm", &straight(2.0, 4), flying_section()).unwrap();
    let rule = FrameRule::Normal(Vector3::z());
    let mesh = BeamMesh::straight(2.0 * Vector3::x(), vector(2.0, 3.0, 0.0), 6, rule).unwrap();
    let leg = model.add_beam("leg", &mesh, flying_section()).unwrap();
    let end = leg.nodes.end - 1;
    model.join(PairKind::Revolute, None, 0, &vector(0.0, -0.5, 0.0), &Vector3::z());
    let corner = 2.0 * Vector3::x();
    model.join(
        PairKind::Universal,
        Some(arm.nodes.end - 1),
        leg.nodes.start,
        &corner,
        &Vector3::z(),
    );
    model.join(PairKind::Spherical, None, end, &vector(2.5, 3.0, 0.4), &Vector3::z());
    let loads = vec![
        load(3, LoadKind::Follower, vector(30.0, 20.0, 10.0), vector(10.0, 5.0, 20.0)),
        load(8, LoadKind::Dead, vector(10.0, -20.0, 30.0), vector(-10.0, 20.0, 10.0)),
    ];
    let mechanism = model.mechanism();
    assert!(!mechanism.has_loops());
    let spring = vi_multibody::spring::Spring {
        between: mechanism
            .point_of(vi_multibody::mechanism::Attachment::Body(6), &vector(0.1, 0.0, 0.0))
            .minus(&vi_multibody::form::Form::constant(vector(1.0, -1.0, 0.5))),
        stiffness: 200.0,
        natural_length: 1.0,
        law: vi_multibody::spring::SpringLaw::Linear,
    };
    let system = model.static_system(&mechanism, loads).potential(spring);
    let mut problem = StaticProblem::new(system, mechanism).with_elements(model.neighbours());
    let path = problem.solve(&[0.3], &StaticSettings::default()).unwrap();
    for point in &path.points {
        println!(
            "λ = {:.4}: {} iterations, residual {:.1e}, bent {:.2} rad",
            point.factor, point.iterations, point.residual, point.limit.largest_angle
        );
        assert!(point.residual < 1e-9);
    }
    // from an equilibrium, a small step: quadratic convergence needs few iterations
    let near = problem.solve(&[0.3003], &StaticSettings { first_step: 1.0, ..Default::default() });
    let iterations = near.unwrap().points[0].iterations;
    println!("a small step takes {iterations} iterations");
    assert!(iterations <= 5, "{iterations}");
}

#[test]
fn a_shallow_arch_snaps_through() {
    let section = Section::new([1e4, 1e4, 1e4, 50.0, 50.0, 50.0], [1.0, 0.1, 0.1, 0.0]).unwrap();
    let curve = |t: f64| vector(t, 0.3 * (PI * t / 5.0).sin(), 0.0);
    let mesh = BeamMesh::parametric(&curve, 0.0, 5.0, 20, FrameRule::Normal(Vector3::z())).unwrap();
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("arch", &mesh, section).unwrap();
    model.join(PairKind::Revolute, None, 0, &Vector3::zeros(), &Vector3::z());
    model.join(PairKind::Revolute, None, 20, &(5.0 * Vector3::x()), &Vector3::z());
    assert_eq!(beam.nodes, 0..21);
    let mechanism = model.mechanism();
    let loads = vec![dead(10, -200.0 * Vector3::y())];
    let mut stuck = common::problem(&model, &mechanism, loads.clone());
    let jumped = stuck.solve(&[1.0], &StaticSettings::default());
    println!(
        "load stepping: {:?}",
        jumped.as_ref().map(|p| p.points.len()).map_err(|e| e.to_string())
    );
    let mut problem = common::problem(&model, &mechanism, loads);
    let through = |point: &vi_statics::Equilibrium| point.q[12 * 10 + 1] < -0.35;
    let path = problem.follow(&ArcLengthSettings::default(), through).unwrap();
    let heights: Vec<(f64, f64)> = path.points.iter().map(|p| (p.factor, p.q[121])).collect();
    let top = heights.iter().map(|p| p.0).fold(0.0, f64::max);
    let low = heights.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
    println!("{} points, {} halvings, λ from {low:.4} to {top:.4}", heights.len(), path.halvings);
    let residual = path.points.iter().map(|p| p.residual).fold(0.0, f64::max);
    assert!(through(path.points.last().unwrap()), "{:?}", heights.last());
    assert!(low < 0.0 && top > 0.0 && residual < 1e-8, "{low}, {top}, {residual:e}");
    // the path of a symmetric arch is odd about the flat state: λ(−y) = −λ(y) only approximately;
    // after the snap the load rises again
    assert!(heights.last().unwrap().0 > low);
}

#[test]
fn a_line_load_bends_as_the_beam_theory_says() {
    let (length, load) = (2.0, 1e-3);
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("beam", &straight(length, 64), flying_section()).unwrap();
    model.clamp(0);
    let history = vi_rigid::time_history::TimeHistory::default();
    let line =
        model.line_load(&beam, LoadKind::Dead, load * Vector3::y(), Vector3::zeros(), &history);
    let loads = line.unwrap();
    let mut problem = common::problem(&model, &model.mechanism(), loads);
    problem.solve(&[1.0], &StaticSettings::default()).unwrap();
    let bending = load * length.powi(4) / (8.0 * 500.0) + load * length.powi(2) / (2.0 * 1e4);
    let error = tip(&problem).y / bending - 1.0;
    println!("line load: tip off by {error:.1e} (relative)");
    assert!(error.abs() < 1e-3, "{error}");
    // the weight of the beam is a line load too
    let mut heavy = model.clone();
    heavy.description.gravity = load * Vector3::y(); // ρA = 1
    let mut same = common::problem(&heavy, &heavy.mechanism(), vec![]);
    same.solve(&[1.0], &StaticSettings::default()).unwrap();
    let difference = distance(same.configuration(), problem.configuration());
    assert!(difference < 1e-14, "{difference:e}");
}

/// Nodes held twice: a clamp and, redundantly, a revolute pair; both ends of two beams joined.
#[test]
fn redundant_joints_change_nothing() {
    let tip_with = |redundant: bool| {
        let mut model = BeamModel::new(Vector3::zeros());
        let first = model.add_beam("a", &straight(1.0, 4), flying_section()).unwrap();
        let second = model.add_beam("b", &straight(1.0, 4), flying_section()).unwrap();
        model.clamp(0);
        let ends =
            [(first.nodes.start, second.nodes.start), (first.nodes.end - 1, second.nodes.end - 1)];
        for (parent, child) in ends {
            let point = model.description.bodies[parent].center;
            model.join(PairKind::Fixed, Some(parent), child, &point, &Vector3::z());
        }
        if redundant {
            model.join(PairKind::Revolute, None, 0, &Vector3::zeros(), &Vector3::z());
            model.join(PairKind::Spherical, Some(4), 9, &Vector3::x(), &Vector3::z());
        }
        let mechanism = model.mechanism();
        assert_eq!(mechanism.has_loops(), redundant);
        let loads = vec![dead(9, vector(50.0, 100.0, 80.0))];
        let mut problem = common::problem(&model, &mechanism, loads);
        let path = problem.solve(&[1.0], &StaticSettings::default()).unwrap();
        assert!(path.points.last().unwrap().position_residual < 1e-14);
        center_of(problem.configuration(), 9)
    };
    let (tree, redundant) = (tip_with(false), tip_with(true));
    let off = (tree - redundant).norm();
    println!("redundant joints move the tip by {off:.1e} of {:.2}", (tree - Vector3::x()).norm());
    assert!(off < 1e-13 && (tree - Vector3::x()).norm() > 0.04, "{off:e}");
}

#[test]
fn helicoidal_elements_converge_with_order_4() {
    let exact = vector(15.68480053, 47.15043857, 53.47485879); // vouched to 1e-7
    let (e, center, radius) = (1e7, 100.0 * Vector3::x(), -100.0 * Vector3::x());
    let section = [0.5 * e, 0.5 * e, e, e / 12.0, e / 12.0, e / 12.0];
    let section = Section::new(section, [1.0, 1.0, 1.0, 0.0]).unwrap();
    let error = |elements: usize| {
        let rule = FrameRule::Normal(Vector3::z());
        let mesh = BeamMesh::arc(center, radius, -Vector3::z(), FRAC_PI_4, elements, rule).unwrap();
        let mut model = BeamModel::new(Vector3::zeros());
        common::beam(&mut model, &mesh, section, ElementKind::Helicoidal);
        model.clamp(0);
        let loads = vec![dead(elements, 600.0 * Vector3::z())];
        let mut problem = common::problem(&model, &model.mechanism(), loads);
        problem.solve(&[1.0], &StaticSettings::default()).unwrap();
        (tip(&problem) - exact).norm()
    };
    let errors: Vec<f64> = [4, 8, 16].into_iter().map(error).collect();
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("errors {errors:?}, orders {orders:.2?}");
    assert!((orders[1] - 4.0).abs() < 0.25 && errors[1] < 1e-3, "{errors:?}, {orders:?}");
}
