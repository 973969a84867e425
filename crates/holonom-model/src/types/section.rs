//! `section` of a beam: stiffness and inertia per length, stated or from shape and material.
//!
//! A stated number is used as it is; what is not stated follows from shape and material.

use crate::text::problem::{Problem, fault};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_beam::section::{Material as Solid, Profile, Section as Numbers, SectionError, Stated};

/// Kind of a cross-section.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OutlineKind {
    /// `dimensions = [width, height]`: along `d_1` and along `d_2`, m.
    Rectangle,
    /// `dimensions = [radius]`, m.
    Circle,
    /// `dimensions = [outer, inner]`: radii, m.
    Tube,
}

/// `shape` of a section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Outline {
    /// Kind of the cross-section.
    #[serde(rename = "type")]
    pub kind: OutlineKind,
    /// Its dimensions, m: rectangle `[width, height]` along `d_1` and `d_2`, circle `[radius]`,
    /// tube `[outer, inner]` radii.
    pub dimensions: Vec<f64>,
}

/// `material` of a section: isotropic, elastic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus, Pa.
    #[serde(rename = "E")]
    pub young: f64,
    /// Shear modulus, Pa.
    #[serde(default, rename = "G", skip_serializing_if = "Option::is_none")]
    pub shear: Option<f64>,
    /// Poisson's ratio, instead of `G`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nu: Option<f64>,
    /// Density, kg/m³.
    pub density: f64,
}

/// `damping` of a section: Kelvin–Voigt, the stress is `C (ε + τ ε̇)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "damping is a relaxation time in s, a table { EA, GA1, GA2, EI1, EI2, GJ } of them, or \
                 { loss_factor, frequency }"
)]
pub enum Damping {
    /// The relaxation time `τ` of all strains, s.
    Time(f64),
    /// `η = 2π f τ` at a frequency `f`, for all strains.
    LossFactor(LossFactor),
    /// The relaxation time of each strain, s; zero where it is not stated.
    Times(RelaxationTimes),
}

/// A loss factor with its frequency.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LossFactor {
    /// `η`, twice the damping ratio of a vibration at `frequency`.
    pub loss_factor: f64,
    /// `f`, Hz.
    pub frequency: f64,
}

/// Relaxation times, s, under the names of the stiffnesses.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, rename_all = "UPPERCASE")]
pub struct RelaxationTimes {
    /// Of the extension, s.
    pub ea: f64,
    /// Of the shear along `d_1`, s.
    pub ga1: f64,
    /// Of the shear along `d_2`, s.
    pub ga2: f64,
    /// Of the bending about `d_1`, s.
    pub ei1: f64,
    /// Of the bending about `d_2`, s.
    pub ei2: f64,
    /// Of the twist, s.
    pub gj: f64,
}

impl Damping {
    /// Relaxation times in the order of the stiffnesses of the elements, s.
    fn times(&self) -> Result<[f64; 6], Problem> {
        let not_negative = |key: &str, value: f64, unit: &str| {
            let message = format!("{key} = {value} is negative");
            let help = format!("write a positive number{unit}, or 0 for no damping");
            if value < 0.0 { Err(fault(key, message, help)) } else { Ok(value) }
        };
        match self {
            Self::Time(time) => Ok([not_negative("damping", *time, " of seconds")?; 6]),
            Self::LossFactor(LossFactor { loss_factor, frequency }) => {
                if *frequency <= 0.0 {
                    let message = format!("frequency = {frequency} is not positive");
                    let help = "write the frequency at which the loss factor holds, in Hz";
                    return Err(fault("damping.frequency", message, help));
                }
                let eta = not_negative("damping.loss_factor", *loss_factor, "")?;
                Ok([eta / (std::f64::consts::TAU * frequency); 6]) // η = 2π f τ
            }
            Self::Times(RelaxationTimes { ea, ga1, ga2, ei1, ei2, gj }) => {
                let named = [
                    ("damping.GA1", ga1),
                    ("damping.GA2", ga2),
                    ("damping.EA", ea),
                    ("damping.EI1", ei1),
                    ("damping.EI2", ei2),
                    ("damping.GJ", gj),
                ];
                for (key, value) in named {
                    not_negative(key, *value, " of seconds")?;
                }
                Ok(named.map(|(_, value)| *value))
            }
        }
    }
}

