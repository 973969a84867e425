//! URDF: links with inertials, joints with origins.
//!
//! The frame of a link is that of the joint before it; `rpy` are angles about the fixed axes x, y,
//! z. Source: the specification of URDF, wiki.ros.org/urdf/XML.

mod closure;
mod geometry;
mod joint;
mod known;

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Vector3};

use holonom_model::nearest;

use crate::element::{Attribute, XmlElement};
use crate::mesh::MeshCache;
use crate::remark::Remarks;
use crate::robot::{Gear, NamedFrame, Robot, RobotLink, Unread};
use crate::source::{Refusal, Result};
use crate::surface::{NOT_ASKED, TouchingSolid, TouchingSurface};
use crate::{Base, ImportOptions};
pub(crate) use geometry::weighed;

/// Reads a robot from the root element `<robot>`.
pub(crate) fn robot(
    root: &XmlElement,
    options: &ImportOptions,
    meshes: &mut MeshCache,
    remarks: &mut Remarks,
) -> Result<Robot> {
    refuse_xacro(root)?;
    let grounded = with_world(root);
    let root = grounded.as_ref().unwrap_or(root);
    let mut reader = UrdfReader {
        root,
        density: options.density,
        contacts: options.contacts,
        meshes,
        remarks,
        gears: Vec::new(),
        unread: Vec::new(),
        shapes_without_mass: Vec::new(),
    };
    let links = reader.links(options.base)?;
    let loops = reader.closures(&links)?;
    let gears = reader.followers();
    reader.rest();
    let UrdfReader { unread, shapes_without_mass, .. } = reader;
    remarks.of_all("gravity: URDF states none, 9.81 m/s² along -z was taken");
    Ok(Robot {
        name: root.word("name").unwrap_or("robot").to_owned(),
        format: "URDF",
        gravity: Vector3::new(0.0, 0.0, -9.81),
        step: 0.001,
        frames: links.iter().enumerate().map(|(k, link)| NamedFrame::of_link(k, link)).collect(),
        links,
        loops,
        gears,
        tendons: Vec::new(),
        gauges: Vec::new(),
        unread,
        planes: Vec::new(),
        exclusions: Vec::new(),
        geom_pairs: Vec::new(),
        shapes_without_mass,
    })
}

fn refuse_xacro(element: &XmlElement) -> Result<()> {
    let macros = element.name.starts_with("xacro:")
        || element.attributes.iter().any(|a| a.value.contains("${"));
    if macros {
        let help = "expand it first: `xacro robot.urdf.xacro > robot.urdf`, then import robot.urdf";
        return Err(Refusal::at(&element.place, "this file has xacro macros", help));
    }
    element.children.iter().filter(|c| c.name != "gazebo").try_for_each(refuse_xacro)
}

/// The description with the link `world`, where a joint is fixed to it and no link has its name:
/// the ground, as for Gazebo and Drake.
fn with_world(root: &XmlElement) -> Option<XmlElement> {
    const WORLD: &str = "world";
    if root.all("link").any(|link| link.word("name") == Some(WORLD)) {
        return None;
    }
    let parents = root.all("joint").filter_map(|joint| joint.child("parent"));
    let link = parents.filter_map(|parent| parent.attribute("link")).find(|a| a.value == WORLD)?;
    let name = Attribute { name: "name".to_owned(), ..link.clone() };
    let place = link.place.clone();
    let world =
        XmlElement { name: "link".to_owned(), attributes: vec![name], children: Vec::new(), place };
    let mut grounded = root.clone();
    grounded.children.push(world);
    Some(grounded)
}

struct UrdfReader<'a> {
    root: &'a XmlElement,
    /// Of links without inertia, kg/m³.
    density: Option<f64>,
    /// Whether geometry for contact is read.
    contacts: bool,
    meshes: &'a mut MeshCache,
    remarks: &'a mut Remarks,
    gears: Vec<Gear>,
    unread: Vec<Unread>,
    shapes_without_mass: Vec<String>,
}

