//! Sweeps of the rows of a cluster along its links, four rows side by side, on the tree of
//! [`super::step`].
//!
//! ```text
//! J_i = Σ_sides wrenchᵀ P             c = S·W,   W_parent += Xᵀ W                       along the path of the row
//! û   = L⁻¹ U_kᵀ                      û = u − S·p,   p_parent += Xᵀ (p + Ã S' D⁻¹ û)     up to the apex of the cluster
//! v̂   = L'⁻¹ J'_iᵀ                    v̂ = D⁻¹ (c + S'·p),   p_parent += X'ᵀ (p − Sᵀ Ã v̂)
//! ```
#![allow(non_snake_case)] // A, S, X

use super::cluster_link::ClusterLink;
use super::echelon::Entry;
use super::four_rows::{FourRows, hold, in_registers, take};
use super::row_columns::{
    add, enter, get, multiply, pass, pass_transposed, put, rotate, rotate_transposed, zero,
};
use crate::geometry::members::LanesScrew;
use crate::geometry::space::Space;
use crate::solver::tree_step::part::Links;
use crate::sweep::columns::{Column, Motion};
use nalgebra::Vector3;
use vi_core::lanes::Register;

/// Rows as they were written last, one after the other.
pub(super) struct Kept {
    entries: Vec<Entry>,
    ends: Vec<usize>,
}

impl Kept {
    /// With room for some rows and all of their entries.
    pub(super) fn with_capacity(rows: usize, entries: usize) -> Self {
        Self { entries: Vec::with_capacity(entries), ends: Vec::with_capacity(rows) }
    }

    pub(super) fn clear(&mut self) {
        self.entries.clear();
        self.ends.clear();
    }

    pub(super) fn push(&mut self, row: impl Iterator<Item = Entry>) {
        self.entries.extend(row);
        self.ends.push(self.entries.len());
    }

    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn row(&self, i: usize) -> &[Entry] {
        let begin = i.checked_sub(1).map_or(0, |last| self.ends[last]);
        &self.entries[begin..self.ends[i]]
    }
}

/// Four rows on the links of a cluster.
pub(crate) struct RowSweeps {
    pub(in crate::solver) values: Vec<FourRows>, // of each column
    pub(in crate::solver) touched: Vec<usize>, // links up to the apex of the cluster, deepest first
    // of the links of a path, or of the touched, as the sweeps come to them
    wrenches: Vec<[FourRows; 6]>,
    place: Vec<u32>,   // of each link among these
    marked: Vec<bool>, // links
}

impl RowSweeps {
    /// For a number of links and columns.
    pub(in crate::solver) fn new(links: usize, columns: usize) -> Self {
        Self {
            values: vec![[0.0; 4]; columns],
            touched: Vec::with_capacity(links),
            wrenches: vec![[[0.0; 4]; 6]; links],
            place: vec![0; links],
            marked: vec![false; links],
        }
    }

    /// Gives the links of a path places for their wrenches.
    pub(in crate::solver) fn take_places(&mut self, path: &[usize]) {
        number(path, &mut self.place);
    }

    /// A force, where there is one, and a moment on a link of the path, of one of the rows.
    #[inline]
    pub(in crate::solver) fn add_wrench(
        &mut self,
        (link, row): (usize, usize),
        force: Option<Vector3<f64>>,
        moment: Vector3<f64>,
    ) {
        let [fx, fy, fz, x, y, z] = &mut self.wrenches[self.place[link] as usize];
        if let Some(force) = force {
            [fx, fy, fz].into_iter().zip(&force).for_each(|(sum, part)| sum[row] += part);
        }
        [x, y, z].into_iter().zip(&moment).for_each(|(sum, part)| sum[row] += part);
    }

    /// Counts a link, and those up to the apex, among the touched.
    pub(in crate::solver) fn touch(&mut self, link: usize, links: &[ClusterLink]) {
        let mut at = Some(link);
        while let Some(k) = at.filter(|&k| !self.marked[k]) {
            self.marked[k] = true;
            self.touched.push(k);
            at = links[k].parent;
        }
    }

