//! The kinematic pairs: LMO08 §5, one file each with the same sections in the same order.
//!
//! 1. constraints `g_ex` as rows,
//! 2. velocity map: `t² = X t¹ + S τ` at a configuration,
//! 3. nodal reparametrization `F_d`: the motion of the child from that of the parent,
//! 4. tangent: `S'` at the new configuration, with the tangent map of the increments,
//! 5. removal of the round-off that the map transports: gap and relative attitude,
//! 6. joint coordinates.
//!
//! # The joint table
//!
//! | pair | constraints `g_ex` | degrees of freedom | `τ` | velocity map `X`; columns of `S` | LMO08 |
//! |---|---|---|---|---|---|
//! | [`spherical`] S | `r` | 3 | `ω²` | point of `ϱ¹`; `(ϱ²×e_k, e_k)` | (79), (82), (84)–(86) |
//! | [`revolute`] R | `r`; `n·m_1'`, `n·m_2'` | 1 | `θ̇` | rigid by `c`; `(ϱ²×n, n)` | §5 |
//! | [`cylindrical`] C | `m_1·r`, `m_2·r`; `n·m_1'`, `n·m_2'` | 2 | `(u̇, θ̇)` | rigid by `c`; `(n, 0)`, `(ϱ²×n, n)` | §5 |
//! | [`prismatic`] P | `m_1·r`, `m_2·r`; `m_1·m_2'`, `m_2·n'`, `n·m_1'` | 1 | `u̇` | rigid by `c`; `(n, 0)` | §5 |
//! | [`planar`] E | `n·r`; `n·m_1'`, `n·m_2'` | 3 | `(u̇_1, u̇_2, θ̇)` | rigid by `c`; `(m_1, 0)`, `(m_2, 0)`, `(ϱ²×n, n)` | §5 |
//! | [`fixed`] | `r`; `m_1·m_2'`, `m_2·n'`, `n·m_1'` | 0 | | rigid by `c`; none | not in the paper |
//! | [`screw`] H | `m_1·r`, `m_2·r`; `n·m_1'`, `n·m_2'`; `n·r − p θ` | 1 | `θ̇` | rigid by `c`; `(p n + ϱ²×n, n)` | not in the paper |
//! | [`universal`] | `r`; `n·m_1'` | 2 | `(θ̇_1, θ̇_2)` | rigid by `c`; `(ϱ²×n, n)`, `(ϱ²×m_1', m_1')` | not in the paper |
//! | [`free`] | none | 6 | `(φ̇², ω²)` | none; `(e_k, 0)`, `(0, e_k)` | (59), (61) |
//!
//! `r` counts three rows, every product one; each row but the thread
//! of a screw is of degree ≤ 2 in `q`. *Rigid by `a`* is
//! `X = [I −â; 0 I]` ([`Transfer::Rigid`]), *point of `a`* is `X = [I −â; 0 0]`
//! ([`Transfer::Point`]), a column of `S` is a twist `(φ̇, ω)`. Velocity analysis: (71)–(75); the
//! pair maps: (76)–(86). The equations of R, C, P and E that the paper gives in its §5 are cited
//! without a number.
//!
//! `F_d` takes the increments `u` of the joint and the motion `(Δφ¹, A¹)` of the parent;
//! `ϱ¹, ϱ², r, c` and all axes on the right are those of `q_n`, and `d²_{I,n+1} = A² d²_{I,n}`
//! throughout:
//!
//! ```text
//!        .-.
//!  1 ---( o )--- 2      S    A² = exp(ϑ̂)
//!        `-'                 φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹ − A²ϱ²                   (84)–(86)
//!
//!        | n
//!  1 --[=|=]--- 2       R    A² = A¹ exp(ϑ n̂)
//!        | ϑ                 φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹ − A²ϱ²
//!
//!        ^ n
//!  1 --[ | ]--- 2       C    A² = A¹ exp(ϑ n̂)
//!        v u, ϑ              φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹ + r + u n) − A²ϱ²
//!
//!     ________
//!  1 |==[ 2 ]==> n      P    A² = A¹
//!     --------   u           φ²_{n+1} = φ¹_{n+1} + A¹(c + u n)
//!
//!        ^ n
//!     ___|__2__         E    A² = A¹ exp(ϑ n̂)
//!  1 /_________/             φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹ + r + u_1 m_1 + u_2 m_2) − A²ϱ²
//!     m_1, m_2
//!
//!  1 ===[#]=== 2        fixed       A² = A¹
//!                                   φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹ − A²ϱ²
//!
//!        ^ n, u = p ϑ
//!  1 --[/|/]--- 2       screw       A² = A¹ exp(ϑ n̂)
//!        | ϑ                        φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹ + r + p ϑ n) − A²ϱ²
//!
//!        | n
//!  1 --<-+->-- 2        universal   A² = A¹ exp(ϑ_1 n̂) exp(ϑ_2 m̂_1')
//!       / m_1'                      φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹ − A²ϱ²
//!
//!              2        free        A² = exp(θ̂)
//!                                   φ²_{n+1} = φ²_n + u_φ                        (61)
//! ```
//!
//! The tangent `∂F_d/∂u` is the velocity map at `q_{n+1}`. Only where `u` is a rotation vector does
//! a factor enter: `δω² = T(ϑ) δϑ` for S, `δω² = T(θ) δθ` for a free root. The others need none,
//! since `A¹ n_n = n_{n+1}`.

