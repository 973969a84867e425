//! Gradients by the geometry of joints without their multipliers are those with them.

use crate::costates::random_built;
use crate::runs::four_bar;
use nalgebra::Vector3;
use vi_constraints::costate_sweep::CostateTangents;
use vi_constraints::design::{Costates, Design, Place};
use vi_constraints::linearization::Costate;
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_control::objective::{CostTerm, Last, NumberCost, PointComponent, Running};
use vi_control::{Checkpoints, Controls, Gradient, Objective, Task};
use vi_core::galerkin::Stages;
use vi_core::linear::{dot, norm_inf};
use vi_core::{Composition, MechanicalSystem, Quadrature, State};
use vi_multibody::Mechanism;
use vi_multibody::builder::BuiltMechanism;
use vi_multibody::design::{JointTangent, MechanismDesign, MechanismTangent, SideTangent};
use vi_multibody::form::Form;
use vi_multibody::joint::Side;
use vi_testkit::Sample;

/// A design that asks for multipliers.
struct ByRows<'a>(&'a MechanismDesign);

impl Design for ByRows<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }
    fn add_tangent(
        &self,
        k: usize,
        at: Place<'_>,
        impulse: &[f64],
        minus: &mut [f64],
        plus: &mut [f64],
        rows: &mut [f64],
    ) {
        self.0.add_tangent(k, at, impulse, minus, plus, rows);
    }
    fn sums(&self) -> usize {
        self.0.sums()
    }
    fn add_adjoint(
        &self,
        at: Place<'_>,
        impulse: &[f64],
        costates: Costates<'_>,
        sums: &mut [f64],
    ) {
        assert!(costates.moved[0].is_empty());
        self.0.add_adjoint(at, impulse, costates, sums);
    }
    fn add_gradient(&self, sums: &[f64], out: &mut [f64]) {
        self.0.add_gradient(sums, out);
    }
    fn moves_constraints(&self) -> bool {
        self.0.moves_constraints()
    }
}

/// A side that shifts and turns.
fn moved(side: &Side, sample: &mut Sample) -> SideTangent {
    let (anchor, turn): (Vector3<f64>, Vector3<f64>) = (sample.vector(), sample.vector());
    SideTangent { anchor, axes: turn.cross_matrix() * side.axes }
}

/// A change of each joint, and one of all of them, but of screws.
fn tangents(mechanism: &Mechanism, sample: &mut Sample) -> Vec<MechanismTangent> {
    let joints = &mechanism.description().joints;
    let mut all = MechanismTangent::default();
    let mut list = Vec::new();
    for (k, joint) in joints.iter().enumerate().filter(|(_, own)| own.kind.pitch().is_none()) {
        let [parent, child] = [&joint.parent, &joint.child].map(|side| moved(side, sample));
        let change = JointTangent { parent, child, pitch: 0.0 };
        let mut tangent = MechanismTangent::default();
        tangent.joints.insert(k, change);
        all.joints.insert(k, change);
        list.push(tangent);
    }
    list.push(all);
    list
}

/// `c·p̄_N`, which holds the efforts of the last step.
struct LastMomentum(Vec<f64>);

impl CostTerm for LastMomentum {
    fn of_end(&self, end: &State) -> f64 {
        dot(&self.0, &end.p)
    }
    fn add_of_end(&self, _end: &State, scale: f64, Costate { p, .. }: &mut Costate) {
        p.iter_mut().zip(&self.0).for_each(|(p, c)| *p += scale * c);
    }
}

/// Positions, and of steps of order 2 the momentum of the end.
fn objective(n: usize, options: &Options, sample: &mut Sample) -> Objective {
    let point = |axis| PointComponent { point: Form::particle(n - 12, 3), axis };
    let running = Running { quantity: point(0), judged: NumberCost::Deviation(0.3) };
    let objective = Objective::new().with(1.0, Last(point(2))).with(2.0, running);
    match options.method.stages() {
        None => objective.with(1.0, LastMomentum((0..n).map(|_| sample.number()).collect())),
        Some(_) => objective,
    }
}

