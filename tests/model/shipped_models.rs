//! Snapshots of every shipped model: what is assembled, the trajectory at a few steps, the
//! counters.
//!
//! Numbers are rounded far above round-off, so that they are the same at every level of
//! optimization.
#![allow(clippy::unwrap_used)] // a test

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use crate::harness;
use harness::models::{all_shipped, read};
use holonom::model::Scheme;
use holonom::simulation::RunOutcome;
use holonom::vi_core::linear::norm_inf;
use holonom::{MemberKind, Model, Override, Sample, run};

/// Steps that are shown.
const SHOWN: [u64; 5] = [0, 1, 2, 5, 20];
/// Components that are shown: the first ones and the last.
const MEMBERS: usize = 4;

/// A number with nine digits of `scale`; no sign of zero.
fn rounded(value: f64, scale: f64) -> String {
    let decimals = (9.0 - scale.max(1e-3).log10().ceil()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { "0".into() } else { text }
}

/// A motion as far as it is shown; equilibria as they are.
fn shortened(model: &Model) -> Model {
    if model.settings.scheme == Scheme::Static {
        return model.clone();
    }
    let steps = SHOWN[SHOWN.len() - 1].min(model.settings.steps());
    let end = (steps as f64 * model.settings.step).to_string();
    let short = [Override::new("simulation.end", end), Override::new("simulation.every", "1")];
    model.with_overrides(&short).unwrap()
}

fn trajectory(model: &Model) -> String {
    let mut experiment = run::prepare(&shortened(model)).unwrap();
    let assembly = experiment.assembly();
    let mut text = format!(
        "{} by {:?} at order {}, step {} s\n{} coordinates, {} constraints, {} redundant {:?}, {} degrees of freedom\n",
        model.header.name,
        model.settings.scheme,
        model.settings.order,
        model.settings.step,
        assembly.counts.coordinates,
        assembly.counts.constraints,
        assembly.counts.redundant_constraints,
        assembly.redundant,
        assembly.counts.dof
    );
    let mut samples: Vec<Sample> = Vec::new();
    let mut observe = |sample: &Sample| {
        samples.push(sample.clone());
        Ok(())
    };
    let outcome = experiment.run(&mut observe, &mut |_, _| {}).unwrap();
    assert_eq!(outcome, RunOutcome::Done);
    let energies = |s: &Sample| s.energy.abs().max(s.hamiltonian.abs());
    let joules = norm_inf(&samples.iter().map(energies).collect::<Vec<_>>());
    let last = samples.last().unwrap().step;
    for sample in samples.iter().filter(|s| SHOWN.contains(&s.step) || s.step == last) {
        let [e, h] = [sample.energy, sample.hamiltonian].map(|e| rounded(e, joules));
        writeln!(text, "step {}, t = {:.6}: E {e}, H {h}", sample.step, sample.t).unwrap();
        let mut at = 0;
        let members = experiment.members();
        for (k, member) in members.iter().enumerate() {
            let width = member.kind.columns().len();
            let own = &sample.q[at..at + width];
            at += width;
            if k + 1 < MEMBERS || k + 1 == members.len() {
                let scale = norm_inf(&sample.q).max(1.0);
                let numbers: Vec<_> = own.iter().map(|x| rounded(*x, scale)).collect();
                let lines = if member.kind == MemberKind::Frame { 3 } else { width };
                let lines: Vec<_> = numbers.chunks(lines).map(|line| line.join(" ")).collect();
                writeln!(text, "  {}: {}", member.name, lines.join(" | ")).unwrap();
            }
        }
        let sums: f64 = sample.q.iter().enumerate().map(|(i, x)| (1.0 + i as f64).sqrt() * x).sum();
        writeln!(text, "  all: {}", rounded(sums, 1e3 * sums.abs().max(1.0))).unwrap();
    }
    let counts: Vec<f64> = samples.iter().skip(1).map(|s| s.newton_iterations).collect();
    let mean = counts.iter().sum::<f64>() / counts.len() as f64;
    writeln!(text, "newton iterations a step: mean {mean:.0}").unwrap();
    text
}

#[test]
fn trajectories() {
    for (name, path) in all_shipped() {
        let model = read(&path, &[]);
        insta::assert_snapshot!(name.clone(), trajectory(&model), &name);
    }
}

/// `examples/README.md` shows every shipped model, each with a picture that is there.
#[test]
fn the_page_of_models_shows_all_of_them() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples");
    let page = fs::read_to_string(format!("{folder}/README.md")).unwrap();
    for (name, _) in all_shipped() {
        let [picture, model] = [format!("pictures/{name}.png"), format!("models/{name}.toml")];
        assert!(page.contains(&picture) && page.contains(&model), "{name}: make it again");
        assert!(PathBuf::from(format!("{folder}/{picture}")).is_file(), "{picture}");
    }
}
