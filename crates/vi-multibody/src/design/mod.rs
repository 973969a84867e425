//! Derivatives by the numbers of a mechanism: masses, moments, anchors, axes, stiffnesses, loads.
//!
//! ```text
//! D_1 L_d + f_d^-,  D_2 L_d + f_d^+,  Gᵀ h λ,  g     at fixed (q_n, q_{n+1}, λ_n)
//! masses            linear: M_θ Δq/h, M_θ γ
//! rows of joints    products of two forms whose coefficients are anchors and axes: the product rule
//! springs           the same formulas with coefficients that have tangents
//! ```
//! [`MechanismTangent`]: how all numbers change with one parameter, a value of the shape of a
//! [`crate::Description`] and its force elements. [`MechanismDesign`] takes one for each parameter.
//! [`start`]: the initial state by joint coordinates, rates and parameters; [`velocity`]:
//! velocities of nodes; [`acceleration`]: their accelerations and multipliers; [`reaction`]: what
//! multipliers mean.

pub mod acceleration;
mod coordinate;
mod coordinate_acceleration;
mod explicit;
mod mass_sums;
mod moved_bushing;
mod moved_coordinate;
pub mod reaction;
mod row_sums;
mod rows;
mod side_sums;
mod signal_forces;
mod signals;
pub mod start;

mod tangent;
pub mod velocity;

pub use coordinate_acceleration::CoordinateAcceleration;
pub use moved_bushing::{FrameChange, MovedFrames, MovedSixForce, MovedSixSpring};
pub use moved_coordinate::MovedCoordinate;
pub use signals::{SampledTangent, SignalTangent};
pub use tangent::{
    BarTangent, BodyTangent, EffortChange, EffortTangent, ForceChange, JointTangent,
    MechanismTangent, ReferenceTangent, ScalarTangent, SideTangent, SpringTangent, StepTangent,
    WholeForce,
};

use crate::builder::{ElementForce, ForceElements};
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::force::law::{Input, Target};
use crate::force::spring::Spring;
use crate::mechanism::Mechanism;
use crate::output::joint_wrenches::links_of_joints;
use explicit::{
    EffortOn, Explicit, ForceOfLoad, Masses, MovedEffort, OfElements, OwnEnergy, OwnForcePair,
    PointDamper, PointSpring, Sink, Weight,
};
use mass_sums::{MassSums, SumFactors};
use row_sums::ParameterRowSums;
use rows::MovedRows;
use side_sums::SideSums;
use signal_forces::OfSignals;
use std::sync::Arc;
use vi_constraints::Constraints;
use vi_constraints::design::{Costates, Design, Place};
use vi_core::interval::Interval;
use vi_core::linear::dot;
use vi_core::num_dual::Dual64;
use vi_core::signals::Signals as _;
use vi_core::{Quadrature, SparseMatrix};

/// A derivative that is not available.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// A force whose numbers are not known reads a joint that moves.
    #[error("the force `{force}` may read the joint `{joint}`, whose geometry changes")]
    Reads {
        /// The force.
        force: String,
        /// The joint.
        joint: String,
    },
    /// The second derivatives of a constraint change, and how is not known.
    #[error(
        "accelerations, and forces at the start and at sub-steps, have no derivatives with `{0}`, \
         a constraint along an angle or of a sum of rates"
    )]
    Angle(String),
    /// A sum of rates reads a joint that moves.
    #[error("the constraint `{0}` reads a joint whose geometry changes")]
    Rates(String),
    /// A tangent is of another kind than its element.
    #[error("the change of `{0}` is not one of such an element")]
    Kind(String),
}

/// Derivatives of the equations of a step by parameters, each with the tangent of the numbers.
pub struct MechanismDesign {
    parameters: Vec<ParameterEffects>,
    beside: Vec<usize>, // parameters that touch more than what is summed
    masses: MassSums,
    products: ParameterRowSums, // of the joints of the tree
    closures: ParameterRowSums, // of the others
    sides: Option<SideSums>,    // in the place of those of the tree
    factors: Vec<SumFactors>,   // of each parameter
    works: Vec<WorkDesign>,
}

