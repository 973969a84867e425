//! Joint reactions and bar tensions against closed forms, equilibrium of every body, uniqueness.
//!
//! Physics: the constraint forces `−Gᵀ λ_n` of the discrete equations of motion
//! `M (q_{n+1} − 2 q_n + q_{n−1})/h² + ∇V + Gᵀ λ_n = 0` are what joints do to bodies. So the
//! reactions are in equilibrium with gravity and the second differences of every body to round-off,
//! and the continuous motion with the order of the scheme.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::{model, nodes, orders, simulation};
use holonom::vi_constraints::Constraints;
use holonom::vi_constraints::projection::Projections;
use holonom::vi_core::{Configuration, MechanicalSystem};
use holonom::{Model, Override, Sample, Simulation};
use nalgebra::Vector3;
use vi_multibody::joint::FrameId;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::Reactions;
use vi_rigid::{directors, null_space};
use vi_testkit::model::{body_at, heavy, joint, sensor};

fn with_sensors(model: &Model, sensors: &str) -> Model {
    Model::from_toml(&format!("{}\n{sensors}", model.to_toml())).unwrap()
}

const ROD: &str = "[[sensor]]\nname = \"s\"\ntype = \"reaction\"\nof = \"rod\"\n";

#[test]
fn the_rod_of_a_free_pendulum_carries_the_discrete_closed_form() {
    for h in [0.1_f64, 0.8] {
        let pendulum = model(
            "pendulum_free",
            &[("simulation.step", format!("{h:e}")), ("simulation.end", format!("{:e}", 40.0 * h))],
        );
        let tension = 2.0 * (1.0 - (1.0 - h * h).sqrt()) / (h * h); // λ_n l
        for sample in nodes(&with_sensors(&pendulum, ROD)) {
            // at the start that of the continuous motion, m v²/l
            let tension = if sample.step == 0 { 1.0 } else { tension };
            let error = (sample.sensors[0] - tension).abs();
            assert!(error < 1e-12, "h = {h}, step {}: off by {error:e}", sample.step);
            assert!(sample.sensors[1] > 0.5, "unique");
        }
    }
}

#[test]
fn the_rod_of_a_pendulum_pulls_by_weight_and_turning_with_the_order_of_the_scheme() {
    // released at rest from the horizontal: T = m v²/l + m g sin φ = −3 m g y
    for order in [2_u32, 4] {
        let errors = [100_u32, 200, 400].map(|steps| {
            let step = format!("{:e}", 2.0 / f64::from(steps));
            let settings = [
                ("simulation.step", step),
                ("simulation.end", "2".to_owned()),
                ("simulation.order", order.to_string()),
            ];
            let samples = nodes(&with_sensors(&model("pendulum", &settings), ROD));
            let off = |s: &Sample| (s.sensors[0] + 3.0 * 9.81 * s.q[1]).abs();
            samples.iter().map(off).fold(0.0, f64::max)
        });
        let slopes = orders(&errors);
        println!("tension, order {order}: errors {errors:?}, slopes {slopes:.3?}");
        for slope in slopes {
            assert!((slope - f64::from(order)).abs() < 0.3, "order {order}: {errors:?}");
        }
    }
}

#[test]
fn a_hanging_body_is_held_by_its_weight() {
    let text = |parent: &str, child: &str| {
        heavy("hanging", [0.0, 0.0, -9.81], "step = 0.01, end = 0.05")
            + &body_at([0.3, 0.0, -1.0], "box", 2.0, [0.1, 0.2, 0.3])
            + &joint("fixed", "hook", [parent, child], [0.0; 3])
            + &sensor("s", "reaction", "hook")
    };
    // on the body: + m g upwards, and the moment that keeps it from tilting about the hook; on the
    // ground the opposite
    for (parent, child, sign) in [("ground", "box", 1.0), ("box", "ground", -1.0)] {
        let weight = 2.0 * 9.81;
        let expected = [0.0, 0.0, weight, 0.0, -0.3 * weight, 0.0].map(|x| sign * x);
        for order in ["2", "4"] {
            let model = Model::from_toml(&text(parent, child)).unwrap();
            let set = [Override::new("simulation.order", order)];
            let model = model.with_overrides(&set).unwrap();
            for sample in nodes(&model) {
                for (k, expected) in expected.iter().enumerate() {
                    let error = (sample.sensors[k] - expected).abs();
                    assert!(error < 1e-10, "on {child}, component {k}: {:?}", sample.sensors);
                }
            }
        }
    }
}

