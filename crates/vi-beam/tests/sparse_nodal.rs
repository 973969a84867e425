//! The sparse reduced Newton matrix is the dense `P(q_n)ᵀ K ∂F_d/∂u`, whatever is coupled to what:
//! beam nodes as free roots and on joints, bodies on every kind of pair, springs between bodies and
//! particles.

#![allow(clippy::unwrap_used)] // a test
#![allow(non_snake_case)] // P, K

use crate::common;

use common::{flying_section, largest, vector};
use nalgebra::{DMatrix, Matrix3, Vector3};
use proptest::prelude::*;
use vi_beam::ElementKind;
use vi_beam::model::{BeamModel, StrainRule};
use vi_beam::{BeamMesh, FrameRule};
use vi_constraints::{Constraints, NodalOperators, Reparametrization};
use vi_core::linear::DenseLu;
use vi_core::state::Memory;
use vi_core::{DiscreteLagrangian, Entries, Interval, SeparableSystem};
use vi_multibody::mechanism::{Attachment, Bar, BarEnd, BodySpec, Mechanism, ParticleSpec};
use vi_multibody::pair::PairKind;
use vi_multibody::sparse_nodal::SparseNodal;
use vi_multibody::spring::{Spring, SpringLaw};
use vi_multibody::tree_map::TreeMap;
use vi_rigid::body::RigidBody;
use vi_rigid::inertia::EulerMoments;
use vi_rigid::load::LoadKind;
use vi_rigid::rotation;

fn body(name: &str, center: Vector3<f64>, turn: Vector3<f64>) -> BodySpec {
    BodySpec {
        name: name.into(),
        body: Some(RigidBody::new(1.7, EulerMoments([0.3, 0.4, 0.2])).unwrap()),
        center,
        triad: rotation::exp(&turn) * Matrix3::identity(),
        velocity: Vector3::zeros(),
        omega: Vector3::zeros(),
    }
}

/// ground – pair – body – pair – body – pair – beam – pair – body, a free beam, springs, two
/// particles.
fn model(kinds: [PairKind; 4], turn: Vector3<f64>) -> BeamModel {
    let mut model = BeamModel::new(vector(0.3, -9.81, 0.1));
    let (a, b) = (vector(0.5, 0.1, 0.0), vector(0.9, 0.4, 0.3));
    let first = model.add_frame(body("a", a, turn));
    let second = model.add_frame(body("b", b, 0.5 * turn));
    let rule = FrameRule::RotationMinimizing(vector(0.2, 1.0, 0.1));
    let from = vector(1.2, 0.4, 0.1);
    let mesh = BeamMesh::straight(from, from + vector(0.8, 0.3, 0.5), 4, rule).unwrap();
    let beam = model.add_beam("beam", &mesh, flying_section()).unwrap();
    let last = model.add_frame(body("c", vector(2.4, 0.6, 0.9), -turn));
    let free = BeamMesh::straight(vector(0.0, 2.0, 0.0), vector(1.0, 2.5, 0.3), 2, rule).unwrap();
    model.add_beam("free", &free, flying_section()).unwrap();
    let axis = vector(0.2, 0.3, 1.0);
    model.join(kinds[0], None, first, &vector(0.2, 0.0, 0.1), &axis);
    model.join(kinds[1], Some(first), second, &vector(0.7, 0.2, 0.2), &axis);
    model.join(kinds[2], Some(second), beam.nodes.start, &from, &vector(1.0, 0.3, 0.2));
    model.join(kinds[3], Some(beam.nodes.end - 1), last, &vector(2.1, 0.7, 0.7), &axis);
    let particle = |name: &str, position| ParticleSpec {
        name: name.into(),
        mass: 0.8,
        position,
        velocity: Vector3::zeros(),
    };
    let (p, r) = (vector(-1.0, 0.3, 0.2), vector(-1.6, 0.7, 0.6));
    model.description.particles = vec![particle("p", p), particle("r", r)];
    let bar = |name: &str, from, to, length| Bar { name: name.into(), from, to, length };
    model.description.bars = vec![
        bar("u", BarEnd::Ground(Vector3::zeros()), 0, p.norm()),
        bar("v", BarEnd::Particle(0), 1, (r - p).norm()),
    ];
    model
}

fn system(model: &BeamModel, mechanism: &Mechanism, rule: StrainRule) -> SeparableSystem {
    let spring = |from, to, natural_length| Spring {
        between: mechanism
            .point_of(to, &vector(0.1, 0.2, -0.1))
            .minus(&mechanism.point_of(from, &vector(-0.2, 0.1, 0.3))),
        stiffness: 30.0,
        natural_length,
        law: SpringLaw::Linear,
    };
    let follower =
        common::load(4, LoadKind::Follower, vector(0.3, 0.1, -0.5), vector(0.2, -0.4, 0.1));
    model
        .system(mechanism, rule)
        .potential(spring(Attachment::Body(0), Attachment::Body(7), 0.3))
        .potential(spring(Attachment::Particle(1), Attachment::Body(1), 0.2))
        .force(Box::new(follower))
}

/// The same with other strains of its elements.
fn with_strains(mut model: BeamModel, element: ElementKind) -> BeamModel {
    let (q, own) = (model.configuration(), 0..model.elements.list().len());
    model.elements.set_strains(own, element, &q).unwrap();
    model
}

