//! Cross-sections: stiffnesses and inertias per unit length.
//!
//! ```text
//! C  = diag(GA_1, GA_2, EA, EI_1, EI_2, GJ), or full         N, N·m, N·m²
//! m  = diag(Aρ, I_1ρ, I_2ρ, I_3ρ),   I_Iρ = ∫ ρ ξ_I² dA       kg/m, kg·m     Euler moments
//! I_Iρ = ½ tr J − J_I          from the section inertias J_I about the directors
//! ```
//! A full `C`, symmetric and positive definite, couples the strains `(Γ, K)` about the line of the
//! nodes: shear centre and tension centre off it, bending with twist. A full `m` is that between
//! `φ, d_1, d_2, d_3`: `m_1I = S_I = ∫ ρ ξ_I dA`, the first moments of a centre of mass off the
//! line.
//! Attention: `EI_1` is bending *about* `d_1`, which moves material along `d_2`; the homogeneous
//! section therefore has `I_2ρ = ρ EI_1/E`. `I_3ρ = 0` as a rule: `d_3` carries no mass.
//!
//! Source: theory §6. Shear factors: Cowper, J. Appl. Mech. 33 (1966) 335–340; torsion constant of
//! the rectangle: Timoshenko & Goodier, Theory of Elasticity, §109 (series).
#![allow(non_snake_case)] // E, G, A: the letters of the field

use nalgebra::{DMatrix, Matrix4, Matrix6, SMatrix};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A section no beam has.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SectionError {
    /// A value must be positive and finite.
    #[error("{what} of the cross-section is {value}; it must be a positive finite number")]
    NotPositive {
        /// Which value.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// A value must not be negative, and finite.
    #[error("{what} of the cross-section is {value}; it must be a finite number, not negative")]
    Negative {
        /// Which value.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// Poisson's ratio is outside `(−1, ½]`.
    #[error("Poisson's ratio is {0}; it must lie between -1 and 0.5")]
    Poisson(f64),
    /// The inner radius of a tube is not below the outer one.
    #[error("the inner radius of the tube, {inner} m, must be below the outer one, {outer} m")]
    Tube {
        /// m.
        inner: f64,
        /// m.
        outer: f64,
    },
    /// A matrix is not symmetric, or has entries that are no numbers.
    #[error(
        "the {what} matrix of the cross-section is not symmetric: entry ({row}, {column}) is \
         {}, entry ({column}, {row}) is {}", values[0], values[1]
    )]
    NotSymmetric {
        /// Which matrix.
        what: &'static str,
        /// From 1.
        row: usize,
        /// From 1.
        column: usize,
        /// The entry and the one across.
        values: [f64; 2],
    },
    /// A matrix has a negative eigenvalue, or a stiffness a zero one.
    #[error(
        "the {what} matrix of the cross-section is not positive definite: its smallest eigenvalue \
         is {least:e}"
    )]
    NotDefinite {
        /// Which matrix.
        what: &'static str,
        /// The smallest eigenvalue.
        least: f64,
    },
    /// One section inertia exceeds the sum of the two others.
    #[error("the section inertias {0:?} belong to no distribution of mass (J_a > J_b + J_c)")]
    Inertia([f64; 3]),
}

/// Stiffnesses and inertias of a cross-section, as the elements use them.
///
/// ```
/// use vi_beam::{Material, Profile, Stated};
///
/// // a steel rod of 10 mm radius: EA = E π r², shear stiffness and torsion constant from the shape
/// let steel = Material::from_poisson(2.1e11, 0.3, 7800.0)?;
/// let section = Profile::Circle { radius: 0.01 }.section(&steel, &Stated::default())?;
/// let [_, _, tension, ..] = section.stiffness();
/// assert!((tension / (2.1e11 * std::f64::consts::PI * 1e-4) - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    stiffness: Matrix6<f64>,
    mass: Matrix4<f64>,
    damping: [f64; 6],
}

