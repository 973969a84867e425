//! The fastest small motion about a node: what a step has to resolve.
//!
//! ```text
//! K = ∇²V + Σ λ_i D²g_i,     ω² x = P (PᵀMP)⁻¹ Pᵀ K x,     x in the range of P                 |ω²| largest
//! ```
//! `Σ λ_i D²g_i` is the geometric stiffness of the constraint forces `−Gᵀλ` of the acceleration
//! level: taut links vibrate by it, and a body that spins at `ω` has `ω² = −ω²`. Constraint forces
//! of a step act at its nodes, as in the Störmer–Verlet method: where `ω` is that of the geometric
//! stiffness alone, a step is stable below `h ω = 2` only.
//!
//! Lanczos' method in the inner product of `M`. `P (PᵀMP)⁻¹ Pᵀ` is the velocity of a projected
//! momentum, so the time is that of some tens of nodes: linear where reading a node is.
//!
//! Source: B. N. Parlett, The Symmetric Eigenvalue Problem (1998), §13; E. Hairer, Ch. Lubich, G.
//! Wanner, Geometric Numerical Integration (2006), §I.5.
#![allow(non_snake_case)] // K, M, P

use nalgebra::DMatrix;
use vi_core::linear::{Singular, dot};
use vi_core::sparse::SparseMatrix;

/// Most iterations: the largest eigenvalue is then right to some parts in a thousand.
const ITERATIONS: usize = 40;
/// Iterations between two looks at the eigenvalue.
const LOOK: usize = 4;
/// Relative change of `ω²` that ends the iteration.
const SETTLED: f64 = 1e-3;
/// A new direction of this size, relative to what it is made from, may be that of round-off, which
/// no constraint allows.
const ROUND_OFF: f64 = 1e-6;

/// The fastest small motion about a node.
#[derive(Clone, Debug, PartialEq)]
pub struct FastestMotion {
    /// `ω²`, rad²/s²: negative where the motion grows. To some parts in a thousand, from below.
    pub squared: f64,
    /// Its velocity, `xᵀMx = 1`, shape `n`; zero where nothing can move.
    pub velocity: Vec<f64>,
}

impl FastestMotion {
    /// `√|ω²|`, rad/s.
    #[must_use]
    pub fn omega(&self) -> f64 {
        self.squared.abs().sqrt()
    }
}

/// The fastest small motions about a node.
#[derive(Clone, Debug, PartialEq)]
pub struct FastestMotions {
    /// With the stiffness of potentials and of all constraint forces.
    pub all: FastestMotion,
    /// With that of some constraint forces alone.
    pub by_constraint_forces: FastestMotion,
    /// Whether potentials have a larger stiffness along that motion. They act at the middle of a
    /// step, and such a motion is stable at steps of any length.
    pub held: bool,
}

/// `xᵀKx`.
pub(crate) fn quotient(K: &SparseMatrix, x: &[f64]) -> f64 {
    let mut sum = 0.0;
    K.for_each(|i, j, value| sum += x[i] * value * x[j]);
    sum
}

/// A mass matrix on the directions that constraints allow.
pub(crate) trait ConstrainedMass {
    /// `v ← P (PᵀMP)⁻¹ Pᵀ p`.
    fn velocity(&mut self, p: &[f64], v: &mut [f64]) -> Result<(), Singular>;
    /// `p ← M v`.
    fn momentum(&mut self, v: &[f64], p: &mut [f64]);
}

/// Of the symmetric part of `K`, shape `n × n`.
///
/// # Errors
/// [`Singular`], also where a value is not finite.
pub(crate) fn fastest_motion(
    K: &SparseMatrix,
    mass: &mut dyn ConstrainedMass,
) -> Result<FastestMotion, Singular> {
    let n = K.shape().0;
    let (mut y, mut My) = (scattered(n), vec![0.0; n]);
    let mut force = y.clone();
    mass.velocity(&force, &mut y)?;
    let (mut basis, mut diagonal, mut beside) = (Vec::<Vec<f64>>::new(), Vec::new(), Vec::new());
    let mut last = FastestMotion { squared: 0.0, velocity: vec![0.0; n] };
    let mut size = 0.0;
    loop {
        mass.momentum(&y, &mut My);
        let square = dot(&y, &My);
        if !square.is_finite() {
            return Err(Singular);
        }
        let norm = square.max(0.0).sqrt();
        let exhausted = norm <= ROUND_OFF * size;
        if exhausted && basis.is_empty() {
            return Ok(last); // nothing can move
        }
        if exhausted || basis.len().is_multiple_of(LOOK) && !basis.is_empty() {
            let found = ritz(&basis, &diagonal, &beside);
            let settled = (found.squared - last.squared).abs() <= SETTLED * found.squared.abs();
            if exhausted || settled || basis.len() >= ITERATIONS {
                return Ok(found);
            }
            last = found;
        }
        if !basis.is_empty() {
            beside.push(norm);
        }
        basis.push(y.iter().map(|y| y / norm).collect());
        let Some(x) = basis.last() else { return Err(Singular) };
        force.fill(0.0);
        K.mul_add(0.5, x, &mut force);
        K.tr_mul_add(0.5, x, &mut force);
        diagonal.push(dot(x, &force)); // xᵀKx
        mass.velocity(&force, &mut y)?;
        mass.momentum(&y, &mut My);
        size = dot(&y, &My).max(0.0).sqrt();
        for x in basis.iter().rev() {
            let part = dot(x, &My);
            y.iter_mut().zip(x).for_each(|(y, x)| *y -= part * x);
        }
    }
}

