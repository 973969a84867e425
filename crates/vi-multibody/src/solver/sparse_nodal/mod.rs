//! The nodal scheme on trees whose members are coupled by potentials: beams, springs between
//! bodies.
//!
//! ```text
//! Dr = P_exᵀ [ P_in(q_n)ᵀ K P_in(q_{n+1}) ] P'_ex,     K = D_2(D_1 L_d + f_d^-) ∈ R^{n×n} sparse
//! t_α = Σ_k J_αk ν_k,  k ∈ unknowns of α and its ancestors;     J_c = (X_c J_parent, S_c)
//! ```
//! `K` is emitted into 6×6 blocks, one for each pair of coupled members (replayed, no search),
//! reduced by two pull-backs; a block spreads over the unknowns of both chains of ancestors. The
//! sum is a sparse `d × d` matrix with a fixed pattern of blocks between joints: one symbolic LU
//! for ever, by these blocks or by entries ([`reduced_matrix`]), rows and columns scaled by powers
//! of two near `|Dr_kk|^{−1/2}` (lengths against angles). Beams whose nodes are free roots cost
//! `O(elements)` per iteration. Nothing is allocated after the first solve, except when pivot
//! blocks become too small for the first time.
//!
//! Later corrections of a step use the same factors where these are good enough
//! (`solver/chord.rs`).
//!
//! Cut joints are not seen here: [`crate::solver::closed_loop`] puts them on top.
//! Where members have many ancestors the matrix is dense: [`crate::solver::tree_descriptor`].
//!
//! Letters: `J_αk` column of the velocity map of member `α` (a twist), `K` the mixed derivative.
//!
//! Source: theory §5, §6 "Solving".

mod bordered;
pub mod control_points;
pub mod layout;
pub mod mode_factors;
pub mod reduced_matrix;
pub mod reduced_rows;

use crate::mechanism::Mechanism;
use crate::pair::{Twist, VelocityMap};
use crate::solver::chord::Chord;
use crate::solver::screws::{Flight, RootMap, RootScrew};
pub(crate) use bordered::SparseRow;
pub use layout::{MapColumns, VelocityLayout};
use nalgebra::DMatrix;
pub use reduced_matrix::ReducedMatrix;
pub use reduced_rows::ReducedRows;
use vi_constraints::NodalOperators;
use vi_constraints::node_solvers::RateOperators;
use vi_constraints::reparametrization::{Emission, LastStep};
use vi_core::interval::Interval;
use vi_core::linear::{Singular, norm_inf};
use vi_core::newton::{BlockKind, Fault, Precision, UnknownBlock};
use vi_core::sparse::SparseMatrix;
use vi_core::state::Memory;

crate::opaque_debug!(SparseNodal);

/// Extent of a configuration, m: the largest coordinate of a centre, at least the largest distance
/// of one from the first; the scale of round-off in the strains of elements.
#[must_use]
pub fn extent(q: &[f64]) -> f64 {
    let size = |frame: &[f64]| {
        let shift: [f64; 3] = std::array::from_fn(|i| frame[i] - q[i]);
        norm_inf(&frame[..3]).max(norm_inf(&shift))
    };
    q.chunks_exact(12).map(size).fold(0.0, f64::max)
}

/// Sets the sizes below which increments do not matter to Newton's method.
pub(crate) fn with_floors(blocks: &mut [UnknownBlock], length: f64, angle: f64) {
    for block in blocks {
        let floor = if block.kind == BlockKind::Rotation { angle } else { length };
        block.floor = block.floor.max(floor);
    }
}

/// [`NodalOperators`] of a tree with couplings between its members, by a sparse LU.
pub struct SparseNodal {
    layout: VelocityLayout,
    blocks: Vec<UnknownBlock>,
    left: MapColumns,  // P(q_n)
    right: MapColumns, // ∂F_d/∂u
    matrix: ReducedMatrix,
    by_screws: bool,
    screws: Vec<RootScrew>, // of free roots
    flight: Flight,
    u: Vec<f64>,   // d  increments u of the unknowns
    current: bool, // `u` and `screws` are those of the last trial
    chord: Chord,
}

