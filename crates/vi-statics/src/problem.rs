//! Static equilibrium by load stepping.
//!
//! ```text
//! ∇V(q) − f(t, q) + G(t, q)ᵀ μ = 0,    g(t, q) = 0                           t load parameter
//! ```
//! Loads and prescribed motions are taken at the time `t`: the motion is what a system does infinitely
//! slowly. [`StaticProblem::new`] lets all loads and the weight of beams grow in proportion to `t`, so that `t` is their
//! factor. A prescribed motion makes the path one of given displacements. A step that fails, that
//! moves too much at once ([`StepBounds`]), or that bends an element beyond 90°, is halved; the last
//! equilibrium is always kept. Loops of joints, redundant constraints, point masses, springs and
//! couplings are all allowed; the tangent is exact and sparse. See [`crate::relaxation`] for starts that are no
//! equilibria.
//!
//! Source: theory §6, "Statics".

use crate::equilibrium::{Problem, Work};
use crate::limit::{LimitReport, angle_between};
use crate::model::BeamModel;
pub use crate::static_path::{Equilibrium, StaticError, StaticPath, StaticSettings, StepBounds};
use nalgebra::Vector3;
use vi_constraints::Constraints;
use vi_core::Configuration;
use vi_core::linear::norm_inf;
use vi_core::newton::{Block, Newton, NewtonError, NewtonReport, NewtonSettings};
use vi_core::{MechanicalSystem, SeparableSystem};
use vi_multibody::mechanism::Mechanism;
use vi_rigid::directors;
use vi_rigid::load::Load;

#[derive(Debug)]
pub(crate) enum Refused {
    Newton(NewtonError),
    Limit(String),
    Jump(String),
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Newton(error) => error.fmt(f),
            Self::Limit(message) | Self::Jump(message) => f.write_str(message),
        }
    }
}

/// Beams, bodies, point masses and loads in search of equilibrium.
pub struct StaticProblem {
    pub(crate) newton: Newton,
    pub(crate) blocks: Vec<Block>,
    pub(crate) bounds: StepBounds,
    pub(crate) x: Vec<f64>,  // (u, μ)
    pub(crate) mu: Vec<f64>, // μ of the last equilibrium, chosen rows
    pub(crate) work: Work,
    pub(crate) neutral: bool, // some direction has no stiffness: steps are relaxed
    pairs: Vec<[usize; 2]>,   // neighbouring nodes of elements
    elastic: Vec<bool>,       // frames that are nodes of elements
}

impl StaticProblem {
    /// The beams of a model in their initial configuration, which is taken for the equilibrium at `t = 0`;
    /// loads and weight grow in proportion to `t`, whatever the histories of the loads.
    #[must_use]
    pub fn new(model: &BeamModel, mechanism: &Mechanism, loads: Vec<Load>) -> Self {
        let system = model.static_system(mechanism, loads);
        Self::of_system(system, mechanism.clone(), model.neighbours(), (0.0, &model.placement()))
    }

    /// Any system with its constraints, at the load parameter `t` and the configuration `q`; `pairs`:
    /// frames that are neighbouring nodes of an element.
    #[must_use]
    pub fn of_system(
        system: SeparableSystem,
        mechanism: Mechanism,
        pairs: Vec<[usize; 2]>,
        at: (f64, &[f64]),
    ) -> Self {
        let mut elastic = vec![false; mechanism.description().bodies.len()];
        pairs.iter().flatten().for_each(|&node| elastic[node] = true);
        let work = Work::new(system, mechanism, at);
        let (d, rows) = (work.unknowns(), work.rows.len());
        Self {
            newton: Newton::new(d + rows, NewtonSettings::default()),
            blocks: work.blocks(),
            bounds: StepBounds::default(),
            x: vec![0.0; d + rows],
            mu: vec![0.0; rows],
            work,
            neutral: false,
            pairs,
            elastic,
        }
    }

    /// Coordinates of the last equilibrium.
    #[must_use]
    pub fn placement(&self) -> &[f64] {
        &self.work.s.q0
    }

