//! Multipliers of a tree by one sweep from the leaves to the roots.
//!
//! ```text
//! w_α + Ḡ_ααᵀ μ_α = 0   in least squares,     w_α = (h B)_α + Σ_{children β} Ḡ_βαᵀ μ_β
//! ```
//! `μ_α`: the internal constraints of a frame, `Ḡ_I`, and those of the joint that carries it,
//! `Ḡ_J`; both touch no other frame but the parent. The internal constraints do no work in the six
//! motions `P_in` of the frame, which take them out of the equations of the joint:
//! ```text
//! A = P_inᵀ Ḡ_Jᵀ,   K = P_inᵀ P_in,   (Aᵀ K⁻¹ A) μ_J = −Aᵀ K⁻¹ P_inᵀ w_α        at most 6 × 6
//! (Ḡ_I Ḡ_Iᵀ) μ_I = −Ḡ_I (w_α + Ḡ_Jᵀ μ_J)                                          6 × 6
//! ```
//! `O(N)`. At the root of the scheme the equations of a tree have exactly one
//! solution `μ = h²λ`, which the sweep finds; on the way there it differs from that of the least
//! squares over the whole system, and any `μ_k → μ*` serves Newton's method of the energy–momentum
//! schemes. The multipliers of a node of the variational schemes (36) are found by the same sweep,
//! with `G` in the place of `Ḡ` and `p̄_n + D_1 L_d + f_d^-` in that of `−h B`.
//!
//! From the roots to the leaves the same blocks give a solution of `G a = b`, least for each frame
//! in turn:
//! ```text
//! a_α = G_Iᵀ (G_I G_Iᵀ)⁻¹ b_I + P_in K⁻¹ A (Aᵀ K⁻¹ A)⁻¹ r        β the frame that carries α
//! r = b_J − G_αβ a_β − G_J G_Iᵀ (G_I G_Iᵀ)⁻¹ b_I
//! ```
//!
//! Letters: `Ḡ` discrete constraint Jacobian, `h B` what it balances; `α` a frame of the tree.

use crate::mechanism::Mechanism;
use nalgebra::{Cholesky, Const, Matrix3, SMatrix, SVector};
use vi_constraints::node_solvers::MultiplierSweep;
use vi_core::linear::Singular;
use vi_core::sparse::SparseMatrix;
use vi_rigid::directors::{FRAME, INTERNAL, PAIRS, internal_second_derivative};
use vi_rigid::null_space::{pull_back, push_forward};

/// The most constraints of a joint.
const JOINT: usize = 6;
/// The most constraints of a frame.
const BLOCK: usize = INTERNAL + JOINT;
/// In the place of a row of its own: the entry belongs to a constraint of another frame.
const OTHER: u8 = u8::MAX;

type Square = SMatrix<f64, 6, 6>;
type SquareFactors = Cholesky<f64, Const<6>>;
type FrameGradients = SMatrix<f64, FRAME, JOINT>;
type FrameCoordinates = SVector<f64, FRAME>;

/// The sweep, with its memory.
#[derive(Debug)]
pub struct TreeMultipliers {
    frames: Vec<usize>,    // in the order of the tree, root first
    rows: Vec<Vec<usize>>, // place of a frame → its constraints, internal ones first
    own: Vec<u8>, // entry of the Jacobian → row among those of the frame of its column, or OTHER
    mu: Vec<f64>, // m
}

/// The constraints of a frame in its own coordinates.
struct FrameConstraints {
    q: FrameCoordinates,       // its directors; 0 in the place of φ
    gradients: FrameGradients, // Ḡ_Jᵀ; 0 beyond the rows of the joint
    motions: Square,           // K⁻¹ A,  A = P_inᵀ Ḡ_Jᵀ
    joint: SquareFactors,      // of AᵀK⁻¹A; the identity beyond the rows of the joint
    internal: SquareFactors,   // of Ḡ_I Ḡ_Iᵀ
}

