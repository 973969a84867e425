//! Time of a step against the number of bodies, or of elements of a beam: chains, binary trees, chains that carry four-bar
//! linkages (eight of them, or one on every link), windows of four-bar linkages side by side.
//!
//! The exponent is that of the least-squares line through `log(time)` over `log(bodies)` from 16 bodies
//! on. Trees are solved in linear time; loops add the sparse complement of each cluster that they form.
//! The motion goes to and fro over 64 steps, so that every sample sees the same configurations.
#![allow(clippy::unwrap_used, missing_docs)] // a bench; criterion's macro makes public items

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use holonom::{Model, Simulation};
use nalgebra::Vector3;
use std::fmt::Write;
use std::time::{Duration, Instant};

const TURN: u64 = 64;
const BOX: &str = "shape = { type = \"box\", dimensions = [1.0, 0.1, 0.1] }";

fn header(gravity: [f64; 3]) -> String {
    format!(
        "[model]\nname = \"growth\"\ngravity = {gravity:?}\n[simulation]\nstep = 0.001\nend = 1.0\n"
    )
}

/// Straight links along x, link `i` carried by `parent(i)`, hinge axes `y` or `z`; some carry a four-bar
/// linkage.
fn links(
    n: usize,
    parent: impl Fn(usize) -> Option<usize>,
    level: impl Fn(usize) -> usize,
    carries: impl Fn(usize) -> bool,
) -> String {
    let mut text = header([0.0, 0.0, -9.81]);
    let mut state: Vec<(f64, Vector3<f64>, Vector3<f64>)> = Vec::new(); // end: x, velocity; ω
    for i in 0..n {
        let zero = (0.0, Vector3::zeros(), Vector3::zeros());
        let (x, v, w) = parent(i).map_or(zero, |p| state[p]);
        let axis: Vector3<f64> =
            if level(i).is_multiple_of(2) { Vector3::y() } else { Vector3::z() };
        let sign = if (i / 2).is_multiple_of(2) { 0.1 } else { -0.1 };
        let w: Vector3<f64> = w + sign * axis;
        let half: Vector3<f64> = w.cross(&(0.5 * Vector3::x()));
        let center: Vector3<f64> = v + half;
        write!(
            text,
            "[[body]]\nname = \"b{i}\"\nmass = 1.0\n{BOX}\nposition = [{:?}, 0.0, 0.0]\nvelocity = \
             {:?}\nangular_velocity = {:?}\n[[joint]]\nname = \"j{i}\"\ntype = \"revolute\"\nparent = \
             \"{}\"\nchild = \"b{i}\"\nposition = [{x:?}, 0.0, 0.0]\naxis = {:?}\n",
            x + 0.5,
            center.as_slice(),
            w.as_slice(),
            parent(i).map_or_else(|| "ground".to_owned(), |p| format!("b{p}")),
            axis.as_slice(),
        )
        .unwrap();
        if carries(i) {
            linkage(&mut text, i, x + 0.5, (center, w));
        }
        state.push((x + 1.0, center + half, w));
    }
    text
}

/// A rectangle of three bars that stands on the middle of link `i` and moves with it.
fn linkage(text: &mut String, i: usize, x: f64, (v, w): (Vector3<f64>, Vector3<f64>)) {
    let bars = [("left", -0.2, 0.15, true), ("right", 0.2, 0.15, true), ("top", 0.0, 0.3, false)];
    for (name, dx, y, upright) in bars {
        let inertia = if upright { [1e-3, 1e-4, 1e-3] } else { [1e-4, 1e-3, 1e-3] };
        let velocity: Vector3<f64> = v + w.cross(&Vector3::new(dx, y, 0.0));
        write!(
            text,
            "[[body]]\nname = \"{name}{i}\"\nmass = 0.1\ninertia = {inertia:?}\nposition = [{:?}, {y:?}, \
             0.0]\nvelocity = {:?}\nangular_velocity = {:?}\n",
            x + dx,
            velocity.as_slice(),
            w.as_slice()
        )
        .unwrap();
    }
    for (parent, child, dx, y) in [
        ("b", "left", -0.2, 0.0),
        ("b", "right", 0.2, 0.0),
        ("left", "top", -0.2, 0.3),
        ("right", "top", 0.2, 0.3),
    ] {
        write!(
            text,
            "[[joint]]\nname = \"{parent}_{child}{i}\"\ntype = \"revolute\"\nparent = \"{parent}{i}\"\n\
             child = \"{child}{i}\"\nposition = [{:?}, {y:?}, 0.0]\naxis = [0.0, 0.0, 1.0]\n",
            x + dx
        )
        .unwrap();
    }
}

fn chain(n: usize) -> String {
    links(n, |i| i.checked_sub(1), |i| i, |_| false)
}

fn eight_loops(n: usize) -> String {
    links(n, |i| i.checked_sub(1), |i| i, |i| (8 * i) / n != (8 * (i + 1)) / n)
}

fn looped_chain(n: usize) -> String {
    links(n, |i| i.checked_sub(1), |i| i, |_| true)
}

fn binary_tree(n: usize) -> String {
    let level = |i: usize| (i + 1).ilog2() as usize + i;
    links(n, |i| i.checked_sub(1).map(|k| k / 2), level, |_| false)
}

