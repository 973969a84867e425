//! What the multipliers of a program say: of conditions at their nodes, of rest, of turns, of
//! balances.

use super::Transcription;
use super::layout::is_bound;
use super::problem::{Quantity, Rest};
use crate::program::{Multipliers, Undefined};

/// What the bounds of turns cost: the multiplier of an angle at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnPrice {
    /// The unknown of the tree.
    pub unknown: usize,
    /// The node of whole steps; `None` within a step.
    pub node: Option<usize>,
    /// Its multiplier.
    pub multiplier: f64,
}

/// What rest at the end costs.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum PriceOfRest {
    /// Nothing is asked for.
    #[default]
    Free,
    /// `M P(q_N) η`, shape `n`, with the multipliers `η` of the momenta along all unknowns.
    All(Vec<f64>),
    /// `η` of the momenta along some unknowns of a tree, each with its unknown.
    Unknowns(Vec<(usize, f64)>),
}

/// A condition at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// Among those of the problem.
    pub condition: usize,
    /// Where.
    pub node: usize,
    /// What its quantity is there.
    pub value: f64,
    /// Its multiplier: the cost changes by minus this with the bound.
    pub multiplier: f64,
}

impl Transcription {
    /// What conditions have at their nodes at a point with its multipliers.
    ///
    /// # Errors
    /// [`Undefined`].
    pub fn met(&self, x: &[f64], multipliers: &Multipliers) -> Result<Vec<Met>, Undefined> {
        let point = self.followed_at(x)?;
        let mut met = Vec::new();
        for (k, condition) in self.problem.conditions.iter().enumerate() {
            let value = |n: usize| self.quantity(&point, &condition.quantity, n);
            if is_bound(&condition.quantity, condition.when) {
                let Quantity::Joint { unknown, .. } = condition.quantity else { continue };
                let bounds = self.path_bounds(unknown.index);
                for node in 1..=self.problem.steps {
                    let n = self.division.node(node);
                    let at = self.layout.coordinate(n).unwrap_or(0) + unknown.index;
                    // of several conditions on a coordinate those act that are the narrowest
                    let [lower, upper] = [0, 1].map(|i| bounds[i] == Some(k));
                    let multiplier = unknown.sign
                        * (if upper { multipliers.upper[at] } else { 0.0 }
                            - if lower { multipliers.lower[at] } else { 0.0 });
                    met.push(Met { condition: k, node, value: value(n), multiplier });
                }
                continue;
            }
            for own in self.layout.conditions.iter().filter(|own| own.condition == k) {
                let (node, multiplier) = (self.division.step(own.node), multipliers.rows[own.row]);
                met.push(Met { condition: k, node, value: value(own.node), multiplier });
            }
        }
        Ok(met)
    }

    /// The conditions that bound a coordinate along the path from below and from above: the
    /// narrowest of each.
    fn path_bounds(&self, index: usize) -> [Option<usize>; 2] {
        let mut narrowest: [Option<(usize, f64)>; 2] = [None; 2];
        for (k, own) in self.problem.conditions.iter().enumerate() {
            let Quantity::Joint { unknown, start } = own.quantity else { continue };
            if unknown.index != index || !is_bound(&own.quantity, own.when) {
                continue;
            }
            let [a, b] = own.bounds.map(|bound| unknown.sign * (bound - start));
            let both = [a.min(b), -a.max(b)]; // the larger, the narrower
            for (held, bound) in narrowest.iter_mut().zip(both) {
                if held.is_none_or(|(_, other)| bound > other) {
                    *held = Some((k, bound));
                }
            }
        }
        narrowest.map(|held| held.map(|own| own.0))
    }

    /// What rest at the end costs, by its multipliers.
    ///
    /// # Errors
    /// [`Undefined`].
    pub fn price_of_rest(
        &self,
        x: &[f64],
        multipliers: &Multipliers,
    ) -> Result<PriceOfRest, Undefined> {
        let eta = &multipliers.rows[self.layout.rest.clone()];
        let each = || self.resting.iter().copied().zip(eta.iter().copied());
        Ok(match self.problem.rest {
            Rest::Free => PriceOfRest::Free,
            Rest::Unknowns(_) => PriceOfRest::Unknowns(each().collect()),
            Rest::All => {
                let point = self.followed_at(x)?;
                let columns = &point.nodes[self.division.last()].columns;
                let (mut y, mut momentum) = (vec![0.0; self.n], vec![0.0; self.n]);
                for (j, eta) in each() {
                    y.iter_mut().zip(columns.column(j).iter()).for_each(|(y, k)| *y += eta * k);
                }
                self.mass.mul_add(1.0, &y, &mut momentum);
                PriceOfRest::All(momentum)
            }
        })
    }

    /// What the bounds of turns from node to node cost, by the angles at the nodes.
    #[must_use]
    pub fn prices_of_turns(&self, multipliers: &Multipliers) -> Vec<TurnPrice> {
        let last = self.division.last();
        let of = |n: usize, k: usize| multipliers.rows[self.layout.turn(n) + k];
        let size = |n: usize| (0..self.turning.len()).map(move |k| of(n, k).abs());
        let largest = (0..last).flat_map(size).fold(0.0, f64::max);
        let mut prices = Vec::new();
        for (k, &unknown) in self.turning.iter().enumerate() {
            for n in 1..=last {
                let after = if n < last { of(n, k) } else { 0.0 };
                let multiplier = of(n - 1, k) - after;
                if multiplier.abs() > 1e-12 * largest {
                    prices.push(TurnPrice { unknown, node: self.division.starting(n), multiplier });
                }
            }
        }
        prices
    }

    /// The multipliers of the balances at the nodes 0 to N − 1, shape `N × d`.
    #[must_use]
    pub fn costates(&self, multipliers: &Multipliers) -> Vec<Vec<f64>> {
        let d = self.chart.dof();
        let own = |n: usize| {
            let at = self.layout.balance(self.division.node(n));
            multipliers.rows[at..at + d].to_vec()
        };
        (0..self.problem.steps).map(own).collect()
    }
}
