//! How the rates of coordinates change with a parameter where joints state rates.
//!
//! ```text
//! joint with a rate:            δẋ of the file
//! beam that a frame m carries:  δω = δω_m,  δv = δv_m + δω_m × (c − c_m) + ω_m × (δc − δc_m)
//! body with a velocity of its own, on a joint without a rate:   δ(∇x v), v of the body as stated
//! ```

use super::ModelTangent;
use crate::start::independent::TreeCoordinate;
use holonom_model::Model;
use nalgebra::Vector3;
use vi_constraints::InitialValues;
use vi_multibody::design::start::{self, StartCoordinate};
use vi_multibody::mechanism::Mechanism;
use vi_rigid::directors::{self, FRAME};

/// What rates follow from.
pub(super) struct FollowedRates<'a> {
    pub(super) model: &'a Model,
    pub(super) mechanism: &'a Mechanism,
    pub(super) at: InitialValues<'a>,
    pub(super) own: &'a ModelTangent,
    pub(super) dq: &'a [f64],
}

impl FollowedRates<'_> {
    /// The change of each rate where velocities change by `dv`.
    pub(super) fn of_all(&self, chosen: &[TreeCoordinate], dv: &[f64]) -> Vec<f64> {
        chosen.iter().map(|coordinate| self.of_one(coordinate, dv)).collect()
    }

    fn of_one(&self, (joint, freedom, coordinate): &TreeCoordinate, dv: &[f64]) -> f64 {
        let is_it = |own: &&(usize, usize, f64)| (Some(own.0), own.1) == (*joint, *freedom);
        if let Some((.., slope)) = self.own.rates.iter().find(is_it) {
            return *slope;
        }
        match (joint, coordinate) {
            (Some(joint), _) => self.of_joint(*joint, coordinate, dv),
            (None, StartCoordinate::Place(i)) => match self.carried(i / FRAME, dv) {
                Some([velocity, _]) => velocity[i % FRAME],
                None => self.own.v[*i],
            },
            (None, StartCoordinate::Turn { frame, axis, .. }) => match self.carried(*frame, dv) {
                Some([_, omega]) => omega[*axis],
                None => self.own.omega.get(frame * 3 + axis).copied().unwrap_or_default(),
            },
            (None, StartCoordinate::Joint(_)) => 0.0,
        }
    }

    /// `δv` of the centre and `δω` of a frame that another one carries.
    fn carried(&self, frame: usize, dv: &[f64]) -> Option<[Vector3<f64>; 2]> {
        let carried = &self.mechanism.description().carried;
        let m = carried.iter().find(|own| own.frames.contains(&frame))?.with;
        let InitialValues { q, v, .. } = self.at;
        let of = |k: usize| FRAME * k..FRAME * (k + 1);
        let omega = directors::angular_velocity(&q[of(m)], &v[of(m)]);
        let change = directors::angular_velocity(&self.dq[of(m)], &v[of(m)])
            + directors::angular_velocity(&q[of(m)], &dv[of(m)]);
        let arm = |x: &[f64]| directors::center(&x[of(frame)]) - directors::center(&x[of(m)]);
        let velocity =
            directors::center(&dv[of(m)]) + change.cross(&arm(q)) + omega.cross(&arm(self.dq));
        Some([velocity, change])
    }

    /// Of a joint without a rate: zero, unless its child states a velocity.
    fn of_joint(&self, joint: usize, coordinate: &StartCoordinate, dv: &[f64]) -> f64 {
        let Self { model, mechanism, at, .. } = *self;
        let child = mechanism.description().joints.get(joint).map(|own| own.child.frame);
        let Some(vi_multibody::joint::FrameId::Frame(child)) = child else { return 0.0 };
        let is_stated = model.bodies.get(child).is_some_and(|body| {
            body.velocity.iter().any(|x| *x != 0.0) || body.spatial_angular_velocity().norm() > 0.0
        });
        if !is_stated {
            return 0.0;
        }
        let mut dv = dv.to_vec();
        let child = FRAME * child..FRAME * (child + 1);
        dv[child.clone()].copy_from_slice(&self.own.v[child]);
        start::stated_change(mechanism, &self.own.numbers, coordinate, at, [self.dq, &dv])[1]
    }
}
