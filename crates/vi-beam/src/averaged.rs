//! Averaged strains, and averaged strains with selective mass scaling.
//!
//! ```text
//! U_d(q_n, q_{n+1}) = Σ_e ½ ℓ ε̄ᵀC ε̄,              ε̄ = ½ (ε(q_n) + ε(q_{n+1}))
//! K_d(q_n, q_{n+1}) = Σ_e ½ ℓ μ ΔεᵀC Δε,           Δε = ε(q_{n+1}) − ε(q_n)
//! D_1 (U_d − K_d)    = ℓ Σ_i [C (½ ε̄ + μ Δε)]_i ∇ε_i(x_n)
//! D_2 (U_d − K_d)    = ℓ Σ_i [C (½ ε̄ − μ Δε)]_i ∇ε_i(x_{n+1})
//! D_2D_1 (U_d − K_d) = (¼ + μ) ℓ Σ_ij C_ij ∇ε_i(x_n) ∇ε_j(x_{n+1})ᵀ
//! D_1D_1 (U_d − K_d) = (¼ − μ) ℓ Σ_ij C_ij ∇ε_i(x_n) ∇ε_j(x_n)ᵀ + ℓ Σ_i [C (½ ε̄ + μ Δε)]_i ∇²ε_i(x_n)
//! ```
//! Symmetric, of order 2, invariant under rigid motions. A rigid rotation between the
//! ends is strain-free, whereas the midpoint configuration is shrunk by `cos(ϑ/2)` and shows the
//! strain `−sin²(ϑ/2) ≈ −(hω)²/4`: multiplied by `EA` it stretches stiff beams, and beyond about
//! `h = √(L/(c ω))`, `c = √(EA/ρA)`, the step fails altogether. No geometric term in the Newton
//! matrix.
//!
//! *Selective mass scaling.* With `μ = 0` a vibration far beyond the step, `h ω ≫ 1`, alternates
//! from step to step, its multiplier tends to −1, and `ε̄` does not see it. Such a mode has
//! negative action relative to a resolved one; two of them and a resolved vibration are in
//! resonance, and all three can grow without bound. `K_d` is the kinetic energy of a mass
//! `μ h² ℓ Σ C_i (𝔹_i x)(𝔹_i x)ᵀ` of the strain rates, which vanishes with `h²` and is not seen by
//! rigid motions. For a linear vibration this is Newmark's method with `γ = ½`, `β = ¼ + μ`:
//! ```text
//! tan²(ϑ/2) = ¼ (hω)² / (1 + μ (hω)²),       ϑ → 2 atan(1/(2√μ)) as hω → ∞
//! ```
//! `ϑ` is the angle of a step. [`MASS_SCALING`] `= 1/8` keeps it below 109.5°: no two modes and no
//! three add up to a full turn, which at `μ ≤ 1/12` three can; at `μ = ¼` four unresolved ones do.
//! Each element has the smallest `μ` that keeps this bound, `max(0, 1/8 − 1/(hω)²)`; it is zero
//! where `hω ≤ √8` holds for the highest frequency of the element, a bound of those of the beam.
//! The period of a resolved vibration comes out longer by the part `(1/12 + μ/2)(hω)²` of it.
//! docs/stability.md has the measurements.
//!
//! *Tension mass.* About an equilibrium with the material and the geometric stiffness `K_m + K_g`
//! averaged strains are stable where `M + h²K_μ − ¼ h²K_g ≥ 0`: the stiffness of tension is
//! explicit, as with all methods whose strains or constraints are those of nodes, and `μ C` covers
//! it up to `N ℓ² = 6 EI` of an element only. With a bound `N̂` of its tension
//! ```text
//! K_d = Σ_e ½ ℓ Δεᵀ (μ C + T) Δε,   T = diag(N̂, N̂, 0, τ, τ, 0)                                   [6.38]
//! τ = N̂ℓ²/32 + min(h²N̂²/(16 Aρ), (2/7) N̂L²)
//! ```
//! it is stable at every step: `N̂` ties the directors to the wave of a taut rope, the first part
//! of `τ` covers the turning of its nodes, the second the wave. A resolved wave changes its
//! frequency by the part `(hω)⁴/32` for `N̂` close to the tension. `L` is the length of all
//! elements: no wave has a wave number below `k = π/(2L)`, and `τk² ≥ (3/8) N` is enough at any
//! step. More would make unresolved bending slow, which dissipative strains would take for
//! resolved.
//!
//! `N̂` is stated, or an internal variable: 1.25 times the tension of the configuration at the
//! start, and, where the least tension `(C ε̄)_3` of three finished steps exceeds it, 1.25 times
//! that from the next step on. Vibrations that the step does not resolve turn by `ϑ` above 90° and
//! are in compression in one of three steps: they do not raise it, and must not, since a bound far
//! above the tension slows what the step resolves. A rope that becomes taut has nothing else that
//! holds it: the tension of one step raises its bound. While it is constant the map is symplectic
//! and reversible; momenta are exact always.
//!
//! Source: theory §6, "Discrete potential"; N. M. Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67–94;
//! selective mass scaling: L. Olovsson, K. Simonsson, M. Unosson, IJNME 63 (2005) 1436–1445.
#![allow(non_snake_case)] // U_d, A, C

