//! A step with contacts of shapes allocates nothing after the first one with the same contacts:
//! what rests, slides, rolls and turns, in pairs and in groups.

#![allow(clippy::unwrap_used)] // a test

use holonom::nalgebra::{Matrix3, Vector3};
use holonom::vi_constraints::nonsmooth::{ContactLaw, Method, NonsmoothOptions};
use holonom::vi_constraints::{InitialValues, Options, SchemeKind};
use holonom::vi_core::Quadrature;
use holonom::vi_multibody::FrameId::Ground;
use holonom::vi_multibody::builder::{Inertia, MechanismBuilder};
use holonom::vi_multibody::run::{MechanismIntegrator, Solver, integrator, with_contacts};
use holonom::vi_rigid::gap::ContactShape;
use vi_testkit::allocator::allocations;

fn brick(half: [f64; 3]) -> ContactShape {
    let (center, axes) = (Vector3::zeros(), Matrix3::identity());
    ContactShape::Box { center, axes, half_lengths: half.into() }
}

fn ends(axis: Vector3<f64>, half: f64) -> [Vector3<f64>; 2] {
    [-half * axis, half * axis]
}

/// The corners of squares on the surface of a box.
fn squares(half: [f64; 3], count: usize) -> ContactShape {
    let place = |k: usize| 2.0 * k as f64 / (count - 1) as f64 - 1.0;
    let all = (0..count.pow(3)).map(|k| [k % count, k / count % count, k / count / count]);
    let on_face = all.filter(|own| own.iter().any(|k| *k == 0 || *k == count - 1));
    let points = on_face.map(|own| Vector3::from_fn(|i, _| place(own[i]) * half[i])).collect();
    ContactShape::Points { points, radius: 0.0 }
}

fn run_by(builder: &MechanismBuilder, method: Method) -> MechanismIntegrator {
    let built = builder.build().unwrap();
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let (system, at) = (built.system(Quadrature::Midpoint), InitialValues::new(0.0, &q, &v));
    let options = Options::new(SchemeKind::Nodal, 0.002);
    let run = integrator(built.mechanism, system, options, Solver::Auto, at).unwrap();
    let contacts = NonsmoothOptions { method, ..NonsmoothOptions::default() };
    with_contacts(run, SchemeKind::Nodal, built.forces.contacts, contacts).unwrap()
}

#[test]
fn no_step_of_shapes_that_touch_allocates() {
    let table = brick([2.0, 2.0, 0.1]);
    let can = |half, radius| ContactShape::Cylinder { ends: ends(Vector3::z(), half), radius };
    let log = |half, radius| ContactShape::Cylinder { ends: ends(Vector3::y(), half), radius };
    let pill = |half, radius| ContactShape::Capsule { ends: ends(Vector3::y(), half), radius };
    let still = ([0.0; 3], [0.0; 3]);
    let slides = ([1.5, 0.2, 0.0], [0.0; 3]);
    let rolls = ([0.4, 0.0, 0.0], [0.0, 4.0, 0.0]);
    let turns = ([0.0; 3], [0.0, 0.0, 3.0]);
    let cube = [0.1, 0.1, 0.1];
    let cases = [
        ("can rests on a box", &table, can(0.1, 0.1), 0.2, still),
        ("can slides on a box", &table, can(0.1, 0.1), 0.2, slides),
        ("log rolls on a box", &table, log(0.2, 0.1), 0.2, rolls),
        ("log slides on a box", &table, log(0.2, 0.1), 0.2, slides),
        ("can turns on a can", &can(0.1, 0.3), can(0.1, 0.1), 0.2, turns),
        ("log rolls on a can", &can(0.1, 0.8), log(0.2, 0.1), 0.2, rolls),
        ("log rests on a log", &log(0.3, 0.1), log(0.2, 0.1), 0.2, still),
        ("pill rests on a log", &log(0.3, 0.1), pill(0.2, 0.1), 0.2, still),
        ("pill slides on a box", &table, pill(0.2, 0.1), 0.2, slides),
        ("pill rolls on a box", &table, pill(0.2, 0.1), 0.2, rolls),
        ("pill turns on a box", &table, pill(0.2, 0.1), 0.2, turns),
        ("pill slides on a can", &can(0.1, 0.8), pill(0.2, 0.1), 0.2, slides),
        ("box slides on a box", &table, brick(cube), 0.2, slides),
        ("mesh rests on a box", &table, squares(cube, 2), 0.2, still),
        ("mesh slides on a box", &table, squares(cube, 12), 0.2, slides),
        ("mesh turns on a can", &can(0.1, 0.5), squares(cube, 8), 0.2, turns),
        ("mesh slides on a can", &can(0.1, 0.8), squares(cube, 2), 0.2, slides),
    ];
    let mut bad = Vec::new();
    for (name, fixed, shape, height, (velocity, spin)) in cases {
        for (method, grouped) in
            [(Method::Stepping, false), (Method::Events, false), (Method::Stepping, true)]
        {
            let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
            let inertia = Inertia::principal(1.0, [0.01, 0.011, 0.012]);
            let body = builder.body("body", inertia).at([0.0, 0.0, height]);
            let body = body.velocity(velocity).angular_velocity(spin).id();
            let law = ContactLaw::coulomb(0.3, 0.0);
            let both = [(Ground, fixed.clone()), (body.into(), shape.clone())];
            if grouped {
                builder.shape_group("group", both.into(), &[], law).unwrap();
            } else {
                let [a, b] = both;
                builder.shape_contact("pair", a, b, law).unwrap();
            }
            let mut run = run_by(&builder, method);
            let mut steps = |count: usize| {
                (0..count)
                    .for_each(|_| _ = run.step().unwrap_or_else(|error| panic!("{name}: {error}")));
                run.state().contacts.contacts.iter().filter(|own| own.impulse[0] > 0.0).count()
            };
            let closed = steps(60);
            let before = allocations();
            let after = steps(60);
            let allocations = allocations() - before;
            println!(
                "{name}, {method:?}, group {grouped}: {closed}, {after} points, {allocations}"
            );
            assert!(closed > 0 && after > 0, "{name}: {closed}, {after}");
            if allocations > 0 {
                bad.push(format!("{name}, {method:?}, group {grouped}: {allocations}"));
            }
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}
