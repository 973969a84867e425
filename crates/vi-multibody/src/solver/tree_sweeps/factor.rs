//! Articulated factorization and solution at all control points.
//!
//! ```text
//! A_α = P_inᵀ M_α P_in = diag(m I, Σ_I E_I (|d_I|² I − d_I d_Iᵀ))
//! D = Sᵀ Â S,   U = Â S D⁻¹,   Â_parent += Xᵀ (Â − U D Uᵀ) X                                       leaf → root
//! e = ρ − Sᵀ p,   p_parent += Xᵀ (p + U e)                                                          leaf → root
//! ν = D⁻¹ e − Uᵀ X t_parent,   t = X t_parent + S ν                                                 root → leaf
//! ```
//! `P(q_j)ᵀ M P(q_j)` is symmetric: unknowns are twists `ν_j`, and `δu_j = T_j⁻¹ ν_j`.
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms, §7.
#![allow(non_snake_case)] // A, D, U

use super::link::Link;
use crate::geometry::lane_vectors::{Screw, Transfer, Vector, three};
use crate::geometry::space::Vector as _;
use crate::pair::MAX_DOF;
use vi_core::lanes::{Lanes, Register};
use vi_core::newton::Fault;

/// A column of `S` with that of `U`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column<L> {
    pub s: Screw<L>,
    pub u: Screw<L>,
}

/// A symmetric 6×6 matrix on twists.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inertia<L> {
    ll: [L; 6],         // xx, xy, xz, yy, yz, zz
    la: [Vector<L>; 3], // rows
    aa: [L; 6],
}

/// Product of a symmetric matrix and a vector.
#[inline(always)]
fn symmetric<L: Lanes>(m: &[L; 6], v: &Vector<L>) -> Vector<L> {
    let [x, y, z] = v.0;
    Vector([
        m[0] * x + m[1] * y + m[2] * z,
        m[1] * x + m[3] * y + m[4] * z,
        m[2] * x + m[4] * y + m[5] * z,
    ])
}

/// The rows of a symmetric matrix.
#[inline(always)]
fn rows<L: Lanes>(m: &[L; 6]) -> [Vector<L>; 3] {
    [Vector([m[0], m[1], m[2]]), Vector([m[1], m[3], m[4]]), Vector([m[2], m[4], m[5]])]
}

/// Column `j` of a matrix of rows.
#[inline(always)]
fn column<L: Lanes>(m: &[Vector<L>; 3], j: usize) -> Vector<L> {
    Vector([m[0].0[j], m[1].0[j], m[2].0[j]])
}

#[inline(always)]
fn sub_outer<L: Lanes>(m: &mut [L; 6], x: &Vector<L>, y: &Vector<L>) {
    let (x, y) = (&x.0, &y.0);
    m[0] = m[0] - x[0] * y[0];
    m[1] = m[1] - x[0] * y[1];
    m[2] = m[2] - x[0] * y[2];
    m[3] = m[3] - x[1] * y[1];
    m[4] = m[4] - x[1] * y[2];
    m[5] = m[5] - x[2] * y[2];
}

impl<L: Lanes> Inertia<L> {
    /// Zero.
    #[inline(always)]
    pub(super) fn zero(lanes: impl Register<Lanes = L>) -> Self {
        let zero = lanes.splat(0.0);
        Self { ll: [zero; 6], la: [Vector([zero; 3]); 3], aa: [zero; 6] }
    }

    /// `self += P_inᵀ M_α P_in` with the masses of the centre and of the directors.
    #[inline(always)]
    pub(super) fn add_body(
        &mut self,
        lanes: impl Register<Lanes = L>,
        mass: &[f64; 4],
        d: &[Vector<L>; 3],
    ) {
        for k in [0, 3, 5] {
            self.ll[k] = self.ll[k] + lanes.splat(mass[0]);
        }
        for i in 0..3 {
            let scaled = d[i] * mass[1 + i];
            let trace = scaled.dot(d[i]);
            sub_outer(&mut self.aa, &scaled, &d[i]);
            for k in [0, 3, 5] {
                self.aa[k] = self.aa[k] + trace;
            }
        }
    }

    #[inline(always)]
    fn mul(&self, t: &Screw<L>) -> Screw<L> {
        let v = t.angular;
        let across = Vector([self.la[0].dot(v), self.la[1].dot(v), self.la[2].dot(v)]);
        let [x, y, z] = t.linear.0;
        Screw {
            linear: symmetric(&self.ll, &t.linear) + across,
            angular: self.la[0].scaled(x)
                + self.la[1].scaled(y)
                + self.la[2].scaled(z)
                + symmetric(&self.aa, &t.angular),
        }
    }

    /// `self −= x yᵀ`, where the sum over the joint is symmetric.
    #[inline(always)]
    fn sub_outer(&mut self, x: &Screw<L>, y: &Screw<L>) {
        sub_outer(&mut self.ll, &x.linear, &y.linear);
        sub_outer(&mut self.aa, &x.angular, &y.angular);
        for i in 0..3 {
            self.la[i] = self.la[i] - y.angular.scaled(x.linear.0[i]);
        }
    }

