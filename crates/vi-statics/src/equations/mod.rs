//! The equations of static equilibrium: residual and tangent.
//!
//! Frames and point masses have all their degrees of freedom as unknowns; joints, bars and scalar
//! constraints are enforced by multipliers. So trees, loops, redundant constraints and prescribed
//! motion are one case, and the tangent is exact and sparse.
//! ```text
//! w(q, μ, t) = ∇V(q) − f(t, q) + G(t, q)ᵀ μ                    n   residual force at rest
//! r_u = P_in(q)ᵀ w + σ S u = 0,    r_μ = g(t, q) = 0           unknowns u, μ;  q = F_d(u, q_last)
//! K   = [ P_inᵀ (∇²V − ∂f/∂q + Σ μ_i D²g_i) ∂F_d/∂u + Σ_I ŵ_I d̂_I + σ S    P_inᵀ Gᵀ ]
//!       [ G ∂F_d/∂u                                                        0       ]
//! ```
//! In a steady rotation the force of inertia `M W² (q − q_o)` is part of `w`, `M W²` and `−∂f/∂v W`
//! of dampers to the ground of `K` ([`crate::rotation`]).
//! `t` is the load parameter: loads and prescribed motions are taken at the time `t`. The rows of
//! `g` are an independent set, without the internal constraints of the frames, which `F_d`
//! satisfies. `σ S` is zero but for relaxation ([`crate::relaxation`]).
//!
//! Source: theory §6, "Statics".
#![allow(non_snake_case)] // K, G

use crate::field::Field;
use crate::rotation::SteadyRotation;
use crate::steady_motion::SteadyMotion;
use nalgebra::{DMatrix, Matrix3, Matrix6};
use vi_constraints::Constraints;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::linear::{SparseLu, norm_inf};
use vi_core::newton::{BlockKind, Fault, NewtonProblem, Precision, UnknownBlock};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{MechanicalSystem, SeparableSystem};
use vi_multibody::mechanism::{Description, Mechanism};
use vi_multibody::sparse_nodal::{MapColumns, ReducedMatrix, ReducedRows, VelocityLayout};
use vi_rigid::directors::director;
use vi_rigid::rotation::skew;

mod mixed;
mod path_stiffness;
mod rows;
mod scale;
mod solve;

/// Matrices in the velocities of all frames and point masses, sparse.
pub(crate) struct FrameMatrices {
    /// `∇²V − ∂f/∂q + M W² + …`, as for the tree.
    pub(crate) K: SparseMatrix,
    /// `2 M W − ∂f/∂v`.
    pub(crate) C: SparseMatrix,
    /// `M`.
    pub(crate) M: SparseMatrix,
    /// Independent rows of joints, bars and scalar constraints.
    pub(crate) B: SparseMatrix,
    pub(crate) columns: MapColumns,
}

/// The equations at the last equilibrium, with the workspace of an evaluation.
pub(crate) struct EquilibriumEquations {
    pub(crate) system: SeparableSystem,
    pub(crate) mechanism: Mechanism,
    pub(crate) t: f64,      // load parameter
    pub(crate) s: Interval, // q0: last equilibrium
    pub(crate) rows: IndependentRows,
    pub(crate) mu: Vec<f64>,    // m  of the last evaluation
    pub(crate) force: Vec<f64>, // n  w
    pub(crate) sigma: f64,
    rotation: Option<Field>,
    v: Vec<f64>,      // n  velocities of the steady rotation; zero without one
    metric: Vec<f64>, // d  S: 1 for lengths, the square of the size for angles
    layout: VelocityLayout,
    left: MapColumns,  // P_in(q)
    right: MapColumns, // ∂F_d/∂u
    g: Vec<f64>,       // m
    spin: Vec<Matrix6<f64>>,
    pub(crate) tangent_stresses: Option<Vec<f64>>, // ν; none: those of the configuration
    stiffness: ReducedMatrix,
    upper: ReducedRows, // G P_in
    lower: ReducedRows, // G ∂F_d/∂u
    scale: Vec<f64>,    // d + rows, powers of two
    factors: Option<(SparseMatrix, SparseLu)>,
}

