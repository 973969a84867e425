//! Slot derivatives of discrete forces, and second ones, against central differences.

use nalgebra::DMatrix;
use vi_core::force::DiscreteForce;
use vi_core::potential::DiscretePotential;
use vi_core::sparse::{Block, Product};
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
    let found = made(n, n, &|out| force.add_position_slope(at.moving(v), 1.0, out));
    let node = |slot: Slot, j: usize, e: f64| {
        let (mut q, mut v) = (s.q0.clone(), v.clone());
        if slot == Slot::First {
            q[j] += e
        } else {
            v[j] += e
        }
        let mut out = vec![0.0; n];
        force.add_continuous(Configuration { q: &q, ..at }.moving(&v), &mut out);
        out
    };
    let of_node = |slot: Slot| {
        by(n, n, &|j| match s.q0[j].is_finite() {
            true => difference(|e| node(slot, j, e)),
            false => vec![0.0; n],
        })
    };
    let mut continuous = vec![(found, of_node(Slot::First))];
    let found = made(n, n, &|out| force.add_damping(at.moving(v), 1.0, out));
    continuous.push((found, of_node(Slot::Second)));
    // the impulse of a linear damper does not depend on the length of the step
    let impulse = Slot::BOTH.map(|of| value(force, s, of)).concat();
    let rate = impulse.iter().fold(0.0, |most: f64, f| most.max(f.abs())) / s.h.abs();
    let most = |x: &DMatrix<f64>| x.amax();
    let size = slots.iter().map(|(_, expected)| most(expected)).fold(0.0, f64::max);
    let worst = relative(&continuous, size / s.h.abs());
    worst.max(relative(&slots, 0.0)).max(relative(&times, rate)).max(relative(&memory, 0.0))
}

/// `(8 (f(e) − f(−e)) − (f(2e) − f(−2e)))/12e`, of order 4.
fn smooth_difference(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    const FAR: f64 = 3e-4;
    let [one, back, far, beyond] = [1.0, -1.0, 2.0, -2.0].map(|by| f(by * FAR));
    let each = |i: usize| (8.0 * (one[i] - back[i]) - (far[i] - beyond[i])) / (12.0 * FAR);
    (0..one.len()).map(each).collect()
}

/// Any covector.
fn covector(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| (seed * (i * i + 1) as f64).sin()).collect()
}

/// The largest error of second derivatives along covectors, relative to the largest entry: `found`
/// between two groups of coordinates, `slope` by the first where one of the second is moved.
fn second_error(
    n: usize,
    found: &dyn Fn([usize; 2], &mut dyn Entries),
    slope: &dyn Fn([usize; 2], usize, f64) -> Vec<f64>,
) -> f64 {
    let mut all = Vec::new();
    for groups in [[0, 0], [0, 1], [1, 0], [1, 1]] {
        let own = SparseMatrix::assemble(n, n, |out| found(groups, out)).to_dense();
        let mut expected = DMatrix::zeros(n, n);
        for j in 0..n {
            let column = smooth_difference(|e| slope(groups, j, e));
            (0..n).for_each(|i| expected[(i, j)] = column[i]);
        }
        all.push((own, expected));
    }
    relative(&all, 0.0)
}

/// `out ← out + Aᵀ y`.
fn pulled(n: usize, y: &[f64], emit: impl FnOnce(&mut dyn Entries)) -> Vec<f64> {
    let mut out = vec![0.0; n];
    let into = &mut Product { v: y, out: &mut out };
    emit(&mut Block { into, row: 0, column: 0, scale: 1.0, transposed: true });
    out
}

/// The largest error of the second derivatives of a force in a step, and of the continuous one
/// where the step starts, relative to the largest entry of each, along some covectors.
pub fn bend_error(force: &dyn DiscreteForce, s: &Interval) -> f64 {
    let (n, slot) = (s.dim(), |group: usize| Slot::BOTH[group]);
    let [y, other] = [0.37, 0.23].map(|seed| covector(n, seed));
    let in_step = second_error(
        n,
        &|groups, out| force.add_bend(s, [&y, &other], groups.map(slot), out),
        &|[i, j], k, e| {
            let s = moved(s, slot(j), k, e);
            let of = |end: usize, y: &[f64]| {
                pulled(n, y, |out| force.add_slope(&s, slot(end), slot(i), out))
            };
            of(0, &y).iter().zip(of(1, &other)).map(|(a, b)| a + b).collect()
        },
    );
    let (at, unit) = (s.start(), |[i, j]: [usize; 2]| {
        let mut by = [0.0; 4];
        by[2 * i + j] = 1.0;
        by
    });
    let at_node = second_error(
        n,
        &|groups, out| force.add_gauss_bend(at.moving(&s.v_mid), &y, unit(groups), out),
        &|[i, j], k, e| {
            let mut place = [s.q0.clone(), s.v_mid.clone()];
            place[j][k] += e;
            let (at, by) = (Configuration { q: &place[0], ..at }, [[1.0, 0.0], [0.0, 1.0]][i]);
            pulled(n, &y, |out| force.add_gauss_slopes(at.moving(&place[1]), by, out))
        },
    );
    in_step.max(at_node).max(length_bend_error(force, s, [&y, &other]))
}

