//! What acts in a Galerkin step on the links of a tree, differentiated at its Gauss nodes: on the
//! links, and between them and their parents.
//!
//! ```text
//! h H_ij ∋ Σ_k b_k E_ki (h² E_kj F_q + h D_kj F_v)(Q_k, V_k)                              [2.49]
//! P_jᵀ (h H_ij)ᵀ P_i = Σ_ab P_jaᵀ B_ab P_ib        B_ab between the vectors of frames, 3 × 3
//! δx_a = p_a v − r̂_a ω                             φ: p = 1, r = −D ϱ;   d_I: p = 0, r = d_I
//! ll ∋ p_a p_b B,   la ∋ −p_a B r̂_b,   al ∋ p_b r̂_a B,   aa ∋ −r̂_a B r̂_b
//! Σ_i (h H_ij)ᵀ x_i ∋ Σ_k (h E_kj F_qᵀ + D_kj F_vᵀ) z_k,   z_k = h b_k Σ_i E_ki x_i
//! ```
//! Twists are about the reference points of the links. `F_q`, `F_v` are emitted once for each node;
//! the first emission fixes the places of all later ones.
#![allow(non_snake_case)] // B, D, E

use crate::geometry::matrix::{Columns, Spatial};
use crate::geometry::one_tree::{HeldVector, One, OneTree, Width, Xyz, sweep, three};
use crate::geometry::space::Space;
use crate::sweep::coupled::Coupling;
use crate::sweep::link::Link;
use crate::sweep::place::LinkPlace;
use crate::sweep::point_costate::ActingTransposed;
use crate::tree::Tree;
use std::collections::BTreeMap;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_core::{DiscreteLagrangian, SeparableSystem};
use vi_rigid::directors::FRAME;

/// Which of `F_q` and `F_v` is emitted.
const PARTS: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

/// The slopes at all Gauss nodes of a step.
#[derive(Debug)]
pub(super) struct PointSlopes {
    pairs: Vec<VectorPair>,
    slots: [Vec<usize>; 2], // of the entries of F_q, F_v: among the numbers of all pairs
    values: Vec<[Vec<f64>; 2]>, // of each node: F_qᵀ, F_vᵀ, pair by pair, column by column
    products: Vec<[Vec<f64>; 2]>, // of each node, n: F_qᵀ z_k, F_vᵀ z_k
    combined: Vec<f64>,     // of all pairs
    z: Vec<f64>,            // n
}

/// Two vectors between which something acts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VectorPair {
    row: PairEnd, // of F_qᵀ
    column: PairEnd,
    of: PairTarget,
}

/// A vector of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairEnd {
    first: usize,
    link: Option<usize>, // whose centre it is
}

/// Where a pair counts.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PairTarget {
    Link(usize),
    /// Rows of a link, columns of its parent.
    OfLink(usize),
    /// Rows of its parent, columns of a link.
    OfParent(usize),
}

/// Lists entries.
struct List(Vec<[usize; 2]>);

impl Entries for List {
    fn add(&mut self, row: usize, column: usize, _: f64) {
        self.0.push([row, column]);
    }
}

/// Adds entries, one after the other, to their places.
struct Refill<'a> {
    slots: std::slice::Iter<'a, usize>,
    values: &'a mut [f64],
}

impl Entries for Refill<'_> {
    fn add(&mut self, _: usize, _: usize, value: f64) {
        if let Some(slot) = self.slots.next() {
            self.values[*slot] += value;
        }
    }
}

