//! The rows of a cluster of loops, each along its path through the tree.
//!
//! ```text
//! J_i = Σ_sides wrenchᵀ P        carried from the two sides of the loop to its apex, where they meet
//! ```

use super::closure_rows::{ClosureRows, LastForm, Site};
use super::cluster_link::ClusterLink;
use super::echelon::{Echelon, Entry};
use super::row_sweeps::{Kept, RowSweeps};
use crate::constraint::scalar_constraint::ScalarRow;
use crate::pair::Twist;
use crate::solver::sparse_nodal::SparseNodal;
use crate::solver::tree_step::part::Links;
use crate::tree::maps::TreeMaps;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_rigid::directors::FRAME;

/// A row of `g_c` with the links that feel it.
pub(crate) struct LoopRow {
    /// Its number among the rows of `g_c`.
    pub(crate) number: usize,
    /// The constraint.
    pub(crate) row: Box<ScalarRow>,
    /// Its weight in rank decisions.
    pub(crate) scale: f64,
    /// Links of the cluster, deepest first.
    pub(crate) path: Vec<usize>,
    /// The link of the tree above the path, where there is one.
    pub(crate) apex: Option<usize>,
    /// The number of its path among those of the cluster, one after the other.
    pub(crate) course: usize,
}

/// The velocity maps that rows are carried by.
#[derive(Clone, Copy)]
pub(in crate::solver) enum Maps<'a> {
    /// Those of the pairs.
    Pairs,
    /// The columns of the velocity map, where these are the unknowns.
    Columns(&'a SparseNodal),
    /// The links of the sweeps.
    Sweeps(Links<'a>),
}

/// Where rows are evaluated.
#[derive(Clone, Copy)]
pub(crate) struct RowPlace<'a> {
    /// The velocity maps of the joints.
    pub(crate) tree: &'a TreeMaps,
    /// Where these maps are.
    pub(in crate::solver) maps: Maps<'a>,
    /// Link of the tree → its cluster and its place there.
    pub(crate) home: &'a [(usize, usize)],
    /// Unknown of the tree → its column in the cluster.
    pub(crate) column_of: &'a [usize],
    /// `q`.
    pub(crate) q: &'a [f64],
    /// `S'` of `q_{n+1}` instead of `S` of `q_n`.
    pub(crate) next: bool,
    /// The step that ends at `q`, where its rows are meant.
    pub(crate) step: Option<&'a Interval>,
}

impl RowPlace<'_> {
    /// The gradient of a row, or its derivative by the end of the step, as wrenches.
    #[inline]
    fn for_each_wrench(&self, row: &ScalarRow, visit: impl FnMut(usize, Twist)) {
        match self.step {
            Some(s) => row.for_each_wrench_of_step(s, visit),
            None => row.for_each_wrench(self.q, visit),
        }
    }
}

/// The rows and links of a cluster.
pub(crate) struct Paths {
    pub(crate) rows: Vec<LoopRow>,
    pub(crate) links: Vec<ClusterLink>, // deepest first
    pub(crate) apex: Option<usize>,     // link of the tree; None: the ground
    pub(crate) columns: Vec<usize>,     // unknown of the tree
    pub(crate) owner: Vec<usize>,       // column → link of the cluster
    pub(super) are_short: bool,         // the rows: five links or less in the mean
    wrenches: Vec<Twist>,               // scratch, of each link
    values: Vec<f64>,                   // scratch, of each column
    row: Vec<Entry>,                    // the last row written
    closures: ClosureRows,              // on the sweeps of trees
    pub(super) four: RowSweeps,         // scratch of four rows
    pub(super) kept: Kept,              // the rows filled in last, by fours
}

