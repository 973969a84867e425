//! What differs between variational and energy–momentum schemes in a run.

use super::work::Work;
use vi_constraints::discretization::{Discretization, Step};
use vi_constraints::{Constraints, Integrator};
use vi_core::SeparableSystem;
use vi_core::force::Source;
use vi_emscheme::{EmIntegrator, EmSystem};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;

/// A family of schemes.
pub(crate) trait Family: Discretization<Mechanism> {
    /// Whether there is a discrete Lagrangian, so that a node has a projected momentum and an `E_d`
    /// of its own.
    const VARIATIONAL: bool;
    /// The work before the first step.
    fn work(run: &Integrator<Self, Mechanism>) -> Work;
    /// What exerts each force, in the order of [`Work`].
    fn sources(&self) -> &[Source];
    /// Adds the work of a (sub-)step.
    fn add_work(&self, mechanism: &Mechanism, step: Step<'_>, work: &mut Work);
    /// `h E_d` of a (sub-)step; 0 without a discrete Lagrangian.
    fn action_rate(&self, step: Step<'_>) -> f64;
    /// The integrator, of a variational scheme.
    fn variational(run: &mut Integrator<Self, Mechanism>) -> Option<&mut MechanismIntegrator>;
    /// The integrator, of an energy–momentum scheme.
    fn energy_momentum(
        run: &mut Integrator<Self, Mechanism>,
    ) -> Option<&mut EmIntegrator<Mechanism>>;
}

impl Family for SeparableSystem {
    const VARIATIONAL: bool = true;

    fn work(run: &MechanismIntegrator) -> Work {
        let driven = run.constraints().is_rheonomic();
        let start = (&run.state().p[..], run.initial_velocity());
        Work::new(start, run.system().sources().len(), (driven, run.reads_states()))
    }

    fn sources(&self) -> &[Source] {
        self.sources()
    }

    fn add_work(&self, mechanism: &Mechanism, step: Step<'_>, work: &mut Work) {
        work.add(self, mechanism, step);
    }

    fn action_rate(&self, step: Step<'_>) -> f64 {
        step.s.h * step.discrete_energy(self)
    }

    fn variational(run: &mut MechanismIntegrator) -> Option<&mut MechanismIntegrator> {
        Some(run)
    }

    fn energy_momentum(_: &mut MechanismIntegrator) -> Option<&mut EmIntegrator<Mechanism>> {
        None
    }
}

impl Family for EmSystem {
    const VARIATIONAL: bool = false;

    fn work(run: &EmIntegrator<Mechanism>) -> Work {
        // the multipliers of the step are at hand
        let start = (&run.state().q[..], &run.state().v[..]);
        Work::new(start, run.system().sources().len(), (false, false))
    }

    fn sources(&self) -> &[Source] {
        self.sources()
    }

    fn add_work(
        &self,
        mechanism: &Mechanism,
        Step { s, multipliers, .. }: Step<'_>,
        work: &mut Work,
    ) {
        self.add_work(s, &mut work.force, &mut work.parts);
        if mechanism.is_rheonomic() {
            // prescribed motions do h λ·∂g/∂t, with μ = h²λ
            work.rates.resize(multipliers.len(), 0.0);
            mechanism.time_derivative(s.t_mid(), &s.q_mid, &mut work.rates);
            let power: f64 = multipliers.iter().zip(&work.rates).map(|(mu, rate)| mu * rate).sum();
            work.add_motions(power / s.h);
        }
    }

    fn action_rate(&self, _: Step<'_>) -> f64 {
        0.0
    }

    fn variational(_: &mut EmIntegrator<Mechanism>) -> Option<&mut MechanismIntegrator> {
        None
    }

    fn energy_momentum(run: &mut EmIntegrator<Mechanism>) -> Option<&mut EmIntegrator<Mechanism>> {
        Some(run)
    }
}
