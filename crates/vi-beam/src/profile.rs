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
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

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

/// Dimensions of flanges and webs, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Walls {
    /// Outer extent along `d_1`.
    pub width: f64,
    /// Outer extent along `d_2`.
    pub height: f64,
    /// Thickness of each flange.
    pub flange: f64,
    /// Thickness of each web.
    pub web: f64,
}

impl Walls {
    fn validate(&self, webs: f64) -> Result<(), SectionError> {
        let Self { width, height, flange, web } = *self;
        let named = [
            ("width", width),
            ("height", height),
            ("flange thickness", flange),
            ("web thickness", web),
        ];
        for (what, value) in named {
            positive(what, value)?;
        }
        for (thickness, size) in [(2.0 * flange, height), (webs * web, width)] {
            if thickness >= size {
                return Err(SectionError::Walls { thickness, size });
            }
        }
        Ok(())
    }

    /// `h`, between the middles of the flanges.
    fn middle_height(&self) -> f64 {
        self.height - self.flange
    }

    /// Height of a web between the flanges.
    fn clear(&self) -> f64 {
        self.height - 2.0 * self.flange
    }

    /// `A` of both flanges and a number of webs.
    fn area(&self, webs: f64) -> f64 {
        2.0 * self.width * self.flange + webs * self.clear() * self.web
    }

    /// `I_1` with a number of webs.
    fn second_moment_1(&self, webs: f64) -> f64 {
        let empty = self.width - webs * self.web;
        (self.width * self.height.powi(3) - empty * self.clear().powi(3)) / 12.0
    }

    /// `⅓ Σ b t³` of flanges of a length and one web.
    fn open_torsion(&self, flange: f64) -> f64 {
        (2.0 * flange * self.flange.powi(3) + self.middle_height() * self.web.powi(3)) / 3.0
    }

    /// `∫ S²/t ds` of a web from one flange to the other with `S = S_0` at both, for shear along
    /// it.
    fn web_energy(&self, S_0: f64) -> f64 {
        let (a, t) = (0.5 * self.middle_height(), self.web);
        let fullness = |y: f64| (S_0 + 0.5 * t * (a * a - y * y)).powi(2) / t;
        2.0 * gauss(a, fullness)
    }
}

/// `∫_0^a f`, exact for polynomials of degree 5.
fn gauss(a: f64, f: impl Fn(f64) -> f64) -> f64 {
    let far = 0.5 * a * 0.6_f64.sqrt();
    a * (5.0 * (f(0.5 * a - far) + f(0.5 * a + far)) + 8.0 * f(0.5 * a)) / 18.0
}

/// The channel of middle lines: its flanges `b`, distances from the middle of the web along `d_1`.
struct ChannelLines {
    b: f64,
    centroid: f64,
    shear_center: f64, // behind the web
}

impl ChannelLines {
    fn new(walls: &Walls) -> Self {
        let b = walls.width - 0.5 * walls.web;
        let (flange, web) = (b * walls.flange, walls.middle_height() * walls.web);
        let centroid = flange * b / (2.0 * flange + web);
        Self { b, centroid, shear_center: 3.0 * flange * b / (web + 6.0 * flange) }
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
    /// Two flanges and two webs.
    Box(Walls),
    /// Two flanges and a web in their middle.
    I(Walls),
    /// Two flanges and a web at one end of them: they point along `d_1`.
    Channel(Walls),
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
    /// Shear factors `(k_1, k_2)`; without: those of the shape.
    pub shear_factors: Option<[f64; 2]>,
    /// Torsion constant `J_t`, m⁴; without: Saint-Venant's.
    pub torsion_constant: Option<f64>,
}

impl Profile {
    /// The section of a homogeneous profile about its centroid:
    /// `(k_1GA, k_2GA, EA, EI_1, EI_2, GJ_t)`, `ρ(A, I_2, I_1, 0)`.
    ///
    /// # Errors
    /// [`SectionError`].
    pub fn section(&self, material: &Material, stated: &Stated) -> Result<Section, SectionError> {
        let section = self.about_centers(material, stated)?;
        match self.shear_center() {
            [0.0, 0.0] => Ok(section),
            shear => Ok(section.with_centers([0.0; 2], shear)),
        }
    }

    /// The same with shear and twist about the shear centre, bending and mass about the centroid.
    ///
    /// # Errors
    /// [`SectionError`].
    pub fn about_centers(
        &self,
        material: &Material,
        stated: &Stated,
    ) -> Result<Section, SectionError> {
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
            Self::Box(walls) => walls.validate(2.0),
            Self::I(walls) | Self::Channel(walls) => walls.validate(1.0),
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
            Self::Box(walls) => walls.area(2.0),
            Self::I(walls) | Self::Channel(walls) => walls.area(1.0),
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
            Self::Box(walls) => {
                let Walls { width, height, web, .. } = walls;
                let inner = walls.clear() * (width - 2.0 * web).powi(3);
                [walls.second_moment_1(2.0), (height * width.powi(3) - inner) / 12.0]
            }
            Self::I(walls) => {
                let flanges = 2.0 * walls.flange * walls.width.powi(3);
                let own = (flanges + walls.clear() * walls.web.powi(3)) / 12.0;
                [walls.second_moment_1(1.0), own]
            }
            Self::Channel(walls) => {
                let flanges = 2.0 * walls.flange * walls.width.powi(3);
                let of_back = (flanges + walls.clear() * walls.web.powi(3)) / 3.0;
                let away = walls.area(1.0) * channel_centroid(&walls).powi(2);
                [walls.second_moment_1(1.0), of_back - away]
            }
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
            Self::Box(walls) => {
                let (b, h) = (walls.width - walls.web, walls.middle_height());
                2.0 * (b * h).powi(2) / (b / walls.flange + h / walls.web)
            }
            Self::I(walls) => walls.open_torsion(walls.width),
            Self::Channel(walls) => walls.open_torsion(ChannelLines::new(&walls).b),
            Self::General { torsion_constant, .. } => torsion_constant,
            _ => self.second_moments().iter().sum(),
        }
    }

