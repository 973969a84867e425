//! Small vibrations about an equilibrium.
//!
//! ```text
//! K_r x = ω² M_r x,     M_r = PᵀMP (definite although M is singular)
//! K_r = Pᵀ (∇²V − ∂f/∂q + Σ μ_i D²g_i) P + Σ_I ŵ_I d̂_I        P of the tree, then the null space of the loops
//! ```
//! Directions without stiffness show as `ω² = 0` to round-off, unstable ones as `ω² < 0`. Torques
//! with fixed spatial components, followers and control make `K_r` unsymmetric
//! ([`StaticLinearization::is_circulatory`]): here its symmetric part is taken. Circulatory,
//! damping and gyroscopic terms: [`mod@crate::vibrations`]. Dense, `O(d³)`. The midpoint rule shows
//! `ω` as `(2/h) arctan(ωh/2)`.
#![allow(non_snake_case)] // K, M, J, Z

use crate::equations::{EquilibriumEquations, TreeMatrices};
use crate::first_order_terms::FirstOrderTerms;
use crate::problem::StaticProblem;
use nalgebra::DMatrix;
use vi_constraints::Constraints;
use vi_constraints::null_space::NullSpaceQr;
use vi_core::MechanicalSystem;
use vi_core::eigen::{Eigen, EigenError, generalized_eigen, negative_eigenvalues};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_multibody::sparse_nodal::{MapColumns, VelocityLayout};

/// Why there are no modes.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModeError {
    /// The reduced mass is not positive definite.
    #[error("a degree of freedom has no mass: give it mass or rotary inertia, or constrain it")]
    NoMass,
    /// A value is not finite.
    #[error("the stiffness at this configuration is not finite")]
    NotFinite,
    /// The unstable modes that were found are not as many as another way of counting says.
    #[error(
        "the number of unstable modes is not certain: {found} were found, the signs of the stiffness say {expected}"
    )]
    Unconfirmed {
        /// Unstable modes found.
        found: usize,
        /// By the inertia of the stiffness.
        expected: usize,
    },
    /// The unstable modes cannot be counted.
    #[error(
        "the number of unstable modes is not certain: rounding hides the signs of the stiffness"
    )]
    Uncounted,
    /// The subspace iteration did not find the modes asked for.
    #[error(
        "{found} of {wanted} modes were found: the iteration for the lowest modes did not settle"
    )]
    NotSettled {
        /// How many were found.
        found: usize,
        /// How many were asked for, at least.
        wanted: usize,
    },
}

impl From<EigenError> for ModeError {
    fn from(error: EigenError) -> Self {
        match error {
            EigenError::Indefinite => Self::NoMass,
            _ => Self::NotFinite,
        }
    }
}

/// What errors in the configuration add to those of the stiffness.
const NOISE: f64 = 100.0;

/// Modes, softest first: all, or the lowest ones.
///
/// ```
/// use vi_core::Quadrature;
/// use vi_multibody::builder::{Inertia, MechanismBuilder};
/// use vi_multibody::{FrameId::Ground, PairKind};
/// use vi_statics::{StaticProblem, modes};
///
/// // a hanging pendulum: ω² = m γ l/(J + m l²)
/// let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
/// let arm = Inertia::principal(2.0, [0.1; 3]);
/// let arm = builder.body("arm", arm).at([0.0, 0.0, -0.5]).id();
/// builder.joint("hinge", PairKind::Revolute, Ground, arm).at([0.0; 3]).axis([0.0, 1.0, 0.0]);
/// let built = builder.build()?;
/// let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
/// let modes = modes(&mut problem)?;
/// assert!((modes.squared[0] - 9.81 / 0.6).abs() < 1e-12 && !modes.is_unstable(0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    /// `ω²`, rad²/s².
    pub squared: Vec<f64>,
    /// `ω = √max(ω², 0)`, rad/s.
    pub omega: Vec<f64>,
    /// Columns: velocities `v = P x` of all coordinates, shape `n × d`, with `vᵀ M v = 1`.
    pub shapes: DMatrix<f64>,
    /// Degrees of freedom `d`.
    pub dof: usize,
    /// `|K_r − K_rᵀ|_∞ / |K_r|_∞`.
    pub asymmetry: f64,
    /// Size of each `ω²` that round-off alone may cause, rad²/s².
    pub noise: Vec<f64>,
    /// `|Pᵀw|_∞`, N or N·m: forces that are not in balance; zero at an equilibrium.
    pub unbalanced: f64,
    /// The largest of the forces that should balance one another, N or N·m.
    pub applied: f64,
    /// Forces out of balance that round-off alone may cause, N or N·m.
    pub round_off: f64,
    /// `max |Kx − ω²Mx|` relative to the size of its terms, the largest of all modes.
    pub residual: f64,
    /// `max |XᵀMX − I|`.
    pub orthogonality: f64,
    /// How many modes are unstable by the inertia of `K + ςM`, `ς` half the least `|ω²|` that is no
    /// round-off: apart from the eigenvalues, by the pivots of a factorization; of a large system
    /// those of its sparse matrices. `None` where rounding hides them.
    pub negative: Option<usize>,
}

