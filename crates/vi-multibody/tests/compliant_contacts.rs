//! Compliant contacts: restitution in closed form, order of the step, momentum, energy over many
//! bounces.

use nalgebra::Vector3;
use vi_constraints::{Options, SchemeKind};
use vi_multibody::FrameId::Ground;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::contact::compliant_contact::{CompliantContact, CompliantLaw};
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::stribeck::Stribeck;
use vi_rigid::gap::ContactShape;

const RADIUS: f64 = 0.1;

fn law(stiffness: f64, exponent: f64, dissipation: f64) -> CompliantLaw {
    CompliantLaw { stiffness, exponent, dissipation, friction: None }
}

fn ball() -> ContactShape {
    ContactShape::sphere(Vector3::zeros(), RADIUS)
}

/// A ball above the ground with the velocity `v` downwards.
fn falling(law: CompliantLaw, gravity: f64, v: f64, step: f64) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -gravity]);
    let inertia = Inertia::principal(2.0, [0.008; 3]);
    let own = builder.body("ball", inertia).at([0.0, 0.0, RADIUS + 0.01]);
    let own = own.velocity([0.0, 0.0, -v]).id();
    let plane = ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() };
    let contact = CompliantContact::new([Ground, own.into()], [plane, ball()], law).unwrap();
    builder.compliant_contact("floor", contact);
    let built = builder.build().unwrap();
    built.integrator(Options::new(SchemeKind::Nodal, step)).unwrap()
}

/// `e` of `c v − ln(1 + c v) = −c e v − ln(1 − c e v)` by bisection.
fn restitution(cv: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0_f64.min(1.0 / cv));
    let before = cv - (1.0 + cv).ln();
    for _ in 0..200 {
        let e = 0.5 * (low + high);
        if -cv * e - (1.0 - cv * e).ln() < before { low = e } else { high = e }
    }
    low
}

#[test]
fn an_impact_has_the_restitution_of_its_dissipation_alone() {
    let v = 1.5;
    for (stiffness, exponent) in [(2e4, 1.0), (3e5, 1.5), (4e6, 2.2)] {
        for dissipation in [0.01, 0.2, 1.0, 4.0] {
            let mut run = falling(law(stiffness, exponent, dissipation), 0.0, v, 2e-5);
            while run.state().q[2] < RADIUS + 0.005 || run.observe().unwrap().v[2] < 0.0 {
                run.step().unwrap();
            }
            let found = run.observe().unwrap().v[2] / v;
            let exact = restitution(dissipation * v);
            println!("p = {exponent}, c = {dissipation}: e = {found:.6}, exact {exact:.6}");
            assert!((found - exact).abs() < 1e-5, "{found} for {exact}");
        }
    }
    let small = restitution(1e-3);
    assert!((small - (1.0 - 2e-3 / 3.0)).abs() < 1e-6, "1 − (2/3) c v: {small}");
}

/// The error at the deepest overlap falls with the square of the step.
#[test]
fn the_order_is_two_where_steps_resolve_the_contact() {
    let place = |step: f64| {
        let mut run = falling(law(3e4, 1.5, 0.1), 9.81, 1.0, step);
        let steps = (0.032 / step).round() as usize; // whole ones
        for _ in 0..steps {
            run.step().unwrap();
        }
        run.state().q[2]
    };
    let places = [8e-4, 4e-4, 2e-4, 1e-4, 5e-5].map(place);
    let changes: Vec<f64> = places.windows(2).map(|pair| (pair[0] - pair[1]).abs()).collect();
    let orders: Vec<f64> = changes.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    println!("orders {orders:.2?}");
    assert!((orders.iter().sum::<f64>() / orders.len() as f64 - 2.0).abs() < 0.2, "{orders:?}");
}

/// An elastic ball bounces ever as high.
#[test]
fn the_energy_of_an_elastic_contact_does_not_drift() {
    let mut run = falling(law(3e4, 1.5, 0.0), 9.81, 1.0, 5e-4);
    let energy =
        |run: &mut MechanismIntegrator| run.observe().unwrap().hamiltonian_projected.total();
    let first = energy(&mut run);
    let mut largest = [0.0_f64; 2];
    for half in &mut largest {
        for _ in 0..20_000 {
            run.step().unwrap();
            *half = half.max((energy(&mut run) - first).abs());
        }
    }
    println!("energy off by {largest:?} of {first}");
    assert!(largest[1] < 1.1 * largest[0] && largest[0] < 0.02 * first, "{largest:?}");
}

/// Balls that turn hit one another off their centres: momentum and angular momentum stay.
#[test]
fn momenta_of_free_bodies_stay_through_contact_with_friction() {
    let mut builder = MechanismBuilder::new();
    let course = Stribeck { transition_velocity: 0.01, static_ratio: 1.2, stribeck_velocity: 0.1 };
    let law = CompliantLaw { friction: Some((0.4, course)), ..law(5e4, 1.5, 0.3) };
    let inertia = Inertia::principal(1.0, [0.004, 0.005, 0.006]);
    let place = |x: f64, y: f64| [x, y, 0.02];
    let first = builder.body("first", inertia).at(place(-0.11, 0.0)).velocity([1.0, 0.2, 0.0]);
    let first = first.angular_velocity([10.0, -30.0, 20.0]).id();
    let second = builder.body("second", inertia).at(place(0.11, 0.05)).velocity([-2.0, 0.0, 0.1]);
    let second = second.angular_velocity([-5.0, 8.0, 40.0]).id();
    let block = ContactShape::Box {
        center: Vector3::zeros(),
        axes: nalgebra::Matrix3::identity(),
        half_lengths: Vector3::repeat(0.09),
    };
    let frames = [first.into(), second.into()];
    let contact = CompliantContact::new(frames, [block, ball()], law).unwrap();
    builder.compliant_contact("pair", contact);
    let built = builder.build().unwrap();
    let mechanism = built.mechanism.clone();
    let mut run = built.integrator(Options::new(SchemeKind::Nodal, 2e-4)).unwrap();
    let momenta = |run: &mut MechanismIntegrator| {
        let q = run.state().q.clone();
        let node = run.observe().unwrap();
        let found = mechanism.momentum(&q, &node.p_projected);
        (found.linear, found.angular, node.hamiltonian_projected.total())
    };
    let (linear, angular, energy) = momenta(&mut run);
    let mut off = 0.0_f64;
    for _ in 0..1000 {
        run.step().unwrap();
        let (p, l, _) = momenta(&mut run);
        let pairs = p.iter().chain(&l).zip(linear.iter().chain(&angular));
        off = pairs.map(|(a, b)| (a - b).abs()).fold(off, f64::max);
    }
    let lost = energy - momenta(&mut run).2;
    println!("momenta off by {off:.1e}, {lost:.3} J of {energy:.3} J lost");
    assert!(off < 1e-12 && lost > 0.3, "{off:e}, {lost}");
}
