//! Work for a precision, by order: the heavy top and a chain of eight links over half a second.
//!
//! Each line is a run: order, step, the least time of three, and the distance of the end from a run
//! of order 8 with an eighth of the smallest step. The last lines of a model are the times for one
//! error, interpolated on both logarithmic axes, relative to order 2.
#![allow(clippy::unwrap_used)] // a bench

use holonom::{Model, Override, Simulation};
use std::time::Instant;

const MODELS: [(&str, &str); 2] = [
    ("heavy_top", include_str!("../examples/models/heavy_top.toml")),
    ("chain8", include_str!("../examples/models/chain8.toml")),
];
const ORDERS: [u32; 3] = [2, 4, 6];
const END: f64 = 0.5;
/// The error at which orders are compared.
const ERROR: f64 = 1e-6;

/// Seconds, and the configuration at the end.
fn run(text: &str, order: u32, steps: u64) -> (f64, Vec<f64>) {
    let set = [
        Override::new("simulation.order", order.to_string()),
        Override::new("simulation.step", format!("{:?}", END / steps as f64)),
        Override::new("simulation.end", format!("{END:?}")),
    ];
    let mut simulation = Simulation::new(&Model::from_toml_with(text, &set).unwrap()).unwrap();
    let begin = Instant::now();
    (0..steps).for_each(|_| _ = simulation.step().unwrap());
    (begin.elapsed().as_secs_f64(), simulation.configuration().to_vec())
}

/// The time for an error, between the two runs that enclose it.
fn time_for(error: f64, points: &[(f64, f64)]) -> Option<f64> {
    points.windows(2).find_map(|pair| {
        let [(t0, e0), (t1, e1)] = [pair[0], pair[1]];
        let part = (error.ln() - e0.ln()) / (e1.ln() - e0.ln());
        (e0 >= error && error >= e1).then(|| (t0.ln() + part * (t1.ln() - t0.ln())).exp())
    })
}

fn main() {
    let quick = std::env::args().any(|a| a == "--test");
    let counts: &[u64] = if quick { &[50, 100] } else { &[50, 100, 200, 400, 800, 1600, 3200] };
    for (name, text) in MODELS {
        let (_, exact) = run(text, 8, 8 * counts[counts.len() - 1]);
        let mut first = None;
        for order in ORDERS {
            let mut points = Vec::new();
            for &count in counts {
                let runs = (0..if quick { 1 } else { 3 }).map(|_| run(text, order, count));
                let (time, end) = runs.reduce(|a, b| if a.0 <= b.0 { a } else { b }).unwrap();
                let error = end.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                println!(
                    "{name}, order {order}, h = {:.2e} s: {time:.2e} s, error {error:.1e}",
                    END / count as f64
                );
                points.push((time, error));
            }
            let time = time_for(ERROR, &points);
            first = first.or(time);
            if let (Some(time), Some(first)) = (time, first) {
                println!(
                    "{name}, order {order}: {time:.2e} s for {ERROR:e}, {:.2} of the first",
                    time / first
                );
            }
        }
    }
}
