//! How many eigenvalues of a symmetric matrix are negative on the null space of constraints,
//! sparse.
//!
//! ```text
//! [ K + γ BᵀB   Bᵀ ]
//! [ B           0  ] = L D Lᵀ        n₋(D) − m = n₋(ZᵀKZ),   B Z = 0,   B of full rank m, any γ
//! ```
//! Sylvester's law of inertia. `L D Lᵀ` has no pivoting: the unknowns are eliminated in an order of
//! minimum degree, each multiplier after its last unknown, and `γ BᵀB` stiffens the directions in
//! which the constraints act alone. The diagonal of `|L||D||Lᵀ|` beside that of the matrix shows
//! how far rounding has grown; where it is beyond 10⁴ a dense factorization with pivots of Bunch
//! and Kaufman takes its place.
//!
//! Source: theory §6.9; N. J. Higham, Accuracy and Stability of Numerical Algorithms (2002), §11.
#![allow(non_snake_case)] // K, B, A, L, D

use crate::eigen::negative_eigenvalues;
use crate::linear::view;
use crate::sparse::{Entries, SparseMatrix};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::{Par, Side};

/// Growth of rounding beyond which the sparse factors are not believed.
const GROWN: f64 = 1e4;
/// Values of `γ`, one after the other until the factors are accurate.
const GAMMA: [f64; 3] = [1.0, 37.0, 0.023];
/// Least diagonal that unknowns are scaled by, relative to the largest.
const SOFTEST: f64 = 1e-8;
/// Unknowns and rows up to which a dense factorization is affordable.
const DENSE: usize = 2000;

/// The number of negative eigenvalues of `ZᵀKZ`; of `K` its symmetric part counts. `B` has full
/// rank, shape `m × d`. `None` where no factorization is accurate enough to tell.
#[must_use]
pub fn negative_on_null_space(K: &SparseMatrix, B: &SparseMatrix) -> Option<usize> {
    let (d, m) = (K.shape().0, B.shape().0);
    if d == 0 {
        return Some(0);
    }
    let bordered = ScaledMatrix::new(K, B);
    let order = bordered.order()?;
    let mut place = vec![0; d + m];
    order.iter().enumerate().for_each(|(new, &old)| place[old] = new);
    let matrix = |gamma: f64| {
        SparseMatrix::assemble(d + m, d + m, |out| {
            bordered.emit(gamma, &mut Upper { out, place: &place });
        })
    };
    let sparse = GAMMA.into_iter().find_map(|gamma| negative_pivots(&matrix(gamma)));
    let negative = sparse.or_else(|| {
        // its lower triangle
        (d + m <= DENSE).then(|| negative_eigenvalues(&matrix(1.0).to_dense().transpose()))
    })?;
    negative.checked_sub(m)
}

/// The matrix with scaled unknowns and rows.
struct ScaledMatrix<'a> {
    K: &'a SparseMatrix,
    rows: Vec<Vec<(usize, f64)>>, // of B, scaled, the largest entry 1
    scale: Vec<f64>,              // d
}

impl<'a> ScaledMatrix<'a> {
    fn new(K: &'a SparseMatrix, B: &SparseMatrix) -> Self {
        let d = K.shape().0;
        let mut diagonal = vec![0.0_f64; d];
        K.for_each(|i, j, value| {
            if i == j {
                diagonal[i] += value.abs();
            }
        });
        let largest = diagonal.iter().copied().fold(0.0, f64::max);
        let root = |k: f64| 1.0 / k.max(SOFTEST * largest).sqrt();
        let usable = |scale: f64| if scale.is_finite() { scale } else { 1.0 };
        let scale: Vec<f64> = diagonal.into_iter().map(|k| usable(root(k))).collect();
        let mut rows = vec![Vec::new(); B.shape().0];
        B.for_each(|i, j, value| rows[i].push((j, value * scale[j])));
        for row in &mut rows {
            let size = row.iter().fold(0.0_f64, |size, (_, b)| size.max(b.abs()));
            row.iter_mut().for_each(|(_, b)| *b /= size);
        }
        Self { K, rows, scale }
    }

