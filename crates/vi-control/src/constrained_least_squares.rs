//! Squares and values under conditions: parameters of a design.
//!
//! ```text
//! minimise ½ ρ(θ)ᵀρ(θ) + κᵀy(θ)   over  θ_min ≤ θ ≤ θ_max,   l ≤ c(θ) ≤ u
//! s = c + λ/w,   v = s − clamp(s, l, u)        minimise f = ½ ρᵀρ + κᵀy + ½ Σ w v²;   then λ ← w v
//! (JᵀJ + S + μ I) δz = −∇f                     z = θ/scale,  r = (ρ, √w v),  J = ∂r/∂z
//! ∇f = Jᵀr + Yᵀκ                               Y = ∂y/∂z
//! S δz = (J⁺ − J)ᵀ r⁺ + (Y⁺ − Y)ᵀ κ            what JᵀJ lacks of the Hessian, by its last change
//! ```
//! The conditions enter the sum of squares with a weight `w` and a multiplier `λ` (Powell,
//! Hestenes, Rockafellar). A weight grows where its violation does not fall to a quarter. At the
//! end `∂(½ρᵀρ + κᵀy)/∂θ + λ ∂c/∂θ = 0` for parameters within their bounds: the cost changes by
//! `−λ` with the bound of a condition that is active.
//!
//! Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed. (2006), chapter 17; J. E.
//! Dennis, D. M. Gay, R. E. Welsch, ACM Trans. Math. Softw. 7 (1981) 348–368 for `S`.
#![allow(non_snake_case)] // J, S, Y

use crate::least_squares::{
    BoundedStep, FitError, Parameter, Refused, Residuals, column, half_square, slope, theta,
};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;
use vi_core::linear::{dot, norm_inf};

/// Violations, in parts of the size of the bound or of 1, below which a condition is met.
pub const MET: f64 = 1e-10;

/// Rounds of multipliers.
const ROUNDS: usize = 60;
/// Change of multipliers, in parts of the largest, that ends the rounds.
const SETTLED: f64 = 1e-9;
/// Largest growth of a weight.
const HEAVIEST: f64 = 1e9;

/// What the last residuals are: values that count as they are, then conditions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Conditions {
    /// `κ` of each value, right before the conditions.
    pub values: Vec<f64>,
    /// `[l, u]` of each, equal for an equation, infinite where there is none.
    pub bounds: Vec<[f64; 2]>,
    /// Those that follow one another along a path: where they are active one by one, the extremes
    /// among neighbours are.
    pub paths: Vec<Range<usize>>,
}

/// How a design ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DesignOutcome {
    /// A minimum that meets the conditions.
    Optimal,
    /// No direction brings the parameters nearer to the conditions.
    Infeasible,
    /// It made as many evaluations with derivatives as it may.
    Exhausted,
    /// It was told to stop.
    Stopped,
    /// No step decreases the sum, though the gradient is not zero.
    Stuck,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstrainedOptimum {
    /// How it ended.
    pub outcome: DesignOutcome,
    /// `θ`.
    pub parameters: Vec<f64>,
    /// `½ ρᵀρ + κᵀy`.
    pub cost: f64,
    /// `c(θ)`.
    pub conditions: Vec<f64>,
    /// `λ`.
    pub multipliers: Vec<f64>,
    /// The largest violation of a condition, in its unit.
    pub violation: f64,
    /// Parameters that are at a bound.
    pub at_bounds: Vec<usize>,
    /// Steps taken.
    pub iterations: usize,
}

/// An evaluation with derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// `θ`.
    pub parameters: Vec<f64>,
    /// `½ ρᵀρ + κᵀy`.
    pub cost: f64,
    /// The largest violation of a condition.
    pub violation: f64,
}

/// Residuals whose last ones are conditions, with weights and multipliers.
struct Augmented<'a> {
    own: &'a mut dyn Residuals,
    values: &'a [f64], // κ
    bounds: &'a [[f64; 2]],
    paths: &'a [Range<usize>],
    multipliers: Vec<f64>,
    weights: Vec<f64>, // w
    watch: &'a mut dyn FnMut(&Evaluation) -> bool,
    stopped: bool,
    raw: Vec<f64>, // ρ, y, c of the last evaluation
    size: f64,     // the largest Σ |κ y|
}

/// Distance from bounds, with its sign.
fn outside(value: f64, [lower, upper]: [f64; 2]) -> f64 {
    value - value.max(lower).min(upper)
}

