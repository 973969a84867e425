//! `cargo xtask roundoff`: how rounding errors add up over very long runs; into docs/round-off.md
//! and VERIFICATION.md.
//!
//! Each run reads what its scheme conserves exactly at 4096 nodes. The exponent `a` of
//! `|x_{n+k} − x_n| ~ k^a` ([`holonom::verification::growth`]) is 1/2 for unbiased rounding and 1
//! for a drift. The same run with the rounding errors of each step thrown away ([`Compensation`])
//! stands beside it.

use holonom::verification::growth::{NoGrowth, growth};
use holonom::vi_constraints::Integrator;
use holonom::vi_constraints::discretization::Discretization;
use holonom::vi_core::compensation::Compensation;
use holonom::vi_core::momentum_map::Momentum;
use holonom::vi_multibody::mechanism::Mechanism;
use holonom::{Model, Override, Simulation};
use holonom_reliability::text_file;
use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/round-off.md");
const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/models/");
const VERIFICATION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../VERIFICATION.md");
/// Precedes the table of the page.
const MARK: &str = "<!-- table -->\n";
/// Heading of the table in VERIFICATION.md.
const HEADING: &str = "\n## Round-off over very long runs\n";
/// Nodes that are read.
const SAMPLES: u64 = 4096;
/// Steps before the first node that is read: loads have ended.
const LOADS: u64 = 1000;
/// The run without compensation is shorter by this factor.
const SHORTER: u64 = 10;

/// What a scheme conserves.
#[derive(Clone, Copy)]
enum Quantity {
    Energy,
    Linear(usize),
    Angular(usize),
}

impl Quantity {
    fn of(self, energy: f64, momentum: &Momentum) -> f64 {
        match self {
            Self::Energy => energy,
            Self::Linear(axis) => momentum.linear[axis],
            Self::Angular(axis) => momentum.angular[axis],
        }
    }

    fn name(self) -> String {
        let axis = |axis: usize| ["x", "y", "z"][axis];
        match self {
            Self::Energy => "energy".into(),
            Self::Linear(i) => format!("linear momentum, {}", axis(i)),
            Self::Angular(i) => format!("angular momentum, {}", axis(i)),
        }
    }
}

/// A long run.
struct Case {
    what: &'static str,
    model: &'static str,
    scheme: &'static str,
    replaced: &'static [(&'static str, &'static str)],
    steps: u64,
    conserved: &'static [Quantity],
}

use Quantity::{Angular, Energy, Linear};
const CASES: [Case; 10] = [
    Case {
        what: "pendulum without weight",
        model: "pendulum_free",
        scheme: "nodal",
        replaced: &[("simulation.step", "0.1")],
        steps: 100_000_000,
        conserved: &[Energy, Angular(2)],
    },
    Case {
        what: "pendulum",
        model: "pendulum",
        scheme: "em-nodal",
        replaced: &[],
        steps: 10_000_000,
        conserved: &[Energy],
    },
    Case {
        what: "heavy top",
        model: "heavy_top",
        scheme: "nodal",
        replaced: &[],
        steps: 10_000_000,
        conserved: &[Angular(2)],
    },
    Case {
        what: "heavy top",
        model: "heavy_top",
        scheme: "em-nodal",
        replaced: &[],
        steps: 10_000_000,
        conserved: &[Energy, Angular(2)],
    },
    Case {
        what: "chain of eight",
        model: "chain8",
        scheme: "em-nodal",
        replaced: &[("simulation.step", "0.01")],
        steps: 10_000_000,
        conserved: &[Energy],
    },
    Case {
        what: "flyball governor (closed loops)",
        model: "flyball_governor",
        scheme: "nodal",
        replaced: &[],
        steps: 10_000_000,
        conserved: &[Angular(1)],
    },
    Case {
        what: "slider-crank",
        model: "slider_crank",
        scheme: "em-nodal",
        replaced: &[],
        steps: 1_000_000,
        conserved: &[Energy],
    },
    Case {
        what: "Bricard linkage",
        model: "bricard",
        scheme: "em-nodal",
        replaced: &[],
        steps: 1_000_000,
        conserved: &[Energy],
    },
    Case {
        what: "beam of four elements, set spinning",
        model: "flying_beam",
        scheme: "nodal",
        replaced: &[
            ("simulation.step", "0.01"),
            ("beam.beam.elements", "4"),
            ("load.push.force", "[0.0, 0.0, 0.0]"),
            ("load.push.torque", "[0.0, 0.0, -8.0]"), // more would fold the elements
        ],
        steps: 10_000_000,
        conserved: &[Linear(0), Angular(2)],
    },
    Case {
        what: "flying beam after its loads",
        model: "flying_beam",
        scheme: "nodal",
        // an element of 0.5 m is bent by more than 90° after 10.5 s
        replaced: &[("simulation.step", "0.01"), ("beam.beam.elements", "40")],
        steps: 200_000,
        conserved: &[Linear(0), Angular(2)],
    },
];

