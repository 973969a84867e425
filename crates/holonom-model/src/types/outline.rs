//! `shape` and `material` of a section.

use crate::text::problem::{Problem, fault};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_beam::profile::{Material as Solid, Profile, Walls};
use vi_core::Number;

/// The number at a key path, from its value: itself, or with its derivative.
pub(crate) type NumberAtKey<'a, T> = &'a dyn Fn(&str, f64) -> T;

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
    /// `dimensions = [width, height, flange, web]`, m: two flanges along `d_1`, two webs along
    /// `d_2`, with their thicknesses; a hollow rectangle.
    Box,
    /// `dimensions = [width, height, flange, web]`, m: two flanges along `d_1`, a web between their
    /// middles.
    I,
    /// `dimensions = [width, height, flange, web]`, m: two flanges along `d_1` from a web at their
    /// beginning; its shear centre lies behind the web.
    Channel,
}

/// `shape` of a section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Outline {
    /// Kind of the cross-section.
    #[serde(rename = "type")]
    pub kind: OutlineKind,
    /// Its dimensions, m: rectangle `[width, height]` along `d_1` and `d_2`, circle `[radius]`,
    /// tube `[outer, inner]` radii; box, i and channel `[width, height, flange, web]`, outer
    /// extents and thicknesses.
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

impl Outline {
    /// What its dimensions are.
    fn dimension_names(&self) -> &'static [&'static str] {
        match self.kind {
            OutlineKind::Rectangle => &["width", "height"],
            OutlineKind::Circle => &["radius"],
            OutlineKind::Tube => &["outer", "inner"],
            OutlineKind::Box | OutlineKind::I | OutlineKind::Channel => {
                &["width", "height", "flange", "web"]
            }
        }
    }

    /// From its numbers by their keys below that of the section. Premise: as many dimensions as the
    /// kind has.
    pub(crate) fn profile<T: Number>(&self, number: NumberAtKey<'_, T>) -> Profile<T> {
        let at = |i: usize| {
            let own = self.dimensions.get(i).copied().unwrap_or_default();
            number(&format!("shape.dimensions.{i}"), own)
        };
        let walls = Walls { width: at(0), height: at(1), flange: at(2), web: at(3) };
        match self.kind {
            OutlineKind::Rectangle => Profile::Rectangle { width: at(0), height: at(1) },
            OutlineKind::Circle => Profile::Circle { radius: at(0) },
            OutlineKind::Tube => Profile::Tube { outer: at(0), inner: at(1) },
            OutlineKind::Box => Profile::Box(walls),
            OutlineKind::I => Profile::I(walls),
            OutlineKind::Channel => Profile::Channel(walls),
        }
    }

    pub(crate) fn fault(&self) -> Option<Problem> {
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
    /// From its numbers by their keys below that of the section.
    pub(crate) fn solid<T: Number>(&self, number: NumberAtKey<'_, T>) -> Result<Solid<T>, Problem> {
        let positive =
            [("E", Some(self.young)), ("G", self.shear), ("density", Some(self.density))];
        for (key, value) in positive {
            if let Some(value) = value.filter(|v| *v <= 0.0) {
                let message = format!("{key} = {value} is not positive");
                return Err(fault(&format!("material.{key}"), message, "write a positive number"));
            }
        }
        let young = number("material.E", self.young);
        let density = number("material.density", self.density);
        match (self.shear, self.nu) {
            (Some(shear), None) => Ok(Solid { young, shear: number("material.G", shear), density }),
            (None, Some(nu)) => {
                let solid = Solid::from_poisson(young, number("material.nu", nu), density);
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
