//! Reactions of joints, tensions of bars and efforts of constraints with their derivatives.
//!
//! ```text
//! y = −σ Σ_i λ_i G_i ξ       rows of a joint; ξ: the motion of its child along a component
//!     force along e: ξ = (e, 0);   moment about e: ξ = (e × (φ − x), e × d_I),  x: child's anchor
//! ∂y/∂λ_i = −σ G_i ξ,   ∂y/∂q = −σ (Σ λ_i D²g_i) ξ − σ ξ_qᵀ Gᵀλ,   y_θ = −σ λ·(G_θ ξ + G ξ_θ)
//! y = −λ·G ξ, ξ = (e, 0)    the force of a wheel or a blade on its body, along e in space
//! y = c Σ λ_i                a tension, an effort along a row
//! ```
//! `ξ` is a rigid motion, in which directors do no work; `σ = 1` but for a child that is the
//! ground, whose parent moves then, `σ = −1`. The components are those of
//! [`crate::reaction::Reaction`]: along the axes of the parent, of the child or of space, of what
//! the joint transmits. `ξ` and its derivatives follow from one function of dual numbers.
#![allow(non_snake_case)] // G

use super::rows::MovedRows;
use super::velocity::emit_minus_transposed;
use super::{DesignError, MechanismTangent, ScalarTangent};
use crate::constraint::scalar_constraint::ScalarRow;
use crate::mechanism::Mechanism;
use crate::pair::joint::{FrameId, Joint, Side};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;
use vi_constraints::Constraints;
use vi_core::num_dual::Dual64;
use vi_core::{Configuration, Number};
use vi_rigid::directors::FRAME;

/// Along whose axes a reaction is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// `m_1, m_2, n` of the parent.
    Parent,
    /// `m_1', m_2', n'` of the child.
    Child,
    /// Those of space.
    Space,
}

/// A number that follows from the multipliers of a node.
#[derive(Clone, Debug)]
pub enum ForceNumber {
    /// A component of the reaction of a joint: three of the force (N), three of the moment (N·m).
    Reaction {
        /// The joint of the description.
        joint: usize,
        /// The axes.
        axes: Axes,
        /// Which of the six.
        part: usize,
    },
    /// A component in space of the force of what holds one body to the ground, of a wheel or a
    /// blade, N.
    Carried {
        /// The scalar constraint of the description.
        scalar: usize,
        /// The body.
        frame: usize,
        /// Which component.
        axis: usize,
    },
    /// `c Σ λ_i`.
    Rows {
        /// Which constraints.
        rows: Range<usize>,
        /// `c`.
        factor: f64,
        /// Of what.
        of: ReactionRows,
    },
}

/// What rows of constraints are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReactionRows {
    /// A bar of the description: `c = l`.
    Bar(usize),
    /// A scalar constraint of the description.
    Scalar(usize),
}

/// How such a number changes with a parameter at fixed `q` and `λ`.
pub struct MovedForce {
    rows: MovedRows,
    joint: Option<Joint<Dual64>>,
    factor: f64, // c_θ
}

impl std::fmt::Debug for MovedForce {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MovedForce").field("factor", &self.factor).finish_non_exhaustive()
    }
}

/// The frame that feels a joint: its child, or its parent with the opposite sign where that is the
/// ground.
fn felt<T>(joint: &Joint<T>) -> Option<(usize, f64)> {
    match (joint.child.frame, joint.parent.frame) {
        (FrameId::Frame(k), _) => Some((k, 1.0)),
        (_, FrameId::Frame(k)) => Some((k, -1.0)),
        _ => None,
    }
}

/// Centre and directors of a frame.
fn place<T: Number>(frame: FrameId, q: &impl Fn(usize) -> T) -> (Vector3<T>, Matrix3<T>) {
    match frame {
        FrameId::Ground => (Vector3::zeros(), Matrix3::identity()),
        FrameId::Frame(k) => {
            let at = |i: usize, vector: usize| q(FRAME * k + 3 * vector + i);
            let center = Vector3::from_fn(|i, _| at(i, 0));
            (center, Matrix3::from_fn(|i, j| at(i, 1 + j)))
        }
    }
}

