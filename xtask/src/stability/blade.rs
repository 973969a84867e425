//! A blade that rotates freely about an axis at its root: steady rotation, tangent of a step, runs.

use holonom::nalgebra::Vector3;
use holonom::vi_beam::averaged::AveragedStrains;
use holonom::vi_beam::profile::{Material, Profile, Stated};
use holonom::vi_beam::{BeamMesh, BeamModel, ElementKind, FrameRule, Section, StrainRule};
use holonom::vi_constraints::{InitialValues, Options, SchemeKind};
use holonom::vi_core::legendre::discrete_energy;
use holonom::vi_core::{Quadrature, SeparableSystem};
use holonom::vi_emscheme::EmForm;
use holonom::vi_emscheme::beam::BeamGradient;
use holonom::vi_emscheme::{EmOptions, EmSystem, run as em};
use holonom::vi_multibody::mechanism::Mechanism;
use holonom::vi_multibody::pair::PairKind;
use holonom::vi_multibody::run::{Solver, integrator};
use holonom::vi_statics::{SteadyRotation, SteadyStep};

/// A discrete potential, or the energy–momentum scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rule {
    /// LMO08 (18).
    Midpoint,
    /// Averaged strains.
    Averaged,
    /// Averaged strains with selective mass scaling.
    MassScaled,
    /// The energy–momentum scheme.
    EnergyMomentum,
}

impl Rule {
    /// Those with a discrete potential.
    pub(super) const VARIATIONAL: [Self; 3] = [Self::Midpoint, Self::Averaged, Self::MassScaled];
    /// All.
    pub(super) const ALL: [Self; 4] =
        [Self::Midpoint, Self::Averaged, Self::MassScaled, Self::EnergyMomentum];

    /// In a table.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Midpoint => "midpoint",
            Self::Averaged => "averaged",
            Self::MassScaled => "mass_scaled",
            Self::EnergyMomentum => "em-nodal",
        }
    }

    fn strain(self) -> StrainRule {
        match self {
            Self::Midpoint => StrainRule::Midpoint,
            Self::MassScaled => StrainRule::MassScaled,
            Self::Averaged | Self::EnergyMomentum => StrainRule::Averaged,
        }
    }
}

/// Five metres along x, 0.25 m by 0.03 m, a revolute joint about z at the root.
pub(super) struct Blade {
    /// Material, elements, angular velocity.
    pub name: String,
    model: BeamModel,
    omega: f64, // rad/s
}

/// Helicoidal elements; of mean directors with the midpoint of coordinates, which is off the
/// constraints.
fn elements(rule: Rule) -> ElementKind {
    match rule {
        Rule::Midpoint => ElementKind::MeanDirectors,
        _ => ElementKind::Helicoidal,
    }
}

/// `model` with another kind of elements, stress-free as it stands.
fn of(mut model: BeamModel, kind: ElementKind) -> BeamModel {
    let (q, count) = (model.configuration(), model.elements.list().len());
    model.elements.set_strains(0..count, kind, &q).expect("the section shears");
    model
}

/// A rope between two pins along x, in tension: 10 m of it, stretched by what the tension asks.
pub(super) struct Rope {
    /// Section, elements, tension.
    pub name: String,
    model: BeamModel,
}

impl Rope {
    /// Steel wire rope of 10 mm under one tonne, `EI` of a rod.
    pub(super) fn steel(elements: usize) -> Self {
        let (ea, ei) = (5.0e6, 5.0e6 * 1e-4 / 16.0);
        let name = format!("steel, 10 mm, {elements} elements, 9.81 kN");
        Self::new(name, elements, [ea, ei, 0.4], 9810.0, ElementKind::Helicoidal)
    }

    /// A cord without bending stiffness to speak of under 400 N.
    pub(super) fn cord(elements: usize, kind: ElementKind) -> Self {
        let name = format!("cord, {elements} {} elements, 400 N", kind.name());
        Self::new(name, elements, [1e5, 1e-2, 0.1], 400.0, kind)
    }

