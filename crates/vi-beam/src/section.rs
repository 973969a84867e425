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
//! ```text
//! C = AᵀC_0A,   Γ_1 − y_s K_3,   Γ_2 + x_s K_3,   Γ_3 + y_t K_1 − x_t K_2      strains at both centres   [6.39]
//! m_IJ ↦ m_IJ + Aρ c_I c_J,   m_1I = Aρ c_I                                    centre of mass c          [6.40]
//! C⁻¹ = Σ_g w_g C_g⁻¹,   Y = Σ_g w_g C_g⁻¹V_gC_g⁻¹,   V = C Y C                along an element          [6.41]
//! ```
//! Without shear (Euler and Bernoulli) the shear rows of `C⁻¹` vanish; `C` then holds zeros there,
//! and only elements of order 4 take it, which need `C⁻¹` alone.
//!
//! Attention: `EI_1` is bending *about* `d_1`, which moves material along `d_2`; the homogeneous
//! section therefore has `I_2ρ = ρ EI_1/E`. `I_3ρ = 0` as a rule: `d_3` carries no mass.
//!
//! Source: theory §6. Shapes: [`crate::profile`].
#![allow(non_snake_case)] // E, G, A, C, V: the letters of the field

use crate::small::{inverse, re, times};
use nalgebra::{DMatrix, Matrix2, Matrix3, Matrix4, Matrix6, SMatrix};
use vi_core::Number;

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
    /// Walls do not fit into the outline.
    #[error("walls of {thickness} m do not fit into {size} m")]
    Walls {
        /// Of both walls together, m.
        thickness: f64,
        /// m.
        size: f64,
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
    /// A stiffness has an eigenvalue that is not positive, a damping a negative one.
    #[error(
        "the {what} matrix of the cross-section is not positive definite: {motion} has {} energy",
        if *least < 0.0 { "negative" } else { "no" }
    )]
    NotDefinite {
        /// Which matrix.
        what: &'static str,
        /// The strains of the eigenvector, in words.
        motion: String,
        /// The smallest eigenvalue of the matrix with its diagonal scaled to 1.
        least: f64,
    },
    /// A mass has no distribution: its centre lies beyond its own radius of gyration.
    #[error(
        "no distribution of mass has this mass matrix: about its centre of mass, at ({:.4}, {:.4}) \
         m, its inertia is negative", center[0], center[1]
    )]
    Mass {
        /// Along `d_1` and `d_2`, m.
        center: [f64; 2],
    },
    /// An entry of a 6×6 mass does not fit the others.
    #[error(
        "entry ({row}, {column}) of the mass matrix of the cross-section is {value}; with the \
         others it must be {expected}"
    )]
    MassEntry {
        /// From 1.
        row: usize,
        /// From 1.
        column: usize,
        /// The entry.
        value: f64,
        /// What fits.
        expected: f64,
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
pub struct Section<T = f64> {
    stiffness: Matrix6<T>,
    compliance: Matrix6<T>,
    viscosity: Matrix6<T>,
    mass: Matrix4<T>,
    shear: Shear,
}

/// Whether a section shears.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shear {
    Soft,
    Rigid,
}

/// Where the centres of a section are along `d_1` and `d_2`, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Centers {
    /// Where a tension makes no curvature.
    pub tension: [f64; 2],
    /// Where shear forces make no twist.
    pub shear: [f64; 2],
    /// Of the mass.
    pub mass: [f64; 2],
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
/// What the strains are in words.
const STRAIN_NAMES: [&str; 6] = [
    "shear along d_1",
    "shear along d_2",
    "extension",
    "bending about d_1",
    "bending about d_2",
    "twist",
];

impl<T: Number> Section<T> {
    /// From `(GA_1, GA_2, EA, EI_1, EI_2, GJ)` (N, N·m²) and `(Aρ, I_1ρ, I_2ρ, I_3ρ)` (kg/m, kg·m;
    /// Euler moments).
    ///
    /// # Errors
    /// [`SectionError::NotPositive`] for stiffnesses and `Aρ`, [`SectionError::Negative`] for
    /// `I_Iρ`.
    pub fn new(stiffness: [T; 6], inertia: [T; 4]) -> Result<Self, SectionError> {
        for (what, value) in STIFFNESS_NAMES.into_iter().zip(stiffness) {
            positive(what, re(value))?;
        }
        let mass = Matrix4::from_diagonal(&euler(inertia)?.into());
        Ok(Self::of_soft(Matrix6::from_diagonal(&stiffness.into()), mass))
    }

