//! Checks of joint stops, bumpers and dry friction of joints.

use crate::checks::Checker;
use crate::{Joint, Scheme, Start};

impl Checker<'_> {
    pub(super) fn joint_contacts(&mut self, key: &str, joint: &Joint) {
        self.limits(key, joint);
        self.bumper(key, joint);
        self.friction(key, joint);
    }

    fn limits(&mut self, key: &str, joint: &Joint) {
        let Some(limits) = joint.limits.map(|own| own.table()) else { return };
        let at = format!("{key}.limits");
        let unit = if joint.pair().is_angle(limits.freedom) { "rad" } else { "m" };
        let (lower, upper) = (limits.lower, limits.upper);
        if (lower, upper) == (None, None) {
            let message = "limits without a limit".to_owned();
            self.report(at.clone(), message, format!("write `lower` or `upper`, {unit}"));
        }
        match (lower, upper) {
            (Some(lower), Some(upper)) if lower >= upper => {
                let message = format!("the lower limit {lower} is not below the upper one {upper}");
                let help = format!("write limits = [lower, upper], {unit}");
                self.report(at.clone(), message, help);
            }
            _ if lower.is_some_and(|a| a > 0.0) || upper.is_some_and(|b| b < 0.0) => {
                let end = |limit: Option<f64>| limit.map_or(String::new(), |x| x.to_string());
                let message = format!(
                    "`{}` starts at 0, outside of its limits {} … {}",
                    joint.name,
                    end(lower),
                    end(upper)
                );
                let help = format!(
                    "joint coordinates are 0 in the initial configuration: measure limits from it, {unit}"
                );
                self.report(at.clone(), message, help);
            }
            _ => {}
        }
        if !(0.0..=1.0).contains(&limits.restitution) {
            let message = format!(
                "restitution of the limits of `{}` is {}: between 0 and 1",
                joint.name, limits.restitution
            );
            let help = "0 for a stop that takes the rate away, 1 for one that gives it back";
            self.report(format!("{at}.restitution"), message, help);
        }
        if joint.bumper.is_none() {
            self.nonsmooth(&at, "joint stops", Some("give the joint a `bumper`"));
        }
    }

    fn bumper(&mut self, key: &str, joint: &Joint) {
        let Some(bumper) = joint.bumper else { return };
        let at = format!("{key}.bumper");
        if bumper.stiffness.is_nan() || bumper.stiffness <= 0.0 {
            let message = format!("the stiffness {} is not positive", bumper.stiffness);
            self.report(format!("{at}.stiffness"), message, "without `bumper` stops are rigid");
        }
        if bumper.damping < 0.0 {
            let message = format!("{} is negative: it would feed energy in", bumper.damping);
            self.report(format!("{at}.damping"), message, "write 0 or more");
        }
        match joint.limits.map(|own| own.table()) {
            None => {
                let message = "a bumper stands at a limit, and the joint has none".to_owned();
                self.report(at, message, "add `limits = [lower, upper]`");
            }
            Some(limits) if limits.restitution > 0.0 => {
                let message = "a bumper has no restitution: its damping takes energy".to_owned();
                self.report(at, message, "remove `restitution`, or the bumper");
            }
            Some(_) => {}
        }
    }

    fn friction(&mut self, key: &str, joint: &Joint) {
        let Some(friction) = joint.friction else { return };
        let at = format!("{key}.friction");
        let angle = joint.pair().is_angle(friction.freedom);
        let (own, other) = if angle { ("torque", "force") } else { ("force", "torque") };
        let unit = if angle { "N·m" } else { "N" };
        let known = friction.freedom < joint.pair().coordinate_count();
        let coefficient = friction.coefficient;
        let (stated, wrong) = if angle {
            (friction.torque, friction.force)
        } else {
            (friction.force, friction.torque)
        };
        if known && wrong.is_some() {
            let of = if angle { "an angle" } else { "a displacement" };
            let message = format!("coordinate {} of the joint is {of}", friction.freedom);
            self.report(format!("{at}.{other}"), message, format!("write `{own}`, {unit}"));
        } else if known && stated.is_some() && coefficient.is_some() {
            let message = "friction is stated twice".to_owned();
            self.report(at.clone(), message, format!("write `{own}` or `coefficient`"));
        } else if known && stated.is_none() && coefficient.is_none() {
            let message = "friction without an effort".to_owned();
            let help = format!("write `{own}`, {unit}, or `coefficient`");
            self.report(at.clone(), message, help);
        } else if angle && coefficient.is_some() && friction.radius.is_none() {
            let message = "the radius of the pin is missing".to_owned();
            self.report(at.clone(), message, "write `radius`, m, with `coefficient`");
        }
        if known && friction.radius.is_some() && (!angle || coefficient.is_none()) {
            let message = match angle {
                true => "a radius without a coefficient".to_owned(),
                false => "a displacement has no radius".to_owned(),
            };
            self.report(format!("{at}.radius"), message, "remove `radius`");
        }
        let numbers = [
            ("torque", friction.torque),
            ("force", friction.force),
            ("coefficient", coefficient),
            ("radius", friction.radius),
        ];
        for (name, value) in numbers {
            if let Some(value) = value.filter(|value| *value < 0.0) {
                let message = format!("{value} is negative: it would feed energy in");
                self.report(format!("{at}.{name}"), message, "write 0 or more");
            }
        }
        if let Some(ratio) = friction.static_ratio {
            let at = format!("{at}.static_ratio");
            if friction.model.is_some() {
                let message = "smooth friction has a ratio of its own".to_owned();
                self.report(at, message, "write it in the `model`");
            } else if ratio.is_nan() || ratio < 1.0 {
                let message = format!("static friction is {ratio} of that of sliding");
                self.report(at, message, "write 1 or more");
            }
        }
        match friction.model {
            None => {
                let or = Some("give the friction a `model`");
                self.nonsmooth(&at, "dry friction", or);
            }
            Some(_) if coefficient.is_some() => {
                let message = "smooth friction has an effort of its own".to_owned();
                self.report(format!("{at}.coefficient"), message, format!("write `{own}`, {unit}"));
            }
            Some(model) => self.friction_course(&format!("{at}.model"), &model.course()),
        }
    }

    /// Impulses act in steps of the nodal scheme of order 2.
    pub(super) fn nonsmooth(&mut self, key: &str, what: &str, or: Option<&str>) {
        let settings = &self.model.settings;
        let or = or.map_or(String::new(), |or| format!(", or {or}"));
        if settings.scheme == Scheme::Static {
            let message = format!("statics has no equilibria with {what}: they are not unique");
            self.report(key, message, format!("write scheme = \"nodal\", with dampers{or}"));
        } else if settings.scheme != Scheme::Nodal {
            let message =
                format!("the scheme {} does not integrate {what}", settings.scheme.name());
            self.report(key, message, format!("write scheme = \"nodal\" under [simulation]{or}"));
        } else if settings.order != 2 {
            let message = format!("{what} are integrated with order 2, not {}", settings.order);
            self.report(key, message, format!("write order = 2 under [simulation]{or}"));
        }
        if settings.start == Start::Relaxed {
            let message = format!("there is no relaxed start with {what}");
            let help = format!("write start = \"stated\" under [simulation]{or}");
            self.report(key, message, help);
        }
    }
}
