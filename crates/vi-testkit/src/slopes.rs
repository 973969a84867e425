//! Slot derivatives of discrete forces against central differences.

use nalgebra::DMatrix;
use vi_core::force::DiscreteForce;
use vi_core::{Interval, Slot, SparseMatrix};

/// Half of a difference.
const SMALL: f64 = 1e-6;

/// The step with its ends in other places.
fn moved(s: &Interval, slot: Slot, j: usize, by: f64) -> Interval {
    let mut ends = Slot::BOTH.map(|end| s.node(end).to_vec());
    ends[slot as usize][j] += by;
    let mut moved = Interval::between(s.t, s.h, &ends[0], &ends[1]);
    moved.angles.clone_from(&s.angles);
    moved.internal.clone_from(&s.internal);
    moved
}

fn value(force: &dyn DiscreteForce, s: &Interval, of: Slot) -> Vec<f64> {
    let mut out = vec![0.0; s.dim()];
    match of {
        Slot::First => force.add_minus(s, &mut out),
        Slot::Second => force.add_plus(s, &mut out),
    }
    out
}

/// The largest error of `D_1 f_d^-`, `D_2 f_d^-`, `D_1 f_d^+`, `D_2 f_d^+` in a step, relative to
/// the largest entry of all four; of `D_2 f_d^-` as a step takes it, too. Coordinates that are not
/// numbers are left where they are.
pub fn slope_error(force: &dyn DiscreteForce, s: &Interval) -> f64 {
    let n = s.dim();
    let assemble = |of: Slot, by: Slot| {
        SparseMatrix::assemble(n, n, |out| force.add_slope(s, of, by, out)).to_dense()
    };
    let step = SparseMatrix::assemble(n, n, |out| force.add_minus_d2(s, out)).to_dense();
    let mut found = vec![((Slot::First, Slot::Second), step)];
    for of in Slot::BOTH {
        found.extend(Slot::BOTH.map(|by| ((of, by), assemble(of, by))));
    }
    let size = found.iter().map(|(_, matrix)| matrix.amax()).fold(0.0, f64::max);
    let mut worst: f64 = 0.0;
    for ((of, by), matrix) in found {
        let mut expected = DMatrix::zeros(n, n);
        for j in (0..n).filter(|&j| s.node(by)[j].is_finite()) {
            let ends = [SMALL, -SMALL].map(|e| value(force, &moved(s, by, j, e), of));
            let difference = ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b) / (2.0 * SMALL));
            difference.enumerate().for_each(|(i, slope)| expected[(i, j)] = slope);
        }
        let error = (&matrix - &expected).amax() / size;
        worst = if error.is_nan() { error } else { worst.max(error) };
    }
    worst
}
