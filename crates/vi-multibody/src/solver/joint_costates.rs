//! Multipliers and costates of the joints of a tree, from the wrenches that they transmit.
//!
//! ```text
//! w = G(q_n)ᵀ h λ,   c − Aᵀ μ = G(q_{n+1})ᵀ σ            [2.38]; w = p̄ + D_1 L_d + f_d^-
//! R of each joint from Gᵀ x, W x_J = −R                  [5.30]; R, W about the anchor
//! Σ h λ_i D²g_i(q_n) μ                                    joints: of their rows; bodies: ω × y_I
//! y = w − G_Jᵀ h λ_J = G_Iᵀ h λ_I                         per director, without λ_I
//! ```
//! `ξ` with `Wᵀ ξ = r`: a motion of what a joint carries along which its rows change by `r`. Such
//! motions of all joints, each carried along by the next, are `μ` with `G_J μ = r`.
//! `W`: the wrenches of the rows of a joint on the body that it carries. The internal constraints
//! of bodies have no parameters, and do no work on rigid bodies: their multipliers are not needed.
//! `O(N)`; the factors of a node serve the step before it and the one after it. The control points
//! of a Galerkin step are nodes, too, with `w_i` and `Λ_i` in the places of `w` and `h λ` [2.50].
#![allow(non_snake_case)] // Q, R, U, W

use crate::constraint::scalar_constraint::ScalarRow;
use crate::geometry::form::Term;
use crate::geometry::products::{MOST, ProductRow, Products, Vectors};
use crate::geometry::twist::{Twist, TwistTransfer};
use crate::mechanism::Mechanism;
use crate::output::joint_wrenches::{Transmitted, links_of_joints};
use crate::tree::Tree;
use nalgebra::{Vector3, Vector6};
use std::ops::Range;
use vi_constraints::Constraints;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_rigid::directors::{FRAME, center, director};
use vi_rigid::null_space::push_forward;

/// What a column of `W` has beside the others at least, of its square.
const INDEPENDENT: f64 = 1e-20;

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
    joints: JointNodes,
}

/// The joints of a tree at the nodes of a step.
#[derive(Debug)]
pub(super) struct JointNodes {
    joints: Vec<TreeJoint>,
    nodes: Vec<JointNode>,
    transmitted: Transmitted,
    twists: Vec<Twist>, // of links
}

/// A joint of the tree.
#[derive(Debug)]
struct TreeJoint {
    link: usize,
    frame: usize,
    anchor: Vector3<f64>, // in the directors of the frame
    first: usize,         // of its constraints
    products: Products,
    own: Vec<(usize, Term)>,   // what the forms have of the frame: form, term
    thread: Option<ScalarRow>, // after them
}

/// Where joints are, and how they transmit wrenches there.
#[derive(Debug)]
struct JointNode {
    q: Vec<f64>,
    joints: Vec<JointPlace>,
}

/// A joint at a node.
#[derive(Clone, Debug)]
struct JointPlace {
    values: Vectors,   // of its forms
    arm: Vector3<f64>, // from the centre to the anchor
    wrenches: Wrenches,
}

/// `W = Q U` of one joint about its anchor, the columns of `Q` orthogonal.
#[derive(Clone, Debug, Default)]
struct Wrenches {
    count: usize,
    Q: [Vector6<f64>; 6],
    inverse: [f64; 6], // of the squares of the columns
    U: [[f64; 6]; 6],  // above the diagonal, by columns
}

impl Wrenches {
    /// With one more column; [`Singular`] where it depends on the others.
    fn push(&mut self, mut column: Vector6<f64>) -> Result<(), Singular> {
        let (k, size) = (self.count, column.norm_squared());
        for i in 0..k {
            self.U[k][i] = self.Q[i].dot(&column) * self.inverse[i];
            column -= self.U[k][i] * self.Q[i];
        }
        let square = column.norm_squared();
        (self.Q[k], self.inverse[k], self.count) = (column, square.recip(), k + 1);
        if square > INDEPENDENT * size { Ok(()) } else { Err(Singular) }
    }

    /// `x` with `W x = −R`, in least squares.
    fn balance(&self, mut R: Vector6<f64>, x: &mut [f64]) {
        for i in 0..self.count {
            x[i] = -self.Q[i].dot(&R) * self.inverse[i];
            R += x[i] * self.Q[i];
        }
        for i in (0..self.count).rev() {
            x[i] -= (i + 1..self.count).map(|j| self.U[j][i] * x[j]).sum::<f64>();
        }
    }

    /// The shortest `ξ` with `Wᵀ ξ = r`.
    fn spread(&self, r: &[f64]) -> Vector6<f64> {
        let (mut xi, mut y) = (Vector6::zeros(), [0.0; 6]);
        for k in 0..self.count {
            y[k] = r[k] - (0..k).map(|i| self.U[k][i] * y[i]).sum::<f64>();
            xi += y[k] * self.inverse[k] * self.Q[k];
        }
        xi
    }
}

