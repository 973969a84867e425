//! Linear buckling: the loads at which a static state loses its stability, by its stiffness alone.
//!
//! ```text
//! (K_0 + λ K_1) x = 0,   B x = 0        t + λ critical load parameter,  K_1 = dK/dt along the path of the loads
//! −K_1 x = θ K_0 x,   θ = 1/λ           K_0 positive definite: all θ are real
//! ```
//! `K_0` is the stiffness at the state with all that acts there; `K_1` that of the stresses that
//! the loads of the path add (in the geometry of the state). Constant loads keep their part of
//! `K_0`. The prediction is exact where the stresses grow in proportion to the loads and the
//! configuration hardly moves before it buckles; from a state nearer to the critical load it is
//! better. The largest `|θ|` are found by subspace iteration with `K_0⁻¹K_1`, linear in the size of
//! the system. Where loads follow the motion `K_1` is not symmetric and `θ` are those of the pencil
//! as it is, by orthogonal iteration: a real one is a load at which a neighbouring equilibrium
//! appears, divergence. Where none is real there is flutter alone, which no stiffness shows.
//!
//! Source: theory §6.9; K.-J. Bathe, Finite Element Procedures (1996), §6.8.2, §11.6.
#![allow(non_snake_case)] // K, X, Y, A

use crate::lowest::{Pencil, congruence, orthonormal, product};
use crate::modes::ModeError;
use crate::problem::StaticProblem;
use nalgebra::{Complex, DMatrix, SVD, Schur, SymmetricEigen};
use vi_core::newton::Fault;
use vi_core::sparse::SparseMatrix;

/// Most iterations of one subspace.
const ITERATIONS: usize = 300;
/// Change of `θ`, as a part of the largest, that ends an iteration.
const SETTLED: f64 = 1e-12;
/// `θ` beside the largest that are rounding.
const ROUNDING: f64 = 1e-9;
/// Asymmetry of the stiffness among the shapes, beside 1, above which loads have no potential.
const SYMMETRIC: f64 = 1e-6;

/// Imaginary part of a real `θ`, beside it: a pair that meets parts by the root of rounding.
const REAL: f64 = 1e-6;
/// Residual of a shape beside it.
const HOLDS: f64 = 1e-6;
/// Steps of the QR algorithm.
const SCHUR_STEPS: usize = 10_000;

/// Why there are no critical loads.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BucklingError {
    /// The state is unstable already.
    #[error("the state is unstable already, in {0} directions: it is beyond its critical load")]
    Unstable(usize),
    /// The signs of the stiffness are not known.
    #[error("whether the state is stable is not known: a steady rotation, or rounding hides it")]
    Unjudged,
    /// Some direction has no stiffness.
    #[error("a direction has no stiffness in the state: there is no load at which it loses it")]
    Neutral,
    /// Loads follow the motion so that they have no potential, and none is one of divergence.
    #[error(
        "the loads have no potential, and no multiple of them takes the stiffness away: it is not symmetric by \
         {0:.1e} of its size, and its load factors are not real; what they may excite is flutter"
    )]
    NoPotential(f64),
    /// No load of the path changes the stiffness.
    #[error("no load that changes along the path acts on the stiffness")]
    NoLoad,
    /// A value is not finite, or the iteration did not settle.
    #[error("the critical loads were not found: {0}")]
    NotFound(ModeError),
}

impl From<ModeError> for BucklingError {
    fn from(error: ModeError) -> Self {
        Self::NotFound(error)
    }
}

impl From<Fault> for BucklingError {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::SingularTangent => Self::Neutral,
            _ => Self::NotFound(ModeError::NotFinite),
        }
    }
}

/// The critical loads of a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Buckling {
    /// Critical load parameters, the lowest beyond that of the state first.
    pub critical: Vec<f64>,
    /// Columns: velocities of all coordinates in which it buckles, shape `n × k`.
    pub shapes: DMatrix<f64>,
    /// The first critical load parameter below that of the state: where the loads are reversed.
    pub reversed: Option<f64>,
    /// `|x + λ K_0⁻¹K_1 x|/|x|`, the largest.
    pub residual: f64,
    /// By how much the stiffness among the shapes is not symmetric, as a part of its size, where
    /// loads have no potential; otherwise zero.
    pub asymmetry: f64,
}

