//! Corrections by the factors of an earlier iterate of the same step: the chord method.
//!
//! ```text
//! δ_k = A_0⁻¹ r(u_k),   s_k = |δ_k| relative to |u_k|:     s_{k+1} ≈ ρ s_k,   ρ = min_j s_{j+1}/s_j
//! ```
//! A correction is kept where the one after it leaves less than rounding, `ρ² s_k ≤ ε/4`, and after
//! the first correction also where that was below 1e-6: the error is then `O(s_0³)`, as small as
//! the `O(s_0⁴)` of Newton's method against rounding. Otherwise the matrix is formed at the
//! iterate. The ratio is measured, never assumed, so that stiff elements, which are more curved,
//! get as many matrices as they need. It may be too small where the first error has a direction
//! without curvature, as that of a rotation about its own axis: it decides on matrices, never on
//! the end of the iterations.
//!
//! Source: C. T. Kelley, Iterative Methods for Linear and Nonlinear Equations, SIAM (1995), §5.4.1.

use vi_core::newton::{UnknownBlock, relative_size};

/// A first correction after which the matrix changes in no digit that the next one needs.
const SMALL: f64 = 1e-6;
/// A correction that may not fall any more because of rounding.
const ROUNDING: f64 = 1e-9;

/// What may be left over, relative to the unknowns.
const RESOLUTION: f64 = 0.25 * f64::EPSILON;

/// What the corrections of a step say of the factors that they were made with.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chord {
    blocks: Vec<UnknownBlock>,
    next: Vec<f64>, // d  the iterate after the last correction, where it was not damped
    side: Vec<f64>, // d  right-hand side
    last: Option<LastCorrection>,
}

/// The last correction.
#[derive(Clone, Copy, Debug)]
struct LastCorrection {
    size: f64,          // s_k
    ratio: Option<f64>, // ρ, from the second correction with the same factors on
}

impl LastCorrection {
    /// What follows a correction of this size with the same factors, where it is kept.
    fn followed_by(self, size: f64) -> Option<Self> {
        let ratio = self.ratio.unwrap_or(f64::INFINITY).min(size / self.size);
        let falls = size <= 0.5 * self.size || size <= ROUNDING;
        let after_a_small_one = self.ratio.is_none() && self.size <= SMALL;
        let kept = falls && (after_a_small_one || ratio * ratio * size <= RESOLUTION);
        kept.then_some(Self { size, ratio: Some(ratio) })
    }
}

impl Chord {
    /// For the blocks of the unknowns.
    pub(crate) fn new(blocks: &[UnknownBlock]) -> Self {
        let d = blocks.iter().map(|block| block.range.end).max().unwrap_or(0);
        Self { blocks: blocks.to_vec(), next: vec![0.0; d], side: vec![0.0; d], last: None }
    }

    /// Whether the last correction was one by the factors of an earlier iterate: what it leaves is
    /// not its square.
    pub(crate) fn keeps_factors(&self) -> bool {
        self.last.is_some_and(|last| last.ratio.is_some())
    }

    /// The factors serve no longer.
    pub(crate) fn forget(&mut self) {
        self.last = None;
    }

    /// `x ←` the correction at `u` as `solve` finds it with the factors of an earlier iterate;
    /// `false` where they are of no use, with `x` as it was.
    pub(crate) fn correct<E>(
        &mut self,
        u: &[f64],
        x: &mut [f64],
        solve: impl FnOnce(&mut [f64]) -> Result<(), E>,
    ) -> bool {
        let Some(last) = self.last.take().filter(|_| self.next == u) else { return false };
        self.side.copy_from_slice(x);
        let solved = solve(x).is_ok();
        self.last = last.followed_by(relative_size(&self.blocks, u, x)).filter(|_| solved);
        match self.last {
            Some(_) => self.go_to(u, x),
            None => x.copy_from_slice(&self.side),
        }
        self.last.is_some()
    }

