//! A step of a scheme: one of the sub-steps of a composition.

use vi_core::interval::Interval;
use vi_core::state::State;

/// A sub-step of a composition: its place in it, its length and its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubStep {
    /// Index `k` among the sub-steps of a macro step; 0 without composition.
    pub index: usize,
    /// Number of sub-steps of a macro step; 1 without composition.
    pub count: usize,
    /// `γ_k h`, s; negative for backward sub-steps.
    pub h: f64,
    /// `t_{n+1}`, s: `t_n + h` up to rounding; at the end of a macro step that of the node.
    pub t_end: f64,
}

impl SubStep {
    /// A step from `t` (s) of length `h` (s) without composition.
    #[must_use]
    pub fn single(t: f64, h: f64) -> Self {
        Self { index: 0, count: 1, h, t_end: t + h }
    }

    /// Newton's method of the very first step starts from `h ν` where rates `ν` of the unknowns are
    /// given.
    pub fn depart(self, rates: Option<&[f64]>, state: &mut State) {
        if let Some(rates) = rates.filter(|_| state.step == 0 && self.index == 0) {
            let increment: Vec<f64> = rates.iter().map(|rate| self.h * rate).collect();
            state.history.remember(self.index, self.h, false, &increment);
        }
    }

    /// Opens the interval of this step at a state.
    pub fn open(self, s: &mut Interval, state: &State) {
        state.open(s, self.h);
        s.end_at(self.t_end);
    }
}