impl TreeMultipliers {
    /// For a mechanism; `None` when it is no tree of bodies.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        if mechanism.has_loops() || !mechanism.description().particles.is_empty() {
            return None;
        }
        let frames = mechanism.tree().links().iter().map(|link| link.frame).collect();
        Some(Self { frames, rows: Vec::new(), own: Vec::new(), mu: Vec::new() })
    }

    /// Fits the memory to a Jacobian. A constraint belongs to the last frame that it touches.
    fn fit(&mut self, jacobian: &SparseMatrix) {
        let (m, n) = jacobian.shape();
        if self.mu.len() == m {
            return;
        }
        let mut place = vec![0; n];
        for (k, frame) in self.frames.iter().enumerate() {
            place[FRAME * frame..FRAME * (frame + 1)].fill(k);
        }
        let mut owner = vec![0; m];
        jacobian.for_each(|i, j, _| owner[i] = owner[i].max(place[j]));
        self.rows = vec![Vec::new(); self.frames.len()];
        let mut row = vec![OTHER; m];
        for (i, &owner) in owner.iter().enumerate() {
            row[i] = self.rows[owner].len() as u8;
            self.rows[owner].push(i);
        }
        self.own.clear();
        jacobian
            .for_each(|i, j, _| self.own.push(if owner[i] == place[j] { row[i] } else { OTHER }));
        self.mu = vec![0.0; m];
    }

    /// The block of a frame, from its place.
    fn block(&self, jacobian: &SparseMatrix, k: usize) -> Result<FrameConstraints, Singular> {
        let (mut q, mut gradients) = (FrameCoordinates::zeros(), FrameGradients::zeros());
        for_each_entry(jacobian, &self.own, self.frames[k], |c, own, _, value| {
            match usize::from(own) {
                0..3 => q[c] = value, // of ½ (d_i · d_i − 1)
                own @ INTERNAL..BLOCK => gradients[(c, own - INTERNAL)] = value,
                _ => {}
            }
        });
        let joint = self.rows[k].len() - INTERNAL;
        if joint > JOINT {
            return Err(Singular);
        }
        let mut wrenches = Square::zeros();
        for r in 0..joint {
            let gradient: FrameCoordinates = gradients.column(r).into_owned();
            wrenches.set_column(r, &pull_back(q.as_slice(), gradient.as_slice()));
        }
        let directors = Matrix3::from_column_slice(&q.as_slice()[3..]);
        let spin =
            directors.norm_squared() * Matrix3::identity() - directors * directors.transpose();
        let inverse = spin.try_inverse().ok_or(Singular)?;
        let mut motions = wrenches;
        let turned = inverse * wrenches.fixed_rows::<3>(3);
        motions.fixed_rows_mut::<3>(3).copy_from(&turned);
        let mut normal = wrenches.tr_mul(&motions);
        (joint..JOINT).for_each(|r| normal[(r, r)] = 1.0);
        let joint = normal.cholesky().ok_or(Singular)?;
        let internal = internal_normal(&directors).cholesky().ok_or(Singular)?;
        Ok(FrameConstraints { q, gradients, motions, joint, internal })
    }

    /// `μ` from `Ḡ` (always of the same pattern) and `h B`, shape `m`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints of a frame are not independent.
    pub fn solve(&mut self, jacobian: &SparseMatrix, bracket: &[f64]) -> Result<&[f64], Singular> {
        self.fit(jacobian);
        for k in (0..self.frames.len()).rev() {
            let first = FRAME * self.frames[k];
            let mut w = FrameCoordinates::from_column_slice(&bracket[first..first + FRAME]);
            for_each_entry(jacobian, &self.own, self.frames[k], |c, own, i, value| {
                if own == OTHER {
                    w[c] += value * self.mu[i];
                }
            });
            let FrameConstraints { q, gradients, motions, joint, internal } =
                self.block(jacobian, k)?;
            let wrench = pull_back(q.as_slice(), w.as_slice());
            let of_joint = joint.solve(&-motions.tr_mul(&wrench));
            w += gradients * of_joint;
            let mut rest = [0.0; INTERNAL]; // Ḡ_I w
            internal_second_derivative(q.as_slice(), w.as_slice(), &mut rest);
            let of_frame = internal.solve(&-SVector::from(rest));
            for (&row, mu) in self.rows[k].iter().zip(of_frame.iter().chain(&of_joint)) {
                self.mu[row] = *mu;
            }
        }
        Ok(&self.mu)
    }
}

/// The symmetric matrix `Λ` of internal multipliers: `G_Iᵀ λ` is `D Λ` on the directors.
fn symmetric(lambda: &SVector<f64, INTERNAL>) -> Matrix3<f64> {
    let mut matrix = Matrix3::from_diagonal(&lambda.fixed_rows::<3>(0).into_owned());
    for ((i, j), lambda) in PAIRS.into_iter().zip(&lambda.as_slice()[3..]) {
        (matrix[(i, j)], matrix[(j, i)]) = (*lambda, *lambda);
    }
    matrix
}

/// `G_I G_Iᵀ`: of unit multipliers one after the other.
fn internal_normal(directors: &Matrix3<f64>) -> Square {
    let gram = directors.tr_mul(directors);
    let mut normal = Square::zeros();
    for k in 0..INTERNAL {
        let forces = gram * symmetric(&SVector::ith(k, 1.0)); // Dᵀ (G_Iᵀ e_k)
        for i in 0..3 {
            normal[(i, k)] = forces[(i, i)];
        }
        for (row, (i, j)) in PAIRS.into_iter().enumerate() {
            normal[(3 + row, k)] = forces[(i, j)] + forces[(j, i)];
        }
    }
    normal
}

