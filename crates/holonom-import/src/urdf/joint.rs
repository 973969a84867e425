//! Joints, and joints that follow others.

use std::collections::BTreeMap;

use holonom_model::nearest;
use nalgebra::{Unit, Vector3};

use super::UrdfReader;
use crate::element::XmlElement;
use crate::remark::FAR;
use crate::robot::{Gear, Mobility, RobotJoint, RobotLink, Servo};
use crate::source::{Refusal, Result};

/// Types of joints.
const TYPES: [&str; 7] =
    ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];

impl UrdfReader<'_> {
    /// Gives a link the joint before it.
    pub(super) fn connect(&mut self, link: &mut RobotLink, joint: &XmlElement) -> Result<()> {
        let kind = match joint.required("type")? {
            "fixed" => None,
            "floating" => {
                link.free = true;
                None
            }
            "revolute" | "continuous" => Some(Mobility::Hinge),
            "prismatic" => Some(Mobility::Slide),
            "planar" => Some(Mobility::Planar),
            "spherical" | "ball" => Some(Mobility::Ball),
            other => {
                let message = format!("`{}` is no type of a joint", other.escape_debug());
                let help = match nearest(other, TYPES) {
                    Some(best) => format!("did you mean `{best}`?"),
                    None => format!("there are: {}", TYPES.join(", ")),
                };
                return Err(Refusal::at(joint.place_of("type"), message, help));
            }
        };
        if let Some(kind) = kind {
            link.joints = vec![self.joint(joint, kind)?];
        } else if joint.child("mimic").is_some() {
            let message = "<mimic> of a joint without a coordinate of its own: not translated";
            self.remarks.add(message, joint);
        }
        Ok(())
    }

    fn joint(&mut self, element: &XmlElement, kind: Mobility) -> Result<RobotJoint> {
        let name = element.required("name")?.to_owned();
        let axis = match element.child("axis").filter(|_| kind != Mobility::Ball) {
            Some(axis) => direction(axis)?,
            None => Vector3::x_axis(),
        };
        let dynamics = element.child("dynamics");
        let damping = dynamics.map_or(Ok(0.0), |d| d.amount("damping"))?;
        let friction = dynamics.map_or(Ok(None), |d| d.number("friction"))?.unwrap_or(0.0);
        if friction < 0.0 {
            let dynamics = dynamics.unwrap_or(element);
            let message = format!("`friction` is {friction}: it would feed energy in");
            return Err(Refusal::at(dynamics.place_of("friction"), message, "write 0 or more"));
        }
        if friction != 0.0 && !kind.is_single() {
            self.remarks.add(crate::remark::FRICTION_OF_SEVERAL, element);
        }
        let limits = self.limits(element, kind)?;
        if damping != 0.0 && kind == Mobility::Planar {
            self.remarks.add("damping of a planar joint: only of its angle", element);
        }
        let ignored = [
            ("safety_controller", "safety controllers: not translated"),
            ("calibration", "calibration: not translated"),
        ];
        for (child, message) in ignored {
            if element.child(child).is_some() {
                self.remarks.add(message, element);
            }
        }
        if let Some(mimic) = element.child("mimic") {
            self.mimic(element, &name, kind, mimic)?;
        }
        Ok(RobotJoint {
            name,
            kind,
            axis,
            anchor: Vector3::zeros(),
            reference: 0.0,
            value: 0.0,
            damping: [damping, 0.0, 0.0],
            stiffness: [0.0; 3],
            rest: 0.0,
            limits,
            friction,
            armature: [0.0; 3],
            servo: Servo::default(),
            in_tendon: false,
            place: element.place.clone(),
        })
    }

    /// `<limit>`: lower and upper limit of a joint with one coordinate that is no revolution.
    fn limits(&mut self, element: &XmlElement, kind: Mobility) -> Result<[Option<f64>; 2]> {
        let Some(limit) = element.child("limit") else { return Ok([None; 2]) };
        if ["effort", "velocity"].iter().any(|name| limit.word(name).is_some()) {
            self.remarks.add("limits of effort and velocity: not translated", element);
        }
        let stated = ["lower", "upper"].iter().any(|name| limit.word(name).is_some());
        if !stated || element.word("type") == Some("continuous") {
            return Ok([None; 2]);
        }
        let bound = |name: &str| -> Result<Option<f64>> {
            let stated = limit.word(name).and_then(|word| word.trim().parse::<f64>().ok());
            match stated.filter(|x| x.abs() >= FAR) {
                Some(_) => Ok(None),
                None => Ok(Some(limit.number(name)?.unwrap_or(0.0))),
            }
        };
        let [lower, upper] = [bound("lower")?, bound("upper")?];
        if !kind.is_single() {
            self.remarks.add(crate::remark::LIMITS_OF_SEVERAL, element);
            return Ok([None; 2]);
        }
        if lower.zip(upper).is_some_and(|(lower, upper)| lower >= upper) {
            self.remarks.add(crate::remark::EMPTY_LIMITS, element);
            return Ok([None; 2]);
        }
        Ok([lower, upper])
    }

    /// `<mimic>`: where neither joint has a single coordinate, the joint follows nothing.
    fn mimic(
        &mut self,
        element: &XmlElement,
        name: &str,
        kind: Mobility,
        mimic: &XmlElement,
    ) -> Result<()> {
        let gear = Gear {
            name: format!("{name}_mimic"),
            joint: name.to_owned(),
            of: Some(mimic.required("joint")?.to_owned()),
            offset: mimic.number("offset")?.unwrap_or(0.0),
            factor: mimic.number("multiplier")?.unwrap_or(1.0),
            place: mimic.place.clone(),
        };
        if kind.is_single() {
            self.gears.push(gear);
        } else {
            let message = "<mimic> of a joint with several coordinates: not translated";
            self.remarks.add(message, element);
        }
        Ok(())
    }

    /// The joints that follow others which have one coordinate; a remark on each that does not.
    pub(super) fn followers(&mut self) -> Vec<Gear> {
        let kinds: BTreeMap<&str, &str> = self
            .root
            .all("joint")
            .filter_map(|joint| Some((joint.word("name")?, joint.word("type")?)))
            .collect();
        let mut kept = Vec::new();
        for gear in std::mem::take(&mut self.gears) {
            let of = gear.of.as_deref().unwrap_or_default();
            let reason = match kinds.get(of) {
                Some(&("revolute" | "continuous" | "prismatic")) if of != gear.joint => {
                    kept.push(gear);
                    continue;
                }
                Some(_) if of == gear.joint => "it cannot follow itself".to_owned(),
                Some(kind) => format!(
                    "the {} joint `{}` has no single coordinate",
                    kind.escape_debug(),
                    of.escape_debug()
                ),
                None => {
                    let best = nearest(of, kinds.keys().copied());
                    let best = best.map_or_else(String::new, |best| {
                        format!(" (did you mean `{}`?)", best.escape_debug())
                    });
                    format!("there is no joint `{}`{best}", of.escape_debug())
                }
            };
            let message = format!("<mimic>: {reason}; not translated, the joint moves by itself");
            let label = format!("joint \"{}\"", gear.joint.escape_debug());
            self.remarks.mention(message, label, &gear.place);
        }
        kept
    }
}

/// The direction of an `<axis>`.
pub(super) fn direction(axis: &XmlElement) -> Result<Unit<Vector3<f64>>> {
    let xyz = Vector3::from(axis.vector::<3>("xyz")?.unwrap_or([1.0, 0.0, 0.0]));
    Unit::try_new(xyz, 1e-10).ok_or_else(|| {
        Refusal::at(axis.place_of("xyz"), "the axis has no direction", "write xyz=\"0 0 1\"")
    })
}
