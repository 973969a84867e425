//! A two-node element at the start of a step, where its strains and their gradients do not change
//! while the step is solved, and at the end of an iterate, where forces, the matrix and damping
//! have its strains in common.
//!
//! Those of helicoidal strains are computed once for a step, and once for an iterate
//! ([`vi_core::potential::DiscretePotential::derive`] and `derive_end`), of all elements in turn:
//! the long chains of operations of one overlap with those of the next. Forces of the elements
//! read what their potential keeps: both have the same elements in the same order. Strains of mean
//! directors cost less than their memory.

use crate::at_coordinates::{AtCoordinates, WRENCHES, emit_product, emit_reduced};
use crate::element::{Element, StrainLaw};
use crate::helicoidal::{self, FORMS, Forms, KeptForms, StrainSlopes};
use crate::small::product;
use crate::strain::{SIZE, STRAINS, Strain};
use nalgebra::Matrix6;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;

/// What an element keeps of the start of a step: `ε`, `x`, the columns of `∂ε/∂y` and `P_inᵀ ∇ε_i`.
pub(crate) const OF_START: usize = STRAINS + SIZE + STRAINS * FORMS + STRAINS * WRENCHES;

/// What an element keeps of the end of an iterate.
pub(crate) const OF_END: usize = size_of::<KeptForms>() / size_of::<f64>();

/// An element at `q_n`.
#[allow(clippy::large_enum_variant)] // for one evaluation, on the stack
pub(crate) enum AtStart<'a> {
    /// Of which nothing was kept.
    Here(AtCoordinates<'a>),
    /// What was kept.
    Kept {
        element: &'a Element,
        x: &'a [f64; SIZE],
        strain: Strain,
        slopes: &'a [[f64; STRAINS]], // by forms
        wrenches: &'a [[f64; WRENCHES]],
    },
}

impl Element {
    /// `out ←` what it keeps of the start of a step; nothing of mean directors.
    pub(crate) fn keep_start(&self, q: &[f64], out: &mut [f64]) {
        if let StrainLaw::Helicoidal(law) = &self.law {
            let coordinates = self.coordinates(q);
            let at = law.at(&helicoidal::forms(&coordinates, self.length), &self.reference);
            let own = at.slopes();
            let (strain, rest) = out.split_at_mut(STRAINS);
            let (x, rest) = rest.split_at_mut(SIZE);
            let (slopes, wrenches) = rest.split_at_mut(STRAINS * FORMS);
            strain.copy_from_slice(at.strain().as_slice());
            x.copy_from_slice(coordinates.as_slice());
            slopes.copy_from_slice(own.as_slice());
            let own = helicoidal::wrenches(&coordinates, self.length, &own);
            wrenches.copy_from_slice(own.as_slice());
        }
    }

    /// `out ←` what it keeps of the end of an iterate; nothing of mean directors.
    pub(crate) fn keep_end(&self, q: &[f64], out: &mut [f64]) {
        if let StrainLaw::Helicoidal(law) = &self.law {
            let y = helicoidal::forms(&self.coordinates(q), self.length);
            let kept = law.at(&y, &self.reference).keep();
            out.copy_from_slice(kept.as_flattened());
        }
    }

    /// Whether it keeps anything.
    pub(crate) fn keeps_ends(&self) -> bool {
        self.law != StrainLaw::MeanDirectors
    }

    /// It at the start of a step in which it is the element `index`.
    #[inline(always)]
    pub(crate) fn at_start<'a>(&'a self, s: &'a Interval, index: usize) -> AtStart<'a> {
        match self.kept(s, index) {
            None => AtStart::Here(self.within(&s.q0)),
            Some(kept) => {
                let (strain, rest) = kept.split_at(STRAINS);
                let Some((x, rest)) = rest.split_first_chunk() else {
                    return AtStart::Here(self.within(&s.q0));
                };
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

    /// It at the end of this step.
    #[inline]
    pub(crate) fn at_end<'a>(&'a self, s: &Interval, index: usize) -> AtCoordinates<'a> {
        match (&self.law, self.kept_end(s, index)) {
            (StrainLaw::Helicoidal(law), Some(kept)) => {
                let x = self.coordinates(&s.q1);
                AtCoordinates { element: self, x, forms: Some(law.kept(kept)) }
            }
            _ => self.within(&s.q1),
        }
    }

    /// `ε` at the start.
    pub(crate) fn start_strain(&self, s: &Interval, index: usize) -> Strain {
        match self.kept(s, index) {
            None => self.strain(&self.coordinates(&s.q0)),
            Some(kept) => Strain::from_column_slice(&kept[..STRAINS]),
        }
    }

    /// `ε` at the end.
    #[inline]
    pub(crate) fn end_strain(&self, s: &Interval, index: usize) -> Strain {
        match self.kept_end(s, index) {
            None => self.strain(&self.coordinates(&s.q1)),
            Some(kept) => helicoidal::kept_strain(kept),
        }
    }

    /// `ε` at both ends of this step.
    pub(crate) fn strains_of(&self, s: &Interval, index: usize) -> [Strain; 2] {
        [self.start_strain(s, index), self.end_strain(s, index)]
    }

    fn kept_end<'a>(&self, s: &'a Interval, index: usize) -> Option<&'a KeptForms> {
        s.derived_end().as_chunks().0.as_chunks().0.get(index).filter(|_| self.keeps_ends())
    }

    fn kept<'a>(&self, s: &'a Interval, index: usize) -> Option<&'a [f64]> {
        let kept = s.derived().get(OF_START * index..OF_START * (index + 1));
        kept.filter(|_| self.keeps_ends())
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
                let force = helicoidal::force(x, element.length, &by_forms.transpose());
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
                match end.wrenches_in(out, [x.as_slice(), end.x.as_slice()]) {
                    Some(end) => emit_reduced(element, &product(wrenches, c), &end, out),
                    None => {
                        let slopes = StrainSlopes::from_column_slice(slopes.as_flattened());
                        let start = helicoidal::force(x, element.length, &slopes);
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
    fn what_is_kept_of_the_ends_changes_nothing_but_rounding() {
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
            // what is kept of the end is what is computed
            s.derive_end(U_d.end_values(), |q, out| U_d.derive_end(q, out));
            assert_eq!(of_step(&U_d, &s), found, "{kind:?}");
            // nothing at the start is computed again
            s.q0.fill(f64::NAN);
            assert!(of_step(&U_d, &s).iter().all(|x| x.is_finite()), "{kind:?}");
        }
    }

    #[test]
    fn mean_directors_keep_nothing() {
        let elements = random_elements(&mut Sample::new(25)).0;
        let U_d = AveragedStrains::new(elements);
        assert_eq!([U_d.derived_values(), U_d.end_values()], [0; 2]);
    }
}
