//! Charts below one another as a drawing: titles, legends, axes, curves.

use super::axis::{AxisScale, ChartAxis, Tick};
use super::chart::{LineChart, Series, Strokes};
use super::coincidence;
use super::drawing::{Anchor, BOLD, Color, Drawing, Mark, Point, Stroke, Words, shortened, width};
use super::page::escape;
use super::style::Style;

/// Points of a curve that are nearer to the last one are left out, px.
const NEAR: f64 = 0.2;
/// Largest ratio of the scales of two lengths that are drawn to one scale instead.
const SLENDER: f64 = 20.0;
/// A curve with more points is drawn by a thinner line.
const DENSE: usize = 1200;

impl LineChart {
    /// The chart as a stand-alone SVG on white.
    #[must_use]
    pub fn svg(&self) -> String {
        self.drawing(&Style::report()).svg()
    }

    /// The chart in a style.
    #[must_use]
    pub fn drawing(&self, style: &Style) -> Drawing {
        panels(std::slice::from_ref(self), style)
    }
}

/// The charts in a style; with one horizontal axis if all have the same.
pub(crate) fn panels(charts: &[LineChart], style: &Style) -> Drawing {
    let shared = charts.windows(2).all(|pair| pair[0].x == pair[1].x);
    let mut parts: Vec<Panel> = charts.iter().map(|chart| Panel::new(chart, style)).collect();
    let below: f64 = parts.iter().map(|part| part.below).sum();
    let mut drawing = Drawing::new(style.size.0, style.size.1 + below, style.typeface);
    if shared {
        let all =
            || charts.iter().flat_map(|c| &c.curves).flat_map(|c| c.points.iter().map(|p| p.0));
        parts.iter_mut().for_each(|part| part.x = AxisScale::across(&part.chart.x, all()));
    }
    let last = parts.len().saturating_sub(1);
    let labelled = |k: usize| !shared || k == last;
    let head = |part: &Panel| part.head;
    let foot = |k: usize| if labelled(k) { style.foot() } else { 0.6 * style.tick };
    let taken: f64 = parts.iter().map(head).sum::<f64>() + (0..parts.len()).map(foot).sum::<f64>();
    let height = ((style.size.1 - taken) / parts.len().max(1) as f64).max(style.tick);
    let right = style.size.0 - 1.5 * style.tick;
    let mut top = 0.0;
    for (k, part) in parts.iter_mut().enumerate() {
        let area =
            Area { left: 0.0, right, top: top + part.head, bottom: top + part.head + height };
        part.set(area);
        top = part.area.bottom + foot(k) + part.below;
    }
    let left = parts.iter().map(Panel::left).fold(style.left, f64::max);
    for (k, part) in parts.iter_mut().enumerate() {
        part.area.left = left;
        part.equalize();
        part.draw(&mut drawing, labelled(k));
    }
    if let [part] = parts.as_slice() {
        match [&part.chart.x, &part.chart.y].map(ChartAxis::is_of_the_scene) {
            [true, _] => drawing.attribute("data-plot", &part.area_and_range(&part.x)),
            [_, true] => part.mark_rise(&mut drawing),
            _ => {}
        }
    }
    drawing
}

impl Style {
    /// Room below a chart for ticks, their labels and that of the axis.
    fn foot(&self) -> f64 {
        self.tick_length() + 1.45 * self.tick + 1.6 * self.label
    }

    /// Left of a title.
    fn margin(&self) -> f64 {
        0.82 * self.title
    }

    fn tick_length(&self) -> f64 {
        0.36 * self.tick
    }

    fn words(&self, at: Point, text: String, size: f64, anchor: Anchor) -> Words {
        let (color, bold, upward, exact) = (self.ink, false, false, false);
        Words { at, text, size, color, anchor, bold, upward, exact }
    }
}

/// Where curves are drawn, px.
#[derive(Clone, Copy, Default)]
struct Area {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

struct Panel<'a> {
    chart: &'a LineChart,
    style: &'a Style,
    curves: Vec<Series>,
    x: AxisScale,
    y: AxisScale,
    /// Rows of the legend: curves with their names.
    legend: Vec<Vec<(usize, String)>>,
    /// Whether the legend stands beside the title.
    beside: bool,
    title: String,
    head: f64,
    /// Room for a legend below the chart.
    below: f64,
    area: Area,
    /// How many others each curve lies on.
    covered: Vec<usize>,
}

