//! A flexible multibody system in the situation of LMO08 §6.2: body, beam and body, joined and free in
//! space; a pulse, then nothing acts.

use holonom::report::{Item, Paint, Picture, Side, axonometric};
use holonom::{Model, Sample};

use super::comparison::{Recorded, constraints, energy, momentum, momentum_errors, record};
use super::{Figure, Result, Section, with};

/// Configurations drawn.
const CONFIGURATIONS: usize = 6;
/// The bodies come before the nodes of the beam.
const BODIES: usize = 2;

pub(super) fn section(model: &Model) -> Result<Section> {
    let settings = [("simulation.step", "0.005"), ("simulation.every", "4")];
    let model = &with(model, &settings)?;
    let all = [record(model, "nodal")?, record(model, "em-nodal")?];
    let free_from = model.loads_end().unwrap_or_default();
    let picture = configurations(&all[0].samples);
    let runs = all.map(|run| run.since(free_from));
    let [variational, conserving] = &runs;
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
                "H_d of the variational scheme stays in a band of {:.1e} J about {:.3} J; the \
                 energy–momentum scheme conserves the energy to {:.1e} J.",
                Recorded::worst(variational.energy_errors()),
                variational.samples[0].hamiltonian,
                Recorded::worst(conserving.energy_errors())
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
    let words = "Body, spherical joint, beam of eight elements, revolute joint, body; a pulse of \
                 force and torque on the first body until 0.5 s \
                 (`examples/models/flexible_multibody.toml` with h = 0.005 s)."
        .into();
    Ok(Section { heading: "Flexible multibody system (section 6.2)", words, figures })
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
        items.push(Item::Words(bodies[1], Paint::Ink(strength), label, Side::Right));
    }
    Picture { title: "Flexible multibody system: configurations".into(), width: 760.0, items }
}
