//! Shapes of homogeneous cross-sections and their constants.
//!
//! ```text
//! k_I GA: shear along d_I,   EI_1, EI_2 about the centroid,   GJ_t
//! solid, tube     k of Cowper,      J_t of Saint-Venant
//! thin walls      k A = I²/∮ S²/t ds (energy of the shear flow S),   S' = t ξ
//!   open          J_t = ⅓ Σ b t³
//!   closed        J_t = 4 A_m²/∮ ds/t
//! channel         shear centre at the distance e = 3 b²t_f/(h t_w + 6 b t_f) behind its web
//! ```
//! Areas and second moments are those of the full walls; shear and torsion those of lines in the
//! middle of the walls, of the lengths `b` and `h`. Flanges lie along `d_1`, webs along `d_2`; a
//! channel opens along `d_1`.
//!
//! Source: Cowper, J. Appl. Mech. 33 (1966) 335–340; torsion of the rectangle: Timoshenko &
//! Goodier, Theory of Elasticity, §109 (series), of thin walls: §§112–115; shear flow and its
//! energy: Renton, Int. J. Solids Struct. 27 (1991) 1955–1967; shear centre of the channel:
//! Timoshenko & Gere, Mechanics of Materials, §6.
#![allow(non_snake_case)] // E, G, A: the letters of the field

use crate::section::{Section, SectionError, positive};
use crate::small::re;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use vi_core::Number;

/// An isotropic material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material<T = f64> {
    /// `E`, Pa.
    pub young: T,
    /// `G`, Pa.
    pub shear: T,
    /// `ρ`, kg/m³.
    pub density: T,
}

impl<T: Number> Material<T> {
    /// `G = E / (2(1 + ν))`.
    ///
    /// # Errors
    /// [`SectionError::Poisson`].
    pub fn from_poisson(young: T, nu: T, density: T) -> Result<Self, SectionError> {
        if !(re(nu) > -1.0 && re(nu) <= 0.5) {
            return Err(SectionError::Poisson(re(nu)));
        }
        let shear = young / (T::of(2.0) * (T::of(1.0) + nu));
        Ok(Self { young, shear, density })
    }

    /// `ν = E/(2G) − 1`.
    #[must_use]
    pub fn poisson(&self) -> T {
        self.young / (T::of(2.0) * self.shear) - T::of(1.0)
    }
}

/// Dimensions of flanges and webs, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Walls<T = f64> {
    /// Outer extent along `d_1`.
    pub width: T,
    /// Outer extent along `d_2`.
    pub height: T,
    /// Thickness of each flange.
    pub flange: T,
    /// Thickness of each web.
    pub web: T,
}

/// `x³`.
fn cube<T: Number>(x: T) -> T {
    x.powi(3)
}

/// `x²`.
fn square<T: Number>(x: T) -> T {
    x.powi(2)
}

impl<T: Number> Walls<T> {
    fn validate(&self, webs: f64) -> Result<(), SectionError> {
        let Self { width, height, flange, web } = *self;
        let named = [
            ("width", width),
            ("height", height),
            ("flange thickness", flange),
            ("web thickness", web),
        ];
        for (what, value) in named {
            positive(what, re(value))?;
        }
        for (thickness, size) in [(2.0 * re(flange), height), (webs * re(web), width)] {
            if thickness >= re(size) {
                return Err(SectionError::Walls { thickness, size: re(size) });
            }
        }
        Ok(())
    }

    /// `h`, between the middles of the flanges.
    fn middle_height(&self) -> T {
        self.height - self.flange
    }

    /// Height of a web between the flanges.
    fn clear(&self) -> T {
        self.height - T::of(2.0) * self.flange
    }

    /// `A` of both flanges and a number of webs.
    fn area(&self, webs: f64) -> T {
        T::of(2.0) * self.width * self.flange + T::of(webs) * self.clear() * self.web
    }

    /// `I_1` with a number of webs.
    fn second_moment_1(&self, webs: f64) -> T {
        let empty = self.width - T::of(webs) * self.web;
        (self.width * cube(self.height) - empty * cube(self.clear())) / T::of(12.0)
    }

    /// `⅓ Σ b t³` of flanges of a length and one web.
    fn open_torsion(&self, flange: T) -> T {
        let flanges = T::of(2.0) * flange * cube(self.flange);
        (flanges + self.middle_height() * cube(self.web)) / T::of(3.0)
    }

