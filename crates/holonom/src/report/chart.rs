//! A line chart as SVG.
//!
//! The SVG uses one ink for all text and lines that are no curve, so that a page may exchange it.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::series::{Points, exponent, power_of_ten, range, tick};

/// Units of the drawing per pixel: the library rounds to whole units.
const PX: u32 = 5;
/// Size of a chart, px.
const SIZE: (u32, u32) = (880, 330);
/// Height of the line with title and legend, px.
const TITLE: u32 = 36;
/// Colour of text and axes.
pub(super) const INK: RGBColor = RGBColor(31, 41, 55);
/// Okabe and Ito's colours, told apart by colour-blind readers.
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
    /// Its name.
    pub name: String,
    /// Its points `(t, y)`.
    pub points: Vec<(f64, f64)>,
}

/// A line chart over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// What the vertical axis is.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// Logarithmic vertical axis; only positive values are drawn.
    pub logarithmic: bool,
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
    /// What the drawing library says.
    pub fn svg(&self) -> Result<String, String> {
        let mut svg = String::new();
        {
            let root =
                SVGBackend::with_string(&mut svg, (SIZE.0 * PX, SIZE.1 * PX)).into_drawing_area();
            self.draw(&root).map_err(|e| e.to_string())?;
            root.present().map_err(|e| e.to_string())?;
        }
        let size = |unit: u32| format!("width=\"{}\" height=\"{}\"", SIZE.0 * unit, SIZE.1 * unit);
        Ok(svg.replacen(&size(PX), &size(1), 1))
    }

    fn draw(&self, root: &Area<'_>) -> Result<(), Box<dyn std::error::Error>> {
        root.fill(&WHITE)?;
        let (head, body) = root.split_vertically(TITLE * PX);
        self.draw_head(&head)?;
        let Axes { x, y, curves, label } = self.axes();
        let mut chart = ChartBuilder::on(&body)
            .margin_right(22 * PX)
            .margin_top(6 * PX)
            .margin_bottom(4 * PX)
            .x_label_area_size(44 * PX)
            .y_label_area_size(78 * PX)
            .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
        let logarithmic = self.logarithmic;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(INK.mix(0.14).stroke_width(PX))
            .axis_style(INK.mix(0.55).stroke_width(PX))
            .set_all_tick_mark_size(5 * PX)
            .x_desc("time (s)")
            .y_desc(label)
            .x_labels(10)
            .y_labels(if logarithmic { log_ticks(y) } else { 7 })
            .x_label_formatter(&|v| tick(*v, x.1 - x.0))
            .y_label_formatter(&|v| {
                if logarithmic { log_tick(*v) } else { tick(*v, y.1 - y.0) }
            })
            .label_style(("sans-serif", 14 * PX).into_font().color(&INK))
            .axis_desc_style(("sans-serif", 15 * PX).into_font().color(&INK))
            .draw()?;
        // The first curve lies on top; where points crowd, thin lines let the others through.
        let dense = curves.iter().any(|c| c.len() > 1200);
        for (i, points) in curves.into_iter().enumerate().rev() {
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
        for (i, curve) in self.curves.iter().enumerate().rev() {
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

    /// Ranges of both axes, the curves in their scale, the label of the vertical axis.
    fn axes(&self) -> Axes {
        let all = || self.curves.iter().flat_map(|c| &c.points);
        let x = range(all().map(|p| p.0)).unwrap_or((0.0, 1.0));
        let x = if x.1 > x.0 { x } else { (x.0, x.0 + 1.0) };
        let unit = |factor: String| match (factor.as_str(), self.unit.as_str()) {
            ("", "") => self.quantity.clone(),
            ("", unit) => format!("{} ({unit})", self.quantity),
            (factor, "") => format!("{} ({factor})", self.quantity),
            (factor, unit) => format!("{} ({factor} {unit})", self.quantity),
        };
        let (y, exponent) = if self.logarithmic {
            (log_range(all().map(|p| p.1)), 0)
        } else {
            linear_range(all().map(|p| p.1))
        };
        let scale = |&(t, v): &(f64, f64)| match self.logarithmic {
            true => (t, v.log10()),
            false => (t, v / 10f64.powi(exponent)),
        };
        let drawn = |c: &Curve| -> Points {
            let points = c.points.iter().filter(|p| !self.logarithmic || p.1 > 0.0);
            points.map(scale).collect()
        };
        let curves = self.curves.iter().map(drawn).collect();
        let factor = if exponent == 0 { String::new() } else { power_of_ten(exponent) };
        Axes { x, y, curves, label: unit(factor) }
    }
}

struct Axes {
    x: (f64, f64),
    y: (f64, f64),
    curves: Vec<Points>,
    label: String,
}

fn color(index: usize) -> RGBColor {
    COLORS[index % COLORS.len()]
}

/// A range with room around the values, in units of a power of ten.
fn linear_range(values: impl Iterator<Item = f64>) -> ((f64, f64), i32) {
    let (low, high) = range(values).unwrap_or((0.0, 0.0));
    let magnitude = low.abs().max(high.abs());
    let exponent = exponent(magnitude);
    if magnitude == 0.0 {
        return ((-1.0, 1.0), 0);
    }
    let unit = 10f64.powi(exponent);
    let (low, high) = (low / unit, high / unit);
    // A constant is drawn as a line in the middle, not as its round-off.
    let room = (0.06 * (high - low)).max(5e-3 * magnitude / unit);
    ((low - room, high + room), exponent)
}

/// Whole decades around the positive values, at least three.
fn log_range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = range(values.filter(|v| *v > 0.0)).unwrap_or((1e-17, 1e-14));
    let (low, high) = (low.log10().floor().max(-25.0), high.log10().ceil());
    (low.min(high - 3.0), high)
}

fn log_ticks(y: (f64, f64)) -> usize {
    (((y.1 - y.0) as usize) + 1).min(9)
}

/// Only whole decades carry a label.
fn log_tick(value: f64) -> String {
    let whole = value.round();
    if (value - whole).abs() < 1e-9 { power_of_ten(whole as i32) } else { String::new() }
}