/// `section`: of a beam. `d_1` and `d_2` lie in the section, `d_3` is normal to it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Its shape; with `material` gives all that is not stated, and the picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<Outline>,
    /// Its material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
    /// Shear factors `[k_1, k_2]` of the shape: `GA1 = k_1 G A`; Cowper's by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_factors: Option<[f64; 2]>,
    /// Torsion constant of the shape, m⁴: `GJ = G J_t`; Saint-Venant's by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion_constant: Option<f64>,
    /// Extensional stiffness, N.
    #[serde(default, rename = "EA", skip_serializing_if = "Option::is_none")]
    pub ea: Option<f64>,
    /// Shear stiffness along `d_1`, N.
    #[serde(default, rename = "GA1", skip_serializing_if = "Option::is_none")]
    pub ga1: Option<f64>,
    /// Shear stiffness along `d_2`, N.
    #[serde(default, rename = "GA2", skip_serializing_if = "Option::is_none")]
    pub ga2: Option<f64>,
    /// Bending stiffness about `d_1`, N·m².
    #[serde(default, rename = "EI1", skip_serializing_if = "Option::is_none")]
    pub ei1: Option<f64>,
    /// Bending stiffness about `d_2`, N·m².
    #[serde(default, rename = "EI2", skip_serializing_if = "Option::is_none")]
    pub ei2: Option<f64>,
    /// Torsional stiffness, N·m².
    #[serde(default, rename = "GJ", skip_serializing_if = "Option::is_none")]
    pub gj: Option<f64>,
    /// Mass per length, kg/m.
    #[serde(default, rename = "rhoA", skip_serializing_if = "Option::is_none")]
    pub rho_a: Option<f64>,
    /// Moment of inertia per length about `d_1`, kg·m.
    #[serde(default, rename = "rhoI1", skip_serializing_if = "Option::is_none")]
    pub rho_i1: Option<f64>,
    /// Moment of inertia per length about `d_2`, kg·m.
    #[serde(default, rename = "rhoI2", skip_serializing_if = "Option::is_none")]
    pub rho_i2: Option<f64>,
    /// Moment of inertia per length about `d_3`, kg·m; `rhoI1 + rhoI2` by default, as of a plane
    /// section.
    #[serde(default, rename = "rhoJ", skip_serializing_if = "Option::is_none")]
    pub rho_j: Option<f64>,
    /// Material damping: a relaxation time `τ` (s), one for each strain, or a loss factor at a
    /// frequency; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<Damping>,
}

impl Outline {
    /// What its dimensions are.
    fn dimension_names(&self) -> &'static [&'static str] {
        match self.kind {
            OutlineKind::Rectangle => &["width", "height"],
            OutlineKind::Circle => &["radius"],
            OutlineKind::Tube => &["outer", "inner"],
        }
    }

    /// Premise: as many dimensions as the kind has.
    fn profile(&self) -> Profile {
        let at = |i: usize| self.dimensions.get(i).copied().unwrap_or_default();
        match self.kind {
            OutlineKind::Rectangle => Profile::Rectangle { width: at(0), height: at(1) },
            OutlineKind::Circle => Profile::Circle { radius: at(0) },
            OutlineKind::Tube => Profile::Tube { outer: at(0), inner: at(1) },
        }
    }

    fn fault(&self) -> Option<Problem> {
        let names = self.dimension_names();
        if self.dimensions.len() != names.len() {
            let message = format!("{} dimension(s) for this shape", self.dimensions.len());
            let help = format!("write dimensions = [{}], in m", names.join(", "));
            return Some(fault("shape.dimensions", message, help));
        }
        let bad = self.dimensions.iter().find(|d| **d <= 0.0)?;
        let message = format!("the dimension {bad} m is not positive");
        Some(fault("shape.dimensions", message, "write positive lengths in m"))
    }
}

impl Material {
    fn solid(&self) -> Result<Solid, Problem> {
        let positive =
            [("E", Some(self.young)), ("G", self.shear), ("density", Some(self.density))];
        for (key, value) in positive {
            if let Some(value) = value.filter(|v| *v <= 0.0) {
                let message = format!("{key} = {value} is not positive");
                return Err(fault(&format!("material.{key}"), message, "write a positive number"));
            }
        }
        match (self.shear, self.nu) {
            (Some(shear), None) => Ok(Solid { young: self.young, shear, density: self.density }),
            (None, Some(nu)) => {
                let solid = Solid::from_poisson(self.young, nu, self.density);
                solid.map_err(|e| fault("material.nu", e.to_string(), "write 0.3 for steel"))
            }
            (Some(_), Some(_)) => {
                let message = "the shear modulus is stated twice: by `G` and by `nu`";
                Err(fault("material.nu", message, "keep one of them"))
            }
            (None, None) => {
                let message = "the material has no shear modulus";
                Err(fault("material", message, "add `G = …` (Pa) or `nu = …`"))
            }
        }
    }
}

impl Section {
    /// Whether a strain has a relaxation time.
    #[must_use]
    pub fn is_damped(&self) -> bool {
        let times = self.damping.as_ref().and_then(|damping| damping.times().ok());
        times.is_some_and(|times| times.iter().any(|time| *time > 0.0))
    }

