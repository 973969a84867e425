//! Continuation by arc length: through limit points, where the load has to fall.
//!
//! ```text
//! r(u, μ, t) = 0,    a·u/s² + b (t − t_last)/T² = Δs    s: size (lengths) or 1 rad (angles), both times √d
//! (a, b) unit tangent of the path:  K t' = −∂r/∂t,  (a, b) = ±(t', 1)/|(t', 1)|,  forwards
//! ```
//! A step at whose end the number of unstable directions ([`crate::stability`]) has changed
//! although the load does not turn back has jumped to another branch or passed a bifurcation: it is
//! halved, down to a thousandth of the largest.
//!
//! Each step solves for one unknown more by bordering, two solves with `K` per iteration.
//! Multipliers take no part in the arc length.
//!
//! Source: H. B. Keller, in: Applications of Bifurcation Theory (1977) 359–384.
#![allow(non_snake_case)] // K

use crate::equations::EquilibriumEquations;
use crate::path::{Equilibrium, StaticError, StaticPath};
use crate::problem::StaticProblem;
use crate::step_bounds::{StepBounds, StepFailure};
use serde::{Deserialize, Serialize};
use vi_core::newton::{
    BlockKind, Fault, Newton, NewtonProblem, NewtonSettings, Precision, UnknownBlock,
};

/// How to follow a path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArcLengthSettings {
    /// First arc length; 1 means: all of the load, or a motion by the size of the system.
    pub first_length: f64,
    /// Smallest arc length; below it the path ends.
    pub smallest_length: f64,
    /// Largest arc length.
    pub largest_length: f64,
    /// Load parameter `T` of all of the load.
    pub full_load: f64,
    /// Whether to leave the path for the branch that bifurcates where it loses its stability.
    pub switches_branch: bool,
    /// Most steps.
    pub steps: usize,
    /// Bounds of the change of one step.
    pub bounds: StepBounds,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl Default for ArcLengthSettings {
    fn default() -> Self {
        let newton = NewtonSettings { max_iterations: 15, ..NewtonSettings::default() };
        Self {
            first_length: 0.02,
            smallest_length: 1e-7,
            largest_length: 0.1,
            full_load: 1.0,
            switches_branch: false,
            steps: 200,
            bounds: StepBounds::default(),
            newton,
        }
    }
}

/// Part of the largest arc length down to which a change of stability is located.
const LOCATED: f64 = 1e-3;

/// The unit tangent of the path.
pub(crate) struct PathTangent {
    pub(crate) a: Vec<f64>, // d, divided by s²
    pub(crate) b: f64,      // divided by T²
}

pub(crate) struct Bordered<'a> {
    pub(crate) blocks: &'a [UnknownBlock],
    pub(crate) work: &'a mut EquilibriumEquations,
    pub(crate) tangent: &'a PathTangent,
    pub(crate) length: f64, // Δs
    pub(crate) last: f64,   // t_last
    pub(crate) column: &'a mut [f64],
}

impl NewtonProblem for Bordered<'_> {
    fn blocks(&self) -> &[UnknownBlock] {
        self.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let (rest, change) = (&x[..x.len() - 1], x[x.len() - 1]);
        self.work.t = self.last + change;
        let (equations, arc) = r.split_at_mut(rest.len());
        self.work.evaluate(rest, equations)?;
        arc[0] = dot(&self.tangent.a, rest) + self.tangent.b * change - self.length;
        Ok(())
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let rest = x.len() - 1;
        self.work.fill_tangent(&x[..rest]);
        self.work.parameter_slope(self.column);
        self.work.solve(self.column)?; // K⁻¹ ∂r/∂t
        let (du, arc) = dx.split_at_mut(rest);
        self.work.solve(du)?; // K⁻¹ r
        let PathTangent { a, b } = self.tangent;
        let change = (arc[0] - dot(a, du)) / (b - dot(a, self.column));
        arc[0] = change;
        du.iter_mut().zip(&*self.column).for_each(|(x, y)| *x -= change * y);
        self.work.follow_stresses(du);
        Ok(())
    }

    fn precision(&self) -> Precision {
        self.work.precision()
    }
}

