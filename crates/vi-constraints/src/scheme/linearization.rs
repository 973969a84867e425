//! A step of any of the four schemes, linearized: tangents forward, costates backward.
//!
//! ```text
//! p̄ + D_1 L_d + f_d^- − h Gᵀλ = 0,   g(q') = 0,   p̄' = D_2 L_d + f_d^+,   z' = ζ(q, q', z)
//! A = D_2(D_1 L_d + f_d^-)    B = D_1(D_1 L_d + f_d^-) − h Σ λ_i D²g_i(q)
//! C = D_1(D_2 L_d + f_d^+)    D = D_2(D_2 L_d + f_d^+)
//! ```
//! Forward [2.37], with sources `b_s`, `g_s`, `c_s` of the three equations:
//! ```text
//! [ A      −h Gᵀ ] [δq']     [ δp̄ + B δq + b_z δz + b_s ]
//! [ G(q')   0    ] [δλ ] = − [ g_s                      ]      δp̄' = C δq + D δq' + f^+_z δz + c_s
//! ```
//! Backward [2.38], from the costates `a', b', y'` of `q', p̄', z'` to those of `q, p̄, z`:
//! ```text
//! [ Aᵀ   G(q')ᵀ ] [μ]   [ a' + Dᵀ b' + ζ_q'ᵀ y' ]      a = Cᵀ b' − Bᵀ μ + ζ_qᵀ y'
//! [ G    0      ] [σ] = [ 0                     ]      b = −μ,   y = ζ_zᵀ y' − b_zᵀ μ + (f^+_z)ᵀ b'
//! ```
//! Where the number depends on `h λ` as well, `G μ = −∂J/∂(h λ)` is the second line. Both solve
//! with one factorization of `[hA, −Gᵀ; G(q'), 0]` over independent rows; `h λ` follows
//! from it too, since `[0; −hλ]` solves it with `[p̄ + D_1 L_d + f_d^-; 0]`, which is in the range
//! of `Gᵀ`. Else `μ` is tangent: of `p̄` only `Pᵀp̄` counts. Rows that were left out are checked,
//! not solved.
//!
//! A step with constraints on velocities closes `R(q, q') = h A_d` in the place of `g(q')` [2.66]:
//! `G` is `A(q)`, `G(q')` is `R_q'`, to `g_s` comes `R_q δq`, and to `a` comes `−R_qᵀ σ`.
#![allow(non_snake_case)] // A, B, C, D, G

use crate::constraints::{Constraints, RowSums};
use crate::design::Costates;
use crate::saddle_point::{IndependentRows, SaddlePoint};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::{Interval, Slot};
use vi_core::linear::{Singular, dot, norm_inf};
use vi_core::sparse::{Block, Entries, Product};

/// How far a row that was left out may be from holding, relative to its terms.
const DEPENDENT: f64 = 1e-6;

/// What is rounding of a row, relative to the largest terms of any: a row whose own terms cancel.
const ROUNDING: f64 = 1e-12;

/// Why a step has no derivative here.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinearizationError {
    /// The linearized step is singular.
    #[error(transparent)]
    Singular(#[from] Singular),
    /// A redundant constraint does not follow from the others any more.
    #[error(
        "constraint {row} depends on the others, but not with what is changed: no neighbouring \
         mechanism closes ({defect:.1e} of its terms)"
    )]
    Opens {
        /// The constraint.
        row: usize,
        /// What is left of it, relative to its terms.
        defect: f64,
    },
    /// A number of multipliers is not determined.
    #[error(
        "what is asked of multipliers is not determined: constraint {row} depends on the others"
    )]
    Undetermined {
        /// The constraint.
        row: usize,
    },
}

/// A tangent vector at a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tangent {
    /// `δq`, shape `n`.
    pub q: Vec<f64>,
    /// `δp̄`, shape `n`.
    pub p: Vec<f64>,
    /// `δz`, shape of the internal variables; empty where they are held.
    pub z: Vec<f64>,
}

impl Tangent {
    /// Zero, of `n` coordinates and so many internal variables.
    #[must_use]
    pub fn zero(n: usize, internal: usize) -> Self {
        Self { q: vec![0.0; n], p: vec![0.0; n], z: vec![0.0; internal] }
    }
}

