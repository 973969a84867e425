//! Checks of loads.

use crate::checks::Checker;
use crate::quantity::Quantities;
use crate::types::frame::Frame;
use crate::types::load::Load;

impl Checker<'_> {
    /// What a particle cannot take.
    fn load_on_particle(&mut self, key: &str, load: &Load, name: &str) {
        let parts = [
            ("torque", load.torque.iter().any(|x| *x != 0.0), "has no rotation"),
            ("point", load.point.is_some(), "has no other points"),
            ("frame", load.frame == Frame::Body, "has no axes of its own"),
        ];
        for (part, _, why) in parts.into_iter().filter(|(_, stated, _)| *stated) {
            let message = format!("`{name}` is a particle, it {why}");
            self.report(format!("{key}.{part}"), message, format!("remove `{part}`"));
        }
    }

    /// A place along a beam.
    fn place_of_load(&mut self, key: &str, load: &Load, at: f64) {
        let beam = load.beam.as_deref().and_then(|name| self.model.beam(name));
        let Some(beam) = beam else {
            if load.beam.is_none() {
                let message = "a body has no places along it".to_owned();
                self.report(key, message, "write `beam`, or `point` in the place of `at`");
            }
            return;
        };
        let meshes = beam.meshes().unwrap_or_default();
        let length: f64 = meshes.iter().flat_map(|mesh| &mesh.lengths).sum();
        if !(0.0..=length * (1.0 + 1e-9)).contains(&at) && length > 0.0 {
            let message = format!("the beam has no place at {at} m: it is {length} m long");
            self.report(key, message, format!("write a length from 0 to {length}"));
        }
    }

    pub(crate) fn load(&mut self, key: &str, load: &Load, known: &Quantities<'_>) {
        match (&load.body, &load.beam) {
            (Some(body), None) => {
                self.reference(format!("{key}.body"), body, &["body", "particle"]);
                if self.is_particle(body) {
                    self.load_on_particle(key, load, body);
                }
            }
            (None, Some(beam)) => self.reference(format!("{key}.beam"), beam, &["beam"]),
            (None, None) => {
                let help = "add `body = …`, or `beam = …` for a load along a beam";
                self.report(key, "the load acts on nothing".into(), help);
            }
            (Some(_), Some(_)) => {
                let message = "the load acts on a body and along a beam".to_owned();
                self.report(format!("{key}.beam"), message, "keep one of them");
            }
        }
        if let Some(at) = load.at {
            self.place_of_load(&format!("{key}.at"), load, at);
        }
        if load.beam.is_some() && load.point.is_some() {
            let message = "a load along a beam has no point".to_owned();
            self.report(format!("{key}.point"), message, "remove `point`");
        }
        if load.relative_to.is_some() {
            let message = "the force and the torque have the axes of the body".to_owned();
            let help = "remove `relative_to`, or write frame = \"space\"";
            self.report(format!("{key}.relative_to"), message, help);
        }
        self.history(&format!("{key}.history"), &load.history, known);
    }
}
