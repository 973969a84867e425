//! Contacts along a run: those of a node, and what they did since.
//!
//! ```text
//! force of a node    Λ_n / ½(h_{n−1} + h_n)      h_{n−1} = 0 at the start
//! ```
//! A contact lasts from the node where it transmits an impulse without an impact to the node where
//! it is open.

use crate::event::EventRecord;
use crate::system::contact_origin::ContactOrigin;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use vi_constraints::nonsmooth::{ContactRecord, ContactStatus, NodeRecord, Nonsmooth, Unique};
use vi_core::contact_state::ContactId;
use vi_multibody::contact::compliant_contact::CompliantContact;
use vi_rigid::gap::tangents;

/// A contact with a gap above this is open, m or rad.
const OPEN: f64 = 1e-10;

/// What a contact does at a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ContactPhase {
    /// It keeps its place; without friction it is closed.
    Stick,
    /// It slides.
    Slip,
    /// It is hit.
    Impact,
}

impl ContactPhase {
    /// In files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stick => "stick",
            Self::Slip => "slip",
            Self::Impact => "impact",
        }
    }

    fn of(status: ContactStatus) -> Option<Self> {
        match status {
            ContactStatus::Open => None,
            ContactStatus::Stick => Some(Self::Stick),
            ContactStatus::Slip => Some(Self::Slip),
            ContactStatus::Impact => Some(Self::Impact),
        }
    }
}

/// A contact that transmits an impulse at a node: of two shapes, of a joint with a stop or with dry
/// friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactSample {
    /// Which of the elements with impulses of the model.
    pub element: u32,
    /// Which of its features.
    pub feature: u32,
    /// Where both bodies feel it, m; 0 of a joint.
    pub point: [f64; 3],
    /// The normal from A to B and both tangents, in space; 0 of a joint.
    pub axes: [[f64; 3]; 3],
    /// `g(q_n)`, m or rad.
    pub gap: f64,
    /// The force on B along these axes, N; on a coordinate of a joint N or N·m, first.
    pub force: [f64; 3],
    /// The slip of the step from there, m/s or rad/s.
    pub slip: f64,
    /// What it does.
    pub state: ContactPhase,
    /// Which part of the force is unique; `None` where that is not known, or not asked for.
    #[serde(default)]
    pub unique: Option<Unique>,
}

impl ContactSample {
    /// The force on B in space, N.
    #[must_use]
    pub fn in_space(&self) -> [f64; 3] {
        let along = |i: usize| (0..3).map(|k| self.force[k] * self.axes[k][i]).sum();
        std::array::from_fn(along)
    }

    /// The part of it across the normal, N.
    #[must_use]
    pub fn across(&self) -> [f64; 3] {
        let along = |i: usize| (1..3).map(|k| self.force[k] * self.axes[k][i]).sum();
        std::array::from_fn(along)
    }
}

/// What contacts did so far, as data.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ContactsSoFar {
    lasting: Vec<(ContactId, bool)>, // in ascending order, and whether they slip
    #[serde(default)]
    pressed: Vec<ContactId>, // compliant ones that touch, in ascending order
    begun: bool,                     // a step was taken
    /// What they did since a node was handed out.
    pub(crate) pending: Vec<EventRecord>,
}

/// Follows the contacts of a run.
#[derive(Debug)]
pub(crate) struct ContactWatch {
    origins: Vec<ContactOrigin>, // of the elements of the model
    acting: Vec<u32>,            // which of them each rigid element in force is
    compliant: Vec<(u32, Arc<CompliantContact>)>, // those in force
    state: ContactsSoFar,
    last: Vec<(ContactId, bool)>, // scratch
    seen: Vec<ContactSample>,     // of the node that was read last
    known: bool,                  // whether they are known
}

impl ContactWatch {
    pub(crate) fn new(origins: Vec<ContactOrigin>) -> Self {
        let mut watch = Self {
            origins: origins.clone(),
            acting: Vec::new(),
            compliant: Vec::new(),
            state: ContactsSoFar::default(),
            last: Vec::new(),
            seen: Vec::new(),
            known: false,
        };
        watch.act_by(&origins);
        watch
    }

