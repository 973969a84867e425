//! Joint reactions and bar tensions, from the multipliers of a node.
//!
//! ```text
//! D_2 L_d + D_1 L_d − h Gᵀ λ = 0       the constraint force on q is −Gᵀ λ                       (22)
//! (f, τ) = −P_in(q²)ᵀ (G_J²)ᵀ λ_J       rows of the joint J, columns of the child
//! m = τ − ϱ² × f                         about the child's anchor
//! bar:  g = ½ (|D|² − l²),  force on its end −λ D,  tension λ l
//! row of a scalar constraint:  generalized force −λ along ∇g;  a motion θ = θ_ref(t) drives θ with −λ
//! ```
//! `f` (N) and `m` (N·m) are what the joint does to the *child*, from the parent or the ground;
//! they are given as components along the joint frame `(m_1, m_2, n)` of the parent. The internal
//! constraints of the directors have no part in this: `P_in` takes them out. A hanging body feels
//! `+m g` upwards. The thread of a screw belongs to the joint; springs,
//! dampers and motors on a joint, and prescribed motions of it, do not.
//!
//! [`Reactions`] takes the multipliers of all constraints; [`ReactionObserver`] the constraint
//! force of a node, from which `joint_wrenches` finds what joints transmit, and `bar_tensions` the
//! tensions of bars: no constraint connects bodies and point masses.
//!
//! **Uniqueness.** Where constraints are redundant, `λ` is one solution among `λ + Z c`,
//! `range Z = null Gᵀ`: a component of a reaction is unique when no column of `Z` contributes to
//! it. Then, and only then, it does not depend on the choice that was made. On trees everything is
//! unique and nothing is computed. Otherwise scattered multipliers in `null Gᵀ` contribute to every
//! component to which some column of `Z` does: combinations of the closures that do nothing [5.29],
//! or the part of multipliers of size one there ([`UnitRows`]). Multipliers have size one in units
//! of their rows [5.32]: then a force is compared with one over the lever arm, a moment with one,
//! and no unit plays a part.

pub use super::bar_tensions::BarTension;
use super::bar_tensions::BarTensions;
use super::joint_wrenches::{JointWrenches, Transmitted};
use crate::geometry::twist::Twist;
use crate::mechanism::Mechanism;
use crate::pair::joint::{FrameId, Joint};
use nalgebra::{Matrix3, Vector3};
use vi_constraints::Constraints;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::unit_rows::UnitRows;
use vi_core::Configuration;
use vi_core::linear::Singular;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_rigid::directors::{self, FRAME};

/// Contributions below this of multipliers in `null Gᵀ` of size one in units of their rows count as
/// none: moments, and forces times the lever arm, N·m.
const NO_PART: f64 = 1e-8;

/// What a joint does to its child.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction {
    /// Force along the axes, N.
    pub force: Vector3<f64>,
    /// Moment about the child's anchor along the axes, N·m.
    pub moment: Vector3<f64>,
    /// The axes, columns in space: `m_1, m_2, n` unless others are asked for.
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

/// The reactions of all joints and the tensions of all bars at a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reactions {
    /// One for each joint of the description.
    pub joints: Vec<Reaction>,
    /// One for each bar of the description.
    pub bars: Vec<BarTension>,
    /// `−λ` of each row of the scalar constraints of the description, in the order of their rows:
    /// the generalized force along the gradient of the row.
    pub scalars: Vec<BarTension>,
}

