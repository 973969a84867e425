//! The kinematic pairs: LMO08 §5, one file each.
//!
//! A pair is data: the columns of `S` ([`columns`]) and the groups of rows of `g_ex`
//! ([`constraints`]). From the columns follow the velocity map `t² = X t¹ + S τ`, the nodal
//! reparametrization `F_d`, its tangent `S'`, the joint coordinates and what a joint transmits;
//! from the constraints the rows and what removes the round-off of gap and attitude that `F_d`
//! transports.
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
//! `X = [I −â; 0 I]` ([`TwistTransfer::Rigid`]), *point of `a`* is `X = [I −â; 0 0]`
//! ([`TwistTransfer::Point`]), a column of `S` is a twist `(φ̇, ω)`. Velocity analysis: (71)–(75);
//! the pair maps: (76)–(86). The equations of R, C, P and E that the paper gives in its §5 are
//! cited without a number.
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
pub mod constraints;
pub mod cylindrical;
pub mod fixed;
pub mod free;
pub mod joint;
mod maps;
pub mod motion;
pub mod planar;
pub mod prismatic;
pub(crate) mod residual;
pub mod revolute;
pub mod screw;
pub mod spherical;
pub mod symbol;
pub mod thread;
pub mod universal;

pub use crate::geometry::twist::{Twist, TwistTransfer};
pub use motion::{FrameMotion, VelocityMap};

use crate::geometry::form::BilinearRow;
use crate::pair::columns::{Act, Axis, Column, MotionSubspace};
use crate::pair::constraints::PairConstraint;
use crate::pair::joint::{Joint, JointConfiguration};
use crate::pair::symbol::SymbolPart;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vi_core::Number;

