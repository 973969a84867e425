//! All four schemes from `g` alone: frames of bars, redundant bars, a rod of prescribed length;
//! what the reparametrization over the tangent space refuses.
#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{Bars, Winch, frame};
use std::collections::BTreeMap;
use vi_constraints::{Constraints, InitialValues, Integrator, Options, SchemeKind};
use vi_core::composition::Composition;
use vi_core::linear::norm_inf;
use vi_core::potential::LinearPotential;
use vi_core::{Configuration, Entries, SeparableSystem};

struct Case<C> {
    name: &'static str,
    constraints: C,
    masses: Vec<f64>,
    force: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
}

impl<C: Constraints + Clone + 'static> Case<C> {
    fn run(&self, options: Options) -> Integrator<SeparableSystem, C> {
        let system = SeparableSystem::with_diagonal_mass(&self.masses)
            .potential(LinearPotential { force: self.force.clone() });
        let at = InitialValues::new(0.0, &self.q, &self.v);
        Integrator::new(system, self.constraints.clone(), options, at).unwrap()
    }

    /// The four schemes side by side.
    fn agree(&self, h: f64, steps: u32, tolerance: f64) {
        let mut runs = SchemeKind::ALL.map(|scheme| self.run(Options::new(scheme, h)));
        let mut worst = BTreeMap::new();
        for _ in 0..steps {
            runs.iter_mut().for_each(|run| assert!(run.step().is_ok()));
            let nodes: Vec<_> = runs
                .iter_mut()
                .map(|run| (run.before().q.clone(), run.node_before().unwrap().clone()))
                .collect();
            for (scheme, (q, node)) in SchemeKind::ALL.iter().zip(&nodes) {
                let apart = |a: &[f64], b: &[f64]| {
                    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
                };
                let entry = worst.entry(scheme.name()).or_insert([0.0_f64; 4]);
                let (q0, node0) = &nodes[0];
                entry[0] = entry[0].max(apart(q, q0));
                entry[1] = entry[1].max(apart(&node.p_projected, &node0.p_projected));
                entry[2] = entry[2].max(h * apart(&node.constraint_force, &node0.constraint_force));
                entry[3] = entry[3].max(node.position_residual);
            }
        }
        for (scheme, [q, p, force, g]) in worst {
            println!(
                "{}, {scheme}: q apart by {q:.1e}, p by {p:.1e}, h Gᵀλ by {force:.1e}; |g| {g:.1e}",
                self.name
            );
            assert!(q < tolerance && p < tolerance && force < tolerance && g < 1e-14, "{scheme}");
        }
    }

    /// Orders of `(q, ᵠp, Gᵀλ)` at `t = 1` of a scheme.
    fn orders(&self, scheme: SchemeKind, steps: u32) {
        let precise = Options::new(SchemeKind::Constrained, 1.0 / f64::from(steps));
        let mut precise = self.run(precise.composition(Composition::KahanLi17));
        (0..steps).for_each(|_| assert!(precise.step().is_ok()));
        let exact = (
            precise.state().q.clone(),
            precise.observe_state().unwrap().p_projected.clone(),
            precise.acceleration_multiplier().unwrap(),
        );
        let apart =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let errors = |steps: u32| {
            let mut run = self.run(Options::new(scheme, 1.0 / f64::from(steps)));
            (0..steps).for_each(|_| assert!(run.step().is_ok()));
            let q = apart(&run.state().q, &exact.0);
            let node = run.observe().unwrap();
            [q, apart(&node.p_projected, &exact.1), apart(&node.lambda, &exact.2)]
        };
        let (coarse, fine) = (errors(steps), errors(2 * steps));
        let orders = [0, 1, 2].map(|k| (coarse[k] / fine[k]).log2());
        println!("{}, {scheme:?}: orders of q, ᵠp, λ {orders:.2?}", self.name);
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.15), "{orders:?}");
    }
}

/// Points that turn about an axis and fly along.
fn flying(places: &[f64], dim: usize) -> Vec<f64> {
    let spin = [0.7, -1.1, 2.0];
    let mut v = Vec::new();
    for x in places.chunks(dim) {
        let x = [x[0], x[1], x.get(2).copied().unwrap_or(0.0)];
        let w = if dim == 2 { [0.0, 0.0, 2.0] } else { spin };
        let turn =
            [w[1] * x[2] - w[2] * x[1], w[2] * x[0] - w[0] * x[2], w[0] * x[1] - w[1] * x[0]];
        v.extend((0..dim).map(|i| turn[i] + 0.3 * (i as f64 - 0.5)));
    }
    v
}