    /// Brings the touched links into their order, and gives them places for their wrenches.
    pub(in crate::solver) fn order_touched(&mut self) {
        self.touched.sort_unstable();
        number(&self.touched, &mut self.place);
    }

    /// Forgets the touched links and what stands at their columns.
    pub(in crate::solver) fn clear(&mut self, links: &[ClusterLink]) {
        for &k in &self.touched {
            self.marked[k] = false;
            self.values[links[k].columns()].fill([0.0; 4]);
        }
        self.touched.clear();
    }

    /// Adds the entries of the rows whose wrenches stand on the links of `path`, which have their
    /// places; beyond `apex` they balance.
    pub(in crate::solver) fn carry(
        &mut self,
        links: &[ClusterLink],
        path: &[usize],
        apex: Option<usize>,
        at: Links<'_>,
        next: bool,
    ) {
        in_registers!(lanes => self.carry_in(lanes, links, path, apex, at, next))
    }

    #[inline(always)]
    fn carry_in<T: Register>(
        &mut self,
        lanes: T,
        links: &[ClusterLink],
        path: &[usize],
        apex: Option<usize>,
        at: Links<'_>,
        next: bool,
    ) {
        for (place, &k) in path.iter().enumerate() {
            let link = &links[k];
            let work = &at.works[link.link];
            let mut wrench = take(lanes, &self.wrenches[place]);
            self.wrenches[place] = [[0.0; 4]; 6];
            let own = &mut self.values[link.columns()];
            let constants = &at.constants[link.link];
            match constants.motion {
                Motion::Spherical => {
                    add(lanes, own, wrench.angular);
                    wrench.angular = zero(lanes); // no torque passes
                }
                Motion::Free => {
                    let (linear, angular) = own.split_at_mut(3);
                    add(lanes, linear, wrench.linear);
                    add(lanes, angular, wrench.angular);
                }
                Motion::Fixed => {}
                Motion::Along(act) => {
                    enter((constants, act), (lanes, &work.column, next), &mut own[0], wrench);
                }
                Motion::Several(several) => {
                    let columns = at.columns[constants.unknown..].iter().zip(several);
                    for (value, (column, Column { act, .. })) in own.iter_mut().zip(columns) {
                        enter((constants, *act), (lanes, column, next), value, wrench);
                    }
                }
            }
            if let Some(parent) = link.parent.filter(|&p| Some(links[p].link) != apex) {
                let lever = if next { &work.lever_next } else { &work.lever };
                self.hand_on(lanes, parent, &lever.xyz(), wrench);
            }
        }
    }

    /// [`RowSweeps::transmit`] where the ground is the apex.
    pub(in crate::solver) fn transmit_all(&mut self, links: &[ClusterLink], at: Links<'_>) {
        in_registers!(lanes => {
            self.transmit(lanes, links, at);
        });
    }

    /// [`RowSweeps::transmit_transposed`] where the ground is the apex.
    pub(in crate::solver) fn transmit_all_transposed(
        &mut self,
        links: &[ClusterLink],
        at: Links<'_>,
    ) {
        in_registers!(lanes => {
            self.transmit_transposed(lanes, links, at);
        });
    }

    /// `û` in the place of `u`; returns the wrenches on the apex.
    #[inline(always)]
    pub(super) fn transmit<T: Register>(
        &mut self,
        lanes: T,
        links: &[ClusterLink],
        at: Links<'_>,
    ) -> [FourRows; 6] {
        self.sweep(
            lanes,
            links,
            #[inline(always)]
            |k, own, wrench| {
                let (work, constants, mut p) =
                    (&at.works[k], &at.constants[k], take(lanes, wrench));
                match constants.motion {
                    Motion::Spherical => p = rotate(lanes, &at.rotations[k], own, p),
                    Motion::Free => {
                        let (linear, angular) = own.split_at_mut(3);
                        p = rotate(lanes, &at.rotations[k], angular, p);
                        let rest = get(lanes, linear) - p.linear;
                        put(linear, multiply(lanes, &at.rotations[k].translation, rest));
                    }
                    Motion::Fixed => {}
                    Motion::Along(act) => {
                        let AS = &at.forces[constants.unknown];
                        pass((constants, act), (lanes, &work.column, AS), &mut own[0], &mut p);
                    }
                    Motion::Several(several) => {
                        let unknowns = constants.unknown..constants.unknown + several.len();
                        let (columns, forces) =
                            (&at.columns[unknowns.clone()], &at.forces[unknowns]);
                        for (j, Column { act, .. }) in several.iter().enumerate().rev() {
                            let column = (lanes, &columns[j], &forces[j]);
                            pass((constants, *act), column, &mut own[j], &mut p);
                        }
                    }
                }
                (p, work.lever.xyz())
            },
        )
    }

