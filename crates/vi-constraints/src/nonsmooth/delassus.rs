//! The Delassus matrix of a node, in sparse rows.
//!
//! ```text
//! W = B A Bᵀ,   A = P (PᵀMP)⁻¹ Pᵀ,   U⁻ = B A p̄ + B v_0
//! ```
//! `A` has no entry between two [`Groups`] of coordinates: one `v̂` finds the columns `A B_iᵀ` of
//! as many rows as there are groups, one of each. Of `N` free bodies all columns are found in as
//! many `v̂` as one body has rows, and `W` has `O(N)` entries. `v_0`: what prescribed motions need.
//!
//! Letters: `W`, `A`, `B`; `v̂` the velocity of a momentum.

use super::groups::Groups;
use super::stepping::Stepping;
use super::unilateral::ContactRows;
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use crate::scheme::StepError;
use std::ops::Range;
use vi_core::cone::SparseRows;
use vi_core::state::State;

/// A pivot that rounding leaves, in parts of the largest.
const SMALL: f64 = 1e-13;

/// What a row has in a group.
#[derive(Clone, Copy, Debug)]
struct GroupRow {
    row: u32,
    group: u32,
    entries: [usize; 2], // from and to
    column: usize,       // where A B_iᵀ stands
}

/// `W` with the columns it is made of.
#[derive(Debug, Default)]
pub(super) struct Delassus {
    groups: Option<Groups>,
    entries: Vec<(u32, u32, f64)>, // of all rows: group, place, value
    parts: Vec<GroupRow>,          // by rows, then groups
    part_ends: Vec<usize>,         // k
    of_group: Vec<Vec<u32>>,       // parts in each group
    used: Vec<u32>,                // groups that have some
    columns: Vec<f64>,
    p: Vec<f64>,       // n
    v: Vec<f64>,       // n
    at_rest: Vec<f64>, // n  v_0
    ends: Vec<usize>,  // k
    places: Vec<u32>,
    values: Vec<f64>,
    sums: Vec<f64>,     // k
    touched: Vec<bool>, // k
    found: Vec<u32>,
    pub(super) factor: Factor,
}

/// `L` of `W = L Lᵀ`, in sparse rows.
#[derive(Debug, Default)]
pub(super) struct Factor {
    ends: Vec<usize>, // k
    places: Vec<u32>,
    values: Vec<f64>,
    of_part: Vec<[usize; 2]>, // the first column of its group, the row in its group
    rows: Vec<Vec<f64>>,      // of each group that has rows, m × r
    rest: Vec<f64>,           // m  of the diagonal
    sizes: Vec<[usize; 3]>,   // of these groups: the first column, r, m
    is_current: bool,
}

impl Factor {
    /// The entries of a row, with their columns in ascending order.
    pub(super) fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        SparseRows { ends: &self.ends, places: &self.places, values: &self.values }.row(i)
    }
}

