//! A matrix `K` over the coordinates of frames and point masses as dense blocks, one for each pair of coupled members.
//!
//! The first emission finds the blocks; every later one is replayed into them, without a search.
#![allow(non_snake_case)] // K, B

use nalgebra::{Matrix6, Vector6};
use vi_core::sparse::Entries;

/// The coordinates of a member in `q`: 12 of a frame, 2 or 3 of a point mass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    /// The first.
    pub(crate) first: usize,
    /// How many.
    pub(crate) size: usize,
}

impl Span {
    /// `P_inᵀ w` of a frame (force and torque), `w` of a point mass; `w(i)`: i-th component.
    pub(crate) fn shrink(&self, q: &[f64], w: impl Fn(usize) -> f64) -> Vector6<f64> {
        let mut out = Vector6::zeros();
        (0..self.size.min(3)).for_each(|i| out[i] = w(i));
        for i in (3..self.size).step_by(3) {
            let d = &q[self.first + i..self.first + i + 3];
            let w = [w(i), w(i + 1), w(i + 2)];
            for k in 0..3 {
                let (l, m) = ((k + 1) % 3, (k + 2) % 3);
                out[3 + k] += d[l] * w[m] - d[m] * w[l];
            }
        }
        out
    }
}

/// A dense block of `K`: rows of one member, columns of another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coupling {
    /// The member of its rows.
    pub(crate) row: usize,
    /// The member of its columns.
    pub(crate) column: usize,
    values: usize, // where its values start, column by column
}

/// `K` as dense blocks; every member has one of its own.
#[derive(Debug, Default)]
pub(crate) struct MemberBlocks {
    couplings: Vec<Coupling>,
    slots: Vec<usize>, // k-th emitted entry → place in `values`
    values: Vec<f64>,
}

/// Collects the places of the first emission.
struct Places(Vec<(usize, usize)>);

impl Entries for Places {
    fn add(&mut self, row: usize, column: usize, _value: f64) {
        self.0.push((row, column));
    }
}

struct Replay<'a> {
    values: &'a mut [f64],
    slots: std::slice::Iter<'a, usize>,
}

impl Entries for Replay<'_> {
    fn add(&mut self, _row: usize, _column: usize, value: f64) {
        let slot = self.slots.next().expect("as many entries as at the first emission");
        self.values[*slot] += value;
    }
}

impl MemberBlocks {
    /// Whether no emission was seen yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.couplings.is_empty()
    }

    /// Finds the blocks of a matrix over `n` coordinates: by rows, then by columns of members.
    pub(crate) fn analyse(&mut self, n: usize, spans: &[Span], emit: &dyn Fn(&mut dyn Entries)) {
        let mut member_of = vec![usize::MAX; n];
        for (k, span) in spans.iter().enumerate() {
            member_of[span.first..span.first + span.size].fill(k);
        }
        let mut places = Places(Vec::new());
        emit(&mut places);
        let pair = |&(row, column): &(usize, usize)| (member_of[row], member_of[column]);
        let mut pairs: Vec<(usize, usize)> = (0..spans.len()).map(|k| (k, k)).collect();
        let mut last = None;
        for pair in places.0.iter().map(pair).filter(|(row, column)| row != column) {
            if last != Some(pair) {
                pairs.push(pair);
                last = Some(pair);
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let mut length = 0;
        for (row, column) in pairs {
            self.couplings.push(Coupling { row, column, values: length });
            length += spans[row].size * spans[column].size;
        }
        let mut first = vec![0; spans.len()]; // block of each row
        (0..self.couplings.len()).rev().for_each(|k| first[self.couplings[k].row] = k);
        first.push(self.couplings.len());
        let slot = |place: &(usize, usize)| {
            let (a, b) = pair(place);
            let own = &self.couplings[first[a]..first[a + 1]];
            let block = &own[own.partition_point(|coupling| coupling.column < b)];
            block.values + place.0 - spans[a].first + (place.1 - spans[b].first) * spans[a].size
        };
        self.slots = places.0.iter().map(slot).collect();
        self.values = vec![0.0; length];
    }

    /// Takes `K` as emitted: always the same places in the same order.
    pub(crate) fn fill(&mut self, emit: &dyn Fn(&mut dyn Entries)) {
        self.values.fill(0.0);
        emit(&mut Replay { values: &mut self.values, slots: self.slots.iter() });
    }

    /// The blocks, by rows, then by columns.
    pub(crate) fn couplings(&self) -> &[Coupling] {
        &self.couplings
    }

    /// `P_in(q)ᵀ K_ab P_in(q')`, 6×6 (fewer rows and columns count for point masses).
    pub(crate) fn reduced(
        &self,
        coupling: &Coupling,
        spans: (&Span, &Span),
        (q, q_right): (&[f64], &[f64]),
    ) -> Matrix6<f64> {
        let ((a, b), K) = (spans, &self.values[coupling.values..]);
        let mut rows = [Vector6::zeros(); 12]; // K_ab P_in(q')
        for (i, row) in rows.iter_mut().enumerate().take(a.size) {
            *row = b.shrink(q_right, |j| K[i + j * a.size]);
        }
        let mut B = Matrix6::zeros();
        for j in 0..6 {
            B.set_column(j, &a.shrink(q, |i| rows[i][j]));
        }
        B
    }
}

/// A power of two near `|x|^{−1/2}`; 1 where there is none.
pub(crate) fn inverse_root(x: f64) -> f64 {
    let size = x.abs();
    let usable = size.is_finite() && size > f64::MIN_POSITIVE;
    if usable { libm::exp2((-0.5 * libm::log2(size)).round()) } else { 1.0 }
}
