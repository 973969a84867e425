//! A flexible multibody system in the situation of LMO08 §6.2: body, beam and body, joined and free
//! in space; a pulse, then nothing acts.

use holonom::report::{Item, LabelSide, Paint, Picture, axonometric};
use holonom::{Model, Sample};

use super::comparison::{Recorded, constraints, energy, momentum, momentum_errors, record};
use super::{Figure, Result, Section, with};

/// Time over which the energy is looked at, and between two of its samples, s.
const LONG: f64 = 400.0;
const SAMPLED: f64 = 0.2;
/// Configurations drawn.
const CONFIGURATIONS: usize = 6;
/// The bodies come before the nodes of the beam.
const BODIES: usize = 2;

pub(super) fn section(model: &Model) -> Result<Section> {
    let all = [record(model, "nodal")?, record(model, "em-nodal")?];
    let free_from = model.loads_end().unwrap_or_default();
    let picture = configurations(&all[0].samples);
    let runs = all.map(|run| run.since(free_from));
    let [variational, conserving] = &runs;
    let h = model.settings.step;
    let [coarse, fine] = [creep(model, h)?, creep(model, 0.5 * h)?];
    let figures = vec![
        Figure::picture(
            "flexible_configurations.svg",
            &picture,
            "The beam between its two bodies (a line from the joint to the centre of mass each), \
             seen from a fixed direction; later configurations are drawn darker."
                .into(),
        )?,
        Figure::chart(
            "flexible_energy.svg",
            &energy("Flexible multibody system: error of the energy after the pulse", &runs),
            format!(
                "H_d of the variational scheme stays within {:.1e} J of {:.3} J in these {} s; the \
                 energy–momentum scheme conserves the energy to {:.1e} J. In {LONG} s the mean of H_d rises by {:.1e} J, at half the \
                 step by {:.1e} J; that of the shadow energy (2 H_d + E_d)/3 by {:.1e} J and {:.1e} J. So it is neither \
                 round-off, which would not fall with the step, nor a drift of the scheme, which both would show: motion passes to \
                 ever faster vibrations of the beam, of which H_d sees more than there is by a part of (hω)².",
                Recorded::worst(variational.energy_errors()),
                variational.samples[0].hamiltonian,
                model.settings.end,
                Recorded::worst(conserving.energy_errors()),
                coarse[0], fine[0], coarse[1], fine[1]
            ),
        )?,
        Figure::chart(
            "flexible_momentum.svg",
            &momentum("Change of the momentum maps", &runs),
            format!(
                "Linear and angular momentum are conserved by both: {}.",
                momentum_errors(&runs)
            ),
        )?,
        Figure::chart(
            "flexible_constraints.svg",
            &constraints("Flexible multibody system: constraints at three levels", variational),
            "Constraints of positions and velocities hold to round-off. The mass matrix of a beam is \
             singular, so the momentum level is that of the projected momentum, at round-off too."
                .into(),
        )?,
    ];
    let words = format!(
        "Body, spherical joint, beam of eight elements, revolute joint, body; a pulse of \
         force and torque on the first body until 0.5 s \
         (`examples/models/flexible_multibody.toml`, h = {h} s, which resolves all vibrations of the beam: h ω_max = 0.9)."
    );
    Ok(Section { heading: "Flexible multibody system (section 6.2)", words, figures })
}

/// By how much the means of `H_d` and of the shadow energy rise from the first to the last eighth
/// of [`LONG`] seconds after the pulse, J.
fn creep(model: &Model, step: f64) -> Result<[f64; 2]> {
    let every = (SAMPLED / step).round();
    let settings = [
        ("simulation.step", step.to_string()),
        ("simulation.every", every.to_string()),
        ("simulation.end", LONG.to_string()),
    ];
    let settings: Vec<(&str, &str)> = settings.iter().map(|(k, v)| (*k, v.as_str())).collect();
    let run = record(&with(model, &settings)?, "nodal")?;
    let run = run.since(model.loads_end().unwrap_or_default());
    let eighth = run.samples.len() / 8;
    let mean = |samples: &[Sample], of: fn(&Sample) -> f64| {
        samples.iter().map(of).sum::<f64>() / samples.len() as f64
    };
    let rise = |of: fn(&Sample) -> f64| {
        mean(&run.samples[run.samples.len() - eighth..], of) - mean(&run.samples[..eighth], of)
    };
    Ok([rise(|s| s.hamiltonian), rise(|s| s.shadow.unwrap_or(f64::NAN))])
}

fn configurations(samples: &[Sample]) -> Picture {
    let mut items = Vec::new();
    for k in 0..CONFIGURATIONS {
        let sample = &samples[k * (samples.len() - 1) / (CONFIGURATIONS - 1)];
        let strength = 0.3 + 0.7 * k as f64 / (CONFIGURATIONS - 1) as f64;
        let centres: Vec<_> = sample
            .q
            .chunks_exact(12)
            .map(|frame| axonometric(&[frame[0], frame[1], frame[2]]))
            .collect();
        let (bodies, nodes) = centres.split_at(BODIES);
        items.push(Item::Line(nodes.to_vec(), Paint::Curve(0, strength), 3.0));
        let ends = [nodes.first(), nodes.last()];
        for (body, end) in bodies.iter().zip(ends.into_iter().flatten()) {
            items.push(Item::Line(vec![*end, *body], Paint::Curve(1, strength), 5.0));
            items.push(Item::Dot(*body, Paint::Curve(1, strength), 6.0));
        }
        let label = format!("t = {:.0} s", sample.t);
        items.push(Item::Words(bodies[1], Paint::Ink(strength), label, LabelSide::Right));
    }
    Picture { title: "Flexible multibody system: configurations".into(), width: 760.0, items }
}
