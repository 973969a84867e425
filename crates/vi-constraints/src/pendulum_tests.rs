//! The planar pendulum of LMO08 §3.1: closed forms, agreement of the schemes, orders, conditioning.

use crate::InitialValues;
use crate::integrator::{Integrator, Options};
use crate::reparametrization::Reparametrization;
use crate::scheme::SchemeKind;
use crate::{ConstraintFn, Constraints};
use nalgebra::DMatrix;
use vi_core::composition::Composition;
use vi_core::interval::Interval;
use vi_core::newton::{BlockKind, Fault, UnknownBlock};
use vi_core::potential::LinearPotential;
use vi_core::{Configuration, Entries, SeparableSystem};

struct Rod;
impl Constraints for Rod {
    fn dim(&self) -> usize {
        2
    }
    fn len(&self) -> usize {
        1
    }
    fn value(&self, Configuration { q, .. }: Configuration<'_>, out: &mut [f64]) {
        out[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0);
    }
    fn jacobian(&self, _t: f64, q: &[f64], out: &mut dyn Entries) {
        out.add(0, 0, q[0]);
        out.add(0, 1, q[1]);
    }
    fn second_derivative(&self, _t: f64, _q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        out[0] = v[0] * w[0] + v[1] * w[1];
    }
}

/// `F_d(u, q_n) = Rot(u) q_n`, LMO08 (48), (49).
struct PlanarRotation;
impl Reparametrization for PlanarRotation {
    fn dof(&self) -> usize {
        1
    }
    fn blocks(&self) -> Vec<UnknownBlock> {
        vec![UnknownBlock { kind: BlockKind::Rotation, range: 0..1, floor: 1e-10 }]
    }
    fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>) {
        (out[(0, 0)], out[(1, 0)]) = (-q[1], q[0]);
    }
    fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        let (half, c) = ((0.5 * u[0]).sin(), (0.5 * u[0]).cos());
        let (sin, cos_minus_1) = (2.0 * half * c, -2.0 * half * half);
        s.dq[0] = cos_minus_1 * s.q0[0] - sin * s.q0[1];
        s.dq[1] = sin * s.q0[0] + cos_minus_1 * s.q0[1];
        (s.q1[0], s.q1[1]) = (s.q0[0] + s.dq[0], s.q0[1] + s.dq[1]);
        Ok(())
    }
    fn tangent(&self, _u: &[f64], s: &Interval, out: &mut DMatrix<f64>) {
        (out[(0, 0)], out[(1, 0)]) = (-s.q1[1], s.q1[0]);
    }
    fn clean(&self, _t: f64, q: &mut [f64]) {
        let defect = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0);
        (q[0], q[1]) = (q[0] - defect * q[0], q[1] - defect * q[1]);
    }
}

fn pendulum(gravity: f64, options: Options, v: f64) -> Integrator<SeparableSystem, Rod> {
    let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
        .potential(LinearPotential { force: vec![0.0, -gravity] });
    let v = [0.0, v];
    let at = InitialValues::new(0.0, &[1.0, 0.0], &v);
    Integrator::with_reparametrization(system, Rod, PlanarRotation, options, at).unwrap()
}

#[test]
fn without_potential_the_discrete_solution_is_a_uniform_rotation() {
    for scheme in SchemeKind::ALL {
        for h in [0.1_f64, 0.8] {
            let mut run = pendulum(0.0, Options::new(scheme, h), 1.0);
            let root = (1.0 - h * h).sqrt();
            let lambda = 2.0 * (1.0 - root) / (h * h);
            let energy = (1.0 - root) / (h * h);
            let mut worst = [0.0_f64; 6];
            for n in 0..200_u32 {
                run.step().unwrap();
                let angle = f64::from(n) * h.asin();
                let node = run.node_before().unwrap().clone();
                let p_exact = [-angle.sin(), angle.cos()];
                let q = run.before().q.clone();
                let deviations = [
                    (q[0] - angle.cos()).hypot(q[1] - angle.sin()),
                    (node.lambda[0] - lambda).abs(),
                    (node.p[0] - p_exact[0]).hypot(node.p[1] - p_exact[1]),
                    (node.discrete_energy.total() - energy).abs(),
                    (node.hamiltonian.unwrap().total() - 0.5).abs(),
                    node.momentum_residual,
                ];
                for (w, d) in worst.iter_mut().zip(deviations) {
                    *w = w.max(d);
                }
            }
            println!("{scheme:?} h = {h}: q, λ, p, E_d, H_d, h_d off by {worst:?}");

            let limits = [5e-13, 1e-13, 5e-13, 1e-13, 1e-13, 2e-13];
            for (w, limit) in worst.iter().zip(limits) {
                assert!(*w <= limit, "{scheme:?} h = {h}: {worst:?}");
            }
        }
    }
}