    /// Takes in a correction at `u` with factors of that iterate.
    pub(crate) fn renew(&mut self, u: &[f64], correction: &[f64]) {
        self.last =
            Some(LastCorrection { size: relative_size(&self.blocks, u, correction), ratio: None });
        self.go_to(u, correction);
    }

    /// The iterate that follows, if the correction is applied as it is.
    fn go_to(&mut self, u: &[f64], correction: &[f64]) {
        for ((next, u), correction) in self.next.iter_mut().zip(u).zip(correction) {
            *next = u - correction;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_core::newton::{BlockKind, Fault, Newton, NewtonProblem, NewtonSettings};

    /// `x + c x² = 1`, with a count of the matrices.
    struct Parabola {
        c: f64,
        blocks: [UnknownBlock; 1],
        chord: Chord,
        slope: f64,
        matrices: usize,
    }

    impl NewtonProblem for Parabola {
        fn blocks(&self) -> &[UnknownBlock] {
            &self.blocks
        }
        fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
            r[0] = x[0] + self.c * x[0] * x[0] - 1.0;
            Ok(())
        }
        fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
            let Self { c, chord, slope, matrices, .. } = self;
            let by_factors = |dx: &mut [f64]| {
                dx[0] /= *slope;
                Ok::<(), Fault>(())
            };
            if chord.correct(x, dx, by_factors) {
                return Ok(());
            }
            *slope = 1.0 + 2.0 * *c * x[0];
            *matrices += 1;
            dx[0] /= *slope;
            chord.renew(x, dx);
            Ok(())
        }
    }

    /// The root, its error, iterations and matrices from a guess.
    fn solve(c: f64, guess: f64) -> (f64, usize, usize) {
        let block = UnknownBlock { kind: BlockKind::Position, range: 0..1, floor: 1e-8 };
        let blocks = [block];
        let chord = Chord::new(&blocks);
        let mut problem = Parabola { c, blocks, chord, slope: 0.0, matrices: 0 };
        let mut x = [guess];
        let report = Newton::new(1, NewtonSettings::default()).solve(&mut problem, &mut x).unwrap();
        let exact = 2.0 / (1.0 + (1.0 + 4.0 * c).sqrt());
        ((x[0] / exact - 1.0).abs(), report.iterations, problem.matrices)
    }

    #[test]
    fn the_curvature_decides_how_many_matrices_a_step_needs() {
        for (c, most) in [(1e-7_f64, 1), (1e-3, 2), (1.0, 4), (1e4, 8)] {
            let exact = 2.0 / (1.0 + (1.0 + 4.0 * c).sqrt());
            let (error, iterations, matrices) = solve(c, 1.05 * exact);
            println!(
                "curvature {c:e}: error {error:.1e}, {iterations} iterations, {matrices} matrices"
            );
            assert!(error <= 4.0 * f64::EPSILON && matrices <= most && iterations <= 7);
        }
    }

    #[test]
    fn other_iterates_and_numbers_that_are_not_finite_need_a_matrix() {
        let blocks = [UnknownBlock { kind: BlockKind::Position, range: 0..2, floor: 1e-8 }];
        let mut chord = Chord::new(&blocks);
        let (u, mut x) = ([1.0, 2.0], [1e-3, 1e-3]);
        let identity = |_: &mut [f64]| Ok::<(), Fault>(());
        assert!(!chord.correct(&u, &mut x, identity), "no factors yet");
        chord.renew(&u, &x);
        let mut small = [1e-12, 0.0];
        assert!(!chord.correct(&u, &mut small, identity), "not the iterate after it");
        chord.renew(&u, &x);
        let next = [1.0 - 1e-3, 2.0 - 1e-3];
        let not_finite = |x: &mut [f64]| {
            x[1] = f64::NAN;
            Ok::<(), Fault>(())
        };
        assert!(!chord.correct(&next, &mut small, not_finite));
        assert_eq!(small, [1e-12, 0.0], "the right-hand side is as it was");
        chord.renew(&u, &x);
        assert!(chord.correct(&next, &mut small, identity));
    }
}