/// The continuation of a path, one equilibrium after the other.
pub struct Continuation {
    settings: ArcLengthSettings,
    newton: Newton,
    blocks: Vec<UnknownBlock>,
    x: Vec<f64>,        // (u, μ, t − t_last)
    column: Vec<f64>,   // ∂r/∂t and the like
    forwards: Vec<f64>, // the last step
    length: f64,
    halvings: usize,
    switched: Option<f64>,
}

impl std::fmt::Debug for Continuation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Continuation").field("length", &self.length).finish_non_exhaustive()
    }
}

impl Continuation {
    /// Load parameter of the first equilibrium on the branch that was switched to last.
    #[must_use]
    pub fn switched(&self) -> Option<f64> {
        self.switched
    }

    /// Steps that were halved so far.
    #[must_use]
    pub fn halvings(&self) -> usize {
        self.halvings
    }
}

/// Over the shorter of both.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl StaticProblem {
    /// Follows the path from the last equilibrium, first towards larger load parameters, until
    /// `done` says so or the steps are used up.
    ///
    /// # Errors
    /// [`StaticError`]; the problem then stands at the last equilibrium of the path it holds.
    pub fn follow(
        &mut self,
        settings: &ArcLengthSettings,
        mut done: impl FnMut(&Equilibrium) -> bool,
    ) -> Result<StaticPath, StaticError> {
        let mut continuation = self.continuation(settings);
        let mut path = StaticPath::default();
        while path.points.len() < settings.steps {
            let found = self.next_point(&mut continuation);
            path.halvings = continuation.halvings;
            let point = match found {
                Ok(point) => point,
                Err(refused) => return Err(self.failure(refused, path)),
            };
            let stop = done(&point);
            path.points.push(point);
            if stop {
                break;
            }
        }
        Ok(path)
    }

    /// Begins at the last equilibrium, towards larger load parameters.
    #[must_use]
    pub fn continuation(&mut self, settings: &ArcLengthSettings) -> Continuation {
        self.unstable = self.unstable.or_else(|| self.unstable_directions());
        let rest = self.x.len();
        let mut forwards = vec![0.0; rest + 1];
        forwards[rest] = settings.full_load;
        Continuation {
            settings: *settings,
            newton: Newton::new(rest + 1, settings.newton),
            blocks: self.arc_blocks(settings.full_load),
            x: vec![0.0; rest + 1],
            column: vec![0.0; rest],
            forwards,
            length: settings.first_length,
            halvings: 0,
            switched: None,
        }
    }

    /// The next equilibrium of a continuation that began here; the caller limits their number.
    ///
    /// # Errors
    /// [`StaticError`], without a path; the problem stands at the last equilibrium.
    pub fn next_equilibrium(
        &mut self,
        path: &mut Continuation,
    ) -> Result<Equilibrium, StaticError> {
        self.next_point(path).map_err(|refused| self.failure(refused, StaticPath::default()))
    }

    fn next_point(&mut self, path: &mut Continuation) -> Result<Equilibrium, StepFailure> {
        self.bounds = path.settings.bounds;
        let tangent = self
            .path_tangent(&path.forwards, path.settings.full_load, &mut path.column)
            .map_err(StepFailure::fault)?;
        loop {
            let before = self.mark();
            match self.arc_step(path, &tangent) {
                // perhaps on another branch: a shorter step stays on the path, or locates a
                // bifurcation
                Ok(point)
                    if self.unstable != point.unstable
                        && 0.5 * path.length >= LOCATED * path.settings.largest_length
                        && !self.turns(path, &tangent) =>
                {
                    self.return_to(before);
                    path.length *= 0.5;
                    path.halvings += 1;
                }
                Ok(point) => {
                    let leaves = path.settings.switches_branch
                        && self.loses_stability(&point)
                        && !self.turns(path, &tangent);
                    if leaves {
                        self.return_to(before);
                        let (point, x) = self.switch_branch(path.settings.full_load)?;
                        self.unstable = point.unstable;
                        path.forwards.copy_from_slice(&x);
                        path.switched = Some(point.factor);
                        path.length = path.settings.first_length;
                        return Ok(point);
                    }
                    self.unstable = point.unstable;
                    path.forwards.copy_from_slice(&path.x);
                    let grown = if point.iterations <= 6 { 1.5 } else { 1.0 } * path.length;
                    path.length = grown.min(path.settings.largest_length);
                    return Ok(point);
                }
                Err(_) if 0.5 * path.length >= path.settings.smallest_length => {
                    path.length *= 0.5;
                    path.halvings += 1;
                }
                Err(refused) => return Err(refused),
            }
        }
    }

    /// Whether the load turns back between the last two equilibria, at a limit point: there the
    /// number of unstable directions changes along the path.
    fn turns(&mut self, path: &mut Continuation, last: &PathTangent) -> bool {
        let forwards = path.x.clone();
        let next = self.path_tangent(&forwards, path.settings.full_load, &mut path.column);
        next.is_ok_and(|next| next.b * last.b < 0.0)
    }

    fn arc_step(
        &mut self,
        path: &mut Continuation,
        tangent: &PathTangent,
    ) -> Result<Equilibrium, StepFailure> {
        let (d, rest, last) = (self.work.unknowns(), self.x.len(), self.work.t);
        let Continuation { settings, newton, blocks, x, column, length, .. } = path;
        let (full, length) = (settings.full_load, *length);
        let square = self.squares();
        let start = x[..d].iter_mut().zip(&tangent.a).zip(&square);
        start.for_each(|((x, a), s)| *x = length * a * s);
        x[d..rest].copy_from_slice(&self.mu);
        x[rest] = length * tangent.b * full * full;
        let work = &mut self.work;
        work.tangent_stresses = None;
        let mut problem = Bordered { blocks, work, tangent, length, last, column };
        let solved = newton.solve(&mut problem, x).map_err(StepFailure::Newton);
        self.work.tangent_stresses = None;
        let outcome = solved.and_then(|report| {
            self.refuse_jump(&self.bounds)?;
            // off the tangent by less than 60°
            let squares = x[..d].iter().zip(&square).map(|(u, s)| u * u / s);
            let increment = (squares.sum::<f64>() + (x[rest] / full).powi(2)).sqrt();
            if increment > 2.0 * length {
                let times = increment / length;
                return Err(StepFailure::Jump(format!(
                    "the increment is {times:.1} times the arc length"
                )));
            }
            self.x.copy_from_slice(&x[..rest]);
            self.accept(&report)
        });
        if outcome.is_err() {
            self.work.t = last;
        }
        outcome
    }

    /// Unit tangent at the last equilibrium, along `forwards`.
    fn path_tangent(
        &mut self,
        forwards: &[f64],
        full: f64,
        column: &mut [f64],
    ) -> Result<PathTangent, Fault> {
        let d = self.work.unknowns();
        self.x[..d].fill(0.0);
        self.x[d..].copy_from_slice(&self.mu);
        self.work.evaluate(&self.x, column)?;
        self.work.fill_tangent(&self.x);
        self.work.parameter_slope(column);
        self.work.solve(column)?;
        let squares = self.squares();
        let scaled: Vec<f64> = column.iter().zip(&squares).map(|(t, s)| -t / s).collect();
        let square = 1.0 / (full * full) - dot(&scaled, column);
        let along = dot(&scaled, &forwards[..d]) + forwards[forwards.len() - 1] / (full * full);
        let size = square.sqrt().copysign(along);
        let b = 1.0 / (full * full * size);
        Ok(PathTangent { a: scaled.iter().map(|a| a / size).collect(), b })
    }

    /// `s²` of each unknown: of the size for lengths, 1 for angles, both times `d`.
    fn squares(&self) -> Vec<f64> {
        let size = self.work.size();
        let many = self.work.unknowns().max(1) as f64;
        // S is 1 for lengths and the square of the size for angles
        self.work.metric().iter().map(|s| many * size * size / s).collect()
    }

    pub(crate) fn arc_blocks(&self, full: f64) -> Vec<UnknownBlock> {
        let rest = self.x.len();
        let mut blocks = self.blocks.clone();
        let range = rest..rest + 1;
        blocks.push(UnknownBlock { kind: BlockKind::Multiplier, range, floor: 1e-5 * full });
        blocks
    }
}
