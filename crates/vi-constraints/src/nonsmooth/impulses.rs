//! The impulses of the contacts of a node, to rounding errors.
//!
//! ```text
//! y(Λ') = ξ(Λ) + W (Λ' − Λ)          with the exact step u(Λ), solved by Newton's method
//! ```
//! is solved for `Λ'` within the sets of the laws, until `W(Λ' − Λ)` is of the size of rounding
//! errors. The residual `ξ` is that of the step itself: `W` affects the speed alone. The iteration
//! contracts by `O(hω)`.

use super::ContactFault;
use super::active_rows::{ActiveRows, EARLY, FROZEN, Present};
use super::delassus::Delassus;
use super::impact_law::{ImpactLaw, VelocityProblem};
use super::islands::Islands;
use super::node_law::{CLOSED, Contact, Course, Kind, Rows, SlipSpeed};
use super::node_velocity::NodeVelocity;
use super::stepping::Stepping;
use super::unilateral::{ContactLaw, ContactRows, Elements, TransverseImpulses};
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode};
use crate::scheme::{StepError, SubStep};
use vi_core::contact_state::ContactId;
use vi_core::linear::norm_inf;
use vi_core::state::State;

/// Solutions of a step for one set of laws.
const ITERATIONS: usize = 60;
/// Solutions after which rates that are still reversed, or not, are taken by the usual law, and
/// contacts that are an impact in one of them and none in the next by their positions.
const UNSETTLED: usize = 30;
/// So often impulses are halved, or their change, where the step has no solution with them.
const HALVINGS: usize = 20;
/// A change of velocities that may stagnate, relative to velocities,
const STAGNATION: f64 = 1e-9;
/// and to what rounding leaves of it.
const STAGNATION_ROUNDING: f64 = 32.0;

/// The contacts of a node and their impulses.
#[derive(Debug, Default)]
pub(super) struct NodeImpulses {
    pub(super) contacts: Vec<Contact>,
    pub(super) rows: ContactRows,
    pub(super) p: Vec<f64>, // n
    pub(super) W: Delassus,
    pub(super) arrival: Vec<f64>, // k  U⁻
    pub(super) impacts: Vec<f64>, // k  impulses of impacts before the step
    pub(super) minus: Vec<f64>,   // k  U⁻ after them
    pub(super) plus: Vec<f64>,    // k  U⁺
    pub(super) lambda: Vec<f64>,
    pub(super) next: Vec<f64>, // k
    solved_with: Vec<f64>,     // k  Λ of the last step that has a solution, or 0
    turning_slip: bool,
    pub(super) impact_law: ImpactLaw,
    pub(super) collision: VelocityProblem,
    usual: Vec<f64>,                      // k  Λ without turning slip
    pub(super) problems: Vec<ActiveRows>, // of islands
    pub(super) responses: Vec<f64>,       // k × n  of the end of the step to the impulses
    pub(super) transverse: Option<Box<dyn TransverseImpulses>>,
    pub(super) islands: Islands,
    found: Vec<(ContactId, [f64; 3])>, // before the node was opened again
    pub(super) guarded: Vec<usize>,    // scratch: contacts of an island
    pub(super) node_velocity: NodeVelocity,
    pub(super) solved: u64, // steps for this node
    length: f64,            // of the last one, s
    pub(super) whole: f64,  // H, s
    pub(super) is_guarded: bool,
    pub(super) may_relax: bool,
    pub(super) may_yield: bool, // impacts may be plastic where no impulses are found else
    pub(super) refused: usize,  // the island of the last fault
    change: f64,                // of a velocity that the iteration ended with, m/s
    pub(super) begun: Vec<f64>, // k  Λ where an iteration began
}

