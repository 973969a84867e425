//! The contacts of a node and their impulses: how a node opens, which contacts are hit, and what
//! the impulses do.

use super::active_rows::ActiveRows;
use super::delassus::Delassus;
use super::holding::Holding;
use super::impact_law::{ImpactLaw, VelocityProblem};
use super::islands::Islands;
use super::node_law::{CLOSED, Contact, Course, Kind, SlipSpeed};
use super::node_velocity::NodeVelocity;
use super::options::NonsmoothOptions;
use super::stepping::Stepping;
use super::unilateral::{ContactRows, Elements, TransverseImpulses, Unilateral};
use super::uniqueness::Uniqueness;
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use crate::scheme::{StepError, SubStep};
use vi_core::Configuration;
use vi_core::contact_state::{ContactId, Remembered};
use vi_core::linear::norm_inf;
use vi_core::state::State;

/// Lengths of steps that differ by no more than this part are one.
const SAME_LENGTH: f64 = 1e-9;

/// The contacts of a node and their impulses.
#[derive(Debug, Default)]
pub(super) struct NodeImpulses {
    pub(super) contacts: Vec<Contact>,
    pub(super) rows: ContactRows,
    pub(super) p: Vec<f64>, // n
    pub(super) W: Delassus,
    pub(super) arrival: Vec<f64>, // k  U⁻
    pub(super) rested: Vec<f64>,  // k  Λ_1 of what is kept beside an impact
    pub(super) needed: Vec<f64>,  // k  scratch: that holds what is kept
    pub(super) impacts: Vec<f64>, // k  impulses before the step: those, and of impacts
    pub(super) minus: Vec<f64>,   // k  U⁻ after them
    pub(super) plus: Vec<f64>,    // k  U⁺
    pub(super) lambda: Vec<f64>,
    pub(super) impulse: Vec<f64>, // n  BᵀΛ of the node accepted last; empty without contacts
    pub(super) next: Vec<f64>,    // k
    pub(super) solved_with: Vec<f64>, // k  Λ of the last step that has a solution, or 0
    pub(super) turning_slip: bool,
    pub(super) impact_law: ImpactLaw,
    pub(super) collision: VelocityProblem,
    pub(super) usual: Vec<f64>,           // k  Λ without turning slip
    pub(super) problems: Vec<ActiveRows>, // of islands
    pub(super) responses: Vec<f64>,       // k × n  of the end of the step to the impulses
    pub(super) transverse: Option<Box<dyn TransverseImpulses>>,
    pub(super) islands: Islands,
    found: Vec<(ContactId, [f64; 3])>, // before the node was opened again
    pub(super) guarded: Vec<usize>,    // scratch: contacts of an island
    pub(super) holding: Holding,       // scratch
    pub(super) node_velocity: NodeVelocity,
    pub(super) uniqueness: Option<Uniqueness>, // where it is asked for
    pub(super) solved: u64,                    // steps for this node
    pub(super) length: f64,                    // of the last one, s
    pub(super) whole: f64,                     // H, s
    pub(super) is_guarded: bool,
    pub(super) may_relax: bool,
    pub(super) may_yield: bool, // impacts may be plastic where no impulses are found else
    pub(super) refused: usize,  // the island of the last fault
    pub(super) change: f64,     // of a velocity that the iteration ended with, m/s
    pub(super) begun: Vec<f64>, // k  Λ where an iteration began
}

/// Whether two steps have one length, beside rounding.
pub(super) fn is_same_length(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME_LENGTH * b
}

impl NodeImpulses {
    pub(super) fn new(options: NonsmoothOptions) -> Self {
        let NonsmoothOptions { turning_slip, impact_law, uniqueness, .. } = options;
        let uniqueness = uniqueness.then(Uniqueness::default);
        Self { turning_slip, impact_law, uniqueness, ..Self::default() }
    }

    /// A node begins.
    pub(super) fn begin_node(&mut self, whole: f64) {
        self.whole = whole;
        self.problems.iter_mut().for_each(ActiveRows::begin_node);
    }

