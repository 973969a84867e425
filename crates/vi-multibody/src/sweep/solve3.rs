//! Linear systems of three equations.
#![allow(non_snake_case)] // D

use crate::geometry::matrix::Columns;
use crate::geometry::one_tree::three;
use crate::geometry::space::{Number, Space, Vector};
use vi_core::lanes::Lanes;

/// `sides ← D⁻¹ sides` by Gaussian elimination, with row pivoting where `D` is not symmetric;
/// returns zero, or what is not a number where a pivot vanishes.
#[inline(always)]
pub(super) fn solve<S: Space, const R: usize>(
    _: S,
    mut D: [[Number<S>; 3]; 3],
    sides: &mut [[Number<S>; R]; 3],
) -> Number<S> {
    let one = D[0][0].like(1.0);
    let (mut inverse, mut finite) = ([one; 3], one.like(0.0));
    for k in 0..3 {
        if !S::SYMMETRIC {
            exchange_rows(k, &mut D, sides);
        }
        inverse[k] = one.over(D[k][k]);
        finite = finite + inverse[k] * 0.0;
        for i in k + 1..3 {
            let factor = D[i][k] * inverse[k];
            for j in k + 1..3 {
                D[i][j] = D[i][j] - factor * D[k][j];
            }
            for r in 0..R {
                sides[i][r] = sides[i][r] - factor * sides[k][r];
            }
        }
    }
    for k in (0..3).rev() {
        for r in 0..R {
            for i in k + 1..3 {
                sides[k][r] = sides[k][r] - D[k][i] * sides[i][r];
            }
            sides[k][r] = sides[k][r] * inverse[k];
        }
    }
    finite
}

/// Brings the row with the largest entry of column `k` to its diagonal: in one tree by an exchange,
/// in many by a choice for each.
#[inline(always)]
fn exchange_rows<N: Lanes, const R: usize>(k: usize, D: &mut [[N; 3]; 3], sides: &mut [[N; R]; 3]) {
    let zero = D[0][0].like(0.0);
    let size = three!(i => D[i][k].abs());
    if N::COUNT == 1 {
        let mut pivot = k;
        for i in k + 1..3 {
            pivot = if size[i].at(0) > size[pivot].at(0) { i } else { pivot };
        }
        D.swap(k, pivot);
        sides.swap(k, pivot);
        return;
    }
    for i in (k + 1..3).rev() {
        // row i where it is larger than all before
        let (mut before, mut after) = (zero, zero);
        for row in k..i {
            before = before.larger(size[row]);
        }
        for row in i + 1..3 {
            after = after.larger(size[row]);
        }
        // a later row may be larger still
        let (own, others) = (size[i], before.larger(size[i]));
        for j in 0..3 {
            let (a, b) = (D[k][j], D[i][j]);
            D[k][j] = own.if_at_most(before, a, after.if_at_most(others, b, a));
            D[i][j] = own.if_at_most(before, b, after.if_at_most(others, a, b));
        }
        for r in 0..R {
            let (a, b) = (sides[k][r], sides[i][r]);
            sides[k][r] = own.if_at_most(before, a, after.if_at_most(others, b, a));
            sides[i][r] = own.if_at_most(before, b, after.if_at_most(others, a, b));
        }
    }
}

/// `D⁻¹`, and [`solve`]'s sum.
#[inline(always)]
pub(super) fn inverse<S: Space>(s: S, D: &Columns<S::Vector>) -> (Columns<S::Vector>, Number<S>) {
    let v = D.0[0];
    let one = v.components()[0].like(1.0);
    let zero = one.like(0.0);
    let mut sides = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let finite = solve(s, D.rows(), &mut sides);
    (Columns(three!(j => v.of(three!(i => sides[i][j])))), finite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::one_tree::{Narrow, OneTree};
    use vi_core::lanes::{Plain, Register};
    use vi_testkit::Sample;

    /// Lanes exchange rows as a system alone does, whatever stands beside it.
    #[test]
    fn lanes_have_the_bits_of_single_systems() {
        let mut sample = Sample::new(11);
        for _ in 0..2000 {
            let mut systems = [0; 4].map(|_| [0; 3].map(|_| sample.array::<4>()));
            for (i, system) in systems.iter_mut().enumerate() {
                if i % 2 == 0 {
                    system[1][0] = -system[2][0]; // rows of equal size
                }
                system[0].iter_mut().for_each(|x| *x *= 0.3);
            }
            let of = |i: usize, j: usize| Plain.gather(|k| systems[k][i][j]);
            let D = three!(i => three!(j => of(i, j)));
            let mut sides = three!(i => [of(i, 3)]);
            let _ = solve(Plain, D, &mut sides);
            for (k, system) in systems.iter().enumerate() {
                let mut alone = three!(i => [system[i][3]]);
                let _ = solve(OneTree(Narrow), three!(i => three!(j => system[i][j])), &mut alone);
                for i in 0..3 {
                    assert_eq!(sides[i][0].at(k).to_bits(), alone[i][0].to_bits());
                }
            }
        }
    }
}
