//! Whether the step resolves the fastest motion of a model: `h ω_max`.
//!
//! ```text
//! K x = ω² M x  at the start,   K = ∇²V + Σ λ_i D²g_i  with the constraint forces there          [`vi_constraints::fastest_motion`]
//! ```
//! Potentials act at midpoints: a stiff spring is not resolved, but does no harm. Constraint forces
//! act at nodes: of the vibrations of taut links, by `Σ λ_i D²g_i` alone, the variational schemes
//! of order 2 follow those with `h ω < 2`, and fail where there are faster ones. Energy–momentum
//! schemes do not.

pub(crate) mod limits;
pub(crate) mod rotation;
pub(crate) mod rotation_stability;
pub(crate) mod rotor;
pub(crate) mod stiff_laws;
pub(crate) mod unstable_steps;

use crate::digits::rounded;
use crate::resolution::rotation::FastestRotation;
use crate::resolution::rotor::ROUNDED;
use crate::system;
use holonom_model::{Family, Model, Settings};
use serde::{Deserialize, Serialize};
use vi_constraints::fastest_motion::FastestMotion;
use vi_constraints::{Constraints, InitialValues, Options, SchemeKind};
use vi_core::galerkin::Stages;
use vi_core::{Configuration, Entries, MechanicalSystem, SeparableSystem};
use vi_multibody::mechanism::{BarEnd, Description};
use vi_multibody::run::{MechanismIntegrator, integrator};

/// `h ω` above which a vibration is not resolved; in a Galerkin scheme of order `2s`: above `s`
/// times this.
pub(crate) const RESOLVED: f64 = 1.0;
/// `h ω` of the start from which a run will probably fail.
const WARN: f64 = 1.5;
/// Bars in one point mass beyond which their forces are not found in a memory that is linear in
/// their number.
const BARS: usize = 200;
/// Constraints within a frame.
const INTERNAL: usize = 6;
/// A vibration that is a rotation: `ω` of both differ by less than this part.
const SAME: f64 = 0.1;

/// The largest `h ω` at which a vibration is resolved.
pub(crate) fn resolved_by(settings: &Settings) -> f64 {
    RESOLVED * settings.method().stages().map_or(1, Stages::count) as f64
}

/// The longest sub-step of a composition in parts of the step.
pub(crate) fn longest_part(settings: &Settings) -> f64 {
    settings.method().composition().longest()
}

/// The fastest motion about a configuration against the step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fastest {
    /// The body, beam node or point mass that has most of its energy.
    pub member: String,
    /// `√|ω²|`, rad/s.
    pub omega_max: f64,
    /// `h ω_max`, with the longest sub-step of a composition.
    pub h_omega_max: f64,
}

/// The fastest motions about a configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resolution {
    /// With springs, beams and constraint forces.
    #[serde(flatten)]
    pub all: Fastest,
    /// With constraint forces alone.
    pub by_constraint_forces: Fastest,
    /// Whether springs or beams hold that motion.
    pub held: bool,
}

