//! Springs and dampers between two points.
//!
//! ```text
//! D = X_b − X_a,  l = |D|
//! linear             V = ½ k (l − l_0)²            ∇V = k (1 − l_0/l) D · ∂D/∂q
//! quadratic stretch  V = ½ k (l² − l_0²)²          ∇V = 2 k (l² − l_0²) D · ∂D/∂q
//! damper             f = −c (D̂·Ḋ) D̂  on X_b, opposite on X_a
//! ```
//! `V` depends on `D·D` alone, so it is invariant and the discrete force pair passes along the line
//! of the midpoint `D`: momentum maps stay exact.

use crate::geometry::form::Form;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use vi_core::Number;
use vi_core::force::{Force, NoTimeSlope};
use vi_core::potential::Potential;
use vi_core::sparse::Entries;

/// Force law of a spring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpringLaw {
    /// `½ k (l − l_0)²`, `k` in N/m.
    #[default]
    Linear,
    /// `½ k (l² − l_0²)²`, `k` in N/m³.
    QuadraticStretch,
}

/// A spring between two points.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring<T = f64> {
    /// `D = X_b − X_a`.
    pub between: Form<T>,
    /// `k`.
    pub stiffness: T,
    /// `l_0`, m.
    pub natural_length: T,
    /// Force law.
    pub law: SpringLaw,
}

impl<T: Number> Spring<T> {
    /// `V'` and `V''` with respect to `s = D·D`.
    fn derivatives(&self, s: T) -> (T, T) {
        let (k, l0) = (self.stiffness, self.natural_length);
        let half = T::of(0.5) * k;
        match self.law {
            SpringLaw::QuadraticStretch => (k * (s - l0 * l0), k),
            SpringLaw::Linear if l0.vanishes() => (half, T::of(0.0)),
            SpringLaw::Linear => {
                let l = s.sqrt();
                (half * (T::of(1.0) - l0 / l), T::of(0.25) * k * l0 / (s * l))
            }
        }
    }

    /// `dV/dl` at the length `l`, N: positive when the spring pulls its ends together.
    pub fn tension_at(&self, l: T) -> T {
        let l0 = self.natural_length;
        match self.law {
            SpringLaw::Linear => self.stiffness * (l - l0),
            SpringLaw::QuadraticStretch => T::of(2.0) * self.stiffness * (l * l - l0 * l0) * l,
        }
    }

    /// `V`, J.
    pub fn energy(&self, q: &[f64]) -> T {
        let (d, l0) = (self.between.at(q), self.natural_length);
        let s = d.dot(&d);
        let stretch = match self.law {
            SpringLaw::Linear => s.sqrt() - l0,
            SpringLaw::QuadraticStretch => s - l0 * l0,
        };
        T::of(0.5) * self.stiffness * stretch * stretch
    }

    /// `scale ∂V/∂D`.
    pub(crate) fn pull(&self, q: &[f64], scale: f64) -> Vector3<T> {
        let d = self.between.at(q);
        let (slope, _) = self.derivatives(d.dot(&d));
        d * (T::of(2.0 * scale) * slope)
    }
}

impl Spring {
    /// `dV/dl`, N: positive when the spring pulls its ends together.
    #[must_use]
    pub fn tension(&self, q: &[f64]) -> f64 {
        self.tension_at(self.between.at(q).norm())
    }
}

impl Potential for Spring {
    fn value(&self, q: &[f64]) -> f64 {
        self.energy(q)
    }

    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        self.between.add_transposed(&self.pull(q, scale), out);
    }

    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let d = self.between.at(q);
        let (slope, bend) = self.derivatives(d.norm_squared());
        let w = 2.0 * slope * Matrix3::identity() + 4.0 * bend * d * d.transpose();
        self.between.emit_congruence(&(scale * w), out);
    }
}

/// A damper between two points, along their line.
#[derive(Clone, Debug, PartialEq)]
pub struct Damper<T = f64> {
    /// `D = X_b − X_a`.
    pub between: Form<T>,
    /// `c`, N·s/m.
    pub damping: T,
}

impl<T: Number> Damper<T> {
    /// `f` on `X_b`.
    pub(crate) fn force(&self, q: &[f64], v: &[f64]) -> Vector3<T> {
        let (d, rate) = (self.between.at(q), self.between.rate(v));
        d * (-self.damping * d.dot(&rate) / d.dot(&d))
    }
}

impl Damper {
    /// `c dl/dt`, N: positive when the damper pulls its ends together.
    #[must_use]
    pub fn tension(&self, q: &[f64], v: &[f64]) -> f64 {
        let d = self.between.at(q);
        self.damping * d.dot(&self.between.rate(v)) / d.norm()
    }

