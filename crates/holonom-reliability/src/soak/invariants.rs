//! What holds at the nodes of every motion: finite numbers, constraints, momentum maps, energy.
//!
//! ```text
//! contacts      g_i(q_n) ≥ 0, less what a run reports as beside the laws        round-off
//! constraints   χ = max_i |g_i(q_n)| / Σ_j |G_ij| size_j                     round-off
//! momentum      |P(t) − P(0) − M g t|,  |L(t) − L(0)|  of a free system, without gravity or along it
//! energy        |H(t) − H(0) − Σ work|  of the energy–momentum schemes without prescribed motions
//! contact       max_t H(t) − H(0)   where nothing drives: no energy is gained
//! ```
//! All are relative to the terms that cancel in them.

use super::fault::{FaultKind, Violation};
use super::trace::Trace;
use bounds::{ENERGY, GAIN, GAP, MOMENTUM, RESIDUAL};
use holonom::model::{Constraint, ContactSide, End, GROUND, JointKind};
use holonom::vi_constraints::Constraints;
use holonom::vi_core::Configuration;
use holonom::vi_core::linear::norm_inf;
use holonom::{Model, Sample, Simulation};

/// Largest numbers that are right, relative to the terms that cancel in them.
pub mod bounds {
    /// Residual of a constraint, relative to the size of its row.
    pub const RESIDUAL: f64 = 1e-11;
    /// By how much contacts and stops are passed, m or rad.
    pub const GAP: f64 = 1e-9;
    /// Energy that is gained in a motion with contacts, relative to the kinetic energy.
    pub const GAIN: f64 = 1e-2;
    /// Change of a momentum map.
    pub const MOMENTUM: f64 = 1e-10;
    /// Residual of the energy balance.
    pub const ENERGY: f64 = 1e-9;
    /// Difference of the motions of two equivalent schemes, relative to the coordinates.
    pub const AGREEMENT: f64 = 1e-7;
    /// Difference of the motions, efforts and reactions of a mechanism that is stated otherwise,
    /// relative to the largest of their kind.
    pub const RESTATED: f64 = 1e-7;
}

/// The largest numbers found; `None` where a quantity does not apply.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InvariantErrors {
    /// Constraint residual.
    pub residual: Option<f64>,
    /// Momentum maps.
    pub momentum: Option<f64>,
    /// Energy balance.
    pub energy: Option<f64>,
    /// Energy gained by contact.
    pub gain: Option<f64>,
    /// Difference of two schemes.
    pub agreement: Option<f64>,
    /// Difference of a mechanism stated otherwise.
    pub restated: Option<f64>,
    /// Whether the run was continued from a stored state.
    pub restarted: bool,
    /// Whether its certificate was made.
    pub certified: bool,
    /// Whether a step was refused and the state compared.
    pub refused: bool,
}

/// Judges all nodes.
///
/// # Errors
/// The first [`Violation`].
pub(super) fn hold(
    model: &Model,
    simulation: &Simulation,
    found: &Trace,
    measured: &mut InvariantErrors,
) -> Result<(), Violation> {
    finite(found)?;
    measured.residual = Some(constraints(model, simulation, found)?);
    if let Some(gap) = found.gap {
        let told = found.deviation * model.settings.step;
        within(FaultKind::Gap, -gap - told, GAP, "a contact or a stop is passed by")?;
    }
    if is_free(model) {
        let change = momentum(model, found);
        measured.momentum = Some(change);
        within(FaultKind::Momentum, change, MOMENTUM, "change of a momentum map")?;
    }
    if !model.contacts.is_empty() && !is_driven(model) {
        let gain = gained(model, found);
        measured.gain = Some(gain);
        within(FaultKind::Gain, gain, GAIN, "energy gained in a motion with contacts")?;
    }
    let driven = model.constraints.iter().any(|c| matches!(c, Constraint::Motion { .. }));
    if model.settings.scheme.is_energy_momentum() && !driven {
        let change = energy(model, found);
        measured.energy = Some(change);
        within(FaultKind::Energy, change, ENERGY, "residual of the energy balance")?;
    }
    Ok(())
}

/// A number against its bound.
pub(super) fn within(kind: FaultKind, found: f64, bound: f64, what: &str) -> Result<(), Violation> {
    if found <= bound {
        return Ok(());
    }
    Err(Violation::new(kind, format!("{what} {found:.1e}, more than {bound:.0e}")))
}

pub(super) fn finite(found: &Trace) -> Result<(), Violation> {
    let bad = found.samples.iter().find(|sample| !is_finite(sample));
    match bad {
        Some(sample) => {
            let words = format!("at step {}: a number that is not finite", sample.step);
            Err(Violation::new(FaultKind::NotFinite, words))
        }
        None => Ok(()),
    }
}

