//! Pairs of boxes that overlap, by a grid.
//!
//! Cells are as wide as the widest box of those that are not much wider than most; a box overlaps
//! those of its own cell and of the neighbours alone. The few that are wider are compared with all.
//! The cost is linear in the number of boxes of similar size and in that of their neighbours.

use nalgebra::Vector3;

/// A box with faces along the axes of space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisBox {
    pub(super) low: Vector3<f64>,
    pub(super) high: Vector3<f64>,
}

impl AxisBox {
    fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|i| self.low[i] <= other.high[i] && other.low[i] <= self.high[i])
    }

    fn width(&self) -> f64 {
        (self.high - self.low).max()
    }

    fn center(&self) -> Vector3<f64> {
        0.5 * (self.low + self.high)
    }
}

/// Boxes wider than this multiple of the median are compared with all.
const WIDE: f64 = 4.0;

type GridCell = [i64; 3];

/// Finds pairs; its memory grows to the largest number of boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct BroadPhase {
    widths: Vec<f64>,
    cells: Vec<(GridCell, u32)>, // in ascending order
    wide: Vec<u32>,
}

impl BroadPhase {
    /// `out ←` the pairs of boxes that overlap, the smaller number first, in ascending order. What
    /// has no bounds overlaps all that have.
    pub(super) fn find(&mut self, boxes: &[Option<AxisBox>], out: &mut Vec<(u32, u32)>) {
        let Self { widths, cells, wide } = self;
        widths.clear();
        cells.clear();
        wide.clear();
        out.clear();
        widths.extend(boxes.iter().flatten().map(AxisBox::width));
        widths.sort_unstable_by(f64::total_cmp);
        let most = WIDE * widths.get(widths.len() / 2).copied().unwrap_or(0.0);
        let width = widths.iter().rev().find(|width| **width <= most).copied().unwrap_or(0.0);
        let width = if width > 0.0 { width } else { 1.0 };
        for (k, bounds) in boxes.iter().enumerate() {
            match bounds {
                Some(own) if own.width() <= most => {
                    let center = own.center();
                    let cell = [0, 1, 2].map(|i| (center[i] / width).floor() as i64);
                    cells.push((cell, k as u32));
                }
                _ => wide.push(k as u32),
            }
        }
        cells.sort_unstable();
        let mut pair = |a: u32, b: u32| {
            let overlap = match (boxes[a as usize], boxes[b as usize]) {
                (Some(a), Some(b)) => a.overlaps(&b),
                (None, None) => false,
                _ => true,
            };
            if overlap {
                out.push((a.min(b), a.max(b)));
            }
        };
        for (place, &(cell, a)) in cells.iter().enumerate() {
            let rest = cells[place + 1..].iter();
            rest.take_while(|own| own.0 == cell).for_each(|(_, b)| pair(a, *b));
            // the neighbours that come later in the order: a row of three cells each
            let [x, y, z] = cell;
            let rows = [
                ([x, y, z + 1], [x, y, z + 1]),
                ([x, y + 1, z - 1], [x, y + 1, z + 1]),
                ([x + 1, y - 1, z - 1], [x + 1, y - 1, z + 1]),
                ([x + 1, y, z - 1], [x + 1, y, z + 1]),
                ([x + 1, y + 1, z - 1], [x + 1, y + 1, z + 1]),
            ];
            for (first, last) in rows {
                let start = cells.partition_point(|own| own.0 < first);
                let own = cells[start..].iter().take_while(|own| own.0 <= last);
                own.for_each(|(_, b)| pair(a, *b));
            }
        }
        for (place, &a) in wide.iter().enumerate() {
            wide[place + 1..].iter().for_each(|b| pair(a, *b));
            cells.iter().for_each(|(_, b)| pair(a, *b));
        }
        out.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_testkit::Sample;

    /// The same pairs as by comparing all with all, with sizes alike and far apart.
    #[test]
    fn pairs_are_those_of_all_with_all() {
        let mut most = 0;
        for seed in 0..200 {
            let mut sample = Sample::new(seed);
            let count = 2 + (seed as usize * 7) % 60;
            let boxes: Vec<Option<AxisBox>> = (0..count)
                .map(|k| {
                    let center: Vector3<f64> = 2.0 * sample.vector();
                    let size = if seed % 3 == 0 && k % 9 == 0 { 3.0 } else { 0.3 };
                    let half: Vector3<f64> = sample.vector().map(|x: f64| size * x.abs());
                    let own = AxisBox { low: center - half, high: center + half };
                    (k % 17 != 3).then_some(own)
                })
                .collect();
            let mut expected = Vec::new();
            for a in 0..count {
                for b in a + 1..count {
                    let overlap = match (boxes[a], boxes[b]) {
                        (Some(a), Some(b)) => a.overlaps(&b),
                        (a, b) => a.is_some() || b.is_some(),
                    };
                    if overlap {
                        expected.push((a as u32, b as u32));
                    }
                }
            }
            let mut found = Vec::new();
            BroadPhase::default().find(&boxes, &mut found);
            assert_eq!(found, expected, "seed {seed}");
            most = most.max(found.len());
        }
        assert!(most > 100, "{most}");
    }
}
