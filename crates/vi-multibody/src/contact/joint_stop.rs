//! Stops of a joint coordinate.
//!
//! ```text
//! g = θ − a   or   b − θ,    B = ±∇θ(q_n)
//! ```
//! On a joint of the spanning tree `±∇θ` pulls back to `±1` at the unknown of the coordinate, and
//! `g(q_{n+1}) = g_n ± u_j`. Angles are unwrapped.

use crate::constraint::joint_coordinate::JointCoordinate;
use vi_constraints::nonsmooth::{ContactLaw, ContactRows, Unilateral};
use vi_core::Configuration;
use vi_core::interval::Interval;

/// Feature of the lower stop.
pub const LOWER: u32 = 0;
/// Feature of the upper stop.
pub const UPPER: u32 = 1;

/// Gaps above this part of their size are read from the angles of the node.
const NEAR: f64 = 1e-2;

/// Limits of a joint coordinate.
#[derive(Clone, Debug)]
pub struct JointStop {
    /// The name of the joint.
    pub name: String,
    /// The coordinate.
    pub coordinate: JointCoordinate,
    /// The lower limit, m or rad.
    pub lower: Option<f64>,
    /// The upper limit, m or rad.
    pub upper: Option<f64>,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// The size of a gap, m or rad.
    pub size: f64,
}

impl JointStop {
    fn sign(feature: u32) -> f64 {
        if feature == LOWER { 1.0 } else { -1.0 }
    }

    /// The gap to a limit at a node with this coordinate.
    fn gap_at(&self, coordinate: f64, (feature, limit): (u32, f64), at: Configuration<'_>) -> f64 {
        let from_afar = coordinate - limit;
        // near the stop an angle is compared without its revolutions
        match from_afar.abs() > NEAR * self.size {
            true => from_afar * Self::sign(feature),
            false => self.coordinate.distance_from(limit, at) * Self::sign(feature),
        }
    }
}

impl Unilateral for JointStop {
    fn name(&self) -> &str {
        &self.name
    }

    fn source(&self) -> String {
        format!("{}.stop", self.name)
    }

    fn law(&self) -> ContactLaw {
        ContactLaw::Frictionless { restitution: self.restitution }
    }

    fn size(&self) -> f64 {
        self.size
    }

    fn near(&self, _s: &Interval, at: Configuration<'_>, out: &mut Vec<(u32, f64)>) {
        let coordinate = self.coordinate.at_node(at);
        for (feature, limit) in [(LOWER, self.lower), (UPPER, self.upper)] {
            if let Some(limit) = limit {
                out.push((feature, self.gap_at(coordinate, (feature, limit), at)));
            }
        }
    }

    fn gap(&self, feature: u32, at: Configuration<'_>) -> f64 {
        let limit = if feature == LOWER { self.lower } else { self.upper };
        self.gap_at(self.coordinate.at_node(at), (feature, limit.unwrap_or(0.0)), at)
    }

    fn rows(&self, feature: u32, at: Configuration<'_>, out: &mut ContactRows) {
        let sign = Self::sign(feature);
        self.coordinate.for_each_slope(at.q, |i, slope| out.add(i, sign * slope));
        out.end_row();
    }

    fn slip(&self, _feature: u32, _s: &Interval) -> [f64; 2] {
        [0.0; 2]
    }
}
