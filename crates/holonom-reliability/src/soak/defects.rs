//! Defects made on purpose, between the program and the judge: the harness must find each.

use super::fault::FaultKind;
use super::statement::Statement;
use super::trace::Trace;
use holonom::model::{Joint, JointKind};
use holonom::verification::certificate::{Certificate, Finding, Verdict};
use holonom::{Model, ModelError, RunState};
use serde_json::Value;

/// One thing made wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoakDefect {
    /// One mechanism in a hundred panics.
    Panic,
    /// A coordinate becomes NaN.
    NotFinite,
    /// Constraints are not enforced: coordinates are off by 1e-9 of their value.
    Constraint,
    /// Contacts are passed by 1e-8.
    Gap,
    /// Contacts give a tenth of the energy.
    Gain,
    /// Residuals are reported as zero.
    Report,
    /// Momentum grows by 1e-9 of its value in a run.
    Momentum,
    /// Energy grows by 1e-7 of its value in a run.
    Energy,
    /// The equivalent scheme has a time step that is wrong by 1e-3.
    Agreement,
    /// A stored state keeps twelve digits.
    Restart,
    /// A failed step leaves its last iterate behind.
    State,
    /// Failures have no remedy.
    Remedy,
    /// Refusals name nothing.
    Refusal,
    /// The text of a model loses a digit of its step.
    Text,
    /// Reactions and efforts change by 1e-4 when the mechanism is turned.
    Turned,
    /// They do when it is moved.
    Moved,
    /// They do when its parts are stated in another order.
    Reordered,
    /// They do in other units.
    Units,
    /// The first axis of a planar pair is an axis of space.
    FirstAxis,
    /// Certificates fail what does not apply where nothing is free to move.
    Certificate,
}

impl SoakDefect {
    /// All.
    pub const ALL: [Self; 20] = [
        Self::Panic,
        Self::NotFinite,
        Self::Constraint,
        Self::Gap,
        Self::Gain,
        Self::Report,
        Self::Momentum,
        Self::Energy,
        Self::Agreement,
        Self::Restart,
        Self::State,
        Self::Remedy,
        Self::Refusal,
        Self::Text,
        Self::Turned,
        Self::Moved,
        Self::Reordered,
        Self::Units,
        Self::FirstAxis,
        Self::Certificate,
    ];

