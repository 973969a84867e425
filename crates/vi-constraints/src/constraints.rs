//! Holonomic constraints `g(q, t) = 0`.
//!
//! Letters: `g ∈ R^m`, `G = ∂g/∂q ∈ R^{m×n}`, `D²g[v, w]` the second derivative in directions `v`,
//! `w`. Source: LMO08 §2; rheonomic constraints are held at the nodes `t_{n+1}`, and the velocity
//! at the start satisfies `G v + ∂g/∂t = 0`.

use vi_core::Configuration;
use vi_core::discrete_lagrangian::NoStepSlope;
use vi_core::interval::{Interval, StepChange};
use vi_core::newton::UnknownBlock;
use vi_core::sparse::{Entries, Product};

/// Relative size of a pivot below which a constraint counts as dependent on the others.
///
/// Permanent redundancy leaves pivots near `1e-16`; a mechanism at an angle `δ` from a singular
/// configuration keeps one near `0.1 δ`.
pub const RANK_TOLERANCE: f64 = 1e-11;

/// Constraints `g(q, t) = 0` on `q ∈ R^n`.
///
/// Redundant constraints are allowed: rows of `G` may depend on one another.
pub trait Constraints: Send + Sync {
    /// Number `n` of coordinates.
    fn dim(&self) -> usize;
    /// Number `m` of constraints.
    fn len(&self) -> usize;
    /// Whether there is no constraint.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// `out ← g(q, t)`, shape `m`.
    fn value(&self, at: Configuration<'_>, out: &mut [f64]);
    /// [`Constraints::value`] up to rounding: what is compared with bounds, not solved.
    fn residual(&self, at: Configuration<'_>, out: &mut [f64]) {
        self.value(at, out);
    }
    /// Emits `G(q, t)`, shape `m × n`; always the same places in the same order.
    fn jacobian(&self, t: f64, q: &[f64], out: &mut dyn Entries);
    /// `out_i ← vᵀ D²g_i(q, t) w`, shape `m`.
    fn second_derivative(&self, t: f64, q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]);
    /// Emits `scale Σ_i w_i D²g_i(q, t)`, shape `n × n`; always the same places in the same order.
    ///
    /// The default asks [`Constraints::second_derivative`] for every pair of coordinates and
    /// allocates: `O(n²)` calls, for small systems.
    fn weighted_hessian(
        &self,
        t: f64,
        q: &[f64],
        weights: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let (n, m) = (self.dim(), self.len());
        let (mut v, mut w, mut rows) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
        for i in 0..n {
            v[i] = 1.0;
            for j in 0..n {
                w[j] = 1.0;
                self.second_derivative(t, q, &v, &w, &mut rows);
                let sum: f64 = rows.iter().zip(weights).map(|(g, w)| g * w).sum();
                out.add(i, j, scale * sum);
                w[j] = 0.0;
            }
            v[i] = 0.0;
        }
    }
    /// `out ← out + G(q, t) v`, shape `m`; forms no matrix.
    fn add_rates(&self, t: f64, q: &[f64], v: &[f64], out: &mut [f64]) {
        self.jacobian(t, q, &mut Product { v, out });
    }
    /// `out ← G(q_{n+1/2}) Δq/h`, shape `m`, (45); of constraints on velocities what the step
    /// leaves of them.
    fn step_rates(&self, s: &Interval, out: &mut [f64]) {
        out.fill(0.0);
        self.add_rates(s.t_mid(), &s.q_mid, &s.v_mid, out);
    }
    /// Emits the derivative of what a step closes by its end, shape `m × n`: `G(q_{n+1})`, of
    /// constraints on velocities that of `h A_d` along motions that keep bodies rigid; always the
    /// same places in the same order.
    fn step_jacobian(&self, s: &Interval, out: &mut dyn Entries) {
        self.jacobian(s.t_end(), &s.q1, out);
    }
    /// Emits that of constraints on velocities alone. Since `A_d(q, q'; h) = A_d(q', q; −h)`, the
    /// derivative of `h A_d` by the start of a step is minus this of the step backwards.
    fn velocity_step_jacobian(&self, _s: &Interval, _out: &mut dyn Entries) {}
    /// `out ← out +` how `h A_d` changes with the length and the time of a step between the same
    /// ends, shape `m`; zero of other constraints.
    ///
    /// # Errors
    /// [`NoStepSlope`].
    fn add_step_change(
        &self,
        _s: &Interval,
        _change: StepChange,
        _out: &mut [f64],
    ) -> Result<(), NoStepSlope> {
        match self.is_rheonomic() {
            true => Err(NoStepSlope { what: "a prescribed motion".into() }),
            false => Ok(()),
        }
    }
    /// Emits `∂²g/∂t∂q`, shape `m × n`: of constraints on velocities `A v = b(t, q)` `−∂b/∂q`;
    /// nothing of others.
    fn drift_slope(&self, _at: Configuration<'_>, _out: &mut dyn Entries) {}
    /// `out ← ∂g/∂t`, shape `m`; zero for scleronomic constraints.
    fn time_derivative(&self, _t: f64, _q: &[f64], out: &mut [f64]) {
        out.fill(0.0);
    }
    /// `out ← d²g/dt² − G q̈ = D²g[v, v] + 2 ∂G/∂t v + ∂²g/∂t²`, shape `m`.
    fn acceleration_terms(&self, t: f64, q: &[f64], v: &[f64], out: &mut [f64]) {
        self.second_derivative(t, q, v, v, out);
    }
    /// Whether `g` depends on time.
    fn is_rheonomic(&self) -> bool {
        false
    }
    /// Whether rows constrain velocities that no configuration is left out by (rolling): no
    /// symplectic form is conserved then, and no theorem bounds the energy.
    fn constrains_velocities(&self) -> bool {
        false
    }
    /// Raises the floors of increments of a reparametrization to what the rounding of `q` makes of
    /// them: far from the origin forces know positions to `ε |q|`, and an increment is not resolved
    /// any further. The unknowns of several control points may follow one another. The default
    /// raises none.
    fn raise_floors(&self, _q: &[f64], _blocks: &mut [UnknownBlock]) {}
    /// `out_j ←` the size that coordinate `j` has in the system, shape `n`, positive: rounding
    /// moves it by `ε` of that. The default takes the largest coordinate for all.
    fn coordinate_sizes(&self, q: &[f64], out: &mut [f64]) {
        let largest = vi_core::linear::norm_inf(q);
        out.fill(if largest > 0.0 { largest } else { 1.0 });
    }
    /// `out_j ←` what one is for coordinate `j` where rows of `G` are compared, shape `n`,
    /// positive: a lever arm for the coordinates of a point, 1 for those of a director. The default
    /// takes 1 for all.
    fn coordinate_units(&self, out: &mut [f64]) {
        out.fill(1.0);
    }
    /// `out_i ← Σ_j |G_ij| size_j`, shape `m`, in the unit of `g_i`: rounding changes `g_i` by a
    /// small multiple of `ε` of that. A row that depends on time adds the size of what it follows.
    /// Allocates.
    fn row_sizes(&self, at: Configuration<'_>, out: &mut [f64]) {
        let mut sizes = vec![0.0; self.dim()];
        self.coordinate_sizes(at.q, &mut sizes);
        out.fill(0.0);
        self.jacobian(at.t, at.q, &mut RowSums { sizes: &sizes, out });
    }
    /// The residual that each constraint may keep where it nearly follows from others, shape `m`,
    /// in the unit of `g_i`; empty where none may: constraints of closed loops that hold up to the
    /// digits of a file ([`crate::closure`]).
    fn allowances(&self) -> &[f64] {
        &[]
    }
    /// Relative size of a pivot below which a constraint counts as dependent on the others: larger
    /// where some nearly are.
    fn rank_tolerance(&self) -> f64 {
        RANK_TOLERANCE
    }
    /// The first coordinate of a body whose directors are left-handed at `q`, a solution of the
    /// constraints that no motion reaches.
    fn reflected(&self, _q: &[f64]) -> Option<usize> {
        None
    }
    /// Number of joint angles whose revolutions count: [`vi_core::Configuration::angles`].
    fn angle_count(&self) -> usize {
        0
    }
    /// Replaces each unwrapped angle by its value at `q` next to it, rad.
    fn unwrap_angles(&self, _q: &[f64], _angles: &mut [f64]) {}
    /// The same after a step with the unknowns `u`; angles whose revolutions alone count may be
    /// those of the increments, to rounding errors.
    fn follow_angles(&self, q: &[f64], _u: &[f64], angles: &mut [f64]) {
        self.unwrap_angles(q, angles);
    }
    /// The angles at `q` without revolutions, rad, in `(−π, π]`.
    fn principal_angles(&self, q: &[f64]) -> Vec<f64> {
        let mut angles = vec![0.0; self.angle_count()];
        self.unwrap_angles(q, &mut angles);
        angles
    }
}

/// `out_i ← out_i + |G_ij| size_j` for every entry of a Jacobian.
#[derive(Debug)]
pub struct RowSums<'a> {
    /// `size_j`, shape `n`.
    pub sizes: &'a [f64],
    /// Shape `m`.
    pub out: &'a mut [f64],
}