/// That of the second derivatives by the length of a step, where they are known, relative to the
/// largest one, and to what the first ones by the nodes are over the step.
fn length_bend_error(force: &dyn DiscreteForce, s: &Interval, y: [&[f64]; 2]) -> f64 {
    let Some(own) = force.length_bends() else { return 0.0 };
    let (n, t) = (s.dim(), s.t_mid());
    let slopes = |s: &Interval, by: Slot| -> Vec<f64> {
        let of = |of, y: &[f64]| pulled(n, y, |out| force.add_slope(s, of, by, out));
        let both = of(Slot::First, y[0]).into_iter().zip(of(Slot::Second, y[1]));
        both.map(|(a, b)| a + b).collect()
    };
    let (mut all, mut least) = (Vec::new(), 0.0_f64);
    for by in Slot::BOTH {
        let mut found = vec![0.0; n];
        own.add_slope_by_length(s, y, by, &mut found);
        // differences of a tenth: those of the length itself are long
        let other = smooth_difference(|e| slopes(&timed(s, s.h + 0.1 * e, t), by));
        let expected: Vec<f64> = other.iter().map(|slope| 10.0 * slope).collect();
        all.push([found, expected].map(|x| DMatrix::from_vec(n, 1, x)).into());
        least = slopes(s, by).iter().fold(least, |most, x| most.max((x / s.h).abs()));
    }
    let first = |s: &Interval| -> Option<f64> {
        let mut sum = 0.0;
        for (of, y) in Slot::BOTH.into_iter().zip(y) {
            let (mut slope, change) = (vec![0.0; n], StepChange { length: 1.0, middle: 0.0 });
            force.add_step_slope(s, of, change, &mut slope).ok()?;
            sum += slope.iter().zip(y).map(|(f, y)| f * y).sum::<f64>();
        }
        Some(sum)
    };
    let mut second = Vec::new();
    if first(s).is_some() {
        let at = |e: f64| vec![first(&timed(s, s.h + 0.1 * e, t)).unwrap_or(f64::NAN)];
        let values = [own.second_by_length(s, y), 10.0 * smooth_difference(at)[0]];
        second.push(values.map(|x| DMatrix::from_element(1, 1, x)).into());
    }
    relative(&all, least).max(relative(&second, least))
}

/// The same of a potential: of its discrete form and of its third derivative.
pub fn potential_bend_error(potential: &dyn DiscretePotential, s: &Interval) -> f64 {
    let (n, slot) = (s.dim(), |group: usize| Slot::BOTH[group]);
    let [y, other] = [0.37, 0.23].map(|seed| covector(n, seed));
    let in_step = second_error(
        n,
        &|groups, out| potential.add_bend(s, [&y, &other], groups.map(slot), 1.0, out),
        &|[i, j], k, e| {
            let s = moved(s, slot(j), k, e);
            // (∂(D_of U_d)/∂q_i)ᵀ y
            let mut sum = vec![0.0; n];
            for (of, y) in [(0, &y), (1, &other)] {
                let mut emit = |transposed: bool, emit: &dyn Fn(&mut dyn Entries)| {
                    let into = &mut Product { v: y, out: &mut sum };
                    emit(&mut Block { into, row: 0, column: 0, scale: 1.0, transposed });
                };
                match (of, i) {
                    (0, 0) => emit(true, &|out| potential.add_d1_d1(&s, 1.0, out)),
                    (1, 1) => emit(true, &|out| potential.add_d2_d2(&s, 1.0, out)),
                    (0, _) => emit(true, &|out| potential.add_d2_d1(&s, 1.0, out)),
                    _ => emit(false, &|out| potential.add_d2_d1(&s, 1.0, out)),
                }
            }
            sum
        },
    );
    let at = s.start();
    let at_node = second_error(
        n,
        &|groups, out| {
            if groups == [0, 0] {
                potential.add_third(at, &y, 1.0, out);
            }
        },
        &|groups, k, e| {
            let mut q = s.q0.clone();
            q[k] += e;
            let at = Configuration { q: &q, ..at };
            match groups {
                [0, 0] => pulled(n, &y, |out| potential.add_hessian(at, 1.0, out)),
                _ => vec![0.0; n],
            }
        },
    );
    in_step.max(at_node)
}
