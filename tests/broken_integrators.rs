//! The verifier itself: deliberately broken integrators must fail, on the criterion that names what is
//! wrong. Each one is plugged in where a user would plug in a part of his own.
#![allow(clippy::unwrap_used)] // a test

mod harness;

use harness::models::model;
use holonom::evidence::certificate::{Certificate, Criterion, Verdict};
use holonom::evidence::certify::{Plan, certify};
use holonom::evidence::closed_form::curved_cantilever;
use holonom::evidence::convergence::Horizon;
use holonom::evidence::running::Running;
use holonom::evidence::subject::{Kept, Method, Motion, Nature, Setting, Subject, Values};
use holonom::system;
use nalgebra::{DMatrix, Rotation3, Unit, Vector3};
use std::cell::RefCell;
use vi_constraints::scheme::Condition;
use vi_constraints::tangent_map::Tangents;
use vi_constraints::{Integrator, Options, Reparametrization, SchemeKind};
use vi_core::force::DiscreteForce;
use vi_core::newton::{Block, Fault};
use vi_core::{Entries, Interval, MechanicalSystem, SeparableSystem, SparseMatrix};
use vi_multibody::map::TreeMap;
use vi_multibody::mechanism::Mechanism;

/// What is broken.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Broken {
    Nothing,
    SignInD2,
    NullSpaceAtTheWrongNode,
    FirstOrderForce,
    LooseTolerance,
    StartMultiplierWithoutItsFactor,
}

/// The heavy top in steady precession, its motion known exactly, with a broken integrator.
struct Top(Broken);

/// A system whose `D_2 L_d` may have the wrong sign before the potential.
struct Signed {
    inner: SeparableSystem,
    wrong: bool,
}

impl MechanicalSystem for Signed {
    fn dim(&self) -> usize {
        self.inner.dim()
    }
    fn mass(&self) -> &SparseMatrix {
        self.inner.mass()
    }
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
    fn add_force_minus(&self, s: &Interval, out: &mut [f64]) {
        self.inner.add_force_minus(s, out);
    }
    fn add_force_plus(&self, s: &Interval, out: &mut [f64]) {
        self.inner.add_force_plus(s, out);
    }
    fn force_minus_d2(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.force_minus_d2(s, out);
    }
    fn add_force(&self, t: f64, q: &[f64], v: &[f64], out: &mut [f64]) {
        self.inner.add_force(t, q, v, out);
    }
    fn discrete_potential_energy(&self, s: &Interval) -> f64 {
        self.inner.discrete_potential_energy(s)
    }
    fn potential_energy(&self, q: &[f64]) -> f64 {
        self.inner.potential_energy(q)
    }
    fn add_potential_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        self.inner.add_potential_gradient(q, scale, out);
    }
}

/// The weight as a discrete force, all of it at the start of the step: of first order.
struct AllAtTheStart(Vec<f64>);

impl DiscreteForce for AllAtTheStart {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        out.iter_mut().zip(&self.0).for_each(|(o, f)| *o += s.h * f);
    }
    fn add_plus(&self, _s: &Interval, _out: &mut [f64]) {}
    fn add_minus_d2(&self, _s: &Interval, _out: &mut dyn Entries) {}
    fn add_continuous(&self, _t: f64, _q: &[f64], _v: &[f64], out: &mut [f64]) {
        out.iter_mut().zip(&self.0).for_each(|(o, f)| *o += f);
    }
    fn add_rest_derivative(&self, _t: f64, _q: &[f64], _scale: f64, _out: &mut dyn Entries) {}
    fn is_dissipative(&self) -> bool {
        false
    }
}

/// A map whose `P` may belong to the node before.
struct Late {
    inner: TreeMap,
    before: RefCell<Option<Vec<f64>>>,
    late: bool,
}

impl Reparametrization for Late {
    fn dof(&self) -> usize {
        self.inner.dof()
    }
    fn blocks(&self) -> Vec<Block> {
        self.inner.blocks()
    }
    fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>) {
        let before = self.before.replace(Some(q.to_vec()));
        let at = before.filter(|_| self.late).unwrap_or_else(|| q.to_vec());
        self.inner.null_space(&at, out);
    }
    fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.inner.reparametrize(u, s)
    }
    fn tangent(&self, u: &[f64], s: &Interval, out: &mut DMatrix<f64>) {
        self.inner.tangent(u, s, out);
    }
    fn clean(&self, t: f64, q: &mut [f64]) {
        self.inner.clean(t, q);
    }
}

