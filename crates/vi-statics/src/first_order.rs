//! Small motions of first order: with constraints on velocities, with continuous states of signals,
//! about a rest or a steady motion.
//!
//! ```text
//! M ẍ + C ẋ + K x − F z + Sᵀ δμ = 0        x: displacements that keep all holonomic constraints
//! S ẋ + B x = 0                            S = A N,   B = ∂(A v − b)/∂q N + A (W + S_w) N
//! ż = Φ_x x + Φ_v ẋ + Φ_z z                signals
//!
//! ẋ = Y s − S⁺B x,   S Y = 0
//! YᵀM Y ṡ = −Yᵀ [ (C − M S⁺B)(Y s − S⁺B x) + K x − F z ]
//! ```
//! `K`, `C`, `M`: [`mod@crate::modes`], in the frame that moves ([`crate::steady_motion`]). The
//! multipliers of all constraints balance the forces there, so `K` has the terms `Σ μ_i ∂A_i/∂q`.
//! Displacements along which nothing changes have `λ = 0`, in chains with the velocities that they
//! grow by; these are counted apart ([`vi_core::matrix_eigen`]).
//!
//! Source: J. P. Meijaard et al., Proc. R. Soc. A 463 (2007) 1955, for the motion of reference;
//! theory §6, "Modes about a steady motion".
#![allow(non_snake_case)] // M, C, K, F, S, B, Y, Φ

use crate::first_order_terms::States;
use crate::modes::{ModeError, StaticLinearization};
use crate::vibrations::{MotionKind, Vibration, motion};
use nalgebra::{Complex, DMatrix, DVector};
use vi_core::matrix_eigen::MatrixEigen;

/// Singular values of `S` below this part of the largest belong to redundant conditions.
const REDUNDANT: f64 = 1e-9;

/// All small motions `x e^{λt}` of a system of first order.
pub struct FirstOrder {
    linear: StaticLinearization,
    eigen: MatrixEigen,
    moving: Vec<(MotionKind, usize)>, // of the eigenvalues, sorted
    dof: usize,
}

impl std::fmt::Debug for FirstOrder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FirstOrder").field("dof", &self.dof).finish_non_exhaustive()
    }
}

impl StaticLinearization {
    /// Whether constraints on velocities or states of signals make it one of first order.
    #[must_use]
    pub fn is_of_first_order(&self) -> bool {
        self.terms.is_some()
    }

    /// All motions of first order; of a system of second order the same as
    /// [`StaticLinearization::vibrations`].
    ///
    /// # Errors
    /// [`ModeError`].
    pub fn first_order(self) -> Result<FirstOrder, ModeError> {
        let d = self.M.nrows();
        let [S, B] = match &self.terms {
            Some(terms) => terms.rows.clone(),
            None => [DMatrix::zeros(0, d), DMatrix::zeros(0, d)],
        };
        let (Y, drift) = directions(&S, &B);
        let mass = Y.tr_mul(&(&self.M * &Y));
        let cholesky = mass.cholesky().ok_or(ModeError::NoMass)?;
        let speeds = Y.ncols();
        let states = self.terms.as_ref().and_then(|terms| terms.states.as_ref());
        let m = states.map_or(0, |states| states.own.nrows());
        let mut A = DMatrix::zeros(d + speeds + m, d + speeds + m);
        A.view_mut((0, 0), (d, d)).copy_from(&drift);
        A.view_mut((0, d), (d, speeds)).copy_from(&Y);
        let damping = &self.C + &self.M * &drift; // drift: −S⁺B
        let by_position = -(&damping * &drift + &self.K);
        let pulled = |A: &DMatrix<f64>| cholesky.solve(&Y.tr_mul(A));
        A.view_mut((d, 0), (speeds, d)).copy_from(&pulled(&by_position));
        A.view_mut((d, d), (speeds, speeds)).copy_from(&pulled(&(-damping * &Y)));
        if let Some(States { force, by_position, by_velocity, own }) = states {
            A.view_mut((d, d + speeds), (speeds, m)).copy_from(&pulled(force));
            let last = d + speeds;
            A.view_mut((last, 0), (m, d)).copy_from(&(by_position + by_velocity * &drift));
            A.view_mut((last, d), (m, speeds)).copy_from(&(by_velocity * &Y));
            A.view_mut((last, last), (m, m)).copy_from(own);
        }
        let eigen = MatrixEigen::new(&A)?;
        let values = eigen.values();
        let mut moving: Vec<(MotionKind, usize)> = (0..values.len())
            .map(|k| (motion(values[k]), k))
            .flat_map(|(kind, k)| {
                let twice = kind == MotionKind::Decay && values[k].im > 0.0; // apart by round-off
                std::iter::repeat_n((kind, k), 1 + usize::from(twice))
            })
            .collect();
        let key = |(motion, k): &(MotionKind, usize)| match motion {
            MotionKind::Vibration => values[*k].im,
            _ => -values[*k].re,
        };
        moving.sort_by(|a, b| key(a).total_cmp(&key(b)));
        Ok(FirstOrder { linear: self, eigen, moving, dof: speeds })
    }
}