impl SparseNodal {
    /// Operators for the spanning tree of a mechanism.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Self {
        let layout = VelocityLayout::new(mechanism);
        let [left, right] = [0, 1].map(|_| layout.separated_columns());
        let (blocks, matrix) = (layout.blocks(), ReducedMatrix::default());
        let screws = vec![RootScrew::zero(&[0.0; 12]); layout.free_roots().count()];
        let (u, chord) = (vec![0.0; layout.dof()], Chord::new(&blocks));
        Self {
            layout,
            blocks,
            left,
            right,
            matrix,
            by_screws: false,
            screws,
            flight: Flight::default(),
            u,
            current: false,
            chord,
        }
    }

    /// Takes screws as the unknowns of free roots: `θ = D y_θ`, `u_φ = T(θ) D y_φ` with the
    /// directors `D` of `q_n`. In a steady screw motion `y = h (Dᵀφ̇, Dᵀω)` is constant, and every
    /// member stays on its circle: initial guesses that are extrapolated, and the first iterate
    /// `hν` from `y = 0`, are then free of strain. Stiff beams in fast rotation need it; the root
    /// `q_{n+1}` is the same.
    #[must_use]
    pub fn by_screws(mut self) -> Self {
        self.by_screws = true;
        self
    }

    /// Takes screws relative to the velocity of the centre of mass, where nothing holds the
    /// mechanism: of a body that flies `h v̄` in a step and turns by `θ`, a correction `δθ` would
    /// move the end by `h v̄ δθ`. `mass`: the matrix `M`.
    #[must_use]
    pub fn in_flight(mut self, mechanism: &Mechanism, mass: &SparseMatrix) -> Self {
        self.flight = Flight::new(mechanism, mass);
        self
    }

    /// `self.u ←` the increments that belong to the unknowns.
    fn increments(&mut self, unknowns: &[f64], q_n: &[f64]) {
        self.u.copy_from_slice(unknowns);
        if self.by_screws {
            let Self { layout, flight, u, screws, .. } = self;
            layout.screws_to_increments(flight, q_n, u, screws);
        }
    }

    /// For stiff couplings between frames at `q`, elements above all: increments are resolved to
    /// the round-off of the strains, `1e-14` of the [`extent`], and free roots move by screws.
    #[must_use]
    pub fn for_elements(self, q: &[f64]) -> Self {
        self.with_floors(1e-5 * extent(q).max(1e-5), 1e-5).by_screws()
    }

    /// Sets the sizes below which increments do not matter to Newton's method: `length` (m) and
    /// `angle` (rad). With stiff couplings the internal forces are noisy, and the increments cannot
    /// be resolved below `ε` times the extent of the system, however small they are.
    #[must_use]
    pub fn with_floors(mut self, length: f64, angle: f64) -> Self {
        with_floors(&mut self.blocks, length, angle);
        self.chord = Chord::new(&self.blocks);
        self
    }

    /// Adds a wrench on the frame of a link, `J_αᵀ (f, τ)`, to a row over the unknowns: at `q_n`,
    /// or at the `q_{n+1}` of the tangent last taken. What moves the link `apex`, which carries it,
    /// is left out.
    pub(crate) fn add_wrench(
        &self,
        next: bool,
        link: usize,
        apex: Option<usize>,
        wrench: &Twist,
        mut add: impl FnMut(usize, f64),
    ) {
        let columns = if next { &self.right } else { &self.left };
        self.layout.for_each_column(columns, link, apex, |unknown, twist| {
            add(unknown, wrench.dot(&twist));
        });
    }

    /// Forms `Pᵀ K ∂F_d/∂u` with `K` as emitted: always the same places in the same order.
    pub(crate) fn assemble(&mut self, emit: &Emission<'_>, u: &[f64], s: &Interval) {
        self.take_tangent(u, s);
        self.matrix.fill(&self.layout, emit, &self.left, &self.right, &[]);
    }

    /// Takes `P_in(q) P_ex` with the given velocity maps of the links in the place of `P(q_n)`: a
    /// discrete null space.
    pub fn take_maps(&mut self, q: &[f64], maps: &[VelocityMap]) {
        self.chord.forget();
        self.layout.with_maps(q, maps, &mut self.left);
    }

    /// Solves with the matrix last formed; several right-hand sides may follow one another.
    pub(crate) fn solve_assembled(&mut self, x: &mut [f64]) -> Result<(), Fault> {
        let Self { layout, left, right, matrix, .. } = self;
        Ok(solve_with(layout, [left, right], x, |x| matrix.solve(x))?)
    }

    /// Whether [`SparseNodal::solve_again`] has factors.
    pub(crate) fn has_factors(&self) -> bool {
        self.matrix.is_eliminated()
    }

    /// Solves with the factors of the matrix last solved with.
    pub(crate) fn solve_again(&mut self, x: &mut [f64]) -> SolvedStep {
        let Self { layout, left, right, matrix, .. } = self;
        solve_with(layout, [left, right], x, |x| matrix.solve_again(x))
    }

    /// `∂F_d/∂u` at the unknowns `u`.
    pub(crate) fn take_tangent(&mut self, u: &[f64], s: &Interval) {
        if !self.current {
            self.increments(u, &s.q0);
        }
        let Self { layout, screws, right, .. } = self;
        match self.by_screws {
            true => layout.tangent_by_screws(&self.u, screws, s, right),
            false => layout.tangent(&self.u, s, right),
        }
    }

    /// Whether the matrix last solved with was eliminated by its blocks.
    #[must_use]
    pub fn is_by_blocks(&self) -> bool {
        self.matrix.is_eliminated()
    }

    /// The reduced Newton matrix last filled, dense and unscaled.
    #[must_use]
    pub fn matrix(&self) -> DMatrix<f64> {
        let mut dense = self.matrix.to_dense();
        for ((root, left), right) in
            self.layout.free_roots().zip(&self.left.roots).zip(&self.right.roots)
        {
            let rows = dense.rows(root.offset, 6).into_owned();
            dense.rows_mut(root.offset, 6).copy_from(&left.matrix().tr_mul(&rows));
            let columns = dense.columns(root.offset, 6).into_owned();
            dense.columns_mut(root.offset, 6).copy_from(&(columns * right.matrix()));
        }
        dense
    }
}

