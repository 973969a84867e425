//! Wheels, spheres and blades by a parameter.
//!
//! ```text
//! a_body = Rᵀ a/|a|,   n/|n|, e_1, e_2 as the mechanism completes them,   o,  R_c = R − b,  b,  Ω
//! ```
//! Axis and plane are stated in space or in a frame, and the axis is fixed in its body as that is
//! placed initially: bodies and frames that move with the parameter take part.

use super::{LEAVE_OUT, NumberChain, eps, refused};
use holonom_model::{Constraint, ModelError};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_multibody::design::ScalarTangent;
use vi_multibody::form::Form;
use vi_multibody::joint::complete_axis;
use vi_multibody::rolling::{RolledPlane, Rolling};
use vi_multibody::scalar_constraint::ScalarRow;
use vi_rigid::directors::FRAME;

/// By how much numbers may differ from those of the mechanism.
const AGREEMENT: f64 = 1e-9;

impl NumberChain<'_> {
    /// A wheel or a sphere, scalar constraint `k` of the mechanism.
    pub(super) fn rolling(
        &self,
        key: &str,
        k: usize,
        constraint: &Constraint,
    ) -> Result<Option<ScalarTangent>, ModelError> {
        let Constraint::Rolling { body, axis, radius, tube, plane, relative_to, .. } = constraint
        else {
            return Ok(None);
        };
        let scalar = &self.system.mechanism.description().scalars[k];
        let (Some(ScalarRow::Height(own)), Some(frame)) =
            (scalar.rows.first(), self.model.frame(body))
        else {
            return Ok(None);
        };
        let base = self.placements.base(relative_to.as_deref());
        let vector = |part: &str, own: [f64; 3]| self.slopes.vector(&format!("{key}.{part}"), own);
        let number = |part: &str, own: f64| self.slopes.number(&format!("{key}.{part}"), own);
        let normal = base.rotation * vector("plane.normal", plane.normal);
        let axis = axis.map(|own| (base.rotation * vector("axis", own)).normalize());
        let tube = number("tube", *tube);
        let radius = number("radius", *radius);
        let circle = if axis.is_some() { radius - tube } else { Dual64::of(0.0) };
        let found = Rolling {
            frame,
            axis: axis.map(|axis| self.placed(frame).1.tr_mul(&axis)),
            circle,
            section: radius - circle,
            plane: RolledPlane {
                origin: base.point(vector("plane.position", plane.position)),
                axes: complete_axis(&normal.normalize()),
                spin: number("plane.spin", plane.spin),
            },
        };
        if apart(&found, own) > AGREEMENT {
            let what = "the derivative by the geometry of what rolls".to_owned();
            return Err(refused(key, what, LEAVE_OUT));
        }
        Ok(moves(&found).then(|| ScalarTangent::Rolling(Arc::new(found))))
    }

    /// A blade, scalar constraint `k` of the mechanism.
    pub(super) fn blade(
        &self,
        key: &str,
        k: usize,
        body: &str,
        position: [f64; 3],
        axis: [f64; 3],
        relative_to: Option<&str>,
    ) -> Result<Option<ScalarTangent>, ModelError> {
        let Some(frame) = self.model.frame(body) else { return Ok(None) };
        let base = self.placements.base(relative_to);
        let axis = base.rotation * self.slopes.vector(&format!("{key}.axis"), axis);
        let point = base.point(self.slopes.vector(&format!("{key}.position"), position));
        let (center, triad) = self.placed(frame);
        let along = triad.tr_mul(&axis.normalize());
        let arm = triad.tr_mul(&(point - center));
        if eps(&along).amax() == 0.0 && eps(&arm).amax() == 0.0 {
            return Ok(None);
        }
        let offset = FRAME * frame;
        let forms = [Form::vector(offset, &along), Form::point(offset, &arm)];
        self.same_blade(key, k, &forms)?;
        Ok(Some(ScalarTangent::Blade(Box::new(forms))))
    }

    /// Refuses forms that are not those of the mechanism: what they make of a step is compared.
    fn same_blade(
        &self,
        key: &str,
        k: usize,
        [direction, point]: &[Form<Dual64>; 2],
    ) -> Result<(), ModelError> {
        let mechanism = &self.system.mechanism;
        let q = mechanism.initial_configuration();
        let v: Vec<f64> = (0..q.len()).map(|i| libm::sin(1.3 * i as f64 + 0.4)).collect();
        let row = mechanism.description().scalars[k].rows.first();
        let mut own = 0.0;
        if let Some(row) = row {
            row.add_rate(&q, &v, &mut own);
        }
        let found = direction.at(&q).dot(&point.rate(&v)).re;
        match (found - own).abs() <= AGREEMENT * (1.0 + own.abs()) {
            true => Ok(()),
            false => {
                let what = "the derivative by the geometry of a blade".to_owned();
                Err(refused(key, what, LEAVE_OUT))
            }
        }
    }
}

/// Whether any number changes.
fn moves(own: &Rolling<Dual64>) -> bool {
    let RolledPlane { origin, axes, spin } = &own.plane;
    let axis = own.axis.unwrap_or_else(Vector3::zeros);
    let vectors = axis.iter().chain(origin).chain(axes);
    vectors.chain([&own.circle, &own.section, spin]).any(|x| x.eps != 0.0)
}

/// How far values are from those of the mechanism.
fn apart(found: &Rolling<Dual64>, own: &Rolling) -> f64 {
    let of = |x: &Vector3<Dual64>, own: &Vector3<f64>| (x.map(|x| x.re) - own).amax();
    let axis = match (&found.axis, &own.axis) {
        (Some(found), Some(own)) => of(found, own),
        (None, None) => 0.0,
        _ => f64::INFINITY,
    };
    let (plane, was) = (&found.plane, &own.plane);
    let axes = (plane.axes.map(|x| x.re) - was.axes).amax();
    let numbers =
        [(found.circle, own.circle), (found.section, own.section), (plane.spin, was.spin)];
    let numbers = numbers.iter().map(|(found, own)| (found.re - own).abs());
    let origin = of(&plane.origin, &was.origin) / (1.0 + was.origin.amax());
    numbers.fold(axis.max(axes).max(origin), f64::max)
}