    /// Load parameter of the last equilibrium.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.work.t
    }

    /// The constraints.
    #[must_use]
    pub fn mechanism(&self) -> &Mechanism {
        &self.work.mechanism
    }

    /// The constraints that are enforced, without those inside the frames.
    #[must_use]
    pub fn rows(&self) -> &vi_constraints::saddle_point::IndependentRows {
        &self.work.rows
    }

    /// Whether some direction has no stiffness; steps are then relaxed.
    #[must_use]
    pub fn is_neutral(&self) -> bool {
        self.neutral
    }

    /// Walks from the last equilibrium through the given load parameters.
    ///
    /// # Errors
    /// [`StaticError`]; the problem then stands at the last equilibrium of the path it holds.
    pub fn solve(
        &mut self,
        factors: &[f64],
        settings: &StaticSettings,
    ) -> Result<StaticPath, StaticError> {
        self.newton.settings = settings.newton;
        self.bounds = settings.bounds;
        let mut path = StaticPath::default();
        for &target in factors {
            let start = self.work.t;
            let way = target - start;
            let (mut done, mut step) = (0.0, settings.first_step.clamp(0.0, 1.0));
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
        let (factor, path) = (self.work.t, Box::new(path));
        match refused {
            Refused::Newton(cause) => StaticError::NotConverged { factor, cause, path },
            Refused::Jump(what) => StaticError::Jump { factor, what, path },
            Refused::Limit(message) => StaticError::ElementLimit { factor, message, path },
        }
    }

    /// One step of the load; on failure everything is as before.
    fn step_to(&mut self, factor: f64) -> Result<Equilibrium, Refused> {
        let before = std::mem::replace(&mut self.work.t, factor);
        let outcome = if self.neutral {
            let bounds = self.bounds;
            self.relax(&bounds)
        } else {
            self.correct().and_then(|report| self.accept(&report))
        };
        if outcome.is_err() {
            self.work.t = before;
        }
        outcome
    }

    /// Newton's method from the last equilibrium; refuses jumps.
    pub(crate) fn correct(&mut self) -> Result<NewtonReport, Refused> {
        let d = self.work.unknowns();
        self.x[..d].fill(0.0);
        self.x[d..].copy_from_slice(&self.mu);
        let mut problem = Problem::of(&self.blocks, &mut self.work);
        let solved = self.newton.solve(&mut problem, &mut self.x);
        let forecast = problem.into_forecast();
        let report = solved.map_err(Refused::Newton)?;
        self.refuse_jump(&self.bounds)?;
        self.compare(&forecast)?;
        Ok(report)
    }

    /// Refuses increments much larger than the tangent at the last equilibrium says, or against it.
    fn compare(&self, forecast: &[f64]) -> Result<(), Refused> {
        let norm = |x: &[f64]| self.work.product(x, x).sqrt();
        let (found, foreseen) = (norm(&self.x), norm(forecast));
        if found <= 1e-6 * self.work.size() || self.bounds.excess.is_infinite() {
            return Ok(());
        }
        if found > self.bounds.excess * foreseen {
            let times = found / foreseen;
            let what = format!("it moves {times:.1} times as far as the tangent stiffness says");
            return Err(Refused::Jump(what));
        }
        if self.work.product(&self.x, forecast) < 0.0 {
            let what = "it moves against what the tangent stiffness says".into();
            return Err(Refused::Jump(what));
        }
        Ok(())
    }

    pub(crate) fn refuse_jump(&self, bounds: &StepBounds) -> Result<(), Refused> {
        let s = &self.work.s;
        for (element, nodes) in self.pairs.iter().enumerate() {
            let turn = angle_between(*nodes, &s.q1) - angle_between(*nodes, &s.q0);
            if turn.abs() > bounds.turn {
                let what = format!("element {element} bends by {turn:.3} rad at once");
                return Err(Refused::Jump(what));
            }
        }
        let description = self.work.mechanism.description();
        let farthest = bounds.travel * self.work.size();
        for (k, body) in description.bodies.iter().enumerate() {
            let (before, after) = (&s.q0[12 * k..12 * k + 12], &s.q1[12 * k..12 * k + 12]);
            let way = (directors::center(after) - directors::center(before)).norm();
            let turn = directors::triad(after) - directors::triad(before);
            let turn = 2.0 * (turn.norm() / 8.0_f64.sqrt()).min(1.0).asin();
            let turns = !self.elastic[k] && turn > bounds.rotation;
            if way > farthest || turns {
                let name = &body.name;
                let what = format!("`{name}` moves by {way:.3} m and {turn:.3} rad at once");
                return Err(Refused::Jump(what));
            }
        }
        for (k, particle) in description.particles.iter().enumerate() {
            let at = self.work.mechanism.particle_offset(k);
            let own = at..at + description.dimension;
            let way =
                Vector3::from_fn(|i, _| own.clone().nth(i).map_or(0.0, |j| s.q1[j] - s.q0[j]));
            if way.norm() > farthest {
                let (name, way) = (&particle.name, way.norm());
                return Err(Refused::Jump(format!("`{name}` moves by {way:.3} m at once")));
            }
        }
        Ok(())
    }

    /// Takes the configuration last evaluated as the new equilibrium, unless an element has folded.
    pub(crate) fn accept(&mut self, report: &NewtonReport) -> Result<Equilibrium, Refused> {
        self.check_limit()?;
        let d = self.work.unknowns();
        self.mu.copy_from_slice(&self.x[d..]);
        self.move_on();
        Ok(self.here(report.iterations, report.residual))
    }

    /// Moves to the configuration last evaluated.
    pub(crate) fn move_on(&mut self) {
        self.work.advance();
        if self.work.renew_rows() && self.work.balance(&mut self.x).is_ok() {
            self.mu.copy_from_slice(&self.x[self.work.unknowns()..]);
        }
    }

    /// Refuses folded elements in the configuration last evaluated.
    pub(crate) fn check_limit(&self) -> Result<(), Refused> {
        let limit = LimitReport::of_pairs(self.pairs.iter().copied(), &self.work.s.q1);
        if limit.is_exceeded() {
            return Err(Refused::Limit(limit.message().unwrap_or_default()));
        }
        Ok(())
    }

    /// The last equilibrium.
    pub(crate) fn here(&self, iterations: usize, residual: f64) -> Equilibrium {
        let work = &self.work;
        let q = work.s.q0.clone();
        let mut multipliers = vec![0.0; work.mechanism.len()];
        work.rows.scatter(&self.mu, &mut multipliers);
        let mut g = vec![0.0; multipliers.len()];
        let at = Configuration { t: work.t, ..work.s.start() };
        work.mechanism.value(at, &mut g);
        Equilibrium {
            factor: work.t,
            multipliers,
            potential_energy: work.system.potential_energy(at),
            iterations,
            residual,
            position_residual: norm_inf(&g),
            limit: LimitReport::of_pairs(self.pairs.iter().copied(), &q),
            q,
        }
    }
}
