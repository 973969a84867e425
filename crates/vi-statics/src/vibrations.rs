//! Damped and gyroscopic vibrations about an equilibrium or a steady rotation.
//!
//! ```text
//! (λ² M_r + λ C_r + K_r) x = 0,   C_r = Pᵀ (2 M W − ∂f/∂v) P,     λ = −ζ ω_0 ± i ω
//! ```
//! `K_r`, `M_r`: [`mod@crate::modes`], with `M W²` in a steady rotation ([`crate::rotation`]).
//! Frequencies are those of the frame that rotates.
//!
//! Source: theory §6.13; F. Tisseur, K. Meerbergen, SIAM Rev. 43 (2001) 235–286.

use crate::modes::{ModeError, Modes, StaticLinearization};
use crate::problem::StaticProblem;
use nalgebra::{Complex, DMatrix};
use vi_core::quadratic_eigen::QuadraticEigen;

/// A part of `λ` below this share of `|λ|` is round-off: two eigenvalues that meet part by the root
/// of `ε`.
const ROUND_OFF: f64 = 1e-6;

/// What a motion `x e^{λt}` is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionKind {
    /// `Re λ > 0`.
    Growth,
    /// Nothing resists: `λ = 0`.
    Rigid,
    /// `Im λ > 0`, `Re λ ≤ 0`.
    Vibration,
    /// `λ < 0`: it dies out without a vibration.
    Decay,
}

/// A motion near the equilibrium.
#[derive(Clone, Debug, PartialEq)]
pub struct Vibration {
    /// What it is.
    pub motion: MotionKind,
    /// `λ`, 1/s.
    pub value: Complex<f64>,
    /// Velocities of all coordinates, shape `n`; the motion is `Re (x e^{λt})`.
    pub shape: Vec<Complex<f64>>,
    /// `|(λ²M + λC + K) x|` relative to the size of its terms.
    pub residual: f64,
}

/// All motions near an equilibrium.
///
/// ```
/// use vi_core::Quadrature;
/// use vi_multibody::builder::{Inertia, MechanismBuilder};
/// use vi_multibody::{FrameId::Ground, PairKind};
/// use vi_multibody::joint_force::Viscous;
/// use vi_statics::{MotionKind, StaticProblem, vibrations};
///
/// // a hanging pendulum with a damper: J' λ² + c λ + m γ l = 0
/// let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
/// let arm = builder.body("arm", Inertia::principal(2.0, [0.1; 3])).at([0.0, 0.0, -0.5]).id();
/// let hinge = builder.joint("hinge", PairKind::Revolute, Ground, arm);
/// let hinge = hinge.at([0.0; 3]).axis([0.0, 1.0, 0.0]).id();
/// builder.joint_force(hinge.coordinate(0), Viscous(0.3));
/// let built = builder.build()?;
/// let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
/// let found = vibrations(&mut problem)?;
/// let swing = found.get(MotionKind::Vibration, 0).expect("it is not overdamped");
/// assert!((swing.value.re + 0.25).abs() < 1e-12); // −c/2J'
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Vibrations {
    linear: StaticLinearization,
    eigen: QuadraticEigen,
    imaginary: bool,   // λ of vibrations, but for partners of what grows
    rigid: Vec<usize>, // of the undamped modes
    moving: Vec<(MotionKind, usize)>, // of the eigenvalues, sorted
}

impl std::fmt::Debug for Vibrations {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Vibrations").field("count", &self.len()).finish_non_exhaustive()
    }
}

/// All motions near the last equilibrium of a problem: those that grow, those without stiffness,
/// vibrations and decays, slowest first.
///
/// # Errors
/// [`ModeError`].
pub fn vibrations(problem: &mut StaticProblem) -> Result<Vibrations, ModeError> {
    StaticLinearization::all(problem)?.vibrations()
}