fn free(name: &'static str, dim: usize, places: &[f64]) -> Case<Bars> {
    let masses = (0..places.len()).map(|i| 1.0 + 0.5 * (i / dim) as f64).collect();
    Case {
        name,
        constraints: frame(dim, places, false),
        masses,
        force: vec![0.0; places.len()],
        q: places.to_vec(),
        v: flying(places, dim),
    }
}

const TETRAHEDRON: [f64; 12] = [0.1, 0.0, 0.2, 1.0, 0.0, 0.0, 0.3, 0.9, 0.1, 0.4, 0.2, 0.8];

fn hung() -> Case<Bars> {
    let (masses, force) = (vec![1.0; 12], [0.0, 0.0, -9.81].repeat(4));
    let places: Vec<f64> = TETRAHEDRON.iter().map(|x| x + 0.4).collect();
    let constraints = frame(3, &places, true);
    Case { name: "hung tetrahedron", constraints, masses, force, v: vec![0.0; 12], q: places }
}

fn winch() -> Case<Winch> {
    let (masses, force) = (vec![1.5; 2], vec![0.0, -1.5 * 9.81]);
    let (q, v) = (vec![1.0, 0.0], vec![0.6, 0.5]);
    Case { name: "winch", constraints: Winch, masses, force, q, v }
}

#[test]
fn the_four_schemes_agree() {
    free("triangle", 2, &[0.0, 0.0, 1.0, 0.1, 0.4, 0.8]).agree(0.02, 500, 1e-11);
    free("tetrahedron", 3, &TETRAHEDRON).agree(0.02, 500, 1e-11);
    let redundant = [&TETRAHEDRON[..], &[-0.5, 0.6, 0.9]].concat();
    free("five points, a bar too many", 3, &redundant).agree(0.02, 300, 1e-11);
    hung().agree(0.01, 300, 1e-11);
    winch().agree(0.01, 500, 1e-11);
}

#[test]
fn orders_of_q_p_and_lambda() {
    for scheme in [SchemeKind::Nodal, SchemeKind::Reduced] {
        free("tetrahedron", 3, &TETRAHEDRON).orders(scheme, 50);
        hung().orders(scheme, 200);
        winch().orders(scheme, 100);
    }
}

#[test]
fn momentum_maps_hold_to_round_off() {
    let redundant = [&TETRAHEDRON[..], &[-0.5, 0.6, 0.9]].concat();
    for (name, places) in [("tetrahedron", &TETRAHEDRON[..]), ("five points", &redundant)] {
        let case = free(name, 3, places);
        for scheme in SchemeKind::ALL {
            let mut run = case.run(Options::new(scheme, 0.02));
            let maps = |run: &Integrator<SeparableSystem, Bars>| {
                let (q, p) = (&run.state().q, &run.state().p);
                let mut sum = [0.0; 6];
                for (x, p) in q.chunks(3).zip(p.chunks(3)) {
                    for i in 0..3 {
                        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                        sum[i] += p[i];
                        sum[3 + i] += x[j] * p[k] - x[k] * p[j];
                    }
                }
                sum
            };
            let start = maps(&run);
            let (mut drift, mut gap, mut size) = (0.0_f64, 0.0_f64, 0.0_f64);
            for _ in 0..2000 {
                run.step().unwrap();
                for (now, then) in maps(&run).iter().zip(start) {
                    drift = drift.max((now - then).abs());
                }
                let (q, p) = (&run.state().q, &run.state().p);
                size = size.max(norm_inf(q) * p.iter().map(|p| p.abs()).sum::<f64>());
                gap = gap.max(run.node_before().unwrap().position_residual);
            }
            println!("{name}, {scheme:?}: momentum maps drift by {drift:.1e}, |g| up to {gap:.1e}");
            // a random walk of the round-off of |x||p|
            let allowed = f64::EPSILON * size * 2000.0_f64.sqrt();
            assert!(drift < allowed && gap < 1e-13, "{drift:e} > {allowed:e} or {gap:e}");
        }
    }
}

#[test]
fn steps_across_the_fold_are_refused() {
    let case = winch();
    let mut run = case.run(Options::new(SchemeKind::Nodal, 3.0));
    let before = run.state().clone();
    let mut refused = None;
    for _ in 0..20 {
        let before = run.state().clone();
        if let Err(error) = run.step() {
            assert_eq!(run.state(), &before);
            refused = Some(error);
            break;
        }
        let node = run.node_before().unwrap();
        assert!(node.position_residual < 1e-13);
    }
    let refused = refused.expect("steps of 3 s cannot go well for ever");
    println!("{before:?}: {refused}; {}", refused.remedy());
    assert_eq!(refused.remedy(), "reduce the time step");
}

/// A parallelogram of three bars over the ground points 0 and 1.
#[derive(Clone)]
struct Parallelogram(Bars);

