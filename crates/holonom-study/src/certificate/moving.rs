//! From when on a model moves: of a system at rest every property holds, and nothing follows from
//! that.

use super::subject::{ModelSubject, MovingNode};
use holonom_model::Model;
use vi_core::linear::norm_inf;
use vi_verify::subject::{SchemeSetting, SteppingMethod, Subject};

/// Displacements up to this, relative to the largest coordinate, are round-off.
const AT_REST: f64 = 1e-12;
/// A model rests while its steps are shorter than this part of the longest one of the run.
const MOVING: f64 = 1e-6;
/// Rest over so many steps, fewer than any measurement takes, makes no difference.
const BRIEF: usize = 12;
/// Steps that are looked at, at most.
const STEPS: u64 = 20_000;

/// What a model does at first.
pub(super) enum FirstMotion {
    /// Nothing moves.
    Rest,
    /// It moves from its initial values on, or cannot be stepped.
    Motion,
    /// It rests up to a node at which it has begun to move.
    Later(MovingNode),
}

/// What a model does at first.
///
/// # Errors
/// Why the method does not apply, in words.
pub(super) fn beginning(
    subject: &ModelSubject,
    model: &Model,
    method: SteppingMethod,
) -> Result<FirstMotion, String> {
    let setting = SchemeSetting::new(method, 2, model.settings.step);
    let steps = model.settings.steps().clamp(4, STEPS);
    let lengths = lengths(subject, setting, steps)?;
    let longest = norm_inf(&lengths);
    if longest <= AT_REST {
        let all = lengths.len() as u64 == steps;
        return Ok(if all { FirstMotion::Rest } else { FirstMotion::Motion });
    }
    let begun = lengths.iter().position(|length| *length >= MOVING * longest).unwrap_or(0);
    if begun <= BRIEF {
        return Ok(FirstMotion::Motion);
    }
    let mut motion = subject.start(setting)?;
    (0..begun).try_for_each(|_| motion.step())?;
    let v = motion.velocity()?;
    let (q, v) = motion.consistent(motion.q(), &v)?;
    Ok(FirstMotion::Later(MovingNode { t: motion.time(), q, v }))
}

/// `|q_{n+1} − q_n|` over the largest coordinate, of the steps up to one that fails.
fn lengths(subject: &ModelSubject, setting: SchemeSetting, steps: u64) -> Result<Vec<f64>, String> {
    let mut motion = subject.start(setting)?;
    let mut q = motion.q().to_vec();
    let mut lengths = Vec::new();
    for _ in 0..steps {
        if motion.step().is_err() {
            break;
        }
        let off: Vec<f64> = q.iter().zip(motion.q()).map(|(a, b)| b - a).collect();
        lengths.push(norm_inf(&off) / norm_inf(motion.q()).max(1.0));
        q.copy_from_slice(motion.q());
    }
    Ok(lengths)
}
