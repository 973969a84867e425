//! Control points of a step: their configurations, the forces at the Gauss nodes, the derivatives
//! of the action.
//!
//! Letters: `K, E, D` of [`GaussLobatto`], `Q_k, V_k` position and velocity at a Gauss node,
//! `Δ_j = q_j − q_n`.
#![allow(non_snake_case)] // K, E, D

use crate::scheme::SubStep;
use vi_core::galerkin::{GaussLobatto, GaussPoint, Stages};
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::Interval;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::state::State;

/// The control points of a step with the derivatives of its action.
#[derive(Debug)]
pub struct ControlPoints {
    constants: GaussLobatto,
    points: Vec<Interval>,   // s  q_n → q_j, j = 1 … s
    p: Vec<f64>,             // n  p̄_n
    gauss: Vec<GaussPoint>,  // s
    forces: Vec<Vec<f64>>,   // s × n  f − ∇V
    impulses: Vec<Vec<f64>>, // (s + 1) × n  of interpolated strains, where there are any
    mixed: Vec<f64>,         // n  Σ_j K_ij Δ_j
    internal: Vec<f64>,      // at the end of the step, where they follow it
}

impl ControlPoints {
    /// For `n` coordinates.
    #[must_use]
    pub fn new(n: usize, stages: Stages) -> Self {
        let (s, zeros) = (stages.count(), || vec![0.0; n]);
        let constants = GaussLobatto::new(stages);
        let node =
            |&weight: &f64| GaussPoint { weight, q: zeros(), v: zeros(), ..GaussPoint::default() };
        Self {
            points: vec![Interval::new(n); s],
            p: zeros(),
            gauss: constants.gauss_weights.iter().map(node).collect(),
            forces: vec![zeros(); s],
            impulses: Vec::new(),
            mixed: zeros(),
            internal: Vec::new(),
            constants,
        }
    }

    /// `c̃, b̃, K, E, D`.
    #[must_use]
    pub fn constants(&self) -> &GaussLobatto {
        &self.constants
    }

    /// Opens a step at a state: all control points on `q_n`.
    pub fn open(&mut self, step: SubStep, state: &State) {
        self.open_ends(step, state);
        let Self { constants, points, .. } = self;
        let last = points.len() - 1;
        for (j, point) in points[..last].iter_mut().enumerate() {
            let h = constants.nodes[j + 1] * step.h;
            SubStep { h, t_end: state.t + h, ..step }.open(point, state);
        }
    }

    /// Opens the interval of the step alone. Of the control points between its ends only increments
    /// are then used ([`ControlPoints::increments_mut`]).
    pub fn open_ends(&mut self, step: SubStep, state: &State) {
        let Self { constants, points, p, gauss, .. } = self;
        let last = points.len() - 1;
        step.open(&mut points[last], state);
        for (node, c) in gauss.iter_mut().zip(&constants.gauss_nodes) {
            node.t = state.t + c * step.h;
        }
        p.copy_from_slice(&state.p);
    }

    /// Takes the control points of a step from the momentum `p̄_n`: `(q_n, q_j)`, `j = 1 … s`, the
    /// last of which is the step; of the others increments alone.
    pub fn take(&mut self, from: &[Interval], p: &[f64]) {
        let Self { constants, points, gauss, .. } = self;
        let last = points.len() - 1;
        let step = &from[last];
        for (j, (point, own)) in points.iter_mut().zip(from).enumerate() {
            if j == last {
                point.copy_from(step);
                continue;
            }
            let h = constants.nodes[j + 1] * step.h;
            point.open_within(step, h);
            point.end_at(step.t + h);
            point.dq.copy_from_slice(&own.dq);
            point.close_from_increment();
        }
        for (node, c) in gauss.iter_mut().zip(&constants.gauss_nodes) {
            node.t = step.t + c * step.h;
        }
        self.p.copy_from_slice(p);
    }

