//! The centre lines of beams at some instants of a run, as one picture.

use super::drawing::Point;
use super::picture::{Item, LabelSide, Paint, Picture, axonometric};
use holonom_model::{Beam, Model};
use holonom_sim::output::Frames;
use nalgebra::Vector3;
use vi_beam::section_force::cubic_line;

/// Instants that are drawn at most.
pub(super) const INSTANTS: usize = 9;
/// Points of a centre line, about.
const POINTS: usize = 200;

/// The beams of `model` at the instants of `frames`, pale first; bodies and point masses as dots.
/// `None` without beams, and where the frames are of another model. A motion in a plane of two axes
/// of space is seen from in front, others from aside.
#[must_use]
pub fn shapes(model: &Model, frames: &Frames) -> Option<Picture> {
    let snapshots: Vec<Vec<[f64; 3]>> =
        (0..frames.q.len()).map(|i| frames.points(i).collect()).collect();
    let nodes: usize = model.beams.iter().map(Beam::node_count).sum();
    let fits = frames.members.len() == model.bodies.len() + nodes + model.particles.len();
    let last = snapshots.last().filter(|_| nodes > 0 && fits)?;
    let place = projection(&snapshots);
    let mut items = Vec::new();
    for (i, points) in snapshots.iter().enumerate() {
        let strength = 0.25 + 0.75 * (i + 1) as f64 / snapshots.len() as f64;
        let mut first = model.bodies.len();
        for (k, beam) in model.beams.iter().enumerate() {
            let paint = Paint::Curve(k, strength);
            for line in lines(beam, &points[first..]) {
                items.push(Item::Line(line.iter().map(&place).collect(), paint, 2.0));
            }
            first += beam.node_count();
        }
        let bodies = points[..model.bodies.len()].iter();
        for point in bodies.chain(&points[first..]) {
            items.push(Item::Dot(place(point), Paint::Ink(0.6 * strength), 3.0));
        }
    }
    let mut first = model.bodies.len();
    for (k, beam) in model.beams.iter().enumerate() {
        let end = first + beam.node_count() - 1;
        let words = Item::Words(
            place(&last[end]),
            Paint::Curve(k, 1.0),
            beam.name.clone(),
            LabelSide::Right,
        );
        items.push(words);
        first = end + 1;
    }
    Some(Picture { title: "Centre lines".into(), width: 880.0, items })
}

/// What the picture of instants shows, in words; in statics they are load factors.
#[must_use]
pub fn caption(times: &[f64], statics: bool) -> String {
    let times: Vec<String> = times.iter().map(|t| format!("{t:.4}")).collect();
    let times = times.iter().map(|t| t.trim_end_matches('0').trim_end_matches('.'));
    let times: Vec<&str> = times.collect();
    let times = times.join(", ");
    match statics {
        true => format!("At the load factors {times}, the last in full colour."),
        false => format!("At t = {times} s, the last in full colour."),
    }
}

/// One smooth line for each leg; `nodes`: those of the beam come first.
fn lines(beam: &Beam, nodes: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
    let mut first = 0;
    let leg = |mesh: vi_beam::BeamMesh| {
        let own = &nodes[first..first + mesh.centers.len()];
        first += own.len();
        let own: Vec<Vector3<f64>> = own.iter().map(|x| Vector3::from(*x)).collect();
        let per_interval = POINTS.div_ceil(own.len());
        let line = cubic_line(&own, &mesh.lengths, per_interval);
        line.into_iter().map(Into::into).collect()
    };
    beam.meshes().unwrap_or_default().into_iter().map(leg).collect()
}

/// From space to the plane.
fn projection(snapshots: &[Vec<[f64; 3]>]) -> impl Fn(&[f64; 3]) -> Point + use<> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for point in snapshots.iter().flatten() {
        for i in 0..3 {
            (low[i], high[i]) = (low[i].min(point[i]), high[i].max(point[i]));
        }
    }
    let extent: [f64; 3] = std::array::from_fn(|i| high[i] - low[i]);
    let largest = extent.iter().copied().fold(0.0, f64::max);
    let flat = (0..3).rev().find(|&i| extent[i] <= 1e-6 * largest);
    move |x| match flat {
        Some(2) => [x[0], x[1]],
        Some(1) => [x[0], x[2]],
        Some(_) => [x[1], x[2]],
        None => axonometric(x),
    }
}
