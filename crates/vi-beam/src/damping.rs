//! Material damping of beams: Kelvin–Voigt in all six strains of a section.
//!
//! ```text
//! stress           C_i (ε_i + τ_i ε̇_i),      τ_i = η_i/(2π f) for a loss factor η_i at the frequency f
//! force            f = −Σ_e ℓ Σ_i C_i τ_i ε̇_i 𝔹_i x,      ε̇_i = (𝔹_i x)·ẋ
//! of a step        f_d^- = −(½ + θ) Σ_e ℓ Σ_i C_i τ_i Δε_i 𝔹_i x_n,      Δε = ε(q_{n+1}) − ε(q_n)
//!                  f_d^+ = −(½ − θ) Σ_e ℓ Σ_i C_i τ_i Δε_i 𝔹_i x_{n+1}
//! D_2 f_d^-        = −(½ + θ) Σ_e ℓ Σ_i C_i τ_i (𝔹_i x_n)(𝔹_i x_{n+1})ᵀ
//! dissipated       Σ_e ℓ Σ_i C_i τ_i Δε_i²/h      in a step, to second order
//! ```
//! Strains do not see rigid motions of `x_n` or of `x_{n+1}`, so `f_d^-` and `f_d^+` change neither
//! linear nor angular momentum, whatever the step. Energy–momentum schemes evaluate `f` at the
//! midpoint of the step, with `ε̇ = Δε/h` exactly, since strains are quadratic.
//!
//! `θ = 0` is of order 2. Alone it leaves a motion that is damped within the step, `τ ≫ h`, with a
//! multiplier close to −1. With selective mass scaling `θ = 4μ` (see [`crate::averaged`]): zero
//! where `h ω_e ≤ √8`, so that the order is 2, and ½ for unresolved elements, where the second
//! multiplier tends to zero as `τ/h` grows. The two multipliers of a strain of infinite stiffness
//! are the roots of
//! ```text
//! (¼ + μ + (½ + θ) τ/h) z² + (½ − 2μ − 2θ τ/h) z + ¼ + μ − (½ − θ) τ/h = 0
//! ```
//!
//! Letters: `C_i` stiffnesses, `τ_i` relaxation times (s), `ℓ` length or weight of a Gauss point,
//! `𝔹_i x` strain gradients. Source: theory §6.11; J. Linn, H. Lang, A. Tuganov, Mech. Sci. 4
//! (2013) 79–96.
#![allow(non_snake_case)] // C, V

use crate::averaged::{MASS_SCALING, scaling};
use crate::elements::Elements;
use crate::strained::Strained;
use nalgebra::{Matrix6, Vector6};
use vi_core::force::{DiscreteForce, Force, NoTimeSlope, Source};
use vi_core::interpolation::StrainInterpolation;
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::sparse::Entries;
use vi_core::{Motion, Number};

/// Under which its work is listed.
pub const SOURCE: Source = Source::System("material damping");

/// `θ` of an element, from its `1/ω²`, s².
pub(crate) fn lag<T: Number>(slowness: T, h: f64) -> T {
    T::of(4.0) * scaling(MASS_SCALING, slowness, h)
}

/// `−(½ ± θ) V Δε`, which act on an end of a step.
#[inline]
pub(crate) fn resultants<T: Number>(
    V: &Matrix6<T>,
    change: &Vector6<T>,
    theta: T,
    of: Slot,
) -> Vector6<T> {
    (V * change) * -(T::of(0.5) - T::of(of.sign()) * theta)
}

/// The Kelvin–Voigt force of all elements whose section has damping.
#[derive(Clone, Debug)]
pub struct StrainDamping {
    elements: Elements,
    slowness: Option<Vec<f64>>, // 1/ω² of each element, s²; None: θ = 0
}

impl StrainDamping {
    /// With `θ = 0`; `None` when no section has damping.
    #[must_use]
    pub fn new(elements: &Elements) -> Option<Self> {
        let damped = elements.list().iter().any(|own| elements.section(own).is_damped());
        damped.then(|| Self { elements: elements.clone(), slowness: None })
    }

