//! A node as it is read, and from what.

use crate::sample::ResidualsAtLevels;
use vi_constraints::integrator::NodeInStep;
use vi_constraints::node::Node;
use vi_core::{Configuration, State};

/// What is asked for of a node beside its state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct WantedOfNode {
    /// Constraint forces.
    pub(crate) forces: bool,
    /// Accelerations.
    pub(crate) accelerations: bool,
    /// Contacts.
    pub(crate) contacts: bool,
    /// Works of force elements.
    pub(crate) works: bool,
}

impl WantedOfNode {
    /// Whether constraint forces or accelerations are.
    pub(crate) fn any(self) -> bool {
        self.forces || self.accelerations
    }

    /// Whether nothing is but configurations and velocities.
    pub(crate) fn is_motion_alone(self) -> bool {
        self == Self::default()
    }

    /// Whether anything is that belongs to the step from the node.
    pub(crate) fn needs_step(self) -> bool {
        self.any() || self.contacts
    }
}

/// Which node is read, and from what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NodeOf {
    /// The present one, from its state, without what is wanted of it.
    State,
    /// The same as the last step arrives there: what contacts keep closed holds, nothing is hit.
    Arrival,
    /// The one that the last step started from: with the quantities of that step where it was taken
    /// `whole`, else from its state.
    Start { whole: bool },
    /// The last one of a run: with a step on a copy of the state, where that can be taken.
    Last,
}

impl NodeOf {
    /// Where it is, seen from the last step.
    pub(crate) fn when(self) -> NodeInStep {
        match self {
            Self::Start { .. } => NodeInStep::Before,
            Self::State | Self::Arrival | Self::Last => NodeInStep::After,
        }
    }
}

/// What was read last beside the node itself, all buffers kept.
#[derive(Debug, Default)]
pub(super) struct LastRead {
    pub(super) when: NodeInStep,
    pub(super) with_step: bool, // whether the node has quantities of a step that starts there
    pub(super) arrives: bool,   // whether it was read as the last step arrives there
    pub(super) force: Vec<f64>, // n  empty unless it is wanted
    pub(super) lambda: Vec<f64>, // m  of the acceleration level
    pub(super) acceleration: Vec<f64>, // n  empty unless it is wanted
    pub(super) work: Vec<f64>,  // J
}

/// A node that was read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeView<'a> {
    /// `t_n`, `q_n` with unwrapped angles.
    pub(crate) state: &'a State,
    /// Its quantities.
    pub(crate) node: &'a Node,
    /// `G(q_n)ᵀλ_n`, N; empty unless it was asked for.
    pub(crate) force: &'a [f64],
    /// `q̈`; empty unless it was asked for.
    pub(crate) acceleration: &'a [f64],
    /// Work since the start: of each force, then of all prescribed motions.
    pub(crate) work: &'a [f64],
    /// Shadow energy; `None` at the start of composed steps.
    pub(crate) shadow: Option<f64>,
}

impl<'a> NodeView<'a> {
    /// `(t, q)` with unwrapped angles.
    pub(crate) fn configuration(&self) -> Configuration<'a> {
        self.state.configuration()
    }

    /// Energy of the node.
    pub(crate) fn hamiltonian(&self) -> f64 {
        self.node.hamiltonian_projected.total()
    }

    /// Kinetic part of it.
    pub(crate) fn kinetic(&self) -> f64 {
        self.node.hamiltonian_projected.kinetic
    }

    /// Constraint residuals.
    pub(crate) fn residuals(&self) -> ResidualsAtLevels {
        ResidualsAtLevels {
            position: self.node.position_residual,
            velocity: self.node.velocity_residual,
            momentum: self.node.momentum_residual,
        }
    }
}
