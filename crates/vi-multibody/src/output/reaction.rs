//! Joint reactions and bar tensions, from the multipliers of a node.
//!
//! ```text
//! D_2 L_d + D_1 L_d − h Gᵀ λ = 0       the constraint force on q is −Gᵀ λ                       (22)
//! (f, τ) = −P_in(q²)ᵀ (G_J²)ᵀ λ_J       rows of the joint J, columns of the child
//! m = τ − ϱ² × f                         about the child's anchor
//! bar:  g = ½ (|D|² − l²),  force on its end −λ D,  tension λ l
//! row of a scalar constraint:  generalized force −λ along ∇g;  a motion θ = θ_ref(t) drives θ with −λ
//! ```
//! `f` (N) and `m` (N·m) are what the joint does to the *child*, from the parent or the ground; they are
//! given as components along the joint frame `(m_1, m_2, n)` of the parent. The internal constraints of
//! the directors have no part in this: `P_in` takes them out. A hanging body feels `+m g` upwards. The
//! thread of a screw belongs to the joint; springs,
//! dampers and motors on a joint, and prescribed motions of it, do not.
//!
//! **Uniqueness.** Where constraints are redundant, `λ` is one solution among `λ + Z c`, `range Z = null
//! Gᵀ`: a component of a reaction is unique when no column of `Z` contributes to it. Then, and only
//! then, it does not depend on the choice that was made (the multipliers of least norm). On trees
//! everything is unique and nothing is computed. Otherwise scattered multipliers of size one are projected onto `null Gᵀ`
//! ([`LeastNorm::null_part`]): they contribute to every component to which some column of `Z` does. Where rank is about to be lost, `Z` comes from a dense pivoted QR.

use crate::geometry::twist::Twist;
use crate::mechanism::Mechanism;
use crate::pair::joint::{FrameId, Joint};
use nalgebra::{DMatrix, Matrix3, Vector3};
use vi_constraints::Constraints;
use vi_constraints::least_norm::LeastNorm;
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_rigid::directors;

/// Contributions of null vectors below this count as none (N, N·m for multipliers of size 1).
const NO_PART: f64 = 1e-8;

/// What a joint does to its child.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction {
    /// Force along `m_1, m_2, n`, N.
    pub force: Vector3<f64>,
    /// Moment about the child's anchor along `m_1, m_2, n`, N·m.
    pub moment: Vector3<f64>,
    /// Columns `m_1, m_2, n` in space.
    pub axes: Matrix3<f64>,
    /// Columns `m_1', m_2', n'` of the child in space.
    pub axes_child: Matrix3<f64>,
    /// Which components of force and moment are unique, in this order.
    pub unique: [bool; 6],
}

impl Reaction {
    /// The force in space, N.
    #[must_use]
    pub fn force_in_space(&self) -> Vector3<f64> {
        self.axes * self.force
    }

    /// The moment about the child's anchor in space, N·m.
    #[must_use]
    pub fn moment_in_space(&self) -> Vector3<f64> {
        self.axes * self.moment
    }

    /// Along other axes (columns, in space): components of the force and of the moment that are unique in one
    /// direction only are not unique there.
    #[must_use]
    pub fn along(&self, axes: &Matrix3<f64>) -> Self {
        let [force, moment] = [0, 3].map(|k| self.unique[k..k + 3].iter().all(|unique| *unique));
        Self {
            force: axes.tr_mul(&self.force_in_space()),
            moment: axes.tr_mul(&self.moment_in_space()),
            axes: *axes,
            unique: [force, force, force, moment, moment, moment],
            ..*self
        }
    }

    /// Whether all components are unique.
    #[must_use]
    pub fn is_unique(&self) -> bool {
        self.unique == [true; 6]
    }

    /// Force and moment one after the other, `None` where a component is not unique.
    #[must_use]
    pub fn components(&self) -> [Option<f64>; 6] {
        std::array::from_fn(|k| {
            let value = if k < 3 { self.force[k] } else { self.moment[k - 3] };
            self.unique[k].then_some(value)
        })
    }
}

/// The force in a bar, or of a scalar constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tension {
    /// Of a bar, N: positive when it pulls its ends together. Of a scalar constraint, N or N·m.
    pub force: f64,
    /// Whether it is unique.
    pub unique: bool,
}

/// The reactions of all joints and the tensions of all bars at a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reactions {
    /// One for each joint of the description.
    pub joints: Vec<Reaction>,
    /// One for each bar of the description.
    pub bars: Vec<Tension>,
    /// `−λ` of each row of the scalar constraints of the description, in the order of their rows: the
    /// generalized force along the gradient of the row.
    pub scalars: Vec<Tension>,
}

impl Reactions {
    /// At the configuration `at` with the multipliers `lambda` (shape `m`) of the same node: those of
    /// [`vi_constraints::node::Node`] at order 2, of the acceleration level at higher orders.
    #[must_use]
    pub fn at(
        mechanism: &Mechanism,
        at: Configuration<'_>,
        lambda: &[f64],
        rows: &IndependentRows,
    ) -> Self {
        let mut observer = ReactionObserver::default();
        let found = observer.observe(mechanism, at, lambda, (rows, &mut LeastNorm::default()));
        let description = mechanism.description();
        let scalars = (0..description.scalars.len()).flat_map(|k| mechanism.scalar_rows(k));
        Self {
            joints: (0..description.joints.len()).map(|k| found.joint(k)).collect(),
            bars: (0..description.bars.len()).map(|k| found.bar(k)).collect(),
            scalars: scalars.map(|row| found.scalar_row(row)).collect(),
        }
    }
}

