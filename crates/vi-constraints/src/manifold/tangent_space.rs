//! The discrete reparametrization of any constraints: a step in the tangent space, brought back
//! along the normals.
//!
//! ```text
//! F_d(u, q_n) = q_n + P u + N ν(u),     g(t_{n+1}, F_d(u, q_n)) = 0              (1)
//! P = P(q_n), range N = range G(q_n)ᵀ,  [N P] orthogonal by pivoted QR
//! ν by Newton's method:                 (G N) δ = g,  ν ← ν − δ,                G = G(t_{n+1}, q)
//! ∂F_d/∂u = P − N (G N)⁻¹ G P           from (1) by the implicit function theorem, at q_{n+1}
//! ```
//! For `u = 0` without time in `g` this is `q_n`, and `range ∂F_d/∂u = null G(q_{n+1})`: all that
//! LMO08 (27) and (28) ask for. The rows of `g` are the independent ones of `q_n`; the columns of
//! `P` are those of the last node turned into the new tangent space, so that increments of
//! successive steps resemble one another. Within a step `ν` starts from its linear prediction and
//! is corrected only above round-off: a correction by round-off alone would stand in the way of the
//! balance, which is met more closely than `g`. A prediction whose error of second order is below
//! `ε ν` is as good as its base, so that the last iterations see a smooth map.
//!
//! **Domain.** The map is one-to-one up to the fold at which `G(q_{n+1}) N` loses rank (a quarter
//! turn of a bar). Each correction must be at most half of the one before: then the point found is
//! the one next to the tangent space and not another branch; else the step is refused with
//! [`Fault::Unsolved`]. A node at which the constraints have another rank than at the start is
//! refused with [`Fault::RankChanged`].
//!
//! **Cost.** `O(n³)` a step, dense: for small systems, and for those that have no map of their own.
//!
//! Letters: `P` null space matrix `n × d`, `N` normals `n × r`, `ν ∈ R^r`, `G` rows of the
//! constraint Jacobian.
//!
//! Source: tangent space parametrization of manifolds, F. A. Potra, J. Yen, Mech. Struct. Mach. 19
//! (1991); as a discrete null space method after LMO08 §3.
#![allow(non_snake_case)] // P, N, G

use crate::connected::groups;
use crate::constraints::Constraints;
use crate::null_space::NullSpaceQr;
use crate::reparametrization::{DenseNewton, Emission, LastStep, NodalOperators, pull_back};
use crate::saddle_point::IndependentRows;
use crate::unknowns;
use nalgebra::DMatrix;
use std::sync::Arc;
use vi_core::dense::{add_product, set_product};
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, norm_inf};
use vi_core::newton::{BlockKind, CLOSING_SIZE, Fault, Precision, UnknownBlock};
use vi_core::sparse::Entries;
use vi_core::state::Memory;

/// [`NodalOperators`] of any constraints.
#[derive(Debug)]
pub struct TangentSpace<C> {
    constraints: Arc<C>,
    blocks: [UnknownBlock; 1],
    qr: NullSpaceQr,
    jacobian: DMatrix<f64>, // m × n
    rows: Vec<usize>,       // r  constraints enforced
    P: DMatrix<f64>,        // n × d  of q_n
    N: DMatrix<f64>,        // n × r  of q_n
    last: DMatrix<f64>,     // n × d  scratch: P of the last node
    overlap: DMatrix<f64>,  // d × d  P(q_n)ᵀ P(q_{n−1})
    hands_on: bool,         // a balance, in the basis of this node
    turns: bool,            // the last step handed on a balance in the basis of its node
    carried: Vec<f64>,      // d
    refused: Option<Fault>, // at this node
    has_base: bool,         // ν is known nearby
    left: DMatrix<f64>,     // n × d  P(q_n), or the tangent of the last step
    tangent: DMatrix<f64>,  // n × d  ∂F_d/∂u
    newton: DenseNewton,
    projection: Projection,
    // n  coordinates that constraints connect have one number; empty until the first step
    group: Vec<usize>,
    largest: Vec<f64>, // n  of each group, by its number
}

/// Newton's method along the normals.
#[derive(Debug)]
struct Projection {
    g: Vec<f64>,      // m
    G: DMatrix<f64>,  // r × n
    GN: DMatrix<f64>, // r × r
    lu: DenseLu,
    delta: Vec<f64>,            // r
    nu: Vec<f64>,               // r
    along: Vec<f64>,            // n  P u
    shares: Vec<f64>,           // r  size of all coordinates over that of those a column of N moves
    tangent: DMatrix<f64>,      // r × d  (G N)⁻¹ G P = −∂ν/∂u
    base: (Vec<f64>, Vec<f64>), // u, ν where that is
}

