//! The smallest mechanism with the same fault: parts are removed one by one as long as it remains.

use super::defects::SoakDefect;
use super::fault::Violation;
use super::judge::{Checks, judge};
use holonom::Model;
use holonom::model::{Constraint, HighOrder, LinearSolver, Quadrature, Strain};

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
    let mut smallest = model.clone();
    let mut tries = 0;
    'again: loop {
        for reduce in reductions(&smallest) {
            let candidate = reduce(&smallest);
            tries += 1;
            if tries > TRIES {
                return smallest;
            }
            let found = judge(&candidate, checks, defect).fault;
            if candidate != smallest && found.is_some_and(|found| found.resembles(fault)) {
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
    each(model.joints.len(), |model, k| {
        let joint = &mut model.joints[k];
        (joint.spring, joint.damper, joint.motor, joint.rate) = (None, None, None, None);
        (joint.limits, joint.bumper, joint.friction) = (None, None, None);
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
const SETTINGS: [fn(&mut Model); 6] = [
    |model| model.header.gravity.clear(),
    |model| (model.settings.order, model.settings.method) = (2, HighOrder::Composition),
    |model| model.settings.quadrature = Quadrature::Midpoint,
    |model| model.settings.solver = LinearSolver::Auto,
    |model| (model.settings.momenta, model.settings.strain) = (false, Strain::MassScaled),
    |model| model.settings.end = model.settings.step * 2.0,
];

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