impl<'a> Panel<'a> {
    fn new(chart: &'a LineChart, style: &'a Style) -> Self {
        let curves = chart.drawn_curves();
        let points = || curves.iter().flat_map(|c| &c.points);
        let x = AxisScale::across(&chart.x, points().map(|p| p.0));
        let y = AxisScale::up(&chart.y, points().map(|p| p.1), chart.resolution);
        let names = chart.legend().into_iter().enumerate().filter(|(_, name)| !name.is_empty());
        let names: Vec<(usize, String)> = names.collect();
        let titled = style.titled && !chart.title.is_empty();
        // for a title, and for a row of the legend
        let across = style.size.0 - 2.0 * style.margin();
        let title = match titled {
            true => shortened(&chart.title, BOLD * style.title, style.typeface, across),
            false => String::new(),
        };
        let all = Legend { style, names: &names }.width(&names);
        let taken = width(&title, BOLD * style.title, style.typeface) + 3.0 * style.title;
        let beside = titled && !style.legend_below && all + taken <= style.size.0;
        let room = match (beside, titled) {
            (true, _) => f64::INFINITY,
            (false, true) => across,
            (false, false) => style.size.0 - style.left.max(30.0),
        };
        let names: Vec<(usize, String)> =
            names.into_iter().map(|(k, name)| (k, Legend::fitting(style, &name, room))).collect();
        let rows = Legend { style, names: &names }.rows(room);
        let row = 1.35 * style.tick;
        let height = row * rows.len() as f64;
        let below = match style.legend_below && height > 0.0 {
            true => height + 0.4 * style.tick,
            false => 0.0,
        };
        let head = if titled { 2.1 * style.title } else { 0.0 };
        let head = if beside || style.legend_below { head } else { head + height };
        let head = head + if titled { 0.35 * style.title } else { 0.6 * style.tick };
        let (area, covered) = (Area::default(), Vec::new());
        let legend = rows;
        Self { chart, style, curves, x, y, legend, beside, title, head, below, area, covered }
    }

    fn set(&mut self, area: Area) {
        self.area = area;
    }

    fn ticks(&self) -> [Vec<Tick>; 2] {
        let Area { left, right, top, bottom } = self.area;
        let count = |length: f64, apart: f64| (length / apart).floor().max(2.0) as usize;
        let [across, up] = self.style.ticks;
        [self.x.ticks(count(right - left, across)), self.y.ticks(count(bottom - top, up))]
    }

    /// Room for the labels of the vertical axis.
    fn left(&self) -> f64 {
        let Style { tick, label, typeface, .. } = self.style;
        let [_, ticks] = self.ticks();
        let widest = ticks.iter().map(|t| width(&t.label, *tick, *typeface)).fold(0.0, f64::max);
        widest + self.style.tick_length() + 0.35 * tick + 1.5 * label
    }

    /// Both axes to one scale where both show lengths, neither of them much shorter than the other.
    fn equalize(&mut self) {
        let length = |axis: &super::axis::ChartAxis| axis.unit == "m" && !axis.logarithmic;
        if !(length(&self.chart.x) && length(&self.chart.y)) {
            return;
        }
        let Area { left, right, top, bottom } = self.area;
        let scales = [(right - left) / self.x.extent(), (bottom - top) / self.y.extent()];
        let scale = scales[0].min(scales[1]);
        if scales[0].max(scales[1]) > SLENDER * scale {
            return;
        }
        self.x.widen((right - left) / scale);
        self.y.widen((bottom - top) / scale);
    }

    fn place(&self, p: &(f64, f64)) -> Option<Point> {
        let Area { left, right, top, bottom } = self.area;
        let (x, y) = (self.x.place(p.0)?, self.y.place(p.1)?);
        Some([left + x * (right - left), bottom - y * (bottom - top)])
    }

    /// Colour and dashes of a curve.
    fn look(&self, curve: usize) -> (Color, &'static [f64]) {
        let (color, dashes) = self.style.curve(curve);
        (color, coincidence::dashes(self.covers(curve)).unwrap_or(dashes))
    }

    /// How many others a curve lies on.
    fn covers(&self, curve: usize) -> usize {
        self.covered.get(curve).copied().unwrap_or_default()
    }

    fn draw(&mut self, drawing: &mut Drawing, labelled: bool) {
        self.draw_axes(drawing, labelled);
        if !self.style.patterns && matches!(self.chart.strokes, Strokes::Line | Strokes::MarkedLine)
        {
            let places =
                |curve: &Series| curve.points.iter().filter_map(|p| self.place(p)).collect();
            self.covered = coincidence::covered(self.curves.iter().map(places).collect());
        }
        // the first curve lies on top; where points crowd, thin lines let the others through
        let dense = self.curves.iter().any(|c| c.points.len() > DENSE);
        for (i, curve) in self.curves.iter().enumerate().rev() {
            self.draw_curve(drawing, i, curve, self.style.widths[usize::from(dense)]);
        }
        self.draw_head(drawing);
    }

