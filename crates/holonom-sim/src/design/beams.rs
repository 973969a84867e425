//! Beams by the numbers of their sections, and what acts along them.
//!
//! ```text
//! keys of `section`, `stations` ── dual numbers ── C, V, m along each element ── ElementsTangent
//! ```
//! Lengths, places and counts of elements do not change: their keys are left, and refused.

use super::{Chain, LEAVE_OUT, ModelTangent, eps, refused};
use crate::system::beams::BeamParts;
use crate::system::time_function::TimeFunctions;
use crate::system::{System, load_kind, loads_along};
use holonom_model::{Beam, Load, ModelError};
use nalgebra::{Matrix3, Vector3, Vector6};
use std::sync::Arc;
use vi_beam::Rest;
use vi_beam::design::{ElementChange, ElementDesignError, ElementsTangent, StepRule};
use vi_core::num_dual::Dual64;
use vi_multibody::design::{StepTangent, WholeForce};
use vi_rigid::directors::{self, FRAME};

/// No part of a step of a composition is longer, in steps.
const LONGEST: f64 = 2.0;

impl Chain<'_> {
    /// All beams.
    pub(super) fn beams(&self, out: &mut ModelTangent) -> Result<(), ModelError> {
        let mut changes = Vec::new();
        for (beam, parts) in self.stated.beams.iter().zip(&self.system.beams.list) {
            self.beam(beam, parts, &mut changes)?;
        }
        if changes.is_empty() {
            return Ok(());
        }
        let dynamics = &self.system.dynamics;
        let settings = &self.model.settings;
        let longest = if settings.order > 2 { LONGEST * settings.step } else { settings.step };
        let by = StepRule { strains: dynamics.rule, quadrature: dynamics.quadrature, longest };
        let q = self.system.mechanism.initial_configuration();
        let found = ElementsTangent::new(&dynamics.parts, by, &q, &changes);
        let found = found.map_err(|error| {
            let ElementDesignError::Kink { element } = &error else {
                return refused("beam", error.to_string(), LEAVE_OUT);
            };
            let of = |own: &&BeamParts| own.legs.iter().any(|leg| leg.elements.contains(element));
            let name = self.system.beams.list.iter().find(of).map_or("", |own| &own.name);
            let what = format!("the derivative by `{}`: {error}", self.formulas.name());
            let help = format!("write simulation.strain = \"averaged\", or {LEAVE_OUT}");
            refused(&format!("beam.{name}.section"), what, help)
        })?;
        if !found.is_finite() {
            let what = format!(
                "the derivative by `{}` of a section, which is no number",
                self.formulas.name()
            );
            let help = "state damping of all strains, or of none with the same time";
            return Err(refused("beam", what, help));
        }
        out.numbers.masses.clone_from(found.masses());
        let found = Arc::new(found);
        out.numbers.elements = Some(found.clone());
        out.elements = Some(found);
        Ok(())
    }

    /// How the elements of a beam change, if they do.
    fn beam(
        &self,
        beam: &Beam,
        parts: &BeamParts,
        changes: &mut Vec<ElementChange>,
    ) -> Result<(), ModelError> {
        let key = format!("beam.{}", beam.name);
        let moves = ["section", "stations", "prestress", "curvature", "tension"];
        if !moves.iter().any(|part| self.slopes.touches(&format!("{key}.{part}"))) {
            return Ok(());
        }
        let mut beam = beam.clone();
        if let Some(resolved) = self.model.beam(&beam.name) {
            beam.stations.clone_from(&resolved.stations); // of a file
        }
        let number = |part: &str, value| self.slopes.number(&format!("{key}.{part}"), value);
        let sections = beam.section_tangents(&|part| number(part, 0.0).eps);
        let sections = sections
            .map_err(|problem| ModelError::Assembly(vec![problem.below(&format!("{key}."))]))?;
        let rest = match (beam.prestress, beam.curvature) {
            (Some(tension), _) => {
                let mut stress = Vector6::from_element(Dual64::from_re(0.0));
                stress[2] = number("prestress", tension);
                Some(Rest::Prestressed(stress))
            }
            (None, Some(curvature)) => {
                let curvature = self.slopes.vector(&format!("{key}.curvature"), curvature);
                Some(Rest::Shape { stretch: 1.0, curvature: Some(curvature) })
            }
            (None, None) => None,
        };
        let bound = beam.tension.map_or(0.0, |bound| number("tension", bound).eps);
        let elements = parts.legs.iter().flat_map(|leg| leg.elements.clone());
        changes.extend(elements.zip(sections).map(|(element, sections)| ElementChange {
            element,
            sections,
            rest,
            bound,
        }));
        Ok(())
    }

    /// Velocities of nodes as they are stated.
    pub(super) fn nodes(&self, found: &mut ModelTangent) {
        let q = self.system.mechanism.initial_configuration();
        for (beam, parts) in self.stated.beams.iter().zip(&self.system.beams.list) {
            let key = format!("beam.{}", beam.name);
            let base = self.placements.base(beam.relative_to.as_deref()).rotation;
            let vector =
                |part: &str, own| eps(&(base * self.slopes.vector(&format!("{key}.{part}"), own)));
            let velocity = vector("velocity", beam.velocity);
            let omega = vector("angular_velocity", beam.angular_velocity);
            let node = |k: usize| &q[FRAME * k..FRAME * (k + 1)];
            let origin = directors::center(node(parts.nodes.start));
            for k in parts.nodes.clone() {
                let (center, triad) = (directors::center(node(k)), directors::triad(node(k)));
                let own = velocity + omega.cross(&(center - origin));
                let spin: Matrix3<f64> = omega.cross_matrix() * triad;
                directors::set_frame(&mut found.v[FRAME * k..FRAME * (k + 1)], &own, &spin);
                found.omega.extend(omega.iter());
            }
        }
    }

    /// A load along a beam.
    pub(super) fn load_along(
        &self,
        load: &Load,
        found: &mut ModelTangent,
    ) -> Result<(), ModelError> {
        let key = format!("load.{}", load.name);
        let base = self.placements.base(load.relative_to.as_deref()).rotation;
        let vector = |part: &str, own| {
            let own = self.slopes.vector(&format!("{key}.{part}"), own);
            match load_kind(load) {
                vi_rigid::load::LoadKind::Follower => eps(&own),
                vi_rigid::load::LoadKind::Dead => eps(&(base * own)),
            }
        };
        let by: [Vector3<f64>; 2] = [vector("force", load.force), vector("torque", load.torque)];
        if by.iter().all(|own| own.amax() == 0.0) {
            return Ok(());
        }
        let history = TimeFunctions::new(self.model).history("", &load.history);
        let System { beams, dynamics, .. } = self.system;
        let loads = loads_along(load, by, &history, (&dynamics.parts, &beams.list))?;
        let named = |own| (load.name.clone(), Arc::new(WholeForce(Box::new(own))) as _);
        found.numbers.forces.extend(loads.into_iter().map(named));
        let [force, torque] = by.map(Into::into);
        let more = Load { force, torque, relative_to: None, ..load.clone() };
        found.along_beams.push(more);
        Ok(())
    }
}
