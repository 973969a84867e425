//! Mass properties of homogeneous shapes.
//!
//! The centre of the frame is the centre of mass; the axes of the shape are its directors.
//! ```text
//! box       J_1 = m (b² + c²)/12, …                      edges a, b, c along d_1, d_2, d_3
//! cylinder  J_1 = J_2 = m (3r² + l²)/12,  J_3 = m r²/2    axis d_3
//! sphere    J_I = 2/5 m r²
//! rod       J_1 = J_2 = m l²/12,          J_3 = 0         axis d_3, ideally thin
//! cone      J_1 = J_2 = 3/80 m (4r² + l²), J_3 = 3/10 m r²  axis d_3, tip at −¾ l d_3
//! ellipsoid J_1 = m (b² + c²)/5, …                       half axes a, b, c along d_1, d_2, d_3
//! capsule   a cylinder of the length l and two half balls about its ends    axis d_3
//! ```
//! Formed as Euler moments `E_I = ∫ ξ_I² dm`, which are non-negative and free of cancellation, and
//! turned into `J_I = E_J + E_K`.

use crate::inertia::{EulerMoments, InertiaError, PrincipalInertia};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use vi_core::Number;

/// A homogeneous solid; lengths in m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape<T = f64> {
    /// A box with edges along `d_1, d_2, d_3`.
    Box {
        /// Its edges.
        lengths: [T; 3],
    },
    /// A circular cylinder about `d_3`.
    Cylinder {
        /// Its radius.
        radius: T,
        /// Its length.
        length: T,
    },
    /// A ball.
    Sphere {
        /// Its radius.
        radius: T,
    },
    /// A rod along `d_3` whose thickness counts for its volume but not for its inertia.
    ///
    /// Its inertia about its own axis is zero: it needs a joint that fixes this spin.
    Rod {
        /// Its length.
        length: T,
        /// Its radius; without it the rod has no volume, and its mass must be given.
        #[serde(default)]
        radius: T,
    },
    /// A circular cone about `d_3`; the tip is at `−¾ length d_3`, the base at `+¼ length d_3`.
    Cone {
        /// Radius of the base.
        radius: T,
        /// Height from base to tip.
        length: T,
    },
    /// A cylinder about `d_3` with half balls at both ends.
    Capsule {
        /// Its radius.
        radius: T,
        /// The distance of the centres of the half balls.
        length: T,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Half of its diameters along `d_1, d_2, d_3`.
        half_axes: [T; 3],
    },
}

/// Mass and principal inertias.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass: f64,
    /// Principal inertias about the directors, kg·m².
    pub inertia: PrincipalInertia,
}

impl<T: Number> Shape<T> {
    /// Volume, m³.
    #[must_use]
    pub fn volume(&self) -> T {
        match *self {
            Self::Box { lengths: [a, b, c] } => a * b * c,
            Self::Cylinder { radius, length } | Self::Rod { length, radius } => {
                T::of(PI) * radius * radius * length
            }
            Self::Sphere { radius } => T::of(4.0 / 3.0 * PI) * radius * radius * radius,
            Self::Cone { radius, length } => T::of(PI) * radius * radius * length / T::of(3.0),
            Self::Capsule { radius, length } => {
                T::of(PI) * radius * radius * (length + T::of(4.0 / 3.0) * radius)
            }
            Self::Ellipsoid { half_axes: [a, b, c] } => T::of(4.0 / 3.0 * PI) * a * b * c,
        }
    }

