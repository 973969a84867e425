//! Parameters of a mechanism from measurements of its motion.
//!
//! ```text
//! ρ_i = (y(t_i; θ) − ŷ_i)/s_i       y: a quantity at a node, ŷ: measured, s: its standard deviation
//! ∂ρ_i/∂θ_k = ∇y·δq_k/s_i           δq_k: the tangent of the motion along θ_k                     [2.37]
//! ```
//! All derivatives come from tangents beside one run; least squares do the rest
//! ([`crate::least_squares`]). Parameters may change the start, the masses, the geometry, the
//! forces: what an [`Experiment`] says. A quantity must not change with a parameter but through
//! `q`.

use crate::controls::Controls;
use crate::least_squares::{Refused, Residuals};
use crate::objective::{Objective, Quantity};
use crate::sensitivities::{Beside, Direction, Growth, Sensitivities};
use nalgebra::DMatrix;
use vi_constraints::design::Design;
use vi_core::linear::dot;
use vi_multibody::run::MechanismIntegrator;

/// A run for some parameters, at its start.
pub struct Trial {
    /// The run.
    pub run: MechanismIntegrator,
    /// The length of its steps, s.
    pub step: f64,
    /// What acts.
    pub controls: Controls,
    /// The parameters that enter the equations of a step.
    pub design: Option<Box<dyn Design>>,
    /// One direction for each parameter, in their order.
    pub directions: Vec<Direction>,
    /// What is measured, in the order of the sensors of [`Series`].
    pub quantities: Vec<Box<dyn Quantity>>,
}

impl std::fmt::Debug for Trial {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Trial").field("step", &self.step).finish_non_exhaustive()
    }
}

/// Runs for any parameters.
pub trait Experiment {
    /// The run for some parameters.
    ///
    /// # Errors
    /// [`Refused`], where there is none.
    fn begin(&mut self, theta: &[f64]) -> Result<Trial, Refused>;
}

/// What a sensor read.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Which quantity of a trial.
    pub sensor: usize,
    /// Standard deviation of a value, positive.
    pub sigma: f64,
    /// The nodes of the values, ascending.
    pub nodes: Vec<usize>,
    /// The values, as many.
    pub values: Vec<f64>,
}

/// Why series are no measurements.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SeriesError {
    /// A deviation that is not positive.
    #[error("series {0}: the standard deviation has to be positive")]
    Deviation(usize),
    /// Not as many values as nodes.
    #[error("series {0}: there are not as many values as nodes")]
    Shape(usize),
    /// Out of order.
    #[error("series {0}: the nodes have to increase")]
    Order(usize),
    /// Not a number.
    #[error("series {series}: value {value} is no number")]
    NotANumber {
        /// Which.
        series: usize,
        /// Which of its values.
        value: usize,
    },
}

/// The residuals of measurements.
#[derive(Debug)]
pub struct MotionResiduals<E> {
    experiment: E,
    series: Vec<Series>,
    growth: Vec<Growth>,
}

impl<E: Experiment> MotionResiduals<E> {
    /// Of measurements of an experiment.
    ///
    /// # Errors
    /// [`SeriesError`].
    pub fn new(experiment: E, series: Vec<Series>) -> Result<Self, SeriesError> {
        for (k, own) in series.iter().enumerate() {
            if !(own.sigma > 0.0 && own.sigma.is_finite()) {
                return Err(SeriesError::Deviation(k));
            }
            if own.nodes.len() != own.values.len() {
                return Err(SeriesError::Shape(k));
            }
            if own.nodes.windows(2).any(|pair| pair[0] >= pair[1]) {
                return Err(SeriesError::Order(k));
            }
            if let Some(value) = own.values.iter().position(|value| !value.is_finite()) {
                return Err(SeriesError::NotANumber { series: k, value });
            }
        }
        Ok(Self { experiment, series, growth: Vec::new() })
    }

    /// The measurements.
    pub fn series(&self) -> &[Series] {
        &self.series
    }

    /// How much tangents along the parameters grew in the last run: beyond
    /// [`crate::sensitivities::MEANINGLESS`] residuals have many minima.
    pub fn growth(&self) -> &[Growth] {
        &self.growth
    }

    /// Writes the residuals at a node, and their derivatives.
    fn read(
        &self,
        trial: &Trial,
        tangents: &Sensitivities,
        node: usize,
        out: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) {
        let (at, mut first) = (trial.run.state().configuration(), 0);
        let mut slope = vec![0.0; at.q.len()];
        for own in &self.series {
            if let Ok(k) = own.nodes.binary_search(&node) {
                let quantity = &trial.quantities[own.sensor];
                let row = first + k;
                out[row] = (quantity.value(at) - own.values[k]) / own.sigma;
                if let Some(jacobian) = jacobian.as_deref_mut() {
                    slope.fill(0.0);
                    quantity.add_slope(at, 1.0 / own.sigma, &mut slope);
                    for (j, tangent) in tangents.tangents().iter().enumerate() {
                        jacobian[(row, j)] = dot(&slope, &tangent.q);
                    }
                }
            }
            first += own.nodes.len();
        }
    }
}

impl<E: Experiment> Residuals for MotionResiduals<E> {
    fn len(&self) -> usize {
        self.series.iter().map(|own| own.nodes.len()).sum()
    }

    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        let mut trial = self.experiment.begin(theta)?;
        let wanted = jacobian.is_some();
        let directions = if wanted { std::mem::take(&mut trial.directions) } else { Vec::new() };
        let refused = |error: crate::gradient::GradientError| Refused(error.to_string());
        let mut tangents =
            Sensitivities::new(&trial.run, trial.step, directions).map_err(refused)?;
        let last = self.series.iter().filter_map(|own| own.nodes.last().copied()).max();
        let objective = Objective::default();
        for node in 0..=last.unwrap_or(0) {
            self.read(&trial, &tangents, node, out, jacobian.as_deref_mut());
            if Some(node) == last {
                break;
            }
            let Trial { run, controls, design, .. } = &mut trial;
            let design = design.as_deref();
            let beside = Beside { controls, design, objective: &objective };
            tangents.advance(run, beside).map_err(refused)?;
        }
        if wanted {
            self.growth = tangents.growth().to_vec();
        }
        Ok(())
    }
}