/// Adds `Gᵀ μ` to a vector, entry by entry.
struct Transposed<'a> {
    mu: &'a [f64],
    out: &'a mut [f64],
}

impl Entries for Transposed<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.out[column] += value * self.mu[row];
    }
}

/// Columns of the system without joints and bars.
pub(crate) fn separate(mechanism: &Mechanism) -> VelocityLayout {
    let whole = mechanism.description();
    let description = Description {
        dimension: whole.dimension,
        bodies: whole.bodies.clone(),
        particles: whole.particles.clone(),
        ..Description::default()
    };
    VelocityLayout::new(&Mechanism::new(description))
}

impl EquilibriumEquations {
    /// At the configuration `q` and the load parameter `t`.
    pub(crate) fn new(system: SeparableSystem, mechanism: Mechanism, t: f64, q: &[f64]) -> Self {
        let layout = separate(&mechanism);
        let (n, d) = (layout.dim(), layout.dof());
        let mut s = Interval::new(n);
        s.open(0.0, 1.0, q);
        s.angles = mechanism.principal_angles(q);
        let m = mechanism.len();
        let frames = mechanism.description().bodies.len();
        let mut work = Self {
            rows: IndependentRows::choose(m, &[]),
            mu: vec![0.0; m],
            force: vec![0.0; n],
            sigma: 0.0,
            rotation: None,
            v: vec![0.0; n],
            metric: vec![1.0; d],
            left: layout.columns(),
            right: layout.columns(),
            g: vec![0.0; m],
            spin: vec![Matrix6::zeros(); frames],
            tangent_stresses: None,
            stiffness: ReducedMatrix::default(),
            upper: ReducedRows::default(),
            lower: ReducedRows::default(),
            scale: Vec::new(),
            factors: None,
            system,
            mechanism,
            t,
            s,
            layout,
        };
        let size = work.size();
        for block in work.layout.blocks() {
            if block.kind == BlockKind::Rotation {
                work.metric[block.range].fill(size * size);
            }
        }
        work.rows = work.independent_rows();
        work.scale = vec![1.0; d + work.rows.len()];
        work
    }

    /// Number of unknowns `u`.
    pub(crate) fn unknowns(&self) -> usize {
        self.metric.len()
    }

    /// Units and scales of the unknowns `(u, μ)`.
    pub(crate) fn blocks(&self) -> Vec<UnknownBlock> {
        let mut blocks = self.layout.blocks();
        let length = 1e-5 * self.reach().max(1e-5);
        for block in &mut blocks {
            block.floor = if block.kind == BlockKind::Rotation { 1e-5 } else { length };
        }
        let d = self.unknowns();
        // multipliers follow from the rest: they converge with the configuration
        let multipliers = d..d + self.rows.len();
        blocks.push(UnknownBlock {
            kind: BlockKind::Multiplier,
            range: multipliers,
            floor: f64::INFINITY,
        });
        blocks
    }

