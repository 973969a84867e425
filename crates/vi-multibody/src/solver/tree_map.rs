//! The reparametrization of a mechanism whose joints and bars form a tree, as dense matrices.

use crate::mechanism::Mechanism;
use crate::pair::{Motion, Transfer, Twist, VelocityMap};
use crate::tree::Tree;
use crate::tree::particle::ParticleTree;
use nalgebra::{DMatrix, Vector3};
use std::cell::RefCell;
use vi_constraints::Reparametrization;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault};
use vi_rigid::null_space;

crate::opaque_debug!(TreeMap);

/// `P`, `F_d` and `∂F_d/∂u` of the spanning tree.
pub struct TreeMap {
    tree: Tree,
    particles: ParticleTree,
    work: RefCell<Work>, // the trait's methods are `&self`; the scratch is not shared
}

struct Work {
    maps: Vec<VelocityMap>,
    twists: Vec<Twist>,
    motions: Vec<Motion>,
    nu: Vec<f64>,
}

impl TreeMap {
    /// The map of a mechanism's spanning tree.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Self {
        let (tree, particles) = (mechanism.tree().clone(), mechanism.particle_tree().clone());
        let links = tree.links().len();
        let work = Work {
            maps: vec![VelocityMap::new(Transfer::None, &[]); links],
            twists: vec![Twist::zero(); links],
            motions: vec![Motion::rest(); links],
            nu: vec![0.0; tree.dof()],
        };
        Self { tree, particles, work: RefCell::new(work) }
    }

    /// `out ← P(q)ᵀ w`, shape `d`; sweeps over bodies, dense over point masses.
    pub fn pull_back(&self, q: &[f64], w: &[f64], out: &mut [f64]) {
        let work = &mut *self.work.borrow_mut();
        out.fill(0.0);
        self.tree.velocity_maps(q, &mut work.maps);
        for (link, twist) in self.tree.links().iter().zip(&mut work.twists) {
            let own = 12 * link.frame..12 * link.frame + 12;
            let b = null_space::pull_back(&q[own.clone()], &w[own]);
            *twist = Twist::new(Vector3::new(b[0], b[1], b[2]), Vector3::new(b[3], b[4], b[5]));
        }
        self.tree.pull_back(|k| &work.maps[k], &mut work.twists, out);
        if self.particles.dof() > 0 {
            let mut columns = DMatrix::zeros(q.len(), out.len());
            self.particles.null_space(q, &mut columns);
            for (out, column) in out.iter_mut().zip(columns.column_iter()) {
                *out += column.iter().zip(w).map(|(p, w)| p * w).sum::<f64>();
            }
        }
    }

    /// Columns of `P_in(q) P_ex` for the velocity maps in the scratch.
    fn write_columns(&self, work: &mut Work, q: &[f64], out: &mut DMatrix<f64>) {
        let n = out.nrows();
        for k in 0..self.tree.dof() {
            work.nu.fill(0.0);
            work.nu[k] = 1.0;
            self.tree.push_forward(&work.maps, &work.nu, &mut work.twists);
            let column = &mut out.as_mut_slice()[k * n..(k + 1) * n];
            for (link, twist) in self.tree.links().iter().zip(&work.twists) {
                let own = 12 * link.frame..12 * link.frame + 12;
                let (v, w): (Vector3<f64>, Vector3<f64>) = (twist.linear, twist.angular);
                let twist = nalgebra::SVector::from([v[0], v[1], v[2], w[0], w[1], w[2]]);
                null_space::push_forward(&q[own.clone()], &twist, &mut column[own]);
            }
        }
    }
}

impl Reparametrization for TreeMap {
    fn dof(&self) -> usize {
        self.tree.dof() + self.particles.dof()
    }

    fn blocks(&self) -> Vec<Block> {
        let mut blocks = self.tree.blocks();
        blocks.extend(self.particles.blocks());
        blocks
    }

    fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>) {
        let work = &mut *self.work.borrow_mut();
        out.fill(0.0);
        self.tree.velocity_maps(q, &mut work.maps);
        self.write_columns(work, q, out);
        self.particles.null_space(q, out);
    }

    fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.tree.reparametrize(u, s, &mut self.work.borrow_mut().motions)?;
        self.particles.reparametrize(u, s)
    }

    fn tangent(&self, u: &[f64], s: &Interval, out: &mut DMatrix<f64>) {
        let work = &mut *self.work.borrow_mut();
        out.fill(0.0);
        self.tree.tangents(u, &s.q1, &mut work.maps);
        self.write_columns(work, &s.q1, out);
        self.particles.tangent(u, s, out);
    }

    fn clean(&self, _t: f64, q: &mut [f64]) {
        self.tree.clean(q);
        self.particles.clean(q);
    }
}
