//! `<actuator>`: servos of joints.
//!
//! ```text
//! position   f = g (k_p (u − g q) − k_v g q̇)          velocity   f = g k_v (u − g q̇)
//! ```
//! with the gear `g` and the control `u = 0`, as of a simulation that sets none.
//!
//! Source: the XML reference of MuJoCo, mujoco.readthedocs.io.

use super::equality::missing;
use super::settings::Defaults;
use crate::element::XmlElement;
use crate::remark::Remarks;
use crate::robot::Link;
use crate::source::Result;

const NOT_ASKED: &str =
    "actuators: not translated; `--actuators` makes servos of joints motors that hold 0";
const OTHERS: &str = "actuators that are no servo of a hinge or a slide: not translated; an \
                      input from outside, a [[law]] or a `motor` of the joint drives it";
const SERVO: &str = "servos: a `motor` of the joint with the set point 0 of the description";
const LIMITS: &str = "limits of actuators, and their time constants: not translated";

/// Gives joints their servos.
pub(crate) fn servos(
    root: &XmlElement,
    (links, defaults): (&mut [Link], &Defaults),
    wanted: bool,
    remarks: &mut Remarks,
) -> Result<()> {
    for child in root.all("actuator").flat_map(|own| &own.children) {
        if !wanted {
            remarks.add(NOT_ASKED, child);
            continue;
        }
        let element = defaults.apply(child, None)?;
        let [proportional, derivative] = match element.name.as_str() {
            "position" => [element.number("kp")?.unwrap_or(1.0), element.amount("kv")?],
            "velocity" => [0.0, element.number("kv")?.unwrap_or(1.0)],
            _ => {
                remarks.add(OTHERS, child);
                continue;
            }
        };
        let Some(name) = element.word("joint") else {
            remarks.add(OTHERS, child);
            continue;
        };
        let mut joints = links.iter_mut().flat_map(|link| &mut link.joints);
        let Some(joint) = joints.find(|joint| joint.name == name) else {
            return Err(missing(&element, "joint", "joint", name));
        };
        if !joint.kind.is_single() || element.word("dampratio").is_some() {
            remarks.add(OTHERS, child);
            continue;
        }
        let gear = element.numbers("gear")?.and_then(|own| own.first().copied()).unwrap_or(1.0);
        joint.servo[0] += gear * gear * proportional;
        joint.servo[1] += gear * gear * derivative;
        let limits = ["ctrlrange", "forcerange", "timeconst", "inheritrange"];
        if limits.iter().any(|own| element.word(own).is_some()) {
            remarks.add(LIMITS, child);
        }
        remarks.add(SERVO, child);
    }
    Ok(())
}
