//! What a link of a tree is during a step: constants in body components, vectors at `q_n`, unknowns
//! of the sweeps.
#![allow(non_snake_case)] // SA

use crate::geometry::matrix::{Columns, Screw, Spatial};
use crate::geometry::one_tree::{One, three};
use crate::geometry::space::{Space, Store, Vector};
use crate::mechanism::Mechanism;
use crate::pair::constraints::PairConstraint;
use crate::pair::joint::FrameId;
use crate::sweep::body_masses::body_masses;
use crate::sweep::columns::Motion;
use crate::tree::{self, Tree};
use nalgebra::{Matrix4, Vector3};
use vi_core::MechanicalSystem;
use vi_core::SeparableSystem;
use vi_core::linear::norm_inf;

/// Constants of a link; vectors in the directors of its parent or in its own.
#[derive(Clone, Debug)]
pub(crate) struct Link<M: Store> {
    /// The rows of its pair.
    pub(crate) constraints: &'static [PairConstraint],
    pub(crate) motion: Motion,
    /// Advance of a screw, m per radian.
    pub(crate) pitch: M::Constant,
    /// Whether the pair leaves no gap.
    pub(crate) closes_gap: bool,
    pub(crate) parent: Option<usize>,
    /// Whether the parent stands just before it in the order of the links.
    pub(crate) follows_parent: bool,
    /// Where the sums of those children stand that do not follow it, if there are any.
    pub(crate) slot: Option<usize>,
    /// Whether it is the first to write to the slot of its parent, leaf to root.
    pub(crate) writes_first: bool,
    /// Its first coordinate, `12 frame`.
    pub(crate) frame: usize,
    /// Its parent's first coordinate.
    pub(crate) parent_frame: usize,
    /// Its first unknown.
    pub(crate) unknown: usize,
    /// From the parent's reference point to its own, directors of the parent.
    pub(crate) lever: [M::Constant; 3],
    /// `m_1, m_2, n`, directors of the parent.
    pub(crate) axes: [[M::Constant; 3]; 3],
    /// `m_1', m_2', n'`, its own directors.
    pub(crate) axes_child: [[M::Constant; 3]; 3],
    /// `ϱ¹`, directors of the parent.
    pub(crate) anchor_parent: [M::Constant; 3],
    /// From the centre to its reference point, its own directors: `ϱ²`, of a free body 0.
    pub(crate) anchor: [M::Constant; 3],
    /// `M` between the vectors `φ, d_1, d_2, d_3`: multiples of `I_3`.
    pub(crate) mass: [[M::Constant; 4]; 4],
    /// Whether that matrix is diagonal: centre of mass and principal axes.
    pub(crate) is_diagonal: bool,
    /// First moment of mass about the reference point, its own directors, kg·m.
    pub(crate) moment: [M::Constant; 3],
    /// Euler tensor about the reference point, its own directors, kg·m².
    pub(crate) euler: [[M::Constant; 3]; 3],
}

/// A column of a joint during a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColumnWork<M: Store> {
    pub(crate) axis: M::Held,      // n
    pub(crate) axis_next: M::Held, // n'
    pub(crate) SA: Screw<M::Held>, // Sᵀ Ã
    pub(crate) inverse: M::Number, // D⁻¹
    pub(crate) slope: M::Number,   // what acts along the column adds to D
}

/// Vectors of a link at `q_n`, and what the sweeps leave.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Work<M: Store> {
    pub(crate) column: ColumnWork<M>,   // of a joint of one column
    pub(crate) lever: M::Held,          // ℓ
    pub(crate) moment: M::Held,         // s
    pub(crate) euler: Columns<M::Held>, // E
    pub(crate) start: Screw<M::Held>,   // what balances inertia at u = 0
    pub(crate) turn: Columns<M::Held>,  // A − 1
    pub(crate) shift: M::Held,          // Δx of the reference point
    pub(crate) lever_next: M::Held,     // ℓ'
    pub(crate) wrench: Screw<M::Held>,  // balance of the link and all that it carries
    pub(crate) twist: Screw<M::Held>,   // δt'
    pub(crate) cleaned: u8,             // trees whose link lost round-off at q_{n+1}, a bit each
}

/// Sums over the children of a branched link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sums<M: Store> {
    pub(crate) matrix: Spatial<M::Held>,
    pub(crate) wrench: Screw<M::Held>,
}

/// `G` of a rotation vector: what a translation of the reference point takes from `δω`.
pub(crate) type Gain<M> = Columns<<M as Store>::Held>;

