//! Costates by the sweeps over the links of a tree, with loops on top, are those of the saddle
//! point.

use crate::runs::{Subject, conservative, four_bar, pendulum, remembering, run, spatial};
use nalgebra::{DMatrix, DVector, Vector3};
use vi_constraints::costate_sweep::{CostateSweep, CostateTangents, Linearization};
use vi_constraints::linearization::{Costate, Sources, Tangent};
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_core::galerkin::Stages;
use vi_core::linear::{dot, norm_inf};
use vi_core::{Composition, Interval, SeparableSystem};
use vi_multibody::builder::{BuiltMechanism, Inertia, MechanismBuilder};
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint_force::Viscous;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::{FrameId, Mechanism, PairKind};
use vi_rigid::TimeHistory;
use vi_testkit::Sample;

type Sweep = dyn CostateSweep<SeparableSystem, Mechanism>;

/// A random tree of joints of all kinds, half of them written from child to parent, in gravity;
/// with springs, dampers and efforts along its coordinates, and with what acts on single bodies
/// where it is `loaded`; so many distances between its bodies are `kept`. `None` where it cannot
/// move.
fn random_mechanism(
    bodies: usize,
    seed: u64,
    (loaded, kept): (bool, usize),
    options: Options,
) -> Option<MechanismIntegrator> {
    random_built(bodies, seed, (loaded, kept))?.integrator(options).ok()
}

/// The same without an integrator.
pub(crate) fn random_built(
    bodies: usize,
    seed: u64,
    (loaded, kept): (bool, usize),
) -> Option<BuiltMechanism> {
    let mut random = Sample::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut builder = MechanismBuilder::new().gravity([0.3, -1.0, -9.0]);
    let (mut frames, mut points) = (vec![FrameId::Ground], Vec::new());
    for k in 0..bodies {
        let j = Vector3::new(1.0, 1.2, 1.5) + 0.15 * random.vector();
        let inertia = Inertia::principal(2.0 + random.number(), j.into());
        let at = 2.0 * random.vector();
        let body = builder.body(&format!("body {k}"), inertia).at(at);
        let body = body.rotation_vector(random.vector()).id();
        if loaded {
            let point = body.point(random.vector());
            let anchor: [f64; 3] = (at + random.vector()).into();
            builder.spring(anchor, point, 20.0).natural_length(0.3).damping(0.4);
            let history =
                TimeHistory::Harmonic { frequency: 1.0, phase: 0.3, amplitude: 1.0, offset: 0.0 };
            builder.load(body).force(random.vector()).torque(random.vector()).history(history);
        }
        points.push(body.point(random.vector()));
        frames.push(body.into());
    }
    for k in 0..bodies {
        let kind = PairKind::ALL[random.index(PairKind::ALL.len())];
        if kind == PairKind::Free {
            continue;
        }
        let (parent, child) = (frames[(random.index(k + 1) + 1) % (k + 1)], frames[k + 1]);
        let (point, axis) = (random.vector(), random.vector());
        let [parent, child] =
            if random.number() <= 0.0 { [child, parent] } else { [parent, child] };
        let joint = builder.joint(&format!("joint {k}"), kind, parent, child).at(point).axis(axis);
        let joint = joint.id();
        for freedom in 0..kind.coordinate_count() {
            let of = joint.coordinate(freedom);
            let effort = HeldEffort::default();
            effort.set(random.number());
            builder.joint_force(of, effort);
            match random.index(3) {
                0 => builder.joint_spring(of, 5.0, random.number()),
                1 => drop(builder.joint_force(of, Viscous(0.7))),
                _ => {}
            }
        }
    }
    for k in 0..kept {
        let anchor: [f64; 3] = (3.0 * random.vector()).into();
        match points.get(k + 1) {
            Some(other) => builder.distance(&format!("distance {k}"), points[0], *other),
            None => builder.distance(&format!("distance {k}"), anchor, points[k % bodies]),
        }
    }
    let built = builder.build().ok()?;
    let dof = built.mechanism.tree().dof();
    (dof > kept).then_some(built)
}

/// Steps of order 2.
fn second() -> Options {
    Options::new(SchemeKind::Nodal, 0.02)
}

