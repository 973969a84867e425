//! Bodies that turn on a table: what friction cannot change, and which way they turn in the end.

use holonom::nalgebra::Vector3;
use holonom::{Model, Sample, Simulation};

type V = Vector3<f64>;

const TIPPE_TOP: &str = include_str!("../../examples/models/tippe_top.toml");
const RATTLEBACK: &str = include_str!("../../examples/models/rattleback.toml");

fn samples(text: &str) -> Vec<Sample> {
    let model = Model::from_toml(text).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    simulation.samples().map(|own| own.unwrap_or_else(|e| panic!("{}", e.message))).collect()
}

fn vector(numbers: &[f64]) -> V {
    V::new(numbers[0], numbers[1], numbers[2])
}

/// Jellett's integral `−L·r` of a body with an axis of symmetry whose surface is a sphere on that
/// axis: `L` its angular momentum, `r` from the centre of mass to the point of contact. The force
/// of contact acts in the end of `r`, and `L·ṙ = 0`, so no friction changes it.
fn jellett(sample: &Sample) -> f64 {
    let (inertia, radius, off) = (3.2e-6, 0.02, 0.006);
    let axis = vector(&sample.q[9..12]);
    let arm = axis * off - V::z() * radius;
    -inertia * vector(&sample.sensors).dot(&arm)
}

#[test]
fn a_tippe_top_turns_over_and_keeps_the_integral_of_jellett() {
    let all = samples(TIPPE_TOP);
    let height = |sample: &Sample| sample.q[11];
    let [first, last] = [&all[0], all.last().unwrap()];
    println!("d3 upwards by {:.4}, then {:.4}", height(first), height(last));
    assert!(height(first) > 0.95 && height(last) < -0.95);
    let drift = all.iter().map(|own| (jellett(own) / jellett(first) - 1.0).abs());
    let drift = drift.fold(0.0, f64::max);
    let lost = 1.0 - last.hamiltonian / first.hamiltonian;
    println!("integral of Jellett: off by {drift:.1e}; {:.0} % of the energy lost", 100.0 * lost);
    assert!(drift < 1e-13 && lost > 0.1, "{drift:e}, {lost}");
}

#[test]
fn a_rattleback_turns_back_from_one_side_alone() {
    let against = RATTLEBACK.replace("-5.0]", "5.0]");
    let spins =
        |text: &str| -> Vec<f64> { samples(text).iter().map(|own| own.sensors[2]).collect() };
    let [back, on] = [spins(RATTLEBACK), spins(&against)];
    let largest = back.iter().copied().fold(f64::MIN, f64::max);
    let least = on.iter().copied().fold(f64::MAX, f64::min);
    println!("from {} to {largest:.2} rad/s; from {} never below {least:.2} rad/s", back[0], on[0]);
    assert!(back[0] < -4.9 && largest > 0.5, "it comes back: {largest}");
    assert!(on[0] > 4.9 && least > 0.0, "it goes on: {least}");
}
