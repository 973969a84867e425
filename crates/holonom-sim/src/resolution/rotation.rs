//! How far bodies turn in a step: the phase error of it, before a run and along it.
//!
//! ```text
//! ω² = ½ Σ_I |ḋ_I|²  of a body,   the least among the nodes of a beam,   |v_B − v_A|/l  of a bar between point masses
//! ```
//! with the velocity of the projected momentum. What a step makes of `hω`: [`super::rotor`].
//! Prescribed motions are followed exactly: a body that they turn is judged at the start by what it
//! turns beside them, and not along the run.

use super::rotor;
use crate::digits::rounded;
use crate::run::outcome::twelve_digits;
use crate::system::beams::Beams;
use holonom_model::{Model, Settings};
use serde::{Deserialize, Serialize};
use vi_multibody::mechanism::{BarEnd, Mechanism};

/// Angle of a step from which its phase error is worth a word, rad.
const NOTABLE: f64 = 0.1;
/// Phase error from which it is.
const ERROR: f64 = 1e-3;
/// Part of the largest angle of a step, beyond which a step that fails may fail for it.
const NEAR: f64 = 0.8;
/// A rate that prescribed motions give a body, relative to the largest one.
const DRIVEN: f64 = 1e-9;

/// The fastest rotation against the step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FastestRotation {
    /// What turns: a body, a beam or a bar.
    pub member: String,
    /// When, s.
    pub t: f64,
    /// Its rate `ω`, rad/s.
    pub rate: f64,
    /// The angle of a step `hω`, rad.
    pub angle: f64,
    /// `θ/(hω) − 1`, `θ` the angle by which a step turns a free rotor of this rate; `None` where no
    /// step does.
    pub phase_error: Option<f64>,
}

impl FastestRotation {
    fn new(member: &str, t: f64, rate: f64, settings: &Settings) -> Self {
        let angle = rate * settings.step;
        let phase_error = rotor::phase_error(settings, angle);
        Self { member: member.to_owned(), t, rate, angle, phase_error }
    }

    /// Whether the phase error is worth a word.
    #[must_use]
    pub fn is_notable(&self) -> bool {
        self.angle >= NOTABLE && self.phase_error.is_none_or(|error| error.abs() >= ERROR)
    }

    /// The warning, with what cures it; `impulses`: contacts, stops or dry friction act, which keep
    /// the order at 2.
    pub(crate) fn warning(&self, settings: &Settings, impulses: bool) -> Option<String> {
        let Self { member, t, rate, angle, phase_error } = self;
        if !self.is_notable() {
            return None;
        }
        let when =
            if *t == 0.0 { String::new() } else { format!(" at t = {} s", twelve_digits(*t)) };
        let what = format!(
            "`{member}` turns by {angle:.3} rad in a step{when} ({} rad/s)",
            rounded(*rate, 4)
        );
        let order = settings.order;
        let step = rotor::step_of_error(settings, *rate, ERROR);
        let step = format!("a step below {step:.1e} s");
        let cure = match rotor::cure(settings, *angle).filter(|_| !impulses) {
            Some((order, error)) => {
                format!("write order = {order} (an error of {error:.0e}), or {step}")
            }
            None => format!("write {step}"),
        };
        Some(match phase_error {
            Some(error) => {
                let more = if *error > 0.0 { "more" } else { "less" };
                let percent = 100.0 * error.abs();
                format!(
                    "{what}: of a free rotation a step of order {order} makes {percent:.2} % {more} than that, an error of the \
                     phase that adds up; {cure} (0.1 %)"
                )
            }
            None => {
                let largest = words_of_angle(rotor::largest_angle(settings));
                format!(
                    "{what}: a step of order {order} can turn a free body by less than {largest}; {cure} (0.1 %)"
                )
            }
        })
    }

    /// What to do where a step fails, if it is for this rotation, and a step (s) that does not.
    pub(crate) fn remedy(&self, settings: &Settings) -> Option<(String, f64)> {
        let Self { member, rate, angle, .. } = self;
        if *angle < NOTABLE {
            return None;
        }
        let largest = rotor::largest_angle(settings);
        if *angle < NEAR * largest {
            return None;
        }
        let (order, step) = (settings.order, rotor::ROUNDED * largest / rate);
        let words = format!(
            "a step of order {order} can turn a free body by less than {}, and `{member}` turns by {angle:.3} rad ({} rad/s): \
             write a step below {step:.1e} s, better below {:.1e} s, where the error of the phase is 0.1 %",
            words_of_angle(largest),
            rounded(*rate, 4),
            rotor::step_of_error(settings, *rate, ERROR)
        );
        Some((words, step))
    }
}

/// The largest angle of a step.
fn words_of_angle(angle: f64) -> String {
    if angle > 3.0 { "half a turn".to_owned() } else { format!("{angle:.3} rad") }
}

