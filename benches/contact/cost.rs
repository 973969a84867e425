//! Cost of contacts: stops beside plain steps, as ratios in one run, and spheres that settle in a
//! box, by their number.
//!
//! Rows: chains of 1 and 8 links, a four-bar and a ball with stops, or a floor, out of reach beside
//! the same without; pressed on its stop or floor beside the same without. By both methods. Then
//! beds of spheres in five layers with friction 0.3: time of a step and contact when they lie, and
//! the exponent over the number of spheres: `-- N1 N2 ...` for others than 125, 1125 and 10,125,
//! `-- silo N1 N2 ...` for layers of 5 × 5 spheres.
#![allow(clippy::unwrap_used, missing_docs)] // a bench

#[path = "../../crates/vi-multibody/tests/bed.rs"]
mod bed;

use bed::{LAYERS, bed, silo};
use holonom::vi_constraints::nonsmooth::{ContactLaw, Method, NonsmoothOptions};
use holonom::vi_constraints::{InitialValues, Options, SchemeKind};
use holonom::vi_core::Quadrature;
use holonom::vi_multibody::builder::{Inertia, JointLimits, MechanismBuilder};
use holonom::vi_multibody::run::{MechanismIntegrator, Solver, integrator, with_contacts};
use holonom::vi_multibody::{FrameId, PairKind};
use holonom::vi_rigid::gap::ContactShape;
use std::time::Instant;

fn begin(builder: &MechanismBuilder, h: f64, method: Method) -> MechanismIntegrator {
    let built = builder.build().unwrap();
    let options = Options::new(SchemeKind::Nodal, h);
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let (at, system) = (InitialValues::new(0.0, &q, &v), built.system(Quadrature::Midpoint));
    let run = integrator(built.mechanism, system, options, Solver::Auto, at).unwrap();
    let contacts = NonsmoothOptions { method, ..NonsmoothOptions::default() };
    with_contacts(run, SchemeKind::Nodal, built.forces.contacts, contacts).unwrap()
}

/// A chain with a lower stop of its last link, or stops of all links far away; `pressed`: by a
/// spring.
fn chain(links: usize, stops: Option<f64>, pressed: bool) -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let mut parent: FrameId = FrameId::Ground;
    for k in 0..links {
        let inertia = Inertia::principal(1.0, [1e-3, 0.1, 0.1]);
        let at = [0.5 + k as f64, 0.0, 0.0];
        let body = builder.body(&format!("link{k}"), inertia).at(at).id();
        let hinge = builder.joint(&format!("hinge{k}"), PairKind::Revolute, parent, body);
        let hinge = hinge.at([k as f64, 0.0, 0.0]).axis([0.0, -1.0, 0.0]).id().coordinate(0);
        let is_last = k + 1 == links;
        if let Some(lower) = stops.filter(|lower| *lower != 0.0 || is_last) {
            let (lower, upper) = (Some(lower), Some(30.0));
            builder.joint_limits(hinge, JointLimits { lower, upper, restitution: 0.5 });
        }
        if pressed && is_last {
            builder.joint_spring(hinge, 20.0, -1.0);
        }
        parent = body.into();
    }
    builder
}

/// A four-bar, likewise with a stop of its crank.
fn four_bar(stop: Option<f64>, pressed: bool) -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let mut bar =
        |name: &str, at| builder.body(name, Inertia::principal(1.0, [0.1; 3])).at(at).id();
    let crank = bar("crank", [0.0, 0.0, 0.5]);
    let [coupler, rocker] =
        [("coupler", [0.5, 0.0, 1.0]), ("rocker", [1.0, 0.0, 0.5])].map(|(name, at)| bar(name, at));
    let ends: [(&str, FrameId, FrameId, [f64; 3]); 4] = [
        ("foot", FrameId::Ground, crank.into(), [0.0; 3]),
        ("elbow", crank.into(), coupler.into(), [0.0, 0.0, 1.0]),
        ("wrist", coupler.into(), rocker.into(), [1.0, 0.0, 1.0]),
        ("other foot", FrameId::Ground, rocker.into(), [1.0, 0.0, 0.0]),
    ];
    let joints = ends.map(|(name, parent, child, at)| {
        let joint = builder.joint(name, PairKind::Revolute, parent, child);
        joint.at(at).axis([0.0, 1.0, 0.0]).id()
    });
    let foot = joints[0].coordinate(0);
    if let Some(lower) = stop {
        let (lower, upper) = (Some(lower), Some(30.0));
        builder.joint_limits(foot, JointLimits { lower, upper, restitution: 0.5 });
    }
    if pressed {
        builder.joint_spring(foot, 50.0, -1.0);
    }
    builder
}

