//! The (sub-)steps of a run, recorded: what the others of their quantities follow from.

use vi_core::interval::Interval;

/// A (sub-)step with the momentum where it starts.
#[derive(Debug, Default)]
struct Recorded {
    step: usize,        // macro step
    shape: [usize; 2],  // n, s
    times: [f64; 3],    // t_n, h, t_{n+1}
    numbers: Vec<f64>,  // q_n, q_{n+1}, the momentum that is held, Δ_1 … Δ_s; n each
    angles: Vec<f64>,   // at q_n
    internal: Vec<f64>, // at q_n
}

/// A recorded step.
#[derive(Debug)]
pub(crate) struct Taken<'a> {
    pub(crate) step: usize,            // macro step
    pub(crate) points: &'a [Interval], // (q_n, q_j), j = 1 … s; the last is the step
    pub(crate) p: &'a [f64],           // n  the momentum that is held where it starts
}

/// Steps in the order of time; keeps the memory of those that are taken off.
#[derive(Debug, Default)]
pub(crate) struct Tape {
    steps: Vec<Recorded>,
    used: usize,
    points: Vec<Interval>,
    none: Vec<f64>, // n
}

impl Tape {
    pub(crate) fn clear(&mut self) {
        self.used = 0;
    }

    /// Records a sub-step by its control points from a node with the momentum `p`.
    pub(crate) fn push(&mut self, step: usize, points: &[Interval], p: &[f64]) {
        if self.used == self.steps.len() {
            self.steps.push(Recorded::default());
        }
        let (own, s) = (&mut self.steps[self.used], &points[points.len() - 1]);
        (own.step, own.shape) = (step, [s.dim(), points.len()]);
        own.times = [s.t, s.h, s.t_end()];
        own.numbers.clear();
        let increments = points.iter().map(|point| &point.dq[..]);
        let all = [&s.q0, &s.q1, p].into_iter().chain(increments);
        all.for_each(|part| own.numbers.extend_from_slice(part));
        own.angles.clone_from(&s.angles);
        own.internal.clone_from(&s.internal);
        self.used += 1;
    }

    /// What a recorded sub-step of `n` coordinates with so many control points after `q_n` takes,
    /// bytes.
    pub(crate) fn size(n: usize, stages: usize, angles: usize, internal: usize) -> usize {
        size_of::<Recorded>() + size_of::<f64>() * ((3 + stages) * n + angles + internal)
    }

    /// How many steps are recorded.
    pub(crate) fn len(&self) -> usize {
        self.used
    }

    /// The macro step of a recorded step, by its place.
    pub(crate) fn step(&self, k: usize) -> usize {
        self.steps[k].step
    }

    /// A recorded step, by its place.
    pub(crate) fn at(&mut self, k: usize) -> Taken<'_> {
        let Self { steps, points, none, .. } = self;
        let Recorded { step, shape, times: [t, h, t_end], numbers, angles, internal } = &steps[k];
        let [n, count] = *shape;
        if points.len() != count || none.len() != n {
            (*points, *none) = (vec![Interval::new(n); count], vec![0.0; n]);
        }
        let (ends, increments) = numbers.split_at(3 * n);
        for (point, dq) in points.iter_mut().zip(increments.chunks_exact(n.max(1))) {
            point.dq.copy_from_slice(dq);
        }
        let s = points.last_mut().expect("a step has an end");
        s.open_start(*t, *h, &ends[..n], none);
        s.end_at(*t_end);
        s.q1.copy_from_slice(&ends[n..2 * n]);
        s.close();
        s.angles.extend_from_slice(angles);
        s.internal.extend_from_slice(internal);
        Taken { step: *step, points, p: &ends[2 * n..] }
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
        let inner = Interval::between(0.3, 0.05, &[1.0, 2.0], &[1.2, 1.1]);
        tape.push(4, &[inner.clone(), s.clone()], &[3.0, -1.0]);
        let other = Interval::between(0.4, 0.1, &[0.0; 2], &[1.0; 2]);
        tape.push(5, std::slice::from_ref(&other), &[0.0; 2]);
        for _ in 0..2 {
            assert_eq!(tape.at(1).step, 5);
            let taken = tape.at(0);
            let own = taken.points.last().unwrap();
            assert_eq!((taken.step, own, taken.p), (4, &s, &[3.0, -1.0][..]));
            assert_eq!(own.t_end().to_bits(), s.t_end().to_bits());
            assert_eq!(taken.points[0].dq, inner.dq);
        }
    }
}