    /// `E_I = ∫ ξ_I² dm` for a mass, kg·m².
    #[must_use]
    pub fn euler_moments(&self, mass: T) -> [T; 3] {
        let zero = T::of(0.0);
        match *self {
            Self::Box { lengths } => lengths.map(|a| mass * a * a / T::of(12.0)),
            Self::Cylinder { radius, length } => {
                let across = mass * radius * radius / T::of(4.0);
                [across, across, mass * length * length / T::of(12.0)]
            }
            Self::Sphere { radius } => [mass * radius * radius / T::of(5.0); 3],
            Self::Rod { length, .. } => [zero, zero, mass * length * length / T::of(12.0)],
            Self::Cone { radius, length } => {
                let across = T::of(3.0 / 20.0) * mass * radius * radius;
                [across, across, T::of(3.0 / 80.0) * mass * length * length]
            }
            Self::Capsule { radius, length } => {
                // masses of the cylinder and of both half balls, whose centres are 3r/8 beyond the
                // ends
                let ball = T::of(4.0 / 3.0) * radius;
                let (a, b) = (mass * length / (length + ball), mass * ball / (length + ball));
                let (r, h) = (radius, T::of(0.5) * length);
                let across = a * r * r / T::of(4.0) + b * r * r / T::of(5.0);
                let along =
                    a * h * h / T::of(3.0) + b * (h * h + T::of(0.75) * h * r + r * r / T::of(5.0));
                [across, across, along]
            }
            Self::Ellipsoid { half_axes } => half_axes.map(|a| mass * a * a / T::of(5.0)),
        }
    }
}

impl Shape {
    /// Mass properties for a density, kg/m³.
    ///
    /// # Errors
    /// [`InertiaError::NotPositive`] or [`InertiaError::NotFinite`] for a density or a length,
    /// [`InertiaError::NoVolume`] for a rod without radius.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, InertiaError> {
        positive("the density", density)?;
        self.check()?;
        let volume = self.volume();
        if volume <= 0.0 {
            return Err(InertiaError::NoVolume { shape: self.name() });
        }
        self.mass_properties_of(density * volume)
    }

    /// Mass properties for a mass, kg.
    ///
    /// # Errors
    /// [`InertiaError::NotPositive`] or [`InertiaError::NotFinite`] for the mass or a length.
    pub fn mass_properties_of(&self, mass: f64) -> Result<MassProperties, InertiaError> {
        positive("the mass", mass)?;
        self.check()?;
        let moments = EulerMoments(self.euler_moments(mass)).principal_inertia();
        Ok(MassProperties { mass, inertia: PrincipalInertia::new(moments)? })
    }

    /// Its name in messages.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Box { .. } => "box",
            Self::Cylinder { .. } => "cylinder",
            Self::Sphere { .. } => "sphere",
            Self::Rod { .. } => "rod",
            Self::Cone { .. } => "cone",
            Self::Capsule { .. } => "capsule",
            Self::Ellipsoid { .. } => "ellipsoid",
        }
    }

    /// Refuses lengths that are not positive (a rod may have radius 0).
    ///
    /// # Errors
    /// [`InertiaError::NotPositive`], [`InertiaError::NotFinite`].
    pub fn check(&self) -> Result<(), InertiaError> {
        match *self {
            Self::Box { lengths } => {
                lengths.into_iter().try_for_each(|a| positive("an edge of the box", a))
            }
            Self::Cylinder { radius, length } => {
                positive("the radius of the cylinder", radius)?;
                positive("the length of the cylinder", length)
            }
            Self::Sphere { radius } => positive("the radius of the sphere", radius),
            Self::Rod { length, radius } => {
                if radius != 0.0 {
                    positive("the radius of the rod", radius)?;
                }
                positive("the length of the rod", length)
            }
            Self::Cone { radius, length } => {
                positive("the radius of the cone", radius)?;
                positive("the length of the cone", length)
            }
            Self::Capsule { radius, length } => {
                positive("the radius of the capsule", radius)?;
                positive("the length of the capsule", length)
            }
            Self::Ellipsoid { half_axes } => {
                half_axes.into_iter().try_for_each(|a| positive("a half axis of the ellipsoid", a))
            }
        }
    }
}