/// The derivatives of a number by what a node is: costates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Costate {
    /// `a`, by `q`; on tangents. Shape `n`.
    pub q: Vec<f64>,
    /// `b`, by `p̄`. Shape `n`.
    pub p: Vec<f64>,
    /// `y`, by the internal variables.
    pub z: Vec<f64>,
}

impl Costate {
    /// Zero, of `n` coordinates and so many internal variables.
    #[must_use]
    pub fn zero(n: usize, internal: usize) -> Self {
        Self { q: vec![0.0; n], p: vec![0.0; n], z: vec![0.0; internal] }
    }

    fn parts(&mut self) -> [&mut Vec<f64>; 3] {
        [&mut self.q, &mut self.p, &mut self.z]
    }

    /// Zero again.
    pub fn clear(&mut self) {
        self.parts().into_iter().for_each(|own| own.fill(0.0));
    }

    /// Adds another one.
    pub fn add(&mut self, other: &Self) {
        for (own, other) in self.parts().into_iter().zip([&other.q, &other.p, &other.z]) {
            own.iter_mut().zip(other).for_each(|(own, other)| *own += other);
        }
    }

    /// `a·δq + b·δp̄ + y·δz`.
    #[must_use]
    pub fn along(&self, tangent: &Tangent) -> f64 {
        dot(&self.q, &tangent.q) + dot(&self.p, &tangent.p) + dot(&self.z, &tangent.z)
    }
}

/// What the equations of a step change by with controls, parameters or its length, at fixed
/// `(q, p̄, q', λ)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources {
    /// `b_s`, of `D_1 L_d + f_d^- − h Gᵀλ`. Shape `n`.
    pub minus: Vec<f64>,
    /// `c_s`, of `D_2 L_d + f_d^+`. Shape `n`.
    pub plus: Vec<f64>,
    /// `g_s`, of `g(q')`. Shape `m`.
    pub rows: Vec<f64>,
}

impl Sources {
    /// None, of `n` coordinates and `m` constraints.
    #[must_use]
    pub fn zero(n: usize, m: usize) -> Self {
        Self { minus: vec![0.0; n], plus: vec![0.0; n], rows: vec![0.0; m] }
    }

    /// Adds others.
    pub fn add(&mut self, other: &Self) {
        let own = [&mut self.minus, &mut self.plus, &mut self.rows];
        for (own, other) in own.into_iter().zip([&other.minus, &other.plus, &other.rows]) {
            own.iter_mut().zip(other).for_each(|(own, other)| *own += other);
        }
    }

    /// None.
    pub fn clear(&mut self) {
        let Self { minus, plus, rows } = self;
        [minus, plus, rows].into_iter().for_each(|part| part.fill(0.0));
    }
}

/// One step after the other, linearized about its solution.
#[derive(Debug)]
pub struct StepLinearization {
    saddle: SaddlePoint, // [h A, −Gᵀ; G', 0]
    impulse: Vec<f64>,   // m  h λ
    sigma: Vec<f64>,     // m  σ
    x: Vec<f64>,         // n + r
    momentum: Vec<f64>,  // n  b'
    kept: Vec<f64>,      // z  y', or δz
    rows: Vec<f64>,      // m  g_s + R_q δq
    back: Interval,      // the step backwards; not used without constraints on velocities
    dropped: DroppedRows,
}

impl StepLinearization {
    /// For `n` coordinates and an independent set of `m` constraints.
    #[must_use]
    pub fn new(n: usize, m: usize, rows: &IndependentRows) -> Self {
        Self {
            saddle: SaddlePoint::new(n, rows.clone()),
            impulse: vec![0.0; m],
            sigma: vec![0.0; m],
            x: vec![0.0; n + rows.len()],
            momentum: vec![0.0; n],
            kept: Vec::new(),
            rows: vec![0.0; m],
            back: Interval::new(n),
            dropped: DroppedRows::new(n, m),
        }
    }

