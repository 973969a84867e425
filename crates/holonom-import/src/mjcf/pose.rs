//! Positions and orientations in all forms of MJCF.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Unit, UnitQuaternion, Vector3};

use super::settings::{FileSettings, ORIENTATIONS};
use crate::element::XmlElement;
use crate::source::{Refusal, Result};

/// `pos` and orientation of an element; the identity without them.
pub(crate) fn pose(element: &XmlElement, settings: &FileSettings) -> Result<Isometry3<f64>> {
    let position = Vector3::from(element.vector::<3>("pos")?.unwrap_or_default());
    Ok(Isometry3::from_parts(position.into(), orientation(element, settings)?))
}

/// The orientation of an element; the identity without one.
pub(crate) fn orientation(
    element: &XmlElement,
    settings: &FileSettings,
) -> Result<UnitQuaternion<f64>> {
    let mut stated = ORIENTATIONS.into_iter().filter(|name| element.attribute(name).is_some());
    let Some(name) = stated.next() else { return Ok(UnitQuaternion::identity()) };
    if let Some(second) = stated.next() {
        let message = format!("the orientation is stated twice: `{name}` and `{second}`");
        return Err(Refusal::at(element.place_of(second), message, "keep one of them"));
    }
    let zero = |what: &str| {
        let message = format!("`{name}`: {what} has no direction");
        Refusal::at(element.place_of(name), message, "write a vector that is not zero")
    };
    match name {
        "quat" => {
            let [w, x, y, z] = element.vector::<4>(name)?.unwrap_or([1.0, 0.0, 0.0, 0.0]);
            UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-14)
                .ok_or_else(|| zero("the quaternion"))
        }
        "axisangle" => {
            let [x, y, z, angle] = element.vector::<4>(name)?.unwrap_or_default();
            let axis = Unit::try_new(Vector3::new(x, y, z), 1e-14);
            let axis = axis.ok_or_else(|| zero("the axis"))?;
            Ok(UnitQuaternion::from_axis_angle(&axis, settings.angle(angle)))
        }
        "euler" => {
            let angles = element.vector::<3>(name)?.unwrap_or_default();
            Ok(euler(angles.map(|a| settings.angle(a)), &settings.eulerseq))
        }
        "xyaxes" => {
            let [a, b, c, d, e, f] = element.vector::<6>(name)?.unwrap_or_default();
            let x = Vector3::new(a, b, c).try_normalize(1e-14).ok_or_else(|| zero("the x axis"))?;
            let y = Vector3::new(d, e, f);
            let y = (y - x * x.dot(&y)).try_normalize(1e-14);
            let y = y.ok_or_else(|| zero("the y axis beside the x axis"))?;
            let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
            Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)))
        }
        _ => {
            let z = Vector3::from(element.vector::<3>(name)?.unwrap_or_default());
            let z = Unit::try_new(z, 1e-14).ok_or_else(|| zero("the z axis"))?;
            Ok(to_axis(&z))
        }
    }
}

/// The least rotation that takes the third axis to `z`.
pub(crate) fn to_axis(z: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), z).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    })
}

/// Small letters: about the axes of the rotated body; capitals: about fixed axes.
fn euler(angles: [f64; 3], sequence: &str) -> UnitQuaternion<f64> {
    let mut rotation = UnitQuaternion::identity();
    for (letter, angle) in sequence.chars().zip(angles) {
        let axis = match letter.to_ascii_lowercase() {
            'x' => Vector3::x_axis(),
            'y' => Vector3::y_axis(),
            _ => Vector3::z_axis(),
        };
        let turn = UnitQuaternion::from_axis_angle(&axis, angle);
        rotation = if letter.is_ascii_lowercase() { rotation * turn } else { turn * rotation };
    }
    rotation
}
