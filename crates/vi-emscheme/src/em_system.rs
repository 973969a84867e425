//! A mechanical system as the energy–momentum scheme sees it.
//!
//! ```text
//! B(Δq) = (2/h) M Δq − 2 M v_n + h D̄V(q_n, q_{n+1}) − h f̄(q_n, q_{n+1})       the bracket
//! B + h Ḡᵀλ = 0,    M (v_{n+1} − v_n) = B − h D̄V + h f̄
//! K     = ∂B/∂q_{n+1} = (2/h) M + h ∂D̄V/∂q_{n+1} − h ∂f̄/∂q_{n+1}
//! H_n   = ½ v_nᵀ M v_n + V(q_n)
//! ```
//! `½ (v_{n+1} − v_n)ᵀ M (v_{n+1} + v_n) = (1/h) Δqᵀ M (v_{n+1} − v_n)`, so `H_{n+1} − H_n = f̄·Δq`
//! by directionality of `D̄V` and `Ḡ Δq = g_{n+1} − g_n = 0`. Everything is evaluated times `h`,
//! which leaves no negative power of `h`.
//!
//! Letters: `M` mass matrix (constant, may be singular), `v_n` velocity, `D̄V`, `f̄` as in
//! [`crate::discrete_gradient`], [`crate::load`].

use crate::discrete_gradient::DiscreteGradient;
use crate::gonzalez::Gonzalez;
use crate::invariant::InvariantPotential;
use crate::load::{AtMidpoint, MidpointLoad};
use crate::setup::EmSetupError;
use vi_core::MechanicalSystem;
use vi_core::force::Source;
use vi_core::interval::Interval;
use vi_core::potential::{LinearPotential, Potential};
use vi_core::sparse::{Block, Entries, SparseMatrix};
use vi_core::{Configuration, Motion, SeparableSystem, State};
use vi_multibody::builder::{ElementForce, ForceElements};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::spring::Spring;

/// `v_n` with its rounding error, both of shape `n`.
#[derive(Clone, Debug, Default)]
pub struct Velocity {
    /// `v_n`.
    pub v: Vec<f64>,
    /// Its rounding error.
    pub rounding: Vec<f64>,
}

impl Velocity {
    /// Zero, for `n` coordinates.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self { v: vec![0.0; n], rounding: vec![0.0; n] }
    }

    /// Becomes that of a state.
    pub fn take(&mut self, state: &State) {
        self.v.copy_from_slice(&state.v);
        self.rounding.copy_from_slice(&state.compensation.v);
    }
}

/// A constant mass matrix, potentials with discrete derivatives, loads.
///
/// ```
/// use vi_core::potential::LinearPotential;
/// use vi_core::{MechanicalSystem, SeparableSystem};
/// use vi_emscheme::EmSystem;
/// let mass = SeparableSystem::with_diagonal_mass(&[2.0]).mass().clone();
/// let system = EmSystem::new(mass).gradient(LinearPotential { force: vec![-3.0] });
/// assert_eq!(system.kinetic_energy(&[1.0]), 1.0);
/// ```
pub struct EmSystem {
    mass: SparseMatrix,
    gravity: Option<LinearPotential>,
    gradients: Vec<Box<dyn DiscreteGradient>>,
    loads: Vec<Box<dyn MidpointLoad>>,
    sources: Vec<Source>, // of each load
    has_signals: bool,    // with states or held values, which no scheme here advances
}

impl std::fmt::Debug for EmSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("EmSystem")
            .field("mass", &self.mass)
            .field("gradients", &self.gradients().count())
            .field("loads", &self.loads.len())
            .finish()
    }
}

impl EmSystem {
    /// A free system with mass matrix `M` (kg, kg·m²; symmetric), shape `n × n`.
    ///
    /// # Panics
    /// When `M` is not square.
    #[must_use]
    pub fn new(mass: SparseMatrix) -> Self {
        assert_eq!(mass.shape().0, mass.shape().1, "the mass matrix must be square");
        let (gradients, loads, sources) = (Vec::new(), Vec::new(), Vec::new());
        Self { mass, gravity: None, gradients, loads, sources, has_signals: false }
    }

    /// A mechanism with its masses and gravity; springs, dampers and loads are added by the caller.
    #[must_use]
    pub fn of_mechanism(mechanism: &Mechanism) -> Self {
        Self::with_mass(mechanism, mechanism.mass(|_| {}))
    }

    /// The same with a given mass matrix.
    #[must_use]
    pub fn with_mass(mechanism: &Mechanism, mass: SparseMatrix) -> Self {
        let gravity = mechanism.gravity(&mass);
        Self { gravity, ..Self::new(mass) }
    }

    /// The mass matrix of a variational system and its constant forces (gravity): for systems that
    /// nothing else acts on yet.
    #[must_use]
    pub fn of_linear(system: &SeparableSystem) -> Self {
        let force = system.constant_force();
        let acts = force.iter().any(|w| *w != 0.0);
        let gravity = acts.then_some(LinearPotential { force });
        Self { gravity, ..Self::new(system.mass().clone()) }
    }

