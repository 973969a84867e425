//! Parts of the energy of a node and the work done since the start: the columns of `energy.csv`.
//!
//! ```text
//! total    H = T + V,     V = gravity + elastic (beams) + springs + bushings
//! balance  H(t) − H(0) − Σ work      of second order in the time step; round-off for energy–momentum schemes
//! ```
//! `T` and `H` are those of the projected momentum. Works are sums over all steps, of each load,
//! motor and damper, and of all prescribed motions together (see [`crate::stepper`]).

use crate::dynamics::Dynamics;
use crate::output::columns::{
    BALANCE, ELASTIC, EVENTS, GRAVITY, KINETIC, MOTIONS, SPRINGS, TOTAL, energy, work,
};
use crate::stepper::NodeView;
use holonom_model::{Curves, Model};
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_beam::BeamElements;
use vi_constraints::Constraints;
use vi_core::SparseMatrix;
use vi_core::force::Source;
use vi_core::linear::dot;
use vi_core::potential::{DiscretePotential, LinearPotential, Potential};
use vi_multibody::builder::{ForceElements, NamedSixSpring};
use vi_multibody::mechanism::Mechanism;

/// Rounding errors, relative to what they are errors of.
pub(crate) const ROUNDING: f64 = 1e-12;

/// The energies and works that a model has.
#[derive(Debug)]
pub(crate) struct EnergyTerms {
    columns: Vec<String>,
    gravity: Option<LinearPotential>, // of the weight
    beams: Option<Arc<BeamElements>>,
    springs: Option<ForceElements>,
    bushings: Vec<NamedSixSpring>,
    works: Vec<usize>, // column of each force, among those of works
    sources: usize,    // columns of works
    motions: bool,
    events: bool,
    carried: Vec<f64>, // J  work of earlier phases: of each column, of motions, of events
    initial: f64,      // J
    rounding: Rounding,
}

impl EnergyTerms {
    /// With the mass matrix, what exerts the forces of the system, and what was read at the start.
    pub(crate) fn new(
        model: &Model,
        mechanism: &Mechanism,
        dynamics: &Dynamics,
        mass: &SparseMatrix,
        sources: &[Source],
        start: &NodeView<'_>,
    ) -> Self {
        let Dynamics { parts, forces, .. } = dynamics;
        let gravity = mechanism.gravity(mass);
        let (beams, springs) = (!model.beams.is_empty(), forces.has_springs());
        let mut works: Vec<usize> = Vec::new();
        let mut names: Vec<String> = Vec::new();
        let mut known: BTreeMap<String, usize> = BTreeMap::new();
        for name in sources.iter().map(work) {
            let place = *known.entry(name.clone()).or_insert(names.len());
            works.push(place);
            if place == names.len() {
                names.push(name);
            }
        }
        let motions = mechanism.is_rheonomic();
        let parts_of_potential =
            [(gravity.is_some(), GRAVITY), (beams, ELASTIC), (springs, SPRINGS)].into_iter();
        let mut columns = vec![KINETIC.name.to_owned()];
        columns.extend(parts_of_potential.filter(|p| p.0).map(|p| p.1.name.to_owned()));
        columns.extend(forces.bushings.iter().map(|own| energy(&own.name)));
        columns.push(TOTAL.name.into());
        let sources = names.len();
        columns.extend(names);
        columns.extend(motions.then(|| work(&MOTIONS)));
        let events = !model.events.is_empty();
        columns.extend(events.then(|| work(&EVENTS)));
        columns.push(BALANCE.name.into());
        Self {
            columns,
            rounding: Rounding::new(model, mechanism, dynamics, mass, gravity.as_ref(), start),
            gravity,
            beams: beams.then(|| parts.clone()),
            springs: springs.then(|| forces.clone()),
            bushings: forces.bushings.clone(),
            works,
            sources,
            motions,
            events,
            carried: vec![0.0; sources + 2],
            initial: start.hamiltonian(),
        }
    }

    /// Names of the columns.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// What the energy has changed by since the start, and no work accounts for, J.
    pub(crate) fn balance(&self, energy: f64, work: &[f64]) -> f64 {
        energy - self.initial - self.total(work)
    }

    /// All work since the start, with the `work` of the present phase, J; events do what they
    /// change the energy by.
    pub(crate) fn total(&self, work: &[f64]) -> f64 {
        work.iter().chain(&self.carried).sum()
    }

    /// A phase ends after this work.
    pub(crate) fn carry(&mut self, work: &[f64]) {
        let (forces, motions) = work.split_at(self.works.len());
        for (column, work) in self.works.iter().zip(forces) {
            self.carried[*column] += work;
        }
        self.carried[self.sources] += motions.iter().sum::<f64>();
    }

    /// An event takes this energy out, J.
    pub(crate) fn lose(&mut self, lost: f64) {
        self.carried[self.sources + 1] -= lost;
    }

    /// What earlier phases have left.
    pub(crate) fn carried(&self) -> &[f64] {
        &self.carried
    }

    /// Continues after earlier phases that have left this; nothing: there were none.
    pub(crate) fn take_up(&mut self, carried: &[f64]) {
        self.carried.fill(0.0);
        self.carried.iter_mut().zip(carried).for_each(|(own, work)| *own = *work);
    }

    /// Goes on with other forces, all among those of the model.
    pub(crate) fn act_by(&mut self, sources: &[Source], forces: &ForceElements) {
        let first = self.columns.iter().position(|name| *name == TOTAL.name).map_or(0, |k| k + 1);
        let place = |name: String| self.columns[first..].iter().position(|own| *own == name);
        self.works = sources.iter().filter_map(|source| place(work(source))).collect();
        debug_assert_eq!(self.works.len(), sources.len(), "a column for each source");
        if let Some(springs) = &mut self.springs {
            springs.clone_from(forces);
        }
    }

