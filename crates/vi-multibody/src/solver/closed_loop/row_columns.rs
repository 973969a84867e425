//! What a joint takes from four rows of loops side by side, and what it passes on, for
//! [`super::row_sweeps`].
//!
//! ```text
//! column            c = S·W         û = u − S·p,            p ← p + Ã S' D⁻¹ û           v̂ = D⁻¹ (c + S'·p),  p ← p − Sᵀ Ã v̂
//! rotation vector   c = W_a         û = Ã_aa⁻¹ (u − p_a),   p ← (p_l + Ã_la û, 0)        v̂ = c + p_a,         p ← (p_l − Gᵀ v̂, 0)
//! ```
//! `G = Ã_aa⁻¹ Ã_al`. Entries of a rotation vector belong to `δω`, of which `δθ = T⁻¹ δω` is made
//! when all is solved.
#![allow(non_snake_case)] // A, G, S

use super::four_rows::{FourRows, held, load, screw};
use crate::geometry::matrix::{self, Columns};
use crate::geometry::members::{LanesScrew, LanesVector};
use crate::geometry::one_tree::HeldVector;
use crate::geometry::one_tree::One;
use crate::geometry::space::{Space, Vector as _};
use crate::sweep::columns::Act;
use crate::sweep::eliminate::EliminatedRotation;
use crate::sweep::link::{ColumnWork, Gain, Link};
use vi_core::lanes::{Lanes, Register};

/// `S·w` of a column along `axis`.
#[inline(always)]
fn along<T: Register>(
    link: &Link<One>,
    act: Act,
    lanes: T,
    axis: &[f64; 3],
    w: LanesScrew<T::Lanes>,
) -> T::Lanes {
    let axis = lanes.vector(*axis);
    match act {
        Act::Slide => axis.dot(w.linear),
        Act::Turn => axis.dot(w.angular),
        Act::Screw => axis.dot(w.angular) + axis.dot(w.linear) * link.pitch,
    }
}

/// `c ← c + S·W` of a column, `S'·W` where the `next` node is meant.
#[inline(always)]
pub(super) fn enter<T: Register>(
    (link, act): (&Link<One>, Act),
    (lanes, column, next): (T, &ColumnWork<One>, bool),
    value: &mut FourRows,
    wrench: LanesScrew<T::Lanes>,
) {
    let axis = if next { &column.axis_next } else { &column.axis };
    *value = held(load(lanes, value) + along(link, act, lanes, &axis.xyz(), wrench));
}

/// Of a column: `û = u − S·p`, `p ← p + Ã S' D⁻¹ û`.
#[inline(always)]
pub(super) fn pass<T: Register>(
    (link, act): (&Link<One>, Act),
    (lanes, column, AS): (T, &ColumnWork<One>, &matrix::Screw<HeldVector>),
    value: &mut FourRows,
    p: &mut LanesScrew<T::Lanes>,
) {
    let u = load(lanes, value) - along(link, act, lanes, &column.axis.xyz(), *p);
    *value = held(u);
    let AS = screw(lanes, [AS.linear.xyz(), AS.angular.xyz()]);
    *p = p.plus(AS.times(u * column.inverse));
}

/// The same transposed: `v̂ = D⁻¹ (c + S'·p)`, `p ← p − Sᵀ Ã v̂`.
#[inline(always)]
pub(super) fn pass_transposed<T: Register>(
    (link, act): (&Link<One>, Act),
    (lanes, column): (T, &ColumnWork<One>),
    value: &mut FourRows,
    p: &mut LanesScrew<T::Lanes>,
) {
    let v = (load(lanes, value) + along(link, act, lanes, &column.axis_next.xyz(), *p))
        * column.inverse;
    *value = held(v);
    let SA = screw(lanes, [column.SA.linear.xyz(), column.SA.angular.xyz()]);
    *p = p.plus(SA.times(v * -1.0));
}

/// Of a rotation vector: `û = Ã_aa⁻¹ (u − p_a)`, and `p_l + Ã_la û`; no torque passes.
#[inline(always)]
pub(super) fn rotate<T: Register>(
    lanes: T,
    at: &EliminatedRotation<One>,
    own: &mut [FourRows],
    p: LanesScrew<T::Lanes>,
) -> LanesScrew<T::Lanes> {
    let rest = get(lanes, own) - p.angular;
    put(own, multiply(lanes, &at.inverse, rest));
    LanesScrew { linear: p.linear + multiply(lanes, &at.coupling, rest), angular: zero(lanes) }
}

/// The same transposed: `v̂ = c + p_a`, which the inverse has no part in, and `p_l − Gᵀ v̂`.
#[inline(always)]
pub(super) fn rotate_transposed<T: Register>(
    lanes: T,
    gain: &Gain<One>,
    own: &mut [FourRows],
    p: LanesScrew<T::Lanes>,
) -> LanesScrew<T::Lanes> {
    add(lanes, own, p.angular);
    let v = get(lanes, own);
    let column = |j: usize| lanes.vector(gain.0[j].xyz()).dot(v);
    let taken = LanesVector([column(0), column(1), column(2)]);
    LanesScrew { linear: p.linear - taken, angular: zero(lanes) }
}

/// `m x`.
#[inline(always)]
pub(super) fn multiply<T: Register>(
    lanes: T,
    m: &Columns<HeldVector>,
    LanesVector([x, y, z]): LanesVector<T::Lanes>,
) -> LanesVector<T::Lanes> {
    let column = |j: usize, x: T::Lanes| lanes.vector(m.0[j].xyz()).scaled(x);
    column(0, x) + column(1, y) + column(2, z)
}

#[inline(always)]
pub(super) fn zero<T: Register>(lanes: T) -> LanesVector<T::Lanes> {
    lanes.vector([0.0; 3])
}

/// The values of three columns.
#[inline(always)]
pub(super) fn get<T: Register>(lanes: T, own: &[FourRows]) -> LanesVector<T::Lanes> {
    LanesVector([load(lanes, &own[0]), load(lanes, &own[1]), load(lanes, &own[2])])
}

#[inline(always)]
pub(super) fn put(own: &mut [FourRows], LanesVector([x, y, z]): LanesVector<impl Lanes>) {
    (own[0], own[1], own[2]) = (held(x), held(y), held(z));
}

#[inline(always)]
pub(super) fn add<T: Register>(lanes: T, own: &mut [FourRows], more: LanesVector<T::Lanes>) {
    let sum = get(lanes, own) + more;
    put(own, sum);
}
