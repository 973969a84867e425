//! `M⁻¹ p` with the constant mass matrix.
//!
//! Rigid bodies and point masses make `M` block diagonal: its inverse is found once and has the
//! same blocks. A consistent mass of elements couples whole beams; it is factorized each time.

use nalgebra::DMatrix;
use vi_core::isotropic::IsotropicBlocks;
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Entries, SparseMatrix};

/// Most coordinates of a block that is inverted by itself.
const LARGEST: usize = 12;

/// Applies `M⁻¹`.
#[derive(Debug)]
pub(crate) enum InverseMass {
    /// `M⁻¹`, block diagonal.
    Blocks(IsotropicBlocks),
    /// Factors of `M`.
    Factors(Box<SparseLu>),
}

impl InverseMass {
    /// Of a mass matrix; `None` when it is singular.
    pub(crate) fn new(mass: &SparseMatrix) -> Option<Self> {
        let (n, blocks) = (mass.shape().0, blocks(mass));
        if blocks.iter().any(|block| block.len() > LARGEST) {
            let mut lu = SparseLu::new(mass).ok()?;
            return lu.solve(mass, &mut vec![1.0; n]).ok().map(|()| Self::Factors(Box::new(lu)));
        }
        let mut place = vec![0; n];
        for block in &blocks {
            block.iter().enumerate().for_each(|(k, &i)| place[i] = k);
        }
        let inverse = |block: &Vec<usize>| {
            let mut own = DMatrix::zeros(block.len(), block.len());
            for &j in block {
                mass.column(j).for_each(|(i, value)| own[(place[i], place[j])] = value);
            }
            own.try_inverse().filter(|inverse| inverse.iter().all(|x| x.is_finite()))
        };
        let inverses: Vec<DMatrix<f64>> = blocks.iter().map(inverse).collect::<Option<_>>()?;
        let whole = SparseMatrix::assemble(n, n, |out: &mut dyn Entries| {
            for (block, inverse) in blocks.iter().zip(&inverses) {
                for (b, &j) in block.iter().enumerate() {
                    block.iter().enumerate().for_each(|(a, &i)| out.add(i, j, inverse[(a, b)]));
                }
            }
        });
        Some(Self::Blocks(IsotropicBlocks::of(&whole)))
    }

    /// `v ← M⁻¹ p`, shape `n`.
    ///
    /// # Errors
    /// [`Singular`] when `p` holds a number that is not finite.
    pub(crate) fn apply(
        &mut self,
        mass: &SparseMatrix,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), Singular> {
        match self {
            Self::Factors(lu) => {
                v.copy_from_slice(p);
                lu.solve(mass, v)
            }
            Self::Blocks(inverse) => {
                v.fill(0.0);
                inverse.mul_add(1.0, p, v);
                if v.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(Singular) }
            }
        }
    }
}

/// The coordinates that `M` couples, group by group.
fn blocks(mass: &SparseMatrix) -> Vec<Vec<usize>> {
    let n = mass.shape().0;
    let mut group: Vec<usize> = (0..n).collect();
    fn first(group: &mut [usize], mut i: usize) -> usize {
        while group[i] != i {
            group[i] = group[group[i]];
            i = group[i];
        }
        i
    }
    mass.for_each(|i, j, value| {
        if value != 0.0 {
            let (a, b) = (first(&mut group, i), first(&mut group, j));
            group[a.max(b)] = a.min(b);
        }
    });
    let mut blocks = vec![Vec::new(); n];
    (0..n).for_each(|i| blocks[first(&mut group, i)].push(i));
    blocks.retain(|block| !block.is_empty());
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assembled(entries: &[(usize, usize, f64)], n: usize) -> SparseMatrix {
        SparseMatrix::assemble(n, n, |out: &mut dyn Entries| {
            entries.iter().for_each(|&(i, j, value)| out.add(i, j, value));
        })
    }

    #[test]
    fn blocks_and_factors_invert_the_same_matrix() {
        for n in [6, 40] {
            // a chain of couplings: one block of n coordinates
            let mut entries: Vec<_> = (0..n).map(|i| (i, i, 2.0 + i as f64)).collect();
            entries.extend((1..n).flat_map(|i| [(i, i - 1, 0.5), (i - 1, i, 0.5)]));
            let mass = assembled(&entries, n);
            let exact: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
            let (mut p, mut v) = (vec![0.0; n], vec![0.0; n]);
            mass.mul_add(1.0, &exact, &mut p);
            let mut inverse = InverseMass::new(&mass).unwrap();
            assert_eq!(matches!(inverse, InverseMass::Blocks(_)), n <= LARGEST);
            inverse.apply(&mass, &p, &mut v).unwrap();
            let worst = v.iter().zip(&exact).map(|(v, e)| (v - e).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-14, "{worst:e}");
        }
        assert!(InverseMass::new(&assembled(&[(0, 0, 1.0), (1, 1, 0.0)], 2)).is_none());
    }
}