    /// The ten stated numbers with their keys:
    /// `EA, GA1, GA2, EI1, EI2, GJ, rhoA, rhoI1, rhoI2, rhoJ`.
    fn stated(&mut self) -> [(&'static str, &mut Option<f64>); 10] {
        [
            ("EA", &mut self.ea),
            ("GA1", &mut self.ga1),
            ("GA2", &mut self.ga2),
            ("EI1", &mut self.ei1),
            ("EI2", &mut self.ei2),
            ("GJ", &mut self.gj),
            ("rhoA", &mut self.rho_a),
            ("rhoI1", &mut self.rho_i1),
            ("rhoI2", &mut self.rho_i2),
            ("rhoJ", &mut self.rho_j),
        ]
    }

    /// What shape and material give for the ten numbers.
    fn computed(&self) -> Result<[Option<f64>; 10], Problem> {
        if let Some(fault) = self.shape.as_ref().and_then(Outline::fault) {
            return Err(fault);
        }
        let solid = self.material.as_ref().map(Material::solid).transpose()?;
        let (Some(shape), Some(solid)) = (&self.shape, solid) else { return Ok([None; 10]) };
        let stated =
            Stated { shear_factors: self.shear_factors, torsion_constant: self.torsion_constant };
        let refuse = |error: SectionError| {
            fault("", error.to_string(), "correct the shape or what is stated with it")
        };
        let numbers = shape.profile().section(&solid, &stated).map_err(refuse)?;
        let [ga1, ga2, ea, ei1, ei2, gj] = numbers.stiffness();
        let [rho_a, euler1, euler2, euler3] = numbers.inertia();
        let moments = [euler2 + euler3, euler3 + euler1, euler1 + euler2];
        let [rho_i1, rho_i2, rho_j] = moments;
        Ok([ea, ga1, ga2, ei1, ei2, gj, rho_a, rho_i1, rho_i2, rho_j].map(Some))
    }

    /// This section with all ten numbers.
    pub(crate) fn resolved(&self) -> Result<Self, Problem> {
        let mut section = self.clone();
        let computed = self.computed()?;
        for ((_, stated), computed) in section.stated().into_iter().zip(computed) {
            *stated = stated.or(computed);
        }
        if section.rho_j.is_none() {
            section.rho_j = section.rho_i1.zip(section.rho_i2).map(|(a, b)| a + b);
        }
        let missing: Vec<&str> =
            section.stated().into_iter().filter(|s| s.1.is_none()).map(|s| s.0).collect();
        if missing.is_empty() {
            return Ok(section);
        }
        let help = match (&self.shape, &self.material) {
            (None, Some(_)) => "add a `shape`, or state the numbers",
            (Some(_), None) => "add a `material`, or state the numbers",
            _ => "state them, or give the section a `shape` and a `material`",
        };
        Err(fault("", format!("the section lacks {}", missing.join(", ")), help))
    }

    /// Stiffness and inertia as the elements use them.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the section.
    pub fn numbers(&self) -> Result<Numbers, Problem> {
        let mut section = self.resolved()?;
        let values = section.stated().map(|(key, value)| (key, value.unwrap_or_default()));
        for (key, value) in values {
            if value <= 0.0 {
                let message = format!("{key} = {value} is not positive");
                return Err(fault(key, message, "write a positive number"));
            }
        }
        let [ea, ga1, ga2, ei1, ei2, gj, rho_a, i1, i2, j] = values.map(|v| v.1);
        let refuse =
            |key: &str, error: SectionError, help: &str| fault(key, error.to_string(), help);
        let moments = Numbers::euler_moments([i1, i2, j]).map_err(|error| {
            refuse("rhoJ", error, "each of rhoI1, rhoI2, rhoJ is at most the sum of the others")
        })?;
        let [e1, e2, e3] = moments;
        let times = self.damping.as_ref().map_or(Ok([0.0; 6]), Damping::times)?;
        Numbers::new([ga1, ga2, ea, ei1, ei2, gj], [rho_a, e1, e2, e3])
            .and_then(|numbers| numbers.with_damping(times))
            .map_err(|error| refuse("", error, "correct the numbers of the section"))
    }

    /// Whether it behaves the same in all directions across the beam.
    pub(crate) fn is_isotropic(&self) -> bool {
        let Ok(section) = self.resolved() else { return true };
        let pairs = [
            (section.ga1, section.ga2),
            (section.ei1, section.ei2),
            (section.rho_i1, section.rho_i2),
        ];
        pairs.into_iter().all(|(a, b)| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() <= 1e-9 * a.abs().max(b.abs()),
            _ => true,
        })
    }
}
