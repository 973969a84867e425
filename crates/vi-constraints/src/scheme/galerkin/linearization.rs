//! A Galerkin step, linearized: tangents forward, costates backward.
//!
//! With `H_ij` of `blocks.rs`, impulses `Λ_i` of the control points, states `z_k` of signals
//! at the Gauss nodes and sources `w_s`, `g_s`, `φ_s`:
//! ```text
//! Σ_j≥1 H_ij δq_j − G(q_i)ᵀ δΛ_i + Σ_k w_{i,z} δz_k = −(δ_i0 δp̄ + H_i0 δq + w_{s,i})   i = 0 … s−1
//! G(q_j) δq_j = −g_{s,j}   j = 1 … s,     δz_k − h Σ_j A_kj δφ_j = δz + h Σ_j A_kj φ_{s,j}
//! δp̄' = Σ_j H_sj δq_j + Σ_k w_{s,z} δz_k + w_{s,s},     δz' = δz + h Σ_k b_k (δφ_k + φ_{s,k})     [2.49]
//! ```
//! Backward with the transposed matrix, from the costates `a', b', y'` to those at the start:
//! ```text
//! Σ_i H_ijᵀ m_i + G(q_j)ᵀ σ_j − … = δ_js a' + H_sjᵀ b' + …,     G(q_i) m_i = 0
//! x = (−m_0 … −m_{s−1}, b'),   a = Σ_i H_i0ᵀ x_i + …,   b = −m_0,   y = y' + Σ_k ζ_k               [2.50]
//! dJ = Σ_i x_i·w_{s,i} − Σ_j σ_j·g_{s,j} + Σ_j h (b_j y' + Σ_k A_kj ζ_k)·φ_{s,j}
//! ```
//! One sparse factorization over independent rows serves both. Its parts: [`Parts`].
#![allow(non_snake_case)] // A, D, E, G, H

use super::blocks::Blocks;
use super::parts::Parts;
use crate::constraints::Constraints;
use crate::design::{Costates, Place};
use crate::linearization::{
    Costate, DroppedRows, LinearizationError, Sources, Tangent, transposed,
};
use crate::saddle_point::{IndependentRows, SaddlePoint};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::galerkin::Stages;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Entries, Product, SparseMatrix};

/// One Galerkin step after the other, linearized about its solution.
#[derive(Debug)]
pub struct GalerkinLinearization {
    blocks: Blocks,
    matrix: Option<(SparseMatrix, SparseLu)>,
    parts: Parts,
    interpolates: bool,          // strains, in the last step
    sources: Vec<Vec<f64>>,      // (s + 1) × n  w_s
    row_sources: Vec<Vec<f64>>,  // s × m  g_s
    rate_sources: Vec<Vec<f64>>, // s × internal variables  φ_s
    solution: Vec<f64>,          // s n, s r, then states of each Gauss node
    x: Vec<Vec<f64>>,            // (s + 1) × n
    sigma: Vec<Vec<f64>>,        // s × m
    rates: Vec<Vec<f64>>,        // s × internal variables, or nothing: their costates
    scratch: [Vec<f64>; 2],      // n, internal variables
    dropped: DroppedRows,
}

impl GalerkinLinearization {
    /// For `n` coordinates and an independent set of `m` constraints.
    #[must_use]
    pub fn new(n: usize, m: usize, rows: &IndependentRows, stages: Stages) -> Self {
        let s = stages.count();
        let vectors = |count: usize, length: usize| vec![vec![0.0; length]; count];
        Self {
            blocks: Blocks::new(n, m, stages, SaddlePoint::new(n, rows.clone())),
            matrix: None,
            parts: Parts::new(n, m, stages),
            interpolates: false,
            sources: vectors(s + 1, n),
            row_sources: vectors(s, m),
            rate_sources: vectors(s, 0),
            solution: Vec::new(),
            x: vectors(s + 1, n),
            sigma: vectors(s, m),
            rates: vectors(s, 0),
            scratch: [vec![0.0; n], Vec::new()],
            dropped: DroppedRows::new(n, m),
        }
    }

