//! A joint between two frames: kind, anchors, axes.
//!
//! ```text
//! ϱ^α  anchor in frame α (from φ^α)             (63)
//! n    axis, m_1, m_2 complete it to a right-handed orthonormal triad fixed in the parent   (62)
//! n', m_1', m_2'  fixed in the child, equal to n, m_1, m_2 in the reference configuration
//! r = φ² + ϱ² − φ¹ − ϱ¹  gap,   c = φ² − φ¹
//! ```
//! Source: LMO08 §5.1.

use crate::geometry::form::Form;
use crate::pair::PairKind;
use nalgebra::{Matrix3, Vector3};
use vi_core::Number;
use vi_rigid::directors;

/// A frame, or the ground (origin at 0, directors the inertial base).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameId {
    /// The ground.
    Ground,
    /// The frame with this index.
    Frame(usize),
}

/// The coordinates of the ground as a frame.
pub const GROUND: [f64; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// One side of a joint: everything fixed in that frame, as components in its directors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side<T = f64> {
    /// Which frame.
    pub frame: FrameId,
    /// `ϱ`: anchor from `φ`.
    pub anchor: Vector3<T>,
    /// Columns `m_1, m_2, n` (on the child: `m_1', m_2', n'`).
    pub axes: Matrix3<T>,
}

impl Side {
    /// The side of `frame` that meets a world point and world axes (columns `m_1, m_2, n`) in the
    /// configuration `q` of the frame (12 numbers).
    #[must_use]
    pub fn at(frame: FrameId, q: &[f64], point: &Vector3<f64>, axes: &Matrix3<f64>) -> Self {
        Self::placed(frame, &directors::center(q), &directors::triad(q), point, axes)
    }

    /// The coordinates of the frame within `q` (all frames, 12 numbers each).
    #[must_use]
    pub fn coordinates<'a>(&self, q: &'a [f64]) -> &'a [f64] {
        match self.frame {
            FrameId::Ground => &GROUND,
            FrameId::Frame(k) => &q[12 * k..12 * k + 12],
        }
    }
}

impl<T: Number> Side<T> {
    /// The same of a frame with centre and triad (columns).
    #[must_use]
    pub fn placed(
        frame: FrameId,
        center: &Vector3<T>,
        triad: &Matrix3<T>,
        point: &Vector3<T>,
        axes: &Matrix3<T>,
    ) -> Self {
        let inverse = triad.transpose();
        Self { frame, anchor: inverse * (point - center), axes: inverse * axes }
    }

    /// The anchor point as a form.
    #[must_use]
    pub fn point(&self) -> Form<T> {
        match self.frame {
            FrameId::Ground => Form::constant(self.anchor),
            FrameId::Frame(k) => Form::point(12 * k, &self.anchor),
        }
    }

    /// Axis `i` (0: `m_1`, 1: `m_2`, 2: `n`) as a form.
    #[must_use]
    pub fn axis(&self, i: usize) -> Form<T> {
        let components: Vector3<T> = self.axes.column(i).into();
        match self.frame {
            FrameId::Ground => Form::constant(components),
            FrameId::Frame(k) => Form::vector(12 * k, &components),
        }
    }
}

/// A joint.
///
/// ```
/// use nalgebra::Vector3;
/// use vi_multibody::PairKind;
/// use vi_multibody::joint::{FrameId, GROUND, Joint, Side, complete_axis};
///
/// // a hinge about y at (1, 0, 0) between the ground and a frame whose triad is that of space
/// let (point, axes) = (Vector3::x(), complete_axis(&Vector3::y()));
/// let frame = GROUND; // centre and directors (φ, d_1, d_2, d_3)
/// let hinge = Joint {
///     name: "hinge".into(),
///     kind: PairKind::Revolute,
///     parent: Side::at(FrameId::Ground, &GROUND, &point, &axes),
///     child: Side::at(FrameId::Frame(0), &frame, &point, &axes),
/// };
/// let at = hinge.configuration(&frame);
/// assert!(at.gap().norm() < 1e-15 && (at.axis(2) - Vector3::y()).norm() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Joint<T = f64> {
    /// Its name.
    pub name: String,
    /// Which kinematic pair.
    pub kind: PairKind,
    /// The side of body 1.
    pub parent: Side<T>,
    /// The side of body 2.
    pub child: Side<T>,
}

impl Joint {
    /// The same joint seen from the other side.
    ///
    /// All pairs describe the same set of relative configurations from either side.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let kind = self.kind;
        let (mut parent, mut child) = (self.child, self.parent);
        if kind.properties().motion.swaps_axes() {
            // the axis of the parent comes first: swap the roles of m_1 and n
            for side in [&mut parent, &mut child] {
                side.axes.swap_columns(0, 2);
                side.axes.column_mut(1).neg_mut(); // right-handed again
            }
        }
        Self { name: self.name.clone(), kind, parent, child }
    }

    /// The vectors of the joint in the configuration `q` of all frames.
    #[must_use]
    pub fn configuration<'a>(&'a self, q: &'a [f64]) -> JointConfiguration<'a> {
        JointConfiguration::new(self, self.parent.coordinates(q), self.child.coordinates(q))
    }
}

