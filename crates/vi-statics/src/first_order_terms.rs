//! What constraints on velocities and states of signals add to the equations of small motions.
#![allow(non_snake_case)] // S, B, N, Φ

use crate::equations::EquilibriumEquations;
use nalgebra::{DMatrix, DVector};
use vi_core::DiscreteLagrangian;
use vi_core::sparse::{Entries, SparseMatrix};

/// `S`, `B`, and what signals add.
#[derive(Debug)]
pub(crate) struct FirstOrderTerms {
    pub(crate) rows: [DMatrix<f64>; 2],
    pub(crate) states: Option<States>,
}

/// `F`, `Φ_x`, `Φ_v`, `Φ_z`.
#[derive(Debug)]
pub(crate) struct States {
    pub(crate) force: DMatrix<f64>,
    pub(crate) by_position: DMatrix<f64>,
    pub(crate) by_velocity: DMatrix<f64>,
    pub(crate) own: DMatrix<f64>,
}

/// A row of a matrix with `n` columns.
struct MatrixRow<'a>(&'a mut [f64]);

impl Entries for MatrixRow<'_> {
    fn add(&mut self, _: usize, column: usize, value: f64) {
        self.0[column] += value;
    }
}

impl FirstOrderTerms {
    /// Along displacements `N`, shape `n × d`; `None` where the motion is of second order.
    pub(crate) fn of(work: &EquilibriumEquations, N: &DMatrix<f64>) -> Option<Self> {
        let (at, v) = (work.here(), work.velocity());
        let found = work.system.state_rates(at.moving(v));
        if !work.mechanism.has_velocity_constraints() && found.is_none() {
            return None;
        }
        let (n, d) = N.shape();
        let mut carried = DMatrix::zeros(n, d); // (W + S_w) N
        for (k, mut column) in carried.column_iter_mut().enumerate() {
            work.carry(N.column(k).as_slice(), column.as_mut_slice());
        }
        let count = work.mechanism.velocity_rows().count();
        let [mut S, mut B] = [DMatrix::zeros(count, d), DMatrix::zeros(count, d)];
        for (i, (_, row)) in work.mechanism.velocity_rows().enumerate() {
            let [mut own, mut drift] = [vec![0.0; n], vec![0.0; n]];
            row.emit(at.q, 0, &mut MatrixRow(&mut own));
            row.emit_drift_slope(at, &mut MatrixRow(&mut drift));
            let (own, drift) = (DVector::from_vec(own), DVector::from_vec(drift));
            for k in 0..d {
                let along = N.column(k);
                let turning = row.second(at.q, along.clone_owned().as_slice(), v);
                S[(i, k)] = own.dot(&along);
                B[(i, k)] = turning + drift.dot(&along) + own.dot(&carried.column(k));
            }
        }
        let states = found.map(|found| {
            let all = work.s.internal.len();
            let slopes =
                SparseMatrix::assemble(n, all, |out| work.system.state_slopes(at.moving(v), out));
            let force = slopes.to_dense().select_columns(&found.places);
            States {
                force: N.tr_mul(&force),
                by_position: &found.by_position * N + &found.by_velocity * &carried,
                by_velocity: &found.by_velocity * N,
                own: found.by_state,
            }
        });
        Some(Self { rows: [S, B], states })
    }
}
