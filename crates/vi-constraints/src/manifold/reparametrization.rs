//! Nodal reparametrization `q_{n+1} = F_d(u, q_n)` and the null space matrix `P(q)`.
//!
//! ```text
//! G(q) P(q) = 0,  q̇ = P ν                          LMO08 (5), (6)
//! g(F_d(u, q_n)) = 0 for every u,  F_d(0, q_n) = q_n      LMO08 (27)
//! range ∂F_d/∂u (u, q_n) = range P(q_{n+1})
//! ```
//! Two levels of description. A [`Reparametrization`] writes `P` and `∂F_d/∂u` as dense matrices:
//! ten lines for a small system, and the form in which all four schemes can use it. A
//! [`NodalOperators`] only applies them, which is what large systems need; [`DenseNodal`] turns the
//! first into the second.

use nalgebra::DMatrix;
use vi_core::interval::Interval;
use vi_core::linear::DenseLu;
use vi_core::newton::{Fault, Precision, UnknownBlock};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::Memory;

/// Local coordinates of the constraint manifold around each node, as dense matrices.
pub trait Reparametrization: Send {
    /// Degrees of freedom `d = n − rank G`.
    fn dof(&self) -> usize;
    /// Units and scales of the increments `u`.
    fn blocks(&self) -> Vec<UnknownBlock>;
    /// `out ← P(q)`, shape `n × d`; `out` may hold anything on entry.
    fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>);
    /// Writes `s.q1 = F_d(u, s.q0)` and the increment `s.dq`, accurate relative to itself. Time
    /// dependent maps find the step in `s.t`, `s.h`.
    ///
    /// # Errors
    /// [`Fault::OutsideChart`] when the map is not one-to-one there.
    fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault>;
    /// `out ← ∂F_d/∂u (u, q_n)`, shape `n × d`, for the interval that
    /// [`Reparametrization::reparametrize`] has written.
    fn tangent(&self, u: &[f64], s: &Interval, out: &mut DMatrix<f64>);
    /// Takes accumulated round-off out of `q` where the map only carries constraints along
    /// (directors, relative attitudes); called once per step.
    fn clean(&self, _t: f64, _q: &mut [f64]) {}
}

/// Emits a sparse matrix: always the same places in the same order.
pub type Emission<'a> = dyn Fn(&mut dyn Entries) + 'a;

/// Increment `u` and interval of a step.
#[derive(Clone, Copy, Debug)]
pub struct LastStep<'a> {
    /// `u_{n-1}`, shape `d`.
    pub u: &'a [f64],
    /// `(q_{n-1}, q_n)`.
    pub s: &'a Interval,
}

/// What the nodal scheme asks of a system, without matrices.
///
/// Call order within a step: `begin`, then for each iteration `reparametrize`, `pull_back`,
/// `solve`; `remember` when the step is taken.
pub trait NodalOperators: Send {
    /// Degrees of freedom `d`.
    fn dof(&self) -> usize;
    /// Units and scales of the increments `u`.
    fn blocks(&self) -> &[UnknownBlock];
    /// Takes `p̄_n` and `h` of a step, before [`NodalOperators::begin`].
    fn take_momentum(&mut self, _p: &[f64], _h: f64) {}
    /// Computes all that depends on `P(q_n)` alone, `q_n = s.q0`. With a `last` step, its `∂F_d/∂u`
    /// takes the place of `P(q_n)` (30). `memory`: of [`NodalOperators::remember`] after the last
    /// step.
    fn begin(&mut self, s: &Interval, memory: &Memory, last: Option<LastStep<'_>>);
    /// Adds what the next node needs of this step beside `q_{n+1}`.
    fn remember(&self, _memory: &mut Memory) {}
    /// Writes `s.q1`, `s.dq` and closes the interval.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault>;
    /// `out ← P(q_n)ᵀ w`, shape `d`.
    fn pull_back(&mut self, w: &[f64], out: &mut [f64]);
    /// Makes the residual of a pulled back balance: where `u` has to close loops, too, their
    /// constraints take the place of as many balances.
    fn close(&mut self, _r: &mut [f64]) {}
    /// Sets those entries of the residual of a step to zero that are no balance, or mean something
    /// else at the next node: the others are carried to it.
    fn carry_balance(&self, _r: &mut [f64]) {}
    /// Writes a residual that the last step carried over in the basis of this node; after
    /// [`NodalOperators::begin`].
    fn take_balance(&mut self, _r: &mut [f64]) {}
    /// `x ← (P(q_n)ᵀ K ∂F_d/∂u)⁻¹ x` at the last `reparametrize`d interval, with
    /// `K = D_2(D_1 L_d + f_d^-)` as emitted.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault>;
    /// See [`Reparametrization::clean`].
    fn clean(&mut self, t: f64, q: &mut [f64]);
    /// How exactly the equations can be solved.
    fn precision(&self) -> Precision {
        Precision::default()
    }
    /// The next correction is one by the matrix of its own iterate.
    fn forget_factors(&mut self) {}
    /// See [`vi_core::newton::NewtonProblem::rotation`].
    fn rotation(&self, _u: &[f64]) -> f64 {
        0.0
    }
}

impl<O: NodalOperators + ?Sized> NodalOperators for Box<O> {
    fn dof(&self) -> usize {
        (**self).dof()
    }
    fn blocks(&self) -> &[UnknownBlock] {
        (**self).blocks()
    }
    fn take_momentum(&mut self, p: &[f64], h: f64) {
        (**self).take_momentum(p, h);
    }
    fn begin(&mut self, s: &Interval, memory: &Memory, last: Option<LastStep<'_>>) {
        (**self).begin(s, memory, last);
    }
    fn remember(&self, memory: &mut Memory) {
        (**self).remember(memory);
    }
    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        (**self).reparametrize(u, s)
    }
    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        (**self).pull_back(w, out);
    }
    fn close(&mut self, r: &mut [f64]) {
        (**self).close(r);
    }
    fn carry_balance(&self, r: &mut [f64]) {
        (**self).carry_balance(r);
    }
    fn take_balance(&mut self, r: &mut [f64]) {
        (**self).take_balance(r);
    }
    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        (**self).solve(mixed, u, s, x)
    }
    fn clean(&mut self, t: f64, q: &mut [f64]) {
        (**self).clean(t, q);
    }
    fn precision(&self) -> Precision {
        (**self).precision()
    }
    fn forget_factors(&mut self) {
        (**self).forget_factors();
    }
    fn rotation(&self, u: &[f64]) -> f64 {
        (**self).rotation(u)
    }
}

