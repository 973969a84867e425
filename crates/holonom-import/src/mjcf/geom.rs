//! `<geom>`: its solid, its pose, its mass.

use nalgebra::{Isometry3, Unit, Vector3};

use super::pose::{orientation, pose, to_axis};
use super::settings::Settings;
use crate::element::Element;
use crate::mass::Mass;
use crate::remark::Remarks;
use crate::solid::{Placed, Solid};
use crate::source::{Fault, Result};

/// A geometry in the frame of its body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geom {
    /// `None` where there is no picture of it.
    pub(crate) placed: Option<Placed>,
    /// Mass properties; massless where it has no mass.
    pub(crate) mass: Mass,
}

/// Density without one, kg/m³.
const DENSITY: f64 = 1000.0;

/// Reads a geom whose defaults are applied.
pub(crate) fn geom(element: &Element, settings: &Settings, remarks: &mut Remarks) -> Result<Geom> {
    let kind = element.word("type").unwrap_or("sphere");
    let none = Geom { placed: None, mass: Mass::default() };
    if element.word("mesh").is_some() && kind != "mesh" {
        remarks.add("solids fitted to meshes: neither mass nor picture", element);
        return Ok(none);
    }
    let Some(placed) = solid(element, kind, settings)? else {
        let message = match kind {
            "plane" | "hfield" => "ground surfaces: not translated",
            "mesh" => "meshes, not read: neither mass nor picture",
            "sdf" => "signed distance fields: neither mass nor picture",
            other => {
                let message = format!("`{}` is no type of a geom", other.escape_debug());
                let help = "there are: sphere, capsule, ellipsoid, cylinder, box, plane, mesh";
                return Err(Fault::at(element.place_of("type"), message, help));
            }
        };
        remarks.add(message, element);
        return Ok(none);
    };
    if element.flag("shellinertia") == Some(true) {
        remarks.add("shells: their mass is taken as that of solids", element);
    }
    let mass = match element.number("mass")? {
        Some(mass) => mass,
        None => element.number("density")?.unwrap_or(DENSITY) * placed.solid.volume(),
    };
    if mass < 0.0 {
        let place = if element.attribute("mass").is_some() { "mass" } else { "density" };
        let message = format!("the mass {mass} kg is negative");
        return Err(Fault::at(element.place_of(place), message, "write 0 or a positive number"));
    }
    let group = element.number("group")?.unwrap_or(0.0);
    let counts = settings.groups[0] <= group && group <= settings.groups[1];
    let mass = if counts { mass } else { 0.0 };
    let massless = Mass::default();
    let mass = if mass > 0.0 { placed.solid.with_mass(mass).moved(&placed.pose) } else { massless };
    Ok(Geom { placed: Some(placed), mass })
}

/// The solid of a geom; `None` where its type has none.
fn solid(element: &Element, kind: &str, settings: &Settings) -> Result<Option<Placed>> {
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
            return Err(Fault::at(element.place_of("fromto"), message, "write two points"));
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
        return Err(Fault::at(element.place_of("size"), message, "write them in m"));
    }
    let solid = match kind {
        "sphere" => Solid::Sphere(size[0]),
        "capsule" => Solid::Capsule(size[0], size[1]),
        "cylinder" => Solid::Cylinder(size[0], size[1]),
        "box" => Solid::Box([size[0], size[1], size[2]]),
        _ => Solid::Ellipsoid([size[0], size[1], size[2]]),
    };
    Ok(Some(Placed { solid, pose: at }))
}
