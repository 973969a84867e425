//! Laws of the distance of two points and its rate.
//!
//! ```text
//! D = X_b − X_a,  l = |D|,  e = D/l,  l̇ = e·Ḋ
//! f = −T(t, l, l̇) e  on X_b, opposite on X_a
//! ∂f/∂D = −T_l e eᵀ − T_v e ((Ḋ − l̇ e)/l)ᵀ − (T/l) (I − e eᵀ),   ∂f/∂Ḋ = −T_v e eᵀ
//! ```
//! The pair of a step passes along the line of the midpoint `D`: momentum maps are exact.

use super::bends::{LawEvaluation, Pushes};
use super::joint_force::{EffortSlopes, JointLaw};
use super::law::{Input, Target};
use crate::geometry::form::Form;
use nalgebra::{DMatrix, Matrix3, Vector3};
use std::sync::Arc;
use vi_core::Motion;
use vi_core::force::{Force, NoTimeSlope};
use vi_core::sparse::Entries;

/// `T(t, l, l̇)` between two points: positive where it pulls them together.
#[derive(Clone, Debug)]
pub struct Tension {
    /// `D = X_b − X_a`.
    pub between: Form,
    /// `T`, N; [`JointLaw::effort`] of the distance (m) and its rate (m/s).
    pub law: Arc<dyn JointLaw>,
}

/// Where the points are to each other.
struct TensionLine {
    length: f64,
    along: Vector3<f64>,    // e
    rate: f64,              // l̇
    velocity: Vector3<f64>, // Ḋ
}

impl Tension {
    fn line(&self, q: &[f64], v: &[f64]) -> TensionLine {
        let (d, velocity) = (self.between.at(q), self.between.rate(v));
        let length = d.norm();
        let along = d / length;
        TensionLine { length, along, rate: along.dot(&velocity), velocity }
    }

    /// `q ← q + scale ∂T/∂q`, `of_v ← of_v + scale ∂T/∂v`, both of shape `n`.
    pub fn add_tension_slopes(
        &self,
        t: f64,
        q: &[f64],
        v: &[f64],
        scale: f64,
        [of_q, of_v]: [&mut [f64]; 2],
    ) {
        let TensionLine { length, along, rate, velocity } = self.line(q, v);
        let slopes = self.law.slopes(t, length, rate);
        let turning = (velocity - rate * along) / length;
        let by_position = slopes.by_coordinate * along + slopes.by_rate * turning;
        self.between.add_transposed(&(scale * by_position), of_q);
        self.between.add_transposed(&(scale * slopes.by_rate * along), of_v);
    }

