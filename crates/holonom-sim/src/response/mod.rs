//! Harmonic response of a model over a band of frequencies: amplitude and phase of its sensors.
//!
//! ```text
//! f(t) = Re(f e^{iωt})      y(t) = y_0 + Re(ŷ e^{iωt}),   ŷ = ∂y/∂q δq + ∂y/∂v iω δq − ∂y/∂a ω² δq
//! base motion               coordinates relative to the ground: the force of inertia ω² M r
//! ```
//! The state is that of modes: the initial configuration, an equilibrium, or a steady rotation;
//! loads that excite have no part in it. See [`mod@vi_statics::harmonic`]. Beside the frequencies
//! asked for, resonances in the band and the flanks of their peaks are computed, so that no peak is
//! missed between two frequencies.

mod input;

pub use input::{ResponseInput, SpaceDirection};
pub use vi_statics::AddedDamping;

use crate::modes::{About, ModalAnalysis, ModeKind, ModesError};
use crate::sensor::{SensorColumn, columns};
use crate::statics::{refuse_rolling, refuse_states};
use holonom_model::{Model, ModelError, Sensor, SensorKind};
use input::Excitation;
use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use vi_statics::modes::ModeError;

/// Modes that resonances are taken from.
const MODES: usize = 60;
/// Flanks of a peak, in parts of its half width.
const FLANKS: [f64; 7] = [-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0];
/// A damping ratio below which a peak is not bounded by anything but round-off.
const UNDAMPED: f64 = 1e-9;
/// Amplitudes beside the largest of the same quantity that differentiation leaves of nothing.
const ROUND_OFF: f64 = 1e-10;
/// Displacement by which sensors are differentiated, as a part of the size of the system.
const SHORT: f64 = 1e-5;

/// Why there is no response.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// The model or its state.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// Nothing of this name.
    #[error("there is no {what} `{name}`; there are: {known}")]
    NoSuch {
        /// What was sought.
        what: &'static str,
        /// Its name.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// No sensor has an amplitude.
    #[error("no sensor of the model has an amplitude: there is nothing to tell")]
    NoSensor,
    /// Nothing excites the system.
    #[error("the inputs exert no force on the system")]
    NoForce,
    /// Base motion or unbalance in a rotating frame.
    #[error("`{0}` turns in the frame that rotates: in a steady rotation loads alone excite")]
    InRotation(String),
    /// A steady motion.
    #[error(
        "there is no harmonic response about a steady motion: take the start, an equilibrium or a rotation"
    )]
    SteadyMotion,
    /// The state is unstable.
    #[error("the state is unstable, in {0} modes: no steady response follows an excitation")]
    Unstable(usize),
    /// A resonance without damping.
    #[error(
        "at {0} Hz the response is unbounded: a resonance without damping, or a motion without stiffness at 0 Hz"
    )]
    Unbounded(f64),
}

impl From<ModelError> for ResponseError {
    fn from(error: ModelError) -> Self {
        Self::Modes(error.into())
    }
}

impl From<ModeError> for ResponseError {
    fn from(error: ModeError) -> Self {
        Self::Modes(ModesError::Uncertain(error))
    }
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Lowest and highest frequency, Hz.
    pub ends: [f64; 2],
    /// Number of frequencies, at equal distances.
    pub count: usize,
}

impl Band {
    /// `count` frequencies from the first to the second end, Hz.
    ///
    /// # Errors
    /// What a band is, where this is none.
    pub fn new(ends: [f64; 2], count: usize) -> Result<Self, &'static str> {
        if !(ends[0] >= 0.0 && ends[1] > ends[0] && ends[1].is_finite()) {
            return Err("the band begins at 0 Hz or above, and ends higher than it begins");
        }
        if !(2..=100_000).contains(&count) {
            return Err("there are 2 to 100000 frequencies");
        }
        Ok(Self { ends, count })
    }
}

/// A resonance in the band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resonance {
    /// Natural frequency, Hz.
    pub frequency: f64,
    /// Damping ratio, with the damping added.
    pub damping_ratio: f64,
}

/// A number of a sensor over the frequencies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResponseColumn {
    /// Its name in the header.
    pub name: String,
    /// What it is.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// Amplitude, at each frequency.
    pub amplitude: Vec<f64>,
    /// Phase against a cosine of the input, degrees, in (−180, 180].
    pub phase: Vec<f64>,
}

impl ResponseColumn {
    /// Index of the largest amplitude.
    #[must_use]
    pub fn peak(&self) -> usize {
        let all = self.amplitude.iter().enumerate();
        all.max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(k, _)| k)
    }
}

