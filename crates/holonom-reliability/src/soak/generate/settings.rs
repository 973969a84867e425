//! Schemes, orders and steps that a mechanism admits.

use super::{MechanismKind, STEPS};
use crate::soak::draw::Draw;
use holonom::Model;
use holonom::model::{HighOrder, LinearSolver, Quadrature, Scheme, Strain};

/// Schemes with their weights.
const SCHEMES: [(u32, Scheme); 7] = [
    (10, Scheme::Nodal),
    (4, Scheme::Constrained),
    (3, Scheme::Dalembert),
    (3, Scheme::Reduced),
    (3, Scheme::EmNodal),
    (2, Scheme::EmConstrained),
    (2, Scheme::EmDalembert),
];

/// Chooses the settings.
pub(super) fn choose(model: &mut Model, kind: MechanismKind, draw: &mut Draw) {
    let dissipative = is_dissipative(model);
    let closed = kind == MechanismKind::Loops || is_closed(model);
    let [beams, points] = [model.beams.is_empty(), model.particles.is_empty()].map(|none| !none);
    let settings = &mut model.settings;
    settings.scheme = draw.weighted(&SCHEMES);
    let galerkin = draw.chance(0.08);
    if galerkin {
        settings.method = HighOrder::Galerkin;
        settings.order = draw.weighted(&[(6, 4), (2, 6), (1, 8)]);
        let has_form = !(closed && (beams || points) || beams && points);
        let nodal = has_form && draw.chance(0.7);
        settings.scheme = if nodal { Scheme::Nodal } else { Scheme::Constrained };
    } else if !dissipative && draw.chance(0.12) {
        settings.order = draw.weighted(&[(8, 4), (1, 6), (1, 8)]);
    }
    if !galerkin && !settings.scheme.is_energy_momentum() && draw.chance(0.2) {
        settings.quadrature = Quadrature::Trapezoidal;
    }
    if draw.chance(0.2) {
        let solvers = [LinearSolver::Dense, LinearSolver::Articulated, LinearSolver::Sparse];
        settings.solver = draw.pick(&solvers);
    }
    settings.momenta = draw.chance(0.1);
    settings.step = match kind {
        MechanismKind::Beams => draw.magnitude(&[1e-5, 1e-4, 1e-3]),
        _ => draw.magnitude(&[1e-5, 1e-4, 1e-3, 1e-3, 4e-3]),
    };
    settings.end = settings.step * STEPS as f64;
    if kind == MechanismKind::Beams && settings.order == 2 && !settings.scheme.is_energy_momentum()
    {
        let strains = [Strain::MassScaled, Strain::Dissipative, Strain::Averaged, Strain::Midpoint];
        settings.strain = draw.pick(&strains);
    }
}

/// Whether a force takes energy: compositions step backwards, where it would give some.
fn is_dissipative(model: &Model) -> bool {
    let joints = model.joints.iter().any(|joint| {
        joint.damper.is_some() || joint.motor.as_ref().is_some_and(|m| m.derivative > 0.0)
    });
    let beams = model.beams.iter().any(|beam| beam.section.damping.is_some());
    joints || beams || model.springs.iter().any(|spring| spring.damping > 0.0)
}

/// Whether there is more than a tree.
fn is_closed(model: &Model) -> bool {
    !model.constraints.is_empty() || model.bars.len() > model.particles.len().saturating_sub(1)
}
