//! Initial guesses of a sub-step of a composition from the sub-steps before it.
//!
//! A sub-step of the length `γ_j h`, in the middle of which the time is `τ h`, moves the system by
//! ```text
//! u_j = γ_j (a + b τ + c_1 τ² + c_2 γ_j² + d_1 τ³ + d_2 γ_j² τ + d_3 σ_j + …),   σ_j = Σ_{i<j} γ_i³ + ½ γ_j³
//! ```
//! `γ_j²`: the mean of a rate over the sub-step, and its error; `σ_j`: the error in the middle of
//! the sub-step, which the macro step has not made good yet. The weights `w_j` of the last
//! sub-steps are the least ones, in the Euclidean norm, for which `Σ w_j u_j` is exact for all
//! terms up to degree 2 or 3. They need one to three macro steps of history, where a polynomial of
//! a high degree through the same sub-step of each needs seven, and follow motions that a macro
//! step hardly resolves.

use nalgebra::{DMatrix, DVector};

/// Sub-steps that a guess is made of.
pub const NODES: usize = 11;

/// Weights of the sub-steps before, the last one first: of the guess of degree 2, and what degree 3
/// adds to it.
pub type Weights = [[f64; NODES]; 2];

/// The weights of each sub-step of a composition, once their lengths are known.
#[derive(Clone, Debug, Default)]
pub struct SubStepWeights {
    found: bool,
    weights: Vec<Weights>,
}

/// All are equal: they say nothing that the lengths of the sub-steps do not say.
impl PartialEq for SubStepWeights {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Where sub-step `k` finds the sub-step that ended `a` sub-steps before its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SubStepPlace {
    /// Its index in the macro step.
    pub index: usize,
    /// How many sub-steps of this index are newer.
    pub age: usize,
    back: usize, // macro steps
}

impl SubStepPlace {
    /// In a composition of `count` sub-steps.
    #[must_use]
    pub fn before(k: usize, a: usize, count: usize) -> Self {
        let back = (a + count - k) / count;
        let index = k + back * count - 1 - a;
        let age = if index < k { back } else { back - 1 };
        Self { index, age, back }
    }
}

impl SubStepWeights {
    /// Of sub-steps of these lengths, s, where they were not found yet; none where they are not
    /// determined.
    pub fn find(&mut self, lengths: impl Iterator<Item = f64> + Clone) {
        if self.found {
            return;
        }
        let whole: f64 = lengths.clone().sum();
        let gammas: Vec<f64> = lengths.map(|length| length / whole).collect();
        let weights = (0..gammas.len()).map(|k| of_sub_step(&gammas, k)).collect::<Option<_>>();
        (self.found, self.weights) = (true, weights.unwrap_or_default());
    }

    /// Those of sub-steps of other lengths are to be found.
    pub fn clear(&mut self) {
        self.found = false;
        self.weights.clear();
    }

    /// Becomes a copy of others; allocates only when there are more of them.
    pub fn copy_from(&mut self, other: &Self) {
        self.found = other.found;
        self.weights.clone_from(&other.weights);
    }

