//! Cases of kind `identification`: runs for any parameters, with their tangents.
#![allow(clippy::unwrap_used)] // helpers of tests

use super::control_case::{Case, list, number, numbers};
use nalgebra::Matrix3;
use serde_json::Value;
use std::sync::Arc;
use vi_constraints::SchemeKind;
use vi_constraints::linearization::Tangent;
use vi_control::identification::{
    Experiment, Measurable, MeasuredReading, MeasuredSeries, MotionResiduals, TrialRun,
};
use vi_control::least_squares::{Estimate, FitError, LeastSquares, Parameter, Refused};
use vi_control::terminal_rate::NodeSources;
use vi_control::{ControlForce, Controls, Direction, JointControl};
use vi_core::{MechanicalSystem, Quadrature};
use vi_multibody::design::start::{StartCoordinate, derivatives};
use vi_multibody::design::{BodyTangent, EffortChange, MechanismDesign, MechanismTangent};
use vi_multibody::run::{IndependentLoops, Solver, integrator};

fn whole(value: &Value) -> usize {
    usize::try_from(value.as_u64().unwrap()).unwrap()
}

/// A case whose parameters are unknown.
#[derive(Debug)]
pub(crate) struct Unknown(pub(crate) Value);

impl Unknown {
    /// The case with other values of its parameters.
    fn with(&self, theta: &[f64]) -> Result<Case, String> {
        let mut value = self.0.clone();
        for (parameter, theta) in list(&self.0, "parameters").iter().zip(theta) {
            for set in list(parameter, "sets") {
                let factor = set.get("factor").map_or(1.0, number);
                let pointer = format!("/{}", set["path"].as_str().unwrap().replace('.', "/"));
                *value.pointer_mut(&pointer).unwrap() = (factor * theta).into();
            }
        }
        Case::try_of(value)
    }

    /// How the numbers of the mechanism change with a parameter.
    fn tangent(&self, parameter: &Value) -> MechanismTangent {
        let mut to = MechanismTangent::default();
        for set in list(parameter, "sets") {
            let rate = set.get("factor").map_or(1.0, number);
            let path = set["path"].as_str().unwrap();
            let parts: Vec<&str> = path.split('.').collect();
            let place = |text: &str| -> usize { text.parse().unwrap() };
            match parts[..] {
                ["bodies", body, "mass"] => {
                    to.bodies.entry(place(body)).or_default().mass += rate;
                }
                ["bodies", body, "principal_inertia", k] => {
                    let mut tensor = Matrix3::zeros();
                    tensor[(place(k), place(k))] = rate;
                    let euler = BodyTangent::of_inertia(0.0, &tensor).euler;
                    to.bodies.entry(place(body)).or_default().euler += euler;
                }
                ["joints", joint, side, k] => {
                    let own = to.joints.entry(place(joint)).or_default();
                    let own = match side {
                        "anchor_parent" => &mut own.parent,
                        "anchor_child" => &mut own.child,
                        _ => panic!("unknown path `{path}`"),
                    };
                    own.anchor[place(k)] += rate;
                }
                ["joint_springs", spring, key] => {
                    let own = &list(&self.0, "joint_springs")[place(spring)];
                    let by = if key == "stiffness" { [rate, 0.0] } else { [0.0, rate] };
                    let values = [number(&own["stiffness"]), number(&own["rest"])];
                    let at = (whole(&own["joint"]), whole(&own["freedom"]));
                    to.efforts.push(EffortChange::of_spring("", at, values, by));
                }
                ["joint_dampers", damper, "damping"] => {
                    let own = &list(&self.0, "joint_dampers")[place(damper)];
                    let (joint, freedom) = (whole(&own["joint"]), whole(&own["freedom"]));
                    let by = Arc::new(move |_: f64, _: f64, v: f64| -rate * v);
                    to.efforts.push(EffortChange { force: String::new(), joint, freedom, by });
                }
                _ => panic!("unknown path `{path}`"),
            }
        }
        to
    }

    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        let own = list(&self.0, "parameters").iter();
        own.map(|own| Parameter::new(own["name"].as_str().unwrap(), number(&own["start"])))
            .collect()
    }

    pub(crate) fn series(&self) -> Vec<MeasuredSeries> {
        let series = |(sensor, own): (usize, &Value)| MeasuredSeries {
            sensor,
            reading: MeasuredReading::Value,
            sigma: number(&own["sigma"]),
            steps: numbers(&own["steps"]),
            values: numbers(&own["values"]),
        };
        list(&self.0, "measurements").iter().enumerate().map(series).collect()
    }

    /// The parameters that fit best.
    pub(crate) fn fit(
        self,
        method: &LeastSquares,
        parameters: &[Parameter],
    ) -> Result<Estimate, FitError> {
        let series = self.series();
        let mut residuals = MotionResiduals::new(self, series).unwrap();
        method.fit(&mut residuals, parameters)
    }
}

