//! The conditions of Karush, Kuhn and Tucker, judged by the derivatives of the program itself.
//!
//! ```text
//! stationarity       |∇f + Jᵀλ − z_L + z_U|_∞ / max(1, |λ|_∞, |z|_∞)
//! violation          largest distance of a variable or a row from its bounds
//! complementarity    largest z_L (x − x_L), z_U (x_U − x), λ⁺ (g_U − g), λ⁻ (g − g_L); of wrong signs |z⁻|
//! ```
//! What a method says of its point counts for nothing.
//! Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed. (2006), theorem 12.1.

use crate::program::{Multipliers, Program, Undefined};

/// How far a point is from an optimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Kkt {
    /// Relative to the largest multiplier, 1 at least.
    pub stationarity: f64,
    /// Absolute, in the unit of the row or the variable.
    pub violation: f64,
    /// Absolute.
    pub complementarity: f64,
    /// Largest multiplier.
    pub largest_multiplier: f64,
    /// The rows of the largest violations that are above the tolerance, largest first, and these.
    pub violated: Vec<(usize, f64)>,
}

/// What is asked of an optimum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Of [`Kkt::stationarity`].
    pub stationarity: f64,
    /// Of [`Kkt::violation`].
    pub violation: f64,
    /// Of [`Kkt::complementarity`].
    pub complementarity: f64,
}

/// Relative stationarity 1e-8, violations of 1e-10, complementarity 1e-9.
impl Default for Tolerances {
    fn default() -> Self {
        Self { stationarity: 1e-8, violation: 1e-10, complementarity: 1e-9 }
    }
}

/// `max(a, b)` that keeps NaN.
fn raise(worst: &mut f64, value: f64) {
    if value > *worst || value.is_nan() {
        *worst = value;
    }
}

/// Distance of a value from its bounds.
fn outside(value: f64, [lower, upper]: [f64; 2]) -> f64 {
    if value.is_nan() { f64::NAN } else { (lower - value).max(value - upper).max(0.0) }
}

/// `multiplier × distance`, zero without a bound.
fn product(multiplier: f64, distance: f64) -> f64 {
    if distance.is_finite() { multiplier * distance.max(0.0) } else { multiplier }
}

impl Kkt {
    /// Judges a point with its multipliers.
    ///
    /// # Errors
    /// [`Undefined`] where the program has no functions there.
    ///
    /// # Panics
    /// When the shapes are not those of the program.
    pub fn judge(
        program: &mut dyn Program,
        x: &[f64],
        multipliers: &Multipliers,
    ) -> Result<Self, Undefined> {
        let (n, m) = (program.variables(), program.rows());
        assert_eq!((x.len(), multipliers.rows.len()), (n, m), "shapes of the program");
        program.move_to(x)?;
        let bounds = program.bounds();
        let Multipliers { rows: lambda, lower, upper } = multipliers;
        let mut slope = vec![0.0; n];
        program.cost_gradient(&mut slope);
        let mut entries = vec![0.0; program.jacobian_places().len()];
        program.jacobian(&mut entries);
        for (&(row, column), value) in program.jacobian_places().iter().zip(&entries) {
            slope[column] += value * lambda[row];
        }
        let mut g = vec![0.0; m];
        program.row_values(&mut g);
        let (mut stationarity, mut violation, mut complementarity) = (0.0, 0.0, 0.0);
        let mut largest = 0.0;
        for i in 0..n {
            let (z_l, z_u, [low, high]) = (lower[i], upper[i], bounds.variables[i]);
            // a variable whose bounds coincide is none: its multiplier is what is left
            if low < high {
                raise(&mut stationarity, (slope[i] - z_l + z_u).abs());
                raise(&mut complementarity, product(z_l, x[i] - low).abs());
                raise(&mut complementarity, product(z_u, high - x[i]).abs());
                raise(&mut complementarity, (-z_l).max(-z_u));
                raise(&mut largest, z_l.abs().max(z_u.abs()));
            }
            raise(&mut violation, outside(x[i], [low, high]));
        }
        let mut violated = Vec::new();
        for i in 0..m {
            let [low, high] = bounds.rows[i];
            let out = outside(g[i], [low, high]);
            raise(&mut violation, out);
            violated.push((i, out));
            raise(&mut largest, lambda[i].abs());
            if low < high {
                raise(&mut complementarity, product(lambda[i].max(0.0), high - g[i]));
                raise(&mut complementarity, product((-lambda[i]).max(0.0), g[i] - low));
            }
        }
        violated.retain(|(_, out)| out.is_nan() || *out > Tolerances::default().violation);
        violated.sort_by(|a, b| b.1.total_cmp(&a.1));
        let scale = f64::max(1.0, largest);
        Ok(Self {
            stationarity: stationarity / scale,
            violation,
            complementarity,
            largest_multiplier: largest,
            violated,
        })
    }

    /// Whether a point is an optimum; false where a number is NaN.
    #[must_use]
    pub fn is_met(&self, tolerances: &Tolerances) -> bool {
        self.stationarity <= tolerances.stationarity
            && self.violation <= tolerances.violation
            && self.complementarity <= tolerances.complementarity
    }
}
