//! The maps of a pair from its columns: `X` and `S`, `F_d`, `S'`, joint coordinates.
//!
//! ```text
//! slide   S_k = (a, 0)             F_d: slide u a
//! turn    S_k = (ϱ²×a, a)          F_d: B ← B exp(u â)
//! screw   S_k = (p a + ϱ²×a, a)    F_d: both, slide p u a
//! A² = A¹ B,   φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹ + r + slides) − A²ϱ²                         [5.5]
//! ```
//! `a`: the axis of the column, at `q_n` in `F_d`. `S'` are these columns at `q_{n+1}`, since there
//! `a` has turned with what is before the column; those of rotation vectors are chained with
//! `T(ϑ)`.

use super::columns::{Act, Axis, Column, MotionSubspace};
use super::joint::JointConfiguration;
use super::{FrameMotion, MAX_DOF, TooLarge, Twist, TwistTransfer, VelocityMap};
use nalgebra::{Matrix3, Vector3};
use vi_rigid::rotation;

impl Axis {
    /// In space.
    #[inline]
    fn at(self, at: &JointConfiguration) -> Vector3<f64> {
        match self {
            Self::Parent(i) => at.axis(i),
            Self::Child(i) => at.axis_child(i),
        }
    }
}

impl Column {
    /// `S_k`.
    #[inline]
    fn twist(self, at: &JointConfiguration) -> Twist {
        let axis = self.axis.at(at);
        let turn = || at.rho_child().cross(&axis);
        match self.act {
            Act::Slide => Twist::new(axis, Vector3::zeros()),
            Act::Turn => Twist::new(turn(), axis),
            Act::Screw => Twist::new(at.pitch() * axis + turn(), axis),
        }
    }

    /// Joint coordinate: a length, m, or an angle in `(−π, π]`.
    fn coordinate(self, at: &JointConfiguration) -> f64 {
        match (self.act, self.axis) {
            (Act::Slide, axis) => at.gap().dot(&axis.at(at)),
            (_, Axis::Parent(i)) => angle_about(at, i),
            (_, Axis::Child(i)) => {
                let (axis, n, own) = (at.axis_child(i), at.axis(2), at.axis_child(2));
                libm::atan2(n.cross(&own).dot(&axis), n.dot(&own)) // of n' from n
            }
        }
    }
}

/// The angle about axis `i` of the parent: about `n` from `m_1` to `m_1'`, in `(−π, π]`.
pub(super) fn angle_about(at: &JointConfiguration, i: usize) -> f64 {
    let (first, second) = ((i + 1) % 3, (i + 2) % 3);
    let own = at.axis_child(first);
    libm::atan2(own.dot(&at.axis(second)), own.dot(&at.axis(first)))
}

/// `map ← X, S`, the columns of a rotation vector those of `tangent`.
#[inline]
fn write(
    motion: MotionSubspace,
    at: &JointConfiguration,
    tangent: &Matrix3<f64>,
    map: &mut VelocityMap,
) {
    let turn = |k: usize| -> Vector3<f64> { tangent.column(k).into() };
    match motion {
        MotionSubspace::Spherical => {
            map.begin(TwistTransfer::Point(at.rho_parent()));
            let column = |omega: Vector3<f64>| Twist::new(at.rho_child().cross(&omega), omega);
            (0..3).for_each(|k| map.push(column(turn(k)))); // (82)
        }
        MotionSubspace::Free => {
            map.begin(TwistTransfer::None);
            let zero = Vector3::zeros();
            (0..3).for_each(|k| map.push(Twist::new(Vector3::ith(k, 1.0), zero)));
            (0..3).for_each(|k| map.push(Twist::new(zero, turn(k))));
        }
        _ => {
            map.begin(TwistTransfer::Rigid(at.c()));
            motion.columns().iter().for_each(|column| map.push(column.twist(at)));
        }
    }
}

/// `map ← X, S` at a configuration.
#[inline]
pub(super) fn write_velocity_map(
    motion: MotionSubspace,
    at: &JointConfiguration,
    map: &mut VelocityMap,
) {
    write(motion, at, &Matrix3::identity(), map);
}

/// `map ← X', S'` at the new configuration.
#[inline]
pub(super) fn write_tangent(
    motion: MotionSubspace,
    u: &[f64],
    at: &JointConfiguration,
    map: &mut VelocityMap,
) {
    let tangent = match motion.rotation_vector() {
        Some(k) => rotation::tangent(&Vector3::new(u[k], u[k + 1], u[k + 2])),
        None => Matrix3::identity(),
    };
    write(motion, at, &tangent, map);
}

/// `F_d`: the motion of the child from that of the parent and the increments `u`. A gap `r_n` of
/// round-off that the pair does not allow is transported; the gap correction removes it.
#[inline]
pub(super) fn reparametrize(
    motion: MotionSubspace,
    u: &[f64],
    parent: &FrameMotion,
    at: &JointConfiguration,
) -> Result<FrameMotion, TooLarge> {
    let vector = |k: usize| Vector3::new(u[k], u[k + 1], u[k + 2]);
    match motion {
        MotionSubspace::Spherical => {
            check(vector(0).norm(), 0)?;
            let turn = rotation::exp_minus_identity(&vector(0)); // (84)
            let translation = parent.translation + parent.rotation_minus_identity * at.rho_parent()
                - turn * at.rho_child();
            return Ok(FrameMotion { translation, rotation_minus_identity: turn });
        }
        MotionSubspace::Free => {
            check(vector(3).norm(), 3)?;
            let turn = rotation::exp_minus_identity(&vector(3)); // (61)
            return Ok(FrameMotion { translation: vector(0), rotation_minus_identity: turn });
        }
        _ => {}
    }
    let (mut relative, mut slide) = (None::<Matrix3<f64>>, None::<Vector3<f64>>);
    for (k, (column, &u)) in motion.columns().iter().zip(u).enumerate() {
        let axis = column.axis.at(at);
        if column.act != Act::Slide {
            check(u, k)?;
            let turn = rotation::exp_minus_identity(&(u * axis));
            relative = Some(relative.map_or(turn, |before| before + turn + before * turn));
        }
        if column.act != Act::Turn {
            let advance = if column.act == Act::Screw { at.pitch() * u } else { u };
            slide = Some(slide.map_or(advance * axis, |before| before + advance * axis));
        }
    }
    let relative = relative.unwrap_or_else(Matrix3::zeros); // B − 1
    let slide = slide.unwrap_or_else(Vector3::zeros);
    let gap = if motion.closes_gap() { Vector3::zeros() } else { at.gap() };
    Ok(parent.child(at, &relative, &slide, &gap)) // [5.5]
}

#[inline]
fn check(angle: f64, index: usize) -> Result<(), TooLarge> {
    if angle.abs() <= rotation::MAX_ROTATION { Ok(()) } else { Err(TooLarge { index, angle }) }
}

/// Joint coordinates; of a rotation vector those of the relative attitude `(m', n')` against
/// `(m, n)`, in inertial components.
pub(super) fn coordinates(motion: MotionSubspace, at: &JointConfiguration) -> [f64; MAX_DOF] {
    let mut values = [0.0; MAX_DOF];
    for (value, column) in values.iter_mut().zip(motion.columns()) {
        *value = column.coordinate(at);
    }
    if motion == MotionSubspace::Free {
        values[..3].copy_from_slice(at.gap().as_slice());
    }
    if let Some(first) = motion.rotation_vector() {
        let vector = rotation::vector(&(at.axes_child() * at.axes().transpose()));
        values[first..first + 3].copy_from_slice(vector.as_slice());
    }
    values
}