/// A harmonic response.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// Name of the model.
    pub model: String,
    /// About which configuration.
    pub about: About,
    /// What excites.
    pub inputs: Vec<ResponseInput>,
    /// `α` (1/s) and `β` (s) of `α M + β K`.
    pub rayleigh: [f64; 2],
    /// Damping ratios of the vibrations, the last one of all further ones.
    pub damping_ratios: Vec<f64>,
    /// Degrees of freedom.
    pub dof: usize,
    /// Frequencies, Hz, ascending.
    pub frequencies: Vec<f64>,
    /// Of each number of a sensor.
    pub columns: Vec<ResponseColumn>,
    /// Those in the band.
    pub resonances: Vec<Resonance>,
    /// What is worth knowing.
    pub warnings: Vec<String>,
}

impl Response {
    /// The response of a model.
    ///
    /// # Errors
    /// [`ResponseError`].
    pub fn new(
        model: &Model,
        about: About,
        inputs: &[ResponseInput],
        band: &Band,
        damping: &AddedDamping,
    ) -> Result<Self, ResponseError> {
        if about == About::Motion {
            return Err(ResponseError::SteadyMotion);
        }
        let in_rotation = about == About::Rotation;
        if let Some(turning) =
            inputs.iter().find(|own| in_rotation && !matches!(own, ResponseInput::Load(_)))
        {
            return Err(ResponseError::InRotation(turning.to_string()));
        }
        let mut state = model.clone();
        state.loads.retain(|load| !inputs.contains(&ResponseInput::Load(load.name.clone())));
        let mut warnings = without_amplitudes(&mut state);
        if state.sensors.is_empty() {
            return Err(ResponseError::NoSensor);
        }
        refuse_rolling(model, "run the motion in time").map_err(ModesError::from)?;
        refuse_states(model, "harmonic responses").map_err(ModesError::from)?;
        let mut analysis = ModalAnalysis::new(&state, about)?;
        let modes = analysis.modes(MODES)?;
        if modes.unstable > 0 {
            return Err(ResponseError::Unstable(modes.unstable));
        }
        warnings.extend(modes.warnings);
        let mut resonances = Vec::new();
        let vibrations = modes.modes.iter().filter(|mode| mode.kind == ModeKind::Vibration);
        for (k, mode) in vibrations.enumerate() {
            let [alpha, beta] = damping.rayleigh;
            let added = damping.ratios.get(k).or(damping.ratios.last()).copied().unwrap_or(0.0);
            let ratio = mode.damping_ratio + added + 0.5 * (alpha / mode.omega + beta * mode.omega);
            resonances.push(Resonance { frequency: mode.frequency, damping_ratio: ratio });
        }
        let [low, high] = band.ends;
        resonances.retain(|own| own.frequency >= low && own.frequency <= high);
        if let Some(sharp) = resonances.iter().find(|own| own.damping_ratio < UNDAMPED) {
            warnings.push(format!(
                "the resonance at {:.6} Hz has no damping: its peak is unbounded",
                sharp.frequency
            ));
        }
        let frequencies = frequencies(band, &resonances);
        let statics = analysis.statics();
        let excitation = Excitation::new(model, statics, inputs)?;
        if excitation.at(1.0).iter().all(|f| f.norm() == 0.0) {
            return Err(ResponseError::NoForce);
        }
        let mut equations = statics.problem().harmonic_response(damping)?;
        let own: Vec<SensorColumn> = columns(&state);
        let with_base = of_base(&state, &own);
        let mut found: Vec<ResponseColumn> = own.iter().map(empty).collect();
        for &frequency in &frequencies {
            if vi_core::interruption::is_raised() {
                return Err(ModesError::Interrupted.into());
            }
            let omega = TAU * frequency;
            let dq = equations
                .amplitudes(omega, &excitation.at(omega))
                .map_err(|_| ResponseError::Unbounded(frequency))?;
            let mut values = statics.sensor_amplitudes(omega, &dq, SHORT);
            for (value, base) in values.iter_mut().zip(&with_base) {
                let Some((axis, order)) = base else { continue };
                *value += Complex::new(0.0, omega).powu(*order) * excitation.base[*axis];
            }
            without_round_off(&own, &mut values);
            for (column, value) in found.iter_mut().zip(values) {
                column.amplitude.push(value.norm());
                column.phase.push(if value.norm() > 0.0 { value.arg().to_degrees() } else { 0.0 });
            }
        }
        let kept = own.iter().zip(found).filter(|(own, _)| !own.is_flag());
        Ok(Self {
            model: model.header.name.clone(),
            about,
            inputs: inputs.to_vec(),
            rayleigh: damping.rayleigh,
            damping_ratios: damping.ratios.clone(),
            dof: modes.dof,
            frequencies,
            columns: kept.map(|(_, found)| found).collect(),
            resonances,
            warnings,
        })
    }

