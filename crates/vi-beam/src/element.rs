//! The two-node element: strains, forces, mass; [`crate::elements`] are many.
//!
//! ```text
//! V_e   = ½ ℓ εᵀ C ε
//! ∇V_e  = ℓ Σ_i (C ε)_i ∇ε_i
//! ∇²V_e = ℓ Σ_ij C_ij ∇ε_i ∇ε_jᵀ + ℓ Σ_i (C ε)_i ∇²ε_i
//! M_e   = ℓ [1/3 1/6; 1/6 1/3] ⊗ diag(Aρ, I_1ρ, I_2ρ, I_3ρ) ⊗ I_3         (lumped: ½, ½)
//! ```
//! [`StrainLaw`] says what `ε` and `C` are. Strains of mean directors are quadratic forms, `∇ε_i =
//! 𝔹_i x` and `∇²ε_i = 𝔹_i`; their limit: nodes rotated relative to each other by `θ` carry the
//! moment `EI sin θ cos θ/ℓ` at most, `EI/(2ℓ)` at 45°, and tension `N ℓ² > 4 EI` makes them
//! unstable. Helicoidal strains ([`crate::helicoidal`]) have neither limit.
//!
//! `M_e` is constant and, with `I_3ρ = 0`, singular; `PᵀMP` is not. The quadratic mass, of order 4,
//! belongs to the interpolation `φ = φ̄ + ξ Δφ + ½ (ξ² − ¼) ℓ Δd_3` with lumped directors:
//! ```text
//! T_e = ½ ℓ { Aρ (|φ̄̇|² + |Δφ̇|²/12 − (ℓ/6) φ̄̇·Δḋ_3 + (ℓ²/120) |Δḋ_3|²) + ½ Σ_I I_Iρ (|ḋ_I^a|² + |ḋ_I^b|²) }
//! ```
//!
//! Source: theory §6.
#![allow(non_snake_case)] // M, V

use crate::helicoidal::{self, Helicoidal};
use crate::mass_kind::MassKind;
use crate::products::{add_scalars, by_forms, weighted};
use crate::section::Section;
use crate::strain::{self, ElementCoordinates, SIZE, Strain};
use nalgebra::{Matrix6, SMatrix};
use std::sync::Arc;
use vi_core::Number;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;

/// An element that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ElementError {
    /// The length is not positive.
    #[error("element {element} has the length {length} m; it must be a positive finite number")]
    Length {
        /// Which element.
        element: usize,
        /// m.
        length: f64,
    },
    /// Both ends are the same node.
    #[error("both ends of element {element} are node {node}")]
    SameNode {
        /// Which element.
        element: usize,
        /// The node.
        node: usize,
    },
    /// Strains of order 4 cannot condense the stiffness of its section.
    #[error(
        "the stiffness of the section of element {element} is not positive definite together with \
         the bending within the element, or rigid in shear where strains of order 4 alone can be"
    )]
    Stiffness {
        /// Which element.
        element: usize,
    },
    /// The section does not exist.
    #[error("element {element} names section {section}, but there are {count}")]
    NoSection {
        /// Which element.
        element: usize,
        /// The section it names.
        section: usize,
        /// How many there are.
        count: usize,
    },
}

/// What an element measures of its nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum StrainLaw {
    /// Quadratic forms of mean directors ([`crate::strain`]).
    #[default]
    MeanDirectors,
    /// Of a helix between the nodes, with the stiffness that they condense ([`crate::helicoidal`]).
    Helicoidal(Arc<Helicoidal>),
}

impl StrainLaw {
    /// That of helicoidal strains.
    #[inline]
    pub(crate) fn helicoidal(&self) -> Option<&Helicoidal> {
        match self {
            Self::MeanDirectors => None,
            Self::Helicoidal(law) => Some(&**law),
        }
    }

    /// Which strains they are.
    #[must_use]
    pub fn kind(&self) -> ElementKind {
        match self {
            Self::MeanDirectors => ElementKind::MeanDirectors,
            Self::Helicoidal(law) if law.carries_tension_only() => ElementKind::Rope,
            Self::Helicoidal(law) if law.is_of_order_4() => ElementKind::Helicoidal,
            Self::Helicoidal(_) => ElementKind::SecondOrder,
        }
    }
}

/// `(Γ, K)` before those of the stress-free configuration are taken off; `law`: of helicoidal
/// strains, `None` of mean directors.
#[inline]
pub(crate) fn measures<T: Number>(
    law: Option<&Helicoidal<T>>,
    length: T,
    x: &ElementCoordinates<T>,
) -> Strain<T> {
    match law {
        None => strain::forms(x, length),
        Some(law) => law.helix(&helicoidal::forms(x, length)),
    }
}

/// `ε(x)` of an element with the measures `reference` where it is free of stress.
#[inline]
pub(crate) fn strain_at<T: Number>(
    law: Option<&Helicoidal<T>>,
    length: T,
    x: &ElementCoordinates<T>,
    reference: &Strain<T>,
) -> Strain<T> {
    match law {
        None => strain::forms(x, length) - reference,
        Some(law) => law.strain(&helicoidal::forms(x, length), reference),
    }
}

