//! Flat positions of a four-bar linkage with unequal cranks: passed on the branch of the motion,
//! left along the velocity of the start, refused at rest.
//!
//! Cranks of length `a = 0.5` on feet at distance `d = 1`, coupler of length `d`. Next to the flat
//! position `θ_0 = θ_1 = 0` there are two branches, the parallelogram `θ_1 = θ_0` and the
//! antiparallelogram `θ_1 = θ_0 (a + d)/(a − d) = −3 θ_0`.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{assert_order, model, ode, study};
use holonom::Simulation;
use holonom::vi_constraints::integrator::SetupError;
use holonom::vi_constraints::{Constraints, Options, SchemeKind};
use holonom::vi_multibody::builder::{BodyId, Inertia, JointId, MechanismBuilder};
use holonom::vi_multibody::run::MechanismIntegrator;
use holonom::vi_multibody::{FrameId, PairKind};

const CRANK: f64 = 0.5;
const MASSES: [f64; 2] = [1.0, 3.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const G: f64 = 9.81;

/// The bodies of the linkage, and the joints of its cranks on the ground.
pub(crate) struct Linkage {
    builder: MechanismBuilder,
    feet: [JointId; 2],
    cranks: [BodyId; 2],
    coupler: BodyId,
}

impl Linkage {
    /// The parallelogram at the angle `theta`, crank rates `rates`, with gravity `g` along −y.
    pub(crate) fn new(theta: f64, rates: [f64; 2], g: f64) -> Self {
        let mut builder = MechanismBuilder::new().gravity([0.0, -g, 0.0]);
        let (x, y) = (CRANK * theta.cos(), CRANK * theta.sin());
        let [(left, left_foot), (right, right_foot)] = [0, 1].map(|k| {
            let (mass, rate, foot) = (MASSES[k], rates[k], k as f64);
            let moment = mass * CRANK * CRANK / 12.0;
            let inertia = Inertia::principal(mass, [1e-3, moment, moment]);
            let crank = builder.body(&format!("crank{k}"), inertia);
            let crank = crank.at([foot + 0.5 * x, 0.5 * y, 0.0]).rotation_vector([0.0, 0.0, theta]);
            let crank = crank.velocity([-0.5 * rate * y, 0.5 * rate * x, 0.0]);
            let crank = crank.angular_velocity([0.0, 0.0, rate]).id();
            let name = format!("foot{k}");
            let hinge = builder.joint(&name, PairKind::Revolute, FrameId::Ground, crank);
            (crank, hinge.at([foot, 0.0, 0.0]).axis(Z).id())
        });
        let mean = 0.5 * (rates[0] + rates[1]);
        let coupler = builder.body("coupler", Inertia::principal(1.0, [1e-3, 0.08, 0.08]));
        let coupler = coupler.at([x + 0.5, y, 0.0]).velocity([-mean * y, mean * x, 0.0]);
        let coupler = coupler.angular_velocity([0.0, 0.0, (rates[1] - rates[0]) * x]).id();
        for (name, crank, x) in [("left", left, x), ("right", right, x + 1.0)] {
            builder.joint(name, PairKind::Revolute, crank, coupler).at([x, y, 0.0]).axis(Z);
        }
        Self { builder, feet: [left_foot, right_foot], cranks: [left, right], coupler }
    }

    /// The start of its motion with steps of `h`.
    pub(crate) fn start(
        &self,
        kind: SchemeKind,
        h: f64,
    ) -> Result<MechanismIntegrator, SetupError> {
        self.builder.build().unwrap().integrator(Options::new(kind, h))
    }

    /// The same by the nodal scheme.
    fn run(&self, h: f64) -> MechanismIntegrator {
        self.start(SchemeKind::Nodal, h).unwrap()
    }

    /// Distance of the top of the first crank from its exact place, and of the coupler from level;
    /// `start`: angle and rate initially, and gravity.
    fn missed(&self, run: &MechanismIntegrator, start: (f64, f64, f64)) -> (f64, f64) {
        let [theta, _] = parallelogram(start.0, start.1, start.2, run.state().t);
        let (crank, coupler) = (frame(run, self.cranks[0]), frame(run, self.coupler));
        let (x, y) = (2.0 * crank[0] - CRANK * theta.cos(), 2.0 * crank[1] - CRANK * theta.sin());
        (x.hypot(y), coupler[4].abs())
    }
}

/// `(θ, θ̇)` of the parallelogram: `θ̈ = −g/a ((m_0 + m_1)/2 + m) / ((m_0 + m_1)/3 + m) cos θ`.
fn parallelogram(theta: f64, rate: f64, g: f64, t: f64) -> [f64; 2] {
    let cranks: f64 = MASSES.iter().sum();
    let c = g / CRANK * (cranks / 2.0 + 1.0) / (cranks / 3.0 + 1.0);
    ode(|y: &[f64; 2]| [y[1], -c * y[0].cos()], [theta, rate], t)
}

/// Steps until `t`, which must be a whole number of steps away.
fn until(run: &mut MechanismIntegrator, t: f64) {
    while run.state().t < t - 1e-9 {
        run.step().unwrap_or_else(|e| panic!("t = {}: {e}", run.state().t));
    }
    assert!((run.state().t - t).abs() < 1e-9, "{t} is not on a step");
}

/// Centre and directors of a body.
fn frame(run: &MechanismIntegrator, body: BodyId) -> &[f64] {
    &run.state().q[12 * body.index()..][..12]
}

/// `|g(q_n)|_∞`.
fn residual(run: &mut MechanismIntegrator) -> f64 {
    run.observe_state().unwrap().position_residual
}

/// Degrees of freedom, and redundant constraints.
fn counts(run: &MechanismIntegrator) -> (usize, usize) {
    let (constraints, independent) = (run.constraints(), run.rows().len());
    (constraints.dim() - independent, constraints.len() - independent)
}

#[test]
fn flat_positions_are_passed_on_the_branch_of_the_motion() {
    // 12 rad/s upright: through both flat positions about twice a second
    let (theta, rate) = (1.5, 12.0);
    let linkage = Linkage::new(theta, [rate; 2], G);
    let (_, orders) = study("unequal cranks, 5 s", &[1e-2, 5e-3, 2.5e-3], |h| {
        let mut run = linkage.run(h);
        until(&mut run, 5.0);
        let (error, level) = linkage.missed(&run, (theta, rate, G));
        assert!(level < 1e-11 && residual(&mut run) < 1e-13, "{level:e}");
        error
    });
    assert_order(&orders, 2.0, 0.1);
    // from either side, swinging: the motion reverses close to the flat configuration, and passes
    // it
    for theta in [-0.3, -1e-3, 1e-3, 1e-6] {
        let linkage = Linkage::new(theta, [0.0; 2], G);
        let mut run = linkage.run(2e-3);
        until(&mut run, 2.0);
        let (error, level) = linkage.missed(&run, (theta, 0.0, G));
        println!("released at {theta}: error {error:.1e} m, coupler off level by {level:.1e}");
        assert!(error < 1e-3 && level < 1e-9, "{theta}: {error:e} {level:e}");
    }
}

#[test]
fn a_flat_start_continues_along_its_velocity() {
    let rate = 7.0;
    let linkage = Linkage::new(0.0, [rate; 2], G);
    for scheme in [SchemeKind::Nodal, SchemeKind::Reduced] {
        let what = format!("flat start, {}", scheme.name());
        let (_, orders) = study(&what, &[1e-2, 5e-3, 2.5e-3], |h| {
            let mut run = linkage.start(scheme, h).unwrap();
            run.step().unwrap();
            let first = residual(&mut run);
            assert!(first < 1e-14, "closure after the first step: {first:e}");
            until(&mut run, 1.0);
            let (error, level) = linkage.missed(&run, (0.0, rate, G));
            assert!(level < 1e-11, "{level:e}");
            error
        });
        assert_order(&orders, 2.0, 0.1);
    }
    assert_eq!(counts(&linkage.run(1e-2)), (1, 3), "the generic ones");
}

#[test]
fn the_other_branch_is_left_along_its_own_velocity() {
    let linkage = Linkage::new(0.0, [2.0, -6.0], 0.0);
    let place = |h: f64| {
        let mut run = linkage.run(h);
        until(&mut run, 0.3);
        assert!(residual(&mut run) < 1e-13);
        linkage.cranks.map(|crank| frame(&run, crank)[4].atan2(frame(&run, crank)[3]))
    };
    let fine = place(1e-4);
    assert!((fine[0] - fine[1]).abs() > 0.1, "it left on the parallelogram: {fine:?}");
    let (_, orders) =
        study("antiparallelogram", &[1e-2, 5e-3, 2.5e-3], |h| (place(h)[0] - fine[0]).abs());
    assert_order(&orders, 2.0, 0.3);
}

const FLAT: &str = include_str!("../models/flat_linkage.toml");

#[test]
fn a_flat_start_is_recorded_like_any_other() {
    let mut energies = Vec::new();
    let outcome = Simulation::new(&model(FLAT, &[])).unwrap().run::<()>(
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

fn refusal(overrides: &[(&str, &str)]) -> String {
    Simulation::new(&model(FLAT, overrides)).unwrap_err().to_string()
}

#[test]
fn what_decides_no_branch_is_refused() {
    let at_rest = refusal(&[("parameters.left", "0"), ("parameters.right", "0")]);
    println!("{at_rest}");
    for part in
        ["singular configuration", "`right`", "at rest", "give it a velocity or move it off"]
    {
        assert!(at_rest.contains(part), "{at_rest}");
    }
    let mixed = refusal(&[("parameters.left", "4"), ("parameters.right", "2")]);
    assert!(mixed.contains("no branch"), "{mixed}");
    let scheme = refusal(&[("simulation.scheme", "constrained")]);
    assert!(scheme.contains("`nodal`"), "{scheme}");
}

#[test]
fn a_gear_decides_the_branch_even_at_rest() {
    for rate in [0.0, 7.0] {
        // the cranks are held parallel
        let mut linkage = Linkage::new(0.0, [rate; 2], G);
        let [left, right] = linkage.feet.map(|foot| foot.coordinate(0));
        linkage.builder.gear("mesh", left, right, -1.0);
        let (_, orders) = study(&format!("geared, {rate} rad/s"), &[1e-2, 5e-3, 2.5e-3], |h| {
            let mut run = linkage.run(h);
            until(&mut run, 0.5);
            let (error, level) = linkage.missed(&run, (0.0, rate, G));
            assert!(level < 1e-11 && residual(&mut run) < 1e-13, "{level:e}");
            error
        });
        assert_order(&orders, 2.0, 0.1);
    }
}

#[test]
fn a_driven_flat_start_follows_its_drive() {
    let mut linkage = Linkage::new(0.0, [7.0; 2], G);
    linkage.builder.motion("drive", linkage.feet[0].coordinate(0), |t| [7.0 * t, 7.0, 0.0]);
    for scheme in [SchemeKind::Nodal, SchemeKind::Reduced] {
        let mut run = linkage.start(scheme, 1e-2).unwrap();
        assert_eq!(counts(&run).0, 0, "driven through and through");
        let (mut off, mut level) = (0.0_f64, 0.0_f64);
        for _ in 0..200 {
            run.step().unwrap();
            let theta = 7.0 * run.state().t;
            let (crank, coupler) = (frame(&run, linkage.cranks[0]), frame(&run, linkage.coupler));
            off = off.max((crank[3] - theta.cos()).hypot(crank[4] - theta.sin()));
            level = level.max(coupler[4].abs());
        }
        println!(
            "{}: 200 driven steps, crank off by {off:.1e}, coupler off level by {level:.1e}",
            scheme.name()
        );
        assert!(off < 1e-12 && level < 1e-9 && residual(&mut run) < 1e-13, "{off:e} {level:e}");
    }
}

/// The linkage at rest with a strut of fixed length between the left crank and the coupler: it
/// locks their hinge.
fn locked(theta: f64) -> Linkage {
    let mut linkage = Linkage::new(theta, [0.0; 2], G);
    let crank = linkage.cranks[0].point([0.0; 3]);
    linkage.builder.distance("strut", crank, linkage.coupler.point([-0.2, 0.3, 0.0]));
    linkage
}

#[test]
fn a_strut_that_locks_a_flat_linkage_is_refused() {
    // a structure, shaky where it is flat: no configuration nearby, and no motion
    let refused = locked(0.0).start(SchemeKind::Nodal, 1e-2).unwrap_err().to_string();
    println!("{refused}");
    assert!(refused.contains("singular configuration"), "{refused}");
    // not so where it is upright
    let linkage = locked(1.5);
    let mut run = linkage.run(1e-2);
    assert_eq!(counts(&run).0, 0);
    let start = frame(&run, linkage.coupler).to_vec();
    until(&mut run, 1.0);
    let moved: f64 =
        frame(&run, linkage.coupler).iter().zip(&start).map(|(a, b)| (a - b).abs()).sum();
    println!("the upright structure moves by {moved:.1e}");
    assert!(moved < 1e-13, "{moved:e}");
}
