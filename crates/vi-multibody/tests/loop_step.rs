//! The sweeps of closed loops against dense matrices: small, band, sparse and full complements;
//! loops on bodies and free bodies; loops through all joints.

use crate::dense::off_dense;
use vi_constraints::{Options, SchemeKind};
use vi_core::Quadrature;
use vi_core::galerkin::Stages;
use vi_multibody::builder::{BodyId, Inertia};
use vi_multibody::closed_loop::step::LoopStep;
use vi_multibody::loop_rank::LoopRank;
use vi_multibody::{BuiltMechanism, FrameId, MechanismBuilder, PairKind};

const BAR: [f64; 3] = [0.1, 0.02, 0.1];

/// A hinge about z.
fn hinge(builder: &mut MechanismBuilder, parent: FrameId, child: BodyId, [x, y]: [f64; 2]) {
    let hinge = builder.joint("hinge", PairKind::Revolute, parent, child);
    hinge.at([x, y, 0.0]).axis([0.0, 0.0, 1.0]);
}

/// Four-bar windows side by side: all loops are one cluster on the ground. A bar over all of them
/// lets the first loop meet the last.
fn windows(count: usize, has_bar_over_all: bool) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
    let mut bar = |x: f64, y: f64, [v, w]: [f64; 2]| {
        let bar = builder.body("bar", Inertia::principal(1.0, BAR)).at([x, y, 0.0]);
        bar.velocity([v, 0.0, 0.0]).angular_velocity([0.0, 0.0, w]).id()
    };
    let cranks: Vec<BodyId> = (0..=count).map(|i| bar(i as f64, 0.5, [0.5, -1.0])).collect();
    let couplers: Vec<BodyId> = (0..count).map(|i| bar(i as f64 + 0.5, 1.0, [1.0, 0.0])).collect();
    let over_all = has_bar_over_all.then(|| bar(0.5 * count as f64, 1.0, [1.0, 0.0]));
    let mut hinge = |parent, child, x, y| hinge(&mut builder, parent, child, [x, y]);
    for (i, crank) in cranks.iter().enumerate() {
        hinge(FrameId::Ground, *crank, i as f64, 0.0);
    }
    for (i, coupler) in couplers.iter().enumerate() {
        hinge(cranks[i].into(), *coupler, i as f64, 1.0);
        hinge((*coupler).into(), cranks[i + 1], (i + 1) as f64, 1.0);
    }
    if let Some(over_all) = over_all {
        hinge(cranks[0].into(), over_all, 0.0, 1.0);
        hinge(over_all.into(), cranks[count], count as f64, 1.0);
    }
    builder.build().unwrap()
}

/// Pairs of crossing bars, joined at their middle and at their ends, on one foot: each loop moves
/// all that follow.
fn scissors(count: usize) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
    let mut bar = |x: f64| builder.body("bar", Inertia::principal(1.0, BAR)).at([x, 0.0, 0.0]).id();
    let pairs: Vec<[BodyId; 2]> = (0..count).map(|i| [0, 1].map(|_| bar(i as f64 + 0.5))).collect();
    let mut hinge = |parent, child, x, y| hinge(&mut builder, parent, child, [x, y]);
    hinge(FrameId::Ground, pairs[0][0], 0.0, -0.5);
    for (i, [up, down]) in pairs.iter().enumerate() {
        hinge((*up).into(), *down, i as f64 + 0.5, 0.0);
        if let Some([next_up, next_down]) = pairs.get(i + 1) {
            hinge((*up).into(), *next_down, i as f64 + 1.0, 0.5);
            hinge((*down).into(), *next_up, i as f64 + 1.0, -0.5);
        }
    }
    builder.build().unwrap()
}