impl Reactions {
    /// At the configuration `at` with the multipliers `lambda` (shape `m`) of the same node: those
    /// of [`vi_constraints::node::Node`] at order 2, of the acceleration level at higher orders.
    #[must_use]
    pub fn at(
        mechanism: &Mechanism,
        at: Configuration<'_>,
        lambda: &[f64],
        rows: &IndependentRows,
    ) -> Self {
        let (mut jacobian, mut null) = (None, Vec::new());
        if rows.len() < mechanism.len() {
            let jacobian = update(&mut jacobian, mechanism, at);
            let mut unit_rows = UnitRows::of(mechanism);
            unit_rows.decline(mechanism.nearly_redundant().is_some());
            unit_rows.null_multipliers(jacobian, rows.len(), &mut null);
        }
        let found = ReactionSource::Multipliers(lambda, &null);
        let found = NodeReactions { mechanism, q: at.q, found, bars: None };
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
    found: ReactionSource<'a>,
    bars: Option<&'a BarTensions>, // None: by the multipliers
}

/// What the reactions of a node are read from.
#[derive(Clone, Copy, Debug)]
enum ReactionSource<'a> {
    /// Wrenches that joints transmit.
    Wrenches(&'a JointWrenches),
    /// Multipliers, and some in `null Gᵀ` that contribute to all that is not unique.
    Multipliers(&'a [f64], &'a [Vec<f64>]),
}

/// Multipliers, or what follows from those of closures alone.
#[derive(Clone, Copy)]
enum Solution<'a> {
    Wrenches(&'a JointWrenches, &'a Transmitted),
    Multipliers(&'a [f64]),
}

impl Solution<'_> {
    /// `λ` of a constraint that is none of a tree.
    fn multiplier(&self, row: usize) -> f64 {
        match self {
            Self::Wrenches(_, transmitted) => transmitted.lambda()[row],
            Self::Multipliers(lambda) => lambda[row],
        }
    }

    /// `(f, m)` of joint `k` on its child, in space; `m` about the anchor of the child.
    fn wrench(&self, mechanism: &Mechanism, k: usize, q: &[f64]) -> Twist {
        let joint = &mechanism.description().joints[k];
        if let Self::Wrenches(wrenches, transmitted) = self
            && let Some(link) = wrenches.carried_by(k)
        {
            let frame = mechanism.tree().links()[link].frame;
            let Twist { linear: f, angular: moment } = transmitted.wrench(link);
            let m = moment + (centre_of(frame, q) - anchor_of_child(joint, q)).cross(f);
            let sign = if joint.child.frame == FrameId::Frame(frame) { 1.0 } else { -1.0 };
            return Twist::new(sign * f, sign * m);
        }
        let Some((felt, sign)) = felt_by(joint) else { return Twist::zero() };
        let mut wrench = Twist::zero();
        for (i, row) in mechanism.rows_of_joint(k) {
            row.for_each_wrench(q, |frame, own| {
                if frame == felt {
                    wrench.add_scaled(-sign * self.multiplier(i), &own);
                }
            });
        }
        let Twist { linear: f, angular: moment } = wrench;
        Twist::new(f, moment + (centre_of(felt, q) - anchor_of_child(joint, q)).cross(&f))
    }
}