impl Paths {
    /// Of a cluster that hangs on `apex`.
    pub(crate) fn new(
        mut rows: Vec<LoopRow>,
        links: Vec<ClusterLink>,
        apex: Option<usize>,
    ) -> Self {
        for i in 1..rows.len() {
            let [last, row] = [&rows[i - 1], &rows[i]];
            let is_same = last.path == row.path && last.apex == row.apex;
            rows[i].course = rows[i - 1].course + usize::from(!is_same);
        }
        let are_short = rows.iter().map(|row| row.path.len()).sum::<usize>() <= 5 * rows.len();
        let entries = rows.iter().flat_map(|row| &row.path).map(|&k| links[k].dof).sum();
        let kept = Kept::with_capacity(rows.len(), entries);
        let columns: Vec<usize> =
            links.iter().flat_map(|link| link.offset..link.offset + link.dof).collect();
        let owners = links.iter().enumerate();
        let owner = owners.flat_map(|(k, link)| std::iter::repeat_n(k, link.dof)).collect();
        let (wrenches, values) = (vec![Twist::zero(); links.len()], vec![0.0; columns.len()]);
        let row = Vec::with_capacity(columns.len());
        let four = RowSweeps::new(links.len(), columns.len());
        Self {
            rows,
            links,
            apex,
            columns,
            owner,
            are_short,
            wrenches,
            values,
            row,
            closures: ClosureRows::default(),
            four,
            kept,
        }
    }

    /// Refers rows that are products on two links to the links of sweeps.
    pub(super) fn compact_rows(
        &mut self,
        tree: &TreeMaps,
        home: &[(usize, usize)],
        links: Links<'_>,
    ) {
        for row in &self.rows {
            self.closures.push(&row.row, |frame| {
                let body = frame / FRAME;
                let link = (body < links.constants.len()).then(|| tree.link_of(body))?;
                let home = (Some(link) != row.apex).then_some(home[link].1);
                Some(Site { frame, home, reference: links.constants[link].anchor.into() })
            });
        }
    }

    /// `g_c` of some rows.
    pub(super) fn values(&self, rows: &[usize], at: Configuration<'_>, g: &mut [f64]) {
        let mut last = LastForm::NONE;
        for (g, &i) in g.iter_mut().zip(rows) {
            let closure = self.closures.value(i, at.q, &mut last);
            *g = closure.unwrap_or_else(|| self.rows[i].row.value(at));
        }
    }

    /// What the step leaves of some rows: `g_c`, `h A_d`.
    pub(super) fn gaps(&self, rows: &[usize], s: &Interval, g: &mut [f64]) {
        let mut last = LastForm::NONE;
        for (g, &i) in g.iter_mut().zip(rows) {
            let closure = self.closures.value(i, &s.q1, &mut last);
            *g = closure.unwrap_or_else(|| self.rows[i].row.gap(s));
        }
    }

    /// Row `i` of `G_c P_tree`: its wrenches carried to its apex.
    pub(super) fn write_row(&mut self, i: usize, at: RowPlace<'_>) -> &[Entry] {
        match at.maps {
            Maps::Columns(columns) => self.gather_row(i, at, columns),
            _ => self.carry_row(i, at),
        }
        &self.row
    }

    fn carry_row(&mut self, i: usize, at: RowPlace<'_>) {
        let RowPlace { tree, home, next, .. } = at;
        let Self { rows, links, wrenches, row: out, .. } = self;
        let row = &rows[i];
        at.for_each_wrench(&row.row, |frame, wrench| {
            let link = tree.link_of(frame);
            if Some(link) != row.apex {
                wrenches[home[link].1].add_scaled(1.0, &wrench);
            }
        });
        out.clear();
        for &k in &row.path {
            let link = &links[k];
            let map = tree.of(link.link, next);
            let wrench = std::mem::replace(&mut wrenches[k], Twist::zero());
            for (j, column) in map.columns().iter().enumerate() {
                out.push((link.first + j, column.dot(&wrench)));
            }
            if let Some(parent) = link.parent.filter(|&p| Some(links[p].link) != row.apex) {
                wrenches[parent].add_scaled(1.0, &map.transfer.apply_transposed(&wrench));
            }
        }
    }

    fn gather_row(&mut self, i: usize, at: RowPlace<'_>, maps: &SparseNodal) {
        let Self { rows, links, values, row: out, .. } = self;
        let row = &rows[i];
        at.for_each_wrench(&row.row, |frame, wrench| {
            let link = at.tree.link_of(frame);
            maps.add_wrench(at.next, link, row.apex, &wrench, |unknown, value| {
                values[at.column_of[unknown]] += value;
            });
        });
        out.clear();
        for &k in &row.path {
            for column in links[k].first..links[k].first + links[k].dof {
                out.push((column, std::mem::take(&mut values[column])));
            }
        }
    }

