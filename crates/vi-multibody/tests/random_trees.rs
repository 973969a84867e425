//! Identities on random trees of all joint types: `G P = 0`, the pair maps stay on the constraints,
//! tangents against differences, the sweeps of emitted matrices and the descriptor form against
//! dense matrices.

#![allow(clippy::unwrap_used)] // a test

use nalgebra::{DMatrix, DVector, Vector3};
use proptest::prelude::*;
use vi_constraints::node_solvers::RateOperators;
use vi_constraints::reparametrization::LastStep;
use vi_constraints::{Constraints, DenseNodal, NodalOperators, Reparametrization};
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_core::state::Memory;
use vi_core::{Configuration, DiscreteLagrangian, Entries, Quadrature, SeparableSystem};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::joint::{FrameId, Joint};
use vi_multibody::mechanism::{BarEnd, Mechanism};
use vi_multibody::pair::PairKind;
use vi_multibody::tree_descriptor::TreeDescriptor;
use vi_multibody::tree_map::TreeMap;
use vi_multibody::tree_nodal::TreeNodal;
use vi_testkit::Sample;

/// A random tree; every body hangs on an earlier one or on the ground, half of the joints are
/// written from child to parent.
pub(crate) fn random_tree(bodies: usize, seed: u64) -> Mechanism {
    random_tree_with(bodies, 0, seed)
}

/// The same with point masses, free, on a bar to the ground or on one to an earlier point mass.
fn random_tree_with(bodies: usize, points: usize, seed: u64) -> Mechanism {
    let mut random = Sample::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut builder = MechanismBuilder::new().gravity([0.3, -1.0, -9.0]);
    let mut frames = vec![FrameId::Ground];
    for k in 0..bodies {
        let j = Vector3::new(1.0, 1.2, 1.5) + 0.15 * random.vector();
        let inertia = Inertia::principal(2.0 + random.number(), j.into());
        let body = builder.body(&format!("body {k}"), inertia).at(2.0 * random.vector());
        frames.push(body.rotation_vector(random.vector()).id().into());
    }
    for k in 0..bodies {
        let kind = PairKind::ALL[random.index(PairKind::ALL.len())];
        if kind == PairKind::Free {
            continue;
        }
        let (parent, child) = (frames[(random.index(k + 1) + 1) % (k + 1)], frames[k + 1]);
        let (point, axis) = (random.vector(), random.vector());
        let reversed = random.number() <= 0.0;
        let [parent, child] = if reversed { [child, parent] } else { [parent, child] };
        builder.joint(&format!("joint {k}"), kind, parent, child).at(point).axis(axis);
    }
    let mut known = Vec::new();
    for k in 0..points {
        let at = 2.0 * random.vector();
        let point =
            builder.particle(&format!("point {k}"), 1.5 + random.number(), at, Vector3::zeros());
        let carrier: Option<(BarEnd, Vector3<f64>)> = match random.index(k + 2) {
            0 => Some((BarEnd::Ground(Vector3::zeros()), Vector3::zeros())),
            j if j <= k => Some(known[j - 1]),
            _ => None,
        };
        if let Some((carrier, from)) = carrier {
            builder.bar_of_length(&format!("bar {k}"), carrier, point, (at - from).norm());
        }
        known.push((BarEnd::from(point), at));
    }
    builder.build().unwrap().mechanism
}

pub(crate) fn increments(d: usize, size: f64, seed: u64) -> Vec<f64> {
    let mut random = Sample::new(seed);
    (0..d).map(|_| size * random.number()).collect()
}

fn moved(map: &TreeMap, q: &[f64], u: &[f64]) -> Interval {
    let mut s = Interval::new(q.len());
    s.open(0.0, 0.1, q);
    map.reparametrize(u, &mut s).unwrap();
    s.close();
    s
}

fn jacobian(mechanism: &Mechanism, q: &[f64]) -> DMatrix<f64> {
    let mut g = DMatrix::zeros(mechanism.len(), mechanism.dim());
    mechanism.jacobian(0.0, q, &mut g);
    g
}

