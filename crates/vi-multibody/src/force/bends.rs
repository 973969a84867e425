//! Second derivatives of the forces of laws.
//!
//! ```text
//! φ = Σ_k τ_k(y) a_k         a_k = Σ e_k·Y over the ends of a step,   e_k·z at a node
//! ∂_i∂_jφ = Σ_lm (Σ_k a_k ∂²τ_k/∂y_l∂y_m) ∂_iy_l ∂_jy_mᵀ + Σ_l (Σ_k a_k ∂τ_k/∂y_l) ∂_i∂_jy_l          [2.55]
//!         + Σ_k (∂_iτ_k ∂_ja_kᵀ + ∂_ia_k ∂_jτ_kᵀ + τ_k ∂_i∂_ja_k)
//! ```
//! `i`, `j`: both ends of a step, or positions and velocities at a node. `y`: what a law reads,
//! `e_k`: what its efforts act along.

use nalgebra::DMatrix;
use vi_core::interval::{Interval, Slot};
use vi_core::sparse::{Entries, Product};

/// Where second derivatives are taken, and of which two groups of coordinates.
#[derive(Clone, Copy, Debug)]
pub(in crate::force) enum Between<'a> {
    /// Both ends of a step.
    Ends(&'a Interval),
    /// Positions and velocities at a node.
    Node {
        /// `q`.
        q: &'a [f64],
        /// `v`.
        v: &'a [f64],
    },
}

impl<'a> Between<'a> {
    /// Positions and velocities that midpoints read.
    pub(in crate::force) fn middle(&self) -> [&'a [f64]; 2] {
        match *self {
            Self::Ends(s) => [&s.q_mid, &s.v_mid],
            Self::Node { q, v } => [q, v],
        }
    }

    /// How these change with a group of coordinates.
    pub(in crate::force) fn parts(&self, group: usize) -> [f64; 2] {
        match self {
            Self::Ends(s) => [0.5, Slot::BOTH[group].sign() / s.h],
            Self::Node { .. } => [[1.0, 0.0], [0.0, 1.0]][group],
        }
    }

    /// The positions of which a number has second derivatives by both groups, where it is one of
    /// the positions of an end or a node alone.
    pub(in crate::force) fn positions(&self, [i, j]: [usize; 2]) -> Option<&'a [f64]> {
        match *self {
            Self::Ends(s) => (i == j).then(|| s.node(Slot::BOTH[i])),
            Self::Node { q, .. } => (i + j == 0).then_some(q),
        }
    }

    /// The factors of `∂_q∂_q`, `∂_q∂_v`, `∂_v∂_q`, `∂_v∂_v` at the midpoint in `∂_i∂_j`.
    pub(in crate::force) fn factors(&self, [i, j]: [usize; 2]) -> [f64; 4] {
        let ([a, b], [c, d]) = (self.parts(i), self.parts(j));
        [a * c, a * d, b * c, b * d]
    }
}

