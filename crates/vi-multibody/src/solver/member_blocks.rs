//! A matrix `K` over the coordinates of frames and point masses as blocks `P_inᵀ K P_in'`, one for
//! each pair of coupled members.
//!
//! ```text
//! m I_3 between d_I and d_J':    d̂_I (−d̂_J') = (d_I·d_J') I − d_J' d_Iᵀ
//! A Bᵀ:                          (P_inᵀ A) (P_in'ᵀ B)ᵀ
//! ```
//! Masses are multiples of `I_3`, stiffnesses of elements outer products of strain gradients; both
//! are reduced before they are added, or come reduced. What comes entry by entry is first collected
//! in a dense block. The first emission finds the blocks; every later one is replayed into them,
//! without a search.
#![allow(non_snake_case)] // A, B, K, P

use nalgebra::{Matrix6, Vector3, Vector6};
use pulp::Arch;
use vi_core::sparse::{Entries, OuterProduct};

/// The coordinates of a member in `q`: 12 of a frame, 2 or 3 of a point mass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    /// The first.
    pub(crate) first: usize,
    /// How many.
    pub(crate) size: usize,
}

/// Coordinates of a frame.
const FRAME: usize = 12;

impl Span {
    /// `P_inᵀ w` of a frame (force and torque), `w` of a point mass; `w(i)`: i-th component.
    #[inline]
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

/// A block of `K`: rows of one member, columns of another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockCoupling {
    /// The member of its rows.
    pub(crate) row: usize,
    /// The member of its columns.
    pub(crate) column: usize,
    values: Option<usize>, // where its entries start, column by column, if there are any
}

/// What an emission was found to be.
#[derive(Clone, Copy, Debug)]
enum EmissionSlot {
    /// An entry, at this place in `values`.
    Entry(usize),
    /// A multiple of `I_3` between two vectors of frames, in this block.
    Multiple(usize),
    /// An outer product of rows of frames, in the blocks listed from this place on.
    Outer(usize),
}

/// `P_inᵀ K P_in'` as blocks; every member has one of its own.
#[derive(Debug, Default)]
pub(crate) struct MemberBlocks {
    spans: Vec<Span>,
    couplings: Vec<BlockCoupling>,
    slots: Vec<EmissionSlot>, // of each emission
    outer: Vec<usize>,        // blocks of outer products, by rows
    values: Vec<f64>,         // entries of K
    reduced: Vec<Matrix6<f64>>,
    factors: [Vec<[f64; 6]>; 2], // scratch  P_inᵀ A, P_in'ᵀ B
}

/// A place of the first emission.
enum EmittedTerm {
    Entry(usize, usize),
    Multiple(usize, usize),
    Outer(Vec<usize>),
}

/// Collects the places of the first emission.
struct TermCollector<'a> {
    member_of: &'a [usize],
    spans: &'a [Span],
    places: Vec<EmittedTerm>,
    widest: usize, // rows of factors
}

impl TermCollector<'_> {
    fn is_frame(&self, coordinate: usize) -> bool {
        self.spans[self.member_of[coordinate]].size == FRAME
    }
}

impl Entries for TermCollector<'_> {
    fn add(&mut self, row: usize, column: usize, _value: f64) {
        self.places.push(EmittedTerm::Entry(row, column));
    }

    fn add_multiple(&mut self, row: usize, column: usize, value: f64) {
        let is_vector = |at: usize| {
            self.is_frame(at) && (at - self.spans[self.member_of[at]].first).is_multiple_of(3)
        };
        if is_vector(row) && is_vector(column) {
            self.places.push(EmittedTerm::Multiple(row, column));
        } else {
            (0..3).for_each(|k| self.add(row + k, column + k, value));
        }
    }

    fn add_outer(&mut self, product: &OuterProduct<'_>) {
        let starts_frame =
            |at: &usize| self.is_frame(*at) && self.spans[self.member_of[*at]].first == *at;
        if product.length == FRAME && product.starts.iter().all(starts_frame) {
            self.widest = self.widest.max(product.left.len() / FRAME);
            self.places.push(EmittedTerm::Outer(product.starts.to_vec()));
        } else {
            product.for_each_entry(|row, column, value| self.add(row, column, value));
        }
    }
}

struct TermReplay<'a> {
    values: &'a mut [f64],
    reduced: &'a mut [Matrix6<f64>],
    outer: &'a [usize],
    factors: &'a mut [Vec<[f64; 6]>; 2],
    slots: &'a [EmissionSlot],
    next: usize,
    q: [&'a [f64]; 2], // where P_in, P_in' are taken
}

impl TermReplay<'_> {
    fn next(&mut self) -> EmissionSlot {
        self.next += 1;
        self.slots[self.next - 1]
    }

    fn peek(&self) -> EmissionSlot {
        self.slots[self.next]
    }
}

