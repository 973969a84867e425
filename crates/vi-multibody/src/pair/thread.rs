//! The thread of a screw, `n·r − p θ`: what it is off by, and the anchor where it holds.

use super::joint::{Joint, JointConfiguration};
use super::maps::angle_about;

/// Moves the child's anchor along the axis to where the thread holds in the configuration `q` of
/// all frames.
pub fn fit_thread(joint: &mut Joint, q: &[f64]) {
    let excess = excess(&joint.configuration(q));
    joint.child.anchor -= excess * joint.child.axes.column(2);
}

/// `n·r − p θ` with `θ` in `(−π, π]`.
fn excess(at: &JointConfiguration) -> f64 {
    at.gap().dot(&at.axis(2)) - at.pitch() * angle_about(at, 2)
}

/// The same to the nearest revolution.
pub(super) fn excess_to_revolution(at: &JointConfiguration) -> f64 {
    let (excess, lead) = (excess(at), std::f64::consts::TAU * at.pitch());
    if lead == 0.0 { excess } else { excess - lead * (excess / lead).round() }
}