pub mod columns;
pub mod cylindrical;
pub mod fixed;
pub mod free;
pub mod joint;
pub mod motion;
pub mod planar;
pub mod prismatic;
pub(crate) mod residual;
pub mod revolute;
pub mod screw;
pub mod spherical;
pub mod universal;

pub use crate::geometry::twist::{Transfer, Twist};
pub use motion::{Motion, VelocityMap};

use crate::geometry::form::{Form, Row};
use crate::pair::columns::MotionSubspace;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use vi_rigid::rotation;

/// Which kinematic pair.
///
/// ```
/// use vi_multibody::PairKind;
///
/// for kind in PairKind::ALL {
///     println!("{}: {} degrees of freedom", kind.name(), kind.dof());
///     assert_eq!(kind.dof() + kind.constraints(), 6);
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PairKind {
    /// S.
    Spherical,
    /// R.
    Revolute,
    /// C.
    Cylindrical,
    /// P.
    Prismatic,
    /// E.
    Planar,
    /// No relative motion.
    Fixed,
    /// Two crossing axes: `n` of the parent, `m_1'` of the child.
    Universal,
    /// H: rotation with a proportional advance.
    Screw(screw::Pitch),
    /// No constraint: a root of the tree.
    Free,
}

/// What is constant for a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Properties {
    /// Name in model files.
    pub name: &'static str,
    /// Its degrees of freedom, in the order of `τ` and `u`.
    pub dof: &'static [DegreeOfFreedom],
    /// The columns of `S`.
    pub motion: MotionSubspace,
}

/// What a degree of freedom of a pair is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DegreeOfFreedom {
    /// The gap along `m_1`, `m_2` or `n` of the parent (0, 1, 2), m.
    Length(usize),
    /// `atan2(s, c)`, rad; each the product of an axis of the child and an axis of the parent, by
    /// number.
    Angle {
        /// Child and parent axis of `s`.
        sine: [usize; 2],
        /// Child and parent axis of `c`.
        cosine: [usize; 2],
    },
    /// A coordinate of the centre of a free frame, m: no joint coordinate.
    Position,
    /// A component of a rotation vector: no joint coordinate.
    Rotation,
}

impl DegreeOfFreedom {
    /// The angle about `n` from `m_1` to `m_1'`.
    pub const ABOUT_AXIS: Self = Self::Angle { sine: [0, 1], cosine: [0, 0] };
}

