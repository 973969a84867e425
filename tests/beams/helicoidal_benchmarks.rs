//! Published flexible systems with the default elements: few of them do what many of mean directors
//! do.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{Run, model, samples};
use crate::statics::static_models::rows;
use holonom::modes::{About, ModalAnalysis};
use holonom::{RunOutcome, Sample, Simulation};
use std::f64::consts::TAU;
use vi_testkit::model::{AXES, beam, body, head, hinge, joint, motion, section};

const ROLL_UP: &str = include_str!("../../examples/models/roll_up.toml");
const NACHBAGAUER: &str = include_str!("../../examples/models/nachbagauer.toml");
const FRAME: &str = include_str!("../../examples/models/right_angle_frame.toml");
const FLYING_BEAM: &str = include_str!("../../examples/models/flying_beam.toml");
const ELBOW: &str = include_str!("../../examples/models/elbow_cantilever.toml");

/// A moment rolls elements up into circles without an error, however few they are.
#[test]
fn a_cantilever_rolls_up_exactly() {
    for (elements, circles) in [("4", 1.0), ("16", 2.0)] {
        let moment = format!("[0, 0, {:?}]", TAU * circles * 500.0 / 10.0);
        let own = [
            ("beam.beam.elements", elements),
            ("beam.beam.element", "\"helicoidal\""),
            ("load.moment.torque", &*moment),
        ];
        let (samples, outcome) = rows(&model(ROLL_UP, &own));
        assert_eq!(outcome, RunOutcome::Done);
        let last = samples.last().unwrap();
        let off = last.sensors[..3].iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        println!("{elements} elements, {circles} circles: the end is {off:.1e} m from the clamp");
        assert!(off < 1e-10, "{off:e}");
    }
}

/// A thick cantilever, whose true shear under a large force is beyond order 4: order 2 with a small
/// constant.
#[test]
fn a_thick_cantilever_is_of_order_2() {
    let exact = [2.0 - 0.150_971_144_239_29, 0.710_568_597_853_52];
    let off = |kind: &str, elements: &str| {
        let kind = format!("\"{kind}\"");
        let own = [("beam.beam.elements", elements), ("beam.beam.element", &*kind)];
        let (samples, _) = rows(&model(NACHBAGAUER, &own));
        let end = &samples.last().unwrap().sensors;
        (end[0] - exact[0]).hypot(end[1] - exact[1])
    };
    let errors = ["2", "4", "8"].map(|elements| off("helicoidal", elements));
    let order = (errors[1] / errors[2]).log2();
    let old = off("mean_directors", "8");
    println!("2, 4, 8 elements: off by {errors:?} m, order {order:.2}; mean directors {old:.1e} m");
    assert!((order - 2.0).abs() < 0.2 && errors[2] < 5e-5 && 20.0 * errors[2] < old, "{errors:?}");
}

/// The critical load of the frame about its bent state, by few elements a leg; with many of mean
/// directors it tends to 1.0875 N.
#[test]
fn a_frame_of_few_elements_buckles_sideways() {
    let plane = FRAME.replace("force = [1.0, 0.0, 1e-6]", "force = [1.0, 0.0, 0.0]");
    let load = |elements: &str| {
        let own = [
            ("beam.frame.elements", elements),
            ("beam.frame.element", "\"helicoidal\""),
            ("simulation.end", "1.08"),
        ];
        let mut analysis = ModalAnalysis::of_loads(&model(&plane, &own), About::Static).unwrap();
        1.08 * analysis.buckling(1).unwrap().modes[0].load_factor.unwrap()
    };
    let found = ["2", "4", "8"].map(load);
    println!("2, 4, 8 elements a leg: {found:.6?} N");
    for (found, within) in found.into_iter().zip([5e-3, 5e-4, 1e-4]) {
        assert!((found - 1.087_52).abs() < within, "{found} N");
    }
}

