//! `<body>`: the tree of links.

use nalgebra::{Isometry3, Matrix3, Unit, Vector3};

use super::geom::{Geom, Geoms};
use super::pose::{orientation, pose};
use super::settings::{Defaults, FileSettings, FromGeoms};
use crate::element::XmlElement;
use crate::mass::ImportedMass;
use crate::remark::{FAR, Remarks};
use crate::robot::{Mobility, NamedFrame, RobotJoint, RobotLink, Servo};
use crate::source::{Refusal, Result};
use crate::surface::{
    FRICTION, GeomPair, GroundPlane, NOT_ASKED, SOFT, TouchingSolid, TouchingSurface,
};

/// Where an element stands: in which link, under which class, in which `<frame>`.
#[derive(Clone)]
struct Context {
    link: Option<usize>,
    class: Option<String>,
    frame: Isometry3<f64>,
    /// Whether the body moves.
    moves: bool,
    /// Whether geoms give the body its mass.
    weighs: bool,
}

/// What is read from `<worldbody>`.
pub(crate) struct Bodies<'a, 'b> {
    pub(crate) geoms: &'a mut Geoms<'b>,
    pub(crate) settings: &'a FileSettings,
    pub(crate) defaults: &'a Defaults,
    pub(crate) remarks: &'a mut Remarks,
    pub(crate) links: Vec<RobotLink>,
    pub(crate) sites: Vec<NamedFrame>,
    /// Names of bodies that are moved from outside.
    pub(crate) mocaps: Vec<String>,
    /// Whether contact is asked for.
    pub(crate) contacts: bool,
    /// Geometry that touches whatever its groups are.
    pub(crate) geom_pairs: &'a [GeomPair],
    pub(crate) planes: Vec<GroundPlane>,
}

impl Bodies<'_, '_> {
    /// Reads what stands in `<worldbody>`.
    pub(crate) fn world(&mut self, world: &XmlElement) -> Result<()> {
        let class = world.word("childclass").map(str::to_owned);
        let scope = Context {
            link: None,
            class,
            frame: Isometry3::identity(),
            moves: false,
            weighs: false,
        };
        let mut geoms = Vec::new();
        self.children(world, &scope, &mut geoms)
    }

    /// What stands in a body or a frame; the geoms are collected.
    fn children(
        &mut self,
        parent: &XmlElement,
        scope: &Context,
        geoms: &mut Vec<Geom>,
    ) -> Result<()> {
        for child in &parent.children {
            match child.name.as_str() {
                "body" => self.body(child, scope)?,
                "frame" => {
                    let frame = scope.frame * pose(child, self.settings)?;
                    let class = child.word("childclass").map(str::to_owned);
                    let class = class.or_else(|| scope.class.clone());
                    self.children(child, &Context { frame, class, ..scope.clone() }, geoms)?;
                }
                "joint" | "freejoint" => self.joint(child, scope)?,
                "geom" => {
                    let element = self.defaults.apply(child, scope.class.as_deref())?;
                    if !self.plane(child, &element, scope)? {
                        let read = self.geoms.geom(&element, scope.weighs, self.remarks)?;
                        if scope.link.is_none() && read.placed.is_some() {
                            self.remarks.add("geometry fixed to the ground: no picture", child);
                        }
                        let surface = self.surface(child, &element, scope)?;
                        let name = child.word("name").map(str::to_owned);
                        geoms.push(Geom { surface, name, ..moved(&read, &scope.frame) });
                    }
                }
                "site" => {
                    let element = self.defaults.apply(child, scope.class.as_deref())?;
                    let pose = scope.frame * pose(&element, self.settings)?;
                    let name = child.word("name").unwrap_or_default().to_owned();
                    self.sites.push(NamedFrame { name, link: scope.link, pose });
                    self.remarks.add(
                        "sites: without a picture; sensors, tendons and loops have their places",
                        child,
                    );
                }
                "inertial" => {}
                "camera" | "light" => self.remarks.add("cameras and lights: not translated", child),
                other => {
                    let message = format!("<{}> in a body: not translated", other.escape_debug());
                    self.remarks.add(message, child);
                }
            }
        }
        Ok(())
    }

