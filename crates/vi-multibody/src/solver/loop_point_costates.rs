//! [`CostateSweep`] of Galerkin steps on closed loops of few degrees of freedom, on the null space
//! of all constraints.
//!
//! ```text
//! P_iᵀ w_i = J_iᵀ Λ_c,i,   J_i = G_c(q_i) P(q_i),   J_i Z_i = 0,   N_i = P(q_i) Z_i
//! Σ_i N_jᵀ (h H_ij)ᵀ N_i y_i = N_jᵀ (δ_js h a' + (h H_sj)ᵀ b')      j = 1 … s, i = 0 … s − 1      [2.50]
//! x_i = −N_i y_i,   x_s = b',   b = x_0,   a = Σ_i H_i0ᵀ x_i
//! G_jᵀ σ_j = δ_js a' + Σ_i H_ijᵀ x_i
//! ```
//! `h H_ij` has the curvature of all constraints at `0 < i = j < s`, by what the joints transmit
//! ([`JointNodes`]) and by the rows of closure. The matrix is dense, `s f × s f` for `f` degrees of
//! freedom.
#![allow(non_snake_case)] // G, H, J, K, M, N, P, Z

use super::joint_costates::JointNodes;
use super::loop_costates::{MOST_ROWS, multipliers, project};
use super::tree_step::workspace::Workspace;
use crate::constraint::scalar_constraint::ScalarRow;
use crate::mechanism::Mechanism;
use crate::sweep::point_costate::PointTree;
use nalgebra::DMatrix;
use vi_constraints::Constraints;
use vi_constraints::costate_sweep::{CostateSweep, CostateTangents, PartVisitor};
use vi_constraints::design::Costates;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::galerkin::{GaussSlopes, Parts};
use vi_constraints::linearization::Costate;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::dense::PivotedQr;
use vi_core::galerkin::Stages;
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, Singular, dot};
use vi_core::{DiscreteLagrangian, MechanicalSystem, SeparableSystem};

/// Unknowns of a step up to which its matrix is dense.
const MOST_UNKNOWNS: usize = 48;

/// The costates of closed loops.
#[derive(Debug)]
pub(in crate::solver) struct LoopPointCostates {
    points: ControlPoints,
    parts: Parts,
    slopes: Option<GaussSlopes>,
    at: Workspace,
    all: PointTree,
    rows: Vec<ScalarRow>, // of closure
    places: Vec<usize>,   // of them among all constraints
    joints: JointNodes,
    stands: Vec<PointScratch>, // s + 1
    balance: Vec<Vec<f64>>,    // s × n  w_i, then y_i of the joints
    impulses: Vec<Vec<f64>>,   // s × m  Λ_i
    sigma: Vec<Vec<f64>>,      // s × m  σ_1 … σ_s, where they are wanted
    x: Vec<Vec<f64>>,          // (s + 1) × n
    images: Vec<Vec<f64>>,     // (s + 1) × n  of one vector, then Σ_i (h H_ij)ᵀ x_i
    along: Vec<f64>,           // d
    gradient: Vec<f64>,        // n
    inertial: Vec<f64>,        // n
    square: DMatrix<f64>,      // s f × s f
    lu: DenseLu,
    y: Vec<f64>, // s f
}

/// A control point.
#[derive(Debug)]
struct PointScratch {
    jacobian: Vec<Vec<f64>>, // of all rows of closure, d  Jᵀ
    qr: PivotedQr,           // d × rows  Jᵀ; its first pivots are the chosen rows
    lambda: Vec<f64>,        // of the chosen ones
    free: DMatrix<f64>,      // d × f  Z
    basis: DMatrix<f64>,     // n × f  N
}

impl PointScratch {
    fn new(rows: usize, rank: usize, n: usize, d: usize) -> Self {
        Self {
            jacobian: vec![vec![0.0; d]; rows],
            qr: PivotedQr::new(d, rows),
            lambda: vec![0.0; rank],
            free: DMatrix::zeros(d, d - rank),
            basis: DMatrix::zeros(n, d - rank),
        }
    }

    /// Factorizes `Jᵀ`; `Z`.
    fn factorize(&mut self) {
        let Self { jacobian, qr, lambda, free, .. } = self;
        for (own, to) in jacobian.iter().zip(qr.matrix_mut().column_iter_mut()) {
            to.into_iter().zip(own).for_each(|(to, own)| *to = *own);
        }
        qr.factorize();
        free.fill(0.0);
        (0..free.ncols()).for_each(|k| free[(lambda.len() + k, k)] = 1.0);
        qr.apply_q(free);
    }

