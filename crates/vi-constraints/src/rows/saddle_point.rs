//! Sparse saddle-point systems over a set of independent constraints.
//!
//! ```text
//! [ A   Gᵀ ] [x]   [a]
//! [ G'  0  ] [y] = [b]
//! ```
//! `A` is `M`, the identity or a Newton matrix; `G`, `G'` are constraint Jacobians at one or two
//! configurations. Only the rows of an independent set of constraints enter; the symbolic
//! factorization is made once for each set. `M` may be singular as long as it is definite on the
//! null space.
//!
//! Rows that are independent at one configuration may be nearly dependent at another, although `G`
//! keeps its rank: then `G_d = C G_s` of the dropped rows has large coefficients, and what is left
//! of `g_s` shows in `g_d` that much enlarged. Where constraints are redundant, every solve
//! therefore also finds
//! ```text
//! [ Aᵀ  G'ᵀ ] [0]   [ G'_dᵀ s ]
//! [ G   0   ] [c] = [    0    ]          c = C'ᵀ s   with fixed signs s
//! ```
//! from the same factorization, and once `c` is large ([`SaddlePoint::is_worn`]) it is time for
//! other rows.

pub use super::independent_rows::{IndependentRows, JacobianPlace};

use crate::constraints::Constraints;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, SparseLu, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::Memory;

/// Largest coefficient of a dropped row in the chosen ones, relative to the smallest since they
/// were chosen, from which on others are looked for.
const WORN: f64 = 5.0;

/// A saddle-point matrix with its factorization.
#[derive(Debug)]
pub struct SaddlePoint {
    initial: IndependentRows,
    rows: IndependentRows,
    n: usize,
    matrix: Option<(SparseMatrix, SparseLu)>,
    probe: Probe,
}

/// How well the chosen rows stay independent.
#[derive(Debug, Default)]
struct Probe {
    c: Vec<f64>, // n + r
    now: f64,    // |c|_∞ in the last solve
    least: f64,  // the smallest since the rows were chosen
}

/// Adds up the dropped rows with their signs.
struct Dropped<'a> {
    rows: &'a IndependentRows,
    sum: &'a mut [f64],
}

impl Entries for Dropped<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if self.rows.is_dropped(row) {
            let sign = if libm::sin(13.7 * (row + 1) as f64) > 0.0 { 1.0 } else { -1.0 };
            self.sum[column] += sign * value;
        }
    }
}

impl Probe {
    /// Writes the right-hand side: `lower` emits `G'` over all constraints; `n`: coordinates.
    fn prepare(&mut self, rows: &IndependentRows, n: usize, lower: &dyn Fn(&mut dyn Entries)) {
        self.c.resize(n + rows.len(), 0.0);
        self.c.fill(0.0);
        lower(&mut Dropped { rows, sum: &mut self.c[..n] });
        self.now = f64::INFINITY; // until it is solved
    }

    /// Reads the answer.
    fn read(&mut self, n: usize) {
        self.now = norm_inf(&self.c[n..]);
        self.least = self.least.min(self.now);
    }
}

impl SaddlePoint {
    /// For `n` coordinates and the given constraints.
    #[must_use]
    pub fn new(n: usize, rows: IndependentRows) -> Self {
        let probe = Probe { least: f64::INFINITY, ..Probe::default() };
        Self { initial: rows.clone(), rows, n, matrix: None, probe }
    }

    /// Takes the rows that a state remembers, or the first ones if it remembers none.
    pub fn recall(&mut self, memory: &Memory) {
        if self.rows.redundant().next().is_none() {
            return;
        }
        let m = self.rows.of();
        let known = memory.indices.len() == self.rows.len()
            && memory.values.len() == 1
            && memory.indices.iter().all(|&row| row < m);
        let (rows, least) = match known {
            true => (&memory.indices[..], memory.values[0]),
            false => (self.initial.rows(), 0.0),
        };
        self.probe.least = if least > 0.0 { least } else { f64::INFINITY };
        if self.rows.rows() != rows {
            self.rows.replace(rows);
            self.matrix = None; // another pattern
        }
    }

    /// Writes the rows in use into the memory of a state.
    pub fn remember(&self, memory: &mut Memory) {
        if self.rows.redundant().next().is_none() {
            return;
        }
        let least = if self.probe.least.is_finite() { self.probe.least } else { 0.0 };
        memory.indices.clear();
        memory.indices.extend_from_slice(self.rows.rows());
        memory.values.clear();
        memory.values.push(least);
    }

    /// Whether the chosen rows were no longer clearly independent in the last solve.
    #[must_use]
    pub fn is_worn(&self) -> bool {
        self.probe.now > WORN * self.probe.least.max(1.0)
    }

    /// After a step that was `solved` or not: chooses other rows where the present ones are not
    /// clearly independent. Returns whether they changed and the step is to be solved again.
    pub fn renew(&mut self, constraints: &impl Constraints, s: &Interval, solved: bool) -> bool {
        let (t, q) = if solved { (s.t_end(), &s.q1) } else { (s.t, &s.q0) };
        (!solved || self.is_worn()) && self.choose(constraints, t, q)
    }

    /// Chooses the rows anew, as many as before, by pivoted QR at `(t, q)`; returns whether they
    /// changed.
    pub fn choose(&mut self, constraints: &impl Constraints, t: f64, q: &[f64]) -> bool {
        if self.rows.redundant().next().is_none() {
            return false;
        }
        let changed = self.rows.renew(constraints, t, q);
        (self.probe.now, self.probe.least) = (0.0, f64::INFINITY);
        if changed {
            self.matrix = None; // another pattern
        }
        changed
    }