const STIFFNESS_NAMES: [&str; 6] = ["GA1", "GA2", "EA", "EI1", "EI2", "GJ"];
const INERTIA_NAMES: [&str; 4] = ["rhoA", "rhoI1", "rhoI2", "rhoI3"];
const DAMPING_NAMES: [&str; 6] = [
    "relaxation time of GA1",
    "relaxation time of GA2",
    "relaxation time of EA",
    "relaxation time of EI1",
    "relaxation time of EI2",
    "relaxation time of GJ",
];

impl Section {
    /// From `(GA_1, GA_2, EA, EI_1, EI_2, GJ)` (N, N·m²) and `(Aρ, I_1ρ, I_2ρ, I_3ρ)` (kg/m, kg·m;
    /// Euler moments).
    ///
    /// # Errors
    /// [`SectionError::NotPositive`] for stiffnesses and `Aρ`, [`SectionError::Negative`] for
    /// `I_Iρ`.
    pub fn new(stiffness: [f64; 6], inertia: [f64; 4]) -> Result<Self, SectionError> {
        for (what, value) in STIFFNESS_NAMES.into_iter().zip(stiffness) {
            positive(what, value)?;
        }
        positive(INERTIA_NAMES[0], inertia[0])?;
        for (what, value) in INERTIA_NAMES.into_iter().zip(inertia).skip(1) {
            if !(value.is_finite() && value >= 0.0) {
                return Err(SectionError::Negative { what, value });
            }
        }
        let stiffness = Matrix6::from_diagonal(&stiffness.into());
        Ok(Self { stiffness, mass: Matrix4::from_diagonal(&inertia.into()), damping: [0.0; 6] })
    }

    /// From a full stiffness, in the order `(Γ_1, Γ_2, Γ_3, K_1, K_2, K_3)` about the line of the
    /// nodes (N, N·m, N·m²), and the mass per length between `φ, d_1, d_2, d_3` (kg/m, kg, kg·m).
    ///
    /// # Errors
    /// [`SectionError::NotSymmetric`], [`SectionError::NotDefinite`].
    pub fn general(stiffness: Matrix6<f64>, mass: Matrix4<f64>) -> Result<Self, SectionError> {
        let stiffness = symmetric("stiffness", &stiffness)?;
        if stiffness.cholesky().is_none() {
            return Err(SectionError::NotDefinite { what: "stiffness", least: least(&stiffness) });
        }
        let mass = symmetric("mass", &mass)?;
        positive(INERTIA_NAMES[0], mass[(0, 0)])?;
        let eigenvalue = least(&mass);
        if eigenvalue < -1e-12 * mass.amax() {
            return Err(SectionError::NotDefinite { what: "mass", least: eigenvalue });
        }
        Ok(Self { stiffness, mass, damping: [0.0; 6] })
    }

    /// The same with Kelvin–Voigt damping: relaxation times `τ_i` (s) of shear along `d_1` and
    /// `d_2`, extension, bending about `d_1` and `d_2`, twist. The viscosity is `C_i τ_i`.
    ///
    /// # Errors
    /// [`SectionError::Negative`].
    pub fn with_damping(self, times: [f64; 6]) -> Result<Self, SectionError> {
        for (what, value) in DAMPING_NAMES.into_iter().zip(times) {
            if !(value.is_finite() && value >= 0.0) {
                return Err(SectionError::Negative { what, value });
            }
        }
        Ok(Self { damping: times, ..self })
    }

    /// `I_Iρ = ½ tr J − J_I` from section inertias `J_I` about the directors, kg·m.
    ///
    /// # Errors
    /// [`SectionError::Inertia`] when one of them exceeds the sum of the two others.
    pub fn euler_moments(J: [f64; 3]) -> Result<[f64; 3], SectionError> {
        let half = 0.5 * J.iter().sum::<f64>();
        let slack = 1e-12 * half;
        let moments = J.map(|J| half - J);
        if moments.iter().any(|E| E.is_nan() || *E < -slack) {
            return Err(SectionError::Inertia(J));
        }
        Ok(moments.map(|E| if E.abs() <= slack { 0.0 } else { E }))
    }

    /// `(GA_1, GA_2, EA, EI_1, EI_2, GJ)`, the diagonal of `C`.
    #[must_use]
    pub fn stiffness(&self) -> [f64; 6] {
        self.stiffness.diagonal().into()
    }

