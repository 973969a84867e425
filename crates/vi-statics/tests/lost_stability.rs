//! What the signs of the stiffness say along a path: bifurcations, limit points, branches, against
//! closed forms.

use crate::common;

use common::{center_of, dead, straight, vector};
use nalgebra::Vector3;
use vi_beam::{
    BeamMesh, BeamModel, ElementKind, FrameRule, Material, Profile, Section, Stated, StrainRule,
};
use vi_core::Quadrature;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::{FrameId::Ground, PairKind};
use vi_rigid::TimeHistory;
use vi_statics::{ArcLengthSettings, StaticLinearization, StaticProblem, StaticSettings};

/// Where the number of unstable directions changes along load steps: `(t before, t after, count)`.
fn changes(problem: &mut StaticProblem, steps: usize) -> Vec<(f64, f64, usize)> {
    let mut last = (0.0, problem.equilibrate().unwrap().unstable.unwrap());
    let mut found = Vec::new();
    for n in 1..=steps {
        let target = n as f64 / steps as f64;
        let settings = StaticSettings { first_step: 1.0, ..StaticSettings::default() };
        for point in problem.solve(&[target], &settings).unwrap().points {
            let count = point.unstable.unwrap();
            if count != last.1 {
                found.push((last.0, point.factor, count));
            }
            last = (point.factor, count);
        }
    }
    found
}

/// A rod of length `l` on a hinge with a spring `k`, under a weight that grows: `P l = k`.
#[test]
fn a_rigid_column_passes_its_bifurcation() {
    for (other, elsewhere) in [(1.0, 1e12), (1e12, 1.0), (1e-3, 1e3)] {
        let (k, l) = (7.0 * other, 2.0);
        let mut builder = MechanismBuilder::new();
        let rod = builder.body("rod", Inertia::principal(1.0, [0.1; 3])).at([0.0, 0.0, l]).id();
        let foot = builder.joint("foot", PairKind::Revolute, Ground, rod).at([0.0; 3]);
        let foot = foot.axis([0.0, 1.0, 0.0]).id();
        builder.joint_spring(foot.coordinate(0), k, 0.0);
        // a neighbour of another stiffness
        let block = builder.body("block", Inertia::principal(1.0, [0.1; 3])).at([5.0, 0.0, 0.0]);
        let block = block.id();
        let slide = builder.joint("slide", PairKind::Prismatic, Ground, block);
        let slide = slide.at([5.0, 0.0, 0.0]).axis([1.0, 0.0, 0.0]).id();
        builder.joint_spring(slide.coordinate(0), elsewhere, 0.0);
        let growing = TimeHistory::Linear { slope: 2.0 * k / l };
        builder.load(rod).force([0.0, 0.0, -1.0]).history(growing);
        let built = builder.build().unwrap();
        let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
        let found = changes(&mut problem, 7);
        println!("k = {k:e} beside {elsewhere:e}: {found:?}, closed form 0.5");
        let [(before, after, 1)] = found[..] else { panic!("{found:?}") };
        assert!(before <= 0.5 && 0.5 <= after && after - before < 0.01);
    }
}

/// A parallelogram of four hinges, overconstrained, upright: two cranks and a coupler, a spring at
/// one foot.
#[test]
fn a_closed_loop_passes_its_bifurcation() {
    let (k, l) = (3.0, 1.5);
    let mut builder = MechanismBuilder::new();
    let inertia = Inertia::principal(1.0, [0.1; 3]);
    let left = builder.body("left", inertia).at([0.0, 0.0, 0.5 * l]).id();
    let right = builder.body("right", inertia).at([2.0, 0.0, 0.5 * l]).id();
    let top = builder.body("top", inertia).at([1.0, 0.0, l]).id();
    let y = [0.0, 1.0, 0.0];
    let foot = builder.joint("a", PairKind::Revolute, Ground, left).at([0.0; 3]).axis(y).id();
    builder.joint("b", PairKind::Revolute, Ground, right).at([2.0, 0.0, 0.0]).axis(y);
    builder.joint("c", PairKind::Revolute, left, top).at([0.0, 0.0, l]).axis(y);
    builder.joint("d", PairKind::Revolute, right, top).at([2.0, 0.0, l]).axis(y);
    builder.joint_spring(foot.coordinate(0), k, 0.0);
    let growing = TimeHistory::Linear { slope: 1.6 * k / l };
    builder.load(top).force([0.0, 0.0, -1.0]).history(growing);
    let built = builder.build().unwrap();
    let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
    let found = changes(&mut problem, 9);
    println!("{found:?}, closed form {}", 1.0 / 1.6);
    let [(before, after, 1)] = found[..] else { panic!("{found:?}") };
    assert!(before <= 0.625 && 0.625 <= after && after - before < 0.01);
}

