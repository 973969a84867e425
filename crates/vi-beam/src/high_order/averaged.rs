//! The averaged-strain discrete potential of elements of higher order.

use super::{HighOrderElements, IntegrationPoint, Strain};
use crate::averaged::scaling;
use crate::strained::Strained;
use vi_core::Configuration;
use vi_core::interpolation::StrainInterpolation;
use vi_core::interval::Interval;
use vi_core::potential::{DiscretePotential, Potential};
use vi_core::sparse::Entries;
use vi_core::strain_energy::StrainEnergy;

/// `U_d` and `K_d` of [`HighOrderElements`]; see [`crate::averaged`].
#[derive(Clone, Debug)]
pub struct AveragedHighOrder {
    elements: HighOrderElements,
    most: f64,          // largest μ
    slowness: Vec<f64>, // stations  1/ω² of their element, s²
}

/// `ε̄` and `Δε`.
fn mean_and_change(station: &IntegrationPoint, s: &Interval) -> (Strain, Strain) {
    let (start, end) = (station.strain(&s.q0), station.strain(&s.q1));
    (0.5 * (start + end), end - start)
}

impl AveragedHighOrder {
    /// Averaged strains, `μ = 0`.
    #[must_use]
    pub fn new(elements: HighOrderElements) -> Self {
        Self { elements, most: 0.0, slowness: Vec::new() }
    }

    /// Averaged strains with selective mass scaling, as
    /// [`crate::averaged::AveragedStrains::mass_scaled`].
    ///
    /// # Panics
    /// When there is not one number for each element.
    #[must_use]
    pub fn mass_scaled(elements: HighOrderElements, most: f64, slowness: &[f64]) -> Self {
        assert_eq!(elements.elements.len(), slowness.len(), "one frequency for each element");
        let stations = elements.elements.iter().zip(slowness);
        let slowness =
            stations.flat_map(|(member, own)| vec![*own; member.stations.len()]).collect();
        Self { elements, most, slowness }
    }

    /// All Gauss points.
    pub(crate) fn each(&self, visit: &mut dyn FnMut(&dyn Strained)) {
        self.elements.each(&mut |_, station| visit(station));
    }

    /// Stations with their `μ` in a step `h`.
    fn scaled(&self, h: f64) -> impl Iterator<Item = (&IntegrationPoint, f64)> {
        let mu =
            move |k: usize| self.slowness.get(k).map_or(0.0, |own| scaling(self.most, *own, h));
        self.elements.stations.iter().enumerate().map(move |(k, station)| (station, mu(k)))
    }

    fn add_slot(&self, s: &Interval, q: &[f64], sign: f64, scale: f64, out: &mut [f64]) {
        for (station, mu) in self.scaled(s.h) {
            let (mean, change) = mean_and_change(station, s);
            let n = station.stiffness() * (0.5 * mean + sign * mu * change);
            station.add(q, &(scale * station.weight * n), out);
        }
    }
}

fn energy(station: &IntegrationPoint, strain: &Strain) -> f64 {
    0.5 * station.weight * (station.stiffness() * strain).dot(strain)
}

/// The discrete derivative `D̄V = D_1 U_d + D_2 U_d` of energy–momentum schemes.
impl AveragedHighOrder {
    /// `out ← out + scale Σ_g w_g Σ_i C_i ε̄_i 𝔹_i x_{n+1/2}`.
    pub fn add_discrete_derivative(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        for station in &self.elements.stations {
            let (mean, _) = mean_and_change(station, s);
            let n = station.stiffness() * mean;
            station.add(&s.q_mid, &(scale * station.weight * n), out);
        }
    }

    /// Emits `scale ½ Σ_g w_g Σ_i C_i [𝔹_i x_{n+1/2} (𝔹_i x_{n+1})ᵀ + ε̄_i 𝔹_i]`, its derivative by
    /// `q_{n+1}`; always the same places in the same order.
    pub fn add_discrete_derivative_d2(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for station in &self.elements.stations {
            let (mean, _) = mean_and_change(station, s);
            let c = 0.5 * scale * station.weight * station.stiffness();
            let pair = [&station.gradients(&s.q_mid), &station.gradients(&s.q1)];
            station.emit(pair, &c, &(c * mean), out);
        }
    }
}

impl DiscretePotential for AveragedHighOrder {
    fn value(&self, s: &Interval) -> f64 {
        let stations = self.elements.stations.iter();
        stations.map(|station| energy(station, &mean_and_change(station, s).0)).sum()
    }

    fn added_kinetic_energy(&self, s: &Interval) -> f64 {
        let added = |(station, mu)| mu * energy(station, &mean_and_change(station, s).1);
        self.scaled(s.h).map(added).sum()
    }

    fn adds_mass(&self) -> bool {
        self.most > 0.0
    }

    fn add_mass(&self, at: Configuration<'_>, h: f64, out: &mut dyn Entries) {
        if self.most > 0.0 {
            for (station, mu) in self.scaled(h) {
                let c = mu * h * h * station.weight * station.stiffness();
                let gradients = station.gradients(at.q);
                station.emit_outer([&gradients; 2], &c, out);
            }
        }
    }

    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.add_slot(s, &s.q0, 1.0, scale, out);
    }

    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.add_slot(s, &s.q1, -1.0, scale, out);
    }

    fn add_d2_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for (station, mu) in self.scaled(s.h) {
            let c = (0.25 + mu) * scale * station.weight * station.stiffness();
            let pair = [&station.gradients(&s.q0), &station.gradients(&s.q1)];
            station.emit_outer(pair, &c, out);
        }
    }

    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for (station, mu) in self.scaled(s.h) {
            let c = scale * station.weight * station.stiffness();
            let (mean, change) = mean_and_change(station, s);
            let n = c * (0.5 * mean + mu * change);
            let gradients = station.gradients(&s.q0);
            station.emit([&gradients; 2], &((0.25 - mu) * c), &n, out);
        }
    }

    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.elements.value(at.q)
    }

    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.elements.add_gradient(at.q, scale, out);
    }

    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.elements.add_hessian(at.q, scale, out);
    }

    fn strain_energy(&self) -> Option<&dyn StrainEnergy> {
        Some(&self.elements)
    }

    fn interpolation(&self) -> Option<&dyn StrainInterpolation> {
        (!self.adds_mass()).then_some(self)
    }
}
