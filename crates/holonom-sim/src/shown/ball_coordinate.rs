//! Rotation vectors of ball joints, with their derivatives.
//!
//! ```text
//! y = θ_k,   exp θ̂ = A_pᵀ A_c,   |θ| ≤ π        A_p, A_c: the joint's axes on parent and child
//! θ = (φ/s) v,   s = |v|,   φ = 2 atan2(s, w)        of the quaternion (w, v), w ≥ 0
//! ∇y, D²y, D³y, y_θ: with dual numbers as directors and axes
//! ```

use crate::design::ModelTangent;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use vi_control::objective::Quantity;
use vi_core::num_dual::{Dual64, HyperDual64, HyperHyperDual64};
use vi_core::{Configuration, Motion, Number};
use vi_multibody::FrameId;
use vi_multibody::joint::{Joint, Side};
use vi_rigid::directors::FRAME;

/// `s²` up to which `φ/s` is taken as its series, to its fourth power: to rounding.
const SMALL: f64 = 1e-3;
/// `φ/s = 2 asin(s)/s` in powers of `s²`.
const SERIES: [f64; 6] = [2.0, 1.0 / 3.0, 3.0 / 20.0, 5.0 / 56.0, 35.0 / 576.0, 63.0 / 1408.0];

/// A number of the rotation vector of a joint.
#[derive(Clone, Debug)]
pub(crate) struct BallCoordinate {
    sides: [Side; 2], // on parent and child
    part: usize,
    moved: Vec<[Matrix3<f64>; 2]>, // (axes)_θ
}

impl BallCoordinate {
    /// Number `part` of that of a joint, its place `k` in the mechanism.
    pub(crate) fn new(joint: &Joint, k: usize, part: usize, tangents: &[ModelTangent]) -> Self {
        let moved = |own: &ModelTangent| {
            let own = own.numbers.joints.get(&k);
            own.map(|own| [own.parent.axes, own.child.axes]).unwrap_or_default()
        };
        let sides = [joint.parent, joint.child];
        Self { sides, part, moved: tangents.iter().map(moved).collect() }
    }

    fn axes(&self) -> [Matrix3<f64>; 2] {
        self.sides.each_ref().map(|side| side.axes)
    }

    /// The number at coordinates and axes that have tangents.
    fn number<T: Number>(&self, q: &impl Fn(usize) -> T, axes: [Matrix3<T>; 2]) -> T {
        let [parent, child] = [0, 1].map(|side| match self.sides[side].frame {
            FrameId::Ground => axes[side],
            FrameId::Frame(frame) => {
                let director = |i, j| q(FRAME * frame + 3 + 3 * j + i);
                Matrix3::from_fn(director) * axes[side]
            }
        });
        let rotation = Rotation3::from_matrix_unchecked(parent.tr_mul(&child));
        let own = UnitQuaternion::from_rotation_matrix(&rotation).into_inner();
        let sign = T::of(1.0_f64.copysign(Number::real(own.w)));
        let vector = own.imag() * sign;
        let square = vector.norm_squared();
        let scale = match Number::real(square) < SMALL {
            true => SERIES.iter().rev().fold(T::of(0.0), |sum, c| sum * square + T::of(*c)),
            false => {
                let sine = square.sqrt();
                sine.arctangent(own.w * sign) * T::of(2.0) / sine
            }
        };
        vector[self.part] * scale
    }

    /// Visits the coordinates that it depends on, each with what tells it from others, by 1.
    fn for_each(&self, mut visit: impl FnMut(usize, &dyn Fn(usize) -> f64)) {
        for side in &self.sides {
            let FrameId::Frame(frame) = side.frame else { continue };
            for k in FRAME * frame + 3..FRAME * (frame + 1) {
                visit(k, &|i| f64::from(u8::from(i == k)));
            }
        }
    }

    fn still<T: Number>(&self) -> [Matrix3<T>; 2] {
        self.axes().map(|axes| axes.map(T::of))
    }
}

