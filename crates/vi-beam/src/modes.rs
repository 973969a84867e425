//! Small vibrations about an equilibrium.
//!
//! ```text
//! K_r x = ω² M_r x,     M_r = Pᵀ M P (definite although M is singular),   K_r reduced tangent stiffness
//! M_r = L Lᵀ,   (L⁻¹ K_r L⁻ᵀ) y = ω² y,   x = L⁻ᵀ y,   xᵀ M_r x = 1
//! ```
//! Rigid-body motions show as `ω² ≈ 0`, unstable directions as `ω² < 0`. Torques with fixed spatial
//! components and followers make `K_r` unsymmetric; its symmetric part is taken, and the asymmetry is
//! reported. Dense, `O(d³)`. The midpoint rule shows `ω` as `(2/h) arctan(ωh/2)`.
#![allow(non_snake_case)] // K, M, L

use crate::statics::StaticProblem;
use nalgebra::{DMatrix, SymmetricEigen};
use vi_core::sparse::Entries;
use vi_multibody::sparse_nodal::ReducedMatrix;

/// Why there are no modes.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModeError {
    /// The reduced mass is not positive definite.
    #[error("a free direction carries no mass: give the sections rotary inertia, or hold it")]
    NoMass,
}

/// Modes, softest first.
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    /// `ω²`, rad²/s².
    pub squared: Vec<f64>,
    /// `ω = √max(ω², 0)`, rad/s.
    pub omega: Vec<f64>,
    /// Columns: velocities `v = P x` of all coordinates, shape `n × d`, with `vᵀ M v = 1`.
    pub shapes: DMatrix<f64>,
    /// `|K_r − K_rᵀ|_∞ / |K_r|_∞`.
    pub asymmetry: f64,
}

/// The modes about the last equilibrium of a static problem.
///
/// # Errors
/// [`ModeError::NoMass`].
pub fn modes(problem: &mut StaticProblem) -> Result<Modes, ModeError> {
    let K = problem.tangent();
    let asymmetry = (&K - K.transpose()).amax() / K.amax().max(f64::MIN_POSITIVE);
    let work = &mut problem.work; // `left` is P(q) after `tangent`
    let emit = |out: &mut dyn Entries| work.mass.emit(out);
    let mut reduced = ReducedMatrix::default();
    reduced.fill(&work.layout, &emit, (&work.left, &work.left), &[]);
    let cholesky = reduced.to_dense().cholesky().ok_or(ModeError::NoMass)?;
    let L = cholesky.l();
    let solve = |matrix: &DMatrix<f64>| L.solve_lower_triangular(matrix).ok_or(ModeError::NoMass);
    let half = solve(&(0.5 * (&K + K.transpose())))?; // L⁻¹ K
    let standard = solve(&half.transpose())?;
    let eigen = SymmetricEigen::new(0.5 * (&standard + standard.transpose()));
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let squared: Vec<f64> = order.iter().map(|&k| eigen.eigenvalues[k]).collect();
    let mut x =
        DMatrix::from_fn(order.len(), order.len(), |i, j| eigen.eigenvectors[(i, order[j])]);
    if !L.tr_solve_lower_triangular_mut(&mut x) {
        return Err(ModeError::NoMass);
    }
    let mut shapes = DMatrix::zeros(work.s.dim(), order.len());
    for (k, column) in x.column_iter().enumerate() {
        let mut v = vec![0.0; work.s.dim()];
        work.layout.velocity(&work.left, column.clone_owned().as_slice(), &mut v);
        shapes.column_mut(k).copy_from_slice(&v);
    }
    let omega = squared.iter().map(|square| square.max(0.0).sqrt()).collect();
    Ok(Modes { squared, omega, shapes, asymmetry })
}
