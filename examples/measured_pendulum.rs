//! Measured values of a pendulum, made by a run with noise: the columns of
//! `models/friction_pendulum.csv`.
//!
//! Shows: values of a model replaced, a start of joints from outside, sensors read at nodes.
//! Holds: the file that is shipped has these values.

use std::error::Error;
use std::fmt::Write;

use holonom::simulation::Simulation;
use holonom::system::outside::{ExternalActions, JointStart};
use holonom::{Model, Override};

const MODEL: &str = include_str!("models/friction_pendulum.toml");
const SHIPPED: &str = include_str!("models/friction_pendulum.csv");

/// Steps of 1 ms between values of the encoder; those of the gyroscope, which begin later.
const ENCODER: u64 = 20;
const GYROSCOPE: [u64; 2] = [30, 4];

/// A normal number, nearly: the sum of twelve even ones (Knuth's MMIX generator).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut even = || {
            let Self(x) = self;
            *x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*x >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| even()).sum::<f64>() - 6.0
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let set = [
        Override::new("parameters.damping", "0.031"),
        Override::new("parameters.centre", "0.27"),
        Override::new("simulation.step", "0.001"),
    ];
    let model = Model::from_toml_with(MODEL, &set)?;
    let [encoder, gyroscope] = [0, 1].map(|k| model.measurements[k].sigma);
    let hinge = |value| vec![("hinge".to_owned(), 0, value)];
    let start = JointStart { coordinates: hinge(0.35), rates: hinge(-0.4) };
    let mut run =
        Simulation::with_outside(&model, &ExternalActions { start, ..ExternalActions::default() })?;
    let mut noise = Noise(20_080_131);
    let mut text = String::from("t,encoder,gyroscope\n");
    for step in 0..=model.settings.steps() {
        let sensors = &run.observe().map_err(|failure| failure.message)?.sensors;
        let t = step as f64 / 1000.0;
        if step % ENCODER == 0 {
            writeln!(text, "{t},{:.5},", sensors[0] + encoder * noise.next())?;
        }
        if step % GYROSCOPE[0] == GYROSCOPE[1] {
            writeln!(text, "{t},,{:.5}", sensors[1] + gyroscope * noise.next())?;
        }
        run.step_on().map_err(|failure| failure.message)?;
    }
    print!("{text}");
    assert_eq!(text, SHIPPED, "the shipped file has these values");
    Ok(())
}