#[test]
fn the_four_schemes_agree_and_the_qr_null_space_with_them() {
    let run = |scheme| {
        let mut run = pendulum(9.81, Options::new(scheme, 0.05), 0.0);
        (0..200).for_each(|_| assert!(run.step().is_ok()));
        run.state().clone()
    };
    let reference = run(SchemeKind::Nodal);
    for scheme in SchemeKind::ALL {
        let state = run(scheme);
        let off = (state.q[0] - reference.q[0]).hypot(state.q[1] - reference.q[1]);
        println!("{scheme:?}: off by {off:.1e} after 200 steps");
        assert!(off < 1e-11, "{scheme:?}: {off:e}");
    }
    for scheme in [SchemeKind::Constrained, SchemeKind::Dalembert] {
        let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
            .potential(LinearPotential { force: vec![0.0, -9.81] });
        let rod = ConstraintFn::new(
            2,
            1,
            |q, g| g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0),
            |q, g| (g[(0, 0)], g[(0, 1)]) = (q[0], q[1]),
        );
        let options = Options::new(scheme, 0.05);
        let mut run =
            Integrator::new(system, rod, options, InitialValues::new(0.0, &[1.0, 0.0], &[0.0; 2]))
                .unwrap();
        (0..200).for_each(|_| assert!(run.step().is_ok()));
        let off = (run.state().q[0] - reference.q[0]).hypot(run.state().q[1] - reference.q[1]);
        assert!(off < 1e-11, "{scheme:?} with closures: {off:e}");
    }
}

/// Errors of `(q, ᵠp, λ of the acceleration level)` against the closed form of the pendulum at
/// t = 1.
fn errors(composition: Composition, steps: u32) -> [f64; 3] {
    let options = Options::new(SchemeKind::Nodal, 1.0 / f64::from(steps)).composition(composition);
    let mut run = pendulum(9.81, options, 0.0);
    (0..steps).for_each(|_| assert!(run.step().is_ok()));
    // exact at t = 1 (benchmark A01, start at x = −1 by symmetry): energy gives the speed
    let (x, y) = (-0.986_291_751_132_f64, -0.165_010_853_126_f64);
    let speed = (2.0 * 9.81 * -y).sqrt();
    let (px, py) = (speed * y, -speed * x);
    let sign = if run.state().p[0] * px + run.state().p[1] * py > 0.0 { 1.0 } else { -1.0 };
    let lambda = speed * speed - 9.81 * y;
    let found = run.acceleration_multiplier().unwrap()[0];
    let (q, p) = (run.state().q.clone(), run.observe().unwrap().p_projected.clone());
    [(q[0] - x).hypot(q[1] - y), (p[0] - sign * px).hypot(p[1] - sign * py), (found - lambda).abs()]
}

#[test]
fn orders_of_q_p_and_lambda() {
    for (composition, steps) in [
        (Composition::Identity, 100),
        (Composition::Suzuki5, 40),
        (Composition::TripleJump, 80),
        (Composition::KahanLi9, 12),
    ] {
        let (coarse, fine) = (errors(composition, steps), errors(composition, 2 * steps));
        let orders = [0, 1, 2].map(|k| (coarse[k] / fine[k]).log2());
        println!("{composition:?}: orders of q, ᵠp, λ: {orders:.2?}");
        for order in orders {
            let nominal = f64::from(composition.order());
            assert!((order - nominal).abs() < 0.35, "{composition:?}: {orders:?}");
        }
    }
}

