//! The system of a mechanism with beams: mass, elastic energy by its rule, material damping,
//! dissipation.

use crate::averaged::{AveragedStrains, MASS_SCALING};
use crate::damping::{self, StrainDamping};
use crate::dissipation::{self, MASS, StrainDissipation};
use crate::frequency::slowness;
use crate::model::{BeamElements, StrainRule};
use vi_core::force::{Force, MidpointForce, NoTimeSlope};
use vi_core::{Entries, Motion, Quadrature, SeparableSystem};
use vi_multibody::mechanism::Mechanism;
use vi_rigid::load::Load;
use vi_rigid::time_history::TimeHistory;

impl BeamElements {
    /// The system: mass of bodies and elements, gravity (midpoint), elastic energy, material
    /// damping.
    #[must_use]
    pub fn system(&self, mechanism: &Mechanism, rule: StrainRule) -> SeparableSystem {
        self.system_by(mechanism, rule, Quadrature::Midpoint)
    }

    /// The same with a quadrature rule for gravity, for what is added to the system, and for
    /// [`StrainRule::Midpoint`] in the place of the midpoint.
    #[must_use]
    pub fn system_by(
        &self,
        mechanism: &Mechanism,
        rule: StrainRule,
        quadrature: Quadrature,
    ) -> SeparableSystem {
        let mut system = mechanism.system_with_mass(self.mass_matrix(mechanism), quadrature);
        let slowness = match rule {
            StrainRule::MassScaled | StrainRule::Dissipative => {
                Some(slowness(self, &mechanism.initial_configuration()))
            }
            StrainRule::Averaged | StrainRule::Midpoint => None,
        };
        if let Some(damping) = StrainDamping::new(&self.elements) {
            let damping = match slowness.clone() {
                Some(slowness) => damping.with_slowness(slowness),
                None => damping,
            };
            system = system.force_of(damping::SOURCE, Box::new(damping));
        }
        let count = self.elements.list().len();
        if rule == StrainRule::Dissipative && count > 0 {
            let dissipation = StrainDissipation::new(self);
            system = system.force_of(dissipation::SOURCE, Box::new(dissipation));
        }
        match rule {
            _ if count == 0 => system,
            StrainRule::Midpoint => system.potential(self.elements.clone()),
            _ => system.discrete_potential(Box::new(self.averaged_by(rule, slowness))),
        }
    }

    /// The averaged strains of a rule, with elements that are free of stress in the configuration
    /// `q`.
    pub(crate) fn averaged(&self, rule: StrainRule, q: &[f64]) -> AveragedStrains {
        let scaled = rule == StrainRule::MassScaled;
        self.averaged_by(rule, scaled.then(|| slowness(self, q)))
    }

    fn averaged_by(&self, rule: StrainRule, slowness: Option<Vec<f64>>) -> AveragedStrains {
        let (elements, none) = (self.elements.clone(), vec![0.0; self.elements.list().len()]);
        let (mu, slowness) = match (rule, slowness) {
            (StrainRule::MassScaled, Some(slowness)) => (MASS_SCALING, slowness),
            (StrainRule::Dissipative, _) => (MASS, none),
            _ => (0.0, none),
        };
        let averaged = AveragedStrains::mass_scaled(elements, mu, slowness);
        let averaged = averaged.with_mass_of(self.whole);
        match rule {
            StrainRule::MassScaled | StrainRule::Dissipative => {
                averaged.with_following_tension_mass(&self.tension)
            }
            StrainRule::Averaged | StrainRule::Midpoint => averaged,
        }
    }

    /// The system at rest: elastic energy, and loads and weight that grow in proportion to the time
    /// of statics, whatever the histories of the loads.
    #[must_use]
    pub fn static_system(&self, mechanism: &Mechanism, loads: Vec<Load>) -> SeparableSystem {
        let mass = self.mass_matrix(mechanism);
        let weight = mechanism.weight(&mass);
        let mut system = SeparableSystem::new(mass)
            .potential(self.elements.clone())
            .force(Box::new(MidpointForce(GrowingForce { direction: weight })));
        for load in loads {
            let history = TimeHistory::Linear { slope: 1.0 };
            let grown = load.with_history(history).expect("a slope of 1 is finite");
            system = system.force(Box::new(grown));
        }
        system
    }
}

/// `f = t w` with a constant generalized force `w`.
struct GrowingForce {
    direction: Vec<f64>, // n  w
}

impl Force for GrowingForce {
    fn add(&self, Motion { t, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        for (out, w) in out.iter_mut().zip(&self.direction) {
            *out += scale * t * w;
        }
    }
    fn add_position_derivative(&self, _at: Motion<'_>, _scale: f64, _out: &mut dyn Entries) {}
    fn add_velocity_derivative(&self, _at: Motion<'_>, _scale: f64, _out: &mut dyn Entries) {}
    fn add_time_derivative(
        &self,
        _at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        out.iter_mut().zip(&self.direction).for_each(|(out, w)| *out += scale * w);
        Ok(())
    }
    fn is_dissipative(&self) -> bool {
        false
    }
}
