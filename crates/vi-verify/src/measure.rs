//! Measurements beside convergence: conserved quantities, reversal, symplecticity, conditioning,
//! agreement.

use super::fit::{of_tenths, power_law};
use super::subject::{Invariants, Nature, SchemeSetting, SteppingMethod, Subject};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use vi_core::Composition;
use vi_core::linear::norm_inf;
use vi_core::shadow_energy;

/// Samples of a long run.
const SAMPLES: u64 = 4096;

/// A run with its energies, momenta and residuals.
#[derive(Clone, Debug)]
pub struct LongRun {
    /// Order of the method.
    pub order: u32,
    /// `h`, s.
    pub step: f64,
    /// Steps taken.
    pub steps: u64,
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// The samples.
    pub samples: Vec<Invariants>,
    /// What holds at all nodes that were looked at.
    pub nature: Nature,
    /// The fastest motion at the beginning or the end, rad/s; `None` where it is not known.
    pub frequency: Option<f64>,
    /// The first sample of the last map: internal variables stay as they are from there on.
    pub since: usize,
}

/// Steps from one sample to the next.
fn every(steps: u64) -> u64 {
    (steps / SAMPLES).max(1)
}

/// Takes `steps` steps and samples them evenly.
///
/// # Errors
/// Why the method does not apply or a step failed, in words.
pub fn long_run(
    subject: &dyn Subject,
    setting: SchemeSetting,
    steps: u64,
) -> Result<LongRun, String> {
    let mut motion = subject.start(setting)?;
    let every = every(steps);
    let mut nature = motion.nature()?;
    let frequency = motion.frequency()?;
    let (mut times, mut samples) = (Vec::new(), Vec::new());
    let (mut internal, mut since) = (motion.internal().to_vec(), 0);
    for step in 0..steps {
        motion.step().map_err(|error| format!("step {step}: {error}"))?;
        if step.is_multiple_of(every) {
            times.push(step as f64 * setting.step);
            samples.push(motion.invariants()?);
        }
        if internal != motion.internal() {
            internal.copy_from_slice(motion.internal());
            since = samples.len();
        }
        if step.is_multiple_of((steps / 8).max(1)) {
            let here = motion.nature()?;
            nature.conservative &= here.conservative;
            nature.forced |= here.forced;
            for (symmetry, here) in nature.symmetries.iter_mut().zip(here.symmetries) {
                *symmetry &= here;
            }
        }
    }
    let last = motion.frequency()?;
    let frequency = frequency.zip(last).map(|(a, b)| a.max(b));
    Ok(LongRun {
        order: setting.order,
        step: setting.step,
        steps,
        times,
        samples,
        nature,
        frequency,
        since,
    })
}

impl LongRun {
    /// The part of it that is made of steps of one map, from `since` on.
    #[must_use]
    pub fn of_last_map(&self) -> Self {
        let own = self.since..;
        let (times, samples) = (self.times[own.clone()].to_vec(), self.samples[own].to_vec());
        let steps = self.steps - (self.since as u64 * every(self.steps)).min(self.steps);
        Self { times, samples, steps, since: 0, ..*self }
    }

    /// Energies of all samples, J.
    #[must_use]
    pub fn energies(&self) -> Vec<f64> {
        self.samples.iter().map(|node| node.energy).collect()
    }

    /// Shadow energies of all samples, J.
    #[must_use]
    pub fn shadow_energies(&self) -> Vec<f64> {
        let shadow =
            |node: &Invariants| shadow_energy(self.order, node.energy, node.discrete_energy);
        self.samples.iter().map(shadow).collect()
    }

    /// The size of what the energy is made of, J.
    #[must_use]
    pub fn energy_size(&self) -> f64 {
        norm_inf(&self.samples.iter().map(|node| node.energy_size).collect::<Vec<f64>>())
    }

    /// A component of the momentum maps (`P` first, then `L`) over the largest sum of terms of any
    /// component of the same vector: round-off grows with what is summed, and in axes that are
    /// turned every component is summed of all.
    #[must_use]
    pub fn momentum(&self, component: usize) -> Vec<f64> {
        let read = |m: &vi_core::momentum_map::Momentum| match component {
            0..3 => m.linear[component],
            _ => m.angular[component - 3],
        };
        let sizes = self.samples.iter().flat_map(|node| match component {
            0..3 => node.momentum_size.linear,
            _ => node.momentum_size.angular,
        });
        let largest = sizes.fold(0.0, f64::max);
        let scale = if largest > 0.0 { largest } else { 1.0 };
        self.samples.iter().map(|node| read(&node.momentum) / scale).collect()
    }

    /// Largest residuals at positions and momenta; at momenta where (46) is defined.
    #[must_use]
    pub fn residuals(&self) -> ConstraintResiduals {
        let largest = |of: fn(&Invariants) -> f64| {
            norm_inf(&self.samples.iter().map(of).collect::<Vec<f64>>())
        };
        let levels: Option<Vec<f64>> =
            self.samples.iter().map(|node| node.momentum_level).collect();
        ConstraintResiduals {
            position: largest(|node| node.position),
            momentum: levels.as_ref().map(|levels| norm_inf(levels)),
            momentum_of_most: levels.and_then(|levels| of_tenths(levels, 9)),
        }
    }

    /// `h ω_max`, with the longest sub-step of a composition.
    #[must_use]
    pub fn resolution(&self) -> Option<f64> {
        let longest = Composition::of_order(self.order).unwrap_or_default().longest();
        Some(self.step.abs() * longest * self.frequency?)
    }