impl StaticProblem {
    /// The `count` lowest critical load parameters at the last equilibrium, fewer where there are
    /// no more.
    ///
    /// # Errors
    /// [`BucklingError`].
    pub fn buckling(&mut self, count: usize) -> Result<Buckling, BucklingError> {
        let signs = self.stiffness().ok_or(BucklingError::Unjudged)?;
        match signs.negative(0.0) {
            Some(0) => {}
            Some(unstable) => return Err(BucklingError::Unstable(unstable)),
            None => return Err(BucklingError::Unjudged),
        }
        if self.is_neutral_here() {
            return Err(BucklingError::Neutral);
        }
        let mu = self.mu.clone();
        let K_1 = self.work.path_stiffness(&mu)?;
        let mut pencil = Pencil::new(self.work.frame_matrices());
        let dof = pencil.matrices.K.shape().0 - pencil.matrices.B.shape().0;
        let mut block = (2 * count + 14).min(dof);
        loop {
            let found = subspace(&mut pencil, &K_1, block)?;
            let positive = found.theta.iter().filter(|theta| **theta > found.rounding()).count();
            if positive < count && block < dof {
                block = (4 * block).min(dof);
                continue;
            }
            return self.critical_loads(&mut pencil, &K_1, &found, count);
        }
    }

    fn critical_loads(
        &mut self,
        pencil: &mut Pencil,
        K_1: &SparseMatrix,
        found: &BucklingSubspace,
        count: usize,
    ) -> Result<Buckling, BucklingError> {
        let X = &found.X;
        let skew = [&pencil.matrices.K, K_1].map(|A| congruence(A, X)).map(|A| &A - A.transpose());
        let asymmetry = skew[0].amax().max(skew[1].amax() / found.largest());
        if asymmetry > SYMMETRIC {
            let real = divergence(pencil, K_1, X.ncols())?;
            if !real.theta.iter().any(|theta| *theta > 0.0) {
                return Err(BucklingError::NoPotential(asymmetry));
            }
            return self.listed(pencil, K_1, &real, count, asymmetry);
        }
        self.listed(pencil, K_1, found, count, 0.0)
    }

    /// The lowest loads of real `θ`.
    fn listed(
        &mut self,
        pencil: &mut Pencil,
        K_1: &SparseMatrix,
        found: &BucklingSubspace,
        count: usize,
        asymmetry: f64,
    ) -> Result<Buckling, BucklingError> {
        let BucklingSubspace { theta, X } = found;
        let small = found.rounding();
        let mut order: Vec<usize> = (0..theta.len()).filter(|&k| theta[k] > small).collect();
        order.sort_by(|&i, &j| theta[j].total_cmp(&theta[i]));
        order.truncate(count);
        let lowest = theta.iter().copied().fold(0.0, f64::min);
        let t = self.factor();
        let reversed = (lowest < -small).then(|| t + 1.0 / lowest);
        let chosen = DMatrix::from_fn(X.nrows(), order.len(), |i, k| X[(i, order[k])]);
        let mapped = pencil.solve(&product(K_1, &chosen))?;
        let mut residual = 0.0_f64;
        for (k, &place) in order.iter().enumerate() {
            let off = chosen.column(k) + mapped.column(k) / theta[place];
            residual = residual.max(off.norm() / chosen.column(k).norm());
        }
        let critical = order.iter().map(|&k| t + 1.0 / theta[k]).collect();
        let shapes = self.work.velocities(&chosen);
        Ok(Buckling { critical, shapes, reversed, residual, asymmetry })
    }
}

/// `−K_1 X = K_0 X diag(θ)` in a subspace; the largest `|θ|` first, `XᵀK_0X = 1`.
struct BucklingSubspace {
    theta: Vec<f64>,
    X: DMatrix<f64>,
}

impl BucklingSubspace {
    fn largest(&self) -> f64 {
        self.theta.iter().fold(0.0, |largest: f64, theta| largest.max(theta.abs()))
    }

    /// Those of which `−K_0⁻¹K_1 x = θ x` holds.
    fn settled(self, pencil: &mut Pencil, K_1: &SparseMatrix) -> Result<Self, BucklingError> {
        let Self { theta, X } = self;
        let mapped = pencil.solve(&product(K_1, &X))?;
        let holds = |k: &usize| {
            let off = X.column(*k) + mapped.column(*k) / theta[*k];
            off.norm() <= HOLDS * X.column(*k).norm()
        };
        let own: Vec<usize> = (0..theta.len()).filter(holds).collect();
        let kept = DMatrix::from_fn(X.nrows(), own.len(), |i, k| X[(i, own[k])]);
        Ok(Self { theta: own.iter().map(|&k| theta[k]).collect(), X: kept })
    }

    /// The size of `θ` that rounding may cause.
    fn rounding(&self) -> f64 {
        ROUNDING * self.largest()
    }
}