    /// What is wrong, in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Panic => "one mechanism in a hundred panics",
            Self::NotFinite => "a coordinate becomes NaN",
            Self::Constraint => {
                "constraints are not enforced: coordinates are off by 1e-9 of their value"
            }
            Self::Gap => "contacts and stops are passed by 1e-8",
            Self::Gain => "contacts give a tenth of the energy",
            Self::Report => "residuals are reported as zero",
            Self::Momentum => "momenta grow by 1e-9 of their value",
            Self::Energy => "the energy grows by 1e-7 of its value",
            Self::Agreement => "one of two equivalent schemes has a step that is off by 1e-3",
            Self::Restart => "a stored state keeps twelve digits",
            Self::State => "a refused step changes the state",
            Self::Remedy => "a failed run names no remedy",
            Self::Refusal => "a refused model is refused without words",
            Self::Text => "the text of a model loses digits of the step",
            Self::Turned => "reactions change by 1e-4 when the mechanism is turned",
            Self::Moved => "reactions change by 1e-4 when the mechanism is moved",
            Self::Reordered => "reactions change by 1e-4 when parts are stated in another order",
            Self::Units => "reactions change by 1e-4 in other units",
            Self::FirstAxis => "the first axis of a planar pair is an axis of space",
            Self::Certificate => "what does not apply to a mechanism is judged as failed",
        }
    }

    /// What must find it.
    #[must_use]
    pub fn kind(self) -> FaultKind {
        match self {
            Self::Panic => FaultKind::Panic,
            Self::NotFinite => FaultKind::NotFinite,
            Self::Constraint => FaultKind::Residual,
            Self::Gap => FaultKind::Gap,
            Self::Gain => FaultKind::Gain,
            Self::Report => FaultKind::Report,
            Self::Momentum => FaultKind::Momentum,
            Self::Energy => FaultKind::Energy,
            Self::Agreement => FaultKind::Agreement,
            Self::Restart => FaultKind::Restart,
            Self::State => FaultKind::State,
            Self::Remedy | Self::Refusal => FaultKind::Words,
            Self::Text => FaultKind::RoundTrip,
            Self::Certificate => FaultKind::Certificate,
            Self::Turned | Self::Moved | Self::Reordered | Self::Units | Self::FirstAxis => {
                FaultKind::Restated
            }
        }
    }

    /// Whether it shows when a mechanism is stated otherwise.
    #[must_use]
    pub fn restates(self) -> bool {
        self.kind() == FaultKind::Restated
    }

    /// Makes the run of a mechanism that is stated otherwise wrong.
    pub(super) fn restate(defect: Option<Self>, statement: Statement, trace: &mut Trace) {
        let word = match defect {
            Some(Self::Turned) => "turned",
            Some(Self::Moved) => "moved",
            Some(Self::Reordered) => "reordered",
            Some(Self::Units) => "in other units",
            _ => return,
        };
        if statement.name() == word {
            let sensors = trace.samples.iter_mut().flat_map(|sample| &mut sample.sensors);
            sensors.for_each(|x| *x *= 1.0 + 1e-4);
        }
    }

    /// Makes a mechanism that is stated otherwise wrong.
    pub(super) fn stated(defect: Option<Self>, mut model: Model) -> Model {
        if defect == Some(Self::FirstAxis) {
            let planar = |joint: &&mut Joint| joint.kind == JointKind::Planar;
            for joint in model.joints.iter_mut().filter(planar) {
                joint.first_axis = joint.first_axis.or(Some([0.6, -0.48, 0.64]));
            }
        }
        model
    }

    /// Makes a run wrong.
    pub(super) fn disturb(defect: Option<Self>, trace: &mut Trace) {
        let Some(last) = trace.samples.last_mut() else { return };
        match defect {
            Some(Self::Panic) => assert!(last.q[0].to_bits() % 100 != 0, "on purpose"),
            Some(Self::NotFinite) => last.q[0] = f64::NAN,
            Some(Self::Constraint) => last.q.iter_mut().for_each(|q| *q *= 1.0 + 1e-9),
            Some(Self::Report) => {
                trace.samples.iter_mut().for_each(|sample| sample.residuals.position = 0.0);
            }
            Some(Self::Gap) => trace.gap.iter_mut().for_each(|gap| *gap -= 1e-8),
            Some(Self::Gain) => {
                last.energy += 0.1 * last.energies.first().copied().unwrap_or_default();
            }
            Some(Self::Momentum) => last.momentum.linear.iter_mut().for_each(|p| *p *= 1.0 + 1e-9),
            Some(Self::Energy) => {
                let total = last.energies.first().copied().unwrap_or_default();
                last.energies.iter_mut().next_back().into_iter().for_each(|b| *b += 1e-7 * total);
            }
            Some(Self::Remedy) => {
                trace.failure.iter_mut().for_each(|failure| failure.remedy.clear());
            }
            _ => {}
        }
    }

    /// Makes the motion of the other scheme wrong.
    pub(super) fn other(defect: Option<Self>, trace: &mut Trace) {
        if defect == Some(Self::Agreement) && trace.samples.len() > 1 {
            let count = trace.samples.len();
            let before = trace.samples[count - 2].q.clone();
            let pairs = trace.samples[count - 1].q.iter_mut().zip(before);
            pairs.for_each(|(q, before)| *q += 1e-3 * 20.0 * (*q - before));
        }
    }

    /// Makes a stored state wrong.
    pub(super) fn state(defect: Option<Self>, state: RunState) -> RunState {
        if !matches!(defect, Some(Self::Restart | Self::State)) {
            return state;
        }
        let shortened = serde_json::to_value(&state).map(|mut value| {
            shorten(&mut value);
            value
        });
        shortened.and_then(serde_json::from_value).unwrap_or(state)
    }

    /// Makes a refusal wrong.
    pub(super) fn refuse(defect: Option<Self>, error: &mut ModelError) {
        if defect == Some(Self::Refusal) {
            *error = ModelError::Invalid(Vec::new());
        }
    }

    /// Makes a certificate wrong.
    pub(super) fn certify(defect: Option<Self>, certificate: &mut Certificate) {
        if defect == Some(Self::Certificate) {
            let inapplicable = |found: &&mut Finding| found.verdict == Verdict::NotApplicable;
            for found in certificate.findings.iter_mut().filter(inapplicable) {
                found.verdict = Verdict::Fail;
            }
        }
    }

    /// Makes the text of a model wrong.
    pub(super) fn text(defect: Option<Self>, text: String) -> String {
        match defect {
            Some(Self::Text) => {
                let line = text.lines().find(|line| line.starts_with("step = "));
                let shorter = line.map(|line| line.chars().take(12).collect::<String>());
                match (line, shorter) {
                    (Some(line), Some(shorter)) => text.replacen(line, &shorter, 1),
                    _ => text,
                }
            }
            _ => text,
        }
    }
}

/// Numbers of twelve digits in the place of all.
fn shorten(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(shorten),
        Value::Object(map) => map.values_mut().for_each(shorten),
        Value::Number(number) if number.is_f64() => {
            let short = number.as_f64().and_then(|x| format!("{x:.11e}").parse::<f64>().ok());
            if let Some(short) = short.and_then(serde_json::Number::from_f64) {
                *number = short;
            }
        }
        _ => {}
    }
}
