//! The convex hull of points in a plane (Andrew's monotone chain).

use super::view::Place;

/// The corners in their order around; points on an edge are left out.
pub(super) fn hull(mut points: Vec<Place>) -> Vec<Place> {
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

/// One side, from the first point to the last.
fn chain<'a>(points: impl Iterator<Item = &'a Place>) -> Vec<Place> {
    let mut side: Vec<Place> = Vec::new();
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
    fn corners_of_a_square_with_points_inside_and_on_an_edge() {
        let points = [[0.0, 0.0], [1.0, 1.0], [0.5, 0.5], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0]];
        let found = hull(points.to_vec());
        assert_eq!(found, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(hull(vec![[2.0, 1.0]; 5]), [[2.0, 1.0]]);
        assert_eq!(hull(vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), [[0.0, 0.0], [2.0, 2.0]]);
    }
}
