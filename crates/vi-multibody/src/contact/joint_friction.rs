//! Dry friction of a joint coordinate.
//!
//! ```text
//! |Λ| ≤ b,   Λ = −b sgn(Δθ/h),   B = ∇θ(q_n),   b = ½(h_{n−1} + h_n) τ_c + μr |h λ_⊥|
//! ```

use crate::constraint::joint_coordinate::JointCoordinate;
use vi_constraints::nonsmooth::{ContactLaw, ContactRows, Unilateral};
use vi_core::Configuration;
use vi_core::interval::Interval;

/// Dry friction of a joint coordinate.
#[derive(Clone, Debug)]
pub struct JointFriction {
    /// The name of the joint.
    pub name: String,
    /// The coordinate.
    pub coordinate: JointCoordinate,
    /// Effort while it slides, N or N·m.
    pub effort: f64,
    /// `μr` of the force across the axis of an angle, m; `μ` of a length.
    pub lever: f64,
    /// Friction of what sticks over that of what slides, 1 or more.
    pub static_ratio: f64,
    /// The size of the coordinate, m or rad.
    pub size: f64,
}

impl Unilateral for JointFriction {
    fn name(&self) -> &str {
        &self.name
    }

    fn source(&self) -> String {
        format!("{}.friction", self.name)
    }

    fn law(&self) -> ContactLaw {
        let Self { effort, lever, static_ratio, .. } = *self;
        ContactLaw::Dry { effort, lever, static_ratio }
    }

    fn size(&self) -> f64 {
        self.size
    }

    fn near(&self, _s: &Interval, _at: Configuration<'_>, out: &mut Vec<(u32, f64)>) {
        out.push((0, 0.0));
    }

    fn gap(&self, _feature: u32, _at: Configuration<'_>) -> f64 {
        0.0
    }

    fn rows(&self, _feature: u32, at: Configuration<'_>, out: &mut ContactRows) {
        self.coordinate.for_each_slope(at.q, |i, slope| out.add(i, slope));
        out.end_row();
    }

    fn slip(&self, _feature: u32, s: &Interval) -> [f64; 2] {
        [self.coordinate.change(s).difference, 0.0]
    }
}
