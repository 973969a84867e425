//! Time of a step against the number of bodies, or of elements of a beam: chains, binary trees,
//! chains with four-bar linkages (eight of them, or one on every link), windows of four-bar
//! linkages side by side, point masses on bars.
//!
//! The exponent is that of the least-squares line through `log(time)` over `log(bodies)` from 16
//! bodies on. Trees are solved in linear time; loops add the sparse complement of each cluster that
//! they form. The motion goes to and fro over 64 steps, so that every sample sees the same
//! configurations; the fastest of five rounds of whole periods counts, since the first steps after
//! a reversal need more Newton iterations.
#![allow(clippy::unwrap_used, missing_docs)] // a bench; criterion's macro makes public items

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use holonom::nalgebra::Vector3;
use holonom::vi_beam::model::{BeamModel, StrainRule};
use holonom::vi_beam::{BeamMesh, FrameRule, Section};
use holonom::vi_constraints::{InitialValues, Options, SchemeKind};
use holonom::vi_multibody::builder::{BodyId, Inertia, MechanismBuilder};
use holonom::vi_multibody::joint_coordinate::JointCoordinate;
use holonom::vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use holonom::vi_multibody::scalar_constraint::ScalarConstraint;
use holonom::vi_multibody::{FrameId, PairKind};
use holonom::vi_rigid::Shape;
use std::time::{Duration, Instant};

const REVERSAL: u64 = 64;
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

fn options() -> Options {
    Options::new(SchemeKind::Nodal, 0.001)
}

fn run(builder: &MechanismBuilder) -> MechanismIntegrator {
    builder.build().unwrap().integrator(options()).unwrap()
}

/// Straight links along x, link `i` carried by `parent(i)`, hinge axes `y` or `z`; some with a
/// four-bar linkage.
fn links(
    n: usize,
    parent: impl Fn(usize) -> Option<usize>,
    level: impl Fn(usize) -> usize,
    has_loop: impl Fn(usize) -> bool,
) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity(GRAVITY);
    let bar = Inertia::shape_of_mass(Shape::Box { lengths: [1.0, 0.1, 0.1] }, 1.0);
    // end: x, velocity; ω
    let mut state: Vec<(BodyId, f64, Vector3<f64>, Vector3<f64>)> = Vec::new();
    for i in 0..n {
        let carrier = parent(i).map(|p| state[p]);
        let (frame, x, v, w) = match carrier {
            Some((body, x, v, w)) => (body.into(), x, v, w),
            None => (FrameId::Ground, 0.0, Vector3::zeros(), Vector3::zeros()),
        };
        let axis: Vector3<f64> =
            if level(i).is_multiple_of(2) { Vector3::y() } else { Vector3::z() };
        // absolute rates of +-0.05 rad/s
        let size = if i < 2 { 0.05 } else { 0.1 };
        let sign = if (i / 2).is_multiple_of(2) { size } else { -size };
        let w: Vector3<f64> = w + sign * axis;
        let half: Vector3<f64> = w.cross(&(0.5 * Vector3::x()));
        let center: Vector3<f64> = v + half;
        let link = builder.body(&format!("b{i}"), bar).at([x + 0.5, 0.0, 0.0]);
        let link = link.velocity(center).angular_velocity(w).id();
        let hinge = builder.joint(&format!("j{i}"), PairKind::Revolute, frame, link);
        hinge.at([x, 0.0, 0.0]).axis(axis);
        if has_loop(i) {
            linkage(&mut builder, link, x + 0.5, (center, w));
        }
        state.push((link, x + 1.0, center + half, w));
    }
    run(&builder)
}