/// Without [`Sample::is_finite`], by which the program itself refuses nodes: that may be wrong.
fn is_finite(sample: &Sample) -> bool {
    let Sample { residuals: r, momentum, .. } = sample;
    let own = [sample.t, sample.energy, sample.hamiltonian, sample.work, sample.newton_iterations];
    let residuals = [r.position, r.velocity, r.momentum];
    let lists = [&sample.q, &sample.energies].into_iter().flatten();
    let momenta = sample.momenta.as_ref().is_none_or(|momenta| momenta.is_finite());
    let numbers = lists.chain(&own).chain(&residuals).chain(&momentum.linear);
    momenta && numbers.chain(&momentum.angular).chain(&sample.shadow).all(|x| x.is_finite())
}

/// The largest relative residual. Where no constraint depends on unwrapped angles it is computed
/// anew from the configurations, and compared with what the nodes report.
fn constraints(model: &Model, simulation: &Simulation, found: &Trace) -> Result<f64, Violation> {
    let mechanism = simulation.mechanism();
    let (mut g, mut sizes) = (vec![0.0; mechanism.len()], vec![0.0; mechanism.len()]);
    let (mut worst, mut misreported) = (0.0_f64, None);
    if let Some(sample) = found.samples.last() {
        let angles = mechanism.principal_angles(&sample.q);
        let at = Configuration { t: sample.t, q: &sample.q, angles: &angles, internal: &[] };
        mechanism.row_sizes(at, &mut sizes); // changes little in so few steps
    }
    for sample in &found.samples {
        let angles = mechanism.principal_angles(&sample.q);
        let at = Configuration { t: sample.t, q: &sample.q, angles: &angles, internal: &[] };
        mechanism.value(at, &mut g);
        let told = sample.residuals.position;
        if unwrapped(model) {
            worst = worst.max(told / norm_inf(&sizes));
            continue;
        }
        let ratio = |(g, size): (&f64, &f64)| if *g == 0.0 { 0.0 } else { g.abs() / size };
        worst = g.iter().zip(&sizes).map(ratio).fold(worst, f64::max);
        mechanism.residual(at, &mut g); // rounded as the nodes report it
        let own = norm_inf(&g);
        if misreported.is_none() && (own - told).abs() > 1e-3 * own {
            misreported =
                Some(format!("step {}: residual {own:.2e}, reported {told:.2e}", sample.step));
        }
    }
    within(FaultKind::Residual, worst, RESIDUAL, "constraint residual")?;
    match misreported {
        Some(words) => Err(Violation::new(FaultKind::Report, words)),
        None => Ok(worst),
    }
}

/// Whether constraints depend on unwrapped angles.
fn unwrapped(model: &Model) -> bool {
    let screws = model.joints.iter().any(|joint| joint.kind == JointKind::Screw);
    let angles = |c: &Constraint| matches!(c, Constraint::Gear { .. } | Constraint::Motion { .. });
    screws || model.constraints.iter().any(angles)
}

/// Whether nothing from outside acts but gravity.
fn is_free(model: &Model) -> bool {
    let ground = |name: &String| name == GROUND;
    let bodies = model.bodies.iter().any(|body| body.fixed);
    let joints = model.joints.iter().any(|j| ground(&j.parent) || ground(&j.child));
    let bars = model.bars.iter().any(|bar| ground(&bar.from) || ground(&bar.to));
    let springs = model.springs.iter().any(|s| ground(&s.from) || ground(&s.to));
    let beams = model.beams.iter().any(|b| b.start != End::Free || b.end != End::Free);
    let weighs = model.gravity().iter().any(|g| *g != 0.0);
    let none = model.constraints.is_empty() && model.loads.is_empty();
    let planes = model.contacts.iter().any(|own| match &own.a {
        ContactSide::Plane(side) => side.plane.on == GROUND,
        ContactSide::Bodies(_) => false,
    });
    none && !planes
        && !(bodies || joints || bars || springs || beams || weighs && !model.beams.is_empty())
}

/// Whether something gives energy to it.
fn is_driven(model: &Model) -> bool {
    let motors = model.joints.iter().any(|joint| joint.motor.is_some());
    motors || !model.loads.is_empty() || !model.constraints.is_empty()
}

