//! Coordinates of a node of a tree: a product of exponentials about a reference configuration.
//!
//! ```text
//! H_b = [d_1 d_2 d_3 φ; 0 0 0 1]       a frame;        Ŝ = [ω̂ v; 0 0]     the screw of an unknown, in space
//! H_b(ξ) = Π_{j on the path to b} exp(Ŝ⁰_j ξ_j) H_b(q̂),       Ŝ_j(ξ) = Ad(Π_{i before j} exp(Ŝ⁰_i ξ_i)) Ŝ⁰_j
//! K_j = ∂q/∂ξ_j       of frame b: Ŝ_j H_b          j, k, l on the path to b, 0 otherwise
//! K_jk                            Ŝ_j Ŝ_k H_b       for j before k, or equal
//! K_jkl                           Ŝ_j Ŝ_k Ŝ_l H_b   for j before k before l, or equal
//! ```
//! so all derivatives are products of screws in the order of the path. `Ŝ⁰_j` are the columns of
//! `P(q̂)`: joints hold for every `ξ`, and `ξ` adds up along revolute, prismatic, cylindrical and
//! screw joints. At `ξ = 0` the columns `K` are those of `P`; they span the same tangent space
//! wherever the second of three rotations of a spherical or free joint is below `π/2`.
//!
//! With `V_b` the components of a covector `v` at `b`, `N_l = Σ_{b moved by l} V_b H_bᵀ` and the
//! Frobenius product:
//! ```text
//! v·K_l = ⟨N_l, Ŝ_l⟩,     v·K_kl = ⟨N_l, Ŝ_k Ŝ_l⟩                                       k before l
//! Σ_j y_j v·K_jkl = ⟨N_l, (A_k Ŝ_k + Ŝ_k (C_l − A_k)) Ŝ_l⟩ + ⟨Σ_{j after l} y_j N_j Ŝ_jᵀ, Ŝ_k Ŝ_l⟩
//! Σ_j y_j K_jk   of frame b: (A_k Ŝ_k + Ŝ_k (C_b − A_k)) H_b
//! A_k = Σ_{j before k} y_j Ŝ_j,    C_l = A_l + y_l Ŝ_l,    C_b the same over the path to b
//! ```
//! Source of the product of exponentials: R. M. Murray, Z. Li, S. S. Sastry, A Mathematical
//! Introduction to Robotic Manipulation (1994), ch. 3.
#![allow(non_snake_case)] // H, S, N, A, C, K: the letters above

use nalgebra::{DMatrix, Matrix3, Matrix3x4, Matrix4, Vector3};
use vi_constraints::Reparametrization;
use vi_multibody::Mechanism;
use vi_multibody::tree_map::TreeMap;
use vi_rigid::{directors, rotation};

/// A screw: what a rate of one makes of all points of the frames it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ChartScrew {
    /// `ω`.
    turn: Vector3<f64>,
    /// `v`, the velocity of the origin of space.
    shift: Vector3<f64>,
}

/// A displacement `x ↦ R x + t`.
#[derive(Clone, Copy, Debug)]
struct Displacement {
    turn: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Displacement {
    fn identity() -> Self {
        Self { turn: Matrix3::identity(), shift: Vector3::zeros() }
    }

    /// `exp(Ŝ ξ)`.
    fn exponential(screw: &ChartScrew, xi: f64) -> Self {
        let angle = screw.turn * xi;
        Self { turn: rotation::exp(&angle), shift: rotation::tangent(&angle) * (screw.shift * xi) }
    }

    fn after(&self, other: &Self) -> Self {
        Self { turn: self.turn * other.turn, shift: self.turn * other.shift + self.shift }
    }

    /// `Ad`.
    fn carry(&self, screw: &ChartScrew) -> ChartScrew {
        let turn = self.turn * screw.turn;
        ChartScrew { turn, shift: self.turn * screw.shift + self.shift.cross(&turn) }
    }
}

impl ChartScrew {
    fn matrix(&self) -> Matrix4<f64> {
        let mut S = Matrix4::zeros();
        S.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation::skew(&self.turn));
        S.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.shift);
        S
    }
}

/// `⟨N, A⟩` of the first three rows.
fn product(N: &Matrix3x4<f64>, A: &Matrix4<f64>) -> f64 {
    N.dot(&A.fixed_view::<3, 4>(0, 0).into_owned())
}

/// `[d_1 d_2 d_3 φ]` of twelve numbers `(φ, d_1, d_2, d_3)`.
fn columns_of(q: &[f64]) -> Matrix3x4<f64> {
    Matrix3x4::from_fn(|i, j| q[if j == 3 { i } else { 3 + 3 * j + i }])
}