/// The Newton matrix `P(q_n)ᵀ [D_2(D_1 L_d + f_d^-)] ∂F_d/∂u` as a dense matrix with its factors.
#[derive(Debug)]
pub struct DenseNewton {
    weighted: DMatrix<f64>,      // n × d  D_2 D_1 L_d ∂F_d/∂u
    matrix: DMatrix<f64>,        // d × d
    mixed: Option<SparseMatrix>, // n × n  D_2 D_1 L_d
    lu: DenseLu,
}

impl DenseNewton {
    /// For `n` coordinates and `d` degrees of freedom.
    #[must_use]
    pub fn new(n: usize, d: usize) -> Self {
        let (weighted, matrix) = (DMatrix::zeros(n, d), DMatrix::zeros(d, d));
        Self { weighted, matrix, mixed: None, lu: DenseLu::new(d) }
    }

    /// Forms and factorizes the matrix between `P(q_n)` and `∂F_d/∂u`.
    pub fn factorize(
        &mut self,
        mixed: &Emission<'_>,
        null_space: &DMatrix<f64>,
        tangent: &DMatrix<f64>,
    ) {
        let n = null_space.nrows();
        let mixed = SparseMatrix::update(&mut self.mixed, (n, n), mixed);
        self.weighted.fill(0.0);
        mixed.mul_dense_add(1.0, tangent, &mut self.weighted);
        self.matrix.gemm_tr(1.0, null_space, &self.weighted, 0.0);
        self.lu.factorize(&self.matrix);
    }

    /// Solves with the last factorization, in place.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), Fault> {
        Ok(self.lu.solve_factorized(x)?)
    }
}

/// `out ← Pᵀ w`, shape `d`.
pub fn pull_back(null_space: &DMatrix<f64>, w: &[f64], out: &mut [f64]) {
    for (o, column) in out.iter_mut().zip(null_space.column_iter()) {
        *o = column.iter().zip(w).map(|(p, w)| p * w).sum(); // (6)
    }
}

/// [`NodalOperators`] from a [`Reparametrization`], by dense matrices and a dense LU:
/// `O(n d² + d³)`.
#[derive(Debug)]
pub struct DenseNodal<R> {
    map: R,
    blocks: Vec<UnknownBlock>,
    null_space: DMatrix<f64>, // n × d  P(q_n)
    tangent: DMatrix<f64>,    // n × d  ∂F_d/∂u
    newton: DenseNewton,
    closes: bool,
}

impl<R: Reparametrization> DenseNodal<R> {
    /// Operators for a map on `R^n`.
    pub fn new(n: usize, map: R) -> Self {
        let (d, blocks) = (map.dof(), map.blocks());
        let nd = || DMatrix::zeros(n, d);
        let newton = DenseNewton::new(n, d);
        Self { map, blocks, null_space: nd(), tangent: nd(), newton, closes: false }
    }

    /// For maps of bodies and points: see [`Precision::of_balances`].
    #[must_use]
    pub fn closing(mut self) -> Self {
        self.closes = true;
        self
    }

    /// The map.
    pub fn map(&self) -> &R {
        &self.map
    }

    /// `P(q_n)`, shape `n × d`.
    pub fn null_space(&self) -> &DMatrix<f64> {
        &self.null_space
    }

    /// Forms and factorizes `P(q_n)ᵀ [D_2(D_1 L_d + f_d^-)] ∂F_d/∂u`.
    pub fn factorize(&mut self, mixed: &Emission<'_>, u: &[f64], s: &Interval) {
        self.map.tangent(u, s, &mut self.tangent);
        self.newton.factorize(mixed, &self.null_space, &self.tangent);
    }

    /// Solves with the last factorization, in place.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    pub fn solve_factorized(&mut self, x: &mut [f64]) -> Result<(), Fault> {
        self.newton.solve(x)
    }
}

impl<R: Reparametrization> NodalOperators for DenseNodal<R> {
    fn dof(&self) -> usize {
        self.null_space.ncols()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, s: &Interval, _memory: &Memory, last: Option<LastStep<'_>>) {
        match last {
            Some(last) => self.map.tangent(last.u, last.s, &mut self.null_space),
            None => self.map.null_space(&s.q0, &mut self.null_space),
        }
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.map.reparametrize(u, s)?; // (27)
        s.close();
        Ok(())
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        pull_back(&self.null_space, w, out);
    }

    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        self.factorize(mixed, u, s);
        self.solve_factorized(x)
    }

    fn precision(&self) -> Precision {
        Precision::of_balances_if(self.closes)
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.map.clean(t, q);
    }
}
