//! Critical loads of a model: linear buckling about a static state.
//!
//! The loads of the path are scaled, what acts from its beginning is kept: weight, loads with a
//! constant history. The load factor 1 is the loads at the end, `t = end`. About the start, the
//! state is the equilibrium at `t = 0`; about the equilibrium at the end the factor counts from it.
//! See [`mod@vi_statics::buckling`].

use super::{About, BucklingFacts, Mode, ModeKind, ModesError, Report, ShapePoint, mode};
use crate::assembly::curved_elements::remarks_at;
use crate::experiment::RunnableModel as _;
use crate::statics::Statics;
use holonom_model::Model;
use nalgebra::Complex;
use vi_statics::{Buckling, BucklingError};

use super::ModalAnalysis;

/// Load factors beyond this are those of stresses that are round-off.
const FARTHEST: f64 = 1e9;

impl ModalAnalysis {
    /// The state of a model about which its critical loads are found.
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn of_loads(model: &Model, about: About) -> Result<Self, ModesError> {
        let mut statics = Statics::along_loads(model)?;
        match about {
            About::Start => statics.relax().map_err(ModesError::Statics)?,
            About::Static => statics.reach_end().map_err(ModesError::Statics)?,
            About::Rotation | About::Motion => return Err(BucklingError::Unjudged.into()),
        }
        let name = model.header.name.clone();
        let (rotation, motion, restless, ignored) = (None, None, 0.0, None);
        Ok(Self { statics, about, name, rotation, motion, restless, ignored })
    }

    /// The `count` lowest critical loads.
    ///
    /// # Errors
    /// [`ModesError::Buckling`].
    pub fn buckling(&mut self, count: usize) -> Result<Report, ModesError> {
        let end = self.statics.end();
        let dof = self.statics.assembly().counts.dof;
        let problem = self.statics.problem();
        let found = problem.buckling(count)?;
        let Buckling { critical, shapes, reversed, residual, asymmetry } = found;
        let (t, configuration) = (problem.factor(), problem.configuration().to_vec());
        let place = ShapePoint { members: self.statics.members(), q: &configuration };
        let shape = |(k, critical): (usize, &f64)| {
            let v: Vec<_> = shapes.column(k).iter().map(|v| Complex::new(*v, 0.0)).collect();
            let at_rest = mode(&place, ModeKind::Buckling, Complex::default(), &v);
            Mode { load_factor: Some(critical / end), omega_squared: 0.0, ..at_rest }
        };
        let near = critical.iter().take_while(|critical| critical.abs() < FARTHEST * end);
        let modes: Vec<Mode> = near.enumerate().map(shape).collect();
        let mut warnings = remarks_at(self.statics.beams(), &configuration, &[]);
        if asymmetry > 0.0 {
            warnings.push(format!(
                "the loads follow the motion and have no potential, the stiffness is not symmetric by {asymmetry:.1e} of its \
                 size: these are the loads at which another equilibrium appears (divergence); flutter may come before, which \
                 `holonom modes --at static` shows"
            ));
        }
        if modes.is_empty() {
            let beyond = match reversed {
                Some(_) => "under the loads reversed alone",
                None => "under no multiple of these loads",
            };
            warnings.push(format!("nothing buckles under these loads, {beyond}"));
        }
        Ok(Report {
            model: self.name.clone(),
            about: self.about,
            rotation: None,
            motion: None,
            t,
            dof,
            unstable: 0,
            zero: 0,
            round_off: 0.0,
            modes,
            residual,
            orthogonality: 0.0,
            unstable_by_inertia: None,
            buckling: Some(BucklingFacts { end, reversed: reversed.map(|t| t / end) }),
            configuration,
            warnings,
        })
    }
}
