//! A start at which shapes overlap, where their contact may separate them.
//!
//! The configuration is the closest one in the norm of the masses in which joints and loops are
//! closed and nothing is passed: neither shapes nor stops. Free bodies keep their velocities and
//! angular velocities, joints their rates.

use super::{StartValues, joints};
use crate::assembly;
use crate::dynamics::Dynamics;
use crate::system::contact::overlaps;
use crate::system::contact_origin::ContactOrigin;
use holonom_model::{Model, ModelError, Overlap, Problem};
use vi_constraints::closest::closest;
use vi_constraints::initialization::StartError;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::IndependentLoops;
use vi_rigid::directors::{FRAME, angular_velocity, center, spin_velocity};

/// The start, with what overlaps moved apart.
///
/// # Errors
/// [`ModelError`] of shapes that overlap and may not, or cannot be separated.
pub(crate) fn separated(
    model: &Model,
    mechanism: &Mechanism,
    dynamics: &Dynamics,
    origins: &[ContactOrigin],
    t: f64,
    start: StartValues,
) -> Result<StartValues, ModelError> {
    let elements = &dynamics.forces.contacts.elements;
    let mut found = overlaps(elements, origins, t, &start.q);
    let may_part =
        |contact: &str| model.contact(contact).is_some_and(|own| own.overlap == Overlap::Separate);
    let refused: Vec<Problem> =
        found.extract_if(.., |own| !may_part(&own.0)).map(|own| own.1).collect();
    if !refused.is_empty() {
        return Err(ModelError::Assembly(refused));
    }
    if found.is_empty() {
        return Ok(start);
    }
    let loops = IndependentLoops::find(mechanism, t, &start.q);
    let loops = loops.map_err(|error| assembly::refusal(&error, model))?;
    let mechanism = mechanism.clone().accepting(loops.nearly_redundant());
    let rows = loops.rows_at_start.unwrap_or(loops.rows);
    let mass = dynamics.parts.mass_matrix(&mechanism);
    let q = closest(&mass, &mechanism, &rows, t, &start.q, elements).map_err(|error| {
        let StartError::Closed { element } = &error else {
            return assembly::refusal(&error.into(), model);
        };
        let origin = elements.iter().zip(origins).find(|(own, _)| own.name() == element);
        let contact = origin.map_or(element.as_str(), |(_, origin)| origin.name());
        let message = format!("no motion nearby parts what overlaps at the start: {element}");
        let help = "move the bodies apart, or remove overlap = \"separate\" to see by how much they overlap";
        ModelError::Assembly(vec![Problem::new(format!("contact.{contact}"), message).help(help)])
    })?;
    let left = overlaps(elements, origins, t, &q);
    if !left.is_empty() {
        return Err(ModelError::Assembly(left.into_iter().map(|own| own.1).collect()));
    }
    let v = match mechanism.description().joints.is_empty() {
        true => carried(&mechanism, &start.q, &start.v, &q),
        false => joints::carried(&mechanism, &start.q, &start.v, &q),
    };
    Ok(StartValues { q, v, separated: true, ..start })
}

/// The velocities `v` at `q_old` at another configuration of free bodies: they keep `φ̇` and `ω`.
fn carried(mechanism: &Mechanism, q_old: &[f64], v: &[f64], q: &[f64]) -> Vec<f64> {
    let mut out = v.to_vec();
    for k in 0..mechanism.description().bodies.len() {
        let own = FRAME * k..FRAME * (k + 1);
        if q[own.clone()] == q_old[own.clone()] {
            continue;
        }
        let (before, velocity) = (&q_old[own.clone()], &v[own.clone()]);
        let turned = angular_velocity(before, velocity);
        out[own.clone()].copy_from_slice(&spin_velocity(&q[own], &center(velocity), &turned));
    }
    out
}