/// `C` without the entries of `ε_3`.
pub(crate) fn without_extension<T: Number>(C: &Matrix6<T>) -> Matrix6<T> {
    let mut own = *C;
    own.fill_row(2, T::of(0.0));
    own.fill_column(2, T::of(0.0));
    own
}

/// Two nodes, a reference length, a section, reference strains.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Frames `a` and `b`; their coordinates start at 12 times the index.
    pub nodes: [usize; 2],
    /// `ℓ`, reference arc length, m.
    pub length: f64,
    /// Index of the section.
    pub section: usize,
    /// `ε_0`: strains of the stress-free configuration.
    pub reference: Strain,
    /// How its mass is distributed.
    pub mass: MassKind,
    /// What its strains are.
    pub law: StrainLaw,
}

impl Element {
    /// `x`, from the coordinates of all frames.
    #[must_use]
    #[inline]
    pub fn coordinates(&self, q: &[f64]) -> ElementCoordinates {
        let [a, b] = self.starts();
        let (a, b) = (&q[a..a + 12], &q[b..b + 12]);
        let mut x = ElementCoordinates::zeros();
        x.as_mut_slice()[..12].copy_from_slice(a);
        x.as_mut_slice()[12..].copy_from_slice(b);
        x
    }

    /// Whether `φ` is interpolated with `d_3`.
    pub(crate) fn bends_within(&self) -> bool {
        self.mass == MassKind::Quadratic
    }

    /// `(Γ, K)` before those of the stress-free configuration are taken off.
    #[must_use]
    pub fn measures(&self, x: &ElementCoordinates) -> Strain {
        measures(self.law.helicoidal(), self.length, x)
    }

    /// `C`, with which stress resultants are `C ε`: that of its section, or condensed.
    pub(crate) fn stiffness<'a>(&'a self, section: &'a Section) -> &'a Matrix6<f64> {
        match &self.law {
            StrainLaw::MeanDirectors => section.stiffness_matrix(),
            StrainLaw::Helicoidal(law) => law.stiffness(),
        }
    }

    /// `C` at the strain `ε` for `C` of an element in tension: without the entries of `ε_3` where
    /// it carries tension only and is slack.
    #[must_use]
    pub fn carrying(&self, C: &Matrix6<f64>, strain: &Strain) -> Matrix6<f64> {
        if self.is_slack(strain) { without_extension(C) } else { *C }
    }

    /// Whether it carries no force along it where its nodes are closer than its stress-free length.
    #[must_use]
    pub fn carries_tension_only(&self) -> bool {
        matches!(&self.law, StrainLaw::Helicoidal(law) if law.carries_tension_only())
    }

    /// Whether it carries tension only and is slack.
    pub(crate) fn is_slack(&self, strain: &Strain) -> bool {
        strain[2] < 0.0 && self.carries_tension_only()
    }

    /// The mean stress resultants of an interval with the strains `ε_n`, `ε_{n+1}` at its ends, as
    /// far as they do the work of the energy, `σ·Δε = ½ Δ(εᵀC ε)`, and their derivative by
    /// `ε_{n+1}`.
    ///
    /// ```text
    /// σ = ½ C (ε_n + ε_{n+1})            tension only: ε_3 ↦ max(0, ε_3),  σ_3 ↦ σ_3 Δmax(0, ε_3)/Δε_3
    /// ```
    #[must_use]
    pub fn mean_stress(
        &self,
        C: &Matrix6<f64>,
        [start, end]: [&Strain; 2],
    ) -> (Strain, Matrix6<f64>) {
        if !(self.is_slack(start) || self.is_slack(end)) {
            return (0.5 * (C * (start + end)), 0.5 * C);
        }
        let carried = |strain: &Strain| {
            let mut own = *strain;
            own[2] = own[2].max(0.0);
            own
        };
        let (from, to) = (carried(start), carried(end));
        let (mut stress, mut slope) = (0.5 * (C * (from + to)), 0.5 * C);
        let taut = if end[2] > 0.0 { 1.0 } else { 0.0 };
        slope.column_mut(2).scale_mut(taut);
        let change = end[2] - start[2];
        let share = if change == 0.0 { 0.0 } else { (to[2] - from[2]) / change };
        slope.row_mut(2).scale_mut(share);
        if change != 0.0 {
            slope[(2, 2)] += stress[2] * (taut - share) / change;
        }
        stress[2] *= share;
        (stress, slope)
    }

    /// `V`, with which damping adds `V ε̇` to the stress resultants.
    pub(crate) fn viscosity(&self, section: &Section) -> Matrix6<f64> {
        match &self.law {
            StrainLaw::MeanDirectors => section.viscosity(),
            StrainLaw::Helicoidal(law) => *law.viscosity(),
        }
    }

    /// `ε(x)`.
    #[must_use]
    pub fn strain(&self, x: &ElementCoordinates) -> Strain {
        strain_at(self.law.helicoidal(), self.length, x, &self.reference)
    }

