//! Algorithmic dissipation of unresolved vibrations: a passive high-pass filter in each strain of a
//! section.
//!
//! ```text
//! force of a step  f_d^- = −½ h Σ_e ℓ Σ_i C_i φ_i 𝔹_i x_n,      f_d^+ = −½ h Σ_e ℓ Σ_i C_i φ_i 𝔹_i x_{n+1}
//! filter, z = (π_1, e_2, π_3) of each strain, (·)̄ = ½ ((·)_n + (·)_{n+1}):
//!                  Δe_2 = Δε − π̄_1/m_1
//!                  Δπ_3 = r (Δe_2 − π̄_3/m_3)
//!                  Δπ_1 = φ = ē_2/c_2 + Δπ_3
//! energy           W = ½ ℓ C_i (π_1²/m_1 + e_2²/c_2 + π_3²/m_3)
//! of a step        ℓ C_i φ Δε = ΔW + ℓ C_i r (Δe_2 − π̄_3/m_3)²
//! ```
//! The filter is a ladder of an inertance `m_1`, a compliance `c_2` and an inertance `m_3`,
//! terminated by a dashpot `r`, by the midpoint rule in units of the step. Its energy is a
//! quadratic form, so the last line is an identity: no step creates energy, whatever the step and
//! the motion, and the sum of `ℓ C_i φ Δε` is never negative. The transmission zeros of all three
//! elements are at zero frequency, so a vibration `hω ≪ 1` loses in a step the part
//! ```text
//! (hω)² Re Z(ihω),      Re Z(ix) = (m_1 c_2 m_3)² x⁶/r + O(x⁸)
//! ```
//! of its energy, and for `hω → ∞` the vibration is that of the filter and of the constant mass `μ`
//! alone ([`MASS`], [`crate::averaged`]): all multipliers from `hω = 3` to infinity are below 0.78.
//! `m_1` and `μ` act on resolved vibrations as an added mass: their period is longer by the part
//! `(1/12 + (μ + m_1)/2)(hω)²`.
//!
//! `Δε` depends on `z_n` only through the known history, so `φ = a Δε + g·z_n` with constant `a`
//! and `g`, and the Newton matrix has the pattern of material damping. Strains do not see rigid
//! motions of `x_n` or of `x_{n+1}`: neither linear nor angular momentum changes. `φ = O(h²)` for a
//! smooth motion, so the order is 2.
//!
//! Letters: `C_i` stiffnesses, `ℓ` length, `𝔹_i x` strain gradients, `z`
//! internal variables in units of the strain.
//!
//! Source: theory §6.12; S. Darlington, J. Math. Phys. 18 (1939) 257–353 (lossless ladders with one
//! resistance); M. C. Smith, IEEE Trans. Autom. Control 47 (2002) 1648–1662 (inertance).
#![allow(non_snake_case)] // C, A, B

use crate::elements::Elements;
use crate::model::BeamElements;
use crate::strain::{STRAINS, Strain};
use crate::strained::Strained;
use nalgebra::{Matrix3, RowVector3, Vector3, Vector6};
use vi_core::force::{DiscreteForce, NoTimeSlope, Source};
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::sparse::Entries;
use vi_core::{Motion, Number};

/// Under which its work is listed.
pub const SOURCE: Source = Source::System("algorithmic dissipation");

/// The constant `μ` of [6.22] beside this force.
pub const MASS: f64 = 1.0 / 32.0;
/// `m_1`.
const M1: f64 = 3.0 / 40.0;
/// `c_2`.
const C2: f64 = 17.0 / 10.0;
/// `m_3`.
const M3: f64 = 1.0 / 5.0;
/// `r`.
const R: f64 = 11.0 / 40.0;

/// Internal variables of a strain.
const OF_STRAIN: usize = 3;
/// Internal variables of an element.
const OF_POINT: usize = STRAINS * OF_STRAIN;

/// The step of a filter in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StrainFilter {
    of_strain: f64,            // a   φ = a Δε + g z_n
    of_state: RowVector3<f64>, // g
    next: Matrix3<f64>,        // T   z_{n+1} = T z_n + b Δε
    driven: Vector3<f64>,      // b
}

impl StrainFilter {
    /// From `Δz = A z̄ + B Δε`, `φ = g̃ z̄ + r Δε`: `z̄ = (1 − ½A)⁻¹ (z_n + ½ B Δε)`.
    fn new() -> Self {
        let g = RowVector3::new(-R / M1, 1.0 / C2, -R / M3);
        let A = Matrix3::from_rows(&[
            g,
            RowVector3::new(-1.0 / M1, 0.0, 0.0),
            RowVector3::new(-R / M1, 0.0, -R / M3),
        ]); // [6.25]
        let B = Vector3::new(R, 1.0, R);
        let mean = (Matrix3::identity() - 0.5 * A).try_inverse().expect("A is stable");
        Self {
            of_strain: 0.5 * (g * mean * B).x + R,
            of_state: g * mean,
            next: 2.0 * mean - Matrix3::identity(),
            driven: mean * B,
        }
    }

