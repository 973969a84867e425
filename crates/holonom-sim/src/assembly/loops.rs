//! What is said of closed loops: that they are locked, or move within `simulation.loop_tolerance`.

use super::bar_loops;
use crate::digits::rounded;
use holonom_model::Model;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vi_constraints::Constraints;
use vi_core::Configuration;
use vi_multibody::joint::Joint;
use vi_multibody::loop_survey::{LoopSurvey, survey};
use vi_multibody::mechanism::Mechanism;

/// Angles up to which axes are taken to be meant parallel or perpendicular, rad.
const MEANT: f64 = 0.2;
/// Angles and distances of rounding, relative.
const ROUNDING: f64 = 1e-13;

/// What is wrong with the axes of a loop.
enum Flaw<'a> {
    /// Axes of rotation are meant parallel, and one is off by an angle, rad.
    Turned(&'a str, f64),
    /// A slide is meant perpendicular to the axes of rotation.
    Slides(&'a str, f64),
    /// Two hinges are meant on one line, and are a distance apart, m.
    Beside(&'a str, &'a str, f64),
}

/// The remarks on the loops of a mechanism at its initial configuration, with `dof` degrees of
/// freedom.
pub(crate) fn remarks(model: &Model, mechanism: &Mechanism, q: &[f64], dof: usize) -> Vec<String> {
    let nearly = mechanism.nearly_redundant();
    let loops = match has_loops_of_bodies(mechanism) {
        true => survey(mechanism, 0.0, q, nearly),
        false => Vec::new(),
    };
    let tolerance = model.settings.loop_tolerance;
    let rounding = model.settings.start_tolerance;
    let mut out: Vec<String> = loops
        .iter()
        .filter(|found| found.nearly)
        .filter_map(|found| accepted(mechanism, found, q, [tolerance, rounding]))
        .collect();
    let locked: Vec<String> = loops
        .iter()
        .filter(|found| found.freedom == 0 && !found.nearly)
        .filter_map(|found| {
            Some(locked(mechanism, found, q, tolerance))
                .filter(|_| dof == 0 || is_slip(mechanism, found, q))
        })
        .collect();
    let bars = bar_loops::remarks(mechanism, q, tolerance);
    if dof == 0 && !mechanism.is_rheonomic() && mechanism.dim() > 0 {
        let mut note =
            "nothing can move: the model has 0 degrees of freedom, and no motion is prescribed"
                .to_owned();
        if let Some(why) = locked.iter().chain(&bars).next() {
            note += &format!("; {why}");
        }
        out.push(note);
    } else {
        out.extend(locked.into_iter().filter(|_| !mechanism.is_rheonomic() || dof > 0));
        out.extend(bars);
    }
    out
}

/// Whether there are loops of bodies, and no constraint has coordinates of bodies and of point
/// masses.
fn has_loops_of_bodies(mechanism: &Mechanism) -> bool {
    mechanism.has_loops_of_bodies() && mechanism.separates_points()
}

/// Why loops of a mechanism are locked, for an error: prescribed motions left out.
pub(crate) fn locks(mechanism: &Mechanism, tolerance: f64) -> Option<String> {
    if !has_loops_of_bodies(mechanism) {
        return None;
    }
    let q = mechanism.initial_configuration();
    let loops = survey(mechanism, 0.0, &q, mechanism.nearly_redundant());
    let found =
        loops.into_iter().find(|found| found.freedom == 0 && is_slip(mechanism, found, &q))?;
    Some(locked(mechanism, &found, &q, tolerance))
}

/// Whether a loop is locked by axes that are meant to let it move.
fn is_slip(mechanism: &Mechanism, found: &LoopSurvey, q: &[f64]) -> bool {
    flaw(mechanism, found, q).is_some()
}

/// A loop that moves because its constraints may be satisfied nearly; `None` where all that it
/// misses is at most `rounding`, rad and parts of its size: the digits of any file.
fn accepted(
    mechanism: &Mechanism,
    found: &LoopSurvey,
    q: &[f64],
    [tolerance, rounding]: [f64; 2],
) -> Option<String> {
    let (within, off) = match (flaw(mechanism, found, q), found.smallest) {
        (Some(Flaw::Turned(name, angle)), _) => {
            let words = format!(
                "the axis of `{name}` is parallel to the others within {} rad",
                rounded(angle, 3)
            );
            (words, angle)
        }
        (Some(Flaw::Slides(name, angle)), _) => {
            let words = format!(
                "`{name}` slides across the axes of the others within {} rad",
                rounded(angle, 3)
            );
            (words, angle)
        }
        (Some(Flaw::Beside(a, b, distance)), _) => {
            let words = format!("the axes of `{a}` and `{b}` are {} m apart", rounded(distance, 3));
            (words, distance / found.size)
        }
        (None, Some(value)) if value < tolerance => {
            let words = format!(
                "its constraints depend on one another within {} (smallest singular value)",
                rounded(value, 3)
            );
            (words, value)
        }
        _ => {
            let words = "its joints miss each other in a direction in which it cannot move";
            (words.to_owned(), 0.0)
        }
    };
    let (rad, m) = residuals(mechanism, q);
    if off.max(rad).max(m / found.size) <= rounding {
        return None;
    }
    let left = [(rad, 1.0, "rad"), (m, found.size, "m")].into_iter();
    let left: Vec<String> = left
        .filter(|(left, size, _)| *left > ROUNDING * size)
        .map(|(left, _, unit)| format!("{} {unit}", rounded(left, 2)))
        .collect();
    let start = match left.is_empty() {
        true => String::new(),
        false => format!("; its joints start with a residual of {}", left.join(" and ")),
    };
    Some(format!(
        "the loop closed by `{}` moves within `simulation.loop_tolerance` = {}: {within}{start}",
        found.closed_by,
        rounded(tolerance, 3)
    ))
}

/// A loop that cannot move.
fn locked(mechanism: &Mechanism, found: &LoopSurvey, q: &[f64], tolerance: f64) -> String {
    let joint = &found.closed_by;
    let degrees =
        |angle: f64| format!("{} rad ({}°)", rounded(angle, 3), rounded(angle.to_degrees(), 3));
    match flaw(mechanism, found, q) {
        Some(Flaw::Turned(name, angle)) => format!(
            "the loop closed by `{joint}` is locked: its axes are not parallel, that of `{name}` is off by {}; with parallel \
             axes it could move",
            degrees(angle)
        ),
        Some(Flaw::Slides(name, angle)) => format!(
            "the loop closed by `{joint}` is locked: `{name}` does not slide across the axes of the others, it is off by {}",
            degrees(angle)
        ),
        Some(Flaw::Beside(a, b, distance)) => format!(
            "the loop closed by `{joint}` is locked: the axes of `{a}` and `{b}` are {} m apart",
            rounded(distance, 3)
        ),
        None => match found.smallest {
            Some(value) if value < MEANT && value > tolerance => format!(
                "the loop closed by `{joint}` is locked; it is {} rad, or as much of its size, from one that can move \
                 (smallest singular value of its constraints)",
                rounded(value, 2)
            ),
            _ => format!("the loop closed by `{joint}` is locked"),
        },
    }
}

/// The direction of the axis of a joint about which it turns; `None` where it has none.
fn turns_about(joint: &Joint, q: &[f64]) -> Option<Vector3<f64>> {
    let turns = joint.kind.properties().motion.rotates_about_axis();
    turns.then(|| joint.configuration(q).axis(2))
}

fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b).abs())
}

