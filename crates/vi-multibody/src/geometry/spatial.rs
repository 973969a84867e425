//! 6×6 matrices on twists `(φ̇, ω)`, by 3×3 blocks.

use crate::geometry::twist::{Twist, TwistTransfer};
use nalgebra::{Matrix3, Vector3};
use vi_rigid::rotation::skew;

/// A 6×6 matrix on twists, by 3×3 blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialMatrix {
    ll: Matrix3<f64>,
    la: Matrix3<f64>,
    al: Matrix3<f64>,
    aa: Matrix3<f64>,
}

impl SpatialMatrix {
    /// Zero.
    #[must_use]
    pub fn zero() -> Self {
        let z = Matrix3::zeros();
        Self { ll: z, la: z, al: z, aa: z }
    }

    /// Its blocks: linear–linear, linear–angular, angular–linear, angular–angular.
    pub(crate) fn blocks(&self) -> [&Matrix3<f64>; 4] {
        [&self.ll, &self.la, &self.al, &self.aa]
    }

    #[cfg(test)]
    pub(crate) fn mul(&self, t: &Twist) -> Twist {
        Twist::new(
            self.ll * t.linear + self.la * t.angular,
            self.al * t.linear + self.aa * t.angular,
        )
    }

    /// `self −= x yᵀ`.
    #[inline]
    pub(crate) fn sub_outer(&mut self, x: &Twist, y: &Twist) {
        for j in 0..3 {
            for i in 0..3 {
                self.ll[(i, j)] -= x.linear[i] * y.linear[j];
                self.la[(i, j)] -= x.linear[i] * y.angular[j];
                self.al[(i, j)] -= x.angular[i] * y.linear[j];
                self.aa[(i, j)] -= x.angular[i] * y.angular[j];
            }
        }
    }

    /// `self += m P(a)ᵀ P'(b)` with `P(a) = [I, 0]` of the centre, `[0, −â]` of a director `a`:
    /// ```text
    /// centre, centre      ll += m I            centre, director    la −= m b̂
    /// director, centre    al += m â            director, director  aa += m (a·b I − b aᵀ)
    /// ```
    #[inline]
    pub(crate) fn add_multiple(
        &mut self,
        m: f64,
        a: Option<&Vector3<f64>>,
        b: Option<&Vector3<f64>>,
    ) {
        match (a, b) {
            (None, None) => (0..3).for_each(|i| self.ll[(i, i)] += m),
            (None, Some(b)) => self.la -= m * skew(b),
            (Some(a), None) => self.al += m * skew(a),
            (Some(a), Some(b)) => {
                self.aa -= (m * b) * a.transpose();
                let trace = m * a.dot(b);
                (0..3).for_each(|i| self.aa[(i, i)] += trace);
            }
        }
    }

    /// `self += P(a)ᵀ M P'(b)`, with `P` as in [`SpatialMatrix::add_multiple`].
    pub(crate) fn add_block(
        &mut self,
        block: &Matrix3<f64>,
        a: Option<&Vector3<f64>>,
        b: Option<&Vector3<f64>>,
    ) {
        match (a, b) {
            (None, None) => self.ll += block,
            (None, Some(b)) => self.la += times_minus_skew(block, b),
            (Some(a), None) => self.al += skew_times(a, block),
            (Some(a), Some(b)) => self.aa += skew_times(a, &times_minus_skew(block, b)),
        }
    }

    /// `Xᵀ A X'`.
    #[inline]
    pub(crate) fn congruence(&self, left: &TwistTransfer, right: &TwistTransfer) -> Self {
        self.times(right).transmitted(left)
    }

    /// `A X'`.
    #[inline]
    pub(crate) fn times(&self, right: &TwistTransfer) -> Self {
        let Self { ll, al, .. } = *self;
        match right {
            TwistTransfer::Rigid(b) => {
                let (la, aa) = (times_minus_skew(&ll, b), times_minus_skew(&al, b));
                Self { ll, la: la + self.la, al, aa: aa + self.aa }
            }
            TwistTransfer::Point(b) => {
                Self { ll, la: times_minus_skew(&ll, b), al, aa: times_minus_skew(&al, b) }
            }
            TwistTransfer::None => Self::zero(),
        }
    }

    /// `Xᵀ A`.
    #[inline]
    pub(crate) fn transmitted(&self, left: &TwistTransfer) -> Self {
        let Self { ll, la, .. } = *self;
        match left {
            TwistTransfer::Rigid(a) => {
                let (al, aa) = (skew_times(a, &ll), skew_times(a, &la));
                Self { ll, la, al: self.al + al, aa: self.aa + aa }
            }
            TwistTransfer::Point(a) => {
                Self { ll, la, al: skew_times(a, &ll), aa: skew_times(a, &la) }
            }
            TwistTransfer::None => Self::zero(),
        }
    }
}

/// `−M b̂`: row i is `b × row_i`.
#[inline]
fn times_minus_skew(m: &Matrix3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
    let row = |i: usize| b.cross(&m.row(i).transpose()).transpose();
    Matrix3::from_rows(&[row(0), row(1), row(2)])
}

/// `â M`: columns `a × column`.
#[inline]
fn skew_times(a: &Vector3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    let column = |j: usize| -> Vector3<f64> { a.cross(&m.column(j)) };
    Matrix3::from_columns(&[column(0), column(1), column(2)])
}
