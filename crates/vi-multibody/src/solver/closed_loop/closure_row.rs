//! Rows of loops that are products of two forms on two links at most, each in one piece.
//!
//! ```text
//! g = s (A·B − c),   A = a_0 + Σ_k (α_k φ_k + D_k a_k),   B = b_0 + Σ_k (β_k φ_k + D_k b_k)         D_k: directors of link k
//! f_k = s (α_k B + β_k A)                                                                force on link k
//! τ_k = s (D_k (a_k − α_k ϱ_k) × B + D_k (b_k − β_k ϱ_k) × A)     torque about its reference point, ϱ_k from the centre
//! ```

use crate::constraint::scalar_constraint::ScalarRow;
use crate::geometry::form::{Form, Row};
use crate::pair::Twist;
use nalgebra::Vector3;
use vi_rigid::directors::{self, FRAME};

/// Where a row acts: a link, as its row of constraints has it.
#[derive(Clone, Copy)]
pub(super) struct Site {
    /// First coordinate of its frame.
    pub(super) frame: usize,
    /// Its place in the cluster; `None` at the apex of the row, where the wrenches balance.
    pub(super) home: Option<usize>,
    /// `ϱ`, its own directors.
    pub(super) reference: Vector3<f64>,
}

/// A form on one link.
#[derive(Clone, Copy)]
struct Part {
    share: f64,           // α_k
    vector: Vector3<f64>, // a_k
    arm: Vector3<f64>,    // a_k − α_k ϱ_k
}

/// A form on the links of a row.
struct OnLinks {
    constant: Vector3<f64>,
    parts: [Option<Part>; 2],
}

/// A product of two forms.
pub(super) struct ClosureRow {
    scale: f64,
    target: f64,
    sites: [Option<Site>; 2],
    a: OnLinks,
    b: OnLinks,
}

impl OnLinks {
    fn new(form: &Form, sites: &[Option<Site>; 2]) -> Self {
        let part = |site: Site| {
            let of = |at: usize| {
                let own = form.terms().iter().filter(|term| term.offset == site.frame + at);
                own.map(|term| term.coefficient).sum()
            };
            let (share, vector) = (of(0), Vector3::from_fn(|i, _| of(3 + 3 * i)));
            Part { share, vector, arm: vector - share * site.reference }
        };
        let own = |site: Site| {
            let frame = site.frame..site.frame + FRAME;
            form.terms().iter().any(|term| frame.contains(&term.offset)).then(|| part(site))
        };
        Self { constant: form.constant_part(), parts: sites.map(|site| site.and_then(own)) }
    }

    /// Its value.
    #[inline]
    fn at(&self, sites: &[Option<Site>; 2], q: &[f64]) -> Vector3<f64> {
        let mut sum = self.constant;
        for (part, site) in self.parts.iter().zip(sites) {
            if let (Some(part), Some(site)) = (part, site) {
                let own = &q[site.frame..site.frame + FRAME];
                sum += directors::triad(own) * part.vector;
                sum += part.share * Vector3::new(own[0], own[1], own[2]);
            }
        }
        sum
    }
}

impl ClosureRow {
    /// Of a row of constraints; `site` tells where a body is, by the first coordinate of its frame. `None` where the row is no
    /// product, or acts on more than two links, or on points.
    pub(super) fn new(row: &ScalarRow, site: impl Fn(usize) -> Option<Site>) -> Option<Self> {
        let ScalarRow::Product(Row { scale, a, b, target }) = row else { return None };
        let mut sites: [Option<Site>; 2] = [None; 2];
        for term in a.terms().iter().chain(b.terms()) {
            let frame = term.offset - term.offset % FRAME;
            if sites.iter().flatten().all(|site| site.frame != frame) {
                *sites.iter_mut().find(|site| site.is_none())? = Some(site(frame)?);
            }
        }
        let [a, b] = [a, b].map(|form| OnLinks::new(form, &sites));
        Some(Self { scale: *scale, target: *target, sites, a, b })
    }

    /// `g`.
    pub(super) fn value(&self, q: &[f64]) -> f64 {
        self.scale * (self.a.at(&self.sites, q).dot(&self.b.at(&self.sites, q)) - self.target)
    }

    /// Its gradient as wrenches about the reference points of links of the cluster.
    #[inline]
    pub(super) fn for_each_wrench(&self, q: &[f64], mut visit: impl FnMut(usize, Twist)) {
        let [a, b] = [&self.a, &self.b].map(|form| self.scale * form.at(&self.sites, q));
        for (k, site) in self.sites.iter().enumerate() {
            let Some(Site { frame, home: Some(home), .. }) = *site else { continue };
            let d = directors::triad(&q[frame..frame + FRAME]);
            let mut wrench = Twist::zero();
            for (form, other) in [(&self.a, &b), (&self.b, &a)] {
                if let Some(part) = &form.parts[k] {
                    wrench.linear += part.share * other;
                    wrench.angular += (d * part.arm).cross(other);
                }
            }
            visit(home, wrench);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::PairKind;
    use crate::pair::joint::{FrameId, Joint, Side};
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
    fn rows_in_one_piece_are_those_of_the_joints() {
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
                for row in kind.rows(&joint).into_iter().map(ScalarRow::Product) {
                    let site = |frame: usize| {
                        let home = frame / FRAME;
                        Some(Site { frame, home: Some(home), reference: references[home] })
                    };
                    let closure = ClosureRow::new(&row, site).expect("a product on two bodies");
                    let mut sums = wrenches(&row, &q, &references);
                    closure.for_each_wrench(&q, |body, w| sums[body].add_scaled(-1.0, &w));
                    let value = row.value(Configuration::new(0.0, &q)) - closure.value(&q);
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
