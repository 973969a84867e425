//! Harmonic response about an equilibrium or a steady rotation.
//!
//! ```text
//! (K + iω C − ω² M) x + Bᵀ· = P_inᵀ f,   B x = 0        q(t) = q_0 + Re(P_in x e^{iωt}),  f(t) = Re(f e^{iωt})
//! C ← C + α M + β K                                      Rayleigh
//! C ← C + Σ 2 ζ_k ω_k (M x_k)(M x_k)ᵀ                    modal, x_kᵀ M x_k = 1
//! ```
//! `K`, `C`, `M` are those of [`mod@crate::vibrations`], of all frames and point masses, `B` the
//! rows of joints: sparse, one case for trees and loops. The complex equations are solved as real
//! ones of twice the size, factorized once for each frequency. Modal damping is of low rank: with
//! `C_0 = C + 2ζω M`, `ζ` the last ratio, the factors are never singular at a resonance, and what
//! the listed modes have beside it is added by the formula of Woodbury; modes beyond the list keep
//! `2ζω`.
//!
//! Source: theory §6.13; N. J. Higham, Accuracy and Stability of Numerical Algorithms (2002), §25.
#![allow(non_snake_case)] // K, C, M, B, A, U

use crate::equations::{FrameMatrices, separate};
use crate::modes::{ModeError, StaticLinearization};
use crate::problem::StaticProblem;
use nalgebra::{Complex, DMatrix, DVector};
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Block, Entries, SparseMatrix};
use vi_core::{Configuration, MechanicalSystem};
use vi_multibody::sparse_nodal::VelocityLayout;

/// Modes that modal damping lists of a large system.
const LISTED: usize = 60;
/// Degrees of freedom beyond which only the lowest modes are listed.
const LARGE: usize = 300;

/// Damping beside that of the system itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AddedDamping {
    /// `α` (1/s) and `β` (s) of `α M + β K`.
    pub rayleigh: [f64; 2],
    /// `ζ` of the vibrations, slowest first; the last one is that of all further ones.
    pub ratios: Vec<f64>,
}

impl AddedDamping {
    /// Of these numbers.
    ///
    /// # Errors
    /// What they are to be, where they are not.
    pub fn new(rayleigh: [f64; 2], ratios: Vec<f64>) -> Result<Self, &'static str> {
        if !rayleigh.iter().all(|x| *x >= 0.0 && x.is_finite()) {
            return Err("write two numbers that are not negative, such as 0.1:1e-4 (1/s and s)");
        }
        if !ratios.iter().all(|ratio| (0.0..1.0).contains(ratio)) {
            return Err("write a damping ratio from 0 to below 1, such as 0.02");
        }
        Ok(Self { rayleigh, ratios })
    }
}

/// The linear equations about a state, ready for any frequency.
pub struct HarmonicResponse {
    matrices: FrameMatrices,
    layout: VelocityLayout,
    rayleigh: [f64; 2],
    further: f64,    // ζ of modes beyond the list
    U: DMatrix<f64>, // M x_k
    modal: Vec<f64>, // 2 ζ_k ω_k
    factors: Option<(SparseMatrix, SparseLu)>,
}

impl std::fmt::Debug for HarmonicResponse {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("HarmonicResponse")
            .field("damped", &self.modal.len())
            .finish_non_exhaustive()
    }
}