    /// The constraints in use.
    #[must_use]
    pub fn rows(&self) -> &IndependentRows {
        &self.rows
    }

    /// Solves `A x + Gᵀ y = a`, `G x = b` at one configuration; `a`: shape `n`, `b`: over all
    /// constraints, `x`: shape `n + rank`. Chooses other rows where the present ones are not
    /// clearly independent.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve_at(
        &mut self,
        constraints: &impl Constraints,
        emit: &dyn Fn(&mut dyn Entries),
        at: Configuration<'_>,
        a: &[f64],
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), Singular> {
        let mut solve = |this: &mut Self| {
            let (upper, lower) = x.split_at_mut(this.n);
            upper.copy_from_slice(a);
            this.rows.gather(b, lower);
            this.solve(constraints, emit, at, 1.0, at, x)
        };
        let solved = solve(self);
        if self.is_worn() && self.choose(constraints, at.t, at.q) {
            return solve(self);
        }
        solved
    }

    /// Solves with `A` as emitted, `scale Gᵀ` at `upper` and `G` at `lower`;
    /// `x` has shape `n + rank` and holds `(a, b)` on entry.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve(
        &mut self,
        constraints: &impl Constraints,
        emit: &dyn Fn(&mut dyn Entries),
        upper: Configuration<'_>,
        scale: f64,
        lower: Configuration<'_>,
        x: &mut [f64],
    ) -> Result<(), Singular> {
        let above = |out: &mut dyn Entries| constraints.jacobian(upper.t, upper.q, out);
        let below = |out: &mut dyn Entries| constraints.jacobian(lower.t, lower.q, out);
        self.solve_with(emit, &above, scale, &below, x)
    }

    /// The same with `G` and `G'` as emitted, over all constraints.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve_with(
        &mut self,
        emit: &dyn Fn(&mut dyn Entries),
        upper: &dyn Fn(&mut dyn Entries),
        scale: f64,
        lower: &dyn Fn(&mut dyn Entries),
        x: &mut [f64],
    ) -> Result<(), Singular> {
        self.factorize(emit, upper, scale, lower)?;
        self.solve_factorized(x)
    }

    /// Factorizes the matrix with `A`, `G` and `G'` as emitted, the last two over all constraints,
    /// and finds how well the chosen rows stay independent.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn factorize(
        &mut self,
        emit: &dyn Fn(&mut dyn Entries),
        upper: &dyn Fn(&mut dyn Entries),
        scale: f64,
        lower: &dyn Fn(&mut dyn Entries),
    ) -> Result<(), Singular> {
        let (n, rows) = (self.n, &self.rows);
        let fill = |out: &mut dyn Entries| {
            emit(out);
            let right = JacobianPlace { row: 0, column: n, scale, transposed: true };
            rows.emit_selected(upper, right, out);
            let below = JacobianPlace { row: n, column: 0, scale: 1.0, transposed: false };
            rows.emit_selected(lower, below, out);
        };
        match &mut self.matrix {
            Some((matrix, _)) => matrix.refill(fill),
            None => {
                let size = n + rows.len();
                let matrix = SparseMatrix::assemble(size, size, fill);
                let lu = SparseLu::new(&matrix)?;
                self.matrix = Some((matrix, lu));
            }
        }
        let (matrix, lu) = self.matrix.as_mut().expect("just written");
        lu.factorize(matrix)?;
        if rows.redundant().next().is_some() {
            self.probe.prepare(rows, n, lower);
            lu.solve_transposed(&mut self.probe.c)?;
            self.probe.read(n);
        }
        Ok(())
    }

    /// Solves with the last factorization; `x`: as of [`SaddlePoint::solve`], several may follow
    /// one another.
    ///
    /// # Errors
    /// [`Singular`], also when nothing was factorized.
    pub fn solve_factorized(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        self.matrix.as_mut().map_or(Err(Singular), |(_, lu)| lu.solve_factorized(x))
    }

    /// Solves with the transposed matrix of the last factorization; `x`: shape `n + rank`.
    ///
    /// # Errors
    /// As [`SaddlePoint::solve_factorized`].
    pub fn solve_transposed(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        self.matrix.as_mut().map_or(Err(Singular), |(_, lu)| lu.solve_transposed(x))
    }

    /// `Σ_j |K_ij| size_j` over the matrix of the last solve, where the coordinates have the sizes
    /// that the system gives them at `q` and the multipliers those of `x`; `None` before the first.
    #[must_use]
    pub fn equation_sizes<C: Constraints>(
        &self,
        constraints: &C,
        q: &[f64],
        x: &[f64],
    ) -> Option<Vec<f64>> {
        let (matrix, n) = (self.matrix()?, self.n);
        let mut sizes = vec![0.0; n];
        constraints.coordinate_sizes(q, &mut sizes);
        sizes.extend(x[n..].iter().map(|multiplier| multiplier.abs()));
        Some(term_sizes(matrix, &sizes))
    }

    /// The matrix of the last solve.
    #[must_use]
    pub fn matrix(&self) -> Option<&SparseMatrix> {
        self.matrix.as_ref().map(|(matrix, _)| matrix)
    }
}

/// `Σ_j |K_ij| size_j` of each row.
pub(crate) fn term_sizes(matrix: &SparseMatrix, sizes: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0; sizes.len()];
    matrix.for_each(|i, j, value| sums[i] += value.abs() * sizes[j]);
    sums
}
