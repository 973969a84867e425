//! A line chart as SVG, over time or any other quantity, linear or logarithmic.
//!
//! The SVG uses one ink for all text and lines that are no curve, so that a page may exchange it.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::series::{Points, divisible, drawable, exponent, power_of_ten, range, tick};

/// Units of the drawing per pixel: the library rounds to whole units.
pub(super) const PX: u32 = 5;
/// Size of a chart, px.
const SIZE: (u32, u32) = (880, 330);
/// Height of the line with title and legend, px.
const TITLE: u32 = 36;
/// Margins and label areas, px: left with labels, right, top, bottom, labels below.
const LEFT: u32 = 78;
const RIGHT: u32 = 22;
const TOP: u32 = 6;
const BOTTOM: u32 = 4;
const LABELS: u32 = 44;
/// Colour of text and axes.
pub(super) const INK: RGBColor = RGBColor(31, 41, 55);
/// Okabe and Ito's colours, distinguishable for colour-blind readers.
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// A curve with its name in the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Its name; one without a name is not in the legend.
    pub name: String,
    /// Its points `(x, y)`.
    pub points: Vec<(f64, f64)>,
}

/// What an axis shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Axis {
    /// The quantity.
    pub quantity: String,
    /// Its unit; empty for a number.
    pub unit: String,
    /// Logarithmic; only positive values are drawn.
    pub logarithmic: bool,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn linear(quantity: &str, unit: &str) -> Self {
        Self { quantity: quantity.to_owned(), unit: unit.to_owned(), logarithmic: false }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn logarithmic(quantity: &str, unit: &str) -> Self {
        Self { logarithmic: true, ..Self::linear(quantity, unit) }
    }

    /// Time in seconds.
    #[must_use]
    pub fn time() -> Self {
        Self::linear("time", "s")
    }

    /// Its label, `factor` a power of ten or empty.
    fn label(&self, factor: &str) -> String {
        match (factor, self.unit.as_str()) {
            ("", "") => self.quantity.clone(),
            (factor, unit) => format!("{} ({})", self.quantity, format!("{factor} {unit}").trim()),
        }
    }
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
}