impl PointSlopes {
    /// For so many Gauss nodes; `start`: any configuration. `None` where bodies are coupled that
    /// are not a link and its parent.
    pub(super) fn new(
        tree: &Tree,
        system: &SeparableSystem,
        start: &Interval,
        nodes: usize,
    ) -> Option<Self> {
        let entries = PARTS.map(|by| {
            let mut list = List(Vec::new());
            system.gauss_slopes(start.start().moving(&start.v_mid), by, &mut list);
            list.0
        });
        let mut places = BTreeMap::new();
        for [row, column] in entries.iter().flatten() {
            places.insert([column / 3, row / 3], 0);
        }
        let mut pairs = Vec::new();
        for (vectors, number) in &mut places {
            *number = pairs.len();
            pairs.push(VectorPair::of(tree, vectors.map(|vector| 3 * vector))?);
        }
        // Fᵀ column by column: its columns are the rows of F
        let slot = |[row, column]: &[usize; 2]| {
            9 * places[&[column / 3, row / 3]] + 3 * (row % 3) + column % 3
        };
        let slots = entries.map(|list| list.iter().map(slot).collect::<Vec<_>>());
        let (n, count) = (start.q0.len(), 9 * pairs.len());
        let kept = |of: [usize; 2]| vec![of.map(|length| vec![0.0; length]); nodes];
        let by_part = [0, 1].map(|part| if slots[part].is_empty() { 0 } else { count });
        let (values, products) = (kept(by_part), kept([n, n]));
        let (combined, z) = (vec![0.0; count], vec![0.0; n]);
        Some(Self { pairs, slots, values, products, combined, z })
    }

    /// Whether bodies are coupled.
    pub(super) fn couple_bodies(&self) -> bool {
        self.pairs.iter().any(|pair| !matches!(pair.of, PairTarget::Link(_)))
    }

    /// Finds them where the forces of the control points were evaluated.
    pub(super) fn differentiate(&mut self, system: &SeparableSystem, points: &ControlPoints) {
        let Self { slots, values, .. } = self;
        for (node, values) in points.gauss().iter().zip(values) {
            let at = node.place(points.step());
            for ((slots, values), by) in slots.iter().zip(values).zip(PARTS) {
                values.fill(0.0);
                let mut refill = Refill { slots: slots.iter(), values };
                system.gauss_slopes(at.moving(&node.v), by, &mut refill);
            }
        }
    }

    /// Writes the blocks between all control points, `P_jᵀ (h H_ij)ᵀ P_i`.
    pub(super) fn project(
        &mut self,
        points: &ControlPoints,
        links: &[Link<One>],
        acting: &mut ActingTransposed,
    ) {
        let Self { pairs, values, combined, .. } = self;
        let (constants, h, s) = (points.constants(), points.h(), points.stages());
        let ActingTransposed { blocks, couplings } = acting;
        for (place, blocks) in blocks.iter_mut().enumerate() {
            let (j, i) = (place / s + 1, place % s);
            combined.fill(0.0);
            for (k, values) in values.iter().enumerate() {
                let weight = h * constants.gauss_weights[k] * constants.E[(k, i)];
                let by = [h * constants.E[(k, j)], constants.D[(k, j)]];
                for (values, by) in values.iter().zip(by) {
                    add_multiple(weight * by, values, combined);
                }
            }
            let near = couplings.get_mut(place).map_or(&mut [][..], |own| &mut own.links);
            blocks.fill(Spatial::default());
            for coupling in &mut *near {
                (coupling.of_link, coupling.of_parent) = Default::default();
            }
            project_pairs(pairs, links, combined, [points.q(j), points.q(i)], (blocks, near));
        }
    }

    /// Takes `x_i` of some control points.
    pub(super) fn take<'a>(
        &mut self,
        points: &ControlPoints,
        x: impl Iterator<Item = (usize, &'a [f64])> + Clone,
    ) {
        let Self { pairs, values, products, z, .. } = self;
        let (constants, h) = (points.constants(), points.h());
        for (k, (values, products)) in values.iter().zip(products).enumerate() {
            z.fill(0.0);
            for (i, x) in x.clone() {
                add_multiple(h * constants.gauss_weights[k] * constants.E[(k, i)], x, z);
            }
            for (values, product) in values.iter().zip(products) {
                product.fill(0.0);
                if !values.is_empty() {
                    multiply_pairs(pairs, values, z, product);
                }
            }
        }
    }

