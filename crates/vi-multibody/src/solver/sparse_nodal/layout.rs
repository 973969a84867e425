//! The velocity map of a tree, column by column, with the configuration at which it is taken.
//!
//! ```text
//! t_α = Σ_k J_αk ν_k,     J_child = (X J_parent, S)
//! ```
//! Letters: `J_αk` twist of member `α` by the unit rate of the unknown `k`. Source: theory §5.

#![allow(non_snake_case)] // J, T, B, D

use crate::mechanism::Mechanism;
use crate::pair::{Motion, PairKind, Transfer, Twist, VelocityMap};
use crate::tree::Tree;
use crate::tree::particle::ParticleTree;
use nalgebra::{DMatrix, Matrix3, Vector3, Vector6};
use std::ops::Range;
use vi_constraints::Constraints;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault};
use vi_rigid::{directors, null_space, rotation};

/// A frame or a particle: which coordinates it has and which unknowns move it.
#[derive(Clone, Debug)]
pub(super) struct Member {
    pub(super) first: usize,
    pub(super) size: usize,
    pub(super) columns: Range<usize>,
}

impl Member {
    /// `P_inᵀ w` of a frame (force and torque), `w` of a particle; `w(i)`: i-th component.
    pub(super) fn shrink(&self, q: &[f64], w: impl Fn(usize) -> f64) -> Vector6<f64> {
        let mut out = Vector6::zeros();
        (0..self.size.min(3)).for_each(|i| out[i] = w(i));
        for i in (3..self.size).step_by(3) {
            let d = &q[self.first + i..self.first + i + 3];
            let w = [w(i), w(i + 1), w(i + 2)];
            for k in 0..3 {
                let (l, m) = ((k + 1) % 3, (k + 2) % 3);
                out[3 + k] += d[l] * w[m] - d[m] * w[l];
            }
        }
        out
    }
}

/// The velocity map of all members at one configuration, column by column.
#[derive(Clone, Debug)]
pub struct Columns {
    pub(super) q: Vec<f64>,               // n  where P_in is taken
    pub(super) twists: Vec<Vector6<f64>>, // one for each member and each unknown that moves it
}

/// A tree of frames and particles as a sparse velocity map.
#[derive(Debug)]
pub struct VelocityLayout {
    tree: Tree,
    particles: ParticleTree,
    pub(super) members: Vec<Member>, // links in the order of the tree, then particles
    parents: Vec<Option<usize>>,     // of links
    roots: Vec<Option<usize>>,       // of links: their free root
    pub(super) unknowns: Vec<usize>, // unknown of each column
    dim: usize,                      // n
    dof: usize,                      // d
    maps: Vec<VelocityMap>,          // scratch, one for each link
    motions: Vec<Motion>,            // scratch
    particle_rows: Option<DMatrix<f64>>, // n × d scratch, where there are particles
}