    /// `out ← out + Xᵀ A X`.
    #[inline(always)]
    fn add_congruence(
        mut self,
        lanes: impl Register<Lanes = L>,
        transfer: Transfer,
        c: &Vector<L>,
        out: &mut Self,
    ) {
        let zero = Self::zero(lanes);
        match transfer {
            Transfer::None => return,
            Transfer::Point => (self.la, self.aa) = (zero.la, zero.aa),
            Transfer::Rigid => {}
        }
        let (ll, mut la) = (rows(&self.ll), self.la);
        for i in 0..3 {
            la[i] = la[i] + c.cross(ll[i]); // A_la − A_ll ĉ
        }
        // A_aa + ĉ A_la' − A_laᵀ ĉ
        let left = three(
            #[inline(always)]
            |j| c.cross(column(&la, j)),
        );
        let right = three(
            #[inline(always)]
            |j| c.cross(column(&self.la, j)),
        );
        let mut at = 0;
        for i in 0..3 {
            for j in i..3 {
                out.aa[at] = out.aa[at] + (self.aa[at] + left[j].0[i] + right[i].0[j]);
                at += 1;
            }
            out.la[i] = out.la[i] + la[i];
        }
        for k in 0..6 {
            out.ll[k] = out.ll[k] + self.ll[k];
        }
    }
}

/// Eliminates the joint of a link: its `Â` is complete, that of its parent grows. `columns` and
/// `inverse` are its own.
#[inline(always)]
pub(super) fn eliminate<R: Register>(
    lanes: R,
    link: &Link,
    A: &Inertia<R::Lanes>,
    arm: &Vector<R::Lanes>,
    (columns, inverse): (&mut [Column<R::Lanes>], &mut [R::Lanes]),
    parent: &mut Inertia<R::Lanes>,
) -> Result<(), Fault> {
    let f = link.dof;
    let mut AS = [Screw::zero(lanes); MAX_DOF];
    for i in 0..f {
        AS[i] = A.mul(&columns[i].s);
        for j in 0..=i {
            let entry = columns[j].s.dot(AS[i]);
            (inverse[i * f + j], inverse[j * f + i]) = (entry, entry);
        }
    }
    invert(lanes, inverse, f)?;
    let mut reduced = *A;
    for i in 0..f {
        let mut u = Screw::zero(lanes);
        for j in 0..f {
            u = u.plus(AS[j].times(inverse[i * f + j]));
        }
        columns[i].u = u;
        reduced.sub_outer(&u, &AS[i]);
    }
    reduced.add_congruence(lanes, link.transfer, arm, parent);
    Ok(())
}

/// Inverts a positive definite `f × f` matrix by Gauss–Jordan elimination on its diagonal.
#[inline(always)]
fn invert<R: Register>(lanes: R, m: &mut [R::Lanes], f: usize) -> Result<(), Fault> {
    for k in 0..f {
        let pivot = lanes.splat(1.0).over(m[k * f + k]);
        for lane in 0..R::Lanes::COUNT {
            if !(pivot.at(lane) > 0.0 && pivot.at(lane).is_finite()) {
                return Err(Fault::SingularTangent);
            }
        }
        m[k * f + k] = lanes.splat(1.0);
        for j in 0..f {
            m[k * f + j] = m[k * f + j] * pivot;
        }
        for i in 0..f {
            if i != k {
                let factor = m[i * f + k];
                m[i * f + k] = lanes.splat(0.0);
                for j in 0..f {
                    m[i * f + j] = m[i * f + j] - factor * m[k * f + j];
                }
            }
        }
    }
    Ok(())
}

/// Leaf → root at a link with the wrench `p` of its children and its right-hand side in `x`, which
/// becomes `D⁻¹ e`; returns what is transmitted, at the link.
#[inline(always)]
pub(super) fn transmit<R: Register>(
    columns: &[Column<R::Lanes>],
    inverse: &[R::Lanes],
    mut p: Screw<R::Lanes>,
    x: &mut [R::Lanes],
) -> Screw<R::Lanes> {
    let f = columns.len();
    let own = p;
    for i in 0..f {
        x[i] = x[i] - columns[i].s.dot(own);
        p = p.plus(columns[i].u.times(x[i]));
    }
    if f <= 1 {
        for x in x.iter_mut() {
            *x = inverse[0] * *x;
        }
        return p;
    }
    let mut e = [x[0]; MAX_DOF];
    e[..f].copy_from_slice(x);
    for i in 0..f {
        x[i] = inverse[i * f] * e[0];
        for j in 1..f {
            x[i] = x[i] + inverse[i * f + j] * e[j];
        }
    }
    p
}

/// Root → leaf at a link with what it inherits, `X t_parent`: `x ← ν`; returns its twist.
#[inline(always)]
pub(super) fn receive<R: Register>(
    columns: &[Column<R::Lanes>],
    inherited: Screw<R::Lanes>,
    x: &mut [R::Lanes],
) -> Screw<R::Lanes> {
    let mut t = inherited;
    for (x, column) in x.iter_mut().zip(columns) {
        *x = *x - column.u.dot(inherited);
        t = t.plus(column.s.times(*x));
    }
    t
}