impl<'a> UrdfReader<'a> {
    /// The links, parents first.
    fn links(&mut self, base: Base) -> Result<Vec<RobotLink>> {
        let root = self.root;
        let mut elements: BTreeMap<&str, &XmlElement> = BTreeMap::new();
        for link in root.all("link") {
            unique(&mut elements, link)?;
        }
        let mut joints: BTreeMap<&str, &XmlElement> = BTreeMap::new();
        let mut above: BTreeMap<&str, &XmlElement> = BTreeMap::new();
        let mut below: BTreeMap<&str, Vec<&XmlElement>> = BTreeMap::new();
        for joint in root.all("joint") {
            unique(&mut joints, joint)?;
            let [parent, child] =
                [end(joint, "parent", &elements)?, end(joint, "child", &elements)?];
            if above.insert(child, joint).is_some() {
                let message = format!("link `{}` has two parents", child.escape_debug());
                let help = "URDF describes trees: close the loop in the model file, by a [[joint]]";
                return Err(Refusal::at(&joint.place, message, help));
            }
            below.entry(parent).or_default().push(joint);
        }
        let first = self.first(&elements, &above)?;
        let mut links = vec![self.base(first, base)?];
        let push = |stack: &mut Vec<(usize, &'a XmlElement)>, at: usize, name: &str| {
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
            let reached: BTreeSet<&str> = links.iter().map(|l| l.name.as_str()).collect();
            let lost = elements.iter().find(|(name, _)| !reached.contains(*name));
            let place = lost.map_or(&root.place, |(_, e)| &e.place);
            let message = "this link hangs on itself: its joints form a circle";
            return Err(Refusal::at(
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
        elements: &BTreeMap<&str, &'a XmlElement>,
        above: &BTreeMap<&str, &'a XmlElement>,
    ) -> Result<&'a XmlElement> {
        let mut roots = self.root.all("link").filter(|l| {
            let name = l.word("name").unwrap_or_default();
            !above.contains_key(name)
        });
        match (roots.next(), roots.next()) {
            (Some(first), None) => Ok(first),
            (Some(first), Some(second)) => {
                let name =
                    |l: &XmlElement| l.word("name").unwrap_or_default().escape_debug().to_string();
                let message = format!("`{}` and `{}` have no parent", name(first), name(second));
                let help = "one link is the root of the tree: connect the other one by a joint";
                Err(Refusal::at(&second.place, message, help))
            }
            (None, _) if elements.is_empty() => {
                let help = "a URDF file has <link> and <joint> in <robot>";
                Err(Refusal::at(&self.root.place, "the robot has no link", help))
            }
            (None, _) => {
                let message = "no link is without a parent: the joints form a circle";
                let help = "URDF describes trees: remove one of the joints";
                Err(Refusal::at(&self.root.place, message, help))
            }
        }
    }

    fn base(&mut self, element: &XmlElement, base: Base) -> Result<RobotLink> {
        let mut link = self.link(element, None)?;
        link.free = base == Base::Free;
        Ok(link)
    }

    /// A link with the joint before it.
    fn link(
        &mut self,
        element: &XmlElement,
        above: Option<(usize, &XmlElement)>,
    ) -> Result<RobotLink> {
        known::leftovers(element, element, self.remarks);
        let (solids, of_solids) = self.geometries(element)?;
        let mut link = RobotLink {
            name: element.required("name")?.to_owned(),
            parent: above.map(|(parent, _)| parent),
            frame: Isometry3::identity(),
            free: false,
            joints: Vec::new(),
            mass: self.inertial(element)?.plus(&of_solids),
            solids,
            touching: Vec::new(),
            place: element.child("inertial").unwrap_or(element).place.clone(),
        };
        for collision in element.all("collision") {
            if !self.contacts {
                self.remarks.add(NOT_ASKED, &named(collision, element));
            } else if let Some((placed, _)) = self.geometry(collision, false)? {
                let (name, surface) = (None, TouchingSurface::default());
                link.touching.push(TouchingSolid { name, placed, surface });
            }
        }
        let Some((_, joint)) = above else { return Ok(link) };
        known::leftovers(joint, joint, self.remarks);
        link.frame = geometry::origin(joint)?;
        self.connect(&mut link, joint)?;
        Ok(link)
    }

    /// What stands beside links and joints.
    fn rest(&mut self) {
        for element in &self.root.children {
            match element.name.as_str() {
                "link" | "joint" => {}
                name if closure::is_loop(name) => {}
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
fn unique<'a>(
    known: &mut BTreeMap<&'a str, &'a XmlElement>,
    element: &'a XmlElement,
) -> Result<()> {
    let name = element.required("name")?;
    if known.insert(name, element).is_some() {
        let kind = &element.name;
        let message = format!("there is another {kind} named `{}`", name.escape_debug());
        return Err(Refusal::at(element.place_of("name"), message, "choose another name"));
    }
    Ok(())
}

/// The link at the end of a joint.
fn end<'a>(
    joint: &'a XmlElement,
    side: &str,
    links: &BTreeMap<&'a str, &'a XmlElement>,
) -> Result<&'a str> {
    let Some(element) = joint.child(side) else {
        let message = format!("the joint has no <{side}>");
        return Err(Refusal::at(&joint.place, message, format!("add <{side} link=\"…\"/>")));
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
    Err(Refusal::at(element.place_of("link"), message, help))
}

/// An element without a name of its own, called after its link.
fn named(element: &XmlElement, link: &XmlElement) -> XmlElement {
    element.with_defaults(link.attributes.as_slice())
}