/// Two springs from `(±a, 0)` to a mass at height `b` above them: the load turns back where
/// `dF/dw = 2k (1 − l₀a²/l³) = 0`, and again on the other side.
#[test]
fn a_shallow_truss_is_unstable_between_its_limit_points() {
    let (a, b, k) = (1.0_f64, 0.3_f64, 100.0);
    let rest = (a * a + b * b).sqrt();
    let mut builder = MechanismBuilder::planar();
    let top = builder.particle("top", 1.0, vector(0.0, b, 0.0), Vector3::zeros());
    for x in [-a, a] {
        builder.spring([x, 0.0, 0.0], top, k).natural_length(rest);
    }
    builder.particle_load(top, [0.0, -4.0, 0.0], TimeHistory::Linear { slope: 1.0 });
    let built = builder.build().unwrap();
    let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
    problem.equilibrate().unwrap();
    let settings =
        ArcLengthSettings { largest_length: 0.02, steps: 400, ..ArcLengthSettings::default() };
    let path = problem.follow(&settings, |point| point.factor > 1.0).unwrap();
    // |w| = height above the supports where l³ = l₀ a²
    let limit = (rest * a * a).cbrt().powi(2) - a * a;
    let limit = limit.sqrt();
    let mut seen = [0, 0];
    for point in &path.points {
        let unstable = point.q[1].abs() < limit;
        let near = (point.q[1].abs() - limit).abs() < 1e-3;
        if !near {
            assert_eq!(point.unstable, Some(usize::from(unstable)), "height {}", point.q[1]);
        }
        seen[usize::from(unstable)] += 1;
    }
    println!(
        "{} equilibria, {seen:?} stable and not, {} steps halved",
        path.points.len(),
        path.halvings
    );
    assert!(seen[0] > 10 && seen[1] > 10 && path.points.last().unwrap().factor > 1.0);
    assert!(path.halvings < 20, "limit points are no reason to halve");
}

/// A column of steel, 10 × 20 mm, under 1.5 times its critical load of 863.55 N with `side` N
/// across at its tip.
fn column(side: f64) -> (StaticProblem, usize) {
    let material = Material::from_poisson(2.1e11, 0.3, 7850.0).unwrap();
    let profile = Profile::Rectangle { width: 0.01, height: 0.02 };
    let section = profile.section(&material, &Stated::default()).unwrap();
    let mut model = BeamModel::new(Vector3::zeros());
    let mesh =
        BeamMesh::straight(Vector3::zeros(), Vector3::x(), 24, FrameRule::Normal(Vector3::z()));
    let beam = common::beam(&mut model, &mesh.unwrap(), section, ElementKind::Helicoidal);
    model.clamp(0);
    let tip = beam.nodes.end - 1;
    let loads = vec![dead(tip, vector(-1295.4, 0.0, side))];
    (common::problem(&model, &model.mechanism(), loads), tip)
}

#[test]
fn a_perfect_column_says_where_it_turns_unstable() {
    let (mut problem, _) = column(0.0);
    let found = changes(&mut problem, 20);
    println!("{found:?}, closed form {:.5}", 863.55 / 1295.4);
    let (before, after, count) = found[0];
    let critical = 863.55 / 1295.4;
    assert!(before < critical + 1e-3 && critical - 1e-3 < after && after - before < 2e-3);
    assert_eq!((found.len(), count), (1, 1));
}

#[test]
fn an_imperfect_column_bends() {
    let exact = vector(0.3635, 0.0, 0.789); // elastica
    for by_arc in [true, false] {
        let (mut problem, tip) = column(0.1);
        problem.equilibrate().unwrap();
        let halvings = if by_arc {
            let settings = ArcLengthSettings {
                first_length: 0.006,
                largest_length: 0.03,
                ..ArcLengthSettings::default()
            };
            let path = problem.follow(&settings, |point| point.factor >= 1.0).unwrap();
            assert!(path.points.iter().all(|point| point.unstable == Some(0)));
            problem.solve(&[1.0], &StaticSettings::default()).unwrap();
            path.halvings
        } else {
            let factors: Vec<f64> = (1..=10).map(|n| 0.1 * f64::from(n)).collect();
            problem.solve(&factors, &StaticSettings::default()).unwrap().halvings
        };
        let found = center_of(problem.configuration(), tip);
        println!("by arc {by_arc}: tip {found:.4?}, {halvings} steps halved");
        assert!((found - exact).norm() < 2e-3, "{found:?}");
        assert_eq!(problem.unstable_directions(), Some(0));
    }
}

