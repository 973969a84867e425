//! Continuation by arc length: through limit points, where the load has to fall.
//!
//! ```text
//! r(u, λ) = 0,    a·u/s² + b (λ − λ_last) = Δs            s: extent (lengths) or 1 rad (angles)
//! (a, b) unit tangent of the path:  K t = −∂r/∂λ,  (a, b) = ±(t, 1)/|(t, 1)|,  forwards
//! ```
//! Each step solves for `d + 1` unknowns by bordering, two solves with `K` per iteration.
//!
//! Source: H. B. Keller, in: Applications of Bifurcation Theory (1977) 359–384.
#![allow(non_snake_case)] // K

use crate::equilibrium::Work;
use crate::static_path::{Equilibrium, StaticError, StaticPath};
use crate::statics::{Refused, StaticProblem};
use serde::{Deserialize, Serialize};
use vi_core::newton::{Block, BlockKind, Fault, Newton, NewtonProblem, NewtonSettings};
use vi_multibody::sparse_nodal::extent;

/// How to follow a path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArcSettings {
    /// First arc length; 1 means: all of the load, or a motion by the extent of the system.
    pub first_length: f64,
    /// Smallest arc length before the walk gives up.
    pub smallest_length: f64,
    /// Largest arc length.
    pub largest_length: f64,
    /// Most steps.
    pub steps: usize,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl Default for ArcSettings {
    fn default() -> Self {
        let newton = NewtonSettings { max_iterations: 15, ..NewtonSettings::default() };
        Self { first_length: 0.02, smallest_length: 1e-7, largest_length: 0.1, steps: 200, newton }
    }
}

/// A point of the path with its unit tangent.
struct Tangent {
    a: Vec<f64>, // d, divided by s²
    b: f64,
}

struct Bordered<'a> {
    blocks: &'a [Block],
    work: &'a mut Work,
    tangent: &'a Tangent,
    length: f64, // Δs
    last: f64,   // λ_last
    column: &'a mut [f64],
}

impl NewtonProblem for Bordered<'_> {
    fn blocks(&self) -> &[Block] {
        self.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let (u, factor) = (&x[..x.len() - 1], x[x.len() - 1]);
        self.work.factor = self.last + factor;
        let (equations, arc) = r.split_at_mut(u.len());
        self.work.evaluate(u, equations)?;
        arc[0] = dot(&self.tangent.a, u) + self.tangent.b * factor - self.length;
        Ok(())
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let d = x.len() - 1;
        self.work.fill_tangent(&x[..d]);
        self.work.load_direction(self.column);
        self.work.matrix.solve(self.column)?; // K⁻¹ ∂r/∂λ
        let (du, arc) = dx.split_at_mut(d);
        self.work.matrix.solve(du)?; // K⁻¹ r
        let Tangent { a, b } = self.tangent;
        let change = (arc[0] - dot(a, du)) / (b - dot(a, self.column));
        arc[0] = change;
        du.iter_mut().zip(&*self.column).for_each(|(x, y)| *x -= change * y);
        Ok(())
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl StaticProblem {
    /// Follows the path from the last equilibrium, first towards larger `λ`, until `done` says so or
    /// the steps are used up.
    ///
    /// # Errors
    /// [`StaticError`]; the problem then stands at the last equilibrium of the path it holds.
    pub fn follow(
        &mut self,
        settings: &ArcSettings,
        mut done: impl FnMut(&Equilibrium) -> bool,
    ) -> Result<StaticPath, StaticError> {
        let d = self.u.len();
        let blocks = self.arc_blocks();
        let mut newton = Newton::new(d + 1, settings.newton);
        let (mut x, mut column) = (vec![0.0; d + 1], vec![0.0; d]);
        let mut path = StaticPath::default();
        let mut length = settings.first_length;
        let mut forwards = vec![0.0; d + 1];
        forwards[d] = 1.0;
        while path.points.len() < settings.steps {
            let Some(tangent) = self.path_tangent(&forwards, &mut column) else { break };
            match self.arc_step((&mut newton, &blocks), &tangent, length, (&mut x, &mut column)) {
                Ok(point) => {
                    forwards.copy_from_slice(&x);
                    let easy = point.iterations <= 6;
                    length = (if easy { 1.5 } else { 1.0 } * length).min(settings.largest_length);
                    let stop = done(&point);
                    path.points.push(point);
                    if stop {
                        break;
                    }
                }
                Err(_) if 0.5 * length >= settings.smallest_length => {
                    length *= 0.5;
                    path.halvings += 1;
                }
                Err(refused) => return Err(self.failure(refused, path)),
            }
        }
        Ok(path)
    }

    fn arc_step(
        &mut self,
        (newton, blocks): (&mut Newton, &[Block]),
        tangent: &Tangent,
        length: f64,
        (x, column): (&mut [f64], &mut [f64]),
    ) -> Result<Equilibrium, Refused> {
        let (d, last) = (self.u.len(), self.work.factor);
        let scales = self.scales();
        let start = x[..d].iter_mut().zip(&tangent.a).zip(&scales);
        start.for_each(|((x, a), s)| *x = length * a * s * s);
        x[d] = length * tangent.b;
        let work = &mut self.work;
        let mut problem = Bordered { blocks, work, tangent, length, last, column };
        let solved = newton.solve(&mut problem, x).map_err(Refused::Newton);
        let outcome = solved.and_then(|report| {
            self.refuse_jump()?;
            self.accept(&report)
        });
        if outcome.is_err() {
            self.work.factor = last;
        }
        outcome
    }

    /// Unit tangent at the last equilibrium, along `forwards`; `None` when the tangent stiffness is
    /// singular to the last bit.
    fn path_tangent(&mut self, forwards: &[f64], column: &mut [f64]) -> Option<Tangent> {
        let d = self.u.len();
        let zero = vec![0.0; d];
        self.work.evaluate(&zero, column).ok()?;
        self.work.fill_tangent(&zero);
        self.work.load_direction(column);
        self.work.matrix.solve(column).ok()?;
        let scales = self.scales();
        let scaled: Vec<f64> = column.iter().zip(&scales).map(|(t, s)| -t / (s * s)).collect();
        let square = 1.0 - dot(&scaled, column);
        let size = square.sqrt().copysign(dot(&scaled, &forwards[..d]) + forwards[d]);
        Some(Tangent { a: scaled.iter().map(|a| a / size).collect(), b: 1.0 / size })
    }

    /// `s` of each unknown: the extent for lengths, 1 for angles, both times `√d`.
    fn scales(&self) -> Vec<f64> {
        let many = (self.u.len().max(1) as f64).sqrt();
        let extent = extent(&self.work.s.q0).max(f64::MIN_POSITIVE);
        let mut scales = vec![many; self.u.len()];
        for block in self.blocks.iter().filter(|block| block.kind == BlockKind::Position) {
            scales[block.range.clone()].fill(many * extent);
        }
        scales
    }

    fn arc_blocks(&self) -> Vec<Block> {
        let d = self.u.len();
        let mut blocks = self.blocks.clone();
        blocks.push(Block { kind: BlockKind::Multiplier, range: d..d + 1, floor: 1e-5 });
        blocks
    }
}