/// `ξ` of the frame that feels a joint.
fn motion<T: Number>(
    joint: &Joint<T>,
    (axes, part): (Axes, usize),
    q: &impl Fn(usize) -> T,
) -> [T; FRAME] {
    let triad = |side: &Side<T>| place(side.frame, q).1 * side.axes;
    let own = triad(&joint.parent);
    let first = part / 3 * 3;
    let transmits = |k: usize| joint.kind.transmits(first + k);
    let zero = T::of(0.0);
    let masked = |mut along: Vector3<T>| {
        (0..3).filter(|k| !transmits(*k)).for_each(|k| along[k] = zero);
        own * along
    };
    let along = match axes {
        Axes::Parent => Vector3::ith(part % 3, T::of(1.0)),
        Axes::Child => own.tr_mul(&triad(&joint.child).column(part % 3)),
        Axes::Space => own.tr_mul(&Vector3::ith(part % 3, T::of(1.0))),
    };
    let e = masked(along);
    let mut motion = [zero; FRAME];
    let mut set = |vector: usize, x: Vector3<T>| {
        (0..3).for_each(|i| motion[3 * vector + i] = x[i]);
    };
    let Some((frame, _)) = felt(joint) else { return motion };
    if first == 0 {
        set(0, e);
        return motion;
    }
    let (center, directors) = place(FrameId::Frame(frame), q);
    let (of_child, axes_of_child) = place(joint.child.frame, q);
    let anchor = of_child + axes_of_child * joint.child.anchor;
    set(0, e.cross(&(center - anchor)));
    (0..3).for_each(|i| set(1 + i, e.cross(&directors.column(i).into_owned())));
    motion
}

/// `Σ a_i b_i`.
fn sum(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    pairs.map(|(a, b)| a * b).sum()
}

/// A component of a reaction at a configuration.
struct Component<'a> {
    mechanism: &'a Mechanism,
    joint: &'a Joint,
    k: usize,
    part: (Axes, usize),
    frame: usize, // that feels it
    sign: f64,
    q: &'a [f64],
    xi: Vec<f64>, // n
}

impl<'a> Component<'a> {
    fn of(mechanism: &'a Mechanism, k: usize, part: (Axes, usize), q: &'a [f64]) -> Option<Self> {
        let joint = &mechanism.description().joints[k];
        let (frame, sign) = felt(joint)?;
        let own = motion(joint, part, &|i| q[i]);
        let mut xi = vec![0.0; q.len()];
        xi[FRAME * frame..FRAME * (frame + 1)].copy_from_slice(&own);
        Some(Self { mechanism, joint, k, part, frame, sign, q, xi })
    }

    /// `−σ G_i ξ` of the rows of the joint.
    fn works(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.mechanism.rows_of_joint(self.k).map(|(i, row)| {
            let mut rate = 0.0;
            row.add_rate(self.q, &self.xi, &mut rate);
            (i, -self.sign * rate)
        })
    }

    /// `−σ Gᵀλ` of the rows of the joint, of the frame that feels it.
    fn force(&self, lambda: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.q.len()];
        for (i, row) in self.mechanism.rows_of_joint(self.k) {
            row.add_gradient(self.q, -self.sign * lambda[i], &mut all);
        }
        all[FRAME * self.frame..FRAME * (self.frame + 1)].to_vec()
    }

    fn add_slopes(&self, lambda: &[f64], scale: f64, [q, of_lambda]: [&mut [f64]; 2]) {
        for (i, work) in self.works() {
            of_lambda[i] += scale * work;
        }
        for (i, row) in self.mechanism.rows_of_joint(self.k) {
            row.add_bend(self.q, &self.xi, -self.sign * scale * lambda[i], q);
        }
        let force = self.force(lambda);
        let sides = [self.joint.parent.frame, self.joint.child.frame];
        for side in sides {
            let FrameId::Frame(frame) = side else { continue };
            for j in FRAME * frame..FRAME * (frame + 1) {
                let along = |i: usize| Dual64::new(self.q[i], f64::from(u8::from(i == j)));
                let joint = with_tangent(self.joint);
                let turned = motion(&joint, self.part, &along);
                q[j] += scale * sum(turned.iter().map(|x| x.eps).zip(force.iter().copied()));
            }
        }
    }
}

/// The translation of a frame along an axis of space, shape `n`.
fn translation(n: usize, frame: usize, axis: usize) -> Vec<f64> {
    let mut xi = vec![0.0; n];
    xi[FRAME * frame + axis] = 1.0;
    xi
}

/// The rows of a scalar constraint, as numbered among all constraints.
fn rows_of(mechanism: &Mechanism, scalar: usize) -> impl Iterator<Item = (usize, &ScalarRow)> {
    let first = mechanism.len() - mechanism.rows().len();
    mechanism.scalar_rows(scalar).map(move |i| (i, &mechanism.rows()[i - first]))
}

/// A joint whose numbers do not change.
fn with_tangent(joint: &Joint) -> Joint<Dual64> {
    super::JointTangent::default().dual(joint)
}

