//! `cargo xtask compare`: variational and energy–momentum schemes on five models, into `COMPARISON.md`.

mod markdown;

use holonom::Model;
use holonom::compare::{Comparison, Record, Request, compare};
use holonom::model::{LinearSolver, Scheme};
use std::path::Path;

/// Models with the number of steps of their table.
const MODELS: [(&str, u64); 5] = [
    ("heavy_top", 2000),
    ("six_hinge_cube", 1000),
    ("four_bar_loop", 500),
    ("flying_beam", 500),
    ("flexible_multibody", 1000),
];

/// One model, compared.
struct Compared {
    name: &'static str,
    description: String,
    found: Comparison,
    /// The nodal variational scheme by dense matrices: the algebra of the energy–momentum forms.
    dense: Option<Record>,
}

/// Compares, and writes the page.
///
/// # Errors
/// What could not be measured or written, in words.
pub fn run() -> Result<(), String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or("no root")?;
    let mut all = Vec::new();
    for (name, steps) in MODELS {
        let path = root.join(format!("examples/models/{name}.toml"));
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{name}: {e}"))?;
        let model = Model::from_toml(&text).map_err(|e| format!("{name}: {e}"))?;
        all.push(compared(name, &model, steps)?);
    }
    let page = root.join("COMPARISON.md");
    std::fs::write(&page, markdown::page(&all)).map_err(|e| e.to_string())
}

fn compared(name: &'static str, model: &Model, steps: u64) -> Result<Compared, String> {
    let mut progress = |part: &str| eprintln!("{name}: {part}");
    let step = model.settings.step;
    let request = Request {
        steps: vec![step, step / 2.0, step / 4.0],
        end: Some(step * steps as f64),
        effort: 1.0,
        ..Request::default()
    };
    let found = compare(model, &request, &mut progress).map_err(|e| format!("{name}: {e}"))?;
    let mut dense = model.clone();
    dense.settings.solver = LinearSolver::Dense;
    // of this one only the cost is looked at: no time for a reference
    let schemes = vec![Scheme::Nodal];
    let alone = Request { schemes, orders: vec![2], effort: 0.05, ..request };
    let dense = compare(&dense, &alone, &mut progress).map_err(|e| format!("{name}: {e}"))?;
    let description = model.header.description.clone().unwrap_or_default();
    Ok(Compared { name, description, found, dense: dense.records.into_iter().next() })
}