impl StaticProblem {
    /// The equations of the harmonic response at the last equilibrium.
    ///
    /// # Errors
    /// [`ModeError`] where modal damping asks for modes that are not found.
    pub fn harmonic_response(
        &mut self,
        damping: &AddedDamping,
    ) -> Result<HarmonicResponse, ModeError> {
        let (mut U, mut modal) = (DMatrix::zeros(self.work.unknowns(), 0), Vec::new());
        self.work.balance(&mut self.x).map_err(|_| ModeError::NotFinite)?;
        if let Some(last) = damping.ratios.last() {
            let dof = self.work.unknowns() - self.work.rows.len();
            let linear = match dof > LARGE {
                true => StaticLinearization::lowest(self, LISTED.max(damping.ratios.len()))?,
                false => StaticLinearization::all(self)?,
            };
            let modes = linear.modes_without_confirmation()?;
            let vibrations =
                (0..modes.squared.len()).filter(|&k| modes.squared[k] > modes.noise[k]);
            let mut columns = Vec::new();
            for (k, mode) in vibrations.enumerate() {
                let ratio = damping.ratios.get(k).unwrap_or(last);
                modal.push(2.0 * ratio * modes.omega[mode]);
                columns.push(self.work.mass_times(modes.shapes.column(mode).as_slice()));
            }
            if !columns.is_empty() {
                U = DMatrix::from_columns(&columns);
            }
            // the state once more: the modes have evaluated other things
            self.work.balance(&mut self.x).map_err(|_| ModeError::NotFinite)?;
        }
        let matrices = self.work.frame_matrices();
        let layout = separate(&self.work.mechanism);
        let further = damping.ratios.last().copied().unwrap_or(0.0);
        let rayleigh = damping.rayleigh;
        Ok(HarmonicResponse { matrices, layout, rayleigh, further, U, modal, factors: None })
    }

    /// `M r`, kg and kg·m, shape `n`, of a translation `r` of everything along a direction: the
    /// amplitude of the force of inertia is `ω²` times it where the ground moves by 1 m.
    #[must_use]
    pub fn inertia_of_translation(&self, direction: [f64; 3]) -> Vec<f64> {
        let mass = self.work.system.mass();
        let mut out = vec![0.0; mass.shape().0];
        mass.mul_add(1.0, &self.translation(direction), &mut out);
        out
    }

    /// `r`: the velocities of all coordinates where everything moves along a direction, shape `n`.
    #[must_use]
    pub fn translation(&self, direction: [f64; 3]) -> Vec<f64> {
        let description = self.work.mechanism.description();
        let (frames, size) = (12 * description.bodies.len(), description.dimension.max(1));
        let mut r = vec![0.0; self.work.s.q0.len()];
        let (of_frames, of_points) = r.split_at_mut(frames);
        of_frames.chunks_exact_mut(12).for_each(|frame| frame[..3].copy_from_slice(&direction));
        of_points.chunks_exact_mut(size).for_each(|x| x.copy_from_slice(&direction[..size]));
        r
    }

    /// `f(t, q) − ∇V(q)` at rest in the last equilibrium, N, shape `n`.
    #[must_use]
    pub fn applied_force(&self) -> Vec<f64> {
        let n = self.work.s.q0.len();
        let (rest, mut out) = (vec![0.0; n], vec![0.0; n]);
        let at = Configuration { t: self.work.t, ..self.work.s.start() };
        self.work.system.net_force(at.moving(&rest), &mut out);
        out.iter_mut().for_each(|f| *f = -*f);
        out
    }
}

impl HarmonicResponse {
    /// The complex amplitudes of all coordinates, shape `n`, under a force of amplitude `f`, N,
    /// shape `n`, at the angular frequency `omega`, rad/s.
    ///
    /// # Errors
    /// [`Singular`] at a resonance without damping, and for a motion without stiffness at 0 rad/s.
    pub fn amplitudes(
        &mut self,
        omega: f64,
        f: &[Complex<f64>],
    ) -> Result<Vec<Complex<f64>>, Singular> {
        let d = self.matrices.K.shape().0;
        let mut b = DVector::zeros(d);
        let parts = [f.iter().map(|f| f.re).collect::<Vec<_>>(), f.iter().map(|f| f.im).collect()];
        let [re, im] = parts.map(|part| {
            let mut out = vec![0.0; d];
            self.layout.pull_back(&self.matrices.columns, &part, &mut out);
            out
        });
        (0..d).for_each(|i| b[i] = Complex::new(re[i], im[i]));
        let x = self.solve(omega, &b)?;
        let [re, im] = [x.map(|x| x.re), x.map(|x| x.im)].map(|part| {
            let mut v = vec![0.0; self.layout.dim()];
            self.layout.velocity(&self.matrices.columns, part.as_slice(), &mut v);
            v
        });
        Ok(re.into_iter().zip(im).map(|(re, im)| Complex::new(re, im)).collect())
    }

