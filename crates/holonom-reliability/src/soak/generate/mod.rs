//! Random mechanisms that are valid by construction.
//!
//! | file | concept |
//! |---|---|
//! | `settings` | schemes, orders, steps |
//! | `bodies` | rigid bodies and the joints between them: trees, closed loops, redundant joints |
//! | `points` | point masses on bars |
//! | `beams` | beams of a few elements |
//! | `locked` | mechanisms without a degree of freedom |
//! | [`large`] | mechanisms of many members, and one more |
//! | `forces` | springs, dampers, motors, loads, gears, prescribed motions |
//! | `contacts` | stops and dry friction of joints, spheres that touch |
//! | `touching` | bodies of all shapes that touch, a stream of their own |

mod beams;
mod bodies;
mod contacts;
mod forces;
pub mod large;
mod locked;
mod points;
mod settings;
mod touching;

pub use touching::{meshes, touching};

use super::draw::Draw;
use holonom::Model;
use holonom::model::{Header, Settings};

/// Steps of a mechanism.
pub const STEPS: u64 = 20;

/// What a mechanism is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MechanismKind {
    /// Rigid bodies without closed loops.
    Tree,
    /// Rigid bodies with closed loops.
    Loops,
    /// Point masses on bars.
    Points,
    /// Beams, perhaps with bodies.
    Beams,
    /// No degree of freedom.
    Locked,
}

/// Whether the mechanism with this index has no degree of freedom: one of sixteen.
#[must_use]
pub fn is_locked(index: u64) -> bool {
    index % 16 == 5
}

/// The mechanism with this seed and index.
#[must_use]
pub fn mechanism(seed: u64, index: u64) -> Model {
    let mut draw = Draw::new(seed, index);
    let draw = &mut draw;
    let kind = draw.weighted(&[
        (50, MechanismKind::Tree),
        (26, MechanismKind::Loops),
        (16, MechanismKind::Points),
        (8, MechanismKind::Beams),
    ]);
    let kind = if is_locked(index) { MechanismKind::Locked } else { kind };
    let mut model = empty(format!("{seed}-{index}"));
    if draw.chance(0.6) {
        model.header.gravity = vec![0.0, 0.0, -9.81];
    }
    match kind {
        MechanismKind::Tree => bodies::tree(&mut model, draw),
        MechanismKind::Loops => bodies::loops(&mut model, draw),
        MechanismKind::Points => points::truss(&mut model, draw),
        MechanismKind::Beams => beams::beams(&mut model, draw),
        MechanismKind::Locked => locked::locked(&mut model, draw),
    }
    forces::add(&mut model, kind, draw);
    settings::choose(&mut model, kind, draw);
    contacts::add(&mut model, kind, draw);
    model
}

/// A model without parts.
fn empty(name: String) -> Model {
    let header = Header { name, description: None, dimension: 3, gravity: Vec::new() };
    Model::without_parts(header, Settings::new(0.01, 0.2))
}