impl NodeImpulses {
    pub(super) fn new(turning_slip: bool, impact_law: ImpactLaw) -> Self {
        Self { turning_slip, impact_law, ..Self::default() }
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
        (state, h): (&State, f64),
        set: &[ContactId],
    ) -> Result<(), StepError> {
        let at = state.configuration();
        let Self { contacts, rows, W, islands, p, minus, lambda, .. } = self;
        contacts.clear();
        rows.clear();
        lambda.clear();
        for &id in set {
            let element = &elements[id.element as usize];
            let (row, law) = (rows.len(), element.law());
            let known = state.contacts.find(id);
            element.rows(id.feature, at, rows);
            lambda.extend_from_slice(&known.map_or([0.0; 3], |known| known.impulse)[..law.rows()]);
            let gap = element.gap(id.feature, at);
            let place = element.place(id.feature, at);
            contacts.push(Contact {
                id,
                law,
                row,
                size: element.size(),
                distance: place.map_or(0.0, |own| norm_inf(&own.point)),
                place,
                gap,
                before: known.map_or(0.0, |known| known.rate),
                slip_before: known.zip(place).and_then(|(known, place)| known.along(&place.axes)),
                turns: false,
                shift: [0.0; 2],
                is_new: known.is_none() && gap <= CLOSED * element.size(),
                was_closed: known.is_some_and(|known| known.impulse[0] > 0.0),
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
            });
        }
        let k = rows.len();
        for vector in [&mut *minus, &mut self.plus, &mut self.next, &mut self.impacts] {
            vector.clear();
            vector.resize(k, 0.0);
        }
        p.resize(state.q.len(), 0.0);
        (self.solved, self.is_guarded) = (0, false);
        if k > 0 {
            W.open(run, (state, h), rows, minus)?;
        }
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
        if k > 0 {
            let count = islands.count().max(self.problems.len());
            self.problems.resize_with(count, ActiveRows::default);
        }
        Ok(())
    }

