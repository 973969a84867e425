//! What an integrator is refused for, beside what its parts refuse.

use crate::constraints::Constraints;
use crate::initialization::InitialValues;
use crate::setup::SetupError;
use vi_core::mechanical_system::MechanicalSystem;

/// Refuses backward sub-steps of dissipative systems.
pub(super) fn check_composition(
    system: &impl MechanicalSystem,
    gammas: &[f64],
) -> Result<(), SetupError> {
    let backward = gammas.iter().any(|gamma| gamma * gammas[0] <= 0.0);
    match system.is_dissipative() && backward {
        true => Err(SetupError::DissipativeComposition),
        false => Ok(()),
    }
}

/// Refuses what the Galerkin schemes have no equations for.
pub(super) fn check_galerkin(system: &impl MechanicalSystem) -> Result<(), SetupError> {
    if system.adds_mass() {
        return Err(SetupError::no_galerkin("beams with mass scaling"));
    }
    if system.has_memory() {
        return Err(SetupError::no_galerkin("forces with internal variables"));
    }
    Ok(())
}

/// Checks the initial values and the constraints against the number of coordinates.
///
/// # Errors
/// [`SetupError::Shape`].
pub fn check_shapes(
    system: &impl MechanicalSystem,
    constraints: &impl Constraints,
    at: InitialValues<'_>,
) -> Result<(), SetupError> {
    let expected = system.dim();
    for (what, found) in [
        ("q(0)", at.q.len()),
        ("v(0)", at.v.len()),
        ("the argument of the constraints", constraints.dim()),
    ] {
        if found != expected {
            return Err(SetupError::Shape { what, found, expected });
        }
    }
    Ok(())
}
