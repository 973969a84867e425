//! Multipliers and costates of the joints of a tree, from the wrenches that they transmit.
//!
//! ```text
//! w = G(q_n)ᵀ h λ,   c − Aᵀ μ = G(q_{n+1})ᵀ σ            [2.38]; w = p̄ + D_1 L_d + f_d^-
//! R of each joint from Gᵀ x, W x_J = −R                  [5.30]; R, W about the anchor
//! Σ h λ_i D²g_i(q_n) μ                                    joints: of their rows; bodies: ω × y_I
//! y = w − G_Jᵀ h λ_J = G_Iᵀ h λ_I                         per director, without λ_I
//! ```
//! `W`: the wrenches of the rows of a joint on the body that it carries. The internal constraints
//! of bodies have no parameters, and do no work on rigid bodies: their multipliers are not needed.
//! `O(N)`; the factors of a node serve the step before it and the one after it.
#![allow(non_snake_case)] // R, W

use crate::constraint::scalar_constraint::ScalarRow;
use crate::geometry::twist::Twist;
use crate::mechanism::Mechanism;
use crate::output::joint_wrenches::{Transmitted, links_of_joints};
use nalgebra::{Cholesky, Const, SMatrix, Vector3};
use vi_constraints::Constraints;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_rigid::directors::{FRAME, director};

type Square = SMatrix<f64, 6, 6>;

/// The joints during a step backward.
#[derive(Debug)]
pub(super) struct JointCostates {
    /// The constraints that close loops.
    pub(super) closures: Vec<usize>,
    /// `w`, then `y`. Shape `n`.
    pub(super) start: Vec<f64>,
    /// `c − Aᵀ μ` of the joints, piece by piece. Shape `n`.
    pub(super) end: Vec<f64>,
    /// `h λ`, shape `m`; 0 of internal constraints.
    pub(super) impulse: Vec<f64>,
    /// `σ`, shape `m`; 0 of internal constraints.
    pub(super) rows: Vec<f64>,
    joints: Vec<TreeJoint>,
    nodes: [Node; 2], // q_n, q_{n+1}
    transmitted: Transmitted,
}

/// A joint of the tree.
#[derive(Debug)]
struct TreeJoint {
    link: usize,
    frame: usize,
    anchor: Vector3<f64>, // in the directors of the frame
    first: usize,         // of its constraints
    rows: Vec<ScalarRow>,
}

/// Where joints are, and how they transmit wrenches there.
#[derive(Debug)]
struct Node {
    q: Vec<f64>,
    joints: Vec<JointFactors>,
}

/// `W` of one joint about its anchor; 0 beyond its rows.
#[derive(Debug)]
struct JointFactors {
    arm: Vector3<f64>, // from the centre to the anchor
    W: Square,
    normal: Cholesky<f64, Const<6>>, // of WᵀW; the identity beyond its rows
}

impl TreeJoint {
    fn all(mechanism: &Mechanism) -> Vec<Self> {
        let links = links_of_joints(mechanism);
        let joint = |(k, link): (usize, Option<usize>)| {
            let link = link?;
            let rows = mechanism.rows_of_joint(k).map(|(_, row)| row.clone()).collect();
            let own = &mechanism.tree().links()[link];
            let (frame, anchor) = (own.frame, own.joint.child.anchor);
            Some(Self { link, frame, anchor, first: mechanism.joint_rows(k).start, rows })
        };
        links.into_iter().enumerate().filter_map(joint).collect()
    }

    /// Its constraints, with their rows.
    fn rows(&self) -> impl Iterator<Item = (usize, &ScalarRow)> {
        self.rows.iter().enumerate().map(|(i, row)| (self.first + i, row))
    }

    fn factors(&self, q: &[f64]) -> Result<JointFactors, Singular> {
        let own = &q[FRAME * self.frame..FRAME * (self.frame + 1)];
        let arm: Vector3<f64> = (0..3).map(|i| self.anchor[i] * director(own, i)).sum();
        let (mut W, mut normal) = (Square::zeros(), Square::identity());
        for (i, row) in self.rows.iter().enumerate() {
            let mut wrench = Twist::zero();
            row.for_each_wrench(q, |frame, part| {
                if frame == self.frame {
                    wrench.add_scaled(1.0, &part);
                }
            });
            W.set_column(i, &about(&arm, &wrench).to_vector());
        }
        let rows = self.rows.len();
        normal
            .view_mut((0, 0), (rows, rows))
            .copy_from(&W.columns(0, rows).tr_mul(&W.columns(0, rows)));
        Ok(JointFactors { arm, W, normal: normal.cholesky().ok_or(Singular)? })
    }
}