/// What turns, and where its velocities are.
#[derive(Clone, Debug)]
enum TurningPart {
    /// A frame.
    Body(usize),
    /// The nodes of a beam.
    Beam(std::ops::Range<usize>),
    /// A bar between point masses, or to the ground: first coordinates, their number, length (m).
    Bar([Option<usize>; 2], usize, f64),
}

impl TurningPart {
    /// Its rate with the velocity `v`, rad/s.
    fn rate(&self, v: &[f64]) -> f64 {
        match self {
            Self::Body(frame) => frame_rate(*frame, v),
            Self::Beam(nodes) => {
                nodes.clone().map(|frame| frame_rate(frame, v)).fold(f64::INFINITY, f64::min)
            }
            Self::Bar(ends, d, length) => {
                let at = |end: Option<usize>, i: usize| end.map_or(0.0, |first| v[first + i]);
                let squares = (0..*d).map(|i| (at(ends[1], i) - at(ends[0], i)).powi(2));
                squares.sum::<f64>().sqrt() / length
            }
        }
    }
}

fn frame_rate(frame: usize, v: &[f64]) -> f64 {
    let directors = &v[12 * frame + 3..12 * frame + 12];
    (0.5 * directors.iter().map(|d| d * d).sum::<f64>()).sqrt()
}

/// The fastest rotation so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct FastestSoFar {
    member: usize,
    rate: f64, // rad/s
    t: f64,    // s
}

/// Follows the fastest rotation of what no prescribed motion turns.
#[derive(Clone, Debug)]
pub(crate) struct RotationWatch {
    all: Vec<(String, TurningPart)>,
    driven: Vec<bool>,
    pub(crate) fastest: FastestSoFar,
    /// A step has failed, after nodes that may not be those of the motion: rotations along the run
    /// are worth no word.
    pub(crate) failed: bool,
}

impl RotationWatch {
    pub(crate) fn new(model: &Model, mechanism: &Mechanism, beams: &Beams) -> Self {
        let description = mechanism.description();
        let bodies = model.bodies.iter().enumerate().filter(|(_, body)| !body.fixed);
        let bodies = bodies.map(|(k, body)| (body.name.clone(), TurningPart::Body(k)));
        let beams = beams
            .list
            .iter()
            .map(|beam| (beam.name.clone(), TurningPart::Beam(beam.nodes.clone())));
        let (first, d) = (12 * description.bodies.len(), description.dimension);
        let end = |end: &BarEnd| match end {
            BarEnd::Particle(k) => Some(first + d * k),
            BarEnd::Ground(_) => None,
        };
        let bars = description.bars.iter().map(|bar| {
            let ends = [end(&bar.from), Some(first + d * bar.to)];
            (bar.name.clone(), TurningPart::Bar(ends, d, bar.length))
        });
        let all: Vec<_> = bodies.chain(beams).chain(bars).collect();
        let driven = vec![false; all.len()];
        Self { all, driven, fastest: FastestSoFar::default(), failed: false }
    }

    /// Prescribed motions alone give the velocity `v` at some time.
    pub(crate) fn drive(&mut self, v: &[f64]) {
        let rates: Vec<f64> = self.all.iter().map(|(_, turning)| turning.rate(v)).collect();
        let largest = rates.iter().copied().fold(0.0, f64::max);
        for (driven, rate) in self.driven.iter_mut().zip(rates) {
            *driven |= rate > DRIVEN * largest;
        }
    }

    /// The fastest rotation with the velocity `v`; `driven`: also of what prescribed motions turn.
    pub(crate) fn of(
        &self,
        t: f64,
        v: &[f64],
        driven: bool,
        settings: &Settings,
    ) -> Option<FastestRotation> {
        let judged = self.all.iter().zip(&self.driven).filter(|(_, own)| driven || !**own);
        let rates = judged.map(|((name, turning), _)| (name, turning.rate(v)));
        let (name, rate) = rates.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (rate.is_finite() && rate > 0.0).then(|| FastestRotation::new(name, t, rate, settings))
    }

    /// Takes up a node; allocates nothing.
    pub(crate) fn follow(&mut self, t: f64, v: &[f64]) {
        for (member, ((_, turning), driven)) in self.all.iter().zip(&self.driven).enumerate() {
            let rate = if *driven { 0.0 } else { turning.rate(v) };
            if rate > self.fastest.rate {
                self.fastest = FastestSoFar { member, rate, t };
            }
        }
    }

    /// The fastest rotation so far.
    pub(crate) fn so_far(&self, settings: &Settings) -> Option<FastestRotation> {
        let FastestSoFar { member, rate, t } = self.fastest;
        let (name, _) = self.all.get(member)?;
        (rate > 0.0).then(|| FastestRotation::new(name, t, rate, settings))
    }
}