    fn new(
        name: String,
        elements: usize,
        [ea, ei, line]: [f64; 3],
        tension: f64,
        kind: ElementKind,
    ) -> Self {
        let inertia = line * ei / ea;
        let section =
            Section::new([0.4 * ea, 0.4 * ea, ea, ei, ei, 0.8 * ei], [line, inertia, inertia, 0.0]);
        let rule = FrameRule::Normal(Vector3::z());
        let ends = [Vector3::zeros(), 10.0 * Vector3::x()];
        let mesh = BeamMesh::straight(ends[0], ends[1], elements, rule).expect("a line");
        let mut model = BeamModel::new(Vector3::zeros());
        let beam = model.add_beam("rope", &mesh, section.expect("positive")).expect("elements");
        let mut model = of(model, kind);
        let stretch = 1.0 + tension / ea;
        let own = &mut model.description.bodies;
        own.iter_mut().for_each(|node| node.center *= stretch);
        model.clamp(beam.nodes.start);
        model.clamp(beam.nodes.end - 1);
        Self { name, model }
    }

    /// The largest `|z| − 1` over the eigenvalues `z` of a step about the taut rope.
    pub(super) fn growth(&self, rule: StrainRule, h: f64) -> Option<f64> {
        let mechanism = self.model.mechanism();
        let system = self.model.system(&mechanism, rule);
        let rest = SteadyRotation { point: Vector3::zeros(), velocity: Vector3::zeros() };
        let q = self.model.configuration();
        SteadyStep::find(&system, &mechanism, &rest, h, &q).ok().map(|step| step.growth)
    }

    /// The largest change of `E_d` over a run of the rope that is plucked as half a wave of 1 % of
    /// its length, relative to the energy of the wave; the step that fails.
    pub(super) fn run(&self, rule: StrainRule, h: f64, steps: usize) -> Result<f64, usize> {
        let mut model = self.model.clone();
        let mut wave = 0.0;
        let line = model.elements.section(&model.elements.list()[0]).inertia()[0];
        for node in &mut model.description.bodies {
            let velocity = 3.0 * (std::f64::consts::PI * node.center.x / 10.0).sin();
            node.velocity = velocity * Vector3::z();
            wave += 0.5 * line * velocity * velocity;
        }
        wave *= 10.0 / (model.description.bodies.len() - 1) as f64;
        let mechanism = model.mechanism();
        let system = model.system(&mechanism, rule);
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let at = InitialValues::new(0.0, &q, &v);
        let options = Options::new(SchemeKind::Nodal, h);
        let run = integrator(mechanism, system, options, Solver::Auto, at);
        let mut run = run.map_err(|_| 0_usize)?;
        let (mut first, mut worst) = (None, 0.0_f64);
        for n in 1..=steps {
            run.step().map_err(|_| n)?;
            let energy = discrete_energy(run.system(), run.interval()).total();
            if !energy.is_finite() {
                return Err(n);
            }
            let start = *first.get_or_insert(energy);
            worst = worst.max((energy - start).abs() / wave);
        }
        Ok(worst)
    }
}

impl Blade {
    /// Aluminium.
    pub(super) fn aluminium(elements: usize, omega: f64) -> Self {
        Self::new(("aluminium", 70e9, 2700.0), elements, omega)
    }

    /// Steel.
    pub(super) fn steel(elements: usize, omega: f64) -> Self {
        Self::new(("steel", 210e9, 7850.0), elements, omega)
    }

    fn new((name, young, density): (&str, f64, f64), elements: usize, omega: f64) -> Self {
        let material = Material::from_poisson(young, 0.3, density).expect("0.3 is below 0.5");
        let profile = Profile::Rectangle { width: 0.03, height: 0.25 };
        let section = profile.section(&material, &Stated::default()).expect("a rectangle");
        let rule = FrameRule::Normal(Vector3::z());
        let tip = 5.0 * Vector3::x();
        let mesh = BeamMesh::straight(Vector3::zeros(), tip, elements, rule).expect("a line");
        let mut model = BeamModel::new(Vector3::zeros());
        let beam = model.add_beam("blade", &mesh, section).expect("a mesh has elements");
        model.join(PairKind::Revolute, None, beam.nodes.start, &Vector3::zeros(), &Vector3::z());
        for node in &mut model.description.bodies {
            node.omega = omega * Vector3::z();
            node.velocity = node.omega.cross(&node.center);
        }
        let name = format!("{name}, {elements} elements, {omega} rad/s");
        Self { name, model, omega }
    }

