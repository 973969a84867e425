//! Points without a radius, such as the corners of a mesh, on boxes and cylinders.
//!
//! ```text
//! s_f(x)      how far a point is outside of face f, a plane or the side of a cylinder
//! S_f         min s_f(x) over all points of the shape; of a side that of its tangent plane towards
//!             the mean of the points
//! ```
//! A feature is a point and a face; its gap `s_f` is smooth also beyond the edges of the face. A
//! point counts with one face:
//!
//! | where it is | face |
//! |---|---|
//! | outside | that of the largest `s_f` |
//! | inside | that which it has passed last in the step, on a straight way |
//! | inside all along | that of the largest `s_f⁰` |
//!
//! `s_f⁰` is of the start of the step. The gap that is least is so a continuous function of the
//! step, zero where a point comes to the surface. Of faces alike but for rounding, as at an edge,
//! the one counts that parts most of the shape, of the largest `S_f`: a body whose corners are on
//! edges stands on a face. On the surface these are all faces there, and the one that was passed.

use super::contact_point::in_space;
use super::solids::{SIDE, Solid};
use nalgebra::Vector3;

/// Faces that are alike, in parts of the size of the solid.
const TIE: f64 = 1e-9;

/// A number for each face; `−∞` of those that a solid does not have.
type Faces = [f64; 6];

/// A solid at the start of a step and now, and points on another frame.
struct SolidSearch<'a> {
    solid: [Solid; 2],
    points: &'a [Vector3<f64>],
    frames: [&'a [f64]; 2],
    tie: f64,
    parts: Option<Faces>, // S_f
}

/// Appends the points that may touch, each with its face, in ascending order of their numbers.
pub(super) fn active(
    solid: [Solid; 2],
    points: &[Vector3<f64>],
    frames: [&[f64]; 2],
    reach: f64,
    out: &mut Vec<(u32, f64)>,
) {
    let (tie, faces) = (TIE * solid[1].size(), solid[1].faces());
    let mut search = SolidSearch { solid, points, frames, tie, parts: None };
    for (k, point) in (0..).zip(points) {
        let now = search.beyond(1, point);
        if largest(&now) <= reach {
            let face = search.face(point, &now);
            out.push((faces * k + face as u32, now[face]));
        }
    }
}

fn largest(of: &Faces) -> f64 {
    of.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

impl SolidSearch<'_> {
    fn beyond(&self, when: usize, point: &Vector3<f64>) -> Faces {
        self.solid[when].beyond(&in_space(self.frames[when], point))
    }

    /// The face with which a point counts.
    fn face(&mut self, point: &Vector3<f64>, now: &Faces) -> usize {
        let (most, tie) = (largest(now), self.tie);
        if most > tie {
            return self.parting(|f| now[f] >= most - tie);
        }
        let start = self.beyond(0, point);
        let passed = self.passed(point, &start, now);
        let last = largest(&passed);
        let is_there = |f: usize| now[f] >= -tie;
        if last > 0.0 {
            return self.parting(|f| passed[f] >= last * (1.0 - TIE) || is_there(f));
        }
        let most = largest(&start);
        self.parting(|f| start[f] >= most - tie || is_there(f))
    }

    /// In which part of the step a point has passed each face from outside; 0 where it has not.
    fn passed(&self, point: &Vector3<f64>, start: &Faces, now: &Faces) -> Faces {
        let mut passed: Faces = std::array::from_fn(|f| {
            if start[f] > self.tie { start[f] / (start[f] - now[f]) } else { 0.0 }
        });
        if let [Solid::Cylinder(..), Solid::Cylinder(.., radius)] = self.solid
            && start[SIDE] > self.tie
        {
            let at = |when: usize| in_space(self.frames[when], point);
            let [from, to] = [0, 1].map(|when| self.solid[when].across(&at(when)));
            let way = to - from;
            // |from + t way| = R
            let (a, b, c) =
                (way.norm_squared(), from.dot(&way), from.norm_squared() - radius * radius);
            passed[SIDE] = c / (-b + (b * b - a * c).max(0.0).sqrt());
        }
        passed
    }

    /// Of these faces the one that parts most of the points; the first of such.
    fn parting(&mut self, is_one: impl Fn(usize) -> bool) -> usize {
        let faces = self.solid[1].faces() as usize;
        let mut found = (0..faces).filter(|f| is_one(*f));
        let first = found.next().unwrap_or(0); // where a coordinate is not a number
        let Some(second) = found.next() else { return first };
        let parts = *self.parts.get_or_insert_with(|| {
            let each = || self.points.iter().map(|x| in_space(self.frames[1], x));
            let mean = each().sum::<Vector3<f64>>() / self.points.len() as f64;
            each().fold([f64::INFINITY; 6], |least, x| {
                let own = self.solid[1].beyond_tangent(&x, &mean);
                std::array::from_fn(|f| least[f].min(own[f]))
            })
        });
        let better =
            |best: usize, f: usize| if parts[f] > parts[best] + self.tie { f } else { best };
        found.fold(better(first, second), better)
    }
}
