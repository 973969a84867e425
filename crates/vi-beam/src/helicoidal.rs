//! Helicoidal strains of the two-node element, corrected to order 4.
//!
//! ```text
//! y = (g, a, s):   g_I = d̄_I·φ',   a = ℓ K of the mean directors,   s = ⅛ Σ_I |d_I^b − d_I^a|² = sin²(ψ/2)
//! f = ψ/sin ψ = arcsin√s/√(s(1−s)),   b = (f − 1)/(4 s(1−s))
//! G = f g − b a (a·g),   K = f a/ℓ,   z = (G, K) − (G, K)_0                          order 2
//! C_r = (C⁻¹ + (ℓ²/12) [XᵀSX 0; 0 0])⁻¹,   X n = e_3×n,   S: lower right block of C⁻¹
//! m = (C_r z)_m,   w = S (K×m)
//! η_G = z_G − (ℓ²/12) w×e_3,   η_K = z_K + (ℓ²/24) K×w
//! η_3 += ρ − G_3 + q/10,   q = |γ_b|²,   ρ = √(G_3² + q),   γ_b = R (η_1, η_2)          order 4
//! ```
//! Between the nodes the frame is a helix of constant strain, `ψ` its angle: constant strain is
//! exact for any `ψ < π`. Order 4 adds the energy of the linear part of the moment, which a beam
//! without loads between its nodes has, `n' = −K×n`, `m' = −K×m − G×n`: its bending flexibility to
//! the shear compliances, and `γ_b`, the part of the shear that is bending, to the extension. All
//! are functions of quadratic forms of `x` that no rigid motion changes, and so are the strains.
//!
//! A rope has the strains of order 2 but for
//! ```text
//! η_3 = |G| + c (|G| − G_3) − G_3,0,   c = 2
//! ```
//! the stretch of its arc whatever the directions of the triads, which the tension alone ties to
//! the arc, with the stiffness `C_r` and no force along it where `η_3 < 0`. With `c` below 1 the
//! tension of a curved rope shortens its arcs by twisting them.
//!
//! Letters: `ψ` angle between the triads of both nodes, `n` here a vector; the others as in
//! [`crate::strain`].
//!
//! Source: theory §6.16; helicoidal interpolation: M. Borri, C. Bottasso, IJNME 37 (1994)
//! 2267–2289.
#![allow(non_snake_case)] // G, K, C, S, R

mod corrected;
mod discrete;
mod forms;
mod helix;
mod law;
mod rope;
#[cfg(test)]
mod tests;

pub use forms::{
    Bends, FORMS, Forms, StrainSlopes, force, forms, gradients, weighted_matrix, wrenches,
};
pub use law::Helicoidal;

pub(crate) use helix::{join, split};

use crate::small::product;
use crate::strain::Strain;
use corrected::Corrected;
use helix::Helix;
use law::Correction;
use nalgebra::{Matrix3, SVector, Vector3, Vector6};
use rope::Arc;
use vi_core::Number;

impl<T: Number> Helicoidal<T> {
    /// `(G, K)`: the strains of order 2 before those of the stress-free placement are taken off.
    #[must_use]
    pub fn helix(&self, y: &Forms<T>) -> Strain<T> {
        Helix::at(y, self.length).xi
    }

    /// `η` of [`Helicoidal::at`] alone.
    #[must_use]
    #[inline]
    pub fn strain(&self, y: &Forms<T>, reference: &Vector6<T>) -> Vector6<T> {
        self.at(y, reference).strain
    }

    /// The strains at `y` of an element that is stress-free with `(G, K)_0 = reference`, with all
    /// that their derivatives need.
    #[must_use]
    #[inline(always)] // what is not read is not computed
    pub fn at<'a>(&'a self, y: &Forms<T>, reference: &Vector6<T>) -> AtForms<'a, T> {
        let helix = Helix::at(y, self.length);
        let xi = helix.xi;
        let mut strain = xi - reference;
        let arc = self.rope.then(|| Arc::of(&xi));
        if let Some(arc) = &arc {
            strain[2] += arc.excess(&xi);
        }
        let mut corrected = None;
        if let Some(own) = &self.order {
            let (parts, eta) = Corrected::at(self, own, &xi, &strain);
            (corrected, strain) = (Some((own, parts)), eta);
        }
        AtForms { law: self, helix, strain, arc, corrected }
    }
}

fn halves(strain: &Strain) -> [[f64; 3]; 2] {
    let (first, last) = split(strain);
    [first.into(), last.into()]
}

impl Helicoidal {
    /// The triad half-way between the nodes with the forms `y`, from the mean of their triads,
    /// whose stretch is `cos(ψ/2)` across the axis of `ψ`.
    pub(crate) fn middle<T: Number>(mean: &Matrix3<T>, y: &SVector<T, FORMS>) -> Matrix3<T> {
        let one = T::of(1.0);
        let (a, c) = (Vector3::new(y[3], y[4], y[5]), (one - y[6]).sqrt());
        let across = a * a.transpose() / (T::of(4.0) * c * c * c * (one + c));
        mean * (Matrix3::identity() / c - across)
    }
}