    /// A plane of the ground that bodies are to touch; whether it is one.
    fn plane(&mut self, child: &XmlElement, element: &XmlElement, scope: &Context) -> Result<bool> {
        let surface = surface(element)?;
        let is_plane = element.word("type") == Some("plane") && scope.link.is_none();
        let taken = is_plane && self.contacts && surface.groups != [0, 0];
        if taken {
            let name = child.word("name").unwrap_or("floor").to_owned();
            let pose = scope.frame * pose(element, self.settings)?;
            self.planes.push(GroundPlane { name, pose, surface });
        }
        Ok(taken)
    }

    /// Whether a geom is of a pair that is named.
    fn is_paired(&self, child: &XmlElement) -> bool {
        let is =
            |name: &str| self.geom_pairs.iter().any(|pair| pair.geoms.iter().any(|g| g == name));
        child.word("name").is_some_and(is)
    }

    /// How a geom of a body touches planes, where that is asked for.
    fn surface(
        &mut self,
        child: &XmlElement,
        element: &XmlElement,
        scope: &Context,
    ) -> Result<Option<TouchingSurface>> {
        let surface = TouchingSurface { is_paired: self.is_paired(child), ..surface(element)? };
        if surface.groups == [0, 0] && !surface.is_paired {
            return Ok(None);
        }
        if !self.contacts {
            self.remarks.add(NOT_ASKED, child);
            return Ok(None);
        }
        if scope.link.is_none() {
            self.remarks.add("contact with what is fixed to the ground: only planes", child);
        }
        let soft = ["solref", "solimp", "margin", "gap"];
        if soft.iter().any(|name| element.word(name).is_some()) {
            self.remarks.add(SOFT, child);
        }
        Ok(Some(surface))
    }

    fn body(&mut self, element: &XmlElement, scope: &Context) -> Result<()> {
        let number = self.links.len();
        let name = element.word("name").map_or_else(|| format!("body{number}"), str::to_owned);
        self.links.push(RobotLink {
            name,
            parent: scope.link,
            frame: scope.frame * pose(element, self.settings)?,
            free: false,
            joints: Vec::new(),
            mass: ImportedMass::default(),
            solids: Vec::new(),
            touching: Vec::new(),
            place: element.place.clone(),
        });
        if element.flag("mocap") == Some(true) {
            self.mocaps.extend(element.word("name").map(str::to_owned));
        }
        for name in ["mocap", "gravcomp"] {
            if element.word(name).is_some_and(|value| value != "false" && value != "0") {
                self.remarks.add(format!("`{name}` of bodies: not translated"), element);
            }
        }
        let class = element.word("childclass").map(str::to_owned).or_else(|| scope.class.clone());
        let stated = element.child("inertial").is_some();
        let moves = scope.moves || has_joint(element);
        let weighs = match self.settings.from_geoms {
            FromGeoms::Always => true,
            FromGeoms::WhereMissing => !stated,
            FromGeoms::Never => false,
        };
        let (frame, weighs) = (Isometry3::identity(), weighs && moves);
        let inner = Context { link: Some(number), class, frame, moves, weighs };
        let mut geoms = Vec::new();
        self.children(element, &inner, &mut geoms)?;
        let mass = self.mass(element, &geoms)?;
        let link = &mut self.links[number];
        let touching = geoms.iter().filter_map(|geom| {
            let (name, placed) = (geom.name.clone(), geom.placed.clone()?);
            Some(TouchingSolid { name, placed, surface: geom.surface? })
        });
        link.touching = touching.collect();
        link.solids = geoms.into_iter().filter_map(|geom| geom.placed).collect();
        link.mass = mass;
        Ok(())
    }

    /// Mass properties of a body: stated, or those of its geoms.
    fn mass(&mut self, element: &XmlElement, geoms: &[Geom]) -> Result<ImportedMass> {
        let inertial = element.child("inertial");
        let always = self.settings.from_geoms == FromGeoms::Always;
        let stated = match inertial.filter(|_| !always) {
            Some(inertial) => self.inertial(inertial)?,
            None => geoms.iter().fold(ImportedMass::default(), |sum, g| sum.plus(&g.mass)),
        };
        if inertial.is_some() && always {
            let message = "<inertial>: not used, as the compiler takes inertia from geoms";
            self.remarks.add(message, element);
        }
        Ok(self.bounded(stated))
    }