    /// Opens a node with contacts, in ascending order.
    pub(super) fn open<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        state: &State,
        h: f64,
        set: &[ContactId],
    ) -> Result<(), StepError> {
        let at = state.configuration();
        let Self { contacts, rows, W, islands, p, minus, lambda, .. } = self;
        contacts.clear();
        rows.clear();
        lambda.clear();
        for &id in set {
            let element = elements[id.element as usize].as_ref();
            let known = state.contacts.find(id);
            let mut contact = Contact::open(id, rows.len(), element, known, at);
            contact.is_kept &= state.contacts.step > 0.0; // not after an event
            element.rows(id.feature, at, rows);
            let impulse = known.map_or([0.0; 3], |known| known.impulse);
            lambda.extend_from_slice(&impulse[..contact.law.rows()]);
            contacts.push(contact);
        }
        let k = rows.len();
        for vector in [&mut *minus, &mut self.plus, &mut self.next, &mut self.impacts] {
            vector.clear();
            vector.resize(k, 0.0);
        }
        p.resize(state.q.len(), 0.0);
        (self.solved, self.is_guarded) = (0, false);
        if k == 0 {
            islands.clear();
            self.arrival.clear();
            self.rested.clear();
            return Ok(());
        }
        W.open(run, state, h, rows, minus)?;
        let speeds = norm_inf(minus);
        for contact in contacts.iter_mut().filter(|contact| contact.law.has_static_friction()) {
            // what touches without slip
            let slip = match contact.law.rows() {
                3 => libm::hypot(minus[contact.row + 1], minus[contact.row + 2]),
                _ => minus[contact.row].abs(),
            };
            let open = state
                .contacts
                .find(contact.id)
                .is_none_or(|known| known.impulse.iter().all(|x| *x == 0.0));
            contact.held |= open && slip <= contact.rounding(speeds, h);
        }
        self.arrival.clone_from(minus);
        islands.find(contacts, W);
        let count = islands.count().max(self.problems.len());
        self.problems.resize_with(count, ActiveRows::default);
        self.find_kept();
        self.begin_at_loads((state, h));
        Ok(())
    }

    /// The iteration of an island of one contact without friction that is kept begins at the
    /// impulse that holds its gap under the loads of the two steps before, continued to this one
    /// [N10]. At rest this is the solution, and rounding of the gap that the node before has left
    /// is no change of loads. Its law has one solution: the beginning chooses none.
    fn begin_at_loads(&mut self, (state, h): (&State, f64)) {
        let Self { contacts, islands, W, minus, lambda, .. } = self;
        if !is_same_length(state.contacts.step, h) {
            return;
        }
        let is_one = |place: usize| islands.contacts(islands.of(place)).len() == 1;
        let kept = contacts.iter().enumerate().filter(|(_, own)| own.is_kept);
        for (place, contact) in kept.filter(|(_, own)| own.law.rows() == 1) {
            let Some([last, before]) = contact.loads.filter(|_| is_one(place)) else { continue };
            let (row, own) = (contact.row, W.at(contact.row, contact.row));
            let loads = 2.0 * last - before;
            if own > 0.0 {
                lambda[row] = (-(contact.gap / h + minus[row] + loads) / own).max(0.0);
            }
        }
    }

    /// The same with more contacts: the iteration goes on from the impulses that were found.
    pub(super) fn open_again<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        state: &State,
        h: f64,
        set: &[ContactId],
    ) -> Result<(), StepError> {
        let Self { contacts, lambda, found, .. } = self;
        found.clear();
        found.extend(contacts.iter().map(|contact| {
            let mut own = [0.0; 3];
            let rows = contact.row..contact.row + contact.law.rows();
            own.iter_mut().zip(&lambda[rows]).for_each(|(to, from)| *to = *from);
            (contact.id, own)
        }));
        self.open(elements, run, state, h, set)?;
        let Self { contacts, lambda, found, .. } = self;
        for contact in contacts {
            if let Ok(place) = found.binary_search_by(|own| own.0.cmp(&contact.id)) {
                let own = lambda[contact.row..].iter_mut().take(contact.law.rows());
                own.zip(found[place].1).for_each(|(to, from)| *to = from);
            }
        }
        Ok(())
    }

    /// `v̂` after the impulses, shape `n`.
    pub(super) fn velocity_after<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        state: &State,
        h: f64,
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let Self { p, rows, lambda, impacts, .. } = self;
        p.copy_from_slice(&state.p);
        let all = lambda.iter().zip(impacts).enumerate();
        all.for_each(|(i, (own, impact))| rows.add_to(i, own + *impact, p));
        run.velocity(state, h, p, out)
    }

    /// Takes the step with impulses that obey the laws roughly, to see where it leads.
    pub(super) fn look_ahead<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        self.begin();
        self.begin_laws(true);
        self.next_impulses(elements, run, step, state, 0)?;
        std::mem::swap(&mut self.lambda, &mut self.next);
        self.try_step_near(run, step, state)
    }

    /// Nothing is decided about the contacts.
    fn begin(&mut self) {
        for contact in &mut self.contacts {
            let reduction = if contact.is_plastic { 0.0 } else { 1.0 };
            (contact.slides, contact.kept, contact.reduction) = (false, false, reduction);
            (contact.is_hit, contact.holds, contact.caught) = (false, contact.held, false);
            contact.departs = false;
        }
        self.problems.iter_mut().for_each(|problem| problem.by_proximal_steps = false);
    }

    /// Solves the step for the impulses of the node.
    pub(super) fn solve<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        if self.contacts.is_empty() {
            return self.try_step(run, step, state);
        }
        self.begin();
        if self.impact_law != ImpactLaw::Newton {
            return self.solve_after_impacts(elements, run, step, state);
        }
        if self.may_be_hit() {
            self.find_hits(elements, run, step, state)?;
            self.settle_impacts(elements, run, step, state)?;
        } else {
            self.settle(elements, run, step, state)?;
        }
        self.settle_departures(elements, run, step, state)?;
        self.guard(elements, run, step, state)
    }

    /// Whether a contact approaches and may bounce.
    pub(super) fn may_be_hit(&self) -> bool {
        self.contacts.iter().any(|own| self.minus[own.row] < 0.0 && own.may_bounce())
    }

    /// Which contacts are hit: a step without impulses of contacts is taken where that matters.
    pub(super) fn find_hits<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        let Self { contacts, minus, .. } = self;
        let mut any = false;
        for contact in contacts {
            let may_bounce = contact.may_bounce() && !contact.is_plastic;
            contact.is_hit = may_bounce && minus[contact.row] < 0.0;
            any |= contact.is_hit;
        }
        if any {
            self.next.copy_from_slice(&self.lambda);
            self.lambda.fill(0.0);
            let taken = self.try_step(run, step, state);
            self.lambda.copy_from_slice(&self.next);
            taken?;
            let end = run.end.configuration();
            for contact in self.contacts.iter_mut().filter(|contact| contact.is_hit) {
                let ContactId { element, feature } = contact.id;
                let is_passed = elements[element as usize].gap(feature, end) < 0.0;
                let bounces = contact.law.restitution().is_some_and(|e| e > 0.0);
                contact.is_hit = if is_passed { bounces } else { contact.is_new };
            }
        }
        Ok(())
    }

    /// `½ Λ·(U⁺ + U⁻)` of some contacts, J.
    pub(super) fn work(&self, places: &[usize]) -> f64 {
        let Self { contacts, minus, plus, lambda, .. } = self;
        let of = |contact: &Contact| {
            let own = contact.row..contact.row + contact.law.rows();
            own.map(|i| 0.5 * lambda[i] * (plus[i] + minus[i])).sum::<f64>()
        };
        places.iter().map(|place| of(&contacts[*place])).sum()
    }

    /// The size of the terms of the work of a node, J.
    pub(super) fn work_size(&self) -> f64 {
        let Self { minus, plus, lambda, .. } = self;
        let speeds = minus.iter().zip(plus).map(|(a, b)| a.abs() + b.abs());
        lambda.iter().zip(speeds).map(|(lambda, u)| 0.5 * lambda.abs() * u).sum()
    }
}