impl StaticLinearization {
    /// All motions, with damping and gyroscopic terms.
    ///
    /// # Errors
    /// [`ModeError`].
    pub fn vibrations(self) -> Result<Vibrations, ModeError> {
        let eigen = QuadraticEigen::new(&self.K, &self.C, &self.M)?;
        let undamped = eigen.undamped();
        let noise = self.noise(undamped);
        let resists = |k: &usize| undamped.squared[*k].abs() > noise[*k];
        let rigid: Vec<usize> = (0..undamped.squared.len()).filter(|k| !resists(k)).collect();
        let least = rigid.iter().map(|&k| noise[k]).fold(0.0, f64::max);
        // what rounding makes of λ² is a matter of its own shape: (Σ |y_j| √noise_j)² beside the
        // modes y
        let moves = |k: usize, value: Complex<f64>| {
            let square = value.norm_sqr();
            let own = || eigen.modal_shape(k).iter().zip(&noise).map(|(y, n)| y.norm() * n.sqrt());
            square > least || square > own().sum::<f64>().powi(2)
        };
        let mut moving: Vec<(MotionKind, usize)> = Vec::new();
        let values = eigen.values();
        for (k, value) in values.iter().enumerate().filter(|(k, value)| moves(*k, **value)) {
            let motion = motion(*value);
            moving.push((motion, k));
            if motion == MotionKind::Decay && value.im > 0.0 {
                moving.push((motion, k)); // two equal ones, apart by round-off
            }
        }
        let key = |(motion, k): &(MotionKind, usize)| {
            let value = values[*k];
            match motion {
                MotionKind::Growth => (0, -value.re),
                MotionKind::Rigid => (1, 0.0),
                MotionKind::Vibration => (2, value.im),
                MotionKind::Decay => (3, -value.re),
            }
        };
        moving.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        // λ of a vibration is then imaginary: what is left is round-off
        let undamped = self.is_undamped();
        let conservative = !self.balance.dissipative && !self.circulates(eigen.undamped(), &noise);
        let imaginary = undamped || conservative;
        Ok(Vibrations { linear: self, eigen, imaginary, rigid, moving })
    }
}

/// What `λ` is that is not zero.
pub(crate) fn motion(value: Complex<f64>) -> MotionKind {
    if value.re > ROUND_OFF * value.norm() {
        MotionKind::Growth
    } else if value.im > ROUND_OFF * value.norm() {
        MotionKind::Vibration
    } else {
        MotionKind::Decay
    }
}

impl Vibrations {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rigid.len() + self.moving.len()
    }

    /// Whether nothing can move.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.linear.dof
    }

    /// The modes without damping and gyroscopic terms.
    #[must_use]
    pub fn undamped(&self) -> Modes {
        self.linear.modes_of(self.eigen.undamped())
    }

    /// How many of a kind there are.
    #[must_use]
    pub fn count(&self, motion: MotionKind) -> usize {
        match motion {
            MotionKind::Rigid => self.rigid.len(),
            _ => self.moving.iter().filter(|(own, _)| *own == motion).count(),
        }
    }

    /// The `k`-th of a kind: the fastest growth, the slowest vibration or decay is the first.
    #[must_use]
    pub fn get(&self, motion: MotionKind, k: usize) -> Option<Vibration> {
        if motion == MotionKind::Rigid {
            return self.rigid.get(k).map(|&k| self.rigid_motion(k));
        }
        let (_, index) = self.moving.iter().filter(|(own, _)| *own == motion).nth(k)?;
        let pair = self.eigen.pair(*index);
        let mut value = pair.value;
        if motion == MotionKind::Decay {
            value.im = 0.0;
        }
        if self.imaginary
            && motion == MotionKind::Vibration
            && value.re.abs() <= ROUND_OFF * value.norm()
        {
            value.re = 0.0;
        }
        let shape = self.shape(&DMatrix::from_columns(&[pair.vector]));
        let residual = self.residual(pair.residual);
        Some(Vibration { motion, value, shape, residual })
    }

    fn residual(&self, dense: f64) -> f64 {
        self.linear.subspace.as_ref().map_or(dense, |subspace| subspace.residual)
    }

    fn rigid_motion(&self, k: usize) -> Vibration {
        let undamped = self.eigen.undamped();
        let x = undamped.vectors.columns(k, 1).map(|x| Complex::new(x, 0.0));
        let value = Complex::default();
        let residual = self.residual(undamped.residual);
        Vibration { motion: MotionKind::Rigid, value, shape: self.shape(&x), residual }
    }

    fn shape(&self, x: &DMatrix<Complex<f64>>) -> Vec<Complex<f64>> {
        let re = self.linear.velocities(&x.map(|x| x.re));
        let im = self.linear.velocities(&x.map(|x| x.im));
        re.iter().zip(im.iter()).map(|(re, im)| Complex::new(*re, *im)).collect()
    }
}
