//! Initial guesses for all members of a group: [`vi_core::predictor::IncrementHistory`] in lanes.

use super::link::{MOST, put_lane, take_lane};
use vi_core::lanes::{Lanes, Register};
use vi_core::predictor::{
    DEPTH, IncrementHistory, NODES, SubStepPlace, SubStepWeights, Weights, terms,
};

/// Increments that are kept of a sub-step: one more than are used, for a macro step that is taken
/// back.
const SLOTS: usize = DEPTH + 1;

/// The sub-steps before a sub-step.
struct Others<'a> {
    weights: &'a Weights,
    places: [usize; NODES], // where their increments begin
    known: [bool; MOST],    // whether a lane knows all of them
}

/// The last increments of each sub-step of a composition, in lanes.
#[derive(Debug)]
pub(super) struct LaneHistory<T: Register> {
    lanes: T,
    unknowns: usize,
    newest: Vec<usize>,                        // of each sub-step
    known: Vec<[(f64, usize); MOST]>, // step and number of increments of each sub-step and lane
    known_at_start: Vec<[(f64, usize); MOST]>, // of the macro step
    increments: Vec<T::Lanes>,        // sub-steps × SLOTS × unknowns
    weights: SubStepWeights,
}

impl<T: Register> LaneHistory<T> {
    pub(super) fn new(lanes: T, unknowns: usize, sub_steps: usize) -> Self {
        Self {
            lanes,
            unknowns,
            newest: vec![0; sub_steps],
            known: vec![[(0.0, 0); MOST]; sub_steps],
            known_at_start: vec![[(0.0, 0); MOST]; sub_steps],
            increments: vec![lanes.splat(0.0); sub_steps * SLOTS * unknowns],
            weights: SubStepWeights::default(),
        }
    }

    /// Where the increment of sub-step `k` of an age begins.
    fn place(&self, k: usize, age: usize) -> usize {
        (k * SLOTS + (self.newest[k] + age) % SLOTS) * self.unknowns
    }

    /// Whether a lane has increments of sub-step `k` of length `h`.
    pub(super) fn knows(&self, k: usize, lane: usize, h: f64) -> bool {
        let (step, count) = self.known[k][lane];
        count > 0 && step.to_bits() == h.to_bits()
    }

    /// Takes the history of a member into a lane.
    pub(super) fn load(&mut self, lane: usize, history: &IncrementHistory) {
        for k in 0..self.newest.len() {
            let count = history.count(k);
            self.known[k][lane] = (history.step(k), count);
            for age in 0..count {
                let place = self.place(k, age);
                let own = &mut self.increments[place..place + self.unknowns];
                put_lane(history.increment(k, age), lane, own);
            }
        }
    }

    /// Keeps what is known where a macro step starts.
    pub(super) fn keep_start(&mut self) {
        self.known_at_start.copy_from_slice(&self.known);
    }

    /// Writes what a lane knew before the last increment of each of the first `undone` sub-steps
    /// was remembered.
    pub(super) fn write(&self, lane: usize, undone: usize, out: &mut IncrementHistory) {
        out.fit(self.unknowns, self.newest.len(), 0..0);
        for k in 0..self.newest.len() {
            let (known, newest) =
                if k < undone { (&self.known_at_start, 1) } else { (&self.known, 0) };
            let (h, count) = known[k][lane];
            out.replace(k, h, count, |age, own| {
                let place = self.place(k, newest + age);
                take_lane(&self.increments[place..place + self.unknowns], lane, own);
            });
        }
    }

    /// Remembers the increments of sub-step `k`.
    pub(super) fn remember(&mut self, k: usize, h: f64, u: &[T::Lanes]) {
        self.newest[k] = (self.newest[k] + SLOTS - 1) % SLOTS;
        for lane in 0..MOST {
            let (step, count) = self.known[k][lane];
            if count > 0 && step.to_bits() != h.to_bits() {
                self.known.iter_mut().for_each(|known| known[lane].1 = 0);
                self.weights.clear();
            }
            let (step, count) = &mut self.known[k][lane];
            (*step, *count) = (h, (*count + 1).min(DEPTH));
        }
        let place = self.place(k, 0);
        self.increments[place..place + self.unknowns].copy_from_slice(u);
    }

