//! Loops of the dialects of URDF: `<loop_joint>`, `<loop>`, `<constraint>`.
//!
//! Each names two links and a place in either: `<link1 link xyz rpy>` and `<link2 …>`,
//! `<predecessor link>` and `<successor link>` with `<origin>` in them or as `<predecessor_origin>`
//! beside them, or the same with `parent` and `child`.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};

use super::UrdfReader;
use super::geometry::pose;
use super::joint::direction;
use crate::element::XmlElement;
use crate::robot::{LoopJoint, LoopJointKind, RobotLink};
use crate::source::Result;

/// What closes a loop in some dialect.
pub(super) const NAMES: [&str; 4] = ["loop_joint", "loop", "constraint", "closed_loop"];

/// What names a link at the end of a loop.
const ENDS: [&str; 10] = [
    "link1",
    "link2",
    "predecessor",
    "successor",
    "parent",
    "child",
    "body1",
    "body2",
    "link_a",
    "link_b",
];

impl UrdfReader<'_> {
    /// All loops; a remark on each that is not understood.
    pub(super) fn closures(&mut self, links: &[RobotLink]) -> Result<Vec<LoopJoint>> {
        let names: BTreeMap<&str, usize> =
            links.iter().enumerate().map(|(k, link)| (link.name.as_str(), k)).collect();
        let mut closures = Vec::new();
        for element in self.root.children.iter().filter(|e| is_loop(&e.name)) {
            match closure(element, &names)? {
                Some(closure) => {
                    let message = "loops are closed by rigid joints";
                    self.remarks.add(message, element);
                    closures.push(closure);
                }
                None => {
                    let message = format!(
                        "<{}> that does not name two links and a type of this list: spherical, revolute, continuous, prismatic, fixed: not translated; `--close A=B` closes a loop",
                        element.name
                    );
                    self.remarks.add(message, element);
                }
            }
        }
        Ok(closures)
    }
}

/// Whether an element of this name closes a loop, with a prefix or without.
pub(super) fn is_loop(name: &str) -> bool {
    NAMES.contains(&name.rsplit(':').next().unwrap_or_default())
}

fn closure(element: &XmlElement, links: &BTreeMap<&str, usize>) -> Result<Option<LoopJoint>> {
    let kind = match element.word("type").unwrap_or("spherical") {
        "spherical" | "ball" | "point" | "connect" | "loop" => LoopJointKind::Spherical,
        "revolute" | "continuous" | "hinge" => LoopJointKind::Revolute,
        "prismatic" => LoopJointKind::Prismatic,
        "fixed" | "weld" => LoopJointKind::Fixed,
        _ => return Ok(None),
    };
    let link = |name: &str| links.get(name).copied();
    let mut found = Vec::new();
    for end in element.children.iter().filter(|c| ENDS.contains(&c.name.as_str())) {
        let named = end.word("link").or_else(|| end.word("body")).or_else(|| end.word("name"));
        let Some(link) = named.and_then(link) else { return Ok(None) };
        let beside = element.child(&format!("{}_origin", end.name));
        let stated = end.child("origin").or(beside).unwrap_or(end);
        found.push((link, pose(stated)?));
    }
    if found.is_empty() {
        let stated = ENDS.iter().filter_map(|end| element.word(end)).map(link);
        let Some(stated) = stated.collect::<Option<Vec<usize>>>() else { return Ok(None) };
        found.extend(stated.into_iter().map(|link| (link, Isometry3::identity())));
    }
    let [(first, mut at_first), (second, at_second)] = found[..] else { return Ok(None) };
    if let Some(origin) = element.child("origin") {
        at_first = pose(origin)?;
    }
    let axis = match element.child("axis") {
        Some(axis) => at_first.rotation * direction(axis)?,
        None => at_first.rotation * Vector3::x_axis(),
    };
    let name = element.word("name").map_or_else(|| element.name.clone(), str::to_owned);
    Ok(Some(LoopJoint {
        name,
        ends: [Some(first), Some(second)],
        frames: [at_first, at_second],
        axis,
        kind,
        place: element.place.clone(),
    }))
}
