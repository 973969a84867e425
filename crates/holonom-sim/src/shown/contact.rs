//! Forces and gaps of compliant contacts, with derivatives.
//!
//! ```text
//! F = Σ ± (F_N n + F_T)(q, v̂; θ)         ∂F/∂q, ∂F/∂v̂: by dual numbers, F_θ of law and shapes
//! g = min g_i(q)                         ∂g/∂q, g_θ of the feature that has it
//! ```
//! Those of rigid contacts are impulses over a step, which jump where a contact opens, closes,
//! sticks or slips: runs with them have no derivatives.

use super::{Asked, OfNode};
use crate::design::{ModelTangent, refused};
use crate::sensor::{Signs, signed};
use crate::system::contact_origin::ContactOrigin;
use holonom_model::{ModelError, SensorKind};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_control::node::{Node, NodeQuantity, NodeSlopes};
use vi_multibody::contact::compliant_change::CompliantChange;
use vi_multibody::contact::compliant_contact::CompliantContact;

/// The sum of forces in space along an axis.
struct Pressed {
    own: Vec<(Arc<CompliantContact>, f64)>, // with signs
    axis: usize,
    by: ContactChanges,
}

/// Of which of the contacts they are, in the order of the parameters.
type ContactChanges = Vec<Vec<(usize, CompliantChange)>>;

impl NodeQuantity for Pressed {
    fn value(&self, Node { at, v, .. }: Node<'_>) -> f64 {
        let one = |(own, sign): &(Arc<CompliantContact>, f64)| own.total_force(at.q, v) * *sign;
        self.own.iter().map(one).sum::<Vector3<f64>>()[self.axis]
    }
    fn add_slopes(&self, Node { at, v, .. }: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        for (own, sign) in &self.own {
            let direction = Vector3::ith(self.axis, scale * sign);
            own.add_force_slopes([at.q, v], &direction, [&mut *out.q, &mut *out.v]);
        }
    }
    fn by_parameter(&self, parameter: usize, Node { at, v, .. }: Node<'_>) -> f64 {
        let one = |(k, by): &(usize, CompliantChange)| {
            self.own[*k].1 * by.total_force(at.q, v)[self.axis]
        };
        self.by.get(parameter).map_or(0.0, |all| all.iter().map(one).sum())
    }
}

/// The smallest gap of some contacts.
struct Gap {
    own: Vec<Arc<CompliantContact>>,
    by: ContactChanges,
}

impl Gap {
    /// Which it is, and its gap.
    fn smallest(&self, q: &[f64]) -> Option<(usize, f64)> {
        let gaps = self.own.iter().enumerate();
        let gaps = gaps.filter_map(|(k, own)| Some((k, own.smallest_gap(q)?)));
        gaps.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

impl NodeQuantity for Gap {
    fn value(&self, Node { at, .. }: Node<'_>) -> f64 {
        self.smallest(at.q).map_or(f64::NAN, |(_, gap)| gap)
    }
    fn add_slopes(&self, Node { at, .. }: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        if let Some((k, _)) = self.smallest(at.q) {
            self.own[k].add_gap_slope(at.q, scale, out.q);
        }
    }
    fn by_parameter(&self, parameter: usize, Node { at, .. }: Node<'_>) -> f64 {
        let (Some(by), Some((k, _))) = (self.by.get(parameter), self.smallest(at.q)) else {
            return 0.0;
        };
        by.iter().filter(|own| own.0 == k).map(|(_, by)| by.smallest_gap(at.q)).sum()
    }
    fn reads_velocity(&self) -> bool {
        false
    }
}

/// What a sensor of a compliant contact shows; `None` of others.
///
/// # Errors
/// [`ModelError`] of contacts by impulses.
pub(super) fn of_sensor(asked: Asked<'_>) -> OfNode {
    let Asked { system, key, of: (sensor, _), tangents, .. } = asked;
    let is_force = sensor.kind == SensorKind::ContactForce;
    if !(is_force || sensor.kind == SensorKind::Gap) {
        return Ok(None);
    }
    let part = asked.number()?;
    let origins = &system.contacts;
    let compliant = |origin: &ContactOrigin| {
        origin.compliant().cloned().ok_or_else(|| {
            let what = format!(
                "the derivative of the sensor `{}`: the impulses of a rigid contact jump where it \
                 opens, closes, sticks or slips",
                sensor.name
            );
            let help = "give the [[contact]] a `model`, or take a distance of points";
            refused(key, what, help)
        })
    };
    if !is_force {
        let of_contact =
            |own: &&ContactOrigin| own.shapes().is_some_and(|s| s.contact == sensor.of);
        let read: Vec<usize> = (0..origins.len()).filter(|k| of_contact(&&origins[*k])).collect();
        let own = read.iter().map(|k| compliant(&origins[*k])).collect::<Result<_, _>>()?;
        let by = changes(tangents, |k| read.iter().position(|own| *own == k));
        return Ok(Some(Box::new(Gap { own, by })));
    }
    let signed = signed(origins, &asked.model.member_name(&sensor.of));
    let one = |(k, sign): &(u32, Signs)| Ok((compliant(&origins[*k as usize])?, sign.of(0)));
    let own = signed.iter().map(one).collect::<Result<_, ModelError>>()?;
    let by = changes(tangents, |k| signed.iter().position(|own| own.0 as usize == k));
    Ok(Some(Box::new(Pressed { own, axis: part, by })))
}

/// What parameters change of the contacts of a sensor, `place`: of one of the system among these.
fn changes(tangents: &[ModelTangent], place: impl Fn(usize) -> Option<usize>) -> ContactChanges {
    let one = |(k, by): &(usize, CompliantChange)| Some((place(*k)?, by.clone()));
    tangents.iter().map(|own| own.contacts.iter().filter_map(one).collect()).collect()
}
