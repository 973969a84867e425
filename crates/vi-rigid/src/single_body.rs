//! One rigid body, free or held at one of its points.
//!
//! ```text
//! free          u = (u_φ, θ),  ν = (φ̇, ω)                          P = P_in                LMO08 (59)–(61)
//! fixed point   r = φ + ϱ − x_0 = 0,   ϱ = ϱ_I d_I
//!               u = θ,  ν = ω,   φ̇ = −ω × ϱ = ϱ̂ ω                  P = (ϱ̂; −d̂_1; −d̂_2; −d̂_3)
//!               Δφ = −(exp θ̂ − I) ϱ_n,   φ_{n+1} = x_0 − ϱ_{n+1}
//!               ∂F_d/∂u = P(q_{n+1}) T(θ)
//! ```
//! Letters: `ϱ_I` body components of the arm from the centre to the held point (m), `x_0` where it
//! is held (m). The gap `r` is closed anew each step, so it stays at the round-off of one step; the
//! increment `Δφ` is formed on its own and keeps its own precision. Constraints: six internal ones,
//! LMO08 (56), then the three components of `r`.
//!
//! The fixed point is the spherical pair with the ground, LMO08 §5.

#![allow(non_snake_case)] // P, G, T: the matrices of the formulas above

use crate::body::RigidBody;
use crate::directors::{self, FRAME, INTERNAL, director};
use crate::rotation::{self, skew};
use crate::{null_space, reparametrization};
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};
use vi_constraints::{Constraints, Reparametrization};
use vi_core::Configuration;
use vi_core::newton::{BlockKind, Fault, UnknownBlock};
use vi_core::potential::LinearPotential;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{Interval, SeparableSystem, State};

/// Increments below this size (m, rad) do not matter to Newton's method.
const INCREMENT_FLOOR: f64 = 1e-6;

/// How a single body is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support {
    /// Not at all: six degrees of freedom.
    Free,
    /// One of its points stays in its place: three degrees of freedom.
    FixedPoint {
        /// `ϱ_I`: body components of the held point, from the centre of mass, m.
        anchor: Vector3<f64>,
        /// `x_0`: its place in the inertial frame, m.
        point: Vector3<f64>,
    },
}

/// A rigid body with its support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingleBody {
    /// Mass and inertia.
    pub body: RigidBody,
    /// How it is held.
    pub support: Support,
}

/// `ϱ = ϱ_I d_I`.
fn arm(anchor: &Vector3<f64>, q: &[f64]) -> Vector3<f64> {
    directors::triad(q) * anchor
}

impl SingleBody {
    /// A body and its support.
    #[must_use]
    pub fn new(body: RigidBody, support: Support) -> Self {
        Self { body, support }
    }

    /// Coordinates for a centre (m) and an orthonormal triad (columns `d_I`), shape 12.
    ///
    /// With a fixed point the centre follows from the triad, and `center` is not read.
    #[must_use]
    pub fn configuration(&self, center: &Vector3<f64>, triad: &Matrix3<f64>) -> [f64; 12] {
        let mut q = [0.0; FRAME];
        directors::set_triad(&mut q, triad);
        match self.support {
            Support::Free => q[..3].copy_from_slice(center.as_slice()),
            Support::FixedPoint { .. } => self.close_gap(&mut q),
        }
        q
    }

    /// The initial state of a motion at `q ∈ C` with velocity `v = P(q) ν`: `p(0) = M v`.
    ///
    /// `q`: shape 12; `nu`: `(φ̇, ω)` for a free body, `ω` for one with a fixed point.
    ///
    /// # Panics
    /// When `q` or `nu` has another length.
    #[must_use]
    pub fn start(&self, t: f64, q: &[f64], nu: &[f64]) -> State {
        assert_eq!((q.len(), nu.len()), (FRAME, self.dof()), "lengths of q and ν");
        let v = self.velocity(q, nu);
        State::new(t, q.to_vec(), self.body.momentum(&v).to_vec())
    }

