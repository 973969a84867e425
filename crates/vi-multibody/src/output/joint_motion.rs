//! Joint coordinates along a motion: angles counted on beyond `±π`, and joint rates.
//!
//! ```text
//! θ_n = θ(q_n) + 2π round((θ_{n−1} − θ(q_n)) / 2π),     θ(q_n) ∈ (−π, π]
//! ω² − ω¹,  ṙ' = (φ̇² + ω²×ϱ²) − (φ̇¹ + ω¹×(c + ϱ²)),     (ṙ', ω² − ω¹) = S' τ
//! Aᵀ A τ = Aᵀ t,   Aᵀ A τ̇ = Ȧᵀ t + Aᵀ ṫ − (Aᵀ A)˙ τ        A: S' with rotations about the anchor
//! ```
//! `θ_n` is the angle next to the last one, so revolutions are counted and round-off does not
//! accumulate; a step must not rotate the joint by `π` or more. `S'` are the columns of the pair's
//! velocity map moved to the child's anchor, where a rotation has no linear part and a translation
//! no angular one. The rate of a screw is that of its rotation: velocities of energy–momentum
//! schemes may miss the thread by `O(h²)`, and no unit of length plays a part then.
//!
//! This is output: it reads coordinates of any pair from configurations. Joint springs, motors and
//! couplings need a single coordinate with its derivatives:
//! [`crate::constraint::joint_coordinate`].
//!
//! S (and free) pairs have no angles: their coordinates are the rotation vector of
//! `(m_1', m_2', n')` against `(m_1, m_2, n)`, of length at most `π`, and their rates `ω² − ω¹`,
//! both as components along `m_1, m_2, n`.

use crate::pair::joint::{FrameId, Joint, JointConfiguration, Side};
use crate::pair::{MAX_DOF, Twist};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use std::f64::consts::TAU;
use vi_rigid::{directors, rotation};

/// The coordinates of one joint, followed from step to step.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMotion {
    joint: Joint,
    values: [f64; MAX_DOF],
}

impl JointMotion {
    /// Begins at the configuration `q` of all frames, with angles in `(−π, π]`.
    #[must_use]
    pub fn new(joint: Joint, q: &[f64]) -> Self {
        let values = principal(&joint, q);
        Self { joint, values }
    }

    /// The joint.
    #[must_use]
    pub fn joint(&self) -> &Joint {
        &self.joint
    }

    /// Continues from unwrapped `values` that were stored: those of [`JointMotion::values`].
    pub fn resume(&mut self, values: &[f64]) {
        let dof = self.joint.kind.dof();
        self.values[..dof].copy_from_slice(values);
    }

    /// Goes on to the configuration of the next step; allocates nothing.
    pub fn follow(&mut self, q: &[f64]) {
        let kind = self.joint.kind;
        let next = principal(&self.joint, q);
        let rotation_vector = kind.rotation_vector().is_some();
        for (k, next) in next.into_iter().enumerate().take(kind.dof()) {
            let revolutions = if kind.is_angle(k) && !rotation_vector {
                ((self.values[k] - next) / TAU).round()
            } else {
                0.0
            };
            self.values[k] = next + TAU * revolutions;
        }
    }

    /// The coordinates, in the order of the pair's degrees of freedom: lengths in m, angles in rad.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values[..self.joint.kind.dof()]
    }
}

/// Coordinates with angles in `(−π, π]`.
fn principal(joint: &Joint, q: &[f64]) -> [f64; MAX_DOF] {
    let at = joint.configuration(q);
    let mut values = joint.kind.coordinates(&at);
    if let Some(first) = joint.kind.rotation_vector() {
        let vector = rotation::vector(&at.axes().tr_mul(&at.axes_child()));
        values[first..first + 3].copy_from_slice(vector.as_slice());
    }
    values
}

/// The rates `τ` of a joint at `q` for the velocities `v` of all frames; the first
/// `degrees of freedom` entries count (m/s, rad/s).
#[must_use]
pub fn joint_rates(joint: &Joint, q: &[f64], v: &[f64]) -> [f64; MAX_DOF] {
    rates(joint, [&joint.parent, &joint.child].map(|side| (side.coordinates(q), rate(side, v))))
}

