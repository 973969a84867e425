//! Short forms of the three harnesses of reliability, and the harnesses themselves: what is wrong
//! on purpose is found.
#![allow(clippy::unwrap_used)] // tests

use holonom::Model;
use holonom_reliability::fuzz::lane::{Lane, LaneWatch};
use holonom_reliability::fuzz::targets::{Answer, FuzzTarget, all};
use holonom_reliability::fuzz::{self, limits};
use holonom_reliability::interrupt;
use holonom_reliability::mutants;
use holonom_reliability::soak::defects::SoakDefect;
use holonom_reliability::soak::judge::{Checks, Ending, judge};
use holonom_reliability::soak::minimise::minimise;
use holonom_reliability::soak::tally::SoakTally;
use holonom_reliability::soak::{self, draw::Draw, generate::mechanism, generate::touching};
use std::path::PathBuf;
use vi_testkit::CountingAllocator;

mod robust {
    mod restated_models;
}

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// A run of the mechanisms `0..count` of a seed.
fn soaked(seed: u64, count: u64) -> SoakTally {
    let count = count.to_string();
    let seed = seed.to_string();
    let words = ["--count", &count, "--seed", &seed, "--jobs", "2"];
    soak::soak(&soak::SoakRequest::parse(&words).unwrap(), &|_| {})
}

/// Opposite points of a body on a hinge contradict one another in a long step (3817, 6687), and
/// features that a pair names at the end of a step alone would be lifted within it (9093, 6021):
/// such steps are divided, and gain no energy.
#[test]
fn steps_that_contacts_contradict_are_divided() {
    for index in [3817, 6687, 9093, 6021] {
        let judged = judge(&touching(1, index), Checks::of_touching(index), None);
        let gain = judged.measured.gain.unwrap();
        println!("{index}: {:?}, {:?}, gain {gain:.1e}", judged.ending, judged.fault);
        assert!(matches!(judged.ending, Ending::Done) && judged.fault.is_none(), "{index}");
        assert!(gain < 1e-9, "{index}: {gain:e}");
    }
}

#[test]
fn random_mechanisms_keep_what_their_schemes_promise() {
    let tally = soaked(1, 400);
    println!("{}", soak::words(&tally));
    assert!(tally.faults.is_empty(), "{:?}", tally.faults);
    let ended_early = SoakTally::count(&tally.refused) + SoakTally::count(&tally.failed);
    assert!(ended_early * 20 < tally.mechanisms, "{ended_early} of {}", tally.mechanisms);
    assert!(tally.restarted > 30 && tally.agreement.count > 20 && tally.momentum.count > 20);
    assert!(tally.restated.count > 5, "{}", tally.restated.count);
}

/// Bodies of all shapes that touch: gaps hold, momenta of what is free are kept, contact gives no
/// energy, runs continue to the bit.
#[test]
fn bodies_that_touch_keep_what_contact_promises() {
    let words = ["--count", "56", "--seed", "3", "--jobs", "2", "--touching"];
    let tally = soak::soak(&soak::SoakRequest::parse(&words).unwrap(), &|_| {});
    println!("{}", soak::words(&tally));
    assert!(tally.faults.is_empty(), "{:?}", tally.faults);
    let ended_early = SoakTally::count(&tally.refused) + SoakTally::count(&tally.failed);
    assert!(ended_early * 10 < tally.mechanisms, "{ended_early} of {}", tally.mechanisms);
    assert!(tally.restarted > 10 && tally.gain.count > 40 && tally.momentum.count > 4);
}

/// Mechanisms in which a million found a fault: two whose momentum maps changed; two beams with the
/// trapezoidal rule in steps beyond its stability limit, one at rest, so that rounding grows by a
/// factor of 3.7 in each, and one that folds; two mechanisms that are locked at a dead position,
/// with a motor.
#[test]
fn faults_that_were_found_once_are_gone() {
    for index in [643_091, 740_975, 900_108, 262_464, 142_039, 573_907] {
        let checks = Checks { restart: true, agreement: true, ..Checks::default() };
        let judged = judge(&mechanism(1, index), checks, None);
        println!("{index}: {judged:?}");
        assert_eq!(judged.fault, None, "{index}");
    }
}

/// Bodies that touch, in which a soak found a fault, or a step without impulses. A point of a rim
/// that counts as closed was pushed out within 5e-12 s; friction gripped a body on a joint with
/// fewer freedoms than rows, and impulses of 1e16 N·s balanced one another; what bounced between
/// two stops, a thousandth of its step apart, or was gripped where it was to be thrown back, had no
/// impulses by Newton's law.
#[test]
fn bodies_that_touched_wrongly_once_do_not_again() {
    let faults = [(3, 58), (3, 79), (5, 196), (5, 255)];
    let refusals = [(3, 13), (3, 215), (4, 130), (5, 66), (1, 485), (1, 695)];
    for (seed, index) in faults.into_iter().chain(refusals) {
        let judged = judge(&touching(seed, index), Checks::of_touching(index), None);
        println!("{seed}-{index}: {judged:?}");
        assert_eq!((judged.fault, judged.ending), (None, Ending::Done), "{seed}-{index}");
    }
}

#[test]
fn the_result_does_not_depend_on_shards() {
    let parts = ["1/3", "2/3", "3/3"].map(|shard| {
        let words = ["--count", "60", "--seed", "5", "--jobs", "1", "--shard", shard];
        soak::soak(&soak::SoakRequest::parse(&words).unwrap(), &|_| {})
    });
    let mut sum = SoakTally::default();
    parts.into_iter().rev().for_each(|part| sum.add(part));
    assert_eq!(sum, soaked(5, 60));
}

