//! What a step makes of a rotation: the method of the settings on one body on a fixed axle, without
//! torque.
//!
//! ```text
//! order 2          θ = arcsin(hω),         θ/(hω) − 1 = (hω)²/6 + …,    taken below hω = 1
//! compositions     θ = Σ_i arcsin(γ_i hω)
//! energy–momentum  θ = Σ_i 2 arctan(γ_i hω/2)
//! ```
//! Momenta of a step are those of chords, `p = J sin(θ)/h`, and `p = Jω` is what is conserved.
//! Rather than by formulas, which Galerkin schemes have not, the angle is found by a step.

use holonom_model::{Family, Settings};
use std::f64::consts::{PI, TAU};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::Quadrature;
use vi_emscheme::{EmAlgebra, EmOptions, EmSystem};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::pair::PairKind;
use vi_multibody::pair::joint::FrameId;
use vi_multibody::run::{Solver, integrator};

/// Orders that may cure a phase error.
const ORDERS: [u32; 3] = [4, 6, 8];
/// A phase error that is none.
const CURED: f64 = 1e-4;
/// Round-off of an angle, rad.
const ROUND_OFF: f64 = 1e-14;
/// What two digits of a step may be rounded up by.
pub(crate) const ROUNDED: f64 = 0.95;
/// Bisections of the largest angle.
const BISECTIONS: u32 = 20;

/// The angle (rad) by which a step turns a body that turns by `angle` in its time; `None` where the
/// step is not found.
pub(crate) fn turned(settings: &Settings, angle: f64) -> Option<f64> {
    let mut builder = MechanismBuilder::new();
    let rotor = builder.body("rotor", Inertia::principal(1.0, [1.0; 3])).at([0.0; 3]);
    let rotor = rotor.angular_velocity([0.0, 0.0, angle]).id();
    builder
        .joint("axle", PairKind::Revolute, FrameId::Ground, rotor)
        .at([0.0; 3])
        .axis([0.0, 0.0, 1.0]);
    let mechanism = builder.build().ok()?.mechanism;
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let at = InitialValues::new(0.0, &q, &v);
    let end = match settings.scheme.family() {
        Family::Variational(_) => {
            let mut options = Options::new(SchemeKind::Nodal, 1.0);
            options.method = settings.method();
            let system = mechanism.system(Quadrature::Midpoint);
            let mut run = integrator(mechanism, system, options, Solver::Auto, at).ok()?;
            run.step().ok()?;
            run.state().q.clone()
        }
        Family::EnergyMomentum(form) => {
            let options = EmOptions::new(form, 1.0).composition(settings.composition());
            let (system, algebra) = (EmSystem::of_mechanism(&mechanism), EmAlgebra::default());
            let run = vi_emscheme::run::integrator_at(system, mechanism, options, algebra, at);
            let mut run = run.ok()?;
            run.step().ok()?;
            run.state().q.clone()
        }
        Family::Static => return None,
    };
    let principal = libm::atan2(end[4], end[3]); // d_1
    Some(principal + TAU * ((angle - principal) / TAU).round())
}

/// `θ/(hω) − 1` of a rotation by `hω = angle` in a step; 0 where it is round-off.
pub(crate) fn phase_error(settings: &Settings, angle: f64) -> Option<f64> {
    let error = turned(settings, angle)? / angle - 1.0;
    Some(if error.abs() < ROUND_OFF / angle { 0.0 } else { error })
}

/// The lowest order whose phase error is none, with that error.
pub(crate) fn cure(settings: &Settings, angle: f64) -> Option<(u32, f64)> {
    let higher = ORDERS.into_iter().filter(|order| *order > settings.order);
    let mut errors = higher.filter_map(|order| {
        let settings = Settings { order, ..settings.clone() };
        Some((order, phase_error(&settings, angle)?.abs()))
    });
    errors.find(|(_, error)| *error < CURED)
}

/// The largest angle (rad) by which a body may turn in a step, half a turn at most.
pub(crate) fn largest_angle(settings: &Settings) -> f64 {
    let (mut taken, mut refused) = (0.0, PI);
    for _ in 0..BISECTIONS {
        let angle = 0.5 * (taken + refused);
        match turned(settings, angle) {
            Some(_) => taken = angle,
            None => refused = angle,
        }
    }
    taken
}

/// The step (s) at which the phase error of a rotation at `rate` (rad/s) is below `error`.
pub(crate) fn step_of_error(settings: &Settings, rate: f64, error: f64) -> f64 {
    let mut step = settings.step;
    while step > 0.0 && phase_error(settings, step * rate).is_none_or(|found| found.abs() > error) {
        step *= 0.8;
    }
    ROUNDED * step
}

#[cfg(test)]
mod tests {
    use super::*;
    use holonom_model::{HighOrder, Scheme};

    fn settings(scheme: Scheme, order: u32, method: HighOrder) -> Settings {
        Settings { scheme, order, method, ..Settings::new(0.01, 1.0) }
    }

    #[test]
    fn a_step_turns_a_rotor_by_the_angle_of_its_family() {
        for angle in [0.1, 0.3, 0.6, 0.9] {
            for order in [2, 4, 6, 8] {
                let settings = settings(Scheme::Nodal, order, HighOrder::Composition);
                let gammas = settings.composition().gammas();
                let exact: f64 = gammas.iter().map(|g| (g * angle).asin()).sum();
                let found = turned(&settings, angle).unwrap();
                println!("order {order}, {angle}: {found}, phase {:.1e}", found / angle - 1.0);
                assert!((found - exact).abs() < 1e-12, "{order} {angle}: {found} {exact}");
                let em = Settings { scheme: Scheme::EmNodal, ..settings };
                let parts = if order > 2 { 2.0 } else { 1.0 }; // compositions are of pairs of steps
                let half = |g: &f64| 0.5 * g * angle / parts;
                let exact: f64 = gammas.iter().map(|g| 2.0 * parts * half(g).atan()).sum();
                let found = turned(&em, angle).unwrap();
                assert!((found - exact).abs() < 1e-12, "em {order} {angle}: {found} {exact}");
            }
            for order in [4, 6, 8] {
                let settings = settings(Scheme::Nodal, order, HighOrder::Galerkin);
                let error = phase_error(&settings, angle).unwrap().abs();
                println!("Galerkin, order {order}, {angle}: {error:.1e}");
                assert!(error < 0.5 * (0.5 * angle).powi(order as i32) + 1e-14, "{error:e}");
            }
        }
    }

    #[test]
    fn order_two_turns_no_body_by_a_radian() {
        let two = largest_angle(&settings(Scheme::Nodal, 2, HighOrder::Composition));
        let em = largest_angle(&settings(Scheme::EmNodal, 2, HighOrder::Composition));
        println!("order 2: {two}, energy–momentum: {em}");
        assert!((two - 1.0).abs() < 1e-5 && em > 3.0);
    }

    #[test]
    fn order_six_cures_what_order_two_makes_of_0_6_rad() {
        let two = settings(Scheme::Nodal, 2, HighOrder::Composition);
        assert!((phase_error(&two, 0.6).unwrap() - (0.6_f64.asin() / 0.6 - 1.0)).abs() < 1e-12);
        let (order, error) = cure(&two, 0.6).unwrap();
        assert!(order == 6 && error < 1e-6, "{order} {error:e}");
        let step = step_of_error(&two, 60.0, 1e-3);
        assert!(step < 0.0775 / 60.0 && step > 0.75 * 0.0775 / 60.0, "{step}");
    }
}