/// The rates `τ̇` of [`joint_rates`] at `q` for the velocities `v` and accelerations `a` of all
/// frames, m/s² and rad/s². Anchors and axes are linear in the directors, so their rates are those
/// of the velocities in the place of `q`.
#[must_use]
pub fn joint_accelerations(joint: &Joint, q: &[f64], v: &[f64], a: &[f64]) -> [f64; MAX_DOF] {
    let sides = [&joint.parent, &joint.child];
    let [q, v, a] = [
        sides.map(|side| side.coordinates(q)),
        sides.map(|side| rate(side, v)),
        sides.map(|side| rate(side, a)),
    ];
    let [at, moved] = [q, v].map(|own| JointConfiguration::new(joint, own[0], own[1]));
    let t = relative_twist(&at, [(q[0], v[0]), (q[1], v[1])]);
    let mut by_time = relative_twist(&at, [(q[0], a[0]), (q[1], a[1])]); // ω̇ = ½ Σ d_I × d̈_I
    let [parent, child] = [0, 1].map(|k| directors::angular_velocity(q[k], v[k]));
    by_time.linear +=
        child.cross(&moved.rho_child()) - parent.cross(&(moved.c() + moved.rho_child()));
    if let Some(first) = joint.kind.rotation_vector() {
        let along = |axes: [&Matrix3<f64>; 2], part: [&Vector3<f64>; 2]| {
            axes[1].tr_mul(part[0]) + axes[0].tr_mul(part[1])
        };
        let (axes, turned) = (at.axes(), moved.axes());
        let linear = along([&axes, &turned], [&t.linear, &by_time.linear]);
        let angular = along([&axes, &turned], [&t.angular, &by_time.angular]);
        return components(first, &linear, &angular);
    }
    let (gram, right) = equations(joint, &at, &t);
    let rates = solution(joint, &gram, &right);
    // G τ̇ = Ȧᵀ t + Aᵀ ṫ − Ġ τ,   G = Aᵀ A
    let (map, by) = (directions(joint, &at, &at), directions(joint, &at, &moved));
    let mut right = SVector::<f64, MAX_DOF>::zeros();
    for (i, (a, a_1)) in map.iter().zip(&by).enumerate() {
        let bent: f64 = (map.iter().zip(&by).zip(&rates))
            .map(|((b, b_1), rate)| (a_1.dot(b) + a.dot(b_1)) * rate)
            .sum();
        right[i] = a_1.dot(&t) + a.dot(&by_time) - bent;
    }
    solution(joint, &gram, &right)
}

/// The rates of the coordinates of the frame of a side among those of all frames.
fn rate<'a>(side: &Side, v: &'a [f64]) -> &'a [f64] {
    match side.frame {
        FrameId::Ground => &[0.0; 12],
        FrameId::Frame(k) => &v[12 * k..12 * k + 12],
    }
}

/// `τ` from the coordinates and rates of both frames.
fn rates(joint: &Joint, both: [(&[f64], &[f64]); 2]) -> [f64; MAX_DOF] {
    let at = JointConfiguration::new(joint, both[0].0, both[1].0);
    let Twist { linear, angular } = relative_twist(&at, both);
    if let Some(first) = joint.kind.rotation_vector() {
        let axes = at.axes();
        return components(first, &axes.tr_mul(&linear), &axes.tr_mul(&angular));
    }
    let (gram, right) = equations(joint, &at, &Twist::new(linear, angular));
    solution(joint, &gram, &right)
}

/// `(ṙ', ω² − ω¹)` from the coordinates and rates of both frames.
fn relative_twist(at: &JointConfiguration, both: [(&[f64], &[f64]); 2]) -> Twist {
    let [parent, child] = both.map(|(q, v)| twist(q, v));
    let to_child_anchor = |t: &Twist, arm: &Vector3<f64>| t.linear + t.angular.cross(arm);
    let linear = to_child_anchor(&child, &at.rho_child())
        - to_child_anchor(&parent, &(at.c() + at.rho_child()));
    Twist::new(linear, child.angular - parent.angular)
}

/// The rates of a rotation vector whose first component is number `first`.
fn components(first: usize, linear: &Vector3<f64>, angular: &Vector3<f64>) -> [f64; MAX_DOF] {
    let mut rates = [0.0; MAX_DOF];
    rates[..first].copy_from_slice(&linear.as_slice()[..first]);
    rates[first..first + 3].copy_from_slice(angular.as_slice());
    rates
}

