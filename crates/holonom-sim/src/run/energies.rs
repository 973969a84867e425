//! Parts of the energy of a node and the work done since the start: the columns of `energy.csv`.
//!
//! ```text
//! total    H + Σ V_law,  H = T + V,   V = gravity + elastic (beams) + springs + contacts + bushings
//! balance  total(t) − total(0) − Σ work     of second order in the time step; round-off for energy–momentum schemes
//! ```
//! `T` and `H` are those of the projected momentum. Works are sums over all steps, of each load,
//! motor and damper, and of all prescribed motions together (see [`crate::stepper`]). A law that
//! reads nothing but its coordinate has an energy `V_law` in the place of its work, zero at the
//! start ([`vi_multibody::stored_energy`]); so has a spring of a joint by a table.

use crate::dynamics::Dynamics;
use crate::output::columns::{
    BALANCE, CONTACTS, ELASTIC, EVENTS, GRAVITY, KINETIC, MOTIONS, SPRINGS, TOTAL, energy, work,
};
use crate::stepper::NodeView;
use holonom_model::{Curves, Model};
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_beam::BeamElements;
use vi_constraints::Constraints;
use vi_core::force::Source;
use vi_core::linear::dot;
use vi_core::potential::{DiscretePotential, LinearPotential, Potential};
use vi_core::{Configuration, SparseMatrix};
use vi_multibody::builder::{ForceElements, NamedForce, NamedSixSpring};
use vi_multibody::contact::compliant_contact::CompliantContact;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::stored_energy::StoredEnergy;

/// Rounding errors, relative to what they are errors of.
pub(crate) const ROUNDING: f64 = 1e-12;

/// Places in [`EnergyTerms::carried`] after the columns of works, and how many these are.
const MOTION: usize = 0;
const EVENT: usize = 1;
const STORED: usize = 2;
const OTHERS: usize = 3;

/// The energies and works that a model has.
#[derive(Debug)]
pub(crate) struct EnergyTerms {
    columns: Vec<String>,
    gravity: Option<LinearPotential>, // of the weight
    beams: Option<Arc<BeamElements>>,
    springs: Option<ForceElements>,
    compliant: Option<Vec<CompliantContact>>,
    bushings: Vec<(String, Option<NamedSixSpring>)>, // with its name; none once it is gone
    laws: Vec<StoringLaw>,
    works: Vec<usize>,     // place of the work of each force, as in `carried`
    elements: Vec<String>, // of each column of a work: its force element, where it is one
    sources: usize,        // columns of works
    motions: bool,
    only_motion: Option<String>, // where there is one alone
    events: bool,
    /// J, of earlier phases: work of each column, of motions, of events; what laws had stored where
    /// they ceased to act; work of each law that stores. All but what was stored add up to what `H`
    /// gains.
    carried: Vec<f64>,
    initial: f64, // J
    rounding: Rounding,
}