    /// The same with more contacts: the iteration goes on from the impulses that were found.
    pub(super) fn open_again<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        at: (&State, f64),
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
        self.open(elements, run, at, set)?;
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
        (state, h): (&State, f64),
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
        (step, state): (SubStep, &State),
    ) -> Result<(), StepError> {
        self.begin();
        self.begin_laws(true);
        self.next_impulses(elements, run, (step, state), 0)?;
        std::mem::swap(&mut self.lambda, &mut self.next);
        self.try_step_near(run, (step, state))
    }

    /// Nothing is decided about the contacts.
    fn begin(&mut self) {
        for contact in &mut self.contacts {
            let reduction = if contact.is_plastic { 0.0 } else { 1.0 };
            (contact.slides, contact.kept, contact.reduction) = (false, false, reduction);
            (contact.is_hit, contact.holds, contact.caught) = (false, contact.held, false);
        }
        self.problems.iter_mut().for_each(|problem| problem.by_proximal_steps = false);
    }

    /// Solves the step for the impulses of the node.
    pub(super) fn solve<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) -> Result<(), StepError> {
        self.begin();
        if self.impact_law != ImpactLaw::Newton {
            return self.solve_after_impacts(elements, run, (step, state));
        }
        // what was closed before and stays so is settled by positions: a look at velocities tells
        if self.may_be_hit(|contact| !contact.was_closed) {
            self.find_hits(elements, run, (step, state))?;
            self.settle_impacts(elements, run, (step, state))?;
        } else {
            self.settle(elements, run, (step, state))?;
            if self.would_bounce() {
                self.find_hits(elements, run, (step, state))?;
                self.settle_impacts(elements, run, (step, state))?;
            }
        }
        self.guard(elements, run, (step, state))
    }

    /// Whether a contact of these approaches and may bounce.
    pub(super) fn may_be_hit(&self, of: impl Fn(&Contact) -> bool) -> bool {
        let approaches = |own: &Contact| self.minus[own.row] < 0.0 && own.may_bounce();
        self.contacts.iter().any(|own| of(own) && approaches(own))
    }

    /// Whether a contact that approaches leaves the node more slowly than its restitution says.
    pub(super) fn would_bounce(&self) -> bool {
        self.may_be_hit(|own| {
            let restitution = own.law.restitution().unwrap_or(0.0);
            self.plus[own.row] + restitution * self.minus[own.row] < own.gamma
        })
    }

    /// Which contacts are hit: a step without impulses of contacts is taken where that matters.
    pub(super) fn find_hits<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
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
            let taken = self.try_step(run, (step, state));
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

    /// Solves with static friction first; then what breaks loose slides.
    pub(super) fn settle<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        at: (SubStep, &State),
    ) -> Result<(), StepError> {
        loop {
            self.settle_slip(elements, run, at)?;
            let speeds = self.speeds();
            let Self { contacts, lambda, W, .. } = self;
            let mut any = false;
            for contact in contacts.iter_mut().filter(|own| own.law.has_static_friction()) {
                let slides = contact.is_sliding(lambda, W, (speeds, at.0.h));
                if let Some(holds) = contact.holds_now(slides) {
                    (contact.holds, contact.slides, contact.kept) = (holds, false, false);
                    any = true;
                }
            }
            if !any {
                return Ok(());
            }
        }
    }

    /// Iterates; then rows that slide steadily take the mean velocity, and go back where they stick
    /// after all.
    fn settle_slip<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        at: (SubStep, &State),
    ) -> Result<(), StepError> {
        for contact in &mut self.contacts {
            (contact.turns, contact.parted) = (false, false);
            contact.course = Course::Usual;
        }
        self.iterate(elements, run, at)?;
        if self.turning_slip && self.find_turns(elements, at.0.h)? {
            self.usual.clone_from(&self.lambda);
            if self.iterate(elements, run, at).is_err() {
                self.contacts.iter_mut().for_each(|contact| contact.turns = false);
                self.lambda.clone_from(&self.usual);
                self.iterate(elements, run, at)?;
            }
        }
        let mut decided = false;
        loop {
            let Self { contacts, minus, plus, lambda, .. } = self;
            let mut changed = false;
            for contact in contacts {
                let own = contact.row..contact.row + contact.law.rows();
                let [minus, plus, lambda] = [&*minus, &*plus, &*lambda].map(|of| &of[own.clone()]);
                if contact.sticks_after_all(lambda) {
                    (contact.slides, contact.kept, changed) = (false, true, true);
                } else if !decided && own.len() == 3 {
                    let change = libm::hypot(plus[1] - minus[1], plus[2] - minus[2]);
                    let rows = Rows { minus, plus, lambda, w: 0.0 };
                    contact.slides = contact.cannot_stop(rows, change);
                    changed |= contact.slides;
                }
            }
            decided = true;
            if !changed {
                return Ok(());
            }
            self.iterate(elements, run, at)?;
        }
    }

    /// Which contacts slide in the mean direction of their slip, because other forces turn it back:
    /// those that would not hold their rate if it was zero. Asked of an island as a whole, from the
    /// last step.
    fn find_turns(&mut self, elements: &Elements, h: f64) -> Result<bool, StepError> {
        let speeds = self.speeds();
        let Self { contacts, W, islands, minus, plus, lambda, next, problems, .. } = self;
        let mut any = false;
        for island in 0..islands.count() {
            let own = islands.contacts(island);
            if !own.iter().any(|place| contacts[*place].may_turn()) {
                continue;
            }
            for place in own {
                let contact = &mut contacts[*place];
                contact.shift =
                    contact.slip_before.filter(|_| contact.may_turn()).unwrap_or([0.0; 2]);
            }
            let present = Present { contacts, W, islands, minus, plus, lambda, next, speeds, h };
            problems[island].next_impulses(island, present, elements)?;
            for place in own {
                let contact = &mut contacts[*place];
                contact.shift = [0.0; 2];
                let rows = contact.row..contact.row + contact.law.rows();
                contact.turns = contact.may_turn() && contact.slips(&next[rows]);
                any |= contact.turns;
            }
        }
        Ok(any)
    }

    /// The outer iteration, from the present impulses; by proximal steps alone, where it ends
    /// without a solution and those are allowed.
    fn iterate<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        at: (SubStep, &State),
    ) -> Result<(), StepError> {
        self.begun.clone_from(&self.lambda);
        let outcome = self.iterate_laws(elements, run, at);
        let turns = self.contacts.iter().any(|contact| contact.turns);
        match &outcome {
            Err(error) if self.may_relax && !turns && error.may_end() => {
                self.problems.iter_mut().for_each(|problem| problem.by_proximal_steps = true);
                self.lambda.clone_from(&self.begun);
                self.iterate_laws(elements, run, at)
            }
            _ => outcome,
        }
    }

    /// The same without.
    fn iterate_laws<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) -> Result<(), StepError> {
        self.begin_laws(false);
        let (mut last, mut was_exact, mut responds) = (f64::INFINITY, false, false);
        let (mut passes, mut stands, mut settled) = (0, false, false);
        for pass in 0..ITERATIONS {
            if !settled && (stands || pass == UNSETTLED) {
                self.contacts.iter_mut().for_each(Contact::settle);
                settled = true;
            }
            let is_exact = self.next_impulses(elements, run, (step, state), pass)?;
            if self.contacts.is_empty() {
                return Ok(());
            }
            let speeds = self.speeds();
            let (change, rounding, _) = self.largest_change(step.h);
            let may_stagnate = (STAGNATION * speeds).max(STAGNATION_ROUNDING * rounding);
            let stagnates = was_exact && last <= may_stagnate && change >= last;
            if is_exact && (change <= rounding || stagnates) {
                self.change = change;
                return Ok(());
            }
            passes = pass + 1;
            stands = change == 0.0 && passes > EARLY;
            let mut complies = false;
            if stands && settled {
                let own = self.problems.iter_mut().take(self.islands.count());
                own.for_each(|problem| complies |= problem.comply(speeds));
                if !complies {
                    break; // the same problem would be stated again
                }
            }
            if !responds && Self::is_slow(pass, change, last) {
                responds = true;
                self.respond(run, (step, state))?;
            }
            (last, was_exact) = (if complies { f64::INFINITY } else { change }, is_exact);
            std::mem::swap(&mut self.lambda, &mut self.next);
        }
        let worst = self.largest_change(step.h).2;
        self.refused = self.islands.of(worst);
        let element = self.contacts[worst].id.element;
        let fault = ContactFault::NoConvergence {
            element: elements[element as usize].name().to_owned(),
            contacts: self.contacts.len(),
            iterations: passes,
            change: last,
        };
        Err(fault.into())
    }

    /// An iteration begins, or one that ends `roughly`.
    fn begin_laws(&mut self, roughly: bool) {
        let Self { problems, contacts, W, islands, lambda, solved_with, .. } = self;
        for (k, problem) in problems.iter_mut().enumerate().take(islands.count()) {
            problem.begin(roughly, contacts, W, islands, k);
        }
        for contact in contacts {
            (contact.changes, contact.slip_speed) = (0, SlipSpeed::Own);
        }
        solved_with.clear();
        solved_with.resize(lambda.len(), 0.0);
    }

    /// Takes the step with the present impulses; `next`: those by the laws at its end; whether all
    /// islands obey them.
    fn next_impulses<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
        pass: usize,
    ) -> Result<bool, StepError> {
        self.try_step_near(run, (step, state))?;
        if self.contacts.is_empty() {
            return Ok(true);
        }
        self.measure(elements, run, (step, state));
        if pass == FROZEN {
            self.keep_slip_speeds();
        }
        let (speeds, h) = (self.speeds(), step.h);
        let Self { contacts, W, islands, minus, plus, lambda, next, problems, .. } = self;
        let mut is_exact = true;
        for (k, problem) in problems.iter_mut().enumerate().take(islands.count()) {
            let present = Present { contacts, W, islands, minus, plus, lambda, next, speeds, h };
            self.refused = k;
            problem.next_impulses(k, present, elements)?;
            is_exact &= problem.is_exact();
        }
        Ok(is_exact)
    }

    /// From now on the least speed of slip counts in laws with a compliance.
    fn keep_slip_speeds(&mut self) {
        let Self { problems, contacts, islands, .. } = self;
        for island in (0..islands.count()).filter(|island| problems[*island].is_compliant()) {
            islands.contacts(island).iter().for_each(|place| contacts[*place].keep_slip_speed());
        }
    }

    /// By how much a contact moves beside Coulomb's law at most, m/s; `None` without convex laws.
    pub(super) fn deviation(&self) -> Option<f64> {
        let problems = self.problems.iter().take(self.islands.count());
        problems.filter_map(|own| own.deviation(self.change)).reduce(f64::max)
    }

    /// Takes the step with the present impulses, or where it has no solution with those, with
    /// impulses between them and the last ones.
    fn try_step_near<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        at: (SubStep, &State),
    ) -> Result<(), StepError> {
        let mut halvings = 0;
        while let Err(error) = self.try_step(run, at) {
            if halvings == HALVINGS || self.lambda == self.solved_with {
                return Err(error);
            }
            halvings += 1;
            self.length = f64::NAN; // what failed is no guess
            let both = self.lambda.iter_mut().zip(&self.solved_with);
            both.for_each(|(lambda, last)| *lambda = last + 0.5 * (*lambda - last));
        }
        self.solved_with.copy_from_slice(&self.lambda);
        Ok(())
    }

    /// Takes the step with the present impulses.
    fn try_step<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) -> Result<(), StepError> {
        let Self { rows, lambda, impacts, contacts, .. } = self;
        if !run.is_at_start {
            run.end.copy_from(state);
        }
        run.is_at_start = false;
        let jumps = impacts.iter().any(|impact| *impact != 0.0);
        if jumps || contacts.iter().any(|contact| contact.is_hit) {
            run.end.history.clear(); // velocities jump
        }
        let all = lambda.iter().zip(impacts).map(|(own, impact)| own + *impact);
        for (i, lambda) in all.enumerate().filter(|(_, lambda)| *lambda != 0.0) {
            rows.add_to(i, lambda, &mut run.end.p); // p̄_n + BᵀΛ
        }
        let again = self.solved > 0 && self.length.to_bits() == step.h.to_bits();
        (self.solved, self.length) = (self.solved + 1, step.h);
        run.take(step, again)
    }

    /// `γ`, `σ`, `b` and `U⁺` of the last step.
    fn measure<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) {
        let Self { contacts, rows, W, minus, plus, lambda, impacts, p, transverse, .. } = self;
        let whole = &self.whole;
        let end = run.end.configuration();
        let s = run.scheme.interval();
        let mut is_known = false; // the constraint impulse
        for contact in contacts {
            let ContactId { element: id, feature } = contact.id;
            let element = &elements[id as usize];
            contact.sigma = element.slip(feature, s).map(|slip| slip / step.h);
            match contact.law {
                ContactLaw::Dry { effort, lever, .. } => {
                    contact.halves = [state.contacts.step, step.h].map(|h| 0.5 * h * effort);
                    contact.bound = 0.5 * (state.contacts.step + step.h) * effort;
                    if lever != 0.0 {
                        if !is_known {
                            p.copy_from_slice(&state.p);
                            let all = lambda.iter().zip(&*impacts).enumerate();
                            all.for_each(|(i, (own, impact))| rows.add_to(i, own + impact, p));
                            run.observer.constraint_impulse(run.system, s, p);
                            if let Some(own) = transverse {
                                own.find(state.configuration(), p);
                            }
                            is_known = true;
                        }
                        let across = transverse.as_ref().map_or(0.0, |own| own.across(id));
                        contact.bound += lever * across; // [N5]
                    }
                    contact.bound *= contact.ratio();
                }
                _ => {
                    let least = contact.least_gap(step.h / *whole);
                    contact.gamma = (element.gap(feature, end) - least) / step.h; // [N2]
                }
            }
        }
        for (i, plus) in plus.iter_mut().enumerate() {
            *plus = minus[i] + W.product(i, |j| lambda[j]);
        }
    }

    /// The largest velocity of a row before and after the impulses.
    pub(super) fn speeds(&self) -> f64 {
        self.minus.iter().chain(&self.plus).fold(0.0, |most: f64, u| most.max(u.abs()))
    }

    /// The change `W(Λ' − Λ)` that is largest beside rounding, the velocity that rounding leaves
    /// of it, and the place of the contact.
    fn largest_change(&self, h: f64) -> (f64, f64, usize) {
        let Self { contacts, W, islands, problems, lambda, next, .. } = self;
        let speeds = self.speeds();
        let (mut worst, mut found) = (-1.0, (0.0, 0.0, 0));
        for island in 0..islands.count() {
            let part = problems[island].least_change();
            for place in islands.contacts(island) {
                let contact = &contacts[*place];
                let rounding = (part * speeds).max(contact.rounding(speeds, h));
                for i in contact.row..contact.row + contact.law.rows() {
                    let change = W.product(i, |j| next[j] - lambda[j]).abs();
                    if change / rounding > worst {
                        worst = change / rounding;
                        found = (change, rounding, *place);
                    }
                }
            }
        }
        found
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
    /// Whether it slides: its impulses are at their bound, and its slip is more than rounding.
    pub(super) fn is_sliding(&self, lambda: &[f64], W: &Delassus, (speeds, h): (f64, f64)) -> bool {
        let rows = self.row..self.row + self.law.rows();
        let compliance = W.at(rows.end - 1, rows.end - 1);
        self.slides_by(&lambda[rows], compliance, self.rounding(speeds, h))
    }
}