    /// `response.csv`: a row for each frequency.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from("frequency,omega");
        for column in &self.columns {
            let _ = write!(text, ",{0}.amplitude,{0}.phase", column.name);
        }
        text.push('\n');
        for (k, frequency) in self.frequencies.iter().enumerate() {
            let _ = write!(text, "{frequency},{}", TAU * frequency);
            for column in &self.columns {
                let _ = write!(text, ",{},{}", column.amplitude[k], column.phase[k]);
            }
            text.push('\n');
        }
        text
    }
}

fn empty(column: &SensorColumn) -> ResponseColumn {
    ResponseColumn {
        name: column.name(),
        quantity: column.quantity.to_owned(),
        unit: column.unit.to_owned(),
        amplitude: Vec::new(),
        phase: Vec::new(),
    }
}

/// Takes out sensors whose numbers are not linear in the motion, or need the multipliers; says
/// which.
fn without_amplitudes(model: &mut Model) -> Vec<String> {
    let constraints: Vec<String> =
        model.constraints.iter().map(|constraint| constraint.name().to_owned()).collect();
    let has_none = |sensor: &Sensor| match sensor.kind {
        SensorKind::Reaction
        | SensorKind::Power
        | SensorKind::Work
        | SensorKind::Slip
        | SensorKind::ContactForce
        | SensorKind::StopForce
        | SensorKind::FrictionTorque
        | SensorKind::Imu
        | SensorKind::Expression => true,
        SensorKind::Effort => constraints.contains(&sensor.of),
        _ => false,
    };
    let out: Vec<String> =
        model.sensors.iter().filter(|s| has_none(s)).map(|s| format!("`{}`", s.name)).collect();
    let kept = |own: &&Sensor| !has_none(own) || model.reads_sensor(&own.name);
    model.sensors = model.sensors.iter().filter(kept).cloned().collect();
    let note = || {
        format!(
            "no amplitudes of {}: reactions, efforts of constraints, powers, inertial units and expressions are left out",
            out.join(", ")
        )
    };
    if out.is_empty() { Vec::new() } else { vec![note()] }
}

/// Zeros in the place of amplitudes that are round-off beside others of the same quantity.
fn without_round_off(columns: &[SensorColumn], values: &mut [Complex<f64>]) {
    let largest: Vec<f64> = columns
        .iter()
        .map(|own| {
            let alike = columns.iter().zip(values.iter());
            let alike = alike.filter(|(other, _)| other.quantity == own.quantity);
            alike.map(|(_, value)| value.norm()).fold(0.0, f64::max)
        })
        .collect();
    for (value, largest) in values.iter_mut().zip(largest) {
        if value.norm() <= ROUND_OFF * largest {
            *value = Complex::default();
        }
    }
}

/// The axis and the number of derivatives of what moves with the ground in space: positions,
/// velocities, accelerations that are not seen from a body.
fn of_base(model: &Model, columns: &[SensorColumn]) -> Vec<Option<(usize, u32)>> {
    let order = |column: &SensorColumn| {
        let sensor = model.sensors.iter().find(|sensor| sensor.name == column.sensor)?;
        let order = match sensor.kind {
            SensorKind::Position => 0,
            SensorKind::Velocity => 1,
            SensorKind::Acceleration => 2,
            _ => return None,
        };
        let axis = ["x", "y", "z"].iter().position(|axis| column.part.ends_with(axis))?;
        sensor.seen_from.is_none().then_some((axis, order))
    };
    columns.iter().map(order).collect()
}

/// Those asked for, with the peaks of damped resonances and their flanks.
fn frequencies(band: &Band, resonances: &[Resonance]) -> Vec<f64> {
    let [low, high] = band.ends;
    let last = band.count.saturating_sub(1).max(1) as f64;
    let mut all: Vec<f64> = (0..band.count).map(|k| low + (high - low) * k as f64 / last).collect();
    for own in resonances.iter().filter(|own| own.damping_ratio >= UNDAMPED) {
        let near = FLANKS.map(|part| own.frequency * (1.0 + part * own.damping_ratio));
        all.extend(near.into_iter().filter(|f| *f > low && *f < high));
    }
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| (*a - *b).abs() <= 1e-12 * b.abs());
    all
}
