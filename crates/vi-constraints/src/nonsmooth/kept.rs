//! What is kept closed up to a node, where something else is hit there: its impulse stands for two
//! times.
//!
//! ```text
//! Λ = Λ_1 + Λ_i + Λ_2                 up to the impact, of the impact, from there
//! U⁻ + W Λ_1 = 0,  U⁺ − W Λ_2 = 0     of what is kept, and stays so
//! U_N⁺ − W_NK Λ_2 + e (U_N⁻ + W_NK Λ_1)     in the place of U_N⁺ + e U_N⁻                    [N9]
//! ```
//! What rests has fallen for half a step in `p̄_n`, and rises for half of one after the node. An
//! impact lies between the two: it meets what rests at rest, and leaves it at rest. `Λ_1` is an
//! impulse before the impact, and `U⁻` of the laws has it; `Λ_2` follows from the step that was
//! solved last. What leaves in an impact has `Λ_2 = 0`, and takes nothing of `Λ_1` along.
//!
//! Where nothing is hit, what leaves does so from rest, too, by its law [N8].
//!
//! Another corner of the same body may be a contact that has rested: it is not known which of them
//! are hit, and what is kept beside them has the law of positions alone.

use super::impulses::NodeImpulses;
use super::node_law::{Contact, Kind};
use super::stepping::Stepping;
use super::unilateral::Elements;
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use crate::scheme::{StepError, SubStep};
use vi_core::state::State;

/// Of more contacts in an island what is kept beside an impact has the law of positions alone.
const MANY: usize = 100;
/// So often the friction of what slides follows its pressure.
const FRICTION: usize = 4;
/// So often a node is solved again for what leaves it.
const DEPARTURES: usize = 4;

impl NodeImpulses {
    /// Which contacts are kept closed beside an impact, with their impulses up to it.
    pub(super) fn find_kept(&mut self) {
        let Self { contacts, islands, rested, rows, .. } = self;
        rested.clear();
        rested.resize(self.arrival.len(), 0.0);
        for island in 0..islands.count() {
            let places = islands.contacts(island);
            let any = |is: fn(&Contact) -> bool| places.iter().any(|place| is(&contacts[*place]));
            let (is_struck, is_slowed) = (any(Contact::strikes), any(Contact::is_slowed));
            // another feature of the same bodies may be the same contact
            let of = |place: &usize| rows.row(contacts[*place].row).iter().map(|own| own.0);
            let struck = || places.iter().filter(|place| contacts[**place].strikes());
            let kept = || places.iter().filter(|place| contacts[**place].is_kept);
            let is_same =
                places.len() > MANY || struck().any(|one| kept().any(|own| of(one).eq(of(own))));
            for place in places {
                let contact = &mut contacts[*place];
                contact.may_depart = contact.is_kept && !is_struck;
                contact.rests = contact.is_kept && is_struck && !is_slowed && !is_same;
            }
        }
        if contacts.iter().any(|contact| contact.rests) {
            self.find_holding(|contact| contact.rests);
            self.keep_admissible();
            self.begin_among_rested();
            self.begin_at_rest();
        }
    }

    /// `rested`: those of islands in which they obey the laws of contact; what is kept in others
    /// has the law of positions alone.
    fn keep_admissible(&mut self) {
        let Self { contacts, islands, rested, needed, .. } = self;
        for island in 0..islands.count() {
            let places = islands.contacts(island);
            let obey = places.iter().all(|place| {
                let own = &contacts[*place];
                !own.rests || own.may_have(&needed[own.row..own.row + own.law.rows()])
            });
            for place in places {
                let contact = &mut contacts[*place];
                contact.rests &= obey;
                let rows = contact.row..contact.row + contact.law.rows();
                if contact.rests {
                    rested[rows.clone()].copy_from_slice(&needed[rows]);
                }
            }
        }
    }

    /// `needed`: the impulses that hold these contacts at the velocities with which the last step
    /// arrives, with the friction of what slides.
    fn find_holding(&mut self, of: impl Fn(&Contact) -> bool) {
        let Self { contacts, needed, holding, arrival, W, .. } = self;
        needed.clear();
        needed.resize(arrival.len(), 0.0);
        let slides = |contact: &Contact| of(contact) && contact.sliding().is_some();
        let rounds = if contacts.iter().any(slides) { FRICTION } else { 1 };
        for _ in 0..rounds {
            holding.begin();
            for contact in &*contacts {
                let (is_one, sliding) = (of(contact), contact.sliding());
                for i in 0..contact.law.rows() {
                    let is_held = is_one && (i == 0 || sliding.is_none());
                    let given = match sliding {
                        Some(direction) if is_one && i > 0 => {
                            -contact.coefficient() * needed[contact.row] * direction[i - 1]
                        }
                        _ => 0.0,
                    };
                    holding.add(is_held, given, W);
                }
            }
            holding.hold(W, arrival);
            needed.copy_from_slice(&holding.part);
        }
    }

