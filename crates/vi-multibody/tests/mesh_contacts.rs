//! Corners of meshes on boxes and cylinders: what rests stays, as a box does; free bodies keep
//! their momenta; a mesh slides down, leaves an edge, and continues to the bit.

use crate::contact_runs::{G, box_shape, coulomb, floor, moved, run_by};
use nalgebra::Vector3;
use vi_constraints::nonsmooth::Method;
use vi_core::state::State;
use vi_multibody::FrameId::Ground;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_rigid::gap::ContactShape;

const BOTH: [Method; 2] = [Method::Stepping, Method::Events];

fn points(points: Vec<Vector3<f64>>) -> ContactShape {
    ContactShape::Points { points, radius: 0.0 }
}

/// A box as the corners of so many squares along its edges.
fn mesh_box(half: [f64; 3], squares: usize) -> ContactShape {
    let (count, place) = (squares + 1, |k: usize| 2.0 * k as f64 / squares as f64 - 1.0);
    let all = (0..count.pow(3)).map(|k| [k % count, k / count % count, k / count / count]);
    let on_face = all.filter(|own| own.iter().any(|k| *k == 0 || *k == squares));
    points(on_face.map(|own| Vector3::from_fn(|i, _| place(own[i]) * half[i])).collect())
}

/// A prism of so many sides about z.
fn prism(half: f64, radius: f64, sides: usize) -> ContactShape {
    let corner = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / sides as f64).sin_cos();
        [-half, half].map(|z| Vector3::new(radius * cos, radius * sin, z))
    };
    points((0..sides).flat_map(corner).collect())
}

fn can(half: f64, radius: f64) -> ContactShape {
    ContactShape::Cylinder { ends: [-half, half].map(|z| Vector3::new(0.0, 0.0, z)), radius }
}

/// Flat ground of squares, with hills about it.
fn terrain() -> ContactShape {
    let place = |k: i32| 0.05 * f64::from(k);
    let hill = |i: i32, j: i32| if i.abs().max(j.abs()) > 8 { 0.4 } else { 0.0 };
    let all = (-12..=12).flat_map(|i| (-12..=12).map(move |j| (i, j)));
    points(all.map(|(i, j)| Vector3::new(place(i), place(j), hill(i, j))).collect())
}

/// On a level and on a slope that friction holds, also flush with edges.
#[test]
fn meshes_that_rest_stay() {
    let cube = [0.1, 0.2, 0.1];
    let table = box_shape([1.0, 1.0, 0.1]);
    let cases = [
        ("cube on a table", &table, mesh_box(cube, 1), [0.1, 0.2, 0.2], 0.2),
        ("squares on a table", &table, mesh_box(cube, 20), [0.1, 0.2, 0.2], 0.2),
        ("cube on its like", &box_shape(cube), mesh_box(cube, 1), [0.0, 0.0, 0.2], 0.2),
        ("squares on their like", &box_shape(cube), mesh_box(cube, 12), [0.0, 0.0, 0.2], 0.0),
        (
            "squares over edges",
            &box_shape([0.05, 0.3, 0.1]),
            mesh_box(cube, 20),
            [0.0, 0.0, 0.2],
            0.1,
        ),
        ("prism on a can", &can(0.2, 0.1), prism(0.1, 0.1, 24), [0.0, 0.0, 0.3], 0.0),
        ("many sides on a can", &can(0.2, 0.3), prism(0.1, 0.1, 90), [0.1, 0.0, 0.3], 0.2),
        ("squares over a can", &can(0.2, 0.08), mesh_box(cube, 20), [0.0, 0.0, 0.3], 0.0),
        ("box on ground of squares", &terrain(), box_shape(cube), [0.12, 0.03, 0.1], 0.1),
        ("can on ground of squares", &terrain(), can(0.1, 0.17), [0.02, 0.01, 0.1], 0.0),
    ];
    for (name, fixed, shape, at, slope) in cases {
        for method in BOTH {
            let slope: f64 = slope;
            let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
            let mut builder = MechanismBuilder::new().gravity(gravity);
            let inertia = Inertia::principal(1.0, [0.01, 0.012, 0.014]);
            let body = builder.body("body", inertia).at(at).id();
            let pair = ((Ground, fixed.clone()), (body, shape.clone()));
            builder.shape_contact("rest", pair.0, pair.1, coulomb(0.5, 0.3)).unwrap();
            let mut run = run_by(&builder, 0.01, method);
            let off = moved(&mut run, 200);
            let count = run.state().contacts.counts.most_contacts;
            println!("{name}, slope {slope}, {method:?}: {count} points, moved by {off:.1e} m");
            assert!(off < 1e-12, "{name}, {method:?}: {off:e}");
            assert!((3..=32).contains(&count), "{name}: {count}");
        }
    }
}