/// The director that starts at coordinate `at` of a frame; `None` for the centre.
fn director(q: &[f64], at: usize) -> Option<Vector3<f64>> {
    (!at.is_multiple_of(FRAME)).then(|| Vector3::new(q[at], q[at + 1], q[at + 2]))
}

impl Entries for TermReplay<'_> {
    fn add(&mut self, _row: usize, _column: usize, value: f64) {
        if let EmissionSlot::Entry(place) = self.next() {
            self.values[place] += value;
        }
    }

    fn add_multiple(&mut self, row: usize, column: usize, value: f64) {
        let EmissionSlot::Multiple(block) = self.peek() else {
            (0..3).for_each(|k| self.add(row + k, column + k, value));
            return;
        };
        self.next += 1;
        let [left, right] = self.q;
        add_multiple(value, director(left, row), director(right, column), &mut self.reduced[block]);
    }

    fn add_outer(&mut self, product: &OuterProduct<'_>) {
        let EmissionSlot::Outer(first) = self.peek() else {
            product.for_each_entry(|row, column, value| self.add(row, column, value));
            return;
        };
        self.next += 1;
        let runs = product.starts.len();
        let count = product.left.len() / FRAME;
        let [left, right] = &mut *self.factors;
        let sides =
            [(product.left, self.q[0], &mut *left), (product.right, self.q[1], &mut *right)];
        for (columns, q, out) in sides {
            for (k, (own, out)) in columns.chunks_exact(FRAME).zip(out).enumerate() {
                let first = product.starts[k % runs];
                *out = Span { first, size: FRAME }.shrink(q, |i| own[i]).into();
            }
        }
        let sides = [&left[..count], &right[..count]];
        add_products(sides, runs, &self.outer[first..], self.reduced);
    }

    /// Of frames, where `P_in` and `P_in'` are taken at these coordinates.
    fn reduces_at(&self, starts: &[usize], at: [&[f64]; 2]) -> bool {
        let holds = |(q, at): (&[f64], &[f64])| {
            starts.iter().zip(at.chunks_exact(FRAME)).all(|(first, at)| q[*first..][..FRAME] == *at)
        };
        matches!(self.peek(), EmissionSlot::Outer(_)) && self.q.into_iter().zip(at).all(holds)
    }

    fn add_reduced(&mut self, product: &OuterProduct<'_>) {
        let EmissionSlot::Outer(first) = self.next() else { return };
        let sides = [product.left, product.right].map(|own| own.as_chunks().0);
        add_products(sides, product.starts.len(), &self.outer[first..], self.reduced);
    }
}

/// `B ← B + Σ a bᵀ` in the blocks between the runs of reduced columns.
fn add_products(
    [left, right]: [&[[f64; 6]]; 2],
    runs: usize,
    blocks: &[usize],
    reduced: &mut [Matrix6<f64>],
) {
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for (at, block) in blocks[..runs * runs].iter().enumerate() {
                let (a, b) = (at / runs, at % runs);
                let mut sums = reduced[*block].data.0;
                for (left, right) in left.chunks_exact(runs).zip(right.chunks_exact(runs)) {
                    let (left, right) = (&left[a], &right[b]);
                    for (sums, right) in sums.iter_mut().zip(right) {
                        sums.iter_mut().zip(left).for_each(|(sum, left)| *sum += left * right);
                    }
                }
                reduced[*block].data.0 = sums;
            }
        },
    );
}

/// Adds what `value I_3` is between the vectors `a` and `b` of two frames; `None`: the centre.
#[inline]
fn add_multiple(
    value: f64,
    a: Option<Vector3<f64>>,
    b: Option<Vector3<f64>>,
    B: &mut Matrix6<f64>,
) {
    match (a, b) {
        (None, None) => (0..3).for_each(|k| B[(k, k)] += value),
        (None, Some(b)) => add_skew(-value, &b, [0, 3], B),
        (Some(a), None) => add_skew(value, &a, [3, 0], B),
        (Some(a), Some(b)) => {
            let (a, dot) = (value * a, value * a.dot(&b));
            for j in 0..3 {
                for i in 0..3 {
                    B[(3 + i, 3 + j)] -= b[i] * a[j];
                }
                B[(3 + j, 3 + j)] += dot;
            }
        }
    }
}