impl Resolution {
    /// At the present node of an integration of a model with so many `bodies`, fixed ones included.
    /// The constraints within nodes of beams balance elastic forces, and are not counted as
    /// constraint forces.
    ///
    /// # Errors
    /// Why it is not known, in words.
    pub(crate) fn at(
        run: &mut MechanismIntegrator,
        bodies: usize,
        settings: &Settings,
    ) -> Result<Self, String> {
        let description = run.constraints().description();
        if largest_hub(description) > BARS {
            return Err(format!("more than {BARS} bars meet in one point mass"));
        }
        let frames = description.bodies.len();
        let of_nodes = INTERNAL * bodies..INTERNAL * frames;
        let stiffness = |system: &SeparableSystem, at: Configuration<'_>, out: &mut dyn Entries| {
            system.stiffness(at.moving(&vec![0.0; at.q.len()]), out);
        };
        let found = run.fastest_motions(&stiffness, &|row| !of_nodes.contains(&row));
        let found = found
            .map_err(|_| "the constraints or the mass matrix are singular there".to_owned())?;
        let [all, by_constraint_forces] =
            [found.all, found.by_constraint_forces].map(|found| fastest(&found, run, settings));
        Ok(Self { all, by_constraint_forces, held: found.held })
    }

    /// Whether there are vibrations by constraint forces that the scheme has to resolve, with `h ω`
    /// above `limit`.
    pub(crate) fn is_beyond(&self, limit: f64, settings: &Settings) -> bool {
        let variational = matches!(settings.scheme.family(), Family::Variational(_));
        variational
            && !self.held
            && self.by_constraint_forces.h_omega_max > limit * resolved_by(settings)
    }

    /// The warning of vibrations that the scheme does not follow, unless they are the `rotation`.
    pub(crate) fn warning(
        &self,
        settings: &Settings,
        rotation: Option<&FastestRotation>,
        impulses: bool,
    ) -> Option<String> {
        let Fastest { member, omega_max, h_omega_max } = &self.by_constraint_forces;
        let turns = rotation.is_some_and(|own| omega_max - own.rate < SAME * own.rate);
        (!turns && self.is_beyond(WARN, settings)).then(|| {
            format!(
                "h ω_max = {} (ω_max = {} rad/s, `{member}`, by the forces that joints and bars transmit): a step fails where \
                 h ω is above 2, and these forces may grow; {}",
                rounded(*h_omega_max, 3),
                rounded(*omega_max, 4),
                advice(&self.by_constraint_forces, settings, impulses)
            )
        })
    }

    /// What to do where a step fails, if it is for a vibration, and the step (s) that resolves
    /// that.
    pub(crate) fn remedy(&self, settings: &Settings, impulses: bool) -> Option<(String, f64)> {
        let words = |fastest: &Fastest| {
            let Fastest { member, omega_max, h_omega_max } = fastest;
            format!(
                "the fastest vibration has {} rad/s (h ω = {}, `{member}`)",
                rounded(*omega_max, 4),
                rounded(*h_omega_max, 3)
            )
        };
        if self.is_beyond(RESOLVED, settings) {
            let found = &self.by_constraint_forces;
            let advice = advice(found, settings, impulses);
            let words = words(found);
            let words = format!("{words}, by the forces that joints and bars transmit: {advice}");
            return Some((words, resolving(found, settings)));
        }
        let resolves = settings.method().stages().is_some(); // all vibrations
        (resolves && self.all.h_omega_max > resolved_by(settings)).then(|| {
            let (words, step) = (words(&self.all), resolving(&self.all, settings));
            let words = format!(
                "{words}, and a Galerkin scheme has to resolve it: write a step below {step:.1e} s, or order = 2"
            );
            (words, step)
        })
    }
}

/// The most bars that meet in one point mass.
fn largest_hub(description: &Description) -> usize {
    let mut count = vec![0_usize; description.particles.len()];
    for bar in &description.bars {
        count[bar.to] += 1;
        if let BarEnd::Particle(k) = bar.from {
            count[k] += 1;
        }
    }
    count.into_iter().max().unwrap_or(0)
}

/// The step that resolves a vibration, s.
fn resolving(fastest: &Fastest, settings: &Settings) -> f64 {
    ROUNDED * resolved_by(settings) * settings.step / fastest.h_omega_max
}

/// `impulses`: contacts, stops or dry friction act, which no other scheme takes.
fn advice(fastest: &Fastest, settings: &Settings, impulses: bool) -> String {
    let step = resolving(fastest, settings);
    let or = match impulses {
        true => "",
        false => ", or scheme = \"em-nodal\", which needs not resolve it",
    };
    format!("write a step below {step:.1e} s{or}")
}

fn fastest(found: &FastestMotion, run: &MechanismIntegrator, settings: &Settings) -> Fastest {
    let mechanism = run.constraints();
    let (n, v) = (mechanism.dim(), &found.velocity);
    let mut p = vec![0.0; n];
    run.system().mass().mul_add(1.0, v, &mut p);
    let mut energies: Vec<(&str, f64)> = Vec::new();
    for i in 0..n {
        let name = mechanism.coordinate_name(i);
        match energies.last_mut().filter(|last| last.0 == name) {
            Some((_, energy)) => *energy += p[i] * v[i],
            None => energies.push((name, p[i] * v[i])),
        }
    }
    let member = energies.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or("", |most| most.0);
    let omega_max = found.omega();
    let h_omega_max = settings.step * longest_part(settings) * omega_max;
    Fastest { member: member.to_owned(), omega_max, h_omega_max }
}

/// A variational integrator of a model, for what is read at the start of an energy–momentum one.
pub(crate) fn probe(model: &Model, at: InitialValues<'_>) -> Option<MechanismIntegrator> {
    let system = system::build(model).ok()?;
    let options = Options::new(SchemeKind::Nodal, model.settings.step);
    let own = system.dynamics.variational(&system.mechanism);
    integrator(system.mechanism, own, options, model.settings.solver.into(), at).ok()
}
