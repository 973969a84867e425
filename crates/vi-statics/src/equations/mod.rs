//! The equations of static equilibrium: residual and tangent.
//!
//! Every frame and every point mass moves on its own; joints, bars and single constraints hold them
//! by multipliers. So trees, loops, redundant constraints and prescribed motion are one case, and the
//! tangent is exact and sparse.
//! ```text
//! w(q, μ, t) = ∇V(q) − f(t, q) + G(t, q)ᵀ μ                    n   what is left of the forces at rest
//! r_u = P_in(q)ᵀ w + σ S u = 0,    r_μ = g(t, q) = 0           unknowns u, μ;  q = F_d(u, q_last)
//! K   = [ P_inᵀ (∇²V − ∂f/∂q + Σ μ_i D²g_i) ∂F_d/∂u + Σ_I ŵ_I d̂_I + σ S    P_inᵀ Gᵀ ]
//!       [ G ∂F_d/∂u                                                        0       ]
//! ```
//! `t` is the load parameter: loads and prescribed motions are taken at the time `t`. The rows of `g`
//! are an independent set, without the internal constraints of the frames, which `F_d` keeps. `σ S` is
//! zero but for relaxation ([`crate::relaxation`]).
//!
//! Source: theory §6, "Statics".
#![allow(non_snake_case)] // K, G

use nalgebra::{DMatrix, Matrix3, Matrix6};
use vi_constraints::Constraints;
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, SparseLu, norm_inf};
use vi_core::newton::{Block, BlockKind, Fault, NewtonProblem};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{MechanicalSystem, SeparableSystem};
use vi_multibody::mechanism::{Description, Mechanism};
use vi_multibody::placement::LoopRank;
use vi_multibody::sparse_nodal::{Columns, ReducedMatrix, ReducedRows, VelocityLayout};
use vi_rigid::directors::director;
use vi_rigid::rotation::skew;

/// Least stiffness that the matrix is scaled by, relative to the largest.
const SOFTEST: f64 = 1e-8;