impl Augmented<'_> {
    /// The places of values.
    fn values(&self) -> Range<usize> {
        let end = self.own.len() - self.bounds.len();
        end - self.values.len()..end
    }

    /// `½ ρᵀρ + κᵀy`.
    fn cost(&self, raw: &[f64]) -> f64 {
        let values = self.values();
        half_square(&raw[..values.start]) + dot(self.values, &raw[values])
    }

    /// Whether nothing is minimised beside the conditions.
    fn is_alone(&self, raw: &[f64]) -> bool {
        self.values.is_empty() && self.cost(raw) == 0.0
    }

    fn violation(&self, conditions: &[f64]) -> f64 {
        let size = |(c, bounds): (&f64, &[f64; 2])| outside(*c, *bounds).abs();
        conditions.iter().zip(self.bounds).map(size).fold(0.0, f64::max)
    }

    /// Whether all conditions are met, each for its size.
    fn is_met(&self, conditions: &[f64]) -> bool {
        let met = |(c, bounds): (&f64, &[f64; 2])| {
            let size = bounds.iter().filter(|x| x.is_finite()).fold(1.0, |s, x| x.abs().max(s));
            outside(*c, *bounds).abs() <= MET * size
        };
        conditions.iter().zip(self.bounds).all(met)
    }

    /// `λ` of the next round.
    fn renewed(&self, conditions: &[f64]) -> Vec<f64> {
        let next = |(k, c): (usize, &f64)| {
            let w = self.weights[k];
            w * outside(c + self.multipliers[k] / w, self.bounds[k])
        };
        let mut renewed: Vec<f64> = conditions.iter().enumerate().map(next).collect();
        for path in self.paths {
            for k in path.clone() {
                let multiplier = std::mem::take(&mut renewed[k]);
                renewed[extreme(conditions, path, k, multiplier)] += multiplier;
            }
        }
        renewed
    }

    /// By how much multipliers change with the rounding of conditions.
    fn rounding(&self) -> f64 {
        let size = |(w, bounds): (&f64, &[f64; 2])| {
            let size = bounds.iter().filter(|x| x.is_finite()).fold(1.0_f64, |s, x| s.max(x.abs()));
            8.0 * f64::EPSILON * w * size
        };
        self.weights.iter().zip(self.bounds).map(size).fold(0.0, f64::max)
    }
}

/// The place on a path, uphill from `k`, where a value is an extreme among its neighbours: a
/// largest one where the multiplier is of an upper bound, a least one of a lower bound.
fn extreme(values: &[f64], path: &Range<usize>, k: usize, multiplier: f64) -> usize {
    let height = |i: usize| if multiplier >= 0.0 { values[i] } else { -values[i] };
    let mut at = k;
    loop {
        let before = at.checked_sub(1).filter(|i| path.contains(i));
        let after = Some(at + 1).filter(|i| path.contains(i));
        let higher = before.into_iter().chain(after).filter(|&i| height(i) > height(at));
        match higher.max_by(|a, b| height(*a).total_cmp(&height(*b))) {
            Some(next) => at = next,
            None => return at,
        }
    }
}

impl Residuals for Augmented<'_> {
    fn len(&self) -> usize {
        self.own.len()
    }

    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        if self.stopped {
            return Err(Refused("it was told to stop".to_owned()));
        }
        self.own.evaluate(theta, out, jacobian.as_deref_mut())?;
        self.raw.copy_from_slice(out);
        let (values, first) = (self.values(), self.values().end);
        let evaluation = Evaluation {
            parameters: theta.to_vec(),
            cost: self.cost(out),
            violation: self.violation(&out[first..]),
        };
        let sizes = self.values.iter().zip(&out[values]).map(|(weight, y)| (weight * y).abs());
        self.size = self.size.max(sizes.sum());
        self.stopped = !(self.watch)(&evaluation);
        for k in 0..self.bounds.len() {
            let (w, row) = (self.weights[k], first + k);
            let v = outside(out[row] + self.multipliers[k] / w, self.bounds[k]); // [2.46]
            let factor =
                if v == 0.0 && self.bounds[k][0] < self.bounds[k][1] { 0.0 } else { w.sqrt() };
            out[row] = factor * v;
            if let Some(jacobian) = jacobian.as_deref_mut() {
                jacobian.row_mut(row).iter_mut().for_each(|x| *x *= factor);
            }
        }
        Ok(())
    }
}

/// A point with residuals and derivatives, by relative parameters.
struct ResidualPoint {
    z: Vec<f64>,
    raw: Vec<f64>, // ρ, y, c
    r: Vec<f64>,   // 0 of values
    J: DMatrix<f64>,
    value: f64,              // κᵀy
    steepness: DVector<f64>, // Yᵀκ
    gradient: DVector<f64>,  // ∇f
    size: f64,               // of values
}