    /// Without shear: from `(EA, EI_1, EI_2, GJ)` and the inertias of [`Section::new`].
    ///
    /// # Errors
    /// As [`Section::new`].
    pub fn rigid_in_shear(stiffness: [T; 4], inertia: [T; 4]) -> Result<Self, SectionError> {
        for (what, value) in STIFFNESS_NAMES.into_iter().skip(2).zip(stiffness) {
            positive(what, re(value))?;
        }
        let mass = Matrix4::from_diagonal(&euler(inertia)?.into());
        let [a, b, c, d] = stiffness;
        let diagonal = |of: [T; 4]| {
            let [a, b, c, d] = of;
            Matrix6::from_diagonal(&[T::of(0.0), T::of(0.0), a, b, c, d].into())
        };
        Ok(Self {
            stiffness: diagonal([a, b, c, d]),
            compliance: diagonal([a, b, c, d].map(|own| T::of(1.0) / own)),
            viscosity: Matrix6::zeros(),
            mass,
            shear: Shear::Rigid,
        })
    }

    /// From a full stiffness, in the order `(Γ_1, Γ_2, Γ_3, K_1, K_2, K_3)` about the line of the
    /// nodes (N, N·m, N·m²), and the mass per length between `φ, d_1, d_2, d_3` (kg/m, kg, kg·m).
    ///
    /// # Errors
    /// [`SectionError::NotSymmetric`], [`SectionError::NotDefinite`], [`SectionError::Mass`].
    pub fn general(stiffness: Matrix6<T>, mass: Matrix4<T>) -> Result<Self, SectionError> {
        let stiffness = symmetric("stiffness", &stiffness)?;
        definite("stiffness", &real(&stiffness))?;
        Self::of_soft(stiffness, mass).with_mass(mass)
    }

    /// The same with another mass per length between `φ, d_1, d_2, d_3`, kg/m, kg, kg·m.
    ///
    /// # Errors
    /// [`SectionError::NotSymmetric`], [`SectionError::NotPositive`], [`SectionError::Mass`].
    pub fn with_mass(self, mass: Matrix4<T>) -> Result<Self, SectionError> {
        let mass = symmetric("mass", &mass)?;
        positive(INERTIA_NAMES[0], re(mass[(0, 0)]))?;
        possible(&real(&mass))?;
        Ok(Self { mass, ..self })
    }

    fn of_soft(stiffness: Matrix6<T>, mass: Matrix4<T>) -> Self {
        let compliance = inverse(&stiffness, |own| own.try_inverse());
        let compliance = compliance.expect("a positive definite matrix has an inverse");
        let (viscosity, shear) = (Matrix6::zeros(), Shear::Soft);
        Self { stiffness, compliance, viscosity, mass, shear }
    }

    /// The same with Kelvin–Voigt damping: relaxation times `τ_i` (s) of shear along `d_1` and
    /// `d_2`, extension, bending about `d_1` and `d_2`, twist. The viscosity is `C_i τ_i`, between
    /// strains of unlike times `C_ij √(τ_i τ_j)`.
    ///
    /// # Errors
    /// [`SectionError::Negative`].
    pub fn with_damping(self, times: [T; 6]) -> Result<Self, SectionError> {
        for (what, value) in DAMPING_NAMES.into_iter().zip(times) {
            not_negative(what, re(value))?;
        }
        let time = |i: usize, j: usize| match i == j {
            true => times[i],
            false => (times[i] * times[j]).sqrt(),
        };
        let viscosity = Matrix6::from_fn(|i, j| match self.stiffness[(i, j)] {
            apart if apart.vanishes() => T::of(0.0),
            own => own * time(i, j),
        });
        Ok(Self { viscosity, ..self })
    }

    /// The same with a full viscosity `V`, in the order of [`Section::general`], N·s, N·m·s,
    /// N·m²·s.
    ///
    /// # Errors
    /// [`SectionError::NotSymmetric`], [`SectionError::NotDefinite`] when it has a negative
    /// eigenvalue.
    pub fn with_viscosity(self, V: Matrix6<T>) -> Result<Self, SectionError> {
        let viscosity = symmetric("damping", &V)?;
        semidefinite("damping", &real(&viscosity))?;
        Ok(Self { viscosity, ..self })
    }

