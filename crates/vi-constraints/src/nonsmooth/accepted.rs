//! A node whose impulses are found: the state after its step, and what is recorded.

use super::impulses::{NodeImpulses, is_same_length};
use super::node_law::{Contact, Course, Kind};
use super::record::{ContactRecord, ContactStatus, FirstImpulses, NodeRecord, Records};
use super::unilateral::ContactLaw;
use vi_core::contact_state::Remembered;
use vi_core::state::State;

impl NodeImpulses {
    /// Records the step that was solved last, in the state at its `end`, a copy of the one where it
    /// starts that has moved on.
    pub(super) fn accept(&mut self, t: f64, h: f64, end: &mut State, records: &mut Records) {
        let before = end.contacts.step;
        let first = records.contacts.len();
        let remembered = &mut end.contacts;
        // the impulse at a node stands for the halves of both steps beside it
        let share_before = before / (before + h);
        remembered.step = h;
        remembered.contacts.clear();
        let speeds = self.speeds();
        for place in 0..self.contacts.len() {
            let record = self.record(&self.contacts[place], (speeds, h));
            let contact = &mut self.contacts[place];
            contact.is_struck = contact.is_struck_by(&record, contact.rounding(speeds, h));
            contact.leaves = contact.rests && self.lambda[contact.row] == 0.0;
            let impulse = match record.status {
                ContactStatus::Impact => [0.0; 3],
                _ => record.impulse,
            };
            let rate = match contact.law {
                // what holds has no rate that could be reversed
                ContactLaw::Dry { .. } if record.status == ContactStatus::Stick => 0.0,
                ContactLaw::Coulomb { .. } => libm::hypot(contact.sigma[0], contact.sigma[1]),
                _ => contact.sigma[0],
            };
            let slides = contact.law.rows() == 3 && record.status != ContactStatus::Open;
            let slip = contact.place.filter(|_| slides).map(|place| {
                let [_, first, second] = place.axes;
                [0, 1, 2].map(|i| first[i] * contact.sigma[0] + second[i] * contact.sigma[1])
            });
            let (id, sticks) = (contact.id, record.status == ContactStatus::Stick);
            let is_pressed = contact.law.restitution().is_some() && impulse[0] > 0.0;
            let kept = is_pressed && contact.kind != Kind::Impact && contact.is_closed();
            let loads = kept.then(|| {
                let now = contact.gamma - contact.gap / h - self.plus[contact.row];
                [now, contact.loads.filter(|_| is_same_length(before, h)).map_or(now, |own| own[0])]
            });
            let own = Remembered { id, impulse, rate, slip, sticks, kept, loads };
            remembered.contacts.push(own);
            records.contacts.push(record);
        }
        let counts = &mut remembered.counts;
        let own = &records.contacts[first..];
        let hit = own.iter().filter(|record| record.status == ContactStatus::Impact).count();
        let closed = own.iter().filter(|record| record.status != ContactStatus::Open).count();
        let work: f64 = own.iter().map(|record| record.work).sum();
        counts.impacts += hit as u64;
        counts.dissipated -= work;
        counts.most_contacts = counts.most_contacts.max(closed as u64);
        counts.most_iterations = counts.most_iterations.max(self.solved);
        counts.largest_work = counts.largest_work.max(work);
        counts.guarded += u64::from(self.is_guarded);
        if let Some(deviation) = self.deviation() {
            counts.relaxed += 1;
            counts.largest_deviation = counts.largest_deviation.max(deviation);
        }
        for contact in &self.contacts {
            counts.largest_reduction = counts.largest_reduction.max(1.0 - contact.reduction);
        }
        self.find_impulse(end.q.len());
        if records.nodes.is_empty() && !self.lambda.is_empty() {
            let FirstImpulses { whole, up_to, arrived } = &mut records.first;
            whole.clone_from(&self.impulse);
            for of in [&mut *up_to, &mut *arrived] {
                of.resize(end.q.len(), 0.0);
            }
            let Self { contacts, W, arrival, node_velocity, rows, islands, uniqueness, .. } = self;
            let own = &mut records.contacts[first..];
            let add = |part: &[f64], to: &mut [f64]| {
                part.iter().enumerate().for_each(|(i, part)| rows.add_to(i, *part, to));
            };
            let at = (&contacts[..], &*W);
            add(node_velocity.find(at, arrival, [share_before, 0.0], own), arrived);
            node_velocity.work(at, arrival, own, |own, work| {
                (own.work_arriving, own.work_before) = (work, work);
            });
            if let Some(uniqueness) = uniqueness {
                for island in 0..islands.count() {
                    uniqueness.find(at, islands.contacts(island), h, own);
                }
            }
            if contacts.iter().any(|contact| contact.is_struck) {
                add(node_velocity.find(at, arrival, [share_before, 1.0], own), up_to);
                node_velocity.work(at, arrival, own, |own, work| own.work_before = work);
            } else {
                up_to.copy_from_slice(arrived);
            }
        }
        let contacts = first..records.contacts.len();
        records.nodes.push(NodeRecord { t, before, after: h, contacts });
    }

    /// `BᵀΛ` of the step that was solved last.
    fn find_impulse(&mut self, n: usize) {
        let Self { rows, lambda, impacts, impulse, .. } = self;
        impulse.clear();
        impulse.resize(if lambda.is_empty() { 0 } else { n }, 0.0);
        for (i, (lambda, impact)) in lambda.iter().zip(&*impacts).enumerate() {
            rows.add_to(i, lambda + impact, impulse);
        }
    }

    fn record(&self, contact: &Contact, at: (f64, f64)) -> ContactRecord {
        let own = contact.row..contact.row + contact.law.rows();
        let of = |all: &[f64]| {
            let mut three = [0.0; 3];
            three.iter_mut().zip(&all[own.clone()]).for_each(|(to, from)| *to = *from);
            three
        };
        let [rest, impact] = [&self.lambda, &self.impacts].map(|all| of(all));
        let [before, after] = [&self.arrival, &self.plus].map(|all| of(all));
        let impulse = [0, 1, 2].map(|i| rest[i] + impact[i]);
        let work = (0..3).map(|i| 0.5 * impulse[i] * (before[i] + after[i])).sum();
        let is_collision = impact[0] > 0.0 && rest[0] == 0.0 && !contact.rests;
        let is_impact = contact.kind == Kind::Impact || is_collision;
        let turns = contact.turns || matches!(contact.course, Course::Reversing | Course::Struck);
        let status = if contact.is_idle(&impulse, &self.W, at.0) {
            ContactStatus::Open
        } else if is_impact {
            ContactStatus::Impact
        } else if turns || contact.is_sliding(&self.lambda, &self.W, at) {
            ContactStatus::Slip
        } else {
            ContactStatus::Stick
        };
        let (id, gap, slip) = (contact.id, contact.gap, contact.sigma);
        let (slip_before, place) = (contact.before, contact.place);
        let [work_before, work_arriving] = [0.0; 2];
        ContactRecord {
            id,
            status,
            impulse,
            before,
            after,
            place,
            gap,
            slip,
            slip_before,
            work,
            work_before,
            work_arriving,
            unique: None,
        }
    }
}

impl Contact {
    /// Whether its impulse changes velocities at once: of an impact, of what the step from the node
    /// closes, and of what that closed before and is slowed without coming to rest.
    fn is_struck_by(&self, record: &ContactRecord, rounding: f64) -> bool {
        let is_slowed = !(self.may_depart || self.rests) && record.after[0] < -rounding;
        let has_gap = self.law.restitution().is_some();
        has_gap && (record.status == ContactStatus::Impact || is_slowed || !self.is_closed())
    }
}
