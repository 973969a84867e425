//! All links of a tree, and the sweeps over them.

use super::columns::{ColumnWork, Motion};
use super::link::{self, Constants, Sums, Work};
use super::solve::{self, Gain, Part};
use super::sweeps::{self, Turn};
use crate::geometry::lane_matrices::Spatial;
use crate::geometry::lanes::Held;
use crate::mechanism::Mechanism;
use std::ops::Range;
use vi_core::SeparableSystem;
use vi_core::newton::Fault;

/// What the sweeps of [`super::TreeStep`] read and write.
#[derive(Debug)]
pub(in crate::solver) struct Workspace {
    pub(super) links: Vec<Constants>,
    pub(super) works: Vec<Work>,
    pub(super) columns: Vec<ColumnWork>, // d  of joints of several columns, else empty
    pub(super) turns: Vec<Turn>,         // d
    pub(super) gains: Vec<Gain>,
    pub(super) sums: Vec<Sums>,
    pub(super) part: Part,
}

impl Workspace {
    /// `None` where a pair, or the mass of a body, is of another kind.
    pub(in crate::solver) fn new(mechanism: &Mechanism, system: &SeparableSystem) -> Option<Self> {
        let (links, slots) = link::constants(mechanism, system)?;
        let (count, d) = (links.len(), mechanism.tree().dof());
        let several = links.iter().any(|link| matches!(link.motion, Motion::Several(_)));
        Some(Self {
            links,
            works: vec![Work::default(); count],
            columns: vec![ColumnWork::default(); if several { d } else { 0 }],
            turns: vec![Turn::default(); d],
            gains: vec![Gain::default(); count],
            sums: vec![Sums::default(); slots],
            part: Part::default(),
        })
    }

    /// [`sweeps::open`].
    pub(in crate::solver) fn open(&mut self, at: [&[f64]; 3]) {
        sweeps::open(&self.links, &mut self.works, &mut self.columns, at);
    }

    /// [`sweeps::advance`].
    pub(in crate::solver) fn advance(&mut self, u: &[f64], h: Option<f64>) -> Result<(), Fault> {
        let Self { links, works, columns, turns, .. } = self;
        sweeps::advance(links, works, (columns, turns), u, h)
    }

    /// [`sweeps::pull_back`].
    pub(in crate::solver) fn pull_back(&mut self, r: &mut [f64]) {
        sweeps::pull_back(&self.links, &mut self.works, &self.columns, r);
    }

    /// [`solve::eliminate`] of a range of links, with what is `added` to their blocks.
    pub(in crate::solver) fn eliminate(
        &mut self,
        range: Range<usize>,
        added: &[Spatial<Held>],
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { links, works, columns, gains, sums, part, .. } = self;
        part.links = range;
        solve::eliminate(links, works, (columns, gains), (sums, added, part), x)
    }

    /// [`solve::substitute`] of a range of links.
    pub(in crate::solver) fn substitute(
        &mut self,
        range: Range<usize>,
        u: &[f64],
        x: &mut [f64],
    ) -> f64 {
        let Self { links, works, columns, gains, .. } = self;
        solve::substitute((links, range), works, (columns, gains), u, x)
    }
}
