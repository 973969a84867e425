//! The reparametrization of a mechanism whose joints and bars form a tree, as dense matrices.

use crate::mechanism::Mechanism;
use crate::pair::{FrameMotion, Twist, TwistTransfer, VelocityMap};
use crate::tree::Tree;
use crate::tree::particle::ParticleTree;
use nalgebra::{DMatrix, Vector3};
use std::cell::RefCell;
use vi_constraints::Reparametrization;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, UnknownBlock};

crate::opaque_debug!(TreeMap);

/// `P`, `F_d` and `∂F_d/∂u` of the spanning tree.
pub struct TreeMap {
    tree: Tree,
    particles: ParticleTree,
    work: RefCell<MapScratch>, // the trait's methods are `&self`; the scratch is not shared
}

struct MapScratch {
    maps: Vec<VelocityMap>,
    twists: Vec<Twist>,
    motions: Vec<FrameMotion>,
    nu: Vec<f64>,
    sums: Vec<Vector3<f64>>, // of forces on particles
}

impl TreeMap {
    /// The map of a mechanism's spanning tree.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Self {
        let (tree, particles) = (mechanism.tree().clone(), mechanism.particle_tree().clone());
        let links = tree.links().len();
        let work = MapScratch {
            maps: vec![VelocityMap::new(TwistTransfer::None, &[]); links],
            twists: vec![Twist::zero(); links],
            motions: vec![FrameMotion::rest(); links],
            nu: vec![0.0; tree.dof()],
            sums: Vec::new(),
        };
        Self { tree, particles, work: RefCell::new(work) }
    }

    /// `out ← P(q)ᵀ w`, shape `d`, in linear time.
    pub fn pull_back(&self, q: &[f64], w: &[f64], out: &mut [f64]) {
        let work = &mut *self.work.borrow_mut();
        out.fill(0.0);
        self.tree.velocity_maps(q, &mut work.maps);
        self.tree.pull_back(|k| &work.maps[k], q, w, &mut work.twists, out);
        self.particles.pull_back(q, w, &mut work.sums, out);
    }
}

impl Reparametrization for TreeMap {
    fn dof(&self) -> usize {
        self.tree.dof() + self.particles.dof()
    }

    fn blocks(&self) -> Vec<UnknownBlock> {
        let mut blocks = self.tree.blocks();
        blocks.extend(self.particles.blocks());
        blocks
    }

    fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>) {
        let MapScratch { maps, twists, nu, .. } = &mut *self.work.borrow_mut();
        out.fill(0.0);
        self.tree.velocity_maps(q, &mut *maps);
        self.tree.write_null_space(maps, q, nu, twists, out);
        self.particles.null_space(q, out);
    }

    fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.tree.reparametrize(u, s, &mut self.work.borrow_mut().motions)?;
        self.particles.reparametrize(u, s)
    }

    fn tangent(&self, u: &[f64], s: &Interval, out: &mut DMatrix<f64>) {
        let MapScratch { maps, twists, nu, .. } = &mut *self.work.borrow_mut();
        out.fill(0.0);
        self.tree.tangents(u, &s.q1, &mut *maps);
        self.tree.write_null_space(maps, &s.q1, nu, twists, out);
        self.particles.tangent(u, s, out);
    }

    fn clean(&self, _t: f64, q: &mut [f64]) {
        self.tree.clean(q);
        self.particles.clean(q);
    }
}