    /// `φ`.
    fn stress<T: Number>(&self, z: &Vector3<f64>, change: T) -> T {
        T::of(self.of_strain) * change + T::of(self.of_state.tr_dot(z))
    }

    /// `z_{n+1}`.
    fn step(&self, z: &Vector3<f64>, change: f64) -> Vector3<f64> {
        self.next * z + change * self.driven
    }
}

/// The dissipative force of all elements.
#[derive(Clone, Debug)]
pub struct StrainDissipation {
    elements: Elements,
    filter: StrainFilter,
}

impl StrainDissipation {
    /// For all elements of a model.
    #[must_use]
    pub fn new(model: &BeamElements) -> Self {
        Self { elements: model.elements.clone(), filter: StrainFilter::new() }
    }

    /// `φ` of an element whose strains change by `Δε` in a step.
    pub(crate) fn stress<T: Number>(
        &self,
        s: &Interval,
        index: usize,
        change: &Vector6<T>,
    ) -> Vector6<T> {
        Vector6::from_fn(|i, _| self.filter.stress(&variables(s, index, i), change[i]))
    }

    /// Adds what a change of `Δε` of an element adds to `z_{n+1}`.
    pub(crate) fn add_driven(&self, index: usize, change: &Strain, out: &mut [f64]) {
        let own = &mut out[OF_POINT * index..OF_POINT * (index + 1)];
        for (own, change) in own.chunks_exact_mut(OF_STRAIN).zip(change.iter()) {
            own.iter_mut().zip(&self.filter.driven).for_each(|(own, by)| *own += change * by);
        }
    }

    /// `C_i ℓ φ_i` in a step.
    fn forces(&self, s: &Interval, index: usize, own: &Strained<'_>) -> Strain {
        own.stiffness() * self.stress(s, index, &own.change(s, index))
    }

    /// `out ← out + h' f/h` of the force `f` of an end, for the step `h'`.
    fn add_slot(&self, s: &Interval, of: Slot, h: f64, out: &mut [f64]) {
        for (index, own) in self.elements.strained().enumerate() {
            let n = -0.5 * h * self.forces(s, index, &own);
            own.add_at(s, index, of, &n, out); // [6.24]
        }
    }

    /// Visits `φ`'s slopes by the internal variables: element, variable, `−½ h ℓ C_i g_k`.
    fn for_each_internal(&self, s: &Interval, mut visit: impl FnMut(&Strained<'_>, usize, Strain)) {
        for (index, own) in self.elements.strained().enumerate() {
            let stiffness = own.stiffness();
            for i in 0..STRAINS {
                let stress = -0.5 * s.h * stiffness.column(i);
                for k in 0..OF_STRAIN {
                    let variable = OF_POINT * index + OF_STRAIN * i + k;
                    visit(&own, variable, self.filter.of_state[k] * stress);
                }
            }
        }
    }
}

/// `z_n` of strain `i` at the point `index`; zero where there are none.
fn variables(s: &Interval, index: usize, i: usize) -> Vector3<f64> {
    let first = OF_POINT * index + OF_STRAIN * i;
    s.internal.get(first..first + OF_STRAIN).map_or_else(Vector3::zeros, Vector3::from_column_slice)
}

impl DiscreteForce for StrainDissipation {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        self.add_slot(s, Slot::First, s.h, out);
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        self.add_slot(s, Slot::Second, s.h, out);
    }

