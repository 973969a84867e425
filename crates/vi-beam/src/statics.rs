//! Static equilibrium by load stepping.
//!
//! ```text
//! r(q) = P(q)ᵀ (∇V − λ w) − λ P_exᵀ (f, τ) = 0                               λ load factor
//! K    = P_exᵀ [ P_inᵀ∇²V P_in + Σ_I \widehat{∇_{d_I}V} d̂_I + λ(f̂, τ̂)_follower ] P_ex + joint geometry
//! q    = F_d(u, q_last),   Dr = K with ∂F_d/∂u on the right
//! ```
//! The loads are scaled by one factor `λ`, dead loads with fixed spatial components, followers with
//! fixed body components; so is the weight `w = M γ`. A step that fails, or that bends an element
//! beyond 90°, is halved; the last equilibrium is always kept. The tangent is exact, symmetric only
//! without torques and followers.
//!
//! Source: theory §6, "Statics".
#![allow(non_snake_case)] // K, V

use crate::element::Elements;
use crate::limit::LimitReport;
use crate::model::{BeamModel, extent};
use nalgebra::{Matrix3, Matrix6, Vector3};
use serde::{Deserialize, Serialize};
use vi_core::interval::Interval;
use vi_core::newton::{
    Block, BlockKind, Fault, Newton, NewtonError, NewtonProblem, NewtonReport, NewtonSettings,
};
use vi_core::potential::Potential;
use vi_core::sparse::Entries;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::sparse_nodal::{Columns, ReducedMatrix, VelocityLayout};
use vi_rigid::directors::{self, director};
use vi_rigid::load::{Load, LoadKind, add_wrench};
use vi_rigid::rotation::skew;

/// How to walk along the load path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StaticSettings {
    /// First step towards a target, as a part of the way.
    pub first_step: f64,
    /// Smallest step, as a part of the way, before the walk gives up.
    pub smallest_step: f64,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl Default for StaticSettings {
    fn default() -> Self {
        let newton = NewtonSettings { max_iterations: 25, ..NewtonSettings::default() };
        Self { first_step: 0.25, smallest_step: 1e-4, newton }
    }
}

/// An equilibrium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium {
    /// Load factor `λ`.
    pub factor: f64,
    /// Coordinates of all frames.
    pub q: Vec<f64>,
    /// Energy of the elements, J.
    pub strain_energy: f64,
    /// Newton's iterations.
    pub iterations: usize,
    /// `|r|_∞` left over, N or N·m.
    pub residual: f64,
    /// How far the elements are from their limit.
    pub limit: LimitReport,
}

/// The equilibria on the way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StaticPath {
    /// In the order of the walk, without the start.
    pub points: Vec<Equilibrium>,
    /// Steps that were halved.
    pub halvings: usize,
}

/// Why a walk ended early; the problem stands at its last equilibrium.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticError {
    /// No equilibrium was found however small the step.
    #[error(
        "no equilibrium was found beyond the load factor {factor:.6} ({cause}); a limit or \
         bifurcation point may be there: follow the path by its arc length, or refine the mesh"
    )]
    NotConverged {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// What the last attempt ended with.
        cause: NewtonError,
        /// The path so far.
        path: Box<StaticPath>,
    },
    /// An element bends too far however small the step.
    #[error("beyond the load factor {factor:.6} {message}")]
    ElementLimit {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// Which element, and what to do.
        message: String,
        /// The path so far.
        path: Box<StaticPath>,
    },
}

pub(crate) enum Refused {
    Newton(NewtonError),
    Limit(String),
}

/// Beams, bodies and loads in search of equilibrium.
pub struct StaticProblem {
    newton: Newton,
    blocks: Vec<Block>,
    pub(crate) u: Vec<f64>, // d
    pub(crate) work: Work,
}

/// Everything an evaluation needs.
pub(crate) struct Work {
    pub(crate) elements: Elements,
    potentials: Vec<Box<dyn Potential>>,
    loads: Vec<Load>,
    time: f64,
    weight: Vec<f64>, // n  M γ
    pub(crate) factor: f64,
    pub(crate) s: Interval, // q0: last equilibrium
    pub(crate) layout: VelocityLayout,
    pub(crate) left: Columns, // P(q)
    right: Columns,           // ∂F_d/∂u
    gradient: Vec<f64>,       // n  ∇V
    bracket: Vec<f64>,        // n  ∇V − λ (w + loads)
    spin: Vec<Matrix6<f64>>,  // geometric terms of each frame
    pub(crate) matrix: ReducedMatrix,
}