    fn draw_curve(&self, drawing: &mut Drawing, i: usize, curve: &Series, width: f64) {
        let (color, dashes) = self.look(i);
        let last = i + 1 == self.curves.len();
        let [marked, lined] = match self.chart.strokes {
            Strokes::Line | Strokes::LineOverBounds => [false, true],
            Strokes::MarkedLine => [true, true],
            Strokes::Marks => [true, false],
            Strokes::LineOverMarks => [last, !last],
        };
        if marked {
            let places = curve.points.iter().filter_map(|p| self.place(p));
            let radius = coincidence::radius(self.style.mark, self.covers(i));
            places.for_each(|at| drawing.push(Mark::Disc(at, radius, color)));
        }
        if !lined {
            return;
        }
        // values that are not numbers interrupt a curve
        for part in curve.points.split(|p| p.0.is_nan() || p.1.is_nan()) {
            let places = thinned(part.iter().filter_map(|p| self.place(p)));
            if places.len() > 1 {
                drawing.push(Mark::Line(places, Stroke { color, width, dashes }));
            }
        }
    }

    fn draw_axes(&self, drawing: &mut Drawing, labelled: bool) {
        let (style, Area { left, right, top, bottom }) = (self.style, self.area);
        let [across, up] = self.ticks();
        let (ink, thin) = (style.ink, style.widths[2]);
        let axis = Stroke::solid(if style.grid { ink.faded(0.55) } else { ink }, thin);
        let grid = Stroke::solid(ink.faded(0.14), thin);
        let mut line =
            |points: Vec<Point>, stroke: Stroke| drawing.push(Mark::Line(points, stroke));
        for tick in &across {
            let x = left + tick.place * (right - left);
            let size = style.tick_length() * if tick.label.is_empty() { 0.6 } else { 1.0 };
            match style.grid {
                true if tick.label.is_empty() => {}
                true => line(vec![[x, top], [x, bottom]], grid),
                false => line(vec![[x, bottom], [x, bottom - size]], axis),
            }
            if style.grid {
                line(vec![[x, bottom], [x, bottom + size]], axis);
            }
        }
        for tick in &up {
            let y = bottom - tick.place * (bottom - top);
            let size = style.tick_length() * if tick.label.is_empty() { 0.6 } else { 1.0 };
            match style.grid {
                true if tick.label.is_empty() => {}
                true => line(vec![[left, y], [right, y]], grid),
                false => line(vec![[left, y], [left + size, y]], axis),
            }
            if style.grid {
                line(vec![[left, y], [left - size, y]], axis);
            }
        }
        match style.grid {
            true => line(vec![[left, top], [left, bottom], [right, bottom]], axis),
            false => {
                let frame = [[left, top], [left, bottom], [right, bottom], [right, top]];
                line([&frame[..], &frame[..2]].concat(), axis);
            }
        }
        let mark = Stroke { dashes: &[1.5, 2.5], ..Stroke::solid(ink.faded(0.7), thin) };
        let places = self.chart.marks.iter().filter_map(|x| self.x.place(*x));
        for place in places.filter(|place| (0.0..=1.0).contains(place)) {
            let x = left + place * (right - left);
            line(vec![[x, top], [x, bottom]], mark);
        }
        self.draw_labels(drawing, &across, &up, labelled);
    }

    fn draw_labels(&self, drawing: &mut Drawing, across: &[Tick], up: &[Tick], labelled: bool) {
        let (style, Area { left, right, top, bottom }) = (self.style, self.area);
        let beyond = if style.grid { style.tick_length() } else { 0.0 } + 0.35 * style.tick;
        for tick in up {
            let at = [left - beyond, bottom - tick.place * (bottom - top)];
            let words = style.words(at, tick.label.clone(), style.tick, Anchor::End);
            drawing.push(Mark::Words(words));
        }
        let middle = 0.5 * (top + bottom);
        let at = [0.75 * style.label, middle];
        let words = style.words(at, self.y.label.clone(), style.label, Anchor::Middle);
        let size = fitting(&words, style.typeface, bottom - top + self.head);
        drawing.push(Mark::Words(Words { upward: true, size, ..words }));
        if !labelled {
            return;
        }
        let line = bottom + beyond + 0.45 * style.tick;
        for tick in across {
            let at = [left + tick.place * (right - left), line];
            let words = style.words(at, tick.label.clone(), style.tick, Anchor::Middle);
            drawing.push(Mark::Words(words));
        }
        let at = [0.5 * (left + right), line + 0.6 * style.tick + 0.85 * style.label];
        let words = style.words(at, self.x.label.clone(), style.label, Anchor::Middle);
        drawing.push(Mark::Words(words));
    }

