//! A step with contacts: nodes at first touches, or fixed nodes.
//!
//! | method | contacts of a node | order through isolated impacts |
//! |---|---|---|
//! | [`Method::Events`] | those that are closed; where another one would be passed, the step ends at its first touch | 2 |
//! | [`Method::Stepping`] | those that are closed, or that the step would pass | 1 |
//!
//! A step of `Stepping` has nodes at first touches, too, where its impulses would lift what a pair
//! names at the end of the step alone, as of a corner that passes an edge: that gains energy.
//!
//! A step of `Events` ends at its time after any number of such nodes, at most
//! [`NonsmoothOptions::max_events`]; the rest is then one step of `Stepping`, so that sequences of
//! impacts with a point of accumulation end. All gaps are looked at after each step: impulses move
//! bodies that were at rest.

use super::impulses::NodeImpulses;
use super::node_law::CLOSED;
use super::options::{Method, NonsmoothOptions};
use super::record::{ContactImpulse, ContactRecord, NodeRecord, Records};
use super::stepping::Stepping;
use super::unilateral::{ContactRows, TransverseImpulses, Unilateral};
use crate::constraints::Constraints;
use crate::discretization::{Discretization, Step};
use crate::scheme::{StepError, SubStep};
use std::sync::Arc;
use vi_core::bracket::Bracket;
use vi_core::contact_state::ContactId;
use vi_core::interval::Interval;
use vi_core::linear::dot;
use vi_core::newton::NewtonReport;
use vi_core::state::State;

/// A first touch ends between 0 and this, in parts of the size of a gap.
const TOUCH: f64 = 1e-13;
/// Where a gap may be passed between two nodes that are open, likewise.
const NEAR: f64 = 1e-2;
/// More contacts than this go on from the impulses that were found where others join them; fewer
/// begin again at those of the state, which choose among several solutions.
const MANY: usize = 100;
/// So often a first touch is looked for again where impulses that are not unique lead past it.
const BRANCHES: usize = 8;
/// So many first touches are nodes of a step of fixed length, where impulses would lift what is
/// named inside of another shape.
const MOST_TOUCHES: u64 = 24;
/// Kinetic energy that a step may hide from a part of it.
const HIDDEN: f64 = 1e-2;
/// Parts of a step that are not taken by themselves.
const REST: f64 = 1e-9;
/// The shortest part of a step whose impulses are looked for where those of longer ones are not
/// found.
const SHORTEST: f64 = 1.0 / 16.0;
/// The same where no motion opens a contact: of points that turn in a long step, opposite ones of a
/// body that has one freedom contradict one another by the square of the rotation.
const LEAST: f64 = 1.0 / 1024.0;

/// Steps of a mechanism with contacts.
#[derive(Debug)]
pub struct Nonsmooth {
    elements: Vec<Arc<dyn Unilateral>>,
    kinds: Vec<(f64, bool)>, // of elements: the size of a gap, whether there is one
    options: NonsmoothOptions,
    node: NodeImpulses,
    pub(super) records: Records,
    trial: Records, // of the step that was last taken on a copy of the state
    set: Vec<ContactId>,
    near: Vec<(ContactId, f64)>, // gaps at the end of the last step, in their sizes
    start: Vec<(ContactId, f64)>, // the same where the step starts
    is_current: bool,            // `near` is of the present node
    is_undivided: bool,          // no node is put within the step
    found: Vec<(u32, f64)>,
    scratch: ContactRows,
    v: [Vec<f64>; 2], // n  velocities at both ends of a step
    probe: Interval,
    first: Interval,          // of a step with several nodes
    base: Option<Box<State>>, // where a step begins
}

