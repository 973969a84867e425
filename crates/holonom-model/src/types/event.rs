//! `[[event]]`: changes of the mechanism along a run.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where an event acts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Locate {
    /// Where its condition becomes true: the step is divided there.
    #[default]
    Root,
    /// At the end of the step in which its condition becomes true: of first order in the step.
    Step,
}

/// `[[event]]`: changes the mechanism when a condition becomes true, or at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Event {
    /// Its name, unique in the model.
    pub name: String,
    /// The condition, comparisons by `<` and `>` joined by `and` and `or`, of `t`, joints (`knee`,
    /// `knee.rate`; `knee.1` of its second degree of freedom), bodies, nodes and particles in space
    /// (`arm.x` to `arm.z`, `arm.vx` to `arm.vz`, `arm.wx` to `arm.wz`), sensors (`tip.x`). It acts
    /// when this becomes true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<String>,
    /// The time at which it acts, s, in the place of a condition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// Joints, bars, constraints, springs, bushings and laws that vanish; with a joint all that
    /// acts along it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub release: Vec<String>,
    /// Joint coordinates that are held where they are, `elbow`, or `elbow.1`: a plastic impact.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lock: Vec<String>,
    /// New values of signals with `start` alone.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub set: BTreeMap<String, f64>,
    /// Laws, loads and motors, by the name of their joint, that act again.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub enable: Vec<String>,
    /// Laws, loads and motors, by the name of their joint, that cease to act.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub disable: Vec<String>,
    /// The run ends here.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub end: bool,
    /// It acts once; else whenever its condition becomes true again.
    #[serde(default = "yes")]
    pub once: bool,
    /// Where it acts: where its condition becomes true, to round-off, or at the end of that step.
    #[serde(default)]
    pub locate: Locate,
}

fn yes() -> bool {
    true
}

/// A joint coordinate by its name: `elbow`, or `elbow.1` for its second degree of freedom.
#[must_use]
pub fn coordinate_of(name: &str) -> (&str, usize) {
    let parts = name.rsplit_once('.').and_then(|(joint, k)| Some((joint, k.parse().ok()?)));
    parts.unwrap_or((name, 0))
}

impl Event {
    /// What it does, in the order in which it is listed: an action and the part it is done to.
    pub fn actions(&self) -> impl Iterator<Item = (&'static str, &str)> {
        fn of<'a>(action: &'static str, names: &'a [String]) -> Vec<(&'static str, &'a str)> {
            names.iter().map(|name| (action, name.as_str())).collect()
        }
        let mut all = of("release", &self.release);
        all.extend(of("lock", &self.lock));
        all.extend(self.set.keys().map(|name| ("set", name.as_str())));
        all.extend(of("enable", &self.enable));
        all.extend(of("disable", &self.disable));
        all.extend(self.end.then_some(("end", "")));
        all.into_iter()
    }
}
