//! Derivatives by the forms of constraints, summed over a run for all parameters at once.
//!
//! ```text
//! g = s (A·B − c),   A = Σ_k α_k x_k + α_0            coefficients: anchors and axes of joints
//! dJ/dα_k = s Σ_n −σ x_k(q_{n+1})·B(q_{n+1}) + h λ [x_k(μ)·B(q_n) + x_k(q_n)·B(μ)]          [2.40]
//! dJ/dα_0 = s Σ_n −σ B(q_{n+1}) + h λ B(μ),      dJ/dc = s Σ_n σ         B(μ): the homogeneous part
//! ```
//! and the same with `A` and `B` exchanged. What a step costs does not depend on the number of
//! parameters.
#![allow(non_snake_case)] // A, B

use super::mass_sums::Factors;
use crate::geometry::form::{Form, Row, Term};
use std::collections::BTreeMap;
use vi_constraints::design::Costates;
use vi_core::Interval;
use vi_core::num_dual::Dual64;

/// A number of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Datum {
    /// `α_k` of a side, from the offset of its vector, which has so many coordinates.
    Coefficient { side: usize, offset: usize, dimension: usize },
    /// A component of `α_0` of a side.
    Constant { side: usize, component: usize },
    /// `c`.
    Target,
}

/// The sums of a row.
struct RowSum {
    row: usize, // among all constraints
    product: Row,
    data: Vec<Datum>,
    first: usize, // of the sums
}

/// The sums that parameters need.
pub(super) struct RowSums {
    rows: Vec<RowSum>,
    count: usize,
}

/// Visits what changes of a row, with its derivative by the parameter.
fn for_each_change(row: &Row<Dual64>, mut visit: impl FnMut(Datum, f64)) {
    let mut visit = |datum, slope: f64| {
        if slope != 0.0 {
            visit(datum, slope);
        }
    };
    for (side, form) in [&row.a, &row.b].into_iter().enumerate() {
        for &Term { offset, dimension, coefficient } in form.terms() {
            visit(Datum::Coefficient { side, offset, dimension }, coefficient.eps);
        }
        for (component, constant) in form.constant_part().iter().enumerate() {
            visit(Datum::Constant { side, component }, constant.eps);
        }
    }
    visit(Datum::Target, row.target.eps);
}

impl RowSums {
    /// Of parameters that change these rows, each with its number among all constraints; with their
    /// factors. Sums are numbered from `first`.
    pub(super) fn of<'a, I>(
        rows: impl Iterator<Item = I> + Clone,
        first: usize,
    ) -> (Self, Vec<Factors>)
    where
        I: Iterator<Item = (usize, &'a Row<Dual64>)>,
    {
        let mut known: BTreeMap<(usize, Datum), (usize, &Row<Dual64>)> = BTreeMap::new();
        for (row, dual) in rows.clone().flatten() {
            for_each_change(dual, |datum, _| {
                known.insert((row, datum), (0, dual));
            });
        }
        let mut found: Vec<RowSum> = Vec::new();
        for (place, (&(row, datum), (number, dual))) in known.iter_mut().enumerate() {
            *number = first + place;
            match found.last_mut().filter(|last| last.row == row) {
                Some(last) => last.data.push(datum),
                None => {
                    let (product, data) = (dual.values(), vec![datum]);
                    found.push(RowSum { row, product, data, first: *number });
                }
            }
        }
        let factors = |own: I| {
            let mut factors = Factors::new();
            for (row, dual) in own {
                for_each_change(dual, |datum, slope| factors.push((known[&(row, datum)].0, slope)));
            }
            factors
        };
        let factors = rows.map(factors).collect();
        (Self { rows: found, count: known.len() }, factors)
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Adds those of a step.
    pub(super) fn add(
        &self,
        s: &Interval,
        impulse: &[f64],
        costates: Costates<'_>,
        sums: &mut [f64],
    ) {
        let mu = costates.step;
        for RowSum { row, product, data, first } in &self.rows {
            let sigma = product.scale * costates.rows[*row];
            let lambda = product.scale * impulse[*row];
            // by A with B and by B with A, at q_{n+1}, at q_n, along μ
            let with = |B: &Form| [B.at(&s.q1) * -sigma, B.at(&s.q0) * lambda, B.rate(mu) * lambda];
            let sides = [with(&product.b), with(&product.a)];
            for (sum, datum) in sums[*first..].iter_mut().zip(data) {
                *sum += match *datum {
                    Datum::Coefficient { side, offset, dimension } => {
                        let x = Term { offset, dimension, coefficient: () };
                        let [end, start, along] = &sides[side];
                        x.of(&s.q1).dot(end) + x.of(mu).dot(start) + x.of(&s.q0).dot(along)
                    }
                    Datum::Constant { side, component } => {
                        let [end, _, along] = &sides[side];
                        end[component] + along[component]
                    }
                    Datum::Target => sigma,
                };
            }
        }
    }
}