    /// With `θ = 4μ` of selective mass scaling, from `1/ω²` of each element, s².
    #[must_use]
    pub(crate) fn with_slowness(self, slowness: Vec<f64>) -> Self {
        Self { slowness: Some(slowness), ..self }
    }

    /// All that is damped, with its index and `θ` in a step `h`.
    fn damped(&self, h: f64) -> impl Iterator<Item = (usize, Strained<'_>, f64)> {
        let theta = move |element: usize| match &self.slowness {
            Some(slowness) => lag(slowness[element], h),
            None => 0.0,
        };
        let all = self.elements.strained().enumerate();
        all.filter(|(_, own)| own.is_damped()).map(move |(k, own)| (k, own, theta(k)))
    }

    /// All that is damped.
    pub(crate) fn all_damped(&self) -> impl Iterator<Item = Strained<'_>> {
        self.elements.strained().filter(Strained::is_damped)
    }

    fn add_slot(&self, s: &Interval, of: Slot, out: &mut [f64]) {
        for (index, own, theta) in self.damped(s.h) {
            let n = resultants(&own.viscosity(), &own.change(s, index), theta, of);
            own.add_at(s, index, of, &n, out); // [6.23]
        }
    }
}

impl DiscreteForce for StrainDamping {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        self.add_slot(s, Slot::First, out);
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        self.add_slot(s, Slot::Second, out);
    }

    fn add_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        for (index, own, theta) in self.damped(s.h) {
            let c = -(0.5 - of.sign() * theta) * own.viscosity();
            let slope = by.sign() * c;
            if of == by {
                own.emit(s.node(of), &slope, &(c * own.change(s, index)), out);
            } else {
                own.emit_between(s, index, of, &slope, out);
            }
        }
    }

    /// Without `θ` the impulses do not depend on the step.
    fn add_step_slope(
        &self,
        _s: &Interval,
        _of: Slot,
        _change: StepChange,
        _out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        if self.slowness.is_none() { Ok(()) } else { Err(NoTimeSlope) }
    }

    fn add_time_slope(
        &self,
        _at: Motion<'_>,
        _scale: f64,
        _out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        Ok(())
    }

    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        self.add(at, 1.0, out);
    }

    /// `−Σ ℓ C_i τ_i Δε_i²/h`: that of `(f_d^- + f_d^+)·Δq/h` with `θ = 0`, whose chords `Δq`
    /// strain nothing.
    fn work(&self, s: &Interval, _scratch: &mut [f64]) -> f64 {
        let mut work = 0.0;
        for (index, own, _) in self.damped(s.h) {
            let change = own.change(s, index);
            work -= (own.viscosity() * change).dot(&change) / s.h;
        }
        work
    }

    fn add_stiffness(&self, _: Motion<'_>, _: f64, _: &mut dyn Entries) {}

    fn add_position_slope(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.add_position_derivative(at, scale, out);
    }

    fn add_damping(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.add_velocity_derivative(at, scale, out);
    }

    fn is_dissipative(&self) -> bool {
        true
    }

    fn interpolation(&self) -> Option<&dyn StrainInterpolation> {
        self.slowness.is_none().then_some(self)
    }
}

