//! MJCF: bodies in each other, with joints and geoms.
//!
//! Source: the XML reference of MuJoCo, mujoco.readthedocs.io.

mod actuator;
mod body;
mod equality;
mod geom;
pub(crate) mod include;
mod pose;
mod replicate;
mod sensor;
mod settings;
mod tendon;

use std::collections::BTreeMap;

use body::Bodies;
use equality::Equalities;
use geom::{Geoms, MeshFile};
use settings::{Defaults, FileSettings};
use tendon::Tendons;

use crate::ImportOptions;
use crate::element::XmlElement;
use crate::mesh::MeshCache;
use crate::remark::Remarks;
use crate::robot::{NamedFrame, Robot, RobotLink};
use crate::source::{FilePlace, Refusal, Result};
use crate::surface::{Exclusion, GeomPair, NOT_ASKED, SOFT};

/// Reads a robot from the root element `<mujoco>`.
pub(crate) fn robot(
    root: &XmlElement,
    options: &ImportOptions,
    meshes: &mut MeshCache,
    remarks: &mut Remarks,
) -> Result<Robot> {
    let settings = FileSettings::read(root, remarks)?;
    let root = &replicate::expand(root, &settings)?;
    let defaults = Defaults::read(root)?;
    let files = files(root, &defaults)?;
    let mut geoms = Geoms { settings: &settings, files, meshes, unread: Vec::new() };
    let geom_pairs = geom_pairs(root, &defaults, options.contacts, remarks)?;
    let mut bodies = Bodies {
        geoms: &mut geoms,
        settings: &settings,
        defaults: &defaults,
        remarks,
        links: Vec::new(),
        sites: Vec::new(),
        mocaps: Vec::new(),
        contacts: options.contacts,
        geom_pairs: &geom_pairs,
        planes: Vec::new(),
    };
    root.all("worldbody").try_for_each(|world| bodies.world(world))?;
    let Bodies { mut links, sites, mocaps, planes, .. } = bodies;
    let unread = geoms.unread;
    unique_names(&links)?;
    let mut tendons = Tendons::read(root, &defaults, &mut links, &sites, remarks)?;
    let known = (links.as_mut_slice(), &mut tendons, &defaults);
    actuator::servos(root, known, options.actuators, remarks)?;
    if links.is_empty() {
        let help = "a model of MuJoCo has <body> in <worldbody>";
        return Err(Refusal::at(&root.place, "the model has no body", help));
    }
    let (loops, gears) = (Vec::new(), Vec::new());
    let mut equalities = Equalities {
        links: &links,
        names: links.iter().enumerate().map(|(k, link)| (link.name.as_str(), k)).collect(),
        joints: links.iter().flat_map(|l| &l.joints).map(|j| j.name.as_str()).collect(),
        sites: sites.iter().map(|site| (site.name.as_str(), site)).collect(),
        mocaps: &mocaps,
        defaults: &defaults,
        remarks,
        loops,
        gears,
    };
    equalities.read(root)?;
    let Equalities { loops, gears, .. } = equalities;
    let gauges = sensor::Named::new(&links, &sites).gauges(root, &mut tendons, remarks)?;
    rest(root, options.contacts, remarks);
    if let Some(total) = settings.total_mass {
        scale(&mut links, total);
    }
    let bodies = links.iter().enumerate().map(|(k, link)| NamedFrame::of_link(k, link));
    let frames = bodies.chain(sites.into_iter().filter(|site| !site.name.is_empty())).collect();
    Ok(Robot {
        name: root.word("model").unwrap_or("MuJoCo model").to_owned(),
        format: "MJCF",
        gravity: settings.gravity,
        step: settings.step,
        links,
        loops,
        gears,
        gauges,
        tendons: tendons.all,
        frames,
        unread,
        planes,
        exclusions: exclusions(root, options.contacts)?,
        geom_pairs,
        shapes_without_mass: Vec::new(),
    })
}