impl Constraints for Parallelogram {
    fn dim(&self) -> usize {
        4
    }
    fn len(&self) -> usize {
        3
    }
    fn value(&self, at: Configuration<'_>, out: &mut [f64]) {
        self.0.value(at, &mut out[..2]);
        let q = at.q;
        out[2] = 0.5 * ((q[2] - 1.0).powi(2) + q[3] * q[3] - 0.25);
    }
    fn jacobian(&self, t: f64, q: &[f64], out: &mut dyn Entries) {
        self.0.jacobian(t, q, out);
        out.add(2, 2, q[2] - 1.0);
        out.add(2, 3, q[3]);
    }
    fn second_derivative(&self, t: f64, q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        self.0.second_derivative(t, q, v, w, &mut out[..2]);
        out[2] = v[2] * w[2] + v[3] * w[3];
    }
}

/// Cranks at the angle `theta` with rate `rate`, masses at their ends.
fn parallelogram(theta: f64, rate: f64) -> Case<Parallelogram> {
    let (y, x) = (0.5 * theta.sin(), 0.5 * theta.cos());
    let bars = vec![(None, 0, 0.5), (Some(0), 1, 1.0)];
    Case {
        name: "parallelogram",
        constraints: Parallelogram(Bars { dim: 2, points: 2, bars }),
        masses: vec![1.0, 1.0, 3.0, 3.0],
        force: vec![0.0, -9.81, 0.0, -3.0 * 9.81],
        q: vec![x, y, 1.0 + x, y],
        v: vec![-rate * y, rate * x, -rate * y, rate * x],
    }
}

#[test]
fn a_flat_start_is_refused_by_every_scheme() {
    for scheme in SchemeKind::ALL {
        let case = parallelogram(0.0, 2.0);
        let system = SeparableSystem::with_diagonal_mass(&case.masses);
        let at = InitialValues::new(0.0, &case.q, &case.v);
        let options = Options::new(scheme, 0.01);
        let refused = Integrator::new(system, case.constraints, options, at).err().unwrap();
        println!("{scheme:?}: {refused}");
        let expected = "rank 2 there and rank 3 next to it";
        assert!(refused.to_string().contains(expected), "{refused}");
    }
}

#[test]
fn a_rank_that_changes_on_the_way_is_refused() {
    // the third row appears at t = 0.05
    #[derive(Clone)]
    struct Growing(Bars);
    impl Constraints for Growing {
        fn dim(&self) -> usize {
            self.0.dim()
        }
        fn len(&self) -> usize {
            2
        }
        fn value(&self, at: Configuration<'_>, out: &mut [f64]) {
            self.0.value(at, &mut out[..1]);
            out[1] = if at.t > 0.05 { at.q[2] } else { out[0] };
        }
        fn jacobian(&self, t: f64, q: &[f64], out: &mut dyn Entries) {
            self.0.jacobian(t, q, out);
            for i in 0..3 {
                let slope = if i == 2 { 1.0 } else { 0.0 };
                out.add(1, i, if t > 0.05 { slope } else { q[i] });
            }
        }
        fn second_derivative(&self, t: f64, q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
            self.0.second_derivative(t, q, v, w, &mut out[..1]);
            out[1] = if t > 0.05 { 0.0 } else { out[0] };
        }
    }
    let bars = Bars { dim: 3, points: 1, bars: vec![(None, 0, 1.0)] };
    let case = Case {
        name: "growing",
        constraints: Growing(bars),
        masses: vec![1.0; 3],
        force: vec![0.0; 3],
        q: vec![1.0, 0.0, 0.0],
        v: vec![0.0, 1.0, 0.0],
    };
    let mut run = case.run(Options::new(SchemeKind::Nodal, 0.01));
    let error = (0..20).find_map(|_| run.step().err()).expect("a row is not enforced");
    println!("{error}");
    assert!(error.to_string().contains("rank 2 here and rank 1 at the start"), "{error}");
}

#[test]
fn flat_positions_are_passed_on_the_branch_of_the_motion() {
    // turning over through both flat positions, swinging through one, and almost at rest in it
    for (theta, rate) in [(1.5_f64, 12.0), (0.3, 0.0), (1e-3, 0.0)] {
        for scheme in [SchemeKind::Dalembert, SchemeKind::Nodal, SchemeKind::Reduced] {
            let mut run = parallelogram(theta, rate).run(Options::new(scheme, 0.01));
            let mut level = 0.0_f64;
            for _ in 0..500 {
                run.step().unwrap();
                let q = &run.state().q;
                level = level.max((q[1] - q[3]).abs());
            }
            println!("from {theta} at {rate} rad/s, {scheme:?}: coupler off level by {level:.1e}");
            assert!(level < 1e-10, "{level:e}");
        }
    }
}
