//! Point masses on bars, in the plane and in space.

use crate::soak::draw::Draw;
use holonom::Model;
use holonom::model::{Bar, GROUND, Particle};

/// Point masses, most of them on bars; fewer bars than degrees of freedom.
pub(super) fn truss(model: &mut Model, draw: &mut Draw) {
    let dimension = draw.pick(&[2, 3]);
    model.header.dimension = dimension;
    model.header.gravity.clear();
    if draw.chance(0.6) {
        model.header.gravity = vec![0.0; dimension];
        model.header.gravity[dimension - 1] = -9.81;
    }
    let count = draw.weighted(&[(3, 1), (4, 2), (3, 3), (2, 4), (1, 6)]);
    let grounded = draw.chance(0.7);
    for k in 0..count {
        // a grid with random displacements: no two points are close to each other
        let cell = [(k % 3) as f64, (k / 3) as f64, 0.0];
        let position = (0..dimension).map(|i| cell[i] - 1.0 + draw.between(-0.3, 0.3)).collect();
        let velocity = (0..dimension).map(|_| draw.between(-1.0, 1.0)).collect();
        let (name, mass) = (format!("point{k}"), draw.magnitude(&[0.1, 1.0]));
        model.particles.push(Particle { name, mass, position, velocity, relative_to: None });
    }
    for k in 0..count {
        if k > 0 || grounded {
            let from = if k > 0 { format!("point{}", draw.index(k)) } else { GROUND.to_owned() };
            if draw.chance(0.9) {
                bar(model, from, format!("point{k}"), draw);
            }
        }
    }
    let bars = model.bars.len();
    let spare = (dimension * count).saturating_sub(bars + 1 + if grounded { 0 } else { 3 });
    for _ in 0..draw.index(3).min(spare) {
        let (a, b) = (draw.index(count), draw.index(count));
        let [a, b] = [a, b].map(|k| format!("point{k}"));
        let joined =
            |bar: &Bar| [&bar.from, &bar.to] == [&a, &b] || [&bar.from, &bar.to] == [&b, &a];
        if a != b && !model.bars.iter().any(joined) {
            bar(model, a, b, draw);
        }
    }
    model.settings.project_start = true;
}

fn bar(model: &mut Model, from: String, to: String, draw: &mut Draw) {
    let name = format!("bar{}", model.bars.len());
    let far = || (0..model.header.dimension).map(|i| if i == 1 { -2.5 } else { 0.25 }).collect();
    let point = (from == GROUND && draw.chance(0.7)).then(far);
    let point = if from == GROUND {
        point.or_else(|| Some(vec![-2.5; model.header.dimension]))
    } else {
        None
    };
    model.bars.push(Bar { name, from, to, point, relative_to: None, length: None });
}
