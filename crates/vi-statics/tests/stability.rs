//! Limit and bifurcation points: Euler columns, the right-angle frame, snap-through, driven ends.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{center_of, dead, straight, vector};
use nalgebra::Vector3;
use std::f64::consts::PI;
use std::sync::Arc;
use vi_beam::model::BeamModel;
use vi_beam::{BeamMesh, FrameRule, Material, Profile, Section, Stated};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::pair::PairKind;
use vi_multibody::scalar_constraint::ScalarConstraint;
use vi_rigid::load::Load;
use vi_statics::ArcLengthSettings;
use vi_statics::StaticSettings;
use vi_statics::modes;

/// The factor at which the softest `ω²` vanishes, by secants from two factors below it.
fn critical_factor(model: &BeamModel, loads: &[Load], start: [f64; 2]) -> f64 {
    let mut problem = common::problem(model, &model.mechanism(), loads.to_vec());
    let mut softest = |factor: f64| {
        problem.solve(&[factor], &StaticSettings::default()).unwrap();
        let found = modes(&mut problem).unwrap();
        found.squared[0]
    };
    let [mut a, mut b] = start;
    let (mut at_a, mut at_b) = (softest(a), softest(b));
    for _ in 0..20 {
        if (b - a).abs() < 1e-8 * b {
            break;
        }
        let next = b - at_b * (b - a) / (at_b - at_a);
        (a, at_a) = (b, at_b);
        (b, at_b) = (next, softest(next));
    }
    b
}

#[test]
fn euler_columns_lose_their_stiffness_at_the_buckling_load() {
    let (length, ea, ga, bending) = (2.0, 4e4, 1.5e4, 50.0);
    // Reissner's column: N (1 − N/EA + N/GA) = EI κ²,  κ = π/2L clamped and free, π/L between pins
    let exact = |kappa: f64| {
        let (c, slope) = (bending * kappa * kappa, 1.0 / ga - 1.0 / ea);
        (-1.0 + (1.0 + 4.0 * slope * c).sqrt()) / (2.0 * slope)
    };
    let stiffness = [ga, ga, ea, bending, 3.0 * bending, bending];
    let section = Section::new(stiffness, [1.0, 1e-2, 1e-2, 0.0]).unwrap();
    for pinned in [false, true] {
        let load = exact(if pinned { PI / length } else { 0.5 * PI / length });
        let error = |elements: usize| {
            let mut model = BeamModel::new(Vector3::zeros());
            model.add_beam("column", &straight(length, elements), section).unwrap();
            if pinned {
                // the soft bending is about d_1 = z
                let (start, end) = (Vector3::zeros(), length * Vector3::x());
                model.join(PairKind::Revolute, None, 0, &start, &Vector3::z());
                let roller = model.add_frame(vi_multibody::mechanism::BodySpec {
                    name: "roller".into(),
                    body: None,
                    center: end,
                    triad: nalgebra::Matrix3::identity(),
                    velocity: Vector3::zeros(),
                    omega: Vector3::zeros(),
                });
                model.join(PairKind::Prismatic, None, roller, &end, &Vector3::x());
                model.join(PairKind::Revolute, Some(roller), elements, &end, &Vector3::z());
            } else {
                model.clamp(0);
            }
            let loads = [dead(elements, -load * Vector3::x())];
            critical_factor(&model, &loads, [0.9, 0.95]) - 1.0
        };
        let errors: Vec<f64> = [16, 32, 64].into_iter().map(error).collect();
        let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
        let euler = bending * (PI / length).powi(2) / if pinned { 1.0 } else { 4.0 };
        println!(
            "pinned {pinned}: Euler {euler:.3} N, exact {load:.3} N, relative errors {errors:?}, \
             orders {orders:.3?}"
        );
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.05), "{orders:?}");
        assert!(errors[2].abs() < 1e-3, "{errors:?}");
    }
}

