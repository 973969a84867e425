//! Laws on all targets, of all inputs, against independent differences.

use super::*;
use crate::builder::{ActOn, BuiltMechanism, Inertia, MechanismBuilder, Read};
use crate::pair::PairKind;
use crate::pair::joint::FrameId::Ground;
use nalgebra::{DMatrix, Rotation3, Vector3};
use std::sync::Arc;
use vi_testkit::{bend_error, slope_error};

/// Quadratic in inputs and states, of any number of efforts and rates.
struct CurvedForce {
    efforts: usize,
    inputs: usize,
    states: usize,
}

impl CurvedForce {
    fn coefficient(k: usize, i: usize) -> f64 {
        0.3 + 0.1 * ((3 * k + 5 * i) % 7) as f64
    }
}

impl Law for CurvedForce {
    fn efforts(&self) -> usize {
        self.efforts
    }
    fn evaluate(&self, y: &[f64], z: &[f64], values: &mut [f64]) {
        let n = self.inputs + self.states;
        let of = |i: usize| if i < y.len() { y[i] } else { z[i - y.len()] };
        for (k, value) in values.iter_mut().enumerate() {
            *value = (0..n).map(|i| Self::coefficient(k, i) * of(i) * of((i + k + 1) % n)).sum();
        }
    }
    fn gradient(&self, y: &[f64], z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>) {
        let n = self.inputs + self.states;
        let of = |i: usize| if i < y.len() { y[i] } else { z[i - y.len()] };
        slopes.fill(0.0);
        for k in 0..values.len() {
            for i in 0..n {
                let (c, j) = (Self::coefficient(k, i), (i + k + 1) % n);
                slopes[(k, i)] += c * of(j);
                slopes[(k, j)] += c * of(i);
            }
        }
        self.evaluate(y, z, values);
    }
    fn bend(&self, y: &[f64], along: &[f64], w: &[f64], slopes: &mut [f64]) {
        slopes.fill(0.0);
        for (k, w) in w.iter().enumerate() {
            for i in 0..y.len() {
                let (c, j) = (Self::coefficient(k, i), (i + k + 1) % y.len());
                slopes[i] += w * c * along[j];
                slopes[j] += w * c * along[i];
            }
        }
    }
    fn is_dissipative(&self) -> bool {
        true
    }
}

/// A cart with an arm, a free body and a point mass, with laws on each that read all.
fn built(states: usize) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new();
    let solid = || Inertia::principal(1.3, [0.2, 0.3, 0.4]);
    let cart = builder.body("cart", solid()).at([0.2, 0.1, 0.0]).id();
    let arm = builder.body("arm", solid()).at([0.7, 0.1, 0.0]).id();
    let free = builder.body("free", solid()).at([0.1, 1.1, 0.3]).id();
    let ball = builder.particle("ball", 0.3, [0.9, -0.5, 0.4], [0.0; 3]);
    let slide = builder.joint("slide", PairKind::Prismatic, Ground, cart);
    let slide = slide.at([0.0; 3]).axis([1.0, 0.2, 0.1]).id().coordinate(0);
    let knee = builder.joint("knee", PairKind::Revolute, cart, arm);
    let knee = knee.at([0.3, 0.1, 0.0]).axis([0.1, 1.0, 0.3]).id().coordinate(0);
    let (tip, corner) = (arm.point([0.2, 0.1, -0.1]), free.point([0.1, 0.3, 0.2]));
    let reads = vec![
        Read::Time,
        Read::Coordinate(slide),
        Read::Rate(slide),
        Read::Coordinate(knee),
        Read::Rate(knee),
        Read::Position(tip, 2),
        Read::Velocity(corner, 1),
        Read::Position(ball.into(), 0),
        Read::Distance([tip, corner]),
        Read::DistanceRate([ball.into(), corner]),
        Read::AngularVelocity(free, 0),
        Read::AngularVelocity(arm, 2),
        Read::Along(arm, corner, 1),
        Read::AlongRate(arm, ball.into(), 0),
        Read::RelativeSpin([arm, free], 2),
        Read::Held(states),
    ];
    let targets = [
        ActOn::Coordinate(slide),
        ActOn::Coordinate(knee),
        ActOn::Points([tip, corner]),
        ActOn::Points([[0.1, 0.2, -0.4].into(), ball.into()]),
        ActOn::Member { at: corner, follows: false },
        ActOn::Member { at: corner, follows: true },
        ActOn::Member { at: ball.into(), follows: false },
        ActOn::Relative { at: corner, base: arm, follows: false },
        ActOn::Relative { at: corner, base: arm, follows: true },
        ActOn::Relative { at: ball.into(), base: arm, follows: false },
    ];
    for on in targets {
        let on_member = matches!(on, ActOn::Member { .. } | ActOn::Relative { .. });
        let efforts = if on_member { 6 } else { 1 };
        let law = Arc::new(CurvedForce { efforts, inputs: reads.len(), states });
        builder.law(on, reads.clone(), (0..states).rev().collect(), law);
    }
    builder.build().expect("a mechanism")
}

