//! Joint stops, dry friction, and spheres that touch a plane and one another, in half of the
//! mechanisms that take them.

use super::MechanismKind;
use crate::soak::draw::{Draw, along};
use holonom::Model;
use holonom::model::{
    BodyNames, Contact, ContactMethod, ContactPlane, ContactSide, GROUND, Impact, Joint,
    JointFriction, JointLimits, Limits, PlaneSide, Scheme, Shape, ShapeKind,
};
use holonom::nalgebra::Vector3;

/// Adds them, after all else is drawn.
pub(super) fn add(model: &mut Model, kind: MechanismKind, draw: &mut Draw) {
    let takes = model.settings.scheme == Scheme::Nodal && model.settings.order == 2;
    let bodies = matches!(kind, MechanismKind::Tree | MechanismKind::Loops);
    if !takes || !bodies || draw.chance(0.5) {
        return;
    }
    for joint in &mut model.joints {
        along_joint(joint, draw);
    }
    if draw.chance(0.6) {
        spheres(model, draw);
    }
    model.settings.contact = draw.pick(&[ContactMethod::Events, ContactMethod::Stepping]);
    model.settings.impact =
        draw.weighted(&[(6, Impact::Newton), (1, Impact::Moreau), (1, Impact::Sequential)]);
    if model.settings.impact == Impact::Moreau {
        model.contacts.iter_mut().for_each(|own| own.tangential_restitution = 0.0);
    }
}

fn restitution(draw: &mut Draw) -> f64 {
    draw.pick(&[0.0, 0.3, 0.8, 1.0])
}

pub(super) fn along_joint(joint: &mut Joint, draw: &mut Draw) {
    let count = joint.pair().coordinate_count();
    if count == 0 {
        return;
    }
    if draw.chance(0.5) {
        let mut limit =
            |sign: f64| draw.chance(0.8).then(|| sign * draw.magnitude(&[1e-6, 1e-4, 1e-2, 0.1]));
        let (lower, upper) = (limit(-1.0), limit(1.0));
        if lower.is_some() || upper.is_some() {
            let (freedom, restitution) = (draw.index(count), restitution(draw));
            let limits = JointLimits { freedom, lower, upper, restitution };
            joint.limits = Some(Limits::Table(limits));
        }
    }
    if draw.chance(0.4) {
        let freedom = draw.index(count);
        let effort = Some(draw.magnitude(&[1e-3, 0.1, 1.0]));
        let static_ratio = draw.chance(0.3).then(|| draw.between(1.0, 2.0));
        let (torque, force) = match joint.pair().is_angle(freedom) {
            true => (effort, None),
            false => (None, effort),
        };
        let friction = JointFriction { freedom, torque, force, ..JointFriction::default() };
        joint.friction = Some(JointFriction { static_ratio, ..friction });
    }
}

/// A rule of contact.
pub(super) fn rule(name: &str, a: ContactSide, b: BodyNames, draw: &mut Draw) -> Contact {
    let friction = draw.pick(&[0.0, 0.2, 0.8]);
    let holds = friction > 0.0 && draw.chance(0.3);
    let grips = friction > 0.0 && draw.chance(0.2);
    Contact {
        friction,
        static_friction: holds.then(|| friction * draw.between(1.0, 2.0)),
        restitution: restitution(draw),
        tangential_restitution: if grips { draw.between(0.0, 1.0) } else { 0.0 },
        ..Contact::new(name.to_owned(), a, b)
    }
}

/// A sphere on each body, a plane behind all of them, and pairs of them that are apart.
fn spheres(model: &mut Model, draw: &mut Draw) {
    let mut places = Vec::new(); // centre and radius in space
    for body in &mut model.bodies {
        let (radius, offset) = (draw.between(0.02, 0.1), draw.vector(0.1));
        let mut shape = Shape::new(ShapeKind::Sphere, vec![radius]);
        shape.position = Some(offset);
        body.collision = vec![shape];
        let at = Vector3::from(body.position) + body.rotation() * Vector3::from(offset);
        places.push((at, radius));
    }
    let normal = draw.direction();
    let lowest = places.iter().map(|(at, radius)| at.dot(&Vector3::from(normal)) - radius);
    let lowest = lowest.fold(f64::INFINITY, f64::min);
    let below = lowest - draw.pick(&[0.0, 1e-6, 1e-3, 0.02]);
    let position = along([0.0; 3], below - 1e-12 * (1.0 + below.abs()), normal);
    if model.bodies.iter().any(|body| !body.fixed) && draw.chance(0.8) {
        let plane = ContactPlane { position, normal, on: GROUND.to_owned() };
        let a = ContactSide::Plane(PlaneSide { plane });
        let floor = rule("floor", a, BodyNames::One("*".to_owned()), draw);
        model.contacts.push(floor);
    }
    for i in 0..places.len() {
        for j in i + 1..places.len() {
            let apart = (places[i].0 - places[j].0).norm() - places[i].1 - places[j].1;
            let [a, b] = [i, j].map(|k| &model.bodies[k]);
            if apart < 1e-9 || a.fixed && b.fixed || !draw.chance(0.5) {
                continue;
            }
            let [a, b] = [a, b].map(|own| BodyNames::One(own.name.clone()));
            let name = format!("touch{i}_{j}");
            let own = rule(&name, ContactSide::Bodies(a), b, draw);
            model.contacts.push(own);
        }
    }
}