#[test]
fn condition_numbers_against_the_step() {
    let at = |scheme, h| {
        let mut run = pendulum(9.81, Options::new(scheme, h), 0.0);
        (0..3).for_each(|_| assert!(run.step().is_ok()));
        run.condition().unwrap()
    };
    for scheme in SchemeKind::ALL {
        let (coarse, fine) = (at(scheme, 1e-2), at(scheme, 1e-3));
        let written = (fine.as_written / coarse.as_written).log10();
        let scaled = (fine.scaled / coarse.scaled).log10();
        println!("{scheme:?}: κ ~ h^{:.2} as written, h^{:.2} scaled", -written, -scaled);
        let expected = match scheme {
            SchemeKind::Constrained => 3.0,
            SchemeKind::Dalembert => 1.0,
            SchemeKind::Nodal | SchemeKind::Reduced => 0.0,
        };
        assert!((written - expected).abs() < 0.1, "{scheme:?}: κ ~ h^{:.2}", -written);
        assert!(scaled.abs() < 0.1, "{scheme:?}: scaled κ ~ h^{:.2}", -scaled);
    }
}

#[test]
fn an_inconsistent_start_is_projected_and_reported() {
    let system = SeparableSystem::with_diagonal_mass(&[1.0, 2.0]);
    let options = Options::new(SchemeKind::Constrained, 0.1);
    let at = InitialValues::new(0.0, &[1.2, 0.1], &[0.5, 1.0]);
    let run = Integrator::new(system, Rod, options, at).unwrap();
    let report = run.start_report();
    println!("{report:?}");
    let (q, v) = (&run.state().q, run.initial_velocity());
    assert!((q[0].hypot(q[1]) - 1.0).abs() < 1e-14);
    assert!((q[0] * v[0] + q[1] * v[1]).abs() < 1e-14);
    assert!(report.position_moved > 0.1 && report.velocity_moved > 0.1);
    // closest in the norm of M: M (q − q*) is parallel to Gᵀ = q
    let cross = (q[0] - 1.2) * q[1] - 2.0 * (q[1] - 0.1) * q[0];
    assert!(cross.abs() < 1e-11, "not the closest point: {cross:e}");
}

#[test]
fn time_reverses() {
    for composition in [Composition::Identity, Composition::Suzuki5] {
        let options = Options::new(SchemeKind::Nodal, 0.02).composition(composition);
        let mut run = pendulum(9.81, options, 0.3);
        (0..500).for_each(|_| assert!(run.step().is_ok()));
        run.reverse();
        (0..500).for_each(|_| assert!(run.step().is_ok()));
        let off = (run.state().q[0] - 1.0).hypot(run.state().q[1]);
        println!("{composition:?}: 500 steps and back, off by {off:.1e}");
        assert!(off < 1e-11, "{off:e}");
    }
}

#[test]
fn a_failed_step_leaves_the_state_alone() {
    let mut run = pendulum(9.81, Options::new(SchemeKind::Constrained, 5.0), 3.0);
    let mut failed = false;
    for _ in 0..50 {
        let before = run.state().clone();
        if run.step().is_err() {
            assert_eq!(run.state(), &before);
            failed = true;
            break;
        }
    }
    assert!(failed, "a step of 5 s cannot go well for ever");
}

/// Every scheme: a motion goes on, bit for bit, from a state that was stored, in an integrator that
/// is new and on another thread.
#[test]
fn a_stored_state_continues_bit_for_bit_on_another_thread() {
    for (scheme, composition) in SchemeKind::ALL
        .into_iter()
        .flat_map(|scheme| [(scheme, Composition::Identity), (scheme, Composition::Suzuki5)])
    {
        let options = Options::new(scheme, 0.1).composition(composition);
        let mut run = pendulum(9.81, options, 0.3);
        (0..7).for_each(|_| assert!(run.step().is_ok()));
        let stored = serde_json::to_string(run.state()).unwrap();
        (0..20).for_each(|_| assert!(run.step().is_ok()));
        let mut again = pendulum(9.81, options, 0.3);
        again.resume(serde_json::from_str(&stored).unwrap()).unwrap();
        let moved = std::thread::spawn(move || {
            (0..20).for_each(|_| assert!(again.step().is_ok()));
            again.state().clone()
        });
        assert_eq!(moved.join().unwrap(), *run.state(), "{scheme:?} {composition:?}");
    }
}