    /// Title on the left, legend on the right or below.
    fn draw_head(&self, drawing: &mut Drawing) {
        let style = self.style;
        let begin = self.area.top - self.head;
        let mut y = begin + 0.7 * style.tick;
        let titled = !self.title.is_empty();
        if titled {
            let at = [style.margin(), begin + 1.05 * style.title];
            let words = style.words(at, self.title.clone(), style.title, Anchor::Start);
            drawing.push(Mark::Words(Words { bold: true, exact: true, ..words }));
            y = if self.beside { at[1] } else { begin + 2.1 * style.title + 0.6 * style.tick };
        }
        if style.legend_below {
            y = self.area.bottom + style.foot() + 0.8 * style.tick;
        }
        for row in &self.legend {
            let legend = Legend { style, names: row };
            let mut x = match (self.beside, titled) {
                (true, _) => self.area.right - legend.width(row),
                (false, true) => style.margin(),
                (false, false) => self.area.left,
            };
            for (i, name) in row {
                let (color, dashes) = style.curve(*i); // solid, also where it lies on others
                let line = vec![[x, y], [x + legend.sample(), y]];
                let width = style.widths[0] * if style.patterns { 1.0 } else { 1.67 };
                drawing.push(Mark::Line(line, Stroke { color, width, dashes }));
                let at = [x + legend.sample() + legend.gap(), y];
                let words = style.words(at, name.clone(), style.tick, Anchor::Start);
                drawing.push(Mark::Words(Words { exact: style.titled, ..words }));
                x += legend.entry(name);
            }
            y += 1.35 * style.tick;
        }
    }

    /// For a page that marks a value of the vertical axis, and the points of the curves there.
    fn mark_rise(&self, drawing: &mut Drawing) {
        drawing.attribute("data-rise", &self.area_and_range(&self.y));
        drawing.attribute("data-across", &self.area_and_range(&self.x));
        let names: Vec<String> = self.curves.iter().map(|curve| escape(&curve.name)).collect();
        drawing.attribute("data-curves", &names.join("&#10;"));
    }

    /// Left, right, top and bottom of the area, and the values at the ends of a scale: for a page
    /// that marks a value on several charts.
    fn area_and_range(&self, scale: &AxisScale) -> String {
        let Area { left, right, top, bottom } = self.area;
        let unit = 10f64.powi(scale.exponent);
        let (first, last) = (unit * scale.range.0, unit * scale.range.1);
        format!("{left:.2} {right:.2} {top:.2} {bottom:.2} {first} {last}")
    }
}

/// The size at which words are no longer than `room`.
fn fitting(words: &Words, typeface: super::drawing::Typeface, room: f64) -> f64 {
    let long = width(&words.text, words.size, typeface);
    words.size * (room / long.max(f64::MIN_POSITIVE)).min(1.0)
}

/// Without points that lie on the one before.
fn thinned(places: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    let mut last = None;
    for at in places {
        let near = |p: &Point| (p[0] - at[0]).abs() < NEAR && (p[1] - at[1]).abs() < NEAR;
        match kept.last().is_some_and(near) {
            true => last = Some(at),
            false => {
                kept.push(at);
                last = None;
            }
        }
    }
    kept.extend(last);
    kept
}

/// Names of curves with samples of their lines.
struct Legend<'a> {
    style: &'a Style,
    names: &'a [(usize, String)],
}

impl Legend<'_> {
    /// A name that fits a row.
    fn fitting(style: &Style, name: &str, room: f64) -> String {
        let own = Legend { style, names: &[] };
        let room = room - own.sample() - own.gap();
        shortened(name, style.tick, style.typeface, room)
    }

    /// Length of a sample.
    fn sample(&self) -> f64 {
        if self.style.patterns { 2.6 * self.style.tick } else { 1.6 * self.style.tick }
    }

    /// Between a sample and its name.
    fn gap(&self) -> f64 {
        0.5 * self.style.tick
    }

    fn entry(&self, name: &str) -> f64 {
        let words = width(name, self.style.tick, self.style.typeface);
        self.sample() + self.gap() + words + 1.2 * self.style.tick
    }

    fn width(&self, names: &[(usize, String)]) -> f64 {
        names.iter().map(|(_, name)| self.entry(name)).sum::<f64>() - 1.2 * self.style.tick
    }

    /// Rows that are not longer than `room`.
    fn rows(&self, room: f64) -> Vec<Vec<(usize, String)>> {
        let mut rows: Vec<Vec<(usize, String)>> = Vec::new();
        for entry in self.names {
            match rows.last_mut().filter(|row| self.width(row) + self.entry(&entry.1) <= room) {
                Some(row) => row.push(entry.clone()),
                None => rows.push(vec![entry.clone()]),
            }
        }
        rows
    }
}
