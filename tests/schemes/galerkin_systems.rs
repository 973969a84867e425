//! The Galerkin schemes on closed loops and beams: orders, forms, invariants, singular positions,
//! restart, refusals.
#![allow(clippy::unwrap_used)] // a test

use crate::schemes::galerkin::{
    check_allocations, check_form, check_restart, check_reversal, links,
};
use crate::{benchmark, harness};

use benchmark::{Run, apart, assert_order, model, study};
use harness::models::{overrides, shipped};
use holonom::Simulation;
use vi_testkit::model::{beam, heavy, hinge, motion, section};

const HELICOIDAL: &str = "helicoidal";
const MEAN: &str = "mean_directors";

/// A soft beam with material damping that swings on a hinge, of elements of one kind.
fn swinging(element: &str, damping: f64) -> String {
    let soft = section([4e3, 2e3, 2e3, 8.0, 6.0, 5.0], [1.0, 1e-2, 2e-2]);
    [
        heavy("swinging", [0.0, 0.0, -9.81], "step = 0.01, end = 1.0, strain = \"averaged\""),
        beam("beam", &[[0.0; 3], [1.0, 0.0, 0.0]], 4),
        format!("normal = [0, 0, 1]\nelement = \"{element}\"\n"),
        soft.replace(" }", &format!(", damping = {damping:?} }}")),
        hinge("hinge", ["ground", "beam.start"], [0.0; 3], [0.2, 1.0, 0.1]),
    ]
    .concat()
}

/// Two links, the first of which is turned at the rate `rate` initially, along `path`.
fn driven(rate: f64, path: &str) -> String {
    links([&format!("rate = {rate:?}\n"), ""]) + &motion("drive", "shoulder", path)
}

/// `0.6 sin 2π t`, and its rate initially.
const SINE: (f64, &str) = (3.7699111843077517, "{ amplitude = 0.6, frequency = 1.0 }");

fn run(text: &str, scheme: &str, h: f64, order: u32) -> Run {
    let scheme = format!("\"{scheme}\"");
    Run::with(text, h, order, &[("simulation.method", "galerkin"), ("simulation.scheme", &scheme)])
}

/// `q` and `ᵠp` at a time.
fn at(text: &str, (scheme, h, order): (&str, f64, u32), t: f64) -> [Vec<f64>; 2] {
    let mut run = run(text, scheme, h, order);
    run.until(t);
    let run = run.simulation.integrator();
    let p = run.observe_state().unwrap().p_projected.clone();
    [run.state().q.clone(), p]
}

/// Orders of `q` and `ᵠp` at `t`, from the steps `coarse` on, against order 16.
fn check_orders(name: &str, text: &str, t: f64, orders: &[(u32, f64)], within: f64) {
    let finest = orders.last().unwrap().1 / 4.0;
    let exact = at(text, ("nodal", finest, 16), t);
    for &(order, coarse) in orders {
        for (k, what) in ["q", "p"].into_iter().enumerate() {
            let error = |h: f64| apart(&at(text, ("nodal", h, order), t)[k], &exact[k]);
            let steps = [coarse, 0.5 * coarse, 0.25 * coarse];
            let (_, found) = study(&format!("{name}, {what}, order {order}"), &steps, error);
            assert_order(&found, f64::from(order), within);
        }
    }
}

#[test]
fn orders_on_closed_loops() {
    let orders = [(4, 0.1), (6, 0.2), (8, 0.32)]; // the finest errors are above rounding
    check_orders("bricard", &shipped("bricard"), 1.6, &orders, 0.5);
    check_orders("six_hinge_cube", &shipped("six_hinge_cube"), 1.6, &[(4, 0.1), (6, 0.2)], 0.5);
}

#[test]
fn orders_on_beams() {
    check_orders("damped beam", &swinging(HELICOIDAL, 2e-3), 0.16, &[(4, 0.01), (6, 0.02)], 0.5);
    check_orders(
        "beam of mean directors",
        &swinging(MEAN, 0.0),
        0.08,
        &[(4, 2e-3), (6, 4e-3)],
        0.5,
    );
}

#[test]
fn both_forms_give_one_motion() {
    for (name, text, h, order, steps) in [
        ("bricard", shipped("bricard"), 0.02, 6, 20),
        ("andrews_squeezer", shipped("andrews_squeezer"), 5e-5, 4, 20),
        ("six_hinge_cube", shipped("six_hinge_cube"), 0.05, 8, 20),
        ("damped beam", swinging(HELICOIDAL, 2e-3), 0.02, 6, 10),
        ("beam of mean directors", swinging(MEAN, 2e-3), 0.02, 4, 10),
    ] {
        let mut runs = ["nodal", "constrained"].map(|scheme| run(&text, scheme, h, order));
        runs.iter_mut().for_each(|run| run.steps(steps));
        let [nodal, constrained] = &mut runs;
        let found = apart(nodal.q(), constrained.q());
        println!("{name}: {found:.1e} between the forms after {steps} steps");
        assert!(found < 1e-11, "{name}: {found:e}");
    }
}