/// Relaxed at once under twice the critical load, with a small load across.
#[test]
fn relaxation_ends_in_a_stable_equilibrium() {
    let section = Section::new([1e6, 1e6, 1e6, 1.0, 10.0, 10.0], [1.0, 1e-4, 1e-4, 0.0]).unwrap();
    let mut model = BeamModel::new(Vector3::zeros());
    let kind = ElementKind::Helicoidal;
    let beam = common::beam(&mut model, &straight(1.0, 24), section, kind);
    model.clamp(0);
    let tip = beam.nodes.end - 1;
    let history = TimeHistory::default();
    let system = |side: f64| {
        let load = vi_rigid::load::Load::new(
            12 * tip,
            vi_rigid::load::LoadKind::Dead,
            vector(-5.0, side, 0.0),
            Vector3::zeros(),
            history.clone(),
        );
        let mechanism = model.mechanism();
        let system = model.system(&mechanism, StrainRule::Midpoint).force(Box::new(load.unwrap()));
        StaticProblem::new(system, mechanism).with_elements(model.neighbours())
    };
    for side in [1e-3, -1e-3] {
        let point = system(side).equilibrate().unwrap();
        let found = center_of(&point.q, tip);
        println!("side load {side}: tip {found:.4?}, unstable {:?}", point.unstable);
        assert!((found - vector(0.060, 0.795 * side.signum(), 0.0)).norm() < 5e-3);
        assert_eq!(point.unstable, Some(0));
    }
    let upright = system(0.0).equilibrate().unwrap();
    assert_eq!(upright.unstable, Some(1), "without anything across it stays, and says so");
}

/// A square wire with a tip force of `EI/L²`: the elastica, 0.30172, whatever the slenderness.
#[test]
fn slender_wires_bend_as_the_elastica() {
    for slenderness in [1e3, 5e4, 1e6] {
        let side: f64 = 1.0 / slenderness;
        let bending = 2.1e11 * side.powi(4) / 12.0;
        let material = Material::from_poisson(2.1e11, 0.3, 7850.0).unwrap();
        let profile = Profile::Rectangle { width: side, height: side };
        let section = profile.section(&material, &Stated::default()).unwrap();
        let mut model = BeamModel::new(Vector3::zeros());
        let kind = ElementKind::Helicoidal;
        let beam = common::beam(&mut model, &straight(1.0, 16), section, kind);
        model.clamp(0);
        let tip = beam.nodes.end - 1;
        for at_once in [false, true] {
            let load = dead(tip, bending * Vector3::z());
            let mut problem = if at_once {
                let load = load.with_history(TimeHistory::default()).unwrap();
                let mechanism = model.mechanism();
                let system = model.system(&mechanism, StrainRule::Midpoint).force(Box::new(load));
                StaticProblem::new(system, mechanism).with_elements(model.neighbours())
            } else {
                common::problem(&model, &model.mechanism(), vec![load])
            };
            let first = problem.equilibrate().unwrap();
            if !at_once {
                problem.solve(&[0.25, 0.5, 0.75, 1.0], &StaticSettings::default()).unwrap();
            }
            let found = center_of(problem.configuration(), tip).z;
            println!("L/h {slenderness:e}, at once {at_once}: {found:.6}, {}", first.iterations);
            assert!((found - 0.30172).abs() < 1e-4, "{found}");
        }
    }
}

/// `(2k − 1)² < 60` in two planes: eight, however many modes are asked for, dense and in a
/// subspace.
#[test]
fn all_unstable_modes_are_counted() {
    let section = Section::new([1e6, 1e6, 1e6, 1.0, 1.0, 1.0], [1.0, 1e-4, 1e-4, 0.0]).unwrap();
    for elements in [20, 60, 120] {
        let mut model = BeamModel::new(Vector3::zeros());
        model.add_beam("column", &straight(1.0, elements), section).unwrap();
        model.clamp(0);
        let load = 60.0 * (0.5 * std::f64::consts::PI).powi(2);
        let loads = vec![dead(elements, -load * Vector3::x())];
        let mut problem = common::problem(&model, &model.mechanism(), loads);
        problem.solve(&[1.0], &StaticSettings::default()).unwrap();
        assert_eq!(problem.unstable_directions(), Some(8));
        for count in [1, 3, 4, 12] {
            let linear = match elements {
                20 => StaticLinearization::all(&mut problem).unwrap(),
                _ => StaticLinearization::lowest(&mut problem, count).unwrap(),
            };
            let found = linear.modes().unwrap();
            let unstable = (0..found.squared.len()).filter(|&k| found.is_unstable(k)).count();
            let last = (-found.squared[unstable - 1]).sqrt();
            println!("{elements} elements, {count}: {unstable}, the last grows by {last:.3} 1/s");
            assert_eq!((unstable, found.negative), (8, Some(8)));
            assert!(found.squared.len() >= unstable + count);
            assert!(elements < 60 || (last - 17.6).abs() < 0.5, "closed form with rotary inertia");
        }
    }
}

/// A rod that stands on a universal joint.
#[test]
fn an_equilibrium_that_is_unstable_from_the_beginning_says_so() {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let rod = builder.body("rod", Inertia::principal(2.0, [0.1; 3])).at([0.0, 0.0, 0.5]).id();
    let foot = builder.joint("foot", PairKind::Universal, Ground, rod).at([0.0; 3]);
    foot.axis([1.0, 0.0, 0.0]).second_axis([0.0, 1.0, 0.0]);
    let built = builder.build().unwrap();
    let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
    let point = problem.equilibrate().unwrap();
    assert_eq!(point.unstable, Some(2), "upright about both axes");
}