    /// `Σ n_i ∂̄ε_i`: the discrete gradient of the strains in an interval, `∂̄ε_i·Δx = Δε_i`.
    #[must_use]
    pub fn discrete_force(&self, s: &Interval, n: &Strain) -> ElementCoordinates {
        let middle = self.coordinates(&s.q_mid);
        match &self.law {
            StrainLaw::MeanDirectors => strain::gradients(&middle, self.length) * n,
            StrainLaw::Helicoidal(law) => {
                let [from, to] = self.ends(s).map(|x| helicoidal::forms(&x, self.length));
                let c = law.discrete_slopes([&from, &to], &self.reference).tr_mul(n);
                helicoidal::force(&middle.data.0[0], self.length, &c.transpose())
            }
        }
    }

    /// The derivative of [`Element::discrete_force`] by `x_{n+1}` where `n` changes by
    /// `Σ_j c_ij ∇ε_j`.
    #[must_use]
    pub fn discrete_tangent(
        &self,
        s: &Interval,
        c: &Matrix6<f64>,
        n: &Strain,
    ) -> SMatrix<f64, SIZE, SIZE> {
        let (middle, [start, end]) = (self.coordinates(&s.q_mid), self.ends(s));
        match &self.law {
            StrainLaw::MeanDirectors => {
                let gradients = |x: &ElementCoordinates| strain::gradients(x, self.length);
                let mut K = gradients(&middle) * weighted(&gradients(&end), c).transpose();
                add_scalars(&strain::weighted_matrix(&(0.5 * n), self.length), &mut K);
                K
            }
            StrainLaw::Helicoidal(law) => {
                let y = [&start, &end].map(|x| helicoidal::forms(x, self.length));
                let (slopes, bends) = law.discrete_derivatives([&y[0], &y[1]], &self.reference, n);
                let of_end = law.at(&y[1], &self.reference).slopes();
                let A = slopes.tr_mul(&(c * of_end)) + bends;
                by_forms([&middle, &end], self.length, &A, &(0.5 * slopes.tr_mul(n)))
            }
        }
    }

    /// `x` at both ends of a step.
    pub(crate) fn ends(&self, s: &Interval) -> [ElementCoordinates; 2] {
        [self.coordinates(&s.q0), self.coordinates(&s.q1)]
    }

    /// The first coordinates of both nodes among those of all frames.
    pub(crate) fn starts(&self) -> [usize; 2] {
        self.nodes.map(|node| 12 * node)
    }

    /// The coordinate among all frames that the component `row` of `x` is.
    #[must_use]
    pub fn place(&self, row: usize) -> usize {
        12 * self.nodes[row / 12] + row % 12
    }

    /// `out ← out + x` at the places of the element.
    pub fn scatter(&self, x: &ElementCoordinates, out: &mut [f64]) {
        for (k, node) in self.nodes.into_iter().enumerate() {
            let own = &mut out[12 * node..12 * node + 12];
            for (o, x) in own.iter_mut().zip(&x.as_slice()[12 * k..]) {
                *o += x;
            }
        }
    }

    /// Emits a dense 24×24 matrix at the places of the element.
    pub fn emit(&self, K: &SMatrix<f64, SIZE, SIZE>, out: &mut dyn Entries) {
        for j in 0..SIZE {
            let column = self.place(j);
            for i in 0..SIZE {
                out.add(self.place(i), column, K[(i, j)]);
            }
        }
    }
}

/// Which strains the elements of a beam have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
    /// Those of mean directors, of order 2; unstable in tension where `N ℓ² > 4 EI`.
    #[default]
    MeanDirectors,
    /// Helicoidal ones of order 4.
    Helicoidal,
    /// Helicoidal ones of order 2, for large moments of inertia of the section.
    SecondOrder,
    /// Helicoidal ones of ropes, which carry tension only.
    Rope,
}

impl ElementKind {
    /// Its name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MeanDirectors => "mean_directors",
            Self::Helicoidal => "helicoidal",
            Self::SecondOrder => "second_order",
            Self::Rope => "rope",
        }
    }

    /// The strains of an element of a length; `None` where a stiffness cannot be condensed.
    pub(crate) fn law(self, length: f64, section: &Section) -> Option<StrainLaw> {
        match self {
            Self::MeanDirectors if section.is_rigid_in_shear() => None,
            Self::MeanDirectors => Some(StrainLaw::MeanDirectors),
            _ => Some(StrainLaw::Helicoidal(Arc::new(self.helicoidal(length, section)?))),
        }
    }

    /// The same of those that are helicoidal, with the stiffness that they condense.
    pub(crate) fn helicoidal<T: Number>(
        self,
        length: T,
        section: &Section<T>,
    ) -> Option<Helicoidal<T>> {
        let law = match self {
            Self::MeanDirectors => return None,
            Self::SecondOrder if section.is_rigid_in_shear() => return None,
            Self::SecondOrder => Helicoidal::of_order_2(length, *section.stiffness_matrix()),
            Self::Helicoidal | Self::Rope => Helicoidal::of_order_4(length, &section.compliance())?,
        };
        let law = law.with_viscosity(&section.viscosity());
        Some(if self == Self::Rope { law.of_rope() } else { law })
    }
}
