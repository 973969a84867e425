//! Laws along joint coordinates that read other joints, other bodies and themselves: the sweeps
//! with a product of few columns and rows against dense matrices.

use crate::dense::{off_dense, relative_distance, run};
use crate::moving_tree::{MovingTree, moving_tree};
use nalgebra::DMatrix;
use std::sync::Arc;
use vi_constraints::{Options, SchemeKind};
use vi_core::Quadrature;
use vi_multibody::BuiltMechanism;
use vi_multibody::builder::{ActOn, Read};
use vi_multibody::law::Law;
use vi_multibody::nalgebra;
use vi_multibody::run::Solver;
use vi_multibody::tree_step::TreeStep;
use vi_testkit::Sample;

/// `τ = Σ_k (a_k y_k + b_k sin y_k)`.
struct Wavy {
    linear: Vec<f64>,
    wavy: Vec<f64>,
}

impl Law for Wavy {
    fn efforts(&self) -> usize {
        1
    }
    fn evaluate(&self, y: &[f64], _z: &[f64], values: &mut [f64]) {
        let parts = y.iter().zip(&self.linear).zip(&self.wavy);
        values[0] = parts.map(|((y, a), b)| a * y + b * libm::sin(*y)).sum();
    }
    fn gradient(&self, y: &[f64], z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>) {
        self.evaluate(y, z, values);
        for (k, y) in y.iter().enumerate() {
            slopes[(0, k)] = self.linear[k] + self.wavy[k] * libm::cos(*y);
        }
    }
    fn is_dissipative(&self) -> bool {
        true
    }
    fn is_affine(&self) -> bool {
        self.wavy.iter().all(|b| *b == 0.0)
    }
}

/// What the laws of a tree read, beside their own coordinate.
#[derive(Clone, Copy, PartialEq)]
enum Reads {
    Joints,
    All,
}

/// A random tree of all pairs with a law on each joint coordinate, of `gain`, that is its own
/// spring and damper and reads coordinates of other joints, or other bodies too.
fn controlled_tree(
    bodies: usize,
    seed: u64,
    reads: Reads,
    [gain, wavy]: [f64; 2],
) -> BuiltMechanism {
    let mut random = Sample::new(seed);
    let MovingTree { mut builder, bodies: links, coordinates, .. } =
        moving_tree(bodies, &mut random);
    for (k, own) in coordinates.iter().enumerate() {
        let other = coordinates[(k + 1) % coordinates.len()];
        let (first, last) = (links[0], links[bodies - 1]);
        let mut all = vec![
            Read::Time,
            Read::Coordinate(*own),
            Read::Rate(*own),
            Read::Coordinate(other),
            Read::Rate(other),
        ];
        if reads == Reads::All {
            all.extend([
                Read::Position(last.point([0.2, 0.1, -0.3]), k % 3),
                Read::Velocity(first.point([0.0, 0.3, 0.1]), (k + 1) % 3),
                Read::AngularVelocity(last, k % 3),
                Read::Distance([first.point([0.1, 0.0, 0.0]), [5.0, 4.0, 3.0].into()]),
            ]);
        }
        let factor = |k: usize| if k == 1 || k == 2 { -1.0 } else { random.number() };
        let linear: Vec<f64> = (0..all.len()).map(factor).map(|a| gain * a).collect();
        let wavy = vec![wavy; all.len()];
        builder.law(ActOn::Coordinate(*own), all, Vec::new(), Arc::new(Wavy { linear, wavy }));
    }
    builder.build().unwrap()
}

#[test]
fn the_sweeps_take_the_steps_of_dense_matrices() {
    let (mut worst, mut applied, mut more) = (0.0_f64, 0, 0);
    for seed in 0..40 {
        let reads = if seed % 2 == 0 { Reads::Joints } else { Reads::All };
        let wavy = if seed % 4 < 2 { 0.0 } else { 2.0 };
        let built = controlled_tree(2 + seed as usize % 7, 31 + seed, reads, [4.0, wavy]);
        let system = built.system(Quadrature::Midpoint);
        applied += usize::from(TreeStep::new(&built.mechanism, &system).is_some());
        let (off, [count, least]) = off_dense(&built, Options::new(SchemeKind::Nodal, 0.01));
        println!("tree {seed}: off by {off:.1e}, {count} iterations, dense {least}");
        assert!(off < 1e-11 && count <= least + 5, "tree {seed}: off by {off:e}");
        worst = if off <= worst { worst } else { off };
        more += count.saturating_sub(least);
    }
    println!("states off by {worst:.1e}, {applied} of 40 by sweeps, {more} iterations more");
    assert!(applied >= 36, "{applied}");
}

/// Where the laws rule the matrix, by up to 1e9 times the inertia of a step.
#[test]
fn stiff_laws_are_solved_as_precisely() {
    for gain in [1e3, 1e6, 1e9] {
        let built = controlled_tree(5, 77, Reads::Joints, [gain, 0.0]);
        let options = || Options::new(SchemeKind::Nodal, 0.001);
        let [(found, count), (dense, least)] =
            [Solver::Auto, Solver::Dense].map(|solver| run(&built, options(), solver, 5));
        let off = relative_distance(&found.q, &dense.q);
        println!("gain {gain:e}: off by {off:.1e}, {count} iterations, dense {least}");
        assert!(off < 1e-9 && count <= least + 5, "gain {gain:e}: off by {off:e}, {count}");
    }
}
