//! A step for which no impulses are found is divided.

use crate::contact_runs::G;
use std::sync::Arc;
use vi_constraints::nonsmooth::{ContactLaw, ContactRows, Method, NonsmoothOptions, Unilateral};
use vi_constraints::scheme::StepError;
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::interval::Interval;
use vi_core::{Configuration, Quadrature};
use vi_multibody::builder::{DryFriction, Inertia, MechanismBuilder};
use vi_multibody::run::{MechanismIntegrator, Solver, integrator, with_contacts};
use vi_multibody::{FrameId::Ground, PairKind};

const STEP: f64 = 0.01;

/// Dry friction whose slip jumps over zero in steps that are longer than a length: what would
/// stick has no impulse there.
#[derive(Debug)]
struct Jumping {
    friction: Arc<dyn Unilateral>,
    longest: f64,
}

impl Unilateral for Jumping {
    fn name(&self) -> &str {
        self.friction.name()
    }

    fn law(&self) -> ContactLaw {
        self.friction.law()
    }

    fn size(&self) -> f64 {
        self.friction.size()
    }

    fn near(&self, s: &Interval, at: Configuration<'_>, out: &mut Vec<(u32, f64)>) {
        self.friction.near(s, at, out);
    }

    fn gap(&self, feature: u32, at: Configuration<'_>) -> f64 {
        self.friction.gap(feature, at)
    }

    fn rows(&self, feature: u32, at: Configuration<'_>, out: &mut ContactRows) {
        self.friction.rows(feature, at, out);
    }

    fn slip(&self, feature: u32, s: &Interval) -> [f64; 2] {
        let [slip, other] = self.friction.slip(feature, s);
        let jump = if s.h > self.longest { 1e-3 * s.h } else { 0.0 };
        [slip + jump.copysign(slip), other]
    }
}

/// A carriage that friction holds on a slope.
fn held(longest: f64, method: Method) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
    let body = builder.body("carriage", Inertia::principal(2.0, [0.1; 3])).id();
    let guide = builder.joint("guide", PairKind::Prismatic, Ground, body).at([0.0; 3]);
    let coordinate = guide.axis([0.8, 0.0, -0.6]).id().coordinate(0);
    builder.joint_friction(coordinate, DryFriction::Effort(20.0));
    let mut built = builder.build().unwrap();
    let elements = &mut built.forces.contacts.elements;
    let friction = elements[0].clone();
    elements[0] = Arc::new(Jumping { friction, longest });
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let (system, at) = (built.system(Quadrature::Midpoint), InitialValues::new(0.0, &q, &v));
    let options = Options::new(SchemeKind::Nodal, STEP);
    let run = integrator(built.mechanism, system, options, Solver::Auto, at).unwrap();
    let contacts = NonsmoothOptions { method, ..NonsmoothOptions::default() };
    with_contacts(run, SchemeKind::Nodal, built.forces.contacts, contacts).unwrap()
}

/// Parts of a step that have impulses are taken, and counted; nodes of the run stay where they
/// were; what sticks does not move.
#[test]
fn a_step_without_impulses_is_divided() {
    for method in [Method::Stepping, Method::Events] {
        for (longest, nodes) in [(STEP, 0), (0.4 * STEP, 2)] {
            let mut run = held(longest, method);
            let start = run.state().q.clone();
            for step in 1..=3 {
                run.step().unwrap();
                let divided = run.state().contacts.counts.divided;
                println!("{method:?}, at most {longest}: {divided} nodes between {step} steps");
                assert_eq!(divided, nodes * step);
                assert!((run.state().t - step as f64 * STEP).abs() < 1e-15);
            }
            let off = run.state().q.iter().zip(&start).map(|(a, b)| (a - b).abs());
            let off = off.fold(0.0, f64::max);
            println!("moved by {off:.1e} m");
            assert!(off < 1e-15, "{off:e}");
        }
    }
}

/// Where no part has impulses, the state is that before the step, and the message that of the
/// whole step.
#[test]
fn a_step_of_which_no_part_has_impulses_is_refused() {
    let mut run = held(0.01 * STEP, Method::Stepping);
    let before = run.state().clone();
    let error = run.step().unwrap_err();
    println!("{error}");
    assert!(matches!(error, StepError::Contact(_)) && error.to_string().contains("guide"));
    assert_eq!(run.state(), &before);
}