/// A sub-step is seen.
pub(crate) type Each<'a, S, C> = Option<&'a mut dyn FnMut(&S, &C, Step<'_>)>;

impl Nonsmooth {
    /// Of these elements, in the order of which ids count them.
    #[must_use]
    pub fn new(elements: Vec<Arc<dyn Unilateral>>, options: NonsmoothOptions) -> Self {
        let none = || Interval::new(0);
        let kind = |own: &Arc<dyn Unilateral>| (own.size(), own.law().restitution().is_some());
        Self {
            kinds: elements.iter().map(kind).collect(),
            elements,
            options,
            node: NodeImpulses::new(options),
            records: Records::default(),
            trial: Records::default(),
            set: Vec::new(),
            near: Vec::new(),
            start: Vec::new(),
            is_current: false,
            is_undivided: false,
            found: Vec::new(),
            scratch: ContactRows::default(),
            v: [Vec::new(), Vec::new()],
            probe: none(),
            first: none(),
            base: None,
        }
    }

    /// With what joints transmit, for dry friction with a lever.
    #[must_use]
    pub fn with_transverse(mut self, impulses: Box<dyn TransverseImpulses>) -> Self {
        self.node.transverse = Some(impulses);
        self
    }

    /// The elements.
    #[must_use]
    pub fn elements(&self) -> &[Arc<dyn Unilateral>] {
        &self.elements
    }

    /// The nodes of the last step, with their contacts.
    pub fn nodes(&self) -> impl Iterator<Item = (&NodeRecord, &[ContactRecord])> {
        let contacts = &self.records.contacts;
        self.records.nodes.iter().map(|node| (node, &contacts[node.contacts.clone()]))
    }

    /// The nodes of the step that was last taken on a copy of the state, likewise.
    pub fn trial_nodes(&self) -> impl Iterator<Item = (&NodeRecord, &[ContactRecord])> {
        let contacts = &self.trial.contacts;
        self.trial.nodes.iter().map(|node| (node, &contacts[node.contacts.clone()]))
    }

    /// Of the node where the last step started; empty before the first step.
    #[must_use]
    pub fn impulse(&self) -> ContactImpulse<'_> {
        self.records.first.contact_impulse()
    }

    /// A macro step begins.
    pub(crate) fn begin(&mut self) {
        self.records.clear();
    }

    /// The next step begins at another state than that where the last one ended.
    pub(crate) fn move_elsewhere(&mut self) {
        self.is_current = false;
    }

    /// Takes away what is known of the last step, for a trial; to be put back.
    pub(crate) fn set_aside(&mut self) -> SetAside {
        self.is_current = false;
        SetAside(std::mem::take(&mut self.records))
    }

    /// Puts it back, and keeps what is known of the trial, where it was `found`.
    pub(crate) fn put_back(&mut self, SetAside(records): SetAside, found: bool) {
        self.is_current = false;
        self.trial = std::mem::replace(&mut self.records, records);
        if !found {
            self.trial.clear();
        }
    }

    /// Of the node where the trial started.
    pub(crate) fn trial_impulse(&self) -> ContactImpulse<'_> {
        self.trial.first.contact_impulse()
    }

    /// `BᵀΛ'` there before anything is hit, shape `n`, or empty.
    pub(crate) fn trial_arrival(&self) -> &[f64] {
        &self.trial.first.arrived
    }

    /// The gap that is smallest in a configuration, in parts of its size, and its element.
    pub(crate) fn smallest_gap(&mut self, state: &State) -> Option<(f64, f64, &str)> {
        self.list_near(state, None);
        let (id, relative) = self.near.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let element = &self.elements[id.element as usize];
        Some((relative, relative * element.size(), element.name()))
    }

    /// A step to `t_end`; `start`: a copy of the state where it starts, where there is one.
    pub(crate) fn advance<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        start: Option<&State>,
        each: &mut Each<'_, S, C>,
    ) -> Result<NewtonReport, StepError> {
        let mut own = self.base.take();
        let taken = self.take_nodes(run, step, start, &mut own, each);
        self.base = own;
        taken?;
        Ok(run.report)
    }

    fn take_nodes<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        mut start: Option<&State>,
        own: &mut Option<Box<State>>,
        each: &mut Each<'_, S, C>,
    ) -> Result<(), StepError> {
        let (mut events, mut h, nodes) = (0, step.h, self.records.nodes.len());
        loop {
            let base = match start.take() {
                Some(start) => start,
                None => {
                    let own = own.get_or_insert_default();
                    own.copy_from(run.end);
                    &**own
                }
            };
            run.is_at_start = true;
            let t_end = self.take_node(run, step, h, events, base)?;
            events += run.end.contacts.counts.events - base.contacts.counts.events;
            let s = run.scheme.interval();
            if let Some(each) = each {
                let step = Step::single(s, &run.end.memory.multipliers, &self.node.impulse);
                each(run.system, run.constraints, step);
            }
            if t_end.to_bits() == step.t_end.to_bits() {
                break;
            }
            if self.records.nodes.len() == nodes + 1 {
                if self.first.dim() != s.dim() {
                    self.first = Interval::new(s.dim());
                }
                self.first.copy_from(s);
            }
            h = step.t_end - run.end.t;
        }
        if self.records.nodes.len() > nodes + 1 {
            // the quantities of the node where the step started are read from the step from there
            std::mem::swap(&mut self.first, run.scheme.interval_mut());
        }
        Ok(())
    }

    /// The step from a node: to the end of the macro step, to the first touch, or where no impulses
    /// are found for it, to the end of a part of it; where none are found either, without the
    /// restitution of what is hit, and at last with convex laws.
    fn take_node<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        h: f64,
        events: u64,
        state: &State,
    ) -> Result<f64, StepError> {
        let mut part = h;
        let mut refused = None;
        (self.node.may_yield, self.node.may_relax) = (false, false);
        loop {
            let t_end = if part < h { state.t + part } else { step.t_end };
            let own = SubStep { h: part, t_end, ..step };
            match self.take_part(run, own, step.h, events, state) {
                Ok(t_end) => {
                    run.end.contacts.counts.divided += u64::from(part < h);
                    return Ok(t_end);
                }
                Err(StepError::Newton(error))
                    if run.system.adds_mass() && 0.5 * part >= LEAST * step.h =>
                {
                    refused.get_or_insert(error.into()); // an impact that a beam cannot follow
                    part *= 0.5;
                }
                Err(error) if error.may_end() && !self.set.is_empty() => {
                    let refused = refused.get_or_insert(error);
                    part *= 0.5;
                    if part >= SHORTEST * step.h && self.may_divide(run, step.h, state)? {
                        continue;
                    }
                    part = h;
                    if !self.node.may_yield && self.node.is_hit() {
                        self.node.may_yield = true;
                    } else if !self.node.may_relax {
                        self.node.may_relax = true;
                    } else {
                        let wedged = self.node.wedged(&self.elements);
                        return Err(wedged.map_or_else(|| refused.clone(), StepError::from));
                    }
                }
                Err(error)
                    if error.has_no_impulses() && !self.node.may_yield && self.node.is_hit() =>
                {
                    self.node.may_yield = true;
                }
                Err(error) if error.has_no_impulses() && 0.5 * part >= LEAST * step.h => {
                    refused.get_or_insert(error); // rows of a long step contradict one another
                    part *= 0.5;
                }
                Err(error) if error.has_no_impulses() => return Err(refused.unwrap_or(error)),
                Err(error) => return Err(error),
            }
        }
    }

    /// The step from a node: to its end, or to the first touch.
    fn take_part<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        whole: f64,
        events: u64,
        state: &State,
    ) -> Result<f64, StepError> {
        let fixed = self.options.method == Method::Stepping
            || events >= u64::from(self.options.max_events)
            || step.h <= REST * whole;
        self.close(state, fixed);
        self.node.begin_node(whole);
        self.node.open(&self.elements, run, state, step.h, &self.set)?;
        let mut sub_step = step;
        let mut counts = state.contacts.counts;
        let mut divides = !fixed;
        if fixed {
            self.solve_fixed(run, sub_step, state)?;
            divides = self.set.len() <= MANY
                && events < MOST_TOUCHES
                && step.h > REST * whole
                && self.node.lifts(step.h < whole)
                && self.may_divide(run, step.h, state)?;
            let is_exhausted = self.options.method == Method::Events && events > 0 && !divides;
            counts.exhausted += u64::from(is_exhausted);
            if divides {
                self.close(state, false);
                self.node.open(&self.elements, run, state, step.h, &self.set)?;
            }
        }
        let mut touch = None;
        if divides {
            self.is_undivided = false;
            touch = self.solve_to_touch(run, sub_step, whole, state)?;
            if self.is_undivided {
                touch = None;
                self.close(state, true);
                self.node.open(&self.elements, run, state, step.h, &self.set)?;
                self.solve_fixed(run, step, state)?;
            }
        }
        if let Some(to) = touch {
            sub_step = SubStep { h: to, t_end: state.t + to, ..step };
            counts.events += 1;
        }
        let gap = |&(id, relative): &(ContactId, f64)| relative * self.kinds[id.element as usize].0;
        let smallest = self.near.iter().map(gap).chain(counts.smallest_gap);
        counts.smallest_gap = smallest.min_by(f64::total_cmp);
        run.end.contacts.counts = counts;
        self.node.accept(state.t, sub_step.h, run.end, &mut self.records);
        self.is_current = true;
        Ok(sub_step.t_end)
    }

    /// Whether nodes may be put within a step `h`: shorter steps then show no kinetic energy that
    /// the mass matrix of this one, with what stiff elements add to it, hides.
    fn may_divide<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        h: f64,
        state: &State,
    ) -> Result<bool, StepError> {
        if !run.system.adds_mass() {
            return Ok(true);
        }
        let [long, short] = &mut self.v;
        [&mut *long, short].into_iter().for_each(|v| v.resize(state.q.len(), 0.0));
        run.velocity(state, h, &state.p, long)?;
        run.velocity(state, 0.0, &state.p, short)?;
        let [long, short] = [&*long, short].map(|v| dot(v, &state.p).abs());
        Ok(short - long <= HIDDEN * long)
    }

    /// `set`: the contacts that are closed at the node of a state, and dry friction; of many ones
    /// for a step of `fixed` length also those that it may close.
    fn close(&mut self, state: &State, fixed: bool) {
        if !self.is_current {
            self.list_near(state, None);
        }
        self.is_current = false;
        let Self { set, near, start, kinds, .. } = self;
        std::mem::swap(start, near);
        set.clear();
        let most = if fixed && start.len() > MANY { NEAR } else { CLOSED };
        let closed = start.iter().filter(|(id, gap)| *gap <= most || !kinds[id.element as usize].1);
        set.extend(closed.map(|(id, _)| *id));
    }

    /// `near`: the contacts that may touch, with their gaps: at a node, or at the end of a step
    /// from it.
    fn list_near(&mut self, state: &State, taken: Option<(&Interval, &State)>) {
        let Self { near, found, elements, kinds, probe, .. } = self;
        let (s, at) = match taken {
            Some((s, end)) => (s, end.configuration()),
            None => {
                if probe.dim() != state.q.len() {
                    *probe = Interval::new(state.q.len());
                }
                state.open(probe, 1.0);
                probe.close();
                (&*probe, state.configuration())
            }
        };
        near.clear();
        for (element, own) in elements.iter().enumerate() {
            found.clear();
            own.near(s, at, found);
            let size = kinds[element].0;
            let id = |feature| ContactId { element: element as u32, feature };
            near.extend(found.iter().map(|(feature, gap)| (id(*feature), gap / size)));
        }
    }

    /// Solves the node for a step; the smallest gap at its end that is not of the set, in parts of
    /// its size, `None` without any.
    fn solve<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<Option<f64>, StepError> {
        self.node.solve(&self.elements, run, step, state)?;
        Ok(self.find_open(run, state))
    }

    /// The smallest gap at the end of the last step likewise.
    fn find_open<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &Stepping<'_, S, C>,
        state: &State,
    ) -> Option<f64> {
        self.list_near(state, Some((run.scheme.interval(), run.end)));
        let Self { near, set, .. } = self;
        let open = near.iter().filter(|(id, _)| set.binary_search(id).is_err());
        open.map(|(_, gap)| *gap).min_by(f64::total_cmp)
    }

    /// Solves the node for a step of this length: contacts that it would pass join the set.
    fn solve_fixed<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        while self.set.len() > MANY {
            self.node.look_ahead(&self.elements, run, step, state)?;
            if !self.find_open(run, state).is_some_and(|gap| gap < 0.0) {
                break;
            }
            self.join(run, step.h, state, 0.0)?;
        }
        while self.solve(run, step, state)?.is_some_and(|gap| gap < 0.0) {
            self.join(run, step.h, state, 0.0)?;
        }
        Ok(())
    }

    /// Contacts that end the last step below a gap (in parts of its size) join the set.
    fn join<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        h: f64,
        state: &State,
        below: f64,
    ) -> Result<(), StepError> {
        let Self { near, set, .. } = self;
        set.extend(near.iter().filter(|(_, gap)| *gap < below).map(|(id, _)| *id));
        set.sort_unstable();
        set.dedup();
        if self.set.len() > MANY {
            return self.node.open_again(&self.elements, run, state, h, &self.set);
        }
        self.node.open(&self.elements, run, state, h, &self.set)
    }

    /// Solves the node for a step, or where it passes a contact, for the step to its first touch:
    /// the length of that.
    fn solve_to_touch<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        whole: f64,
        state: &State,
    ) -> Result<Option<f64>, StepError> {
        loop {
            let Some(smallest) = self.solve(run, step, state)? else { return Ok(None) };
            let mut end = (step.h, smallest);
            if smallest >= 0.0 {
                let Some(to) = self.dip(run, step, state)? else { return Ok(None) };
                let trial = SubStep { h: to, t_end: state.t + to, ..step };
                end = (to, self.solve(run, trial, state)?.unwrap_or(0.0));
                if end.1 >= 0.0 {
                    self.solve(run, step, state)?;
                    return Ok(None);
                }
            }
            if self.options.method == Method::Events && !self.may_divide(run, end.0, state)? {
                self.is_undivided = true;
                return Ok(None);
            }
            for _ in 0..BRANCHES {
                let (found, at) = self.first_touch(run, step, whole, end, state)?;
                if found <= REST * whole {
                    break;
                }
                if at.to_bits() != found.to_bits() {
                    let step = SubStep { h: found, t_end: state.t + found, ..step };
                    let smallest = self.solve(run, step, state)?.unwrap_or(0.0);
                    if smallest < 0.0 {
                        end = (found, smallest); // by other impulses than before
                        continue;
                    }
                }
                return Ok(Some(found));
            }
            // it touches now
            let known = self.set.len();
            let to = end.0.min(REST * whole);
            self.solve(run, SubStep { h: to, t_end: state.t + to, ..step }, state)?;
            self.join(run, step.h, state, TOUCH)?;
            if self.set.len() == known {
                // the gap that is passed is not yet closed: the smallest one joins in any case
                let trial = SubStep { h: end.0, t_end: state.t + end.0, ..step };
                let smallest = self.solve(run, trial, state)?.unwrap_or(0.0);
                self.join(run, step.h, state, smallest.max(0.0).next_up())?;
            }
        }
    }

    /// The length of the step after which the first gap closes, and that of the last trial.
    fn first_touch<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        whole: f64,
        (length, passed): (f64, f64),
        state: &State,
    ) -> Result<(f64, f64), StepError> {
        // what is passed may have been out of reach where the step starts
        let Self { near, set, elements, kinds, .. } = &*self;
        let passed_gap = |&(id, gap): &(ContactId, f64)| {
            let is_passed = gap < 0.0 && set.binary_search(&id).is_err();
            let element = &elements[id.element as usize];
            let before = element.gap(id.feature, state.configuration());
            is_passed.then(|| before / kinds[id.element as usize].0)
        };
        let now = near.iter().filter_map(passed_gap).min_by(f64::total_cmp).unwrap_or(0.0);
        let now = if now > 0.0 { now } else { -passed }; // not named there
        let mut bracket = Bracket::new([0.0, -now], [length, -passed]);
        let mut at = length;
        while let Some(h) = bracket.next(f64::EPSILON * length) {
            let h = h.max(REST * whole); // in less it touches now
            if h >= bracket.high() {
                break;
            }
            let trial = SubStep { h, t_end: state.t + h, ..step };
            let gap = self.solve(run, trial, state)?.unwrap_or(now);
            at = h;
            bracket.take(h, -gap);
            if (0.0..=TOUCH).contains(&gap) {
                break;
            }
        }
        Ok((bracket.low(), at))
    }

    /// Where between two open nodes a gap may be closed: the minimum of the cubic through the gaps
    /// and their rates at both ends, where that is negative; the length of the step to it.
    fn dip<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<Option<f64>, StepError> {
        let h = step.h;
        let mut lengths: Option<f64> = None;
        let mut known = false; // the velocities
        for place in 0..self.near.len() {
            let (id, relative) = self.near[place];
            if self.set.binary_search(&id).is_ok() {
                continue;
            }
            let (element, feature) = (&self.elements[id.element as usize], id.feature);
            let size = self.kinds[id.element as usize].0;
            let same = self.start.get(place).filter(|own| own.0 == id);
            let known_gap = same.or_else(|| {
                let place = self.start.binary_search_by(|own| own.0.cmp(&id));
                place.ok().map(|place| &self.start[place])
            });
            let gaps = [
                match known_gap {
                    Some((_, relative)) => relative * size,
                    None => element.gap(feature, state.configuration()),
                },
                relative * size,
            ];
            let change = (gaps[1] - gaps[0]).abs();
            let is_near = gaps[0].min(gaps[1]) <= NEAR * size + 2.0 * change;
            if !(is_near && change.is_finite()) {
                continue;
            }
            if !known {
                self.v.iter_mut().for_each(|v| v.resize(state.q.len(), 0.0));
                let [before, after] = &mut self.v;
                self.node.velocity_after(run, state, h, before)?;
                run.velocity_at_end(h, after)?;
                known = true;
            }
            let end = run.end.configuration();
            let mut rates = [0.0; 2];
            for ((rate, at), v) in rates.iter_mut().zip([state.configuration(), end]).zip(&self.v) {
                self.scratch.clear();
                element.rows(feature, at, &mut self.scratch);
                *rate = h * self.scratch.dot(0, v);
            }
            if let Some(part) = minimum_below_zero(gaps, rates) {
                lengths = Some(lengths.map_or(part * h, |to: f64| to.min(part * h)));
            }
        }
        Ok(lengths)
    }
}

