//! Curves made fit for drawing: subsampled, scaled.

/// Points `(t, y)`.
pub(super) type PointList = Vec<(f64, f64)>;

/// Buckets of [`subsample`]; each keeps at most two points.
const BUCKETS: usize = 1000;

/// Magnitudes below are drawn as zero: neither their power of ten nor their rounding unit is a
/// normal number.
const SMALLEST: f64 = f64::MIN_POSITIVE / f64::EPSILON;
/// Magnitudes above are not drawn: the width of a range of such numbers need not be finite.
const LARGEST: f64 = f64::MAX / 8.0;

/// A value as it is drawn; `None`: not at all.
pub(super) fn drawable(value: f64) -> Option<f64> {
    let drawn = if value.abs() < SMALLEST { 0.0 } else { value };
    (drawn.abs() <= LARGEST).then_some(drawn)
}

/// At most 2002 points, the ends and the smallest and the largest of every stretch among them; of
/// longer curves what is not finite is left out.
pub(super) fn subsample(t: &[f64], y: &[f64]) -> PointList {
    let all = || t.iter().copied().zip(y.iter().copied());
    if t.len() <= 2 * BUCKETS {
        return all().collect();
    }
    let points: PointList = all().filter(|(t, y)| t.is_finite() && y.is_finite()).collect();
    let size = points.len().div_ceil(BUCKETS).max(1); // where nothing is finite, too
    let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    let extremes = |bucket: &[(f64, f64)]| {
        let low = bucket.iter().min_by(by_value).copied();
        let high = bucket.iter().max_by(by_value).copied();
        let mut pair: PointList = low.into_iter().chain(high).collect();
        pair.sort_by(|a, b| a.0.total_cmp(&b.0));
        pair.dedup();
        pair
    };
    let ends = [points.first().copied(), points.last().copied()];
    let within = points.chunks(size).flat_map(extremes);
    let mut kept: PointList = ends[0].into_iter().chain(within).chain(ends[1]).collect();
    kept.dedup();
    kept
}

/// Smallest and largest of the values; `None` without any.
pub(super) fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range, y| match range {
        None => Some((y, y)),
        Some((low, high)) => Some((y.min(low), y.max(high))),
    })
}

/// The range itself, or one about it that is wide enough to be divided by ticks.
pub(super) fn divisible(low: f64, high: f64) -> (f64, f64) {
    const RELATIVE: f64 = 1e-6;
    let size = low.abs().max(high.abs());
    match high - low > RELATIVE * size {
        true => (low, high),
        false if size == 0.0 => (low, high + 1.0),
        false => (low, high + size),
    }
}

/// The power of ten to take out of tick labels; 0 for numbers of ordinary size.
pub(super) fn exponent(magnitude: f64) -> i32 {
    if magnitude <= 0.0 || !magnitude.is_finite() {
        return 0;
    }
    let exponent = magnitude.log10().floor() as i32;
    if (-2..4).contains(&exponent) { 0 } else { exponent }
}

/// `10ⁿ` with superscript digits.
pub(super) fn power_of_ten(exponent: i32) -> String {
    let superscript = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or(0)).unwrap_or('⁰'),
    };
    format!("10{}", exponent.to_string().chars().map(superscript).collect::<String>())
}

/// A tick label with the decimals that multiples of `step` have.
pub(super) fn tick(value: f64, step: f64) -> String {
    let decimals = (-(step.log10() + 1e-9).floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.decimals$}");
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if zero { text.replace('-', "") } else { text.replace('-', "−") }
}

/// Multiples of 1, 2 or 5 times a power of ten in a range, at most `count + 1`, with their
/// distance.
pub(super) fn multiples(low: f64, high: f64, count: usize) -> (Vec<f64>, f64) {
    let least = (high - low) / count.max(1) as f64;
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power);
    let step = step.into_iter().find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(10.0 * power);
    let tolerance = 1e-9 * (high - low) / step;
    let (first, last) = ((low / step - tolerance).ceil(), (high / step + tolerance).floor());
    let whole = (last - first).clamp(-1.0, 100.0) as i32;
    ((0..=whole).map(|k| (first + f64::from(k)) * step).collect(), step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_points_with_all_extremes() {
        let t: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y: Vec<f64> = t.iter().map(|t| (t * 0.01).sin()).collect();
        (y[77_777], y[12_345], y[500]) = (9.0, -9.0, f64::NAN);
        let points = subsample(&t, &y);
        assert!(points.len() <= 2002, "{}", points.len());
        assert_eq!((points[0].0, points[points.len() - 1].0), (0.0, 99_999.0));
        assert!(points.contains(&(77_777.0, 9.0)) && points.contains(&(12_345.0, -9.0)));
        assert!(points.windows(2).all(|w| w[0].0 < w[1].0));
    }

    #[test]
    fn long_curves_without_a_finite_value_have_no_points() {
        let t: Vec<f64> = (0..3000).map(f64::from).collect();
        assert!(subsample(&t, &vec![f64::NAN; t.len()]).is_empty());
        let mut y = vec![f64::NAN; t.len()];
        y[7] = 1.0;
        assert_eq!(subsample(&t, &y), [(7.0, 1.0)]);
    }

    #[test]
    fn ticks_are_few_and_round() {
        let (ticks, step) = multiples(-0.013, 0.31, 7);
        let labels: Vec<String> = ticks.iter().map(|t| tick(*t, step)).collect();
        assert_eq!(labels, ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]);
        assert_eq!(multiples(0.0, 10.0, 10), ((0..=10).map(f64::from).collect(), 1.0));
        for size in [1e-6, 0.3, 7.7, 5e4] {
            let (ticks, _) = multiples(-0.4 * size, size, 6);
            assert!((3..=7).contains(&ticks.len()), "{ticks:?}");
        }
    }

    #[test]
    fn labels() {
        assert_eq!(power_of_ten(-16), "10⁻¹⁶");
        assert_eq!(power_of_ten(205), "10²⁰⁵");
        assert_eq!(tick(-0.0, 1.0), "0");
        assert_eq!(tick(-1e-17, 0.5), "0.0");
        assert_eq!(tick(0.25, 0.05), "0.25");
        assert_eq!(tick(19.4, 0.05), "19.40");
        assert_eq!(tick(-10.0, 20.0), "−10");
        assert_eq!((exponent(0.5), exponent(3e-12), exponent(0.0)), (0, -12, 0));
    }
}
