//! What URDF knows: remarks on attributes and elements that no specification of it has, so that
//! nothing is dropped silently.

use crate::element::XmlElement;
use crate::remark::Remarks;

/// Attributes and elements of an element of a link or a joint; `None` where its content plays no
/// part in the translation.
fn known(name: &str) -> Option<(&'static [&'static str], &'static [&'static str])> {
    Some(match name {
        "link" => (&["name", "type"], &["inertial", "visual", "collision"]),
        "joint" => (
            &["name", "type"],
            &[
                "parent",
                "child",
                "origin",
                "axis",
                "calibration",
                "dynamics",
                "limit",
                "mimic",
                "safety_controller",
            ],
        ),
        "inertial" => (&[], &["origin", "mass", "inertia"]),
        "visual" => (&["name"], &["origin", "geometry", "material"]),
        "geometry" => (&[], &["box", "cylinder", "sphere", "capsule", "mesh"]),
        "origin" => (&["xyz", "rpy", "quat_xyzw"], &[]),
        "mass" => (&["value"], &[]),
        "inertia" => (&["ixx", "ixy", "ixz", "iyy", "iyz", "izz"], &[]),
        "box" => (&["size"], &[]),
        "cylinder" | "capsule" => (&["radius", "length"], &[]),
        "sphere" => (&["radius"], &[]),
        "mesh" => (&["filename", "scale"], &[]),
        "parent" | "child" => (&["link"], &[]),
        "axis" => (&["xyz"], &[]),
        "dynamics" => (&["damping", "friction"], &[]),
        "mimic" => (&["joint", "multiplier", "offset"], &[]),
        _ => return None,
    })
}

/// Elements that stand once at most in their parent: of others of their name the first one counts.
const ONCE: [&str; 8] =
    ["inertial", "origin", "mass", "inertia", "geometry", "axis", "dynamics", "mimic"];

/// Remarks on what is not known in an element of the link or joint `of`.
pub(super) fn leftovers(element: &XmlElement, of: &XmlElement, remarks: &mut Remarks) {
    let Some((attributes, children)) = known(&element.name) else { return };
    let unknown = |a: &&crate::element::Attribute| !attributes.contains(&a.name.as_str());
    for attribute in element.attributes.iter().filter(unknown) {
        let message =
            format!("the attribute `{}` of <{}>: unknown, not read", attribute.name, element.name);
        remarks.add(message, of);
    }
    for (k, child) in element.children.iter().enumerate() {
        let name = child.name.as_str();
        if !children.contains(&name) && element.name != "geometry" {
            let message = format!("<{name}> in <{}>: not translated", element.name);
            remarks.add(message, of);
            continue;
        }
        let first = element.children.iter().position(|c| c.name == name) == Some(k);
        if !first && ONCE.contains(&name) {
            let message = format!("a second <{name}> in <{}>: the first one counts", element.name);
            remarks.add(message, of);
        }
        leftovers(child, of, remarks);
    }
}
