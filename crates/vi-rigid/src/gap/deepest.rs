//! Of many points that may touch, those that count.
//!
//! At most [`MOST`]: the deepest one, then the deepest of those that are not next to one that
//! counts. Where more than so many are as deep as the deepest, as those of a flat face, the
//! farthest of them along so many directions count first, which hold what lies between them. The
//! least gap is always that of a point that counts: one that is left out counts where it becomes
//! the deepest.

use nalgebra::Vector3;

/// Most points of a pair.
pub(super) const MOST: usize = 32;
/// Gaps that are alike, in parts of the size of the smaller shape.
const LEVEL: f64 = 1e-11;
/// Points are next to each other at a distance below this part of the smaller shape.
const NEXT: f64 = 0.4;

/// Takes the others out of the features from `start` on; `place`: of a feature in the components of
/// its shape, `sizes`: the lengths of both shapes, m.
pub(super) fn keep<'a>(
    out: &mut Vec<(u32, f64)>,
    start: usize,
    sizes: [f64; 2],
    place: impl Fn(u32) -> &'a Vector3<f64>,
) {
    let own = &mut out[start..];
    if own.len() <= MOST {
        return;
    }
    let deepest = own.iter().fold(f64::INFINITY, |least, x| least.min(x.1));
    let size = sizes[0].min(sizes[1]);
    let level = deepest + LEVEL * size;
    let alike = moved_to_front(own, |x| x.1 <= level);
    let mut kept = if alike > MOST { farthest(&mut own[..alike], &place) } else { alike };
    let next = NEXT * size;
    let is_apart = |a: u32, b: u32| (place(a) - place(b)).norm() >= next;
    // those of the level that do not count lie between those that do
    own.copy_within(alike.., kept);
    let mut left = own.len() - alike;
    for k in 0..kept {
        let (chosen, rest) = own.split_at_mut(kept);
        left = moved_to_front(&mut rest[..left], |x| is_apart(x.0, chosen[k].0));
    }
    while kept < MOST && left > 0 {
        let rest = &mut own[kept..kept + left];
        let deeper = |a: usize, b: usize| {
            let order = rest[a].1.total_cmp(&rest[b].1);
            if order.then(rest[a].0.cmp(&rest[b].0)).is_le() { a } else { b }
        };
        rest.swap(0, (1..left).fold(0, deeper));
        let (chosen, rest) = rest.split_at_mut(1);
        left = moved_to_front(rest, |x| is_apart(x.0, chosen[0].0));
        kept += 1;
    }
    out.truncate(start + kept);
    out[start..].sort_unstable_by_key(|(feature, _)| *feature);
}

/// Moves those that are asked for to the front; how many these are.
fn moved_to_front(own: &mut [(u32, f64)], is_one: impl Fn(&(u32, f64)) -> bool) -> usize {
    let mut count = 0;
    for k in 0..own.len() {
        if is_one(&own[k]) {
            own.swap(count, k);
            count += 1;
        }
    }
    count
}

/// Moves the farthest ones along each direction to the front; how many these are.
fn farthest<'a>(own: &mut [(u32, f64)], place: &impl Fn(u32) -> &'a Vector3<f64>) -> usize {
    let mut count = 0;
    for direction in (0..MOST).map(direction) {
        let along = |k: usize| direction.dot(place(own[k].0));
        let farther = |a: usize, b: usize| {
            let order = along(a).total_cmp(&along(b));
            if order.then(own[b].0.cmp(&own[a].0)).is_ge() { a } else { b }
        };
        let found = (1..own.len()).fold(0, farther);
        if found >= count {
            own.swap(count, found);
            count += 1;
        }
    }
    count
}

/// Directions evenly over all, none of them along an axis.
fn direction(k: usize) -> Vector3<f64> {
    const TURN: f64 = 2.399_963_229_728_653; // rad  the golden angle
    let z = (2.0 * k as f64 + 1.0) / MOST as f64 - 1.0;
    let (sin, cos) = libm::sincos(TURN * k as f64 + 0.1);
    let across = (1.0 - z * z).sqrt();
    Vector3::new(across * cos, across * sin, z)
}