impl Entries for RowSums<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.out[row] += value.abs() * self.sizes[column];
    }
}

/// No constraints at all: the schemes then reduce to discrete Euler–Lagrange stepping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unconstrained(
    /// Number `n` of coordinates.
    pub usize,
);

impl Constraints for Unconstrained {
    fn dim(&self) -> usize {
        self.0
    }
    fn len(&self) -> usize {
        0
    }
    fn value(&self, _at: Configuration<'_>, _out: &mut [f64]) {}
    fn jacobian(&self, _t: f64, _q: &[f64], _out: &mut dyn Entries) {}
    fn second_derivative(&self, _t: f64, _q: &[f64], _v: &[f64], _w: &[f64], _out: &mut [f64]) {}
    fn weighted_hessian(&self, _: f64, _: &[f64], _: &[f64], _: f64, _: &mut dyn Entries) {}
}

/// Constraints given by two functions, `g` and a dense `G`.
///
/// The second derivative is taken from central differences of `G` along `v`: exact to round-off for
/// quadratic `g`, of order `1e-10` relative otherwise. It enters nothing but the acceleration-level
/// multiplier.
pub struct ConstraintFn<F, J> {
    n: usize,
    m: usize,
    value: F,
    jacobian: J,
}

impl<F, J> std::fmt::Debug for ConstraintFn<F, J> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ConstraintFn")
            .field("n", &self.n)
            .field("m", &self.m)
            .finish_non_exhaustive()
    }
}

