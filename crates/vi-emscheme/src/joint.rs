//! Springs, dampers and motors on joint coordinates.
//!
//! ```text
//! spring ½ k (θ − θ_0)²    D̄V = k (θ̄ − θ_0) D̄θ              k (θ̄ − θ_0) Δθ = ΔV exactly
//! law τ(t, θ, θ̇)           f̄  = τ(t_{n+1/2}, θ̄, Δθ/h) D̄θ      the work done is τ Δθ exactly
//! ```
//! A damper takes out `c (Δθ)²/h`; nothing here changes a momentum ([`crate::coordinate`]).

use crate::coordinate;
use crate::discrete_gradient::DiscreteGradient;
use crate::load::MidpointLoad;
use vi_core::force::DiscreteForce;
use vi_core::interval::Interval;
use vi_core::potential::DiscretePotential;
use vi_core::sparse::Entries;
use vi_core::{Configuration, Motion};
use vi_multibody::joint_coordinate::CoordinateChange;
use vi_multibody::joint_force::{EffortSlopes, JointForce, JointLaw, JointSpring};

impl DiscreteGradient for JointSpring {
    fn potential(&self, at: Configuration<'_>) -> f64 {
        DiscretePotential::potential(self, at)
    }

    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        DiscretePotential::add_gradient(self, at, scale, out);
    }

    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        let stretch = self.coordinate.change(s).mean - self.rest;
        coordinate::add_slope(&self.coordinate, s, scale * self.stiffness * stretch, out);
    }

    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        let stretch = self.coordinate.change(s).mean - self.rest;
        coordinate::emit_product(&self.coordinate, s, 0.5 * scale * self.stiffness, out);
        let force = scale * self.stiffness * stretch;
        coordinate::emit_derivative(&self.coordinate, s, force, out);
    }
}

impl<L: JointLaw> MidpointLoad for JointForce<L> {
    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        let effort = self.law.effort(s.t_mid(), mean, difference / s.h);
        coordinate::add_slope(&self.coordinate, s, scale * effort, out);
    }

    fn work(&self, s: &Interval, _scratch: &mut [f64]) -> f64 {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        self.law.effort(s.t_mid(), mean, difference / s.h) * difference // D̄θ·Δq = Δθ
    }

    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        let CoordinateChange { mean, difference } = self.coordinate.change(s);
        let (t, rate) = (s.t_mid(), difference / s.h);
        let EffortSlopes { by_coordinate, by_rate } = self.law.slopes(t, mean, rate);
        let slope = 0.5 * by_coordinate + by_rate / s.h;
        coordinate::emit_product(&self.coordinate, s, scale * slope, out);
        let effort = self.law.effort(t, mean, rate);
        coordinate::emit_derivative(&self.coordinate, s, scale * effort, out);
    }

    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        DiscreteForce::add_continuous(self, at, out);
    }

    fn is_dissipative(&self) -> bool {
        self.law.is_dissipative()
    }
}