/// What is wrong with the axes of a loop that are meant to be parallel.
fn flaw<'a>(mechanism: &'a Mechanism, found: &LoopSurvey, q: &[f64]) -> Option<Flaw<'a>> {
    let joints = &mechanism.description().joints;
    let own = || found.joints.iter().map(|&k| &joints[k]);
    let turning: Vec<(&Joint, Vector3<f64>)> =
        own().filter_map(|joint| Some((joint, turns_about(joint, q)?))).collect();
    let spread = |n: &Vector3<f64>| turning.iter().map(|(_, other)| angle(n, other)).sum::<f64>();
    // the axis that the others are closest to, of equals the first one
    let (_, main) = turning.iter().min_by(|a, b| spread(&a.1).total_cmp(&spread(&b.1)))?;
    let off = turning.iter().map(|(joint, n)| (*joint, angle(n, main)));
    let (joint, off) = off.max_by(|a, b| a.1.total_cmp(&b.1))?;
    if off > MEANT {
        return None; // no planar loop
    }
    if off > ROUNDING {
        return Some(Flaw::Turned(&joint.name, off));
    }
    let slides = own().filter(|joint| joint.kind.properties().motion.only_translates());
    let across = |joint: &'a Joint| {
        let n = joint.configuration(q).axis(2);
        (joint, n.dot(main).abs().min(1.0).asin())
    };
    let slide = slides.map(across).max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((joint, off)) = slide.filter(|(_, off)| (ROUNDING..MEANT).contains(off)) {
        return Some(Flaw::Slides(&joint.name, off));
    }
    let [(a, n), (b, _)] = turning[..] else { return None };
    if found.joints.len() != 2 {
        return None;
    }
    let apart = b.child.point().at(q) - a.child.point().at(q);
    let beside = (apart - n * apart.dot(&n)).norm();
    (beside > ROUNDING * found.size).then_some(Flaw::Beside(&a.name, &b.name, beside))
}

