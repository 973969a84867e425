//! `<actuator>`: forces along the coordinate of a joint or the length of a tendon.
//!
//! ```text
//! f = (g_0 + g_1 l + g_2 l̇) u + b_0 + b_1 l + b_2 l̇,    l = gear × the length,    force gear × f
//! ```
//! The control `u` is 0, or the number of `ctrlrange` that is nearest to 0, as in a simulation that
//! sets none; what filters it is at rest.
//!
//! Source: the XML reference of MuJoCo, mujoco.readthedocs.io; how elements of a class combine was
//! found by experiments with version 4.0.0.

use super::equality::missing;
use super::settings::Defaults;
use super::tendon::Tendons;
use crate::element::XmlElement;
use crate::remark::Remarks;
use crate::robot::{LengthPath, RobotLink, Servo};
use crate::source::{Refusal, Result};

const NOT_ASKED: &str = "actuators: not translated; `--actuators` makes servos motors or laws that act without controls";
const OTHERS: &str = "actuators that are no servo of a hinge, a slide or a tendon: not translated; an \
                      input from outside, a [[law]] or a `motor` of the joint drives it";
const SERVO: &str = "servos: a `motor` of the joint, a [[law]] of the tendon, with the set point 0 of the \
                     description, or the nearest that `ctrlrange` has";
const LIMITS: &str =
    "limits of actuators, their delays and the dynamics of their controls: not translated";

/// An actuator as its class and its element state it.
#[derive(Clone, Debug)]
struct Actuator {
    /// The kind of the element that stated the gains last.
    kind: String,
    /// `g`, the first alone or all.
    gain: [f64; 3],
    is_affine: bool,
    /// `b`.
    bias: [f64; 3],
    has_bias: bool,
    /// Gains, biases or dynamics that have no counterpart.
    is_other: bool,
    gear: f64,
    range: Option<[f64; 2]>,
    is_free: bool,
    has_limits: bool,
}

impl Default for Actuator {
    fn default() -> Self {
        Self {
            kind: "general".to_owned(),
            gain: [1.0, 0.0, 0.0],
            is_affine: false,
            bias: [0.0; 3],
            has_bias: false,
            is_other: false,
            gear: 1.0,
            range: None,
            is_free: false,
            has_limits: false,
        }
    }
}

impl Actuator {
    /// What an element states beside what is known.
    fn read(&mut self, element: &XmlElement) -> Result<()> {
        self.common(element)?;
        let kind = element.name.as_str();
        let kept = match self.kind.as_str() {
            "general" => !self.is_affine,
            own => own == kind,
        };
        if kind == "general" {
            return self.general(element);
        }
        let before = if kept { self.clone() } else { Self::default() };
        (self.gain, self.bias, self.is_affine) = ([0.0; 3], [0.0; 3], false);
        (self.has_bias, self.is_other) = (true, false);
        match kind {
            "motor" => (self.gain[0], self.has_bias) = (1.0, false),
            "position" | "intvelocity" => {
                let stiffness = element.number("kp")?.unwrap_or(before.gain[0]);
                self.gain[0] = stiffness;
                self.bias = [0.0, -stiffness, before.bias[2]];
                if let Some(damping) = element.number("kv")? {
                    self.bias[2] = -damping;
                }
                self.is_other = element.word("dampratio").is_some() || before.is_other;
            }
            "velocity" => {
                let damping = element.number("kv")?.unwrap_or(before.gain[0]);
                (self.gain[0], self.bias[2]) = (damping, -damping);
            }
            "pid" => {
                let own = before.kind == "pid";
                let stated = if own { -before.bias[1] } else { 1.0 };
                let stiffness = element.number("kp")?.unwrap_or(stated);
                let damping = element.number("kv")?.unwrap_or(-before.bias[2]);
                (self.gain[0], self.bias) = (stiffness, [0.0, -stiffness, -damping]);
                let integral = element.number("ki")?.is_some_and(|own| own != 0.0);
                self.is_other = integral || before.is_other;
            }
            "damper" => {
                (self.is_affine, self.has_bias) = (true, false);
                self.gain[2] = -element.number("kv")?.unwrap_or(1.0);
            }
            "cylinder" => {
                let area = match element.number("diameter")? {
                    Some(diameter) => 0.25 * std::f64::consts::PI * diameter * diameter,
                    None => element.number("area")?.unwrap_or(before.gain[0]),
                };
                self.gain[0] = area;
                self.bias = element.vector::<3>("bias")?.unwrap_or(before.bias);
                self.has_limits = true;
            }
            _ => self.is_other = true,
        }
        kind.clone_into(&mut self.kind);
        Ok(())
    }

