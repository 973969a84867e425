//! Loops within loops, loops side by side and loops on one link: every scheme and every solver
//! gives the same motion, in as few iterations as on a tree.
//!
//! A chain of four links with rectangles of bars on three of them; a strut ties its end to the
//! second link, another one to the ground.
#![allow(clippy::unwrap_used)] // a test

use holonom::vi_constraints::{InitialValues, Options, SchemeKind};
use holonom::vi_core::Quadrature;
use holonom::vi_multibody::builder::{BodyId, BuiltMechanism, Inertia, MechanismBuilder};
use holonom::vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use holonom::vi_multibody::{FrameId, PairKind};
use holonom::vi_rigid::Shape;

const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// `base`: the first joint. `struts`: which of the two there are. `coupled`: whether a spring
/// couples two bodies; it pulls with nothing worth mentioning.
fn mechanism(base: PairKind, struts: &[&str], coupled: bool) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.5, -2.0, -9.81]);
    let (mut links, mut tops) = (Vec::<BodyId>::new(), Vec::new());
    for i in 0..4 {
        let x = i as f64;
        let link = bar(&mut builder, 1.0, [x + 0.5, 0.0], [1.0, 0.1, 0.1]);
        let (kind, parent) = match links.last() {
            Some(last) => (PairKind::Revolute, FrameId::from(*last)),
            None => (base, FrameId::Ground),
        };
        if kind != PairKind::Free {
            let axis = if i % 2 == 0 { Y } else { Z };
            builder.joint(&format!("joint{i}"), kind, parent, link).at([x, 0.0, 0.0]).axis(axis);
        }
        if i != 2 {
            tops.push(rectangle(&mut builder, link, x));
        }
        links.push(link);
    }
    if struts.contains(&"inner") {
        let end = links[3].point([0.1, 0.2, 0.4]);
        builder.distance("inner", end, links[1].point([0.0, -0.3, 0.2]));
    }
    if struts.contains(&"outer") {
        builder.distance("outer", tops[2].point([0.0, 0.0, 0.3]), [2.0, 1.0, 1.0]);
    }
    if coupled {
        let [from, to] = [links[0], tops[1]].map(|body| body.point([0.0; 3]));
        builder.spring(from, to, 1e-20).natural_length(1.0);
    }
    builder.build().unwrap()
}

fn bar(builder: &mut MechanismBuilder, mass: f64, [x, y]: [f64; 2], lengths: [f64; 3]) -> BodyId {
    builder.body("bar", Inertia::shape_of_mass(Shape::Box { lengths }, mass)).at([x, y, 0.0]).id()
}

/// A rectangle of bars on the link from `x` to `x + 1`; its top.
fn rectangle(builder: &mut MechanismBuilder, link: BodyId, x: f64) -> BodyId {
    let left = bar(builder, 0.2, [x + 0.3, 0.15], [0.05, 0.3, 0.04]);
    let right = bar(builder, 0.3, [x + 0.7, 0.15], [0.05, 0.3, 0.04]);
    let top = bar(builder, 0.25, [x + 0.5, 0.3], [0.4, 0.05, 0.04]);
    for (parent, child, dx, y) in [
        (link, left, 0.3, 0.0),
        (link, right, 0.7, 0.0),
        (left, top, 0.3, 0.3),
        (right, top, 0.7, 0.3),
    ] {
        builder.joint("hinge", PairKind::Revolute, parent, child).at([x + dx, y, 0.0]).axis(Z);
    }
    top
}

fn start(built: BuiltMechanism, scheme: SchemeKind, solver: Solver) -> MechanismIntegrator {
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let (system, at) = (built.system(Quadrature::Midpoint), InitialValues::new(0.0, &q, &v));
    integrator(built.mechanism, system, Options::new(scheme, 0.01), solver, at).unwrap()
}

#[test]
fn every_scheme_and_solver_gives_the_same_motion() {
    for base in [PairKind::Revolute, PairKind::Spherical, PairKind::Free] {
        for struts in [&[][..], &["inner"], &["outer"], &["inner", "outer"]] {
            let mut reference: Option<(Vec<f64>, usize)> = None;
            for (coupled, scheme, solver) in [
                (false, SchemeKind::Nodal, Solver::Auto),
                (false, SchemeKind::Reduced, Solver::Auto),
                (true, SchemeKind::Nodal, Solver::Dense),
                (true, SchemeKind::Nodal, Solver::Sparse),
                (false, SchemeKind::Constrained, Solver::Auto),
            ] {
                let mut run = start(mechanism(base, struts, coupled), scheme, solver);
                let iterations: usize = (0..40).map(|_| run.step().unwrap().iterations).sum();
                let closed = run.observe_state().unwrap().position_residual;
                let q = &run.state().q;
                let (expected, most) =
                    reference.get_or_insert_with(|| (q.clone(), iterations + 20));
                let apart =
                    q.iter().zip(&*expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                println!(
                    "{} {struts:?}, {} {solver:?}: {apart:.1e} apart, |g| {closed:.1e}, {iterations} iterations",
                    base.name(),
                    scheme.name()
                );
                assert!(apart < 1e-12 && closed < 1e-14, "{apart:e} {closed:e}");
                // matrices that couple bodies verify each solution by one more iteration
                let most = *most + if solver == Solver::Auto { 0 } else { 40 };
                let few = scheme == SchemeKind::Constrained || iterations <= most;
                assert!(few, "{iterations} > {most}");
            }
        }
    }
}
