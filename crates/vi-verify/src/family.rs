//! What differs between families of schemes when their integrators are verified.

use super::equations::{Equations, Observables, OfSystem};
use super::subject::{NodeValues, ReactionValues};
use std::marker::PhantomData;
use vi_constraints::discretization::{Discretization, Step};
use vi_constraints::galerkin::GalerkinTangent;
use vi_constraints::tangent_map::{TangentMap, Tangents};
use vi_constraints::{Constraints, Integrator};
use vi_core::{DiscreteLagrangian, SeparableSystem};
use vi_emscheme::constraint::DiscreteConstraints;
use vi_emscheme::tangent_map::EmTangentMap;
use vi_emscheme::{EmIntegrator, EmSystem};

/// What a family of schemes provides to be verified.
pub trait VerifiedFamily<C: Constraints> {
    /// What its integrators step.
    type System: Discretization<C>;
    /// The same system, to ask for its potential and forces.
    type Exact: DiscreteLagrangian;
    /// The system that equations of motion are evaluated with.
    fn exact<'a>(&'a self, run: &'a Integrator<Self::System, C>) -> &'a Self::Exact;
    /// See [`super::subject::RunningMotion::values`].
    ///
    /// # Errors
    /// Why the node could not be observed, in words.
    fn values(run: &mut Integrator<Self::System, C>) -> Result<NodeValues, String>;
    /// A canonical basis of tangent vectors at the present node.
    fn tangents(&mut self, run: &Integrator<Self::System, C>) -> Tangents;
    /// Takes tangent vectors along a (sub-)step.
    ///
    /// # Errors
    /// Why it has no tangent, in words.
    fn push(
        &mut self,
        system: &Self::System,
        constraints: &C,
        step: Step<'_>,
        tangents: &mut Tangents,
    ) -> Result<(), String>;
}

const NO_TANGENTS: &str = "no tangent vectors were asked for";

/// The tangent of a step of order 2, or of a Galerkin step.
#[derive(Debug)]
enum VariationalTangent {
    Second(Box<TangentMap>),
    Galerkin(Box<GalerkinTangent>),
}

/// The variational schemes.
#[derive(Debug)]
pub struct Variational<S> {
    tangent: Option<VariationalTangent>,
    system: PhantomData<S>,
}

impl<S> Default for Variational<S> {
    fn default() -> Self {
        Self { tangent: None, system: PhantomData }
    }
}

impl<S: DiscreteLagrangian, C: Observables> VerifiedFamily<C> for Variational<S> {
    type System = S;
    type Exact = S;

    fn exact<'a>(&'a self, run: &'a Integrator<S, C>) -> &'a S {
        run.system()
    }

    fn values(run: &mut Integrator<S, C>) -> Result<NodeValues, String> {
        let acceleration = run.acceleration_multiplier().map_err(|e| e.to_string())?;
        let node = run.observe().map_err(|e| e.to_string())?.clone();
        let (state, constraints, rows) = (run.state(), run.constraints(), run.rows());
        let at = state.configuration();
        let (of_a_step, m) = (!run.reads_states(), constraints.len());
        let redundant = rows.len() < m;
        // where rows are redundant, the force Gᵀλ stands for λ
        let unique = |lambda: Vec<f64>| {
            let (system, angles) = (run.system(), &state.angles[..]);
            let of = OfSystem { system, constraints, angles, redundant: false };
            if redundant { of.constraint_force(at, &lambda) } else { lambda }
        };
        let lambda = if of_a_step { &node.lambda } else { &acceleration };
        let joints = constraints.reactions(at, lambda, rows);
        let reactions =
            (!joints.is_empty()).then(|| ReactionValues { lambda: lambda.clone(), joints });
        Ok(NodeValues {
            reactions,
            q: state.q.clone(),
            p: node.p_projected,
            p_constrained: (of_a_step && node.hamiltonian.is_some()).then_some(node.p),
            lambda: (of_a_step && m > 0).then(|| unique(node.lambda)),
            lambda_other: (m > 0).then(|| unique(acceleration)),
        })
    }

    fn tangents(&mut self, run: &Integrator<S, C>) -> Tangents {
        let (constraints, rows, state) = (run.constraints(), run.rows(), run.state());
        let m = constraints.len();
        self.tangent = match run.method().stages() {
            None => Some(VariationalTangent::Second(Box::new(TangentMap::new(m, rows, &state.p)))),
            Some(stages) => {
                let tangent = GalerkinTangent::new(m, rows, stages, state);
                Some(VariationalTangent::Galerkin(Box::new(tangent)))
            }
        };
        Tangents::canonical(constraints, rows, state.configuration())
    }

    fn push(
        &mut self,
        system: &S,
        constraints: &C,
        step: Step<'_>,
        tangents: &mut Tangents,
    ) -> Result<(), String> {
        let pushed = match self.tangent.as_mut().ok_or(NO_TANGENTS)? {
            VariationalTangent::Second(map) => map.push(system, constraints, step.s, tangents),
            VariationalTangent::Galerkin(map) => map.push(system, constraints, step, tangents),
        };
        pushed.map_err(|e| e.to_string())
    }
}

/// The energy–momentum schemes.
#[derive(Debug)]
pub struct EnergyMomentum {
    forces: SeparableSystem,
    tangent: Option<EmTangentMap>,
}

impl EnergyMomentum {
    /// `forces`: the variational description of the same system.
    #[must_use]
    pub fn new(forces: SeparableSystem) -> Self {
        Self { forces, tangent: None }
    }
}

impl<C: Observables + DiscreteConstraints> VerifiedFamily<C> for EnergyMomentum {
    type System = EmSystem;
    type Exact = SeparableSystem;

    fn exact<'a>(&'a self, _: &'a EmIntegrator<C>) -> &'a SeparableSystem {
        &self.forces
    }

    fn values(run: &mut EmIntegrator<C>) -> Result<NodeValues, String> {
        let node = run.observe().map_err(|e| e.to_string())?.clone();
        let (state, constraints, rows) = (run.state(), run.constraints(), run.rows());
        let joints = constraints.reactions(state.configuration(), &node.lambda, rows);
        let of_a_step = !run.reads_states(); // else no multiplier of a step belongs to a node
        let reactions = (of_a_step && !joints.is_empty())
            .then(|| ReactionValues { lambda: node.lambda.clone(), joints });
        let (mean, single) = match rows.len() < constraints.len() {
            true => (node.constraint_force, node.constraint_force_mid),
            false => (node.lambda, node.lambda_mid),
        };
        let some = |lambda: Vec<f64>| (of_a_step && !lambda.is_empty()).then_some(lambda);
        Ok(NodeValues {
            reactions,
            q: state.q.clone(),
            p: node.p,
            p_constrained: None,
            lambda: some(mean),
            lambda_other: some(single),
        })
    }

    fn tangents(&mut self, run: &EmIntegrator<C>) -> Tangents {
        let (system, constraints, at) =
            (run.system(), run.constraints(), run.state().configuration());
        let mut tangents = Tangents::canonical(constraints, run.rows(), at);
        self.tangent = Some(EmTangentMap::begin(system, run.rows(), &mut tangents));
        tangents
    }

    fn push(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        step: Step<'_>,
        tangents: &mut Tangents,
    ) -> Result<(), String> {
        let map = self.tangent.as_mut().ok_or(NO_TANGENTS)?;
        map.push(system, constraints, step.s, step.multipliers, tangents).map_err(|e| e.to_string())
    }
}
