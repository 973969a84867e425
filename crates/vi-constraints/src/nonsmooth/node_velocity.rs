//! The velocity of a node with contacts, and what its kinetic energy owes to their impulses.
//!
//! ```text
//! U_n = U⁻ + W Λ'       U_n = 0   of what stays closed along the normal, sticks or holds
//!                       Λ' = h_{n−1}/(h_{n−1} + h_n) Λ   of what slides,   Λ' = Λ   of what is hit
//! v_n = v̂ of p̄_n + BᵀΛ',   T_n − T⁻ = ½ Λ'·(U_n + U⁻)
//! ```
//! With `Λ' = 0` of what is hit it is the velocity with which the last step arrives.
//!
//! `T⁻` of `p̄_n` has half a step of the loads that a support carries, `½ m (ha/2)²` of a body that
//! rests, and the friction of half a step too little. Conjugate gradients begin at the part of the
//! impulses that belongs to the step before, which is the solution under uniform loads.

use super::delassus::Delassus;
use super::node_law::Contact;
use super::record::{ContactRecord, ContactStatus};
use vi_core::linear::{dot, norm_inf};

/// A residual of velocities in parts of the largest one.
const SETTLED: f64 = 1e-13;
/// What impulses that balance one another change, in parts of what each one does alone.
const SINGULAR: f64 = 1e-12;
/// Most iterations.
const ITERATIONS: usize = 200;

/// Scratch.
#[derive(Debug, Default)]
pub(super) struct NodeVelocity {
    free: Vec<bool>,       // k  whether U_n = 0
    diagonal: Vec<f64>,    // k  W_ii
    part: Vec<f64>,        // k  Λ'
    residual: Vec<f64>,    // k  −U_n of free rows
    direction: Vec<f64>,   // k
    image: Vec<f64>,       // k  W times it
    conditioned: Vec<f64>, // k
}

impl NodeVelocity {
    /// `Λ'`, shape `k`; `minus`: `U⁻`, `shares`: `h_{n−1}/(h_{n−1} + h_n)`, and the part of what is
    /// hit.
    pub(super) fn find(
        &mut self,
        (contacts, W): (&[Contact], &Delassus),
        minus: &[f64],
        [share, hit]: [f64; 2],
        records: &[ContactRecord],
    ) -> &[f64] {
        let k = minus.len();
        let Self { free, diagonal, part, residual, direction, image, conditioned } = self;
        free.clear();
        diagonal.clear();
        diagonal.extend((0..k).map(|i| W.at(i, i)));
        part.clear();
        for (contact, record) in contacts.iter().zip(records) {
            for i in 0..contact.law.rows() {
                let (is_free, share) = match record.status {
                    ContactStatus::Open => (false, 0.0),
                    ContactStatus::Impact => (false, hit),
                    ContactStatus::Stick => (true, share),
                    ContactStatus::Slip => (i == 0 && contact.law.restitution().is_some(), share),
                };
                free.push(is_free && diagonal[contact.row + i] > 0.0);
                part.push(share * record.impulse[i]);
            }
        }
        let speeds = norm_inf(minus);
        let velocity = |i: usize, part: &[f64]| minus[i] + W.product(i, |j| part[j]);
        residual.clear();
        residual.extend((0..k).map(|i| if free[i] { -velocity(i, part) } else { 0.0 }));
        let condition = |residual: &[f64], out: &mut Vec<f64>| {
            out.clear();
            let rows = residual.iter().enumerate();
            out.extend(rows.map(|(i, r)| if free[i] { r / diagonal[i] } else { 0.0 }));
        };
        condition(residual, conditioned);
        direction.clone_from(conditioned);
        let mut size = dot(residual, conditioned);
        for _ in 0..ITERATIONS {
            if norm_inf(residual) <= SETTLED * speeds {
                break;
            }
            image.clear();
            let rows = 0..k;
            image.extend(rows.map(|i| if free[i] { W.product(i, |j| direction[j]) } else { 0.0 }));
            let curvature = dot(direction, image);
            let alone = direction.iter().zip(&*diagonal).map(|(d, w)| d * d * w).sum::<f64>();
            if curvature.is_nan() || curvature <= SINGULAR * alone {
                break; // nothing but what balances itself is left
            }
            let length = size / curvature;
            for i in 0..k {
                part[i] += length * direction[i];
                residual[i] -= length * image[i];
            }
            condition(residual, conditioned);
            let next = dot(residual, conditioned);
            let turn = next / size;
            size = next;
            for (direction, conditioned) in direction.iter_mut().zip(&*conditioned) {
                *direction = conditioned + turn * *direction;
            }
        }
        part
    }

    /// Hands out for each record of the node the work of the impulses found last.
    pub(super) fn work(
        &self,
        (contacts, W): (&[Contact], &Delassus),
        minus: &[f64],
        records: &mut [ContactRecord],
        set: impl Fn(&mut ContactRecord, f64),
    ) {
        let part = &self.part;
        for (contact, record) in contacts.iter().zip(records) {
            let rows = contact.row..contact.row + contact.law.rows();
            let change = |i: usize| W.product(i, |j| part[j]);
            let work = rows.map(|i| 0.5 * part[i] * (change(i) + 2.0 * minus[i]));
            set(record, work.sum());
        }
    }
}
