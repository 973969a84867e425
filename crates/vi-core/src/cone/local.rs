//! The law of one contact alone, exactly: `y = Aλ + c` with the `3 × 3` block `A`.
//!
//! ```text
//! take-off   λ = 0                      where c_N ≥ 0
//! stick      Aλ = −c                    where the cone holds λ
//! slip       λ = λ_N (1, −μe),  y_N = 0,  y_T = |y_T| e,  |e| = 1
//! ```
//! With `y_N = 0`, that is `λ_N = −c_N/(A_NN − μ A_NT·e)`, slip is one equation in the direction
//! `e`, of degree two in its components:
//! ```text
//! e^⊥ · [ c_T (A_NN − μ A_NT·e) − c_N (A_TN − μ A_TT e) ] = 0
//! ```
#![allow(non_snake_case)] // A

use super::least_norm::RANK;
use super::problem::Cone;
use super::residual::{clip, norm, sliding, to_cone};
use nalgebra::{Cholesky, Const, Matrix3, Vector3};

/// Of the friction that holds a contact of what moves along few directions.
const INSIDE: f64 = 0.9;

/// What sticks nearly: velocities that are left of this part contradict one another.
const NEARLY: f64 = 1e-5;
/// Impulses of slip beyond this many times those of the motion are of a direction that rounding
/// chooses.
const LARGE: f64 = 1e6;

/// The law of a contact with `part` of its friction; of laws of one row the first entries count;
/// `error`: to which `c` is known.
pub(super) fn law(
    cone: Cone,
    A: &Matrix3<f64>,
    c: &Vector3<f64>,
    error: f64,
    part: f64,
    now: &Vector3<f64>,
) -> Vector3<f64> {
    let one = |value| Vector3::new(value, 0.0, 0.0);
    match cone {
        Cone::Normal => one(unilateral(A[(0, 0)], c[0])),
        Cone::Bounded { bound } => one(bounded(A[(0, 0)], c[0], bound, now[0])),
        Cone::Friction { coefficient } => friction(A, c, error, part * coefficient, now),
        Cone::Convex { coefficient, speed } => {
            let c = Vector3::new(c[0] + speed, c[1], c[2]);
            projected(A, &c, part * coefficient, now)
        }
        Cone::Sliding { direction, slope, at } => slide(A, c, direction, slope, at, now),
    }
}

/// A step of projected iteration onto the cone.
fn projected(A: &Matrix3<f64>, c: &Vector3<f64>, mu: f64, now: &Vector3<f64>) -> Vector3<f64> {
    let size = A.trace();
    let part = if size > 0.0 { 1.0 / size } else { 1.0 };
    let z = now - part * (A * now + c);
    to_cone([z[0], z[1], z[2]], mu).into()
}

/// A contact that slides: Newton's method of the three equations, from `now`.
fn slide(
    A: &Matrix3<f64>,
    c: &Vector3<f64>,
    direction: [f64; 2],
    slope: [[f64; 2]; 2],
    at: [f64; 2],
    now: &Vector3<f64>,
) -> Vector3<f64> {
    if c[0] >= 0.0 {
        return Vector3::zeros();
    }
    let simple = || {
        let across = A[(0, 1)] * direction[0] + A[(0, 2)] * direction[1];
        let below = if A[(0, 0)] > across { A[(0, 0)] - across } else { A[(0, 0)] };
        let normal = -c[0] / below;
        Vector3::new(normal, -normal * direction[0], -normal * direction[1])
    };
    let mut x = if now[0] > 0.0 { *now } else { simple() };
    for _ in 0..20 {
        let y = A * x + c;
        let part = sliding(direction, slope, at, [y[1], y[2]]);
        let F = Vector3::new(y[0], x[1] + x[0] * part[0], x[2] + x[0] * part[1]);
        let D = Matrix3::from_fn(|i, j| match i {
            0 => A[(0, j)],
            _ => {
                let turn = slope[i - 1][0] * A[(1, j)] + slope[i - 1][1] * A[(2, j)];
                let own = if j == 0 { part[i - 1] } else { f64::from(u8::from(i == j)) };
                own + x[0] * turn
            }
        });
        let Some(inverse) = D.try_inverse() else { return simple() };
        let step = inverse * F;
        x -= step;
        if step.amax() <= 4.0 * f64::EPSILON * x.amax() {
            break;
        }
    }
    if x[0] > 0.0 && x.iter().all(|x| x.is_finite()) { x } else { simple() }
}

/// `0 ≤ λ ⊥ aλ + c ≥ 0`.
fn unilateral(a: f64, c: f64) -> f64 {
    if c < 0.0 && a > 0.0 { -c / a } else { 0.0 }
}