type SolvedStep = Result<(), Singular>;

/// Solves with a matrix that is one between the twists of free roots.
fn solve_with(
    layout: &VelocityLayout,
    [left, right]: [&MapColumns; 2],
    x: &mut [f64],
    solve: impl FnOnce(&mut [f64]) -> SolvedStep,
) -> SolvedStep {
    let each =
        |columns: &MapColumns, x: &mut [f64], solve: fn(&RootMap, &mut [f64]) -> SolvedStep| {
            let mut roots = layout.free_roots().zip(&columns.roots);
            roots.try_for_each(|(root, map)| solve(map, &mut x[root.offset..root.offset + 6]))
        };
    let d = layout.dof().max(1);
    x.chunks_exact_mut(d).try_for_each(|x| each(left, x, RootMap::solve_transposed))?;
    solve(x)?;
    x.chunks_exact_mut(d).try_for_each(|x| each(right, x, RootMap::solve))
}

impl NodalOperators for SparseNodal {
    fn dof(&self) -> usize {
        self.layout.dof()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn take_momentum(&mut self, p: &[f64], h: f64) {
        self.flight.open(self.layout.frames(), p, h);
    }

    fn begin(&mut self, s: &Interval, _memory: &Memory, last: Option<LastStep<'_>>) {
        self.current = false;
        self.chord.forget();
        if let Some(last) = last {
            self.take_tangent(last.u, last.s);
            std::mem::swap(&mut self.left, &mut self.right);
        } else if self.by_screws {
            self.layout.null_space_by_screws(&s.q0, &mut self.left);
        } else {
            self.layout.null_space(&s.q0, &mut self.left);
        }
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.increments(u, &s.q0);
        self.current = true;
        self.layout.reparametrize(&self.u, s)
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        self.layout.pull_back(&self.left, w, out);
    }

    /// Screws are components along the directors of `q_n`, which rotate: their residual means
    /// something else at the next node.
    fn carry_balance(&self, r: &mut [f64]) {
        if self.by_screws {
            r.fill(0.0);
        }
    }

    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let mut chord = std::mem::take(&mut self.chord);
        let kept = chord.correct(u, x, |x| self.solve_again(x));
        self.chord = chord;
        if kept {
            return Ok(());
        }
        self.assemble(mixed, u, s);
        self.solve_assembled(x)?;
        if self.matrix.is_eliminated() {
            self.chord.renew(u, x);
        }
        Ok(())
    }

    fn forget_factors(&mut self) {
        self.chord.forget();
    }

    fn precision(&self) -> Precision {
        let precision = Precision::of_balances_if(!self.by_screws);
        match self.chord.keeps_factors() {
            true => Precision { closing_size: 0.0, ..precision },
            false => precision,
        }
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.layout.clean(q);
    }
}

impl RateOperators for SparseNodal {
    fn push_forward(&mut self, nu: &[f64], v: &mut [f64]) {
        self.layout.velocity(&self.left, nu, v);
    }
}
