//! Shared by the tests of this folder.

#[path = "../../../vi-beam/tests/common/mod.rs"]
mod beam;

pub(crate) use beam::*;
use vi_beam::{Beam, BeamMesh, BeamModel, ElementKind, Section};
use vi_multibody::Mechanism;
use vi_rigid::load::Load;
use vi_statics::StaticProblem;

/// A model of beams under loads that grow in proportion to the load parameter.
pub(crate) fn problem(model: &BeamModel, mechanism: &Mechanism, loads: Vec<Load>) -> StaticProblem {
    let system = model.static_system(mechanism, loads);
    StaticProblem::new(system, mechanism.clone()).with_elements(model.neighbours())
}

/// Adds a beam whose elements have some strains.
pub(crate) fn beam(
    model: &mut BeamModel,
    mesh: &BeamMesh,
    section: Section,
    kind: ElementKind,
) -> Beam {
    let beam = model.add_beam("beam", mesh, section).unwrap();
    let q = model.configuration();
    model.elements.set_strains(beam.elements.clone(), kind, &q).unwrap();
    beam
}
