//! Consistent initial values.
//!
//! ```text
//! q_0:  closest point of g = 0 in the norm of W:   [W Gᵀ; G 0](q_{k+1} − q*, μ) = (0, −g_k + G (q_k − q*))
//! v_0:  closest velocity with G v + ∂g/∂t = 0 in the norm of M:
//!                                                  [M Gᵀ; G 0](v_0, μ) = (M v*, −∂g/∂t)
//! p_0 = M v_0
//! ```
//! `W` is the mass matrix where it is regular, otherwise the identity. Nothing is projected
//! silently: the [`StartReport`] says how far the start was off and how far it was moved.
//!
//! Rows and coordinates are measured by their sizes in the system, so nothing depends on units: a
//! row is satisfied when
//! ```text
//! |g_i| ≤ 64 ε Σ_j |G_ij| s_j        or, where it nearly follows from the others, its allowance
//! ```
//! Source: LMO08 §3, initialization.

use super::closest::{Sizes, closest};
pub use super::start_error::StartError;
use crate::constraints::Constraints;
use crate::saddle_point::{IndependentRows, SaddlePoint};
use serde::{Deserialize, Serialize};
use vi_core::Configuration;
use vi_core::MechanicalSystem;
use vi_core::linear::norm_inf;
use vi_core::sparse::Entries;
use vi_core::state::State;

/// What a motion starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialValues<'a> {
    /// `t_0`, s.
    pub t: f64,
    /// `q(0)`, shape `n`.
    pub q: &'a [f64],
    /// `v(0)`, shape `n`.
    pub v: &'a [f64],
    /// Angles next to those at `q(0)`, rad, as [`Constraints::unwrap_angles`] takes them; empty:
    /// without revolutions.
    pub angles: &'a [f64],
}

impl<'a> InitialValues<'a> {
    /// Configuration and velocity at the time `t` (s).
    #[must_use]
    pub fn new(t: f64, q: &'a [f64], v: &'a [f64]) -> Self {
        Self { t, q, v, angles: &[] }
    }

    /// With the revolutions of angles.
    #[must_use]
    pub fn with_angles(self, angles: &'a [f64]) -> Self {
        Self { angles, ..self }
    }
}

/// How consistent a start was, and what was done about it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StartReport {
    /// `|g(q*)|_∞` of the configuration as given.
    pub position_residual: f64,
    /// `|G v* + ∂g/∂t|_∞` of the velocity as given (at the projected configuration).
    pub velocity_residual: f64,
    /// `|q_0 − q*|_∞`.
    pub position_moved: f64,
    /// `|v_0 − v*|_∞`.
    pub velocity_moved: f64,
}

/// The start of a motion on the constraints.
#[derive(Clone, Debug, PartialEq)]
pub struct ConsistentStart {
    /// `(t_0, q_0, p_0 = M v_0)`.
    pub state: State,
    /// `v_0`, shape `n`.
    pub v: Vec<f64>,
    /// How far the given values were off.
    pub report: StartReport,
}

/// Projects `(q*, v*)` at time `t` onto the constraints and forms the start of the motion.
///
/// The independent rows are those found at `q*`; a consistent start is returned bit for bit.
///
/// # Errors
/// [`StartError`].
pub fn start(
    system: &impl MechanicalSystem,
    constraints: &impl Constraints,
    rows: &IndependentRows,
    InitialValues { t, q, v, .. }: InitialValues<'_>,
) -> Result<ConsistentStart, StartError> {
    if q.iter().chain(v).any(|x| !x.is_finite()) {
        return Err(StartError::NotFinite);
    }
    let (n, m) = (constraints.dim(), constraints.len());
    let mut report = StartReport::default();
    let mut g = vec![0.0; m];
    constraints.value(Configuration::new(t, q), &mut g);
    report.position_residual = norm_inf(&g);
    let mut q0 = q.to_vec();
    let mut sizes = Sizes::new(n, m);
    sizes.measure(constraints, Configuration::new(t, q));
    if !sizes.are_closed(&g, constraints.allowances(), |row| rows.is_dropped(row)) {
        q0 = closest(system.mass(), constraints, rows, t, q, &[])?;
        report.position_moved = distance(&q0, q);
    }

    let mut rate = vec![0.0; m]; // ∂g/∂t
    constraints.time_derivative(t, &q0, &mut rate);
    let mut violation = rate.clone();
    constraints.add_rates(t, &q0, v, &mut violation);
    report.velocity_residual = norm_inf(&violation);
    let mut v0 = v.to_vec();
    let speed = 1.0 + norm_inf(v);
    let lengths = row_lengths(constraints, t, q);
    let allowances = constraints.allowances();
    let rest = |(i, (rate, length)): (usize, (&f64, &f64))| {
        let nearly = allowances.get(i).filter(|_| rows.is_dropped(i));
        rate.abs() <= nearly.map_or(AT_REST * speed * length, |g| g * rate_of(v, &sizes.of_q))
    };
    if !violation.iter().zip(&lengths).enumerate().all(rest) {
        let r = rows.len();
        let mut x = vec![0.0; n + r];
        system.mass().mul_add(1.0, v, &mut x[..n]);
        rows.gather(&rate, &mut x[n..]);
        x[n..].iter_mut().for_each(|b| *b = -*b);
        let at = Configuration::new(t, &q0);
        let emit = |out: &mut dyn Entries| system.mass().emit(out);
        SaddlePoint::new(n, rows.clone())
            .solve(constraints, &emit, at, 1.0, at, &mut x)
            .map_err(|_| StartError::Singular)?;
        v0.copy_from_slice(&x[..n]);
        report.velocity_moved = distance(&v0, v);
    }
    let mut p0 = vec![0.0; n];
    system.mass().mul_add(1.0, &v0, &mut p0);
    Ok(ConsistentStart { state: State::new(t, q0, p0), v: v0, report })
}

/// The largest rate of the velocity `v`, 1/s.
fn rate_of(v: &[f64], sizes: &[f64]) -> f64 {
    v.iter().zip(sizes).map(|(v, size)| (v / size).abs()).fold(0.0, f64::max)
}

/// Rate of rounding in a row whose coordinates are of size one.
const AT_REST: f64 = 1e-14;

/// One more than the largest of the coordinates that a row depends on, and what they are connected
/// to, for every row.
fn row_lengths(constraints: &impl Constraints, t: f64, q: &[f64]) -> Vec<f64> {
    struct LargestCoordinate<'a>(&'a [f64], &'a mut [f64]);
    impl Entries for LargestCoordinate<'_> {
        fn add(&mut self, row: usize, column: usize, _value: f64) {
            self.1[row] = self.1[row].max(self.0[column]);
        }
    }
    let (mut sizes, mut out) = (vec![0.0; q.len()], vec![0.0; constraints.len()]);
    constraints.coordinate_sizes(q, &mut sizes);
    constraints.jacobian(t, q, &mut LargestCoordinate(&sizes, &mut out));
    let largest = norm_inf(q);
    out.iter_mut().for_each(|size| *size = 1.0 + size.min(largest));
    out
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    norm_inf(&difference)
}
