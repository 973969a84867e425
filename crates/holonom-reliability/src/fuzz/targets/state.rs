//! The state in a checkpoint: lists of other lengths are refused, other numbers give a run that
//! ends in words or with finite numbers. One simulation continues from all of them: what it did
//! before must have no influence.

use super::sample_run::{small_model, state};
use super::{Answer, FuzzTarget, Worker};
use crate::fuzz::mutate;
use crate::soak::draw::Draw;
use crate::soak::judge::continued;
use holonom::{Model, RunState, Simulation};

/// States.
#[derive(Clone, Copy, Debug)]
pub struct StoredState;

impl FuzzTarget for StoredState {
    fn name(&self) -> &'static str {
        "state"
    }

    fn executions(&self) -> u64 {
        100_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let all = || -> Result<Vec<Vec<u8>>, String> {
            let model = small_model()?;
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
        Box::new(Continuer { model: small_model(), simulation: None, calls: 0 })
    }
}

/// One of so many states is continued by a new simulation, too; the first is the second seed. Few
/// changed states are accepted, and a seed continues to the same end from any node.
const COMPARED: u64 = 17;

struct Continuer {
    model: Result<Model, String>,
    /// The simulation that continues; none after a panic.
    simulation: Option<Simulation>,
    calls: u64,
}

impl Worker for Continuer {
    fn execute(&mut self, input: &[u8]) -> Answer {
        self.answer(input, false)
    }

    /// As if a state were not taken up.
    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        self.answer(input, true)
    }
}

impl Continuer {
    fn answer(&mut self, input: &[u8], unchecked: bool) -> Answer {
        self.calls += 1;
        let state: RunState = match serde_json::from_slice(input) {
            Ok(state) => state,
            Err(error) => return Answer::Refused(format!("no state: {error}")),
        };
        self.continued(state, unchecked).unwrap_or_else(Answer::Wrong)
    }

    /// The answer to a state, or what is wrong.
    fn continued(&mut self, state: RunState, unchecked: bool) -> Result<Answer, String> {
        let model = self.model.as_ref().map_err(Clone::clone)?;
        let new = || Simulation::new(model).map_err(|error| error.to_string());
        let mut simulation = self.simulation.take().map_or_else(new, Ok)?;
        let steps = model.settings.steps();
        let compared = (self.calls % COMPARED == 2).then(|| state.clone());
        let taken = if unchecked { simulation.state() } else { state };
        let answer = judged(&mut simulation, taken, steps);
        if let Some(state) = compared {
            let mut other = new()?;
            let again = judged(&mut other, state, steps);
            let states = [&simulation, &other].map(|run| format!("{:?}", run.state()));
            if again != answer || (answer == Answer::Accepted && states[0] != states[1]) {
                return Err(format!("accepted: after others {answer:?}, alone {again:?}"));
            }
        }
        self.simulation = Some(simulation);
        Ok(answer)
    }
}

/// The answer of a simulation.
fn judged(simulation: &mut Simulation, state: RunState, steps: u64) -> Answer {
    match continued(simulation, state, steps) {
        Ok(Ok(())) => Answer::Accepted,
        Ok(Err(words)) => Answer::Refused(words),
        Err(fault) => Answer::Wrong(format!("accepted: {}", fault.words)),
    }
}
