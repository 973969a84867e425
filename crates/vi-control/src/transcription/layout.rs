//! Where the unknowns and the equations of a motion stand, stage by stage.
//!
//! ```text
//! variables   for k = 0 … N s − 1: values of controls that begin there, hλ_k of the closures, ξ_{k+1};  hλ_{N s};  T
//! rows        for k = 0 … N s − 1: balance at k, closures at k+1, turns from k to k+1, conditions at k+1;  rest
//! knots of controls that are linear between them, last; a row for each value: w_n − (1 − s) k_i − s k_{i+1} = 0
//! ```
//! Nodes are here those of sub-steps, or control points; controls begin and conditions hold where
//! steps meet.

use super::division::Division;
use super::problem::{Control, ControlProblem, FinalTime, NodeNumber, RestAtEnd, When};
use std::ops::Range;

/// Places of variables and rows.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) variables: usize,
    pub(super) rows: usize,
    values: Vec<Vec<usize>>,        // of each control: of each of its values
    holds: Vec<usize>,              // of each control
    impulses: Vec<usize>,           // of nodes 0 … N s
    coordinates: Vec<usize>,        // of nodes 1 … N s
    pub(super) time: Option<usize>, // T
    balances: Vec<usize>,           // of nodes 0 … N s − 1
    closures: Vec<usize>,           // of nodes 1 … N s
    turns: Vec<usize>,              // from nodes 0 … N s − 1
    pub(super) conditions: Vec<PlacedCondition>, // rows beside bounds of variables
    pub(super) rest: Range<usize>,
    pub(super) knots: Vec<Option<Knots>>, // of each control
}

/// Where the knots of a control stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knots {
    /// First variable.
    pub(super) variable: usize,
    /// Row of the value of the first step.
    pub(super) row: usize,
}

/// A condition at a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedCondition {
    pub(super) row: usize,
    pub(super) node: usize,
    /// Among those of the problem.
    pub(super) condition: usize,
}

/// Counts of a mechanism.
#[derive(Clone, Copy, Debug)]
pub(super) struct MechanismCounts {
    /// Degrees of freedom of the tree.
    pub(super) tree: usize,
    /// Independent closures.
    pub(super) closures: usize,
    /// Angles whose turns are bounded.
    pub(super) turning: usize,
}

/// Steps for which a value of a control lasts.
fn values_last(control: &Control) -> usize {
    if control.linear { 1 } else { control.hold }
}

/// Whether a condition is a bound of a variable.
pub(super) fn is_bound(quantity: &NodeNumber, when: When) -> bool {
    when == When::Path && matches!(quantity, NodeNumber::Joint { .. })
}

impl Layout {
    pub(super) fn new(
        problem: &ControlProblem,
        division: &Division,
        counts: MechanismCounts,
    ) -> Self {
        let MechanismCounts { tree, closures: m, turning } = counts;
        let (mut variable, mut row) = (0, 0);
        let place = |counter: &mut usize, count: usize| {
            let at = *counter;
            *counter += count;
            at
        };
        let mut values = vec![Vec::new(); problem.controls.len()];
        let mut layout = Self {
            variables: 0,
            rows: 0,
            values: Vec::new(),
            holds: problem.controls.iter().map(values_last).collect(),
            impulses: Vec::new(),
            coordinates: Vec::new(),
            time: None,
            balances: Vec::new(),
            closures: Vec::new(),
            turns: Vec::new(),
            conditions: Vec::new(),
            rest: 0..0,
            knots: Vec::new(),
        };
        for k in 0..division.last() {
            for (control, values) in problem.controls.iter().zip(&mut values) {
                let begins = |n: usize| n.is_multiple_of(values_last(control));
                if division.starting(k).is_some_and(begins) {
                    values.push(place(&mut variable, 1));
                }
            }
            layout.impulses.push(place(&mut variable, m));
            layout.coordinates.push(place(&mut variable, tree));
            layout.balances.push(place(&mut row, tree));
            layout.closures.push(place(&mut row, m));
            layout.turns.push(place(&mut row, turning));
            let Some(n) = division.starting(k + 1) else { continue };
            for (condition, own) in problem.conditions.iter().enumerate() {
                let holds = match own.when {
                    When::End => n == problem.steps,
                    When::Path => !is_bound(&own.quantity, own.when),
                    When::Node(node) => node == n,
                };
                if holds {
                    let row = place(&mut row, 1);
                    layout.conditions.push(PlacedCondition { row, node: k + 1, condition });
                }
            }
        }
        let rest = match &problem.rest {
            RestAtEnd::Free => 0,
            RestAtEnd::All => tree,
            RestAtEnd::Unknowns(some) => some.len(),
        };
        // without rest nothing acts at the end
        let free = if problem.rest == RestAtEnd::All { m } else { 0 };
        layout.impulses.push(place(&mut variable, free));
        let at = place(&mut row, rest);
        layout.rest = at..at + rest;
        if matches!(problem.time, FinalTime::Free { .. }) {
            layout.time = Some(place(&mut variable, 1));
        }
        let knots = problem.controls.iter().map(|own| {
            let count = problem.steps.div_ceil(own.hold) + 1;
            own.has_knots().then(|| Knots {
                variable: place(&mut variable, count),
                row: place(&mut row, problem.steps),
            })
        });
        layout.knots = knots.collect();
        layout.values = values;
        (layout.variables, layout.rows) = (variable, row);
        layout
    }

    /// The variable of a control in step `n`.
    pub(super) fn control(&self, control: usize, n: usize) -> usize {
        self.values[control][n / self.holds[control]]
    }

    /// The control and the step that a row of knots is of.
    pub(super) fn knots_at(&self, row: usize, steps: usize) -> Option<(usize, usize)> {
        let of = |(k, own): (usize, &Option<Knots>)| {
            let n = row.checked_sub((*own)?.row)?;
            (n < steps).then_some((k, n))
        };
        self.knots.iter().enumerate().find_map(of)
    }

    /// The variables of a control.
    pub(super) fn values(&self, control: usize) -> &[usize] {
        &self.values[control]
    }

    /// First variable of the impulses of closures at node `n`.
    pub(super) fn impulse(&self, n: usize) -> usize {
        self.impulses[n]
    }

    /// First variable of `ξ_n`, `n ≥ 1`; `None` at the start.
    pub(super) fn coordinate(&self, n: usize) -> Option<usize> {
        n.checked_sub(1).map(|k| self.coordinates[k])
    }

    /// First row of the balance at node `n < N s`.
    pub(super) fn balance(&self, n: usize) -> usize {
        self.balances[n]
    }

    /// First row of the closures at node `n ≥ 1`.
    pub(super) fn closure(&self, n: usize) -> usize {
        self.closures[n - 1]
    }

    /// First row of the turns from node `n` to the next one.
    pub(super) fn turn(&self, n: usize) -> usize {
        self.turns[n]
    }
}