impl Link<One> {
    /// The same link with other constants; `number` makes one of how it is read off a link.
    pub(crate) fn with_constants<M: Store>(
        &self,
        number: impl Fn(&dyn Fn(&Self) -> f64) -> M::Constant,
    ) -> Link<M> {
        let vector = |of: &dyn Fn(&Self) -> [f64; 3]| three!(i => number(&|link| of(link)[i]));
        Link {
            constraints: self.constraints,
            motion: self.motion,
            closes_gap: self.closes_gap,
            parent: self.parent,
            follows_parent: self.follows_parent,
            slot: self.slot,
            writes_first: self.writes_first,
            frame: self.frame,
            parent_frame: self.parent_frame,
            unknown: self.unknown,
            is_diagonal: self.is_diagonal,
            pitch: number(&|link| link.pitch),
            lever: vector(&|link| link.lever),
            axes: three!(j => vector(&|link| link.axes[j])),
            axes_child: three!(j => vector(&|link| link.axes_child[j])),
            anchor_parent: vector(&|link| link.anchor_parent),
            anchor: vector(&|link| link.anchor),
            mass: [0, 1, 2, 3].map(|r| [0, 1, 2, 3].map(|c| number(&|link| link.mass[r][c]))),
            moment: vector(&|link| link.moment),
            euler: three!(j => vector(&|link| link.euler[j])),
        }
    }
}

impl<M: Store> ColumnWork<M> {
    pub(crate) fn zero<S: Space<Store = M>>(s: S) -> Self {
        let (zero, none) = (s.zero().held(), s.number(0.0));
        let SA = Screw::zero(s).held();
        Self { axis: zero, axis_next: zero, SA, inverse: none, slope: none }
    }
}

impl<M: Store> Work<M> {
    pub(crate) fn zero<S: Space<Store = M>>(s: S) -> Self {
        let (vector, screw) = (s.zero().held(), Screw::zero(s).held());
        let matrix = Columns::zero(s).held();
        Self {
            column: ColumnWork::zero(s),
            lever: vector,
            moment: vector,
            euler: matrix,
            start: screw,
            turn: matrix,
            shift: vector,
            lever_next: vector,
            wrench: screw,
            twist: screw,
            cleaned: 0,
        }
    }
}

impl<M: Store> Sums<M> {
    pub(crate) fn zero<S: Space<Store = M>>(s: S) -> Self {
        Self { matrix: Spatial::zero(s).held(), wrench: Screw::zero(s).held() }
    }
}

/// The column of an unknown of a link.
pub(crate) fn column_mut<'a, M: Store>(
    link: &Link<M>,
    work: &'a mut Work<M>,
    columns: &'a mut [ColumnWork<M>],
    unknown: usize,
) -> &'a mut ColumnWork<M> {
    match link.motion {
        Motion::Several(_) => &mut columns[unknown],
        _ => &mut work.column,
    }
}

/// The largest velocity of a centre of mass along an axis, m/s, from the momenta.
pub(crate) fn fastest(links: &[Link<One>], p: &[f64]) -> f64 {
    let speed = |link: &Link<One>| norm_inf(&p[link.frame..link.frame + 3]) / link.mass[0][0];
    links.iter().filter(|link| link.mass[0][0] > 0.0).map(speed).fold(0.0, f64::max)
}

/// The constants of all links and the number of slots; `None` where a pair, or the mass of a body,
/// is of another kind.
pub(crate) fn constants(
    mechanism: &Mechanism,
    system: &SeparableSystem,
) -> Option<(Vec<Link<One>>, usize)> {
    let tree = mechanism.tree();
    if system.adds_mass() {
        return None;
    }
    constants_with(tree, &body_masses(tree.links().len(), system.inertia(), system.dim())?)
}

/// The same with the masses of each frame.
pub(crate) fn constants_with(
    tree: &Tree,
    masses: &[Matrix4<f64>],
) -> Option<(Vec<Link<One>>, usize)> {
    let (mut links, mut slots) = (Vec::new(), 0);
    for (k, link) in tree.links().iter().enumerate() {
        links.push(constants_of(tree, k, link, &masses[link.frame])?);
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

fn constants_of(
    tree: &Tree,
    k: usize,
    link: &tree::TreeLink,
    mass: &Matrix4<f64>,
) -> Option<Link<One>> {
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
    Some(Link {
        constraints: kind.properties().constraints,
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
fn reference(link: &tree::TreeLink) -> Vector3<f64> {
    if link.joint.kind.is_free() { Vector3::zeros() } else { link.joint.child.anchor }
}