/// A cube on a box on the floor, both free: as a mesh it stands, slides and stops as a box.
#[test]
fn a_mesh_stands_and_slides_as_a_box() {
    let half = [0.1, 0.15, 0.1];
    for (velocity, slope) in [(0.0, 0.0_f64), (1.0, 0.0), (0.0, 0.6), (0.3, 0.2)] {
        for method in BOTH {
            let ends = [box_shape(half), mesh_box(half, 1), mesh_box(half, 14)].map(|shape| {
                let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
                let mut builder = MechanismBuilder::new().gravity(gravity);
                let slab = Inertia::principal(4.0, [0.3, 0.3, 0.5]);
                let slab = builder.body("slab", slab).at([0.0, 0.0, 0.05]).id();
                let cube = Inertia::principal(1.0, [0.01, 0.012, 0.014]);
                let cube = builder.body("cube", cube).at([-0.1, 0.02, 0.2]);
                let cube = cube.velocity([velocity, 0.0, 0.0]).id();
                let (low, law) = (box_shape([0.6, 0.5, 0.05]), coulomb(0.3, 0.2));
                let ground = (Ground, floor());
                builder
                    .shape_contact("floor", ground, (slab, low.clone()), coulomb(0.9, 0.0))
                    .unwrap();
                builder.shape_contact("slab", (slab, low), (cube, shape), law).unwrap();
                let mut run = run_by(&builder, 0.005, method);
                moved(&mut run, 60);
                assert!(run.state().contacts.counts.smallest_gap.unwrap() > -1e-13);
                run.state().q.clone()
            });
            for other in &ends[1..] {
                let off = ends[0].iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                println!("{velocity} m/s, {slope} rad, {method:?}: {off:.1e} m beside a box");
                assert!(off < 1e-11, "{velocity} m/s, {slope} rad, {method:?}: {off:e}");
            }
        }
    }
}

/// A cube that slides over the edge of a box and tumbles off it, and one that falls past it: gaps
/// are not passed.
#[test]
fn a_mesh_leaves_an_edge() {
    for (at, velocity) in [
        ([0.3, 0.0, 0.15], [1.5, 0.2, 0.0]),
        ([0.55, 0.0, 0.3], [0.0, 0.0, -1.0]),
        ([0.56, 0.1, 0.3], [-0.3, 0.0, 0.0]),
    ] {
        for method in BOTH {
            let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
            let inertia = Inertia::principal(1.0, [0.004, 0.004, 0.005]);
            let body = builder.body("body", inertia).at(at).velocity(velocity);
            let body = body.angular_velocity([0.0, 0.1, 0.3]).id();
            let (table, cube) = (box_shape([0.5, 0.5, 0.1]), mesh_box([0.05; 3], 4));
            builder
                .shape_contact("edge", (Ground, table), (body, cube), coulomb(0.2, 0.3))
                .unwrap();
            let mut run = run_by(&builder, 0.004, method);
            moved(&mut run, 200);
            let counts = run.state().contacts.counts;
            println!("{at:?}, {method:?}: {counts:?}");
            assert!(counts.smallest_gap.unwrap() > -1e-12, "{counts:?}");
            assert!(counts.largest_work < 1e-12 && run.state().q[2] < -0.3, "{counts:?}");
        }
    }
}

/// A state that is read back continues bit for bit, while corners come and go.
#[test]
fn a_tumbling_mesh_continues_to_the_bit() {
    for (solid, method) in [(box_shape([0.4, 0.4, 0.1]), BOTH[0]), (can(0.1, 0.4), BOTH[1])] {
        let build = || {
            let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
            let inertia = Inertia::principal(1.0, [0.004, 0.004, 0.005]);
            let body = builder.body("body", inertia).at([0.1, 0.0, 0.3]);
            let body = body.rotation_vector([0.3, 0.5, 0.1]).angular_velocity([3.0, 1.0, 2.0]).id();
            let cube = mesh_box([0.05, 0.06, 0.07], 5);
            builder
                .shape_contact("on", (Ground, solid.clone()), (body, cube), coulomb(0.4, 0.3))
                .unwrap();
            run_by(&builder, 0.005, method)
        };
        let mut whole = build();
        let mut kept = Vec::new();
        for step in 0..160 {
            if [35, 50, 90].contains(&step) {
                kept.push((step, serde_json::to_string(whole.state()).unwrap()));
            }
            whole.step().unwrap();
        }
        assert!(whole.state().contacts.counts.impacts > 3);
        for (step, text) in kept {
            let mut other = build();
            other.resume(serde_json::from_str::<State>(&text).unwrap()).unwrap();
            for _ in step..160 {
                other.step().unwrap();
            }
            let bits = |q: &[f64]| q.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&other.state().q), bits(&whole.state().q), "from step {step}");
        }
    }
}
