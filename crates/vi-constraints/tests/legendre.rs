//! The discrete Legendre transforms as functions of given configurations: equal along solutions of
//! all four schemes, closed forms.
#![allow(clippy::unwrap_used, non_snake_case)] // a test; G, M, P, Q

use crate::common;

use common::{Bars, Winch, frame};
use nalgebra::{DMatrix, DVector};
use vi_constraints::{
    Constraints, InitialValues, Integrator, LegendreTransforms, Options, SchemeKind,
};
use vi_core::force::{LinearDamping, MidpointForce};
use vi_core::linear::norm_inf;
use vi_core::potential::{DualPotential, LinearPotential, ScalarField};
use vi_core::{
    Configuration, Energies, Entries, Interval, Quadrature, SeparableSystem, num_dual::DualNum,
};

pub(crate) fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    norm_inf(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// A potential that no coordinate is left out of.
pub(crate) struct Bowl;
impl ScalarField<8> for Bowl {
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 8]) -> D {
        let coupled = (q[0] * q[7] + q[3]).sin() + q[2] * q[5];
        q.iter().fold(coupled, |sum, x| sum + x.powi(4) * 0.3)
    }
}

/// A rigid body in director coordinates: `φ` and an orthonormal triad, LMO08 (56).
#[derive(Clone)]
struct Directors;

impl Directors {
    const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    fn dot(q: &[f64], w: &[f64], (a, b): (usize, usize)) -> f64 {
        (0..3).map(|i| q[3 + 3 * a + i] * w[3 + 3 * b + i]).sum()
    }
}

impl Constraints for Directors {
    fn dim(&self) -> usize {
        12
    }
    fn len(&self) -> usize {
        6
    }
    fn value(&self, Configuration { q, .. }: Configuration<'_>, out: &mut [f64]) {
        for (g, pair) in out.iter_mut().zip(Self::PAIRS) {
            let dot = Self::dot(q, q, pair);
            *g = if pair.0 == pair.1 { 0.5 * (dot - 1.0) } else { dot };
        }
    }
    fn jacobian(&self, _t: f64, q: &[f64], out: &mut dyn Entries) {
        for (row, (a, b)) in Self::PAIRS.into_iter().enumerate() {
            for i in 0..3 {
                out.add(row, 3 + 3 * a + i, q[3 + 3 * b + i]);
                if a != b {
                    out.add(row, 3 + 3 * b + i, q[3 + 3 * a + i]);
                }
            }
        }
    }
    fn second_derivative(&self, _t: f64, _q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        for (g, (a, b)) in out.iter_mut().zip(Self::PAIRS) {
            *g = Self::dot(v, w, (a, b));
            if a != b {
                *g += Self::dot(w, v, (a, b));
            }
        }
    }
}

struct Case<C> {
    name: &'static str,
    system: fn() -> SeparableSystem,
    constraints: C,
    q: Vec<f64>,
    v: Vec<f64>,
}

/// Largest deviations along a solution.
#[derive(Debug, Default)]
struct Worst {
    constrained: f64, // (34) against (35)
    projected: f64,   // (39) against (40)
    reduced: f64,     // (41) against (42), and against Pᵀ ᵠp_n
    tangent: f64,     // G v̂ + ∂g/∂t
    node: f64,        // against what the integrator says
}

impl Worst {
    fn largest(&self) -> f64 {
        norm_inf(&[self.constrained, self.projected, self.reduced, self.tangent, self.node])
    }
}

