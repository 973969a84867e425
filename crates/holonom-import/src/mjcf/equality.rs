//! `<equality>`: loops and joints that follow others. In MuJoCo they yield; in the model they are
//! rigid.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Vector3};

use super::settings::Defaults;
use crate::element::XmlElement;
use crate::remark::Remarks;
use crate::robot::{Gear, LoopJoint, LoopJointKind, NamedFrame, RobotLink, in_space};
use crate::source::{Refusal, Result};

/// What is read from `<equality>`.
pub(crate) struct Equalities<'a> {
    pub(crate) links: &'a [RobotLink],
    /// Links by name.
    pub(crate) names: BTreeMap<&'a str, usize>,
    pub(crate) joints: BTreeSet<&'a str>,
    pub(crate) sites: BTreeMap<&'a str, &'a NamedFrame>,
    pub(crate) mocaps: &'a [String],
    pub(crate) defaults: &'a Defaults,
    pub(crate) remarks: &'a mut Remarks,
    pub(crate) loops: Vec<LoopJoint>,
    pub(crate) gears: Vec<Gear>,
}

impl Equalities<'_> {
    /// Reads all equalities of a file.
    pub(crate) fn read(&mut self, root: &XmlElement) -> Result<()> {
        for child in root.all("equality").flat_map(|e| &e.children) {
            let element = self.defaults.apply(child, None)?;
            if element.flag("active") == Some(false) {
                self.remarks.add("equalities that are not active: left out", child);
                continue;
            }
            let ends = ["body1", "body2"].map(|end| element.word(end));
            if ends.into_iter().flatten().any(|name| self.mocaps.iter().any(|m| m == name)) {
                self.remarks.add("welds to bodies that are moved from outside: left out", child);
                continue;
            }
            match child.name.as_str() {
                "connect" | "weld" => self.closure(&element)?,
                "joint" => self.gear(&element)?,
                other => {
                    let message =
                        format!("<{}> in <equality>: not translated", other.escape_debug());
                    self.remarks.add(message, child);
                    continue;
                }
            }
            self.remarks.add("equalities: rigid in the model (solref, solimp are not used)", child);
        }
        Ok(())
    }

    fn closure(&mut self, element: &XmlElement) -> Result<()> {
        let weld = element.name == "weld";
        let relpose = element.vector::<7>("relpose")?.unwrap_or_default();
        if weld && relpose[3..].iter().any(|x| *x != 0.0) {
            self.remarks.add("`relpose` of a weld: the initial pose is kept instead", element);
        }
        let (ends, frames) = match (element.word("site1"), element.word("site2")) {
            (Some(first), Some(second)) => {
                let [a, b] = [self.site(element, first)?, self.site(element, second)?];
                ([a.link, b.link], [a.pose, b.pose])
            }
            _ => {
                let first = self.link(element, "body1")?;
                let second = self.link(element, "body2")?;
                let anchor = Vector3::from(element.vector::<3>("anchor")?.unwrap_or_default());
                let anchor = Isometry3::from(anchor);
                // the anchor belongs to body 1 of a connect and to body 2 of a weld
                let (own, other) = if weld { (second, first) } else { (first, second) };
                let there = self.pose(other).inverse() * (self.pose(own) * anchor);
                let frames = if weld { [there, anchor] } else { [anchor, there] };
                ([first, second], frames)
            }
        };
        let name = element.word("name").map_or_else(|| element.name.clone(), str::to_owned);
        let kind = if weld { LoopJointKind::Fixed } else { LoopJointKind::Spherical };
        let (axis, place) = (Vector3::z_axis(), element.place.clone());
        self.loops.push(LoopJoint { name, ends, frames, axis, kind, place });
        Ok(())
    }

    /// The pose of a link in space as the description draws it.
    fn pose(&self, link: Option<usize>) -> Isometry3<f64> {
        in_space(self.links, link, Isometry3::identity(), |link| link.frame)
    }

    /// The link that an attribute names; the ground without it.
    fn link(&self, element: &XmlElement, attribute: &str) -> Result<Option<usize>> {
        let Some(name) = element.word(attribute).filter(|name| *name != "world") else {
            return Ok(None);
        };
        let found = self.names.get(name).copied();
        found.map(Some).ok_or_else(|| missing(element, attribute, "body", name))
    }

    fn site(&self, element: &XmlElement, name: &str) -> Result<&NamedFrame> {
        self.sites.get(name).copied().ok_or_else(|| missing(element, "site1", "site", name))
    }

    /// `y − y_0 = a_0 + a_1 (x − x_0) + …`: joint 1 follows joint 2.
    fn gear(&mut self, element: &XmlElement) -> Result<()> {
        let joint = element.required("joint1")?;
        let of = element.word("joint2");
        for name in [Some(joint), of].into_iter().flatten() {
            if !self.joints.contains(name) {
                return Err(missing(element, "joint1", "joint", name));
            }
        }
        let coefficients = element.numbers("polycoef")?.unwrap_or_else(|| vec![0.0, 1.0]);
        let at = |k: usize| coefficients.get(k).copied().unwrap_or(0.0);
        if (2..5).any(|k| at(k) != 0.0) && of.is_some() {
            self.remarks.add("nonlinear relations of joints: not translated", element);
            return Ok(());
        }
        let name = element.word("name").map_or_else(|| format!("{joint}_gear"), str::to_owned);
        self.gears.push(Gear {
            name,
            joint: joint.to_owned(),
            of: of.map(str::to_owned),
            offset: at(0),
            factor: at(1),
            place: element.place.clone(),
        });
        Ok(())
    }
}

pub(super) fn missing(element: &XmlElement, attribute: &str, kind: &str, name: &str) -> Refusal {
    let message = format!("there is no {kind} named `{}`", name.escape_debug());
    Refusal::at(element.place_of(attribute), message, format!("name a {kind} of the description"))
}