fn laws(built: &BuiltMechanism) -> impl Iterator<Item = &LawForce> {
    built.forces.forces.iter().filter_map(|own| match &own.force {
        crate::builder::ElementForce::Law(law) => Some(law),
        _ => None,
    })
}

fn differences(q: &[f64], f: impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
    let e = 1e-6;
    let mut all = DMatrix::zeros(q.len(), q.len());
    for j in 0..q.len() {
        let moved = |by: f64| {
            let mut q = q.to_vec();
            q[j] += by;
            f(&q)
        };
        let (plus, minus) = (moved(e), moved(-e));
        (0..q.len()).for_each(|i| all[(i, j)] = (plus[i] - minus[i]) / (2.0 * e));
    }
    all
}

/// Each body turned and moved a little, with directors that stay orthonormal.
fn moved(q: &[f64], by: f64) -> Vec<f64> {
    let mut out = q.to_vec();
    for k in 0..3 {
        let turn = Rotation3::new(Vector3::new(0.3, -0.2, 0.4) * by * (1.0 + k as f64));
        for i in 0..4 {
            let at = 12 * k + 3 * i;
            let x = Vector3::new(q[at], q[at + 1], q[at + 2]);
            let x = if i == 0 { x + by * Vector3::new(0.2, 0.1, -0.3) } else { turn * x };
            out[at..at + 3].copy_from_slice(x.as_slice());
        }
    }
    (36..39).for_each(|i| out[i] += by * 0.2);
    out
}

#[test]
fn derivatives_against_central_differences() {
    for states in [0, 2] {
        let built = built(states);
        let q0 = built.mechanism.initial_configuration();
        let q1 = moved(&q0, 0.3);
        let internal = [0.4, -0.3, 0.2];
        let v: Vec<f64> = (0..q0.len()).map(|i| 0.1 * (i % 7) as f64 - 0.3).collect();
        let n = q0.len();
        for (k, law) in laws(&built).enumerate() {
            let mut law = law.clone();
            law.reading.start = Arc::from([0.0; 3]);
            let mut s = Interval::between(0.4, 0.1, &q0, &q1);
            s.internal = internal.to_vec();
            let error = slope_error(&law, &s);
            println!("{states} states, law {k}: slot derivatives {error:.1e}");
            assert!(error < 3e-8);
            if states == 0 {
                let error = bend_error(&law, &s);
                println!("law {k}: second derivatives {error:.1e}");
                assert!(error < 1e-8);
                let value = |q: &[f64], v: &[f64]| {
                    let mut out = vec![0.0; n];
                    law.add(Motion::new(0.4, q, v), 1.0, &mut out);
                    out
                };
                let [mut by_q, mut by_v] = [DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
                law.add_velocity_derivative(Motion::new(0.4, &q0, &v), 1.0, &mut by_v);
                let rest = vec![0.0; n]; // angles have rates that do not change at rest
                law.add_position_derivative(Motion::new(0.4, &q0, &rest), 1.0, &mut by_q);
                let errors = [
                    (by_q - differences(&q0, |q| value(q, &rest))).amax(),
                    (by_v - differences(&v, |v| value(&q0, v))).amax(),
                ];
                println!("law {k}, slopes: {errors:?}");
                assert!(errors.iter().all(|error| *error < 1e-7));
            }
        }
    }
}

#[test]
fn states_follow_the_midpoint_rule() {
    let built = built(2);
    let mut law = laws(&built).next().expect("a law").clone();
    law.reading.start = Arc::from([0.0; 3]);
    let q0 = built.mechanism.initial_configuration();
    let mut s = Interval::between(0.4, 0.1, &q0, &moved(&q0, 0.3));
    s.internal = vec![0.4, -0.3, 0.2];
    let curved = CurvedForce { efforts: 1, inputs: 16, states: 2 };
    let held = [0.4, -0.3, 0.2];
    let y: Vec<f64> = law.reading.inputs.iter().map(|input| input.in_step(&s, &held)).collect();
    law.reading.with_values_in_step(&s, |work| {
        let (z, mut values) = (work.middle(), [0.0; 3]);
        curved.evaluate(&y, z, &mut values);
        for (k, start) in [-0.3, 0.4].into_iter().enumerate() {
            let error = (z[k] - start - 0.05 * values[1 + k]).abs();
            assert!(error < 2e-16 * 4.0, "state {k}: {error:e}");
        }
    });
}