impl Modes {
    /// Whether mode `k` has no stiffness: a rigid-body motion, or a neutral direction.
    #[must_use]
    pub fn is_zero(&self, k: usize) -> bool {
        self.squared[k].abs() <= self.noise[k]
    }

    /// Whether the configuration is unstable along mode `k`.
    #[must_use]
    pub fn is_unstable(&self, k: usize) -> bool {
        self.squared[k] < -self.noise[k]
    }
}

/// The modes about the last equilibrium of a static problem, without damping and gyroscopic terms:
/// [`crate::vibrations()`] has them.
///
/// # Errors
/// [`ModeError`].
pub fn modes(problem: &mut StaticProblem) -> Result<Modes, ModeError> {
    StaticLinearization::all(problem)?.modes()
}

/// What is known of a subspace of the lowest modes.
pub(crate) struct Subspace {
    /// Stiffness in the velocities of frames.
    pub(crate) stiffness: SparseMatrix,
    /// The largest residual of a mode in it.
    pub(crate) residual: f64,
    /// Negative eigenvalues of the whole stiffness.
    pub(crate) negative: Option<usize>,
}

/// `M ẍ + C ẋ + K x = 0`: the motion near the last equilibrium of a static problem in independent
/// velocities.
pub struct StaticLinearization {
    pub(crate) K: DMatrix<f64>,
    pub(crate) C: DMatrix<f64>,
    pub(crate) M: DMatrix<f64>,
    pub(crate) Z: Option<DMatrix<f64>>, // null space of the loops, or a subspace
    pub(crate) layout: VelocityLayout,
    pub(crate) columns: MapColumns,
    pub(crate) asymmetry: f64,
    pub(crate) balance: ForceBalance,
    pub(crate) dof: usize,
    pub(crate) subspace: Option<Subspace>,
    pub(crate) terms: Option<FirstOrderTerms>,
}

impl std::fmt::Debug for StaticLinearization {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Linearization").field("dof", &self.dof).finish_non_exhaustive()
    }
}

/// The forces at the configuration, N or N·m, and what acts.
#[derive(Clone, Copy)]
pub(crate) struct ForceBalance {
    unbalanced: f64,
    applied: f64,
    round_off: f64,
    /// Whether any force dissipates.
    pub(crate) dissipative: bool,
}

impl ForceBalance {
    pub(crate) fn of(problem: &mut StaticProblem) -> Result<Self, ModeError> {
        let work = &mut problem.work;
        let unbalanced = work.balance(&mut problem.x).map_err(|_| ModeError::NotFinite)?;
        let (applied, round_off) = (work.force_scale(), work.round_off());
        let dissipative = work.system.is_dissipative();
        Ok(Self { unbalanced, applied, round_off, dissipative })
    }
}

impl StaticLinearization {
    /// In all degrees of freedom, dense.
    ///
    /// # Errors
    /// [`ModeError::NotFinite`].
    pub fn all(problem: &mut StaticProblem) -> Result<Self, ModeError> {
        let balance = ForceBalance::of(problem)?;
        let work = &mut problem.work;
        let TreeMatrices { K, C, M, layout, columns } = work.tree_matrices();
        let Z = loop_null_space(work, &layout, &columns);
        let reduce = |A: DMatrix<f64>| match &Z {
            Some(Z) => Z.transpose() * A * Z,
            None => A,
        };
        let (K, C, M) = (reduce(K), reduce(C), reduce(M));
        let (dof, size, subspace) = (M.nrows(), K.amax(), None);
        let asymmetry = if size > 0.0 { (&K - K.transpose()).amax() / size } else { 0.0 };
        let terms = None;
        let own = Self { K, C, M, Z, layout, columns, asymmetry, balance, dof, subspace, terms };
        let N = own.velocities(&DMatrix::identity(dof, dof));
        Ok(Self { terms: FirstOrderTerms::of(&problem.work, &N), ..own })
    }

