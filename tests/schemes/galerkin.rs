//! The Galerkin schemes of order `2s`: limit `s = 1`, orders, invariants, symplectic form,
//! reversal, restart, refusals.
#![allow(clippy::unwrap_used)] // a test

use crate::{benchmark, harness};

use benchmark::{CHAIN_TIP, Run, TOP_CENTER, apart, assert_order, study};
use harness::models::shipped;
use holonom::vi_constraints::galerkin::GalerkinTangent;
use holonom::vi_constraints::tangent_map::Tangents;
use holonom::vi_constraints::{InitialValues, Options, SchemeKind};
use holonom::vi_core::galerkin::Stages;
use holonom::vi_core::{Quadrature, State};
use holonom::vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use holonom::{Model, Simulation};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;
use vi_testkit::allocator::allocations;
use vi_testkit::model::{changed, heavy, two_links};

const GALERKIN: [(&str, &str); 1] = [("simulation.method", "galerkin")];

/// Two links on hinges, each with `own` keys.
pub(crate) fn links(own: [&str; 2]) -> String {
    heavy("links", [0.0, 0.0, -9.81], "step = 0.01, end = 0.2")
        + &two_links([1.0, 0.6], [[0.03, 0.04, 0.05], [0.02, 0.03, 0.01]], own)
}

/// With dampers, a torsion spring and a motor whose torque varies in time, not in one plane.
fn damped_links() -> String {
    let own = [
        "damper = { damping = 0.4 }\n",
        "damper = { damping = 0.2 }\nspring = { stiffness = 2.0, rest = 0.3 }\n\
         motor = { effort = 1.5, history = { type = \"harmonic\", frequency = 0.5 } }\n",
    ];
    let first = "axis = [0.0, 1.0, 0.0]\ndamper = { damping = 0.4 }";
    changed(&links(own), first, &first.replace("1.0, 0.0]", "1.0, 0.3]"))
}

fn run(text: &str, h: f64, order: u32) -> Run {
    Run::with(text, h, order, &GALERKIN)
}

fn chain(h: f64, order: u32) -> f64 {
    run(&shipped("chain8"), h, order).error_of_chain()
}

#[test]
fn the_tip_of_the_chain() {
    let (_, orders) = study("chain, order 4", &[5e-2, 2.5e-2, 1.25e-2], |h| chain(h, 4));
    assert_order(&orders, 4.0, 0.1);
    let (errors, orders) = study("chain, order 6", &[5e-2, 2.5e-2, 1.25e-2], |h| chain(h, 6));
    assert_order(&orders, 6.0, 0.2);
    assert!(errors[2] < 5e-11, "{errors:?}");
    let (errors, orders) = study("chain, order 8", &[1e-1, 5e-2, 2.5e-2], |h| chain(h, 8));
    assert!(orders.iter().all(|order| *order > 7.8), "{orders:?}");
    assert!(errors[2] < 4e-12, "{errors:?}");
    let (errors, _) = study("chain, order 16", &[1e-1], |h| chain(h, 16));
    assert!(errors[0] < 2e-12, "{errors:?}"); // the reference has twelve digits
}

fn top(h: f64, order: u32) -> f64 {
    run(&shipped("heavy_top"), h, order).error_of_top()
}

#[test]
fn the_heavy_top() {
    let (_, orders) = study("top, order 4", &[2e-2, 1e-2, 5e-3], |h| top(h, 4));
    assert_order(&orders, 4.0, 0.2);
    let (_, orders) = study("top, order 6", &[5e-2, 2.5e-2, 1.25e-2], |h| top(h, 6));
    assert_order(&orders, 6.0, 0.3);
    let (errors, orders) = study("top, order 8", &[5e-2, 2.5e-2], |h| top(h, 8));
    assert_order(&orders, 8.0, 0.2);
    assert!(errors[1] < 2e-9, "{:e}", errors[1]);
}