impl Contact {
    /// A contact at the configuration of a node, its first row, and what is known of it from the
    /// node before. Nothing is decided.
    fn open(
        id: ContactId,
        row: usize,
        element: &dyn Unilateral,
        known: Option<&Remembered>,
        at: Configuration<'_>,
    ) -> Self {
        let (size, gap) = (element.size(), element.gap(id.feature, at));
        let place = element.place(id.feature, at);
        Self {
            id,
            law: element.law(),
            row,
            size,
            distance: place.map_or(0.0, |own| norm_inf(&own.point)),
            place,
            gap,
            before: known.map_or(0.0, |known| known.rate),
            slip_before: known.zip(place).and_then(|(known, place)| known.along(&place.axes)),
            turns: false,
            shift: [0.0; 2],
            is_new: known.is_none() && gap <= CLOSED * size,
            is_kept: known.is_some_and(|known| known.kept) && gap <= CLOSED * size,
            loads: known.and_then(|known| known.loads),
            is_struck: false,
            leaves: false,
            may_depart: false,
            departs: false,
            rests: false,
            held: known.is_some_and(|known| known.sticks),
            holds: false,
            caught: false,
            is_hit: false,
            reduction: 1.0,
            is_plastic: false,
            slides: false,
            kept: false,
            kind: Kind::Position,
            changes: 0,
            course: Course::Usual,
            gamma: 0.0,
            sigma: [0.0; 2],
            bound: 0.0,
            halves: [0.0; 2],
            parted_velocity: [0.0; 3],
            parted: false,
            slip_speed: SlipSpeed::Own,
            slip: 0.0,
        }
    }

    /// Whether it slides: its impulses are at their bound, and its slip is more than rounding.
    pub(super) fn is_sliding(&self, lambda: &[f64], W: &Delassus, (speeds, h): (f64, f64)) -> bool {
        let rows = self.rows();
        let compliance = W.at(rows.end - 1, rows.end - 1);
        self.slides_by(&lambda[rows], compliance, self.rounding(speeds, h))
    }

    /// Whether its impulses change velocities by no more than rounding.
    pub(super) fn is_idle(&self, impulse: &[f64; 3], W: &Delassus, speeds: f64) -> bool {
        let least = 4.0 * f64::EPSILON * speeds;
        self.rows().zip(impulse).all(|(i, impulse)| W.at(i, i) * impulse.abs() <= least)
    }

    fn rows(&self) -> std::ops::Range<usize> {
        self.row..self.row + self.law.rows()
    }
}
