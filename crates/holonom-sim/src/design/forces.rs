//! Springs, dampers, motors and loads by a parameter.

use super::{ModelTangent, NumberChain, eps, refused};
use holonom_model::{
    Control, Curves, Frame, History, JointMotor, JointSpring, Load, ModelError, MotionPath, Spring,
};
use std::sync::Arc;
use vi_core::Number;
use vi_core::force::MidpointForce;
use vi_core::num_dual::Dual64;
use vi_multibody::builder::ElementForce;
use vi_multibody::design::{
    EffortChange, EffortTangent, MechanismTangent, SpringTangent, WholeForce,
};
use vi_multibody::form::Form;
use vi_multibody::joint_force::JointLaw as _;
use vi_multibody::particle_load::ParticleLoad;
use vi_multibody::spring::Damper;
use vi_rigid::load::LoadChange;
use vi_rigid::time_history::TimeFunction;

use crate::system::input::Input;
use crate::system::time_function::{TimeFunctions, TimePath};
use crate::system::works::force_of;

impl NumberChain<'_> {
    /// Everything that acts.
    pub(super) fn forces(&self, found: &mut ModelTangent) -> Result<(), ModelError> {
        for k in 0..self.stated.joints.len() {
            self.drives(k, found)?;
        }
        let out = &mut found.numbers;
        for (k, spring) in self.stated.springs.iter().enumerate() {
            self.spring(k, spring, out);
        }
        for load in &self.stated.loads {
            let (key, out) = (format!("load.{}", load.name), &mut found.numbers);
            match load.beam {
                Some(_) => self.load_along(load, found)?,
                None => self.load(&key, &load.name, load, out),
            }
        }
        let out = &mut found.numbers;
        for own in self.stated.controls.iter().filter(|own| !self.is_on_particle(own)) {
            let (key, name) = (format!("control.{}", own.name), Input::of(own).source());
            own.load().into_iter().for_each(|load| self.load(&key, &name, &load, out));
        }
        Ok(())
    }

    /// A spring with its damper.
    fn spring(&self, k: usize, spring: &Spring, out: &mut MechanismTangent) {
        let key = format!("spring.{}", spring.name);
        let base = spring.relative_to.as_deref();
        let start =
            self.held(&format!("{key}.point_from"), &spring.from, spring.point_from.as_deref());
        let end = self.held(&format!("{key}.point_to"), &spring.to, spring.point_to.as_deref());
        let change = self.point_change(&spring.to, &end, base).minus(&self.point_change(
            &spring.from,
            &start,
            base,
        ));
        let number = |part: &str, value| self.slopes.number(&format!("{key}.{part}"), value);
        let stiffness = number("stiffness", spring.stiffness);
        let damping = number("damping", spring.damping);
        let at = |name: &str, own| self.placements.point(name, own, base);
        let distance = || {
            let between = at(&spring.to, end) - at(&spring.from, start);
            match between.amax() == Dual64::of(0.0) {
                true => Dual64::of(0.0),
                false => between.norm(),
            }
        };
        let natural = match (spring.natural_length, spring.tension) {
            (Some(length), _) => number("natural_length", length),
            (None, Some(tension)) => distance() - number("tension", tension) / stiffness,
            (None, None) => distance(),
        };
        let still = change.terms().is_empty() && change.constant_part().amax() == 0.0;
        if !still || [stiffness, natural, damping].iter().any(|own| own.eps != 0.0) {
            let (stiffness, natural_length) = (stiffness.eps, natural.eps);
            let (between, damping) = (change.clone(), damping.eps);
            out.springs.insert(k, SpringTangent { between, stiffness, natural_length, damping });
        }
        if damping.eps != 0.0 || (!still && damping.re != 0.0) {
            let between: &Form = &self.system.dynamics.forces.springs[k].between;
            let damper = Damper { between: between.with_tangent(&change), damping };
            out.dampers.push((spring.name.clone(), damper));
        }
    }

    /// Spring, damper and motor of a joint.
    fn drives(&self, k: usize, out: &mut ModelTangent) -> Result<(), ModelError> {
        let joint = &self.stated.joints[k];
        let key = format!("joint.{}", joint.name);
        let number = |part: &str, value| self.slopes.number(&format!("{key}.{part}"), value);
        let mut add = |part, freedom, by: EffortTangent| {
            out.drives.push((k, part, by.clone()));
            let force = force_of(&joint.name, part);
            out.numbers.efforts.push(EffortChange { force, joint: k, freedom, by });
        };
        if let Some(own) = &joint.spring {
            let by = [("stiffness", own.stiffness), ("rest", own.rest)];
            let by = by.map(|(part, value)| number(&format!("spring.{part}"), value).eps);
            if by.iter().any(|slope| *slope != 0.0) {
                add("spring", own.freedom, self.joint_spring(k, own, by));
            }
        }
        if let Some(own) = &joint.damper {
            let slope = number("damper.damping", own.damping).eps;
            if slope != 0.0 {
                add("damper", own.freedom, Arc::new(move |_, _, rate| -slope * rate));
            }
        }
        for (part, freedom, by) in self.resistances(k) {
            add(part, freedom, by);
        }
        if let Some(own) = &joint.motor {
            self.motor(&key, own, &mut |freedom, by| add("motor", freedom, by))?;
        }
        Ok(())
    }

    /// The effort of a spring of a joint by its stiffness and its rest, which change so; with a
    /// table it is `−k_θ (x − rest) − rest_θ ∂τ/∂x`.
    fn joint_spring(&self, k: usize, own: &JointSpring, by: [f64; 2]) -> EffortTangent {
        let Some(law) = TimeFunctions::new(self.model).spring("", own) else {
            let (place, numbers) = ((k, own.freedom), [own.stiffness, own.rest]);
            return EffortChange::of_spring("", place, numbers, by).by;
        };
        let ([stiffer, moved], rest) = (by, own.rest);
        Arc::new(move |t, x, rate| {
            -stiffer * (x - rest) - moved * law.slopes(t, x, rate).by_coordinate
        })
    }

    /// Effort and gains of a motor.
    fn motor(
        &self,
        key: &str,
        own: &JointMotor,
        add: &mut dyn FnMut(usize, EffortTangent),
    ) -> Result<(), ModelError> {
        let number =
            |part: &str, value| self.slopes.number(&format!("{key}.motor.{part}"), value).eps;
        let effort = number("effort", own.effort);
        let gains =
            [number("proportional", own.proportional), number("derivative", own.derivative)];
        let mut times = TimeFunctions::new(self.model);
        if let Some(path) = self.path_change(&format!("{key}.motor.path"), &own.path)? {
            let gains = [own.proportional, own.derivative];
            let by = move |t, _, _| {
                let [value, rate, _] = path(t);
                gains[0] * value + gains[1] * rate
            };
            add(own.freedom, Arc::new(by));
        }
        if let Some(change) = self.history_change(&format!("{key}.motor.history"), &own.history)? {
            let slope = times.history("", &change);
            let effort = own.effort;
            add(own.freedom, Arc::new(move |t, _, _| effort * slope.value(t)));
        }
        if effort != 0.0 {
            let history = times.history("", &own.history);
            add(own.freedom, Arc::new(move |t, _, _| effort * history.value(t)));
        }
        if gains.iter().any(|gain| *gain != 0.0) {
            if own.proportional == 0.0 && own.derivative == 0.0 {
                let what = "the derivative by the gains of a motor that does not control";
                return Err(refused(&format!("{key}.motor"), what, "state a gain other than zero"));
            }
            let path = times.path("", &own.path);
            let by = move |t, coordinate: f64, rate: f64| {
                let [value, speed, _] = path(t);
                gains[0] * (value - coordinate) + gains[1] * (speed - rate)
            };
            add(own.freedom, Arc::new(by));
        }
        Ok(())
    }

    /// How a history changes, by its expression or by its numbers; `None` where it does not.
    pub(super) fn history_change(
        &self,
        key: &str,
        history: &History,
    ) -> Result<Option<History>, ModelError> {
        if let History::Expression(formula) = history {
            return Ok(self.formulas.slope(key, formula)?.map(History::Expression));
        }
        if !self.slopes.touches(key) {
            return Ok(None);
        }
        let mut number = |part: &str, value| self.slopes.number(&format!("{key}.{part}"), value);
        let own = history.with_numbers(&Curves::new(self.model), &mut number);
        Ok(Some(History::Function(TimeFunction::new(move |t| own.value(t).eps))))
    }

    /// How a path changes: by its expression or by its numbers.
    pub(super) fn path_change(
        &self,
        key: &str,
        path: &MotionPath,
    ) -> Result<Option<TimePath>, ModelError> {
        if let Some(formula) = &path.expression {
            let Some(slope) = self.formulas.slope(key, formula)? else { return Ok(None) };
            let change = MotionPath { expression: Some(slope), ..MotionPath::default() };
            return Ok(Some(TimeFunctions::new(self.model).path("", &change)));
        }
        if !self.slopes.touches(key) {
            return Ok(None);
        }
        let own = path
            .with_numbers(&mut |part, value| self.slopes.number(&format!("{key}.{part}"), value));
        Ok(Some(Box::new(move |t| own(t).map(|part| part.eps))))
    }

    /// Whether a control is a force on a particle: its numbers have no derivatives.
    pub(super) fn is_on_particle(&self, control: &Control) -> bool {
        self.model.particles.iter().any(|own| control.body.as_ref() == Some(&own.name))
    }

    /// A load on a body or on a particle, or what the value 1 of a control is: its key, and the
    /// name of its force.
    fn load(&self, key: &str, name: &str, load: &Load, out: &mut MechanismTangent) {
        let Some(member) = load.body.as_deref() else { return };
        let vector = |part: &str, value| self.slopes.vector(&format!("{key}.{part}"), value);
        let (force, torque) = (vector("force", load.force), vector("torque", load.torque));
        let point = vector("point", load.point.unwrap_or_default());
        let base = self.placements.base(load.relative_to.as_deref()).rotation;
        let forces = &self.system.dynamics.forces.forces;
        if let Some(k) = self.model.particles.iter().position(|own| own.name == member) {
            let force = eps(&(base * force));
            if force.amax() != 0.0 {
                let mechanism = &self.system.mechanism;
                let (offset, dimension) =
                    (mechanism.particle_offset(k), mechanism.description().dimension);
                let history = TimeFunctions::new(self.model).history("", &load.history);
                let load = ParticleLoad { offset, dimension, force, history };
                let whole = WholeForce(Box::new(MidpointForce(load)));
                out.forces.push((name.to_owned(), Arc::new(whole)));
            }
            return;
        }
        let Some(frame) = self.model.frame(member) else { return };
        let axes = self.principal(frame);
        let turn = |x| match load.frame {
            Frame::Body => axes * eps(&x),
            Frame::Space => eps(&(base * x)),
        };
        let change =
            LoadChange { force: turn(force), torque: turn(torque), point: axes * eps(&point) };
        let own = forces
            .iter()
            .position(|own| own.name == name && matches!(own.force, ElementForce::Body(_)));
        if let Some(k) = own.filter(|_| change != LoadChange::default()) {
            out.loads.insert(k, change);
        }
    }
}