impl<C: Constraints + Clone + 'static> Case<C> {
    /// Runs and evaluates every node from its configurations alone.
    fn along(&self, scheme: SchemeKind, h: f64, steps: usize) -> Worst {
        let at = InitialValues::new(0.0, &self.q, &self.v);
        let options = Options::new(scheme, h);
        let mut run =
            Integrator::new((self.system)(), self.constraints.clone(), options, at).unwrap();
        let (mut nodes, mut states) = (Vec::new(), vec![run.state().clone()]);
        for _ in 0..steps {
            run.step().unwrap();
            nodes.push(run.node_before().unwrap().clone());
            states.push(run.state().clone());
        }
        let intervals: Vec<Interval> =
            states.windows(2).map(|s| Interval::between(s[0].t, h, &s[0].q, &s[1].q)).collect();
        let (system, constraints) = (run.system(), run.constraints());
        let mut of =
            LegendreTransforms::new(system, constraints, states[1].configuration()).unwrap();
        let mut worst = Worst::default();
        let raise = |worst: &mut f64, a: &[f64], b: &[f64]| *worst = worst.max(difference(a, b));

        // the start: (47), and p_0 = p(0)
        let lambda = of.start_multiplier(&states[0].p, &intervals[0]).unwrap();
        let p = of.momentum_minus(&intervals[0], &lambda).unwrap();
        raise(&mut worst.constrained, &p, &states[0].p);
        raise(&mut worst.node, &lambda, &nodes[0].lambda);

        for n in 1..steps {
            let (before, after, node) = (&intervals[n - 1], &intervals[n], &nodes[n]);
            let at = after.start();
            let lambda = of.multiplier(before, after).unwrap();
            let minus = of.momentum_minus(after, &lambda).unwrap();
            let plus = of.momentum_plus(before, &lambda).unwrap();
            raise(&mut worst.constrained, &minus, &plus);
            raise(&mut worst.node, &lambda, &node.lambda);
            raise(&mut worst.node, &minus, &node.p);
            let force = of.constraint_force(at, &lambda).unwrap();
            raise(&mut worst.node, &force, &node.constraint_force);

            let projected = of.projected_momentum_minus(after).unwrap();
            raise(&mut worst.projected, &projected, &of.projected_momentum_plus(before).unwrap());
            raise(&mut worst.node, &projected, &node.p_projected);
            let v = of.velocity(at, &minus).unwrap();
            let mut rate = vec![0.0; constraints.len()];
            constraints.time_derivative(at.t, at.q, &mut rate);
            let mut jacobian = DMatrix::zeros(constraints.len(), v.len());
            constraints.jacobian(at.t, at.q, &mut jacobian);
            let rate = jacobian * DVector::from_column_slice(&v) + DVector::from_vec(rate);
            worst.tangent = worst.tangent.max(norm_inf(rate.as_slice()));

            let P = of.null_space(at).unwrap();
            let reduced = of.reduced_momentum_minus(after, &P).unwrap();
            raise(&mut worst.reduced, &reduced, &of.reduced_momentum_plus(before, &P).unwrap());
            let pulled = P.tr_mul(&DVector::from_column_slice(&projected));
            raise(&mut worst.reduced, &reduced, pulled.as_slice());

            let energies = |e: Energies| [e.kinetic, e.potential];
            let found = of.discrete_energy(after).unwrap();
            raise(&mut worst.node, &energies(found), &energies(node.discrete_energy));
            let found = of.hamiltonian(at, &minus).unwrap();
            assert_eq!(found.is_some(), node.hamiltonian.is_some());
            if let (Some(found), Some(expected)) = (found, node.hamiltonian) {
                raise(&mut worst.node, &energies(found), &energies(expected));
            }
            let found = of.projected_hamiltonian(at, &plus).unwrap();
            raise(&mut worst.node, &energies(found), &energies(node.hamiltonian_projected));
            if constraints.is_rheonomic() {
                continue; // v̂ has a part that is no P ν
            }
            // ½ ᴾpᵀ (PᵀMP)⁻¹ ᴾp is the same number, singular M or not
            let r = DVector::from_column_slice(&reduced);
            let inertia = P.tr_mul(&(mass(system) * &P)).cholesky().expect("PᵀMP is definite");
            let kinetic = 0.5 * r.dot(&inertia.solve(&r));
            raise(&mut worst.reduced, &[kinetic], &[found.kinetic]);
        }
        worst
    }

    fn along_all(&self, h: f64, steps: usize) {
        for scheme in SchemeKind::ALL {
            let worst = self.along(scheme, h, steps);
            println!("{}, {scheme:?}: {worst:?}", self.name);
            assert!(worst.largest() < 2e-11, "{}, {scheme:?}: {worst:?}", self.name);
        }
    }
}

pub(crate) fn mass(system: &SeparableSystem) -> DMatrix<f64> {
    vi_core::MechanicalSystem::mass(system).to_dense()
}

pub(crate) const SQUARE: [f64; 8] = [0.0, 0.0, 1.0, 0.1, 1.2, 1.1, -0.1, 0.9];

/// Six bars between four points of the plane, one of them redundant; turning about the origin.
fn six_bars(name: &'static str, system: fn() -> SeparableSystem) -> Case<Bars> {
    let v = SQUARE.chunks(2).flat_map(|x| [0.3 - 0.8 * x[1], 0.8 * x[0]]).collect();
    Case { name, system, constraints: frame(2, &SQUARE, false), q: SQUARE.to_vec(), v }
}

fn pendulum(name: &'static str, system: fn() -> SeparableSystem) -> Case<Bars> {
    let bar = Bars { dim: 2, points: 1, bars: vec![(None, 0, 1.0)] };
    Case { name, system, constraints: bar, q: vec![1.0, 0.0], v: vec![0.0, 0.3] }
}

