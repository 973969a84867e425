//! Links as the sweeps see them: constants of the pairs, and what of them depends on the node a
//! step starts from.

use crate::geometry::lane_vectors::Transfer;
use crate::pair::columns::MotionSubspace;
use crate::sweep::body_masses::body_masses;
use crate::tree::Tree;
use nalgebra::Matrix4;
use vi_core::isotropic::IsotropicBlocks;
use vi_core::sparse::SparseMatrix;

/// Three vectors or a 3×3 matrix by columns.
pub(super) type Triad = [[f64; 3]; 3];

/// A link and its inboard joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub frame: usize,
    /// The parent; the number of links for the ground.
    pub parent: usize,
    /// What its joint leaves free.
    pub motion: MotionSubspace,
    /// About what it turns relative to its parent.
    pub turns: Turns,
    pub transfer: Transfer,
    /// First unknown and number of unknowns.
    pub offset: usize,
    pub dof: usize,
    /// First entry of its inverse among those of all links.
    pub inverse: usize,
    /// First unknown of a rotation vector within the joint.
    pub rotation_vector: Option<usize>,
    /// `ϱ¹`, `ϱ²` in the directors of parent and child.
    pub anchor_parent: [f64; 3],
    pub anchor_child: [f64; 3],
    /// `m_1, m_2, n` in the directors of the parent; `m_1', m_2', n'` in those of the child.
    pub axes_parent: Triad,
    pub axes_child: Triad,
    /// `n'` as plus or minus a director.
    pub director: Option<(usize, f64)>,
    /// Advance of a screw, m per radian.
    pub pitch: f64,
    /// Masses of the centre and of the directors.
    pub mass: [f64; 4],
}

/// The unknowns of a joint, by number, that turn the child.
#[derive(Clone, Copy, Debug)]
pub(super) enum Turns {
    None,
    /// About `n'`.
    About(usize),
    /// About `n`, then about `m_1'`.
    Twice([usize; 2]),
    /// By a rotation vector, whatever the parent does.
    Vector(usize),
}

impl Turns {
    fn of(motion: MotionSubspace) -> Self {
        if let Some(first) = motion.rotation_vector() {
            return Self::Vector(first);
        }
        let mut turns = (0..motion.columns().len()).filter(|&k| motion.is_angle(k));
        match (turns.next(), turns.next()) {
            (None, _) => Self::None,
            (Some(k), None) => Self::About(k),
            (Some(first), Some(second)) => Self::Twice([first, second]),
        }
    }
}

/// What of a link depends on `q_n` alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// `φ_n`, `d_I,n`.
    pub center: [f64; 3],
    pub d: Triad,
    /// `d_I,n` in the directors of the parent.
    pub relative: Triad,
    /// What moves with the parent of the joint point, in its directors: `ϱ¹`, with the gap where
    /// the pair has one.
    pub lever: [f64; 3],
    /// `φ_n − φ_n` of the parent.
    pub arm: [f64; 3],
    /// `n` of the parent in the directors of the child.
    pub axis: [f64; 3],
}

impl Start {
    /// Of the ground.
    pub(super) fn ground() -> Self {
        let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let zero = [0.0; 3];
        Self { center: zero, d: unit, relative: unit, lever: zero, arm: zero, axis: zero }
    }

    /// Of a link at `q_n`, after its parent.
    pub(super) fn of(link: &Link, parent: &Self, q: &[f64]) -> Self {
        let q = &q[12 * link.frame..12 * link.frame + 12];
        let read = |at: usize| [q[at], q[at + 1], q[at + 2]];
        let (center, d) = (read(0), [read(3), read(6), read(9)]);
        let within = |frame: &Triad, x: &[f64; 3]| frame.map(|d| dot(&d, x));
        let relative = d.map(|d| within(&parent.d, &d));
        let arm = minus(&center, &parent.center);
        let lever = if link.motion.closes_gap() {
            link.anchor_parent
        } else {
            within(&parent.d, &plus(&arm, &combination(&d, &link.anchor_child)))
        };
        let axis = within(&d, &combination(&parent.d, &link.axes_parent[2]));
        Self { center, d, relative, lever, arm, axis }
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn plus(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn minus(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn combination(x: &Triad, c: &[f64; 3]) -> [f64; 3] {
    let at = |i: usize| x[0][i] * c[0] + x[1][i] * c[1] + x[2][i] * c[2];
    [at(0), at(1), at(2)]
}

/// The links of a tree, root first. `None` where the mass matrix has other entries than scalars of
/// centres and directors.
pub(super) fn links(tree: &Tree, mass: &SparseMatrix) -> Option<Vec<Link>> {
    let masses = masses(tree.links().len(), mass)?;
    let mut inverse = 0;
    let link = |link: &crate::tree::Link| {
        let (joint, dof) = (&link.joint, link.dof());
        let motion = joint.kind.properties().motion;
        let columns = |m: &nalgebra::Matrix3<f64>| [0, 1, 2].map(|k| m.column(k).into());
        let axes_child: Triad = columns(&joint.child.axes);
        inverse += dof * dof;
        Link {
            frame: link.frame,
            parent: link.parent.unwrap_or(tree.links().len()),
            motion,
            turns: Turns::of(motion),
            transfer: match motion {
                MotionSubspace::Spherical => Transfer::Point,
                MotionSubspace::Free => Transfer::None,
                _ => Transfer::Rigid,
            },
            offset: link.offset,
            dof,
            inverse: inverse - dof * dof,
            rotation_vector: motion.rotation_vector(),
            anchor_parent: joint.parent.anchor.into(),
            anchor_child: joint.child.anchor.into(),
            axes_parent: columns(&joint.parent.axes),
            axes_child,
            director: director(&axes_child[2]),
            pitch: joint.kind.pitch().unwrap_or(0.0),
            mass: masses[link.frame],
        }
    };
    Some(tree.links().iter().map(link).collect())
}

/// Which director an axis is, and with which sign.
fn director(axis: &[f64; 3]) -> Option<(usize, f64)> {
    let others = |k: usize| (0..3).filter(|&i| i != k).all(|i| axis[i].abs() <= 0.0);
    let k = (0..3).find(|&k| axis[k].abs().to_bits() == 1.0_f64.to_bits() && others(k))?;
    Some((k, axis[k]))
}

/// The masses of centres and directors, for each frame.
fn masses(frames: usize, mass: &SparseMatrix) -> Option<Vec<[f64; 4]>> {
    let all = body_masses(frames, &IsotropicBlocks::of(mass), mass.shape().0)?;
    let diagonals: Vec<[f64; 4]> = all.iter().map(|mass| mass.diagonal().into()).collect();
    let is_diagonal = |mass: &Matrix4<f64>| *mass == Matrix4::from_diagonal(&mass.diagonal());
    all.iter().all(is_diagonal).then_some(diagonals)
}
