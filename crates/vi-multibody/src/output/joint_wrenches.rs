//! Wrenches that the joints of a tree transmit, by one sweep over the constraint force of a node.
//!
//! ```text
//! R_α = −P_in(q_α)ᵀ c_α + Σ_i λ_i P_in(q_α)ᵀ (G_i^α)ᵀ + Σ_β R_β                                      [5.30]
//! c = Gᵀλ;  i: constraints that close loops;  β: links that α carries
//! ```
//! `R_α` (N, N·m about `φ_α`) is what the joint that carries `α` does to it: the constraint force
//! on all that it carries, less that of the closures [5.29]. Wrenches pass to the carrier as
//! `(f, τ + (φ_β − φ_α) × f)`. `O(N)` where there are no loops.

use crate::geometry::twist::Twist;
use crate::mechanism::Mechanism;
use crate::pair::joint::FrameId;
use crate::solver::closed_loop::ClosureForces;
use nalgebra::Vector3;
use vi_constraints::Constraints;
use vi_core::linear::Singular;
use vi_rigid::directors::{self, FRAME, INTERNAL};
use vi_rigid::null_space::pull_back;

/// The wrenches at one node after the other, their memory sized once.
#[derive(Debug)]
pub(super) struct JointWrenches {
    // joint of the description → the link that it carries; None: it closes a loop
    carried: Vec<Option<usize>>,
    closures: Option<ClosureForces>,
    found: Transmitted,
    null: Transmitted, // of multipliers that do nothing
    is_unique: bool,   // whether there are none
}

/// The link that each joint of the description carries; `None` where it closes a loop.
pub(crate) fn links_of_joints(mechanism: &Mechanism) -> Vec<Option<usize>> {
    let (joints, tree) = (&mechanism.description().joints, mechanism.tree());
    let link = |frame| match frame {
        FrameId::Frame(k) => Some(tree.link_of()[k]),
        FrameId::Ground => None,
    };
    let carried = joints.iter().map(|joint| {
        let [parent, child] = [&joint.parent, &joint.child].map(|side| link(side.frame));
        let hangs = child.is_some_and(|child| tree.links()[child].parent == parent);
        if hangs { child } else { parent }
    });
    let mut carried: Vec<_> = carried.collect();
    mechanism.cut_joints().iter().for_each(|&k| carried[k] = None);
    carried
}

/// What closures and joints transmit.
#[derive(Clone, Debug)]
pub(crate) struct Transmitted {
    lambda: Vec<f64>,     // m; 0 but for constraints that close loops
    wrenches: Vec<Twist>, // R of each link
}

impl JointWrenches {
    /// For a mechanism; point masses have no part in it.
    pub(super) fn new(mechanism: &Mechanism) -> Self {
        let has_closures = !mechanism.loop_rows().is_empty();
        let closures = has_closures.then(|| ClosureForces::new(mechanism));
        let (carried, found) = (links_of_joints(mechanism), Transmitted::none(mechanism));
        Self { carried, closures, null: found.clone(), found, is_unique: true }
    }

    /// Finds the wrenches at `q` with the constraint force `c`, shape `n`.
    ///
    /// # Errors
    /// [`Singular`] when no multipliers of the closures have this force, as where the configuration
    /// has lost rank.
    pub(super) fn find(
        &mut self,
        mechanism: &Mechanism,
        q: &[f64],
        c: &[f64],
    ) -> Result<(), Singular> {
        let Self { closures, found, null, is_unique, .. } = self;
        let Some(closures) = closures else {
            found.transmit(mechanism, q, Some(c), &[]);
            return Ok(());
        };
        closures.accept(mechanism.nearly_redundant());
        closures.solve(q, c, &mut found.lambda)?;
        found.transmit(mechanism, q, Some(c), closures.constraints());
        *is_unique = !closures.null_part(&mut null.lambda);
        if !*is_unique {
            null.transmit(mechanism, q, None, closures.constraints());
        }
        Ok(())
    }

    /// What was found.
    pub(super) fn found(&self) -> &Transmitted {
        &self.found
    }

    /// Parts in all that is not unique.
    pub(super) fn null(&self) -> Option<&Transmitted> {
        (!self.is_unique).then_some(&self.null)
    }

    /// The link that a joint carries; `None` where it closes a loop.
    pub(super) fn carried_by(&self, joint: usize) -> Option<usize> {
        self.carried[joint]
    }
}

impl Transmitted {
    /// Nothing.
    pub(crate) fn none(mechanism: &Mechanism) -> Self {
        let wrenches = vec![Twist::zero(); mechanism.tree().links().len()];
        Self { lambda: vec![0.0; mechanism.len()], wrenches }
    }

    /// The multipliers of the constraints that close loops, shape `m`.
    pub(super) fn lambda(&self) -> &[f64] {
        &self.lambda
    }

    /// `R_α` of a link, about its centre.
    pub(crate) fn wrench(&self, link: usize) -> &Twist {
        &self.wrenches[link]
    }

    /// Those of a constraint force `c` and of the multipliers of `closures`.
    pub(crate) fn transmit(
        &mut self,
        mechanism: &Mechanism,
        q: &[f64],
        c: Option<&[f64]>,
        closures: &[usize],
    ) {
        let Self { lambda, wrenches } = self;
        let tree = mechanism.tree();
        let own = |k: usize| FRAME * tree.links()[k].frame..FRAME * (tree.links()[k].frame + 1);
        wrenches.fill(Twist::zero());
        if let Some(c) = c {
            for (k, wrench) in wrenches.iter_mut().enumerate() {
                *wrench = Twist::from_vector(&-pull_back(&q[own(k)], &c[own(k)]));
            }
        }
        let first = INTERNAL * mechanism.description().bodies.len();
        for &i in closures.iter().filter(|&&i| lambda[i] != 0.0) {
            mechanism.rows()[i - first].for_each_wrench(q, |frame, gradient| {
                wrenches[tree.link_of()[frame]].add_scaled(lambda[i], &gradient);
            });
        }
        let centre = |k: usize| directors::center(&q[own(k)]);
        for (k, link) in tree.links().iter().enumerate().rev() {
            let Some(parent) = link.parent else { continue };
            let Twist { linear: force, angular: moment } = wrenches[k];
            let arm: Vector3<f64> = centre(k) - centre(parent);
            wrenches[parent].add_scaled(1.0, &Twist::new(force, moment + arm.cross(&force)));
        }
    }
}
