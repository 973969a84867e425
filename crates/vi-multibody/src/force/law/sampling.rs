//! How held values change with what is read at the node where they are sampled.
//!
//! ```text
//! z⁺ = S(t, y, z⁻; θ)      δz⁺ = S_y δy + S_z δz⁻ + S_θ δθ                               [2.70]
//! ```
//! `z`: internal variables of signals before and after a node, `y`: what its laws read there.

/// What a number changes with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seed {
    /// An input `y`.
    Input(usize),
    /// An internal variable `z⁻`.
    Internal(usize),
    /// A parameter.
    Parameter(usize),
}

/// A change in proportion to others: a row of `(S_y, S_z, S_θ)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change(Vec<(Seed, f64)>);

impl Change {
    /// The change of one of them.
    #[must_use]
    pub fn of(seed: Seed) -> Self {
        Self(vec![(seed, 1.0)])
    }

    /// Adds `scale` times another.
    pub fn add(&mut self, other: &Self, scale: f64) {
        other.0.iter().for_each(|(seed, slope)| self.add_to(*seed, scale * slope));
    }

    /// Adds to what it is by one of them.
    pub fn add_to(&mut self, seed: Seed, slope: f64) {
        if slope == 0.0 {
            return;
        }
        match self.0.iter_mut().find(|own| own.0 == seed) {
            Some((_, own)) => *own += slope,
            None => self.0.push((seed, slope)),
        }
    }

    /// What it is by each of them.
    pub fn slopes(&self) -> impl Iterator<Item = (Seed, f64)> + '_ {
        self.0.iter().copied()
    }

    /// Its size where what it depends on changes by this.
    #[must_use]
    pub fn along(&self, change: impl Fn(Seed) -> f64) -> f64 {
        self.0.iter().map(|(seed, slope)| slope * change(*seed)).sum()
    }
}

/// How what is sampled changes with a parameter by itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampledChange {
    /// The parameter.
    pub parameter: usize,
    /// The expression that is sampled.
    pub of: f64,
    /// What a controller adds to its output.
    pub ahead: f64,
    /// Numbers of a controller, in an order of its own; empty where none changes.
    pub numbers: Vec<f64>,
}

/// The changes by all parameters of what is sampled into the held value of this place, where the
/// internal variables of signals are these.
pub type ByParameters<'a> = dyn Fn(usize, &[f64]) -> Vec<SampledChange> + 'a;
