//! A linkage that is drawn roughly: its bodies are brought together before the constraints are
//! solved.
//!
//! ```text
//! φ_child ← φ_child − r,     r: the gap of the joint without the directions in which it slides
//! ```
//! From the ground on, breadth first, each body is moved without rotation until the joint by which
//! it was reached closes. Then only closed loops are open, by the errors of the angles, and
//! Newton's method begins near a configuration. From bodies that lie apart by as much as they are
//! long it often finds none.

use nalgebra::Vector3;
use std::collections::VecDeque;
use vi_multibody::joint::{FrameId, Joint};
use vi_multibody::mechanism::Mechanism;

/// Gaps, as a part of the extent of the mechanism, that are more than errors of rounded numbers.
const ROUGH: f64 = 0.05;

/// The configuration `q` with the first `bodies` frames brought together; `None` where no joint is
/// far open.
pub(crate) fn placed(mechanism: &Mechanism, bodies: usize, q: &[f64]) -> Option<Vec<f64>> {
    let description = mechanism.description();
    let frames = description.bodies.len();
    let sides = description.joints.iter().flat_map(|joint| [&joint.parent, &joint.child]);
    let points: Vec<Vector3<f64>> = sides.map(|side| side.point().at(q)).collect();
    let extent = points.iter().map(|point| (point - points[0]).norm()).fold(0.0, f64::max);
    let far = |joint: &Joint| gap(joint, q).norm() > ROUGH * extent;
    if !description.joints.iter().any(far) {
        return None;
    }
    // joints of each frame, then of the ground
    let mut of: Vec<Vec<usize>> = vec![Vec::new(); frames + 1];
    let index = |frame| match frame {
        FrameId::Frame(k) => k,
        FrameId::Ground => frames,
    };
    for (k, joint) in description.joints.iter().enumerate() {
        for frame in [joint.parent.frame, joint.child.frame] {
            of[index(frame)].push(k);
        }
    }
    let mut q = q.to_vec();
    let mut known: Vec<bool> = (0..=frames).map(|k| k >= bodies).collect(); // nodes of beams stay
    let mut waiting: VecDeque<usize> = (bodies..=frames).rev().collect();
    while let Some(frame) = waiting.pop_front() {
        for joint in of[frame].iter().map(|k| &description.joints[*k]) {
            let [parent, child] = [joint.parent.frame, joint.child.frame].map(index);
            let (other, sign) = if parent == frame { (child, -1.0) } else { (parent, 1.0) };
            if std::mem::replace(&mut known[other], true) {
                continue;
            }
            let way = sign * gap(joint, &q);
            q[12 * other..12 * other + 3].iter_mut().zip(&way).for_each(|(x, way)| *x += way);
            waiting.push_back(other);
        }
    }
    Some(q)
}

/// `r` without the directions in which the joint slides.
fn gap(joint: &Joint, q: &[f64]) -> Vector3<f64> {
    let at = joint.configuration(q);
    let map = joint.kind.velocity_map(&at);
    let slides = map.columns().iter().filter(|twist| twist.angular.norm() == 0.0);
    slides.fold(at.gap(), |gap, twist| {
        let along = twist.linear.normalize();
        gap - along * along.dot(&gap)
    })
}
