//! Contact of a shape on one frame with a shape on another frame, or on the ground.

use crate::pair::joint::FrameId;
use nalgebra::Vector3;
use vi_constraints::nonsmooth::{ContactLaw, ContactPlace, ContactRows, Unilateral};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_rigid::directors::FRAME;
use vi_rigid::gap::{ContactPoint, GROUND, Pair, displacement, row, tangents};

/// Two shapes that touch.
#[derive(Clone, Debug)]
pub struct ShapeContact {
    /// Its name.
    pub name: String,
    /// What its work is listed under.
    pub source: String,
    /// The shapes.
    pub pair: Pair,
    /// The frames of both.
    pub frames: [FrameId; 2],
    /// Its law: with or without friction.
    pub law: ContactLaw,
    /// The size of a gap, m.
    pub size: f64,
}

/// The coordinates of a frame.
fn frame(of: FrameId, q: &[f64]) -> &[f64] {
    match of {
        FrameId::Ground => &GROUND,
        FrameId::Frame(k) => &q[FRAME * k..FRAME * (k + 1)],
    }
}

impl ShapeContact {
    fn at(&self, feature: u32, q: &[f64]) -> ContactPoint {
        let [a, b] = self.frames.map(|of| frame(of, q));
        self.pair.contact(feature, a, b)
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

    fn features(&self, _s: &Interval, out: &mut Vec<u32>) {
        out.extend(0..self.pair.features());
    }

    fn gap(&self, feature: u32, at: Configuration<'_>) -> f64 {
        self.at(feature, at.q).gap
    }

    fn rows(&self, feature: u32, at: Configuration<'_>, out: &mut ContactRows) {
        let ContactPoint { normal, point, .. } = self.at(feature, at.q);
        let [first, second] = tangents(&normal);
        for direction in [normal, first, second].iter().take(self.law.rows()) {
            for (of, sign) in self.frames.iter().zip([-1.0, 1.0]) {
                let FrameId::Frame(k) = *of else { continue };
                let own = row(frame(*of, at.q), &point, direction);
                own.iter().enumerate().for_each(|(i, x)| out.add(FRAME * k + i, sign * x));
            }
            out.end_row();
        }
    }

    fn slip(&self, feature: u32, s: &Interval) -> [f64; 2] {
        if self.law.rows() == 1 {
            return [0.0; 2];
        }
        let [first, last] = [&s.q0, &s.q1].map(|q| self.at(feature, q));
        let mut between = Vector3::zeros(); // Δx^B − Δx^A
        for (of, sign) in self.frames.iter().zip([-1.0, 1.0]) {
            let FrameId::Frame(k) = *of else { continue };
            let ends = [(frame(*of, &s.q0), &first.point), (frame(*of, &s.q1), &last.point)];
            between += sign * displacement(ends, &s.dq[FRAME * k..FRAME * (k + 1)]);
        }
        tangents(&first.normal).map(|tangent| tangent.dot(&between))
    }

    fn place(&self, feature: u32, at: Configuration<'_>) -> Option<ContactPlace> {
        let ContactPoint { normal, point, .. } = self.at(feature, at.q);
        let [first, second] = tangents(&normal);
        let axes = [normal, first, second].map(Into::into);
        Some(ContactPlace { point: point.into(), axes })
    }
}