    /// Finds the weights of the sub-steps before one another, once a lane knows the lengths of all.
    pub(super) fn weigh(&mut self) {
        let knows_all = |lane: &usize| self.known.iter().all(|known| known[*lane].1 > 0);
        if let Some(lane) = (0..T::Lanes::COUNT).find(knows_all).filter(|_| self.known.len() > 1) {
            self.weights.find(self.known.iter().map(|known| known[lane].0));
        }
    }

    /// Writes the initial guess of sub-step `k`.
    #[inline(always)]
    pub(super) fn predict(&self, k: usize, out: &mut [T::Lanes]) {
        let zero = self.lanes.splat(0.0);
        let same: [usize; DEPTH] = std::array::from_fn(|age| self.place(k, age));
        let others = self.others(k);
        let terms = self.terms(k, &same, others.as_ref(), out.len());
        for (i, out) in out.iter_mut().enumerate() {
            let differences = self.differences(&same, i);
            let mut sum = zero;
            for (j, d) in differences.iter().enumerate().rev() {
                let term = self.lanes.splat((j + 1) as f64);
                sum = term.if_at_most(terms, sum + *d, zero);
            }
            if let Some(others) = &others {
                let guess = self.part(others, 0, i) + self.part(others, 1, i);
                sum = self.lanes.splat(1.0).if_at_most(terms, sum, guess);
            }
            *out = sum;
        }
    }

    /// The sub-steps before sub-step `k`, where a lane knows all of them.
    fn others(&self, k: usize) -> Option<Others<'_>> {
        let weights = self.weights.of(k)?;
        let before: [SubStepPlace; NODES] =
            std::array::from_fn(|a| SubStepPlace::before(k, a, self.known.len()));
        let knows = |lane: usize| {
            let is_known = |place: &SubStepPlace| place.age < self.known[place.index][lane].1;
            lane < T::Lanes::COUNT && before.iter().all(is_known)
        };
        let known = std::array::from_fn(knows);
        let places = before.map(|place| self.place(place.index, place.age));
        known.contains(&true).then_some(Others { weights, places, known })
    }

    /// How many differences of the same sub-step each lane takes; 0: the sub-steps before.
    #[inline(always)]
    fn terms(
        &self,
        k: usize,
        same: &[usize; DEPTH],
        others: Option<&Others<'_>>,
        unknowns: usize,
    ) -> T::Lanes {
        let zero = self.lanes.splat(0.0);
        let (mut sizes, mut third) = ([zero; DEPTH], zero);
        for i in 0..unknowns {
            let differences = self.differences(same, i);
            for (size, d) in sizes.iter_mut().zip(differences) {
                *size = size.larger(d.abs());
            }
            if let Some(others) = others {
                let part = self.part(others, 1, i);
                third = third.larger(part.abs());
            }
        }
        let chosen: [usize; MOST] = std::array::from_fn(|lane| {
            if lane >= T::Lanes::COUNT {
                return 1;
            }
            let count = self.known[k][lane].1.max(1);
            let sizes = std::array::from_fn::<f64, DEPTH, _>(|j| sizes[j].at(lane));
            let (terms, missed) = terms(&sizes[..count]);
            let known = others.is_some_and(|others| others.known[lane]);
            if known && third.at(lane) < missed { 0 } else { terms }
        });
        self.lanes.gather(
            #[inline(always)]
            |lane| chosen[lane] as f64,
        )
    }

    /// A part of the guess of an unknown by the sub-steps before.
    #[inline(always)]
    fn part(&self, others: &Others<'_>, part: usize, i: usize) -> T::Lanes {
        let mut sum = self.lanes.splat(0.0);
        for (weight, place) in others.weights[part].iter().zip(&others.places) {
            sum = sum + self.increments[place + i] * *weight;
        }
        sum
    }

    /// `∇^j u_n` of an unknown.
    #[inline(always)]
    fn differences(&self, places: &[usize; DEPTH], i: usize) -> [T::Lanes; DEPTH] {
        let mut u = [self.increments[places[0] + i]; DEPTH];
        for (u, place) in u.iter_mut().zip(places) {
            *u = self.increments[place + i];
        }
        for j in 1..DEPTH {
            for age in (j..DEPTH).rev() {
                u[age] = u[age - 1] - u[age];
            }
        }
        u
    }
}