use crate::at_ends::{AtStart, OF_END, OF_START};
use crate::element::{Element, StrainLaw, without_extension};
use crate::elements::Elements;
use crate::small::{re, times};
use crate::strain::Strain;
use nalgebra::{Matrix6, Vector6};
use std::ops::Range;
use vi_core::interpolation::StrainInterpolation;
use vi_core::interval::{Interval, Slot};
use vi_core::potential::{DiscretePotential, Potential};
use vi_core::sparse::Entries;
use vi_core::strain_energy::StrainEnergy;
use vi_core::{Configuration, Number};

/// The largest `μ` of [`crate::StrainRule::MassScaled`].
pub const MASS_SCALING: f64 = 0.125;

/// `μ = max(0, 1/8 − 1/(hω)²)` of an element with the highest frequency `ω`, `slowness` `= 1/ω²`:
/// as much as keeps `ϑ` below its bound.
pub(crate) fn scaling<T: Number>(most: f64, slowness: T, h: f64) -> T {
    let own = T::of(most) - slowness / T::of(h * h);
    if re(own) > 0.0 { own } else { T::of(0.0) }
}

/// `U_d` and `K_d` of all elements.
#[derive(Clone, Debug)]
pub struct AveragedStrains {
    pub(crate) elements: Elements,
    pub(crate) most: f64,  // largest μ
    slowness: Vec<f64>,    // elements  1/ω², s²
    tension: Vec<Bound>,   // elements; empty without tension mass
    variables: usize,      // of bounds that follow
    pub(crate) reach: f64, // L, m
    whole: f64,            // H, s
}

/// The bound `N̂` of the tension of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bound {
    /// N.
    Constant(f64),
    /// An internal variable, and which.
    Follows(usize),
}

/// Internal variables of a bound that follows: `N̂` and the tensions of the last two steps, N.
pub(crate) const OF_BOUND: usize = 3;

/// How much larger `N̂` is than the tension it is taken from.
pub(crate) const MARGIN: f64 = 1.25;

/// The share of the wave in the tension mass of curvatures.
const OF_WAVE: f64 = 1.0 / 16.0;
/// The same of the longest wave at a step that does not resolve it: `(16/9) (3/8) (2/π)²` and a
/// margin.
const OF_LONGEST_WAVE: f64 = 2.0 / 7.0;
/// The share of turning nodes.
const OF_TURNING: f64 = 1.0 / 32.0;

/// `T`, from `N̂`, `ℓ`, `L`, `h` and `Aρ`.
pub(crate) fn tension_mass<T: Number>(
    bound: T,
    [length, reach]: [T; 2],
    h: f64,
    line: T,
) -> Vector6<T> {
    let wave = T::of(OF_WAVE * h * h) * bound / line;
    let longest = T::of(OF_LONGEST_WAVE) * reach * reach;
    let wave = if re(wave) < re(longest) { wave } else { longest };
    let tau = bound * (T::of(OF_TURNING) * length * length + wave);
    Vector6::new(bound, bound, T::of(0.0), tau, tau, T::of(0.0))
}