    /// Forces that are not in balance, the largest of those that should balance one another, and
    /// what round-off alone may leave, N or N·m.
    #[must_use]
    pub fn balance(&self) -> [f64; 3] {
        let ForceBalance { unbalanced, applied, round_off, .. } = self.balance;
        [unbalanced, applied, round_off]
    }

    /// Whether there is neither damping nor a gyroscopic term.
    #[must_use]
    pub fn is_undamped(&self) -> bool {
        self.C.iter().all(|c| *c == 0.0)
    }

    /// Whether the stiffness is not symmetric: whether some `x_iᵀ (K − Kᵀ) x_j/2` of undamped modes
    /// is more than rounding.
    ///
    /// # Errors
    /// [`ModeError`].
    pub fn is_circulatory(&self) -> Result<bool, ModeError> {
        if self.asymmetry <= f64::EPSILON {
            return Ok(false);
        }
        let found = generalized_eigen(&self.symmetric_stiffness(), &self.M)?;
        Ok(self.circulates(&found, &self.noise(&found)))
    }

    /// The same from the undamped modes and their noise.
    pub(crate) fn circulates(&self, found: &Eigen, noise: &[f64]) -> bool {
        let X = &found.vectors;
        let N = X.tr_mul(&(0.5 * (&self.K - self.K.transpose()) * X));
        let pairs = (0..noise.len()).flat_map(|j| (0..noise.len()).map(move |i| (i, j)));
        pairs.into_iter().any(|(i, j)| N[(i, j)].abs() > (noise[i] * noise[j]).sqrt())
    }

    /// The modes without damping, gyroscopic and circulatory terms.
    ///
    /// # Errors
    /// [`ModeError`]; [`ModeError::Unconfirmed`] where the inertia of the stiffness contradicts.
    pub fn modes(&self) -> Result<Modes, ModeError> {
        let modes = self.modes_of(&generalized_eigen(&self.symmetric_stiffness(), &self.M)?);
        let found = (0..modes.squared.len()).filter(|&k| modes.is_unstable(k)).count();
        match modes.negative {
            Some(expected) if expected != found => Err(ModeError::Unconfirmed { found, expected }),
            _ => Ok(modes),
        }
    }

    /// [`StaticLinearization::modes`], whatever the inertia says.
    pub(crate) fn modes_without_confirmation(&self) -> Result<Modes, ModeError> {
        Ok(self.modes_of(&generalized_eigen(&self.symmetric_stiffness(), &self.M)?))
    }

    pub(crate) fn modes_of(&self, found: &Eigen) -> Modes {
        let ForceBalance { unbalanced, applied, round_off, .. } = self.balance;
        let noise = self.noise(found);
        Modes {
            omega: found.squared.iter().map(|square| square.max(0.0).sqrt()).collect(),
            negative: match &self.subspace {
                None => Some(self.negative(found, &noise)),
                Some(subspace) => subspace.negative,
            },
            noise,
            shapes: self.velocities(&found.vectors),
            asymmetry: self.asymmetry,
            unbalanced,
            applied,
            round_off,
            residual: self.subspace.as_ref().map_or(found.residual, |own| own.residual),
            dof: self.dof,
            orthogonality: found.orthogonality,
            squared: found.squared.clone(),
        }
    }

    /// Negative eigenvalues of `K_r + ςM_r`, `ς` between those modes that are round-off and the
    /// others.
    fn negative(&self, found: &Eigen, noise: &[f64]) -> usize {
        let sizes = found.squared.iter().map(|square| square.abs()).zip(noise);
        let least = sizes.filter(|(size, noise)| size > noise).map(|(size, _)| size);
        let shift = 0.5 * least.fold(f64::INFINITY, f64::min);
        match shift.is_finite() {
            true => negative_eigenvalues(&(self.symmetric_stiffness() + shift * &self.M)),
            false => 0, // all are round-off
        }
    }