    /// `out ← out + scale Σ_i (h H_ij)ᵀ x_i` of what was taken.
    pub(super) fn add(&self, points: &ControlPoints, j: usize, scale: f64, out: &mut [f64]) {
        let (constants, h) = (points.constants(), points.h());
        for (k, products) in self.products.iter().enumerate() {
            let by = [h * constants.E[(k, j)], constants.D[(k, j)]];
            for ((product, by), values) in products.iter().zip(by).zip(&self.values[k]) {
                if !values.is_empty() {
                    add_multiple(scale * by, product, out);
                }
            }
        }
    }
}

/// `y ← y + a x`.
fn add_multiple(a: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += a * x);
}

impl VectorPair {
    /// Between the vectors from two coordinates on; `None` where these belong to bodies that are
    /// not a link and its parent.
    fn of(tree: &Tree, [row, column]: [usize; 2]) -> Option<Self> {
        let link = |first: usize| tree.link_of()[first / FRAME];
        let end = |first: usize| {
            let is_center = first.is_multiple_of(FRAME);
            PairEnd { first, link: is_center.then(|| link(first)) }
        };
        let parent = |link: usize| tree.links()[link].parent;
        let of = match (link(row), link(column)) {
            (a, b) if a == b => PairTarget::Link(a),
            (a, b) if parent(a) == Some(b) => PairTarget::OfLink(a),
            (a, b) if parent(b) == Some(a) => PairTarget::OfParent(b),
            _ => return None,
        };
        Some(Self { row: end(row), column: end(column), of })
    }
}

sweep! {
    project_pairs = sweep_project(
        pairs: &'a [VectorPair], links: &'a [Link<One>], values: &'a [f64], ends: [&'a [f64]; 2],
        out: (&'a mut [Spatial<HeldVector>], &'a mut [Coupling<One>])
    ) -> ()
}

#[inline(always)]
fn sweep_project<W: Width>(
    s: OneTree<W>,
    pairs: &[VectorPair],
    links: &[Link<One>],
    values: &[f64],
    [left, right]: [&[f64]; 2],
    (blocks, near): (&mut [Spatial<HeldVector>], &mut [Coupling<One>]),
) {
    for (pair, first) in pairs.iter().zip((0..).step_by(9)) {
        let B = Columns(three!(c => s.read(values, first + 3 * c)));
        let (x, y) = (arm(s, links, left, pair.row), arm(s, links, right, pair.column));
        let turned = B.times_skew(y); // B r̂_b
        let to = match pair.of {
            PairTarget::Link(k) => &mut blocks[k],
            PairTarget::OfLink(k) => &mut near[k].of_link,
            PairTarget::OfParent(k) => &mut near[k].of_parent,
        };
        to.aa = to.aa.take(s).minus(&Columns::skew_times(x, &turned)).held();
        if pair.row.link.is_some() {
            to.la = to.la.take(s).minus(&turned).held();
        }
        if pair.column.link.is_some() {
            to.al = to.al.take(s).plus(&Columns::skew_times(x, &B)).held();
            if pair.row.link.is_some() {
                to.ll = to.ll.take(s).plus(&B).held();
            }
        }
    }
}

/// `r` of a vector.
#[inline(always)]
fn arm<W: Width>(s: OneTree<W>, links: &[Link<One>], q: &[f64], of: PairEnd) -> Xyz<W> {
    match of.link {
        None => s.read(q, of.first),
        Some(k) => LinkPlace::of(s, q, of.first).d.mul(s.constant(&links[k].anchor)) * -1.0,
    }
}

sweep! {
    multiply_pairs = sweep_multiply(
        pairs: &'a [VectorPair], values: &'a [f64], z: &'a [f64], out: &'a mut [f64]
    ) -> ()
}

/// `out ← out + Fᵀ z`.
#[inline(always)]
fn sweep_multiply<W: Width>(
    s: OneTree<W>,
    pairs: &[VectorPair],
    values: &[f64],
    z: &[f64],
    out: &mut [f64],
) {
    for (pair, first) in pairs.iter().zip((0..).step_by(9)) {
        let B = Columns(three!(c => s.read(values, first + 3 * c)));
        let own = s.read(out, pair.row.first) + B.mul(s.read(z, pair.column.first));
        s.write(own, out, pair.row.first);
    }
}
