//! The lowest modes of a large system by subspace iteration, linear in its size.
//!
//! ```text
//! [ K + σM  Bᵀ ] [Y]   [M X]
//! [   B     0  ] [·] = [ 0 ],     X ← Y Z with the modes Z of YᵀKY, YᵀMY                   B = G P_in
//! (K + σM) y + Bᵀ· = −((λ² − σ) M + λ C) x,   B y = 0                  more columns where C ≠ 0: Re y, Im y
//! ```
//! Every frame moves on its own and joints are rows of `B`: the matrices are sparse and one case
//! for trees and loops. The shift starts at the size of the stiffness and comes down to that of the
//! seventh mode, or well below an unstable one, so that no unstable mode is beyond it. How many
//! unstable ones there are the signs of `K + ςM` on the null space of `B` say
//! ([`vi_core::inertia`]); the subspace grows until it has them all. All else happens in it:
//! [`crate::modes`], [`mod@crate::vibrations`].
//!
//! Source: K.-J. Bathe, Finite Element Procedures (1996), §11.6, subspace iteration; Z. Bai, Y. Su,
//! SIAM J. Matrix Anal. Appl. 26 (2005) 640–659, subspaces of second order.
#![allow(non_snake_case)] // K, C, M, B, X, Y

use crate::equations::{FrameMatrices, separate};
use crate::modes::{ForceBalance, ModeError, StaticLinearization, Subspace, entry_noise};
use crate::problem::StaticProblem;
use crate::stability::TangentStiffness;
use crate::vibrations::{MotionKind, motion};
use nalgebra::{Complex, DMatrix, DVector};
use vi_core::eigen::{Eigen, generalized_eigen};
use vi_core::inertia::negative_on_null_space;
use vi_core::linear::SparseLu;
use vi_core::quadratic_eigen::{QuadraticEigen, QuadraticPair};
use vi_core::sparse::{Block, Entries, SparseMatrix};

/// Most iterations with one shift, and most shifts.
const ITERATIONS: usize = 60;
const SHIFTS: usize = 8;
/// Iterations of the columns for damping and gyroscopic terms.
const SECOND_ORDER: usize = 12;
/// Modes beyond those asked for, among them rigid-body motions.
const SPARE: usize = 14;
/// Most sizes of the subspace.
const TRIALS: usize = 4;
/// Degrees of freedom up to which all modes are found where most of them are wanted.
const DENSE: usize = 1200;
/// Asymmetry of the stiffness, as a part of its size, that is round-off.
const SYMMETRIC: f64 = 1e-13;
/// Change of an eigenvalue, as a part of itself, that ends an iteration.
const SETTLED: f64 = 1e-12;
/// The shift in units of the diagonal of the stiffness over that of the mass, at first.
const HIGH: f64 = 1e-4;

/// The pencil with a factorization at a shift.
pub(crate) struct Pencil {
    pub(crate) matrices: FrameMatrices,
    sigma: f64,
    factors: Option<(SparseMatrix, SparseLu)>,
}