    fn solve(
        &mut self,
        omega: f64,
        b: &DVector<Complex<f64>>,
    ) -> Result<DVector<Complex<f64>>, Singular> {
        let shared = 2.0 * self.further * omega; // of all modes, in the factors
        let beside: Vec<f64> = self.modal.iter().map(|c| omega * (c - shared)).collect();
        let count = if beside.iter().all(|c| *c == 0.0) { 0 } else { beside.len() };
        let mut right = DMatrix::zeros(b.len(), 1 + count);
        right.set_column(0, b);
        for k in 0..count {
            right.set_column(1 + k, &self.U.column(k).map(|u| Complex::new(u, 0.0)));
        }
        let found = self.solve_factors(omega, shared, &right)?;
        let x = found.column(0).into_owned();
        if count == 0 {
            return Ok(x);
        }
        // x = A⁻¹b − A⁻¹U (I + iωD UᵀA⁻¹U)⁻¹ iωD UᵀA⁻¹b
        let inverse = found.columns(1, count);
        let U = self.U.map(|u| Complex::new(u, 0.0));
        let iwD = |k: usize| Complex::new(0.0, beside[k]);
        let mut small = U.tr_mul(&inverse);
        let mut rest = U.tr_mul(&x);
        for k in 0..count {
            small.row_mut(k).apply(|entry| *entry *= iwD(k));
            small[(k, k)] += Complex::new(1.0, 0.0);
            rest[k] *= iwD(k);
        }
        let y = small.lu().solve(&rest).ok_or(Singular)?;
        Ok(x - inverse * y)
    }

    /// `X` of `(K + iω(C + (α + shared) M + β K) − ω² M) X + Bᵀ· = R`, `B X = 0`.
    fn solve_factors(
        &mut self,
        omega: f64,
        shared: f64,
        R: &DMatrix<Complex<f64>>,
    ) -> Result<DMatrix<Complex<f64>>, Singular> {
        let FrameMatrices { K, C, M, B, .. } = &self.matrices;
        let (d, m, columns) = (K.shape().0, B.shape().0, R.ncols());
        let half = d + m;
        let [alpha, beta] = self.rayleigh;
        let mut largest = f64::MIN_POSITIVE;
        K.for_each(|_, _, value| largest = largest.max(value.abs()));
        let scale = 1.0 / largest;
        let emit = |out: &mut dyn Entries| {
            let mut block = |row, column, scale, transposed, A: &SparseMatrix| {
                A.emit(&mut Block { into: out, row, column, scale, transposed });
            };
            for at in [0, half] {
                block(at, at, scale, false, K);
                block(at, at, -scale * omega * omega, false, M);
                block(at + d, at, 1.0, false, B);
                block(at, at + d, 1.0, true, B);
            }
            for (row, column, sign) in [(0, half, -scale * omega), (half, 0, scale * omega)] {
                block(row, column, sign, false, C);
                block(row, column, sign * (alpha + shared), false, M);
                block(row, column, sign * beta, false, K);
            }
        };
        match &mut self.factors {
            Some((matrix, _)) => matrix.refill(emit),
            None => {
                let matrix = SparseMatrix::assemble(2 * half, 2 * half, emit);
                let lu = SparseLu::new(&matrix)?;
                self.factors = Some((matrix, lu));
            }
        }
        let (matrix, lu) = self.factors.as_mut().expect("just written");
        let mut b = DMatrix::zeros(2 * half, columns);
        for (i, k) in (0..columns).flat_map(|k| (0..d).map(move |i| (i, k))) {
            (b[(i, k)], b[(half + i, k)]) = (scale * R[(i, k)].re, scale * R[(i, k)].im);
        }
        lu.solve(matrix, b.as_mut_slice())?;
        Ok(DMatrix::from_fn(d, columns, |i, k| Complex::new(b[(i, k)], b[(half + i, k)])))
    }
}