/// A wrench about the centre, about a point.
fn about(arm: &Vector3<f64>, wrench: &Twist) -> Twist {
    Twist::new(wrench.linear, wrench.angular - arm.cross(&wrench.linear))
}

impl Node {
    fn new(mechanism: &Mechanism, joints: usize) -> Self {
        let none = || JointFactors {
            arm: Vector3::zeros(),
            W: Square::zeros(),
            normal: Cholesky::new(Square::identity()).expect("the identity is definite"),
        };
        let joints = std::iter::repeat_with(none).take(joints).collect();
        Self { q: vec![0.0; mechanism.dim()], joints }
    }

    /// Moves to `q`.
    fn stand(&mut self, joints: &[TreeJoint], q: &[f64]) -> Result<(), Singular> {
        if self.q != q {
            for (factors, joint) in self.joints.iter_mut().zip(joints) {
                *factors = joint.factors(q)?;
            }
            self.q.copy_from_slice(q);
        }
        Ok(())
    }

    /// `x_J` with `Gᵀ x = c`.
    fn solve(
        &self,
        joints: &[TreeJoint],
        transmitted: &mut Transmitted,
        (mechanism, c): (&Mechanism, &[f64]),
        x: &mut [f64],
    ) {
        transmitted.transmit(mechanism, &self.q, Some(c), &[]);
        for (JointFactors { arm, W, normal }, joint) in self.joints.iter().zip(joints) {
            let R = about(arm, transmitted.wrench(joint.link)).to_vector();
            let found = normal.solve(&-W.tr_mul(&R));
            let x = &mut x[joint.first..joint.first + joint.rows.len()];
            x.copy_from_slice(&found.as_slice()[..joint.rows.len()]);
        }
    }
}

impl JointCostates {
    /// Of all joints of the tree.
    pub(super) fn new(mechanism: &Mechanism) -> Self {
        let joints = TreeJoint::all(mechanism);
        let (n, m) = (mechanism.dim(), mechanism.len());
        Self {
            closures: mechanism.loop_rows(),
            start: vec![0.0; n],
            end: vec![0.0; n],
            impulse: vec![0.0; m],
            rows: vec![0.0; m],
            nodes: [(); 2].map(|()| Node::new(mechanism, joints.len())),
            transmitted: Transmitted::none(mechanism),
            joints,
        }
    }

    /// `h λ_J` from `w`, which becomes `y`.
    ///
    /// # Errors
    /// [`Singular`] where the rows of a joint are not independent.
    pub(super) fn balance(&mut self, mechanism: &Mechanism, s: &Interval) -> Result<(), Singular> {
        let Self { joints, nodes, transmitted, start, impulse, .. } = self;
        nodes.swap(0, 1); // the start of the step after this one is its end
        nodes[0].stand(joints, &s.q0)?;
        nodes[0].solve(joints, transmitted, (mechanism, start), impulse);
        for (row, own) in joints.iter().flat_map(TreeJoint::rows) {
            own.add_gradient(&s.q0, -impulse[row], start);
        }
        Ok(())
    }

    /// `a ← a + Σ h λ_i D²g_i(q_n) μ` of joints and bodies.
    pub(super) fn bend(&self, s: &Interval, mu: &[f64], a: &mut [f64]) {
        for (row, own) in self.joints.iter().flat_map(TreeJoint::rows) {
            own.add_bend(&s.q0, mu, self.impulse[row], a);
        }
        let parts = s.q0.chunks_exact(FRAME).zip(mu.chunks_exact(FRAME));
        let parts = parts.zip(self.start.chunks_exact(FRAME)).zip(a.chunks_exact_mut(FRAME));
        for (((q, mu), y), a) in parts {
            let omega: Vector3<f64> =
                (0..3).map(|i| 0.5 * director(q, i).cross(&director(mu, i))).sum();
            for i in 0..3 {
                let bend = omega.cross(&director(y, i));
                let own = &mut a[3 + 3 * i..6 + 3 * i];
                own.iter_mut().zip(bend.iter()).for_each(|(a, bend)| *a += bend);
            }
        }
    }

    /// `σ_J` from `c − Aᵀ μ` without the rows that close loops.
    ///
    /// # Errors
    /// [`Singular`] where the rows of a joint are not independent.
    pub(super) fn press(&mut self, mechanism: &Mechanism, s: &Interval) -> Result<(), Singular> {
        let Self { joints, nodes, transmitted, end, rows, .. } = self;
        nodes[1].stand(joints, &s.q1)?;
        nodes[1].solve(joints, transmitted, (mechanism, end), rows);
        Ok(())
    }
}