/// `<pair>` of `<contact>`.
fn geom_pairs(
    root: &XmlElement,
    defaults: &Defaults,
    contacts: bool,
    remarks: &mut Remarks,
) -> Result<Vec<GeomPair>> {
    let mut pairs = Vec::new();
    for pair in root.all("contact").flat_map(|own| own.all("pair")).filter(|_| contacts) {
        let element = defaults.apply(pair, None)?;
        let geoms = [element.required("geom1")?.to_owned(), element.required("geom2")?.to_owned()];
        let friction = element.numbers("friction")?.and_then(|own| own.first().copied());
        if let Some(friction) = friction.filter(|own| *own < 0.0) {
            let message = format!("`friction` is {friction}: it is negative");
            return Err(Refusal::at(element.place_of("friction"), message, "write 0 or more"));
        }
        let soft = ["solref", "solimp", "margin", "gap", "solreffriction"];
        if soft.iter().any(|name| element.word(name).is_some()) {
            remarks.add(SOFT, pair);
        }
        pairs.push(GeomPair { geoms, friction });
    }
    Ok(pairs)
}

/// `<exclude>` of `<contact>`.
fn exclusions(root: &XmlElement, contacts: bool) -> Result<Vec<Exclusion>> {
    let all = root.all("contact").flat_map(|own| own.all("exclude")).filter(|_| contacts);
    let names = |own: &XmlElement| {
        Ok(Exclusion([own.required("body1")?.to_owned(), own.required("body2")?.to_owned()]))
    };
    all.map(names).collect()
}

/// The files of meshes, by the names of the meshes.
fn files(root: &XmlElement, defaults: &Defaults) -> Result<BTreeMap<String, MeshFile>> {
    let mut files = BTreeMap::new();
    for mesh in root.all("asset").flat_map(|asset| asset.all("mesh")) {
        let element = defaults.apply(mesh, None)?;
        let Some(file) = element.word("file") else { continue };
        let stem = std::path::Path::new(file).file_stem().unwrap_or_default();
        let name = element.word("name").map_or_else(|| stem.display().to_string(), str::to_owned);
        let scale = element.vector::<3>("scale")?.unwrap_or([1.0; 3]);
        let moved = element.word("refpos").is_some() || element.word("refquat").is_some();
        let inertia = element.word("inertia").unwrap_or("legacy").to_owned();
        files.insert(name, MeshFile { file: file.to_owned(), scale, moved, inertia });
    }
    Ok(files)
}

/// Scales all masses to a sum, kg.
fn scale(links: &mut [RobotLink], total: f64) {
    let sum: f64 = links.iter().map(|l| l.mass.mass).sum();
    if sum > 0.0 {
        links.iter_mut().for_each(|link| link.mass = link.mass.scaled(total / sum));
    }
}

/// Names of bodies, and of joints, are unique.
fn unique_names(links: &[RobotLink]) -> Result<()> {
    let bodies = links.iter().map(|l| ("body", l.name.as_str(), &l.place));
    let joints = links.iter().flat_map(|l| &l.joints);
    let joints = joints.map(|j| ("joint", j.name.as_str(), &j.place));
    let mut known: BTreeMap<(&str, &str), &FilePlace> = BTreeMap::new();
    for (kind, name, place) in bodies.chain(joints) {
        if known.insert((kind, name), place).is_some() {
            let message = format!("there is another {kind} named `{}`", name.escape_debug());
            return Err(Refusal::at(place, message, "choose another name"));
        }
    }
    Ok(())
}

/// Remarks on the sections that have no counterpart.
fn rest(root: &XmlElement, contacts: bool, remarks: &mut Remarks) {
    for section in &root.children {
        let message = match section.name.as_str() {
            "compiler" | "option" | "default" | "worldbody" | "equality" | "actuator"
            | "tendon" | "sensor" | "size" | "statistic" => {
                continue;
            }
            "asset" | "visual" => {
                remarks.add("textures, materials and views: not translated", section);
                continue;
            }
            "keyframe" => "keyframes: not translated; `--joint NAME=VALUE` states initial values",
            "contact" if contacts => continue,
            "contact" => NOT_ASKED,
            "custom" => "custom data: not translated",
            "deformable" | "skin" => "deformable bodies: not translated",
            other => {
                let message = format!("<{}>: not translated", other.escape_debug());
                remarks.add(message, section);
                continue;
            }
        };
        section.children.iter().for_each(|child| remarks.add(message, child));
    }
}
