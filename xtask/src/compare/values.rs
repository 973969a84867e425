//! Numbers of a comparison as the page writes them, and what they are read from.

use super::Compared;
use holonom::compare::{Measured, Record};
use holonom::vi_core::linear::norm_inf;

pub(super) fn number(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.1e}") }
}

pub(super) fn record<'a>(one: &'a Compared, scheme: &str) -> Option<&'a Record> {
    one.found.records.iter().find(|r| r.scheme == scheme)
}

/// Largest drift of the momentum maps that the system conserves.
pub(super) fn drift(one: &Compared, m: &Measured) -> f64 {
    let names = ["Px", "Py", "Pz", "Lx", "Ly", "Lz"];
    let conserved =
        names.iter().zip(m.momentum_drift).filter(|d| one.found.conserved.iter().any(|k| k == d.0));
    norm_inf(&conserved.map(|d| d.1).collect::<Vec<_>>())
}