impl StaticProblem {
    /// The model in its initial placement, which is taken for the equilibrium at `λ = 0`.
    #[must_use]
    pub fn new(model: &BeamModel, mechanism: &Mechanism, loads: Vec<Load>) -> Self {
        let q = model.placement();
        let (n, frames) = (q.len(), q.len() / 12);
        let mass = mechanism.mass(|out| model.elements.emit_mass(model.mass, out));
        let mut acceleration = vec![0.0; n];
        for k in 0..frames {
            acceleration[12 * k..12 * k + 3].copy_from_slice(model.description.gravity.as_slice());
        }
        let mut weight = vec![0.0; n];
        mass.mul_add(1.0, &acceleration, &mut weight);
        let layout = VelocityLayout::new(mechanism);
        let mut blocks = layout.blocks();
        let length = 1e-5 * extent(&q).max(1e-5);
        for block in &mut blocks {
            block.floor = if block.kind == BlockKind::Rotation { 1e-5 } else { length };
        }
        let mut s = Interval::new(n);
        s.open(0.0, 1.0, &q);
        let (d, zeros) = (layout.dimension().1, || vec![0.0; n]);
        let work = Work {
            elements: model.elements.clone(),
            potentials: Vec::new(),
            loads,
            time: 0.0,
            weight,
            factor: 0.0,
            s,
            left: layout.columns(),
            right: layout.columns(),
            layout,
            gradient: zeros(),
            bracket: zeros(),
            spin: vec![Matrix6::zeros(); frames],
            matrix: ReducedMatrix::default(),
        };
        let newton = Newton::new(d, NewtonSettings::default());
        Self { newton, blocks, u: vec![0.0; d], work }
    }

    /// With a further potential (springs between frames).
    #[must_use]
    pub fn potential(mut self, potential: impl Potential + 'static) -> Self {
        self.work.potentials.push(Box::new(potential));
        self
    }

    /// The time (s) at which the histories of the loads are read; 0 unless said otherwise.
    #[must_use]
    pub fn at_time(mut self, time: f64) -> Self {
        self.work.time = time;
        self
    }

    /// Coordinates of the last equilibrium.
    #[must_use]
    pub fn placement(&self) -> &[f64] {
        &self.work.s.q0
    }

    /// Load factor of the last equilibrium.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.work.factor
    }

    /// Walks from the last equilibrium through the given load factors.
    ///
    /// # Errors
    /// [`StaticError`]; the problem then stands at the last equilibrium of the path it holds.
    pub fn solve(
        &mut self,
        factors: &[f64],
        settings: &StaticSettings,
    ) -> Result<StaticPath, StaticError> {
        self.newton.settings = settings.newton;
        let mut path = StaticPath::default();
        for &target in factors {
            let way = target - self.work.factor;
            let (mut done, mut step) = (0.0, settings.first_step.clamp(0.0, 1.0));
            let start = self.work.factor;
            while done < 1.0 {
                let next = if done + 1.001 * step >= 1.0 { 1.0 } else { done + step };
                let factor = if next < 1.0 { start + next * way } else { target };
                match self.step_to(factor) {
                    Ok(point) => {
                        let easy = point.iterations <= 8;
                        path.points.push(point);
                        done = next;
                        step *= if easy { 2.0 } else { 1.0 };
                    }
                    Err(_) if 0.5 * step >= settings.smallest_step => {
                        step *= 0.5;
                        path.halvings += 1;
                    }
                    Err(refused) => return Err(self.failure(refused, path)),
                }
            }
        }
        Ok(path)
    }

    fn failure(&self, refused: Refused, path: StaticPath) -> StaticError {
        let (factor, path) = (self.work.factor, Box::new(path));
        match refused {
            Refused::Newton(cause) => StaticError::NotConverged { factor, cause, path },
            Refused::Limit(message) => StaticError::ElementLimit { factor, message, path },
        }
    }

    /// One step of the load; on failure everything is as before.
    fn step_to(&mut self, factor: f64) -> Result<Equilibrium, Refused> {
        let before = self.work.factor;
        self.work.factor = factor;
        self.u.fill(0.0);
        let solved = self.newton.solve(&mut Problem::of(&self.blocks, &mut self.work), &mut self.u);
        let outcome = solved.map_err(Refused::Newton).and_then(|report| self.accept(&report));
        if outcome.is_err() {
            self.work.factor = before;
        }
        outcome
    }

    /// Takes the configuration last evaluated as the new equilibrium, unless an element has folded.
    pub(crate) fn accept(&mut self, report: &NewtonReport) -> Result<Equilibrium, Refused> {
        let work = &mut self.work;
        let limit = LimitReport::new(&work.elements, &work.s.q1);
        if limit.is_exceeded() {
            return Err(Refused::Limit(limit.message().unwrap_or_default()));
        }
        let mut q = work.s.q1.clone();
        work.layout.clean(&mut q);
        work.s.open(0.0, 1.0, &q);
        Ok(Equilibrium {
            factor: work.factor,
            strain_energy: work.elements.value(&q),
            q,
            iterations: report.iterations,
            residual: report.residual,
            limit,
        })
    }

    /// The reduced tangent stiffness at the last equilibrium, dense.
    #[must_use]
    pub fn tangent(&mut self) -> nalgebra::DMatrix<f64> {
        let u = vec![0.0; self.u.len()];
        let mut r = u.clone();
        if self.work.evaluate(&u, &mut r).is_ok() {
            self.work.fill_tangent(&u);
        }
        self.work.matrix.to_dense()
    }
}

