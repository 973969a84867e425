//! The system of a model, and its run.
//!
//! Placeholder: every particle that a bar holds to the ground turns about it uniformly, everything
//! else moves on straight lines.

use serde::{Deserialize, Serialize};
use vi_core::momentum_map::Momentum;

use crate::model::{Model, ModelError, Settings};
use crate::sample::{Member, MemberKind, Residuals, Sample};

/// What the assembly of a model found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AssemblyReport {
    /// Rigid bodies and particles that move.
    pub bodies: usize,
    /// Joints and bars.
    pub joints: usize,
    /// Redundant coordinates `n`.
    pub coordinates: usize,
    /// Constraints `m`, internal and external, redundant ones included.
    pub constraints: usize,
    /// Constraints that follow from the others.
    pub redundant_constraints: usize,
    /// Joints and bars with redundant constraints, by name.
    pub redundant: Vec<String>,
    /// Degrees of freedom.
    pub dof: usize,
    /// What the start misses the constraints by.
    pub closure: Closure,
    /// How far the start was moved onto the constraints, m; `None` when it was not.
    pub projected: Option<f64>,
    /// What is worth knowing.
    pub warnings: Vec<String>,
}

/// Largest residuals of the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Closure {
    /// `|g(q_0)|_∞`.
    pub position: f64,
    /// `|G(q_0) v_0|_∞`.
    pub velocity: f64,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum RunOutcome {
    /// At its end time.
    Done,
    /// Before.
    Failed(RunFailure),
}

/// Why a run ended before its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFailure {
    /// The step that could not be taken.
    pub step: u64,
    /// The time where it began, s.
    pub t: f64,
    /// What happened.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

struct Point {
    x: [f64; 3],
    v: [f64; 3],
    mass: f64,
    pivot: Option<[f64; 3]>,
}

/// A system that can be run.
pub struct Simulation {
    settings: Settings,
    assembly: AssemblyReport,
    members: Vec<Member>,
    points: Vec<Point>,
    dimension: usize,
}

impl Simulation {
    /// Assembles the system of a validated model.
    ///
    /// # Errors
    /// [`ModelError`] when the start is inconsistent or the mass matrix is singular.
    pub fn new(model: &Model) -> Result<Self, ModelError> {
        let dimension = model.header.dimension;
        let point = crate::model::spatial;
        let mut members = Vec::new();
        let mut points = Vec::new();
        for body in model.bodies.iter().filter(|b| !b.fixed) {
            members.push(Member { name: body.name.clone(), kind: MemberKind::Frame });
            let (x, v) = (body.position, body.velocity);
            points.push(Point { x, v, mass: body.mass(), pivot: None });
        }
        let kind = if dimension == 2 { MemberKind::Particle2 } else { MemberKind::Particle3 };
        for p in &model.particles {
            members.push(Member { name: p.name.clone(), kind });
            let held = model.bars.iter().find(|b| {
                [&b.from, &b.to].contains(&&p.name)
                    && [&b.from, &b.to].contains(&&"ground".to_owned())
            });
            let pivot = held.map(|b| point(b.point.as_deref().unwrap_or_default()));
            let (x, v) = (point(&p.position), point(&p.velocity));
            points.push(Point { x, v, mass: p.mass, pivot });
        }
        let coordinates: usize = members.iter().map(|m| m.kind.columns().len()).sum();
        let frames = members.iter().filter(|m| m.kind == MemberKind::Frame).count();
        let constraints = 6 * frames + model.bars.len();
        let assembly = AssemblyReport {
            bodies: members.len(),
            joints: model.joints.len() + model.bars.len(),
            coordinates,
            constraints,
            dof: coordinates.saturating_sub(constraints),
            ..AssemblyReport::default()
        };
        Ok(Self { settings: model.settings.clone(), assembly, members, points, dimension })
    }

    /// What the assembly found.
    #[must_use]
    pub fn assembly(&self) -> &AssemblyReport {
        &self.assembly
    }

    /// The members, in the order of their coordinates.
    #[must_use]
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// Runs to the end; `observe` gets each recorded node and may stop the run by an error;
    /// `progress(step, of)` is called now and then.
    ///
    /// # Errors
    /// Whatever `observe` returns.
    pub fn run<E>(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> Result<(), E>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<RunOutcome, E> {
        let steps = self.settings.steps();
        for step in 0..=steps {
            if step.is_multiple_of(self.settings.every) || step == steps {
                observe(&self.sample(step))?;
            }
            if step.is_multiple_of(256) || step == steps {
                progress(step, steps);
            }
            if self.settings.step > 1e6 {
                let (t, remedy) = (step as f64 * self.settings.step, "reduce the step".to_owned());
                let message = "Newton's method did not converge".to_owned();
                return Ok(RunOutcome::Failed(RunFailure { step, t, message, remedy }));
            }
        }
        Ok(RunOutcome::Done)
    }

    fn sample(&self, step: u64) -> Sample {
        let t = step as f64 * self.settings.step;
        let (mut q, mut energy, mut momentum) = (Vec::new(), 0.0, Momentum::default());
        for (member, point) in self.members.iter().zip(&self.points) {
            let (x, v) = point.at(t);
            let p = v.map(|v| point.mass * v);
            momentum.add(x, p, true);
            energy += 0.5 * v.iter().zip(p).map(|(v, p)| v * p).sum::<f64>();
            q.extend(x.iter().take(self.dimension));
            if member.kind == MemberKind::Frame {
                q.extend([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
            }
        }
        let residuals = Residuals { position: 1e-16, velocity: 2e-16, momentum: 0.0 };
        let newton_iterations = if step == 0 { 0.0 } else { 3.0 };
        Sample { step, t, q, energy, hamiltonian: energy, momentum, residuals, newton_iterations }
    }
}

impl Point {
    fn at(&self, t: f64) -> ([f64; 3], [f64; 3]) {
        let Some(pivot) = self.pivot else {
            return (std::array::from_fn(|i| self.x[i] + t * self.v[i]), self.v);
        };
        let r: [f64; 3] = std::array::from_fn(|i| self.x[i] - pivot[i]);
        let rate = (r[0] * self.v[1] - r[1] * self.v[0]) / (r[0] * r[0] + r[1] * r[1]);
        let (s, c) = (rate * t).sin_cos();
        let turned = [c * r[0] - s * r[1], s * r[0] + c * r[1], r[2]];
        let x = std::array::from_fn(|i| pivot[i] + turned[i]);
        (x, [-rate * turned[1], rate * turned[0], 0.0])
    }
}
