//! The averaged-strain discrete potential of elements of higher order.

use super::{HighOrderElements, Station, Strain};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::potential::{DiscretePotential, Potential};
use vi_core::sparse::Entries;

/// The averaged-strain discrete potential of [`HighOrderElements`]; see [`crate::averaged`].
#[derive(Clone, Debug)]
pub struct AveragedHighOrder(pub HighOrderElements);

impl AveragedHighOrder {
    fn add_slot(&self, s: &Interval, q: &[f64], scale: f64, out: &mut [f64]) {
        for station in &self.0.stations {
            let mean = 0.5 * (station.strain(&s.q0) + station.strain(&s.q1));
            let n = station.stiffness().component_mul(&mean);
            station.add(q, &(0.5 * scale * station.weight * n), out);
        }
    }
}

/// The discrete derivative `D̄V = D_1 U_d + D_2 U_d` of energy–momentum schemes.
impl AveragedHighOrder {
    /// `out ← out + scale Σ_g w_g Σ_i C_i ε̄_i 𝔹_i x_{n+1/2}`.
    pub fn add_discrete_derivative(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.add_slot(s, &s.q_mid, 2.0 * scale, out);
    }

    /// Emits `scale ½ Σ_g w_g Σ_i C_i [𝔹_i x_{n+1/2} (𝔹_i x_{n+1})ᵀ + ε̄_i 𝔹_i]`, its derivative by
    /// `q_{n+1}`; always the same places in the same order.
    pub fn add_discrete_derivative_d2(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for station in &self.0.stations {
            let mean = 0.5 * (station.strain(&s.q0) + station.strain(&s.q1));
            let c = 0.5 * scale * station.weight * station.stiffness();
            let pair = (&station.gradients(&s.q_mid), &station.gradients(&s.q1));
            station.emit(pair, &c, &c.component_mul(&mean), out);
        }
    }
}

impl DiscretePotential for AveragedHighOrder {
    fn value(&self, s: &Interval) -> f64 {
        let energy = |station: &Station| {
            let eps = 0.5 * (station.strain(&s.q0) + station.strain(&s.q1));
            0.5 * station.weight * station.stiffness().component_mul(&eps).dot(&eps)
        };
        self.0.stations.iter().map(energy).sum()
    }

    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.add_slot(s, &s.q0, scale, out);
    }

    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.add_slot(s, &s.q1, scale, out);
    }

    fn add_d2_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for station in &self.0.stations {
            let c = 0.25 * scale * station.weight * station.stiffness();
            let pair = (&station.gradients(&s.q0), &station.gradients(&s.q1));
            station.emit(pair, &c, &Strain::zeros(), out);
        }
    }

    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for station in &self.0.stations {
            let mean = 0.5 * (station.strain(&s.q0) + station.strain(&s.q1));
            let c = 0.5 * scale * station.weight * station.stiffness();
            let gradients = station.gradients(&s.q0);
            station.emit((&gradients, &gradients), &(0.5 * c), &c.component_mul(&mean), out);
        }
    }

    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.0.value(at.q)
    }

    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(at.q, scale, out);
    }

    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.0.add_hessian(at.q, scale, out);
    }
}
