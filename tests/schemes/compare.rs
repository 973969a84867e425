//! The comparison of both families: what it says of each scheme, and of those that do not run.
#![allow(clippy::unwrap_used)] // helpers of tests

use holonom::Model;
use holonom::compare::{
    CompareError, Comparison, EnergyBehaviour, Request, SchemeOutcome, compare,
};
use holonom::compare::{page, table};
use holonom::model::Scheme;

fn model(name: &str) -> Model {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/models");
    let text = std::fs::read_to_string(format!("{folder}/{name}.toml")).unwrap();
    Model::from_toml(&text).unwrap()
}

fn compared(name: &str, request: &Request) -> Comparison {
    compare(&model(name), request, &mut |_| {}).unwrap()
}

/// The findings without what differs from run to run: times and round-off.
fn without_noise(mut c: Comparison) -> Comparison {
    let quiet = |x: &mut f64| {
        if *x < 1e-11 {
            *x = 0.0;
        }
    };
    c.reference.known_to = c.reference.known_to.map(|_| 0.0);
    c.version = String::new();
    for record in &mut c.records {
        if let Some(m) = &mut record.measured {
            m.seconds_per_step = m.seconds_per_step.map(|_| 1e-6);
            m.apart.iter_mut().for_each(quiet);
            m.momentum_drift.iter_mut().for_each(quiet);
            quiet(&mut m.energy_error);
            let levels = &mut m.constraint_residual;
            for level in [&mut levels.position, &mut levels.velocity, &mut levels.momentum] {
                quiet(&mut level.max);
            }
            m.mean_iterations = m.mean_iterations.round();
            m.max_iterations = 0.0;
        }
        for point in &mut record.work {
            point.seconds = point.seconds.map(|_| 1.0);
            point.error.iter_mut().for_each(quiet);
        }
    }
    c
}

fn request(steps: &[f64], end: f64) -> Request {
    Request { steps: steps.to_vec(), end: Some(end), ..Request::default() }
}

#[test]
fn the_table_of_a_pendulum() {
    let found = compared("pendulum", &request(&[0.02, 0.01], 3.0));
    insta::assert_snapshot!(table::text(&without_noise(found)));
}

#[test]
fn the_conclusions_on_a_heavy_top() {
    conclusions_on_a_heavy_top(0.1);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn the_conclusions_on_a_heavy_top_after_half_a_second() {
    conclusions_on_a_heavy_top(0.5);
}

fn conclusions_on_a_heavy_top(end: f64) {
    let found = compared("heavy_top", &request(&[0.002, 0.001, 0.0005, 0.00025], end));
    print!("{}", table::text(&found));
    assert_eq!(found.conserved, ["Lz"]);
    assert!(found.reference.known_to.unwrap() < 1e-10);
    for record in &found.records {
        let measured = record.measured.as_ref().unwrap();
        assert_eq!(record.outcome, SchemeOutcome::Done);
        let conserved = measured.energy_verdict == EnergyBehaviour::Conserved;
        assert_eq!(conserved, record.energy_momentum, "{}: energy", record.scheme);
        assert!(measured.momentum_drift[5] < 1e-12, "{}: Lz", record.scheme);
        assert!(measured.apart.unwrap_or(0.0) < 1e-12, "{}: the forms agree", record.scheme);
        assert!(measured.seconds_per_step.unwrap() > 0.0);
        // κ of the nodal forms does not depend on h, that of the constrained ones as written is h⁻³
        let kappa: Vec<_> = record.conditions.iter().map(|at| at.condition.unwrap()).collect();
        let growth = (kappa[3].as_written / kappa[0].as_written).log2() / 3.0;
        let expected = match record.scheme.trim_start_matches("em-") {
            "constrained" => 3.0,
            "dalembert" => 1.0,
            _ => 0.0,
        };
        assert!((growth - expected).abs() < 0.05, "{}: κ ~ h^-{growth:.2}", record.scheme);
        // order 2, 4, 6 of the error at the end
        for order in [2, 4, 6] {
            let points = record.work.iter().filter(|p| p.order == order);
            let errors: Vec<f64> = points.filter_map(|p| p.error).collect();
            assert_eq!(errors.len(), 4, "{} of order {order}", record.scheme);
            if order < 6 {
                let slope = (errors[0] / errors[2]).log2() / 2.0;
                let off = (slope - f64::from(order)).abs();
                assert!(off < 0.2, "{} of order {order}: {slope:.2}", record.scheme);
            }
        }
    }
    let html = page::page(&found, &model("heavy_top"), "holonom compare heavy_top.toml");
    assert_eq!(html.matches("<svg").count(), 16); // each chart once more for narrow pages
    assert!(!html.contains("http://") || !html.contains("src="), "self-contained");
    let json = serde_json::to_string(&found).unwrap();
    let back: Comparison = serde_json::from_str(&json).unwrap();
    assert_eq!(back.records.len(), 7);
}

#[test]
fn schemes_that_do_not_run_say_why_and_the_others_go_on() {
    let mut model = model("four_bar_windows");
    model.settings.step = 0.01;
    let schemes = vec![Scheme::Constrained, Scheme::Nodal, Scheme::EmNodal, Scheme::EmConstrained];
    let request = Request { schemes, ..request(&[0.01], 0.2) };
    let found = compare(&model, &request, &mut |_| {}).unwrap();
    let text = table::text(&found);
    println!("{text}");
    assert!(found.records.iter().any(|r| r.outcome == SchemeOutcome::Done));
    for record in &found.records {
        let refused = matches!(record.outcome, SchemeOutcome::Refused { .. });
        assert_eq!(refused, record.measured.is_none(), "{}", record.scheme);
        assert!(!refused || text.contains(&format!("{}: does not run", record.scheme)));
    }
}

#[test]
fn a_step_that_is_too_long_fails_for_one_scheme_and_is_reported() {
    let schemes = vec![Scheme::Nodal, Scheme::EmNodal];
    let found = compared("heavy_top_fast", &Request { schemes, ..request(&[0.3], 30.0) });
    let text = table::text(&found);
    println!("{text}");
    let failed = found.records.iter().filter(|r| matches!(r.outcome, SchemeOutcome::Failed { .. }));
    assert!(failed.count() > 0 && text.contains("failed in step"), "{text}");
    let html = page::page(&found, &model("heavy_top_fast"), "holonom compare heavy_top_fast.toml");
    assert!(html.contains("failed in step"));
}

#[test]
fn requests_that_make_no_sense_are_refused() {
    let refuse = |request: &Request| compare(&model("pendulum"), request, &mut |_| {}).unwrap_err();
    let negative = refuse(&request(&[-0.1], 1.0));
    assert_eq!(negative.to_string(), "a step is -0.1: it must be a positive number of seconds");
    let short = refuse(&request(&[0.1], 0.01));
    assert!(matches!(short, CompareError::TooShort { .. }), "{short}");
    let order = refuse(&Request { orders: vec![3], ..Request::default() });
    assert_eq!(order, CompareError::Order(3));
}