    /// `∫ S²/t ds` of a web from one flange to the other with `S = S_0` at both, for shear along
    /// it.
    fn web_energy(&self, S_0: T) -> T {
        let (half, t) = (T::of(0.5), self.web);
        let a = half * self.middle_height();
        let fullness = |y: T| square(S_0 + half * t * (a * a - y * y)) / t;
        T::of(2.0) * gauss(a, fullness)
    }
}

/// `∫_0^a f`, exact for polynomials of degree 5.
fn gauss<T: Number>(a: T, f: impl Fn(T) -> T) -> T {
    let (half, far) = (T::of(0.5) * a, T::of(0.5) * a * T::of(0.6_f64.sqrt()));
    a * (T::of(5.0) * (f(half - far) + f(half + far)) + T::of(8.0) * f(half)) / T::of(18.0)
}

/// The channel of middle lines: its flanges `b`, distances from the middle of the web along `d_1`.
struct ChannelLines<T> {
    b: T,
    centroid: T,
    shear_center: T, // behind the web
}

impl<T: Number> ChannelLines<T> {
    fn new(walls: &Walls<T>) -> Self {
        let b = walls.width - T::of(0.5) * walls.web;
        let (flange, web) = (b * walls.flange, walls.middle_height() * walls.web);
        let centroid = flange * b / (T::of(2.0) * flange + web);
        let shear_center = T::of(3.0) * flange * b / (web + T::of(6.0) * flange);
        Self { b, centroid, shear_center }
    }
}

/// Shape of a homogeneous cross-section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub enum Profile<T = f64> {
    /// A rectangle.
    Rectangle {
        /// Extent along `d_1`, m.
        width: T,
        /// Extent along `d_2`, m.
        height: T,
    },
    /// A full circle.
    Circle {
        /// m.
        radius: T,
    },
    /// A circular tube.
    Tube {
        /// m.
        outer: T,
        /// m.
        inner: T,
    },
    /// Two flanges and two webs.
    Box(Walls<T>),
    /// Two flanges and a web in their middle.
    I(Walls<T>),
    /// Two flanges and a web at one end of them: they point along `d_1`.
    Channel(Walls<T>),
    /// Anything, by its numbers.
    General {
        /// `A`, m².
        area: T,
        /// `I_1 = ∫ ξ_2² dA`, bending about `d_1`, m⁴.
        second_moment_1: T,
        /// `I_2 = ∫ ξ_1² dA`, bending about `d_2`, m⁴.
        second_moment_2: T,
        /// `J_t`, m⁴.
        torsion_constant: T,
    },
}

/// What of a profile may be stated instead of computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stated<T = f64> {
    /// Shear factors `(k_1, k_2)`; without: those of the shape.
    pub shear_factors: Option<[T; 2]>,
    /// Torsion constant `J_t`, m⁴; without: Saint-Venant's.
    pub torsion_constant: Option<T>,
}

impl<T: Number> Profile<T> {
    /// The section of a homogeneous profile about its centroid:
    /// `(k_1GA, k_2GA, EA, EI_1, EI_2, GJ_t)`, `ρ(A, I_2, I_1, 0)`.
    ///
    /// # Errors
    /// [`SectionError`].
    pub fn section(
        &self,
        material: &Material<T>,
        stated: &Stated<T>,
    ) -> Result<Section<T>, SectionError> {
        let section = self.about_centers(material, stated)?;
        let shear = self.shear_center();
        match shear.iter().all(|own| own.vanishes()) {
            true => Ok(section),
            false => Ok(section.with_centers([T::of(0.0); 2], shear)),
        }
    }

    /// The same with shear and twist about the shear centre, bending and mass about the centroid.
    ///
    /// # Errors
    /// [`SectionError`].
    pub fn about_centers(
        &self,
        material: &Material<T>,
        stated: &Stated<T>,
    ) -> Result<Section<T>, SectionError> {
        self.validate()?;
        let Material { young: E, shear: G, density: rho } = *material;
        for (what, value) in [("Young's modulus", E), ("the shear modulus", G), ("density", rho)] {
            positive(what, re(value))?;
        }
        let (A, [I1, I2]) = (self.area(), self.second_moments());
        let Jt = stated.torsion_constant.unwrap_or_else(|| self.torsion_constant());
        let k = stated.shear_factors.unwrap_or_else(|| self.shear_factors(material.poisson()));
        Section::new(
            [k[0] * G * A, k[1] * G * A, E * A, E * I1, E * I2, G * Jt],
            [rho * A, rho * I2, rho * I1, T::of(0.0)],
        )
    }

