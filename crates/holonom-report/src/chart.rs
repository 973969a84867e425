//! Charts of curves over time or any other quantity, linear or logarithmic.

pub use super::axis::ChartAxis;
use super::series::range;

/// A curve with its name in the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name; one without a name is not in the legend.
    pub name: String,
    /// Its points `(x, y)`.
    pub points: Vec<(f64, f64)>,
}

/// How curves are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strokes {
    /// Lines.
    Line,
    /// Lines with their points: for few, measured ones.
    MarkedLine,
    /// Points alone, in no order.
    Marks,
    /// Points of the last curve, lines of the others over them: measured values, and a model.
    LineOverMarks,
    /// Lines, the first one whole over the others: a value, and bounds that it reaches.
    LineOverBounds,
}

/// A line chart.
#[derive(Clone, Debug, PartialEq)]
pub struct LineChart {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: ChartAxis,
    /// The vertical axis.
    pub y: ChartAxis,
    /// How its curves are drawn.
    pub strokes: Strokes,
    /// The vertical axis shows at least `±resolution` around a constant: changes below are
    /// round-off, and are drawn as none. 0: whatever there is fills the height.
    pub resolution: f64,
    /// Places on the horizontal axis where something changes, such as events; across them a thin
    /// line is drawn.
    pub marks: Vec<f64>,
    /// The curves.
    pub curves: Vec<Series>,
}

impl LineChart {
    /// Curves that are zero throughout, by name.
    #[must_use]
    pub fn zero_curves(&self) -> Vec<&str> {
        let zero = |c: &&Series| !c.points.is_empty() && c.points.iter().all(|p| p.1 == 0.0);
        self.curves.iter().filter(zero).map(|c| c.name.as_str()).collect()
    }

    /// The constant that a curve is within the resolution.
    fn constant(&self, curve: &Series) -> Option<f64> {
        let finite = curve.points.iter().map(|p| p.1).filter(|y| y.is_finite());
        let (low, high) = range(finite)?;
        let middle = 0.5 * low + 0.5 * high;
        let middle = if low.abs().max(high.abs()) <= self.resolution { 0.0 } else { middle };
        (!self.y.logarithmic && high - low <= self.resolution).then_some(middle)
    }

    /// The curves as they are drawn: those that are constant within the resolution without their
    /// round-off.
    pub(super) fn drawn_curves(&self) -> Vec<Series> {
        let drawn = |curve: &Series| match self.constant(curve) {
            Some(value) => Series {
                points: curve.points.iter().map(|p| (p.0, value + 0.0 * p.1)).collect(),
                ..curve.clone()
            },
            None => curve.clone(),
        };
        self.curves.iter().map(drawn).collect()
    }

    /// Names in the legend, with a note on those that are zero, exactly or but for round-off; empty
    /// ones are left out.
    pub(super) fn legend(&self) -> Vec<String> {
        let zero = self.zero_curves();
        let name = |curve: &Series| match (curve.name.as_str(), self.constant(curve)) {
            ("", _) => String::new(),
            (name, _) if zero.contains(&name) => format!("{name} ≡ 0"),
            (name, Some(0.0)) => format!("{name} ≈ 0"),
            (name, _) => name.to_owned(),
        };
        self.curves.iter().map(name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::style::Style;

    /// A chart of one curve.
    fn chart(points: Vec<(f64, f64)>, logarithmic: [bool; 2]) -> LineChart {
        let axis = |logarithmic| ChartAxis { logarithmic, ..ChartAxis::linear("q", "m") };
        let [x, y] = logarithmic.map(axis);
        let curves = vec![Series { name: "c".into(), points }];
        LineChart {
            title: "t".into(),
            x,
            y,
            strokes: Strokes::MarkedLine,
            resolution: 0.0,
            marks: Vec::new(),
            curves,
        }
    }

    #[test]
    fn numbers_of_any_size_are_drawn() {
        let sizes = [
            0.0,
            5e-324,
            1e-310,
            1e-300,
            1e-290,
            1e-100,
            1e-17,
            1.0,
            1e17,
            1e300,
            f64::MAX,
            f64::INFINITY,
            f64::NAN,
        ];
        let signed: Vec<f64> = sizes.iter().flat_map(|&s| [s, -s]).collect();
        for &a in &signed {
            for &b in &signed {
                for logarithmic in [[false; 2], [false, true], [true; 2]] {
                    let points = vec![(a, b), (b, a), (a, a)];
                    let drawn = chart(points, logarithmic);
                    let svg = LineChart { resolution: b.abs(), ..drawn.clone() }.svg();
                    assert!(!svg.contains("NaN"), "resolution {b:e}");
                    let svg = drawn.svg();
                    assert!(svg.len() < 100_000 && !svg.contains("NaN"), "{a:e} {b:e}");
                }
            }
        }
        for nearly in [1.0 + f64::EPSILON, 1e17 + 16.0, 1e-200] {
            let points = [(1.0, nearly), (nearly, 1.0), (1e17, 1e17), (nearly, nearly)];
            for k in 0..points.len() {
                assert!(!chart(points[k..].to_vec(), [false; 2]).svg().contains("NaN"));
            }
        }
    }

    /// Two lengths of very different size are not drawn to one scale.
    #[test]
    fn a_length_over_a_tiny_one_is_drawn() {
        for size in [1e-300, 1e-17, 1e17, 1e300] {
            let svg = chart(vec![(0.0, 0.0), (1.0, size), (2.0, -size)], [false; 2]).svg();
            let points = svg.split("points=\"").map(|p| p.split('"').next().unwrap_or_default());
            assert!(points.clone().any(|p| p.split(' ').count() == 3), "{size:e}: {svg}");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{size:e}");
        }
    }

    #[test]
    fn changes_below_the_resolution_are_a_straight_line() {
        let wild = |t: i32| (f64::from(t), 19.4 + 1e-13 * f64::from(t % 7));
        let points: Vec<_> = (0..50).map(wild).collect();
        let drawn = LineChart { resolution: 1e-9, ..chart(points, [false; 2]) };
        let heights: Vec<f64> = drawn.drawn_curves()[0].points.iter().map(|p| p.1).collect();
        assert!(heights.iter().all(|y| y.to_bits() == heights[0].to_bits()), "{heights:?}");
        let tiny = |t: i32| (f64::from(t), 1e-17 * f64::from(t % 7 - 3));
        let small =
            LineChart { resolution: 1e-9, ..chart((0..50).map(tiny).collect(), [false; 2]) };
        assert_eq!(small.legend(), ["c ≈ 0"]);
        assert!(small.drawn_curves()[0].points.iter().all(|p| p.1 == 0.0));
        assert_eq!(
            LineChart { resolution: 0.0, ..small }.legend(),
            ["c"],
            "nothing is known of it"
        );
    }

    #[test]
    fn a_figure_of_a_journal() {
        let points = |phase: f64| (0..5).map(f64::from).map(move |t| (t, 1e-3 * (t + phase)));
        let curve =
            |name: &str, phase| Series { name: name.into(), points: points(phase).collect() };
        let drawn = LineChart {
            title: "not drawn".into(),
            x: ChartAxis::time(),
            y: ChartAxis::linear("energy", "J"),
            strokes: Strokes::Line,
            resolution: 1e-9,
            marks: Vec::new(),
            curves: vec![curve("E", 0.0), curve("H", 1.5)],
        };
        let style = Style::paper(crate::drawing::Typeface::Serif).sized(40.0, 30.0);
        insta::assert_snapshot!(drawn.drawing(&style).svg());
    }
}
