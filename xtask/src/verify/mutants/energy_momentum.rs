//! Energy–momentum schemes with one wrong part.

use holonom::nalgebra::DMatrix;
use holonom::verification::running::RunningSystem;
use holonom::verification::subject::{Initial, RunningMotion, SchemeSetting, SteppingMethod};
use holonom::vi_constraints::InitialValues;
use holonom::vi_constraints::Reparametrization;
use holonom::vi_core::potential::Potential;
use holonom::vi_core::{Configuration, Entries, Interval, Quadrature};
use holonom::vi_emscheme::discrete_gradient::DiscreteGradient;
use holonom::vi_emscheme::null_space::DiscreteNullSpace;
use holonom::vi_emscheme::{EmAlgebra, EmOptions, EmSystem, integrator, run};
use holonom::vi_multibody::mechanism::Mechanism;
use holonom::vi_multibody::tree_map::TreeMap;
use holonom::{Model, system};

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmDefect {
    /// The gradient at the midpoint in the place of the discrete derivative.
    MidpointGradient,
    /// `P(q_n)` in the place of `P̄`, so that `Ḡ P̄ = 0` does not hold.
    NullSpaceAtTheStart,
}

/// `V = ¼ k |φ − c|⁴` of the first point.
#[derive(Clone, Copy)]
struct Quartic;

const STIFFNESS: f64 = 40.0;
const CENTER: [f64; 3] = [0.4, -0.3, 0.2];

impl Quartic {
    fn arm(q: &[f64]) -> [f64; 3] {
        std::array::from_fn(|i| q[i] - CENTER[i])
    }

    fn square(q: &[f64]) -> f64 {
        Self::arm(q).iter().map(|x| x * x).sum()
    }
}

impl Potential for Quartic {
    fn value(&self, q: &[f64]) -> f64 {
        0.25 * STIFFNESS * Self::square(q).powi(2)
    }
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        let (arm, square) = (Self::arm(q), Self::square(q));
        (0..3).for_each(|i| out[i] += scale * STIFFNESS * square * arm[i]);
    }
    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let (arm, square) = (Self::arm(q), Self::square(q));
        for i in 0..3 {
            for j in 0..3 {
                let unit = if i == j { square } else { 0.0 };
                out.add(i, j, scale * STIFFNESS * (unit + 2.0 * arm[i] * arm[j]));
            }
        }
    }
}

/// Not a discrete derivative: directionality does not hold.
struct Midpoint(Quartic);

struct Half<'a>(&'a mut dyn Entries);

impl Entries for Half<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.0.add(row, column, 0.5 * value);
    }
}

impl DiscreteGradient for Midpoint {
    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.0.value(at.q)
    }
    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(at.q, scale, out);
    }
    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(&s.q_mid, scale, out);
    }
    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.0.add_hessian(&s.q_mid, scale, &mut Half(out));
    }
}

struct AtTheStart(TreeMap);

impl DiscreteNullSpace<Mechanism> for AtTheStart {
    fn null_space(&mut self, _: &Mechanism, s: &Interval, out: &mut DMatrix<f64>) {
        self.0.null_space(&s.q0, out);
    }
}

/// Sets a model that is a tree in motion, with a quartic spring on its first body; `None`: the
/// sound one.
pub(super) fn start(
    model: &Model,
    defect: Option<EmDefect>,
    setting: SchemeSetting,
    at: Option<Initial<'_>>,
) -> Result<Box<dyn RunningMotion>, String> {
    let mechanism = system::build(model).map_err(|e| e.to_string())?.mechanism;
    let own = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let (q, v) = at.unwrap_or((&own.0, &own.1));
    let SteppingMethod::EnergyMomentum(form) = setting.method else {
        return Err("not built".into());
    };
    if setting.order > 2 {
        return Err("not built".into());
    }
    let forces = mechanism.system(Quadrature::Midpoint).potential(Quartic);
    let masses = EmSystem::of_mechanism(&mechanism);
    let system = match defect {
        Some(EmDefect::MidpointGradient) => masses.gradient(Midpoint(Quartic)),
        _ => masses.potential(Quartic),
    };
    let (options, at) = (EmOptions::new(form, setting.step), InitialValues::new(0.0, q, v));
    let map = TreeMap::new(&mechanism);
    let run = match defect {
        Some(EmDefect::NullSpaceAtTheStart) => {
            let source = AtTheStart(TreeMap::new(&mechanism));
            integrator::with_null_space(system, mechanism, source, map, options, at)
        }
        _ => run::integrator_at(system, mechanism, options, EmAlgebra::default(), at),
    };
    let run = run.map_err(|e| e.to_string())?;
    Ok(Box::new(RunningSystem::energy_momentum(run, forces)))
}