    /// The same section turned by an angle (rad) about `d_3`, from `d_1` to `d_2`.
    #[must_use]
    pub fn turned(self, angle: T) -> Self {
        let R = about_3(angle);
        let mut T = Matrix6::zeros();
        T.fixed_view_mut::<3, 3>(0, 0).copy_from(&R);
        T.fixed_view_mut::<3, 3>(3, 3).copy_from(&R);
        let mut U = Matrix4::identity();
        U.fixed_view_mut::<3, 3>(1, 1).copy_from(&R);
        Self { mass: even(&(U * self.mass * U.transpose())), ..self.seen_by(&T, &T) }
    }

    /// The same with its own strains of bending and extension at the tension centre and those of
    /// shear and twist at the shear centre, both along `d_1` and `d_2`, m. [6.39]
    #[must_use]
    pub fn with_centers(self, tension: [T; 2], shear: [T; 2]) -> Self {
        let ([x_t, y_t], [x_s, y_s]) = (tension, shear);
        let own = |sign: T| {
            let mut A = Matrix6::identity();
            A[(0, 5)] = -sign * y_s;
            A[(1, 5)] = sign * x_s;
            A[(2, 3)] = sign * y_t;
            A[(2, 4)] = -sign * x_t;
            A
        };
        // the square of the parts off the diagonal vanishes
        self.seen_by(&own(T::of(1.0)).transpose(), &own(T::of(-1.0)))
    }

    /// `ACAᵀ`, `AVAᵀ` and `BC⁻¹Bᵀ`.
    fn seen_by(self, A: &Matrix6<T>, B: &Matrix6<T>) -> Self {
        let by = |A: &Matrix6<T>, of: &Matrix6<T>| even(&(A * of * A.transpose()));
        Self {
            stiffness: by(A, &self.stiffness),
            compliance: by(B, &self.compliance),
            viscosity: by(A, &self.viscosity),
            ..self
        }
    }

