//! What a distance is between.

use holonom_model::{Constraint, Model, Sensor, spatial};

/// The line of a distance as the model states it.
pub(crate) struct DistanceLine<'a> {
    /// The section that states its points, and the name there.
    pub(crate) of: [&'a str; 2],
    /// Members or the ground.
    pub(crate) members: [&'a str; 2],
    /// The keys of their points, and their components.
    pub(crate) points: [(&'static str, &'a [f64]); 2],
    /// The frame of points on the ground.
    pub(crate) relative_to: Option<&'a str>,
}

/// The line between what a sensor names, or of the spring, bar, law or constraint that it is of.
pub(crate) fn line_of<'a>(model: &'a Model, sensor: &'a Sensor) -> Option<DistanceLine<'a>> {
    let name = sensor.of.as_str();
    let points = |from: &'a [f64], to: &'a [f64]| [("point_from", from), ("point_to", to)];
    if let Some(to) = &sensor.to {
        let [from, end] =
            [&sensor.point, &sensor.point_to].map(|own| own.as_ref().map_or(&[][..], |x| &x[..]));
        let points = [("point", from), ("point_to", end)];
        let of = ["sensor", sensor.name.as_str()];
        return Some(DistanceLine { of, members: [name, to], points, relative_to: None });
    }
    let stated = |from: &'a Option<Vec<f64>>, to: &'a Option<Vec<f64>>| {
        points(from.as_deref().unwrap_or_default(), to.as_deref().unwrap_or_default())
    };
    if let Some(own) = model.springs.iter().find(|own| own.name == name) {
        let points = stated(&own.point_from, &own.point_to);
        let relative_to = own.relative_to.as_deref();
        return Some(DistanceLine {
            of: ["spring", name],
            members: [&own.from, &own.to],
            points,
            relative_to,
        });
    }
    if let Some(own) = model.bars.iter().find(|own| own.name == name) {
        let points = [("point", own.point.as_deref().unwrap_or_default()); 2];
        let relative_to = own.relative_to.as_deref();
        return Some(DistanceLine {
            of: ["bar", name],
            members: [&own.from, &own.to],
            points,
            relative_to,
        });
    }
    if let Some(own) = model.laws.iter().find(|own| own.name == name) {
        let members = [own.from.as_deref()?, own.to.as_deref()?];
        let points = stated(&own.point_from, &own.point_to);
        let relative_to = own.relative_to.as_deref();
        return Some(DistanceLine { of: ["law", name], members, points, relative_to });
    }
    model.constraints.iter().find_map(|constraint| match constraint {
        Constraint::Distance { name: own, from, to, point_from, point_to, relative_to, .. }
            if own == name =>
        {
            let (members, points) = ([from.as_str(), to], points(point_from, point_to));
            let relative_to = relative_to.as_deref();
            Some(DistanceLine { of: ["constraint", name], members, points, relative_to })
        }
        _ => None,
    })
}

/// The ends of a distance: members or the ground, each with a point by its own components.
pub(crate) fn ends_of<'a>(
    model: &'a Model,
    sensor: &'a Sensor,
) -> Option<[(&'a str, [f64; 3]); 2]> {
    let DistanceLine { members, points, .. } = line_of(model, sensor)?;
    Some([0, 1].map(|k| (members[k], spatial(points[k].1))))
}