    fn validate(&self) -> Result<(), SectionError> {
        match *self {
            Self::Rectangle { width, height } => {
                positive("width", re(width))?;
                positive("height", re(height))
            }
            Self::Circle { radius } => positive("radius", re(radius)),
            Self::Tube { outer, inner } => {
                positive("outer radius", re(outer))?;
                positive("inner radius", re(inner))?;
                let (inner, outer) = (re(inner), re(outer));
                if inner < outer { Ok(()) } else { Err(SectionError::Tube { inner, outer }) }
            }
            Self::Box(walls) => walls.validate(2.0),
            Self::I(walls) | Self::Channel(walls) => walls.validate(1.0),
            Self::General { area, second_moment_1, second_moment_2, torsion_constant } => {
                positive("area", re(area))?;
                positive("second moment 1", re(second_moment_1))?;
                positive("second moment 2", re(second_moment_2))?;
                positive("torsion constant", re(torsion_constant))
            }
        }
    }

    /// `A`, m².
    #[must_use]
    pub fn area(&self) -> T {
        match *self {
            Self::Rectangle { width, height } => width * height,
            Self::Circle { radius } => T::of(PI) * radius * radius,
            Self::Tube { outer, inner } => T::of(PI) * (outer * outer - inner * inner),
            Self::Box(walls) => walls.area(2.0),
            Self::I(walls) | Self::Channel(walls) => walls.area(1.0),
            Self::General { area, .. } => area,
        }
    }

    /// `(I_1, I_2) = (∫ ξ_2² dA, ∫ ξ_1² dA)`, m⁴.
    #[must_use]
    pub fn second_moments(&self) -> [T; 2] {
        let two = T::of(2.0);
        match *self {
            Self::Rectangle { width: b, height: h } => {
                [b * cube(h) / T::of(12.0), h * cube(b) / T::of(12.0)]
            }
            Self::Circle { radius } => [T::of(0.25 * PI) * radius.powi(4); 2],
            Self::Tube { outer, inner } => [T::of(0.25 * PI) * (outer.powi(4) - inner.powi(4)); 2],
            Self::Box(walls) => {
                let Walls { width, height, web, .. } = walls;
                let inner = walls.clear() * cube(width - two * web);
                [walls.second_moment_1(2.0), (height * cube(width) - inner) / T::of(12.0)]
            }
            Self::I(walls) => {
                let flanges = two * walls.flange * cube(walls.width);
                let own = (flanges + walls.clear() * cube(walls.web)) / T::of(12.0);
                [walls.second_moment_1(1.0), own]
            }
            Self::Channel(walls) => {
                let flanges = two * walls.flange * cube(walls.width);
                let of_back = (flanges + walls.clear() * cube(walls.web)) / T::of(3.0);
                let away = walls.area(1.0) * square(channel_centroid(&walls));
                [walls.second_moment_1(1.0), of_back - away]
            }
            Self::General { second_moment_1, second_moment_2, .. } => {
                [second_moment_1, second_moment_2]
            }
        }
    }

    /// Saint-Venant's torsion constant, m⁴.
    #[must_use]
    pub fn torsion_constant(&self) -> T {
        match *self {
            Self::Rectangle { width, height } => rectangle_torsion(width, height),
            Self::Box(walls) => {
                let (b, h) = (walls.width - walls.web, walls.middle_height());
                T::of(2.0) * square(b * h) / (b / walls.flange + h / walls.web)
            }
            Self::I(walls) => walls.open_torsion(walls.width),
            Self::Channel(walls) => walls.open_torsion(ChannelLines::new(&walls).b),
            Self::General { torsion_constant, .. } => torsion_constant,
            _ => {
                let [I_1, I_2] = self.second_moments();
                I_1 + I_2
            }
        }
    }

    /// Where the shear centre is from the centroid, along `d_1` and `d_2`, m.
    #[must_use]
    pub fn shear_center(&self) -> [T; 2] {
        match self {
            Self::Channel(walls) => {
                let behind = ChannelLines::new(walls).shear_center;
                [T::of(0.5) * walls.web - behind - channel_centroid(walls), T::of(0.0)]
            }
            _ => [T::of(0.0); 2],
        }
    }