    /// The same with a centre of mass at `c` along `d_1` and `d_2`, m, in the place of the line of
    /// the nodes. [6.40]
    #[must_use]
    pub fn with_mass_center(self, c: [T; 2]) -> Self {
        let mut mass = self.mass;
        let (line, c) = (mass[(0, 0)], [T::of(1.0), c[0], c[1]]);
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).skip(1) {
            mass[(i, j)] += line * c[i] * c[j];
        }
        Self { mass, ..self }
    }

    /// The mass between `φ, d_1, d_2, d_3` (kg/m, kg, kg·m) from that between velocities and
    /// angular velocities about the directors, 6×6 about the line of the nodes; and by which part
    /// its inertia about `d_3` misses that of a plane section. Up to 1 % it is taken for one.
    ///
    /// # Errors
    /// [`SectionError::NotSymmetric`], [`SectionError::MassEntry`], [`SectionError::Inertia`].
    pub fn mass_of_velocities(M: &Matrix6<T>) -> Result<(Matrix4<T>, f64), SectionError> {
        const PLANE: f64 = 0.01;
        const TOLERANCE: f64 = 1e-6;
        let M = symmetric("mass", M)?;
        let line = M[(0, 0)];
        positive(INERTIA_NAMES[0], re(line))?;
        let [S_1, S_2] = [-M[(2, 4)], M[(2, 3)]];
        let mut expected = M;
        for (i, j) in (0..3).flat_map(|i| (0..6).map(move |j| (i, j))) {
            let value = match (i, j) {
                _ if i == j => line,
                (0, 5) => -S_2,
                (1, 5) => S_1,
                (2, 3) => S_2,
                (2, 4) => -S_1,
                _ => T::of(0.0),
            };
            (expected[(i, j)], expected[(j, i)]) = (value, value);
        }
        for k in [3, 4] {
            (expected[(k, 5)], expected[(5, k)]) = (T::of(0.0), T::of(0.0));
        }
        for (row, column) in (0..6).flat_map(|i| (i..6).map(move |j| (i, j))) {
            let (value, fit) = (re(M[(row, column)]), re(expected[(row, column)]));
            let size = (re(M[(row, row)]) * re(M[(column, column)])).abs().sqrt();
            let apart = (value - fit).abs();
            if apart.is_nan() || apart > TOLERANCE * size {
                let (row, column) = (row + 1, column + 1);
                return Err(SectionError::MassEntry { row, column, value, expected: fit });
            }
        }
        let J = [M[(3, 3)], M[(4, 4)], M[(5, 5)]];
        let miss = re(J[2] - J[0] - J[1]).abs() / re(J[2]).max(f64::MIN_POSITIVE);
        let I = match miss <= PLANE {
            true => [J[1], J[0], T::of(0.0)],
            false => Self::euler_moments(J)?,
        };
        let (product, o) = (-M[(3, 4)], T::of(0.0));
        #[rustfmt::skip]
        let mass = Matrix4::new(
            line, S_1, S_2, o,
            S_1, I[0], product, o,
            S_2, product, I[1], o,
            o, o, o, I[2],
        );
        Ok((mass, miss))
    }

    /// The section of an element along which it changes: from weights, whose sum is 1, with the
    /// sections there. Compliances add. [6.41]
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn mean(parts: &[(T, Self)]) -> Self {
        let first = parts.first().expect("an element has a section").1;
        if parts.iter().all(|(_, section)| section.is(&first)) {
            return first;
        }
        let (mut compliance, mut Y) = (Matrix6::zeros(), Matrix6::zeros());
        let mut mass = Matrix4::zeros();
        for (weight, own) in parts {
            let scaled = own.compliance * *weight;
            compliance += scaled;
            Y += scaled * own.viscosity * own.compliance;
            mass += own.mass * *weight;
        }
        let rigid = parts.iter().all(|(_, own)| own.shear == Shear::Rigid);
        let shear = if rigid { Shear::Rigid } else { Shear::Soft };
        let stiffness = inverse(&compliance, |own| Some(inverse_of_compliance(&own)));
        let stiffness = even(&stiffness.expect("it is a pseudo-inverse"));
        let viscosity = even(&(stiffness * Y * stiffness));
        Self { stiffness, compliance, viscosity, mass, shear }
    }

    /// Whether it is the same, with its derivatives.
    fn is(&self, other: &Self) -> bool {
        let apart = |a: &Matrix6<T>, b: &Matrix6<T>| (a - b).iter().any(|own| !own.vanishes());
        self.shear == other.shear
            && !apart(&self.stiffness, &other.stiffness)
            && !apart(&self.compliance, &other.compliance)
            && !apart(&self.viscosity, &other.viscosity)
            && (self.mass - other.mass).iter().all(|own| own.vanishes())
    }

    /// `I_Iρ = ½ tr J − J_I` from section inertias `J_I` about the directors, kg·m.
    ///
    /// # Errors
    /// [`SectionError::Inertia`] when one of them exceeds the sum of the two others.
    pub fn euler_moments(J: [T; 3]) -> Result<[T; 3], SectionError> {
        let half = T::of(0.5) * (J[0] + J[1] + J[2]);
        let slack = 1e-12 * re(half);
        let moments = J.map(|J| half - J);
        if moments.iter().any(|E| re(*E).is_nan() || re(*E) < -slack) {
            return Err(SectionError::Inertia(J.map(Number::real)));
        }
        // nothing but rounding: zero with its derivative
        Ok(moments.map(|E| if re(E).abs() <= slack { E - T::of(re(E)) } else { E }))
    }

    /// Whether it has no shear: its shear stiffnesses are infinite, and stand as zeros in `C`.
    #[must_use]
    pub fn is_rigid_in_shear(&self) -> bool {
        self.shear == Shear::Rigid
    }

    /// `C`, the same as a matrix.
    #[must_use]
    pub fn stiffness_matrix(&self) -> &Matrix6<T> {
        &self.stiffness
    }

    /// `C⁻¹`.
    #[must_use]
    pub fn compliance(&self) -> Matrix6<T> {
        self.compliance
    }

    /// `V`, N·s, N·m·s and N·m²·s.
    #[must_use]
    pub fn viscosity(&self) -> Matrix6<T> {
        self.viscosity
    }

    /// `(Aρ, I_1ρ, I_2ρ, I_3ρ)`: mass per length of `φ, d_1, d_2, d_3`, the diagonal of `m`.
    #[must_use]
    pub fn inertia(&self) -> [T; 4] {
        self.mass.diagonal().into()
    }

    /// `m`, the mass per length between `φ, d_1, d_2, d_3`.
    #[must_use]
    pub fn mass_matrix(&self) -> Matrix4<T> {
        self.mass
    }

    /// `(GA_1, GA_2, EA, EI_1, EI_2, GJ)`, the diagonal of `C`.
    #[must_use]
    pub fn stiffness(&self) -> [T; 6] {
        self.stiffness.diagonal().into()
    }
}