    /// Adds the force elements of a mechanism.
    #[must_use]
    pub fn force_elements(mut self, elements: &ForceElements) -> Self {
        for spring in &elements.springs {
            self = self.spring(spring.clone());
        }
        for spring in &elements.joint_springs {
            self = self.gradient(spring.clone());
        }
        for contact in &elements.compliant {
            self = self.potential(contact.clone());
        }
        for own in &elements.bushings {
            self = self.potential(own.spring.clone());
        }
        for own in &elements.forces {
            self = match own.force.clone() {
                ElementForce::Coordinates(force) => self.load_of(own.source(), AtMidpoint(force)),
                ElementForce::Joint(force) => self.load_of(own.source(), force),
                ElementForce::Tension(force) => self.load_of(own.source(), AtMidpoint(force)),
                ElementForce::Body(load) => self.load_of(own.source(), load),
                ElementForce::Wrench(force) => self.load_of(own.source(), AtMidpoint(force)),
                ElementForce::Law(force) => self.load_of(own.source(), AtMidpoint(force)),
                ElementForce::Six(force) => self.load_of(own.source(), AtMidpoint(force)),
            };
        }
        self.has_signals |= elements.signals.as_ref().is_some_and(|own| own.sampler.count() > 0);
        self
    }

    /// Refuses what the schemes cannot advance.
    pub(crate) fn check(&self) -> Result<(), EmSetupError> {
        if self.has_signals { Err(EmSetupError::Signals) } else { Ok(()) }
    }

    /// Gravity and the other potentials, in the order in which they were added.
    fn gradients(&self) -> impl Iterator<Item = &dyn DiscreteGradient> {
        let gravity = self.gravity.iter().map(|own| own as &dyn DiscreteGradient);
        gravity.chain(self.gradients.iter().map(|own| &**own))
    }

    /// Adds a potential with its own discrete derivative.
    #[must_use]
    pub fn gradient(mut self, gradient: impl DiscreteGradient + 'static) -> Self {
        self.gradients.push(Box::new(gradient));
        self
    }

    /// Adds any potential, by Gonzalez's formula on all coordinates.
    #[must_use]
    pub fn potential(self, potential: impl Potential + 'static) -> Self {
        let n = self.dim();
        self.gradient(Gonzalez::new(potential, n))
    }

    /// Adds a spring.
    #[must_use]
    pub fn spring(self, spring: Spring) -> Self {
        self.gradient(InvariantPotential::from(spring))
    }

    /// Adds a load or a damper without a name.
    #[must_use]
    pub fn load(self, load: impl MidpointLoad + 'static) -> Self {
        self.load_of(Source::default(), load)
    }

    /// Adds a load or a damper with what exerts it.
    #[must_use]
    pub fn load_of(mut self, source: Source, load: impl MidpointLoad + 'static) -> Self {
        self.loads.push(Box::new(load));
        self.sources.push(source);
        self
    }

    /// Whether any load or damper acts.
    #[must_use]
    pub fn has_loads(&self) -> bool {
        !self.loads.is_empty()
    }

    /// `H = ½ vᵀMv + V(q)` of a node, J.
    #[must_use]
    pub fn energy(&self, state: &State) -> f64 {
        self.kinetic_energy(&state.v) + self.potential_energy(state.configuration())
    }

    /// What exerts each load.
    #[must_use]
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Adds the work of each load in a step, `f̄·Δq`, J, in the order of [`EmSystem::sources`];
    /// `scratch`: shape `n`.
    pub fn add_work(&self, s: &Interval, scratch: &mut [f64], out: &mut [f64]) {
        for (load, work) in self.loads.iter().zip(out) {
            *work += load.work(s, scratch);
        }
    }

    /// `out ← h B`, shape `n`, for a step from a node with velocity `v_n`; `work`: scratch of shape
    /// `n`.
    pub fn scaled_bracket(&self, s: &Interval, v: &Velocity, work: &mut [f64], out: &mut [f64]) {
        for (i, w) in work.iter_mut().enumerate() {
            *w = lag(s.dq[i], s.h, v.v[i], v.rounding[i]);
        }
        out.fill(0.0);
        self.mass.mul_add(2.0, work, out);
        let square = s.h * s.h;
        for gradient in self.gradients() {
            gradient.add(s, square, out);
        }
        for load in &self.loads {
            load.add(s, -square, out);
        }
    }

    /// Emits `h K`, shape `n × n`.
    pub fn scaled_bracket_derivative(&self, s: &Interval, out: &mut dyn Entries) {
        let (row, column, transposed) = (0, 0, false);
        let mut twice = Block { into: out, row, column, scale: 2.0, transposed };
        self.mass.emit(&mut twice);
        let square = s.h * s.h;
        for gradient in self.gradients() {
            gradient.add_derivative(s, square, out);
        }
        for load in &self.loads {
            load.add_derivative(s, -square, out);
        }
    }
}

impl MechanicalSystem for EmSystem {
    fn mass(&self) -> &SparseMatrix {
        &self.mass
    }

    fn potential_energy(&self, at: Configuration<'_>) -> f64 {
        self.gradients().map(|v| v.potential(at)).sum()
    }

    fn add_potential_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.gradients().for_each(|v| v.add_gradient(at, scale, out));
    }

    fn add_force(&self, at: Motion<'_>, out: &mut [f64]) {
        self.loads.iter().for_each(|load| load.add_continuous(at, out));
    }

    fn is_dissipative(&self) -> bool {
        self.loads.iter().any(|load| load.is_dissipative())
    }
}

/// `Δq − h v_n` with the rounding error of `v_n`.
pub(crate) fn lag(dq: f64, h: f64, v: f64, error: f64) -> f64 {
    (dq - h * v) - h * error
}