/// `Y` and `−S⁺B`.
fn directions(S: &DMatrix<f64>, B: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let d = S.ncols();
    if S.nrows() == 0 {
        return (DMatrix::identity(d, d), DMatrix::zeros(d, d));
    }
    // square, so that the null space is complete
    let rows = S.nrows().max(d);
    let padded = |A: &DMatrix<f64>| A.clone().resize_vertically(rows, 0.0);
    let svd = padded(S).svd(true, true);
    let floor = REDUNDANT * svd.singular_values.amax();
    let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else {
        return (DMatrix::zeros(d, 0), DMatrix::zeros(d, d));
    };
    let right = padded(B);
    let mut drift = DMatrix::zeros(d, d);
    let mut free = Vec::new();
    for (k, sigma) in svd.singular_values.iter().enumerate() {
        if *sigma <= floor {
            free.push(k);
            continue;
        }
        drift -= v_t.row(k).transpose() * (u.column(k).transpose() * &right / *sigma);
    }
    (v_t.select_rows(&free).transpose(), drift)
}

impl FirstOrder {
    /// Independent velocities.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// How many of a kind there are; of [`MotionKind::Rigid`] displacements that nothing resists.
    #[must_use]
    pub fn count(&self, motion: MotionKind) -> usize {
        match motion {
            MotionKind::Rigid => self.eigen.kernel().ncols(),
            _ => self.moving.iter().filter(|(own, _)| *own == motion).count(),
        }
    }

    /// The `k`-th of a kind: the fastest growth, the slowest vibration or decay is the first.
    #[must_use]
    pub fn get(&self, motion: MotionKind, k: usize) -> Option<Vibration> {
        if motion == MotionKind::Rigid {
            let kernel = self.eigen.kernel();
            let column = (k < kernel.ncols()).then(|| kernel.column(k).map(Complex::from))?;
            let (value, shape) = (Complex::default(), self.shape(&column));
            return Some(Vibration { motion, value, shape, residual: 0.0 });
        }
        let (_, index) = self.moving.iter().filter(|(own, _)| *own == motion).nth(k)?;
        let pair = self.eigen.pair(*index);
        let mut value = pair.value;
        if motion == MotionKind::Decay {
            value.im = 0.0;
        }
        let shape = self.shape(&pair.vector);
        Some(Vibration { motion, value, shape, residual: pair.residual })
    }

    /// The displacements of all coordinates.
    fn shape(&self, x: &DVector<Complex<f64>>) -> Vec<Complex<f64>> {
        let x = x.rows(0, self.linear.M.nrows());
        let part = |of: fn(&Complex<f64>) -> f64| {
            let own = DVector::from_iterator(x.len(), x.iter().map(of));
            self.linear.velocities(&DMatrix::from_columns(&[own]))
        };
        let (re, im) = (part(|x| x.re), part(|x| x.im));
        re.iter().zip(im.iter()).map(|(re, im)| Complex::new(*re, *im)).collect()
    }
}
