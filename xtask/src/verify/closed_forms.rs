//! Discrete equilibria that are known in closed form.

use holonom::nalgebra::Vector3;
use holonom::verification::certificate::{Criterion, Finding, Verdict};
use holonom::vi_beam::{BeamMesh, BeamModel, FrameRule, Section};
use holonom::vi_rigid::load::{Load, LoadKind};
use holonom::vi_rigid::time_history::TimeHistory;
use holonom::vi_statics::{StaticProblem, StaticSettings};
use std::f64::consts::FRAC_PI_2;

/// Deviation that round-off of a static solution explains.
const LIMIT: f64 = 1e-10;

/// A quarter of a ring, clamped at one end, bent by a moment at the other.
///
/// Every element rotates by the same angle, which follows from the energy of one:
/// ```text
/// V_e = ½ ℓ EI ((sin θ − sin θ_0)/ℓ)²,    M = EI (sin θ − sin θ_0) cos θ / ℓ
/// ```
/// with the arc length `ℓ`. `change` may alter the mesh first; it is the identity but in tests.
pub(crate) fn curved_cantilever(change: &dyn Fn(&mut BeamMesh)) -> Finding {
    let (elements, radius, bending) = (8_u32, 2.0, 5.0);
    let turn = FRAC_PI_2 / f64::from(elements); // θ_0, of the stress-free beam
    let (bent, length) = (0.7 * turn, radius * turn);
    let moment = bending * (bent.sin() - turn.sin()) * bent.cos() / length;
    let expected = f64::from(elements) * bent;
    let mut finding = Finding {
        criterion: Criterion::ClosedForm,
        method: None,
        order: 0,
        quantity: "end rotation of a bent quarter ring".into(),
        expected: format!("{expected:.10} rad"),
        measured: String::new(),
        value: None,
        verdict: Verdict::Fail,
        reason: String::new(),
    };
    match end_rotation(elements as usize, radius, bending, moment, change) {
        Err(error) => finding.reason = error,
        Ok(found) => {
            finding.measured = format!("{found:.10} rad");
            finding.value = Some(found - expected);
            if (found - expected).abs() <= LIMIT {
                finding.verdict = Verdict::Pass;
            } else {
                finding.reason = "is the length of an element its arc length?".into();
            }
        }
    }
    finding
}

/// Angle between the triads of both ends, rad.
fn end_rotation(
    elements: usize,
    radius: f64,
    bending: f64,
    moment: f64,
    change: &dyn Fn(&mut BeamMesh),
) -> Result<f64, String> {
    let words = |e: &dyn std::fmt::Display| e.to_string();
    let (center, axis) = (radius * Vector3::y(), Vector3::z());
    let rule = FrameRule::Normal(axis);
    let mut mesh =
        BeamMesh::arc(center, -center, axis, FRAC_PI_2, elements, rule).map_err(|e| words(&e))?;
    change(&mut mesh);
    let stiffness = [1e3, 1e3, 1e3, bending, bending, bending];
    let section = Section::new(stiffness, [1.0, 0.1, 0.1, 0.0]).map_err(|e| words(&e))?;
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("ring", &mesh, section).map_err(|e| words(&e))?;
    model.clamp(beam.nodes.start);
    let (tip, torque) = (beam.nodes.end - 1, moment * Vector3::z());
    let history = TimeHistory::default();
    let load = Load::new(12 * tip, LoadKind::Dead, Vector3::zeros(), torque, history)
        .map_err(|e| words(&e))?;
    let mechanism = model.mechanism();
    let system = model.static_system(&mechanism, vec![load]);
    let mut problem = StaticProblem::new(system, mechanism).with_elements(model.neighbours());
    problem.solve(&[1.0], &StaticSettings::default()).map_err(|e| words(&e))?;
    let q = problem.configuration();
    let triad = |k: usize| holonom::vi_rigid::directors::triad(&q[12 * k..12 * k + 12]);
    let between = triad(beam.nodes.start).transpose() * triad(tip);
    let axis = Vector3::new(
        between[(2, 1)] - between[(1, 2)],
        between[(0, 2)] - between[(2, 0)],
        between[(1, 0)] - between[(0, 1)],
    );
    Ok((0.5 * axis.norm()).atan2(0.5 * (between.trace() - 1.0)))
}
