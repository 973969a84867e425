//! Sweeps over the contacts, made faster by conjugate directions.
//!
//! ```text
//! r_k = S(Λ_k) − Λ_k,   β = |r_k|²/|r_{k−1}|²
//! Λ_{k+1} = S(Λ_k) + β d_{k−1},   d_k = r_k + β d_{k−1}          where β ≤ 1, else d_k = r_k
//! ```
//! `S`: a sweep forth and back over the contacts, each law solved exactly. Source: M.
//! Silcowitz-Hansen, S. Niebe, K. Erleben, The Visual Computer 26 (2010) 893–901.

#[derive(Clone, Debug, Default)]
pub(super) struct Conjugate {
    before: Vec<f64>,    // k  Λ_k
    direction: Vec<f64>, // k  d_k
    last: f64,           // |r_{k−1}|²
}

impl Conjugate {
    /// Forgets all, for `k` rows.
    pub(super) fn begin(&mut self, k: usize) {
        for vector in [&mut self.before, &mut self.direction] {
            vector.clear();
            vector.resize(k, 0.0);
        }
        self.last = 0.0;
    }

    /// Before a sweep.
    pub(super) fn before(&mut self, impulse: &[f64]) {
        self.before.copy_from_slice(impulse);
    }

    /// After a sweep.
    pub(super) fn after(&mut self, impulse: &mut [f64]) {
        let Self { before, direction, last } = self;
        let step = impulse.iter().zip(&*before).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let part = if *last > 0.0 { step / *last } else { f64::INFINITY };
        let onward = if part <= 1.0 { part } else { 0.0 };
        for ((own, before), direction) in impulse.iter_mut().zip(&*before).zip(direction) {
            let change = *own - before;
            *own += onward * *direction;
            *direction = change + onward * *direction;
        }
        *last = step;
    }
}
