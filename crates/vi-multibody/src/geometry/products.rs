//! Products of forms that share forms: each form is evaluated once.
//!
//! ```text
//! g_i = s_i (A_i·B_i − c_i)          the rows of a joint: its gap and its axes, in turn with each other
//! Σ x_i ∇g_i     by a form F: f_F = Σ x_i s_i (the other form of row i)         at q
//! Σ x_i D²g_i v  the same with the homogeneous parts at v
//! ```

use super::form::{BilinearRow, Form};
use nalgebra::Vector3;

/// The most forms: two for each of six rows.
pub(crate) const MOST: usize = 12;

/// A vector for each form.
pub(crate) type Vectors = [Vector3<f64>; MOST];

/// Rows with the forms they are made of, at most [`MOST`].
#[derive(Debug, Default)]
pub(crate) struct Products {
    forms: Vec<Form>,
    rows: Vec<ProductRow>,
}

/// `s`, and which forms `A` and `B` are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProductRow {
    pub(crate) scale: f64,
    /// `A`, `B`.
    pub(crate) sides: [usize; 2],
}

impl Products {
    /// Adds a row; `false` where it has too many forms.
    pub(crate) fn push(&mut self, row: &BilinearRow) -> bool {
        let known = self.forms.len();
        let sides = [&row.a, &row.b].map(|form| {
            self.forms.iter().position(|own| own == form).unwrap_or_else(|| {
                self.forms.push(form.clone());
                self.forms.len() - 1
            })
        });
        let fits = self.forms.len() <= MOST;
        match fits {
            true => self.rows.push(ProductRow { scale: row.scale, sides }),
            false => self.forms.truncate(known),
        }
        fits
    }

    /// The rows.
    pub(crate) fn rows(&self) -> &[ProductRow] {
        &self.rows
    }

    /// The forms.
    pub(crate) fn forms(&self) -> &[Form] {
        &self.forms
    }

    /// Their values at `q`.
    pub(crate) fn values(&self, q: &[f64]) -> Vectors {
        self.each(|form| form.at(q))
    }

    /// Their homogeneous parts at `v`.
    pub(crate) fn rates(&self, v: &[f64]) -> Vectors {
        self.each(|form| form.rate(v))
    }

    fn each(&self, of: impl Fn(&Form) -> Vector3<f64>) -> Vectors {
        let mut out = [Vector3::zeros(); MOST];
        self.forms.iter().zip(&mut out).for_each(|(form, out)| *out = of(form));
        out
    }

    /// `out ← out + sign Σ x_i ∇g_i` of the values at `q`, or `Σ x_i D²g_i v` of the rates at `v`.
    pub(crate) fn add_slopes(&self, values: &Vectors, sign: f64, x: &[f64], out: &mut [f64]) {
        let mut forces = [Vector3::zeros(); MOST];
        for (ProductRow { scale, sides: [a, b] }, x) in self.rows.iter().zip(x) {
            let x = sign * scale * x;
            forces[*a] += x * values[*b];
            forces[*b] += x * values[*a];
        }
        let forms = self.forms.iter().zip(&forces);
        forms.for_each(|(form, force)| form.add_transposed(force, out));
    }
}