    fn stages(&self) -> usize {
        self.parts.stages()
    }

    /// The enforced constraints.
    #[must_use]
    pub fn rows(&self) -> &IndependentRows {
        self.blocks.multiplier.rows()
    }

    /// Factorizes the matrix of a step from the momentum `p̄`. `points`: `(q_n, q_j)`,
    /// `j = 1 … s`, of which the last is the step, and of the others increments count.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn linearize(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        points: &[Interval],
        p: &[f64],
    ) -> Result<(), Singular> {
        if self.blocks.differentiate(system, constraints, points, p)? {
            self.matrix = None; // another pattern
        }
        self.interpolates = system.interpolation().is_some();
        let Self { blocks, matrix, parts, .. } = self;
        parts.stand(&blocks.points);
        parts.stand_between(&blocks.points);
        let size = blocks.size();
        let emit = |out: &mut dyn Entries| blocks.emit(system, constraints, out);
        match matrix {
            Some((matrix, _)) => matrix.refill(emit),
            None => {
                let own = SparseMatrix::assemble(size, size, emit);
                let lu = SparseLu::new(&own)?;
                *matrix = Some((own, lu));
            }
        }
        let (matrix, lu) = matrix.as_mut().expect("just written");
        self.solution.resize(size, 0.0);
        lu.factorize(matrix)
    }

    /// `p ← p̄_{n+1} = w_s` of the step.
    pub fn momentum(&mut self, system: &impl DiscreteLagrangian, p: &mut [f64]) {
        let s = self.stages();
        self.blocks.points.balance(system, s, p);
    }

    /// How many parts the equations of a step have: its Gauss nodes, then the intervals between
    /// its control points, then these, where strains are interpolated.
    #[must_use]
    pub fn parts(&self) -> usize {
        let s = self.stages();
        2 * s + if self.interpolates { s + 1 } else { 0 }
    }

    /// A part with the impulses of its constraints.
    #[must_use]
    pub fn part(&self, k: usize) -> (Place<'_>, &[f64]) {
        match k.checked_sub(2 * self.stages()) {
            None => self.parts.part(k, &self.blocks.impulses),
            Some(i) => (Place::Strains(self.blocks.points.polynomial(), i), self.parts.no_rows()),
        }
    }

    /// No sources from now on.
    pub fn clear_sources(&mut self) {
        let all = self.sources.iter_mut().chain(&mut self.row_sources);
        all.chain(&mut self.rate_sources).for_each(|own| own.fill(0.0));
    }

    /// Adds sources of the rates of continuous states at a part, shape of all internal variables;
    /// those of Gauss nodes count.
    pub fn add_rate_sources(&mut self, k: usize, rates: &[f64]) {
        let Some(own) = self.rate_sources.get_mut(k) else { return };
        own.resize(rates.len(), 0.0);
        own.iter_mut().zip(rates).for_each(|(own, rate)| *own += rate);
    }

    /// Adds the sources of a part.
    pub fn add_sources(&mut self, k: usize, of: &Sources) {
        let add = |to: &mut [f64], scale: f64, x: &[f64]| {
            to.iter_mut().zip(x).for_each(|(to, x)| *to += scale * x);
        };
        if let Some(i) = k.checked_sub(2 * self.stages()) {
            return add(&mut self.sources[i], 1.0, &of.plus);
        }
        if let Some(i) = k.checked_sub(self.stages()) {
            add(&mut self.sources[i], 1.0, &of.minus);
            add(&mut self.row_sources[i], 1.0, &of.rows);
            return;
        }
        let constants = self.blocks.points.constants();
        let weight = constants.gauss_weights[k];
        for (i, own) in self.sources.iter_mut().enumerate() {
            let (E, half) = (constants.E[(k, i)], 0.5 * constants.D[(k, i)]);
            add(own, weight * (E - half), &of.minus);
            add(own, weight * (E + half), &of.plus);
        }
    }

    /// Replaces a tangent at the start of the step by its image at the end, with the sources that
    /// were added [2.49].
    ///
    /// # Errors
    /// [`LinearizationError`].
    pub fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        d: &mut Tangent,
    ) -> Result<(), LinearizationError> {
        let Self { blocks, matrix, solution, sources, row_sources, scratch, dropped, .. } = self;
        let rate_sources = &self.rate_sources;
        let (n, s, r, m) = blocks.shape();
        let (h, b) = (blocks.points.h(), &blocks.points.constants().gauss_weights);
        solution.fill(0.0);
        for (i, out) in solution[..s * n].chunks_exact_mut(n).enumerate() {
            blocks.balance(system, constraints, i, 0, &mut Product { v: &d.q, out });
            out.iter_mut().zip(&sources[i]).for_each(|(x, w)| *x += h * w);
            if i == 0 {
                out.iter_mut().zip(&d.p).for_each(|(x, p)| *x += h * p);
            }
        }
        for (j, out) in solution[s * n..s * (n + r)].chunks_exact_mut(r.max(1)).enumerate() {
            blocks.multiplier.rows().gather(&row_sources[j], out);
        }
        solution[..s * (n + r)].iter_mut().for_each(|x| *x = -*x);
        for (k, out) in solution[s * (n + r)..].chunks_exact_mut(m.max(1)).enumerate() {
            let A = |j: usize| blocks.points.constants().A[(k, j)];
            blocks.rates_by_point(A, 0, &mut Product { v: &d.q, out });
            for (x, place) in out.iter_mut().zip(&blocks.states[k].places) {
                let source = |(j, own): (usize, &Vec<f64>)| A(j) * own.get(*place).unwrap_or(&0.0);
                *x += d.z[*place] + h * rate_sources.iter().enumerate().map(source).sum::<f64>();
            }
        }
        let (_, lu) = matrix.as_mut().ok_or(Singular)?;
        lu.solve_factorized(solution)?;
        let (ends, states) = (&solution[..s * n], &solution[s * (n + r)..]);
        let at = |j: usize| if j == 0 { &d.q[..] } else { &ends[(j - 1) * n..j * n] };
        let [momentum, next] = scratch;
        momentum.fill(0.0);
        for j in 0..=s {
            let into = &mut Product { v: at(j), out: momentum };
            blocks.balance(system, constraints, s, j, into);
        }
        next.clone_from(&d.z);
        if m > 0 {
            let places = &blocks.states[0].places;
            let mut rates = vec![0.0; m];
            for l in 0..=s {
                blocks.rates_by_point(|k| b[k], l, &mut Product { v: at(l), out: &mut rates });
            }
            for (k, z) in states.chunks_exact(m).enumerate() {
                blocks.by_state(s, k, &mut Product { v: z, out: momentum });
                blocks.rates_by_state(k, b[k], &mut Product { v: z, out: &mut rates });
                for (rate, place) in rates.iter_mut().zip(places) {
                    *rate += h * b[k] * rate_sources[k].get(*place).unwrap_or(&0.0);
                }
            }
            places.iter().zip(&rates).for_each(|(place, rate)| next[*place] += rate);
        }
        for ((p, w), source) in d.p.iter_mut().zip(&*momentum).zip(&sources[s]) {
            *p = w / h + source;
        }
        d.z.clone_from(next);
        d.q.copy_from_slice(&ends[(s - 1) * n..]);
        for (j, rows) in row_sources.iter().enumerate() {
            let dq = &solution[j * n..(j + 1) * n];
            dropped.check(
                constraints,
                blocks.multiplier.rows(),
                self.parts.between(j),
                rows,
                dq,
            )?;
        }
        Ok(())
    }

    /// Replaces the costate at the end of the step, derivatives by `q'` included that only this
    /// step has, by that at its start [2.50].
    ///
    /// # Errors
    /// [`Singular`].
    pub fn pull(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        let Self { blocks, matrix, solution, x, sigma, rates, parts, .. } = self;
        let (n, s, r, m) = blocks.shape();
        let (h, b) = (blocks.points.h(), &blocks.points.constants().gauss_weights);
        let Costate { q: a, p: momentum, z } = costate;
        let places = blocks.states.first().map_or(&[][..], |own| &own.places);
        let y: Vec<f64> = places.iter().map(|place| z[*place]).collect();
        x[s].copy_from_slice(momentum);
        let own = &mut self.scratch[0]; // b'/h
        own.iter_mut().zip(&*momentum).for_each(|(own, p)| *own = p / h);
        solution.fill(0.0);
        for (j, c) in solution[..s * n].chunks_exact_mut(n).enumerate() {
            transposed(own, c, &|out| blocks.balance(system, constraints, s, j + 1, out));
            transposed(&y, c, &|out| blocks.rates_by_point(|k| b[k], j + 1, out));
        }
        solution[(s - 1) * n..s * n].iter_mut().zip(&*a).for_each(|(c, a)| *c += a);
        for (k, c) in solution[s * (n + r)..].chunks_exact_mut(m.max(1)).enumerate() {
            transposed(own, c, &|out| blocks.by_state(s, k, out));
            transposed(&y, c, &|out| blocks.rates_by_state(k, b[k], out));
        }
        let (_, lu) = matrix.as_mut().ok_or(Singular)?;
        lu.solve_transposed(solution)?;
        a.fill(0.0);
        transposed(own, a, &|out| blocks.balance(system, constraints, s, 0, out));
        transposed(&y, a, &|out| blocks.rates_by_point(|k| b[k], 0, out));
        solution[..s * n].iter_mut().for_each(|m| *m = -*m);
        for (i, m) in solution[..s * n].chunks_exact(n).enumerate() {
            transposed(m, a, &|out| blocks.balance(system, constraints, i, 0, out));
            x[i].iter_mut().zip(m).for_each(|(x, m)| *x = h * m);
        }
        for (k, zeta) in solution[s * (n + r)..].chunks_exact(m.max(1)).enumerate() {
            let A = |j: usize| blocks.points.constants().A[(k, j)];
            transposed(zeta, a, &|out| blocks.rates_by_point(A, 0, out));
            places.iter().zip(zeta).for_each(|(place, zeta)| z[*place] += zeta);
        }
        let zeta = &solution[s * (n + r)..];
        for (j, rates) in rates.iter_mut().enumerate().filter(|_| m > 0) {
            rates.clear();
            rates.resize(z.len(), 0.0);
            for (i, place) in places.iter().enumerate() {
                let A = |k: usize| blocks.points.constants().A[(k, j)];
                let sum: f64 = (0..s).map(|k| A(k) * zeta[k * m + i]).sum();
                rates[*place] = h * (b[j] * y[i] + sum);
            }
        }
        momentum.copy_from_slice(&x[0]);
        for (sigma, own) in sigma.iter_mut().zip(solution[s * n..].chunks_exact(r.max(1))) {
            blocks.multiplier.rows().scatter(&own[..r], sigma);
        }
        parts.spread(blocks.points.constants(), x);
        Ok(())
    }

    /// The costates of a part, found by the last [`GalerkinLinearization::pull`].
    #[must_use]
    pub fn costates(&self, k: usize) -> Costates<'_> {
        match k.checked_sub(2 * self.stages()) {
            None => {
                let rates = self.rates.get(k).map_or(&[][..], Vec::as_slice);
                Costates { rates, ..self.parts.costates(k, &self.sigma) }
            }
            Some(i) => self.parts.costates_of_point(&self.x[i]),
        }
    }
}
