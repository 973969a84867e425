//! Models that are refused, or whose runs fail: what is said of them.

use holonom::simulation::RunOutcome;
use holonom::{Model, Simulation};

/// The text of a model of `tests/hostile`.
pub fn hostile(name: &str) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/hostile/");
    std::fs::read_to_string(format!("{folder}{name}.toml")).unwrap()
}

/// The words of a refusal at assembly or before.
pub fn refusal(text: &str) -> Option<String> {
    let error = match Model::from_toml(text) {
        Ok(model) => Simulation::new(&model).err()?,
        Err(error) => error,
    };
    let words =
        |p: &holonom::model::Problem| format!("{p} ({})", p.help.clone().unwrap_or_default());
    Some(error.problems(text).iter().map(words).collect::<Vec<_>>().join("\n"))
}

/// How a run ends, and the largest residual of its rows.
pub fn run(text: &str) -> (RunOutcome, f64) {
    let (outcome, largest, _) = run_with_warnings(text);
    (outcome, largest)
}

/// The same, and what the run warned of.
pub fn run_with_warnings(text: &str) -> (RunOutcome, f64, Vec<String>) {
    let mut simulation = Simulation::new(&Model::from_toml(text).unwrap()).unwrap();
    let mut largest = 0.0_f64;
    let mut observe = |sample: &holonom::sample::Sample| {
        largest = largest.max(sample.residuals.position);
        Ok::<(), ()>(())
    };
    let outcome = simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    (outcome, largest, simulation.warnings())
}

/// A hinge with the given motions, and perhaps a second hinge that locks it.
pub fn hinge(motions: &[&str], locked: bool) -> String {
    let mut text = String::from(
        "[model]\nname = \"hinge\"\n[simulation]\nstep = 0.01\nend = 3.0\n[[body]]\nname = \"a\"\n\
         mass = 1.0\ninertia = [1.0, 1.0, 1.0]\nposition = [0.5, 0.0, 0.0]\n",
    );
    let axes = ["[0.0, 1.0, 0.0]", "[1.0, 0.0, 0.0]"];
    for (k, axis) in axes.iter().enumerate().take(if locked { 2 } else { 1 }) {
        text += &format!(
            "[[joint]]\nname = \"j{k}\"\ntype = \"revolute\"\nparent = \"ground\"\nchild = \"a\"\n\
             position = [{k}, 0.0, 0.0]\naxis = {axis}\n"
        );
    }
    for (k, path) in motions.iter().enumerate() {
        text += &format!(
            "[[constraint]]\nname = \"m{k}\"\ntype = \"motion\"\njoint = \"j0\"\npath = {path}\n"
        );
    }
    text
}