/// Everything an evaluation needs.
pub(crate) struct Work {
    pub(crate) system: SeparableSystem,
    pub(crate) mechanism: Mechanism,
    pub(crate) t: f64,      // load parameter
    pub(crate) s: Interval, // q0: last equilibrium
    pub(crate) rows: IndependentRows,
    pub(crate) mu: Vec<f64>,    // m  of the last evaluation
    pub(crate) force: Vec<f64>, // n  w
    pub(crate) sigma: f64,
    metric: Vec<f64>, // d  S: 1 for lengths, the square of the size for angles
    layout: VelocityLayout,
    left: Columns,  // P_in(q)
    right: Columns, // ∂F_d/∂u
    g: Vec<f64>,    // m
    spin: Vec<Matrix6<f64>>,
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

/// Columns where every frame and every point mass moves on its own.
fn separate(mechanism: &Mechanism) -> VelocityLayout {
    let whole = mechanism.description();
    let description = Description {
        dimension: whole.dimension,
        bodies: whole.bodies.clone(),
        particles: whole.particles.clone(),
        ..Description::default()
    };
    VelocityLayout::new(&Mechanism::new(description))
}

impl Work {
    /// At the configuration `q` and the load parameter `t`.
    pub(crate) fn new(
        system: SeparableSystem,
        mechanism: Mechanism,
        (t, q): (f64, &[f64]),
    ) -> Self {
        let layout = separate(&mechanism);
        let (n, d) = layout.dimension();
        let mut s = Interval::new(n);
        s.open(0.0, 1.0, q);
        s.angles = vec![0.0; mechanism.angle_count()];
        mechanism.unwrap_angles(q, &mut s.angles);
        let m = mechanism.len();
        let frames = mechanism.description().bodies.len();
        let mut work = Self {
            rows: IndependentRows::choose(m, &[]),
            mu: vec![0.0; m],
            force: vec![0.0; n],
            sigma: 0.0,
            metric: vec![1.0; d],
            left: layout.columns(),
            right: layout.columns(),
            g: vec![0.0; m],
            spin: vec![Matrix6::zeros(); frames],
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

    /// Independent rows of joints, bars and single constraints.
    fn independent_rows(&mut self) -> IndependentRows {
        let (mechanism, m) = (&self.mechanism, self.mechanism.len());
        let internal = 6 * mechanism.description().bodies.len();
        let outer: Vec<usize> = (internal..m).collect();
        if !mechanism.has_loops() {
            return IndependentRows::choose(m, &outer);
        }
        if mechanism.description().particles.is_empty() {
            let rank = LoopRank::find(mechanism, self.t, &self.s.q0);
            if rank.is_singular() {
                let rows = rank.rows(mechanism); // those of configurations nearby
                let outer = rows.rows().iter().copied().filter(|&row| row >= internal);
                return IndependentRows::choose(m, &outer.collect::<Vec<_>>());
            }
        }
        self.ranked_rows()
    }

    /// An independent set of the rows of joints, bars and single constraints at the last equilibrium, by
    /// pivoted QR; forgets the matrices of the old set.
    fn ranked_rows(&mut self) -> IndependentRows {
        let m = self.mechanism.len();
        let outer: Vec<usize> = (6 * self.mechanism.description().bodies.len()..m).collect();
        self.rows = IndependentRows::choose(m, &outer);
        (self.upper, self.lower, self.factors) = Default::default();
        let q = self.s.q0.clone();
        self.layout.null_space(&q, &mut self.left);
        self.fill_rows();
        let d = self.unknowns();
        let mut J = DMatrix::zeros(outer.len(), d);
        self.upper.emit(&mut J);
        (self.upper, self.lower) = Default::default();
        let mut qr = NullSpaceQr::new(d, outer.len());
        let rank = qr.factorize(&J);
        let chosen: Vec<usize> = qr.pivots()[..rank].iter().map(|&k| outer[k]).collect();
        IndependentRows::choose(m, &chosen)
    }

    /// Chooses the independent rows anew where some follow from others: which ones is a matter of the
    /// configuration. Returns whether the choice has changed; a lower rank in passing changes nothing.
    pub(crate) fn renew_rows(&mut self) -> bool {
        let outer = self.mechanism.len() - 6 * self.mechanism.description().bodies.len();
        if self.rows.len() == outer {
            return false;
        }
        let old = self.rows.clone();
        let new = self.ranked_rows();
        let changed = new.len() == old.len() && new != old;
        self.rows = if changed { new } else { old };
        changed
    }

    /// Number of unknowns `u`.
    pub(crate) fn unknowns(&self) -> usize {
        self.metric.len()
    }

    /// Units and scales of the unknowns `(u, μ)`.
    pub(crate) fn blocks(&self) -> Vec<Block> {
        let mut blocks = self.layout.blocks();
        let length = 1e-5 * self.reach().max(1e-5);
        for block in &mut blocks {
            block.floor = if block.kind == BlockKind::Rotation { 1e-5 } else { length };
        }
        let d = self.unknowns();
        // multipliers follow from the rest: they converge with the configuration
        let multipliers = d..d + self.rows.len();
        blocks.push(Block {
            kind: BlockKind::Multiplier,
            range: multipliers,
            floor: f64::INFINITY,
        });
        blocks
    }

    fn points(&self) -> impl Iterator<Item = &[f64]> {
        let description = self.mechanism.description();
        let (bodies, size) = (description.bodies.len(), description.dimension.max(1));
        let (frames, particles) = self.s.q0.split_at(12 * bodies);
        frames.chunks_exact(12).map(|frame| &frame[..3]).chain(particles.chunks_exact(size))
    }

    /// Largest distance of a point from the origin, m: the scale of round-off.
    pub(crate) fn reach(&self) -> f64 {
        self.points().map(norm_inf).fold(0.0, f64::max)
    }

    /// Diagonal of the box that holds all points of the start and of the joints, m; 1 for a point.
    pub(crate) fn size(&self) -> f64 {
        let joints = &self.mechanism.description().joints;
        let anchors = joints.iter().map(|joint| joint.parent.point().at(&self.s.q0));
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let mut widen = |point: &[f64]| {
            for (i, x) in point.iter().enumerate() {
                (low[i], high[i]) = (low[i].min(*x), high[i].max(*x));
            }
        };
        self.points().for_each(&mut widen);
        anchors.for_each(|anchor| widen(anchor.as_slice()));
        let sides = low.iter().zip(&high).map(|(low, high)| (high - low).max(0.0));
        let size = sides.map(|side| side * side).sum::<f64>().sqrt();
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
    }

    /// `r(u, μ)`; keeps `q`, `P_in(q)`, `w` for the tangent.
    pub(crate) fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let (u, mu) = x.split_at(self.unknowns());
        self.layout.reparametrize(u, &mut self.s)?;
        let (t, q) = (self.t, &self.s.q1);
        let at = Configuration { t, ..self.s.end() };
        self.layout.null_space(q, &mut self.left);
        self.rows.scatter(mu, &mut self.mu);
        self.system.rest_force(at, &mut self.force);
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
        self.system.rest_force(Configuration { t: t + step, ..self.s.end() }, &mut after);
        self.system.rest_force(Configuration { t: t - step, ..self.s.end() }, &mut before);
        after.iter_mut().zip(&before).for_each(|(a, b)| *a = (*a - b) / (2.0 * step));
        let d = self.unknowns();
        let (balance, closure) = out.split_at_mut(d);
        self.layout.pull_back(&self.left, &after, balance);
        let mut rates = vec![0.0; self.g.len()];
        self.mechanism.time_derivative(t, q, &mut rates);
        self.rows.gather(&rates, closure);
    }

    /// `Σ_I ŵ_I d̂_I` of each frame: the turn of `P_in` under the force left over.
    fn fill_spin(&mut self) {
        let q = &self.s.q1;
        for (k, spin) in self.spin.iter_mut().enumerate() {
            let (frame, w) = (&q[12 * k..12 * k + 12], &self.force[12 * k..12 * k + 12]);
            let hats = (0..3).map(|i| skew(&director(w, i)) * skew(&director(frame, i)));
            spin.fixed_view_mut::<3, 3>(3, 3).copy_from(&hats.sum::<Matrix3<f64>>());
        }
    }

    /// The configuration last evaluated.
    fn here(&self) -> Configuration<'_> {
        Configuration { t: self.t, ..self.s.end() }
    }

