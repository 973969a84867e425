//! Which states of a run are kept for the sweep backward.
//!
//! The sweep needs every step. While all fit in memory they are kept; else the run is repeated from
//! states in pieces, each piece again from states within it where it is too long. What is repeated
//! has the same bits, so a derivative does not depend on the checkpoints.
//!
//! Source: A. Griewank, A. Walther, ACM TOMS 26 (2000) 19–45, for optimal schedules; here pieces of
//! a level have equal lengths.

/// How much is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Checkpoints {
    /// All steps.
    All,
    /// The state before every so many macro steps; the run is repeated once.
    Every(usize),
    /// What fits in so many bytes.
    Memory(usize),
}

impl Default for Checkpoints {
    /// 256 MiB.
    fn default() -> Self {
        Self::Memory(256 << 20)
    }
}

/// What a state and a recorded macro step take, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CheckpointSizes {
    pub(crate) state: usize,
    pub(crate) step: usize,
}

/// Pieces of equal length, level by level: the number of steps of a piece, from the whole run to
/// what is recorded at once.
pub(crate) fn levels(of: Checkpoints, steps: usize, sizes: CheckpointSizes) -> Vec<usize> {
    if steps == 0 {
        return vec![0];
    }
    match of {
        Checkpoints::All => vec![steps],
        Checkpoints::Every(piece) => vec![steps, piece.clamp(1, steps)],
        Checkpoints::Memory(bytes) => {
            let all = bytes / sizes.step.max(1);
            if steps <= all {
                return vec![steps];
            }
            // half of the memory for steps, half for states
            let piece = (bytes / 2 / sizes.step.max(1)).max(1);
            let states = (bytes / 2 / sizes.state.max(1)).max(2);
            let mut count = 1;
            while (states / count).max(2).saturating_pow(count as u32).saturating_mul(piece) < steps
            {
                count += 1;
            }
            let parts = (states / count).max(2);
            let mut levels = vec![steps];
            while levels.last().is_some_and(|last| *last > piece) {
                let last = levels[levels.len() - 1];
                levels.push(last.div_ceil(parts).max(piece.min(last)));
            }
            levels
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_fit_the_memory() {
        let sizes = CheckpointSizes { state: 3000, step: 1000 };
        assert_eq!(levels(Checkpoints::All, 50, sizes), [50]);
        assert_eq!(levels(Checkpoints::Every(7), 50, sizes), [50, 7]);
        assert_eq!(levels(Checkpoints::Every(7), 0, sizes), [0]);
        assert_eq!(levels(Checkpoints::Memory(50_000), 50, sizes), [50]);
        for (bytes, steps) in [(40_000, 50), (20_000, 1000), (9_000, 5000), (10, 33)] {
            let levels = levels(Checkpoints::Memory(bytes), steps, sizes);
            let parts: Vec<usize> =
                levels.windows(2).map(|pair| pair[0].div_ceil(pair[1])).collect();
            let states: usize = parts.iter().sum();
            println!("{bytes} bytes, {steps} steps: pieces of {levels:?}, {states} states");
            assert!(levels.windows(2).all(|pair| pair[1] < pair[0]), "{levels:?}");
            let used = states * sizes.state + levels[levels.len() - 1] * sizes.step;
            assert!(used <= 2 * bytes || bytes < 20 * sizes.state, "{used} of {bytes}");
        }
    }
}