/// The command with its options.
///
/// # Errors
/// A message that names the option or the case.
pub fn run(options: &[&str]) -> Result<(), String> {
    let (mut only, mut divisor) = (None, 1);
    for pair in options.chunks(2) {
        match pair {
            ["--of", model] if CASES.iter().any(|case| case.model == *model) => only = Some(*model),
            ["--parts", parts] => {
                divisor = parts.parse().ok().filter(|n| *n > 0).ok_or("--parts needs a number")?;
            }
            _ => return Err(format!("{} is no option or model of this task", pair.join(" "))),
        }
    }
    measure(only, divisor)
}

/// Runs all cases, or those of one model, with so many steps divided by `divisor`; replaces the
/// table of the page after a full run and prints it otherwise.
///
/// # Errors
/// A message that names the case.
fn measure(only: Option<&str>, divisor: u64) -> Result<(), String> {
    let mut table = String::from(
        "| system | scheme | conserved | steps | largest change | exponent | \\|g\\| | without compensation: steps | largest change | exponent |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for case in CASES.iter().filter(|case| only.is_none_or(|only| only == case.model)) {
        let rows = case.rows(divisor)?;
        eprint!("{rows}");
        table += &rows;
    }
    if only.is_some() || divisor != 1 {
        print!("{table}");
        return Ok(());
    }
    let (head, _) = page()?;
    text_file::write(Path::new(PAGE), &format!("{head}{MARK}\n{table}"))?;
    let verification = Path::new(VERIFICATION);
    text_file::write(verification, &with_section(&text_file::read(verification)?, &section()?))
}

/// The page before its table, and the table.
fn page() -> Result<(String, String), String> {
    let text = text_file::read(Path::new(PAGE))?;
    let (head, table) =
        text.split_once(MARK).ok_or(format!("{PAGE} lacks the mark of its table"))?;
    Ok((head.to_owned(), table.trim_start().to_owned()))
}

/// The section of VERIFICATION.md, from the table of the page.
///
/// # Errors
/// That there is no such table.
pub fn section() -> Result<String, String> {
    let (_, table) = page()?;
    Ok(format!(
        "{HEADING}\nMeasured by `cargo xtask roundoff`; [docs/round-off.md](docs/round-off.md) says how. The exponent is `a` in \
         `|x_(n+k) − x_n| ~ k^a`: 1/2 for a random walk of rounding errors, 0 for errors that do not add up, 1 for a drift. Without \
         compensation: the rounding errors of each step are thrown away.\n\n{table}"
    ))
}

/// VERIFICATION.md with this section in the place of an earlier one, or before the systems.
fn with_section(text: &str, section: &str) -> String {
    let (head, rest) = match text.split_once(HEADING) {
        Some((head, rest)) => (head, rest.find("\n## ").map_or("", |next| &rest[next..])),
        None => text.split_at(text.find("\n## Systems\n").unwrap_or(text.len())),
    };
    format!("{head}{section}{rest}")
}