/// A line chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// How its curves are drawn.
    pub strokes: Strokes,
    /// The vertical axis shows at least `±resolution` around a constant: changes below are round-off, and are
    /// drawn as none. 0: whatever there is fills the height.
    pub resolution: f64,
    /// The curves.
    pub curves: Vec<Curve>,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Chart {
    /// Curves that are zero throughout, by name.
    #[must_use]
    pub fn zero_curves(&self) -> Vec<&str> {
        let zero = |c: &&Curve| !c.points.is_empty() && c.points.iter().all(|p| p.1 == 0.0);
        self.curves.iter().filter(zero).map(|c| c.name.as_str()).collect()
    }

    /// The chart as a stand-alone SVG on white.
    ///
    /// # Errors
    /// Errors of the drawing library.
    pub fn svg(&self) -> Result<String, String> {
        let mut svg = String::new();
        {
            let root =
                SVGBackend::with_string(&mut svg, (SIZE.0 * PX, SIZE.1 * PX)).into_drawing_area();
            self.draw(&root).map_err(|e| e.to_string())?;
            root.present().map_err(|e| e.to_string())?;
        }
        let size = |unit: u32| format!("width=\"{}\" height=\"{}\"", SIZE.0 * unit, SIZE.1 * unit);
        let svg = svg.replacen(&size(PX), &size(1), 1);
        Ok(match self.x.quantity == "time" && !self.x.logarithmic {
            true => svg.replacen("<svg ", &format!("<svg data-plot=\"{}\" ", self.plot_area()), 1),
            false => svg,
        })
    }

    /// Left, right, top and bottom of the plot in units of the drawing, and the values at its left and right: for a
    /// page that marks a value on several charts.
    fn plot_area(&self) -> String {
        let [x, _] = self.scales();
        let edges = [LEFT, SIZE.0 - RIGHT, TITLE + TOP, SIZE.1 - BOTTOM - LABELS].map(|e| e * PX);
        let [left, right, top, bottom] = edges;
        let unit = 10f64.powi(x.exponent);
        format!("{left} {right} {top} {bottom} {} {}", unit * x.range.0, unit * x.range.1)
    }

    fn draw(&self, root: &Area<'_>) -> Result<(), Box<dyn std::error::Error>> {
        root.fill(&WHITE)?;
        let (head, body) = root.split_vertically(TITLE * PX);
        self.draw_head(&head)?;
        let [x, y] = self.scales();
        let mut chart = ChartBuilder::on(&body)
            .margin_right(RIGHT * PX)
            .margin_top(TOP * PX)
            .margin_bottom(BOTTOM * PX)
            .x_label_area_size(LABELS * PX)
            .y_label_area_size(LEFT * PX)
            .build_cartesian_2d(x.range.0..x.range.1, y.range.0..y.range.1)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(INK.mix(0.14).stroke_width(PX))
            .axis_style(INK.mix(0.55).stroke_width(PX))
            .set_all_tick_mark_size(5 * PX)
            .x_desc(x.label.clone())
            .y_desc(y.label.clone())
            .x_labels(x.ticks(10))
            .y_labels(y.ticks(7))
            .x_label_formatter(&|v| x.tick(*v))
            .y_label_formatter(&|v| y.tick(*v))
            .label_style(("sans-serif", 14 * PX).into_font().color(&INK))
            .axis_desc_style(("sans-serif", 15 * PX).into_font().color(&INK))
            .draw()?;
        // The first curve lies on top; where points crowd, thin lines let the others through.
        let dense = self.curves.iter().any(|c| c.points.len() > 1200);
        for (i, curve) in self.curves.iter().enumerate().rev() {
            let place = |p: &(f64, f64)| Some((x.place(p.0)?, y.place(p.1)?));
            let points: Points = curve.points.iter().filter_map(place).collect();
            if self.strokes != Strokes::Line {
                let mark = |p: &(f64, f64)| Circle::new(*p, 4 * PX, color(i).filled());
                chart.draw_series(points.iter().map(mark))?;
            }
            if self.strokes == Strokes::Marks {
                continue;
            }
            let style = color(i).stroke_width(if dense { 6 } else { 9 });
            chart.draw_series(LineSeries::new(points, style))?;
        }
        Ok(())
    }

    /// Title on the left, legend on the right; a note for curves that are zero throughout.
    fn draw_head(&self, head: &Area<'_>) -> Result<(), Box<dyn std::error::Error>> {
        let middle = Pos::new(HPos::Left, VPos::Center);
        let px = PX as i32;
        let y = TITLE as i32 / 2 * px;
        let title = ("sans-serif", 17 * PX, FontStyle::Bold).into_font().color(&INK).pos(middle);
        head.draw(&Text::new(self.title.clone(), (14 * px, y), title))?;
        let zero = self.zero_curves();
        let mut right = (SIZE.0 as i32 - 22) * px;
        for (i, curve) in self.curves.iter().enumerate().rev().filter(|c| !c.1.name.is_empty()) {
            let is_zero = zero.contains(&curve.name.as_str());
            let name = if is_zero { format!("{} ≡ 0", curve.name) } else { curve.name.clone() };
            let width = (name.chars().count() as f64 * 7.6).ceil() as i32 * px;
            let text = ("sans-serif", 14 * PX).into_font().color(&INK).pos(middle);
            head.draw(&Text::new(name, (right - width, y), text))?;
            let line = vec![(right - width - 30 * px, y), (right - width - 8 * px, y)];
            head.draw(&PathElement::new(line, color(i).stroke_width(3 * PX)))?;
            right -= width + 48 * px;
        }
        Ok(())
    }

    /// Ranges, powers of ten and labels of both axes.
    fn scales(&self) -> [Scale; 2] {
        let all = || self.curves.iter().flat_map(|c| &c.points);
        let [x, y] = [&self.x, &self.y];
        let (along, aside) = (|| all().filter_map(|p| drawable(p.0)), all().map(|p| p.1));
        let across = match x.logarithmic {
            true => Scale::logarithmic(x, along(), 1.0),
            false => Scale::linear(x, wide_range(along())),
        };
        let aside = aside.filter_map(drawable);
        let up = match y.logarithmic {
            true => Scale::logarithmic(y, aside, 3.0),
            false => {
                Scale::linear(y, linear_range(aside, drawable(self.resolution).unwrap_or(0.0)))
            }
        };
        [across, up]
    }
}

/// From values to places along an axis.
struct Scale {
    range: (f64, f64),
    exponent: i32,
    logarithmic: bool,
    label: String,
}

impl Scale {
    fn logarithmic(axis: &Axis, values: impl Iterator<Item = f64>, decades: f64) -> Self {
        let range = log_range(values, decades);
        Self { range, exponent: 0, logarithmic: true, label: axis.label("") }
    }

