//! What a distance is between.

use holonom_model::{Constraint, Model, Sensor, spatial};

/// The ends of a distance: members or the ground, each with a point by its own components.
pub(crate) fn ends_of<'a>(
    model: &'a Model,
    sensor: &'a Sensor,
) -> Option<[(&'a str, [f64; 3]); 2]> {
    let of = sensor.of.as_str();
    let ends = |names: [&'a str; 2], [a, b]: [&[f64]; 2]| {
        Some([(names[0], spatial(a)), (names[1], spatial(b))])
    };
    if let Some(to) = &sensor.to {
        let [a, b] = [sensor.point, sensor.point_to].map(Option::unwrap_or_default);
        return ends([of, to], [&a, &b]);
    }
    let stated =
        |points: [&'a Option<Vec<f64>>; 2]| points.map(|x| x.as_deref().unwrap_or_default());
    if let Some(spring) = model.springs.iter().find(|spring| spring.name == of) {
        return ends([&spring.from, &spring.to], stated([&spring.point_from, &spring.point_to]));
    }
    if let Some(bar) = model.bars.iter().find(|bar| bar.name == of) {
        return ends([&bar.from, &bar.to], [bar.point.as_deref().unwrap_or_default(); 2]);
    }
    if let Some(law) = model.laws.iter().find(|law| law.name == of) {
        let names = [law.from.as_deref()?, law.to.as_deref()?];
        return ends(names, stated([&law.point_from, &law.point_to]));
    }
    model.constraints.iter().find_map(|constraint| match constraint {
        Constraint::Distance { name, from, to, point_from, point_to, .. } if name == of => {
            ends([from, to], [point_from, point_to])
        }
        _ => None,
    })
}
