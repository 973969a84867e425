//! URDF: links with inertials, joints with origins.
//!
//! The frame of a link is that of the joint before it; `rpy` are angles about the fixed axes x, y, z.
//! Source: the specification of URDF, wiki.ros.org/urdf/XML.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

use holonom_model::nearest;

use crate::element::Element;
use crate::mass::Mass;
use crate::mesh::{Meshes, Summary};
use crate::remark::Remarks;
use crate::robot::{Gear, Joint, Kind, Link, Robot};
use crate::solid::{Placed, Solid};
use crate::source::{Fault, Result};
use crate::{Base, Options};

/// Reads a robot from the root element `<robot>`.
pub(crate) fn robot(
    root: &Element,
    options: &Options,
    meshes: &mut Meshes,
    remarks: &mut Remarks,
) -> Result<Robot> {
    refuse_xacro(root)?;
    let density = options.density;
    let mut reader = Reader { root, density, meshes, remarks, gears: Vec::new() };
    let links = reader.links(options.base)?;
    reader.rest();
    let gears = reader.gears;
    remarks.of_all("gravity: URDF states none, 9.81 m/s² along -z was taken");
    Ok(Robot {
        name: root.word("name").unwrap_or("robot").to_owned(),
        format: "URDF",
        gravity: Vector3::new(0.0, 0.0, -9.81),
        step: 0.001,
        links,
        loops: Vec::new(),
        gears,
    })
}

fn refuse_xacro(element: &Element) -> Result<()> {
    let macros = element.name.starts_with("xacro:")
        || element.attributes.iter().any(|a| a.value.contains("${"));
    if macros {
        let help = "expand it first: `xacro robot.urdf.xacro > robot.urdf`, then import robot.urdf";
        return Err(Fault::at(&element.place, "this file has xacro macros", help));
    }
    element.children.iter().try_for_each(refuse_xacro)
}

struct Reader<'a> {
    root: &'a Element,
    /// Of links without inertia, kg/m³.
    density: Option<f64>,
    meshes: &'a mut Meshes,
    remarks: &'a mut Remarks,
    gears: Vec<Gear>,
}

impl<'a> Reader<'a> {
    /// The links, parents first.
    fn links(&mut self, base: Base) -> Result<Vec<Link>> {
        let root = self.root;
        let mut elements: BTreeMap<&str, &Element> = BTreeMap::new();
        for link in root.all("link") {
            unique(&mut elements, link)?;
        }
        let mut joints: BTreeMap<&str, &Element> = BTreeMap::new();
        let mut above: BTreeMap<&str, &Element> = BTreeMap::new();
        let mut below: BTreeMap<&str, Vec<&Element>> = BTreeMap::new();
        for joint in root.all("joint") {
            unique(&mut joints, joint)?;
            let [parent, child] =
                [end(joint, "parent", &elements)?, end(joint, "child", &elements)?];
            if above.insert(child, joint).is_some() {
                let message = format!("link `{}` has two parents", child.escape_debug());
                let help = "URDF describes trees: close the loop in the model file, by a [[joint]]";
                return Err(Fault::at(&joint.place, message, help));
            }
            below.entry(parent).or_default().push(joint);
        }
        let first = self.first(&elements, &above)?;
        let mut links = vec![self.base(first, base)?];
        let push = |stack: &mut Vec<(usize, &'a Element)>, at: usize, name: &str| {
            let list = below.get(name).map(Vec::as_slice).unwrap_or_default();
            stack.extend(list.iter().rev().map(|joint| (at, *joint)));
        };
        let mut stack = Vec::new();
        push(&mut stack, 0, first.required("name")?);
        while let Some((parent, joint)) = stack.pop() {
            let link = elements[end(joint, "child", &elements)?];
            links.push(self.link(link, Some((parent, joint)))?);
            push(&mut stack, links.len() - 1, link.required("name")?);
        }
        if links.len() < elements.len() {
            let reached: Vec<&str> = links.iter().map(|l| l.name.as_str()).collect();
            let lost =
                elements.values().find(|e| !reached.contains(&e.word("name").unwrap_or_default()));
            let place = lost.map_or(&root.place, |e| &e.place);
            let message = "this link hangs on itself: its joints form a circle";
            return Err(Fault::at(
                place,
                message,
                "URDF describes trees: remove one of the joints",
            ));
        }
        Ok(links)
    }

