//! Parts of the energy of a node and the work done since the start: the columns of `energy.csv`.
//!
//! ```text
//! total    H = T + V,     V = gravity + elastic (beams) + springs
//! balance  H(t) − H(0) − Σ work      of second order in the time step; round-off for energy–momentum schemes
//! ```
//! `T` and `H` are those of the projected momentum. Works are sums over all steps, of each load, motor and damper, and of
//! all prescribed motions together (see [`crate::method`]).

use crate::drive::{ElementLaw, joint_elements};
use crate::dynamics::Dynamics;
use holonom_model::Model;
use std::sync::Arc;
use vi_beam::BeamModel;
use vi_beam::damping::StrainDamping;
use vi_constraints::Constraints;
use vi_core::potential::{DiscretePotential, Potential};
use vi_core::{Configuration, MechanicalSystem, Quadrature, SeparableSystem};
use vi_multibody::builder::ForceElements;
use vi_multibody::mechanism::Mechanism;

/// The energies and works that a model has.
#[derive(Debug)]
pub(crate) struct Energies {
    columns: Vec<String>,
    gravity: Option<SeparableSystem>, // masses and weight
    beams: Option<Arc<BeamModel>>,
    springs: Option<ForceElements>,
    works: Vec<usize>, // column of each force, among those of works
    motions: bool,
    initial: f64, // J
}

impl Energies {
    pub(crate) fn new(model: &Model, mechanism: &Mechanism, dynamics: &Dynamics) -> Self {
        let Dynamics { parts, forces, .. } = dynamics;
        let weighs = model.gravity().iter().any(|g| *g != 0.0);
        let weight =
            || mechanism.system_with_mass(parts.mass_matrix(mechanism), Quadrature::Midpoint);
        let beams = !model.beams.is_empty();
        let springs = !(forces.springs.is_empty() && forces.joint_springs.is_empty());
        let mut works: Vec<usize> = Vec::new();
        let mut names: Vec<String> = Vec::new();
        for source in sources(model, dynamics) {
            let known = names.iter().position(|name| *name == source);
            works.push(known.unwrap_or(names.len()));
            if known.is_none() {
                names.push(source);
            }
        }
        let motions = mechanism.is_rheonomic();
        let parts_of_potential =
            [(weighs, "gravity"), (beams, "elastic"), (springs, "springs")].into_iter();
        let mut columns = vec!["kinetic".to_owned()];
        columns.extend(parts_of_potential.filter(|p| p.0).map(|p| p.1.to_owned()));
        columns.push("total".into());
        columns.extend(names);
        columns.extend(motions.then(|| "work_of_motions".to_owned()));
        columns.push("balance".into());
        Self {
            columns,
            gravity: weighs.then(weight),
            beams: beams.then(|| parts.clone()),
            springs: springs.then(|| forces.clone()),
            works,
            motions,
            initial: 0.0,
        }
    }

    /// Names of the columns.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Takes the initial energy, J.
    pub(crate) fn begin(&mut self, initial: f64) {
        self.initial = initial;
    }

    /// The numbers of all columns at a node with the energies `kinetic` and `total`; `work`: of each force, then of all
    /// prescribed motions, J.
    pub(crate) fn read(
        &self,
        at: Configuration<'_>,
        (kinetic, total): (f64, f64),
        work: &[f64],
    ) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.columns.len());
        out.push(kinetic);
        out.extend(self.gravity.as_ref().map(|weight| weight.potential_energy(at)));
        let elastic =
            |beams: &Arc<BeamModel>| beams.elements.value(at.q) + beams.high_order.value(at.q);
        out.extend(self.beams.as_ref().map(elastic));
        out.extend(self.springs.as_ref().map(|forces| {
            let springs: f64 = forces.springs.iter().map(|spring| spring.value(at.q)).sum();
            springs + forces.joint_springs.iter().map(|spring| spring.potential(at)).sum::<f64>()
        }));
        out.push(total);
        let first = out.len();
        let sources = self.works.iter().max().map_or(0, |last| last + 1);
        out.resize(first + sources, 0.0);
        debug_assert_eq!(work.len(), self.works.len() + 1, "one source for each discrete force");
        let (forces, motions) = work.split_at(self.works.len());
        for (column, work) in self.works.iter().zip(forces) {
            out[first + column] += work;
        }
        out.extend(motions.iter().filter(|_| self.motions));
        out.push(total - self.initial - work.iter().sum::<f64>());
        out
    }
}

/// What each discrete force of a system belongs to, in the order in which [`Dynamics`] adds them.
fn sources(model: &Model, dynamics: &Dynamics) -> Vec<String> {
    let Dynamics { parts, .. } = dynamics;
    let damped = StrainDamping::new(&parts.elements, &parts.high_order).is_some();
    let mut sources: Vec<String> =
        damped.then(|| "work_of_material_damping".to_owned()).into_iter().collect();
    let dampers = model.springs.iter().filter(|spring| spring.damping != 0.0);
    sources.extend(dampers.map(|spring| format!("work.{}", spring.name)));
    for joint in &model.joints {
        let elements = joint_elements(joint).into_iter();
        let forces = elements.filter(|element| matches!(element.law, ElementLaw::Force(_)));
        sources.extend(forces.map(|element| format!("work.{}.{}", joint.name, element.part)));
    }
    sources.extend(dynamics.loads_of.iter().map(|name| format!("work.{name}")));
    sources
}
