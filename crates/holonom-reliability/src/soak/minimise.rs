//! The smallest mechanism with the same fault, or whose run ends in the same words: parts are
//! removed one by one as long as that remains.

use super::defects::SoakDefect;
use super::fault::Violation;
use super::judge::{Checks, Ending, judge};
use holonom::Model;
use holonom::model::{
    BodyNames, Constraint, ContactMethod, ContactSide, HighOrder, Impact, LinearSolver, Quadrature,
    Strain,
};

/// Mechanisms that are tried at most.
const TRIES: usize = 600;

/// Removes what the fault does not need.
#[must_use]
pub fn minimise(
    model: &Model,
    checks: Checks,
    defect: Option<SoakDefect>,
    fault: &Violation,
) -> Model {
    smallest(model, |candidate| {
        judge(candidate, checks, defect).fault.is_some_and(|found| found.resembles(fault))
    })
}

/// Removes what a refused step does not need; `words`: the shape of its message.
#[must_use]
pub fn minimise_failure(model: &Model, words: &str) -> Model {
    let ends_so = |ending| matches!(ending, Ending::Failed(own) if own == words);
    smallest(model, |candidate| ends_so(judge(candidate, Checks::default(), None).ending))
}

/// Removes what is not needed for a model to be such.
fn smallest(model: &Model, is_such: impl Fn(&Model) -> bool) -> Model {
    let mut smallest = model.clone();
    let mut tries = 0;
    'again: loop {
        for reduce in reductions(&smallest) {
            let candidate = reduce(&smallest);
            if candidate == smallest {
                continue;
            }
            tries += 1;
            if tries > TRIES {
                return smallest;
            }
            if is_such(&candidate) {
                smallest = candidate;
                continue 'again;
            }
        }
        return smallest;
    }
}

type Reduction = Box<dyn Fn(&Model) -> Model>;

/// Ways to make a model smaller, the largest first.
fn reductions(model: &Model) -> Vec<Reduction> {
    let mut all: Vec<Reduction> = Vec::new();
    let mut each = |count: usize, remove: fn(&mut Model, usize)| {
        for k in 0..count {
            all.push(Box::new(move |model| {
                let mut model = model.clone();
                remove(&mut model, k);
                model
            }));
        }
    };
    each(model.bodies.len(), |model, k| {
        let name = model.bodies.remove(k).name;
        forget(model, &name);
    });
    each(model.particles.len(), |model, k| {
        let name = model.particles.remove(k).name;
        forget(model, &name);
    });
    each(model.constraints.len(), |model, k| drop(model.constraints.remove(k)));
    each(model.joints.len(), |model, k| {
        let name = model.joints.remove(k).name;
        forget(model, &name);
    });
    each(model.bars.len(), |model, k| drop(model.bars.remove(k)));
    each(model.springs.len(), |model, k| drop(model.springs.remove(k)));
    each(model.loads.len(), |model, k| drop(model.loads.remove(k)));
    each(model.contacts.len(), |model, k| drop(model.contacts.remove(k)));
    each(model.bodies.len(), |model, k| {
        let shapes = &mut model.bodies[k].collision;
        shapes.truncate(shapes.len().saturating_sub(1).max(1));
    });
    each(model.bodies.len(), |model, k| {
        let shapes = &mut model.bodies[k].collision;
        shapes.drain(..shapes.len().saturating_sub(1).min(1));
    });
    each(model.joints.len(), |model, k| {
        let joint = &mut model.joints[k];
        (joint.spring, joint.damper, joint.motor, joint.rate) = (None, None, None, None);
    });
    each(model.joints.len(), |model, k| {
        let joint = &mut model.joints[k];
        (joint.limits, joint.bumper) = (None, None);
    });
    each(model.joints.len(), |model, k| model.joints[k].friction = None);
    each(model.joints.len(), |model, k| {
        if let Some(friction) = &mut model.joints[k].friction {
            friction.static_ratio = None;
        }
    });
    each(model.contacts.len(), |model, k| model.contacts[k].restitution = 0.0);
    each(model.contacts.len(), |model, k| model.contacts[k].tangential_restitution = 0.0);
    each(model.contacts.len(), |model, k| model.contacts[k].static_friction = None);
    each(model.contacts.len(), |model, k| {
        let own = &mut model.contacts[k];
        (own.friction, own.static_friction, own.tangential_restitution) = (0.0, None, 0.0);
    });
    each(model.bodies.len(), |model, k| {
        let body = &mut model.bodies[k];
        (body.angular_velocity, body.body_angular_velocity) = (None, None);
        body.velocity = [0.0; 3];
    });
    each(model.bodies.len(), |model, k| model.bodies[k].quaternion = None);
    each(SETTINGS.len(), |model, k| SETTINGS[k](model));
    all
}

/// Simpler settings.
const SETTINGS: [fn(&mut Model); 10] = [
    |model| model.header.gravity.clear(),
    |model| (model.settings.order, model.settings.method) = (2, HighOrder::Composition),
    |model| model.settings.quadrature = Quadrature::Midpoint,
    |model| model.settings.solver = LinearSolver::Auto,
    |model| (model.settings.momenta, model.settings.strain) = (false, Strain::MassScaled),
    |model| model.settings.end = model.settings.step * 2.0,
    |model| model.settings.end = half(model) * model.settings.step,
    |model| model.settings.end = (2.0 * half(model) - 1.0) * model.settings.step,
    |model| model.settings.impact = Impact::default(),
    |model| model.settings.contact = ContactMethod::Stepping,
];

/// Half of the steps.
fn half(model: &Model) -> f64 {
    (0.5 * model.settings.end / model.settings.step).round().max(1.0)
}

/// Removes whatever names this component.
fn forget(model: &mut Model, name: &str) {
    let gone: Vec<String> = model
        .joints
        .iter()
        .filter(|joint| joint.parent == name || joint.child == name)
        .map(|joint| joint.name.clone())
        .collect();
    model.joints.retain(|joint| !gone.contains(&joint.name));
    model.bars.retain(|bar| bar.from != name && bar.to != name);
    model.springs.retain(|spring| spring.from != name && spring.to != name);
    model.loads.retain(|load| load.body.as_deref() != Some(name));
    let lost = |other: &String| other == name || gone.contains(other);
    let left = |names: &BodyNames| match names {
        BodyNames::One(own) => (own != name).then(|| names.clone()),
        BodyNames::Several(all) => {
            let left: Vec<String> = all.iter().filter(|own| *own != name).cloned().collect();
            (!left.is_empty()).then_some(BodyNames::Several(left))
        }
    };
    let contacts = std::mem::take(&mut model.contacts).into_iter().filter_map(|mut own| {
        own.a = match own.a {
            ContactSide::Bodies(names) => ContactSide::Bodies(left(&names)?),
            ContactSide::Plane(side) if side.plane.on == name => return None,
            plane => plane,
        };
        own.b = left(&own.b)?;
        Some(own)
    });
    model.contacts = contacts.collect();
    model.constraints.retain(|constraint| match constraint {
        Constraint::Distance { from, to, .. } => !lost(from) && !lost(to),
        Constraint::PointOnLine { parent, child, .. }
        | Constraint::PointOnPlane { parent, child, .. } => !lost(parent) && !lost(child),
        Constraint::Gear { joints, .. } => !joints.iter().any(lost),
        Constraint::Motion { joint, .. } => !lost(joint),
        Constraint::Velocity { terms, .. } => {
            !terms.iter().any(|term| term.joint.iter().chain(&term.of).any(lost))
        }
        Constraint::Rolling { body, .. } | Constraint::Blade { body, .. } => !lost(body),
    });
}
