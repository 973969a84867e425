//! Runs of unlike mechanisms with controls.

use nalgebra::{DMatrix, Vector3};
use std::sync::Arc;
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_control::objective::{Effort, NumberCost, PointComponent, Running, Terminal, Time};
use vi_control::terminal_rate::{RateOf, TerminalRate};
use vi_control::{ControlForce, Controls, JointControl, Objective};
use vi_core::Composition;
use vi_multibody::FrameId::Ground;
use vi_multibody::PairKind;
use vi_multibody::builder::{ActOn, BuiltMechanism, CoordinateId, Inertia, MechanismBuilder, Read};
use vi_multibody::form::Form;
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint_force::Viscous;
use vi_multibody::law::{ByParameters, Change, Input, Law, Sampler, Seed};
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::six_coordinates::Matrix6;

/// A mechanism, what controls it, and a name.
pub(crate) struct Subject {
    pub(crate) name: &'static str,
    pub(crate) built: BuiltMechanism,
    pub(crate) controlled: Vec<(CoordinateId, HeldEffort)>,
}

fn solid(mass: f64) -> Inertia {
    Inertia::principal(mass, [0.02, 0.05, 0.04])
}

fn controlled(builder: &mut MechanismBuilder, of: CoordinateId) -> (CoordinateId, HeldEffort) {
    let effort = HeldEffort::default();
    builder.joint_force(of, effort.clone());
    (of, effort)
}

/// Two arms with a spring at the elbow and a damper at the top.
pub(crate) fn pendulum() -> Subject {
    arms("pendulum", 0.15)
}

/// The same without the damper.
pub(crate) fn conservative() -> Subject {
    arms("conservative", 0.0)
}

fn arms(name: &'static str, damping: f64) -> Subject {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let one = builder.body("one", solid(1.0)).at([0.5, 0.0, 0.0]).id();
    let two = builder.body("two", solid(0.7)).at([1.5, 0.0, 0.0]).id();
    let top = builder.joint("top", PairKind::Revolute, Ground, one).at([0.0; 3]);
    let top = top.axis([0.0, 1.0, 0.0]).rate(1.0).id().coordinate(0);
    let elbow = builder.joint("elbow", PairKind::Revolute, one, two).at([1.0, 0.0, 0.0]);
    let elbow = elbow.axis([0.0, 1.0, 0.0]).rate(-0.5).id().coordinate(0);
    builder.joint_spring(elbow, 4.0, 0.2);
    builder.joint_force(top, Viscous(damping));
    let efforts = [top, elbow].map(|of| controlled(&mut builder, of));
    Subject { name, built: builder.build().unwrap(), controlled: efforts.into() }
}

/// A spatial tree with a spherical joint, a cylinder, a slide, and a free body on a bushing and a
/// spring.
pub(crate) fn spatial() -> Subject {
    let mut builder = MechanismBuilder::new().gravity([0.3, -0.2, -9.81]);
    let base = builder.body("base", solid(2.0)).at([0.3, 0.1, 0.2]).id();
    let middle = builder.body("middle", solid(1.5)).at([0.8, 0.3, 0.2]).id();
    let hand = builder.body("hand", solid(0.8)).at([1.2, 0.2, 0.4]).id();
    let free = builder.body("free", solid(0.6)).at([1.3, 0.9, 0.4]);
    let free = free.angular_velocity([1.0, 0.2, -0.4]).id();
    let root = builder.joint("root", PairKind::Spherical, Ground, base).at([0.0; 3]);
    let _ = root.id();
    let turn = builder.joint("turn", PairKind::Cylindrical, base, middle).at([0.5, 0.2, 0.2]);
    let turn = turn.axis([2.0, -1.0, 2.0]).rates(&[0.1, -2.0]).id();
    let slide = builder.joint("slide", PairKind::Prismatic, middle, hand).at([1.0, 0.3, 0.3]);
    let slide = slide.axis([0.6, 0.8, 0.0]).rate(0.2).id().coordinate(0);
    builder.joint_spring(turn.coordinate(0), 40.0, 0.05);
    builder.joint_spring(slide, 60.0, 0.0);
    builder.joint_force(turn.coordinate(1), Viscous(0.05));
    let (tip, corner) = (hand.point([0.2, 0.0, 0.1]), free.point([0.1, 0.0, 0.0]));
    builder.spring(tip, corner, 25.0).natural_length(0.4).damping(0.7);
    let stiffness = Matrix6::identity() * 3.0;
    builder.bushing(hand, free).at([1.2, 0.5, 0.4]).stiffness(stiffness);
    let efforts = [turn.coordinate(1), slide].map(|of| controlled(&mut builder, of));
    Subject { name: "spatial tree", built: builder.build().unwrap(), controlled: efforts.into() }
}

