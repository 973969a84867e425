//! Published flexible systems: the flying beam and the right-angle cantilever of Simo & Vu-Quoc
//! approach the independent limits with order 2 in the length of the elements.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, orders};

const FLYING_BEAM: &str = include_str!("../../examples/models/flying_beam.toml");
const ELBOW: &str = include_str!("../../examples/models/elbow_cantilever.toml");

/// Energy, angular momentum, both ends (x, y) at t = 5 s.
fn flight(elements: usize, h: f64) -> [f64; 6] {
    let elements = elements.to_string();
    let mesh = [
        ("beam.beam.elements", elements.as_str()),
        // the smaller error of the step: this is about the elements
        ("simulation.strain", "averaged"),
    ];
    let mut run = Run::with(FLYING_BEAM, h, 2, &mesh);
    run.until(5.0);
    let [linear, angular] = run.momentum();
    assert!((linear - nalgebra::Vector3::new(20.0, 0.0, 0.0)).amax() < 1e-11, "{linear}");
    let (first, last) = (run.coordinates("beam.0"), run.simulation.members().len() - 1);
    let last = run.coordinates(&format!("beam.{last}"));
    [run.energy(), angular.z, first[0], first[1], last[0], last[1]]
}

/// The impulse of the push and the displacement of the centre of mass are exact for every mesh and
/// step.
#[test]
fn the_centre_of_mass_of_the_flying_beam_is_exact() {
    let mut run = Run::with(FLYING_BEAM, 0.05, 2, &[("beam.beam.elements", "24")]);
    for (t, x) in [(1.0, 3.4), (2.5, 5.5), (4.0, 8.5)] {
        run.until(t);
        let nodes: Vec<f64> = run.q().chunks(12).map(|node| node[0]).collect();
        let sides = nodes.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let center = sides.sum::<f64>() / 24.0; // equal elements of uniform mass
        println!("t = {t}: centre of mass off by {:.1e} m", center - x);
        assert!((center - x).abs() < 1e-12, "{center}, not {x}");
    }
}

#[test]
fn the_flying_beam_approaches_the_independent_limits() {
    const LIMIT: [f64; 6] = [379.62, -229.518, 9.7831, 8.2057, 8.0747, 1.7575];
    let sizes: Vec<f64> = [20.0, 40.0, 80.0].map(|n| 10.0 / n).into();
    let found: Vec<[f64; 6]> = [20, 40, 80].map(|n| flight(n, 0.01)).into();
    println!("{found:.4?}");
    let error = |k: usize| -> Vec<f64> { found.iter().map(|f| (f[k] - LIMIT[k]).abs()).collect() };
    let momentum = orders("angular momentum, length of elements", &sizes, &error(1));
    assert_order(&momentum, 2.0, 0.15);
    let place = orders("x of the pushed end", &sizes, &error(2));
    assert_order(&place, 2.0, 0.3);
    let within = [0.2, 4e-3, 1e-2, 5e-3, 5e-3, 1e-2]; // x of the pushed end: order 2.07
    for k in 0..6 {
        let limit = found[2][k] + (found[2][k] - found[1][k]) / 3.0; // of order 2
        println!("quantity {k}: {limit:.4} against {}", LIMIT[k]);
        assert!((limit - LIMIT[k]).abs() < within[k], "quantity {k}: {limit}");
    }
}

/// Largest and smallest `z` of the tip and smallest `z` of the elbow with their times, by parabolas
/// through the nodes next to them.
fn extrema(elements: usize, h: f64) -> [(f64, f64); 3] {
    let (count, elbow) = (elements.to_string(), format!("frame.{elements}"));
    let own = [
        ("beam.frame.elements", count.as_str()),
        ("load.shake.body", elbow.as_str()),
        ("sensor.elbow.of", elbow.as_str()),
        ("simulation.strain", "averaged"),
    ];
    let mut run = Run::with(ELBOW, h, 2, &own);
    let tip = 12 * run.simulation.members().len() - 12 + 2;
    let mut rows: Vec<[f64; 2]> = Vec::new();
    while run.t() < 16.5 {
        rows.push([run.q()[tip], run.q()[12 * elements + 2]]);
        run.steps(1);
    }
    let extremum = |column: usize, sign: f64| {
        let value = |k: usize| sign * rows[k][column];
        let k = (1..rows.len() - 1).max_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap();
        let (a, b, c) = (value(k - 1), value(k), value(k + 1));
        let shift = 0.5 * (a - c) / (a - 2.0 * b + c);
        (sign * (b - 0.25 * (a - c) * shift), h * (k as f64 + shift))
    };
    [extremum(0, 1.0), extremum(0, -1.0), extremum(1, -1.0)]
}

#[test]
fn the_elbow_swings_as_the_independent_computations_say() {
    let limit = [(8.252, 7.44), (-9.728, 15.87), (-4.061, 10.87)];
    let (coarse, fine) = (extrema(10, 0.05), extrema(20, 0.05));
    for (k, what) in ["tip, largest", "tip, smallest", "elbow, smallest"].into_iter().enumerate() {
        let errors = [coarse[k].0 - limit[k].0, fine[k].0 - limit[k].0];
        let richardson = fine[k].0 + (fine[k].0 - coarse[k].0) / 3.0;
        println!(
            "{what}: {:.4} m, {:.4} m, extrapolated {richardson:.4} m at {:.3} s (limit {} m at {} s), order {:.2}",
            coarse[k].0,
            fine[k].0,
            fine[k].1,
            limit[k].0,
            limit[k].1,
            (errors[0] / errors[1]).log2()
        );
        assert!((richardson - limit[k].0).abs() < 4e-3, "{what}: {richardson}");
        assert!((fine[k].1 - limit[k].1).abs() < 0.02, "{what}: at {} s", fine[k].1);
        assert!(errors[1].abs() < 0.02, "{what}: {}", fine[k].0);
    }
}