fn pose(q: &[f64]) -> Matrix4<f64> {
    let mut H = Matrix4::zeros();
    H.fixed_view_mut::<3, 4>(0, 0).copy_from(&columns_of(q));
    H[(3, 3)] = 1.0;
    H
}

fn write_columns(X: &Matrix4<f64>, out: &mut [f64]) {
    for i in 0..3 {
        out[i] = X[(i, 3)];
        (0..3).for_each(|j| out[3 + 3 * j + i] = X[(i, j)]);
    }
}

/// A link of the tree as the chart sees it.
#[derive(Clone, Debug)]
struct ChartLink {
    frame: usize,
    parent: Option<usize>,
    /// First unknown and the one after the last.
    unknowns: [usize; 2],
}

/// The structure of the charts of a tree.
#[derive(Debug)]
pub struct Chart {
    links: Vec<ChartLink>,      // root first
    before: Vec<Option<usize>>, // the unknown before each one on its path
    link_of: Vec<usize>,        // of each unknown
    last: Vec<Option<usize>>,   // the last unknown on the path to each link
    map: TreeMap,
    n: usize,
}

/// A reference configuration with its screws.
#[derive(Clone, Debug)]
pub struct ReferenceConfiguration {
    q: Vec<f64>,
    screws: Vec<ChartScrew>,
}

impl ReferenceConfiguration {
    /// `q̂`, shape `n`.
    pub fn q(&self) -> &[f64] {
        &self.q
    }
}

/// A node at its coordinates.
#[derive(Clone, Debug)]
pub struct PlacedNode {
    /// `q(ξ)`, shape `n`.
    pub q: Vec<f64>,
    /// `Ŝ_j`.
    screws: Vec<Matrix4<f64>>,
}

impl Chart {
    /// The charts of the spanning tree of a mechanism of rigid bodies.
    pub fn new(mechanism: &Mechanism, n: usize) -> Self {
        let tree = mechanism.tree();
        let d = tree.dof();
        let (mut before, mut link_of) = (vec![None; d], vec![0; d]);
        let mut last: Vec<Option<usize>> = Vec::new();
        let mut links = Vec::new();
        for (k, link) in tree.links().iter().enumerate() {
            let mut end = link.parent.and_then(|p| last[p]);
            for j in link.offset..link.offset + link.dof() {
                (before[j], link_of[j]) = (end, k);
                end = Some(j);
            }
            last.push(end);
            let unknowns = [link.offset, link.offset + link.dof()];
            links.push(ChartLink { frame: link.frame, parent: link.parent, unknowns });
        }
        Self { links, before, link_of, last, map: TreeMap::new(mechanism), n }
    }

    /// Degrees of freedom of the tree.
    pub fn dof(&self) -> usize {
        self.before.len()
    }

    /// The reference of `ξ` about `q̂`.
    pub fn reference(&self, q: &[f64]) -> ReferenceConfiguration {
        let mut P = DMatrix::zeros(self.n, self.dof());
        self.map.null_space(q, &mut P);
        let screw = |j: usize| {
            let at = 12 * self.links[self.link_of[j]].frame;
            let column = &P.as_slice()[j * self.n..(j + 1) * self.n];
            let (own, rate) = (&q[at..at + 12], &column[at..at + 12]);
            let turn = directors::angular_velocity(own, rate);
            ChartScrew {
                turn,
                shift: directors::center(rate) - turn.cross(&directors::center(own)),
            }
        };
        ReferenceConfiguration { q: q.to_vec(), screws: (0..self.dof()).map(screw).collect() }
    }

