//! A two-node element at some coordinates: its strains, their gradients, its tangent.
#![allow(non_snake_case)] // K, A

use crate::element::{Element, StrainLaw};
use crate::helicoidal::{self, AtForms, FORMS};
use crate::products::{add_scalars, by_forms, weighted};
use crate::small::product;
use crate::strain::{self, ElementCoordinates, SIZE, STRAINS, Strain, StrainGradients};
use nalgebra::{Matrix6, SMatrix};
use vi_core::sparse::{Entries, OuterProduct};

/// An element at some coordinates, with what its strains and their gradients have in common.
#[derive(Clone, Debug)]
pub struct AtCoordinates<'a> {
    pub(crate) element: &'a Element,
    pub(crate) x: ElementCoordinates,
    pub(crate) forms: Option<AtForms<'a>>, // of helicoidal strains
}

impl Element {
    /// The element at some coordinates.
    #[must_use]
    #[inline]
    pub fn at(&self, x: ElementCoordinates) -> AtCoordinates<'_> {
        let forms = match &self.law {
            StrainLaw::MeanDirectors => None,
            StrainLaw::Helicoidal(law) => {
                Some(law.at(&helicoidal::forms(&x, self.length), &self.reference))
            }
        };
        AtCoordinates { element: self, x, forms }
    }

    /// The element in a configuration of all frames.
    #[must_use]
    #[inline]
    pub fn within(&self, q: &[f64]) -> AtCoordinates<'_> {
        self.at(self.coordinates(q))
    }
}

/// Columns `P_inᵀ ∇ε_i`, forces and torques of both nodes.
pub(crate) type StrainWrenches = SMatrix<f64, WRENCHES, STRAINS>;
/// Rows of these.
pub(crate) const WRENCHES: usize = 12;

/// Emits `A Bᵀ` at the places of an element.
pub(crate) fn emit_product(
    element: &Element,
    left: &StrainGradients,
    right: &StrainGradients,
    out: &mut dyn Entries,
) {
    let (starts, length) = (&element.starts(), 12);
    let (left, right) = (left.as_slice(), right.as_slice());
    out.add_outer(&OuterProduct { starts, length, left, right });
}

/// The same from `P_inᵀA` and `P_in'ᵀB`.
pub(crate) fn emit_reduced(
    element: &Element,
    left: &StrainWrenches,
    right: &StrainWrenches,
    out: &mut dyn Entries,
) {
    let (starts, length) = (&element.starts(), 6);
    let (left, right) = (left.as_slice(), right.as_slice());
    out.add_reduced(&OuterProduct { starts, length, left, right });
}