    /// Factorizes the matrix of the step `s` from the momentum `p̄`, and finds `h λ`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn linearize(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        p: &[f64],
    ) -> Result<(), Singular> {
        let worn = self.saddle.is_worn() && self.saddle.choose(constraints, s.t, &s.q0);
        let found = self.factorize(system, constraints, s);
        if found.is_err() && !worn && self.saddle.choose(constraints, s.t, &s.q0) {
            self.factorize(system, constraints, s)?;
        } else {
            found?;
        }
        let n = s.dim();
        self.x.fill(0.0);
        system.forced_d1(s, &mut self.x[..n]);
        self.x.iter_mut().zip(p).for_each(|(x, p)| *x += p);
        self.saddle.solve_factorized(&mut self.x)?;
        self.x[n..].iter_mut().for_each(|y| *y = -*y);
        self.saddle.rows().scatter(&self.x[n..], &mut self.impulse); // h λ
        Ok(())
    }

    fn factorize(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
    ) -> Result<(), Singular> {
        let start = s.start();
        let emit = |out: &mut dyn Entries| {
            let (row, column, transposed) = (0, 0, false);
            let mut scaled = Block { into: out, row, column, scale: s.h, transposed };
            system.d2_d1(s, &mut scaled);
            system.force_slope(s, Slot::First, Slot::Second, &mut scaled); // A
        };
        let upper = |out: &mut dyn Entries| constraints.jacobian(start.t, start.q, out);
        let lower = |out: &mut dyn Entries| constraints.step_jacobian(s, out);
        self.saddle.factorize(&emit, &upper, -1.0, &lower)
    }

    /// `h λ` of the step over all constraints, zero of those that were left out; shape `m`.
    #[must_use]
    pub fn impulse(&self) -> &[f64] {
        &self.impulse
    }

    /// The enforced constraints.
    #[must_use]
    pub fn rows(&self) -> &IndependentRows {
        self.saddle.rows()
    }

    /// Replaces a tangent at the start of the step by its image at the end, with sources [2.37].
    ///
    /// # Errors
    /// [`LinearizationError`].
    pub fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        sources: &Sources,
        d: &mut Tangent,
    ) -> Result<(), LinearizationError> {
        self.image(system, constraints, s, Some(sources), d)?;
        self.dropped.check(constraints, self.saddle.rows(), s, &self.rows, &d.q)
    }

    /// The same without sources.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn push_free(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        d: &mut Tangent,
    ) -> Result<(), Singular> {
        self.image(system, constraints, s, None, d)
    }

    fn image(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        sources: Option<&Sources>,
        d: &mut Tangent,
    ) -> Result<(), Singular> {
        let n = s.dim();
        let (upper, lower) = self.x.split_at_mut(n);
        upper.copy_from_slice(&d.p);
        let mut product = Product { v: &d.q, out: upper };
        system.forced_d1_d1(s, &mut product);
        constraints.weighted_hessian(s.t, &s.q0, &self.impulse, -1.0, &mut product);
        if !d.z.is_empty() {
            system.internal_slope(s, Slot::First, &mut Product { v: &d.z, out: upper });
        }
        self.rows.fill(0.0);
        if let Some(sources) = sources {
            upper.iter_mut().zip(&sources.minus).for_each(|(x, b)| *x += b);
            self.rows.copy_from_slice(&sources.rows);
        }
        if constraints.constrains_velocities() {
            self.back.reverse(s);
            let into = &mut Product { v: &d.q, out: &mut self.rows };
            let mut minus = Block { into, row: 0, column: 0, scale: -1.0, transposed: false };
            constraints.velocity_step_jacobian(&self.back, &mut minus); // R_q δq
        }
        self.saddle.rows().gather(&self.rows, lower);
        upper.iter_mut().for_each(|x| *x *= -s.h);
        lower.iter_mut().for_each(|x| *x = -*x);
        self.saddle.solve_factorized(&mut self.x)?;
        let end = &self.x[..n];
        d.p.fill(0.0);
        system.forced_d1_d2(s, &mut Product { v: &d.q, out: &mut d.p });
        system.forced_d2_d2(s, &mut Product { v: end, out: &mut d.p });
        if !d.z.is_empty() {
            system.internal_slope(s, Slot::Second, &mut Product { v: &d.z, out: &mut d.p });
        }
        if let Some(sources) = sources {
            d.p.iter_mut().zip(&sources.plus).for_each(|(p, c)| *p += c);
        }
        if !d.z.is_empty() {
            self.kept.clone_from(&d.z);
            d.z.fill(0.0);
            system.advance_internal_slope(s, &mut Product { v: &self.kept, out: &mut d.z });
            system.advance_slope(s, Slot::First, &mut Product { v: &d.q, out: &mut d.z });
            system.advance_slope(s, Slot::Second, &mut Product { v: end, out: &mut d.z });
        }
        d.q.copy_from_slice(end);
        Ok(())
    }

    /// `out ← h δλ` of the tangent that was pushed last, zero of rows that were left out; shape
    /// `m`. `h`: of the step, s.
    pub fn impulse_change(&self, h: f64, out: &mut [f64]) {
        out.fill(0.0);
        let n = self.momentum.len();
        self.saddle.rows().scatter(&self.x[n..], out); // h² δλ
        out.iter_mut().for_each(|change| *change /= h);
    }

    /// Replaces the costate at the end of the step, derivatives by `q'` included that only this
    /// step has, by that at its start [2.38].
    ///
    /// # Errors
    /// [`Singular`].
    pub fn pull(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        let pulled = self.pull_with(system, constraints, s, &[], costate);
        pulled.map_err(|_| Singular) // no multipliers are asked for
    }

    /// Refuses numbers with these derivatives by multipliers, shape `m`, that are not the same for
    /// all multipliers with the same force; of the step that was linearized, from `(t, q)`.
    ///
    /// # Errors
    /// [`LinearizationError`].
    pub fn check_determined(
        &mut self,
        constraints: &impl Constraints,
        (t, q): (f64, &[f64]),
        by_multipliers: &[f64],
    ) -> Result<(), LinearizationError> {
        if self.saddle.rows().len() == by_multipliers.len() {
            return Ok(());
        }
        let n = q.len();
        let (upper, lower) = self.x.split_at_mut(n);
        upper.fill(0.0);
        self.saddle.rows().gather(by_multipliers, lower);
        self.saddle.solve_transposed(&mut self.x)?; // G x = −∂y/∂λ
        let of = ([&self.x[..n], by_multipliers], -1.0);
        self.dropped.determines(constraints, self.saddle.rows(), (t, q), of)
    }

    /// The same of a number that depends on the impulse of the constraints as well, by
    /// `∂J/∂(h λ)`, shape `m`: then `G μ = −∂J/∂(h λ)`. Empty where it does not.
    ///
    /// # Errors
    /// [`LinearizationError`], also of a number that is not determined.
    pub fn pull_with(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        by_impulse: &[f64],
        costate: &mut Costate,
    ) -> Result<(), LinearizationError> {
        let n = s.dim();
        let Costate { q: a, p: b, z: y } = costate;
        self.momentum.copy_from_slice(b);
        let momentum = &self.momentum;
        let (c, lower) = self.x.split_at_mut(n);
        c.copy_from_slice(a);
        match by_impulse {
            [] => lower.fill(0.0),
            by_impulse => {
                self.saddle.rows().gather(by_impulse, lower);
                lower.iter_mut().for_each(|x| *x /= s.h); // of μ/h
            }
        }
        transposed(momentum, c, &|out| system.forced_d2_d2(s, out));
        if !y.is_empty() {
            transposed(y, c, &|out| system.advance_slope(s, Slot::Second, out));
        }
        self.saddle.solve_transposed(&mut self.x)?; // (μ/h, σ)
        if !by_impulse.is_empty() {
            let (start, x) = (s.start(), [&self.x[..n], by_impulse]);
            let of = (x, -1.0 / s.h); // of μ/h
            self.dropped.determines(constraints, self.saddle.rows(), (start.t, start.q), of)?;
        }
        let (mu, sigma) = self.x.split_at_mut(n);
        mu.iter_mut().for_each(|mu| *mu *= s.h);
        self.saddle.rows().scatter(sigma, &mut self.sigma);
        a.fill(0.0);
        transposed(momentum, a, &|out| system.forced_d1_d2(s, out));
        if !y.is_empty() {
            transposed(y, a, &|out| system.advance_slope(s, Slot::First, out));
        }
        b.iter_mut().zip(&*mu).for_each(|(b, mu)| *b = -mu);
        transposed(b, a, &|out| {
            system.forced_d1_d1(s, out);
            constraints.weighted_hessian(s.t, &s.q0, &self.impulse, -1.0, out);
        });
        if constraints.constrains_velocities() {
            self.back.reverse(s);
            let back = &self.back;
            transposed(&self.sigma, a, &|out| constraints.velocity_step_jacobian(back, out));
        }
        if !y.is_empty() {
            self.kept.clone_from(y);
            y.fill(0.0);
            transposed(&self.kept, y, &|out| system.advance_internal_slope(s, out));
            transposed(b, y, &|out| system.internal_slope(s, Slot::First, out));
            transposed(momentum, y, &|out| system.internal_slope(s, Slot::Second, out));
        }
        Ok(())
    }

    /// What [`StepLinearization::pull`] found last.
    #[must_use]
    pub fn costates(&self) -> Costates<'_> {
        Costates::of_rows(&self.x[..self.momentum.len()], &self.momentum, &self.sigma)
    }

    /// `c_sᵀ b' − b_sᵀ μ − g_sᵀ σ` with them: the derivative by what has these sources.
    #[must_use]
    pub fn along(&self, sources: &Sources) -> f64 {
        let Costates { step, momentum, rows, .. } = self.costates();
        dot(&sources.plus, momentum) - dot(&sources.minus, step) - dot(&sources.rows, rows)
    }
}

