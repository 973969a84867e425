//! How a relaxed start changes with parameters: the derivative of an equilibrium.
//!
//! ```text
//! D_1 L_d + f_d^- = Gᵀ h λ at q_n = q_{n+1} = q_0 about t = 0         (h/2) of the equations of statics
//! [K  −Gᵀ; G  0] (δq, δhλ) = (−b_θ, −g_θ)                            δv = 0, δp̄ = 0
//! K = (h/2) ∂(f − ∇V)/∂q − Σ hλ_i D²g_i
//! ```
//! The equations of a step that leaves everything at rest are those of the equilibrium, whatever
//! its length: masses, damping and the mass that strains add cancel. States of signals rest where
//! forces are differentiated by positions, and move with parameters of their rates,
//! ```text
//! φ(y, z; θ) = 0       z_θ = −φ_z⁻¹ φ_θ,   b_θ takes (D_1 L_d + f_d^-)_z z_θ                          [2.68]
//! ```
#![allow(non_snake_case)] // G, K

use super::start::StartOf;
use super::{LEAVE_OUT, ModelTangent, refused};
use crate::start::How;
use holonom_model::ModelError;
use nalgebra::DVector;
use vi_constraints::Constraints;
use vi_constraints::design::{Design, Place};
use vi_constraints::linearization::StepLinearization;
use vi_constraints::saddle_point::SaddlePoint;
use vi_core::Configuration;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::{Interval, Slot};
use vi_core::linear::Singular;
use vi_core::sparse::{Block, Entries, Product};
use vi_multibody::design::start::StartTangent;
use vi_multibody::run::MechanismIntegrator;

/// The length of the step at rest, s.
const STEP: f64 = 1.0;

impl StartOf<'_> {
    /// How a relaxed start changes with each of the parameters of `design`.
    ///
    /// # Errors
    /// [`ModelError`] where it moves, is neutral, or a redundant loop opens.
    pub(crate) fn of_equilibrium(
        &self,
        run: &MechanismIntegrator,
        design: &dyn Design,
        tangents: &[ModelTangent],
    ) -> Result<Vec<StartTangent>, ModelError> {
        let Some(first) = tangents.first() else { return Ok(Vec::new()) };
        let name = &first.name;
        let refuse = |what: &str, help: &str| {
            let of = match self.how {
                How::Standing { .. } => "an equilibrium",
                _ => "a relaxed start",
            };
            let what = format!("the derivative by `{name}` of {of} {what}");
            Err(refused(self.key_of_equilibrium(), what, format!("{help}, or {LEAVE_OUT}")))
        };
        if matches!(self.how, How::Standing { neutral: true }) {
            let help = "end the loads before or beyond the limit or bifurcation point, hold what nothing else \
                        holds";
            return refuse("without stiffness", help);
        }
        if matches!(self.how, How::Relaxed { neutral: true, .. }) {
            return refuse(
                "that is in equilibrium in other places as well",
                "hold what nothing else holds, as the spin of a hanging body",
            );
        }
        if self.at.v.iter().any(|v| *v != 0.0) {
            return match self.how {
                How::Relaxed { rotation: Some(rotation), .. }
                    if self.mechanism.description().dimension == 3 =>
                {
                    if !self.signals_rest(run) {
                        let help = "state a `start` with which they rest";
                        return refuse("with signals whose states do not rest", help);
                    }
                    self.of_rotation(run, design, tangents, rotation)
                }
                _ => refuse(
                    "that moves otherwise than in a steady rotation of all its parts",
                    "let it begin at rest",
                ),
            };
        }
        let mut equilibrium = LinearizedStatics::new(self, run).map_err(|Singular| {
            let what = format!("the derivative by `{name}` of a singular equilibrium");
            refused(self.key_of_equilibrium(), what, LEAVE_OUT)
        })?;
        let change = |(k, own): (usize, &ModelTangent)| {
            let q = equilibrium.change(self, run, design, k);
            let q = q.map_err(|Singular| {
                let what = format!("the derivative by `{}` of a singular equilibrium", own.name);
                refused(self.key_of_equilibrium(), what, LEAVE_OUT)
            })?;
            let still = vec![0.0; q.len()];
            let [open, _] = self.opened(own, [&q, &still])?;
            if let Some(row) = self.largest(&open, &q) {
                return Err(self.opens(self.mechanism.constraint_name(row), &own.name));
            }
            self.stays_mobile(own, &q)?;
            Ok(StartTangent { q, v: still.clone(), p: still })
        };
        tangents.iter().enumerate().map(change).collect()
    }
}

/// The largest rate of a state of a signal at rest, in parts of its size or of 1, 1/s.
const RESTS: f64 = 1e-9;

impl StartOf<'_> {
    /// Whether the states of signals that a run begins with are where they rest.
    fn signals_rest(&self, run: &MechanismIntegrator) -> bool {
        let (at, still) = (run.state().configuration(), vec![0.0; self.at.q.len()]);
        let Some(found) = run.system().state_rates(at.moving(&still)) else { return true };
        let mut all = found.rates.iter().zip(&found.places);
        all.all(|(rate, place)| rate.abs() <= RESTS * at.internal[*place].abs().max(1.0))
    }

    /// The key that leads to the equilibrium.
    fn key_of_equilibrium(&self) -> &'static str {
        match self.how {
            How::Standing { .. } => "simulation.end",
            _ => "simulation.start",
        }
    }
}

