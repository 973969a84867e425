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
use crate::method::reading::Reading;
use holonom_model::Model;
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_beam::damping::is_damped;
use vi_beam::{BeamModel, StrainRule};
use vi_constraints::Constraints;
use vi_core::potential::{DiscretePotential, LinearPotential, Potential};
use vi_core::{Configuration, SparseMatrix};
use vi_multibody::builder::ForceElements;
use vi_multibody::mechanism::Mechanism;

/// Rounding errors, relative to what they are errors of.
pub(crate) const ROUNDING: f64 = 1e-12;

/// The energies and works that a model has.
#[derive(Debug)]
pub(crate) struct Energies {
    columns: Vec<String>,
    gravity: Option<LinearPotential>, // of the weight
    beams: Option<Arc<BeamModel>>,
    springs: Option<ForceElements>,
    works: Vec<usize>, // column of each force, among those of works
    sources: usize,    // columns of works
    motions: bool,
    initial: f64,  // J
    rounding: f64, // J
}

impl Energies {
    /// With the mass matrix, and the configuration and the energy (J) at the start.
    pub(crate) fn new(
        model: &Model,
        mechanism: &Mechanism,
        (dynamics, mass): (&Dynamics, &SparseMatrix),
        q: &[f64],
        initial: f64,
    ) -> Self {
        let Dynamics { parts, forces, .. } = dynamics;
        let weighs = model.gravity().iter().any(|g| *g != 0.0);
        let weight = || LinearPotential { force: mechanism.weight(mass) };
        let beams = !model.beams.is_empty();
        let springs = !(forces.springs.is_empty() && forces.joint_springs.is_empty());
        let mut works: Vec<usize> = Vec::new();
        let mut names: Vec<String> = Vec::new();
        let mut known: BTreeMap<String, usize> = BTreeMap::new();
        for source in sources(model, dynamics) {
            let place = *known.entry(source.clone()).or_insert(names.len());
            works.push(place);
            if place == names.len() {
                names.push(source);
            }
        }
        let motions = mechanism.is_rheonomic();
        let parts_of_potential =
            [(weighs, "gravity"), (beams, "elastic"), (springs, "springs")].into_iter();
        let mut columns = vec!["kinetic".to_owned()];
        columns.extend(parts_of_potential.filter(|p| p.0).map(|p| p.1.to_owned()));
        columns.push("total".into());
        let sources = names.len();
        columns.extend(names);
        columns.extend(motions.then(|| "work_of_motions".to_owned()));
        columns.push("balance".into());
        Self {
            columns,
            gravity: weighs.then(weight),
            beams: beams.then(|| parts.clone()),
            springs: springs.then(|| forces.clone()),
            works,
            sources,
            motions,
            initial,
            rounding: rounding(mechanism, mass, q, model.settings.step),
        }
    }

    /// Names of the columns.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// What the energy has changed by since the start, and no work accounts for, J.
    pub(crate) fn balance(&self, energy: f64, work: &[f64]) -> f64 {
        energy - self.initial - work.iter().sum::<f64>()
    }

    /// The energy (J) below which nothing is a motion: see [`rounding`].
    pub(crate) fn rounding(&self) -> f64 {
        self.rounding
    }

    /// `out ←` the numbers of all columns at a node.
    pub(crate) fn read(&self, node: &Reading, out: &mut Vec<f64>) {
        let at = Configuration { t: node.t, q: &node.q, angles: &node.angles };
        out.clear();
        out.push(node.kinetic);
        out.extend(self.gravity.as_ref().map(|weight| weight.value(at.q)));
        let elastic =
            |beams: &Arc<BeamModel>| beams.elements.value(at.q) + beams.high_order.value(at.q);
        out.extend(self.beams.as_ref().map(elastic));
        out.extend(self.springs.as_ref().map(|forces| {
            let springs: f64 = forces.springs.iter().map(|spring| spring.value(at.q)).sum();
            springs + forces.joint_springs.iter().map(|spring| spring.potential(at)).sum::<f64>()
        }));
        out.push(node.hamiltonian);
        let first = out.len();
        out.resize(first + self.sources, 0.0);
        debug_assert_eq!(node.work.len(), self.works.len() + 1, "a source for each force");
        let (forces, motions) = node.work.split_at(self.works.len());
        for (column, work) in self.works.iter().zip(forces) {
            out[first + column] += work;
        }
        out.extend(motions.iter().filter(|_| self.motions));
        out.push(self.balance(node.hamiltonian, &node.work));
    }
}

/// `½ δᵀM δ / h²`, J: the kinetic energy if in a step every coordinate moves by `δ`, the rounding of its size.
fn rounding(mechanism: &Mechanism, mass: &SparseMatrix, q: &[f64], h: f64) -> f64 {
    let (mut velocity, mut momentum) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    mechanism.coordinate_sizes(q, &mut velocity);
    velocity.iter_mut().for_each(|size| *size *= ROUNDING / h);
    mass.mul_add(0.5, &velocity, &mut momentum);
    velocity.iter().zip(&momentum).map(|(v, p)| v * p).sum()
}

/// What each discrete force of a system belongs to, in the order in which [`Dynamics`] adds them.
fn sources(model: &Model, dynamics: &Dynamics) -> Vec<String> {
    let Dynamics { parts, .. } = dynamics;
    let damped = is_damped(&parts.elements, &parts.high_order);
    let mut sources: Vec<String> =
        damped.then(|| "work_of_material_damping".to_owned()).into_iter().collect();
    let dissipative = dynamics.rule == StrainRule::Dissipative && !model.beams.is_empty();
    sources.extend(dissipative.then(|| "work_of_algorithmic_dissipation".to_owned()));
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