    /// `∇²V − ∂f/∂q + Σ μ_i D²g_i` at the point last evaluated.
    fn emit_stiffness(&self, out: &mut dyn Entries) {
        self.system.rest_stiffness(self.here(), out);
        self.mechanism.weighted_hessian(self.t, &self.s.q1, &self.mu, 1.0, out);
    }

    fn fill_rows(&mut self) {
        let (mechanism, rows, s, t) = (&self.mechanism, &self.rows, &self.s, self.t);
        let place = JacobianPlace { row: 0, column: 0, scale: 1.0, transposed: false };
        let emit = |out: &mut dyn Entries| rows.emit_jacobian(mechanism, (t, &s.q1), place, out);
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
        stiffness.fill(&self.layout, &emit, (&self.left, &self.right), &self.spin);
        self.stiffness = stiffness;
        self.fill_rows();
    }

    /// `x ← K⁻¹ x` with the tangent last filled.
    pub(crate) fn solve(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        self.solve_with(1.0, x)
    }

    /// The same with `part` of the stiffness: 0 leaves `σ S` alone.
    fn solve_with(&mut self, part: f64, x: &mut [f64]) -> Result<(), Singular> {
        self.set_scales(part);
        let d = self.unknowns();
        let Self { stiffness, upper, lower, scale, factors, metric, sigma, .. } = self;
        let scaled = |out: &mut dyn Entries| {
            stiffness.emit(&mut Scaled { out, scale, part, place: |i, j| (i, j) });
            for (i, s) in metric.iter().enumerate() {
                out.add(i, i, scale[i] * *sigma * s * scale[i]);
            }
            upper.emit(&mut Scaled { out, scale, part: 1.0, place: |i, j| (j, d + i) });
            lower.emit(&mut Scaled { out, scale, part: 1.0, place: |i, j| (d + i, j) });
        };
        match factors {
            Some((matrix, _)) => matrix.refill(scaled),
            None => {
                let matrix = SparseMatrix::assemble(scale.len(), scale.len(), scaled);
                let lu = SparseLu::new(&matrix)?;
                *factors = Some((matrix, lu));
            }
        }
        let (matrix, lu) = factors.as_mut().expect("just written");
        x.iter_mut().zip(scale.iter()).for_each(|(x, s)| *x *= s);
        lu.solve(matrix, x)?;
        x.iter_mut().zip(scale.iter()).for_each(|(x, s)| *x *= s);
        Ok(())
    }