/// A law that has an energy in the place of its work.
#[derive(Debug)]
struct StoringLaw {
    name: String,
    stored: StoredEnergy,
    acts: bool,
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
        let compliant = !forces.compliant.is_empty();
        let store = |own: &NamedForce| {
            let (along, law) = own.potential().filter(|_| !own.name.is_empty())?;
            let stored = StoredEnergy::new(along, law.clone(), start.configuration());
            Some(StoringLaw { name: own.name.clone(), stored, acts: true })
        };
        let laws: Vec<StoringLaw> = forces.forces.iter().filter_map(store).collect();
        let (mut names, mut elements) = (Vec::new(), Vec::new());
        let mut known: BTreeMap<String, usize> = BTreeMap::new();
        for source in sources.iter().filter(|source| law_of(&laws, source).is_none()) {
            let name = work(source);
            let place = *known.entry(name.clone()).or_insert(names.len());
            if place == names.len() {
                names.push(name);
                elements.push(match source {
                    Source::Element(name) => name.clone(),
                    Source::System(_) => String::new(),
                });
            }
        }
        let count = names.len();
        let place = |source: &Source| match law_of(&laws, source) {
            Some(law) => count + OTHERS + law,
            None => known[&work(source)],
        };
        let works: Vec<usize> = sources.iter().map(place).collect();
        let motions = mechanism.is_rheonomic();
        let parts_of_potential = [
            (gravity.is_some(), GRAVITY),
            (beams, ELASTIC),
            (springs, SPRINGS),
            (compliant, CONTACTS),
        ]
        .into_iter();
        let mut columns = vec![KINETIC.name.to_owned()];
        columns.extend(parts_of_potential.filter(|p| p.0).map(|p| p.1.name.to_owned()));
        columns.extend(forces.bushings.iter().map(|own| energy(&own.name)));
        columns.extend(laws.iter().map(|law| energy(&law.name)));
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
            compliant: compliant.then(|| forces.compliant.clone()),
            bushings: forces
                .bushings
                .iter()
                .map(|own| (own.name.clone(), Some(own.clone())))
                .collect(),
            carried: vec![0.0; sources + OTHERS + laws.len()],
            laws,
            works,
            elements,
            sources,
            motions,
            only_motion: model.only_motion().map(str::to_owned),
            events,
            initial: start.hamiltonian(),
        }
    }

    /// Names of the columns.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// What `H` or its shadow has changed by since the start, and no work accounts for, J.
    pub(crate) fn balance(&self, energy: f64, work: &[f64]) -> f64 {
        energy - self.initial - self.total(work)
    }

    /// All work that changes `H` since the start, with the `work` of the present phase, J; events
    /// do what they change it by.
    pub(crate) fn total(&self, work: &[f64]) -> f64 {
        let (earlier, others) = self.carried.split_at(self.sources + STORED);
        work.iter().chain(earlier).chain(&others[1..]).sum()
    }

    /// The work of a force element, or of the only prescribed motion, since the start, with the
    /// `work` of the present phase, J.
    pub(crate) fn work_of(&self, element: &str, work: &[f64]) -> f64 {
        if self.only_motion.as_deref() == Some(element) {
            return self.carried[self.sources + MOTION] + work.last().copied().unwrap_or_default();
        }
        let column = self.elements.iter().position(|own| own == element);
        let law = || self.laws.iter().position(|law| law.name == element);
        let Some(place) = column.or_else(|| Some(self.sources + OTHERS + law()?)) else {
            return 0.0;
        };
        let own = self.works.iter().zip(work).filter(|(own, _)| **own == place);
        self.carried[place] + own.map(|(_, work)| work).sum::<f64>()
    }

    /// What laws store at a node, J.
    pub(crate) fn stored(&self, node: &NodeView<'_>) -> f64 {
        self.laws.iter().map(|law| law.energy(node.configuration())).sum()
    }

    /// A phase ends after this work.
    pub(crate) fn carry(&mut self, work: &[f64]) {
        let (forces, motions) = work.split_at(self.works.len());
        for (column, work) in self.works.iter().zip(forces) {
            self.carried[*column] += work;
        }
        self.carried[self.sources + MOTION] += motions.iter().sum::<f64>();
    }

    /// An event takes energy out: `lost` of `H`, and what laws had `stored`, J.
    pub(crate) fn lose(&mut self, lost: f64, stored: f64) {
        self.carried[self.sources + EVENT] -= lost;
        self.carried[self.sources + STORED] -= stored;
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
        let place = |source: &Source| match law_of(&self.laws, source) {
            Some(law) => Some(self.sources + OTHERS + law),
            None => self.columns[first..].iter().position(|own| *own == work(source)),
        };
        self.works = sources.iter().filter_map(place).collect();
        debug_assert_eq!(self.works.len(), sources.len(), "a column for each source");
        if let Some(springs) = &mut self.springs {
            springs.clone_from(forces);
        }
        if let Some(compliant) = &mut self.compliant {
            compliant.clone_from(&forces.compliant);
        }
        for (name, bushing) in &mut self.bushings {
            *bushing = forces.bushings.iter().find(|own| own.name == *name).cloned();
        }
        for law in &mut self.laws {
            let mut own = forces.forces.iter().filter(|own| own.name == law.name);
            let along = own.find_map(|own| own.potential()).map(|(along, _)| along);
            law.acts = along.is_some();
            if let Some(along) = along {
                law.stored = law.stored.moved_to(along);
            }
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
        let parts = [self.beams.is_some(), self.springs.is_some(), self.compliant.is_some()];
        let count = self.bushings.len() + parts.into_iter().filter(|own| *own).count();
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
        let stored = |own: &Vec<CompliantContact>| -> f64 {
            own.iter().fold(0.0, |sum, contact| sum + contact.value(at.q))
        };
        out.extend(self.compliant.as_ref().map(stored));
        let bushing = |own: &NamedSixSpring| own.spring.potential(at);
        out.extend(self.bushings.iter().map(|(_, own)| own.as_ref().map_or(0.0, bushing)));
        let laws = out.len();
        out.extend(self.laws.iter().map(|law| law.energy(at)));
        let stored: f64 = out[laws..].iter().sum();
        let total = node.hamiltonian() + stored;
        out.push(total);
        let first = out.len();
        out.resize(first + self.sources, 0.0);
        debug_assert_eq!(node.work.len(), self.works.len() + 1, "a source for each force");
        let (forces, motions) = node.work.split_at(self.works.len());
        for (column, work) in self.works.iter().zip(forces) {
            if *column < self.sources {
                out[first + column] += work;
            }
        }
        let (earlier, others) = self.carried.split_at(self.sources);
        out[first..].iter_mut().zip(earlier).for_each(|(work, earlier)| *work += earlier);
        out.extend(motions.iter().filter(|_| self.motions).map(|work| work + others[MOTION]));
        out.extend(self.events.then_some(others[EVENT] + others[STORED]));
        let works: f64 = out[first..].iter().sum();
        out.push(total - self.initial - works);
    }
}

impl StoringLaw {
    fn energy(&self, at: Configuration<'_>) -> f64 {
        if self.acts { self.stored.value(at) } else { 0.0 }
    }
}

/// The law that a source is.
fn law_of(laws: &[StoringLaw], source: &Source) -> Option<usize> {
    let Source::Element(name) = source else { return None };
    laws.iter().position(|law| law.name == *name)
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
        let forces = &dynamics.forces;
        let elastic = forces.has_springs() || !forces.bushings.is_empty();
        let stiffness = match model.beams.is_empty() && !elastic {
            true => 0.0,
            false => {
                let system = dynamics.variational(mechanism);
                let hessian = SparseMatrix::assemble(n, n, |out| {
                    system.stiffness(at.moving(&vec![0.0; n]), out)
                });
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
