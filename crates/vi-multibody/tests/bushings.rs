//! Bushings and bearings: slopes, momenta, the limit of stability of a rotor.

#![allow(clippy::unwrap_used)] // a test

use std::sync::Arc;

use nalgebra::{Complex, DMatrix, Matrix3, Rotation3, Vector3};
use vi_constraints::{Options, SchemeKind};
use vi_core::force::{DiscreteForce, Force};
use vi_core::interval::Interval;
use vi_core::potential::DiscretePotential;
use vi_core::{Configuration, Motion};
use vi_multibody::FrameId::Ground;
use vi_multibody::builder::{
    BodyId, BuiltMechanism, ElementForce, ForceElements, Inertia, MechanismBuilder, Read,
};
use vi_multibody::bushing::{LinearSix, SixForce};
use vi_multibody::law::Law;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::six_coordinates::{Matrix6, Rotation, Vector6};
use vi_testkit::{bend_error, potential_bend_error, slope_error};

/// Of coordinates and rates, with curvature.
struct Curved;

impl Law for Curved {
    fn efforts(&self) -> usize {
        6
    }
    fn evaluate(&self, y: &[f64], _z: &[f64], values: &mut [f64]) {
        let (x, v, t, far) = (&y[..6], &y[6..12], y[12], &y[13..]);
        for i in 0..6 {
            let (j, k) = ((i + 1) % 6, (i + 2) % 6);
            values[i] = 3.0 * x[i] + x[j] * x[k] - 0.7 * v[i] * x[k]
                + 0.2 * v[j] * v[j]
                + t
                + far[i % 2] * x[i] * far[0];
        }
    }
    fn gradient(&self, y: &[f64], z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>) {
        self.evaluate(y, z, values);
        slopes.fill(0.0);
        let (x, v, far) = (&y[..6], &y[6..12], &y[13..]);
        for i in 0..6 {
            let (j, k) = ((i + 1) % 6, (i + 2) % 6);
            slopes[(i, i)] += 3.0 + far[i % 2] * far[0];
            slopes[(i, 13 + i % 2)] += x[i] * far[0];
            slopes[(i, 13)] += far[i % 2] * x[i];
            slopes[(i, 12)] = 1.0;
            slopes[(i, j)] += x[k];
            slopes[(i, k)] += x[j] - 0.7 * v[i];
            slopes[(i, 6 + i)] -= 0.7 * x[k];
            slopes[(i, 6 + j)] += 0.4 * v[j];
        }
    }
    fn bend(&self, y: &[f64], along: &[f64], w: &[f64], slopes: &mut [f64]) {
        slopes.fill(0.0);
        for i in 0..6 {
            let (j, k, far) = ((i + 1) % 6, (i + 2) % 6, 13 + i % 2);
            let mut pair = |a: usize, b: usize, c: f64| {
                slopes[a] += w[i] * c * along[b];
                slopes[b] += w[i] * c * along[a];
            };
            pair(j, k, 1.0);
            pair(6 + i, k, -0.7);
            pair(6 + j, 6 + j, 0.2);
            // y_far y_i y_13
            pair(far, i, y[13]);
            pair(i, 13, y[far]);
            pair(far, 13, y[i]);
        }
    }
    fn is_dissipative(&self) -> bool {
        true
    }
}

/// The coordinates of a bushing, the time, and what else it reads.
fn all(far: &[Read]) -> Vec<Read> {
    let six = (0..12).map(|part| Read::Six { bushing: 0, part });
    six.chain([Read::Time]).chain(far.iter().copied()).collect()
}

fn frame(at: [f64; 3], turned: [f64; 3]) -> impl Iterator<Item = f64> {
    let rotation = Rotation3::new(Vector3::from(turned)).into_inner();
    at.into_iter().chain(rotation.as_slice().to_vec())
}

/// Two free bodies, of full inertia and turned at the start.
fn bodies() -> (MechanismBuilder, [BodyId; 2]) {
    let mut builder = MechanismBuilder::new();
    let turned = |x| Rotation3::new(Vector3::from(x)).into_inner();
    let near = builder
        .body("near", Inertia::principal(2.0, [0.3, 0.4, 0.5]))
        .at([0.1, -0.2, 0.3])
        .attitude(turned([0.2, 0.1, -0.4]))
        .velocity([0.3, -0.1, 0.2])
        .angular_velocity([1.0, -0.5, 0.8])
        .id();
    let far = builder
        .body("far", Inertia::principal(1.0, [0.1, 0.2, 0.15]))
        .at([0.6, 0.1, 0.2])
        .attitude(turned([-0.3, 0.6, 0.1]))
        .velocity([-0.2, 0.4, 0.1])
        .angular_velocity([-0.7, 1.1, 0.4])
        .id();
    (builder, [near, far])
}

