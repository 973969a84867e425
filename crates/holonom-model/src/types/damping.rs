//! `damping` of a section.

use crate::text::problem::{Problem, fault};
use nalgebra::Matrix6;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_beam::section::{Section, SectionError};
use vi_core::Number;

use super::outline::NumberAtKey;

/// `damping` of a section: Kelvin–Voigt, the stress is `C (ε + τ ε̇)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "damping is a relaxation time in s, a table { EA, GA1, GA2, EI1, EI2, GJ } of them, \
                 { loss_factor, frequency }, or a matrix of 6 lists of 6 numbers"
)]
#[allow(clippy::large_enum_variant)] // read once for each section
pub enum Damping {
    /// The relaxation time `τ` of all strains, s.
    Time(f64),
    /// `η = 2π f τ` at a frequency `f`, for all strains.
    LossFactor(LossFactor),
    /// The relaxation time of each strain, s; zero where it is not stated.
    Times(RelaxationTimes),
    /// `V`, 6×6 in the order of `stiffness`: the stress is `C ε + V ε̇`; N·s, N·m·s, N·m²·s.
    Viscosity([[f64; 6]; 6]),
}

/// A loss factor with its frequency.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LossFactor {
    /// `η`, twice the damping ratio of a vibration at `frequency`.
    pub loss_factor: f64,
    /// `f`, Hz.
    pub frequency: f64,
}

/// Relaxation times, s, under the names of the stiffnesses.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, rename_all = "UPPERCASE")]
pub struct RelaxationTimes {
    /// Of the extension, s.
    pub ea: f64,
    /// Of the shear along `d_1`, s.
    pub ga1: f64,
    /// Of the shear along `d_2`, s.
    pub ga2: f64,
    /// Of the bending about `d_1`, s.
    pub ei1: f64,
    /// Of the bending about `d_2`, s.
    pub ei2: f64,
    /// Of the twist, s.
    pub gj: f64,
}

impl Damping {
    /// A section with it, from its numbers by their keys below that of the section.
    pub(crate) fn of<T: Number>(
        &self,
        section: Section<T>,
        number: NumberAtKey<'_, T>,
    ) -> Result<Section<T>, Problem> {
        let refuse = |error: SectionError| {
            fault("damping", error.to_string(), "write a symmetric matrix that dissipates")
        };
        match self {
            Self::Viscosity(rows) => {
                section.with_viscosity(matrix_by(rows, "damping", number)).map_err(refuse)
            }
            _ => section.with_damping(self.times_by(number)?).map_err(refuse),
        }
    }

    /// Whether a strain has a relaxation time.
    pub(crate) fn is_any(&self) -> bool {
        match self {
            Self::Viscosity(rows) => rows.iter().flatten().any(|v| *v != 0.0),
            _ => {
                let times = self.times_by(&|_, value| value);
                times.is_ok_and(|times| times.iter().any(|time| *time > 0.0))
            }
        }
    }

    /// Relaxation times in the order of the stiffnesses of the elements, s; of a full viscosity
    /// none.
    fn times_by<T: Number>(&self, number: NumberAtKey<'_, T>) -> Result<[T; 6], Problem> {
        let not_negative = |key: &str, value: f64, unit: &str| {
            let message = format!("{key} = {value} is negative");
            let help = format!("write a positive number{unit}, or 0 for no damping");
            if value < 0.0 { Err(fault(key, message, help)) } else { Ok(value) }
        };
        match self {
            Self::Viscosity(_) => Ok([T::of(0.0); 6]),
            Self::Time(time) => {
                let time = not_negative("damping", *time, " of seconds")?;
                Ok([number("damping", time); 6])
            }
            Self::LossFactor(LossFactor { loss_factor, frequency }) => {
                if *frequency <= 0.0 {
                    let message = format!("frequency = {frequency} is not positive");
                    let help = "write the frequency at which the loss factor holds, in Hz";
                    return Err(fault("damping.frequency", message, help));
                }
                let eta = not_negative("damping.loss_factor", *loss_factor, "")?;
                let eta = number("damping.loss_factor", eta);
                let frequency = number("damping.frequency", *frequency);
                Ok([eta / (T::of(std::f64::consts::TAU) * frequency); 6]) // η = 2π f τ
            }
            Self::Times(RelaxationTimes { ea, ga1, ga2, ei1, ei2, gj }) => {
                let named = [
                    ("damping.GA1", ga1),
                    ("damping.GA2", ga2),
                    ("damping.EA", ea),
                    ("damping.EI1", ei1),
                    ("damping.EI2", ei2),
                    ("damping.GJ", gj),
                ];
                for (key, value) in named {
                    not_negative(key, *value, " of seconds")?;
                }
                Ok(named.map(|(key, value)| number(key, *value)))
            }
        }
    }
}

/// Rows as a matrix.
pub(crate) fn matrix(rows: &[[f64; 6]; 6]) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| rows[i][j])
}

/// The same of numbers by their keys.
pub(crate) fn matrix_by<T: Number>(
    rows: &[[f64; 6]; 6],
    key: &str,
    number: NumberAtKey<'_, T>,
) -> Matrix6<T> {
    Matrix6::from_fn(|i, j| number(&format!("{key}.{i}.{j}"), rows[i][j]))
}