impl Section {
    /// Whether any strain is damped.
    #[must_use]
    pub fn is_damped(&self) -> bool {
        self.viscosity.amax() > 0.0
    }

    /// Whether it behaves the same in all directions across the beam.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        let quarter = self.turned(std::f64::consts::FRAC_PI_2);
        let eighth = self.turned(std::f64::consts::FRAC_PI_4);
        let same = |a: &[f64], b: &[f64], sizes: &dyn Fn(usize) -> f64| {
            a.iter().zip(b).enumerate().all(|(k, (a, b))| (a - b).abs() <= 1e-9 * sizes(k))
        };
        let of_strains =
            |k: usize| (self.stiffness[(k % 6, k % 6)] * self.stiffness[(k / 6, k / 6)]).sqrt();
        let of_rates = |k: usize| (self.mass[(k % 4, k % 4)] * self.mass[(k / 4, k / 4)]).sqrt();
        let size = |of: f64, least: f64| if of > 0.0 { of } else { least };
        [quarter, eighth].iter().all(|turned| {
            let least = f64::MIN_POSITIVE;
            same(self.stiffness.as_slice(), turned.stiffness.as_slice(), &|k| {
                size(of_strains(k), least)
            }) && same(self.mass.as_slice(), turned.mass.as_slice(), &|k| size(of_rates(k), least))
        })
    }

    /// The condition number of `C` with its diagonal scaled to 1.
    #[must_use]
    pub fn condition(&self) -> f64 {
        let of_shear = if self.is_rigid_in_shear() { 2 } else { 0 };
        let C = scaled(&self.stiffness);
        let rest = C.view((of_shear, of_shear), (6 - of_shear, 6 - of_shear)).into_owned();
        let values = rest.symmetric_eigenvalues();
        values.max() / values.min()
    }

    /// Where its centres are, from `C⁻¹` and `m`.
    #[must_use]
    pub fn centers(&self) -> Centers {
        let (F, m) = (&self.compliance, &self.mass);
        // curvatures of a tension at (x, y): F_43 + F_44 y − F_45 x and F_53 + F_54 y − F_55 x
        let bending = Matrix2::new(-F[(3, 4)], F[(3, 3)], -F[(4, 4)], F[(4, 3)]);
        let tension = bending.try_inverse().unwrap_or_else(Matrix2::zeros)
            * nalgebra::Vector2::new(-F[(3, 2)], -F[(4, 2)]);
        let shear = [-F[(5, 1)] / F[(5, 5)], F[(5, 0)] / F[(5, 5)]];
        let mass = [1, 2].map(|i| m[(0, i)] / m[(0, 0)]);
        let one_zero = |x: f64| x + 0.0;
        Centers {
            tension: [tension.x, tension.y].map(one_zero),
            shear: shear.map(one_zero),
            mass: mass.map(one_zero),
        }
    }

    /// `C⁻¹`.
    pub(crate) fn compliance_matrix(&self) -> Matrix6<f64> {
        self.compliance
    }
}

/// Inertias that may be.
fn euler<T: Number>(inertia: [T; 4]) -> Result<[T; 4], SectionError> {
    positive(INERTIA_NAMES[0], re(inertia[0]))?;
    for (what, value) in INERTIA_NAMES.into_iter().zip(inertia).skip(1) {
        not_negative(what, re(value))?;
    }
    Ok(inertia)
}

/// The rotation by an angle about `d_3`.
fn about_3<T: Number>(angle: T) -> Matrix3<T> {
    let [s, c] = angle.sine_cosine();
    let (o, one) = (T::of(0.0), T::of(1.0));
    Matrix3::new(c, -s, o, s, c, o, o, o, one)
}

