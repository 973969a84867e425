//! How a mechanism is stated otherwise.

use super::restate::{RestatedDisplacement, Units, displaced, in_units, reordered};
use holonom::Model;
use holonom::nalgebra::{Matrix3, Vector3};

/// How a mechanism is stated otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Statement {
    /// Turned and moved as a whole.
    Displaced(RestatedDisplacement),
    /// With its parts in the opposite order.
    Reordered,
    /// In other units.
    Units(Units),
}

impl Statement {
    /// All that are tried.
    #[must_use]
    pub fn all() -> [Self; 6] {
        // a rotation of rational numbers: (7, 4, −4, 1)/9 and a permutation of axes
        let rotation = Matrix3::new(7.0, -4.0, 4.0, 4.0, -1.0, -8.0, 4.0, 8.0, 1.0) / 9.0;
        let units = |length: i32, mass: i32, time: i32| {
            let [length, mass, time] = [length, mass, time].map(|k| 2.0_f64.powi(k));
            Self::Units(Units { length, mass, time })
        };
        [
            Self::Displaced(RestatedDisplacement { rotation, shift: Vector3::zeros() }),
            Self::Displaced(RestatedDisplacement {
                rotation: Matrix3::identity(),
                shift: Vector3::new(1.5, -2.0, 0.75),
            }),
            Self::Reordered,
            units(10, 0, -6),
            units(-10, -20, 0),
            units(0, 20, 10),
        ]
    }

    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Displaced(by) if by.shift == Vector3::zeros() => "turned",
            Self::Displaced(_) => "moved",
            Self::Reordered => "reordered",
            Self::Units(_) => "in other units",
        }
    }

    /// A model stated so.
    pub(super) fn of(self, model: &Model) -> Model {
        match self {
            Self::Displaced(by) => displaced(model, &by),
            Self::Reordered => reordered(model),
            Self::Units(units) => in_units(model, units),
        }
    }
}
