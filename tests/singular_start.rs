//! Flat positions of a four-bar linkage with unequal cranks: passed on the branch of the motion, left
//! along the velocity of the start, refused at rest.
//!
//! Cranks of length `a = 0.5` on feet at distance `d = 1`, coupler of length `d`. Next to the flat
//! position `θ_0 = θ_1 = 0` there are two branches, the parallelogram `θ_1 = θ_0` and the
//! antiparallelogram `θ_1 = θ_0 (a + d)/(a − d) = −3 θ_0`.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, ode, study};
use holonom::{Model, Simulation};

const CRANK: f64 = 0.5;
const MASSES: [f64; 2] = [1.0, 3.0];

/// The parallelogram at the angle `theta`, crank rates `rates`, with gravity `g` along −y.
pub(crate) fn linkage(theta: f64, rates: [f64; 2], g: f64, settings: &str) -> String {
    let (s, c) = theta.sin_cos();
    let mut text =
        format!("[model]\nname = \"flat\"\ngravity = [0, {:?}, 0]\n[simulation]\n{settings}\n", -g);
    let mut top = Vec::new();
    for (k, (mass, rate)) in MASSES.into_iter().zip(rates).enumerate() {
        let (x, y) = (CRANK * c, CRANK * s);
        let inertia = mass * CRANK * CRANK / 12.0;
        text += &format!(
            "[[body]]\nname = \"crank{k}\"\nmass = {mass:?}\ninertia = [1e-3, {inertia:?}, \
             {inertia:?}]\nposition = [{:?}, {:?}, 0]\nrotation_vector = [0, 0, {theta:?}]\n\
             velocity = [{:?}, {:?}, 0]\nangular_velocity = [0, 0, {rate:?}]\n",
            k as f64 + 0.5 * x,
            0.5 * y,
            -0.5 * rate * y,
            0.5 * rate * x
        );
        text += &format!(
            "[[joint]]\nname = \"foot{k}\"\ntype = \"revolute\"\nparent = \"ground\"\nchild = \
             \"crank{k}\"\nposition = [{k}, 0, 0]\naxis = [0, 0, 1]\n"
        );
        top.push(([k as f64 + x, y], [-rate * y, rate * x]));
    }
    let [([x0, y0], [vx0, vy0]), (_, [vx1, vy1])] = top[..] else { panic!() };
    text += &format!(
        "[[body]]\nname = \"coupler\"\nmass = 1.0\ninertia = [1e-3, 0.08, 0.08]\nposition = \
         [{:?}, {y0:?}, 0]\nvelocity = [{:?}, {:?}, 0]\nangular_velocity = [0, 0, {:?}]\n",
        x0 + 0.5,
        0.5 * (vx0 + vx1),
        0.5 * (vy0 + vy1),
        vy1 - vy0
    );
    for (k, (name, x)) in [("left", x0), ("right", x0 + 1.0)].into_iter().enumerate() {
        text += &format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nparent = \"crank{k}\"\nchild = \
             \"coupler\"\nposition = [{x:?}, {y0:?}, 0]\naxis = [0, 0, 1]\n"
        );
    }
    text
}

/// `(θ, θ̇)` of the parallelogram: `θ̈ = −g/a ((m_0 + m_1)/2 + m) / ((m_0 + m_1)/3 + m) cos θ`.
fn parallelogram(theta: f64, rate: f64, g: f64, t: f64) -> [f64; 2] {
    let cranks: f64 = MASSES.iter().sum();
    let c = g / CRANK * (cranks / 2.0 + 1.0) / (cranks / 3.0 + 1.0);
    ode(|y: &[f64; 2]| [y[1], -c * y[0].cos()], [theta, rate], t)
}

/// Distance of the top of the first crank from its exact place, and of the coupler from level.
fn missed(run: &mut Run, start: (f64, f64, f64)) -> (f64, f64) {
    let [theta, _] = parallelogram(start.0, start.1, start.2, run.t());
    let (crank, coupler) = (run.coordinates("crank0"), run.coordinates("coupler"));
    let error = (2.0 * crank[0] - CRANK * theta.cos()).hypot(2.0 * crank[1] - CRANK * theta.sin());
    (error, coupler[4].abs())
}