/// `|λ| ≤ b`, `λ = −b sgn(aλ + c)`; `now` is kept where nothing decides.
fn bounded(a: f64, c: f64, bound: f64, now: f64) -> f64 {
    if a > 0.0 {
        clip(-c / a, bound)
    } else if c == 0.0 {
        clip(now, bound)
    } else {
        -bound.copysign(c)
    }
}

/// The three rows of a contact with friction; of several directions of slip the one next to
/// `now`. Where no state holds (`μ` beyond the existence of one), a step of projected iteration.
fn friction(
    A: &Matrix3<f64>,
    c: &Vector3<f64>,
    error: f64,
    mu: f64,
    now: &Vector3<f64>,
) -> Vector3<f64> {
    if c[0] >= 0.0 {
        return Vector3::zeros();
    }
    let slips = || slip_near(A, c, mu, now).or_else(|| slip(A, c, mu, now));
    let found = match regular(A) {
        Some(factor) => Some(factor.solve(&-c)).filter(|lambda| holds(lambda, mu)).or_else(slips),
        None => {
            let is_moderate = |own: &Vector3<f64>| own.amax() * A.trace() <= LARGE * c.amax();
            jam(A, c, error, mu, now)
                .or_else(|| slips().filter(is_moderate))
                .or_else(|| jam(A, c, NEARLY * c.amax(), mu, now))
        }
    };
    found.unwrap_or_else(|| {
        let y = A * now + c;
        let normal = (now[0] - y[0]).max(0.0);
        let z = [now[1] - y[1], now[2] - y[2]];
        let part = if norm(z) > mu * normal { mu * normal / norm(z) } else { 1.0 };
        Vector3::new(normal, part * z[0], part * z[1])
    })
}

/// The factor of a block that is not singular: of what moves along fewer directions rounding alone
/// would choose among impulses that balance one another.
fn regular(A: &Matrix3<f64>) -> Option<Cholesky<f64, Const<3>>> {
    A.cholesky().filter(|factor| {
        let least = factor.l_dirty().diagonal().min();
        least * least > RANK * A.diagonal().max()
    })
}

/// Whether a cone has an impulse.
fn holds(lambda: &Vector3<f64>, mu: f64) -> bool {
    lambda[0] >= 0.0 && norm([lambda[1], lambda[2]]) <= mu * lambda[0]
}

/// Stick of what moves along one or two directions alone: of the impulses that leave no velocity
/// but the `error` of `c` the one next to `now`, moved towards the axis of the cone by what changes
/// no velocity, just into it.
fn jam(
    A: &Matrix3<f64>,
    c: &Vector3<f64>,
    error: f64,
    mu: f64,
    now: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let eigen = A.symmetric_eigen();
    let least = RANK * eigen.eigenvalues.max();
    let inverse = eigen.eigenvalues.map(|own| if own > least { 1.0 / own } else { 0.0 });
    let inverse =
        eigen.eigenvectors * Matrix3::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    let y = A * now + c;
    let nearest = now - inverse * y;
    let left = (A * nearest + c).amax();
    if left > error.max(RANK * c.amax()) {
        return None;
    }
    let (inside, axis) = (INSIDE * mu, Vector3::x());
    if holds(&nearest, inside) {
        return Some(nearest);
    }
    let along = axis - inverse * (A * axis);
    // |Λ_T + t d_T| = μ (Λ_N + t d_N)
    let product = |a: &Vector3<f64>, b: &Vector3<f64>| {
        a[1] * b[1] + a[2] * b[2] - inside * inside * a[0] * b[0]
    };
    let (p, q, r) =
        (product(&along, &along), product(&along, &nearest), product(&nearest, &nearest));
    let root = (q * q - p * r).max(0.0).sqrt();
    let t =
        if q > 0.0 { [-(q + root) / p, -r / (q + root)] } else { [(root - q) / p, r / (root - q)] };
    let ends = t.map(|t| (t.abs(), nearest + along * t));
    let ends = ends.into_iter().filter(|own| own.0.is_finite() && holds(&own.1, mu));
    ends.min_by(|a, b| a.0.total_cmp(&b.0)).map(|own| own.1)
}

/// Slip in a direction `e` where it holds: `λ` with `y_N = 0`, and `y_T` along `e`.
fn slipping(A: &Matrix3<f64>, c: &Vector3<f64>, mu: f64, e: [f64; 2]) -> Option<Vector3<f64>> {
    let normal = -c[0] / (A[(0, 0)] - mu * (A[(0, 1)] * e[0] + A[(0, 2)] * e[1]));
    let lambda = normal * Vector3::new(1.0, -mu * e[0], -mu * e[1]);
    let y = A * lambda + c;
    let holds = normal > 0.0 && normal.is_finite() && y[1] * e[0] + y[2] * e[1] >= 0.0;
    holds.then_some(lambda)
}

