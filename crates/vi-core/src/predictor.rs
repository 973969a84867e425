//! Start values for Newton's method, extrapolated from the increments of earlier steps.
//!
//! Through the last `k ≤ 4` increments of equal steps goes a polynomial of degree `k − 1`:
//! ```text
//! u_{n+1} ≈ u_n,   2u_n − u_{n-1},   3u_n − 3u_{n-1} + u_{n-2},   4u_n − 6u_{n-1} + 4u_{n-2} − u_{n-3}
//! ```
//! Unknowns that alternate from step to step around a smooth course, `w_n + (−1)^n a`, are extrapolated by
//! formulas that are exact for constant `a` and for polynomials of one degree less:
//! ```text
//! u_{n+1} ≈ u_{n-1},   u_n + u_{n-1} − u_{n-2},   2u_n − 2u_{n-2} + u_{n-3}
//! ```
//! The formulas above would multiply `a` by up to 16. A composition keeps one history for each sub-step,
//! since sub-step `j` resembles sub-step `j` of the steps before, not its neighbour.

use std::ops::Range;

const DEPTH: usize = 4;
const WEIGHTS: [&[f64]; DEPTH] = [&[1.0], &[2.0, -1.0], &[3.0, -3.0, 1.0], &[4.0, -6.0, 4.0, -1.0]];
const ALTERNATING: [&[f64]; DEPTH] =
    [&[1.0], &[0.0, 1.0], &[1.0, 1.0, -1.0], &[2.0, 0.0, -2.0, 1.0]];

/// The last increments of each sub-step of a composition.
#[derive(Clone, Debug)]
pub struct Predictor {
    lanes: Vec<Lane>,
    alternating: Range<usize>,
}

#[derive(Clone, Debug)]
struct Lane {
    h: f64,
    history: [Vec<f64>; DEPTH], // newest first
    known: usize,
}

impl Predictor {
    /// For increments of shape `dof` and a composition of `lanes` sub-steps.
    #[must_use]
    pub fn new(dof: usize, lanes: usize) -> Self {
        let history = || std::array::from_fn(|_| vec![0.0; dof]);
        let lane = || Lane { h: 0.0, history: history(), known: 0 };
        Self { lanes: (0..lanes.max(1)).map(|_| lane()).collect(), alternating: 0..0 }
    }

    /// The unknowns in `range` alternate from step to step around a smooth course.
    #[must_use]
    pub fn alternating(mut self, range: Range<usize>) -> Self {
        self.alternating = range;
        self
    }

    /// Writes the start value of sub-step `lane` of length `h`; `false` when nothing is known yet.
    pub fn predict(&self, lane: usize, h: f64, out: &mut [f64]) -> bool {
        let lane = &self.lanes[lane];
        if lane.known == 0 || lane.h.to_bits() != h.to_bits() {
            return false;
        }
        out.fill(0.0);
        let weights = [WEIGHTS, ALTERNATING].map(|weights| weights[lane.known - 1]);
        for (k, u) in lane.history.iter().enumerate().take(lane.known) {
            for (i, (o, u)) in out.iter_mut().zip(u).enumerate() {
                *o += weights[usize::from(self.alternating.contains(&i))][k] * u;
            }
        }
        true
    }

    /// Remembers the increment of sub-step `lane`; a change of `h` starts its history anew.
    pub fn remember(&mut self, lane: usize, h: f64, u: &[f64]) {
        let lane = &mut self.lanes[lane];
        if lane.h.to_bits() != h.to_bits() {
            (lane.h, lane.known) = (h, 0);
        }
        lane.history.rotate_right(1);
        lane.history[0].copy_from_slice(u);
        lane.known = (lane.known + 1).min(DEPTH);
    }

    /// Keeps only the newest increment (the polynomial was a bad guess).
    pub fn shorten(&mut self, lane: usize) {
        self.lanes[lane].known = self.lanes[lane].known.min(1);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        for lane in &mut self.lanes {
            lane.known = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_increments_are_predicted_exactly() {
        let u = |k: f64| 1.0 + k * (2.0 - k * (0.5 - 0.25 * k));
        let mut predictor = Predictor::new(1, 2);
        let mut guess = [f64::NAN];
        assert!(!predictor.predict(1, 0.1, &mut guess), "nothing known yet");
        for k in 0..4 {
            predictor.remember(1, 0.1, &[u(f64::from(k))]);
        }
        assert!(predictor.predict(1, 0.1, &mut guess));
        assert!((guess[0] - u(4.0)).abs() < 1e-13, "{} vs {}", guess[0], u(4.0));
        assert!(!predictor.predict(0, 0.1, &mut guess), "the other lane is untouched");
        assert!(!predictor.predict(1, 0.2, &mut guess), "another step length");
    }

    #[test]
    fn alternating_unknowns_are_predicted_exactly() {
        let u = |k: i32| {
            let (t, sign) = (f64::from(k), if k % 2 == 0 { 1.0 } else { -1.0 });
            [1.0 + t * (2.0 - 0.5 * t), 0.3 + t * (0.7 - 0.2 * t) + 5.0 * sign]
        };
        let mut predictor = Predictor::new(2, 1).alternating(1..2);
        let mut guess = [f64::NAN; 2];
        let mut off = Vec::new();
        for k in 0..5 {
            predictor.predict(0, 0.1, &mut guess);
            off.push((guess[1] - u(k)[1]).abs());
            predictor.remember(0, 0.1, &u(k));
        }
        println!("the alternating unknown is missed by {off:?}");
        // two values: of the same parity; three: linear; four: quadratic
        assert!(off[2] < 2.0 && off[3] < 1.0 && off[4] < 1e-13, "{off:?}");
        assert!((guess[0] - u(4)[0]).abs() < 1e-13, "the other unknown: {guess:?}");
    }
}
