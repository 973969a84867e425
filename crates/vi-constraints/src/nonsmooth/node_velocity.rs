//! The velocity of a node with contacts, and what its kinetic energy owes to their impulses.
//!
//! ```text
//! U_n = U⁻ + W Λ'       U_n = 0   of what stays closed along the normal, sticks or holds
//!                       Λ' = h_{n−1}/(h_{n−1} + h_n) Λ   of what slides
//!                       Λ' = Λ    of what is hit, has its gap closed by the step from there, or is
//!                                 left by an impact
//! v_n = v̂ of p̄_n + BᵀΛ',   T_n − T⁻ = ½ Λ'·(U_n + U⁻)
//! ```
//! With `Λ' = 0` of what is hit it is the velocity with which the last step arrives.
//!
//! `T⁻` of `p̄_n` has half a step of the loads that a support carries, `½ m (ha/2)²` of a body that
//! rests, and the friction of half a step too little.

use super::delassus::Delassus;
use super::holding::Holding;
use super::node_law::Contact;
use super::record::{ContactRecord, ContactStatus};

/// Scratch.
#[derive(Debug, Default)]
pub(super) struct NodeVelocity(Holding);

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
        let Self(holding) = self;
        holding.begin();
        for (contact, record) in contacts.iter().zip(records) {
            for i in 0..contact.law.rows() {
                let (is_free, share) = match record.status {
                    ContactStatus::Open => (false, 0.0),
                    _ if contact.leaves => (hit == 0.0, hit),
                    _ if contact.is_struck => (false, hit),
                    ContactStatus::Slip => (i == 0 && contact.law.restitution().is_some(), share),
                    _ => (true, share),
                };
                holding.add(is_free, share * record.impulse[i], W);
            }
        }
        holding.hold(W, minus);
        &holding.part
    }

    /// Hands out for each record of the node the work of the impulses found last.
    pub(super) fn work(
        &self,
        (contacts, W): (&[Contact], &Delassus),
        minus: &[f64],
        records: &mut [ContactRecord],
        set: impl Fn(&mut ContactRecord, f64),
    ) {
        let part = &self.0.part;
        for (contact, record) in contacts.iter().zip(records) {
            let rows = contact.row..contact.row + contact.law.rows();
            let change = |i: usize| W.product(i, |j| part[j]);
            let work = rows.map(|i| 0.5 * part[i] * (change(i) + 2.0 * minus[i]));
            set(record, work.sum());
        }
    }
}
