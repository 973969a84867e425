//! Models whose constraints cannot all be satisfied: a right answer, a refusal that names the
//! culprits, or a run that fails; never a silent violation.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::hostile::{hinge, hostile, refusal, run};
use holonom::simulation::RunOutcome;
use holonom::{Model, ModelError, Simulation};
use vi_testkit::model::{AXES, along, body_at, motion};

#[test]
fn constraints_that_contradict_each_other_are_refused_by_name() {
    for (model, names) in [
        ("silent_two_motions", &["slow", "fast"][..]),
        ("silent_locked_motion", &["turn"]),
        ("silent_zero_distance", &["rod", "spherical"]),
        ("silent_taut_revolute_8", &["velocit"]),
        ("silent_taut_revolute_9", &["velocit"]),
    ] {
        let text = hostile(model);
        for scheme in ["nodal", "reduced", "constrained", "dalembert", "em-nodal", "em-constrained"]
        {
            let text = text.replace("scheme=\"nodal\"", "");
            let text =
                text.replace("[simulation]", &format!("[simulation]\nscheme = \"{scheme}\""));
            let words = refusal(&text).unwrap_or_else(|| panic!("{model}, {scheme}: accepted"));
            println!("{model}, {scheme}: {words}");
            let singular = words.contains("singular");
            assert!(singular || names.iter().all(|name| words.contains(name)), "{model}: {words}");
        }
    }
}

#[test]
fn paths_that_part_later_are_refused_and_those_that_agree_run() {
    // both begin with value, rate and acceleration zero
    let late = "{ amplitude = 0.2, frequency = 0.5, rate = -0.6283185307179586 }";
    for (motions, locked) in [(&["{}", late][..], false), (&[late][..], true)] {
        let words = refusal(&hinge(motions, locked)).expect("refused");
        println!("{words}");
        assert!(words.contains("m0") && words.contains("contradict"), "{words}");
        assert!(words.contains(if locked { "`j" } else { "m1" }), "{words}");
    }
    for (motions, locked) in
        [(&[late, late][..], false), (&["{}"][..], true), (&["{}", "{}"], true)]
    {
        let text = hinge(motions, locked);
        assert_eq!(refusal(&text), None);
        let (outcome, largest) = run(&text);
        assert!(outcome == RunOutcome::Done && largest < 1e-14, "{outcome:?} {largest:e}");
    }
}

/// A four-bar linkage whose crank and rocker both follow a path, `extra` under `[simulation]`.
fn four_bar(crank: &str, rocker: &str, extra: &str) -> String {
    let mut text =
        format!("[model]\nname = \"driven\"\n[simulation]\nstep = 0.01\nend = 2.0\n{extra}\n");
    for (name, x, y) in [("crank", 0.0, 0.5), ("coupler", 1.0, 1.25), ("rocker", 2.0, 0.75)] {
        text += &body_at([x, y, 0.0], name, 1.0, [0.1; 3]);
    }
    for (name, parent, child, x, y) in [
        ("A", "ground", "crank", 0.0, 0.0),
        ("B", "crank", "coupler", 0.0, 1.0),
        ("C", "coupler", "rocker", 2.0, 1.5),
        ("D", "ground", "rocker", 2.0, 0.0),
    ] {
        text += &along(AXES[2], "revolute", name, [parent, child], [x, y, 0.0]);
    }
    for (name, joint, path) in [("drive_a", "A", crank), ("drive_d", "D", rocker)] {
        text += &motion(name, joint, path);
    }
    text
}

#[test]
fn a_violation_that_comes_with_the_motion_ends_the_run_in_every_scheme() {
    let late = "{ amplitude = 0.2, frequency = 0.5, rate = -0.6283185307179586 }";
    for (scheme, order) in [
        ("nodal", 2),
        ("nodal", 4),
        ("reduced", 2),
        ("constrained", 2),
        ("constrained", 4),
        ("dalembert", 2),
        ("em-nodal", 2),
        ("em-constrained", 2),
        ("em-dalembert", 2),
    ] {
        let extra = format!("scheme = \"{scheme}\"\norder = {order}\nevery = 1000");
        let (outcome, largest) = run(&four_bar(late, "{}", &extra));
        let RunOutcome::Failed(failure) = outcome else { panic!("{scheme}, order {order}: done") };
        println!(
            "{scheme}, order {order}: step {} {}; {}",
            failure.step, failure.message, failure.remedy
        );
        assert!(failure.step < 20 && failure.t < 0.2, "{scheme}: {failure:?}");
        assert!(failure.message.contains("residual"), "{}", failure.message);
        assert!(["`drive_a`", "`drive_d`"].iter().all(|name| failure.message.contains(name)));
        assert!(failure.remedy.contains("remove one"), "{}", failure.remedy);
        assert!(largest < 1e-8, "{scheme}: a row with residual {largest:e} was written");
    }
}