impl<'a> NodeReactions<'a> {
    fn solution(&self) -> Solution<'a> {
        match self.found {
            ReactionSource::Wrenches(wrenches) => Solution::Wrenches(wrenches, wrenches.found()),
            ReactionSource::Multipliers(lambda, _) => Solution::Multipliers(lambda),
        }
    }

    /// Contributions to all that is not unique.
    fn null(&self) -> impl Iterator<Item = Solution<'a>> {
        let (of_closures, of_all) = match self.found {
            ReactionSource::Wrenches(wrenches) => {
                (wrenches.null().map(|null| Solution::Wrenches(wrenches, null)), &[][..])
            }
            ReactionSource::Multipliers(_, null) => (None, null),
        };
        of_closures.into_iter().chain(of_all.iter().map(|null| Solution::Multipliers(null)))
    }

    /// Of joint `k` of the description, along its own axes `(m_1, m_2, n)`.
    #[must_use]
    pub fn joint(&self, k: usize) -> Reaction {
        let axes = self.mechanism.description().joints[k].configuration(self.q).axes();
        self.joint_along(k, &axes)
    }

    /// The same along the axes of the child.
    #[must_use]
    pub fn joint_along_child(&self, k: usize) -> Reaction {
        let axes = self.mechanism.description().joints[k].configuration(self.q).axes_child();
        self.joint_along(k, &axes)
    }

    /// The same along other axes (columns, in space).
    #[must_use]
    pub fn joint_along(&self, k: usize, axes: &Matrix3<f64>) -> Reaction {
        let Self { mechanism, q, .. } = *self;
        let joint = &mechanism.description().joints[k];
        let at = joint.configuration(q);
        let own = at.axes();
        let transmitted = |first: usize, vector: &Vector3<f64>| {
            let mut along = own.tr_mul(vector);
            (0..3).filter(|k| !joint.kind.transmits(first + k)).for_each(|k| along[k] = 0.0);
            if *axes == own { along } else { axes.tr_mul(&(own * along)) }
        };
        let components = |solution: Solution<'_>| {
            let Twist { linear, angular } = solution.wrench(mechanism, k, q);
            (transmitted(0, &linear), transmitted(3, &angular))
        };
        let (force, moment) = components(self.solution());
        let mut unique = [true; 6];
        let arm = felt_by(joint).map_or(1.0, |(felt, _)| mechanism.arm_of(felt));
        for null in self.null() {
            let (force, moment) = components(null);
            for k in 0..3 {
                unique[k] &= arm * force[k].abs() < NO_PART;
                unique[3 + k] &= moment[k].abs() < NO_PART;
            }
        }
        Reaction { force, moment, axes: *axes, axes_child: at.axes_child(), unique }
    }

    /// Of bar `k` of the description.
    #[must_use]
    pub fn bar(&self, k: usize) -> BarTension {
        if let Some(bars) = self.bars {
            return bars.of(k);
        }
        let length = self.mechanism.description().bars[k].length;
        let rows = self.mechanism.bar_rows(k);
        self.tension(length, |at| length * rows.clone().map(|row| at.multiplier(row)).sum::<f64>())
    }

    /// `−λ` of a constraint that is a row of the scalar constraints ([`Mechanism::scalar_rows`]).
    #[must_use]
    pub fn scalar_row(&self, row: usize) -> BarTension {
        self.tension(self.row_size(row), |at| -at.multiplier(row))
    }

    /// The force of scalar constraint `k` on the body that it holds to the ground, in space, N, and
    /// which of its components are unique.
    #[must_use]
    pub fn scalar_force(&self, k: usize) -> (Vector3<f64>, [bool; 3]) {
        const PART: f64 = 1e-9;
        let Self { mechanism, q, .. } = *self;
        let (mut force, mut unique) = (Vector3::zeros(), [true; 3]);
        for row in mechanism.scalar_rows(k) {
            let BarTension { force: size, unique: own } = self.scalar_row(row);
            let mut along = Vector3::zeros();
            mechanism.rows()[row - mechanism.len_internal()]
                .for_each_wrench(q, |_, w| along += w.linear);
            force += size * along;
            (0..3).for_each(|i| unique[i] &= own || along[i].abs() < PART);
        }
        (force, unique)
    }

    /// The length of a row in units of the coordinates.
    fn row_size(&self, row: usize) -> f64 {
        let Self { mechanism, q, .. } = *self;
        let first = directors::INTERNAL * mechanism.description().bodies.len();
        let mut square = 0.0;
        mechanism.rows()[row - first].for_each_wrench(q, |frame, w| {
            let arm = mechanism.arm_of(frame);
            square += arm * arm * w.linear.norm_squared() + w.angular.norm_squared();
        });
        square.sqrt()
    }

    /// What multipliers make of a row of this size.
    fn tension(&self, size: f64, of: impl Fn(Solution<'_>) -> f64) -> BarTension {
        let unique = self.null().all(|null| size * of(null).abs() < NO_PART);
        BarTension { force: of(self.solution()), unique }
    }
}

