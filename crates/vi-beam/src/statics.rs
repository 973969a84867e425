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

use crate::equilibrium::{Problem, Work};
use crate::limit::{LimitReport, angle_between};
use crate::model::BeamModel;
pub use crate::static_path::{
    Equilibrium, StaticError, StaticPath, StaticSettings, StaticSetupError,
};
use nalgebra::DMatrix;
use vi_core::newton::{Block, BlockKind, Newton, NewtonError, NewtonReport, NewtonSettings};
use vi_core::potential::Potential;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::sparse_nodal::extent;
use vi_rigid::load::Load;

pub(crate) enum Refused {
    Newton(NewtonError),
    Limit(String),
    Jump { element: usize, turn: f64 },
}

/// Beams, bodies and loads in search of equilibrium.
pub struct StaticProblem {
    pub(crate) newton: Newton,
    pub(crate) blocks: Vec<Block>,
    largest_turn: f64,
    pub(crate) u: Vec<f64>, // d
    pub(crate) work: Work,
}

impl StaticProblem {
    /// The model in its initial placement, which is taken for the equilibrium at `λ = 0`.
    ///
    /// # Errors
    /// [`StaticSetupError`].
    pub fn new(
        model: &BeamModel,
        mechanism: &Mechanism,
        loads: Vec<Load>,
    ) -> Result<Self, StaticSetupError> {
        if let Some(&cut) = mechanism.cut_joints().first() {
            let joint = mechanism.description().joints[cut].name.clone();
            return Err(StaticSetupError::ClosedLoop { joint });
        }
        if !mechanism.description().particles.is_empty() {
            return Err(StaticSetupError::Particles);
        }
        let work = Work::new(model, mechanism, loads);
        let mut blocks = work.layout.blocks();
        let length = 1e-5 * extent(&work.s.q0).max(1e-5);
        for block in &mut blocks {
            block.floor = if block.kind == BlockKind::Rotation { 1e-5 } else { length };
        }
        let d = work.layout.dimension().1;
        let newton = Newton::new(d, NewtonSettings::default());
        Ok(Self { newton, blocks, largest_turn: f64::INFINITY, u: vec![0.0; d], work })
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
        self.largest_turn = settings.largest_turn;
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

    pub(crate) fn failure(&self, refused: Refused, path: StaticPath) -> StaticError {
        let (factor, path) = (self.work.factor, Box::new(path));
        match refused {
            Refused::Newton(cause) => StaticError::NotConverged { factor, cause, path },
            Refused::Jump { element, turn } => StaticError::Jump { factor, element, turn, path },
            Refused::Limit(message) => StaticError::ElementLimit { factor, message, path },
        }
    }

    /// One step of the load; on failure everything is as before.
    fn step_to(&mut self, factor: f64) -> Result<Equilibrium, Refused> {
        let before = self.work.factor;
        self.work.factor = factor;
        self.u.fill(0.0);
        let solved = self.newton.solve(&mut Problem::of(&self.blocks, &mut self.work), &mut self.u);
        let outcome = solved.map_err(Refused::Newton).and_then(|report| {
            self.refuse_jump()?;
            self.accept(&report)
        });
        if outcome.is_err() {
            self.work.factor = before;
        }
        outcome
    }

    pub(crate) fn refuse_jump(&self) -> Result<(), Refused> {
        let s = &self.work.s;
        for (element, nodes) in self.work.pairs().enumerate() {
            let turn = angle_between(nodes, &s.q1) - angle_between(nodes, &s.q0);
            if turn.abs() > self.largest_turn {
                return Err(Refused::Jump { element, turn });
            }
        }
        Ok(())
    }

    /// Takes the configuration last evaluated as the new equilibrium, unless an element has folded.
    pub(crate) fn accept(&mut self, report: &NewtonReport) -> Result<Equilibrium, Refused> {
        let work = &mut self.work;
        let limit = LimitReport::of_pairs(work.pairs(), &work.s.q1);
        if limit.is_exceeded() {
            return Err(Refused::Limit(limit.message().unwrap_or_default()));
        }
        let mut q = work.s.q1.clone();
        work.layout.clean(&mut q);
        work.s.open(0.0, 1.0, &q);
        Ok(Equilibrium {
            factor: work.factor,
            strain_energy: work.elements.value(&q) + work.high_order.value(&q),
            q,
            iterations: report.iterations,
            residual: report.residual,
            limit,
        })
    }

    /// The reduced tangent stiffness at the last equilibrium, dense.
    #[must_use]
    pub fn tangent(&mut self) -> DMatrix<f64> {
        let u = vec![0.0; self.u.len()];
        let mut r = u.clone();
        if self.work.evaluate(&u, &mut r).is_ok() {
            self.work.fill_tangent(&u);
        }
        self.work.matrix.to_dense()
    }
}
