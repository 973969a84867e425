//! Curves made fit for drawing: subsampled, scaled.

/// Points `(t, y)`.
pub(super) type Points = Vec<(f64, f64)>;

/// Buckets of [`subsample`]; each keeps at most two points.
const BUCKETS: usize = 1000;

/// Magnitudes below are drawn as zero: neither their power of ten nor their rounding unit is a normal number.
const SMALLEST: f64 = f64::MIN_POSITIVE / f64::EPSILON;
/// Magnitudes above are not drawn: the width of a range of such numbers need not be finite.
const LARGEST: f64 = f64::MAX / 8.0;

/// A value as it is drawn; `None`: not at all.
pub(super) fn drawable(value: f64) -> Option<f64> {
    let drawn = if value.abs() < SMALLEST { 0.0 } else { value };
    (drawn.abs() <= LARGEST).then_some(drawn)
}

/// At most 2000 points, the smallest and the largest of every stretch among them; what is not finite
/// is left out.
pub(super) fn subsample(t: &[f64], y: &[f64]) -> Points {
    let points: Points = t
        .iter()
        .copied()
        .zip(y.iter().copied())
        .filter(|(t, y)| t.is_finite() && y.is_finite())
        .collect();
    if points.len() <= 2 * BUCKETS {
        return points;
    }
    let size = points.len().div_ceil(BUCKETS);
    let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    let extremes = |bucket: &[(f64, f64)]| {
        let low = bucket.iter().min_by(by_value).copied();
        let high = bucket.iter().max_by(by_value).copied();
        let mut pair: Points = low.into_iter().chain(high).collect();
        pair.sort_by(|a, b| a.0.total_cmp(&b.0));
        pair.dedup();
        pair
    };
    points.chunks(size).flat_map(extremes).collect()
}

/// Smallest and largest of the values; `None` without any.
pub(super) fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range, y| match range {
        None => Some((y, y)),
        Some((low, high)) => Some((y.min(low), y.max(high))),
    })
}

/// The range itself, or one about it that is wide enough to be divided by ticks.
pub(super) fn divisible((low, high): (f64, f64)) -> (f64, f64) {
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

/// A tick label: as many decimals as the distance of the ticks asks for, no trailing zeros.
pub(super) fn tick(value: f64, span: f64) -> String {
    let decimals = (2.0 - span.max(f64::MIN_POSITIVE).log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.decimals$}");
    let text =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
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
        assert!(points.len() <= 2000, "{}", points.len());
        assert!(points.contains(&(77_777.0, 9.0)) && points.contains(&(12_345.0, -9.0)));
        assert!(points.windows(2).all(|w| w[0].0 < w[1].0));
    }

    #[test]
    fn labels() {
        assert_eq!(power_of_ten(-16), "10⁻¹⁶");
        assert_eq!(power_of_ten(205), "10²⁰⁵");
        assert_eq!(tick(-0.0, 1.0), "0");
        assert_eq!(tick(0.25, 1.0), "0.25");
        assert_eq!(tick(-10.0, 40.0), "−10");
        assert_eq!((exponent(0.5), exponent(3e-12), exponent(0.0)), (0, -12, 0));
    }
}