/// The reactions at a node, each found when it is asked for.
#[derive(Clone, Copy, Debug)]
pub struct NodeReactions<'a> {
    mechanism: &'a Mechanism,
    q: &'a [f64],
    lambda: &'a [f64],
    null: &'a [Vec<f64>], // multipliers in null Gᵀ that contribute to all that is not unique
}

impl NodeReactions<'_> {
    /// Of joint `k` of the description.
    #[must_use]
    pub fn joint(&self, k: usize) -> Reaction {
        let of = |lambda: &[f64]| reaction(self.mechanism, k, self.q, lambda);
        let mut found = of(self.lambda);
        for null in self.null {
            let Reaction { force, moment, .. } = of(null);
            for k in 0..3 {
                found.unique[k] &= force[k].abs() < NO_PART;
                found.unique[3 + k] &= moment[k].abs() < NO_PART;
            }
        }
        found
    }

    /// Of bar `k` of the description.
    #[must_use]
    pub fn bar(&self, k: usize) -> Tension {
        let (length, rows) =
            (self.mechanism.description().bars[k].length, self.mechanism.bar_rows(k));
        self.tension(|lambda| length * lambda[rows.clone()].iter().sum::<f64>())
    }

    /// `−λ` of a constraint that is a row of the scalar constraints ([`Mechanism::scalar_rows`]).
    #[must_use]
    pub fn scalar_row(&self, row: usize) -> Tension {
        self.tension(|lambda| -lambda[row])
    }

    fn tension(&self, of: impl Fn(&[f64]) -> f64) -> Tension {
        let unique = self.null.iter().all(|null| of(null).abs() < NO_PART);
        Tension { force: of(self.lambda), unique }
    }
}

/// Reactions at one node after the other of one mechanism, its memory sized once.
#[derive(Debug, Default)]
pub struct ReactionObserver {
    jacobian: Option<SparseMatrix>, // m × n
    scattered: Vec<f64>,            // m
    null: Vec<Vec<f64>>,            // of shape m
}

impl ReactionObserver {
    /// At a node, as [`Reactions::at`]; `least_norm` may have its factors already. Without multipliers (an empty `lambda`)
    /// nothing may be asked.
    pub fn observe<'a>(
        &'a mut self,
        mechanism: &'a Mechanism,
        at: Configuration<'a>,
        lambda: &'a [f64],
        (rows, least_norm): (&IndependentRows, &mut LeastNorm),
    ) -> NodeReactions<'a> {
        let Self { jacobian, scattered, null } = self;
        let (m, n) = (mechanism.len(), mechanism.dim());
        let is_redundant = rows.len() < m && !lambda.is_empty();
        null.resize_with(usize::from(is_redundant), Vec::new);
        if is_redundant {
            let emit = |out: &mut dyn Entries| mechanism.jacobian(at.t, at.q, out);
            let jacobian = SparseMatrix::update(jacobian, (m, n), emit);
            if scattered.len() != m {
                *scattered = (1..=m).map(|i| libm::sin(13.7 * (i * i) as f64)).collect();
            }
            null[0].clone_from(scattered);
            if least_norm.null_part(jacobian, &mut null[0]).is_err() {
                let columns = null_vectors(jacobian, rows);
                *null = columns.column_iter().map(|z| z.as_slice().to_vec()).collect();
            }
        }
        NodeReactions { mechanism, q: at.q, lambda, null }
    }
}

/// Unit columns that span `null Gᵀ`, shape `m × (m − rank)`.
///
/// At a configuration that has lost rank (a flat four-bar) there are more of them.
fn null_vectors(jacobian: &SparseMatrix, rows: &IndependentRows) -> DMatrix<f64> {
    let (m, n) = jacobian.shape();
    let mut qr = NullSpaceQr::new(m, n);
    let rank = qr.factorize_scaled(&jacobian.to_dense().transpose(), |_| 1.0).min(rows.len());
    let mut out = DMatrix::zeros(m, m - rank);
    qr.null_space(rank, &mut out);
    out
}

/// The body that feels the joint: the child, or the parent (with the opposite sign) when the child is
/// the ground.
fn felt_by(joint: &Joint) -> Option<(usize, f64)> {
    match (joint.child.frame, joint.parent.frame) {
        (FrameId::Frame(k), _) => Some((k, 1.0)),
        (_, FrameId::Frame(k)) => Some((k, -1.0)),
        _ => None,
    }
}

/// `(f, m)` of joint `k` on its child, with the multipliers `lambda`.
fn reaction(mechanism: &Mechanism, k: usize, q: &[f64], lambda: &[f64]) -> Reaction {
    let joint = &mechanism.description().joints[k];
    let at = joint.configuration(q);
    let (axes, axes_child) = (at.axes(), at.axes_child());
    let (mut f, mut m) = (Vector3::zeros(), Vector3::zeros());
    if let Some((felt, sign)) = felt_by(joint) {
        let mut wrench = Twist::zero();
        for (i, row) in mechanism.rows_of_joint(k) {
            row.for_each_wrench(q, |frame, own| {
                if frame == felt {
                    wrench.add_scaled(-lambda[i], &own);
                }
            });
        }
        let arm = match joint.child.frame {
            FrameId::Frame(_) => at.rho_child(),
            FrameId::Ground => joint.child.anchor - directors::center(&q[12 * felt..]),
        };
        f = sign * wrench.linear;
        m = sign * (wrench.angular - arm.cross(&wrench.linear));
    }
    let (force, moment) = (axes.tr_mul(&f), axes.tr_mul(&m));
    Reaction { force, moment, axes, axes_child, unique: [true; 6] }
}
