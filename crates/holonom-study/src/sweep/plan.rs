//! Which values the keys of a model take at the points of a sweep.

use holonom_model::Override;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Most points of a sweep.
const MOST: usize = 1_000_000;
/// Most keys of a Sobol sequence.
const SOBOL_KEYS: usize = 256;

/// The values of a key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Values {
    /// These, as a model file writes them.
    List(Vec<String>),
    /// Between two numbers.
    Range {
        /// The first.
        from: f64,
        /// The last.
        to: f64,
    },
}

/// A key of a model with its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variation {
    /// The key, such as `body.top.mass`.
    pub key: String,
    /// Its values.
    pub values: Values,
}

/// How points are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PointSampling {
    /// Every combination of the listed values; the last key varies first.
    #[default]
    Grid,
    /// Independent and uniform.
    Random,
    /// A Latin hypercube: one point in each of `n` equal parts of the range of each key.
    Latin,
    /// A scrambled Sobol sequence (B. Burley, JCGT 9, 2020).
    Sobol,
}

impl PointSampling {
    /// All.
    pub const ALL: [Self; 4] = [Self::Grid, Self::Random, Self::Latin, Self::Sobol];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::Random => "random",
            Self::Latin => "latin",
            Self::Sobol => "sobol",
        }
    }
}

/// Why there is no such sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanError {
    /// What is wrong.
    pub message: String,
    /// What to write instead.
    pub help: String,
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for PlanError {}

fn refused<T>(message: impl Into<String>, help: &str) -> Result<T, PlanError> {
    Err(PlanError { message: message.into(), help: help.into() })
}

impl FromStr for Variation {
    type Err = String;

    /// `KEY=A:B:N`, `KEY=A:B` or `KEY=V1,V2,…`.
    fn from_str(text: &str) -> Result<Self, String> {
        const HELP: &str =
            "write KEY=A:B:N (N values from A to B), KEY=V1,V2,… or, with --sample, KEY=A:B";
        let (key, values) = text.split_once('=').ok_or(HELP)?;
        let (key, values) = (key.trim(), values.trim());
        if key.is_empty() || values.is_empty() {
            return Err(HELP.to_owned());
        }
        let parts: Vec<&str> = values.split(':').map(str::trim).collect();
        let number = |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite());
        let values = match *parts.as_slice() {
            [from, to] if number(from).is_some() => {
                let (Some(from), Some(to)) = (number(from), number(to)) else {
                    return Err(HELP.to_owned());
                };
                Values::Range { from, to }
            }
            [from, to, count] if number(from).is_some() => {
                let count: usize = count.parse().map_err(|_| HELP)?;
                let (Some(a), Some(b)) = (number(from), number(to)) else {
                    return Err(HELP.to_owned());
                };
                if !(2..=MOST).contains(&count) {
                    return Err(format!("from A to B there are 2 to {MOST} values"));
                }
                let at = |k: usize| a + (b - a) * k as f64 / (count - 1) as f64;
                let values: Vec<f64> =
                    (0..count).map(|k| if k + 1 == count { b } else { at(k) }).collect();
                let whole = [from, to].iter().all(|text| text.parse::<i64>().is_ok())
                    && values.iter().all(|x| x.fract() == 0.0);
                let written = |x: &f64| if whole { format!("{x:.0}") } else { short(*x) };
                Values::List(values.iter().map(written).collect())
            }
            _ => Values::List(split(values)),
        };
        Ok(Self { key: key.to_owned(), values })
    }
}

/// Parts between commas that stand in no bracket and no quotation.
fn split(list: &str) -> Vec<String> {
    let (mut parts, mut depth, mut quoted) = (vec![String::new()], 0_i32, false);
    for c in list.chars() {
        match c {
            '"' => quoted = !quoted,
            '[' | '{' if !quoted => depth += 1,
            ']' | '}' if !quoted => depth -= 1,
            ',' if !quoted && depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = parts.last_mut() {
            last.push(c);
        }
    }
    parts.iter().map(|part| part.trim().to_owned()).collect()
}

/// A number without the rounding of its computation: with 15 digits.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.14e}").parse().unwrap_or(x);
    format!("{rounded:?}")
}

/// All points of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Keys with their values.
    pub variations: Vec<Variation>,
    /// How points are chosen.
    pub sampling: PointSampling,
    /// How many there are.
    pub points: usize,
    /// Seed of random points.
    pub seed: u64,
}

