//! `<tendon>`: lengths that springs, dampers, servos and sensors act along or read.
//!
//! ```text
//! fixed    l = Σ coef q          spatial    l = Σ |p_{k+1} − p_k| / divisor
//! ```
//! Source: the XML reference of MuJoCo, mujoco.readthedocs.io.

use super::body::coefficients;
use super::equality::missing;
use super::settings::Defaults;
use crate::element::XmlElement;
use crate::remark::Remarks;
use crate::robot::{
    LengthPath, NamedFrame, RobotJoint, RobotLink, Servo, ServoElasticity, Tendon, in_space,
};
use crate::source::{Refusal, Result};

const WRAPPED: &str = "tendons around geometry: not translated";
const BESIDE: &str = "limits, friction and inertia of tendons: not translated";

/// The number that says that the rest is that of the joints.
const AT_REST: f64 = -1.0;

const LEAST_DIVISOR: f64 = 1e-6;

/// The tendons of a file.
#[derive(Debug, Default)]
pub(super) struct Tendons {
    pub(super) all: Vec<Tendon>,
}

impl Tendons {
    /// Reads `<tendon>`, and marks the joints that tendons read.
    pub(super) fn read(
        root: &XmlElement,
        defaults: &Defaults,
        links: &mut [RobotLink],
        sites: &[NamedFrame],
        remarks: &mut Remarks,
    ) -> Result<Self> {
        let mut own = Self::default();
        for child in root.all("tendon").flat_map(|own| &own.children) {
            let element = defaults.apply_as("tendon", child, None)?;
            let path = match child.name.as_str() {
                "fixed" => joints(child, links)?,
                "spatial" => points(child, sites)?,
                _ => LengthPath::Other,
            };
            if matches!(path, LengthPath::Other) {
                remarks.add(WRAPPED, child);
            }
            let beside = ["range", "frictionloss", "armature"];
            if beside.iter().any(|name| element.word(name).is_some()) {
                remarks.add(BESIDE, child);
            }
            let rest = element.numbers("springlength")?.unwrap_or_default();
            let rest = match rest[..] {
                [lower, upper] if lower <= upper => [lower, upper],
                [only] if only.to_bits() != AT_REST.to_bits() => [only; 2],
                [] | [_] => [length(&path, links); 2],
                _ => {
                    let message = "`springlength` has no order";
                    let help = "write one length, or the shorter and the longer one";
                    return Err(Refusal::at(element.place_of("springlength"), message, help));
                }
            };
            own.all.push(Tendon {
                name: child.word("name").unwrap_or("tendon").to_owned(),
                path,
                elastic: ServoElasticity {
                    stiffness: coefficients(&element, "stiffness")?,
                    damping: coefficients(&element, "damping")?,
                    rest,
                },
                servo: Servo::default(),
                is_read: false,
                label: child.label(),
                place: child.place.clone(),
            });
        }
        Ok(own)
    }

    /// The tendon of a name.
    pub(super) fn named(&mut self, name: &str) -> Option<&mut Tendon> {
        self.all.iter_mut().find(|tendon| tendon.name == name)
    }
}

/// The path of a fixed tendon.
fn joints(tendon: &XmlElement, links: &mut [RobotLink]) -> Result<LengthPath> {
    let mut terms = Vec::new();
    for child in tendon.all("joint") {
        let name = child.required("joint")?;
        let mut all = links.iter_mut().flat_map(|link| &mut link.joints);
        let joint = all.find(|joint| joint.name == name);
        let joint = joint.ok_or_else(|| missing(child, "joint", "joint", name))?;
        if !joint.kind.is_single() {
            let message = format!("joint `{}` has not one coordinate", name.escape_debug());
            let help = "name a hinge or a slide";
            return Err(Refusal::at(child.place_of("joint"), message, help));
        }
        joint.in_tendon = true;
        let factor = child.required("coef").and(child.number("coef"))?;
        terms.push((name.to_owned(), factor.unwrap_or_default()));
    }
    Ok(LengthPath::Joints(terms))
}

/// The path of a spatial tendon.
fn points(tendon: &XmlElement, sites: &[NamedFrame]) -> Result<LengthPath> {
    let (mut parts, mut last, mut divisor) = (Vec::new(), None, 1.0);
    for child in &tendon.children {
        match child.name.as_str() {
            "site" => {
                let name = child.required("site")?;
                let site = sites.iter().find(|site| site.name == name);
                let site = site.ok_or_else(|| missing(child, "site", "site", name))?;
                if let Some(before) = last.replace(site.clone()) {
                    parts.push(([before, site.clone()], 1.0 / divisor));
                }
            }
            "pulley" => {
                divisor = child.number("divisor")?.unwrap_or(1.0);
                if divisor < LEAST_DIVISOR {
                    let message = format!("`divisor` is {divisor}");
                    let help = "write a positive number, such as 2";
                    return Err(Refusal::at(child.place_of("divisor"), message, help));
                }
                last = None;
            }
            _ => return Ok(LengthPath::Other),
        }
    }
    Ok(LengthPath::Points(parts))
}

/// The length where no spring of a joint has a force.
fn length(path: &LengthPath, links: &[RobotLink]) -> f64 {
    let rest = |name: &str| {
        let mut joints = links.iter().flat_map(|link| &link.joints);
        joints.find(|joint| joint.name == name).map_or(0.0, |joint| joint.rest)
    };
    let place = |site: &NamedFrame| {
        let moved = |pose, joint: &RobotJoint| joint.moved_by(&pose, joint.rest - joint.reference);
        let placed = |link: &RobotLink| link.joints.iter().fold(link.frame, moved);
        in_space(links, site.link, site.pose, placed).translation.vector
    };
    match path {
        LengthPath::Joints(terms) => terms.iter().map(|(name, factor)| factor * rest(name)).sum(),
        LengthPath::Points(parts) => {
            let part = |([from, to], factor): &([NamedFrame; 2], f64)| {
                factor * (place(to) - place(from)).norm()
            };
            parts.iter().map(part).sum()
        }
        LengthPath::Other => 0.0,
    }
}