/// A four-bar mechanism: three redundant constraints.
pub(crate) fn four_bar() -> Subject {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let y = [0.0, 1.0, 0.0];
    let crank = builder.body("crank", solid(0.8)).at([0.0, 0.0, 0.15]).id();
    let coupler = builder.body("coupler", solid(1.6)).at([0.45, 0.0, 0.4]).id();
    let rocker = builder.body("rocker", solid(1.1)).at([0.85, 0.0, 0.25]).id();
    let shaft = builder.joint("shaft", PairKind::Revolute, Ground, crank).at([0.0; 3]).axis(y);
    let shaft = shaft.id().coordinate(0);
    builder.joint("pin", PairKind::Revolute, crank, coupler).at([0.0, 0.0, 0.3]).axis(y);
    let pivot = builder.joint("pivot", PairKind::Revolute, Ground, rocker).at([0.8, 0.0, 0.0]);
    let pivot = pivot.axis(y).id().coordinate(0);
    builder.joint("cut", PairKind::Revolute, coupler, rocker).at([0.9, 0.0, 0.5]).axis(y).cut();
    builder.joint_spring(pivot, 5.0, 0.1);
    builder.joint_force(shaft, Viscous(0.1));
    let efforts = vec![controlled(&mut builder, shaft)];
    Subject { name: "four-bar", built: builder.build().unwrap(), controlled: efforts }
}

/// An effort by a rate, a coordinate and a state that follows the coordinate: a damper with memory.
struct Remembering {
    efforts: usize,
    states: usize,
}

impl Law for Remembering {
    fn efforts(&self) -> usize {
        self.efforts
    }
    fn evaluate(&self, y: &[f64], z: &[f64], values: &mut [f64]) {
        if self.efforts > 0 {
            values[0] = -0.4 * y[0] - 0.8 * z[0] * (1.0 + 0.3 * y[1]);
        }
        if self.states > 0 {
            values[self.efforts] = 5.0 * (y[1] - z[0]) + 0.2 * y[0] * z[0];
        }
    }
    fn gradient(&self, y: &[f64], z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>) {
        self.evaluate(y, z, values);
        slopes.fill(0.0);
        if self.efforts > 0 {
            slopes[(0, 0)] = -0.4;
            slopes[(0, 1)] = -0.24 * z[0];
            slopes[(0, 2)] = -0.8 * (1.0 + 0.3 * y[1]);
        }
        if self.states > 0 {
            let row = self.efforts;
            slopes[(row, 0)] = 0.2 * z[0];
            slopes[(row, 1)] = 5.0;
            slopes[(row, 2)] = -5.0 + 0.2 * y[0];
        }
    }
    fn is_dissipative(&self) -> bool {
        true
    }
}

/// One state, nothing sampled.
struct OneState;