impl<T: Number> Joint<T> {
    /// The gap `r` as a form.
    #[must_use]
    pub fn gap(&self) -> Form<T> {
        self.child.point().minus(&self.parent.point())
    }
}

/// A right-handed orthonormal triad `(m_1, m_2, n)` for a unit axis `n`.
#[must_use]
pub fn complete_axis<T: Number>(n: &Vector3<T>) -> Matrix3<T> {
    let smallest = n.iamin();
    let m1 = n.cross(&Vector3::ith(smallest, T::of(1.0))).normalize();
    Matrix3::from_columns(&[m1, n.cross(&m1), *n])
}

/// The same with an `m_1` that is fixed in the frame whose axes are the columns of `frame`: it
/// turns with that frame, and with whatever turns frame and axis together, to rounding.
#[must_use]
pub fn complete_axis_in<T: Number>(frame: &Matrix3<T>, n: &Vector3<T>) -> Matrix3<T> {
    // components of an axis along a diagonal or an axis of the frame are equal but for rounding
    const EQUAL: f64 = 1e-6;
    let own = frame.tr_mul(n).abs();
    let least = own.min() + T::of(EQUAL);
    let smallest = own.iter().position(|component| *component <= least).unwrap_or(0);
    let m1 = n.cross(&frame.column(smallest)).normalize();
    Matrix3::from_columns(&[m1, n.cross(&m1), *n])
}

/// The axes `m_1, m_2, n` (columns) with `n` along `axis`, and `m_1` in the half plane of `second`.
#[must_use]
pub fn axes_along<T: Number>(axis: &Vector3<T>, second: &Vector3<T>) -> Matrix3<T> {
    let n = axis.normalize();
    let m1 = (second - n * n.dot(second)).normalize();
    Matrix3::from_columns(&[m1, n.cross(&m1), n])
}

/// The vectors of a joint in one configuration, spatial components.
///
/// Each is computed where it is asked for: most pairs need few of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointConfiguration<'a> {
    joint: &'a Joint,
    parent: &'a [f64], // 12  frame of the parent
    child: &'a [f64],  // 12
}

impl<'a> JointConfiguration<'a> {
    /// From the coordinates of both frames, 12 numbers each.
    #[must_use]
    #[inline]
    pub fn new(joint: &'a Joint, parent: &'a [f64], child: &'a [f64]) -> Self {
        Self { joint, parent, child }
    }

    /// `ϱ¹`.
    #[must_use]
    #[inline]
    pub fn rho_parent(&self) -> Vector3<f64> {
        directors::triad(self.parent) * self.joint.parent.anchor // (63)
    }

    /// `ϱ²`.
    #[must_use]
    #[inline]
    pub fn rho_child(&self) -> Vector3<f64> {
        directors::triad(self.child) * self.joint.child.anchor
    }

    /// `c = φ² − φ¹`.
    #[must_use]
    #[inline]
    pub fn c(&self) -> Vector3<f64> {
        directors::center(self.child) - directors::center(self.parent)
    }

    /// `r = φ² + ϱ² − φ¹ − ϱ¹`.
    #[must_use]
    #[inline]
    pub fn gap(&self) -> Vector3<f64> {
        self.c() + self.rho_child() - self.rho_parent()
    }

    /// Advance per radian of a screw, m; 0 for other pairs.
    #[must_use]
    pub fn pitch(&self) -> f64 {
        self.joint.kind.pitch().unwrap_or(0.0)
    }

    /// Columns `m_1, m_2, n`.
    #[must_use]
    pub fn axes(&self) -> Matrix3<f64> {
        directors::triad(self.parent) * self.joint.parent.axes // (62)
    }

    /// Columns `m_1', m_2', n'`.
    #[must_use]
    pub fn axes_child(&self) -> Matrix3<f64> {
        directors::triad(self.child) * self.joint.child.axes
    }

    /// `m_1` (0), `m_2` (1) or `n` (2).
    #[must_use]
    #[inline]
    pub fn axis(&self, i: usize) -> Vector3<f64> {
        directors::triad(self.parent) * self.joint.parent.axes.column(i)
    }

    /// `m_1'` (0), `m_2'` (1) or `n'` (2).
    #[must_use]
    #[inline]
    pub fn axis_child(&self, i: usize) -> Vector3<f64> {
        directors::triad(self.child) * self.joint.child.axes.column(i)
    }
}