    /// The largest change of the energy of a step over a run, relative to the first; the step that
    /// fails.
    pub(super) fn run(&self, rule: Rule, h: f64, steps: usize) -> Result<f64, usize> {
        let model = of(self.under_gravity(), elements(rule));
        let mechanism = model.mechanism();
        if rule == Rule::EnergyMomentum {
            let em_system = em_system(&model, &mechanism);
            let options = EmOptions::new(EmForm::Nodal, h);
            let mut run = em::integrator(em_system, mechanism, options).map_err(|_| 0_usize)?;
            return largest_change(steps, || {
                run.step().ok()?;
                Some(run.node_before().ok()?.hamiltonian_projected.total())
            });
        }
        let system = model.system(&mechanism, rule.strain());
        variational(mechanism, system, (h, steps), |_| {})
    }

    /// The energy that a run with dissipative strains loses, and the change of the energy of a step
    /// over its last quarter, relative to the first; the step that fails.
    pub(super) fn run_dissipative(&self, h: f64, steps: usize) -> Result<[f64; 2], usize> {
        let model = of(self.under_gravity(), ElementKind::Helicoidal);
        let mechanism = model.mechanism();
        let system = model.system(&mechanism, StrainRule::Dissipative);
        let energies = std::cell::RefCell::new(Vec::with_capacity(steps));
        let see = |energy| energies.borrow_mut().push(energy);
        variational(mechanism, system, (h, steps), see)?;
        let energies = energies.into_inner();
        let (first, last) = (energies[0], &energies[steps - steps / 4..]);
        let (least, largest) =
            last.iter().fold((f64::MAX, f64::MIN), |(a, b), e| (a.min(*e), b.max(*e)));
        Ok([1.0 - last[last.len() - 1] / first, (largest - least) / first])
    }

    /// The same as [`Blade::run`] with averaged strains and another, constant `μ`.
    pub(super) fn run_scaled(&self, mu: f64, h: f64, steps: usize) -> Result<f64, usize> {
        let model = of(self.under_gravity(), ElementKind::Helicoidal);
        let mechanism = model.mechanism();
        let mass = model.mass_matrix(&mechanism);
        let strains = AveragedStrains::mass_scaled(
            model.elements.clone(),
            mu,
            vec![0.0; model.elements.list().len()],
        );
        let system = mechanism
            .system_with_mass(mass, Quadrature::Midpoint)
            .discrete_potential(Box::new(strains));
        variational(mechanism, system, (h, steps), |_| {})
    }

    fn under_gravity(&self) -> BeamModel {
        let mut model = self.model.clone();
        model.description.gravity = Vector3::new(0.0, 0.0, -9.81);
        model
    }

    /// The largest `|z| − 1` over the eigenvalues `z` of a step about the steady rotation; `None`
    /// where there is no steady rotation.
    pub(super) fn growth(&self, rule: Rule, h: f64) -> Option<f64> {
        let model = of(self.model.clone(), elements(rule));
        let mechanism = model.mechanism();
        let system = model.system(&mechanism, rule.strain());
        let rotation =
            SteadyRotation { point: Vector3::zeros(), velocity: self.omega * Vector3::z() };
        let q = model.configuration();
        SteadyStep::find(&system, &mechanism, &rotation, h, &q).ok().map(|step| step.growth)
    }
}

/// The largest change of `E_d`; `see` gets all of them.
fn variational(
    mechanism: Mechanism,
    system: SeparableSystem,
    (h, steps): (f64, usize),
    see: impl Fn(f64),
) -> Result<f64, usize> {
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let at = InitialValues::new(0.0, &q, &v);
    let options = Options::new(SchemeKind::Nodal, h);
    let mut run = integrator(mechanism, system, options, Solver::Auto, at).map_err(|_| 0_usize)?;
    largest_change(steps, || {
        run.step().ok()?;
        let energy = discrete_energy(run.system(), run.interval()).total();
        see(energy);
        Some(energy)
    })
}

fn em_system(model: &BeamModel, mechanism: &Mechanism) -> EmSystem {
    let linear = mechanism.system_with_mass(model.mass_matrix(mechanism), Quadrature::Midpoint);
    EmSystem::of_linear(&linear).gradient(BeamGradient(model.elements.clone()))
}

/// The largest change of what `step` returns, relative to the first; the step that fails.
fn largest_change(steps: usize, mut step: impl FnMut() -> Option<f64>) -> Result<f64, usize> {
    let (mut first, mut worst) = (None, 0.0_f64);
    for n in 1..=steps {
        let energy = step().filter(|e| e.is_finite()).ok_or(n)?;
        let start = *first.get_or_insert(energy);
        worst = worst.max((energy - start).abs() / start);
    }
    Ok(worst)
}