impl Force for StrainDamping {
    fn add(&self, Motion { q, v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        for own in self.all_damped() {
            let n = -scale * (own.viscosity() * own.strain_rate(q, v));
            own.add(q, &n, out);
        }
    }

    fn power(&self, Motion { q, v, .. }: Motion<'_>, _scratch: &mut [f64]) -> f64 {
        let mut power = 0.0;
        for own in self.all_damped() {
            let rate = own.strain_rate(q, v);
            power -= (own.viscosity() * rate).dot(&rate);
        }
        power
    }

    fn add_position_derivative(
        &self,
        Motion { q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        for own in self.all_damped() {
            let c = -scale * own.viscosity();
            let n = c * own.strain_rate(q, v);
            own.emit_rates([q, v], &c, &n, out);
        }
    }

    fn add_velocity_derivative(
        &self,
        Motion { q, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        for own in self.all_damped() {
            own.emit_outer(q, q, &(-scale * own.viscosity()), out);
        }
    }

    fn is_dissipative(&self) -> bool {
        true
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::elements::tests::{near_frames, random_elements, with_strains};
    use nalgebra::{DMatrix, DVector, Vector3};
    use vi_core::SparseMatrix;
    use vi_testkit::{Sample, slope_error};

    pub(crate) const N: usize = 36;

    /// Two damped two-node elements with helicoidal strains, whose triads differ little.
    fn damped_helix(sample: &mut Sample) -> (StrainDamping, Vec<f64>) {
        let (mut damping, _) = damped(sample);
        let q = near_frames(sample);
        damping.elements = with_strains(damping.elements, ElementKind::Helicoidal, &q);
        (damping, q)
    }

    /// Two damped elements on three random nodes.
    fn damped(sample: &mut Sample) -> (StrainDamping, Vec<f64>) {
        let (random, q) = random_elements(sample);
        let times: [f64; 6] = std::array::from_fn(|i| 0.01 * (i + 1) as f64);
        let section = random.section(&random.list()[0]).with_damping(times).unwrap();
        let mut elements = Elements::new();
        let section = elements.add_section(section);
        elements.add_stress_free([0, 1], 0.4, section, &q).unwrap();
        elements.add_stress_free([1, 2], 0.5, section, &q).unwrap();
        let damping = StrainDamping::new(&elements).unwrap();
        (damping.with_slowness(vec![0.02; 2]), q) // θ between 0 and ½ at h = 1
    }

    pub(crate) fn moved(q: &[f64], sample: &mut Sample) -> Vec<f64> {
        q.iter().map(|q| q + 0.3 * sample.number()).collect()
    }

    fn change(q: &[f64], i: usize, by: f64) -> Vec<f64> {
        let mut q = q.to_vec();
        q[i] += by;
        q
    }

    /// Largest difference of a matrix and the central difference of a vector function of `x`.
    pub(crate) fn difference(
        matrix: &SparseMatrix,
        x: &[f64],
        of: impl Fn(&[f64]) -> Vec<f64>,
    ) -> f64 {
        let (e, matrix, mut worst) = (1e-5, matrix.to_dense(), 0.0_f64);
        for j in 0..N {
            let (plus, minus) = (of(&change(x, j, e)), of(&change(x, j, -e)));
            for i in 0..N {
                let error = ((plus[i] - minus[i]) / (2.0 * e) - matrix[(i, j)]).abs();
                worst = if error.is_nan() { error } else { worst.max(error) };
            }
        }
        worst / matrix.amax()
    }

    /// What is added to zero.
    pub(crate) fn of(fill: &dyn Fn(&mut [f64])) -> Vec<f64> {
        let mut out = vec![0.0; N];
        fill(&mut out);
        out
    }

    #[test]
    fn derivatives_match_central_differences() {
        for helicoidal in [false, true] {
            let mut sample = Sample::new(41);
            let (damping, q0) = match helicoidal {
                true => damped_helix(&mut sample),
                false => damped(&mut sample),
            };
            let (mut q1, v) = (moved(&q0, &mut sample), moved(&q0, &mut sample));
            if helicoidal {
                q1.iter_mut().zip(&q0).for_each(|(q1, q0)| *q1 = q0 + (*q1 - q0) / 3.0); // ψ < π
            }
            let assemble = |emit: &dyn Fn(&mut dyn Entries)| SparseMatrix::assemble(N, N, emit);
            let s = Interval::between(0.0, 1.0, &q0, &q1);
            let by_ends = slope_error(&damping, &s);
            let matrix = assemble(&|out| {
                damping.add_position_derivative(Motion::new(0.0, &q0, &v), 1.0, out)
            });
            let by_q = difference(&matrix, &q0, |q| {
                of(&|out| damping.add(Motion::new(0.0, q, &v), 1.0, out))
            });
            let matrix = assemble(&|out| {
                damping.add_velocity_derivative(Motion::new(0.0, &q0, &v), 1.0, out)
            });
            let by_v = difference(&matrix, &v, |v| {
                of(&|out| damping.add(Motion::new(0.0, &q0, v), 1.0, out))
            });
            println!(
                "helicoidal {helicoidal}: off by {by_ends:.1e}, {by_q:.1e}, {by_v:.1e} (relative)"
            );
            assert!(by_ends < 1e-8 && by_q < 1e-8 && by_v < 1e-8);
        }
    }

    /// Force and moment about the origin of a generalized force in the configuration `q`.
    pub(crate) fn resultant(q: &[f64], f: &[f64]) -> f64 {
        let vectors = q.chunks_exact(3).zip(f.chunks_exact(3)).enumerate();
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for (k, (x, f)) in vectors {
            let [x, f] = [x, f].map(Vector3::from_column_slice);
            force += if k % 4 == 0 { f } else { Vector3::zeros() };
            moment += x.cross(&f);
        }
        force.amax() + moment.amax()
    }

    #[test]
    fn damping_changes_no_momentum_and_takes_energy() {
        let mut sample = Sample::new(42);
        // the chord strains quadratic strains exactly, others to second order
        let kinds: [(fn(&mut Sample) -> _, f64); 2] = [(damped, 1e-13), (damped_helix, 0.05)];
        for (of_kind, bound) in kinds {
            let (damping, q0) = of_kind(&mut sample);
            let q1: Vec<f64> = moved(&q0, &mut sample);
            let q1: Vec<f64> = q1.iter().zip(&q0).map(|(q1, q0)| q0 + (q1 - q0) / 3.0).collect();
            let s = Interval::between(0.0, 1.0, &q0, &q1);
            let (mut minus, mut plus, mut mid) = (vec![0.0; N], vec![0.0; N], vec![0.0; N]);
            damping.add_minus(&s, &mut minus);
            damping.add_plus(&s, &mut plus);
            damping.add(s.mid_motion(), 1.0, &mut mid);
            let parts = [(&q0, &minus), (&q1, &plus), (&s.q_mid, &mid)];
            let rest = parts.map(|(q, f)| resultant(q, f) / DVector::from_column_slice(f).norm());
            let power: f64 = mid.iter().zip(&s.v_mid).map(|(f, v)| f * v).sum();
            let mut dissipated = 0.0;
            for own in damping.all_damped() {
                let change = own.strain(&q1) - own.strain(&q0);
                dissipated += (own.viscosity() * change).dot(&change);
            }
            let relative = (power + dissipated).abs() / dissipated;
            println!("resultants {rest:?}, power off by {relative:.1e}");
            assert!(rest.iter().all(|r| *r < 1e-14) && relative < bound && dissipated > 0.0);
        }
    }

    #[test]
    fn an_unresolved_strain_dies_out_whatever_its_relaxation_time() {
        for (mu, theta, bound) in [(0.125, 0.5, 1.0), (0.0, 0.0, 1.0)] {
            for tau in [0.01, 0.1, 1.0, 10.0, 100.0, 1e4] {
                let lead = 0.25 + mu + (0.5 + theta) * tau;
                let middle = 0.5 - 2.0 * mu - 2.0 * theta * tau;
                let last = 0.25 + mu - (0.5 - theta) * tau;
                let companion =
                    DMatrix::from_row_slice(2, 2, &[-middle / lead, -last / lead, 1.0, 0.0]);
                let mut roots: Vec<f64> =
                    companion.complex_eigenvalues().iter().map(|z| z.norm()).collect();
                roots.sort_by(f64::total_cmp);
                // the slow root is exp(−h/τ) in the limit, the other one belongs to the mass
                println!(
                    "μ {mu}, τ/h {tau}: |z| = {roots:.3?}, exp(−h/τ) {:.3}",
                    (-1.0 / tau).exp()
                );
                assert!(roots[1] <= bound + 1e-12);
                if theta > 0.0 && tau >= 10.0 {
                    assert!(roots[0] < 4.0 / tau && (roots[1] - (-1.0 / tau).exp()).abs() < 0.02);
                }
            }
        }
    }
}
