//! What happened at the nodes of a step.

use super::unilateral::ContactPlace;
use serde::{Deserialize, Serialize};
use vi_core::contact_state::ContactId;

/// What a contact does at a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactStatus {
    /// It transmits no impulse.
    Open,
    /// It keeps its place; a stop without friction is closed.
    Stick,
    /// It slides.
    Slip,
    /// It is hit.
    Impact,
}

/// Which part of the impulse of a contact follows from the motion; the rest is one choice of many.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unique {
    /// All of it.
    All,
    /// That along the normal.
    Normal,
    /// None: sums alone do.
    No,
}

impl Unique {
    /// In files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Normal => "normal",
            Self::No => "no",
        }
    }
}

/// A contact at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactRecord {
    /// The contact.
    pub id: ContactId,
    /// What it does.
    pub status: ContactStatus,
    /// `Λ`: along the normal and both tangents, N·s; along the coordinate of dry friction.
    pub impulse: [f64; 3],
    /// `U⁻`, m/s or rad/s.
    pub before: [f64; 3],
    /// `U⁺`.
    pub after: [f64; 3],
    /// Where it is; `None` of a joint coordinate.
    pub place: Option<ContactPlace>,
    /// `g(q_n)`, m or rad.
    pub gap: f64,
    /// `σ` of the step from the node along both tangents; rate of the coordinate of dry friction.
    pub slip: [f64; 2],
    /// The same of dry friction in the step before.
    pub slip_before: f64,
    /// `½ Λ·(U⁺ + U⁻)`, J.
    pub work: f64,
    /// The part of it up to the velocity of the node, J: of the first node of a macro step; else 0.
    pub work_before: f64,
    /// The same before anything is hit.
    pub work_arriving: f64,
    /// Which part of `Λ` is unique, of the first node of a macro step; `None` where that is not
    /// known, or not asked for.
    pub unique: Option<Unique>,
}

/// A node with contacts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeRecord {
    /// `t_n`, s.
    pub t: f64,
    /// Length of the step that ended there, s; 0 at the start.
    pub before: f64,
    /// Length of the step from there, s.
    pub after: f64,
    /// Its contacts: places among those of the step.
    pub contacts: std::ops::Range<usize>,
}

/// The nodes of a macro step.
#[derive(Clone, Debug, Default)]
pub(super) struct Records {
    pub(super) nodes: Vec<NodeRecord>,
    pub(super) contacts: Vec<ContactRecord>,
    pub(super) first: FirstImpulses,
}

/// Impulses of contacts at the first node of a macro step, each empty where there are no contacts.
#[derive(Clone, Debug, Default)]
pub(super) struct FirstImpulses {
    pub(super) whole: Vec<f64>,   // n  BᵀΛ
    pub(super) up_to: Vec<f64>,   // n  BᵀΛ' up to the velocity of the node
    pub(super) arrived: Vec<f64>, // n  the same before anything is hit
}

impl FirstImpulses {
    pub(super) fn contact_impulse(&self) -> ContactImpulse<'_> {
        ContactImpulse { whole: &self.whole, up_to: &self.up_to }
    }
}

/// The impulse of contacts at a node, N·s, each of shape `n` or empty.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactImpulse<'a> {
    /// `BᵀΛ`.
    pub whole: &'a [f64],
    /// `BᵀΛ'`, the part of it up to the velocity of the node.
    pub up_to: &'a [f64],
}

impl Records {
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.contacts.clear();
        let FirstImpulses { whole, up_to, arrived } = &mut self.first;
        [whole, up_to, arrived].into_iter().for_each(Vec::clear);
    }
}