fn axes() -> Matrix3<f64> {
    Rotation3::new(Vector3::new(0.3, -0.2, 0.5)).into_inner()
}

/// Any matrix of full rank with different entries.
fn matrix(scale: f64, seed: usize) -> Matrix6 {
    let entry =
        |i: usize, j: usize| f64::from(u32::try_from((7 * i + 11 * j + seed) % 13).unwrap());
    Matrix6::from_fn(|i, j| scale * (entry(i, j) - 6.0 + if i == j { 20.0 } else { 0.0 }))
}

fn symmetric(m: Matrix6) -> Matrix6 {
    0.5 * (m + m.transpose())
}

fn at(q: &[f64]) -> Configuration<'_> {
    Configuration::new(0.4, q)
}

fn force(forces: &ForceElements) -> &SixForce {
    let mut all = forces.forces.iter().filter_map(|own| match &own.force {
        ElementForce::Six(force) => Some(force),
        _ => None,
    });
    all.next().unwrap()
}

/// The largest difference from central differences, relative to the largest entry.
fn error(found: &DMatrix<f64>, at: &[f64], f: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
    let (e, n) = (1e-6, at.len());
    let mut expected = DMatrix::zeros(n, n);
    for j in 0..n {
        let moved = |by: f64| {
            let mut x = at.to_vec();
            x[j] += by;
            f(&x)
        };
        let (plus, minus) = (moved(e), moved(-e));
        (0..n).for_each(|i| expected[(i, j)] = (plus[i] - minus[i]) / (2.0 * e));
    }
    (found - &expected).amax() / expected.amax()
}

#[test]
fn slopes_against_central_differences() {
    let mut worst = [0.0_f64; 6];
    for rotation in [Rotation::Vector, Rotation::Tilt] {
        for grounded in [false, true] {
            let (mut builder, [near, far]) = bodies();
            let reads = [
                Read::AngularVelocity(near, 1),
                Read::Distance([near.point([0.0; 3]), far.point([0.1, 0.0, 0.2])]),
            ];
            let mut add = |law: bool| {
                let entry = match grounded {
                    true => builder.bushing(Ground, far),
                    false => builder.bushing(near, far),
                };
                let entry = entry.at([0.4, 0.0, 0.2]).attitude(axes()).rotation(rotation);
                let stiffness = symmetric(matrix(1.0, 3));
                match law {
                    true => _ = entry.law(all(&reads), Vec::new(), Arc::new(Curved)),
                    false => _ = entry.stiffness(stiffness).preload(Vector6::repeat(0.4)),
                }
            };
            add(true);
            add(false);
            let forces = builder.build().unwrap().forces;
            let (six, spring) = (force(&forces), &forces.bushings[0].spring);
            let q0: Vec<f64> = frame([0.1, 0.2, -0.3], [0.3, -0.5, 0.2])
                .chain(frame([0.6, 0.0, -0.1], [0.7, 0.3, -0.6]))
                .collect();
            let q1: Vec<f64> = frame([0.15, 0.1, -0.2], [0.4, -0.3, 0.1])
                .chain(frame([0.5, 0.1, 0.1], [0.6, 0.5, -0.4]))
                .collect();
            let v: Vec<f64> = (0..24).map(|i| 0.1 * f64::from(i % 7) - 0.3).collect();
            let n = q0.len();
            let made = |emit: &dyn Fn(&mut DMatrix<f64>)| {
                let mut out = DMatrix::zeros(n, n);
                emit(&mut out);
                out
            };
            let filled = |add: &dyn Fn(&mut [f64])| {
                let mut out = vec![0.0; n];
                add(&mut out);
                out
            };
            let step = |q0: &[f64], q1: &[f64]| Interval::between(0.4, 0.1, q0, q1);
            let errors = [
                slope_error(six, &step(&q0, &q1)),
                error(
                    &made(&|out| six.add_position_derivative(Motion::new(0.4, &q0, &v), 1.0, out)),
                    &q0,
                    |q| filled(&|out| six.add(Motion::new(0.4, q, &v), 1.0, out)),
                ),
                error(
                    &made(&|out| six.add_velocity_derivative(Motion::new(0.4, &q0, &v), 1.0, out)),
                    &v,
                    |v| filled(&|out| six.add(Motion::new(0.4, &q0, v), 1.0, out)),
                ),
                error(&made(&|out| spring.add_d1_d1(&step(&q0, &q1), 1.0, out)), &q0, |q0| {
                    filled(&|out| spring.add_d1(&step(q0, &q1), 1.0, out))
                }),
                error(&made(&|out| spring.add_d2_d2(&step(&q0, &q1), 1.0, out)), &q1, |q1| {
                    filled(&|out| spring.add_d2(&step(&q0, q1), 1.0, out))
                }),
                error(
                    &made(&|out| DiscretePotential::add_hessian(spring, at(&q0), 1.0, out)),
                    &q0,
                    |q| filled(&|out| DiscretePotential::add_gradient(spring, at(q), 1.0, out)),
                ),
            ];
            worst.iter_mut().zip(errors).for_each(|(worst, own)| *worst = worst.max(own));
            let s = step(&q0, &q1);
            let bends = [bend_error(six, &s), potential_bend_error(spring, &s)];
            println!("{rotation:?}: second derivatives {bends:?}");
            assert!(bends.iter().all(|error| *error < 1e-8));
            let energy = |q: &[f64]| {
                let mut out = vec![0.0; n];
                out[0] = spring.potential(at(q));
                out
            };
            let mut gradient = DMatrix::zeros(n, n);
            let row = filled(&|out| DiscretePotential::add_gradient(spring, at(&q0), 1.0, out));
            (0..n).for_each(|j| gradient[(0, j)] = row[j]);
            assert!(error(&gradient, &q0, energy) < 1e-8);
        }
    }
    println!(
        "slots, ∂f/∂q, ∂f/∂v, D_1 D_1 U_d, D_2 D_2 U_d, ∇²V: largest relative errors {worst:?}"
    );
    assert!(worst.iter().all(|error| *error < 1e-7));
}