impl StaticLinearization {
    /// In the subspace of about `count` lowest modes beside those that are unstable or without
    /// stiffness: linear in the size of the system. All degrees of freedom where most of them would
    /// be in it.
    ///
    /// # Errors
    /// [`ModeError`]; [`ModeError::Unconfirmed`] where the modes found are not as many as the signs
    /// of the stiffness say, or change with the size of the subspace.
    pub fn lowest(problem: &mut StaticProblem, count: usize) -> Result<Self, ModeError> {
        let balance = ForceBalance::of(problem)?;
        let matrices = problem.work.frame_matrices();
        let signs =
            TangentStiffness::new(matrices.K.clone(), matrices.B.clone(), problem.work.metric());
        let asymmetry = asymmetry(&matrices.K);
        let mut pencil = Pencil::new(matrices);
        let dof = pencil.size() - pencil.matrices.B.shape().0;
        let mut is_second_order = asymmetry > SYMMETRIC;
        pencil.matrices.C.for_each(|_, _, value| is_second_order |= value != 0.0);
        let mut negative = signs.negative(0.0);
        let mut wanted = count + negative.unwrap_or(0) + SPARE;
        let (mut last, mut refused) = (None, ModeError::NotFinite);
        for _ in 0..TRIALS {
            if 4 * wanted >= dof && dof <= DENSE {
                return Self::all(problem);
            }
            wanted = wanted.min(dof);
            let (X, found) = pencil.undamped(wanted)?;
            let (X, residual) = if is_second_order {
                pencil.second_order(X, count + negative.unwrap_or(0))?
            } else {
                let (residual, settled) = pencil.settled(&X, &found.squared)?;
                (X.columns(0, settled).into_owned(), residual)
            };
            let FrameMatrices { K: stiffness, C, M, columns, .. } = &pencil.matrices;
            let [K, C, M] = [stiffness, C, M].map(|A| congruence(A, &X));
            let settled = X.ncols();
            let subspace = Some(Subspace { stiffness: stiffness.clone(), residual, negative });
            let (Z, layout, columns) =
                (Some(X), separate(&problem.work.mechanism), columns.clone());
            let mut linear = Self {
                K,
                C,
                M,
                Z,
                layout,
                columns,
                asymmetry,
                balance,
                dof,
                subspace,
                terms: None,
            };
            if is_second_order {
                let growing = linear.growing()?;
                let known = negative == Some(0) && growing == 0 && asymmetry <= SYMMETRIC;
                if known || last == Some(growing) {
                    return Ok(linear);
                }
                let expected = last.unwrap_or(growing);
                refused = ModeError::Unconfirmed { found: growing, expected };
                last = Some(growing);
                wanted += SPARE + growing;
                continue;
            }
            let ModeCounts { unstable, zero, shift } = linear.counts()?;
            negative = pencil.negative(shift);
            let least = (unstable + zero + count).min(dof);
            match negative {
                Some(expected) if expected == unstable && settled >= least => {
                    linear.subspace.as_mut().expect("just written").negative = negative;
                    return Ok(linear);
                }
                Some(expected) if expected == unstable => {
                    refused = ModeError::NotSettled { found: settled, wanted: least };
                }
                Some(expected) => {
                    refused = ModeError::Unconfirmed { found: unstable, expected };
                }
                None => refused = ModeError::Uncounted,
            }
            wanted = (2 * wanted).max(negative.unwrap_or(0) + zero + count + SPARE);
        }
        Err(refused)
    }

    /// How many eigenvalues grow, those of a pair both counted.
    fn growing(&self) -> Result<usize, ModeError> {
        let eigen = QuadraticEigen::new(&self.K, &self.C, &self.M)?;
        let grows = |value: &&Complex<f64>| motion(**value) == MotionKind::Growth;
        let both = |value: &Complex<f64>| if value.im > 0.0 { 2 } else { 1 };
        Ok(eigen.values().iter().filter(grows).map(both).sum())
    }

    /// What the undamped modes are.
    fn counts(&self) -> Result<ModeCounts, ModeError> {
        let found = generalized_eigen(&(0.5 * (&self.K + self.K.transpose())), &self.M)?;
        let noise = self.noise(&found);
        let pairs = || found.squared.iter().zip(&noise);
        let sizes = pairs().filter(|(square, noise)| square.abs() > **noise);
        let least = sizes.map(|(square, _)| square.abs()).fold(f64::INFINITY, f64::min);
        Ok(ModeCounts {
            unstable: pairs().filter(|(square, noise)| **square < -**noise).count(),
            zero: pairs().filter(|(square, noise)| square.abs() <= **noise).count(),
            shift: if least.is_finite() { 0.5 * least } else { 0.0 },
        })
    }
}

/// How many modes there are of a kind.
struct ModeCounts {
    unstable: usize,
    zero: usize,
    shift: f64, // between those that are round-off and the others, rad²/s²
}

impl Pencil {
    pub(crate) fn new(matrices: FrameMatrices) -> Self {
        Self { matrices, sigma: 0.0, factors: None }
    }

    fn size(&self) -> usize {
        self.matrices.K.shape().0
    }

    /// Negative eigenvalues of `K + ςM` on the null space of `B`.
    fn negative(&self, shift: f64) -> Option<usize> {
        let FrameMatrices { K, M, B, .. } = &self.matrices;
        let shifted = SparseMatrix::assemble(self.size(), self.size(), |out| {
            K.emit(out);
            M.emit(&mut Block { into: out, row: 0, column: 0, scale: shift, transposed: false });
        });
        negative_on_null_space(&shifted, B)
    }

    /// `Y` of `[K + σM, Bᵀ; B, 0] [Y; ·] = [R; 0]`.
    pub(crate) fn solve(&mut self, R: &DMatrix<f64>) -> Result<DMatrix<f64>, ModeError> {
        let FrameMatrices { K, M, B, .. } = &self.matrices;
        let (d, rows, sigma) = (K.shape().0, B.shape().0, self.sigma);
        let scale = 1.0 / largest_diagonal(K).max(f64::MIN_POSITIVE);
        let emit = |out: &mut dyn Entries| {
            let mut block = |row, column, scale, transposed, A: &SparseMatrix| {
                A.emit(&mut Block { into: out, row, column, scale, transposed });
            };
            block(0, 0, scale, false, K);
            block(0, 0, scale * sigma, false, M);
            block(d, 0, 1.0, false, B);
            block(0, d, 1.0, true, B);
        };
        if self.factors.is_none() {
            let matrix = SparseMatrix::assemble(d + rows, d + rows, emit);
            let lu = SparseLu::new(&matrix).map_err(|_| ModeError::NoMass)?;
            self.factors = Some((matrix, lu));
        }
        let (matrix, lu) = self.factors.as_mut().expect("just written");
        // [6.30]
        let mut b = DMatrix::zeros(d + rows, R.ncols());
        b.rows_mut(0, d).copy_from(&(scale * R));
        lu.solve(matrix, b.as_mut_slice()).map_err(|_| ModeError::NoMass)?;
        Ok(b.rows(0, d).into_owned())
    }

