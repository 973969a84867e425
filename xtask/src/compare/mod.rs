//! `cargo xtask compare`: variational and energy–momentum schemes on five models, into
//! `COMPARISON.md`.
//!
//! | file | concept |
//! |---|---|
//! | `markdown` | the page and the findings of each model |
//! | `tables` | ratios, equal errors, condition numbers, linearizations |
//! | `claims` | what was claimed of both families, judged from the numbers |
//! | `values` | numbers as the page writes them |

mod claims;
mod markdown;
mod tables;
mod values;

use holonom::compare::linearization::{Linearizations, linearizations};
use holonom::compare::{Comparison, Record, Request, compare};
use holonom::model::{LinearSolver, Scheme};
use holonom::verification::trend::{Trend, trend};
use holonom::{Model, RunOutcome, Simulation};
use holonom_reliability::text_file;
use std::path::Path;
use std::process::Command;

/// Models with the number of steps of their table, and the step (s) where it is not that of the
/// model.
const MODELS: [(&str, u64, Option<f64>); 5] = [
    ("heavy_top", 2000, None),
    ("six_hinge_cube", 1000, None),
    ("four_bar_loop", 500, None),
    ("flying_beam", 400, Some(0.01)),
    ("flexible_multibody", 1000, None),
];
/// Steps over which the energy of `nodal` is judged, once the loads have ended.
const ENERGY_STEPS: u64 = 8192;

/// One model, compared.
struct Compared {
    name: &'static str,
    description: String,
    found: Comparison,
    /// `nodal` and `em-nodal` by dense matrices: the same algebra.
    dense: Vec<Record>,
    linearizations: Result<Linearizations, String>,
    /// `|G M⁻¹p|` of `nodal` at the step of the table and at half of it.
    momentum_level: Option<[f64; 2]>,
    /// The energy of `nodal` over [`ENERGY_STEPS`] steps of the model; why not, in words.
    energy: Result<Trend, String>,
}

/// Compares, and writes the page.
///
/// # Errors
/// What could not be measured or written, in words.
pub fn run(options: &[&str]) -> Result<(), String> {
    let (quick, only) = match options {
        [] => (false, None),
        ["--quick"] => (true, None),
        ["--quick", "--only", name] => (true, Some(*name)),
        _ => return Err(format!("unknown options {options:?}: write --quick [--only MODEL]")),
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or("no root")?;
    let mut all = Vec::new();
    for (name, steps, step) in MODELS.into_iter().filter(|model| only.is_none_or(|o| o == model.0))
    {
        let path = root.join(format!("examples/models/{name}.toml"));
        let text = text_file::read(&path)?;
        let model = Model::from_toml(&text).map_err(|e| format!("{name}: {e}"))?;
        let (steps, effort) = if quick { (steps / 10, 0.2) } else { (steps, 4.0) };
        all.push(compared(name, &model, (steps, step.unwrap_or(model.settings.step)), effort)?);
    }
    let page = markdown::page(&all, &provenance(root));
    if quick {
        print!("{page}");
        return Ok(());
    }
    text_file::write(&root.join("COMPARISON.md"), &page)
}

/// The commit and the date of the numbers.
fn provenance(root: &Path) -> String {
    let output = |program: &str, arguments: &[&str]| {
        let found = Command::new(program).args(arguments).current_dir(root).output().ok()?;
        let text = String::from_utf8(found.stdout).ok()?;
        (found.status.success() && !text.trim().is_empty()).then(|| text.trim().to_owned())
    };
    let commit = output("git", &["describe", "--always", "--dirty"]);
    let date = output("date", &["-u", "+%Y-%m-%d"]);
    let of = |value: Option<String>| value.unwrap_or_else(|| "unknown".into());
    format!("Commit {}, {}.", of(commit), of(date))
}

fn compared(
    name: &'static str,
    model: &Model,
    (steps, step): (u64, f64),
    effort: f64,
) -> Result<Compared, String> {
    let mut progress = |part: &str| eprintln!("{name}: {part}");
    progress("energy");
    let energy = energy(model);
    let mut at_table = model.clone();
    at_table.settings.step = step;
    let model = &at_table;
    let request = Request {
        steps: vec![step, step / 2.0, step / 4.0],
        end: Some(step * steps as f64),
        effort,
        ..Request::default()
    };
    let found = compare(model, &request, &mut progress).map_err(|e| format!("{name}: {e}"))?;
    let mut dense = model.clone();
    dense.settings.solver = LinearSolver::Dense;
    // of these only the cost is looked at: no time for a reference
    let schemes = vec![Scheme::Nodal, Scheme::EmNodal];
    let alone = Request { schemes, orders: vec![2], effort: 0.05, ..request.clone() };
    let dense = compare(&dense, &alone, &mut progress).map_err(|e| format!("{name}: {e}"))?;
    progress("linearizations");
    let end = Some(step * steps.min(50) as f64);
    let linearizations = linearizations(model, &Request { end, ..request });
    let level =
        |parts: u32| momentum_level(model, (step / f64::from(parts), steps * u64::from(parts)));
    let momentum_level = level(1).zip(level(2)).map(|(coarse, fine)| [coarse, fine]);
    let description = model.header.description.clone().unwrap_or_default();
    let dense = dense.records;
    Ok(Compared { name, description, found, dense, linearizations, momentum_level, energy })
}

/// The trend of the energy of `nodal` with the step of the model, from the end of the loads on.
fn energy(model: &Model) -> Result<Trend, String> {
    let mut model = model.clone();
    let (step, free) = (model.settings.step, model.loads_end().unwrap_or(0.0));
    let settings = &mut model.settings;
    (settings.scheme, settings.order, settings.every) = (Scheme::Nodal, 2, 4);
    settings.end = free + step * ENERGY_STEPS as f64;
    let (mut energies, mut shadows) = (Vec::new(), Vec::new());
    let mut observe = |sample: &holonom::Sample| -> Result<(), std::convert::Infallible> {
        if let Some(shadow) = sample.shadow.filter(|_| sample.t >= free) {
            energies.push(sample.hamiltonian);
            shadows.push(shadow);
        }
        Ok(())
    };
    let mut simulation = Simulation::new(&model).map_err(|e| e.to_string())?;
    let Ok(outcome) = simulation.run(&mut observe, &mut |_, _| {});
    match outcome {
        RunOutcome::Done => trend(&energies, &shadows).map_err(|e| e.to_string()),
        RunOutcome::Failed(failure) => Err(failure.message),
    }
}

/// The largest `|G M⁻¹p|` along a run by `nodal`.
fn momentum_level(model: &Model, (step, steps): (f64, u64)) -> Option<f64> {
    let mut model = model.clone();
    let settings = &mut model.settings;
    (settings.scheme, settings.order, settings.every) = (Scheme::Nodal, 2, 1);
    (settings.step, settings.end) = (step, step * steps as f64);
    let mut worst = 0.0_f64;
    let mut observe = |sample: &holonom::Sample| -> Result<(), std::convert::Infallible> {
        worst = worst.max(sample.residuals.momentum);
        Ok(())
    };
    let Ok(outcome) = Simulation::new(&model).ok()?.run(&mut observe, &mut |_, _| {});
    (outcome == RunOutcome::Done).then_some(worst)
}