impl<F, J> ConstraintFn<F, J>
where
    F: Fn(&[f64], &mut [f64]) + Send + Sync,
    J: Fn(&[f64], &mut nalgebra::DMatrix<f64>) + Send + Sync,
{
    /// `value(q, g)` writes `g(q)` of shape `m`; `jacobian(q, G)` writes `G(q)` of shape `m × n`
    /// into a zeroed matrix.
    pub fn new(n: usize, m: usize, value: F, jacobian: J) -> Self {
        Self { n, m, value, jacobian }
    }

    fn dense(&self, q: &[f64]) -> nalgebra::DMatrix<f64> {
        let mut matrix = nalgebra::DMatrix::zeros(self.m, self.n);
        (self.jacobian)(q, &mut matrix);
        matrix
    }
}

impl<F, J> Constraints for ConstraintFn<F, J>
where
    F: Fn(&[f64], &mut [f64]) + Send + Sync,
    J: Fn(&[f64], &mut nalgebra::DMatrix<f64>) + Send + Sync,
{
    fn dim(&self) -> usize {
        self.n
    }
    fn len(&self) -> usize {
        self.m
    }
    fn value(&self, at: Configuration<'_>, out: &mut [f64]) {
        (self.value)(at.q, out);
    }
    fn jacobian(&self, _t: f64, q: &[f64], out: &mut dyn Entries) {
        let matrix = self.dense(q);
        for j in 0..self.n {
            for i in 0..self.m {
                out.add(i, j, matrix[(i, j)]);
            }
        }
    }
    fn second_derivative(&self, _t: f64, q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        let size = vi_core::linear::norm_inf(v);
        out.fill(0.0);
        if size <= 0.0 {
            return;
        }
        let e = 1e-4 * (1.0 + vi_core::linear::norm_inf(q)) / size;
        let shifted = |by: f64| -> Vec<f64> { q.iter().zip(v).map(|(q, v)| q + by * v).collect() };
        let difference = self.dense(&shifted(e)) - self.dense(&shifted(-e));
        for (i, o) in out.iter_mut().enumerate() {
            for (j, w) in w.iter().enumerate() {
                *o += difference[(i, j)] * w / (2.0 * e);
            }
        }
    }
}