/// `out ← out + Eᵀ v` of what is emitted.
pub(crate) fn transposed(v: &[f64], out: &mut [f64], emit: &dyn Fn(&mut dyn Entries)) {
    let into = &mut Product { v, out };
    emit(&mut Block { into, row: 0, column: 0, scale: 1.0, transposed: true });
}

/// `G x = b` of rows that were left out, where it holds for the others.
#[derive(Debug)]
pub struct DroppedRows {
    rows: Vec<f64>,     // m
    sizes: Vec<f64>,    // m
    absolute: Vec<f64>, // n
}

impl DroppedRows {
    /// For `n` coordinates and `m` constraints.
    #[must_use]
    pub fn new(n: usize, m: usize) -> Self {
        Self { rows: vec![0.0; m], sizes: vec![0.0; m], absolute: vec![0.0; n] }
    }

    /// `G' δq' + g_s = 0` where the step `s` ends, whose end moves by `dq` with the sources `g_s`.
    pub(crate) fn check(
        &mut self,
        constraints: &impl Constraints,
        chosen: &IndependentRows,
        s: &Interval,
        sources: &[f64],
        dq: &[f64],
    ) -> Result<(), LinearizationError> {
        let emit = |out: &mut dyn Entries| constraints.step_jacobian(s, out);
        let found = self.missed(&emit, chosen, [dq, sources], -1.0);
        let opens = |(row, defect)| Err(LinearizationError::Opens { row, defect });
        found.map_or(Ok(()), opens)
    }

