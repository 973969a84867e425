//! Continuous states of signals at the Gauss nodes of a Galerkin step [2.36].
//!
//! ```text
//! z_k = z_n + h Σ_j A_kj φ(t_j, y_j, z_j),   z_{n+1} = z_n + h Σ_k b_k φ(t_k, y_k, z_k)
//! δ_kj I − h A_kj φ_z(t_j, y_j, z_j)         block (k, j) of the matrix of Newton's method
//! ```
//! Inputs `y_k` are those at the positions and velocities of the Gauss nodes; one Gauss node is the
//! implicit midpoint rule.
//!
//! Source: Hairer, Lubich & Wanner 2006, II.1.4.
#![allow(non_snake_case)] // A

use super::evaluation::{ITERATIONS, ROUND_OFF, ReadingLaw};
use nalgebra::DMatrix;
use vi_core::galerkin::{GaussLobatto, GaussPoint};
use vi_core::interval::Interval;
use vi_core::linear::DenseLu;

/// Numbers of a step; sized at the first one.
#[derive(Debug, Default)]
pub(super) struct Collocation {
    y: Vec<Vec<f64>>,          // s × inputs
    start: Vec<f64>,           // m  z_n
    z: Vec<f64>,               // s m  z_k, node by node
    values: Vec<Vec<f64>>,     // s × m  φ
    slopes: Vec<DMatrix<f64>>, // s × (m × (inputs + m))
    last: Vec<f64>,            // s m²  φ_z of the iteration before
    matrix: DMatrix<f64>,      // s m × s m
    lu: Option<DenseLu>,
    change: Vec<f64>, // s m
}

impl Collocation {
    fn fit(&mut self, s: usize, inputs: usize, m: usize) {
        if self.y.len() == s && self.start.len() == m {
            return;
        }
        *self = Self {
            y: vec![vec![0.0; inputs]; s],
            start: vec![0.0; m],
            z: vec![0.0; s * m],
            values: vec![vec![0.0; m]; s],
            slopes: vec![DMatrix::zeros(m, inputs + m); s],
            last: vec![f64::NAN; s * m * m],
            matrix: DMatrix::zeros(s * m, s * m),
            lu: Some(DenseLu::new(s * m)),
            change: vec![0.0; s * m],
        };
    }

    /// States at the Gauss nodes, in their internal variables, and at the `end` of the step.
    pub(super) fn find(
        &mut self,
        reading: &ReadingLaw,
        s: &Interval,
        constants: &GaussLobatto,
        gauss: &mut [GaussPoint],
        end: &mut [f64],
    ) {
        let (m, h) = (reading.states.len(), s.h);
        self.fit(gauss.len(), reading.inputs.len(), m);
        for (node, y) in gauss.iter().zip(&mut self.y) {
            let at = node.place(s);
            reading.read_inputs_at(at.moving(&node.v), reading.own(at.internal), y);
        }
        for (start, place) in self.start.iter_mut().zip(&reading.states) {
            *start = end[*place];
        }
        self.z.chunks_exact_mut(m).for_each(|z| z.copy_from_slice(&self.start));
        self.last.fill(f64::NAN);
        if !self.solve(reading, &constants.A, h) {
            self.z.fill(f64::NAN);
            self.values.iter_mut().for_each(|values| values.fill(f64::NAN));
        }
        for (node, z) in gauss.iter_mut().zip(self.z.chunks_exact(m)) {
            for (place, z) in reading.states.iter().zip(z) {
                node.internal[reading.first + place] = *z;
            }
        }
        for (i, place) in reading.states.iter().enumerate() {
            let rates = constants.gauss_weights.iter().zip(&self.values);
            end[*place] = self.start[i] + h * rates.map(|(b, phi)| b * phi[i]).sum::<f64>();
        }
    }

    /// Newton's method from the states at hand; whether it has come to rest.
    fn solve(&mut self, reading: &ReadingLaw, A: &DMatrix<f64>, h: f64) -> bool {
        let Self { y, start, z, values, slopes, last, matrix, lu, change } = self;
        let (s, m, inputs) = (y.len(), start.len(), reading.inputs.len());
        let Some(lu) = lu else { return false };
        for iteration in 0..ITERATIONS {
            let mut same = true; // slopes: the equations are linear
            for (j, z) in z.chunks_exact(m).enumerate() {
                reading.law.gradient(&y[j], z, &mut values[j], &mut slopes[j]);
                let by_state = slopes[j].columns(inputs, m);
                for (last, slope) in last[j * m * m..].iter_mut().zip(by_state.iter()) {
                    same &= last.to_bits() == slope.to_bits();
                    *last = *slope;
                }
            }
            for (k, i) in (0..s).flat_map(|k| (0..m).map(move |i| (k, i))) {
                let row = k * m + i;
                let sum: f64 = (0..s).map(|j| A[(k, j)] * values[j][i]).sum();
                change[row] = z[row] - start[i] - h * sum;
                for (j, l) in (0..s).flat_map(|j| (0..m).map(move |l| (j, l))) {
                    let own = f64::from(u8::from((k, i) == (j, l)));
                    matrix[(row, j * m + l)] = own - h * A[(k, j)] * slopes[j][(i, inputs + l)];
                }
            }
            lu.factorize(matrix);
            if lu.solve_factorized(change).is_err() {
                return false;
            }
            let is_small = |(row, change): (usize, &f64)| {
                let (node, i) = (row / m, row % m);
                let size = start[i].abs() + z[row].abs() + (h * values[node][i]).abs();
                change.abs() <= ROUND_OFF * size
            };
            if iteration > 0 && (same || change.iter().enumerate().all(is_small)) {
                return true;
            }
            z.iter_mut().zip(&*change).for_each(|(z, change)| *z -= change);
        }
        false
    }
}