/// `q` and `ᵠp` at `t = 0.8` of the damped links.
fn damped(h: f64, order: u32) -> (Vec<f64>, Vec<f64>) {
    let mut run = run(&damped_links(), h, order);
    run.until(0.8);
    let run = run.simulation.integrator();
    let p = run.observe_state().unwrap().p_projected.clone();
    (run.state().q.clone(), p)
}

#[test]
fn dissipation_keeps_the_order() {
    let exact = damped(0.01, 16);
    for (order, coarse) in [(4, 0.1), (6, 0.1), (8, 0.8 / 6.0)] {
        for (what, error) in [
            ("q", &(|h| apart(&damped(h, order).0, &exact.0)) as &dyn Fn(f64) -> f64),
            ("p", &|h| apart(&damped(h, order).1, &exact.1)),
        ] {
            let steps = [coarse, 0.5 * coarse, 0.25 * coarse];
            let (_, orders) = study(&format!("damped, {what}, order {order}"), &steps, error);
            assert_order(&orders, f64::from(order), 0.5);
        }
    }
}

/// An integrator of a shipped model without loops.
fn bare(name: &str, kind: SchemeKind, h: f64, stages: Option<usize>) -> MechanismIntegrator {
    let model = Model::from_toml(&shipped(name)).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let mechanism = simulation.integrator().constraints().clone();
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let system = mechanism.system(Quadrature::Midpoint);
    let options = Options::new(kind, h);
    let options = match stages {
        Some(s) => options.galerkin(Stages::new(s).unwrap()),
        None => options,
    };
    integrator(mechanism, system, options, Solver::Auto, InitialValues::new(0.0, &q, &v)).unwrap()
}

#[test]
fn one_control_point_is_the_nodal_scheme() {
    for (name, h) in [("chain8", 5e-3), ("heavy_top", 5e-3), ("free_body", 1e-2)] {
        let mut runs = [
            bare(name, SchemeKind::Nodal, h, None),
            bare(name, SchemeKind::Nodal, h, Some(1)),
            bare(name, SchemeKind::Constrained, h, Some(1)),
        ];
        for _ in 0..40 {
            runs.iter_mut().for_each(|run| assert!(run.step().is_ok()));
        }
        let found: Vec<f64> =
            runs[1..].iter().map(|run| apart(&run.state().q, &runs[0].state().q)).collect();
        println!("{name}: {found:?} from the nodal scheme after 40 steps");
        let size = runs[0].state().q.iter().fold(1.0_f64, |size, q| size.max(q.abs()));
        assert!(found.iter().all(|found| *found <= 1e-13 * size), "{name}: {found:?}");
    }
}

#[test]
fn the_symplectic_form_is_conserved() {
    for (name, h) in [("heavy_top", 0.05), ("chain8", 0.05)] {
        for s in [2, 3, 4] {
            let mut run = bare(name, SchemeKind::Nodal, h, Some(s));
            check_form(name, &mut run, s, 1e-12);
        }
    }
}

/// That the symplectic form of canonical tangents changes by less than a bound in four steps.
pub(crate) fn check_form(name: &str, run: &mut MechanismIntegrator, s: usize, most: f64) {
    let (constraints, rows) = (run.constraints().clone(), run.rows().clone());
    let state = run.state().clone();
    let mut tangents = Tangents::canonical(&constraints, &rows, state.configuration());
    let before = tangents.form();
    let m = holonom::vi_constraints::Constraints::len(&constraints);
    let mut map = GalerkinTangent::new(m, &rows, Stages::new(s).unwrap(), &state);
    for _ in 0..4 {
        run.step_with(&mut |system, constraints, step| {
            map.push(system, constraints, step, &mut tangents).unwrap();
        })
        .unwrap();
    }
    let defect = tangents.defect(&before);
    println!("{name}, s = {s}: Ω changes by {defect:.1e} in 4 steps");
    assert!(defect < most, "{name}, s = {s}: {defect:e}");
}

