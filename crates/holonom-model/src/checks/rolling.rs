//! Checks of rolling and of other constraints on velocities.

use crate::checks::Checker;
use crate::{Constraint, GROUND, Joint, JointKind, Scheme, Start};
use nalgebra::Vector3;

/// Flattest wheel: largest part of its axis along the normal.
const FLATTEST: f64 = 0.99;

impl Checker<'_> {
    pub(super) fn rolling(&mut self, key: &str, constraint: &Constraint) {
        let Constraint::Rolling { body, axis, radius, tube, plane, .. } = constraint else {
            return;
        };
        self.of_velocities(key);
        self.reference(format!("{key}.body"), body, &["body"]);
        if radius.is_nan() || *radius <= 0.0 {
            let message = format!("the radius {radius} is not positive");
            self.report(format!("{key}.radius"), message, "write the outer radius, m");
        }
        let at = format!("{key}.tube");
        if *tube < 0.0 {
            self.report(at, format!("{tube} is negative"), "write 0 or more, m");
        } else if axis.is_none() && *tube > 0.0 {
            let message = "a sphere has no tyre".to_owned();
            self.report(at, message, "remove `tube`, or give the wheel an `axis`");
        } else if *radius > 0.0 && tube >= radius {
            let message =
                format!("the section of the tyre, {tube} m, is as large as the wheel, {radius} m");
            let help = "`tube` is the radius of the section and part of `radius`; without `axis` a \
                        sphere rolls";
            self.report(at, message, help);
        }
        let normal = Vector3::from(plane.normal);
        if normal.amax() < 1e-100 {
            let message = "the normal has zero length".to_owned();
            self.report(
                format!("{key}.plane.normal"),
                message,
                "write a direction, such as [0, 0, 1]",
            );
            return;
        }
        self.carrier(&format!("{key}.plane.on"), &plane.on);
        let Some(axis) = axis.map(Vector3::from) else { return };
        let at = format!("{key}.axis");
        if axis.amax() < 1e-100 {
            let message = "the axis has zero length".to_owned();
            return self.report(at, message, "write the axis of the wheel, such as [0, 1, 0]");
        }
        let flatness = normal.normalize().dot(&axis.normalize()).abs();
        if flatness > FLATTEST {
            let message = if flatness > 1.0 - 1e-9 {
                "the axis is the normal of the plane: the wheel lies flat on it".to_owned()
            } else {
                format!(
                    "the wheel lies flat on the plane: {:.3} of its axis is along the normal, more \
                     than {FLATTEST}",
                    flatness
                )
            };
            self.report(at, message, "write the axis about which the wheel turns");
        }
    }

    /// A plane is carried by the ground, or by a body that is one with it.
    fn carrier(&mut self, key: &str, on: &str) {
        if !self.refers(key.to_owned(), on, &["body", GROUND]) {
            return;
        }
        let mut known = vec![on];
        let welded = |joint: &&Joint| joint.kind == JointKind::Fixed;
        let mut grounded = on == GROUND || self.points.is_fixed(on);
        while let (false, Some(member)) = (grounded, known.pop()) {
            let joints = self.model.joints.iter().filter(welded);
            grounded = joints.filter(|joint| joint.child == member).any(|joint| {
                known.push(&joint.parent);
                joint.parent == GROUND || self.points.is_fixed(&joint.parent)
            });
        }
        if !grounded {
            let message = format!("`{on}` may move: planes are fixed in the ground");
            let help = "write on = \"ground\", or weld the body to the ground; a plane that turns \
                        about its normal has a `spin`";
            self.report(key.to_owned(), message, help);
        }
    }

    /// What constraints on velocities are not integrated by.
    pub(super) fn of_velocities(&mut self, key: &str) {
        let settings = &self.model.settings;
        if settings.scheme == Scheme::Static {
            let message = "statics has no equilibria of what rolls or slides on a blade: where it \
                           rests depends on how it came there"
                .to_owned();
            return self.report(key, message, "write scheme = \"nodal\", with dampers");
        }
        if settings.start == Start::Relaxed {
            let message = "there is no relaxed start of what rolls or slides on a blade".to_owned();
            return self.report(key, message, "write start = \"stated\" under [simulation]");
        }
        if settings.scheme != Scheme::Nodal {
            let message = format!(
                "the scheme {} does not integrate constraints on velocities",
                settings.scheme.name()
            );
            return self.report(key, message, "write scheme = \"nodal\" under [simulation]");
        }
        if settings.method().stages().is_some() {
            let message =
                "the Galerkin schemes do not integrate constraints on velocities".to_owned();
            self.report(key, message, "write method = \"composition\" under [simulation]");
        }
    }
}
