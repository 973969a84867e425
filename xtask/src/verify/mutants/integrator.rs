//! Integrators with one wrong part, plugged in where a user would plug in a part of his own.

use holonom::nalgebra::DMatrix;
use holonom::verification::running::RunningSystem;
use holonom::verification::subject::{Initial, RunningMotion, SchemeSetting, SteppingMethod};
use holonom::vi_constraints::{InitialValues, Integrator, Options, Reparametrization};
use holonom::vi_core::force::{DiscreteForce, NoTimeSlope};
use holonom::vi_core::newton::{Fault, UnknownBlock};
use holonom::vi_core::{
    Composition, Configuration, DiscreteLagrangian, Entries, Interval, MechanicalSystem, Motion,
    SeparableSystem, Slot, SparseMatrix, StepChange,
};
use holonom::vi_multibody::tree_map::TreeMap;
use holonom::{Model, system};
use std::cell::RefCell;

/// What is wrong in a variational integrator of a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IntegratorDefect {
    /// `D_2 L_d` with the wrong sign before the potential.
    SignInD2,
    /// `P` of the node before.
    NullSpaceOfTheNodeBefore,
    /// The weight as a force at the start of the step only: of first order.
    FirstOrderForce,
    /// Newton's method stops at `1e-6`.
    LooseTolerance,
    /// A damper of this rate (1/s) that is not declared, at the start of the step only: of first
    /// order.
    HiddenDamper(f64),
    /// A constant force and torque that is not declared, relative to the masses.
    HiddenForce(f64),
    /// One coefficient of the composition of order 4 is off by this; the sum stays 1.
    WrongGamma(f64),
    /// Two sub-steps of different length: the composition is not symmetric.
    AsymmetricGamma,
    /// `F_d` leaves the constraints by this in every step.
    Slip(f64),
    /// The first increment is counted in steps.
    ScaledIncrement,
}

/// A system whose `D_2 L_d` has the wrong sign before the potential.
struct WrongSign {
    inner: SeparableSystem,
    wrong: bool,
}

impl MechanicalSystem for WrongSign {
    fn mass(&self) -> &SparseMatrix {
        self.inner.mass()
    }
    fn potential_energy(&self, at: Configuration<'_>) -> f64 {
        self.inner.potential_energy(at)
    }
    fn add_potential_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.inner.add_potential_gradient(at, scale, out);
    }
    fn add_force(&self, at: Motion<'_>, out: &mut [f64]) {
        self.inner.add_force(at, out);
    }
}

impl DiscreteLagrangian for WrongSign {
    fn discrete_lagrangian(&self, s: &Interval) -> f64 {
        self.inner.discrete_lagrangian(s)
    }
    fn d1(&self, s: &Interval, out: &mut [f64]) {
        self.inner.d1(s, out);
    }
    fn d2(&self, s: &Interval, out: &mut [f64]) {
        self.inner.d2(s, out);
        if self.wrong {
            out.iter_mut().for_each(|p| *p = -*p); // +M Δq/h + h D_2 U_d
            self.inner.mass().mul_add(2.0 / s.h, &s.dq, out);
        }
    }
    fn d2_d1(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.d2_d1(s, out);
    }
    fn d1_d1(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.d1_d1(s, out);
    }
    fn d2_d2(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.d2_d2(s, out);
    }
    fn potential_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.inner.potential_hessian(at, scale, out);
    }
    fn add_force_minus(&self, s: &Interval, out: &mut [f64]) {
        self.inner.add_force_minus(s, out);
    }
    fn add_force_plus(&self, s: &Interval, out: &mut [f64]) {
        self.inner.add_force_plus(s, out);
    }
    fn force_minus_d2(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.force_minus_d2(s, out);
    }
    fn force_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        self.inner.force_slope(s, of, by, out);
    }
    fn discrete_potential_energy(&self, s: &Interval) -> f64 {
        self.inner.discrete_potential_energy(s)
    }
}

/// An impulse at the start of the step: `h w`, and `−c M Δq`. Undeclared, it has no continuous
/// force.
struct AtTheStart {
    w: Vec<f64>,
    damping: Option<(f64, SparseMatrix)>, // c (1/s), M
    declared: bool,
}