/// The gradients of some steps by both ways, with all that acts along the joints, relative to the
/// largest entry; `None` where the sweeps over links do not apply, or loops depend on each other
/// where they are to be `independent`.
fn difference(
    built: BuiltMechanism,
    (options, steps): (Options, usize),
    independent: bool,
    sample: &mut Sample,
) -> Option<f64> {
    let tangents = tangents(&built.mechanism, sample);
    let (system, quadrature) = (built.system(Quadrature::Midpoint), Quadrature::Midpoint);
    let BuiltMechanism { mechanism, forces } = &built;
    let design = MechanismDesign::new(mechanism, forces, system.mass(), quadrature, &tangents);
    let (design, controls) = (design.unwrap(), Controls::default());
    let objective = objective(mechanism.dim(), &options, sample);
    assert!(design.reads_moved());
    let mut run = built.integrator(options).ok()?;
    run.costate_sweep(CostateTangents::OfMovedMechanism)?;
    if independent && run.rows().len() < run.constraints().len() {
        return None;
    }
    let rows = ByRows(&design);
    let start = run.state().clone();
    let [by_sides, by_rows] = [&design as &dyn Design, &rows].map(|design| {
        let task = Task {
            steps,
            objective: &objective,
            controls: &controls,
            design: Some(design),
            by_step: false,
            checkpoints: Checkpoints::Every(3),
        };
        run.place_at(&start);
        Gradient::of(&mut run, &task).unwrap()
    });
    let size = |x: &[f64]| norm_inf(x).max(1e-3);
    let off = |x: &[f64], y: &[f64]| -> Vec<f64> { x.iter().zip(y).map(|(x, y)| x - y).collect() };
    let apart = |x: &[f64], y: &[f64]| norm_inf(&off(x, y)) / size(y);
    let parameters = apart(&by_sides.parameters, &by_rows.parameters);
    Some(parameters.max(apart(&by_sides.initial.q, &by_rows.initial.q)))
}

#[test]
fn of_random_trees_by_galerkin_steps() {
    let mut sample = Sample::new(23);
    let (mut worst, mut compared) = (0.0, 0);
    for seed in 0..60 {
        for loaded in [false, true] {
            let stages = Stages::new(1 + seed as usize % 4).unwrap();
            let options = Options::new(SchemeKind::Nodal, 0.02).galerkin(stages);
            let bodies = 1 + seed as usize % 7;
            if let Some(built) = random_built(bodies, seed, (loaded, 0))
                && let Some(off) = difference(built, (options, 4), true, &mut sample)
            {
                assert!(off < 1e-10, "seed {seed}, loaded {loaded}: {off:e}");
                (worst, compared) = (off.max(worst), compared + 1);
            }
        }
    }
    println!("by Galerkin steps they differ by {worst:.1e} at most on {compared} trees");
    assert!(compared > 80, "{compared}");
}

/// A planar four-bar linkage: rows that depend on others, a spring, a motor.
#[test]
fn of_a_redundant_loop() {
    let options = Options::new(SchemeKind::Nodal, 0.02);
    let off = difference(four_bar().built, (options, 7), false, &mut Sample::new(22));
    let off = off.expect("few loops");
    println!("with and without multipliers differ by {off:.1e}");
    assert!(off < 1e-11, "{off:e}");
}

#[test]
fn of_random_trees_and_loops() {
    let mut sample = Sample::new(21);
    let (mut worst, mut compared) = (0.0, [0; 2]);
    for seed in 0..80 {
        for (loaded, kept) in [(false, 0), (true, 0), (false, 1), (true, 2)] {
            let compositions = [Composition::Identity, Composition::KahanLi9];
            let options = Options::new(SchemeKind::Nodal, 0.02);
            let options = options.composition(compositions[usize::from(seed % 5 == 0 && !loaded)]);
            if let Some(built) = random_built(1 + seed as usize % 7, seed, (loaded, kept))
                && let Some(off) = difference(built, (options, 7), true, &mut sample)
            {
                assert!(off < 1e-10, "seed {seed}, {kept} distances, loaded {loaded}: {off:e}");
                (worst, compared[kept.min(1)]) = (off.max(worst), compared[kept.min(1)] + 1);
            }
        }
    }
    println!(
        "with and without multipliers differ by {worst:.1e} at most on {compared:?} mechanisms"
    );
    assert!(compared[0] > 100 && compared[1] > 50, "{compared:?}");
}
