//! Initial guesses for Newton's method, extrapolated from the increments of earlier steps.
//!
//! Through the last `k` increments of equal steps goes a polynomial of degree `k − 1`, with `k ≤ 4`
//! or, where the degree is fitted to the motion, `k ≤ 7`. With the backward differences
//! `∇u_n = u_n − u_{n-1}`, `∇^{j+1} u_n = ∇^j u_n − ∇^j u_{n-1}`:
//! ```text
//! u_{n+1} ≈ Σ_{j<k} ∇^j u_n,       |∇^k u_n|_∞: by how much it would have missed the last increment
//! ```
//! Fitted: of all `k` the one is taken that would have missed it least; if that is the largest one
//! that can be judged, all increments. A motion that the step resolves well has many useful
//! differences, a vibration that it does not resolve has none: each doubles its part.
//!
//! Unknowns that alternate from step to step around a smooth course, `w_n + (−1)^n a`, are
//! extrapolated by formulas that are exact for constant `a` and for polynomials of one degree less:
//! ```text
//! u_{n+1} ≈ u_{n-1},   u_n + u_{n-1} − u_{n-2},   2u_n − 2u_{n-2} + u_{n-3}
//! ```
//! The formulas above would multiply `a` by 16 and more. A composition has one history for each
//! sub-step, since sub-step `j` resembles sub-step `j` of the steps before, not its neighbour.
//! Where the degree is fitted, the sub-steps before serve as well, by weights for their lengths
//! ([`SubStepWeights`]): they are taken if their terms of the highest degree are smaller than the
//! miss of the polynomial.
//!
//! The history is part of the [`crate::State`]: it decides from where Newton's method starts, and
//! so the last bits of the result.

mod sub_steps;

pub use sub_steps::{NODES, SubStepPlace, SubStepWeights, Weights};

#[cfg(target_arch = "x86_64")]
use crate::lanes::Wide;
use crate::lanes::{Lanes, Plain, Register};
use serde::{Deserialize, Serialize};
use std::ops::{Range, RangeInclusive};

/// Increments that are remembered.
pub const DEPTH: usize = 7;
const CUBIC: [&[f64]; 4] = [&[1.0], &[2.0, -1.0], &[3.0, -3.0, 1.0], &[4.0, -6.0, 4.0, -1.0]];
const ALTERNATING: [&[f64]; 4] = [&[1.0], &[0.0, 1.0], &[1.0, 1.0, -1.0], &[2.0, 0.0, -2.0, 1.0]];

/// Of which degree the polynomial is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Degree {
    /// 0: the last increment.
    Zero,
    /// 3, less while fewer increments are known.
    #[default]
    Cubic,
    /// That which would have met the last increment best, up to 6.
    Fitting,
    /// The same of numbers around zero, where a difference is smaller than a fourth of the last
    /// number; else zero.
    Correcting,
}

/// The last increments of each sub-step of a composition.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IncrementHistory {
    unknowns: usize,
    alternating: Range<usize>,
    sub_steps: Vec<KnownSubStep>,
    increments: Vec<f64>, // sub-steps × DEPTH × unknowns
    #[serde(skip)]
    weights: SubStepWeights,
}

/// What is known of a sub-step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct KnownSubStep {
    h: f64,
    count: usize,  // increments known
    newest: usize, // place of the newest among DEPTH
}

impl IncrementHistory {
    /// For increments of `unknowns` entries and a composition of `sub_steps` sub-steps.
    #[must_use]
    pub fn new(unknowns: usize, sub_steps: usize) -> Self {
        let sub_steps = vec![KnownSubStep::default(); sub_steps.max(1)];
        let increments = vec![0.0; sub_steps.len() * DEPTH * unknowns];
        Self {
            unknowns,
            alternating: 0..0,
            sub_steps,
            increments,
            weights: SubStepWeights::default(),
        }
    }