impl<C: Constraints> TangentSpace<C> {
    /// For constraints of which `rows` are independent.
    #[must_use]
    pub fn new(constraints: Arc<C>, rows: &IndependentRows) -> Self {
        let (n, m, r) = (constraints.dim(), constraints.len(), rows.len());
        let d = n - r;
        let zeros = |i, j| DMatrix::zeros(i, j);
        Self {
            constraints,
            blocks: [UnknownBlock { kind: BlockKind::Position, range: 0..d, floor: 1e-5 }],
            qr: NullSpaceQr::new(n, m),
            jacobian: zeros(m, n),
            rows: rows.rows().to_vec(),
            P: zeros(n, d),
            N: zeros(n, r),
            last: zeros(n, d),
            overlap: zeros(d, d),
            hands_on: true,
            turns: false,
            carried: vec![0.0; d],
            refused: None,
            has_base: false,
            left: zeros(n, d),
            tangent: zeros(n, d),
            newton: DenseNewton::new(n, d),
            projection: Projection {
                g: vec![0.0; m],
                G: zeros(r, n),
                GN: zeros(r, r),
                lu: DenseLu::new(r),
                delta: vec![0.0; r],
                nu: vec![0.0; r],
                along: vec![0.0; n],
                shares: vec![1.0; r],
                tangent: zeros(r, d),
                base: (vec![0.0; d], vec![0.0; r]),
            },
            group: Vec::new(),
            largest: vec![0.0; n],
        }
    }

