//! Initial velocities of what rolls.

use holonom_model::{Inconsistency, Level, Model};
use nalgebra::Vector3;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::rolling::Rolling;
use vi_multibody::scalar_constraint::ScalarRow;
use vi_rigid::directors;

/// Says by how much wheels and spheres slip initially, and which angular velocity would roll where
/// a spin does.
pub(super) fn offer_rolling(
    model: &Model,
    mechanism: &Mechanism,
    q: &[f64],
    v: &[f64],
    missed: &mut [Inconsistency],
) {
    for scalar in &mechanism.description().scalars {
        let key = format!("constraint.{}", scalar.name);
        let own = missed.iter_mut().find(|own| own.key == key && own.level == Level::Velocity);
        let (Some(own), Some(ScalarRow::Height(rolling))) = (own, scalar.rows.first()) else {
            continue;
        };
        let [a, b] = rolling.slip(q, v);
        let slip = a.hypot(b);
        if slip <= 1e-3 * own.distance {
            continue; // it leaves the plane
        }
        own.detail = format!("it slips at {} m/s", digits(slip));
        let Some(omega) = rolling_spin(rolling, q, v) else { continue };
        let Some(body) = model.bodies.get(rolling.frame) else { continue };
        let [x, y, z] = [omega.x, omega.y, omega.z].map(digits);
        own.instead = Some(format!(
            "`angular_velocity = [{x}, {y}, {z}]` of the [[body]] `{}` would roll",
            body.name
        ));
    }
}

/// The angular velocity that rolls, where a change of the spin alone is enough: about the axis of a
/// wheel, about any axis in the plane of a sphere.
fn rolling_spin(rolling: &Rolling, q: &[f64], v: &[f64]) -> Option<Vector3<f64>> {
    let own = 12 * rolling.frame..12 * rolling.frame + 12;
    let omega = directors::angular_velocity(&q[own.clone()], &v[own.clone()]);
    let [a, b] = rolling.slip(q, v);
    let axes = &rolling.plane.axes;
    let slip = a * axes.column(0) + b * axes.column(1);
    let arm = rolling.contact_point(q) - directors::center(&q[own.clone()]);
    let change = match rolling.axis {
        None => -arm.cross(&slip) / arm.norm_squared(),
        Some(axis) => {
            let axis = directors::triad(&q[own]) * axis;
            let along = axis.cross(&arm);
            axis * (-along.dot(&slip) / along.norm_squared())
        }
    };
    let left = slip + change.cross(&arm);
    (left.norm() <= 1e-9 * (slip.norm() + v.iter().fold(0.0, |a: f64, b| a.max(b.abs()))))
        .then_some(omega + change)
}

/// A number with six digits.
fn digits(x: f64) -> f64 {
    format!("{x:.5e}").parse().map_or(x, |x: f64| x + 0.0)
}
