//! Multipliers of a tree by one sweep from the leaves to the roots.
//!
//! ```text
//! w_α + Ḡ_ααᵀ μ_α = 0   in least squares,     w_α = (h B)_α + Σ_{children β} Ḡ_βαᵀ μ_β
//! (Ḡ_αα Ḡ_ααᵀ) μ_α = −Ḡ_αα w_α              at most 12 × 12 for each frame
//! ```
//! `μ_α`: the internal constraints of a frame and those of the joint that carries it; both touch no other
//! frame but the parent. `O(N)`. At the root of the scheme the equations of a tree have exactly one
//! solution `μ = h²λ`, which the sweep finds; on the way there it differs from that of the least squares
//! over the whole system, and any `μ_k → μ*` serves Newton's method of the energy–momentum schemes. The multipliers
//! of a node of the variational schemes (36) are found by the same sweep, with `G` in the place of `Ḡ` and
//! `p̄_n + D_1 L_d + f_d^-` in that of `−h B`.
//!
//! From the roots to the leaves the same blocks give a solution of `G a = b`, least for each frame in turn:
//! ```text
//! a_α = G_ααᵀ (G_αα G_ααᵀ)⁻¹ (b_α − G_αβ a_β)        β the frame that carries α
//! ```
//!
//! Letters: `Ḡ` discrete constraint Jacobian, `h B` what it balances; `α` a frame of the tree.

use crate::mechanism::Mechanism;
use nalgebra::{Cholesky, Const, SMatrix, SVector};
use vi_constraints::node_solvers::MultiplierSweep;
use vi_core::linear::Singular;
use vi_core::sparse::SparseMatrix;

/// Coordinates of a frame, and the most constraints that it and its joint have.
const FRAME: usize = 12;

type Block = SMatrix<f64, FRAME, FRAME>;
type Factors = Cholesky<f64, Const<FRAME>>;

/// The sweep, with its memory.
#[derive(Debug)]
pub struct TreeMultipliers {
    frames: Vec<usize>,    // in the order of the tree, root first
    owner: Vec<usize>,     // constraint → place of its frame in that order
    row: Vec<usize>,       // constraint → row among those of its frame
    rows: Vec<Vec<usize>>, // place of a frame → its constraints
    mu: Vec<f64>,          // m
}

impl TreeMultipliers {
    /// For a mechanism; `None` when it is no tree of bodies.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        if mechanism.has_loops() || !mechanism.description().particles.is_empty() {
            return None;
        }
        let links = mechanism.tree().links();
        let frames = links.iter().map(|link| link.frame).collect();
        Some(Self { frames, owner: Vec::new(), row: Vec::new(), rows: Vec::new(), mu: Vec::new() })
    }

    /// Finds which frame a constraint belongs to: the last of those that it touches.
    fn analyse(&mut self, jacobian: &SparseMatrix) {
        let (m, n) = jacobian.shape();
        let mut place = vec![0; n];
        for (k, frame) in self.frames.iter().enumerate() {
            place[FRAME * frame..FRAME * (frame + 1)].fill(k);
        }
        self.owner = vec![0; m];
        jacobian.for_each(|i, j, _| self.owner[i] = self.owner[i].max(place[j]));
        self.rows = vec![Vec::new(); self.frames.len()];
        self.row = vec![0; m];
        for (i, &owner) in self.owner.iter().enumerate() {
            self.row[i] = self.rows[owner].len();
            self.rows[owner].push(i);
        }
        self.mu = vec![0.0; m];
    }

    /// `Ḡ_αα`, rows beyond those of the frame zero, and the factors of `Ḡ_αα Ḡ_ααᵀ`, there the identity.
    fn block(&self, jacobian: &SparseMatrix, k: usize) -> Result<(Block, Factors), Singular> {
        let mut own = Block::zeros();
        for (c, column) in self.columns(k).enumerate() {
            for (i, value) in jacobian.column(column).filter(|(i, _)| self.owner[*i] == k) {
                own[(self.row[i], c)] = value;
            }
        }
        let mut normal = own * own.transpose();
        (self.rows[k].len()..FRAME).for_each(|i| normal[(i, i)] = 1.0);
        Ok((own, normal.cholesky().ok_or(Singular)?))
    }

    /// The coordinates of a frame, from its place.
    fn columns(&self, k: usize) -> std::ops::Range<usize> {
        FRAME * self.frames[k]..FRAME * (self.frames[k] + 1)
    }

    /// Fits the memory to a Jacobian.
    fn fit(&mut self, jacobian: &SparseMatrix) {
        if self.owner.len() != jacobian.shape().0 {
            self.analyse(jacobian);
        }
    }

    /// `μ` from `Ḡ` (always of the same pattern) and `h B`, shape `m`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints of a frame are not independent.
    pub fn solve(&mut self, jacobian: &SparseMatrix, bracket: &[f64]) -> Result<&[f64], Singular> {
        self.fit(jacobian);
        for k in (0..self.frames.len()).rev() {
            let (own, normal) = self.block(jacobian, k)?;
            let mut w = SVector::<f64, FRAME>::zeros();
            for (c, column) in self.columns(k).enumerate() {
                let others = jacobian.column(column).filter(|(i, _)| self.owner[*i] != k);
                w[c] = others.fold(bracket[column], |w, (i, value)| w + value * self.mu[i]);
            }
            let mu = normal.solve(&-(own * w));
            for (&i, mu) in self.rows[k].iter().zip(&mu) {
                self.mu[i] = *mu;
            }
        }
        Ok(&self.mu)
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
            let (own, normal) = self.block(jacobian, k)?;
            let mut rest = SVector::<f64, FRAME>::zeros();
            for (rest, &i) in rest.iter_mut().zip(&self.rows[k]) {
                *rest = self.mu[i];
            }
            let least = own.tr_mul(&normal.solve(&rest));
            for (column, x) in self.columns(k).zip(&least) {
                a[column] = *x;
                for (i, value) in jacobian.column(column).filter(|(i, _)| self.owner[*i] != k) {
                    self.mu[i] -= value * x;
                }
            }
        }
        Ok(())
    }
}
