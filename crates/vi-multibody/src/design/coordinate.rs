//! Coordinates that determine a start: those of joints, of free members.

use crate::constraint::joint_coordinate::JointCoordinate;
use crate::mechanism::Mechanism;
use crate::pair::DegreeOfFreedom;
use crate::pair::joint::FrameId;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::{Constraints, InitialValues};
use vi_core::Configuration;
use vi_core::linear::Singular;
use vi_rigid::directors::FRAME;

/// A coordinate of the start.
#[derive(Clone, Debug)]
pub enum StartCoordinate {
    /// A length or an angle of a joint.
    Joint(Box<JointCoordinate>),
    /// A coordinate `q_i` itself: of the centre of a free body, of a point mass, m.
    Place(usize),
    /// A rotation of a frame relative to another, about a director of that one (0, 1, 2), or
    /// relative to the ground, about an axis of space, rad; zero at the start.
    Turn {
        /// What turns.
        frame: usize,
        /// Relative to what.
        parent: Option<usize>,
        /// About which axis.
        axis: usize,
    },
}

/// A director of a frame.
fn vector(q: &[f64], frame: usize, k: usize) -> Vector3<f64> {
    let first = FRAME * frame + 3 * (k + 1);
    Vector3::from_column_slice(&q[first..first + 3])
}

/// `½ Σ a_I × b_I` over the directors of a frame: its rotation by `b` where `a` is where it is.
fn turn(frame: usize, a: &[f64], b: &[f64]) -> Vector3<f64> {
    (0..3).map(|k| 0.5 * vector(a, frame, k).cross(&vector(b, frame, k))).sum()
}

/// About what a rotation is.
fn axis_of(parent: Option<usize>, axis: usize, q: &[f64]) -> Vector3<f64> {
    parent.map_or_else(|| Vector3::ith(axis, 1.0), |parent| vector(q, parent, axis))
}

impl StartCoordinate {
    /// Those of the spanning tree of the bodies, with the number of the joint and the freedom; of
    /// free members without a joint the first is `None`.
    #[must_use]
    pub fn of_tree(mechanism: &Mechanism) -> Vec<(Option<usize>, usize, Self)> {
        let joints = &mechanism.description().joints;
        let mut found = Vec::new();
        for link in mechanism.tree().links() {
            let own = |joint: &crate::Joint| *joint == link.joint || joint.reversed() == link.joint;
            let number = joints.iter().position(own);
            let joint = number.map_or(&link.joint, |k| &joints[k]);
            for freedom in 0..joint.kind.dof() {
                let coordinate = match joint.kind.degree_of_freedom(freedom) {
                    Some(DegreeOfFreedom::Position) => Self::Place(FRAME * link.frame + freedom),
                    Some(DegreeOfFreedom::Rotation) => {
                        let index = |frame| match frame {
                            FrameId::Frame(k) => Some(k),
                            FrameId::Ground => None,
                        };
                        let ends = [joint.parent.frame, joint.child.frame].map(index);
                        let other = ends.into_iter().flatten().find(|k| *k != link.frame);
                        let axis = freedom - joint.kind.rotation_vector().unwrap_or(0);
                        Self::Turn { frame: link.frame, parent: other, axis }
                    }
                    _ => match (number, JointCoordinate::principal(joint, freedom)) {
                        (Some(k), Some(own)) => Self::Joint(Box::new(own.placed(k, freedom))),
                        _ => continue,
                    },
                };
                found.push((number, freedom, coordinate));
            }
        }
        let description = mechanism.description();
        for k in 0..description.particles.len() {
            let first = mechanism.particle_offset(k);
            let own = |freedom| (None, freedom, Self::Place(first + freedom));
            found.extend((0..description.dimension).map(own));
        }
        found
    }

    /// The entries of `∇x`.
    pub(super) fn for_each_slope(&self, q: &[f64], mut visit: impl FnMut(usize, f64)) {
        match self {
            Self::Joint(own) => own.for_each_slope(q, visit),
            Self::Place(i) => visit(*i, 1.0),
            Self::Turn { frame, parent, axis } => {
                let e = axis_of(*parent, *axis, q);
                for (frame, half) in [(Some(frame), 0.5), (parent.as_ref(), -0.5)] {
                    let Some(frame) = frame else { continue };
                    for k in 0..3 {
                        let slope = half * e.cross(&vector(q, *frame, k));
                        (0..3).for_each(|i| visit(FRAME * frame + 3 * (k + 1) + i, slope[i]));
                    }
                }
            }
        }
    }