/// Visits the entries in the columns of a frame: coordinate, own row or [`OTHER`], constraint,
/// value.
#[inline]
fn for_each_entry(
    jacobian: &SparseMatrix,
    own: &[u8],
    frame: usize,
    mut visit: impl FnMut(usize, u8, usize, f64),
) {
    let starts = &jacobian.column_pointers()[FRAME * frame..][..=FRAME];
    let (rows, values) = (jacobian.as_sprs().indices(), jacobian.as_sprs().data());
    for c in 0..FRAME {
        let entries = starts[c]..starts[c + 1];
        let places = rows[entries.clone()].iter().zip(&values[entries.clone()]);
        for (own, (row, value)) in own[entries].iter().zip(places) {
            visit(c, *own, *row, *value);
        }
    }
}

impl MultiplierSweep for TreeMultipliers {
    fn multipliers(
        &mut self,
        jacobian: &SparseMatrix,
        w: &[f64],
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        lambda.copy_from_slice(self.solve(jacobian, w)?); // Gᵀμ = −w
        lambda.iter_mut().for_each(|l| *l = -*l);
        Ok(())
    }

    fn particular(
        &mut self,
        jacobian: &SparseMatrix,
        b: &[f64],
        a: &mut [f64],
    ) -> Result<(), Singular> {
        self.fit(jacobian);
        self.mu.copy_from_slice(b); // less what the frames before contribute
        for k in 0..self.frames.len() {
            let FrameConstraints { q, gradients, motions, joint, internal } =
                self.block(jacobian, k)?;
            let b = |r: usize| self.rows[k].get(r).map_or(0.0, |&row| self.mu[row]);
            let weights = internal.solve(&SVector::from(std::array::from_fn(&b)));
            let mut own = FrameCoordinates::zeros(); // G_Iᵀ (G_I G_Iᵀ)⁻¹ b_I
            let directors = Matrix3::from_column_slice(&q.as_slice()[3..]);
            let strains = directors * symmetric(&weights);
            own.as_mut_slice()[3..].copy_from_slice(strains.as_slice());
            let rest = SVector::from(std::array::from_fn(|r| b(INTERNAL + r)));
            let twist = motions * joint.solve(&(rest - gradients.tr_mul(&own)));
            let mut motion = [0.0; FRAME];
            push_forward(q.as_slice(), &twist, &mut motion);
            own += FrameCoordinates::from(motion);
            let first = FRAME * self.frames[k];
            a[first..first + FRAME].copy_from_slice(own.as_slice());
            for_each_entry(jacobian, &self.own, self.frames[k], |c, whose, i, value| {
                if whose == OTHER {
                    self.mu[i] -= value * own[c];
                }
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Inertia, MechanismBuilder};
    use crate::pair::PairKind;
    use crate::pair::joint::FrameId;
    use nalgebra::DVector;
    use vi_constraints::Constraints;
    use vi_core::sparse::Entries;

    /// One body on each kind of joint, off the constraints: directors that are neither of unit
    /// length nor orthogonal, as averaged ones are, and forces that no constraint force balances.
    #[test]
    fn a_frame_has_the_multipliers_and_the_acceleration_of_least_squares() {
        let kinds = [PairKind::Free, PairKind::Spherical, PairKind::Revolute, PairKind::Fixed];
        for kind in kinds.into_iter().chain([PairKind::Cylindrical, PairKind::Planar]) {
            let mut builder = MechanismBuilder::new();
            let body = builder.body("body", Inertia::principal(1.0, [1.0; 3])).id();
            let joint = builder.joint("joint", kind, FrameId::Ground, body);
            joint.at([0.3, -0.2, 0.5]).axis([0.0, 0.6, 0.8]);
            let mechanism = builder.build().unwrap().mechanism;
            let (m, n) = (mechanism.len(), mechanism.dim());
            let noise = |k: usize, i: usize| libm::sin(12.9 * (k * n + i + 1) as f64);
            let rest = mechanism.description().configuration();
            let q: Vec<f64> = (0..n).map(|i| rest[i] + 0.3 * noise(0, i)).collect();
            let g = SparseMatrix::assemble(m, n, |out: &mut dyn Entries| {
                mechanism.jacobian(0.0, &q, out)
            });
            let w: Vec<f64> = (0..n).map(|i| noise(1, i)).collect();
            let b: Vec<f64> = (0..m).map(|i| noise(2, i)).collect();
            let mut sweep = TreeMultipliers::new(&mechanism).unwrap();
            let mu = DVector::from_column_slice(sweep.solve(&g, &w).unwrap());
            let mut a = vec![0.0; n];
            sweep.particular(&g, &b, &mut a).unwrap();
            let inverse = g.to_dense().pseudo_inverse(1e-12).unwrap();
            let off_mu = (mu + inverse.tr_mul(&DVector::from_vec(w))).norm();
            let off_a = (DVector::from_vec(a) - inverse * DVector::from_vec(b)).norm();
            println!("{kind:?}: off by {off_mu:.1e}, {off_a:.1e}");
            assert!(off_mu < 1e-12 && off_a < 1e-12, "{kind:?}: {off_mu:e}, {off_a:e}");
        }
    }
}