/// How the work of a force changes.
struct WorkDesign {
    place: usize, // among the internal variables
    force: MechanismDesign,
    rows: usize,
}

/// What one parameter touches.
struct ParameterEffects {
    masses: Option<Masses>,
    products: MovedRows,
    elements: Vec<Box<dyn Explicit>>,
    rows: MovedRows, // the others
    internal: Option<Arc<dyn StepTangent>>,
    signals: Option<SignalTangent>,
}

impl std::fmt::Debug for MechanismDesign {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let counts: Vec<usize> = self.parameters.iter().map(|own| own.elements.len()).collect();
        f.debug_struct("MechanismDesign").field("elements", &counts).finish_non_exhaustive()
    }
}

impl MechanismDesign {
    /// By parameters along which the numbers of a mechanism and its force elements change so;
    /// `mass`: `M` of all, `quadrature`: of the potentials.
    ///
    /// # Errors
    /// [`DesignError`] where something changes with a parameter whose derivative is not available.
    pub fn new(
        mechanism: &Mechanism,
        forces: &ForceElements,
        mass: &SparseMatrix,
        quadrature: Quadrature,
        tangents: &[MechanismTangent],
    ) -> Result<Self, DesignError> {
        let numbers = Numbers { mechanism, forces, mass, quadrature };
        let parameters = tangents.iter().map(|tangent| numbers.parameter(tangent));
        let parameters: Vec<ParameterEffects> = parameters.collect::<Result<_, _>>()?;
        let (gravity, own) = (mechanism.description().gravity, parameters.len());
        let masses = parameters.iter().map(|parameter| parameter.masses.as_ref());
        let (masses, mut factors) = MassSums::of(masses, gravity, own);
        let in_tree = &rows_in_tree(mechanism)[..];
        let rows = |of_tree: bool| {
            let is_one = move |(row, _): &(usize, _)| in_tree[*row] == of_tree;
            parameters.iter().map(move |parameter| parameter.products.products().filter(is_one))
        };
        let mut first = own + masses.len();
        let [products, closures] = [true, false].map(|of_tree| {
            let (sums, more) = ParameterRowSums::of(rows(of_tree), first);
            factors.iter_mut().zip(more).for_each(|(factors, more)| factors.extend(more));
            first += sums.len();
            sums
        });
        let sides = SideSums::of(mechanism, tangents, first).map(|(sums, more)| {
            factors.iter_mut().zip(more).for_each(|(factors, more)| factors.extend(more));
            sums
        });
        let touches = |k: &usize| parameters[*k].touches_more();
        let beside = (0..own).filter(touches).collect();
        let works = Vec::new();
        Ok(Self { parameters, beside, masses, products, closures, sides, factors, works })
    }

    /// With the works of forces as internal variables: the place of each, and its force.
    ///
    /// # Errors
    /// As of [`MechanismDesign::new`].
    pub fn with_works<'a>(
        mut self,
        mechanism: &Mechanism,
        forces: &ForceElements,
        mass: &SparseMatrix,
        tangents: &[MechanismTangent],
        works: impl Iterator<Item = (usize, &'a str)>,
    ) -> Result<Self, DesignError> {
        for (place, name) in works {
            let only = forces.only(name);
            if only.forces.is_empty() {
                continue;
            }
            let of_force = |own: &MechanismTangent| own.of_force(name, forces);
            let tangents: Vec<_> = tangents.iter().map(of_force).collect();
            let force = Self::new(mechanism, &only, mass, Quadrature::Midpoint, &tangents)?;
            self.works.push(WorkDesign { place, force, rows: mechanism.len() });
        }
        Ok(self)
    }
}

/// Which constraints are of joints of the tree.
fn rows_in_tree(mechanism: &Mechanism) -> Vec<bool> {
    let mut in_tree = vec![false; mechanism.len()];
    for (k, link) in links_of_joints(mechanism).iter().enumerate() {
        in_tree[mechanism.joint_rows(k)].fill(link.is_some());
    }
    in_tree
}

