//! The (sub-)steps of a run, recorded: what the others of their quantities follow from.

use vi_core::interval::Interval;

/// A (sub-)step with the momentum where it starts.
#[derive(Debug, Default)]
struct Recorded {
    step: usize,        // macro step
    times: [f64; 3],    // t_n, h, t_{n+1}
    numbers: Vec<f64>,  // q_n, q_{n+1}, Δq, the momentum that is held; n each
    angles: Vec<f64>,   // at q_n
    internal: Vec<f64>, // at q_n
}

/// A recorded step.
#[derive(Debug)]
pub(crate) struct Taken<'a> {
    pub(crate) step: usize, // macro step
    pub(crate) s: &'a Interval,
    pub(crate) p: &'a [f64], // n  the momentum that is held where it starts
}

/// Steps in the order of time; keeps the memory of those that are taken off.
#[derive(Debug, Default)]
pub(crate) struct Tape {
    steps: Vec<Recorded>,
    used: usize,
    s: Interval,
    none: Vec<f64>, // n
}

impl Tape {
    pub(crate) fn clear(&mut self) {
        self.used = 0;
    }

    /// Records a sub-step from a node with the momentum `p`.
    pub(crate) fn push(&mut self, step: usize, s: &Interval, p: &[f64]) {
        if self.used == self.steps.len() {
            self.steps.push(Recorded::default());
        }
        let own = &mut self.steps[self.used];
        (own.step, own.times) = (step, [s.t, s.h, s.t_end()]);
        own.numbers.clear();
        [&s.q0, &s.q1, &s.dq, p].into_iter().for_each(|part| own.numbers.extend_from_slice(part));
        own.angles.clone_from(&s.angles);
        own.internal.clone_from(&s.internal);
        self.used += 1;
    }

    /// How many steps are recorded.
    pub(crate) fn len(&self) -> usize {
        self.used
    }

    /// A recorded step, by its place.
    pub(crate) fn at(&mut self, k: usize) -> Taken<'_> {
        let Self { steps, s, none, .. } = self;
        let Recorded { step, times: [t, h, t_end], numbers, angles, internal } = &steps[k];
        let n = numbers.len() / 4;
        if s.dim() != n {
            (*s, *none) = (Interval::new(n), vec![0.0; n]);
        }
        s.open_start(*t, *h, &numbers[..n], none);
        s.end_at(*t_end);
        s.q1.copy_from_slice(&numbers[n..2 * n]);
        s.dq.copy_from_slice(&numbers[2 * n..3 * n]);
        s.close();
        s.angles.extend_from_slice(angles);
        s.internal.extend_from_slice(internal);
        Taken { step: *step, s, p: &numbers[3 * n..] }
    }

    /// What a recorded sub-step of `n` coordinates takes, bytes.
    pub(crate) fn size(n: usize, angles: usize, internal: usize) -> usize {
        size_of::<Recorded>() + size_of::<f64>() * (4 * n + angles + internal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_comes_back_as_it_was() {
        let mut s = Interval::between(0.3, 0.1, &[1.0, 2.0], &[1.5, 1.0]);
        s.end_at(0.4 + 1e-16);
        s.angles.push(7.0);
        s.internal.push(0.2);
        let mut tape = Tape::default();
        tape.push(4, &s, &[3.0, -1.0]);
        tape.push(5, &Interval::between(0.4, 0.1, &[0.0; 2], &[1.0; 2]), &[0.0; 2]);
        for _ in 0..2 {
            assert_eq!(tape.at(1).step, 5);
            let Taken { step, s: own, p } = tape.at(0);
            assert_eq!((step, own, p), (4, &s, &[3.0, -1.0][..]));
            assert_eq!(own.t_end().to_bits(), s.t_end().to_bits());
        }
    }
}
