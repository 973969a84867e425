//! A two-node element at the start of a step, where its strains and their gradients do not change
//! while the step is solved.
//!
//! Those of helicoidal strains are computed once for a step
//! ([`vi_core::potential::DiscretePotential::derive`]); those of mean directors cost less than
//! their memory.

use crate::at_coordinates::{AtCoordinates, WRENCHES, emit_product, emit_reduced};
use crate::element::{Element, StrainLaw};
use crate::helicoidal::{self, FORMS, Forms, Slopes};
use crate::small::product;
use crate::strain::{ElementCoordinates, SIZE, STRAINS, Strain};
use nalgebra::Matrix6;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;

/// What an element keeps of the start of a step: `ε`, `x`, the columns of `∂ε/∂y` and `P_inᵀ ∇ε_i`.
pub(crate) const OF_START: usize = STRAINS + SIZE + STRAINS * FORMS + STRAINS * WRENCHES;

/// An element at `q_n`.
#[allow(clippy::large_enum_variant)] // for one evaluation, on the stack
pub(crate) enum AtStart<'a> {
    /// Of which nothing was kept.
    Here(AtCoordinates<'a>),
    /// What was kept.
    Kept {
        element: &'a Element,
        x: &'a [f64], // 24
        strain: Strain,
        slopes: &'a [[f64; STRAINS]], // by forms
        wrenches: &'a [[f64; WRENCHES]],
    },
}

impl Element {
    /// `out ←` what it keeps of the start of a step; nothing of mean directors.
    pub(crate) fn keep_start(&self, q: &[f64], out: &mut [f64]) {
        let at = self.keeps_start().then(|| self.within(q));
        if let Some((at, forms)) = at.as_ref().and_then(|at| Some((at, at.forms.as_ref()?))) {
            let (strain, rest) = out.split_at_mut(STRAINS);
            let (x, rest) = rest.split_at_mut(SIZE);
            let (slopes, wrenches) = rest.split_at_mut(STRAINS * FORMS);
            let own = forms.slopes();
            strain.copy_from_slice(forms.strain().as_slice());
            x.copy_from_slice(at.x.as_slice());
            slopes.copy_from_slice(own.as_slice());
            let own = helicoidal::wrenches(&at.x, self.length, &own);
            wrenches.copy_from_slice(own.as_slice());
        }
    }

    /// Whether it keeps anything.
    pub(crate) fn keeps_start(&self) -> bool {
        self.law != StrainLaw::MeanDirectors
    }

    /// It at the start of a step in which it is the element `index`.
    #[inline(always)]
    pub(crate) fn at_start<'a>(&'a self, s: &'a Interval, index: usize) -> AtStart<'a> {
        match self.kept(s, index) {
            None => AtStart::Here(self.within(&s.q0)),
            Some(kept) => {
                let (strain, rest) = kept.split_at(STRAINS);
                let (x, rest) = rest.split_at(SIZE);
                let (slopes, wrenches) = rest.split_at(STRAINS * FORMS);
                AtStart::Kept {
                    element: self,
                    x,
                    strain: Strain::from_column_slice(strain),
                    slopes: slopes.as_chunks().0,
                    wrenches: wrenches.as_chunks().0,
                }
            }
        }
    }

    /// `ε` there.
    pub(crate) fn start_strain(&self, s: &Interval, index: usize) -> Strain {
        match self.kept(s, index) {
            None => self.strain(&self.coordinates(&s.q0)),
            Some(kept) => Strain::from_column_slice(&kept[..STRAINS]),
        }
    }

    /// `ε` at both ends of this step.
    pub(crate) fn strains_of(&self, s: &Interval, index: usize) -> [Strain; 2] {
        [self.start_strain(s, index), self.strain(&self.coordinates(&s.q1))]
    }

    fn kept<'a>(&self, s: &'a Interval, index: usize) -> Option<&'a [f64]> {
        let kept = s.derived().get(OF_START * index..OF_START * (index + 1));
        kept.filter(|_| self.keeps_start())
    }
}