/// What is known of a step, set aside.
#[derive(Debug)]
pub(crate) struct SetAside(Records);

/// Where in `(0, 1)` the cubic with these values and slopes at the ends has a negative minimum.
fn minimum_below_zero([a, b]: [f64; 2], [da, db]: [f64; 2]) -> Option<f64> {
    // g(x) = a + da x + c x² + d x³
    let (c, d) = (3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db);
    let root = (c * c - 3.0 * d * da).max(0.0).sqrt(); // g' = da + 2c x + 3d x²
    let x = if c > 0.0 { -da / (c + root) } else { (root - c) / (3.0 * d) };
    let value = a + x * (da + x * (c + x * d));
    (x > 0.0 && x < 1.0 && value < 0.0).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minima_of_cubics_are_found() {
        // (x − ½)² − 0.01 and its multiples with cubic terms
        assert_eq!(minimum_below_zero([0.24, 0.24], [-1.0, 1.0]), Some(0.5));
        assert_eq!(minimum_below_zero([0.26, 0.26], [-1.0, 1.0]), None);
        let cubic = |x: f64| (x - 0.4) * (x - 0.4) * (x + 1.0) - 1e-3;
        let slope = |x: f64| 2.0 * (x - 0.4) * (x + 1.0) + (x - 0.4) * (x - 0.4);
        let found = minimum_below_zero([cubic(0.0), cubic(1.0)], [slope(0.0), slope(1.0)]);
        assert!((found.unwrap() - 0.4).abs() < 1e-14, "{found:?}");
        assert_eq!(minimum_below_zero([1.0, 0.5], [-0.5, -0.5]), None);
    }
}