/// The strains at some forms.
#[derive(Clone, Debug)]
pub struct AtForms<'a, T: Number = f64> {
    law: &'a Helicoidal<T>,
    helix: Helix<T>,
    strain: Vector6<T>, // η
    arc: Option<Arc<T>>,
    corrected: Option<(&'a Correction<T>, Corrected<T>)>,
}

impl<T: Number> AtForms<'_, T> {
    /// `η`.
    #[must_use]
    pub fn strain(&self) -> Vector6<T> {
        self.strain
    }

    /// `Σ n_i ∂η_i/∂(G, K)`.
    #[inline]
    pub(crate) fn on_helix(&self, n: &Vector6<T>) -> Vector6<T> {
        match (&self.arc, &self.corrected) {
            (Some(arc), _) => arc.on_helix(n),
            (None, Some((own, corrected))) => corrected.pull_back(own, self.law, n),
            (None, None) => *n,
        }
    }

    /// `∂(G, K)/∂y` times a change of `y`.
    pub(crate) fn helix_rate(&self, y: &Forms<T>) -> Strain<T> {
        self.helix.slopes(self.law.length) * y
    }

    /// `Σ ξ_i ∂(G, K)_i/∂y`.
    #[inline]
    pub(crate) fn by_helix(&self, xi: &Strain<T>) -> Forms<T> {
        self.helix.pull_back(xi, self.law.length)
    }

    /// `Σ n_i ∂η_i/∂y`.
    #[must_use]
    #[inline]
    pub fn pull_back(&self, n: &Strain<T>) -> Forms<T> {
        self.by_helix(&self.on_helix(n))
    }
}

/// The strains at some forms in numbers, with all that their derivatives need: three by three, with
/// zeros for what there is not.
pub(crate) type KeptForms = [[f64; 3]; 11];

/// `η` of these.
#[inline]
pub(crate) fn kept_strain(kept: &KeptForms) -> Strain {
    join(&kept[6].into(), &kept[7].into())
}

impl Helicoidal {
    /// The strains at some forms from what [`AtForms::keep`] gave.
    #[inline]
    pub(crate) fn kept(&self, kept: &KeptForms) -> AtForms<'_> {
        let [g, a, [s, k, f], [b, rho, _], G, K, _, _, m, w, [gamma_1, gamma_2, _]] = *kept;
        let xi = join(&G.into(), &K.into());
        let helix = Helix { g: g.into(), a: a.into(), s, k, f, b, xi };
        let gamma = [gamma_1, gamma_2].into();
        let parts = Corrected { K: K.into(), G_3: G[2], m: m.into(), w: w.into(), gamma, rho };
        let corrected = self.order.as_ref().map(|own| (own, parts));
        let arc = self.rope.then(|| Arc::of(&xi));
        AtForms { law: self, helix, strain: kept_strain(kept), arc, corrected }
    }
}

impl AtForms<'_> {
    /// These as numbers.
    #[inline]
    pub(crate) fn keep(&self) -> KeptForms {
        let Helix { g, a, s, k, f, b, xi } = self.helix;
        let ([G, K], [shear, bending]) = (halves(&xi), halves(&self.strain));
        let none = [0.0; 3];
        let (rho, [m, w, gamma]) = match self.corrected {
            None => (0.0, [none; 3]),
            Some((_, Corrected { m, w, gamma, rho, .. })) => {
                (rho, [m.into(), w.into(), [gamma[0], gamma[1], 0.0]])
            }
        };
        [g.into(), a.into(), [s, k, f], [b, rho, 0.0], G, K, shear, bending, m, w, gamma]
    }

    /// `∂η/∂y`.
    #[must_use]
    pub fn slopes(&self) -> StrainSlopes {
        let mut out = self.helix.slopes(self.law.length);
        if let Some(arc) = &self.arc {
            out.set_row(2, &arc.slope.tr_mul(&out.fixed_rows::<3>(0)));
        }
        match &self.corrected {
            Some((own, corrected)) => product(&corrected.slopes(own, self.law).1.data.0, &out),
            None => out,
        }
    }

    /// `Σ n_i ∂²η_i/∂y∂y`.
    #[must_use]
    pub fn bends(&self, n: &Strain) -> Bends {
        let length = self.law.length;
        let mut out = self.helix.bends(&self.on_helix(n), length);
        let of_helix = self.helix.slopes(length);
        if let Some(arc) = &self.arc {
            let of_G = of_helix.fixed_rows::<3>(0);
            out += of_G.tr_mul(&(n[2] * arc.bend() * of_G));
        }
        if let Some((own, corrected)) = &self.corrected {
            out += of_helix.tr_mul(&(corrected.bends(own, self.law, n) * of_helix));
        }
        out
    }
}