/// By how much the energy is above that of the start at most, relative to the largest kinetic
/// energy, with that of a fall by 1 mm. No gain is what a body at rest on a support has at its
/// first node, `m (h a)²/8` (docs/theory.md, 2.20).
fn gained(model: &Model, found: &Trace) -> f64 {
    let Some(first) = found.samples.first() else { return 0.0 };
    let kinetic = found.samples.iter().filter_map(|own| own.energies.first().copied());
    let fall = mass(model) * (1e-6 + 1e-3 * norm_inf(&model.gravity()));
    let scale = kinetic.fold(0.0, f64::max) + fall;
    let gains = found.samples.iter().map(|own| own.energy - first.energy);
    let weight = model.settings.step * norm_inf(&model.gravity());
    let at_start = 0.25 * mass(model) * weight * weight;
    (gains.fold(0.0, f64::max) - at_start).max(0.0) / scale
}

/// The largest relative change of a momentum map that is conserved.
fn momentum(model: &Model, found: &Trace) -> f64 {
    let Some(first) = found.samples.first() else { return 0.0 };
    let mass = mass(model);
    let gravity = model.gravity();
    let weighs = gravity.iter().any(|g| *g != 0.0);
    let (linear, angular) = scales(model, found, mass);
    let mut worst = 0.0_f64;
    for sample in &found.samples {
        for i in 0..3 {
            let (now, then) = (&sample.momentum, &first.momentum);
            let change = now.linear[i] - then.linear[i] - mass * gravity[i] * (sample.t - first.t);
            worst = worst.max(change.abs() / linear);
            let turns = (now.angular[i] - then.angular[i]).abs();
            if !weighs || gravity[i] != 0.0 {
                worst = worst.max(turns / angular);
            }
        }
    }
    worst
}

/// The sizes of the terms that cancel in the momentum maps: of momenta, and of impulses of inner
/// forces.
fn scales(model: &Model, found: &Trace, mass: f64) -> (f64, f64) {
    let largest = |of: &dyn Fn(&Sample) -> f64| found.samples.iter().map(of).fold(0.0, f64::max);
    let size = largest(&|sample| norm_inf(&sample.q)).max(1e-3);
    let kinetic = largest(&|sample| sample.energies.first().copied().unwrap_or_default().abs());
    let beams = |beam: &holonom::model::Beam| {
        let section = &beam.section;
        section.rho_a.unwrap_or_default() * 2.0
    };
    let mass = mass + model.beams.iter().map(beams).sum::<f64>();
    let time = found.samples.last().map_or(0.0, |sample| sample.t);
    let weight = norm_inf(&model.gravity()) * mass;
    let stiff = model.springs.iter().map(|s| s.stiffness * size * (1.0 + size * size)).sum::<f64>();
    let rods = model.beams.iter().map(|b| b.section.ea.unwrap_or_default() * size).sum::<f64>();
    let told = largest(&|sample| norm_inf(&sample.momentum.linear));
    let linear = (2.0 * kinetic * mass).sqrt().max(told) + time * (weight + stiff + rods) + 1e-9;
    let turns = largest(&|sample| norm_inf(&sample.momentum.angular));
    (linear, (linear * size).max(turns))
}

/// The largest relative residual of the energy balance. A system at rest has the kinetic energy of
/// rounding alone, and a motor on a joint that loops lock does work on it, near a dead position on
/// more than that: what coordinates that change by 1e-11 of their size in a sub-step, the shortest,
/// make is within the bound.
fn energy(model: &Model, found: &Trace) -> f64 {
    const NOISE: f64 = 1e-11;
    let largest = |of: &dyn Fn(&Sample) -> f64| found.samples.iter().map(of).fold(0.0, f64::max);
    let shortest = model.settings.step * model.settings.composition().shortest();
    let speed = NOISE * largest(&|sample| norm_inf(&sample.q)) / shortest;
    let path = NOISE * largest(&|sample| norm_inf(&sample.q)).max(1.0); // of a coordinate at rest
    let noise = mass(model) * speed * speed + forces(model) * path;
    let mut scale = 1e-6 + noise / ENERGY; // 1e-6 J: of 2 kg at 1 mm/s
    let mut worst = 0.0_f64;
    for sample in &found.samples {
        let Some((balance, parts)) = sample.energies.split_last() else { continue };
        scale = scale.max(norm_inf(parts));
        worst = worst.max(balance.abs());
    }
    worst / scale
}

/// The sum of the efforts of motors and of the loads, N or N·m.
fn forces(model: &Model) -> f64 {
    let motors = model.joints.iter().filter_map(|joint| joint.motor.as_ref());
    let loads = model.loads.iter().flat_map(|load| load.force.iter().chain(&load.torque));
    motors.map(|motor| motor.effort.abs()).sum::<f64>() + loads.map(|f| f.abs()).sum::<f64>()
}

/// The mass of the bodies and point masses, kg.
fn mass(model: &Model) -> f64 {
    let bodies = model.bodies.iter().map(holonom::model::Body::mass);
    bodies.chain(model.particles.iter().map(|point| point.mass)).sum()
}