    /// The iteration begins at the rest of the impulses of the node before.
    fn begin_among_rested(&mut self) {
        let Self { contacts, rested, lambda, .. } = self;
        for contact in contacts.iter().filter(|contact| contact.rests) {
            for i in contact.row..contact.row + contact.law.rows() {
                lambda[i] -= rested[i];
            }
            lambda[contact.row] = lambda[contact.row].max(0.0);
        }
    }

    /// `minus`: `U⁻` with what is kept at rest, `impacts`: the impulses of that.
    pub(super) fn begin_at_rest(&mut self) {
        let Self { rested, impacts, minus, arrival, W, .. } = self;
        impacts.copy_from_slice(rested);
        for (i, minus) in minus.iter_mut().enumerate() {
            *minus = arrival[i] + W.product(i, |j| rested[j]);
        }
    }

    /// Solves again for what leaves without being brought to rest [N8].
    pub(super) fn settle_departures<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        for _ in 0..DEPARTURES {
            if !self.find_departures(step.h) {
                return Ok(());
            }
            self.usual.clone_from(&self.lambda);
            if let Err(error) = self.settle(elements, run, step, state) {
                if !error.has_no_impulses() {
                    return Err(error);
                }
                // it keeps the law of positions
                self.contacts.iter_mut().for_each(|contact| contact.departs = false);
                self.lambda.clone_from(&self.usual);
                return self.settle(elements, run, step, state);
            }
        }
        Ok(())
    }

    /// Which contacts have less impulse than holds them at the velocity with which the last step
    /// arrives, and still approach; whether there are more of them than before. What others press
    /// has more, and may approach by what its surfaces turn away in the step.
    fn find_departures(&mut self, h: f64) -> bool {
        let speeds = self.speeds();
        let Self { contacts, minus, plus, .. } = self;
        let approaches = |contact: &Contact| {
            let rounding = contact.rounding(speeds, h);
            contact.may_depart
                && !contact.departs
                && minus[contact.row].max(plus[contact.row]) < -rounding
        };
        if !contacts.iter().any(approaches) {
            return false;
        }
        self.find_holding(|contact| contact.may_depart);
        let Self { contacts, minus, plus, lambda, needed, W, .. } = self;
        let mut any = false;
        for contact in contacts.iter_mut().filter(|own| own.may_depart && !own.departs) {
            let (row, rounding) = (contact.row, contact.rounding(speeds, h));
            let lacks = W.at(row, row) * (needed[row] - lambda[row]) > rounding;
            contact.departs = lacks && minus[row].max(plus[row]) < -rounding;
            any |= contact.departs;
        }
        any
    }
}

impl Contact {
    /// Whether it may be hit at the node.
    fn strikes(&self) -> bool {
        !self.is_kept && self.law.restitution().is_some()
    }

    /// Whether a step of fixed length closes its gap without an impact: it is slowed at two nodes,
    /// and has a law of impact at neither of them.
    fn is_slowed(&self) -> bool {
        self.strikes() && !self.may_bounce()
    }

    /// Whether impulses are in its cone, beside rounding.
    fn may_have(&self, impulse: &[f64]) -> bool {
        const BESIDE: f64 = 1.0 + 1e-9;
        let friction = impulse.get(1..3).map_or(0.0, |own| libm::hypot(own[0], own[1]));
        impulse[0] >= 0.0 && friction <= BESIDE * self.coefficient() * impulse[0]
    }

    /// The direction of its slip in the step before, where it slid.
    fn sliding(&self) -> Option<[f64; 2]> {
        let [a, b] = self.slip_before.filter(|_| self.law.rows() == 3 && !self.held)?;
        let size = libm::hypot(a, b);
        (size > 0.0).then(|| [a / size, b / size])
    }

    /// Whether a row of it is at rest after an impact beside it; `lambda`: of its rows.
    pub(super) fn rests_after(&self, row: usize, lambda: &[f64]) -> bool {
        let is_closed = self.rests && self.kind == Kind::Position && lambda[0] > 0.0;
        is_closed && (row == 0 || !self.slides && !self.slips(lambda))
    }
}