    /// `D²x[v, w]`; of a rotation, how its rate by `w` changes along `v`.
    pub(super) fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        match self {
            Self::Joint(own) => own.second(q, v, w),
            Self::Place(_) => 0.0,
            Self::Turn { frame, parent, axis } => {
                let Some(parent) = parent else { return turn(*frame, v, w)[*axis] };
                let relative = |a: &[f64]| turn(*frame, a, w) - turn(*parent, a, w);
                axis_of(Some(*parent), *axis, q).dot(&relative(v))
                    + vector(v, *parent, *axis).dot(&relative(q))
            }
        }
    }

    /// How much is left to a value, an angle the short way; of a rotation, to what it is at `own`.
    pub(super) fn left_to(&self, value: f64, q: &[f64], own: &[f64]) -> f64 {
        match self {
            Self::Joint(own) => {
                let left = value - own.at(Configuration::new(0.0, q));
                if own.is_angle() { left - TAU * (left / TAU).round() } else { left }
            }
            Self::Place(i) => value - q[*i],
            Self::Turn { frame, parent, axis } => {
                let of = |q: &[f64], frame| {
                    Matrix3::from_columns(&[0, 1, 2].map(|k| vector(q, frame, k)))
                };
                let carried = match parent {
                    Some(parent) => of(q, *parent) * of(own, *parent).transpose(),
                    None => Matrix3::identity(),
                };
                let wanted = carried * of(own, *frame);
                let left = |k: usize| vector(q, *frame, k).cross(&wanted.column(k).into_owned());
                axis_of(*parent, *axis, q).dot(&(0.5 * (0..3).map(left).sum::<Vector3<f64>>()))
            }
        }
    }

    /// Whether it is a rotation of a frame that another one carries.
    #[must_use]
    pub fn is_carried(&self) -> bool {
        matches!(self, Self::Turn { parent: Some(_), .. })
    }

    /// How far a rotation is from what it is at `own`, rad, up to the third power.
    #[must_use]
    pub fn turned_from(&self, own: &[f64], q: &[f64]) -> f64 {
        self.left_to(0.0, q, own).abs()
    }

    /// Its value at `q`, a principal one of an angle; zero of a rotation.
    #[must_use]
    pub fn at(&self, q: &[f64]) -> f64 {
        -self.left_to(0.0, q, q)
    }

    /// Its rate, `∇x v`.
    #[must_use]
    pub fn rate(&self, q: &[f64], v: &[f64]) -> f64 {
        let mut rate = 0.0;
        self.for_each_slope(q, |i, slope| rate += slope * v[i]);
        rate
    }
}

/// Those of the coordinates whose gradients are independent on the tangent space of the
/// constraints: as many as there are degrees of freedom, the first ones where there is a choice.
///
/// # Errors
/// [`Singular`] where they do not determine the configuration.
pub fn independent(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    coordinates: &[StartCoordinate],
) -> Result<Vec<usize>, Singular> {
    let (n, r) = (mechanism.dim(), rows.len());
    let dof = n - r;
    if coordinates.len() == dof {
        return Ok((0..dof).collect());
    }
    // rows of constraints, orthonormal; a coordinate is taken that is not among them
    let mut dense = nalgebra::DMatrix::zeros(mechanism.len(), n);
    mechanism.jacobian(at.t, at.q, &mut dense);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut take = |mut row: Vec<f64>, least: f64| -> bool {
        let size = vi_core::linear::dot(&row, &row).sqrt();
        for _ in 0..2 {
            for own in &basis {
                let along = vi_core::linear::dot(own, &row);
                row.iter_mut().zip(own).for_each(|(x, e)| *x -= along * e);
            }
        }
        let left = vi_core::linear::dot(&row, &row).sqrt();
        let taken = left > least * size;
        if taken {
            basis.push(row.into_iter().map(|x| x / left).collect());
        }
        taken
    };
    for &row in rows.rows() {
        take(dense.row(row).iter().copied().collect(), 0.0);
    }
    let mut found = Vec::new();
    for (k, coordinate) in coordinates.iter().enumerate() {
        let mut row = vec![0.0; n];
        coordinate.for_each_slope(at.q, |i, slope| row[i] += slope);
        if found.len() < dof && take(row, 1e-6) {
            found.push(k);
        }
    }
    if found.len() == dof { Ok(found) } else { Err(Singular) }
}