/// The columns `A` of `S'`, of rotations the angular part alone; of directors in `own`, which may
/// be those of velocities.
fn directions(
    joint: &Joint,
    at: &JointConfiguration,
    own: &JointConfiguration,
) -> [Twist; MAX_DOF] {
    let (kinds, columns) = (joint.kind.velocity_map(at), joint.kind.velocity_map(own));
    let (kinds, columns) = (kinds.columns(), columns.columns());
    let zero = Vector3::zeros();
    std::array::from_fn(|k| match (kinds.get(k), columns.get(k)) {
        (Some(kind), Some(own)) if kind.angular == zero => Twist::new(own.linear, zero),
        (_, Some(own)) => Twist::new(zero, own.angular),
        _ => Twist::new(zero, zero),
    })
}

/// `Aᵀ A`, padded with the identity, and `Aᵀ t`.
fn equations(
    joint: &Joint,
    at: &JointConfiguration,
    t: &Twist,
) -> (SMatrix<f64, MAX_DOF, MAX_DOF>, SVector<f64, MAX_DOF>) {
    let (mut gram, mut right) = (SMatrix::identity(), SVector::zeros());
    let (map, dof) = (directions(joint, at, at), joint.kind.dof());
    for (i, a) in map.iter().take(dof).enumerate() {
        right[i] = a.dot(t);
        for (j, b) in map.iter().take(dof).enumerate() {
            gram[(i, j)] = a.dot(b);
        }
    }
    (gram, right)
}

/// `G⁻¹ x`.
fn solution(
    joint: &Joint,
    gram: &SMatrix<f64, MAX_DOF, MAX_DOF>,
    right: &SVector<f64, MAX_DOF>,
) -> [f64; MAX_DOF] {
    if joint.kind.dof() == 1 {
        // what the equations below are for one column, to the last bit
        let (length, mut rates) = (gram[(0, 0)], [0.0; MAX_DOF]);
        rates[0] = if length == 0.0 { f64::NAN } else { right[0] / length };
        return rates;
    }
    let rates = gram.lu().solve(right); // None: the pair itself is singular
    rates.map_or([f64::NAN; MAX_DOF], Into::into)
}

