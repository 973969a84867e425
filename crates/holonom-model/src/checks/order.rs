//! What a readable `[simulation]` may get wrong about the order and how it is reached.

use crate::checks::Checker;
use crate::types::settings::{HighOrder, Quadrature, Scheme, Strain};
use vi_core::Composition;
use vi_core::galerkin::Stages;

impl Checker<'_> {
    /// The order, and how it is reached.
    pub(crate) fn high_order(&mut self) {
        let settings = &self.model.settings;
        let (exists, help) = match settings.method {
            HighOrder::Composition => {
                (Composition::of_order(settings.order).is_some(), "write 2, 4, 6 or 8")
            }
            HighOrder::Galerkin => {
                (Stages::of_order(settings.order).is_some(), "write 2, 4, 6, 8, 10, 12, 14 or 16")
            }
        };
        if !exists {
            let message = format!("there is no scheme of order {}", settings.order);
            self.report("simulation.order", message, help);
        }
        if settings.method != HighOrder::Galerkin {
            return;
        }
        let scheme = settings.scheme;
        let lacks = |what: String| format!("the Galerkin schemes have no form {what}");
        let help = "write method = \"composition\"";
        if !matches!(scheme, Scheme::Nodal | Scheme::Constrained) {
            let message = lacks(format!("`{}`", scheme.name()));
            let help = "write scheme = \"nodal\", or method = \"composition\"";
            self.report("simulation.method", message, help);
        }
        if settings.quadrature != Quadrature::Midpoint {
            self.report("simulation.quadrature", lacks("with this quadrature".into()), help);
        }
        if !self.model.beams.is_empty() && settings.strain == Strain::Dissipative {
            let help = "write strain = \"averaged\", or method = \"composition\"";
            self.report("simulation.strain", lacks("of this strain energy".into()), help);
        }
    }
}
