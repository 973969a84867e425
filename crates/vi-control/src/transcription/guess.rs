//! Motions to begin with.
//!
//! A guess states what joint coordinates change by in each step. Where loops close, coordinates
//! that it does not move follow from those that it does, by Newton's method on the closures from
//! node to node; where they do not, the guess stays as it is, open.

use super::chart::{Chart, ReferenceConfiguration};
use super::closure::TreeClosure;
use super::division::Division;
use super::problem::ProblemError;
use super::{SolvedMotion, Transcription};
use nalgebra::DMatrix;
use vi_constraints::reparametrization::Reparametrization;
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_multibody::Mechanism;
use vi_multibody::form::BilinearRow;
use vi_multibody::tree_map::TreeMap;

/// A motion to begin with.
#[derive(Clone, Debug, PartialEq)]
pub struct Guess {
    /// Where it leads.
    pub path: GuessPath,
    /// The value of each control in each step, shape `N × k`; empty: zero.
    pub controls: Vec<Vec<f64>>,
}

/// The path of a guess.
#[derive(Clone, Debug, PartialEq)]
pub enum GuessPath {
    /// What the joint coordinates of the spanning tree change by from node to node, shape `N × d`;
    /// rotation vectors of spherical and free joints in space.
    Increments(Vec<Vec<f64>>),
    /// Configurations, as of an optimum with other steps.
    Nodes {
        /// `q_1 … q_N`, each of shape `n`, on the tree.
        nodes: Vec<Vec<f64>>,
        /// What coordinates that add up have changed by since the start, shape `N × d`.
        travel: Vec<Vec<f64>>,
    },
}

impl Guess {
    /// All coordinates linear in time, by `change` in all, shape `d`.
    #[must_use]
    pub fn line(steps: usize, change: &[f64]) -> Self {
        let part: Vec<f64> = change.iter().map(|c| c / steps as f64).collect();
        Self { path: GuessPath::Increments(vec![part; steps]), controls: Vec::new() }
    }
}

impl GuessPath {
    /// Number of steps, and of coordinates of an odd one or of the first.
    fn shape(&self, d: usize) -> [usize; 2] {
        let rows = match self {
            Self::Increments(rows) | Self::Nodes { travel: rows, .. } => rows,
        };
        let odd = rows.iter().map(Vec::len).find(|count| *count != d);
        [rows.len(), odd.unwrap_or(d)]
    }
}

impl Guess {
    /// The motion of a run, `q_0 … q_N`, in another number of steps, with what controls are in each
    /// of its steps; none: zero.
    #[must_use]
    pub fn of_run(
        mechanism: &Mechanism,
        nodes: &[Vec<f64>],
        controls: &[Vec<f64>],
        steps: usize,
    ) -> Self {
        let n = nodes.first().map_or(0, Vec::len);
        let chart = Chart::new(mechanism, n);
        let mut travel = vec![vec![0.0; chart.dof()]];
        for pair in nodes.windows(2) {
            let moved = coordinates(&chart, &chart.reference(&pair[0]), &pair[1]);
            let last = travel.last().into_iter().flatten();
            travel.push(last.zip(&moved).map(|(a, b)| a + b).collect());
        }
        resampled(&chart, nodes, &travel, controls, steps)
    }
}

/// A motion in another number of steps: between its nodes the configuration that is a part of
/// their chart coordinates away from the first.
fn resampled(
    chart: &Chart,
    nodes: &[Vec<f64>],
    travel: &[Vec<f64>],
    controls: &[Vec<f64>],
    steps: usize,
) -> Guess {
    let of = nodes.len().saturating_sub(1);
    let (mut own_nodes, mut own_travel) = (Vec::new(), Vec::new());
    for n in 1..=steps {
        let (k, rest) = (n * of / steps, n * of % steps);
        let ends = if rest == 0 { k..k + 1 } else { k..k + 2 };
        let part = rest as f64 / steps as f64;
        let (node, traveled) = between(chart, &nodes[ends.clone()], &travel[ends], part);
        own_nodes.push(node);
        own_travel.push(traveled);
    }
    let acts = |n: usize| controls[(2 * n + 1) * controls.len() / (2 * steps)].clone();
    let controls = if controls.is_empty() { Vec::new() } else { (0..steps).map(acts).collect() };
    Guess { path: GuessPath::Nodes { nodes: own_nodes, travel: own_travel }, controls }
}

/// The configuration and the travel that are a part of the way from the first of two nodes to the
/// second, along their chart coordinates; those of the first where there is no other.
fn between(
    chart: &Chart,
    nodes: &[Vec<f64>],
    travel: &[Vec<f64>],
    part: f64,
) -> (Vec<f64>, Vec<f64>) {
    let ([first, second], [start, end]) = (nodes, travel) else {
        return (nodes[0].clone(), travel[0].clone());
    };
    let from = chart.reference(first);
    let moved: Vec<f64> = coordinates(chart, &from, second).iter().map(|x| part * x).collect();
    let traveled = start.iter().zip(end).map(|(a, b)| a + part * (b - a)).collect();
    (chart.place(&from, &moved).q, traveled)
}

impl Transcription {
    /// A guess of so many steps from a motion of this program.
    #[must_use]
    pub fn refined(&self, motion: &SolvedMotion, steps: usize) -> Guess {
        let SolvedMotion { nodes, travel, controls, .. } = motion;
        resampled(&self.chart, nodes, travel, controls, steps)
    }
}

