//! Coupled systems: a correction whose square is below rounding is the last one, and what it leaves
//! is handed on.

use crate::dense::{relative_distance, run};
use vi_constraints::{Options, SchemeKind};
use vi_multibody::builder::Inertia;
use vi_multibody::run::Solver;
use vi_multibody::{FrameId, MechanismBuilder, PairKind};

/// Steps of 1 ms.
const STEPS: usize = 200;

/// A chain of links in a plane, with springs from each to the one after next.
fn chain(links: usize) -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let mut bodies = Vec::new();
    for k in 0..links {
        let (x, rate) = (k as f64, if k % 2 == 0 { 0.1 } else { -0.1 });
        let body = builder.body(&format!("link {k}"), Inertia::principal(1.0, [0.1; 3]));
        let body = body.at([x + 0.5, 0.0, 0.0]).id();
        let parent = bodies.last().map_or(FrameId::Ground, |last| FrameId::from(*last));
        let hinge = builder.joint(&format!("hinge {k}"), PairKind::Revolute, parent, body);
        hinge.at([x, 0.0, 0.0]).axis([0.0, 1.0, 0.0]).rate(rate);
        bodies.push(body);
    }
    for pair in bodies.windows(3) {
        let ends = [pair[0].point([0.0, 0.0, 0.3]), pair[2].point([0.1, 0.0, 0.2])];
        builder.spring(ends[0], ends[1], 40.0).natural_length(2.1);
    }
    builder
}

/// Four bars with a spring between crank and rocker.
fn four_bars() -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let inertia = Inertia::principal(1.0, [0.1; 3]);
    let crank = builder.body("crank", inertia).at([0.0, 0.0, 0.5]).id();
    let coupler = builder.body("coupler", inertia).at([0.5, 0.0, 1.0]).id();
    let rocker = builder.body("rocker", inertia).at([1.0, 0.0, 0.5]).id();
    let hinges: [(&str, FrameId, FrameId, [f64; 3]); 4] = [
        ("foot", FrameId::Ground, crank.into(), [0.0; 3]),
        ("elbow", crank.into(), coupler.into(), [0.0, 0.0, 1.0]),
        ("wrist", coupler.into(), rocker.into(), [1.0, 0.0, 1.0]),
        ("other foot", FrameId::Ground, rocker.into(), [1.0, 0.0, 0.0]),
    ];
    for (name, parent, child, at) in hinges {
        builder.joint(name, PairKind::Revolute, parent, child).at(at).axis([0.0, 1.0, 0.0]);
    }
    builder.spring(crank.point([0.0, 0.0, 0.3]), rocker.point([0.1, 0.0, -0.2]), 40.0);
    builder
}

/// Free bodies on springs from one to the next.
fn free_bodies(count: usize) -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let mut bodies = Vec::new();
    for k in 0..count {
        let body = builder.body(&format!("body {k}"), Inertia::principal(1.0, [0.1, 0.12, 0.15]));
        bodies.push(body.at([k as f64, 0.0, 0.0]).angular_velocity([0.4, -0.3, 0.5]).id());
    }
    for pair in bodies.windows(2) {
        builder.spring(pair[0].point([0.1, 0.2, 0.3]), pair[1].point([-0.1, 0.0, 0.2]), 40.0);
    }
    builder
}

/// Point masses on bars in a row, which a bar to the ground closes.
fn bars(closed: bool) -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let mut last = None;
    for k in 1..5 {
        let (x, z) = (f64::from(k), if closed { 0.2 * f64::from(k * (k - 5)) } else { 0.0 });
        let point = builder.particle(&format!("point {k}"), 1.0, [x, 0.0, z], [0.0; 3]);
        match last {
            None => builder.bar(&format!("bar {k}"), [0.0; 3], point),
            Some(last) => builder.bar(&format!("bar {k}"), last, point),
        }
        last = Some(point);
    }
    if let Some(last) = last.filter(|_| closed) {
        builder.bar("last", [5.0, 0.0, 0.0], last);
    }
    builder
}

/// The scheme `constrained` makes corrections until they are round-off.
#[test]
fn one_correction_a_step_is_enough() {
    let cases = [
        ("springs across a chain, dense", chain(8), Solver::Dense),
        ("the same, sparse", chain(8), Solver::Auto),
        ("the same of 80 links, in descriptor form", chain(80), Solver::Auto),
        ("a spring across a loop, dense", four_bars(), Solver::Dense),
        ("the same, sparse", four_bars(), Solver::Auto),
        ("free bodies, dense", free_bodies(4), Solver::Dense),
        ("free bodies, sparse", free_bodies(12), Solver::Auto),
        ("bars in a row, dense", bars(false), Solver::Auto),
        ("bars in a row, in descriptor form", bars(false), Solver::Sparse),
        ("bars in a loop", bars(true), Solver::Auto),
    ];
    for (name, builder, solver) in cases {
        let built = builder.build().unwrap();
        let run = |scheme, solver| {
            let (state, count) = run(&built, Options::new(scheme, 1e-3), solver, STEPS);
            (count as f64 / STEPS as f64, state.q)
        };
        let (count, found) = run(SchemeKind::Nodal, solver);
        let (least, exact) = run(SchemeKind::Constrained, Solver::Auto);
        let off = relative_distance(&found, &exact);
        println!(
            "{name}: {count:.2} iterations a step, `constrained` {least:.2}, off by {off:.1e}"
        );
        assert!(count < 1.3 && off < 1e-12, "{name}: {count} iterations, off by {off:e}");
    }
}