const RULES: [(StrainRule, ElementKind); 4] = [
    (StrainRule::Midpoint, ElementKind::MeanDirectors),
    (StrainRule::Averaged, ElementKind::MeanDirectors),
    (StrainRule::Averaged, ElementKind::Helicoidal),
    (StrainRule::MassScaled, ElementKind::SecondOrder),
];

fn check(
    kinds: [PairKind; 4],
    (rule, element): (StrainRule, ElementKind),
    turn: [f64; 3],
    seed: [f64; 8],
) -> (f64, f64) {
    let model = with_strains(model(kinds, turn.into()), element);
    let mechanism = model.mechanism();
    assert!(!mechanism.has_loops());
    let system = system(&model, &mechanism, rule);
    let (n, map) = (Constraints::dim(&mechanism), TreeMap::new(&mechanism));
    let d = map.dof();
    let mut sparse = SparseNodal::new(&mechanism);
    let u: Vec<f64> = (0..d).map(|k| 0.3 * seed[k % 8] * (1.0 + 0.1 * k as f64).sin()).collect();
    let mut s = Interval::new(n);
    s.open(0.0, 0.01, &mechanism.initial_configuration());
    system.prepare(&mut s);
    sparse.reparametrize(&u, &mut s).unwrap();
    sparse.begin(&s, &Memory::default(), None);

    let (mut P, mut tangent) = (DMatrix::zeros(n, d), DMatrix::zeros(n, d));
    map.null_space(&s.q0, &mut P);
    map.tangent(&u, &s, &mut tangent);
    let mut K = DMatrix::zeros(n, n);
    system.forced_d2_d1(&s, &mut K);
    let dense = P.tr_mul(&(K * tangent));
    let w: Vec<f64> = (0..n).map(|i| (1.0 + i as f64).cos()).collect();
    let mut pulled = vec![0.0; d];
    sparse.pull_back(&w, &mut pulled);
    let expected = P.tr_mul(&nalgebra::DVector::from_column_slice(&w));
    assert!(common::distance(&pulled, expected.as_slice()) < 1e-12);

    let right: Vec<f64> = (0..d).map(|k| (2.0 + k as f64).sin()).collect();
    let (mut x, mut y) = (right.clone(), right);
    sparse.solve(&|out: &mut dyn Entries| system.forced_d2_d1(&s, out), &u, &s, &mut x).unwrap();
    DenseLu::new(d).solve(&dense, &mut y).unwrap();
    let matrix = (sparse.matrix() - &dense).amax() / dense.amax();
    let solution = common::distance(&x, &y) / largest(y.iter().copied());
    // a second solve replays the emission
    let mut again = vec![1.0; d];
    sparse
        .solve(&|out: &mut dyn Entries| system.forced_d2_d1(&s, out), &u, &s, &mut again)
        .unwrap();
    assert!((sparse.matrix() - &dense).amax() / dense.amax() < 1e-13);
    (matrix, solution)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn sparse_and_dense_agree(
        choice in proptest::array::uniform4(0_usize..8), rule in 0_usize..4,
        turn in proptest::array::uniform3(-1.0..1.0_f64),
        seed in proptest::array::uniform8(-1.0..1.0_f64),
    ) {
        let (matrix, solution) = check(choice.map(|k| PairKind::ALL[k]), RULES[rule], turn, seed);
        prop_assert!(matrix < 1e-14, "matrix off by {matrix:e}");
        prop_assert!(solution < 1e-11, "solution off by {solution:e}");
    }
}

#[test]
fn with_screws_the_matrix_is_the_derivative_of_the_residual() {
    let kinds = [PairKind::Revolute, PairKind::Spherical, PairKind::Universal, PairKind::Fixed];
    let mut worst = 0.0_f64;
    for ((rule, element), size) in RULES.into_iter().zip([0.1, 1.0, 0.3, 0.3]) {
        let mut model = with_strains(model(kinds, vector(0.3, -0.2, 0.5)), element);
        model.description.joints.remove(0); // the first body becomes a free root with descendants
        let mechanism = model.mechanism();
        let system = system(&model, &mechanism, rule);
        let n = Constraints::dim(&mechanism);
        let mut sparse = SparseNodal::new(&mechanism).by_screws();
        let d = sparse.dof();
        let mut s = Interval::new(n);
        s.open(0.0, 0.1, &mechanism.initial_configuration());
        system.prepare(&mut s);
        sparse.begin(&s, &Memory::default(), None);
        let y: Vec<f64> = (0..d).map(|k| size * (1.0 + k as f64).sin()).collect();
        let mut residual = |j: usize, by: f64| {
            let (mut y, mut r, mut w) = (y.clone(), vec![0.0; d], vec![0.0; n]);
            y[j] += by;
            sparse.reparametrize(&y, &mut s).unwrap();
            system.forced_d1(&s, &mut w);
            sparse.pull_back(&w, &mut r);
            r
        };
        let e = 1e-5;
        let differences: Vec<_> = (0..d).map(|j| (residual(j, e), residual(j, -e))).collect();
        residual(0, 0.0);
        sparse
            .solve(&|out: &mut dyn Entries| system.forced_d2_d1(&s, out), &y, &s, &mut vec![1.0; d])
            .unwrap();
        let exact = sparse.matrix();
        for (j, (plus, minus)) in differences.iter().enumerate() {
            for i in 0..d {
                let error = (plus[i] - minus[i]) / (2.0 * e) - exact[(i, j)];
                worst = worst.max(error.abs() / exact.amax());
            }
        }
    }
    println!("matrix off its differences by {worst:.1e}");
    assert!(worst < 1e-9, "{worst:e}");
}
