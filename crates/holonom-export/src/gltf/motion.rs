//! How a node moves: its transformation at every frame.

use nalgebra::{Matrix3, Vector3};

use crate::tube::MemberPose;

/// Translations, rotations and scales of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NodeAnimation {
    /// m.
    pub(super) translations: Vec<[f32; 3]>,
    /// Unit quaternions `x, y, z, w` whose sign does not jump.
    pub(super) rotations: Vec<[f32; 4]>,
    /// Empty for 1.
    pub(super) scales: Vec<[f32; 3]>,
}

impl NodeAnimation {
    /// Adds a frame.
    pub(super) fn push(&mut self, pose: &MemberPose, scale: Option<[f64; 3]>) {
        self.translations.push(single(&pose.center));
        let rotation = quaternion(&pose.directors);
        let dot = |last: &[f32; 4]| last.iter().zip(&rotation).map(|(a, b)| a * b).sum::<f32>();
        let flip = self.rotations.last().is_some_and(|last| dot(last) < 0.0);
        self.rotations.push(rotation.map(|q| if flip { -q } else { q }));
        self.scales.extend(scale.map(|scale| scale.map(|s| s as f32)));
    }
}

/// Whether all frames are the same.
pub(super) fn rests<T: PartialEq>(frames: &[T]) -> bool {
    frames.windows(2).all(|pair| pair[0] == pair[1])
}

/// A vector in single precision.
pub(super) fn single(x: &Vector3<f64>) -> [f32; 3] {
    std::array::from_fn(|i| x[i] as f32)
}

/// `x, y, z, w` of a rotation, of length 1 in single precision.
pub(super) fn quaternion(rotation: &Matrix3<f64>) -> [f32; 4] {
    let q = nalgebra::Vector4::from(holonom_report::scene::quaternion(rotation));
    let q = q.try_normalize(0.0).unwrap_or(nalgebra::Vector4::w());
    std::array::from_fn(|i| q[i] as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_go_on_over_whole_revolutions() {
        let mut motion = NodeAnimation::default();
        let axis = nalgebra::Unit::new_normalize(Vector3::new(1.0, 2.0, -0.5));
        for k in 0..200 {
            let turn = nalgebra::Rotation3::from_axis_angle(&axis, 0.1 * f64::from(k));
            let pose = MemberPose { center: Vector3::zeros(), directors: turn.into_inner() };
            motion.push(&pose, None);
        }
        for pair in motion.rotations.windows(2) {
            let dot: f32 = pair[0].iter().zip(&pair[1]).map(|(a, b)| a * b).sum();
            assert!((dot - 0.05_f32.cos()).abs() < 1e-6, "cos of half the angle {dot}");
        }
        assert!(rests(&motion.translations) && !rests(&motion.rotations));
    }
}