    /// With the law and its second derivatives, of the distance and its rate.
    fn with_bends(
        &self,
        t: f64,
        q: &[f64],
        v: &[f64],
        then: impl FnOnce((&[Input], &dyn Pushes), &LawEvaluation<'_>),
    ) {
        let TensionLine { length, rate, .. } = self.line(q, v);
        let (tension, EffortSlopes { by_coordinate, by_rate }) =
            self.law.effort_and_slopes(t, length, rate);
        let slopes = DMatrix::from_row_slice(1, 2, &[by_coordinate, by_rate]);
        let bends = self.law.bends(t, length, rate);
        let bend = |along: &[f64], w: &[f64], out: &mut [f64]| bends.along(along, w[0], out);
        let reads = [Input::Length(self.between.clone()), Input::LengthRate(self.between.clone())];
        let target = Target::Points(self.between.clone());
        let (values, efforts) = (&[length, rate], &[tension]);
        let law = LawEvaluation { values, efforts, slopes: &slopes, bend: &bend };
        then((&reads, &target), &law);
    }

    /// `q ← q + scale ∂²T/∂q∂(q, v)` times `changes` of both, `of_v` likewise.
    pub fn add_tension_bends(
        &self,
        (t, q, v): (f64, &[f64], &[f64]),
        scale: f64,
        changes: [&[f64]; 2],
        out: [&mut [f64]; 2],
    ) {
        self.with_bends(t, q, v, |(reads, _), law| {
            law.add(reads, [q, v], 0, scale, changes, out);
        });
    }

    /// `T`, N, and the rate of the distance, m/s.
    #[must_use]
    pub fn tension_and_rate(&self, t: f64, q: &[f64], v: &[f64]) -> [f64; 2] {
        let TensionLine { length, rate, .. } = self.line(q, v);
        [self.law.effort(t, length, rate), rate]
    }
}

impl Force for Tension {
    fn add(&self, Motion { t, q, v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        let TensionLine { length, along, rate, .. } = self.line(q, v);
        let tension = self.law.effort(t, length, rate);
        self.between.add_transposed(&(-scale * tension * along), out);
    }

    fn power(&self, Motion { t, q, v, .. }: Motion<'_>, _scratch: &mut [f64]) -> f64 {
        let [tension, rate] = self.tension_and_rate(t, q, v);
        -tension * rate
    }

    fn add_time_derivative(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        let TensionLine { length, along, rate, .. } = self.line(q, v);
        let slope = self.law.by_time(t, length, rate).ok_or(NoTimeSlope)?;
        self.between.add_transposed(&(-scale * slope * along), out);
        Ok(())
    }

    fn add_position_derivative(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let TensionLine { length, along, rate, velocity } = self.line(q, v);
        let (tension, slopes) = self.law.effort_and_slopes(t, length, rate);
        let outer = along * along.transpose();
        let turning = (velocity - rate * along) / length;
        let w = slopes.by_coordinate * outer
            + slopes.by_rate * along * turning.transpose()
            + tension / length * (Matrix3::identity() - outer);
        self.between.emit_congruence(&(-scale * w), out);
    }

    fn add_velocity_derivative(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let TensionLine { length, along, rate, .. } = self.line(q, v);
        let slope = self.law.slopes(t, length, rate).by_rate;
        self.between.emit_congruence(&(-scale * slope * along * along.transpose()), out);
    }

    fn add_bend(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        z: &[f64],
        by: [f64; 4],
        out: &mut dyn Entries,
    ) {
        self.with_bends(t, q, v, |own, law| law.emit_at_node(own, [q, v, z], by, out));
    }

    fn acts_from_ground(&self) -> bool {
        self.between.is_seen_from_ground()
    }

    fn is_dissipative(&self) -> bool {
        self.law.is_dissipative()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `T = 3 l² + 0.7 l l̇ + sin t`.
    struct CurvedTension;

    impl JointLaw for CurvedTension {
        fn effort(&self, t: f64, l: f64, rate: f64) -> f64 {
            3.0 * l * l + 0.7 * l * rate + libm::sin(t)
        }
        fn slopes(&self, _t: f64, l: f64, rate: f64) -> EffortSlopes {
            EffortSlopes { by_coordinate: 6.0 * l + 0.7 * rate, by_rate: 0.7 * l }
        }
        fn is_dissipative(&self) -> bool {
            true
        }
    }

    #[test]
    fn derivatives_against_central_differences() {
        let between = Form::point(0, &Vector3::new(0.3, -0.2, 0.1)).minus(&Form::particle(12, 3));
        let force = Tension { between, law: Arc::new(CurvedTension) };
        let q = [0.1, 0.2, -0.3, 0.9, 0.1, 0.0, -0.1, 0.8, 0.3, 0.2, 0.1, 1.0, 1.1, -0.7, 0.4];
        let v: Vec<f64> = (0..15).map(|i| 0.1 * f64::from(i) - 0.5).collect();
        let (t, e) = (0.4, 1e-6);
        let value = |q: &[f64], v: &[f64]| {
            let mut out = vec![0.0; 15];
            force.add(Motion::new(t, q, v), 1.0, &mut out);
            out
        };
        let (mut by_q, mut by_v) = (DMatrix::zeros(15, 15), DMatrix::zeros(15, 15));
        force.add_position_derivative(Motion::new(t, &q, &v), 1.0, &mut by_q);
        force.add_velocity_derivative(Motion::new(t, &q, &v), 1.0, &mut by_v);
        let shift = |x: &[f64], i: usize, by: f64| {
            let mut x = x.to_vec();
            x[i] += by;
            x
        };
        let mut worst: f64 = 0.0;
        for i in 0..15 {
            let (fp, fm) = (value(&shift(&q, i, e), &v), value(&shift(&q, i, -e), &v));
            let (gp, gm) = (value(&q, &shift(&v, i, e)), value(&q, &shift(&v, i, -e)));
            for j in 0..15 {
                worst = worst.max(((fp[j] - fm[j]) / (2.0 * e) - by_q[(j, i)]).abs());
                worst = worst.max(((gp[j] - gm[j]) / (2.0 * e) - by_v[(j, i)]).abs());
            }
        }
        println!("largest error of a derivative: {worst:.1e}");
        assert!(worst < 1e-7);
        let power: f64 = value(&q, &v).iter().zip(&v).map(|(f, v)| f * v).sum();
        assert!((power - force.power(Motion::new(t, &q, &v), &mut [0.0; 15])).abs() < 1e-13);
    }
}
