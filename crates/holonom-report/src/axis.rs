//! An axis: what it shows, its range, its ticks.

use super::series::{divisible, drawable, exponent, multiples, power_of_ten, range, tick};

/// What an axis shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChartAxis {
    /// The quantity.
    pub quantity: String,
    /// Its unit; empty for a number.
    pub unit: String,
    /// Logarithmic; only positive values are drawn.
    pub logarithmic: bool,
}

impl ChartAxis {
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

    /// The load factor of equilibria.
    #[must_use]
    pub fn load_factor() -> Self {
        Self::linear("load factor", "")
    }

    /// Whether the scene of a page marks its value on this axis.
    pub(super) fn is_of_the_scene(&self) -> bool {
        !self.logarithmic && (*self == Self::time() || *self == Self::load_factor())
    }

    /// Its label, `factor` a power of ten or empty.
    fn label(&self, factor: &str) -> String {
        match (factor, self.unit.as_str()) {
            ("", "") => self.quantity.clone(),
            (factor, unit) => format!("{} ({})", self.quantity, format!("{factor} {unit}").trim()),
        }
    }
}

/// From values to places along an axis.
pub(super) struct AxisScale {
    /// Its ends, in units of `10^exponent`, or as decimal logarithms.
    pub(super) range: (f64, f64),
    pub(super) exponent: i32,
    logarithmic: bool,
    pub(super) label: String,
}

/// A place on an axis that is marked.
pub(super) struct Tick {
    pub(super) place: f64,
    /// Empty for a minor one.
    pub(super) label: String,
}

impl AxisScale {
    /// The horizontal axis of curves with these values.
    pub(super) fn across(axis: &ChartAxis, values: impl Iterator<Item = f64>) -> Self {
        match axis.logarithmic {
            true => Self::logarithmic(axis, values.filter_map(drawable), 1.0),
            false => {
                let margin = if axis.quantity.starts_with("time") { 0.0 } else { 0.02 };
                let (range, exponent) = wide_range(values.filter_map(drawable), margin);
                Self::linear(axis, range, exponent)
            }
        }
    }

    /// The vertical axis; it shows at least `±resolution`.
    pub(super) fn up(axis: &ChartAxis, values: impl Iterator<Item = f64>, resolution: f64) -> Self {
        let values = values.filter_map(drawable);
        match axis.logarithmic {
            true => Self::logarithmic(axis, values, 3.0),
            false => {
                let (range, exponent) = linear_range(values, drawable(resolution).unwrap_or(0.0));
                Self::linear(axis, range, exponent)
            }
        }
    }

    fn logarithmic(axis: &ChartAxis, values: impl Iterator<Item = f64>, decades: f64) -> Self {
        let range = log_range(values, decades);
        Self { range, exponent: 0, logarithmic: true, label: axis.label("") }
    }

    fn linear(axis: &ChartAxis, range: (f64, f64), exponent: i32) -> Self {
        let factor = if exponent == 0 { String::new() } else { power_of_ten(exponent) };
        Self { range, exponent, logarithmic: false, label: axis.label(&factor) }
    }

    /// Between 0 and 1 along the axis. `None`: cannot be drawn.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let value = drawable(value)?;
        let (low, high) = self.range;
        let place = match self.logarithmic {
            true => (value > 0.0).then(|| value.log10().clamp(low, high))?,
            false => value / 10f64.powi(self.exponent),
        };
        Some((place - low) / (high - low))
    }

    /// At most about `count` ticks, their places between 0 and 1.
    pub(super) fn ticks(&self, count: usize) -> Vec<Tick> {
        let (low, high) = self.range;
        let at = |value: f64| (value - low) / (high - low);
        if self.logarithmic {
            return self.decades(count);
        }
        let (ticks, step) = multiples(low, high, count);
        ticks.into_iter().map(|v| Tick { place: at(v), label: tick(v, step) }).collect()
    }

    /// Whole decades, every one or every second …; between few of them minor ticks.
    fn decades(&self, count: usize) -> Vec<Tick> {
        let (low, high) = (self.range.0 as i32, self.range.1 as i32);
        let apart = (high - low).max(1) as usize;
        let every = apart.div_ceil(count.max(1));
        let place = |v: f64| (v - self.range.0) / (self.range.1 - self.range.0);
        let whole = (low..=high).rev().step_by(every);
        let mut ticks: Vec<Tick> =
            whole.map(|k| Tick { place: place(f64::from(k)), label: power_of_ten(k) }).collect();
        if apart <= MINOR {
            let between = |k: i32| (2..10).map(move |d| f64::from(k) + f64::from(d).log10());
            let minor = (low..high).flat_map(between);
            ticks.extend(minor.map(|v| Tick { place: place(v), label: String::new() }));
        }
        ticks
    }

    /// How many units of the quantity the axis is long.
    pub(super) fn extent(&self) -> f64 {
        (self.range.1 - self.range.0) * 10f64.powi(self.exponent)
    }

    /// Shows so many units of the quantity, about the same middle.
    pub(super) fn widen(&mut self, extent: f64) {
        let more = 0.5 * (extent / 10f64.powi(self.exponent) - (self.range.1 - self.range.0));
        self.range = (self.range.0 - more, self.range.1 + more);
    }
}

/// Decades that have minor ticks.
const MINOR: usize = 5;

/// The range of the values with a margin, in units of a power of ten where they are far from one.
fn wide_range(values: impl Iterator<Item = f64>, margin: f64) -> ((f64, f64), i32) {
    let (low, high) = range(values).unwrap_or((0.0, 1.0));
    let (low, high) = divisible(low, high);
    let margin = margin * (high - low);
    let (low, high) = (low - margin, high + margin);
    let exponent = exponent(low.abs().max(high.abs()));
    let exponent = if (-3..6).contains(&exponent) { 0 } else { exponent };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_far_from_one_second_have_a_power_of_ten() {
        let axis = ChartAxis::linear("q", "m");
        let label = |t: f64| AxisScale::across(&axis, [0.0, t].into_iter()).label;
        assert_eq!(label(3.0), "q (m)");
        assert_eq!(label(2e-12), "q (10⁻¹² m)");
        assert_eq!(label(3e7), "q (10⁷ m)");
    }

    #[test]
    fn decades_are_labelled_and_divided_where_they_are_few() {
        let axis = ChartAxis::logarithmic("r", "SI");
        let labels = |values: [f64; 2]| {
            let ticks = AxisScale::up(&axis, values.into_iter(), 0.0).ticks(6);
            let (major, minor): (Vec<Tick>, Vec<Tick>) =
                ticks.into_iter().partition(|t| !t.label.is_empty());
            (major.into_iter().map(|t| t.label).collect::<Vec<_>>().join(" "), minor.len())
        };
        assert_eq!(labels([2e-3, 0.5]), ("10⁰ 10⁻¹ 10⁻² 10⁻³".to_owned(), 24));
        assert_eq!(labels([2e-16, 1e-4]), ("10⁻⁴ 10⁻⁶ 10⁻⁸ 10⁻¹⁰ 10⁻¹² 10⁻¹⁴ 10⁻¹⁶".to_owned(), 0));
    }
}