/// The largest number of degrees of freedom of a pair.
pub const MAX_DOF: usize = 6;

/// A rotation of more than half a revolution about the unknown with this index within the joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TooLarge {
    /// First degree of freedom of the rotation.
    pub index: usize,
    /// Its size, rad.
    pub angle: f64,
}

#[inline]
pub(crate) fn check(angle: f64, index: usize) -> Result<(), TooLarge> {
    if angle.abs() <= rotation::MAX_ROTATION { Ok(()) } else { Err(TooLarge { index, angle }) }
}

/// Rotation about the joint axis `n_n` by `angle`, less the identity.
#[inline]
pub(crate) fn about(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    rotation::exp_minus_identity(&(angle * axis))
}

/// The rows `n·m_1'`, `n·m_2'`: parallel axes.
pub(crate) fn parallel_axes(joint: &Joint) -> Vec<Row> {
    let n = joint.parent.axis(2);
    vec![
        Row::product(n.clone(), joint.child.axis(0), 0.0),
        Row::product(n, joint.child.axis(1), 0.0),
    ]
}

/// The rows `m_1·m_2'`, `m_2·n'`, `n·m_1'`: equal attitude.
pub(crate) fn equal_attitude(joint: &Joint) -> Vec<Row> {
    let row = |i: usize, j: usize| Row::product(joint.parent.axis(i), joint.child.axis(j), 0.0);
    vec![row(0, 1), row(1, 2), row(2, 0)]
}

/// The rows `m_1·r`, `m_2·r`: the gap stays on the axis.
pub(crate) fn gap_on_axis(joint: &Joint, gap: &Form) -> Vec<Row> {
    (0..2).map(|i| Row::product(joint.parent.axis(i), gap.clone(), 0.0)).collect()
}

/// Small rotation that brings `n'` onto `n`.
pub(crate) fn align_axis(at: &JointConfiguration) -> Vector3<f64> {
    at.axis_child(2).cross(&at.axis(2))
}

/// Small rotation that brings `(m_1', m_2', n')` onto `(m_1, m_2, n)`.
pub(crate) fn align_attitude(at: &JointConfiguration) -> Vector3<f64> {
    (0..3).map(|i| at.axis_child(i).cross(&at.axis(i))).sum::<Vector3<f64>>() * 0.5
}

/// Angle from `m_1` to `m_1'` about `n`, in `(−π, π]`.
pub(crate) fn angle_about_axis(at: &JointConfiguration) -> f64 {
    libm::atan2(at.axis_child(0).dot(&at.axis(1)), at.axis_child(0).dot(&at.axis(0)))
}

/// Translation of the child's centre that removes the part of the gap in directions that the pair
/// does not allow.
pub(crate) fn close_gap(at: &JointConfiguration, allowed: &[usize]) -> Vector3<f64> {
    let mut gap = at.gap();
    for &i in allowed {
        gap -= at.axis(i) * at.axis(i).dot(&at.gap());
    }
    -gap
}

/// `$body` with the module of the pair as `$pair`.
macro_rules! each_pair {
    ($kind:expr, $pair:ident => $body:expr) => {
        each_pair!($kind, $pair, $body;
            Spherical spherical, Revolute revolute, Cylindrical cylindrical, Prismatic prismatic,
            Planar planar, Fixed fixed, Screw screw, Universal universal, Free free)
    };
    ($kind:expr, $pair:ident, $body:expr; $($variant:ident $file:ident),*) => {
        match $kind {
            $(PairKind::$variant { .. } => {
                use $file as $pair;
                $body
            })*
        }
    };
}

impl PairKind {
    /// Every pair; the screw with an advance of 0.1 m per radian.
    pub const ALL: [Self; 9] = [
        Self::Spherical,
        Self::Revolute,
        Self::Cylindrical,
        Self::Prismatic,
        Self::Planar,
        Self::Fixed,
        Self::Screw(screw::Pitch::new(0.1)),
        Self::Universal,
        Self::Free,
    ];

