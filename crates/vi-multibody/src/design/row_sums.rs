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

use super::mass_sums::SumFactors;
use crate::geometry::form::{BilinearRow, Term};
use crate::geometry::products::{ProductRow, Products};
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

/// The sums of some rows.
#[derive(Default)]
struct SumGroup {
    products: Products,
    numbers: Vec<usize>,       // of the rows among all constraints
    data: Vec<(usize, Datum)>, // row of the group
    first: usize,              // of the sums
}

/// The sums that parameters need.
pub(super) struct ParameterRowSums {
    groups: Vec<SumGroup>,
    count: usize,
}

/// Visits what changes of a row, with its derivative by the parameter.
fn for_each_change(row: &BilinearRow<Dual64>, mut visit: impl FnMut(Datum, f64)) {
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

impl ParameterRowSums {
    /// Of parameters that change these rows, each with its number among all constraints; with their
    /// factors. Sums are numbered from `first`.
    pub(super) fn of<'a, I>(
        rows: impl Iterator<Item = I> + Clone,
        first: usize,
    ) -> (Self, Vec<SumFactors>)
    where
        I: Iterator<Item = (usize, &'a BilinearRow<Dual64>)>,
    {
        let mut known: BTreeMap<(usize, Datum), (usize, &BilinearRow<Dual64>)> = BTreeMap::new();
        for (row, dual) in rows.clone().flatten() {
            for_each_change(dual, |datum, _| {
                known.insert((row, datum), (0, dual));
            });
        }
        let mut groups: Vec<SumGroup> = Vec::new();
        for (place, (&(row, datum), (number, dual))) in known.iter_mut().enumerate() {
            *number = first + place;
            let last = groups.last_mut();
            if !last.is_some_and(|group| group.take(row, dual)) {
                let mut group = SumGroup { first: *number, ..SumGroup::default() };
                group.take(row, dual);
                groups.push(group);
            }
            if let Some(group) = groups.last_mut() {
                group.data.push((group.numbers.len() - 1, datum));
            }
        }
        let factors = |own: I| {
            let mut factors = SumFactors::new();
            for (row, dual) in own {
                for_each_change(dual, |datum, slope| factors.push((known[&(row, datum)].0, slope)));
            }
            factors
        };
        let factors = rows.map(factors).collect();
        (Self { groups, count: known.len() }, factors)
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
        for SumGroup { products, numbers, data, first } in &self.groups {
            let [end, start] = [&s.q1, &s.q0].map(|q| products.values(q));
            let along = products.rates(mu);
            for (sum, &(k, datum)) in sums[*first..].iter_mut().zip(data) {
                let ProductRow { scale, sides } = products.rows()[k];
                let sigma = scale * costates.rows[numbers[k]];
                let lambda = scale * impulse[numbers[k]];
                *sum += match datum {
                    Datum::Coefficient { side, offset, dimension } => {
                        let x = Term { offset, dimension, coefficient: () };
                        let other = sides[1 - side];
                        lambda * (x.of(mu).dot(&start[other]) + x.of(&s.q0).dot(&along[other]))
                            - sigma * x.of(&s.q1).dot(&end[other])
                    }
                    Datum::Constant { side, component } => {
                        let other = sides[1 - side];
                        lambda * along[other][component] - sigma * end[other][component]
                    }
                    Datum::Target => sigma,
                };
            }
        }
    }
}

impl SumGroup {
    /// Whether it has the row, or takes it.
    fn take(&mut self, row: usize, dual: &BilinearRow<Dual64>) -> bool {
        self.numbers.last() == Some(&row)
            || (self.products.push(&dual.values()) && {
                self.numbers.push(row);
                true
            })
    }
}