    /// Of sub-step `k`, if there are any.
    #[must_use]
    pub fn of(&self, k: usize) -> Option<&Weights> {
        self.weights.get(k)
    }
}

/// `1, τ, τ², γ², τ³, γ²τ, σ`.
fn terms(tau: f64, gamma: f64, sigma: f64) -> [f64; 7] {
    let square = gamma * gamma;
    [1.0, tau, tau * tau, square, tau.powi(3), square * tau, sigma]
}

/// The weights of sub-step `k`.
fn of_sub_step(gammas: &[f64], k: usize) -> Option<Weights> {
    let sum = |j: usize, power: i32| gammas[..j].iter().map(|g| g.powi(power)).sum::<f64>();
    let middle = |j: usize, power: i32| sum(j, power) + 0.5 * gammas[j].powi(power);
    let places: [SubStepPlace; NODES] =
        std::array::from_fn(|a| SubStepPlace::before(k, a, gammas.len()));
    let known = places.map(|SubStepPlace { index: j, back, .. }| {
        terms(middle(j, 1) - middle(k, 1) - back as f64, gammas[j], middle(j, 3))
    });
    let wanted = terms(0.0, gammas[k], middle(k, 3));
    let of_terms = |count: usize| -> Option<[f64; NODES]> {
        let matrix = DMatrix::from_fn(count, NODES, |term, a| known[a][term]);
        let right = DVector::from_fn(count, |term, _| wanted[term]);
        let svd = matrix.clone().svd(true, true);
        let rates = svd.solve(&right, 1e-10 * svd.singular_values.max()).ok()?;
        let exact = (&matrix * &rates - right).amax() < 1e-8;
        exact.then(|| std::array::from_fn(|a| rates[a] * gammas[k] / gammas[places[a].index]))
    };
    let (second, third) = (of_terms(4)?, of_terms(7)?);
    Some([second, std::array::from_fn(|a| third[a] - second[a])])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composition::Composition;

    #[test]
    fn places_go_back_through_the_macro_steps() {
        let of = |k, a| {
            let SubStepPlace { index, age, back } = SubStepPlace::before(k, a, 5);
            (index, age, back)
        };
        assert_eq!([0, 1, 4, 5].map(|a| of(0, a)), [(4, 0, 1), (3, 0, 1), (0, 0, 1), (4, 1, 2)]);
        assert_eq!(
            [0, 1, 2, 4, 5].map(|a| of(2, a)),
            [(1, 0, 0), (0, 0, 0), (4, 0, 1), (2, 0, 1), (1, 1, 1)]
        );
        assert_eq!(of(4, 10), (3, 2, 2));
    }

    /// The motion `q(t)` of a polynomial of degree 4, divided into the sub-steps of all
    /// compositions.
    #[test]
    fn polynomials_are_exact() {
        let q = |t: f64| t * (1.0 + t * (0.7 - t * (0.4 + 0.3 * t)));
        for composition in [
            Composition::Suzuki5,
            Composition::of_order(6).unwrap(),
            Composition::of_order(8).unwrap(),
        ] {
            let gammas = composition.gammas();
            let lengths: Vec<f64> = gammas.iter().map(|gamma| 0.25 * gamma).collect();
            let mut weights = SubStepWeights::default();
            weights.find(lengths.iter().copied());
            let increment = |macro_step: f64, j: usize| {
                let start = macro_step * 0.25 + lengths[..j].iter().sum::<f64>();
                q(start + lengths[j]) - q(start)
            };
            let mut missed = [0.0_f64; 2];
            for k in 0..gammas.len() {
                let of = weights.of(k).unwrap();
                let sums = of.map(|weights| {
                    let before = weights.iter().enumerate().map(|(a, weight)| {
                        let SubStepPlace { index, back, .. } =
                            SubStepPlace::before(k, a, gammas.len());
                        weight * increment(3.0 - back as f64, index)
                    });
                    before.sum::<f64>()
                });
                let exact = increment(3.0, k);
                missed[0] = missed[0].max((sums[0] - exact).abs());
                missed[1] = missed[1].max((sums[0] + sums[1] - exact).abs());
            }
            println!("{composition:?}: missed by {missed:?}");
            assert!(missed[1] < 1e-13 && missed[0] > 1e-6, "{missed:?}");
        }
    }

    /// The sub-steps of a pendulum leave the smooth motion and come back to it in each macro step:
    /// misses are of order 5 with `σ`, of order 4 and a hundred times as large without it.
    #[test]
    fn errors_of_sub_steps_are_foretold() {
        let missed = |count: usize| {
            let h = 2.0 / count as f64;
            let lengths: Vec<f64> =
                Composition::of_order(6).unwrap().gammas().iter().map(|gamma| gamma * h).collect();
            let (mut q, mut p, mut increments) = (1.0_f64, 0.3, Vec::new());
            for length in lengths.iter().cycle().take(count * lengths.len()) {
                p -= 0.5 * length * q.sin(); // Störmer & Verlet
                increments.push(length * p);
                q += length * p;
                p -= 0.5 * length * q.sin();
            }
            let mut weights = SubStepWeights::default();
            weights.find(lengths.iter().copied());
            (2 * lengths.len()..increments.len()).fold(0.0_f64, |most, n| {
                let [second, third] = weights.of(n % lengths.len()).unwrap();
                let parts = (0..NODES).map(|a| (second[a] + third[a]) * increments[n - 1 - a]);
                most.max((parts.sum::<f64>() - increments[n]).abs())
            })
        };
        let found = [10, 20, 40].map(missed);
        let order = (found[0] / found[2]).log2() / 2.0;
        println!("missed by {found:?}, order {order:.2}");
        assert!(order > 4.7 && found[0] < 1e-6, "{found:?}");
    }
}
