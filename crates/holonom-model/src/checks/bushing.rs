//! Checks of bushings.

use crate::checks::Checker;
use crate::expression::ExpressionProgram;
use crate::formula::SIX;
use crate::types::bushing::{Bushing, BushingRotation, Coefficients};
use crate::{Formula, GROUND, Quantities};

/// Which of six coordinates a shaft turns about.
const ABOUT: usize = 5;

impl Checker<'_> {
    pub(crate) fn bushing(&mut self, key: &str, bushing: &Bushing, curves: &Quantities<'_>) {
        let Bushing { from, to, .. } = bushing;
        for (end, name) in [("from", from), ("to", to)] {
            let key = format!("{key}.{end}");
            if self.is_particle(name) {
                let message = format!("`{name}` is a particle, it has no rotation");
                self.report(key, message, "write a body, or a [[spring]] between points");
            } else {
                self.reference(key, name, &["body", GROUND]);
            }
        }
        self.two_ends(&format!("{key}.to"), from, to);
        if let Some(problem) = bushing.orientation().fault() {
            self.add(problem.below(key));
        }
        let settings = &self.model.settings;
        if settings.scheme.is_energy_momentum() {
            let message = format!("the scheme {} has no bushings", settings.scheme.name());
            self.report(key, message, "write a variational scheme, such as \"nodal\"");
        }
        let matrices = [("stiffness", &bushing.stiffness), ("damping", &bushing.damping)];
        let mut stated = matrices.map(|(name, own)| (name, own.is_some())).to_vec();
        stated.push(("preload", bushing.preload.is_some()));
        if bushing.force.is_some() {
            for (name, _) in stated.iter().filter(|(_, stated)| *stated) {
                let message = format!("the efforts are stated twice: `force` and `{name}`");
                let help = format!("remove `{name}`, or `force`");
                self.report(format!("{key}.{name}"), message, help);
            }
        } else if stated.iter().all(|(_, stated)| !stated) {
            let help = "add `stiffness = […]`, `damping = […]`, or `force = […]`";
            self.report(key, "the bushing has no effort".into(), help);
        }
        for (name, own) in matrices {
            for (i, j, entry) in own.iter().flat_map(Coefficients::entries) {
                let place = own.as_ref().map_or_else(String::new, |own| own.place(i, j));
                let tilts = i != ABOUT && j != ABOUT;
                self.six(&format!("{key}.{name}{place}"), bushing, tilts, entry, curves);
            }
        }
        for (i, entry) in bushing.force.iter().flatten().enumerate() {
            self.six(&format!("{key}.force[{i}]"), bushing, i != ABOUT, entry, curves);
        }
        let about = bushing.preload.is_some_and(|preload| preload[ABOUT] != 0.0);
        if bushing.rotation == BushingRotation::Tilt && about {
            self.turns_freely(format!("{key}.preload[{ABOUT}]"));
        }
    }

    /// An effort or a coefficient; `tilts`: whether it acts where the rotation is one of tilts.
    fn six(
        &mut self,
        key: &str,
        bushing: &Bushing,
        tilts: bool,
        entry: &Formula,
        curves: &Quantities<'_>,
    ) {
        let program = self.formula(key, entry, &SIX, curves, &mut Vec::new());
        let Some(program) = program else { return };
        if bushing.rotation == BushingRotation::Tilt
            && !tilts
            && ExpressionProgram::constant(&program) != Some(0.0)
        {
            self.turns_freely(key.to_owned());
        }
    }

    fn turns_freely(&mut self, key: String) {
        let message = "with `rotation = \"tilt\"` nothing acts about the third axis".to_owned();
        self.report(key, message, "write 0, or a [[law]] on a joint of the shaft");
    }
}
