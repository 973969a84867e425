//! The verifier itself: integrators with one defect each must fail, on the criterion that names the
//! defect, and every criterion that passes anywhere has a mutant that it fails on.

use holonom::verification::subject::SteppingMethod;
use holonom::vi_constraints::SchemeKind;
use holonom::vi_emscheme::EmForm;
use xtask::verify::mutants::{Base, Mutant, list, passes};

/// All mutants of these systems are found.
fn found(of: impl Fn(&Mutant) -> bool) {
    let chosen: Vec<Mutant> = list::all().into_iter().filter(of).collect();
    assert!(!chosen.is_empty());
    let missed: Vec<String> = chosen
        .iter()
        .filter(|mutant| !mutant.is_found().unwrap())
        .map(|m| {
            format!("{} on {}: {} of {}", m.name, m.base.name(), m.criterion.name(), m.quantity)
        })
        .collect();
    println!("{} of {} found", chosen.len() - missed.len(), chosen.len());
    assert!(missed.is_empty(), "not found:\n{}", missed.join("\n"));
}

#[test]
fn mutants_of_the_top_are_found() {
    found(|m| m.base == Base::Top);
}

#[test]
fn mutants_of_the_pendulum_and_the_free_body_are_found() {
    found(|m| matches!(m.base, Base::Pendulum | Base::FreeBody));
}

#[test]
fn mutants_of_the_linkage_are_found() {
    found(|m| m.base == Base::FourBar);
}

#[test]
fn mutants_of_the_pairs_are_found() {
    found(|m| matches!(m.base, Base::Pair(_)));
}

#[test]
fn mutants_of_the_beam_and_of_energy_momentum_schemes_are_found() {
    found(|m| matches!(m.base, Base::Beam | Base::Quartic));
}

#[test]
fn mutants_of_the_damped_arm_are_found() {
    found(|m| m.base == Base::Arm);
}

#[test]
fn there_are_enough_of_them() {
    let all = list::all();
    let mut names: Vec<&str> = all.iter().map(|m| m.name).collect();
    let mut systems: Vec<&str> = all.iter().map(|m| m.base.name()).collect();
    for list in [&mut names, &mut systems] {
        list.sort_unstable();
        list.dedup();
    }
    println!("{} mutants: {} defects on {} systems", all.len(), names.len(), systems.len());
    assert!(names.len() >= 30 && systems.len() >= 5, "{names:?} {systems:?}");
}

/// Sound integrators pass, and nothing that they pass is without a mutant.
#[test]
fn no_criterion_passes_that_cannot_fail() {
    let all = list::all();
    let dalembert = SteppingMethod::Variational(SchemeKind::Dalembert);
    let em = SteppingMethod::EnergyMomentum(EmForm::Nodal);
    for (base, method) in [
        (Base::Top, (SteppingMethod::NODAL, 2)),
        (Base::Top, (dalembert, 2)),
        (Base::Top, (em, 2)),
        (Base::Pendulum, (SteppingMethod::NODAL, 4)),
        (Base::Pair(1), (SteppingMethod::NODAL, 2)),
        (Base::FourBar, (SteppingMethod::NODAL, 2)),
        (Base::Beam, (SteppingMethod::NODAL, 2)),
    ] {
        for (criterion, quantity) in passes(base, method).unwrap() {
            let mutant = all.iter().find(|m| m.criterion == criterion && m.quantity == quantity);
            assert!(
                mutant.is_some(),
                "{}: {} of {quantity} has no mutant",
                base.name(),
                criterion.name()
            );
        }
    }
}