    /// The unknowns in `range` alternate from step to step around a smooth course.
    #[must_use]
    pub fn alternating(mut self, range: Range<usize>) -> Self {
        self.alternating = range;
        self
    }

    /// Becomes empty where it is of other unknowns or sub-steps, or of other `alternating`
    /// unknowns.
    pub fn fit(&mut self, unknowns: usize, sub_steps: usize, alternating: Range<usize>) {
        let fits = self.unknowns == unknowns
            && self.sub_steps.len() == sub_steps
            && self.alternating == alternating
            && self.increments.len() == sub_steps * DEPTH * unknowns
            && self.sub_steps.iter().all(|known| known.count <= DEPTH && known.newest < DEPTH);
        if !fits {
            *self = Self::new(unknowns, sub_steps).alternating(alternating);
        }
        let composed = sub_steps > 1 && self.alternating.is_empty();
        if composed && self.sub_steps.iter().all(|known| known.count > 0) {
            self.weights.find(self.sub_steps.iter().map(|known| known.h));
        }
    }

    /// Becomes a copy of another history; allocates only when that is larger.
    pub fn copy_from(&mut self, other: &Self) {
        (self.unknowns, self.alternating) = (other.unknowns, other.alternating.clone());
        self.sub_steps.clone_from(&other.sub_steps);
        self.increments.clone_from(&other.increments);
        self.weights.copy_from(&other.weights);
    }

    /// The step of the increments of sub-step `k`.
    #[must_use]
    pub fn step(&self, k: usize) -> f64 {
        self.sub_steps[k].h
    }

    /// How many increments of sub-step `k` are known.
    #[must_use]
    pub fn count(&self, k: usize) -> usize {
        self.sub_steps[k].count
    }

    /// The increment of sub-step `k` that is `age` steps old, 0 for the newest.
    #[must_use]
    pub fn increment(&self, k: usize, age: usize) -> &[f64] {
        let place = k * DEPTH + (self.sub_steps[k].newest + age) % DEPTH;
        &self.increments[place * self.unknowns..(place + 1) * self.unknowns]
    }

    /// The newest increment of the sub-step before sub-step `k`, shape of the unknowns, if there is
    /// one.
    #[must_use]
    pub fn before(&self, k: usize) -> Option<&[f64]> {
        let before = k.checked_sub(1).unwrap_or(self.sub_steps.len() - 1);
        (self.sub_steps[before].count > 0).then(|| self.increment(before, 0))
    }

    /// Writes the initial guess of sub-step `k` of length `h`; `false` when no increment is known.
    pub fn predict(&self, k: usize, h: f64, degree: Degree, out: &mut [f64]) -> bool {
        let known = self.sub_steps.get(k).copied().unwrap_or_default();
        if known.count == 0 || known.h.to_bits() != h.to_bits() {
            return false;
        }
        match degree {
            Degree::Zero => self.extrapolate(k, 1, out),
            Degree::Fitting | Degree::Correcting if self.alternating.is_empty() => {
                self.fit_increments(k, usize::from(degree == Degree::Fitting), out);
            }
            _ => self.extrapolate(k, known.count.min(CUBIC.len()), out),
        }
        true
    }

    /// By the formulas for `count` increments.
    fn extrapolate(&self, k: usize, count: usize, out: &mut [f64]) {
        out.fill(0.0);
        let weights = [CUBIC, ALTERNATING].map(|weights| weights[count - 1]);
        for age in 0..count {
            for (i, (o, u)) in out.iter_mut().zip(self.increment(k, age)).enumerate() {
                *o += weights[usize::from(self.alternating.contains(&i))][age] * u;
            }
        }
    }

    /// By as many of the differences of the increments as fit, `least` or more, or by the sub-steps
    /// before.
    fn fit_increments(&self, k: usize, least: usize, out: &mut [f64]) {
        let mut increments: [&[f64]; DEPTH] = [&[]; DEPTH]; // the newest first
        let count = self.sub_steps[k].count;
        for age in 0..count {
            increments[age] = self.increment(k, age);
        }
        let (counts, before) = (least..=count, self.sub_steps_before(k));
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = Wide::detect() {
            return wide.run(
                #[inline(always)]
                || fit(wide, &increments, counts, before.as_ref(), out),
            );
        }
        fit(Plain, &increments, counts, before.as_ref(), out);
    }