impl AtStart<'_> {
    /// `ε`.
    pub(crate) fn strain(&self) -> Strain {
        match self {
            Self::Here(at) => at.strain(),
            Self::Kept { strain, .. } => *strain,
        }
    }

    /// `out ← out + Σ n_i ∇ε_i` at the places of the element.
    pub(crate) fn scatter(&self, n: &Strain, out: &mut [f64]) {
        match self {
            Self::Here(at) => at.scatter(n, out),
            Self::Kept { element, x, slopes, .. } => {
                let mut by_forms = Forms::zeros();
                for (own, slopes) in by_forms.iter_mut().zip(*slopes) {
                    *own = slopes.iter().zip(n.iter()).map(|(slope, n)| slope * n).sum();
                }
                let x = ElementCoordinates::from_column_slice(x);
                let force = helicoidal::force(&x, element.length, &by_forms.transpose());
                element.scatter(&force, out);
            }
        }
    }

    /// Emits `Σ c_ij ∇ε_i ∇ε_jᵀ`, the second gradients those at the end of the step.
    pub(crate) fn emit_outer(
        &self,
        end: &AtCoordinates<'_>,
        c: &Matrix6<f64>,
        out: &mut dyn Entries,
    ) {
        match self {
            Self::Here(at) => at.emit_outer(end, c, out),
            Self::Kept { element, x, slopes, wrenches, .. } => {
                match end.wrenches_in(out, [x, end.x.as_slice()]) {
                    Some(end) => emit_reduced(element, &product(wrenches, c), &end, out),
                    None => {
                        let (x, slopes) =
                            (ElementCoordinates::from_column_slice(x), slopes.as_flattened());
                        let slopes = Slopes::from_column_slice(slopes);
                        let start = helicoidal::force(&x, element.length, &slopes);
                        emit_product(element, &product(&start.data.0, c), &end.gradients(), out);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
#[allow(non_snake_case)] // U_d
mod tests {
    use crate::averaged::{AveragedStrains, MASS_SCALING};
    use crate::element::ElementKind;
    use crate::elements::tests::{near_frames, random_elements, with_strains};
    use nalgebra::DMatrix;
    use vi_core::interval::Interval;
    use vi_core::potential::DiscretePotential;
    use vi_testkit::Sample;

    /// All that a step asks of its potential.
    fn of_step(U_d: &AveragedStrains, s: &Interval) -> Vec<f64> {
        let mut out = vec![U_d.value(s), U_d.added_kinetic_energy(s)];
        let (mut d1, mut d2, mut mixed) = (vec![0.0; 36], vec![0.0; 36], DMatrix::zeros(36, 36));
        U_d.add_d1(s, 1.0, &mut d1);
        U_d.add_d2(s, 1.0, &mut d2);
        U_d.add_d2_d1(s, 1.0, &mut mixed);
        let mut internal = s.internal.clone();
        U_d.advance(s, &mut internal);
        out.extend(d1.iter().chain(&d2).chain(mixed.iter()).chain(&internal));
        out
    }

    #[test]
    fn what_is_kept_of_the_start_changes_nothing_but_rounding() {
        let mut sample = Sample::new(24);
        let kinds = [ElementKind::Helicoidal, ElementKind::SecondOrder, ElementKind::Rope];
        for kind in kinds {
            let (elements, q0) = (random_elements(&mut sample).0, near_frames(&mut sample));
            let elements = with_strains(elements, kind, &q0);
            let U_d = AveragedStrains::mass_scaled(elements, MASS_SCALING, vec![0.0, 1e-3])
                .with_following_tension_mass(&[]);
            let q0: Vec<f64> = q0.iter().map(|q| q + 0.05 * sample.number()).collect();
            let q1: Vec<f64> = q0.iter().map(|q| q + 0.05 * sample.number()).collect();
            let mut s = Interval::between(0.0, 0.1, &q0, &q1);
            s.internal.resize(U_d.internal_variables(), 0.0);
            U_d.begin(&q0, &mut s.internal);
            let expected = of_step(&U_d, &s);
            s.derive(U_d.derived_values(), |q, out| U_d.derive(q, out));
            let size = expected.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
            let found = of_step(&U_d, &s);
            let errors = found.iter().zip(&expected).map(|(a, b)| (a - b).abs() / size);
            let worst = errors.fold(0.0, |worst: f64, e| if e <= worst { worst } else { e });
            println!("{kind:?}: off by {worst:.1e}");
            assert!(worst < 1e-15, "{kind:?}: {worst:e}");
            // nothing at the start is computed again
            s.q0.fill(f64::NAN);
            assert!(of_step(&U_d, &s).iter().all(|x| x.is_finite()), "{kind:?}");
        }
    }

    #[test]
    fn mean_directors_keep_nothing() {
        let elements = random_elements(&mut Sample::new(25)).0;
        assert_eq!(AveragedStrains::new(elements).derived_values(), 0);
    }
}
