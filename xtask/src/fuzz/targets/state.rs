//! The state in a checkpoint: lists of other lengths are refused, other numbers give a run that ends in words or with
//! finite numbers.

use super::sample_run::{model, state};
use super::{Answer, Target, Worker};
use crate::fuzz::mutate;
use crate::soak::draw::Draw;
use crate::soak::judge::continued;
use holonom::{Model, RunState};

/// States.
#[derive(Clone, Copy, Debug)]
pub struct StoredState;

impl Target for StoredState {
    fn name(&self) -> &'static str {
        "state"
    }

    fn executions(&self) -> u64 {
        100_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let all = || -> Result<Vec<Vec<u8>>, String> {
            let model = model()?;
            let text = |steps: &u64| {
                serde_json::to_vec(&state(&model, *steps)?).map_err(|error| error.to_string())
            };
            [0, 1, 3].iter().map(text).collect()
        };
        all().unwrap_or_default()
    }

    fn mutate(&self, input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
        match draw.chance(0.8) {
            true => mutate::numbers(input, draw),
            false => mutate::bytes(input, other, draw),
        }
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(Continuer { model: model().ok() })
    }
}

struct Continuer {
    model: Option<Model>,
}

impl Worker for Continuer {
    fn execute(&mut self, input: &[u8]) -> Answer {
        let Some(model) = &self.model else { return Answer::Wrong("no model".into()) };
        let state: RunState = match serde_json::from_slice(input) {
            Ok(state) => state,
            Err(error) => return Answer::Refused(format!("no state: {error}")),
        };
        match continued(model, state) {
            Ok(Ok(())) => Answer::Accepted,
            Ok(Err(words)) => Answer::Refused(words),
            Err(fault) => Answer::Wrong(format!("accepted: {}", fault.words)),
        }
    }
}