#[test]
fn a_fault_is_found_in_a_smaller_mechanism() {
    // the first mechanism of several bodies: of it remains what the fault needs
    let (checks, defect) = (Checks::default(), Some(SoakDefect::Constraint));
    let large = (0..400).map(|index| mechanism(2, index)).filter(|model| model.bodies.len() > 3);
    let found =
        large.filter_map(|model| Some((judge(&model, checks, defect).fault?, model))).next();
    let (fault, model) = found.unwrap();
    let smallest = minimise(&model, checks, defect, &fault);
    let parts = (model.bodies.len(), smallest.bodies.len(), smallest.joints.len());
    println!("of {} bodies {} with {} joints", parts.0, parts.1, parts.2);
    assert_eq!((smallest.bodies.len(), smallest.joints.len()), (1, 0));
    assert!(judge(&smallest, checks, defect).fault.unwrap().resembles(&fault));
}

#[test]
fn rules_of_contact_that_a_fault_does_not_need_are_removed() {
    let (checks, defect) = (Checks::default(), Some(SoakDefect::Gap));
    let large = (0..400).map(|index| touching(2, index)).filter(|model| model.bodies.len() > 3);
    let found =
        large.filter_map(|model| Some((judge(&model, checks, defect).fault?, model))).next();
    let (fault, model) = found.unwrap();
    let smallest = minimise(&model, checks, defect, &fault);
    let parts = |model: &Model| [model.bodies.len(), model.contacts.len(), model.joints.len()];
    println!("of {:?} bodies, contacts and joints {:?}", parts(&model), parts(&smallest));
    let [bodies, contacts, joints] = parts(&smallest);
    assert!(bodies <= 2 && contacts == 1 && joints == 0);
    assert!(judge(&smallest, checks, defect).fault.unwrap().resembles(&fault));
}

/// A short lane of a target.
fn executed(target: &dyn FuzzTarget, length: u64) -> fuzz::tally::FuzzTally {
    let lane = Lane { seed: 1, number: 0, length };
    let tally = lane.run(target, &LaneWatch::new(target.name(), &PathBuf::from("target")), None);
    println!("{}: {}", target.name(), tally.words());
    assert!(tally.faults.is_empty(), "{:?}", tally.faults);
    tally
}

#[test]
fn mutated_inputs_are_accepted_or_refused_in_words() {
    let lengths = [
        ("model", 1500),
        ("expression", 4000),
        ("assembly", 400),
        ("checkpoint", 1500),
        ("state", 200),
        ("tables", 200),
        ("sweep", 2000),
        ("mesh", 3000),
    ];
    let targets = all();
    for (name, length) in lengths {
        let target = targets.iter().find(|target| target.name() == name).unwrap();
        target.ready().unwrap();
        let tally = executed(&**target, length);
        assert!(tally.accepted > 0 && tally.shapes.len() > 3, "{name} reads nothing");
    }
    let arguments = targets.iter().find(|target| target.name() == "arguments").unwrap();
    match arguments.ready() {
        Ok(()) => drop(executed(&**arguments, 100)),
        Err(help) => println!("not tried: {help}"), // the program is built with the whole workspace
    }
}

#[test]
fn inputs_that_are_large_or_no_files_are_answered_in_words() {
    for (name, answer) in limits::all() {
        println!("{name}: {answer:?}");
        assert!(!matches!(answer, Answer::Wrong(_)), "{name}: {answer:?}");
        let may_be_read = ["bodies", "expression", "parameters", "nested arrays"];
        if !may_be_read.iter().any(|own| name.contains(own)) {
            assert!(matches!(&answer, Answer::Refused(words) if !words.is_empty()), "{name}");
        }
    }
}

/// All defects of a harness are found.
fn found(of: impl Fn(&mutants::Mutant) -> bool) {
    for mutant in mutants::all().iter().filter(|mutant| of(mutant)) {
        let found = mutant.found_after();
        println!("{}, {}: {found:?}", mutant.harness, mutant.name);
        assert!(found.is_some(), "{}: {} is not found", mutant.harness, mutant.name);
    }
}

#[test]
fn mechanisms_made_wrong_on_purpose_are_found() {
    found(|mutant| mutant.harness == "soak");
}

#[test]
fn readers_made_wrong_on_purpose_are_found() {
    found(|mutant| !["soak", "interrupt"].contains(&mutant.harness));
}

#[test]
fn disturbed_runs_leave_what_undisturbed_runs_leave() {
    if let Err(help) = interrupt::ready() {
        println!("not tried: {help}"); // the program is built with the whole workspace
        return;
    }
    let request = interrupt::InterruptRequest::parse(&["--count", "42", "--jobs", "2"]).unwrap();
    let tally = interrupt::interrupt(&request).unwrap();
    println!("{}", interrupt::words(&tally));
    assert_eq!(tally.len(), interrupt::TrialKind::ALL.len());
    assert!(tally.values().all(|row| row.faults.is_empty()), "{}", interrupt::words(&tally));
    let disturbed: u64 = tally.values().map(|row| row.disturbances).sum();
    assert!(disturbed > 20, "{disturbed}");
    found(|mutant| mutant.harness == "interrupt");
}

#[test]
fn mechanisms_are_the_same_on_every_machine() {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for index in 0..200 {
        for byte in mechanism(1, index).to_toml().bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    let number = Draw::new(1, 0).between(0.0, 1.0);
    println!("{hash:#x} {number:?}");
    assert_eq!(hash, 0x696b_69e5_6661_df70);
}
