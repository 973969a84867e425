//! Slot derivatives of forces along coordinates of all pairs, between points and on point masses.

use nalgebra::Vector3;
use std::sync::Arc;
use vi_core::Interval;
use vi_core::force::{DiscreteForce, LinearDamping, MidpointForce};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::form::Form;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_force::{EffortBends, EffortSlopes, JointForce, JointLaw, JointSpring};
use vi_multibody::pair::PairKind;
use vi_multibody::particle_load::ParticleLoad;
use vi_multibody::spring::Damper;
use vi_multibody::tension::Tension;
use vi_rigid::time_history::TimeHistory;
use vi_testkit::{Sample, bend_error, potential_bend_error, slope_error};

/// `τ = 0.3 + θ² − 0.7 θ θ̇ + t θ̇²`.
#[derive(Debug)]
struct Curved;

impl JointLaw for Curved {
    fn effort(&self, t: f64, x: f64, v: f64) -> f64 {
        0.3 + x * x - 0.7 * x * v + t * v * v
    }
    fn slopes(&self, t: f64, x: f64, v: f64) -> EffortSlopes {
        EffortSlopes { by_coordinate: 2.0 * x - 0.7 * v, by_rate: -0.7 * x + 2.0 * t * v }
    }
    fn bends(&self, t: f64, _x: f64, _v: f64) -> EffortBends {
        EffortBends { by_coordinate: 2.0, mixed: -0.7, by_rate: 2.0 * t }
    }
    fn is_dissipative(&self) -> bool {
        false
    }
}

/// A step of 0.1 s of two frames and a point mass.
fn step(sample: &mut Sample) -> Interval {
    let q0: Vec<f64> = [sample.frame(), sample.frame()].concat();
    let q0 = [q0, vec![0.3, -0.4, 0.9]].concat();
    let q1: Vec<f64> = q0.iter().map(|q| q + 0.1 * sample.number()).collect();
    Interval::between(0.4, 0.1, &q0, &q1)
}

fn check(name: &str, force: &dyn DiscreteForce, s: &Interval) {
    let error = slope_error(force, s);
    println!("{name}: slot derivatives off by {error:.1e}");
    assert!(error < 1e-7, "{name}: {error:e}");
    let error = bend_error(force, s);
    println!("{name}: second derivatives off by {error:.1e}");
    assert!(error < 1e-8, "{name}: {error:e}");
}

#[test]
fn along_coordinates_of_all_pairs() {
    let mut sample = Sample::new(81);
    for kind in PairKind::ALL {
        let mut builder = MechanismBuilder::new();
        let solid = || Inertia::principal(2.0, [0.3, 0.4, 0.5]);
        let a = builder.body("a", solid()).id();
        let b = builder.body("b", solid()).at([0.9, -0.2, 0.4]).id();
        builder.joint("joint", kind, a, b).at([0.4, 0.1, 0.2]).axis([1.0, 2.0, -1.0]);
        let description = builder.description().unwrap();
        for freedom in 0..kind.coordinate_count() {
            let coordinate = JointCoordinate::principal(&description.joints[0], freedom).unwrap();
            let s = step(&mut sample);
            let spring = JointSpring { coordinate: coordinate.clone(), stiffness: 2.0, rest: 0.1 };
            let error = potential_bend_error(&spring, &s);
            println!("{kind:?} {freedom}, spring: second derivatives off by {error:.1e}");
            assert!(error < 1e-8, "{error:e}");
            let force = JointForce { coordinate, law: Curved };
            check(&format!("{kind:?} {freedom}"), &force, &s);
        }
    }
}

#[test]
fn between_points_and_on_coordinates() {
    let mut sample = Sample::new(82);
    let between = || Form::point(0, &Vector3::new(0.3, -0.2, 0.1)).minus(&Form::particle(24, 3));
    let s = step(&mut sample);
    check("damper", &MidpointForce(Damper { between: between(), damping: 1.7 }), &s);
    let tension = Tension { between: between(), law: Arc::new(Curved) };
    check("tension", &MidpointForce(tension), &s);
    let entries = vec![(0, 0, 0.4), (1, 13, -0.2), (24, 2, 0.7)];
    check("linear damping", &MidpointForce(LinearDamping { entries }), &s);
    let history = TimeHistory::default();
    let load = ParticleLoad { offset: 24, dimension: 3, force: Vector3::x(), history };
    let mut both = vec![0.0; s.dim()];
    MidpointForce(load).add_plus(&s, &mut both);
    assert!((both[24] - 0.05).abs() < 1e-17, "half of the impulse at each end");
}