    /// One round: `Y = (K + σM)⁻¹ M X`, and the modes in its span.
    fn round(&mut self, X: &DMatrix<f64>) -> Result<(DMatrix<f64>, Eigen), ModeError> {
        let Y = self.solve(&product(&self.matrices.M, X))?;
        let none = DMatrix::zeros(X.nrows(), 0);
        let Y = orthonormal(&self.matrices.M, &none, Y.column_iter().map(|y| y.into_owned()));
        let (K, M) = (congruence(&self.matrices.K, &Y), congruence(&self.matrices.M, &Y));
        let found = generalized_eigen(&(0.5 * (&K + K.transpose())), &M)?;
        Ok((Y * &found.vectors, found))
    }

    /// The `wanted` lowest undamped modes; those at the upper end have not settled.
    fn undamped(&mut self, wanted: usize) -> Result<(DMatrix<f64>, Eigen), ModeError> {
        let (d, block) = (self.size(), 2 * wanted);
        let dof = d - self.matrices.B.shape().0;
        let mut X = DMatrix::from_fn(d, block.min(dof), |i, k| {
            (1.0 + (i * (block + 1) + k) as f64).sqrt().fract() - 0.5
        });
        self.sigma = HIGH * largest_diagonal(&self.matrices.K)
            / largest_diagonal(&self.matrices.M).max(f64::MIN_POSITIVE);
        let mut last: Option<Eigen> = None;
        for _ in 0..SHIFTS {
            self.factors = None;
            for _ in 0..ITERATIONS {
                let (next, found) = self.round(&X)?;
                let settled = last.as_ref().is_some_and(|last| {
                    let pairs = found.squared.iter().zip(&last.squared).zip(&found.noise);
                    let mut lowest = pairs.take(wanted);
                    lowest.all(|((a, b), noise)| (a - b).abs() <= SETTLED * a.abs() + 10.0 * noise)
                });
                (X, last) = (next, Some(found));
                if settled {
                    break;
                }
            }
            let squared = &last.as_ref().expect("at least one iteration").squared;
            let mut sizes: Vec<f64> = squared.iter().map(|square| square.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            let target = (0.37 * sizes[6.min(sizes.len() - 1)]).max(-10.0 * squared[0]);
            if target > 0.1 * self.sigma || target <= 0.0 {
                break;
            }
            self.sigma = target;
        }
        let found = last.ok_or(ModeError::NotFinite)?;
        Ok((X, found))
    }

    /// The largest `|x − (ω² + σ)(K + σM)⁻¹Mx|/|x|` of the vibrations that have settled, and how
    /// many modes have; those without stiffness move by what is round-off in `K`.
    fn settled(&mut self, X: &DMatrix<f64>, squared: &[f64]) -> Result<(f64, usize), ModeError> {
        const GOOD: f64 = 1e-7;
        let Y = self.solve(&product(&self.matrices.M, X))?;
        let mut worst = 0.0_f64;
        for (k, square) in squared.iter().enumerate() {
            let (x, shifted) = (X.column(k), square + self.sigma);
            let residual = (x - Y.column(k) * shifted).norm() / x.norm();
            let noise = 100.0 * entry_noise(&self.matrices.K, x.as_slice());
            let good = residual <= GOOD + noise / shifted.abs(); // false for NaN
            if !good {
                return Ok((worst, k));
            }
            if square.abs() > noise {
                worst = worst.max(residual);
            }
        }
        Ok((worst, squared.len()))
    }

    /// Columns beside those of `X` in which the `count` lowest damped or gyroscopic modes are
    /// right; their largest residual.
    fn second_order(
        &mut self,
        X: DMatrix<f64>,
        count: usize,
    ) -> Result<(DMatrix<f64>, f64), ModeError> {
        let complex = |A: &SparseMatrix, x: &DMatrix<Complex<f64>>| {
            let parts = [x.map(|x| x.re), x.map(|x| x.im)].map(|x| product(A, &x));
            parts[0].zip_map(&parts[1], Complex::new)
        };
        let mut basis = X.clone();
        let mut residual = f64::INFINITY;
        for _ in 0..SECOND_ORDER {
            let [K, C, M] = [&self.matrices.K, &self.matrices.C, &self.matrices.M]
                .map(|A| congruence(A, &basis));
            let eigen = QuadraticEigen::new(&K, &C, &M)?;
            let values = eigen.values();
            let mut order: Vec<usize> = (0..values.len()).collect();
            order.sort_by(|&i, &j| values[i].norm().total_cmp(&values[j].norm()));
            order.truncate(count + SPARE);
            let pairs: Vec<QuadraticPair> = order.into_iter().map(|k| eigen.pair(k)).collect();
            let y: Vec<_> = pairs.iter().map(|pair| pair.vector.clone()).collect();
            let y = DMatrix::from_columns(&y);
            let x = (&basis * y.map(|y| y.re)).zip_map(&(&basis * y.map(|y| y.im)), Complex::new);
            let mut right = complex(&self.matrices.M, &x);
            let Cx = complex(&self.matrices.C, &x);
            for (k, pair) in pairs.iter().enumerate() {
                let shift = Complex::new(self.sigma, 0.0) - pair.value * pair.value;
                let column = right.column(k) * shift - Cx.column(k) * pair.value;
                right.set_column(k, &column);
            }
            let [re, im] = [self.solve(&right.map(|x| x.re))?, self.solve(&right.map(|x| x.im))?];
            let mut worst = 0.0_f64;
            for k in 0..count.min(pairs.len()) {
                let next = re.column(k).zip_map(&im.column(k), Complex::new);
                let off = (next - x.column(k)).norm() / x.column(k).norm();
                worst = if off > worst || off.is_nan() { off } else { worst };
            }
            let settled = worst >= 0.5 * residual; // no longer better
            residual = residual.min(worst);
            if settled || worst <= 1e-12 {
                break;
            }
            let both = (0..pairs.len()).flat_map(|k| [re.column(k), im.column(k)]);
            basis = orthonormal(&self.matrices.M, &X, both.map(|column| column.into_owned()));
        }
        Ok((basis, residual))
    }
}

/// `X` with what is new in `columns`, `M`-orthonormal.
pub(crate) fn orthonormal(
    M: &SparseMatrix,
    X: &DMatrix<f64>,
    columns: impl Iterator<Item = DVector<f64>>,
) -> DMatrix<f64> {
    const NEW: f64 = 1e-9;
    let norm = |x: &DVector<f64>| M.bilinear(x.as_slice(), x.as_slice()).sqrt();
    let mut basis: Vec<DVector<f64>> = X.column_iter().map(|x| x.into_owned()).collect();
    // twice: the first leaves what is lost to cancellation
    for column in columns {
        let mut x = column;
        let size = norm(&x);
        for _ in 0..2 {
            let mut Mx = vec![0.0; x.len()];
            M.mul_add(1.0, x.as_slice(), &mut Mx);
            let Mx = DVector::from_vec(Mx);
            let parts: Vec<f64> = basis.iter().map(|own| own.dot(&Mx)).collect();
            basis.iter().zip(parts).for_each(|(own, part)| x.axpy(-part, own, 1.0));
        }
        let left = norm(&x);
        if left > NEW * size {
            basis.push(x / left);
        }
    }
    DMatrix::from_columns(&basis)
}

/// `A X`.
pub(crate) fn product(A: &SparseMatrix, X: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(A.shape().0, X.ncols());
    A.mul_dense_add(1.0, X, &mut out);
    out
}

/// `XᵀAX`.
pub(crate) fn congruence(A: &SparseMatrix, X: &DMatrix<f64>) -> DMatrix<f64> {
    X.tr_mul(&product(A, X))
}

/// Largest entry of the diagonal.
fn largest_diagonal(A: &SparseMatrix) -> f64 {
    let mut largest = 0.0_f64;
    A.for_each(|i, j, value| largest = if i == j { largest.max(value.abs()) } else { largest });
    largest
}

/// `|A − Aᵀ|_∞ / |A|_∞` by entries.
fn asymmetry(A: &SparseMatrix) -> f64 {
    let (rows, columns) = A.shape();
    let difference = SparseMatrix::assemble(rows, columns, |out| {
        A.emit(out);
        A.emit(&mut Block { into: out, row: 0, column: 0, scale: -1.0, transposed: true });
    });
    let largest = |A: &SparseMatrix| {
        let mut largest = 0.0_f64;
        A.for_each(|_, _, value| largest = largest.max(value.abs()));
        largest
    };
    let size = largest(A);
    if size > 0.0 { largest(&difference) / size } else { 0.0 }
}