impl ForceNumber {
    /// The number at a node with the multipliers `lambda` of all constraints.
    #[must_use]
    pub fn value(&self, mechanism: &Mechanism, q: &[f64], lambda: &[f64]) -> f64 {
        match self {
            Self::Rows { rows, factor, .. } => factor * lambda[rows.clone()].iter().sum::<f64>(),
            Self::Carried { scalar, frame, axis } => {
                let xi = translation(q.len(), *frame, *axis);
                let work = |(i, row): (usize, &ScalarRow)| {
                    let mut rate = 0.0;
                    row.add_rate(q, &xi, &mut rate);
                    (-lambda[i], rate)
                };
                sum(rows_of(mechanism, *scalar).map(work))
            }
            Self::Reaction { joint, axes, part } => {
                let own = Component::of(mechanism, *joint, (*axes, *part), q);
                own.map_or(0.0, |own| sum(own.works().map(|(i, work)| (work, lambda[i]))))
            }
        }
    }

    /// `q ← q + scale ∂y/∂q`, shape `n`; `of_lambda ← of_lambda + scale ∂y/∂λ`, shape `m`.
    pub fn add_slopes(
        &self,
        mechanism: &Mechanism,
        q: &[f64],
        lambda: &[f64],
        scale: f64,
        [of_q, of_lambda]: [&mut [f64]; 2],
    ) {
        match self {
            Self::Rows { rows, factor, .. } => {
                of_lambda[rows.clone()].iter_mut().for_each(|own| *own += scale * factor);
            }
            Self::Carried { scalar, frame, axis } => {
                let xi = translation(q.len(), *frame, *axis);
                for (i, row) in rows_of(mechanism, *scalar) {
                    let mut rate = 0.0;
                    row.add_rate(q, &xi, &mut rate);
                    of_lambda[i] -= scale * rate;
                    let weight = scale * lambda[i];
                    emit_minus_transposed(&xi, of_q, |out| row.emit_second(q, weight, out));
                }
            }
            Self::Reaction { joint, axes, part } => {
                if let Some(own) = Component::of(mechanism, *joint, (*axes, *part), q) {
                    own.add_slopes(lambda, scale, [of_q, of_lambda]);
                }
            }
        }
    }

    /// How it changes where the numbers of the mechanism change so.
    ///
    /// # Errors
    /// [`DesignError`] where a tangent is of another kind than its element.
    pub fn moved(
        &self,
        mechanism: &Mechanism,
        tangent: &MechanismTangent,
    ) -> Result<MovedForce, DesignError> {
        let (mut joint, mut factor) = (None, 0.0);
        match self {
            Self::Reaction { joint: k, .. } => {
                let own = &mechanism.description().joints[*k];
                joint = tangent.joints.get(k).map(|change| change.dual(own));
            }
            Self::Carried { scalar, .. } => {
                let moves = tangent.scalars.contains_key(scalar);
                let rows =
                    if moves { MovedRows::of(mechanism, tangent)? } else { MovedRows::default() };
                return Ok(MovedForce { rows, joint, factor });
            }
            Self::Rows { of: ReactionRows::Bar(k), .. } => {
                factor = tangent.bars.get(k).map_or(0.0, |own| own.length);
            }
            Self::Rows { of: ReactionRows::Scalar(k), .. } => {
                if let Some(ScalarTangent::Distance { length, .. }) = tangent.scalars.get(k) {
                    factor = *length;
                }
            }
        }
        let rows = match joint.is_some() {
            true => MovedRows::of(mechanism, tangent)?,
            false => MovedRows::default(),
        };
        Ok(MovedForce { rows, joint, factor })
    }

    /// `y_θ` of such a change.
    #[must_use]
    pub fn by_parameter(
        &self,
        mechanism: &Mechanism,
        moved: &MovedForce,
        at: Configuration<'_>,
        lambda: &[f64],
    ) -> f64 {
        match self {
            Self::Rows { rows, .. } => moved.factor * lambda[rows.clone()].iter().sum::<f64>(),
            Self::Carried { scalar, frame, axis } => {
                let xi = translation(at.q.len(), *frame, *axis);
                let (mut own, mut change) = (vec![0.0; lambda.len()], 0.0);
                mechanism.scalar_rows(*scalar).for_each(|i| own[i] = -lambda[i]);
                moved.rows.for_each_force(at.q, &own, |i, force| change += force * xi[i]);
                change
            }
            Self::Reaction { joint: k, axes, part } => {
                let own = Component::of(mechanism, *k, (*axes, *part), at.q);
                let Some((own, joint)) = own.zip(moved.joint.as_ref()) else { return 0.0 };
                let mut of_joint = vec![0.0; lambda.len()];
                mechanism.rows_of_joint(*k).for_each(|(i, _)| of_joint[i] = -own.sign * lambda[i]);
                let mut change = 0.0;
                moved.rows.for_each_force(at.q, &of_joint, |i, force| change += force * own.xi[i]);
                let turned = motion(joint, own.part, &|i| Dual64::from_re(at.q[i]));
                let force = own.force(lambda);
                change + sum(turned.iter().map(|x| x.eps).zip(force.iter().copied()))
            }
        }
    }
}
