//! A second joint beside a joint, on the same axis, adds constraints that all follow from the
//! others: the mechanism has the same degrees of freedom and the same motion. In general directions
//! these constraints vanish up to rounding only.

#![allow(clippy::unwrap_used)] // a test

use holonom::model::{Family, Scheme};
use holonom::vi_constraints::discretization::Discretization;
use holonom::vi_constraints::{Constraints, Integrator, Options};
use holonom::vi_emscheme::{EmOptions, EmSystem, run};
use holonom::vi_multibody::builder::{BuiltMechanism, Inertia, MechanismBuilder};
use holonom::vi_multibody::{FrameId, Mechanism, PairKind};
use vi_testkit::Sample;

const STEP: f64 = 0.005;

/// A body that falls about so many joints of one random axis.
fn mechanism(kind: PairKind, joints: u32, seed: u64) -> BuiltMechanism {
    let mut random = Sample::new(seed);
    let (axis, at) = (random.of_length(1.0), random.vector());
    let center = at + random.of_length(0.7);
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let body = builder.body("body", Inertia::principal(1.3, [0.10, 0.09, 0.08])).at(center).id();
    for k in 0..joints {
        let place = at + axis * (0.6 * f64::from(k));
        builder.joint(&format!("j{k}"), kind, FrameId::Ground, body).at(place).axis(axis);
    }
    builder.build().unwrap()
}

/// The degrees of freedom, and the configuration after 100 steps.
fn motion<S: Discretization<Mechanism>>(mut run: Integrator<S, Mechanism>) -> (usize, Vec<f64>) {
    (0..100).for_each(|_| _ = run.step().unwrap());
    (run.constraints().dim() - run.rows().len(), run.state().q.clone())
}

/// The same by a scheme of either family.
fn motion_by(scheme: Scheme, built: BuiltMechanism) -> (usize, Vec<f64>) {
    match scheme.family() {
        Family::Variational(kind) => motion(built.integrator(Options::new(kind, STEP)).unwrap()),
        Family::EnergyMomentum(form) => {
            let system = EmSystem::of_mechanism(&built.mechanism);
            motion(run::integrator(system, built.mechanism, EmOptions::new(form, STEP)).unwrap())
        }
        Family::Static => unreachable!("a scheme of motion"),
    }
}

#[test]
fn a_joint_doubled_on_its_axis_changes_no_motion() {
    for (kind, dof) in
        [(PairKind::Revolute, 1), (PairKind::Prismatic, 1), (PairKind::Cylindrical, 2)]
    {
        let (name, mut worst) = (kind.name(), 0.0_f64);
        for seed in 1..=6 {
            for scheme in Scheme::ALL {
                let [one, two] =
                    [1, 2].map(|joints| motion_by(scheme, mechanism(kind, joints, seed)));
                assert_eq!((one.0, two.0), (dof, dof), "{name}, {}, axis {seed}", scheme.name());
                let apart = one.1.iter().zip(&two.1).map(|(a, b)| (a - b).abs());
                worst = apart.fold(worst, f64::max);
            }
        }
        println!("{name}: {worst:.1e} m apart after 100 steps");
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
}
