//! `--vary` and `--shard`: every point of a plan has a value for every key.

use super::{Answer, FuzzTarget, Worker, lines};
use crate::fuzz::mutate;
use crate::soak::draw::Draw;
use holonom::sweep::{Plan, PointSampling, Shard, Variation};

/// Sweeps.
#[derive(Clone, Copy, Debug)]
pub struct SweepPlans;

impl FuzzTarget for SweepPlans {
    fn name(&self) -> &'static str {
        "sweep"
    }

    fn executions(&self) -> u64 {
        2_000_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        lines("tests/corpus/sweep")
    }

    fn mutate(&self, input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
        let mutated = mutate::bytes(input, other, draw);
        match draw.chance(0.2) {
            true => [&mutated, b"\n".as_slice(), other].concat(),
            false => mutated,
        }
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(Planner)
    }
}

struct Planner;

impl Worker for Planner {
    fn execute(&mut self, input: &[u8]) -> Answer {
        planned(input, 0)
    }

    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        planned(input, 1)
    }
}

/// `more`: points too many.
fn planned(input: &[u8], more: usize) -> Answer {
    let text = String::from_utf8_lossy(input);
    if let Ok(shard) = text.parse::<Shard>() {
        let right = (1..=shard.of).contains(&shard.number);
        return if right { Answer::Accepted } else { Answer::Wrong("accepted: no shard".into()) };
    }
    let variations: Vec<Variation> = match text.lines().take(4).map(str::parse).collect() {
        Ok(variations) => variations,
        Err(words) => return Answer::Refused(words),
    };
    let sampling = PointSampling::ALL[input.len() % 4];
    let plan = match Plan::samples(variations, sampling, 1 + input.len(), 7) {
        Ok(plan) => plan,
        Err(error) => return Answer::Refused(error.help),
    };
    let values = plan.values();
    let keys = plan.variations.len();
    let whole = values.iter().all(|point| point.len() == keys);
    match values.len() == plan.points + more && whole {
        true => Answer::Accepted,
        false => Answer::Wrong(format!("accepted: {} of {} points", values.len(), plan.points)),
    }
}
