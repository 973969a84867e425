//! Trees against independent references: a chain of eight boxes, a heavy top.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, study};

const CHAIN: &str = include_str!("../../examples/models/chain8.toml");
const TOP: &str = include_str!("../../examples/models/heavy_top.toml");

fn chain(h: f64, order: u32) -> f64 {
    Run::new(CHAIN, h, order).error_of_chain()
}

#[test]
fn the_tip_of_the_chain() {
    let (_, orders) = study("chain, order 2", &[1e-2, 5e-3, 2.5e-3, 1.25e-3], |h| chain(h, 2));
    assert_order(&orders, 2.0, 0.1);
    let (_, orders) = study("chain, order 4", &[1e-2, 5e-3, 2.5e-3], |h| chain(h, 4));
    assert_order(&orders, 4.0, 0.3);
    let (_, orders) = study("chain, order 6", &[4e-2, 2e-2, 1e-2], |h| chain(h, 6));
    assert_order(&orders, 6.0, 0.8);
    let (errors, _) = study("chain, order 8", &[1e-2, 5e-3], |h| chain(h, 8));
    assert!(errors[1] < 1e-9, "{:e}", errors[1]);
}

fn top(h: f64, order: u32) -> f64 {
    Run::new(TOP, h, order).error_of_top()
}

#[test]
fn the_heavy_top() {
    let (_, orders) = study("top, order 2", &[1e-2, 5e-3, 2.5e-3], |h| top(h, 2));
    assert_order(&orders, 2.0, 0.2);
    let (_, orders) = study("top, order 4", &[2e-2, 1e-2, 5e-3], |h| top(h, 4));
    assert_order(&orders, 4.0, 0.3);
    let (errors, _) = study("top, order 8", &[4e-2, 2e-2], |h| top(h, 8));
    assert!(errors[1] < 1e-7, "{:e}", errors[1]);
}