/// `ξ` of a configuration of the tree in the chart about a reference nearby.
fn coordinates(chart: &Chart, from: &ReferenceConfiguration, to: &[f64]) -> Vec<f64> {
    let mut xi = vec![0.0; chart.dof()];
    for _ in 0..20 {
        let placed = chart.place(from, &xi);
        let left: Vec<f64> = to.iter().zip(&placed.q).map(|(a, b)| a - b).collect();
        let left = DMatrix::from_vec(left.len(), 1, left);
        let Ok(step) = chart.columns(&placed).svd(true, true).solve(&left, 1e-12) else { break };
        xi.iter_mut().zip(step.iter()).for_each(|(x, s)| *x += s);
        if step.amax() < 1e-13 {
            break;
        }
    }
    xi
}

/// The references of all nodes of a guess, and what coordinates that add up have
/// changed by there: between the nodes of the steps along the way from one to the next.
pub(super) fn references(
    chart: &Chart,
    mechanism: &Mechanism,
    q: &[f64],
    closures: &[TreeClosure],
    division: &Division,
    guess: &Guess,
) -> Result<(Vec<ReferenceConfiguration>, Vec<Vec<f64>>), ProblemError> {
    let steps = division.step(division.last());
    let (ends, travel) = of_steps(chart, mechanism, q, closures, steps, guess)?;
    if division.each() == 1 {
        return Ok((ends, travel));
    }
    let nodes: Vec<Vec<f64>> = ends.iter().map(|end| end.q().to_vec()).collect();
    let all = (0..=division.last()).map(|k| match division.starting(k) {
        Some(n) => (ends[n].clone(), travel[n].clone()),
        None => {
            let n = division.step(k);
            let part = division.time(k) - n as f64;
            let (node, traveled) = between(chart, &nodes[n..n + 2], &travel[n..n + 2], part);
            (chart.reference(&node), traveled)
        }
    });
    Ok(all.unzip())
}

/// The same of the nodes of the steps alone.
fn of_steps(
    chart: &Chart,
    mechanism: &Mechanism,
    q: &[f64],
    closures: &[TreeClosure],
    steps: usize,
    guess: &Guess,
) -> Result<(Vec<ReferenceConfiguration>, Vec<Vec<f64>>), ProblemError> {
    let d = chart.dof();
    let shape = |found: usize, unknowns: usize| ProblemError::Guess {
        found,
        wanted: steps,
        unknowns,
        degrees: d,
    };
    let [found, unknowns] = guess.path.shape(d);
    if found != steps || unknowns != d {
        return Err(shape(found, unknowns));
    }
    let values = guess.controls.len();
    if values != 0 && values != steps {
        return Err(shape(values, d));
    }
    let increments = match &guess.path {
        GuessPath::Increments(increments) => increments,
        GuessPath::Nodes { nodes, travel } => {
            if let Some(odd) = nodes.iter().find(|own| own.len() != q.len()) {
                return Err(shape(nodes.len(), odd.len()));
            }
            let start = std::iter::once(q);
            let all = start.chain(nodes.iter().map(|own| &own[..]));
            let still = std::iter::once(vec![0.0; d]);
            let travel = still.chain(travel.iter().cloned()).collect();
            return Ok((all.map(|q| chart.reference(q)).collect(), travel));
        }
    };
    let follows: Vec<usize> = (0..d).filter(|&j| increments.iter().all(|u| u[j] == 0.0)).collect();
    let map = TreeMap::new(mechanism);
    let mut nodes = vec![chart.reference(q)];
    let mut travel = vec![vec![0.0; d]];
    let mut s = Interval::new(q.len());
    for (n, u) in increments.iter().enumerate() {
        s.open(0.0, 1.0, nodes[n].q());
        map.reparametrize(u, &mut s).map_err(|_| ProblemError::GuessTurns(n + 1))?;
        let open = chart.reference(&s.q1);
        let mut moved: Vec<f64> = travel[n].iter().zip(u).map(|(a, b)| a + b).collect();
        let closed = close(chart, closures, &follows, &open, &mut moved);
        nodes.push(closed.unwrap_or(open));
        travel.push(moved);
    }
    Ok((nodes, travel))
}

/// The configuration nearby in which loops close, by the coordinates that follow; `moved` takes
/// what they change by. `None` where none is found, or nothing has to close.
fn close(
    chart: &Chart,
    closures: &[TreeClosure],
    follows: &[usize],
    open: &ReferenceConfiguration,
    moved: &mut [f64],
) -> Option<ReferenceConfiguration> {
    const CLOSED: f64 = 1e-12;
    const LARGEST: f64 = 0.5; // of a correction, m or rad
    let closures: Vec<&BilinearRow> = closures.iter().filter_map(TreeClosure::product).collect();
    if closures.is_empty() || follows.is_empty() {
        return None;
    }
    let (mut at, mut change) = (open.clone(), vec![0.0; chart.dof()]);
    for _ in 0..30 {
        let gap: Vec<f64> = closures.iter().map(|row| row.value(at.q())).collect();
        if norm_inf(&gap) < CLOSED {
            moved.iter_mut().zip(&change).for_each(|(m, c)| *m += c);
            return Some(at);
        }
        let mut xi = vec![0.0; chart.dof()];
        let columns = chart.columns(&chart.place(&at, &xi));
        let mut slopes = DMatrix::zeros(closures.len(), follows.len());
        for (k, row) in closures.iter().enumerate() {
            row.for_each_slope(at.q(), |i, slope| {
                for (c, &j) in follows.iter().enumerate() {
                    slopes[(k, c)] += slope * columns[(i, j)];
                }
            });
        }
        let gap = DMatrix::from_vec(closures.len(), 1, gap);
        let step = slopes.svd(true, true).solve(&gap, 1e-10).ok()?;
        let shorter = LARGEST / f64::max(LARGEST, norm_inf(step.as_slice()));
        for (&j, step) in follows.iter().zip(step.iter()) {
            xi[j] = -shorter * step;
            change[j] += xi[j];
        }
        at = chart.reference(&chart.place(&at, &xi).q);
    }
    None
}
