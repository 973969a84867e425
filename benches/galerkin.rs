//! Work for a precision of the Galerkin schemes beside compositions: the chain `chain-rev-8` over a
//! second, the heavy top over ten seconds, Bricard's mechanism over nine, the flying beam with 20
//! elements over five.
//!
//! Each run has a line: time, error of the end, iterations a step, nanoseconds a body and
//! iteration. The last lines of a model are the least times with errors below 1e-4, 1e-6 and 1e-8.
//! The least time of the rounds counts, and each round runs all methods.
#![allow(clippy::unwrap_used)] // a bench

use holonom::vi_constraints::{Options, SchemeKind};
use holonom::vi_core::Composition;
use holonom::vi_core::galerkin::Stages;
use holonom::vi_multibody::builder::{Inertia, MechanismBuilder};
use holonom::vi_multibody::run::MechanismIntegrator;
use holonom::vi_multibody::{FrameId, PairKind};
use holonom::vi_rigid::Shape;
use holonom::{Model, Override, Simulation};
use std::time::Instant;

const ERRORS: [f64; 3] = [1e-4, 1e-6, 1e-8];

/// A model: how it starts, its bodies or nodes, the end, the point that is compared and where it is
/// then.
struct Case {
    name: &'static str,
    start: fn(Method, f64) -> Running,
    bodies: usize,
    end: f64,
    frame: usize,
    point: [f64; 3],         // of the frame, in its directors
    exact: Option<[f64; 3]>, // none: by order 16 with the largest number of steps
    counts: &'static [u32],
}

const CASES: [Case; 4] = [
    Case {
        name: "chain-rev-8",
        start: |method, h| bare(chain(), method, h),
        bodies: 8,
        end: 1.0,
        frame: 7,
        point: [0.5, 0.0, 0.0],
        exact: Some([4.086_210_757_198, -0.893_891_357_675, -6.337_916_339_015]),
        counts: &[7, 10, 14, 20, 28, 40, 80, 160, 320],
    },
    Case {
        name: "heavy-top",
        start: |method, h| bare(top(), method, h),
        bodies: 1,
        end: 10.0,
        frame: 0,
        point: [0.0; 3],
        exact: Some([-0.102_307_757_820, 0.286_070_018_166, -0.952_731_372_107]),
        counts: &[140, 200, 280, 400, 800, 1600, 3200],
    },
    Case {
        name: "bricard",
        start: |method, h| shipped(include_str!("../examples/models/bricard.toml"), method, h),
        bodies: 5,
        end: 9.0,
        frame: 2,
        point: [0.0, 0.0, 0.5],
        exact: Some([0.539_064_288, -1.638_453_308, 0.157_735_378]),
        counts: &[45, 90, 180, 360, 720, 1440],
    },
    Case {
        name: "flying-beam-20",
        start: |method, h| shipped(include_str!("../examples/models/flying_beam.toml"), method, h),
        bodies: 21,
        end: 5.0,
        frame: 20,
        point: [0.0; 3],
        exact: None,
        counts: &[100, 200, 400, 800, 1600, 3200],
    },
];

/// A running model.
enum Running {
    Bare(Box<MechanismIntegrator>),
    Model(Box<Simulation>),
}

impl Running {
    fn integrator(&mut self) -> &mut MechanismIntegrator {
        match self {
            Self::Bare(run) => run,
            Self::Model(simulation) => simulation.integrator(),
        }
    }
}

fn bare(builder: MechanismBuilder, method: Method, h: f64) -> Running {
    Running::Bare(Box::new(builder.build().unwrap().integrator(method.options(h)).unwrap()))
}

/// A shipped model.
fn shipped(text: &str, method: Method, h: f64) -> Running {
    let (name, order) = match method {
        Method::Galerkin(stages) => ("galerkin", stages.order()),
        Method::Composition(order) => ("composition", order),
    };
    let step = format!("{h:e}");
    let overrides =
        [("step", step), ("order", order.to_string()), ("method", format!("\"{name}\""))];
    let overrides = overrides.map(|(key, value)| Override::new(format!("simulation.{key}"), value));
    let model = Model::from_toml_with(text, &overrides).unwrap();
    Running::Model(Box::new(Simulation::new(&model).unwrap()))
}

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
#[derive(Clone, Copy)]
enum Method {
    Galerkin(Stages),
    Composition(u32),
}