    /// `q(ξ)` and the screws there.
    pub fn place(&self, reference: &ReferenceConfiguration, xi: &[f64]) -> PlacedNode {
        let (mut q, mut screws) = (reference.q.clone(), vec![Matrix4::zeros(); self.dof()]);
        let mut moved: Vec<Displacement> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let mut at = link.parent.map_or_else(Displacement::identity, |p| moved[p]);
            for j in link.unknowns[0]..link.unknowns[1] {
                let own = &reference.screws[j];
                screws[j] = at.carry(own).matrix();
                at = at.after(&Displacement::exponential(own, xi[j])); // [2.42]
            }
            moved.push(at);
            let own = &mut q[12 * link.frame..12 * link.frame + 12];
            let center: Vector3<f64> = at.turn * directors::center(own) + at.shift;
            let triad = at.turn * directors::triad(own);
            directors::set_frame(own, &center, &triad);
        }
        PlacedNode { q, screws }
    }

    /// The unknowns from `j` back to the root, `j` first.
    fn back_from(&self, j: Option<usize>) -> impl Iterator<Item = usize> {
        std::iter::successors(j, |&j| self.before[j])
    }

    /// `K`, shape `n × d`.
    pub fn columns(&self, at: &PlacedNode) -> DMatrix<f64> {
        self.frame_columns(at, |j, _| at.screws[j])
    }

    /// `Σ_j y_j K_jk`, shape `n × d`.
    pub fn bent_columns(&self, at: &PlacedNode, y: &[f64]) -> DMatrix<f64> {
        let sums = self.sums(at, y);
        self.frame_columns(at, |k, end| {
            let (S, A) = (&at.screws[k], self.sum_before(&sums, k));
            A * S + S * (sums[end] - A)
        })
    }

    /// The columns `X_k H_b`, with `X_k` by the unknown `k` and the last one on the path to `b`.
    fn frame_columns(
        &self,
        at: &PlacedNode,
        matrix: impl Fn(usize, usize) -> Matrix4<f64>,
    ) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.n, self.dof());
        for (link, &end) in self.links.iter().zip(&self.last) {
            let own = 12 * link.frame..12 * link.frame + 12;
            let H = pose(&at.q[own.clone()]);
            for k in self.back_from(end) {
                let moved = matrix(k, end.unwrap_or(k)) * H;
                let column = &mut out.as_mut_slice()[k * self.n..(k + 1) * self.n];
                write_columns(&moved, &mut column[own.clone()]);
            }
        }
        out
    }

    /// `C_j` of each unknown.
    fn sums(&self, at: &PlacedNode, y: &[f64]) -> Vec<Matrix4<f64>> {
        let mut sums: Vec<Matrix4<f64>> = vec![Matrix4::zeros(); self.dof()];
        for link in &self.links {
            for j in link.unknowns[0]..link.unknowns[1] {
                sums[j] = self.sum_before(&sums, j) + at.screws[j] * y[j];
            }
        }
        sums
    }

    fn sum_before(&self, sums: &[Matrix4<f64>], j: usize) -> Matrix4<f64> {
        self.before[j].map_or_else(Matrix4::zeros, |i| sums[i])
    }

    /// `N` of each link.
    fn moments(&self, at: &PlacedNode, v: &[f64]) -> Vec<Matrix3x4<f64>> {
        let mut moments = vec![Matrix3x4::zeros(); self.links.len()];
        for (k, link) in self.links.iter().enumerate().rev() {
            let own = 12 * link.frame..12 * link.frame + 12;
            moments[k] += columns_of(&v[own.clone()]) * pose(&at.q[own]).transpose();
            if let Some(parent) = link.parent {
                let sum = moments[k];
                moments[parent] += sum;
            }
        }
        moments
    }

    /// `v·K_kl`, symmetric, shape `d × d`.
    pub fn curvature(&self, at: &PlacedNode, v: &[f64]) -> DMatrix<f64> {
        let moments = self.moments(at, v);
        self.pairs(|k, l| product(&moments[self.link_of[l]], &(at.screws[k] * at.screws[l])))
    }

    /// `Σ_j y_j v·K_jkl`, symmetric, shape `d × d`.
    pub fn third_derivative(&self, at: &PlacedNode, v: &[f64], y: &[f64]) -> DMatrix<f64> {
        let (d, moments, sums) = (self.dof(), self.moments(at, v), self.sums(at, y));
        let mut after = vec![Matrix3x4::zeros(); d]; // Σ_{j after l} y_j N_j Ŝ_jᵀ
        for link in self.links.iter().rev() {
            for j in (link.unknowns[0]..link.unknowns[1]).rev() {
                let own = y[j] * moments[self.link_of[j]] * at.screws[j].transpose();
                let sum: Matrix3x4<f64> = after[j] + own;
                if let Some(i) = self.before[j] {
                    after[i] += sum;
                }
            }
        }
        self.pairs(|k, l| {
            let (S_k, S_l, A) = (&at.screws[k], &at.screws[l], self.sum_before(&sums, k));
            let bent = A * S_k + S_k * (sums[l] - A);
            product(&moments[self.link_of[l]], &(bent * S_l)) + product(&after[l], &(S_k * S_l))
        })
    }

    /// A symmetric matrix by its entries of pairs on one path, the first before the second.
    fn pairs(&self, entry: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
        let d = self.dof();
        let mut out = DMatrix::zeros(d, d);
        for l in 0..d {
            for k in self.back_from(Some(l)) {
                let value = entry(k, l);
                (out[(k, l)], out[(l, k)]) = (value, value);
            }
        }
        out
    }
}
