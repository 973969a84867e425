//! Models that are read: set-up and up to three steps.

use super::model::{mixed, read, seeds};
use super::{Answer, FuzzTarget, Worker, files};
use crate::fuzz::mutate;
use crate::soak::draw::Draw;
use crate::soak::judge::{Ending, outcome};
use holonom::Model;

/// Small models that are read.
#[derive(Clone, Copy, Debug)]
pub struct Assembly;

impl FuzzTarget for Assembly {
    fn name(&self) -> &'static str {
        "assembly"
    }

    fn executions(&self) -> u64 {
        500_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        [seeds(), files("tests/corpus/assembly", 8000)].concat()
    }

    fn mutate(&self, input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
        match draw.chance(0.3) {
            true => mutate::numbers(input, draw),
            false => mixed(input, other, draw),
        }
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(AssemblyWorker)
    }
}

/// Whether a model is small enough for many executions.
fn is_small(model: &Model) -> bool {
    let elements: usize = model.beams.iter().map(holonom::model::Beam::element_count).sum();
    let parts = model.bodies.len() + model.particles.len() + model.joints.len() + model.bars.len();
    let more = model.springs.len() + model.loads.len() + model.constraints.len();
    elements <= 12 && parts <= 24 && more <= 24
}

/// Steps that are taken: one where there are many coordinates, since each costs the cube of their
/// number.
fn steps(model: &Model) -> f64 {
    let nodes = |beam: &holonom::model::Beam| beam.node_count();
    let frames = model.bodies.len() + model.beams.iter().map(nodes).sum::<usize>();
    if 12 * frames + 3 * model.particles.len() > 60 { 1.0 } else { 3.0 }
}

struct AssemblyWorker;

impl Worker for AssemblyWorker {
    fn execute(&mut self, input: &[u8]) -> Answer {
        stepped(input, false)
    }

    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        stepped(input, true)
    }
}

fn stepped(input: &[u8], unchecked: bool) -> Answer {
    let Ok(text) = std::str::from_utf8(input) else { return Answer::Refused("no text".into()) };
    let mut model = match read(text) {
        Ok(model) => model,
        Err(error) => return super::model::refused(&error, text),
    };
    if !is_small(&model) {
        return Answer::Refused("too large for many executions".into());
    }
    let steps = steps(&model);
    let settings = &mut model.settings;
    settings.end = settings.end.min(steps * settings.step);
    settings.newton_max_iterations = settings.newton_max_iterations.min(30);
    match outcome(&model, unchecked) {
        Err(fault) => Answer::Wrong(format!("accepted: {}", fault.words)),
        Ok(Ending::Done) => Answer::Accepted,
        Ok(Ending::Refused(words) | Ending::Failed(words)) => Answer::Refused(words),
    }
}