fn falling() -> SeparableSystem {
    SeparableSystem::with_diagonal_mass(&[1.5, 1.5])
        .potential(LinearPotential { force: vec![0.0, -14.7] })
}

#[test]
fn both_transforms_agree_along_solutions_of_all_schemes() {
    pendulum("pendulum", falling).along_all(0.05, 60);
    six_bars("redundant bars", || {
        SeparableSystem::with_diagonal_mass(&[1.0, 1.0, 2.0, 2.0, 0.5, 0.5, 3.0, 3.0])
            .potential(DualPotential(Bowl))
    })
    .along_all(0.02, 60);
    let euler = || {
        let masses = [2.0, 2.0, 2.0, 0.3, 0.3, 0.3, 0.2, 0.2, 0.2, 0.1, 0.1, 0.1];
        SeparableSystem::with_diagonal_mass(&masses)
    };
    let q = vec![0.1, -0.2, 0.3, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    // ω = (0.4, 1.0, -0.7)
    let v = vec![0.5, 0.0, -0.2, 0.0, -0.7, -1.0, 0.7, 0.0, 0.4, 1.0, -0.4, 0.0];
    let body = Case { name: "free body", system: euler, constraints: Directors, q, v };
    body.along_all(0.02, 60);
}

#[test]
fn they_agree_with_singular_mass_forces_and_moving_constraints() {
    // as the directors of a beam that carry no mass: a point without mass, with a potential on it
    six_bars("redundant bars, singular M", || {
        SeparableSystem::with_diagonal_mass(&[1.0, 1.0, 2.0, 2.0, 0.0, 0.0, 3.0, 3.0])
            .quadrature(Quadrature::Trapezoidal)
            .potential(DualPotential(Bowl))
    })
    .along_all(0.02, 60);
    pendulum("damped pendulum", || {
        let entries = vec![(0, 0, 0.4), (1, 1, 0.9), (0, 1, 0.2)];
        falling().force(Box::new(MidpointForce(LinearDamping { entries })))
    })
    .along_all(0.05, 60);
    let (q, v) = (vec![1.0, 0.0], vec![0.6, 0.3]);
    let winch =
        Case { name: "rod of prescribed length", system: falling, constraints: Winch, q, v };
    winch.along_all(0.05, 60);
}

/// `q_n = (cos nΔ, sin nΔ)`, `sin Δ = h`: λ, p, energies in closed form, LMO08 §3.1; no integrator.
#[test]
fn the_pendulum_without_gravity_has_the_closed_form() {
    let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0]);
    let rod = Bars { dim: 2, points: 1, bars: vec![(None, 0, 1.0)] };
    let mut worst = 0.0_f64;
    for h in [0.01_f64, 0.1, 0.5, 0.8, 0.99] {
        let q = |n: u32| [(f64::from(n) * h.asin()).cos(), (f64::from(n) * h.asin()).sin()];
        let interval = |n: u32| Interval::between(f64::from(n) * h, h, &q(n), &q(n + 1));
        let mut of =
            LegendreTransforms::new(&system, &rod, Configuration::new(0.0, &q(0))).unwrap();
        let root = (1.0 - h * h).sqrt();
        let lambda_exact = 2.0 / (1.0 + root); // 2 (1 − √(1 − h²))/h² without its cancellation
        let mut check = |found: f64, exact: f64, scale: f64| {
            worst = worst.max((found - exact).abs() / scale);
        };
        for n in 0..20 {
            let after = interval(n);
            let lambda = match n {
                0 => of.start_multiplier(&[0.0, 1.0], &after).unwrap(),
                n => of.multiplier(&interval(n - 1), &after).unwrap(),
            };
            check(lambda[0], lambda_exact, 1.0 / (h * h));
            let p = of.momentum_minus(&after, &lambda).unwrap();
            check(p[0].hypot(p[1]), 1.0, 1.0 / h);
            check(p[0] * q(n)[0] + p[1] * q(n)[1], 0.0, 1.0 / h);
            check(
                of.hamiltonian(Configuration::new(0.0, &q(n)), &p).unwrap().unwrap().total(),
                0.5,
                1.0 / h,
            );
            check(of.discrete_energy(&after).unwrap().kinetic, 0.5 * lambda_exact, 1.0 / h);
        }
    }
    println!("worst deviation in units of the round-off of q: {worst:.1e}");
    assert!(worst < 2e-14, "{worst:e}");
}