    /// With the least mass and the least moments of inertia of the compiler, and balanced if it
    /// says so.
    fn bounded(&self, mut mass: ImportedMass) -> ImportedMass {
        let FileSettings { least_mass, least_inertia, balance, .. } = *self.settings;
        mass.mass = mass.mass.max(least_mass);
        if least_inertia > 0.0 || balance && mass.least_euler_moment() < 0.0 {
            let mut eigen = mass.inertia().symmetric_eigen();
            eigen.eigenvalues.apply(|moment| *moment = moment.max(least_inertia));
            let [a, b, c]: [f64; 3] = eigen.eigenvalues.into();
            if balance && (a + b < c || b + c < a || c + a < b) {
                eigen.eigenvalues.fill((a + b + c) / 3.0);
            }
            mass.J = eigen.recompose();
        }
        mass
    }

    /// `<inertial>`: `diaginertia` about the axes of its orientation, or `fullinertia`.
    fn inertial(&self, element: &XmlElement) -> Result<ImportedMass> {
        let mass = element.amount("mass")?;
        let center = Vector3::from(element.vector::<3>("pos")?.unwrap_or_default());
        let frame = Isometry3::from_parts(center.into(), orientation(element, self.settings)?);
        let tensor = match element.vector::<6>("fullinertia")? {
            Some([xx, yy, zz, xy, xz, yz]) => Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            None => {
                let moments = element.vector::<3>("diaginertia")?.unwrap_or_default();
                Matrix3::from_diagonal(&moments.into())
            }
        };
        Ok(ImportedMass { mass, center: Vector3::zeros(), J: tensor }.moved(&frame))
    }

    fn joint(&mut self, child: &XmlElement, scope: &Context) -> Result<()> {
        let Some(link) = scope.link else {
            let help = "put the joint into a <body>";
            return Err(Refusal::at(&child.place, "the world has no joints", help));
        };
        let element = self.defaults.apply(child, scope.class.as_deref())?;
        let kind = match (child.name.as_str(), element.word("type").unwrap_or("hinge")) {
            ("freejoint", _) | (_, "free") => {
                if child.name == "joint" && element.amount("armature")? != 0.0 {
                    self.remarks.add("armature of a free joint: not translated", child);
                }
                return self.free(link, child);
            }
            (_, "hinge") => Mobility::Hinge,
            (_, "slide") => Mobility::Slide,
            (_, "ball") => Mobility::Ball,
            (_, other) => {
                let message = format!("`{}` is no type of a joint", other.escape_debug());
                let help = "there are: hinge, slide, ball, free";
                return Err(Refusal::at(element.place_of("type"), message, help));
            }
        };
        let joint = self.coordinate(&element, kind, scope)?;
        let link = &mut self.links[link];
        if link.free {
            let message = "a body that moves freely has no other joints";
            return Err(Refusal::at(&child.place, message, "remove the joint"));
        }
        link.joints.push(joint);
        Ok(())
    }

    fn free(&mut self, link: usize, child: &XmlElement) -> Result<()> {
        let link = &mut self.links[link];
        if !link.joints.is_empty() || link.parent.is_some() {
            let message = "a free joint is the only joint of a body of <worldbody>";
            return Err(Refusal::at(
                &child.place,
                message,
                "remove the other joint, or write another type",
            ));
        }
        link.free = true;
        Ok(())
    }

    fn coordinate(
        &mut self,
        element: &XmlElement,
        kind: Mobility,
        scope: &Context,
    ) -> Result<RobotJoint> {
        let axis = Vector3::from(element.vector::<3>("axis")?.unwrap_or([0.0, 0.0, 1.0]));
        let axis = Unit::try_new(scope.frame.rotation * axis, 1e-14).ok_or_else(|| {
            Refusal::at(
                element.place_of("axis"),
                "the axis has no direction",
                "write axis=\"0 0 1\"",
            )
        })?;
        let point = Vector3::from(element.vector::<3>("pos")?.unwrap_or_default());
        let number = |name: &str| Ok(element.number(name)?.unwrap_or(0.0));
        let angle = |x: f64| if kind == Mobility::Hinge { self.settings.angle(x) } else { x };
        let (reference, rest) = (angle(number("ref")?), angle(number("springref")?));
        let acts = |yes: bool, amounts: [f64; 3]| if yes { amounts } else { [0.0; 3] };
        let stiffness = acts(self.settings.springs, coefficients(element, "stiffness")?);
        let damping = acts(self.settings.dampers, coefficients(element, "damping")?);
        let armature = self.beside(element, kind)?;
        let limits = self.limits(element, kind)?.map(|own| own.map(angle));
        let friction = self.friction(element, kind)?;
        Ok(RobotJoint {
            name: element.word("name").map_or_else(|| self.unnamed(scope), str::to_owned),
            kind,
            axis,
            anchor: scope.frame.transform_point(&point.into()).coords,
            reference,
            value: 0.0,
            damping,
            stiffness,
            rest,
            limits,
            friction,
            armature: [armature, 0.0, 0.0],
            servo: Servo::default(),
            in_tendon: false,
            place: element.place.clone(),
        })
    }