impl Experiment for Unknown {
    fn begin(&mut self, theta: &[f64]) -> Result<TrialRun, Refused> {
        let refused = |error: &dyn std::fmt::Display| Refused(error.to_string());
        let mut case = self.with(theta).map_err(Refused)?;
        let own = Unknown(case.value.clone());
        let mut built = case.built();
        let mut forces: Vec<Box<dyn ControlForce>> = Vec::new();
        for (effort, held) in list(&case.value, "efforts").iter().zip(&case.efforts) {
            let freedom = effort.get("freedom").map_or(0, whole);
            let coordinate = built.mechanism.coordinate(whole(&effort["joint"]), freedom).unwrap();
            forces.push(Box::new(JointControl { effort: held.clone(), coordinate }));
        }
        let rows = list(&case.value, "controls").iter().map(numbers).collect();
        let controls = Controls::new(forces, rows, 1);
        let mut quantities = Vec::new();
        for series in list(&case.value, "measurements") {
            let freedom = series.get("freedom").map_or(0, whole);
            let joint = whole(&series["joint"]);
            let own = built.mechanism.coordinate(joint, freedom).unwrap();
            quantities.push(Measurable::Configuration(Box::new(own)));
        }
        let of_tree = StartCoordinate::of_tree(&built.mechanism);
        let given = case.value["initial"].get("independent");
        let chosen = match given {
            Some(given) => {
                let places = given.as_array().unwrap().iter().map(whole);
                places.map(|k| of_tree[k].2.clone()).collect()
            }
            None => of_tree.iter().map(|own| own.2.clone()).collect::<Vec<_>>(),
        };
        let tangents: Vec<MechanismTangent> =
            list(&case.value, "parameters").iter().map(|own_| own.tangent(own_)).collect();
        let system = built.system(Quadrature::Midpoint);
        let mass = system.mass().clone();
        let quadrature = Quadrature::Midpoint;
        let design =
            MechanismDesign::new(&built.mechanism, &built.forces, &mass, quadrature, &tangents);
        let design = design.map_err(|e| refused(&e))?;
        let rows =
            IndependentLoops::find(&built.mechanism, 0.0, &case.q).map_err(|e| refused(&e))?.rows;
        let at = case.initial();
        let start = derivatives(&built.mechanism, &mass, &rows, at, &chosen, &tangents);
        let start = start.map_err(|e| refused(&e))?;
        let direction = |(k, own): (usize, vi_multibody::design::start::StartTangent)| {
            let start = Tangent { q: own.q, p: own.p, z: Vec::new() };
            Direction { start, parameter: Some(k), ..Direction::default() }
        };
        let directions = start.parameters.into_iter().enumerate().map(direction).collect();
        let step = number(&case.value["h"]);
        let options = vi_constraints::Options::new(SchemeKind::Nodal, step);
        let run = integrator(built.mechanism, system, options, Solver::Auto, at);
        let run = run.map_err(|e| refused(&e))?;
        case.value = Value::Null;
        let design: Option<Box<dyn vi_constraints::design::Design>> = Some(Box::new(design));
        Ok(TrialRun {
            run,
            step,
            controls,
            design,
            directions,
            tangents,
            quantities,
            sources: NodeSources::default(),
            steps: usize::MAX,
        })
    }
}
