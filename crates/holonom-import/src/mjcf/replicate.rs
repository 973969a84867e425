//! `<replicate>`: copies of what stands in it, each in the frame that follows from the one before.
//!
//! ```text
//! P_k = (T(offset) R(euler))ᵏ          the frame of copy k = 0, 1, …
//! ```
//! Names in copy `k` end with `sep` and the number `k`, with as many digits as the count has.
//! Equalities that name what is copied are copied with it.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Vector3};

use super::pose::orientation;
use super::settings::FileSettings;
use crate::element::{Attribute, MAX_ELEMENTS, XmlElement};
use crate::source::{FilePlace, Refusal, Result};

/// Attributes of equalities that name bodies, joints or sites.
const REFERENCES: [&str; 6] = ["body1", "body2", "joint1", "joint2", "site1", "site2"];

/// The description with copies in the place of each `<replicate>`.
pub(super) fn expand(root: &XmlElement, settings: &FileSettings) -> Result<XmlElement> {
    let mut expansion = Replication { settings, copied: Vec::new(), elements: 0 };
    let mut root = root.clone();
    for world in root.children.iter_mut().filter(|c| c.name == "worldbody") {
        world.children = expansion.children(std::mem::take(&mut world.children))?;
    }
    for equality in root.children.iter_mut().filter(|c| c.name == "equality") {
        for copied in &expansion.copied {
            let before = std::mem::take(&mut equality.children);
            for element in before {
                copied.constraint(element, &mut equality.children);
            }
        }
    }
    Ok(root)
}

struct Replication<'a> {
    settings: &'a FileSettings,
    copied: Vec<Copied>,
    /// Of all copies.
    elements: usize,
}

/// What one `<replicate>` copies.
struct Copied {
    names: BTreeSet<String>,
    separator: String,
    count: usize,
}

impl Replication<'_> {
    fn children(&mut self, children: Vec<XmlElement>) -> Result<Vec<XmlElement>> {
        let mut out = Vec::with_capacity(children.len());
        for mut child in children {
            let inner = std::mem::take(&mut child.children);
            child.children = self.children(inner)?;
            match child.name == "replicate" {
                true => self.copies(&child, &mut out)?,
                false => out.push(child),
            }
        }
        Ok(out)
    }

    fn copies(&mut self, element: &XmlElement, out: &mut Vec<XmlElement>) -> Result<()> {
        let count = element.amount("count")?;
        let size: usize = element.children.iter().map(XmlElement::size).sum();
        self.elements = self.elements.saturating_add((count as usize).saturating_mul(size + 1));
        if count < 1.0 || count.fract() != 0.0 || self.elements > MAX_ELEMENTS {
            let message = format!("`count` is {count}: no count of copies, or too many elements");
            return Err(Refusal::at(element.place_of("count"), message, "write count=\"4\""));
        }
        let copied = Copied {
            names: element.children.iter().flat_map(names).collect(),
            separator: element.word("sep").unwrap_or_default().to_owned(),
            count: count as usize,
        };
        let offset = Vector3::from(element.vector::<3>("offset")?.unwrap_or_default());
        let step = Isometry3::from_parts(offset.into(), orientation(element, self.settings)?);
        let mut pose = Isometry3::identity();
        for k in 0..copied.count {
            let mut children = element.children.clone();
            children.iter_mut().for_each(|child| copied.rename(child, k));
            out.push(frame(&pose, children, &element.place));
            pose *= step;
        }
        self.copied.push(copied);
        Ok(())
    }
}

impl Copied {
    fn name(&self, name: &str, k: usize) -> String {
        let digits = self.count.to_string().len();
        format!("{name}{}{k:0digits$}", self.separator)
    }

    fn rename(&self, element: &mut XmlElement, k: usize) {
        for attribute in element.attributes.iter_mut().filter(|a| a.name == "name") {
            attribute.value = self.name(&attribute.value, k);
        }
        element.children.iter_mut().for_each(|child| self.rename(child, k));
    }

    /// A constraint, or its copies if it names what is copied.
    fn constraint(&self, element: XmlElement, out: &mut Vec<XmlElement>) {
        let refers =
            |a: &Attribute| REFERENCES.contains(&a.name.as_str()) && self.names.contains(&a.value);
        if !element.attributes.iter().any(refers) {
            out.push(element);
            return;
        }
        for k in 0..self.count {
            let mut copy = element.clone();
            for attribute in &mut copy.attributes {
                if refers(attribute) || attribute.name == "name" {
                    attribute.value = self.name(&attribute.value, k);
                }
            }
            out.push(copy);
        }
    }
}

/// The names in an element.
fn names(element: &XmlElement) -> Vec<String> {
    let own = element.word("name").map(str::to_owned);
    own.into_iter().chain(element.children.iter().flat_map(names)).collect()
}

/// `<frame>` with these elements.
fn frame(pose: &Isometry3<f64>, children: Vec<XmlElement>, place: &FilePlace) -> XmlElement {
    let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
    let attribute = |name: &str, numbers: &[f64]| Attribute {
        name: name.to_owned(),
        value: numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" "),
        place: place.clone(),
    };
    let attributes =
        vec![attribute("pos", &[p.x, p.y, p.z]), attribute("quat", &[q.w, q.i, q.j, q.k])];
    XmlElement { name: "frame".to_owned(), attributes, children, place: place.clone() }
}