    /// The only link without a parent.
    fn first(
        &self,
        elements: &BTreeMap<&str, &'a Element>,
        above: &BTreeMap<&str, &'a Element>,
    ) -> Result<&'a Element> {
        let mut roots = self.root.all("link").filter(|l| {
            let name = l.word("name").unwrap_or_default();
            !above.contains_key(name)
        });
        match (roots.next(), roots.next()) {
            (Some(first), None) => Ok(first),
            (Some(first), Some(second)) => {
                let name =
                    |l: &Element| l.word("name").unwrap_or_default().escape_debug().to_string();
                let message = format!("`{}` and `{}` have no parent", name(first), name(second));
                let help = "one link is the root of the tree: connect the other one by a joint";
                Err(Fault::at(&second.place, message, help))
            }
            (None, _) if elements.is_empty() => {
                let help = "a URDF file has <link> and <joint> in <robot>";
                Err(Fault::at(&self.root.place, "the robot has no link", help))
            }
            (None, _) => {
                let message = "no link is without a parent: the joints form a circle";
                let help = "URDF describes trees: remove one of the joints";
                Err(Fault::at(&self.root.place, message, help))
            }
        }
    }

    fn base(&mut self, element: &Element, base: Base) -> Result<Link> {
        let mut link = self.link(element, None)?;
        link.free = base == Base::Free;
        Ok(link)
    }

    /// A link with the joint before it.
    fn link(&mut self, element: &Element, above: Option<(usize, &Element)>) -> Result<Link> {
        let mut link = Link {
            name: element.required("name")?.to_owned(),
            parent: above.map(|(parent, _)| parent),
            frame: Isometry3::identity(),
            free: false,
            joints: Vec::new(),
            mass: self.inertial(element)?,
            solids: Vec::new(),
            place: element.child("inertial").unwrap_or(element).place.clone(),
        };
        let density = self.density.filter(|_| element.child("inertial").is_none());
        for visual in element.all("visual") {
            let Some((placed, mass)) = self.visual(visual, density.is_some())? else { continue };
            link.solids.push(placed);
            link.mass = link.mass.plus(&mass.scaled(density.unwrap_or(0.0)));
        }
        for collision in element.all("collision") {
            self.remarks.add("contact: not translated", &named(collision, element));
        }
        let Some((_, joint)) = above else { return Ok(link) };
        link.frame = origin(joint)?;
        match joint.required("type")? {
            "fixed" => {}
            "floating" => link.free = true,
            "revolute" | "continuous" => link.joints = vec![self.joint(joint, Kind::Hinge)?],
            "prismatic" => link.joints = vec![self.joint(joint, Kind::Slide)?],
            "planar" => link.joints = vec![self.joint(joint, Kind::Planar)?],
            other => {
                let known = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar"];
                let message = format!("`{}` is no type of a joint", other.escape_debug());
                let help = match nearest(other, known) {
                    Some(best) => format!("did you mean `{best}`?"),
                    None => format!("there are: {}", known.join(", ")),
                };
                return Err(Fault::at(joint.place_of("type"), message, help));
            }
        }
        Ok(link)
    }

    fn joint(&mut self, element: &Element, kind: Kind) -> Result<Joint> {
        let name = element.required("name")?.to_owned();
        let axis = match element.child("axis") {
            Some(axis) => direction(axis)?,
            None => Vector3::x_axis(),
        };
        let dynamics = element.child("dynamics");
        let damping = dynamics.map_or(Ok(0.0), |d| d.amount("damping"))?;
        let friction = dynamics.map_or(Ok(None), |d| d.number("friction"))?.unwrap_or(0.0);
        if friction != 0.0 {
            self.remarks.add("friction: not translated", element);
        }
        if damping != 0.0 && kind == Kind::Planar {
            self.remarks.add("damping of a planar joint: only of its angle", element);
        }
        let ignored = [
            ("limit", "limits of joints: not translated"),
            ("safety_controller", "safety controllers: not translated"),
            ("calibration", "calibration: not translated"),
        ];
        for (child, message) in ignored {
            if element.child(child).is_some() {
                self.remarks.add(message, element);
            }
        }
        if let Some(mimic) = element.child("mimic") {
            self.gears.push(Gear {
                name: format!("{name}_mimic"),
                joint: name.clone(),
                of: Some(mimic.required("joint")?.to_owned()),
                offset: mimic.number("offset")?.unwrap_or(0.0),
                factor: mimic.number("multiplier")?.unwrap_or(1.0),
                place: mimic.place.clone(),
            });
        }
        Ok(Joint {
            name,
            kind,
            axis,
            anchor: Vector3::zeros(),
            reference: 0.0,
            value: 0.0,
            damping,
            stiffness: 0.0,
            rest: 0.0,
            place: element.place.clone(),
        })
    }

    /// `<inertial>`: mass, centre of mass, inertia in the frame of the link.
    fn inertial(&mut self, link: &Element) -> Result<Mass> {
        let Some(inertial) = link.child("inertial") else { return Ok(Mass::default()) };
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
            return Ok(Mass::default());
        }
        Ok(Mass { mass, center: Vector3::zeros(), J: tensor }.moved(&origin(inertial)?))
    }

    /// The solid of a visual, and where it `weighs` its mass properties at 1 kg/m³.
    fn visual(&mut self, visual: &Element, weighs: bool) -> Result<Option<(Placed, Mass)>> {
        let pose = origin(visual)?;
        let Some(shape) = visual.child("geometry").and_then(|g| g.children.first()) else {
            return Ok(None);
        };
        let missing = |name: &str| {
            let message = format!("<{}> has no `{name}`", shape.name);
            Fault::at(&shape.place, message, format!("add {name}=\"…\", in m"))
        };
        let length = |name: &str| shape.number(name)?.ok_or_else(|| missing(name));
        let solid = match shape.name.as_str() {
            "box" => {
                let size = shape.vector::<3>("size")?.ok_or_else(|| missing("size"))?;
                Solid::Box(size.map(|edge| 0.5 * edge))
            }
            "cylinder" => Solid::Cylinder(length("radius")?, 0.5 * length("length")?),
            "sphere" => Solid::Sphere(length("radius")?),
            "capsule" => Solid::Capsule(length("radius")?, 0.5 * length("length")?),
            "mesh" => {
                let scale = shape.vector::<3>("scale")?.unwrap_or([1.0; 3]);
                let file = shape.required("filename")?;
                let summary = match self.meshes.summary(file, scale) {
                    Ok(summary) => summary,
                    Err(reason) => {
                        self.remarks.add(format!("meshes, {reason}: no picture"), shape);
                        return Ok(None);
                    }
                };
                let mass = if weighs { weighed(&summary, shape)? } else { Mass::default() };
                return Ok(Some((summary.placed(&pose), mass.moved(&pose))));
            }
            _ => {
                self.remarks.add("unknown geometry: not translated", shape);
                return Ok(None);
            }
        };
        let mass = if weighs && solid.is_solid() { solid.volume() } else { 0.0 };
        Ok(Some((Placed { solid, pose, mesh: None }, solid.with_mass(mass).moved(&pose))))
    }

    /// What stands beside links and joints.
    fn rest(&mut self) {
        for element in &self.root.children {
            match element.name.as_str() {
                "link" | "joint" => {}
                "material" => self.remarks.add("colours and materials: not translated", element),
                "transmission" => self.remarks.add("transmissions: not translated", element),
                other => {
                    let message = format!("<{}>: not translated", other.escape_debug());
                    self.remarks.add(message, element);
                }
            }
        }
    }
}