    /// The polynomial through the control points.
    #[must_use]
    pub fn polynomial(&self) -> StepPolynomial<'_> {
        StepPolynomial { constants: &self.constants, points: &self.points }
    }

    /// `h`, s.
    #[must_use]
    pub fn h(&self) -> f64 {
        self.step().h
    }

    /// `s`.
    #[must_use]
    pub fn stages(&self) -> usize {
        self.points.len()
    }

    /// `q_i`, `i = 0 … s`, shape `n`.
    #[must_use]
    pub fn q(&self, i: usize) -> &[f64] {
        self.polynomial().q(i)
    }

    /// `t_n + c̃_i h`, `i = 0 … s`, s.
    #[must_use]
    pub fn time(&self, i: usize) -> f64 {
        if i == 0 { self.step().t } else { self.points[i - 1].t_end() }
    }

    /// `(q_n, q_j)`, `j = 1 … s`.
    #[must_use]
    pub fn point(&self, j: usize) -> &Interval {
        &self.points[j - 1]
    }

    /// The same, to move `q_j`.
    pub fn point_mut(&mut self, j: usize) -> &mut Interval {
        &mut self.points[j - 1]
    }

    /// `p̄_n`, shape `n`.
    #[must_use]
    pub fn momentum(&self) -> &[f64] {
        &self.p
    }

    /// `Δ_j`, `j = 1 … s`, shape `n`.
    pub fn increments_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.points[j - 1].dq
    }

    /// `f − ∇V` at Gauss node `k` of the last [`ControlPoints::evaluate`], shape `n`.
    #[must_use]
    pub fn force(&self, k: usize) -> &[f64] {
        &self.forces[k]
    }

    /// The same, to add what acts beside the system, with the node.
    pub fn force_mut(&mut self, k: usize) -> (&GaussPoint, &mut [f64]) {
        (&self.gauss[k], &mut self.forces[k])
    }

    /// `out ← out +` the impulse of the forces at the Gauss nodes on control point `i`, shape `n`.
    pub fn add_impulse(&self, i: usize, out: &mut [f64]) {
        let Self { constants, forces, .. } = self;
        for (k, force) in forces.iter().enumerate() {
            let impulse = self.h() * constants.gauss_weights[k] * constants.E[(k, i)];
            out.iter_mut().zip(force).for_each(|(w, f)| *w += impulse * f);
        }
    }

    /// `out ← Σ_j K_ij Δ_j`, shape `n`.
    pub fn mix(&self, i: usize, out: &mut [f64]) {
        out.fill(0.0);
        for (j, point) in self.points.iter().enumerate() {
            let K = self.constants.K[(i, j + 1)];
            out.iter_mut().zip(&point.dq).for_each(|(y, dq)| *y += K * dq);
        }
    }

    /// `(q_n, q_{n+1})`.
    #[must_use]
    pub fn step(&self) -> &Interval {
        self.polynomial().step()
    }

    /// The same, to put back that of another step.
    pub fn step_mut(&mut self) -> &mut Interval {
        let last = self.points.len() - 1;
        &mut self.points[last]
    }

    /// The Gauss nodes of the last [`ControlPoints::evaluate`].
    #[must_use]
    pub fn gauss(&self) -> &[GaussPoint] {
        &self.gauss
    }

    /// Computes positions and velocities at the Gauss nodes from the control points.
    pub fn interpolate(&mut self) {
        let Self { constants, points, gauss, .. } = self;
        let step = &points[points.len() - 1];
        for (k, node) in gauss.iter_mut().enumerate() {
            node.q.copy_from_slice(&step.q0);
            node.v.fill(0.0);
            for (j, point) in points.iter().enumerate() {
                let (E, D) = (constants.E[(k, j + 1)], constants.D[(k, j + 1)] / step.h);
                for ((q, v), dq) in node.q.iter_mut().zip(&mut node.v).zip(&point.dq) {
                    *q += E * dq; // Q_k, V_k  [2.25]
                    *v += D * dq;
                }
            }
        }
    }

    /// Computes positions, velocities, internal variables and forces at the Gauss nodes from the
    /// control points.
    pub fn evaluate(&mut self, system: &impl MechanicalSystem) {
        self.interpolate();
        let Self { constants, points, gauss, forces, impulses, internal, .. } = self;
        let s = &points[points.len() - 1];
        system.collocate(s, constants, gauss, internal);
        for (node, force) in gauss.iter().zip(forces) {
            force.fill(0.0);
            system.add_gauss_force(node.place(s).moving(&node.v), force);
        }
        if let Some(strains) = system.interpolation() {
            impulses.resize_with(points.len() + 1, || vec![0.0; system.dim()]);
            impulses.iter_mut().for_each(|impulse| impulse.fill(0.0));
            strains.add_impulses(&StepPolynomial { constants, points }, impulses); // [6.33]
        }
    }

    /// Internal variables at the end of the step of the last [`ControlPoints::evaluate`].
    pub fn write_internal(&self, out: &mut [f64]) {
        if !self.internal.is_empty() {
            out.copy_from_slice(&self.internal);
        }
    }

    /// `out ← w_i = δ_i0 p̄_n + ∂_i L_d + f_i` [2.26], shape `n`, kg·m/s; `w_s = p̄_{n+1}`.
    pub fn balance(&mut self, system: &impl MechanicalSystem, i: usize, out: &mut [f64]) {
        let mut mixed = std::mem::take(&mut self.mixed);
        self.mix(i, &mut mixed);
        if i == 0 {
            out.copy_from_slice(&self.p);
        } else {
            out.fill(0.0);
        }
        if let Some(impulse) = self.impulses.get(i) {
            out.iter_mut().zip(impulse).for_each(|(w, f)| *w += f);
        }
        self.add_impulse(i, out);
        system.mass().mul_add(1.0 / self.h(), &mixed, out);
        self.mixed = mixed;
    }
}