    /// The elements with impulses of the model.
    pub(crate) fn origins(&self) -> &[ContactOrigin] {
        &self.origins
    }

    /// Whether contacts, stops or dry friction act by impulses.
    pub(crate) fn has_impulses(&self) -> bool {
        self.origins.iter().any(|own| own.compliant().is_none())
    }

    /// Goes on with other elements, all among those of the model.
    pub(crate) fn act_by(&mut self, elements: &[ContactOrigin]) {
        let place = |own: &ContactOrigin| self.origins.iter().position(|all| all.is_same(own));
        let place = |own: &ContactOrigin| place(own).unwrap_or(0) as u32;
        let rigid = elements.iter().filter(|own| own.compliant().is_none());
        self.acting = rigid.map(place).collect();
        let compliant = |own| Some((place(own), own.compliant()?.clone()));
        self.compliant = elements.iter().filter_map(compliant).collect();
        let ContactsSoFar { lasting, pressed, .. } = &mut self.state;
        lasting.retain(|(id, _)| self.acting.contains(&id.element));
        pressed.retain(|id| self.compliant.iter().any(|own| own.0 == id.element));
    }

    pub(crate) fn state(&self) -> &ContactsSoFar {
        &self.state
    }

    pub(crate) fn resume(&mut self, state: ContactsSoFar) {
        self.state = state;
    }

    /// What contacts did since a node was handed out.
    pub(crate) fn take_pending(&mut self) -> Vec<EventRecord> {
        std::mem::take(&mut self.state.pending)
    }

    /// The contacts of the node that was read last; `None` where no step from it is known.
    pub(crate) fn seen(&self) -> Option<&[ContactSample]> {
        self.known.then_some(&self.seen)
    }

    /// Reads the contacts of a node with the velocity `v`.
    pub(crate) fn read(
        &mut self,
        node: Option<(&NodeRecord, &[ContactRecord])>,
        [q, v]: [&[f64]; 2],
    ) {
        self.seen.clear();
        for (element, contact) in &self.compliant {
            self.seen.extend(compliant_samples(*element, contact, [q, v]));
        }
        self.known = node.is_some() || self.acting.is_empty();
        let Some((node, contacts)) = node else { return };
        let time = 0.5 * (node.before + node.after);
        for contact in contacts {
            let Some(state) = ContactPhase::of(contact.status) else { continue };
            let place = contact.place;
            self.seen.push(ContactSample {
                element: self.acting[contact.id.element as usize],
                feature: contact.id.feature,
                point: place.map_or([0.0; 3], |place| place.point),
                axes: place.map_or([[0.0; 3]; 3], |place| place.axes),
                gap: contact.gap,
                force: contact.impulse.map(|impulse| impulse / time),
                slip: libm::hypot(contact.slip[0], contact.slip[1]),
                state,
                unique: contact.unique,
            });
        }
    }

    /// The compliant contacts that touch where the run starts.
    pub(crate) fn begin(&mut self, q: &[f64]) {
        self.state.pressed = self.pressed(q).collect();
    }