impl Sampler for OneState {
    fn count(&self) -> usize {
        1
    }
    fn start(&self) -> Arc<[f64]> {
        Arc::from([0.1])
    }
    fn is_due(&self, _step: u64) -> bool {
        false
    }
    fn sample(&self, _step: u64, _y: &[f64], _internal: &mut [f64]) {}
    fn begin(&self, _y: &[f64], internal: &mut [f64]) {
        internal[0] = 0.1;
    }
    fn sample_changes(
        &self,
        _step: u64,
        _y: &[f64],
        _internal: &mut [f64],
        _by: &ByParameters<'_>,
    ) -> Vec<Change> {
        vec![Change::of(Seed::Internal(0))]
    }
    fn begin_changes(&self, _: &[f64], _: &mut [f64], _: &ByParameters<'_>) -> Vec<Change> {
        vec![Change::default()]
    }
}

/// A pendulum with a damper that remembers.
pub(crate) fn remembering() -> Subject {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let one = builder.body("one", solid(1.0)).at([0.5, 0.0, 0.0]).id();
    let top = builder.joint("top", PairKind::Revolute, Ground, one).at([0.0; 3]);
    let top = top.axis([0.0, 1.0, 0.0]).rate(1.0).id().coordinate(0);
    let reads = || vec![Read::Rate(top), Read::Coordinate(top)];
    let law = |efforts| Arc::new(Remembering { efforts, states: 1 });
    builder.law(ActOn::Coordinate(top), reads(), vec![0], law(1));
    builder.signals(reads(), vec![0], law(0), Arc::new(OneState));
    let efforts = vec![controlled(&mut builder, top)];
    Subject { name: "memory", built: builder.build().unwrap(), controlled: efforts }
}

/// A run of a subject with controls over so many macro steps of 0.02 s.
pub(crate) fn run(
    subject: Subject,
    scheme: SchemeKind,
    composition: Composition,
    steps: usize,
) -> (MechanismIntegrator, Controls, Objective) {
    run_with(subject, Options::new(scheme, 0.02).composition(composition), steps)
}

/// The same with these options.
pub(crate) fn run_with(
    mut subject: Subject,
    options: Options,
    steps: usize,
) -> (MechanismIntegrator, Controls, Objective) {
    let mut forces: Vec<Box<dyn ControlForce>> = Vec::new();
    let mut objective = Objective::new().with(1.0, Effort { of: Vec::new() }).with(0.3, Time);
    for (k, (of, effort)) in subject.controlled.iter().enumerate() {
        let coordinate = subject.built.coordinate(*of).unwrap();
        let quantity = coordinate.clone();
        objective.add(
            2.0 + k as f64,
            Box::new(Running { quantity, judged: NumberCost::Deviation(0.3) }),
        );
        forces.push(Box::new(JointControl { effort: effort.clone(), coordinate }));
    }
    let last = subject.built.mechanism.dim() - 12;
    for axis in 0..3 {
        let point = Form::point(last, &Vector3::new(0.3, 0.1, -0.2));
        let quantity = PointComponent { point, axis };
        objective.add(10.0, Box::new(Terminal { quantity, judged: NumberCost::Deviation(0.4) }));
    }
    let value = |n: usize, k: usize| (0.3 * n as f64 + k as f64).sin() * 2.0;
    let count = forces.len();
    let values = (0..steps).map(|n| (0..count).map(|k| value(n, k)).collect());
    let controls = Controls::new(forces, values.collect(), 1);
    (subject.built.integrator(options).unwrap(), controls, objective)
}

/// Adds to an objective what rates of the last frame cost along the path.
pub(crate) fn add_rates(run: &MechanismIntegrator, objective: &mut Objective) {
    let last = run.state().q.len() - 12;
    let point = Form::point(last, &Vector3::new(0.1, -0.2, 0.3));
    let rate = RateOf(PointComponent { point, axis: 0 });
    objective.add_along(
        4.0,
        Box::new(TerminalRate::new(rate, NumberCost::Deviation(0.2), run, &[]).unwrap()),
    );
    let spin = Input::Spin(last, 1);
    objective.add_along(
        0.7,
        Box::new(TerminalRate::new(spin, NumberCost::Deviation(-0.4), run, &[]).unwrap()),
    );
}
