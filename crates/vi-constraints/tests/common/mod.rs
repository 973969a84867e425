//! Constraints that several tests use.
#![allow(dead_code, unreachable_pub)] // each test takes what it needs

use vi_constraints::Constraints;
use vi_core::{Configuration, Entries};

/// Bars between points of `dim` coordinates; `None`: the origin.
#[derive(Clone)]
pub struct Bars {
    pub dim: usize,
    pub points: usize,
    pub bars: Vec<(Option<usize>, usize, f64)>,
}

impl Bars {
    pub fn arm(&self, bar: usize, q: &[f64]) -> Vec<f64> {
        let (from, to, _) = self.bars[bar];
        let at = |point: usize, i: usize| q[self.dim * point + i];
        (0..self.dim).map(|i| at(to, i) - from.map_or(0.0, |from| at(from, i))).collect()
    }
}

impl Constraints for Bars {
    fn dim(&self) -> usize {
        self.dim * self.points
    }
    fn len(&self) -> usize {
        self.bars.len()
    }
    fn value(&self, Configuration { q, .. }: Configuration<'_>, out: &mut [f64]) {
        for (k, g) in out.iter_mut().enumerate() {
            let square: f64 = self.arm(k, q).iter().map(|x| x * x).sum();
            *g = 0.5 * (square - self.bars[k].2.powi(2));
        }
    }
    fn jacobian(&self, _t: f64, q: &[f64], out: &mut dyn Entries) {
        for (k, &(from, to, _)) in self.bars.iter().enumerate() {
            for (i, x) in self.arm(k, q).into_iter().enumerate() {
                out.add(k, self.dim * to + i, x);
                if let Some(from) = from {
                    out.add(k, self.dim * from + i, -x);
                }
            }
        }
    }
    fn second_derivative(&self, _t: f64, _q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        for (k, g) in out.iter_mut().enumerate() {
            *g = self.arm(k, v).iter().zip(self.arm(k, w)).map(|(v, w)| v * w).sum();
        }
    }
}

/// A pendulum in the plane with a rod of length `1 + 0.2 sin 3t`.
#[derive(Clone)]
pub struct Winch;

impl Winch {
    fn length(t: f64) -> [f64; 3] {
        [1.0 + 0.2 * (3.0 * t).sin(), 0.6 * (3.0 * t).cos(), -1.8 * (3.0 * t).sin()]
    }
}

impl Constraints for Winch {
    fn dim(&self) -> usize {
        2
    }
    fn len(&self) -> usize {
        1
    }
    fn value(&self, at: Configuration<'_>, out: &mut [f64]) {
        let Configuration { t, q, .. } = at;
        out[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - Self::length(t)[0].powi(2));
    }
    fn jacobian(&self, _t: f64, q: &[f64], out: &mut dyn Entries) {
        out.add(0, 0, q[0]);
        out.add(0, 1, q[1]);
    }
    fn second_derivative(&self, _t: f64, _q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        out[0] = v[0] * w[0] + v[1] * w[1];
    }
    fn time_derivative(&self, t: f64, _q: &[f64], out: &mut [f64]) {
        let [l, rate, _] = Self::length(t);
        out[0] = -l * rate;
    }
    fn acceleration_terms(&self, t: f64, q: &[f64], v: &[f64], out: &mut [f64]) {
        self.second_derivative(t, q, v, v, out);
        let [l, rate, acceleration] = Self::length(t);
        out[0] -= rate * rate + l * acceleration;
    }
    fn is_rheonomic(&self) -> bool {
        true
    }
}

/// All bars between some points, with lengths from their places.
pub fn frame(dim: usize, places: &[f64], hung: bool) -> Bars {
    let points = places.len() / dim;
    let mut bars = Bars { dim, points, bars: Vec::new() };
    for to in 0..points {
        (0..to).for_each(|from| bars.bars.push((Some(from), to, 0.0)));
    }
    if hung {
        bars.bars.push((None, 0, 0.0));
    }
    for k in 0..bars.bars.len() {
        bars.bars[k].2 = bars.arm(k, places).iter().map(|x| x * x).sum::<f64>().sqrt();
    }
    bars
}