    /// `r(u, μ)`; stores `q`, `P_in(q)`, `w` for the tangent.
    pub(crate) fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let (u, mu) = x.split_at(self.unknowns());
        self.layout.reparametrize(u, &mut self.s)?;
        let (t, q) = (self.t, &self.s.q1);
        let at = Configuration { t, ..self.s.end() };
        self.layout.null_space(q, &mut self.left);
        self.rows.scatter(mu, &mut self.mu);
        if let Some(field) = &self.rotation {
            field.velocity(q, &mut self.v);
        }
        self.system.net_force(at.moving(&self.v), &mut self.force);
        if let Some(field) = &self.rotation {
            field.add_inertia(self.system.mass(), &self.v, &mut self.force); // [6.28]
        }
        self.mechanism.jacobian(t, q, &mut Transposed { mu: &self.mu, out: &mut self.force });
        let (balance, closure) = r.split_at_mut(u.len());
        self.layout.pull_back(&self.left, &self.force, balance);
        for ((r, s), u) in balance.iter_mut().zip(&self.metric).zip(u) {
            *r += self.sigma * s * u;
        }
        self.mechanism.value(at, &mut self.g);
        self.rows.gather(&self.g, closure);
        Ok(())
    }

    /// `out ← ∂r/∂t` at the point last evaluated; the forces by a central difference, exact where
    /// their histories are linear.
    pub(crate) fn parameter_slope(&mut self, out: &mut [f64]) {
        let (t, q, n) = (self.t, &self.s.q1, self.force.len());
        let step = 1e-4 * t.abs().max(1.0);
        let (mut after, mut before) = (vec![0.0; n], vec![0.0; n]);
        let end = self.s.end();
        self.system.net_force(Configuration { t: t + step, ..end }.moving(&self.v), &mut after);
        self.system.net_force(Configuration { t: t - step, ..end }.moving(&self.v), &mut before);
        after.iter_mut().zip(&before).for_each(|(a, b)| *a = (*a - b) / (2.0 * step));
        let d = self.unknowns();
        let (balance, closure) = out.split_at_mut(d);
        self.layout.pull_back(&self.left, &after, balance);
        let mut rates = vec![0.0; self.g.len()];
        self.mechanism.time_derivative(t, q, &mut rates);
        self.rows.gather(&rates, closure);
    }

    /// `Σ_I ŵ_I d̂_I` of each frame: the derivative of `P_in` in the direction of a rotation.
    fn fill_spin(&mut self) {
        let mut spin = std::mem::take(&mut self.spin);
        self.spin_of(&self.tangent_force(), &mut spin);
        self.spin = spin;
    }

    /// The same of any force, shape `n`.
    pub(super) fn spin_of(&self, force: &[f64], spin: &mut [Matrix6<f64>]) {
        let q = &self.s.q1;
        for (k, spin) in spin.iter_mut().enumerate() {
            let (frame, w) = (&q[12 * k..12 * k + 12], &force[12 * k..12 * k + 12]);
            let hats = (0..3).map(|i| skew(&director(w, i)) * skew(&director(frame, i)));
            spin.fixed_view_mut::<3, 3>(3, 3).copy_from(&hats.sum::<Matrix3<f64>>());
        }
    }

    /// The configuration last evaluated.
    pub(crate) fn here(&self) -> Configuration<'_> {
        Configuration { t: self.t, ..self.s.end() }
    }

    /// `∇²V − ∂f/∂q + M W² − ∂f/∂v W + Σ μ_i D²g_i` at the point last evaluated.
    fn emit_stiffness(&self, out: &mut dyn Entries) {
        match &self.tangent_stresses {
            Some(nu) => self.system.stressed_stiffness(self.here().moving(&self.v), nu, out),
            None => self.system.stiffness(self.here().moving(&self.v), out),
        }
        if let Some(field) = &self.rotation {
            field.emit_stiffness(self.system.mass(), out);
            let dampers = |out: &mut dyn Entries| {
                self.system.damping_to_ground(self.here().moving(&self.v), out);
            };
            field.emit_circulation(&dampers, out);
        }
        self.mechanism.weighted_hessian(self.t, &self.s.q1, &self.mu, 1.0, out);
    }

    /// The same with these slopes of forces by position and by what the motion carries along.
    fn emit_moving_stiffness(&self, slopes: &DMatrix<f64>, out: &mut dyn Entries) {
        self.system.potential_stiffness(self.here(), out);
        for (k, slope) in slopes.iter().enumerate().filter(|(_, slope)| **slope != 0.0) {
            out.add(k % slopes.nrows(), k / slopes.nrows(), *slope);
        }
        if let Some(field) = &self.rotation {
            field.emit_stiffness(self.system.mass(), out);
        }
        self.mechanism.weighted_hessian(self.t, &self.s.q1, &self.mu, 1.0, out);
    }

    fn fill_rows(&mut self) {
        let (mechanism, rows, s, t) = (&self.mechanism, &self.rows, &self.s, self.t);
        let place = JacobianPlace { row: 0, column: 0, scale: 1.0, transposed: false };
        let emit = |out: &mut dyn Entries| {
            rows.emit_jacobian(mechanism, Configuration::new(t, &s.q1), place, out)
        };
        self.upper.fill(&self.layout, &emit, &self.left);
        self.lower.fill(&self.layout, &emit, &self.right);
    }

    /// Fills the tangent at the point last evaluated.
    pub(crate) fn fill_tangent(&mut self, x: &[f64]) {
        let d = self.unknowns();
        self.layout.tangent(&x[..d], &self.s, &mut self.right);
        self.fill_spin();
        let mut stiffness = std::mem::take(&mut self.stiffness);
        let emit = |out: &mut dyn Entries| self.emit_stiffness(out);
        stiffness.fill(&self.layout, &emit, &self.left, &self.right, &self.spin);
        self.stiffness = stiffness;
        self.fill_rows();
    }

    /// `x ← (u, μ)` of least `|P_inᵀw|` (in the metric `S`): the multipliers that
    /// balance the forces at the last equilibrium best; returns the residual `|r_u|_∞`.
    pub(crate) fn balance(&mut self, x: &mut [f64]) -> Result<f64, Fault> {
        let d = self.unknowns();
        x.fill(0.0);
        let mut r = vec![0.0; x.len()];
        let sigma = std::mem::replace(&mut self.sigma, 0.0);
        self.evaluate(x, &mut r)?;
        self.fill_tangent(x);
        self.sigma = 1.0;
        r[d..].fill(0.0);
        let solved = self.solve_with(0.0, &mut r);
        self.sigma = 0.0;
        solved?;
        for (x, r) in x[d..].iter_mut().zip(&r[d..]) {
            *x = -r;
        }
        self.evaluate(x, &mut r)?;
        self.sigma = sigma;
        Ok(norm_inf(&r[..d]))
    }

    /// Whether the tangent at the last equilibrium is singular to working precision: whether a
    /// force `b` spread over all directions moves something about `1/ε` times as far as the
    /// stiffness would let it, by `z = K⁻¹ b`. A slender beam bends as far. Its stiffness along `z`
    /// shows in the residual, `z·(r(ηz) − r(0))/η = z·b`, whereas that of a neutral direction is
    /// round-off in both.
    pub(crate) fn is_neutral(&mut self, x: &[f64]) -> bool {
        const FAR: f64 = 1e13;
        const ALIKE: f64 = 0.25; // of round-off they are millions apart
        const SHORT: [f64; 2] = [1e-8, 3e-8]; // parts of the size
        let (d, mut z) = (self.unknowns(), vec![0.0; x.len()]);
        if self.evaluate(x, &mut z).is_err() {
            return false;
        }
        self.fill_tangent(x);
        let stiffest = self.stiffest();
        z.fill(0.0);
        for (k, (b, s)) in z[..d].iter_mut().zip(&self.metric).enumerate() {
            // of the size of 1, in no symmetry
            *b = s.sqrt() * (0.5 + (1.0 + k as f64).sqrt().fract());
        }
        let b = z.clone();
        if self.solve(&mut z).is_err() {
            return true;
        }
        let length = self.product(&z, &z).sqrt();
        if length * stiffest <= FAR {
            return false;
        }
        let along = |r: &[f64]| z[..d].iter().zip(r).map(|(z, r)| z * r).sum::<f64>();
        let (stiffness, size) = (along(&b), self.size());
        let mut work = |part: f64| {
            let (mut at, mut r) = (x.to_vec(), vec![0.0; x.len()]);
            at[..d].iter_mut().zip(&z).for_each(|(at, z)| *at += part * z);
            self.evaluate(&at, &mut r).is_ok().then(|| along(&r))
        };
        let Some(here) = work(0.0) else { return true };
        let mut agrees = |short: f64| {
            let part = short * size / length;
            let slope = work(part).map_or(f64::NAN, |there| (there - here) / part);
            (slope / stiffness - 1.0).abs() <= ALIKE
        };
        !SHORT.into_iter().all(&mut agrees)
    }

    /// Takes the configuration last evaluated as the last equilibrium.
    pub(crate) fn advance(&mut self) {
        let mut q = self.s.q1.clone();
        self.layout.clean(&mut q);
        let mut angles = self.s.angles.clone();
        self.mechanism.unwrap_angles(&q, &mut angles);
        self.stand_at(&q, angles);
    }

    /// Takes `q` with its unwrapped angles as the last equilibrium.
    pub(crate) fn stand_at(&mut self, q: &[f64], angles: Vec<f64>) {
        self.s.open(0.0, 1.0, q);
        self.s.angles = angles;
    }

    /// `S`, by which increments are measured.
    pub(crate) fn metric(&self) -> &[f64] {
        &self.metric
    }

    /// `2 M W − ∂f/∂v` at the point last evaluated.
    fn emit_velocity_matrix(&self, out: &mut dyn Entries) {
        self.system.damping(self.here().moving(&self.v), out);
        if let Some(field) = &self.rotation {
            field.emit_gyroscopic(self.system.mass(), out);
        }
    }

    /// Stiffness, damping and gyroscopic terms, and mass of the spanning tree at the point last
    /// evaluated, reduced by its null space.
    pub(crate) fn tree_matrices(&mut self) -> TreeMatrices {
        self.fill_symmetric_spin();
        let mut layout = VelocityLayout::new(&self.mechanism);
        let mut columns = layout.columns();
        layout.null_space(&self.s.q1, &mut columns);
        let dense = |emit: &dyn Fn(&mut dyn Entries), spin: &[Matrix6<f64>]| {
            let mut matrix = ReducedMatrix::default();
            matrix.fill(&layout, emit, &columns, &columns, spin);
            matrix.to_dense()
        };
        let moving = self.slopes_of_forces();
        let stiffness = |out: &mut dyn Entries| match &moving {
            Some(slopes) => self.emit_moving_stiffness(slopes, out),
            None => self.emit_stiffness(out),
        };
        let K = dense(&stiffness, &self.spin);
        let C = dense(&|out| self.emit_velocity_matrix(out), &[]); // [6.29]
        let M = dense(&|out| self.system.mass().emit(out), &[]);
        TreeMatrices { K, C, M, layout, columns }
    }

    /// The same without joints: every frame and point mass on its own, sparse, with the rows of
    /// joints.
    pub(crate) fn frame_matrices(&mut self) -> FrameMatrices {
        let (K, B) = self.frame_stiffness();
        let C = self.frame_matrix(&|out| self.emit_velocity_matrix(out), &[]);
        let M = self.frame_matrix(&|out| self.system.mass().emit(out), &[]);
        FrameMatrices { K, C, M, B, columns: self.left.clone() }
    }

    /// Stiffness and independent rows of joints, bars and scalar constraints in the velocities of
    /// all frames and point masses, sparse, at the point last evaluated.
    pub(crate) fn frame_stiffness(&mut self) -> (SparseMatrix, SparseMatrix) {
        self.fill_symmetric_spin();
        let K = self.frame_matrix(&|out| self.emit_stiffness(out), &self.spin);
        let place = JacobianPlace { row: 0, column: 0, scale: 1.0, transposed: false };
        let (mechanism, at) = (&self.mechanism, Configuration::new(self.t, &self.s.q1));
        let emit = |out: &mut dyn Entries| self.rows.emit_jacobian(mechanism, at, place, out);
        let mut rows = ReducedRows::default();
        rows.fill(&self.layout, &emit, &self.left);
        let B = SparseMatrix::assemble(self.rows.len(), self.unknowns(), |out| rows.emit(out));
        (K, B)
    }

    pub(super) fn frame_matrix(
        &self,
        emit: &dyn Fn(&mut dyn Entries),
        spin: &[Matrix6<f64>],
    ) -> SparseMatrix {
        let (d, mut matrix) = (self.unknowns(), ReducedMatrix::default());
        matrix.fill(&self.layout, emit, &self.left, &self.left, spin);
        SparseMatrix::assemble(d, d, |out| matrix.emit(out))
    }

    /// The symmetric part of `Σ_I ŵ_I d̂_I`: all of it in equilibrium, and without the torque that
    /// is not in balance elsewhere.
    fn fill_symmetric_spin(&mut self) {
        self.fill_spin();
        for spin in &mut self.spin {
            *spin = 0.5 * (*spin + spin.transpose());
        }
    }

    /// Whether a steady rotation takes the place of rest.
    pub(crate) fn is_rotating(&self) -> bool {
        self.rotation.is_some()
    }

    /// A steady rotation takes the place of rest.
    pub(crate) fn rotate(&mut self, rotation: &SteadyRotation) {
        self.rotation = Some(rotation.field(self.mechanism.description()));
    }

    /// A steady motion takes the place of rest.
    pub(crate) fn move_steadily(&mut self, motion: &SteadyMotion) {
        self.rotation = Some(motion.field(self.mechanism.description()));
    }

    /// The velocities of the steady motion at the point last evaluated; zero at rest.
    pub(crate) fn velocity(&self) -> &[f64] {
        &self.v
    }

    /// `v ←` the velocities of the steady motion at `q`; zero at rest.
    pub(crate) fn velocity_at(&self, q: &[f64], v: &mut [f64]) {
        match &self.rotation {
            Some(field) => field.velocity(q, v),
            None => v.fill(0.0),
        }
    }

    /// `out ←` how a displacement is carried along by the steady motion; zero at rest.
    pub(crate) fn carry(&self, x: &[f64], out: &mut [f64]) {
        match &self.rotation {
            Some(field) => field.carried(x, out),
            None => out.fill(0.0),
        }
    }

    /// `−∂f/∂q − ∂f/∂v (W + S)` of all forces where frames spin beside others: rates between them
    /// are not zero, so slopes are those at these rates. By differences of order 4, whose error is
    /// a few `10^{-13}` of the forces. `None` where none spins.
    fn slopes_of_forces(&self) -> Option<DMatrix<f64>> {
        const STEP: f64 = 1e-3;
        let field = self.rotation.as_ref().filter(|field| field.has_spins())?;
        let (n, at, size) = (self.force.len(), self.here(), self.size());
        let mut slopes = DMatrix::zeros(n, n);
        let (mut unit, mut change) = (vec![0.0; n], vec![0.0; n]);
        let points = 12 * self.mechanism.description().bodies.len();
        for j in 0..n {
            let step = STEP * if j >= points || j % 12 < 3 { size } else { 1.0 };
            unit[j] = 1.0;
            field.carried(&unit, &mut change);
            unit[j] = 0.0;
            for (part, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
                let mut q = at.q.to_vec();
                q[j] += part * step;
                let moved = self.v.iter().zip(&change);
                let v: Vec<f64> = moved.map(|(v, x)| v + part * step * x).collect();
                let mut f = vec![0.0; n];
                self.system.add_force(Configuration { q: &q, ..at }.moving(&v), &mut f);
                for (slope, f) in slopes.column_mut(j).iter_mut().zip(&f) {
                    *slope -= weight * f / (12.0 * step);
                }
            }
        }
        Some(slopes)
    }
}