/// The table of the pairs: a variant, its data if it has any with those of [`PairKind::ALL`], and
/// its file.
macro_rules! pairs {
    ($($(#[$doc:meta])* $variant:ident $(($data:ty = $example:expr))? in $file:ident,)*) => {
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
            $($(#[$doc])* $variant $(($data))?,)*
            /// A pair without a variant, by what defines it: shows that nothing else does.
            #[doc(hidden)]
            #[serde(skip)]
            Unlisted(&'static Properties),
        }

        impl PairKind {
            /// Every pair; the screw with an advance of 0.1 m per radian.
            pub const ALL: [Self; [$(stringify!($variant)),*].len()] =
                [$(Self::$variant $(($example))?),*];

            /// The row of the joint table.
            #[must_use]
            pub fn properties(self) -> &'static Properties {
                match self {
                    $(Self::$variant { .. } => &$file::PROPERTIES,)*
                    Self::Unlisted(properties) => properties,
                }
            }

            /// What it is drawn as.
            #[must_use]
            pub fn symbol(self) -> &'static [SymbolPart] {
                match self {
                    $(Self::$variant { .. } => $file::SYMBOL,)*
                    Self::Unlisted(_) => &[],
                }
            }
        }
    };
}

pairs! {
    /// S.
    Spherical in spherical,
    /// R.
    Revolute in revolute,
    /// C.
    Cylindrical in cylindrical,
    /// P.
    Prismatic in prismatic,
    /// E.
    Planar in planar,
    /// No relative motion.
    Fixed in fixed,
    /// H: rotation with a proportional advance.
    Screw(screw::Pitch = screw::Pitch::new(0.1)) in screw,
    /// Two crossing axes: `n` of the parent, `m_1'` of the child.
    Universal in universal,
    /// No constraint: a root of the tree.
    Free in free,
}

/// What defines a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Properties {
    /// Name in model files.
    pub name: &'static str,
    /// The columns of `S`, in the order of `τ` and `u`.
    pub motion: MotionSubspace,
    /// The rows of `g_ex`, those of the gap before those of the axes.
    pub constraints: &'static [PairConstraint],
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
    pub const ABOUT_AXIS: Self = Self::about(2);

    /// The angle about an axis of the parent.
    const fn about(i: usize) -> Self {
        let (first, second) = ((i + 1) % 3, (i + 2) % 3);
        Self::Angle { sine: [first, second], cosine: [first, first] }
    }

    /// Of a column; that of an axis of the child is about `m_1'`, after a rotation about `n`:
    /// `n = cos θ n' + sin θ m_2'`.
    const fn of(column: Column) -> Self {
        match (column.act, column.axis) {
            (Act::Slide, Axis::Parent(i) | Axis::Child(i)) => Self::Length(i),
            (_, Axis::Parent(i)) => Self::about(i),
            (_, Axis::Child(_)) => Self::Angle { sine: [1, 2], cosine: [2, 2] },
        }
    }
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

impl PairKind {
    /// Its name in model files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.properties().name
    }

    /// Number of degrees of freedom.
    #[must_use]
    pub fn dof(self) -> usize {
        self.properties().motion.dof()
    }

    /// What a degree of freedom is; `None` where there are fewer.
    #[must_use]
    pub fn degree_of_freedom(self, freedom: usize) -> Option<DegreeOfFreedom> {
        let motion = self.properties().motion;
        match motion.columns().get(freedom) {
            Some(column) => Some(DegreeOfFreedom::of(*column)),
            None if freedom >= motion.dof() => None,
            None if motion.is_angle(freedom) => Some(DegreeOfFreedom::Rotation),
            None => Some(DegreeOfFreedom::Position),
        }
    }

    /// Number of its degrees of freedom that are joint coordinates, on which springs and motors
    /// act: the rotations of spherical and free joints are none.
    #[must_use]
    pub fn coordinate_count(self) -> usize {
        self.properties().motion.columns().len()
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

    /// Whether the pair leaves everything free.
    #[must_use]
    pub fn is_free(self) -> bool {
        self.properties().motion == MotionSubspace::Free
    }

    /// Whether the pair leaves nothing free.
    #[must_use]
    pub fn is_fixed(self) -> bool {
        self.properties().motion == MotionSubspace::Fixed
    }

    /// Which degrees of freedom are angles (the others are lengths).
    #[must_use]
    pub fn is_angle(self, freedom: usize) -> bool {
        self.properties().motion.is_angle(freedom)
    }

    /// Whether the pair transmits the force (0, 1, 2) or the moment (3, 4, 5) along `m_1`, `m_2`,
    /// `n`, about the child's anchor.
    #[must_use]
    pub fn transmits(self, component: usize) -> bool {
        !self.properties().motion.frees(component)
    }

    /// Where the rotation vector of a pair begins among its degrees of freedom, if it has one.
    #[must_use]
    pub fn rotation_vector(self) -> Option<usize> {
        self.properties().motion.rotation_vector()
    }

    /// Advance of a screw, m per radian; `None` for other pairs.
    #[must_use]
    pub fn pitch(self) -> Option<f64> {
        if let Self::Screw(pitch) = self { Some(pitch.into()) } else { None }
    }

    /// The constraints `g_ex` but the thread of a screw.
    #[must_use]
    pub fn rows<T: Number>(self, joint: &Joint<T>) -> Vec<BilinearRow<T>> {
        self.properties().constraints.iter().flat_map(|group| group.rows(joint)).collect()
    }

    /// `X` and `S` at a configuration.
    #[must_use]
    pub fn velocity_map(self, at: &JointConfiguration) -> VelocityMap {
        let mut map = VelocityMap::new(TwistTransfer::None, &[]);
        self.write_velocity_map(at, &mut map);
        map
    }

    /// `F_d`: the motion of the child from that of the parent and the increments `u`.
    ///
    /// # Errors
    /// [`TooLarge`] for a rotation of more than half a revolution.
    pub fn reparametrize(
        self,
        u: &[f64],
        parent: &FrameMotion,
        at: &JointConfiguration,
    ) -> Result<FrameMotion, TooLarge> {
        maps::reparametrize(self.properties().motion, u, parent, at)
    }

    /// `X'` and `S'` at the new configuration.
    #[must_use]
    pub fn tangent(self, u: &[f64], at: &JointConfiguration) -> VelocityMap {
        let mut map = VelocityMap::new(TwistTransfer::None, &[]);
        self.write_tangent(u, at, &mut map);
        map
    }

    /// `map ← X, S` at a configuration.
    pub fn write_velocity_map(self, at: &JointConfiguration, map: &mut VelocityMap) {
        maps::write_velocity_map(self.properties().motion, at, map);
    }

    /// `map ← X', S'` at the new configuration.
    pub fn write_tangent(self, u: &[f64], at: &JointConfiguration, map: &mut VelocityMap) {
        maps::write_tangent(self.properties().motion, u, at, map);
    }

    /// Small rotation of the child that removes round-off from the relative attitude.
    #[must_use]
    pub fn attitude_correction(self, at: &JointConfiguration) -> Vector3<f64> {
        constraints::attitude_correction(self.properties().constraints, at)
    }

    /// Translation of the child that removes round-off from the gap.
    #[must_use]
    pub fn gap_correction(self, at: &JointConfiguration) -> Vector3<f64> {
        constraints::gap_correction(self.properties().constraints, at)
    }

    /// Joint coordinates at a configuration, lengths in m and angles in `(−π, π]`; the first
    /// `degrees of freedom` entries count. S and free pairs give the rotation vector of the
    /// relative attitude.
    #[must_use]
    pub fn coordinates(self, at: &JointConfiguration) -> [f64; MAX_DOF] {
        maps::coordinates(self.properties().motion, at)
    }
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