pub(crate) struct Problem<'a> {
    blocks: &'a [Block],
    work: &'a mut Work,
}

impl<'a> Problem<'a> {
    pub(crate) fn of(blocks: &'a [Block], work: &'a mut Work) -> Self {
        Self { blocks, work }
    }
}

impl NewtonProblem for Problem<'_> {
    fn blocks(&self) -> &[Block] {
        self.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.work.evaluate(x, r)
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        self.work.fill_tangent(x);
        Ok(self.work.matrix.solve(dx)?)
    }
}

impl Work {
    /// `r(u)`; leaves `P(q)` and `∇V` for the tangent.
    pub(crate) fn evaluate(&mut self, u: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.layout.reparametrize(u, &mut self.s)?;
        let q = &self.s.q1;
        self.layout.null_space(q, &mut self.left);
        self.gradient.fill(0.0);
        self.elements.add_gradient(q, 1.0, &mut self.gradient);
        for potential in &self.potentials {
            potential.add_gradient(q, 1.0, &mut self.gradient);
        }
        self.bracket.copy_from_slice(&self.gradient);
        let factor = self.factor;
        self.add_loads(-factor);
        self.layout.pull_back(&self.left, &self.bracket, r);
        Ok(())
    }

    /// `bracket ← bracket + scale (w + loads)` at `q`.
    fn add_loads(&mut self, scale: f64) {
        for (b, w) in self.bracket.iter_mut().zip(&self.weight) {
            *b += scale * w;
        }
        for load in &self.loads {
            let own = load.offset()..load.offset() + 12;
            let frame = &self.s.q1[own.clone()];
            add_wrench(scale, load.wrench(self.time, frame), frame, &mut self.bracket[own]);
        }
    }

    /// `out ← ∂r/∂λ` at the point last evaluated.
    pub(crate) fn load_direction(&mut self, out: &mut [f64]) {
        self.bracket.fill(0.0);
        self.add_loads(-1.0);
        self.layout.pull_back(&self.left, &self.bracket, out);
    }

    /// Fills the tangent at the point last evaluated.
    pub(crate) fn fill_tangent(&mut self, u: &[f64]) {
        self.layout.tangent(u, &self.s, &mut self.right);
        let q = &self.s.q1;
        for (k, spin) in self.spin.iter_mut().enumerate() {
            let (frame, gradient) = (&q[12 * k..12 * k + 12], &self.gradient[12 * k..12 * k + 12]);
            let hats = (0..3).map(|i| skew(&director(gradient, i)) * skew(&director(frame, i)));
            spin.fill(0.0);
            spin.fixed_view_mut::<3, 3>(3, 3).copy_from(&hats.sum::<Matrix3<f64>>());
        }
        for load in self.loads.iter().filter(|load| load.kind() == LoadKind::Follower) {
            let frame = &q[load.offset()..load.offset() + 12];
            let (force, torque): (Vector3<f64>, Vector3<f64>) = load.wrench(self.time, frame);
            let spin = &mut self.spin[load.offset() / 12];
            let mut upper = spin.fixed_view_mut::<3, 3>(0, 3);
            upper += self.factor * skew(&force);
            let mut lower = spin.fixed_view_mut::<3, 3>(3, 3);
            lower += self.factor * skew(&torque);
        }
        let (elements, potentials) = (&self.elements, &self.potentials);
        let emit = |out: &mut dyn Entries| {
            elements.add_hessian(q, 1.0, out);
            potentials.iter().for_each(|potential| potential.add_hessian(q, 1.0, out));
        };
        let pair = (&self.left, &self.right);
        self.matrix.fill(&self.layout, &emit, pair, &self.spin);
        self.matrix.add_joint_geometry(&mut self.layout, pair, &self.bracket);
    }
}

/// The centre of a frame in a placement, m.
#[must_use]
pub fn center_of(q: &[f64], frame: usize) -> Vector3<f64> {
    directors::center(&q[12 * frame..12 * frame + 12])
}
