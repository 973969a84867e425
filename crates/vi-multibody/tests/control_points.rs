//! The sweeps over all control points at once against dense matrices of one after the other, on
//! random trees of all joint types.

#![allow(clippy::unwrap_used)] // a test

use crate::random_trees::{increments, random_tree};
use nalgebra::{DMatrix, Vector3};
use proptest::prelude::*;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::galerkin::{ControlPointOperators, Pointwise, Sweeps};
use vi_constraints::reparametrization::{DenseNewton, Emission, LastStep, pull_back};
use vi_constraints::scheme::SubStep;
use vi_constraints::{Constraints, Reparametrization};
use vi_core::galerkin::Stages;
use vi_core::interval::Interval;
use vi_core::lanes::{Plain, Register, Twice};
use vi_core::newton::{BlockKind, Fault, UnknownBlock};
use vi_core::{Quadrature, SeparableSystem, State};
use vi_multibody::form::Form;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::spring::{Spring, SpringLaw};
use vi_multibody::tree_map::TreeMap;
use vi_multibody::tree_sweeps::TreeSweeps;

/// Dense matrices with rows in `P(q_j)`, columns in `∂F_d/∂u`.
struct DenseRows {
    map: TreeMap,
    blocks: Vec<UnknownBlock>,
    bases: [DMatrix<f64>; 2],
    newton: Vec<DenseNewton>,
}

impl DenseRows {
    fn new(mechanism: &Mechanism, stages: usize) -> Self {
        let (map, n) = (TreeMap::new(mechanism), mechanism.dim());
        let (blocks, d) = (map.blocks(), map.dof());
        let newton = (0..stages).map(|_| DenseNewton::new(n, d)).collect();
        Self { map, blocks, bases: [DMatrix::zeros(n, d), DMatrix::zeros(n, d)], newton }
    }
}

impl ControlPointOperators for DenseRows {
    fn dof(&self) -> usize {
        self.map.dof()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.map.reparametrize(u, s)?;
        s.close();
        Ok(())
    }

    fn pull_back(&mut self, q: &[f64], _: Option<LastStep<'_>>, w: &[f64], out: &mut [f64]) {
        self.map.null_space(q, &mut self.bases[0]);
        pull_back(&self.bases[0], w, out);
    }

    fn factorize(
        &mut self,
        j: usize,
        mass: &Emission<'_>,
        u: &[f64],
        s: &Interval,
    ) -> Result<(), Fault> {
        let [rows, columns] = &mut self.bases;
        self.map.null_space(&s.q1, rows);
        self.map.tangent(u, s, columns);
        self.newton[j].factorize(mass, rows, columns);
        Ok(())
    }

    fn solve(&mut self, j: usize, x: &mut [f64]) -> Result<(), Fault> {
        self.newton[j].solve(x)
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.map.clean(t, q);
    }
}

/// What sweeps and the end of a step give: `r`, `du`, `p̄_{n+1}`, `q_{n+1}`, the increments of all
/// control points, `du` once more with the factors at hand.
type Results = [Vec<f64>; 6];

fn results(
    sweeps: &mut impl Sweeps,
    system: &SeparableSystem,
    (stages, state, u): (Stages, &State, &[f64]),
) -> Results {
    let mut points = ControlPoints::new(state.q.len(), stages);
    let step = SubStep::single(0.0, 0.1);
    sweeps.open(system, &mut points, step, state);
    let zeros = || vec![0.0; u.len()];
    let (mut r, mut du, mut u, mut p) = (zeros(), zeros(), u.to_vec(), state.p.clone());
    sweeps.residual(system, &mut points, &u, &mut r, true).unwrap();
    du.copy_from_slice(&r);
    sweeps.correction(&points, &u, &mut du).unwrap();
    sweeps.residual(system, &mut points, &u, &mut r, false).unwrap();
    let mut again = r.clone();
    sweeps.correction(&points, &u, &mut again).unwrap();
    u.iter_mut().for_each(|u| *u *= 1.01); // the factors are then of another configuration
    sweeps.residual(system, &mut points, &u, &mut r, false).unwrap();
    sweeps.close(system, &mut points, &mut p);
    sweeps.write_increments(&mut points);
    let increments = (1..=stages.count()).flat_map(|j| points.point(j).dq.clone()).collect();
    [r, du, p, points.step().q1.clone(), increments, again]
}

