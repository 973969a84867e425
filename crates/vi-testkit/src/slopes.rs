//! Slot derivatives of discrete forces against central differences.

use nalgebra::DMatrix;
use vi_core::force::DiscreteForce;
use vi_core::{Configuration, Entries, Interval, Slot, SparseMatrix, StepChange};

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

/// The same step with another length and time.
fn timed(s: &Interval, h: f64, middle: f64) -> Interval {
    let mut timed = Interval::between(middle - 0.5 * h, h, &s.q0, &s.q1);
    timed.angles.clone_from(&s.angles);
    timed.internal.clone_from(&s.internal);
    timed
}

/// The same step with another internal variable.
fn remembered(s: &Interval, k: usize, by: f64) -> Interval {
    let mut other = s.clone();
    other.internal[k] += by;
    other
}

fn advanced(force: &dyn DiscreteForce, s: &Interval) -> Vec<f64> {
    let mut out = vec![0.0; force.internal_variables()];
    force.advance(s, &mut out);
    out
}

/// `(f(e) − f(−e))/2e`.
fn difference(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let [plus, minus] = [SMALL, -SMALL].map(f);
    plus.iter().zip(&minus).map(|(a, b)| (a - b) / (2.0 * SMALL)).collect()
}

/// The largest error of derivatives, each with what it should be; relative to the largest entry of
/// all, which is `least` at least.
fn relative(all: &[(DMatrix<f64>, DMatrix<f64>)], least: f64) -> f64 {
    let size = all.iter().map(|(_, expected)| expected.amax()).fold(least, f64::max);
    let mut worst: f64 = 0.0;
    for (found, expected) in all {
        let error = (found - expected).amax();
        let error = if size > 0.0 { error / size } else { error };
        worst = if error.is_nan() { error } else { worst.max(error) };
    }
    worst
}

/// The largest error of `D_1 f_d^-`, `D_2 f_d^-`, `D_1 f_d^+`, `D_2 f_d^+` in a step, relative to
/// the largest entry of all four; of `D_2 f_d^-` as a step takes it, too; and of derivatives by the
/// length and the time of the step, where they are known, and by internal variables. Coordinates
/// that are not numbers are left where they are. Also of the derivatives of the continuous force by
/// `q` and `v` where the step starts, relative to the largest entry of both.
pub fn slope_error(force: &dyn DiscreteForce, s: &Interval) -> f64 {
    let (n, m, own) = (s.dim(), s.internal.len(), force.internal_variables());
    let made = |rows: usize, columns: usize, emit: &dyn Fn(&mut dyn Entries)| {
        SparseMatrix::assemble(rows, columns, |out| emit(out)).to_dense()
    };
    let by = |rows: usize, columns: usize, of: &dyn Fn(usize) -> Vec<f64>| {
        let mut expected = DMatrix::zeros(rows, columns);
        for j in 0..columns {
            of(j).iter().enumerate().for_each(|(i, slope)| expected[(i, j)] = *slope);
        }
        expected
    };
    let nodes = |slot: Slot, rows: usize, f: &dyn Fn(&Interval) -> Vec<f64>| {
        by(rows, n, &|j| match s.node(slot)[j].is_finite() {
            true => difference(|e| f(&moved(s, slot, j, e))),
            false => vec![0.0; rows],
        })
    };
    let (mut slots, mut times, mut memory) = (Vec::new(), Vec::new(), Vec::new());
    for of in Slot::BOTH {
        for slot in Slot::BOTH {
            let found = made(n, n, &|out| force.add_slope(s, of, slot, out));
            slots.push((found, nodes(slot, n, &|s| value(force, s, of))));
        }
        let found = made(n, m, &|out| force.add_internal_slope(s, of, out));
        let column = |k: usize| difference(|e| value(force, &remembered(s, k, e), of));
        memory.push((found, by(n, m, &column)));
        for (k, change) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
            let [length, middle] = change;
            let mut found = vec![0.0; n];
            let step = StepChange { length, middle };
            if force.add_step_slope(s, of, step, &mut found).is_ok() {
                let at = |e: f64| match k {
                    0 => timed(s, s.h + e, s.t_mid()),
                    _ => timed(s, s.h, s.t_mid() + e),
                };
                let expected = difference(|e| value(force, &at(e), of));
                times.push([found, expected].map(|x| DMatrix::from_vec(n, 1, x)).into());
            }
        }
    }
    let step = made(n, n, &|out| force.add_minus_d2(s, out));
    slots.push((step, slots[1].1.clone()));
    if own > 0 {
        for slot in Slot::BOTH {
            let found = made(own, n, &|out| force.add_advance_slope(s, slot, out));
            memory.push((found, nodes(slot, own, &|s| advanced(force, s))));
        }
        let found = made(own, own, &|out| force.add_advance_internal_slope(s, out));
        let column = |k: usize| difference(|e| advanced(force, &remembered(s, k, e)));
        memory.push((found, by(own, own, &column)));
    }
    let (at, v) = (s.start(), &s.v_mid);
    let found = made(n, n, &|out| force.add_position_slope(at, v, 1.0, out));
    let node = |slot: Slot, j: usize, e: f64| {
        let (mut q, mut v) = (s.q0.clone(), v.clone());
        if slot == Slot::First {
            q[j] += e
        } else {
            v[j] += e
        }
        let mut out = vec![0.0; n];
        force.add_continuous(Configuration { q: &q, ..at }, &v, &mut out);
        out
    };
    let of_node = |slot: Slot| {
        by(n, n, &|j| match s.q0[j].is_finite() {
            true => difference(|e| node(slot, j, e)),
            false => vec![0.0; n],
        })
    };
    let mut continuous = vec![(found, of_node(Slot::First))];
    let found = made(n, n, &|out| force.add_damping(at, v, 1.0, out));
    continuous.push((found, of_node(Slot::Second)));
    // the impulse of a linear damper does not depend on the length of the step
    let impulse = Slot::BOTH.map(|of| value(force, s, of)).concat();
    let rate = impulse.iter().fold(0.0, |most: f64, f| most.max(f.abs())) / s.h.abs();
    let most = |x: &DMatrix<f64>| x.amax();
    let size = slots.iter().map(|(_, expected)| most(expected)).fold(0.0, f64::max);
    let worst = relative(&continuous, size / s.h.abs());
    worst.max(relative(&slots, 0.0)).max(relative(&times, rate)).max(relative(&memory, 0.0))
}