    /// `x ← x − G_cᵀ λ` with `Jᵀ λ = along`; `along` is `Pᵀ x`. Writes `λ` to its places.
    fn close(
        &mut self,
        rows: &[ScalarRow],
        places: &[usize],
        q: &[f64],
        along: &mut [f64],
        x: &mut [f64],
        out: &mut [f64],
    ) -> Result<(), Singular> {
        multipliers(&self.qr, along, &mut self.lambda)?;
        places.iter().for_each(|&place| out[place] = 0.0);
        for (row, lambda) in self.qr.pivots().iter().zip(&self.lambda) {
            rows[*row].add_gradient(q, -*lambda, x);
            out[places[*row]] = *lambda;
        }
        Ok(())
    }
}

impl LoopPointCostates {
    /// `None` where it does not apply: beside point masses, constraints on velocities, internal
    /// variables, interpolated strains, many rows of loops or nearly redundant ones, no degree of
    /// freedom or many; of trees.
    pub(in crate::solver) fn new(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        independent: &IndependentRows,
        stages: Stages,
        along: CostateTangents,
    ) -> Option<Self> {
        let (n, m, d) = (mechanism.dim(), mechanism.len(), mechanism.tree().dof());
        let (s, rows) = (stages.count(), mechanism.loop_constraints());
        let rank = (independent.len() + rows.len()).checked_sub(m)?;
        let free = d.checked_sub(rank)?;
        let applies = mechanism.description().particles.is_empty()
            && !mechanism.has_velocity_constraints()
            && mechanism.nearly_redundant().is_none()
            && (1..=MOST_ROWS).contains(&rank)
            && (1..=MOST_UNKNOWNS).contains(&(s * free))
            && system.internal_variables() == 0
            && system.interpolation().is_none();
        let at = applies.then(|| Workspace::new(mechanism, system)).flatten()?;
        let points = ControlPoints::new(n, stages);
        let slots = at.links.iter().filter_map(|link| link.slot).max().map_or(0, |last| last + 1);
        let vectors = |count: usize, length: usize| vec![vec![0.0; length]; count];
        let wanted = if along == CostateTangents::OfMechanism { 0 } else { s };
        Some(Self {
            parts: Parts::new(n, m, stages),
            slopes: system.has_variable_forces().then(|| GaussSlopes::new(stages)),
            all: PointTree::new(&at.links, slots, d, &points.constants().K),
            at,
            places: mechanism.loop_rows(),
            joints: JointNodes::new(mechanism, s + 1),
            stands: (0..=s).map(|_| PointScratch::new(rows.len(), rank, n, d)).collect(),
            rows,
            points,
            balance: vectors(s, n),
            impulses: vectors(s, m),
            sigma: vectors(wanted, m),
            x: vectors(s + 1, n),
            images: vectors(s + 1, n),
            along: vec![0.0; d],
            gradient: vec![0.0; n],
            inertial: vec![0.0; n],
            square: DMatrix::zeros(s * free, s * free),
            lu: DenseLu::new(s * free),
            y: vec![0.0; s * free],
        })
    }

    /// Stands at the control points of a step from `p̄_n`: `N_i`, and `Λ_i`, which balance `w_i`.
    fn stand(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        points: &[Interval],
        p: &[f64],
    ) -> Result<(), Singular> {
        let Self { points: own, parts, slopes, at, all, rows, places, joints, stands, .. } = self;
        own.take(points, p);
        own.evaluate(system);
        parts.stand(own);
        parts.stand_between(own);
        if let Some(slopes) = slopes {
            slopes.differentiate(system, own);
        }
        joints.go_back();
        for (l, stand) in stands.iter_mut().enumerate() {
            let q = own.q(l);
            at.open_back([q, q]);
            project(at, rows, q, &mut self.gradient, &mut stand.jacobian);
            stand.factorize();
            all.stand(&at.links, l, q);
            let PointScratch { free, basis, .. } = &mut *stand;
            for (Z, mut N) in free.column_iter().zip(basis.column_iter_mut()) {
                all.push_forward(&at.links, l, Z.as_slice(), N.as_mut_slice());
            }
            let Some(w) = self.balance.get_mut(l) else { continue };
            own.balance(system, l, w);
            let q = own.q(l);
            at.pull_back_of(q, w, &mut self.along);
            let impulse = &mut self.impulses[l];
            stand.close(rows, places, q, &mut self.along, w, impulse)?;
            joints.balance(mechanism, l, q, w, impulse)?;
        }
        Ok(())
    }