    /// `v = P(q) ν`, shape 12.
    #[must_use]
    pub fn velocity(&self, q: &[f64], nu: &[f64]) -> [f64; 12] {
        let (velocity, omega) = match self.support {
            Support::Free => (Vector3::new(nu[0], nu[1], nu[2]), Vector3::new(nu[3], nu[4], nu[5])),
            Support::FixedPoint { anchor, .. } => {
                let omega = Vector3::new(nu[0], nu[1], nu[2]);
                (arm(&anchor, q).cross(&omega), omega)
            }
        };
        directors::spin_velocity(q, &velocity, &omega)
    }

    /// The mechanical system: mass matrix (58) and gravity `V = −(M γ)·q`, `γ` in m/s².
    ///
    /// Loads and further potentials can be added to it.
    #[must_use]
    pub fn system(&self, gravity: &Vector3<f64>) -> SeparableSystem {
        let mass = SparseMatrix::assemble(FRAME, FRAME, |out| self.body.emit_mass(0, out));
        let system = SeparableSystem::new(mass);
        if gravity.iter().all(|component| *component == 0.0) {
            return system;
        }
        let mut force = vec![0.0; FRAME];
        for k in 0..3 {
            force[k] = self.body.mass() * gravity[k];
        }
        system.potential(LinearPotential { force })
    }

    /// `φ ← x_0 − ϱ`; nothing for a free body.
    fn close_gap(&self, q: &mut [f64]) {
        if let Support::FixedPoint { anchor, point } = self.support {
            let center = point - arm(&anchor, q);
            q[..3].copy_from_slice(center.as_slice());
        }
    }
}

/// `(ϱ̂; −d̂_1; −d̂_2; −d̂_3)`: velocities for a given `ω` about the fixed point.
fn fixed_point_null_space(anchor: &Vector3<f64>, q: &[f64]) -> SMatrix<f64, 12, 3> {
    let mut out = SMatrix::<f64, 12, 3>::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(&skew(&arm(anchor, q)));
    for i in 0..3 {
        out.fixed_view_mut::<3, 3>(3 + 3 * i, 0).copy_from(&skew(&-director(q, i)));
    }
    out
}

impl Constraints for SingleBody {
    fn dim(&self) -> usize {
        FRAME
    }

    fn reflected(&self, q: &[f64]) -> Option<usize> {
        directors::is_reflected(q).then_some(0)
    }

    fn len(&self) -> usize {
        match self.support {
            Support::Free => INTERNAL,
            Support::FixedPoint { .. } => INTERNAL + 3,
        }
    }

    fn value(&self, Configuration { q, .. }: Configuration<'_>, out: &mut [f64]) {
        directors::internal_value(q, out);
        if let Support::FixedPoint { anchor, point } = self.support {
            let gap = directors::center(q) + arm(&anchor, q) - point;
            out[INTERNAL..].copy_from_slice(gap.as_slice());
        }
    }

    fn jacobian(&self, _t: f64, q: &[f64], out: &mut dyn Entries) {
        directors::internal_jacobian(q, 0, 0, out);
        if let Support::FixedPoint { anchor, .. } = self.support {
            for k in 0..3 {
                out.add(INTERNAL + k, k, 1.0);
                for i in 0..3 {
                    out.add(INTERNAL + k, 3 + 3 * i + k, anchor[i]);
                }
            }
        }
    }

    fn second_derivative(&self, _t: f64, _q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        directors::internal_second_derivative(v, w, out);
        out[INTERNAL..].fill(0.0); // r is linear in q
    }

    fn weighted_hessian(&self, _: f64, _: &[f64], w: &[f64], scale: f64, out: &mut dyn Entries) {
        directors::internal_weighted_hessian(w, scale, 0, out);
    }
}

impl Reparametrization for SingleBody {
    fn dof(&self) -> usize {
        match self.support {
            Support::Free => 6,
            Support::FixedPoint { .. } => 3,
        }
    }

    fn blocks(&self) -> Vec<UnknownBlock> {
        let block = |kind, range| UnknownBlock { kind, range, floor: INCREMENT_FLOOR };
        match self.support {
            Support::Free => {
                vec![block(BlockKind::Position, 0..3), block(BlockKind::Rotation, 3..6)]
            }
            Support::FixedPoint { .. } => vec![block(BlockKind::Rotation, 0..3)],
        }
    }

    fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>) {
        match self.support {
            Support::Free => out.copy_from(&null_space::matrix(q)),
            Support::FixedPoint { anchor, .. } => {
                out.copy_from(&fixed_point_null_space(&anchor, q))
            }
        }
    }

    fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        match self.support {
            Support::Free => {
                reparametrization::reparametrize(u, &s.q0, &mut s.q1, &mut s.dq)
                    .map_err(|refused| refused.fault(3))?;
                (0..12).for_each(|i| s.increment(i, s.dq[i]));
                Ok(())
            }
            Support::FixedPoint { anchor, .. } => {
                let theta = Vector3::new(u[0], u[1], u[2]);
                reparametrization::check_rotation(&theta).map_err(|refused| refused.fault(0))?;
                let turn = reparametrization::turn_directors(&theta, &s.q0, &mut s.q1, &mut s.dq);
                let change = -(turn * arm(&anchor, &s.q0));
                s.dq[..3].copy_from_slice(change.as_slice());
                self.close_gap(&mut s.q1);
                Ok(())
            }
        }
    }

    fn tangent(&self, u: &[f64], s: &Interval, out: &mut DMatrix<f64>) {
        match self.support {
            Support::Free => out.copy_from(&reparametrization::tangent(u, &s.q1)),
            Support::FixedPoint { anchor, .. } => {
                let T = rotation::tangent(&Vector3::new(u[0], u[1], u[2]));
                out.copy_from(&(fixed_point_null_space(&anchor, &s.q1) * T));
            }
        }
    }

    fn clean(&self, _t: f64, q: &mut [f64]) {
        if reparametrization::clean_directors(q) {
            self.close_gap(q);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertia::EulerMoments;
    use vi_core::MechanicalSystem;
    use vi_core::linear::norm_inf;
    use vi_testkit::Sample;

    fn bodies(sample: &mut Sample) -> [SingleBody; 2] {
        let body = RigidBody::new(1.7, EulerMoments([0.3, 0.7, 0.2])).unwrap();
        let held = Support::FixedPoint { anchor: sample.vector(), point: sample.vector() };
        [Support::Free, held].map(|support| SingleBody::new(body, support))
    }

    fn configuration(body: &SingleBody, sample: &mut Sample) -> [f64; 12] {
        let frame = sample.frame();
        let center = match body.support {
            Support::Free => directors::center(&frame),
            Support::FixedPoint { .. } => Vector3::repeat(f64::NAN), // not to be read
        };
        body.configuration(&center, &directors::triad(&frame))
    }

    fn increment(body: &SingleBody, sample: &mut Sample, angle: f64) -> Vec<f64> {
        let (shift, theta) = (sample.vector(), sample.of_length(angle));
        let all = [shift.x, shift.y, shift.z, theta.x, theta.y, theta.z];
        all[6 - body.dof()..].to_vec()
    }

    fn moved(body: &SingleBody, u: &[f64], q0: &[f64]) -> Interval {
        let mut s = Interval::new(12);
        s.open(0.0, 0.1, q0);
        body.reparametrize(u, &mut s).unwrap();
        s.close();
        s
    }

    fn gap(body: &SingleBody, q: &[f64]) -> f64 {
        let mut g = vec![0.0; body.len()];
        body.value(Configuration::new(0.0, q), &mut g);
        norm_inf(&g)
    }

    #[test]
    fn null_space_rank_and_constraints() {
        let mut sample = Sample::new(81);
        for _ in 0..100 {
            for body in bodies(&mut sample) {
                let q = configuration(&body, &mut sample);
                let (n, m, d) = (body.dim(), body.len(), body.dof());
                let mut P = DMatrix::from_element(n, d, f64::NAN); // may hold anything on entry
                body.null_space(&q, &mut P);
                let mut G = DMatrix::zeros(m, n);
                body.jacobian(0.0, &q, &mut G);
                let product = (&G * &P).amax();
                assert!(product < 1e-15, "G P = {product:e}");
                let smallest = P.singular_values().min();
                assert!(m + d == n && smallest > 0.9, "rank: σ_min = {smallest}");
                let nu: Vec<f64> = (0..d).map(|_| sample.number()).collect();
                let v = body.velocity(&q, &nu);
                let difference =
                    P * nalgebra::DVector::from_vec(nu) - SMatrix::<f64, 12, 1>::from(v);
                assert!(difference.amax() < 2e-15, "v off by {:e}", difference.amax());
            }
        }
    }

    #[test]
    fn the_map_stays_on_the_constraints_and_its_increment_is_consistent() {
        let mut sample = Sample::new(82);
        let (mut on, mut between) = (0.0_f64, 0.0_f64);
        for k in 0..200 {
            for body in bodies(&mut sample) {
                let q0 = configuration(&body, &mut sample);
                let u = increment(&body, &mut sample, 3.1 * f64::from(k) / 200.0);
                let s = moved(&body, &u, &q0);
                on = on.max(gap(&body, &s.q1));
                for i in 0..12 {
                    between = between.max((s.q1[i] - s.q0[i] - s.dq[i]).abs());
                }
            }
        }
        assert!(on < 2e-15, "g(F_d) = {on:e}");
        assert!(between < 4e-15, "q1 − q0 − dq = {between:e}");
    }

    #[test]
    fn the_tangent_matches_central_differences() {
        let mut sample = Sample::new(83);
        let mut worst = 0.0_f64;
        for k in 0..40 {
            for body in bodies(&mut sample) {
                let q0 = configuration(&body, &mut sample);
                let u = increment(&body, &mut sample, 3.0 * f64::from(k) / 40.0);
                let mut exact = DMatrix::from_element(12, body.dof(), f64::NAN);
                body.tangent(&u, &moved(&body, &u, &q0), &mut exact);
                let e = 1e-5;
                for j in 0..body.dof() {
                    let at = |by: f64| {
                        let mut u = u.clone();
                        u[j] += by;
                        moved(&body, &u, &q0).dq
                    };
                    let (plus, minus) = (at(e), at(-e));
                    for i in 0..12 {
                        worst = worst.max(((plus[i] - minus[i]) / (2.0 * e) - exact[(i, j)]).abs());
                    }
                }
            }
        }
        assert!(worst < 1e-9, "{worst:e}");
    }

    #[test]
    fn the_start_carries_momentum_and_energy() {
        let mut sample = Sample::new(86);
        for body in bodies(&mut sample) {
            let q = configuration(&body, &mut sample);
            let nu: Vec<f64> = (0..body.dof()).map(|_| sample.number()).collect();
            let state = body.start(0.5, &q, &nu);
            let system = body.system(&Vector3::new(0.0, 0.0, -9.81));
            let v = body.velocity(&q, &nu);
            let pv: f64 = state.p.iter().zip(&v).map(|(p, v)| p * v).sum();
            let energy = system.kinetic_energy(&v);
            assert!((0.5 * pv - energy).abs() < 1e-15, "{} against {energy}", 0.5 * pv);
            let height = system.potential_energy(Configuration::new(0.0, &q)) / (1.7 * 9.81);
            assert!((height - q[2]).abs() < 1e-15, "V = m g z: {height} against {}", q[2]);
            assert_eq!((state.t, state.step), (0.5, 0));
        }
    }

    #[test]
    fn too_large_rotations_name_their_unknown() {
        let mut sample = Sample::new(87);
        for (body, unknown) in bodies(&mut sample).into_iter().zip([3, 0]) {
            let q = configuration(&body, &mut sample);
            let u = increment(&body, &mut sample, 3.5);
            let mut s = Interval::new(12);
            s.open(0.0, 0.1, &q);
            let fault = body.reparametrize(&u, &mut s).unwrap_err();
            let named = matches!(fault, Fault::OutsideChart { unknown: at, .. } if at == unknown);
            assert!(named, "{fault:?}");
            assert_eq!(s.q1, q, "left as it was");
        }
    }
}