impl ResidualPoint {
    /// `None`: the point is refused, or not finite.
    fn at(
        own: &mut Augmented<'_>,
        parameters: &[Parameter],
        z: Vec<f64>,
    ) -> Result<Option<Self>, Refused> {
        let (mut r, mut J) = (vec![0.0; own.len()], DMatrix::zeros(own.len(), z.len()));
        own.evaluate(&theta(parameters, &z), &mut r, Some(&mut J))?;
        for (j, own) in parameters.iter().enumerate() {
            J.column_mut(j).iter_mut().for_each(|x| *x *= own.scale);
        }
        let (mut value, mut steepness) = (0.0, DVector::zeros(z.len()));
        for (i, weight) in own.values().zip(own.values) {
            value += weight * std::mem::take(&mut r[i]);
            for j in 0..z.len() {
                steepness[j] += weight * std::mem::take(&mut J[(i, j)]);
            }
        }
        let gradient = DVector::from_fn(z.len(), |j, _| dot(column(&J, j), &r) + steepness[j]);
        let finite = value.is_finite()
            && r.iter().chain(J.iter()).chain(steepness.iter()).all(|x| x.is_finite());
        let (raw, size) = (own.raw.clone(), own.size);
        Ok(finite.then_some(Self { z, raw, r, J, value, steepness, gradient, size }))
    }

    /// `f`.
    fn cost(&self) -> f64 {
        half_square(&self.r) + self.value
    }

    /// Parameters that are not held at a bound.
    fn free(&self, parameters: &[Parameter]) -> Vec<usize> {
        let held = |j: &usize| parameters[*j].is_held(self.z[*j], self.gradient[*j]);
        (0..self.z.len()).filter(|j| !held(j)).collect()
    }

    /// Largest free derivative, in parts of the sizes of its terms.
    fn slope(&self, free: &[usize]) -> f64 {
        if self.size == 0.0 {
            return slope(&self.J, &self.r, free);
        }
        let size = |j: &usize| self.J.column(*j).norm() * (2.0 * half_square(&self.r)).sqrt();
        let relative = |j: &usize| self.gradient[*j].abs() / (size(j) + self.size);
        free.iter().map(relative).fold(0.0, f64::max)
    }
}

/// How a round ended.
#[derive(Clone, Copy, PartialEq)]
enum Round {
    Minimum,
    Exhausted,
    Stuck,
}

/// Damped Newton steps to a minimum of the augmented sum.
struct AugmentedNewton<'a> {
    parameters: &'a [Parameter],
    S: DMatrix<f64>,
    damping: f64,
    steps: usize,
    most: usize,
}

