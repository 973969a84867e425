//! The convex hull of points in a plane (Andrew's monotone chain), and what it needs of many points
//! in space.

use nalgebra::Vector3;

use super::view::PlanePoint;

/// The corners in their order around; points on an edge are left out.
pub(super) fn hull(mut points: Vec<PlanePoint>) -> Vec<PlanePoint> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut around = chain(points.iter());
    let back = chain(points.iter().rev());
    around.pop();
    around.extend(&back[..back.len() - 1]);
    around
}

/// Of more points than these, those that are extreme in so many directions suffice: the outline
/// then misses at most half a percent of the size.
const DIRECTIONS: usize = 512;

/// The points that matter for hulls as seen from any side.
pub(super) fn extreme(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    if points.len() <= DIRECTIONS {
        return points.to_vec();
    }
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let farthest = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64; // a spiral from pole to pole
        let (sin, cos) = (golden * k as f64).sin_cos();
        let direction = Vector3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vector3::z() * z;
        let along = |point: &[f64; 3]| Vector3::from(*point).dot(&direction);
        (0..points.len()).max_by(|a, b| along(&points[*a]).total_cmp(&along(&points[*b])))
    };
    let mut found: Vec<usize> = (0..DIRECTIONS).filter_map(farthest).collect();
    found.sort_unstable();
    found.dedup();
    found.into_iter().map(|k| points[k]).collect()
}

/// One side, from the first point to the last.
fn chain<'a>(points: impl Iterator<Item = &'a PlanePoint>) -> Vec<PlanePoint> {
    let mut side: Vec<PlanePoint> = Vec::new();
    for point in points {
        while let [.., a, b] = side[..] {
            let turn = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]);
            if turn > 0.0 {
                break;
            }
            side.pop();
        }
        side.push(*point);
    }
    side
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_points_have_the_outline_of_many() {
        let many: Vec<[f64; 3]> = (0..20_000)
            .map(|k| {
                let (a, b) = (0.37 * f64::from(k), 0.0017 * f64::from(k));
                [a.cos() * b.sin(), a.sin() * b.sin(), 3.0 * b.cos()]
            })
            .collect();
        let few = extreme(&many);
        assert!(few.len() <= DIRECTIONS, "{} points", few.len());
        for angle in [0.0_f64, 0.4, 1.1, 2.0] {
            let (s, c) = angle.sin_cos();
            let along = |p: &[f64; 3]| c * p[0] + s * p[2];
            let most = |points: &[[f64; 3]]| points.iter().map(along).fold(f64::MIN, f64::max);
            let missed = most(&many) - most(&few);
            assert!(missed < 0.03, "{angle}: {missed} of a size of 6");
        }
    }

    #[test]
    fn corners_of_a_square_with_points_inside_and_on_an_edge() {
        let points = [[0.0, 0.0], [1.0, 1.0], [0.5, 0.5], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0]];
        let found = hull(points.to_vec());
        assert_eq!(found, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(hull(vec![[2.0, 1.0]; 5]), [[2.0, 1.0]]);
        assert_eq!(hull(vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), [[0.0, 0.0], [2.0, 2.0]]);
    }
}