    /// `images_j ← images_j + (h H_ij)ᵀ v`, `j = 0 … s`.
    fn add_images(&mut self, system: &SeparableSystem, i: usize, v: &[f64]) {
        let Self { points, slopes, rows, joints, stands, images, inertial, .. } = self;
        inertial.fill(0.0);
        system.mass().mul_add(1.0, v, inertial);
        for (j, image) in images.iter_mut().enumerate() {
            let K = points.constants().K[(i, j)];
            image.iter_mut().zip(&*inertial).for_each(|(image, x)| *image += K * x);
        }
        if let Some(slopes) = slopes {
            slopes.add_transposed(points, i, v, images);
        }
        let Some(w) = self.balance.get(i) else { return };
        let (h, q) = (points.h(), points.q(i));
        let bend = &mut self.gradient;
        bend.fill(0.0);
        joints.bend(q, [&self.impulses[i], w], v, bend);
        for (row, lambda) in stands[i].qr.pivots().iter().zip(&stands[i].lambda) {
            rows[*row].add_bend(q, v, *lambda, bend);
        }
        images[i].iter_mut().zip(&*bend).for_each(|(image, bend)| *image -= h * bend);
    }

    fn clear_images(&mut self) {
        self.images.iter_mut().for_each(|image| image.fill(0.0));
    }

    /// `Σ_j N_jᵀ` of the images at `j = 1 … s`.
    fn projected(&self) -> impl Iterator<Item = f64> + '_ {
        let pairs = self.stands[1..].iter().zip(&self.images[1..]);
        pairs.flat_map(|(stand, image)| stand.basis.column_iter().map(|N| dot(N.as_slice(), image)))
    }

    /// Finds `x_i` from the costates at the end of the step.
    fn solve(&mut self, system: &SeparableSystem, costate: &Costate) -> Result<(), Singular> {
        let (s, h, f) = (self.points.stages(), self.points.h(), self.stands[0].free.ncols());
        for column in 0..s * f {
            let i = column / f;
            self.clear_images();
            let N = self.stands[i].basis.column(column % f).clone_owned();
            self.add_images(system, i, N.as_slice());
            let entries: Vec<f64> = self.projected().collect();
            self.square.column_mut(column).copy_from_slice(&entries);
        }
        self.clear_images();
        self.add_images(system, s, &costate.p);
        self.images[s].iter_mut().zip(&costate.q).for_each(|(image, a)| *image += h * a);
        let right: Vec<f64> = self.projected().collect();
        self.y.copy_from_slice(&right);
        self.lu.solve(&self.square, &mut self.y)?;
        for (i, y) in self.y.chunks_exact(f).enumerate() {
            let x = &mut self.x[i];
            x.fill(0.0);
            for (y, N) in y.iter().zip(self.stands[i].basis.column_iter()) {
                x.iter_mut().zip(&N).for_each(|(x, N)| *x -= y * N);
            }
        }
        self.x[s].copy_from_slice(&costate.p);
        Ok(())
    }

    /// The costate at `q_n`, and `σ_j`.
    fn give(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        let (s, h) = (self.points.stages(), self.points.h());
        self.clear_images();
        for i in 0..=s {
            let x = std::mem::take(&mut self.x[i]);
            self.add_images(system, i, &x);
            self.x[i] = x;
        }
        let Self { points, at, rows, places, joints, stands, images, along, sigma, .. } = self;
        for (j, sigma) in (1..).zip(sigma) {
            let (image, q) = (&mut images[j], points.q(j));
            image.iter_mut().for_each(|image| *image /= h);
            if j == s {
                image.iter_mut().zip(&costate.q).for_each(|(image, a)| *image += a);
            }
            at.open_back([q, q]);
            at.pull_back_of(q, image, along);
            stands[j].close(rows, places, q, along, image, sigma)?;
            joints.press(mechanism, j, q, image, sigma)?;
        }
        let Costate { q: a, p: b, .. } = costate;
        a.iter_mut().zip(&images[0]).for_each(|(a, image)| *a = image / h);
        b.copy_from_slice(&self.x[0]);
        Ok(())
    }
}

impl CostateSweep<SeparableSystem, Mechanism> for LoopPointCostates {
    fn momentum(&mut self, _: &SeparableSystem, _: &Interval, _: &mut [f64]) {}

    fn hold(&mut self, _: &SeparableSystem, _: &[Interval], _: &mut Costate) {}

    fn pull(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        self.stand(system, mechanism, points, p)?;
        self.solve(system, costate)?;
        self.give(system, mechanism, costate)?;
        self.parts.spread(self.points.constants(), &self.x);
        Ok(())
    }

    fn for_each_part(&self, _: &[Interval], visit: &mut PartVisitor<'_>) {
        let s = self.parts.stages();
        for k in 0..if self.sigma.is_empty() { s } else { 2 * s } {
            let (place, impulse) = self.parts.part(k, &self.impulses);
            let costates: Costates<'_> = self.parts.costates(k, &self.sigma);
            visit(place, impulse, costates);
        }
    }
}