/// The joint of a planar loop that misses most along the direction of its axes in the initial
/// configuration: its name, how far, m, and that direction.
pub(crate) fn misfit(mechanism: &Mechanism, residual: f64) -> Option<(String, f64, [f64; 3])> {
    if !has_loops_of_bodies(mechanism) {
        return None;
    }
    let (joints, q) = (&mechanism.description().joints, mechanism.initial_configuration());
    let loops = survey(mechanism, 0.0, &q, None);
    let most = |found: &LoopSurvey| {
        let own = || found.joints.iter().map(|&k| &joints[k]);
        let axes: Vec<Vector3<f64>> = own().filter_map(|joint| turns_about(joint, &q)).collect();
        let main = *axes.first()?;
        if axes.iter().any(|n| angle(n, &main) > MEANT) {
            return None;
        }
        let gaps = own().map(|joint| (joint, joint.configuration(&q).gap().dot(&main)));
        let (joint, gap) = gaps.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        Some((joint.name.clone(), gap.abs(), main.into()))
    };
    let all = loops.iter().filter_map(most);
    all.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|found| found.1 > 0.1 * residual)
}

/// Largest residuals of the constraints that may keep one, rad and m.
pub(crate) fn residuals(mechanism: &Mechanism, q: &[f64]) -> (f64, f64) {
    let Some(nearly) = mechanism.nearly_redundant() else { return (0.0, 0.0) };
    let mut g = vec![0.0; mechanism.len()];
    let angles = mechanism.principal_angles(q);
    mechanism.residual(Configuration { t: 0.0, q, angles: &angles, internal: &[] }, &mut g);
    let first = mechanism.len() - mechanism.rows().len();
    let (mut rad, mut m) = (0.0_f64, 0.0_f64);
    for (row, g) in g.iter().enumerate().filter(|(row, _)| nearly.allowances[*row] > 0.0) {
        let (force, _) = mechanism.rows()[row - first].largest_wrench(q);
        match force > 0.0 {
            true => m = m.max(g.abs() / force),
            false => rad = rad.max(g.abs()),
        }
    }
    (rad, m)
}

/// The largest residuals along a run of the constraints that nearly follow from others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopResiduals {
    /// Of angles, rad.
    pub angle: f64,
    /// Of lengths, m.
    pub length: f64,
}

impl LoopResiduals {
    /// Takes a node into account.
    pub(crate) fn follow(&mut self, mechanism: &Mechanism, q: &[f64]) {
        if mechanism.nearly_redundant().is_none() {
            return;
        }
        let (rad, m) = residuals(mechanism, q);
        (self.angle, self.length) = (self.angle.max(rad), self.length.max(m));
    }

    /// "1e-6 rad and 2e-7 m"; `None` where both are zero.
    #[must_use]
    pub fn words(&self) -> Option<String> {
        let parts = [(self.angle, "rad"), (self.length, "m")].into_iter();
        let parts: Vec<String> = parts
            .filter(|(size, _)| *size > 0.0)
            .map(|(size, unit)| format!("{} {unit}", rounded(size, 2)))
            .collect();
        (!parts.is_empty()).then(|| parts.join(" and "))
    }
}