/// Dense matrices in the velocities of the spanning tree, shape `d × d`.
pub(crate) struct TreeMatrices {
    /// `Pᵀ (∇²V − ∂f/∂q + M W² + Σ μ_i D²g_i) P + Σ_I ŵ_I d̂_I`.
    pub(crate) K: DMatrix<f64>,
    /// `Pᵀ (2 M W − ∂f/∂v) P`.
    pub(crate) C: DMatrix<f64>,
    /// `PᵀMP`.
    pub(crate) M: DMatrix<f64>,
    pub(crate) layout: VelocityLayout,
    /// `P`.
    pub(crate) columns: MapColumns,
}

/// The equations with the blocks of their unknowns, for Newton's method.
pub(crate) struct EquilibriumProblem<'a> {
    blocks: &'a [UnknownBlock],
    work: &'a mut EquilibriumEquations,
    first: Vec<f64>,
}

impl<'a> EquilibriumProblem<'a> {
    pub(crate) fn of(blocks: &'a [UnknownBlock], work: &'a mut EquilibriumEquations) -> Self {
        work.tangent_stresses = None;
        Self { blocks, work, first: Vec::new() }
    }

    /// The increment `(u, …)` predicted by the tangent at the last equilibrium.
    pub(crate) fn into_prediction(self) -> Vec<f64> {
        self.work.tangent_stresses = None;
        self.first
    }
}

impl NewtonProblem for EquilibriumProblem<'_> {
    fn blocks(&self) -> &[UnknownBlock] {
        self.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.work.evaluate(x, r)
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        self.work.fill_tangent(x);
        self.work.solve(dx)?;
        if self.first.is_empty() {
            self.first = dx.iter().map(|dx| -dx).collect();
        }
        self.work.follow_stresses(dx);
        Ok(())
    }

    fn precision(&self) -> Precision {
        self.work.precision()
    }
}

#[cfg(test)]
mod tests;
