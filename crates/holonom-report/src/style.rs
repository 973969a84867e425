//! How charts look: on a page, or as a figure of a journal.

use super::drawing::{Color, Typeface};

/// px for each mm.
const MM: f64 = 96.0 / 25.4;
/// px for each point of 1/72 inch.
const PT: f64 = 96.0 / 72.0;

/// Text and axes.
pub(crate) const INK: Color = Color::new([31, 41, 55]);
const BLACK: Color = Color::new([0, 0, 0]);
/// Okabe and Ito's colours, distinguishable for colour-blind readers.
const COLORS: [Color; 6] = [
    Color::new([0, 114, 178]),
    Color::new([213, 94, 0]),
    Color::new([0, 158, 115]),
    Color::new([204, 121, 167]),
    Color::new([230, 159, 0]),
    Color::new([86, 180, 233]),
];
/// Lengths of dashes and gaps, px.
const DASHES: [&[f64]; 6] = [
    &[],
    &[6.0, 3.0],
    &[1.5, 2.0],
    &[8.0, 2.5, 1.5, 2.5],
    &[12.0, 3.0],
    &[8.0, 2.0, 1.5, 2.0, 1.5, 2.0],
];

/// Curves that can be distinguished on a chart.
pub(crate) const CURVES: usize = 12;

/// How charts look; lengths in px.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// Width and height of all charts.
    pub(crate) size: (f64, f64),
    pub(crate) typeface: Typeface,
    /// Whether there is a title.
    pub(crate) titled: bool,
    /// Whether lines cross the chart at the ticks.
    pub(crate) grid: bool,
    /// Whether curves differ without colours.
    pub(crate) patterns: bool,
    pub(crate) ink: Color,
    pub(crate) title: f64,
    pub(crate) label: f64,
    pub(crate) tick: f64,
    /// Width of curves, of curves of many points, of axes.
    pub(crate) widths: [f64; 3],
    /// Radius of marks.
    pub(crate) mark: f64,
    /// Smallest room for labels on the left.
    pub(crate) left: f64,
    /// Distance of ticks, at least: across, up.
    pub(crate) ticks: [f64; 2],
    /// Whether the legend stands below the chart, which is then as much higher.
    pub(crate) legend_below: bool,
}

impl Style {
    /// As on the page of a run.
    #[must_use]
    pub fn report() -> Self {
        Self {
            size: (880.0, 330.0),
            typeface: Typeface::Sans,
            titled: true,
            grid: true,
            patterns: false,
            ink: INK,
            title: 17.0,
            label: 15.0,
            tick: 14.0,
            widths: [1.8, 1.2, 1.0],
            mark: 4.0,
            left: 78.0,
            ticks: [85.0, 36.0],
            legend_below: false,
        }
    }

    /// As on a page, where two charts stand beside one another.
    #[must_use]
    pub fn page() -> Self {
        Self { size: (760.0, 310.0), left: 70.0, ..Self::report() }
    }

    /// As on a page that is read on a phone.
    #[must_use]
    pub fn phone() -> Self {
        Self {
            size: (350.0, 240.0),
            title: 14.0,
            label: 12.5,
            tick: 12.0,
            widths: [1.5, 1.1, 1.0],
            mark: 3.0,
            left: 52.0,
            ticks: [64.0, 34.0],
            legend_below: true,
            ..Self::report()
        }
    }

    /// A figure of one column: 84 mm wide, without a title, legible without colours.
    #[must_use]
    pub fn paper(typeface: Typeface) -> Self {
        Self {
            size: (84.0 * MM, 56.0 * MM),
            typeface,
            titled: false,
            grid: false,
            patterns: true,
            ink: BLACK,
            title: 8.0 * PT,
            label: 8.0 * PT,
            tick: 7.0 * PT,
            widths: [0.8 * PT, 0.6 * PT, 0.5 * PT],
            mark: 1.3 * PT,
            left: 0.0,
            ticks: [38.0, 22.0],
            legend_below: false,
        }
    }

    /// Of a height that fits so many charts below one another.
    #[must_use]
    pub fn for_charts(self, count: usize) -> Self {
        let (width, height) = self.size;
        let more = 0.65 * height * count.saturating_sub(1) as f64;
        Self { size: (width, height + more), ..self }
    }

    /// Of another width and height, mm.
    #[must_use]
    pub fn sized(self, width: f64, height: f64) -> Self {
        Self { size: (width * MM, height * MM), ..self }
    }

    /// Colour and dashes of a curve.
    pub(crate) fn curve(&self, index: usize) -> (Color, &'static [f64]) {
        let (at, beyond) = (index % COLORS.len(), index / COLORS.len());
        match self.patterns {
            // the first one black, then colours; each has a pattern of its own
            true if index == 0 => (BLACK, DASHES[0]),
            true => (COLORS[(at + COLORS.len() - 1 + beyond) % COLORS.len()], DASHES[at]),
            false => (color(index), DASHES[beyond % DASHES.len()]),
        }
    }
}

pub(crate) fn color(index: usize) -> Color {
    COLORS[index % COLORS.len()]
}