    /// What rounding leaves of an energy (J), with the largest `elastic` one (J): see [`Rounding`].
    pub(crate) fn rounding(&self, elastic: f64) -> f64 {
        let Rounding { constant, stiffness } = self.rounding;
        constant.max(ROUNDING * (2.0 * elastic.max(0.0) * stiffness).sqrt())
    }

    /// The energy of beams, springs and bushings among the numbers of all columns, J.
    pub(crate) fn elastic(&self, columns: &[f64]) -> f64 {
        let first = 1 + usize::from(self.gravity.is_some());
        let count = usize::from(self.beams.is_some()) + usize::from(self.springs.is_some());
        let count = count + self.bushings.len();
        columns.iter().skip(first).take(count).sum()
    }

    /// `out ←` the numbers of all columns at a node.
    pub(crate) fn read(&self, node: &NodeView<'_>, out: &mut Vec<f64>) {
        let at = node.configuration();
        out.clear();
        out.push(node.kinetic());
        out.extend(self.gravity.as_ref().map(|weight| weight.value(at.q)));
        let elastic = |beams: &Arc<BeamElements>| beams.elements.value(at.q);
        out.extend(self.beams.as_ref().map(elastic));
        out.extend(self.springs.as_ref().map(|forces| {
            let springs: f64 = forces.springs.iter().map(|spring| spring.value(at.q)).sum();
            springs + forces.joint_springs.iter().map(|spring| spring.potential(at)).sum::<f64>()
        }));
        out.extend(self.bushings.iter().map(|own| own.spring.potential(at)));
        out.push(node.hamiltonian());
        let first = out.len();
        out.resize(first + self.sources, 0.0);
        debug_assert_eq!(node.work.len(), self.works.len() + 1, "a source for each force");
        let (forces, motions) = node.work.split_at(self.works.len());
        for (column, work) in self.works.iter().zip(forces) {
            out[first + column] += work;
        }
        let (earlier, others) = self.carried.split_at(self.sources);
        out[first..].iter_mut().zip(earlier).for_each(|(work, earlier)| *work += earlier);
        out.extend(motions.iter().filter(|_| self.motions).map(|work| work + others[0]));
        out.extend(self.events.then_some(others[1]));
        out.push(self.balance(node.hamiltonian(), node.work));
    }
}

/// What rounding leaves of an energy, where every coordinate is known to `δ`, [`ROUNDING`] of its
/// size.
/// ```text
/// constant   max(½ δᵀM δ / h²,  |m γ|ᵀδ + Σ (|F| max δ + |T| δ_d))      of a (sub-)step h, the shortest; of weight, loads and motors
/// elastic    √(2 V S) ROUNDING,   S = |q|ᵀ|∇²V||q|                      a spring k with the energy V: k x δ = √(2kV) δ
/// ```
#[derive(Clone, Copy, Debug)]
struct Rounding {
    constant: f64,  // J
    stiffness: f64, // J  S
}

impl Rounding {
    fn new(
        model: &Model,
        mechanism: &Mechanism,
        dynamics: &Dynamics,
        mass: &SparseMatrix,
        gravity: Option<&LinearPotential>,
        start: &NodeView<'_>,
    ) -> Self {
        let at = start.configuration();
        let n = at.q.len();
        let (mut sizes, mut momentum) = (vec![0.0; n], vec![0.0; n]);
        mechanism.coordinate_sizes(at.q, &mut sizes);
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        mass.mul_add(0.5, &sizes, &mut momentum);
        let step = ROUNDING / (model.settings.step * model.settings.composition().shortest());
        let kinetic = step * step * dot(&sizes, &momentum);
        let weight = gravity.iter().flat_map(|weight| &weight.force);
        let weight: f64 = weight.zip(&sizes).map(|(force, size)| force.abs() * size).sum();
        let elastic = dynamics.forces.has_springs() || !dynamics.forces.bushings.is_empty();
        let stiffness = match model.beams.is_empty() && !elastic {
            true => 0.0,
            false => {
                let system = dynamics.variational(mechanism);
                let hessian =
                    SparseMatrix::assemble(n, n, |out| system.stiffness(at, &vec![0.0; n], out));
                let mut sum = 0.0;
                hessian.for_each(|i, j, k| sum += sizes[i] * k.abs() * sizes[j]);
                sum
            }
        };
        let applied = ROUNDING * (weight + applied(model, largest));
        Self { constant: kinetic.max(applied), stiffness }
    }
}

/// The largest works of loads and motors of a model along `size` (m) and 1 rad, summed up, J.
fn applied(model: &Model, size: f64) -> f64 {
    let norm = |x: &[f64; 3]| x.iter().fold(0.0, |sum: f64, x| sum.max(x.abs()));
    let (end, curves) = (model.settings.end, Curves::new(model));
    let loads = model.loads.iter().map(|load| {
        let length = if load.beam.is_some() && load.at.is_none() { size } else { 1.0 };
        length * load.history.peak(end, &curves) * (norm(&load.force) * size + norm(&load.torque))
    });
    let motors = model.joints.iter().filter_map(|joint| joint.motor.as_ref());
    let motors =
        motors.map(|motor| motor.history.peak(end, &curves) * motor.effort.abs() * size.max(1.0));
    loads.chain(motors).sum()
}