    /// Powers of two that bring the diagonal of the stiffness and the constraint rows near 1; what is
    /// softer than [`SOFTEST`] may be round-off of a rigid body that has no stiffness of its own.
    fn set_scales(&mut self, part: f64) {
        let d = self.unknowns();
        let near = |size: f64, exponent: f64| {
            let usable = size.is_finite() && size > f64::MIN_POSITIVE;
            if usable { (exponent * size.log2()).round().exp2() } else { 1.0 }
        };
        let least = SOFTEST * part * self.stiffest();
        for (i, scale) in self.scale[..d].iter_mut().enumerate() {
            let size = part * self.stiffness.diagonal()[i] + self.sigma * self.metric[i];
            *scale = near(size.abs().max(least * self.metric[i]), -0.5);
        }
        let mut largest = vec![0.0_f64; self.rows.len()];
        self.lower.emit(&mut Largest { scale: &self.scale, out: &mut largest });
        for (scale, size) in self.scale[d..].iter_mut().zip(largest) {
            *scale = near(size, -1.0);
        }
    }

    /// `x ← (u, μ)` of least `|P_inᵀw|` (in the metric `S`): how well the constraints hold the forces at
    /// the last equilibrium; returns `|r_u|_∞` that stays.
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

    /// Whether the tangent at the last equilibrium is singular to working precision: whether a force
    /// spread over all directions moves something about `1/ε` times as far as the stiffness would let it.
    pub(crate) fn is_neutral(&mut self, x: &[f64]) -> bool {
        const FAR: f64 = 1e13;
        let (d, mut b) = (self.unknowns(), vec![0.0; x.len()]);
        if self.evaluate(x, &mut b).is_err() {
            return false;
        }
        self.fill_tangent(x);
        let stiffest = self.stiffest();
        b.fill(0.0);
        for (k, (b, s)) in b[..d].iter_mut().zip(&self.metric).enumerate() {
            *b = s.sqrt() * (0.5 + (1.0 + k as f64).sqrt().fract()); // of the size of 1, in no symmetry
        }
        self.solve(&mut b).is_err() || self.product(&b, &b).sqrt() * stiffest > FAR
    }

    /// Largest entry of the diagonal of the stiffness last filled, in the metric `S`, N/m.
    fn stiffest(&self) -> f64 {
        let diagonal = self.stiffness.diagonal().iter().zip(&self.metric);
        diagonal.map(|(k, s)| (k / s).abs()).fold(0.0, f64::max)
    }

    /// Forces that round-off in the configuration causes, N: what moves the stiffest direction by a few
    /// bits of the size. Premise: the tangent has been filled.
    pub(crate) fn round_off(&self) -> f64 {
        50.0 * f64::EPSILON * self.stiffest() * self.size()
    }