impl AugmentedNewton<'_> {
    fn minimum(&mut self, own: &mut Augmented<'_>, at: &mut ResidualPoint) -> Round {
        loop {
            let free = at.free(self.parameters);
            if at.slope(&free) <= FLAT || own.values.is_empty() && half_square(&at.r) == 0.0 {
                return Round::Minimum;
            }
            if self.steps >= self.most {
                return Round::Exhausted;
            }
            self.steps += 1;
            match self.step(own, at, &free) {
                Some((next, size)) => {
                    self.update(at, &next);
                    *at = next;
                    if size <= STEP {
                        return Round::Minimum;
                    }
                }
                None if at.slope(&free) <= NEARLY_FLAT => return Round::Minimum,
                None if self.gain(at, &free) <= ROUNDING * (at.cost().abs() + at.size) => {
                    return Round::Minimum;
                }
                None => return Round::Stuck,
            }
        }
    }

    /// By how much a step without damping decreases the model of the sum; infinite where the model
    /// has no minimum.
    fn gain(&self, at: &ResidualPoint, free: &[usize]) -> f64 {
        let J = at.J.select_columns(free);
        let bend = |i: usize, k: usize| self.S[(free[i], free[k])];
        let curved = J.tr_mul(&J) + DMatrix::from_fn(free.len(), free.len(), bend);
        let slope = DVector::from_fn(free.len(), |k, _| at.gradient[free[k]]);
        let change = curved.cholesky().map(|own| own.solve(&slope));
        change.map_or(f64::INFINITY, |change| 0.5 * slope.dot(&change))
    }

    /// The next point and the size of its step; `None` where no step decreases the sum.
    fn step(
        &mut self,
        own: &mut Augmented<'_>,
        at: &ResidualPoint,
        free: &[usize],
    ) -> Option<(ResidualPoint, f64)> {
        let J = at.J.select_columns(free);
        let plain = J.tr_mul(&J);
        let curved = DMatrix::from_fn(free.len(), free.len(), |i, k| {
            plain[(i, k)] + self.S[(free[i], free[k])]
        });
        let right = DVector::from_fn(free.len(), |k, _| -at.gradient[free[k]]);
        // where no square bends the cost, a damping of 1 changes what is steepest by its own size
        let steep = if own.values.is_empty() { 0.0 } else { right.amax() };
        let largest = plain.diagonal().amax().max(steep).max(f64::MIN_POSITIVE);
        let before = at.cost();
        for _ in 0..TRIALS {
            let damped =
                &curved + DMatrix::identity(free.len(), free.len()) * (self.damping * largest);
            let found = damped.clone().cholesky().map(|own| own.solve(&right));
            let Some(change) = found else {
                self.damping = (4.0 * self.damping).max(1e-6);
                continue;
            };
            let BoundedStep { z, by, size } =
                BoundedStep::new(self.parameters, &at.z, free, change.as_slice());
            let own_moved = DVector::from_fn(free.len(), |k, _| by[free[k]]);
            let predicted = right.dot(&own_moved) - 0.5 * own_moved.dot(&(&curved * &own_moved));
            if let Ok(Some(next)) = ResidualPoint::at(own, self.parameters, z) {
                let decrease = before - next.cost();
                let close = decrease.abs() <= ROUNDING * before.abs() && size <= 1e-5;
                if decrease > 0.0 || close && next.slope(free) < at.slope(free) {
                    if predicted > 0.0 && decrease > 0.75 * predicted {
                        self.damping *= 0.1;
                    } else if decrease < 0.25 * predicted && !close {
                        self.damping = (4.0 * self.damping).max(1e-6);
                    }
                    return Some((next, size));
                }
            }
            if own.stopped || size == 0.0 {
                return None;
            }
            self.damping = (8.0 * self.damping).max(1e-6);
        }
        None
    }

    /// `S` of the last change.
    fn update(&mut self, from: &ResidualPoint, to: &ResidualPoint) {
        let change: DVector<f64> = DVector::from_fn(to.z.len(), |j, _| to.z[j] - from.z[j]);
        let r = DVector::from_column_slice(&to.r);
        let bend = (&to.J - &from.J).tr_mul(&r) + &to.steepness - &from.steepness; // [2.46]
        let y = &to.gradient - &from.gradient;
        let along = y.dot(&change);
        if along.abs() <= 1e-12 * y.norm() * change.norm() || along == 0.0 {
            return;
        }
        let curved = change.dot(&(&self.S * &change)).abs();
        let shorter = if curved > 0.0 { (change.dot(&bend).abs() / curved).min(1.0) } else { 1.0 };
        self.S *= shorter;
        let left = &bend - &self.S * &change;
        let both = &left * y.transpose() + &y * left.transpose();
        self.S += both / along - &y * y.transpose() * (change.dot(&left) / (along * along));
    }
}

/// `f` may rise by rounding.
const ROUNDING: f64 = 1e-12;
/// Relative steps below this end a round.
const STEP: f64 = 1e-13;
/// What is left of slopes at a minimum, and where rounding hides the decrease.
const FLAT: f64 = 1e-12;
const NEARLY_FLAT: f64 = 1e-7;
/// Dampings that are tried.
const TRIALS: usize = 40;