    /// Relaxation times `τ_i` in the order of [`Section::stiffness`], s; zeros without damping.
    #[must_use]
    pub fn damping(&self) -> &[f64; 6] {
        &self.damping
    }

    /// Whether any strain is damped.
    #[must_use]
    pub fn is_damped(&self) -> bool {
        self.damping.iter().any(|time| *time > 0.0)
    }

    /// `C`, the same as a matrix.
    #[must_use]
    pub fn stiffness_matrix(&self) -> Matrix6<f64> {
        self.stiffness
    }

    /// `V`: `C_i τ_i`, N·s and N·m²·s; between strains of unlike times `C_ij √(τ_i τ_j)`.
    pub(crate) fn viscosity(&self) -> Matrix6<f64> {
        let time = |i: usize, j: usize| match i == j {
            true => self.damping[i],
            false => (self.damping[i] * self.damping[j]).sqrt(),
        };
        Matrix6::from_fn(|i, j| self.stiffness[(i, j)] * time(i, j))
    }

    /// `(Aρ, I_1ρ, I_2ρ, I_3ρ)`: mass per length of `φ, d_1, d_2, d_3`, the diagonal of `m`.
    #[must_use]
    pub fn inertia(&self) -> [f64; 4] {
        self.mass.diagonal().into()
    }

    /// `m`, the mass per length between `φ, d_1, d_2, d_3`.
    #[must_use]
    pub fn mass_matrix(&self) -> Matrix4<f64> {
        self.mass
    }
}

/// The smallest eigenvalue of a symmetric matrix.
fn least<const N: usize>(m: &SMatrix<f64, N, N>) -> f64 {
    let all = DMatrix::from_column_slice(N, N, m.as_slice()).symmetric_eigenvalues();
    all.min()
}

/// The mean of a matrix and its transpose, where they differ by rounding only.
fn symmetric<const N: usize>(
    what: &'static str,
    m: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>, SectionError> {
    const TOLERANCE: f64 = 1e-6;
    for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
        let size = (m[(i, i)] * m[(j, j)]).abs().sqrt();
        let off = (m[(i, j)] - m[(j, i)]).abs();
        if !(off <= TOLERANCE * size && m[(i, j)].is_finite()) {
            let values = [m[(i, j)], m[(j, i)]];
            return Err(SectionError::NotSymmetric { what, row: i + 1, column: j + 1, values });
        }
    }
    Ok(0.5 * (m + m.transpose()))
}

fn positive(what: &'static str, value: f64) -> Result<(), SectionError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(SectionError::NotPositive { what, value })
    }
}

/// An isotropic material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// `E`, Pa.
    pub young: f64,
    /// `G`, Pa.
    pub shear: f64,
    /// `ρ`, kg/m³.
    pub density: f64,
}

impl Material {
    /// `G = E / (2(1 + ν))`.
    ///
    /// # Errors
    /// [`SectionError::Poisson`].
    pub fn from_poisson(young: f64, nu: f64, density: f64) -> Result<Self, SectionError> {
        if !(nu > -1.0 && nu <= 0.5) {
            return Err(SectionError::Poisson(nu));
        }
        Ok(Self { young, shear: young / (2.0 * (1.0 + nu)), density })
    }

    /// `ν = E/(2G) − 1`.
    #[must_use]
    pub fn poisson(&self) -> f64 {
        self.young / (2.0 * self.shear) - 1.0
    }
}

/// Shape of a homogeneous cross-section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub enum Profile {
    /// A rectangle.
    Rectangle {
        /// Extent along `d_1`, m.
        width: f64,
        /// Extent along `d_2`, m.
        height: f64,
    },
    /// A full circle.
    Circle {
        /// m.
        radius: f64,
    },
    /// A circular tube.
    Tube {
        /// m.
        outer: f64,
        /// m.
        inner: f64,
    },
    /// Anything, by its numbers.
    General {
        /// `A`, m².
        area: f64,
        /// `I_1 = ∫ ξ_2² dA`, bending about `d_1`, m⁴.
        second_moment_1: f64,
        /// `I_2 = ∫ ξ_1² dA`, bending about `d_2`, m⁴.
        second_moment_2: f64,
        /// `J_t`, m⁴.
        torsion_constant: f64,
    },
}

