//! A second joint beside a joint, on the same axis, adds constraints that all follow from the others: the mechanism has the
//! same degrees of freedom and the same motion. In general directions these constraints vanish up to rounding only.

#![allow(clippy::unwrap_used)] // a test

use holonom::model::Scheme;
use holonom::simulation::RunOutcome;
use holonom::{Model, Simulation};
use vi_testkit::Sample;

/// A body that falls about a joint of a random axis.
fn mechanism(kind: &str, scheme: Scheme, doubled: bool, seed: u64) -> String {
    let mut random = Sample::new(seed);
    let (axis, at) = (random.of_length(1.0), random.vector());
    let center = at + random.of_length(0.7);
    let list = |v: nalgebra::Vector3<f64>| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
    let mut text = format!(
        "[model]\nname = \"doubled\"\ngravity = [0.0, 0.0, -9.81]\n[simulation]\nstep = 0.005\nend = 0.5\nscheme = \"{}\"\n\
         [[body]]\nname = \"body\"\nmass = 1.3\ninertia = [0.10, 0.09, 0.08]\nposition = {}\n",
        scheme.name(),
        list(center)
    );
    for k in 0..if doubled { 2 } else { 1 } {
        let place = at + axis * (0.6 * f64::from(k));
        text += &format!(
            "[[joint]]\nname = \"j{k}\"\ntype = \"{kind}\"\nparent = \"ground\"\nchild = \"body\"\nposition = {}\naxis = {}\n",
            list(place),
            list(axis)
        );
    }
    text
}

/// The degrees of freedom and the last configuration.
fn run(text: &str) -> (usize, Vec<f64>) {
    let mut simulation = Simulation::new(&Model::from_toml(text).unwrap()).unwrap();
    let dof = simulation.assembly().counts.dof;
    let mut last = Vec::new();
    let mut observe = |sample: &holonom::Sample| -> Result<(), std::convert::Infallible> {
        last.clone_from(&sample.q);
        Ok(())
    };
    let Ok(outcome) = simulation.run(&mut observe, &mut |_, _| {});
    assert_eq!(outcome, RunOutcome::Done, "{text}");
    (dof, last)
}

#[test]
fn a_joint_doubled_on_its_axis_changes_no_motion() {
    for (kind, dof) in [("revolute", 1), ("prismatic", 1), ("cylindrical", 2)] {
        let mut worst = 0.0_f64;
        for seed in 1..=6 {
            for scheme in Scheme::ALL {
                let one = run(&mechanism(kind, scheme, false, seed));
                let two = run(&mechanism(kind, scheme, true, seed));
                assert_eq!((one.0, two.0), (dof, dof), "{kind}, {}, axis {seed}", scheme.name());
                let apart = one.1.iter().zip(&two.1).map(|(a, b)| (a - b).abs());
                worst = apart.fold(worst, f64::max);
            }
        }
        println!("{kind}: {worst:.1e} m apart after 100 steps");
        assert!(worst < 1e-9, "{kind}: {worst:e}");
    }
}