    /// A name for a joint without one: that of its link, and its number.
    fn unnamed(&self, scope: &Context) -> String {
        let link = scope.link.and_then(|k| self.links.get(k));
        link.map_or_else(String::new, |l| format!("{}_joint{}", l.name, l.joints.len() + 1))
    }

    /// `range`, as it is stated.
    fn limits(&mut self, element: &XmlElement, kind: Mobility) -> Result<[Option<f64>; 2]> {
        let Some([lower, upper]) = element.vector::<2>("range")? else { return Ok([None; 2]) };
        if element.word("limited") == Some("false") {
            return Ok([None; 2]);
        }
        if kind == Mobility::Ball {
            self.remarks.add(crate::remark::LIMITS_OF_SEVERAL, element);
            return Ok([None; 2]);
        }
        if lower >= upper {
            self.remarks.add(crate::remark::EMPTY_LIMITS, element);
            return Ok([None; 2]);
        }
        if ["solreflimit", "solimplimit", "margin"].iter().any(|n| element.word(n).is_some()) {
            let message = "limits of joints: stops are rigid, `solreflimit`, `solimplimit` and `margin` are not used";
            self.remarks.add(message, element);
        }
        Ok([lower, upper].map(|limit| Some(limit).filter(|x| x.abs() < FAR)))
    }

    /// `frictionloss`.
    fn friction(&mut self, element: &XmlElement, kind: Mobility) -> Result<f64> {
        let friction = element.amount("frictionloss")?;
        if friction != 0.0 && kind == Mobility::Ball {
            self.remarks.add(crate::remark::FRICTION_OF_SEVERAL, element);
            return Ok(0.0);
        }
        Ok(friction)
    }

    /// The armature of a joint; remarks on what acts in it beside spring and damper.
    fn beside(&mut self, element: &XmlElement, kind: Mobility) -> Result<f64> {
        let armature = element.amount("armature")?;
        if armature != 0.0 && kind == Mobility::Ball {
            self.remarks.add("armature of a ball joint: not translated", element);
        }
        if element.word("springdamper").is_some() {
            self.remarks.add("`springdamper` of joints: not translated", element);
        }
        Ok(if kind == Mobility::Ball { 0.0 } else { armature })
    }
}

/// The coefficients of a spring or damper, a polynomial, of joints and tendons.
pub(super) fn coefficients(element: &XmlElement, name: &str) -> Result<[f64; 3]> {
    let values = element.numbers(name)?.unwrap_or_default();
    let first = values.first().copied().unwrap_or(0.0);
    if first < 0.0 {
        let message = format!("`{name}` is {first}: it would feed energy in");
        return Err(Refusal::at(element.place_of(name), message, "write 0 or more"));
    }
    Ok([0, 1, 2].map(|k| values.get(k).copied().unwrap_or(0.0)))
}

/// Friction and groups of a geom.
fn surface(element: &XmlElement) -> Result<TouchingSurface> {
    let friction = element.numbers("friction")?.and_then(|all| all.first().copied());
    let bits = |name: &str| -> Result<u32> {
        Ok(element.number(name)?.map_or(1, |own| own as i64 as u32))
    };
    let surface = TouchingSurface {
        friction: friction.unwrap_or(FRICTION),
        groups: [bits("contype")?, bits("conaffinity")?],
        is_paired: false,
    };
    if surface.friction < 0.0 {
        let message = format!("`friction` is {}: it is negative", surface.friction);
        return Err(Refusal::at(element.place_of("friction"), message, "write 0 or more"));
    }
    Ok(surface)
}

/// Whether a body has a joint, in a frame or not.
fn has_joint(element: &XmlElement) -> bool {
    element.children.iter().any(|child| match child.name.as_str() {
        "joint" | "freejoint" => true,
        "frame" => has_joint(child),
        _ => false,
    })
}

fn moved(geom: &Geom, frame: &Isometry3<f64>) -> Geom {
    let placed = geom.placed.as_ref().map(|placed| placed.moved(frame));
    Geom { placed, mass: geom.mass.moved(frame), surface: geom.surface, name: geom.name.clone() }
}
