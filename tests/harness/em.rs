//! Cases with `scheme = "em"`: every form of the energy–momentum scheme that applies.

use vi_constraints::node::Node;
use vi_core::State;
use vi_emscheme::{EmForm, EmOptions, EmSystem};
use vi_multibody::Mechanism;

/// The forms that apply.
pub fn forms(mechanism: &Mechanism) -> &'static [EmForm] {
    if mechanism.has_loops() { &EmForm::ALL[..2] } else { &EmForm::ALL }
}

/// Steps to the end and hands over the listed nodes.
pub fn drive(
    (system, mechanism): (EmSystem, Mechanism),
    (form, h): (EmForm, f64),
    (steps, output_steps): (u64, &[u64]),
    mut compare: impl FnMut(u64, &State, &Node) -> Result<(), String>,
) -> Result<(), String> {
    let options = EmOptions::new(form, h);
    let mut run =
        vi_emscheme::run::integrator(system, mechanism, options).map_err(|e| e.to_string())?;
    for n in 0..steps {
        run.step().map_err(|e| format!("step {n}: {e}"))?;
        if output_steps.contains(&n) {
            let node = run.node_before().map_err(|e| e.to_string())?.clone();
            compare(n, run.before(), &node)?;
        }
    }
    if output_steps.contains(&steps) {
        let node = run.observe().map_err(|e| format!("node {steps}: {e}"))?.clone();
        compare(steps, run.state(), &node)?;
    }
    match output_steps.iter().find(|n| **n > steps) {
        Some(n) => Err(format!("output step {n} is beyond the last step {steps}")),
        None => Ok(()),
    }
}