/// An arm that turns about the vertical; on it a slider-crank, on whose rod a parallelogram hangs,
/// and one on the ground: clusters on two links and on the ground.
fn clusters_on_bodies() -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let y = [0.0, 1.0, 0.0];
    let mut body =
        |name: &str, at: [f64; 3]| builder.body(name, Inertia::principal(1.0, BAR)).at(at).id();
    let [arm, crank, rod, slider] = [
        ("arm", [0.5, 0.0, 0.0]),
        ("crank", [1.1, 0.0, 0.15]),
        ("rod", [1.6, 0.0, 0.15]),
        ("slider", [2.0, 0.0, 0.0]),
    ]
    .map(|(name, at)| body(name, at));
    let mut hanging = |x: f64, z: f64| {
        [(-0.1, -0.2), (0.1, -0.2), (0.0, -0.4)].map(|(dx, dz)| body("bar", [x + dx, 0.0, z + dz]))
    };
    let (on_rod, on_ground) = (hanging(1.6, 0.15), hanging(0.0, -1.0));
    let turn = PairKind::Revolute;
    let mut joint = |kind, parent: FrameId, child, at: [f64; 3], axis| {
        builder.joint("joint", kind, parent, child).at(at).axis(axis);
    };
    joint(turn, FrameId::Ground, arm, [0.0; 3], [0.0, 0.0, 1.0]);
    joint(turn, arm.into(), crank, [1.0, 0.0, 0.0], y);
    joint(turn, crank.into(), rod, [1.2, 0.0, 0.3], y);
    joint(turn, rod.into(), slider, [2.0, 0.0, 0.0], y);
    joint(PairKind::Prismatic, arm.into(), slider, [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let parallelograms =
        [(FrameId::from(rod), on_rod, 1.6, 0.15), (FrameId::Ground, on_ground, 0.0, -1.0)];
    for (carrier, [left, right, below], x, z) in parallelograms {
        joint(turn, carrier, left, [x - 0.1, 0.0, z], y);
        joint(turn, carrier, right, [x + 0.1, 0.0, z], y);
        joint(turn, left.into(), below, [x - 0.1, 0.0, z - 0.4], y);
        joint(turn, right.into(), below, [x + 0.1, 0.0, z - 0.4], y);
    }
    builder.build().unwrap()
}

/// A free body that carries a parallelogram, and one that hangs on it by a ball joint with a
/// slider-crank: loops on links of six and three degrees of freedom.
fn floating_clusters() -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let mut body = |name: &str, at: [f64; 3]| {
        let body = builder.body(name, Inertia::principal(1.0, BAR)).at(at);
        body.velocity([0.3, 0.2, 0.1]).id()
    };
    let [base, hanging] =
        [("base", [0.0; 3]), ("hanging", [0.0, 0.0, -1.0])].map(|(name, at)| body(name, at));
    let [left, right, below] =
        [[-0.1, 0.0, 0.2], [0.1, 0.0, 0.2], [0.0, 0.0, 0.4]].map(|at| body("bar", at));
    let [crank, rod, slider] =
        [[0.1, 0.0, -0.85], [0.6, 0.0, -0.85], [1.0, 0.0, -1.0]].map(|at| body("part", at));
    let (turn, y) = (PairKind::Revolute, [0.0, 1.0, 0.0]);
    let mut joint = |kind, parent: BodyId, child, at: [f64; 3], axis| {
        builder.joint("joint", kind, FrameId::from(parent), child).at(at).axis(axis);
    };
    joint(PairKind::Spherical, base, hanging, [0.0, 0.0, -0.5], y);
    joint(turn, base, left, [-0.1, 0.0, 0.0], y);
    joint(turn, base, right, [0.1, 0.0, 0.0], y);
    joint(turn, left, below, [-0.1, 0.0, 0.4], y);
    joint(turn, right, below, [0.1, 0.0, 0.4], y);
    joint(turn, hanging, crank, [0.0, 0.0, -1.0], y);
    joint(turn, crank, rod, [0.2, 0.0, -0.7], y);
    joint(turn, rod, slider, [1.0, 0.0, -1.0], y);
    joint(PairKind::Prismatic, hanging, slider, [1.0, 0.0, -1.0], [1.0, 0.0, 0.0]);
    builder.build().unwrap()
}

/// Three bodies in a loop of four joints of these kinds, on the ground or on a free body.
fn loop_of(kinds: [PairKind; 4], is_free: bool) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.3, 0.2, -9.81]);
    let points = [[0.0, 0.0, 0.0], [0.1, 0.4, 0.7], [1.1, 0.1, 0.9], [1.0, -0.2, 0.1]];
    let axes = [[0.0, 0.8, 0.6], [0.6, 0.0, 0.8], [0.8, -0.6, 0.0], [0.36, 0.48, 0.8]];
    let mut body = |name: &str, at: [f64; 3]| {
        builder.body(name, Inertia::principal(1.0, [0.2, 0.1, 0.3])).at(at).id()
    };
    let carrier = if is_free { body("carrier", [0.5, 0.5, -0.2]).into() } else { FrameId::Ground };
    let [a, b, c] = [[0.0, 0.2, 0.4], [0.6, 0.3, 0.9], [1.1, 0.0, 0.5]].map(|at| body("link", at));
    let ends = [(carrier, a), (a.into(), b), (b.into(), c), (carrier, c)];
    for (k, (parent, child)) in ends.into_iter().enumerate() {
        builder.joint("joint", kinds[k], parent, child).at(points[k]).axis(axes[k]);
    }
    builder.build().unwrap()
}

/// By how much the states of some steps differ from those by dense matrices.
fn apart(built: &BuiltMechanism) -> f64 {
    off_dense(built, Options::new(SchemeKind::Nodal, 0.005)).0
}

