//! The stiffness of an element with helicoidal strains: of order 2, condensed to order 4, of a
//! rope.
#![allow(non_snake_case)] // G, K, C, S, R

use crate::small::inverse;
use nalgebra::{Matrix2, Matrix3, Matrix6, Vector3};
use vi_core::Number;

/// The strains of an element of a length and a stiffness.
#[derive(Clone, Debug, PartialEq)]
pub struct Helicoidal<T = f64> {
    pub(super) length: T,                    // ℓ, m
    pub(super) stiffness: Matrix6<T>,        // C_r
    pub(super) viscosity: Matrix6<T>,        // V_r
    pub(super) order: Option<Correction<T>>, // None: order 2
    pub(super) rope: bool,
}

/// What order 4 needs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Correction<T> {
    compliance: Matrix6<T>,   // C⁻¹
    pub(super) S: Matrix3<T>, // of bending and twist in C⁻¹
    pub(super) R: Matrix2<T>, // from shear to that of bending
}

/// `e_3×n` as a matrix on `n`.
fn cross_3<T: Number>() -> Matrix3<T> {
    Vector3::z().cross_matrix()
}

/// `(ℓ²/12) XᵀSX`.
fn bending<T: Number>(length: T, S: &Matrix3<T>) -> Matrix3<T> {
    cross_3().tr_mul(&(S * cross_3())) * (length * length / T::of(12.0))
}

impl<T: Number> Helicoidal<T> {
    /// Strains of order 2, of an element of the length `ℓ` (m) with the stiffness `C`, symmetric
    /// and positive definite.
    #[must_use]
    pub fn of_order_2(length: T, C: Matrix6<T>) -> Self {
        let (viscosity, order, rope) = (Matrix6::zeros(), None, false);
        Self { length, stiffness: C, viscosity, order, rope }
    }

    /// Strains of order 4 from the compliance `C⁻¹`, whose shears may vanish; `None` where that is
    /// not positive definite with the flexibility of bending.
    #[must_use]
    pub fn of_order_4(length: T, compliance: &Matrix6<T>) -> Option<Self> {
        let S: Matrix3<T> = compliance.fixed_view::<3, 3>(3, 3).into();
        let bending = bending(length, &S);
        let mut reduced = *compliance;
        let mut shear = reduced.fixed_view_mut::<3, 3>(0, 0);
        shear += bending;
        let stiffness = inverse(&reduced, |own| Some(own.cholesky()?.inverse()))?;
        let R = bending.fixed_view::<2, 2>(0, 0) * stiffness.fixed_view::<2, 2>(0, 0);
        let order = Some(Correction { compliance: *compliance, S, R });
        let (viscosity, rope) = (Matrix6::zeros(), false);
        Some(Self { length, stiffness, viscosity, order, rope })
    }

    /// The same with the viscosity `V` of the section, symmetric and positive semi-definite; of
    /// first order in the rate it condenses as the stiffness does:
    /// `V_r = C_r (Y + (ℓ²/12) [XᵀY_mm X 0; 0 0]) C_r`, `Y = C⁻¹VC⁻¹`.
    #[must_use]
    pub fn with_viscosity(mut self, V: &Matrix6<T>) -> Self {
        self.viscosity = *V;
        if let Some(Correction { compliance, .. }) = &self.order {
            let mut Y = compliance * V * compliance;
            let bending = bending(self.length, &Y.fixed_view::<3, 3>(3, 3).into());
            let mut shear = Y.fixed_view_mut::<3, 3>(0, 0);
            shear += bending;
            self.viscosity = self.stiffness * Y * self.stiffness;
        }
        self
    }

    /// Those of a rope with the same stiffness.
    #[must_use]
    pub fn of_rope(self) -> Self {
        Self { order: None, rope: true, ..self }
    }

    /// Whether it carries no force along it where `η_3 < 0`.
    #[must_use]
    pub fn carries_tension_only(&self) -> bool {
        self.rope
    }

    /// The same in other numbers.
    pub(crate) fn map<S: Number>(&self, of: impl Fn(T) -> S + Copy) -> Helicoidal<S> {
        let order = self.order.as_ref().map(|own| Correction {
            compliance: own.compliance.map(of),
            S: own.S.map(of),
            R: own.R.map(of),
        });
        let [stiffness, viscosity] = [self.stiffness.map(of), self.viscosity.map(of)];
        Helicoidal { length: of(self.length), stiffness, viscosity, order, rope: self.rope }
    }

    /// `C_r`, with which stress resultants are `C_r η` and the energy is `½ ℓ ηᵀC_r η`.
    #[must_use]
    pub fn stiffness(&self) -> &Matrix6<T> {
        &self.stiffness
    }

    /// Whether the strains are corrected to order 4.
    #[must_use]
    pub fn is_of_order_4(&self) -> bool {
        self.order.is_some()
    }

    /// `V_r`, with which damping adds `V_r η̇` to the stress resultants.
    #[must_use]
    pub fn viscosity(&self) -> &Matrix6<T> {
        &self.viscosity
    }
}
