//! Systems without constraints: Kepler's problem, a damped oscillator, forced Legendre transforms.

use vi_constraints::{InitialValues, Integrator, Options, SchemeKind, Unconstrained};
use vi_core::force::{LinearDamping, MidpointForce};
use vi_core::legendre::{discrete_energy, p_minus, p_plus};
use vi_core::num_dual::DualNum;
use vi_core::potential::{DualPotential, ScalarField};
use vi_core::{Composition, DiscreteLagrangian, Quadrature, SeparableSystem};

type Run = Integrator<SeparableSystem, Unconstrained>;

fn integrator(
    system: SeparableSystem,
    (composition, h): (Composition, f64),
    (q, v): (&[f64], &[f64]),
) -> Run {
    let options = Options::new(SchemeKind::Constrained, h).composition(composition);
    Integrator::new(system, Unconstrained(q.len()), options, InitialValues::new(0.0, q, v)).unwrap()
}

fn take(run: &mut Run, steps: u32) {
    (0..steps).for_each(|_| assert!(run.step().is_ok()));
}

/// Kepler's problem, `V = −1/|q|`.
struct Kepler;
impl ScalarField<2> for Kepler {
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 2]) -> D {
        -(q[0] * q[0] + q[1] * q[1]).sqrt().recip()
    }
}

/// Eccentricity 0.4, perihelion at (0.6, 0), period 2π.
fn kepler(composition: Composition, h: f64) -> Run {
    let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0]).potential(DualPotential(Kepler));
    integrator(system, (composition, h), (&[0.6, 0.0], &[0.0, (1.4_f64 / 0.6).sqrt()]))
}

#[test]
fn kepler_orders_two_four_six() {
    let period = 2.0 * std::f64::consts::PI;
    for (composition, steps) in
        [(Composition::Identity, 400), (Composition::Suzuki5, 100), (Composition::KahanLi9, 60)]
    {
        let error = |steps: u32| {
            let mut run = kepler(composition, period / f64::from(steps));
            let exact = run.state().clone();
            take(&mut run, steps);
            let end = run.state();
            let dq = (end.q[0] - exact.q[0]).hypot(end.q[1] - exact.q[1]);
            let dp = (end.p[0] - exact.p[0]).hypot(end.p[1] - exact.p[1]);
            (dq, dp)
        };
        let (coarse, fine) = (error(steps), error(2 * steps));
        let (oq, op) = ((coarse.0 / fine.0).log2(), (coarse.1 / fine.1).log2());
        println!("{composition:?}: order of q {oq:.2}, of p {op:.2}");
        let nominal = f64::from(composition.order());
        assert!((oq - nominal).abs() < 0.3 && (op - nominal).abs() < 0.3, "{oq} {op}");
    }
}

#[test]
fn angular_momentum_is_exact_and_time_reverses() {
    let mut run = kepler(Composition::Identity, 0.05);
    let momentum = |run: &Run| {
        let state = run.state();
        state.q[0] * state.p[1] - state.q[1] * state.p[0]
    };
    let j0 = momentum(&run);
    let (mut drift, mut range) = (0.0_f64, (f64::MAX, f64::MIN));
    for _ in 0..2000 {
        run.step().unwrap();
        drift = drift.max((momentum(&run) - j0).abs());
        let e = discrete_energy(run.system(), run.interval()).total();
        range = (range.0.min(e), range.1.max(e));
    }
    println!("angular momentum drift {drift:.1e}, discrete energy in {range:?}");
    assert!(drift < 2e-14, "{drift:e}");
    assert!(range.1 - range.0 < 0.02);
    run.reverse();
    take(&mut run, 2000);
    let back = (run.state().q[0] - 0.6).hypot(run.state().q[1]);
    println!("2000 steps forward and back: off by {back:.1e}");
    assert!(back < 1e-10, "{back:e}");
}

#[test]
fn damping_takes_out_the_work_it_does_to_second_order() {
    // damped oscillator against the exact solution
    struct Spring;
    impl ScalarField<1> for Spring {
        fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 1]) -> D {
            q[0] * q[0] * 2.0
        }
    }
    let error = |steps: u32| {
        let damping = MidpointForce(LinearDamping { entries: vec![(0, 0, 0.4)] });
        let system = SeparableSystem::with_diagonal_mass(&[1.0])
            .potential(DualPotential(Spring))
            .force(Box::new(damping));
        let single = (Composition::Identity, 3.0 / f64::from(steps));
        let mut run = integrator(system, single, (&[1.0], &[0.0]));
        take(&mut run, steps);
        let (w, t) = ((4.0_f64 - 0.04).sqrt(), 3.0);
        let exact = (-0.2_f64 * t).exp() * ((w * t).cos() + 0.2 / w * (w * t).sin());
        (run.state().q[0] - exact).abs()
    };
    let order = (error(40) / error(80)).log2();
    println!("forced order {order:.2}");
    assert!((order - 2.0).abs() < 0.1, "{order}");
}

#[test]
fn both_transforms_agree_along_a_solution_with_damping() {
    struct Well;
    impl ScalarField<2> for Well {
        fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 2]) -> D {
            (q[0] * q[1]).sin() + q[0].powi(4) * 0.25 + q[1] * q[1]
        }
    }
    for quadrature in [Quadrature::Midpoint, Quadrature::Trapezoidal] {
        let entries = vec![(0, 0, 0.3), (0, 1, 0.15), (1, 1, 0.3)];
        let system = SeparableSystem::with_diagonal_mass(&[2.0, 0.5])
            .quadrature(quadrature)
            .potential(DualPotential(Well))
            .force(Box::new(MidpointForce(LinearDamping { entries })));
        let single = (Composition::Identity, 0.05);
        let mut run = integrator(system, single, (&[0.7, -0.2], &[0.5, 0.8]));
        let (mut plus, mut minus, mut unforced) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        let (mut off, mut force) = (0.0_f64, 0.0_f64);
        plus.copy_from_slice(&run.state().p);
        for _ in 0..100 {
            run.step().unwrap();
            let s = run.interval();
            p_minus(run.system(), s, &mut minus);
            run.system().d1(s, &mut unforced);
            for i in 0..2 {
                off = off.max((plus[i] - minus[i]).abs());
                force = force.max((minus[i] + unforced[i]).abs());
            }
            p_plus(run.system(), s, &mut plus);
        }
        println!("{quadrature:?}: |p⁺ − p⁻| = {off:.1e}, discrete force {force:.1e}");
        assert!(off < 1e-14, "{quadrature:?}: |p⁺ − p⁻| = {off:e}");
        assert!(force > 1e-3, "the force must matter here: {force:e}");
    }
}