/// What of a profile may be stated instead of computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stated {
    /// Shear factors `(k_1, k_2)`; without: Cowper's.
    pub shear_factors: Option<[f64; 2]>,
    /// Torsion constant `J_t`, m⁴; without: Saint-Venant's.
    pub torsion_constant: Option<f64>,
}

impl Profile {
    /// The section of a homogeneous profile:
    /// `(k_1GA, k_2GA, EA, EI_1, EI_2, GJ_t)`, `ρ(A, I_2, I_1, 0)`.
    ///
    /// # Errors
    /// [`SectionError`].
    pub fn section(&self, material: &Material, stated: &Stated) -> Result<Section, SectionError> {
        self.validate()?;
        let Material { young: E, shear: G, density: rho } = *material;
        for (what, value) in [("Young's modulus", E), ("the shear modulus", G), ("density", rho)] {
            positive(what, value)?;
        }
        let (A, [I1, I2]) = (self.area(), self.second_moments());
        let Jt = stated.torsion_constant.unwrap_or_else(|| self.torsion_constant());
        let k = stated.shear_factors.unwrap_or_else(|| self.shear_factors(material.poisson()));
        Section::new(
            [k[0] * G * A, k[1] * G * A, E * A, E * I1, E * I2, G * Jt],
            [rho * A, rho * I2, rho * I1, 0.0],
        )
    }

    fn validate(&self) -> Result<(), SectionError> {
        match *self {
            Self::Rectangle { width, height } => {
                positive("width", width)?;
                positive("height", height)
            }
            Self::Circle { radius } => positive("radius", radius),
            Self::Tube { outer, inner } => {
                positive("outer radius", outer)?;
                positive("inner radius", inner)?;
                if inner < outer { Ok(()) } else { Err(SectionError::Tube { inner, outer }) }
            }
            Self::General { area, second_moment_1, second_moment_2, torsion_constant } => {
                positive("area", area)?;
                positive("second moment 1", second_moment_1)?;
                positive("second moment 2", second_moment_2)?;
                positive("torsion constant", torsion_constant)
            }
        }
    }

    /// `A`, m².
    #[must_use]
    pub fn area(&self) -> f64 {
        match *self {
            Self::Rectangle { width, height } => width * height,
            Self::Circle { radius } => PI * radius * radius,
            Self::Tube { outer, inner } => PI * (outer * outer - inner * inner),
            Self::General { area, .. } => area,
        }
    }

    /// `(I_1, I_2) = (∫ ξ_2² dA, ∫ ξ_1² dA)`, m⁴.
    #[must_use]
    pub fn second_moments(&self) -> [f64; 2] {
        match *self {
            Self::Rectangle { width: b, height: h } => [b * h.powi(3) / 12.0, h * b.powi(3) / 12.0],
            Self::Circle { radius } => [0.25 * PI * radius.powi(4); 2],
            Self::Tube { outer, inner } => [0.25 * PI * (outer.powi(4) - inner.powi(4)); 2],
            Self::General { second_moment_1, second_moment_2, .. } => {
                [second_moment_1, second_moment_2]
            }
        }
    }

    /// Saint-Venant's torsion constant, m⁴.
    #[must_use]
    pub fn torsion_constant(&self) -> f64 {
        match *self {
            Self::Rectangle { width, height } => rectangle_torsion(width, height),
            Self::General { torsion_constant, .. } => torsion_constant,
            _ => self.second_moments().iter().sum(),
        }
    }

    /// Cowper's shear factors; 1 for general profiles.
    #[must_use]
    pub fn shear_factors(&self, nu: f64) -> [f64; 2] {
        let k = match *self {
            Self::Rectangle { .. } => 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu),
            Self::Circle { .. } => 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu),
            Self::Tube { outer, inner } => {
                let m2 = (inner / outer).powi(2);
                let square = (1.0 + m2).powi(2);
                6.0 * (1.0 + nu) * square / ((7.0 + 6.0 * nu) * square + (20.0 + 12.0 * nu) * m2)
            }
            Self::General { .. } => 1.0,
        };
        [k; 2]
    }
}

