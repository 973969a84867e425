//! The shadow energy of chaotic motions, and the fastest frequency of a system.

use holonom::Model;
use holonom::certificate::subject::ModelSubject;
use holonom::verification::measure::long_run;
use holonom::verification::subject::{SchemeSetting, SteppingMethod, Subject};
use holonom::verification::trend::trend;
use holonom::vi_constraints::SchemeKind;

/// In chaotic motion the means of `H_d` vary by a good part of the band, those of the shadow energy
/// by `h²` of it.
#[test]
fn it_is_conserved_where_the_energy_varies() {
    conserved_shadow(6_000);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn it_is_conserved_over_20_000_steps() {
    conserved_shadow(20_000);
}

fn conserved_shadow(steps: u64) {
    let text = include_str!("../../examples/models/four_particles.toml");
    let subject = ModelSubject::new(Model::from_toml(text).unwrap());
    for (scheme, order, h) in [
        (SchemeKind::Nodal, 2, 0.01),
        (SchemeKind::Nodal, 2, 0.005),
        (SchemeKind::Constrained, 2, 0.005),
        (SchemeKind::Nodal, 4, 0.005),
        (SchemeKind::Nodal, 6, 0.02),
    ] {
        let setting = SchemeSetting::new(SteppingMethod::Variational(scheme), order, h);
        let run = long_run(&subject, setting, steps).unwrap();
        let energy = trend(&run.energies(), &run.energies()).unwrap();
        let shadow = trend(&run.energies(), &run.shadow_energies()).unwrap();
        let [energy, shadow] = [energy, shadow].map(|t| t.variation / t.width());
        println!(
            "order {order}, h = {h} s: the means of H_d vary by {energy:.3}, those of the shadow by {shadow:.1e}"
        );
        assert!(energy > 0.1 && shadow < energy / 50.0, "{energy} {shadow:e}");
    }
}

fn found(text: &str) -> f64 {
    let subject = ModelSubject::new(Model::from_toml(text).unwrap());
    let mut motion = subject.start(SchemeSetting::new(SteppingMethod::NODAL, 2, 0.01)).unwrap();
    motion.frequency().unwrap().unwrap()
}

#[test]
fn rotation_gravity_and_springs_are_seen() {
    // uniform rotation at 1 rad/s; m l² θ̈ = 0 but centrifugal stiffness l λ = 1
    let rotation = found(include_str!("../../examples/models/pendulum_free.toml"));
    println!("uniform rotation at 1 rad/s: {rotation:.6}");
    assert!((rotation - 1.0).abs() < 1e-12, "{rotation}");
    let beam = found(include_str!("../../examples/models/flying_beam.toml"));
    // the shear–rotation vibrations of a lumped element: √(12 EA/(ρA ℓ²)) = 693 rad/s
    println!("flying beam: {beam:.1} rad/s");
    assert!((600.0..750.0).contains(&beam), "{beam}");
}