    fn symmetric_stiffness(&self) -> DMatrix<f64> {
        0.5 * (&self.K + self.K.transpose())
    }

    /// How much of each `ω²` may be round-off, in the stiffness and in the configuration.
    pub(crate) fn noise(&self, found: &Eigen) -> Vec<f64> {
        let mut noise = found.noise.clone();
        if let (Some(Subspace { stiffness, .. }), Some(Z)) = (&self.subspace, &self.Z) {
            let x = Z * &found.vectors;
            for (noise, x) in noise.iter_mut().zip(x.column_iter()) {
                *noise = noise.max(entry_noise(stiffness, x.as_slice()));
            }
        }
        noise.iter().map(|noise| NOISE * noise).collect()
    }

    /// Columns `v = P x` of all coordinates, shape `n × k`.
    pub(crate) fn velocities(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let nu = match &self.Z {
            Some(Z) => Z * x,
            None => x.clone(),
        };
        let mut out = DMatrix::zeros(self.layout.dim(), nu.ncols());
        let mut v = vec![0.0; self.layout.dim()];
        for (k, nu) in nu.column_iter().enumerate() {
            self.layout.velocity(&self.columns, nu.clone_owned().as_slice(), &mut v);
            out.column_mut(k).copy_from_slice(&v);
        }
        out
    }
}

/// `Z`: null space of the loop constraints in the unknowns of the tree; `None` without loops.
fn loop_null_space(
    work: &EquilibriumEquations,
    layout: &VelocityLayout,
    columns: &MapColumns,
) -> Option<DMatrix<f64>> {
    let mechanism = &work.mechanism;
    if !mechanism.has_loops() {
        return None;
    }
    let mut closing = mechanism.loop_rows();
    let of_velocities: Vec<usize> = mechanism.velocity_rows().map(|(row, _)| row).collect();
    closing.retain(|row| !of_velocities.contains(row));
    closing.extend(mechanism.cut_bars().iter().flat_map(|&k| mechanism.bar_rows(k)));
    let (n, d) = (layout.dim(), layout.dof());
    let mut place = vec![None; mechanism.len()];
    closing.iter().enumerate().for_each(|(k, &row)| place[row] = Some(k));
    let mut dense = Chosen { place, rows: DMatrix::zeros(n, closing.len()) };
    mechanism.jacobian(work.t, &work.s.q0, &mut dense);
    let mut J = DMatrix::zeros(closing.len(), d);
    let mut row = vec![0.0; d];
    for (k, gradient) in dense.rows.column_iter().enumerate() {
        layout.pull_back(columns, gradient.clone_owned().as_slice(), &mut row);
        J.row_mut(k).copy_from_slice(&row);
    }
    let mut qr = NullSpaceQr::new(d, closing.len());
    let rank = match mechanism.nearly_redundant() {
        // measured as they were when they were taken as redundant
        Some(nearly) if mechanism.cut_bars().is_empty() => {
            let unit = |k: usize| match nearly.allowances[closing[k]] {
                allowed if allowed > 0.0 => mechanism.loop_tolerance() / allowed,
                _ => 1.0 / dense.rows.column(k).norm(),
            };
            qr.factorize_scaled(&J, unit);
            nearly.loop_rank
        }
        _ => qr.factorize(&J),
    };
    let mut Z = DMatrix::zeros(d, d - rank);
    qr.null_space(rank, &mut Z);
    Some(Z)
}

/// Some rows of a matrix, transposed and dense.
struct Chosen {
    place: Vec<Option<usize>>,
    rows: DMatrix<f64>,
}

impl Entries for Chosen {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if let Some(k) = self.place[row] {
            self.rows[(column, k)] += value;
        }
    }
}

/// `4ε |x|ᵀ|K||x|`: what the rounding of the entries of `K` may change `xᵀKx` by.
pub(crate) fn entry_noise(K: &SparseMatrix, x: &[f64]) -> f64 {
    let mut sum = 0.0;
    K.for_each(|i, j, value| sum += (x[i] * value * x[j]).abs());
    4.0 * f64::EPSILON * sum
}