/// Subspace iteration until the larger half has settled.
fn subspace(
    pencil: &mut Pencil,
    K_1: &SparseMatrix,
    block: usize,
) -> Result<BucklingSubspace, BucklingError> {
    let d = K_1.shape().0;
    let none = DMatrix::zeros(d, 0);
    let mut X = DMatrix::from_fn(d, block, |i, k| {
        (1.0 + (i * (block + 1) + k) as f64).sqrt().fract() - 0.5
    });
    X = pencil.solve(&X)?; // within the constraints
    let mut last: Vec<f64> = Vec::new();
    for _ in 0..ITERATIONS {
        let Y = pencil.solve(&product(K_1, &X))?;
        if Y.amax() == 0.0 {
            return Err(BucklingError::NoLoad);
        }
        let Y = orthonormal(&pencil.matrices.K, &none, Y.column_iter().map(|y| y.into_owned()));
        let A = congruence(K_1, &Y);
        if A.iter().any(|a| !a.is_finite()) {
            return Err(BucklingError::NotFound(ModeError::NotFinite));
        }
        let eigen = SymmetricEigen::new(-0.5 * (&A + A.transpose()));
        let mut order: Vec<usize> = (0..Y.ncols()).collect();
        let values = &eigen.eigenvalues;
        order.sort_by(|&i, &j| values[j].abs().total_cmp(&values[i].abs()));
        let theta: Vec<f64> = order.iter().map(|&k| values[k]).collect();
        let vectors =
            DMatrix::from_fn(Y.ncols(), order.len(), |i, k| eigen.eigenvectors[(i, order[k])]);
        X = Y * vectors;
        let pairs = theta.iter().zip(&last).take(theta.len().div_ceil(2));
        let settled = last.len() == theta.len()
            && pairs.into_iter().all(|(a, b)| (a - b).abs() <= SETTLED * theta[0].abs());
        last = theta;
        if settled {
            break;
        }
    }
    Ok(BucklingSubspace { theta: last, X })
}

/// The real `θ` among the largest of `−K_1 x = θ K_0 x` that is not symmetric, and their `x`: an
/// orthogonal iteration until the larger half has settled.
fn divergence(
    pencil: &mut Pencil,
    K_1: &SparseMatrix,
    block: usize,
) -> Result<BucklingSubspace, BucklingError> {
    let d = K_1.shape().0;
    let none = DMatrix::zeros(d, 0);
    let begin = DMatrix::from_fn(d, block, |i, k| {
        (1.0 + (i * (block + 1) + k) as f64).sqrt().fract() - 0.5
    });
    let mut Z = pencil.solve(&begin)?;
    let mut last: Vec<Complex<f64>> = Vec::new();
    let mut iteration = 0;
    loop {
        let Y = orthonormal(&pencil.matrices.K, &none, Z.column_iter().map(|z| z.into_owned()));
        let H = -congruence(K_1, &Y);
        let schur = Schur::try_new(H.clone(), f64::EPSILON, SCHUR_STEPS);
        let schur = schur.ok_or(BucklingError::NotFound(ModeError::NotFinite))?;
        let mut values: Vec<Complex<f64>> = schur.complex_eigenvalues().iter().copied().collect();
        values.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
        let pairs = values.iter().zip(&last).take(values.len().div_ceil(2));
        let size = values.first().map_or(0.0, |own| own.norm());
        let settled = last.len() == values.len()
            && pairs.into_iter().all(|(a, b)| (a - b).norm() <= SETTLED * size);
        (last, iteration) = (values, iteration + 1);
        if settled || iteration == ITERATIONS {
            let found = real_part(&H, &Y, &last);
            return found.settled(pencil, K_1);
        }
        Z = pencil.solve(&product(K_1, &Y))?;
    }
}

/// The real ones of the larger half of the eigenvalues of `H`, with `Y` times their vectors.
fn real_part(H: &DMatrix<f64>, Y: &DMatrix<f64>, values: &[Complex<f64>]) -> BucklingSubspace {
    let size = values.first().map_or(0.0, |own| own.norm());
    let is_real = |own: &&Complex<f64>| own.im.abs() <= REAL * own.norm();
    // the smaller half has not settled, and is that of the elements
    let larger = values.iter().take(values.len().div_ceil(2));
    let real = larger.filter(is_real).filter(|own| own.norm() > ROUNDING * size);
    let theta: Vec<f64> = real.map(|own| own.re).collect();
    let mut X = DMatrix::zeros(Y.nrows(), theta.len());
    for (k, own) in theta.iter().enumerate() {
        // the vectors of one that is multiple are those of as many least singular values
        let same = theta[..k].iter().filter(|other| (*other - own).abs() <= REAL * own.abs());
        let shifted = H - DMatrix::from_diagonal_element(H.nrows(), H.ncols(), *own);
        let SVD { v_t, singular_values, .. } = SVD::new(shifted, false, true);
        let Some(v_t) = v_t else { continue };
        let mut order: Vec<usize> = (0..singular_values.len()).collect();
        order.sort_by(|&i, &j| singular_values[i].total_cmp(&singular_values[j]));
        X.set_column(k, &(Y * v_t.row(order[same.count()]).transpose()));
    }
    BucklingSubspace { theta, X }
}