/// A run as it was read.
struct Readings {
    values: Vec<Vec<f64>>, // of each conserved quantity
    residual: f64,         // largest |g|
}

impl Case {
    fn rows(&self, divisor: u64) -> Result<String, String> {
        let steps = (self.steps / divisor).max(2 * SAMPLES);
        let with = self.read(steps, true)?;
        let fewer = (steps / SHORTER).max(2 * SAMPLES);
        let without = self.read(fewer, false)?;
        let mut rows = String::new();
        for (k, quantity) in self.conserved.iter().enumerate() {
            let [own, naive] = [&with, &without].map(|readings| cells(&readings.values[k]));
            let _ = writeln!(
                rows,
                "| {} | `{}` | {} | {steps:.0e} | {own} | {:.0e} | {fewer:.0e} | {naive} |",
                self.what,
                self.scheme,
                quantity.name(),
                with.residual,
                steps = steps as f64,
                fewer = fewer as f64,
            );
        }
        Ok(rows)
    }

    fn read(&self, steps: u64, compensated: bool) -> Result<Readings, String> {
        let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", self.model);
        let path = format!("{MODELS}{}.toml", self.model);
        let text = text_file::read(Path::new(&path))?;
        let scheme = [Override::new("simulation.scheme", format!("{:?}", self.scheme))];
        let replaced = self.replaced.iter().map(|(key, value)| Override::new(*key, *value));
        let replaced: Vec<Override> = replaced.chain(scheme).collect();
        let model = Model::from_toml_with(&text, &replaced).map_err(|e| failed(&e))?;
        let mut simulation = Simulation::new(&model).map_err(|e| failed(&e))?;
        let empty = || self.conserved.iter().map(|_| Vec::new()).collect();
        let mut readings = Readings { values: empty(), residual: 0.0 };
        for sample in 0..=SAMPLES {
            let transient = if sample == 0 { LOADS } else { steps / SAMPLES };
            let stretch = (transient, compensated);
            let read = match simulation.energy_momentum() {
                Some(run) => reading(run, stretch),
                None => reading(simulation.integrator(), stretch),
            };
            let Reading { energy, momentum, residual } = read.map_err(|e| failed(&e))?;
            for (quantity, values) in self.conserved.iter().zip(&mut readings.values) {
                values.push(quantity.of(energy, &momentum));
            }
            readings.residual = readings.residual.max(residual);
        }
        Ok(readings)
    }
}

/// What is read at a node.
struct Reading {
    energy: f64,
    momentum: Momentum,
    residual: f64,
}

/// Takes so many steps, with or without the rounding errors of each handed to the next, and reads
/// the node.
fn reading<S: Discretization<Mechanism>>(
    run: &mut Integrator<S, Mechanism>,
    (steps, compensated): (u64, bool),
) -> Result<Reading, Box<dyn Error>> {
    run.record_multipliers(false);
    for _ in 0..steps {
        run.step()?;
        if !compensated {
            let mut state = run.state().clone();
            let Compensation { q, v, balance } = &mut state.compensation;
            [q, v, balance].into_iter().for_each(|errors| errors.fill(0.0));
            run.resume(state)?;
        }
    }
    let node = run.observe_state()?;
    let (p, energy) = (node.p_projected.clone(), node.hamiltonian_projected.total());
    let residual = node.position_residual;
    let momentum = run.constraints().momentum(&run.state().q, &p);
    Ok(Reading { energy, momentum, residual })
}

/// Largest change, relative to the size where there is one, and exponent.
fn cells(values: &[f64]) -> String {
    let size = values[0].abs();
    let change = values.iter().map(|x| (x - values[0]).abs()).fold(0.0, f64::max);
    let change = if size > 1e-9 { change / size } else { change };
    match growth(values) {
        Ok(found) => format!("{change:.1e} | {:.2}", found.exponent),
        Err(NoGrowth::Exact) => "0 | exact".to_owned(),
        Err(error) => format!("{change:.1e} | {error}"),
    }
}
