//! Constrained Galerkin scheme: [2.27].
//!
//! ```text
//! h w_i − G(q_i)ᵀ μ_i = 0,  i = 0 … s−1,         g(q_j) = 0,  j = 1 … s                             [2.27]
//! unknowns (Δ_1 … Δ_s, μ_0 … μ_{s−1}),  μ_i = h² b̃_i λ_i
//! [ K_ij M    −G(q_i)ᵀ ]
//! [ G(q_j)       0     ]
//! ```
//! The matrix leaves out `∇²V` and the variation of `Gᵀ`, so the corrections contract by a ratio of
//! `O(h)`; the residual is exact. With interpolated strains, which may be stiff, it has both: it is
//! then that of Newton's method but for what is evaluated at Gauss nodes. With large steps there
//! are solutions on other branches of the motion: the polynomial through their points leaves the
//! constraints between these, and they are refused. Sparse LU for any `g`; no null space is needed.
//! It serves small systems and, as a form of its own, the verification of the nodal scheme.
#![allow(non_snake_case)] // K

use crate::constraints::Constraints;
use crate::galerkin::GaussPoint;
use crate::galerkin::control_points::ControlPoints;
use crate::saddle_point::{IndependentRows, JacobianPlace, term_sizes};
use crate::scheme::{Scheme, StepError, SubStep};
use crate::unknowns::{self, coordinates_and_multipliers};
use vi_core::Configuration;
use vi_core::galerkin::Stages;
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::Interval;
use vi_core::linear::SparseLu;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{Fault, Newton, Precision, UnknownBlock};
use vi_core::sparse::{Block as MatrixBlock, Entries, SparseMatrix};
use vi_core::state::State;

/// How far the polynomial may leave the constraints at Gauss nodes, relative to the size of their
/// terms.
const FAR: f64 = 0.1;

/// The constrained scheme of order `2s`.
#[derive(Debug)]
pub struct GalerkinConstrained {
    points: ControlPoints,
    rows: IndependentRows,
    blocks: [UnknownBlock; 2],
    jacobians: Vec<Option<SparseMatrix>>, // s  G(q_i), i = 0 … s−1
    matrix: Option<SparseMatrix>,
    lu: Option<SparseLu>,
    g: Vec<f64>,                // m  all constraints
    sizes: Vec<f64>,            // m  of their terms
    off: f64,                   // max_k |g(Q_k)|, relative to these
    multipliers: Vec<Vec<f64>>, // s × m  μ_i over all constraints
    force: Vec<f64>,            // n  G(q_i)ᵀ μ_i
}

impl GalerkinConstrained {
    /// For `n` coordinates and an independent set of `m` constraints.
    #[must_use]
    pub fn new(n: usize, m: usize, rows: IndependentRows, stages: Stages) -> Self {
        let s = stages.count();
        Self {
            points: ControlPoints::new(n, stages),
            blocks: coordinates_and_multipliers(s * n, s * rows.len()),
            rows,
            jacobians: (0..s).map(|_| None).collect(),
            matrix: None,
            lu: None,
            g: vec![0.0; m],
            sizes: vec![0.0; m],
            off: 0.0,
            multipliers: vec![vec![0.0; m]; s],
            force: vec![0.0; n],
        }
    }
}