/// The stress resultants `C (½ ε̄ ± μ Δε) ± T Δε` that act on the start (+) or on the end (−) of a
/// step; of a rope that is `slack` no force along it from `ε̄`.
#[inline]
pub(crate) fn resultants<T: Number>(
    C: &Matrix6<T>,
    (mean, change): (&Vector6<T>, &Vector6<T>),
    (mu, tension): (T, Option<Vector6<T>>),
    slack: bool,
    sign: f64,
) -> Vector6<T> {
    let mut n = C * (times(0.5, mean) + change * (T::of(sign) * mu));
    if slack {
        n += times(0.5, &((without_extension(C) - C) * mean));
    }
    if let Some(tension) = tension {
        n += times(sign, &tension.component_mul(change));
    }
    n
}

/// An element in a step of some length.
struct ScaledElement<'a> {
    index: usize,
    element: &'a Element,
    stiffness: &'a Matrix6<f64>, // C
    mu: f64,
    tension: Option<Strain>, // T
}

impl ScaledElement<'_> {
    /// The element at the start of a step.
    #[inline(always)]
    fn start<'b>(&'b self, s: &'b Interval) -> AtStart<'b> {
        self.element.at_start(s, self.index)
    }

    /// The stress resultants that act on the start (+) or on the end (−).
    fn resultants(&self, strains: [Strain; 2], sign: f64) -> Strain {
        let (mean, change) = mean_and_change(strains);
        let slack = self.element.is_slack(&mean);
        resultants(self.stiffness, (&mean, &change), (self.mu, self.tension), slack, sign)
    }

    /// `c C + d T`.
    fn sum(&self, c: f64, d: f64) -> Matrix6<f64> {
        let scaled = c * *self.stiffness;
        self.tension.map_or(scaled, |tension| with_diagonal(scaled, d, &tension))
    }

    /// `Σ` without what a slack rope does not carry of the part `¼ w C` in [`ScaledElement::sum`].
    fn slackened(&self, sum: Matrix6<f64>, mean: &Strain, weight: f64) -> Matrix6<f64> {
        match self.element.carries_tension_only() {
            true => {
                let carried = self.element.carrying(self.stiffness, mean);
                sum + 0.25 * weight * (carried - self.stiffness)
            }
            false => sum,
        }
    }
}

/// `A + d diag(T)`.
fn with_diagonal(mut A: Matrix6<f64>, d: f64, tension: &Strain) -> Matrix6<f64> {
    (0..6).for_each(|i| A[(i, i)] += d * tension[i]);
    A
}

/// How often bounds were raised so far, from the internal variables of the discrete potential.
#[must_use]
pub fn times_raised(variables: &[f64]) -> Option<u64> {
    variables.last().map(|count| *count as u64)
}

/// `ε̄` and `Δε`.
pub(crate) fn mean_and_change<T: Number>(
    [start, end]: [Vector6<T>; 2],
) -> (Vector6<T>, Vector6<T>) {
    (times(0.5, &(start + end)), end - start) // [6.11]
}

/// Which of the tensions of three steps raises a bound, from the last one on.
pub(crate) fn raised_by(element: &Element, bound: f64, tensions: [f64; 3]) -> Option<usize> {
    let count = if element.carries_tension_only() { 1 } else { 3 };
    let least = (0..count).min_by(|a, b| tensions[*a].total_cmp(&tensions[*b]))?;
    (tensions[least] > bound).then_some(least)
}

impl AveragedStrains {
    /// Averaged strains, `μ = 0`.
    #[must_use]
    pub fn new(elements: Elements) -> Self {
        let reach = elements.list().iter().map(|element| element.length).sum();
        let (slowness, tension) = (Vec::new(), Vec::new());
        Self { elements, most: 0.0, slowness, tension, variables: 0, reach, whole: 0.0 }
    }

    /// Averaged strains with selective mass scaling; `most`: the largest `μ`, usually
    /// [`MASS_SCALING`]; `slowness`: `1/ω²` of each element with its highest frequency, s²; zeros
    /// make `μ` constant.
    ///
    /// # Panics
    /// When there is not one number for each element.
    #[must_use]
    pub fn mass_scaled(elements: Elements, most: f64, slowness: Vec<f64>) -> Self {
        assert_eq!(elements.list().len(), slowness.len(), "one frequency for each element");
        Self { most, slowness, ..Self::new(elements) }
    }