#[test]
fn a_path_that_the_joints_cannot_follow_any_further_ends_the_run() {
    // the crank can make a revolution, the rocker cannot
    for scheme in ["nodal", "constrained", "dalembert", "em-nodal", "em-constrained"] {
        let extra = format!("scheme = \"{scheme}\"\nproject_start = true");
        let text = four_bar("{}", "{ rate = 1.0 }", &extra);
        let (loop_alone, _) = text.split_once("[[constraint]]").unwrap();
        let (_, drive) = text.rsplit_once("[[constraint]]").unwrap();
        let short = format!("{loop_alone}[[constraint]]{drive}").replace("end = 2.0", "end = 10.0");
        let (outcome, largest) = run(&short);
        let RunOutcome::Failed(failure) = outcome else { panic!("{scheme}: done") };
        println!("{scheme}: step {} {}; {}", failure.step, failure.message, failure.remedy);
        assert!(failure.remedy.contains("`drive_d`"), "{scheme}: {}", failure.remedy);
        assert!(largest < 1e-12, "{scheme}: {largest:e}");
    }
}

/// A stretched chain of `n` links between two supports, nodes moving across it by `across`.
fn taut(across: &[f64], scheme: &str, gravity: f64) -> String {
    let n = across.len() - 1;
    let mut text = format!(
        "[model]\nname = \"taut\"\ngravity = [0.0, {gravity:?}, 0.0]\n[simulation]\nstep = 0.01\nend = 0.5\n\
         scheme = \"{scheme}\"\n"
    );
    for k in 0..n {
        let (a, b) = (across[k], across[k + 1]);
        text += &(body_at([k as f64 + 0.5, 0.0, 0.0], &format!("b{k}"), 1.0, [0.1; 3])
            + &format!(
                "velocity = [0.0, {:?}, 0.0]\nangular_velocity = [0.0, 0.0, {:?}]\n",
                0.5 * (a + b),
                b - a
            ));
    }
    for k in 0..=n {
        let name = |k: usize| if k < n { format!("b{k}") } else { "ground".into() };
        let parent: String = if k == 0 { "ground".into() } else { name(k - 1) };
        let (parent, child) = if k == n { (name(n), parent) } else { (parent, name(k)) };
        text +=
            &along(AXES[2], "revolute", &format!("j{k}"), [&parent, &child], [k as f64, 0.0, 0.0]);
    }
    text
}

#[test]
fn stretched_chains_are_refused_or_fail_and_never_violate_their_joints() {
    let mut random = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let (mut refused, mut failed, mut right) = (0, 0, 0);
    for trial in 0..120 {
        let n = 2 + trial % 9;
        let size = [1.0, 1e-3, 1e2, 0.0][trial / 9 % 4];
        let across: Vec<f64> =
            (0..=n).map(|k| if k == 0 || k == n { 0.0 } else { size * next() }).collect();
        let scheme = ["nodal", "nodal", "reduced", "em-nodal"][trial % 4];
        let text = taut(&across, scheme, if trial % 2 == 0 { -9.81 } else { 0.0 });
        if refusal(&text).is_some() {
            refused += 1;
            continue;
        }
        let (outcome, largest) = run(&text);
        assert!(largest < 1e-8, "{n} links, {scheme}, {across:?}: residual {largest:e}");
        match outcome {
            RunOutcome::Done => right += 1,
            RunOutcome::Failed(_) => failed += 1,
        }
    }
    println!("{refused} refused, {failed} failed, {right} right");
    assert!(refused > 60, "{refused} refused, {failed} failed, {right} right");
}

#[test]
fn equilibria_violate_no_constraint() {
    let text = hostile("bars_impossible")
        .replace("[simulation]", "[simulation]\nscheme = \"static\"")
        .replace("step = 0.01", "step = 0.05");
    let mut statics = holonom::Statics::new(&Model::from_toml(&text).unwrap()).unwrap();
    let failure = statics.reach_end().unwrap_err();
    println!("{}; {}", failure.message, failure.remedy);
    assert!(failure.message.contains("cannot all be satisfied"), "{}", failure.message);
    assert!(failure.message.contains("`b`") || failure.message.contains("`c`"));
}

#[test]
fn bars_that_no_start_can_satisfy_are_refused() {
    let text = hostile("bars_impossible");
    let error = Simulation::new(&Model::from_toml(&text).unwrap()).map(|_| ()).unwrap_err();
    println!("{error}");
    assert!(!matches!(error, ModelError::Invalid(_)));
}