    /// Degrees of freedom `d = n − rank G`.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.P.ncols()
    }

    /// `P`, `N` and the rows at `(t, q)`, the columns of `P` close to those of the `last` node.
    fn split(&mut self, t: f64, q: &[f64], last: Option<&[f64]>) {
        self.jacobian.fill(0.0);
        self.constraints.jacobian(t, q, &mut self.jacobian);
        let (found, expected) = (self.qr.factorize(&self.jacobian), self.rows.len());
        self.refused = (found != expected).then_some(Fault::RankChanged {
            of: "the constraints",
            found,
            expected,
        });
        self.rows.copy_from_slice(&self.qr.pivots()[..expected]);
        self.qr.range(&mut self.N);
        self.qr.null_space(expected, &mut self.P);
        if let Some(last) = last {
            // the last columns, projected and made orthonormal again
            self.last.as_mut_slice().copy_from_slice(last);
            self.overlap.gemm_tr(1.0, &self.P, &self.last, 0.0);
            set_product(self.last.as_view_mut(), self.P.as_view(), self.overlap.as_view());
            if orthonormalize(&mut self.last) {
                self.P.copy_from(&self.last);
            }
        }
    }

    /// The rows of `G` at `(t, q)`, and `G N`.
    fn take_normals(&mut self, t: f64, q: &[f64]) {
        self.jacobian.fill(0.0);
        self.constraints.jacobian(t, q, &mut self.jacobian);
        let Projection { G, GN, .. } = &mut self.projection;
        for (k, &row) in self.rows.iter().enumerate() {
            G.row_mut(k).copy_from(&self.jacobian.row(row));
        }
        set_product(GN.as_view_mut(), G.as_view(), self.N.as_view());
    }

    /// `self.tangent ← ∂F_d/∂u` at the end of `s`.
    fn take_tangent(&mut self, s: &Interval) -> Result<(), Fault> {
        self.take_normals(s.t_end(), &s.q1);
        let Projection { G, GN, tangent, lu, .. } = &mut self.projection;
        set_product(tangent.as_view_mut(), G.as_view(), self.P.as_view());
        lu.factorize(GN);
        let r = self.rows.len().max(1);
        tangent.as_mut_slice().chunks_exact_mut(r).try_for_each(|x| lu.solve_factorized(x))?;
        self.tangent.copy_from(&self.P);
        add_product(self.tangent.as_view_mut(), -1.0, self.N.as_view(), tangent.as_view());
        Ok(())
    }

    /// Newton's method along the normals from the `ν` there is, `predicted` from a point next to
    /// this one; closes the interval.
    fn project(&mut self, predicted: bool, s: &mut Interval) -> Result<(), Fault> {
        const MAX_ITERATIONS: usize = 50;
        let scale = norm_inf(&s.q0).max(norm_inf(&self.projection.along));
        let round_off = 8.0 * f64::EPSILON * scale;
        let noise = round_off / self.qr.smallest().max(1e-8);
        self.take_shares(&s.q0, scale);
        let mut last = f64::INFINITY;
        for _ in 0..MAX_ITERATIONS {
            self.place(s);
            let t = s.t_end();
            self.take_normals(t, &s.q1);
            let Projection { g, GN, lu, delta, shares, .. } = &mut self.projection;
            self.constraints.value(s.end(), g);
            delta.iter_mut().zip(&self.rows).for_each(|(d, &row)| *d = g[row]);
            lu.solve(GN, delta).map_err(|_| no_point(last))?;
            let size = delta.iter().zip(&*shares).map(|(d, share)| (d * share).abs());
            let size = size.fold(0.0, f64::max);
            let contracts = size <= 0.5 * last;
            let met = size <= noise && (predicted || self.is_round_off(&s.q1));
            if size <= round_off || met || (size <= noise && !contracts) {
                s.close();
                return Ok(());
            }
            if !contracts {
                return Err(no_point(size));
            }
            let Projection { delta, nu, .. } = &mut self.projection;
            nu.iter_mut().zip(delta.iter()).for_each(|(nu, d)| *nu -= d);
            last = size;
        }
        Err(no_point(last))
    }

    /// Whether each `g_i` is no larger than the rounding of `q` makes it,
    /// `|g_i| ≤ ε Σ_j |G_ij| |q_j|`: beside constraints that all but depend on one another, a
    /// correction would be far larger than that rounding, and a momentum of the step would change
    /// by it over the step.
    fn is_round_off(&self, q: &[f64]) -> bool {
        let Projection { g, G, .. } = &self.projection;
        self.rows.iter().zip(G.row_iter()).all(|(&row, G)| {
            let terms: f64 = G.iter().zip(q).map(|(G, q)| (G * q).abs()).sum();
            g[row].abs() <= f64::EPSILON * terms
        })
    }

    /// The share of each column of `N`: corrections are compared with the coordinates that they are
    /// connected to, `scale` is the size of all.
    fn take_shares(&mut self, q: &[f64], scale: f64) {
        let Self { group, largest, N, projection, .. } = self;
        let Projection { along, shares, .. } = projection;
        largest.fill(0.0);
        for ((&group, q), along) in group.iter().zip(q).zip(&*along) {
            largest[group] = largest[group].max(q.abs()).max(along.abs());
        }
        for (share, column) in shares.iter_mut().zip(N.column_iter()) {
            let own = if group.is_empty() { scale } else { largest[group[column.iamax()]] };
            *share = if own > 0.0 { scale / own } else { 1.0 };
        }
    }

    /// Finds which coordinates the constraints connect, from the pattern of `G`.
    fn take_groups(&mut self, t: f64, q: &[f64]) {
        struct Places<'a>(&'a mut dyn FnMut(usize, usize));
        impl Entries for Places<'_> {
            fn add(&mut self, row: usize, column: usize, _value: f64) {
                (self.0)(row, column);
            }
        }
        self.group = groups(self.constraints.len(), q.len(), |visit| {
            self.constraints.jacobian(t, q, &mut Places(visit));
        });
    }

    /// Writes `s.q1`, `s.dq` from `P u` and `ν`.
    fn place(&self, s: &mut Interval) {
        let Projection { along, nu, .. } = &self.projection;
        s.dq.copy_from_slice(along);
        for (column, nu) in self.N.column_iter().zip(nu) {
            s.dq.iter_mut().zip(column.iter()).for_each(|(dq, n)| *dq += n * nu);
        }
        for ((q1, q0), dq) in s.q1.iter_mut().zip(&s.q0).zip(&s.dq) {
            *q1 = q0 + dq;
        }
    }
}

/// No point of the constraints was found over a point of the tangent space.
fn no_point(correction: f64) -> Fault {
    let what = "no configuration that meets the constraints was found over the tangent space";
    Fault::Unsolved { what, correction }
}

/// Makes columns orthonormal one after the other; `false` when they are not independent enough.
fn orthonormalize(columns: &mut DMatrix<f64>) -> bool {
    let n = columns.nrows();
    for k in 0..columns.ncols() {
        let (done, rest) = columns.as_mut_slice().split_at_mut(k * n);
        let own = &mut rest[..n];
        for other in done.chunks_exact(n) {
            let along: f64 = other.iter().zip(&*own).map(|(a, b)| a * b).sum();
            own.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
        }
        let size = own.iter().map(|a| a * a).sum::<f64>().sqrt();
        if size.is_nan() || size < 0.1 {
            return false;
        }
        own.iter_mut().for_each(|a| *a /= size);
    }
    true
}

