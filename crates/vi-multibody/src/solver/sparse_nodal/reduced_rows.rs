//! `G P` as a sparse matrix with a fixed pattern: constraint rows seen by the unknowns of a tree.

use super::layout::{MapColumns, VelocityLayout};
use std::collections::BTreeMap;
use vi_core::sparse::Entries;

crate::opaque_debug!(ReducedRows);

/// `G P`, shape `rows × d`, refilled by replaying the emission of `G`.
#[derive(Default)]
pub struct ReducedRows {
    parts: Vec<MemberGradient>,
    slots: Vec<usize>,           // k-th emitted entry → place in `values`
    values: Vec<f64>,            // dense parts of G
    places: Vec<(usize, usize)>, // (row, unknown) of each product
    products: Vec<f64>,
}

/// What one row of `G` says to one member.
struct MemberGradient {
    member: usize,
    values: usize, // where its values start
}

/// Collects or replays an emission.
enum EmissionSink<'a> {
    Places(Vec<(usize, usize)>),
    Values(&'a mut [f64], std::slice::Iter<'a, usize>),
}

impl Entries for EmissionSink<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        match self {
            Self::Places(places) => places.push((row, column)),
            Self::Values(values, slots) => {
                let slot = slots.next().expect("as many entries as at the first emission");
                values[*slot] += value;
            }
        }
    }
}

impl ReducedRows {
    /// Fills the rows from `G` as `emit` writes it (always the same places in the same order), with
    /// `P` as `columns`.
    pub fn fill(
        &mut self,
        layout: &VelocityLayout,
        emit: &dyn Fn(&mut dyn Entries),
        columns: &MapColumns,
    ) {
        if self.parts.is_empty() {
            self.analyse(layout, emit);
        }
        self.values.fill(0.0);
        emit(&mut EmissionSink::Values(&mut self.values, self.slots.iter()));
        let mut next = 0;
        for part in &self.parts {
            let member = &layout.members[part.member];
            let wrench = member.span.shrink(&columns.q, |i| self.values[part.values + i]);
            for c in member.columns.clone() {
                self.products[next] = columns.twists[c].dot(&wrench);
                next += 1;
            }
        }
    }

    fn analyse(&mut self, layout: &VelocityLayout, emit: &dyn Fn(&mut dyn Entries)) {
        let mut member_of = vec![usize::MAX; layout.dim()];
        for (k, member) in layout.members.iter().enumerate() {
            member_of[member.span.first..member.span.first + member.span.size].fill(k);
        }
        let mut sink = EmissionSink::Places(Vec::new());
        emit(&mut sink);
        let EmissionSink::Places(emitted) = sink else { return };
        let mut starts: BTreeMap<(usize, usize), usize> =
            emitted.iter().map(|&(row, column)| ((row, member_of[column]), 0)).collect();
        let mut length = 0;
        for (&(row, k), start) in &mut starts {
            *start = length;
            let member = &layout.members[k];
            self.parts.push(MemberGradient { member: k, values: length });
            length += member.span.size;
            let unknowns = member.columns.clone().map(|c| (row, layout.unknowns[c]));
            self.places.extend(unknowns);
        }
        let slot = |&(row, column): &(usize, usize)| {
            let k = member_of[column];
            starts[&(row, k)] + column - layout.members[k].span.first
        };
        self.slots = emitted.iter().map(slot).collect();
        (self.values, self.products) = (vec![0.0; length], vec![0.0; self.places.len()]);
    }

    /// Emits the rows last filled as `(row, unknown, value)`; always the same places in the same
    /// order.
    pub fn emit(&self, out: &mut dyn Entries) {
        for (&(row, unknown), product) in self.places.iter().zip(&self.products) {
            out.add(row, unknown, *product);
        }
    }
}
