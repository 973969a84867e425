//! The (sub-)steps of a run, recorded: what the others of their quantities follow from.

use vi_core::interval::Interval;

/// A (sub-)step with the momentum where it starts.
#[derive(Debug)]
struct TapeStep {
    step: usize,       // macro step
    shape: [usize; 4], // n, s, angles, internal variables
    times: [f64; 3],   // t_n, h, t_{n+1}
    first: usize,      // of its numbers: q_n, the held momentum, Δ_1 … Δ_s, angles, z_n, q_{n+1}
}

/// A recorded step.
#[derive(Debug)]
pub(crate) struct Taken<'a> {
    pub(crate) step: usize,            // macro step
    pub(crate) points: &'a [Interval], // (q_n, q_j), j = 1 … s; the last is the step
    pub(crate) p: &'a [f64],           // n  the momentum that is held where it starts
}

/// Steps in the order of time; keeps its memory. A configuration where one ends and the next
/// begins is kept once.
#[derive(Debug, Default)]
pub(crate) struct Tape {
    steps: Vec<TapeStep>,
    numbers: Vec<f64>,
    points: Vec<Interval>,
    none: Vec<f64>, // n
}

impl Tape {
    pub(crate) fn clear(&mut self) {
        self.steps.clear();
        self.numbers.clear();
    }

    /// Makes room for so many steps of one part each, as [`Tape::size`] has them.
    pub(crate) fn reserve(&mut self, steps: usize, [n, stages, angles, internal]: [usize; 4]) {
        self.steps.reserve(steps);
        self.numbers.reserve(steps * ((2 + stages) * n + angles + internal) + n);
    }

    /// Records a sub-step by its control points from a node with the momentum `p`.
    pub(crate) fn push(&mut self, step: usize, points: &[Interval], p: &[f64]) {
        let s = &points[points.len() - 1];
        let last = self.numbers.len().checked_sub(s.dim());
        let is_same = |k: &usize| {
            let mut pairs = self.numbers[*k..].iter().zip(&s.q0);
            pairs.all(|(a, b)| a.to_bits() == b.to_bits())
        };
        let first = last.filter(is_same).unwrap_or_else(|| {
            let end = self.numbers.len();
            self.numbers.extend_from_slice(&s.q0);
            end
        });
        self.steps.push(TapeStep {
            step,
            shape: [s.dim(), points.len(), s.angles.len(), s.internal.len()],
            times: [s.t, s.h, s.t_end()],
            first,
        });
        let increments = points.iter().map(|point| &point.dq[..]);
        let others = [&s.angles[..], &s.internal, &s.q1];
        let all = std::iter::once(p).chain(increments).chain(others);
        all.for_each(|part| self.numbers.extend_from_slice(part));
    }

    /// What a recorded sub-step of `n` coordinates with so many control points after `q_n` takes,
    /// bytes.
    pub(crate) fn size(n: usize, stages: usize, angles: usize, internal: usize) -> usize {
        size_of::<TapeStep>() + size_of::<f64>() * ((2 + stages) * n + angles + internal)
    }

    /// How many steps are recorded.
    pub(crate) fn len(&self) -> usize {
        self.steps.len()
    }

    /// The macro step of a recorded step, by its place.
    pub(crate) fn step(&self, k: usize) -> usize {
        self.steps[k].step
    }

    /// `Δq` of a recorded step, by its place.
    pub(crate) fn increments(&self, k: usize) -> &[f64] {
        let TapeStep { shape: [n, count, ..], first, .. } = self.steps[k];
        let first = first + (1 + count) * n;
        &self.numbers[first..first + n]
    }

    /// A recorded step, by its place.
    pub(crate) fn at(&mut self, k: usize) -> Taken<'_> {
        let Self { steps, numbers, points, none } = self;
        let TapeStep { step, shape, times: [t, h, t_end], first } = steps[k];
        let [n, count, angles, internal] = shape;
        if points.len() != count || none.len() != n {
            (*points, *none) = (vec![Interval::new(n); count], vec![0.0; n]);
        }
        let (start, rest) = numbers[first..].split_at(n);
        let (p, rest) = rest.split_at(n);
        let (increments, rest) = rest.split_at(count * n);
        let (angles, rest) = rest.split_at(angles);
        let (internal, rest) = rest.split_at(internal);
        for (point, dq) in points.iter_mut().zip(increments.chunks_exact(n.max(1))) {
            point.dq.copy_from_slice(dq);
        }
        let s = points.last_mut().expect("a step has an end");
        s.open_start(t, h, start, none);
        s.end_at(t_end);
        s.q1.copy_from_slice(&rest[..n]);
        s.close();
        s.angles.extend_from_slice(angles);
        s.internal.extend_from_slice(internal);
        Taken { step, points, p }
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
        let numbers = tape.numbers.len();
        let next = Interval::between(0.5, 0.1, &other.q1, &[2.0; 2]);
        tape.push(6, std::slice::from_ref(&next), &[0.5; 2]);
        assert_eq!(tape.numbers.len() - numbers, 6, "where a step ends and the next one begins");
        for _ in 0..2 {
            let last = tape.at(2);
            assert_eq!((last.points, last.p), (std::slice::from_ref(&next), &[0.5; 2][..]));
            let middle = tape.at(1);
            assert_eq!((middle.step, middle.points), (5, std::slice::from_ref(&other)));
            let taken = tape.at(0);
            let own = taken.points.last().unwrap();
            assert_eq!((taken.step, own, taken.p), (4, &s, &[3.0, -1.0][..]));
            assert_eq!(own.t_end().to_bits(), s.t_end().to_bits());
            assert_eq!(taken.points[0].dq, inner.dq);
            assert_eq!((tape.increments(0), tape.increments(2)), (&s.dq[..], &next.dq[..]));
        }
    }
}
