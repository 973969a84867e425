//! Curves that lie on one another: those on top are dashed, so that the lower ones show in their
//! gaps.

use super::drawing::Point;

/// Distance below which two curves look like one, px.
const NEAR: f64 = 1.5;
/// Part of a curve that hides another one.
const MUCH: f64 = 0.5;
/// Dashes and gaps, px, over one, two, … curves: in the gaps of each the next ones show.
const DASHES: [&[f64]; 4] = [&[7.0, 7.0], &[7.0, 14.0], &[7.0, 21.0], &[7.0, 28.0]];

/// Dashes of a curve that lies on so many others; `None` where it lies on none.
pub(super) fn dashes(below: usize) -> Option<&'static [f64]> {
    below.checked_sub(1).map(|k| DASHES[k.min(DASHES.len() - 1)])
}

/// Radius of the marks of a curve over others, so that the lower ones show as rings.
pub(super) fn radius(mark: f64, below: usize) -> f64 {
    mark / (1.0 + 0.4 * below as f64)
}

/// How many of the later curves, which are drawn below, each curve lies on.
pub(super) fn covered(mut curves: Vec<Vec<Point>>) -> Vec<usize> {
    for curve in &mut curves {
        if curve.first().zip(curve.last()).is_some_and(|(a, b)| a[0] > b[0]) {
            curve.reverse(); // from the left to the right
        }
    }
    let of = |k: usize| curves[k + 1..].iter().filter(|other| hides(&curves[k], other)).count();
    (0..curves.len()).map(of).collect()
}

/// Whether a curve lies on another one over much of its length; both go from the left to the right.
fn hides(curve: &[Point], other: &[Point]) -> bool {
    let mut next = 0;
    let near = |p: &&Point| {
        while other.get(next).is_some_and(|q| q[0] < p[0] || q[0].is_nan()) {
            next += 1;
        }
        height(other, next, p[0]).is_some_and(|y| (y - p[1]).abs() < NEAR)
    };
    curve.len() > 1 && curve.iter().filter(near).count() as f64 > MUCH * curve.len() as f64
}

/// Height of a curve over a place `x` of the horizontal axis, before its point `next`.
fn height(curve: &[Point], next: usize, x: f64) -> Option<f64> {
    let b = curve.get(next)?;
    match next.checked_sub(1).map(|k| curve[k]) {
        Some(a) if b[0] > a[0] => Some(a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0])),
        _ => ((b[0] - x).abs() < NEAR).then_some(b[1]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(height: f64, slope: f64) -> Vec<Point> {
        (0..50).map(|k| f64::from(k) * 4.0).map(|x| [x, height + slope * x]).collect()
    }

    #[test]
    fn the_upper_ones_of_curves_that_coincide_are_dashed() {
        let curves = [line(10.0, 0.2), line(80.0, 0.0), line(10.5, 0.2), line(9.8, 0.2)];
        assert_eq!(covered(curves.to_vec()), [2, 0, 1, 0]);
        let gaps = [0, 1, 2, 9].map(|below| dashes(below).map_or(0, |d| d[1] as u32));
        assert_eq!(gaps, [0, 7, 14, 28]);
        let backwards = |curve: &Vec<Point>| curve.iter().rev().copied().collect();
        assert_eq!(covered(curves.iter().map(backwards).collect()), [2, 0, 1, 0]);
    }

    #[test]
    fn curves_that_cross_are_solid() {
        let curves = vec![line(0.0, 1.0), line(100.0, -1.0), vec![[3.0, 3.0]], Vec::new()];
        assert_eq!(covered(curves), [0; 4]);
    }

    #[test]
    fn a_gap_hides_nothing_and_ends_no_comparison() {
        let mut gap = line(10.0, 0.0);
        gap[10..13].fill([f64::NAN; 2]);
        assert_eq!(covered(vec![line(10.5, 0.0), gap.clone()]), [1, 0]);
        assert_eq!(covered(vec![gap, line(10.5, 0.0)]), [1, 0]);
    }

    #[test]
    fn curves_with_points_at_other_places_are_compared() {
        let coarse = vec![[0.0, 0.0], [196.0, 98.0]];
        assert_eq!(covered(vec![line(0.0, 0.5), coarse]), [1, 0]);
    }
}