impl TreeJoint {
    fn all(mechanism: &Mechanism) -> Vec<Self> {
        let links = links_of_joints(mechanism);
        let joint = |(k, link): (usize, Option<usize>)| {
            let link = link?;
            let (mut products, mut thread) = (Products::default(), None);
            for (_, row) in mechanism.rows_of_joint(k) {
                match row {
                    ScalarRow::Product(row) => assert!(products.push(row), "at most six rows"),
                    other => thread = Some(other.clone()),
                }
            }
            let own = &mechanism.tree().links()[link];
            let (frame, anchor) = (own.frame, own.joint.child.anchor);
            let first = mechanism.joint_rows(k).start;
            let forms = products.forms().iter().enumerate();
            let own = forms.flat_map(|(k, form)| {
                let own = form.terms().iter().filter(|term| term.offset / FRAME == frame);
                own.map(move |term| (k, *term))
            });
            let own = own.collect();
            Some(Self { link, frame, anchor, first, products, own, thread })
        };
        links.into_iter().enumerate().filter_map(joint).collect()
    }

    /// Its constraints.
    fn rows(&self) -> Range<usize> {
        self.first..self.first + self.products.rows().len() + usize::from(self.thread.is_some())
    }

    fn stand(&self, q: &[f64], place: &mut JointPlace) -> Result<(), Singular> {
        let own = &q[FRAME * self.frame..FRAME * (self.frame + 1)];
        let arm: Vector3<f64> = (0..3).map(|i| self.anchor[i] * director(own, i)).sum();
        let JointPlace { values, wrenches, .. } = place;
        *values = self.products.values(q);
        // what the forms have of the frame: φ, a vector from the anchor on
        let mut parts = [(0.0, Vector3::zeros()); MOST];
        for (form, term) in &self.own {
            let (point, vector) = &mut parts[*form];
            match term.offset == FRAME * self.frame {
                true => *point += term.coefficient,
                false => *vector += term.coefficient * term.of(q),
            }
        }
        parts.iter_mut().for_each(|(point, vector)| *vector -= *point * arm);
        wrenches.count = 0;
        for ProductRow { scale, sides } in self.products.rows() {
            let mut wrench = Twist::zero();
            for (own, other) in [(sides[0], sides[1]), (sides[1], sides[0])] {
                let ((point, vector), force) = (parts[own], *scale * values[other]);
                wrench.add_scaled(1.0, &Twist::new(point * force, vector.cross(&force)));
            }
            wrenches.push(wrench.to_vector())?;
        }
        if let Some(thread) = &self.thread {
            let mut wrench = Twist::zero();
            thread.for_each_wrench(q, |frame, part| {
                if frame == self.frame {
                    wrench.add_scaled(1.0, &part);
                }
            });
            wrenches.push(about(&arm, &wrench).to_vector())?;
        }
        place.arm = arm;
        Ok(())
    }
}

/// A wrench about the centre, about a point.
fn about(arm: &Vector3<f64>, wrench: &Twist) -> Twist {
    Twist::new(wrench.linear, wrench.angular - arm.cross(&wrench.linear))
}

impl JointNode {
    fn new(mechanism: &Mechanism, joints: usize) -> Self {
        let values = [Vector3::zeros(); MOST];
        let place = JointPlace { values, arm: Vector3::zeros(), wrenches: Wrenches::default() };
        Self { q: vec![0.0; mechanism.dim()], joints: vec![place; joints] }
    }

    /// Moves to `q`.
    fn stand(&mut self, joints: &[TreeJoint], q: &[f64]) -> Result<(), Singular> {
        if self.q != q {
            let mut places = self.joints.iter_mut().zip(joints);
            places.try_for_each(|(place, joint)| joint.stand(q, place))?;
            self.q.copy_from_slice(q);
        }
        Ok(())
    }

    /// `x_J` with `Gᵀ x = c`.
    fn solve(
        &self,
        joints: &[TreeJoint],
        transmitted: &mut Transmitted,
        mechanism: &Mechanism,
        c: &[f64],
        x: &mut [f64],
    ) {
        transmitted.transmit(mechanism, &self.q, Some(c), &[]);
        for (JointPlace { arm, wrenches, .. }, joint) in self.joints.iter().zip(joints) {
            let R = about(arm, transmitted.wrench(joint.link));
            wrenches.balance(R.to_vector(), &mut x[joint.rows()]);
        }
    }
}

impl JointNodes {
    /// Of all joints, at so many nodes.
    pub(super) fn new(mechanism: &Mechanism, nodes: usize) -> Self {
        let joints = TreeJoint::all(mechanism);
        Self {
            nodes: (0..nodes).map(|_| JointNode::new(mechanism, joints.len())).collect(),
            transmitted: Transmitted::none(mechanism),
            twists: vec![Twist::zero(); mechanism.tree().links().len()],
            joints,
        }
    }

    /// Goes to the step before: its end is the start of this one.
    pub(super) fn go_back(&mut self) {
        let last = self.nodes.len() - 1;
        self.nodes.swap(0, last);
    }