    /// The largest change of the shadow energy from one sample to the next, J, and their times, s;
    /// `None` with fewer than two samples.
    #[must_use]
    pub fn largest_jump(&self) -> Option<(f64, Range<f64>)> {
        let shadow = self.shadow_energies();
        let jump = |k: usize| (shadow[k] - shadow[k - 1]).abs();
        let k = (1..shadow.len()).max_by(|&a, &b| jump(a).total_cmp(&jump(b)))?;
        Some((jump(k), self.times[k - 1]..self.times[k]))
    }

    /// Largest coordinate.
    #[must_use]
    pub fn size(&self) -> f64 {
        norm_inf(&self.samples.iter().map(|node| node.size).collect::<Vec<f64>>())
    }
}

/// Largest residuals of the constraints at positions and momenta.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstraintResiduals {
    /// `|g(q_n)|`.
    pub position: f64,
    /// (46), where it is defined.
    pub momentum: Option<f64>,
    /// What (46) stays below at nine of ten samples: a force that jumps is seen at the nodes beside
    /// the jump alone.
    pub momentum_of_most: Option<f64>,
}

/// Forward and back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reversal {
    /// Steps each way.
    pub steps: u64,
    /// `|q − q_0|_∞` in the end.
    pub error: f64,
    /// Largest growth of a small error during the motion, by tangent vectors; `None` where they are
    /// not available.
    pub amplification: Option<f64>,
}

/// Takes `steps` steps forward and as many back.
///
/// # Errors
/// As [`long_run`].
pub fn reversal(
    subject: &dyn Subject,
    setting: SchemeSetting,
    steps: u64,
) -> Result<Reversal, String> {
    let mut motion = subject.start(setting)?;
    let start = motion.q().to_vec();
    (0..steps).try_for_each(|_| motion.step())?;
    motion.reverse();
    (0..steps).try_for_each(|_| motion.step())?;
    let off: Vec<f64> = start.iter().zip(motion.q()).map(|(a, b)| a - b).collect();
    let amplification = amplification(subject, setting, steps);
    Ok(Reversal { steps, error: norm_inf(&off), amplification })
}

/// Growth of the largest of a few tangent vectors in `q` over a run; `None` with forces.
#[must_use]
pub fn amplification(subject: &dyn Subject, setting: SchemeSetting, steps: u64) -> Option<f64> {
    let mut motion = subject.start(setting).ok()?;
    let mut tangents = motion.tangents();
    let (count, mut largest) = (tangents.dq.ncols() / 2, 1.0_f64);
    if count == 0 {
        return Some(1.0);
    }
    // displacements only, at most four: one of them is likely to see the fastest growth
    tangents.dq = tangents.dq.columns(0, count.min(4)).into_owned();
    tangents.dp = tangents.dp.columns(0, count.min(4)).into_owned();
    for _ in 0..steps {
        motion.step_tangents(&mut tangents).ok()?;
        largest = largest.max(norm_inf(tangents.dq.as_slice()));
    }
    largest.is_finite().then_some(largest)
}

/// Condition numbers of the Newton matrix at shrinking steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Conditioning {
    /// `h`, `κ` as written, `κ` of the matrix that is factorized.
    pub numbers: Vec<(f64, f64, f64)>,
    /// `a` of `κ ~ h^a`, as written.
    pub as_written: f64,
    /// The same of the matrix that is factorized.
    pub scaled: f64,
}

/// `κ` at `h`, `h/2`, `h/4`, `h/8`.
///
/// # Errors
/// As [`long_run`]; matrix-free operators have no condition number.
pub fn conditioning(subject: &dyn Subject, setting: SchemeSetting) -> Result<Conditioning, String> {
    let mut numbers = Vec::new();
    for k in 0..4 {
        let step = setting.step / 2_f64.powi(k);
        let mut motion = subject.start(SchemeSetting { step, dense: true, ..setting })?;
        (0..3).try_for_each(|_| motion.step())?;
        let condition = motion.condition().ok_or("its operators form no matrix")?;
        numbers.push((step, condition.as_written, condition.scaled));
    }
    let law = |read: fn(&(f64, f64, f64)) -> f64| {
        let law = power_law(numbers.iter().map(|n| [n.0, read(n)]));
        law.map(|law| law.exponent).ok_or("a condition number is not finite")
    };
    let (as_written, scaled) = (law(|n| n.1)?, law(|n| n.2)?);
    Ok(Conditioning { numbers, as_written, scaled })
}

/// Largest distance `|q_n − q_n'|_∞` of two methods along a run.
///
/// # Errors
/// As [`long_run`].
pub fn distance(
    subject: &dyn Subject,
    settings: [SchemeSetting; 2],
    steps: u64,
) -> Result<f64, String> {
    let [mut one, mut other] = [subject.start(settings[0])?, subject.start(settings[1])?];
    let mut largest = 0.0;
    for _ in 0..steps {
        one.step()?;
        other.step()?;
        let off: Vec<f64> = one.q().iter().zip(other.q()).map(|(a, b)| a - b).collect();
        largest = norm_inf(&[largest, norm_inf(&off)]);
    }
    Ok(largest)
}

/// The methods of a subject that apply, with a step.
#[must_use]
pub fn applicable(subject: &dyn Subject, of: &[SteppingMethod], step: f64) -> Vec<SteppingMethod> {
    let applies =
        |method: &&SteppingMethod| subject.start(SchemeSetting::new(**method, 2, step)).is_ok();
    of.iter().filter(applies).copied().collect()
}