/// The tangent map against differences of steps, on the null space.
#[test]
fn the_tangent_is_that_of_the_step() {
    let mut run = bare("heavy_top", SchemeKind::Constrained, 0.05, Some(3));
    run.step().unwrap();
    let state = run.state().clone();
    let (constraints, rows) = (run.constraints().clone(), run.rows().clone());
    let mut tangents = Tangents::canonical(&constraints, &rows, state.configuration());
    let start = tangents.clone();
    let m = holonom::vi_constraints::Constraints::len(&constraints);
    let mut map = GalerkinTangent::new(m, &rows, Stages::new(3).unwrap(), &state);
    run.step_with(&mut |system, constraints, step| {
        map.push(system, constraints, step, &mut tangents).unwrap();
    })
    .unwrap();
    let e = 1e-6;
    for k in start.dq.ncols() / 2..start.dq.ncols() {
        // momenta may be displaced by themselves; configurations would leave the constraints
        let mut displaced = |by: f64| {
            let mut moved = state.clone();
            moved.history.clear();
            for (p, dp) in moved.p.iter_mut().zip(start.dp.column(k).iter()) {
                *p += by * dp;
            }
            run.resume(moved).unwrap();
            run.step().unwrap();
            (run.state().q.clone(), run.state().p.clone())
        };
        let (plus, minus) = (displaced(e), displaced(-e));
        let difference = |a: &[f64], b: &[f64]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| (a - b) / (2.0 * e)).collect()
        };
        let dq = apart(&difference(&plus.0, &minus.0), tangents.dq.column(k).as_slice());
        let dp = apart(&difference(&plus.1, &minus.1), tangents.dp.column(k).as_slice());
        println!("column {k}: {dq:.1e}, {dp:.1e} from differences");
        assert!(dq < 1e-7 && dp < 1e-6, "column {k}: {dq:e}, {dp:e}");
    }
}

#[test]
fn reversed_steps_retrace_the_motion() {
    for (name, h, s) in [("heavy_top", 0.04, 3), ("chain8", 0.05, 4), ("free_body", 0.05, 2)] {
        let mut run = bare(name, SchemeKind::Nodal, h, Some(s));
        check_reversal(&format!("{name}, s = {s}"), &mut run, 1e-11);
    }
}

/// That twenty steps and twenty back lead to the start, within a bound.
pub(crate) fn check_reversal(name: &str, run: &mut MechanismIntegrator, most: f64) {
    let start = run.state().q.clone();
    (0..20).for_each(|_| assert!(run.step().is_ok()));
    run.reverse();
    (0..20).for_each(|_| assert!(run.step().is_ok()));
    let missed = apart(&run.state().q, &start);
    println!("{name}: back to {missed:.1e}");
    assert!(missed < most, "{name}: {missed:e}");
}

/// Largest changes of `L_z` and of the energy of the heavy top in `steps` steps, with their values
/// at half time.
fn drift(s: usize, h: f64, steps: u32) -> [[f64; 2]; 2] {
    let mut run = bare("heavy_top", SchemeKind::Nodal, h, Some(s));
    let mechanism = run.constraints().clone();
    let read = |run: &mut MechanismIntegrator| {
        let node = run.observe_state().unwrap();
        let (p, energy) = (node.p_projected.clone(), node.hamiltonian_projected.total());
        let momentum = mechanism.momentum(&run.state().q, &p);
        [momentum.angular[2], energy]
    };
    let start = read(&mut run);
    let (mut largest, mut half) = ([0.0_f64; 2], [0.0; 2]);
    for n in 0..steps {
        run.step().unwrap();
        let now = read(&mut run);
        for i in 0..2 {
            largest[i] = largest[i].max((now[i] - start[i]).abs());
        }
        if n == steps / 2 {
            half = largest;
        }
    }
    [half, largest]
}

