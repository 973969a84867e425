//! Bodies and beams joined and free in space: momentum maps are constant to round-off and the
//! energy is bounded.
//!
//! Motion passes slowly to ever faster vibrations, of which `H_d` sees more than there is by a part
//! of `(hω)²`: over 10⁵ steps at `h ω_max = 0.9` it creeps up by 7e-4 of itself.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::Run;
use nalgebra::Vector3;

const MULTIBODY: &str = include_str!("../../examples/models/flexible_multibody.toml");
const FLYING: &str = include_str!("../../examples/models/flying_beam.toml");
const RING: &str = include_str!("../../examples/models/elastic_ring.toml");

/// After the pulse: drifts of linear and angular momentum, and the range of the energy in both
/// halves of `steps` steps, observed every `every` steps.
fn free_flight(run: &mut Run, steps: usize, every: usize) -> ([f64; 2], [(f64, f64); 2]) {
    let start = run.momentum();
    let mut drift = [0.0_f64; 2];
    let mut bands = [(f64::INFINITY, f64::NEG_INFINITY); 2];
    let count = steps / every;
    for k in 0..count {
        run.steps(every);
        let energy = run.energy();
        let band = &mut bands[2 * k / count];
        *band = (band.0.min(energy), band.1.max(energy));
        for (drift, (now, start)) in drift.iter_mut().zip(run.momentum().iter().zip(&start)) {
            *drift = drift.max((now - start).amax());
        }
    }
    (drift, bands)
}

fn report(what: &str, steps: usize, drift: [f64; 2], bands: [(f64, f64); 2]) {
    println!(
        "{what}, {steps} steps: momentum drifts by {:.1e} (linear) and {:.1e} (angular); energy in [{:.7}, {:.7}], \
         then in [{:.7}, {:.7}] J",
        drift[0], drift[1], bands[0].0, bands[0].1, bands[1].0, bands[1].1
    );
}

/// The pulse gives what its history says, and then nothing is lost.
fn multibody(steps: usize, every: usize) -> ([f64; 2], [(f64, f64); 2]) {
    let mut run = Run::new(MULTIBODY, 0.002, 2);
    let stiffness = run.simulation.assembly().stiffness.clone().unwrap();
    assert!(stiffness.h_omega_max < 1.0, "{stiffness:?}");
    run.until(0.5);
    let [linear, _] = run.momentum();
    assert!((linear - Vector3::new(1.0, 0.5, 0.25)).amax() < 1e-13, "{linear}");
    let (drift, bands) = free_flight(&mut run, steps, every);
    report("flexible multibody", steps, drift, bands);
    assert!(run.residual() < 1e-13);
    (drift, bands)
}

#[test]
fn nothing_is_lost_after_the_pulse() {
    let (drift, bands) = multibody(4000, 10);
    assert!(drift[0] < 1e-13 && drift[1] < 1e-12, "{drift:?}");
    assert!(bands.iter().all(|band| band.1 - band.0 < 1e-4 * band.1), "{bands:?}");
}

/// As above over 10⁵ steps: a minute.
#[test]
#[ignore = "a minute; run with --ignored"]
fn nothing_is_lost_in_a_hundred_thousand_steps() {
    let (drift, bands) = multibody(100_000, 50);
    assert!(drift[0] < 1e-12 && drift[1] < 2e-12, "{drift:?}");
    let (low, high) = (bands[0].0.min(bands[1].0), bands[0].1.max(bands[1].1));
    println!("energy: all values within {:.1e} of one another", (high - low) / high);
    assert!(high - low < 1e-3 * high, "{bands:?}");
}

/// Angular momentum of −230 kg·m²/s: 1e-12 is five times its last bit in 1460 steps.
#[test]
fn the_flying_beam_conserves_its_angular_momentum_to_the_last_bits() {
    angular_momentum_of_the_flying_beam(&[0.005]);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn the_flying_beam_conserves_its_angular_momentum_in_small_steps() {
    angular_momentum_of_the_flying_beam(&[0.001]);
}

fn angular_momentum_of_the_flying_beam(steps: &[f64]) {
    for &h in steps {
        let mut run = Run::new(FLYING, h, 2);
        run.until(2.5);
        let (drift, bands) = free_flight(&mut run, 1460, 1);
        report("flying beam", 1460, drift, bands);
        assert!(drift[0] < 1e-12 && drift[1] < 1e-12, "h = {h} s: {drift:?}");
    }
}

/// A ring closed by a weld: the loop is elastic but for one joint, a tree for the null space.
#[test]
fn a_closed_ring_turns_for_ever() {
    let mut run = Run::new(RING, 0.002, 2);
    let assembly = run.simulation.assembly();
    assert_eq!((assembly.counts.dof, assembly.counts.redundant_constraints), (192, 0));
    let (drift, bands) = free_flight(&mut run, 500, 10);
    report("elastic ring", 500, drift, bands);
    assert!(drift[0] < 1e-13 && drift[1] < 1e-12, "{drift:?}");
    assert!(bands.iter().all(|band| band.1 - band.0 < 1e-4), "{bands:?}");
    let (start, end) = (run.coordinates("ring.0"), run.coordinates("ring.32"));
    let gap = (0..3).map(|i| (start[i] - end[i]).abs()).fold(0.0, f64::max);
    assert!(gap < 1e-14, "the weld opens by {gap:e} m");
}
