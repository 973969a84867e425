//! A joint coordinate that depends on a parameter by the geometry of its joint.

use super::MechanismTangent;
use super::explicit::moved_value;
use crate::constraint::joint_coordinate::{JointCoordinate, Value};
use crate::force::law::Input;
use crate::mechanism::Mechanism;
use vi_core::num_dual::Dual64;

/// A joint coordinate `x(q; θ)` whose joint changes with a parameter.
#[derive(Clone, Debug)]
pub struct MovedCoordinate {
    pub(super) value: Value<Dual64>,
}

impl MovedCoordinate {
    /// `None` where the joint does not change.
    #[must_use]
    pub fn of(
        mechanism: &Mechanism,
        tangent: &MechanismTangent,
        coordinate: &JointCoordinate,
    ) -> Option<Self> {
        moved_value(mechanism, tangent, coordinate).map(|value| Self { value })
    }

    /// Whether a coordinate changes with a parameter where the configuration does not: an angle
    /// with the axes of its joint, a length with the anchors as well.
    #[must_use]
    pub fn moves(
        mechanism: &Mechanism,
        tangent: &MechanismTangent,
        coordinate: &JointCoordinate,
    ) -> bool {
        let Some((joint, freedom)) = coordinate.place() else { return !tangent.joints.is_empty() };
        let Some(change) = tangent.joints.get(&joint) else { return false };
        let sides = [&change.parent, &change.child];
        let kind = mechanism.description().joints[joint].kind;
        let of_axes_alone = kind.is_angle(freedom) && kind.pitch().is_none();
        sides.iter().any(|own| own.axes.amax() != 0.0 || !of_axes_alone && own.anchor.amax() != 0.0)
            || change.pitch != 0.0
    }

    /// Whether one of these changes so; what is held or past is judged where it is sampled.
    #[must_use]
    pub fn moves_any(mechanism: &Mechanism, tangent: &MechanismTangent, inputs: &[Input]) -> bool {
        inputs.iter().any(|input| match input {
            Input::Coordinate(own) | Input::Rate(own) => Self::moves(mechanism, tangent, own),
            _ => false,
        })
    }

    /// `x_θ`, m or rad for each unit of the parameter.
    #[must_use]
    pub fn by(&self, q: &[f64]) -> f64 {
        self.value.principal(q).eps
    }

    /// `(∇x)_θ v`, the same for each second.
    #[must_use]
    pub fn rate_by(&self, q: &[f64], v: &[f64]) -> f64 {
        let mut rate = 0.0;
        self.value.for_each_slope(q, |i, slope: Dual64| rate += slope.eps * v[i]);
        rate
    }
}
