//! Work for a precision of the Galerkin schemes beside compositions: the chain `chain-rev-8` over a second, the heavy top
//! over ten seconds.
//!
//! Each run has a line: time, error of the end, iterations a step, nanoseconds a body and iteration. The last lines of a
//! model are the least times with errors below 1e-4, 1e-6 and 1e-8. The least time of the rounds counts, and each round runs
//! all methods.
#![allow(clippy::unwrap_used)] // a bench

use holonom::vi_constraints::{Options, SchemeKind};
use holonom::vi_core::Composition;
use holonom::vi_core::galerkin::Stages;
use holonom::vi_multibody::builder::{Inertia, MechanismBuilder};
use holonom::vi_multibody::run::MechanismIntegrator;
use holonom::vi_multibody::{FrameId, PairKind};
use holonom::vi_rigid::Shape;
use std::time::Instant;

const ERRORS: [f64; 3] = [1e-4, 1e-6, 1e-8];

/// A model: its builder, its bodies, the end, the point that is compared and where it is then.
struct Case {
    name: &'static str,
    builder: fn() -> MechanismBuilder,
    bodies: usize,
    end: f64,
    point: [f64; 3], // of the last body, in its directors
    exact: [f64; 3],
    counts: &'static [u32],
}

const CASES: [Case; 2] = [
    Case {
        name: "chain-rev-8",
        builder: chain,
        bodies: 8,
        end: 1.0,
        point: [0.5, 0.0, 0.0],
        exact: [4.086_210_757_198, -0.893_891_357_675, -6.337_916_339_015],
        counts: &[7, 10, 14, 20, 28, 40, 80, 160, 320],
    },
    Case {
        name: "heavy-top",
        builder: top,
        bodies: 1,
        end: 10.0,
        point: [0.0; 3],
        exact: [-0.102_307_757_820, 0.286_070_018_166, -0.952_731_372_107],
        counts: &[140, 200, 280, 400, 800, 1600, 3200],
    },
];

fn chain() -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let bar = Inertia::shape_of_mass(Shape::Box { lengths: [1.0, 0.1, 0.1] }, 1.0);
    let mut parent = FrameId::Ground;
    for i in 0..8 {
        let link = builder.body(&format!("b{i}"), bar).at([f64::from(i) + 0.5, 0.0, 0.0]).id();
        let (axis, rate) =
            if i % 2 == 0 { ([0.0, 1.0, 0.0], 0.1) } else { ([0.0, 0.0, 1.0], -0.1) };
        let hinge = builder.joint(&format!("j{i}"), PairKind::Revolute, parent, link);
        hinge.at([f64::from(i), 0.0, 0.0]).axis(axis).rate(rate);
        parent = link.into();
    }
    builder
}

fn top() -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let (sine, cosine) = 0.3_f64.sin_cos();
    let top = builder.body("top", Inertia::principal(1.0, [0.1, 0.1, 0.05]));
    let top = top.at([0.0, -sine, cosine]).rotation_vector([0.3, 0.0, 0.0]);
    let top = top.angular_velocity([0.0, -20.0 * sine, 20.0 * cosine]).id();
    builder.joint("tip", PairKind::Spherical, FrameId::Ground, top).at([0.0; 3]);
    builder
}

/// Method and order.
fn methods() -> Vec<(String, Box<dyn Fn(f64) -> Options>)> {
    let mut methods: Vec<(String, Box<dyn Fn(f64) -> Options>)> = Vec::new();
    for stages in [2, 3, 4, 6, 8].map(|s| Stages::new(s).unwrap()) {
        let options = move |h| Options::new(SchemeKind::Nodal, h).galerkin(stages);
        methods.push((format!("Galerkin {}", stages.order()), Box::new(options)));
    }
    for order in [2, 4, 6, 8] {
        let composition = Composition::of_order(order).unwrap();
        let options = move |h| Options::new(SchemeKind::Nodal, h).composition(composition);
        methods.push((format!("composition {order}"), Box::new(options)));
    }
    methods
}

/// Seconds, error of the end and iterations; `None` where a step is refused.
fn run(case: &Case, options: Options, count: u32) -> Option<(f64, f64, usize)> {
    let mut run: MechanismIntegrator =
        (case.builder)().build().unwrap().integrator(options).unwrap();
    let (begin, mut iterations) = (Instant::now(), 0);
    for _ in 0..count {
        iterations += run.step().ok()?.iterations;
    }
    let time = begin.elapsed().as_secs_f64();
    let last = &run.state().q[12 * (case.bodies - 1)..];
    let at = |i: usize| (0..3).map(|k| case.point[k] * last[3 + 3 * k + i]).sum::<f64>() + last[i];
    let error = (0..3).map(|i| (at(i) - case.exact[i]).powi(2)).sum::<f64>().sqrt();
    Some((time, error, iterations))
}

fn main() {
    let quick = std::env::args().any(|a| a == "--test");
    let methods = methods();
    for case in CASES {
        let counts = if quick { &case.counts[..2] } else { case.counts };
        let mut best = vec![(f64::INFINITY, f64::NAN, 0); methods.len() * counts.len()];
        for _ in 0..if quick { 1 } else { 5 } {
            for (k, best) in best.iter_mut().enumerate() {
                let (method, count) = (&methods[k / counts.len()].1, counts[k % counts.len()]);
                let found = run(&case, method(case.end / f64::from(count)), count);
                if let Some((time, error, iterations)) = found {
                    *best = (best.0.min(time), error, iterations);
                }
            }
        }
        for ((name, _), runs) in methods.iter().zip(best.chunks_exact(counts.len())) {
            for (&(time, error, iterations), count) in runs.iter().zip(counts) {
                let each = 1e9 * time / iterations as f64 / case.bodies as f64;
                println!(
                    "{}, {name}, {count} steps: {:.4} ms, error {error:.1e}, {:.1} iterations a step, {each:.0} ns a body",
                    case.name,
                    1e3 * time,
                    iterations as f64 / f64::from(*count),
                );
            }
        }
        for ((name, _), runs) in methods.iter().zip(best.chunks_exact(counts.len())) {
            let least = ERRORS.map(|bound| {
                let enough = runs.iter().filter(|run| run.1 <= bound).map(|run| run.0);
                enough.reduce(f64::min).map_or("-".into(), |time| format!("{:.4}", 1e3 * time))
            });
            println!("{}, {name}: {} ms to 1e-4 / 1e-6 / 1e-8", case.name, least.join(" / "));
        }
    }
}