impl VelocityLayout {
    /// The layout of a mechanism's spanning tree.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Self {
        let (tree, particles) = (mechanism.tree().clone(), mechanism.particle_tree().clone());
        let (n, d) = (Constraints::dim(mechanism), tree.dof() + particles.dof());
        let (mut members, mut unknowns) = (Vec::<Member>::new(), Vec::new());
        let mut roots: Vec<Option<usize>> = Vec::new();
        for link in tree.links() {
            roots.push(match link.parent {
                Some(parent) => roots[parent],
                None => (link.joint.kind == PairKind::Free).then_some(roots.len()),
            });
            let start = unknowns.len();
            if let Some(parent) = link.parent {
                unknowns.extend_from_within(members[parent].columns.clone());
            }
            unknowns.extend(link.offset..link.offset + link.dof());
            let columns = start..unknowns.len();
            members.push(Member { first: 12 * link.frame, size: 12, columns });
        }
        let description = mechanism.description();
        let count = description.particles.len();
        let mut particle_rows = None;
        if count > 0 {
            // which unknowns move a particle, from a configuration without symmetry
            let mut probe = DMatrix::zeros(n, d);
            let scattered: Vec<f64> = (0..n).map(|i| (1.0 + i as f64).sqrt().fract()).collect();
            particles.null_space(&scattered, &mut probe);
            for k in 0..count {
                let (first, size) = (mechanism.particle_offset(k), description.dimension);
                let start = unknowns.len();
                unknowns.extend((0..d).filter(|&j| probe.view((first, j), (size, 1)).amax() > 0.0));
                let columns = start..unknowns.len();
                members.push(Member { first, size, columns });
            }
            particle_rows = Some(probe);
        }
        let links = tree.links().len();
        Self {
            roots,
            parents: tree.links().iter().map(|link| link.parent).collect(),
            maps: vec![VelocityMap::new(Transfer::None, &[]); links],
            motions: vec![Motion::rest(); links],
            dim: n,
            dof: d,
            tree,
            particles,
            members,
            unknowns,
            particle_rows,
        }
    }

    /// Number of coordinates, `n`.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Number of unknowns, `d`.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Units and scales of the unknowns.
    #[must_use]
    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks = self.tree.blocks();
        blocks.extend(self.particles.blocks());
        blocks
    }

    /// Storage for the columns at one configuration.
    #[must_use]
    pub fn columns(&self) -> Columns {
        Columns { q: vec![0.0; self.dim], twists: vec![Vector6::zeros(); self.unknowns.len()] }
    }

    /// `out ← P(q)`.
    pub fn null_space(&mut self, q: &[f64], out: &mut Columns) {
        self.tree.velocity_maps(q, &mut self.maps);
        if let Some(rows) = &mut self.particle_rows {
            rows.fill(0.0);
            self.particles.null_space(q, rows);
        }
        self.write(q, out);
    }

    /// `out ← P_in(q) P_ex` with `P_ex` of the given velocity maps, one for each link: discrete null spaces
    /// from averaged vectors.
    pub fn with_maps(&mut self, q: &[f64], maps: &[VelocityMap], out: &mut Columns) {
        self.maps.copy_from_slice(maps);
        if let Some(rows) = &mut self.particle_rows {
            rows.fill(0.0);
            self.particles.null_space(q, rows);
        }
        self.write(q, out);
    }

    /// `out ← ∂F_d/∂u (u, q_n)` for a reparametrized interval.
    pub fn tangent(&mut self, u: &[f64], s: &Interval, out: &mut Columns) {
        self.tree.tangents(u, &s.q1, &mut self.maps);
        if let Some(rows) = &mut self.particle_rows {
            rows.fill(0.0);
            self.particles.tangent(u, s, rows);
        }
        self.write(&s.q1, out);
    }

    fn write(&self, q: &[f64], out: &mut Columns) {
        out.q.copy_from_slice(q);
        for (k, map) in self.maps.iter().enumerate() {
            let mut at = self.members[k].columns.start;
            if let Some(parent) = self.parents[k] {
                for c in self.members[parent].columns.clone() {
                    out.twists[at] =
                        map.transfer.apply(&Twist::from_vector(&out.twists[c])).to_vector();
                    at += 1;
                }
            }
            for column in map.columns() {
                out.twists[at] = column.to_vector();
                at += 1;
            }
        }
        let Some(rows) = &self.particle_rows else { return };
        for member in &self.members[self.maps.len()..] {
            for c in member.columns.clone() {
                let row = |i: usize| rows[(member.first + i, self.unknowns[c])];
                out.twists[c] = Vector6::zeros();
                (0..member.size).for_each(|i| out.twists[c][i] = row(i));
            }
        }
    }

    /// `F_d(u, q_n)`: writes and closes the interval.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    pub fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.tree.reparametrize(u, s, &mut self.motions)?;
        self.particles.reparametrize(u, s)?;
        s.close();
        Ok(())
    }

    /// `out ← Pᵀ w`, shape `d`.
    pub fn pull_back(&self, at: &Columns, w: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for member in &self.members {
            let wrench = member.shrink(&at.q, |i| w[member.first + i]);
            for c in member.columns.clone() {
                out[self.unknowns[c]] += at.twists[c].dot(&wrench);
            }
        }
    }

    /// The unknowns that move a link, and the twists they give it; without those that move the link `apex`,
    /// which must be its ancestor (or itself).
    pub(super) fn for_each_column(
        &self,
        at: &Columns,
        (link, apex): (usize, Option<usize>),
        mut visit: impl FnMut(usize, Twist),
    ) {
        // what moves the carrier comes first
        let shared = apex.map_or(0, |apex| self.members[apex].columns.len());
        for c in self.members[link].columns.clone().skip(shared) {
            visit(self.unknowns[c], Twist::from_vector(&at.twists[c]));
        }
    }

    /// `out ← P ν`, shape `n`.
    pub fn velocity(&self, at: &Columns, nu: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for member in &self.members {
            let mut twist = Vector6::zeros();
            for c in member.columns.clone() {
                twist += nu[self.unknowns[c]] * at.twists[c];
            }
            let own = member.first..member.first + member.size;
            if member.size == 12 {
                null_space::push_forward(&at.q[own.clone()], &twist, &mut out[own]);
            } else {
                out[own].copy_from_slice(&twist.as_slice()[..member.size]);
            }
        }
    }

    /// Free roots: `(u_φ, θ) ← (T(D y_θ) D y_φ, D y_θ)` with the triad `D` of the root at `q`.
    pub(super) fn screws_to_increments(&self, q: &[f64], y: &mut [f64]) {
        for link in self.tree.links().iter().filter(|link| link.joint.kind == PairKind::Free) {
            let own = &mut y[link.offset..link.offset + 6];
            let (w, theta) = screw(&directors::triad(&q[12 * link.frame..]), own);
            own[..3].copy_from_slice((rotation::tangent(&theta) * w).as_slice());
            own[3..].copy_from_slice(theta.as_slice());
        }
    }

    /// `J ← J ∂(u_φ, θ)/∂(y_φ, y_θ)` in the columns of free roots, at the screws `y` and the triads of
    /// `q`: `[T D, B D; 0, D]`, `B = ∂(T(θ)w)/∂θ`. Without `y`: at zero, without `B`.
    pub(super) fn chain_screws(&self, q: &[f64], y: Option<&[f64]>, at: &mut Columns) {
        for (member, root) in self.members.iter().zip(&self.roots) {
            let Some(root) = root else { continue };
            let link = &self.tree.links()[*root];
            let triad = directors::triad(&q[12 * link.frame..]);
            let (T, B) = match y {
                None => (Matrix3::identity(), Matrix3::zeros()),
                Some(y) => {
                    let (w, theta) = screw(&triad, &y[link.offset..link.offset + 6]);
                    (rotation::tangent(&theta), tangent_derivative(&theta, &w))
                }
            };
            let (TD, BD) = (T * triad, B * triad);
            // the unknowns of the root come first
            let own = &mut at.twists[member.columns.start..member.columns.start + 6];
            let J: [Vector6<f64>; 6] = std::array::from_fn(|k| own[k]);
            for k in 0..3 {
                own[k] = (0..3).map(|l| J[l] * TD[(l, k)]).sum();
                own[3 + k] = (0..3).map(|l| J[l] * BD[(l, k)] + J[3 + l] * triad[(l, k)]).sum();
            }
        }
    }

    /// See [`vi_constraints::Reparametrization::clean`].
    pub fn clean(&self, q: &mut [f64]) {
        self.tree.clean(q);
        self.particles.clean(q);
    }
}