    fn emit(&self, gamma: f64, out: &mut dyn Entries) {
        self.emit_unknowns(gamma, out);
        let d = self.scale.len();
        for (k, row) in self.rows.iter().enumerate() {
            for &(j, b) in row {
                out.add(d + k, j, b);
                out.add(j, d + k, b);
            }
            out.add(d + k, d + k, 0.0);
        }
    }

    /// `K + γBᵀB`.
    fn emit_unknowns(&self, gamma: f64, out: &mut dyn Entries) {
        self.K.for_each(|i, j, value| out.add(i, j, self.scale[i] * value * self.scale[j]));
        for (i, _) in self.scale.iter().enumerate() {
            out.add(i, i, 0.0);
        }
        for row in &self.rows {
            for &(i, a) in row {
                row.iter().for_each(|&(j, b)| out.add(i, j, gamma * a * b));
            }
        }
    }

    /// The order of elimination: minimum degree, every multiplier after its last unknown.
    fn order(&self) -> Option<Vec<usize>> {
        let d = self.scale.len();
        let same: Vec<usize> = (0..d).collect();
        let pattern = SparseMatrix::assemble(d, d, |out| {
            self.emit_unknowns(1.0, &mut Upper { out, place: &same });
        });
        let symbolic = symbolic(&pattern, SymmetricOrdering::Amd)?;
        let unknowns: Vec<usize> = match symbolic.perm() {
            Some(order) => order.arrays().0.to_vec(),
            None => same,
        };
        let mut place = vec![0; d];
        unknowns.iter().enumerate().for_each(|(new, &old)| place[old] = new);
        let mut after = vec![Vec::new(); d];
        for (k, row) in self.rows.iter().enumerate() {
            let last = row.iter().map(|(j, _)| place[*j]).max()?;
            after[last].push(d + k);
        }
        let pairs = unknowns.into_iter().zip(after);
        Some(pairs.flat_map(|(own, after)| std::iter::once(own).chain(after)).collect())
    }
}

/// The symmetric part at other places, its upper triangle.
struct Upper<'a> {
    out: &'a mut dyn Entries,
    place: &'a [usize],
}

impl Entries for Upper<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let (i, j) = (self.place[row], self.place[column]);
        let share = if i == j { 1.0 } else { 0.5 };
        self.out.add(i.min(j), i.max(j), share * value);
    }
}

fn symbolic(
    A: &SparseMatrix,
    ordering: SymmetricOrdering<'_, usize>,
) -> Option<SymbolicCholesky<usize>> {
    // simplicial: the same bits on every processor; without a permutation the upper triangle is
    // analysed
    let settings = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
        ..Default::default()
    };
    factorize_symbolic_cholesky(view(A).symbolic(), Side::Upper, ordering, settings).ok()
}