    /// The row of the joint table.
    #[must_use]
    pub fn properties(self) -> &'static Properties {
        each_pair!(self, pair => &pair::PROPERTIES)
    }

    /// Its name in model files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.properties().name
    }

    /// Number of degrees of freedom.
    #[must_use]
    pub fn dof(self) -> usize {
        self.properties().dof.len()
    }

    /// Number of its degrees of freedom that are joint coordinates, on which springs and motors
    /// act: the rotations of spherical and free joints are none.
    #[must_use]
    pub fn coordinate_count(self) -> usize {
        let coordinate = |f: &&DegreeOfFreedom| {
            matches!(f, DegreeOfFreedom::Length(_) | DegreeOfFreedom::Angle { .. })
        };
        self.properties().dof.iter().filter(coordinate).count()
    }

    /// Number of constraints `m_ex`.
    #[must_use]
    pub fn constraints(self) -> usize {
        6 - self.dof()
    }

    /// Whether the pair needs an axis.
    #[must_use]
    pub fn has_axis(self) -> bool {
        self.properties().motion.has_axis()
    }

    /// Whether the pair leaves no gap at all.
    #[must_use]
    pub fn closes_gap(self) -> bool {
        self.properties().motion.closes_gap()
    }

    /// Which degrees of freedom are angles (the others are lengths).
    #[must_use]
    pub fn is_angle(self, freedom: usize) -> bool {
        matches!(
            self.properties().dof[freedom],
            DegreeOfFreedom::Angle { .. } | DegreeOfFreedom::Rotation
        )
    }

    /// Whether the pair transmits the force (0, 1, 2) or the moment (3, 4, 5) along `m_1`, `m_2`,
    /// `n`, about the child's anchor.
    #[must_use]
    pub fn transmits(self, component: usize) -> bool {
        let is_free = |freedom: &DegreeOfFreedom| match *freedom {
            DegreeOfFreedom::Length(axis) => component == axis,
            DegreeOfFreedom::Position => component < 3,
            DegreeOfFreedom::Rotation => component >= 3,
            about => component == 5 && about == DegreeOfFreedom::ABOUT_AXIS,
        };
        self.pitch().is_some() || !self.properties().dof.iter().any(is_free)
    }

    /// Where the rotation vector of a pair begins among its degrees of freedom, if it has one.
    #[must_use]
    pub fn rotation_vector(self) -> Option<usize> {
        self.properties().dof.iter().position(|f| *f == DegreeOfFreedom::Rotation)
    }

    /// Advance of a screw, m per radian; `None` for other pairs.
    #[must_use]
    pub fn pitch(self) -> Option<f64> {
        if let Self::Screw(pitch) = self { Some(pitch.into()) } else { None }
    }

    /// The constraints `g_ex`.
    #[must_use]
    pub fn rows(self, joint: &Joint) -> Vec<Row> {
        each_pair!(self, pair => pair::rows(joint))
    }

    /// `X` and `S` at a configuration.
    #[must_use]
    pub fn velocity_map(self, at: &JointConfiguration) -> VelocityMap {
        each_pair!(self, pair => pair::velocity_map(at))
    }

    /// `F_d`: the motion of the child from that of the parent and the increments `u`.
    ///
    /// # Errors
    /// [`TooLarge`] for a rotation of more than half a revolution.
    pub fn reparametrize(
        self,
        u: &[f64],
        parent: &Motion,
        at: &JointConfiguration,
    ) -> Result<Motion, TooLarge> {
        each_pair!(self, pair => pair::reparametrize(u, parent, at))
    }

    /// `X'` and `S'` at the new configuration.
    #[must_use]
    pub fn tangent(self, u: &[f64], at: &JointConfiguration) -> VelocityMap {
        each_pair!(self, pair => pair::tangent(u, at))
    }

    /// `map ← X, S` at a configuration.
    pub fn write_velocity_map(self, at: &JointConfiguration, map: &mut VelocityMap) {
        each_pair!(self, pair => map.copy_from(&pair::velocity_map(at)));
    }

    /// `map ← X', S'` at the new configuration.
    pub fn write_tangent(self, u: &[f64], at: &JointConfiguration, map: &mut VelocityMap) {
        each_pair!(self, pair => map.copy_from(&pair::tangent(u, at)));
    }

    /// Small rotation of the child that removes round-off from the relative attitude.
    #[must_use]
    pub fn attitude_correction(self, at: &JointConfiguration) -> Vector3<f64> {
        each_pair!(self, pair => pair::attitude_correction(at))
    }

    /// Translation of the child that removes round-off from the gap.
    #[must_use]
    pub fn gap_correction(self, at: &JointConfiguration) -> Vector3<f64> {
        each_pair!(self, pair => pair::gap_correction(at))
    }

    /// Joint coordinates at a configuration, lengths in m and angles in `(−π, π]`; the first
    /// `degrees of freedom` entries count. S and free pairs give the rotation vector of the
    /// relative attitude.
    #[must_use]
    pub fn coordinates(self, at: &JointConfiguration) -> [f64; MAX_DOF] {
        each_pair!(self, pair => pair::coordinates(at))
    }
}