    /// Shear factors: Cowper's of solid shapes and tubes, of the energy of the shear flow of thin
    /// walls; 1 for general profiles.
    #[must_use]
    pub fn shear_factors(&self, nu: T) -> [T; 2] {
        let (one, of) = (T::of(1.0), T::of);
        let k = match *self {
            Self::Rectangle { .. } => of(10.0) * (one + nu) / (of(12.0) + of(11.0) * nu),
            Self::Circle { .. } => of(6.0) * (one + nu) / (of(7.0) + of(6.0) * nu),
            Self::Tube { outer, inner } => {
                let m2 = square(inner / outer);
                let full = square(one + m2);
                let rest = (of(20.0) + of(12.0) * nu) * m2;
                of(6.0) * (one + nu) * full / ((of(7.0) + of(6.0) * nu) * full + rest)
            }
            Self::Box(walls) => return self.thin_factors(box_energies(&walls)),
            Self::I(walls) => return self.thin_factors(i_energies(&walls)),
            Self::Channel(walls) => return self.thin_factors(channel_energies(&walls)),
            Self::General { .. } => one,
        };
        [k; 2]
    }

    /// `k_I = (I/A) I/∮ S²/t ds` from second moments and energies of the middle lines.
    fn thin_factors(&self, [along_1, along_2]: [[T; 2]; 2]) -> [T; 2] {
        [along_1, along_2].map(|[moment, energy]| moment * moment / energy / self.area())
    }
}

/// From the back of the web, m.
fn channel_centroid<T: Number>(walls: &Walls<T>) -> T {
    let Walls { width, flange, web, .. } = *walls;
    (width * flange * width + T::of(0.5) * walls.clear() * web * web) / walls.area(1.0)
}

/// `[I, ∮ S²/t ds]` for shear along `d_1` and along `d_2`.
fn box_energies<T: Number>(walls: &Walls<T>) -> [[T; 2]; 2] {
    let Walls { width, height, flange, web } = *walls;
    let across = Walls { width: height, height: width, flange: web, web: flange };
    let (three, four) = (T::of(3.0), T::of(4.0));
    let of = |own: &Walls<T>| {
        let (half, a) = (T::of(0.5) * (own.width - own.web), T::of(0.5) * own.middle_height());
        let moment = four * half * own.flange * a * a + four * own.web * cube(a) / three;
        let flanges = four * own.flange * a * a * cube(half) / three;
        [moment, flanges + T::of(2.0) * own.web_energy(half * own.flange * a)]
    };
    [of(&across), of(walls)]
}

fn i_energies<T: Number>(walls: &Walls<T>) -> [[T; 2]; 2] {
    let Walls { width, flange, web, .. } = *walls;
    let (two, three) = (T::of(2.0), T::of(3.0));
    let (half, a) = (T::of(0.5) * width, T::of(0.5) * walls.middle_height());
    // the flanges are rectangles that shear along their width
    let moment_2 = flange * cube(width) / T::of(6.0);
    let energy_2 = moment_2 * moment_2 / (T::of(5.0 / 6.0 * 2.0) * flange * width);
    let moment_1 = two * width * flange * a * a + two * web * cube(a) / three;
    let flanges = T::of(4.0) * flange * a * a * cube(half) / three;
    [[moment_2, energy_2], [moment_1, flanges + walls.web_energy(width * flange * a)]]
}

fn channel_energies<T: Number>(walls: &Walls<T>) -> [[T; 2]; 2] {
    let (half, two, three) = (T::of(0.5), T::of(2.0), T::of(3.0));
    let ChannelLines { b, centroid: x_c, .. } = ChannelLines::new(walls);
    let (t, web, a) = (walls.flange, walls.web, half * walls.middle_height());
    let moment_2 = two * t * (cube(b - x_c) + cube(x_c)) / three + two * a * web * x_c * x_c;
    let of_flange = |x: T| square(t * (half * (b * b - x * x) - x_c * (b - x))) / t;
    let of_web = web * x_c * x_c * two * cube(a) / three;
    let energy_2 = two * gauss(b, of_flange) + of_web;
    let moment_1 = two * b * t * a * a + two * web * cube(a) / three;
    let energy_1 = two * t * a * a * cube(b) / three + walls.web_energy(b * t * a);
    [[moment_2, energy_2], [moment_1, energy_1]]
}

/// `a b³ [1/3 − (64/π⁵)(b/a) Σ_{k odd} tanh(kπa/2b)/k⁵]` with `a ≥ b`.
fn rectangle_torsion<T: Number>(width: T, height: T) -> T {
    let (a, b) = if re(width) < re(height) { (height, width) } else { (width, height) };
    let term = |k: f64| (T::of(0.5 * k * PI) * a / b).hyperbolic_tangent() / T::of(k.powi(5));
    let sum = (0..200).rev().map(|i| term(f64::from(2 * i + 1)));
    let sum = sum.fold(T::of(0.0), |sum, term| sum + term);
    a * cube(b) * (T::of(1.0 / 3.0) - T::of(64.0 / PI.powi(5)) * (b / a) * sum)
}

#[cfg(test)]
mod tests;