/// The windows pass their flat positions, in which the loops lose rank.
#[test]
fn loops_pass_singular_positions() {
    let mut run = run(&shipped("four_bar_windows"), "nodal", 5e-3, 6);
    let energy = |run: &mut Run| {
        let node = run.simulation.integrator().observe_state().unwrap();
        (node.hamiltonian_projected.total(), node.position_residual)
    };
    let (start, mut largest, mut gap) = (energy(&mut run).0, 0.0_f64, 0.0_f64);
    for _ in 0..1000 {
        run.steps(1);
        let (now, residual) = energy(&mut run);
        (largest, gap) = (largest.max((now - start).abs()), gap.max(residual));
    }
    println!("energy changes by {largest:.1e} of {start:.1} J, constraints open by {gap:.1e}");
    assert!(largest < 1e-10 && gap < 1e-14, "{largest:e}, {gap:e}");
}

/// `h ω_max = 4e4`: rotations free of strain, stable for every step.
#[test]
fn stiff_beams_in_rotation() {
    for (order, most) in [(6, 1e-8), (8, 1e-8)] {
        let mut run = run(&shipped("rotating_strip"), "nodal", 0.02, order);
        let energy = |run: &mut Run| {
            let node = run.simulation.integrator().observe_state().unwrap();
            node.hamiltonian_projected.total()
        };
        let (start, mut largest) = (energy(&mut run), 0.0_f64);
        for _ in 0..500 {
            run.steps(1);
            largest = largest.max((energy(&mut run) - start).abs());
        }
        println!("order {order}: energy changes by {largest:.1e} of {start:.2} J");
        assert!(largest < most, "order {order}: {largest:e}");
    }
}

/// The sweeps of trees of bodies contract for moderate stiffness alone; the modes of the step do
/// for any.
#[test]
fn stiff_springs_take_the_modes() {
    let stiff = links([
        "rate = 3.7699111843077517
",
        "spring = { stiffness = 4e4 }
damper = { damping = 0.5 }
",
    ]);
    let sparse = [("simulation.method", "galerkin"), ("simulation.solver", "\"sparse\"")];
    let mut refused = run(&stiff, "nodal", 0.02, 6);
    let failed = (0..20).any(|_| refused.simulation.integrator().step().is_err());
    let mut modes = Run::with(&stiff, 0.02, 6, &sparse);
    modes.steps(20);
    let mut fine = run(&stiff, "nodal", 1e-3, 6);
    fine.steps(400);
    let error = apart(modes.q(), fine.q());
    println!("sweeps fail: {failed}; by modes {error:.1e} from steps of 1 ms");
    assert!(failed && error < 1e-3, "{failed}, {error:e}");
}

#[test]
fn momenta_of_a_flying_beam_are_exact() {
    for order in [4, 6] {
        let mut run = run(&shipped("flying_beam"), "nodal", 0.02, order);
        run.until(6.0); // nothing acts from 5 s on
        let momentum = |run: &mut Run| {
            let run = run.simulation.integrator();
            let p = run.observe_state().unwrap().p_projected.clone();
            let momentum = run.constraints().momentum(&run.state().q, &p);
            [momentum.linear, momentum.angular].concat()
        };
        let start = momentum(&mut run);
        run.steps(100);
        let found = apart(&momentum(&mut run), &start);
        println!("order {order}: momenta change by {found:.1e} of {:.0}", start[5].abs());
        assert!(found < 1e-10, "order {order}: {found:e}");
    }
}

#[test]
fn the_symplectic_form_is_conserved() {
    for (name, text, h, s) in [
        ("bricard", shipped("bricard"), 0.02, 3),
        ("beam", swinging(HELICOIDAL, 0.0), 0.02, 2),
        ("beam", swinging(HELICOIDAL, 0.0), 0.02, 3),
    ] {
        let mut run = run(&text, "nodal", h, 2 * s as u32);
        check_form(name, run.simulation.integrator(), s, 1e-10);
    }
}

#[test]
fn energy_balance_of_a_damped_beam() {
    for (order, most) in [(4, 1e-6), (6, 1e-9)] {
        let overrides = [("simulation.method", "galerkin"), ("simulation.end", "0.5")];
        let run = Run::with(&swinging(HELICOIDAL, 2e-3), 0.01, order, &overrides);
        let mut simulation = run.simulation;
        let samples = benchmark::samples(&mut simulation);
        let (first, last) = (samples.first().unwrap(), samples.last().unwrap());
        let (lost, work) = (last.energy - first.energy, last.work - first.work);
        println!("order {order}: {lost:.6} J lost, work {work:.6} J, {:.1e} apart", lost - work);
        assert!(lost < -1e-3 && (lost - work).abs() < most, "order {order}: {lost} for {work}");
    }
}

