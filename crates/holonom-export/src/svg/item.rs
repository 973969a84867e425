//! What is drawn: points that move with members of the run.

use super::hull::{extreme, hull};
use super::view::{Directions, PlanePoint};
use crate::look::{INK, Look, NamedBeam, NamedLine, Rgb, holds, point};
use crate::tube::MemberPose;
use holonom_report::scene::parts::SceneEnd;
use std::cmp::Ordering;

/// How an item is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) enum ItemStyle {
    /// The hull of its points, filled.
    Surface,
    /// A line of this thickness, m.
    Line(f64),
}

/// A body, a beam, a line or a joint at all frames.
#[derive(Debug)]
pub(super) struct SvgItem {
    pub(super) stroke: ItemStyle,
    pub(super) color: Rgb,
    pub(super) opacity: f64, // in [0, 1]
    source: Vec<SceneEnd>,
    pub(super) frames: Vec<Vec<PlanePoint>>,
    /// When an event released it, s.
    until: Option<f64>,
    /// Frames in which it is there.
    pub(super) held: usize,
    depth: f64, // sum over frames, of their mean depths
    on_top: bool,
}

/// All items of a run.
pub(super) fn all(look: &Look) -> Vec<SvgItem> {
    let of = |member: usize, point: [f64; 3]| SceneEnd { member: member as i64, point };
    let solids = look.solids.iter().flat_map(|solid| {
        solid.parts().map(move |points| {
            let points = extreme(points).into_iter().map(|point| of(solid.member, point));
            let item = SvgItem::new(ItemStyle::Surface, solid.color, points.collect());
            SvgItem { opacity: solid.opacity, ..item }
        })
    });
    let beams = look.beams.iter().flat_map(|beam: &NamedBeam| {
        let [a, b] = beam.beam.half;
        let thickness = (2.0 * a.max(b)).min(2.0 * look.symbol);
        beam.legs().into_iter().map(move |leg| {
            let nodes = leg.map(|node| of(node, [0.0; 3])).collect();
            SvgItem::new(ItemStyle::Line(thickness), beam.color, nodes)
        })
    });
    let lines = look.lines.iter().map(|NamedLine { line, spring, .. }| {
        let thickness = if *spring { 0.4 } else { 0.8 } * look.symbol;
        let ends = vec![line.from.clone(), line.to.clone()];
        SvgItem { until: line.until, ..SvgItem::new(ItemStyle::Line(thickness), INK, ends) }
    });
    // a line of no length with round ends is a dot
    let joints = look.joints.iter().flat_map(|named| {
        let dot = vec![named.joint.child.clone(); 2];
        let symbol = look.symbol.min(named.joint.limit);
        let dot = SvgItem::new(ItemStyle::Line(1.6 * symbol), INK, dot);
        let axes =
            [(&named.joint.parent, named.joint.axis), (&named.joint.child, named.joint.axis2)];
        let axes = axes.map(|(end, axis)| Some(pin(end, &axis?, 5.0 * symbol)));
        let lines = axes.into_iter().flatten();
        let until = named.joint.until;
        std::iter::once(dot)
            .chain(lines.map(move |ends| SvgItem::new(ItemStyle::Line(0.7 * symbol), INK, ends)))
            .map(move |item| SvgItem { until, ..item })
    });
    // a plate on the ground is seen from aside, a line across
    let feet = look.feet.iter().map(|place| {
        let up = nalgebra::Vector3::from(look.up);
        let across = up.cross(&nalgebra::Vector3::new(0.0, -1.0, 0.0));
        let across = if across.norm() > 1e-3 { across.normalize() } else { nalgebra::Vector3::x() };
        let at = SceneEnd { member: -1, point: *place };
        SvgItem::new(
            ItemStyle::Line(0.9 * look.symbol),
            INK,
            pin(&at, &across.into(), 1.5 * look.symbol),
        )
    });
    let joints = joints.map(|item| SvgItem { on_top: true, ..item });
    solids.chain(beams).chain(lines).chain(feet).chain(joints).collect()
}

/// An axis through a point of a member, `half` of its length to either side, m.
fn pin(end: &SceneEnd, axis: &[f64; 3], half: f64) -> Vec<SceneEnd> {
    let norm = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    let factor = if norm > 0.0 { half / norm } else { 0.0 };
    let at = |sign: f64| SceneEnd {
        member: end.member,
        point: std::array::from_fn(|i| end.point[i] + sign * factor * axis[i]),
    };
    vec![at(-1.0), at(1.0)]
}

impl SvgItem {
    fn new(stroke: ItemStyle, color: Rgb, source: Vec<SceneEnd>) -> Self {
        let (frames, until, held) = (Vec::new(), None, 0);
        let (depth, on_top, opacity) = (0.0, false, 1.0);
        Self { stroke, color, opacity, source, frames, until, held, depth, on_top }
    }

    /// Adds a frame at a time, s; what was released stays where it was last.
    pub(super) fn follow(&mut self, t: f64, poses: &[MemberPose], view: &Directions) {
        if let Some(last) = self.frames.last().filter(|_| !holds(self.until, t)) {
            self.frames.push(last.clone());
            return;
        }
        self.held += 1;
        let places = self.source.iter().map(|end| view.of(&point(end, poses)));
        let (places, depths): (Vec<PlanePoint>, Vec<f64>) = places.unzip();
        self.depth += depths.iter().sum::<f64>() / depths.len().max(1) as f64;
        self.frames.push(match self.stroke {
            ItemStyle::Surface => hull(places),
            ItemStyle::Line(_) => places,
        });
    }

    pub(super) fn points(&self) -> impl Iterator<Item = &PlanePoint> {
        self.frames.iter().flatten()
    }

    /// Which of two items lies below: bodies, beams and lines by their mean depth, joints above
    /// them.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.on_top.cmp(&other.on_top).then(self.depth.total_cmp(&other.depth))
    }
}