impl Quantity for BallCoordinate {
    fn value(&self, at: Configuration<'_>) -> f64 {
        self.number(&|i| at.q[i], self.axes())
    }
    fn add_slope(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.for_each(|k, is_own| {
            let along = |i: usize| Dual64::new(at.q[i], is_own(i));
            out[k] += scale * self.number(&along, self.still()).eps;
        });
    }
    fn add_bend(&self, at: Motion<'_>, scale: f64, out: &mut [f64]) {
        self.for_each(|k, is_own| {
            let along = |i: usize| HyperDual64::new(at.q[i], at.v[i], is_own(i), 0.0);
            out[k] += scale * self.number(&along, self.still()).eps1eps2;
        });
    }
    fn add_third(&self, at: Configuration<'_>, [v, w]: [&[f64]; 2], scale: f64, out: &mut [f64]) {
        self.for_each(|k, is_own| {
            let along = |i: usize| {
                HyperHyperDual64::new(at.q[i], v[i], w[i], is_own(i), 0.0, 0.0, 0.0, 0.0)
            };
            out[k] += scale * self.number(&along, self.still()).eps1eps2eps3;
        });
    }
    fn by_parameter(&self, parameter: usize, at: Configuration<'_>) -> f64 {
        let Some(moved) = self.moved.get(parameter) else { return 0.0 };
        let own = self.axes();
        let axes = [0, 1].map(|side| own[side].zip_map(&moved[side], Dual64::new));
        self.number(&|i| Dual64::from_re(at.q[i]), axes).eps
    }
    fn rate_by_parameter(&self, parameter: usize, at: Motion<'_>) -> f64 {
        let Some(moved) = self.moved.get(parameter) else { return 0.0 };
        let own = self.axes();
        let with = |axes: f64, by: f64| HyperDual64::new(axes, by, 0.0, 0.0);
        let axes = [0, 1].map(|side| own[side].zip_map(&moved[side], with));
        self.number(&|i| HyperDual64::new(at.q[i], 0.0, at.v[i], 0.0), axes).eps1eps2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use vi_multibody::pair::PairKind;
    use vi_rigid::{directors, rotation};

    /// Slopes and second derivatives against differences, at small and at large turns.
    #[test]
    fn rotation_vectors_have_their_derivatives() {
        let frame = |k| FrameId::Frame(k);
        let side = |k: usize, turn: Vector3<f64>| Side {
            frame: frame(k),
            anchor: Vector3::zeros(),
            axes: rotation::exp(&turn),
        };
        for size in [0.0, 1e-9, 1e-2, 0.06, 1.0, 3.0] {
            let turn = size * Vector3::new(2.0, -1.0, 2.0) / 3.0;
            let mut q = vec![0.0; 24];
            let first = rotation::exp(&Vector3::new(0.3, 0.5, -0.2));
            directors::set_frame(&mut q[..12], &Vector3::zeros(), &first);
            let axes = rotation::exp(&Vector3::new(0.1, -0.4, 0.2));
            let second = first * axes * rotation::exp(&turn) * axes.transpose();
            directors::set_frame(&mut q[12..], &Vector3::zeros(), &second);
            let own = |turn| side(0, turn);
            let joint = Joint {
                name: String::new(),
                kind: PairKind::Spherical,
                parent: own(Vector3::new(0.1, -0.4, 0.2)),
                child: side(1, Vector3::new(0.1, -0.4, 0.2)),
            };
            for part in 0..3 {
                let number = BallCoordinate::new(&joint, 0, part, &[]);
                let at = |q: &[f64]| number.value(Configuration::new(0.0, q));
                assert!((at(&q) - turn[part]).abs() < 1e-14, "{size}: {}", at(&q));
                let along: Vec<f64> = (0..24).map(|i| (i as f64).sin()).collect();
                // along turns of both: off them a quaternion is no unit one
                let turned = |e: f64| {
                    let mut q = q.clone();
                    for k in [0, 12] {
                        let by = e * Vector3::new(along[k], along[k + 1], along[k + 2]);
                        let triad = rotation::exp(&by) * directors::triad(&q[k..k + 12]);
                        directors::set_frame(&mut q[k..k + 12], &Vector3::zeros(), &triad);
                    }
                    q
                };
                let dq = |q: &[f64]| {
                    let mut dq = vec![0.0; 24];
                    for k in [0, 12] {
                        let by = Vector3::new(along[k], along[k + 1], along[k + 2]);
                        let triad = by.cross_matrix() * directors::triad(&q[k..k + 12]);
                        directors::set_frame(&mut dq[k..k + 12], &Vector3::zeros(), &triad);
                    }
                    dq
                };
                let slope = |q: &[f64]| {
                    let mut out = vec![0.0; 24];
                    number.add_slope(Configuration::new(0.0, q), 1.0, &mut out);
                    vi_core::linear::dot(&out, &dq(q))
                };
                let e = 1e-4;
                let difference = (8.0 * (at(&turned(e)) - at(&turned(-e)))
                    - (at(&turned(2.0 * e)) - at(&turned(-2.0 * e))))
                    / (12.0 * e);
                let apart = (slope(&q) - difference).abs();
                assert!(apart < 1e-10 * (1.0 + difference.abs()), "{size}: slope {apart:.1e}");
                // d/dε of the slope along the turn: D²y[dq, dq] + ∇y·d²q
                let mut bend = vec![0.0; 24];
                number.add_bend(Motion::new(0.0, &q, &dq(&q)), 1.0, &mut bend);
                let mut second = vec![0.0; 24];
                for k in [0, 12] {
                    let by = Vector3::new(along[k], along[k + 1], along[k + 2]).cross_matrix();
                    let triad = by * by * directors::triad(&q[k..k + 12]);
                    directors::set_frame(&mut second[k..k + 12], &Vector3::zeros(), &triad);
                }
                let mut gradient = vec![0.0; 24];
                number.add_slope(Configuration::new(0.0, &q), 1.0, &mut gradient);
                let exact =
                    vi_core::linear::dot(&bend, &dq(&q)) + vi_core::linear::dot(&gradient, &second);
                let difference = (8.0 * (slope(&turned(e)) - slope(&turned(-e)))
                    - (slope(&turned(2.0 * e)) - slope(&turned(-2.0 * e))))
                    / (12.0 * e);
                let apart = (exact - difference).abs();
                assert!(apart < 1e-9 * (1.0 + difference.abs()), "{size}: bend {apart:.1e}");
            }
        }
    }
}
