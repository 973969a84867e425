//! Springs and dampers between bodies and their parents: the sweeps against dense matrices.

use crate::dense::off_dense;
use crate::moving_tree::{MovingTree, moving_tree};
use vi_constraints::{Options, SchemeKind};
use vi_core::interval::Interval;
use vi_core::{DiscreteLagrangian, Entries, Quadrature};
use vi_multibody::BuiltMechanism;
use vi_multibody::tree_nodal::TreeNodal;
use vi_multibody::tree_step::TreeStep;
use vi_testkit::Sample;

/// A random tree of all pairs; a spring and a damper between each body and its parent, with `far`
/// also between the first body and the last.
fn tied_tree(bodies: usize, seed: u64, far: bool) -> BuiltMechanism {
    let MovingTree { mut builder, bodies: links, parents, .. } =
        moving_tree(bodies, &mut Sample::new(seed));
    for (body, parent) in links.iter().zip(parents) {
        let Some(parent) = parent.map(|parent| links[parent]) else { continue };
        let ends = [parent, *body].map(|body| body.point([0.3, -0.2, 0.1]));
        builder.spring(ends[0], ends[1], 50.0);
        let ends = [parent, *body].map(|body| body.point([-0.1, 0.2, 0.4]));
        builder.damper(ends[0], ends[1], 3.0);
    }
    if far {
        builder.spring(links[0].point([0.0; 3]), links[bodies - 1].point([0.1, 0.0, 0.0]), 5.0);
    }
    builder.build().unwrap()
}

/// Whether the sweeps apply: at all, and without blocks between bodies.
fn applies(built: &BuiltMechanism) -> [bool; 2] {
    let system = built.system(Quadrature::Midpoint);
    let q = built.mechanism.initial_configuration();
    let mut s = Interval::new(q.len());
    s.open(0.0, 1.0, &q);
    let mixed = |out: &mut dyn Entries| system.forced_d2_d1(&s, out);
    let near = TreeNodal::of(built.mechanism.tree(), &mixed).is_some();
    [near, TreeStep::new(&built.mechanism, &system).is_some()]
}

#[test]
fn the_sweeps_take_the_steps_of_dense_matrices() {
    let (mut worst, mut coupled) = (0.0_f64, 0);
    for seed in 0..40 {
        let built = tied_tree(2 + seed as usize % 6, 3 + seed, false);
        let [near, alone] = applies(&built);
        assert!(near);
        coupled += usize::from(!alone);
        for scheme in [SchemeKind::Nodal, SchemeKind::Reduced] {
            let (off, [count, least]) = off_dense(&built, Options::new(scheme, 0.01));
            println!(
                "tree {seed}, {scheme:?}: off by {off:.1e}, {count} iterations, dense {least}"
            );
            assert!(off < 1e-11 && count <= least + 5, "tree {seed}: off by {off:e}");
            worst = if off <= worst { worst } else { off };
        }
    }
    println!("states off by {worst:.1e}, {coupled} trees of 40 with couplings");
    assert!(coupled >= 30);
}

#[test]
fn couplings_beyond_the_parent_are_refused() {
    let built = tied_tree(6, 5, true);
    assert_eq!(applies(&built), [false, false]);
}