/// The numbers that change.
struct Numbers<'a> {
    mechanism: &'a Mechanism,
    forces: &'a ForceElements,
    mass: &'a SparseMatrix,
    quadrature: Quadrature,
}

impl Numbers<'_> {
    fn parameter(&self, tangent: &MechanismTangent) -> Result<ParameterEffects, DesignError> {
        let mut elements: Vec<Box<dyn Explicit>> = Vec::new();
        let gravity = self.mechanism.description().gravity;
        let masses = Masses::of(self.mechanism, tangent, gravity);
        if tangent.gravity.amax() != 0.0 {
            let force = self.mechanism.weight_in(&tangent.gravity, self.mass);
            elements.push(Box::new(Weight { force }));
        }
        for (&k, change) in &tangent.springs {
            let spring = &self.forces.springs[k];
            let dual = Spring {
                between: spring.between.with_tangent(&change.between),
                stiffness: Dual64::new(spring.stiffness, change.stiffness),
                natural_length: Dual64::new(spring.natural_length, change.natural_length),
                law: spring.law,
            };
            elements.push(Box::new(PointSpring { spring: dual, quadrature: self.quadrature }));
        }
        self.along_coordinates(tangent, &mut elements)?;
        for (_, damper) in &tangent.dampers {
            elements.push(Box::new(PointDamper { damper: damper.clone() }));
        }
        for (&k, change) in &tangent.loads {
            let own = &self.forces.forces[k];
            let ElementForce::Body(load) = &own.force else {
                return Err(DesignError::Kind(own.name.clone()));
            };
            elements.push(Box::new(ForceOfLoad { load: load.clone(), change: *change }));
        }
        for (_, force) in &tangent.forces {
            elements.push(Box::new(OwnForcePair { force: force.clone() }));
        }
        for force in &tangent.energies {
            elements.push(Box::new(OwnForcePair { force: force.clone() }));
        }
        for potential in &tangent.potentials {
            elements.push(Box::new(OwnEnergy { potential: potential.clone() }));
        }
        let internal = tangent.elements.clone();
        if let Some(own) = internal.clone() {
            elements.push(Box::new(OfElements { own }));
        }
        let signals = tangent.signals.clone();
        if let Some(own) = &signals {
            elements.push(Box::new(OfSignals::new(own, self.forces)));
        }
        let [products, rows] = MovedRows::of(self.mechanism, tangent)?.split();
        Ok(ParameterEffects { masses, products, elements, rows, internal, signals })
    }

    /// Springs and forces along joint coordinates: where their numbers change, or their joint.
    fn along_coordinates(
        &self,
        tangent: &MechanismTangent,
        elements: &mut Vec<Box<dyn Explicit>>,
    ) -> Result<(), DesignError> {
        for change in &tangent.efforts {
            let effort = EffortOn::new(self.mechanism, change);
            elements
                .push(Box::new(effort.ok_or_else(|| DesignError::Kind(format!("{change:?}")))?));
        }
        for spring in &self.forces.joint_springs {
            let (at, law) = (&spring.coordinate, spring.clone());
            elements.extend(MovedEffort::of(self.mechanism, tangent, at, law));
        }
        for own in &self.forces.forces {
            if let ElementForce::Joint(force) = &own.force {
                let (at, law) = (&force.coordinate, force.clone());
                elements.extend(MovedEffort::of(self.mechanism, tangent, at, law));
            }
        }
        self.unread(tangent)
    }

    /// Laws of anything, and what is sampled, neither read coordinates that change nor act along
    /// them.
    fn unread(&self, tangent: &MechanismTangent) -> Result<(), DesignError> {
        let Some(&joint) = tangent.joints.keys().next() else { return Ok(()) };
        let moves = |own: &JointCoordinate| MovedCoordinate::moves(self.mechanism, tangent, own);
        let reads = |own: &[Input]| MovedCoordinate::moves_any(self.mechanism, tangent, own);
        let moved = |own: &&crate::builder::NamedForce| match &own.force {
            ElementForce::Law(law) => {
                let along = matches!(&law.target, Target::Coordinate(own) if moves(own));
                along || reads(&law.reading.inputs)
            }
            _ => false,
        };
        let sampled = self.forces.signals.as_ref().filter(|own| own.is_sampled());
        let sampled = sampled.filter(|own| reads(&own.reading.inputs));
        let sampled = sampled.map(|_| "what is sampled".to_owned());
        match self.forces.forces.iter().find(moved).map(|law| law.name.clone()).or(sampled) {
            Some(force) => {
                let joint = self.mechanism.description().joints[joint].name.clone();
                Err(DesignError::Reads { force, joint })
            }
            None => Ok(()),
        }
    }
}