/// `(w, θ) = (D y_φ, D y_θ)`.
fn screw(triad: &Matrix3<f64>, y: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    (triad * Vector3::new(y[0], y[1], y[2]), triad * Vector3::new(y[3], y[4], y[5]))
}

/// `B = ∂(T(θ)w)/∂θ` with `T = I + a θ̂ + b θ̂²`, `a = (1 − cos x)/x²`, `b = (x − sin x)/x³`, `x = |θ|`:
/// `B dθ = (a'/x θ×w + b'/x θ×(θ×w)) (θ·dθ) + a dθ×w + b (dθ×(θ×w) + θ×(dθ×w))`.
fn tangent_derivative(theta: &Vector3<f64>, w: &Vector3<f64>) -> Matrix3<f64> {
    let square = theta.norm_squared();
    let x = square.sqrt();
    let (a, b) = (rotation::cosine_gap(x), rotation::sine_gap(x));
    // a'/x = (b x² − a − … ) has no accurate closed form near zero: series up to x = 1
    let (da, db) = if square < 1.0 {
        let series = |first: f64, step: f64| {
            // Σ (−1)^{k+1} (2k+2)/(2k+4)! x^{2k} and with (2k+5)!
            let (mut term, mut sum) = (first, 0.0);
            for k in 0..9 {
                let k = f64::from(k);
                sum -= (2.0 * k + 2.0) * term;
                term *= -square / ((2.0 * k + 5.0 + step) * (2.0 * k + 6.0 + step));
            }
            sum
        };
        (series(1.0 / 24.0, 0.0), series(1.0 / 120.0, 1.0))
    } else {
        let (sin, cos) = libm::sincos(x);
        ((sin / x - 2.0 * a) / square, ((1.0 - cos) / square - 3.0 * b) / square)
    };
    let hat = rotation::skew(theta);
    let (once, twice) = (hat * w, hat * (hat * w));
    let along = (da * once + db * twice) * theta.transpose();
    along - a * rotation::skew(w) - b * (rotation::skew(&once) + hat * rotation::skew(w))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_of_the_tangent_map() {
        let (direction, w) = (Vector3::new(0.6, -0.48, 0.64), Vector3::new(0.4, 1.1, -0.7));
        let mut worst = 0.0_f64;
        for angle in [0.0, 1e-3, 0.3, 0.999, 1.001, 2.0, 3.1] {
            let theta = angle * direction;
            let exact = tangent_derivative(&theta, &w);
            for k in 0..3 {
                let e = 1e-5 * Vector3::ith(k, 1.0);
                let change = rotation::tangent(&(theta + e)) - rotation::tangent(&(theta - e));
                worst = worst.max((change * w / 2e-5 - exact.column(k)).amax());
            }
        }
        println!("∂(T(θ)w)/∂θ off by {worst:.1e}");
        assert!(worst < 1e-9, "{worst:e}");
    }
}
