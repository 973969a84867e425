//! Rows of loops that are products of two forms on two links at most; rows that follow one another
//! share their forms.
//!
//! ```text
//! g = s (A·B − c),   A = a_0 + Σ_k (α_k φ_k + D_k a_k),   B = b_0 + Σ_k (β_k φ_k + D_k b_k)         D_k: directors of link k
//! f_k = s (α_k B + β_k A)                                                                force on link k
//! τ_k = s (D_k (a_k − α_k ϱ_k) × B + D_k (b_k − β_k ϱ_k) × A)     torque about its reference point, ϱ_k from the centre
//! ```

use crate::constraint::scalar_constraint::ScalarRow;
use crate::geometry::form::{BilinearRow, Form};
use nalgebra::Vector3;
use vi_rigid::directors::{self, FRAME};

/// Rows back to which a row looks for its own forms: those of a joint.
const RECENT: usize = 5;

/// No link.
const NONE: u32 = u32::MAX;

/// A link that a row acts on, as its row of constraints has it.
#[derive(Clone, Copy)]
pub(super) struct Site {
    /// First coordinate of its frame.
    pub(super) frame: usize,
    /// Its place in the cluster; `None` at the apex of the row, where the wrenches balance.
    pub(super) home: Option<usize>,
    /// `ϱ`, its own directors.
    pub(super) reference: Vector3<f64>,
}

/// A form on one link, or what is constant in it.
#[derive(Clone, Copy, PartialEq)]
struct FormPart {
    frame: u32,           // first coordinate; NONE: constant
    home: u32,            // place in the cluster; NONE: the apex
    share: f64,           // α_k
    vector: Vector3<f64>, // a_k
    arm: Vector3<f64>,    // a_k − α_k ϱ_k
}

/// A product of two forms, by the places of their parts.
#[derive(Clone, Copy)]
struct FormProduct {
    scale: f64,
    target: f64,
    forms: [FormParts; 2], // A, B
}

/// Places of the parts of a form.
#[derive(Clone, Copy, PartialEq)]
struct FormParts {
    first: u32,
    count: u32,
}

/// The rows of a cluster, as far as they are products.
#[derive(Default)]
pub(super) struct ClosureRows {
    products: Vec<Option<FormProduct>>,
    parts: Vec<FormPart>,
}

/// The form that was evaluated last, `A` of several rows, with its value.
#[derive(Clone, Copy)]
pub(super) struct LastForm {
    first: u32, // of its parts
    value: Vector3<f64>,
}

impl LastForm {
    /// Nothing is evaluated yet.
    pub(super) const NONE: Self = Self { first: NONE, value: Vector3::new(0.0, 0.0, 0.0) };
}

impl FormPart {
    fn constant(vector: Vector3<f64>) -> Self {
        Self { frame: NONE, home: NONE, share: 0.0, vector, arm: vector }
    }

    /// Of a form on a link; `None` where it has none there.
    fn new(form: &Form, site: &Site) -> Option<Self> {
        let of = |at: usize| -> f64 {
            let own = form.terms().iter().filter(|term| term.offset == site.frame + at);
            own.map(|term| term.coefficient).sum()
        };
        let own = site.frame..site.frame + FRAME;
        form.terms().iter().any(|term| own.contains(&term.offset)).then_some(())?;
        let (share, vector) = (of(0), Vector3::from_fn(|i, _| of(3 + 3 * i)));
        let (frame, home) = (site.frame as u32, site.home.map_or(NONE, |home| home as u32));
        Some(Self { frame, home, share, vector, arm: vector - share * site.reference })
    }

    /// The coordinates of its link.
    #[inline]
    fn of<'q>(&self, q: &'q [f64]) -> Option<&'q [f64]> {
        let first = self.frame as usize;
        (self.frame != NONE).then(|| &q[first..first + FRAME])
    }
}

impl ClosureRows {
    /// Adds a row of constraints; `site` tells where a body is, by the first coordinate of its
    /// frame. It is left to the row itself where it is no product, or acts on more than two links,
    /// or on points.
    pub(super) fn push(&mut self, row: &ScalarRow, site: impl Fn(usize) -> Option<Site>) {
        let product = self.product(row, site);
        self.products.push(product);
    }

    fn product(
        &mut self,
        row: &ScalarRow,
        site: impl Fn(usize) -> Option<Site>,
    ) -> Option<FormProduct> {
        let ScalarRow::Product(BilinearRow { scale, a, b, target }) = row else { return None };
        let mut sites: Vec<Site> = Vec::new();
        for term in a.terms().iter().chain(b.terms()) {
            let frame = term.offset - term.offset % FRAME;
            if sites.iter().all(|at| at.frame != frame) {
                sites.push(site(frame)?);
            }
        }
        let fits = |site: &Site| site.frame.max(site.home.unwrap_or(0)) < NONE as usize;
        (sites.len() <= 2 && sites.iter().all(fits)).then_some(())?;
        let forms = [a, b].map(|form| self.place(form, &sites));
        Some(FormProduct { scale: *scale, target: *target, forms })
    }

