//! A model file as a [`Subject`].

use holonom_model::{Model, ModelError, Settings};
use holonom_sim::system::joint_contact::nonsmooth_options;
use holonom_sim::system::{self, System};
use vi_constraints::{InitialValues, Options, OrderMethod as Order, SchemeKind};
use vi_core::Composition;
use vi_core::galerkin::Stages;
use vi_emscheme::{EmAlgebra, EmOptions};
use vi_multibody::Mechanism;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator, with_contacts};
use vi_verify::running::RunningSystem;
use vi_verify::subject::{Initial, RunningMotion, SchemeSetting, SteppingMethod, Subject};

/// A node at which a model moves.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MovingNode {
    /// Its time, s.
    pub t: f64,
    /// `q`.
    pub q: Vec<f64>,
    /// The velocity there, which meets the constraints.
    pub v: Vec<f64>,
}

/// A model whose method and step are chosen by the measurements.
#[derive(Debug)]
pub struct ModelSubject {
    model: Model,
    start: Option<MovingNode>, // where not its initial values
}

impl ModelSubject {
    /// Of a validated model.
    #[must_use]
    pub fn new(model: Model) -> Self {
        Self { model, start: None }
    }

    /// Lets it start from a node of its motion instead of its initial values.
    pub(super) fn start_at(&mut self, start: MovingNode) {
        self.start = Some(start);
    }

    /// The values that it starts from.
    fn own(&self, mechanism: &Mechanism) -> MovingNode {
        self.start.clone().unwrap_or_else(|| MovingNode {
            t: 0.0,
            q: mechanism.initial_configuration(),
            v: mechanism.initial_velocity(),
        })
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    fn build(&self) -> Result<(System, &Settings), String> {
        let built = system::build(&self.model).map_err(|e: ModelError| e.to_string())?;
        if let Some(column) = built.sensors.read_by_signals().next() {
            return Err(format!(
                "a signal reads `{column}`, which runs measure from node to node: there is no map of a step alone"
            ));
        }
        Ok((built, &self.model.settings))
    }

    /// Its integrator by a variational scheme, from its own initial values or others.
    ///
    /// # Errors
    /// Why the scheme does not apply, in words.
    pub fn integrator(
        &self,
        kind: SchemeKind,
        setting: SchemeSetting,
        at: Option<Initial<'_>>,
    ) -> Result<MechanismIntegrator, String> {
        let (System { mechanism, dynamics, .. }, settings) = self.build()?;
        let own = self.own(&mechanism);
        let (q, v) = at.unwrap_or((&own.q, &own.v));
        let mut options = Options::new(kind, setting.step);
        options.method = match (setting.method, Stages::of_order(setting.order)) {
            (SteppingMethod::Galerkin(_), Some(stages)) => Order::Galerkin(stages),
            _ => Order::Composition(Composition::of_order(setting.order).unwrap_or_default()),
        };
        options.newton = settings.newton();
        let solver = if setting.dense { Solver::Dense } else { settings.solver.into() };
        let at = InitialValues::new(own.t, q, v);
        let system = dynamics.variational(&mechanism);
        integrator(mechanism, system, options, solver, at)
            .and_then(|run| {
                let contacts = dynamics.forces.contacts.clone();
                with_contacts(run, kind, contacts, nonsmooth_options(settings))
            })
            .map_err(|e| e.to_string())
    }
}

impl Subject for ModelSubject {
    fn start_from(
        &self,
        setting: SchemeSetting,
        at: Option<Initial<'_>>,
    ) -> Result<Box<dyn RunningMotion>, String> {
        match setting.method {
            SteppingMethod::Variational(kind) => {
                Ok(Box::new(RunningSystem::variational(self.integrator(kind, setting, at)?)))
            }
            SteppingMethod::Galerkin(form) => Ok(Box::new(RunningSystem::variational(
                self.integrator(form.kind(), setting, at)?,
            ))),
            SteppingMethod::EnergyMomentum(form) => {
                let (System { mechanism, dynamics, .. }, settings) = self.build()?;
                let own = self.own(&mechanism);
                let (q, v) = at.unwrap_or((&own.q, &own.v));
                let composition = Composition::of_order(setting.order).unwrap_or_default();
                let mut options = EmOptions::new(form, setting.step).composition(composition);
                options.newton = settings.newton();
                let solver = if setting.dense { Solver::Dense } else { settings.solver.into() };
                let algebra = EmAlgebra { solver, ..EmAlgebra::default() };
                let (system, at) =
                    (dynamics.energy_momentum(&mechanism), InitialValues::new(own.t, q, v));
                // to evaluate the equations of motion
                let forces = dynamics.variational(&mechanism);
                let run = vi_emscheme::run::integrator_at(system, mechanism, options, algebra, at)
                    .map_err(|e| e.to_string())?;
                Ok(Box::new(RunningSystem::energy_momentum(run, forces)))
            }
        }
    }
}
