//! `scheme = "static"`: equilibria of model files against closed forms and independent solutions.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::model;
use holonom::experiment::RunnableModel;
use holonom::model::Model;
use holonom::nalgebra::Vector3;
use holonom::run::prepare;
use holonom::statics::Statics;
use holonom::{RunOutcome, Sample};

fn text(name: &str) -> String {
    std::fs::read_to_string(format!(
        "{}/../../examples/models/{name}.toml",
        env!("CARGO_MANIFEST_DIR")
    ))
    .unwrap()
}

pub(crate) fn rows(model: &Model) -> (Vec<Sample>, RunOutcome) {
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| {
        samples.push(sample.clone());
        Ok(())
    };
    let outcome = prepare(model).unwrap().run(&mut observe, &mut |_, _| {}).unwrap();
    (samples, outcome)
}

/// The last row of a shipped model with changes.
fn end_of(name: &str, changes: &[(&str, &str)]) -> Sample {
    let (samples, outcome) = rows(&model(&text(name), changes));
    assert_eq!(outcome, RunOutcome::Done);
    samples.last().unwrap().clone()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn roll_up_is_the_closed_form_of_the_elements() {
    let sample = end_of("roll_up", &[]);
    let (l, moment, bending) = (10.0 / 80.0, 628.3185307179587_f64, 500.0);
    let theta = 0.5 * (2.0 * moment * l / bending).asin();
    let (mut point, mut worst) = ([0.0; 3], 0.0_f64);
    for (k, frame) in sample.q.chunks_exact(12).enumerate() {
        worst = worst.max(distance(&frame[..3], &point));
        let (mean, way) = ((k as f64 + 0.5) * theta, l / (0.5 * theta).cos());
        point = [point[0] + way * mean.cos(), point[1] + way * mean.sin(), 0.0];
    }
    println!("roll-up into two circles: nodes off the closed form by {worst:.1e}");
    assert!(worst < 1e-11, "{worst:e}");
    let back = distance(&sample.sensors, &[0.0; 3]);
    assert!(back < 0.2, "the end comes back to the clamp: {back}");
}

#[test]
fn cantilevers_tend_to_the_exact_beam_with_order_two() {
    for (name, beam, exact) in [
        ("bend_45", "bend", [15.68480053, 47.15043857, 53.47485879]),
        ("nachbagauer", "beam", [2.0 - 0.15097114423929, 0.71056859785352, 0.0]),
        ("princeton", "strip", [0.508 - 0.01441182, -0.00897920, 0.10911312]),
    ] {
        let key = format!("beam.{beam}.elements");
        let at = |elements: &str| end_of(name, &[(&key, elements)]).sensors;
        let found: Vec<Vec<f64>> = ["16", "32", "64"].into_iter().map(at).collect();
        let errors: Vec<f64> = found.iter().map(|x| distance(x, &exact)).collect();
        let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
        let limit: Vec<f64> = found[2]
            .iter()
            .zip(&found[1])
            .map(|(fine, coarse)| fine + (fine - coarse) / 3.0)
            .collect();
        let left = distance(&limit, &exact) / distance(&exact, &[0.0; 3]);
        println!("{name}: errors {errors:?}, orders {orders:.3?}, extrapolated off by {left:.1e}");
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.05), "{name}: {orders:?}");
        assert!(left < 1e-5, "{name}: {limit:?}");
    }
}

#[test]
fn the_right_angle_frame_stands_aside_beyond_its_critical_load() {
    let (samples, outcome) = rows(&model(&text("right_angle_frame"), &[]));
    assert_eq!(outcome, RunOutcome::Done);
    let aside = |t: f64| {
        let near = |s: &&Sample| (s.t - t).abs() < 1e-9;
        samples.iter().find(near).unwrap().sensors[2].abs()
    };
    println!("aside by {:.1e} m at 1.04 N, {:.1e} m at 1.2 N", aside(1.04), aside(1.2));
    assert!(aside(1.04) < 1e-4 && aside(1.2) > 0.03);
}

pub(crate) const ARCH: &str = include_str!("../models/two_bars.toml");

