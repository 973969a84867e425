//! The shipped models, ready to be varied.

use holonom::model::Meshes;
use holonom::{Model, Override, Sample, Simulation};
use std::path::{Path, PathBuf};

/// The text of a shipped model.
pub fn shipped(name: &str) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/models/");
    std::fs::read_to_string(format!("{folder}{name}.toml")).unwrap()
}

/// Names and files of all shipped models.
pub fn all_shipped() -> Vec<(String, PathBuf)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/models");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files = files.filter(|path| path.extension().is_some_and(|e| e == "toml"));
    let named = |path: PathBuf| (path.file_stem().unwrap().to_str().unwrap().to_owned(), path);
    let mut models: Vec<_> = files.map(named).collect();
    models.sort();
    models
}

/// A model with the files beside it that it names.
pub fn read(path: &Path, replaced: &[Override]) -> Model {
    let text = std::fs::read_to_string(path).unwrap();
    Model::from_toml_in(&text, replaced, Meshes::beside(path)).unwrap()
}

/// Overrides from keys with their values.
pub fn overrides<V: ToString>(pairs: &[(&str, V)]) -> Vec<Override> {
    pairs.iter().map(|(key, value)| Override::new(*key, value.to_string())).collect()
}

/// A shipped model with values replaced.
pub fn model(name: &str, replaced: &[(&str, String)]) -> Model {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/models/");
    read(Path::new(&format!("{folder}{name}.toml")), &overrides(replaced))
}

/// The same, assembled.
pub fn simulation(name: &str, replaced: &[(&str, String)]) -> Simulation {
    Simulation::new(&model(name, replaced)).unwrap()
}

/// The nodes of a whole run.
pub fn nodes(model: &Model) -> Vec<Sample> {
    Simulation::new(model).unwrap().samples().map(Result::unwrap).collect()
}

/// Slope of `log error` against `log h` between neighbours of a sequence of halved steps.
pub fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Slope of `log y` against `log x` by least squares.
pub fn exponent(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let (lx, ly): (Vec<f64>, Vec<f64>) = x.iter().zip(y).map(|(x, y)| (x.ln(), y.ln())).unzip();
    let (mx, my) = (lx.iter().sum::<f64>() / n, ly.iter().sum::<f64>() / n);
    let cross: f64 = lx.iter().zip(&ly).map(|(x, y)| (x - mx) * (y - my)).sum();
    cross / lx.iter().map(|x| (x - mx).powi(2)).sum::<f64>()
}
