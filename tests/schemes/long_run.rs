//! 10⁵ steps of the pendulum: constraints, hidden constraints and energy.
//!
//! Physics: the pendulum without potential rotates uniformly, its angular momentum is exact; under
//! gravity the energy error of a symplectic scheme is bounded, without secular drift.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::simulation;
use holonom::certificate::subject::ModelSubject;
use holonom::nalgebra::DMatrix;
use holonom::verification::measure::{LongRun, long_run};
use holonom::verification::subject::{SchemeSetting, SteppingMethod};
use holonom::verification::trend::trend;
use holonom::vi_constraints::{InitialValues, Integrator, Options, Reparametrization, SchemeKind};
use holonom::vi_core::Interval;
use holonom::vi_core::linear::norm_inf;
use holonom::vi_core::newton::{Fault, UnknownBlock};
use holonom::vi_multibody::tree_map::TreeMap;
use holonom::{Model, system};

fn subject(text: &str) -> ModelSubject {
    ModelSubject::new(Model::from_toml(text).unwrap())
}

fn run(of: &ModelSubject, scheme: SchemeKind, order: u32, (h, steps): (f64, u64)) -> LongRun {
    long_run(of, SchemeSetting::new(SteppingMethod::Variational(scheme), order, h), steps).unwrap()
}

/// `max |x_n − x_0|`; numbers that are none are refused.
fn off(x: &[f64]) -> f64 {
    trend(x, x).unwrap().bound
}

#[test]
fn the_free_pendulum_keeps_constraint_and_momentum() {
    let subject = subject(include_str!("../../examples/models/pendulum_free.toml"));
    for scheme in SchemeKind::ALL {
        let run = run(&subject, scheme, 2, (0.1, 100_000));
        let spins = run.samples.iter().map(|node| node.momentum.angular[2] - 1.0);
        let drift = norm_inf(&spins.collect::<Vec<_>>()); // NaN stays NaN
        let (g, name) = (run.residuals().position, scheme.name());
        println!("{name}: {} steps, |g| ≤ {g:.1e}, angular momentum off by {drift:.1e}", run.steps);
        assert!(g <= 1e-15, "{name}: |g| = {g:e}");
        // ε√N = 7e-14; the nodal schemes carry the rounding error of the momentum balance to the
        // next step
        let handed = matches!(scheme, SchemeKind::Nodal | SchemeKind::Reduced);
        assert!(drift < if handed { 2e-14 } else { 3e-13 }, "{name}: off by {drift:e}");
    }
}

#[test]
fn the_pendulum_under_gravity_keeps_its_energy_without_a_trend() {
    let mut simulation = simulation("pendulum", &[("simulation.step", "0.05".into())]);
    let run = simulation.integrator();
    let (steps, block) = (100_000_u32, 5_000_u32);
    let (mut worst_g, mut worst_f, mut means, mut mean, mut extremes) =
        (0.0_f64, 0.0_f64, Vec::new(), 0.0, (f64::MAX, f64::MIN));
    for n in 1..=steps {
        run.step().unwrap();
        let node = run.node_before().unwrap();
        worst_g = worst_g.max(node.position_residual);
        worst_f = worst_f.max(node.velocity_residual);
        let h = node.hamiltonian_projected.total();
        extremes = (extremes.0.min(h), extremes.1.max(h));
        mean += h / f64::from(block);
        if n % block == 0 {
            means.push(mean);
            mean = 0.0;
        }
    }
    let amplitude = extremes.1 - extremes.0;
    let (first, last) = (means[0], means[means.len() - 1]);
    let trend = (last - first).abs() / amplitude;
    println!(
        "{steps} steps: |g| ≤ {worst_g:.1e}, velocity level ≤ {worst_f:.1e}, H_d within \
         {amplitude:.2e}, block means from {first:.3e} to {last:.3e} ({trend:.1e} of the band)"
    );
    assert!(worst_g <= 1e-13 && worst_f <= 1e-12);
    assert!(trend < 0.02, "the mean energy moves by {trend:.2e} of its band");
}