/// A motion whose `λ_0` lacks the factor 2 of (47).
struct Halved {
    inner: Box<dyn Motion>,
    at_start: bool,
}

impl Motion for Halved {
    fn step(&mut self) -> Result<(), String> {
        self.at_start = false;
        self.inner.step()
    }
    fn reverse(&mut self) {
        self.inner.reverse();
    }
    fn q(&self) -> &[f64] {
        self.inner.q()
    }
    fn values(&mut self) -> Result<Values, String> {
        let mut values = self.inner.values()?;
        if let Some(lambda) = values.lambda.as_mut().filter(|_| self.at_start) {
            lambda.iter_mut().for_each(|l| *l *= 0.5);
        }
        Ok(values)
    }
    fn kept(&mut self) -> Result<Kept, String> {
        self.inner.kept()
    }
    fn nature(&mut self) -> Result<Nature, String> {
        self.inner.nature()
    }
    fn condition(&mut self) -> Option<Condition> {
        self.inner.condition()
    }
    fn tangents(&mut self) -> Tangents {
        self.inner.tangents()
    }
    fn step_tangents(&mut self, tangents: &mut Tangents) -> Result<(), String> {
        self.inner.step_tangents(tangents)
    }
}

impl Top {
    fn integrator(&self, setting: Setting) -> Result<Integrator<Signed, Mechanism>, String> {
        let built = system::build(&model("heavy_top_steady", &[])).map_err(|e| e.to_string())?;
        let (mechanism, mut inner) = (built.mechanism, built.dynamics.variational);
        if self.0 == Broken::FirstOrderForce {
            let mut weight = vec![0.0; 12];
            inner.add_potential_gradient(&mechanism.start().0, -1.0, &mut weight);
            inner =
                SeparableSystem::new(inner.mass().clone()).force(Box::new(AllAtTheStart(weight)));
        }
        let Method::Variational(kind) = setting.method else { return Err("not here".into()) };
        let mut options = Options::new(kind, setting.step);
        if self.0 == Broken::LooseTolerance {
            options.newton.tolerance = 1e-6;
        }
        let (q, v) = mechanism.start();
        let late = self.0 == Broken::NullSpaceAtTheWrongNode;
        let map = Late { inner: TreeMap::new(&mechanism), before: RefCell::default(), late };
        let system = Signed { inner, wrong: self.0 == Broken::SignInD2 };
        let at = (0.0, &q[..], &v[..]);
        Integrator::with_reparametrization(system, mechanism, map, options, at)
            .map_err(|e| e.to_string())
    }
}

impl Subject for Top {
    fn start(&self, setting: Setting) -> Result<Box<dyn Motion>, String> {
        let run = self.integrator(setting)?;
        let inner = Box::new(Running::new(run, |mechanism, q, p| mechanism.momentum(q, p)));
        if self.0 == Broken::StartMultiplierWithoutItsFactor {
            return Ok(Box::new(Halved { inner, at_start: true }));
        }
        Ok(inner)
    }

    /// Steady precession at 10 rad/s with 135.6 rad/s about the axis of the cone; `λ` by the unbroken
    /// equations.
    fn exact(&self, t: f64) -> Option<Values> {
        let sound = Top(Broken::Nothing).integrator(Setting::new(Method::NODAL, 2, 1.0)).ok()?;
        let start = sound.state().q.clone();
        let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_3);
        let axis = Unit::new_normalize(tilt * Vector3::z());
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 10.0 * t);
        let spin = turn * Rotation3::from_axis_angle(&axis, 135.6 * t);
        let omega: Vector3<f64> = 10.0 * Vector3::z() + 135.6 * (turn * axis.into_inner());
        let (mut q, mut v) = (Vec::new(), Vec::new());
        for (k, x) in start.chunks_exact(3).enumerate() {
            let x = Vector3::from_column_slice(x);
            let x = if k == 0 { turn * x } else { spin * x };
            q.extend(x.iter());
            v.extend(omega.cross(&x).iter());
        }
        let mut p = vec![0.0; q.len()];
        sound.system().mass().mul_add(1.0, &v, &mut p);
        let at = (t, &q[..], &v[..]);
        let (system, mechanism) = (sound.system(), sound.constraints());
        let mut lambda = vec![0.0; vi_constraints::Constraints::len(mechanism)];
        vi_constraints::node::NodeObserver::new(system, lambda.len(), sound.rows())
            .acceleration_multiplier(system, mechanism, at, &mut lambda)
            .ok()?;
        Some(Values { q, p, lambda_other: Some(lambda), ..Values::default() })
    }
}