/// A rectangle of three bars that stands on the middle of a link and moves with it.
fn linkage(
    builder: &mut MechanismBuilder,
    link: BodyId,
    x: f64,
    (v, w): (Vector3<f64>, Vector3<f64>),
) {
    let mut bar = |dx: f64, y: f64, moments| {
        let velocity: Vector3<f64> = v + w.cross(&Vector3::new(dx, y, 0.0));
        let bar = builder.body("bar", Inertia::principal(0.1, moments)).at([x + dx, y, 0.0]);
        bar.velocity(velocity).angular_velocity(w).id()
    };
    let [left, right] = [-0.2, 0.2].map(|dx| bar(dx, 0.15, [1e-3, 1e-4, 1e-3]));
    let top = bar(0.0, 0.3, [1e-4, 1e-3, 1e-3]);
    for (parent, child, dx, y) in [
        (link, left, -0.2, 0.0),
        (link, right, 0.2, 0.0),
        (left, top, -0.2, 0.3),
        (right, top, 0.2, 0.3),
    ] {
        builder.joint("hinge", PairKind::Revolute, parent, child).at([x + dx, y, 0.0]).axis(Z);
    }
}

/// Links around a square, again and again, hinge axes `z` and `x`, without gravity. Directions and
/// rates repeat every 16 links so that their forces balance: what a link does depends on its
/// neighbours, not on how many there are.
fn chain(n: usize) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new();
    let sides = [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y()];
    let bars = [[1.0, 0.1, 0.1], [0.1, 1.0, 0.1]]
        .map(|lengths| Inertia::shape_of_mass(Shape::Box { lengths }, 1.0));
    let sign = |period: usize, i: usize| if (i / period).is_multiple_of(2) { 1.0 } else { -1.0 };
    let (mut start, mut v) = (Vector3::<f64>::zeros(), Vector3::<f64>::zeros());
    let mut last = FrameId::Ground;
    for i in 0..n {
        let (axis, half) =
            (if i % 2 == 0 { Vector3::z() } else { Vector3::x() }, 0.5 * sides[i % 4]);
        let about_x = i.checked_sub(1).map_or(0.0, |i| sign(4, i) * sign(8, i));
        let w: Vector3<f64> = 0.05 * Vector3::new(about_x, 0.0, sign(4, i));
        let center: Vector3<f64> = start + half;
        let of_center: Vector3<f64> = v + w.cross(&half);
        let link = builder.body(&format!("b{i}"), bars[i % 2]).at([center.x, center.y, 0.0]);
        let link = link.velocity(of_center).angular_velocity(w).id();
        let hinge = builder.joint(&format!("j{i}"), PairKind::Revolute, last, link);
        hinge.at([start.x, start.y, 0.0]).axis(axis);
        (start, v, last) = (center + half, of_center + w.cross(&half), link.into());
    }
    run(&builder)
}

/// In one line: the ends of turning links pull towards the first hinge, the tension there grows
/// with the square of their number, and so do frequencies, and from 1024 links on Newton
/// iterations.
fn straight_chain(n: usize) -> MechanismIntegrator {
    links(n, |i| i.checked_sub(1), |i| i, |_| false)
}

fn eight_loops(n: usize) -> MechanismIntegrator {
    links(n, |i| i.checked_sub(1), |i| i, |i| (8 * i) / n != (8 * (i + 1)) / n)
}

fn looped_chain(n: usize) -> MechanismIntegrator {
    links(n, |i| i.checked_sub(1), |i| i, |_| true)
}

fn binary_tree(n: usize) -> MechanismIntegrator {
    let level = |i: usize| (i + 1).ilog2() as usize + i;
    links(n, |i| i.checked_sub(1).map(|k| k / 2), level, |_| false)
}

