//! From when on a model moves: of a system at rest every property holds, and nothing follows from that.

use super::subject::ModelSubject;
use holonom_model::Model;
use vi_core::linear::norm_inf;
use vi_verify::subject::{Method, Motion, Setting, Subject};

/// Displacements up to this, relative to the largest coordinate, are round-off.
const AT_REST: f64 = 1e-12;
/// A model rests while its steps are shorter than this part of the longest one of the run.
const MOVING: f64 = 1e-6;
/// Rest over so many steps, fewer than any measurement takes, makes no difference.
const BRIEF: usize = 12;
/// Steps that are looked at, at most.
const STEPS: u64 = 20_000;

/// A node at which a model moves.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Start {
    /// Its time, s.
    pub t: f64,
    /// `q`.
    pub q: Vec<f64>,
    /// The velocity there, which meets the constraints.
    pub v: Vec<f64>,
}

/// The node that measurements start from: the initial one, or where the model rests at first the one at which it has begun to
/// move. `None` where nothing moves.
pub(super) fn start(subject: &ModelSubject, model: &Model, method: Method) -> Option<Start> {
    let setting = Setting::new(method, 2, model.settings.step);
    let lengths = lengths(subject, setting, model.settings.steps().clamp(4, STEPS))?;
    let longest = norm_inf(&lengths);
    if longest <= AT_REST {
        return None;
    }
    let begun = lengths.iter().position(|length| *length >= MOVING * longest).unwrap_or(0);
    let mut motion = subject.start(setting).ok()?;
    for _ in 0..if begun > BRIEF { begun } else { 0 } {
        motion.step().ok()?;
    }
    let v = motion.velocity().ok()?;
    let (q, v) = motion.consistent(motion.q(), &v).ok()?;
    Some(Start { t: motion.time(), q, v })
}

/// `|q_{n+1} − q_n|` over the largest coordinate, of the steps that succeed. Not a number nowhere.
fn lengths(subject: &ModelSubject, setting: Setting, steps: u64) -> Option<Vec<f64>> {
    let mut motion = subject.start(setting).ok()?;
    let mut q = motion.q().to_vec();
    let mut lengths = Vec::new();
    for _ in 0..steps {
        if motion.step().is_err() {
            break;
        }
        lengths.push(length(&q, &*motion));
        q.copy_from_slice(motion.q());
    }
    Some(lengths)
}

fn length(before: &[f64], motion: &dyn Motion) -> f64 {
    let off: Vec<f64> = before.iter().zip(motion.q()).map(|(a, b)| b - a).collect();
    norm_inf(&off) / norm_inf(motion.q()).max(1.0)
}