impl AtCoordinates<'_> {
    /// `ε`.
    #[must_use]
    pub fn strain(&self) -> Strain {
        match &self.forms {
            None => self.element.strain(&self.x),
            Some(at) => at.strain(),
        }
    }

    /// `Σ n_i ∇ε_i`.
    #[must_use]
    pub fn force(&self, n: &Strain) -> ElementCoordinates {
        match &self.forms {
            None => strain::force(&self.x, self.element.length, n),
            Some(at) => helicoidal::force(
                &self.x.data.0[0],
                self.element.length,
                &at.pull_back(n).transpose(),
            ),
        }
    }

    /// Columns `Σ_i c_ij ∇ε_i`.
    fn columns(&self, c: &Matrix6<f64>) -> StrainGradients {
        match &self.forms {
            None => weighted(&strain::gradients(&self.x, self.element.length), &c.transpose()),
            Some(_) => product(&self.gradients().data.0, c),
        }
    }

    /// Columns `∇ε_i`.
    #[must_use]
    pub fn gradients(&self) -> StrainGradients {
        match &self.forms {
            None => strain::gradients(&self.x, self.element.length),
            Some(at) => helicoidal::force(&self.x.data.0[0], self.element.length, &at.slopes()),
        }
    }

    /// `∇ε_i·v`.
    #[must_use]
    pub fn rate(&self, v: &ElementCoordinates) -> Strain {
        self.gradients().tr_mul(v)
    }

    /// Columns `∇²ε_i v`: how the gradients change with a velocity `v`.
    #[must_use]
    pub fn gradient_rates(&self, v: &ElementCoordinates) -> StrainGradients {
        let length = self.element.length;
        let Some(at) = &self.forms else { return strain::gradients(v, length) };
        let rates = helicoidal::gradients(&self.x, length).tr_mul(v);
        let mut bent = SMatrix::<f64, 6, FORMS>::zeros();
        for i in 0..6 {
            bent.set_row(i, &(at.bends(&Strain::ith(i, 1.0)) * rates).transpose());
        }
        helicoidal::force(&self.x.data.0[0], length, &bent)
            + helicoidal::force(&v.data.0[0], length, &at.slopes())
    }

    /// `Σ c_ij ∇ε_i ∇ε_jᵀ + Σ n_i ∇²ε_i`: material and geometric part of a tangent.
    #[must_use]
    pub fn tangent(&self, c: &Matrix6<f64>, n: &Strain) -> SMatrix<f64, SIZE, SIZE> {
        let Self { element, x, forms } = self;
        let Some(at) = forms else {
            let columns = self.gradients();
            let mut K = columns * weighted(&columns, c).transpose();
            add_scalars(&strain::weighted_matrix(n, element.length), &mut K);
            return K;
        };
        let slopes = at.slopes();
        let of_forms = slopes.tr_mul(&(c * slopes)) + at.bends(n);
        by_forms([x, x], element.length, &of_forms, &at.pull_back(n))
    }

    /// `Σ c_ij ∇ε_i (∇²ε_j v)ᵀ + Σ n_i ∇²ε_i`: the derivative of `Σ n_i ∇ε_i` with
    /// `n_i = Σ c_ij ∇ε_j·v`.
    #[must_use]
    pub fn tangent_of_rates(
        &self,
        v: &ElementCoordinates,
        c: &Matrix6<f64>,
        n: &Strain,
    ) -> SMatrix<f64, SIZE, SIZE> {
        let rates = weighted(&self.gradient_rates(v), c);
        self.tangent(&Matrix6::zeros(), n) + self.gradients() * rates.transpose()
    }

    /// `P_inᵀ ∇ε_i`, where `out` reduces both sides of an outer product at these coordinates of the
    /// element; `None` also of mean directors, whose gradients are mostly zero.
    pub(crate) fn wrenches_in(
        &self,
        out: &dyn Entries,
        sides: [&[f64]; 2],
    ) -> Option<StrainWrenches> {
        let at = self.forms.as_ref()?;
        let reduces = out.reduces_at(&self.element.starts(), sides);
        reduces.then(|| helicoidal::wrenches(&self.x, self.element.length, &at.slopes()))
    }

    /// Emits `Σ c_ij ∇ε_i ∇ε_jᵀ`, the second gradients those of `other`.
    pub fn emit_outer(&self, other: &Self, c: &Matrix6<f64>, out: &mut dyn Entries) {
        let sides = [self, other].map(|at| at.x.as_slice());
        let both = self.wrenches_in(out, sides).and_then(|own| {
            let same = std::ptr::eq(self, other);
            Some((own, if same { own } else { other.wrenches_in(out, sides)? }))
        });
        match both {
            Some((own, others)) => {
                emit_reduced(self.element, &product(&own.data.0, c), &others, out);
            }
            None => emit_product(self.element, &self.columns(c), &other.gradients(), out),
        }
    }

    /// Emits [`AtCoordinates::tangent`] at the places of the element.
    pub fn emit_tangent(&self, c: &Matrix6<f64>, n: &Strain, out: &mut dyn Entries) {
        self.element.emit(&self.tangent(c, n), out);
    }

    /// `out ← out + Σ n_i ∇ε_i` at the places of the element.
    pub fn scatter(&self, n: &Strain, out: &mut [f64]) {
        self.element.scatter(&self.force(n), out);
    }
}