const SETTINGS: &str = "step = 0.01\nend = 1.0";

#[test]
fn flat_positions_are_passed_on_the_branch_of_the_motion() {
    // 12 rad/s upright: through both flat positions about twice a second
    let (theta, rate, g) = (1.5, 12.0, 9.81);
    let text = linkage(theta, [rate; 2], g, SETTINGS);
    let (_, orders) = study("unequal cranks, 5 s", &[1e-2, 5e-3, 2.5e-3], |h| {
        let mut run = Run::new(&text, h, 2);
        run.until(5.0);
        let (error, level) = missed(&mut run, (theta, rate, g));
        assert!(level < 1e-11 && run.residual() < 1e-13, "{level:e}");
        error
    });
    assert_order(&orders, 2.0, 0.1);
    // from either side, swinging: the motion reverses close to the flat configuration, and passes it
    for theta in [-0.3, -1e-3, 1e-3, 1e-6] {
        let text = linkage(theta, [0.0; 2], g, SETTINGS);
        let mut run = Run::new(&text, 2e-3, 2);
        run.until(2.0);
        let (error, level) = missed(&mut run, (theta, 0.0, g));
        println!("released at {theta}: error {error:.1e} m, coupler off level by {level:.1e}");
        assert!(error < 1e-3 && level < 1e-9, "{theta}: {error:e} {level:e}");
    }
}

#[test]
fn a_flat_start_continues_along_its_velocity() {
    let (rate, g) = (7.0, 9.81);
    for scheme in ["nodal", "reduced"] {
        let text = linkage(0.0, [rate; 2], g, &format!("{SETTINGS}\nscheme = \"{scheme}\""));
        let (_, orders) = study(&format!("flat start, {scheme}"), &[1e-2, 5e-3, 2.5e-3], |h| {
            let mut run = Run::new(&text, h, 2);
            run.steps(1);
            let first = run.residual();
            assert!(first < 1e-14, "closure after the first step: {first:e}");
            run.until(1.0);
            let (error, level) = missed(&mut run, (0.0, rate, g));
            assert!(level < 1e-11, "{level:e}");
            error
        });
        assert_order(&orders, 2.0, 0.1);
    }
    let run = Run::new(&linkage(0.0, [rate; 2], g, SETTINGS), 1e-2, 2);
    let report = run.simulation.assembly();
    assert_eq!(
        (report.counts.dof, report.counts.redundant_constraints),
        (1, 3),
        "the generic ones"
    );
}

#[test]
fn the_other_branch_is_left_along_its_own_velocity() {
    let text = linkage(0.0, [2.0, -6.0], 0.0, SETTINGS);
    let place = |h: f64| {
        let mut run = Run::new(&text, h, 2);
        run.until(0.3);
        let (left, right) = (run.coordinates("crank0"), run.coordinates("crank1"));
        let energy = run.energy();
        assert!(run.residual() < 1e-13);
        (left[4].atan2(left[3]), right[4].atan2(right[3]), energy)
    };
    let fine = place(1e-4);
    assert!((fine.0 - fine.1).abs() > 0.1, "it left on the parallelogram: {fine:?}");
    let (_, orders) =
        study("antiparallelogram", &[1e-2, 5e-3, 2.5e-3], |h| (place(h).0 - fine.0).abs());
    assert_order(&orders, 2.0, 0.3);
}

#[test]
fn a_flat_start_is_recorded_like_any_other() {
    let model = Model::from_toml(&linkage(0.0, [7.0; 2], 9.81, SETTINGS)).unwrap();
    let mut energies = Vec::new();
    let outcome = Simulation::new(&model).unwrap().run::<()>(
        &mut |sample| {
            energies.push(sample.hamiltonian);
            Ok(())
        },
        &mut |_, _| {},
    );
    assert_eq!(outcome, Ok(holonom::RunOutcome::Done));
    let kinetic = 0.5 * 49.0 * CRANK * CRANK * (4.0 / 3.0 + 1.0);
    assert!((energies[0] - kinetic).abs() < 1e-12, "{} {kinetic}", energies[0]);
}

fn refusal(rates: [f64; 2], settings: &str) -> String {
    let model = Model::from_toml(&linkage(0.0, rates, 9.81, settings)).unwrap();
    Simulation::new(&model).err().unwrap().to_string()
}

