//! Problems of `shapes.py` and `stops.py` in Rapier: `rapier PROBLEM STEP` prints the number that
//! is judged and the seconds of the loop of steps. No body sleeps.
use rapier3d_f64::prelude::*;
use std::time::Instant;

const G: f64 = 9.81;

fn world(h: f64) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::new(0.0, 0.0, -G);
    world.integration_parameters.dt = h;
    world
}

fn floor(world: &mut PhysicsWorld, friction: f64, restitution: f64) {
    let shape = ColliderBuilder::new(SharedShape::halfspace(Vector::Z)).friction(friction).restitution(restitution);
    world.colliders.insert(shape);
}

fn body(world: &mut PhysicsWorld, at: [f64; 3], v: [f64; 3], shape: ColliderBuilder) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(Vector::new(at[0], at[1], at[2]))
        .linvel(Vector::new(v[0], v[1], v[2]))
        .can_sleep(false);
    let handle = world.bodies.insert(body);
    world.colliders.insert_with_parent(shape, handle, &mut world.bodies);
    handle
}

fn steps(world: &mut PhysicsWorld, end: f64, mut seen: impl FnMut(&PhysicsWorld)) -> f64 {
    let count = (end / world.integration_parameters.dt).round() as usize;
    let begin = Instant::now();
    for _ in 0..count {
        world.step();
        seen(world);
    }
    begin.elapsed().as_secs_f64()
}

fn slope(h: f64) -> (f64, f64) {
    let mut w = world(h);
    let tilt = 0.4_f64;
    w.gravity = Vector::new(G * tilt.sin(), 0.0, -G * tilt.cos());
    floor(&mut w, 0.5, 0.0);
    let block = body(&mut w, [0.0, 0.0, 0.05], [0.0; 3], ColliderBuilder::cuboid(0.1, 0.1, 0.05).mass(1.0).friction(0.5));
    let spent = steps(&mut w, 10.0, |_| ());
    (w.bodies[block].translation().x, spent)
}

fn ball(h: f64) -> (f64, f64) {
    let mut w = world(h);
    floor(&mut w, 0.2, 0.0);
    let ball = body(&mut w, [0.0, 0.0, 0.1], [3.0, 0.0, 0.0], ColliderBuilder::ball(0.1).mass(1.0).friction(0.2));
    let spent = steps(&mut w, 2.0, |_| ());
    (w.bodies[ball].translation().x, spent)
}

fn bounce(h: f64) -> (f64, f64) {
    let mut w = world(h);
    floor(&mut w, 0.0, 0.8);
    let ball = body(&mut w, [0.0, 0.0, 1.1], [0.0; 3], ColliderBuilder::ball(0.1).mass(1.0).restitution(0.8).friction(0.0));
    let spent = steps(&mut w, 2.0, |_| ());
    (w.bodies[ball].translation().z - 0.1, spent)
}

fn stack(h: f64) -> (f64, f64) {
    let mut w = world(h);
    floor(&mut w, 0.5, 0.0);
    let boxes: Vec<_> = (0..10)
        .map(|i| {
            let mass = if i == 9 { 100.0 } else { 1.0 };
            body(&mut w, [0.0, 0.0, 0.05 + 0.1 * f64::from(i)], [0.0; 3], ColliderBuilder::cuboid(0.05, 0.05, 0.05).mass(mass).friction(0.5))
        })
        .collect();
    let start: Vec<_> = boxes.iter().map(|b| w.bodies[*b].translation()).collect();
    let mut worst: f64 = 0.0;
    let spent = steps(&mut w, 5.0, |w| {
        for (b, at) in boxes.iter().zip(&start) {
            worst = worst.max((w.bodies[*b].translation() - *at).length());
        }
    });
    (worst, spent)
}

fn stop(h: f64) -> (f64, f64) {
    let mut w = world(h);
    let ground = w.bodies.insert(RigidBodyBuilder::fixed());
    let inertia = 0.64 / 12.0;
    let rod = RigidBodyBuilder::dynamic()
        .translation(Vector::new(0.4 * 1.0_f64.sin(), 0.0, -0.4 * 1.0_f64.cos()))
        .rotation(Vector::new(0.0, -1.0, 0.0))
        .additional_mass_properties(MassProperties::new(Vector::ZERO, 1.0, Vector::new(inertia, inertia, 1e-4)))
        .can_sleep(false);
    let rod = w.bodies.insert(rod);
    let hinge = RevoluteJointBuilder::new(Vector::new(0.0, -1.0, 0.0))
        .local_anchor1(Vector::ZERO)
        .local_anchor2(Vector::new(0.0, 0.0, 0.4))
        .limits([0.0, 3.0]);
    w.impulse_joints.insert(ground, rod, hinge, true);
    let spent = steps(&mut w, 2.0, |_| ());
    let at = w.bodies[rod].translation();
    (at.x.atan2(-at.z), spent)
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let h: f64 = words[2].parse().expect("a step");
    let (value, spent) = match words[1].as_str() {
        "slope" => slope(h),
        "ball" => ball(h),
        "bounce" => bounce(h),
        "stack" => stack(h),
        "stop" => stop(h),
        other => panic!("no problem {other}"),
    };
    println!("{value:?} {spent:?}");
}
