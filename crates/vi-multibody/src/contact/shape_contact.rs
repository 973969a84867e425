//! Contact of a shape on one frame with a shape on another frame, or on the ground.

use crate::pair::joint::FrameId;
use nalgebra::Vector3;
use vi_constraints::nonsmooth::{ContactLaw, ContactPlace, ContactRows, Unilateral};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_rigid::directors::FRAME;
use vi_rigid::gap::{
    ContactPoint, ContactShape, GROUND, ShapePair, contact, displacement, row, smallest_gap,
    tangents,
};

/// Two shapes that touch.
#[derive(Clone, Debug)]
pub struct ShapeContact {
    /// Its name.
    pub name: String,
    /// What its work is listed under.
    pub source: String,
    /// The shapes.
    pub pair: ShapePair,
    /// The frames of both.
    pub frames: [FrameId; 2],
    /// Its law: with or without friction.
    pub law: ContactLaw,
    /// The size of a gap, m.
    pub size: f64,
}

/// The coordinates of a frame.
pub(super) fn frame(of: FrameId, q: &[f64]) -> &[f64] {
    match of {
        FrameId::Ground => &GROUND,
        FrameId::Frame(k) => &q[FRAME * k..FRAME * (k + 1)],
    }
}

/// A feature of two shapes on their frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touching<'a> {
    pub(super) shapes: [&'a ContactShape; 2],
    pub(super) frames: [FrameId; 2],
    pub(super) feature: u32,
}

impl Touching<'_> {
    pub(super) fn at(&self, q: &[f64]) -> ContactPoint {
        let [a, b] = [0, 1].map(|k| (self.shapes[k], frame(self.frames[k], q)));
        contact(self.feature, a, b)
    }

    /// So many of its rows: of the normal, then of the tangents.
    pub(super) fn rows(&self, q: &[f64], count: usize, out: &mut ContactRows) {
        let ContactPoint { normal, point, .. } = self.at(q);
        let [first, second] = tangents(&normal);
        for direction in [normal, first, second].iter().take(count) {
            for (of, sign) in self.frames.iter().zip([-1.0, 1.0]) {
                let FrameId::Frame(k) = *of else { continue };
                let own = row(frame(*of, q), &point, direction);
                own.iter().enumerate().for_each(|(i, x)| out.add(FRAME * k + i, sign * x));
            }
            out.end_row();
        }
    }

    pub(super) fn slip(&self, s: &Interval) -> [f64; 2] {
        let [first, last] = [&s.q0, &s.q1].map(|q| self.at(q));
        let mut between = Vector3::zeros(); // Δx^B − Δx^A
        for (of, sign) in self.frames.iter().zip([-1.0, 1.0]) {
            let FrameId::Frame(k) = *of else { continue };
            let ends = [(frame(*of, &s.q0), &first.point), (frame(*of, &s.q1), &last.point)];
            between += sign * displacement(ends, &s.dq[FRAME * k..FRAME * (k + 1)]);
        }
        tangents(&first.normal).map(|tangent| tangent.dot(&between))
    }

    pub(super) fn place(&self, q: &[f64]) -> ContactPlace {
        let ContactPoint { normal, point, .. } = self.at(q);
        let [first, second] = tangents(&normal);
        let axes = [normal, first, second].map(Into::into);
        ContactPlace { point: point.into(), axes }
    }
}

impl ShapeContact {
    /// The smallest of its gaps, m; `None` where the shapes have none.
    #[must_use]
    pub fn smallest_gap(&self, at: Configuration<'_>) -> Option<f64> {
        let shapes = self.pair.shapes();
        let [a, b] = [0, 1].map(|k| (shapes[k], frame(self.frames[k], at.q)));
        smallest_gap(a, b)
    }

    fn touching(&self, feature: u32) -> Touching<'_> {
        Touching { shapes: self.pair.shapes(), frames: self.frames, feature }
    }
}

impl Unilateral for ShapeContact {
    fn name(&self) -> &str {
        &self.name
    }

    fn source(&self) -> String {
        self.source.clone()
    }

    fn law(&self) -> ContactLaw {
        self.law
    }

    fn size(&self) -> f64 {
        self.size
    }

    fn near(&self, s: &Interval, at: Configuration<'_>, out: &mut Vec<(u32, f64)>) {
        let [a, b] = self.frames.map(|of| [frame(of, &s.q0), frame(of, at.q)]);
        self.pair.active_in_step(a, b, f64::MAX, out);
    }

    fn gap(&self, feature: u32, at: Configuration<'_>) -> f64 {
        self.touching(feature).at(at.q).gap
    }

    fn rows(&self, feature: u32, at: Configuration<'_>, out: &mut ContactRows) {
        self.touching(feature).rows(at.q, self.law.rows(), out);
    }

    fn slip(&self, feature: u32, s: &Interval) -> [f64; 2] {
        if self.law.rows() == 1 { [0.0; 2] } else { self.touching(feature).slip(s) }
    }

    fn place(&self, feature: u32, at: Configuration<'_>) -> Option<ContactPlace> {
        Some(self.touching(feature).place(at.q))
    }
}
