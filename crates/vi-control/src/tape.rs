//! The (sub-)steps of a run, recorded.

use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;

/// A (sub-)step with the momentum where it starts.
#[derive(Debug)]
pub(crate) struct Recorded {
    pub(crate) step: usize, // macro step
    pub(crate) s: Interval,
    pub(crate) p: Vec<f64>, // n  p̄
}

/// Steps in the order of time; keeps the memory of those that are taken off.
#[derive(Debug, Default)]
pub(crate) struct Tape {
    steps: Vec<Recorded>,
    used: usize,
}

impl Tape {
    pub(crate) fn clear(&mut self) {
        self.used = 0;
    }

    /// Records a sub-step; `p`: the momentum of the state before the macro step, of its first.
    pub(crate) fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        step: usize,
        s: &Interval,
        p: Option<&[f64]>,
    ) {
        if self.used == self.steps.len() {
            let n = s.dim();
            self.steps.push(Recorded { step, s: Interval::new(n), p: vec![0.0; n] });
        }
        let (before, own) = self.steps.split_at_mut(self.used);
        let own = &mut own[0];
        own.step = step;
        own.s.copy_from(s);
        match (p, before.last()) {
            (Some(p), _) => own.p.copy_from_slice(p),
            (None, Some(last)) => system.forced_d2(&last.s, &mut own.p), // p̄ after the one before
            (None, None) => own.p.fill(f64::NAN),
        }
        self.used += 1;
    }

    /// From the last step to the first.
    pub(crate) fn backward(&self) -> impl Iterator<Item = &Recorded> {
        self.steps[..self.used].iter().rev()
    }

    /// What a recorded sub-step of `n` coordinates takes, bytes.
    pub(crate) fn size(n: usize, angles: usize, internal: usize) -> usize {
        size_of::<Recorded>() + size_of::<f64>() * (7 * n + angles + internal)
    }
}
