//! Integrators that step rightly and report wrongly.

use holonom::verification::equations::Equations;
use holonom::verification::subject::{Invariants, Nature, NodeValues, RunningMotion};
use holonom::vi_constraints::scheme::ConditionNumbers;
use holonom::vi_constraints::tangent_map::Tangents;

/// What is reported wrongly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OutputDefect {
    /// `λ` of (36), or the mean of two energy–momentum steps, times a factor.
    Multiplier(f64),
    /// `λ_0` of (47), or that of the first energy–momentum step, times a factor.
    StartMultiplier(f64),
    /// `p_n` of (34) times a factor.
    ConstrainedMomentum(f64),
    /// The projected momentum, or `M v`, times a factor.
    Momentum(f64),
    /// `λ` of the acceleration level, or of a single energy–momentum step, times a factor.
    OtherMultiplier(f64),
    /// The moments of all joints times a factor.
    Moments(f64),
    /// The forces of all joints times a factor.
    Forces(f64),
    /// `H_d` without a part of it.
    Energy(f64),
    /// `H_d` and `E_d` with a rate, J/s, relative to their size.
    EnergyRate(f64),
    /// `E_d` without a part of it.
    DiscreteEnergy(f64),
    /// Momentum maps times a factor.
    MomentumMaps(f64),
    /// A momentum map (`Px` … `Lz`) with a rate, relative to its size.
    MomentumRate(usize, f64),
    /// `|g|` with something added.
    Residual(f64),
    /// (46) with a part of first order in `h`.
    MomentumLevel(f64),
    /// The momentum `p̄` grows by a part of itself in every step.
    PhaseSpace(f64),
    /// Condition numbers times a power of `h`.
    Condition(i32),
}

/// A motion with an [`OutputDefect`].
pub(super) struct Misreporting {
    pub(super) inner: Box<dyn RunningMotion>,
    pub(super) defect: OutputDefect,
    pub(super) h: f64,
    pub(super) steps: u64,
}

fn scale(values: Option<&mut Vec<f64>>, factor: f64) {
    values.into_iter().flatten().for_each(|x| *x *= factor);
}

/// A momentum map that is zero has the size 1.
fn size(of: f64) -> f64 {
    if of > 0.0 { of } else { 1.0 }
}

impl RunningMotion for Misreporting {
    fn step(&mut self) -> Result<(), String> {
        self.steps += 1;
        self.inner.step()
    }
    fn reverse(&mut self) {
        self.inner.reverse();
    }
    fn q(&self) -> &[f64] {
        self.inner.q()
    }
    fn time(&self) -> f64 {
        self.inner.time()
    }
    fn internal(&self) -> &[f64] {
        self.inner.internal()
    }
    fn p(&self) -> Vec<f64> {
        let mut p = self.inner.p();
        if let OutputDefect::PhaseSpace(part) = self.defect {
            p.iter_mut().for_each(|p| *p *= 1.0 + part * self.steps as f64);
        }
        p
    }
    fn velocity(&mut self) -> Result<Vec<f64>, String> {
        self.inner.velocity()
    }
    fn consistent(&self, q: &[f64], v: &[f64]) -> Result<(Vec<f64>, Vec<f64>), String> {
        self.inner.consistent(q, v)
    }
    fn frequency(&mut self) -> Result<Option<f64>, String> {
        self.inner.frequency()
    }
    fn equations(&self) -> Box<dyn Equations + '_> {
        self.inner.equations()
    }
    fn values(&mut self) -> Result<NodeValues, String> {
        let mut values = self.inner.values()?;
        let start = self.steps == 0;
        match self.defect {
            OutputDefect::Multiplier(k) if !start => scale(values.lambda.as_mut(), k),
            OutputDefect::StartMultiplier(k) if start => scale(values.lambda.as_mut(), k),
            OutputDefect::ConstrainedMomentum(k) => scale(values.p_constrained.as_mut(), k),
            OutputDefect::Momentum(k) => scale(Some(&mut values.p), k),
            OutputDefect::OtherMultiplier(k) => scale(values.lambda_other.as_mut(), k),
            OutputDefect::Moments(k) => {
                let joints = values.reactions.iter_mut().flat_map(|r| &mut r.joints);
                joints.flat_map(|wrench| &mut wrench[3..]).for_each(|m| *m *= k);
            }
            OutputDefect::Forces(k) => {
                let joints = values.reactions.iter_mut().flat_map(|r| &mut r.joints);
                joints.flat_map(|wrench| &mut wrench[..3]).for_each(|f| *f *= k);
            }
            _ => {}
        }
        Ok(values)
    }
    fn invariants(&mut self) -> Result<Invariants, String> {
        let mut reported = self.inner.invariants()?;
        let t = self.h * self.steps as f64;
        match self.defect {
            OutputDefect::Energy(part) => reported.energy -= part * reported.energy_size,
            OutputDefect::DiscreteEnergy(part) => {
                reported.discrete_energy -= part * reported.energy_size
            }
            OutputDefect::EnergyRate(rate) => {
                reported.energy += rate * t * reported.energy_size;
                reported.discrete_energy += rate * t * reported.energy_size;
            }
            OutputDefect::MomentumMaps(k) => {
                let maps =
                    reported.momentum.linear.iter_mut().chain(&mut reported.momentum.angular);
                maps.for_each(|x| *x *= k);
            }
            OutputDefect::MomentumRate(k, rate) if k < 3 => {
                reported.momentum.linear[k] += rate * t * size(reported.momentum_size.linear[k]);
            }
            OutputDefect::MomentumRate(k, rate) => {
                reported.momentum.angular[k - 3] +=
                    rate * t * size(reported.momentum_size.angular[k - 3]);
            }
            OutputDefect::Residual(by) => reported.position += by,
            OutputDefect::MomentumLevel(by) => {
                reported.momentum_level =
                    reported.momentum_level.map(|level| level + by * self.h.abs());
            }
            _ => {}
        }
        Ok(reported)
    }
    fn nature(&mut self) -> Result<Nature, String> {
        self.inner.nature()
    }
    fn condition(&mut self) -> Option<ConditionNumbers> {
        let mut condition = self.inner.condition()?;
        if let OutputDefect::Condition(power) = self.defect {
            condition.as_written *= self.h.abs().powi(power);
            condition.scaled *= self.h.abs().powi(power);
        }
        Some(condition)
    }
    fn tangents(&mut self) -> Tangents {
        self.inner.tangents()
    }
    fn step_tangents(&mut self, tangents: &mut Tangents) -> Result<(), String> {
        self.steps += 1;
        self.inner.step_tangents(tangents)
    }
}