    /// Attributes of all kinds.
    fn common(&mut self, element: &XmlElement) -> Result<()> {
        if let Some(gear) = element.numbers("gear")?.and_then(|own| own.first().copied()) {
            self.gear = gear;
        }
        self.range = element.vector::<2>("ctrlrange")?.or(self.range);
        if let Some([lower, upper]) = self.range.filter(|[lower, upper]| lower > upper) {
            let message = format!("`ctrlrange` is {lower} to {upper}: nothing lies between");
            return Err(Refusal::at(element.place_of("ctrlrange"), message, "exchange them"));
        }
        if let Some(limited) = element.word("ctrllimited") {
            self.is_free = limited == "false";
        }
        let limits = ["ctrlrange", "forcerange", "timeconst", "inheritrange", "delay", "slewmax"];
        let dynamic = element.word("dyntype").is_some_and(|own| own != "none");
        self.has_limits |= dynamic || limits.iter().any(|own| element.word(own).is_some());
        Ok(())
    }

    fn general(&mut self, element: &XmlElement) -> Result<()> {
        "general".clone_into(&mut self.kind);
        for (name, own) in [("gainprm", &mut self.gain), ("biasprm", &mut self.bias)] {
            let stated = element.numbers(name)?.unwrap_or_default();
            own.iter_mut().zip(stated).for_each(|(own, stated)| *own = stated);
        }
        match element.word("gaintype") {
            None => {}
            Some("fixed") => self.is_affine = false,
            Some("affine") => self.is_affine = true,
            Some(_) => self.is_other = true,
        }
        match element.word("biastype") {
            None => {}
            Some("none") => self.has_bias = false,
            Some("affine") => self.has_bias = true,
            Some(_) => self.is_other = true,
        }
        let dynamics = element.word("dyntype").unwrap_or("none");
        self.is_other |= !["none", "integrator", "filter", "filterexact"].contains(&dynamics);
        Ok(())
    }

    /// The force along the length without controls; `None` without a counterpart.
    fn servo(&self) -> Option<Servo> {
        let control = match self.range.filter(|_| !self.is_free) {
            Some([lower, upper]) => 0.0_f64.clamp(lower, upper),
            None => 0.0,
        };
        let gain = if self.is_affine { self.gain } else { [self.gain[0], 0.0, 0.0] };
        let bias = if self.has_bias { self.bias } else { [0.0; 3] };
        let [effort, proportional, derivative] = [0, 1, 2].map(|k| gain[k] * control + bias[k]);
        let square = self.gear * self.gear;
        let servo = Servo {
            effort: self.gear * effort,
            proportional: -square * proportional,
            derivative: -square * derivative,
        };
        let feeds = servo.proportional < 0.0 || servo.derivative < 0.0;
        (!self.is_other && !feeds && servo != Servo::default()).then_some(servo)
    }
}

/// Gives joints and tendons their servos.
pub(super) fn servos(
    root: &XmlElement,
    (links, tendons, defaults): (&mut [RobotLink], &mut Tendons, &Defaults),
    wanted: bool,
    remarks: &mut Remarks,
) -> Result<()> {
    for child in root.all("actuator").flat_map(|own| &own.children) {
        if !wanted {
            remarks.add(NOT_ASKED, child);
            continue;
        }
        let mut actuator = Actuator::default();
        for element in defaults.actuators(child)? {
            actuator.read(element)?;
        }
        let own = match (child.word("joint").or(child.word("jointinparent")), child.word("tendon"))
        {
            (Some(name), _) => {
                let mut joints = links.iter_mut().flat_map(|link| &mut link.joints);
                let joint = joints.find(|joint| joint.name == name);
                let joint = joint.ok_or_else(|| missing(child, "joint", "joint", name))?;
                Some(&mut joint.servo).filter(|_| joint.kind.is_single())
            }
            (None, Some(name)) => {
                let tendon = tendons.named(name);
                let tendon = tendon.ok_or_else(|| missing(child, "tendon", "tendon", name))?;
                Some(&mut tendon.servo).filter(|_| !matches!(tendon.path, LengthPath::Other))
            }
            (None, None) => None,
        };
        let (Some(own), Some(servo)) = (own, actuator.servo()) else {
            remarks.add(OTHERS, child);
            continue;
        };
        *own = own.plus(servo);
        if actuator.has_limits {
            remarks.add(LIMITS, child);
        }
        remarks.add(SERVO, child);
    }
    Ok(())
}