/// Two legs of 240 mm, 30 × 0.6 mm, at a right angle; clamped; units N, mm, tonne.
fn right_angle_frame(elements: usize) -> (BeamModel, usize) {
    let material = Material::from_poisson(71_240.0, 0.31, 2.7e-9).unwrap();
    let profile = Profile::Rectangle { width: 0.6, height: 30.0 };
    let torsion = 30.0 * 0.6_f64.powi(3) / 3.0;
    let stated = Stated { torsion_constant: Some(torsion), ..Stated::default() };
    let section = profile.section(&material, &stated).unwrap();
    let rule = FrameRule::Normal(Vector3::z());
    let corner = vector(240.0, 0.0, 0.0);
    let legs = [
        BeamMesh::straight(Vector3::zeros(), corner, elements, rule).unwrap(),
        BeamMesh::straight(corner, vector(240.0, -240.0, 0.0), elements, rule).unwrap(),
    ];
    let mut model = BeamModel::new(Vector3::zeros());
    let beams = model.add_frame_work("frame", &legs, section).unwrap();
    model.clamp(0);
    (model, beams[1].nodes.end - 1)
}

#[test]
fn the_right_angle_frame_buckles_sideways() {
    let found: Vec<f64> = [5, 10, 20]
        .into_iter()
        .map(|elements| {
            let (model, tip) = right_angle_frame(elements);
            critical_factor(&model, &[dead(tip, Vector3::x())], [0.9, 1.0])
        })
        .collect();
    let limit = found[2] + (found[2] - found[1]) / 3.0;
    println!("critical loads {found:.5?} N with 5, 10, 20 elements per leg; limit {limit:.5} N");
    // Argyris et al. 1979: 1.088 N; the linear equations of a frame that is rigid in its plane,
    // integrated on their own: 1.08676 N
    assert!((limit / 1.088 - 1.0).abs() < 1e-3 && (limit / 1.08676 - 1.0).abs() < 1e-3, "{limit}");

    // a small force sideways: the deflection grows as δ P/(P_cr − P) (Southwell)
    let (model, tip) = right_angle_frame(20);
    let force = |z: f64| dead(tip, vector(1.0, 0.0, z));
    let mut problem = common::problem(&model, &model.mechanism(), vec![force(1e-6)]);
    let factors = [1.0, 1.05, 1.07, 1.08, 1.084];
    let mut points = Vec::new();
    for factor in factors {
        problem.solve(&[factor], &StaticSettings::default()).unwrap();
        // force sideways grows with the factor too: w/P = δ'/(P_cr − P)
        points.push((factor, center_of(problem.configuration(), tip).z));
    }
    let flexibility: Vec<(f64, f64)> = points.iter().map(|(p, w)| (*p, p / w)).collect();
    let (first, last) = (flexibility[3], flexibility[4]);
    let critical = last.0 + last.1 * (last.0 - first.0) / (first.1 - last.1);
    println!("deflections sideways {points:.4?}; Southwell: {critical:.4} N");
    assert!((critical / found[2] - 1.0).abs() < 1e-3, "{critical} against {}", found[2]);
    // beyond the critical load the frame stands aside
    problem.solve(&[1.15], &StaticSettings::default()).unwrap();
    let aside = center_of(problem.configuration(), tip).z;
    println!("at 1.15 N the tip is {aside:.1} mm aside");
    assert!(aside > 20.0, "{aside}");
}

/// Two bars from (∓a, 0) to the apex (0, b), pinned; the load at the apex points down.
fn bars(elements: usize) -> (BeamModel, usize, f64) {
    let (a, b, ea) = (1.0, 0.25, 1e4);
    let section = Section::new([1e4, 1e4, ea, 50.0, 50.0, 50.0], [1.0, 0.1, 0.1, 0.0]).unwrap();
    let rule = FrameRule::Normal(Vector3::z());
    let apex = vector(0.0, b, 0.0);
    let mut model = BeamModel::new(Vector3::zeros());
    for x in [-a, a] {
        let foot = vector(x, 0.0, 0.0);
        let mesh = BeamMesh::straight(foot, apex, elements, rule).unwrap();
        let bar = model.add_beam("bar", &mesh, section).unwrap();
        model.join(PairKind::Revolute, None, bar.nodes.start, &foot, &Vector3::z());
    }
    let (left, right) = (elements, 2 * elements + 1);
    model.join(PairKind::Revolute, Some(left), right, &apex, &Vector3::z());
    // limit point of two springs EA/l_0: l³ = l_0 a²,  P = 2 EA/l_0 (l_0/l − 1) y
    let rest = (a * a + b * b).sqrt();
    let l = (rest * a * a).cbrt();
    let limit = 2.0 * ea / rest * (rest / l - 1.0) * (l * l - a * a).sqrt();
    (model, left, limit)
}