/// `C` of `C⁻¹`, where that has one: shears may have no compliance.
fn inverse_of_compliance(F: &Matrix6<f64>) -> Matrix6<f64> {
    const NOTHING: f64 = 1e-12;
    let scale = |i: usize| if F[(i, i)] > 0.0 { F[(i, i)].sqrt() } else { 1.0 };
    let of_scaled = Matrix6::from_fn(|i, j| F[(i, j)] / (scale(i) * scale(j)));
    let inverse = of_scaled.pseudo_inverse(NOTHING).expect("the tolerance is not negative");
    Matrix6::from_fn(|i, j| inverse[(i, j)] / (scale(i) * scale(j)))
}

/// The symmetric part.
fn even<T: Number, const N: usize>(m: &SMatrix<T, N, N>) -> SMatrix<T, N, N> {
    times(0.5, &(m + m.transpose()))
}

/// The values alone.
fn real<T: Number, const N: usize>(m: &SMatrix<T, N, N>) -> SMatrix<f64, N, N> {
    m.map(Number::real)
}

/// With a diagonal of 1; rows without a positive diagonal stay.
fn scaled<const N: usize>(m: &SMatrix<f64, N, N>) -> DMatrix<f64> {
    let scale = |i: usize| if m[(i, i)] > 0.0 { m[(i, i)].sqrt() } else { 1.0 };
    DMatrix::from_fn(N, N, |i, j| m[(i, j)] / (scale(i) * scale(j)))
}

/// The smallest eigenvalue of a scaled matrix of strains with its eigenvector in words.
fn weakest(m: &Matrix6<f64>) -> (f64, String) {
    let eigen = scaled(m).symmetric_eigen();
    let (k, least) = eigen.eigenvalues.argmin();
    let vector = eigen.eigenvectors.column(k);
    let mut order: Vec<usize> = (0..6).filter(|i| vector[*i].abs() > 0.3).collect();
    let size = |i: usize| (1e6 * vector[i].abs()).round(); // equal parts in their order
    order.sort_by(|i, j| size(*j).total_cmp(&size(*i)));
    let names: Vec<&str> = order.into_iter().map(|i| STRAIN_NAMES[i]).collect();
    (least, names.join(" with "))
}

fn definite(what: &'static str, m: &Matrix6<f64>) -> Result<(), SectionError> {
    let (least, motion) = weakest(m);
    match least > 1e-14 && m.cholesky().is_some() {
        true => Ok(()),
        false => Err(SectionError::NotDefinite { what, motion, least }),
    }
}

fn semidefinite(what: &'static str, m: &Matrix6<f64>) -> Result<(), SectionError> {
    let (least, motion) = weakest(m);
    match least >= -1e-12 {
        true => Ok(()),
        false => Err(SectionError::NotDefinite { what, motion, least }),
    }
}

/// Whether a mass between `φ, d_1, d_2, d_3` has a distribution: its inertia about its own centre
/// is not negative.
fn possible(m: &Matrix4<f64>) -> Result<(), SectionError> {
    let first = m.fixed_view::<3, 1>(1, 0);
    let own = m.fixed_view::<3, 3>(1, 1) - first * first.transpose() / m[(0, 0)];
    let own = DMatrix::from_column_slice(3, 3, own.as_slice());
    match own.symmetric_eigenvalues().min() >= -1e-9 * m.fixed_view::<3, 3>(1, 1).amax() {
        true => Ok(()),
        false => Err(SectionError::Mass { center: [1, 2].map(|i| m[(0, i)] / m[(0, 0)]) }),
    }
}

/// The mean of a matrix and its transpose, where they differ by rounding only.
fn symmetric<T: Number, const N: usize>(
    what: &'static str,
    m: &SMatrix<T, N, N>,
) -> Result<SMatrix<T, N, N>, SectionError> {
    const TOLERANCE: f64 = 1e-6;
    for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
        let at = |i: usize, j: usize| re(m[(i, j)]);
        let size = (at(i, i) * at(j, j)).abs().sqrt();
        let off = (at(i, j) - at(j, i)).abs();
        if !(off <= TOLERANCE * size && at(i, j).is_finite()) {
            let values = [at(i, j), at(j, i)];
            return Err(SectionError::NotSymmetric { what, row: i + 1, column: j + 1, values });
        }
    }
    Ok(even(m))
}

fn not_negative(what: &'static str, value: f64) -> Result<(), SectionError> {
    match value.is_finite() && value >= 0.0 {
        true => Ok(()),
        false => Err(SectionError::Negative { what, value }),
    }
}

pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), SectionError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(SectionError::NotPositive { what, value })
    }
}

#[cfg(test)]
mod tests;