/// The eigenvalue of largest size of the tridiagonal matrix, with its vector.
fn ritz(basis: &[Vec<f64>], diagonal: &[f64], beside: &[f64]) -> FastestMotion {
    let mut T = DMatrix::zeros(diagonal.len(), diagonal.len());
    diagonal.iter().enumerate().for_each(|(k, a)| T[(k, k)] = *a);
    for (k, b) in beside.iter().enumerate() {
        (T[(k, k + 1)], T[(k + 1, k)]) = (*b, *b);
    }
    let eigen = T.symmetric_eigen();
    let k = eigen.eigenvalues.iamax();
    let mut velocity = vec![0.0; basis[0].len()];
    for (x, part) in basis.iter().zip(eigen.eigenvectors.column(k).iter()) {
        velocity.iter_mut().zip(x).for_each(|(v, x)| *v += part * x);
    }
    FastestMotion { squared: eigen.eigenvalues[k], velocity }
}

/// Numbers in `[−1, 1)` without order, the same in every run: a momentum in which every motion has
/// a part.
fn scattered(n: usize) -> Vec<f64> {
    let number = |i: u64| {
        let bits = (i + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        f64::from((bits >> 32) as u32) / f64::from(1_u32 << 31) - 1.0
    };
    (0..n as u64).map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Masses without constraints.
    struct Diagonal(Vec<f64>);

    impl ConstrainedMass for Diagonal {
        fn velocity(&mut self, p: &[f64], v: &mut [f64]) -> Result<(), Singular> {
            v.iter_mut().zip(p).zip(&self.0).for_each(|((v, p), m)| *v = p / m);
            Ok(())
        }
        fn momentum(&mut self, v: &[f64], p: &mut [f64]) {
            p.iter_mut().zip(v).zip(&self.0).for_each(|((p, v), m)| *p = v * m);
        }
    }

    fn chain(n: usize, scale: f64) -> SparseMatrix {
        SparseMatrix::assemble(n, n, |out| {
            for i in 0..n {
                out.add(i, i, 2.0 * scale);
                if i > 0 {
                    out.add(i, i - 1, -scale);
                    out.add(i - 1, i, -scale);
                }
            }
        })
    }

    #[test]
    fn a_chain_of_masses_has_its_closed_form() {
        // ω² = 2k/m (1 − cos(π k/(n + 1)))
        for (n, scale) in [(1, 1.0), (3, 1.0), (500, 1.0), (500, -7.0)] {
            let found = fastest_motion(&chain(n, scale), &mut Diagonal(vec![0.5; n])).unwrap();
            let exact =
                4.0 * scale * (1.0 - (std::f64::consts::PI * n as f64 / (n + 1) as f64).cos());
            let error = found.squared / exact - 1.0;
            println!("{n}: {} of {exact}, {error:.1e}", found.squared);
            assert!((-0.02..1e-12).contains(&error), "{n}: {error:e}");
            let own: f64 = found.velocity.iter().map(|x| 0.5 * x * x).sum();
            assert!((own - 1.0).abs() < 1e-10, "{own}");
        }
    }

    #[test]
    fn a_light_mass_stands_out() {
        let mut masses = vec![1.0; 300];
        masses[77] = 1e-4;
        let found = fastest_motion(&chain(300, 1.0), &mut Diagonal(masses)).unwrap();
        let most = found.velocity.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        println!("{} at {most:?}", found.squared);
        assert!((found.squared / 2e4 - 1.0).abs() < 1e-3 && most.unwrap().0 == 77);
    }

    #[test]
    fn without_stiffness_or_freedom_it_is_zero() {
        struct Locked;
        impl ConstrainedMass for Locked {
            fn velocity(&mut self, _: &[f64], v: &mut [f64]) -> Result<(), Singular> {
                v.fill(0.0);
                Ok(())
            }
            fn momentum(&mut self, v: &[f64], p: &mut [f64]) {
                p.copy_from_slice(v);
            }
        }
        let locked = fastest_motion(&chain(4, 1.0), &mut Locked).unwrap();
        let free = fastest_motion(&chain(4, 0.0), &mut Diagonal(vec![1.0; 4])).unwrap();
        assert!(locked.squared == 0.0 && free.squared == 0.0);
    }
}