fn run(built: BuiltMechanism, step: f64) -> MechanismIntegrator {
    built.integrator(Options::new(SchemeKind::Nodal, step)).unwrap()
}

/// A bushing of this law between both free bodies.
fn pair(rotation: Rotation, law: LinearSix, as_law: bool) -> MechanismBuilder {
    let (mut builder, [near, far]) = bodies();
    let entry = builder.bushing(near, far).at([0.4, 0.0, 0.2]).attitude(axes()).rotation(rotation);
    let LinearSix { preload, stiffness, damping } = law;
    match as_law {
        true => _ = entry.law(all(&[])[..12].to_vec(), Vec::new(), Arc::new(law)),
        false => _ = entry.stiffness(stiffness).damping(damping).preload(preload),
    }
    builder
}

#[test]
fn momenta_of_free_bodies_are_exact_whatever_the_coefficients() {
    for rotation in [Rotation::Vector, Rotation::Tilt] {
        let law = LinearSix {
            preload: Vector6::repeat(0.3),
            stiffness: matrix(1.0, 5),
            damping: matrix(0.02, 2),
        };
        let built = pair(rotation, law, false).build().unwrap();
        let mechanism = built.mechanism.clone();
        let mut run = run(built, 0.01);
        let momenta = |run: &mut MechanismIntegrator| {
            let momentum = mechanism.momentum(&run.state().q.clone(), &run.observe().unwrap().p);
            [momentum.linear, momentum.angular].map(Vector3::from)
        };
        let start = momenta(&mut run);
        for _ in 0..200 {
            run.step().unwrap();
        }
        let change: Vec<f64> =
            momenta(&mut run).iter().zip(&start).map(|(a, b)| (a - b).amax()).collect();
        println!("{rotation:?}: change of momenta in 200 steps {change:?}");
        assert!(change.iter().all(|change| *change < 2e-14));
    }
}

#[test]
fn a_symmetric_stiffness_is_a_potential_and_the_same_force() {
    let law = LinearSix {
        preload: Vector6::repeat(0.3),
        stiffness: symmetric(matrix(1.0, 5)),
        damping: Matrix6::zeros(),
    };
    let [potential, force] = [false, true].map(|as_law| {
        let built = pair(Rotation::Vector, law, as_law).build().unwrap();
        assert_eq!(
            (built.forces.bushings.len(), built.forces.forces.len()),
            match as_law {
                true => (0, 1),
                false => (1, 0),
            }
        );
        let mut run = run(built, 0.01);
        for _ in 0..100 {
            run.step().unwrap();
        }
        run.state().q.clone()
    });
    let difference = potential.iter().zip(&force).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("potential and force differ by {difference:.1e} after 100 steps");
    assert!(difference < 1e-13);
}

