//! Modes over the speed of a steady rotation: the Campbell diagram.
//!
//! The relative equilibrium of each speed is found from that of the speed before. Modes are
//! followed from one speed to the next by their shapes: of all pairs the one with the largest
//! correlation `|x_aᴴ x_b|²/(|x_a|² |x_b|²)` first, reduced where the frequency changes much.
//! Shapes of equal frequencies (those of equal blades) are arbitrary mixtures; among them the
//! frequency decides.
//!
//! Source: R. J. Allemang, Sound & Vibration 37 (2003) 14–21, the modal assurance criterion.

use super::{ModalAnalysis, Mode, ModeKind, ModesError, Report};
use crate::statics::Statics;
use holonom_model::Model;
use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::{FrameId, Joint};
use vi_statics::SteadyRotation;

/// Modes beyond those asked for, so that one that leaves the lowest is still followed.
const SPARE: usize = 4;
/// Correlation that any two shapes are granted.
const ANY: f64 = 0.01;
/// Change of a frequency from one speed to the next that is usual, as a part of it.
const USUAL: f64 = 0.05;

/// The modes at one speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Speed {
    /// Angular velocity, rad/s.
    pub speed: f64,
    /// Unstable modes.
    pub unstable: usize,
    /// Each followed vibration at this speed; `None` where it is none any more.
    pub vibrations: Vec<Option<Mode>>,
}

/// Modes over the speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Campbell {
    /// Name of the model.
    pub model: String,
    /// In the order of the speeds asked for.
    pub speeds: Vec<Speed>,
    /// What is worth knowing.
    pub warnings: Vec<String>,
}

impl Campbell {
    /// The `count` softest vibrations at the first speed, followed over `speeds`, rad/s. The axis
    /// is that of the initial velocities; of a model at rest, that of its hinge with the ground.
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn new(model: &Model, speeds: &[f64], count: usize) -> Result<Self, ModesError> {
        let axis = axis(model)?;
        let mut diagram =
            Self { model: model.header.name.clone(), speeds: Vec::new(), warnings: Vec::new() };
        let mut last: Option<(Report, Vec<Option<usize>>)> = None;
        for &speed in speeds {
            let from = last.as_ref().map(|(report, _)| report.configuration.as_slice());
            let rotation = axis.with_speed(speed);
            let report = ModalAnalysis::in_rotation(model, rotation, from)?.modes(count + SPARE)?;
            let followed = match &last {
                None => first(&report, count),
                Some((before, places)) => follow(before, places, &report),
            };
            for warning in &report.warnings {
                if !diagram.warnings.contains(warning) {
                    diagram.warnings.push(warning.clone());
                }
            }
            let mode = |place: &Option<usize>| place.map(|k| report.modes[k].clone());
            let vibrations = followed.iter().map(mode).collect();
            diagram.speeds.push(Speed { speed, unstable: report.unstable, vibrations });
            last = Some((report, followed));
        }
        Ok(diagram)
    }

    /// `campbell.csv`: a row for each speed and mode, frequencies in the frame that rotates.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from("speed,mode,omega,frequency,decay,damping_ratio\n");
        for Speed { speed, vibrations, .. } in &self.speeds {
            for (k, mode) in vibrations.iter().enumerate() {
                let Some(mode) = mode else { continue };
                let Mode { omega, frequency, decay, damping_ratio, .. } = mode;
                let number = k + 1;
                let _ =
                    writeln!(text, "{speed},{number},{omega},{frequency},{decay},{damping_ratio}");
            }
        }
        text
    }
}

/// The axis about which the system can rotate.
fn axis(model: &Model) -> Result<SteadyRotation, ModesError> {
    let statics = Statics::at_start(model)?;
    let rotation = statics.rotation()?.or_else(|| hinge(statics.mechanism()));
    let rotation = rotation.ok_or(ModesError::NoRotation)?;
    statics.admits(&rotation)?;
    Ok(rotation)
}

/// One radian per second about the first hinge with the ground.
fn hinge(mechanism: &Mechanism) -> Option<SteadyRotation> {
    let turns = |joint: &Joint| joint.kind.properties().motion.rotates_about_line();
    let mut joints = mechanism.description().joints.iter();
    let joint = joints.find(|joint| turns(joint) && joint.parent.frame == FrameId::Ground)?;
    let q = mechanism.initial_configuration();
    let (point, axis) = (joint.parent.point().at(&q), joint.parent.axis(2).at(&q));
    Some(SteadyRotation { point, velocity: axis.normalize() })
}

/// Places of the `count` softest vibrations.
fn first(report: &Report, count: usize) -> Vec<Option<usize>> {
    let places = (0..report.modes.len()).filter(|&k| report.modes[k].kind == ModeKind::Vibration);
    places.take(count).map(Some).collect()
}

/// The place of each mode at the next speed.
fn follow(before: &Report, places: &[Option<usize>], now: &Report) -> Vec<Option<usize>> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, place) in places.iter().enumerate() {
        let Some(old) = place.map(|k| &before.modes[k]) else { continue };
        let vibrations =
            now.modes.iter().enumerate().filter(|(_, m)| m.kind == ModeKind::Vibration);
        pairs.extend(vibrations.map(|(k, new)| (likeness(old, new), i, k)));
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut next = vec![None; places.len()];
    let mut taken = vec![false; now.modes.len()];
    for (_, i, k) in pairs {
        if next[i].is_none() && !taken[k] {
            (next[i], taken[k]) = (Some(k), true);
        }
    }
    next
}

/// The correlation of the shapes, at least [`ANY`], over `1 + (Δω/(r ω))²`.
fn likeness(a: &Mode, b: &Mode) -> f64 {
    let change = (b.omega - a.omega) / (USUAL * a.omega.max(f64::MIN_POSITIVE));
    (correlation(a, b) + ANY) / (1.0 + change * change)
}

/// `|x_aᴴ x_b|²/(|x_a|² |x_b|²)` of the displacements and rotations.
fn correlation(a: &Mode, b: &Mode) -> f64 {
    let numbers = |mode: &Mode| -> Vec<Complex<f64>> {
        let of = |m: &super::MemberShape| {
            let pair = |re: [f64; 3], im: [f64; 3]| (0..3).map(move |i| Complex::new(re[i], im[i]));
            let translation = pair(m.translation, m.translation_before);
            translation.chain(pair(m.rotation, m.rotation_before)).collect::<Vec<_>>()
        };
        mode.shape.iter().flat_map(of).collect()
    };
    let (a, b) = (numbers(a), numbers(b));
    let dot = |x: &[Complex<f64>], y: &[Complex<f64>]| -> Complex<f64> {
        x.iter().zip(y).map(|(x, y)| x.conj() * y).sum()
    };
    let size = dot(&a, &a).re * dot(&b, &b).re;
    if size > 0.0 { dot(&a, &b).norm_sqr() / size } else { 0.0 }
}