    /// Whether a number with the derivatives `∂y/∂λ = scale G x` is the same for all multipliers
    /// with the same force; `x` and `∂y/∂λ`, scale.
    ///
    /// # Errors
    /// [`LinearizationError::Undetermined`].
    pub fn determines(
        &mut self,
        constraints: &impl Constraints,
        chosen: &IndependentRows,
        (t, q): (f64, &[f64]),
        (of, scale): ([&[f64]; 2], f64),
    ) -> Result<(), LinearizationError> {
        let emit = |out: &mut dyn Entries| constraints.jacobian(t, q, out);
        let found = self.missed(&emit, chosen, of, scale);
        found.map_or(Ok(()), |(row, _)| Err(LinearizationError::Undetermined { row }))
    }

    /// A row with `G x ≠ scale b` of the `G` that is emitted, and what is left of it, relative to
    /// its terms; `[x, b]`.
    fn missed(
        &mut self,
        emit: &dyn Fn(&mut dyn Entries),
        chosen: &IndependentRows,
        [x, b]: [&[f64]; 2],
        scale: f64,
    ) -> Option<(usize, f64)> {
        if chosen.len() == b.len() || norm_inf(b) <= 0.0 {
            return None;
        }
        let Self { rows, sizes, absolute } = self;
        rows.iter_mut().zip(b).for_each(|(row, b)| *row = -scale * b);
        emit(&mut Product { v: x, out: rows });
        absolute.iter_mut().zip(x).for_each(|(size, x)| *size = x.abs());
        sizes.fill(0.0);
        emit(&mut RowSums { sizes: absolute, out: sizes });
        let least = ROUNDING * norm_inf(sizes);
        let defect = |row: usize| match rows[row].abs() <= least {
            true => (row, 0.0),
            false => (row, rows[row].abs() / (sizes[row] + (scale * b[row]).abs())),
        };
        chosen.redundant().map(defect).find(|(_, defect)| *defect > DEPENDENT)
    }
}