    /// The compliant contacts that touch.
    fn pressed<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = ContactId> + 'a {
        self.compliant.iter().flat_map(move |(element, contact)| {
            let id = |feature| ContactId { element: *element, feature };
            contact.touching(q).map(id)
        })
    }

    /// Follows a step that was taken to `(t, q)`: its nodes, and what touches compliantly at its
    /// end.
    pub(crate) fn follow_step(&mut self, contacts: Option<&Nonsmooth>, t: f64, q: &[f64]) {
        if !self.compliant.is_empty() {
            let now: Vec<ContactId> = self.pressed(q).collect();
            let before = std::mem::replace(&mut self.state.pressed, now);
            let Self { origins, state, .. } = self;
            let only = |a: &[ContactId], b: &[ContactId]| -> Vec<ContactId> {
                a.iter().filter(|id| !b.contains(id)).copied().collect()
            };
            let [touch, part] = [only(&state.pressed, &before), only(&before, &state.pressed)];
            let all = touch.into_iter().map(|id| ("touch", id));
            for (kind, id) in all.chain(part.into_iter().map(|id| ("separate", id))) {
                let origin = &origins[id.element as usize];
                state.pending.push(event(origin, kind, id, t));
            }
        }
        let Some(contacts) = contacts else { return };
        for (node, contacts) in contacts.nodes() {
            self.follow_node(node, contacts);
        }
    }

    fn follow_node(&mut self, node: &NodeRecord, contacts: &[ContactRecord]) {
        let Self { origins, acting, state, last, .. } = self;
        let ContactsSoFar { lasting, begun, pending, .. } = state;
        std::mem::swap(last, lasting);
        lasting.clear();
        let mut tell = |kind: &str, id: ContactId, contact: Option<&ContactRecord>| {
            let normal = |of: fn(&ContactRecord) -> &[f64; 3]| contact.map(|own| of(own)[0]);
            pending.push(EventRecord {
                energy_lost: contact.map_or(0.0, |own| 0.0 - own.work),
                impulse: normal(|own| &own.impulse),
                before: normal(|own| &own.before),
                after: normal(|own| &own.after),
                ..event(&origins[id.element as usize], kind, id, node.t)
            });
        };
        for contact in contacts {
            let element = acting[contact.id.element as usize];
            let id = ContactId { element, ..contact.id };
            let before = last.binary_search_by(|own| own.0.cmp(&id)).ok().map(|k| last[k].1);
            let has_gap = !matches!(origins[element as usize], ContactOrigin::Friction { .. });
            let slips = match contact.status {
                ContactStatus::Impact => {
                    tell("impact", id, Some(contact));
                    continue;
                }
                ContactStatus::Open => match before {
                    Some(slips) if contact.gap <= OPEN => slips,
                    _ => continue,
                },
                status => status == ContactStatus::Slip,
            };
            lasting.push((id, slips));
            match before {
                None if *begun && has_gap => tell("touch", id, Some(contact)),
                Some(slipped) if slipped != slips => {
                    tell(if slips { "slip" } else { "stick" }, id, None);
                }
                _ => {}
            }
        }
        lasting.sort_unstable();
        for (id, _) in last.iter() {
            if lasting.binary_search_by(|own| own.0.cmp(id)).is_err() {
                tell("separate", *id, None);
            }
        }
        *begun = true;
    }
}

/// What a contact does.
fn event(origin: &ContactOrigin, kind: &str, id: ContactId, t: f64) -> EventRecord {
    EventRecord {
        t,
        event: origin.name().to_owned(),
        action: format!("{kind} {}", origin.place(id.feature)).trim_end().to_owned(),
        energy_lost: 0.0,
        impulse: None,
        before: None,
        after: None,
        jump: Default::default(),
    }
}

/// The features of a compliant contact that touch.
fn compliant_samples<'a>(
    element: u32,
    contact: &'a CompliantContact,
    [q, v]: [&'a [f64]; 2],
) -> impl Iterator<Item = ContactSample> + 'a {
    let friction = contact.law().friction;
    let creep = friction.map_or(f64::INFINITY, |(_, course)| course.transition_velocity);
    contact.forces(q, v).map(move |own| {
        let normal = own.at.normal;
        let [first, second] = tangents(&normal);
        ContactSample {
            element,
            feature: own.feature,
            point: own.at.point.into(),
            axes: [normal, first, second].map(Into::into),
            gap: own.at.gap,
            force: [normal, first, second].map(|axis| axis.dot(&own.force)),
            slip: own.slip,
            state: if own.slip > creep { ContactPhase::Slip } else { ContactPhase::Stick },
            unique: Some(Unique::All), // it follows from the overlap
        }
    })
}