/// What a sweep backward over some steps finds: `a` along tangents and `b` at the start; of each
/// step `μ`, and `σ` and `h λ` between bodies.
#[derive(Debug)]
struct Found {
    a: Vec<f64>,
    b: Vec<f64>,
    mu: Vec<Vec<f64>>,
    rows: Vec<[Vec<f64>; 2]>,
}

fn back(
    run: &MechanismIntegrator,
    sweep: &mut Sweep,
    (steps, nodes): (&[Vec<Interval>], &[Vec<f64>]),
    mut costate: Costate,
    along: CostateTangents,
) -> Found {
    let (system, mechanism) = (run.system(), run.constraints());
    let mut momenta = nodes.to_vec();
    if run.method().stages().is_none() {
        momenta.truncate(1);
        for points in steps {
            let mut next = momenta.last().unwrap().clone();
            sweep.momentum(system, &points[0], &mut next);
            momenta.push(next);
        }
    }
    sweep.hold(system, &steps[steps.len() - 1], &mut costate);
    let (mut mu, mut rows) = (Vec::new(), Vec::new());
    for (s, p) in steps.iter().zip(&momenta).rev() {
        sweep.pull(system, mechanism, s, p, &mut costate).unwrap();
        let between = |of: &[f64]| of[mechanism.len_internal()..].to_vec();
        sweep.for_each_part(s, &mut |at, impulse, costates| {
            if at.has_forces() {
                mu.push(costates.step.to_vec());
                mu.push(costates.momentum.to_vec());
            }
            if at.has_rows() {
                rows.push([costates.rows, impulse].map(between));
            }
        });
    }
    if along == CostateTangents::OfBodies {
        return Found { a: costate.q, b: costate.p, mu, rows };
    }
    let start = steps[0].last().unwrap();
    let (n, m, rank) = (mechanism.dim(), mechanism.len(), run.rows().len());
    let mut jacobian = DMatrix::zeros(n.max(m), n); // all right singular vectors
    mechanism.jacobian(start.t, &start.q0, &mut jacobian);
    let directions = jacobian.svd(false, true).v_t.unwrap();
    let tangents = directions.rows(rank, n - rank);
    let a = tangents * DVector::from_column_slice(&costate.q);
    Found { a: a.as_slice().into(), b: costate.p, mu, rows }
}

/// The largest difference of two vectors, relative to the largest entry.
fn apart(x: &[f64], y: &[f64]) -> f64 {
    let off: Vec<f64> = x.iter().zip(y).map(|(x, y)| x - y).collect();
    norm_inf(&off) / norm_inf(y).max(f64::MIN_POSITIVE)
}

/// By how much the sweep over links differs from the saddle-point matrix over some steps; `None`
/// where there is none. Along all tangents of bodies where constraints are independent: others have
/// many multipliers.
fn difference(run: &mut MechanismIntegrator, sample: &mut Sample, steps: usize) -> Option<f64> {
    let (n, m) = (run.state().q.len(), run.constraints().len());
    let mut sweeps =
        vec![(CostateTangents::OfMechanism, run.costate_sweep(CostateTangents::OfMechanism)?)];
    if run.rows().len() == m {
        let along = CostateTangents::OfBodies;
        sweeps.extend(run.costate_sweep(along).map(|sweep| (along, sweep)));
    }
    let (mut nodes, mut taken) = (vec![run.state().p.clone()], Vec::<Vec<Interval>>::new());
    for _ in 0..steps {
        run.step_with(&mut |_, _, step| taken.push(step.points().to_vec())).unwrap();
        nodes.push(run.state().p.clone());
    }
    let mut random = || (0..n).map(|_| sample.number()).collect();
    let end = Costate { q: random(), p: random(), z: Vec::new() };
    let mut worst = 0.0_f64;
    for (along, mut sweep) in sweeps {
        let mut general = Linearization::new(run.method(), n, m, run.rows());
        let ours = back(run, &mut *sweep, (&taken, &nodes), end.clone(), along);
        let other = back(run, &mut general, (&taken, &nodes), end.clone(), along);
        let off = [(&ours.a, &other.a), (&ours.b, &other.b)].map(|(x, y)| apart(x, y));
        worst = worst.max(off[0]).max(off[1]);
        worst = worst.max(apart(&ours.mu.concat(), &other.mu.concat()));
        if along == CostateTangents::OfBodies {
            for i in 0..2 {
                let of = |found: &Found| -> Vec<f64> {
                    found.rows.iter().flat_map(|own| own[i].clone()).collect()
                };
                worst = worst.max(apart(&of(&ours), &of(&other)));
            }
        }
    }
    Some(worst)
}