/// Displacements out of the plane of elbow and tip at 2 and 5 s, and how far they are from the
/// independent limit, m.
#[test]
fn an_elbow_of_few_elements_swings_as_of_many() {
    const LIMIT: [f64; 4] = [4.115, 0.069, 3.111, 5.479];
    let off = |kind: &str, elements: usize| {
        let (count, elbow) = (elements.to_string(), format!("frame.{elements}"));
        let kind = format!("\"{kind}\"");
        let own = [
            ("beam.frame.elements", &*count),
            ("beam.frame.element", &*kind),
            ("load.shake.body", &*elbow),
            ("sensor.elbow.of", &*elbow),
            ("simulation.strain", "averaged"),
        ];
        let mut run = Run::with(ELBOW, 0.0125, 2, &own);
        let mut found = [0.0; 4];
        for (k, t) in [2.0, 5.0].into_iter().enumerate() {
            run.until(t);
            for (j, node) in [elements, 2 * elements + 1].into_iter().enumerate() {
                found[2 * k + j] = run.q()[12 * node + 2];
            }
        }
        let errors = found.iter().zip(LIMIT).map(|(found, limit)| (found - limit).abs());
        let worst = errors.fold(0.0, f64::max);
        println!("{kind}, {elements} elements a leg: {found:.4?}, off by {worst:.1e} m");
        worst
    };
    let (old, own) = (off("mean_directors", 8), off("helicoidal", 8));
    let second = off("second_order", 8);
    assert!(own < 0.03 && own < old && second < old, "{own}, {second}, {old}");
}

/// Ends at 5 s: inertia of the section out of proportion is that of `second_order`.
#[test]
fn a_flying_beam_of_few_elements_flies_as_of_many() {
    const LIMIT: [f64; 4] = [9.7831, 8.2057, 8.0747, 1.7575];
    let off = |kind: &str, elements: usize| {
        let (count, kind) = (elements.to_string(), format!("\"{kind}\""));
        let own = [
            ("beam.beam.elements", &*count),
            ("beam.beam.element", &*kind),
            ("simulation.strain", "averaged"),
        ];
        let mut run = Run::with(FLYING_BEAM, 0.01, 2, &own);
        run.until(5.0);
        let [linear, _] = run.momentum();
        assert!((linear - nalgebra::Vector3::new(20.0, 0.0, 0.0)).amax() < 1e-10, "{linear}");
        let q = run.q();
        let found = [q[0], q[1], q[12 * elements], q[12 * elements + 1]];
        let errors = found.iter().zip(LIMIT).map(|(found, limit)| (found - limit).abs());
        let worst = errors.fold(0.0, f64::max);
        println!("{kind}, {elements} elements: {found:.4?}, off by {worst:.1e} m");
        worst
    };
    let (coarse, fine) = (off("second_order", 10), off("second_order", 20));
    let (own, old) = (off("helicoidal", 20), off("mean_directors", 20));
    assert!(fine < coarse && fine < own && own < old, "{coarse}, {fine}, {own}, {old}");
}

/// Spun up to 6 rad/s in 15 s about its end, a beam is stretched by its own mass:
/// `ρA ω² L³/3EA`.
///
/// Source: J. C. Simo, L. Vu-Quoc, J. Appl. Mech. 53 (1986) 855–863.
#[test]
fn a_beam_spins_up_and_is_stretched() {
    // (6/15) (t²/2 + (15/2π)² (cos 2πt/15 − 1))
    let path = format!(
        "{{ acceleration = 0.4, amplitude = {:?}, frequency = {:?}, phase = {:?} }}",
        0.4 * (15.0 / TAU).powi(2),
        1.0 / 15.0,
        0.25 * TAU
    );
    let tip = |elements: usize| {
        let text = [
            head("spin_up", "step = 0.02, end = 15.0"),
            body("hub", 1.0, [1.0; 3]),
            hinge("mast", ["ground", "hub"], [0.0; 3], AXES[2]),
            beam("blade", &[[0.0; 3], [10.0, 0.0, 0.0]], elements) + "normal = [0, 0, 1]\n",
            section([2.8e7, 1e7, 1e7, 1e4, 1.4e4, 1.4e4], [1.2, 6e-4, 6e-4]),
            joint("fixed", "root", ["hub", "blade.start"], [0.0; 3]),
            motion("drive", "mast", &path),
            "[[sensor]]\nname = \"tip\"\ntype = \"position\"\nof = \"blade.end\"\n\
             seen_from = \"hub\"\n"
                .into(),
        ]
        .concat();
        samples(&mut Simulation::new(&model(&text, &[])).unwrap())
    };
    let lag = |rows: &[Sample]| rows.iter().map(|row| row.sensors[1]).fold(0.0, f64::min);
    let (coarse, fine) = (tip(4), tip(16));
    let stretched = coarse.last().unwrap().sensors[0] - 10.0;
    let right = 1.2 * 36.0 * 1000.0 / (3.0 * 2.8e7);
    let lags = [lag(&coarse), lag(&fine)];
    println!("longer by {stretched:.3e} m, closed form {right:.3e} m; lags by {lags:.4?} m");
    // bending that is left shortens it
    assert!((stretched / right - 1.0).abs() < 0.02, "{stretched:e}");
    assert!((lags[0] - lags[1]).abs() < 2e-3 && lags[1] < -0.3, "{lags:?}");
}
