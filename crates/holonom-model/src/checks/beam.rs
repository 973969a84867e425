//! Checks of beams, and of names of their nodes.

use crate::checks::Checker;
use crate::text::problem::{nearest, some};
use crate::types::beam::{Beam, BeamElement};
use crate::types::settings::Strain;
use vi_beam::ElementKind;
use vi_constraints::OrderMethod;

impl Checker<'_> {
    pub(crate) fn beam(&mut self, key: &str, beam: &Beam) {
        if let Err(problem) = beam.meshes() {
            self.add(problem.below(key));
        }
        let varies = beam.stations.is_some();
        let numbers = match varies {
            false => beam.section.numbers().map_err(|problem| problem.below("section")),
            true => beam.mean_section(),
        };
        if let Err(problem) = numbers {
            if !varies {
                self.add(problem.below(key));
            }
        } else if numbers.is_ok_and(|own| beam.normal.is_none() && !own.is_isotropic()) {
            let message =
                "the section is not the same in all directions across the beam".to_owned();
            self.report(
                key,
                message,
                "add `normal = [x, y, z]`, the direction of its first axis d_1",
            );
        }
        self.element(key, beam);
        let kind = beam.element_kind(&self.model.settings);
        let shears = matches!(kind, ElementKind::MeanDirectors | ElementKind::SecondOrder);
        if shears && beam.lacks_shear() {
            let message = "the section lacks GA1, GA2, and these elements shear".to_owned();
            let help = "state them, or write element = \"helicoidal\", which need not shear";
            self.report(format!("{key}.section"), message, help);
        }
        self.rest(key, beam);
        if let Some(radius) = beam.radius.filter(|radius| *radius <= 0.0) {
            let message = format!("the radius {radius} m is not positive");
            self.report(format!("{key}.radius"), message, "write a positive radius, or remove it");
        }
        if let Some(tension) = beam.tension {
            let key = format!("{key}.tension");
            if tension < 0.0 {
                let message = format!("the largest tension {tension} N is negative");
                self.report(key, message, "write 0 or more, or remove it");
            } else if beam.element_kind(&self.model.settings) == ElementKind::MeanDirectors {
                let message = "elements of mean directors have no tension mass".to_owned();
                self.report(key, message, "remove it, or write element = \"helicoidal\"");
            }
        }
    }

    /// What a beam is as drawn, and whether it is ever slack.
    fn rest(&mut self, key: &str, beam: &Beam) {
        let settings = &self.model.settings;
        let mean = beam.element_kind(settings) == ElementKind::MeanDirectors;
        let [length, curvature, prestress] =
            [beam.length.is_some(), beam.curvature.is_some(), beam.prestress.is_some()];
        let own = [("length", length), ("curvature", curvature), ("prestress", prestress)];
        for (name, _) in own.into_iter().filter(|(_, stated)| mean && *stated) {
            let message = format!("elements of mean directors have no {name}");
            let help = "remove it, or write element = \"helicoidal\" or \"rope\"";
            self.report(format!("{key}.{name}"), message, help);
        }
        if beam.length.is_some_and(|length| length <= 0.0) {
            let message = "the stress-free length is not positive".to_owned();
            self.report(format!("{key}.length"), message, "write a length in m, or remove it");
        }
        if prestress && (length || curvature) {
            let other = if length { "length" } else { "curvature" };
            let message = format!("`prestress` and `{other}` both say how the beam is strained");
            self.report(format!("{key}.prestress"), message, "keep one of them");
        }
        let rope = beam.element_kind(settings) == ElementKind::Rope;
        if rope && matches!(settings.method(), OrderMethod::Galerkin(_)) {
            let message = "the Galerkin schemes have no elements that carry tension only";
            let help = "write element = \"helicoidal\" where the rope stays taut, or method = \
                        \"composition\"";
            self.report(format!("{key}.element"), message.to_owned(), help);
        }
    }

    /// Helicoidal strains are those of configurations on the constraints.
    fn element(&mut self, key: &str, beam: &Beam) {
        let (key, settings) = (format!("{key}.element"), &self.model.settings);
        if matches!(beam.element, None | Some(BeamElement::MeanDirectors)) {
            return;
        }
        if settings.strain == Strain::Midpoint {
            let message =
                "the mean of two configurations, of which strain = \"midpoint\" takes the \
                           strains, has no orthonormal directors, which these elements need"
                    .to_owned();
            let help = "write element = \"mean_directors\", or remove `strain`";
            self.report(key, message, help);
        }
    }

    /// Whether the name is that of a node, or was refused as one.
    pub(crate) fn node_reference(&mut self, key: &str, name: &str) -> bool {
        let (beam, place) = match name.split_once('.') {
            Some((beam, place)) => (beam, Some(place)),
            None => (name, None),
        };
        let Some(found) = self.model.beam(beam) else {
            if place.is_none() {
                return false;
            }
            let beams: Vec<&str> = self.model.beams.iter().map(|b| b.name.as_str()).collect();
            let help = match nearest(beam, beams.iter().copied()) {
                Some(best) => format!("did you mean `{best}.{}`?", place.unwrap_or_default()),
                None if beams.is_empty() => "add a [[beam]] first".to_owned(),
                None => format!("there are: {}", some(&beams)),
            };
            self.report(key, format!("there is no beam named `{beam}`"), help);
            return true;
        };
        let last = found.node_count().saturating_sub(1);
        if last == 0 || place.is_some_and(|place| found.node(place).is_some()) {
            return true; // a beam without nodes is refused by itself
        }
        let message = match place {
            Some(place) => format!("`{beam}` has no node `{place}`"),
            None => format!("`{beam}` is a beam: name one of its nodes"),
        };
        let help = format!("write `{beam}.start`, `{beam}.end`, or `{beam}.0` to `{beam}.{last}`");
        self.report(key, message, help);
        true
    }
}