    /// Largest of the forces that balance one another, N.
    pub(crate) fn force_scale(&mut self) -> f64 {
        let (at, n) = (self.here(), self.s.dim());
        let mut out = vec![0.0; n];
        self.system.add_force(at, &vec![0.0; n], &mut out);
        let applied = norm_inf(&out);
        out.fill(0.0);
        self.system.add_potential_gradient(at, 1.0, &mut out);
        applied.max(norm_inf(&out))
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

    /// `Σ S u u'/d` of unknowns `(u, …)`, m².
    pub(crate) fn product(&self, x: &[f64], y: &[f64]) -> f64 {
        let sum: f64 = self.metric.iter().zip(x).zip(y).map(|((s, x), y)| s * x * y).sum();
        sum / self.metric.len().max(1) as f64
    }

    /// `S`, by which increments are measured.
    pub(crate) fn metric(&self) -> &[f64] {
        &self.metric
    }

    /// `Pᵀ (∇²V − ∂f/∂q + Σ μ_i D²g_i) P + …` and `PᵀMP` of the spanning tree at the point last
    /// evaluated, dense, with `P` as columns.
    pub(crate) fn tree_matrices(
        &mut self,
    ) -> (DMatrix<f64>, DMatrix<f64>, VelocityLayout, Columns) {
        self.fill_spin();
        let mut layout = VelocityLayout::new(&self.mechanism);
        let mut columns = layout.columns();
        layout.null_space(&self.s.q1, &mut columns);
        let dense = |emit: &dyn Fn(&mut dyn Entries), spin: &[Matrix6<f64>]| {
            let mut matrix = ReducedMatrix::default();
            matrix.fill(&layout, emit, (&columns, &columns), spin);
            matrix.to_dense()
        };
        let K = dense(&|out| self.emit_stiffness(out), &self.spin);
        let M = dense(&|out| self.system.mass().emit(out), &[]);
        (K, M, layout, columns)
    }
}

/// Multiplies entries by the scales of their row and column.
struct Scaled<'a, F> {
    out: &'a mut dyn Entries,
    scale: &'a [f64],
    part: f64,
    place: F,
}

impl<F: Fn(usize, usize) -> (usize, usize)> Entries for Scaled<'_, F> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let (i, j) = (self.place)(row, column);
        self.out.add(i, j, self.scale[i] * (self.part * value) * self.scale[j]);
    }
}

/// The largest entry of each row, columns scaled.
struct Largest<'a> {
    scale: &'a [f64],
    out: &'a mut [f64],
}

impl Entries for Largest<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let size = (value * self.scale[column]).abs();
        self.out[row] = self.out[row].max(size);
    }
}

/// The equations with the blocks of their unknowns, for Newton's method.
pub(crate) struct Problem<'a> {
    blocks: &'a [Block],
    work: &'a mut Work,
    first: Vec<f64>,
}

impl<'a> Problem<'a> {
    pub(crate) fn of(blocks: &'a [Block], work: &'a mut Work) -> Self {
        Self { blocks, work, first: Vec::new() }
    }

    /// What the tangent at the last equilibrium says of the unknowns `(u, …)`.
    pub(crate) fn into_forecast(self) -> Vec<f64> {
        self.first
    }
}