/// `B ← B + value v̂` with its upper left corner at `(row, column)`.
fn add_skew(value: f64, v: &Vector3<f64>, [row, column]: [usize; 2], B: &mut Matrix6<f64>) {
    for k in 0..3 {
        let (l, m) = ((k + 1) % 3, (k + 2) % 3);
        B[(row + m, column + l)] += value * v[k];
        B[(row + l, column + m)] -= value * v[k];
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
        let mut found =
            TermCollector { member_of: &member_of, spans, places: Vec::new(), widest: 0 };
        emit(&mut found);
        let (places, widest) = (found.places, found.widest);
        let mut pairs: Vec<(usize, usize)> = (0..spans.len()).map(|k| (k, k)).collect();
        let mut note = |row: usize, column: usize| {
            let pair = (member_of[row], member_of[column]);
            if pair.0 != pair.1 && pairs.last() != Some(&pair) {
                pairs.push(pair);
            }
        };
        for place in &places {
            match place {
                EmittedTerm::Entry(row, column) | EmittedTerm::Multiple(row, column) => {
                    note(*row, *column)
                }
                EmittedTerm::Outer(starts) => {
                    starts.iter().for_each(|row| starts.iter().for_each(|c| note(*row, *c)));
                }
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let coupling = |(row, column)| BlockCoupling { row, column, values: None };
        self.couplings = pairs.into_iter().map(coupling).collect();
        self.spans = spans.to_vec();
        self.find_slots(&member_of, &places);
        self.reduced = vec![Matrix6::zeros(); self.couplings.len()];
        self.factors = [0, 1].map(|_| vec![[0.0; 6]; widest]);
    }

    fn find_slots(&mut self, member_of: &[usize], places: &[EmittedTerm]) {
        let Self { spans, couplings, slots, outer, values, .. } = self;
        let mut first = vec![0; spans.len()]; // block of each row
        (0..couplings.len()).rev().for_each(|k| first[couplings[k].row] = k);
        first.push(couplings.len());
        let block = |couplings: &[BlockCoupling], row: usize, column: usize| {
            let (a, b) = (member_of[row], member_of[column]);
            let own = &couplings[first[a]..first[a + 1]];
            first[a] + own.partition_point(|coupling| coupling.column < b)
        };
        let mut length = 0;
        for place in places {
            slots.push(match place {
                EmittedTerm::Multiple(row, column) => {
                    EmissionSlot::Multiple(block(couplings, *row, *column))
                }
                EmittedTerm::Outer(starts) => {
                    let at = outer.len();
                    for row in starts {
                        outer.extend(starts.iter().map(|column| block(couplings, *row, *column)));
                    }
                    EmissionSlot::Outer(at)
                }
                EmittedTerm::Entry(row, column) => {
                    let k = block(couplings, *row, *column);
                    let (a, b) = (&spans[couplings[k].row], &spans[couplings[k].column]);
                    let start = *couplings[k].values.get_or_insert_with(|| {
                        length += a.size * b.size;
                        length - a.size * b.size
                    });
                    EmissionSlot::Entry(start + row - a.first + (column - b.first) * a.size)
                }
            });
        }
        *values = vec![0.0; length];
    }

    /// Takes `K` as emitted, always the same places in the same order, between `P_in(q)` and
    /// `P_in(q')`.
    pub(crate) fn fill(&mut self, emit: &dyn Fn(&mut dyn Entries), q: (&[f64], &[f64])) {
        let Self { values, reduced, outer, factors, slots, .. } = self;
        values.fill(0.0);
        reduced.fill(Matrix6::zeros());
        let q = [q.0, q.1];
        emit(&mut TermReplay { values, reduced, outer, factors, slots, next: 0, q });
        for (coupling, own) in self.couplings.iter().zip(&mut self.reduced) {
            if let Some(first) = coupling.values {
                let spans = [coupling.row, coupling.column].map(|k| &self.spans[k]);
                *own += reduced_entries(&self.values[first..], spans, q);
            }
        }
    }

    /// The blocks, by rows, then by columns.
    pub(crate) fn couplings(&self) -> &[BlockCoupling] {
        &self.couplings
    }

    /// The blocks `P_in(q)ᵀ K_ab P_in(q')` last filled, 6×6 (fewer rows and columns count for point
    /// masses).
    pub(crate) fn reduced(&self) -> impl Iterator<Item = (&BlockCoupling, &Matrix6<f64>)> {
        self.couplings.iter().zip(&self.reduced)
    }
}

/// `P_in(q)ᵀ K_ab P_in(q')` of a dense block, column by column.
fn reduced_entries(K: &[f64], [a, b]: [&Span; 2], [q, q_right]: [&[f64]; 2]) -> Matrix6<f64> {
    let mut rows = [Vector6::zeros(); FRAME]; // K_ab P_in(q')
    for (i, row) in rows.iter_mut().enumerate().take(a.size) {
        *row = b.shrink(q_right, |j| K[i + j * a.size]);
    }
    let mut B = Matrix6::zeros();
    for j in 0..6 {
        B.set_column(j, &a.shrink(q, |i| rows[i][j]));
    }
    B
}