/// An element by its name, which no other has.
fn unique<'a>(known: &mut BTreeMap<&'a str, &'a Element>, element: &'a Element) -> Result<()> {
    let name = element.required("name")?;
    if known.insert(name, element).is_some() {
        let kind = &element.name;
        let message = format!("there is another {kind} named `{}`", name.escape_debug());
        return Err(Fault::at(element.place_of("name"), message, "choose another name"));
    }
    Ok(())
}

/// The link at the end of a joint.
fn end<'a>(
    joint: &'a Element,
    side: &str,
    links: &BTreeMap<&'a str, &'a Element>,
) -> Result<&'a str> {
    let Some(element) = joint.child(side) else {
        let message = format!("the joint has no <{side}>");
        return Err(Fault::at(&joint.place, message, format!("add <{side} link=\"…\"/>")));
    };
    let name = element.required("link")?;
    if links.contains_key(name) {
        return Ok(name);
    }
    let message = format!("there is no link named `{}`", name.escape_debug());
    let help = match nearest(name, links.keys().copied()) {
        Some(best) => format!("did you mean `{}`?", best.escape_debug()),
        None => "add the link".to_owned(),
    };
    Err(Fault::at(element.place_of("link"), message, help))
}

/// `<origin xyz rpy>`; the identity without it.
fn origin(element: &Element) -> Result<Isometry3<f64>> {
    let Some(origin) = element.child("origin") else { return Ok(Isometry3::identity()) };
    let [x, y, z] = origin.vector::<3>("xyz")?.unwrap_or_default();
    let [roll, pitch, yaw] = origin.vector::<3>("rpy")?.unwrap_or_default();
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

fn direction(axis: &Element) -> Result<Unit<Vector3<f64>>> {
    let xyz = Vector3::from(axis.vector::<3>("xyz")?.unwrap_or([1.0, 0.0, 0.0]));
    Unit::try_new(xyz, 1e-10).ok_or_else(|| {
        Fault::at(axis.place_of("xyz"), "the axis has no direction", "write xyz=\"0 0 1\"")
    })
}

/// Mass properties of a mesh at 1 kg/m³.
pub(crate) fn weighed(summary: &Summary, element: &Element) -> Result<Mass> {
    summary.mass().map_err(|reason| {
        let message = format!("the mesh has no mass properties: {reason}");
        let help = "state the mass and the inertia of the link, or close the mesh";
        Fault::at(&element.place, message, help)
    })
}

/// An element without a name of its own, called after its link.
fn named(element: &Element, link: &Element) -> Element {
    element.with_defaults(link.attributes.as_slice())
}
