//! `<geom>`: its solid, its pose, its mass.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Unit, Vector3};

use super::pose::{orientation, pose, to_axis};
use super::settings::FileSettings;
use crate::element::XmlElement;
use crate::mass::ImportedMass;
use crate::mesh::MeshCache;
use crate::remark::Remarks;
use crate::robot::Unread;
use crate::solid::{ImportedSolid, PlacedSolid};
use crate::source::{Refusal, Result};
use crate::surface::TouchingSurface;
use crate::urdf::weighed;

/// A geometry in the frame of its body.
#[derive(Clone, Debug, Default)]
pub(crate) struct Geom {
    /// `None` where there is no picture of it.
    pub(crate) placed: Option<PlacedSolid>,
    /// Mass properties; massless where it has no mass.
    pub(crate) mass: ImportedMass,
    /// How it touches planes of the ground; `None` where it does not.
    pub(crate) surface: Option<TouchingSurface>,
    pub(crate) name: Option<String>,
}

/// Density without one, kg/m³.
const DENSITY: f64 = 1000.0;

/// The file of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct MeshFile {
    pub(crate) file: String,
    pub(crate) scale: [f64; 3],
    /// Whether its frame is not that of the file.
    pub(crate) moved: bool,
    /// How its volume is taken.
    pub(crate) inertia: String,
}

/// Reads geoms.
#[derive(Debug)]
pub(crate) struct Geoms<'a> {
    pub(crate) settings: &'a FileSettings,
    pub(crate) files: BTreeMap<String, MeshFile>,
    pub(crate) meshes: &'a mut MeshCache,
    /// Meshes that could not be read.
    pub(crate) unread: Vec<Unread>,
}

impl Geoms<'_> {
    /// Reads a geom whose defaults are applied; where it does not weigh, it has no mass.
    pub(crate) fn geom(
        &mut self,
        element: &XmlElement,
        weighs: bool,
        remarks: &mut Remarks,
    ) -> Result<Geom> {
        let kind = element.word("type").unwrap_or("sphere");
        let none = Geom::default();
        if element.word("mesh").is_some() && kind != "mesh" {
            remarks.add("solids fitted to meshes: neither mass nor picture", element);
            return Ok(none);
        }
        let weighs = weighs && self.counts(element)?;
        if kind == "mesh" {
            return self.mesh(element, weighs, remarks);
        }
        let Some(placed) = solid(element, kind, self.settings)? else {
            let message = match kind {
                "plane" | "hfield" => "ground surfaces: not translated",
                "sdf" => "signed distance fields: neither mass nor picture",
                other => {
                    let message = format!("`{}` is no type of a geom", other.escape_debug());
                    let help = "there are: sphere, capsule, ellipsoid, cylinder, box, plane, mesh";
                    return Err(Refusal::at(element.place_of("type"), message, help));
                }
            };
            remarks.add(message, element);
            return Ok(none);
        };
        let shell = element.flag("shellinertia") == Some(true);
        let size = if shell { placed.solid.area() } else { placed.solid.volume() };
        let mass = if weighs { mass(element, size)? } else { 0.0 };
        let properties = match mass > 0.0 {
            true if shell => placed.solid.shell_with_mass(mass).moved(&placed.pose),
            true => placed.solid.with_mass(mass).moved(&placed.pose),
            false => ImportedMass::default(),
        };
        Ok(Geom { placed: Some(placed), mass: properties, ..Geom::default() })
    }

    /// Whether its group counts, and mass or density are not zero.
    fn counts(&self, element: &XmlElement) -> Result<bool> {
        let group = element.number("group")?.unwrap_or(0.0);
        let [least, largest] = self.settings.groups;
        let zero = mass(element, 1.0)? == 0.0;
        Ok(least <= group && group <= largest && !zero)
    }

    fn mesh(&mut self, element: &XmlElement, weighs: bool, remarks: &mut Remarks) -> Result<Geom> {
        let name = element.required("mesh")?;
        let file = self.files.get(name).cloned();
        let exact = file.as_ref().is_some_and(|mesh| mesh.inertia == "exact");
        let legacy = file.as_ref().is_some_and(|mesh| mesh.inertia == "legacy");
        let shell = element.flag("shellinertia") == Some(true)
            || file.as_ref().is_some_and(|mesh| mesh.inertia == "shell");
        let summary = match &file {
            Some(mesh) if !mesh.moved => {
                let file = std::path::Path::new(&self.settings.mesh_folder).join(&mesh.file);
                let summary = self.meshes.summary(&file.to_string_lossy(), mesh.scale);
                summary.map_err(|reason| reason.to_string())
            }
            Some(_) => Err("with refpos or refquat".to_owned()),
            None => Err("not from a file".to_owned()),
        };
        let summary = match summary {
            Ok(summary) => summary,
            Err(reason) => {
                let lost = if weighs { "neither mass nor picture" } else { "no picture" };
                remarks.add(format!("meshes, {reason}: {lost}"), element);
                let file = file.map_or_else(|| name.to_owned(), |mesh| mesh.file);
                self.unread.push(Unread { file, reason });
                return Ok(Geom::default());
            }
        };
        let pose = pose(element, self.settings)?;
        let placed = Some(summary.placed(&pose));
        if !weighs {
            return Ok(Geom { placed, ..Geom::default() });
        }
        let unit = match shell {
            true => summary.shell_mass(),
            false if legacy => summary.unsigned_mass(),
            false => weighed(&summary, element, remarks),
        };
        if unit.mass <= 0.0 {
            let help = "state an <inertial> of the body";
            return Err(Refusal::at(&element.place, "the mesh has no volume", help));
        }
        if !exact && !legacy && !shell {
            let message = "meshes with another `inertia` than exact and legacy: taken as solids";
            remarks.add(message, element);
        }
        let mass = unit.scaled(mass(element, unit.mass)? / unit.mass);
        Ok(Geom { placed, mass: mass.moved(&pose), ..Geom::default() })
    }
}

