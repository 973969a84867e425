//! The Galerkin schemes of order `2s`: limit `s = 1`, orders, invariants, reversal, memory.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;
use crate::harness;

use benchmark::{Run, apart, assert_order, study};
use harness::models::shipped;
use holonom::vi_constraints::{InitialValues, Options, SchemeKind};
use holonom::vi_core::galerkin::Stages;
use holonom::vi_core::linear::norm_inf;
use holonom::vi_core::{MechanicalSystem, Quadrature, SeparableSystem};
use holonom::vi_multibody::builder::MechanismBuilder;
use holonom::vi_multibody::mechanism::Mechanism;
use holonom::vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use nalgebra::Vector3;

const GALERKIN: [(&str, &str); 1] = [("simulation.method", "galerkin")];
const CHAIN: &str = include_str!("../examples/models/chain8.toml");
const TOP: &str = include_str!("../examples/models/heavy_top.toml");

fn chain(h: f64, order: u32) -> f64 {
    let mut run = Run::with(CHAIN, h, order, &GALERKIN);
    let tip = run.point("link8", [8.0, 0.0, 0.0]);
    run.until(1.0);
    (run.at(tip) - Vector3::new(4.086_210_757_198, -0.893_891_357_675, -6.337_916_339_015)).norm()
}

#[test]
fn the_tip_of_the_chain() {
    let (_, orders) = study("chain, order 4", &[5e-2, 2.5e-2, 1.25e-2], |h| chain(h, 4));
    assert_order(&orders, 4.0, 0.3);
    let (_, orders) = study("chain, order 6", &[1e-1, 5e-2, 2.5e-2], |h| chain(h, 6));
    assert_order(&orders, 6.0, 1.0);
    let (errors, _) = study("chain, order 8", &[1e-1, 5e-2, 2.5e-2], |h| chain(h, 8));
    assert!(errors[0] < 1e-4 && errors[1] < 1e-6 && errors[2] < 1e-9, "{errors:?}");
    let (errors, _) = study("chain, order 16", &[1e-1], |h| chain(h, 16));
    assert!(errors[0] < 1e-9, "{errors:?}");
}

fn top(h: f64, order: u32) -> f64 {
    let mut run = Run::with(TOP, h, order, &GALERKIN);
    run.until(10.0);
    let q = run.q();
    let x = Vector3::new(q[0], q[1], q[2]);
    (x - Vector3::new(-0.102_307_757_820, 0.286_070_018_166, -0.952_731_372_107)).norm()
}

#[test]
fn the_heavy_top() {
    let (_, orders) = study("top, order 4", &[2e-2, 1e-2, 5e-3], |h| top(h, 4));
    assert_order(&orders, 4.0, 0.2);
    let (_, orders) = study("top, order 6", &[5e-2, 2.5e-2, 1.25e-2], |h| top(h, 6));
    assert_order(&orders, 6.0, 0.3);
    let (errors, _) = study("top, order 8", &[5e-2, 2.5e-2], |h| top(h, 8));
    assert!(errors[1] < 1e-8, "{:e}", errors[1]);
}
