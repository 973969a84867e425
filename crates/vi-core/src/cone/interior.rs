//! Convex problems in a sequence, each by a primal–dual interior point method.
//!
//! With `s = μ|y_T|` held, the laws are the conditions of
//! ```text
//! min ½ΛᵀWΛ + (w + s e_N)ᵀΛ,   Λ_N ≥ 0, |Λ_T| ≤ μΛ_N, |Λ_B| ≤ b
//! ```
//! a convex program; its solution gives the next `s`. Source: V. Acary, F. Cadoux, C. Lemaréchal,
//! J. Malick, ZAMM 91 (2011) 155–175. With `Λ = Tx`, `A = TᵀWT`, `c = Tᵀw` each cone is its own
//! dual.
#![allow(non_snake_case)] // A, T

use super::operator::Operator;
use super::primal_dual::{LawInVector, Own, PrimalDual};
use super::problem::{Cone, ConeProblem, PlacedLaw};
use super::residual::norm;
use crate::linear::dot;
use nalgebra::Vector3;

/// Complementarity and residual to end with, of a problem whose largest `|c|` is one.
const TARGET: f64 = 1e-14;
/// Steps in a row that lead no nearer.
const PATIENCE: usize = 60;
/// Impulses of the size of one that change velocities less change none.
const STILL: f64 = 1e-9;

/// No place in `x`.
const NONE: usize = usize::MAX;

/// Where a part stands in `Λ`, and `T`: of a ray its column, of a disc its diagonal.
#[derive(Clone, Copy, Debug)]
struct Image {
    row: usize,
    map: Vector3<f64>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Interior {
    method: PrimalDual,
    images: Vec<Image>,        // parts
    places: Vec<(usize, f64)>, // k  place in x, and T there; of a place that is not, `NONE`
    A: Operator,               // m × m
    impulse: Vec<f64>,         // k
}

impl Interior {
    /// Begins with `s = 0`.
    pub(super) fn begin(&mut self, problem: &ConeProblem) {
        let k = problem.w.len();
        let Self { method, images, places, A, impulse } = self;
        method.parts.clear();
        images.clear();
        places.clear();
        places.resize(k, (NONE, 0.0));
        let mut m = 0;
        for &PlacedLaw { cone, row } in &problem.cones {
            let one = Vector3::new(1.0, 0.0, 0.0);
            let (own, map) = match cone {
                Cone::Normal => (Own::Ray, one),
                // solved by proximal steps
                Cone::Convex { .. } => continue,
                Cone::Friction { coefficient } if coefficient > 0.0 => {
                    (Own::Disc, Vector3::new(1.0, coefficient, coefficient))
                }
                Cone::Friction { .. } => (Own::Ray, one),
                Cone::Sliding { direction: [a, b], .. } => (Own::Ray, Vector3::new(1.0, -a, -b)),
                Cone::Bounded { bound } if bound > 0.0 => (Own::Interval(bound), one),
                Cone::Bounded { .. } => continue,
            };
            for i in (0..3).filter(|i| map[*i] != 0.0) {
                places[row + i] = (m + if own == Own::Disc { i } else { 0 }, map[i]);
            }
            let part = LawInVector { own, place: m, follows: false, s: 0.0 };
            m += part.size();
            method.parts.push(part);
            images.push(Image { row, map });
        }
        impulse.clear();
        impulse.resize(k, 0.0);
        method.begin(m);
        for ((place, t), w) in places.iter().zip(&problem.w).filter(|own| own.0.0 != NONE) {
            method.c[*place] += t * w;
        }
        A.assemble(m, &mut |add: &mut dyn FnMut(usize, usize, f64)| {
            problem.for_each_entry(&mut |l, n, value| {
                let ((i, s), (j, t)) = (places[l], places[n]);
                if i != NONE && j != NONE {
                    add(i, j, s * t * value);
                }
            });
        });
    }

    /// Solves the program with the present `s`, then takes `part` of the way to the next `s`.
    pub(super) fn advance(&mut self, problem: &ConeProblem, part: f64) -> &[f64] {
        self.method.solve(&mut self.A, TARGET, PATIENCE);
        self.spread(self.method.size);
        let Self { method, images, impulse, .. } = self;
        for (own, Image { row, map }) in method.parts.iter_mut().zip(&*images) {
            let y = || [1, 2].map(|i| problem.velocity(row + i, impulse));
            let next = match own.own {
                Own::Interval(_) => 0.0,
                Own::Disc => map[1] * norm(y()),
                Own::Ray if map[1] == 0.0 && map[2] == 0.0 => 0.0,
                Own::Ray => {
                    let y = y();
                    -map[1] * y[0] - map[2] * y[1]
                }
            };
            own.s += part * (next - own.s);
        }
        impulse
    }

    /// `Λ ← T x`, times a factor.
    fn spread(&mut self, factor: f64) {
        let Self { places, impulse, method, .. } = self;
        for (own, &(place, t)) in impulse.iter_mut().zip(&*places) {
            *own = if place == NONE { 0.0 } else { t * method.x[place] * factor };
        }
    }

    /// Impulses that grow without bound change no velocity and oppose the approach: the cone with
    /// the largest of them, and their direction, the largest one 1.
    pub(super) fn wedged(&mut self, problem: &ConeProblem) -> Option<(usize, &[f64])> {
        let Self { A, method: PrimalDual { parts, x, .. }, .. } = self;
        for part in parts.iter().filter(|part| matches!(part.own, Own::Interval(_))) {
            x[part.place] = 0.0;
        }
        A.resolve(STILL, x); // what A changes is gone beside the rest
        self.spread(1.0);
        let Self { impulse, .. } = self;
        let normal = |placed: &&PlacedLaw| !matches!(placed.cone, Cone::Bounded { .. });
        let size = |cone: &PlacedLaw| impulse[cone.row];
        let largest = problem.cones.iter().filter(normal).map(size).fold(0.0, f64::max);
        let cone = problem.cones.iter().position(|cone| normal(&cone) && size(cone) >= largest)?;
        impulse.iter_mut().for_each(|own| *own /= largest);
        let approach = dot(&problem.w, impulse);
        let speeds = problem.w.iter().enumerate().map(|(i, w)| problem.velocity(i, impulse) - w);
        let moved = speeds.fold(0.0, |moved: f64, speed| moved.max(speed.abs()));
        let size = problem.w.iter().map(|w| w.abs()).sum::<f64>();
        // friction that holds a jam opens with `s`: normal impulses alone wedge
        let across = |own: &PlacedLaw| {
            own.cone.rows() == 3 && norm([impulse[own.row + 1], impulse[own.row + 2]]) > STILL
        };
        let jams = problem.cones.iter().any(across);
        (largest > 0.0 && approach < -STILL * size && moved < STILL && !jams)
            .then_some((cone, &self.impulse[..]))
    }
}
