//! The six-body linkage of LMO08 §5.5: configurations, energy, momentum maps, constraint
//! fulfilment.

use holonom::report::{Item, LabelSide, Paint, Picture, axonometric};
use holonom::{Model, Sample};

use super::comparison::{Recorded, constraints, energy, momentum, momentum_errors, record};
use super::{Figure, Result, Section, with};

/// Pictures of the linkage in a row.
const PANELS: usize = 3;

pub(super) fn section(model: &Model) -> Result<Section> {
    let model = &with(model, &[("simulation.end", "20"), ("simulation.step", "0.02")])?;
    let runs = [record(model, "nodal")?, record(model, "em-nodal")?];
    let [variational, conserving] = &runs;
    let figures = vec![
        Figure::picture(
            "linkage_configurations.svg",
            &configurations(model, &variational.samples),
            "Configurations of the six bodies, each drawn between its two hinges, seen from a fixed \
             direction; the dots are hinges."
                .into(),
        )?,
        Figure::chart(
            "linkage_energy.svg",
            &energy("Six-body linkage: error of the energy", &runs),
            format!(
                "H_d of the variational scheme oscillates within {:.1e} J without a trend; the \
                 energy–momentum scheme conserves the energy to {:.1e} J.",
                Recorded::worst(variational.energy_errors()),
                Recorded::worst(conserving.energy_errors())
            ),
        )?,
        Figure::chart(
            "linkage_momentum.svg",
            &momentum("Change of the momentum maps", &runs),
            format!(
                "Linear and angular momentum change by round-off in both: {}.",
                momentum_errors(&runs)
            ),
        )?,
        Figure::chart(
            "linkage_constraints.svg",
            &constraints("Six-body linkage: constraints at three levels", variational),
            "All 66 constraints — 36 internal, 30 of the hinges, one of them redundant — of \
             positions and of velocities hold to round-off; of momenta, with p_n, to second order."
                .into(),
        )?,
    ];
    let words = "Six bars along the edges of the Petrie hexagon of a cube, six hinges, free in \
                 space, no gravity (`examples/models/six_hinge_cube.toml`, h = 0.02 s): six degrees of freedom \
                 of the whole and one inside."
        .into();
    Ok(Section { heading: "Six-body linkage (section 5.5)", words, figures })
}

/// The bodies as segments between their hinges at six times, three in a row.
fn configurations(model: &Model, samples: &[Sample]) -> Picture {
    let mut items = Vec::new();
    let panels = 2 * PANELS;
    for panel in 0..panels {
        let sample = &samples[panel * (samples.len() - 1) / (panels - 1)];
        let centre = axonometric(&centre(&sample.q));
        let (column, row) = ((panel % PANELS) as f64, (panel / PANELS) as f64);
        let shift = [2.3 * column - centre[0], -2.3 * row - centre[1]];
        let place = |x: [f64; 3]| {
            let [x, y] = axonometric(&x);
            [x + shift[0], y + shift[1]]
        };
        for body in 0..model.bodies.len() {
            let hinges = hinges(model, &samples[0].q, &sample.q, body);
            let line = hinges.iter().map(|x| place(*x)).collect();
            items.push(Item::Line(line, Paint::Curve(body, 1.0), 6.0));
            items.extend(hinges.iter().map(|x| Item::Dot(place(*x), Paint::Ink(1.0), 4.0)));
        }
        let label = [2.3 * column - 0.9, -2.3 * row + 0.95];
        items.push(Item::Words(
            label,
            Paint::Ink(1.0),
            format!("t = {:.0} s", sample.t),
            LabelSide::Right,
        ));
    }
    Picture { title: "Six-body linkage: configurations".into(), width: 760.0, items }
}

/// Where the hinges of a body are at `q`, from where they are in the body at the start.
fn hinges(model: &Model, start: &[f64], q: &[f64], body: usize) -> Vec<[f64; 3]> {
    let name = &model.bodies[body].name;
    let own = model.joints.iter().filter(|j| j.parent == *name || j.child == *name);
    let frame =
        |q: &[f64], k: usize| -> [f64; 3] { std::array::from_fn(|i| q[12 * body + 3 * k + i]) };
    let moved = |point: [f64; 3]| -> [f64; 3] {
        let (from, to) = (frame(start, 0), frame(q, 0));
        let components: [f64; 3] = std::array::from_fn(|k| {
            let d = frame(start, k + 1);
            (0..3).map(|i| d[i] * (point[i] - from[i])).sum()
        });
        let offset = |i: usize| (0..3).map(|k| components[k] * frame(q, k + 1)[i]).sum::<f64>();
        std::array::from_fn(|i| to[i] + offset(i))
    };
    own.filter_map(|joint| joint.position.map(moved)).collect()
}

fn centre(q: &[f64]) -> [f64; 3] {
    let bodies = (q.len() / 12) as f64;
    std::array::from_fn(|i| q.chunks_exact(12).map(|frame| frame[i]).sum::<f64>() / bodies)
}