    /// The multipliers of the joints at a node `q` from `w`, which becomes `y`.
    ///
    /// # Errors
    /// [`Singular`] where the rows of a joint are not independent.
    pub(super) fn balance(
        &mut self,
        mechanism: &Mechanism,
        node: usize,
        q: &[f64],
        w: &mut [f64],
        impulse: &mut [f64],
    ) -> Result<(), Singular> {
        self.press(mechanism, node, q, w, impulse)?;
        for (joint, place) in self.joints.iter().zip(&self.nodes[node].joints) {
            let own = &impulse[joint.rows()];
            joint.products.add_slopes(&place.values, -1.0, own, w);
            if let (Some(thread), Some(last)) = (&joint.thread, own.last()) {
                thread.add_gradient(q, -last, w);
            }
        }
        Ok(())
    }

    /// `a ← a + Σ h λ_i D²g_i(q) μ` of joints and bodies, with what [`JointNodes::balance`] found
    /// there.
    pub(super) fn bend(&self, q: &[f64], [impulse, y]: [&[f64]; 2], mu: &[f64], a: &mut [f64]) {
        for joint in &self.joints {
            let own = &impulse[joint.rows()];
            joint.products.add_slopes(&joint.products.rates(mu), 1.0, own, a);
            if let (Some(thread), Some(last)) = (&joint.thread, own.last()) {
                thread.add_bend(q, mu, *last, a);
            }
        }
        let parts = q.chunks_exact(FRAME).zip(mu.chunks_exact(FRAME));
        let parts = parts.zip(y.chunks_exact(FRAME)).zip(a.chunks_exact_mut(FRAME));
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

    /// `μ` of rigid bodies with `G_J μ = r` of the joints, at a node; shape `n`.
    pub(super) fn spread(&mut self, tree: &Tree, node: usize, r: &[f64], mu: &mut [f64]) {
        let Self { joints, nodes, twists, .. } = self;
        let JointNode { q, joints: places } = &nodes[node];
        twists.fill(Twist::zero());
        for (joint, place) in joints.iter().zip(places) {
            let at_anchor = Twist::from_vector(&place.wrenches.spread(&r[joint.rows()]));
            twists[joint.link] = TwistTransfer::Rigid(-place.arm).apply(&at_anchor);
        }
        for (k, link) in tree.links().iter().enumerate() {
            let at = FRAME * link.frame;
            if let Some(parent) = link.parent {
                let carrier = FRAME * tree.links()[parent].frame;
                let arm = center(&q[at..]) - center(&q[carrier..]);
                let carried = TwistTransfer::Rigid(arm).apply(&twists[parent]);
                twists[k].add_scaled(1.0, &carried);
            }
            let own = at..at + FRAME;
            push_forward(&q[own.clone()], &twists[k].to_vector(), &mut mu[own]);
        }
    }

    /// `x_J` with `G(q)ᵀ x = c` at a node.
    ///
    /// # Errors
    /// [`Singular`] where the rows of a joint are not independent.
    pub(super) fn press(
        &mut self,
        mechanism: &Mechanism,
        node: usize,
        q: &[f64],
        c: &[f64],
        x: &mut [f64],
    ) -> Result<(), Singular> {
        let Self { joints, nodes, transmitted, .. } = self;
        nodes[node].stand(joints, q)?;
        nodes[node].solve(joints, transmitted, mechanism, c, x);
        Ok(())
    }
}

impl JointCostates {
    /// Of all joints of the tree.
    pub(super) fn new(mechanism: &Mechanism) -> Self {
        let (n, m) = (mechanism.dim(), mechanism.len());
        Self {
            closures: mechanism.loop_rows(),
            start: vec![0.0; n],
            end: vec![0.0; n],
            impulse: vec![0.0; m],
            rows: vec![0.0; m],
            joints: JointNodes::new(mechanism, 2),
        }
    }

    /// `h λ_J` from `w`, which becomes `y`.
    ///
    /// # Errors
    /// [`Singular`] where the rows of a joint are not independent.
    pub(super) fn balance(&mut self, mechanism: &Mechanism, s: &Interval) -> Result<(), Singular> {
        self.joints.go_back();
        self.joints.balance(mechanism, 0, &s.q0, &mut self.start, &mut self.impulse)
    }

    /// `μ` of rigid bodies with `G_J μ = r` of the joints at `q_n`, where `h λ_J` was found.
    pub(super) fn spread(&mut self, tree: &Tree, r: &[f64], mu: &mut [f64]) {
        self.joints.spread(tree, 0, r, mu);
    }

    /// `a ← a + Σ h λ_i D²g_i(q_n) μ` of joints and bodies.
    pub(super) fn bend(&self, s: &Interval, mu: &[f64], a: &mut [f64]) {
        self.joints.bend(&s.q0, [&self.impulse, &self.start], mu, a);
    }

    /// `σ_J` from `c − Aᵀ μ` without the rows that close loops.
    ///
    /// # Errors
    /// [`Singular`] where the rows of a joint are not independent.
    pub(super) fn press(&mut self, mechanism: &Mechanism, s: &Interval) -> Result<(), Singular> {
        self.joints.press(mechanism, 1, &s.q1, &self.end, &mut self.rows)
    }
}