    /// The increments of the sub-steps before sub-step `k`, where all are known.
    fn sub_steps_before(&self, k: usize) -> Option<SubStepBefore<'_>> {
        let weights = self.weights.of(k)?;
        let mut increments: [&[f64]; NODES] = [&[]; NODES];
        for (a, increment) in increments.iter_mut().enumerate() {
            let SubStepPlace { index, age, .. } = SubStepPlace::before(k, a, self.sub_steps.len());
            *increment = (age < self.sub_steps[index].count).then(|| self.increment(index, age))?;
        }
        Some(SubStepBefore { weights, increments })
    }

    /// Remembers the increment of sub-step `k`; a change of `h` starts the history anew. After a
    /// failure of the extrapolation (`anew`) only this increment is known of the sub-step.
    pub fn remember(&mut self, k: usize, h: f64, anew: bool, u: &[f64]) {
        let KnownSubStep { h: before, count, .. } = self.sub_steps[k];
        if count > 0 && before.to_bits() != h.to_bits() {
            self.clear();
        }
        let known = &mut self.sub_steps[k];
        known.h = h;
        if anew {
            known.count = known.count.min(1);
        }
        known.newest = (known.newest + DEPTH - 1) % DEPTH;
        known.count = (known.count + 1).min(DEPTH);
        let place = k * DEPTH + known.newest;
        self.increments[place * self.unknowns..(place + 1) * self.unknowns].copy_from_slice(u);
    }

    /// Replaces what is known of sub-step `k`: `count` increments of steps of length `h`, written
    /// by `write(age, increment)`, the newest of age 0. Allocates nothing.
    pub fn replace(
        &mut self,
        k: usize,
        h: f64,
        count: usize,
        mut write: impl FnMut(usize, &mut [f64]),
    ) {
        let known = &mut self.sub_steps[k];
        if known.h.to_bits() != h.to_bits() {
            self.weights.clear();
        }
        *known = KnownSubStep { h, count: count.min(DEPTH), newest: 0 };
        for age in 0..known.count {
            let place = (k * DEPTH + age) * self.unknowns;
            write(age, &mut self.increments[place..place + self.unknowns]);
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.sub_steps.iter_mut().for_each(|known| known.count = 0);
        self.weights.clear();
    }
}

/// Increments of the sub-steps before, the last one first.
struct SubStepBefore<'a> {
    weights: &'a Weights,
    increments: [&'a [f64]; NODES],
}

impl SubStepBefore<'_> {
    /// The guess of degree 2 (`part` 0), or what degree 3 adds (1), of the unknowns from `first`
    /// on.
    #[inline(always)]
    fn part<T: Register>(&self, lanes: T, part: usize, first: usize) -> T::Lanes {
        let mut sum = lanes.splat(0.0);
        for (weight, increment) in self.weights[part].iter().zip(&self.increments) {
            sum = sum + entries(lanes, increment, first) * *weight;
        }
        sum
    }
}