#[test]
fn an_arch_snaps_through_by_arc_length_and_stops_without() {
    let rest = (1.0_f64 + 0.0625).sqrt();
    let exact = |y: f64| 2e4 / rest * (rest / (1.0 + y * y).sqrt() - 1.0) * y;
    let l = rest.cbrt();
    let limit = exact((l * l - 1.0).sqrt());

    let (samples, outcome) = rows(&model(ARCH, &[]));
    let RunOutcome::Failed(failure) = outcome else { panic!("it must stop at the limit point") };
    println!("t = {}: {}; {}", failure.t, failure.message, failure.remedy);
    assert!((100.0 * failure.t - limit).abs() < 1e-2 * limit, "limit load {limit}");
    assert!(failure.remedy.contains("arc_length = true"), "{}", failure.remedy);
    assert!((samples.last().unwrap().t - failure.t).abs() < 1e-15, "the last equilibrium is a row");

    let (samples, outcome) = rows(&model(ARCH, &[("simulation.arc_length", "true")]));
    assert_eq!(outcome, RunOutcome::Done);
    let (mut worst, mut low) = (0.0_f64, 0.0_f64);
    for sample in &samples {
        worst = worst.max((100.0 * sample.t - exact(sample.sensors[1])).abs() / limit);
        low = low.min(sample.t);
    }
    let last = samples.last().unwrap();
    println!(
        "{} equilibria, off the closed form by {worst:.1e}, load down to {:.2} N, apex ends at {:.4} m",
        samples.len(),
        100.0 * low,
        last.sensors[1]
    );
    assert!(worst < 1e-9 && (100.0 * low / limit + 1.0).abs() < 5e-3, "{worst:e}, {low}");
    assert!(
        (last.t - 1.0).abs() < 1e-14 && last.sensors[1] < -0.25,
        "on the far side at full load"
    );
}

#[test]
fn a_closed_cycle_of_the_load_returns() {
    let cycle = ARCH
        .replace("[0, -100, 0]", "[10, -30, 0]\nhistory = { type = \"table\", times = [0, 1, 2, 3], values = [0, 1, -1, 0] }")
        .replace("end = 1.0", "end = 3.0")
        .replace("step = 0.02", "step = 0.25");
    let (samples, outcome) = rows(&model(&cycle, &[]));
    assert_eq!(outcome, RunOutcome::Done);
    let (first, last) = (&samples[0], samples.last().unwrap());
    let away = samples.iter().map(|s| distance(&s.q, &first.q)).fold(0.0, f64::max);
    let back = distance(&last.q, &first.q);
    println!("load cycle: {away:.2} away, {back:.1e} off on return, energy {:.1e} J", last.energy);
    assert!(away > 0.05 && back < 1e-12 && last.energy.abs() < 1e-20);
}

#[test]
fn pendulums_released_sideways_come_to_hang() {
    let changes =
        [("simulation.scheme", "\"static\""), ("simulation.end", "1"), ("simulation.step", "1")];
    let bob = end_of("pendulum", &changes);
    let off = distance(&bob.q, &[0.0, -1.0]);
    println!("point mass: off the vertical by {off:.1e} m");
    assert!(off < 1e-9, "{:?}", bob.q);
    // a body on a spherical joint; its spin is neutral
    let top = end_of("heavy_top", &changes);
    let off = top.q[0].hypot(top.q[1]);
    println!("top: off the vertical by {off:.1e} m, at {:.3} m", top.q[2]);
    assert!(off < 1e-9 && top.q[2] < -0.01, "{:?}", &top.q[..3]);
}

#[test]
fn an_overconstrained_loop_comes_to_rest() {
    let changes =
        [("simulation.scheme", "\"static\""), ("simulation.end", "1"), ("simulation.step", "1")];
    // 30 constraints of rank 29; which of them are dependent changes along the continuation
    let sample = end_of("bricard", &changes);
    let (energy, missed) = (sample.energy, sample.residuals.position);
    println!("Bricard: {energy:.6} J at rest, constraints met to {missed:.1e}");
    assert!(energy < -29.43 - 1.0 && missed < 1e-10, "{energy}, {missed:e}");
}

const DRIVEN: &str = include_str!("../models/driven_end.toml");

#[test]
fn a_driven_end_bends_a_beam_as_the_beam_theory_says() {
    let (samples, outcome) = rows(&model(DRIVEN, &[]));
    assert_eq!(outcome, RunOutcome::Done);
    for sample in &samples {
        // both ends keep their direction: 12 EI w/L³
        let force = sample.sensors[2]; // along the axis of the joint
        assert!(
            (force.abs() - 1.2 * sample.t).abs() <= 0.01 * sample.t + 1e-9,
            "{force} at {}",
            sample.t
        );
    }
    println!(
        "driven end: {:.4} N at 0.01 m, beam theory 1.2 N",
        samples.last().unwrap().sensors[2]
    );
}

