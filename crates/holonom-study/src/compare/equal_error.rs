//! Both families at the same error: time against error is interpolated, `log t` over `log e`.
//!
//! A family is represented by the scheme that is fastest there. A time is a median with the
//! shortest and the longest of its runs, and so is a ratio: `[min/max, max/min]`.

use super::record::{Comparison, Record, WorkPoint};

/// A time with the range of its measurements, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredTime {
    /// Median.
    pub median: f64,
    /// Shortest and longest.
    pub range: [f64; 2],
}

/// A ratio of two times, with the range that follows from those of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeRatio {
    /// Of the medians.
    pub median: f64,
    /// Smallest and largest.
    pub range: [f64; 2],
}

/// A scheme and an order.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Name of the scheme.
    pub scheme: String,
    /// Order.
    pub order: u32,
    /// Time at the error.
    pub time: MeasuredTime,
}

/// Two families at the same error.
#[derive(Clone, Debug, PartialEq)]
pub struct EqualError {
    /// The error at the end (m; directors 1).
    pub error: f64,
    /// The fastest variational scheme.
    pub variational: Choice,
    /// The fastest energy–momentum scheme.
    pub energy_momentum: Choice,
}

impl EqualError {
    /// Time of the energy–momentum scheme over that of the variational one.
    #[must_use]
    pub fn ratio(&self) -> TimeRatio {
        let (vi, em) = (&self.variational.time, &self.energy_momentum.time);
        let range = [em.range[0] / vi.range[1], em.range[1] / vi.range[0]];
        TimeRatio { median: em.median / vi.median, range }
    }
}

/// The points of a scheme at an order, by falling error.
fn curve(record: &Record, order: u32, floor: f64) -> Vec<(f64, MeasuredTime)> {
    let time = |p: &WorkPoint| {
        let (median, error) = (p.seconds?, p.error?);
        let usable = error.is_finite() && floor.is_finite();
        let time = MeasuredTime { median, range: p.seconds_range.unwrap_or([median; 2]) };
        usable.then_some((error.max(floor), time)) // below the floor an error is not known
    };
    let of = record.work.iter().filter(|p| p.order == order);
    let mut points: Vec<_> = of.filter_map(time).collect();
    points.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.median.total_cmp(&b.1.median)));
    // the cheapest at the floor
    points.dedup_by(|later, kept| later.0.to_bits() == kept.0.to_bits());
    points
}

/// The time at an error; where the largest step is more accurate already, the time of that step.
fn at(points: &[(f64, MeasuredTime)], error: f64) -> Option<MeasuredTime> {
    if let Some((_, time)) = points.first().filter(|first| first.0 <= error) {
        return Some(*time);
    }
    let pair = points.windows(2).find(|pair| pair[1].0 <= error && error <= pair[0].0)?;
    let ((e0, t0), (e1, t1)) = (pair[0], pair[1]);
    let part = if e0 > e1 { (e0 / error).ln() / (e0 / e1).ln() } else { 0.0 };
    let between = |a: f64, b: f64| a * (b / a).powf(part);
    Some(MeasuredTime {
        median: between(t0.median, t1.median),
        range: [between(t0.range[0], t1.range[0]), between(t0.range[1], t1.range[1])],
    })
}

/// The errors that a family reaches at some orders: smallest and largest.
fn reach(c: &Comparison, em: bool, orders: &[u32], floor: f64) -> Option<[f64; 2]> {
    let family = c.records.iter().filter(|r| r.energy_momentum == em);
    let curves = family.flat_map(|r| orders.iter().map(move |order| curve(r, *order, floor)));
    let ends = curves.filter(|points| !points.is_empty());
    let ends = ends.map(|points| [points[points.len() - 1].0, points[0].0]);
    ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// The fastest scheme of a family at an error.
#[must_use]
pub fn fastest(c: &Comparison, em: bool, orders: &[u32], error: f64) -> Option<Choice> {
    let family = c.records.iter().filter(|r| r.energy_momentum == em);
    let choices = family.flat_map(|r| {
        orders.iter().filter_map(move |&order| {
            let time = at(&curve(r, order, floor(c)), error)?;
            Some(Choice { scheme: r.scheme.clone(), order, time })
        })
    });
    choices.min_by(|a, b| a.time.median.total_cmp(&b.time.median))
}

/// Errors below ten times what the reference is known to, or near round-off, are not used.
fn floor(c: &Comparison) -> f64 {
    const ROUND_OFF: f64 = 1e-11;
    (10.0 * c.reference.known_to.unwrap_or(f64::INFINITY)).max(ROUND_OFF)
}

/// Both families by schemes of some orders: at the smallest error that both reach, where `finest`,
/// else in the middle of the errors that both reach.
#[must_use]
pub fn equal_error(c: &Comparison, orders: &[u32], finest: bool) -> Option<EqualError> {
    let [vi, em] = [false, true].map(|em| reach(c, em, orders, floor(c)));
    let (vi, em) = (vi?, em?);
    let (least, most) = (vi[0].max(em[0]), vi[1].min(em[1]));
    if least > most {
        return None;
    }
    let error = if finest { least } else { (least * most).sqrt() };
    let [variational, energy_momentum] = [false, true].map(|em| fastest(c, em, orders, error));
    Some(EqualError { error, variational: variational?, energy_momentum: energy_momentum? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_interpolated_along_a_power_law() {
        // e = t⁻², so t = e^(−1/2)
        let time = |median: f64| MeasuredTime { median, range: [0.9 * median, 1.2 * median] };
        let points: Vec<(f64, MeasuredTime)> =
            [1.0, 2.0, 4.0].map(|t: f64| (t.powi(-2), time(t))).into();
        let found = at(&points, 0.1).unwrap();
        assert!((found.median - 0.1_f64.powf(-0.5)).abs() < 1e-12, "{found:?}");
        assert!((found.range[1] / found.median - 1.2).abs() < 1e-12, "{found:?}");
        assert_eq!(at(&points, 2.0), Some(time(1.0)), "the largest step is more accurate");
        assert_eq!(at(&points, 0.01), None, "below them");
    }

    /// A scheme whose coarsest run is at round-off counts with the time of that run.
    #[test]
    fn errors_below_the_floor_count_as_the_floor() {
        let point = |step: f64, seconds, error| WorkPoint {
            order: 6,
            step,
            seconds: Some(seconds),
            seconds_range: None,
            error: Some(error),
            missing: None,
        };
        let record = Record {
            scheme: "nodal".into(),
            energy_momentum: false,
            outcome: super::super::record::SchemeOutcome::Done,
            measured: None,
            conditions: Vec::new(),
            work: vec![point(0.1, 1.0, 4e-12), point(0.05, 2.0, 1e-13)],
        };
        let points = curve(&record, 6, 1e-11);
        assert_eq!(points.len(), 1);
        assert_eq!(at(&points, 1e-11).map(|t| t.median), Some(1.0));
        assert_eq!(at(&points, 1e-10).map(|t| t.median), Some(1.0));
        assert!(curve(&record, 6, f64::INFINITY).is_empty());
    }

    #[test]
    fn a_ratio_has_the_range_of_both_times() {
        let choice = |median: f64, range| {
            let time = MeasuredTime { median, range };
            Choice { scheme: String::new(), order: 2, time }
        };
        let found = EqualError {
            error: 1e-3,
            variational: choice(1.0, [0.5, 2.0]),
            energy_momentum: choice(3.0, [2.0, 4.0]),
        };
        assert_eq!(found.ratio(), TimeRatio { median: 3.0, range: [1.0, 8.0] });
    }
}