    /// `v̂` in the place of `c`; returns the factors of the twist of the apex.
    #[inline(always)]
    pub(super) fn transmit_transposed<T: Register>(
        &mut self,
        lanes: T,
        links: &[ClusterLink],
        at: Links<'_>,
    ) -> [FourRows; 6] {
        self.sweep(
            lanes,
            links,
            #[inline(always)]
            |k, own, wrench| {
                let (work, constants, mut p) =
                    (&at.works[k], &at.constants[k], take(lanes, wrench));
                match constants.motion {
                    Motion::Spherical => p = rotate_transposed(lanes, &at.gains[k], own, p),
                    Motion::Free => {
                        let (linear, angular) = own.split_at_mut(3);
                        p = rotate_transposed(lanes, &at.gains[k], angular, p);
                        add(lanes, linear, p.linear);
                    }
                    Motion::Fixed => {}
                    Motion::Along(act) => {
                        pass_transposed(
                            (constants, act),
                            (lanes, &work.column),
                            &mut own[0],
                            &mut p,
                        );
                    }
                    Motion::Several(several) => {
                        let columns = &at.columns[constants.unknown..];
                        for (j, Column { act, .. }) in several.iter().enumerate().rev() {
                            let column = (lanes, &columns[j]);
                            pass_transposed((constants, *act), column, &mut own[j], &mut p);
                        }
                    }
                }
                (p, work.lever_next.xyz())
            },
        )
    }

    /// Sweeps the touched links to the apex; `each` sees a link of the tree, the values of its
    /// columns and its wrenches, and tells what it hands on, and along which lever. Returns what
    /// the apex gets.
    #[inline(always)]
    fn sweep<T: Register>(
        &mut self,
        lanes: T,
        links: &[ClusterLink],
        each: impl Fn(usize, &mut [FourRows], &[FourRows; 6]) -> (LanesScrew<T::Lanes>, [f64; 3]),
    ) -> [FourRows; 6] {
        let mut out = LanesScrew::zero(lanes);
        for i in 0..self.touched.len() {
            let k = self.touched[i];
            let link = &links[k];
            let own = &mut self.values[link.first..link.first + link.dof];
            let (p, lever) = each(link.link, own, &self.wrenches[i]);
            self.wrenches[i] = [[0.0; 4]; 6];
            match link.parent {
                Some(parent) => self.hand_on(lanes, parent, &lever, p),
                None => add_transposed(lanes, &lever, p, &mut out),
            }
        }
        hold(out)
    }

    /// `p_parent += Xᵀ p`.
    #[inline(always)]
    fn hand_on<T: Register>(
        &mut self,
        lanes: T,
        parent: usize,
        lever: &[f64; 3],
        p: LanesScrew<T::Lanes>,
    ) {
        let own = &mut self.wrenches[self.place[parent] as usize];
        let mut sum = take(lanes, own);
        add_transposed(lanes, lever, p, &mut sum);
        *own = hold(sum);
    }
}

/// Numbers links one after the other.
fn number(links: &[usize], place: &mut [u32]) {
    (0..).zip(links).for_each(|(at, &k)| place[k] = at);
}

#[inline(always)]
fn add_transposed<T: Register>(
    lanes: T,
    lever: &[f64; 3],
    w: LanesScrew<T::Lanes>,
    out: &mut LanesScrew<T::Lanes>,
) {
    *out = out.plus(w.at_start_of(lanes.vector(*lever)));
}