#[test]
fn a_two_bar_arch_snaps_through_at_the_closed_form() {
    let (model, apex, limit) = bars(2);
    let mechanism = model.mechanism();
    let loads = vec![dead(apex, -2.0 * limit * Vector3::y())];
    let mut stuck = common::problem(&model, &mechanism, loads.clone());
    let error = stuck.solve(&[1.0], &StaticSettings::default()).unwrap_err();
    println!("load stepping: {error}; {}", error.remedy());
    assert!((stuck.factor() - 0.5).abs() < 1e-3, "stopped at {}", stuck.factor());
    assert_eq!(error.path().unwrap().points.last().unwrap().q, stuck.configuration());

    let mut problem = common::problem(&model, &mechanism, loads);
    let below = |point: &vi_statics::Equilibrium| point.q[12 * apex + 1] < -0.3;
    let settings = ArcLengthSettings { largest_length: 0.01, ..ArcLengthSettings::default() };
    let path = problem.follow(&settings, below).unwrap();
    let (mut worst, mut top) = (0.0_f64, 0.0_f64);
    for point in &path.points {
        let y = point.q[12 * apex + 1];
        let rest = (1.0_f64 + 0.0625).sqrt();
        let exact = 2e4 / rest * (rest / (1.0 + y * y).sqrt() - 1.0) * y;
        worst = worst.max((2.0 * limit * point.factor - exact).abs() / limit);
        top = top.max(point.factor);
    }
    println!(
        "arc length: {} points, off the closed form by {worst:.1e}; limit load {limit:.4} N, \
         highest point {:.4} N",
        path.points.len(),
        2.0 * limit * top
    );
    assert!(worst < 1e-9 && (2.0 * top - 1.0).abs() < 1e-3, "{worst:e}, {top}");
    let low = path.points.iter().map(|p| p.factor).fold(0.0, f64::min);
    assert!((low + 0.5).abs() < 1e-3, "the path is odd: {low}");
}

#[test]
fn a_driven_end_walks_through_the_limit_point() {
    // the apex slides down a vertical guide, y = b − 2 b t: a prescribed motion
    let (mut model, apex, limit) = bars(3);
    let point = vector(0.0, 0.25, 0.0);
    let slider = model.add_frame(vi_multibody::mechanism::BodySpec {
        name: "slider".into(),
        body: None,
        center: point,
        triad: nalgebra::Matrix3::identity(),
        velocity: Vector3::zeros(),
        omega: Vector3::zeros(),
    });
    let guide = model.join(PairKind::Prismatic, None, slider, &point, &Vector3::y());
    model.join(PairKind::Revolute, Some(slider), apex, &point, &Vector3::z());
    let coordinate = JointCoordinate::principal(&model.description.joints[guide], 0).unwrap();
    let reference = Arc::new(|t: f64| [-0.5 * t, -0.5, 0.0]);
    let driven = ScalarConstraint::motion("apex", coordinate, reference);
    model.description.scalars.push(driven);
    let mechanism = model.mechanism();
    let row = mechanism.scalar_rows(0).start;
    let mut problem = common::problem(&model, &mechanism, vec![]);
    let factors: Vec<f64> = (1..=40).map(|k| f64::from(k) / 40.0).collect();
    let settings = StaticSettings { first_step: 1.0, ..StaticSettings::default() };
    let path = problem.solve(&factors, &settings).unwrap();
    let (mut worst, mut top) = (0.0_f64, 0.0_f64);
    for point in &path.points {
        let y = 0.25 - 0.5 * point.factor;
        let rest = (1.0_f64 + 0.0625).sqrt();
        let exact = 2e4 / rest * (rest / (1.0 + y * y).sqrt() - 1.0) * y;
        let force = point.multipliers[row]; // on the slider: −∇g μ, down
        worst = worst.max((force - exact).abs() / limit);
        top = top.max(force);
    }
    println!(
        "driven apex: {} steps, {} halvings, force off by {worst:.1e}, highest {top:.3} of {limit:.3} N",
        path.points.len(),
        path.halvings
    );
    assert!(worst < 1e-9 && (top / limit - 1.0).abs() < 5e-3, "{worst:e}");
}