    /// The same with the tension mass of bounds `N̂ ≥ 0` of the tension of each element, N.
    ///
    /// # Panics
    /// When there is not one number for each element.
    #[must_use]
    pub fn with_tension_mass(mut self, bounds: Vec<f64>) -> Self {
        assert_eq!(self.elements.list().len(), bounds.len(), "one bound for each element");
        self.tension = bounds.into_iter().map(Bound::Constant).collect();
        self.variables = 0;
        self
    }

    /// The same with bounds that follow the tension of helicoidal elements, but for those that are
    /// stated, with the elements they belong to; elements of mean directors have no tension mass.
    #[must_use]
    pub fn with_following_tension_mass(mut self, stated: &[(Range<usize>, f64)]) -> Self {
        let mut variables = 0;
        let bound = |(k, element): (usize, &Element)| {
            if element.law == StrainLaw::MeanDirectors {
                return Bound::Constant(0.0);
            }
            match stated.iter().find(|(own, _)| own.contains(&k)) {
                Some((_, bound)) => Bound::Constant(*bound),
                None => {
                    variables += OF_BOUND;
                    Bound::Follows(variables - OF_BOUND)
                }
            }
        };
        let bounds: Vec<Bound> = self.elements.list().iter().enumerate().map(bound).collect();
        if bounds.iter().any(|bound| *bound != Bound::Constant(0.0)) {
            (self.tension, self.variables) = (bounds, variables);
        }
        self
    }

    /// The same with the added mass of a step `whole` in all shorter ones, s: parts of a step have
    /// one mass matrix, and a kinetic energy that does not depend on how it is divided.
    #[must_use]
    pub fn with_mass_of(mut self, whole: f64) -> Self {
        self.whole = whole;
        self
    }

    /// The length of the step whose added mass a step `h` has.
    fn step_of_mass(&self, h: f64) -> f64 {
        if h.abs() < self.whole { self.whole } else { h }
    }

    /// The bounds that follow the tension, with their elements.
    pub(crate) fn following(
        &self,
    ) -> impl Iterator<Item = (usize, usize, &Element, &Matrix6<f64>)> {
        let all = self.tension.iter().zip(self.elements.iter()).enumerate();
        all.filter_map(|(index, (bound, (element, C)))| match bound {
            Bound::Follows(variable) => Some((*variable, index, element, C)),
            Bound::Constant(_) => None,
        })
    }

    /// The own ones of all internal variables; empty where they are not listed.
    pub(crate) fn own<'a>(&self, internal: &'a [f64]) -> &'a [f64] {
        let first = internal.len().checked_sub(self.internal_variables());
        first.map_or(&[], |first| &internal[first..])
    }

    /// The first internal variable of the bound of an element; `None` where it is constant.
    pub(crate) fn variable(&self, index: usize) -> Option<usize> {
        match self.tension.get(index)? {
            Bound::Follows(variable) => Some(*variable),
            Bound::Constant(_) => None,
        }
    }

    /// `N̂` of an element in a step; `None` without tension mass.
    pub(crate) fn bound(&self, index: usize, internal: &[f64]) -> Option<f64> {
        match *self.tension.get(index)? {
            Bound::Constant(bound) => Some(bound),
            Bound::Follows(variable) => {
                Some(self.own(internal).get(variable).copied().unwrap_or_default())
            }
        }
    }

    /// All elements, where any keeps what it is at the ends of a step.
    fn elements_that_keep(&self) -> usize {
        let all = self.elements.list();
        if all.iter().any(Element::keeps_ends) { all.len() } else { 0 }
    }

    /// The elements in a step `h`, with all internal variables.
    fn scaled<'a>(
        &'a self,
        h: f64,
        internal: &'a [f64],
    ) -> impl Iterator<Item = ScaledElement<'a>> {
        let whole = self.step_of_mass(h);
        let more = if h.abs() < self.whole { whole * whole / (h * h) } else { 1.0 }; // [N11]
        let mu = move |k: usize| {
            self.slowness.get(k).map_or(0.0, |own| more * scaling(self.most, *own, whole))
        };
        self.elements.iter().enumerate().map(move |(k, (element, stiffness))| {
            let line = self.elements.section(element).inertia()[0];
            let lengths = [element.length, self.reach];
            let tension = self.bound(k, internal);
            let tension = tension.map(|bound| more * tension_mass(bound, lengths, whole, line));
            ScaledElement { index: k, element, stiffness, mu: mu(k), tension }
        })
    }
}