/// `2 n + 1` bars; see the shipped model `four_bar_windows`.
fn windows(n: usize) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
    let crank = Inertia::principal(1.0, [0.1, 0.01, 0.1]);
    let coupler = Inertia::principal(1.0, [0.01, 0.1, 0.1]);
    let mut bar = |inertia: Inertia, x: f64, y: f64, [v, w]: [f64; 2]| {
        let bar = builder.body("bar", inertia).at([x, y, 0.0]).velocity([v, 0.0, 0.0]);
        bar.angular_velocity([0.0, 0.0, w]).id()
    };
    let cranks: Vec<BodyId> = (0..=n).map(|i| bar(crank, i as f64, 0.5, [0.5, -1.0])).collect();
    let couplers: Vec<BodyId> =
        (1..=n).map(|i| bar(coupler, i as f64 - 0.5, 1.0, [1.0, 0.0])).collect();
    let mut hinge = |parent: FrameId, child: BodyId, x: f64, y: f64| {
        builder.joint("hinge", PairKind::Revolute, parent, child).at([x, y, 0.0]).axis(Z);
    };
    for (i, crank) in cranks.iter().enumerate() {
        hinge(FrameId::Ground, *crank, i as f64, 0.0);
    }
    for (i, coupler) in couplers.iter().enumerate() {
        hinge(cranks[i].into(), *coupler, i as f64, 1.0);
        hinge((*coupler).into(), cranks[i + 1], (i + 1) as f64, 1.0);
    }
    run(&builder)
}

/// Point masses on a chain of bars, the first held by the ground.
fn bars(n: usize) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity(GRAVITY);
    let mut last = None;
    for i in 0..n {
        let x = [i as f64 + 1.0, 0.0, 0.0];
        let point = builder.particle("point", 1.0, x, [0.0; 3]);
        match last {
            Some(last) => builder.bar("bar", last, point),
            None => builder.bar("bar", [0.0; 3], point),
        }
        last = Some(point);
    }
    run(&builder)
}

/// Point masses on bars to one of them.
fn bars_to_a_hub(n: usize) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity(GRAVITY);
    let hub = builder.particle("hub", 1.0, [0.0; 3], [0.0; 3]);
    for i in 1..n {
        let (sin, cos) = (6.0 * i as f64 / n as f64).sin_cos();
        let point = builder.particle("point", 1.0, [cos, sin, 0.0], [-0.1 * sin, 0.1 * cos, 0.0]);
        builder.bar("bar", hub, point);
    }
    run(&builder)
}

/// A beam of elements 0.1 m long; returns its first node.
fn beam_model(n: usize) -> (BeamModel, usize) {
    let mut model = BeamModel::new(GRAVITY.into());
    let section = Section::new([1e3, 1e3, 1e3, 10.0, 10.0, 10.0], [1.0, 0.1, 0.1, 0.0]).unwrap();
    let (end, rule) = (0.1 * n as f64 * Vector3::x(), FrameRule::Normal(Vector3::z()));
    let mesh = BeamMesh::straight(Vector3::zeros(), end, n, rule).unwrap();
    let beam = model.add_beam("beam", &mesh, section).unwrap();
    (model, beam.nodes.start)
}

fn run_beam(model: &BeamModel) -> MechanismIntegrator {
    let mechanism = model.mechanism();
    let system = model.system(&mechanism, StrainRule::Averaged);
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    integrator(mechanism, system, options(), Solver::Auto, InitialValues::new(0.0, &q, &v)).unwrap()
}

/// Free, in gravity.
fn beam(n: usize) -> MechanismIntegrator {
    run_beam(&beam_model(n).0)
}

/// With its start clamped.
fn cantilever(n: usize) -> MechanismIntegrator {
    let (mut model, start) = beam_model(n);
    model.clamp(start);
    run_beam(&model)
}

/// With its start on a driven hinge: a loop for the solver.
fn driven_beam(n: usize) -> MechanismIntegrator {
    let (mut model, start) = beam_model(n);
    let hub = model.join(PairKind::Revolute, None, start, &Vector3::zeros(), &Vector3::z());
    let angle = JointCoordinate::principal(&model.description.joints[hub], 0).unwrap();
    let reference = std::sync::Arc::new(|t: f64| [0.05 * t * t, 0.1 * t, 0.1]);
    model.description.scalars.push(ScalarConstraint::motion("drive", angle, reference));
    run_beam(&model)
}