/// Adds what is emitted to vectors.
struct Added<'a> {
    minus: &'a mut [f64],
    plus: &'a mut [f64],
    rows: &'a mut [f64],
}

impl Sink for Added<'_> {
    fn minus(&mut self, i: usize, value: f64) {
        self.minus[i] += value;
    }
    fn plus(&mut self, i: usize, value: f64) {
        self.plus[i] += value;
    }
    fn row(&mut self, i: usize, value: f64) {
        self.rows[i] += value;
    }
}

/// Weighs what is emitted by the costates.
struct Weighed<'a> {
    costates: Costates<'a>,
    sum: f64,
}

impl Sink for Weighed<'_> {
    fn minus(&mut self, i: usize, value: f64) {
        self.sum -= value * self.costates.step[i];
    }
    fn plus(&mut self, i: usize, value: f64) {
        self.sum += value * self.costates.momentum[i];
    }
    fn row(&mut self, i: usize, value: f64) {
        self.sum -= value * self.costates.rows[i];
    }
    fn keeps_gradients(&self) -> [bool; 2] {
        self.costates.apart.map(|apart| !apart)
    }
}

impl ParameterEffects {
    fn changes_internal(&self) -> bool {
        self.internal.is_some() || self.signals.is_some()
    }

    fn touches_more(&self) -> bool {
        !(self.elements.is_empty() && self.rows.is_empty())
    }

    /// Emits all but masses and products of forms.
    fn emit_beside(&self, at: Place<'_>, impulse: &[f64], out: &mut dyn Sink) {
        if at.has_forces() {
            self.elements.iter().for_each(|element| element.emit(at, out));
        }
        if at.has_rows() {
            self.rows.emit(at.interval(), impulse, out);
        }
        if let (Place::Strains(step, i), Some(own)) = (at, &self.internal) {
            let mut force = vec![0.0; step.step().dim()];
            own.add_at_point(&step, i, &mut force);
            explicit::each(&force, |i, f| out.plus(i, f));
        }
    }
}

impl Design for MechanismDesign {
    fn len(&self) -> usize {
        self.parameters.len()
    }

    fn add_tangent(
        &self,
        k: usize,
        at: Place<'_>,
        impulse: &[f64],
        minus: &mut [f64],
        plus: &mut [f64],
        rows: &mut [f64],
    ) {
        let (own, mut out) = (&self.parameters[k], Added { minus, plus, rows });
        if let Some(masses) = own.masses.as_ref().filter(|_| at.has_forces()) {
            masses.emit(at, &mut out);
        }
        if at.has_rows() {
            own.products.emit(at.interval(), impulse, &mut out);
        }
        own.emit_beside(at, impulse, &mut out);
    }

    fn add_at_node(&self, k: usize, at: &Interval, [minus, plus]: [&mut [f64]; 2]) {
        let (own, mut out) = (&self.parameters[k], Added { minus, plus, rows: &mut [] });
        if let Some(masses) = &own.masses {
            masses.emit(Place::Gauss(at, 1.0), &mut out);
        }
        own.emit_beside(Place::Gauss(at, 1.0), &[], &mut out);
        if let Some(own) = &own.internal {
            let [mut node, mut gauss] = [(); 2].map(|()| vec![0.0; at.dim()]);
            own.add_at_node(&at.q0, &at.v_mid, &mut node);
            own.add_at_gauss(&at.q0, &at.v_mid, &mut gauss);
            node.iter_mut().zip(&gauss).for_each(|(node, gauss)| *node -= gauss); // emitted above
            explicit::halves(at, &node, &mut out);
        }
    }

