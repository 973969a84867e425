//! Both families side by side: what each one keeps.
#![allow(clippy::unwrap_used)] // helpers of tests

mod common;

use vi_emscheme::comparison::{Comparison, ComparisonSettings, compare};
use vi_emscheme::subject::MechanismSubject;
use vi_multibody::PairKind;

fn print(name: &str, comparison: &Comparison) {
    println!("{name}: against {}", comparison.reference);
    println!(
        "{:<15} distance energy  linear  angular |g|     |ḠΔq/h| |Gv|    it. mean max  µs/step  κ(h…) as factorized",
        "scheme"
    );
    for r in &comparison.records {
        let kappa: Vec<String> = r
            .conditions
            .iter()
            .map(|at| at.condition.map_or("-".into(), |c| format!("{:.1e}", c.scaled)))
            .collect();
        println!(
            "{:<15} {:.2e} {:.1e} {:.1e} {:.1e} {:.1e} {:.1e} {:.1e} {:>8.2} {:>3} {:>8.1}  {}",
            r.scheme,
            r.distance,
            r.energy_error,
            r.linear_momentum_drift,
            r.angular_momentum_drift,
            r.residuals.position,
            r.residuals.velocity,
            r.residuals.momentum,
            r.mean_iterations,
            r.max_iterations,
            r.seconds_per_step * 1e6,
            kappa.join(" ")
        );
    }
}

#[test]
fn energy_is_exact_in_one_family_and_bounded_in_the_other() {
    let models = [
        ("C pair", common::pair(PairKind::Cylindrical, false)),
        ("heavy top", common::heavy_top()),
        ("linkage 6R", common::linkage()),
    ];
    for (name, model) in models {
        let mut subject = MechanismSubject::new(model.mechanism.clone());
        subject.springs.clone_from(&model.springs);
        let settings = ComparisonSettings {
            step: model.h,
            steps: 100,
            refinement: 16,
            condition_steps: vec![1e-2, 1e-3, 1e-4],
        };
        let comparison = compare(&subject, settings).unwrap();
        print(name, &comparison);
        let loops = model.mechanism.has_loops();
        assert_eq!(comparison.records.len(), if loops { 4 } else { 7 });
        for record in &comparison.records {
            let em = record.scheme.starts_with("em-");
            assert!(record.failure.is_none() && record.steps == 100, "{record:?}");
            assert!(!em || record.energy_error < 1e-12, "{record:?}");
            assert!(record.residuals.position < 1e-13, "{record:?}");
            assert!(record.distance > 0.0 && record.distance < 0.05, "{record:?}");
        }
        let text = serde_json::to_string(&comparison).unwrap();
        let back: Comparison = serde_json::from_str(&text).unwrap();
        assert_eq!(back.records.len(), comparison.records.len());
    }
}