/// `a b³ [1/3 − (64/π⁵)(b/a) Σ_{k odd} tanh(kπa/2b)/k⁵]` with `a ≥ b`.
fn rectangle_torsion(width: f64, height: f64) -> f64 {
    let (a, b) = (width.max(height), width.min(height));
    let term = |k: f64| libm::tanh(0.5 * k * PI * a / b) / k.powi(5);
    let sum: f64 = (0..200).rev().map(|i| term(f64::from(2 * i + 1))).sum();
    a * b.powi(3) * (1.0 / 3.0 - 64.0 / PI.powi(5) * (b / a) * sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a / b - 1.0).abs() < tolerance, "{a} against {b}");
    }

    #[test]
    fn a_rectangle_bends_about_the_right_axis() {
        let material = Material::from_poisson(2.1e11, 0.3, 7850.0).unwrap();
        let strip = Profile::Rectangle { width: 0.02, height: 0.005 };
        let section = strip.section(&material, &Stated::default()).unwrap();
        let [_, _, EA, EI1, EI2, _] = section.stiffness();
        close(EA, 2.1e11 * 1e-4, 1e-14);
        assert!(EI1 < EI2, "thin along d_2: soft about d_1");
        close(EI2 / EI1, 16.0, 1e-13);
        let [_, I1, I2, I3] = section.inertia();
        close(I2, 7850.0 * EI1 / 2.1e11, 1e-14); // I_2ρ = ρ EI_1/E
        close(I1, 7850.0 * EI2 / 2.1e11, 1e-14);
        assert!(I3 == 0.0);
    }

    #[test]
    fn tables_of_constants() {
        // Timoshenko & Goodier, §109: k_1 for a/b = 1, 2, 10
        for (ratio, factor) in [(1.0, 0.1406), (2.0, 0.229), (10.0, 0.312)] {
            close(rectangle_torsion(ratio, 1.0) / ratio, factor, 2e-3);
        }
        let circle = Profile::Circle { radius: 0.1 };
        let tube = Profile::Tube { outer: 0.1, inner: 1e-9 };
        close(circle.shear_factors(0.3)[0], 0.886, 1e-3);
        close(tube.shear_factors(0.3)[1], circle.shear_factors(0.3)[1], 1e-12);
        close(tube.torsion_constant(), 0.5 * PI * 1e-4, 1e-12);
        let moments = Section::euler_moments([10.0, 10.0, 20.0]).unwrap();
        assert_eq!(moments, [10.0, 10.0, 0.0]);
        let stated = Stated { shear_factors: Some([1.0; 2]), torsion_constant: Some(2e-9) };
        let material = Material { young: 3.0, shear: 2.0, density: 1.0 };
        let section = circle.section(&material, &stated).unwrap();
        close(section.stiffness()[5], 4e-9, 1e-15);
        close(section.stiffness()[0], 2.0 * circle.area(), 1e-15);
    }

    #[test]
    fn impossible_sections_are_refused() {
        let message = Section::new([1.0, 1.0, -2.0, 1.0, 1.0, 1.0], [1.0; 4]).unwrap_err();
        let expected = "EA of the cross-section is -2; it must be a positive finite number";
        assert_eq!(message.to_string(), expected);
        assert!(Section::euler_moments([1.0, 1.0, 3.0]).is_err());
        assert!(Material::from_poisson(1.0, 0.7, 1.0).is_err());
        let material = Material { young: 3.0, shear: 2.0, density: 1.0 };
        let tube = Profile::Tube { outer: 0.1, inner: 0.2 };
        let refused = tube.section(&material, &Stated::default()).unwrap_err().to_string();
        assert!(refused.contains("0.2 m"), "{refused}");
        let strange = Section::new([1.0; 6], [1.0, f64::NAN, 0.0, 0.0]);
        assert!(matches!(strange, Err(SectionError::Negative { what: "rhoI1", .. })));
    }
}