#[test]
fn of_random_trees() {
    let mut sample = Sample::new(5);
    let (mut worst, mut compared) = (0.0, 0);
    for seed in 0..120 {
        for loaded in [false, true] {
            // a length of a planar joint that is written from child to parent is no unknown:
            // what acts along it couples bodies
            if let Some(mut run) =
                random_mechanism(1 + seed as usize % 7, seed, (loaded, 0), second())
                && let Some(off) = difference(&mut run, &mut sample, 6)
            {
                assert!(off < 1e-11, "seed {seed}: {off:e}");
                (worst, compared) = (off.max(worst), compared + 1);
            }
        }
    }
    println!("sweeps and saddle points differ by {worst:.1e} at most on {compared} trees");
    assert!(compared > 180, "{compared}");
}

#[test]
fn of_random_trees_by_galerkin_steps() {
    let mut sample = Sample::new(8);
    let (mut worst, mut compared) = (0.0, 0);
    for seed in 0..60 {
        for loaded in [false, true] {
            let options = second().galerkin(Stages::new(1 + seed as usize % 4).unwrap());
            let bodies = 1 + seed as usize % 7;
            if let Some(mut run) = random_mechanism(bodies, seed, (loaded, 0), options)
                && let Some(off) = difference(&mut run, &mut sample, 4)
            {
                assert!(off < 3e-11, "seed {seed}, loaded {loaded}: {off:e}");
                (worst, compared) = (off.max(worst), compared + 1);
            }
        }
    }
    println!("eliminations and saddle points differ by {worst:.1e} at most on {compared} trees");
    assert!(compared > 90, "{compared}");
}

/// The defect of `a'·δq' + b'·δp̄' = a·δq + b·δp̄ + sources` over some steps, relative to
/// its terms: forward by the saddle point, backward by the sweep over links; `None` where there is
/// none.
fn defect(run: &mut MechanismIntegrator, sample: &mut Sample, steps: usize) -> Option<f64> {
    let (n, m) = (run.state().q.len(), run.constraints().len());
    let mut sweep = run.costate_sweep(CostateTangents::OfMechanism)?;
    let mut general = Linearization::new(run.method(), n, m, run.rows());
    let mut random = || (0..n).map(|_| sample.number()).collect::<Vec<f64>>();
    let (mut worst, mut tangent) = (0.0_f64, Tangent::zero(n, 0)); // which stays one
    for _ in 0..steps {
        let (p, mut points) = (run.state().p.clone(), Vec::<Interval>::new());
        run.step_with(&mut |_, _, taken| points.extend_from_slice(taken.points())).ok()?;
        let (system, mechanism) = (run.system(), run.constraints());
        general.linearize(system, mechanism, &points, &p).unwrap();
        tangent.p = random();
        let start = tangent.clone();
        general.clear_sources();
        let mut sources = Vec::new();
        for part in 0..general.parts() {
            let mut own = Sources::zero(n, m);
            if general.part(&points, part).0.has_forces() {
                (own.minus, own.plus) = (random(), random());
                general.add_sources(part, &own);
                sources.push(own);
            }
        }
        general.push(system, mechanism, &points, &mut tangent).unwrap();
        let mut costate = Costate { q: random(), p: random(), z: Vec::new() };
        let mut terms = vec![dot(&costate.q, &tangent.q), dot(&costate.p, &tangent.p)];
        sweep.pull(system, mechanism, &points, &p, &mut costate).unwrap();
        terms.extend([-dot(&costate.q, &start.q), -dot(&costate.p, &start.p)]);
        let mut sources = sources.iter();
        sweep.for_each_part(&points, &mut |_, _, costates| {
            let Sources { minus, plus, .. } = sources.next().unwrap();
            terms.extend([dot(minus, costates.step), -dot(plus, costates.momentum)]);
        });
        let size: f64 = terms.iter().map(|x| x.abs()).sum();
        worst = worst.max(terms.iter().sum::<f64>().abs() / size);
    }
    Some(worst)
}