fn in_lanes<T: Register>(
    lanes: T,
    mechanism: &Mechanism,
    system: &SeparableSystem,
    at: (Stages, &State, &[f64]),
) -> Results {
    let sweeps = TreeSweeps::new(lanes, mechanism, system, at.0);
    results(&mut sweeps.unwrap(), system, at)
}

/// The largest difference, relative to the largest number.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(1e-300_f64, |size, b| size.max(b.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

/// Gravity, and a spring between the first body and a point of space.
fn system(mechanism: &Mechanism, spring: bool) -> SeparableSystem {
    let system = mechanism.system(Quadrature::Midpoint);
    if !spring {
        return system;
    }
    let end = Form::constant(Vector3::new(3.0, 2.0, 4.0));
    let between = Form::point(0, &Vector3::new(0.3, -0.2, 0.1)).minus(&end);
    system.potential(Spring {
        between,
        stiffness: 40.0,
        natural_length: 1.0,
        law: SpringLaw::Linear,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn all_control_points_at_once_are_one_after_the_other(
        bodies in 1_usize..7, s in 1_usize..=8, spring in any::<bool>(), seed in any::<u64>()
    ) {
        let mechanism = random_tree(bodies, seed);
        let (n, d) = (mechanism.dim(), mechanism.tree().dof());
        prop_assume!(d > 0);
        let (system, stages) = (system(&mechanism, spring), Stages::new(s).unwrap());
        let state = State::new(0.0, mechanism.initial_configuration(), increments(n, 3.0, seed ^ 1));
        let u = increments(s * d, 0.5, seed ^ 2);
        let at = (stages, &state, &u[..]);
        let operators = DenseRows::new(&mechanism, s);
        let expected = results(&mut Pointwise::new(n, s, operators), &system, at);
        let found = if s <= 4 {
            in_lanes(Plain, &mechanism, &system, at)
        } else {
            in_lanes(Twice(Plain), &mechanism, &system, at)
        };
        let apart: Vec<f64> = found.iter().zip(&expected).map(|(a, b)| apart(a, b)).collect();
        println!("s = {s}, {d} degrees of freedom: r, du, p, q, Δ apart by {apart:?}");
        prop_assert!(apart[1] < 1e-11 && apart[5] < 1e-11, "corrections: {apart:?}");
        for k in [0, 2, 3, 4] {
            prop_assert!(apart[k] < 1e-13, "{apart:?}");
        }
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = vi_core::lanes::Wide::detect() {
            let same = if s <= 4 {
                in_lanes(wide, &mechanism, &system, at)
            } else {
                in_lanes(Twice(wide), &mechanism, &system, at)
            };
            let bits = |x: &Results| x.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&same), bits(&found), "other bits in wide registers");
        }
    }
}

#[test]
fn rotations_beyond_half_a_revolution_are_refused() {
    let mechanism = (0..100).map(|seed| random_tree(3, seed));
    for mechanism in mechanism.filter(|mechanism| mechanism.tree().dof() > 0) {
        let (system, stages) = (system(&mechanism, false), Stages::new(3).unwrap());
        let (n, d) = (mechanism.dim(), mechanism.tree().dof());
        let state = State::new(0.0, mechanism.initial_configuration(), vec![0.0; n]);
        let blocks = mechanism.tree().blocks();
        let rotations = blocks.iter().filter(|b| b.kind == BlockKind::Rotation);
        for unknown in rotations.flat_map(|block| block.range.clone()) {
            let mut u = vec![0.0; 3 * d];
            u[2 * d + unknown] = 3.2;
            let mut refusals = Vec::new();
            let mut points = ControlPoints::new(n, stages);
            let mut r = vec![0.0; 3 * d];
            let operators = DenseRows::new(&mechanism, 3);
            let mut plain = Pointwise::new(n, 3, operators);
            plain.open(&system, &mut points, SubStep::single(0.0, 0.1), &state);
            refusals.push(plain.residual(&system, &mut points, &u, &mut r, true).unwrap_err());
            let mut lanes = TreeSweeps::new(Plain, &mechanism, &system, stages).unwrap();
            lanes.open(&system, &mut points, SubStep::single(0.0, 0.1), &state);
            refusals.push(lanes.residual(&system, &mut points, &u, &mut r, true).unwrap_err());
            assert_eq!(refusals[0], refusals[1]);
        }
    }
}
