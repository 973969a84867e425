//! Cases of kind `identification`: estimates, standard errors and sums of squares; combinations of
//! parameters that the data do not see.

use super::case::{Deviation, Runs, raise};
use super::control_case::{number, numbers};
use super::identification_case::Unknown;
use serde_json::Value;
use vi_control::least_squares::{FitOutcome, LeastSquares};

/// What a field may be called.
const FIELDS: [&str; 23] = [
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
    "controls",
    "h",
    "steps",
    "initial",
    "parameters",
    "objective",
    "measurements",
    "data_step",
    "units",
    "results",
    "tolerance",
    "checked_by",
];

/// Measurements of a mechanism with unknown parameters.
pub struct IdentificationCase(Value);

impl IdentificationCase {
    pub fn read(value: Value) -> Result<Self, String> {
        let fields = value.as_object().ok_or("is no object")?;
        if let Some(odd) = fields.keys().find(|key| !FIELDS.contains(&key.as_str())) {
            return Err(format!("does not fit its kind `identification`: unknown field `{odd}`"));
        }
        Ok(Self(value))
    }

    pub fn run(&self) -> Result<Runs, String> {
        let results = &self.0["results"];
        let deviation = if results.get("rank").is_some() { self.unseen() } else { self.estimate() };
        Ok(vec![("nodal", deviation?)])
    }

    fn estimate(&self) -> Result<Deviation, String> {
        let (results, tolerance) = (&self.0["results"], &self.0["tolerance"]);
        let unknown = Unknown(self.0.clone());
        let parameters = unknown.parameters();
        let fit = unknown.fit(&LeastSquares::default(), &parameters).map_err(|e| e.to_string())?;
        if fit.outcome != FitOutcome::Converged {
            return Err(format!("the fit ended as {:?}", fit.outcome));
        }
        let errors = fit.standard_errors().ok_or("a combination is not seen")?;
        let mut deviation = Deviation::default();
        let off = |found: &[f64], key: &str, worst: &mut f64| {
            let tolerance = number(&tolerance[format!("{key}_relative")]);
            for (found, wanted) in found.iter().zip(numbers(&results[key])) {
                raise(worst, (found / wanted - 1.0).abs() / tolerance);
            }
        };
        off(&fit.parameters, "estimate", &mut deviation.q);
        off(&errors, "standard_error", &mut deviation.p);
        let sum = fit.half_sum_of_squares - number(&results["half_sum_of_squares"]);
        raise(&mut deviation.energy, sum.abs() / number(&tolerance["half_sum_of_squares"]));
        Ok(deviation)
    }

    /// The combination that is not seen where the case looks.
    fn unseen(&self) -> Result<Deviation, String> {
        let results = &self.0["results"];
        let unknown = Unknown(self.0.clone());
        let mut parameters = unknown.parameters();
        for (own, at) in parameters.iter_mut().zip(numbers(&results["at"])) {
            (own.start, own.scale) = (at, at.abs());
        }
        let fit = unknown.fit(&LeastSquares { max_iterations: 0 }, &parameters);
        let fit = fit.map_err(|e| e.to_string())?;
        let wanted = numbers(&results["null_direction_relative"]);
        let [found] = &fit.unseen[..] else {
            return Err(format!("{} combinations are not seen", fit.unseen.len()));
        };
        let along: f64 = found.direction.iter().zip(&wanted).map(|(a, b)| a * b).sum();
        let mut deviation = Deviation::default();
        for (found, wanted) in found.direction.iter().zip(&wanted) {
            let off = (found - along.signum() * wanted).abs();
            raise(&mut deviation.q, off / number(&self.0["tolerance"]["direction"]));
        }
        Ok(deviation)
    }
}
