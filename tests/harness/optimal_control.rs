//! Cases of kind `optimal_control`: each scheme repeats the motion of the stored controls, which
//! ends where it has to, at the stored cost. That a method finds these controls is tested in
//! `vi-control` with the feature `pounce`.

use super::case::{Deviation, Runs, distance, raise};
use super::control_case::{Case, list, number, numbers};
use std::sync::Arc;
use vi_constraints::SchemeKind;
use vi_control::Transcription;
use vi_control::program::Program;
use vi_control::transcription::Guess;

/// What a field may be called.
const FIELDS: [&str; 26] = [
    "name",
    "kind",
    "description",
    "gravity",
    "bodies",
    "joints",
    "cut_joints",
    "joint_springs",
    "joint_dampers",
    "springs",
    "efforts",
    "h",
    "steps",
    "initial",
    "objective",
    "terminal",
    "control_bounds",
    "coordinate_bounds",
    "free_time",
    "max_increment",
    "guess",
    "guess_coordinates",
    "units",
    "results",
    "tolerance",
    "checked_by",
];

/// Stored controls and nodes of an optimum.
pub struct OptimalControlCase(Case);

impl OptimalControlCase {
    pub fn read(value: serde_json::Value) -> Result<Self, String> {
        let fields = value.as_object().ok_or("is no object")?;
        let known = |key: &&String| FIELDS.contains(&key.as_str()) || *key == "active_bounds";
        if let Some(odd) = fields.keys().find(|key| !known(key)) {
            return Err(format!("does not fit its kind `optimal_control`: unknown field `{odd}`"));
        }
        Ok(Self(Case::of(value)))
    }

    pub fn run(&self) -> Result<Runs, String> {
        SchemeKind::ALL.into_iter().map(|kind| Ok((kind.name(), self.by(kind)?))).collect()
    }

    fn by(&self, scheme: SchemeKind) -> Result<Deviation, String> {
        let case = &self.0;
        let (results, mut deviation) = (&case.value["results"], Deviation::default());
        let tolerance = |key: &str| number(&case.value["tolerance"][key]);
        let controls: Vec<Vec<f64>> = list(results, "controls").iter().map(numbers).collect();
        let (steps, time) = (controls.len(), number(&results["time"]));
        let mut run = case.run(scheme, time / steps as f64);
        let mut nodes = vec![run.state().q.clone()];
        for (n, values) in controls.iter().enumerate() {
            case.efforts.iter().zip(values).for_each(|(effort, value)| effort.set(*value));
            run.step().map_err(|e| format!("step {n}: {e}"))?;
            nodes.push(run.state().q.clone());
        }
        for state in list(results, "states") {
            let node = usize::try_from(state["step"].as_u64().ok_or("a step")?);
            let own = node.ok().and_then(|n| nodes.get(n)).ok_or("a step beyond the last")?;
            let off = distance(own, &numbers(&state["q"])) / tolerance("states");
            raise(&mut deviation.q, off);
        }
        let off = (self.cost(&controls)? - number(&results["cost"])).abs() / tolerance("cost");
        raise(&mut deviation.energy, off);
        Ok(deviation)
    }

    /// The cost of controls, by the program of the problem.
    fn cost(&self, controls: &[Vec<f64>]) -> Result<f64, String> {
        let case = &self.0;
        let (mut problem, guess) = case.problem(controls.len());
        let time = number(&case.value["results"]["time"]);
        problem.time = vi_control::transcription::problem::FinalTime::Fixed(time);
        let guess = Guess { controls: controls.to_vec(), ..guess };
        let (system, at) = (Arc::new(case.system()), case.initial());
        let program = Transcription::new(&case.mechanism, system, at, problem, &guess);
        let mut program = program.map_err(|e| e.to_string())?;
        let start = program.start().x;
        program.move_to(&start).map_err(|e| e.to_string())?;
        Ok(program.cost())
    }
}
