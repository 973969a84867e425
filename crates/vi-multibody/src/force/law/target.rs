//! What a law acts on: the coordinates of its efforts, at both ends of a step and at a node.
//!
//! ```text
//! joint     f_d^∓ = (h/2) τ ∇θ(q_n | q_{n+1})
//! points    f_d^∓ = −(h/2) T D̂(q_{n+1/2})  on X_b, opposite on X_a
//! member    as crate::wrench_law;  relative to a frame as super::relative
//! ```

use super::input::Input;
use super::place::EffortAxes;
use super::relative::RelativeWrench;
use super::turning::{Turning, ends};
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::force::acts_on::{ActsOn, Block12};
use crate::force::bends::{Between, Pushes};
use crate::geometry::form::Form;
use vi_core::sparse::{Block, Entries, Product};

/// What a law acts on.
#[derive(Clone, Debug)]
pub enum Target {
    /// A joint coordinate: an effort along it, N or N·m.
    Coordinate(JointCoordinate),
    /// Two points, `D = X_b − X_a`: a tension, N, that pulls them together.
    Points(Form),
    /// A body or a point mass: force (N) and torque (N·m).
    Member(ActsOn),
    /// The same along the axes of a frame, which takes the opposite.
    Relative(Box<RelativeWrench>),
}

impl Target {
    /// How many efforts it takes.
    #[must_use]
    pub fn count(&self) -> usize {
        match self {
            Self::Coordinate(_) | Self::Points(_) => 1,
            Self::Member(_) | Self::Relative(_) => 6,
        }
    }

    /// Whether it pushes against the ground or a direction that is fixed in space.
    pub(super) fn is_seen_from_ground(&self) -> bool {
        match self {
            Self::Coordinate(own) => own.is_length_from_ground(),
            Self::Points(form) => form.is_seen_from_ground(),
            Self::Member(_) => true,
            Self::Relative(_) => false,
        }
    }

    /// `out ← out + scale Σ_k effort_k direction_k`.
    pub(super) fn add(&self, at: EffortAxes<'_>, scale: f64, efforts: &[f64], out: &mut [f64]) {
        match self {
            Self::Coordinate(own) => own.add_gradient(at.own, scale * efforts[0], out),
            Self::Points(form) => {
                let (along, _) = Input::direction(form, at.mid);
                form.add_transposed(&(-scale * efforts[0] * along), out);
            }
            Self::Member(on) => {
                let wrench = std::array::from_fn(|k| efforts[k]);
                let wrench = on.spatial(wrench, &on.own(at.mid));
                on.add_wrench(scale, wrench, &on.own(at.own), out);
            }
            Self::Relative(own) => {
                own.add(at, scale, std::array::from_fn(|k| efforts[k]), out);
            }
        }
    }

    /// The entries of `direction_k`, always in the same order.
    pub(super) fn for_each_direction(
        &self,
        at: EffortAxes<'_>,
        k: usize,
        visit: &mut dyn FnMut(usize, f64),
    ) {
        match self {
            Self::Coordinate(own) => own.for_each_slope(at.own, visit),
            Self::Points(form) => {
                let (along, _) = Input::direction(form, at.mid);
                form.for_each_slope(&-along, visit);
            }
            Self::Member(on) => {
                let mut unit = [0.0; 6];
                unit[k] = 1.0;
                let [f, m] = on.spatial(unit, &on.own(at.mid));
                let columns = on.columns(&on.own(at.own));
                for i in 0..on.size() {
                    let of = |first: usize, x: nalgebra::Vector3<f64>| {
                        (0..3).map(|j| columns[(i, first + j)] * x[j]).sum::<f64>()
                    };
                    visit(on.offset() + i, of(0, f) + of(3, m));
                }
            }
            Self::Relative(own) => own.for_each_direction(at, k, visit),
        }
    }