/// The energy of the pair, and the work of what is no potential, at the end.
fn balance(step: f64) -> f64 {
    let law = LinearSix {
        preload: Vector6::repeat(0.3),
        stiffness: symmetric(matrix(1.0, 5)),
        damping: symmetric(matrix(0.02, 2)),
    };
    let built = pair(Rotation::Vector, law, false).build().unwrap();
    let six = force(&built.forces).clone();
    let mut run = run(built, step);
    let start = run.observe().unwrap().hamiltonian_projected.total();
    let (mut work, mut before) = (0.0, run.state().clone());
    let steps = (0.64 / step).round() as usize;
    for _ in 0..steps {
        run.step().unwrap();
        let s = Interval::between(before.t, step, &before.q, &run.state().q);
        work += six.work(&s, &mut [0.0; 24]);
        before = run.state().clone();
    }
    assert!(work < -0.1, "dampers take out {work} J");
    run.observe().unwrap().hamiltonian_projected.total() - start - work
}

#[test]
fn the_balance_of_energy_closes_to_second_order() {
    let errors = [0.02, 0.01, 0.005].map(|step| balance(step).abs());
    let orders = [0, 1].map(|k: usize| (errors[k] / errors[k + 1]).log2());
    println!("energy not accounted for: {errors:?} J, orders {orders:.2?}");
    assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.2));
}

/// The growth of a rotor on a cross-coupled bearing.
fn growth(factor: f64, step: f64) -> f64 {
    let (m, k, c): (f64, f64, f64) = (20.0, 2.0e6, 400.0);
    let cross = factor * c * (k / m).sqrt();
    let mut builder = MechanismBuilder::new();
    let rotor =
        builder.body("rotor", Inertia::principal(m, [0.5, 0.5, 0.2])).velocity([0.01, 0.0, 0.0]);
    let rotor = rotor.angular_velocity([0.0, 0.0, 100.0]).id();
    let mut stiffness = Matrix6::zeros();
    stiffness.fixed_view_mut::<2, 2>(0, 0).copy_from_slice(&[k, -cross, cross, k]);
    let damping = Matrix6::from_diagonal(&Vector6::from([c, c, 0.0, 0.0, 0.0, 0.0]));
    let bearing = builder.bushing(Ground, rotor).rotation(Rotation::Tilt);
    _ = bearing.stiffness(stiffness).damping(damping);
    let mut run = run(builder.build().unwrap(), step);
    // two roots: z_{n+2} = α z_{n+1} + β z_n for z = x + iy, by four nodes far apart
    let z = [0, 1, 2, 3].map(|_| {
        for _ in 0..10 {
            run.step().unwrap();
        }
        Complex::new(run.state().q[0], run.state().q[1])
    });
    let det = z[1] * z[1] - z[0] * z[2];
    let (sum, minus) = ((z[1] * z[2] - z[0] * z[3]) / det, (z[2] * z[2] - z[1] * z[3]) / det);
    let root = (sum * sum - minus * 4.0).sqrt();
    let moduli = [root, -root].map(|root| (0.5 * (sum + root)).norm());
    moduli.iter().copied().fold(0.0, f64::max).ln() / (10.0 * step)
}

/// The same in closed form: `(m/h²)(z² − 2z + 1) + (c/2h)(z² − 1) + ¼(k − iκ)(z² + 2z + 1) = 0`.
fn closed_form(factor: f64, h: f64) -> f64 {
    let (m, k, c): (f64, f64, f64) = (20.0, 2.0e6, 400.0);
    let s = Complex::new(k, -factor * c * (k / m).sqrt()) * 0.25;
    let (two, one) = (s + m / (h * h) + c / (2.0 * h), s * 2.0 - 2.0 * m / (h * h));
    let root = (one * one - two * (s + m / (h * h) - c / (2.0 * h)) * 4.0).sqrt();
    let moduli = [root, -root].map(|root| ((-one + root) / (two * 2.0)).norm());
    moduli.iter().copied().fold(0.0, f64::max).ln() / h
}

#[test]
fn a_rotor_loses_its_stability_exactly_at_the_continuous_threshold() {
    for step in [5e-4, 2e-3] {
        let limit = closed_form(1.0, step);
        assert!(limit.abs() < 1e-10, "{limit}");
        for factor in [0.9, 1.0, 1.1] {
            let (found, expected) = (growth(factor, step), closed_form(factor, step));
            println!(
                "κ/κ_0 = {factor}, h = {step}: growth {found:.9}, closed form {expected:.9} 1/s"
            );
            assert!((found - expected).abs() < 1e-6);
        }
    }
}
