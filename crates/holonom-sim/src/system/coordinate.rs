//! Joint coordinates of a model, as those of a mechanism.

use holonom_model::{ModelError, Problem};
use vi_multibody::builder::{CoordinateId, JointId};

/// Degree of freedom `freedom` of joint `id`.
pub(super) fn coordinate(
    joint: &holonom_model::Joint,
    id: JointId,
    freedom: usize,
    key: String,
) -> Result<CoordinateId, ModelError> {
    check_coordinate(joint, freedom, key).map(|()| id.coordinate(freedom))
}

/// Refuses a coordinate that the joint does not have.
pub(crate) fn check_coordinate(
    joint: &holonom_model::Joint,
    freedom: usize,
    key: String,
) -> Result<(), ModelError> {
    let kind = joint.pair();
    let count = kind.coordinate_count();
    if freedom < count {
        return Ok(());
    }
    let name = kind.name();
    let message = format!("a {name} joint has no coordinate {freedom}");
    let help = match count {
        0 => format!("{name} joints have no joint coordinates: use a [[spring]] or a [[load]]"),
        1 => "its only coordinate is 0".to_owned(),
        _ => format!("its coordinates are 0 to {}", count - 1),
    };
    Err(ModelError::Assembly(vec![Problem::new(key, message).help(help)]))
}