    /// Emits `scale Σ_k effort_k ∂direction_k/∂q` where directions at `mid` move by `share δq` and
    /// those of `own` by δq where they `follow`.
    pub(super) fn emit_turning(
        &self,
        at: EffortAxes<'_>,
        (share, follows): (f64, bool),
        scale: f64,
        efforts: &[f64],
        out: &mut dyn Entries,
    ) {
        match self {
            Self::Coordinate(own) => {
                if follows {
                    own.emit_second(at.own, scale * efforts[0], out);
                }
            }
            Self::Points(form) => {
                let (_, turning) = Input::direction(form, at.mid);
                form.emit_congruence(&(-scale * share * efforts[0] * turning), out);
            }
            Self::Member(on) => {
                let ActsOn::Frame { axes, .. } = on else { return };
                let wrench: [f64; 6] = std::array::from_fn(|k| efforts[k]);
                let mut block = Block12::zeros();
                if axes.is_some() {
                    block = on.columns(&on.own(at.own)) * on.turned_axes(&wrench, share);
                }
                on.emit(scale, &block, out);
                if follows {
                    let [_, torque] = on.spatial(wrench, &on.own(at.mid));
                    on.turn_levers(scale, &torque, out);
                }
            }
            Self::Relative(own) => {
                let wrench = std::array::from_fn(|k| efforts[k]);
                own.emit_turning(at, share, follows, scale, wrench, out);
            }
        }
    }
}

impl Target {
    /// `out ← out + scale ∂_i Σ_k τ_k a_k`, shape `n`.
    fn add_slope_along(
        &self,
        ends: &[(EffortAxes<'_>, &[f64], (f64, bool))],
        efforts: &[f64],
        scale: f64,
        out: &mut [f64],
    ) {
        for (place, y, turns) in ends {
            let into = &mut Product { v: y, out: &mut *out };
            let mut along = Block { into, row: 0, column: 0, scale: 1.0, transposed: true };
            self.emit_turning(*place, *turns, scale, efforts, &mut along);
        }
    }
}

impl Pushes for Target {
    fn along(&self, at: Between<'_>, y: [&[f64]; 2], k: usize) -> f64 {
        let mut sum = 0.0;
        for (place, y, _) in ends(at, y, 0) {
            self.for_each_direction(place, k, &mut |i, own| sum += own * y[i]);
        }
        sum
    }

    fn slope(&self, at: Between<'_>, y: [&[f64]; 2], k: usize, group: usize) -> Vec<f64> {
        let mut unit = [0.0; 6];
        unit[k] = 1.0;
        let mut slope = vec![0.0; y[0].len()];
        self.add_slope_along(&ends(at, y, group), &unit, 1.0, &mut slope);
        slope
    }

    fn emit_second(
        &self,
        at: Between<'_>,
        y: [&[f64]; 2],
        (efforts, scale): (&[f64], f64),
        [i, j]: [usize; 2],
        out: &mut dyn Entries,
    ) {
        match self {
            Self::Coordinate(own) => {
                if let Some(q) = at.positions([i, j]) {
                    own.emit_third(q, y[i], scale * efforts[0], out);
                }
            }
            Self::Points(form) => {
                let [q, _] = at.middle();
                let both = match at {
                    Between::Ends(_) => form.length_third(q, y[0]) + form.length_third(q, y[1]),
                    Between::Node { .. } => form.length_third(q, y[0]),
                };
                let part = at.parts(i)[0] * at.parts(j)[0];
                form.emit_congruence(&(-scale * part * efforts[0] * both), out);
            }
            Self::Member(on) => {
                let efforts = std::array::from_fn(|k| efforts[k]);
                Turning { on, base: None, carrier: on, efforts }.emit(at, y, scale, [i, j], out);
            }
            Self::Relative(own) => {
                let efforts = std::array::from_fn(|k| efforts[k]);
                let (on, base, carrier) = (&own.on, Some(&own.base), own.carrier());
                Turning { on, base, carrier, efforts }.emit(at, y, scale, [i, j], out);
            }
        }
    }
}