impl DiscretePotential for AveragedStrains {
    fn value(&self, s: &Interval) -> f64 {
        let energy = |(k, (element, C)): (usize, (&Element, &Matrix6<f64>))| {
            let (mean, _) = mean_and_change(element.strains_of(s, k));
            0.5 * element.length * (element.carrying(C, &mean) * mean).dot(&mean) // [6.11]
        };
        self.elements.iter().enumerate().map(energy).sum()
    }

    fn added_kinetic_energy(&self, s: &Interval) -> f64 {
        let energy = |own: ScaledElement<'_>| {
            let (_, change) = mean_and_change(own.element.strains_of(s, own.index));
            let of_tension = own.tension.map_or(0.0, |t| t.component_mul(&change).dot(&change));
            let half = 0.5 * own.element.length;
            half * own.mu * (own.stiffness * change).dot(&change) + half * of_tension // [6.22]
        };
        self.scaled(s.h, &s.internal).map(energy).sum()
    }

    fn adds_mass(&self) -> bool {
        self.most > 0.0 || !self.tension.is_empty()
    }

    fn add_mass(&self, at: Configuration<'_>, h: f64, out: &mut dyn Entries) {
        if self.adds_mass() {
            let h = self.step_of_mass(h);
            for own in self.scaled(h, at.internal) {
                let weight = h * h * own.element.length;
                let at = own.element.within(at.q);
                let mass = own.sum(own.mu * h * h * own.element.length, weight);
                at.emit_outer(&at, &mass, out);
            }
        }
    }

    fn add_mass_slope(&self, at: Configuration<'_>, h: f64, v: &[f64], out: &mut dyn Entries) {
        if self.adds_mass() {
            let h = self.step_of_mass(h);
            for own in self.scaled(h, at.internal) {
                let (element, weight) = (own.element, h * h * own.element.length);
                let (within, v) = (element.within(at.q), element.coordinates(v));
                let mass = own.sum(own.mu * weight, weight);
                let rates = within.tangent_of_rates(&v, &mass, &(mass * within.rate(&v)));
                element.emit(&rates, out);
            }
        }
    }

    fn add_mass_by_internal(
        &self,
        at: Configuration<'_>,
        h: f64,
        v: &[f64],
        out: &mut dyn Entries,
    ) {
        self.emit_mass_by_bounds(at, h, v, out);
    }

    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        for own in self.scaled(s.h, &s.internal) {
            let (element, start) = (own.element, own.start(s));
            let end = element.end_strain(s, own.index);
            let n = own.resultants([start.strain(), end], 1.0);
            start.scatter(&(scale * element.length * n), out); // [6.12]
        }
    }

    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        for own in self.scaled(s.h, &s.internal) {
            let (element, end) = (own.element, own.element.at_end(s, own.index));
            let start = element.start_strain(s, own.index);
            let n = own.resultants([start, end.strain()], -1.0);
            end.scatter(&(scale * element.length * n), out); // [6.12]
        }
    }

    fn add_d2_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for own in self.scaled(s.h, &s.internal) {
            let (start, end) = (own.start(s), own.element.at_end(s, own.index));
            let weight = scale * own.element.length;
            let mut c = own.sum((0.25 + own.mu) * scale * own.element.length, weight);
            if own.element.carries_tension_only() {
                let (mean, _) = mean_and_change([start.strain(), end.strain()]);
                c = own.slackened(c, &mean, weight);
            }
            start.emit_outer(&end, &c, out);
        }
    }

    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for own in self.scaled(s.h, &s.internal) {
            let element = own.element;
            let (at, weight) = (element.within(&s.q0), scale * element.length);
            let (mean, change) = mean_and_change(element.strains_of(s, own.index));
            let C = weight * *own.stiffness;
            let mut n = C * (0.5 * mean + own.mu * change);
            let mut c = (0.25 - own.mu) * C;
            if element.carries_tension_only() {
                c = own.slackened(c, &mean, weight);
                n += 0.5
                    * weight
                    * ((element.carrying(own.stiffness, &mean) - own.stiffness) * mean);
            }
            if let Some(tension) = own.tension {
                n += weight * tension.component_mul(&change);
                c = with_diagonal(c, -weight, &tension);
            }
            at.emit_tangent(&c, &n, out);
        }
    }

    /// Of each element whose bound follows, and how often any of them was raised.
    fn internal_variables(&self) -> usize {
        self.variables + usize::from(self.variables > 0)
    }

    fn begin(&self, q: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (variable, _, element, C) in self.following() {
            let tension = (C * element.strain(&element.coordinates(q)))[2];
            out[variable] = MARGIN * tension.max(0.0);
            out[variable + 1..variable + OF_BOUND].fill(tension);
        }
    }

    fn advance(&self, s: &Interval, out: &mut [f64]) {
        let mut raised = false;
        for (variable, index, element, C) in self.following() {
            let (mean, _) = mean_and_change(element.strains_of(s, index));
            let [bound, last, before] = &mut out[variable..variable + OF_BOUND] else { continue };
            let tension = C.row(2).tr_dot(&mean);
            let tensions = [tension, *last, *before];
            if let Some(least) = raised_by(element, *bound, tensions) {
                (*bound, raised) = (MARGIN * tensions[least], true);
            }
            (*last, *before) = (tension, *last);
        }
        if let (true, Some(count)) = (raised, out.last_mut()) {
            *count += 1.0;
        }
    }

    fn begin_change(&self, q: &[f64], dq: &[f64], out: &mut [f64]) {
        self.add_start_change(q, dq, out);
    }

    fn add_internal_slope(&self, s: &Interval, of: Slot, scale: f64, out: &mut dyn Entries) {
        self.emit_bound_slopes(s, of, scale, out);
    }

    fn add_advance_slope(&self, s: &Interval, by: Slot, out: &mut dyn Entries) {
        self.emit_advance(s, by, out);
    }

    fn add_advance_internal_slope(&self, s: &Interval, out: &mut dyn Entries) {
        self.emit_advance_of_bounds(s, out);
    }

    /// Of each element, where any has helicoidal strains.
    fn derived_values(&self) -> usize {
        OF_START * self.elements_that_keep()
    }

    fn derive(&self, q: &[f64], out: &mut [f64]) {
        for (element, own) in self.elements.list().iter().zip(out.chunks_exact_mut(OF_START)) {
            element.keep_start(q, own);
        }
    }

    /// Of each element, where any has helicoidal strains.
    fn end_values(&self) -> usize {
        OF_END * self.elements_that_keep()
    }

    fn derive_end(&self, q: &[f64], out: &mut [f64]) {
        for (element, own) in self.elements.list().iter().zip(out.chunks_exact_mut(OF_END)) {
            element.keep_end(q, own);
        }
    }

    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.elements.value(at.q)
    }

    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.elements.add_gradient(at.q, scale, out);
    }

    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.elements.add_hessian(at.q, scale, out);
    }

    fn strain_energy(&self) -> Option<&dyn StrainEnergy> {
        Some(&self.elements)
    }

    fn interpolation(&self) -> Option<&dyn StrainInterpolation> {
        (!self.adds_mass()).then_some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::elements::tests::{near_frames, random_elements, with_strains};
    use nalgebra::{DMatrix, Vector3};
    use vi_core::potential::Midpoint;
    use vi_rigid::{directors, rotation};
    use vi_testkit::Sample;

    fn interval(q0: &[f64], q1: &[f64]) -> Interval {
        let mut s = Interval::new(q0.len());
        s.open(0.0, 0.1, q0);
        s.q1.copy_from_slice(q1);
        s.close_from_end();
        s
    }

    #[test]
    fn slot_derivatives_match_central_differences() {
        for scaling in [0.0, MASS_SCALING] {
            for kind in
                [ElementKind::MeanDirectors, ElementKind::Helicoidal, ElementKind::SecondOrder]
            {
                check_slot_derivatives((scaling, 0.0), kind);
            }
        }
        check_slot_derivatives((MASS_SCALING, 0.25), ElementKind::Helicoidal);
    }

    /// Parts of a step have its added mass, whatever their length; longer steps their own [N11].
    #[test]
    fn parts_of_a_step_have_the_mass_of_the_whole() {
        let mut sample = Sample::new(23);
        let q = near_frames(&mut sample);
        let elements = with_strains(random_elements(&mut sample).0, ElementKind::Helicoidal, &q);
        let U_d = AveragedStrains::mass_scaled(elements, MASS_SCALING, vec![0.0, 1e-3])
            .with_tension_mass(vec![0.7, 2.0])
            .with_mass_of(0.1);
        let mass = |h: f64| {
            let mut out = DMatrix::zeros(36, 36);
            U_d.add_mass(Configuration::new(0.0, &q), h, &mut out);
            out
        };
        let whole = mass(0.1);
        assert!(whole.amax() > 1e-3 && (mass(0.2) - &whole).amax() > 1e-3);
        for part in [0.07, 0.01, 1e-6, 0.0] {
            assert_eq!(mass(part), whole, "{part}");
        }
    }

    fn check_slot_derivatives((scaling, whole): (f64, f64), kind: ElementKind) {
        let mut sample = Sample::new(21);
        let (mut elements, mut q0) = random_elements(&mut sample);
        let mut reach = 0.3;
        if kind != ElementKind::MeanDirectors {
            (q0, reach) = (near_frames(&mut sample), 0.05); // ψ < π
            elements = with_strains(elements, kind, &q0);
        }
        let q1: Vec<f64> = q0.iter().map(|q| q + reach * sample.number()).collect();
        let mut U_d = AveragedStrains::mass_scaled(elements, scaling, vec![0.0, 1e-3]);
        if scaling > 0.0 {
            U_d = U_d.with_tension_mass(vec![0.7, 2.0]).with_mass_of(whole);
        }
        let at = interval(&q0, &q1);
        assert!(U_d.value(&at).is_finite());
        let (mut d1, mut d2) = (vec![0.0; 36], vec![0.0; 36]);
        U_d.add_d1(&at, 1.0, &mut d1);
        U_d.add_d2(&at, 1.0, &mut d2);
        let mut mixed = DMatrix::zeros(36, 36);
        U_d.add_d2_d1(&at, 1.0, &mut mixed);
        let mut same = DMatrix::zeros(36, 36);
        U_d.add_d1_d1(&at, 1.0, &mut same);
        let (e, mut worst) = (1e-5, 0.0_f64);
        let moved = |q: &[f64], i: usize, by: f64| {
            let mut q = q.to_vec();
            q[i] += by;
            q
        };
        for j in 0..36 {
            let difference = |s: &Interval| U_d.value(s) - U_d.added_kinetic_energy(s);
            let value = |by| difference(&interval(&moved(&q0, j, by), &q1));
            worst = worst.max(((value(e) - value(-e)) / (2.0 * e) - d1[j]).abs());
            let value = |by| difference(&interval(&q0, &moved(&q1, j, by)));
            worst = worst.max(((value(e) - value(-e)) / (2.0 * e) - d2[j]).abs());
            let slot = |by| {
                let mut out = vec![0.0; 36];
                U_d.add_d1(&interval(&q0, &moved(&q1, j, by)), 1.0, &mut out);
                out
            };
            let (plus, minus) = (slot(e), slot(-e));
            for i in 0..36 {
                worst = worst.max(((plus[i] - minus[i]) / (2.0 * e) - mixed[(i, j)]).abs());
            }
            let slot = |by| {
                let mut out = vec![0.0; 36];
                U_d.add_d1(&interval(&moved(&q0, j, by), &q1), 1.0, &mut out);
                out
            };
            let (plus, minus) = (slot(e), slot(-e));
            for i in 0..36 {
                worst = worst.max(((plus[i] - minus[i]) / (2.0 * e) - same[(i, j)]).abs());
            }
        }
        println!("{kind:?}: slot derivatives off by {worst:.1e}");
        assert!(worst < 1e-7, "{worst:e}");
    }

    #[test]
    fn a_rigid_rotation_is_free_of_strain_here_and_not_at_the_midpoint() {
        let mut sample = Sample::new(22);
        let (mut elements, q0) = random_elements(&mut sample);
        let stress_free: Vec<_> = elements.list().to_vec();
        let sections: Vec<_> = stress_free.iter().map(|e| *elements.section(e)).collect();
        elements = Elements::new();
        for (element, section) in stress_free.iter().zip(sections) {
            let section = elements.add_section(section);
            elements.add_stress_free(element.nodes, element.length, section, &q0).unwrap();
        }
        let turn = rotation::exp(&Vector3::new(0.9, -0.4, 0.7));
        let mut q1 = q0.clone();
        for k in 0..3 {
            let own = 12 * k..12 * k + 12;
            let (center, triad) =
                (directors::center(&q0[own.clone()]), directors::triad(&q0[own.clone()]));
            directors::set_frame(&mut q1[own], &(turn * center), &(turn * triad));
        }
        let s = interval(&q0, &q1);
        let (here, there) = (
            AveragedStrains::mass_scaled(elements.clone(), MASS_SCALING, vec![0.0; 2]).value(&s),
            Midpoint(elements).value(&s),
        );
        println!("energy of a rigid turn: averaged {here:.1e}, midpoint {there:.1e}");
        assert!(here < 1e-28 && there > 1e-3, "{here:e}, {there:e}");
    }

    #[test]
    fn the_added_mass_is_that_of_its_kinetic_energy_and_moves_with_no_rigid_motion() {
        let mut sample = Sample::new(23);
        let (elements, q0) = random_elements(&mut sample);
        let U_d = AveragedStrains::mass_scaled(elements, MASS_SCALING, vec![0.0; 2])
            .with_tension_mass(vec![0.7, 2.0]);
        let v: Vec<f64> = q0.iter().map(|_| sample.number()).collect();
        let h = 1e-5;
        let mut mass = DMatrix::zeros(36, 36);
        U_d.add_mass(Configuration::new(0.0, &q0), h, &mut mass);
        let twice = |v: &[f64]| {
            let v = nalgebra::DVector::from_column_slice(v);
            v.dot(&(&mass * &v))
        };
        let q1: Vec<f64> = q0.iter().zip(&v).map(|(q, v)| q + h * v).collect();
        let energy = U_d.added_kinetic_energy(&interval(&q0, &q1));
        let relative = (0.5 * twice(&v) - energy).abs() / energy;
        let (turn, shift) = (Vector3::new(0.3, -0.8, 0.5), Vector3::new(2.0, -1.0, 0.4));
        let mut rigid = vec![0.0; 36];
        for (k, (out, x)) in rigid.chunks_exact_mut(3).zip(q0.chunks_exact(3)).enumerate() {
            let x = turn.cross(&Vector3::from_column_slice(x));
            let own = if k % 4 == 0 { x + shift } else { x };
            out.copy_from_slice(own.as_slice());
        }
        let (rigid, any) = (twice(&rigid), twice(&v));
        println!("K_d off by {relative:.1e} (relative); rigid {rigid:.1e}, any motion {any:.1e}");
        assert!(relative < 1e-4 && rigid.abs() < 1e-24 * any.max(1.0), "{relative:e}, {rigid:e}");
    }

    /// Extended by `strains` at the ends of steps, one after the other: the bound after each.
    fn bounds(strains: &[f64]) -> Vec<f64> {
        let mut sample = Sample::new(24);
        let q = near_frames(&mut sample);
        let (elements, _) = random_elements(&mut sample);
        let elements = with_strains(elements, ElementKind::Helicoidal, &q);
        let d_3 = Vector3::from_column_slice(&q[9..12]);
        let at = |strain: f64| -> Vec<f64> {
            let mut q = q.clone(); // the node 1 of both elements stands before the others
            (0..3).for_each(|i| q[12 + i] += strain * 0.8 * d_3[i]);
            q
        };
        let U_d = AveragedStrains::new(elements).with_following_tension_mass(&[]);
        let mut internal = vec![0.0; U_d.internal_variables()];
        U_d.begin(&at(0.0), &mut internal);
        let raise = |pair: &[f64]| {
            U_d.advance(&interval(&at(pair[0]), &at(pair[1])), &mut internal);
            internal[0].max(internal[OF_BOUND])
        };
        strains.windows(2).map(raise).collect()
    }

    #[test]
    fn tension_of_three_steps_raises_its_bound_and_a_shock_does_not() {
        let shock = bounds(&[0.0, 0.04, 0.02, -0.06, 0.04, 0.03, -0.06, 0.02]);
        assert!(shock.iter().all(|bound| *bound == 0.0), "{shock:?}");
        let pulled = bounds(&[0.0, 0.02, 0.04, 0.04, 0.04, 0.04]);
        println!("bounds {pulled:?}");
        assert!(pulled[1] == 0.0 && pulled[2] > 0.0, "{pulled:?}");
        // the least of the last three: 1.25 times the tension
        let ratio = pulled[4] / pulled[2];
        assert!((ratio - 4.0).abs() < 0.5, "{pulled:?}");
    }
}
