//! What a link of a tree is during a step: constants in body components, vectors at `q_n`, unknowns
//! of the sweeps.

use crate::geometry::lane_matrices::{Columns, Pair, Spatial};
use crate::geometry::lanes::Held;
use crate::mechanism::Mechanism;
use crate::pair::PairKind;
use crate::pair::joint::FrameId;
use crate::solver::body_masses::body_masses;
use crate::solver::tree_step::columns::{ColumnWork, Motion};
use crate::tree::{Link, Tree};
use nalgebra::{Matrix4, Vector3};
use vi_core::MechanicalSystem;
use vi_core::SeparableSystem;
use vi_core::linear::norm_inf;

/// Constants of a link; vectors in the directors of its parent or in its own.
#[derive(Clone, Debug)]
pub(in crate::solver) struct Constants {
    pub(in crate::solver) kind: PairKind,
    pub(in crate::solver) motion: Motion,
    /// Advance of a screw, m per radian.
    pub(in crate::solver) pitch: f64,
    /// Whether the pair leaves no gap.
    pub(in crate::solver) closes_gap: bool,
    pub(in crate::solver) parent: Option<usize>,
    /// Whether the parent stands just before it in the order of the links.
    pub(in crate::solver) follows_parent: bool,
    /// Where the sums of those children stand that do not follow it, if there are any.
    pub(in crate::solver) slot: Option<usize>,
    /// Whether it is the first to write to the slot of its parent, leaf to root.
    pub(in crate::solver) writes_first: bool,
    /// Its first coordinate, `12 frame`.
    pub(in crate::solver) frame: usize,
    /// Its parent's first coordinate.
    pub(in crate::solver) parent_frame: usize,
    /// Its first unknown.
    pub(in crate::solver) unknown: usize,
    /// From the parent's reference point to its own, directors of the parent.
    pub(in crate::solver) lever: [f64; 3],
    /// `m_1, m_2, n`, directors of the parent.
    pub(in crate::solver) axes: [[f64; 3]; 3],
    /// `m_1', m_2', n'`, its own directors.
    pub(in crate::solver) axes_child: [[f64; 3]; 3],
    /// `ϱ¹`, directors of the parent.
    pub(in crate::solver) anchor_parent: [f64; 3],
    /// From the centre to its reference point, its own directors: `ϱ²`, of a free body 0.
    pub(in crate::solver) anchor: [f64; 3],
    /// `M` between the vectors `φ, d_1, d_2, d_3`: multiples of `I_3`.
    pub(in crate::solver) mass: [[f64; 4]; 4],
    /// Whether that matrix is diagonal: centre of mass and principal axes.
    pub(in crate::solver) is_diagonal: bool,
    /// First moment of mass about the reference point, its own directors, kg·m.
    pub(in crate::solver) moment: [f64; 3],
    /// Euler tensor about the reference point, its own directors, kg·m².
    pub(in crate::solver) euler: [[f64; 3]; 3],
}

/// Vectors of a link at `q_n`, and what the sweeps leave.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::solver) struct Work {
    pub(in crate::solver) column: ColumnWork, // of a joint of one column
    pub(in crate::solver) lever: Held,        // ℓ
    pub(in crate::solver) moment: Held,       // s
    pub(in crate::solver) euler: Columns<Held>, // E
    pub(in crate::solver) start: Pair<Held>,  // what balances inertia at u = 0
    pub(in crate::solver) turn: Columns<Held>, // A − 1
    pub(in crate::solver) shift: Held,        // Δx of the reference point
    pub(in crate::solver) lever_next: Held,   // ℓ'
    pub(in crate::solver) wrench: Pair<Held>, // balance of the link and all that it carries
    pub(in crate::solver) twist: Pair<Held>,  // δt'
    pub(in crate::solver) cleaned: bool,      // whether round-off was taken out of q_{n+1}
}

/// Sums over the children of a branched link.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::solver) struct Sums {
    pub(in crate::solver) matrix: Spatial<Held>,
    pub(in crate::solver) wrench: Pair<Held>,
}

/// The largest velocity of a centre of mass along an axis, m/s, from the momenta.
pub(in crate::solver) fn fastest(links: &[Constants], p: &[f64]) -> f64 {
    let speed = |link: &Constants| norm_inf(&p[link.frame..link.frame + 3]) / link.mass[0][0];
    links.iter().filter(|link| link.mass[0][0] > 0.0).map(speed).fold(0.0, f64::max)
}

/// The constants of all links and the number of slots; `None` where a pair, or the mass of a body,
/// is of another kind.
pub(in crate::solver) fn constants(
    mechanism: &Mechanism,
    system: &SeparableSystem,
) -> Option<(Vec<Constants>, usize)> {
    let tree = mechanism.tree();
    if system.adds_mass() {
        return None;
    }
    let masses = body_masses(tree.links().len(), system.inertia(), system.dim())?;
    let (mut links, mut slots) = (Vec::new(), 0);
    for (k, link) in tree.links().iter().enumerate() {
        links.push(constants_of(tree, (k, link), &masses[link.frame])?);
    }
    for k in (0..links.len()).rev() {
        let Some(parent) = links[k].parent.filter(|_| !links[k].follows_parent) else { continue };
        links[k].writes_first = links[parent].slot.is_none();
        if links[k].writes_first {
            links[parent].slot = Some(slots);
            slots += 1;
        }
    }
    Some((links, slots))
}

fn constants_of(tree: &Tree, (k, link): (usize, &Link), mass: &Matrix4<f64>) -> Option<Constants> {
    let kind = link.joint.kind;
    let (near, far) = (&link.joint.parent, &link.joint.child);
    let carrier = link.parent.map(|p| &tree.links()[p]);
    let expected = carrier.map_or(FrameId::Ground, |carrier| FrameId::Frame(carrier.frame));
    if near.frame != expected || far.frame != FrameId::Frame(link.frame) {
        return None;
    }
    let start = carrier.map_or(Vector3::zeros(), reference);
    // about the reference point, at −a from which the centre is
    let (m, a) = (mass[(0, 0)], reference(link));
    let first = Vector3::new(mass[(0, 1)], mass[(0, 2)], mass[(0, 3)]);
    let euler = mass.fixed_view::<3, 3>(1, 1) - first * a.transpose() - a * first.transpose()
        + m * a * a.transpose();
    Some(Constants {
        kind,
        motion: Motion::of(kind),
        pitch: kind.pitch().unwrap_or(0.0),
        closes_gap: kind.closes_gap(),
        parent: link.parent,
        follows_parent: link.parent.is_some_and(|p| p + 1 == k),
        slot: None,
        writes_first: false,
        frame: 12 * link.frame,
        parent_frame: 12 * carrier.map_or(0, |carrier| carrier.frame),
        unknown: link.offset,
        lever: (near.anchor - start).into(),
        axes: near.axes.into(),
        axes_child: far.axes.into(),
        anchor_parent: near.anchor.into(),
        anchor: a.into(),
        mass: (*mass).into(),
        is_diagonal: *mass == Matrix4::from_diagonal(&mass.diagonal()),
        moment: (first - m * a).into(),
        euler: euler.into(),
    })
}

/// From the centre of a link to its reference point, its own directors.
fn reference(link: &Link) -> Vector3<f64> {
    if link.joint.kind == PairKind::Free { Vector3::zeros() } else { link.joint.child.anchor }
}