/// Parts that only springs hold together, far away from the origin: what rounding takes off their
/// positions must not add up, since no momentum answers such jumps.
#[test]
fn energy_does_not_walk_far_away_from_the_origin() {
    energy_far_away(500, 2e-12);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn energy_does_not_walk_far_away_from_the_origin_in_2000_steps() {
    energy_far_away(2000, 4e-12);
}

/// The allowed error grows as the square root of the number of steps.
fn energy_far_away(steps: u64, allowed: f64) {
    let text = include_str!("../../examples/models/four_particles.toml");
    let far = text.replace("position = [0.0,", "position = [1000.0,");
    let far = far.replace("position = [1.0,", "position = [1001.0,");
    let subject = subject(&far);
    for scheme in SchemeKind::ALL {
        let squares = [0.0042, 0.0047, 0.005, 0.0056]
            .map(|h| off(&run(&subject, scheme, 8, (h, steps)).energies()).powi(2));
        let off = (squares.iter().sum::<f64>() / 4.0).sqrt();
        println!("{}: energy off by {off:.1e} J in the mean of four steps", scheme.name());
        assert!(off < allowed, "{}: {off:e}", scheme.name());
    }
}

/// In a steady precession rounding errors are biased. They are compensated in the next step, so
/// that the angular momentum neither drifts nor grows like a random walk.
#[test]
fn the_angular_momentum_stays_within_a_few_last_bits() {
    let text = include_str!("../../examples/models/heavy_top_steady.toml");
    let subject = subject(text);
    for (scheme, order, steps) in [
        (SchemeKind::Nodal, 2, 100_000),
        (SchemeKind::Reduced, 2, 100_000),
        (SchemeKind::Nodal, 4, 20_000),
    ] {
        let off = off(&run(&subject, scheme, order, (0.0005, steps)).momentum(5));
        println!("{} of order {order}: Lz off by {off:.1e} of itself", scheme.name());
        assert!(off < 1e-14, "{}: {off:e}", scheme.name());
    }
}

/// A map whose directors keep the rounding errors of the steps, or not.
struct Directors {
    inner: TreeMap,
    corrected: bool,
}

impl Reparametrization for Directors {
    fn dof(&self) -> usize {
        self.inner.dof()
    }
    fn blocks(&self) -> Vec<UnknownBlock> {
        self.inner.blocks()
    }
    fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>) {
        self.inner.null_space(q, out);
    }
    fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.inner.reparametrize(u, s)
    }
    fn tangent(&self, u: &[f64], s: &Interval, out: &mut DMatrix<f64>) {
        self.inner.tangent(u, s, out);
    }
    fn clean(&self, t: f64, q: &mut [f64]) {
        if self.corrected {
            self.inner.clean(t, q);
        }
    }
}

/// Products of rotations accumulate rounding errors: directors are corrected where these have
/// passed a few ulp, which changes the energy by no more than rounding does. Without the correction
/// they drift.
#[test]
fn directors_stay_orthonormal_over_many_rotations() {
    let text = r#"
model = { name = "rotor" }
simulation = { step = 0.05, end = 1.0 }
body = [{ name = "nut", mass = 1.0, inertia = [1.0, 1.2, 1.5], angular_velocity = [0.9, 3.0, -1.4] }]
"#;
    let model = Model::from_toml(text).unwrap();
    let drifts = |corrected: bool| -> [f64; 2] {
        let built = system::build(&model).unwrap();
        let (forces, mechanism) = (built.dynamics.variational(&built.mechanism), built.mechanism);
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let map = Directors { inner: TreeMap::new(&mechanism), corrected };
        let at = InitialValues::new(0.0, &q, &v);
        let options = Options::new(SchemeKind::Nodal, 0.05);
        let mut run =
            Integrator::with_reparametrization(forces, mechanism, map, options, at).unwrap();
        let (mut g, mut energy) = (0.0_f64, 0.0_f64);
        let mut first = None;
        for _ in 0..100_000 {
            run.step().unwrap();
            let node = run.node_before().unwrap();
            g = g.max(node.position_residual);
            let now = node.hamiltonian_projected.total();
            let first = *first.get_or_insert(now);
            energy = energy.max((now / first - 1.0).abs());
        }
        [g, energy]
    };
    let [corrected, drifting] = [true, false].map(drifts);
    println!("corrected {corrected:?}, not {drifting:?}");
    assert!(corrected[0] < 3e-15, "{corrected:?}");
    assert!(drifting[0] > 3.0 * corrected[0], "the correction changes nothing: {drifting:?}");
    assert!(corrected[1] < 1e-13 && drifting[1] < 1e-13, "{corrected:?} {drifting:?}");
}