#[test]
fn what_decides_no_branch_is_refused() {
    let at_rest = refusal([0.0; 2], SETTINGS);
    println!("{at_rest}");
    for part in
        ["singular configuration", "`right`", "at rest", "give it a velocity or move it off"]
    {
        assert!(at_rest.contains(part), "{at_rest}");
    }
    let mixed = refusal([4.0, 2.0], SETTINGS);
    assert!(mixed.contains("no branch"), "{mixed}");
    let scheme = refusal([7.0; 2], &format!("{SETTINGS}\nscheme = \"constrained\""));
    assert!(scheme.contains("`nodal`"), "{scheme}");
}

/// Cranks held parallel by a gear.
const GEAR: &str = "[[constraint]]\ntype = \"gear\"\nname = \"mesh\"\njoints = [\"foot0\", \"foot1\"]\n\
                    ratio = -1.0\n";

/// A drive that rotates the first crank by 7 rad/s.
const DRIVE: &str = "[[constraint]]\ntype = \"motion\"\nname = \"drive\"\njoint = \"foot0\"\npath = { rate = \
                     7.0 }\n";

/// A strut of fixed length between the left crank and the coupler: it locks their hinge.
const STRUT: &str = "[[constraint]]\ntype = \"distance\"\nname = \"strut\"\nfrom = \"crank0\"\nto = \
                     \"coupler\"\npoint_to = [-0.2, 0.3, 0]\n";

#[test]
fn a_gear_decides_the_branch_even_at_rest() {
    for rate in [0.0, 7.0] {
        let text = linkage(0.0, [rate; 2], 9.81, SETTINGS) + GEAR;
        let (_, orders) = study(&format!("geared, {rate} rad/s"), &[1e-2, 5e-3, 2.5e-3], |h| {
            let mut run = Run::new(&text, h, 2);
            run.until(0.5);
            let (error, level) = missed(&mut run, (0.0, rate, 9.81));
            assert!(level < 1e-11 && run.residual() < 1e-13, "{level:e}");
            error
        });
        assert_order(&orders, 2.0, 0.1);
    }
}

#[test]
fn a_driven_flat_start_follows_its_drive() {
    for scheme in ["nodal", "reduced"] {
        let settings = format!("{SETTINGS}\nscheme = \"{scheme}\"");
        let mut run = Run::new(&(linkage(0.0, [7.0; 2], 9.81, &settings) + DRIVE), 1e-2, 2);
        let report = run.simulation.assembly();
        assert_eq!(report.counts.dof, 0, "driven through and through");
        let (mut off, mut level) = (0.0_f64, 0.0_f64);
        for _ in 0..200 {
            run.steps(1);
            let theta = 7.0 * run.t();
            let (crank, coupler) = (run.coordinates("crank0"), run.coordinates("coupler"));
            off = off.max((crank[3] - theta.cos()).hypot(crank[4] - theta.sin()));
            level = level.max(coupler[4].abs());
        }
        println!(
            "{scheme}: 200 driven steps, crank off by {off:.1e}, coupler off level by {level:.1e}"
        );
        assert!(off < 1e-12 && level < 1e-9 && run.residual() < 1e-13, "{off:e} {level:e}");
    }
}

#[test]
fn a_strut_that_locks_a_flat_linkage_is_refused() {
    // a structure, shaky where it is flat: no configuration nearby, and no motion
    let text = linkage(0.0, [0.0; 2], 9.81, SETTINGS) + STRUT;
    let refused = Simulation::new(&Model::from_toml(&text).unwrap()).err().unwrap().to_string();
    println!("{refused}");
    assert!(refused.contains("singular configuration"), "{refused}");
    // not so where it is upright
    let text = linkage(1.5, [0.0; 2], 9.81, SETTINGS) + STRUT;
    let mut run = Run::new(&text, 1e-2, 2);
    assert_eq!(run.simulation.assembly().counts.dof, 0);
    let start = run.coordinates("coupler");
    run.steps(100);
    let moved: f64 =
        run.coordinates("coupler").iter().zip(&start).map(|(a, b)| (a - b).abs()).sum();
    println!("the upright structure moves by {moved:.1e}");
    assert!(moved < 1e-13, "{moved:e}");
}