impl DiscreteForce for AtTheStart {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        out.iter_mut().zip(&self.w).for_each(|(o, f)| *o += s.h * f);
        if let Some((rate, mass)) = &self.damping {
            mass.mul_add(-rate, &s.dq, out);
        }
    }
    fn add_plus(&self, _s: &Interval, _out: &mut [f64]) {}
    fn add_slope(&self, _: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        let own = self.damping.as_ref().filter(|_| [of, by] == [Slot::First; 2]);
        if let Some((rate, mass)) = own {
            mass.for_each(|i, j, value| out.add(i, j, rate * value));
        }
    }
    fn add_step_slope(
        &self,
        _: &Interval,
        _: Slot,
        _: StepChange,
        _: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        Err(NoTimeSlope)
    }
    fn add_time_slope(&self, _: Motion<'_>, _scale: f64, _: &mut [f64]) -> Result<(), NoTimeSlope> {
        Err(NoTimeSlope)
    }
    fn add_continuous(&self, _: Motion<'_>, out: &mut [f64]) {
        if self.declared {
            out.iter_mut().zip(&self.w).for_each(|(o, f)| *o += f);
        }
    }
    fn add_stiffness(&self, _: Motion<'_>, _scale: f64, _: &mut dyn Entries) {}
    fn add_position_slope(&self, _: Motion<'_>, _scale: f64, _: &mut dyn Entries) {}
    fn add_damping(&self, _: Motion<'_>, _scale: f64, _: &mut dyn Entries) {}
    fn is_dissipative(&self) -> bool {
        false
    }
}

/// A map with a defect.
struct Map {
    inner: TreeMap,
    before: RefCell<Option<Vec<f64>>>,
    defect: IntegratorDefect,
    h: f64,
}

impl Map {
    fn slip(&self) -> f64 {
        if let IntegratorDefect::Slip(by) = self.defect { by } else { 0.0 }
    }

    /// The factor of the first increment.
    fn first(&self) -> f64 {
        if self.defect == IntegratorDefect::ScaledIncrement { self.h } else { 1.0 }
    }
}

impl Reparametrization for Map {
    fn dof(&self) -> usize {
        self.inner.dof()
    }
    fn blocks(&self) -> Vec<UnknownBlock> {
        self.inner.blocks()
    }
    fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>) {
        let before = self.before.replace(Some(q.to_vec()));
        let late = self.defect == IntegratorDefect::NullSpaceOfTheNodeBefore;
        let at = before.filter(|_| late).unwrap_or_else(|| q.to_vec());
        self.inner.null_space(&at, out);
        out.column_mut(0).scale_mut(self.first());
    }
    fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        let mut u = u.to_vec();
        u[0] *= self.first();
        self.inner.reparametrize(&u, s)?;
        for i in 0..3 {
            s.q1[i] += self.slip();
            s.dq[i] += self.slip();
        }
        Ok(())
    }
    fn tangent(&self, u: &[f64], s: &Interval, out: &mut DMatrix<f64>) {
        let mut u = u.to_vec();
        u[0] *= self.first();
        self.inner.tangent(&u, s, out);
        out.column_mut(0).scale_mut(self.first());
    }
    fn clean(&self, t: f64, q: &mut [f64]) {
        if self.slip() == 0.0 {
            self.inner.clean(t, q);
        }
    }
}

/// Coefficients of a composition with a defect.
fn gammas(order: u32, defect: IntegratorDefect) -> Vec<f64> {
    let mut gammas = Composition::of_order(order).unwrap_or_default().gammas();
    match defect {
        IntegratorDefect::WrongGamma(by) if order == 4 => {
            let (middle, last) = (gammas.len() / 2, gammas.len() - 1);
            gammas[middle] += 2.0 * by;
            gammas[0] -= by;
            gammas[last] -= by;
        }
        IntegratorDefect::AsymmetricGamma => gammas = vec![0.3, 0.7],
        _ => {}
    }
    gammas
}

/// Sets a model that is a tree in motion.
pub(super) fn start(
    model: &Model,
    defect: IntegratorDefect,
    setting: SchemeSetting,
    at: Option<Initial<'_>>,
) -> Result<Box<dyn RunningMotion>, String> {
    let built = system::build(model).map_err(|e| e.to_string())?;
    let mut inner = built.dynamics.variational(&built.mechanism);
    let mechanism = built.mechanism;
    let own = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let (q, v) = at.unwrap_or((&own.0, &own.1));
    let n = q.len();
    let (w, mass) = (vec![0.0; n], inner.mass().clone());
    inner = match defect {
        IntegratorDefect::FirstOrderForce => {
            let mut w = w;
            inner.add_potential_gradient(Configuration::new(0.0, q), -1.0, &mut w);
            let weight = AtTheStart { w, damping: None, declared: true };
            SeparableSystem::new(mass).force(Box::new(weight))
        }
        IntegratorDefect::HiddenDamper(rate) => {
            let damping = Some((rate, mass));
            inner.force(Box::new(AtTheStart { w, damping, declared: false }))
        }
        IntegratorDefect::HiddenForce(size) => {
            let mut w = w;
            let pattern: Vec<f64> = (0..n).map(|i| (1.0 + 1.3 * i as f64).sin()).collect();
            mass.mul_add(size, &pattern, &mut w);
            inner.force(Box::new(AtTheStart { w, damping: None, declared: false }))
        }
        _ => inner,
    };
    let SteppingMethod::Variational(kind) = setting.method else { return Err("not built".into()) };
    let mut options = Options::new(kind, setting.step);
    if defect == IntegratorDefect::LooseTolerance {
        options.newton.tolerance = 1e-6;
    }
    let map = Map {
        inner: TreeMap::new(&mechanism),
        before: RefCell::default(),
        defect,
        h: setting.step.abs(),
    };
    let system = WrongSign { inner, wrong: defect == IntegratorDefect::SignInD2 };
    let run = Integrator::with_reparametrization(
        system,
        mechanism,
        map,
        options,
        InitialValues::new(0.0, q, v),
    )
    .and_then(|run| run.with_coefficients(gammas(setting.order, defect)))
    .map_err(|e| e.to_string())?;
    Ok(Box::new(RunningSystem::variational(run)))
}