    fn linear(axis: &Axis, (range, exponent): ((f64, f64), i32)) -> Self {
        let factor = if exponent == 0 { String::new() } else { power_of_ten(exponent) };
        Self { range, exponent, logarithmic: false, label: axis.label(&factor) }
    }

    /// `None`: cannot be drawn.
    fn place(&self, value: f64) -> Option<f64> {
        let value = drawable(value)?;
        match self.logarithmic {
            true => (value > 0.0).then(|| value.log10()),
            false => Some(value / 10f64.powi(self.exponent)),
        }
    }

    fn ticks(&self, linear: usize) -> usize {
        if self.logarithmic { log_ticks(self.range) } else { linear }
    }

    fn tick(&self, value: f64) -> String {
        if self.logarithmic { log_tick(value) } else { tick(value, self.range.1 - self.range.0) }
    }
}

pub(super) fn color(index: usize) -> RGBColor {
    COLORS[index % COLORS.len()]
}

/// The range of the values, in units of a power of ten where they are far from one.
fn wide_range(values: impl Iterator<Item = f64>) -> ((f64, f64), i32) {
    let (low, high) = divisible(range(values).unwrap_or((0.0, 1.0)));
    let exponent = exponent(low.abs().max(high.abs()));
    let exponent = if (-6..15).contains(&exponent) { 0 } else { exponent };
    let unit = 10f64.powi(exponent);
    ((low / unit, high / unit), exponent)
}

/// A range with a margin around the values, in units of a power of ten.
fn linear_range(values: impl Iterator<Item = f64>, resolution: f64) -> ((f64, f64), i32) {
    let (low, high) = range(values).unwrap_or((0.0, 0.0));
    let (low, high) = match high - low < resolution {
        true => (0.5 * (low + high) - resolution, 0.5 * (low + high) + resolution),
        false => (low, high),
    };
    let magnitude = low.abs().max(high.abs());
    let exponent = exponent(magnitude);
    if magnitude == 0.0 {
        return ((-1.0, 1.0), 0);
    }
    let unit = 10f64.powi(exponent);
    let (low, high) = (low / unit, high / unit);
    // A constant is drawn as a line in the middle, not as its round-off.
    let margin = (0.06 * (high - low)).max(5e-3 * magnitude / unit);
    ((low - margin, high + margin), exponent)
}

/// Whole decades around the positive values, at least so many.
fn log_range(values: impl Iterator<Item = f64>, decades: f64) -> (f64, f64) {
    let (low, high) = range(values.filter(|v| *v > 0.0)).unwrap_or((1e-17, 1e-14));
    let (low, high) = (low.log10().floor().max(-25.0), high.log10().ceil());
    (low.min(high - decades), high)
}

fn log_ticks(y: (f64, f64)) -> usize {
    (y.1 - y.0).clamp(0.0, 8.0) as usize + 1
}

/// Only whole decades have a label.
fn log_tick(value: f64) -> String {
    let whole = value.round();
    if (value - whole).abs() < 1e-9 { power_of_ten(whole as i32) } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chart of one curve.
    fn chart(points: Vec<(f64, f64)>, logarithmic: [bool; 2]) -> Chart {
        let axis = |logarithmic| Axis { logarithmic, ..Axis::linear("q", "m") };
        let [x, y] = logarithmic.map(axis);
        let curves = vec![Curve { name: "c".into(), points }];
        Chart { title: "t".into(), x, y, strokes: Strokes::MarkedLine, resolution: 0.0, curves }
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
                    let svg = Chart { resolution: b.abs(), ..drawn.clone() }.svg().unwrap();
                    assert!(!svg.contains("NaN"), "resolution {b:e}");
                    let svg = drawn.svg().unwrap();
                    assert!(svg.len() < 100_000 && !svg.contains("NaN"), "{a:e} {b:e}");
                }
            }
        }
        for nearly in [1.0 + f64::EPSILON, 1e17 + 16.0, 1e-200] {
            let points = [(1.0, nearly), (nearly, 1.0), (1e17, 1e17), (nearly, nearly)];
            for k in 0..points.len() {
                chart(points[k..].to_vec(), [false; 2]).svg().unwrap();
            }
        }
    }

    #[test]
    fn times_far_from_one_second_have_a_power_of_ten() {
        let drawn =
            |t: f64| chart(vec![(0.0, 1.0), (t, 2.0)], [false; 2]).scales()[0].label.clone();
        assert_eq!(drawn(3.0), "q (m)");
        assert_eq!(drawn(2e-12), "q (10⁻¹² m)");
    }
}
