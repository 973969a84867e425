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
use nalgebra::{DMatrix, Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use vi_core::Motion;
use vi_core::Number;
use vi_core::force::{Force, NoTimeSlope};
use vi_core::num_dual::{Dual64, DualNum};
use vi_core::potential::{DualPotential, Potential, ScalarField};
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
    /// `d³V/dl³` at the length `l`, N/m².
    #[must_use]
    pub fn tension_bend(&self, l: f64) -> f64 {
        match self.law {
            SpringLaw::Linear => 0.0,
            SpringLaw::QuadraticStretch => 12.0 * self.stiffness * l,
        }
    }

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

    fn add_third(&self, q: &[f64], z: &[f64], scale: f64, out: &mut dyn Entries) {
        // (2 V' I + 4 V'' D Dᵀ)˙ along Ḋ = ∂D/∂q z
        let (d, rate) = (self.between.at(q), self.between.rate(z));
        let lifted = Spring {
            between: Form::constant(Vector3::from_element(Dual64::from_re(0.0))),
            stiffness: Dual64::from_re(self.stiffness),
            natural_length: Dual64::from_re(self.natural_length),
            law: self.law,
        };
        let s = Dual64::new(d.norm_squared(), 2.0 * d.dot(&rate));
        let (slope, bend) = lifted.derivatives(s);
        let turned = rate * d.transpose() + d * rate.transpose();
        let w = 2.0 * slope.eps * Matrix3::identity()
            + 4.0 * (bend.eps * d * d.transpose() + bend.re * turned);
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

/// `−c (D·Ḋ)(D·δ)/(D·D)`, the force of a damper along `δ`.
struct Pull {
    damping: f64,
    along: [f64; 3],
}

impl ScalarField<6> for Pull {
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, x: &[D; 6]) -> D {
        let [d, rate] = [[x[0], x[1], x[2]], [x[3], x[4], x[5]]];
        let dot = |a: &[D; 3], b: &[D; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let along = d[0] * self.along[0] + d[1] * self.along[1] + d[2] * self.along[2];
        dot(&d, &rate) * along / dot(&d, &d) * -self.damping
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
    fn add(&self, Motion { q, v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        self.between.add_transposed(&(scale * self.force(q, v)), out);
    }
    fn power(&self, Motion { q, v, .. }: Motion<'_>, _scratch: &mut [f64]) -> f64 {
        self.force(q, v).dot(&self.between.rate(v))
    }
    fn add_position_derivative(
        &self,
        Motion { q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.between.emit_congruence(&(scale * self.law(q, v).1), out);
    }
    fn add_velocity_derivative(
        &self,
        Motion { q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.between.emit_congruence(&(scale * self.law(q, v).2), out);
    }
    fn add_bend(
        &self,
        Motion { q, v, .. }: Motion<'_>,
        z: &[f64],
        by: [f64; 4],
        out: &mut dyn Entries,
    ) {
        let (d, rate) = (self.between.at(q), self.between.rate(v));
        let along = self.between.rate(z).into();
        let x: Vec<f64> = d.iter().chain(rate.iter()).copied().collect();
        let mut bend = DMatrix::zeros(6, 6);
        DualPotential(Pull { damping: self.damping, along }).add_hessian(&x, 1.0, &mut bend);
        let part = |i: usize, j: usize| bend.fixed_view::<3, 3>(3 * i, 3 * j).into_owned();
        let sum = part(0, 0) * by[0] + part(0, 1) * by[1] + part(1, 0) * by[2] + part(1, 1) * by[3];
        self.between.emit_congruence(&sum, out);
    }
    fn add_time_derivative(
        &self,
        _at: Motion<'_>,
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

    /// Against differences of order 4 of the first derivatives along `z`.
    #[test]
    fn second_derivatives_of_forces_against_differences() {
        let q = point();
        let [z, v] = [0.37, 0.23]
            .map(|c| -> Vec<f64> { (0..15).map(|i| (c * f64::from(i * i + 1)).sin()).collect() });
        let slopes = |f: &dyn Fn(&[f64]) -> f64, x: &[f64]| -> Vec<f64> {
            let at = |i: usize, e: f64| {
                let mut x = x.to_vec();
                x[i] += e;
                f(&x)
            };
            let e = 1e-3;
            let slope = |i: usize| {
                (8.0 * (at(i, e) - at(i, -e)) - (at(i, 2.0 * e) - at(i, -2.0 * e))) / (12.0 * e)
            };
            (0..15).map(slope).collect()
        };
        let close = |found: &DMatrix<f64>, (i, j): (usize, usize), wanted: f64| {
            let error = (found[(i, j)] - wanted).abs() / wanted.abs().max(1.0);
            assert!(error < 1e-9, "({i}, {j}): {} for {wanted}", found[(i, j)]);
        };
        for law in [SpringLaw::Linear, SpringLaw::QuadraticStretch] {
            let spring = Spring { between: between(), stiffness: 7.0, natural_length: 0.6, law };
            let mut found = DMatrix::zeros(15, 15);
            spring.add_third(&q, &z, 1.0, &mut found);
            for j in 0..15 {
                let along = |q: &[f64]| {
                    let mut hessian = DMatrix::zeros(15, 15);
                    spring.add_hessian(q, 1.0, &mut hessian);
                    hessian.row(j).iter().zip(&z).map(|(h, z)| h * z).sum::<f64>()
                };
                let wanted = slopes(&along, &q);
                (0..15).for_each(|i| close(&found, (i, j), wanted[i]));
            }
        }
        let damper = Damper { between: between(), damping: 1.7 };
        for (part, by_v) in
            [(0, [false, false]), (1, [false, true]), (2, [true, false]), (3, [true; 2])]
        {
            let mut by = [0.0; 4];
            by[part] = 1.0;
            let mut found = DMatrix::zeros(15, 15);
            damper.add_bend(Motion::new(0.0, &q, &v), &z, by, &mut found);
            for j in 0..15 {
                let slope = |q: &[f64], v: &[f64]| {
                    let mut first = DMatrix::zeros(15, 15);
                    match by_v[1] {
                        false => {
                            damper.add_position_derivative(Motion::new(0.0, q, v), 1.0, &mut first)
                        }
                        true => {
                            damper.add_velocity_derivative(Motion::new(0.0, q, v), 1.0, &mut first)
                        }
                    }
                    first.column(j).iter().zip(&z).map(|(f, z)| f * z).sum::<f64>()
                };
                let wanted = match by_v[0] {
                    false => slopes(&|x| slope(x, &v), &q),
                    true => slopes(&|x| slope(&q, x), &v),
                };
                (0..15).for_each(|i| close(&found, (i, j), wanted[i]));
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
            damper.add(Motion::new(0.0, q, v), 1.0, &mut out);
            out
        };
        let (mut by_q, mut by_v) = (DMatrix::zeros(15, 15), DMatrix::zeros(15, 15));
        damper.add_position_derivative(Motion::new(0.0, &q, &v), 1.0, &mut by_q);
        damper.add_velocity_derivative(Motion::new(0.0, &q, &v), 1.0, &mut by_v);
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