/// Refuses values that are not finite or not positive.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), InertiaError> {
    if !value.is_finite() {
        Err(InertiaError::NotFinite { what, value })
    } else if value <= 0.0 {
        Err(InertiaError::NotPositive { what, value })
    } else {
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // copies and zeros are expected to be exact
mod tests {
    use super::*;

    fn close(found: f64, expected: f64) {
        let error = (found / expected - 1.0).abs();
        assert!(error < 1e-14, "{found} against {expected}");
    }

    #[test]
    fn the_heavy_top_of_the_literature() {
        let top = Shape::Cone { radius: 0.05, length: 0.1 }.mass_properties(2700.0).unwrap();
        close(top.mass, 0.706_858_347_057_703_8);
        for moment in top.inertia.moments() {
            close(moment, 5.301_437_602_932_793e-4);
        }
    }

    #[test]
    fn the_formulas_of_the_handbook() {
        let (m, r, l) = (3.0, 0.4, 1.7);
        let of = |shape: Shape| shape.mass_properties_of(m).unwrap().inertia.moments();
        let [j1, j2, j3] = of(Shape::Box { lengths: [0.3, 0.5, 0.9] });
        close(j1, m * (0.25 + 0.81) / 12.0);
        close(j2, m * (0.09 + 0.81) / 12.0);
        close(j3, m * (0.09 + 0.25) / 12.0);
        let [j1, j2, j3] = of(Shape::Cylinder { radius: r, length: l });
        close(j1, m * (3.0 * r * r + l * l) / 12.0);
        close(j2, j1);
        close(j3, 0.5 * m * r * r);
        let [j1, _, j3] = of(Shape::Sphere { radius: r });
        close(j1, 0.4 * m * r * r);
        close(j3, j1);
        let [j1, j2, j3] = of(Shape::Rod { length: l, radius: 0.01 });
        close(j1, m * l * l / 12.0);
        close(j2, j1);
        assert_eq!(j3, 0.0);
        let rod = Shape::Rod { length: l, radius: 0.0 }.mass_properties_of(m).unwrap();
        assert_eq!(rod.inertia.euler_moments().0[..2], [0.0, 0.0], "two Euler moments vanish");
    }

    #[test]
    fn moments_of_a_cone_by_quadrature() {
        // slices of thickness dz at distance z from the tip, centre of mass at ¾ l
        let (r, l, slices) = (0.4, 1.1, 20_000);
        let (mut volume, mut across, mut along) = (0.0, 0.0, 0.0);
        for k in 0..slices {
            let z = l * (f64::from(k) + 0.5) / f64::from(slices);
            let radius = r * z / l;
            let dv = PI * radius * radius * l / f64::from(slices);
            volume += dv;
            across += 0.25 * radius * radius * dv;
            along += (z - 0.75 * l).powi(2) * dv;
        }
        let cone = Shape::Cone { radius: r, length: l };
        assert!((volume / cone.volume() - 1.0).abs() < 1e-7);
        let found = cone.mass_properties(1.0).unwrap().inertia.euler_moments().0;
        assert!((across / found[0] - 1.0).abs() < 1e-7, "{across} against {}", found[0]);
        assert!((along / found[2] - 1.0).abs() < 1e-7, "{along} against {}", found[2]);
    }

    #[test]
    fn impossible_shapes_are_refused() {
        let message =
            |shape: Shape, density| shape.mass_properties(density).unwrap_err().to_string();
        let ball = Shape::Sphere { radius: 1.0 };
        assert_eq!(message(ball, 0.0), "the density is 0; it must be positive");
        assert_eq!(message(ball, f64::NAN), "the density is NaN; it must be a finite number");
        assert_eq!(
            message(Shape::Box { lengths: [1.0, -1.0, 1.0] }, 1.0),
            "an edge of the box is -1; it must be positive"
        );
        assert_eq!(
            message(Shape::Rod { length: 1.0, radius: 0.0 }, 1.0),
            "the rod has no volume; give its mass instead of a density"
        );
    }
}
