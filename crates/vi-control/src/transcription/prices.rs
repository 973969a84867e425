//! What the multipliers of a program say: of conditions at their nodes, of rest, of turns, of
//! balances.

use super::Transcription;
use super::layout::is_bound;
use super::problem::{NodeNumber, RestAtEnd};
use crate::program::{Multipliers, Program as _, Undefined};

/// Turns this near to the largest one, rad, are at it: a method keeps off by `μ/λ`.
const AT_BOUND: f64 = 1e-6;

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

/// The size of a program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PriceSize {
    /// Variables.
    pub unknowns: usize,
    /// Those that are values of controls.
    pub values: usize,
    /// Rows that are equations.
    pub equations: usize,
    /// Rows with bounds: conditions, turns.
    pub inequalities: usize,
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

/// A momentum that is zero at rest, at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resting {
    /// The unknown of the tree along which it is.
    pub unknown: usize,
    /// `P(q_N)ᵀ [p̄_N − G_c(q_N)ᵀ hλ_N]` along it, N·s or N·m·s.
    pub momentum: f64,
    /// Its multiplier: the cost changes by minus this with the momentum that is left.
    pub multiplier: f64,
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
                let NodeNumber::Joint { unknown, .. } = condition.quantity else { continue };
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
            let NodeNumber::Joint { unknown, start } = own.quantity else { continue };
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

    /// The momenta that are zero at rest, at a point with its multipliers.
    ///
    /// # Errors
    /// [`Undefined`].
    pub fn resting(&self, x: &[f64], multipliers: &Multipliers) -> Result<Vec<Resting>, Undefined> {
        let mut momenta = vec![0.0; self.chart.dof()];
        self.residual(&self.followed_at(x)?, self.division.last(), &mut momenta);
        let eta = &multipliers.rows[self.layout.rest.clone()];
        let own = |(&unknown, &multiplier): (&usize, &f64)| Resting {
            unknown,
            momentum: momenta[unknown],
            multiplier,
        };
        Ok(self.resting.iter().zip(eta).map(own).collect())
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
            RestAtEnd::Free => PriceOfRest::Free,
            RestAtEnd::Unknowns(_) => PriceOfRest::Unknowns(each().collect()),
            RestAtEnd::All => {
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

    /// What the bounds of controls cost: of each step and control `z_U − z_L` of the value that
    /// begins there, NaN where none does, shape `N × k`.
    #[must_use]
    pub fn prices_of_controls(&self, multipliers: &Multipliers) -> Vec<Vec<f64>> {
        let Multipliers { lower, upper, .. } = multipliers;
        let own = |n: usize, k: usize| {
            let at = self.layout.control(k, n);
            let begins = n == 0 || self.layout.control(k, n - 1) != at;
            if begins { upper[at] - lower[at] } else { f64::NAN }
        };
        let count = self.problem.controls.len();
        (0..self.problem.steps).map(|n| (0..count).map(|k| own(n, k)).collect()).collect()
    }

    /// The size of the program.
    #[must_use]
    pub fn size(&self) -> PriceSize {
        let bounds = self.bounds().rows;
        let equations = bounds.iter().filter(|[low, high]| low.to_bits() == high.to_bits()).count();
        let of = |k: usize| self.layout.values(k).len();
        PriceSize {
            unknowns: self.layout.variables,
            values: (0..self.problem.controls.len()).map(of).sum(),
            equations,
            inequalities: bounds.len() - equations,
        }
    }

    /// The steps in which an angle turns by as much as it may from a node to the next, at a point.
    #[must_use]
    pub fn bounded_turns(&self, x: &[f64]) -> Vec<usize> {
        let most = self.problem.max_increment - AT_BOUND;
        let turns = |n: usize, j: usize| self.traveled(x, n + 1, j) - self.traveled(x, n, j);
        let is_at_bound = |n: &usize| self.turning.iter().any(|&j| turns(*n, j).abs() >= most);
        let nodes = (0..self.division.last()).filter(is_at_bound);
        let mut steps: Vec<usize> = nodes.map(|n| self.division.step(n)).collect();
        steps.dedup();
        steps
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
