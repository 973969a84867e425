//! Inertials and geometries of links.

use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::UrdfReader;
use crate::element::XmlElement;
use crate::mass::ImportedMass;
use crate::mesh::MeshSummary;
use crate::remark::Remarks;
use crate::robot::Unread;
use crate::solid::{ImportedSolid, PlacedSolid};
use crate::source::{Refusal, Result};

impl UrdfReader<'_> {
    /// `<inertial>`: mass, centre of mass, inertia in the frame of the link.
    pub(super) fn inertial(&mut self, link: &XmlElement) -> Result<ImportedMass> {
        let Some(inertial) = link.child("inertial") else { return Ok(ImportedMass::default()) };
        let mass = inertial.child("mass").map_or(Ok(0.0), |m| m.amount("value"))?;
        let mut tensor = Matrix3::zeros();
        if let Some(inertia) = inertial.child("inertia") {
            let entries = [
                ("ixx", 0, 0),
                ("ixy", 0, 1),
                ("ixz", 0, 2),
                ("iyy", 1, 1),
                ("iyz", 1, 2),
                ("izz", 2, 2),
            ];
            for (name, i, j) in entries {
                let value = inertia.number(name)?.unwrap_or(0.0);
                (tensor[(i, j)], tensor[(j, i)]) = (value, value);
            }
        }
        if mass == 0.0 {
            if tensor.amax() != 0.0 {
                self.remarks.add("inertia of a link without mass: not used", link);
            }
            return Ok(ImportedMass::default());
        }
        Ok(ImportedMass { mass, center: Vector3::zeros(), J: tensor }.moved(&origin(inertial)?))
    }

    /// The pictures of a link, and with a density the mass of its visual geometry; of the geometry
    /// for contact where that has none.
    pub(super) fn geometries(
        &mut self,
        link: &XmlElement,
    ) -> Result<(Vec<PlacedSolid>, ImportedMass)> {
        let density = self.density.filter(|_| link.child("inertial").is_none());
        let (mut solids, mut mass) = (Vec::new(), ImportedMass::default());
        for visual in link.all("visual") {
            let Some((placed, part)) = self.geometry(visual, density.is_some())? else { continue };
            solids.push(placed);
            mass = mass.plus(&part);
        }
        if density.is_some() && mass.mass == 0.0 {
            for collision in link.all("collision") {
                let read = self.geometry(collision, true)?;
                mass = read.map_or(mass, |(_, part)| mass.plus(&part));
            }
            if mass.mass > 0.0 {
                let message =
                    "no mass from visual geometry: that of the geometry for contact was taken";
                self.remarks.add(message, link);
            }
        }
        let has_geometry = link.child("visual").or(link.child("collision")).is_some();
        if density.is_none() && link.child("inertial").is_none() && has_geometry {
            self.shapes_without_mass.push(link.label());
        }
        Ok((solids, mass.scaled(density.unwrap_or(0.0))))
    }

    /// A geometry with its mass properties at 1 kg/m³ if it `weighs`. One that cannot be read is
    /// left out if it does not.
    pub(super) fn geometry(
        &mut self,
        element: &XmlElement,
        weighs: bool,
    ) -> Result<Option<(PlacedSolid, ImportedMass)>> {
        match self.solid(element, weighs) {
            Err(fault) if !weighs => {
                let message = format!("no picture of a geometry, as {}", fault.message());
                self.remarks.add(message, element);
                Ok(None)
            }
            read => read,
        }
    }

    fn solid(
        &mut self,
        element: &XmlElement,
        weighs: bool,
    ) -> Result<Option<(PlacedSolid, ImportedMass)>> {
        let pose = origin(element)?;
        let Some(shape) = element.child("geometry").and_then(|g| g.children.first()) else {
            return Ok(None);
        };
        let missing = |name: &str| {
            let message = format!("<{}> has no `{name}`", shape.name);
            Refusal::at(&shape.place, message, format!("add {name}=\"…\", in m"))
        };
        let length = |name: &str| shape.number(name)?.ok_or_else(|| missing(name));
        let solid = match shape.name.as_str() {
            "box" => {
                let size = shape.vector::<3>("size")?.ok_or_else(|| missing("size"))?;
                ImportedSolid::Box(size.map(|edge| 0.5 * edge))
            }
            "cylinder" => ImportedSolid::Cylinder(length("radius")?, 0.5 * length("length")?),
            "sphere" => ImportedSolid::Sphere(length("radius")?),
            "capsule" => ImportedSolid::Capsule(length("radius")?, 0.5 * length("length")?),
            "mesh" => return self.mesh(shape, &pose, weighs),
            _ => {
                self.remarks.add("unknown geometry: not translated", shape);
                return Ok(None);
            }
        };
        let mass = if weighs && solid.is_solid() { solid.volume() } else { 0.0 };
        Ok(Some((PlacedSolid { solid, pose, mesh: None }, solid.with_mass(mass).moved(&pose))))
    }

    fn mesh(
        &mut self,
        shape: &XmlElement,
        pose: &Isometry3<f64>,
        weighs: bool,
    ) -> Result<Option<(PlacedSolid, ImportedMass)>> {
        let scale = match shape.numbers("scale")?.as_deref() {
            None | Some([]) => [1.0; 3],
            Some([factor]) => [*factor; 3],
            Some([x, y, z]) => [*x, *y, *z],
            Some(others) => {
                let message = format!("`scale` has {} numbers, not 1 or 3", others.len());
                return Err(Refusal::at(shape.place_of("scale"), message, "write 3 numbers"));
            }
        };
        let file = shape.required("filename")?;
        let summary = match self.meshes.summary(file, scale) {
            Ok(summary) => summary,
            Err(reason) => {
                let reason = reason.to_string();
                let lost = if weighs { "neither mass nor picture" } else { "no picture" };
                self.remarks.add(format!("meshes, {reason}: {lost}"), shape);
                self.unread.push(Unread { file: file.to_owned(), reason });
                return Ok(None);
            }
        };
        let mass =
            if weighs { weighed(&summary, shape, self.remarks) } else { ImportedMass::default() };
        Ok(Some((summary.placed(pose), mass.moved(pose))))
    }
}