impl Method {
    fn all() -> Vec<Self> {
        let stages = [2, 3, 4, 6, 8].map(|s| Self::Galerkin(Stages::new(s).unwrap()));
        stages.into_iter().chain([2, 4, 6, 8].map(Self::Composition)).collect()
    }

    fn name(self) -> String {
        match self {
            Self::Galerkin(stages) => format!("Galerkin {}", stages.order()),
            Self::Composition(order) => format!("composition {order}"),
        }
    }

    fn options(self, h: f64) -> Options {
        let options = Options::new(SchemeKind::Nodal, h);
        match self {
            Self::Galerkin(stages) => options.galerkin(stages),
            Self::Composition(order) => options.composition(Composition::of_order(order).unwrap()),
        }
    }
}

/// The point of a case.
fn place(case: &Case, q: &[f64]) -> [f64; 3] {
    let own = &q[12 * case.frame..];
    let offset = |i: usize| (0..3).map(|k| case.point[k] * own[3 + 3 * k + i]).sum::<f64>();
    [0, 1, 2].map(|i| own[i] + offset(i))
}

/// Seconds, the place of the point at the end and iterations; `None` where a step is refused.
fn run(case: &Case, method: Method, count: u32) -> Option<(f64, [f64; 3], usize)> {
    let mut running = (case.start)(method, case.end / f64::from(count));
    let run = running.integrator();
    let (begin, mut iterations) = (Instant::now(), 0);
    for _ in 0..count {
        iterations += run.step().ok()?.iterations;
    }
    Some((begin.elapsed().as_secs_f64(), place(case, &run.state().q), iterations))
}

fn main() {
    let quick = std::env::args().any(|a| a == "--test");
    let methods = Method::all();
    for case in CASES {
        let counts = if quick { &case.counts[..2] } else { case.counts };
        let finest = *counts.last().unwrap();
        let exact = case.exact.unwrap_or_else(|| {
            run(&case, Method::Galerkin(Stages::new(8).unwrap()), finest).unwrap().1
        });
        let mut best = vec![(f64::INFINITY, f64::NAN, 0); methods.len() * counts.len()];
        for _ in 0..if quick { 1 } else { 5 } {
            for (k, best) in best.iter_mut().enumerate() {
                let (method, count) = (methods[k / counts.len()], counts[k % counts.len()]);
                if let Some((time, at, iterations)) = run(&case, method, count) {
                    let squares = at.iter().zip(&exact).map(|(a, b)| (a - b) * (a - b));
                    let error = squares.sum::<f64>().sqrt();
                    *best = (best.0.min(time), error, iterations);
                }
            }
        }
        for (method, runs) in methods.iter().zip(best.chunks_exact(counts.len())) {
            for (&(time, error, iterations), count) in runs.iter().zip(counts) {
                let each = 1e9 * time / iterations as f64 / case.bodies as f64;
                println!(
                    "{}, {}, {count} steps: {:.4} ms, error {error:.1e}, {:.1} iterations a step, {each:.0} ns a body",
                    case.name,
                    method.name(),
                    1e3 * time,
                    iterations as f64 / f64::from(*count),
                );
            }
        }
        for (method, runs) in methods.iter().zip(best.chunks_exact(counts.len())) {
            let least = ERRORS.map(|bound| {
                let enough = runs.iter().filter(|run| run.1 <= bound).map(|run| run.0);
                enough.reduce(f64::min).map_or("-".into(), |time| format!("{:.4}", 1e3 * time))
            });
            println!(
                "{}, {}: {} ms to 1e-4 / 1e-6 / 1e-8",
                case.name,
                method.name(),
                least.join(" / ")
            );
        }
    }
}