fn residual(mechanism: &Mechanism, q: &[f64]) -> f64 {
    let mut g = vec![0.0; mechanism.len()];
    mechanism.value(Configuration::new(0.0, q), &mut g);
    norm_inf(&g)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    #[test]
    fn maps_keep_the_constraints_and_tangents_are_derivatives(
        bodies in 1_usize..7, seed in any::<u64>()
    ) {
        let mechanism = random_tree(bodies, seed);
        let map = TreeMap::new(&mechanism);
        let q = mechanism.initial_configuration();
        let (n, d) = (mechanism.dim(), map.dof());
        prop_assert!(residual(&mechanism, &q) < 1e-13);
        prop_assert_eq!(d, n - mechanism.len());

        let mut p = DMatrix::zeros(n, d);
        map.null_space(&q, &mut p);
        if d > 0 {
            let gp = (jacobian(&mechanism, &q) * &p).amax();
            prop_assert!(gp < 1e-13, "|G P| = {gp:e}");
            let smallest = p.singular_values().min();
            prop_assert!(smallest > 1e-3, "P has lost rank: {smallest:e}");
        }

        let u = increments(d, 0.9, seed ^ 5);
        let s = moved(&map, &q, &u);
        let g = residual(&mechanism, &s.q1);
        prop_assert!(g < 1e-13, "g(F_d(u, q)) = {g:e}");

        let mut tangent = DMatrix::zeros(n, d);
        map.tangent(&u, &s, &mut tangent);
        let e = 1e-6;
        for k in 0..d {
            let shifted = |by: f64| {
                let mut u = u.clone();
                u[k] += by;
                moved(&map, &q, &u)
            };
            let (plus, minus) = (shifted(e), shifted(-e));
            for i in 0..n {
                let difference = (plus.dq[i] - minus.dq[i]) / (2.0 * e);
                let off = (difference - tangent[(i, k)]).abs();
                prop_assert!(off < 2e-8, "∂F_d[{i}]/∂u[{k}] off by {off:e}");
            }
        }
    }

    #[test]
    fn residuals_from_the_vectors_of_joints_are_those_of_the_rows(
        bodies in 1_usize..7, seed in any::<u64>()
    ) {
        let mechanism = random_tree(bodies, seed);
        let q = increments(mechanism.dim(), 1.5, seed ^ 17); // off the constraints
        let at = Configuration::new(0.0, &q);
        let (mut rows, mut joints) = (vec![0.0; mechanism.len()], vec![0.0; mechanism.len()]);
        mechanism.value(at, &mut rows);
        mechanism.residual(at, &mut joints);
        let off: Vec<f64> = rows.iter().zip(&joints).map(|(a, b)| a - b).collect();
        prop_assert!(norm_inf(&off) < 1e-13, "g off by {:e}", norm_inf(&off));
        let v = increments(mechanism.dim(), 1.0, seed ^ 18);
        let mut rates = vec![0.0; mechanism.len()];
        mechanism.add_rates(0.0, &q, &v, &mut rates);
        let expected = jacobian(&mechanism, &q) * DVector::from_vec(v);
        let off: Vec<f64> = rates.iter().zip(expected.iter()).map(|(a, b)| a - b).collect();
        prop_assert!(norm_inf(&off) < 1e-13, "G v off by {:e}", norm_inf(&off));
    }

    #[test]
    fn quadratic_constraints_satisfy_the_midpoint_identity(bodies in 1_usize..7, seed in any::<u64>()) {
        let mechanism = random_tree(bodies, seed);
        // a thread is not quadratic
        let screw = |joint: &Joint| matches!(joint.kind, PairKind::Screw(_));
        prop_assume!(!mechanism.description().joints.iter().any(screw));
        let n = mechanism.dim();
        let (q0, q1) = (increments(n, 1.5, seed ^ 11), increments(n, 1.5, seed ^ 12));
        let mid: Vec<f64> = q0.iter().zip(&q1).map(|(a, b)| 0.5 * (a + b)).collect();
        let dq = DVector::from_iterator(n, q0.iter().zip(&q1).map(|(a, b)| b - a));
        let (mut g0, mut g1) = (vec![0.0; mechanism.len()], vec![0.0; mechanism.len()]);
        mechanism.value(Configuration::new(0.0, &q0), &mut g0);
        mechanism.value(Configuration::new(0.0, &q1), &mut g1);
        let predicted = jacobian(&mechanism, &mid) * &dq;
        let off: Vec<f64> = (0..g0.len()).map(|i| g1[i] - g0[i] - predicted[i]).collect();
        prop_assert!(norm_inf(&off) < 1e-12, "g(q1) − g(q0) − G(q_mid) Δq = {:e}", norm_inf(&off));

        // D²g is the derivative of G, constant in q
        let mut second = vec![0.0; mechanism.len()];
        mechanism.second_derivative(0.0, &q0, dq.as_slice(), dq.as_slice(), &mut second);
        let difference = (jacobian(&mechanism, &q1) - jacobian(&mechanism, &q0)) * &dq;
        let off: Vec<f64> = second.iter().zip(difference.iter()).map(|(a, b)| a - b).collect();
        prop_assert!(norm_inf(&off) < 1e-12, "D²g[Δq, Δq] off by {:e}", norm_inf(&off));
    }

    #[test]
    fn the_sweeps_solve_the_dense_system(bodies in 1_usize..12, seed in any::<u64>()) {
        let mechanism = random_tree(bodies, seed);
        let system: SeparableSystem = mechanism.system(Quadrature::Midpoint);
        let map = TreeMap::new(&mechanism);
        let (n, d) = (mechanism.dim(), map.dof());
        let q = mechanism.initial_configuration();
        let u = increments(d, 0.4, seed ^ 21);
        let mut s = moved(&map, &q, &u);
        s.h = 0.1;

        let mut tree = TreeNodal::new(mechanism.tree()).unwrap();
        let mut dense = DenseNodal::new(n, map);
        tree.begin(&s, &Memory::default(), None);
        dense.begin(&s, &Memory::default(), None);

        let w = increments(n, 1.0, seed ^ 31);
        let (mut a, mut b) = (vec![0.0; d], vec![0.0; d]);
        tree.pull_back(&w, &mut a);
        dense.pull_back(&w, &mut b);
        let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        prop_assert!(norm_inf(&off) < 1e-13 * (1.0 + norm_inf(&b)), "Pᵀw off by {:e}", norm_inf(&off));

        tree.reparametrize(&u, &mut s.clone()).unwrap();
        tree.solve(&|out: &mut dyn Entries| system.forced_d2_d1(&s, out), &u, &s, &mut a).unwrap();
        dense.solve(&|out: &mut dyn Entries| system.forced_d2_d1(&s, out), &u, &s, &mut b).unwrap();
        let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        let relative = norm_inf(&off) / norm_inf(&b).max(1e-300);
        prop_assert!(d == 0 || relative <= 1e-11, "relative difference {relative:e}");
    }

    #[test]
    fn the_sweeps_have_the_basis_of_a_last_step(bodies in 1_usize..9, seed in any::<u64>()) {
        let mechanism = random_tree(bodies, seed);
        let system: SeparableSystem = mechanism.system(Quadrature::Midpoint);
        let map = TreeMap::new(&mechanism);
        let (n, d) = (mechanism.dim(), map.dof());
        let u = [21, 61].map(|k| increments(d, 0.8, seed ^ k));
        let last = moved(&map, &mechanism.initial_configuration(), &u[0]);
        let s = moved(&map, &last.q1, &u[1]);
        let step = LastStep { u: &u[0], s: &last };

        let mut tree = TreeNodal::new(mechanism.tree()).unwrap();
        let mut dense = DenseNodal::new(n, map);
        tree.begin(&s, &Memory::default(), Some(step));
        dense.begin(&s, &Memory::default(), Some(step));
        let w = increments(n, 1.0, seed ^ 31);
        let (mut a, mut b) = (vec![0.0; d], vec![0.0; d]);
        tree.pull_back(&w, &mut a);
        tree.close(&mut a);
        dense.pull_back(&w, &mut b);
        let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        prop_assert!(norm_inf(&off) < 1e-13 * (1.0 + norm_inf(&b)), "off by {:e}", norm_inf(&off));

        tree.reparametrize(&u[1], &mut s.clone()).unwrap();
        let mixed = |out: &mut dyn Entries| system.forced_d2_d1(&s, out);
        tree.solve(&mixed, &u[1], &s, &mut a).unwrap();
        dense.solve(&mixed, &u[1], &s, &mut b).unwrap();
        let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        let relative = norm_inf(&off) / norm_inf(&b).max(1e-300);
        prop_assert!(d == 0 || relative <= 1e-10, "relative difference {relative:e}");
    }

    #[test]
    fn the_descriptor_form_solves_the_dense_system(
        bodies in 0_usize..9, points in 0_usize..7, seed in any::<u64>()
    ) {
        prop_assume!(bodies + points > 0);
        let mechanism = random_tree_with(bodies, points, seed);
        let system: SeparableSystem = mechanism.system(Quadrature::Midpoint);
        let map = TreeMap::new(&mechanism);
        let (n, d) = (mechanism.dim(), map.dof());
        let q = mechanism.initial_configuration();
        let u = increments(d, 0.4, seed ^ 51);
        let mut s = moved(&map, &q, &u);
        s.h = 0.1;
        // members coupled at random
        let strength = increments(n, 2.0, seed ^ 52);
        let coupled = |out: &mut dyn Entries| {
            system.forced_d2_d1(&s, out);
            for (i, value) in strength.iter().enumerate() {
                out.add(i, (5 * i + 7) % n, *value);
                out.add((5 * i + 7) % n, i, 0.5 * value);
            }
        };
        let mut descriptor = TreeDescriptor::new(&mechanism);
        let mut dense = DenseNodal::new(n, map);
        descriptor.begin(&s, &Memory::default(), None);
        dense.begin(&s, &Memory::default(), None);

        let w = increments(n, 1.0, seed ^ 53);
        let (mut a, mut b) = (vec![0.0; d], vec![0.0; d]);
        descriptor.pull_back(&w, &mut a);
        dense.pull_back(&w, &mut b);
        let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        prop_assert!(norm_inf(&off) < 1e-13 * (1.0 + norm_inf(&b)), "Pᵀw off by {:e}", norm_inf(&off));

        let (mut v, mut expected) = (vec![0.0; n], vec![0.0; n]);
        let nu = increments(d, 1.0, seed ^ 54);
        descriptor.push_forward(&nu, &mut v);
        dense.push_forward(&nu, &mut expected);
        let off: Vec<f64> = v.iter().zip(&expected).map(|(a, b)| a - b).collect();
        prop_assert!(norm_inf(&off) < 1e-12, "P ν off by {:e}", norm_inf(&off));

        descriptor.solve(&coupled, &u, &s, &mut a).unwrap();
        dense.solve(&coupled, &u, &s, &mut b).unwrap();
        let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        let relative = norm_inf(&off) / norm_inf(&b).max(1e-300);
        prop_assert!(d == 0 || relative <= 1e-9, "relative difference {relative:e}");
    }

    #[test]
    fn cleaning_brings_a_disturbed_tree_back(bodies in 1_usize..7, seed in any::<u64>()) {
        let mechanism = random_tree(bodies, seed);
        let mut q = mechanism.initial_configuration();
        let noise = increments(q.len(), 1e-9, seed ^ 41);
        q.iter_mut().zip(&noise).for_each(|(q, e)| *q += e);
        let before = residual(&mechanism, &q);
        mechanism.tree().clean(&mut q);
        let after = residual(&mechanism, &q);
        prop_assert!(after < 1e-14, "|g| from {before:e} to {after:e}");
    }
}
