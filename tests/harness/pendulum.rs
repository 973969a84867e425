//! Cases of kind `pendulum2d`: the planar pendulum as a point mass on a bar.

use super::case::{Deviation, Runs, Tolerance};
use super::legendre::{self, Reference};
use serde::Deserialize;
use vi_constraints::node::Node;
use vi_constraints::{InitialValues, Integrator, Options, SchemeKind};
use vi_core::{Quadrature, SeparableSystem, State};
use vi_emscheme::{EmForm, EmSystem};
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::tree_map::TreeMap;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PendulumCase {
    name: String,
    #[serde(rename = "kind")]
    _kind: String,
    #[serde(rename = "description")]
    _description: String,
    #[serde(rename = "units")]
    _units: String,
    length: f64,
    mass: f64,
    gravity: [f64; 2],
    q0: [f64; 2],
    v0: [f64; 2],
    scheme: String,
    h: f64,
    steps: u64,
    output_steps: Vec<u64>,
    tolerance: Tolerance,
    #[serde(rename = "continuous_tolerance")]
    _continuous_tolerance: Option<f64>,
    #[serde(default, rename = "continuous")]
    _continuous: Vec<serde_json::Value>,
    #[serde(rename = "statistics")]
    _statistics: Option<serde_json::Value>,
    outputs: Vec<Output>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Output {
    step: u64,
    #[serde(rename = "t")]
    _t: f64,
    q: [f64; 2],
    p: [f64; 2],
    constraint_force: Option<[f64; 2]>,
    lambda: Option<f64>,
    #[serde(rename = "E_d")]
    e_d: Option<f64>,
    #[serde(rename = "H_d")]
    h_d: Option<f64>,
    #[serde(rename = "H_dQ")]
    h_dq: Option<f64>,
    #[serde(rename = "H")]
    h: Option<f64>,
    lambda_mid: Option<f64>,
}

impl PendulumCase {
    pub fn mechanism(&self) -> Mechanism {
        let plane = |x: [f64; 2]| [x[0], x[1], 0.0];
        let mut builder = MechanismBuilder::planar().gravity(plane(self.gravity));
        let bob = builder.particle("bob", self.mass, plane(self.q0), plane(self.v0));
        builder.bar_of_length("rod", [0.0; 3], bob, self.length);
        builder.build().expect("a pendulum").mechanism
    }

    pub fn run(&self) -> Result<Runs, String> {
        match self.scheme.as_str() {
            "variational" => SchemeKind::ALL
                .into_iter()
                .map(|kind| Ok((kind.name(), self.variational(kind)?)))
                .collect(),
            "em" => super::em::forms(&self.mechanism())
                .iter()
                .map(|form| Ok((form.name(), self.energy_momentum(*form)?)))
                .collect(),
            other => Err(format!("unknown scheme `{other}` in {}", self.name)),
        }
    }

    pub fn legendre(&self) -> Option<Result<Deviation, String>> {
        let nodes = self.outputs.first_chunk::<3>().filter(|n| n[2].step == 2)?;
        let (mechanism, mut references) = (self.mechanism(), Vec::new());
        for node in nodes {
            references.push(Reference {
                q: &node.q,
                p: &node.p,
                force: node.constraint_force.as_ref()?,
                lambda: node.lambda,
                e_d: node.e_d?,
                h_d: node.h_d?,
                h_dq: node.h_dq?,
            });
        }
        let references = references.try_into().ok()?;
        let system = mechanism.system(Quadrature::Midpoint);
        Some(legendre::deviation(&system, &mechanism, self.h, &references, &self.tolerance))
    }

    fn energy_momentum(&self, form: EmForm) -> Result<Deviation, String> {
        let mechanism = self.mechanism();
        let system = EmSystem::of_mechanism(&mechanism);
        let mut deviation = Deviation::default();
        let steps = (self.steps, &self.output_steps[..]);
        super::em::drive((system, mechanism), (form, self.h), steps, |step, state, node| {
            let output = self.outputs.iter().find(|o| o.step == step);
            let output = output.ok_or_else(|| format!("no output at step {step}"))?;
            self.compare_em(output, state, node, &mut deviation)
        })?;
        Ok(deviation)
    }

    fn compare_em(
        &self,
        output: &Output,
        state: &State,
        node: &Node,
        deviation: &mut Deviation,
    ) -> Result<(), String> {
        let tolerance = &self.tolerance;
        let missing = |what: &str| format!("output {} lacks {what}", output.step);
        deviation.q(&state.q, &output.q, tolerance);
        deviation.p(&node.p, &output.p, tolerance);
        let lambda = output.lambda_mid.ok_or_else(|| missing("lambda_mid"))?;
        deviation.force(&node.lambda_mid, &[lambda], tolerance);
        deviation.energy(
            node.discrete_energy.total(),
            output.h.ok_or_else(|| missing("H"))?,
            tolerance,
        );
        let variational = [output.lambda, output.e_d, output.h_d, output.h_dq];
        if output.constraint_force.is_some() || variational.iter().any(Option::is_some) {
            return Err("variational outputs in an energy–momentum case".into());
        }
        Ok(())
    }

    fn variational(&self, kind: SchemeKind) -> Result<Deviation, String> {
        let mechanism = self.mechanism();
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let (system, map) = (mechanism.system(Quadrature::Midpoint), TreeMap::new(&mechanism));
        let options = Options::new(kind, self.h);
        let mut run: Integrator<SeparableSystem, Mechanism> = Integrator::with_reparametrization(
            system,
            mechanism,
            map,
            options,
            InitialValues::new(0.0, &q, &v),
        )
        .map_err(|e| e.to_string())?;
        let mut deviation = Deviation::default();
        super::rigid::drive(&mut run, self.steps, &self.output_steps, |step, state, node| {
            let output = self
                .outputs
                .iter()
                .find(|o| o.step == step)
                .ok_or_else(|| format!("no output at step {step}"))?;
            self.compare(output, state, node, &mut deviation)
        })?;
        Ok(deviation)
    }

    fn compare(
        &self,
        output: &Output,
        state: &State,
        node: &Node,
        deviation: &mut Deviation,
    ) -> Result<(), String> {
        let tolerance = &self.tolerance;
        let missing = |what: &str| format!("output {} lacks {what}", output.step);
        deviation.q(&state.q, &output.q, tolerance);
        deviation.p(&node.p, &output.p, tolerance);
        let force = output.constraint_force.ok_or_else(|| missing("constraint_force"))?;
        deviation.force(&node.constraint_force, &force, tolerance);
        let lambda = output.lambda.ok_or_else(|| missing("lambda"))?;
        deviation.force(&node.lambda, &[lambda], tolerance);
        deviation.energy(
            node.discrete_energy.total(),
            output.e_d.ok_or_else(|| missing("E_d"))?,
            tolerance,
        );
        let hamiltonian = node.hamiltonian.map_or(f64::NAN, |h| h.total());
        deviation.energy(hamiltonian, output.h_d.ok_or_else(|| missing("H_d"))?, tolerance);
        let projected = output.h_dq.ok_or_else(|| missing("H_dQ"))?;
        deviation.energy(node.hamiltonian_projected.total(), projected, tolerance);
        if output.h.is_some() || output.lambda_mid.is_some() {
            return Err("energy–momentum outputs in a variational case".into());
        }
        Ok(())
    }
}