/// The work of prescribed motions is a sum over the control points, whose multipliers have low
/// orders.
#[test]
fn energy_balance_of_prescribed_motions() {
    for (name, h, order) in [
        ("flexible_slider_crank", 5e-3, 6),
        ("driven", 2e-2, 4),
        ("driven", 1e-2, 4),
        ("driven", 2e-2, 6),
        ("driven", 1e-2, 6),
        ("driven", 2e-2, 8),
        ("driven", 1e-2, 8),
    ] {
        let (text, scheme) = match name {
            "driven" => (driven(SINE.0, SINE.1), "nodal"),
            name => (shipped(name), "constrained"),
        };
        let overrides = [("simulation.end", "0.2"), ("simulation.every", "1")];
        let scheme = format!("\"{scheme}\"");
        let own = [("simulation.method", "galerkin"), ("simulation.scheme", &scheme)];
        let mut run = Run::with(&text, h, order, &[&own[..], &overrides[..]].concat());
        let samples = benchmark::samples(&mut run.simulation);
        let (first, last) = (samples.first().unwrap(), samples.last().unwrap());
        let (gained, work) = (last.energy - first.energy, last.work - first.work);
        println!(
            "{name}, order {order}, h = {h}: {gained:.6} J gained, {:.1e} apart",
            gained - work
        );
        assert!((gained - work).abs() < 1e-2 * gained.abs().max(1.0), "{name}: {gained}, {work}");
    }
}

/// The prescribed angle grows beyond half a revolution.
#[test]
fn prescribed_angles_have_revolutions() {
    let text = driven(3.0, "{ rate = 3.0 }");
    for scheme in ["nodal", "constrained"] {
        let mut run = run(&text, scheme, 0.02, 6);
        let upper = run.point("upper", [1.0, 0.0, 0.0]);
        run.until(4.0);
        let (at, exact) = (run.at(upper), [12.0_f64.cos(), 0.0, -12.0_f64.sin()]);
        let error = (at - nalgebra::Vector3::from(exact)).norm();
        println!("{scheme}: tip off by {error:.1e} after 12 rad");
        assert!(error < 1e-12, "{scheme}: {at} for {exact:?}");
    }
}

#[test]
fn a_step_allocates_nothing() {
    for (name, text, h) in [
        ("bricard", shipped("bricard"), 0.02),
        ("four_bar_windows", shipped("four_bar_windows"), 5e-3),
        ("damped beam", swinging(HELICOIDAL, 2e-3), 0.01),
        ("beam of mean directors", swinging(MEAN, 0.0), 0.01),
    ] {
        let mut run = run(&text, "nodal", h, 6);
        check_allocations(name, &mut run, 50);
    }
}

#[test]
fn a_stored_state_continues_bit_for_bit() {
    for (name, text, h) in [
        ("bricard", shipped("bricard"), 0.02),
        ("four_bar_windows", shipped("four_bar_windows"), 5e-3),
        ("damped beam", swinging(HELICOIDAL, 2e-3), 0.01),
    ] {
        check_restart(name, || run(&text, "nodal", h, 6));
    }
}

#[test]
fn reversed_steps_retrace_the_motion() {
    for (name, text, h) in
        [("bricard", shipped("bricard"), 0.02), ("beam", swinging(HELICOIDAL, 0.0), 0.01)]
    {
        let mut run = run(&text, "nodal", h, 6);
        check_reversal(name, run.simulation.integrator(), 1e-10);
    }
}

#[test]
fn what_has_no_galerkin_form_is_refused_with_a_remedy() {
    for (name, key, value, says) in [
        (
            "flexible_four_bar",
            "simulation.scheme",
            "nodal",
            ["closed loops of beams", "constrained"],
        ),
        ("flying_beam", "simulation.strain", "dissipative", ["strain energy", "averaged"]),
    ] {
        let set = [("simulation.method", "galerkin"), ("simulation.order", "4"), (key, value)];
        let refused = match holonom::Model::from_toml_with(&shipped(name), &overrides(&set)) {
            Ok(model) => format!("{:?}", Simulation::new(&model).unwrap_err()),
            Err(error) => format!("{error:?}"),
        };
        println!("{name}: {refused}");
        assert!(says.iter().all(|word| refused.contains(word)), "{name}: {refused}");
    }
    // what the nodal form refuses the constrained one takes
    let text = shipped("flexible_four_bar");
    let overrides = [
        ("simulation.method", "galerkin"),
        ("simulation.order", "4"),
        ("simulation.scheme", "constrained"),
    ];
    let mut simulation = Simulation::new(&model(&text, &overrides)).unwrap();
    assert!(simulation.integrator().step().is_ok());
}