impl<C: Constraints> NodalOperators for TangentSpace<C> {
    fn dof(&self) -> usize {
        self.P.ncols()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, s: &Interval, memory: &Memory, last: Option<LastStep<'_>>) {
        if self.group.is_empty() {
            self.take_groups(s.t, &s.q0);
        }
        // beside other operators its numbers are the last ones
        let others = memory.values.len().checked_sub(self.P.len());
        let basis = others.filter(|_| !self.P.is_empty()).map(|others| &memory.values[others..]);
        let known = basis.is_some();
        let mut tangent_known = false;
        if let (Some(LastStep { s: last, .. }), Some(basis)) = (last, basis) {
            self.split(last.t, &last.q0, None);
            self.P.as_mut_slice().copy_from_slice(basis);
            tangent_known = self.take_tangent(last).is_ok();
        }
        self.split(s.t, &s.q0, basis);
        self.hands_on = last.is_none();
        self.turns = self.hands_on && known;
        if let Some(basis) = basis.filter(|_| self.turns) {
            self.last.as_mut_slice().copy_from_slice(basis);
            self.overlap.gemm_tr(1.0, &self.P, &self.last, 0.0);
        }
        self.has_base = false;
        // what Newton's method calls small of this is about 50 ε of the configuration
        self.blocks[0].floor = unknowns::position_floor(&s.q0);
        self.left.copy_from(if tangent_known { &self.tangent } else { &self.P });
    }

    fn remember(&self, memory: &mut Memory) {
        memory.values.extend_from_slice(self.P.as_slice());
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        if let Some(fault) = self.refused {
            return Err(fault);
        }
        let Projection { along, nu, tangent, base, .. } = &mut self.projection;
        along.fill(0.0);
        for (column, u) in self.P.column_iter().zip(u) {
            along.iter_mut().zip(column.iter()).for_each(|(a, p)| *a += p * u);
        }
        nu.fill(0.0);
        if self.has_base {
            let moved = u.iter().zip(&base.0).map(|(u, base)| (u - base).abs()).fold(0.0, f64::max);
            let predicted = moved <= CLOSING_SIZE * norm_inf(u); // the square is below ε/4
            nu.copy_from_slice(&base.1);
            for (column, (u, base)) in tangent.column_iter().zip(u.iter().zip(&base.0)) {
                nu.iter_mut().zip(column.iter()).for_each(|(nu, t)| *nu -= t * (u - base));
            }
            if self.project(predicted, s).is_ok() {
                return Ok(());
            }
            self.projection.nu.fill(0.0);
        }
        self.project(false, s)
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        pull_back(&self.left, w, out);
    }

    /// `P(q_n)ᵀ P(q_{n−1}) r`: covectors on the old tangent space, extended by zero along its
    /// normals. Of the reduced scheme, whose columns are not orthonormal, nothing is taken over.
    fn take_balance(&mut self, r: &mut [f64]) {
        self.carried.copy_from_slice(r);
        r.fill(0.0);
        if self.turns {
            for (column, carried) in self.overlap.column_iter().zip(&self.carried) {
                r.iter_mut().zip(column.iter()).for_each(|(r, turned)| *r += turned * carried);
            }
        }
    }

    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        self.take_tangent(s)?;
        let Projection { base, nu, .. } = &mut self.projection;
        base.0.copy_from_slice(u);
        base.1.copy_from_slice(nu);
        self.has_base = true;
        self.newton.factorize(mixed, &self.left, &self.tangent);
        self.newton.solve(x)
    }

    fn clean(&mut self, _t: f64, _q: &mut [f64]) {}

    /// A correction of the relative size `s` of increments `u` leaves `s² |u|/σ`, with the last
    /// pivot `σ` of `G(q_n)ᵀ`.
    fn precision(&self) -> Precision {
        let sigma = self.qr.smallest();
        let reach = norm_inf(&self.projection.base.0).max(1.0);
        let closing_size = if self.hands_on { CLOSING_SIZE * (sigma / reach).sqrt() } else { 0.0 };
        let noise = 1e-9 / sigma.clamp(1e-8, 1.0);
        Precision { noise, closing_size, ..Precision::of_balances() }
    }
}