/// `<origin xyz rpy>` or `<origin xyz quat_xyzw>`; the identity without it.
pub(super) fn origin(element: &XmlElement) -> Result<Isometry3<f64>> {
    element.child("origin").map_or_else(|| Ok(Isometry3::identity()), pose)
}

/// The pose that an element states by `xyz`, and `rpy` or `quat_xyzw`.
pub(super) fn pose(element: &XmlElement) -> Result<Isometry3<f64>> {
    let [x, y, z] = element.vector::<3>("xyz")?.unwrap_or_default();
    let angles = element.vector::<3>("rpy")?;
    let [roll, pitch, yaw] = angles.unwrap_or_default();
    let rotation = match element.vector::<4>("quat_xyzw")? {
        None => UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        Some(_) if angles.is_some() => {
            let message = "the orientation is stated twice: `rpy` and `quat_xyzw`";
            return Err(Refusal::at(element.place_of("quat_xyzw"), message, "keep one of them"));
        }
        Some([i, j, k, w]) => {
            let quaternion = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-14);
            quaternion.ok_or_else(|| {
                let message = "the quaternion has no direction";
                let help = "write quat_xyzw=\"0 0 0 1\" for no rotation";
                Refusal::at(element.place_of("quat_xyzw"), message, help)
            })?
        }
    };
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

/// Mass properties of a mesh at 1 kg/m³; of one that is not closed those of its tetrahedra.
pub(crate) fn weighed(
    summary: &MeshSummary,
    element: &XmlElement,
    remarks: &mut Remarks,
) -> ImportedMass {
    match summary.mass() {
        Ok(mass) => mass,
        Err(reason) => {
            let message = format!(
                "a mesh that is no closed surface ({reason}): its mass is that of the tetrahedra between its triangles and its centre"
            );
            remarks.add(message, element);
            summary.unsigned_mass()
        }
    }
}