impl Delassus {
    /// Of the rows at a node; `minus ← U⁻`.
    pub(super) fn open<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        state: &State,
        h: f64,
        rows: &ContactRows,
        minus: &mut [f64],
    ) -> Result<(), StepError> {
        let n = state.q.len();
        if self.groups.is_none() {
            self.groups = Some(Groups::find(run.system, run.constraints, state, h));
        }
        self.list(rows);
        for vector in [&mut self.p, &mut self.v, &mut self.at_rest] {
            vector.resize(n, 0.0);
        }
        if run.constraints.is_rheonomic() {
            self.p.fill(0.0);
            run.velocity(state, h, &self.p, &mut self.at_rest)?;
        }
        self.find_columns(run, state, h)?;
        self.multiply();
        self.factor.is_current = false;
        let Self { groups, parts, part_ends, columns, at_rest, .. } = self;
        let Some(groups) = groups else { return Ok(()) };
        for (i, minus) in minus.iter_mut().enumerate() {
            *minus = rows.dot(i, at_rest);
            for part in &parts[range(part_ends, i)] {
                let members = groups.members(part.group as usize);
                let column = columns[part.column..].iter().zip(members);
                *minus += column.map(|(v, j)| v * state.p[*j]).sum::<f64>(); // B A p̄
            }
        }
        Ok(())
    }

    /// The entries of all rows by groups.
    fn list(&mut self, rows: &ContactRows) {
        let Self { groups, entries, parts, part_ends, of_group, used, columns, .. } = self;
        let Some(groups) = groups else { return };
        of_group.resize_with(groups.count(), Vec::new);
        used.iter().for_each(|group| of_group[*group as usize].clear());
        used.clear();
        entries.clear();
        parts.clear();
        part_ends.clear();
        let mut size = 0;
        for row in 0..rows.len() {
            let start = entries.len();
            entries.extend(rows.row(row).iter().map(|&(coordinate, value)| {
                let (group, place) = groups.of(coordinate);
                (group, place, value)
            }));
            entries[start..].sort_unstable_by_key(|&(group, place, _)| (group, place));
            let mut from = start;
            while from < entries.len() {
                let group = entries[from].0;
                let own = entries[from..].iter().take_while(|entry| entry.0 == group).count();
                let (row, to) = (row as u32, from + own);
                let list = &mut of_group[group as usize];
                if list.is_empty() {
                    used.push(group);
                }
                list.push(parts.len() as u32);
                parts.push(GroupRow { row, group, entries: [from, to], column: size });
                size += groups.members(group as usize).len();
                from = to;
            }
            part_ends.push(parts.len());
        }
        columns.clear();
        columns.resize(size, 0.0);
    }

    /// `A B_iᵀ` of all rows, one of each group at a time.
    fn find_columns<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        state: &State,
        h: f64,
    ) -> Result<(), StepError> {
        let Self { groups, entries, parts, of_group, used, columns, p, v, at_rest, .. } = self;
        let Some(groups) = groups else { return Ok(()) };
        let most = used.iter().map(|group| of_group[*group as usize].len()).max().unwrap_or(0);
        for turn in 0..most {
            p.fill(0.0);
            let now = |group: &&u32| of_group[**group as usize].len() > turn;
            let own = used.iter().filter(now).map(|group| of_group[*group as usize][turn]);
            for part in own.clone().map(|part| parts[part as usize]) {
                let members = groups.members(part.group as usize);
                for &(_, place, value) in &entries[part.entries[0]..part.entries[1]] {
                    p[members[place as usize]] += value;
                }
            }
            run.velocity(state, h, p, v)?;
            for part in own.map(|part| parts[part as usize]) {
                let members = groups.members(part.group as usize);
                let column = columns[part.column..].iter_mut().zip(members);
                column.for_each(|(to, j)| *to = v[*j] - at_rest[*j]);
            }
        }
        Ok(())
    }

    /// `W` from its columns, symmetric to the bit.
    fn multiply(&mut self) {
        let Self { entries, parts, part_ends, of_group, columns, sums, touched, found, .. } = self;
        let k = part_ends.len();
        self.ends.clear();
        self.places.clear();
        self.values.clear();
        sums.clear();
        sums.resize(k, 0.0);
        touched.clear();
        touched.resize(k, false);
        let product = |a: &GroupRow, b: &GroupRow| product(entries, columns, a, b);
        for i in 0..k {
            found.clear();
            for own in &parts[range(part_ends, i)] {
                for other in &of_group[own.group as usize] {
                    let other = &parts[*other as usize];
                    let j = other.row as usize;
                    if !touched[j] {
                        (touched[j], sums[j]) = (true, 0.0);
                        found.push(other.row);
                    }
                    sums[j] += product(own, other);
                }
            }
            found.sort_unstable();
            for j in &*found {
                self.places.push(*j);
                self.values.push(sums[*j as usize]);
                touched[*j as usize] = false;
            }
            self.ends.push(self.places.len());
        }
    }

    /// Finds `L`, group by group: columns of the largest pivots, until rounding is left.
    pub(super) fn factorize(&mut self) {
        let Self { groups, entries, parts, part_ends, of_group, used, columns, factor, .. } = self;
        let Some(groups) = groups else { return };
        if std::mem::replace(&mut factor.is_current, true) {
            return;
        }
        let product = |a: &GroupRow, b: &GroupRow| product(entries, columns, a, b);
        used.sort_unstable();
        factor.of_part.clear();
        factor.of_part.resize(parts.len(), [0; 2]);
        factor.rows.resize_with(factor.rows.len().max(used.len()), Vec::new);
        factor.sizes.clear();
        let mut first = 0;
        for (group, rows) in used.iter().zip(&mut factor.rows) {
            let own = &of_group[*group as usize];
            let m = own.len();
            let part = |i: usize| &parts[own[i] as usize];
            let rest = &mut factor.rest;
            rest.clear();
            rest.extend((0..m).map(|i| product(part(i), part(i))));
            let least = SMALL * rest.iter().copied().fold(0.0, f64::max);
            rows.clear(); // column by column
            let mut r = 0;
            while r < groups.members(*group as usize).len() {
                let Some(pivot) = (0..m).max_by(|a, b| rest[*a].total_cmp(&rest[*b])) else {
                    break;
                };
                if rest[pivot] <= least {
                    break;
                }
                let root = rest[pivot].sqrt();
                for i in 0..m {
                    let (a, b) = (part(i), part(pivot));
                    let known: f64 = (0..r).map(|j| rows[j * m + i] * rows[j * m + pivot]).sum();
                    let entry = product(a, b) - known;
                    rows.push(entry / root);
                    rest[i] -= entry / root * (entry / root);
                }
                rest[pivot] = 0.0;
                r += 1;
            }
            own.iter().enumerate().for_each(|(i, of)| factor.of_part[*of as usize] = [first, i]);
            factor.sizes.push([first, r, m]);
            first += r;
        }
        factor.ends.clear();
        factor.places.clear();
        factor.values.clear();
        for i in 0..part_ends.len() {
            for own in range(part_ends, i) {
                let [first, i] = factor.of_part[own];
                let Ok(place) = used.binary_search(&parts[own].group) else { continue };
                let [_, r, m] = factor.sizes[place];
                for j in 0..r {
                    factor.places.push((first + j) as u32);
                    factor.values.push(factor.rows[place][j * m + i]);
                }
            }
            factor.ends.push(factor.places.len());
        }
    }

    /// `v_0`, shape `n`.
    pub(super) fn at_rest(&self) -> &[f64] {
        &self.at_rest
    }

    /// The entries of a row, with their columns in ascending order.
    pub(super) fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        SparseRows { ends: &self.ends, places: &self.places, values: &self.values }.row(i)
    }

    /// An entry.
    pub(super) fn at(&self, i: usize, j: usize) -> f64 {
        let own = range(&self.ends, i);
        let place = self.places[own.clone()].binary_search(&(j as u32));
        place.map_or(0.0, |place| self.values[own.start + place])
    }

    /// `(W x)_i`.
    pub(super) fn product(&self, i: usize, x: impl Fn(usize) -> f64) -> f64 {
        self.row(i).map(|(j, value)| value * x(j)).sum()
    }
}

/// What two rows have in a group, `B_i A B_jᵀ`, symmetric to the bit.
fn product(entries: &[(u32, u32, f64)], columns: &[f64], a: &GroupRow, b: &GroupRow) -> f64 {
    let half = |a: &GroupRow, b: &GroupRow| {
        let own = entries[a.entries[0]..a.entries[1]].iter();
        own.map(|(_, place, value)| value * columns[b.column + *place as usize]).sum::<f64>()
    };
    0.5 * (half(a, b) + half(b, a))
}

fn range(ends: &[usize], i: usize) -> Range<usize> {
    i.checked_sub(1).map_or(0, |before| ends[before])..ends[i]
}