#[test]
fn a_step_of_a_tree_backward_is_the_transposed_of_one_forward() {
    let mut sample = Sample::new(9);
    let (mut worst, mut compared) = (0.0_f64, 0);
    for seed in 0..60 {
        let options = second().galerkin(Stages::new(1 + seed as usize % 4).unwrap());
        let bodies = 1 + seed as usize % 5;
        if let Some(mut run) = random_mechanism(bodies, seed, (seed % 2 == 0, 0), options)
            && let Some(off) = defect(&mut run, &mut sample, 4)
        {
            assert!(off < 1e-13, "seed {seed}: {off:e}");
            (worst, compared) = (off.max(worst), compared + 1);
        }
    }
    println!("forward and backward differ by {worst:.1e} of their terms on {compared} trees");
    assert!(compared > 45, "{compared}");
}

/// Of the Jacobian at the start: near a singular configuration the saddle point loses digits.
fn least_singular_value(run: &MechanismIntegrator) -> f64 {
    let mechanism = run.constraints();
    let mut jacobian = DMatrix::zeros(mechanism.len(), mechanism.dim());
    mechanism.jacobian(0.0, &run.state().q, &mut jacobian);
    jacobian.singular_values().min()
}

#[test]
fn of_random_loops() {
    let mut sample = Sample::new(7);
    let (mut worst, mut compared) = (0.0, 0);
    for seed in 0..60 {
        for (loaded, kept) in [(false, 1), (true, 2), (false, 4)] {
            if let Some(mut run) =
                random_mechanism(2 + seed as usize % 6, seed, (loaded, kept), second())
                && least_singular_value(&run) > 0.01
                && let Some(off) = difference(&mut run, &mut sample, 6)
            {
                assert!(off < 1e-11, "seed {seed}, {kept} distances: {off:e}");
                (worst, compared) = (off.max(worst), compared + 1);
            }
        }
    }
    println!("with loops they differ by {worst:.1e} at most on {compared} mechanisms");
    assert!(compared > 100, "{compared}");
}

#[test]
fn of_random_loops_by_galerkin_steps() {
    let mut sample = Sample::new(10);
    let (mut worst, mut compared) = (0.0, 0);
    for seed in 0..60 {
        for (loaded, kept) in [(false, 1), (true, 2), (false, 4)] {
            let options = second().galerkin(Stages::new(1 + seed as usize % 3).unwrap());
            if let Some(mut run) =
                random_mechanism(2 + seed as usize % 4, seed, (loaded, kept), options)
                && !run.constraints().description().joints.is_empty() // nothing presses else
                && least_singular_value(&run) > 0.01
                && let Some(off) = difference(&mut run, &mut sample, 4)
            {
                assert!(off < 1e-10, "seed {seed}, {kept} distances: {off:e}");
                (worst, compared) = (off.max(worst), compared + 1);
            }
        }
    }
    println!(
        "null spaces and saddle points differ by {worst:.1e} at most on {compared} mechanisms"
    );
    assert!(compared > 80, "{compared}");
}

#[test]
fn of_chosen_mechanisms_and_compositions() {
    let mut sample = Sample::new(6);
    let subjects: [fn() -> Subject; 3] = [pendulum, conservative, four_bar];
    for subject in subjects {
        for composition in [Composition::Identity, Composition::KahanLi9] {
            let subject = subject();
            if composition != Composition::Identity && subject.name != "conservative" {
                continue; // no dampers backwards
            }
            let (mut run, controls, _) = run(subject, SchemeKind::Nodal, composition, 4);
            controls.set(2);
            let off = difference(&mut run, &mut sample, 4).expect("a tree of bodies");
            assert!(off < 1e-12, "{off:e}");
        }
    }
    // bodies that springs couple, laws with states
    let others: [fn() -> Subject; 2] = [spatial, remembering];
    for subject in others {
        let (run, ..) = run(subject(), SchemeKind::Nodal, Composition::Identity, 1);
        assert!(run.costate_sweep(CostateTangents::OfMechanism).is_none());
    }
}