/// By as many of the differences of some increments, the newest first, as fit: the first that is
/// left out is the smallest one; all where they only fall. By the sub-steps before where what
/// degree 3 adds is smaller than that. `counts`: the least number of differences, and of
/// increments.
#[inline(always)]
fn fit<T: Register>(
    lanes: T,
    increments: &[&[f64]; DEPTH],
    counts: RangeInclusive<usize>,
    before: Option<&SubStepBefore<'_>>,
    out: &mut [f64],
) {
    let (zero, width) = (lanes.splat(0.0), T::Lanes::COUNT);
    let mut sizes = [zero; DEPTH + 1]; // increments of steps that were taken are finite
    for first in (0..out.len()).step_by(width) {
        let differences = differences(lanes, increments, first);
        for j in 0..DEPTH {
            sizes[j] = sizes[j].larger(differences[j]).larger(zero - differences[j]);
        }
        if let Some(before) = before {
            let part = before.part(lanes, 1, first);
            sizes[DEPTH] = sizes[DEPTH].larger(part).larger(zero - part);
        }
    }
    let sizes = sizes.map(|size| (0..width).map(|i| size.at(i)).fold(0.0, f64::max));
    let (mut terms, missed) = terms(&sizes[..*counts.end()]);
    if *counts.start() == 0 && sizes[0] <= 4.0 * missed {
        terms = 0; // no clear course
    }
    let before = before.filter(|_| sizes[DEPTH] < missed);
    for (block, out) in out.chunks_mut(width).enumerate() {
        let first = block * width;
        let mut sum = zero;
        if let Some(before) = before {
            sum = before.part(lanes, 0, first) + before.part(lanes, 1, first);
        } else {
            let differences = differences(lanes, increments, first);
            for j in (0..DEPTH).rev().filter(|j| *j < terms) {
                sum = sum + differences[j];
            }
        }
        out.iter_mut().enumerate().for_each(|(i, out)| *out = sum.at(i));
    }
}

/// How many differences fit, from the largest entry of each: those before the smallest one, all
/// where they only fall; and the smallest one.
#[must_use]
pub fn terms(sizes: &[f64]) -> (usize, f64) {
    let smallest = (1..sizes.len()).min_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
    let Some(terms) = smallest else { return (1, sizes[0]) };
    (if terms + 1 == sizes.len() { terms + 1 } else { terms }, sizes[terms])
}

/// The unknowns from `first` on; what is beyond the last one is zero.
#[inline(always)]
fn entries<T: Register>(lanes: T, increment: &[f64], first: usize) -> T::Lanes {
    match increment.get(first..first + T::Lanes::COUNT) {
        Some(full) => lanes.gather(
            #[inline(always)]
            |i| full[i],
        ),
        None => lanes.gather(
            #[inline(always)]
            |i| increment.get(first + i).copied().unwrap_or(0.0),
        ),
    }
}