    /// All rows, scaled, with the right-hand sides of `side` where there are any.
    pub(super) fn fill(&mut self, echelon: &mut Echelon, at: RowPlace<'_>, side: &[f64]) {
        self.fill_with(echelon, 0..self.rows.len(), at, side);
    }

    /// The same with some rows.
    pub(super) fn fill_with(
        &mut self,
        echelon: &mut Echelon,
        rows: impl Iterator<Item = usize>,
        at: RowPlace<'_>,
        side: &[f64],
    ) {
        echelon.clear();
        let width = self.columns.len();
        if let Maps::Sweeps(links) = at.maps {
            debug_assert!(side.is_empty(), "rows by fours have no right-hand sides");
            self.fill_by_fours(echelon, rows, (at, links));
            return;
        }
        for i in rows {
            let right = side.get(self.rows[i].number).map(|g| (width, *g));
            self.push_row(echelon, i, at, right);
        }
    }

    /// Row `i`, scaled, with an entry beyond the columns.
    pub(super) fn push_row(
        &mut self,
        echelon: &mut Echelon,
        i: usize,
        at: RowPlace<'_>,
        right: Option<Entry>,
    ) {
        let scale = self.rows[i].scale;
        let entries = self.write_row(i, at).iter().copied().chain(right);
        echelon.push(entries.map(|(column, value)| (column, scale * value)));
    }

    fn fill_by_fours(
        &mut self,
        echelon: &mut Echelon,
        rows: impl Iterator<Item = usize>,
        at: (RowPlace<'_>, Links<'_>),
    ) {
        self.kept.clear();
        let mut rows = rows.peekable();
        while let Some(first) = rows.next() {
            let (mut own, mut count) = ([first; 4], 1);
            while let Some(i) = rows.next_if(|&i| count < 4 && self.is_alongside(first, i)) {
                own[count] = i;
                count += 1;
            }
            self.write_four(&own[..count], at);
            let Self { rows, links, four, kept, .. } = self;
            let columns = || rows[first].path.iter().flat_map(|&k| links[k].columns());
            for (row, &i) in own[..count].iter().enumerate() {
                let entry = |column: usize| four.values[column][row] * rows[i].scale;
                kept.push(columns().map(|column| (column, entry(column))));
                echelon.push(kept.row(kept.len() - 1).iter().copied());
            }
            columns().for_each(|column| four.values[column] = [0.0; 4]);
        }
    }

    /// Whether two rows take the same path.
    fn is_alongside(&self, i: usize, j: usize) -> bool {
        self.rows[i].course == self.rows[j].course
    }

    /// Up to four rows of `G_c P_tree`, side by side; those of one path at a time.
    pub(super) fn write_four(&mut self, own: &[usize], (at, links): (RowPlace<'_>, Links<'_>)) {
        let (mut first, mut last) = (0, LastForm::NONE);
        while let Some(&i) = own.get(first) {
            let alongside = own[first..].iter().take_while(|&&j| self.is_alongside(i, j)).count();
            self.four.take_places(&self.rows[i].path);
            for row in first..first + alongside {
                let Self { rows, four, closures, .. } = self;
                let put = |k, force, moment| four.add_wrench((k, row), force, moment);
                if closures.for_each_wrench(own[row], at.q, &mut last, put) {
                    continue;
                }
                at.for_each_wrench(&rows[own[row]].row, |frame, wrench| {
                    let link = at.tree.link_of(frame);
                    if Some(link) != rows[i].apex {
                        let wrench = links.about_reference(link, at.q, &wrench);
                        let place = (at.home[link].1, row);
                        four.add_wrench(place, Some(wrench.linear), wrench.angular);
                    }
                });
            }
            let (row, next) = (&self.rows[i], at.next);
            self.four.carry(&self.links, &row.path, row.apex, links, next);
            first += alongside;
        }
    }

    /// The row written last.
    pub(crate) fn last_row(&self) -> &[Entry] {
        &self.row
    }
}