    /// `f` on `X_b`, with `∂f/∂D` and `∂f/∂Ḋ`.
    fn law(&self, q: &[f64], v: &[f64]) -> (Vector3<f64>, Matrix3<f64>, Matrix3<f64>) {
        let (d, rate) = (self.between.at(q), self.between.rate(v));
        let s = d.norm_squared();
        let (along, c) = (d.dot(&rate), self.damping);
        // f = −c (D·Ḋ) D / (D·D)
        let f = self.force(q, v);
        let by_position = -c
            * (d * rate.transpose() / s + along / s * Matrix3::identity()
                - 2.0 * along / (s * s) * d * d.transpose());
        (f, by_position, -c / s * d * d.transpose())
    }
}

impl Force for Damper {
    fn add(&self, _t: f64, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]) {
        self.between.add_transposed(&(scale * self.force(q, v)), out);
    }
    fn power(&self, _t: f64, q: &[f64], v: &[f64], _scratch: &mut [f64]) -> f64 {
        self.force(q, v).dot(&self.between.rate(v))
    }
    fn add_position_derivative(
        &self,
        _t: f64,
        q: &[f64],
        v: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.between.emit_congruence(&(scale * self.law(q, v).1), out);
    }
    fn add_velocity_derivative(
        &self,
        _t: f64,
        q: &[f64],
        v: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.between.emit_congruence(&(scale * self.law(q, v).2), out);
    }
    fn add_time_derivative(
        &self,
        _t: f64,
        _q: &[f64],
        _v: &[f64],
        _scale: f64,
        _out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        Ok(())
    }
    fn acts_from_ground(&self) -> bool {
        self.between.is_seen_from_ground()
    }
    fn is_dissipative(&self) -> bool {
        self.damping != 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn between() -> Form {
        Form::point(0, &Vector3::new(0.3, -0.2, 0.1)).minus(&Form::particle(12, 3))
    }

    fn point() -> Vec<f64> {
        vec![0.1, 0.2, -0.3, 0.9, 0.1, 0.0, -0.1, 0.8, 0.3, 0.2, 0.1, 1.0, 1.1, -0.7, 0.4]
    }

    #[test]
    fn spring_derivatives_against_central_differences() {
        for law in [SpringLaw::Linear, SpringLaw::QuadraticStretch] {
            let spring = Spring { between: between(), stiffness: 7.0, natural_length: 0.6, law };
            let (q, e) = (point(), 1e-6);
            let gradient = |q: &[f64]| {
                let mut out = vec![0.0; 15];
                spring.add_gradient(q, 1.0, &mut out);
                out
            };
            let mut hessian = DMatrix::zeros(15, 15);
            spring.add_hessian(&q, 1.0, &mut hessian);
            for i in 0..15 {
                let (mut plus, mut minus) = (q.clone(), q.clone());
                (plus[i], minus[i]) = (plus[i] + e, minus[i] - e);
                let slope = (spring.value(&plus) - spring.value(&minus)) / (2.0 * e);
                assert!((slope - gradient(&q)[i]).abs() < 1e-7, "{law:?} gradient {i}");
                let (gp, gm) = (gradient(&plus), gradient(&minus));
                for j in 0..15 {
                    let bend = (gp[j] - gm[j]) / (2.0 * e);
                    assert!((bend - hessian[(j, i)]).abs() < 1e-6, "{law:?} hessian {j},{i}");
                }
            }
        }
    }

    #[test]
    fn damper_derivatives_against_central_differences() {
        let damper = Damper { between: between(), damping: 1.7 };
        let (q, e) = (point(), 1e-6);
        let v: Vec<f64> = (0..15).map(|i| 0.1 * f64::from(i) - 0.5).collect();
        let force = |q: &[f64], v: &[f64]| {
            let mut out = vec![0.0; 15];
            damper.add(0.0, q, v, 1.0, &mut out);
            out
        };
        let (mut by_q, mut by_v) = (DMatrix::zeros(15, 15), DMatrix::zeros(15, 15));
        damper.add_position_derivative(0.0, &q, &v, 1.0, &mut by_q);
        damper.add_velocity_derivative(0.0, &q, &v, 1.0, &mut by_v);
        for i in 0..15 {
            let shift = |x: &[f64], by: f64| {
                let mut x = x.to_vec();
                x[i] += by;
                x
            };
            let (fp, fm) = (force(&shift(&q, e), &v), force(&shift(&q, -e), &v));
            let (gp, gm) = (force(&q, &shift(&v, e)), force(&q, &shift(&v, -e)));
            for j in 0..15 {
                assert!(((fp[j] - fm[j]) / (2.0 * e) - by_q[(j, i)]).abs() < 1e-6, "q {j},{i}");
                assert!(((gp[j] - gm[j]) / (2.0 * e) - by_v[(j, i)]).abs() < 1e-6, "v {j},{i}");
            }
        }
        let power: f64 = force(&q, &v).iter().zip(&v).map(|(f, v)| f * v).sum();
        assert!(power < 0.0, "a damper takes power out: {power}");
    }
}