/// Slip in a direction next to that of `now`, by Newton's method.
fn slip_near(
    A: &Matrix3<f64>,
    c: &Vector3<f64>,
    mu: f64,
    now: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    /// Turns beyond this look for a direction elsewhere.
    const FAR: f64 = 0.5;
    let size = norm([now[1], now[2]]);
    if size == 0.0 || mu == 0.0 {
        return None;
    }
    let mut e = [-now[1] / size, -now[2] / size];
    for _ in 0..8 {
        let across = [-e[1], e[0]];
        let along = |i: usize, e: [f64; 2]| mu * (A[(i, 1)] * e[0] + A[(i, 2)] * e[1]);
        let (below, below_turn) = (A[(0, 0)] - along(0, e), -along(0, across));
        let t = [1, 2].map(|i| c[i] * below - c[0] * (A[(i, 0)] - along(i, e)));
        let t_turn = [1, 2].map(|i| c[i] * below_turn + c[0] * along(i, across));
        let value = t[1] * e[0] - t[0] * e[1];
        let slope = t_turn[1] * e[0] - t_turn[0] * e[1] - t[1] * e[1] - t[0] * e[0];
        let turn = -value / slope;
        if turn.is_nan() || turn.abs() > FAR {
            return None;
        }
        let sum = [0, 1].map(|i| e[i] + turn * across[i]);
        e = sum.map(|x| x / norm(sum));
        if turn.abs() <= 4.0 * f64::EPSILON {
            return slipping(A, c, mu, e);
        }
    }
    None
}

/// Sines and cosines of the sixteenths of a turn.
const SIXTEENTH: f64 = 0.923_879_532_511_286_7;
const THREE_SIXTEENTHS: f64 = 0.382_683_432_365_089_8;
const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
const QUARTER: [[f64; 2]; 4] = [
    [1.0, 0.0],
    [SIXTEENTH, THREE_SIXTEENTHS],
    [DIAGONAL, DIAGONAL],
    [THREE_SIXTEENTHS, SIXTEENTH],
];

fn direction(k: usize) -> [f64; 2] {
    let [x, y] = QUARTER[k % 4];
    match k / 4 % 4 {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

fn slip(A: &Matrix3<f64>, c: &Vector3<f64>, mu: f64, now: &Vector3<f64>) -> Option<Vector3<f64>> {
    let across = |e: [f64; 2]| {
        let below = A[(0, 0)] - mu * (A[(0, 1)] * e[0] + A[(0, 2)] * e[1]);
        let tangent = |i: usize| {
            let row = A[(i, 0)] - mu * (A[(i, 1)] * e[0] + A[(i, 2)] * e[1]);
            c[i] * below - c[0] * row
        };
        tangent(2) * e[0] - tangent(1) * e[1]
    };
    let mut best: Option<(f64, Vector3<f64>)> = None;
    let (mut e, mut value) = (direction(0), across(direction(0)));
    for k in 1..=16 {
        let (e_next, value_next) = (direction(k), across(direction(k)));
        if value == 0.0 || value * value_next < 0.0 {
            let root = zero(&across, e, value, e_next, value_next);
            if let Some(lambda) = slipping(A, c, mu, root) {
                let distance = (lambda - now).norm();
                if best.is_none_or(|(least, _)| distance < least) {
                    best = Some((distance, lambda));
                }
            }
        }
        (e, value) = (e_next, value_next);
    }
    best.map(|(_, lambda)| lambda)
}

/// The direction between two in which `f` changes its sign, by the Illinois method.
fn zero(
    f: &impl Fn([f64; 2]) -> f64,
    mut a: [f64; 2],
    mut f_a: f64,
    mut b: [f64; 2],
    mut f_b: f64,
) -> [f64; 2] {
    if f_a == 0.0 {
        return a;
    }
    let mut e = a;
    let mut kept = 0_i32; // how often the same end was kept
    for _ in 0..60 {
        let part = f_a / (f_a - f_b);
        let sum = [0, 1].map(|i| a[i] + part * (b[i] - a[i]));
        e = sum.map(|x| x / norm(sum));
        let value = f(e);
        let turn = norm([b[0] - a[0], b[1] - a[1]]);
        if value == 0.0 || turn <= 4.0 * f64::EPSILON {
            break;
        }
        if value * f_a < 0.0 {
            (b, f_b) = (e, value);
            kept = kept.max(0) + 1;
            f_a *= if kept > 1 { 0.5 } else { 1.0 };
        } else {
            (a, f_a) = (e, value);
            kept = kept.min(0) - 1;
            f_b *= if kept < -1 { 0.5 } else { 1.0 };
        }
    }
    e
}