#[test]
fn the_tip_of_the_steady_top_carries_mass_times_acceleration_less_gravity() {
    let mass = 2700.0 * std::f64::consts::PI * 0.05 * 0.05 * 0.1 / 3.0;
    for (order, steps) in [(2_u32, 500_u32), (4, 200)] {
        let errors = [steps, 2 * steps, 4 * steps].map(|steps| {
            let settings = [
                ("simulation.step", format!("{:e}", 0.5 / f64::from(steps))),
                ("simulation.end", "0.5".to_owned()),
                ("simulation.order", order.to_string()),
            ];
            let samples = nodes(&model("heavy_top_steady", &settings));
            let off = |s: &Sample| {
                let turn = 10.0 * s.t;
                let center = 0.075
                    * 60.0_f64.to_radians().sin()
                    * Vector3::new(turn.sin(), -turn.cos(), 0.0);
                let expected = mass * (Vector3::new(0.0, 0.0, 9.81) - 100.0 * center);
                let force = Vector3::from_column_slice(&s.sensors[3..6]);
                let moment = Vector3::from_column_slice(&s.sensors[6..9]);
                assert!(moment.amax() < 1e-15, "a spherical joint has no moment: {moment}");
                (force - expected).amax()
            };
            samples.iter().map(off).fold(0.0, f64::max)
        });
        let slopes = orders(&errors);
        println!("tip, order {order}: errors {errors:?} N, slopes {slopes:.3?}");
        for slope in slopes {
            assert!((slope - f64::from(order)).abs() < 0.3, "order {order}: {errors:?}");
        }
    }
}

const CHAIN: &str = include_str!("../models/every_pair.toml");

const FOUR_BAR: &str = include_str!("../models/four_bar.toml");

/// Force and moment about the centre that the reactions make on a body.
fn sum_on(
    mechanism: &Mechanism,
    body: usize,
    q: &[f64],
    reactions: &Reactions,
) -> [Vector3<f64>; 2] {
    let [mut force, mut moment] = [Vector3::zeros(); 2];
    for (joint, reaction) in mechanism.description().joints.iter().zip(&reactions.joints) {
        let (f, m) = (reaction.force_in_space(), reaction.moment_in_space());
        let arm = joint.child.point().at(q) - directors::center(&q[12 * body..]);
        for (side, sign) in [(joint.child, 1.0), (joint.parent, -1.0)] {
            if side.frame == FrameId::Frame(body) {
                force += sign * f;
                moment += sign * (m + arm.cross(&f));
            }
        }
    }
    [force, moment]
}

#[test]
fn reactions_and_gravity_balance_the_rate_of_momentum_of_every_body() {
    for text in [CHAIN, FOUR_BAR] {
        let model = Model::from_toml(text).unwrap();
        let mut simulation = Simulation::new(&model).unwrap();
        let run = simulation.integrator();
        let h = model.settings.step;
        let mut last = run.state().q.clone();
        let mut worst = [0.0_f64; 2];
        for n in 0..model.settings.steps() {
            run.step().unwrap();
            let node = run.node_before().unwrap().clone();
            let (before, state) = (run.before(), run.state());
            let q = &before.q;
            let at = Configuration::new(before.t, q);
            let reactions = Reactions::at(run.constraints(), at, &node.lambda, run.rows());
            if n > 0 {
                // M Δ²q/h² + ∇V
                let second: Vec<f64> =
                    (0..q.len()).map(|i| (state.q[i] - 2.0 * q[i] + last[i]) / (h * h)).collect();
                let mut rate = vec![0.0; q.len()];
                run.system().mass().mul_add(1.0, &second, &mut rate);
                run.system().add_potential_gradient(Configuration::new(0.0, q), 1.0, &mut rate);
                for body in 0..model.bodies.len() {
                    let own = 12 * body..12 * body + 12;
                    let needed = null_space::pull_back(&q[own.clone()], &rate[own]);
                    let [force, moment] = sum_on(run.constraints(), body, q, &reactions);
                    worst[0] = worst[0].max((needed.fixed_rows::<3>(0) - force).amax());
                    worst[1] = worst[1].max((needed.fixed_rows::<3>(3) - moment).amax());
                }
            }
            last.copy_from_slice(q);
        }
        println!("{}: residual of the equilibrium {worst:?} N, N·m", model.header.name);
        // stored coordinates are differenced twice: ε |q| / h²
        assert!(worst[0] < 1e-8 && worst[1] < 1e-8, "{}: {worst:?}", model.header.name);
    }
}