/// Minimises; `watch` sees each evaluation with derivatives, false stops.
///
/// # Errors
/// [`FitError`].
pub fn minimise(
    residuals: &mut dyn Residuals,
    conditions: &Conditions,
    parameters: &[Parameter],
    max_steps: usize,
    watch: &mut dyn FnMut(&Evaluation) -> bool,
) -> Result<ConstrainedOptimum, FitError> {
    if let Some(odd) = parameters.iter().find(|own| !own.is_sound()) {
        return Err(FitError::Parameter(odd.name.clone()));
    }
    let (all, values, bounds) = (residuals.len(), &conditions.values[..], &conditions.bounds[..]);
    let (count, first) = (bounds.len(), all - bounds.len());
    let z: Vec<f64> = parameters.iter().map(|own| own.start / own.scale).collect();
    let weights = weigh(residuals, &theta(parameters, &z), parameters, values, first)?;
    let least = weights.clone();
    let multipliers = vec![0.0; count];
    let paths = &conditions.paths[..];
    let (stopped, raw, size) = (false, vec![0.0; all], 0.0);
    let own = residuals;
    let mut own =
        Augmented { own, values, bounds, paths, multipliers, weights, watch, stopped, raw, size };
    let p = parameters.len();
    // one of values alone begins with a step of the size of the parameters
    let damping = if first == values.len() && !values.is_empty() { 1.0 } else { 1e-3 };
    let mut newton =
        AugmentedNewton { parameters, S: DMatrix::zeros(p, p), damping, steps: 0, most: max_steps };
    let (mut before, mut outcome) = (vec![f64::INFINITY; count], None);
    let (mut z, mut raw) = (z, vec![0.0; all]);
    for round in 0..ROUNDS {
        let begun = ResidualPoint::at(&mut own, parameters, z.clone());
        let begun = match begun {
            Err(error) if round == 0 => return Err(FitError::Start(error)),
            Ok(None) if round == 0 => return Err(FitError::NotFinite),
            Err(_) | Ok(None) => break,
            Ok(Some(begun)) => begun,
        };
        let mut found = begun;
        let ended = newton.minimum(&mut own, &mut found);
        (z, raw) = (found.z, found.raw);
        if own.stopped {
            outcome = Some(DesignOutcome::Stopped);
            break;
        }
        let (at, alone) = (&raw[first..], own.is_alone(&raw));
        let next = own.renewed(at);
        let size = norm_inf(&next);
        let moved = next.iter().zip(&own.multipliers).map(|(a, b)| a - b).collect::<Vec<_>>();
        let (met, settled) =
            (own.is_met(at), norm_inf(&moved) <= (SETTLED * size).max(own.rounding()) || alone);
        own.multipliers = next;
        outcome = match ended {
            Round::Exhausted => Some(DesignOutcome::Exhausted),
            Round::Stuck if alone && met => Some(DesignOutcome::Optimal),
            Round::Minimum if met && settled => Some(DesignOutcome::Optimal),
            Round::Stuck => Some(DesignOutcome::Stuck),
            Round::Minimum if alone && !met => Some(DesignOutcome::Infeasible),
            Round::Minimum => None,
        };
        if outcome.is_some() {
            break;
        }
        let mut heavy = !met;
        for k in 0..count {
            let violated = outside(at[k], bounds[k]).abs();
            if violated > 0.25 * before[k] && violated > MET {
                own.weights[k] = (10.0 * own.weights[k]).min(HEAVIEST * least[k]);
            }
            heavy &= own.weights[k] >= HEAVIEST * least[k] || violated <= MET;
            before[k] = violated;
        }
        if heavy {
            outcome = Some(DesignOutcome::Infeasible);
            break;
        }
    }
    let theta = theta(parameters, &z);
    let conditions = raw[first..].to_vec();
    let at_bound = |j: &usize| {
        let [min, max] = parameters[*j].bounds;
        theta[*j] <= min || theta[*j] >= max
    };
    let alone = own.is_alone(&raw);
    Ok(ConstrainedOptimum {
        outcome: outcome.unwrap_or(DesignOutcome::Exhausted),
        at_bounds: (0..theta.len()).filter(at_bound).collect(),
        cost: own.cost(&raw),
        violation: own.violation(&conditions),
        // where nothing else is minimised conditions have no price
        multipliers: if alone { vec![0.0; count] } else { own.multipliers },
        conditions,
        parameters: theta,
        iterations: newton.steps,
    })
}

/// Weights by which conditions change the sum as much as the residuals do.
fn weigh(
    residuals: &mut dyn Residuals,
    theta: &[f64],
    parameters: &[Parameter],
    values: &[f64],
    first: usize,
) -> Result<Vec<f64>, FitError> {
    let all = residuals.len();
    let (mut at, mut slopes) = (vec![0.0; all], DMatrix::zeros(all, theta.len()));
    residuals.evaluate(theta, &mut at, Some(&mut slopes)).map_err(FitError::Start)?;
    if at.iter().chain(slopes.iter()).any(|x| !x.is_finite()) {
        return Err(FitError::NotFinite);
    }
    if let Some(idle) = (0..theta.len()).find(|&j| slopes.column(j).amax() == 0.0) {
        return Err(FitError::Idle(parameters[idle].name.clone()));
    }
    let square = |i: usize| -> f64 {
        let scaled = |(j, own): (usize, &Parameter)| (own.scale * slopes[(i, j)]).powi(2);
        parameters.iter().enumerate().map(scaled).sum()
    };
    let squares = first - values.len();
    let of_values = (squares..first).zip(values);
    let size: f64 = (0..squares).map(square).sum::<f64>()
        + of_values.map(|(i, weight)| (weight * at[i]).abs()).sum::<f64>();
    let weight = |i: usize| {
        let own = square(i);
        // of no influence at the start: as a condition of size 1
        if size > 0.0 && own > 0.0 { 10.0 * size / own } else { 1.0 }
    };
    Ok((first..all).map(weight).collect())
}
