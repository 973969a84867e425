//! Beams by all their numbers but counts, and what acts along them.
//!
//! ```text
//! points, curve, normal, length, twist of stations ── dual numbers ── meshes ── ℓ, ε_0, M, q_0, joints at nodes
//! section, stations                                ── dual numbers ── C, V, m along each element
//!                                                                  └─ ElementsTangent
//! ```

use super::{LEAVE_OUT, ModelTangent, NumberChain, eps, refused};
use crate::system::beams::BeamParts;
use crate::system::time_function::TimeFunctions;
use crate::system::{System, load_kind, loads_along};
use holonom_model::{Beam, Load, ModelError, MovingFrame};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use vi_beam::BeamMesh;
use vi_beam::design::{Drawn, ElementChange, ElementDesignError, ElementsTangent, StepRule};
use vi_core::num_dual::Dual64;
use vi_multibody::builder::ElementForce;
use vi_multibody::design::{JointTangent, MechanismTangent, StepTangent, WholeForce};
use vi_multibody::joint::FrameId;
use vi_rigid::directors::{self, FRAME};
use vi_rigid::load::LoadChange;

/// No part of a step of a composition is longer, in steps.
const LONGEST: f64 = 2.0;

impl NumberChain<'_> {
    /// All beams.
    pub(super) fn beams(&self, out: &mut ModelTangent) -> Result<(), ModelError> {
        let (mut changes, longer) = (Vec::new(), self.longer());
        let moves = longer.iter().any(|own| *own != 0.0);
        for (beam, parts) in self.stated.beams.iter().zip(&self.system.beams.list) {
            let key = format!("beam.{}", beam.name);
            let drawn = parts
                .nodes
                .clone()
                .any(|node| out.q[FRAME * node..FRAME * (node + 1)].iter().any(|own| *own != 0.0));
            if moves || drawn || self.slopes.touches(&key) {
                self.beam(beam, parts, &longer, &mut changes)?;
            }
        }
        if changes.is_empty() {
            return Ok(());
        }
        let dynamics = &self.system.dynamics;
        let settings = &self.model.settings;
        let longest = if settings.order > 2 { LONGEST * settings.step } else { settings.step };
        let by = StepRule { strains: dynamics.rule, quadrature: dynamics.quadrature, longest };
        let q = self.system.mechanism.initial_configuration();
        let drawn = Drawn { q: &q, change: &out.q };
        let found = ElementsTangent::new(&dynamics.parts, by, drawn, &changes);
        let found = found.map_err(|error| self.refused_element(&error))?;
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

    /// An element of which there is no derivative, as an error of the model.
    fn refused_element(&self, error: &ElementDesignError) -> ModelError {
        let ElementDesignError::Kink { element } = error else {
            return refused("beam", error.to_string(), LEAVE_OUT);
        };
        let of = |own: &&BeamParts| own.legs.iter().any(|leg| leg.elements.contains(element));
        let name = self.system.beams.list.iter().find(of).map_or("", |own| &own.name);
        let what = format!("the derivative by `{}`: {error}", self.formulas.name());
        let help = format!("write simulation.strain = \"averaged\", or {LEAVE_OUT}");
        refused(&format!("beam.{name}.section"), what, help)
    }

    /// By how much all elements of all beams become longer, m.
    fn longer(&self) -> Vec<f64> {
        let meshes = self.stated.beams.iter().map(|beam| self.placements.meshes(beam));
        let longer =
            |of: &BeamMesh<Dual64>| of.lengths.iter().map(|own| own.eps).collect::<Vec<_>>();
        meshes.flat_map(|legs| legs.iter().flat_map(longer).collect::<Vec<_>>()).collect()
    }

    /// How the elements of a beam change.
    fn beam(
        &self,
        beam: &Beam,
        parts: &BeamParts,
        longer: &[f64],
        changes: &mut Vec<ElementChange>,
    ) -> Result<(), ModelError> {
        let key = format!("beam.{}", beam.name);
        let below = |problem: holonom_model::Problem| {
            ModelError::Assembly(vec![problem.below(&format!("{key}."))])
        };
        let beam = self.placements.with_stations(beam);
        let number = |part: &str, value: f64| self.slopes.number(&format!("{key}.{part}"), value);
        if beam.passes_station(&number).map_err(below)? {
            let what = format!(
                "the derivative by `{}`, with which a station passes a node: a kink",
                self.formulas.name()
            );
            let help = "let the places of stations follow the length of the beam: at = \"= …\"";
            return Err(refused(&format!("{key}.stations"), what, help));
        }
        let sections = beam.section_tangents(&number).map_err(below)?;
        let rest = beam.rest_by(&number).map_err(below)?;
        let bound = beam.tension.map_or(0.0, |bound| number("tension", bound).eps);
        let elements = parts.legs.iter().flat_map(|leg| leg.elements.clone());
        changes.extend(elements.zip(sections).map(|(element, sections)| ElementChange {
            element,
            sections,
            rest,
            bound,
            length: longer[element],
        }));
        Ok(())
    }

    /// The node that a frame is.
    pub(super) fn node_of(&self, frame: usize) -> Option<MovingFrame<Dual64>> {
        let mut all = self.stated.beams.iter().zip(&self.system.beams.list);
        let (beam, parts) = all.find(|(_, parts)| parts.nodes.contains(&frame))?;
        self.placements.nodes(beam).get(frame - parts.nodes.start).copied()
    }

    /// Places and velocities of nodes as they are stated.
    pub(super) fn nodes(&self, found: &mut ModelTangent) {
        for (beam, parts) in self.stated.beams.iter().zip(&self.system.beams.list) {
            for (k, node) in parts.nodes.clone().zip(self.placements.nodes(beam).iter()) {
                let own = FRAME * k..FRAME * (k + 1);
                let (center, triad) = (eps(&node.origin), node.rotation.map(|x| x.eps));
                directors::set_frame(&mut found.q[own.clone()], &center, &triad);
                let spin = |i: usize| node.omega.cross(&node.rotation.column(i).into_owned());
                let spin = Matrix3::from_columns(&[0, 1, 2].map(spin)).map(|x| x.eps);
                directors::set_frame(&mut found.v[own], &eps(&node.velocity), &spin);
                found.omega.extend(eps(&node.omega).iter());
            }
        }
    }

    /// What holds ends and corners of beams, the joints from `first` on.
    pub(super) fn supports(
        &self,
        first: usize,
        out: &mut MechanismTangent,
    ) -> Result<(), ModelError> {
        let joints = &self.system.mechanism.description().joints;
        let is_node = |frame: usize| frame >= self.model.bodies.len();
        for (k, joint) in joints.iter().enumerate().skip(first) {
            let FrameId::Frame(node) = joint.child.frame else { continue };
            if !is_node(node) {
                continue;
            }
            let place = self.placed(node).0;
            let key = format!("beam.{}", joint.name);
            let change = self.change(&key, joint, [place; 2], &Matrix3::identity())?;
            if change != JointTangent::default() {
                out.joints.insert(k, change);
            }
        }
        Ok(())
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
                vi_rigid::load::LoadKind::Follower => own,
                vi_rigid::load::LoadKind::Dead => base * own,
            }
        };
        let both = [vector("force", load.force), vector("torque", load.torque)];
        self.load_moves(&key, load, both.map(|own| own.map(|x| x.re)), found)?;
        let by: [Vector3<f64>; 2] = both.map(|own| eps(&own));
        if by.iter().all(|own| own.amax() == 0.0) {
            return Ok(());
        }
        let history = TimeFunctions::new(self.model).history("", &load.history);
        let System { beams, dynamics, .. } = self.system;
        let loads = loads_along(load, by, &history, &dynamics.parts, &beams.list)?;
        let named = |own| (load.name.clone(), Arc::new(WholeForce(Box::new(own))) as _);
        found.numbers.forces.extend(loads.into_iter().map(named));
        let [force, torque] = by.map(Into::into);
        let more = Load { force, torque, relative_to: None, ..load.clone() };
        found.along_beams.push(more);
        Ok(())
    }

    /// How the parts of a load along a beam, that nodes carry, change with lengths and with its
    /// place.
    fn load_moves(
        &self,
        key: &str,
        load: &Load,
        by: [Vector3<f64>; 2],
        found: &mut ModelTangent,
    ) -> Result<(), ModelError> {
        let longer = self.longer();
        let at = load.at.map(|at| self.slopes.number(&format!("{key}.at"), at));
        if longer.iter().all(|own| *own == 0.0) && at.is_none_or(|at| at.eps == 0.0) {
            return Ok(());
        }
        found.along.loads.extend(at.map(|at| (load.name.clone(), at.eps)));
        let System { beams, dynamics, .. } = self.system;
        let (parts, longer) = (&dynamics.parts, |element: usize| longer[element]);
        let beam = beams.list.iter().find(|own| Some(&own.name) == load.beam.as_ref());
        let legs = beam.map_or(&[][..], |own| &own.legs);
        let (mut start, mut all): (Dual64, Vec<LoadChange>) = (Dual64::from_re(0.0), Vec::new());
        for (k, leg) in legs.iter().enumerate() {
            let own = leg.elements.clone().map(longer).sum();
            let length = Dual64::new(parts.length(leg), own);
            let place = at.map(|at| at - start);
            start += length;
            match place {
                Some(at) if at.re < 0.0 || (at.re >= length.re && k + 1 < legs.len()) => {}
                None => all.extend(parts.line_load_changes(leg, longer, by)),
                Some(at) => match parts.load_at_changes(leg, at, longer, by) {
                    Some(own) => all.extend(own),
                    None => {
                        let what = format!(
                            "the derivative by `{}` of a load that passes a node: a kink",
                            self.formulas.name()
                        );
                        let help = "let its place follow the length of the beam: at = \"= …\"";
                        return Err(refused(&format!("{key}.at"), what, help));
                    }
                },
            }
        }
        let forces = dynamics.forces.forces.iter().enumerate();
        let own = forces
            .filter(|(_, own)| own.name == load.name && matches!(own.force, ElementForce::Body(_)));
        found.numbers.loads.extend(own.map(|(k, _)| k).zip(all));
        Ok(())
    }
}
