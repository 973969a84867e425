//! Mechanisms of many members, and the same with one more: what a step of them costs is judged
//! ([`crate::soak::growth`]).

use super::bodies::{body, joint};
use super::empty;
use crate::soak::draw::{Draw, along};
use holonom::Model;
use holonom::model::{Bar, GROUND, JointKind, Particle, Spring, SpringLaw};

/// What the many members are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topology {
    /// Bodies, each hung on the one before.
    Chain,
    /// Bodies, each hung on one of the earlier ones.
    Tree,
    /// Four-bar linkages side by side, each with a side in common with the next.
    Loops,
    /// Point masses, each on a bar from the one before.
    Points,
}

impl Topology {
    /// All.
    pub const ALL: [Self; 4] = [Self::Chain, Self::Tree, Self::Loops, Self::Points];
}

/// What is added to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Addition {
    /// A point mass that nothing holds.
    FreePoint,
    /// A point mass on a spring from one of the members.
    PointOnSpring,
    /// A body that nothing holds.
    FreeBody,
    /// A body on a spring from one of the members.
    BodyOnSpring,
    /// A body on a hinge of the ground.
    HingedBody,
    /// A spring between two members, the first and the last.
    Spring,
    /// A spring from a member to the ground.
    GroundSpring,
}

impl Addition {
    /// All.
    pub const ALL: [Self; 7] = [
        Self::FreePoint,
        Self::PointOnSpring,
        Self::FreeBody,
        Self::BodyOnSpring,
        Self::HingedBody,
        Self::Spring,
        Self::GroundSpring,
    ];

    /// Whether a potential couples it with the others, or these with each other: the matrix of a
    /// step has other entries then.
    #[must_use]
    pub fn couples(self) -> bool {
        matches!(self, Self::PointOnSpring | Self::BodyOnSpring | Self::Spring)
    }
}

/// A mechanism of `size` members and perhaps one more, the same for a seed.
#[must_use]
pub fn large(seed: u64, base: Topology, size: usize, member: Option<Addition>) -> Model {
    let mut draw = Draw::new(seed, size as u64);
    let draw = &mut draw;
    let mut model = empty(format!("{base:?}_{size}").to_lowercase());
    model.header.gravity = vec![0.0, 0.0, -9.81];
    match base {
        Topology::Chain => hung(&mut model, size, true, draw),
        Topology::Tree => hung(&mut model, size, false, draw),
        Topology::Loops => linkages(&mut model, size, draw),
        Topology::Points => points(&mut model, size),
    }
    if let Some(member) = member {
        add(&mut model, member, draw);
    }
    (model.settings.step, model.settings.end) = (1e-3, 0.1);
    model
}

fn hung(model: &mut Model, size: usize, chain: bool, draw: &mut Draw) {
    for k in 0..size {
        let on = if chain { k.checked_sub(1) } else { k.checked_sub(1).map(|_| draw.index(k)) };
        let (parent, at) = match on {
            Some(p) => (model.bodies[p].name.clone(), model.bodies[p].position),
            None => (GROUND.to_owned(), [0.0; 3]),
        };
        let position = along(at, 1.0, [0.8, 0.0, -0.6]);
        let child = body(format!("body{k}"), position, draw);
        let (place, axis) = (along(at, 0.5, [0.8, 0.0, -0.6]), draw.direction());
        let ends = [parent.as_str(), child.name.as_str()];
        model.joints.push(joint(format!("joint{k}"), JointKind::Revolute, ends, place, axis));
        model.bodies.push(child);
    }
}

/// Upright cranks on the ground, and couplers between neighbours.
fn linkages(model: &mut Model, size: usize, draw: &mut Draw) {
    const Y: [f64; 3] = [0.0, 1.0, 0.0];
    let hinge = |model: &mut Model, [parent, child]: [&str; 2], place: [f64; 3]| {
        let name = format!("joint{}", model.joints.len());
        model.joints.push(joint(name, JointKind::Revolute, [parent, child], place, Y));
    };
    for k in 0..size.div_ceil(2) {
        let x = k as f64;
        let crank = body(format!("crank{k}"), [x, 0.0, 0.5], draw);
        hinge(model, [GROUND, &crank.name], [x, 0.0, 0.0]);
        model.bodies.push(crank);
        if k > 0 {
            let coupler = body(format!("coupler{k}"), [x - 0.5, 0.0, 1.0], draw);
            for j in [k - 1, k] {
                let top = [j as f64, 0.0, 1.0];
                hinge(model, [&format!("crank{j}"), &coupler.name], top);
            }
            model.bodies.push(coupler);
        }
    }
}

fn points(model: &mut Model, size: usize) {
    for k in 0..size {
        let position = vec![k as f64 + 1.0, 0.0, 0.2 * (k % 2) as f64];
        model.particles.push(particle(format!("point{k}"), position));
        let from = k.checked_sub(1).map_or(GROUND.to_owned(), |p| format!("point{p}"));
        let point = (k == 0).then(|| vec![0.0; 3]);
        let (name, to) = (format!("bar{k}"), format!("point{k}"));
        model.bars.push(Bar { name, from, to, point, relative_to: None, length: None });
    }
}

fn particle(name: String, position: Vec<f64>) -> Particle {
    Particle { name, mass: 1.0, position, velocity: vec![0.0; 3], relative_to: None }
}

fn add(model: &mut Model, member: Addition, draw: &mut Draw) {
    const BESIDE: [f64; 3] = [0.5, 2.0, 0.5];
    let names = model.bodies.iter().map(|body| &body.name);
    let names: Vec<&String> =
        names.chain(model.particles.iter().map(|point| &point.name)).collect();
    let ends = [names[0].clone(), names[names.len() - 1].clone()];
    match member {
        Addition::FreePoint | Addition::PointOnSpring => {
            model.particles.push(particle("added".into(), BESIDE.to_vec()));
        }
        Addition::FreeBody | Addition::BodyOnSpring | Addition::HingedBody => {
            let new = body("added".into(), BESIDE, draw);
            model.bodies.push(new);
        }
        Addition::Spring | Addition::GroundSpring => {}
    }
    let [first, last] = ends;
    let (from, to) = match member {
        Addition::FreePoint | Addition::FreeBody => return,
        Addition::HingedBody => {
            let (kind, ends) = (JointKind::Revolute, [GROUND, "added"]);
            let axis = draw.direction();
            model.joints.push(joint("added_joint".into(), kind, ends, [0.5, 2.5, 0.5], axis));
            return;
        }
        Addition::PointOnSpring | Addition::BodyOnSpring => (last, "added".to_owned()),
        Addition::Spring => (first, last),
        Addition::GroundSpring => (GROUND.to_owned(), last),
    };
    let point_from = (from == GROUND).then(|| vec![0.0, 3.0, 3.0]);
    model.springs.push(Spring {
        tension: None,
        name: "added_spring".into(),
        from,
        to,
        point_from,
        point_to: None,
        relative_to: None,
        stiffness: 20.0,
        natural_length: None,
        law: SpringLaw::Linear,
        damping: 0.0,
    });
}