    /// Where the parts of a form are, which a row just before may have, too.
    fn place(&mut self, form: &Form, sites: &[Site]) -> FormParts {
        let constant = form.constant_part();
        let mut own: Vec<FormPart> =
            sites.iter().filter_map(|site| FormPart::new(form, site)).collect();
        if constant != Vector3::zeros() || own.is_empty() {
            // no form is without a part, so each has a place of its own
            own.insert(0, FormPart::constant(constant));
        }
        let recent = self.products.iter().rev().take(RECENT).flatten();
        let known = recent.flat_map(|row| row.forms).find(|&parts| self.parts(parts) == own);
        known.unwrap_or_else(|| {
            let [first, count] = [self.parts.len(), own.len()].map(|number| number as u32);
            self.parts.extend(own);
            FormParts { first, count }
        })
    }

    #[inline]
    fn parts(&self, FormParts { first, count }: FormParts) -> &[FormPart] {
        &self.parts[first as usize..(first + count) as usize]
    }

    /// The value of a form.
    #[inline]
    fn at(&self, form: FormParts, q: &[f64]) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for part in self.parts(form) {
            let Some(own) = part.of(q) else {
                sum += part.vector;
                continue;
            };
            sum += directors::triad(own) * part.vector;
            if part.share != 0.0 {
                sum += part.share * Vector3::new(own[0], own[1], own[2]);
            }
        }
        sum
    }

    /// `A` and `B`.
    #[inline]
    fn values(&self, product: &FormProduct, q: &[f64], last: &mut LastForm) -> [Vector3<f64>; 2] {
        let [a, b] = product.forms;
        if last.first != a.first {
            *last = LastForm { first: a.first, value: self.at(a, q) };
        }
        [last.value, self.at(b, q)]
    }

    /// `g` of row `i`, where it is a product; `last` is of the same `q`.
    pub(super) fn value(&self, i: usize, q: &[f64], last: &mut LastForm) -> Option<f64> {
        let product = self.products.get(i)?.as_ref()?;
        let [a, b] = self.values(product, q, last);
        Some(product.scale * (a.dot(&b) - product.target))
    }

    /// The gradient of row `i` as forces, where there are any, and moments about the reference
    /// points of links of the cluster; `false` where it is no product.
    #[inline]
    pub(super) fn for_each_wrench(
        &self,
        i: usize,
        q: &[f64],
        last: &mut LastForm,
        mut visit: impl FnMut(usize, Option<Vector3<f64>>, Vector3<f64>),
    ) -> bool {
        let Some(Some(product)) = self.products.get(i) else { return false };
        let [a, b] = self.values(product, q, last).map(|value| product.scale * value);
        for (form, other) in product.forms.into_iter().zip([b, a]) {
            for part in self.parts(form).iter().filter(|part| part.home != NONE) {
                let Some(own) = part.of(q) else { continue };
                let moment = (directors::triad(own) * part.arm).cross(&other);
                let force = (part.share != 0.0).then(|| part.share * other);
                visit(part.home as usize, force, moment);
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::joint::{FrameId, Joint, Side};
    use crate::pair::{PairKind, Twist};
    use nalgebra::Matrix3;
    use vi_core::Configuration;
    use vi_testkit::Sample;

    /// The wrenches of a row of constraints on two bodies, about their reference points.
    fn wrenches(row: &ScalarRow, q: &[f64], references: &[Vector3<f64>; 2]) -> [Twist; 2] {
        let mut sums = [Twist::zero(); 2];
        row.for_each_wrench(q, |body, wrench| {
            let lever =
                -(directors::triad(&q[FRAME * body..FRAME * (body + 1)]) * references[body]);
            let moment = wrench.angular + lever.cross(&wrench.linear);
            sums[body].add_scaled(1.0, &Twist::new(wrench.linear, moment));
        });
        sums
    }

    #[test]
    fn rows_that_share_forms_are_those_of_the_joints() {
        let mut sample = Sample::new(7);
        let (mut off, mut count) = (0.0_f64, 0);
        for kind in PairKind::ALL {
            for ground in [false, true] {
                let mut side = |frame| {
                    let axes = Matrix3::from_column_slice(&sample.frame()[3..]);
                    Side { frame, anchor: sample.vector(), axes }
                };
                let below = if ground { FrameId::Ground } else { FrameId::Frame(0) };
                let (parent, child) = (side(below), side(FrameId::Frame(1)));
                let joint = Joint { name: "joint".to_owned(), kind, parent, child };
                let q = [sample.frame(), sample.frame()].concat();
                let references = [sample.vector(), sample.vector()];
                let (mut closures, mut last) = (ClosureRows::default(), LastForm::NONE);
                for (i, row) in kind.rows(&joint).into_iter().map(ScalarRow::Product).enumerate() {
                    let site = |frame: usize| {
                        let home = frame / FRAME;
                        Some(Site { frame, home: Some(home), reference: references[home] })
                    };
                    closures.push(&row, site);
                    let mut sums = wrenches(&row, &q, &references);
                    let taken = closures.for_each_wrench(i, &q, &mut last, |body, f, moment| {
                        let wrench = Twist::new(f.unwrap_or_default(), moment);
                        sums[body].add_scaled(-1.0, &wrench);
                    });
                    assert!(taken, "a product on two bodies");
                    let own = closures.value(i, &q, &mut last).unwrap();
                    let value = row.value(Configuration::new(0.0, &q)) - own;
                    off = sums.iter().map(|sum| sum.to_vector().amax()).fold(off, f64::max);
                    off = off.max(value.abs());
                    assert!(!value.is_nan() && !off.is_nan());
                    count += 1;
                }
            }
        }
        println!("{count} rows differ by at most {off:.1e}");
        assert!(count > 40 && off < 1e-14, "{count} rows, off by {off:e}");
    }
}
