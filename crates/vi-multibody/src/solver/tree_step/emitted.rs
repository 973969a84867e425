//! What is emitted over the coordinates of bodies, on the links of the sweeps.
#![allow(non_snake_case)] // A, B, C

use super::space::SPACE;
use crate::geometry::matrix::{Columns, Screw, Spatial};
use crate::geometry::one_tree::{HeldVector, Narrow, One, Xyz};
use crate::geometry::space::{Space, Vector};
use crate::geometry::spatial::SpatialMatrix;
use crate::pair::TwistTransfer;
use crate::solver::body_blocks::{BodyBlocks, NearBlocks};
use crate::sweep::coupled::Coupling;
use crate::sweep::link::Link;
use crate::tree::Tree;
use nalgebra::{Matrix3, Vector3};
use vi_constraints::reparametrization::Emission;
use vi_rigid::{directors, null_space};

/// The blocks of a matrix that couples no two bodies, but where there is a place for it a body with
/// its parent.
#[derive(Debug)]
pub(in crate::solver) struct Emitted {
    matrices: Vec<SpatialMatrix>, // A_α about the centres
    /// `A_α` about the reference points, scaled.
    pub(in crate::solver) blocks: Vec<Spatial<HeldVector>>,
    /// What acts along each unknown; empty where that is known otherwise.
    pub(in crate::solver) along: Vec<f64>,
    near: Option<[Vec<SpatialMatrix>; 2]>, // B, C about the centres
}

impl Emitted {
    /// For a number of links, and of unknowns along which something may act.
    pub(in crate::solver) fn new(links: usize, unknowns: usize) -> Self {
        Self {
            matrices: vec![SpatialMatrix::zero(); links],
            blocks: vec![Spatial::default(); links],
            along: vec![0.0; unknowns],
            near: None,
        }
    }

    /// With places for what couples links with their parents.
    pub(in crate::solver) fn with_couplings(mut self) -> Self {
        self.near = Some([self.matrices.clone(), self.matrices.clone()]);
        self
    }

    /// Takes what is emitted between the configurations `q_n, q_{n+1}`, blocks times a factor.
    pub(in crate::solver) fn assemble(
        &mut self,
        matrix: &Emission<'_>,
        tree: &Tree,
        links: &[Link<One>],
        [q0, q1]: [&[f64]; 2],
        factor: f64,
    ) {
        let Self { matrices, blocks, along, near } = self;
        matrices.fill(SpatialMatrix::zero());
        along.fill(0.0);
        let near = near.as_mut().map(|[of_link, of_parent]| {
            of_link.fill(SpatialMatrix::zero());
            of_parent.fill(SpatialMatrix::zero());
            NearBlocks { tree, of_link, of_parent }
        });
        let link_of = tree.link_of();
        let mut emitted = BodyBlocks { A: matrices, link_of, along, q0, q1, near, coupled: false };
        matrix(&mut emitted);
        debug_assert!(!emitted.coupled, "no place for what couples other bodies");
        for ((link, A), block) in links.iter().zip(&*matrices).zip(blocks) {
            *block = about_references(A, [(link, q0), (link, q1)], factor);
        }
    }

    /// Writes what couples links with their parents, as assembled last.
    pub(in crate::solver) fn write_couplings(
        &self,
        links: &[Link<One>],
        [q0, q1]: [&[f64]; 2],
        couplings: &mut [Coupling<One>],
    ) {
        let Some([of_link, of_parent]) = &self.near else { return };
        for (k, (link, coupling)) in links.iter().zip(couplings).enumerate() {
            let Some(parent) = link.parent.map(|parent| &links[parent]) else { continue };
            coupling.of_link = about_references(&of_link[k], [(link, q0), (parent, q1)], 1.0);
            coupling.of_parent = about_references(&of_parent[k], [(parent, q0), (link, q1)], 1.0);
        }
    }
}

/// A matrix between the centres of two links about their reference points, times a factor.
fn about_references(
    matrix: &SpatialMatrix,
    ends: [(&Link<One>, &[f64]); 2],
    factor: f64,
) -> Spatial<HeldVector> {
    let [row, column] = ends.map(|(link, q)| {
        let own = &q[link.frame..link.frame + 12];
        TwistTransfer::Rigid(-(directors::triad(own) * Vector3::from(link.anchor)))
    });
    let moved = matrix.congruence(&row, &column);
    let columns =
        |m: &Matrix3<f64>| Columns([0, 1, 2].map(|j| SPACE.vector(m.column(j).into()) * factor));
    let [ll, la, al, aa] = moved.blocks().map(columns);
    Spatial { ll, la, al, aa }.held()
}

/// `P_inᵀ w` of a link about its reference point.
pub(in crate::solver) fn wrench(link: &Link<One>, q: &[f64], w: &[f64]) -> Screw<Xyz<Narrow>> {
    let (own, of) = (link.frame..link.frame + 12, |x: &[f64]| SPACE.read(x, 0));
    let d = &q[own.clone()];
    let b = null_space::pull_back(d, &w[own]);
    let (linear, spin) = (of(&b.as_slice()[..3]), of(&b.as_slice()[3..]));
    let anchor = directors::triad(d) * Vector3::from(link.anchor);
    Screw { linear, angular: spin - of(anchor.as_slice()).cross(linear) }
}
