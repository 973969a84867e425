//! Bounds of the tension for a motion that begins without tension: what to state where one that
//! follows the tension does not suffice.
//!
//! The motion is tried from its start with the bound of an extension by [`STRAIN`], then with twice
//! the largest tension on the way; a bound with which a step is not found, or which a tension
//! exceeds, is doubled.

#![allow(non_snake_case)] // C

use super::Simulation;
use crate::system::beams::Beams;
use holonom_model::Model;
use vi_beam::ElementKind;

/// Steps up to which a motion is tried again, and the fewest and the most that are tried.
const FIRST_STEPS: u64 = 200;
const TRIED: [u64; 2] = [50, 400];
/// Extension of the first bound.
const STRAIN: f64 = 0.05;
/// Bounds that are tried.
const BOUNDS: u32 = 8;
/// Strain of a tension that bending does not hold: `Nℓ² > 6 EI` at it.
const TAUT: f64 = 1e-3;
const HELD_BY_BENDING: f64 = 6.0;

/// The slender beams of a model whose bounds follow their tension.
pub(super) struct TautBeams {
    model: Model,
    own: Vec<(usize, f64)>, // which beam, EA in N
}

impl TautBeams {
    /// Of a model; `None` where it has none.
    pub(super) fn of(model: &Model, beams: &Beams) -> Option<Self> {
        let elements = &beams.parts.elements;
        let all = model.beams.iter().zip(&beams.list).enumerate();
        let own = all.filter_map(|(k, (beam, parts))| {
            let follows = beam.tension.is_none() && parts.kind != ElementKind::MeanDirectors;
            let own = parts.legs.iter().flat_map(|leg| &elements.list()[leg.elements.clone()]);
            let stiffness = own.filter_map(|element| {
                let C = elements.section(element).stiffness();
                let (extension, bending) = (C[2], C[3].min(C[4]));
                let taut = TAUT * extension * element.length * element.length;
                (taut > HELD_BY_BENDING * bending).then_some(extension)
            });
            let largest = stiffness.fold(0.0, f64::max);
            (follows && largest > 0.0).then_some((k, largest))
        });
        let own: Vec<(usize, f64)> = own.collect();
        (!own.is_empty()).then(|| Self { model: model.clone(), own })
    }

    /// What to state where the step of this number is not found; nothing behind the first steps.
    pub(super) fn remedy(&self, step: u64) -> String {
        if step > FIRST_STEPS {
            return String::new();
        }
        let stated = |bounds: &[f64]| {
            let each = self.own.iter().zip(bounds);
            let each = each.map(|((k, _), bound)| {
                format!("`tension = {bound:?}` in [[beam]] `{}`", self.model.beams[*k].name)
            });
            each.collect::<Vec<_>>().join(" and ")
        };
        match self.suffices(step) {
            Some((bounds, steps)) => format!(
                "; the bound of the tension begins at its start and follows it too late here: with {} \
                 the first {steps} steps are taken",
                stated(&bounds)
            ),
            None => format!(
                "; the bound of the tension begins at its start: state the largest one to come, N, as `tension = …` in \
                 [[beam]] {}",
                self.names()
            ),
        }
    }

    fn names(&self) -> String {
        let names = self.own.iter().map(|(k, _)| format!("`{}`", self.model.beams[*k].name));
        names.collect::<Vec<_>>().join(", ")
    }

    /// Bounds, N, with which the motion is found beyond a step, and for how many steps.
    fn suffices(&self, step: u64) -> Option<(Vec<f64>, u64)> {
        let [least, most] = TRIED;
        let steps = (2 * step).clamp(least, most).min(self.model.settings.steps());
        let mut bounds: Vec<f64> = self.own.iter().map(|(_, ea)| STRAIN * ea).collect();
        let mut measured = false;
        for _ in 0..BOUNDS {
            let (taken, tensions) = self.tensions(&bounds, steps)?;
            let fits = tensions.iter().zip(&bounds).all(|(tension, bound)| tension <= bound);
            match (taken == steps && fits, measured) {
                (true, true) => return Some((bounds, steps)),
                (true, false) => {
                    let twice = tensions.iter().map(|tension| one_digit(2.0 * tension));
                    (bounds, measured) = (twice.collect(), true);
                }
                (false, _) => bounds.iter_mut().for_each(|bound| *bound = one_digit(2.0 * *bound)),
            }
        }
        None
    }

    /// How many steps are taken with bounds, and the largest tension of each beam on the way, N.
    fn tensions(&self, bounds: &[f64], steps: u64) -> Option<(u64, Vec<f64>)> {
        let mut model = self.model.clone();
        for ((k, _), bound) in self.own.iter().zip(bounds) {
            model.beams[*k].tension = Some(*bound);
        }
        let mut trial = Simulation::new(&model).ok()?;
        let mut largest = vec![0.0_f64; self.own.len()];
        for taken in 0..steps {
            if trial.stepper.step(1).is_err() {
                return Some((taken, largest));
            }
            let q = trial.stepper.place().2;
            for ((k, _), largest) in self.own.iter().zip(&mut largest) {
                let beam = &trial.beams.list[*k];
                trial.beams.for_each_state(beam, q, |state| *largest = largest.max(state.force[2]));
            }
        }
        Some((steps, largest))
    }
}

/// A warning of the energy with what these bounds may have to do with it.
pub(super) fn of_energy(warning: String, taut: Option<&TautBeams>) -> String {
    match taut {
        Some(taut) => {
            warning
                + "; where a beam becomes taut in a few steps, `tension = …` in [[beam]] "
                + &taut.names()
        }
        None => warning,
    }
}

/// The least number of one digit that is not below a positive one.
fn one_digit(x: f64) -> f64 {
    let mut unit = 1.0;
    while unit * 10.0 <= x {
        unit *= 10.0;
    }
    while unit > x && unit > 1e-6 {
        unit /= 10.0;
    }
    (x / unit).ceil() * unit
}

#[cfg(test)]
mod tests {
    use super::one_digit;

    #[test]
    fn bounds_are_stated_with_one_digit_and_never_below() {
        for (x, right) in [(1843.2, 2000.0), (0.31, 0.4), (5.0, 5.0), (9.2e5, 1e6)] {
            assert!((one_digit(x) / right - 1.0_f64).abs() < 1e-12, "{x}: {}", one_digit(x));
        }
    }
}