#[test]
fn multipliers_of_accelerations_are_those_of_the_saddle_point_matrix() {
    let names = "heavy_top gyroscope chain8 panda slider_crank bricard six_hinge_cube four_bar_windows \
                 andrews_squeezer strandbeest flexible_four_bar satellite four_particles";
    for name in names.split_whitespace() {
        let mut simulation = simulation(name, &[("simulation.end", "1e3".to_owned())]);
        let run = simulation.integrator();
        (0..20).for_each(|_| _ = run.step().unwrap());
        let lambda = run.acceleration_multiplier().unwrap();
        let (system, mechanism, at) =
            (run.system(), run.constraints(), run.state().configuration());
        let (mut v, mut expected) = (vec![0.0; at.q.len()], vec![0.0; lambda.len()]);
        let mut saddle = Projections::new(system, mechanism.len(), run.rows());
        saddle.velocity(system, mechanism, at, 0.0, &run.state().p, &mut v).unwrap();
        saddle.acceleration_multiplier(system, mechanism, at.moving(&v), &mut expected).unwrap();
        let size = expected.iter().fold(0.0_f64, |size, l| size.max(l.abs()));
        let pairs = lambda.iter().zip(&expected);
        let off = pairs
            .fold(0.0_f64, |off, (a, b)| if (a - b).abs() <= off { off } else { (a - b).abs() });
        println!("{name}: {size:.1e} N, off by {:.1e}", off / size);
        assert!(off <= 1e-13 * size, "{name}: {off:e} of {size:e}");
    }
}

#[test]
fn a_tree_is_unique_throughout() {
    let model = Model::from_toml(CHAIN).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let run = simulation.integrator();
    let lambda = run.acceleration_multiplier().unwrap();
    let state = run.state();
    let reactions = Reactions::at(run.constraints(), state.configuration(), &lambda, run.rows());
    assert!(reactions.joints.iter().all(|r| r.is_unique()));
}

#[test]
fn the_thread_of_a_screw_carries_its_nut() {
    // u = κ θ: (m κ² + I) θ̈ = −m g κ
    let text = include_str!("../models/nut.toml");
    let (mass, inertia, kappa) = (2.0, 0.05, 0.5 / std::f64::consts::TAU);
    let spin = -mass * 9.81 * kappa / (mass * kappa * kappa + inertia);
    let expected = [0.0, 0.0, mass * (9.81 + kappa * spin), 0.0, 0.0, inertia * spin];
    for order in [2_u32, 4] {
        let errors = [0.004, 0.002, 0.001].map(|step: f64| {
            let set = |key: &str, value| Override::new(format!("simulation.{key}"), value);
            let settings = [set("order", order.to_string()), set("step", format!("{step:e}"))];
            let model = Model::from_toml(text).unwrap().with_overrides(&settings).unwrap();
            let samples = nodes(&model);
            let last = samples.last().unwrap();
            let (way, angle) = (last.q[2], last.sensors[7]); // its one coordinate is the turn
            assert!((angle - 0.5 * spin * last.t * last.t).abs() < 0.1, "counted on: {angle}");
            assert!((way - kappa * angle).abs() < 1e-12, "on its thread");
            let off = |s: &Sample| {
                let pairs = s.sensors.iter().zip(expected);
                pairs.map(|(value, expected)| (value - expected).abs()).fold(0.0, f64::max)
            };
            samples.iter().map(off).fold(0.0, f64::max)
        });
        let slopes = orders(&errors);
        println!("screw, order {order}: errors {errors:?} N, N·m, slopes {slopes:.3?}");
        if order == 2 {
            assert!(slopes.iter().all(|slope| (slope - 2.0).abs() < 0.1), "{errors:?}");
        } else {
            // at the acceleration level the speed, the only thing that is not exact, has no part
            assert!(errors.iter().all(|error| *error < 1e-10), "{errors:?}");
        }
    }
}