/// Reactions at one node after the other of one mechanism, its memory sized once.
#[derive(Debug)]
pub struct ReactionObserver {
    wrenches: JointWrenches,
    bars: BarTensions,
    multipliers: MultiplierSolver,
}

/// The reactions of multipliers of all constraints.
#[derive(Debug)]
struct MultiplierSolver {
    jacobian: Option<SparseMatrix>, // m × n
    unit_rows: UnitRows,
    lambda: Vec<f64>,    // m
    null: Vec<Vec<f64>>, // of shape m
}

impl ReactionObserver {
    /// For a mechanism.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Self {
        let (jacobian, unit_rows) = (None, UnitRows::of(mechanism));
        let multipliers =
            MultiplierSolver { jacobian, unit_rows, lambda: Vec::new(), null: Vec::new() };
        let (wrenches, bars) = (JointWrenches::new(mechanism), BarTensions::new(mechanism));
        Self { wrenches, bars, multipliers }
    }

    /// At a node of the same mechanism with the constraint force `force`, `Gᵀλ`, shape `n`: that of
    /// [`vi_constraints::node::Node`] at order 2, of the acceleration level at higher orders. Where
    /// rank is about to be lost, from multipliers of all constraints.
    pub fn observe<'a>(
        &'a mut self,
        mechanism: &'a Mechanism,
        at: Configuration<'a>,
        force: &[f64],
        rows: &IndependentRows,
    ) -> NodeReactions<'a> {
        let Self { wrenches, bars, multipliers } = self;
        bars.find(mechanism, at.q, force, rows);
        let found = match wrenches.find(mechanism, at.q, force) {
            Ok(()) => ReactionSource::Wrenches(wrenches),
            Err(Singular) => {
                multipliers.solve(mechanism, at, force, rows);
                ReactionSource::Multipliers(&multipliers.lambda, &multipliers.null)
            }
        };
        NodeReactions { mechanism, q: at.q, found, bars: Some(bars) }
    }
}

impl MultiplierSolver {
    fn solve(
        &mut self,
        mechanism: &Mechanism,
        at: Configuration<'_>,
        force: &[f64],
        rows: &IndependentRows,
    ) {
        let Self { jacobian, unit_rows, lambda, null } = self;
        unit_rows.decline(mechanism.nearly_redundant().is_some());
        lambda.resize(mechanism.len(), 0.0);
        let jacobian = update(jacobian, mechanism, at);
        unit_rows.multipliers(jacobian, rows.len(), force, lambda);
        unit_rows.null_multipliers(jacobian, rows.len(), null);
    }
}

/// `G` of a mechanism, in the pattern that `known` holds.
fn update<'a>(
    known: &'a mut Option<SparseMatrix>,
    mechanism: &Mechanism,
    at: Configuration<'_>,
) -> &'a SparseMatrix {
    let emit = |out: &mut dyn Entries| mechanism.jacobian(at.t, at.q, out);
    SparseMatrix::update(known, (mechanism.len(), mechanism.dim()), emit)
}

/// The body that feels the joint: the child, or the parent (with the opposite sign) when the child
/// is the ground.
fn felt_by(joint: &Joint) -> Option<(usize, f64)> {
    match (joint.child.frame, joint.parent.frame) {
        (FrameId::Frame(k), _) => Some((k, 1.0)),
        (_, FrameId::Frame(k)) => Some((k, -1.0)),
        _ => None,
    }
}

/// `φ` of a frame.
fn centre_of(frame: usize, q: &[f64]) -> Vector3<f64> {
    directors::center(&q[FRAME * frame..FRAME * (frame + 1)])
}

/// The anchor of the child of a joint, in space.
fn anchor_of_child(joint: &Joint, q: &[f64]) -> Vector3<f64> {
    let own = joint.child.coordinates(q);
    directors::center(own) + directors::triad(own) * joint.child.anchor
}
