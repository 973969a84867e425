//! What a guide leaves few directions is jammed by the friction of a contact: its impulses are not
//! unique, and are of the size of the motion.

use crate::contact_runs::{G, box_shape, coulomb, floor, run_by};
use vi_constraints::nonsmooth::Method;
use vi_multibody::FrameId::Ground;
use vi_multibody::PairKind;
use vi_multibody::builder::{Inertia, MechanismBuilder};

const METHODS: [Method; 2] = [Method::Events, Method::Stepping];

/// Takes steps; impulses stay below `1e3` of the momentum `p` and gaps are not passed.
fn jams(name: &str, builder: &MechanismBuilder, (step, method): (f64, Method), p: f64) {
    let mut run = run_by(builder, step, method);
    let (mut largest, mut closed) = (0.0_f64, 0);
    for k in 0..100 {
        run.step().unwrap_or_else(|error| panic!("{name}, step {k}: {error}"));
        for (_, contacts) in run.nonsmooth().unwrap().nodes() {
            for own in contacts {
                largest = own.impulse.iter().fold(largest, |most, x| most.max(x.abs()));
                closed += usize::from(own.impulse[0] > 0.0);
            }
        }
    }
    let gap = run.state().contacts.counts.smallest_gap.unwrap();
    println!("{name}, {method:?}: {closed} closed, impulses up to {largest:.1e}, gap {gap:.1e}");
    assert!(closed > 10, "{name}: {closed}");
    assert!(largest < 1e3 * p, "{name}: {largest:e} N s, momentum {p:e}");
    assert!(gap > -1e-12, "{name}: passed by {gap:e}");
}

/// A box on a planar joint whose plane leans to the floor stands with its corners.
#[test]
fn a_box_on_a_leaning_plane_is_jammed_by_the_floor() {
    for (k, method) in (0..3).flat_map(|k| METHODS.map(|method| (k, method))) {
        let normal = [0.1 + 0.02 * f64::from(k), -0.3, 1.0];
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let body = builder.body("box", Inertia::principal(2.0, [0.02, 0.03, 0.04]));
        let body = body.at([0.0, 0.0, 0.1001]).velocity([0.4, 0.0, -0.04]);
        let body = body.id();
        builder.joint("plane", PairKind::Planar, Ground, body).at([0.0; 3]).axis(normal);
        let own = (body, box_shape([0.12, 0.08, 0.1]));
        builder.shape_contact("floor", (Ground, floor()), own, coulomb(1.0, 0.3)).unwrap();
        jams(&format!("normal {normal:?}"), &builder, (0.002, method), 2.0);
    }
}