/// What efforts act along.
pub(in crate::force) trait Pushes {
    /// `a_k`.
    fn along(&self, at: Between<'_>, y: [&[f64]; 2], k: usize) -> f64;
    /// `∂_i a_k`, shape `n`.
    fn slope(&self, at: Between<'_>, y: [&[f64]; 2], k: usize, group: usize) -> Vec<f64>;
    /// Emits `scale Σ_k τ_k ∂_i∂_j a_k`; `efforts`: `τ` and `scale`.
    fn emit_second(
        &self,
        at: Between<'_>,
        y: [&[f64]; 2],
        efforts: (&[f64], f64),
        groups: [usize; 2],
        out: &mut dyn Entries,
    );
}

/// What a law reads.
pub(in crate::force) trait Reads {
    /// How many numbers.
    fn count(&self) -> usize;
    /// The entries of `∂_i y_l`.
    fn slope(&self, at: Between<'_>, l: usize, group: usize) -> Vec<(usize, f64)>;
    /// Whether it goes with `1/h` in a step.
    fn is_rate(&self, l: usize) -> bool;
    /// Emits `Σ_l w_l ∂_i∂_j y_l`.
    fn emit_second(&self, at: Between<'_>, w: &[f64], groups: [usize; 2], out: &mut dyn Entries);
}

/// `∂y/∂h`: `−y/h` of rates, else zero.
fn by_length(reads: &(impl Reads + ?Sized), y: &[f64], h: f64) -> Vec<f64> {
    let own = |(l, y): (usize, &f64)| if reads.is_rate(l) { -y / h } else { 0.0 };
    y.iter().enumerate().map(own).collect()
}

/// A law at one place.
pub(in crate::force) struct LawEvaluation<'a> {
    /// `y`.
    pub(in crate::force) values: &'a [f64],
    /// `τ`.
    pub(in crate::force) efforts: &'a [f64],
    /// `∂τ/∂y`.
    pub(in crate::force) slopes: &'a DMatrix<f64>,
    /// `Σ_k w_k ∂²τ_k/∂y² δy`, by `δy` and `w`.
    pub(in crate::force) bend: &'a dyn Fn(&[f64], &[f64], &mut [f64]),
}

impl LawEvaluation<'_> {
    /// Emits `scale ∂_i∂_jφ` [2.55].
    pub(in crate::force) fn emit(
        &self,
        (reads, pushes): (&(impl Reads + ?Sized), &dyn Pushes),
        (at, y): (Between<'_>, [&[f64]; 2]),
        (groups, scale): ([usize; 2], f64),
        out: &mut dyn Entries,
    ) {
        let (efforts, inputs) = (self.efforts.len(), reads.count());
        let along: Vec<f64> = (0..efforts).map(|k| pushes.along(at, y, k)).collect();
        let lists = groups.map(|i| (0..inputs).map(|l| reads.slope(at, l, i)).collect::<Vec<_>>());
        let mut outer = |rows: &[(usize, f64)], columns: &[(usize, f64)], factor: f64| {
            if factor == 0.0 {
                return;
            }
            for (i, a) in rows {
                columns.iter().for_each(|(j, b)| out.add(*i, *j, factor * a * b));
            }
        };
        let (mut by, mut bend) = (vec![0.0; inputs], vec![0.0; inputs]);
        for l in 0..inputs {
            by[l] = 1.0;
            (self.bend)(&by, &along, &mut bend);
            by[l] = 0.0;
            for m in 0..inputs {
                outer(&lists[0][l], &lists[1][m], scale * bend[m]);
            }
        }
        for k in 0..efforts {
            let turning = groups.map(|i| sparse(&pushes.slope(at, y, k, i)));
            for l in 0..inputs {
                let slope = scale * self.slopes[(k, l)];
                outer(&lists[0][l], &turning[1], slope);
                outer(&turning[0], &lists[1][l], slope);
            }
        }
        let of_input =
            |l: usize| scale * (0..efforts).map(|k| along[k] * self.slopes[(k, l)]).sum::<f64>();
        let weights: Vec<f64> = (0..inputs).map(of_input).collect();
        reads.emit_second(at, &weights, groups, out);
        pushes.emit_second(at, y, (self.efforts, scale), groups, out);
    }

    /// `q ← q + scale ∂²τ_k/∂q∂(q, v)` times `changes` of both, `of_v` likewise, at a node.
    pub(in crate::force) fn add(
        &self,
        reads: &(impl Reads + ?Sized),
        [q, v]: [&[f64]; 2],
        k: usize,
        scale: f64,
        changes: [&[f64]; 2],
        mut out: [&mut [f64]; 2],
    ) {
        let (at, inputs) = (Between::Node { q, v }, reads.count());
        let slopes: Vec<[Vec<(usize, f64)>; 2]> =
            (0..inputs).map(|l| [0, 1].map(|i| reads.slope(at, l, i))).collect();
        let dot =
            |list: &[(usize, f64)], x: &[f64]| list.iter().map(|(i, a)| a * x[*i]).sum::<f64>();
        let change =
            |own: &[Vec<(usize, f64)>; 2]| dot(&own[0], changes[0]) + dot(&own[1], changes[1]);
        let changed: Vec<f64> = slopes.iter().map(change).collect();
        let (mut w, mut bend) = (vec![0.0; self.efforts.len()], vec![0.0; inputs]);
        w[k] = scale;
        (self.bend)(&changed, &w, &mut bend);
        for (own, bend) in slopes.iter().zip(&bend) {
            for (list, out) in own.iter().zip(&mut out) {
                list.iter().for_each(|(i, a)| out[*i] += bend * a);
            }
        }
        let weights: Vec<f64> = (0..inputs).map(|l| scale * self.slopes[(k, l)]).collect();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let into = &mut Product { v: changes[j], out: &mut *out[i] };
            reads.emit_second(at, &weights, [i, j], into);
        }
    }

    /// [`vi_core::force::DiscreteForce::add_bend`].
    pub(in crate::force) fn emit_in_step(
        &self,
        (reads, pushes): (&(impl Reads + ?Sized), &dyn Pushes),
        s: &Interval,
        y: [&[f64]; 2],
        slots: [Slot; 2],
        out: &mut dyn Entries,
    ) {
        let groups = slots.map(|slot| usize::from(slot == Slot::Second));
        let at = (Between::Ends(s), y);
        self.emit((reads, pushes), at, (groups, 0.5 * s.h), out);
    }

    /// [`vi_core::force::LengthBends::add_slope_by_length`] of `(h/2) φ` [2.58]:
    ///
    /// ```text
    /// ½ ∂_iφ + (h/2) Σ_l [ Σ_m (Σ_k a_k ∂²τ_k/∂y_l∂y_m) y_m,h ∂_iy_l
    ///                      + Σ_k ∂τ_k/∂y_l (y_l,h ∂_ia_k + a_k ∂_iy_l,h) ]
    /// y_l,h = −y_l/h,  ∂_iy_l,h = −∂_iy_l/h  of rates, 0 of others
    /// ```
    pub(in crate::force) fn add_slope_by_length(
        &self,
        (reads, pushes): (&(impl Reads + ?Sized), &dyn Pushes),
        (s, y): (&Interval, [&[f64]; 2]),
        by: Slot,
        out: &mut [f64],
    ) {
        let moved = &by_length(reads, self.values, s.h);
        let (at, group) = (Between::Ends(s), usize::from(by == Slot::Second));
        let efforts = self.efforts.len();
        let along: Vec<f64> = (0..efforts).map(|k| pushes.along(at, y, k)).collect();
        let mut bend = vec![0.0; reads.count()];
        (self.bend)(moved, &along, &mut bend);
        for (l, bend) in bend.iter().enumerate() {
            let slope: f64 = (0..efforts).map(|k| along[k] * self.slopes[(k, l)]).sum();
            let own = if reads.is_rate(l) { 0.0 } else { 0.5 * slope }; // of rates ½ − (h/2)/h
            let factor = own + 0.5 * s.h * bend;
            reads.slope(at, l, group).iter().for_each(|(i, own)| out[*i] += factor * own);
        }
        for k in 0..efforts {
            let turned: f64 =
                moved.iter().enumerate().map(|(l, by)| self.slopes[(k, l)] * by).sum();
            let factor = 0.5 * (self.efforts[k] + s.h * turned);
            let slope = pushes.slope(at, y, k, group);
            out.iter_mut().zip(&slope).for_each(|(out, own)| *out += factor * own);
        }
    }

    /// `∂²/∂h²` of it: `(h/2) Σ_lm (Σ_k a_k ∂²τ_k/∂y_l∂y_m) y_l,h y_m,h`.
    pub(in crate::force) fn second_by_length(
        &self,
        (reads, pushes): (&(impl Reads + ?Sized), &dyn Pushes),
        (s, y): (&Interval, [&[f64]; 2]),
    ) -> f64 {
        let moved = &by_length(reads, self.values, s.h);
        let at = Between::Ends(s);
        let along: Vec<f64> = (0..self.efforts.len()).map(|k| pushes.along(at, y, k)).collect();
        let mut bend = vec![0.0; moved.len()];
        (self.bend)(moved, &along, &mut bend);
        0.5 * s.h * bend.iter().zip(moved).map(|(bend, by)| bend * by).sum::<f64>()
    }

    /// [`vi_core::force::DiscreteForce::add_gauss_bend`].
    pub(in crate::force) fn emit_at_node(
        &self,
        (reads, pushes): (&(impl Reads + ?Sized), &dyn Pushes),
        [q, v, z]: [&[f64]; 3],
        by: [f64; 4],
        out: &mut dyn Entries,
    ) {
        for (groups, scale) in [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().zip(by) {
            if scale != 0.0 {
                let at = (Between::Node { q, v }, [z; 2]);
                self.emit((reads, pushes), at, (groups, scale), out);
            }
        }
    }
}

fn sparse(x: &[f64]) -> Vec<(usize, f64)> {
    x.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect()
}