impl Plan {
    /// A grid of all listed values.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn grid(variations: Vec<Variation>) -> Result<Self, PlanError> {
        let mut points = 1_usize;
        for variation in &variations {
            let Values::List(values) = &variation.values else {
                return refused(
                    format!("`{}` has a range without a number of values", variation.key),
                    "write KEY=A:B:N, or --sample random, latin or sobol with -n",
                );
            };
            points = points.saturating_mul(values.len());
        }
        Self { variations, sampling: PointSampling::Grid, points, seed: 0 }.checked()
    }

    /// `points` samples; of a list each value is as likely as the others.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn samples(
        variations: Vec<Variation>,
        sampling: PointSampling,
        points: usize,
        seed: u64,
    ) -> Result<Self, PlanError> {
        if sampling == PointSampling::Grid {
            return Self::grid(variations);
        }
        if sampling == PointSampling::Sobol && (variations.len() > SOBOL_KEYS || points > 1 << 16) {
            return refused(
                format!("a Sobol sequence has at most {SOBOL_KEYS} keys and {} points", 1 << 16),
                "write --sample latin",
            );
        }
        Self { variations, sampling, points, seed }.checked()
    }

    fn checked(self) -> Result<Self, PlanError> {
        if self.variations.is_empty() {
            return refused("nothing is varied", "write --vary KEY=A:B:N");
        }
        for (k, variation) in self.variations.iter().enumerate() {
            if self.variations[..k].iter().any(|other| other.key == variation.key) {
                return refused(
                    format!("`{}` is varied twice", variation.key),
                    "write one --vary for it",
                );
            }
        }
        if self.points == 0 || self.points > MOST {
            let message = format!("a sweep has 1 to {MOST} points, not {}", self.points);
            return refused(message, "write fewer values");
        }
        Ok(self)
    }

    /// The values of all points, in their order, as a model file writes them.
    #[must_use]
    pub fn values(&self) -> Vec<Vec<String>> {
        if self.sampling == PointSampling::Grid {
            return (0..self.points).map(|index| self.combination(index)).collect();
        }
        let columns: Vec<Vec<f64>> = (0..self.variations.len()).map(|k| self.column(k)).collect();
        let value = |variation: &Variation, x: f64| match &variation.values {
            Values::List(values) => {
                let place = (x * values.len() as f64) as usize;
                values[place.min(values.len() - 1)].clone()
            }
            Values::Range { from, to } => format!("{:?}", from + (to - from) * x),
        };
        let point = |index: usize| {
            let pairs = self.variations.iter().zip(&columns);
            pairs.map(|(variation, column)| value(variation, column[index])).collect()
        };
        (0..self.points).map(point).collect()
    }

    /// What is replaced at a point with these values.
    pub fn overrides(&self, values: &[String]) -> impl Iterator<Item = Override> {
        self.variations.iter().zip(values).map(|(varied, value)| Override::new(&varied.key, value))
    }

    /// The point of a grid: the last key varies first.
    fn combination(&self, index: usize) -> Vec<String> {
        let mut rest = index;
        let mut values: Vec<String> = self
            .variations
            .iter()
            .rev()
            .filter_map(|variation| match &variation.values {
                Values::List(values) => {
                    let value = values[rest % values.len()].clone();
                    rest /= values.len();
                    Some(value)
                }
                Values::Range { .. } => None,
            })
            .collect();
        values.reverse();
        values
    }

    /// Numbers in `[0, 1)` of one key for all points.
    fn column(&self, key: usize) -> Vec<f64> {
        let mut generator =
            Pcg64Mcg::seed_from_u64(self.seed ^ (key as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut uniform = || (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let n = self.points;
        match self.sampling {
            PointSampling::Sobol => {
                let seed = (self.seed ^ (self.seed >> 32)) as u32;
                let at = |index: usize| sobol_burley::sample(index as u32, key as u32, seed);
                (0..n).map(|index| f64::from(at(index))).collect()
            }
            PointSampling::Latin => {
                let mut parts: Vec<usize> = (0..n).collect();
                for k in (1..n).rev() {
                    parts.swap(k, (uniform() * (k + 1) as f64) as usize);
                }
                parts.iter().map(|part| (*part as f64 + uniform()) / n as f64).collect()
            }
            PointSampling::Random | PointSampling::Grid => (0..n).map(|_| uniform()).collect(),
        }
    }
}

/// Every `of`-th point, beginning with the `number`-th.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 1.
    pub number: usize,
    /// Of how many.
    pub of: usize,
}

impl Shard {
    /// All points.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Whether a point belongs to it.
    #[must_use]
    pub fn has(self, index: usize) -> bool {
        index % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let help = || "write i/n with 1 ≤ i ≤ n, such as 2/8".to_owned();
        let (number, of) = text.split_once('/').ok_or_else(help)?;
        let (number, of) = (number.parse().map_err(|_| help())?, of.parse().map_err(|_| help())?);
        if (1..=of).contains(&number) { Ok(Self { number, of }) } else { Err(help()) }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test
mod tests {
    use super::*;

    fn vary(text: &[&str]) -> Vec<Variation> {
        text.iter().map(|text| text.parse().unwrap()).collect()
    }

    #[test]
    fn a_grid_has_every_combination_once() {
        let plan = Plan::grid(vary(&["a=1:3:3", "b=0.5:1:2", "c=\"x,y\",[1, 2]"])).unwrap();
        let values = plan.values();
        assert_eq!((plan.points, values.len()), (12, 12));
        assert_eq!(values[0], ["1", "0.5", "\"x,y\""]);
        assert_eq!(values[1], ["1", "0.5", "[1, 2]"]);
        assert_eq!(values[11], ["3", "1.0", "[1, 2]"]);
        let mut sorted = values.clone();
        sorted.sort();
        sorted.dedup();
        assert_eq!(sorted.len(), 12);
    }

    #[test]
    fn samples_are_in_their_ranges_and_depend_on_the_seed_alone() {
        for sampling in [PointSampling::Random, PointSampling::Latin, PointSampling::Sobol] {
            let plan =
                |seed| Plan::samples(vary(&["a=-1:3", "b=1,2,3"]), sampling, 64, seed).unwrap();
            let values = plan(7).values();
            assert_eq!(values, plan(7).values());
            assert_ne!(values, plan(8).values());
            let numbers: Vec<f64> = values.iter().map(|point| point[0].parse().unwrap()).collect();
            assert!(numbers.iter().all(|x| (-1.0..3.0).contains(x)), "{numbers:?}");
            let mean = numbers.iter().sum::<f64>() / 64.0;
            println!("{}: mean {mean:.3}", sampling.name());
            assert!(
                (mean - 1.0).abs() < if sampling == PointSampling::Random { 0.5 } else { 0.05 }
            );
            assert!(["1", "2", "3"].iter().all(|v| values.iter().any(|point| point[1] == *v)));
            if sampling == PointSampling::Latin {
                let mut parts: Vec<usize> =
                    numbers.iter().map(|x| ((x + 1.0) * 16.0) as usize).collect();
                parts.sort_unstable();
                assert_eq!(parts, (0..64).collect::<Vec<_>>(), "one point in each part");
            }
        }
    }

    /// The largest correlation of two columns, in magnitude.
    fn correlation(columns: &[Vec<f64>]) -> f64 {
        let centred = |column: &Vec<f64>| -> Vec<f64> {
            let mean = column.iter().sum::<f64>() / column.len() as f64;
            column.iter().map(|x| x - mean).collect()
        };
        let columns: Vec<Vec<f64>> = columns.iter().map(centred).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut worst = 0.0_f64;
        for (k, a) in columns.iter().enumerate() {
            for b in &columns[..k] {
                worst = worst.max(dot(a, b).abs() / (dot(a, a) * dot(b, b)).sqrt());
            }
        }
        worst
    }

    /// Of 200 independent numbers the correlation has a standard deviation of 0.07.
    #[test]
    fn samples_of_different_keys_are_uncorrelated() {
        let keys = ["a=0:1", "b=0:1", "c=-2:3", "d=0:1", "e=0:1", "f=0:1", "g=0:1", "h=0:1"];
        for sampling in [PointSampling::Random, PointSampling::Latin, PointSampling::Sobol] {
            for seed in 0..4 {
                let plan = Plan::samples(vary(&keys), sampling, 200, seed).unwrap();
                let values = plan.values();
                let column = |k: usize| -> Vec<f64> {
                    values.iter().map(|point| point[k].parse().unwrap()).collect()
                };
                let columns: Vec<Vec<f64>> = (0..keys.len()).map(column).collect();
                let worst = correlation(&columns);
                println!("{}, seed {seed}: {worst:.3}", sampling.name());
                assert!(worst < 0.3, "{}, seed {seed}: {worst}", sampling.name());
                // the numbers of one key for all of them
                let same = vec![columns[0].clone(), columns[1].clone(), columns[0].clone()];
                assert!(correlation(&same) > 0.99);
            }
        }
    }

    #[test]
    fn shards_share_the_points() {
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"].map(|text| text.parse().unwrap()).into();
        for index in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.has(index)).count(), 1);
        }
        for wrong in ["0/3", "4/3", "1", "a/b"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_no_sweep_is_refused() {
        assert!(Plan::grid(vec![]).is_err());
        assert!(Plan::grid(vary(&["a=1:2"])).unwrap_err().help.contains("KEY=A:B:N"));
        assert!(Plan::grid(vary(&["a=1,2", "a=3"])).unwrap_err().message.contains("twice"));
        assert!(Plan::grid(vary(&["a=1:2:1000", "b=1:2:1000", "c=1,2"])).is_err());
        for wrong in ["a", "=1", "a=", "a=1:2:1", "a=1:x:3", "a=1:nan"] {
            assert!(wrong.parse::<Variation>().is_err(), "{wrong}");
        }
    }
}
