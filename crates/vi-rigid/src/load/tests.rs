//! Impulses and derivatives of loads.

use super::*;
use crate::directors;
use crate::null_space::pull_back;
use nalgebra::DMatrix;
use vi_core::linear::norm_inf;
use vi_core::momentum_map::Momentum;
use vi_testkit::{Sample, slope_error};

const OFFSET: usize = 12;

fn load(sample: &mut Sample, kind: LoadKind) -> Load {
    let history = TimeHistory::Ramp { start: 0.0, end: 1.0, amplitude: 2.0 };
    let load = Load::new(OFFSET, kind, sample.vector(), sample.vector(), history).unwrap();
    load.at(sample.vector()).unwrap()
}

/// `ϱ = ϱ_I d_I`.
fn arm(load: &Load, q: &[f64]) -> Vector3<f64> {
    directors::triad(q) * load.point()
}

/// A step of the second of two frames; the first must not be read.
fn interval(q0: &[f64; 12], q1: &[f64; 12]) -> Interval {
    let mut s = Interval::new(24);
    let other = [f64::NAN; 12];
    s.open(0.3, 0.1, &[other, *q0].concat());
    s.q1.copy_from_slice(&[other, *q1].concat());
    s.close_from_end();
    s
}

#[test]
fn the_impulse_of_a_step_is_that_of_the_wrench_and_its_lever() {
    let mut sample = Sample::new(71);
    for kind in [LoadKind::Dead, LoadKind::Follower] {
        for _ in 0..100 {
            let (q0, q1) = (sample.frame(), sample.frame());
            let load = load(&mut sample, kind);
            let s = interval(&q0, &q1);
            let Wrench { force: f, torque: tau } = load.wrench(s.t_mid(), &s.q_mid[12..]);
            let (mut minus, mut plus) = (vec![0.0; 24], vec![0.0; 24]);
            load.add_minus(&s, &mut minus);
            load.add_plus(&s, &mut plus);
            for (q, half) in [(&q0, &minus), (&q1, &plus)] {
                assert!(half[..12].iter().all(|x| *x == 0.0), "the other frame is free");
                let pulled = pull_back(q, &half[12..]);
                let moment = tau + arm(&load, q).cross(&f);
                for k in 0..3 {
                    let error = (pulled[k] - 0.05 * f[k]).abs();
                    let error = error.max((pulled[3 + k] - 0.05 * moment[k]).abs());
                    assert!(error < 1e-15, "{kind:?}: impulse off by {error:e}");
                }
                // the momentum map gets the moment about the origin
                let mut gain = Momentum::default();
                directors::add_momentum(q, &half[12..], &mut gain);
                let expected = 0.05 * (moment + directors::center(q).cross(&f));
                let error = (Vector3::from(gain.angular) - expected).amax();
                assert!(error < 1e-15, "{kind:?}: angular momentum off by {error:e}");
            }
            if kind == LoadKind::Dead {
                let expected = 0.7 * load.torque; // ramp to 2, t_{n+1/2} = 0.35
                assert!((tau - expected).norm() < 1e-15, "{tau} against {expected}");
            }
        }
    }
}

#[test]
fn a_follower_has_fixed_body_components() {
    let mut sample = Sample::new(72);
    let load = load(&mut sample, LoadKind::Follower);
    let q = sample.frame();
    let Wrench { force: f, torque: tau } = load.wrench(0.5, &q);
    for i in 0..3 {
        let d = director(&q, i);
        assert!((f.dot(&d) - load.force[i]).abs() < 2e-15);
        assert!((tau.dot(&d) - load.torque[i]).abs() < 2e-15);
    }
    let mut continuous = vec![0.0; 24];
    let both = [q, q].concat();
    load.add_continuous(Motion::new(0.5, &both, &[]), &mut continuous);
    let pulled = pull_back(&q, &continuous[12..]);
    let moment = tau + arm(&load, &q).cross(&f);
    let error = norm_inf((pulled.fixed_rows::<3>(3) - moment).as_slice());
    assert!(error < 2e-15, "continuous torque off by {error:e}");
}

#[test]
fn a_dead_force_at_a_point_is_its_potential_by_the_midpoint_rule() {
    let mut sample = Sample::new(74);
    let (f, point) = (sample.vector(), sample.vector());
    let history = TimeHistory::default();
    let load = Load::new(OFFSET, LoadKind::Dead, f, Vector3::zeros(), history).unwrap();
    let load = load.at(point).unwrap();
    let s = interval(&sample.frame(), &sample.frame());
    let (mut minus, mut plus) = (vec![0.0; 24], vec![0.0; 24]);
    load.add_minus(&s, &mut minus);
    load.add_plus(&s, &mut plus);
    assert_eq!(minus, plus, "no directors enter");
    for k in 0..3 {
        for (at, coefficient) in [(0, 1.0), (3, point[0]), (6, point[1]), (9, point[2])] {
            let error = minus[OFFSET + at + k] - 0.5 * s.h * coefficient * f[k];
            assert!(error.abs() < 1e-16, "−(h/2) ∇V off by {error:e}");
        }
    }
}

#[test]
fn slot_derivatives_match_central_differences() {
    let mut sample = Sample::new(73);
    for kind in [LoadKind::Dead, LoadKind::Follower] {
        let load = load(&mut sample, kind);
        let s = interval(&sample.frame(), &sample.frame());
        let mut exact = DMatrix::zeros(24, 24);
        load.add_minus_d2(&s, &mut exact);
        assert_eq!(exact.amax() > 0.0, kind == LoadKind::Follower);
        let error = slope_error(&load, &s);
        println!("{kind:?}: off by {error:.1e}");
        assert!(error < 1e-9, "{kind:?}: off by {error:e}");
    }
}

#[test]
fn the_stiffness_at_rest_matches_central_differences() {
    let mut sample = Sample::new(75);
    for kind in [LoadKind::Dead, LoadKind::Follower] {
        let (load, q) = (load(&mut sample, kind), sample.frame());
        let force = |q: &[f64]| {
            let mut out = vec![0.0; 24];
            load.add_continuous(Motion::new(0.7, q, &[0.0; 24]), &mut out);
            out
        };
        let q = [q, q].concat();
        let mut exact = DMatrix::zeros(24, 24);
        load.add_stiffness(Motion::new(0.7, &q, &[]), 1.0, &mut exact);
        for j in 0..24 {
            let (mut plus, mut minus) = (q.clone(), q.clone());
            (plus[j], minus[j]) = (q[j] + 1e-3, q[j] - 1e-3); // quadratic in q
            let (plus, minus) = (force(&plus), force(&minus));
            for i in 0..24 {
                let error = ((plus[i] - minus[i]) / 2e-3 - exact[(i, j)]).abs();
                assert!(error < 1e-12, "{kind:?} [{i}, {j}]: off by {error:e}");
            }
        }
    }
}

#[test]
fn impossible_loads_are_refused() {
    let zero = Vector3::zeros();
    let broken = Vector3::new(0.0, f64::NAN, 0.0);
    let new = |force, history| Load::new(0, LoadKind::Dead, force, zero, history);
    let message = new(broken, TimeHistory::default()).unwrap_err().to_string();
    assert_eq!(message, "a component of the force is NaN; it must be a finite number");
    let history = TimeHistory::Table { points: vec![] };
    let message = new(zero, history).unwrap_err().to_string();
    assert_eq!(message, "the table of the time history has no points");
    let load = new(zero, TimeHistory::default()).unwrap();
    let message = load.at(broken).unwrap_err().to_string();
    assert_eq!(message, "a component of the point is NaN; it must be a finite number");
}
