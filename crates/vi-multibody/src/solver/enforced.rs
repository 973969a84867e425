//! Where the rows of closed loops and of rolling are enforced.

use vi_core::interval::Interval;

/// Where rows are enforced.
#[derive(Clone, Copy)]
pub(in crate::solver) enum Enforced<'a> {
    /// At a node `q`: rates.
    Node(&'a [f64]),
    /// At the end of a step.
    Step(&'a Interval),
}

impl<'a> Enforced<'a> {
    /// At the end of a step, or for rates at the node that it stands on.
    pub(in crate::solver) fn of(s: &'a Interval, standing: bool) -> Self {
        if standing { Self::Node(&s.q1) } else { Self::Step(s) }
    }

    /// `q`, and the step that ends there.
    pub(in crate::solver) fn place(self) -> (&'a [f64], Option<&'a Interval>) {
        match self {
            Self::Node(q) => (q, None),
            Self::Step(s) => (&s.q1, Some(s)),
        }
    }
}