/// The mass of a geom of some volume, kg.
fn mass(element: &XmlElement, volume: f64) -> Result<f64> {
    let (name, mass) = match element.number("mass")? {
        Some(mass) => ("mass", mass),
        None => ("density", element.number("density")?.unwrap_or(DENSITY) * volume),
    };
    if mass < 0.0 {
        let message = format!("the mass {mass} kg is negative");
        return Err(Refusal::at(element.place_of(name), message, "write 0 or a positive number"));
    }
    Ok(mass)
}

/// The solid of a geom; `None` where its type has none.
fn solid(element: &XmlElement, kind: &str, settings: &FileSettings) -> Result<Option<PlacedSolid>> {
    let count = match kind {
        "sphere" => 1,
        "capsule" | "cylinder" => 2,
        "box" | "ellipsoid" => 3,
        _ => return Ok(None),
    };
    let mut size = element.numbers("size")?.unwrap_or_default();
    let mut at = pose(element, settings)?;
    if let Some(ends) = element.vector::<6>("fromto")?.filter(|_| kind != "sphere") {
        let [a, b] =
            [Vector3::from_column_slice(&ends[..3]), Vector3::from_column_slice(&ends[3..])];
        let Some(axis) = Unit::try_new(b - a, 1e-14) else {
            let message = "both ends of `fromto` are one point";
            return Err(Refusal::at(element.place_of("fromto"), message, "write two points"));
        };
        let radius = size.first().copied().unwrap_or(0.0);
        let half = 0.5 * (b - a).norm();
        size = if count == 3 { vec![radius, radius, half] } else { vec![radius, half] };
        at = Isometry3::from_parts(((a + b) * 0.5).into(), to_axis(&axis));
    } else {
        at.rotation = orientation(element, settings)?;
    }
    let positive = size.len() >= count && size[..count].iter().all(|x| *x > 0.0);
    if !positive {
        let message = format!("a {kind} needs {count} positive number(s) in `size`");
        return Err(Refusal::at(element.place_of("size"), message, "write them in m"));
    }
    let solid = match kind {
        "sphere" => ImportedSolid::Sphere(size[0]),
        "capsule" => ImportedSolid::Capsule(size[0], size[1]),
        "cylinder" => ImportedSolid::Cylinder(size[0], size[1]),
        "box" => ImportedSolid::Box([size[0], size[1], size[2]]),
        _ => ImportedSolid::Ellipsoid([size[0], size[1], size[2]]),
    };
    Ok(Some(PlacedSolid { solid, pose: at, mesh: None }))
}