/// `2 n + 1` bars; see the shipped model `four_bar_windows`.
fn windows(n: usize) -> String {
    let mut text = header([0.0, -9.81, 0.0]);
    let mut body = |name: String, [x, y]: [f64; 2], upright: bool| {
        let inertia = if upright { "[0.1, 0.01, 0.1]" } else { "[0.01, 0.1, 0.1]" };
        let (v, w) = if upright { (0.5, -1.0) } else { (1.0, 0.0) };
        write!(
            text,
            "[[body]]\nname = \"{name}\"\nmass = 1.0\ninertia = {inertia}\nposition = [{x:?}, {y:?}, \
             0.0]\nvelocity = [{v:?}, 0.0, 0.0]\nangular_velocity = [0.0, 0.0, {w:?}]\n"
        )
        .unwrap();
    };
    for i in 0..=n {
        body(format!("crank{i}"), [i as f64, 0.5], true);
    }
    for i in 1..=n {
        body(format!("coupler{i}"), [i as f64 - 0.5, 1.0], false);
    }
    let mut joint = |name: String, parent: String, child: String, [x, y]: [f64; 2]| {
        write!(
            text,
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \
             \"{child}\"\nposition = [{x:?}, {y:?}, 0.0]\naxis = [0.0, 0.0, 1.0]\n"
        )
        .unwrap();
    };
    for i in 0..=n {
        joint(format!("foot{i}"), "ground".into(), format!("crank{i}"), [i as f64, 0.0]);
    }
    for i in 1..=n {
        let (left, right) = ([i as f64 - 1.0, 1.0], [i as f64, 1.0]);
        joint(format!("left{i}"), format!("crank{}", i - 1), format!("coupler{i}"), left);
        joint(format!("right{i}"), format!("coupler{i}"), format!("crank{i}"), right);
    }
    text
}

/// A beam of elements 0.1 m long, turning and bending.
fn beam(n: usize) -> String {
    let section = "{ EA = 1e3, GA1 = 1e3, GA2 = 1e3, EI1 = 10.0, EI2 = 10.0, GJ = 10.0, rhoA = 1.0, rhoI1 = 0.1, \
                   rhoI2 = 0.1 }";
    header([0.0, 0.0, -9.81])
        + &format!(
            "[[beam]]\nname = \"beam\"\npoints = [[0.0, 0.0, 0.0], [{:?}, 0.0, 0.0]]\nelements = {n}\nsection = \
             {section}\n",
            0.1 * n as f64
        )
}

/// The same with its start clamped.
fn cantilever(n: usize) -> String {
    beam(n) + "start = \"clamped\"\n"
}

/// The same with its start on a driven hinge: a loop for the solver.
fn driven_beam(n: usize) -> String {
    beam(n)
        + "[[joint]]\nname = \"hub\"\ntype = \"revolute\"\nparent = \"ground\"\nchild = \"beam.start\"\nposition = \
           [0.0, 0.0, 0.0]\naxis = [0.0, 0.0, 1.0]\n[[constraint]]\nname = \"drive\"\ntype = \"motion\"\njoint = \
           \"hub\"\npath = { acceleration = 0.1 }\n"
}

/// Takes `count` steps, turning back every `TURN`.
fn steps(simulation: &mut Simulation, taken: &mut u64, count: u64) -> Duration {
    let begin = Instant::now();
    for _ in 0..count {
        if *taken > 0 && taken.is_multiple_of(TURN) {
            simulation.integrator().reverse();
        }
        simulation.integrator().step().unwrap();
        *taken += 1;
    }
    begin.elapsed()
}

/// Seconds for a step: the fastest of a few rounds.
fn seconds(simulation: &mut Simulation, taken: &mut u64, rounds: u32, count: u64) -> f64 {
    (0..rounds)
        .map(|_| steps(simulation, taken, count).as_secs_f64() / count as f64)
        .fold(f64::INFINITY, f64::min)
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
    let families: [(&str, fn(usize) -> String, fn(usize) -> usize, &[usize]); 8] = [
        ("chain", chain, |n| n, &[1, 4, 16, 64, 256, 1024, 4096]),
        ("binary_tree", binary_tree, |n| n, &[1, 3, 15, 63, 255, 1023, 4095]),
        ("eight_loops", eight_loops, |n| n + 24, &[8, 16, 64, 256, 1024]),
        ("looped_chain", looped_chain, |n| 4 * n, &[1, 2, 4, 16, 64, 256]),
        ("beam", beam, |n| n, &[1, 4, 16, 64, 256, 1000]),
        ("cantilever", cantilever, |n| n, &[1, 4, 16, 64, 256, 1000]),
        ("driven_beam", driven_beam, |n| n, &[1, 4, 16, 64, 256, 1000]),
        ("windows", windows, |n| 2 * n + 1, &[1, 2, 8, 16, 32, 64, 128, 256]),
    ];
    for (name, text, bodies, sizes) in families {
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10).measurement_time(Duration::from_secs(1));
        group.warm_up_time(Duration::from_millis(200));
        let mut points = Vec::new();
        for &n in if quick { &sizes[..3] } else { sizes } {
            let model = Model::from_toml(&text(n)).unwrap();
            let begin = Instant::now();
            let mut simulation = Simulation::new(&model).unwrap();
            let set_up = begin.elapsed().as_secs_f64();
            let (mut taken, count) = (0, bodies(n));
            group.throughput(Throughput::Elements(count as u64));
            group.bench_function(BenchmarkId::from_parameter(count), |bencher| {
                bencher.iter_custom(|iterations| steps(&mut simulation, &mut taken, iterations));
            });
            if !quick {
                let time =
                    seconds(&mut simulation, &mut taken, 5, (20_000 / count as u64).clamp(4, 2000));
                points.push((count as f64, time));
                println!(
                    "{name}, {count} bodies: {:.2} µs a step, {:.3} µs a body (set-up {set_up:.3} s)",
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
