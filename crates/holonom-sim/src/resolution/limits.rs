//! What the elements of beams can bear: the angle between their nodes, and the step against the
//! highest frequency.

use super::unstable_steps::UnstableSteps;
use crate::resolution::{longest_part, resolved_by};
use crate::run::outcome::twelve_digits;
use crate::run::run_state::Bent;
use crate::system::beams::{BeamParts, Beams};
use holonom_model::{Family, Settings, Strain};
use serde::{Deserialize, Serialize};
use vi_beam::frequency::highest_frequency;
use vi_statics::limit::{BendingBounds, angle_between};

/// The stiffest element of all beams, against the step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stiffness {
    /// The beam.
    pub beam: String,
    /// The element, counted along the beam.
    pub element: usize,
    /// A bound of the highest frequency, rad/s.
    pub omega_max: f64,
    /// `h ω_max`, with the longest sub-step of a composition.
    pub h_omega_max: f64,
    /// Steps that are unstable; `None` where none was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unstable: Option<UnstableSteps>,
}

impl Stiffness {
    /// Of the beams in their stress-free configuration `q`; `None` without beams.
    pub(crate) fn new(beams: &Beams, q: &[f64], settings: &Settings) -> Option<Self> {
        let longest = longest_part(settings);
        let mut worst: Option<Self> = None;
        for beam in &beams.list {
            let mut first = 0;
            for leg in &beam.legs {
                let found = highest_frequency(&beams.parts, leg, q);
                if worst.as_ref().is_none_or(|worst| found.omega > worst.omega_max) {
                    worst = Some(Self {
                        beam: beam.name.clone(),
                        element: first + found.element,
                        omega_max: found.omega,
                        h_omega_max: settings.step * longest * found.omega,
                        unstable: None,
                    });
                }
                first += leg.elements.len();
            }
        }
        worst
    }

    /// Whether the step resolves all vibrations.
    pub(crate) fn is_resolved(&self, settings: &Settings) -> bool {
        self.h_omega_max <= resolved_by(settings)
    }

    /// Warnings on vibrations that the step does not resolve: of composed steps, and of discrete
    /// potentials that let them grow (docs/stability.md).
    pub(crate) fn warning(&self, settings: &Settings) -> Option<String> {
        let Self { beam, element, omega_max, h_omega_max, unstable } = self;
        let place = format!("ω_max ≤ {omega_max:.4e} rad/s in element {element} of beam `{beam}`");
        let smaller = (h_omega_max / resolved_by(settings)).ceil();
        let order = settings.order;
        if self.is_resolved(settings) {
            None
        } else if settings.method().stages().is_some() {
            Some(format!(
                "h ω_max = {h_omega_max:.3} ({place}): vibrations that the step does not resolve can grow without bound \
                 in a Galerkin scheme, unless material damping takes them out; write a step {smaller:.0} times smaller, \
                 fewer elements, `damping` in the section of the beam, or order = 2"
            ))
        } else if let Some(unstable) = unstable {
            Some(format!("h ω_max = {h_omega_max:.3} ({place}): {}", unstable.warning()))
        } else if order > 2 {
            Some(format!(
                "h ω_max = {h_omega_max:.3} (longest sub-step of order {order}, {place}): stiff vibrations are not \
                 resolved, so the order falls and the energy may drift; write a step {smaller:.0} times smaller, \
                 fewer elements, or order = 2"
            ))
        } else if matches!(settings.strain, Strain::Averaged | Strain::Midpoint)
            && matches!(settings.scheme.family(), Family::Variational(_))
        {
            Some(format!(
                "h ω_max = {h_omega_max:.3} ({place}): vibrations that the step does not resolve can grow without \
                 bound with this discrete potential; write strain = \"mass_scaled\", scheme = \"em-nodal\", or a \
                 step {smaller:.0} times smaller"
            ))
        } else {
            None
        }
    }
}

/// An element that is bent too far to mean anything.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FoldedElement<'a> {
    pub(crate) beam: &'a str,
    pub(crate) element: usize,
    pub(crate) angle: f64, // rad  between its nodes
    pub(crate) bounds: BendingBounds,
}

/// The elements of one beam, and how far they were bent.
#[derive(Clone, Debug)]
struct WatchedBeam {
    beam: String,
    pairs: Vec<(usize, [usize; 2])>,
    bounds: BendingBounds,
    bent: Bent,
}

/// Looks at the angle between neighbouring nodes along a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct LimitWatch {
    beams: Vec<WatchedBeam>,
}

impl LimitWatch {
    pub(crate) fn new(beams: &Beams) -> Self {
        let watched = |beam: &BeamParts| WatchedBeam {
            beam: beam.name.clone(),
            pairs: beams.pairs(beam).collect(),
            bounds: beam.bounds(),
            bent: Bent::default(),
        };
        Self { beams: beams.list.iter().map(watched).collect() }
    }

    /// Takes up the configuration `q` at `t`; allocates nothing.
    ///
    /// # Errors
    /// The first element that is bent too far to mean anything.
    pub(crate) fn follow(&mut self, t: f64, q: &[f64]) -> Result<(), FoldedElement<'_>> {
        for watched in &mut self.beams {
            for &(element, pair) in &watched.pairs {
                let angle = angle_between(pair, q);
                let (bent, bounds) = (&mut watched.bent, watched.bounds);
                if angle > bent.largest.1 {
                    bent.largest = (element, angle, t);
                    if angle > bounds.warn {
                        bent.first.get_or_insert((element, t));
                    }
                    if angle > bounds.stop {
                        return Err(FoldedElement { beam: &watched.beam, element, angle, bounds });
                    }
                }
            }
        }
        Ok(())
    }

    /// Begins anew: what was found so far has been reported.
    pub(crate) fn begin(&mut self) {
        self.beams.iter_mut().for_each(|watched| watched.bent.first = None);
    }

    /// What was found, of each beam.
    pub(crate) fn state(&self) -> Vec<Bent> {
        self.beams.iter().map(|watched| watched.bent).collect()
    }

    /// Continues from what was found; one entry for each beam.
    pub(crate) fn resume(&mut self, state: &[Bent]) {
        self.beams.iter_mut().zip(state).for_each(|(watched, bent)| watched.bent = *bent);
    }

    /// Warnings on the configurations since.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let warning = |watched: &WatchedBeam| {
            let (first, begin) = watched.bent.first?;
            let (element, angle, t) = watched.bent.largest;
            let (begin, t) = (twelve_digits(begin), twelve_digits(t));
            let warn = watched.bounds.warn.to_degrees();
            let consequence = watched.bounds.consequence(watched.bounds.warn.next_up())?;
            Some(format!(
                "beam `{}`: element {first} is bent by more than {warn:.0}° between its nodes at t = {begin} s, element \
                 {element} by {:.1}° at t = {t} s; {consequence}: write more elements",
                watched.beam,
                angle.to_degrees()
            ))
        };
        self.beams.iter().filter_map(warning).collect()
    }
}
