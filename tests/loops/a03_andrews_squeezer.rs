//! IFToMM A03: Andrews' squeezing mechanism as hinges in space, against the IVP test set.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Rotation, Run, assert_order, study};

const MODEL: &str = include_str!("../../examples/models/andrews_squeezer.toml");

/// β, Θ, γ, Φ, δ, Ω, ε at the start and at t = 0.03 (PSIDE, tolerances 1e-14).
const START: [f64; 7] = [
    -0.061_713_890_014_276_45,
    0.0,
    0.455_279_819_163_070_4,
    0.222_668_390_165_885_88,
    0.487_364_979_543_842_55,
    -0.222_668_390_165_885_88,
    1.230_547_444_549_821_2,
];
const AT_30_MS: [f64; 7] = [
    15.810_771_196_299_04,
    -15.756_371_059_842_98,
    0.040_822_240_130_731_01,
    -0.534_730_116_322_694_8,
    0.524_409_965_880_530_4,
    0.534_730_116_322_694_8,
    1.048_080_741_042_263,
];

/// The seven angles from the attitudes of K1, …, K7.
struct Angles(Vec<Rotation>);

impl Angles {
    fn new(run: &mut Run) -> Self {
        let [beta, theta, gamma, phi, delta, omega, epsilon] = START;
        let attitudes = [beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon];
        let turn = |(k, angle): (usize, &f64)| {
            Rotation::new(run, &format!("K{}", k + 1), [0.0, 0.0, 1.0], *angle)
        };
        Self(attitudes.iter().enumerate().map(turn).collect())
    }

    fn values(&self) -> [f64; 7] {
        let k = |i: usize| self.0[i - 1].angle;
        [k(1), k(2) - k(1), k(3), k(4) - k(5), k(5), k(6) - k(7), k(7)]
    }
}

/// The largest error of the seven angles at 0.03 s, and of energy less work along the run.
fn errors(h: f64, order: u32) -> (f64, f64) {
    let mut run = Run::new(MODEL, h, order);
    let mut angles = Angles::new(&mut run);
    let (energy, mut balance) = (run.energy(), 0.0_f64);
    for _ in 0..(0.03 / h).round() as usize {
        run.steps(1);
        angles.0.iter_mut().for_each(|turn| turn.follow(&mut run));
        let work = 0.033 * (angles.values()[0] - START[0]);
        balance = balance.max((run.energy() - energy - work).abs());
    }
    let found = angles.values();
    let worst = found.iter().zip(AT_30_MS).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!(
        "order {order}, h = {h:.2e}: angles {worst:.2e} rad, energy less work {balance:.2e} J"
    );
    assert!(run.residual() < 1e-13);
    (worst, balance)
}

#[test]
fn the_start_closes_and_the_redundant_hinges_are_named() {
    let mut run = Run::new(MODEL, 1e-5, 2);
    let report = run.simulation.assembly();
    println!("{report:?}");
    assert!(report.closure.position < 1e-15, "{:e}", report.closure.position);
    assert_eq!((report.counts.dof, report.counts.redundant_constraints), (1, 9));
    assert_eq!(report.redundant, ["E3", "E4", "E6"]);
    let energy = run.energy();
    assert!(energy > 0.0, "the spring is stretched: {energy} J");
}

#[test]
fn the_angles_of_the_test_set_are_reached() {
    let (_, orders) = study("angles at 0.03 s, order 2", &[2e-5, 1e-5, 5e-6], |h| errors(h, 2).0);
    assert_order(&orders, 2.0, 0.2);
    // the values of the test set are good to about 2e-9
    let (_, orders) = study("angles, order 4", &[1e-4, 5e-5, 2.5e-5], |h| errors(h, 4).0);
    assert_order(&orders, 4.0, 0.5);
    let (found, _) = study("angles, order 6", &[1e-4, 5e-5], |h| errors(h, 6).0);
    assert!(found[1] < 1e-8, "{:e}", found[1]);
    let (found, _) = study("angles, order 8", &[1e-4, 5e-5], |h| errors(h, 8).0);
    assert!(found[1] < 1e-8, "{:e}", found[1]);
}