/// Rotation vector of the relative attitude `(m', n')` against `(m, n)`, in inertial components.
pub(crate) fn relative_rotation_vector(at: &JointConfiguration) -> Vector3<f64> {
    rotation::vector(&(at.axes_child() * at.axes().transpose()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::scalar_constraint::ScalarRow;
    use crate::pair::joint::{FrameId, Joint, Side, complete_axis};
    use vi_rigid::directors;
    use vi_testkit::Sample;

    /// In a configuration of the pair no constraint has a force or a moment along what it leaves
    /// free, and some constraint has one along all else; the thread of a screw is none of these
    /// rows, and one axis of a universal pair is the child's.
    #[test]
    fn pairs_transmit_what_their_constraints_exert() {
        let mut sample = Sample::new(3);
        for kind in PairKind::ALL {
            let (parent, child) = (sample.frame(), sample.frame());
            let (point, axes) = (sample.vector(), complete_axis(&sample.vector().normalize()));
            let side = |k: usize, q: &[f64]| Side::at(FrameId::Frame(k), q, &point, &axes);
            let (parent_side, child_side) = (side(0, &parent), side(1, &child));
            let name = "joint".to_owned();
            let joint = Joint { name, kind, parent: parent_side, child: child_side };
            let q = [parent, child].concat();
            let mut largest = [0.0_f64; 6];
            for row in kind.rows(&joint).into_iter().map(ScalarRow::Product) {
                let mut wrench = Twist::zero(); // on the child
                row.for_each_wrench(&q, |frame, part| {
                    wrench.add_scaled(f64::from(u8::from(frame == 1)), &part);
                });
                let arm = point - directors::center(&q[12..]);
                let moment = wrench.angular - arm.cross(&wrench.linear);
                let own = [axes.tr_mul(&wrench.linear), axes.tr_mul(&moment)];
                let own = own.iter().flatten();
                largest.iter_mut().zip(own).for_each(|(l, w)| *l = l.max(w.abs()));
            }
            let transmitted: [bool; 6] = largest.map(|largest| largest > 1e-12);
            println!("{kind:?}: {transmitted:?}");
            let own: [bool; 6] = std::array::from_fn(|k| kind.transmits(k));
            let has_more = matches!(kind, PairKind::Universal | PairKind::Screw(_));
            let covers = transmitted.iter().zip(own).all(|(&row, own)| own || !row);
            assert!(covers && (has_more || transmitted == own), "{kind:?}: {own:?}");
        }
    }
}