#[test]
fn a_state_of_another_motion_is_refused() {
    let mut run = pendulum(9.81, Options::new(SchemeKind::Nodal, 0.1), 0.3);
    let before = run.state().clone();
    let with = |q: Vec<f64>| vi_core::State { q, ..before.clone() };
    for (q, message) in [
        (vec![1.0], "q of the state has 1 entries where 2 are needed"),
        (vec![f64::NAN, 0.0], "not finite"),
        (vec![2.0, 0.0], "constraint"),
    ] {
        let refused = run.resume(with(q)).unwrap_err().to_string();
        println!("{refused}");
        assert!(refused.contains(message), "{refused}");
        assert_eq!(run.state(), &before);
    }
}

/// Observing a node changes no bit of the steps after it.
#[test]
fn observing_changes_nothing() {
    for scheme in SchemeKind::ALL {
        let options = Options::new(scheme, 0.1);
        let (mut seen, mut unseen) = (pendulum(9.81, options, 0.3), pendulum(9.81, options, 0.3));
        for _ in 0..20 {
            seen.observe().unwrap();
            seen.observe_state().unwrap();
            seen.step().unwrap();
            unseen.step().unwrap();
        }
        assert_eq!(seen.state(), unseen.state(), "{scheme:?}");
    }
}

/// The tangent of a step against central differences of it, and the symplectic form.
#[test]
fn the_tangent_of_a_step_is_exact_and_symplectic() {
    use crate::tangent_map::{TangentMap, Tangents};
    for composition in [Composition::Identity, Composition::Suzuki5] {
        let options = Options::new(SchemeKind::Nodal, 0.1).composition(composition);
        // a motion that starts at the angle `a` with the rate `w`; its end
        let end = |a: f64, w: f64| {
            let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
                .potential(LinearPotential { force: vec![0.0, -9.81] });
            let (q, v) = ([a.cos(), a.sin()], [-w * a.sin(), w * a.cos()]);
            let at = InitialValues::new(0.0, &q, &v);
            let mut run =
                Integrator::with_reparametrization(system, Rod, PlanarRotation, options, at)
                    .unwrap();
            (0..3).for_each(|_| assert!(run.step().is_ok()));
            run.state().clone()
        };
        let mut run = pendulum(9.81, options, 0.3);
        let mut map = TangentMap::new(1, run.rows(), &run.state().p);
        // d/da and d/dw of the start (cos a, sin a, −w sin a, w cos a) at a = 0, w = 0.3
        let mut tangents = Tangents {
            dq: DMatrix::from_column_slice(2, 2, &[0.0, 1.0, 0.0, 0.0]),
            dp: DMatrix::from_column_slice(2, 2, &[-0.3, 0.0, 0.0, 1.0]),
        };
        let before = tangents.form();
        for _ in 0..3 {
            run.step_with(&mut |system, rod, s| map.push(system, rod, s.s, &mut tangents).unwrap())
                .unwrap();
        }
        let e = 1e-5;
        let pairs = [(end(e, 0.3), end(-e, 0.3)), (end(0.0, 0.3 + e), end(0.0, 0.3 - e))];
        let mut off = 0.0_f64;
        for (k, (plus, minus)) in pairs.iter().enumerate() {
            for i in 0..2 {
                let dq = (plus.q[i] - minus.q[i]) / (2.0 * e);
                let dp = (plus.p[i] - minus.p[i]) / (2.0 * e);
                off = off.max((dq - tangents.dq[(i, k)]).abs());
                off = off.max((dp - tangents.dp[(i, k)]).abs());
            }
        }
        let defect = tangents.defect(&before);
        println!("{composition:?}: off by {off:.1e} from differences, Ω changes by {defect:.1e}");
        assert!(off < 1e-8 && defect < 1e-14, "{off:e}, {defect:e}");
    }
}
