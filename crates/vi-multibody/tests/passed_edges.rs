//! What passes an edge of a shape within a step names another feature at its end, whose gap was
//! negative at its start: it is caught where it touches, and gains no energy.

use crate::contact_runs::{box_shape, run_by};
use nalgebra::{Rotation3, Vector3};
use vi_constraints::nonsmooth::{ContactLaw, Method};
use vi_multibody::FrameId::Ground;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_rigid::directors::set_frame;
use vi_rigid::gap::{ContactShape, GROUND, smallest_gap};
use vi_testkit::Sample;

const STEP: f64 = 4e-3;
const HALF: [f64; 3] = [0.1, 0.15, 0.1]; // of the fixed box
const INERTIA: f64 = 1e-3; // about each axis of a body of 1 kg

fn shape(kind: &str, sample: &mut Sample) -> ContactShape {
    let ends = [-0.06 * Vector3::x(), 0.06 * Vector3::x()];
    match kind {
        "box" => box_shape([0.04, 0.07, 0.05]),
        "capsule" => ContactShape::Capsule { ends, radius: 0.02 },
        "cylinder" => ContactShape::Cylinder { ends, radius: 0.04 },
        _ => {
            let point = |_| Vector3::from_fn(|_, _| 0.06 * sample.number());
            ContactShape::Points { points: (0..30).map(point).collect(), radius: 0.0 }
        }
    }
}

/// `½mv² + ½Jω²` of the motion from one configuration to the next one.
fn energy([before, after]: [&[f64]; 2]) -> f64 {
    let square = |of: std::ops::Range<usize>| of.map(|i| (after[i] - before[i]).powi(2)).sum();
    let (way, chords): (f64, f64) = (square(0..3), square(3..12));
    let angle = 2.0 * (0.125 * chords).sqrt().asin(); // Σ|Δd_i|² = 8 sin²(θ/2)
    0.5 * (way + INERTIA * angle * angle) / (STEP * STEP)
}

/// Bodies fly past the edges and corners of a fixed box, in any attitude and with spin, without
/// gravity and friction; whatever they touch, their kinetic energy does not grow.
#[test]
fn bodies_that_pass_an_edge_gain_no_energy() {
    for kind in ["box", "capsule", "cylinder", "mesh"] {
        let (mut touches, mut divided, mut most, mut least) = (0, 0, (0.0_f64, 0), 0.0_f64);
        for seed in 0..150 {
            let mut sample = Sample::new(seed);
            let own = shape(kind, &mut sample);
            let mut vector = || Vector3::from_fn(|_, _| sample.number());
            let (turn, towards, velocity, spin) = (3.0 * vector(), vector(), vector(), vector());
            let fixed = box_shape(HALF);
            let rotation = Rotation3::new(turn);
            let edge = Vector3::from_fn(|i, _| HALF[i].copysign(towards[i]));
            let at = |far: f64| edge + far * towards.normalize();
            let gap = |far: f64| {
                let mut q = [0.0; 12];
                set_frame(&mut q, &at(far), rotation.matrix());
                smallest_gap((&fixed, &GROUND), (&own, &q)).unwrap()
            };
            let (mut near, mut far) = (-0.1, 0.4);
            for _ in 0..40 {
                let middle = 0.5 * (near + far);
                if gap(middle) > 2e-3 { far = middle } else { near = middle }
            }
            let along = velocity - velocity.dot(&towards) / towards.norm_squared() * towards;
            let velocity = 3.0 * along.normalize() - 0.8 * towards.normalize();
            let mut builder = MechanismBuilder::new();
            let body = builder.body("body", Inertia::principal(1.0, [INERTIA; 3]));
            let body = body.at(at(far)).rotation_vector(turn);
            let body = body.velocity(velocity).angular_velocity(8.0 * spin).id();
            let mut free = run_by(&builder, STEP, Method::Stepping);
            let mut last = free.state().q.clone();
            free.step().unwrap();
            let start = energy([&last, &free.state().q]);
            let law = ContactLaw::Frictionless { restitution: 0.0 };
            builder.shape_contact("edge", (Ground, fixed.clone()), (body, own), law).unwrap();
            let mut run = run_by(&builder, STEP, Method::Stepping);
            for step in 0..12 {
                run.step().unwrap_or_else(|error| panic!("{kind} {seed}, step {step}: {error}"));
                let now = run.state().q.clone();
                let gain = energy([&last, &now]) / start - 1.0;
                if gain > most.0 {
                    most = (gain, seed);
                }
                last = now;
            }
            let counts = &run.state().contacts.counts;
            touches += usize::from(counts.most_contacts > 0);
            divided += counts.events;
            least = least.min(counts.smallest_gap.unwrap_or(0.0));
        }
        println!("{kind}: {touches} touch, {divided} nodes within steps, gain {most:?}, {least:e}");
        assert!(touches > 20 && most.0 < 1e-9 && least > -1e-12, "{kind}: {most:?}, {least:e}");
    }
}