/// By how much Galerkin steps by the sweeps differ from those in constrained form, by one matrix of
/// all control points; the most iterations of a step by the sweeps.
fn galerkin_apart(built: &BuiltMechanism, stages: usize) -> (f64, usize) {
    let [(nodal, iterations), (constrained, _)] =
        [SchemeKind::Nodal, SchemeKind::Constrained].map(|kind| {
            let options = Options::new(kind, 0.005).galerkin(Stages::new(stages).unwrap());
            let mut run = built.clone().integrator(options).unwrap();
            let most = (0..5).map(|_| run.step().unwrap().iterations).max();
            (run.state().q.clone(), most.unwrap())
        });
    (nodal.iter().zip(&constrained).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max), iterations)
}

/// Rank and apex of the clusters that the sweeps solve.
fn clusters(built: &BuiltMechanism) -> Vec<(usize, Option<usize>)> {
    let system = built.system(Quadrature::Midpoint);
    let q = built.mechanism.initial_configuration();
    let rank = LoopRank::find(&built.mechanism, 0.0, &q);
    let step = LoopStep::new(&built.mechanism, &system, &rank).expect("the sweeps apply");
    step.clusters().collect()
}

#[test]
fn steps_are_those_of_dense_matrices_by_small_band_and_sparse_complements() {
    for (count, has_bar_over_all, rank) in
        [(1, false, 2), (3, false, 6), (20, false, 40), (70, false, 140), (70, true, 141)]
    {
        let built = windows(count, has_bar_over_all);
        assert_eq!(clusters(&built), [(rank, None)]);
        let off = apart(&built);
        println!("{count} windows: states off by {off:.1e}");
        assert!(off < 1e-11, "{count} windows: off by {off:e}");
    }
}

#[test]
fn steps_are_those_of_dense_matrices_by_full_complements() {
    for (count, rank) in [(5, 8), (70, 138)] {
        let built = scissors(count);
        assert_eq!(clusters(&built), [(rank, Some(0))]);
        let off = apart(&built);
        println!("{count} pairs of bars: states off by {off:.1e}");
        assert!(off < 1e-11, "{count} pairs of bars: off by {off:e}");
    }
}

#[test]
fn steps_are_those_of_dense_matrices_with_loops_on_bodies() {
    let built = clusters_on_bodies();
    let found = clusters(&built);
    assert_eq!(found.iter().filter(|cluster| cluster.1.is_some()).count(), 2, "{found:?}");
    let off = apart(&built);
    println!("states off by {off:.1e}, clusters {found:?}");
    assert!(off < 1e-11, "off by {off:e}");
}

#[test]
fn steps_are_those_of_dense_matrices_with_loops_on_free_bodies() {
    let built = floating_clusters();
    let found = clusters(&built);
    assert!(found.len() == 2 && found.iter().all(|cluster| cluster.1.is_some()), "{found:?}");
    let off = apart(&built);
    println!("states off by {off:.1e}, clusters {found:?}");
    assert!(off < 1e-11, "off by {off:e}");
}

#[test]
fn galerkin_steps_are_those_in_constrained_form() {
    use PairKind::{Cylindrical, Planar, Prismatic, Revolute, Screw, Spherical, Universal};
    let screw = Screw(vi_multibody::pair::screw::Pitch::new(0.05));
    let loops = [
        windows(3, false),
        scissors(3),
        clusters_on_bodies(),
        floating_clusters(),
        loop_of([Revolute, Spherical, Spherical, Revolute], true),
        loop_of([Planar, Universal, Cylindrical, Revolute], true),
        loop_of([screw, Universal, Spherical, Prismatic], false),
    ];
    for (i, built) in loops.iter().enumerate() {
        for stages in [2, 6] {
            let (off, iterations) = galerkin_apart(built, stages);
            let what = format!("mechanism {i}, {stages} control points");
            println!("{what}: configurations off by {off:.1e}, {iterations} iterations");
            assert!(off < 1e-11, "{what}: off by {off:e}");
            assert!(iterations <= 12, "{what}: {iterations} iterations"); // factors are right
        }
    }
}

#[test]
fn steps_are_those_of_dense_matrices_through_all_joints() {
    use PairKind::{Cylindrical, Planar, Prismatic, Revolute, Screw, Spherical, Universal};
    let screw = Screw(vi_multibody::pair::screw::Pitch::new(0.05));
    for kinds in [
        [Revolute, Universal, Spherical, Revolute],
        [Revolute, Spherical, Spherical, Revolute],
        [Spherical, Spherical, Universal, Universal],
        [Cylindrical, Universal, Spherical, Revolute],
        [Planar, Universal, Cylindrical, Revolute],
        [screw, Universal, Spherical, Prismatic],
        [Universal, screw, Spherical, Revolute],
    ] {
        for is_free in [false, true] {
            let built = loop_of(kinds, is_free);
            let found = clusters(&built);
            let off = apart(&built);
            println!("{kinds:?}: states off by {off:.1e}, clusters {found:?}");
            assert!(off < 1e-11, "{kinds:?}: off by {off:e}");
        }
    }
}
