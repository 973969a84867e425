//! Impulses that joints transmit across their axes, at a node with a constraint impulse.

use crate::mechanism::Mechanism;
use crate::output::reaction::ReactionObserver;
use vi_constraints::nonsmooth::TransverseImpulses;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;

/// Of the joints with dry friction by what they transmit.
#[derive(Debug)]
pub(crate) struct TransmittedImpulses {
    mechanism: Mechanism,
    rows: IndependentRows,
    observer: ReactionObserver,
    joints: Vec<(u32, usize)>, // element, joint
    found: Vec<f64>,           // N·s  across the axis of each
}

impl TransmittedImpulses {
    pub(crate) fn new(
        mechanism: Mechanism,
        rows: IndependentRows,
        joints: Vec<(u32, usize)>,
    ) -> Self {
        let (observer, found) = (ReactionObserver::new(&mechanism), vec![0.0; joints.len()]);
        Self { mechanism, rows, observer, joints, found }
    }

    /// The first of the joints whose force across the axis is not unique at a configuration.
    pub(crate) fn not_unique(&mut self, at: Configuration<'_>) -> Option<&str> {
        let none = vec![0.0; at.q.len()];
        let Self { mechanism, rows, observer, joints, .. } = self;
        let reactions = observer.observe(mechanism, at, &none, rows);
        let unique = |joint: usize| reactions.joint(joint).unique[..2] == [true; 2];
        let found = joints.iter().find(|(_, joint)| !unique(*joint))?.1;
        Some(&mechanism.description().joints[found].name)
    }
}

impl TransverseImpulses for TransmittedImpulses {
    fn find(&mut self, at: Configuration<'_>, impulse: &[f64]) {
        let Self { mechanism, rows, observer, joints, found } = self;
        let reactions = observer.observe(mechanism, at, impulse, rows);
        for (found, (_, joint)) in found.iter_mut().zip(&*joints) {
            let force = reactions.joint(*joint).force; // along m_1, m_2, n
            *found = libm::hypot(force.x, force.y);
        }
    }

    fn across(&self, element: u32) -> f64 {
        let place = self.joints.iter().position(|(own, _)| *own == element);
        place.map_or(0.0, |place| self.found[place])
    }
}