impl<S: MechanicalSystem, C: Constraints> Scheme<S, C> for GalerkinConstrained {
    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, system: &S, constraints: &C, step: SubStep, state: &mut State) {
        self.points.open(step, state);
        constraints.row_sizes(Configuration::new(state.t, &state.q), &mut self.sizes);
        unknowns::scale(&mut self.blocks, &state.q, system.mass());
    }

    fn residual(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { points, rows, jacobians, g, sizes, off, multipliers: mu, force, .. } = self;
        let (n, s, chosen) = (system.dim(), points.stages(), rows.len());
        let (increments, multipliers) = x.split_at(s * n);
        let (momenta, closures) = r.split_at_mut(s * n);
        for (j, increment) in increments.chunks_exact(n).enumerate() {
            let point = points.point_mut(j + 1);
            point.dq.copy_from_slice(increment);
            point.close_from_increment();
            constraints.value(point.end(), g);
            rows.gather(g, &mut closures[j * chosen..(j + 1) * chosen]); // g(q_j) = 0
        }
        points.evaluate(system);
        *off = 0.0;
        for node in points.gauss() {
            let at = Configuration { t: node.t, q: &node.q, ..points.step().end() };
            constraints.residual(at, g);
            let relative = g.iter().zip(&*sizes).map(|(g, size)| (g / size).abs());
            *off = relative.fold(*off, f64::max);
        }
        for (i, momentum) in momenta.chunks_exact_mut(n).enumerate() {
            let (t, q) = (points.time(i), points.q(i));
            let emit = |out: &mut dyn Entries| constraints.jacobian(t, q, out);
            let jacobian = SparseMatrix::update(&mut jacobians[i], (g.len(), n), emit);
            rows.scatter(&multipliers[i * chosen..(i + 1) * chosen], &mut mu[i]);
            force.fill(0.0);
            jacobian.tr_mul_add(1.0, &mu[i], force);
            points.balance(system, i, momentum);
            let h = points.h();
            momentum.iter_mut().zip(&*force).for_each(|(r, force)| *r = h * *r - force); // [2.27]
        }
        Ok(())
    }

    fn correction(
        &mut self,
        system: &S,
        constraints: &C,
        _x: &[f64],
        dx: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { points, rows, matrix, lu, multipliers, .. } = self;
        let (n, s, chosen) = (system.dim(), points.stages(), rows.len());
        let (h, strains) = (points.h(), system.interpolation());
        let emit = |out: &mut dyn Entries| {
            for i in 0..s {
                for j in 0..s {
                    let scale = points.constants().K[(i, j + 1)];
                    let (row, column, transposed) = (i * n, j * n, false);
                    let mut block = MatrixBlock { into: &mut *out, row, column, scale, transposed };
                    system.mass().emit(&mut block);
                    block.scale = 1.0;
                    if let Some(strains) = strains {
                        strains.add_derivative(&points.polynomial(), (i, j + 1), h, &mut block);
                    }
                    if strains.is_some() && i == j + 1 {
                        let (t, q) = (points.time(i), points.q(i));
                        constraints.weighted_hessian(t, q, &multipliers[i], -1.0, &mut block);
                    }
                }
            }
            for i in 0..s {
                let multiplier = s * n + i * chosen;
                let transposed =
                    JacobianPlace { row: i * n, column: multiplier, scale: -1.0, transposed: true };
                let at = Configuration::new(points.time(i), points.q(i));
                rows.emit_jacobian(constraints, at, transposed, out);
                let place =
                    JacobianPlace { row: multiplier, column: i * n, scale: 1.0, transposed: false };
                let at = Configuration::new(points.time(i + 1), points.q(i + 1));
                rows.emit_jacobian(constraints, at, place, out);
            }
        };
        let size = s * (n + chosen);
        let matrix = SparseMatrix::update(matrix, (size, size), emit);
        let lu = match lu {
            Some(lu) => lu,
            none => none.insert(SparseLu::new(matrix)?),
        };
        Ok(lu.solve(matrix, dx)?)
    }

    fn precision(&self) -> Precision {
        Precision { is_simplified: true, ..Precision::default() }
    }

    fn accept(&self, _x: &[f64]) -> Result<(), Fault> {
        match self.points.stages() > 1 && self.off > FAR {
            true => Err(Fault::FarFromConstraints { by: self.off }),
            false => Ok(()),
        }
    }

    fn equation_sizes(&mut self, constraints: &C, x: &[f64]) -> Option<Vec<f64>> {
        let (s, n) = (self.points.stages(), constraints.dim());
        let mut sizes = vec![0.0; s * n];
        for (j, sizes) in sizes.chunks_exact_mut(n).enumerate() {
            constraints.coordinate_sizes(self.points.q(j + 1), sizes);
        }
        sizes.extend(x[s * n..].iter().map(|multiplier| multiplier.abs()));
        Some(term_sizes(self.matrix.as_ref()?, &sizes))
    }

    fn end(
        &mut self,
        system: &S,
        _constraints: &C,
        _newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        let points = &mut self.points;
        points.balance(system, points.stages(), &mut state.p); // p̄_{n+1}  [2.29]
        points.write_internal(&mut state.internal);
        state.move_to_configuration(points.step(), |_, _| {});
        Ok(())
    }

    fn gauss(&self) -> &[GaussPoint] {
        self.points.gauss()
    }

    fn polynomial(&self) -> Option<StepPolynomial<'_>> {
        Some(self.points.polynomial())
    }

    fn interval(&self) -> &Interval {
        self.points.step()
    }

    fn interval_mut(&mut self) -> &mut Interval {
        self.points.step_mut()
    }
}
