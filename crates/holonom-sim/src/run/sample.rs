//! What a run delivers at a node: the types between the simulation and everything that writes.

use crate::event::EventRecord;
use crate::output::columns::COORDINATE_NAMES;
use crate::run::contacts::ContactSample;
use serde::{Deserialize, Serialize};
use vi_core::Energies;
use vi_core::momentum_map::Momentum;

/// How a member of a system stores its coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MemberKind {
    /// A rigid body: 12 director coordinates `φ, d_1, d_2, d_3`.
    Frame,
    /// A point mass in the plane, 2 coordinates.
    Particle2,
    /// A point mass in space, 3 coordinates.
    Particle3,
}

impl MemberKind {
    /// Suffixes of its trajectory columns, in the order of its coordinates.
    #[must_use]
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Frame => &COORDINATE_NAMES,
            Self::Particle2 => &COORDINATE_NAMES[..2],
            Self::Particle3 => &COORDINATE_NAMES[..3],
        }
    }
}

/// A named member of a system; members follow one another in `q`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    /// The name in the model file.
    pub name: String,
    /// Its coordinates.
    pub kind: MemberKind,
}

/// Largest residuals of the constraints at a node, at three levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResidualsAtLevels {
    /// `|g(q_n)|_∞`.
    pub position: f64,
    /// `|G(q_{n+1/2}) Δq/h|_∞`, LMO08 (45).
    pub velocity: f64,
    /// `|G M⁻¹ p_n|_∞`, LMO08 (46); for singular `M` and composed steps with the projected
    /// momentum.
    pub momentum: f64,
}

/// Multipliers, discrete Legendre transforms and energies of a node; what is not defined there is
/// empty.
///
/// | | order 2 | order above 2, or no step from the node | energy–momentum schemes |
/// |---|---|---|---|
/// | `lambda` | (36), at the start (47) | acceleration level | mean of the steps beside the node |
/// | `p` | (34) | | `M v_n` |
/// | `p_projected`, `p_reduced`, `hamiltonian_projected` | (39)–(42), (53) | the same | |
/// | `discrete_energy` | (52) | | |
/// | `hamiltonian` | (53) with `p`; none where `M` is singular | | `½ v_nᵀ M v_n`, `V(q_n)` |
///
/// Energy–momentum schemes have no discrete Lagrangian: their `p` is no Legendre transform, and
/// (39)–(42) and (52) do not exist.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Momenta {
    /// `λ_n`, N, shape `m`; of minimum norm where constraints are redundant.
    pub lambda: Vec<f64>,
    /// `p_n`, kg·m/s for points and kg·m²/s for directors, shape `n`.
    pub p: Vec<f64>,
    /// `ᵠp_n`, shape `n`.
    pub p_projected: Vec<f64>,
    /// `Pᵀ ᵠp_n` with `P` of the spanning tree: `ᴾp_n` where no loop is closed. One entry for each
    /// rate of a joint of the tree; with closed loops more than there are degrees of freedom.
    pub p_reduced: Vec<f64>,
    /// `E_d(q_n, q_{n+1})`.
    pub discrete_energy: Option<Energies>,
    /// `H_d(q_n, p_n)`.
    pub hamiltonian: Option<Energies>,
    /// `H_d(q_n, ᵠp_n)`.
    pub hamiltonian_projected: Option<Energies>,
}

impl Momenta {
    /// Whether no number is NaN or infinite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let energies = [self.discrete_energy, self.hamiltonian, self.hamiltonian_projected];
        let vectors = [&self.lambda, &self.p, &self.p_projected, &self.p_reduced];
        let energies = energies.iter().flatten().flat_map(|e| [e.kinetic, e.potential]);
        vectors.into_iter().flatten().copied().chain(energies).all(f64::is_finite)
    }
}

/// Names of the entries of [`Momenta`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MomentaNames {
    /// Of `λ_n`: `OWNER.k`, a body, joint, bar or constraint and its k-th row.
    pub constraints: Vec<String>,
    /// Of `p_n` and `ᵠp_n`: `MEMBER.x` and so on, as in the trajectory.
    pub coordinates: Vec<String>,
    /// Of `ᴾp_n`: `JOINT.k`, a joint of the spanning tree and its k-th rate; free members under
    /// their own name.
    pub rates: Vec<String>,
}

/// A node of the motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Step index `n`.
    pub step: u64,
    /// `t_n`, s.
    pub t: f64,
    /// `q_n`, members one after the other.
    pub q: Vec<f64>,
    /// `E_d(q_n, q_{n+1})`, J, LMO08 (52); with composed steps (order above 2) equal to
    /// `hamiltonian`.
    pub energy: f64,
    /// `H_d(q_n, ᵠp_n)`, J, LMO08 (53) with the projected momentum.
    pub hamiltonian: f64,
    /// The shadow energy `(p H_d + E_d)/(p + 1)` of a scheme of order `p`, J, with `E_d` of the
    /// step that starts here, of a composed step that ended here (`Σ γ_i E_{d,i}`); the energy of
    /// energy–momentum schemes. `None` at the start of composed steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shadow: Option<f64>,
    /// Work done since the start by loads, motors, dampers and prescribed motions, J, over all
    /// steps; zero for conservative systems and in statics.
    #[serde(default)]
    pub work: f64,
    /// Momentum maps of the projected momentum `ᵠp_n`.
    pub momentum: Momentum,
    /// Constraint residuals.
    pub residuals: ResidualsAtLevels,
    /// Newton iterations of the step that led here (0 at the start; the mean over sub-steps).
    pub newton_iterations: f64,
    /// What the sensors of the model measure, in the order of their columns; empty without sensors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensors: Vec<f64>,
    /// Parts of the energy and the balance with the work done, in the order of their columns
    /// ([`crate::simulation::Simulation::energy_columns`]); empty in statics.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub energies: Vec<f64>,
    /// Multipliers and momenta, where the model asks for them (`simulation.momenta`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub momenta: Option<Box<Momenta>>,
    /// Directions in which an equilibrium of statics is unstable, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unstable: Option<usize>,
    /// What was noticed at this node and at none before: the energy has left its band. Among
    /// [`crate::simulation::Simulation::warnings`] from here on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notice: Option<String>,
    /// Contacts, stops and dry friction that transmit a force, where the model asks for them
    /// (`simulation.contacts`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<ContactSample>,
    /// What events and contacts did since the node before, and in the step from here.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<EventRecord>,
}

impl Sample {
    /// Whether no number is NaN or infinite; a sensor that has no value at a node reads NaN.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let ResidualsAtLevels { position, velocity, momentum } = self.residuals;
        let energies = [self.energy, self.hamiltonian, self.work];
        let numbers = [self.t, position, velocity, momentum].into_iter().chain(energies);
        let Momentum { linear, angular } = self.momentum;
        let lists = [&self.q, &self.energies].into_iter().flatten().copied();
        let mut numbers = numbers.chain(self.shadow).chain(linear).chain(angular).chain(lists);
        let momenta = self.momenta.as_ref().is_none_or(|momenta| momenta.is_finite());
        momenta && numbers.all(f64::is_finite)
    }
}