/// The equations of statics, linearized.
struct LinearizedStatics {
    saddle: SaddlePoint,
    about: Interval, // its middle is at t = 0
    until: Interval, // its end is
    impulse: Vec<f64>,
}

impl LinearizedStatics {
    fn new(start: &StartOf<'_>, run: &MechanismIntegrator) -> Result<Self, Singular> {
        let (system, constraints, q) = (run.system(), run.constraints(), start.at.q);
        let still = |t: f64| {
            let mut s = Interval::between(t, STEP, q, q);
            s.angles.clone_from(&run.state().angles);
            s.internal.clone_from(&run.state().internal);
            let at = Configuration { internal: &[], ..run.state().configuration() };
            system.rest_signals(at.moving(&vec![0.0; q.len()]), &mut s.internal);
            s
        };
        let (about, until) = (still(start.at.t - 0.5 * STEP), still(start.at.t - STEP));
        let mut step = StepLinearization::new(q.len(), constraints.len(), start.rows);
        step.linearize(system, constraints, &about, &vec![0.0; q.len()])?;
        let impulse = step.impulse().to_vec();
        let mut saddle = SaddlePoint::new(q.len(), start.rows.clone());
        // no internal variables are listed: states of signals are where they rest
        let node = Configuration { t: start.at.t, q, angles: &run.state().angles, internal: &[] };
        let still = vec![0.0; q.len()];
        let emit = |out: &mut dyn Entries| {
            let (row, column, scale, transposed) = (0, 0, 0.5 * STEP, false);
            let mut half = Block { into: &mut *out, row, column, scale, transposed };
            system.level_slopes(node.moving(&still), [1.0, 0.0], &mut half);
            constraints.weighted_hessian(about.t, q, &impulse, -1.0, out);
        };
        let G = |out: &mut dyn Entries| constraints.jacobian(about.t, q, out);
        saddle.factorize(&emit, &G, -1.0, &G)?;
        Ok(Self { saddle, about, until, impulse })
    }

    /// `δq_0` by the parameter `k`.
    fn change(
        &mut self,
        start: &StartOf<'_>,
        run: &MechanismIntegrator,
        design: &dyn Design,
        k: usize,
    ) -> Result<Vec<f64>, Singular> {
        let (n, m) = (start.at.q.len(), start.mechanism.len());
        let [mut minus, mut plus] = [vec![0.0; n], vec![0.0; n]];
        let mut rows = vec![0.0; m];
        design.add_tangent(
            k,
            Place::Step(&self.about),
            &self.impulse,
            &mut minus,
            &mut plus,
            &mut rows,
        );
        if let Some(z) = self.states(run, design, k)? {
            let into = &mut Product { v: &z, out: &mut minus };
            run.system().internal_slope(&self.about, Slot::First, into);
        }
        let mut x: Vec<f64> = minus.iter().map(|b| -b).collect();
        rows.fill(0.0);
        design.add_tangent(
            k,
            Place::Step(&self.until),
            &self.impulse,
            &mut minus,
            &mut plus,
            &mut rows,
        );
        rows.iter_mut().for_each(|row| *row = -*row);
        x.resize(n + start.rows.len(), 0.0);
        start.rows.gather(&rows, &mut x[n..]);
        self.saddle.solve_factorized(&mut x)?;
        x.truncate(n);
        Ok(x)
    }
    /// `z_θ` of the states of signals where they rest, shape of all internal variables; `None`
    /// where their rates do not change.
    fn states(
        &self,
        run: &MechanismIntegrator,
        design: &dyn Design,
        k: usize,
    ) -> Result<Option<Vec<f64>>, Singular> {
        let mut rates = vec![0.0; self.about.internal.len()];
        design.add_rates(k, Place::Gauss(&self.about, 1.0), &mut rates);
        if rates.iter().all(|rate| *rate == 0.0) {
            return Ok(None);
        }
        let at = Configuration { internal: &self.about.internal, ..run.state().configuration() };
        resting_change(run, at, &vec![0.0; at.q.len()], rates).map(Some)
    }
}

/// `−φ_z⁻¹ (φ_q δq + φ_θ)` of the states of signals at rest, shape of all internal variables; `φ_θ`
/// of the same shape.
///
/// # Errors
/// [`Singular`] where they rest nowhere, as an integral does.
pub(crate) fn resting_change(
    run: &MechanismIntegrator,
    at: Configuration<'_>,
    dq: &[f64],
    by_parameter: Vec<f64>,
) -> Result<Vec<f64>, Singular> {
    let mut change = by_parameter;
    let still = vec![0.0; at.q.len()];
    let Some(found) = run.system().state_rates(at.moving(&still)) else { return Ok(change) };
    let signals = run.system().places_of_signals();
    let is_signal = |row: &usize| signals.contains(&found.places[*row]);
    let rows: Vec<usize> = (0..found.places.len()).filter(is_signal).collect();
    let by_state = found.by_state.select_rows(&rows).select_columns(&rows);
    let moved = &found.by_position * DVector::from_column_slice(dq);
    let own = |row: usize, _| -(moved[rows[row]] + change[found.places[rows[row]]]);
    let own = DVector::from_fn(rows.len(), own);
    let own = by_state.lu().solve(&own).ok_or(Singular)?;
    change.fill(0.0);
    rows.iter().zip(&own).for_each(|(row, own)| change[found.places[*row]] = *own);
    Ok(change)
}