/// `∇^j u_n` of the unknowns from `first` on, from the last increments, the newest first; those
/// that are not known, and what is beyond the last unknown, are zero.
#[inline(always)]
fn differences<T: Register>(
    lanes: T,
    increments: &[&[f64]; DEPTH],
    first: usize,
) -> [T::Lanes; DEPTH] {
    let mut u = [lanes.splat(0.0); DEPTH];
    for (u, increment) in u.iter_mut().zip(increments) {
        *u = entries(lanes, increment, first);
    }
    for j in 1..DEPTH {
        for age in (j..DEPTH).rev() {
            u[age] = u[age - 1] - u[age];
        }
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composition::Composition;

    #[test]
    fn cubic_increments_are_predicted_exactly() {
        let u = |k: f64| 1.0 + k * (2.0 - k * (0.5 - 0.25 * k));
        let mut history = IncrementHistory::new(1, 2);
        let mut guess = [f64::NAN];
        assert!(!history.predict(1, 0.1, Degree::Cubic, &mut guess), "nothing known yet");
        for k in 0..4 {
            history.remember(1, 0.1, false, &[u(f64::from(k))]);
        }
        assert!(history.predict(1, 0.1, Degree::Cubic, &mut guess));
        assert!((guess[0] - u(4.0)).abs() < 1e-13, "{} vs {}", guess[0], u(4.0));
        assert!(
            !history.predict(0, 0.1, Degree::Cubic, &mut guess),
            "the other sub-step is untouched"
        );
        assert!(!history.predict(1, 0.2, Degree::Cubic, &mut guess), "another step length");
    }

    #[test]
    fn the_degree_fits_the_increments() {
        let missed = |u: &dyn Fn(f64) -> f64| {
            let mut history = IncrementHistory::new(1, 1);
            (0..9).for_each(|k| history.remember(0, 0.1, false, &[u(f64::from(k))]));
            let mut guess = [f64::NAN];
            history.predict(0, 0.1, Degree::Fitting, &mut guess);
            (guess[0] - u(9.0)).abs()
        };
        let resolved = missed(&|k| (0.1 * k).sin());
        let vibration = missed(&|k| 1.0 + 1e-3 * (7.1 * k * k).sin());
        let polynomial = missed(&|k| 1.0 + k * (0.2 - k * (0.5 - 0.01 * k * (1.0 - 0.1 * k))));
        println!("missed by {resolved:e}, {vibration:e}, {polynomial:e}");
        assert!(resolved < 1e-5 && vibration < 5e-3 && polynomial < 1e-11);
        assert!(missed(&|_| 0.3) <= f64::EPSILON);
    }

    /// Guesses of sub-steps by those before them, of a motion that is a polynomial of degree 4,
    /// after a change of the step.
    #[test]
    fn sub_steps_before_a_change_of_the_step_are_forgotten() {
        let gammas = Composition::Suzuki5.gammas();
        let q = |t: f64| t * (1.0 + t * (0.7 - t * (0.4 + 0.3 * t)));
        let (mut history, mut t) = (IncrementHistory::default(), 0.0);
        for h in [0.25, 0.2] {
            let mut known = 0;
            for macro_step in 0..4 {
                for (k, gamma) in gammas.iter().enumerate() {
                    history.fit(1, gammas.len(), 0..0);
                    let (length, u) = (gamma * h, q(t + gamma * h) - q(t));
                    let mut guess = [f64::NAN];
                    known += usize::from(history.predict(k, length, Degree::Fitting, &mut guess));
                    let missed = (guess[0] - u).abs();
                    assert!(macro_step < 3 || missed < 1e-13, "h = {h}, {k}: {missed:e}");
                    history.remember(k, length, false, &[u]);
                    t += length;
                }
            }
            assert_eq!(known, 3 * gammas.len());
        }
    }

    #[test]
    fn numbers_without_a_course_around_zero_are_left_out() {
        let guess = |u: &dyn Fn(f64) -> f64, count: u32| {
            let mut history = IncrementHistory::new(1, 1);
            (0..count).for_each(|k| history.remember(0, 0.1, false, &[u(f64::from(k))]));
            let mut guess = [f64::NAN];
            history.predict(0, 0.1, Degree::Correcting, &mut guess);
            guess[0]
        };
        assert_eq!(guess(&|_| 0.5, 1), 0.0, "no difference is known");
        assert_eq!(guess(&|k| if k % 2.0 == 0.0 { 1.0 } else { -1.0 }, 7), 0.0);
        assert!((guess(&|k| (0.2 * k).sin(), 7) - 1.4_f64.sin()).abs() < 1e-4);
    }

    #[test]
    fn alternating_unknowns_are_predicted_exactly() {
        let u = |k: i32| {
            let (t, sign) = (f64::from(k), if k % 2 == 0 { 1.0 } else { -1.0 });
            [1.0 + t * (2.0 - 0.5 * t), 0.3 + t * (0.7 - 0.2 * t) + 5.0 * sign]
        };
        let mut history = IncrementHistory::new(2, 1).alternating(1..2);
        let mut guess = [f64::NAN; 2];
        let mut off = Vec::new();
        for k in 0..5 {
            history.predict(0, 0.1, Degree::Cubic, &mut guess);
            off.push((guess[1] - u(k)[1]).abs());
            history.remember(0, 0.1, false, &u(k));
        }
        println!("the alternating unknown is missed by {off:?}");
        // two values: of the same parity; three: linear; four: quadratic
        assert!(off[2] < 2.0 && off[3] < 1.0 && off[4] < 1e-13, "{off:?}");
        assert!((guess[0] - u(4)[0]).abs() < 1e-13, "the other unknown: {guess:?}");
    }
}