/// A ball that turns and drifts above a floor without gravity, or lies on it.
fn ball(has_floor: bool, lies: bool) -> MechanismBuilder {
    let (g, z) = if lies { (9.81, 0.1) } else { (0.0, 3.0) };
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -g]);
    let ball = builder.body("ball", Inertia::principal(1.0, [0.004; 3])).at([0.0, 0.0, z]);
    let ball = ball.velocity([0.3, 0.1, 0.0]).angular_velocity([1.0, 2.0, 3.0]).id();
    if has_floor {
        let floor = ContactShape::Plane { point: [0.0; 3].into(), normal: [0.0, 0.0, 1.0].into() };
        let sphere: (FrameId, _) = (ball.into(), ContactShape::sphere([0.0; 3].into(), 0.1));
        let (floor, law) = ((FrameId::Ground, floor), ContactLaw::coulomb(0.3, 0.2));
        builder.shape_contact("floor", floor, sphere, law).unwrap();
    }
    builder
}

/// The least times of a step, s, of several runs that alternate.
fn least(make: &[&dyn Fn() -> MechanismIntegrator], rounds: usize) -> Vec<f64> {
    let mut best = vec![f64::INFINITY; make.len()];
    for _ in 0..rounds {
        for (best, make) in best.iter_mut().zip(make) {
            let mut run = make();
            (0..20).for_each(|_| run.step().map(|_| ()).unwrap());
            for _ in 0..6 {
                let start = Instant::now();
                (0..10).for_each(|_| run.step().map(|_| ()).unwrap());
                *best = best.min(start.elapsed().as_secs_f64() / 10.0);
            }
        }
    }
    best
}

/// So many spheres that settle, in five layers or in layers of 5 × 5.
fn settling(count: usize, is_silo: bool) -> MechanismIntegrator {
    let side = ((count / LAYERS) as f64).sqrt().round() as usize;
    let builder = if is_silo { silo(5, count / 25) } else { bed(side) };
    begin(&builder, 0.005, Method::Stepping)
}

fn main() {
    let quick = std::env::args().any(|a| a == "--test");
    let rounds = if quick { 1 } else { 60 };
    let stops = [(None, false), (Some(-30.0), false), (None, true), (Some(0.0), true)];
    let chains = |links| stops.map(|(stop, pressed)| chain(links, stop, pressed)).to_vec();
    let balls = [(false, false), (true, false), (false, true), (true, true)];
    for (name, builders) in [
        ("1 link", chains(1)),
        ("8 links", chains(8)),
        ("four-bar", stops.map(|(stop, pressed)| four_bar(stop, pressed)).to_vec()),
        ("ball", balls.map(|(has_floor, lies)| ball(has_floor, lies)).to_vec()),
    ] {
        for method in [Method::Stepping, Method::Events] {
            let make: Vec<_> =
                builders.iter().map(|own| move || begin(own, 0.001, method)).collect();
            let make: Vec<&dyn Fn() -> MechanismIntegrator> =
                make.iter().map(|own| own as &dyn Fn() -> MechanismIntegrator).collect();
            let found = least(&make, rounds);
            println!(
                "{name}, {method:?}: plain {:.3} us, out of reach {:.3}, closed {:.3} plain steps",
                1e6 * found[0],
                found[1] / found[0],
                found[3] / found[2]
            );
        }
    }
    let given: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let sizes: &[usize] = match quick {
        _ if !given.is_empty() => &given,
        true => &[45],
        false => &[125, 1125, 10125],
    };
    let is_silo = std::env::args().any(|a| a == "silo");
    let mut costs = Vec::new();
    for &count in sizes {
        let mut run = settling(count, is_silo);
        let (mut spent, mut counted, mut worst) = (0.0, 0, 0.0_f64);
        let (fall, lie) = if quick { (20, 5) } else { (160, 20) };
        for step in 0..fall + lie {
            let start = Instant::now();
            run.step().unwrap();
            let own = start.elapsed().as_secs_f64();
            worst = worst.max(own);
            if step >= fall {
                spent += own;
                counted += run.nonsmooth().unwrap().nodes().map(|node| node.1.len()).sum::<usize>();
            }
        }
        let cost = spent / counted.max(1) as f64;
        println!(
            "{count} spheres: {} contacts, {:.2} us per step and contact, slowest step {worst:.2} s, gap {:.1e} m",
            counted / lie,
            1e6 * cost,
            run.state().contacts.counts.smallest_gap.unwrap_or(0.0)
        );
        costs.push((count as f64, spent));
    }
    if let [(first, a), .., (last, b)] = costs[..] {
        println!("exponent {:.2}", (b / a).ln() / (last / first).ln());
    }
}