/// The twist `(φ̇, ω)` of a frame.
fn twist(q: &[f64], v: &[f64]) -> Twist {
    Twist::new(directors::center(v), directors::angular_velocity(q, v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::joint::complete_axis;
    use crate::pair::{FrameMotion, PairKind};
    use nalgebra::Rotation3;

    fn two_frames() -> Vec<f64> {
        let mut q = vec![0.0; 24];
        let turn = |v: [f64; 3]| *Rotation3::from_scaled_axis(Vector3::from(v)).matrix();
        directors::set_frame(&mut q[..12], &Vector3::new(0.3, 0.1, -0.2), &turn([0.4, -0.2, 0.7]));
        let center = Vector3::new(500.0, -0.4, 0.6); // a long arm
        directors::set_frame(&mut q[12..], &center, &turn([-0.3, 0.9, 0.1]));
        q
    }

    fn joint(kind: PairKind, q: &[f64]) -> Joint {
        let axes = complete_axis(&Vector3::new(1.0, 2.0, -0.5).normalize());
        let point = Vector3::new(0.7, -0.2, 0.5);
        let side = |k: usize| Side::at(FrameId::Frame(k), &q[12 * k..12 * k + 12], &point, &axes);
        Joint { name: "j".into(), kind, parent: side(0), child: side(1) }
    }

    /// Moves the child by the increments `u` of its joint.
    fn advance(joint: &Joint, q: &mut [f64], u: &[f64]) {
        let at = joint.configuration(q);
        let motion = joint.kind.reparametrize(u, &FrameMotion::rest(), &at).unwrap();
        let center = directors::center(&q[12..]) + motion.translation;
        let triad = directors::triad(&q[12..]);
        let triad: Matrix3<f64> = triad + motion.rotation_minus_identity * triad;
        directors::set_frame(&mut q[12..], &center, &triad);
    }

    #[test]
    fn turns_and_slides_accumulate() {
        for kind in PairKind::ALL.into_iter().filter(|kind| kind.dof() < 6) {
            if kind.rotation_vector().is_some() {
                continue;
            }
            let mut q = two_frames();
            let joint = joint(kind, &q);
            let mut tracker = JointMotion::new(joint.clone(), &q);
            let start = tracker.values().to_vec();
            // the second angle of a universal joint stays short of the lock of its fork
            let u: Vec<f64> = (0..kind.dof()).map(|k| [2.5, -0.9, 3.0][k]).collect();
            for _ in 0..40 {
                advance(&joint, &mut q, &u);
                tracker.follow(&q);
            }
            for (k, value) in tracker.values().iter().enumerate() {
                let error = (value - start[k] - 40.0 * u[k]).abs();
                assert!(error < 1e-10, "{kind:?}, freedom {k}: off by {error:e}");
            }
        }
    }

    #[test]
    fn rates_are_the_derivatives_of_the_coordinates() {
        for kind in PairKind::ALL.into_iter().filter(|kind| kind.dof() < 6) {
            let mut start = two_frames();
            let joint = joint(kind, &start);
            let u: Vec<f64> = (0..kind.dof()).map(|k| [0.4, -0.3, 0.5][k]).collect();
            if kind.rotation_vector().is_none() {
                advance(&joint, &mut start, &u);
            }
            // both frames rotate, so the parent's motion must drop out
            let e = 1e-6;
            let moved = |by: f64| {
                let mut q = start.clone();
                let u: Vec<f64> = u.iter().map(|u| by * u).collect();
                advance(&joint, &mut q, &u);
                let common =
                    *Rotation3::from_scaled_axis(by * Vector3::new(0.2, 0.5, -0.3)).matrix();
                for frame in q.chunks_exact_mut(12) {
                    let (center, triad) = (directors::center(frame), directors::triad(frame));
                    directors::set_frame(frame, &(common * center), &(common * triad));
                }
                q
            };
            let (plus, minus) = (moved(e), moved(-e));
            let v: Vec<f64> = plus.iter().zip(&minus).map(|(a, b)| (a - b) / (2.0 * e)).collect();
            let rates = joint_rates(&joint, &start, &v);
            let (a, b) = (principal(&joint, &plus), principal(&joint, &minus));
            for k in 0..kind.dof() {
                let difference = (a[k] - b[k]) / (2.0 * e);
                let error = (rates[k] - difference).abs();
                assert!(error < 1e-6, "{kind:?}, freedom {k}: {} against {difference}", rates[k]);
            }
        }
    }

    /// A velocity that misses the thread, in metres and in millimetres.
    #[test]
    fn the_rate_of_a_screw_does_not_depend_on_the_unit_of_length() {
        let q = two_frames();
        let screw = joint(PairKind::Screw(crate::pair::screw::Pitch::new(0.3)), &q);
        let (axis, arm) = {
            let at = screw.configuration(&q);
            (at.axis(2), at.rho_child())
        };
        // the child rotates about the axis at 2 rad/s and does not advance
        let mut v = vec![0.0; 24];
        v[12..15].copy_from_slice((2.0 * arm.cross(&axis)).as_slice());
        for k in (15..24).step_by(3) {
            let director = Vector3::from_column_slice(&q[k..k + 3]);
            v[k..k + 3].copy_from_slice((2.0 * axis.cross(&director)).as_slice());
        }
        for unit in [1.0, 1e3, 1e-3] {
            let scaled = |x: &[f64]| -> Vec<f64> {
                let size = |i: usize| if i % 12 < 3 { unit } else { 1.0 };
                x.iter().enumerate().map(|(i, x)| size(i) * x).collect()
            };
            let mut other = screw.clone();
            other.kind = PairKind::Screw(crate::pair::screw::Pitch::new(0.3 * unit));
            other.parent.anchor *= unit;
            other.child.anchor *= unit;
            let rate = joint_rates(&other, &scaled(&q), &scaled(&v))[0];
            println!("{unit:e}: {rate}");
            assert!((rate - 2.0).abs() < 1e-12, "{unit:e}: {rate}");
        }
    }

    /// Both frames rotate and accelerate; the coordinates of the joint are `u_k (t + t²)`.
    #[test]
    fn accelerations_are_the_second_derivatives_of_the_coordinates() {
        for kind in PairKind::ALL.into_iter().filter(|kind| kind.dof() < 6) {
            let mut start = two_frames();
            let joint = joint(kind, &start);
            let free = kind.rotation_vector().is_none();
            let u: Vec<f64> = (0..kind.dof()).map(|k| [0.4, -0.3, 0.5][k]).collect();
            if free {
                advance(&joint, &mut start, &u);
            }
            let moved = |t: f64| {
                let mut q = start.clone();
                let u: Vec<f64> = u.iter().map(|u| (t + t * t) * u).collect();
                advance(&joint, &mut q, &u);
                let turn = (t - 3.0 * t * t) * Vector3::new(0.2, 0.5, -0.3);
                let common = *Rotation3::from_scaled_axis(turn).matrix();
                for frame in q.chunks_exact_mut(12) {
                    let (center, triad) = (directors::center(frame), directors::triad(frame));
                    directors::set_frame(frame, &(common * center), &(common * triad));
                }
                q
            };
            let e = 1e-3; // differences of fourth order
            let at = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| moved(k * e));
            let sum = |c: [f64; 5], scale: f64| -> Vec<f64> {
                let term = |i: usize| c.iter().zip(&at).map(|(c, q)| c * q[i]).sum::<f64>();
                (0..24).map(|i| term(i) / scale).collect()
            };
            let v = sum([1.0, -8.0, 0.0, 8.0, -1.0], 12.0 * e);
            let a = sum([-1.0, 16.0, -30.0, 16.0, -1.0], 12.0 * e * e);
            let found = joint_accelerations(&joint, &start, &v, &a);
            // u, of a rotation vector along the joint frame
            let rates = joint_rates(&joint, &start, &v);
            for k in 0..kind.dof() {
                let error = (found[k] - 2.0 * rates[k]).abs();
                println!("{kind:?}, freedom {k}: off by {error:.1e}");
                assert!(error < 1e-6, "{kind:?}, freedom {k}: {} and {}", found[k], rates[k]);
            }
        }
    }

    /// Of any velocities and accelerations, also those that no motion of rigid bodies has: as the
    /// rates grow along `q + s v`, `v + s a`.
    #[test]
    fn accelerations_are_the_derivatives_of_the_rates() {
        let mut seed = 0.37_f64;
        let mut number = || {
            seed = (seed * 997.0 + 0.123).fract();
            2.0 * seed - 1.0
        };
        for kind in PairKind::ALL.into_iter().filter(|kind| kind.dof() < 6) {
            let mut q = two_frames();
            q[12] = 1.3; // an arm of ordinary length
            let joint = joint(kind, &q);
            if kind.rotation_vector().is_none() {
                let u: Vec<f64> = (0..kind.dof()).map(|k| [0.4, -0.3, 0.5][k]).collect();
                advance(&joint, &mut q, &u);
            }
            let [v, a]: [Vec<f64>; 2] =
                [(); 2].map(|()| (0..24).map(|_| number()).collect::<Vec<f64>>());
            let found = joint_accelerations(&joint, &q, &v, &a);
            let at = |s: f64| {
                let moved = |x: &[f64], by: &[f64]| -> Vec<f64> {
                    x.iter().zip(by).map(|(x, by)| x + s * by).collect()
                };
                joint_rates(&joint, &moved(&q, &v), &moved(&v, &a))
            };
            let slope = |e: f64, k: usize| (at(e)[k] - at(-e)[k]) / (2.0 * e);
            for k in 0..kind.dof() {
                // Richardson's extrapolation of three steps
                let d = [1.0, 0.5, 0.25].map(|part| slope(4e-3 * part, k));
                let d = [0, 1].map(|i| (4.0 * d[i + 1] - d[i]) / 3.0);
                let wanted = (16.0 * d[1] - d[0]) / 15.0;
                let error = (found[k] - wanted).abs() / wanted.abs().max(1.0);
                println!("{kind:?}, freedom {k}: {}, off by {error:.1e}", found[k]);
                assert!(error < 1e-10, "{kind:?}, freedom {k}: {} for {wanted}", found[k]);
            }
        }
    }

    #[test]
    fn a_rotation_vector_has_components_along_the_joint_frame() {
        let mut q = two_frames();
        let joint = joint(PairKind::Spherical, &q);
        let n = joint.configuration(&q).axis(2);
        advance(&joint, &mut q, (3.1 * n).as_slice());
        let tracker = JointMotion::new(joint, &q);
        let error =
            (Vector3::from_column_slice(tracker.values()) - Vector3::new(0.0, 0.0, 3.1)).amax();
        assert!(error < 1e-14, "off by {error:e}");
    }
}