    fn add_internal(&self, k: usize, at: Place<'_>, out: &mut [f64]) {
        if let (Some(own), Place::Step(s)) = (&self.parameters[k].internal, at) {
            own.add_internal(s, out);
        }
        if let (Some(own), Place::Step(s)) = (&self.parameters[k].signals, at) {
            own.add_internal(s, out);
        }
        let (s, weight) = match at {
            Place::Step(s) => (s, 1.0),
            Place::Gauss(s, weight) => (s, weight),
            Place::Points(_) | Place::Strains(..) => return,
        };
        for own in &self.works {
            let [mut minus, mut plus] = [(); 2].map(|()| vec![0.0; s.q0.len()]);
            let [none, mut rows] = [(); 2].map(|()| vec![0.0; own.rows]);
            own.force.add_tangent(k, at, &none, &mut minus, &mut plus, &mut rows);
            // (f_d^- + f_d^+)_θ·Δq/h
            out[own.place] += weight * (dot(&minus, &s.v_mid) + dot(&plus, &s.v_mid));
        }
    }

    fn add_rates(&self, k: usize, at: Place<'_>, out: &mut [f64]) {
        if let (Some(own), Place::Gauss(s, _)) = (&self.parameters[k].signals, at) {
            own.add_rates(explicit::node(s).moving(&s.v_mid), out);
        }
    }

    fn add_internal_adjoint(&self, at: Place<'_>, y: &[f64], sums: &mut [f64]) {
        let mut change = vec![0.0; y.len()];
        for (k, sum) in (0..self.parameters.len()).zip(sums) {
            if self.parameters[k].changes_internal() || !self.works.is_empty() {
                change.fill(0.0);
                self.add_internal(k, at, &mut change);
                *sum += dot(&change, y);
            }
        }
    }

    fn sums(&self) -> usize {
        let of_rows = self.products.len() + self.closures.len();
        let of_sides = self.sides.as_ref().map_or(0, SideSums::len);
        self.parameters.len() + self.masses.len() + of_rows + of_sides
    }

    fn add_adjoint(
        &self,
        at: Place<'_>,
        impulse: &[f64],
        costates: Costates<'_>,
        sums: &mut [f64],
    ) {
        for &k in &self.beside {
            let mut sink = Weighed { costates, sum: 0.0 };
            self.parameters[k].emit_beside(at, impulse, &mut sink);
            sums[k] += sink.sum;
        }
        let mut change = vec![0.0; costates.rates.len()];
        let moves = |k: &usize| self.parameters[*k].signals.is_some() && !change.is_empty();
        for k in (0..self.parameters.len()).filter(moves).collect::<Vec<_>>() {
            change.fill(0.0);
            self.add_rates(k, at, &mut change);
            sums[k] += dot(&change, costates.rates);
        }
        if at.has_forces() {
            self.masses.add(at.interval(), costates, sums);
        }
        if at.has_rows() {
            self.closures.add(at.interval(), impulse, costates, sums);
            match self.sides.as_ref().filter(|_| !costates.moved[0].is_empty()) {
                Some(sides) => sides.add(at.interval(), costates, sums),
                None => self.products.add(at.interval(), impulse, costates, sums),
            }
        }
    }

    fn add_gradient(&self, sums: &[f64], out: &mut [f64]) {
        for (k, (factors, out)) in self.factors.iter().zip(out).enumerate() {
            *out += sums[k] + factors.iter().map(|(sum, factor)| factor * sums[*sum]).sum::<f64>();
        }
    }

    fn moves_constraints(&self) -> bool {
        let moves = |own: &ParameterEffects| !(own.products.is_empty() && own.rows.is_empty());
        self.parameters.iter().any(moves)
    }

    fn reads_moved(&self) -> bool {
        self.sides.is_some()
    }
}