#[test]
fn momentum_is_exact_and_energy_bounded() {
    for (s, energy) in [(2, 1e-2), (3, 1e-3), (4, 1e-4), (6, 1e-7), (8, 1e-9)] {
        let [_, [momentum, error]] = drift(s, 0.05, 2000);
        println!("s = {s}: L_z changes by {momentum:.1e}, the energy by {error:.1e}");
        assert!(momentum < 2e-12 && error < energy, "s = {s}: {momentum:e}, {error:e}");
    }
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn no_trend_in_a_hundred_thousand_steps() {
    for s in [2, 3, 4, 6, 8] {
        let [half, [momentum, energy]] = drift(s, 0.05, 100_000);
        println!(
            "s = {s}: L_z changes by {momentum:.1e} ({:.1e} at half time), the energy by {energy:.1e} ({:.1e})",
            half[0], half[1]
        );
        assert!(momentum < 5e-11, "s = {s}: {momentum:e}");
        assert!(energy < 1.5 * half[1] + 1e-10, "s = {s}: {energy:e} after {:e}", half[1]);
    }
}

#[test]
fn a_step_allocates_nothing() {
    for (text, order) in [(shipped("chain8"), 8), (shipped("heavy_top"), 6), (damped_links(), 4)] {
        check_allocations(&format!("order {order}"), &mut run(&text, 0.02, order), 100);
    }
}

/// That no step of a run allocates.
pub(crate) fn check_allocations(name: &str, run: &mut Run, steps: usize) {
    run.steps(10);
    let run = run.simulation.integrator();
    let before = allocations();
    for _ in 0..steps {
        run.step().unwrap();
    }
    assert_eq!(allocations() - before, 0, "{name}");
}

#[test]
fn a_stored_state_continues_bit_for_bit() {
    for (text, order) in [(shipped("chain8"), 8), (shipped("heavy_top"), 6), (damped_links(), 16)] {
        check_restart(&format!("order {order}"), || run(&text, 0.02, order));
    }
}

/// That a run goes on from its stored state as without a stop.
pub(crate) fn check_restart(name: &str, start: impl Fn() -> Run) {
    let mut first = start();
    first.steps(7);
    let stored = serde_json::to_string(first.simulation.integrator().state()).unwrap();
    first.steps(5);
    let mut second = start();
    let state: State = serde_json::from_str(&stored).unwrap();
    second.simulation.integrator().resume(state).unwrap();
    second.steps(5);
    let [first, second] = [&mut first, &mut second].map(|run| run.simulation.integrator());
    assert_eq!(first.state(), second.state(), "{name}");
}

/// The sweeps of usual steps converge from the first guess; steps that are too large are refused,
/// or end where small steps do.
#[test]
fn large_steps_are_right_or_refused() {
    let exact = chain(0.02, 16);
    assert!(exact < 2e-12, "{exact:e}");
    let orders = [4, 6, 8, 12];
    for (h, order) in [0.1, 0.125, 0.2, 0.25, 0.5].into_iter().flat_map(|h| orders.map(|o| (h, o)))
    {
        let [mut run, mut small] =
            [(h, order), (0.0125, 8)].map(|(h, order)| run(&shipped("chain8"), h, order));
        let (mut sweeps, mut worst, mut failure) = (0, 0.0_f64, None);
        for _ in 0..(1.0 / h) as u32 {
            match run.simulation.integrator().step() {
                Ok(report) => sweeps += report.iterations,
                Err(error) => {
                    failure = Some(error.to_string());
                    break;
                }
            }
            let t = run.t();
            small.until(t);
            worst = worst.max(apart(run.q(), small.q()));
        }
        println!("h = {h}, order {order}: {sweeps} sweeps, off by {worst:.1e}, {failure:?}");
        // of directors, and of 8 m
        assert!(worst < 0.5, "h = {h}, order {order}: off by {worst:e}");
    }
}

/// A body that rotates about a principal axis, nearly, in steps of up to two revolutions: the turn
/// of each step is that of the motion, or the step is refused. Its equations have other solutions:
/// other turns, and mirror images.
#[test]
fn no_step_ends_on_another_branch_or_at_a_mirror_image() {
    let text = r#"
model = { name = "rotor" }
simulation = { step = 0.1, end = 0.5, method = "galerkin" }
body = [{ name = "nut", mass = 1.0, inertia = [1.0, 1.2, 1.5], angular_velocity = [0.01, 0.02, 1.0] }]
"#;
    for (scheme, order) in
        [("nodal", "4"), ("nodal", "8"), ("constrained", "4"), ("constrained", "8")]
    {
        let (mut taken, mut worst, mut largest) = (0, 0.0_f64, 0.0_f64);
        for k in 1..60 {
            let turn = 0.2 * f64::from(k); // h ω, rad
            let spin = format!("[{}, {}, {}]", 0.1 * turn, 0.2 * turn, 10.0 * turn);
            let own = [
                ("simulation.scheme", scheme),
                ("simulation.order", order),
                ("body.nut.angular_velocity", spin.as_str()),
            ];
            let mut run = Run::with(text, 0.1, order.parse().unwrap(), &own);
            let mut before = run.coordinates("nut");
            while run.simulation.integrator().step().is_ok() && run.t() < 0.45 {
                let after = run.coordinates("nut");
                let triad = |q: &[f64]| Matrix3::from_column_slice(&q[3..12]);
                let (a, b) = (triad(&before), triad(&after));
                assert!(b.determinant() > 0.99, "{scheme} {order}: a mirror image at {turn} rad");
                let own = b * a.transpose();
                let found = (own.m21 - own.m12).atan2(own.m11 + own.m22);
                let off = (found - turn).rem_euclid(TAU);
                let off = off.min(TAU - off);
                (taken, worst) = (taken + 1, worst.max(off));

                largest = largest.max(turn);
                before = after;
            }
        }
        println!(
            "{scheme}, order {order}: {taken} steps up to {largest:.1} rad, off by {worst:.2} rad at most"
        );
        assert!(worst < 0.5 && taken > 20, "{scheme}, order {order}: off by {worst} rad");
    }
}

/// Seconds of CPU time and error of `T = 1` (chain) and `T = 10` (top), against the compositions of
/// the same order.
#[test]
#[ignore = "a measurement: cargo test --release -- --ignored work_and_precision --nocapture"]
fn work_and_precision() {
    let cases = [
        (
            "chain8",
            "link8",
            [8.0, 0.0, 0.0],
            1.0,
            CHAIN_TIP,
            vec![10, 14, 20, 28, 40, 56, 80, 160, 320],
        ),
        (
            "heavy_top",
            "top",
            [0.0, -0.295_520_206_661_339_55, 0.955_336_489_125_606],
            10.0,
            TOP_CENTER,
            vec![100, 200, 280, 400, 560, 800, 1600, 3200],
        ),
    ];
    for (name, body, point, end, exact, counts) in cases {
        for (method, orders) in
            [("galerkin", vec![4, 6, 8, 12, 16]), ("composition", vec![2, 4, 6, 8])]
        {
            for order in orders {
                for &count in &counts {
                    let h = end / f64::from(count);
                    let mut best = f64::INFINITY;
                    let (mut error, mut iterations) = (f64::NAN, 0);
                    for _ in 0..3 {
                        let overrides = [("simulation.method", method)];
                        let mut run = Run::with(&shipped(name), h, order, &overrides);
                        let at = run.point(body, point);
                        let clock = std::time::Instant::now();
                        let failed = (0..count).any(|_| match run.simulation.integrator().step() {
                            Ok(report) => {
                                run.iterations += report.iterations;
                                false
                            }
                            Err(_) => true,
                        });
                        best = best.min(clock.elapsed().as_secs_f64());
                        if !failed {
                            error = (run.at(at) - Vector3::from(exact)).norm();
                        }
                        iterations = run.iterations;
                    }
                    let per_step = f64::from(iterations as u32) / f64::from(count);
                    println!(
                        "{name:<10} {method:<12} {order:>2} h = {h:.4e}: error {error:.1e}, {:.4} ms, {per_step:.1} iterations a step",
                        1e3 * best
                    );
                }
            }
        }
    }
}