fn certificate(broken: Broken) -> Certificate {
    let scheme = |kind| (Method::Variational(kind), vec![2]);
    let plan = Plan {
        methods: vec![(Method::NODAL, vec![2]), scheme(SchemeKind::Dalembert)],
        horizon: Horizon { end: 0.02, coarsest: 16, finest: 4096 },
        step: 1e-4,
        long: 10_000,
        short: 2048,
        few: 64,
    };
    let certificate = certify(&Top(broken), "top", &plan, &mut |_| {});
    println!("{broken:?}:");
    for f in certificate.findings.iter().filter(|f| f.verdict != Verdict::Pass) {
        let scheme = f.method.map_or("", |m| m.name());
        println!(
            "  {:?} {scheme} {}: {} ({}) {}",
            f.verdict, f.quantity, f.measured, f.expected, f.reason
        );
    }
    certificate
}

/// The quantities of the failures about a criterion.
fn failed(certificate: &Certificate, criterion: Criterion) -> Vec<String> {
    certificate.failures(criterion).map(|f| f.quantity.clone()).collect()
}

#[test]
fn a_sound_integrator_passes() {
    assert!(certificate(Broken::Nothing).holds());
}

#[test]
fn a_wrong_sign_in_d2_fails_on_the_order() {
    let found = failed(&certificate(Broken::SignInD2), Criterion::Order);
    assert!(found.contains(&"q".to_owned()), "{found:?}");
}

#[test]
fn a_null_space_at_the_wrong_node_fails_on_momentum_and_order() {
    let certificate = certificate(Broken::NullSpaceAtTheWrongNode);
    assert_eq!(failed(&certificate, Criterion::Momentum)[..1], ["Lz"]);
    assert!(failed(&certificate, Criterion::Order).contains(&"q".to_owned()));
}

#[test]
fn a_first_order_force_fails_on_the_order() {
    let certificate = certificate(Broken::FirstOrderForce);
    let mut orders = certificate.failures(Criterion::Order);
    let p = orders.find(|f| f.quantity == "p (projected, 40)").unwrap();
    assert!((p.value.unwrap() - 1.0).abs() < 0.2, "{p:?}");
}

#[test]
fn a_loose_tolerance_fails_on_momentum_and_agreement() {
    let certificate = certificate(Broken::LooseTolerance);
    assert!(!failed(&certificate, Criterion::Momentum).is_empty());
    assert!(!failed(&certificate, Criterion::Agreement).is_empty());
}

#[test]
fn a_start_multiplier_without_its_factor_fails_on_its_order() {
    let certificate = certificate(Broken::StartMultiplierWithoutItsFactor);
    let found = failed(&certificate, Criterion::Order);
    assert!(found.iter().all(|quantity| quantity == "λ_0 (47)") && !found.is_empty(), "{found:?}");
}

#[test]
fn a_chord_in_the_place_of_the_arc_length_fails_on_the_closed_form() {
    let sound = curved_cantilever(&|_| {});
    println!("{} {}", sound.measured, sound.expected);
    assert_eq!(sound.verdict, Verdict::Pass, "{sound:?}");
    let broken = curved_cantilever(&|mesh| {
        let chords = mesh.centers.windows(2).map(|ends| (ends[1] - ends[0]).norm());
        mesh.lengths = chords.collect();
    });
    println!("{} {}", broken.measured, broken.expected);
    assert_eq!(broken.verdict, Verdict::Fail, "{broken:?}");
}