    fn add_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        for (index, own) in self.elements.strained().enumerate() {
            let c = -0.5 * s.h * by.sign() * self.filter.of_strain * own.stiffness();
            if of == by {
                let n = -0.5 * s.h * self.forces(s, index, &own);
                own.emit(s.node(of), &c, &n, out);
            } else {
                own.emit_between(s, index, of, &c, out);
            }
        }
    }

    fn add_internal_slope(&self, s: &Interval, of: Slot, out: &mut dyn Entries) {
        self.for_each_internal(s, |own, variable, stress| {
            own.for_each(s.node(of), &stress, |i, slope| out.add(i, variable, slope));
        });
    }

    fn add_step_slope(
        &self,
        s: &Interval,
        of: Slot,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        self.add_slot(s, of, change.length, out); // φ knows no step
        Ok(())
    }

    fn add_time_slope(
        &self,
        _at: Motion<'_>,
        _scale: f64,
        _out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        Err(NoTimeSlope)
    }

    fn add_continuous(&self, _: Motion<'_>, _: &mut [f64]) {}

    /// `−Σ ℓ C_i φ_i Δε_i`: what the filters store and dissipate.
    fn work(&self, s: &Interval, _scratch: &mut [f64]) -> f64 {
        let mut work = 0.0;
        for (index, own) in self.elements.strained().enumerate() {
            let change = own.change(s, index);
            work -= self.forces(s, index, &own).dot(&change);
        }
        work
    }

    fn add_stiffness(&self, _: Motion<'_>, _: f64, _: &mut dyn Entries) {}

    fn add_position_slope(&self, _: Motion<'_>, _: f64, _: &mut dyn Entries) {}

    fn add_damping(&self, _: Motion<'_>, _: f64, _: &mut dyn Entries) {}

    fn is_dissipative(&self) -> bool {
        true
    }

    fn internal_variables(&self) -> usize {
        OF_POINT * self.elements.list().len()
    }

    fn advance(&self, s: &Interval, out: &mut [f64]) {
        for (index, own) in self.elements.strained().enumerate() {
            let change = own.change(s, index);
            let own = &mut out[OF_POINT * index..OF_POINT * (index + 1)];
            for (i, own) in own.chunks_exact_mut(OF_STRAIN).enumerate() {
                let next = self.filter.step(&variables(s, index, i), change[i]);
                own.copy_from_slice(next.as_slice()); // [6.25]
            }
        }
    }

    fn add_advance_slope(&self, s: &Interval, by: Slot, out: &mut dyn Entries) {
        for (index, own) in self.elements.strained().enumerate() {
            for i in 0..STRAINS {
                let unit = Strain::ith(i, by.sign());
                own.for_each(s.node(by), &unit, |column, slope| {
                    for (k, driven) in self.filter.driven.iter().enumerate() {
                        let row = OF_POINT * index + OF_STRAIN * i + k;
                        out.add(row, column, driven * slope);
                    }
                });
            }
        }
    }

    fn add_advance_internal_slope(&self, _s: &Interval, out: &mut dyn Entries) {
        for first in (0..self.internal_variables()).step_by(OF_STRAIN) {
            for (i, j) in (0..OF_STRAIN).flat_map(|i| (0..OF_STRAIN).map(move |j| (i, j))) {
                out.add(first + i, first + j, self.filter.next[(i, j)]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damping::tests::{of, resultant};
    use crate::element::ElementKind;
    use crate::elements::tests::{near_frames, random_elements, with_strains};
    use nalgebra::{DMatrix, DVector};
    use vi_testkit::{Sample, slope_error};

    /// Two elements on three nodes, which helicoidal strains want to differ little.
    fn dissipation(sample: &mut Sample, kind: ElementKind) -> (StrainDissipation, Vec<f64>) {
        let (mut elements, mut q) = random_elements(sample);
        if kind != ElementKind::MeanDirectors {
            q = near_frames(sample);
            elements = with_strains(elements, kind, &q);
        }
        (StrainDissipation { elements, filter: StrainFilter::new() }, q)
    }

    /// Another configuration, near enough for both kinds of strains.
    fn moved_little(q: &[f64], sample: &mut Sample) -> Vec<f64> {
        q.iter().map(|q| q + 0.1 * sample.number()).collect()
    }

    /// An interval between two configurations with random internal variables.
    fn interval(force: &StrainDissipation, q: [&[f64]; 2], sample: &mut Sample) -> Interval {
        let mut s = Interval::between(0.0, 0.3, q[0], q[1]);
        s.internal = (0..force.internal_variables()).map(|_| sample.number()).collect();
        s
    }

    #[test]
    fn slot_derivatives_match_central_differences() {
        for kind in [ElementKind::MeanDirectors, ElementKind::Helicoidal] {
            let mut sample = Sample::new(51);
            let (force, q0) = dissipation(&mut sample, kind);
            let q1 = moved_little(&q0, &mut sample);
            let s = interval(&force, [&q0, &q1], &mut sample);
            let off = slope_error(&force, &s);
            println!("{kind:?}: off by {off:.1e} (relative)");
            assert!(off < 1e-8, "{off:e}");
        }
    }

    /// `½ ℓ Σ c_i z_iᵀC z_i` of a part of the filters that `part` takes from the variables, J.
    fn form(force: &StrainDissipation, part: impl Fn(&[f64], usize) -> f64, z: &[f64]) -> f64 {
        let mut energy = 0.0;
        for (index, own) in force.elements.strained().enumerate() {
            let first = |i: usize| OF_POINT * index + OF_STRAIN * i;
            let x = Strain::from_fn(|i, _| part(&z[first(i)..first(i) + OF_STRAIN], 6 * index + i));
            energy += (own.stiffness() * x).dot(&x);
        }
        energy
    }

    /// `W` of all filters, J.
    fn stored(force: &StrainDissipation, z: &[f64]) -> f64 {
        let parts = [M1, C2, M3].into_iter().enumerate();
        parts.map(|(k, own)| 0.5 * form(force, |z, _| z[k], z) / own).sum()
    }

    #[test]
    fn no_step_creates_energy_or_momentum() {
        let mut sample = Sample::new(52);
        for case in 0..40 {
            // the chord strains quadratic strains exactly, others to second order
            let (kind, bound) =
                [(ElementKind::MeanDirectors, 1e-12), (ElementKind::Helicoidal, 1e-2)][case % 2];
            let (force, q0) = dissipation(&mut sample, kind);
            let q1 = moved_little(&q0, &mut sample);
            let s = interval(&force, [&q0, &q1], &mut sample);
            let mut next = vec![f64::NAN; force.internal_variables()];
            force.advance(&s, &mut next);
            let mut change = Vec::new();
            for own in force.elements.strained() {
                change.extend_from_slice((own.strain(&q1) - own.strain(&q0)).as_slice());
            }
            let mean: Vec<f64> = s.internal.iter().zip(&next).map(|(a, b)| 0.5 * (a + b)).collect();
            let rate = |z: &[f64], i: usize| change[i] - z[0] / M1 - z[2] / M3;
            let dissipated = R * form(&force, rate, &mean); // [6.26]
            let given = -force.work(&s, &mut []);
            let (before, after) = (stored(&force, &s.internal), stored(&force, &next));
            let scale = before.max(after).max(dissipated);
            let missed = (given - (after - before) - dissipated).abs() / scale;
            let chord = {
                let both = of(&|out| {
                    force.add_minus(&s, out);
                    force.add_plus(&s, out);
                });
                -both.iter().zip(&s.v_mid).map(|(f, v)| f * v).sum::<f64>()
            };
            let parts = [(&q0, of(&|out| force.add_minus(&s, out)))];
            let parts = parts.into_iter().chain([(&q1, of(&|out| force.add_plus(&s, out)))]);
            let rest = parts.map(|(q, f)| resultant(q, &f) / DVector::from_column_slice(&f).norm());
            let rest = rest.fold(0.0, f64::max);
            let apart = (chord - given).abs() / scale;
            assert!(
                missed < 1e-13 && apart < bound && rest < 1e-13,
                "{missed:e} {apart:e} {rest:e}"
            );
        }
    }

    /// The step map of `ẍ = −(hω)² x` in `(x, p, z)` for linear strains, `h = 1`, with `p` and
    /// forces over `(hω)²`.
    fn vibration(w: f64) -> DMatrix<f64> {
        let StrainFilter { of_strain: a, of_state: g, next, driven } = StrainFilter::new();
        let mass = 1.0 / (w * w);
        let lead = mass + 0.25 + MASS + 0.5 * a;
        let mut change = DMatrix::zeros(1, 5); // x_{n+1} − x_n
        (change[0], change[1]) = (-0.5 / lead, 1.0 / lead);
        (0..3).for_each(|k| change[2 + k] = -0.5 * g[k] / lead);
        let mut map = DMatrix::identity(5, 5);
        map.row_mut(0).iter_mut().zip(&change).for_each(|(x, d)| *x += d);
        let own = mass + MASS - 0.25 - 0.5 * a;
        (0..5).for_each(|k| map[(1, k)] = own * change[k]);
        map[(1, 0)] -= 0.5;
        (0..3).for_each(|k| map[(1, 2 + k)] -= 0.5 * g[k]);
        map.view_mut((2, 0), (3, 5)).copy_from(&(driven * &change));
        let mut of_state = map.view_mut((2, 2), (3, 3));
        of_state += next;
        let scale = w.recip().min(1.0); // rows and columns of p
        map.column_mut(1).scale_mut(scale);
        map.row_mut(1).scale_mut(1.0 / scale);
        map
    }

    #[test]
    fn resolved_vibrations_stay_and_all_others_die_out() {
        let largest = |w: f64| {
            vibration(w).complex_eigenvalues().iter().map(|z| z.norm()).fold(0.0, f64::max)
        };
        for w in [0.1, 0.2, 0.3] {
            let steps = 200.0 * std::f64::consts::PI / (2.0 * (0.5_f64 * w).atan());
            let lost = -2.0 * steps * largest(w).ln();
            let series = (M1 * C2 * M3).powi(2) * w.powi(8) / R * steps;
            println!(
                "hω = {w}: loses {lost:.2e} of its energy in 100 periods, series {series:.2e}"
            );
            assert!(lost < 4e-4 && (lost - series).abs() < 0.1 * series + 1e-8, "{lost:e}");
        }
        for w in [3.0, 3.5, 4.0, 5.0, 7.0, 10.0, 30.0, 1e2, 1e3, 1e4, 1e6] {
            let found = largest(w);
            assert!(found < 0.781, "hω = {w}: |z| = {found}");
        }
    }
}
