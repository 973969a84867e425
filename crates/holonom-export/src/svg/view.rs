//! Where a point of space is in a drawing.

use holonom_report::Point;
use nalgebra::{Matrix3, Vector3};

/// A place in the plane of the drawing: to the right, upwards.
pub(super) type PlanePoint = [f64; 2];

/// Directions of the drawing in space: to the right, upwards, towards the viewer; as rows.
#[derive(Debug)]
pub(super) struct Directions(Matrix3<f64>);

impl Directions {
    /// With a unit vector upwards; seen from aside and above, a planar motion from in front.
    pub(super) fn new(up: &[f64; 3], planar: bool) -> Self {
        if planar {
            return Self(Matrix3::identity());
        }
        let up = Vector3::from(*up);
        let across = if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let across = (across - up * up.dot(&across)).normalize();
        let away = up.cross(&across);
        let towards = (across * 0.5 - away + up * 0.45).normalize();
        let right = up.cross(&towards).normalize();
        let top = towards.cross(&right);
        Self(Matrix3::from_rows(&[right.transpose(), top.transpose(), towards.transpose()]))
    }

    /// Place and depth, which is larger nearer to the viewer; m.
    pub(super) fn of(&self, point: &Vector3<f64>) -> (PlanePoint, f64) {
        let [right, up, towards] = (self.0 * point).into();
        ([right, up], towards)
    }
}

/// The rectangle of the drawing.
#[derive(Debug)]
pub(super) struct Sheet {
    /// Units of the drawing per metre.
    pub(super) scale: f64,
    pub(super) height: f64,
    origin: PlanePoint, // of the drawing, m
    inset: PlanePoint,
}

impl Sheet {
    /// That holds all points; `None` where they are not finite or too large.
    pub(super) fn around<'a>(
        points: impl Iterator<Item = &'a PlanePoint>,
        [width, tallest]: [f64; 2],
        margin: f64,
    ) -> Option<Self> {
        let mut bounds: Option<[PlanePoint; 2]> = None;
        for point in points {
            let [low, high] = bounds.unwrap_or([*point; 2]);
            let each = |pick: fn(f64, f64) -> f64, a: PlanePoint| {
                std::array::from_fn(
                    |i| if point[i].is_nan() { f64::NAN } else { pick(a[i], point[i]) },
                )
            };
            bounds = Some([each(f64::min, low), each(f64::max, high)]);
        }
        let [low, high] = bounds?;
        let [across, along] = [high[0] - low[0], high[1] - low[1]];
        let (room, tall) = (width - 2.0 * margin, tallest - 2.0 * margin);
        let largest = (across / room).max(along / tall);
        let scale = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        let inset = [margin + 0.5 * (room - across * scale), margin];
        let sheet =
            Self { scale, height: along * scale + 2.0 * margin, origin: [low[0], high[1]], inset };
        let numbers = [sheet.scale, sheet.height, low[0], low[1], high[0], high[1]];
        numbers.iter().all(|number| number.is_finite()).then_some(sheet)
    }

    /// Where a place is on the sheet, downwards positive.
    pub(super) fn placed(&self, point: &PlanePoint) -> Point {
        let x = (point[0] - self.origin[0]) * self.scale + self.inset[0];
        let y = (self.origin[1] - point[1]) * self.scale + self.inset[1];
        [x, y]
    }

    /// Points as an attribute of SVG.
    pub(super) fn written(&self, points: &[PlanePoint]) -> String {
        let place = |point: &PlanePoint| {
            let [x, y] = self.placed(point);
            format!("{x:.0},{y:.0}")
        };
        points.iter().map(place).collect::<Vec<_>>().join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Upwards is upwards, whichever axis it is, and the three directions are right-handed.
    #[test]
    fn a_view_is_a_rotation() {
        for up in [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.6, 0.8]] {
            let view = Directions::new(&up, false);
            let error = (view.0 * view.0.transpose() - Matrix3::identity()).amax();
            assert!(error < 1e-15 && view.0.determinant() > 0.0, "{up:?}: {error:e}");
            let (place, _) = view.of(&Vector3::from(up));
            assert!(place[0].abs() < 1e-15 && place[1] > 0.5, "{up:?}: {place:?}");
        }
    }

    #[test]
    fn all_points_are_on_the_sheet() {
        let points = [[-2.0, 1.0], [3.0, 5.0], [0.0, 0.0]];
        let sheet = Sheet::around(points.iter(), [640.0, 480.0], 10.0).unwrap();
        assert_eq!(sheet.written(&points), "90,378 550,10 274,470");
        assert!(Sheet::around([[0.0, f64::NAN]].iter(), [640.0, 480.0], 10.0).is_none());
        assert!(Sheet::around([[0.0, f64::INFINITY]].iter(), [640.0, 480.0], 10.0).is_none());
    }
}
