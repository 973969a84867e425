//! Pictures of mode shapes: the configuration, and the configuration displaced to both sides; the
//! Campbell diagram.

use super::chart::{ChartAxis, LineChart, Series, Strokes};
use super::drawing::Point;
use super::picture::{Item, Paint, Picture, axonometric};
use holonom_sim::Beams;
use holonom_sim::modes::{Campbell, ModeKind, Report};
use holonom_sim::sample::Member;

/// Largest displacement drawn, as a part of the size of the configuration.
const AMPLITUDE: f64 = 0.15;

/// The picture of mode `k` of a report.
#[must_use]
pub fn mode_picture(report: &Report, k: usize, members: &[Member], beams: &Beams) -> Picture {
    let mode = &report.modes[k];
    let centers = centers(members, &report.configuration);
    let flat = centers.iter().all(|x| (x[2] - centers[0][2]).abs() < 1e-9)
        && mode.shape.iter().all(|m| m.translation[2].abs() < 1e-9);
    let place = |x: [f64; 3]| -> Point { if flat { [x[0], x[1]] } else { axonometric(&x) } };
    let size = size(&centers);
    let largest =
        mode.shape.iter().flat_map(|m| m.translation).fold(0.0, |a: f64, b| a.max(b.abs()));
    let amplitude = if largest > 0.0 { AMPLITUDE * size / largest } else { 0.0 };
    let at = |i: usize, sign: f64| {
        let way = &mode.shape[i].translation;
        place(std::array::from_fn(|j| centers[i][j] + sign * amplitude * way[j]))
    };
    let mut items = Vec::new();
    let mut on_beam = vec![false; members.len()];
    for (sign, paint, width) in [
        (0.0, Paint::Ink(0.35), 1.5),
        (-1.0, Paint::Curve(0, 0.4), 1.5),
        (1.0, Paint::Curve(0, 1.0), 2.5),
    ] {
        for beam in &beams.list {
            let line = beam.nodes.clone().map(|i| at(i, sign)).collect();
            items.push(Item::Line(line, paint, width));
            beam.nodes.clone().for_each(|i| on_beam[i] = true);
        }
        for i in (0..members.len()).filter(|&i| !on_beam[i]) {
            if sign > 0.0 {
                items.push(Item::Line(vec![at(i, 0.0), at(i, 1.0)], Paint::Curve(0, 0.6), 1.0));
            }
            items.push(Item::Dot(at(i, sign), paint, 3.0 + width));
        }
    }
    let what = match mode.kind {
        ModeKind::Unstable => format!("unstable, grows at {:.4} 1/s", mode.growth),
        ModeKind::Zero => "without stiffness".to_owned(),
        ModeKind::Decay => format!("dies out at {:.4} 1/s", mode.decay),
        ModeKind::Vibration => format!("{:.6} Hz", mode.frequency),
        ModeKind::Buckling => {
            format!("buckles at {:.6} × load", mode.load_factor.unwrap_or_default())
        }
    };
    Picture { title: format!("Mode {}: {what}", k + 1), width: 640.0, items }
}

/// Multiples of the speed that the Campbell diagram shows.
const MULTIPLES: [f64; 3] = [1.0, 2.0, 3.0];

/// Frequencies in the frame that rotates over the speed, with the multiples of the speed by which
/// what is fixed in space excites the system.
#[must_use]
pub fn campbell_diagram(campbell: &Campbell) -> LineChart {
    let count = campbell.speeds.first().map_or(0, |speed| speed.vibrations.len());
    let curve = |k: usize| Series {
        name: format!("mode {}", k + 1),
        points: campbell
            .speeds
            .iter()
            .filter_map(|at| Some((at.speed, at.vibrations[k].as_ref()?.frequency)))
            .collect(),
    };
    let mut curves: Vec<Series> = (0..count).map(curve).collect();
    let frequencies = curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.1));
    let highest = 1.1 * frequencies.fold(0.0, f64::max);
    let last = campbell.speeds.iter().map(|at| at.speed.abs()).fold(0.0, f64::max);
    for multiple in MULTIPLES {
        let end = last.min(std::f64::consts::TAU * highest / multiple);
        let points = vec![(0.0, 0.0), (end, multiple * end / std::f64::consts::TAU)];
        curves.push(Series { name: format!("{multiple} × speed"), points });
    }
    LineChart {
        title: "Campbell diagram, rotating frame".to_owned(),
        x: ChartAxis::linear("speed", "rad/s"),
        y: ChartAxis::linear("frequency", "Hz"),
        strokes: Strokes::Line,
        resolution: 0.0,
        marks: Vec::new(),
        curves,
    }
}

fn centers(members: &[Member], q: &[f64]) -> Vec<[f64; 3]> {
    let mut at = 0;
    let mut centers = Vec::with_capacity(members.len());
    for member in members {
        let size = member.kind.columns().len();
        let own = &q[at..at + size.min(3)];
        centers.push(std::array::from_fn(|i| own.get(i).copied().unwrap_or(0.0)));
        at += size;
    }
    centers
}

fn size(centers: &[[f64; 3]]) -> f64 {
    let side = |i: usize| {
        let of = centers.iter().map(|x| x[i]);
        of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
    };
    let size = (0..3).map(|i| side(i).powi(2)).sum::<f64>().sqrt();
    if size > 0.0 && size.is_finite() { size } else { 1.0 }
}