/// Takes `count` steps, reversing every `REVERSAL`; the time and all Newton iterations.
fn steps(run: &mut MechanismIntegrator, taken: &mut u64, count: u64) -> (Duration, usize) {
    let (begin, mut iterations) = (Instant::now(), 0);
    for _ in 0..count {
        if *taken > 0 && taken.is_multiple_of(REVERSAL) {
            run.reverse();
        }
        iterations += run.step().unwrap().iterations;
        *taken += 1;
    }
    (begin.elapsed(), iterations)
}

/// Seconds and Newton iterations of a step: those of the fastest of a few rounds.
fn fastest(run: &mut MechanismIntegrator, taken: &mut u64, count: u64) -> (f64, f64) {
    let round = |_| {
        let (time, iterations) = steps(run, taken, count);
        (time.as_secs_f64() / count as f64, iterations as f64 / count as f64)
    };
    (0..5).map(round).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

/// Slope of the least-squares line through `(log n, log t)`.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(n, t)| (n.ln(), t.ln())).collect();
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let above: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    above / logs.iter().map(|p| (p.0 - x) * (p.0 - x)).sum::<f64>()
}

fn growth(criterion: &mut Criterion) {
    let quick = std::env::args().any(|a| a == "--test");
    let families: [(&str, fn(usize) -> MechanismIntegrator, fn(usize) -> usize, &[usize]); 11] = [
        ("chain", chain, |n| n, &[1, 4, 16, 64, 256, 1024, 4096]),
        ("straight_chain", straight_chain, |n| n, &[1, 4, 16, 64, 256, 1024, 4096]),
        ("binary_tree", binary_tree, |n| n, &[1, 3, 15, 63, 255, 1023, 4095]),
        ("eight_loops", eight_loops, |n| n + 24, &[8, 16, 64, 256, 1024]),
        ("looped_chain", looped_chain, |n| 4 * n, &[1, 2, 4, 16, 64, 256]),
        ("bars", bars, |n| n, &[1, 4, 16, 64, 256, 1024, 4096]),
        ("bars_to_a_hub", bars_to_a_hub, |n| n, &[2, 4, 16, 64, 256, 1024, 4096]),
        ("beam", beam, |n| n, &[1, 4, 16, 64, 256, 1000]),
        ("cantilever", cantilever, |n| n, &[1, 4, 16, 64, 256, 1000]),
        ("driven_beam", driven_beam, |n| n, &[1, 4, 16, 64, 256, 1000]),
        ("windows", windows, |n| 2 * n + 1, &[1, 2, 8, 16, 32, 64, 128, 256, 512, 1024, 2048]),
    ];
    for (name, start, bodies, sizes) in families {
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10).measurement_time(Duration::from_secs(1));
        group.warm_up_time(Duration::from_millis(200));
        let mut points = Vec::new();
        for &n in if quick { &sizes[..3] } else { sizes } {
            let begin = Instant::now();
            let mut run = start(n);
            let set_up = begin.elapsed().as_secs_f64();
            let (mut taken, count) = (0, bodies(n));
            group.throughput(Throughput::Elements(count as u64));
            group.bench_function(BenchmarkId::from_parameter(count), |bencher| {
                bencher.iter_custom(|count| steps(&mut run, &mut taken, count).0);
            });
            if !quick {
                let periods = (20_000 / count as u64).clamp(REVERSAL, 2000) / REVERSAL;
                let (time, iterations) = fastest(&mut run, &mut taken, periods * REVERSAL);
                points.push((count as f64, time));
                println!(
                    "{name}, {count} bodies: {:.2} µs a step, {:.3} µs a body, {iterations:.2} Newton \
                     iterations (set-up {set_up:.3} s)",
                    1e6 * time,
                    1e6 * time / count as f64
                );
            }
        }
        group.finish();
        points.retain(|p| p.0 >= 15.0);
        if points.len() > 1 {
            let (first, last) = (points[0].0, points[points.len() - 1].0);
            println!("{name}: time ~ bodies^{:.2} from {first} to {last}", exponent(&points));
        }
    }
}

criterion_group!(benches, growth);
criterion_main!(benches);