    /// Where the shear centre is from the centroid, along `d_1` and `d_2`, m.
    #[must_use]
    pub fn shear_center(&self) -> [f64; 2] {
        match self {
            Self::Channel(walls) => {
                let behind = ChannelLines::new(walls).shear_center;
                [0.5 * walls.web - behind - channel_centroid(walls), 0.0]
            }
            _ => [0.0; 2],
        }
    }

    /// Shear factors: Cowper's of solid shapes and tubes, of the energy of the shear flow of thin
    /// walls; 1 for general profiles.
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
            Self::Box(walls) => return self.thin_factors(box_energies(&walls)),
            Self::I(walls) => return self.thin_factors(i_energies(&walls)),
            Self::Channel(walls) => return self.thin_factors(channel_energies(&walls)),
            Self::General { .. } => 1.0,
        };
        [k; 2]
    }

    /// `k_I = (I/A) I/∮ S²/t ds` from second moments and energies of the middle lines.
    fn thin_factors(&self, [along_1, along_2]: [[f64; 2]; 2]) -> [f64; 2] {
        [along_1, along_2].map(|[moment, energy]| moment * moment / energy / self.area())
    }
}

/// From the back of the web, m.
fn channel_centroid(walls: &Walls) -> f64 {
    let Walls { width, flange, web, .. } = *walls;
    (width * flange * width + 0.5 * walls.clear() * web * web) / walls.area(1.0)
}

/// `[I, ∮ S²/t ds]` for shear along `d_1` and along `d_2`.
fn box_energies(walls: &Walls) -> [[f64; 2]; 2] {
    let Walls { width, height, flange, web } = *walls;
    let across = Walls { width: height, height: width, flange: web, web: flange };
    let of = |own: &Walls| {
        let (half, a) = (0.5 * (own.width - own.web), 0.5 * own.middle_height());
        let moment = 4.0 * half * own.flange * a * a + 4.0 * own.web * a.powi(3) / 3.0;
        let flanges = 4.0 * own.flange * a * a * half.powi(3) / 3.0;
        [moment, flanges + 2.0 * own.web_energy(half * own.flange * a)]
    };
    [of(&across), of(walls)]
}

fn i_energies(walls: &Walls) -> [[f64; 2]; 2] {
    let Walls { width, flange, web, .. } = *walls;
    let (half, a) = (0.5 * width, 0.5 * walls.middle_height());
    // the flanges are rectangles that shear along their width
    let moment_2 = flange * width.powi(3) / 6.0;
    let energy_2 = moment_2 * moment_2 / (5.0 / 6.0 * 2.0 * flange * width);
    let moment_1 = 2.0 * width * flange * a * a + 2.0 * web * a.powi(3) / 3.0;
    let flanges = 4.0 * flange * a * a * half.powi(3) / 3.0;
    [[moment_2, energy_2], [moment_1, flanges + walls.web_energy(width * flange * a)]]
}

fn channel_energies(walls: &Walls) -> [[f64; 2]; 2] {
    let ChannelLines { b, centroid: x_c, .. } = ChannelLines::new(walls);
    let (t, web, a) = (walls.flange, walls.web, 0.5 * walls.middle_height());
    let moment_2 = 2.0 * t * ((b - x_c).powi(3) + x_c.powi(3)) / 3.0 + 2.0 * a * web * x_c * x_c;
    let of_flange = |x: f64| (t * (0.5 * (b * b - x * x) - x_c * (b - x))).powi(2) / t;
    let of_web = web * x_c * x_c * 2.0 * a.powi(3) / 3.0;
    let energy_2 = 2.0 * gauss(b, of_flange) + of_web;
    let moment_1 = 2.0 * b * t * a * a + 2.0 * web * a.powi(3) / 3.0;
    let energy_1 = 2.0 * t * a * a * b.powi(3) / 3.0 + walls.web_energy(b * t * a);
    [[moment_2, energy_2], [moment_1, energy_1]]
}

/// `a b³ [1/3 − (64/π⁵)(b/a) Σ_{k odd} tanh(kπa/2b)/k⁵]` with `a ≥ b`.
fn rectangle_torsion(width: f64, height: f64) -> f64 {
    let (a, b) = (width.max(height), width.min(height));
    let term = |k: f64| libm::tanh(0.5 * k * PI * a / b) / k.powi(5);
    let sum: f64 = (0..200).rev().map(|i| term(f64::from(2 * i + 1))).sum();
    a * b.powi(3) * (1.0 / 3.0 - 64.0 / PI.powi(5) * (b / a) * sum)
}

#[cfg(test)]
mod tests;