#[test]
fn what_has_no_equilibrium_fails_with_words() {
    let falling = r#"
        model = { name = "stone", gravity = [0.0, 0.0, -9.81] }
        body = [{ name = "stone", mass = 1.0, inertia = [1.0, 1.0, 1.0], position = [0.0, 0.0, 0.0] }]
        simulation = { scheme = "static", step = 0.1, end = 1.0 }
    "#;
    let (samples, outcome) = rows(&model(falling, &[]));
    let RunOutcome::Failed(failure) = outcome else { panic!("a stone falls") };
    println!("{}; {}", failure.message, failure.remedy);
    assert!(
        samples.is_empty()
            && failure.message.contains("no equilibrium was found from the initial configuration")
    );
}

#[test]
fn the_walk_tells_what_it_found() {
    let model = model(&text("bend_45"), &[("beam.bend.elements", "8")]);
    let mut statics = Statics::new(&model).unwrap();
    statics.reach_end().unwrap();
    let facts = statics.statics().unwrap();
    println!("{facts:?}");
    assert_eq!((facts.neutral, facts.arc_length), (false, false));
    assert!(facts.equilibria >= 11 && facts.equilibria <= 11 + 2 * facts.halvings, "{facts:?}");
    assert!((facts.largest_time - 1.0).abs() < 1e-15 && facts.max_residual < 1e-6);
    let report = statics.assembly();
    assert_eq!((report.counts.dof, report.counts.redundant_constraints), (48, 0));
}

/// The crank of the linkage has no stiffness of its own: what the stiffness matrix holds there is
/// round-off of the forces it passes on.
#[test]
fn a_rigid_crank_between_elastic_parts_walks_with_steps_of_any_size() {
    let text = text("flexible_four_bar");
    for step in ["0.02", "0.05", "0.25"] {
        let changes = [("simulation.scheme", "\"static\""), ("simulation.step", step)];
        let (samples, outcome) = rows(&model(&text, &changes));
        let last = samples.last().unwrap();
        println!("step {step} s: {} equilibria to t = {} s, {outcome:?}", samples.len(), last.t);
        assert_eq!(outcome, RunOutcome::Done, "step {step}");
        assert_eq!(last.t.to_bits(), 4.0_f64.to_bits());
    }
}

/// Helicoidal elements approach the limit with order 4; force and moment at the clamp, of order 2,
/// are those of the load.
#[test]
fn helicoidal_elements_are_of_order_4_and_right_at_clamps() {
    let own =
        |count: &'static str| [("beam.0.elements", count), ("beam.0.element", "\"helicoidal\"")];
    let ends = |name: &str, beam: &str, counts: [&'static str; 3]| {
        counts.map(|count| {
            let changes = own(count).map(|(key, value)| (key.replace('0', beam), value));
            let changes: Vec<(&str, &str)> = changes.iter().map(|(k, v)| (&**k, *v)).collect();
            Vector3::from_column_slice(&end_of(name, &changes).sensors[..3])
        })
    };
    let bend = ends("bend_45", "bend", ["4", "8", "16"]);
    let exact = Vector3::new(15.684_800_53, 47.150_438_57, 53.474_858_79);
    let errors = bend.map(|end| (end - exact).norm());
    let order = (errors[0] / errors[1]).log2();
    println!("45 degree bend, 4, 8, 16 elements: off by {errors:?} m, order {order:.2}");
    assert!((order - 4.0).abs() < 0.3 && errors[1] < 1e-3, "{errors:?}");
    let strip = ends("princeton", "strip", ["2", "4", "8"]);
    let changes = [(strip[0] - strip[1]).norm(), (strip[1] - strip[2]).norm()];
    let order = (changes[0] / changes[1]).log2();
    println!("Princeton beam: changes by {changes:?} m, order {order:.2}");
    assert!((order - 4.0).abs() < 0.5 && changes[1] < 2e-5, "{changes:?}");

    let sensors =
        "[[sensor]]\nname = \"clamp\"\ntype = \"section_force\"\nof = \"bend\"\nat = 0.0\n";
    let text = text("bend_45").replace("[simulation]", &format!("{sensors}\n[simulation]"));
    let changes = [("beam.bend.elements", "8"), ("beam.bend.element", "\"helicoidal\"")];
    let (samples, _) = rows(&model(&text, &changes));
    let found = &samples.last().unwrap().sensors;
    let part = |first: usize| Vector3::from_column_slice(&found[first..first + 3]);
    let (tip, force, moment) = (part(0), part(3), part(6));
    let load = Vector3::new(0.0, 0.0, 600.0);
    let off = [force.norm() / load.norm() - 1.0, moment.norm() / tip.cross(&load).norm() - 1.0];
    println!("at the clamp: force and moment off by {off:?} (relative)");
    assert!(off.iter().all(|off| off.abs() < 1e-9), "{off:?}");
}