impl NewtonProblem for Problem<'_> {
    fn blocks(&self) -> &[Block] {
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
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{FrameRule, Mesh};
    use crate::model::BeamModel;
    use crate::sample::Sample;
    use crate::section::Section;
    use nalgebra::Vector3;
    use vi_multibody::form::Form;
    use vi_multibody::joint_force::{JointForce, JointSpring, PdControl};
    use vi_multibody::mechanism::Attachment;
    use vi_multibody::pair::PairKind;
    use vi_multibody::scalar_constraint::ScalarConstraint;
    use vi_multibody::spring::{Spring, SpringLaw};
    use vi_rigid::load::{Load, LoadKind};
    use vi_rigid::time_history::TimeHistory;

    /// ground – pair – beam – pair – beam – pair (a node on the ground), weight, loads, springs, a guide.
    fn work(kinds: [PairKind; 3], sample: &mut Sample) -> Work {
        let section =
            Section::new([90.0, 80.0, 120.0, 5.0, 4.0, 3.0], [1.0, 0.1, 0.1, 0.0]).unwrap();
        let mut model = BeamModel::new(Vector3::new(0.2, 0.3, -1.0));
        let rule = FrameRule::Normal(Vector3::z());
        let (corner, end) = (Vector3::new(1.0, 0.2, 0.0), Vector3::new(1.4, 1.1, 0.3));
        for (from, to) in [(Vector3::zeros(), corner), (corner, end)] {
            let mesh = Mesh::straight(from, to, 2, rule).unwrap();
            model.add_beam("beam", &mesh, section).unwrap();
        }
        let mut point = |at: Vector3<f64>| at + 0.3 * sample.vector();
        let axis = Vector3::new(0.3, -0.5, 1.0);
        model.join(kinds[0], None, 0, &point(Vector3::zeros()), &axis);
        model.join(kinds[1], Some(2), 3, &point(corner), &axis);
        model.join(kinds[2], Some(3), 4, &point(end), &axis);
        let held = Form::point(12, &Vector3::x()).minus(&Form::constant(Vector3::y()));
        let length = held.at(&model.placement()).norm();
        let rod = ScalarConstraint::distance("rod", &held, length);
        model.description.scalars.push(rod);
        let mut mechanism = model.mechanism();
        let coordinate = mechanism.coordinate(0, 0);
        let mut load = |frame: usize, kind| {
            let (force, torque) = (sample.vector(), sample.vector());
            let load = Load::new(12 * frame, kind, force, torque, TimeHistory::default()).unwrap();
            load.at(sample.vector()).unwrap()
        };
        let loads =
            vec![load(1, LoadKind::Follower), load(3, LoadKind::Dead), load(4, LoadKind::Dead)];
        let mut system = model.static_system(&mechanism, loads);
        let [a, b] = [0, 4].map(|k| mechanism.point_of(Attachment::Body(k), &Vector3::x()));
        let law = SpringLaw::Linear;
        let between = b.minus(&a);
        system = system.potential(Spring { between, stiffness: 3.0, natural_length: 0.5, law });
        if let Some(coordinate) = coordinate {
            let spring = JointSpring { coordinate: coordinate.clone(), stiffness: 2.0, rest: 0.4 };
            let reference = std::sync::Arc::new(|t: f64| (0.3 * t, 0.3));
            let law = PdControl { proportional: 1.5, derivative: 0.7, reference };
            system = system.discrete_potential(Box::new(spring));
            system = system.force(Box::new(JointForce { coordinate, law }));
        }
        let q = model.placement();
        Work::new(system, mechanism, (0.7, &q))
    }

    #[test]
    fn the_tangent_is_the_derivative_of_the_residual() {
        use PairKind::{Cylindrical, Fixed, Planar, Prismatic, Revolute, Spherical, Universal};
        let mut sample = Sample::new(41);
        let mut worst = 0.0_f64;
        for kinds in [
            [Fixed, Spherical, Revolute],
            [Revolute, Universal, Fixed],
            [Spherical, Cylindrical, Prismatic],
            [Planar, Revolute, Spherical],
            [Universal, Fixed, Planar],
        ] {
            let mut work = work(kinds, &mut sample);
            let size = work.unknowns() + work.rows.len();
            work.sigma = 0.1;
            let x: Vec<f64> = (0..size).map(|_| 0.2 * sample.number()).collect();
            let residual = |work: &mut Work, x: &[f64]| {
                let mut r = vec![0.0; size];
                work.evaluate(x, &mut r).unwrap();
                r
            };
            // K applied by its inverse: K⁻¹ (∂r/∂x e_j) = e_j
            for j in 0..size {
                let (e, mut plus, mut minus) = (1e-5, x.clone(), x.clone());
                (plus[j], minus[j]) = (x[j] + e, x[j] - e);
                let (plus, minus) = (residual(&mut work, &plus), residual(&mut work, &minus));
                let mut column: Vec<f64> =
                    plus.iter().zip(&minus).map(|(a, b)| (a - b) / (2.0 * e)).collect();
                residual(&mut work, &x);
                work.fill_tangent(&x);
                work.solve(&mut column).unwrap();
                column[j] -= 1.0;
                worst = worst.max(norm_inf(&column));
            }
        }
        println!("K⁻¹ ∂r/∂x off the identity by {worst:.1e}");
        assert!(worst < 1e-6, "{worst:e}");
    }
}