/// Negative pivots of `A = L D Lᵀ` in the given order; `None` where rounding may have changed the
/// sign of one.
fn negative_pivots(A: &SparseMatrix) -> Option<usize> {
    let symbolic = symbolic(A, SymmetricOrdering::Identity)?;
    let mut values = vec![0.0; symbolic.len_val()];
    let scratch = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
    let mut scratch = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut scratch);
    let (regularization, settings) = (Default::default(), Default::default());
    let side = Side::Upper;
    symbolic
        .factorize_numeric_ldlt(
            &mut values,
            view(A),
            side,
            regularization,
            Par::Seq,
            stack,
            settings,
        )
        .ok()?;
    let SymbolicCholeskyRaw::Simplicial(factor) = symbolic.raw() else { return None };
    let (starts, rows) = (factor.col_ptr(), factor.row_idx());
    let mut grown = vec![0.0; factor.nrows()]; // diagonal of |L||D||Lᵀ|
    let mut negative = 0;
    for k in 0..factor.nrows() {
        let (start, end) = (starts[k], starts[k + 1]);
        let pivot = values[start];
        if !pivot.is_finite() || pivot == 0.0 {
            return None;
        }
        negative += usize::from(pivot < 0.0);
        grown[k] += pivot.abs();
        for place in start + 1..end {
            grown[rows[place]] += values[place] * values[place] * pivot.abs();
        }
    }
    let largest = grown.iter().fold(0.0, |largest: f64, g| if *g > largest { *g } else { largest });
    let finite = grown.iter().all(|g| g.is_finite());
    (finite && largest <= GROWN).then_some(negative)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use vi_testkit::Sample;

    fn sparse(A: &DMatrix<f64>) -> SparseMatrix {
        SparseMatrix::assemble(A.nrows(), A.ncols(), |out| {
            for i in 0..A.nrows() {
                for j in (0..A.ncols()).filter(|&j| A[(i, j)] != 0.0) {
                    out.add(i, j, A[(i, j)]);
                }
            }
        })
    }

    /// Chains with springs of mixed sign and stiffnesses over twelve decades, and rows between
    /// neighbours.
    #[test]
    fn the_count_is_that_of_the_dense_reduced_matrix() {
        let mut sample = Sample::new(7);
        let mut seen = [0; 6];
        for case in 0..200 {
            let (d, m) = (12, case % 5);
            let mut K = DMatrix::<f64>::zeros(d, d);
            let stiff = if case % 2 == 0 { 1e12 } else { 1.0 };
            for i in 0..d - 1 {
                let k = sample.number() * if i % 3 == 0 { stiff } else { 1.0 };
                let k = if k < -0.6 * stiff { k } else { k.abs() };
                K[(i, i)] += k;
                K[(i + 1, i + 1)] += k;
                K[(i, i + 1)] -= k;
                K[(i + 1, i)] -= k;
            }
            for i in (0..d).step_by(4) {
                K[(i, i)] += sample.number();
            }
            let mut B = DMatrix::<f64>::zeros(m, d);
            for k in 0..m {
                B[(k, 2 * k)] = 1.0 + sample.number().abs();
                B[(k, 2 * k + 1)] = sample.number();
            }
            let found = negative_on_null_space(&sparse(&K), &sparse(&B)).unwrap();
            // Z: x_{2k} = −b₂/b₁ x_{2k+1}
            let free: Vec<usize> = (0..d).filter(|&j| j >= 2 * m || j % 2 == 1).collect();
            let Z = DMatrix::from_fn(d, free.len(), |i, c| {
                let own = if i == free[c] { 1.0 } else { 0.0 };
                let bound = i < 2 * m && i % 2 == 0 && free[c] == i + 1;
                if bound { -B[(i / 2, i + 1)] / B[(i / 2, i)] } else { own }
            });
            let reduced = Z.transpose() * &K * &Z;
            let scale =
                DMatrix::from_diagonal(&reduced.diagonal().map(|k| 1.0 / k.abs().max(1e-3).sqrt()));
            let values = (&scale * reduced * &scale).symmetric_eigenvalues();
            let exact = values.iter().filter(|value| **value < 0.0).count();
            assert_eq!(found, exact, "case {case}: {values:?}");
            seen[exact.min(5)] += 1;
        }
        println!("matrices by their number of negative eigenvalues: {seen:?}");
        assert!(seen.iter().filter(|count| **count > 0).count() >= 4, "{seen:?}");
    }

    #[test]
    fn bodies_without_stiffness_of_their_own_are_held_by_their_rows() {
        // a bar of two unknowns, its end on a row, with a torsion spring of −1
        let K = DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 0.0, -1.0]);
        let B = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
        assert_eq!(negative_on_null_space(&sparse(&K), &sparse(&B)), Some(1));
        let held = DMatrix::from_row_slice(1, 2, &[0.0, 1.0]);
        assert_eq!(negative_on_null_space(&sparse(&(-K.transpose())), &sparse(&held)), Some(0));
        assert_eq!(negative_on_null_space(&sparse(&(0.0 * K)), &sparse(&held)), Some(0));
    }
}
