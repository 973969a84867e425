//! The reduced matrix bordered by the constraints of closed loops, as one sparse matrix.
//!
//! ```text
//! [ A   −Uᵀ ] [δ]   [b]          A = P_exᵀ [P_inᵀ K P_in'] P'_ex,    U rows at q_n,   J' rows at q_{n+1}
//! [ J'   0  ] [μ] = [g]
//! ```
//! The complement `J' A⁻¹ Uᵀ` is dense where potentials couple loops, and its time grows with the
//! cube of their number; the bordered matrix is as sparse as the mechanism. Its pattern changes
//! with the rows that are enforced, so it is analysed anew each time.
#![allow(non_snake_case)] // A, U, J

use super::{SparseNodal, solve_with};
use vi_core::block_lu::inverse_root;
use vi_core::linear::SparseLu;
use vi_core::newton::Fault;
use vi_core::sparse::{Entries, SparseMatrix};

/// A row over the unknowns: column, value.
pub(crate) type SparseRow = Vec<(usize, f64)>;

/// Gives a row the largest entry 1; returns the factor.
fn normalized(row: &mut SparseRow, scale: &[f64]) -> f64 {
    row.iter_mut().for_each(|(column, value)| *value *= scale[*column]);
    let largest = row.iter().map(|e| e.1.abs()).fold(0.0, f64::max);
    let factor = if largest > 0.0 { 1.0 / largest } else { 1.0 };
    row.iter_mut().for_each(|(_, value)| *value *= factor);
    factor
}

impl SparseNodal {
    /// `x ← δ` for the matrix last formed, with `b` in `x` and the border `(U, J', g)`.
    ///
    /// # Errors
    /// [`Fault`] where the matrix is singular.
    pub(crate) fn solve_bordered(
        &mut self,
        [mut U, mut J]: [Vec<SparseRow>; 2],
        g: &[f64],
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { layout, left, right, matrix, .. } = self;
        // between the twists of free roots: rows of U as right-hand sides, those of J' by the
        // inverse of the right map
        for (rows, columns) in [(&mut U, &*left), (&mut J, &*right)] {
            for (root, map) in layout.free_roots().zip(&columns.roots) {
                let own = root.offset..root.offset + 6;
                for row in rows.iter_mut().filter(|row| row.iter().any(|e| own.contains(&e.0))) {
                    let mut part = [0.0; 6];
                    for (column, value) in row.iter().filter(|e| own.contains(&e.0)) {
                        part[column - own.start] += value;
                    }
                    row.retain(|e| !own.contains(&e.0));
                    map.solve_transposed(&mut part)?;
                    row.extend(own.clone().zip(part));
                }
            }
        }
        let (d, rank) = (x.len(), g.len());
        let scale: Vec<f64> = matrix.diagonal().iter().map(|a| inverse_root(*a)).collect();
        for row in &mut U {
            normalized(row, &scale);
        }
        let of_rows: Vec<f64> = J.iter_mut().map(|row| normalized(row, &scale)).collect();
        let bordered = SparseMatrix::assemble(d + rank, d + rank, |out: &mut dyn Entries| {
            matrix.for_each_entry(|i, j, value| out.add(i, j, scale[i] * value * scale[j]));
            for (k, (u, j)) in U.iter().zip(&J).enumerate() {
                u.iter().for_each(|&(column, value)| out.add(column, d + k, -value));
                j.iter().for_each(|&(column, value)| out.add(d + k, column, value));
            }
        });
        let mut lu = SparseLu::new(&bordered)?;
        Ok(solve_with(layout, [left, right], x, |x| {
            let own = x.iter().zip(&scale).map(|(x, s)| x * s);
            let mut both: Vec<f64> =
                own.chain(g.iter().zip(&of_rows).map(|(g, s)| g * s)).collect();
            lu.solve(&bordered, &mut both)?;
            x.iter_mut().zip(&both).zip(&scale).for_each(|((x, y), s)| *x = s * y);
            Ok(())
        })?)
    }
}
